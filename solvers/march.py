"""THE main loop of the stepping methods: try a step, look for events, land, accept, record.

A method is one compiled ``step`` of declared signature, so a new method does not recompile the loop.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit, types

from solvers.events import NONE, UNRESOLVED, coefficients_of, entry_by_sign, first_event, polynomial
from solvers.forcing import Forcing
from solvers.henon import hermite
from solvers.henon import land as henon_landing
from solvers.kernels import OPTIONS, PROBLEM, contact_forces, copy, dot, indentation, inner, rhs
from solvers.state import (
    AT_ONCE,
    CALLS,
    CHATTER,
    DIVERGED,
    DONE,
    H_CONTACT,
    H_FLIGHT,
    LAW_NOT_FINITE,
    LOG_FULL,
    LOGGED,
    MOST_EVENTS_AT_ONCE,
    PEAK_DELTA,
    PEAK_FORCE,
    REJECTED,
    RUNNING,
    SAMPLED,
    STATE,
    STEP_TOO_SMALL,
    STEPS,
    State,
    T,
    begin_contacts,
    new_state,
    problem_of,
    surface_tolerance,
    switch,
    switch_on_surface,
    touching,
)
from solvers.system import Array, System

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

_PEAK_NODES = np.linspace(0.0, 1.0, 9)


class Space(NamedTuple):
    """Working arrays of the loop."""

    x_new: Any
    rate_new: Any
    dense: Any
    work: Any
    coefficients: Any  # (2, 8)


SPACE = types.NamedTuple([_VECTOR, _VECTOR, _MATRIX, _MATRIX, _MATRIX], Space)


@inner
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


@inner
def _peak_value(problem, state, s, column, delta_of, rate_of, theta, batch):
    """Indentation or force at θ of the step."""
    batch[0] = polynomial(delta_of, theta)
    if column == PEAK_DELTA:
        return batch[0]
    batch[1] = polynomial(rate_of, theta)
    contact_forces(problem, s, batch[0:1], batch[1:2], state.entry_rate[s], batch[2:3])
    return batch[2]


@inner
def _law_fails(problem, state, space, h):
    """Whether a law is not finite where an Euler step would take its stop."""
    batch = space.work[0]
    for s in range(problem.gap.size):
        batch[0] = indentation(problem, s, state.x) + h * dot(problem.read[s], state.rate, 2 * problem.k.size)
        batch[1] = dot(problem.read_rate[s], state.x, 2 * problem.k.size)
        if state.piece[s] > 0 and np.isfinite(batch[0]):
            contact_forces(problem, s, batch[0:1], batch[1:2], state.entry_rate[s], batch[2:3])
            if not np.isfinite(batch[2]):
                return True
    return False


@inner
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


@inner
def _land(step, problem, state, space, h, stop, level, rtol, atol):
    """Repeat the step with the duration that ends on ``level``: Newton on the true step; returns it, -1 if it fails."""
    tolerance = 4.0 * surface_tolerance(problem, stop, state.x)
    longest = 1.000001 * h
    for _ in range(12):
        _, calls = step(
            *(problem, state.now[T], h, state.x, state.rate, state.piece, state.entry_rate),
            *(
                space.x_new,
                space.rate_new,
                space.dense,
                space.work,
                1e300,
                atol,
            ),  # for its interpolant, whatever the error
        )
        state.count[CALLS] += calls
        distance = indentation(problem, stop, space.x_new) - level
        if abs(distance) <= tolerance:
            return h
        corrected = h - distance / dot(problem.read_rate[stop], space.x_new, 2 * problem.k.size)
        if not 0.0 < corrected <= longest or corrected == h:
            break
        h = corrected
    # a graze: Newton ends off the surface, but by less than the step's own error
    return h if abs(distance) <= max(100.0, 1e14 * rtol) * tolerance else -1.0


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
    not_finite, by_hand = False, False
    for _ in range(budget):
        # --- end of the run, and what can stop it early
        if now[T] >= t_end:
            return DONE
        if count[LOGGED] + stops > log.shape[0]:
            return LOG_FULL
        if count[AT_ONCE] > MOST_EVENTS_AT_ONCE:
            return CHATTER
        if switch_on_surface(problem, state, log, locates):
            count[CALLS] += rhs(problem, now[T], state.x, state.piece, state.entry_rate, state.rate, space.work[0])
            continue

        # --- try a step
        phase = H_CONTACT if touching(state) else H_FLIGHT
        h = min(now[phase], dt_contact if phase == H_CONTACT else dt_flight, t_end - now[T])
        if h < 4e-15 * now[T] and h < t_end - now[T]:
            return LAW_NOT_FINITE if not_finite else STEP_TOO_SMALL
        error, calls = step(
            *(problem, now[T], h, state.x, state.rate, state.piece, state.entry_rate),
            *(space.x_new, space.rate_new, space.dense, space.work, rtol, atol),
        )
        count[CALLS] += calls
        not_finite = not np.isfinite(error)
        if adaptive and not error <= 1.0:
            now[phase] = h * max(0.2, 0.9 * error**-0.125) if error > 1.0 else 0.2 * h
            count[REJECTED] += 1
            continue

        # --- events
        stop, direction, landed = -1, 0, False
        if locates:
            theta, stop, direction = first_event(problem, state.x, space.dense, state.piece, space.coefficients)
            if theta == UNRESOLVED:
                now[phase] = h / 32.0
                count[REJECTED] += 1
                continue
            if theta < NONE:
                level = problem.levels[stop, state.piece[stop] - (1 if direction < 0 else 0)]
                tried = h
                h, landed = _land(step, problem, state, space, theta * h, stop, level, rtol, atol), True
                if h < 0.0:  # the interpolant crosses, the step does not: look closer
                    now[phase] = 0.5 * tried
                    count[REJECTED] += 1
                    continue
        elif phase == H_FLIGHT and not by_hand:  # the paper's scheme: an entry is landed on by Hénon's trick
            theta, stop = entry_by_sign(problem, state.x, space.x_new, state.piece)
            if theta < NONE:
                duration = henon_landing(
                    *(problem, now[T], h, state.x, state.rate, state.piece, state.entry_rate),
                    *(stop, 0.0, space.x_new, space.work),
                )
                if duration < 0.0:  # it grazes: walk in with the small step
                    now[H_FLIGHT], by_hand = dt_contact, True
                    count[REJECTED] += 1
                    continue
                h, direction, landed = duration, 1, True
                count[CALLS] += rhs(
                    *(problem, now[T] + h, space.x_new, state.piece, state.entry_rate),
                    *(space.rate_new, space.work[0]),
                )
                hermite(h, state.x, state.rate, space.x_new, space.rate_new, space.dense)

        # --- accept, record
        if not np.isfinite(dot(space.x_new, space.x_new, space.x_new.size)):
            return LAW_NOT_FINITE if _law_fails(problem, state, space, h) else DIVERGED
        _sample(state, space, h, out, dt)
        _peaks(problem, state, space)
        copy(space.x_new, state.x, state.x.size)
        copy(space.rate_new, state.rate, state.x.size)
        at_end = not landed and h >= t_end - now[T]
        now[T] = t_end if at_end else now[T] + h
        count[STEPS] += 1
        if landed:
            switch(problem, state, stop, direction, log)
            count[CALLS] += rhs(problem, now[T], state.x, state.piece, state.entry_rate, state.rate, space.work[0])

        # --- adapt
        if adaptive and not landed and not at_end:
            now[phase] = h * (5.0 if error == 0.0 else min(5.0, 0.9 * error**-0.125))
        elif not adaptive:
            now[H_FLIGHT], by_hand = dt_flight, False
    return RUNNING


def new_space(state: State, work_rows: int) -> Space:
    """Working arrays for a state."""
    size = state.x.size
    return Space(np.empty(size), np.empty(size), np.zeros((7, size)), np.empty((work_rows, size)), np.empty((2, 8)))


class Engine:
    """One run of a stepping method: problem, state, and its share of the loop."""

    def __init__(self, method: Any, system: System, z: Array, forcing: Forcing, duration: float) -> None:
        self.method, self.duration = method, duration
        self.problem = problem_of(system, forcing)
        self.back = system.blocks.T
        if not method.locates_exit:
            self.problem.levels[:, 1:] = math.inf  # kinks are not looked for
        self.state: State = new_state(z, len(system.contacts))
        self.space = new_space(self.state, method.work_rows)
        fastest = max([math.sqrt(abs(k)) for k in self.problem.k] + list(self.problem.c) + [1.0 / duration])
        self.state.now[[H_FLIGHT, H_CONTACT]] = 0.1 / fastest, 0.01 / fastest
        if not method.adaptive:
            self.state.now[[H_FLIGHT, H_CONTACT]] = method.dt_flight, method.dt_contact

    def start(self) -> None:
        """Put every stop on its piece and evaluate the first rate."""
        state = self.state
        begin_contacts(self.problem, state)
        state.count[CALLS] += rhs(
            *(self.problem, 0.0, state.x, state.piece, state.entry_rate, state.rate, self.space.work[0])
        )

    def keeps_ledger(self, sampled: bool) -> bool:
        """The ledger is integrated along, always."""
        return True

    def march(self, budget: int, log: Array, out: Array, dt: float) -> int:
        """Go on for a stretch."""
        method = self.method
        return march(
            *(method.step, self.problem, self.state, self.space, self.duration, budget),
            *(method.dt_flight, method.dt_contact, method.rtol, method.atol),
            *(method.adaptive, method.locates_exit, log, out, dt),
        )
