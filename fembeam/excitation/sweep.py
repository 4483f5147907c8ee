"""A sine whose frequency runs from one value to another: what a shaker does to find resonances.

    y = amplitude sin θ(t),   θ' = ω(t),   ω = ω_0 + (ω_1 - ω_0) t/T   or   ω = ω_0 (ω_1/ω_0)^(t/T)

Derivatives are Im[amplitude P_n(ω) exp(iθ)] with polynomials P_{n+1} = ω̇ dP_n/dω + iω P_n, ω̇ = (ω_1 - ω_0)/T or
ω ln(ω_1/ω_0)/T.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike, NDArray

from fembeam.excitation.line_spectrum import HERMITE_CONSTANT, checked_order, keep_number, tabulated
from fembeam.support import is_one_of

Vector = NDArray[np.float64]
Kind = Literal["linear", "logarithmic"]


@dataclass(frozen=True)
class SineSweep:
    """A sine of running frequency: amplitude sin θ(t), θ' from omega0 to omega1 within `duration`, up or down.

    linear: ω = ω_0 + (ω_1 - ω_0) t/T;   logarithmic: ω = ω_0 (ω_1/ω_0)^(t/T), so many octaves a minute.

    Parameters
    ----------
    amplitude : m for base motion, N for a force.
    omega0, omega1 : rad/s at the beginning and at the end, > 0.
    duration : T in s, > 0; a run must not be longer.
    kind : "linear" or "logarithmic".

    Raises
    ------
    ValueError : numbers out of range, another kind, a run longer than the sweep.

    Notes
    -----
    A linear mode responds nearly as to a steady tone while |ω̇| is well below (ζω)²; a faster sweep gives lower maxima
    at shifted frequencies.

    References
    ----------
    F.M. Lewis, Vibration during acceleration through a critical speed, Trans. ASME 54 (1932) 253.

    Examples
    --------
    >>> sweep = SineSweep(amplitude=1e-3, omega0=60.0, omega1=240.0, duration=100.0, kind="logarithmic")
    >>> round(float(sweep.omega(50.0)), 9), round(float(sweep.rate(50.0)), 6)
    (120.0, 1.663553)
    """

    amplitude: float
    omega0: float
    omega1: float
    duration: float
    kind: Kind = "linear"

    def __post_init__(self) -> None:
        keep_number(self, "amplitude")
        for name, unit in (("omega0", "rad/s"), ("omega1", "rad/s"), ("duration", "s")):
            keep_number(self, name, unit, above=0.0)
        if not is_one_of(self.kind, ("linear", "logarithmic")):
            raise ValueError(f"SineSweep kind must be 'linear' or 'logarithmic', got {self.kind!r}")

    @property
    def _growth(self) -> float:
        """κ = ln(ω_1/ω_0)/T of a logarithmic sweep, 1/s; 0 of a linear one."""
        return math.log(self.omega1 / self.omega0) / self.duration if self.kind == "logarithmic" else 0.0

    def omega(self, t: ArrayLike) -> Any:
        """Frequency ω (rad/s) at the instants t (s)."""
        times = np.asarray(t, dtype=np.float64)
        if self.kind == "linear":
            return self.omega0 + (self.omega1 - self.omega0) / self.duration * times
        return self.omega0 * np.exp(self._growth * times)

    def rate(self, t: ArrayLike) -> Any:
        """Sweep rate ω̇ (rad/s²) at the instants t (s)."""
        return self._rate(self.omega(t))

    @property
    def _rate(self) -> Polynomial:
        """ω̇ as a polynomial in ω."""
        if self.kind == "linear":
            return Polynomial([(self.omega1 - self.omega0) / self.duration])
        return Polynomial([0.0, self._growth])

    def angle(self, t: ArrayLike) -> Any:
        """Phase θ (rad) at the instants t (s), 0 at t = 0."""
        times = np.asarray(t, dtype=np.float64)
        if self.kind == "linear":
            return times * (self.omega0 + (self.omega1 - self.omega0) / (2 * self.duration) * times)
        growth = self._growth * times
        ratio = np.divide(np.expm1(growth), growth, out=np.ones_like(growth), where=growth != 0.0)
        return self.omega0 * times * ratio

    def __call__(self, t: ArrayLike) -> Any:
        """Value at the instants t (s), of any shape."""
        return self.derivative(0)(t)

    def derivative(self, order: int) -> SweepDerivative:
        """The signal d^order y/dt^order."""
        return SweepDerivative(self, checked_order(order))

    def for_duration(self, duration: float) -> SineSweep:
        """Return the signal itself; an error for a run longer than the sweep."""
        if duration > self.duration * (1 + 1e-9):
            raise ValueError(f"SineSweep is {self.duration:.6g} s long and shorter than the duration of {duration:.6g} "
                             "s; shorten the run, or sweep longer")  # fmt: skip
        return self

    def nodes(self, duration: float, rtol: float) -> tuple[float, Vector]:
        """Rows [s, s', s''] so dense that quintic Hermite interpolation errs by at most rtol of the largest value."""
        return self.derivative(0).nodes(duration, rtol)


@dataclass(frozen=True)
class SweepDerivative:
    """A derivative of a sweep: Im[amplitude P(ω) exp(iθ)]."""

    sweep: SineSweep
    order: int

    @property
    def factor(self) -> Polynomial:
        """P in ω, complex."""
        factor, turn = Polynomial([1.0 + 0.0j]), Polynomial([0.0, 1.0j])
        for _ in range(self.order):
            factor = self.sweep._rate * factor.deriv() + turn * factor
        return factor

    def __call__(self, t: ArrayLike) -> Any:
        """Value at the instants t (s), of any shape."""
        turning = np.exp(1j * self.sweep.angle(t))
        return (self.sweep.amplitude * (self.factor(self.sweep.omega(t)) * turning).imag)[()]

    def derivative(self, order: int) -> SweepDerivative:
        """The signal d^order s/dt^order."""
        return replace(self, order=self.order + checked_order(order))

    def for_duration(self, duration: float) -> SweepDerivative:
        """Return the signal itself; an error for a run longer than the sweep."""
        self.sweep.for_duration(duration)
        return self

    def nodes(self, duration: float, rtol: float) -> tuple[float, Vector]:
        """Rows [s, s', s''] for quintic Hermite interpolation: |error| <= h⁶/46080 max|s⁽⁶⁾| <= rtol max|s|."""
        self.for_duration(duration)
        passed = self.sweep.omega(np.linspace(0.0, duration, 2001))
        sixth, size = (np.abs(self.derivative(order).factor(passed)).max() for order in (6, 0))
        cells = max(1, math.ceil(duration / (HERMITE_CONSTANT * rtol * size / sixth) ** (1 / 6)))
        told, advice = f"a sweep to {passed.max():g} rad/s", "sweep in parts, or loosen rtol"
        return tabulated(self, duration, cells, told, advice)
