"""Orbits that meet a stop's surface at a given rate: grazing ones, and those that enter at their law's floor.

Shots from an open interval to the meeting at t*, and on from there, solve

    Φ_0(x_0) = x_1,   Φ_1(x_1) = x_2,   ...,   δ(x_1) = 0,   δ̇(x_1) = v

for the shots' states, the parameter and t*. The return map is smooth on either side of such an orbit, not across it.
An orbit that repeats itself within its period, or is symmetric, meets surfaces at several times at once: then every
meeting adds its time and its two conditions, of which only two are independent, and the equations are solved in the
sense of least squares.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from solvers.branches.point import Point, moved, tangent_of
from solvers.orbits import (
    Chain,
    Orbit,
    OrbitError,
    PeriodicProblem,
    latching_stops,
    newton,
    orbit_of,
    rate_at_end,
    state_after,
    states_at,
)
from solvers.problem import Array, System

_MOST_ITERATIONS = 8  # of Newton's method
_CLOSE = 1e-7  # arclength of its last step
_AT_ONCE = 1e-7  # residual of least squares, in units of the states, above which not all equations hold
_OFFSETS = 1e-6, 1e-2  # from a grazing orbit to one beside it, in units of the peak indentation, of the rate
_ARCLENGTHS = 1e-8, 1e-7, 1e-6, 1e-5  # arclengths beside it at which an orbit is tried
_STEEP = 0.2  # parameter's share of the tangent above which the parameter is held fixed


@dataclass(eq=False)
class _Raised:
    """A law with another floor of the entry rate."""

    law: Any
    entry_rate_floor: float

    def __getattr__(self, name: str) -> Any:
        return getattr(self.law, name)


@dataclass(frozen=True, eq=False)
class _Meeting(PeriodicProblem):
    """Shots of which some begin on the surface of a stop, with an entry rate of at least ``floor``."""

    stops: tuple[int | None, ...] = ()  # of every shot, None where it does not begin on a surface
    floor: float = 0.0

    @property
    def places(self) -> list[int]:
        """Numbers of the shots that begin on a surface."""
        return [i for i, stop in enumerate(self.stops) if stop is not None]

    def at(self, unknowns: Array) -> _Meeting:
        """The same with the meetings at the fractions of the period that end the unknowns."""
        places, fractions = self.places, list(self.fractions)
        for place, fraction in zip(places, unknowns[-len(places) :].tolist(), strict=True):
            fractions[place] = fraction
        return replace(self, fractions=tuple(fractions))

    def shots(self, parameter: float) -> list[tuple[System, float]]:
        """(system from the shot's start on, duration) of every shot."""
        known = parameter in self.kept
        shots = super().shots(parameter)
        for i, stop in enumerate(() if known else self.stops):
            if stop is not None:
                shots[i] = self._raised(shots[i][0], stop), shots[i][1]
        return shots

    def _raised(self, system: System, stop: int) -> System:
        """The system with another floor at a stop."""
        contacts = list(system.contacts)
        if self.floor == contacts[stop].law.entry_rate_floor:
            return system
        law: Any = _Raised(contacts[stop].law, self.floor)
        contacts[stop] = replace(contacts[stop], law=law)
        return system.like(contacts=contacts)


@dataclass(frozen=True, eq=False)
class Grazing:
    """An orbit that meets stops' surfaces at a rate."""

    meeting: _Meeting
    speed: float
    unknowns: Array  # [states of the shots, parameter, fractions of the meetings]
    chain: Chain

    @property
    def parameter(self) -> float:
        """Where on the branch."""
        return float(self.unknowns[self.chain.x.size])

    @property
    def rate_before(self) -> float:
        """Entry rate of the stop's last contact before the meeting; indentations of rounding's size do not count."""
        first = self.meeting.places[0]
        log = self.chain.solutions[first - 1].contacts
        deep = log.peak_indentation > 1e-4 * log.peak_indentation.max(initial=0.0)
        mine = (log.stop == self.meeting.stops[first]) & deep
        return float(log.speed_in[mine][-1])


def first_grazing(
    point: Point, begins: Sequence[tuple[float, int | None]], speed: float, floor: float, within: float
) -> Grazing:
    """The grazing orbit near a point, whose orbit nearly meets surfaces at some times, counted from its phase.

    ``begins`` are the later shots' (time, stop met or None) in their order; ``within`` is an arclength. Raises
    OrbitError.
    """
    orbit, problem = point.orbit, point.problem
    times, stops = [t for t, _ in begins], (None, *(stop for _, stop in begins))
    fractions = tuple((orbit.phase + t) / orbit.period for t in (0.0, *times))
    meeting = _Meeting(problem.make, problem.method, fractions, problem.step, stops, floor)
    states, met = [orbit.whole, *states_at(orbit, times)], [fractions[i] for i in meeting.places]
    return solved(point, meeting, np.concatenate((*states, [point.chain.parameter], met)), speed, within)


def solved(point: Point, meeting: _Meeting, unknowns: Array, speed: float, within: float = math.inf) -> Grazing:
    """The grazing orbit near a guess, by Newton's method with steps of at most ``within``; raises OrbitError."""
    m, size = len(meeting.stops), len(point.orbit.whole)
    for _ in range(_MOST_ITERATIONS):
        meeting = meeting.at(unknowns)
        states, parameter = unknowns[: m * size], float(unknowns[m * size])
        if not np.all(np.diff((*meeting.fractions, meeting.fractions[0] + 1.0)) > 0.0):
            break
        chain = meeting.evaluate(states.reshape(m, size), parameter)
        matrix, right = _linear(meeting, chain, speed)
        step: Array = np.linalg.lstsq(matrix, right, rcond=None)[0].astype(float)
        unknowns, distance = unknowns + step, _length(point, step[:size], step[m * size])
        at_once = np.abs(matrix @ step - right).max() < _AT_ONCE * np.abs(states).max()
        if not distance < within:
            break
        if distance < _CLOSE and at_once:
            return Grazing(meeting.at(unknowns), speed, unknowns, chain)
    met = ", ".join(str(meeting.stops[i]) for i in meeting.places)
    raise OrbitError(f"no orbit that meets stop {met} at {speed:g} m/s was found in {_MOST_ITERATIONS} iterations")


def _linear(problem: _Meeting, chain: Chain, speed: float) -> tuple[Array, Array]:
    """Matrix and right side of Newton's step."""
    (m, size), places = chain.residual.shape, problem.places
    system, period = problem.make(chain.parameter)
    later, rows, misses = np.zeros((len(places), m, size)), np.zeros((len(places), 2, m * size + 1 + len(places))), []
    for k, place in enumerate(places):
        rate, stop = rate_at_end(system, chain.solutions[place - 1]) * period, problem.stops[place] or 0
        later[k, place - 1] += rate
        later[k, place] -= chain.tangents[place] @ rate
        n, begin = system.size, place * size
        delta, pace, by_q, pace_by_q = system.contacts[stop].motion(*np.split(chain.x[place, : 2 * n], 2))
        rows[k, 0, begin : begin + n] = rows[k, 1, begin + n : begin + 2 * n] = by_q
        rows[k, 1, begin : begin + n] = pace_by_q
        rows[k, 0, m * size] = -_gap_slope(problem, chain.parameter, stop)
        misses += [delta, pace - speed]
    changes = later.reshape(len(places), -1).T
    matrix = np.vstack((np.column_stack((chain.jacobian(), chain.by_parameter.ravel(), changes)), *rows))
    return matrix, -np.concatenate((chain.residual.ravel(), misses))


def _gap_slope(problem: PeriodicProblem, parameter: float, stop: int) -> float:
    """Derivative of a stop's gap by the parameter."""
    low, high = problem.beside(parameter)
    behind, ahead = (problem.make(value)[0].contacts[stop] for value in (low, high))
    change = (ahead.gap - behind.gap) / (high - low)
    return -change if ahead.outer else change


def _length(point: Point, state: Array, parameter: float) -> float:
    """Arclength of a step, by that of the first state and the parameter."""
    size, G = len(state), point.metric
    return math.sqrt(len(point.chain.x) * state @ G[:size, :size] @ state + G[-1, -1] * parameter**2)


def unknowns_at(point: Point, grazing: Grazing) -> Array:
    """A grazing orbit as unknowns of the branch: states of its shots, integrated with its own floor; the parameter."""
    problem, known = point.problem, grazing.unknowns[: grazing.chain.x.size].reshape(grazing.chain.x.shape)
    shots, period = grazing.meeting.shots(grazing.parameter), problem.make(grazing.parameter)[1]
    begins, x = grazing.meeting.fractions, [known[0]]
    for fraction in problem.fractions[1:]:
        i = max(i for i, begin in enumerate(begins) if begin < fraction)
        x.append(state_after(shots[i][0], known[i], (fraction - begins[i]) * period, problem.method))
    return np.append(np.concatenate(x), grazing.parameter)


def orbit_at(point: Point, grazing: Grazing) -> Orbit:
    """A grazing orbit as an orbit of the branch, marked; raises OrbitError."""
    chain = newton(point.problem, unknowns_at(point, grazing)[:-1].reshape(point.chain.x.shape), grazing.parameter)
    return orbit_of(point.problem, chain, "grazing")


def signature(orbit: Orbit) -> tuple[int, int]:
    """Numbers of contacts and of clipped entry rates; both stay the same between nonsmooth points."""
    log = orbit.contacts
    return len(log), int(np.sum(log.entry_rate_clipped[np.isin(log.stop, latching_stops(orbit.system))]))


def beside(point: Point, grazing: Grazing, sign: float, wanted: tuple[int, int | None]) -> Point:
    """An orbit very near a grazing orbit on one side: indentation at t*, or rate at entry, above or below it.

    Its tangent points away from the grazing orbit. It has the ``wanted`` signature, where None is any. Raises
    OrbitError.
    """
    problem, size = point.problem, len(point.orbit.whole)
    by_state, by_parameter, aside = _indicators(point, grazing)
    towards = np.linalg.solve(point.metric[:size, :size], by_state.T)
    ends = unknowns_at(point, grazing)
    off = towards @ np.linalg.solve(by_state @ towards, np.full(len(by_state), sign * aside))
    x = _shots(problem, ends[:size] + off, grazing.parameter)
    along = np.zeros(len(point.metric))
    along[-1] = 1.0
    tangent = tangent_of(problem.evaluate(x, grazing.parameter), point.metric, along)
    tangent *= sign * np.sign(by_state[0] @ tangent[:size] + by_parameter[0] * tangent[-1])
    launch = replace(point, tangent=tangent)
    for s in _ARCLENGTHS:
        try:
            found = moved(launch, ends + s * tangent, abs(launch.share) > _STEEP)
        except OrbitError:
            continue
        contacts, clipped = signature(found.orbit)
        if wanted in ((contacts, clipped), (contacts, None)):
            return found
    raise OrbitError("no orbit was found beside the grazing orbit")


def _indicators(point: Point, grazing: Grazing) -> tuple[Array, Array, float]:
    """Derivatives, by first state and parameter, of the numbers that change sign at a grazing orbit; their offset."""
    rows, aside = [], _OFFSETS[0] * float(point.orbit.contacts.peak_indentation.max(initial=0.0))
    chain, n = grazing.chain, point.orbit.system.size
    columns = np.eye(chain.x.shape[1], chain.x.shape[1] + 1)
    for place, stop in enumerate(grazing.meeting.stops[1:], 1):
        columns = chain.tangents[place - 1] @ columns
        columns[:, -1] += chain.by_parameter[place - 1]
        if stop is not None:
            rate = rate_at_end(point.orbit.system, chain.solutions[place - 1])
            state = np.split(chain.x[place, : 2 * n], 2)
            _, _, w, turning = point.orbit.system.contacts[stop].motion(*state)
            row = w @ columns[:n]
            row[-1] -= _gap_slope(point.problem, grazing.parameter, stop)
            by_rate = w @ columns[n : 2 * n] + turning @ columns[:n]
            acceleration = w @ rate[n : 2 * n] + turning @ rate[:n]
            rows.append(by_rate - acceleration / grazing.speed * row if grazing.speed else row)
    aside = _OFFSETS[1] * grazing.speed or aside or _OFFSETS[0] * float(np.abs(chain.x[0, :n]).max())
    return np.array(rows)[:, :-1], np.array(rows)[:, -1], aside


def _shots(problem: PeriodicProblem, x: Array, parameter: float) -> Array:
    """States of all shots (m, N) of the motion from the first one."""
    (system, _), period = problem.shots(parameter)[0], problem.make(parameter)[1]
    begins = [(fraction - problem.fractions[0]) * period for fraction in problem.fractions]
    return np.array([x, *(state_after(system, x, t, problem.method) for t in begins[1:])])
