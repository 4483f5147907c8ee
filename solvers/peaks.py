"""Largest indentation and force of a contact, from the node values of its steps."""

from __future__ import annotations

from solvers.kernels import contact_forces, dot, indentation, inlined, inner, maxima
from solvers.state import PEAK_DELTA, PEAK_FORCE
from solvers.tables import S
from solvers.vector import combine


@maxima
def top(values):
    """The largest of node values, or 0."""
    best = 0.0
    for i in range(S):
        best = max(best, values[i])
    return best


@inlined
def _horner(coefficients, x):
    """Value of a polynomial at x."""
    value = coefficients[S - 1]
    for k in range(S - 2, -1, -1):
        value = value * x + coefficients[k]
    return value


@inner
def _summit(tables, values, ends, best, coefficients):
    """Maximum of the polynomial around its highest node, by successive parabolas; ``ends`` are its end values."""
    place = 0
    for i in range(S):
        if values[i] > values[place]:
            place = i
    combine(tables.monomials, values, S, None, coefficients)
    nodes = tables.nodes[0]
    a, fa = (2.0 * nodes[place - 1] - 1.0, values[place - 1]) if place > 0 else (-1.0, ends[0])
    c, fc = (2.0 * nodes[place + 1] - 1.0, values[place + 1]) if place < S - 1 else (1.0, ends[1])
    b, fb = 2.0 * nodes[place] - 1.0, values[place]
    for _ in range(5):
        denominator = (b - a) * (fb - fc) - (b - c) * (fb - fa)
        if denominator == 0.0:
            break
        x = b - 0.5 * ((b - a) ** 2 * (fb - fc) - (b - c) ** 2 * (fb - fa)) / denominator
        if not a < x < c or abs(x - b) < 1e-8:
            break
        f = _horner(coefficients, x)
        best = max(best, f)
        if x < b:
            if f > fb:
                c, fc, b, fb = b, fb, x, f
            else:
                a, fa = x, f
        elif f > fb:
            a, fa, b, fb = b, fb, x, f
        else:
            c, fc = x, f
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
    return _summit(tables, values, summary[4:6], best, coefficients)


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
