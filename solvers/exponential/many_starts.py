"""Many starts: one compiled call integrates one start after the other by `method.advance`.

It calls the machine code of a single run through its address, so that all results are the same bit for bit. Runs may
differ in gaps, which one array of the problem holds, and in amplitudes and phases of tones, which are states of the
tones' blocks at t = 0: neither changes a table.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Annotated, Any, NamedTuple

import numpy as np
from numba import types

from solvers.compiled.fields import packed_type
from solvers.compiled.kernels import INTEGERS, PLANAR_PROBLEM, copy, entry, inner, is_circle, rubs, slider_of
from solvers.compiled.packed import unpacker
from solvers.compiled.state import (
    DIVERGED,
    DONE,
    LOG_FULL,
    LOGGED,
    PEAK_DELTA,
    PEAK_FORCE,
    REJECTED,
    RUNNING,
    STATE,
    STATUSES,
    STEPS,
    T,
    acting_segment,
    begins_and_ends,
)
from solvers.exponential.energy.check import ALLOWED, FACTOR, LAST, has_gained, is_bounded
from solvers.exponential.energy.flight_tables import NO_ENERGY_TABLES
from solvers.exponential.method import ADVANCE, Engine
from solvers.exponential.preparation import SCRATCH
from solvers.problem import Array, Status
from solvers.problem import event_list as at
from solvers.problem.friction import PEAK, most_friction

NEXT, BEYOND, BEGUN = range(3)  # places in a cursor: present start, end of the group, whether the start has begun
CODE, CONTACTS = range(2)  # columns of Outcomes.count
REACHED, EXCHANGED, ENERGY = range(3)  # columns of Outcomes.number; three of energy, as in Scratch.energy
_RUN = types.FunctionType(ADVANCE)
_state, _scratch = unpacker(STATE), unpacker(SCRATCH)
_problem = unpacker(PLANAR_PROBLEM)  # of either type: both have the same fields


class Outcomes(NamedTuple):
    """Outcomes of k starts."""

    x: Annotated[Any, "k, 2*N"]  # states of all blocks
    count: Annotated[Any, "int k, 2"]  # code of the status, number of contacts
    number: Annotated[Any, "k, 5"]  # time reached, Σ peak force × peak indentation, energies
    peak: Annotated[Any, "k, E, 2"]  # largest indentation and force
    rubbed: Annotated[Any, "k, E"]  # largest friction

    @classmethod
    def of(cls, starts: int, width: int, stops: int) -> Outcomes:
        """Outcomes of starts that have not begun."""
        count = np.zeros((starts, 2), dtype=np.int64)
        count[:, CODE] = STATUSES.index(Status.INTERRUPTED)
        x, number = np.full((starts, width), np.nan), np.zeros((starts, 5))
        return cls(x, count, number, np.zeros((starts, stops, 2)), np.zeros((starts, stops)))


class Starts(NamedTuple):
    """Starts of k runs, and what a worker's memory holds before one of them begins."""

    x: Annotated[Any, "k, 2*N"]  # states of all blocks
    gaps: Annotated[Any, "k, E"]  # of each run; without rows all have those of the problem
    numbers: Annotated[Any, "numbers"]  # the memory of the workspace
    rest: Annotated[Any, "numbers"]  # what it holds before a start is added
    parameters: Annotated[Any, "E, P"]  # what the laws have latched then


@inner
def _count_contact(outcomes, i, stop, delta, force):
    """Add a contact and its peaks to those of its start."""
    peak = outcomes.peak[i, stop]
    outcomes.count[i, CONTACTS] += 1
    outcomes.number[i, EXCHANGED] += abs(delta * force)
    peak[0], peak[1] = max(peak[0], delta), max(peak[1], force)


@inner
def _begin(problem, state, starts, i):
    """Set the state of a run at t = 0, as `Workspace.begin` does, the latched numbers, and the gaps."""
    for s in range(problem.law.size if problem.border_count.any() else 0):
        copy(starts.parameters[s], problem.parameters[s], starts.parameters.shape[1])
    copy(starts.rest, starts.numbers, starts.rest.size)
    copy(starts.x[i], state.x, starts.x.shape[1])
    for s in range(starts.gaps.shape[1] if starts.gaps.size else 0):
        if is_circle(problem, s):
            problem.radius[s] = math.copysign(starts.gaps[i, s], problem.radius[s])
        else:
            problem.gap[problem.first[s]] = starts.gaps[i, s]


@inner
def _end(problem, state, scratch, code, outcomes, i):
    """Write the outcome of a finished run."""
    finite = True
    copy(state.x, outcomes.x[i], outcomes.x.shape[1])
    for value in state.x:
        finite &= np.isfinite(value)
    for s in range(problem.law.size):
        if acting_segment(problem, state, s) > 0 and begins_and_ends(problem, s):
            _count_contact(outcomes, i, s, state.active[s, PEAK_DELTA], state.active[s, PEAK_FORCE])
        if rubs(problem, s) and state.segment[s] > 0:
            outcomes.rubbed[i, s] = max(outcomes.rubbed[i, s], slider_of(problem, s)[PEAK])
    outcomes.count[i, CODE] = DIVERGED if code == DONE and not finite else code
    outcomes.number[i, REACHED] = state.now[T]
    copy(scratch.energy, outcomes.number[i, ENERGY:], 3)


_ADDRESSES = types.UniTuple(types.int64, 5)


@entry(types.void(_RUN, _ADDRESSES, packed_type(Starts), packed_type(Outcomes), INTEGERS, types.int64))
def advance_many(run, addresses, starts, outcomes, cursor, budget):
    """Integrate a group of starts one after the other, for about ``budget`` steps altogether.

    ``run`` is `method.advance`, ``addresses`` are its own.
    """
    problem_at, tables_at, state_at, scratch_at, energy_tables_at = addresses
    problem, state, scratch = _problem(problem_at), _state(state_at), _scratch(scratch_at)
    spent = 0
    while cursor[NEXT] < cursor[BEYOND] and spent < budget:
        i = cursor[NEXT]
        if not cursor[BEGUN]:
            _begin(problem, state, starts, i)
            cursor[BEGUN] = 1
        spent -= state.count[STEPS] + state.count[REJECTED]
        code = run(problem_at, tables_at, state_at, scratch_at, energy_tables_at, budget)
        spent += state.count[STEPS] + state.count[REJECTED] + 1
        for row in state.log[: state.count[LOGGED]]:
            if row[at.FROM] > 0.0 and row[at.TO] == 0.0:  # a contact ends
                _count_contact(outcomes, i, np.int64(row[at.ELEMENT]), row[at.DEEPEST], row[at.LARGEST])
            elif row[at.GUARD] == at.FRICTION:
                drawn = outcomes.rubbed[i, np.int64(row[at.ELEMENT]) :]
                drawn[0] = max(drawn[0], row[at.LARGEST])
        state.count[LOGGED] = 0
        if code != RUNNING and code != LOG_FULL:
            _end(problem, state, scratch, code, outcomes, i)
            cursor[NEXT], cursor[BEGUN] = i + 1, 0


def whole_starts(engine: Engine, z: Array, factors: Any) -> Array:
    """(k, 2N) states of all blocks at t = 0.

    ``z`` (k, 2n) : those of the structure. ``factors`` (k, tones) : what multiplies the complex amplitude of each tone,
    None for one. A tone's block holds p = cos Ωt and v = -Ω sin Ωt, so that a factor c makes it Re c and -Ω Im c.
    """
    prepared = engine.prepared
    starts = np.repeat(prepared.rest[None], len(z), axis=0)
    x = starts.reshape(len(z), 2, -1)
    n, tones = z.shape[1] // 2, len(prepared.steady)
    if factors is not None and tones:
        x[:, 0, n:], x[:, 1, n:] = factors.real, -factors.imag * np.sqrt(engine.problem.k[n:])
        x[:, :, :n] = -np.einsum("kj,ji->ki", factors, prepared.steady).real.reshape(len(z), 2, n)
    x[:, :, :n] += z.reshape(len(z), 2, n)
    return starts


class Worker:
    """An engine that integrates groups of the starts; each thread has one of its own."""

    def __init__(self, engine: Engine, starts: Array, gaps: Array, outcomes: Outcomes, budget: int) -> None:
        self.engine, self.cursor, problem_at = engine, np.zeros(3, dtype=np.int64), engine.addresses[0]
        if gaps.size:  # those of the problem are shared with other runs
            own = {name: getattr(engine.problem, name).copy() for name in ("gap", "radius")}
            self.own = engine.packed.replaced(PLANAR_PROBLEM, **own)
            problem_at = self.own.address
        numbers, parameters = engine.workspace.numbers, engine.prepared.problem.value.parameters
        addresses = problem_at, *engine.addresses[1:], NO_ENERGY_TABLES.address
        of_runs = Starts(starts, gaps, numbers, numbers.copy(), parameters)
        self.arguments = engine.advance, addresses, of_runs, outcomes, self.cursor, budget

    def assign(self, first: int, beyond: int) -> None:
        """Set the group of starts to integrate."""
        self.cursor[:] = first, beyond, 0

    def march(self) -> bool:
        """Continue with the group for about a budget of steps; whether it is done."""
        advance_many(*self.arguments)
        return bool(self.cursor[NEXT] == self.cursor[BEYOND])


def final_statuses(engine: Engine, outcomes: Outcomes, gaps: Array) -> Any:
    """(k,) `Status` of every start: that of its run, or `UNBALANCED` if it ends with more energy than it can have.

    `OVERDRAWN` if friction in a circle, of ``gaps`` (k, E) where runs have their own, was drawn too far.
    """
    status = np.array(STATUSES, dtype=object)[outcomes.count[:, CODE]]
    for s, contact in enumerate(engine.system.contacts):
        if contact.friction is not None and contact.circle:
            radius = gaps[:, s] if gaps.size else abs(contact.circle)
            drawn = outcomes.rubbed[:, s] > most_friction(contact, radius)
            status[drawn & (outcomes.count[:, CODE] == DONE)] = Status.OVERDRAWN
    if not is_bounded(engine.system):
        return status
    energy = outcomes.number[:, ENERGY:]
    much = (outcomes.count[:, CODE] == DONE) & (energy[:, LAST] > FACTOR * energy[:, ALLOWED])
    for i in np.flatnonzero(much):
        exchanged = partial(float, outcomes.number[i, EXCHANGED])
        if has_gained(engine.system, energy[i], engine.problem, engine.duration, exchanged, engine.method.rtol):
            status[i] = Status.UNBALANCED
    return status
