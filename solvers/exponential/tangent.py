"""Derivative of a whole run with respect to its start and to a parameter; `linearised` has the mathematics."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from solvers.compiled.dop853_tableau import STAGES
from solvers.compiled.fields import shapes_of
from solvers.compiled.kernels import PlanarProblem, Problem, type_of
from solvers.compiled.packed import Layout, Packed
from solvers.compiled.state import (
    HEAD,
    NO_ROWS,
    STATE,
    State,
    T,
    begin_state,
    gaps_of,
    law_parameters,
    most_borders,
    radii_of,
)
from solvers.exponential.contact.nodes import S
from solvers.exponential.energy.flight_tables import NO_ENERGY_TABLES
from solvers.exponential.linearised import linearise_of
from solvers.exponential.linearised_step import DERIVATIVES, VARIATION, Derivatives, Variation
from solvers.exponential.preparation import places_among_tones
from solvers.exponential.steady_response import steady_response
from solvers.exponential.tables import uncut_parameters
from solvers.problem import Array, Parameter, SolverError, System, tones_of

_ROWS = 256  # of the event record, for some 25 contacts, within which no derivative overflows
_CARRIED = [Derivatives._fields.index(name) for name in ("y", "entry", "shift", "rate", "latched")]
_LARGE = 1e100  # size above which the derivatives are scaled down, or below its inverse up


class Tangent:
    """Derivatives of one run of an engine, moved along as its event record grows."""

    def __init__(self, system: System, engine: Any, parameter: Parameter | None) -> None:
        self.engine, self.blocks = engine, system.blocks
        problem, state = engine.problem, engine.state
        stops, rows, size = len(problem.law), len(problem.gap), 2 * len(problem.k)
        parameters = problem.parameters
        if problem.border_count.any():  # the record is followed with what was latched then
            parameters = parameters.copy()
        width, n = state.x.size, system.size
        change = _Change.of(system, parameter, engine) if parameter else None
        self.exact = change is not None
        self.places_latched = np.flatnonzero(problem.latched.ravel() >= 0)  # among those of all contacts
        own = len(self.places_latched)
        self.change, columns = change or _Change.none(problem, n, parameters), 2 * n + own + self.exact
        layout = _layout(
            **{"columns": columns, "X": width, "E": stops, "R": rows, "L": len(problem.load)},
            **{"l": problem.latched.shape[1], "P": problem.parameters.shape[1], "B": most_borders(problem)},
        )
        self.block, words = layout.block()
        self.y, self.entry, self.shift, self.end_rate, self.latched = (layout.array(self.block, 0, i) for i in _CARRIED)
        begin_state(State._make(layout.arrays(self.block, 1)), state.x[:size])
        self.places = places_among_tones(n, size // 2 - n)
        self.tones = np.delete(np.arange(width), self.places)  # and energy balance: they do not change
        self.y[: 2 * n, self.places] = system.blocks.inverse.T
        if self.exact:
            self.y[-1, self.places] = -self.change.steady(0.0)
        self.latched[2 * n : 2 * n + own, self.places_latched] = np.eye(own)
        engine.record(event_record=np.empty((_ROWS, HEAD + width + rows * S)))
        self.packed = [_packed(engine, one) for one in (parameters, *self.change.parameters)]
        self.packed.append(Packed.of(self.change.variation, VARIATION))
        here, ahead, behind, variation = (packed.address for packed in self.packed)
        derivatives, past = (words + start for start in layout.starts)
        tables, *run = engine.addresses[1:]
        self.addresses = here, ahead, behind, tables, NO_ENERGY_TABLES.address, *run, past, derivatives, variation
        self.linearise = linearise_of(isinstance(problem, PlanarProblem))
        self.log_scale = 0.0  # the derivatives are exp(log_scale) times the arrays
        self.begun = False

    def follow(self) -> None:
        """Move the derivatives to the time the engine has reached, and empty its event record."""
        engine = self.engine
        self.linearise(self.addresses, self.blocks.k.size, not self.begun)
        self.begun = True
        self.y[:, self.tones] = 0.0  # rounding there would not decay
        if not np.all(np.isfinite(self.y)):
            raise SolverError(f"the tangent is not finite any more at t = {engine.state.now[T]:g} s: a contact grazes")
        size = _size(self.y)
        if not 1.0 / _LARGE < size < _LARGE and size > 0.0:
            for array in (self.y, self.entry, self.shift, self.latched):
                array /= size
            self.log_scale += math.log(size)

    def rate(self) -> Array:
        """(2n,) derivative of [q, q̇] by time at the time reached."""
        return self.engine.back @ self.end_rate[0, : 2 * len(self.engine.problem.k)]

    def matrix(self) -> Array:
        """(2n, columns) derivatives of [q, q̇] at the time reached."""
        if self.log_scale > 600.0:
            raise OverflowError(f"the tangent grew to e^{self.log_scale:.0f}; shorten the run, or use solvers.lyapunov")
        y = math.exp(self.log_scale) * self.y[:, self.places]
        if self.exact:
            y[-1] += self.change.steady(self.engine.state.now[T])
        return self.blocks.T @ y.T

    def latched_matrix(self) -> Array:
        """(l, columns) derivatives of the latched numbers at the time reached; those of codes of segments are zero."""
        matrix: Array = math.exp(self.log_scale) * self.latched[:, self.places_latched].T
        return matrix


def _packed(engine: Any, parameters: Array) -> Packed:
    """The problem of an engine with other parameters of its laws."""
    packed: Packed = engine.packed
    same = parameters is engine.problem.parameters
    return packed if same else packed.replaced(type_of(engine.problem), parameters=parameters)


@lru_cache(maxsize=64)
def _layout(**known: int) -> Layout:
    """Shapes and places of the arrays of `Derivatives`, and of the `State` that the derivatives have reached."""
    latched = known["l"]
    working = latched * (5 + latched) + 2 + known["P"] + known["B"]
    sizes = {**known, "S": S, "STAGES": STAGES, "renewed": working, **NO_ROWS}
    return Layout([DERIVATIVES, STATE], [shapes_of(Derivatives, sizes), shapes_of(State, sizes)])


def _size(y: Array) -> float:
    """Frobenius norm, computed in units of the largest entry, as its square may overflow."""
    largest = float(np.abs(y).max())
    return largest * math.sqrt(np.vdot(y / largest, y / largest)) if largest > 0.0 else 0.0


@dataclass(frozen=True, eq=False)
class _Change:
    """Changes by a parameter: explicit ones, parameters of the laws ahead and behind, steady response per tone."""

    variation: Variation
    parameters: list[Array]
    a: Any  # (K, 2n) complex: the steady response changes by Re (a + t b) e^{iωt}
    b: Any

    def steady(self, t: float) -> Array:
        """Change of the steady response at time t, in block coordinates."""
        waves = (self.a + t * self.b) * np.exp(1j * self.variation.omega * t)[:, None]
        return waves.sum(axis=0).real

    @classmethod
    def none(cls, problem: Problem, n: int, parameters: Array) -> _Change:
        """Without a parameter."""
        rows = len(problem.gap)
        variation = Variation(
            *(0.0, 0.0, np.zeros(0), np.zeros((0, rows, 2, 4)), np.zeros(rows), np.zeros(problem.radius.size)),
            np.zeros((2, 0, 0)),
        )
        none = np.zeros((0, 2 * n), dtype=complex)
        return cls(variation, [parameters] * 2, none, none)

    @classmethod
    def of(cls, system: System, parameter: Parameter, engine: Any) -> _Change | None:
        """The change between two systems; None if they differ in more than tones, gaps and laws' parameters."""
        sides = parameter.behind, parameter.ahead
        count = sum(len(signal.tones()[0]) for _, signal in system.loads if hasattr(signal, "tones"))
        if len(engine.problem.k) != system.size + count:  # a tone is sampled, for resonance: it has no steady response
            return None
        rubbing = any(contact.friction is not None for contact in system.contacts)
        if rubbing and np.any(radii_of(sides[0].contacts) != radii_of(sides[1].contacts)):
            return None  # ξ = c θ changes with it
        tones = _tones(system, *sides)
        if tones is None or not all(_same_structure(system, side) for side in sides):
            return None
        width = 2.0 * parameter.step
        own = places_among_tones(system.size, len(tones.omega))
        rows = np.stack([engine.problem.read[:, own], engine.problem.read_rate[:, own]], axis=1)  # (R, 2, 2n)
        a, b = tones.change / width, 1j * (tones.turn / width)[:, None] * tones.response
        parts = np.array([a.real, a.imag, b.real, b.imag])
        steady = (rows @ parts.reshape(-1, own.size).T).reshape(len(rows), 2, 4, len(a)).transpose(3, 0, 1, 2)
        gaps = [gaps_of(side.contacts) for side in sides]
        shift = (gaps[1] - gaps[0]) / width
        radii = [radii_of(side.contacts) for side in sides]
        variation = Variation(
            *(parameter.step, parameter.step, tones.omega, np.ascontiguousarray(steady), shift),
            (radii[1] - radii[0]) / width,
            np.array([uncut_parameters(side.contacts) for side in reversed(sides)]),
        )
        if all(one.law is other.law for one, other in zip(*(side.contacts for side in sides), strict=True)):
            return cls(variation._replace(law_step=0.0), [engine.problem.parameters] * 2, a, b)
        return cls(variation, [_parameters(side, engine.problem) for side in reversed(sides)], a, b)


def _parameters(side: System, problem: Problem) -> Array:
    """Parameters of the laws of one side, with the numbers that the run has latched."""
    parameters = law_parameters(side)
    for row, run, places in zip(parameters, problem.parameters, problem.latched, strict=True):
        row[places[places >= 0]] = run[places[places >= 0]]
    return parameters


class _Tones(NamedTuple):
    """Tones of three systems: frequency and response of the first, their changes from the second to the third."""

    omega: Array  # (K,)
    response: Any  # (K, 2n) complex
    turn: Array  # (K,)
    change: Any  # (K, 2n) complex


def _tones(here: System, behind: System, ahead: System) -> _Tones | None:
    """The tones; None if sampled signals differ."""
    found = []
    k, c = here.blocks.k, here.blocks.c
    for load, ((vector, signal), *others) in enumerate(zip(here.loads, behind.loads, ahead.loads, strict=True)):
        signals: list[Any] = [signal, *(other for _, other in others)]
        if not all(hasattr(one, "tones") for one in signals):
            if any(one is not signal for one in signals):
                return None
            continue
        push = here.push @ np.asarray(vector)
        tones = [tones_of(one, load) for one in signals]
        omega, amplitude = (np.stack([tone[i] for tone in tones], axis=-1)[..., None] for i in (0, 1))
        response = steady_response(k, c, push * amplitude, omega)  # (tones, systems, 2n)
        found.append((omega[:, 0, 0], response[:, 0], np.diff(omega[:, 1:, 0])[:, 0], response[:, 2] - response[:, 1]))
    n2 = 2 * here.size
    none = np.zeros(0), np.zeros((0, n2), dtype=complex)
    return _Tones(*(np.concatenate(parts) for parts in zip((*none, *none), *found, strict=True)))


def _same_structure(one: System, other: System) -> bool:
    """Whether two systems differ only in signals, gaps and parameters of laws."""
    if one.size != other.size or len(one.contacts) != len(other.contacts):
        return False
    if any((a.map, a.outer) != (b.map, b.outer) for a, b in zip(one.contacts, other.contacts, strict=True)):
        return False
    pairs = [(one.M, other.M), (one.C, other.C), (one.K, other.K), (one.gyroscopic, other.gyroscopic)]
    pairs += [(a.rows, b.rows) for a, b in zip(one.contacts, other.contacts, strict=True)]
    pairs += [(a, b) for (a, _), (b, _) in zip(one.loads, other.loads, strict=True)]
    laws = [(a.law, b.law) for a, b in zip(one.contacts, other.contacts, strict=True)]
    return all(a is b or np.array_equal(a, b) for a, b in pairs) and all(
        a is b or (a.address, a.knots, a.entry_rate_floor) == (b.address, b.knots, b.entry_rate_floor) for a, b in laws
    )
