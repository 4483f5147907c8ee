"""Borders of laws with memory in a step: located on its dense output, or passed and made good at its end.

Under error control no step goes across a border: `border_ahead` finds the first one on the dense output, the step is
repeated to end there, and `renew_together` renews all borders reached. A margin that is zero at the start of a step, as
after a renewal, is judged by its sign as soon as that is more than rounding. Methods of constant step go across:
`renew_passed` renews at the end of a step what it has passed, until no margin is below zero (a return map).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from solvers.compiled.kernels import (
    acceleration_of,
    copy,
    dot,
    indentation_and_rate,
    inner,
    kernel,
    rubs,
    slider_of,
)
from solvers.compiled.renewals import count_event, margins, margins_before, margins_in, renew
from solvers.compiled.sliding import (
    POINT,
    XI,
    XI_RATE,
    move_point,
    point_of,
    slider_margins,
    xi_tolerances,
)
from solvers.compiled.state import LAST_EVENT, T, most_borders, rate_tolerance, surface_tolerance
from solvers.problem.friction import CODE
from solvers.stepping.events import NONE, bisection, golden_section, motion_of, point_at, polynomial

_MISSED = 1e-3  # margin, in units of the largest of the step, by which a landing may have missed its border
_NODES = np.array([0.0, *(2.0**i for i in (-20, -15, -11, -8, -7, -6, -5, -4, -3, -2)), *(np.arange(3, 9) / 8.0)])
_TOGETHER = 1e-12  # part of its way at which a border counts as reached when another is landed on
_BEFORE = 1e-3  # part of a landing step before its end
_AHEAD = 1e-4  # part of a step over which the rate of a margin is differenced


def border_space(problem: Any) -> list[Any]:
    """Working arrays: those of the borders among the fields of `loop.Space`, in order."""
    stops, most, n = problem.law.size, most_borders(problem), _NODES.size
    first = [np.empty(n * most), np.empty((2, n)), np.empty(2), np.empty(most), np.zeros((stops, 4))]
    return [*first, *(np.zeros((stops, most)) for _ in range(3)), np.empty((2, POINT))]


@inner
def _present_of_slider(problem, state, space, s, t, x, rate):
    """The same of friction, from the state with its rate, at which it is."""
    point, moved, scale = space.point[0], space.point[1], space.scale[s]
    point_of(problem, s, t, x, rate, point)
    scale[0] = max(scale[0], 4.0 * surface_tolerance(problem, s, x))
    scale[1] = max(scale[1], rate_tolerance(problem, s, x))
    xi, xi_rate = xi_tolerances(problem, s, t, x)
    scale[2], scale[3] = max(scale[2], 4.0 * xi), max(scale[3], xi_rate)
    segment, entry, present, count = state.segment[s], state.entry_rate[s], space.present[s], problem.border_count[s]
    slider_margins(problem, s, segment, entry, point, present)
    for j in range(count):
        space.rounding[s, j] = 1e-15 * abs(present[j])
    for i in range(4):
        copy(point, moved, POINT)
        moved[i if i < 2 else XI if i == 2 else XI_RATE] += scale[i]
        slider_margins(problem, s, segment, entry, moved, space.one)
        for j in range(count):
            space.rounding[s, j] += abs(space.one[j] - present[j])


@inner
def _present(problem, state, space, s, t, x, rate_of_x):
    """Margins of element s a rounding ahead of a state, and what rounding may make of them; returns δ and δ̇.

    Ahead is where the motion goes: a law that has not moved yet may look at the sign of δ.
    """
    if rubs(problem, s):
        _present_of_slider(problem, state, space, s, t, x, rate_of_x)
        return space.point[0, 0], space.point[0, 1]
    delta, rate = indentation_and_rate(problem, s, x)
    scale, count = space.scale[s], problem.border_count[s]
    scale[0] = max(scale[0], 4.0 * surface_tolerance(problem, s, x))
    scale[1] = max(scale[1], rate_tolerance(problem, s, x))
    ahead = math.copysign(1.0, rate)
    for i in range(3):  # ahead, with δ moved by twice as much, with δ̇ moved
        space.trial[0] = delta + ahead * scale[0] * (3.0 if i == 1 else 1.0)
        space.trial[1] = rate + ahead * scale[1] * (1.0 if i == 2 else 0.0)
        margins(problem, state, s, 1, space.trial[0:1], space.trial[1:2], space.margin)
        for j in range(count):
            if i == 0:
                space.present[s, j], space.rounding[s, j] = space.margin[j], 1e-15 * abs(space.margin[j])
            space.rounding[s, j] += abs(space.margin[j] - space.present[s, j])
    return delta, rate


@inner
def _watch(problem, state, space, h, s):
    """Margins of element s at the nodes of the step of duration h just tried."""
    motion_of(problem, s, state.x, space.dense, space.coefficients)
    if rubs(problem, s):
        for i in range(_NODES.size):
            _slider_margins_at(problem, state, space, h, s, _NODES[i])
            for j in range(problem.border_count[s]):
                space.margin[_NODES.size * j + i] = space.one[j]
        return
    for i in range(_NODES.size):
        space.points[0, i] = polynomial(space.coefficients[0], _NODES[i])
        space.points[1, i] = polynomial(space.coefficients[1], _NODES[i])
    margins(problem, state, s, _NODES.size, space.points[0], space.points[1], space.margin)


@inner
def _slider_margins_at(problem, state, space, h, s, theta):
    """Margins of friction at θ of the step, into ``space.one``."""
    point_at(problem, s, state.now[T], h, theta, space.coefficients, space.point[1])
    slider_margins(problem, s, state.segment[s], state.entry_rate[s], space.point[1], space.one)


@inner
def _beyond(known, theta):
    """Minus a margin of a law at θ of the step."""
    problem, state, space, _, s, j = known
    space.trial[0], space.trial[1] = polynomial(space.coefficients[0], theta), polynomial(space.coefficients[1], theta)
    margins(problem, state, s, 1, space.trial[0:1], space.trial[1:2], space.one)
    return -space.one[j]


@inner
def _slider_beyond(known, theta):
    """Minus a margin of friction at θ of the step."""
    problem, state, space, h, s, j = known
    _slider_margins_at(problem, state, space, h, s, theta)
    return -space.one[j]


@inner
def _inside(known, theta):
    """A margin of a law at θ of the step."""
    return -_beyond(known, theta)


@inner
def _slider_inside(known, theta):
    """A margin of friction at θ of the step."""
    return -_slider_beyond(known, theta)


@inner
def _highest_between(known, a, b):
    """Place of the highest margin on [a, b], and the highest one met."""
    if rubs(known[0], known[4]):
        return golden_section(_slider_inside, known, a, b)
    return golden_section(_inside, known, a, b)


@inner
def _lowest_between(known, a, b):
    """Place of the lowest margin on [a, b], and minus the lowest one met."""
    if rubs(known[0], known[4]):
        return golden_section(_slider_beyond, known, a, b)
    return golden_section(_beyond, known, a, b)


@inner
def _zero_between(known, a, b):
    """Where a margin falls below zero in [a, b]."""
    if rubs(known[0], known[4]):
        return bisection(_slider_beyond, known, a, b)
    return bisection(_beyond, known, a, b)


@inner
def _later(known, time):
    """A margin so long after the start of the step, or before it, by the rates there."""
    problem, state, space, _, s, j = known
    if rubs(problem, s):
        point_of(problem, s, state.now[T], state.x, state.rate, space.point[0])
        move_point(space.point[0], time, space.point[1])
        slider_margins(problem, s, state.segment[s], state.entry_rate[s], space.point[1], space.one)
    else:
        delta, rate = indentation_and_rate(problem, s, state.x)
        margins_before(problem, state, s, delta, rate, -time, space.trial, space.one)
    return space.one[j]


@inner
def _falls_from_zero(known, theta):
    """Where a margin that begins at zero, and is below it at θ, falls below it: at once, or, if it rises first, later.

    A stick that begins just before a contact opens is over before the first node that would tell of it; if all of it is
    rounding it lasts to θ, since its margin has no slope where slip has ended. A slider at its limit may move back by
    less than rounding. Whether such a margin rises, and where its parabola comes down, at most at θ, is told by the
    rates at the start, carried on for a step and back.
    """
    problem, state, space, _, s, j = known
    highest, above = _highest_between(known, 0.0, theta)
    if above > space.rounding[s, j]:
        return _zero_between(known, highest, theta)
    if rubs(problem, s) and slider_of(problem, s)[CODE] == 0.0 and state.now[T] == state.now[LAST_EVENT]:
        return theta
    now, after, before = _later(known, 0.0), _later(known, known[3]), _later(known, -known[3])
    rise, fall = after - before, 2.0 * now - after - before
    if rise <= 0.0:
        return 0.0
    return min(rise / fall, theta) if fall > 0.0 else theta


@inner
def _lowest(known, values, i, rounding):
    """Place of the lowest margin around node i if it is below zero, else NONE; node i is not above its neighbours."""
    before, after = values[i - 1], values[min(i + 1, _NODES.size - 1)]
    if values[i] > before or values[i] > after or values[i] > 2.0 * (max(before, after) - values[i]):
        return NONE
    place, beyond = _lowest_between(known, _NODES[i - 1], _NODES[min(i + 1, _NODES.size - 1)])
    return place if beyond > rounding else NONE


@inner
def _crossing(problem, state, space, h, s, j):
    """First θ at which a margin of the element watched falls below zero, or NONE; 0 where it does so at once.

    Where the last landing has missed a border by more than rounding, its margin is negative at first, but little, and
    rises.
    """
    known, n = (problem, state, space, h, s, j), _NODES.size
    values, rounding = space.margin[n * j : n * j + n], space.rounding[s, j]
    inside, largest = values[0] > rounding, 0.0
    for value in values:
        largest = max(largest, abs(value))
    missed = state.now[T] == state.now[LAST_EVENT] and state.now[T] > 0.0 and values[0] > -_MISSED * largest
    for i in range(1, n):
        if values[i] < -rounding and not (missed and values[i] > values[i - 1]):
            return _zero_between(known, _NODES[i - 1], _NODES[i]) if inside else _falls_from_zero(known, _NODES[i])
        lowest = _lowest(known, values, i, rounding)
        if lowest < NONE:
            return _zero_between(known, _NODES[i - 1], lowest) if inside else _falls_from_zero(known, lowest)
        inside |= values[i] > rounding
    return NONE


@inner
def _is_without(problem, state, s):
    """Whether an element has no borders by now: friction has none while the contact is open."""
    return problem.border_count[s] == 0 or (rubs(problem, s) and state.segment[s] == 0)


@kernel
def border_ahead(problem, state, space, h):
    """(θ, element, border) of the first border on the step of duration h just tried; θ = NONE without one."""
    theta, element, border = NONE, -1, -1
    for s in range(problem.law.size):
        if _is_without(problem, state, s):
            continue
        _present(problem, state, space, s, state.now[T], state.x, state.rate)
        _watch(problem, state, space, h, s)
        for j in range(problem.border_count[s]):
            found = _crossing(problem, state, space, h, s, j)
            space.at_start[s, j] = space.present[s, j]
            if found < theta:
                theta, element, border = found, s, j
    return theta, element, border


@inner
def border_apart(problem, state, space, h, s, j):
    """(distance beyond a border, its rate, its rounding) at the end of the step of duration h just tried."""
    delta, rate = _present(problem, state, space, s, state.now[T] + h, space.x_new, space.rate_new)
    time, present = _AHEAD * h, space.present[s, j]
    if rubs(problem, s):
        move_point(space.point[0], time, space.point[1])
        slider_margins(problem, s, state.segment[s], state.entry_rate[s], space.point[1], space.one)
        return -present, (present - space.one[j]) / time, space.rounding[s, j]
    space.trial[0] = delta + time * dot(problem.read[problem.first[s]], space.rate_new, 2 * problem.k.size)
    space.trial[1] = rate + time * acceleration_of(problem, s, space.x_new, space.rate_new)
    margins(problem, state, s, 1, space.trial[0:1], space.trial[1:2], space.one)
    return -present, (present - space.one[j]) / time, space.rounding[s, j]


@inner
def renew_border(problem, state, space, s, j):
    """Renew one border in the present state."""
    if rubs(problem, s):
        delta, rate = 0.0, 0.0  # it looks for itself
    else:
        delta, rate = margins_in(problem, state, s, state.x, space.trial, space.margin)
    renew(problem, state, s, j, delta, rate)
    count_event(state)


@kernel
def renew_together(problem, state, space, h, element, border):
    """Renew the border landed on by a step of duration h, and all whose margins have fallen to zero with it.

    Which ones is judged from the state alone, before any is renewed; of the same law the margins are read again after
    each: another border of the same segment may be none of the next one. One that began at zero, as after its own
    renewal, has risen and come back if its margin was above zero just before.
    """
    for s in range(problem.law.size):
        if _is_without(problem, state, s):
            continue
        delta, rate = _present(problem, state, space, s, state.now[T], state.x, state.rate)
        if rubs(problem, s):
            move_point(space.point[0], -_BEFORE * h, space.point[1])
            slider_margins(problem, s, state.segment[s], state.entry_rate[s], space.point[1], space.one)
        else:
            margins_before(problem, state, s, delta, rate, _BEFORE * h, space.trial, space.one)
        near = space.at_start[s]
        for j in range(problem.border_count[s]):
            before, rounding, present = max(near[j], space.one[j]), space.rounding[s, j], space.present[s, j]
            reached = before > rounding and present <= max(8.0 * rounding, _TOGETHER * before)
            near[j] = max(8.0 * rounding, present) if reached or (s == element and j == border) else -np.inf
        for j in range(problem.border_count[s]):
            if space.present[s, j] <= near[j]:
                renew(problem, state, s, j, delta, rate)
                if not rubs(problem, s):
                    _present(problem, state, space, s, state.now[T], state.x, state.rate)
    count_event(state)


@inner
def renew_passed(problem, state, space):
    """Renew every border whose margin is below zero in the present state; whether there was any.

    After each the margins are read again: another border of the same segment is none of the next one.
    """
    found = False
    for s in range(problem.law.size):
        if problem.border_count[s] == 0 or rubs(problem, s):  # friction is for methods that locate
            continue
        delta, rate = _present(problem, state, space, s, state.now[T], state.x, state.rate)
        for j in range(problem.border_count[s]):
            if space.present[s, j] < -space.rounding[s, j]:
                renew(problem, state, s, j, delta, rate)
                _present(problem, state, space, s, state.now[T], state.x, state.rate)
                found = True
    if found:
        count_event(state)
    return found
