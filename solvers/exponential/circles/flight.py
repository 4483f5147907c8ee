"""Flight in a circular clearance: time steps proven free of contact, and the first contact on the Taylor polynomials.

With M a bound of |ü|, |u(τ)| <= |u + u̇τ| + Mτ²/2, and (c - Mτ²/2)² >= c² - cMτ². So an inner circle is not met before

    τ = (-b + √(b² + a (c² - r²)))/a,   a = |u̇|² + cM,   b = u·u̇.

For an outer one the bound along the radius suffices: r(τ) >= r + ṙτ - Mτ²/2. On a cell of sampled signals u differs
from the straight line between its ends by at most e, and a disc is convex: an inner circle is not met if |u| + e < c at
both ends.
"""

from __future__ import annotations

import math

from numba import types

from solvers.compiled.kernels import MATRIX, REAL, VECTOR, dot, inlined, inner
from solvers.compiled.parts import CIRCLE_NEAR, CIRCLE_ROOT, CIRCLE_SPAN, CIRCLE_SPAN_AT, part
from solvers.exponential.flight import (
    AMPLITUDE,
    BOUND,
    FAST,
    ORDER,
    motion_of_row,
    motion_of_slowest,
    safe_time,
    uses_slowest,
)


@inlined
def _safe_in_circle(radius, uu, uv, vv, bound):
    """Time τ before which a circle cannot be met, from u·u, u·u̇, u̇·u̇ and the bound of |ü|."""
    r = math.sqrt(uu)
    if radius < 0.0:
        return safe_time(r + radius, uv / r if r > 0.0 else 0.0, bound)
    distance, a = (radius - r) * (radius + r), vv + radius * bound
    if distance <= 0.0 and uv >= 0.0:
        return 0.0
    if a <= 0.0:
        return math.inf
    distance = max(distance, 0.0)
    root = math.sqrt(uv * uv + a * distance)
    return distance / (uv + root) if uv > 0.0 else (root - uv) / a


@part(CIRCLE_SPAN, REAL, types.int64, MATRIX)
def span_of_circle(run, s, x):
    """The same from the blocks' p and v; ``scratch.per_row`` bounds the accelerations of the rows."""
    row = run.problem.first[s]
    u, u_dot = motion_of_row(run, row, x)
    w, w_dot = motion_of_row(run, row + 1, x)
    bound = math.hypot(run.scratch.per_row[row], run.scratch.per_row[row + 1])
    uu, uv, vv = u * u + w * w, u * u_dot + w * w_dot, u_dot * u_dot + w_dot * w_dot
    time = _safe_in_circle(run.problem.radius[s], uu, uv, vv, bound)
    return max(time, _by_slowest(run, s, x, math.sqrt(uu))) if time * run.tables.fastest > FAST else time


@inlined
def _by_slowest(run, s, x, r):
    """The same by the slowest blocks alone, the others being bounded by their amplitude; 0 if that tells nothing."""
    row, radius = run.problem.first[s], run.problem.radius[s]
    distance = radius - r if radius > 0.0 else r + radius
    if not (uses_slowest(run, row, x, distance) and uses_slowest(run, row + 1, x, distance)):
        return 0.0
    slow, (u, u_dot) = run.scratch.slow, motion_of_slowest(run, row, x)
    w, w_dot = motion_of_slowest(run, row + 1, x)
    bound = math.hypot(slow[row, BOUND], slow[row + 1, BOUND])
    reduced = radius - math.hypot(slow[row, AMPLITUDE], slow[row + 1, AMPLITUDE])
    uu, uv, vv = u * u + w * w, u * u_dot + w * w_dot, u_dot * u_dot + w_dot * w_dot
    clear = math.sqrt(uu) < reduced if radius > 0.0 else math.sqrt(uu) > -reduced
    return _safe_in_circle(reduced, uu, uv, vv, bound) if clear else 0.0


@part(CIRCLE_SPAN_AT, REAL, types.int64)
def span_of_circle_at(run, s):
    """The same from the state."""
    problem = run.problem
    row, size = problem.first[s], 2 * problem.k.size
    uu, uv, vv, bound = 0.0, 0.0, 0.0, math.hypot(run.scratch.per_row[row], run.scratch.per_row[row + 1])
    for r in range(row, row + 2):
        u = dot(problem.read[r], run.state.x, size) - problem.gap[r]
        v = dot(problem.read_rate[r], run.state.x, size)
        uu, uv, vv = uu + u * u, uv + u * v, vv + v * v
    return _safe_in_circle(problem.radius[s], uu, uv, vv, bound)


@part(CIRCLE_NEAR, types.boolean, types.int64, MATRIX)
def circle_is_near(run, s, x):
    """Whether a circle may be met on a cell with this end; ``scratch.per_row`` bounds the rows' error of interpolation.

    Always True of an outer circle, which the straight line between two places outside may cross.
    """
    row = run.problem.first[s]
    u, w = motion_of_row(run, row, x)[0], motion_of_row(run, row + 1, x)[0]
    reach = math.hypot(u, w) + math.hypot(run.scratch.per_row[row], run.scratch.per_row[row + 1])
    return not reach < run.problem.radius[s]


@part(CIRCLE_ROOT, types.void, types.int64, MATRIX, VECTOR)
def radial_polynomial(problem, s, terms, values):
    """Coefficients in time of σ (|u|² - c²)/2c, which is δ to first order near c, from the derivatives of the state."""
    row, radius, size = problem.first[s], problem.radius[s], 2 * problem.k.size
    for i in range(ORDER + 1):
        values[i] = 0.0
    square = 0.0
    for r in range(row, row + 2):
        for i in range(ORDER + 1):
            a = _coefficient(problem, r, terms, i, size)
            for j in range(ORDER + 1 - i):
                values[i + j] += a * _coefficient(problem, r, terms, j, size)
        square += _coefficient(problem, r, terms, 0, size) ** 2
    r, c = math.sqrt(square), abs(radius)
    values[0] = (r - c) * (r + c)
    for i in range(ORDER + 1):
        values[i] /= 2.0 * radius


@inner
def _coefficient(problem, r, terms, i, size):
    """Coefficient of t^i of a row's displacement."""
    value = dot(problem.read[r], terms[i], size)
    for k in range(i):
        value /= k + 1.0
    return value - problem.gap[r] if i == 0 else value
