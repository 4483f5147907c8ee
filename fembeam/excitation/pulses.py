"""Signals that happen once: a pulse and a step, smooth enough for every method to keep its order.

    pulse = peak (1 - s²)⁹,   step = size ∫(1 - s²)⁸ ds / ∫₋₁¹,   s = 2 (t - at)/length - 1 in [-1, 1]

Eight derivatives are continuous at both ends, so the load of a base motion, its second derivative, is as smooth as the
tables of the integrators ask for. A load that acts suddenly at t = 0 is `Harmonic(size, omega=0.0)`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike, NDArray

from fembeam.excitation.line_spectrum import HERMITE_CONSTANT, checked_order, keep_number, tabulated
from fembeam.excitation.unlimited import Unlimited

BELL = Polynomial([1.0, 0.0, -1.0])  # 1 - s²


@dataclass(frozen=True)
class _Wave(Unlimited):
    """size p(s) while s in [-1, 1], 0 before, size `after` afterwards; `coefficients` of p."""

    coefficients: tuple[float, ...]
    size: float
    at: float
    length: float
    after: float = 0.0

    def __call__(self, t: ArrayLike) -> Any:
        """Value at the instants t (s), of any shape."""
        s = np.asarray(2 * (np.asarray(t, dtype=np.float64) - self.at) / self.length - 1)
        value, within = np.where(s > 1, self.after, 0.0), ~(np.abs(s) > 1)  # mostly few instants
        value[within] = Polynomial(self.coefficients)(s[within])
        return (self.size * value)[()]

    def derivative(self, order: int) -> _Wave:
        """The signal d^order y/dt^order."""
        if checked_order(order) == 0:
            return self
        p = Polynomial(self.coefficients).deriv(order)
        return replace(self, coefficients=tuple(p.coef), size=self.size * (2 / self.length) ** order, after=0.0)

    def nodes(self, duration: float, rtol: float) -> tuple[float, NDArray[np.float64]]:
        """Rows [s, s', s''] so dense that quintic Hermite interpolation errs by at most rtol of the peak."""
        fine = np.linspace(-1, 1, 2001)
        p = Polynomial(self.coefficients)
        sixth = np.abs(p.deriv(6)(fine)).max() * (2 / self.length) ** 6
        widest = (HERMITE_CONSTANT * rtol * np.abs(p(fine)).max() / sixth) ** (1 / 6)
        cells = math.ceil(duration / widest)
        advice = "simulate a shorter time or use a longer signal"
        return tabulated(self, duration, cells, f"a signal of {self.length:g} s", advice)


@dataclass(frozen=True)
class _Once(Unlimited):
    """What pulse and step share: they are called, derived and tabulated as their wave."""

    @property
    def wave(self) -> _Wave:
        """The polynomial behind it."""
        raise NotImplementedError

    def __call__(self, t: ArrayLike) -> Any:
        """Value at the instants t (s), of any shape."""
        return self.wave(t)

    def derivative(self, order: int) -> _Wave:
        """The signal d^order y/dt^order."""
        return self.wave.derivative(order)

    def nodes(self, duration: float, rtol: float) -> tuple[float, NDArray[np.float64]]:
        """Rows [s, s', s''] for quintic Hermite interpolation within rtol of the peak."""
        return self.wave.nodes(duration, rtol)


@dataclass(frozen=True)
class Pulse(_Once):
    """A bell-shaped pulse: peak (1 - s²)⁹ for `length` seconds from `at` on.

    Parameters
    ----------
    peak : m for base motion, N for a force.
    length : s, > 0; half of the peak is exceeded for 0.27 of it.
    at : s, ≥ 0, where it begins.

    Raises
    ------
    ValueError : not finite, a length of 0, a beginning before t = 0.

    Examples
    --------
    >>> knock = Pulse(peak=100.0, length=1e-3, at=0.5)
    >>> float(knock(0.5005)), round(knock.impulse, 6)
    (100.0, 0.028377)
    """

    peak: float
    length: float
    at: float = 0.0

    def __post_init__(self) -> None:
        keep_number(self, "peak")
        keep_number(self, "length", "s", above=0.0)
        keep_number(self, "at", "s", least=0.0)

    @property
    def wave(self) -> _Wave:
        """The polynomial behind it."""
        return _Wave(tuple((BELL**9).coef), self.peak, self.at, self.length)

    @property
    def impulse(self) -> float:
        """∫ dt: N s of a force."""
        area = (BELL**9).integ()
        return float(self.peak * self.length / 2 * (area(1.0) - area(-1.0)))


@dataclass(frozen=True)
class Step(_Once):
    """A smooth step from 0 to `size` within `rise` seconds from `at` on.

    Parameters
    ----------
    size : m for base motion, N for a force.
    rise : s, > 0. For a sudden load at t = 0 use `Harmonic(size, omega=0.0)`.
    at : s, ≥ 0, where it begins.

    Raises
    ------
    ValueError : not finite, a rise of 0, a beginning before t = 0.

    Examples
    --------
    >>> load = Step(size=10.0, rise=0.1)
    >>> [round(float(load(t)), 9) for t in (0.0, 0.05, 0.1, 3.0)]
    [0.0, 5.0, 10.0, 10.0]
    """

    size: float
    rise: float
    at: float = 0.0

    def __post_init__(self) -> None:
        keep_number(self, "size")
        keep_number(self, "rise", "s", above=0.0)
        keep_number(self, "at", "s", least=0.0)

    @property
    def wave(self) -> _Wave:
        """The polynomial behind it."""
        area = (BELL**8).integ(lbnd=-1)
        return _Wave(tuple((area / area(1.0)).coef), self.size, self.at, self.rise, after=1.0)
