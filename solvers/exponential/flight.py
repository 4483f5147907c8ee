"""Exact flight: propagators of the blocks, polynomial signals, Taylor steps.

A flight step multiplies every block by its tabulated propagator α I + β A and adds the response to the quintics
of the sampled signals; a step below the shortest of the tables is a Taylor step of order 6, exact to rounding.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from solvers.compiled.kernels import REAL, at_end, copy, inlined, inner, quintic
from solvers.compiled.parts import FOLLOWED, part
from solvers.compiled.simd import WIDTH, bit_pattern, load8, splat8, sqrt8, store8, sum8
from solvers.compiled.sums import combine

ORDER = 6  # of Taylor steps
_LOG_ERROR = int(0.345 * 2**50)  # four times 0.0863, the error of a logarithm linear between powers of two
SERIES_TERMS = 14  # terms of a series that is exact to rounding up to |λ| x = SERIES_REACH: 0.6^14/14! = 9e-15
SERIES_REACH = 0.6
COUNT, BOUND, AMPLITUDE = range(3)
"""Places in `Scratch.slow`: how many of the slowest blocks are bounded apart, 0 if none, `UNKNOWN` if not chosen yet;
their bound of |δ̈|, m/s²; the amplitude of all other blocks, m."""
UNKNOWN = -1.0
FAST = 2.0  # angle of the fastest block, rad, from which on its amplitude may bound it better than |δ̈|
_SHARE = 0.25  # of the distance to a stop, by which all others than the slowest blocks may move it
SWING = 6  # index in Scratch.split_state: the state without what follows the sampled signals
_ROUNDING = 9e-16  # of a time over the length of a cell, relative


@inlined
def level_within(tables, span):
    """Index of the longest tabulated step not above ``span``, or of the shortest step if that is longer."""
    # 2^50 in the bit pattern are a quarter octave; the estimate is never too high
    level = ((bit_pattern(tables.flight_step[0]) - bit_pattern(span) - _LOG_ERROR) >> 50) + 1
    level = min(max(level, 0), tables.flight_step.size - 1)
    while tables.flight_step[level] > span and level < tables.flight_step.size - 1:
        level += 1
    return level


@inner
def cell_of(problem, t):
    """(cell, time since its begin, s) of the sampled signals' grid; a time within rounding of a node is on it."""
    dt, place = problem.table_dt[0], t / problem.table_dt[0]
    last = problem.table_start[1] - problem.table_start[0] - 2
    cell = min(max(int(place + 1e-9 + _ROUNDING * place), 0), last)
    return cell, t - cell * dt


@inner
def signal_derivatives(problem, j, t, out):
    """s, s', ..., s⁽⁵⁾ of node table j at time t."""
    dt = problem.table_dt[j]
    cell, offset = cell_of(problem, t)
    s0, s1, s2, c3, c4, c5 = quintic(problem, j, cell)
    x, r = offset / dt, 1.0 / dt
    out[0] = s0 + x * (s1 + x * (s2 + x * (c3 + x * (c4 + x * c5))))
    out[1] = r * (s1 + x * (2.0 * s2 + x * (3.0 * c3 + x * (4.0 * c4 + x * 5.0 * c5))))
    r *= 1.0 / dt
    out[2] = r * (2.0 * s2 + x * (6.0 * c3 + x * (12.0 * c4 + x * 20.0 * c5)))
    r *= 1.0 / dt
    out[3] = r * (6.0 * c3 + x * (24.0 * c4 + x * 60.0 * c5))
    r *= 1.0 / dt
    out[4] = r * (24.0 * c4 + x * 120.0 * c5)
    out[5] = r / dt * 120.0 * c5


@inlined
def propagate_blocks(problem, alpha, beta, x):
    """Multiply every block by its propagator α I + β A."""
    n = problem.k.size
    for b in range(n):
        p, v = x[b], x[n + b]
        x[b] = alpha[b] * p + beta[b] * v
        x[n + b] = alpha[b] * v - beta[b] * (problem.k[b] * p + problem.c[b] * v)


@inner
def derive_signals(problem, t, signal_terms):
    """s, s', ..., s⁽⁵⁾ of all node tables at time t."""
    for j in range(problem.table_dt.size):
        signal_derivatives(problem, j, t, signal_terms[j])


@inlined
def split(problem, x, parts):
    """Write p and v of the blocks into two rows of their own."""
    n = problem.k.size
    for b in range(n):
        parts[0, b], parts[1, b] = x[b], x[n + b]


@inlined
def join(problem, parts, x):
    """Write these rows back into x."""
    n = problem.k.size
    for b in range(n):
        x[b], x[n + b] = parts[0, b], parts[1, b]


@part(FOLLOWED, types.void, REAL)
def take_off_following(run, t):
    """Take what follows the sampled signals at t off the state in ``split_state[SWING]``; see `tables.following`."""
    problem, tables, terms, x = run.problem, run.tables, run.scratch.signal_terms, run.scratch.split_state[SWING]
    derive_signals(problem, t, terms)
    for i in range(0, x.shape[1], WIDTH):
        p, v = load8(x[0], i), load8(x[1], i)
        for j in range(problem.table_dt.size):
            rows = tables.following[problem.table_load[j]]
            for d in range(3):
                p = p - splat8(terms[j, d]) * load8(rows[d, 0], i)
                v = v - splat8(terms[j, d]) * load8(rows[d, 1], i)
        store8(x[0], i, p)
        store8(x[1], i, v)


@inlined
def cross_cell(run, x, cell, result):
    """Write into ``result`` p and v of the blocks one whole cell of the sampled signals after x, eight blocks at once.

    The response to the signals is summed first, since it does not depend on the cell before.
    """
    problem, tables = run.problem, run.tables
    width = x.shape[1]
    for i in range(0, width, WIDTH):
        place, rate = splat8(0.0), splat8(0.0)
        for j in range(problem.table_dt.size):
            rows, node = tables.cell_signal[problem.table_load[j]], problem.table_start[j] + cell
            for d in range(3):
                begin, end = splat8(problem.table[node, d]), splat8(problem.table[node + 1, at_end(problem) + d])
                place += begin * load8(rows, 2 * d * width + i) + end * load8(rows, (2 * d + 6) * width + i)
                rate += begin * load8(rows, (2 * d + 1) * width + i) + end * load8(rows, (2 * d + 7) * width + i)
        p, v, a, b = load8(x[0], i), load8(x[1], i), load8(tables.cell[0], i), load8(tables.cell[1], i)
        power = load8(tables.block_k_c[0], i) * p + load8(tables.block_k_c[1], i) * v
        store8(result[0], i, place + (a * p + b * v))
        store8(result[1], i, rate + (a * v - b * power))


@inner
def taylor_terms(problem, x, t, terms, signal_terms):
    """Rows y, y', ..., y⁽⁶⁾ at time t in flight: y⁽ⁱ⁺¹⁾ = A y⁽ⁱ⁾ + load s⁽ⁱ⁾."""
    n = problem.k.size
    for e in range(2 * n):
        terms[0, e] = x[e]
    derive_signals(problem, t, signal_terms)
    for i in range(ORDER):
        for b in range(n):
            terms[i + 1, b] = terms[i, n + b]
            terms[i + 1, n + b] = -problem.k[b] * terms[i, b] - problem.c[b] * terms[i, n + b]
        for j in range(problem.table_dt.size):
            load = problem.load[problem.table_load[j]]
            for e in range(2 * n):
                terms[i + 1, e] += signal_terms[j, i] * load[e]


@inner
def taylor_step(terms, x, span, size, weights, sums):
    """Taylor step of the duration ``span`` from its ``terms``, into x; ``weights`` and ``sums`` are scratch."""
    weights[0] = 1.0
    for i in range(ORDER):
        weights[i + 1] = weights[i] * span / (i + 1.0)
    combine(terms, weights, ORDER + 1, None, sums)
    copy(sums, x, size)


@inner
def fly_series(run, x, t, span, signal_terms, terms):
    """Move p and v of the blocks by ``span`` <= SERIES_REACH/|λ|max within a cell, by a Taylor series of 14 terms.

    The derivatives of p, then v, are left in the rows of ``terms``.
    """
    problem, tables = run.problem, run.tables
    width = x.shape[1]
    derive_signals(problem, t, signal_terms)
    for i in range(0, width, WIDTH):
        p, v, weight = load8(x[0], i), load8(x[1], i), 1.0
        k, c, place, rate = load8(tables.block_k_c[0], i), load8(tables.block_k_c[1], i), p, v
        for order in range(SERIES_TERMS - 1):
            store8(terms[order], i, p)
            store8(terms[order], width + i, v)
            by_p, by_v = splat8(0.0), splat8(0.0)  # of the signals: independent of the term before
            if order < 6:
                for j in range(problem.table_dt.size):
                    rows, value = tables.load_rows[problem.table_load[j]], splat8(signal_terms[j, order])
                    by_p += value * load8(rows, i)
                    by_v += value * load8(rows, width + i)
            p, v = by_p + v, by_v - k * p - c * v
            weight *= span / (order + 1.0)
            place += splat8(weight) * p
            rate += splat8(weight) * v
        store8(terms[SERIES_TERMS - 1], i, p)
        store8(terms[SERIES_TERMS - 1], width + i, v)
        store8(x[0], i, place)
        store8(x[1], i, rate)


@inner
def fly_tabulated(run, level, x, signal_terms):
    """A tabulated step of the blocks' p and v under signals with given derivatives at its start."""
    propagate_split(run.tables, level, x)
    width = 2 * x.shape[1]
    for j in range(run.problem.table_dt.size):
        rows = run.tables.signal[level, run.problem.table_load[j]]
        for i in range(0, width, WIDTH):
            total = load8(x, i)
            for order in range(6):
                total += splat8(signal_terms[j, order]) * load8(rows, order * width + i)
            store8(x, i, total)


@inlined
def propagate_split(tables, level, x):
    """A tabulated step of the blocks' p and v without signals, eight blocks at once."""
    alpha, beta = tables.flight_propagator[level, 0], tables.flight_propagator[level, 1]
    for i in range(0, x.shape[1], WIDTH):
        p, v, a, b = load8(x[0], i), load8(x[1], i), load8(alpha, i), load8(beta, i)
        store8(x[0], i, a * p + b * v)
        store8(x[1], i, a * v - b * (load8(tables.block_k_c[0], i) * p + load8(tables.block_k_c[1], i) * v))


@inlined
def safe_time(g, v, bound):
    """Time before which a stop at distance g, opening at the rate v, cannot be reached; ``bound`` is that of |δ̈|."""
    if bound <= 0.0:
        return g / -v if v < 0.0 else np.inf
    root = math.sqrt(v * v + 2.0 * bound * max(g, 0.0))
    return (v + root) / bound if v >= 0.0 else 2.0 * max(g, 0.0) / (root - v)


@inlined
def motion_of_row(run, row, x):
    """Displacement less gap, and rate, of a row from the blocks' p and v."""
    rows, delta, rate = run.tables.stop_rows[row], splat8(0.0), splat8(0.0)
    for i in range(0, x.shape[1], WIDTH):
        p, v = load8(x[0], i), load8(x[1], i)
        delta += load8(rows[0], i) * p + load8(rows[1], i) * v
        rate += load8(rows[2], i) * p + load8(rows[3], i) * v
    return sum8(delta) - run.problem.gap[row], sum8(rate)


@inlined
def motion_of_slowest(run, row, x):
    """Parts of the same by the slowest blocks that are chosen; the gap is taken off the displacement."""
    tables, rows, delta, rate = run.tables, run.tables.stop_rows[row], -run.problem.gap[row], 0.0
    for i in range(int(run.scratch.slow[row, COUNT])):
        b = int(tables.slowest[i])
        delta += rows[0, b] * x[0, b] + rows[1, b] * x[1, b]
        rate += rows[2, b] * x[0, b] + rows[3, b] * x[1, b]
    return delta, rate


@inlined
def weighted_norms(weights, tables, x):
    """Σ_b weight_b ε_b of the blocks' energy norms, from p and v."""
    total = splat8(0.0)
    for i in range(0, x.shape[1], WIDTH):
        p, v = load8(x[0], i), load8(x[1], i)
        total += load8(weights, i) * sqrt8(v * v + load8(tables.block_k_c[0], i) * p * p)
    return sum8(total)


@inner
def _choose_slowest(run, row, x, distance):
    """Choose so many of the slowest blocks that all others move the row by less than the ``distance``.

    By at most `_SHARE` of it, if possible. Blocks with k = 0 have no amplitude: they are among the slowest.
    """
    tables, slow, k = run.tables, run.scratch.slow[row], run.tables.block_k_c[0]
    accelerations, amplitudes = tables.acceleration_weight[row], tables.amplitude_weight[row]
    bound, others = 0.0, weighted_norms(amplitudes, tables, x)
    slow[COUNT] = 0.0
    for i in range(tables.slowest.size - 1):
        b = int(tables.slowest[i])
        norm = math.sqrt(x[1, b] * x[1, b] + k[b] * x[0, b] * x[0, b])
        bound, others = bound + accelerations[b] * norm, others - amplitudes[b] * norm
        if others < distance and k[int(tables.slowest[i + 1])] > 0.0:
            slow[COUNT], slow[BOUND], slow[AMPLITUDE] = i + 1.0, bound, others
            if others <= _SHARE * distance:
                return


@inlined
def uses_slowest(run, row, x, distance):
    """Whether some of the slowest blocks are chosen such that all others move the row by less than the ``distance``."""
    slow = run.scratch.slow[row]
    if slow[COUNT] == UNKNOWN or (slow[COUNT] > 0.0 and slow[AMPLITUDE] >= distance):
        _choose_slowest(run, row, x, distance)
    return slow[COUNT] > 0.0


@inlined
def energy_norms(problem, x, out):
    """ε_b = √(v² + k p²) of every block."""
    n = problem.k.size
    for b in range(n):
        out[b] = math.sqrt(x[n + b] * x[n + b] + problem.k[b] * x[b] * x[b])
