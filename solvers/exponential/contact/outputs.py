"""What a contact step leaves besides its end: samples inside, the state at the end of a run, a row of the tape."""

from __future__ import annotations

from solvers.compiled.kernels import copy, inner
from solvers.compiled.state import HEAD, PART, SAMPLED, STEPS, TAPED, T, is_open, tape
from solvers.exponential.contact.node_response import START
from solvers.exponential.contact.nodes import S
from solvers.exponential.contact.peaks import state_peaks, step_peaks
from solvers.exponential.energy.books import book_contact
from solvers.exponential.energy.quadrature import inside


@inner
def record(problem, tables, books, state, space, family, level, t_end, out, due):
    """Samples inside the converged step, and the state at the end of the run if that lies inside."""
    t, h = state.now[T], tables.step[level]
    while True:
        sampled = due[state.count[SAMPLED]] <= min(t + h, t_end)
        if not sampled and t + h < t_end:
            return
        span = due[state.count[SAMPLED]] - t if sampled else t_end - t
        row = out[state.count[SAMPLED]] if sampled else space.work[START]
        copy(state.x, row, state.x.size)
        inside(problem, tables, state, space, family, h, span, row)
        if books.kept > 0.0:
            book_contact(problem, tables, books, state, space, family, level, span, row)
        if not sampled:
            return
        state.count[SAMPLED] += 1


@inner
def end_inside(problem, tables, state, space, family, level, t_end):
    """End the run within the step found, at the state `record` has left in ``space.work[START]``."""
    x, share = space.work[START], (t_end - state.now[T]) / tables.step[level]
    place = share ** (1.0 / tables.power[family])
    for s in range(problem.gap.size):
        if state.piece[s] > 0 and (problem.levels[s, 0] == 0.0 or problem.opening[s] >= 0) and not is_open(problem, s):
            step_peaks(problem, tables, state, space, family, tables.step[level], s, min(place, 1.0))
    if state.tape.shape[0]:
        tape_forces(problem, state, space, PART, t_end, family, level)
    copy(x, state.x, state.x.size)
    state_peaks(problem, state, space, x)
    state.now[T] = t_end
    state.count[STEPS] += 1


@inner
def tape_forces(problem, state, space, kind, ended, family, level):
    """A row of the tape with the forces at the nodes."""
    forces = state.tape[state.count[TAPED], HEAD + state.x.size :]
    for s in range(problem.gap.size):
        copy(space.force[s], forces[s * S : (s + 1) * S], S)
    tape(state, kind, state.now[T], ended, ended - state.now[T], family, level, state.x)
