"""Events within a step in contact: a stop passes a border of its segment of the law, or a bend of the law.

The borders of all stops are checked, those out of contact included. Between two points of a step δ is taken as the
cubic through both values and rates, around the highest node of a stop out of contact as in `peaks`; such a stop must
also keep the distance of the ripple that fast modes may have between the nodes. With many stops, one that cannot reach
its surface by a bound of |δ̈| is not checked further.

A bend is a kink of the law that is not at a given indentation: at δ̇ = 0 for a law that damps on approach only, at F = 0
for one that is cut where it would pull. The side of a bend is the sign of δ̇, or of the force before the cut. No step
crosses a bend; one step ends on it.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from solvers.compiled.dop853_tableau import STAGES, C
from solvers.compiled.kernels import (
    REAL,
    VECTOR,
    call_force,
    copy,
    dot,
    indentation,
    indentation_rate,
    inlined,
    inner,
    is_circle,
    merged,
    push_of,
    row_of,
)
from solvers.compiled.parts import BOUNDS, LEAVES, SIDE, part
from solvers.compiled.simd import largest8, least8, load8, splat8, store8
from solvers.compiled.state import PEAK_FORCE, T_IN, T, acts, begins_and_ends, is_open, surface_tolerance
from solvers.compiled.sums import above
from solvers.exponential.circles.contact import radial_nodes, stays_in_circle
from solvers.exponential.contact.many_stops import CONTINUING, ENTERING, add_block_motion, motion_at_nodes, uses_blocks
from solvers.exponential.contact.node_response import RTOL, motion_of, respond, ripple_of_stop
from solvers.exponential.contact.nodes import S
from solvers.exponential.contact.peaks import largest_indentation
from solvers.exponential.flight import energy_norms

RATE, FORCE = 1.0, 2.0  # kinds of bends in Tables.bend; 0 for a law that has none
CLEAR, TOO_LONG = -1, -2  # of a landing: no other event before it, or one that requires shorter steps
_ON = 1e-9  # value, in units of the largest of the step, up to which a stop counts as on its bend
_TOGETHER = 1e-6  # share of its last value by which a stop may pass its bend when another stop lands
_SAME = 1e-11  # value, in units of the largest of the step, up to which a node may be on the wrong side


@inner
def extremum(d, a, slope_a, b, slope_b):
    """Extremum of the cubic through (0, a) and (d, b) with given slopes of opposite signs."""
    mean = (b - a) / d
    c2 = (3.0 * mean - 2.0 * slope_a - slope_b) / d
    c3 = (slope_a + slope_b - 2.0 * mean) / (d * d)
    root = math.sqrt(max(c2 * c2 - 3.0 * c3 * slope_a, 0.0))
    x = slope_a / (root - c2 if slope_a > 0.0 else -root - c2)
    x = min(max(x, 0.0), d)
    return a + x * (slope_a + x * (c2 + x * c3))


@inlined
def _passes(d, a, slope_a, b, slope_b, lower, upper):
    """Whether the cubic through two points leaves [lower, upper] between them or at the second."""
    if not lower <= b <= upper:
        return True
    if slope_a > 0.0 > slope_b:
        return extremum(d, a, slope_a, b, slope_b) > upper
    if slope_a < 0.0 < slope_b:
        return extremum(d, a, slope_a, b, slope_b) < lower
    return False


@merged
def _turns(rates, begin, end, up, down):
    """Whether the rate changes its sign between two points of a step, upwards if ``up`` or downwards if ``down``."""
    before, found, rest = begin, False, load8(rates, 0)
    least, largest = min(begin, end, least8(rest)), max(begin, end, largest8(rest))
    for i in range(S + 1 if least < 0.0 < largest else 0):
        after = rates[i] if i < S else end
        found |= (up and before < 0.0 < after) or (down and before > 0.0 > after)
        before = after
    return found


@merged
def _passes_between(problem, tables, state, scratch, node_set, h, s, lower, upper):
    """Whether δ leaves [lower, upper] between two points of the step or at one."""
    motion = motion_of(problem, scratch, s)
    t, delta, rate = 0.0, scratch.start_motion[s, 0], scratch.start_motion[s, 1]
    for i in range(S + 1):
        if i < S:
            after, delta_new, rate_new = h * tables.times[node_set, i], motion[0, i], motion[1, i]
        else:
            after, delta_new = h, indentation(problem, s, scratch.x_new)
            rate_new = indentation_rate(problem, s, scratch.x_new)
        if _passes(after - t, delta, rate, delta_new, rate_new, lower, upper):
            return True
        t, delta, rate = after, delta_new, rate_new
    return False


@part(BOUNDS, types.void, REAL)
def _bound_rates(problem, tables, state, scratch, h):
    """Bounds of all rows' accelerations into ``per_row``; forces are taken as twice their largest node value."""
    n, rows = problem.k.size, problem.gap.size
    energy_norms(problem, state.x, scratch.norms)
    for r in range(rows):
        scratch.per_row[r] = 0.0
    for u in range(scratch.force.shape[0] if problem.table_dt.size else rows):
        if u < rows and not acts(problem, state, u):
            continue
        largest, push = 0.0, push_of(problem, u)
        for i in range(S):
            largest = max(largest, 2.0 * abs(scratch.force[u, i]))
        for b in range(n):
            scratch.norms[b] += h * largest * math.sqrt(push[n + b] ** 2 + problem.k[b] * push[b] ** 2)
        for r in range(rows):
            direct = tables.accelerance[r, u] if u < rows else tables.load_acceleration[r, u - rows]
            scratch.per_row[r] += largest * abs(direct)
    for r in range(rows):
        scratch.per_row[r] += dot(tables.acceleration_weight[r], scratch.norms, n)


@merged
def _stays_away(problem, state, scratch, s, h):
    """Whether a stop out of contact cannot be reached on the step; its motion is set to that at the start."""
    if is_circle(problem, s):
        return stays_in_circle(problem, state, scratch, s, h)
    delta, rate, row = scratch.start_motion[s, 0], scratch.start_motion[s, 1], row_of(problem, s)
    store8(scratch.motion[row, 0], 0, splat8(delta))
    store8(scratch.motion[row, 1], 0, splat8(rate))
    return delta + h * max(rate, 0.0) + 0.5 * h * h * scratch.per_row[row] < 0.0


@merged
def _watch(problem, tables, state, scratch, node_set, level, s, carried):
    """Motion at the nodes of a stop out of contact; returns whether the motion of the blocks has been computed."""
    through = uses_blocks(tables)
    if through and not carried:
        add_block_motion(problem, tables, state, scratch, node_set, level, CONTINUING, scratch.block_motion)
        add_block_motion(problem, tables, state, scratch, node_set, level, ENTERING, scratch.block_motion)
    for r in range(row_of(problem, s), row_of(problem, s + 1)):
        if through:
            motion_at_nodes(problem, scratch, r, problem.gap[r], scratch.motion[r])
        else:
            respond(problem, tables, state, scratch, node_set, level, r)
    if is_circle(problem, s):
        radial_nodes(problem, scratch, s)
    return carried or through


@part(LEAVES, types.boolean, types.int64, types.int64)
def leaves_segment(problem, tables, state, scratch, node_set, level):
    """Whether any stop may cross a border of its segment on the step."""
    h, through = tables.contact_step[level], uses_blocks(tables)
    carried = np.bool_(0)  # a literal would be compiled for itself
    if through:
        _bound_rates(problem, tables, state, scratch, h)
    for s in range(problem.law.size):
        segment, ripple = state.segment[s], 0.0
        upper, lower = problem.knots[s, segment], -np.inf
        if segment > 0 and problem.knots[s, segment - 1] == -np.inf and upper == np.inf:
            continue
        if segment == 0:
            if through and _stays_away(problem, state, scratch, s, h):
                continue
            carried = _watch(problem, tables, state, scratch, node_set, level, s, carried)
            alias = tables.alias[tables.kind[node_set], level]
            ripple = ripple_of_stop(problem, tables, s, alias, state.x)
        else:
            lower = problem.knots[s, segment - 1]
        motion = motion_of(problem, scratch, s)
        delta, within = indentation(problem, s, scratch.x_new), load8(motion[0], 0)
        lowest, highest = min(delta, least8(within)), max(delta, largest8(within))
        begin, end = scratch.start_motion[s, 1], indentation_rate(problem, s, scratch.x_new)
        turns = _turns(motion[1], begin, end, segment > 0, upper < np.inf)
        if not turns and lower <= lowest and highest + ripple <= upper:
            continue
        tolerance = 8.0 * surface_tolerance(problem, s, state.x)
        if not (lower - tolerance <= lowest and highest + ripple <= upper + tolerance):
            return True
        if segment == 0 and largest_indentation(problem, tables, state, scratch, node_set, h, s) > upper + tolerance:
            return True
        if _passes_between(problem, tables, state, scratch, node_set, h, s, lower - tolerance, upper + tolerance):
            return True
    return False


@inlined
def _sides(problem, tables, state, s, n, delta, rate, out):
    """δ̇, or the force before its cut, at n points with δ >= 0; the sign is the side of the bend."""
    if tables.bend[s] == RATE:
        copy(rate, out, n)
    else:
        call_force(tables.uncut[s], n, delta, rate, state.entry_rate[s], tables.uncut_parameters[s], (out,))


@part(SIDE, REAL, types.int64, VECTOR, VECTOR)
def side_at(problem, tables, state, s, x, batch):
    """The same in the state x."""
    batch[0] = max(indentation(problem, s, x), problem.knots[s, 0])
    batch[1] = indentation_rate(problem, s, x)
    _sides(problem, tables, state, s, 1, batch[0:1], batch[1:2], batch[2:3])
    return batch[2]


@inner
def choose_sides(problem, tables, state, scratch):
    """Find the side of its bend for every contact that begins now."""
    for s in range(problem.law.size):
        if tables.bend[s] > 0.0 and state.segment[s] > 0 and state.active[s, T_IN] == state.now[T]:
            scratch.side[s] = -1.0 if side_at(problem, tables, state, s, state.x, scratch.trial) < 0.0 else 1.0


@inner
def first_bend(problem, tables, state, scratch, node_set, level, is_new):
    """(time after the start of the step, stop) of the first bend on it; no stop is -1.

    A stop that begins on its bend (``is_new``), or was taken across it by the landing of another stop, gets the side of
    the first node. A bend of a rate, or force, within the tolerance is not an event.
    """
    first, stop, h = np.inf, -1, tables.contact_step[level]
    for s in range(problem.law.size):
        if tables.bend[s] == 0.0 or state.segment[s] == 0:
            continue
        values, begin = scratch.bend_values, side_at(problem, tables, state, s, state.x, scratch.trial)
        motion = motion_of(problem, scratch, s)
        above(motion[0], problem.knots[s, 0], scratch.clipped)
        _sides(problem, tables, state, s, S, scratch.clipped, motion[1], values)
        values[S] = side_at(problem, tables, state, s, scratch.x_new, scratch.trial)
        largest = abs(begin)
        for i in range(S + 1):
            largest = max(largest, abs(values[i]))
        harmless = scratch.force_tolerance[s]
        if tables.bend[s] == RATE:
            harmless = 0.01 * scratch.accuracy[RTOL] * scratch.reference_speed[s]
        if largest <= harmless:
            continue
        on = scratch.side[s] * begin < 0.0 or (is_new and abs(begin) <= _ON * largest)
        if on and scratch.side[s] * values[0] < -_SAME * largest:
            scratch.side[s] = -scratch.side[s]
        before, t = begin, 0.0
        for i in range(S + 1):
            after = h * tables.times[node_set, i] if i < S else h
            if scratch.side[s] * values[i] < -_SAME * largest:
                way = before / (before - values[i]) if scratch.side[s] * before > 0.0 else 0.0
                if t + way * (after - t) < first:
                    first, stop = t + way * (after - t), s
                    scratch.bend_values[S + 1] = largest
                break
            before, t = values[i], after
    return first, stop


@inner
def before_landing(problem, tables, state, scratch, stop, bends, w, x):
    """Other events between the states w and x, which end in times, besides the landing of ``stop``.

    Returns `CLEAR`, `TOO_LONG`, or another stop that has crossed a border of its segment. A peak must not lie within a
    landing, whose steps have no interpolant.
    """
    size, width = 2 * problem.k.size, state.x.size
    d = x[width] - w[width]
    long = d > 4.0 * tables.contact_step[tables.contact_step.size - 1]
    for s in range(problem.law.size):
        segment, slope_a, slope_b = state.segment[s], 0.0, 0.0
        if s != stop or bends:
            slope_a, slope_b = indentation_rate(problem, s, w), indentation_rate(problem, s, x)
        if s != stop:
            a, b = indentation(problem, s, w), indentation(problem, s, x)
            tolerance = surface_tolerance(problem, s, x)
            upper = problem.knots[s, segment] + tolerance
            lower = problem.knots[s, segment - 1] - tolerance if segment > 0 else -np.inf
            if not lower <= b <= upper:
                return s
            if long and _passes(d, a, slope_a, b, slope_b, lower, upper):
                return TOO_LONG
        if not long or segment == 0 or is_open(problem, s):
            continue
        if not begins_and_ends(problem, s):
            continue
        rest = (
            -_TOGETHER * slope_a if problem.opening[s] >= 0 else 0.0
        )  # a law that opens may have a border where δ̇ falls to zero
        if slope_a > 0.0 and slope_b < rest and (s != stop or tables.bend[s] != RATE):
            return TOO_LONG
        if s != stop and tables.bend[s] > 0.0:
            before = scratch.side[s] * side_at(problem, tables, state, s, w, scratch.trial)
            if scratch.side[s] * side_at(problem, tables, state, s, x, scratch.trial) < -_TOGETHER * abs(before):
                return TOO_LONG
        if not bends and tables.bend[s] == FORCE and _pulls_inside(scratch.stages, size + 3 + 2 * s, width):
            return TOO_LONG
        if force_turns(scratch.stages, size + 3 + 2 * s, width, state.active[s, PEAK_FORCE], 1.0):
            return TOO_LONG
    return CLEAR


@merged
def force_turns(work, column, width, known, sign):
    """Whether a force, the rate of the impulse over that of time, has a maximum above ``known`` inside a landing.

    It is the force times ``sign``.
    """
    if work[0, width] == 0.0 or _at_stage(work, column, width, sign, 0) < 0.5 * known:
        return False  # too far below the peak for a higher maximum, or it begins at an entry
    last, highest = STAGES - 1 if work[STAGES - 1, width] != 0.0 else STAGES - 2, known
    for i in range(1, last):
        if _at_stage(work, column, width, sign, i) > highest:
            highest = _at_stage(work, column, width, sign, i)
    ends = max(_at_stage(work, column, width, sign, 0), _at_stage(work, column, width, sign, last))
    if max(highest, ends) <= known:
        return False
    turns = highest > ends
    for i, j, k in ((0, 1, 2), (8, 10, last)):
        turns |= _turns_at(work, column, width, sign, i, j, k)
    return turns


@inlined
def _at_stage(work, column, width, sign, i):
    """A force, times the sign, at a stage."""
    return sign * work[i, column] / work[i, width]


@merged
def _pulls_inside(work, column, width):
    """Whether a law would pull at an inner stage of a landing."""
    pulls = False
    for i in range(1, STAGES - 1):
        pulls |= work[i, column] / work[i, width] < 0.0
    return pulls


@inlined
def _turns_at(work, column, width, sign, i, j, k):
    """Whether the parabola through a force at three stages has its maximum between them."""
    a, b = _at_stage(work, column, width, sign, i), _at_stage(work, column, width, sign, j)
    c = _at_stage(work, column, width, sign, k)
    rise, fall = (b - a) / (C[j] - C[i]), (c - b) / (C[k] - C[j])
    bend = (fall - rise) / (C[k] - C[i])
    return bend < 0.0 and rise - bend * (C[j] - C[i]) > 0.0 > fall + bend * (C[k] - C[j])
