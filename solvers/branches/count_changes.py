"""Where orbits between two points of a branch gain or lose contacts or transitions, or pass an entry rate's floor."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from solvers.orbits import Orbit, OrbitError, latching_stops
from solvers.problem import Array

if TYPE_CHECKING:
    from solvers.branches.bifurcations import Arc

_AT = 1e-4  # entry rate less the floor, in units of the floor, up to which an orbit is at the floor
_MOST_TRIALS = 25
_SAME = 1e-6  # relative difference of states up to which they are the same
_MOST_TRIALS_OF_GRAZING = 60  # more than bisection alone needs: with rounding in an indentation no secant helps
_SECANTS = 20  # of these, then halves alone: a phase that vanishes in a multiple zero has secants that hardly move
_MOST_GRAZINGS = 4  # located between two points


def zero(arc: Arc, begin: float, end: float, value: Callable[[float], float]) -> tuple[float, Orbit] | None:
    """(arclength, orbit) where a function of the arclength changes its sign; None where no orbit is found."""
    from scipy.optimize import brentq

    found: dict[float, tuple[float, Orbit]] = {}

    def nearby(s: float) -> float:
        found[s] = arc.near(s, end - begin)
        return value(found[s][0])

    try:
        place, _ = brentq(nearby, begin, end, xtol=arc.sharpness(), maxiter=_MOST_TRIALS, full_output=True, disp=False)
        return found[place]
    except (OrbitError, ValueError, IndexError, KeyError):  # ValueError: rounding has taken the change of sign away
        return None


def nonsmooth_points(arc: Arc) -> Iterator[tuple[float, Orbit]]:
    """(arclength, orbit) where the number of contacts changes, and where an entry rate passes its law's floor."""
    begin = 0.0
    for near, place, grazed, behind in _changes(arc, "contacts"):
        yield from _floors(arc, begin, near)
        yield place, replace(grazed, mark="grazing")
        begin = behind
    yield from _floors(arc, begin, arc.length)
    if len(arc.a.orbit.contacts) == len(arc.b.orbit.contacts):
        for _, place, at, _ in _changes(arc, "transitions"):
            yield place, replace(at, mark="stick")


def _changes(arc: Arc, log: str) -> Iterator[tuple[float, float, Orbit, float]]:
    """(place before, place, orbit there, place behind) of each change of the number of contacts or transitions."""
    begin, first = 0.0, arc.a.orbit
    for _ in range(_MOST_GRAZINGS):
        found = None if _count(first, log) == _count(arc.b.orbit, log) else _first_change(arc, begin, first, log)
        if found is None:
            return
        near, place, at, begin, first = found
        yield near, place, at, begin


def _floors(arc: Arc, begin: float, end: float) -> Iterator[tuple[float, Orbit]]:
    """(arclength, orbit) where an entry rate passes its law's floor, between two places of as many contacts."""
    first, last = (_over_floor(arc.orbit(s)) for s in (begin, end))
    for number in np.flatnonzero(first * last < 0.0) if len(first) == len(last) else ():

        def over(s: float, number: int = int(number)) -> float:
            return float(_over_floor(arc.orbit(s))[number])

        pair = zero(arc, begin, end, over)
        if pair is not None and np.abs(_over_floor(pair[1])).min(initial=1.0) < _AT:  # else it only jumped
            yield pair[0], replace(pair[1], mark="floor")


def _over_floor(orbit: Orbit) -> Array:
    """Entry rate over its floor less 1, of every contact in the order of stops and time; 1 without a floor."""
    log, over = orbit.contacts, np.ones(len(orbit.contacts))
    for stop in latching_stops(orbit.system):
        mine, floor = log.stop == stop, orbit.system.contacts[stop].law.entry_rate_floor
        over[mine] = log.speed_in[mine] / floor - 1.0 if floor else 1.0
    return over[np.lexsort((log.t_in, log.stop))]


def _first_change(arc: Arc, begin: float, first: Orbit, log: str) -> tuple[float, float, Orbit, float, Orbit] | None:
    """The first change after a place: (place before, place, orbit there, place and orbit behind).

    The distance that vanishes there is the shallowest contact's indentation, or the flight between two contacts that
    become one; of "transitions" the time between two.
    """
    last, behind = arc.b.orbit, arc.length
    more = _count(last, log) > _count(first, log)  # whether contacts are added on the way
    distance: Callable[[Orbit], float] = _shortest_phase
    if log == "contacts":
        distance = _distance(last, first) if more else _distance(first, last)
    near, near_orbit = begin, first
    known = [(behind, distance(last)) if more else (begin, distance(first))]  # on the side with more contacts
    sharp = arc.sharpness()
    for trial in range(_MOST_TRIALS_OF_GRAZING):
        grazed, bare = (behind, near) if more else (near, behind)
        place = 0.5 * (grazed + bare)
        root = grazed + 2.0 * sharp
        if trial < _SECANTS and len(known) > 1 and known[-1][1] != known[-2][1]:
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
            place, orbit = arc.near(place, behind - near)
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
    """The distance that vanishes where an orbit loses a contact that another one has."""
    a, b = more.contacts, less.contacts
    apart = (a.t_in[:, None] > b.t_out) | (a.t_out[:, None] < b.t_in) | (a.stop[:, None] != b.stop)
    return _shallowest if np.any(np.all(apart, axis=1)) else _shortest_flight


def _shallowest(orbit: Orbit) -> float:
    """Smallest peak indentation of an orbit's contacts."""
    return float(orbit.contacts.peak_indentation.min(initial=np.inf))


def _shortest_phase(orbit: Orbit) -> float:
    """Square of the shortest time between two transitions of a contact, s²: the time vanishes like a square root."""
    log = orbit.transitions
    times = [np.unique(log.t[log.contact == contact]) for contact in np.unique(log.contact)]
    return _shortest(orbit.period, [(one, one) for one in times])


def _shortest_flight(orbit: Orbit) -> float:
    """Square of the shortest time between two contacts of one stop, s²: the time vanishes like a square root."""
    log = orbit.contacts
    mine = [log.stop == stop for stop in np.unique(log.stop)]
    return _shortest(orbit.period, [(np.sort(log.t_in[one]), np.sort(log.t_out[one])) for one in mine])


def _shortest(period: float, pairs: list[tuple[Array, Array]]) -> float:
    """Square of the shortest time from ends to the next begins, both in order and periodic, s²."""
    spans = ((np.append(begins[1:], begins[0] + period) - ends).min() for begins, ends in pairs)
    return float(min([period, *spans])) ** 2
