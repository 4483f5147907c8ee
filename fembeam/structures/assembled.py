"""The matrices of a body that is not a straight beam, with a name for every dof and rows for every place.

M ü + (C + G) u̇ + K u = f,    u(place) = R u,    a base motion y(t) along x loads with -M r_x ÿ
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")  # of a node's motion: displacements in m, rotations in rad


@dataclass(frozen=True, eq=False)
class Assembled:
    """Full matrices of one body, without what a scene adds: supports, masses, springs, dashpots.

    Attributes
    ----------
    M, K : (N, N) sparse CSR, symmetric; kg and N/m for displacements.
    labels : (node, component) of every dof, (N,).
    rows : place -> sparse CSR (c, N): a row for each of the body's `components` at a place, along the global axes.
    translations : (N, d): the rigid unit translations along those of x, y, z that the body has.
    root : sparse R with RᵀR = K, or None.
    C : (N, N) damping of the body itself, or None.
    gyroscopic : (N, N) skew-symmetric G, or None.
    accuracy : what the mesh promises, a sentence.
    moved : (N, d): the M r of these translations, where a reduced M does not have them; None: it has.

    Examples
    --------
    >>> from scipy import sparse
    >>> one = sparse.eye(1, format="csr")
    >>> Assembled(one, 4.0 * one, ((7, "x"),), lambda place: one, np.ones((1, 1))).labels
    ((7, 'x'),)
    """

    M: sparse.csr_matrix
    K: sparse.csr_matrix
    labels: tuple[tuple[Hashable, str], ...]
    rows: Callable[[Any], sparse.csr_matrix]
    translations: NDArray[np.float64]
    root: sparse.csr_matrix | None = None
    C: sparse.csr_matrix | None = None
    gyroscopic: sparse.csr_matrix | None = None
    accuracy: str = ""
    moved: NDArray[np.float64] | None = None

    @property
    def base_loads(self) -> NDArray[np.float64]:
        """M r (N, d) of the translations."""
        return np.asarray(self.M @ self.translations) if self.moved is None else self.moved

    def rows_of(self, places: Sequence[Any]) -> sparse.csr_matrix:
        """`rows` of several places, one below the other."""
        return sparse.vstack([self.rows(place) for place in places], format="csr")

    def __repr__(self) -> str:
        return f"<{len(self.labels)} dofs: {self.accuracy}>"
