"""Kinks of a branch, where its return map is not smooth, and the way across: straight on, around a corner, or a jump.

    grazing   a contact begins or ceases to be: a flight comes to touch, or a contact's entry rate goes to zero
    floor     a contact's entry rate passes its law's floor, below which the law does not see it
    merging   the flight between two contacts of a law that latches the entry rate vanishes, see `solvers.merging`

The Jacobian jumps at each, so that Newton's method from one side fails on the other, and the branch may turn back with
a corner. A kink is met exactly, by `solvers.touch`, and the branch is taken up again from there with the Jacobian of
the other side.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from solvers.chain import delayed
from solvers.integration import integrate
from solvers.merging import led
from solvers.periodic import Orbit
from solvers.point import Point
from solvers.quiet import with_memory
from solvers.result import ContactLog, SolverError
from solvers.touch import Touch, beside, first_touch, orbit_at, signature

_SLOW = 4.0  # entry rate, in units of the floor, below which a contact may be about to pass it
_SHALLOW = 0.1  # indentation, or distance, in units of the deepest peak that may be about to vanish
_SAMPLES = 600  # of a period
ERRORS = SolverError, np.linalg.LinAlgError, ValueError, ArithmeticError, IndexError


@dataclass(frozen=True)
class Kink:
    """What may happen to an orbit near: what kind, at which stop and times, and which way the indicator goes."""

    kind: str
    stop: int
    times: tuple[float, ...]  # from the orbit's phase: of the meeting, and in a quiet time if one is wanted
    sign: int  # of the indicator behind it: indentation at the meeting, or its rate less the floor
    change: tuple[int, int]  # of the signature


def kinks_near(orbit: Orbit) -> list[Kink]:
    """Kinks an orbit may be near, the nearest first."""
    found: list[tuple[float, Kink]] = []
    for stop in range(len(orbit.system.contacts)):
        found += _slow_contacts(orbit, stop)
        found += _touches(orbit, stop)
    return [kink for _, kink in sorted(found, key=lambda pair: pair[0])]


def _slow_contacts(orbit: Orbit, stop: int) -> Iterator[tuple[float, Kink]]:
    """(closeness, kink) of a stop's contacts that may pass the floor, vanish or merge with the one before."""
    log, floor = orbit.contacts, orbit.system.contacts[stop].law.entry_rate_floor
    mine, memory = _in_order(log, stop), stop in with_memory(orbit.system)
    for i, j in enumerate(mine):
        begin, end, speed = float(log.t_in[j]), float(log.t_out[j]), float(log.speed_in[j])
        if memory and speed < _SLOW * floor:
            sign = 1 if speed < floor else -1
            yield abs(speed / floor - 1.0), Kink("floor", stop, (begin,), sign, (0, -sign))
        if memory and speed < floor and i and begin - log.t_out[mine[i - 1]] < end - begin:
            times = float(log.t_out[mine[i - 1]]), *_after(log, mine, i, orbit.period)
            yield speed / floor, Kink("merging", stop, times, 1, (-1, -1))
        elif speed < floor if memory else log.peak_indentation[j] < _SHALLOW * log.peak_indentation.max():
            share = speed / floor if memory else log.peak_indentation[j] / log.peak_indentation.max()
            yield share, Kink("grazing", stop, (0.5 * (begin + end),), -1, (-1, -int(memory)))


def _touches(orbit: Orbit, stop: int) -> Iterator[tuple[float, Kink]]:
    """(closeness, kink) of a stop's flights that come near it and contacts that nearly leave it."""
    log, memory = orbit.contacts, stop in with_memory(orbit.system)
    n, contact, mine = orbit.system.size, orbit.system.contacts[stop], _in_order(log, stop)
    times = np.linspace(0.0, orbit.period, _SAMPLES + 1)
    method = replace(orbit.method, ledger=False)
    x, later = orbit.state, delayed(orbit.system, orbit.phase)
    delta = -integrate(later, x[:n], x[n:], orbit.period, times, method).q @ contact.direction - contact.gap
    scale = _SHALLOW * max(float(log.peak_indentation.max(initial=0.0)), 1e-3 * float(np.abs(delta).max()))
    inner = np.arange(1, _SAMPLES)
    rising, falling = delta[inner] - delta[inner - 1], delta[inner + 1] - delta[inner]
    for k in inner[(rising > 0.0) & (falling <= 0.0) & (delta[inner] < 0.0) & (delta[inner] > -scale)]:
        yield -delta[k] / scale, Kink("grazing", stop, (float(times[k]),), 1, (1, int(memory)))
    for k in inner[(rising < 0.0) & (falling >= 0.0) & (delta[inner] > 0.0) & (delta[inner] < scale) & memory]:
        i = int(np.searchsorted(log.t_in[mine], times[k])) - 1
        yield (
            delta[k] / scale,
            Kink("merging", stop, (float(times[k]), *_after(log, mine, i, orbit.period)), -1, (1, 1)),
        )


def _in_order(log: ContactLog, stop: int) -> Any:
    """Indices of a stop's contacts in the order of time."""
    mine = np.flatnonzero(log.stop == stop)
    return mine[np.argsort(log.t_in[mine])]


def _after(log: ContactLog, mine: Any, i: int, period: float) -> list[float]:
    """The middle of the flight after a stop's i-th contact if slower ones follow, which another floor would reach."""
    begins = np.append(log.t_in[mine], period)
    slower = np.any(log.speed_in[mine[i + 1 :]] < log.speed_in[mine[max(i - 1, 0)]])
    return [float(0.5 * (log.t_out[mine[i]] + begins[i + 1]))] if slower else []


def met(point: Point, kink: Kink, within: float) -> Touch:
    """The kink within an arclength of a point, exactly; raises one of ERRORS."""
    orbit = point.orbit
    log, floor = orbit.contacts, orbit.system.contacts[kink.stop].law.entry_rate_floor
    if kink.kind != "merging" or kink.sign > 0:
        return first_touch(point, kink.stop, kink.times, floor if kink.kind == "floor" else 0.0, floor, within)
    entered = (log.stop == kink.stop) & (log.t_in < kink.times[0]) & (log.t_out > kink.times[0])
    touch = first_touch(point, kink.stop, kink.times, 0.0, float(log.speed_in[entered][0]), within)
    return led(point, touch, None)


def before(point: Point, kink: Kink, touch: Touch) -> Point:
    """The last point of the branch on the side it comes from, its tangent on the way; raises one of ERRORS."""
    found = beside(point, touch, -kink.sign, signature(point.orbit))
    return replace(found, tangent=-found.tangent)


def behind(point: Point, kink: Kink, touch: Touch) -> Point:
    """The first point of the branch on the other side, its tangent on the way; raises one of ERRORS."""
    contacts, floored = signature(point.orbit)
    if kink.kind == "merging":  # other contacts too change by the jump, and may pass the floor
        floor = point.orbit.system.contacts[kink.stop].law.entry_rate_floor
        far = led(point, touch, None if kink.sign > 0 else floor)
        return beside(point, far, kink.sign, (contacts + kink.change[0], None))
    return beside(point, touch, kink.sign, (contacts + kink.change[0], floored + kink.change[1]))


def marked(last: Point, first: Point, kink: Kink, touch: Touch) -> list[Orbit]:
    """The orbits at a kink with what is to be told of it."""
    if kink.kind == "grazing":
        return [orbit_at(last, touch, mark="grazing"), first.orbit]
    if kink.kind == "merging":
        return [replace(orbit, mark="merging") for orbit in (last.orbit, first.orbit)]
    return [replace(last.orbit, mark="floor"), first.orbit]
