r"""Flight without contact, evaluated exactly, and steps that provably miss no contact.

With ε_b = √(v_b² + k_b p_b²), which no damped block increases, M = Σ weight_b ε_b bounds |δ̈| from now on. A stop at
distance g = -δ that opens at the rate v = -δ̇ cannot be reached before

    τ = (v + √(v² + 2 M g))/M,

so steps of at most τ are safe. Close to a contact τ tends to the root from below; within reach of a Taylor
polynomial of order 6 the root is found on that polynomial, which is exact to rounding there.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.kernels import copy, dot, indentation, inlined, kernel
from solvers.state import SAMPLED, STEPS, T

ORDER = 6
_REFRESH = 8  # flight steps between two evaluations of the bound


@inlined
def level_within(tables, span):
    """Index of the longest tabulated step not above ``span``, which is at least the shortest one."""
    level = max(int(np.ceil(4.0 * math.log2(tables.h[0] / span))), 0)
    while tables.h[level] > span and level < tables.h.size - 1:
        level += 1
    return level


@kernel
def _cell(problem, t):
    """(cell, offset) of the sampled signals' common grid."""
    dt = problem.table_dt[0]
    last = problem.table_start[1] - problem.table_start[0] - 2
    cell = min(max(int(t / dt + 1e-9), 0), last)
    return cell, t - cell * dt


@kernel
def signal_derivatives(problem, j, t, out):
    """s, s', ..., s⁽⁵⁾ of node table j at time t."""
    dt = problem.table_dt[j]
    cell, offset = _cell(problem, t)
    row = problem.table_start[j] + cell
    a, b = problem.table[row], problem.table[row + 1]
    s1, s2 = a[1] * dt, 0.5 * a[2] * dt * dt
    e0 = b[0] - a[0] - s1 - s2
    e1 = b[1] * dt - s1 - 2.0 * s2
    e2 = 0.5 * b[2] * dt * dt - s2
    c3 = 10.0 * e0 - 4.0 * e1 + e2
    c4 = -15.0 * e0 + 7.0 * e1 - 2.0 * e2
    c5 = 6.0 * e0 - 3.0 * e1 + e2
    x, r = offset / dt, 1.0 / dt
    out[0] = a[0] + x * (s1 + x * (s2 + x * (c3 + x * (c4 + x * c5))))
    out[1] = r * (s1 + x * (2.0 * s2 + x * (3.0 * c3 + x * (4.0 * c4 + x * 5.0 * c5))))
    r *= 1.0 / dt
    out[2] = r * (2.0 * s2 + x * (6.0 * c3 + x * (12.0 * c4 + x * 20.0 * c5)))
    r *= 1.0 / dt
    out[3] = r * (6.0 * c3 + x * (24.0 * c4 + x * 60.0 * c5))
    r *= 1.0 / dt
    out[4] = r * (24.0 * c4 + x * 120.0 * c5)
    out[5] = r / dt * 120.0 * c5


@kernel
def _signal_bound(problem, j, cell):
    """Bound of |s| on a cell: the largest Bézier coefficient of the quintic."""
    dt = problem.table_dt[j]
    row = problem.table_start[j] + cell
    a, b = problem.table[row], problem.table[row + 1]
    da, db = 0.2 * dt * a[1], 0.2 * dt * b[1]
    bound = max(abs(a[0]), abs(b[0]), abs(a[0] + da), abs(b[0] - db))
    bound = max(bound, abs(a[0] + 2.0 * da + 0.05 * dt * dt * a[2]))
    return max(bound, abs(b[0] - 2.0 * db + 0.05 * dt * dt * b[2]))


@inlined
def turn(problem, alpha, beta, x):
    """Multiply every block by its propagator α I + β A."""
    n = problem.k.size
    for b in range(n):
        p, v = x[b], x[n + b]
        x[b] = alpha[b] * p + beta[b] * v
        x[n + b] = alpha[b] * v - beta[b] * (problem.k[b] * p + problem.c[b] * v)


@kernel
def _add_signals(problem, response, x, t, six):
    """Add the response to the polynomial signals of the step that began at t."""
    size = 2 * problem.k.size
    for j in range(problem.table_dt.size):
        signal_derivatives(problem, j, t, six)
        rows = response[problem.table_load[j]]
        for i in range(6):
            for e in range(size):
                x[e] += six[i] * rows[i, e]


@kernel
def _taylor(problem, x, t, terms, six):
    """Rows y, y', ..., y⁽⁶⁾ at time t in flight."""
    n = problem.k.size
    for e in range(2 * n):
        terms[0, e] = x[e]
    for i in range(ORDER):
        for b in range(n):
            terms[i + 1, b] = terms[i, n + b]
            terms[i + 1, n + b] = -problem.k[b] * terms[i, b] - problem.c[b] * terms[i, n + b]
    for j in range(problem.table_dt.size):
        signal_derivatives(problem, j, t, six)
        load = problem.load[problem.table_load[j]]
        for i in range(ORDER):  # each derivative of the signal enters one row and is carried on by A
            for e in range(2 * n):
                terms[ORDER + 1, e] = six[i] * load[e] if i < 6 else 0.0
            for k in range(i + 1, ORDER + 1):
                for e in range(2 * n):
                    terms[k, e] += terms[ORDER + 1, e]
                for b in range(n):
                    p, v = terms[ORDER + 1, b], terms[ORDER + 1, n + b]
                    terms[ORDER + 1, b] = v
                    terms[ORDER + 1, n + b] = -problem.k[b] * p - problem.c[b] * v


@kernel
def _add_taylor(terms, x, span, size):
    """Taylor step of the given duration."""
    for e in range(size):
        value = terms[ORDER, e]
        for i in range(ORDER - 1, -1, -1):
            value = terms[i, e] + span / (i + 1.0) * value
        x[e] = value


@inlined
def energy_norms(problem, x, out):
    """ε_b = √(v² + k p²) of every block."""
    n = problem.k.size
    for b in range(n):
        out[b] = math.sqrt(x[n + b] * x[n + b] + problem.k[b] * x[b] * x[b])


@inlined
def _acceleration_bound(problem, tables, s, norms, signal_bounds, horizon):
    """M: bound of |δ̈| of stop s over the horizon, signals included."""
    n = problem.k.size
    total = dot(tables.weight[s], norms, n)
    for j in range(problem.table_dt.size):
        load = problem.table_load[j]
        growth = dot(tables.weight[s], tables.load_norm[load], n)
        total += signal_bounds[j] * (horizon * growth + abs(tables.direct[s, load]))
    return total


@inlined
def _safe(g, v, bound):
    """Time before which a stop at distance g, opening at v, cannot be reached."""
    if bound <= 0.0:
        return g / -v if v < 0.0 else np.inf
    root = math.sqrt(v * v + 2.0 * bound * max(g, 0.0))
    return (v + root) / bound if v >= 0.0 else 2.0 * max(g, 0.0) / (root - v)


@kernel
def _first_root(terms, row, gap, size, longest, values):
    """First x in [0, longest] at which δ becomes positive on the Taylor polynomial; -1 if it does not."""
    for i in range(ORDER + 1):
        values[i] = dot(row, terms[i], size)
    values[0] -= gap
    if values[0] >= 0.0 and (values[1] > 0.0 or (values[1] == 0.0 and values[2] > 0.0)):
        return 0.0
    end = longest
    if values[1] > 0.0 and _polynomial(values, 1, longest) < 0.0:  # δ has its maximum inside
        end = _bisect(values, 1, -1.0, 0.0, longest)
    if not _polynomial(values, 0, end) > 0.0:
        return -1.0
    return _bisect(values, 0, 1.0, 0.0, end)


@inlined
def _polynomial(values, derivative, x):
    """Taylor polynomial of a derivative at x."""
    total = values[ORDER]
    for i in range(ORDER - 1, derivative - 1, -1):
        total = values[i] + x / (i + 1.0 - derivative) * total
    return total


@kernel
def _bisect(values, derivative, sign, a, b):
    """Newton with bisection as its guard for the sign change of a derivative in [a, b]."""
    x = b
    for _ in range(60):
        f = sign * _polynomial(values, derivative, x)
        if f > 0.0:
            b = x
        else:
            a = x
        slope = sign * _polynomial(values, derivative + 1, x)
        step = f / slope if slope != 0.0 else np.inf
        following = x - step
        if not a < following < b:
            following = 0.5 * (a + b)
        if following == x or abs(following - x) <= 1e-17 * b:
            break
        x = following
    return x


@kernel
def fly(problem, tables, state, space, t_end, budget, out, dt):
    """Fly until a stop is reached (returns its index), the end (-1), or the budget is spent (-2).

    Steps end on the output times too: flight is exact, so that this costs nothing but the steps.
    """
    stops, size, now = problem.gap.size, 2 * problem.k.size, state.now
    shortest = tables.h[tables.h.size - 1]
    sampled = problem.table_dt.size > 0
    dt_cell = problem.table_dt[0] if sampled else np.inf
    for count in range(budget):
        if state.count[SAMPLED] < out.shape[0] and state.count[SAMPLED] * dt <= now[T]:
            copy(state.x, out[state.count[SAMPLED]], state.x.size)
            state.count[SAMPLED] += 1
        if now[T] >= t_end:
            return -1

        # --- how far the output, the end and the signals' cell allow
        target = min(t_end, state.count[SAMPLED] * dt) if state.count[SAMPLED] < out.shape[0] else t_end
        span, rest, offset = target - now[T], np.inf, 0.0
        if sampled:
            cell, offset = _cell(problem, now[T])
            rest = max(dt_cell - offset, 1e-9 * dt_cell)
            for j in range(problem.table_dt.size):
                space.bounds[j] = _signal_bound(problem, j, cell)
        if sampled or count % _REFRESH == 0:
            energy_norms(problem, state.x, space.norms)
            for s in range(stops):
                space.m[s] = _acceleration_bound(problem, tables, s, space.norms, space.bounds, rest)
        span = min(span, rest)

        # --- how far no stop can be reached
        for s in range(stops):
            g, v = -indentation(problem, s, state.x), -dot(problem.read_rate[s], state.x, size)
            span = min(span, _safe(g, v, space.m[s]))

        # --- go: a Taylor step that looks for roots, a whole cell, or a tabulated step
        stop = -1
        if span < shortest:
            _taylor(problem, state.x, now[T], space.terms, space.six)
            h = min(shortest, target - now[T], rest)
            for s in range(stops):
                root = _first_root(space.terms, problem.read[s], problem.gap[s], size, h, space.values)
                if root >= 0.0:
                    h, stop = root, s
            _add_taylor(space.terms, state.x, h, size)
        elif span == rest and abs(offset) < 1e-7 * dt_cell:
            h = rest
            turn(problem, tables.cell[0], tables.cell[1], state.x)
            _add_signals(problem, tables.cell_signal, state.x, now[T], space.six)
        else:
            level = level_within(tables, span)
            h = tables.h[level]
            turn(problem, tables.propagator[level, 0], tables.propagator[level, 1], state.x)
            if sampled:
                _add_signals(problem, tables.signal[level], state.x, now[T], space.six)
        now[T] = target if now[T] + h >= target else now[T] + h
        state.count[STEPS] += 1
        if stop >= 0:
            return stop
    return -2
