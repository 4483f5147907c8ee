"""Shots of a branch that begin later, because a contact has come near one of their starts.

A contact whose law depends on the entry rate must not be under way there. One whose force jumps must not begin or end
there: the state at a fixed time has a corner where the jump passes it, which Newton's method does not cross. Nor may a
law with memory reach a border there: its latched numbers at a fixed time jump where the border passes it.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from solvers.branches.point import Point, point_of
from solvers.orbits import Chain, OrbitError, delayed, latching_stops, newton, open_starts, states_at
from solvers.problem import Array, ContactLog, System

_MARGIN = 0.1  # part of the longest open interval that must lie on both sides of a shot's start


def _to_keep_clear_of(system: System, log: ContactLog) -> Any:
    """Which contacts of a log no shot may begin near: the law depends on the entry rate, or the force jumps."""
    jumping = [stop for stop, contact in enumerate(system.contacts) if contact.law.jump]
    return np.isin(log.stop, [*latching_stops(system), *jumping])


def reshot(point: Point) -> Point:
    """The same point, its shots begun later where a contact has come near one of their starts."""
    orbit, m = point.orbit, len(point.problem.fractions)
    log, period = orbit.contacts, orbit.period
    offsets = [(f - point.problem.fractions[0]) * period for f in point.problem.fractions]
    mine = _to_keep_clear_of(orbit.system, log)
    passed = orbit.transitions.t
    ends = np.concatenate((log.t_in[mine], log.t_out[mine], passed))
    times = np.concatenate((ends - period, ends, ends + period))

    def away(begins: list[float]) -> float:
        return min(float(np.abs(times - t).min(initial=period)) for t in begins)

    if away(offsets) > _MARGIN * period / (1 + len(log) + len(passed)):
        return point
    begins = open_starts(orbit.system, log, period, m, False, passed if orbit.memory else None)
    if len(begins) < m or not away(begins) > away(offsets):
        return point
    x = np.array(states_at(orbit, begins))
    fractions = [(orbit.phase + t) / period for t in begins]
    turns = math.floor(fractions[0])
    problem = replace(point.problem, fractions=tuple(f - turns for f in fractions))
    try:
        chain = newton(problem, x, point.chain.parameter, slope=True)
    except OrbitError:
        return point
    found = point_of(problem, chain, point.metric, _carried(point, chain, begins))
    leads_back = bool(orbit.memory) and found.share * point.share < 0.0  # one of a family, its border just not reached
    return point if leads_back else found


def _carried(point: Point, chain: Chain, begins: list[float]) -> Array:
    """The tangent transported to later starts of shots."""
    shift, n2 = begins[0], chain.x.shape[1]
    there = replace(point.problem, fractions=(point.problem.fractions[0],))
    make = there.make

    def shortened(parameter: float) -> tuple[System, float]:
        system, period = make(parameter)
        return delayed(system, there.fractions[0] * period), shift / point.orbit.period * period

    carried = replace(there, make=shortened, fractions=(0.0,)).evaluate(point.chain.x[:1], chain.parameter)
    first = carried.tangents[0] @ point.tangent[:n2] + carried.by_parameter[0] * point.tangent[-1]
    states = [first]
    for tangent, column in zip(chain.tangents[:-1], chain.by_parameter[:-1], strict=True):
        states.append(tangent @ states[-1] + column * point.tangent[-1])
    return np.append(np.concatenate(states), point.tangent[-1])
