"""THE main loop of the stepping methods: try a step, look for events, land, accept, record.

A method is one compiled ``step`` of declared signature, so a new method does not recompile the loop.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit, types

from solvers.events import (
    NONE,
    UNRESOLVED,
    coefficients_of,
    entry_by_sign,
    first_event,
    polynomial,
    surface_tolerance,
)
from solvers.henon import hermite
from solvers.henon import land as henon_landing
from solvers.kernels import OPTIONS, PROBLEM, contact_forces, copy, dot, indentation, kernel, rhs
from solvers.result import COLUMNS, Status

_VECTOR = types.Array(types.float64, 1, "C")
_MATRIX = types.Array(types.float64, 2, "C")
_INTEGERS = types.Array(types.int64, 1, "C")
_REAL = types.float64

STEP = types.FunctionType(
    types.Tuple([_REAL, types.int64])(
        *[PROBLEM, _REAL, _REAL, _VECTOR, _VECTOR, _INTEGERS, _VECTOR],
        *[_VECTOR, _VECTOR, _MATRIX, _MATRIX, _REAL, _REAL],
    )
)

_CODES = list(Status)
DONE, RUNNING, STEP_TOO_SMALL, DIVERGED, CHATTER, LOG_FULL, LAW_NOT_FINITE = (
    _CODES.index(status)
    for status in (
        *[Status.DONE, Status.RUNNING, Status.STEP_TOO_SMALL, Status.DIVERGED],
        *[Status.CHATTER, Status.LOG_FULL, Status.LAW_NOT_FINITE],
    )
)
T, H_FLIGHT, H_CONTACT, LAST_EVENT = range(4)  # places in State.now
STEPS, REJECTED, CALLS, EVENTS, LOGGED, SAMPLED, AT_ONCE = range(7)  # places in State.count
T_IN, SPEED_IN, PEAK_DELTA, PEAK_FORCE, WORK_IN, IMPULSE_IN, FLOORED = range(7)  # columns of State.open
_PEAK_NODES = np.linspace(0.0, 1.0, 9)
_EVENTS_AT_ONCE = 100


class State(NamedTuple):
    """Everything a run changes; it can be continued from here."""

    now: Any  # time, flight step, contact step, time of the last event
    x: Any
    rate: Any
    piece: Any  # (m,) 0 in flight, j > 0 between levels j-1 and j
    entry_rate: Any  # (m,) latched
    open: Any  # (m, 7) of the contacts under way
    count: Any


class Space(NamedTuple):
    """Working arrays of the loop."""

    x_new: Any
    rate_new: Any
    dense: Any
    work: Any
    coefficients: Any  # (2, 8)


STATE = types.NamedTuple(
    [_VECTOR, _VECTOR, _VECTOR, _INTEGERS, _VECTOR, _MATRIX, _INTEGERS],
    State,
)
SPACE = types.NamedTuple([_VECTOR, _VECTOR, _MATRIX, _MATRIX, _MATRIX], Space)


@kernel
def start(problem, state, space):
    """Put every stop on its piece and evaluate the first rate."""
    t = state.now[T]
    for s in range(problem.gap.size):
        delta = indentation(problem, s, state.x)
        piece = 0
        while delta > problem.levels[s, piece]:
            piece += 1
        state.piece[s] = piece
        if piece > 0:
            _open(problem, state, s, t, dot(problem.read_rate[s], state.x, 2 * problem.k.size))
            state.open[s, PEAK_DELTA] = delta
    state.count[CALLS] += rhs(problem, t, state.x, state.piece, state.entry_rate, state.rate, space.work[0])


@kernel
def _open(problem, state, s, t, delta_dot):
    """Latch the entry rate and begin a row of the contact log."""
    ledger = 2 * problem.k.size + 2 + 2 * s
    state.entry_rate[s] = max(abs(delta_dot), problem.floor[s])
    state.open[s, T_IN] = t
    state.open[s, SPEED_IN] = delta_dot
    state.open[s, PEAK_DELTA] = 0.0
    state.open[s, PEAK_FORCE] = 0.0
    state.open[s, WORK_IN] = state.x[ledger]
    state.open[s, IMPULSE_IN] = state.x[ledger + 1]
    state.open[s, FLOORED] = 1.0 if abs(delta_dot) < problem.floor[s] else 0.0


@kernel
def contact_row(problem, state, s, t_out, speed_out, row):
    """Write the log row of the contact under way at stop s."""
    ledger = 2 * problem.k.size + 2 + 2 * s
    row[0] = s
    row[1] = state.open[s, T_IN]
    row[2] = t_out
    row[3] = state.open[s, SPEED_IN]
    row[4] = speed_out
    row[5] = state.open[s, PEAK_DELTA]
    row[6] = state.open[s, PEAK_FORCE]
    row[7] = state.x[ledger + 1] - state.open[s, IMPULSE_IN]
    row[8] = state.x[ledger] - state.open[s, WORK_IN]
    row[9] = state.open[s, FLOORED]


@kernel
def _switch(problem, state, s, direction, log):
    """Move stop s one piece up or down; open or close its contact."""
    t = state.now[T]
    delta_dot = dot(problem.read_rate[s], state.x, 2 * problem.k.size)
    if direction > 0 and state.piece[s] == 0:
        _open(problem, state, s, t, delta_dot)
    if direction < 0 and state.piece[s] == 1:
        contact_row(problem, state, s, t, -delta_dot, log[state.count[LOGGED]])
        state.count[LOGGED] += 1
    state.piece[s] += direction
    state.count[EVENTS] += 1
    state.count[AT_ONCE] = state.count[AT_ONCE] + 1 if t == state.now[LAST_EVENT] else 0
    state.now[LAST_EVENT] = t


@kernel
def _switch_on_surface(problem, state, log, locates):
    """Switch every stop that sits on a border of its piece and moves out of it; returns whether any did."""
    switched = False
    for s in range(problem.gap.size):
        delta = indentation(problem, s, state.x)
        delta_dot = dot(problem.read_rate[s], state.x, 2 * problem.k.size)
        tolerance = surface_tolerance(problem, s, state.x) if locates else 0.0
        if delta >= problem.levels[s, state.piece[s]] - tolerance and delta_dot > 0.0:
            _switch(problem, state, s, 1, log)
            switched = True
        elif state.piece[s] > 0 and delta <= problem.levels[s, state.piece[s] - 1] + tolerance and delta_dot < 0.0:
            _switch(problem, state, s, -1, log)
            switched = True
    return switched


@kernel
def _touching(state):
    """Whether any stop is in contact."""
    most = 0
    for piece in state.piece:
        most = max(most, piece)
    return most > 0


@kernel
def _peaks(problem, state, space):
    """Largest indentation and force of the step just accepted, for every stop in contact."""
    delta_of, rate_of = space.coefficients[0], space.coefficients[1]
    for s in range(problem.gap.size):
        if state.piece[s] == 0:
            continue
        coefficients_of(problem.read[s], problem.gap[s], state.x, space.dense, delta_of)
        coefficients_of(problem.read_rate[s], 0.0, state.x, space.dense, rate_of)
        for column in (PEAK_DELTA, PEAK_FORCE):
            best, place = -np.inf, 0
            for i in range(_PEAK_NODES.size):
                value = _peak_value(problem, state, s, column, delta_of, rate_of, _PEAK_NODES[i], space.work[0])
                if value > best:
                    best, place = value, i
            if best > 0.9 * state.open[s, column]:
                a = _PEAK_NODES[max(place - 1, 0)]
                b = _PEAK_NODES[min(place + 1, _PEAK_NODES.size - 1)]
                for _ in range(36):  # golden section
                    c, d = b - 0.6180339887498949 * (b - a), a + 0.6180339887498949 * (b - a)
                    at_c = _peak_value(problem, state, s, column, delta_of, rate_of, c, space.work[0])
                    at_d = _peak_value(problem, state, s, column, delta_of, rate_of, d, space.work[0])
                    if at_c > at_d:
                        b = d
                    else:
                        a = c
                    best = max(best, at_c, at_d)
                state.open[s, column] = max(state.open[s, column], best)


@kernel
def _peak_value(problem, state, s, column, delta_of, rate_of, theta, batch):
    """Indentation or force at θ of the step."""
    batch[0] = polynomial(delta_of, theta)
    if column == PEAK_DELTA:
        return batch[0]
    batch[1] = polynomial(rate_of, theta)
    contact_forces(problem, s, batch[0:1], batch[1:2], state.entry_rate[s], batch[2:3])
    return batch[2]


@kernel
def _sample(state, space, h, out, dt):
    """Write the output samples that lie within the step."""
    t = state.now[T]
    while state.count[SAMPLED] < out.shape[0] and state.count[SAMPLED] * dt <= t + h:
        theta = min(max((state.count[SAMPLED] * dt - t) / h, 0.0), 1.0) if h > 0.0 else 0.0
        row, u = out[state.count[SAMPLED]], 1.0 - theta
        for i in range(state.x.size):
            value = 0.0
            for j in range(6, -1, -1):
                value = space.dense[j, i] + (u if j % 2 == 0 else theta) * value
            row[i] = state.x[i] + theta * value
        state.count[SAMPLED] += 1


@kernel
def _land(step, problem, state, space, h, stop, level, rtol, atol):
    """Repeat the step with the duration that ends on ``level``: Newton on the true step; returns it."""
    tolerance = surface_tolerance(problem, stop, state.x)
    longest = 1.000001 * h
    for _ in range(6):
        _, calls = step(
            *(problem, state.now[T], h, state.x, state.rate, state.piece, state.entry_rate),
            *(space.x_new, space.rate_new, space.dense, space.work, rtol, atol),
        )
        state.count[CALLS] += calls
        distance = indentation(problem, stop, space.x_new) - level
        delta_dot = dot(problem.read_rate[stop], space.x_new, 2 * problem.k.size)
        if abs(distance) <= tolerance or delta_dot == 0.0:
            break
        corrected = h - distance / delta_dot
        if not (0.0 < corrected <= longest) or corrected == h:
            break
        h = corrected
    return h


@njit(
    types.int64(
        *[STEP, PROBLEM, STATE, SPACE, _REAL, types.int64, _REAL, _REAL],
        *[_REAL, _REAL, types.boolean, types.boolean, _MATRIX, _MATRIX, _REAL],
    ),
    **OPTIONS,
)
def march(
    step,
    problem,
    state,
    space,
    t_end,
    budget,
    dt_flight,
    dt_contact,
    rtol,
    atol,
    adaptive,
    locates,
    log,
    out,
    dt,
):
    """Advance the state to ``t_end`` or for ``budget`` steps; returns a status code."""
    now, count, stops = state.now, state.count, problem.gap.size
    for _ in range(budget):
        # --- end of the run, and what can stop it early
        if now[T] >= t_end:
            return DONE
        if count[LOGGED] + stops > log.shape[0]:
            return LOG_FULL
        if count[AT_ONCE] > _EVENTS_AT_ONCE:
            return CHATTER
        if _switch_on_surface(problem, state, log, locates):
            count[CALLS] += rhs(problem, now[T], state.x, state.piece, state.entry_rate, state.rate, space.work[0])
            continue

        # --- try a step
        phase = H_CONTACT if _touching(state) else H_FLIGHT
        h = min(now[phase], dt_contact if phase == H_CONTACT else dt_flight, t_end - now[T])
        if now[T] + h == now[T] and h < t_end - now[T]:
            return STEP_TOO_SMALL if np.isfinite(dot(state.rate, state.rate, state.rate.size)) else LAW_NOT_FINITE
        error, calls = step(
            *(problem, now[T], h, state.x, state.rate, state.piece, state.entry_rate),
            *(space.x_new, space.rate_new, space.dense, space.work, rtol, atol),
        )
        count[CALLS] += calls
        if adaptive and not error <= 1.0:
            now[phase] = h * max(0.2, 0.9 * error**-0.125) if error > 1.0 else 0.2 * h
            count[REJECTED] += 1
            continue

        # --- events
        stop, direction, landed = -1, 0, False
        if locates:
            theta, stop, direction = first_event(problem, state.x, space.dense, state.piece, space.coefficients[0])
            if theta == UNRESOLVED:
                now[phase] = h / 32.0
                count[REJECTED] += 1
                continue
            if theta < NONE:
                level = problem.levels[stop, state.piece[stop] - (1 if direction < 0 else 0)]
                h, landed = _land(step, problem, state, space, theta * h, stop, level, rtol, atol), True
        elif dt_contact < h:  # the paper's scheme: an entry in a flight step is landed on by Hénon's trick
            theta, stop = entry_by_sign(problem, state.x, space.x_new, state.piece)
            if theta < NONE:
                duration = henon_landing(
                    *(problem, now[T], h, state.x, state.rate, state.piece, state.entry_rate),
                    *(stop, 0.0, space.x_new, space.work),
                )
                if duration < 0.0:
                    now[H_FLIGHT] = dt_contact
                    count[REJECTED] += 1
                    continue
                h, direction, landed = duration, 1, True
                count[CALLS] += rhs(
                    *(problem, now[T] + h, space.x_new, state.piece, state.entry_rate),
                    *(space.rate_new, space.work[0]),
                )
                hermite(h, state.x, state.rate, space.x_new, space.rate_new, space.dense)

        # --- accept, record
        _sample(state, space, h, out, dt)
        _peaks(problem, state, space)
        copy(space.x_new, state.x, state.x.size)
        copy(space.rate_new, state.rate, state.x.size)
        at_end = not landed and h >= t_end - now[T]
        now[T] = t_end if at_end else now[T] + h
        count[STEPS] += 1
        if not np.isfinite(dot(state.x, state.x, state.x.size)):
            return DIVERGED
        if landed:
            _switch(problem, state, stop, direction, log)
            count[CALLS] += rhs(problem, now[T], state.x, state.piece, state.entry_rate, state.rate, space.work[0])

        # --- adapt
        if adaptive and not landed and not at_end:
            now[phase] = h * (5.0 if error == 0.0 else min(5.0, 0.9 * error**-0.125))
        elif not adaptive:
            now[H_FLIGHT] = dt_flight
    return RUNNING


def new_state(z: Any, stops: int) -> State:
    """State of a run at t = 0 from block coordinates."""
    x = np.concatenate((z, np.zeros(2 + 2 * stops)))
    return State(
        np.array([0.0, np.inf, np.inf, -1.0]),
        x,
        np.zeros_like(x),
        np.zeros(stops, dtype=np.int64),
        np.ones(stops),
        np.zeros((stops, 7)),
        np.zeros(7, dtype=np.int64),
    )


def new_space(state: State, work_rows: int) -> Space:
    """Working arrays for a state."""
    size = state.x.size
    return Space(np.empty(size), np.empty(size), np.zeros((7, size)), np.empty((work_rows, size)), np.empty((2, 8)))


LOG_COLUMNS = COLUMNS
