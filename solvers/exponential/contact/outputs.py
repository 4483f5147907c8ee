"""Outputs of a contact step: samples inside it, the state at the end of a run, a row of the event record."""

from __future__ import annotations

from solvers.compiled.kernels import copy, inner, merged
from solvers.compiled.state import HEAD, PART, RECORDED, SAMPLED, STEPS, T, is_open, write_event
from solvers.exponential.contact.node_response import START
from solvers.exponential.contact.nodes import S
from solvers.exponential.contact.peaks import state_peaks, step_peaks
from solvers.exponential.energy.quadrature import state_within


@merged
def sample_step(problem, tables, energy_tables, state, scratch, node_set, level, t_end, out, due):
    """Write the samples inside the converged step, and the state at the end of the run if it is inside."""
    t, h, begin, row = state.now[T], tables.contact_step[level], 0.0, state.x
    while True:
        sampled = due[state.count[SAMPLED]] <= min(t + h, t_end)
        if not sampled and t + h < t_end:
            return
        span = due[state.count[SAMPLED]] - t if sampled else t_end - t
        following = out[state.count[SAMPLED]] if sampled else scratch.stages[START]
        copy(row, following, state.x.size)
        state_within(problem, tables, state, scratch, node_set, h, begin, span, following, energy_tables.active > 0.0)
        if not sampled:
            return
        state.count[SAMPLED] += 1
        begin, row = span, following


@merged
def end_run(problem, tables, state, scratch, node_set, level, t_end):
    """End the run within the step, in the state that `sample_step` has put into ``scratch.stages[START]``."""
    x, share = scratch.stages[START], (t_end - state.now[T]) / tables.contact_step[level]
    place = share ** (1.0 / tables.time_exponent[node_set])
    for s in range(problem.gap.size):
        logged = problem.knots[s, 0] == 0.0 or (problem.opening[s] >= 0 and not is_open(problem, s))
        if state.segment[s] > 0 and logged:
            step_peaks(problem, tables, state, scratch, node_set, tables.contact_step[level], s, min(place, 1.0))
    if state.event_record.shape[0]:
        record_forces(problem, state, scratch, PART, t_end, node_set, level)
    copy(x, state.x, state.x.size)
    state_peaks(problem, state, scratch, x)
    state.now[T] = t_end
    state.count[STEPS] += 1


@inner
def record_forces(problem, state, scratch, kind, ended, node_set, level):
    """Append a row with the forces at the nodes to the event record."""
    forces = state.event_record[state.count[RECORDED], HEAD + state.x.size :]
    for s in range(problem.gap.size):
        copy(scratch.force[s], forces[s * S : (s + 1) * S], S)
    write_event(state, kind, state.now[T], ended, ended - state.now[T], node_set, level, state.x)
