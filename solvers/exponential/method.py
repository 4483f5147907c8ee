"""The main method: exact flight, collocated contact, every event located.

A tone Re(a e^{iΩt}) of a load is subtracted as its steady response, which becomes one more undamped block with k = Ω²,
c = 0 that no force pushes; so flight under tones is an autonomous linear system and exact in one multiplication per
block. Sampled signals are quintics per cell, and flight under them is exact, too. `safe_steps` proves flight steps free
of contact, `contact` solves the contacts and locates their ends.

Limitations
-----------
* In flight no contact of the model is missed, however short. While one stop is in contact the others are checked by
  polynomials through 8 nodes per step: of 16 000 contacts 1e-4 to 1e-1 of the amplitude deep none was missed
  (`python tests/bench/second_contacts.py 100`), but this is not proven.
* A contact begins where δ becomes positive; δ = 0 alone is no contact. An entry with δ̇ = 0 counts if δ̈ > 0; where
  the force of another stop causes such an entry, it is found one shortest step (at most 1e-9 s) late.
* A law with a kink elsewhere than at its declared knots and its `bend` is integrated with smaller steps, at lower
  order; so is the start of a contact whose law has powers of δ that are no multiples of 1/4. The tolerance is kept.
* K must be positive semi-definite (no buckled modes), and no damped mode may grow (C may be indefinite; a contact law
  may drive).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np
from numba import types

from solvers.compiled.kernels import PLANAR_PROBLEM, PROBLEM, PlanarProblem, entry, merged, type_of
from solvers.compiled.packed import unpacker
from solvers.compiled.renewals import most_rows
from solvers.compiled.state import (
    AT_ONCE,
    CHATTER,
    DONE,
    LOG_FULL,
    LOGGED,
    MOST_EVENTS_AT_ONCE,
    RECORDED,
    REJECTED,
    RUNNING,
    STATE,
    STEPS,
    T_END,
    State,
    T,
    begin_contacts,
    in_contact,
    log_begin,
    switch,
    switch_on_surface,
)
from solvers.exponential.contact.collocation import note_signals
from solvers.exponential.contact.first_step import BALANCED, BEGUN, NEW, begin_steps, latest_entered
from solvers.exponential.contact.step import advance_contact
from solvers.exponential.energy.check import FIRST, has_gained, note_energy, own_energy
from solvers.exponential.energy.flight_balance import account_state, start_account
from solvers.exponential.energy.flight_tables import ENERGY_TABLES, NO_ENERGY_TABLES
from solvers.exponential.preparation import SCRATCH, TABLES, Prepared, Run, prepare_run, shorten
from solvers.exponential.safe_steps import fly
from solvers.problem import Array, Forcing, Status, System
from solvers.problem.matrices import number

_problem, _planar_problem, _tables = unpacker(PROBLEM), unpacker(PLANAR_PROBLEM), unpacker(TABLES)
_state, _scratch, _energy_tables = unpacker(STATE), unpacker(SCRATCH), unpacker(ENERGY_TABLES)
ADVANCE = types.int64(*[types.int64] * 6)


@merged
def _advance(problem, tables_at, state_at, scratch_at, energy_at, budget):
    """Advance the state to the end of the run or for about ``budget`` steps; returns a status code."""
    tables, state, scratch = _tables(tables_at), _state(state_at), _scratch(scratch_at)
    energy_tables, control = _energy_tables(energy_at), scratch.control
    run = Run(problem, tables, energy_tables, state, scratch)
    if not control[BEGUN]:
        control[BEGUN], control[BALANCED] = 1, 1 if energy_tables.active > 0.0 else 0
        scratch.energy[FIRST] = own_energy(run, state.x)
        note_signals(run)
        begin_contacts(problem, state)
        log_begin(problem, state)
        if in_contact(state):
            begin_steps(run, latest_entered(state))
    begun, rows = state.count[STEPS] + state.count[REJECTED], most_rows(problem)
    while state.count[STEPS] + state.count[REJECTED] - begun < budget:
        if state.now[T] >= state.now[T_END]:
            note_energy(run)
            return DONE
        if state.count[LOGGED] + rows > state.log.shape[0]:
            return LOG_FULL
        if state.event_record.shape[0] and state.count[RECORDED] + rows + 2 > state.event_record.shape[0]:
            return RUNNING
        if state.count[AT_ONCE] > MOST_EVENTS_AT_ONCE:
            return CHATTER
        between = in_contact(state) and not control[NEW]  # within a contact borders are reached by landings only
        if not between and switch_on_surface(problem, state, True):
            if in_contact(state):
                begin_steps(run, latest_entered(state))
            continue
        if in_contact(state):
            code = advance_contact(run)
            if code != RUNNING:
                return code
            continue
        if energy_tables.active > 0.0:
            start_account(run)
        stop = fly(run, budget)
        if energy_tables.active > 0.0:
            account_state(run)
        if stop >= 0:
            switch(problem, state, stop, np.int64(1))  # a literal would be compiled for itself
            begin_steps(run, stop)
    return RUNNING


def _advance_line(problem_at, tables_at, state_at, scratch_at, energy_at, budget):
    """The loop for a `Problem`."""
    return _advance(_problem(problem_at), tables_at, state_at, scratch_at, energy_at, budget)


def _advance_plane(problem_at, tables_at, state_at, scratch_at, energy_at, budget):
    """The loop for a `PlanarProblem`."""
    return _advance(_planar_problem(problem_at), tables_at, state_at, scratch_at, energy_at, budget)


@lru_cache(maxsize=2)
def advance_of(planar: bool) -> Any:
    """The compiled loop for a type of problem."""
    return entry(ADVANCE)(_advance_plane if planar else _advance_line)


@dataclass(frozen=True)
class Exponential:
    """Exact flight and collocated contact; the library's best method for any linear structure with stops.

    Parameters
    ----------
    rtol : error of an indentation rate that one contact step may make, relative to the speed of entry (or a tenth of
        what the motion could reach at the stop, whichever is larger), in [1e-12, 1e-2]. Flight is exact. Later
        contacts multiply such errors as they multiply any change of the state. The force of an element with memory is
        resolved to 10 rtol of its largest besides, so that its work and loss are right where it hardly moves anything.
    ledger : keep the energy balance of runs with output samples, by closed forms of the steps; without it their input
        and damping are NaN, the motion is the same and 1.25 to 1.55 times as quick. Runs with ``dt=None`` keep none.

    Notes
    -----
    Cost is nearly independent of rtol and grows linearly with the number of modes. See the module for the limits. A run
    whose energy balance has a residual above (20 rtol + 1e-9) of the energy handled is refused; a run without a balance
    is refused if it ends with four times the energy it can have been given, see `energy.check`.

    Examples
    --------
    >>> Exponential(rtol=1e-10).rtol
    1e-10
    """

    rtol: float = 1e-8
    ledger: bool = True
    has_tangent: ClassVar[bool] = True
    takes_annuli: ClassVar[bool] = True
    takes_friction: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if not 1e-12 <= number(self.rtol, "rtol") <= 1e-2:
            raise ValueError(f"rtol must lie in [1e-12, 1e-2], got {self.rtol!r}")
        if not isinstance(self.ledger, (bool, np.bool_)):
            raise ValueError(f"ledger must be True or False, got {self.ledger!r}")

    def prepared(self, system: System, forcing: Forcing, duration: float) -> tuple[Forcing, Prepared]:
        """The forcing as it is run, and the tables: what all starts share."""
        return prepare_run(system, forcing, duration, self.rtol)

    def engine(self, system: System, z: Array, prepared: tuple[Forcing, Prepared], duration: float) -> Engine:
        """The method made ready for one run."""
        return Engine(self, system, z, prepared, duration)


_KEPT = 100_000  # numbers of outputs for which a workspace keeps the room


def _spacing(due: Array) -> float:
    """Time between two outputs, s."""
    return float(due[1] - due[0]) if len(due) > 2 else 1.0


class Engine:
    """One run: the problem with a block per tone, its tables, its state."""

    watched: ClassVar[bool] = False

    def __init__(
        self, method: Exponential, system: System, z: Array, prepared: tuple[Forcing, Prepared], duration: float
    ) -> None:
        self.method, self.system, self.duration = method, system, duration
        self.prepared = prepared[1]
        self.back, self.packed = self.prepared.back, self.prepared.problem
        if system.latches:  # laws latch numbers among their parameters
            own = self.packed.value.parameters.copy()
            self.packed = self.packed.replaced(type_of(self.packed.value), parameters=own)
        self.problem = self.packed.value
        self.advance = advance_of(isinstance(self.problem, PlanarProblem))
        self.workspace = self.prepared.workspace()
        self.workspace.begin(z, duration, method.rtol)
        self.addresses = self.packed.address, self.prepared.tables.address, *self.workspace.addresses

    @property
    def state(self) -> State:
        """The state reached."""
        return self.workspace.state

    def sample(self, times: Array | None) -> None:
        """Make room for outputs at times; None if the end alone is kept."""
        if times is not None:
            self.workspace.sample(times, self.duration)
        elif self.workspace.times is not None:
            self.workspace.forget_outputs()

    def record(self, **arrays: Array) -> None:
        """Replace arrays of the state that outputs go to: ``log``, ``event_record``."""
        self.workspace.replace(**arrays)

    def release(self) -> None:
        """Leave the workspace to another run; this run's state must not be read any more."""
        if not self.workspace.state.event_record.size:
            if self.workspace.state is not self.workspace.ready or self.workspace.state.out.size > _KEPT:
                self.workspace.forget_outputs()
            self.prepared.spare_workspaces.append(self.workspace)

    def start(self) -> None:
        """Nothing to do: the compiled loop starts by itself."""

    def shorten(self) -> bool:
        """Let the next run of the system take shorter contact steps, unless these would be rounding of time."""
        return shorten(self.system, float(self.prepared.tables.value.contact_step[-1]), self.duration)

    def explain(self, status: Status) -> str:
        """Nothing beyond the status."""
        return ""

    def keeps_ledger(self, sampled: bool) -> bool:
        """Whether input and damping of the energy balance are known."""
        return self.method.ledger and sampled

    def has_gained(self, exchanged: Callable[[], Array]) -> bool:
        """Whether the finished run holds more energy than it can have been given."""
        return has_gained(self.system, self.workspace.energy, self.problem, self.duration, exchanged, self.method.rtol)

    def march(self, budget: int) -> int:
        """Advance by about ``budget`` steps."""
        energy_tables, due = NO_ENERGY_TABLES, self.state.due
        if self.keeps_ledger(len(due) > 1):
            energy_tables = self.prepared.energy_tables_for(_spacing(due))
        return self.advance(*self.addresses, energy_tables.address, budget)
