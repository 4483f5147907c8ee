"""Numbers, and dense and sparse matrices alike: products, checks."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

_ONE_THREAD = 200_000  # multiplications below which BLAS stays on one thread
Array = NDArray[np.float64]


def number(value: Any, what: str) -> float:
    """A real number as a float, nan and inf among them, or a clear error."""
    if type(value) is float:  # the usual case, 0.5 µs quicker
        return value
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | float | np.integer | np.floating):
        raise TypeError(f"{what} must be a number, got {value!r}; give SI units")
    try:
        return float(value)
    except OverflowError:  # a whole number beyond the floats
        return math.inf


def reals(values: Any, what: str, dimensions: int = 0, kind: Any = float) -> Array:
    """Numbers, real if not of another kind, in rows of equal length as a new array of at least so many dimensions."""
    try:
        if kind is float and np.iscomplexobj(values):  # numpy would drop the imaginary parts
            raise TypeError
        return np.array(values, dtype=kind, ndmin=dimensions)
    except (TypeError, ValueError):
        raise ValueError(f"{what} must be real numbers in rows of equal length, got {values!r}") from None


def product(rows: Array, matrix: Any) -> Array:
    """Rows (..., n) times a matrix (n, m), many of them in pieces too small for BLAS to spread over threads.

    Threads gain nothing on such thin arrays, and where other work fills the cores one waits for the other.
    """
    piece = max(1, _ONE_THREAD // max(1, math.prod(matrix.shape)))
    if rows.ndim != 2 or len(rows) <= piece:
        return rows @ matrix
    return np.concatenate([rows[i : i + piece] @ matrix for i in range(0, len(rows), piece)])


def dense(matrix: Any) -> Array:
    """A matrix as an array."""
    array = matrix.toarray() if hasattr(matrix, "toarray") else matrix
    array.setflags(write=False)
    return array


def square_matrix(name: str, matrix: Any, skew: bool = False) -> Any:
    """A finite copy of a symmetric or a ``skew`` matrix: sparse by columns if it was sparse, else dense."""
    matrix = matrix if hasattr(matrix, "toarray") else reals(matrix, name, 2, None)
    if np.iscomplexobj(matrix):
        turned = float(abs(np.imag(matrix.data if hasattr(matrix, "toarray") else matrix)).max(initial=0.0))
        if turned > 0.0:
            raise ValueError(
                f"{name} must be real, got imaginary parts up to {turned:g}; losses are those of C, or laws"
            )
        matrix = matrix.real
    if hasattr(matrix, "toarray"):
        from scipy.sparse import csc_array

        copied: Any = csc_array(matrix, dtype=float, copy=True)
        values = copied.data
    else:
        copied = values = reals(matrix, name, 2)
    if copied.ndim != 2 or copied.shape[0] != copied.shape[1] or not copied.shape[0]:
        raise ValueError(f"{name} must be square, got shape {copied.shape}")
    if not np.all(np.isfinite(values)):
        row, column = np.argwhere(~np.isfinite(dense(copied)))[0]
        raise ValueError(f"{name} must be finite, got {copied[row, column]} at row {row}, column {column}")
    wrong = abs(copied + copied.T if skew else copied - copied.T).max()
    if wrong > 1e-9 * abs(copied).max():
        if skew:
            raise ValueError(f"{name} must be skew, G = -Gᵀ; its largest |G + Gᵀ| is {wrong:g}")
        raise ValueError(f"{name} must be symmetric; its largest asymmetry is {wrong:g}")
    values.setflags(write=False)
    return copied


def check_mass(M: Any) -> None:
    """M is positive definite."""
    if hasattr(M, "toarray"):
        if _has_positive_pivots(M):
            return
        lowest = "not positive"
    else:
        try:
            np.linalg.cholesky(M)
            return
        except np.linalg.LinAlgError:
            lowest = f"{np.linalg.eigvalsh(M)[0]:g}"
    raise ValueError(
        f"M must be positive definite, its lowest eigenvalue is {lowest}; "
        "give every coordinate a mass or condense the massless ones"
    )


def _has_positive_pivots(M: Any) -> bool:
    """Whether a symmetric sparse matrix is positive definite: Gaussian elimination along its diagonal."""
    from scipy.sparse.linalg import splu

    try:
        factor = splu(M, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError:  # singular
        return False
    return bool(np.all(factor.perm_r == factor.perm_c) and np.all(factor.U.diagonal() > 0.0))
