"""The Runge–Kutta step of a landing: DOP853 with t among the unknowns; the variables are explained in `landing`."""

from __future__ import annotations

import math

import numpy as np
from numba import types

from solvers.compiled.dop853_tableau import STAGES, A
from solvers.compiled.kernels import (
    REAL,
    VECTOR,
    add_friction,
    add_push,
    call_force,
    copy,
    delta_of,
    indentation,
    indentation_and_rate,
    indentation_rate,
    inner,
    law_forces,
    merged,
    no_friction,
    off_knots,
    radius_of,
    raised,
    rows_at,
    rubs,
    table_value,
    width_of,
    work_column,
)
from solvers.compiled.parts import LANDING_STEP, part
from solvers.compiled.simd import WIDTH, load8, splat8, store8
from solvers.compiled.state import T
from solvers.compiled.sums import combine
from solvers.exponential.contact.crossings import power_force
from solvers.exponential.contact.node_response import BATCH, LANDED, SHORT, START
from solvers.exponential.energy.quadrature import powers
from solvers.exponential.tables import EXPONENT, FORCE

INDENTATION, ROOT, TIME, SINCE = range(4)
MIDPOINT = np.array([[0.0, 0.0], [0.5, 0.0], [0.0, 1.0]])
CLASSICAL = np.array([np.zeros(4), [0.5, 0, 0, 0], [0, 0.5, 0, 0], [0, 0, 1.0, 0], np.array([1, 2, 2, 1]) / 6.0])
_CHOICE = types.boolean, types.int64, types.int64, types.int64  # with_energy, count, variable, stop


@inner
def _force_of_law(run, s, delta, delta_dot, side, batch):
    """Force, N, of stop s by its law's compiled function, which is evaluated within its segment, not on a knot.

    A law cut at zero is taken without the cut if the step begins on its pushing side, ``side`` > 0, else as zero.
    """
    problem, tables = run.problem, run.tables
    entry_rate = run.state.entry_rate[s]
    batch[0], batch[1], batch[2] = (
        off_knots(problem, s, run.state.segment[s], max(delta, problem.knots[s, 0])),
        delta_dot,
        0.0,
    )
    if tables.bend[s] != FORCE:
        law_forces(problem, s, 1, batch[0:1], batch[1:2], entry_rate, batch[2:3])
    elif side > 0.0:
        call_force(tables.uncut[s], 1, batch[0:1], batch[1:2], entry_rate, tables.uncut_parameters[s], (batch[2:3],))
    return batch[2]


@merged
def _force(run, s, delta, delta_dot, side, batch):
    """Force, N, of stop s; power laws are evaluated here, others called. No cut at zero acts within the step."""
    tables = run.tables
    if tables.power_law[s, EXPONENT] > 0.0 and (tables.bend[s] != FORCE or side > 0.0):
        return power_force(tables, s, max(delta, 0.0), delta_dot, run.state.entry_rate[s])
    return _force_of_law(run, s, delta, delta_dot, side, batch)


@merged
def _rate(run, with_energy, variable, stop, span, w, side, out):
    """Write d[state, t, u]/d(variable) × ``span`` at w = [state, t, u] into ``out``; returns the law calls."""
    problem, segment, batch = run.problem, run.state.segment, run.scratch.stages[BATCH]
    n, calls, pace = problem.k.size, 0, np.nan
    size, t = 2 * n, width_of(problem)
    for b in range(n):
        out[b] = w[n + b]
        out[n + b] = -problem.k[b] * w[b] - problem.c[b] * w[n + b]
    for j in range(problem.table_dt.size):
        value, load = table_value(problem, j, w[t]), problem.load[problem.table_load[j]]
        for e in range(size):
            out[e] += load[e] * value
    out[size], out[size + 1] = powers(run, w[t], w) if with_energy else (0.0, 0.0)
    for s in range(problem.law.size):
        force, rate, rows = 0.0, 0.0, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        if segment[s] > 0:
            if rubs(problem, s):
                rows = rows_at(problem, s, w)
                delta, rate = delta_of(radius_of(problem, s), rows)
            else:
                delta, rate = indentation_and_rate(problem, s, w)
            force = _force(run, s, delta, rate, side[s], batch)
            calls += 1
            if s == stop:
                pace = rate
            if rubs(problem, s):
                add_friction(problem, s, w[t], rows, force, out)
            else:
                add_push(problem, s, force, w, out)
        elif rubs(problem, s):
            no_friction(problem, s, out)
        work = work_column(problem, s)
        out[work], out[work + 1] = force * rate, force
    factor = span
    if variable in (ROOT, SINCE):
        kappa = run.tables.time_exponent[1 + stop]
        factor = factor * kappa * raised(w[t + 1], kappa - 1.0)
    if variable in (INDENTATION, ROOT):
        factor /= pace if segment[stop] > 0 else indentation_rate(problem, stop, w)
    for e in range(0, t, WIDTH):
        store8(out, e, load8(out, e) * splat8(factor))
    out[t] = factor
    out[t + 1] = span if variable in (ROOT, SINCE) else 0.0
    return calls


@part(LANDING_STEP, types.int64, *_CHOICE, REAL, VECTOR, VECTOR)
def landing_step(run, with_energy, count, variable, stop, span, w, side):
    """One step of ``count`` stages and length ``span`` from w to ``scratch.stages[LANDED]``; returns law calls.

    Its order is 8 with the stages of DOP853, which stay there; 2 with two of the midpoint rule or 4 with four of the
    classical method, which leave those as they are.
    """
    work = run.scratch.stages
    trial, calls = work[LANDED], 0
    stages = work if count == STAGES else work[SHORT:]
    tableau = A if count == STAGES else CLASSICAL if count == 4 else MIDPOINT
    for i in range(count):
        combine(stages, tableau[i], i, w, trial)
        counts = with_energy and tableau[count, i] != 0.0  # in the balance, whose own rates it does not change
        calls += _rate(run, counts, variable, stop, span, trial, side, stages[i])
    combine(stages, tableau[count], count, w, trial)
    return calls


@inner
def start_landing(run, stop, variable):
    """Write [state, t, u] at the start of a landing of ``stop`` into ``scratch.stages[START]``; u is 0 for `SINCE`."""
    state = run.state
    w, size, delta = run.scratch.stages[START], state.x.size, max(indentation(run.problem, stop, state.x), 0.0)
    copy(state.x, w, size)
    kappa, root = run.tables.time_exponent[1 + stop], math.sqrt(delta)
    w[size], w[size + 1] = state.now[T], root if kappa == 2.0 else delta ** (1.0 / kappa)
    if variable == SINCE:
        w[size + 1] = 0.0
