"""Events within a step in contact: whether a stop leaves its segment of the law, or crosses a bend of the law.

All stops are checked, those out of contact included. Between two points of a step δ is the cubic through both values
and rates; around the highest node of a stop out of contact it is interpolated as in `peaks`. Such a stop must also keep
a distance of the ripple that fast modes may have between the nodes. With many stops, those that cannot reach their
surface by a bound of |δ̈| are not checked further.

A bend is a kink of the law that is not at a given indentation: at δ̇ = 0 of a law that damps on approach only, at F = 0
of a law that is cut where it would pull. Its event function is δ̇, or the force before the cut; the sign of this is the
side of the bend. No step crosses a bend; one step ends on it.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from solvers.compiled.dop853_tableau import STAGES, A, C
from solvers.compiled.kernels import (
    REAL,
    VECTOR,
    call_force,
    copy,
    dot,
    indentation,
    indentation_and_rate,
    indentation_rate,
    inlined,
    inner,
    is_circle,
    merged,
    push_of,
    row_of,
    surface_tolerance,
    work_column,
)
from solvers.compiled.parts import BOUNDS, LEAVES, SIDE, part
from solvers.compiled.simd import largest8, least8, load8, splat8, store8
from solvers.compiled.state import OUTSIDE, PEAK_FORCE, T_IN, T, acts, begins_and_ends, is_open
from solvers.compiled.sums import above, combine
from solvers.exponential.circles.contact import radial_nodes, stays_in_circle
from solvers.exponential.contact.many_stops import CONTINUING, ENTERING, add_block_motion, motion_at_nodes, uses_blocks
from solvers.exponential.contact.node_response import (
    DELTAS,
    DIFFERENCE,
    RATES,
    RTOL,
    motion_of,
    note_oscillation,
    rate_ripple_of,
    respond,
    ripple_of,
    ripple_of_stop,
    shortest_step,
    swing_of,
)
from solvers.exponential.contact.nodes import LOCAL, S
from solvers.exponential.contact.peaks import largest_indentation, maximum_and_place, motion_around
from solvers.exponential.flight import energy_norms
from solvers.exponential.tables import DAMPING, EXPONENT, FACTOR, FORCE, RATE, STIFFNESS

CLEAR, TOO_LONG = -1, -2  # results of `before_landing`: no other event, or one that requires shorter steps
UNRESOLVED = -2  # in place of a stop or element: the step is too long to tell whether it crosses a bend or border
# event functions of bends, and margins of borders, in units of their largest on the step:
ROUNDING = 1e-11  # up to which they may be rounding
ON_BORDER = 1e-9  # up to which a step counts as begun on the bend or border
WATCHED_BELOW = 0.2  # at a node, below which the motion around the node is evaluated
REST = 1e-14  # rate, in units of the reference speed, below which a rate at rest is rounding
_AS_ANOTHER_LANDS = 1e-6  # event function, relative to its value at the start, by which a bend may be crossed then
_WITHIN = 8  # a stage of DOP853 inside its step, at 0.65
_JUST_INSIDE = 1e-3  # δ, in units of that at the start of a landing on δ = 0, at which the sign of a force is told


@inner
def extremum(d, a, slope_a, b, slope_b):
    """Extremum on [0, d] of the cubic through (0, a) and (d, b) with given slopes of opposite signs."""
    mean = (b - a) / d
    c2 = (3.0 * mean - 2.0 * slope_a - slope_b) / d
    c3 = (slope_a + slope_b - 2.0 * mean) / (d * d)
    root = math.sqrt(max(c2 * c2 - 3.0 * c3 * slope_a, 0.0))
    x = slope_a / (root - c2 if slope_a > 0.0 else -root - c2)
    x = min(max(x, 0.0), d)
    return a + x * (slope_a + x * (c2 + x * c3))


@inlined
def _cubic_leaves(d, a, slope_a, b, slope_b, lower, upper):
    """Whether the cubic through (0, a) and (d, b) with given slopes leaves [lower, upper] between them or at d."""
    if not lower <= b <= upper:
        return True
    if slope_a > 0.0 > slope_b:
        return extremum(d, a, slope_a, b, slope_b) > upper
    if slope_a < 0.0 < slope_b:
        return extremum(d, a, slope_a, b, slope_b) < lower
    return False


@merged
def _rate_changes_sign(rates, begin, end, up, down):
    """Whether δ̇ changes its sign between two points of a step, upwards if ``up``, or downwards if ``down``."""
    before, found, inner = begin, False, load8(rates, 0)
    least, largest = min(begin, end, least8(inner)), max(begin, end, largest8(inner))
    for i in range(S + 1 if least < 0.0 < largest else 0):
        after = rates[i] if i < S else end
        found |= (up and before < 0.0 < after) or (down and before > 0.0 > after)
        before = after
    return found


@merged
def _leaves_between_points(run, node_set, h, s, lower, upper):
    """Whether δ of stop s leaves [lower, upper] at a node or the end of the step, or between two of them."""
    scratch = run.scratch
    motion = motion_of(run, s)
    t, delta, rate = 0.0, scratch.start_motion[s, 0], scratch.start_motion[s, 1]
    for i in range(S + 1):
        if i < S:
            after, delta_new, rate_new = h * run.tables.times[node_set, i], motion[0, i], motion[1, i]
        else:
            after, delta_new = h, indentation(run.problem, s, scratch.x_new)
            rate_new = indentation_rate(run.problem, s, scratch.x_new)
        if _cubic_leaves(after - t, delta, rate, delta_new, rate_new, lower, upper):
            return True
        t, delta, rate = after, delta_new, rate_new
    return False


@part(BOUNDS, types.void, REAL)
def _bound_rates(run, h):
    """Bounds of |δ̈| of all rows on the step into ``per_row``, m/s², with forces of twice their largest node value."""
    problem, tables, scratch = run.problem, run.tables, run.scratch
    n, rows = problem.k.size, problem.gap.size
    energy_norms(problem, run.state.x, scratch.norms)
    for r in range(rows):
        scratch.per_row[r] = 0.0
    for u in range(scratch.force.shape[0] if problem.table_dt.size else rows):
        if u < rows and not acts(problem, run.state, u):
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
def _cannot_reach(run, s, h):
    """Whether a stop out of contact cannot be reached on the step; its motion is set to that at the start."""
    scratch = run.scratch
    if is_circle(run.problem, s):
        return stays_in_circle(run, s, h)
    delta, rate, row = scratch.start_motion[s, 0], scratch.start_motion[s, 1], row_of(run.problem, s)
    store8(scratch.motion[row, 0], 0, splat8(delta))
    store8(scratch.motion[row, 1], 0, splat8(rate))
    return delta + h * max(rate, 0.0) + 0.5 * h * h * scratch.per_row[row] < 0.0


@merged
def _follow(run, node_set, level, s, forces_added):
    """Compute the motion of a stop out of contact at the nodes.

    With many stops the response to the forces is first added to the motion of the blocks, unless ``forces_added``;
    returns whether it has been.
    """
    problem, scratch = run.problem, run.scratch
    by_blocks = uses_blocks(run.tables)
    if by_blocks and not forces_added:
        add_block_motion(run, node_set, level, CONTINUING, scratch.block_motion)
        add_block_motion(run, node_set, level, ENTERING, scratch.block_motion)
    for r in range(row_of(problem, s), row_of(problem, s + 1)):
        if by_blocks:
            motion_at_nodes(run, r, problem.gap[r], scratch.motion[r])
        else:
            respond(run, node_set, level, r)
    if is_circle(problem, s):
        radial_nodes(run, s)
    return forces_added or by_blocks


@part(LEAVES, types.boolean, types.int64, types.int64)
def leaves_segment(run, node_set, level):
    """Whether any stop may cross a border of its segment on the step."""
    problem, tables, state = run.problem, run.tables, run.state
    h, by_blocks = tables.contact_step[level], uses_blocks(tables)
    forces_added = np.bool_(0)  # a literal would be compiled for itself
    if by_blocks:
        _bound_rates(run, h)
    for s in range(problem.law.size):
        segment, ripple = state.segment[s], 0.0
        upper, lower = problem.knots[s, segment], -np.inf
        if segment > 0 and problem.knots[s, segment - 1] == -np.inf and upper == np.inf:
            continue
        if segment == 0:
            if by_blocks and _cannot_reach(run, s, h):
                continue
            forces_added = _follow(run, node_set, level, s, forces_added)
            alias = tables.alias[tables.kind[node_set], level]
            ripple = ripple_of_stop(run, s, alias)
        else:
            lower = problem.knots[s, segment - 1]
        motion = motion_of(run, s)
        (delta, end), within = indentation_and_rate(problem, s, run.scratch.x_new), load8(motion[0], 0)
        lowest, highest = min(delta, least8(within)), max(delta, largest8(within))
        sign_changes = _rate_changes_sign(motion[1], run.scratch.start_motion[s, 1], end, segment > 0, upper < np.inf)
        if not sign_changes and lower <= lowest and highest + ripple <= upper:
            continue
        tolerance = OUTSIDE * surface_tolerance(problem, s, state.x)
        if not (lower - tolerance <= lowest and highest + ripple <= upper + tolerance):
            return True
        if segment == 0 and largest_indentation(run, node_set, h, s) > upper + tolerance:
            return True
        if _leaves_between_points(run, node_set, h, s, lower - tolerance, upper + tolerance):
            return True
    return False


@inlined
def time_of_place(tables, node_set, h, i, place):
    """Time after the start of the step of a place, -1 to 1, in the interval around node i."""
    begin, end = tables.local_interval[node_set, i, 0], tables.local_interval[node_set, i, 1]
    return h * (begin + 0.5 * (place + 1.0) * (end - begin)) ** tables.time_exponent[node_set]


@inlined
def power_force(tables, s, delta, rate, entry_rate):
    """Force, N, of stop s by its power law before a cut at zero, without a call; δ >= 0."""
    law = tables.power_law[s]
    elastic = law[STIFFNESS] * (delta * math.sqrt(delta) if law[EXPONENT] == 1.5 else delta)
    return elastic * (1.0 + law[FACTOR] / entry_rate * rate) + law[DAMPING] * rate


@inlined
def _sides(run, s, n, delta, rate, out):
    """Event function of a bend, δ̇ or the force before its cut, at n points with δ >= 0, into ``out``."""
    tables = run.tables
    if tables.bend[s] == RATE:
        copy(rate, out, n)
    elif tables.power_law[s, EXPONENT] > 0.0:
        for i in range(n):
            out[i] = power_force(tables, s, delta[i], rate[i], run.state.entry_rate[s])
    else:
        call_force(tables.uncut[s], n, delta, rate, run.state.entry_rate[s], tables.uncut_parameters[s], (out,))


@part(SIDE, REAL, types.int64, VECTOR, VECTOR)
def side_at(run, s, x, batch):
    """The same in the state x; ``batch`` holds three numbers."""
    problem = run.problem
    batch[0] = max(indentation(problem, s, x), problem.knots[s, 0])
    batch[1] = indentation_rate(problem, s, x)
    _sides(run, s, 1, batch[0:1], batch[1:2], batch[2:3])
    return batch[2]


@inner
def choose_sides(run):
    """Set the side of its bend for every contact that begins now."""
    state = run.state
    for s in range(run.problem.law.size):
        if run.tables.bend[s] > 0.0 and state.segment[s] > 0 and state.active[s, T_IN] == state.now[T]:
            run.scratch.side[s] = -1.0 if side_at(run, s, state.x, run.scratch.trial) < 0.0 else 1.0


@inner
def first_bend(run, node_set, level, is_new):
    """(time after the start of the step, stop) of the first bend that the step just tried crosses, or (inf, -1).

    The stop is `UNRESOLVED` if fast blocks, which the nodes do not resolve, may cross one between them and back.
    A stop that begins on its bend (``is_new``), or has crossed it as another stop landed, gets the side of the first
    node. An event function within its tolerance crosses nothing.
    """
    tables, scratch = run.tables, run.scratch
    first, stop, h = np.inf, -1, tables.contact_step[level]
    for s in range(run.problem.law.size):
        if tables.bend[s] == 0.0 or run.state.segment[s] == 0:
            continue
        values, begin = scratch.bend_values, side_at(run, s, run.state.x, scratch.trial)
        motion = motion_of(run, s)
        above(motion[0], run.problem.knots[s, 0], scratch.clipped)
        _sides(run, s, S, scratch.clipped, motion[1], values)
        values[S] = side_at(run, s, scratch.x_new, scratch.trial)
        largest = abs(begin)
        for i in range(S + 1):
            largest = max(largest, abs(values[i]))
        negligible = scratch.force_tolerance[s]
        if tables.bend[s] == RATE:
            negligible = 0.01 * scratch.accuracy[RTOL] * scratch.reference_speed[s]
        if largest <= negligible:
            continue
        begins_on = scratch.side[s] * begin < 0.0 or (is_new and abs(begin) <= ON_BORDER * largest)
        if begins_on and scratch.side[s] * values[0] < -ROUNDING * largest:
            scratch.side[s] = -scratch.side[s]
        time = _bend_at_nodes(run, node_set, h, s, begin, largest)
        if time == np.inf:
            time = _bend_between_nodes(run, node_set, h, s, begin, largest)
        resolved = level == tables.contact_step.size - 1 or tables.aliased[tables.kind[node_set], level] == 0.0
        if time == np.inf and not resolved and _may_hide_bend(run, node_set, level, s, negligible):
            return np.inf, UNRESOLVED
        if time < first:
            first, stop = time, s
            scratch.bend_values[S + 1] = largest
    return first, stop


@inlined
def _bend_at_nodes(run, node_set, h, s, begin, largest):
    """Time after the start at which the event function of stop s has changed sides at a node or the end, or inf."""
    values, side, before, t = run.scratch.bend_values, run.scratch.side[s], begin, 0.0
    for i in range(S + 1):
        after = h * run.tables.times[node_set, i] if i < S else h
        if side * values[i] < -ROUNDING * largest:
            share = before / (before - values[i]) if side * before > 0.0 else 0.0
            return t + share * (after - t)
        before, t = values[i], after
    return np.inf


@inner
def _bend_between_nodes(run, node_set, h, s, begin, largest):
    """The time of a minimum between nodes on the wrong side, where all nodes are on the right one; or inf."""
    scratch = run.scratch
    values, side, there = scratch.bend_values, scratch.side[s], scratch.numbers
    tolerance = max(ROUNDING * largest, -2.0 * side * begin)
    for i in range(S):
        before, after = values[i - 1] if i > 0 else begin, values[i + 1]
        if side * values[i] > min(side * before, side * after, WATCHED_BELOW * largest):
            continue
        motion_around(run, node_set, h, s, i)
        above(scratch.local_motion[DELTAS], run.problem.knots[s, 0], scratch.clipped)
        _sides(run, s, S, scratch.clipped, scratch.local_motion[RATES], there)
        for j in range(S):
            there[j] *= -side
        deep, place = maximum_and_place(there, 1.0, scratch.clipped)
        if deep > tolerance and place > LOCAL[0]:
            return time_of_place(run.tables, node_set, h, i, place)
    return np.inf


@inner
def _may_hide_bend(run, node_set, level, s, negligible):
    """Whether fast blocks may take the event function of stop s to the other side by more than ``negligible``.

    It comes nearest to that at one of the nodes, or at the end of the step. There it is evaluated again with the ripple
    of δ and of δ̇, at last that of what does not follow the forces.
    """
    scratch, alias = run.scratch, run.tables.alias[run.tables.kind[node_set], level]
    values, side, nearest = scratch.bend_values, scratch.side[s], 0
    for i in range(1, S):
        if side * values[i] < side * values[nearest]:
            nearest = i
    ripple = _ripple_of_bend(run, s, swing_of(run), alias, nearest)
    lowest = min(side * values[nearest], side * values[S])
    if ripple <= max(lowest, negligible) or node_set > 0:
        return ripple > max(lowest, negligible)
    note_oscillation(run, level)
    return _ripple_of_bend(run, s, scratch.oscillation, alias, nearest) > max(lowest, negligible)


@inner
def _ripple_of_bend(run, s, x, alias, node):
    """Change of the event function of stop s at a node by the ripple of δ and of δ̇, where blocks oscillate by x."""
    scratch, first = run.scratch, row_of(run.problem, s)
    delta, rate, motion = scratch.local_motion[DELTAS], scratch.local_motion[RATES], motion_of(run, s)
    for i in range(3):
        delta[i], rate[i] = max(motion[0, node], run.problem.knots[s, 0]), motion[1, node]
    for r in range(first, first + (2 if is_circle(run.problem, s) else 1)):
        delta[1] += ripple_of(run, x, r, alias)
        rate[2] += rate_ripple_of(run, x, r, alias)
    _sides(run, s, 3, delta[:3], rate[:3], scratch.numbers[:3])
    return abs(scratch.numbers[1] - scratch.numbers[0]) + abs(scratch.numbers[2] - scratch.numbers[0])


@inlined
def _error_of_cubic(run, s, w, d, a, slope_a, b, slope_b):
    """Largest error on a landing of length d of the cubic for δ of stop s, m, by the rate at one stage inside.

    The cubic through (0, a) and (d, b) with these slopes errs by M t²(d - t)² where δ⁗ is constant; M follows from the
    difference of its slope from δ̇ at the stage.
    """
    stages, width = run.scratch.stages, run.state.x.size
    inside = stages[DIFFERENCE]
    combine(stages, A[_WITHIN], _WITHIN, w, inside)
    mean, y = (b - a) / d, (inside[width] - w[width]) / d
    slope = slope_a + y * (6.0 * mean - 4.0 * slope_a - 2.0 * slope_b + 3.0 * y * (slope_a + slope_b - 2.0 * mean))
    rate = indentation_rate(run.problem, s, inside)
    return abs(rate - slope) * d / (32.0 * y * (1.0 - y) * max(abs(1.0 - 2.0 * y), 0.1))


@inlined
def _leaves_on_landing(run, s, w, x, slopes, long):
    """Stop s if its δ has left its segment where a landing ends, `TOO_LONG` if it may have done so in between.

    Else `CLEAR`. ``slopes`` are its δ̇ in the states w and x; a landing that is not ``long`` is not looked into.
    """
    problem = run.problem
    width, segment = run.state.x.size, run.state.segment[s]
    a, b, tolerance = indentation(problem, s, w), indentation(problem, s, x), surface_tolerance(problem, s, x)
    upper = problem.knots[s, segment] + tolerance
    lower = problem.knots[s, segment - 1] - tolerance if segment > 0 else -np.inf
    if not lower <= b <= upper:
        return s
    if long and slopes[0] * slopes[1] < 0.0:
        d, top = x[width] - w[width], slopes[0] > 0.0
        turned = extremum(d, a, slopes[0], b, slopes[1])
        error = _error_of_cubic(run, s, w, d, a, slopes[0], b, slopes[1])
        if turned + error > upper if top else turned - error < lower:
            return TOO_LONG
    return CLEAR


@inlined
def _crosses_bend(run, s, w, x):
    """Whether a stop crosses its bend on a landing that is not on it."""
    problem, scratch = run.problem, run.scratch
    side = scratch.side[s]
    before = side * side_at(run, s, w, scratch.trial)
    if side * side_at(run, s, x, scratch.trial) < -_AS_ANOTHER_LANDS * abs(before):
        return True
    turns = run.tables.bend[s] == RATE and not is_circle(problem, s)
    return turns and _turns_inside(problem, scratch.stages, s, side, _AS_ANOTHER_LANDS * abs(before), run.state.x.size)


@inlined
def _passes_cut(run, stop, s, w, x):
    """Whether a force that is cut at zero falls to zero, or is no longer cut, on a landing of ``stop`` on a knot.

    The force of a light dashpot may change its sign behind the last stage.
    """
    scratch = run.scratch
    if _pulls_inside(scratch.stages, work_column(run.problem, s) + 1, run.state.x.size):
        return True
    if s != stop:
        return False
    if scratch.side[s] > 0.0:
        return side_at(run, s, x, scratch.trial) < 0.0
    return scratch.side[s] < 0.0 and _pushes_at_end(run, s, w, x)


@inlined
def _peaks_on_landing(run, stop, s, slopes):
    """Whether δ or the force of stop s has a maximum inside a landing; δ of one with a bend at δ̇ = 0 may end on it."""
    # a law that opens may have a border where δ̇ falls to zero
    rest = -_AS_ANOTHER_LANDS * slopes[0] if run.problem.opening[s] >= 0 else 0.0
    if slopes[0] > 0.0 and slopes[1] < rest and (s != stop or run.tables.bend[s] != RATE):
        return True
    column, known = work_column(run.problem, s) + 1, run.state.active[s, PEAK_FORCE]
    return force_turns(run.scratch.stages, column, run.state.x.size, known, 1.0)


@inner
def before_landing(run, stop, bends, w, x):
    """Whether anything but the landing of ``stop`` happens between the states w and x, which end in times.

    Returns `CLEAR`, `TOO_LONG`, or another stop that has left its segment. ``bends`` tells that the landing is on a
    bend or border; then a maximum of δ of ``stop`` counts, too. No peak may lie inside a landing, which has no dense
    output.
    """
    problem, tables = run.problem, run.tables
    width = run.state.x.size
    long = x[width] - w[width] > 4.0 * shortest_step(tables)
    for s in range(problem.law.size):
        slopes = 0.0, 0.0
        if s != stop or bends:
            slopes = indentation_rate(problem, s, w), indentation_rate(problem, s, x)
        if s != stop:
            found = _leaves_on_landing(run, s, w, x, slopes, long)
            if found != CLEAR:
                return found
        if not long or run.state.segment[s] == 0 or is_open(problem, s) or not begins_and_ends(problem, s):
            continue
        if s != stop and tables.bend[s] > 0.0 and _crosses_bend(run, s, w, x):
            return TOO_LONG
        if not bends and tables.bend[s] == FORCE and _passes_cut(run, stop, s, w, x):
            return TOO_LONG
        if _peaks_on_landing(run, stop, s, slopes):
            return TOO_LONG
    return CLEAR


@merged
def _pushes_at_end(run, s, w, x):
    """Whether a law that is cut at zero in the state w pushes just inside of where a landing ends, in the state x."""
    problem = run.problem
    batch = run.scratch.trial
    batch[0] = max(indentation(problem, s, x), _JUST_INSIDE * indentation(problem, s, w))
    batch[1] = indentation_rate(problem, s, x)
    _sides(run, s, 1, batch[0:1], batch[1:2], batch[2:3])
    return batch[2] > 0.0


@merged
def force_turns(work, column, width, known, sign):
    """Whether ``sign`` times a force has a maximum above ``known`` inside the landing just taken.

    At a stage the force is the rate of its impulse, in a ``column`` of the stages, over that of time, in column
    ``width``.
    """
    if work[0, width] == 0.0:
        return False  # it begins at an entry
    begun = max(_force_at_stage(work, column, width, sign, 0), _force_at_stage(work, column, width, sign, _WITHIN))
    if begun < 0.5 * known:
        return False  # it is too far below the peak for a higher maximum
    last, highest = STAGES - 1 if work[STAGES - 1, width] != 0.0 else STAGES - 2, known
    for i in range(1, last):
        if _force_at_stage(work, column, width, sign, i) > highest:
            highest = _force_at_stage(work, column, width, sign, i)
    ends = max(_force_at_stage(work, column, width, sign, 0), _force_at_stage(work, column, width, sign, last))
    if max(highest, ends) <= known:
        return False
    turns = highest > ends
    for i, j, k in ((0, 1, 2), (8, 10, last)):
        turns |= _has_maximum(work, column, width, sign, i, j, k)
    return turns


@inlined
def _force_at_stage(work, column, width, sign, i):
    """``sign`` times a force, N, at stage i."""
    return sign * work[i, column] / work[i, width]


@merged
def _pulls_inside(work, column, width):
    """Whether the force of a law is negative at an inner stage of a landing."""
    pulls = False
    for i in range(1, STAGES - 1):
        pulls |= work[i, column] / work[i, width] < 0.0
    return pulls


@inner
def _turns_inside(problem, work, s, side, allowed, width):
    """Whether δ̇ of a stop is on the wrong ``side`` by more than ``allowed`` at an inner stage of a landing."""
    turns = False
    for i in range(1, STAGES - 1):
        turns |= side * dot(problem.read[row_of(problem, s)], work[i], 2 * problem.k.size) / work[i, width] < -allowed
    return turns


@inlined
def _has_maximum(work, column, width, sign, i, j, k):
    """Whether the parabola through a force at stages i, j, k has its maximum between them."""
    a, b = _force_at_stage(work, column, width, sign, i), _force_at_stage(work, column, width, sign, j)
    c = _force_at_stage(work, column, width, sign, k)
    rise, fall = (b - a) / (C[j] - C[i]), (c - b) / (C[k] - C[j])
    bend = (fall - rise) / (C[k] - C[i])
    return bend < 0.0 and rise - bend * (C[j] - C[i]) > 0.0 > fall + bend * (C[k] - C[j])
