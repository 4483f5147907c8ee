"""Smooth hysteresis after Bouc and Wen."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from contacts.law import Law
from contacts.numbers import LARGEST_PARAMETER, finite_row, number


@dataclass(frozen=True)
class BoucWen(Law):
    """Smooth hysteresis, F = α k δ + (1 - α) k z with z' = A δ̇ - β |δ̇| |z|^(n-1) z - γ δ̇ |z|^n.

    Between two reversals of δ̇ the displacement z is a function of δ alone, known in closed form for n = 1 and 2: it is
    evaluated, not integrated. Always active, at both signs of δ; z = 0 at δ = 0 at the start.

    Parameters
    ----------
    stiffness : k > 0, N/m.
    alpha : 0 <= α < 1, part of it that is elastic.
    A : > 0, slope of z at z = 0.
    beta, gamma : 1/m^n, shape of the loop. It dissipates for any motion if |γ| <= β.
    n : 1 or 2, sharpness of the knee.

    Notes
    -----
    R. Bouc, Proc. 4th Conf. Nonlinear Oscillations, Prague (1967) 315; Y.-K. Wen, J. Eng. Mech. Div. ASCE 102 (1976)
    249-263. With β + γ > 0 and β >= 0 |z| stays below (A/(β + γ))^(1/n). With β + γ < 0 it grows without bound, for
    n = 2 to infinity at a finite δ; beyond the largest float the force is nan. Loops within a loop do not close, and
    drift (no return-point memory): a property of the model, not of materials. At z = 0 the force has a weak kink where
    β ≠ 0; steps end there.

    Examples
    --------
    >>> BoucWen(1e4, 0.0, 1.0, 500.0, 500.0).along([0.0, 1e-3, 1.0]).round(6).tolist()
    [0.0, 6.321206, 10.0]
    """

    stiffness: float
    alpha: float
    A: float
    beta: float
    gamma: float
    n: Literal[1, 2] = 1

    home: ClassVar[str] = "contacts.memory.bouc_wen_kernels"
    compiled: ClassVar[str] = "bouc_wen"
    kinds: ClassVar[dict[str, str]] = {"bouc_wen": ""}
    equation: ClassVar[str] = (
        "F = alpha stiffness δ + (1 - alpha) stiffness z, z' = A δ̇ - beta |δ̇| |z|^(n-1) z - gamma δ̇ |z|^n"
    )
    units: ClassVar[dict[str, str]] = {"stiffness": "N/m", "beta": "1/m^n", "gamma": "1/m^n"}
    memory: ClassVar[tuple[int, ...]] = (6, 7, 8)  # type: ignore[misc]
    borders: ClassVar[int] = 2  # type: ignore[misc]
    events: ClassVar[tuple[str, ...]] = ("reversal", "zero")  # type: ignore[misc]
    segment_codes: ClassVar[tuple[tuple[float, ...], ...]] = ((-1.0, 0.0, 1.0), (), ())  # type: ignore[misc]
    one_sided: ClassVar[bool] = False  # type: ignore[misc]

    def __post_init__(self) -> None:
        number(self, "stiffness", strict=True)
        number(self, "alpha")
        number(self, "A", strict=True)
        for name in ("beta", "gamma"):
            number(self, name, -math.inf)
            finite_row(getattr(self, name), f"{name} of BoucWen", LARGEST_PARAMETER, 1.0 / LARGEST_PARAMETER)
        if self.alpha >= 1.0:
            raise ValueError(f"alpha of BoucWen must be below 1, got {self.alpha!r}; 1 is a spring (Polynomial([k]))")
        if not isinstance(self.n, (int, np.integer)) or isinstance(self.n, bool) or self.n not in (1, 2):
            raise ValueError(f"n of BoucWen must be 1 or 2, for which its path is known in closed form, got {self.n!r}")
        object.__setattr__(self, "n", int(self.n))

    @property
    def parameters(self) -> NDArray[np.float64]:
        """(α k, (1 - α) k, A, β, γ, n, direction, d_r, z_r)."""
        elastic, hysteretic = self.alpha * self.stiffness, (1.0 - self.alpha) * self.stiffness
        return np.array([elastic, hysteretic, self.A, self.beta, self.gamma, self.n, 0.0, 0.0, 0.0])

    @property
    def bound(self) -> float:
        """What |z| stays below, m; infinite where it grows without bound."""
        if self.beta < 0.0 or self.beta + self.gamma <= 0.0:
            return math.inf
        return float((self.A / (self.beta + self.gamma)) ** (1.0 / self.n))

    @property
    def reach(self) -> float:  # type: ignore[override]
        """Twice the δ at which a straight loading meets the bound; without one, at most 1/π of the way to a pole."""
        if self.bound < math.inf:
            return 2.0 * self.bound / self.A
        shape = max(abs(self.beta + self.gamma), abs(self.beta - self.gamma))
        return 0.5 * (self.A / shape) ** (1.0 / self.n) / self.A if shape else 1.0

    @property
    def remarks(self) -> tuple[str, ...]:  # type: ignore[override]
        """What a user should know."""
        bounded = f"|z| stays below {self.bound:.4g} m" if self.bound < math.inf else "z grows without bound"
        passive = "dissipates for any motion" if abs(self.gamma) <= self.beta else "may give energy: |gamma| > beta"
        return f"{bounded}; {passive}", "inner loops do not close"

    def stored(self, delta: float, parameters: NDArray[np.float64]) -> float:
        """Energy ½ α k δ² + ½ (1 - α) k z²/A, J: S. Erlicher, N. Point, Mech. Res. Commun. 31 (2004) 409-416."""
        elastic, hysteretic, A = parameters[:3].tolist()
        force = float(self.batch(1.0, parameters)(np.array([delta]), np.zeros(1))[0])
        z = (force - elastic * delta) / hysteretic
        return 0.5 * elastic * delta**2 + 0.5 * hysteretic * z**2 / A
