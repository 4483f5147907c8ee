"""Flight without contact, evaluated exactly, and steps that provably miss no contact.

With ε_b = √(v_b² + k_b p_b²), which no damped block increases, B = Σ weight_b ε_b bounds |δ̈| from now on. A stop at
distance g = -δ that opens at the rate v = -δ̇ cannot be reached before

    τ = (v + √(v² + 2 B g))/B,

so steps of at most τ are safe. Fast blocks make most of B and hardly move the stop. So τ is also computed with B, g
and v of the slowest blocks alone, g less the amplitude Σ r_b ε_b of all others; the longer one is taken. The slowest
are so many that the others have at most a quarter of the distance, if possible. Close to a contact τ tends to the root
from below; within reach of a Taylor polynomial of order 6 the root is found on that polynomial, which is exact to
rounding there.

Under sampled signals whole cells are crossed first. Within a cell of length h, δ exceeds the larger of its values at
both ends by at most the error of linear interpolation, which one bound e covers for the next m cells:

    e = Σ_b W_b ε_b + |s|max (A + m G)

`tables.cell_errors` derives it; |s|max is the largest Bézier coefficient of the quintics on these cells. No stop is
reached on a cell at whose ends δ + e < 0. Only where this does not hold are steps of length τ taken.

Blocks faster than the cells follow the signals. Of these ε is that of what is left, d of `tables.following`, and both
bounds have parts in |ṡ|max, |s̈|max and |s⃛|max instead. Under coupling, |ṡ|max adds to e; where ṡ and s̈ jump, so does d.
"""

from __future__ import annotations

import numpy as np

from solvers.compiled.kernels import (
    cell_ends,
    copy,
    indentation,
    indentation_rate,
    inlined,
    inner,
    is_circle,
    merged,
    row_of,
)
from solvers.compiled.state import LEFT, SAMPLED, STEPS, T_END, T, move_clock, summed
from solvers.exponential.circles.flight import circle_is_near, span_of_circle, span_of_circle_at
from solvers.exponential.energy.flight_balance import (
    account_output,
    account_state,
    account_step,
    add_to_balance,
    copy_split,
    fly_within,
    start_account,
)
from solvers.exponential.first_contact import first_root
from solvers.exponential.flight import (
    AMPLITUDE,
    BOUND,
    COUNT,
    FAST,
    SERIES_REACH,
    SWING,
    UNKNOWN,
    cell_of,
    cross_cell,
    derive_signals,
    fly_series,
    fly_tabulated,
    join,
    level_within,
    motion_of_row,
    motion_of_slowest,
    propagate_blocks,
    propagate_split,
    safe_time,
    split,
    take_off_following,
    taylor_step,
    taylor_terms,
    uses_slowest,
    weighted_norms,
)

_PART_OF_CELL = 0.01  # longest Taylor step, in cells of the signals: s⁽⁵⁾ t⁷/5040 of a quintic, left out, is rounding
_REFRESH = 8  # flight steps between two evaluations of the bound
_GROUP = 8  # cells that one bound covers: with more the bound grows, with fewer it is computed more often


@inner
def _bound_signals(run, cell, count):
    """Bounds of |s| on ``count`` cells by Bézier coefficients, each at most |s| + 2h/5 |ṡ| + h²/20 |s̈|.

    Where a bound takes them, also of |ṡ|, |s̈| and |s⃛|, by differences of the coefficients.
    """
    problem = run.problem
    for j in range(problem.table_dt.size):
        first, bounds, sides = problem.table_start[j] + cell, run.scratch.signal_bounds[j], problem.table.shape[1]
        slope, curving = 0.4 * problem.table_dt[j], 0.05 * problem.table_dt[j] ** 2
        for d in range(4):
            bounds[d] = 0.0
        for row in range(first, first + count + 1):
            for side in range(0, sides, 3):
                s, rate, curvature = problem.table[row, side : side + 3]
                bounds[0] = max(bounds[0], abs(s) + slope * abs(rate) + curving * abs(curvature))
        for row in range(first, first + count if run.tables.derived > 0.0 else first):
            begin, end = cell_ends(problem, row)
            _bound_derivatives(begin, end, problem.table_dt[j], bounds)


@inlined
def _bound_derivatives(begin, end, h, bounds):
    """Raise the bounds of |ṡ|, |s̈| and |s⃛| to those on a cell of length h, from s, ṡ and s̈ at its ends."""
    s, rate, curvature = begin[0], begin[1], begin[2]  # of two-sided tables `begin` goes on
    to, rate_to, curvature_to = end[0], end[1], end[2]
    a, b = s + 0.2 * h * rate, s + 0.4 * h * rate + 0.05 * h * h * curvature
    c, d = to - 0.4 * h * rate_to + 0.05 * h * h * curvature_to, to - 0.2 * h * rate_to
    steps = a - s, b - a, c - b, d - c, to - d
    for i in range(5):
        bounds[1] = max(bounds[1], 5.0 / h * abs(steps[i]))
    for i in range(4):
        bounds[2] = max(bounds[2], 20.0 / (h * h) * abs(steps[i + 1] - steps[i]))
    for i in range(3):
        third = steps[i + 2] - 2.0 * steps[i + 1] + steps[i]
        bounds[3] = max(bounds[3], 60.0 / (h * h * h) * abs(third))


@inlined
def _acceleration_bound(run, r, swing, horizon):
    """B: bound of |δ̈| of row r over the time ``horizon``, signals included; ``swing`` is what does not follow them."""
    tables = run.tables
    total = weighted_norms(tables.acceleration_weight[r], tables, swing)
    for j in range(run.problem.table_dt.size):
        factors, bounds = tables.acceleration_signal[r, run.problem.table_load[j]], run.scratch.signal_bounds[j]
        total += bounds[0] * (factors[0] + horizon * factors[1]) + bounds[1] * factors[2] + bounds[2] * factors[3]
        total += horizon * bounds[3] * factors[4]
    return total


@inlined
def _target(run, first):
    """Time at which a step must end: the end, or an output time too late to be evaluated from the step's start."""
    state = run.state
    t_end, second = state.now[T_END], state.due[min(state.count[SAMPLED] + 1, state.out.shape[0])]
    if run.tables.fastest * (first - state.now[T]) > SERIES_REACH:
        return min(first, t_end)
    return t_end if run.tables.fastest * (second - first) <= SERIES_REACH else min(second, t_end)


@inner
def _sample(run, t):
    """Write the outputs due within the step that began at t; ``split_state[2]``, the motion then, moves along.

    With sampled signals the energy balance of the state is that at t, and is integrated along; otherwise
    `account_output` computes it.
    """
    problem, state = run.problem, run.state
    size, with_energy, before = 2 * problem.k.size, run.energy_tables.active > 0.0, state.x
    accounted = with_energy and problem.table_dt.size > 0
    while state.due[state.count[SAMPLED]] < state.now[T]:
        wanted, row = state.due[state.count[SAMPLED]], state.out[state.count[SAMPLED]]
        copy(before[size:], row[size:], state.x.size - size)
        fly_within(run, 2, t, wanted - t, accounted, row)
        join(problem, run.scratch.split_state[2], row)
        if accounted:
            before = row
        elif with_energy:
            account_output(run, wanted, row)
        state.count[SAMPLED], t = state.count[SAMPLED] + 1, wanted


@merged
def _sample_here(run):
    """Write the output that is due in the present state."""
    state = run.state
    row = state.out[state.count[SAMPLED]]
    copy(state.x, row, state.x.size)
    if run.energy_tables.active > 0.0:
        account_output(run, state.now[T], row)
    state.count[SAMPLED] += 1


@inlined
def _safe_by_slowest(run, row, x):
    """Safe time by the slowest blocks alone, the others being bounded by their amplitude; 0 if that tells nothing."""
    slow = run.scratch.slow[row]
    delta, rate = motion_of_slowest(run, row, x)
    distance = -delta - slow[AMPLITUDE]
    return safe_time(distance, -rate, slow[BOUND]) if distance > 0.0 else 0.0


@inlined
def _safe_flight(run, x, span, renew_bounds):
    """``span``, or the shorter time within which no stop can be reached from x without signals."""
    problem, tables, scratch = run.problem, run.tables, run.scratch
    for r in range(problem.gap.size if renew_bounds else 0):
        scratch.per_row[r] = weighted_norms(tables.acceleration_weight[r], tables, x)
        scratch.slow[r, COUNT] = UNKNOWN
    for s in range(problem.law.size):
        if is_circle(problem, s):
            span = min(span, span_of_circle(run, s, x))
            continue
        row = row_of(problem, s)
        delta, rate = motion_of_row(run, row, x)
        time = safe_time(-delta, -rate, scratch.per_row[row])
        if time < span:
            if time * tables.fastest > FAST and uses_slowest(run, row, x, -delta):
                time = max(time, _safe_by_slowest(run, row, x))
            span = min(span, time)
    return span


@inner
def _fly_unsampled(run, longest, budget):
    """Tabulated steps without signals or output, until a stop is near, ``longest`` has passed or the budget is spent.

    Returns the number of steps, and the safe time left.
    """
    problem, tables, state = run.problem, run.tables, run.state
    x, flown, rounding, count = run.scratch.split_state[0], 0.0, 0.0, 0
    split(problem, state.x, x)
    while True:
        span = _safe_flight(run, x, longest - flown, count % _REFRESH == 0)
        if span < tables.flight_step[tables.flight_step.size - 1] or count >= budget:
            break
        level = level_within(tables, span)
        propagate_split(tables, level, x)
        flown, rounding = summed(flown, rounding, tables.flight_step[level])
        count += 1
    join(problem, x, state.x)
    state.now[LEFT] += rounding
    move_clock(state.now, flown)
    state.count[STEPS] += count
    return count, span


@inlined
def _bound_cells(run, x, cell, count):
    """Bound the interpolation errors e of all rows for the next ``count`` cells; returns whether a stop may be near."""
    problem, tables, scratch = run.problem, run.tables, run.scratch
    _bound_signals(run, cell, count)
    copy_split(x, scratch.split_state[SWING])
    if tables.follows > 0.0:
        take_off_following(run, cell * problem.table_dt[0])
    for r in range(problem.gap.size):
        error = weighted_norms(tables.cell_error[r], tables, scratch.split_state[SWING])
        for j in range(problem.table_dt.size):
            factors, bounds = tables.cell_error_signal[r, problem.table_load[j]], scratch.signal_bounds[j]
            error += bounds[0] * (factors[0] + count * factors[1]) + bounds[2] * factors[2]
            error += bounds[3] * (factors[3] + count * factors[4]) + bounds[1] * factors[5]
            error += count * (bounds[1] * factors[6] + bounds[2] * factors[7])
        scratch.per_row[r] = error
    return _is_any_near(run, x)


@inlined
def _is_any_near(run, x):
    """Whether any stop may be reached within a cell that ends in x, by its error e; also if the state is not finite."""
    problem = run.problem
    near = False
    for s in range(problem.law.size):
        row = row_of(problem, s)
        if is_circle(problem, s):
            near |= circle_is_near(run, s, x)
        else:
            near |= not motion_of_row(run, row, x)[0] + run.scratch.per_row[row] < 0.0
    return near


@merged
def _cross_cells(run, most):
    """Cross whole cells while no stop is near; returns how many, ``most`` at most."""
    problem, energy_tables, state, scratch = run.problem, run.energy_tables, run.state, run.scratch
    h, x, current, now, with_energy = problem.table_dt[0], scratch.split_state, 0, state.now, energy_tables.active > 0.0
    begin, offset = cell_of(problem, now[T])
    end = min(int(now[T_END] / h), begin + most, problem.table_start[1] - problem.table_start[0] - 1)
    cell, bounded = begin, begin
    if abs(offset) < 1e-7 * h:
        split(problem, state.x, x[0])
        if with_energy:
            account_state(run)
        while cell < end:
            if cell == bounded:
                bounded = min(cell + _GROUP, end)
                if _bound_cells(run, x[current], cell, bounded - cell):
                    break
            cross_cell(run, x[current], cell, x[1 - current])
            if _is_any_near(run, x[1 - current]):
                break
            cell += 1
            if state.due[state.count[SAMPLED]] < cell * h:
                now[T] = min(cell * h, now[T_END])
                copy_split(x[current], x[2])
                _sample(run, (cell - 1) * h)
            if with_energy:
                whole, begin_of_cell = run.tables.flight_step.size, (cell - 1) * h
                exchanged = account_step(run, whole, begin_of_cell, current)
                add_to_balance(problem, state.x, exchanged)
            current = 1 - current
        if cell > begin:
            join(problem, x[current], state.x)
            now[T] = min(cell * h, now[T_END])
            state.count[STEPS] += cell - begin
            if with_energy:
                start_account(run)
    return cell - begin


@inlined
def _safe_under_signals(run, span, horizon):
    """The same under sampled signals, with bounds of |δ̈| for the ``horizon``, from the present state."""
    problem, state, scratch = run.problem, run.state, run.scratch
    split(problem, state.x, scratch.split_state[SWING])
    if run.tables.follows > 0.0:
        take_off_following(run, state.now[T])
    for r in range(problem.gap.size):
        scratch.per_row[r] = _acceleration_bound(run, r, scratch.split_state[SWING], horizon)
    for s in range(problem.law.size):
        if is_circle(problem, s):
            span = min(span, span_of_circle_at(run, s))
            continue
        g, v = -indentation(problem, s, state.x), -indentation_rate(problem, s, state.x)
        span = min(span, safe_time(g, v, scratch.per_row[row_of(problem, s)]))
    return span


@inlined
def _place_in_cell(problem, t):
    """(cell of the sampled signals, time since its begin, time to its end, s) at t; (0, 0, inf) without signals."""
    cell, offset, rest = 0, 0.0, np.inf
    if problem.table_dt.size > 0:
        cell, offset = cell_of(problem, t)
        rest = max(problem.table_dt[0] - offset, 1e-9 * problem.table_dt[0])
    return cell, offset, rest


@merged
def _fly_step(run, span, target, place):
    """Move by up to ``span``: Taylor step with a search for roots, whole cell, or table. (time, stop or -1).

    ``place`` is the `_place_in_cell` of the start.
    """
    problem, tables, state, scratch = run.problem, run.tables, run.state, run.scratch
    size, now, stop, x = 2 * problem.k.size, state.now, -1, scratch.split_state
    sampled, (cell, offset, rest) = problem.table_dt.size > 0, place
    dt_cell = problem.table_dt[0] if sampled else np.inf
    shortest = min(tables.flight_step[tables.flight_step.size - 1], _PART_OF_CELL * dt_cell)
    if span < shortest:
        taylor_terms(problem, state.x, now[T], scratch.terms, scratch.signal_terms)
        h = min(shortest, target - now[T], rest)
        for s in range(problem.law.size):
            root = first_root(problem, scratch.terms, s, state.x, h, scratch.values, scratch.trial)
            if root >= 0.0:
                h, stop = root, s
        taylor_step(scratch.terms, state.x, h, size, scratch.values, scratch.stages[0])
    elif span == rest and abs(offset) < 1e-7 * dt_cell:
        h = rest
        split(problem, state.x, x[0])
        cross_cell(run, x[0], cell, x[1])
        join(problem, x[1], state.x)
    elif sampled and tables.fastest * span <= SERIES_REACH:
        h = span
        split(problem, state.x, x[0])
        fly_series(run, x[0], now[T], h, scratch.signal_terms, scratch.terms)
        join(problem, x[0], state.x)
    else:
        level = level_within(tables, span)
        h = tables.flight_step[level]
        if sampled:
            split(problem, state.x, x[0])
            derive_signals(problem, now[T], scratch.signal_terms)
            fly_tabulated(run, level, x[0], scratch.signal_terms)
            join(problem, x[0], state.x)
        else:
            propagate_blocks(problem, tables.flight_propagator[level, 0], tables.flight_propagator[level, 1], state.x)
    return h, stop


@merged
def fly(run, budget):
    """Fly until a stop is reached (returns its index), to the end (-1), or until the budget is spent (-2)."""
    problem, state = run.problem, run.state
    now, due = state.now, state.due
    sampled, with_energy, count = problem.table_dt.size > 0, run.energy_tables.active > 0.0, 0
    while count < budget:
        if sampled:
            count += _cross_cells(run, budget - count)
        if due[state.count[SAMPLED]] <= now[T]:
            _sample_here(run)
        if now[T] >= now[T_END]:
            return -1

        # --- the time up to the next output, the end, or the end of the signals' cell
        first = due[state.count[SAMPLED]]
        target = _target(run, first)
        begin, span, place = now[T], target - now[T], _place_in_cell(problem, now[T])
        cell, _, rest = place
        if sampled:
            _bound_signals(run, cell, 1)
        # --- the time within which no stop can be reached
        if first == np.inf and not sampled:  # neither outputs nor cells limit the steps
            steps, span = _fly_unsampled(run, span, budget)
            if steps >= budget:
                return -2
        else:
            span = min(span, rest)
            if first <= begin + span:
                if with_energy and sampled:
                    account_state(run)
                split(problem, state.x, run.scratch.split_state[2])
            if sampled:
                span = _safe_under_signals(run, span, rest)
            else:
                x = run.scratch.split_state[SWING]
                split(problem, state.x, x)
                span = _safe_flight(run, x, span, count % _REFRESH == 0)
        h, stop = _fly_step(run, span, target, place)
        move_clock(now, h)
        now[T] = min(now[T], target)
        state.count[STEPS] += 1
        count += 1
        if first < now[T]:
            _sample(run, begin)
        if with_energy and sampled and cell_of(problem, now[T])[0] != cell:
            account_state(run)
        if stop >= 0:
            return stop
    return -2
