"""Derivative of what a law with memory latches on a border; see `linearised`.

The border b(δ, δ̇, L) = 0 is met dt* = -db/ḃ later, db at fixed time, ḃ = b_δ δ̇ + b_δ̇ δ̈; the map L' = m(L, δ, δ̇)
then gives dL' = m_L dL + m_δ (dδ + δ̇ dt*) + m_δ̇ (dδ̇ + δ̈ dt*). Derivatives of b are
differences, those of m the law's own.
"""

from __future__ import annotations

from solvers.compiled.kernels import (
    call_force,
    call_renewal,
    call_renewal_gradient,
    copy,
    dot,
    indentation,
    inner,
    merged,
    rhs,
)
from solvers.compiled.state import T
from solvers.exponential.linearised_step import change_of, is_parameter

_SHARE, _LEAST = 1e-7, 1e-10  # of differences: part of a number, and at least this in its unit; margins may bend


@inner
def _margin(problem, shadow, s, j, delta, rate, row, slopes):
    """Margin of border j for a row of parameters."""
    batch = slopes.batch
    batch[3], batch[4] = delta, rate
    values = slopes.renewed[slopes.renewed.size - problem.border_count[s] :]
    call_force(problem.borders[s], 1, batch[3:4], batch[4:5], shadow.entry_rate[s], row, (values,))
    return values[j]


@inner
def _force(problem, shadow, s, delta, rate, slopes):
    """Force of the law with memory."""
    batch = slopes.batch
    batch[3], batch[4] = delta, rate
    call_force(
        problem.law[s], 1, batch[3:4], batch[4:5], shadow.entry_rate[s], problem.parameters[s], (batch[5:6],)
    )  # fmt: skip
    return batch[5]


@merged
def _slopes_of_margin(problem, shadow, s, j, delta, rate, slopes, out):
    """∂b/∂δ, ∂b/∂δ̇ and ∂b/∂L by central differences."""
    width, most = problem.parameters.shape[1], problem.latched.shape[1]
    row = slopes.renewed[most * (2 + most) : most * (2 + most) + width]
    copy(problem.parameters[s], row, width)
    step = max(_SHARE * abs(delta), _LEAST)
    ahead = _margin(problem, shadow, s, j, delta + step, rate, row, slopes)
    out[0] = (ahead - _margin(problem, shadow, s, j, delta - step, rate, row, slopes)) / (2.0 * step)
    step = max(_SHARE * abs(rate), _LEAST)
    ahead = _margin(problem, shadow, s, j, delta, rate + step, row, slopes)
    out[1] = (ahead - _margin(problem, shadow, s, j, delta, rate - step, row, slopes)) / (2.0 * step)
    for i in range(most):
        place, out[2 + i] = problem.latched[s, i], 0.0
        if place < 0:
            continue
        known, step = row[place], max(_SHARE * abs(row[place]), _LEAST)
        row[place] = known + step
        ahead = _margin(problem, shadow, s, j, delta, rate, row, slopes)
        row[place] = known - step
        out[2 + i] = (ahead - _margin(problem, shadow, s, j, delta, rate, row, slopes)) / (2.0 * step)
        row[place] = known


@merged
def _explicit(problem, ahead, behind, shadow, s, j, delta, rate, slopes, nudge, out):
    """Change of the margin, and of what is latched, per unit of a parameter of the laws; these latch it too."""
    most, width = problem.latched.shape[1], 2.0 * nudge.law_step
    change = _margin(ahead, shadow, s, j, delta, rate, ahead.parameters[s], slopes)
    change = (change - _margin(behind, shadow, s, j, delta, rate, behind.parameters[s], slopes)) / width
    call_renewal(ahead.renewal[s], j, delta, rate, shadow.entry_rate[s], ahead.parameters[s])
    call_renewal(behind.renewal[s], j, delta, rate, shadow.entry_rate[s], behind.parameters[s])
    for i in range(most):
        place, out[i] = problem.latched[s, i], 0.0
        if place >= 0:
            out[i] = (ahead.parameters[s, place] - behind.parameters[s, place]) / width
            ahead.parameters[s, place] = behind.parameters[s, place] = problem.parameters[s, place]
    return change


@merged
def pass_border(problem, ahead, behind, shadow, slopes, nudge, s, j):
    """A law with memory passes its border j: derivatives of what it latches, and of the motion if its force jumps."""
    size, t, most, width = 2 * problem.k.size, shadow.now[T], problem.latched.shape[1], problem.parameters.shape[1]
    delta, rate = indentation(problem, s, shadow.x), dot(problem.read_rate[s], shadow.x, size)
    rhs(problem, t, shadow.x, shadow.segment, shadow.entry_rate, slopes.rate[0], slopes.batch)
    acceleration = dot(problem.read_rate[s], slopes.rate[0], size)
    first = most * (2 + most) + width
    by, explicit = slopes.renewed[first : first + 2 + most], slopes.renewed[first + 2 + most : first + 2 + 2 * most]
    latched, maps = slopes.renewed[first + 2 + 2 * most : first + 2 + 3 * most], slopes.renewed
    _slopes_of_margin(problem, shadow, s, j, delta, rate, slopes, by)
    pace, own = by[0] * rate + by[1] * acceleration, 0
    for i in range(most):
        own += 1 if problem.latched[s, i] >= 0 else 0
    entry, row = shadow.entry_rate[s], problem.parameters[s]
    call_renewal_gradient(problem.by_renewal[s], j, delta, rate, entry, row, maps)
    jump = _force(problem, shadow, s, delta, rate, slopes)
    call_renewal(problem.renewal[s], j, delta, rate, entry, row)
    jump = _force(problem, shadow, s, delta, rate, slopes) - jump
    moved = 0.0
    if nudge.law_step > 0.0:
        moved = _explicit(problem, ahead, behind, shadow, s, j, delta, rate, slopes, nudge, explicit)
    for c in range(slopes.y.shape[0]):
        d_delta = change_of(problem, nudge, slopes, c, s, 0, t)
        d_rate = change_of(problem, nudge, slopes, c, s, 1, t)
        change, known = by[0] * d_delta + by[1] * d_rate, slopes.latched[c, s * most : (s + 1) * most]
        for i in range(own):
            change += by[2 + i] * known[i]
        by_law = nudge.law_step > 0.0 and is_parameter(nudge, slopes, c)
        change += moved if by_law else 0.0
        shift = -change / pace if pace < 0.0 and t > 0.0 else 0.0  # a start beyond a border passes it at once
        for i in range(own):
            of = maps[i * (2 + own) : (i + 1) * (2 + own)]
            latched[i] = of[0] * (d_delta + rate * shift) + of[1] * (d_rate + acceleration * shift)
            for k in range(own):
                latched[i] += of[2 + k] * known[k]
            latched[i] += explicit[i] if by_law else 0.0
        copy(latched, known, own)
        for e in range(size):
            slopes.y[c, e] -= problem.push[s, e] * jump * shift
