"""Largest indentation and force of a contact, from the node values of its steps."""

from __future__ import annotations

from solvers.families import S
from solvers.kernels import contact_forces, dot, indentation, inlined, inner, maxima
from solvers.state import PEAK_DELTA, PEAK_FORCE
from solvers.vector import combine

_MOST = 6  # steps to a summit


@maxima
def top(values):
    """The largest of node values, or 0."""
    best = 0.0
    for i in range(S):
        best = max(best, values[i])
    return best


@inlined
def _local(coefficients, x):
    """Value, slope and half the curvature of a polynomial at x."""
    value, slope, curvature = coefficients[S - 1], 0.0, 0.0
    for k in range(S - 2, -1, -1):
        curvature = curvature * x + slope
        slope = slope * x + value
        value = value * x + coefficients[k]
    return value, slope, curvature


@inner
def _summit(tables, values, ends, coefficients):
    """Maximum of the polynomial around its highest node; ``ends`` are its values at -1 and 1.

    From the summit of the parabola through that node and its neighbours Newton's method for the slope goes on; the
    local parabola's summit is off by the third power of its last step.
    """
    place = 0
    for i in range(S):
        if values[i] > values[place]:
            place = i
    combine(tables.monomials, values, S, None, coefficients)
    nodes, b = tables.nodes[0], 2.0 * tables.nodes[0, place] - 1.0
    low, left = (2.0 * nodes[place - 1] - 1.0, values[place - 1]) if place > 0 else (-1.0, ends[0])
    high, right = (2.0 * nodes[place + 1] - 1.0, values[place + 1]) if place < S - 1 else (1.0, ends[1])
    rise, fall = (b - low) * (values[place] - right), (high - b) * (values[place] - left)
    x = b if rise + fall == 0.0 else b - 0.5 * ((b - low) * rise - (high - b) * fall) / (rise + fall)
    x = min(max(x, low), high)
    best = values[place]
    for _ in range(_MOST):
        value, slope, curvature = _local(coefficients, x)
        best = max(best, value)
        if not curvature < 0.0:
            break
        step = -0.5 * slope / curvature
        if abs(step) < 1e-5:
            return max(best, value + 0.5 * slope * step)
        x = min(max(x + step, low), high)
    return best


@inner
def peak(tables, family, values, summary, known, coefficients):
    """Largest value of the polynomial through the node values, if it exceeds the known peak."""
    highest = top(values)
    best = max(known, highest, summary[4], summary[5])
    if family > 0 or highest < 0.95 * known or (highest == values[0] and summary[6] <= 0.0):
        return best
    if highest == values[S - 1] and summary[7] >= 0.0:
        return best
    return max(best, _summit(tables, values, summary[4:6], coefficients))


@inner
def peaks_so_far(problem, tables, state, space, family, share, x):
    """Peaks of the contacts when the run ends at ``x``, within a step of which the ``share`` lies behind."""
    for s in range(problem.gap.size):
        if state.piece[s] == 0:
            continue
        space.clipped[0] = indentation(problem, s, x)
        space.clipped[1] = dot(problem.read_rate[s], x, 2 * problem.k.size)
        delta = space.clipped[0]
        contact_forces(*(problem, s, space.clipped[0:1], space.clipped[1:2], state.entry_rate[s], space.trial[0:1]))
        force = space.trial[0]
        for i in range(S):
            if tables.times[family, i] <= share:
                delta, force = max(delta, space.motion[s, 0, i]), max(force, space.force[s, i])
        state.open[s, PEAK_DELTA] = max(state.open[s, PEAK_DELTA], delta)
        state.open[s, PEAK_FORCE] = max(state.open[s, PEAK_FORCE], force)
