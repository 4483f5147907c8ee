"""The energy balance of flight: tabulated steps and cells by the forms of `flight_tables`, the rest by series.

A flight is accounted for from a *mark* on: the start of the flight, the last output or, with sampled signals, the start
of the present cell. Between marks, one form covers the time, whatever steps the flight has taken.

A series reaches `SERIES_REACH` radians of the fastest block. The powers of the motion it gives are integrated by
Gauss's rule with seven points, exact up to the power 13 of the time: within a cell signals are of the fifth, and what
they do to p of the seventh, however rough they are.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from solvers.compiled.kernels import REAL, VECTOR, copy, inlined, inner, merged
from solvers.compiled.parts import ACCOUNT_FLIGHT, ACCOUNT_SERIES, ACCOUNT_STEP, part
from solvers.compiled.simd import WIDTH, load8, splat8, store8, sum8
from solvers.compiled.state import T
from solvers.compiled.sums import combine
from solvers.exponential.contact.nodes import S
from solvers.exponential.energy.quadrature import powers
from solvers.exponential.flight import (
    SERIES_REACH,
    SERIES_TERMS,
    cell_of,
    derive_signals,
    fly_series,
    fly_tabulated,
    level_within,
    split,
)

_MARK, _MOVING, _WITHIN = 3, 4, 5  # of Scratch.split_state: the state at the mark, two that are moved from there on
_MARKED, _JOINED, _SPLIT = 9, 10, 11  # rows of Scratch.stages: time of the mark; a state within a series, twice
_EXACT = 1e-17  # share of the last term of a series
_EXCHANGED = types.UniTuple(REAL, 2)
"""Work and damping: returned, and states told by their place, since a part that is passed an array waits for it."""


@inner
def start_account(problem, state, scratch):
    """Set the mark, from which `account_until` accounts for a flight; the balance of the state is complete."""
    split(problem, state.x, scratch.split_state[_MARK])
    scratch.stages[_MARKED, 0] = state.now[T]


@inner
def fly_within(problem, tables, scratch, place, t, span, accounted, energy_tables, row):
    """Move p and v at a place of ``split_state`` by ``span`` within a cell; ``row``'s balance too, if ``accounted``."""
    x = scratch.split_state[place]
    while tables.fastest * span > SERIES_REACH:
        level = level_within(tables, span)
        derive_signals(problem, t, scratch.signal_terms)
        if accounted:
            add_to_balance(problem, row, account_step(problem, tables, energy_tables, scratch, level, t, place))
        fly_tabulated(problem, tables, level, x, scratch.signal_terms)
        t, span = t + tables.flight_step[level], span - tables.flight_step[level]
    fly_series(problem, tables, x, t, span, scratch.signal_terms, scratch.terms)
    if accounted:
        add_to_balance(problem, row, account_series(problem, tables, energy_tables, scratch, t, span))


@inlined
def add_to_balance(problem, row, exchanged):
    """Add work and damping to the balance of ``row``."""
    row[2 * problem.k.size] += exchanged[0]
    row[2 * problem.k.size + 1] += exchanged[1]


@part(ACCOUNT_FLIGHT, types.void, REAL, VECTOR)
def account_until(problem, tables, energy_tables, scratch, t, row):
    """Add work and damping of a flight from the mark to t, within one cell, to the balance of ``row``."""
    begin = scratch.stages[_MARKED, 0]
    copy_split(scratch.split_state[_MARK], scratch.split_state[_MOVING])
    span = t - begin
    if energy_tables.closed > 0.0 and abs(span - energy_tables.spacing) <= _rounding(problem, energy_tables, t):
        whole = tables.flight_step.size
        add_to_balance(problem, row, account_step(problem, tables, energy_tables, scratch, whole, begin, _MOVING))
    elif span > 0.0:
        accounted = np.bool_(1)  # a literal would be compiled for itself
        fly_within(problem, tables, scratch, _MOVING, begin, span, accounted, energy_tables, row)


@inner
def account_output(problem, tables, energy_tables, state, scratch, t, row):
    """Complete the balance of an output at t; without sampled signals the mark moves there."""
    copy(state.x[2 * problem.k.size :], row[2 * problem.k.size :], 2)
    account_until(problem, tables, energy_tables, scratch, t, row)
    if problem.table_dt.size == 0:
        copy(row[2 * problem.k.size :], state.x[2 * problem.k.size :], 2)
        split(problem, row, scratch.split_state[_MARK])
        scratch.stages[_MARKED, 0] = t


@inner
def account_state(problem, tables, energy_tables, state, scratch):
    """Complete the balance of the state, and set the mark there."""
    account_until(problem, tables, energy_tables, scratch, state.now[T], state.x)
    start_account(problem, state, scratch)


@inlined
def copy_split(source, target):
    """Copy p and v of the blocks."""
    for i in range(0, 2 * source.shape[1], WIDTH):
        store8(target, i, load8(source, i))


@merged
def _rounding(problem, energy_tables, t):
    """Difference allowed between the step of the tables and the time between two outputs, or of a cell."""
    return 1e-7 * energy_tables.spacing if problem.table_dt.size else 4e-16 * t


@part(ACCOUNT_STEP, _EXCHANGED, types.int64, REAL, types.int64)
def account_step(problem, tables, energy_tables, scratch, level, t, place):
    """Work and damping of a tabulated step, or of a whole cell, from t on and what is at a place of ``split_state``.

    The derivatives of the signals at the start of a tabulated step are in ``scratch.signal_terms``.
    """
    whole, n, given = level == tables.flight_step.size, problem.k.size, scratch.energy_sums[0]
    x = scratch.split_state[place]
    if energy_tables.closed == 0.0:
        span = energy_tables.spacing if whole else tables.flight_step[level]
        copy_split(x, scratch.split_state[_WITHIN])
        exchanged = _account_panels(problem, tables, energy_tables, scratch, scratch.split_state[_WITHIN], t, span)
        derive_signals(problem, t, scratch.signal_terms)  # of which the panels have made those of the last one
        return exchanged
    if whole:
        _nodes_of_cell(problem, scratch, t)
    count = 0
    for j in range(problem.table_dt.size):
        copy(scratch.signal_terms[j], given[count:], 6)
        count += 6
    gain, loss = _of_signals(energy_tables.pairs[level], given, count)
    for d in range(energy_tables.driver.size):
        i = energy_tables.driver[d]
        given[count] = x[0, i] if i < n else x[1, i - n]
        count += 1
    more, lost = _of_state(energy_tables.rows[level], energy_tables.plain[level], given, count, x)
    return gain + more, loss + lost


@merged
def _nodes_of_cell(problem, scratch, t):
    """s, s', s'' of every signal at the start of the cell of t, then at its end, into ``scratch.signal_terms``."""
    for j in range(problem.table_dt.size):
        node = problem.table_start[j] + cell_of(problem, t)[0]
        copy(problem.table[node], scratch.signal_terms[j], 3)
        copy(problem.table[node + 1], scratch.signal_terms[j, 3:], 3)


@merged
def _of_signals(pairs, given, count):
    """Work and damping of the motion by the signals alone."""
    half = pairs.shape[1] // 2
    gains, losses = splat8(0.0), splat8(0.0)
    for i in range(count, half):
        given[i] = 0.0
    for i in range(0, half, WIDTH):
        works, damps = splat8(0.0), splat8(0.0)
        for e in range(count):
            works += splat8(given[e]) * load8(pairs[e], i)
            damps += splat8(given[e]) * load8(pairs[e], half + i)
        gains += works * load8(given, i)
        losses += damps * load8(given, i)
    return sum8(gains), sum8(losses)


@merged
def _of_state(rows, plain, given, count, x):
    """Work and damping of the state x with what drives it, and damping of the structure's blocks by themselves."""
    width, gains, losses = x.shape[1], splat8(0.0), splat8(0.0)
    for i in range(0, width, WIDTH):
        p, v = load8(x[0], i), load8(x[1], i)
        by_p, by_v = splat8(0.0), splat8(0.0)
        of_p, of_v = load8(plain[0], i) * p + load8(plain[1], i) * v, load8(plain[2], i) * v
        for e in range(count):
            value = splat8(given[e])
            by_p += value * load8(rows[e], i)
            by_v += value * load8(rows[e], width + i)
            of_p += value * load8(rows[e], 2 * width + i)
            of_v += value * load8(rows[e], 3 * width + i)
        gains += by_p * p + by_v * v
        losses += of_p * p + of_v * v
    return sum8(gains), sum8(losses)


@merged
def _account_panels(problem, tables, energy_tables, scratch, x, t, span):
    """The same by series for a step without forms; x is moved."""
    gain, loss = 0.0, 0.0
    panels = max(1, math.ceil(tables.fastest * span / SERIES_REACH - 1e-9))
    for i in range(panels):
        begin = t + i * span / panels
        fly_series(problem, tables, x, begin, span / panels, scratch.signal_terms, scratch.terms)
        more, lost = account_series(problem, tables, energy_tables, scratch, begin, span / panels)
        gain, loss = gain + more, loss + lost
    return gain, loss


@part(ACCOUNT_SERIES, _EXCHANGED, REAL, REAL)
def account_series(problem, tables, energy_tables, scratch, t, span):
    """Work and damping of the motion by `fly_series` that began at t."""
    n, plain = problem.k.size, int(tables.own_blocks) == problem.k.size
    count, size, power = S + 1, 1.0, 1.0
    for i in range(S):
        size *= tables.fastest * span / (i + 1.0)
    while count < SERIES_TERMS and size > _EXACT:
        size *= tables.fastest * span / count
        count += 1
    for i in range(count):
        scratch.values[i] = power
        power *= span
    if plain and tables.loss_rows.shape[0] <= n:
        return _of_rates(problem, tables, energy_tables, scratch, count, span)
    return _of_states(problem, tables, energy_tables, scratch, t, count, span)


@merged
def _of_rates(problem, tables, energy_tables, scratch, count, span):
    """The same without tones and coupling; powers of the time are in ``scratch.values``, all points in one pass."""
    points, series, width = energy_tables.gauss.shape[1], energy_tables.series, tables.block_k_c.shape[1]
    weights, signals, gains, losses = scratch.energy_sums[0], scratch.energy_sums[1], splat8(0.0), splat8(0.0)
    for q in range(points):
        weights[q] = span * energy_tables.gauss[1, q]
        for j in range(problem.table_dt.size):
            signal = 0.0
            for i in range(6):
                signal += series[q, i] * scratch.values[i] * scratch.signal_terms[j, i]
            signals[points * j + q] = weights[q] * signal
    for i in range(0, width, WIDTH):
        a, b, c, d = splat8(0.0), splat8(0.0), splat8(0.0), splat8(0.0)
        e, f, g = splat8(0.0), splat8(0.0), splat8(0.0)
        for k in range(count):
            term = splat8(scratch.values[k]) * load8(scratch.terms[k], width + i)
            a += splat8(series[0, k]) * term
            b += splat8(series[1, k]) * term
            c += splat8(series[2, k]) * term
            d += splat8(series[3, k]) * term
            e += splat8(series[4, k]) * term
            f += splat8(series[5, k]) * term
            g += splat8(series[6, k]) * term
        damped = _sum_of_seven(weights, 0, a * a, b * b, c * c, d * d, e * e, f * f, g * g)
        losses += load8(tables.block_k_c[1], i) * damped
        for j in range(problem.table_dt.size):
            power = load8(energy_tables.power[problem.table_load[j]], i)
            gains += power * _sum_of_seven(signals, points * j, a, b, c, d, e, f, g)
    return sum8(gains), sum8(losses)


@inlined
def _sum_of_seven(weights, first, a, b, c, d, e, f, g):
    """Weighted sum of a block's numbers at Gauss's points."""
    outer = splat8(weights[first]) * a + splat8(weights[first + 6]) * g
    between = splat8(weights[first + 1]) * b + splat8(weights[first + 5]) * f
    inner_ones = splat8(weights[first + 2]) * c + splat8(weights[first + 4]) * e
    return outer + between + inner_ones + splat8(weights[first + 3]) * d


@merged
def _of_states(problem, tables, energy_tables, scratch, t, count, span):
    """The same in general, point by point."""
    n, width, z, gain, loss = problem.k.size, tables.block_k_c.shape[1], scratch.stages[_JOINED], 0.0, 0.0
    for q in range(energy_tables.gauss.shape[1]):
        for i in range(count):
            scratch.energy_sums[0, i] = scratch.values[i] * energy_tables.series[q, i]
        combine(scratch.terms, scratch.energy_sums[0], count, None, scratch.stages[_SPLIT])
        for b in range(n):
            z[b], z[n + b] = scratch.stages[_SPLIT, b], scratch.stages[_SPLIT, width + b]
        by_loads, by_damping = powers(problem, tables, t + span * energy_tables.gauss[0, q], z)
        gain += span * energy_tables.gauss[1, q] * by_loads
        loss += span * energy_tables.gauss[1, q] * by_damping
    return gain, loss
