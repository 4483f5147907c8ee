"""Borders of laws with memory and of friction: where a step ends, and what is latched there.

Such a law has margins b_j(δ, δ̇), its event functions: all are positive inside the present segment, and one falls to
zero on border j. No step crosses a border. A step tried that would is given up; a landing then ends on the border, see
`landing`. There all borders are renewed, that is, their numbers latched anew, whose margins have fallen to zero, also
those of other elements with the same motion.

A margin is known at both ends and the nodes of a step. Where it is small at a node, it is also evaluated at points
around this node. A step whose nodes do not resolve the fast blocks must keep away from zero by what these may add.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from solvers.compiled.kernels import (
    VECTOR,
    indentation_and_rate,
    inlined,
    inner,
    merged,
    rhs,
    row_of,
    rubs,
    slider_of,
    surface_tolerance,
)
from solvers.compiled.parts import BEHIND, PASSED, part
from solvers.compiled.renewals import margins, margins_after, margins_in, renew
from solvers.compiled.simd import load8
from solvers.compiled.sliding import DELTA, RATE
from solvers.compiled.state import AT_ONCE, LAST_EVENT, PEAK_FORCE, T, count_event, rate_tolerance
from solvers.exponential.circles.friction import TANGENTIAL
from solvers.exponential.contact.crossings import (
    ON_BORDER,
    REST,
    ROUNDING,
    UNRESOLVED,
    WATCHED_BELOW,
    extremum,
    time_of_place,
)
from solvers.exponential.contact.first_step import UNKNOWN
from solvers.exponential.contact.node_response import (
    BORDER,
    DELTAS,
    ELEMENT,
    KNOWN,
    RATES,
    SLOPE,
    START,
    WHEN,
    motion_of,
    rate_ripple_of,
    ripple_of,
    swing_of,
)
from solvers.exponential.contact.nodes import LOCAL, S
from solvers.exponential.contact.peaks import maximum_and_place, motion_around, polynomial
from solvers.exponential.contact.slider_margins import (
    BEGIN,
    DELTA_RIPPLED,
    DELTA_ROUNDED,
    END,
    ENDS,
    RATE_RIPPLED,
    RATE_ROUNDED,
    margin_rounding,
    slider_margins_around,
    slider_margins_at_nodes,
    slider_margins_in,
    slider_margins_on_step,
)
from solvers.problem.friction import CODE, FREE, PRESSES, STICK

_TOGETHER = 1e-9  # margin, relative to its value at the start, at which a border counts as reached along with another
_MISSED = 1e-5  # the most, in units of its largest, by which a margin may be negative after a landing on its border
_SHORTLY = 1e-3  # part of a step or landing over which a margin is extrapolated by the rates at its end
_JUST_AFTER = 1e-6  # part of the time to the first node from which on a fall at the start of a run is looked for
_FIRST_SHARE, _SHORTER, _MOST_SHARES = 0.1, 0.25, 20  # shares of the time to the first node: first, ratio, number
_UNDECIDED = 2  # events at one instant, after the first, from which on a stick is believed until a step denies it
_LONGER = 8.0  # factor of the time of extrapolation until it is clear whether a margin rises
_ROOT_FOUND = 1e-6  # value of the polynomial, in units of the largest margin, that ends the search for its root
_ROOT_EXPECTED = 1e-4  # the same beyond the end of the step, where the polynomial is no better
_SLOPE_STEP = 1e-5  # relative step in σ for the slope of this polynomial at its root
_MOST_ILLINOIS = 6  # iterations for a root of the polynomial through the nodes
_INTERPOLATED = 4.0  # rounding of a margin at points around a node, in units of that at the nodes
_LOWEST = DELTA_ROUNDED  # its place in `Scratch.ends` is later that of the lowest margin at the end or between nodes
_CHECKED_BELOW = 0.5  # margin at an end of a landing, in units of its largest, below which minima inside are looked for
_CLEAR = 0.03  # estimate of such a minimum, in the same units, that counts as positive


@inner
def margins_of(run, s, t, x, out):
    """Write the margins of element s in the state x at time t into ``out``; returns δ and δ̇."""
    scratch = run.scratch
    if rubs(run.problem, s):
        slider_margins_in(run, s, t, x, 0.0, out)
        return scratch.point[0, DELTA], scratch.point[0, RATE]
    return margins_in(run.problem, run.state, s, x, scratch.trial, out)


@inner
def margins_later(run, s, t, x, time, out):
    """The same at the time t + ``time``, to which the motion is extrapolated by its rate and acceleration in x."""
    problem, state = run.problem, run.state
    if rubs(problem, s):
        slider_margins_in(run, s, t, x, time, out)
        return
    rhs(problem, t, x, state.segment, state.entry_rate, state.rate, run.scratch.trial)
    delta, rate = indentation_and_rate(problem, s, x)
    margins_after(problem, state, s, delta, rate, time, run.scratch.trial, out)


@inlined
def _has_no_borders(run, s):
    """Whether an element has no borders now: none at all, or those of friction while its contact is open."""
    return run.problem.border_count[s] == 0 or (rubs(run.problem, s) and run.state.segment[s] == 0)


@inlined
def _margins_at_nodes(run, s, node_set, h):
    """Margins at the nodes of the step just tried, into ``scratch.margin``."""
    if rubs(run.problem, s):
        slider_margins_at_nodes(run, s, node_set, h)
        return
    motion = motion_of(run, s)
    margins(run.problem, run.state, s, S, motion[0], motion[1], run.scratch.margin)


@inner
def _margins_on_step(run, s, node_set, level):
    """Margins at both ends and at the nodes of the step just tried, their largest values and their rounding.

    The start is moved by the rounding of δ in the direction of the motion: before its first motion a law may depend on
    the sign of δ. The margins there are evaluated again with the rounding of δ and of δ̇, and with the ripple of fast
    blocks in δ and in δ̇.
    """
    problem, tables, state, scratch = run.problem, run.tables, run.state, run.scratch
    if rubs(problem, s):
        slider_margins_on_step(run, s, node_set, level)
        return
    delta, rate = scratch.start_motion[s, 0], scratch.start_motion[s, 1]
    row, alias = row_of(problem, s), tables.alias[tables.kind[node_set], level]
    deltas, rates = scratch.local_motion[KNOWN, :ENDS], scratch.local_motion[KNOWN, ENDS : 2 * ENDS]
    direction, rounding = math.copysign(1.0, rate), surface_tolerance(problem, s, state.x)
    for i in range(ENDS):
        deltas[i], rates[i] = delta + direction * rounding, rate
    deltas[END], rates[END] = indentation_and_rate(problem, s, scratch.x_new)
    deltas[DELTA_ROUNDED] += direction * rounding
    rates[RATE_ROUNDED] += direction * max(rate_tolerance(problem, s, state.x), REST * scratch.reference_speed[s])
    deltas[DELTA_RIPPLED] += direction * ripple_of(run, swing_of(run), row, alias)
    rates[RATE_RIPPLED] += direction * rate_ripple_of(run, swing_of(run), row, alias)
    margins(problem, state, s, ENDS, deltas, rates, scratch.ends)
    _margins_at_nodes(run, s, node_set, tables.contact_step[level])
    for j in range(problem.border_count[s]):
        ends = scratch.ends[ENDS * j : ENDS * (j + 1)]
        largest = max(abs(ends[BEGIN]), abs(ends[END]))
        for i in range(S):
            largest = max(largest, abs(scratch.margin[S * j + i]))
        scratch.largest[s, j] = largest
        rounding = abs(ends[DELTA_ROUNDED] - ends[BEGIN]) + abs(ends[RATE_ROUNDED] - ends[BEGIN])
        scratch.noise[s, j] = max(ROUNDING * largest, 2.0 * rounding)


@merged
def _extrapolated(run, s, j, time):
    """Margin j of element s a ``time`` after the start of the step, extrapolated from there."""
    margins_later(run, s, run.state.now[T], run.state.x, time, run.scratch.fired)
    return run.scratch.fired[j]


@inlined
def _rise_at_start(run, s, j, time):
    """Rise of a margin at the start of the step, by central differences over longer and longer times; or its noise."""
    noise, rise = run.scratch.noise[s, j], 0.0
    while abs(rise) <= noise and time < run.tables.contact_step[0]:
        rise = _extrapolated(run, s, j, time) - _extrapolated(run, s, j, -time)
        time *= _LONGER
    return rise


@inlined
def _falls_at_once(run, s, j, time):
    """Whether a margin that begins at zero and is negative after ``time`` has not been positive in between.

    It is extrapolated over shorter and shorter times until it cannot be told from zero: a slider with a strong dashpot
    slips one way, sticks, and slips the other way within a small part of a step. One that first rises by less than its
    noise, as where a slider at its limit still moves back a little, has not fallen at once.
    """
    noise, share = run.scratch.noise[s, j], _FIRST_SHARE
    for _ in range(_MOST_SHARES):
        value = _extrapolated(run, s, j, share * time)
        if value > noise:
            return False
        if value >= -noise:
            return _rise_at_start(run, s, j, time) <= 0.0
        share *= _SHORTER
    return True


@inlined
def _falls_as_run_begins(run, s, j, start, time):
    """Whether a margin that is zero as the run begins falls: before ``time``, the first node, it may be back.

    A slider that begins at its limit may slip on for a short time, and stick.
    """
    if run.state.now[T] > 0.0 or run.state.count[AT_ONCE] > 0 or abs(start) > run.scratch.noise[s, j]:
        return False
    return _rise_at_start(run, s, j, _JUST_AFTER * time) < -run.scratch.noise[s, j]


@inlined
def _before_first_node(run, s, j, start, time, h):
    """Time at which a margin, positive as the run begins, falls to zero before ``time``, the first node, or inf.

    A law that has not moved yet depends on the sign of δ, so that a motion out and back before the first node would
    leave no trace at the nodes. Both take equally long: a step shorter than the run so far has a node within the way
    back.
    """
    if run.state.now[T] > h or start <= run.scratch.noise[s, j]:
        return np.inf
    fall = start - _extrapolated(run, s, j, _SHORTLY * time)
    return _SHORTLY * time * start / fall if fall > _SHORTLY * start else np.inf


@inner
def _polynomial(run, j, node_set, sigma):
    """Value at σ of the polynomial through margin j at the nodes."""
    return polynomial(run.tables, node_set, load8(run.scratch.margin, S * j), sigma)


@inlined
def _root_before_node(run, s, j, node_set, h, i, linear):
    """(time, slope) where this polynomial falls to zero between node i - 1 and node i, or the end.

    Without a change of sign they are ``linear`` and 0. A landing that begins with both takes half as many trials.
    """
    scratch = run.scratch
    left = run.tables.nodes[node_set, i - 1] if i > 0 else 0.0
    right = run.tables.nodes[node_set, i] if i < S else 1.0
    above = scratch.margin[S * j + i - 1] if i > 0 else _polynomial(run, j, node_set, left)
    below = scratch.margin[S * j + i] if i < S else _polynomial(run, j, node_set, right)
    if not below < 0.0 < above:
        return linear, 0.0
    found = _ROOT_FOUND * scratch.largest[s, j]
    return _root_of_polynomial(run, j, node_set, h, (left, right, above, below), found)


@inner
def _root_of_polynomial(run, j, node_set, h, bracket, found):
    """(time, slope) of this polynomial's root by the Illinois rule; the value found is at most ``found``.

    ``bracket`` is two places σ, then the values there, positive and negative.
    """
    left, right, above, below = bracket
    middle, last, value = right, 0.0, below
    for _ in range(_MOST_ILLINOIS):
        middle = right - (right - left) * below / (below - above)
        value = _polynomial(run, j, node_set, middle)
        if abs(value) <= found:
            break
        if value > 0.0:
            left, above, below = middle, value, below * (0.5 if last > 0.0 else 1.0)
        else:
            right, below, above = middle, value, above * (0.5 if last < 0.0 else 1.0)
        last = value
    step, kappa = _SLOPE_STEP * middle, run.tables.time_exponent[node_set]
    slope = (_polynomial(run, j, node_set, middle + step) - value) / step
    return h * middle**kappa, slope / (h * kappa * middle ** (kappa - 1.0))


@inlined
def _expect(run, s, j, node_set, h):
    """Note when a margin will be zero within as long a step again, by its polynomial, if no other one is earlier.

    The parabola through the last two nodes and the end tells whether that is worth a closer look.
    """
    scratch = run.scratch
    nodes, margin, end = run.tables.nodes[node_set], scratch.margin[S * j : S * j + S], scratch.ends[ENDS * j + END]
    fall = (margin[S - 1] - end) / (1.0 - nodes[S - 1])
    before = (margin[S - 2] - margin[S - 1]) / (nodes[S - 1] - nodes[S - 2])
    last = 2.0 ** (1.0 / run.tables.time_exponent[node_set])
    bent = (fall - before) / (1.0 - nodes[S - 2]) * (last - nodes[S - 1])
    if end <= 0.0 or fall <= 0.0 or end > (fall + bent) * (last - 1.0):
        return
    below, above = _polynomial(run, j, node_set, last), _polynomial(run, j, node_set, 1.0)
    if not below < 0.0 < above:
        return
    found = _ROOT_EXPECTED * scratch.largest[s, j]
    time, slope = _root_of_polynomial(run, j, node_set, h, (1.0, last, above, below), found)
    if time < scratch.expected[WHEN]:
        scratch.expected[WHEN], scratch.expected[SLOPE] = time, slope
        scratch.expected_of[ELEMENT], scratch.expected_of[BORDER] = s, j


@inlined
def _has_kink(run, s):
    """Whether a margin of stick, μN - |F_t|, has a kink where F_t changes its sign on the step."""
    if not (rubs(run.problem, s) and slider_of(run.problem, s)[CODE] == STICK):
        return False
    forces = run.scratch.slid[s, TANGENTIAL]
    return forces[0] * forces[S - 1] < 0.0


@inlined
def _crossing_time(run, s, j, node_set, h):
    """(time after the start of the step, slope) where a margin falls below zero, by its values at the nodes and ends.

    The time is inf if it does not, the slope 0 if it is not known. The time is 0 if the margin is negative from the
    start on. A margin that begins at zero may have risen before the first node: then half the time to that node is
    returned, for a shorter step to decide. A landing may have missed its border by more than the rounding of this step:
    then the margin begins slightly below zero and rises, and only a later fall counts. Slip that begins against its own
    force, as dashpots can make it, has a strongly negative margin and ends at once. Where N falls to zero just after
    stick has begun, it rises by less than its noise: told to fall at once, the slider would stick and slip at one
    instant for ever.
    """
    problem, tables, state, scratch = run.problem, run.tables, run.state, run.scratch
    noise, before, t = scratch.noise[s, j], scratch.ends[ENDS * j + BEGIN], 0.0
    tolerance = max(ON_BORDER * scratch.largest[s, j], noise)
    overshot = state.now[T] == state.now[LAST_EVENT] and state.now[T] > 0.0 and scratch.margin[S * j] > before
    overshot &= before > -_MISSED * scratch.largest[s, j]
    if before < -tolerance and not overshot:
        return 0.0, 0.0
    begins_on = before <= tolerance
    if _falls_as_run_begins(run, s, j, before, h * tables.times[node_set, 0]):
        return 0.0, 0.0
    for i in range(S + 1):
        value = scratch.margin[S * j + i] if i < S else scratch.ends[ENDS * j + END]
        after = h * tables.times[node_set, i] if i < S else h
        if value < -noise and not (overshot and before < -noise and value > before):
            believed = state.count[AT_ONCE] >= _UNDECIDED and rubs(problem, s) and slider_of(problem, s)[CODE] == STICK
            at_once = i == 0 and before <= noise and not believed
            if at_once and _falls_at_once(run, s, j, after):
                return 0.0, 0.0
            if begins_on and i == 0:
                return 0.5 * after, 0.0
            share = max(before, 0.0) / (max(before, 0.0) - value)
            time, slope = _root_before_node(run, s, j, node_set, h, i, t + (after - t) * share)
            return time, slope if not _has_kink(run, s) else 0.0
        before, t = value, after
    first = h * tables.times[node_set, 0]
    return _before_first_node(run, s, j, scratch.ends[ENDS * j + BEGIN], first, h), 0.0


@inlined
def _has_minimum_within(a, b, c, first, second):
    """Whether the parabola through (0, a), (first, b), (second, c), with b > a, has its minimum between 0 and first."""
    rise, further = (b - a) / first, (c - b) / (second - first)
    return rise - (further - rise) * first / second < 0.0 < rise


@inner
def _crossing_between_nodes(run, s, j, node_set, h):
    """The same for a margin that is positive at all nodes, but negative near one of its minima between them.

    A minimum may be at an end of the step, as where that begins on the border; it counts if a parabola has its minimum
    before the next node.
    """
    scratch = run.scratch
    ends, values = scratch.ends[ENDS * j : ENDS * (j + 1)], scratch.margin[S * j : S * j + S]
    watched, t = WATCHED_BELOW * scratch.largest[s, j], run.tables.times[node_set]
    ends[_LOWEST] = ends[END]
    for i in range(S):
        before, after = values[i - 1] if i > 0 else ends[BEGIN], values[i + 1] if i < S - 1 else ends[END]
        low = values[i] <= min(before, after, watched)
        if i == 0:
            low |= before <= watched and _has_minimum_within(before, values[0], after, t[0], t[1])
        elif i == S - 1:
            low |= after <= watched and _has_minimum_within(after, values[i], before, 1.0 - t[i], 1.0 - t[i - 1])
        if low:
            time = _crossing_around(run, s, j, node_set, h, i)
            if time < np.inf:
                return time
    return np.inf


@inner
def _crossing_around(run, s, j, node_set, h, lowest):
    """The same in the interval around the node ``lowest`` of the step."""
    scratch = run.scratch
    if rubs(run.problem, s):
        slider_margins_around(run, s, node_set, h, lowest)
    else:
        motion_around(run, node_set, h, s, lowest)
        margins(run.problem, run.state, s, S, scratch.local_motion[DELTAS], scratch.local_motion[RATES], scratch.margin)
    below = scratch.trial
    for i in range(S):
        below[i] = -scratch.margin[S * j + i]
    deep, place = maximum_and_place(below, 1.0, scratch.clipped)
    _margins_at_nodes(run, s, node_set, h)
    scratch.ends[ENDS * j + _LOWEST] = min(scratch.ends[ENDS * j + _LOWEST], -deep)
    if deep <= _INTERPOLATED * scratch.noise[s, j]:
        return np.inf
    return time_of_place(run.tables, node_set, h, lowest, place if place > LOCAL[0] else LOCAL[1])


@inlined
def _may_be_hidden(scratch, s, j):
    """Whether fast blocks, which the nodes do not resolve, may make a margin negative at or between them."""
    ends = scratch.ends[ENDS * j : ENDS * (j + 1)]
    ripple = abs(ends[DELTA_RIPPLED] - ends[BEGIN]) + abs(ends[RATE_RIPPLED] - ends[BEGIN])
    lowest = ends[_LOWEST]
    for i in range(S):
        lowest = min(lowest, scratch.margin[S * j + i])
    return ripple > scratch.noise[s, j] and lowest < ripple


@inlined
def _may_be_expected(run, s, j):
    """Whether the zero of a margin beyond the step can be told by its polynomial.

    That of N or -N, which falls to zero at the opening anyway, is not asked for. Elements without friction are left
    out: where they slip, steps are so long that what follows them cannot be told.
    """
    if not rubs(run.problem, s) or j == PRESSES:
        return False
    return slider_of(run.problem, s)[CODE] != FREE and not _has_kink(run, s)


@inner
def border_ahead(run, node_set, level):
    """(time after the start, element, border, slope) of the first border that the step just tried crosses.

    (inf, -1, -1, 0) if there is none, (inf, `UNRESOLVED`, -1, 0) if the step is too long to tell. The slope is that of
    the margin by time, 0 if it is not known. ``scratch.expected`` gets the border that the step after this one may
    cross.
    """
    scratch = run.scratch
    scratch.expected[WHEN] = np.inf
    first, element, border, fall, h = np.inf, -1, -1, 0.0, run.tables.contact_step[level]
    for s in range(run.problem.law.size):
        count = run.problem.border_count[s]
        if _has_no_borders(run, s):
            continue
        _margins_on_step(run, s, node_set, level)
        for j in range(count):
            if scratch.largest[s, j] <= scratch.noise[s, j]:
                continue
            time, slope = _crossing_time(run, s, j, node_set, h)
            if time == np.inf:
                time = _crossing_between_nodes(run, s, j, node_set, h)
            if time == np.inf and _may_be_hidden(scratch, s, j):
                return np.inf, UNRESOLVED, -1, 0.0
            if time < first:
                first, element, border, fall = time, s, j, slope
            elif time == np.inf and _may_be_expected(run, s, j):
                _expect(run, s, j, node_set, h)
    return first, element, border, fall


@merged
def _may_dip(run, s, landed, w, x):
    """Whether a margin of element s, but the ``landed`` one, may have a minimum below zero between the states w and x.

    It is estimated by the cubic through both values and rates, which is coarse: a minimum near zero counts.
    """
    scratch = run.scratch
    count, width = run.problem.border_count[s], run.state.x.size
    d, begin, end = x[width] - w[width], scratch.margin_begin[s], scratch.margin_end[s]
    after, before = scratch.ends[:count], scratch.ends[count : 2 * count]
    margins_later(run, s, w[width], w, _SHORTLY * d, after)
    margins_later(run, s, x[width], x, -_SHORTLY * d, before)
    for j in range(count):
        fall, rise = (after[j] - begin[j]) / (_SHORTLY * d), (end[j] - before[j]) / (_SHORTLY * d)
        known = j != landed and scratch.largest[s, j] > scratch.noise[s, j]
        if known and fall < 0.0 < rise and extremum(d, begin[j], fall, end[j], rise) < _CLEAR * scratch.largest[s, j]:
            return True
    return False


@merged
def _estimate_rounding(run, s, t, x, begin, end):
    """Largest margins of an element and their rounding up to x at time t, where no step of its segment has told.

    N has the rounding of its peak, too: that it is zero may have been told by it in the segment before.
    """
    problem, scratch = run.problem, run.scratch
    count, deltas, rates = problem.border_count[s], scratch.local_motion[KNOWN, :3], scratch.local_motion[KNOWN, 3:6]
    if not rubs(problem, s):
        delta, rate = indentation_and_rate(problem, s, x)
        for i in range(3):
            deltas[i], rates[i] = delta, rate
        deltas[1] += surface_tolerance(problem, s, x)
        rates[2] += max(rate_tolerance(problem, s, x), REST * scratch.reference_speed[s])
        margins(problem, run.state, s, 3, deltas, rates, scratch.ends)
    for j in range(count):
        peak = 0.0
        if rubs(problem, s):
            rounding = margin_rounding(run, s, j, t, x)
            if j == PRESSES or slider_of(problem, s)[CODE] == FREE:
                peak = run.state.active[s, PEAK_FORCE]
        else:
            there = scratch.ends[3 * j : 3 * j + 3]
            rounding = abs(there[1] - there[0]) + abs(there[2] - there[0])
        scratch.largest[s, j] = max(abs(begin[j]), abs(end[j]))
        scratch.noise[s, j] = max(ROUNDING * max(scratch.largest[s, j], peak), 2.0 * rounding)


@part(BEHIND, types.UniTuple(types.int64, 2))
def border_behind(run):
    """(element, border) of a margin that is negative as the run begins, by more than its rounding, or (-1, -1).

    A spring may be drawn beyond its limit at the start. A step tells that, unless none is possible, as from a knot.
    """
    problem, state = run.problem, run.state
    for s in range(problem.law.size):
        margin, slips = run.scratch.margin_begin[s], rubs(problem, s) and slider_of(problem, s)[CODE] != STICK
        if slips or _has_no_borders(run, s):
            continue
        margins_of(run, s, state.now[T], state.x, margin)
        _estimate_rounding(run, s, state.now[T], state.x, margin, margin)
        for j in range(problem.border_count[s]):
            if margin[j] < -run.scratch.noise[s, j]:
                return s, j
        _forget_rounding(run, s)
    return -1, -1


@part(PASSED, types.UniTuple(types.int64, 2), types.int64, types.int64, VECTOR, VECTOR)
def passed(run, element, border, w, x):
    """(element, border) of the margin that is furthest below zero in x, relative to its value in w, or (-1, -1).

    Left out are the border that is landed on, and margins negative by rounding only. (`UNRESOLVED`, -1) is returned if
    a margin may have been negative in between, or is so in w: then its border is crossed before any step. The margins
    in w and x go to ``scratch.margin_begin`` and ``scratch.margin_end``; those of an ``element`` whose border is landed
    on are there already.
    """
    problem, state, scratch = run.problem, run.state, run.scratch
    worst, found, number, may_dip = -_TOGETHER, -1, -1, False
    for s in range(problem.law.size):
        count, size, begin, end = problem.border_count[s], state.x.size, scratch.margin_begin[s], scratch.margin_end[s]
        if _has_no_borders(run, s) or (s == element and count == 1):
            continue
        if s != element or border < 0:
            margins_of(run, s, w[size], w, begin)
            margins_of(run, s, x[size], x, end)
            if scratch.noise[s, 0] == UNKNOWN:
                _estimate_rounding(run, s, x[size], x, begin, end)
        close = False
        for j in range(count):
            if s == element and j == border:
                continue
            close |= min(begin[j], end[j]) < _CHECKED_BELOW * scratch.largest[s, j]
            may_dip |= begin[j] < -max(scratch.noise[s, j], _MISSED * scratch.largest[s, j])
            if end[j] >= -scratch.noise[s, j]:
                continue
            share = end[j] / max(begin[j], scratch.noise[s, j])
            if share < worst:
                worst, found, number = share, s, j
        may_dip |= close and _may_dip(run, s, border if s == element else -1, w, x)
    return (UNRESOLVED, -1) if may_dip and found < 0 else (found, number)


@inlined
def _update_rate(run, s):
    """Update ``state.rate`` where renewal needs it: slip from rest begins by ξ̈, and what was free by Ṅ."""
    problem, state = run.problem, run.state
    if rubs(problem, s) and abs(slider_of(problem, s)[CODE]) != 1.0:
        rhs(problem, state.now[T], state.x, state.segment, state.entry_rate, state.rate, run.scratch.trial)


@inlined
def _forget_rounding(run, s):
    """The margins of a segment that begins have another rounding, and perhaps another unit."""
    for j in range(run.problem.border_count[s]):
        run.scratch.noise[s, j] = UNKNOWN


@inner
def renew_border(run, element, border):
    """Latch in the present state what one border of an element asks for."""
    state = run.state
    delta, rate = indentation_and_rate(run.problem, element, state.x)
    _update_rate(run, element)
    renew(run.problem, state, element, border, delta, rate)
    _forget_rounding(run, element)
    count_event(state)


@inner
def renew_all(run, element, border):
    """Latch in the present state what the border landed on, and all borders reached together with it, ask for.

    Reached are those whose margins were positive at the start of the landing, or shortly before its end, and are zero
    now. This is judged by the state before anything is latched. After each renewal the margins of the same law are
    evaluated again: another border of its old segment may not exist in the new one.
    """
    problem, state, scratch = run.problem, run.state, run.scratch
    missed = 2.0 * abs(scratch.margin_end[element, border]) / scratch.largest[element, border]
    time, x = _SHORTLY * (state.now[T] - scratch.stages[START, state.x.size]), state.x
    for s in range(problem.law.size):
        count = problem.border_count[s]
        if _has_no_borders(run, s):
            continue
        delta, rate = indentation_and_rate(problem, s, x)
        _update_rate(run, s)
        if s == element and count == 1:
            renew(problem, state, s, border, delta, rate)
            _forget_rounding(run, s)
            continue
        begun, just_before, margin = scratch.margin_begin[s], scratch.margin_before, scratch.margin_end[s]
        if s != element:  # that of the element itself is still needed
            just_before = scratch.ends[:count]
            margins_later(run, s, state.now[T], x, -time, just_before)
        for j in range(count):
            before, rounding = max(begun[j], just_before[j]), max(scratch.noise[s, j], missed * scratch.largest[s, j])
            rounding = max(rounding, _TOGETHER * before)
            if s == element and j == PRESSES and rubs(problem, s):  # N may be 1e-10 of its largest as a slip ends
                rounding = scratch.noise[s, j]
            landed = (s == element and j == border) or (before > rounding and margin[j] <= rounding)
            scratch.fired[j] = max(rounding, margin[j]) if landed else -np.inf
        for j in range(count):
            if scratch.fired[j] >= margin[j]:
                renew(problem, state, s, j, delta, rate)
                _forget_rounding(run, s)
                if not rubs(problem, s):
                    margins_of(run, s, state.now[T], x, margin)
    count_event(state)
