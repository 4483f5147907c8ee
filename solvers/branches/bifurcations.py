"""Special points of a branch between two of its points.

A special point is a sign change of its test function along the arclength. With the Floquet multipliers μ:

    fold             parameter's share of the tangent
    flip             Π (μ_i + 1) / (1 + |μ_i|)                          (period doubling)
    neimark-sacker   Π_{i<j} (1 - μ_i μ_j) / (1 + |μ_i μ_j|), at a complex pair
    branch point     Π (1 - μ_i) / (1 + |μ_i|), where there is no fold
    grazing          number of contacts within the period changes
    stick            number of borders that laws with memory pass changes: a phase of slip, stick or yielding is born
    floor            a contact's entry rate less its law's floor, below which the law does not see it

μ_i are the transverse ones: those of a family of orbits are 1 all along. All but the grazings and sticks are continuous
along the branch, so that Brent's method finds their zeros in a few orbits. A
multiplier that jumps over the unit circle at a grazing or a floor is reported as that, not as a flip too. Points where
Newton's method fails because the return map is not smooth are located before, by `nonsmooth`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from solvers.branches.point import Point, corrected, cubic, is_straight, tangent_of
from solvers.orbits import Chain, Orbit, OrbitError, latching_stops, orbit_of
from solvers.problem import Array

ROUNDING = 1e-9  # of the test functions: what is at a special point all along is marked nowhere
_SHARP = 1e-10  # of the parameter, or of the way between the points: how sharply a point is located
_AT = 1e-4  # distance from the unit circle of the multiplier at what passes for a special point
_MOST_TRIALS = 25
_SAME = 1e-6  # relative difference of states that are the same
_MOST_TRIALS_OF_GRAZING = 60  # more than halving alone takes: with rounding left in an indentation, no secant is of use
_NUDGES = 0.0, 1e-7, -1e-7, 1e-6, -1e-6  # of the way: at some guesses rounding keeps the residual over its tolerance
_MOST_GRAZINGS = 4  # looked for between two points


def indicators(orbit: Orbit, tangent: Array) -> dict[str, float]:
    """Test functions of an orbit; each changes its sign at a special point of its name."""
    mu = orbit.transverse
    first, second = _pairs(len(mu))
    return {
        "fold": float(tangent[-1]),
        "flip": _product(mu, 1.0),
        "neimark-sacker": _product(-mu[first] * mu[second], 1.0),
        "branch point": _product(-mu, 1.0),
    }


@lru_cache(maxsize=16)
def _pairs(count: int) -> Any:
    """Numbers (2, pairs) of all pairs of multipliers."""
    return np.triu_indices(count, 1)


def indicators_at(point: Point) -> dict[str, float]:
    """Test functions of a point, which is asked on both of its sides; kept there."""
    if not point.tests:
        point.tests.update(indicators(point.orbit, point.tangent))
    return point.tests


def _product(values: Any, shift: float) -> float:
    """Π (value + shift) / (1 + |value|), of values that are real or come in conjugate pairs."""
    return float(((values + shift) / (1.0 + np.abs(values))).prod().real)


def _is_at(orbit: Orbit, name: str) -> bool:
    """Whether a multiplier is where a special point has it."""
    mu = orbit.transverse
    if name == "neimark-sacker":
        turning = np.abs(mu.imag) > 1e-6 * np.abs(mu)
        return bool(np.any(np.abs(np.abs(mu[turning]) - 1.0) < _AT))
    return bool(np.abs(mu - (-1.0 if name == "flip" else 1.0)).min() < _AT)


@dataclass(eq=False)
class Segment:
    """The part of a branch between two neighbouring points; every orbit found on it improves the next guess.

    Branch minus the cubic through both points and tangents is s² (way - s)² times a smooth function, interpolated here.
    """

    a: Point
    b: Point
    way: float
    straight: bool = field(init=False)
    known: list[tuple[float, Array]] = field(default_factory=list)  # (arclength, the smooth function there)
    trials: dict[float, tuple[Chain, Orbit]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.straight = is_straight(self.a.share, self.b.share)

    def at(self, s: float) -> tuple[Chain, Orbit]:
        """The branch at an arclength from a; raises OrbitError."""
        if s not in self.trials:
            guess, bend = cubic(self.a, self.b, self.way, s), (s * (self.way - s)) ** 2
            if self.known:
                places, off = [place for place, _ in self.known], np.array([rest for _, rest in self.known])
                guess += bend * np.array([np.interp(s, places, column) for column in off.T])
            chain, error, iterations = corrected(self.a, guess, self.straight, not self.straight)
            rest = np.append(chain.x.ravel(), chain.parameter) - cubic(self.a, self.b, self.way, s)
            if bend > 0.0:
                self.known = sorted([*self.known, (s, rest / bend)], key=lambda pair: pair[0])
            orbit = orbit_of(self.a.problem, chain, error, iterations, parameter=chain.parameter)
            self.trials[s] = chain, orbit
        return self.trials[s]

    def orbit(self, s: float) -> Orbit:
        """The orbit at an arclength from a; raises OrbitError."""
        return self.a.orbit if s == 0.0 else self.b.orbit if s == self.way else self.at(s)[1]

    def near(self, s: float, width: float) -> tuple[float, Orbit]:
        """(arclength, orbit) at s, or hardly aside if none is found there; raises OrbitError."""
        for place in (s + share * width for share in _NUDGES):
            try:
                return place, self.orbit(place)
            except OrbitError:
                continue
        raise OrbitError("no orbit was found near a guess between two orbits")

    def indicators(self, s: float) -> dict[str, float]:
        """Test functions at an arclength from a."""
        for place, point in ((0.0, self.a), (self.way, self.b)):
            if s == place:
                return indicators_at(point)
        chain, orbit = self.at(s)
        a = self.a
        return indicators(orbit, a.tangent if self.straight else tangent_of(chain, a.metric, a.tangent))

    def sharpness(self) -> float:
        """Arclength to which a special point is to be located."""
        pace = abs(self.b.chain.parameter - self.a.chain.parameter) / self.way
        fine = abs(self.a.chain.parameter) / pace if self.straight else self.way
        return _SHARP * min(fine, self.way)


def between(a: Point, b: Point, way: float, before: tuple[Point, float] | None = None) -> list[Orbit]:
    """Marked orbits at the special points between two points ``way`` apart, in their order.

    ``before`` is the point before a and the way from it: the three together may tell of two special points on the way.
    """
    segment = Segment(a, b, way)
    found = list(_nonsmooth_points(segment))
    places = [0.0, *sorted(place for place, _ in found or _dips(segment, before)), way]
    for begin, end in pairwise(places):
        found += _roots(segment, begin, end)
    return [orbit for _, orbit in sorted(found, key=lambda pair: pair[0])]


def _roots(segment: Segment, begin: float, end: float) -> Iterator[tuple[float, Orbit]]:
    """(arclength, orbit) of all zeros of test functions that the signs at both ends tell of."""
    before, after = segment.indicators(begin), segment.indicators(end)
    names = [name for name in before if before[name] * after[name] < 0.0]
    names = [name for name in names if min(abs(before[name]), abs(after[name])) > ROUNDING]
    if "fold" in names and "branch point" in names:
        names.remove("branch point")
    for name in names:
        pair = _root(segment, begin, end, name)
        if pair is not None:
            yield pair


def _dips(segment: Segment, before: tuple[Point, float] | None) -> Iterator[tuple[float, Orbit]]:
    """(arclength, orbit) where a test function changes its sign twice on the way, by a parabola through three."""
    if before is None:
        return
    first, begin, end = (indicators_at(point) for point in (before[0], segment.a, segment.b))
    for name in ("flip", "neimark-sacker"):
        f = begin[name]
        back, ahead = (f - first[name]) / before[1], (end[name] - f) / segment.way  # slopes on both sides
        bend = (ahead - back) / (before[1] + segment.way)
        slope = ahead - bend * segment.way
        place = -0.5 * slope / bend if bend else 0.0
        if f * end[name] > 0.0 > f * (f + 0.5 * slope * place) and 0.0 < place < segment.way:
            try:
                yield place, segment.at(place)[1]
            except OrbitError:
                continue


def _root(segment: Segment, begin: float, end: float, name: str) -> tuple[float, Orbit] | None:
    """(arclength, orbit) where a test function is zero; None where it only jumps."""
    pair = _zero(segment, begin, end, lambda s: segment.indicators(s)[name])
    return (pair[0], replace(pair[1], mark=name)) if pair is not None and _is_at(pair[1], name) else None


def _zero(segment: Segment, begin: float, end: float, value: Callable[[float], float]) -> tuple[float, Orbit] | None:
    """(arclength, orbit) where a function of the arclength changes its sign; None where no orbit is found."""
    from scipy.optimize import brentq

    found: dict[float, tuple[float, Orbit]] = {}

    def nearby(s: float) -> float:
        found[s] = segment.near(s, end - begin)
        return value(found[s][0])

    try:
        place, _ = brentq(
            *(nearby, begin, end),
            **{"xtol": segment.sharpness(), "maxiter": _MOST_TRIALS, "full_output": True, "disp": False},
        )
        return found[place]
    except (OrbitError, np.linalg.LinAlgError, IndexError, KeyError):
        return None


def _nonsmooth_points(segment: Segment) -> Iterator[tuple[float, Orbit]]:
    """(arclength, orbit) where the number of contacts changes, and where an entry rate passes its law's floor."""
    begin, first = 0.0, segment.a.orbit
    for _ in range(_MOST_GRAZINGS):
        if len(first.contacts) == len(segment.b.orbit.contacts):
            break
        found = _grazing(segment, begin, first)
        if found is None:
            return
        near, place, grazed, behind, last = found
        yield from _floors(segment, begin, near)
        yield place, replace(grazed, mark="grazing")
        begin, first = behind, last
    yield from _floors(segment, begin, segment.way)
    if len(segment.a.orbit.contacts) == len(segment.b.orbit.contacts):
        yield from _sticks(segment)


def _sticks(segment: Segment) -> Iterator[tuple[float, Orbit]]:
    """(arclength, orbit) where the number of transitions changes."""
    begin, first = 0.0, segment.a.orbit
    for _ in range(_MOST_GRAZINGS):
        if len(first.transitions) == len(segment.b.orbit.transitions):
            return
        found = _grazing(segment, begin, first, "transitions")
        if found is None:
            return
        _, place, at, begin, first = found
        yield place, replace(at, mark="stick")


def _floors(segment: Segment, begin: float, end: float) -> Iterator[tuple[float, Orbit]]:
    """(arclength, orbit) where an entry rate passes its law's floor, between two places of as many contacts."""
    first, last = (_over_floor(segment.orbit(s)) for s in (begin, end))
    for number in np.flatnonzero(first * last < 0.0) if len(first) == len(last) else ():

        def over(s: float, number: int = int(number)) -> float:
            return float(_over_floor(segment.orbit(s))[number])

        pair = _zero(segment, begin, end, over)
        if pair is not None and np.abs(_over_floor(pair[1])).min(initial=1.0) < _AT:  # else it only jumped
            yield pair[0], replace(pair[1], mark="floor")


def _over_floor(orbit: Orbit) -> Array:
    """Entry rate less the floor, in units of it, of every contact in the order of stops and time; 1 where none acts."""
    log, over = orbit.contacts, np.ones(len(orbit.contacts))
    for stop in latching_stops(orbit.system):
        mine, floor = log.stop == stop, orbit.system.contacts[stop].law.entry_rate_floor
        over[mine] = log.speed_in[mine] / floor - 1.0 if floor else 1.0
    ordered: Array = over[np.lexsort((log.t_in, log.stop))]
    return ordered


def _grazing(
    segment: Segment, begin: float, first: Orbit, log: str = "contacts"
) -> tuple[float, float, Orbit, float, Orbit] | None:
    """Where the number of contacts changes first after a place: place before, place, orbit, place and orbit behind.

    There the shallowest contact's indentation goes to zero, or the flight between two contacts that become one; of
    "transitions" the time between two.
    """
    last, behind = segment.b.orbit, segment.way
    more = _count(last, log) > _count(first, log)  # whether contacts are added on the way
    distance = _shortest_phase
    if log == "contacts":
        distance = _distance(last, first) if more else _distance(first, last)
    near, near_orbit = begin, first
    known = [(behind, distance(last)) if more else (begin, distance(first))]  # on the side with more contacts
    sharp = segment.sharpness()
    for _ in range(_MOST_TRIALS_OF_GRAZING):
        grazed, bare = (behind, near) if more else (near, behind)
        place = 0.5 * (grazed + bare)
        root = grazed + 2.0 * sharp
        if len(known) > 1 and known[-1][1] != known[-2][1]:
            (s0, f0), (s1, f1) = known[-2:]
            root = s1 - f1 * (s1 - s0) / (f1 - f0)
            if min(bare, grazed) < root < max(bare, grazed):
                place = root + 0.01 * (grazed - root)
        if abs(behind - near) <= sharp or abs(root - grazed) <= sharp:
            if abs(behind - near) <= sharp and _parted(near_orbit, last):
                return None
            at, touching = (behind, last) if more else (near, near_orbit)
            return near, at, touching, behind, last
        try:
            place, orbit = segment.near(place, behind - near)
        except OrbitError:
            return None
        same = _count(orbit, log) == _count(first, log)
        if same:
            near, near_orbit = place, orbit
        else:
            behind, last = place, orbit
        if same != more:
            known.append((place, distance(orbit)))
    return None


def _count(orbit: Orbit, log: str) -> int:
    """Number of contacts or transitions."""
    return len(getattr(orbit, log))


def _parted(a: Orbit, b: Orbit) -> bool:
    """Whether two orbits at one place of the branch differ: it jumps there, as where two contacts merge."""
    return bool(np.abs(a.state - b.state).max() > _SAME * np.abs(a.state).max())


def _distance(more: Orbit, less: Orbit) -> Callable[[Orbit], float]:
    """What goes to zero where an orbit loses a contact another has."""
    a, b = more.contacts, less.contacts
    apart = (a.t_in[:, None] > b.t_out) | (a.t_out[:, None] < b.t_in) | (a.stop[:, None] != b.stop)
    return _shallowest if np.any(np.all(apart, axis=1)) else _shortest_flight


def _shallowest(orbit: Orbit) -> float:
    """Smallest peak indentation of an orbit's contacts."""
    return float(orbit.contacts.peak_indentation.min(initial=np.inf))


def _shortest_phase(orbit: Orbit) -> float:
    """Square of the shortest time between two transitions of a contact: it vanishes like a root."""
    log, shortest = orbit.transitions, orbit.period
    for contact in np.unique(log.contact):
        times = np.unique(log.t[log.contact == contact])
        shortest = min(shortest, float(np.diff(times, append=times[0] + orbit.period).min()))
    return shortest**2


def _shortest_flight(orbit: Orbit) -> float:
    """Square of the shortest time between two contacts of one stop: it vanishes like a root."""
    log, shortest = orbit.contacts, orbit.period
    for stop in np.unique(log.stop):
        mine = log.stop == stop
        begins, ends = np.sort(log.t_in[mine]), np.sort(log.t_out[mine])
        shortest = min(shortest, float((np.append(begins[1:], begins[0] + orbit.period) - ends).min()))
    return shortest**2
