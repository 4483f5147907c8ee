"""Orbits that meet a stop's surface at a given rate: grazing ones, and those that enter at their law's floor.

Shots from a quiet time to the meeting at t*, and on from there, solve

    Φ_0(x_0) = x_1,   Φ_1(x_1) = x_2,   ...,   δ(x_1) = 0,   δ̇(x_1) = v

for the shots' states, the parameter and t*. What a branch's return map does beside such an orbit is smooth on either
side, if not across.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from solvers.chain import Chain, Problem, delayed
from solvers.correction import newton
from solvers.periodic import Orbit, OrbitError, flown, orbit_of
from solvers.point import Point, moved, tangent_of
from solvers.quiet import with_memory
from solvers.system import Array, Contact, System

_MOST = 8  # iterations of Newton's method
_CLOSE = 1e-7  # arclength of its last step
_ASIDE = 1e-6, 1e-2  # how far beside the branch's direction is seen, in units of the peak indentation and of the rate
_OFF = 1e-8, 1e-7, 1e-6, 1e-5  # arclengths beside it at which an orbit is tried
_STEEP = 0.2  # parameter's share of the tangent above which the parameter is held fixed


@dataclass(eq=False)
class _Raised:
    """A law with another floor of the entry rate."""

    law: Any
    entry_rate_floor: float

    def __getattr__(self, name: str) -> Any:
        return getattr(self.law, name)


@dataclass(frozen=True, eq=False)
class _Meeting(Problem):
    """Shots of which the second begins on a stop's surface, with an entry rate of at least ``floor``."""

    stop: int = 0
    floor: float = 0.0

    def shots(self, parameter: float) -> list[tuple[System, float]]:
        """(system from the shot's begin on, duration) of every shot."""
        known = parameter in self.kept
        shots = super().shots(parameter)
        system, duration = shots[1]
        contacts = list(system.contacts)
        if not known and self.floor != contacts[self.stop].law.entry_rate_floor:
            law: Any = _Raised(contacts[self.stop].law, self.floor)
            contacts[self.stop] = replace(contacts[self.stop], law=law)
            shots[1] = system.like(contacts=contacts), duration
        return shots


@dataclass(frozen=True, eq=False)
class Touch:
    """An orbit that meets a stop's surface at a rate, and goes on with an entry rate of at least ``floor``."""

    stop: int
    speed: float
    floor: float
    fractions: tuple[float, ...]  # of the period, at the shots' begins
    unknowns: Array  # [states of the shots, parameter, second fraction]
    chain: Chain

    @property
    def parameter(self) -> float:
        """Where on the branch."""
        return float(self.unknowns[-2])

    @property
    def rate_before(self) -> float:
        """At which the stop's last contact before the meeting was entered; a dip of rounding's size is none."""
        log = self.chain.solutions[0].contacts
        mine = (log.stop == self.stop) & (log.peak_indentation > 1e-4 * log.peak_indentation.max(initial=0.0))
        return float(log.speed_in[mine][-1])


def first_touch(point: Point, stop: int, times: Sequence[float], speed: float, floor: float, within: float) -> Touch:
    """The touch near a point, whose orbit nearly meets the surface at the first of some times, counted from its phase.

    Shots begin at the others too; ``within`` is an arclength. Raises OrbitError.
    """
    orbit = point.orbit
    later = delayed(orbit.system, orbit.phase)
    states = [orbit.state, *(flown(later, orbit.state, t, orbit.method) for t in times)]
    rest = tuple((orbit.phase + t) / orbit.period for t in (0.0, *times))
    guess = np.concatenate((*states, [point.chain.parameter, rest[1]]))
    return solved(point, stop, rest, guess, speed, floor, within)


def solved(
    point: Point,
    stop: int,
    fractions: tuple[float, ...],
    unknowns: Array,
    speed: float,
    floor: float,
    within: float = math.inf,
) -> Touch:
    """The touch near a guess, by Newton's method, no step of which is longer than ``within``; raises OrbitError."""
    problem, size = point.problem, len(point.orbit.state)
    for _ in range(_MOST):
        fractions = (fractions[0], float(unknowns[-1]), *fractions[2:])
        x, parameter = unknowns[:-2].reshape(len(fractions), size), float(unknowns[-2])
        if not np.all(np.diff((*fractions, fractions[0] + 1.0)) > 0.0):
            break
        chain = _Meeting(problem.make, problem.method, fractions, problem.step, stop, floor).evaluate(x, parameter)
        system, period = problem.make(parameter)
        step: Array = np.linalg.solve(*_linear(chain, system.contacts[stop], period, speed)).astype(float)
        unknowns, way = unknowns + step, length(point, step)
        if not way < within:
            break
        if way < _CLOSE:
            return Touch(stop, speed, floor, (fractions[0], float(unknowns[-1]), *fractions[2:]), unknowns, chain)
    raise OrbitError(f"no orbit that meets stop {stop} at {speed:g} m/s was found in {_MOST} iterations")


def _linear(chain: Chain, contact: Contact, period: float, speed: float) -> tuple[Array, Array]:
    """Matrix and right side of Newton's step."""
    m, size = chain.residual.shape
    n, rate = size // 2, _rate(chain) * period  # of the state at the meeting, per period
    later = np.zeros((m, size))
    later[0], later[1] = rate, -chain.tangents[1] @ rate
    rows = np.zeros((2, m * size + 2))
    rows[0, size : size + n] = rows[1, size + n : 2 * size] = -contact.direction
    matrix = np.vstack((np.column_stack((chain.jacobian(), chain.by_parameter.ravel(), later.ravel())), rows))
    delta, delta_dot = -chain.x[1, :n] @ contact.direction - contact.gap, -chain.x[1, n:] @ contact.direction
    return matrix, -np.concatenate((chain.residual.ravel(), [delta, delta_dot - speed]))


def _rate(chain: Chain) -> Array:
    """Of the state where the first shot ends, per second."""
    rate = chain.solutions[0].rate
    assert rate is not None
    return rate


def length(point: Point, step: Array) -> float:
    """Arclength of a step of a touch's unknowns, by that of the first state and the parameter."""
    size, m = len(point.orbit.state), len(point.chain.x)
    first, G = step[:size], point.metric
    return math.sqrt(m * first @ G[:size, :size] @ first + G[-1, -1] * step[-2] ** 2)


def unknowns_at(point: Point, touch: Touch) -> Array:
    """A touch as unknowns of the branch: states of its shots and the parameter."""
    x = _shots(point.problem, touch.unknowns[: len(point.orbit.state)], touch.parameter)
    return np.append(x.ravel(), touch.parameter)


def orbit_at(point: Point, touch: Touch, **more: Any) -> Orbit:
    """A touch as an orbit of the branch; raises OrbitError."""
    y, problem = unknowns_at(point, touch), point.problem
    chain, error, iterations = newton(problem, y[:-1].reshape(point.chain.x.shape), touch.parameter)
    return orbit_of(problem, chain, error, iterations, parameter=touch.parameter, **more)


def signature(orbit: Orbit) -> tuple[int, int]:
    """Numbers of contacts, and of those entered below their law's floor; they stay the same between kinks."""
    log = orbit.contacts
    return len(log), int(np.sum(log.floored[np.isin(log.stop, with_memory(orbit.system))]))


def beside(point: Point, touch: Touch, sign: float, wanted: tuple[int, int | None]) -> Point:
    """An orbit of a signature very near a touch, where the indentation at t*, or its rate at entry, is more or less.

    Its tangent points away from the touch; None leaves a part of the signature open. Raises OrbitError.
    """
    problem, size = point.problem, len(point.orbit.state)
    by_state, by_parameter, aside = _indicator(point, touch)
    towards = np.linalg.solve(point.metric[:size, :size], by_state)
    ends = unknowns_at(point, touch)
    x = _shots(problem, ends[:size] + sign * aside * towards / (by_state @ towards), touch.parameter)
    along = np.zeros(len(point.metric))
    along[-1] = 1.0
    tangent = tangent_of(problem.evaluate(x, touch.parameter), point.metric, along)
    tangent *= sign * np.sign(by_state @ tangent[:size] + by_parameter * tangent[-1])
    launch = replace(point, tangent=tangent)
    for s in _OFF:
        try:
            found = moved(launch, ends + s * tangent, abs(launch.share) > _STEEP)
        except OrbitError:
            continue
        contacts, floored = signature(found.orbit)
        if wanted in ((contacts, floored), (contacts, None)):
            return found
    raise OrbitError("no orbit was found beside the touch")


def _indicator(point: Point, touch: Touch) -> tuple[Array, float, float]:
    """What changes its sign at a touch: derivatives by the first state and the parameter; how far aside to look."""
    rate, w = _rate(touch.chain), -point.orbit.system.contacts[touch.stop].direction
    n = len(w)
    columns = np.column_stack((touch.chain.tangents[0], touch.chain.by_parameter[0]))
    row, aside = w @ columns[:n], _ASIDE[0] * float(point.orbit.contacts.peak_indentation.max(initial=0.0))
    if touch.speed:
        row, aside = w @ columns[n:] - (w @ rate[n:]) / touch.speed * row, _ASIDE[1] * touch.speed
    return row[:-1], float(row[-1]), aside or _ASIDE[0] * float(np.abs(w @ touch.chain.x[0, :n]))


def _shots(problem: Problem, x: Array, parameter: float) -> Array:
    """States of all shots (m, 2n) of the motion from the first one."""
    (system, _), period = problem.shots(parameter)[0], problem.make(parameter)[1]
    begins = [(fraction - problem.fractions[0]) * period for fraction in problem.fractions]
    return np.array([x, *(flown(system, x, t, problem.method) for t in begins[1:])])
