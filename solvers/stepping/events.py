"""Where, within one step, a stop leaves its segment of the law: free flight, or the range between two knots.

Inside a step the indentation is the polynomial of the method's dense output,
``δ(θ) = δ₀ + θ(r₀ + (1-θ)(r₁ + θ(r₂ + (1-θ)(r₃ + ...))))``, θ in [0, 1].
"""

import numpy as np

from solvers.compiled.kernels import dot, indentation, inner, kernel, merged
from solvers.compiled.state import surface_tolerance

# finer near 0, where a contact just left may come back
_NODES = np.array([0.0, 1 / 64, 1 / 32, 1 / 16, 1 / 8, 1 / 4, 3 / 8, 1 / 2, 5 / 8, 3 / 4, 7 / 8, 1.0])
_GOLDEN = 0.6180339887498949
UNRESOLVED = -1.0
NONE = 2.0
MOST_LANDINGS = 60
"""Steps tried to land: where the level is only just reached Newton halves its distance, so does bisection."""
IGNORED, HENON, LOCATED = range(3)
"""What a method does about events: pieces follow at the end of a step; Hénon's step onto an entry; all located."""


@inner
def polynomial(coefficients, theta):
    """Value at θ of the nested form; coefficients (δ₀, r₀ ... r₆)."""
    u = 1.0 - theta
    r = coefficients
    return r[0] + theta * (r[1] + u * (r[2] + theta * (r[3] + u * (r[4] + theta * (r[5] + u * (r[6] + theta * r[7]))))))


@inner
def motion_of(problem, s, x, dense, coefficients):
    """Nested coefficients of a stop's indentation and, in the second row, of its rate."""
    row = problem.first[s]
    _coefficients_of(problem.read[row], problem.gap[row], x, dense, coefficients[0])
    _coefficients_of(problem.read_rate[row], 0.0, x, dense, coefficients[1])


@inner
def _coefficients_of(row, offset, x, dense, out):
    """Nested coefficients of ``row·z - offset``."""
    size = row.size
    out[0] = dot(row, x, size) - offset
    for i in range(7):
        out[1 + i] = dot(row, dense[i], size)


@merged  # as a call would hand over the address of ``value``, with which numba keeps no caller's machine code
def golden_section(value, known, a, b):
    """Place of the largest ``value(known, θ)`` on [a, b], and the largest value met."""
    best = -np.inf
    for _ in range(40):
        c, d = b - _GOLDEN * (b - a), a + _GOLDEN * (b - a)
        at_c, at_d = value(known, c), value(known, d)
        if at_c > at_d:
            b = d
        else:
            a = c
        best = max(best, at_c, at_d)
    return 0.5 * (a + b), best


@inner
def _signed(known, theta):
    """sign·δ at θ."""
    coefficients, sign = known
    return sign * polynomial(coefficients, theta)


@merged
def bisection(value, known, a, b):
    """Where ``value(known, θ)`` becomes positive in [a, b]."""
    for _ in range(50):
        middle = 0.5 * (a + b)
        if value(known, middle) > 0.0:
            b = middle
        else:
            a = middle
    return b


@inner
def _beyond(known, theta):
    """sign·(δ - level) at θ."""
    coefficients, level, sign = known
    return sign * (polynomial(coefficients, theta) - level)


@inner
def crossing(coefficients, rates, level, sign, tolerance):
    """First θ at which sign·(δ - level) becomes positive; NONE, or UNRESOLVED when it does so at once.

    Between two nodes δ may rise and fall again; that it does is seen by its rate, the polynomial ``rates``.
    """
    if abs(level) == np.inf:
        return NONE
    last = sign * (coefficients[0] - level)
    tolerance = max(tolerance, 2.0 * last)  # a start a little outside, after a graze, is no crossing yet
    rising = sign * rates[0] > 0.0
    for i in range(1, _NODES.size):
        value = sign * (polynomial(coefficients, _NODES[i]) - level)
        if value > tolerance:
            if i == 1 and last >= -tolerance:
                return UNRESOLVED
            return bisection(_beyond, (coefficients, level, sign), _NODES[i - 1], _NODES[i])
        rises = sign * polynomial(rates, _NODES[i]) > 0.0
        if rising and not rises:
            top = golden_section(_signed, (coefficients, sign), _NODES[i - 1], _NODES[i])[0]
            if sign * (polynomial(coefficients, top) - level) > tolerance:
                return bisection(_beyond, (coefficients, level, sign), _NODES[i - 1], top)
        last, rising = value, rises
    return NONE


@kernel
def nearer(h, distance, rate, before, beyond, longest):
    """Duration to try after h has ended ``distance`` beyond a level, at ``rate``; -1 where none is known to land.

    By Newton, or by halving where that leaves (before, beyond). ``beyond`` is a duration that ends beyond the level,
    or ``longest`` where none is known: then there may be no landing.
    """
    guess = h - distance / rate
    if before < guess < beyond:
        return guess
    middle = 0.5 * (before + beyond)
    return middle if beyond < longest and before < middle < beyond else -1.0


@inner
def first_event(problem, x, dense, segment, coefficients):
    """(θ, stop, direction ±1) of the earliest crossing of the step by any stop."""
    theta, stop, direction = NONE, -1, 0
    for s in range(problem.law.size):
        motion_of(problem, s, x, dense, coefficients)
        tolerance = surface_tolerance(problem, s, x)
        found = crossing(coefficients[0], coefficients[1], problem.knots[s, segment[s]], 1.0, tolerance)
        if found < theta:
            theta, stop, direction = found, s, 1
        if segment[s] > 0:
            found = crossing(coefficients[0], coefficients[1], problem.knots[s, segment[s] - 1], -1.0, tolerance)
            if found < theta:
                theta, stop, direction = found, s, -1
    return theta, stop, direction


@inner
def entry_by_sign(problem, x, x_new, segment):
    """(θ, stop) of the stop that is inside at the end of a step but was not at its start; the paper's test."""
    theta, stop = NONE, -1
    for s in range(problem.law.size):
        if segment[s] == 0:
            after = indentation(problem, s, x_new)
            if after > 0.0:
                before = indentation(problem, s, x)
                found = before / (before - after)
                if found < theta:
                    theta, stop = found, s
    return theta, stop
