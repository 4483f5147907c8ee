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
from solvers.exponential.contact.node_response import DELTAS, RATES, START
from solvers.exponential.contact.nodes import S
from solvers.exponential.contact.peaks import motion_around, summit

_ON = 1e-9  # margin, in units of the largest of the step, at which a step counts as begun on the border
_SAME = 1e-11  # the same for the sign of a node
_TOGETHER = 1e-9  # part of its way at which a border counts as reached when another is landed on
_NEAR = 0.2  # lowest node, in units of the largest margin, below which the motion between nodes is looked at


@inner
def _margins_on_step(problem, state, space, s):
    """Margins at the nodes and at both ends of the step that has just been tried, and the largest of each."""
    size, batch = 2 * problem.k.size, space.trial
    batch[0], batch[1] = space.seen[s, 0], indentation(problem, s, space.x_new)
    batch[2], batch[3] = space.seen[s, 1], dot(problem.read_rate[s], space.x_new, size)
    margins(problem, state, s, 2, batch[0:2], batch[2:4], space.ends)
    margins(problem, state, s, S, space.motion[s, 0], space.motion[s, 1], space.margin)
    for j in range(problem.border_count[s]):
        largest = max(abs(space.ends[2 * j]), abs(space.ends[2 * j + 1]))
        for i in range(S):
            largest = max(largest, abs(space.margin[S * j + i]))
        space.largest[s, j] = largest


@inlined
def _crossing(problem, tables, space, s, j, family, h):
    """Time after the begin of the step at which a margin falls below zero by its values at the nodes, or inf."""
    largest, before, t = space.largest[s, j], space.ends[2 * j], 0.0
    on = before <= _ON * largest
    for i in range(S + 1):
        value = space.margin[S * j + i] if i < S else space.ends[2 * j + 1]
        after = h * tables.times[family, i] if i < S else h
        if value < -_SAME * largest:
            return t + (after - t) * (before / (before - value) if before > 0.0 and not (on and i == 0) else 0.0)
        before, t = value, after
    return np.inf


@inner
def _between_nodes(problem, tables, state, space, s, j, family, h):
    """The same where a margin is below zero around its lowest node only: the begin of the interval around it."""
    values, lowest = space.margin[S * j : S * j + S], 0
    for i in range(S):
        if values[i] < values[lowest]:
            lowest = i
    ends = min(space.ends[2 * j], space.ends[2 * j + 1])
    if values[lowest] > _NEAR * space.largest[s, j] or ends < values[lowest]:
        return np.inf
    motion_around(problem, tables, state, space, family, h, s, lowest)
    margins(problem, state, s, S, space.around[DELTAS], space.around[RATES], space.margin)
    below = space.trial
    for i in range(S):
        below[i] = -space.margin[S * j + i]
    deep = summit(below, 1.0, space.clipped)
    margins(problem, state, s, S, space.motion[s, 0], space.motion[s, 1], space.margin)
    if deep <= _SAME * space.largest[s, j]:
        return np.inf
    return h * tables.places[family, lowest, 0] ** tables.power[family]


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
            if space.largest[s, j] == 0.0:
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
            if (s == element and j == border) or space.margin[j] >= -_SAME * space.largest[s, j]:
                continue
            share = space.margin[j] / max(space.ends[j], _SAME * space.largest[s, j])
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
    for s in range(problem.gap.size):
        count = problem.border_count[s]
        if count == 0:
            continue
        margins_in(problem, state, s, space.work[START], space.trial, space.ends)
        delta, rate = margins_in(problem, state, s, state.x, space.trial, space.margin)
        for j in range(count):
            before, share = space.ends[j], _TOGETHER * max(space.ends[j], 0.0)
            landed = (s == element and j == border) or (before > _ON * space.largest[s, j] and space.margin[j] <= share)
            space.fired[j] = 1.0 if landed else 0.0
        for j in range(count):
            if space.fired[j] > 0.0:
                renew(problem, state, s, j, delta, rate, log)
    note_event(state)
