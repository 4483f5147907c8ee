"""The reduction basis: u = Φ q with ΦᵀMΦ = 1 and ΦᵀKΦ = diag(ω²)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

Vector = NDArray[np.float64]

TIE = 1e-6  # relative: values this close to the largest count as equal, so that rounding never decides a sign
NODE = 1e-9  # relative: a mode this small in the given direction has a node there


def reals(values: ArrayLike, name: str, where: str) -> Vector:
    """Real numbers of any shape as a new array of floats, or a clear error."""
    try:
        given = np.asarray(values)
    except ValueError:  # rows of unequal length
        given = np.asarray(None)
    if given.dtype.kind not in "iuf":
        raise ValueError(f"{name} must be real numbers, got {values!r} in {where}; give an array of numbers")
    return given.astype(float)


class AccuracyError(RuntimeError):
    """A computed basis failed its own check; the message carries the number."""


@dataclass(frozen=True, eq=False)
class Basis:
    """Mass-normalised vectors and their frequencies: u = Φ q, ΦᵀMΦ = 1, ΦᵀKΦ = diag(ω²).

    Parameters
    ----------
    vectors : Φ (N, n), columns ordered by omega.
    omega : (n,) in rad/s, not negative; exactly 0.0 for rigid-body modes.

    Raises
    ------
    ValueError : shapes that do not match, numbers that are not finite.

    Examples
    --------
    >>> basis = Basis(np.eye(3)[:, :2], np.array([1.0, 2.0]))
    >>> basis.project([5.0, 6.0, 7.0])
    array([5., 6.])
    >>> basis.expand([[1.0, 2.0]])
    array([[1., 2., 0.]])
    """

    vectors: Vector
    omega: Vector

    def __repr__(self) -> str:
        return f"<basis of {len(self.omega)} vectors over {len(self.vectors)} dofs>"

    def __post_init__(self) -> None:
        vectors, omega = reals(self.vectors, "vectors", "Basis"), reals(self.omega, "omega", "Basis")
        if vectors.ndim != 2 or omega.shape != vectors.shape[1:]:
            raise ValueError(
                f"vectors (N, n) and omega (n,) must match, got {vectors.shape} and {omega.shape} in Basis; "
                "give one frequency per column"
            )
        for name, value in (("vectors", vectors), ("omega", omega)):
            if not np.isfinite(value).all():
                raise ValueError(f"{name} of a Basis must be finite, got {value[~np.isfinite(value)][0]}")
            value.flags.writeable = False
            object.__setattr__(self, name, value)

    @property
    def count(self) -> int:
        """Number n of vectors."""
        return len(self.omega)

    def project(self, v: ArrayLike | sparse.spmatrix) -> Vector:
        """Φᵀ v for a vector (N,) or columns (N, k), dense or sparse: a load or a contact direction."""
        if sparse.issparse(v):
            columns: Any = v
            return np.asarray((columns.T @ self.vectors).T)
        return self.vectors.T @ np.asarray(v, dtype=float)

    def project_matrix(self, A: ArrayLike | sparse.spmatrix) -> Vector:
        """ΦᵀAΦ (n, n) for a matrix (N, N), dense or sparse."""
        matrix: Any = A if sparse.issparse(A) else np.asarray(A, dtype=float)
        return self.vectors.T @ (matrix @ self.vectors)

    def expand(self, q: ArrayLike) -> Vector:
        """Φ q: coordinates (…, n) to displacements (…, N)."""
        return np.asarray(q, dtype=float) @ self.vectors.T

    def participation(self, load: ArrayLike) -> Vector:
        """Γ = Φᵀ load (n,); load (N,) = M r for a base motion along r, columns of supported dofs included."""
        return self.project(load)

    def effective_mass(self, load: ArrayLike) -> Vector:
        """Γ² (n,) in kg: the part of the moved mass that each mode carries."""
        return self.participation(load) ** 2


def checked_basis(basis: Basis, where: str) -> Basis:
    """The basis; TypeError for what is none."""
    if not isinstance(basis, Basis):
        raise TypeError(f"basis must be a Basis, got {basis!r} in {where}; make one with modal_basis(M, K)")
    return basis


def oriented(basis: Basis, direction: ArrayLike | sparse.spmatrix | None = None) -> Basis:
    """The same basis with the sign of every vector fixed: direction · φ > 0.

    Parameters
    ----------
    basis : its signs may be any.
    direction : (N,) or (k, N)
        A row, or rows of which the one with the largest |row · φ| decides, the last one in a tie within 1e-6.
        Rows of displacement from the support to the free end thus make each mode positive where it moves
        most, nearest the free end. None, or a mode with a node at every row: the largest entry decides.

    Returns
    -------
    Basis : a new one.

    Examples
    --------
    >>> oriented(Basis(-np.eye(2), np.ones(2)), [1.0, 1.0]).vectors
    array([[1., 0.],
           [0., 1.]])
    """
    default = _deciding(checked_basis(basis, "oriented").vectors)
    signs = np.sign(default)
    if direction is not None:
        rows: Any = (
            direction if sparse.issparse(direction) else np.atleast_2d(reals(direction, "direction", "oriented"))
        )
        if rows.shape[1:] != basis.vectors.shape[:1]:
            raise ValueError(
                f"direction must be rows of {len(basis.vectors)} numbers, got {rows.shape} in oriented; give (k, N)"
            )
        chosen = _deciding(np.asarray(rows @ basis.vectors))
        signs = np.where(np.abs(chosen) > NODE * np.abs(default), np.sign(chosen), signs)
    return replace(basis, vectors=basis.vectors * signs)


def _deciding(values: Vector) -> Vector:
    """Per column of (k, n) the value largest in size; the last one in a tie."""
    size = np.abs(values)
    tied = size >= (1 - TIE) * size.max(axis=0)
    last = len(values) - 1 - np.argmax(tied[::-1], axis=0)
    return values[last, np.arange(values.shape[1])]
