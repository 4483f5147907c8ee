"""Outputs of a contact step: works, peaks and state at its end, samples inside it, its event record."""

from __future__ import annotations

from solvers.compiled.kernels import copy, indentation, inlined, inner, is_circle, merged, rubs
from solvers.compiled.simd import load8, splat8, sum8
from solvers.compiled.state import (
    HEAD,
    PART,
    PEAK_DELTA,
    PEAK_FORCE,
    RECORDED,
    SAMPLED,
    STEPS,
    T_END,
    T,
    acting_segment,
    begins_and_ends,
    is_open,
    move_clock,
    write_event,
)
from solvers.compiled.sums import combine
from solvers.exponential.circles.contact import work_in_circle
from solvers.exponential.circles.friction import work_with_friction
from solvers.exponential.contact.node_response import START, force_of, largest_size, motion_of
from solvers.exponential.contact.nodes import S
from solvers.exponential.contact.peaks import state_peaks, step_peaks
from solvers.exponential.contact.slider_margins import peak_of_friction
from solvers.exponential.energy.quadrature import state_within

_BRIEF = 1.0  # radians of the fastest block up to which nodes resolve δ̇; δ - δ₀ may be rounding of δ


@merged
def sample_step(problem, tables, energy_tables, state, scratch, node_set, level):
    """Write the samples inside the converged step, and the state at the end of the run, if inside, for `end_run`."""
    t, h, begin, row, t_end = state.now[T], tables.contact_step[level], 0.0, state.x, state.now[T_END]
    while True:
        due = state.due[state.count[SAMPLED]]
        sampled = due <= min(t + h, t_end)
        if not sampled and t + h < t_end:
            return
        span = due - t if sampled else t_end - t
        following = state.out[state.count[SAMPLED]] if sampled else scratch.stages[START]
        copy(row, following, state.x.size)
        state_within(problem, tables, state, scratch, node_set, h, begin, span, following, energy_tables.active > 0.0)
        if not sampled:
            return
        state.count[SAMPLED] += 1
        begin, row = span, following


@merged
def end_run(problem, tables, state, scratch, node_set, level):
    """End the run within the step, in the state that `sample_step` has written into ``scratch.stages[START]``."""
    x, t_end = scratch.stages[START], state.now[T_END]
    share = (t_end - state.now[T]) / tables.contact_step[level]
    place = share ** (1.0 / tables.time_exponent[node_set])
    for s in range(problem.law.size):
        if acting_segment(problem, state, s) > 0 and begins_and_ends(problem, s):
            step_peaks(problem, tables, state, scratch, node_set, tables.contact_step[level], s, min(place, 1.0))
            if rubs(problem, s):
                length = tables.contact_step[level]
                peak_of_friction(problem, tables, state, scratch, node_set, length, s, min(place, 1.0))
    if state.event_record.shape[0]:
        record_forces(problem, state, scratch, PART, t_end, node_set, level)
    copy(x, state.x, state.x.size)
    state.now[T] = t_end
    state_peaks(problem, state, scratch, x)
    state.count[STEPS] += 1


@inner
def record_forces(problem, state, scratch, kind, ended, node_set, level):
    """Append a row with the forces at the nodes to the event record."""
    forces = state.event_record[state.count[RECORDED], HEAD + state.x.size :]
    for r in range(problem.gap.size):
        copy(scratch.force[r], forces[r * S : (r + 1) * S], S)
    write_event(state, kind, state.now[T], ended, ended - state.now[T], node_set, level, state.x)


@inlined
def _work(problem, tables, scratch, node_set, s):
    """Work, J, of a plain force over the step: ∫ F dδ with F interpolated in the nodes, δ in nodes and ends.

    The quadrature of F δ̇ at the nodes would be wrong where the force hardly changes: there steps grow until fast
    blocks oscillate between the nodes. A constant force does the work F × (change of δ), whatever the motion in
    between.
    """
    begin, force = scratch.start_motion[s, 0], force_of(problem, scratch, s)
    combine(tables.work[node_set], force, S, None, scratch.trial)
    end = sum8(load8(tables.work_end[node_set], 0) * load8(force, 0))
    within = sum8(load8(scratch.trial, 0) * (load8(motion_of(problem, scratch, s)[0], 0) - splat8(begin)))
    return within + end * (indentation(problem, s, scratch.x_new) - begin)


@merged
def finish_step(problem, tables, state, scratch, node_set, level):
    """Move the state to the end of the converged step; update works, impulses and peaks of the contacts."""
    size, h = 2 * problem.k.size, tables.contact_step[level]
    brief = h * tables.fastest <= _BRIEF
    for s in range(problem.law.size):
        if state.segment[s] > 0:
            motion, force = motion_of(problem, scratch, s), force_of(problem, scratch, s)
            weighted = s == node_set - 1 and tables.weight_exponent[node_set] > 0.0
            weights = tables.weights[node_set] if weighted else tables.plain[node_set]
            impulses = load8(weights, 0) * load8(force, 0)
            if rubs(problem, s):
                work = work_with_friction(problem, tables, state, scratch, node_set, level, s)
                peak_of_friction(problem, tables, state, scratch, node_set, h, s, 1.0)
                state.x[size + 2 + 2 * s] += work
            elif is_circle(problem, s):
                state.x[size + 2 + 2 * s] += work_in_circle(problem, tables, state, scratch, node_set, level, s)
            elif weighted or brief:
                state.x[size + 2 + 2 * s] += h * sum8(impulses * load8(motion[1], 0))
            else:
                state.x[size + 2 + 2 * s] += _work(problem, tables, scratch, node_set, s)
            state.x[size + 3 + 2 * s] += h * sum8(impulses)
            if is_open(problem, s):
                continue
            if begins_and_ends(problem, s):
                step_peaks(problem, tables, state, scratch, node_set, h, s, 1.0)
            else:
                state.active[s, PEAK_DELTA] = max(state.active[s, PEAK_DELTA], largest_size(motion[0]))
                state.active[s, PEAK_FORCE] = max(state.active[s, PEAK_FORCE], largest_size(force))
    copy(scratch.x_new, state.x, size)
    move_clock(state.now, h)
