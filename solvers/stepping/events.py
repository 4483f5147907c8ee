"""Where, within one step, a stop leaves its segment of the law: free flight, or the range between two knots.

Inside a step the displacement of every row is the polynomial of the method's dense output,
``u(θ) = u₀ + θ(r₀ + (1-θ)(r₁ + θ(r₂ + (1-θ)(r₃ + ...))))``, θ in [0, 1]. The indentation is that of one row, or of a
circular clearance ±(|u| - c) of two.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import numpy as np

from solvers.compiled.friction import xi_acceleration_of, xi_and_rate_of
from solvers.compiled.kernels import (
    dot,
    indentation,
    inlined,
    inner,
    kernel,
    merged,
    radial,
    radius_of,
    slider_of,
    surface_tolerance,
)
from solvers.compiled.sliding import ACCELERATION, DELTA, RATE, XI, XI_ACCELERATION, XI_RATE

# finer near 0, where a contact just left may come back
_NODES = np.array([0.0, 1 / 64, 1 / 32, 1 / 16, 1 / 8, 1 / 4, 3 / 8, 1 / 2, 5 / 8, 3 / 4, 7 / 8, 1.0])
_GOLDEN = 0.6180339887498949
UNRESOLVED = -1.0  # in place of θ: a stop that has just left its border crosses it at once, so the step must be shorter
NONE = 2.0  # in place of θ: no event in the step
MOST_LANDINGS = 60
"""Trials of a landing: where the level is only just reached, each of Newton or bisection halves the distance."""
IN_FLIGHT, IN_CONTACT, RTOL, ATOL = range(4)  # places in `Move.limits`
IGNORED, HENON, LOCATED = range(3)
"""How a method treats events: segments follow at the end of a step; Hénon's step onto an entry; all located."""


class Move(NamedTuple):
    """What a step of any method reads and writes: arrays of `State` and of `loop.Space`."""

    x: Annotated[Any, "X"]
    rate: Annotated[Any, "X"]
    segment: Annotated[Any, "int E"]
    entry_rate: Annotated[Any, "E"]
    x_new: Annotated[Any, "X"]  # end of the step
    rate_new: Annotated[Any, "X"]
    dense: Annotated[Any, "7, X"]  # rows r of the interpolant, see above
    work: Annotated[Any, "rows, X"]  # of the method, whose constants are in the last row
    limits: Annotated[Any, "4"]  # longest steps in flight and in contact, s, then rtol and atol


@kernel
def count_in_contact(segment):
    """Number of stops in contact."""
    count = 0
    for s in range(segment.size):
        count += 1 if segment[s] > 0 else 0
    return count


@inner
def polynomial(coefficients, theta):
    """Value at θ of the dense output of a row, from its coefficients (u₀, r₀ ... r₆)."""
    u = 1.0 - theta
    r = coefficients
    return r[0] + theta * (r[1] + u * (r[2] + theta * (r[3] + u * (r[4] + theta * (r[5] + u * (r[6] + theta * r[7]))))))


@inner
def motion_of(problem, s, x, dense, coefficients):
    """Write the coefficients of displacement and rate of a stop's first row, then of its other rows."""
    for r in range(problem.first[s], problem.first[s + 1]):
        place = 2 * (r - problem.first[s])
        _coefficients_of(problem.read[r], problem.gap[r], x, dense, coefficients[place])
        _coefficients_of(problem.read_rate[r], 0.0, x, dense, coefficients[place + 1])


@inner
def _slope(coefficients, theta):
    """Derivative by θ of the dense output of a row."""
    value, slope, u = coefficients[7], 0.0, 1.0 - theta
    for i in range(7, 0, -1):
        factor, change = (theta, 1.0) if i % 2 == 1 else (u, -1.0)
        slope = slope * factor + value * change
        value = coefficients[i - 1] + factor * value
    return slope


@inner
def point_at(problem, s, t, h, theta, coefficients, point):
    """Write the motion of an element with friction at θ of a step of duration h from t, see `compiled.sliding`."""
    radius, slider, turned, turning, turning_rate = radius_of(problem, s), slider_of(problem, s), 0.0, 0.0, 0.0
    u, u_dot = polynomial(coefficients[0], theta), polynomial(coefficients[1], theta)
    w, w_dot = polynomial(coefficients[2], theta), polynomial(coefficients[3], theta)
    u_twice, w_twice = _slope(coefficients[1], theta) / h, _slope(coefficients[3], theta) / h
    if problem.first[s] + 2 < problem.first[s + 1]:
        turned, turning = -polynomial(coefficients[4], theta), -polynomial(coefficients[5], theta)
        turning_rate = -_slope(coefficients[5], theta) / h
    point[DELTA], point[RATE], point[ACCELERATION] = u, u_dot, u_twice
    if radius != 0.0:
        square, product, speed = u * u + w * w, u * u_dot + w * w_dot, u_dot * u_dot + w_dot * w_dot
        point[DELTA], point[RATE] = radial(square, product, speed, radius)
        along = speed + u * u_twice + w * w_twice
        twice = (along - product * product / square) / math.sqrt(square)
        point[ACCELERATION] = twice if radius > 0.0 else -twice
    point[XI], point[XI_RATE] = xi_and_rate_of(radius, slider, t + theta * h, u, u_dot, w, w_dot, turned, turning)
    point[XI_ACCELERATION] = xi_acceleration_of(radius, slider, u, u_dot, u_twice, w, w_dot, w_twice, turning_rate)


@inner
def _radial_at(coefficients, radius, theta):
    """δ and δ̇ of a circle at θ."""
    u, u_dot = polynomial(coefficients[0], theta), polynomial(coefficients[1], theta)
    w, w_dot = polynomial(coefficients[2], theta), polynomial(coefficients[3], theta)
    return radial(u * u + w * w, u * u_dot + w * w_dot, u_dot * u_dot + w_dot * w_dot, radius)


@inlined
def delta_at(coefficients, radius, theta):
    """Indentation at θ."""
    return polynomial(coefficients[0], theta) if radius == 0.0 else _radial_at(coefficients, radius, theta)[0]


@inlined
def rate_at(coefficients, radius, theta):
    """Indentation rate at θ."""
    return polynomial(coefficients[1], theta) if radius == 0.0 else _radial_at(coefficients, radius, theta)[1]


@inner
def _coefficients_of(row, offset, x, dense, out):
    """Write the coefficients of ``row·z - offset``."""
    size = row.size
    out[0] = dot(row, x, size) - offset
    for i in range(7):
        out[1 + i] = dot(row, dense[i], size)


@merged  # as a call would hand over the address of ``value``, with which numba keeps no caller's machine code
def golden_section(value, known, a, b):
    """(θ, value) of the largest ``value(known, θ)`` on [a, b], for one maximum."""
    best = -np.inf
    for _ in range(40):
        c, d = b - _GOLDEN * (b - a), a + _GOLDEN * (b - a)
        at_c, at_d = value(known, c), value(known, d)
        if at_c > at_d:
            b = d
        else:
            a = c
        best = max(best, at_c, at_d)
    return 0.5 * (a + b), best


@inner
def _falling(known, theta):
    """Rate at which sign·δ falls at θ."""
    coefficients, radius, sign = known
    return -sign * rate_at(coefficients, radius, theta)


@merged
def bisection(value, known, a, b):
    """θ at which ``value(known, θ)`` becomes positive in [a, b]."""
    for _ in range(50):
        middle = 0.5 * (a + b)
        if value(known, middle) > 0.0:
            b = middle
        else:
            a = middle
    return b


@inner
def _beyond(known, theta):
    """sign·(δ - level) at θ."""
    coefficients, radius, level, sign = known
    return sign * (delta_at(coefficients, radius, theta) - level)


@inner
def crossing(coefficients, radius, level, sign, tolerance):
    """First θ at which sign·(δ - level) becomes positive; NONE, or UNRESOLVED when it does so at once.

    Between two nodes δ may rise and fall again. That shows in the sign of its rate, whose zero is at the maximum; the
    values at the nodes would show a passage through the middle of a hole only within 4e-9 of their distance.
    """
    if abs(level) == np.inf:
        return NONE
    last = sign * (delta_at(coefficients, radius, 0.0) - level)
    tolerance = max(tolerance, 2.0 * last)  # a start a little outside, after a graze, is no crossing yet
    rising = sign * rate_at(coefficients, radius, 0.0) > 0.0
    for i in range(1, _NODES.size):
        value = sign * (delta_at(coefficients, radius, _NODES[i]) - level)
        if value > tolerance:
            if i == 1 and last >= -tolerance:
                return UNRESOLVED
            return bisection(_beyond, (coefficients, radius, level, sign), _NODES[i - 1], _NODES[i])
        rises = sign * rate_at(coefficients, radius, _NODES[i]) > 0.0
        if rising and not rises:
            top = bisection(_falling, (coefficients, radius, sign), _NODES[i - 1], _NODES[i])
            if sign * (delta_at(coefficients, radius, top) - level) > tolerance:
                return bisection(_beyond, (coefficients, radius, level, sign), _NODES[i - 1], top)
        last, rising = value, rises
    return NONE


@kernel
def nearer(h, distance, rate, before, beyond, longest):
    """Duration to try next after h ended ``distance`` beyond a level, at ``rate``; -1 if there may be no landing.

    It is that of Newton's method, or by bisection where that leaves (before, beyond). ``beyond`` is a duration that
    ends beyond the level, or ``longest`` if none is known.
    """
    guess = h - distance / rate
    if before < guess < beyond:
        return guess
    middle = 0.5 * (before + beyond)
    return middle if beyond < longest and before < middle < beyond else -1.0


@kernel
def first_crossing(problem, state, space):
    """(θ, stop, direction ±1, level) of the first border of a segment that the step crosses; θ as of `crossing`."""
    theta, stop, direction, level = NONE, -1, 0, 0.0
    for s in range(problem.law.size):
        motion_of(problem, s, state.x, space.dense, space.coefficients)
        tolerance, radius = surface_tolerance(problem, s, state.x), radius_of(problem, s)
        above = state.segment[s]
        for border in range(above, max(above - 2, -1), -1):  # the one above, and the one below if there is any
            way, knot = 1 if border == above else -1, problem.knots[s, border]
            found = crossing(space.coefficients, radius, knot, float(way), tolerance)
            if found < theta:
                theta, stop, direction, level = found, s, way, knot
    return theta, stop, direction, level


@inner
def entry_by_sign(problem, x, x_new, segment):
    """(θ, stop) of the stop that is inside at the end of a step but was not at its start; the paper's test."""
    theta, stop = NONE, -1
    for s in range(problem.law.size):
        if segment[s] == 0:
            after = indentation(problem, s, x_new)
            if after > 0.0:
                before = indentation(problem, s, x)
                found = before / (before - after)
                if found < theta:
                    theta, stop = found, s
    return theta, stop
