"""A contact step: the linear structure is propagated exactly, the force alone is collocated.

On a step of length h the unknowns are the forces at S nodes of every stop in contact, whatever the number of modes:

    δ(t_i) = free response + Σ_u Σ_j C_ij F_uj,   the same for δ̇,   F_sj ← law_s(δ(t_j), δ̇(t_j))

The iteration begins with the extrapolated polynomial of the step before. The state at the end is the free response plus
the response to the forces. The first step of a law with broken powers of δ uses t = h σ^κ and F = σ^λ g(σ), which
restores full order at the singular start (see `nodes`); the last one, onto δ = 0, is a Runge–Kutta step in δ^{1/κ} (see
`landing`).

Error estimate: let A₁ be the larger of the last two Jacobi coefficients of the force, in size, and A₂ the larger of the
two before them. The part of the force that the polynomial leaves out is estimated by A₁ max((A₁/A₂)^{S/2}, A₁/F_max).
Its effect on the indentation rate of every stop, in contact or not, is compared with rtol × the reference speed of that
stop. The stop's own dashpot damps this error up to the end of the step, less if the stop is being left. Added are the
force by the oscillation of modes too fast for the nodes, without what follows the forces of a step with smooth nodes;
in the first step of a contact or segment also by what the force sets swinging, which the state does not show yet; and
the part of the sampled signals that their polynomials leave out, for which all nodes of their tables are compared; this
part is also compared with the motion of the blocks that a signal drives, which need not move a stop. A kink of the law
between an end of the step and the nearest node does not show in the coefficients; there the law is compared with the
polynomial. A mode that the force it makes between the nodes would move by as much as it swings shortens the step, too,
see `tables.reactions`.

In this error, what a light element takes from a heavy structure is lost. So, where the slope of a law with memory
changes on the step, the part left out must also be below 10 rtol of the largest force, or below the rounding of the
force. Where the slope is constant, the force is as exact as the motion. On an entry step, whose nodes are no rule of
high order for the works of other elements, the same holds for all that have memory.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from solvers.compiled.kernels import (
    REAL,
    abs_dot,
    contact_forces,
    contact_gradient,
    copy,
    element_of,
    indentation,
    indentation_and_rate,
    indentation_rate,
    inlined,
    inner,
    is_circle,
    merged,
    off_knots,
    place_of,
    row_of,
    rubs,
    slider_of,
    surface_tolerance,
)
from solvers.compiled.parts import ERROR, SOLVE, part
from solvers.compiled.simd import largest8, least8, load8
from solvers.compiled.state import CALLS, LAST_EVENT, T_END, T, acts, rate_tolerance
from solvers.compiled.sums import combine, iterate_power_law, replace_values
from solvers.exponential.contact.first_step import NEW
from solvers.exponential.contact.many_stops import add_end_response, pair_response, uses_blocks, weighting_of
from solvers.exponential.contact.node_newton import MOST_ITERATIONS, newton
from solvers.exponential.contact.node_response import (
    FORCES,
    LEFT_BY_ITERATION,
    RTOL,
    STRAIGHT,
    error_of_work,
    force_of,
    force_ripple_of,
    largest_size,
    law_slopes_at_nodes,
    motion_of,
    node_forces,
    note_oscillation,
    own_accelerance,
    respond_all,
    swing_of,
    unresolved_part,
    unresolved_signal,
)
from solvers.exponential.contact.nodes import AT_BEGIN, AT_END, S
from solvers.exponential.tables import DAMPING, EXPONENT, FACTOR, FORCE, STIFFNESS
from solvers.problem.friction import STIFFNESS as FRICTION_STIFFNESS

_END_ERROR, _INNER_ERROR = 1.5e-19, 2.7e-11  # of ẍ = -ω² x: at the end, over (ωh)^17; inside, over (ωh)^9; ωh < 6
_TOO_MUCH, _LITTLE = 6.0, 0.03  # part of a force left out, in its tolerances: what may be rounding, and what is kept
_OF_SURFACE, _FLOOR = 0.2, 1e-20  # rounding of δ at a node, in units of `surface_tolerance` without its floor, m
_MEAN_OF_RIPPLE = 0.03  # of what oscillates between the nodes: what a step's mean force misses
_SHARE_OF_BLOCKS = 0.01  # the derivative of a run may err by a hundred tolerances of the motion
_FADED, _MOST_RADIANS = 100.0, 1e5  # e^-100 counts as zero; more radians in a run take over 25 000 steps


@merged
def _single_power_law(run):
    """The stop in contact, if it is the only one, on a line, frictionless, with a tabulated power law; else -1."""
    alone, count = -1, 0
    for s in range(run.state.segment.size):
        if run.state.segment[s] > 0:
            alone, count = s, count + 1
    inlined_law = count == 1 and run.tables.power_law[alone, EXPONENT] > 0.0 and not is_circle(run.problem, alone)
    inlined_law &= not rubs(run.problem, alone)
    return alone if inlined_law else -1


@merged
def _iterate(run, node_set, level):
    """One fixed-point iteration for the forces of all stops in contact.

    Returns Σ change² and Σ force² over the nodes, in units of `Scratch.force_tolerance`.
    """
    problem, scratch = run.problem, run.scratch
    change, largest = 0.0, 0.0
    respond_all(run, node_set, level)
    for s in range(problem.law.size):
        if run.state.segment[s] > 0:
            node_forces(run, s)
            unit = 1.0 / scratch.force_tolerance[s] ** 2
            for r in range(row_of(problem, s), row_of(problem, s + 1)):
                moved, size = replace_values(scratch.force[r], scratch.law_force[r])
                change, largest = change + moved * unit, largest + size * unit
    return change, largest


@merged
def _set_accuracy(run, h):
    """Set each stop's force tolerance, N: it changes no indentation rate by more than a twentieth of its tolerance.

    Returns whether a dashpot is so strong that the fixed-point iteration would diverge, by its slope in the last Newton
    iteration.
    """
    problem, scratch = run.problem, run.scratch
    stiff = False
    for s in range(problem.law.size):
        if run.state.segment[s] > 0:
            sensitivity = 1e-300
            for u in range(row_of(problem, s), row_of(problem, s + 1)):
                for r in range(problem.gap.size):
                    sensitivity = max(
                        sensitivity, abs(run.tables.accelerance[r, u]) / scratch.reference_speed[element_of(problem, r)]
                    )
                copy(scratch.force[u], scratch.guess[u], S)
            scratch.force_tolerance[s] = LEFT_BY_ITERATION * scratch.accuracy[RTOL] / (h * sensitivity)
            stiff |= h * own_accelerance(run, s) * scratch.viscous[s] > 1.0
    for s in range(problem.law.size if not stiff else 0):
        scratch.viscous[s] = 0.0
    return stiff


@inlined
def _is_last(change, before):
    """Whether the changes of the forces still to come add up to less than the tolerance, 1.

    They are a geometric series with the sum change r/(1 - r), r = change/before, taken as 0.9 where it is larger.
    """
    return change * change <= max(before - change, change / 9.0)


@part(SOLVE, types.boolean, types.int64, types.int64)
def solve_forces(run, node_set, level):
    """Solve for the forces by fixed-point iteration, else by Newton's method; returns whether this has converged."""
    tables, scratch = run.tables, run.scratch
    if _set_accuracy(run, tables.contact_step[level]):
        return newton(run, node_set, level)
    before, alone = 0.0, _single_power_law(run)
    s = max(alone, 0)  # without such a stop what follows is not used
    law, row, unit = tables.power_law[s], row_of(run.problem, s), 1.0 / scratch.force_tolerance[s] ** 2
    own = pair_response(run, node_set, level, row, row)
    stiffness, rooted, damping = law[STIFFNESS], law[EXPONENT] == 1.5, law[DAMPING]
    factor, cut = law[FACTOR] / run.state.entry_rate[s], tables.bend[s] == FORCE
    for iteration in range(MOST_ITERATIONS):
        if alone >= 0:
            change, largest = iterate_power_law(
                *(own, scratch.free[row], scratch.force[row], scratch.motion[row]),
                *(stiffness, rooted, factor, damping, cut),
            )
            change, largest = change * unit, largest * unit
            run.state.count[CALLS] += S
        else:
            change, largest = _iterate(run, node_set, level)
        if not change < np.inf:
            break
        if iteration == 0:
            before = change / 0.09  # a usual ratio of two changes, 0.3, squared
        # squares; a change above 20 tolerances is not the last one, as if no ratio r were below 1/21
        if change <= 1e-27 * largest or (change <= 400.0 and _is_last(math.sqrt(change), math.sqrt(before))):
            return True
        if iteration > 2 and change > 0.36 * before:  # r > 0.6
            break
        before = change
    for r in range(run.problem.gap.size):
        copy(scratch.guess[r], scratch.force[r], S)
    return newton(run, node_set, level)


@merged
def _largest_force(run, s):
    """Largest force of a stop on the step, N, and its stiffness ∂F/∂δ there, N/m."""
    force, motion = force_of(run, s), motion_of(run, s)
    if run.problem.knots[s, 0] == 0.0:
        largest = max(largest8(load8(force, 0)), 0.0)
        return largest, run.tables.exponent[s] * largest / max(largest8(load8(motion[0], 0)), 1e-300)
    law_slopes_at_nodes(run, s)
    return largest_size(force), largest_size(run.scratch.slope[s, 0])


@inlined
def _slope_changes(slope, largest):
    """Whether a slope of the law changes on the step; otherwise its force and work are as exact as the motion."""
    return largest8(load8(slope, 0)) - least8(load8(slope, 0)) > STRAIGHT * largest


@merged
def _left_out(run, node_set, u, largest):
    """Estimate of the part of the force on row u, N, that its polynomial leaves out.

    On an entry step the nodes are those of Gauss's rule for the stop that enters, not for the others, whose forces are
    estimated at half the order.
    """
    scratch = run.scratch
    s = element_of(run.problem, u)
    if node_set == 0 or s == node_set - 1:
        left_out = unresolved_part(scratch.summary[u], largest, S // 2)
    else:
        combine(run.tables.tail[node_set], scratch.force[u], S, None, scratch.trial)
        left_out = unresolved_part(scratch.trial, largest, 1)
    if node_set == 0 and u == row_of(run.problem, s) and run.tables.power_law[s, EXPONENT] == 0.0:
        left_out += 0.01 * _hidden_kink(run, s, largest)
    return left_out


@merged
def _memory_error(run, node_set, s, left_out, largest, stiffness):
    """Error of the work of element s by the part of its force left out, in units of its tolerance; 0 without memory."""
    problem, scratch = run.problem, run.scratch
    error = 0.0
    if node_set > 0 and s != node_set - 1 and problem.border_count[s] > 0:
        error = error_of_work(run, s, left_out, largest, (stiffness, 0.0))
    elif node_set == 0 and problem.border_count[s] > 0 and problem.knots[s, 0] < 0.0:
        viscous = largest_size(scratch.slope[s, 1])
        if _slope_changes(scratch.slope[s, 0], stiffness) or _slope_changes(scratch.slope[s, 1], viscous):
            error = error_of_work(run, s, left_out, largest, (stiffness, viscous))
    return error


@merged
def _find_unresolved(run, node_set, level, u):
    """Write the impulse, N s, that the polynomial of the force on row u leaves out into ``scratch.unresolved``.

    Returns its `_memory_error`.
    """
    problem, tables, scratch = run.problem, run.tables, run.scratch
    s, h = element_of(problem, u), tables.contact_step[level]
    combine(tables.summary[node_set], scratch.force[u], S, None, scratch.summary[u])
    if is_circle(problem, s) and u == row_of(problem, s):
        own = place_of(problem, s)
        combine(tables.summary[node_set], scratch.law_force[own], S, None, scratch.summary[own])
    largest, stiffness = _largest_force(run, s)
    unresolved, error = _left_out(run, node_set, u, largest), 0.0
    if unresolved != 0.0:
        error = _memory_error(run, node_set, s, unresolved, largest, stiffness)
        if unresolved > _TOO_MUCH * scratch.force_tolerance[s]:
            rounding = _force_rounding(run, s)
            unresolved = max(unresolved - rounding, _LITTLE * scratch.force_tolerance[s])
        damped = scratch.viscous[s] > 0.0 and not is_circle(problem, s)  # nothing damps motion across a radius
        if rubs(problem, s):
            damped, stiffness = False, max(stiffness, slider_of(problem, s)[FRICTION_STIFFNESS])
        ripple, gain = _ripple_of_force(run, node_set, level, u, unresolved, stiffness)
        span = h * _undamped_part(run, node_set, h, s) if damped else h
        scratch.unresolved[u] = span * (unresolved + _MEAN_OF_RIPPLE * ripple)
        error = max(error, gain**S)  # a limit: steps grow as if errors fell like a high power of their length
    return error


@inlined
def _damping_of(run, s):
    """Largest slope of the force of element s by its rate at the nodes, N s/m."""
    law = run.tables.power_law[s]
    if law[EXPONENT] > 0.0:
        deep = max(largest8(load8(motion_of(run, s)[0], 0)), 0.0)
        deep *= math.sqrt(deep) if law[EXPONENT] == 1.5 else 1.0
        return abs(law[FACTOR]) / run.state.entry_rate[s] * law[STIFFNESS] * deep + abs(law[DAMPING])
    if run.problem.knots[s, 0] == 0.0:  # else `_largest_force` has them
        law_slopes_at_nodes(run, s)
    return largest_size(run.scratch.slope[s, 1])


@merged
def _ripple_of_force(run, node_set, level, u, unresolved, stiffness):
    """Error of the force on row u between the nodes, N, by blocks too fast for them; then their gain.

    The gain is the largest part of its oscillation by which a block is moved by the force that it makes, see
    `tables.reactions`. One moved by as much as it oscillates swings ever more from step to step, from rounding on.
    """
    tables, scratch, s, kind = run.tables, run.scratch, element_of(run.problem, u), run.tables.kind[node_set]
    if tables.aliased[kind, level] == 0.0:
        return 0.0, 0.0
    alias, damping = tables.alias[kind, level], _damping_of(run, s)
    ripple = force_ripple_of(run, swing_of(run), u, alias, stiffness, damping)
    if scratch.control[NEW]:
        ripple += _ripple_begun(run, u, alias, stiffness, damping)
    if node_set > 0:
        return ripple, 0.0
    if _MEAN_OF_RIPPLE * ripple > max(unresolved, _LITTLE * scratch.force_tolerance[s]):
        note_oscillation(run, level)
        ripple = min(ripple, force_ripple_of(run, scratch.oscillation, u, alias, stiffness, damping))
    return ripple, stiffness * tables.reactions[u, level, 0] + damping * tables.reactions[u, level, 1]


@inner
def _note_ringing(run, h):
    """Write into ``scratch.ringing`` how fast the forces set the blocks swinging as a contact or segment begins.

    A force that begins with the slope Ḟ leaves a block swinging about what follows it with |push| Ḟ/k. This shows in
    the state at the end of the step only, and the nodes of a long one may tell it as a part of a smooth force.
    """
    problem, begun = run.problem, run.scratch.ringing
    n = problem.k.size
    for b in range(n):
        begun[b] = 0.0
    for u in range(problem.gap.size):
        if acts(problem, run.state, u):
            force, ringing = load8(run.scratch.force[u], 0), run.tables.ringing[u]
            slope = (largest8(force) - least8(force)) / h
            for b in range(n):
                begun[b] += ringing[b] * slope


@inner
def _ripple_begun(run, u, alias, stiffness, damping):
    """Error of the force on row u between the nodes, N, by what the forces have set swinging."""
    weight, rate_weight, n = run.tables.ripple_weight[u], run.tables.rate_ripple_weight[u], run.problem.k.size
    error = 0.0
    for b in range(n):
        slope = stiffness * weight[b] + damping * rate_weight[b]
        error += slope * alias[n + b] * run.scratch.ringing[b]
    return error


@part(ERROR, REAL, types.int64, types.int64)
def step_error(run, node_set, level):
    """Largest error of an indentation rate over the step just solved, in units of its tolerance rtol × speed."""
    problem, scratch = run.problem, run.scratch
    h, worst = run.tables.contact_step[level], 0.0
    if scratch.control[NEW]:
        _note_ringing(run, h)
    for u in range(problem.gap.size):
        scratch.unresolved[u] = 0.0
        if acts(problem, run.state, u):
            worst = max(worst, _find_unresolved(run, node_set, level, u))
    worst = max(worst, _sum_errors(run, node_set, h))
    for r in range(problem.gap.size):
        speed = scratch.reference_speed[element_of(problem, r)]
        if r < row_of(problem, element_of(problem, r)) + 2:  # the third row, of rotation, keeps the reference speed
            speed = max(speed, largest_size(scratch.motion[r, 1]))
        error = scratch.per_row[r] / (scratch.accuracy[RTOL] * speed)
        if not error <= worst:
            worst = error
            if error != error:
                return worst
    if run.state.event_record.shape[0]:
        worst = max(worst, _derivative_error(run, node_set, level))
    return worst


@merged
def _force_rounding(run, s):
    """Rounding of a force, N, by that of δ and δ̇: no shorter step resolves more of it.

    A stiff stop on a structure that has moved far has few digits of its δ, and one at rest that is hardly touched none.
    A spring of friction has those of ξ, which all rows of its contact make.
    """
    problem, state, scratch = run.problem, run.state, run.scratch
    motion, slope, least = motion_of(run, s), scratch.slope[s], surface_tolerance(problem, s, state.x)
    rounding = _OF_SURFACE * (least - _FLOOR)
    least = least if problem.knots[s, 0] == 0.0 else -np.inf  # at δ = 0 a slope may be infinite
    for i in range(S):
        scratch.clipped[i] = max(motion[0, i], least)
    contact_gradient(problem, s, scratch.clipped, motion[1], state.entry_rate[s], slope[0], slope[1], slope[2])
    found = largest_size(slope[0]) * rounding + largest_size(slope[1]) * rate_tolerance(problem, s, state.x)
    if rubs(problem, s):
        for r in range(row_of(problem, s) + 1, row_of(problem, s + 1)):
            rounding += _OF_SURFACE * 1e-15 * abs_dot(problem.read[r], state.x, 2 * problem.k.size)
        found += slider_of(problem, s)[FRICTION_STIFFNESS] * rounding
    return found


@merged
def _derivative_error(run, node_set, level):
    """Error of the derivative of a step, in units of rtol: the step must resolve what the contacts stiffen.

    A motion at rest, or slow, lets steps grow, but neighbouring motions oscillate. Collocation at eight nodes of Gauss
    solves ẍ = -ω² x over a step with an error of 1.5e-19 (ωh)^17, and up to a point inside, where the run may end, of
    2.7e-11 (ωh)^9; ẍ = -c ẋ with less than that for ω = c. A strong dashpot that would take too many steps is ignored
    once its motion has decayed since the last event; then only the slow decay rate k/c counts. Blocks that the nodes do
    not resolve oscillate beside a motion that hardly has them; what the slopes do to them counts too.
    """
    problem, state, scratch = run.problem, run.state, run.scratch
    h, square, unresolved = run.tables.contact_step[level], 0.0, 0.0
    out, since = scratch.local_motion[FORCES], state.now[T] - max(state.now[LAST_EVENT], 0.0)
    for s in range(problem.law.size):
        if state.segment[s] == 0:
            continue
        motion, mobility = motion_of(run, s), 0.0
        copy(motion[0], scratch.clipped, S)
        slopes = out[:S], out[S : 2 * S], out[2 * S :]
        contact_gradient(problem, s, scratch.clipped, motion[1], state.entry_rate[s], slopes[0], slopes[1], slopes[2])
        stiffness, damping = largest_size(slopes[0]), largest_size(slopes[1])
        if rubs(problem, s):
            stiffness = max(stiffness, slider_of(problem, s)[FRICTION_STIFFNESS])
        for r in range(row_of(problem, s), row_of(problem, s + 1)):
            mobility += abs(run.tables.accelerance[r, r])
            unresolved += h * _unresolved_blocks(run, r, node_set, level, stiffness, damping)
        stiffness, damping = stiffness * mobility, damping * mobility
        faded = damping**2 > 4.0 * stiffness and damping * since > _FADED and damping * state.now[T_END] > _MOST_RADIANS
        square += (stiffness / damping if faded else math.sqrt(stiffness) + damping) ** 2
    scratch.stiffened[0] = math.sqrt(square)
    angle = scratch.stiffened[0] * h
    error = _INNER_ERROR * angle**9 if state.now[T] + h >= state.now[T_END] else _END_ERROR * angle**17
    return max(error, _SHARE_OF_BLOCKS * unresolved) / scratch.accuracy[RTOL]


@merged
def _unresolved_blocks(run, r, node_set, level, stiffness, damping):
    """Rate, per s, at which a block that oscillates between the nodes is moved wrongly by the slopes at row r."""
    problem, tables = run.problem, run.tables
    alias, n, worst = tables.alias[tables.kind[node_set], level], problem.k.size, 0.0
    for b in range(int(tables.own_blocks)):
        slope = stiffness + damping * math.sqrt(problem.k[b])
        worst = max(worst, slope * tables.ripple_weight[r, b] * alias[n + b] * abs(problem.push[r, n + b]))
    return _MEAN_OF_RIPPLE * worst


@merged
def _undamped_part(run, node_set, h, s):
    """Part of the step, 0 to 1, over which errors of a rate survive the stop's dashpot up to the end.

        ∫ exp(-∫ d dσ') dσ, the inner integral from σ to 1, d = h × accelerance × slope of the law by the rate,

    with d constant around each node. The last nodes decide; the dashpot of a stop that is being left vanishes there.
    """
    part, transmitted, accelerance = 0.0, 1.0, own_accelerance(run, s)
    for k in range(S):
        i = S - 1 - k
        share = run.tables.plain[node_set, i]
        damped = share * h * accelerance * max(run.scratch.slope[s, 1, i], 0.0)
        factor = math.exp(-damped)
        part += transmitted * share * ((1.0 - factor) / damped if damped > 1e-6 else 1.0)
        transmitted *= factor
    return part


@merged
def _sum_errors(run, node_set, h):
    """Errors of the rates of all rows, m/s, by unresolved forces and signals, into ``scratch.per_row``.

    Returns the largest error of the blocks' motion by an unresolved signal, in units of its tolerance.
    """
    problem, scratch = run.problem, run.scratch
    rows, error, worst = problem.gap.size, scratch.per_row, 0.0
    for r in range(rows):
        error[r] = 0.0
    for j in range(problem.table_dt.size):
        unresolved = h * unresolved_signal(run, node_set, j, run.state.now[T], h)
        worst = max(worst, _driven_error(run, j, unresolved))
        for r in range(rows):
            error[r] += abs(run.tables.load_acceleration[r, problem.table_load[j]]) * unresolved
    for u in range(rows):
        if scratch.unresolved[u] != 0.0:
            for r in range(rows):
                error[r] += abs(run.tables.accelerance[r, u]) * scratch.unresolved[u]
    return worst


@merged
def _driven_error(run, j, unresolved):
    """Error of the blocks that sampled signal j drives by an unresolved impulse, in units of rtol × their energy norm.

    A load far from all stops, or on another body, moves none of them, so that their rates do not show it. Each block
    counts by its share of the load: blocks that move but are not driven are no measure. Driven blocks at rest are
    measured by `Scratch.driven_speed`.
    """
    problem, scratch = run.problem, run.scratch
    n, norm, x, x_new = problem.k.size, run.tables.load_norm[problem.table_load[j]], run.state.x, scratch.x_new
    load, before, after = 0.0, 0.0, 0.0
    for b in range(n):
        share, k = norm[b] * norm[b], problem.k[b]
        load += share
        before += share * (x[n + b] * x[n + b] + k * x[b] * x[b])
        after += share * (x_new[n + b] * x_new[n + b] + k * x_new[b] * x_new[b])
    if unresolved == 0.0 or load == 0.0:
        return 0.0
    speed = max(math.sqrt(max(before, after) / load), scratch.driven_speed[j])
    return unresolved * math.sqrt(load) / (scratch.accuracy[RTOL] * max(speed, 1e-300))


@inner
def note_signals(run):
    """Set what every sampled signal can drive within a cell of its table, as its largest value there would."""
    problem = run.problem
    for j in range(problem.table_dt.size):
        largest, square = 0.0, 0.0
        for node in range(problem.table_start[j], problem.table_start[j + 1]):
            largest = max(largest, abs(problem.table[node, 0]))
        for norm in run.tables.load_norm[problem.table_load[j]]:
            square += norm * norm
        run.scratch.driven_speed[j] = largest * math.sqrt(square) * min(problem.table_dt[j], 1.0 / run.tables.fastest)


@merged
def _hidden_kink(run, s, largest):
    """Largest difference, N, of law and polynomial at the ends of a smooth step; 0 if the coefficients explain it.

    Otherwise the law has a kink between that end and the next node, within a fiftieth of the step, as a called law
    with clamp=True; or it saturates within that time, as hysteresis of a knee that is small beside the motion does
    after a border.
    """
    problem, state, scratch = run.problem, run.state, run.scratch
    delta, rate = scratch.clipped[0:2], scratch.trial[0:2]
    delta[0], rate[0] = indentation_and_rate(problem, s, scratch.x_new)
    delta[1] = off_knots(problem, s, state.segment[s], indentation(problem, s, state.x))
    rate[1] = indentation_rate(problem, s, state.x)
    contact_forces(problem, s, delta, rate, state.entry_rate[s], scratch.trial[2:4])
    c = scratch.summary[place_of(problem, s)]
    difference = max(abs(scratch.trial[2] - c[AT_END]), abs(scratch.trial[3] - c[AT_BEGIN]))
    return difference if difference > 2.0 * max(abs(c[2]), abs(c[3])) + 1e-12 * largest else 0.0


@inner
def end_state(run, node_set, level):
    """Write the block coordinates at the end of the step into ``scratch.x_new``."""
    problem, tables, state, scratch = run.problem, run.tables, run.state, run.scratch
    x, n = scratch.x_new, problem.k.size
    if uses_blocks(tables):
        for e in range(2 * n):
            x[e] = 0.0
        add_end_response(run, scratch.force, node_set, level, x)
    first = True
    for u in range(0 if uses_blocks(tables) else scratch.force.shape[0]):
        if u >= problem.gap.size or acts(problem, state, u):
            rows = tables.end_response[weighting_of(run, node_set, u), level, u]
            if first:
                combine(rows, scratch.force[u], S, None, x)
            else:
                combine(rows, scratch.force[u], S, x, x)
            first = False
    alpha, beta = tables.contact_propagator[level, 0], tables.contact_propagator[level, 1]
    for b in range(n):
        p, v = state.x[b], state.x[n + b]
        x[b] += alpha[b] * p + beta[b] * v
        x[n + b] += alpha[b] * v - beta[b] * (problem.k[b] * p + problem.c[b] * v)
