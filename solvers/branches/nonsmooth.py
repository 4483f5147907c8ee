"""Nonsmooth points of a branch, where its return map has a corner or a jump, and how they are crossed.

    grazing   a contact appears or vanishes: a flight comes to touch, or a contact's entry rate goes to zero
    floor     a contact's entry rate passes its law's floor, below which the law does not depend on it
    merging   the flight between two contacts of a law that latches the entry rate vanishes, see `merging`

The Jacobian jumps at each, so that Newton's method from one side fails on the other, and the branch may turn back with
a corner. The point is located exactly, by `grazing`, and the branch continues from there with the Jacobian of the other
side.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from solvers.branches.grazing import Grazing, beside, first_grazing, orbit_at, signature
from solvers.branches.merging import led
from solvers.branches.point import NO_ORBIT, Point
from solvers.orbits import Orbit, delayed, latching_stops, run
from solvers.orbits.open_times import open_intervals
from solvers.problem import ContactLog

_SLOW = 4.0  # entry rate, in units of the floor, below which a contact may be about to pass it
_SHALLOW = 0.1  # indentation, or distance, in units of the deepest peak, below which a contact may vanish or appear
_AS_NEAR = 1e-3  # relative difference of distances up to which points may come at once; absolute: its square
_SAMPLES = 600  # of a period
ERRORS = *NO_ORBIT, IndexError


@dataclass(frozen=True)
class NonsmoothPoint:
    """A nonsmooth point an orbit is near: its kind, times and stops, and the sign of the indicator behind it."""

    kind: str
    begins: tuple[tuple[float, int | None], ...]  # (time from the orbit's phase, stop) of meetings; None: an open time
    sign: int  # of the indicator behind it: indentation at the meeting, or its rate less the floor
    change: tuple[int, int]  # of the signature

    @property
    def sort(self) -> tuple[str, int, tuple[int, int]]:
        """Equal for nonsmooth points that come at once."""
        return self.kind, self.sign, self.change

    @property
    def first(self) -> tuple[float, int]:
        """(time, stop) of the first meeting."""
        return next((time, stop) for time, stop in self.begins if stop is not None)


def _nonsmooth(kind: str, stop: int, times: Sequence[float], sign: int, change: tuple[int, int]) -> NonsmoothPoint:
    """The nonsmooth point of one meeting, at the first of some times; the others are open times."""
    return NonsmoothPoint(kind, ((times[0], stop), *((time, None) for time in times[1:])), sign, change)


def nonsmooth_near(orbit: Orbit) -> list[NonsmoothPoint]:
    """Nonsmooth points an orbit may be near, the nearest first."""
    found: list[tuple[float, NonsmoothPoint]] = []
    for stop in (s for s, contact in enumerate(orbit.system.contacts) if not contact.always):
        found += _slow_contacts(orbit, stop)
        found += _new_grazings(orbit, stop)
    found.sort(key=lambda pair: pair[0])
    return list(_with_joint(found))


def _with_joint(found: Sequence[tuple[float, NonsmoothPoint]]) -> Iterator[NonsmoothPoint]:
    """The nonsmooth points; several of one sort at equal distance are preceded by one in which all are met at once."""
    rest = list(found)
    while rest:
        nearest, first = rest[0]
        like = [near <= nearest + _AS_NEAR * (nearest + _AS_NEAR) and one.sort == first.sort for near, one in rest]
        mine = [one for (_, one), alike in zip(rest, like, strict=True) if alike]
        if len(mine) > 1:
            begins = tuple(sorted({begin for one in mine for begin in one.begins}, key=lambda begin: begin[0]))
            change = len(mine) * first.change[0], len(mine) * first.change[1]
            yield replace(first, begins=begins, change=change)
        yield from mine
        rest = [pair for pair, alike in zip(rest, like, strict=True) if not alike]


def _slow_contacts(orbit: Orbit, stop: int) -> Iterator[tuple[float, NonsmoothPoint]]:
    """(closeness, nonsmooth point) of a stop's contacts that may pass the floor, vanish or merge with another."""
    log, floor = orbit.contacts, orbit.system.contacts[stop].law.entry_rate_floor
    mine, latches = _in_order(log, stop), stop in latching_stops(orbit.system)
    for i, j in enumerate(mine):
        begin, end, speed = float(log.t_in[j]), float(log.t_out[j]), float(log.speed_in[j])
        if latches and speed < _SLOW * floor:
            sign = 1 if speed < floor else -1
            yield abs(speed / floor - 1.0), _nonsmooth("floor", stop, (begin,), sign, (0, -sign))
        if latches and speed < floor and i and begin - log.t_out[mine[i - 1]] < end - begin:
            times = float(log.t_out[mine[i - 1]]), *_after(orbit, mine, i)
            yield speed / floor, _nonsmooth("merging", stop, times, 1, (-1, -1))
        elif speed < floor if latches else log.peak_indentation[j] < _SHALLOW * log.peak_indentation.max():
            share = speed / floor if latches else log.peak_indentation[j] / log.peak_indentation.max()
            yield share, _nonsmooth("grazing", stop, (0.5 * (begin + end),), -1, (-1, -int(latches)))


def _new_grazings(orbit: Orbit, stop: int) -> Iterator[tuple[float, NonsmoothPoint]]:
    """(closeness, nonsmooth point) of a stop's flights that come near it and contacts that nearly leave it."""
    log, latches = orbit.contacts, stop in latching_stops(orbit.system)
    contact, mine = orbit.system.contacts[stop], _in_order(log, stop)
    times = np.linspace(0.0, orbit.period, _SAMPLES + 1)
    method = replace(orbit.method, ledger=False)
    later = delayed(orbit.system, orbit.phase)
    delta = contact.indentation(run(later, orbit.whole, orbit.period, times, method).q)
    scale = _SHALLOW * max(float(log.peak_indentation.max(initial=0.0)), 1e-3 * float(np.abs(delta).max()))
    inner = np.arange(1, _SAMPLES)
    rising, falling = delta[inner] - delta[inner - 1], delta[inner + 1] - delta[inner]
    apart = np.where(rising != falling, rising - falling, 1.0)
    at = times.copy()
    at[inner] += 0.5 * times[1] * (rising + falling) / apart  # summit of the parabola through three, where one is
    for k in inner[(rising > 0.0) & (falling <= 0.0) & (delta[inner] < 0.0) & (delta[inner] > -scale)]:
        yield -delta[k] / scale, _nonsmooth("grazing", stop, (float(at[k]),), 1, (1, int(latches)))
    for k in inner[(rising < 0.0) & (falling >= 0.0) & (delta[inner] > 0.0) & (delta[inner] < scale) & latches]:
        i = int(np.searchsorted(log.t_in[mine], times[k])) - 1
        yield delta[k] / scale, _nonsmooth("merging", stop, (float(at[k]), *_after(orbit, mine, i)), -1, (1, 1))


def _in_order(log: ContactLog, stop: int) -> Any:
    """Indices of a stop's contacts in the order of time."""
    mine = np.flatnonzero(log.stop == stop)
    return mine[np.argsort(log.t_in[mine])]


def _after(orbit: Orbit, mine: Any, i: int) -> list[float]:
    """An open time after a stop's i-th contact, if slower ones follow, which another floor would affect."""
    log, rest = orbit.contacts, mine[i + 1 :]
    slower = rest[log.speed_in[rest] < log.speed_in[mine[max(i - 1, 0)]]]
    if not len(slower):
        return []
    low, high = log.t_out[mine[i]], log.t_in[slower[0]]
    open_times = [(max(a, low), min(b, high)) for a, b in open_intervals(orbit.system, log, orbit.period)]
    a, b = max(open_times, key=lambda times: times[1] - times[0], default=(low, low))
    return [float(0.5 * (a + b))] if a < b else []


def met(point: Point, nonsmooth: NonsmoothPoint, within: float) -> Grazing:
    """Locate a nonsmooth point within an arclength of a point; raises one of ERRORS."""
    orbit, (time, stop) = point.orbit, nonsmooth.first
    log, floor = orbit.contacts, orbit.system.contacts[stop].law.entry_rate_floor
    if nonsmooth.kind != "merging" or nonsmooth.sign > 0:
        return first_grazing(point, nonsmooth.begins, floor if nonsmooth.kind == "floor" else 0.0, floor, within)
    entered = (log.stop == stop) & (log.t_in < time) & (log.t_out > time)
    grazing = first_grazing(point, nonsmooth.begins, 0.0, float(log.speed_in[entered][0]), within)
    return led(point, grazing, None)


def before(point: Point, nonsmooth: NonsmoothPoint, grazing: Grazing) -> Point:
    """The last point of the branch on the side it comes from, its tangent on the way; raises one of ERRORS."""
    found = beside(point, grazing, -nonsmooth.sign, signature(point.orbit))
    return replace(found, tangent=-found.tangent)


def behind(point: Point, nonsmooth: NonsmoothPoint, grazing: Grazing) -> Point:
    """The first point of the branch on the other side, its tangent on the way; raises one of ERRORS."""
    contacts, clipped = signature(point.orbit)
    if nonsmooth.kind == "merging":  # other contacts change by the jump, too, and may pass the floor
        floor = point.orbit.system.contacts[nonsmooth.first[1]].law.entry_rate_floor
        far = led(point, grazing, None if nonsmooth.sign > 0 else floor)
        return beside(point, far, nonsmooth.sign, (contacts + nonsmooth.change[0], None))
    return beside(point, grazing, nonsmooth.sign, (contacts + nonsmooth.change[0], clipped + nonsmooth.change[1]))


def marked(last: Point, first: Point, nonsmooth: NonsmoothPoint, grazing: Grazing) -> list[Orbit]:
    """The orbits at a nonsmooth point with its mark."""
    if nonsmooth.kind == "grazing":
        return [orbit_at(last, grazing), first.orbit]
    if nonsmooth.kind == "merging":
        return [replace(orbit, mark="merging") for orbit in (last.orbit, first.orbit)]
    return [replace(last.orbit, mark="floor"), first.orbit]
