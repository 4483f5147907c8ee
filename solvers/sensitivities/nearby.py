"""The derivative of a system's data by a parameter, from systems at values near the present one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from solvers.problem import Array, System, dense
from solvers.sensitivities.elements import motion_of

_STENCILS = {  # offsets in steps, weights per step with errors of fourth order, and of second order
    0: ((-2, -1, 1, 2), (1 / 12, -2 / 3, 2 / 3, -1 / 12), (-1 / 4, 0.0, 0.0, 1 / 4)),
    1: ((0, 1, 2, 3, 4), (-25 / 12, 4.0, -3.0, 4 / 3, -1 / 4), (-3 / 2, 2.0, -1 / 2, 0.0, 0.0)),
    -1: ((0, -1, -2, -3, -4), (25 / 12, -4.0, 3.0, -4 / 3, 1 / 4), (3 / 2, -2.0, 1 / 2, 0.0, 0.0)),
}
_ROUNDING = 1e-9  # of data, well above that of modes of a fine mesh
_PROBES = np.linspace(0.0, 1.0, 37)  # of a run, where a signal is looked at for a change


@dataclass(frozen=True, eq=False)
class Nearby:
    """Systems at values of a parameter near the present one, and weights: Σ weight f(system) = df/d(parameter).

    Of the data of the system alone, such as gaps, numbers of laws, frequencies: the motion is not differenced.
    ``coarse`` are the weights of a formula of lower order, which tells where data are not smooth.
    """

    systems: tuple[Any, ...]
    weights: tuple[float, ...]
    coarse: tuple[float, ...] = ()

    @classmethod
    def of(cls, make: Callable[[float], Any], value: float, step: float, sides: tuple[int, ...] = (0, 1, -1)) -> Nearby:
        """From a function of the parameter, by five-point formulas: central, or one-sided where values are refused.

        Raises
        ------
        ValueError : `make` refuses values on both sides.
        """
        refused: Exception = ValueError(f"no step from {value:g}")
        for side in sides:
            offsets, weights, coarse = _STENCILS[side]
            try:
                made = tuple(make(value + k * step) for k in offsets)
            except ValueError as error:
                refused = error
                continue
            return cls(made, *(tuple(w / step for w in one) for one in (weights, coarse)))
        raise refused

    def map(self, change: Callable[[Any], Any]) -> Nearby:
        """The same weights for other things made of the systems."""
        return Nearby(tuple(change(one) for one in self.systems), self.weights, self.coarse)

    def derivative(self, read: Callable[[Any], Any]) -> Array:
        """The derivative of what is read off a system."""
        return combined(self.weights, [np.asarray(read(one), dtype=float) for one in self.systems])

    def disagreement(self, read: Callable[[Any], Any]) -> float:
        """Largest difference of what both formulas give, in units of the largest derivative."""
        values = [np.asarray(read(one), dtype=float) for one in self.systems]
        fine, coarse = (combined(weights, values) for weights in (self.weights, self.coarse))
        rounding = _ROUNDING * np.abs(values[0]).max(initial=0.0) * max(map(abs, self.weights))
        size = float(np.abs(fine).max(initial=0.0)) + rounding
        return float(np.abs(fine - coarse).max(initial=0.0)) / size if size > 0.0 else 0.0


def combined(weights: tuple[float, ...], values: list[Any]) -> Any:
    """Σ weight value, exactly zero where all values are the same."""
    first = values[0]
    return sum(weight * (value - first) for weight, value in zip(weights, values, strict=True))


@dataclass(frozen=True, eq=False)
class ElementChange:
    """Derivative of an element's data: its rows (m, n) and their offsets (m,), see `elements`; |c|; μ, k_t and R Ω."""

    rows: Array
    offsets: Array
    clearance: float
    mu: float
    stiffness: float
    surface: float

    @classmethod
    def of(cls, nearby: Nearby, s: int) -> ElementChange:
        """Of element s."""

        def of(read: Callable[[Any], Any]) -> Array:
            return nearby.derivative(lambda one: read(one.contacts[s]))

        numbers = (_clearance, _mu, _stiffness, _surface)
        return cls(of(lambda one: one.rows), of(lambda one: one.row_gaps), *(float(of(read)) for read in numbers))


def indentation_change(
    contact: Any, s: int, nearby: Nearby | None, motion: tuple[Array, Array], change: tuple[Array, Array]
) -> tuple[Array, Array]:
    """Changes (k,) of δ and δ̇ of element s for those of q and q̇ (k, n) at fixed times."""
    (q, q_dot), (d_q, d_q_dot) = motion, change
    y, y_dot = -contact.rows @ q.T - contact.row_gaps[:, None], -contact.rows @ q_dot.T
    moved, sped, clearance = -contact.rows @ d_q.T, -contact.rows @ d_q_dot.T, 0.0
    if nearby is not None:
        one = ElementChange.of(nearby, s)
        moved, sped = moved - one.rows @ q.T - one.offsets[:, None], sped - one.rows @ q_dot.T
        clearance = one.clearance * np.sign(contact.circle)
    along = motion_of(contact, 0.0, y, y_dot)
    rate = (along.press * sped + along.turning * moved).sum(axis=0)
    return (along.press * moved).sum(axis=0) - clearance, rate


def _clearance(contact: Any) -> float:
    return contact.gap if contact.map == "annulus" else 0.0


def _mu(contact: Any) -> float:
    return contact.friction.mu if contact.friction else 0.0


def _stiffness(contact: Any) -> float:
    return contact.friction.stiffness if contact.friction else 0.0


def _surface(contact: Any) -> float:
    return contact.law.arm * contact.spin if contact.friction else 0.0


class Change:
    """Derivative of the data: matrices, elements, knots, loads' vectors (L, n) and signals."""

    def __init__(self, system: System, nearby: Nearby, duration: float) -> None:
        self.nearby = nearby
        self.M, self.B, self.K = (self._matrix(name) for name in ("M", "by_rate", "K"))
        self.elements = [ElementChange.of(nearby, s) for s in range(len(system.contacts))]
        self.vectors = nearby.derivative(_vectors)
        self.signals = [self._signal(system, i, duration) for i in range(len(nearby.systems[0].loads))]
        self.laws = [self._law(s) for s in range(len(nearby.systems[0].contacts))]

    def _matrix(self, name: str) -> Array:
        return self.nearby.derivative(lambda one: dense(getattr(one, name)))

    @property
    def structural(self) -> bool:
        """Whether matrices or loads' vectors change."""
        return any(np.any(one) for one in (self.M, self.B, self.K, self.vectors))

    @cached_property
    def turned(self) -> bool:
        """Whether rows of elements change."""
        return any(np.any(one.rows) for one in self.elements)

    @property
    def forced(self) -> bool:
        """Whether the motion changes while nothing touches, besides by its state."""
        return self.structural or any(signal is not None for signal in self.signals)

    def _law(self, s: int) -> list[Any] | None:
        """The laws of an element at the values; None where all are one."""
        laws: list[Any] = [one.contacts[s].law for one in self.nearby.systems]
        same = all(
            law is laws[0] or (law == laws[0] and np.array_equal(law.parameters, laws[0].parameters)) for law in laws
        )
        return None if same else laws

    def knot(self, s: int, border: int) -> float:
        """Derivative of a knot of an element; border 0 is its surface."""
        laws = self.laws[s]
        return 0.0 if border == 0 or laws is None else float(self._combined([law.knots[border - 1] for law in laws]))

    def _combined(self, values: list[Any]) -> Any:
        return combined(self.nearby.weights, values)

    def over_laws(self, s: int, read: Callable[[Any], Any]) -> Any:
        """Derivative of what is read off the law of an element; 0 where it does not change."""
        laws = self.laws[s]
        return 0.0 if laws is None else self._combined([np.asarray(read(law)) for law in laws])

    def _signal(self, system: System, i: int, duration: float) -> Callable[[Array], Array] | None:
        """Derivative of a load's signal at fixed time; None where it is zero."""
        signals: list[Any] = [one.loads[i][1] for one in self.nearby.systems]
        own: Any = system.loads[i][1]
        if all(signal is signals[0] for signal in signals):
            return None
        if all(hasattr(signal, "tones") for signal in signals):
            slope = self._of_tones(own.tones(), [signal.tones() for signal in signals])
        else:
            slope = self._of_values(signals)
        return slope if np.any(slope(duration * _PROBES)) else None

    def _of_values(self, signals: list[Any]) -> Callable[[Array], Array]:
        """By the values of the signals themselves."""
        return lambda t: np.asarray(self._combined([np.asarray(signal(t), dtype=float) for signal in signals]))

    def _of_tones(self, here: Any, tones: list[Any]) -> Callable[[Array], Array]:
        """d/dp Re Σ a e^{iωt} = Re Σ (a' + i t ω' a) e^{iωt}, exact in t however long the run is."""
        omega, amplitude = (np.asarray(part) for part in here)
        turn = combined(self.nearby.weights, [np.asarray(tone[0], dtype=float) for tone in tones])
        change = combined(self.nearby.weights, [np.asarray(tone[1], dtype=complex) for tone in tones])

        def slope(t: Array) -> Array:
            t = np.asarray(t, dtype=float)[..., None]
            waves = (change + 1j * t * turn * amplitude) * np.exp(1j * omega * t)
            return np.asarray(waves.real.sum(axis=-1))

        return slope


def _vectors(system: System) -> Array:
    """(L, n)."""
    return np.array([vector for vector, _ in system.loads]).reshape(len(system.loads), system.size)
