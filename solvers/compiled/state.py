"""The arrays a run changes, the change of a stop's segment with its latched entry rate, and the event list."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any, NamedTuple

import numpy as np

from solvers.compiled.fields import packed_type, zeros_of
from solvers.compiled.kernels import (
    PlanarProblem,
    Problem,
    abs_dot,
    angle_of,
    element_of,
    indentation_and_rate,
    indentation_rate,
    inlined,
    inner,
    is_circle,
    kernel,
    row_of,
    rubs,
    slider_of,
    surface_tolerance,
    work_column,
    xi_and_rate_at,
)
from solvers.compiled.parts import addresses_of
from solvers.compiled.sliding import SLIPPED, begin_slider, end_slider, is_held, pulls, renew_slider, slider_force
from solvers.problem import Array, Contact, Forcing, Law, Status, System
from solvers.problem import event_list as at
from solvers.problem.friction import ACCOUNTS, BEGUN, CODE, FREE, PEAK, SLIDES, STICK, STIFFNESS

STATUSES = list(Status)
DONE, RUNNING, STEP_TOO_SMALL, DIVERGED, CHATTER, LOG_FULL, LAW_NOT_FINITE, GAINED = (
    STATUSES.index(status)
    for status in (
        *[Status.DONE, Status.RUNNING, Status.STEP_TOO_SMALL, Status.DIVERGED],
        *[Status.CHATTER, Status.LOG_FULL, Status.LAW_NOT_FINITE, Status.GAINED],
    )
)
T, H_FLIGHT, H_CONTACT, LAST_EVENT, T_END, LEFT = range(6)  # places in State.now
STEPS, REJECTED, CALLS, EVENTS, LOGGED, SAMPLED, AT_ONCE, RECORDED = range(8)  # places in State.count
T_IN, PEAK_DELTA, PEAK_FORCE = range(3)  # columns of State.active
OUTSIDE = 8.0  # roundings of δ by which a step in contact may leave its segment
MOST_EVENTS_AT_ONCE = 100  # events at one instant above which a run ends with CHATTER
STEP, PART, LANDING, EVENT, RENEWAL = 0.0, 1.0, 2.0, 3.0, 4.0  # kinds of rows of State.event_record
KIND, BEGAN, ENDED, SPAN, FIRST, SECOND, HEAD = range(7)  # columns of State.event_record: FIRST and SECOND are two
# whole numbers whose meaning depends on the kind; from HEAD on the state at the row's start, then the nodes' forces


class State(NamedTuple):
    """All that a run changes; a run can be continued from it.

    `begin_state` fills it; from then on kernels write to it, and `integration` samples at the ends of the run. Units
    as in `kernels.Problem`.
    """

    now: Annotated[Any, "6"]  # s, places named above; the steps are those of `stepping`, for LEFT see `summed`
    x: Annotated[Any, "X"]  # of the blocks, then the energy balance in J (impulses in N s), see `kernels`
    rate: Annotated[Any, "X"]  # of x, per s, where a method needs it
    segment: Annotated[Any, "int E"]  # of the law: 0 in flight, j > 0 between the stop's knots j-1 and j
    entry_rate: Annotated[Any, "E"]  # m/s, latched
    active: Annotated[Any, "E, 3"]  # contacts under way, SI units, columns named above
    count: Annotated[Any, "int 8"]  # steps, rejected steps, law calls, ..., as named above
    log: Annotated[Any, "events, row"]  # the event list, see `problem.event_list`
    out: Annotated[Any, "samples, X"]  # row i gets x at the time due[i]
    due: Annotated[Any, "samples+1"]  # s, the last one infinite
    event_record: Annotated[Any, "rows, record"]  # contact steps and events, for the tangent; else no rows


STATE = packed_type(State)
NO_ROWS = {"events": 0, "row": at.CODE + 1, "samples": 0, "rows": 0, "record": 0}  # sizes of what is not written yet


def new_log(elements: int) -> Any:
    """An event list to be written."""
    return np.empty((max(256, 2 * elements), at.CODE + 1))


@inlined
def summed(total, left, part):
    """A sum with one more part, and the rounding error to be added to the next part (compensated summation).

    Equal steps round to the spacing of numbers at t in the same direction for long: without compensation a clock drifts
    by up to half a spacing per step.
    """
    part += left
    found = total + part
    added = found - total
    return found, (total - (found - added)) + (part - added)


@inlined
def move_clock(now, h):
    """Advance the time by h."""
    now[T], now[LEFT] = summed(now[T], now[LEFT], h)


@inner
def rate_tolerance(problem, s, x):
    """Indentation rate, m/s, up to which a stop counts as at rest: rounding of δ̇, which coupled blocks amplify.

    A start at rest has velocities v of the blocks that are rounding themselves, up to 2e-15 √k |p| where dashpots
    couple the modes; without their share a stop pressed at rest would enter and leave its surface forever.
    """
    found = _rounding_of_rate(problem, row_of(problem, s), x)
    if is_circle(problem, s):
        found += _rounding_of_rate(problem, row_of(problem, s) + 1, x)
    return found


@inner
def _rounding_of_rate(problem, r, x):
    """The same of one row."""
    row, n = problem.read_rate[r], problem.k.size
    from_coupling = 0.0
    for b in range(n):
        from_coupling += abs(row[n + b] * x[b]) * math.sqrt(problem.k[b])
    return 1e-13 * abs_dot(row, x, 2 * n) + 4e-15 * from_coupling


@inner
def write_event(state, kind, began, ended, span, first, second, x):
    """Append a row to the event record: a step or event from ``began``, in the state x, to ``ended``."""
    row = state.event_record[state.count[RECORDED]]
    row[KIND], row[BEGAN], row[ENDED], row[SPAN], row[FIRST], row[SECOND] = kind, began, ended, span, first, second
    for e in range(state.x.size):
        row[HEAD + e] = x[e]
    state.count[RECORDED] += 1


@inner
def latch_entry(problem, state, s, t, delta_dot):
    """Latch the entry rate, m/s, and the time of a contact that begins; its peaks are zero."""
    state.entry_rate[s] = max(abs(delta_dot), problem.floor[s])
    state.active[s, T_IN], state.active[s, PEAK_DELTA], state.active[s, PEAK_FORCE] = t, 0.0, 0.0


@kernel
def begin_contacts(problem, state):
    """Find the segment of every stop at the start, on a knot the one it moves into; begin contacts under way."""
    for s in range(problem.law.size):
        delta, rate = indentation_and_rate(problem, s, state.x)
        segment, tolerance = 0, surface_tolerance(problem, s, state.x)
        while delta > problem.knots[s, segment] + tolerance:
            segment += 1
            tolerance = -abs(tolerance) if rate > rate_tolerance(problem, s, state.x) else tolerance
        state.segment[s] = segment
        if segment > 0:
            latch_entry(problem, state, s, state.now[T], rate)
            state.active[s, PEAK_DELTA] = delta
            if rubs(problem, s):
                _begin_in_contact(problem, state, s, delta > surface_tolerance(problem, s, state.x))


@inner
def _begin_in_contact(problem, state, s, under_way):
    """Begin the friction of a contact that is closed as the run begins, or continue what is latched while N presses."""
    slider = slider_of(problem, s)
    if slider[CODE] == FREE or (under_way and pulls(problem, s, state.entry_rate[s], state.x)):
        begin_slider(problem, s, state.now[T], state.x, state.entry_rate[s], under_way)
    slider[BEGUN] = slider_force(problem, s, state.segment[s], state.entry_rate[s], state.now[T], state.x)
    if slider[CODE] != STICK:
        state.x[problem.friction[s, 1] + 2] = abs(slider[BEGUN]) / slider[STIFFNESS]


@inlined
def is_open(problem, s):
    """Whether a law with memory is in an open segment, where it exerts no force at any indentation."""
    place = problem.opening[s]
    return place >= 0 and problem.parameters[s, place] == 0.0


@inlined
def begins_and_ends(problem, s):
    """Whether the contacts of an element begin and end; other elements act always, at both signs of the indentation."""
    return problem.knots[s, 0] == 0.0 or problem.opening[s] >= 0


@inlined
def acting_segment(problem, state, s):
    """Segment of the law, 0 while it exerts no force."""
    return 0 if is_open(problem, s) else state.segment[s]


@kernel
def event_row(problem, state, s, t, guard, delta, delta_dot, row):
    """Write into a row of the log which event stop s has, and its motion, angle and sums just before.

    Where a border is met, its force then takes the place of the angle, see `renew` and `renew_slider_row`.
    """
    work = work_column(problem, s)
    row[at.ELEMENT], row[at.TIME], row[at.GUARD] = s, t, guard
    row[at.FROM], row[at.TO] = acting_segment(problem, state, s), 0.0
    row[at.DELTA], row[at.RATE], row[at.FORCE], row[at.CODE] = delta, delta_dot, angle_of(problem, s, state.x), -1.0
    row[at.IMPULSE], row[at.WORK] = state.x[work + 1], state.x[work]
    row[at.DEEPEST], row[at.LARGEST] = state.active[s, PEAK_DELTA], state.active[s, PEAK_FORCE]
    row[at.CLIPPED] = 1.0 if abs(delta_dot) < problem.floor[s] else 0.0


@inner
def end_event(problem, state, s, row):
    """Complete the row of an event by the segment of stop s after it; latch what a contact that begins needs."""
    row[at.TO] = acting_segment(problem, state, s)
    if row[at.FROM] == 0.0 and row[at.TO] > 0.0:
        latch_entry(problem, state, s, row[at.TIME], row[at.RATE])
        if rubs(problem, s):
            begin_slider(problem, s, row[at.TIME], state.x, state.entry_rate[s], False)
            row[at.CODE] = slider_of(problem, s)[CODE]
    if row[at.TO] == 0.0 and rubs(problem, s):
        end_slider(problem, s)
    state.count[LOGGED] += 1
    state.count[EVENTS] += 1


@kernel
def slider_row(problem, state, s, t, row):
    """Write work, impulse and path of the friction of stop s by now into a row of the log."""
    account = problem.friction[s, 1]
    row[at.ELEMENT], row[at.TIME], row[at.GUARD], row[at.FROM], row[at.TO] = s, t, at.FRICTION, 1.0, 1.0
    row[at.DELTA], row[at.RATE] = angle_of(problem, s, state.x), xi_and_rate_at(problem, s, t, state.x)[1]
    row[at.WORK], row[at.IMPULSE], row[at.FORCE] = state.x[account], state.x[account + 1], state.x[account + 2]
    row[at.DEEPEST], row[at.LARGEST], row[at.CODE] = 0.0, slider_of(problem, s)[PEAK], -1.0
    row[at.CLIPPED] = 1.0 if state.segment[s] > 0 else 0.0


@inner
def log_slider(problem, state, s):
    """Add a `slider_row` to the log."""
    slider_row(problem, state, s, state.now[T], state.log[state.count[LOGGED]])
    state.count[LOGGED] += 1


@kernel
def log_begin(problem, state):
    """Log all contacts under way as the run begins."""
    for s in range(problem.law.size):
        if acting_segment(problem, state, s) > 0:
            row, delta = state.log[state.count[LOGGED]], state.active[s, PEAK_DELTA]
            event_row(problem, state, s, state.now[T], at.BEGIN, delta, indentation_rate(problem, s, state.x), row)
            row[at.FROM], row[at.TO] = 0.0, row[at.FROM]
            state.count[LOGGED] += 1
            if rubs(problem, s):
                log_slider(problem, state, s)


@inner
def renew_slider_row(problem, state, s, j, row):
    """Begin the segment of a slider behind its border j, and complete the row of the log by it."""
    account, found = problem.friction[s, 1], row[at.DELTA : at.FORCE + 1]
    entry, segment = state.entry_rate[s], state.segment[s]
    row[at.CODE] = renew_slider(problem, s, j, entry, segment, row[at.TIME], state.x, state.rate, found)
    row[at.WORK], row[at.IMPULSE] = state.x[account], state.x[account + 1]
    held = abs(row[at.FORCE]) / slider_of(problem, s)[STIFFNESS]
    state.x[account + 2] += held if row[at.CODE] == SLIPPED else -held
    end_event(problem, state, s, row)


@inlined
def count_event(state):
    """Count the events at one instant."""
    t = state.now[T]
    state.count[AT_ONCE] = state.count[AT_ONCE] + 1 if t == state.now[LAST_EVENT] else 0
    state.now[LAST_EVENT] = t


@inner
def switch(problem, state, s, direction):
    """Move stop s one segment up (direction 1) or down (-1), and log it, after the slip that it ends by a jump of N."""
    t, segment = state.now[T], state.segment[s]
    if state.event_record.shape[0]:
        write_event(state, EVENT, t, t, 0.0, s, direction, state.x)
    level, rate = problem.knots[s, segment - (1 if direction < 0 else 0)], indentation_rate(problem, s, state.x)
    entry, following, within = state.entry_rate[s], segment + direction, segment > 0 and segment + direction > 0
    if within and rubs(problem, s) and is_held(problem, s, entry, segment, following, level, rate):
        row = state.log[state.count[LOGGED]]
        event_row(problem, state, s, t, SLIDES, level, rate, row)
        renew_slider_row(problem, state, s, SLIDES, row)
    row = state.log[state.count[LOGGED]]
    event_row(problem, state, s, t, at.KNOT, level, rate, row)
    state.segment[s] += direction
    end_event(problem, state, s, row)
    if rubs(problem, s) and (state.segment[s] == 0 or row[at.FROM] == 0.0):
        log_slider(problem, state, s)
    count_event(state)


@inlined
def switch_on_surface(problem, state, locates):
    """Switch every stop on a border of its segment that moves out of it; returns whether any did."""
    switched = False
    for s in range(problem.law.size):
        direction = _exit_direction(problem, state, s, locates)
        if direction != 0:
            switch(problem, state, s, direction)
            switched = True
    return switched


@inlined
def _exit_direction(problem, state, s, locates):
    """Direction, 1 or -1, in which a stop on a border of its segment moves out of it, or 0.

    One whose rate is rounding stays, unless it has drifted out of the contact by more than a step may leave it.
    """
    delta, delta_dot = indentation_and_rate(problem, s, state.x)
    tolerance, segment = surface_tolerance(problem, s, state.x) if locates else 0.0, state.segment[s]
    above = delta >= problem.knots[s, segment] - tolerance and delta_dot > 0.0
    if not (above or (segment > 0 and delta <= problem.knots[s, segment - 1] + tolerance)):
        return 0
    if abs(delta_dot) <= rate_tolerance(problem, s, state.x):
        drifted = locates and segment == 1 and delta < problem.knots[s, 0] - OUTSIDE * tolerance
        return -1 if drifted else 0
    return 1 if above else -1 if delta_dot < 0.0 else 0


@inlined
def acts(problem, state, row):
    """Whether the element of a row is in contact."""
    return state.segment[element_of(problem, row)] > 0


@inlined
def in_contact(state):
    """Whether any stop is in contact."""
    most = 0
    for segment in state.segment:
        most = max(most, segment)
    return most > 0


def begin_state(state: State, z: Any) -> None:
    """Make arrays of zeros the state of a run at t = 0 from block coordinates."""
    state.now[1:] = np.inf, np.inf, -1.0, np.inf, 0.0
    state.due[:] = np.inf
    state.x[: len(z)] = z
    state.entry_rate[:] = 1.0


def new_state(z: Any, stops: int, rubbing: int = 0) -> State:
    """State of a run at t = 0 from block coordinates, with so many stops, some of them with friction."""
    width = len(z) + 2 + 2 * stops + ACCOUNTS * rubbing
    state: State = zeros_of(State, {"X": width, "E": stops, **NO_ROWS})._replace(log=new_log(stops))
    begin_state(state, z)
    return state


def problem_of(system: System, forcing: Forcing) -> Problem:
    """The arrays that kernels read, in block coordinates."""
    return _problem(system, forcing, system.about_structure.get("linear", lambda: _linear_part(system)))


def _linear_part(system: System) -> dict[str, Array]:
    """Arrays of the structure, the stops' directions and the loads' vectors."""
    blocks, n = system.blocks, system.size
    direction, vectors = directions_of(system), _vectors(system)
    linear = {
        **{"k": blocks.k, "c": blocks.c, "loss": np.ascontiguousarray(blocks.loss)},
        "push": np.ascontiguousarray(direction @ system.push.T),
        "read": np.ascontiguousarray(-direction @ blocks.T[:n]),
        "load": np.ascontiguousarray(vectors @ system.push.T),
        "power": np.ascontiguousarray(vectors @ blocks.T[n:]),
    }
    return {**linear, "read_rate": rate_rows(linear["read"], blocks.k, blocks.c)}


def matrix_problem_of(system: System, forcing: Forcing) -> Problem:
    """The same in the system's own coordinates without M, C and K: pushes and loads are forces, and `rhs` their sum."""
    zeros = np.zeros(system.size)
    direction, vectors = directions_of(system), _vectors(system)
    linear = {
        **{"k": zeros, "c": zeros, "loss": np.empty((0, 0))},
        **{"push": np.hstack((0.0 * direction, direction)), "read": np.hstack((-direction, 0.0 * direction))},
        "read_rate": np.hstack((0.0 * direction, -direction)),
        **{"load": np.hstack((0.0 * vectors, vectors)), "power": np.hstack((0.0 * vectors, vectors))},
    }
    return _problem(system, forcing, linear)


def directions_of(system: System) -> Array:
    """Directions of all rows (R, n)."""
    return np.concatenate([np.empty((0, system.size)), *(c.rows for c in system.contacts)])


def first_rows(contacts: Sequence[Contact]) -> Array:
    """(E + 1,) first row of each contact, and the end."""
    return np.cumsum([0, *(len(c.rows) for c in contacts)], dtype=np.int64)


def gaps_of(contacts: Sequence[Contact]) -> Array:
    """(R,) gaps of all rows."""
    return np.concatenate([np.empty(0), *(c.row_gaps for c in contacts)])


def radii_of(contacts: Sequence[Contact]) -> Array:
    """(E,) radii of circular clearances, see `Problem`; (0,) if there is none."""
    radii = np.array([c.circle for c in contacts], dtype=float)
    return radii if radii.any() else np.empty(0)


def frictions_of(contacts: Sequence[Contact], size: int) -> Any:
    """(E, 2) see `Problem.friction`, behind a state of 2n = ``size``; (0, 2) if no contact has any."""
    rubs = np.array([c.friction is not None for c in contacts], dtype=bool)
    first = size + 2 + 2 * len(contacts)
    place = [getattr(c.law, "place", 0) if c.friction else 0 for c in contacts]
    table = np.column_stack((place, np.where(rubs, first + ACCOUNTS * (np.cumsum(rubs) - 1), 0))).astype(np.int64)
    return table if rubs.any() else np.empty((0, 2), dtype=np.int64)


def _vectors(system: System) -> Array:
    """Vectors of the loads (L, n)."""
    return np.array([vector for vector, _ in system.loads]).reshape(len(system.loads), system.size)


def _problem(system: System, forcing: Forcing, linear: dict[str, Array]) -> Problem:
    """The linear arrays with those of the laws and the signals."""
    contacts, m = system.contacts, len(system.contacts)
    most = max([len(c.law.knots) for c in contacts], default=0) + 1
    knots = np.full((m, most + 1), math.inf)
    for i, contact in enumerate(contacts):
        knots[i, : len(contact.law.knots) + 1] = (-math.inf if contact.always else 0.0, *contact.law.knots)
    kind = Problem if all(len(c.rows) == 1 for c in contacts) else PlanarProblem
    return kind(
        **linear,
        knots=knots,
        gap=gaps_of(contacts),
        radius=radii_of(contacts),
        friction=frictions_of(contacts, 2 * len(linear["k"])),
        first=first_rows(contacts),
        element=np.repeat(np.arange(m), [len(c.rows) for c in contacts]).astype(np.int64),
        own=_own_places(contacts),
        law=np.array([c.law.address for c in contacts], dtype=np.int64),
        gradient=np.array([c.law.gradient_address for c in contacts], dtype=np.int64),
        parameters=law_parameters(system),
        floor=np.array([c.law.entry_rate_floor for c in contacts], dtype=float),
        borders=_integers(contacts, "borders_address"),
        renewal=_integers(contacts, "renew_address"),
        border_count=_integers(contacts, "borders"),
        latched=_latched(contacts),
        by_latched=_integers(contacts, "memory_gradient_address"),
        by_renewal=_integers(contacts, "renew_gradient_address"),
        opening=np.array([_opening(c.law) for c in contacts], dtype=np.int64),
        parts=addresses_of(kind),
        **vars(forcing),
    )


def _own_places(contacts: Sequence[Contact]) -> Array:
    """(E,) see `Problem.own`."""
    first, circle = first_rows(contacts), np.array([c.circle != 0.0 for c in contacts], dtype=bool)
    places: Array = np.where(circle, first[-1] + np.cumsum(circle) - 1, first[:-1]).astype(np.int64)
    return places


def most_borders(problem: Problem) -> int:
    """The largest number of borders of any law."""
    return int(problem.border_count.max(initial=0))


def _integers(contacts: Sequence[Any], name: str) -> Array:
    """(E,) whole numbers of the laws, 0 where a law does not know of them."""
    return np.array([getattr(contact.law, name, 0) for contact in contacts], dtype=np.int64)


def _latched(contacts: Sequence[Any]) -> Any:
    """(E, l) places of the latched numbers among the parameters, padded by -1."""
    places = [getattr(contact.law, "memory", ()) for contact in contacts]
    table = np.full((len(contacts), max([len(row) for row in places], default=0)), -1, dtype=np.int64)
    for row, own in zip(table, places, strict=True):
        row[: len(own)] = own
    return table


def _opening(law: Any) -> int:
    """Place of the segment code that is 0 while the law is open, or -1."""
    return int(law.memory[0]) if getattr(law, "opens", False) else -1


def law_parameters(system: System) -> Array:
    """Parameters of the laws (E, P), padded by zeros."""
    return parameters_of([contact.law for contact in system.contacts])


def parameters_of(laws: Sequence[Law]) -> Array:
    """Parameters of laws (E, P), padded by zeros."""
    parameters = [np.asarray(law.parameters, dtype=float) for law in laws]
    table = np.zeros((len(parameters), max([p.size for p in parameters], default=1)))
    for row, own in zip(table, parameters, strict=True):
        row[: own.size] = own
    return table


def rate_rows(read: Array, k: Array, c: Array) -> Array:
    """Rows of δ̇ from rows of δ: r A with A = [[0, 1], [-k, -c]] per block."""
    p, v = read[:, : k.size], read[:, k.size :]
    return np.ascontiguousarray(np.concatenate((-v * k, p - v * c), axis=1))
