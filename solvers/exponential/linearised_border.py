"""Derivative of the numbers that a law with memory latches on a border; see `linearised`.

The border b(δ, δ̇, L) = 0 is reached dt* = -db/ḃ later, db at fixed time, ḃ = b_δ δ̇ + b_δ̇ δ̈; the map L' = m(L, δ,
δ̇) then gives dL' = m_L dL + m_δ (dδ + δ̇ dt*) + m_δ̇ (dδ̇ + δ̈ dt*). A border that another event has left behind, such
as that of a slip which begins against its force, is crossed with that event: dt* is the same. Derivatives of b are
differences, those of m the law's own.
"""

from __future__ import annotations

from solvers.compiled.kernels import (
    abs_dot,
    acceleration_of,
    add_push,
    call_force,
    call_renewal,
    call_renewal_gradient,
    copy,
    force_at,
    indentation_and_rate,
    inlined,
    inner,
    merged,
    rhs,
    row_of,
    rubs,
)
from solvers.compiled.state import LAST_EVENT, T
from solvers.exponential.circles.derivative import change_of, is_parameter
from solvers.exponential.circles.friction_derivative import pass_slider

_LEFT_BEHIND = 1e-6  # margin, in units of its terms, below which its border is not reached but left behind
_SHARE, _SMALL = 1e-7, 1e-8  # steps of differences, relative to the number, and at least to its terms; margins bend
_UNKNOWN, _TRIALS = 1e-10, 4  # step from which that of a latched number, of unknown size, is found in so many trials
_CORRECTIONS = 3  # by which a nearby law's border is met to rounding
_JUMP = 1e4  # ratio of the slopes of both sides from which one is that of a jump


@inner
def _margin(run, side, s, j, delta, rate, row):
    """Margin of border j for a row of parameters, by the law of one ``side`` of the parameter."""
    batch, renewed = run.derivatives.batch, run.derivatives.renewed
    batch[3], batch[4] = delta, rate
    values = renewed[renewed.size - side.border_count[s] :]
    call_force(side.borders[s], 1, batch[3:4], batch[4:5], run.past.entry_rate[s], row, (values,))
    return values[j]


@inlined
def _slope(behind, here, ahead, step):
    """Slope of a margin by central differences, of one side where it jumps on the other.

    It jumps where a number that is smaller than the step changes its sign, as z of Bouc and Wen just after a reversal.
    """
    before, after = (here - behind) / step, (ahead - here) / step
    if abs(before) > _JUMP * abs(after):
        return after
    return before if abs(after) > _JUMP * abs(before) else 0.5 * (before + after)


@inlined
def _step(number, size):
    """Step of the differences by a number, which may be zero, whose terms have a size."""
    return max(_SHARE * abs(number), _SMALL * size if size > 0.0 else _UNKNOWN)


@merged
def _slopes_of_margin(run, s, j, delta, rate, out):
    """∂b/∂δ, ∂b/∂δ̇ and ∂b/∂L by differences; by L, of an unknown unit, with steps that change b as those before."""
    problem, n2, r = run.problem, 2 * run.problem.k.size, row_of(run.problem, s)
    width, most = problem.parameters.shape[1], problem.latched.shape[1]
    row = run.derivatives.renewed[most * (2 + most) : most * (2 + most) + width]
    copy(problem.parameters[s], row, width)
    here = _margin(run, problem, s, j, delta, rate, row)
    step = _step(delta, abs_dot(problem.read[r], run.past.x, n2))
    ahead = _margin(run, problem, s, j, delta + step, rate, row)
    out[0] = _slope(_margin(run, problem, s, j, delta - step, rate, row), here, ahead, step)
    change = abs(out[0] * step)
    step = _step(rate, abs_dot(problem.read_rate[r], run.past.x, n2))
    ahead = _margin(run, problem, s, j, delta, rate + step, row)
    out[1] = _slope(_margin(run, problem, s, j, delta, rate - step, row), here, ahead, step)
    change = max(change, abs(out[1] * step))
    for i in range(most):
        place, out[2 + i] = problem.latched[s, i], 0.0
        if place < 0:
            continue
        known, step = row[place], _UNKNOWN
        for _ in range(_TRIALS if change > 0.0 else 0):
            row[place] = known + step
            found = abs(_margin(run, problem, s, j, delta, rate, row) - here)
            if not (found > 2.0 * change or 0.0 < found < 0.5 * change):
                break
            step *= change / found
        step = max(_SHARE * abs(known), step)
        row[place] = known + step
        ahead = _margin(run, problem, s, j, delta, rate, row)
        row[place] = known - step
        out[2 + i] = _slope(_margin(run, problem, s, j, delta, rate, row), here, ahead, step)
        row[place] = known


@merged
def _is_left_behind(run, s, j, delta, rate, by):
    """Whether the margin of border j is negative by more than a landing may leave; ``by`` are its derivatives."""
    problem = run.problem
    size = abs(by[0] * delta) + abs(by[1] * rate)
    for i in range(problem.latched.shape[1]):
        if problem.latched[s, i] >= 0:
            size += abs(by[2 + i] * problem.parameters[s, problem.latched[s, i]])
    return _margin(run, problem, s, j, delta, rate, problem.parameters[s]) < -_LEFT_BEHIND * size


@merged
def _latch_there(run, side, s, j, delta, rate, slope, margin):
    """Latch by the law of one side where it meets the border itself, as what is latched may have a corner there.

    Returns δ there, less that of the run; ``slope`` and ``margin`` are those of the run.
    """
    row, further = side.parameters[s], 0.0
    for _ in range(_CORRECTIONS if slope != 0.0 else 0):
        further -= (_margin(run, side, s, j, delta + further, rate, row) - margin) / slope
    call_renewal(side.renewal[s], j, delta + further, rate, run.past.entry_rate[s], row)
    return further


@merged
def _explicit(run, s, j, delta, rate, slope, maps, out):
    """Changes of the margin and of the latched numbers per unit of a parameter of the laws, which latch them, too.

    What nearby laws latch is left in ``run.ahead`` and ``run.behind``, for the caller to put back.
    """
    problem, ahead, behind, width = run.problem, run.ahead, run.behind, 2.0 * run.variation.law_step
    margin = _margin(run, problem, s, j, delta, rate, problem.parameters[s])
    change = _margin(run, ahead, s, j, delta, rate, ahead.parameters[s])
    change = (change - _margin(run, behind, s, j, delta, rate, behind.parameters[s])) / width
    further = _latch_there(run, ahead, s, j, delta, rate, slope, margin)
    further -= _latch_there(run, behind, s, j, delta, rate, slope, margin)
    own = 0
    for i in range(problem.latched.shape[1]):
        own += 1 if problem.latched[s, i] >= 0 else 0
    for i in range(own):
        place = problem.latched[s, i]
        change_there = ahead.parameters[s, place] - behind.parameters[s, place]
        out[i] = (change_there - maps[i * (2 + own)] * further) / width
    return change


@merged
def pass_border(run, s, j):
    """Take all columns across border j of a law with memory: latched numbers, and the motion if the force jumps."""
    problem, past, derivatives = run.problem, run.past, run.derivatives
    if rubs(problem, s):
        pass_slider(run, s, j)
        return
    t, most, width = past.now[T], problem.latched.shape[1], problem.parameters.shape[1]
    stops = problem.law.size
    delta, rate = indentation_and_rate(problem, s, past.x)
    rhs(problem, t, past.x, past.segment, past.entry_rate, derivatives.rate[0], derivatives.batch)
    acceleration = acceleration_of(problem, s, past.x, derivatives.rate[0])
    first = most * (2 + most) + width
    maps, by = derivatives.renewed, derivatives.renewed[first : first + 2 + most]
    explicit, latched = maps[first + 2 + most : first + 2 + 2 * most], maps[first + 2 + 2 * most : first + 2 + 3 * most]
    _slopes_of_margin(run, s, j, delta, rate, by)
    margin_rate, own = by[0] * rate + by[1] * acceleration, 0
    together = past.now[LAST_EVENT] == t and t > 0.0  # what a start is beyond it passes by itself, at once
    at_once = together and _is_left_behind(run, s, j, delta, rate, by)
    past.now[LAST_EVENT] = t
    for i in range(most):
        own += 1 if problem.latched[s, i] >= 0 else 0
    entry, row = past.entry_rate[s], problem.parameters[s]
    call_renewal_gradient(problem.by_renewal[s], j, delta, rate, entry, row, maps)
    by_law_change, laws_change = 0.0, run.variation.law_step > 0.0
    if laws_change:
        by_law_change = _explicit(run, s, j, delta, rate, by[0], maps, explicit)
    jump = force_at(problem, s, delta, rate, entry, derivatives.batch)
    call_renewal(problem.renewal[s], j, delta, rate, entry, row)
    jump = force_at(problem, s, delta, rate, entry, derivatives.batch) - jump
    for i in range(own if laws_change else 0):
        place = problem.latched[s, i]
        run.ahead.parameters[s, place] = run.behind.parameters[s, place] = row[place]
    for c in range(derivatives.y.shape[0]):
        d_delta, d_rate = change_of(run, past.x, c, s, 0, t), change_of(run, past.x, c, s, 1, t)
        change, known = by[0] * d_delta + by[1] * d_rate, derivatives.latched[c, s * most : (s + 1) * most]
        for i in range(own):
            change += by[2 + i] * known[i]
        by_law = laws_change and is_parameter(run, c)
        change += by_law_change if by_law else 0.0
        shift = -change / margin_rate if margin_rate < 0.0 and t > 0.0 else 0.0
        shift = derivatives.shift[c, stops] if at_once else shift
        derivatives.shift[c, stops] = shift
        for i in range(own):
            of = maps[i * (2 + own) : (i + 1) * (2 + own)]
            latched[i] = of[0] * (d_delta + rate * shift) + of[1] * (d_rate + acceleration * shift)
            for k in range(own):
                latched[i] += of[2 + k] * known[k]
            latched[i] += explicit[i] if by_law else 0.0
        copy(latched, known, own)
        add_push(problem, s, -jump * shift, past.x, derivatives.y[c])
