"""Event location: one Runge–Kutta step, called a landing, ends where a contact or a segment of its law ends.

It is a step of DOP853 with t among the unknowns. The independent variable is one in which the motion is smooth:

    INDENTATION   dt = dδ/δ̇                                ends exactly on a knot, or on the surface of a stop
    ROOT          dt = κ u^{κ-1} du/δ̇, u = δ^{1/κ}         ends exactly on δ = 0, where δ^{3/2} is singular
    TIME          dt                                       ends on a bend or border, or on the kink of a load
    SINCE         dt = κ u^{κ-1} du, u = (t - t_in)^{1/κ}  the same in a step from an entry on, singular like δ^{3/2}

with κ as at entry. The first two know the length of the step beforehand. To a bend or border the others iterate by the
secant rule for a zero of its *event function* (`_event_function`); forces are continuous there. A border of friction
just before δ = 0 is located in the variable of `ROOT` too. The polynomial through the nodes of the step tried before
gives the time to about 1e-5 of its length; the correction is a short step of the midpoint rule or the classical one, so
that most landings take one step of DOP853.

The unknowns are [p, v, energy balance, t, u]. A landing lasts at most `landing_reach` radians of the fastest block, up
to which DOP853 is exact to the tolerance for every block. The error by the forces is in units of each stop's tolerance.
In INDENTATION and ROOT it is estimated by a tenth of the embedded difference of order five: this is a few times the
true error, while DOP853's own estimate, of orders five and three, is below it. The whole difference counts where a
dashpot is too strong for an explicit step. In TIME and SINCE it is DOP853's estimate, see `error_in_time`. A landing
stays within a cell of sampled signals: the difference misses their kinks.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solvers.compiled.dop853_tableau import E3, E5, STAGES
from solvers.compiled.friction import spring_stretch
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
    surface_tolerance,
    work_column,
)
from solvers.compiled.parts import PASSED
from solvers.compiled.sliding import WITHIN_ROUNDING, XI, XI_RATE, slider_force
from solvers.compiled.state import (
    CALLS,
    LANDING,
    PEAK_DELTA,
    PEAK_FORCE,
    SAMPLED,
    T_END,
    T,
    rate_tolerance,
    write_event,
)
from solvers.compiled.sums import combine
from solvers.exponential.circles.contact import land_on_circle
from solvers.exponential.contact.borders import margins_later, margins_of, passed
from solvers.exponential.contact.crossings import CLEAR, ROUNDING, before_landing, force_turns, side_at
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
    own_accelerance,
)
from solvers.exponential.contact.peaks import state_peaks
from solvers.exponential.contact.slider_margins import margin_rounding
from solvers.problem.friction import CODE, FREE, MU, PEAK, SLIDES, STICK, STIFFNESS

_MOST_TRIALS = 8  # iterations for the step that ends at an output time
_MIDPOINT_UP_TO = 1e-4  # change of a landing's length, relative, that the midpoint rule makes: its error is the cube
_CLASSICAL_UP_TO = 4e-3  # the same by the classical rule, of order 4
_BEGINS_ON_BORDER = 1e-6  # margin, in units of its largest, below which a landing begins on the border that it ends on
_STAGNATION = 1e-10  # margin, in units of its largest, below which trials that do not halve it show its rounding
_FOUND = 1e-6  # the same, up to which a landing has found its border
_NEAR_ZERO = 1e-4  # the same, up to which another border may be reached together with the one landed on
_MOST_ROUNDING = 0.01  # the same, up to which rounding of δ may hide a margin's zero
_PROMISED = 0.01  # the same after a first trial whose slope is known, up to which the landing goes on
_HALVINGS, _LEAST_SHARE = 30, 1e-3  # of an interval that contains a root; least share of the way to it
_MOST_VERTICES = 6  # parabolas to the maximum of |F_t| inside a landing
_MOST_BORDER_TRIALS = 40  # on a bend or border: δ may change only near the start, which bisection must find
_ERROR_SHARE = 0.1  # part of the embedded difference that counts as the error
_ERROR_SHARE_FOURTH_ROOT = 3e-2  # the same with u = δ^{1/4}: terms t² = u⁸, exact in the step, make up the difference
_DERIVATIVE_SHARE, _MOST_FACTOR = 0.01, 1e4  # the derivative of a run may err by a hundred tolerances of the motion
_SHARE_OF_CONTACT = 0.2  # longest landing in time on a border of friction, in units of the contact's duration × reach
_SHARE_SINCE_ENTRY = 0.016  # the same of one from the entry on
_NEAR_SURFACE = 1e-6  # δ, in units of its peak, below which its rounding may hide a border
_LEAST_MARGIN = 0.1  # part of a margin's error that counts, in units of the tolerance of δ̇
_ANY_ERROR = 1e300  # but NaN
_TURN = 0.01  # change of δ̇ in a landing, relative, that shorter steps are to resolve
TURNED = 2  # in `Scratch.last_resort`: the landing taken errs, which shorter steps would not
_LEAST_RATE = 0.5  # δ̇ at the end of a landing, in units of that at its start, below which it is too long
_LEAST_RATE_FOURTH_ROOT = 0.8  # the same with u = δ^{1/4}: under constant deceleration the difference is zero at 0.65
_LAST_STEP = 0.09  # indentation, in units of the deepest, below which a landing on δ = 0 is tried
_LAST_STEP_ROOT, _MOST_ROOT = 0.2, 0.25  # the same with u = δ^{1/2}, over reach², and at most: errors grow like u⁹


class Landing(NamedTuple):
    """What came of trying to land."""

    stop: int  # landed on; another one if that leaves its segment before; -1 if no landing was done
    element: int  # whose border is crossed before; -1 if none is, `UNRESOLVED` if a shorter step must tell
    border: int  # its number
    opened: bool  # whether it is the stop's own, before an opening at which the step in ``scratch.stages`` ends


class Search(NamedTuple):
    """How a landing on a bend or border is looked for; lengths are those of the step in its variable."""

    variable: int  # of the step, see the module
    forward: float  # 1, or -1 where the variable falls
    first: float  # length of the first trial
    longest: float  # length up to which a zero is looked for; 0 if a landing is not worth a trial
    largest: float  # scale of the event function
    tolerance: float  # value of the event function that is zero
    sign: float  # of the slip that begins, see `_event_function`; 0 if none does
    slope: float  # of the event function by length at the first trial; 0 if it is not known


class Zero(NamedTuple):
    """Zero of an event function at the end of a step."""

    length: float  # of the step
    value: float  # left of the event function; NaN if no zero is found
    rounding: float  # of the value
    slope: float  # of the event function by length; 0 if it is not known


def landing_reach(rtol: float) -> float:
    """Longest landing as an angle |λ|max t, rad, at which DOP853's error 7e-8 θ⁹ for a block is a tenth of rtol."""
    return min((0.1 * rtol / 7e-8) ** (1.0 / 9.0), 1.5)


@inner
def _rate_error(run, share):
    """Largest error of an indentation rate in the step just taken, in units of the tolerance rtol × reference speed.

    It is a ``share`` of the embedded difference of order five.
    """
    problem, scratch = run.problem, run.scratch
    worst = 0.0
    combine(scratch.stages, E5, STAGES, None, scratch.stages[DIFFERENCE])
    for r in range(problem.gap.size):
        error = share * abs_dot(problem.read_rate[r], scratch.stages[DIFFERENCE], 2 * problem.k.size)
        error /= scratch.accuracy[RTOL] * scratch.reference_speed[element_of(problem, r)]
        if error != error:
            return error
        worst = max(worst, error)
    return worst


@inlined
def _rate_difference(problem, r, d, span):
    """Error of row r by an embedded difference ``d`` of the state: that of δ̇ plus that of δ over the ``span``, m/s.

    The terms of δ are summed with their signs. Where dashpots couple the modes, δ reads the blocks' rates v too, which
    a force changes at once while their sum in δ stays.
    """
    size = 2 * problem.k.size
    return abs_dot(problem.read_rate[r], d, size) + abs(dot(problem.read[r], d, size)) / span


@inlined
def _combined_estimate(fifth, third):
    """DOP853's error estimate e₅²/√(e₅² + 0.01 e₃²) from its embedded differences of order five and three."""
    return fifth * fifth / math.hypot(fifth, 0.1 * third) if fifth > 0.0 else fifth


@inlined
def _memory_force_error(run, s, span):
    """Error of the force of element s, which has memory, over a landing of length ``span``, in units of its tolerance.

    The embedded differences of the impulse over the span are errors of the mean force. 0 if the slopes of the law are
    equal at both ends: then the force is as exact as the motion.
    """
    problem, scratch = run.problem, run.scratch
    work, impulse, largest_force = scratch.stages, work_column(problem, s) + 1, 1e-300
    deltas, rates, slope = scratch.clipped[0:2], scratch.trial[0:2], scratch.slope[s, :, 0:2]
    deltas[0], rates[0] = indentation_and_rate(problem, s, work[START])
    deltas[1], rates[1] = indentation_and_rate(problem, s, work[LANDED])
    contact_gradient(problem, s, deltas, rates, run.state.entry_rate[s], slope[0], slope[1], slope[2])
    by_delta, by_rate = max(abs(slope[0, 0]), abs(slope[0, 1])), max(abs(slope[1, 0]), abs(slope[1, 1]))
    varies = abs(slope[0, 0] - slope[0, 1]) > STRAIGHT * by_delta or abs(slope[1, 0] - slope[1, 1]) > STRAIGHT * by_rate
    if not varies:
        return 0.0
    for i in range(1, STAGES):
        largest_force = max(largest_force, abs(work[i, impulse]) / work[i, run.state.x.size])
    unresolved = _combined_estimate(abs(work[DIFFERENCE, impulse]), abs(work[BATCH, impulse])) / span
    return error_of_work(run, s, unresolved, largest_force, (by_delta, by_rate))


@inner
def error_in_time(run, span):
    """Largest error of a landing in the variable TIME or SINCE, in units of the tolerance.

    It is that of δ and δ̇ of all rows by both embedded differences, and that of the forces of elements with memory.
    """
    problem, scratch = run.problem, run.scratch
    fifth, third, worst = scratch.stages[DIFFERENCE], scratch.stages[BATCH], 0.0
    combine(scratch.stages, E5, STAGES, None, fifth)
    combine(scratch.stages, E3, STAGES, None, third)
    for r in range(problem.gap.size):
        error = _combined_estimate(_rate_difference(problem, r, fifth, span), _rate_difference(problem, r, third, span))
        error /= scratch.accuracy[RTOL] * scratch.reference_speed[element_of(problem, r)]
        if error != error:
            return error
        worst = max(worst, error)
    for s in range(problem.law.size):
        if problem.border_count[s] > 0 and problem.knots[s, 0] < 0.0:
            error = _memory_force_error(run, s, span)
            if error != error:
                return error
            worst = max(worst, error)
    return worst


@merged
def _time_increases(scratch, size):
    """Whether dt/d(variable) > 0 at every stage of the step just taken.

    If it is not, the stop turns back before the border: the step passes a pole of 1/δ̇, and its embedded difference is
    no error estimate. At δ = 0, where the last stages of `ROOT` end, dt/du is 0 up to rounding.
    """
    increases = True
    for i in range(STAGES):
        increases &= scratch.stages[i, size] >= -1e-9 * scratch.stages[0, size]
    return increases


@inner
def take_step(run, variable, stop, span):
    """Take a DOP853 step of length ``span`` from ``scratch.stages[START]`` to ``scratch.stages[LANDED]``."""
    scratch = run.scratch
    run.state.count[CALLS] += landing_step(
        *(run, scratch.control[BALANCED] > 0, np.int64(STAGES), variable, stop, span),
        *(scratch.stages[START], scratch.side),
    )


@inner
def _short_step(run, variable, stop, span, count):
    """Continue from ``scratch.stages[LANDED]`` by a short step of ``count`` stages; those of DOP853 stay."""
    scratch = run.scratch
    copy(scratch.stages[LANDED], scratch.stages[WITHIN], scratch.stages.shape[1])
    run.state.count[CALLS] += landing_step(
        *(run, scratch.control[BALANCED] > 0, np.int64(count), variable, stop, span),
        *(scratch.stages[WITHIN], scratch.side),
    )


@merged
def _length_to(run, variable, stop, span, landed, time):
    """Length of the step that ends at ``time``, which is before ``landed``; inf if Newton's method fails.

    ``span`` is the length of the step that ends at ``landed``. The end state is left in ``scratch.stages[LANDED]``.
    """
    w, x, size, tries = run.scratch.stages[START], run.scratch.stages[LANDED], run.state.x.size, 0
    t = w[size]
    remaining = (landed - time) / (landed - t) if landed > t else 0.0
    kappa = run.tables.time_exponent[1 + stop]
    length = span * (1.0 - (remaining ** (1.0 / kappa) if variable == ROOT else remaining))
    if variable == SINCE:
        length = span * (1.0 - remaining) ** (1.0 / kappa)
    while True:
        take_step(run, variable, stop, length)
        delay, tries = x[size] - time, tries + 1
        pace = 1.0 if variable >= TIME else indentation_rate(run.problem, stop, x)  # d(variable)/dt
        if variable in (ROOT, SINCE):
            pace /= kappa * raised(x[size + 1], kappa - 1.0)
        if not abs(delay) > 1e-15 * landed or not abs(pace) < np.inf or tries == _MOST_TRIALS:
            return length if abs(delay) <= 1e-6 * (landed - t) + 1e-15 * landed else np.inf
        length -= delay * pace


@merged
def _begin_peaks(run):
    """Raise the peak forces by the forces at the start of a landing, which are rates of its first stage."""
    problem, state = run.problem, run.state
    work, size = run.scratch.stages, state.x.size
    for s in range(state.segment.size if work[0, size] != 0.0 else 0):
        if state.segment[s] > 0:
            column = work_column(problem, s) + 1
            state.active[s, PEAK_FORCE] = max(state.active[s, PEAK_FORCE], work[0, column] / work[0, size])
            if rubs(problem, s):
                slider, column = slider_of(problem, s), problem.friction[s, 1] + 1
                slider[PEAK] = max(slider[PEAK], abs(work[0, column] / work[0, size]))


@inner
def _friction_after(run, variable, stop, length, s):
    """|F_t|, N, of stop s after a step of some length from the start of the landing."""
    state = run.state
    x = run.scratch.stages[LANDED]
    take_step(run, variable, stop, length)
    return abs(slider_force(run.problem, s, state.segment[s], state.entry_rate[s], x[state.x.size], x))


@inner
def _locate_friction_peak(run, variable, stop, span, s):
    """Raise the largest |F_t| of stop s by its maximum inside a landing, found by successive parabolas."""
    a, b, c, slider = 0.0, 0.5, 1.0, slider_of(run.problem, s)  # shares of the span, which may be negative
    low = _friction_after(run, variable, stop, a, s)
    best = _friction_after(run, variable, stop, b * span, s)
    high = _friction_after(run, variable, stop, c * span, s)
    for _ in range(_MOST_VERTICES):
        rise, fall = (b - a) * (best - high), (c - b) * (best - low)
        if not rise + fall > 0.0:
            break
        vertex = b - 0.5 * ((b - a) * rise - (c - b) * fall) / (rise + fall)
        if not a < vertex < c or abs(vertex - b) <= 1e-6:
            break
        value = _friction_after(run, variable, stop, vertex * span, s)
        if value >= best:
            a, low, c, high = (a, low, b, best) if vertex < b else (b, best, c, high)
            b, best = vertex, value
        elif vertex < b:
            a, low = vertex, value
        else:
            c, high = vertex, value
    slider[PEAK] = max(slider[PEAK], best)


@inlined
def _friction_peaks_inside(run, width, s):
    """Whether |F_t| of stop s has a maximum inside the landing just taken that is above its peak so far."""
    work, column = run.scratch.stages, run.problem.friction[s, 1] + 1
    sign = math.copysign(1.0, work[0, column] + work[STAGES - 2, column])
    return force_turns(work, column, width, slider_of(run.problem, s)[PEAK], sign)


@inner
def accept_landing(run, variable, stop, level, span):
    """Move the state to the landing in ``scratch.stages[LANDED]``, or to the end of the run if that is earlier.

    Samples that are due in between are written. ``level`` is the indentation at which the landing ends, inf for a bend
    or border. Returns False, without moving the state, if the step to an output time is not found.
    """
    problem, state, scratch = run.problem, run.state, run.scratch
    w, x, size = scratch.stages[START], scratch.stages[LANDED], state.x.size
    landed, t, t_end = x[size], state.now[T], state.now[T_END]
    _begin_peaks(run)
    if is_planar(problem):
        for s in range(problem.friction.shape[0]):
            turns = rubs(problem, s) and state.segment[s] > 0 and _friction_peaks_inside(run, size, s)
            scratch.turns[s] = 1 if turns else 0
    copy(x, state.x, size)
    while True:
        due = state.due[state.count[SAMPLED]]
        time = min(due, t_end)
        if time > landed:
            break
        length = _length_to(run, variable, stop, span, landed, time)
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
            if scratch.turns[s] > 0:
                _locate_friction_peak(run, variable, stop, span, s)
    if state.event_record.shape[0]:
        write_event(state, LANDING, t, landed, span, variable, stop, w)
    state.now[T] = landed
    if is_circle(problem, stop) and level < np.inf and landed < t_end:
        land_on_circle(run, stop, level)
    if variable != ROOT or landed == t_end:  # beyond a knot the force may be smaller
        state_peaks(run, state.x)
    return True


@inlined
def longest_time(run):
    """Longest landing, s: `landing_reach` over the fastest rate, and at most a cell of the sampled signals.

    For the derivative of a run it is also `landing_reach` over the frequency to which contacts stiffen the structure.
    """
    scratch = run.scratch
    longest = scratch.accuracy[REACH] / run.tables.fastest
    if run.state.event_record.shape[0]:
        longest = min(longest, scratch.accuracy[REACH] / max(scratch.stiffened[0], 1e-300))
    return min(longest, run.problem.table_dt[0]) if run.problem.table_dt.size else longest


@merged
def _derivative_factor(run, stop, w, x):
    """Error of the derivative of a landing over that of its motion, at most `_MOST_FACTOR`.

    A force like δ^{3/2} that errs by e has a slope that errs by e/δ. Derivatives are measured in units of the largest
    motion of a stop's place, so the factor is large just after another stop than ``stop`` has been entered.
    """
    problem = run.problem
    factor = 0.0
    for s in range(problem.law.size):
        if s != stop and run.state.segment[s] > 0 and run.tables.time_exponent[1 + s] > 1.0:
            deepest = max(indentation(problem, s, w), indentation(problem, s, x))
            factor = max(
                factor, abs_dot(problem.read[row_of(problem, s)], w, 2 * problem.k.size) / max(deepest, 1e-300)
            )
    return min(factor, _MOST_FACTOR)


@inlined
def _knot(run, stop, direction):
    """Indentation, m, at the upper (direction 1) or lower (-1) knot of the stop's segment."""
    return run.problem.knots[stop, run.state.segment[stop] - (1 if direction < 0 else 0)]


@inlined
def may_land(run, stop, direction, time_to_knot):
    """Whether a landing on the knot of ``stop`` in a direction, about ``time_to_knot`` s ahead, is worth a trial.

    It reads δ and δ̇ at the start of the step from ``scratch.start_motion``. What moves the other way turns first.
    One just entered, which the landing of another sees leave, lies on the knot: it would leave at once, for ever.
    """
    state, scratch = run.state, run.scratch
    delta, rate = scratch.start_motion[stop, 0], scratch.start_motion[stop, 1]
    if time_to_knot > longest_time(run) or direction * rate <= rate_tolerance(run.problem, stop, state.x):
        return False
    if scratch.last_resort[0] > 0:
        return True
    if direction < 0 and state.segment[stop] == 1:
        limit = _LAST_STEP
        if run.tables.time_exponent[1 + stop] == 2.0:
            limit = min(_LAST_STEP_ROOT * scratch.accuracy[REACH] ** 2, _MOST_ROOT)
        return delta <= limit * state.active[stop, PEAK_DELTA]
    level = _knot(run, stop, direction)
    return state.segment[stop] == 0 or abs(level - delta) <= 0.2 * max(level, delta)


@inlined
def _in_fourth_root(tables, variable, stop):
    """Whether the variable of a landing is u = δ^{1/4}."""
    return variable == ROOT and tables.time_exponent[1 + stop] == 4.0


@merged
def _error_share(run, variable, stop):
    """Share of the embedded difference of the landing just taken that counts as its error."""
    scratch = run.scratch
    share = _ERROR_SHARE_FOURTH_ROOT if _in_fourth_root(run.tables, variable, stop) else _ERROR_SHARE
    if scratch.viscous[stop] > 0.0:  # set where the dashpot is too strong for an explicit step
        share = 1.0
    if run.state.event_record.shape[0]:
        w, x = scratch.stages[START], scratch.stages[LANDED]
        share = max(share, _DERIVATIVE_SHARE * _derivative_factor(run, stop, w, x))
    return share


@merged
def _is_resolved(run, variable, stop):
    """Whether the landing just taken in δ or δ^{1/κ} is within the tolerance, and the stop has not nearly turned back.

    A stop that turns soon after it has left is near a pole of 1/δ̇. The embedded difference changes its sign there: it
    may be zero where the step errs by 1e-3 of the rate. As the last resort a landing of any error is taken: a step
    across the border errs by more. It is `TURNED` where it has turned the motion: shorter steps resolve that.
    """
    scratch = run.scratch
    before, after = scratch.start_motion[stop, 1], indentation_rate(run.problem, stop, scratch.stages[LANDED])
    share = _error_share(run, variable, stop)
    least = _LEAST_RATE_FOURTH_ROOT if _in_fourth_root(run.tables, variable, stop) else _LEAST_RATE
    if not (_time_increases(scratch, run.state.x.size) and before * after >= least * before * before):
        return False
    error = _rate_error(run, share)
    if scratch.last_resort[0] == 0 or not error <= _ANY_ERROR:
        return error <= 1.0
    fast = _TURN * max(abs(after), scratch.reference_speed[stop])
    scratch.last_resort[0] = TURNED if error > 1.0 and abs(after - before) > fast else 1
    return True


@inlined
def _least_distance(run, stop, x):
    """δ, m, below which a border of friction cannot be told from the opening."""
    problem, state = run.problem, run.state
    return min(WITHIN_ROUNDING * surface_tolerance(problem, stop, x), _NEAR_SURFACE * state.active[stop, PEAK_DELTA])


@merged
def _falls_on_surface(run, stop, border):
    """Whether a border passed before the opening just landed on is too near to it to be told from it by δ."""
    scratch = run.scratch
    x = scratch.stages[LANDED]
    time = _least_distance(run, stop, x) / abs(indentation_rate(run.problem, stop, x))
    margins_later(run, stop, x[run.state.x.size], x, -time, scratch.margin_before)
    return scratch.margin_before[border] >= -scratch.noise[stop, border]


@merged
def land(run, stop, direction, time_to_knot):
    """Try to land on the knot of ``stop`` in a direction, 1 up or -1 down, about ``time_to_knot`` s ahead."""
    state, scratch = run.state, run.scratch
    size, t, rate = state.x.size, state.now[T], scratch.start_motion[stop, 1]
    if not may_land(run, stop, direction, time_to_knot):
        return Landing(-1, -1, -1, False)
    longest, kappa = longest_time(run), run.tables.time_exponent[1 + stop]
    leaving = direction < 0 and state.segment[stop] == 1
    start_landing(run, stop, np.int64(ROOT))
    w, x = scratch.stages[START], scratch.stages[LANDED]
    variable = ROOT if leaving and kappa > 1.0 else INDENTATION
    span = -w[size + 1] if variable == ROOT else _knot(run, stop, direction) - scratch.start_motion[stop, 0]
    take_step(run, variable, stop, span)
    landed = x[size]
    time_rounding = surface_tolerance(run.problem, stop, state.x) / abs(rate)  # the distance may be rounding
    in_time = t <= landed <= t + min(4.0 * time_to_knot, longest) + time_rounding
    if not (in_time and _is_resolved(run, variable, stop)):
        return Landing(-1, -1, -1, False)
    other = before_landing(run, stop, np.bool_(0), w, x)
    if other != CLEAR:
        return Landing(max(other, -1), -1, -1, False)
    if run.problem.parts[PASSED]:
        element, border = passed(run, -1, -1, w, x)
        opened = element == stop and variable == ROOT
        if element != -1 and not (opened and _falls_on_surface(run, stop, border)):
            return Landing(-1, element, border, opened)
    level = _knot(run, stop, direction)
    accepted = accept_landing(run, variable, stop, level, span)
    return Landing(stop if accepted else -1, -1, -1, False)


@inlined
def _event_function(run, stop, border, x, sign, margins):
    """(value, sign) of the event function whose zero a landing locates, in the state x; all ``margins`` are written.

    It is the margin of a border, or with ``border`` -1 the event function of a bend, positive on the present side. A
    slider that sticks, given a sign σ that is not 0, has μN - σF_t, which is smooth where F_t changes sign, unlike its
    margin μN - |F_t|. A negative margin sets σ to the sign of F_t.
    """
    problem, scratch = run.problem, run.scratch
    if border < 0:
        return scratch.side[stop] * side_at(run, stop, x, scratch.trial), sign
    margins_of(run, stop, x[run.state.x.size], x, margins)
    value = margins[border]
    if is_planar(problem) and sign != 0.0:
        slider = slider_of(problem, stop)
        force = slider[STIFFNESS] * spring_stretch(radius_of(problem, stop), slider, scratch.point[1, XI])
        if value < 0.0:
            sign = math.copysign(1.0, force)
        value += abs(force) - sign * force
    return value, sign


@merged
def _was_below(run, s, border, value, time):
    """Whether a margin was below its present ``value`` a ``time`` before the landing: then it has risen to zero."""
    scratch = run.scratch
    x = scratch.stages[LANDED]
    margins_later(run, s, x[run.state.x.size], x, -time, scratch.margin_before)
    return scratch.margin_before[border] < value


@inlined
def _others_near_zero(run, s, border):
    """Whether another margin of an element is near zero where a landing ends; else none shortly before it counts."""
    scratch = run.scratch
    near = False
    for j in range(run.problem.border_count[s]):
        near |= j != border and scratch.margin_end[s, j] <= _NEAR_ZERO * scratch.largest[s, j]
        scratch.margin_before[j] = scratch.margin_begin[s, j]
    return near


@inlined
def _may_end_at_opening(run, stop):
    """Whether a landing may end where a stop with friction opens; the motion is smooth only in u = δ^{1/κ} there."""
    problem, tables, state = run.problem, run.tables, run.state
    delta, rate = run.scratch.start_motion[stop, 0], run.scratch.start_motion[stop, 1]
    if not (rubs(problem, stop) and state.segment[stop] == 1 and tables.time_exponent[1 + stop] > 1.0 and rate < 0.0):
        return False
    return may_land(run, stop, np.int64(-1), delta / -rate)


@inlined
def _margin_before_opening(run, stop, sign, begin, end, force):
    """Coefficients of 1, r, r^κ, r^{κ+1} and r^{2κ} of a margin before the opening, r = 1 at the start and 0 there.

    N is proportional to r^{κ+1}, the time to r^κ. A slider that sticks has μN - σF_t with F_t of second order in time,
    by its values at start and opening and its rate at the start; one that slips has σξ̇ - μṄ/k_t with ξ̇ linear in time.
    ``scratch.point`` is that of the start.
    """
    scratch = run.scratch
    slider, rate = slider_of(run.problem, stop), scratch.point[1, XI_RATE]
    if slider[CODE] == STICK:
        change = sign * force + end
        slope = sign * slider[STIFFNESS] * rate * scratch.start_motion[stop, 0] / scratch.start_motion[stop, 1]
        return end, 0.0, slope - 2.0 * change, begin + abs(force), change - slope
    xi_rate = slider[CODE] * rate
    return end, begin - xi_rate, xi_rate - end, 0.0, 0.0


@inlined
def _root_before_opening(coefficients, kappa):
    """(r, slope by r) of the root of such a margin by bisection; r is 1 if there is none."""
    constant, linear, timely, normal, second = coefficients
    low, high, r, power, rest = 0.0, 1.0, 0.5, 0.25, 0.0
    for _ in range(_HALVINGS):
        power = r * r if kappa == 2.0 else (r * r) * (r * r)
        rest = linear * r + power * (timely + normal * r + second * power)
        if constant + rest > 0.0:
            high = r
        else:
            low = r
        r = 0.5 * (low + high)
    slope = linear + power / r * (kappa * timely + (kappa + 1.0) * normal * r + 2.0 * kappa * second * power)
    return (r, slope) if high < 1.0 else (1.0, slope)


@merged
def _guess_before_opening(run, stop, border, guess, opened):
    """(length in u, sign, slope by the length) of the first trial of a landing on a border before its stop opens.

    They follow from a model of the margin by the motion at the start and at the opening; the sign is that of the slip
    that begins, if the slider sticks. A margin of the model without a root has its length from the ``guess`` of the
    time with δ̇ constant, and sign and slope 0. Largest margin and rounding up to the opening go to ``scratch``.
    ``opened`` tells that the step to the opening has been made.
    """
    problem, state, scratch = run.problem, run.state, run.scratch
    u, delta, slider = scratch.stages[START, state.x.size + 1], scratch.start_motion[stop, 0], slider_of(problem, stop)
    w, kappa, sticks = scratch.stages[START], run.tables.time_exponent[1 + stop], 1.0 if slider[CODE] == STICK else 0.0
    margins, x, radius = scratch.margin_end[stop], scratch.stages[LANDED], radius_of(problem, stop)
    if not opened:
        take_step(run, np.int64(ROOT), stop, -u)
    end, sign = _event_function(run, stop, border, x, sticks, margins)
    largest = abs(margins[border])
    begin, _ = _event_function(run, stop, border, w, 0.0, margins)
    force = slider[STIFFNESS] * spring_stretch(radius, slider, scratch.point[1, XI]) if sticks > 0.0 else 0.0
    largest = max(abs(begin), largest)
    rounding = margin_rounding(run, stop, border, state.now[T], state.x)
    scratch.largest[stop, border], scratch.noise[stop, border] = largest, max(ROUNDING * largest, 2.0 * rounding)
    if end < 0.0 and border == SLIDES and slider[CODE] != FREE:
        coefficients = _margin_before_opening(run, stop, sign, begin, end, force)
        r, slope = _root_before_opening(coefficients, kappa)
        if r < 1.0 - _LEAST_SHARE:
            return u * (1.0 - r), sign, -slope / u
    remaining = max(1.0 + guess * scratch.start_motion[stop, 1] / delta, 0.0) if delta > 0.0 else 0.0
    return u * (1.0 - remaining ** (1.0 / kappa)), 0.0, 0.0


@inlined
def promising_time(scratch, variable, s):
    """Length, s, of a landing in time above which it would hardly be within the tolerance, by the contact of stop s."""
    if scratch.duration[s] == 0.0:
        return np.inf
    share = _SHARE_SINCE_ENTRY if variable == SINCE else _SHARE_OF_CONTACT
    return share * scratch.accuracy[REACH] * scratch.duration[s]


@inlined
def _error_of_stick(run, stop):
    """Factor of the tolerated errors of δ̇ where a slip ends under a strong dashpot, at least 1.

    The margin σξ̇ - μṄ/k_t has N_δ̇ δ̈, and δ̈ errs by the error of δ̇ times N_δ̇ and the accelerance.
    """
    problem = run.problem
    slope = run.scratch.viscous[stop]
    if slope == 0.0 or not rubs(problem, stop) or abs(slider_of(problem, stop)[CODE]) != 1.0:
        return 1.0
    slider = slider_of(problem, stop)
    margin = slider[MU] / slider[STIFFNESS] * slope * slope * own_accelerance(run, stop)
    return max(_LEAST_MARGIN * margin, 1.0)


@merged
def _within_tolerance(run, variable, stop, time):
    """Whether the error of the landing just taken, of length ``time`` s, is within the tolerance."""
    if variable == ROOT:
        return _is_resolved(run, variable, stop)
    return error_in_time(run, time) * _error_of_stick(run, stop) <= 1.0


@inlined
def _bisect(low, high):
    """Geometric mean of a bracket, whose lower end may be smaller by powers of ten; 1e-3 ``high`` if that end is 0."""
    return math.sqrt(low * high) if low > 0.0 else 1e-3 * high


@inlined
def _rounded(run, stop, size):
    """Change of u, of `ROOT` or `SINCE`, by the rounding of δ where the landing has ended."""
    x, kappa = run.scratch.stages[LANDED], run.tables.time_exponent[1 + stop]
    time = surface_tolerance(run.problem, stop, x) / max(abs(indentation_rate(run.problem, stop, x)), 1e-300)
    return time / max(kappa * raised(abs(x[size + 1]), kappa - 1.0), 1e-300)


@inlined
def _try_length(run, search, stop, length, before):
    """Take the step of some ``length``; if the last trial, of length ``before``, is near, by a short step from there.

    Returns whether it was near.
    """
    change, variable = length - before, search.variable
    if abs(change) > _CLASSICAL_UP_TO * length:
        take_step(run, variable, stop, search.forward * length)
        return False
    count = 2 if abs(change) <= _MIDPOINT_UP_TO * length else 4
    _short_step(run, variable, stop, search.forward * change, count)
    return True


@inlined
def _rounding_there(run, search, stop, slope):
    """Rounding of an event function where a step has ended, with its slope by the length of the step."""
    rounding = _STAGNATION * search.largest
    if rubs(run.problem, stop) and search.variable != TIME:
        of_delta = slope * _rounded(run, stop, run.state.x.size)
        rounding = max(rounding, 10.0 * search.tolerance, min(abs(of_delta), _MOST_ROUNDING * search.largest))
    return rounding


@merged
def _locate(run, stop, border, search):
    """Locate a zero of the event function by the secant rule, safeguarded by a bracket; returns a `Zero`.

    Trials that differ little are short steps from the last one. ``promised`` tells that the slope is that of the
    polynomial of a step, which the first trial tests; ``slope_there`` is the slope of the `Zero`.
    """
    problem, scratch = run.problem, run.scratch
    largest, slope, sign, length = search.largest, search.slope, search.sign, search.first
    x, begin, end = scratch.stages[LANDED], scratch.margin_begin[stop], scratch.margin_end[stop]
    last_length, last_value, begins_on_border = 0.0, np.inf, False
    # With a known slope and no other margin of friction to compare, the value at the start is not needed.
    if slope == 0.0 or search.forward < 0.0 or problem.border_count[stop] > 1 or not rubs(problem, stop):
        w = scratch.stages[START]
        last_value, sign = _event_function(run, stop, border, w, sign, begin)
        begins_on_border = (last_value if border >= 0 else abs(last_value)) <= _BEGINS_ON_BORDER * largest
    shortest = 0.0 if border >= 0 and not begins_on_border else 0.1 * length
    if begins_on_border and slope == 0.0:  # the secant needs another point
        last_length = 0.9 * length
        take_step(run, search.variable, stop, search.forward * last_length)
        last_value, sign = _event_function(run, stop, border, x, sign, end)
    low, high = last_length if last_value > 0.0 else 0.0, search.longest
    promised, slope_there, rounding = slope != 0.0, slope, 0.0
    for _ in range(_MOST_BORDER_TRIALS):
        is_near = _try_length(run, search, stop, length, last_length)
        value, sign = _event_function(run, stop, border, x, sign, end)
        if promised and search.forward > 0.0 and abs(value) > _PROMISED * largest:
            if rubs(problem, stop):
                break  # what the polynomial of a step promised is not there
            promised = False  # the step was too long for its polynomial
        if not promised:
            slope = (value - last_value) / (length - last_length)
            slope_there = slope if is_near else 0.0
        promised, rounding = False, _rounding_there(run, search, stop, slope)
        following = length - value / slope
        stagnates = abs(following - length) <= 1e-15 * length and border >= 0
        if stagnates or abs(value) <= search.tolerance or 0.5 * abs(last_value) <= abs(value) <= rounding:
            return Zero(length, value, rounding, slope_there)
        low, high = (length, high) if value > 0.0 else (low, length)
        if (high < search.longest or search.forward < 0.0) and not low < following < high:
            following = _bisect(low, high)
            if rubs(problem, stop):  # the landing may begin on the same border
                following = max(following, 2.0 * shortest)
        if not shortest < following <= search.longest or following == length:
            break
        last_length, last_value, length = length, value, following
    else:
        return Zero(last_length, last_value, rounding, slope_there)
    return Zero(length, np.nan, rounding, 0.0)


@merged
def _is_within_segment(run, stop, x):
    """Whether δ of a stop lies inside its segment in the state x; with friction also clearly above the surface."""
    problem = run.problem
    lower, upper = problem.knots[stop, run.state.segment[stop] - 1], problem.knots[stop, run.state.segment[stop]]
    if rubs(problem, stop) and indentation_rate(problem, stop, x) < 0.0:
        lower += _least_distance(run, stop, x)
    return lower < indentation(problem, stop, x) < upper


@merged
def _search_for(run, stop, border, guess, slope, opened):
    """How to look for border ``border`` of ``stop``, -1 for its bend, about ``guess`` s ahead; the `Search` begins.

    ``slope`` is that of its margin by time, or 0; for ``opened`` see `Landing`.
    """
    scratch = run.scratch
    limit, largest = longest_time(run), scratch.bend_values[scratch.bend_values.size - 1]
    tolerance, variable, exponent = 1e-10 * largest, np.int64(TIME), 1.0  # a literal would be compiled for itself
    if border >= 0:  # if it were missed by more, the next step might cross it in the wrong direction
        largest, tolerance = scratch.largest[stop, border], 0.1 * scratch.noise[stop, border]
        if scratch.control[NEW] and scratch.control[NODE_SET] == stop + 1:
            variable, exponent = np.int64(SINCE), 1.0 / run.tables.time_exponent[stop + 1]
    promising = promising_time(scratch, variable, stop) if rubs(run.problem, stop) else np.inf
    if not 0.0 < guess <= min(limit, promising):
        return Search(variable, 1.0, 0.0, 0.0, largest, tolerance, 0.0, 0.0)
    start_landing(run, stop, variable)
    if border >= 0 and variable == TIME and _may_end_at_opening(run, stop):
        u = scratch.stages[START, run.state.x.size + 1]
        first, sign, slope = _guess_before_opening(run, stop, border, guess, opened)
        largest, tolerance = scratch.largest[stop, border], 0.1 * scratch.noise[stop, border]
        return Search(np.int64(ROOT), -1.0, first, u, largest, tolerance, sign, slope)
    first = guess**exponent
    slope = slope * guess / (exponent * first) if border >= 0 else 0.0
    return Search(variable, 1.0, first, limit**exponent, largest, tolerance, 0.0, slope)


@inlined
def _has_risen(run, stop, border, zero, time):
    """Whether a margin has risen to its zero in a landing of length ``time`` s: then it was below zero before."""
    if zero.slope == 0.0 or _others_near_zero(run, stop, border):
        return border >= 0 and _was_below(run, stop, border, zero.value, 1e-3 * time)
    return zero.slope > 0.0


@merged
def land_on_bend_or_border(run, stop, border, guess, slope, opened):
    """Try to land on border ``border`` of ``stop``, on its bend if that is -1, about ``guess`` s ahead.

    ``slope`` is that of its margin there by time, 0 if it is not known; for ``opened`` see `Landing`.
    """
    none = Landing(-1, -1, -1, False)
    search = _search_for(run, stop, border, guess, slope, opened)
    if search.longest == 0.0:
        return none
    zero, variable = _locate(run, stop, border, search), search.variable
    w, x, size = run.scratch.stages[START], run.scratch.stages[LANDED], run.state.x.size
    time = zero.length if variable == TIME else x[size] - w[size]
    found = abs(zero.value) <= max(_FOUND * search.largest, zero.rounding)
    if not (found and _within_tolerance(run, variable, stop, time)):
        return none
    if _has_risen(run, stop, border, zero, time):
        return none
    if before_landing(run, stop, np.bool_(1), w, x) != CLEAR:
        return none
    element, other = passed(run, stop, border, w, x)
    if element != -1:
        return Landing(-1, element, other, False)
    if not _is_within_segment(run, stop, x):
        return none
    forward = search.forward * zero.length
    accepted = accept_landing(run, variable, stop, np.inf, forward)
    return Landing(stop if accepted else -1, -1, -1, False)
