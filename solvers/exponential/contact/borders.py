"""Borders of laws with memory: where a step ends, and what the law latches there.

A law with memory tells by margins b_j(δ, δ̇) how far its borders are; all are positive inside the present segment. No
step goes across a border: the step before ends near it, a landing in time ends on it by the secant rule, and there all
borders are renewed whose margins have fallen to zero, also those of other elements that share the motion. Between two
nodes a margin is watched where it is small, by the polynomial through points around its lowest node.
"""

from __future__ import annotations

import numpy as np

from solvers.compiled.kernels import dot, indentation, inlined, inner
from solvers.compiled.renewals import margins, margins_in, note_event, renew
from solvers.compiled.state import rate_tolerance, surface_tolerance
from solvers.exponential.contact.node_response import DELTAS, RATES, START
from solvers.exponential.contact.nodes import LOCAL, S
from solvers.exponential.contact.peaks import motion_around, summit

_ON = 1e-9  # margin, in units of the largest of the step, at which a step counts as begun on the border
_SAME = 1e-11  # the same for the sign of a node
_TOGETHER = 1e-9  # part of its way at which a border counts as reached when another is landed on
_NEAR = 0.2  # lowest node, in units of the largest margin, below which the motion between nodes is looked at


@inner
def _margins_on_step(problem, state, space, s):
    """Margins at the nodes and at both ends of the step that has just been tried, their largest and their rounding."""
    size, batch, delta, rate = 2 * problem.k.size, space.trial, space.seen[s, 0], space.seen[s, 1]
    batch[0], batch[1] = delta, indentation(problem, s, space.x_new)
    batch[2], batch[3] = delta + surface_tolerance(problem, s, state.x), delta
    batch[4], batch[5] = rate, dot(problem.read_rate[s], space.x_new, size)
    batch[6], batch[7] = rate, rate + rate_tolerance(problem, s, state.x)
    margins(problem, state, s, 4, batch[0:4], batch[4:8], space.ends)
    margins(problem, state, s, S, space.motion[s, 0], space.motion[s, 1], space.margin)
    for j in range(problem.border_count[s]):
        ends = space.ends[4 * j : 4 * j + 4]
        largest = max(abs(ends[0]), abs(ends[1]))
        for i in range(S):
            largest = max(largest, abs(space.margin[S * j + i]))
        space.largest[s, j] = largest
        space.noise[s, j] = max(_SAME * largest, 2.0 * (abs(ends[2] - ends[0]) + abs(ends[3] - ends[0])))


@inlined
def _crossing(problem, tables, space, s, j, family, h):
    """Time after the begin of the step at which a margin falls below zero by its values at the nodes, or inf.

    It is 0 where the margin is negative from the begin on. One that begins at zero may have risen before the first
    node: then a shorter step is asked for, which will tell.
    """
    noise, before, t = space.noise[s, j], space.ends[4 * j], 0.0
    near = max(_ON * space.largest[s, j], noise)
    if before < -near:
        return 0.0
    on = before <= near
    for i in range(S + 1):
        value = space.margin[S * j + i] if i < S else space.ends[4 * j + 1]
        after = h * tables.times[family, i] if i < S else h
        if value < -noise:
            return t + (after - t) * (0.5 if on and i == 0 else max(before, 0.0) / (max(before, 0.0) - value))
        before, t = value, after
    return np.inf


@inner
def _between_nodes(problem, tables, state, space, s, j, family, h):
    """The same where a margin is below zero between the nodes around its lowest one only."""
    values, lowest = space.margin[S * j : S * j + S], 0
    for i in range(S):
        if values[i] < values[lowest]:
            lowest = i
    ends = min(space.ends[4 * j], space.ends[4 * j + 1])
    if values[lowest] > _NEAR * space.largest[s, j] or ends < values[lowest]:
        return np.inf
    motion_around(problem, tables, state, space, family, h, s, lowest)
    margins(problem, state, s, S, space.around[DELTAS], space.around[RATES], space.margin)
    below, deepest = space.trial, 0
    for i in range(S):
        below[i] = -space.margin[S * j + i]
        if below[deepest] <= 0.0 and below[i] > below[deepest]:
            deepest = i
    deep = summit(below, 1.0, space.clipped)
    margins(problem, state, s, S, space.motion[s, 0], space.motion[s, 1], space.margin)
    if deep <= space.noise[s, j]:
        return np.inf
    begin, end = tables.places[family, lowest, 0], tables.places[family, lowest, 1]
    sigma = begin + 0.5 * (LOCAL[max(deepest, 1)] + 1.0) * (end - begin)
    return h * sigma ** tables.power[family]


@inner
def border_ahead(problem, tables, state, space, family, level):
    """(time after the begin of the step, element, border) of the first border on it; no element is -1."""
    first, element, border, h = np.inf, -1, -1, tables.step[level]
    for s in range(problem.gap.size):
        count = problem.border_count[s]
        if count == 0:
            continue
        _margins_on_step(problem, state, space, s)
        for j in range(count):
            if space.largest[s, j] <= space.noise[s, j]:
                continue
            time = _crossing(problem, tables, space, s, j, family, h)
            if time == np.inf:
                time = _between_nodes(problem, tables, state, space, s, j, family, h)
            if time < first:
                first, element, border = time, s, j
    return first, element, border


@inner
def passed(problem, state, space, element, border, w, x):
    """(element, border) of the margin that has gone furthest below zero between the states w and x, or (-1, -1).

    The border landed on is left out, and what has been carried over by rounding only.
    """
    worst, found, which = -_TOGETHER, -1, -1
    for s in range(problem.gap.size):
        count = problem.border_count[s]
        if count == 0:
            continue
        margins_in(problem, state, s, w, space.trial, space.ends)
        margins_in(problem, state, s, x, space.trial, space.margin)
        for j in range(count):
            if (s == element and j == border) or space.margin[j] >= -space.noise[s, j]:
                continue
            share = space.margin[j] / max(space.ends[j], space.noise[s, j])
            if share < worst:
                worst, found, which = share, s, j
    return found, which


@inner
def renew_border(problem, state, space, element, border, log):
    """Renew one border in the present state."""
    delta, rate = margins_in(problem, state, element, state.x, space.trial, space.margin)
    renew(problem, state, element, border, delta, rate, log)
    note_event(state)


@inner
def renew_all(problem, state, space, element, border, log):
    """Renew the border landed on, and all whose margins fell to zero with it since ``space.work[START]``.

    Which ones is judged from the state alone, before any is renewed.
    """
    margins_in(problem, state, element, state.x, space.trial, space.margin)
    missed = 2.0 * abs(space.margin[border]) / space.largest[element, border]
    for s in range(problem.gap.size):
        count = problem.border_count[s]
        if count == 0:
            continue
        margins_in(problem, state, s, space.work[START], space.trial, space.ends)
        delta, rate = margins_in(problem, state, s, state.x, space.trial, space.margin)
        for j in range(count):
            before, near = space.ends[j], max(space.noise[s, j], missed * space.largest[s, j])
            near = max(near, _TOGETHER * before)
            landed = (s == element and j == border) or (before > near and space.margin[j] <= near)
            space.fired[j] = 1.0 if landed else 0.0
        for j in range(count):
            if space.fired[j] > 0.0:
                renew(problem, state, s, j, delta, rate, log)
    note_event(state)
