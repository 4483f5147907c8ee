"""Margins of friction in a step: how far stick and slip are from their ends, see `compiled.sliding`; peaks of F_t.

They depend on ξ, ξ̇ and, in slip, Ṅ besides δ and δ̇. Ṅ of a law with a dashpot needs δ̈: in a state it follows from the
equations of motion, at the nodes from the polynomial through δ̇ there and at the start of the step.
"""

from __future__ import annotations

from numba import types

from solvers.compiled.kernels import (
    VECTOR,
    copy,
    force_at,
    inner,
    merged,
    place_of,
    radius_of,
    rhs,
    row_of,
    slide_of,
    slider_of,
)
from solvers.compiled.parts import RUB_AROUND, RUB_IN, RUB_LANDED, RUB_MARGINS, RUB_PEAK, part
from solvers.compiled.simd import largest8, load8, size8
from solvers.compiled.sliding import (
    ACCELERATION,
    DELTA,
    NONE,
    POINT,
    RATE,
    SPEED,
    WAY,
    move_point,
    point_of,
    pressed_margin,
    slider_margin,
    way_tolerance,
)
from solvers.compiled.state import T, rate_tolerance, surface_tolerance
from solvers.compiled.sums import combine
from solvers.exponential.circles.friction import SPARE, SPEEDS, TANGENTIAL, WAYS, nearest_way
from solvers.exponential.contact.crossings import FORCE
from solvers.exponential.contact.node_response import DELTAS, FORCES, KNOWN, RATES, rate_ripple_of, ripple_of
from solvers.exponential.contact.nodes import LOCAL_SLOPES, S
from solvers.exponential.contact.peaks import local_maximum, motion_around
from solvers.exponential.tables import DAMPING, EXPONENT, FACTOR
from solvers.problem.friction import CODE, MU, PEAK, SCRATCH, STIFFNESS

ENDS = 6  # numbers in `Scratch.ends` for a border
_SAME = 1e-11  # margin, in units of the largest of the step, that is rounding
_DIFFERENCED = 1e-8  # the same where it contains the slope of a polynomial
_REST = 1e-14  # rate, in units of the reference speed, at which what has come to rest turns no more


@merged
def margin_of(problem, state, s, point):
    """Margin of an element with friction at a point."""
    return slider_margin(problem, s, state.segment[s], state.entry_rate[s], point)


@part(RUB_IN, types.float64, types.int64, types.float64, VECTOR, types.float64)
def slider_margin_in(problem, state, scratch, s, t, x, later):
    """The same in the state x at time t, or a time later by its rates."""
    rhs(problem, t, x, state.segment, state.entry_rate, state.rate, scratch.numbers)
    point, moved = scratch.point[0], scratch.point[1]
    point_of(problem, s, t, x, state.rate, point)
    if later == 0.0:
        return margin_of(problem, state, s, point)
    move_point(point, later, moved)
    return margin_of(problem, state, s, moved)


@part(RUB_LANDED, types.float64, types.int64, types.float64, VECTOR)
def slider_margin_landed(problem, state, scratch, s, t, x):
    """The same where a step ends that began in slip under N > 0; at N = 0 the slip goes on only if ξ̇ agrees with it.

    A contact that opens with the other sign has stuck before. Where a law pulls as it opens the slider follows.
    """
    own = slider_of(problem, s)
    pressed = own[CODE] != 0.0 and own[MU] * own[SCRATCH + 2] > NONE * own[PEAK]
    margin = slider_margin_in(problem, state, scratch, s, t, x, 0.0)
    if not pressed or own[MU] * own[SCRATCH + 2] < -NONE * own[PEAK]:
        return margin
    return pressed_margin(problem, s, state.segment[s], state.entry_rate[s], scratch.point[0])


@merged
def _slopes_of_rates(tables, scratch, node_set, h, s, rates, out):
    """δ̈ at the nodes, from δ̇ there and at the start."""
    nodes, weights, start = tables.nodes[node_set], tables.lagrange[node_set, 0], scratch.start_motion[s, 1]
    own = 1.0
    for i in range(S):
        own /= -nodes[i]
    for i in range(S):
        weight, total = weights[i] / nodes[i], 0.0
        for j in range(S):
            if j != i:
                total += weights[j] / nodes[j] / (weight * (nodes[i] - nodes[j])) * (rates[j] - rates[i])
        total += own / (weight * nodes[i]) * (start - rates[i])
        kappa = tables.time_exponent[node_set]
        out[i] = total / (h * kappa * nodes[i] ** (kappa - 1.0))


@inner
def slider_margins_at_nodes(problem, tables, state, scratch, s, node_set, h):
    """Margins at the nodes, into ``scratch.margin``."""
    motion, slid, point = scratch.motion[place_of(problem, s)], scratch.slid[s], scratch.point[1]
    _slopes_of_rates(tables, scratch, node_set, h, s, motion[1], slid[SPARE])
    for i in range(S):
        point[DELTA], point[RATE], point[ACCELERATION] = motion[0, i], motion[1, i], slid[SPARE, i]
        point[WAY], point[SPEED] = slid[WAYS, i], slid[SPEEDS, i]
        scratch.margin[i] = margin_of(problem, state, s, point)


@merged
def _change(problem, state, scratch, s, place, by):
    """How much the margin at the last node changes with one number of the point there, kept among the spare ones."""
    point = scratch.slid[s, SPARE]
    before = pressed_margin(problem, s, state.segment[s], state.entry_rate[s], point)
    known = point[place]
    point[place] += by
    after = pressed_margin(problem, s, state.segment[s], state.entry_rate[s], point)
    point[place] = known
    return abs(after - before)


@merged
def _margin_at_start(problem, tables, state, scratch, s):
    """Margin at the start of the step; of slip on N = 0, as at an entry, that with which N begins to grow.

    Where a law has been cut at N = 0 its slope there is not known, but at the first node.
    """
    margin = slider_margin_in(problem, state, scratch, s, state.now[T], state.x, 0.0)
    if slider_of(problem, s)[CODE] == 0.0 or scratch.law_force[place_of(problem, s), 0] <= 0.0:
        return margin
    pressed = pressed_margin(problem, s, state.segment[s], state.entry_rate[s], scratch.point[0])
    return min(pressed, scratch.margin[0]) if pressed != margin and tables.bend[s] == FORCE else pressed


@part(RUB_MARGINS, types.void, *[types.int64] * 3)
def slider_margins_on_step(problem, tables, state, scratch, s, node_set, level):
    """Margins at the nodes and both ends of the step tried, largest one and rounding, as `borders` has them of laws.

    The point at the start stays in ``scratch.point[0]``.
    """
    h, ends, n, r = tables.contact_step[level], scratch.ends, problem.k.size, row_of(problem, s)
    ends[1] = slider_margin_in(problem, state, scratch, s, state.now[T] + h, scratch.x_new, 0.0)
    slider_margins_at_nodes(problem, tables, state, scratch, s, node_set, h)
    copy(scratch.point[1], scratch.slid[s, SPARE], POINT)
    ends[0] = _margin_at_start(problem, tables, state, scratch, s)
    largest = max(abs(ends[0]), abs(ends[1]), largest8(size8(load8(scratch.margin, 0))))
    way, speed = way_tolerance(problem, s, state.now[T], state.x)
    rest = _REST * scratch.reference_speed[s]
    delta, rate = surface_tolerance(problem, s, state.x), max(rate_tolerance(problem, s, state.x), rest)
    noise = _change(problem, state, scratch, s, DELTA, delta) + _change(problem, state, scratch, s, RATE, rate)
    noise += _change(problem, state, scratch, s, WAY, way)
    noise += _change(problem, state, scratch, s, SPEED, max(speed, rest))
    law = tables.power_law[s]
    elastic = law[EXPONENT] > 0.0 and law[FACTOR] == 0.0 and law[DAMPING] == 0.0
    differenced = slider_of(problem, s)[CODE] != 0.0 and not elastic
    alias, ripple = tables.alias[tables.kind[node_set], level], 0.0
    for a in range(2):
        weight = tables.ripple_weight[r + a]
        for place in (DELTA, WAY):
            by = ripple_of(weight, alias, state.x, n)
            ripple += _change(problem, state, scratch, s, place, by)
        by = rate_ripple_of(weight, problem.k, alias, state.x, n)
        ripple += _change(problem, state, scratch, s, SPEED, by)
    ends[2], ends[3], ends[4], ends[5] = ends[0], ends[0], ends[0] + ripple, ends[0]
    scratch.largest[s, 0] = largest
    scratch.noise[s, 0] = max((_DIFFERENCED if differenced else _SAME) * largest, 2.0 * noise)


@merged
def _slide_around(problem, tables, state, scratch, node_set, h, s, place):
    """ξ and ξ̇ around a node, behind δ and δ̇ there, into row `FORCES` of ``scratch.local_motion``."""
    known, slid, out = scratch.local_motion[KNOWN], scratch.slid[s], scratch.local_motion[FORCES]
    way, speed = slide_of(problem, s, state.now[T], state.x)
    copy(slid[WAYS], known, S)
    for i in range(S):
        known[S + i] = h * slid[SPEEDS, i]
    known[2 * S] = nearest_way(way, slid[WAYS, 0], radius_of(problem, s))
    known[2 * S + 1] = h * speed
    combine(tables.local_interpolation[node_set, place], known, 2 * S + 2, None, out)
    for i in range(S):
        out[S + i] /= h


@part(RUB_AROUND, types.void, *[types.int64] * 2, types.float64, types.int64)
def slider_margins_around(problem, tables, state, scratch, s, node_set, h, place):
    """Margins at points around a node of the step, into ``scratch.margin``."""
    motion_around(problem, tables, state, scratch, node_set, h, s, place)
    _slide_around(problem, tables, state, scratch, node_set, h, s, place)
    begin, end = tables.local_interval[node_set, place, 0], tables.local_interval[node_set, place, 1]
    deltas, rates, ways = scratch.local_motion[DELTAS], scratch.local_motion[RATES], scratch.local_motion[FORCES]
    slopes, point, kappa = scratch.slid[s, SPARE], scratch.point[1], tables.time_exponent[node_set]
    combine(LOCAL_SLOPES, rates, S, None, slopes)
    for i in range(S):
        sigma = begin + 0.5 * (LOCAL_SLOPES[S, i] + 1.0) * (end - begin)
        pace = h * kappa * sigma ** (kappa - 1.0) * 0.5 * (end - begin)
        point[DELTA], point[RATE], point[WAY], point[SPEED] = deltas[i], rates[i], ways[i], ways[S + i]
        point[ACCELERATION] = slopes[i] / pace if pace > 0.0 else scratch.point[0, ACCELERATION]
        scratch.margin[i] = margin_of(problem, state, s, point)


@part(RUB_PEAK, types.void, types.int64, types.float64, types.int64, types.float64)
def peak_of_friction(problem, tables, state, scratch, node_set, h, s, limit):
    """Raise the largest |F_t| of stop s by a converged step of length h, up to σ = limit."""
    own, slid, highest = slider_of(problem, s), scratch.slid[s], -1
    for i in range(S):
        if tables.nodes[node_set, i] <= limit and (
            highest < 0 or abs(slid[TANGENTIAL, i]) > abs(slid[TANGENTIAL, highest])
        ):
            highest = i
    if highest < 0:
        return
    largest = abs(slid[TANGENTIAL, highest])
    own[PEAK] = max(own[PEAK], largest)
    if largest < 0.95 * own[PEAK]:
        return
    begin, end = tables.local_interval[node_set, highest, 0], tables.local_interval[node_set, highest, 1]
    within = min(2.0 * (limit - begin) / (end - begin) - 1.0, 1.0)
    if within <= -1.0:
        return
    motion_around(problem, tables, state, scratch, node_set, h, s, highest)
    values = slid[SPARE]
    if own[CODE] == 0.0:
        shift = slid[WAYS, highest] - slid[TANGENTIAL, highest] / own[STIFFNESS]
        _slide_around(problem, tables, state, scratch, node_set, h, s, highest)
        for i in range(S):
            values[i] = own[STIFFNESS] * abs(scratch.local_motion[FORCES, i] - shift)
    else:
        deltas, rates = scratch.local_motion[DELTAS], scratch.local_motion[RATES]
        for i in range(S):
            values[i] = own[MU] * max(
                force_at(problem, s, deltas[i], rates[i], state.entry_rate[s], scratch.numbers), 0.0
            )
    own[PEAK] = max(own[PEAK], local_maximum(values, within, scratch.clipped))
