"""What holds a body that is no `Beam`: the components that supports and springs exert, by d'Alembert's principle.

K u_s = f - M (ü + r ẍ) on the free dofs,  reaction = K_all u_s - f + M_all (ü + r ẍ) on the supported ones.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

import reduction
from fembeam.structures import COMPONENTS

if TYPE_CHECKING:
    from fembeam.scene import BodyMatrices, Scene

Vector = NDArray[np.float64]
REFINED = 2  # times
MOST_RIGID = 6


class BodyHeld:
    """One body's static answer to unit loads (N_all, c): displacements, then what supports and springs take."""

    def __init__(self, scene: Scene, matrices: BodyMatrices, full: BodyMatrices, columns: Vector) -> None:
        self.scene, self.matrices, self.full, self.columns = scene, matrices, full, columns
        held = np.asarray(abs(matrices.spread).sum(axis=1)).ravel() == 0.0
        self.free = np.flatnonzero(~held)

    @cached_property
    def displacement(self) -> Vector:
        """u_s (N_all, c), refined against rounding of K."""
        K, u = self.full.K[self.free][:, self.free].tocsc(), np.zeros(self.columns.shape)
        solve = self._solver(K)
        for _ in range(1 + REFINED):
            u[self.free] += solve(self.columns[self.free] - K @ u[self.free])
        return u

    def _solver(self, K: sparse.csc_matrix) -> Any:
        """F -> K⁻¹ f; with rigid-body modes that of the part of f that does not drive them."""
        own = self.matrices
        lowest = reduction.modal_basis(own.M, own.K, min(MOST_RIGID, own.M.shape[0]), root=own.root)
        shapes = (own.spread @ lowest.vectors)[self.free][:, lowest.omega == 0.0]
        rigid = sparse.csr_matrix(self.full.M[self.free][:, self.free] @ shapes)
        count = rigid.shape[1]
        bordered = sparse.bmat([[K, rigid], [rigid.T, None]], format="csc") if count else K
        factors = sparse_linalg.splu(bordered)
        return lambda f: factors.solve(np.vstack([f, np.zeros((count, f.shape[1]))]))[: f.shape[0]]

    def by(self, part: Any) -> Vector:
        """Components (6, c) of a support or spring per unit of each column."""
        out = np.zeros((6, self.columns.shape[1]))
        if getattr(part, "along", None) is not None:
            row = self.full.own_row(part.z, part.along)
            return -part.stiffness * np.outer(part.along, (row @ self.displacement)[0])
        rows, components = self.full.assembled.rows(part.z).tocsr(), self.scene.beam.components
        balance = self.full.K @ self.displacement - self.columns
        for dof in part.dofs:
            if dof in components:
                out[COMPONENTS.index(dof)] = (rows[components.index(dof)] @ balance)[0]
        return out
