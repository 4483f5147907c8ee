"""The derivative of a system's data by a parameter, from systems at values near the present one."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np

from solvers.problem import Array, System, dense
from solvers.sensitivities.elements import motion_of

_STENCILS = {  # offsets in steps, weights per step with errors of fourth order, and of second order
    0: ((-2, -1, 1, 2), (1 / 12, -2 / 3, 2 / 3, -1 / 12), (-1 / 4, 0.0, 0.0, 1 / 4)),
    1: ((0, 1, 2, 3, 4), (-25 / 12, 4.0, -3.0, 4 / 3, -1 / 4), (-3 / 2, 2.0, -1 / 2, 0.0, 0.0)),
    -1: ((0, -1, -2, -3, -4), (25 / 12, -4.0, 3.0, -4 / 3, 1 / 4), (3 / 2, -2.0, 1 / 2, 0.0, 0.0)),
}
_ROUNDING = 1e-9  # of data, relative; well above that of the modes of a fine mesh
_PROBES = np.linspace(0.0, 1.0, 37)  # times, in units of the run, at which tones are compared
_COARSE = 1e-6  # rtol of node tables that tell whether signals are the same


@dataclass(frozen=True, eq=False)
class Nearby:
    """Systems at values of a parameter near the present one, and weights: Σ weight f(system) = df/d(parameter).

    Only data of the system are differenced, such as gaps, numbers of laws, frequencies; the motion is not. ``coarse``
    are the weights of a formula of lower order, which shows where data are not smooth.
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
        if not (step and math.isfinite(step)):
            raise ValueError(f"step must be finite and not 0, got {step!r}")
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
        """The same weights for something else made of each system."""
        return Nearby(tuple(change(one) for one in self.systems), self.weights, self.coarse)

    def derivative(self, read: Callable[[Any], Any]) -> Array:
        """The derivative of what ``read`` returns of a system."""
        return combined(self.weights, [np.asarray(read(one), dtype=float) for one in self.systems])

    def disagreement(self, read: Callable[[Any], Any]) -> float:
        """Largest difference of the results of both formulas, in units of the largest derivative."""
        values = [np.asarray(read(one), dtype=float) for one in self.systems]
        fine, coarse = (combined(weights, values) for weights in (self.weights, self.coarse))
        rounding = _ROUNDING * np.abs(values[0]).max(initial=0.0) * max(map(abs, self.weights))
        size = float(np.abs(fine).max(initial=0.0)) + rounding
        return float(np.abs(fine - coarse).max(initial=0.0)) / size if size > 0.0 else 0.0


def unchanged(system: System) -> Nearby:
    """For derivatives by the start alone: data do not change."""
    return Nearby((system,), (0.0,), (0.0,))


def combined(weights: tuple[float, ...], values: list[Any]) -> Any:
    """Σ weight × value, exactly zero if all values are equal."""
    first = values[0]
    return sum(weight * (value - first) for weight, value in zip(weights, values, strict=True))


@dataclass(frozen=True, eq=False)
class ElementChange:
    """Derivatives of an element's data by d parameters.

    Its rows (d, m, n) and their offsets (d, m), see `elements`; |c|, μ, k_t and R Ω, (d,) each.
    """

    rows: Array
    offsets: Array
    clearance: Array
    mu: Array
    stiffness: Array
    surface: Array

    @classmethod
    def of(cls, nearby: Sequence[Nearby], s: int, shape: tuple[int, ...]) -> ElementChange:
        """Of element s, whose rows have the shape (m, n)."""

        def of(read: Callable[[Any], Any], shape: tuple[int, ...]) -> Array:
            found = [one.derivative(lambda system: read(system.contacts[s])) for one in nearby]
            return np.array(found).reshape(len(nearby), *shape)

        return cls(of(lambda one: one.rows, shape), of(lambda one: one.row_gaps, shape[:1]), *of(_numbers, (4,)).T)


def indentation_change(
    contact: Any, s: int, nearby: Nearby | None, motion: tuple[Array, Array], change: tuple[Array, Array]
) -> tuple[Array, Array]:
    """Changes (k,) of δ and δ̇ of element s due to those of q and q̇ (k, n) at fixed times, and to a parameter."""
    (q, q_dot), (d_q, d_q_dot) = motion, change
    moved, sped, clearance = -contact.rows @ d_q.T, -contact.rows @ d_q_dot.T, 0.0
    if nearby is not None:
        one = ElementChange.of([nearby], s, contact.rows.shape)
        moved, sped = moved - one.rows[0] @ q.T - one.offsets[0][:, None], sped - one.rows[0] @ q_dot.T
        clearance = float(one.clearance[0] * np.sign(contact.circle))
    element = motion_of(contact, q.T, q_dot.T)
    rate = (element.delta_slopes * sped + element.rate_slopes * moved).sum(axis=0)
    return (element.delta_slopes * moved).sum(axis=0) - clearance, rate


def _numbers(contact: Any) -> tuple[float, ...]:
    """|c|, μ, k_t and R Ω of an element, 0 where there is none."""
    friction = (contact.friction.mu, contact.friction.stiffness) if contact.friction else (0.0, 0.0)
    return contact.gap if contact.map == "annulus" else 0.0, *friction, contact.surface


class Change:
    """Derivatives of the data by d parameters.

    Matrices (d, n, n), elements, loads' vectors (d, L, n); signals and laws that change, of each parameter.
    """

    def __init__(self, system: System, nearby: Sequence[Nearby], duration: float) -> None:
        self.nearby, n = tuple(nearby), system.size
        self.M, self.B, self.K = (self._each(partial(_matrix, name), (n, n)) for name in ("M", "by_rate", "K"))
        self.elements = [ElementChange.of(self.nearby, s, one.rows.shape) for s, one in enumerate(system.contacts)]
        self.vectors = self._each(_vectors, (len(system.loads), n))
        self.signals = [[_signal(one, system, i, duration) for i in range(len(system.loads))] for one in self.nearby]
        self.laws = [[_laws(one, s) for s in range(len(system.contacts))] for one in self.nearby]

    def __len__(self) -> int:
        return len(self.nearby)

    def _each(self, read: Callable[[Any], Any], shape: tuple[int, ...]) -> Array:
        return np.array([one.derivative(read) for one in self.nearby]).reshape(len(self), *shape)

    @property
    def structural(self) -> bool:
        """Whether M, C or K changes."""
        return any(np.any(one) for one in (self.M, self.B, self.K))

    @cached_property
    def turned(self) -> bool:
        """Whether directions of elements change."""
        return any(np.any(one.rows) for one in self.elements)

    @cached_property
    def forced(self) -> bool:
        """Whether a parameter changes the motion in flight, other than by the state."""
        moving = any(signal is not None for signals in self.signals for signal in signals)
        return self.structural or moving or bool(np.any(self.vectors))

    def laws_of(self, s: int) -> list[Any]:
        """The laws of an element in all nearby systems, of parameters that change its law."""
        return [law for laws in self.laws for law in laws[s] or ()]

    def of_knot(self, s: int, border: int) -> Array:
        """(d,) derivatives of a knot of an element; border 0 is its surface."""
        return self.over_laws(s, lambda law: 0.0 if border == 0 else law.knots[border - 1])

    def over_laws(self, s: int, read: Callable[[Any], Any]) -> Any:
        """(..., d) derivatives of what ``read`` returns of an element's law; zeros (d,) if the law does not change."""
        found = [
            0.0
            if (known := laws[s]) is None
            else combined(one.weights, [np.asarray(read(law), float) for law in known])
            for one, laws in zip(self.nearby, self.laws, strict=True)
        ]
        shape = max((np.shape(one) for one in found), key=len, default=())
        return np.stack([np.broadcast_to(one, shape) for one in found], axis=-1) if found else np.zeros(0)


def _laws(nearby: Nearby, s: int) -> list[Any] | None:
    """The laws of an element in the nearby systems; None if all are equal."""
    laws: list[Any] = [one.contacts[s].law for one in nearby.systems]
    if len({len(law.parameters) for law in laws}) > 1:
        raise ValueError(
            f"no derivative: the law of contact {s} has more numbers at one value of the parameter than at another, "
            f"as a table that gets one more point: {laws[-1]!r}"
        )
    same = all(
        law is laws[0] or (law == laws[0] and np.array_equal(law.parameters, laws[0].parameters)) for law in laws
    )
    return None if same else laws


def _signal(nearby: Nearby, system: System, i: int, duration: float) -> Callable[[Array], Array] | None:
    """Derivative of a load's signal at fixed time, a function of time; None if it is zero."""
    signals: list[Any] = [one.loads[i][1] for one in nearby.systems]
    own: Any = system.loads[i][1]
    if all(signal is signals[0] for signal in signals):
        return None
    if all(hasattr(signal, "tones") for signal in signals):
        slope = _of_tones(nearby, own.tones(), [signal.tones() for signal in signals])
        return slope if np.any(slope(duration * _PROBES)) else None
    if _same_tables(signals, duration):
        return None
    return lambda t: combined(nearby.weights, [np.asarray(signal(t), dtype=float) for signal in signals])


def _same_tables(signals: list[Any], duration: float) -> bool:
    """Whether signals have one node table, which tells of pulses too that hide between any probes."""
    if not all(hasattr(signal, "nodes") for signal in signals):
        return False
    (dt, rows), *others = [signal.nodes(duration, _COARSE) for signal in signals]
    return all(h == dt and np.array_equal(table, rows) for h, table in others)


def _of_tones(nearby: Nearby, here: Any, tones: list[Any]) -> Callable[[Array], Array]:
    """d/dp Re Σ a e^{iωt} = Re Σ (a' + i t ω' a) e^{iωt}, exact in t however long the run is."""
    omega, amplitude = (np.asarray(part) for part in here)
    turn = combined(nearby.weights, [np.asarray(tone[0], dtype=float) for tone in tones])
    change = combined(nearby.weights, [np.asarray(tone[1], dtype=complex) for tone in tones])

    def slope(t: Array) -> Array:
        t = np.asarray(t, dtype=float)[..., None]
        waves = (change + 1j * t * turn * amplitude) * np.exp(1j * omega * t)
        return waves.real.sum(axis=-1)

    return slope


def _matrix(name: str, system: System) -> Array:
    """M, K or what multiplies q̇."""
    return dense(getattr(system, name))


def _vectors(system: System) -> Array:
    """(L, n)."""
    return np.array([vector for vector, _ in system.loads])
