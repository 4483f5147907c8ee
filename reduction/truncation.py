"""How many modes: up to a frequency, or until they carry a share of the moved mass."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import linalg as sparse_linalg

from reduction.basis import Basis, Vector, reals
from reduction.modal import Matrix, checked_matrix, modal_basis

Enough = Callable[[Basis], int | None]
FIRST_TRY = 8
MASS_ROUNDING = 1e-9  # relative: all modes carry the whole mass but for rounding


def fewest_modes(M: Matrix, K: Matrix, enough: Enough, root: Matrix | None = None) -> Basis:
    """The lowest modes, as few as a criterion asks for.

    Parameters
    ----------
    M, K, root : as for `modal_basis`.
    enough : `below(omega_max)`, `carrying(share, load, mass)`, or any function of a basis of the lowest modes that
        gives how many of them suffice, None while it cannot tell.

    Returns
    -------
    Basis : at least one mode; all of them when the criterion cannot tell even then.

    Raises
    ------
    ValueError : the criterion asks for no mode.

    Examples
    --------
    >>> fewest_modes(np.eye(4), np.diag([1.0, 4.0, 9.0, 16.0]), below(2.5)).omega
    array([1., 2.])
    """
    size, tried, count = checked_matrix(K, "K", "fewest_modes").shape[0], 0, None
    while count is None:
        tried = min(size, max(FIRST_TRY, 2 * tried))
        basis = modal_basis(M, K, tried, root=root)
        count = enough(basis)
        if count is None and tried == size:
            return basis
    return first(basis, count)


def first(basis: Basis, count: int) -> Basis:
    """The first `count` vectors; ValueError when there are none."""
    if not 1 <= count <= basis.count:
        raise ValueError(f"at least one mode must be kept, got {count} of {basis.count} in truncation; ask for more")
    return Basis(basis.vectors[:, :count], basis.omega[:count])


def below(omega_max: float) -> Enough:
    """Criterion: all modes with ω ≤ omega_max (rad/s, > 0).

    Examples
    --------
    >>> fewest_modes(np.eye(3), np.diag([1.0, 4.0, 9.0]), below(1.5)).count
    1
    """
    if not 0 < _number(omega_max) < np.inf:
        raise ValueError(f"omega_max must be positive and finite (rad/s), got {omega_max!r} in below; give a frequency")

    def count(basis: Basis) -> int | None:
        return None if basis.omega[-1] <= omega_max else int(np.sum(basis.omega <= omega_max))

    return count


def carrying(share: float, load: ArrayLike, mass: float) -> Enough:
    """Criterion: Σ Γ_i² ≥ share · mass, the effective masses along a load.

    Parameters
    ----------
    share : in (0, 1].
    load : (N,) = M r, kg, for a motion r of the frame.
    mass : kg; all of it is `moved_mass(M, load)`.

    Examples
    --------
    >>> M, K, load = np.diag([3.0, 1.0]), np.diag([3.0, 4.0]), np.array([3.0, 1.0])
    >>> fewest_modes(M, K, carrying(0.7, load, moved_mass(M, load))).count
    1
    """
    load = reals(load, "load", "carrying")
    if not np.isfinite(load).all():
        raise ValueError(f"load must be finite, got {load} in carrying; give M r")
    if not 0 < _number(share) <= 1:
        raise ValueError(f"share must lie in (0, 1], got {share!r} in carrying; give a part such as 0.95")
    if not 0.0 < _number(mass) < np.inf:
        raise ValueError(f"mass must be positive and finite (kg), got {mass!r} in carrying; use moved_mass(M, load)")

    def count(basis: Basis) -> int | None:
        met = np.cumsum(basis.effective_mass(load)) >= share * mass * (1 - MASS_ROUNDING)
        return int(np.argmax(met)) + 1 if met[-1] else None

    return count


def moved_mass(M: Matrix, load: Vector) -> float:
    """Sum of the effective masses over all modes, bᵀM⁻¹b in kg, for a load b (N,) = M r.

    Examples
    --------
    >>> moved_mass(np.diag([3.0, 1.0]), np.array([3.0, 1.0]))
    4.0
    """
    b, matrix = reals(load, "load", "moved_mass"), checked_matrix(M, "M", "moved_mass")
    if b.shape != matrix.shape[:1] or not np.isfinite(b).all():
        raise ValueError(f"load must be {matrix.shape[0]} finite numbers, got {load!r} in moved_mass; give M r")
    return float(b @ sparse_linalg.splu(matrix).solve(b))


def _number(value: object) -> float:
    """The value as a float, nan where it is no real number."""
    real = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    try:
        return float(value) if real else np.nan  # type: ignore[arg-type]
    except OverflowError:  # a whole number beyond the floats
        return np.inf
