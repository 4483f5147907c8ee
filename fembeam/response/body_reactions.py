"""What holds a body that is no `Beam`: the components that supports and springs exert, by d'Alembert's principle.

K u_s = f - M (ü + r ẍ) on the free dofs,  reaction = K_all u_s - f + M_all (ü + r ẍ) on the supported ones.

With K = RᵀR the stresses y = R u_s, imaginary where R is, are refined: K u_s loses what rounding of u_s does to the
stiffest element, Rᵀy not.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

from fembeam.scene import rigid_shapes
from fembeam.structures import COMPONENTS
from reduction.modal import factored

if TYPE_CHECKING:
    from fembeam.scene import BodyMatrices, Scene

Vector = NDArray[np.float64]
REFINED = 2  # times
REFINED_SOFT = 10  # same under compression: the nearer to buckling, the fewer digits each gains


class BodyHeld:
    """One body's static answer to unit loads (N_all, c): displacements, then what supports and springs take."""

    def __init__(self, scene: Scene, matrices: BodyMatrices, full: BodyMatrices, columns: Vector) -> None:
        self.scene, self.matrices, self.full, self.columns = scene, matrices, full, columns
        held = np.asarray(abs(matrices.spread).sum(axis=1)).ravel() == 0.0
        self.free = np.flatnonzero(~held)

    @cached_property
    def displacement(self) -> Vector:
        """u_s (N_all, c), refined against rounding of K; where K has no R."""
        K, u = self.full.K[self.free][:, self.free].tocsc(), np.zeros(self.columns.shape)
        for _ in range(1 + REFINED):
            u[self.free] += self._solve(self.columns[self.free] - K @ u[self.free])
        return u

    @cached_property
    def stresses(self) -> Vector | None:
        """Y (rows of R, c) with R_freeᵀ Y = load, those of springs last; None where K has no R."""
        if self.full.root is None:
            return None
        return balanced(self.full.root[:, self.free], self._solve, self.columns[self.free])

    @cached_property
    def _solve(self) -> Any:
        """F -> K⁻¹ f; with rigid-body modes that of the part of f that does not drive them."""
        own = self.matrices
        shapes = own.spread @ rigid_shapes(own)
        K, M = (A[self.free][:, self.free] for A in (self.full.K, self.full.M))
        return static_solver(K, M, shapes[self.free])

    def by(self, part: Any) -> Vector:
        """Components (6, c) of a support or spring per unit of each column."""
        out = np.zeros((6, self.columns.shape[1]))
        if getattr(part, "along", None) is not None:
            return np.outer(part.along, self._spring(part))
        rows, components = self.full.assembled.rows(part.z).tocsr(), self.scene.beam.components
        for dof in part.dofs:
            if dof in components:
                out[COMPONENTS.index(dof)] = (rows[components.index(dof)] @ self._balance)[0]
        return out

    @cached_property
    def _balance(self) -> Vector:
        """(N_all, c): what is missing on each dof, that supports exert."""
        if self.stresses is None:
            return np.asarray(self.full.K @ self.displacement - self.columns)
        return np.asarray((self.full.root.T @ self.stresses).real - self.columns)  # type: ignore[union-attr]

    def _spring(self, part: Any) -> Vector:
        """Force or moment (c,) of a spring."""
        if self.stresses is None:
            return np.asarray(-part.stiffness * (self.full.own_row(part.z, part.along) @ self.displacement)[0])
        number = next(i for i, one in enumerate(self.scene.springs) if one is part) - len(self.scene.springs)
        return np.asarray(-np.sqrt(part.stiffness) * self.stresses[number].real)


def static_solver(K: sparse.csr_matrix, M: sparse.csr_matrix, rigid: Vector) -> Any:
    """F -> K⁻¹ f; with rigid-body modes that of the part of f that does not drive them."""
    border = sparse.csr_matrix(M @ rigid)
    count = border.shape[1]
    if count == 0:
        return factored(K).solve
    factors = sparse_linalg.splu(sparse.bmat([[K, border], [border.T, None]], format="csc"))
    return lambda f: factors.solve(np.vstack([f, np.zeros((count, f.shape[1]))]))[: f.shape[0]]


def balanced(root: sparse.csr_matrix, solve: Any, load: Vector, stresses: Vector | None = None) -> Vector:
    """Stresses Y (rows of R, c) with RᵀY = load, nearest to the given ones, which rounding keeps from it."""
    found = np.zeros((root.shape[0], load.shape[1])) if stresses is None else stresses
    for _ in range(1 + (REFINED_SOFT if np.iscomplexobj(root) else REFINED)):
        found = found + root @ solve(load - (root.T @ found).real)
    return np.asarray(found)
