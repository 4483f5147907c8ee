"""Flight without contact, evaluated exactly, and steps that provably miss no contact.

With ε_b = √(v_b² + k_b p_b²), which no damped block increases, M = Σ weight_b ε_b bounds |δ̈| from now on. A stop at
distance g = -δ that opens at the rate v = -δ̇ cannot be reached before

    τ = (v + √(v² + 2 M g))/M,

so steps of at most τ are safe. Close to a contact τ tends to the root from below; within reach of a Taylor
polynomial of order 6 the root is found on that polynomial, which is exact to rounding there.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.compiled.kernels import copy, dot, indentation, inlined, inner, merged
from solvers.compiled.state import SAMPLED, STEPS, T, rate_tolerance, surface_tolerance
from solvers.exponential.energy.balance import account_output, account_state
from solvers.exponential.flight import (
    ORDER,
    SERIES_REACH,
    acceleration_bound_split,
    add_signals,
    cell_of,
    cross_cell,
    energy_norms,
    fly_series,
    level_within,
    motion_of_stop,
    propagate_blocks,
    propagate_split,
    taylor_step,
    taylor_terms,
)

_REFRESH = 8  # flight steps between two evaluations of the bound


@inner
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
def _acceleration_bound(problem, tables, s, norms, signal_bounds, horizon):
    """M: bound of |δ̈| of stop s over the horizon, signals included."""
    n = problem.k.size
    total = dot(tables.acceleration_weight[s], norms, n)
    for j in range(problem.table_dt.size):
        load = problem.table_load[j]
        growth = dot(tables.acceleration_weight[s], tables.load_norm[load], n)
        total += signal_bounds[j] * (horizon * growth + abs(tables.load_acceleration[s, load]))
    return total


@inlined
def _safe(g, v, bound):
    """Time before which a stop at distance g, opening at v, cannot be reached."""
    if bound <= 0.0:
        return g / -v if v < 0.0 else np.inf
    root = math.sqrt(v * v + 2.0 * bound * max(g, 0.0))
    return (v + root) / bound if v >= 0.0 else 2.0 * max(g, 0.0) / (root - v)


@inner
def _first_root(problem, terms, s, x, longest, values, slopes):
    """First time in [0, longest] at which δ becomes positive on the Taylor polynomial; -1 if it does not.

    ``values`` and ``slopes`` are scratch for the coefficients of the polynomial and of its derivative.
    """
    factorial = 1.0
    for i in range(ORDER + 1):
        values[i] = dot(problem.read[s], terms[i], 2 * problem.k.size) / factorial
        factorial *= i + 1.0
    values[0] -= problem.gap[s]
    if abs(values[0]) <= surface_tolerance(problem, s, x):
        values[0] = 0.0
        if abs(values[1]) <= rate_tolerance(problem, s, x):
            values[1] = 0.0  # at rest on the surface: the acceleration decides
    if values[0] >= 0.0 and (values[1] > 0.0 or (values[1] == 0.0 and values[2] > 0.0)):
        return 0.0
    end = longest
    if values[1] > 0.0 and _horner(values, longest)[1] < 0.0:  # δ has its maximum inside
        for i in range(ORDER):
            slopes[i] = (i + 1.0) * values[i + 1]
        slopes[ORDER] = 0.0
        end = _bisect(slopes, -1.0, longest, -0.5 * values[1] / values[2])
    if not _horner(values, end)[0] > 0.0:
        return -1.0
    square = values[1] * values[1] - 4.0 * values[0] * values[2]
    return _bisect(values, 1.0, end, -2.0 * values[0] / (values[1] + math.sqrt(max(square, 0.0))))


@inlined
def _horner(coefficients, x):
    """Value and slope of a polynomial at x."""
    value, slope = coefficients[ORDER], 0.0
    for i in range(ORDER - 1, -1, -1):
        slope = slope * x + value
        value = value * x + coefficients[i]
    return value, slope


@inner
def _bisect(coefficients, sign, b, guess):
    """Sign change of a polynomial in [0, b], to rounding, by Newton's method with bisection as safeguard.

    A step doubles the digits, so after one of 1e-11 the error is rounding. A double root is found to 1e-8 at best.
    """
    a, x = 0.0, guess if 0.0 < guess < b else b
    for _ in range(60):
        f, slope = _horner(coefficients, x)
        if sign * f > 0.0:
            b = x
        else:
            a = x
        following = x - (f / slope if slope != 0.0 else np.inf)
        if not a < following < b:
            following = 0.5 * (a + b)
        if abs(following - x) <= 1e-11 * x:
            return following
        x = following
    return x


@inlined
def _target(tables, t, first, second, t_end):
    """Where a step must end: at an output time unless that is near enough to be evaluated from the step's start."""
    if tables.fastest * (first - t) > SERIES_REACH:
        return min(first, t_end)
    return t_end if tables.fastest * (second - first) <= SERIES_REACH else min(second, t_end)


@inner
def _sample(problem, tables, energy_tables, state, scratch, t, out, due):
    """Write the outputs that are due within the step that began at t with the state in ``scratch.x_new``."""
    while due[state.count[SAMPLED]] < state.now[T]:
        wanted = due[state.count[SAMPLED]]
        parts = max(1, int(np.ceil(tables.fastest * (wanted - t) / SERIES_REACH)))
        for i in range(parts):
            span = (wanted - t) / parts
            fly_series(problem, scratch.x_new, t + i * span, span, scratch.terms[0], scratch.signal_terms)
        copy(scratch.x_new, out[state.count[SAMPLED]], state.x.size)
        if energy_tables.active > 0.0:
            account_output(problem, tables, energy_tables, state, scratch, wanted, out[state.count[SAMPLED]])
        state.count[SAMPLED], t = state.count[SAMPLED] + 1, wanted


@inner
def _fly_tabulated(problem, tables, state, scratch, most, budget):
    """Tabulated steps without signals or output, until a stop is near, or the time ``most`` or the budget is used up.

    p and v of the blocks are in two arrays, eight numbers a vector. Returns (time flown, steps, safe time left).
    """
    n, x, flown, count = problem.k.size, scratch.split_state, 0.0, 0
    for b in range(n):
        x[0, b], x[1, b] = state.x[b], state.x[n + b]
    while True:
        span = most - flown
        for s in range(problem.gap.size):
            if count % _REFRESH == 0:
                scratch.per_stop[s] = acceleration_bound_split(tables, s, x)
            delta, rate = motion_of_stop(tables, s, x)
            span = min(span, _safe(problem.gap[s] - delta, -rate, scratch.per_stop[s]))
        if span < tables.flight_step[tables.flight_step.size - 1] or count >= budget:
            break
        level = level_within(tables, span)
        propagate_split(tables, level, x)
        flown, count = flown + tables.flight_step[level], count + 1
    for b in range(n):
        state.x[b], state.x[n + b] = x[0, b], x[1, b]
    return flown, count, span


@inlined
def _safe_span(problem, tables, state, scratch, span, rest, renew):
    """``span``, or the time within which no stop can be reached; ``renew`` the bounds of |δ̈| for the time ``rest``."""
    if renew:
        energy_norms(problem, state.x, scratch.norms)
        for s in range(problem.gap.size):
            scratch.per_stop[s] = _acceleration_bound(problem, tables, s, scratch.norms, scratch.signal_bounds, rest)
    for s in range(problem.gap.size):
        g, v = -indentation(problem, s, state.x), -dot(problem.read_rate[s], state.x, 2 * problem.k.size)
        span = min(span, _safe(g, v, scratch.per_stop[s]))
    return span


@merged
def _fly_step(problem, tables, state, scratch, span, target, rest, offset, cell, dt_cell):
    """Move by up to ``span``: Taylor step that looks for roots, whole cell, or table. (time, stop reached or -1)."""
    size, now, stop = 2 * problem.k.size, state.now, -1
    sampled, shortest = problem.table_dt.size > 0, tables.flight_step[tables.flight_step.size - 1]
    if span < shortest:
        taylor_terms(problem, state.x, now[T], scratch.terms, scratch.signal_terms)
        h = min(shortest, target - now[T], rest)
        for s in range(problem.gap.size):
            root = _first_root(problem, scratch.terms, s, state.x, h, scratch.values, scratch.trial)
            if root >= 0.0:
                h, stop = root, s
        taylor_step(scratch.terms, state.x, h, size, scratch.values, scratch.stages[0])
    elif span == rest and abs(offset) < 1e-7 * dt_cell:
        h = rest
        cross_cell(problem, tables, state.x, cell)
    elif sampled and tables.fastest * span <= SERIES_REACH:
        h = span
        fly_series(problem, state.x, now[T], h, scratch.terms[0], scratch.signal_terms)
    else:
        level = level_within(tables, span)
        h = tables.flight_step[level]
        propagate_blocks(problem, tables.flight_propagator[level, 0], tables.flight_propagator[level, 1], state.x)
        if sampled:
            add_signals(problem, tables.signal[level], state.x, now[T], scratch.signal_terms)
    return h, stop


@merged
def fly(problem, tables, energy_tables, state, scratch, t_end, budget, out, due):
    """Fly until a stop is reached (returns its index), the end (-1), or the budget is spent (-2)."""
    now, sampled, with_energy = state.now, problem.table_dt.size > 0, energy_tables.active > 0.0
    dt_cell = problem.table_dt[0] if sampled else np.inf
    for count in range(budget):
        if due[state.count[SAMPLED]] <= now[T]:
            copy(state.x, out[state.count[SAMPLED]], state.x.size)
            if with_energy:
                account_output(problem, tables, energy_tables, state, scratch, now[T], out[state.count[SAMPLED]])
            state.count[SAMPLED] += 1
        if now[T] >= t_end:
            return -1

        # --- the time up to the next output, the end, or the end of the signals' cell
        first = due[state.count[SAMPLED]]
        second = due[min(state.count[SAMPLED] + 1, out.shape[0])]
        target = _target(tables, now[T], first, second, t_end)
        begin, span, rest, offset, cell = now[T], target - now[T], np.inf, 0.0, 0
        if sampled:
            cell, offset = cell_of(problem, now[T])
            rest = max(dt_cell - offset, 1e-9 * dt_cell)
            for j in range(problem.table_dt.size):
                scratch.signal_bounds[j] = _signal_bound(problem, j, cell)
        # --- the time within which no stop can be reached
        if first == np.inf and not sampled:  # no output and no cell ends before
            flown, steps, span = _fly_tabulated(problem, tables, state, scratch, span, budget)
            now[T] += flown
            state.count[STEPS] += steps
            if steps >= budget:
                return -2
        else:
            span = min(span, rest)
            if first <= begin + span:
                copy(state.x, scratch.x_new, state.x.size)
            span = _safe_span(problem, tables, state, scratch, span, rest, sampled or count % _REFRESH == 0)
        h, stop = _fly_step(problem, tables, state, scratch, span, target, rest, offset, cell, dt_cell)
        now[T] = target if now[T] + h >= target else now[T] + h
        state.count[STEPS] += 1
        if first < now[T]:
            _sample(problem, tables, energy_tables, state, scratch, begin, out, due)
        if with_energy and sampled and cell_of(problem, now[T])[0] != cell:
            account_state(problem, tables, energy_tables, state, scratch)
        if stop >= 0:
            return stop
    return -2
