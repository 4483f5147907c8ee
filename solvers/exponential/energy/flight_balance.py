"""The energy balance of flight: tabulated steps and cells by the forms of `flight_tables`, the rest by series.

A flight is accounted for from a *mark* on: the start of the flight, the last output or, with sampled signals, the start
of the present cell. From mark to mark one form is enough, whatever steps the flight has taken.

A series reaches `SERIES_REACH` radians of the fastest block. The powers of its motion are integrated by Gauss's rule
with eight points, exact up to the power 15 of time: within a cell signals are of degree five, and their share of p of
degree seven, however rough they are.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from solvers.compiled.kernels import REAL, VECTOR, cell_ends, copy, inlined, inner, merged
from solvers.compiled.parts import ACCOUNT_FLIGHT, ACCOUNT_SERIES, ACCOUNT_STEP, part
from solvers.compiled.simd import WIDTH, load8, splat8, store8, sum8
from solvers.compiled.state import T
from solvers.exponential.contact.nodes import S
from solvers.exponential.energy.quadrature import PACE, exchanged_over
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

_MARK, _MOVING, _WITHIN = 3, 4, 5  # indices in Scratch.split_state: state at the mark, two that are moved on
_EXACT = 1e-14  # relative size of the last term of a series, as that of a series of all terms
_EXCHANGED = types.UniTuple(REAL, 2)
"""Work and damping, J. They are returned, and states are named by their index, since parts are slow with arrays."""


@inner
def start_account(run):
    """Set the mark to the state; its balance must be complete."""
    split(run.problem, run.state.x, run.scratch.split_state[_MARK])
    run.scratch.marked[0] = run.state.now[T]


@inner
def fly_within(run, place, t, span, accounted, row):
    """Move p and v at index ``place`` of ``split_state`` by ``span`` within a cell.

    If ``accounted``, the balance of ``row`` is integrated along.
    """
    problem, tables, scratch = run.problem, run.tables, run.scratch
    x = scratch.split_state[place]
    while tables.fastest * span > SERIES_REACH:
        level = level_within(tables, span)
        derive_signals(problem, t, scratch.signal_terms)
        if accounted:
            add_to_balance(problem, row, account_step(run, level, t, place))
        fly_tabulated(run, level, x, scratch.signal_terms)
        t, span = t + tables.flight_step[level], span - tables.flight_step[level]
    fly_series(run, x, t, span, scratch.signal_terms, scratch.terms)
    if accounted:
        add_to_balance(problem, row, account_series(run, span))


@inlined
def add_to_balance(problem, row, exchanged):
    """Add work and damping to the balance of ``row``."""
    row[2 * problem.k.size] += exchanged[0]
    row[2 * problem.k.size + 1] += exchanged[1]


@part(ACCOUNT_FLIGHT, types.void, REAL, VECTOR)
def account_until(run, t, row):
    """Add work and damping of the flight from the mark to t, within one cell, to the balance of ``row``."""
    scratch = run.scratch
    begin = scratch.marked[0]
    copy_split(scratch.split_state[_MARK], scratch.split_state[_MOVING])
    span = t - begin
    if run.energy_tables.closed > 0.0 and abs(span - run.energy_tables.spacing) <= _time_rounding(run, t):
        whole = run.tables.flight_step.size
        add_to_balance(run.problem, row, account_step(run, whole, begin, _MOVING))
    elif span > 0.0:
        accounted = np.bool_(1)  # a literal would be compiled for itself
        fly_within(run, _MOVING, begin, span, accounted, row)


@inner
def account_output(run, t, row):
    """Complete the balance of an output at t; without sampled signals the mark moves there."""
    problem = run.problem
    copy(run.state.x[2 * problem.k.size :], row[2 * problem.k.size :], 2)
    account_until(run, t, row)
    if problem.table_dt.size == 0:
        copy(row[2 * problem.k.size :], run.state.x[2 * problem.k.size :], 2)
        split(problem, row, run.scratch.split_state[_MARK])
        run.scratch.marked[0] = t


@inner
def account_state(run):
    """Complete the balance of the state, and set the mark there."""
    account_until(run, run.state.now[T], run.state.x)
    start_account(run)


@inlined
def copy_split(source, target):
    """Copy p and v of the blocks."""
    for i in range(0, 2 * source.shape[1], WIDTH):
        store8(target, i, load8(source, i))


@merged
def _time_rounding(run, t):
    """Difference, s, allowed between the step of the tables and the time between two outputs, or a cell."""
    return 1e-7 * run.energy_tables.spacing if run.problem.table_dt.size else 4e-16 * t


@part(ACCOUNT_STEP, _EXCHANGED, types.int64, REAL, types.int64)
def account_step(run, level, t, place):
    """Work and damping, J, of a tabulated step or whole cell from t on, of state ``place`` of ``split_state``.

    The derivatives of the signals at the start of a tabulated step are in ``scratch.signal_terms``.
    """
    problem, energy_tables, scratch = run.problem, run.energy_tables, run.scratch
    whole, n, given = level == run.tables.flight_step.size, problem.k.size, scratch.energy_sums[0]
    x = scratch.split_state[place]
    if energy_tables.closed == 0.0:
        span = energy_tables.spacing if whole else run.tables.flight_step[level]
        copy_split(x, scratch.split_state[_WITHIN])
        exchanged = _account_panels(run, scratch.split_state[_WITHIN], t, span)
        derive_signals(problem, t, scratch.signal_terms)  # which the panels have overwritten
        return exchanged
    if whole:
        _nodes_of_cell(run, t)
    count = 0
    for j in range(problem.table_dt.size):
        copy(scratch.signal_terms[j], given[count:], 6)
        count += 6
    gain, loss = _exchange_of_signals(energy_tables.pairs[level], given, count)
    for d in range(energy_tables.driver.size):
        i = energy_tables.driver[d]
        given[count] = x[0, i] if i < n else x[1, i - n]
        count += 1
    more, lost = _exchange_of_state(energy_tables.rows[level], energy_tables.plain[level], given, count, x)
    return gain + more, loss + lost


@merged
def _nodes_of_cell(run, t):
    """Write s, s', s'' of every signal at the start, then at the end of the cell of t into ``scratch.signal_terms``."""
    problem = run.problem
    for j in range(problem.table_dt.size):
        begin, end = cell_ends(problem, problem.table_start[j] + cell_of(problem, t)[0])
        copy(begin, run.scratch.signal_terms[j], 3)
        copy(end, run.scratch.signal_terms[j, 3:], 3)


@merged
def _exchange_of_signals(pairs, given, count):
    """Work and damping of the motion due to the signals alone."""
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
def _exchange_of_state(rows, plain, given, count, x):
    """Work and damping of the state x with drivers and signals, and damping of the blocks by themselves."""
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
def _account_panels(run, x, t, span):
    """Work and damping of a step without forms, by series; x is moved."""
    gain, loss = 0.0, 0.0
    panels = max(1, math.ceil(run.tables.fastest * span / SERIES_REACH - 1e-9))
    for i in range(panels):
        begin = t + i * span / panels
        fly_series(run, x, begin, span / panels, run.scratch.signal_terms, run.scratch.terms)
        more, lost = account_series(run, span / panels)
        gain, loss = gain + more, loss + lost
    return gain, loss


@part(ACCOUNT_SERIES, _EXCHANGED, REAL)
def account_series(run, span):
    """Work and damping, J, of the motion that the last `fly_series` has moved by ``span``."""
    problem, tables, scratch = run.problem, run.tables, run.scratch
    n, signals = problem.k.size, scratch.between[PACE + 1 + problem.gap.size :]
    count = _powers_of_time(tables, span, scratch.values)
    for load in range(tables.power_rows.shape[0]):
        store8(signals[load], 0, splat8(0.0))
    for j in range(problem.table_dt.size):
        value = splat8(0.0)
        for i in range(6):
            value += splat8(scratch.values[i] * scratch.signal_terms[j, i]) * load8(run.energy_tables.series[i], 0)
        store8(signals[problem.table_load[j]], 0, splat8(span) * value)
    if int(tables.own_blocks) == n and tables.loss_rows.shape[0] <= n:
        return _exchange_of_rates(run, count, span)
    store8(scratch.between[PACE], 0, splat8(span))
    width, along = tables.block_k_c.shape[1], scratch.along
    for b in range(n):
        p, v = splat8(0.0), splat8(0.0)
        for i in range(count):
            share = splat8(scratch.values[i]) * load8(run.energy_tables.series[i], 0)
            p += splat8(scratch.terms[i, b]) * share
            v += splat8(scratch.terms[i, width + b]) * share
        store8(along[b], 0, p)
        store8(along[n + b], 0, v)
    return exchanged_over(run)


@merged
def _exchange_of_rates(run, count, span):
    """The same without tones and coupling, where velocities are enough: those of eight blocks at a time."""
    tables, scratch = run.tables, run.scratch
    series, weights, width = run.energy_tables.series, tables.gauss[1], tables.block_k_c.shape[1]
    gains, losses = splat8(0.0), splat8(0.0)
    for i in range(0, width, WIDTH):
        a, b, c, d = splat8(0.0), splat8(0.0), splat8(0.0), splat8(0.0)
        e, f, g, h = splat8(0.0), splat8(0.0), splat8(0.0), splat8(0.0)
        for k in range(count):
            term = splat8(scratch.values[k]) * load8(scratch.terms[k], width + i)
            a += splat8(series[k, 0]) * term
            b += splat8(series[k, 1]) * term
            c += splat8(series[k, 2]) * term
            d += splat8(series[k, 3]) * term
            e += splat8(series[k, 4]) * term
            f += splat8(series[k, 5]) * term
            g += splat8(series[k, 6]) * term
            h += splat8(series[k, 7]) * term
        damped = _sum_of_eight(weights, (a * a, b * b, c * c, d * d, e * e, f * f, g * g, h * h))
        losses += load8(tables.block_k_c[1], i) * damped
        for load in range(tables.power_rows.shape[0]):
            signal = scratch.between[PACE + 1 + run.problem.gap.size + load]
            store8(scratch.trial, 0, load8(weights, 0) * load8(signal, 0))
            gains += load8(run.energy_tables.power[load], i) * _sum_of_eight(scratch.trial, (a, b, c, d, e, f, g, h))
    return sum8(gains), span * sum8(losses)


@inlined
def _sum_of_eight(weights, values):
    """Weighted sum of a block's values at Gauss's eight points."""
    a, b, c, d, e, f, g, h = values
    outer = splat8(weights[0]) * a + splat8(weights[7]) * h
    near = splat8(weights[1]) * b + splat8(weights[6]) * g
    between = splat8(weights[2]) * c + splat8(weights[5]) * f
    return outer + near + between + splat8(weights[3]) * d + splat8(weights[4]) * e


@inlined
def _powers_of_time(tables, span, values):
    """Write the powers of ``span`` that count in a series into ``values``; how many these are."""
    count, size, power = S + 1, 1.0, 1.0
    for i in range(S):
        size *= tables.fastest * span / (i + 1.0)
    while count < SERIES_TERMS and size > _EXACT:
        size *= tables.fastest * span / count
        count += 1
    for i in range(count):
        values[i] = power
        power *= span
    return count
