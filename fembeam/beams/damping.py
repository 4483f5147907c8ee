"""Damping of the linear structure: modal ratios ζ or C = α M + β K.

Either form answers two questions: what each mode gets (2ζω, in q'' + 2ζω q' + ω² q = …) and the full C.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

import reduction
from fembeam.support import is_listed, make_native, require, require_non_negative

FULL_MATRIX_LIMIT = 2000  # free dofs: C of modal damping is dense, 32 MB here, and takes all modes (about 10 s)


@dataclass(frozen=True, init=False)
class ModalDamping:
    """A damping ratio per mode: C = M Φ diag(2 ζ ω) Φᵀ M.

    Parameters
    ----------
    zeta : one number for all modes, or one per mode (0-based mode number of the structure); the last value
        continues for all higher modes. Not negative; ζ ≥ 1 (overdamped) is allowed.

    Raises
    ------
    ValueError : empty, negative or not finite.

    Notes
    -----
    Rigid-body modes (ω = 0) are not damped, whatever their ζ.

    Examples
    --------
    >>> ModalDamping([0.02, 0.01]).ratios([1.0, 2.0, 3.0])
    array([0.02, 0.01, 0.01])
    """

    zeta: tuple[float, ...]

    def __init__(self, zeta: float | Sequence[float] | NDArray[np.float64]) -> None:
        values = tuple(zeta) if isinstance(zeta, (Sequence, np.ndarray)) and is_listed(zeta) else (zeta,)
        require(len(values) > 0, "zeta must hold a value", zeta, "ModalDamping", "give one ratio per mode")
        for index, value in enumerate(values):
            require_non_negative(f"zeta[{index}]", value, "ModalDamping", "give ratios such as 0.02")
        object.__setattr__(self, "zeta", tuple(float(value) for value in values))

    def ratios(self, omega: ArrayLike, indices: ArrayLike | None = None) -> NDArray[np.float64]:
        """ζ (n,) for modes of omega (n,) in rad/s; `indices`: mode numbers if not 0, 1, … in turn."""
        number = np.arange(np.size(omega)) if indices is None else np.asarray(indices, dtype=int)
        return np.asarray(self.zeta)[np.minimum(number, len(self.zeta) - 1)]

    def modal_coefficients(self, omega: ArrayLike, indices: ArrayLike | None = None) -> NDArray[np.float64]:
        """2ζω (n,) in 1/s."""
        return 2 * self.ratios(omega, indices) * np.asarray(omega, dtype=float)

    def matrix(
        self, M: sparse.csr_matrix, K: sparse.csr_matrix, root: sparse.csr_matrix | None = None
    ) -> sparse.csr_matrix:
        """C (N, N) in N s/m from all modes; root with rootᵀ root = K sharpens them; not for large N."""
        size = M.shape[0]
        if not any(self.zeta):
            return sparse.csr_matrix((size, size))
        require(size <= FULL_MATRIX_LIMIT,
                f"the full damping matrix of ModalDamping needs at most {FULL_MATRIX_LIMIT} free dofs", size,
                "ModalDamping.matrix", "reduce the model, use fewer elements, or use Rayleigh")  # fmt: skip
        basis = reduction.modal_basis(M, K, root=root)
        momentum = M @ basis.vectors
        return sparse.csr_matrix(momentum * self.modal_coefficients(basis.omega) @ momentum.T)


@dataclass(frozen=True)
class Rayleigh:
    """Proportional damping: C = α M + β K, so ζ = (α/ω + β ω)/2.

    Parameters
    ----------
    alpha : 1/s, not negative. It damps rigid-body motion too.
    beta : s, not negative.

    Raises
    ------
    ValueError : negative or not finite.

    Notes
    -----
    Ratios ζ₁ at ω₁ and ζ₂ at ω₂ ask for β = 2 (ζ₂ω₂ - ζ₁ω₁)/(ω₂² - ω₁²) and α = 2 ζ₁ω₁ - β ω₁². Between the two ζ is
    smaller, above ω₂ it grows with ω: static shapes, which are modes of high frequency, are damped strongly.

    Examples
    --------
    >>> Rayleigh(alpha=1.0, beta=0.25).ratios([2.0])
    array([0.5])
    """

    alpha: float
    beta: float

    def __post_init__(self) -> None:
        make_native(self)
        require_non_negative("alpha", self.alpha, "Rayleigh", "give the mass factor in 1/s")
        require_non_negative("beta", self.beta, "Rayleigh", "give the stiffness factor in s")

    def ratios(self, omega: ArrayLike, indices: ArrayLike | None = None) -> NDArray[np.float64]:
        """ζ (n,); infinite where ω = 0 and α > 0, so prefer `modal_coefficients` with rigid-body modes."""
        omega = np.asarray(omega, dtype=float)
        at_rest = np.inf if self.alpha > 0 else 0.0
        ratios = np.full_like(omega, at_rest)
        np.divide(self.modal_coefficients(omega), 2 * omega, out=ratios, where=omega > 0)
        return ratios

    def modal_coefficients(self, omega: ArrayLike, indices: ArrayLike | None = None) -> NDArray[np.float64]:
        """2ζω = α + β ω² (n,) in 1/s, defined for every ω."""
        return self.alpha + self.beta * np.asarray(omega, dtype=float) ** 2

    def matrix(
        self, M: sparse.csr_matrix, K: sparse.csr_matrix, root: sparse.csr_matrix | None = None
    ) -> sparse.csr_matrix:
        """C = α M + β K (N, N) in N s/m."""
        return sparse.csr_matrix(self.alpha * M + self.beta * K)
