"""The main loop of the stepping methods: try a step, look for events, locate them, accept, record.

On decoupled modes it is compiled, and a method is one compiled ``step`` of declared signature, so that a new method
does not recompile the loop; on matrices loop and method are run as Python, see `shared`.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, Any, NamedTuple

import numpy as np
from numba import types

from solvers.compiled.fields import packed_type, zeros_of
from solvers.compiled.kernels import PLANAR_PROBLEM, PROBLEM, REAL, bends_at, entry, inlined, inner, merged, rhs
from solvers.compiled.sliding import POINT
from solvers.compiled.state import (
    AT_ONCE,
    CALLS,
    GAINED,
    H_CONTACT,
    H_FLIGHT,
    LAW_NOT_FINITE,
    REJECTED,
    RUNNING,
    STATE,
    STEP_TOO_SMALL,
    T_END,
    State,
    T,
    most_borders,
)
from solvers.problem import Array
from solvers.stepping.borders import NODES, border_ahead, renew_border, renew_together
from solvers.stepping.energy_gain import modal_gains
from solvers.stepping.events import (
    HENON,
    IN_CONTACT,
    IN_FLIGHT,
    LOCATED,
    NONE,
    UNRESOLVED,
    Move,
    count_in_contact,
    entry_by_sign,
    first_crossing,
)
from solvers.stepping.henon import hermite
from solvers.stepping.henon import land as henon_landing
from solvers.stepping.located import NEAR_END, SWITCHED, accept, before_step, first_kink, land
from solvers.stepping.shared import shared

_LEAST_STEP = 1e-290  # s: at t = 0 any step changes the time
_MOST_NODES = 16  # of a signal on a step; a period of its fastest part has ten or more
_PATIENCE = 8  # events at one instant after which the step is divided by so much
_FEW_NODES = 2  # so many, or fewer: a step that would pass these ends on the next one


class Space(NamedTuple):
    """Working arrays of the loop."""

    x_new: Annotated[Any, "X"]  # this and the next four as in `Move`
    rate_new: Annotated[Any, "X"]
    dense: Annotated[Any, "7, X"]
    work: Annotated[Any, "rows, X"]
    limits: Annotated[Any, "4"]
    coefficients: Annotated[Any, "6, 8"]  # see `events.motion_of`
    watch: Annotated[Any, "5+E"]  # see `watched`
    kinks: Annotated[Any, "int E"]  # of the laws inside a segment, see `stability.kinks_of`; used under error control
    margin: Annotated[Any, "nodes*B"]  # of an element's borders, row by row, B the most of any; see `borders`
    points: Annotated[Any, "2, nodes"]  # its δ and δ̇
    one: Annotated[Any, "B"]  # margins of one element at one point
    scale: Annotated[Any, "E, 4"]  # rounding of δ and δ̇, ξ and ξ̇, m and m/s
    at_start: Annotated[Any, "E, B"]  # margins at the start of the step
    present: Annotated[Any, "E, B"]  # margins in the state evaluated last
    rounding: Annotated[Any, "E, B"]  # their rounding
    point: Annotated[Any, "2, point"]  # motion of an element, see `compiled.sliding`, and the same moved


SPACE = packed_type(Space)


@shared
def _move_of(state, space):
    """What a step reads and writes."""
    return Move(
        *(state.x, state.rate, state.segment, state.entry_rate),
        *(space.x_new, space.rate_new, space.dense, space.work, space.limits),
    )


@shared
def _update_rate(rate_of, problem, state, space):
    """Evaluate the state's rate again, after an event."""
    state.count[CALLS] += rate_of(
        *(problem, state.now[T], state.x, state.segment, state.entry_rate, state.rate, space.work[0])
    )


@shared
def _first_event(problem, state, space, h, adaptive):
    """(θ, stop, direction, level, border) of the first event in a step of duration h; border -1 if it is none."""
    theta, stop, direction, level = first_crossing(problem, state, space)
    if adaptive and theta != UNRESOLVED:
        place, element, border = border_ahead(problem, state, space, h)
        if place == 0.0 or place < theta:
            return place, element, direction, level, border
    return theta, stop, direction, level, -1


@inner
def _longest_resolved(problem, t, longest):
    """The longest step up to ``longest`` that leaves out no part of a sampled signal.

    It ends where a signal ceases to be constant or has a kink, or after some of its nodes; at the next one if it would
    pass few: there s''' jumps, which in a coarse table the embedded difference does not tell.
    """
    for j in range(problem.table_dt.size):
        dt, start, last = problem.table_dt[j], problem.table_start[j], problem.table_start[j + 1] - 1
        first = min(start + int(t / dt + 1e-9), last)
        node = first
        while node < last and (node - start) * dt < t + longest and _constant(problem.table, node):
            node += 1
        if node > first:
            longest = min(longest, (node - start) * dt - t)
            continue
        longest = min(longest, _MOST_NODES * dt if longest > _FEW_NODES * dt else (first + 1 - start) * dt - t)
        for kink in range(first + 1, min(first + _MOST_NODES, last)):
            if bends_at(problem, kink):
                longest = min(longest, (kink - start) * dt - t)
                break
    return longest


@inlined
def _constant(table, node):
    """Whether a signal is constant from a node to the next one."""
    constant, before = table[node, 0] == table[node + 1, 0], table.shape[1] - 3
    for order in range(1, 3):
        constant &= table[node, order] == 0.0 and table[node + 1, before + order] == 0.0
    return constant


@merged
def _entry_by_henon(problem, state, space, move, h):
    """(duration, stop) of the paper's step, which ends on an entry; negative where it grazes, (h, -1) without one."""
    theta, stop = entry_by_sign(problem, state.x, space.x_new, state.segment)
    if not theta < NONE:
        return h, -1
    duration = henon_landing(problem, state.now[T], h, move, stop)
    if duration < 0.0:
        return duration, stop
    state.count[CALLS] += rhs(
        *(problem, state.now[T] + duration, space.x_new, state.segment, state.entry_rate),
        *(space.rate_new, space.work[0]),
    )
    hermite(duration, state.x, state.rate, space.x_new, space.rate_new, space.dense)
    return duration, stop


@shared
def march(step, rate_of, gained, problem, state, space, budget, adaptive, events):
    """Advance the state to the end of the run or for ``budget`` steps; returns a status code.

    ``rate_of`` writes the rate of a state as `rhs` does, ``gained`` tells whether the run gains energy.
    """
    now, count, dt_flight, dt_contact = state.now, state.count, space.limits[IN_FLIGHT], space.limits[IN_CONTACT]
    t_end, move = now[T_END], _move_of(state, space)
    not_finite, walking_in = False, False
    reached_kink = 0.0  # s: a kink this near to the start has been reached; rounding switches the law there
    for _ in range(budget):
        # --- end of the run, and what can stop it early
        code = before_step(problem, state, space, events)
        if code == SWITCHED:
            _update_rate(rate_of, problem, state, space)
            continue
        if code != RUNNING:
            return code

        # --- try a step
        phase = H_CONTACT if count_in_contact(state.segment) > 0 else H_FLIGHT
        reached_kink = reached_kink if phase == H_CONTACT else 0.0
        h = min(now[phase], dt_contact if phase == H_CONTACT else dt_flight, t_end - now[T])
        if adaptive:
            h = _longest_resolved(problem, now[T], h)
        if h < max(4e-15 * now[T], _LEAST_STEP) and h < t_end - now[T]:
            return LAW_NOT_FINITE if not_finite else STEP_TOO_SMALL
        error, calls = step(problem, now[T], h, move)
        count[CALLS] += calls
        not_finite = not np.isfinite(error)
        if adaptive and not error <= 1.0:
            now[phase] = h * max(0.2, 0.9 * error**-0.125) if error > 1.0 else 0.2 * h
            count[REJECTED] += 1
            continue

        # --- events
        stop, direction, border, tried = -1, 0, -1, h
        if events == LOCATED:
            event = _first_event(problem, state, space, h, adaptive)
            theta, stop, direction, _, border = event
            if border >= 0 and theta == 0.0:  # the step begins on the border and crosses it
                renew_border(problem, state, space, stop, border)
                if count[AT_ONCE] % _PATIENCE == _PATIENCE - 1:  # a step this long may tell stick and slip in turn
                    now[phase] = h / _PATIENCE
                _update_rate(rate_of, problem, state, space)
                continue
            if theta == UNRESOLVED:
                now[phase] = h / 32.0
                count[REJECTED] += 1
                continue
            if theta < NONE:
                h = land(step, problem, state, space, move, h, event)
                if h < 0.0:  # only the interpolant crosses, or the landing is not accurate: shorter step
                    now[phase] = -h
                    count[REJECTED] += 1
                    continue
        elif events == HENON and phase == H_FLIGHT and not walking_in:  # the paper's scheme
            h, stop = _entry_by_henon(problem, state, space, move, h)
            direction = 1
            if h < 0.0:  # it grazes: approach with the small step
                now[H_FLIGHT], walking_in = dt_contact, True
                count[REJECTED] += 1
                continue

        # --- a law with a kink inside its segment: end the step there, the error estimate fails across it
        if adaptive and phase == H_CONTACT:
            theta = first_kink(problem, state, space)
            if theta < NONE and theta * h > reached_kink:
                now[phase], reached_kink = theta * h, max(reached_kink, NEAR_END * theta * h)
                count[REJECTED] += 1
                continue

        # --- accept, record
        at_end = stop < 0 and h == tried and h >= t_end - now[T]
        code = accept(problem, state, space, h, stop if border < 0 else -1, direction, at_end)
        if code != RUNNING:
            return code
        if border >= 0 and now[T] < t_end:
            renew_together(problem, state, space, h, stop, border)
        if stop >= 0:
            _update_rate(rate_of, problem, state, space)
        if gained(problem, state, space):
            return GAINED

        # --- adapt
        if adaptive and stop < 0 and not at_end:
            now[phase] = h * (5.0 if error == 0.0 else min(5.0, 0.9 * error**-0.125))
        elif not adaptive:
            now[H_FLIGHT], now[H_CONTACT], walking_in = dt_flight, dt_contact, False
    return RUNNING


def _march_modes(step, problem, state, space, budget, adaptive, events):
    """`march` on decoupled modes."""
    return march(step, rhs, modal_gains, problem, state, space, budget, adaptive, events)


@lru_cache(maxsize=2)
def march_of(planar: bool) -> Any:
    """The compiled loop for a type of problem."""
    problem = PLANAR_PROBLEM if planar else PROBLEM
    step = types.FunctionType(types.Tuple([REAL, types.int64])(problem, REAL, REAL, packed_type(Move)))
    return entry(types.int64(step, problem, STATE, SPACE, types.int64, types.boolean, types.int64))(_march_modes)


def new_space(problem: Any, state: State, method: Any, atol: float, watch: Array) -> Space:
    """Working arrays of a run by a method."""
    sizes = {"X": state.x.size, "E": problem.law.size, "rows": method.work_rows, "B": most_borders(problem)}
    space: Space = zeros_of(Space, {**sizes, "nodes": NODES, "point": POINT})
    space.work[-1, : len(method.constants)] = method.constants
    space.limits[:], space.watch[:] = (*method.steps, method.rtol, atol), watch
    return space
