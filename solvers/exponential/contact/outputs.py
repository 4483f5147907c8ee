"""Outputs of a contact step: works, peaks and state at its end, samples inside it, its event record."""

from __future__ import annotations

from solvers.compiled.kernels import copy, indentation, inner, is_circle, merged, rubs, work_column
from solvers.compiled.simd import load8, sum8
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
from solvers.exponential.circles.contact import work_in_circle
from solvers.exponential.circles.friction import work_with_friction
from solvers.exponential.contact.node_response import START, force_of, largest_size, motion_of
from solvers.exponential.contact.nodes import S
from solvers.exponential.contact.peaks import state_peaks, step_peaks
from solvers.exponential.contact.slider_margins import peak_of_friction
from solvers.exponential.contact.step_integrals import resolves_rates, weights_of, work_by_places, work_by_rates
from solvers.exponential.energy.quadrature import hides_motion, state_within


@merged
def sample_step(run, node_set, level):
    """Write the samples inside the converged step, and the state at the end of the run, if inside, for `end_run`."""
    state = run.state
    t, h, begin, row, t_end = state.now[T], run.tables.contact_step[level], 0.0, state.x, state.now[T_END]
    ledger, by_laws = run.energy_tables.active > 0.0, hides_motion(run, h)
    while True:
        due = state.due[state.count[SAMPLED]]
        sampled = due <= min(t + h, t_end)
        if not sampled and t + h < t_end:
            return
        span = due - t if sampled else t_end - t
        following = state.out[state.count[SAMPLED]] if sampled else run.scratch.stages[START]
        copy(row, following, state.x.size)
        state_within(run, node_set, h, begin, span, following, ledger, by_laws)
        if not sampled:
            return
        state.count[SAMPLED] += 1
        begin, row = span, following


@merged
def end_run(run, node_set, level):
    """End the run within the step, in the state that `sample_step` has written into ``scratch.stages[START]``."""
    problem, state = run.problem, run.state
    x, t_end, h = run.scratch.stages[START], state.now[T_END], run.tables.contact_step[level]
    place = min(((t_end - state.now[T]) / h) ** (1.0 / run.tables.time_exponent[node_set]), 1.0)
    for s in range(problem.law.size):
        if acting_segment(problem, state, s) > 0 and begins_and_ends(problem, s):
            step_peaks(run, node_set, h, s, place)
            if rubs(problem, s):
                peak_of_friction(run, node_set, h, s, place)
    if state.event_record.shape[0]:
        record_forces(run, PART, t_end, node_set, level)
    copy(x, state.x, state.x.size)
    state.now[T] = t_end
    state_peaks(run, x)
    state.count[STEPS] += 1


@inner
def record_forces(run, kind, ended, node_set, level):
    """Append a row with the forces at the nodes to the event record."""
    state = run.state
    forces = state.event_record[state.count[RECORDED], HEAD + state.x.size :]
    for r in range(run.problem.gap.size):
        copy(run.scratch.force[r], forces[r * S : (r + 1) * S], S)
    write_event(state, kind, state.now[T], ended, ended - state.now[T], node_set, level, state.x)


@merged
def finish_step(run, node_set, level):
    """Move the state to the end of the converged step; update works, impulses and peaks of the contacts."""
    problem, tables, state, scratch = run.problem, run.tables, run.state, run.scratch
    size, h = 2 * problem.k.size, tables.contact_step[level]
    for s in range(problem.law.size):
        if state.segment[s] > 0:
            motion, force = motion_of(run, s), force_of(run, s)
            if rubs(problem, s):
                work = work_with_friction(run, node_set, level, s)
                peak_of_friction(run, node_set, h, s, 1.0)
            elif is_circle(problem, s):
                work = work_in_circle(run, node_set, level, s)
            elif resolves_rates(tables, node_set, s, h):
                work = work_by_rates(tables, node_set, s, h, force, motion[1])
            else:
                ends = scratch.start_motion[s, 0], indentation(problem, s, scratch.x_new)
                work = work_by_places(tables, node_set, force, motion[0], ends, scratch.trial)
            column = work_column(problem, s)
            state.x[column] += work
            state.x[column + 1] += h * sum8(weights_of(tables, node_set, s) * load8(force, 0))
            if is_open(problem, s):
                continue
            if begins_and_ends(problem, s):
                step_peaks(run, node_set, h, s, 1.0)
            else:
                state.active[s, PEAK_DELTA] = max(state.active[s, PEAK_DELTA], largest_size(motion[0]))
                state.active[s, PEAK_FORCE] = max(state.active[s, PEAK_FORCE], largest_size(force))
    copy(scratch.x_new, state.x, size)
    move_clock(state.now, h)
