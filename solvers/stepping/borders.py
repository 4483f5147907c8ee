"""Borders of laws with memory in a step: located on its dense output, or crossed and renewed at its end.

Under error control no step crosses a border: `border_ahead` finds the first one on the dense output, the step is
repeated to end there, and `renew_together` renews all borders reached. A margin that is zero at the start of a step, as
after a renewal, is judged by its sign as soon as that is more than rounding. Methods of constant step do cross:
`renew_crossed` renews at the end of a step the borders it has crossed, until no margin is below zero (a return map).
"""

from __future__ import annotations

import math

import numpy as np

from solvers.compiled.kernels import (
    acceleration_of,
    copy,
    indentation_and_rate,
    inner,
    kernel,
    rubs,
    slider_of,
    surface_tolerance,
)
from solvers.compiled.renewals import margins, renew
from solvers.compiled.sliding import (
    ACCELERATION,
    DELTA,
    POINT,
    RATE,
    XI,
    XI_RATE,
    move_point,
    point_of,
    slider_margins,
    xi_tolerances,
)
from solvers.compiled.state import LAST_EVENT, T, count_event, rate_tolerance
from solvers.problem.friction import CODE, STICK
from solvers.stepping.events import NONE, bisection, golden_section, motion_of, point_at, polynomial

_MISSED = 1e-3  # the most, in units of its largest, by which a margin may be negative after a landing on its border
# θ at which margins are evaluated, closer near 0: a border may be crossed just after the start
_NODES = np.array([0.0, *(2.0**i for i in (-20, -15, -11, -8, -7, -6, -5, -4, -3, -2)), *(np.arange(3, 9) / 8.0)])
NODES = _NODES.size
_TOGETHER = 1e-12  # margin, relative to its value at the start, at which a border counts as reached along with another
_SHORTLY = 1e-3  # part of a step before its end at which margins are extrapolated
_ROUNDED = np.array([DELTA, RATE, XI, XI_RATE])  # numbers of a point that rounding moves
_RATE_STEP = 1e-4  # part of a step over which the rate of a margin is differenced


@inner
def _point_in(problem, s, t, x, rate, point):
    """Write the point of an element in a state x with the rate x', see `sliding`; without friction δ, δ̇ and δ̈ alone."""
    if rubs(problem, s):
        point_of(problem, s, t, x, rate, point)
    else:
        point[DELTA], point[RATE] = indentation_and_rate(problem, s, x)
        point[ACCELERATION] = acceleration_of(problem, s, x, rate)


@inner
def _margins_of(problem, state, s, point, out):
    """Margins of element s at a point."""
    if rubs(problem, s):
        slider_margins(problem, s, state.segment[s], state.entry_rate[s], point, out)
    else:
        margins(problem, state, s, 1, point[DELTA : DELTA + 1], point[RATE : RATE + 1], out)


@inner
def _margins_now(problem, state, space, s, t, x, rate_of_x):
    """Margins of element s in the state x, into ``space.present``, and their rounding; returns δ and δ̇.

    Its point is left in ``space.point``. Without friction δ is moved there by its rounding in the direction of the
    motion: before its first motion a law may depend on the sign of δ.
    """
    point, moved, scale, count = space.point[0], space.point[1], space.scale[s], problem.border_count[s]
    _point_in(problem, s, t, x, rate_of_x, point)
    delta, direction, moves = point[DELTA], 1.0, 4 if rubs(problem, s) else 2
    scale[0] = max(scale[0], 4.0 * surface_tolerance(problem, s, x))
    scale[1] = max(scale[1], rate_tolerance(problem, s, x))
    if rubs(problem, s):
        xi, xi_rate = xi_tolerances(problem, s, t, x)
        scale[2], scale[3] = max(scale[2], 4.0 * xi), max(scale[3], xi_rate)
    else:
        direction = math.copysign(1.0, point[RATE])
        point[DELTA] += direction * scale[0]
    _margins_of(problem, state, s, point, space.present[s])
    for j in range(count):
        space.rounding[s, j] = 1e-15 * abs(space.present[s, j])
    for i in range(moves):
        copy(point, moved, POINT)
        moved[_ROUNDED[i]] += direction * scale[i] * (2.0 if moves == 2 and i == 0 else 1.0)
        _margins_of(problem, state, s, moved, space.one)
        for j in range(count):
            space.rounding[s, j] += abs(space.one[j] - space.present[s, j])
    return delta, point[RATE]


@inner
def _margins_on_step(problem, state, space, h, s):
    """Margins of element s at the nodes of the step of duration h just tried, into ``space.margin``."""
    motion_of(problem, s, state.x, space.dense, space.coefficients)
    for i in range(_NODES.size):
        _point_on_step(problem, state, space, h, s, _NODES[i])
        space.points[0, i], space.points[1, i] = space.point[1, DELTA], space.point[1, RATE]
        if rubs(problem, s):
            _margins_of(problem, state, s, space.point[1], space.one)
            for j in range(problem.border_count[s]):
                space.margin[_NODES.size * j + i] = space.one[j]
    if not rubs(problem, s):  # all at once, which is quicker
        margins(problem, state, s, _NODES.size, space.points[0], space.points[1], space.margin)


@inner
def _point_on_step(problem, state, space, h, s, theta):
    """Write the point of element s at θ of the step, as `_point_in` does, to ``space.point[1]``."""
    point, coefficients = space.point[1], space.coefficients
    if rubs(problem, s):
        point_at(problem, s, state.now[T], h, theta, coefficients, point)
    else:
        point[DELTA], point[RATE] = polynomial(coefficients[0], theta), polynomial(coefficients[1], theta)


@inner
def _margins_later(problem, state, space, s, time):
    """Margins of element s a time after its point, before it if negative, by extrapolation, into ``space.one``."""
    move_point(space.point[0], time, space.point[1])
    _margins_of(problem, state, s, space.point[1], space.one)


@inner
def _margin_at(known, theta):
    """A margin at θ of the step."""
    problem, state, space, h, s, j = known
    _point_on_step(problem, state, space, h, s, theta)
    _margins_of(problem, state, s, space.point[1], space.one)
    return space.one[j]


@inner
def _minus_margin(known, theta):
    """Minus a margin at θ of the step."""
    return -_margin_at(known, theta)


@inner
def _zero_between(known, a, b):
    """θ at which a margin falls below zero in [a, b]."""
    return bisection(_minus_margin, known, a, b)


@inner
def _extrapolated(known, time):
    """A margin at a time after the start of the step, before it if negative, extrapolated from there."""
    problem, state, space, _, s, j = known
    _point_in(problem, s, state.now[T], state.x, state.rate, space.point[0])
    _margins_later(problem, state, space, s, time)
    return space.one[j]


@inner
def _falls_from_zero(known, theta):
    """θ at which a margin that begins at zero, and is negative at ``theta``, falls below zero: 0, or later.

    A stick that begins just before a contact opens is over before the first node that would show it; if all of it is
    rounding it lasts to θ, since its margin has no slope where slip has ended. A slider at its limit may move back by
    less than rounding. Whether such a margin rises, and where it returns to zero, at most at θ, follows from the
    parabola through it at the start, a step before and a step after by extrapolation.
    """
    problem, state, space, _, s, j = known
    place, highest_margin = golden_section(_margin_at, known, 0.0, theta)
    if highest_margin > space.rounding[s, j]:
        return _zero_between(known, place, theta)
    if rubs(problem, s) and slider_of(problem, s)[CODE] == STICK and state.now[T] == state.now[LAST_EVENT]:
        return theta
    now, after, before = _extrapolated(known, 0.0), _extrapolated(known, known[3]), _extrapolated(known, -known[3])
    rise, fall = after - before, 2.0 * now - after - before
    if rise <= 0.0:
        return 0.0
    return min(rise / fall, theta) if fall > 0.0 else theta


@inner
def _lowest_around(known, values, i, rounding):
    """θ of the lowest margin around node i if it is negative, else NONE; node i must not be above its neighbours."""
    before, after = values[i - 1], values[min(i + 1, _NODES.size - 1)]
    if values[i] > before or values[i] > after or values[i] > 2.0 * (max(before, after) - values[i]):
        return NONE
    place, below = golden_section(_minus_margin, known, _NODES[i - 1], _NODES[min(i + 1, _NODES.size - 1)])
    return place if below > rounding else NONE


@inner
def _crossing_theta(problem, state, space, h, s, j):
    """First θ at which a margin of the element just evaluated falls below zero, or NONE; 0 where it does so at once.

    If the last landing has missed a border by more than rounding, its margin begins slightly negative and rises.
    """
    known, n = (problem, state, space, h, s, j), _NODES.size
    values, rounding = space.margin[n * j : n * j + n], space.rounding[s, j]
    inside, largest = values[0] > rounding, 0.0
    for value in values:
        largest = max(largest, abs(value))
    overshot = state.now[T] == state.now[LAST_EVENT] and state.now[T] > 0.0 and values[0] > -_MISSED * largest
    if rubs(problem, s) and values[0] < -max(rounding, _MISSED * largest):  # N has jumped down on a knot
        return 0.0
    for i in range(1, n):
        if values[i] < -rounding and not (overshot and values[i] > values[i - 1]):
            return _zero_between(known, _NODES[i - 1], _NODES[i]) if inside else _falls_from_zero(known, _NODES[i])
        lowest = _lowest_around(known, values, i, rounding)
        if lowest < NONE:
            return _zero_between(known, _NODES[i - 1], lowest) if inside else _falls_from_zero(known, lowest)
        inside |= values[i] > rounding
    return NONE


@inner
def _has_no_borders(problem, state, s):
    """Whether an element has no borders now: none at all, or those of friction while its contact is open."""
    return problem.border_count[s] == 0 or (rubs(problem, s) and state.segment[s] == 0)


@kernel
def border_ahead(problem, state, space, h):
    """(θ, element, border) of the first border that the step of duration h just tried crosses; θ = NONE without one."""
    theta, element, border = NONE, -1, -1
    for s in range(problem.law.size):
        if _has_no_borders(problem, state, s):
            continue
        _margins_now(problem, state, space, s, state.now[T], state.x, state.rate)
        _margins_on_step(problem, state, space, h, s)
        for j in range(problem.border_count[s]):
            found = _crossing_theta(problem, state, space, h, s, j)
            space.at_start[s, j] = space.present[s, j]
            if found < theta:
                theta, element, border = found, s, j
    return theta, element, border


@inner
def border_distance(problem, state, space, h, s, j):
    """(minus a margin, its rate, its rounding) at the end of the step of duration h just tried."""
    _margins_now(problem, state, space, s, state.now[T] + h, space.x_new, space.rate_new)
    _margins_later(problem, state, space, s, _RATE_STEP * h)
    present = space.present[s, j]
    return -present, (present - space.one[j]) / (_RATE_STEP * h), space.rounding[s, j]


@inner
def renew_border(problem, state, space, s, j):
    """Renew one border in the present state."""
    delta, rate = indentation_and_rate(problem, s, state.x)
    renew(problem, state, s, j, delta, rate)
    count_event(state)


@kernel
def renew_together(problem, state, space, h, element, border):
    """Renew the border landed on by a step of duration h, and all others whose margins have fallen to zero with it.

    Reached are those whose margins were positive at the start of the step, or shortly before its end, and are zero now.
    This is judged before any is renewed. After each renewal the margins of the same law are evaluated again: another
    border of its old segment may not exist in the new one.
    """
    for s in range(problem.law.size):
        if _has_no_borders(problem, state, s):
            continue
        delta, rate = _margins_now(problem, state, space, s, state.now[T], state.x, state.rate)
        _margins_later(problem, state, space, s, -_SHORTLY * h)
        limit = space.at_start[s]
        for j in range(problem.border_count[s]):
            before, rounding, present = max(limit[j], space.one[j]), space.rounding[s, j], space.present[s, j]
            reached = before > rounding and present <= max(8.0 * rounding, _TOGETHER * before)
            limit[j] = max(8.0 * rounding, present) if reached or (s == element and j == border) else -np.inf
        for j in range(problem.border_count[s]):
            if space.present[s, j] <= limit[j]:
                renew(problem, state, s, j, delta, rate)
                if not rubs(problem, s):
                    _margins_now(problem, state, space, s, state.now[T], state.x, state.rate)
    count_event(state)


@inner
def renew_crossed(problem, state, space):
    """Renew every border whose margin is negative in the present state; returns whether there was any.

    After each renewal the margins are evaluated again: another border of the old segment may not exist in the new one.
    """
    found = False
    for s in range(problem.law.size):
        if problem.border_count[s] == 0 or rubs(problem, s):  # friction needs a method that locates
            continue
        delta, rate = _margins_now(problem, state, space, s, state.now[T], state.x, state.rate)
        for j in range(problem.border_count[s]):
            if space.present[s, j] < -space.rounding[s, j]:
                renew(problem, state, s, j, delta, rate)
                _margins_now(problem, state, space, s, state.now[T], state.x, state.rate)
                found = True
    if found:
        count_event(state)
    return found
