"""Motions and forces that drive a structure: functions of time that also know their own derivatives.

    y(t) = Σ_k A_k cos(ω_k t + φ_k)          Harmonic, Multisine
    y(t) = √Δω Re Σ_k √(2 S(ω_k)) exp(i φ_k) exp(i ω_k t)          BandNoise
    y(t) = c_0 + c_1 t + Σ_k b_k sin(k π t/T)          Record

Units are SI (m, s, rad/s). Every signal is called with t of any shape; `derivative(order)` is exact, and
`for_duration(duration)` is the signal for a run of that length. The load of base motion y on mode i is
-participation[i] times y.derivative(2).
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, replace
from typing import Any
from zlib import crc32

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam.excitation.line_spectrum import checked_order, keep_number
from fembeam.excitation.unlimited import Unlimited
from fembeam.support import frozen, numbers

Tones = tuple[NDArray[np.float64], NDArray[np.complex128]]
MOST_SHOWN = 8  # numbers of a kind in a repr


@dataclass(frozen=True)
class Harmonic(Unlimited):
    """One cosine: y(t) = amplitude cos(omega t + phase).

    Parameters
    ----------
    amplitude : float
        In m for base motion, N for a force; finite.
    omega : float
        Angular frequency in rad/s, >= 0 (0 is a constant).
    phase : float
        In rad.

    Raises
    ------
    ValueError
        A value that is not finite, or omega < 0.

    Examples
    --------
    >>> y = Harmonic(amplitude=1e-3, omega=195.0)
    >>> round(float(y.derivative(2)(0.0)), 6)
    -38.025
    """

    amplitude: float
    omega: float
    phase: float = 0.0

    def __post_init__(self) -> None:
        keep_number(self, "amplitude")
        keep_number(self, "omega", "rad/s", least=0.0)
        keep_number(self, "phase", "rad")

    def __call__(self, t: ArrayLike) -> Any:
        """Value at the instants t (s), of any shape."""
        return self.amplitude * np.cos(self.omega * np.asarray(t, dtype=np.float64) + self.phase)

    def tones(self) -> Tones:
        """(omega, complex amplitude), each of shape (1,): y(t) = Re Σ amplitude exp(i omega t)."""
        return np.array([self.omega]), np.array([cmath.rect(self.amplitude, self.phase)])

    def derivative(self, order: int) -> Harmonic:
        """The signal d^order y/dt^order."""
        sign, turn = _quarter_turns(checked_order(order))
        scaled = sign * self.amplitude * self.omega**order
        return replace(self, amplitude=scaled, phase=self.phase + turn)


@dataclass(frozen=True, eq=False)
class Multisine(Unlimited):
    """A sum of cosines: y(t) = Σ_k amplitude_k cos(omega_k t + phase_k).

    Parameters
    ----------
    amplitude, omega : array, shape (k,)
        In m (or N) and rad/s; omega >= 0, k >= 1.
    phase : array, shape (k,), optional
        In rad; all zero when left out.

    Raises
    ------
    ValueError
        Unequal lengths, an empty sum, a value that is not finite, a negative omega.

    Examples
    --------
    >>> y = Multisine(amplitude=[1e-3, 5e-4], omega=[195.0, 390.0])
    >>> round(float(y(0.0)), 6)
    0.0015
    """

    amplitude: NDArray[np.float64]
    omega: NDArray[np.float64]
    phase: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        phase = np.zeros(np.shape(self.omega)) if self.phase is None else self.phase
        for name, values in (("amplitude", self.amplitude), ("omega", self.omega), ("phase", phase)):
            object.__setattr__(self, name, _checked_column(f"Multisine {name}", values))
        if not self.amplitude.size == self.omega.size == self._phase.size >= 1:
            sizes = self.amplitude.size, self.omega.size, self._phase.size
            raise ValueError(f"Multisine needs amplitude, omega, phase of one length >= 1, got lengths {sizes}")
        if self.omega.min() < 0:
            i = int(np.argmax(self.omega < 0))
            raise ValueError(f"Multisine omega must be at least 0 rad/s, got {self.omega[i]:g} at index {i}")

    @property
    def _phase(self) -> NDArray[np.float64]:
        """The phases, present once the object is made."""
        assert self.phase is not None
        return self.phase

    def __repr__(self) -> str:
        """All of few tones; of many how many there are, and a digest that tells one sum from another."""
        columns = self.amplitude, self.omega, self._phase
        if self.omega.size <= MOST_SHOWN:
            amplitude, omega, phase = (column.tolist() for column in columns)
            return f"Multisine(amplitude={amplitude}, omega={omega}, phase={phase})"
        span = f"{self.omega.min():g} to {self.omega.max():g} rad/s"
        return f"Multisine({self.omega.size} tones, {span}, digest {crc32(np.concatenate(columns).tobytes()):08x})"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Multisine):
            return NotImplemented
        return all(np.array_equal(getattr(self, n), getattr(other, n)) for n in ("amplitude", "omega", "phase"))

    def __hash__(self) -> int:
        return hash((self.amplitude.tobytes(), self.omega.tobytes(), self._phase.tobytes()))

    def __call__(self, t: ArrayLike) -> Any:
        """Value at the instants t (s), of any shape."""
        times = np.asarray(t, dtype=np.float64)
        value = np.zeros(times.shape)
        for amplitude, omega, phase in zip(self.amplitude, self.omega, self._phase, strict=True):
            value = value + amplitude * np.cos(omega * times + phase)
        return value[()]

    def tones(self) -> Tones:
        """(omega, complex amplitude), each of shape (k,): y(t) = Re Σ amplitude exp(i omega t)."""
        return self.omega.copy(), self.amplitude * np.exp(1j * self._phase)

    def derivative(self, order: int) -> Multisine:
        """The signal d^order y/dt^order."""
        sign, turn = _quarter_turns(checked_order(order))
        return Multisine(sign * self.amplitude * self.omega**order, self.omega, self._phase + turn)


def _quarter_turns(order: int) -> tuple[float, float]:
    """cos(x + order π/2) as a sign and at most one quarter turn: even derivatives keep their phase."""
    return (1.0, 1.0, -1.0, -1.0)[order % 4], (0.0, math.pi / 2)[order % 2]


def _checked_column(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """A read-only one-dimensional finite array, or an error that names the first bad entry."""
    try:
        column = frozen(np.atleast_1d(numbers(name, values, "a signal", "give a list of them")))
    except ValueError:
        raise ValueError(f"{name} must be a list of numbers, got {values!r}") from None
    if column.ndim != 1:
        raise ValueError(f"{name} must have one dimension, got shape {column.shape}")
    if not np.isfinite(column).all():
        i = int(np.argmin(np.isfinite(column)))
        raise ValueError(f"{name} must be finite, got {column[i]} at index {i}")
    return column
