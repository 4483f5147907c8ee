"""THE main loop of the stepping methods: try a step, look for events, land, accept, record.

A method is one compiled ``step`` of declared signature, so a new method does not recompile the loop.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import types

from solvers.compiled.kernels import (
    INTEGERS,
    MATRIX,
    PROBLEM,
    REAL,
    VECTOR,
    entry,
    inner,
    kernel,
    rhs,
)
from solvers.compiled.state import (
    CALLS,
    DONE,
    GAINED,
    H_CONTACT,
    H_FLIGHT,
    LAW_NOT_FINITE,
    REJECTED,
    RUNNING,
    STATE,
    STEP_TOO_SMALL,
    State,
    T,
    begin_contacts,
    new_state,
    problem_of,
    touching,
)
from solvers.problem import Array, Forcing, Status, System
from solvers.stepping.events import (
    HENON,
    LANDED,
    NONE,
    UNRESOLVED,
    entry_by_sign,
)
from solvers.stepping.henon import hermite
from solvers.stepping.henon import land as henon_landing
from solvers.stepping.located import _AT_AN_END, EVENT, _kink, _land, accept, find, look
from solvers.stepping.stability import kinks_of, shortest_contact, takes, work_of

STEP = types.FunctionType(
    types.Tuple([REAL, types.int64])(
        *[PROBLEM, REAL, REAL, VECTOR, VECTOR, INTEGERS, VECTOR],
        *[VECTOR, VECTOR, MATRIX, MATRIX, REAL, REAL],
    )
)


class Space(NamedTuple):
    """Working arrays of the loop."""

    x_new: Any  # (x.size,) end of the step
    rate_new: Any  # (x.size,)
    dense: Any  # (7, x.size) rows r of the interpolant, see `events`
    work: Any  # (rows, x.size) of the method
    coefficients: Any  # (2, 8)
    watch: Any  # see `watched`
    kinks: Any  # (m,) where laws bend inside a piece, see `stability.kinks_of`; looked at under error control


SPACE = types.NamedTuple([VECTOR, VECTOR, MATRIX, MATRIX, MATRIX, VECTOR, INTEGERS], Space)
NOW, BEGAN, LEAST, IN_A_ROW, MOST_INPUT, HELD = range(6)  # places in `Space.watch`, see `watched`
_GAINS = 8  # steps in a row: one alone may be the ledger's, as in the first step of a load
_FAR, _GAINS_FAR = 1e3, 3  # times the energy given, and then steps in a row


@kernel
def gains(problem, state, space):
    """Whether for some steps there is twice the energy that was ever there or came in, or far more for a few."""
    ledger = 2 * problem.k.size
    watch = space.watch
    watch[MOST_INPUT] = max(watch[MOST_INPUT], state.x[ledger])
    given = watch[BEGAN] + watch[MOST_INPUT]
    for s in range(problem.gap.size):  # a stop gives at most what it held
        given += min(max(-state.x[ledger + 2 + 2 * s], 0.0), watch[HELD + s])
    more = watch[NOW] > 2.0 * given + watch[LEAST]
    watch[IN_A_ROW] = watch[IN_A_ROW] + 1.0 if more else 0.0
    far = watch[NOW] > _FAR * (given + watch[LEAST])
    return watch[IN_A_ROW] >= _GAINS or (far and watch[IN_A_ROW] >= _GAINS_FAR)


@inner
def _gains(problem, state, space):
    """The same on decoupled modes; damping that couples them has an energy of its own form, looked at outside."""
    if problem.loss.shape[0] > 0:
        return False
    n, energy = problem.k.size, 0.0
    for i in range(n):
        energy += 0.5 * (state.x[n + i] ** 2 + problem.k[i] * state.x[i] ** 2)
    space.watch[NOW] = energy
    return gains(problem, state, space)


@entry(
    types.int64(
        *[STEP, PROBLEM, STATE, SPACE, REAL, types.int64, REAL, REAL],
        *[REAL, REAL, types.boolean, types.int64, MATRIX, MATRIX, VECTOR],
    )
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
    events,
    log,
    out,
    due,
):
    """Advance the state to ``t_end`` or for ``budget`` steps; returns a status code."""
    now, count = state.now, state.count
    not_finite, by_hand = False, False
    nearest = 0.0  # what is nearer to a kink than this is on it: there rounding switches the law to and fro
    for _ in range(budget):
        # --- end of the run, and what can stop it early
        code = look(problem, state, t_end, log, events)
        if code == EVENT:
            count[CALLS] += rhs(problem, now[T], state.x, state.piece, state.entry_rate, state.rate, space.work[0])
            continue
        if code != RUNNING:
            return code

        # --- try a step
        phase = H_CONTACT if touching(state) else H_FLIGHT
        nearest = nearest if phase == H_CONTACT else 0.0
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
        stop, direction, tried = -1, 0, h
        if events == LANDED:
            theta, stop, direction, level = find(problem, state, space)
            if theta == UNRESOLVED:
                now[phase] = h / 32.0
                count[REJECTED] += 1
                continue
            if theta < NONE:
                h = _land(step, problem, state, space, theta * h, tried, stop, direction, level, rtol, atol)
                if h < 0.0:  # the interpolant crosses, the step does not, or not to the tolerance: look closer
                    now[phase] = -h
                    count[REJECTED] += 1
                    continue
        elif events == HENON and phase == H_FLIGHT and not by_hand:  # the paper's scheme
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
                h, direction = duration, 1
                count[CALLS] += rhs(
                    *(problem, now[T] + h, space.x_new, state.piece, state.entry_rate),
                    *(space.rate_new, space.work[0]),
                )
                hermite(h, state.x, state.rate, space.x_new, space.rate_new, space.dense)

        # --- a law that bends within its piece: end there, the error of a step across it is not what is estimated
        if adaptive and phase == H_CONTACT:
            theta = _kink(problem, state, space)
            if theta < NONE and theta * h > nearest:
                now[phase], nearest = theta * h, max(nearest, _AT_AN_END * theta * h)
                count[REJECTED] += 1
                continue

        # --- accept, record
        at_end = stop < 0 and h == tried and h >= t_end - now[T]
        code = accept(problem, state, space, h, stop, direction, at_end, t_end, log, out, due)
        if code != RUNNING:
            return code
        if stop >= 0:
            count[CALLS] += rhs(problem, now[T], state.x, state.piece, state.entry_rate, state.rate, space.work[0])
        if _gains(problem, state, space):
            return GAINED

        # --- adapt
        if adaptive and stop < 0 and not at_end:
            now[phase] = h * (5.0 if error == 0.0 else min(5.0, 0.9 * error**-0.125))
        elif not adaptive:
            now[H_FLIGHT], now[H_CONTACT], by_hand = dt_flight, dt_contact, False
    return RUNNING


def new_space(state: State, work_rows: int, watch: Array, constants: tuple[float, ...] = (), kinks: Any = ()) -> Space:
    """Working arrays; a method's constants stand in the last row of ``work``."""
    size = state.x.size
    work = np.empty((work_rows, size))
    work[-1, : len(constants)] = constants
    return Space(
        np.empty(size),
        np.empty(size),
        np.zeros((7, size)),
        work,
        np.empty((2, 8)),
        watch,
        np.array(kinks, dtype=np.int64),
    )


def watched(system: System, motion: Array, least: float) -> Array:
    """What `gains` looks at, J: stored now, at the start, negligible; steps that gained; most input, held by stops."""
    q, q_dot = np.split(motion, 2)
    stored = abs(float(system.energy(q, q_dot)))
    known = system.about_laws.get("take", lambda: [takes(contact.law) for contact in system.contacts])
    held = [
        work_of(contact.law, -float(contact.direction @ q) - contact.gap) if fair else math.inf
        for contact, fair in zip(system.contacts, known, strict=True)
    ]
    return np.array([stored, stored, least, 0.0, 0.0, *held])


def largest_loads(problem: Any) -> Array:
    """Bound of every load's signal (L,)."""
    largest = np.zeros(len(problem.load))
    np.add.at(largest, problem.tone_load, np.abs(problem.tone_amplitude))
    for j, load in enumerate(problem.table_load):
        largest[load] += np.abs(problem.table[problem.table_start[j] : problem.table_start[j + 1], 0]).max()
    return largest


def absolute_tolerance(method: Any, problem: Any, z: Array, fastest: float) -> float:
    """The method's own, or less where start and loads are so small that it would stand above rtol times the motion."""
    p, v = np.abs(z).reshape(2, -1).max(axis=1)
    push = np.abs(problem.load).max(axis=1, initial=0.0) @ largest_loads(problem) / fastest
    size = max(p, v / fastest, push / fastest)
    return float(min(method.atol, method.rtol * size) if size > 0.0 else method.atol)


def negligible_energy(problem: Any, inverse_mass: Array, dt: float) -> float:
    """What rounding in the loads may bring: 1e-10 of the energy ½ vᵀM⁻¹v (s dt)² of the largest in one step, J."""
    return 0.5e-10 * dt**2 * float(np.sum(inverse_mass * largest_loads(problem) ** 2))


class Engine:
    """One run of a stepping method: problem, state, and its share of the loop."""

    def __init__(self, method: Any, system: System, z: Array, forcing: Forcing, duration: float) -> None:
        self.method, self.duration, self.system = method, duration, system
        self.problem = problem_of(system, forcing)
        self.back = system.blocks.T
        if method.events == HENON:
            self.problem.levels[:, 1:] = math.inf  # kinks are not looked for
        self.state: State = new_state(z, len(system.contacts))
        dt = 0.0 if method.adaptive else max(method.steps)
        least = negligible_energy(self.problem, np.sum(self.problem.load * self.problem.power, axis=1), dt)
        watch = watched(system, self.back @ z, least)
        self.space = new_space(self.state, method.work_rows, watch, method.constants, kinks_of(system))
        fastest = max([math.sqrt(abs(k)) for k in self.problem.k] + list(self.problem.c) + [1.0 / duration])
        self.state.now[[H_FLIGHT, H_CONTACT]] = 0.1 / fastest, 0.01 / fastest
        self.atol = absolute_tolerance(method, self.problem, z, fastest)
        if not method.adaptive:
            self.state.now[[H_FLIGHT, H_CONTACT]] = method.steps

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

    def march(self, budget: int, log: Array, out: Array, due: Array) -> int:
        """Go on for a stretch."""
        method = self.method
        dt_flight, dt_contact = (math.inf, math.inf) if method.adaptive else method.steps
        code = march(
            *(method.step, self.problem, self.state, self.space, self.duration, budget),
            *(dt_flight, dt_contact, method.rtol, self.atol),
            *(method.adaptive, method.events, log, out, due),
        )
        return GAINED if code in (DONE, RUNNING) and self._gained() else code

    def _gained(self) -> bool:
        """Whether a run with coupled damping holds more energy than it was ever given; see `gains`."""
        if not self.problem.loss.size or self.method.adaptive:
            return False
        size = 2 * self.problem.k.size
        self.space.watch[NOW] = self.system.energy(*np.split(self.back @ self.state.x[:size], 2))
        self.space.watch[IN_A_ROW] = _GAINS
        return bool(gains(self.problem, self.state, self.space))

    def explain(self, code: Status) -> str:
        """What grew, and the step to try."""
        if code not in (Status.GAINED, Status.DIVERGED) or self.method.adaptive:
            return ""
        q, q_dot = np.split(self.back @ self.state.x[: 2 * self.problem.k.size], 2)
        return explanation(self.method, self.system, q, q_dot, self.duration)


def explanation(method: Any, system: System, q: Array, q_dot: Array, duration: float) -> str:
    """The coordinate that grew, and the predicted limits."""
    modal = not system.sparse and not np.any(system.M - np.eye(system.size))
    share = np.abs(q_dot * (system.M @ q_dot))
    if modal:  # among the modes that a step amplifies, if any
        k, c = np.diag(system.K), np.diag(system.C)
        grows = [max(method.radius(h, *pair) for h in method.steps) > 1.0 + 1e-9 for pair in zip(k, c, strict=True)]
        share = np.where(grows, share + k * q**2, 0.0) if any(grows) else share + k * q**2
    worst = int(np.argmax(np.nan_to_num(share, nan=math.inf, posinf=math.inf)))
    where = f"coordinate {worst} of {system.size}"
    if modal:
        where = f"mode {worst + 1} of {system.size} (ω = {math.sqrt(abs(system.K[worst, worst])):.6g} rad/s)"
    limit = method.stable_dt(system, duration=duration)
    step = min(limit.flight, limit.contact, *method.steps, 0.1 * shortest_contact(system))
    grown = f"; it grew in {where}, steps {method.steps[0]:g} s in flight and {method.steps[1]:g} s in contact"
    return f"{grown}, predicted limits {limit.flight:.3g} s and {limit.contact:.3g} s: try {0.5 * step:.2g} s"
