"""The main method: exact flight, collocated contact, every event landed on.

A tone Re(a e^{iΩt}) of a load is subtracted as its steady response, which then is one more undamped block with
k = Ω², c = 0 that no force pushes; so flight under tones is an autonomous linear system and exact in one
multiplication per block. Sampled signals are quintics per cell, exact likewise. `safe_steps` proves flight steps
safe, `contact` solves the contacts and lands on their ends.

Limitations
-----------
* In flight no contact of the model is missed, however short. While one stop is in contact the others are watched by
  polynomials through 8 nodes per step: of 16 000 contacts 1e-4 to 1e-1 of the amplitude deep none was missed
  (`python tests/bench/second_contacts.py 100`), but nothing is proven.
* Touching is no contact: a stop counts as entered where δ becomes positive. An entry at rest counts when δ̈ > 0; one
  at rest that another stop's force brings about is noticed a shortest step (1e-9 s) late.
* A law that bends elsewhere than at its declared knots and its `bend` is integrated with smaller steps, at lower order;
  so is the beginning of one whose powers of δ are no multiples of 1/4. The tolerance is kept.
* K and C must be positive semi-definite (no buckled modes, no negative damping; a contact law may drive).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numba import types

from solvers.compiled.handles import Cast, Packed, opener
from solvers.compiled.kernels import MATRIX, PROBLEM, REAL, VECTOR, entry
from solvers.compiled.renewals import most_rows
from solvers.compiled.state import (
    AT_ONCE,
    CHATTER,
    DONE,
    LOG_FULL,
    LOGGED,
    MOST_EVENTS_AT_ONCE,
    REJECTED,
    RUNNING,
    STATE,
    STEPS,
    TAPED,
    State,
    T,
    begin_contacts,
    switch,
    switch_on_surface,
    touching,
)
from solvers.exponential.contact.landing import reach
from solvers.exponential.contact.step import BEGUN, FRESH, begin, latest, touch
from solvers.exponential.energy.books import book_on, mark
from solvers.exponential.energy.flight_tables import BOOKS, NO_BOOKS
from solvers.exponential.energy.guard import FIRST, note_energy, own_energy, too_much, unknown
from solvers.exponential.preparation import SPACE, TABLES, ready_for
from solvers.exponential.safe_steps import fly
from solvers.problem import Array, Forcing, System

_problem, _tables, _state, _space = opener(PROBLEM), opener(TABLES), opener(STATE), opener(SPACE)
_books = opener(BOOKS)


@entry(types.int64(*[types.int64] * 5, REAL, types.int64, REAL, REAL, MATRIX, MATRIX, VECTOR))
def advance(problem_at, tables_at, state_at, space_at, books_at, t_end, budget, rtol, reach, log, out, due):
    """Advance the state to ``t_end`` or for about ``budget`` steps; returns a status code.

    ``out`` gets the states at the times ``due``, the last of which is infinite; ``reach`` is that of `landing.reach`.
    """
    problem, tables, state, space = _problem(problem_at), _tables(tables_at), _state(state_at), _space(space_at)
    books, last = _books(books_at), space.last
    if not last[BEGUN]:
        last[BEGUN], space.reach[0] = 1, reach
        space.energy[FIRST] = own_energy(problem, tables, state.x)
        begin_contacts(problem, state)
        if touching(state):
            begin(problem, tables, state, space, latest(state))
    begun, rows = state.count[STEPS] + state.count[REJECTED], most_rows(problem)
    while state.count[STEPS] + state.count[REJECTED] - begun < budget:
        if state.now[T] >= t_end:
            note_energy(problem, tables, state, space)
            return DONE
        if state.count[LOGGED] + rows > log.shape[0]:
            return LOG_FULL
        if state.tape.shape[0] and state.count[TAPED] + rows + 2 > state.tape.shape[0]:
            return RUNNING
        if state.count[AT_ONCE] > MOST_EVENTS_AT_ONCE:
            return CHATTER
        between = touching(state) and not last[FRESH]  # in a contact no border is met but by landing on it
        if not between and switch_on_surface(problem, state, log, True):
            if touching(state):
                begin(problem, tables, state, space, latest(state))
            continue
        if touching(state):
            code = touch(problem, tables, books, state, space, t_end, rtol, log, out, due)
            if code != RUNNING:
                return code
            continue
        if books.kept > 0.0:
            mark(problem, state, space)
        stop = fly(problem, tables, books, state, space, t_end, budget, out, due)
        if books.kept > 0.0:
            book_on(problem, tables, books, state, space)
        if stop >= 0:
            switch(problem, state, stop, np.int64(1), log)  # a literal would be compiled for itself
            begin(problem, tables, state, space, stop)
    return RUNNING


@dataclass(frozen=True)
class Exponential:
    """Exact flight and collocated contact; the library's best method for any linear structure with stops.

    Parameters
    ----------
    rtol : error of an indentation rate that one contact step may make, relative to the speed of entry (or a tenth of
        what the motion could reach at the stop, whichever is larger), in [1e-12, 1e-2]. Flight is exact.
    ledger : keep the energy ledger of runs with output samples, by closed forms of the steps; without it their input
        and damping are NaN, the motion is the same and 1.5 to 2.7 times as quick. Runs with ``dt=None`` keep none.

    Notes
    -----
    Cost is nearly independent of rtol and grows linearly with the number of modes. See the module for its limits. A run
    with a ledger that leaves more than (20 rtol + 1e-9) of the energy handled unaccounted for is refused, one without
    if it ends with four times the energy it can have been given, see `energy.guard`.

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


def _spacing(due: Array) -> float:
    """Time between two outputs, s."""
    return float(due[1] - due[0]) if len(due) > 2 else 1.0


class Engine:
    """One run: problem with tones among the blocks, tables, state."""

    def __init__(self, method: Exponential, system: System, z: Array, forcing: Forcing, duration: float) -> None:
        self.method, self.system, self.duration, self.reach = method, system, duration, reach(method.rtol)
        forcing, prepared = ready_for(system, forcing, duration, method.rtol)
        self.back = prepared.back
        packed: Cast | Packed = prepared.problem
        own: dict[str, Array] = {}
        if forcing.table.size:
            own = {"table": forcing.table, "table_start": forcing.table_start}
        if prepared.problem.value.border_count.any():  # laws latch numbers among their parameters
            own["parameters"] = prepared.problem.value.parameters.copy()
        if own:
            packed = Packed(packed.value._replace(**own), PROBLEM)
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

    def gains(self, exchanged: Array) -> bool:
        """Whether the finished run holds more energy than it can have been given."""
        slack = unknown(self.workspace.energy[FIRST], exchanged, self.method.rtol)
        return too_much(self.system, self.workspace.energy, self.problem, self.duration, slack)

    def march(self, budget: int, log: Array, out: Array, due: Array) -> int:
        """Go on for a stretch."""
        books = self.prepared.books_for(_spacing(due)) if self.keeps_ledger(len(out) > 0) else NO_BOOKS
        return advance(
            *(*self.addresses, books.address, self.duration, budget, self.method.rtol, self.reach),
            *(log, out, due),
        )
