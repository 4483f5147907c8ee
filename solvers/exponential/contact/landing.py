"""Locating the end of a contact, or of a segment of its law: one Runge–Kutta step that lands on the border.

It is a step of DOP853 with t among the unknowns, in a variable in which the motion is smooth:

    INDENTATION   dt = dδ/δ̇         lands exactly on a kink, or on another stop's surface
    ROOT          dt = κ u^{κ-1} du/δ̇, u = δ^{1/κ}, κ as at entry: lands exactly on δ = 0, where δ^{3/2} is singular
    TIME          dt                lands on a bend or border by the secant rule; the force is continuous there
    SINCE         dt = κ u^{κ-1} du, u = (t - t_in)^{1/κ}: the same from an entry on, where δ^{3/2} is singular

A border of friction just before δ = 0 is landed on in the variable of `ROOT` too. The node polynomial of the step tried
tells bends and borders to 1e-5 of their time and better; what is left is made up from the end of the first landing by
the midpoint rule, so that most of them take one Runge–Kutta step.

The unknowns are [p, v, energy balance, t, u]. The fastest block moves by less than `landing_reach` radians, within
which the step of every block is exact to the tolerance. The error by the forces is estimated by a tenth of the embedded
fifth-order difference, for every stop in units of its own tolerance: in these variables this is a few times the true
error, while DOP853's own mixed estimate is below it. All of it counts where the stop's dashpot is too strong for an
explicit step. A landing stays within a cell of sampled signals, whose kinks the difference does not see.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.compiled.dop853_tableau import E3, E5, STAGES
from solvers.compiled.friction import drawn
from solvers.compiled.kernels import (
    abs_dot,
    contact_gradient,
    copy,
    dot,
    element_of,
    indentation,
    indentation_and_rate,
    indentation_rate,
    inlined,
    inner,
    is_circle,
    is_planar,
    merged,
    radius_of,
    raised,
    row_of,
    rubs,
    slider_of,
)
from solvers.compiled.parts import PASSED
from solvers.compiled.sliding import WAY, slider_force, way_tolerance
from solvers.compiled.state import (
    CALLS,
    LANDING,
    PEAK_DELTA,
    PEAK_FORCE,
    SAMPLED,
    T_END,
    T,
    rate_tolerance,
    surface_tolerance,
    write_event,
)
from solvers.compiled.sums import combine
from solvers.exponential.circles.contact import land_on_circle
from solvers.exponential.contact.borders import margins_later, margins_of, passed
from solvers.exponential.contact.crossings import CLEAR, TOO_LONG, before_landing, force_turns, side_at
from solvers.exponential.contact.first_step import BALANCED, NEW, NODE_SET
from solvers.exponential.contact.landing_step import INDENTATION, ROOT, SINCE, TIME, landing_step, start_landing
from solvers.exponential.contact.node_response import (
    BATCH,
    DIFFERENCE,
    LANDED,
    REACH,
    RTOL,
    START,
    STRAIGHT,
    WITHIN,
    error_of_work,
)
from solvers.exponential.contact.peaks import state_peaks
from solvers.problem.friction import CODE, PEAK, STIFFNESS

_MOST_TRIES = 8  # to find the step that ends at an output time, or on a bend
_SMALL = 1e-4  # part of a landing by which its length may change without another step: the rule's error is its cube
_BEGINS_THERE = 1e-6  # margin, in units of its largest, with which a landing begins on the border that it ends on
_STILL = 1e-10  # margin, in units of its largest, from which on trials that do not halve it have met its rounding
_MOST_VERTICES = 6  # of parabolas, to a maximum inside a landing
_MOST_HALVINGS = 40  # the same on a border, whose margin may hardly change but at the start
_PART = 0.1  # of the embedded difference that counts as the error
_PART_OF_FOURTH = 1e-2  # with u = δ^{1/4}: terms t² = u⁸ are exact in the step, and all of the difference
_OF_SLOPES, _MOST_SLOPE = 0.01, 1e4  # the derivative of a run may err by a hundred tolerances of the motion
_OF_LARGEST = 1e-11  # of a margin, in units of its largest, that is rounding
_LAST = 0.09  # indentation, in units of the deepest, from which the last step is tried
_LAST_ROOT, _MOST_ROOT = 0.2, 0.25  # the same of u = δ^{1/2}, / reach², and at most: its error grows like u⁹


def landing_reach(rtol: float) -> float:
    """Angle, rad, of the fastest block up to which DOP853's error, 7e-8 θ⁹, is below a tenth of rtol."""
    return min((0.1 * rtol / 7e-8) ** (1.0 / 9.0), 1.5)


@inner
def _error(problem, scratch, part):
    """Largest error of an indentation rate in the step just taken, in units of the stop's tolerance.

    It is estimated by a ``part`` of the embedded difference.
    """
    worst = 0.0
    combine(scratch.stages, E5, STAGES, None, scratch.stages[DIFFERENCE])
    for r in range(problem.gap.size):
        error = part * abs_dot(problem.read_rate[r], scratch.stages[DIFFERENCE], 2 * problem.k.size)
        error /= scratch.accuracy[RTOL] * scratch.reference_speed[element_of(problem, r)]
        if not error <= worst:
            worst = error
    return worst


@inlined
def _difference(problem, r, d, span):
    """An embedded difference of rate and displacement of a row, as a rate, m/s.

    The changes of the displacement are summed with their signs: where dashpots couple the modes it reads rates v of the
    blocks, which a force changes at once, while their sum stays.
    """
    size = 2 * problem.k.size
    return abs_dot(problem.read_rate[r], d, size) + abs(dot(problem.read[r], d, size)) / span


@inlined
def _mixed(fifth, third):
    """The error that two embedded differences tell of."""
    return fifth * fifth / math.hypot(fifth, 0.1 * third) if fifth > 0.0 else fifth


@inlined
def _error_of_work_in_time(problem, state, scratch, s, span):
    """The same of the force of an element with memory, the rate of its impulse, as a mean over the step."""
    work, impulse, largest = scratch.stages, 2 * problem.k.size + 3 + 2 * s, 1e-300
    deltas, rates, slope = scratch.clipped[0:2], scratch.trial[0:2], scratch.slope[s, :, 0:2]
    deltas[0], rates[0] = indentation_and_rate(problem, s, work[START])
    deltas[1], rates[1] = indentation_and_rate(problem, s, work[LANDED])
    contact_gradient(problem, s, deltas, rates, state.entry_rate[s], slope[0], slope[1], slope[2])
    by_delta, by_rate = max(abs(slope[0, 0]), abs(slope[0, 1])), max(abs(slope[1, 0]), abs(slope[1, 1]))
    bent = abs(slope[0, 0] - slope[0, 1]) > STRAIGHT * by_delta or abs(slope[1, 0] - slope[1, 1]) > STRAIGHT * by_rate
    if not bent:  # the force is as exact as the motion
        return 0.0
    for i in range(1, STAGES):
        largest = max(largest, abs(work[i, impulse]) / work[i, state.x.size])
    unresolved = _mixed(abs(work[DIFFERENCE, impulse]), abs(work[BATCH, impulse])) / span
    return error_of_work(problem, state, scratch, s, unresolved, largest, (by_delta, by_rate))


@inner
def _error_in_time(problem, state, scratch, span):
    """The same of a step in time, from both embedded differences of rate and indentation, and of memory's forces."""
    fifth, third, worst = scratch.stages[DIFFERENCE], scratch.stages[BATCH], 0.0
    combine(scratch.stages, E5, STAGES, None, fifth)
    combine(scratch.stages, E3, STAGES, None, third)
    for r in range(problem.gap.size):
        error = _mixed(_difference(problem, r, fifth, span), _difference(problem, r, third, span))
        error /= scratch.accuracy[RTOL] * scratch.reference_speed[element_of(problem, r)]
        if not error <= worst:
            worst = error
    for s in range(problem.law.size):
        if problem.border_count[s] > 0 and problem.knots[s, 0] < 0.0:
            worst = max(worst, _error_of_work_in_time(problem, state, scratch, s, span))
    return worst


@merged
def _goes_ahead(scratch, size):
    """Whether time goes forward in every stage of the step just taken.

    If it does not, the stop turns back before the border, the step passes a pole of 1/δ̇, and its embedded difference
    is no estimate. At δ = 0, where the last stages of `ROOT` end, dt/du = 0 up to rounding.
    """
    ahead = True
    for i in range(STAGES):
        ahead &= scratch.stages[i, size] >= -1e-9 * scratch.stages[0, size]
    return ahead


@inner
def _step(problem, tables, state, scratch, variable, stop, span):
    """A step from ``scratch.stages[START]`` to ``scratch.stages[LANDED]``."""
    state.count[CALLS] += landing_step(
        *(problem, tables, scratch.control[BALANCED] > 0, np.bool_(0), variable, stop, span, scratch.stages[START]),
        *(state.segment, state.entry_rate, scratch.side, scratch.stages),
    )


@inner
def _move(problem, tables, state, scratch, variable, stop, span):
    """Go on from ``scratch.stages[LANDED]`` by a small part of the step that led there."""
    copy(scratch.stages[LANDED], scratch.stages[WITHIN], scratch.stages.shape[1])
    state.count[CALLS] += landing_step(
        *(problem, tables, scratch.control[BALANCED] > 0, np.bool_(1), variable, stop, span, scratch.stages[WITHIN]),
        *(state.segment, state.entry_rate, scratch.side, scratch.stages),
    )


@merged
def _length_to(problem, tables, state, scratch, variable, stop, span, landed, time):
    """Length of the step that ends, in ``scratch.stages[LANDED]``, at a time before the landing; inf if not found."""
    w, x, size, tries = scratch.stages[START], scratch.stages[LANDED], state.x.size, 0
    t = w[size]
    left = (landed - time) / (landed - t) if landed > t else 0.0
    kappa = tables.time_exponent[1 + stop]
    length = span * (1.0 - (left ** (1.0 / kappa) if variable == ROOT else left))
    if variable == SINCE:
        length = span * (1.0 - left) ** (1.0 / kappa)
    while True:
        _step(problem, tables, state, scratch, variable, stop, length)
        late, tries = x[size] - time, tries + 1
        pace = 1.0 if variable >= TIME else indentation_rate(problem, stop, x)  # d(variable)/dt
        if variable in (ROOT, SINCE):
            pace /= kappa * raised(x[size + 1], kappa - 1.0)
        if not abs(late) > 1e-15 * landed or not abs(pace) < np.inf or tries == _MOST_TRIES:
            return length if abs(late) <= 1e-6 * (landed - t) + 1e-15 * landed else np.inf
        length -= late * pace


@merged
def _begin_peaks(problem, state, scratch):
    """Raise the peak forces by those at the start of a landing, which its first stage has computed."""
    work, size, first = scratch.stages, state.x.size, 2 * problem.k.size + 3
    for s in range(state.segment.size if work[0, size] != 0.0 else 0):
        if state.segment[s] > 0:
            column = first + 2 * s
            state.active[s, PEAK_FORCE] = max(state.active[s, PEAK_FORCE], work[0, column] / work[0, size])
            if rubs(problem, s):
                own, column = slider_of(problem, s), problem.friction[s, 1] + 1
                own[PEAK] = max(own[PEAK], abs(work[0, column] / work[0, size]))


@inner
def _drag(problem, tables, state, scratch, variable, stop, length, s):
    """|F_t| of stop s after a part of a landing."""
    x = scratch.stages[LANDED]
    _step(problem, tables, state, scratch, variable, stop, length)
    return abs(slider_force(problem, s, state.segment[s], state.entry_rate[s], x[state.x.size], x))


@inner
def _peak_of_drag(problem, tables, state, scratch, variable, stop, span, s):
    """Raise the largest |F_t| of stop s by its maximum inside a landing, by vertices of parabolas."""
    a, b, c, own = 0.0, 0.5 * span, span, slider_of(problem, s)
    low = _drag(problem, tables, state, scratch, variable, stop, a, s)
    best = _drag(problem, tables, state, scratch, variable, stop, b, s)
    high = _drag(problem, tables, state, scratch, variable, stop, c, s)
    for _ in range(_MOST_VERTICES):
        rise, fall = (b - a) * (best - high), (c - b) * (best - low)
        if not rise + fall > 0.0:
            break
        vertex = b - 0.5 * ((b - a) * rise - (c - b) * fall) / (rise + fall)
        if not a < vertex < c or abs(vertex - b) <= 1e-6 * span:
            break
        value = _drag(problem, tables, state, scratch, variable, stop, vertex, s)
        if value >= best:
            a, low, c, high = (a, low, b, best) if vertex < b else (b, best, c, high)
            b, best = vertex, value
        elif vertex < b:
            a, low = vertex, value
        else:
            c, high = vertex, value
    own[PEAK] = max(own[PEAK], best)


@inlined
def _turns(problem, scratch, width, s):
    """Whether |F_t| has a maximum above its peak inside the landing whose stages are there."""
    work, column = scratch.stages, problem.friction[s, 1] + 1
    sign = math.copysign(1.0, work[0, column] + work[STAGES - 2, column])
    return force_turns(work, column, width, slider_of(problem, s)[PEAK], sign)


@inner
def _accept(problem, tables, state, scratch, variable, stop, level, span):
    """Move the state to the landing in ``scratch.stages[LANDED]``, or to the end of the run; write samples between.

    The level is the indentation landed on, inf if it is a bend or border.
    """
    w, x, size = scratch.stages[START], scratch.stages[LANDED], state.x.size
    landed, t, t_end = x[size], state.now[T], state.now[T_END]
    _begin_peaks(problem, state, scratch)
    if is_planar(problem):
        for s in range(problem.friction.shape[0]):
            turns = rubs(problem, s) and state.segment[s] > 0 and _turns(problem, scratch, size, s)
            scratch.unresolved[s] = 1.0 if turns else 0.0
    copy(x, state.x, size)
    while True:
        due = state.due[state.count[SAMPLED]]
        time = min(due, t_end)
        if time > landed:
            break
        length = _length_to(problem, tables, state, scratch, variable, stop, span, landed, time)
        if length == np.inf:
            copy(w, state.x, size)
            return False
        if time == due:
            copy(x, state.out[state.count[SAMPLED]], size)
            state.count[SAMPLED] += 1
        if time == t_end:
            copy(x, state.x, size)
            landed, span = t_end, length
            break
    if is_planar(problem):
        for s in range(problem.friction.shape[0]):
            if scratch.unresolved[s] > 0.0:
                _peak_of_drag(problem, tables, state, scratch, variable, stop, span, s)
    if state.event_record.shape[0]:
        write_event(state, LANDING, t, landed, span, variable, stop, w)
    state.now[T] = landed
    if is_circle(problem, stop) and level < np.inf and landed < t_end:
        land_on_circle(problem, state, scratch, stop, level)
    if variable != ROOT or landed == t_end:  # at a knot the force may fall
        state_peaks(problem, state, scratch, state.x)
    return True


@inlined
def _furthest(problem, tables, state, scratch):
    """Longest landing, s: within the reach of the fastest block, and within a cell of the sampled signals.

    If a derivative is asked for, also within the reach of what the contacts stiffen.
    """
    furthest = scratch.accuracy[REACH] / tables.fastest
    if state.event_record.shape[0]:
        furthest = min(furthest, scratch.accuracy[REACH] / max(scratch.stiffened[0], 1e-300))
    return min(furthest, problem.table_dt[0]) if problem.table_dt.size else furthest


@merged
def _slopes_by_forces(problem, tables, state, stop, w, x):
    """Error of the derivative by that of the motion: a force like δ^{3/2} that errs by e has a slope that errs by e/δ.

    With derivatives in units of the largest motion of a stop's place, another stop counts that was entered just now.
    """
    most = 0.0
    for s in range(problem.law.size):
        if s != stop and state.segment[s] > 0 and tables.time_exponent[1 + s] > 1.0:
            deepest = max(indentation(problem, s, w), indentation(problem, s, x))
            most = max(most, abs_dot(problem.read[row_of(problem, s)], w, 2 * problem.k.size) / max(deepest, 1e-300))
    return min(most, _MOST_SLOPE)


@inlined
def _level(problem, state, stop, direction):
    """Indentation at the border of the stop's segment in a direction."""
    return problem.knots[stop, state.segment[stop] - (1 if direction < 0 else 0)]


@inlined
def may_land(problem, tables, state, scratch, stop, direction, near):
    """Whether a border of ``stop``, about ``near`` s ahead, is so near that one step may land on it.

    δ and δ̇ of the stops at the start of the step are in ``scratch.start_motion``.
    """
    delta, rate = scratch.start_motion[stop, 0], scratch.start_motion[stop, 1]
    if near > _furthest(problem, tables, state, scratch) or abs(rate) <= rate_tolerance(problem, stop, state.x):
        return False
    if direction < 0 and state.segment[stop] == 1:
        last = _LAST
        if tables.time_exponent[1 + stop] == 2.0:
            last = min(_LAST_ROOT * scratch.accuracy[REACH] ** 2, _MOST_ROOT)
        return delta <= last * state.active[stop, PEAK_DELTA]
    level = _level(problem, state, stop, direction)
    return state.segment[stop] == 0 or abs(level - delta) <= 0.2 * max(level, delta)


@merged
def _part_of_error(problem, tables, state, scratch, variable, stop):
    """Part of the embedded difference that counts as the error of the landing just tried."""
    part = _PART_OF_FOURTH if variable == ROOT and tables.time_exponent[1 + stop] == 4.0 else _PART
    if scratch.viscous[stop] > 0.0:  # too strong a dashpot for an explicit step
        part = 1.0
    if state.event_record.shape[0]:
        w, x = scratch.stages[START], scratch.stages[LANDED]
        part = max(part, _OF_SLOPES * _slopes_by_forces(problem, tables, state, stop, w, x))
    return part


@merged
def land(problem, tables, state, scratch, stop, direction, near):
    """Try to land on a border of ``stop``, about ``near`` s ahead.

    Returns ``stop`` if it succeeded, another stop whose border is crossed before, or -1. A border of a law with memory
    that is passed before is noted in ``scratch.landed``.
    """
    size, t, rate = state.x.size, state.now[T], scratch.start_motion[stop, 1]
    scratch.landed[0] = -1
    if not may_land(problem, tables, state, scratch, stop, direction, near):
        return -1
    furthest, kappa = _furthest(problem, tables, state, scratch), tables.time_exponent[1 + stop]
    leaving = direction < 0 and state.segment[stop] == 1
    start_landing(problem, tables, state, scratch, stop, np.int64(ROOT))
    w, x = scratch.stages[START], scratch.stages[LANDED]
    variable = ROOT if leaving and kappa > 1.0 else INDENTATION
    span = -w[size + 1] if variable == ROOT else _level(problem, state, stop, direction) - scratch.start_motion[stop, 0]
    _step(problem, tables, state, scratch, variable, stop, span)
    landed, part = x[size], _part_of_error(problem, tables, state, scratch, variable, stop)
    width = surface_tolerance(problem, stop, state.x) / abs(rate)  # a distance may be that much rounding
    if not t <= landed <= t + min(4.0 * near, furthest) + width:
        return -1
    if not (
        _goes_ahead(scratch, size)
        and _error(problem, scratch, part) <= 1.0
        and direction * indentation_rate(problem, stop, x) >= 0.0  # it has not turned back
    ):
        return -1
    other = before_landing(problem, tables, state, scratch, stop, np.bool_(0), w, x)
    if other == CLEAR and problem.parts[PASSED]:
        scratch.landed[0], scratch.landed[1] = passed(problem, state, scratch, -1, -1, w, x)
        if scratch.landed[0] != -1:
            other = TOO_LONG
    if other != CLEAR:
        return max(other, -1)
    level = _level(problem, state, stop, direction)
    done = _accept(problem, tables, state, scratch, variable, stop, level, span)
    return stop if done else -1


@inlined
def _apart(problem, tables, state, scratch, stop, border, x, sign):
    """What falls to zero where a landing in time ends: the margin of a border, or if that is -1 the side of a bend.

    Of a slider that sticks, with a sign that is not 0, it is the margin against slip that way: it has no kink where
    F_t turns. Where |F_t| is too large, that way is the sign of F_t. Returned with the sign.
    """
    if border < 0:
        return side_at(problem, tables, state, stop, x, scratch.trial), sign
    margins_of(problem, state, scratch, stop, x[state.x.size], x, scratch.margin)
    value = scratch.margin[border]
    if is_planar(problem) and sign != 0.0:
        own = slider_of(problem, stop)
        force = own[STIFFNESS] * drawn(radius_of(problem, stop), own, scratch.point[1, WAY])
        if value < 0.0:
            sign = math.copysign(1.0, force)
        value += abs(force) - sign * force
    return value, sign


@merged
def _rises(problem, state, scratch, s, border, value, time):
    """Whether a margin of a value was lower so long before the landing, by the rates there."""
    x = scratch.stages[LANDED]
    margins_later(problem, state, scratch, s, x[state.x.size], x, -time, scratch.ends)
    return scratch.ends[border] < value


@inlined
def _opens(problem, tables, state, scratch, stop):
    """Whether one step may end where a stop with friction opens: up to there the motion is smooth in u only."""
    delta, rate = scratch.start_motion[stop, 0], scratch.start_motion[stop, 1]
    if not (rubs(problem, stop) and state.segment[stop] == 1 and tables.time_exponent[1 + stop] > 1.0 and rate < 0.0):
        return False
    return may_land(problem, tables, state, scratch, stop, np.int64(-1), delta / -rate)


@inlined
def _power(tables, stop):
    """Exponent of u with which N ends where a stop opens, as a rule."""
    return tables.time_exponent[1 + stop] + 1.0


@merged
def _begin_at_opening(problem, tables, state, scratch, stop, border, near):
    """Way in u of a landing on a border before a stop opens; the scale of its margin up to there is noted.

    The place is guessed from margins at both ends for a slider that sticks, with the way it slips; else, and where a
    margin that begins at zero rises before it falls, from the time as if δ̇ stayed, with 0.
    """
    u, delta, own = scratch.stages[START, state.x.size + 1], scratch.start_motion[stop, 0], slider_of(problem, stop)
    w, kappa, sticks = scratch.stages[START], tables.time_exponent[1 + stop], 1.0 if own[CODE] == 0.0 else 0.0
    begin, _ = _apart(problem, tables, state, scratch, stop, border, w, 0.0)
    _step(problem, tables, state, scratch, np.int64(ROOT), stop, -u)
    end, sign = _apart(problem, tables, state, scratch, stop, border, scratch.stages[LANDED], sticks)
    largest = max(abs(begin), abs(scratch.margin[border]))
    rounding = own[STIFFNESS] * way_tolerance(problem, stop, state.now[T], state.x)[0]
    scratch.largest[stop, border], scratch.noise[stop, border] = largest, max(_OF_LARGEST * largest, 2.0 * rounding)
    if sticks > 0.0 and end < 0.0 and begin > _BEGINS_THERE * largest:
        begin, _ = _apart(problem, tables, state, scratch, stop, border, w, sign)
        return u * (1.0 - (end / (end - begin)) ** (1.0 / _power(tables, stop))), sign
    left = max(1.0 + near * scratch.start_motion[stop, 1] / delta, 0.0) if delta > 0.0 else 0.0
    return u * (1.0 - left ** (1.0 / kappa)), 0.0


@merged
def _is_exact(problem, tables, state, scratch, variable, stop, time):
    """Whether the landing just tried, so long, is within the tolerance."""
    if variable != ROOT:
        return _error_in_time(problem, state, scratch, time) <= 1.0
    part = _part_of_error(problem, tables, state, scratch, variable, stop)
    return _goes_ahead(scratch, state.x.size) and _error(problem, scratch, part) <= 1.0


@inlined
def _between(above, below):
    """A time between two, of which the first may be zero, or smaller by powers of ten."""
    return math.sqrt(above * below) if above > 0.0 else 1e-3 * below


@inlined
def _secant(span, value, before, apart, end, power):
    """Where a margin is zero by two trials, if it is a straight line in (end - span)^power."""
    if power == 1.0:
        return span - value * (span - before) / (value - apart)
    left, more = (end - span) ** power, (end - before) ** power
    return end - max(left - value * (left - more) / (value - apart), 0.0) ** (1.0 / power)


@merged
def _meet(problem, tables, state, scratch, stop, border, search):
    """Find the bend or border by the secant rule; (span, what is left of its margin), or NaN.

    A trial that differs little from the one before goes on from there.
    """
    variable, way, span, furthest, largest, enough, sign = search
    x, before, power = scratch.stages[LANDED], 0.0, _power(tables, stop) if sign != 0.0 else 1.0
    apart, sign = _apart(problem, tables, state, scratch, stop, border, scratch.stages[START], sign)
    begins_there = (apart if border >= 0 else abs(apart)) <= _BEGINS_THERE * largest
    least = 0.0 if border >= 0 and not begins_there else 0.1 * span
    if begins_there:  # the secant needs another point
        before = 0.9 * span
        _step(problem, tables, state, scratch, variable, stop, way * before)
        apart, sign = _apart(problem, tables, state, scratch, stop, border, x, sign)
    above, below = before if apart > 0.0 else 0.0, furthest
    for _ in range(_MOST_TRIES if border < 0 else _MOST_HALVINGS):
        if abs(span - before) <= _SMALL * span:
            _move(problem, tables, state, scratch, variable, stop, way * (span - before))
        else:
            _step(problem, tables, state, scratch, variable, stop, way * span)
        value, sign = _apart(problem, tables, state, scratch, stop, border, x, sign)
        following = _secant(span, value, before, apart, furthest, power)
        still = abs(following - span) <= 1e-15 * span and border >= 0
        if still or abs(value) <= enough or 0.5 * abs(apart) <= abs(value) <= _STILL * largest:
            break
        if border >= 0:
            above, below = (span, below) if value > 0.0 else (above, span)
            if (below < furthest or way < 0.0) and not above < following < below:
                following = _between(above, below)
                if rubs(problem, stop):  # not back to where it begins
                    following = max(following, 2.0 * least)
        if not least < following <= furthest or following == span:
            return span, np.nan
        before, apart, span = span, value, following
    return span, value


@merged
def land_on_bend(problem, tables, state, scratch, stop, border, near):
    """Try to land on the bend of ``stop``, or on a border of its law, about ``near`` s ahead; whether it succeeded.

    A border that is passed before is noted in ``scratch.landed``: -1 if none is, and less if that cannot be told.
    """
    furthest, largest = _furthest(problem, tables, state, scratch), scratch.bend_values[scratch.bend_values.size - 1]
    enough, sign = 1e-10 * largest, 0.0
    if border >= 0:  # one that is missed by more may seem to be passed the other way by the next step
        largest, enough = scratch.largest[stop, border], 0.1 * scratch.noise[stop, border]
    scratch.landed[0] = -1
    if not 0.0 < near <= furthest:
        return False
    variable, root, way = np.int64(TIME), 1.0, 1.0  # a literal would be compiled for itself
    if border >= 0 and scratch.control[NEW] and scratch.control[NODE_SET] == stop + 1:
        variable, root = np.int64(SINCE), 1.0 / tables.time_exponent[stop + 1]
    start_landing(problem, tables, state, scratch, stop, variable)
    w, x, size = scratch.stages[START], scratch.stages[LANDED], state.x.size
    furthest, span = furthest**root, near**root
    if border >= 0 and variable == TIME and _opens(problem, tables, state, scratch, stop):
        variable, way, furthest = np.int64(ROOT), -1.0, w[size + 1]
        span, sign = _begin_at_opening(problem, tables, state, scratch, stop, border, near)
        largest, enough = scratch.largest[stop, border], 0.1 * scratch.noise[stop, border]
    search = variable, way, span, furthest, largest, enough, sign
    span, value = _meet(problem, tables, state, scratch, stop, border, search)
    time = span if variable == TIME else x[size] - w[size]
    if not (abs(value) <= 1e-6 * largest and _is_exact(problem, tables, state, scratch, variable, stop, time)):
        return False
    rises = border >= 0 and _rises(problem, state, scratch, stop, border, value, 1e-3 * time)
    if rises or before_landing(problem, tables, state, scratch, stop, np.bool_(1), w, x) != CLEAR:
        return False  # it has been below zero before, or another surface or bend is in the way
    scratch.landed[0], scratch.landed[1] = passed(problem, state, scratch, stop, border, w, x)
    if scratch.landed[0] != -1:
        return False
    lower, upper = problem.knots[stop, state.segment[stop] - 1], problem.knots[stop, state.segment[stop]]
    if not lower < indentation(problem, stop, x) < upper:
        return False
    return _accept(problem, tables, state, scratch, variable, stop, np.inf, way * span)
