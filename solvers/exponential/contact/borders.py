"""Borders of laws with memory: where a step ends, and what the law latches there.

A law with memory tells by margins b_j(δ, δ̇) how far its borders are; all are positive inside the present segment. No
step goes across a border: the step before ends near it, a landing in time ends on it by the secant rule, and there all
borders are renewed whose margins have fallen to zero, also those of other elements that share the motion. Between two
nodes a margin is watched where it is small, by the polynomial through points around its lowest node; a step whose nodes
do not resolve the fast blocks keeps a distance of what these may add.
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
)
from solvers.compiled.parts import PASSED, part
from solvers.compiled.renewals import margins, margins_before, margins_in, note_event, renew
from solvers.compiled.sliding import DELTA, RATE
from solvers.compiled.state import LAST_EVENT, T, rate_tolerance, surface_tolerance
from solvers.exponential.contact.crossings import extremum
from solvers.exponential.contact.node_response import DELTAS, KNOWN, RATES, START, motion_of, rate_ripple_of, ripple_of
from solvers.exponential.contact.nodes import LOCAL, S, lagrange
from solvers.exponential.contact.peaks import local_maximum, motion_around
from solvers.exponential.contact.slider_margins import (
    ENDS,
    slider_margins_around,
    slider_margins_at_nodes,
    slider_margins_in,
    slider_margins_on_step,
)
from solvers.problem.friction import CODE

UNRESOLVED = -2
_ON = 1e-9  # margin, in units of the largest of the step, at which a step counts as begun on the border
_SAME = 1e-11  # the same for the sign of a node
_TOGETHER = 1e-9  # part of its way at which a border counts as reached when another is landed on
_MISSED = 1e-3  # margin, in units of the largest of the step, by which a landing may have missed its border
_BEFORE = 1e-3  # part of a landing before its end
_EARLY, _EARLIER, _LOOKS = 0.1, 1e-2, 6  # part of the time to the first node, next to it, and how often it is shortened
_FURTHER = 8.0  # times as far is looked where the rates do not yet tell whether a margin rises
_ILLINOIS = 6  # evaluations of a polynomial to its root
_REST = 1e-14  # rate, in units of the reference speed, at which what has come to rest turns no more
_NEAR = 0.2  # lowest node, in units of the largest margin, below which the motion between nodes is looked at
_ENDS_NEAR = 0.5  # lower end of a landing, in the same units, below which what lies between its ends is looked at
_CLEAR = 0.03  # the lowest margin between them, in the same units, that counts as above zero


@inner
def margins_of(problem, state, scratch, s, t, x, out):
    """Margins of element s in the state x at time t; returns δ and δ̇."""
    if rubs(problem, s):
        slider_margins_in(problem, state, scratch, s, t, x, 0.0, out)
        return scratch.point[0, DELTA], scratch.point[0, RATE]
    return margins_in(problem, state, s, x, scratch.trial, out)


@inner
def margins_later(problem, state, scratch, s, t, x, time, out):
    """The same a time later than x, by the rates there."""
    if rubs(problem, s):
        slider_margins_in(problem, state, scratch, s, t, x, time, out)
        return
    rhs(problem, t, x, state.segment, state.entry_rate, state.rate, scratch.trial)
    delta, rate = indentation_and_rate(problem, s, x)
    margins_before(problem, state, s, delta, rate, -time, scratch.trial, out)


@inlined
def _is_without(problem, state, s):
    """Whether an element has no borders by now: friction has none while the contact is open."""
    return problem.border_count[s] == 0 or (rubs(problem, s) and state.segment[s] == 0)


@inlined
def _margins_at_nodes(problem, tables, state, scratch, s, node_set, h):
    """Margins at the nodes, into ``scratch.margin``."""
    if rubs(problem, s):
        slider_margins_at_nodes(problem, tables, state, scratch, s, node_set, h)
        return
    motion = motion_of(problem, scratch, s)
    margins(problem, state, s, S, motion[0], motion[1], scratch.margin)


@inner
def _margins_on_step(problem, tables, state, scratch, s, node_set, level):
    """Margins at the nodes and at both ends of the step that has just been tried, their largest and their rounding.

    The start is taken a rounding ahead of where it is, on the side to which the motion goes: a law that has not moved
    yet may look at the sign of δ. It is looked at once more with rounding added to δ and to δ̇, and with their ripple.
    """
    if rubs(problem, s):
        slider_margins_on_step(problem, tables, state, scratch, s, node_set, level)
        return
    n, delta, rate = problem.k.size, scratch.start_motion[s, 0], scratch.start_motion[s, 1]
    weight, alias = tables.ripple_weight[row_of(problem, s)], tables.alias[tables.kind[node_set], level]
    deltas, rates = scratch.local_motion[KNOWN, :ENDS], scratch.local_motion[KNOWN, ENDS : 2 * ENDS]
    ahead, rounding = math.copysign(1.0, rate), surface_tolerance(problem, s, state.x)
    for i in range(ENDS):
        deltas[i], rates[i] = delta + ahead * rounding, rate
    deltas[1], rates[1] = indentation_and_rate(problem, s, scratch.x_new)
    deltas[2] += ahead * rounding
    rates[3] += ahead * max(rate_tolerance(problem, s, state.x), _REST * scratch.reference_speed[s])
    deltas[4] += ahead * ripple_of(weight, alias, state.x, n)
    rates[5] += ahead * rate_ripple_of(weight, problem.k, alias, state.x, n)
    margins(problem, state, s, ENDS, deltas, rates, scratch.ends)
    _margins_at_nodes(problem, tables, state, scratch, s, node_set, tables.contact_step[level])
    for j in range(problem.border_count[s]):
        ends = scratch.ends[ENDS * j : ENDS * (j + 1)]
        largest = max(abs(ends[0]), abs(ends[1]))
        for i in range(S):
            largest = max(largest, abs(scratch.margin[S * j + i]))
        scratch.largest[s, j] = largest
        scratch.noise[s, j] = max(_SAME * largest, 2.0 * (abs(ends[2] - ends[0]) + abs(ends[3] - ends[0])))


@merged
def _soon(problem, state, scratch, s, j, time):
    """A margin so long after the start of the step, by the rates there."""
    margins_later(problem, state, scratch, s, state.now[T], state.x, time, scratch.fired)
    return scratch.fired[j]


@inlined
def _rises(problem, tables, state, scratch, s, j, time):
    """Whether a margin rises at the start of the step: by the rates there, carried on and back until it is told."""
    noise, rise = scratch.noise[s, j], 0.0
    while abs(rise) <= noise and time < tables.contact_step[0]:
        rise = _soon(problem, state, scratch, s, j, time) - _soon(problem, state, scratch, s, j, -time)
        time *= _FURTHER
    return rise > 0.0


@inlined
def _falls_at_once(problem, tables, state, scratch, s, j, time):
    """Whether a margin that begins at zero, and is below it after a time, has not been above it before.

    The start is extrapolated over shorter and shorter times until the margin cannot be told from zero: a slider with a
    strong dashpot slips one way, sticks, and slips the other way within a small part of a step. One that rises by less
    than its noise and then falls, as where a slider at its limit still moves back a little, falls later.
    """
    noise, share = scratch.noise[s, j], _EARLY
    for _ in range(_LOOKS):
        value = _soon(problem, state, scratch, s, j, share * time)
        if value > noise:
            return False
        if value >= -noise:
            return not _rises(problem, tables, state, scratch, s, j, time)
        share *= _EARLIER
    return True


@inlined
def _before_first_node(problem, state, scratch, s, j, before, time, h):
    """Time at which a margin that goes on as the run begins falls to zero, if that is before the first node, or inf.

    A law that has not moved yet has a margin by the sign of δ: it would not know of a motion to and fro. From the start
    on that takes as long forth as back: a step shorter than what the run has lasted has nodes within.
    """
    if state.now[T] > h or before <= scratch.noise[s, j]:
        return np.inf
    fall = before - _soon(problem, state, scratch, s, j, _BEFORE * time)
    return _BEFORE * time * before / fall if fall > _BEFORE * before else np.inf


@inlined
def _polynomial(tables, scratch, s, j, node_set, sigma):
    """The polynomial through a margin at the nodes."""
    value = 0.0
    lagrange(tables.nodes[node_set], tables.lagrange[node_set, 0], sigma, scratch.trial)
    for i in range(S):
        value += scratch.trial[i] * scratch.margin[S * j + i]
    return value


@inlined
def _by_nodes(tables, scratch, s, j, node_set, h, i, linear):
    """Time at which that falls to zero just before node i, or the end; ``linear`` where it does not.

    It is found by the Illinois rule. Landings of friction that begin with it take a fifth fewer tries.
    """
    left = tables.nodes[node_set, i - 1] if i > 0 else 0.0
    right = tables.nodes[node_set, i] if i < S else 1.0
    above = _polynomial(tables, scratch, s, j, node_set, left)
    below = _polynomial(tables, scratch, s, j, node_set, right)
    if not below < 0.0 < above:
        return linear
    middle, last = right, 0.0
    for _ in range(_ILLINOIS):
        middle = right - (right - left) * below / (below - above)
        value = _polynomial(tables, scratch, s, j, node_set, middle)
        if value > 0.0:
            left, above, below = middle, value, below * (0.5 if last > 0.0 else 1.0)
        else:
            right, below, above = middle, value, above * (0.5 if last < 0.0 else 1.0)
        last = value
    return h * middle ** tables.time_exponent[node_set]


@inlined
def _crossing(problem, tables, state, scratch, s, j, node_set, h):
    """Time after the start of the step at which a margin falls below zero by its values at the nodes, or inf.

    It is 0 where the margin is negative from the start on. One that begins at zero may have risen before the first
    node: then a shorter step is asked for, which will tell. A landing may have missed its border by more than rounding
    of this step: then a margin is negative at first, but little, rises, and crosses only if it falls again. A slip that
    begins against its force, as dashpots make it, has a large one and ends at once.
    """
    noise, before, t = scratch.noise[s, j], scratch.ends[ENDS * j], 0.0
    near = max(_ON * scratch.largest[s, j], noise)
    missed = state.now[T] == state.now[LAST_EVENT] and state.now[T] > 0.0 and scratch.margin[S * j] > before
    missed &= before > -_MISSED * scratch.largest[s, j]
    if before < -near and not missed:
        return 0.0
    on = before <= near
    for i in range(S + 1):
        value = scratch.margin[S * j + i] if i < S else scratch.ends[ENDS * j + 1]
        after = h * tables.times[node_set, i] if i < S else h
        if value < -noise and not (missed and before < -noise and value > before):
            if i == 0 and before <= noise and _falls_at_once(problem, tables, state, scratch, s, j, after):
                return 0.0
            if on and i == 0:
                return 0.5 * after
            share = max(before, 0.0) / (max(before, 0.0) - value)
            return _by_nodes(tables, scratch, s, j, node_set, h, i, t + (after - t) * share)
        before, t = value, after
    first = h * tables.times[node_set, 0]
    return _before_first_node(problem, state, scratch, s, j, scratch.ends[ENDS * j], first, h)


@inlined
def _turns(a, b, c, first, second):
    """Whether the parabola through (0, a), (first, b) and (second, c) falls from 0 on, but not down to b."""
    rise, further = (b - a) / first, (c - b) / (second - first)
    return rise - (further - rise) * first / second < 0.0 < rise


@inner
def _between_nodes(problem, tables, state, scratch, s, j, node_set, h):
    """The same where a margin is below zero between the nodes around one of its minima only.

    The lowest margin may stand at an end of the step, as where it begins on the border; then it is looked at too if
    the margin turns before the next node.
    """
    ends, values = scratch.ends[ENDS * j : ENDS * (j + 1)], scratch.margin[S * j : S * j + S]
    near, t = _NEAR * scratch.largest[s, j], tables.times[node_set]
    for i in range(S):
        before, after = values[i - 1] if i > 0 else ends[0], values[i + 1] if i < S - 1 else ends[1]
        low = values[i] <= min(before, after, near)
        if i == 0:
            low |= before <= near and _turns(before, values[0], after, t[0], t[1])
        elif i == S - 1:
            low |= after <= near and _turns(after, values[i], before, 1.0 - t[i], 1.0 - t[i - 1])
        if low:
            time = _dip(problem, tables, state, scratch, s, j, node_set, h, i)
            if time < np.inf:
                return time
    return np.inf


@inner
def _dip(problem, tables, state, scratch, s, j, node_set, h, lowest):
    """The same around one node."""
    if rubs(problem, s):
        slider_margins_around(problem, tables, state, scratch, s, node_set, h, lowest)
    else:
        motion_around(problem, tables, state, scratch, node_set, h, s, lowest)
        margins(problem, state, s, S, scratch.local_motion[DELTAS], scratch.local_motion[RATES], scratch.margin)
    below, deepest = scratch.trial, 0
    for i in range(S):
        below[i] = -scratch.margin[S * j + i]
        if below[deepest] <= 0.0 and below[i] > below[deepest]:
            deepest = i
    deep = local_maximum(below, 1.0, scratch.clipped)
    _margins_at_nodes(problem, tables, state, scratch, s, node_set, h)
    if deep <= scratch.noise[s, j]:
        return np.inf
    begin, end = tables.local_interval[node_set, lowest, 0], tables.local_interval[node_set, lowest, 1]
    sigma = begin + 0.5 * (LOCAL[max(deepest, 1)] + 1.0) * (end - begin)
    return h * sigma ** tables.time_exponent[node_set]


@inlined
def _hides(scratch, s, j):
    """Whether fast blocks, which the nodes do not resolve, may take a margin below zero between them."""
    ends = scratch.ends[ENDS * j : ENDS * (j + 1)]
    ripple, lowest = abs(ends[4] - ends[0]) + abs(ends[5] - ends[0]), ends[1]
    for i in range(S):
        lowest = min(lowest, scratch.margin[S * j + i])
    return ripple > scratch.noise[s, j] and lowest < ripple


@inner
def border_ahead(problem, tables, state, scratch, node_set, level):
    """(time after the start of the step, element, border) of the first border on it.

    The element is -1 if there is none, and `UNRESOLVED` if the step is too long to tell.
    """
    first, element, border, h = np.inf, -1, -1, tables.contact_step[level]
    for s in range(problem.law.size):
        count = problem.border_count[s]
        if _is_without(problem, state, s):
            continue
        _margins_on_step(problem, tables, state, scratch, s, node_set, level)
        for j in range(count):
            if scratch.largest[s, j] <= scratch.noise[s, j]:
                continue
            time = _crossing(problem, tables, state, scratch, s, j, node_set, h)
            if time == np.inf:
                time = _between_nodes(problem, tables, state, scratch, s, j, node_set, h)
            if time == np.inf and _hides(scratch, s, j):
                return np.inf, UNRESOLVED, -1
            if time < first:
                first, element, border = time, s, j
    return first, element, border


@merged
def _dips(problem, state, scratch, s, landed, w, x):
    """Whether a margin of element s but the one landed on may be below zero between the states w and x.

    It is taken as the cubic through its values and rates, which is coarse: it must not even come near zero.
    """
    count, width, values = problem.border_count[s], state.x.size, scratch.ends
    d = x[width] - w[width]
    for end in range(2):
        y, time = x if end else w, _BEFORE * (-d if end else d)
        margins_of(problem, state, scratch, s, y[width], y, values[2 * end * count :])
        margins_later(problem, state, scratch, s, y[width], y, time, values[(2 * end + 1) * count :])
    for j in range(count):
        a, b = values[j], values[2 * count + j]
        fall, rise = (values[count + j] - a) / (_BEFORE * d), (b - values[3 * count + j]) / (_BEFORE * d)
        known = j != landed and scratch.largest[s, j] > scratch.noise[s, j]
        if known and fall < 0.0 < rise and extremum(d, a, fall, b, rise) < _CLEAR * scratch.largest[s, j]:
            return True
    return False


@part(PASSED, types.UniTuple(types.int64, 2), types.int64, types.int64, VECTOR, VECTOR)
def passed(problem, state, scratch, element, border, w, x):
    """(element, border) of the margin that has gone furthest below zero between the states w and x, or (-1, -1).

    The border landed on is left out, and what has been carried over by rounding only. The element is `UNRESOLVED` if a
    margin may have been below zero in between, or is so at the start: that border is passed before any step.
    """
    worst, found, which, dips = -_TOGETHER, -1, -1, False
    for s in range(problem.law.size):
        count, size = problem.border_count[s], state.x.size
        if _is_without(problem, state, s) or (s == element and count == 1):
            continue
        margins_of(problem, state, scratch, s, w[size], w, scratch.ends)
        margins_of(problem, state, scratch, s, x[size], x, scratch.margin)
        near = False
        for j in range(count):
            if s == element and j == border:
                continue
            near |= min(scratch.ends[j], scratch.margin[j]) < _ENDS_NEAR * scratch.largest[s, j]
            dips |= scratch.ends[j] < -max(scratch.noise[s, j], _MISSED * scratch.largest[s, j])
            if scratch.margin[j] >= -scratch.noise[s, j]:
                continue
            share = scratch.margin[j] / max(scratch.ends[j], scratch.noise[s, j])
            if share < worst:
                worst, found, which = share, s, j
        dips |= near and _dips(problem, state, scratch, s, border if s == element else -1, w, x)
    return (UNRESOLVED, -1) if dips and found < 0 else (found, which)


@inlined
def _know_rate(problem, state, scratch, s):
    """The rate of the state, where a slider that sticks needs it: one at rest begins to slip by its acceleration."""
    if rubs(problem, s) and slider_of(problem, s)[CODE] == 0.0:
        rhs(problem, state.now[T], state.x, state.segment, state.entry_rate, state.rate, scratch.trial)


@inner
def renew_border(problem, state, scratch, element, border):
    """Renew one border in the present state."""
    delta, rate = margins_of(problem, state, scratch, element, state.now[T], state.x, scratch.margin)
    _know_rate(problem, state, scratch, element)
    renew(problem, state, element, border, delta, rate)
    note_event(state)


@inner
def renew_all(problem, state, scratch, element, border):
    """Renew the border landed on, and all whose margins fell to zero with it since ``scratch.stages[START]``.

    Which ones is judged from the state alone, before any is renewed; of the same law the margins are read again after
    each: another border of the same segment may be none of the next one. One that began at zero, as after its own
    renewal, has risen and come back if its margin was above zero just before.
    """
    size = state.x.size
    delta, rate = margins_of(problem, state, scratch, element, state.now[T], state.x, scratch.margin)
    missed = 2.0 * abs(scratch.margin[border]) / scratch.largest[element, border]
    time = _BEFORE * (state.now[T] - scratch.stages[START, size])
    for s in range(problem.law.size):
        count = problem.border_count[s]
        if _is_without(problem, state, s):
            continue
        _know_rate(problem, state, scratch, s)
        if s == element and count == 1:
            renew(problem, state, s, border, delta, rate)
            continue
        begun, just_before = scratch.ends[:count], scratch.ends[count : 2 * count]
        margins_of(problem, state, scratch, s, scratch.stages[START, size], scratch.stages[START], begun)
        margins_later(problem, state, scratch, s, state.now[T], state.x, -time, just_before)
        depth, speed = margins_of(problem, state, scratch, s, state.now[T], state.x, scratch.margin)
        for j in range(count):
            before, near = max(begun[j], just_before[j]), max(scratch.noise[s, j], missed * scratch.largest[s, j])
            near = max(near, _TOGETHER * before)
            landed = (s == element and j == border) or (before > near and scratch.margin[j] <= near)
            scratch.fired[j] = max(near, scratch.margin[j]) if landed else -np.inf
        for j in range(count):
            if scratch.fired[j] >= scratch.margin[j]:
                renew(problem, state, s, j, depth, speed)
                if not rubs(problem, s):
                    margins_of(problem, state, scratch, s, state.now[T], state.x, scratch.margin)
    note_event(state)
