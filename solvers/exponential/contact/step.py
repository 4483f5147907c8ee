"""One step in contact: land on a knot or border that is near, else collocate forces on the longest step in tolerance.

The error of a step is the largest over all stops, each in units of rtol × its own reference speed: the speed of entry,
or a tenth of the speed the motion could reach there. All stops are checked, in contact or not.

A *knot* is an end of a segment of a law, the surface δ = 0 among them; a *border* is the zero of a margin of a law with
memory or of friction, see `borders`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import types

from solvers.compiled.kernels import (
    REAL,
    acceleration_of,
    contact_forces,
    copy,
    indentation,
    indentation_and_rate,
    indentation_rate,
    inlined,
    inner,
    is_circle,
    is_planar,
    merged,
    rhs,
    row_of,
    rubs,
    slider_of,
    surface_tolerance,
)
from solvers.compiled.parts import ACCEPT, BEHIND, CONTACT, FIRST_END, PRESSED, part
from solvers.compiled.state import (
    CALLS,
    LAW_NOT_FINITE,
    OUTSIDE,
    REJECTED,
    RUNNING,
    SAMPLED,
    STEP,
    STEP_TOO_SMALL,
    STEPS,
    T_END,
    T,
    acts,
    in_contact,
    rate_tolerance,
    switch,
    switch_on_surface,
)
from solvers.compiled.sums import combine
from solvers.exponential.circles.contact import guess_radial_forces
from solvers.exponential.circles.friction import guess_rubbing_forces
from solvers.exponential.contact.borders import border_behind
from solvers.exponential.contact.collocation import end_state, solve_forces, step_error
from solvers.exponential.contact.crossings import UNRESOLVED, leaves_segment
from solvers.exponential.contact.first_step import (
    ENTRY,
    LEVEL,
    NEW,
    NEXT_LEVEL,
    NODE_SET,
    SEGMENT,
    STOP,
    begin_steps,
    entry_nodes,
    latest_entered,
    level_of,
)
from solvers.exponential.contact.kinks import land_on_kink_or_limit
from solvers.exponential.contact.landing import TURNED, may_land
from solvers.exponential.contact.node_response import (
    BORDER,
    ELEMENT,
    ONLY_EXPECTED,
    SLOPE,
    WHEN,
    force_of,
    free_response,
    motion_of,
    note_swing,
    own_accelerance,
    shortest_step,
)
from solvers.exponential.contact.nodes import S
from solvers.exponential.contact.outputs import end_run, finish_step, record_forces, sample_step
from solvers.exponential.contact.segment_ends import first_end, go_beyond, land_first, land_in_time
from solvers.exponential.energy.contact_balance import account_contact
from solvers.problem.friction import CODE, STICK, STIFFNESS

_ERROR_GOAL = 0.3  # error aimed at, in units of the tolerance
_ORDER = 15.0  # the error estimate falls like h^15
_SHORTLY_BEFORE = 0.9  # part of the time to a border after which a step ends, for a landing to follow
_CROSSING_KNOWN = 8  # levels, √2 each, shorter at once: a step not resolved yet may see a crossing near its start
_FEWEST_STEPS = 100.0  # in the time of an impact, of the shortest ones
_SWING = 0.1  # angle of it, rad, in the shortest step, beyond which this may lose an event or err
_COUNTS = 0.3  # speed of an impact, in units of the reference speed, whose force must be resolved
NEITHER, MOVES_OUT, RESTS = range(3)  # what `_leave_or_rest` finds
_ONE_LEVEL = 2.0 ** (-0.5 * _ORDER)  # ratio of the errors of two steps whose lengths differ by √2, one level


@part(PRESSED, types.boolean)
def _switch_pressed(run):
    """Switch every stop at rest on its surface that other stops' forces press into it; whether there was any."""
    problem, state = run.problem, run.state
    switched = False
    if state.now[T] == 0.0 and problem.parts[BEHIND] and border_behind(run)[0] >= 0:
        return False  # forces are those of segments that end at once, as of a preloaded yielding stop
    for s in range(problem.law.size):
        if state.segment[s] > 0 or abs(indentation(problem, s, state.x)) > surface_tolerance(problem, s, state.x):
            continue
        if abs(indentation_rate(problem, s, state.x)) > rate_tolerance(problem, s, state.x):
            continue
        unused = state.active[s, :3]  # of a contact not begun yet
        rhs(problem, state.now[T], state.x, state.segment, state.entry_rate, state.rate, unused)
        if acceleration_of(problem, s, state.x, state.rate) > 0.0:
            switch(problem, state, s, np.int64(1))
            switched = True
    return switched


@merged
def _nearest_knot(run):
    """(time, stop, direction) of the knot, or surface, that is reached first if all δ̇ stay, or (inf, -1, 0).

    δ and δ̇ go to ``scratch.start_motion``. Reference speeds are raised to |δ̇|, which may exceed that at entry.
    """
    problem, state, scratch = run.problem, run.state, run.scratch
    first, stop, direction = np.inf, -1, 0
    for s in range(problem.law.size):
        delta, rate = indentation_and_rate(problem, s, state.x)
        scratch.start_motion[s, 0], scratch.start_motion[s, 1] = delta, rate
        scratch.reference_speed[s] = max(scratch.reference_speed[s], abs(rate))
        segment = state.segment[s]
        if rate < 0.0 and segment > 0:
            time, side = (delta - problem.knots[s, segment - 1]) / -rate, -1
            if segment == 1 and problem.law.size > 1:  # its force may end like a root, and others begin at that instant
                time -= surface_tolerance(problem, s, state.x) / -rate
        elif rate > 0.0:
            time, side = (problem.knots[s, segment] - delta) / rate, 1
        else:
            continue
        if time < first:
            first, stop, direction = time, s, side
    return first, stop, direction


@inner
def _leave_or_rest(run, stop, time_to_knot):
    """Leave the segment where no step can end before its knot: `MOVES_OUT` if that was done, `RESTS`, or neither.

    What is within rounding of the knot at a rate that is rounding rests there and need not land. Otherwise a landing of
    any error is allowed, unless it may last longer than the shortest step: by the rounding of δ at the rate.
    """
    problem, state = run.problem, run.state
    if switch_on_surface(problem, state, True):
        if in_contact(state):
            begin_steps(run, latest_entered(state))
        return MOVES_OUT
    if not time_to_knot < shortest_step(run.tables):
        return NEITHER
    rate, rounding = abs(run.scratch.start_motion[stop, 1]), surface_tolerance(problem, stop, state.x)
    if abs(time_to_knot) * rate <= OUTSIDE * rounding and rate <= rate_tolerance(problem, stop, state.x):
        return RESTS
    run.scratch.last_resort[0] = rounding <= shortest_step(run.tables) * rate
    return NEITHER


@merged
def _extrapolate(run, s, level):
    """Guess the forces of stop s by the extrapolated polynomial of the last step."""
    scratch = run.scratch
    control = scratch.control
    shift = level - control[LEVEL] + 2
    for r in range(row_of(run.problem, s), row_of(run.problem, s + 1)):
        if 0 <= shift < run.tables.extrapolation.shape[1]:
            combine(run.tables.extrapolation[control[NODE_SET], shift], scratch.previous[r], S, None, scratch.force[r])
        else:
            for i in range(S):
                scratch.force[r, i] = scratch.previous[r, S - 1]


@merged
def _predict(run, level):
    """First guess of the forces: the extrapolated polynomial of the last step, or the law for the free response."""
    problem, state, scratch = run.problem, run.state, run.scratch
    for s in range(problem.law.size):
        if state.segment[s] == 0:
            continue
        if not scratch.control[NEW]:
            _extrapolate(run, s, level)
        elif rubs(problem, s):
            guess_rubbing_forces(run, s)
        elif is_circle(problem, s):
            guess_radial_forces(run, s)
        else:
            free, force = scratch.free[row_of(problem, s)], force_of(run, s)
            copy(free[0], scratch.clipped, S)
            contact_forces(problem, s, scratch.clipped, free[1], state.entry_rate[s], force)
            state.count[CALLS] += S


class Attempt(NamedTuple):
    """What one contact step tried has shown.

    A step with an error above 1 is not taken: a shorter one is tried, or a landing on the border it crosses.
    """

    error: float  # in units of the tolerance; inf if the forces are not found, or a bend or border is crossed
    time: float  # s, after the start of the step, of the first bend or border crossed; inf if there is none
    element: int  # whose bend or border it is; -1 if there is none
    border: int  # its number; -1 of a bend
    slope: float  # of its margin by time; 0 if it is not known


@merged
def _attempt(run, node_set, level):
    """Attempt one contact step from the present state, which stays; the end goes to ``scratch.x_new``.

    On the shortest level the error is cut to 1, as no step is shorter, where the forces are found and it is told what
    the step crosses.
    """
    problem = run.problem
    shortest = level == run.tables.contact_step.size - 1
    time, element, border, slope = np.inf, -1, -1, 0.0
    run.scratch.is_split[0] = 0
    free_response(run, node_set, level)
    _predict(run, level)
    if not solve_forces(run, node_set, level):
        return Attempt(np.inf, time, element, border, slope)
    end_state(run, node_set, level)
    if leaves_segment(run, node_set, level):
        if shortest and run.state.now[T] == 0.0 and problem.parts[BEHIND]:
            element, border = border_behind(run)
        if element >= 0:
            return Attempt(np.inf, 0.0, element, border, slope)
        return Attempt(1.0 if shortest else np.inf, time, element, border, slope)
    if problem.parts[FIRST_END]:
        is_new = run.scratch.control[NEW] > 0
        time, element, border, slope = first_end(run, node_set, level, is_new)
    if element == UNRESOLVED:
        return Attempt(np.inf, np.inf, -1, -1, 0.0)
    at_once = time == 0.0 and border >= 0 and (problem.table_dt.size > 0 or rubs(problem, element))
    if element >= 0 and (shortest or not at_once):
        return Attempt(1.0 if shortest else np.inf, time, element, border, slope)
    error = step_error(run, node_set, level)
    if element < 0:
        return Attempt(min(error, 1.0) if shortest else error, time, element, border, slope)
    if error <= 1.0:
        return Attempt(np.inf, time, element, border, slope)
    return Attempt(error, np.inf, -1, -1, 0.0)  # what does not resolve the motion cannot tell what happens at its start


@merged
def _try_border_ahead(run, time_to_knot):
    """Land on a border that a step crossed which was then made shorter, or that is expected, before a knot.

    Returns whether it was done, and the longest step, s, that ends well before a border that is only expected.
    """
    scratch = run.scratch
    ahead, level = scratch.ahead_of, scratch.control[NEXT_LEVEL]
    at, slope, expected = scratch.ahead[WHEN], scratch.ahead[SLOPE], ahead[ONLY_EXPECTED] > 0
    time = at - run.state.now[T]
    scratch.ahead[WHEN] = 0.0
    if not 0.0 < time < time_to_knot or scratch.control[NEW]:
        return False, np.inf
    element, border, landed = land_in_time(run, ahead[ELEMENT], ahead[BORDER], time, slope, np.bool_(0))
    if landed:
        _continue_after(run, element, border, level, False)
    elif expected:
        scratch.ahead[WHEN], ahead[ONLY_EXPECTED] = at, 0
        return False, _SHORTLY_BEFORE * time
    return landed, np.inf


@inlined
def _expect_border(run):
    """Keep the border that the accepted step lets expect, but one that a step has crossed."""
    scratch = run.scratch
    time, known = run.state.now[T] + scratch.expected[WHEN], scratch.ahead[WHEN] > 0.0
    ahead, expected = scratch.ahead_of, scratch.expected_of
    same = ahead[ELEMENT] == expected[ELEMENT] and ahead[BORDER] == expected[BORDER]
    if time < np.inf and (same or not known):
        scratch.ahead[WHEN], scratch.ahead[SLOPE] = time, scratch.expected[SLOPE]
        ahead[ELEMENT], ahead[BORDER], ahead[ONLY_EXPECTED] = expected[ELEMENT], expected[BORDER], 0 if known else 1


@merged
def _continue_after(run, element, border, level, alone):
    """Go on after a landing on a bend or border: what it ends is renewed, the next step is the first of a segment."""
    state = run.state
    control = run.scratch.control
    state.count[STEPS] += 1
    if state.now[T] < state.now[T_END]:
        go_beyond(run, element, border, alone)
    control[NEW], control[NODE_SET], control[NEXT_LEVEL] = SEGMENT, 0, level
    if rubs(run.problem, element):  # the contact may have just begun, its force still singular
        control[NODE_SET] = entry_nodes(run, element, control[NEXT_LEVEL])


@merged
def _try_landing(run, stop, direction, time_to_knot):
    """Land on the knot reached first, and switch its stop, or on a border of friction before it; returns success."""
    problem, state = run.problem, run.state
    level = run.scratch.control[NEXT_LEVEL]
    stop, direction, element, border, opened = land_first(run, stop, direction, time_to_knot)
    if stop < 0 and is_planar(problem) and element >= 0 and rubs(problem, element):
        element, border, landed = land_in_time(run, element, border, time_to_knot, 0.0, opened)
        if landed:
            _continue_after(run, element, border, level, False)
        return landed
    if stop < 0:
        return False
    state.count[STEPS] += 1
    if state.now[T] < state.now[T_END]:
        switch(problem, state, stop, direction)
        if in_contact(state):
            begin_steps(run, stop)
    return True


@merged
def _try_landing_now(run, stop, direction, time_to_knot):
    """Land on a border that is known to be ahead, or on the knot reached first if that is worth a trial.

    Returns whether it was done, and the longest step, s, that ends well before both.
    """
    longest = 0.8 * time_to_knot
    if run.scratch.ahead[WHEN] > 0.0:
        landed, before = _try_border_ahead(run, time_to_knot)
        if landed:
            return True, longest
        longest = min(longest, before)
    worth = stop >= 0 and may_land(run, stop, direction, time_to_knot)
    landed = worth and _try_landing(run, stop, direction, time_to_knot)
    return landed, longest


@part(ACCEPT, types.void, *[types.int64] * 3, REAL, *[types.int64] * 2)
def _accept(run, node_set, level, wanted, error, element, border):
    """Complete the accepted step: samples, energy, event record, next level; or the end of the run inside it.

    ``element`` and ``border`` are those of `Attempt`.
    """
    problem, state, scratch = run.problem, run.state, run.scratch
    h = run.tables.contact_step[level]
    end = state.now[T] + h
    run_ends = end >= state.now[T_END]
    if run_ends or state.due[state.count[SAMPLED]] <= end:
        sample_step(run, node_set, level)
    if run_ends:
        end_run(run, node_set, level)
        return
    for r in range(problem.gap.size):
        if acts(problem, state, r):
            copy(scratch.force[r], scratch.previous[r], S)
    if run.energy_tables.active > 0.0:
        account_contact(run, node_set, level, h)
    if state.event_record.shape[0]:
        record_forces(run, STEP, end, node_set, level)
    if problem.parts[FIRST_END] and element < 0:
        _expect_border(run)
    finish_step(run, node_set, level)
    _adapt(run, level, node_set, wanted, error)
    if element >= 0:  # crossed within the shortest step
        go_beyond(run, element, border, True)
        scratch.control[NEW] = SEGMENT if border >= 0 else 0
    state.count[STEPS] += 1


@inlined
def _end_before(run, level, tried):
    """Level of a step that ends shortly before what the step tried crosses, so that the next one can land there."""
    scratch = run.scratch
    scratch.ahead[WHEN] = run.state.now[T] + tried.time if tried.border >= 0 else 0.0
    scratch.ahead[SLOPE], ahead = tried.slope, scratch.ahead_of
    ahead[ELEMENT], ahead[BORDER], ahead[ONLY_EXPECTED] = tried.element, tried.border, 0
    return min(max(level + 1, level_of(run.tables, _SHORTLY_BEFORE * tried.time)), level + _CROSSING_KNOWN)


@part(CONTACT, types.int64)
def advance_contact(run):
    """One accepted step in contact, a landing on what is near, else by collocation; returns a status code."""
    problem, tables, state, scratch = run.problem, run.tables, run.state, run.scratch
    control, shortest = scratch.control, tables.contact_step.size - 1
    time_to_knot, stop, direction = _nearest_knot(run)
    scratch.last_resort[0] = 0
    if time_to_knot < shortest_step(tables) or control[NEXT_LEVEL] == shortest:
        found = _leave_or_rest(run, stop, time_to_knot)
        if found == MOVES_OUT:
            return RUNNING
        if found == RESTS:
            time_to_knot, stop, direction = np.inf, -1, 0
    if control[NEW] == ENTRY and _is_too_brief(run):
        return STEP_TOO_SMALL
    if control[NEW] == ENTRY and problem.parts[PRESSED] and _switch_pressed(run):
        begin_steps(run, latest_entered(state))
        return RUNNING
    landed, longest = _try_landing_now(run, stop, direction, time_to_knot)
    if landed:
        return STEP_TOO_SMALL if scratch.last_resort[0] == TURNED else RUNNING
    node_set, wanted = control[NODE_SET] if control[NEW] else 0, control[NEXT_LEVEL]
    if problem.table_dt.size:
        allowed = land_on_kink_or_limit(run, wanted)
        if allowed == 0.0:  # the step to the kink is done
            return RUNNING
        longest = min(longest, allowed)
    # `longest` may be 0, beside a surface that is left or entered at rest
    level = level_of(tables, longest) if longest < tables.contact_step[wanted] else wanted
    return _step(run, node_set, level, wanted)


@merged
def _step(run, node_set, level, wanted):
    """Try a step of a level, and shorter ones, until one is accepted or a landing is done; returns a status code."""
    state, scratch, shortest = run.state, run.scratch, run.tables.contact_step.size - 1
    copy(scratch.side, scratch.side_at_begin, scratch.side.size)
    if run.tables.follows > 0.0:
        note_swing(run)
    while True:
        tried = _attempt(run, node_set, level)
        element, border = tried.element, tried.border
        if tried.error <= 1.0 and (element < 0 or not rubs(run.problem, element)):
            break
        on_it = tried.time == 0.0 and border >= 0  # the step begins on the border
        if element >= 0 and not on_it:
            element, border, on_it = land_in_time(run, element, border, tried.time, tried.slope, np.bool_(0))
        if on_it:
            _continue_after(run, element, border, max(level, wanted), tried.time == 0.0)
            return RUNNING
        if tried.error <= 1.0:  # the step is the shortest, and no landing is possible within it
            break
        if level == shortest:
            return LAW_NOT_FINITE if _force_not_finite(run) else STEP_TOO_SMALL
        copy(scratch.side_at_begin, scratch.side, scratch.side.size)
        state.count[REJECTED] += 1
        if tried.element >= 0:
            level = _end_before(run, level, tried)
        else:
            level = wanted = min(shortest, level + _levels_shorter(tried.error))
    if level == shortest and _moves_within(run):
        return STEP_TOO_SMALL
    _accept(run, node_set, level, wanted, tried.error, tried.element, tried.border)
    return RUNNING


@inlined
def _is_too_brief(run):
    """Whether an impact of a speed that counts lasts less than a hundred of the shortest steps.

    Those of a stop that comes to rest may become shorter and shorter.
    """
    scratch = run.scratch
    s = scratch.control[STOP]
    brief = scratch.duration[s] < _FEWEST_STEPS * shortest_step(run.tables)
    return brief and indentation_rate(run.problem, s, run.state.x) > _COUNTS * scratch.reference_speed[s]


@inlined
def _spring_swings_within(run, s):
    """Whether the spring of a slider that sticks swings on the body so fast that the shortest step is no small part."""
    problem = run.problem
    if not (rubs(problem, s) and run.state.segment[s] > 0 and slider_of(problem, s)[CODE] == STICK):
        return False
    mobility = 0.0
    for r in range(row_of(problem, s) + (0 if is_circle(problem, s) else 1), row_of(problem, s + 1)):
        mobility += run.tables.accelerance[r, r]
    return slider_of(problem, s)[STIFFNESS] * mobility * shortest_step(run.tables) ** 2 > _SWING * _SWING


@inlined
def _swings_within(run, s):
    """The same of an element by itself, as stiff as its forces have changed over the change of δ on the step."""
    force, deltas = force_of(run, s), motion_of(run, s)[0]
    low, high, least, most = force[0], force[0], deltas[0], deltas[0]
    for i in range(1, S):
        low, high = min(low, force[i]), max(high, force[i])
        least, most = min(least, deltas[i]), max(most, deltas[i])
    change = (high - low) * own_accelerance(run, s) * shortest_step(run.tables) ** 2
    moved = most - least + surface_tolerance(run.problem, s, run.state.x)
    return run.state.segment[s] > 0 and not is_circle(run.problem, s) and change > _SWING * _SWING * moved


@merged
def _moves_within(run):
    """Whether a dashpot, a spring of friction or a force moves an element so fast that no step resolves it."""
    found = False
    for s in range(run.problem.law.size):
        if run.state.segment[s] > 0 and run.scratch.viscous[s] > 0.0:
            rate = run.scratch.viscous[s] * own_accelerance(run, s)
            found |= rate * shortest_step(run.tables) > 1.0
        found |= _spring_swings_within(run, s)
        found |= _swings_within(run, s)
    return found


@merged
def _force_not_finite(run):
    """Whether a force of a stop in contact is not finite at a node."""
    for r in range(run.problem.gap.size):
        for i in range(S):
            if acts(run.problem, run.state, r) and not abs(run.scratch.force[r, i]) < np.inf:
                return True
    return False


@inlined
def _levels_shorter(error):
    """Levels by which a step is tried shorter: 1 + ⌊2/15 log₂(error/goal)⌋, or 2 if the error is not known."""
    return 1 + int(2.0 / _ORDER * math.log2(error / _ERROR_GOAL)) if error < np.inf else 2


@inlined
def _levels_longer(error):
    """Levels, -1 to 2, by which the next step may be longer: ⌊2/15 log₂(goal/error)⌋."""
    if error > _ERROR_GOAL:
        return -1
    if error > _ERROR_GOAL * _ONE_LEVEL:
        return 0
    return 1 if error > _ERROR_GOAL * _ONE_LEVEL * _ONE_LEVEL else 2


@merged
def _adapt(run, level, node_set, wanted, error):
    """Set the level of the next step from the error of this one, which is at most 1.

    With an energy balance it is one for which this has tables: panels in longer steps take more time than steps do.
    """
    scratch = run.scratch
    control = scratch.control
    if control[NEW] == ENTRY:  # the next contact of this stop begins with the step that proved right in this one
        s, levels = control[STOP], 2.0 / _ORDER * math.log2(_ERROR_GOAL / max(error, 1e-30))
        if level != control[NEXT_LEVEL]:
            scratch.first_step_share[s] = run.tables.contact_step[level] / scratch.duration[s]
        scratch.first_step_share[s] *= 2.0 ** (0.5 * min(max(levels, -1.0), 0.5))
    longest = int(run.tables.observed) if run.energy_tables.active > 0.0 else 0
    suggested = min(max(level - _levels_longer(error), longest), run.tables.contact_step.size - 1)
    control[NEXT_LEVEL] = suggested if level == wanted else min(suggested, wanted)
    control[LEVEL], control[NODE_SET], control[NEW] = level, node_set, 0
