"""Where two contacts of one stop become one, or one becomes two: a branch ends there, and another begins nearby.

A law that latches its entry rate forgets it in the shortest flight. As the flight between two contacts vanishes, the
second is entered ever more slowly, down to its law's floor; without the flight the first one's rate still acts. So the
return map jumps, whatever the floor. The way over the jump are orbits that touch the surface at an instant t*, from
within, and go on with any rate r between both: no motions of the system, but those of any law that forgets gradually,
as the flight grows. They solve

    Φ_0(x_0) = x_1,   Φ_1(x_1; r) = x_2,   ...,   δ(x_1) = 0,   δ̇(x_1) = 0

for the shots' states, the parameter and t*, and lead from the end of one branch (r the floor) to that of the other (r
the first contact's entry rate). On both, shots are regular where they end.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from solvers.chain import Chain, Problem, delayed
from solvers.integration import integrate
from solvers.periodic import Orbit, OrbitError, flown
from solvers.point import Point, moved, tangent_of
from solvers.quiet import with_memory
from solvers.result import ContactLog, SolverError
from solvers.system import Array, Contact, System

_NEAR = 1e-4  # arclength from a point at which a branch is lost within which its end is looked for
_SLOW = 0.2  # entry rate of the second contact in units of the first one's, or depth of a touch in units of the peak
_MOST = 8  # iterations of Newton's method
_CLOSE = 1e-7  # arclength of its last step
_MOST_STEPS = 60  # of the rate
_FACTORS = 1.02, 1.5, 4.0  # least, first and largest ratio of successive rates
_SAME = 1e-7  # relative difference of rates that are the same
_ASIDE = 1e-6  # distance from the touch at which the branches' directions are seen, in units of the peak indentation
_OFF = 1e-8, 1e-7, 1e-6, 1e-5  # arclengths from its end at which the first orbit of a branch is tried
_SAMPLES = 400


@dataclass(frozen=True, eq=False)
class _Raised:
    """A law with another floor of the entry rate."""

    law: Any
    entry_rate_floor: float

    def __getattr__(self, name: str) -> Any:
        return getattr(self.law, name)


@dataclass(frozen=True, eq=False)
class _Touching(Problem):
    """Shots of which the second begins at the touch, with a given entry rate."""

    stop: int = 0
    rate: float = 0.0

    def shots(self, parameter: float) -> list[tuple[System, float]]:
        """(system from the shot's begin on, duration) of every shot."""
        known = parameter in self.kept
        shots = super().shots(parameter)
        if not known:
            system, duration = shots[1]
            contacts = list(system.contacts)
            law = _Raised(contacts[self.stop].law, self.rate)
            contacts[self.stop] = replace(contacts[self.stop], law=law)
            shots[1] = system.like(contacts=contacts), duration
        return shots


@dataclass(frozen=True, eq=False)
class _Touch:
    """An orbit that touches a stop's surface from within at the begin of its second shot, and goes on with a rate."""

    stop: int
    rate: float
    fractions: tuple[float, ...]
    unknowns: Array  # [states of the shots, parameter]
    chain: Chain

    @property
    def first_rate(self) -> float:
        """At which the contact was entered that the touch ends, or does not end."""
        log = self.chain.solutions[0].contacts
        mine = (log.stop == self.stop) & (log.peak_indentation > 1e-4 * log.peak_indentation.max())
        return float(log.speed_in[mine][-1])


def across(point: Point) -> tuple[Orbit, Point] | None:
    """The end of the branch that is near a point, and the begin of the one behind the jump; None if there is none.

    Both are marked "merging".
    """
    count = len(point.orbit.contacts)
    for stop, times, inside in _candidates(point.orbit):
        floor = point.orbit.system.contacts[stop].law.entry_rate_floor
        try:
            near = _first(point, stop, times, inside)
            if _distance(point, near) > _NEAR:
                continue
            far = _led(point, near, floor if inside else None)
            end, begin = _beside(point, near, inside, count), _beside(point, far, not inside, count + 2 * inside - 1)
        except (SolverError, np.linalg.LinAlgError, ValueError, ArithmeticError, IndexError):
            continue
        return replace(end.orbit, mark="merging"), replace(begin, orbit=replace(begin.orbit, mark="merging"))
    return None


def _candidates(orbit: Orbit) -> Iterator[tuple[int, list[float], bool]]:
    """(stop, times at which shots begin after the first, whether the touch is within one contact), likeliest first.

    A touch between two contacts, or within one, and a time in the flight after them if slower ones follow.
    """
    log, found = orbit.contacts, []
    for stop in with_memory(orbit.system):
        mine = np.flatnonzero(log.stop == stop)
        mine = mine[np.argsort(log.t_in[mine])]
        begins = np.append(log.t_in[mine], orbit.period)
        for i, j in enumerate(mine):
            first = log.speed_in[j]
            if i + 1 < len(mine):
                k = mine[i + 1]
                found.append((log.speed_in[k] / first, stop, [log.t_out[j], *_after(log, mine, i + 1, begins)], False))
            depth, time = _shallowest(orbit, stop, log.t_in[j], log.t_out[j])
            found.append((depth / log.peak_indentation[j], stop, [time, *_after(log, mine, i, begins)], True))
    for share, stop, times, inside in sorted(found, key=lambda one: one[0]):
        if share < _SLOW:
            yield stop, times, inside


def _after(log: ContactLog, mine: Array, i: int, begins: Array) -> list[float]:
    """The middle of the flight after a stop's i-th contact if slower ones follow, which the raised floor would reach."""
    slower = np.any(log.speed_in[mine[i + 1 :]] < log.speed_in[mine[max(i - 1, 0)]])
    return [0.5 * (log.t_out[mine[i]] + begins[i + 1])] if slower else []


def _shallowest(orbit: Orbit, stop: int, begin: float, end: float) -> tuple[float, float]:
    """Indentation and time of the deepest dip within a contact; inf if it has none."""
    n, contact = orbit.system.size, orbit.system.contacts[stop]
    times = np.linspace(begin, end, _SAMPLES)
    method = replace(orbit.method, ledger=False)
    q = integrate(delayed(orbit.system, orbit.phase), orbit.state[:n], orbit.state[n:], end, times, method).q
    delta = -q @ contact.direction - contact.gap
    dips = 1 + np.flatnonzero((delta[1:-1] < delta[:-2]) & (delta[1:-1] <= delta[2:]))
    if not len(dips):
        return math.inf, math.nan
    least = dips[np.argmin(delta[dips])]
    return float(delta[least]), float(times[least])


def _first(point: Point, stop: int, times: list[float], inside: bool) -> _Touch:
    """The touch near a point."""
    orbit, n2 = point.orbit, len(point.orbit.state)
    begins = [orbit.phase + t for t in (0.0, *times)]
    later = delayed(orbit.system, orbit.phase)
    states = [orbit.state, *(flown(later, orbit.state, t, orbit.method) for t in times)]
    guess = np.concatenate((*states, [point.chain.parameter, begins[1] / orbit.period]))
    rest = tuple(t / orbit.period for t in begins)
    floor = orbit.system.contacts[stop].law.entry_rate_floor
    if not inside:
        return _solved(point, stop, rest, guess, floor)
    log = orbit.contacts
    entered = (log.stop == stop) & (log.t_in < times[0]) & (log.t_out > times[0])
    touch = _solved(point, stop, rest, guess, float(log.speed_in[entered][0]))
    return _led(point, touch, None)


def _led(point: Point, touch: _Touch, rate: float | None) -> _Touch:
    """The touch with another rate, None: the first contact's, reached in steps; raises OrbitError."""
    known, factor = [touch], _FACTORS[1]
    for _ in range(_MOST_STEPS):
        last = known[-1]
        ratio = (rate or last.first_rate) / last.rate
        if abs(ratio - 1.0) < _SAME:
            return last
        following = last.rate * min(max(ratio, 1.0 / factor), factor)
        try:
            known.append(_solved(point, last.stop, last.fractions, _ahead(known[-3:], following), following))
            factor = min(factor**1.5, _FACTORS[2])
        except (SolverError, np.linalg.LinAlgError, ValueError, ArithmeticError):
            factor = math.sqrt(factor)
            if factor < _FACTORS[0]:
                break
    raise OrbitError("the way over the jump was lost")


def _ahead(known: list[_Touch], rate: float) -> Array:
    """Guess of the unknowns at a rate: the polynomial in its logarithm through the ones known (Lagrange)."""
    places = np.log([touch.rate for touch in known])
    weights = [np.prod([(math.log(rate) - b) / (a - b) for b in places if b != a]) for a in places]
    guess: Array = sum(w * touch.unknowns for w, touch in zip(weights, known, strict=True))
    return guess


def _solved(point: Point, stop: int, fractions: tuple[float, ...], unknowns: Array, rate: float) -> _Touch:
    """The touch with a rate near a guess, by Newton's method; raises OrbitError."""
    problem, size = point.problem, len(point.orbit.state)
    for _ in range(_MOST):
        fractions = (fractions[0], float(unknowns[-1]), *fractions[2:])
        x, parameter = unknowns[:-2].reshape(len(fractions), size), float(unknowns[-2])
        shots = _Touching(problem.make, problem.method, fractions, problem.step, stop, rate)
        chain = shots.evaluate(x, parameter)
        system, period = problem.make(parameter)
        step = np.linalg.solve(*_linear(chain, system.contacts[stop], period))
        unknowns = unknowns + step
        if _length(point, step) < _CLOSE:
            return _Touch(stop, rate, (fractions[0], float(unknowns[-1]), *fractions[2:]), unknowns, chain)
    raise OrbitError(f"no touching orbit was found in {_MOST} iterations")


def _linear(chain: Chain, contact: Contact, period: float) -> tuple[Array, Array]:
    """Matrix and right side of Newton's step for the unknowns of a touch."""
    m, size = chain.residual.shape
    n, speed = size // 2, chain.solutions[0].rate * period  # of the state at the touch, per period
    later = np.zeros((m, size))
    later[0], later[1] = speed, -chain.tangents[1] @ speed
    rows = np.zeros((2, m * size + 2))
    rows[0, size : size + n] = rows[1, size + n : 2 * size] = -contact.direction
    matrix = np.vstack((np.column_stack((chain.jacobian(), chain.by_parameter.ravel(), later.ravel())), rows))
    delta, rate = -chain.x[1, :n] @ contact.direction - contact.gap, -chain.x[1, n:] @ contact.direction
    return matrix, -np.concatenate((chain.residual.ravel(), [delta, rate]))


def _distance(point: Point, touch: _Touch) -> float:
    """Arclength from a point to a touch."""
    size = len(point.orbit.state)
    off = touch.unknowns - np.concatenate((point.chain.x[0], touch.unknowns[size:-2], [point.chain.parameter, 0.0]))
    return _length(point, off)


def _length(point: Point, step: Array) -> float:
    """Arclength of a step of a touch's unknowns, by that of the first state and the parameter."""
    size, m = len(point.orbit.state), len(point.chain.x)
    first, G = step[:size], point.metric
    return math.sqrt(m * first @ G[:size, :size] @ first + G[-1, -1] * step[-2] ** 2)


def _beside(point: Point, touch: _Touch, inside: bool, count: int) -> Point:
    """An orbit of so many contacts very near a touch, on the side where the stop is not left or the one where it is.

    Its tangent points away from the touch.
    """
    problem, n = point.problem, point.orbit.system.size
    contact, sign = point.orbit.system.contacts[touch.stop], 1.0 if inside else -1.0
    by_state = -contact.direction @ touch.chain.tangents[0][:n]  # of the indentation at the touch
    by_parameter = -contact.direction @ touch.chain.by_parameter[0][:n]
    x, parameter = touch.unknowns[: 2 * n], float(touch.unknowns[-2])
    aside = np.linalg.solve(point.metric[: 2 * n, : 2 * n], by_state)
    peak = float(touch.chain.solutions[0].contacts.peak_indentation.max())
    chain = problem.evaluate(_shots(problem, x + sign * _ASIDE * peak * aside / (by_state @ aside), parameter), parameter)
    along = np.zeros(len(point.metric))
    along[-1] = 1.0
    tangent = tangent_of(chain, point.metric, along)
    tangent *= sign * np.sign(by_state @ tangent[: 2 * n] + by_parameter * tangent[-1])
    launch = Point(point.orbit, problem, chain, tangent, point.metric)
    ends = np.append(_shots(problem, x, parameter).ravel(), parameter)
    for s in _OFF:
        try:
            found = moved(launch, ends + s * tangent, True)
        except OrbitError:
            continue
        if len(found.orbit.contacts) == count:
            return found
    raise OrbitError("no orbit was found beside the touch")


def _shots(problem: Problem, x: Array, parameter: float) -> Array:
    """States of all shots (m, 2n) of the motion from the first one."""
    (system, _), period = problem.shots(parameter)[0], problem.make(parameter)[1]
    begins = [(fraction - problem.fractions[0]) * period for fraction in problem.fractions]
    return np.array([x, *(flown(system, x, t, problem.method) for t in begins[1:])])
