"""Largest indentation and force of a contact: maxima of the interpolants of each step, not of its node values.

In the interval between the neighbours of the highest node, δ and δ̇ at eight points are interpolated by Hermite's
polynomial of degree 17 through δ and δ̇ at all nodes and at the start of the step; the forces there are those of the
law. On steps so short that rounding of δ would show in δ̇, the values of δ̇ alone tell it. The maximum of the polynomial
through these points differs less from that of the motion than the motion from the exact one.
"""

from __future__ import annotations

import math

from solvers.compiled.kernels import (
    contact_forces,
    copy,
    force_at,
    indentation,
    indentation_rate,
    inlined,
    inner,
    merged,
    off_knots,
    place_of,
    rubs,
    slider_of,
    surface_tolerance,
)
from solvers.compiled.simd import largest8, load8, splat8, sum8
from solvers.compiled.sliding import slider_force
from solvers.compiled.state import PEAK_DELTA, PEAK_FORCE, T, acting_segment, begins_and_ends
from solvers.compiled.sums import combine
from solvers.exponential.contact.node_response import (
    DELTAS,
    FORCES,
    KNOWN,
    RATES,
    force_of,
    largest_size,
    motion_of,
    own_accelerance,
)
from solvers.exponential.contact.nodes import AT_BEGIN, LOCAL, MONOMIALS, SLOPE_AT_BEGIN, SLOPE_AT_END, S
from solvers.problem.friction import MU, PEAK

_MOST_NEWTON_STEPS = 6  # to a maximum
_HIDES_RATES = 1e-11  # rounding of δ, over the way on a step, above which it shows in slopes of polynomials
_OFF_NODES = 1e-200  # keeps σ off a node where a polynomial is evaluated
BELOW_PEAK = 0.95  # of a peak: if all node values are below, no higher maximum is between them


@inlined
def _evaluate(coefficients, x):
    """Value, slope and half the second derivative of a polynomial at x."""
    value, slope, curvature = coefficients[S - 1], 0.0, 0.0
    for k in range(S - 2, -1, -1):
        curvature = curvature * x + slope
        slope = slope * x + value
        value = value * x + coefficients[k]
    return value, slope, curvature


@merged
def _parabola_vertex(values, place):
    """Vertex of the parabola through a point of `LOCAL` and its neighbours, and these; at an end the point itself."""
    if place == 0 or place == S - 1:
        return LOCAL[place], LOCAL[max(place - 1, 0)], LOCAL[min(place + 1, S - 1)]
    low, b, high = LOCAL[place - 1], LOCAL[place], LOCAL[place + 1]
    rise, fall = (b - low) * (values[place] - values[place + 1]), (high - b) * (values[place] - values[place - 1])
    x = b if rise + fall == 0.0 else b - 0.5 * ((b - low) * rise - (high - b) * fall) / (rise + fall)
    return min(max(x, low), high), low, high


@inlined
def local_maximum(values, limit, coefficients):
    """Maximum on [-1, limit] of the polynomial through the values at `LOCAL`, near the highest of these."""
    return maximum_and_place(values, limit, coefficients)[0]


@inner
def maximum_and_place(values, limit, coefficients):
    """Maximum of the same polynomial and its place, at the limit that of the highest value.

    Newton's method for a zero of the slope begins at the vertex of the parabola through that point and its neighbours;
    the error of the maximum is of the third order in the last step.
    """
    place = 0
    for i in range(S):
        if values[i] > values[place] and LOCAL[i] <= limit:
            place = i
    combine(MONOMIALS, values, S, None, coefficients)
    best, at = values[place], LOCAL[place]
    if limit < 1.0:
        best = max(best, _evaluate(coefficients, limit)[0])
    x, low, high = _parabola_vertex(values, place)
    high = min(high, limit)
    x = min(x, high)
    for _ in range(_MOST_NEWTON_STEPS):
        value, slope, curvature = _evaluate(coefficients, x)
        if value > best:
            best, at = value, x
        if not curvature < 0.0:
            break
        step = -0.5 * slope / curvature
        if abs(step) < 1e-5:
            return max(best, value + 0.5 * slope * step), at
        x = min(max(x + step, low), high)
    return best, at


@inlined
def _highest_node(tables, values, node_set, limit):
    """Index of the largest node value up to σ = limit, or -1."""
    if limit >= 1.0 and values[S - 1] >= largest8(load8(values, 0)):
        return S - 1
    place = -1
    for i in range(S):
        if tables.nodes[node_set, i] <= limit and (place < 0 or values[i] > values[place]):
            place = i
    return place


@inner
def polynomial(tables, node_set, values, sigma):
    """Value at σ of the polynomial through eight values y_i at the nodes: Π (σ - σ_i) Σ w_i y_i/(σ - σ_i)."""
    nodes, product = tables.nodes[node_set], 1.0
    for i in range(S):
        product *= sigma - nodes[i] + _OFF_NODES
    apart = splat8(sigma) - load8(nodes, 0) + splat8(_OFF_NODES)
    return product * sum8(load8(tables.lagrange[node_set, 0], 0) * values / apart)


@inner
def motion_around(run, node_set, h, s, place):
    """Indentations and rates of stop s at points around a node of the step, into ``scratch.local_motion``."""
    problem, tables, state = run.problem, run.tables, run.state
    local_motion, motion, known = run.scratch.local_motion, motion_of(run, s), run.scratch.local_motion[KNOWN]
    copy(motion[0], known, S)
    for i in range(S):
        known[S + i] = h * motion[1, i]
    known[2 * S] = indentation(problem, s, state.x)
    known[2 * S + 1] = h * indentation_rate(problem, s, state.x)
    combine(tables.local_interpolation[node_set, place], known, 2 * S + 2, None, local_motion[DELTAS])
    begin, end = tables.local_interval[node_set, place]
    of_slopes = tables.time_exponent[node_set] > 1.0 and begin > 0.0  # of δ, see `nodes`
    if not of_slopes or surface_tolerance(problem, s, state.x) <= _HIDES_RATES * h * largest_size(motion[1]):
        for i in range(S):
            local_motion[RATES, i] = local_motion[DELTAS, S + i] / h
        return
    start = indentation_rate(problem, s, state.x)
    shares = (load8(motion[1], 0) - splat8(start)) / load8(tables.nodes[node_set], 0)
    for i in range(S):
        sigma = begin + 0.5 * (LOCAL[i] + 1.0) * (end - begin)
        local_motion[RATES, i] = start + sigma * polynomial(tables, node_set, shares, sigma)


@merged
def largest_indentation(run, node_set, h, s):
    """Largest indentation of stop s, m, around its highest node of a step."""
    place = _highest_node(run.tables, motion_of(run, s)[0], node_set, 1.0)
    motion_around(run, node_set, h, s, place)
    return local_maximum(run.scratch.local_motion[DELTAS], 1.0, run.scratch.trial)


@inlined
def _all_below_peak(state, s, column, values):
    """Whether all node values are so far below the peak in a column of ``state.active`` that none between is higher."""
    return largest8(load8(values, 0)) < BELOW_PEAK * state.active[s, column]


@inner
def step_peaks(run, node_set, h, s, limit):
    """Raise the peaks of stop s by the converged step of length h from ``state.x``, up to σ = ``limit``."""
    problem, state, scratch = run.problem, run.state, run.scratch
    seen, motion, force = -1, motion_of(run, s)[0], force_of(run, s)
    if limit >= 1.0 and _all_below_peak(state, s, PEAK_FORCE, force) and _all_below_peak(state, s, PEAK_DELTA, motion):
        return
    summary, start = scratch.summary[place_of(problem, s)], scratch.start_motion[s]
    for column, values, d in ((PEAK_FORCE, force, 0), (PEAK_DELTA, motion, 1)):
        known = state.active[s, column]
        place = _highest_node(run.tables, values, node_set, limit)
        if place >= 0:
            state.active[s, column] = max(known, values[place])
        if limit >= 1.0:
            if values[place] < BELOW_PEAK * known:
                continue
            last = place == S - 1
            if last and (summary[SLOPE_AT_END] if d == 0 else indentation_rate(problem, s, scratch.x_new)) >= 0.0:
                continue  # still rising at the end, where the next step begins
            begin, slope = (summary[AT_BEGIN], summary[SLOPE_AT_BEGIN]) if d == 0 else (start[0], start[1])
            if node_set == 0 and place == 0 and slope <= 0.0 and known >= begin:
                continue  # falling from its start
        place = max(place, 0)
        if seen != place:
            motion_around(run, node_set, h, s, place)
            deltas, rates, seen = scratch.local_motion[DELTAS, :S], scratch.local_motion[RATES, :S], place
            for i in range(S):
                deltas[i] = off_knots(problem, s, state.segment[s], deltas[i])
            contact_forces(problem, s, deltas, rates, state.entry_rate[s], scratch.local_motion[FORCES, :S])
        begin, end = run.tables.local_interval[node_set, place]
        within = min(2.0 * (limit - begin) / (end - begin) - 1.0, 1.0)
        if within > -1.0:
            sought = scratch.local_motion[FORCES if d == 0 else DELTAS]
            best = local_maximum(sought, within, scratch.trial)
            state.active[s, column] = max(state.active[s, column], best)


@inner
def state_peaks(run, x):
    """Raise the peaks of all stops in contact by their indentations and forces in the state x."""
    problem, state = run.problem, run.state
    batch = run.scratch.trial
    for s in range(problem.law.size):
        if acting_segment(problem, state, s) > 0:
            delta = off_knots(problem, s, state.segment[s], indentation(problem, s, x))
            force_at(problem, s, delta, indentation_rate(problem, s, x), state.entry_rate[s], batch)
            if not begins_and_ends(problem, s):
                batch[0], batch[2] = abs(batch[0]), abs(batch[2])
            state.active[s, PEAK_DELTA] = max(state.active[s, PEAK_DELTA], batch[0])
            state.active[s, PEAK_FORCE] = max(state.active[s, PEAK_FORCE], batch[2])
            if rubs(problem, s):
                slider = slider_of(problem, s)
                force = slider_force(problem, s, state.segment[s], state.entry_rate[s], state.now[T], x)
                limit = slider[MU] * max(batch[2], 0.0)  # what a spring drawn beyond it at the start never exceeds
                slider[PEAK] = max(slider[PEAK], min(abs(force), limit))


@inner
def pressed_speed(run, s, batch):
    """Speed, m/s, that the force of a stop in contact would give over a distance δ, √(|F δ|/m); 0 if it is open."""
    problem, state = run.problem, run.state
    delta = indentation(problem, s, state.x)
    if state.segment[s] == 0 or abs(delta) <= surface_tolerance(problem, s, state.x):
        return 0.0
    force_at(problem, s, delta, indentation_rate(problem, s, state.x), state.entry_rate[s], batch)
    return math.sqrt(abs(batch[0] * batch[2] * own_accelerance(run, s)))
