"""Continuation past corners of a branch where a law with memory begins or ceases to latch.

A number that is never latched within the period keeps its value: the orbit is one of a family. Where its border is
reached, the number begins to change, gradually with the parameter or by a jump to another branch. Simulation decides:
the motion from the last orbit is integrated for some periods at a slightly larger parameter, and Newton's method starts
from there.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.branches.point import NO_ORBIT, Point, corrected, point_of
from solvers.orbits import OrbitError, state_after

_SHARES = 1e-5, 1e-4, 1e-3, 1e-2  # of the span, changes of the parameter that are tried
_PERIODS = 30  # periods of that run
_CHECKED_SHARE, _MOST_DISTANCE = 0.25, 0.6  # share of a hop checked; its largest share of the distance on one branch


def hopped(a: Point, span: tuple[float, float], last: float) -> Point | None:
    """The first point found behind a corner near a point; None without laws with memory, or if none is found.

    ``last`` is the share of the span of the hop just before, 0 if there was none; then ten times that share is tried
    first: where an orbit keeps moving what it latches, so that a border is just reached, every point is a corner.
    """
    shares = sorted(_SHARES, key=lambda share: abs(math.log(share / (10.0 * last)))) if last > 0.0 else _SHARES
    for share in shares if a.orbit.memory else ():
        try:
            return _behind(a, share, span)
        except NO_ORBIT:
            continue
    return None


def _behind(a: Point, share: float, span: tuple[float, float]) -> Point:
    """The point at a parameter farther by a share of the span; raises OrbitError and others."""
    shift = math.copysign(share * (span[1] - span[0]), a.share)
    parameter = min(max(a.chain.parameter + shift, span[0]), span[1])
    point, distance = _point_at(a, parameter)
    near = a.chain.parameter + _CHECKED_SHARE * (parameter - a.chain.parameter)
    if not 0.0 < _point_at(a, near)[1] < _MOST_DISTANCE * distance:
        raise OrbitError("the motion goes over to another branch")
    return point


def _point_at(a: Point, parameter: float) -> tuple[Point, float]:
    """The point that the motion leads to, and its distance; raises OrbitError and others."""
    shots, x = a.problem.shots(parameter), a.chain.x[0]
    states = []
    for number in range(_PERIODS * len(shots) if a.orbit.stable else len(shots)):
        states.append(x)
        x = state_after(shots[number % len(shots)][0], x, shots[number % len(shots)][1], a.problem.method)
    guess = np.append(np.concatenate(states[-len(shots) :]), parameter)
    chain = corrected(a, guess, True, True)
    off = chain.unknowns - a.unknowns
    ahead = np.append(np.zeros(len(off) - 1), off[-1])  # latched numbers must not reverse the branch
    return point_of(a.problem, chain, a.metric, ahead), a.length(off)
