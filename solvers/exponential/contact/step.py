"""One step in contact: land on a border that is near, else collocate the forces on the longest step that meets rtol.

The error of a step is the largest over all stops, each in units of rtol × its own reference speed, the speed of entry
or a tenth of what the motion could reach there; the step looks at the borders of all stops, open ones included.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.compiled.kernels import contact_forces, copy, dot, indentation, inlined, inner, merged, rhs
from solvers.compiled.state import (
    CALLS,
    LAW_NOT_FINITE,
    REJECTED,
    RUNNING,
    SAMPLED,
    STEP,
    STEP_TOO_SMALL,
    STEPS,
    T_IN,
    T,
    rate_tolerance,
    surface_tolerance,
    switch,
    switch_on_surface,
    touching,
)
from solvers.compiled.sums import combine
from solvers.exponential.contact.borders import border_ahead, renew_all, renew_border
from solvers.exponential.contact.collocation import arrive, contact_time, finish_step, solve_forces, step_error
from solvers.exponential.contact.crossings import bend_ahead, choose_sides, leaves_piece
from solvers.exponential.contact.landing import land, land_on_bend
from solvers.exponential.contact.node_response import LANDED, free_response
from solvers.exponential.contact.nodes import S
from solvers.exponential.contact.outputs import end_inside, record, tape_forces
from solvers.exponential.contact.peaks import state_peaks
from solvers.exponential.energy.books import book_contact
from solvers.exponential.flight import energy_norms

LEVEL, FAMILY, FRESH, STOP, WANTED, BEGUN, BORDER = range(7)  # places in Space.last
ENTRY, PIECE = 1, 2  # values of FRESH: the first step of a contact, or of a piece of its law; 0 for others
_GOAL = 0.3  # error aimed at, in units of the tolerance
_ORDER = 15.0  # the error estimate falls like h^15
_LEAST = 1e-60  # m/s, of a reference speed


@inner
def begin(problem, tables, state, space, stop):
    """Reference speeds, first step and nodes after ``stop`` has switched: entered, changed its piece, or left."""
    last, size, others = space.last, 2 * problem.k.size, False
    energy_norms(problem, state.x, space.norms)
    for s in range(problem.gap.size):
        speed = abs(dot(problem.read_rate[s], state.x, size))
        before = state.piece[s] > 0 and state.open[s, T_IN] < state.now[T]
        if before:
            space.scale[s] = max(space.scale[s], speed)
        else:
            space.scale[s] = max(speed, 0.1 * dot(tables.reach[s], space.norms, problem.k.size), _LEAST)
        others |= before
    last[FAMILY], last[FRESH] = 0, PIECE
    if state.piece[stop] > 0 and state.open[stop, T_IN] == state.now[T]:
        wanted = _first_step(problem, tables, state, space, stop)
        last[WANTED] = max(wanted, last[WANTED]) if others else wanted
        last[FAMILY], last[FRESH], last[STOP] = _entry_nodes(problem, tables, state, stop, wanted), ENTRY, stop
    choose_sides(problem, tables, state, space)
    state_peaks(problem, state, space, state.x)


@inner
def _first_step(problem, tables, state, space, stop):
    """Level of the first step of a contact, a share of the duration it would have if it were free."""
    speed = abs(dot(problem.read_rate[stop], state.x, 2 * problem.k.size))
    duration = contact_time(problem, tables, space, stop, max(speed, 1e-3 * space.scale[stop]))
    if space.share[stop] == 0.0:
        space.share[stop] = min(0.1, 4.0 / (tables.fastest * duration))
    space.duration[0] = duration
    return level_of(tables, space.share[stop] * duration)


@inner
def _entry_nodes(problem, tables, state, stop, level):
    """Kind of the next step: an entry if a force of broken exponent has just begun, that of ``stop`` before others."""
    found, while_ago = 0, 1e-6 * tables.step[level]
    for s in range(state.piece.size):
        if state.piece[s] == 1 and tables.power[1 + s] > 1.0 and (found == 0 or s == stop):
            rate = dot(problem.read_rate[s], state.x, 2 * problem.k.size)
            if indentation(problem, s, state.x) <= while_ago * rate + 4.0 * surface_tolerance(problem, s, state.x):
                found = 1 + s
    return found


@inner
def _pressed(problem, state, log):
    """Switch every open stop at rest on its surface that the forces of others press; whether any did."""
    switched = False
    for s in range(problem.gap.size):
        if state.piece[s] > 0 or abs(indentation(problem, s, state.x)) > surface_tolerance(problem, s, state.x):
            continue
        if abs(dot(problem.read_rate[s], state.x, 2 * problem.k.size)) > rate_tolerance(problem, s, state.x):
            continue
        batch = state.open[s, :3]  # of a contact not begun yet
        rhs(problem, state.now[T], state.x, state.piece, state.entry_rate, state.rate, batch)
        if dot(problem.read_rate[s], state.rate, 2 * problem.k.size) > 0.0:
            switch(problem, state, s, np.int64(1), log)
            switched = True
    return switched


@inlined
def level_of(tables, h):
    """Contact step of about h, the shortest one if need be."""
    last = tables.step.size - 1
    j = min(max(int(np.ceil(2.0 * math.log2(tables.step[0] / h))), 0), last)
    return j + 1 if tables.step[j] > h and j < last else j


@inner
def _nearest_surface(problem, state, space):
    """(time, stop, direction) of the border of a piece that will be met first at the present rates.

    These may be faster than those at entry: the reference speeds follow.
    """
    size = 2 * problem.k.size
    near, stop, direction = np.inf, -1, 0
    for s in range(problem.gap.size):
        delta = indentation(problem, s, state.x)
        rate = dot(problem.read_rate[s], state.x, size)
        space.scale[s], space.seen[s, 0], space.seen[s, 1] = max(space.scale[s], abs(rate)), delta, rate
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
def _predict(problem, tables, state, space, level):
    """First guess of the forces: the last step's polynomial, or the law on the free response."""
    last = space.last
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
def _try(problem, tables, state, space, family, level, rtol):
    """Attempt one contact step; error in units of the tolerance, inf when it must be shorter anyway.

    With inf comes the time of a bend or border that is in its way and the stop, else inf and -1; of a border
    ``space.last`` holds which it is, else -1.
    """
    bottom, first, bent = level == tables.step.size - 1, np.inf, -1
    free_response(problem, tables, state, space, family, level)
    _predict(problem, tables, state, space, level)
    if not solve_forces(problem, tables, state, space, family, level, rtol):
        return np.inf, first, bent
    arrive(problem, tables, state, space, family, level)
    if leaves_piece(problem, tables, state, space, family, level):
        return 1.0 if bottom else np.inf, first, bent
    first, bent = bend_ahead(problem, tables, state, space, family, level, space.last[FRESH] > 0, rtol)
    space.last[BORDER] = -1
    time, element, border = border_ahead(problem, tables, state, space, family, level)
    if time < first:
        first, bent, space.last[BORDER] = time, element, border
    if bent >= 0:
        return 1.0 if bottom else np.inf, first, bent
    error = step_error(problem, tables, state, space, family, level, space.last[FRESH] > 0, rtol)
    return min(error, 1.0) if bottom else error, first, bent


@inner
def latest(state):
    """The stop in contact that was entered last."""
    stop = -1
    for s in range(state.piece.size):
        if state.piece[s] > 0 and (stop < 0 or state.open[s, T_IN] >= state.open[stop, T_IN]):
            stop = s
    return stop


@inner
def _land_first(problem, tables, state, space, stop, direction, near, rtol, t_end, out, due, ledger):
    """Land on the border met first, which another stop's may be; (stop, direction), or (-1, 0)."""
    for _ in range(problem.gap.size + 1):
        landed = land(problem, tables, state, space, stop, direction, near, rtol, t_end, out, due, ledger)
        if landed == stop or landed < 0:
            return landed, direction
        above = indentation(problem, landed, space.work[LANDED]) > problem.levels[landed, state.piece[landed]]
        stop, direction = landed, 1 if above else -1
    return -1, 0


@inner
def _land_in_time(problem, tables, state, space, stop, first, rtol, t_end, out, due, ledger):
    """Land on a bend or border of ``stop``, or on a border met before; (stop, whether it succeeded)."""
    border, near = space.last[BORDER], first
    for _ in range(problem.gap.size + 1):
        if land_on_bend(problem, tables, state, space, stop, border, near, rtol, t_end, out, due, ledger):
            space.last[BORDER] = border
            return stop, True
        if space.last[BORDER] < 0 or space.landed[0] < 0:
            break
        stop, border = space.landed[0], space.landed[1]
    return stop, False


@inlined
def _renew(problem, state, space, stop, alone, log):
    """What ends on a bend goes on beyond it: the other side, or numbers latched on a border."""
    border = space.last[BORDER]
    if border < 0:
        space.side[stop] = -space.side[stop]
    elif alone:
        renew_border(problem, state, space, stop, border, log)
    else:
        renew_all(problem, state, space, stop, border, log)


@merged
def touch(problem, tables, books, state, space, t_end, rtol, log, out, due):
    """One accepted step in contact: land if a border is near, else collocate; returns a status code."""
    last, bottom, ledger = space.last, tables.step.size - 1, books.kept > 0.0
    near, stop, direction = _nearest_surface(problem, state, space)
    if near <= 0.0 and switch_on_surface(problem, state, log, True):
        if touching(state):
            begin(problem, tables, state, space, latest(state))
        return RUNNING
    if last[FRESH] == ENTRY and _pressed(problem, state, log):
        begin(problem, tables, state, space, latest(state))
        return RUNNING
    if stop >= 0:
        stop, direction = _land_first(
            problem, tables, state, space, stop, direction, near, rtol, t_end, out, due, ledger
        )
        if stop >= 0:
            state.count[STEPS] += 1
            if state.now[T] < t_end:
                switch(problem, state, stop, direction, log)
                if touching(state):
                    begin(problem, tables, state, space, stop)
            return RUNNING
    family = last[FAMILY] if last[FRESH] else 0
    longest = 0.8 * near
    if problem.table_dt.size:
        longest = min(longest, t_end - state.now[T] + problem.table_dt[0])
    wanted = last[WANTED]
    level = level_of(tables, longest) if longest < tables.step[wanted] else wanted
    copy(space.side, space.side_at_begin, space.side.size)
    while True:
        error, first, bent = _try(problem, tables, state, space, family, level, rtol)
        if error <= 1.0:
            break
        landed = first == 0.0 and last[BORDER] >= 0  # it begins on the border and goes across
        if bent >= 0 and not landed:
            bent, landed = _land_in_time(problem, tables, state, space, bent, first, rtol, t_end, out, due, ledger)
        if landed:
            state.count[STEPS] += 1
            if state.now[T] < t_end:
                _renew(problem, state, space, bent, first == 0.0, log)
            last[FRESH], last[FAMILY], last[WANTED] = PIECE, 0, max(level, wanted)
            return RUNNING
        if level == bottom:
            return LAW_NOT_FINITE if _law_fails(state, space) else STEP_TOO_SMALL
        copy(space.side_at_begin, space.side, space.side.size)
        state.count[REJECTED] += 1
        if bent >= 0:  # go near it, then end a step on it
            level = max(level + 1, level_of(tables, 0.9 * first))
            continue
        level = min(bottom, level + (1 + int(2.0 / _ORDER * math.log2(error / _GOAL)) if error < np.inf else 2))
        wanted = level
    h = tables.step[level]
    end = state.now[T] + h
    if end >= t_end or due[state.count[SAMPLED]] <= end:
        record(problem, tables, books, state, space, family, level, t_end, out, due)
    if end >= t_end:
        end_inside(problem, tables, state, space, family, level, t_end)
        return RUNNING
    for s in range(problem.gap.size):
        if state.piece[s] > 0:
            copy(space.force[s], space.previous[s], S)
    if ledger:
        book_contact(problem, tables, books, state, space, family, level, h, state.x)
    if state.tape.shape[0]:
        tape_forces(problem, state, space, STEP, end, family, level)
    finish_step(problem, tables, state, space, family, level)
    _adapt(tables, space, level, family, wanted, error)
    if bent >= 0:  # crossed within the shortest step
        _renew(problem, state, space, bent, True, log)
        last[FRESH] = PIECE if last[BORDER] >= 0 else 0
    state.count[STEPS] += 1
    return RUNNING


@inner
def _law_fails(state, space):
    """Whether a law gave a force that is not finite."""
    for s in range(state.piece.size):
        for i in range(S):
            if state.piece[s] > 0 and not abs(space.force[s, i]) < np.inf:
                return True
    return False


@inner
def _adapt(tables, space, level, family, wanted, error):
    """Size of the next step from the error of this one."""
    last, longer = space.last, 2.0 / _ORDER * math.log2(_GOAL / max(error, 1e-30))  # in levels
    if last[FRESH] == ENTRY:  # the next contact of this stop begins with what was right here
        s = last[STOP]
        if level != last[WANTED]:
            space.share[s] = tables.step[level] / space.duration[0]
        space.share[s] *= 2.0 ** (0.5 * min(max(longer, -1.0), 0.5))
    suggested = min(max(level - int(min(math.floor(longer), 2.0)), 0), tables.step.size - 1)
    last[WANTED] = suggested if level == wanted else min(suggested, wanted)
    last[LEVEL], last[FAMILY], last[FRESH] = level, family, 0
