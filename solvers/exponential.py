"""The main method: exact flight, collocated contact, every event landed on.

A tone Re(a e^{iΩt}) of a load is subtracted as its steady response, which then is one more undamped block with
k = Ω², c = 0 that no force pushes; so flight under tones is an autonomous linear system and exact in one
multiplication per block. Sampled signals are quintics per cell, exact likewise. `solvers.certify` proves flight steps
safe, `solvers.collocation` solves the contacts, `solvers.regular` lands on their ends.

Limitations
-----------
* In flight no contact of the model is missed, however short. While one stop is in contact the others are watched at 8
  nodes per step only: a second contact shorter than the distance of two nodes can be missed.
* Touching is no contact: a stop counts as entered where δ becomes positive. An entry at rest counts when δ̈ > 0; one
  at rest that another stop's force brings about is noticed a shortest step (1e-9 s) late.
* A law that bends (clamp=True, a table) between its declared knots is integrated with smaller steps, at lower order; so
  is the beginning and end of one that rises like δ^r, r < 1, in a viscous part (Tsuji). The tolerance is kept.
* K and C must be positive semi-definite (no buckled modes, no negative damping; a contact law may drive).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numba import types

from solvers.certify import fly
from solvers.collocation import arrive, contact_time, finish_step, leaves_piece, solve_forces, step_error
from solvers.families import S
from solvers.flight import energy_norms
from solvers.forcing import Forcing
from solvers.handle import Cast, Packed, opener
from solvers.kernels import (
    MATRIX,
    PROBLEM,
    REAL,
    VECTOR,
    contact_forces,
    copy,
    dot,
    entry,
    indentation,
    inlined,
    inner,
    merged,
)
from solvers.ledger import account, inside
from solvers.peaks import peaks_so_far
from solvers.preparation import SPACE, TABLES, ready_for
from solvers.regular import INDENTATION, ROOT, regular_step
from solvers.response import free_response
from solvers.state import (
    AT_ONCE,
    CALLS,
    CHATTER,
    DONE,
    HEAD,
    LANDING,
    LOG_FULL,
    LOGGED,
    MOST_EVENTS_AT_ONCE,
    PART,
    PEAK_DELTA,
    REJECTED,
    RUNNING,
    SAMPLED,
    STATE,
    STEP,
    STEP_TOO_SMALL,
    STEPS,
    T_IN,
    TAPED,
    State,
    T,
    begin_contacts,
    switch,
    switch_on_surface,
    tape,
    touching,
)
from solvers.system import Array, System
from solvers.vector import combine

# places in `numbers`: reference speed, T_c, then per stop a first step's share of T_c
SCALE, DURATION, SHARE = range(3)
LEVEL, FAMILY, FRESH, STOP, WANTED, BEGUN = range(6)  # places in `last`
_problem, _tables, _state, _space = opener(PROBLEM), opener(TABLES), opener(STATE), opener(SPACE)
_GOAL = 0.3  # error aimed at, in units of the tolerance
_MOST_TRIES = 8  # to meet an output time on the way to a landing
_LAST = 0.09  # indentation, in units of the deepest, from which the last step is tried
_ORDER = 15.0  # the error estimate falls like h^15


@inner
def _begin(problem, tables, state, space, numbers, last, stop):
    """Scale, first step and family of a contact that begins (or changes piece) at ``stop``."""
    size, n = 2 * problem.k.size, problem.k.size
    speed = abs(dot(problem.read_rate[stop], state.x, size))
    energy_norms(problem, state.x, space.norms)
    possible = dot(tables.reach[stop], space.norms, n)
    numbers[SCALE] = max(speed, 0.1 * possible, 0.1 * problem.floor[stop])
    delta = indentation(problem, stop, state.x)
    entering = state.piece[stop] == 1 and delta < 1e-9 * max(state.open[stop, PEAK_DELTA], 1e-6)
    duration = contact_time(problem, tables, space, stop, max(speed, 1e-3 * numbers[SCALE]))
    if numbers[SHARE + stop] == 0.0:
        numbers[SHARE + stop] = min(0.1, 4.0 / (tables.fastest * duration))
    last[FAMILY] = 1 + stop if entering else 0
    last[WANTED] = _level(tables, numbers[SHARE + stop] * duration)
    numbers[DURATION] = duration
    last[FRESH], last[STOP] = 1, stop


@inlined
def _level(tables, h):
    """Contact step of about h, the shortest one if need be."""
    last = tables.step.size - 1
    j = min(max(int(np.ceil(2.0 * math.log2(tables.step[0] / h))), 0), last)
    return j + 1 if tables.step[j] > h and j < last else j


@inner
def _nearest_surface(problem, state):
    """(time, stop, direction) of the border of a piece that will be met first at the present rates."""
    size = 2 * problem.k.size
    near, stop, direction = np.inf, -1, 0
    for s in range(problem.gap.size):
        delta = indentation(problem, s, state.x)
        rate = dot(problem.read_rate[s], state.x, size)
        piece = state.piece[s]
        if rate < 0.0 and piece > 0:
            time, way = (delta - problem.levels[s, piece - 1]) / -rate, -1
        elif rate > 0.0:
            time, way = (problem.levels[s, piece] - delta) / rate, 1
        else:
            continue
        if time < near:
            near, stop, direction = time, s, way
    return near, stop, direction


@inner
def _state_on_the_way(problem, tables, state, space, variable, stop, span, landed, time, ledger):
    """State at a time before the landing, into ``space.work[15]``; the length of its step, or inf when not found."""
    w, x, size, tries = space.work[17], space.work[15], state.x.size, 0
    t = w[size]
    left = (landed - time) / (landed - t) if landed > t else 0.0
    length = span * (1.0 - (math.sqrt(left) if variable == ROOT else left))
    while True:
        _, calls = regular_step(
            *(problem, tables, ledger, variable, stop, length, w),
            *(state.piece, state.entry_rate, space.work),
        )
        state.count[CALLS] += calls
        late, tries = x[size] - time, tries + 1
        pace = dot(problem.read_rate[stop], x, 2 * problem.k.size)  # d(variable)/dt
        if variable == ROOT:
            pace /= 2.0 * x[size + 1]
        if not abs(late) > 1e-15 * landed or not abs(pace) < np.inf or tries == _MOST_TRIES:
            return length if abs(late) <= 1e-6 * (landed - t) + 1e-15 * landed else np.inf
        length -= late * pace


@inner
def _land(problem, tables, state, space, numbers, stop, direction, near, rtol, t_end, out, due, ledger):
    """Try to land on the border ahead by one regular step; whether it succeeded."""
    size, t = state.x.size, state.now[T]
    delta = indentation(problem, stop, state.x)
    level = problem.levels[stop, state.piece[stop] - (1 if direction < 0 else 0)]
    leaving = direction < 0 and state.piece[stop] == 1
    if tables.fastest * near > 1.5:
        return False
    if leaving and delta > _LAST * state.open[stop, PEAK_DELTA]:
        return False
    if not leaving and state.piece[stop] > 0 and abs(level - delta) > 0.2 * max(level, delta):
        return False
    w, x = space.work[17], space.work[15]
    copy(state.x, w, size)
    w[size], w[size + 1] = t, math.sqrt(max(delta, 0.0))
    broken = tables.exponent[stop] % 1.0 != 0.0
    variable = ROOT if leaving and broken else INDENTATION
    span = -w[size + 1] if variable == ROOT else level - delta
    error, calls = regular_step(
        *(problem, tables, ledger, variable, stop, span, w),
        *(state.piece, state.entry_rate, space.work),
    )
    state.count[CALLS] += calls
    landed = x[size]
    arrives = direction * dot(problem.read_rate[stop], x, 2 * problem.k.size) >= 0.0  # it has not turned back
    if not (error <= rtol * numbers[SCALE] and arrives and t <= landed <= t + 4.0 * near):
        return False
    copy(x, state.x, size)
    while True:  # the samples, and the end of the run, that lie on the way
        time = min(due[state.count[SAMPLED]], t_end)
        if time > landed:
            break
        length = _state_on_the_way(problem, tables, state, space, variable, stop, span, landed, time, ledger)
        if length == np.inf:
            copy(w, state.x, size)
            return False
        if time == due[state.count[SAMPLED]]:
            copy(x, out[state.count[SAMPLED]], size)
            state.count[SAMPLED] += 1
        if time == t_end:
            copy(x, state.x, size)
            landed, span = t_end, length
            break
    if state.tape.shape[0]:
        tape(state, LANDING, t, landed, span, variable, stop, w)
    state.now[T] = landed
    return True


@inner
def _predict(problem, tables, state, space, last, level):
    """First guess of the forces: the last step's polynomial, or the law on the free response."""
    for s in range(problem.gap.size):
        if state.piece[s] == 0:
            continue
        if last[FRESH]:
            copy(space.free[s, 0], space.clipped, S)
            contact_forces(problem, s, space.clipped, space.free[s, 1], state.entry_rate[s], space.force[s])
            state.count[CALLS] += S
            continue
        shift = level - last[LEVEL] + 2
        if 0 <= shift < tables.extend.shape[1]:
            combine(tables.extend[last[FAMILY], shift], space.previous[s], S, None, space.force[s])
        else:
            for i in range(S):
                space.force[s, i] = space.previous[s, S - 1]


@merged
def _try(problem, tables, state, space, numbers, last, family, level, rtol):
    """Attempt one contact step; error in units of the tolerance, inf when it must be shorter anyway."""
    h = tables.step[level]
    bottom = level == tables.step.size - 1
    free_response(problem, tables, state, space, family, level)
    _predict(problem, tables, state, space, last, level)
    mobility = 1e-300
    for s in range(problem.gap.size):
        if state.piece[s] > 0:
            mobility = max(mobility, tables.mobility[s, s])
    tolerance = rtol * numbers[SCALE]
    if not solve_forces(problem, tables, state, space, family, level, 0.05 * tolerance / (h * mobility)):
        return np.inf
    arrive(problem, tables, state, space, family, level)
    if leaves_piece(problem, tables, state, space, family, level):
        return 1.0 if bottom else np.inf
    error = step_error(problem, tables, state, space, family, level, last[FRESH]) / tolerance
    return min(error, 1.0) if bottom else error


@inner
def _record(problem, tables, state, space, family, level, t_end, out, due, ledger):
    """Samples inside the converged step, and the state at the end of the run if that lies inside."""
    t, h = state.now[T], tables.step[level]
    while True:
        sampled = due[state.count[SAMPLED]] <= min(t + h, t_end)
        if not sampled and t + h < t_end:
            return
        span = due[state.count[SAMPLED]] - t if sampled else t_end - t
        row = out[state.count[SAMPLED]] if sampled else space.work[17]
        copy(state.x, row, state.x.size)
        inside(problem, tables, state, space, family, h, span, row)
        if ledger:
            account(problem, tables, state, space, family, h, span, state.x, row)
        if not sampled:
            return
        state.count[SAMPLED] += 1


@inner
def _latest(state):
    """The stop in contact that was entered last."""
    stop = -1
    for s in range(state.piece.size):
        if state.piece[s] > 0 and (stop < 0 or state.open[s, T_IN] >= state.open[stop, T_IN]):
            stop = s
    return stop


@merged
def touch(problem, tables, state, space, numbers, last, t_end, rtol, log, out, due, ledger):
    """One accepted step in contact: land if a border is near, else collocate; returns a status code."""
    near, stop, direction = _nearest_surface(problem, state)
    if near <= 0.0 and switch_on_surface(problem, state, log, True):
        if touching(state):
            _begin(problem, tables, state, space, numbers, last, _latest(state))
        return RUNNING
    if (
        stop >= 0
        and not last[FRESH]
        and _land(problem, tables, state, space, numbers, stop, direction, near, rtol, t_end, out, due, ledger)
    ):
        state.count[STEPS] += 1
        if state.now[T] < t_end:
            switch(problem, state, stop, direction, log)
            if touching(state):
                _begin(problem, tables, state, space, numbers, last, stop)
        return RUNNING
    for s in range(problem.gap.size):  # a stop the loads lean on moves faster than it was entered
        if state.piece[s] > 0:
            rate = abs(dot(problem.read_rate[s], state.x, 2 * problem.k.size))
            numbers[SCALE] = max(numbers[SCALE], rate)
    family = last[FAMILY] if last[FRESH] else 0
    longest = np.inf if last[FRESH] else 0.8 * near
    if problem.table_dt.size:
        longest = min(longest, t_end - state.now[T] + problem.table_dt[0])
    wanted, bottom = last[WANTED], tables.step.size - 1
    level = _level(tables, longest) if longest < tables.step[wanted] else wanted
    while True:
        error = _try(problem, tables, state, space, numbers, last, family, level, rtol)
        if error <= 1.0:
            break
        if level == bottom:
            return STEP_TOO_SMALL
        level = min(bottom, level + (1 + int(2.0 / _ORDER * math.log2(error / _GOAL)) if error < np.inf else 2))
        wanted = level
        state.count[REJECTED] += 1
    end = state.now[T] + tables.step[level]
    ends = end >= t_end
    if ends or due[state.count[SAMPLED]] <= end:
        _record(problem, tables, state, space, family, level, t_end, out, due, ledger)
    if ends:
        share = (t_end - state.now[T]) / tables.step[level]
        peaks_so_far(problem, tables, state, space, family, share, space.work[17])
        if state.tape.shape[0]:
            _tape_forces(problem, state, space, PART, t_end, family, level)
        copy(space.work[17], state.x, state.x.size)
        state.now[T] = t_end
        state.count[STEPS] += 1
        return RUNNING
    for s in range(problem.gap.size):
        copy(space.force[s], space.previous[s], S)
    if ledger:
        account(problem, tables, state, space, family, tables.step[level], tables.step[level], state.x, state.x)
    if state.tape.shape[0]:
        _tape_forces(problem, state, space, STEP, state.now[T] + tables.step[level], family, level)
    finish_step(problem, tables, state, space, family, level)
    _adapt(tables, numbers, last, level, family, wanted, error)
    state.count[STEPS] += 1
    return RUNNING


@inner
def _tape_forces(problem, state, space, kind, ended, family, level):
    """A row of the tape with the forces at the nodes."""
    forces = state.tape[state.count[TAPED], HEAD + state.x.size :]
    for s in range(problem.gap.size):
        copy(space.force[s], forces[s * S : (s + 1) * S], S)
    tape(state, kind, state.now[T], ended, ended - state.now[T], family, level, state.x)


@inner
def _adapt(tables, numbers, last, level, family, wanted, error):
    """Size of the next step from the error of this one."""
    longer = 2.0 / _ORDER * math.log2(_GOAL / max(error, 1e-30))  # in levels
    if last[FRESH]:  # the next contact of this stop begins with what was right here
        share = SHARE + last[STOP]
        if level != last[WANTED]:
            numbers[share] = tables.step[level] / numbers[DURATION]
        numbers[share] *= 2.0 ** (0.5 * min(max(longer, -1.0), 0.5))
    suggested = min(max(level - int(min(math.floor(longer), 2.0)), 0), tables.step.size - 1)
    last[WANTED] = suggested if level == wanted else min(suggested, wanted)
    last[LEVEL], last[FAMILY], last[FRESH] = level, family, 0


@entry(types.int64(*[types.int64] * 4, REAL, types.int64, REAL, MATRIX, MATRIX, VECTOR, types.boolean))
def advance(problem_at, tables_at, state_at, space_at, t_end, budget, rtol, log, out, due, ledger):
    """Advance the state to ``t_end`` or for about ``budget`` steps; returns a status code.

    ``out`` gets the states at the times ``due``, the last of which is infinite.
    """
    problem, tables, state, space = _problem(problem_at), _tables(tables_at), _state(state_at), _space(space_at)
    numbers, last = space.numbers, space.last
    if not last[BEGUN]:
        last[BEGUN] = 1
        begin_contacts(problem, state)
        if touching(state):
            _begin(problem, tables, state, space, numbers, last, _latest(state))
    begun = state.count[STEPS] + state.count[REJECTED]
    while state.count[STEPS] + state.count[REJECTED] - begun < budget:
        if state.now[T] >= t_end:
            return DONE
        if state.count[LOGGED] + problem.gap.size > log.shape[0]:
            return LOG_FULL
        if state.tape.shape[0] and state.count[TAPED] + problem.gap.size + 2 > state.tape.shape[0]:
            return RUNNING
        if state.count[AT_ONCE] > MOST_EVENTS_AT_ONCE:
            return CHATTER
        between = touching(state) and not last[FRESH]  # in a contact no border is met but by landing on it
        if not between and switch_on_surface(problem, state, log, True):
            if touching(state):
                _begin(problem, tables, state, space, numbers, last, _latest(state))
            continue
        if touching(state):
            code = touch(problem, tables, state, space, numbers, last, t_end, rtol, log, out, due, ledger)
            if code != RUNNING:
                return code
            continue
        stop = fly(problem, tables, state, space, t_end, budget, out, due, ledger)
        if stop >= 0:
            switch(problem, state, stop, np.int64(1), log)  # a literal would be compiled for itself
            _begin(problem, tables, state, space, numbers, last, stop)
    return RUNNING


@dataclass(frozen=True)
class Exponential:
    """Exact flight and collocated contact; the library's best method for any linear structure with stops.

    Parameters
    ----------
    rtol : error of an indentation rate that one contact step may make, relative to the speed of entry (or a tenth of
        what the motion could reach at the stop, whichever is larger), in [1e-12, 1e-2]. Flight is exact.
    ledger : keep the energy ledger of runs with output samples, by quadrature; without it their input and damping
        are NaN and the run several times quicker. Runs with ``dt=None`` keep none.

    Notes
    -----
    Cost is nearly independent of rtol and grows linearly with the number of modes. See the module for its limits.

    Examples
    --------
    >>> Exponential(rtol=1e-10).rtol
    1e-10
    """

    rtol: float = 1e-8
    ledger: bool = True
    has_tangent: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if not 1e-12 <= self.rtol <= 1e-2:
            raise ValueError(f"rtol must lie in [1e-12, 1e-2], got {self.rtol!r}")

    def engine(self, system: System, z: Array, forcing: Forcing, duration: float) -> Engine:
        """The method made ready for one run."""
        return Engine(self, system, z, forcing, duration)


class Engine:
    """One run: problem with tones among the blocks, tables, state."""

    def __init__(self, method: Exponential, system: System, z: Array, forcing: Forcing, duration: float) -> None:
        self.method, self.duration = method, duration
        forcing, prepared = ready_for(system, forcing, duration, method.rtol)
        self.back = prepared.back
        packed: Cast | Packed = prepared.problem
        if forcing.table.size:
            packed = Packed(packed.value._replace(table=forcing.table, table_start=forcing.table_start), PROBLEM)
        self.packed, self.problem, self.prepared = packed, packed.value, prepared
        self.workspace = prepared.workspace()
        self.workspace.begin(z)
        self.addresses = packed.address, prepared.tables.address, *self.workspace.addresses

    @property
    def state(self) -> State:
        """The state reached."""
        return self.workspace.state

    def record(self, tape: Array) -> None:
        """Write what happens in contact to a tape."""
        self.workspace.record(tape)

    def release(self) -> None:
        """Leave the workspace to another run; nothing may look at this one's state any more."""
        if not self.workspace.state.tape.size:
            self.prepared.spare.append(self.workspace)

    def start(self) -> None:
        """The compiled loop does so itself."""

    def keeps_ledger(self, sampled: bool) -> bool:
        """Whether input and damping of the energy ledger are known."""
        return self.method.ledger and sampled

    def march(self, budget: int, log: Array, out: Array, due: Array) -> int:
        """Go on for a stretch."""
        return advance(
            *(*self.addresses, self.duration, budget, self.method.rtol),
            *(log, out, due, self.keeps_ledger(len(out) > 0)),
        )
