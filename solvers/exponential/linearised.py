"""Derivative of a run of `method`, step by step along its event record.

Every accepted contact step is linearised as it was taken. With Y the derivative of the state at fixed time,

    flight   Y ← E(t) Y                                            (exact)
    entry    dt* = -dδ/δ̇,  d(entry rate) = dδ̇ + δ̈ dt*              (latched until the exit)
    border   dt* = -db/ḃ,  dL ← m_L dL + m_δ (dδ + δ̇ dt*) + m_δ̇ (dδ̇ + δ̈ dt*)   (numbers L that a law latches)
    jump     Y ← Y - b ΔF dt*                                      (saltation: the law's force jumps by ΔF)
    step     (1 - D C) dF = D (free response of Y) + ∂F/∂(entry rate) d(entry rate),   Y ← E(h) Y + response to dF
    landing  the variational equation, on the stages of the Runge–Kutta step

On the first step of a power law with a broken exponent the force is t^p times a smooth function of √t, with t from the
entry on. Its derivative at fixed time is singular there; so that step is linearised in a frame that moves with the
entry, Y + f dt* with f the rate of the state, and transformed back at its end.

A parameter adds a column. Where it changes only loads' tones, gaps and laws, Y_p = W + P(t) with P the derivative of
the steady response to the tones, known in closed form at any time, so that W obeys the equations above with P among the
indentations; laws contribute ∂F/∂parameter. See Leine, Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical
Systems, 2004, Chapter 7, for saltation. At an entry of zero rate (to rounding) the derivative does not exist; dt* is
taken as zero there.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numba import types

from solvers.compiled.dop853_tableau import STAGES, A
from solvers.compiled.kernels import (
    PLANAR_PROBLEM,
    PROBLEM,
    acceleration_of,
    add_push,
    add_tangential,
    call_force,
    call_gradient,
    contact_forces,
    contact_gradient,
    copy,
    entry,
    force_at,
    indentation,
    indentation_rate,
    inner,
    is_circle,
    merged,
    rhs,
    rubs,
    slider_of,
)
from solvers.compiled.packed import unpacker
from solvers.compiled.sliding import is_held, normal_force
from solvers.compiled.state import (
    BEGAN,
    ENDED,
    EVENT,
    FIRST,
    HEAD,
    KIND,
    LANDING,
    LAST_EVENT,
    RECORDED,
    RENEWAL,
    SECOND,
    SPAN,
    STATE,
    T,
    begin_contacts,
    rate_tolerance,
)
from solvers.compiled.sums import combine
from solvers.exponential.circles.derivative import add_radial_change, change_of, is_parameter, row_change
from solvers.exponential.circles.friction import friction_by_normal
from solvers.exponential.circles.friction_derivative import (
    add_rubbing_change,
    begin_rubbing,
    end_rubbing,
    latch_begin,
    pass_slider,
)
from solvers.exponential.contact.crossings import side_at
from solvers.exponential.contact.landing_step import landing_step, start_landing
from solvers.exponential.contact.node_response import LANDED, START
from solvers.exponential.energy.flight_tables import ENERGY_TABLES
from solvers.exponential.linearised_border import pass_border
from solvers.exponential.linearised_step import (
    DERIVATIVES,
    VARIATION,
    Linearised,
    by_latched,
    change_by_latched,
    linearise_step,
)
from solvers.exponential.preparation import SCRATCH, TABLES, Run
from solvers.exponential.responses import propagate
from solvers.exponential.tables import FORCE
from solvers.problem.friction import CODE, FREE, SLIDES

_OFF = 1e-10  # relative distance from a knot at which a law is evaluated on one side of it


_problem, _planar_problem = unpacker(PROBLEM), unpacker(PLANAR_PROBLEM)
_tables, _state, _scratch = unpacker(TABLES), unpacker(STATE), unpacker(SCRATCH)
_energy_tables = unpacker(ENERGY_TABLES)
_derivatives, _variation = unpacker(DERIVATIVES), unpacker(VARIATION)


@inner
def _fly(problem, duration, y):
    """Move all columns over a flight."""
    n = problem.k.size
    for b in range(n):
        alpha, beta = propagate(problem.k[b], problem.c[b], duration)
        for c in range(y.shape[0]):
            p, v = y[c, b], y[c, n + b]
            y[c, b] = alpha * p + beta * v
            y[c, n + b] = alpha * v - beta * (problem.k[b] * p + problem.c[b] * v)


@merged
def _begin(run):
    """Set the segments of the stops as at the start of the run, and the derivatives of the latched entry rates."""
    problem, past, scratch, derivatives = run.problem, run.past, run.scratch, run.derivatives
    for s in range(problem.law.size):
        if rubs(problem, s):
            scratch.slider_code[s] = slider_of(problem, s)[CODE]
    begin_contacts(problem, past)
    for s in range(problem.law.size):
        if past.segment[s] > 0:
            rate = indentation_rate(problem, s, past.x)
            for c in range(derivatives.y.shape[0]):
                change = change_of(run, past.x, c, s, 1, 0.0)
                derivatives.entry[c, s] = 0.0 if abs(rate) < problem.floor[s] else np.sign(rate) * change
            if rubs(problem, s) and scratch.slider_code[s] == FREE:
                latch_begin(run, s)


@merged
def _cross_knot(run, s, direction):
    """Take all columns across a border of the segment of stop s, upwards (direction 1) or downwards (-1)."""
    problem, past, derivatives = run.problem, run.past, run.derivatives
    t = past.now[T]
    rate = indentation_rate(problem, s, past.x)
    segment = past.segment[s]
    entering = segment == 0
    border = segment if direction > 0 else segment - 1
    rhs(problem, t, past.x, past.segment, past.entry_rate, derivatives.rate[0], derivatives.batch)
    acceleration = acceleration_of(problem, s, past.x, derivatives.rate[0])
    rate_rounding = rate_tolerance(problem, s, past.x)
    if entering:
        past.entry_rate[s] = max(abs(rate), problem.floor[s])
    below, above = problem.knots[s, border] * (1.0 - _OFF), problem.knots[s, border] * (1.0 + _OFF) + 1e-300
    jump = force_at(problem, s, above, rate, past.entry_rate[s], derivatives.batch)
    if border > 0:
        jump -= force_at(problem, s, below, rate, past.entry_rate[s], derivatives.batch)
    jump *= direction
    past.now[LAST_EVENT] = t
    held, friction_jump = False, 0.0
    if rubs(problem, s) and border > 0 and segment + direction > 0:
        knot, entry_rate = problem.knots[s, border], past.entry_rate[s]
        held = is_held(problem, s, entry_rate, segment, segment + direction, knot, rate)
        if not held:
            normal = normal_force(problem, s, segment, entry_rate, knot, rate)
            friction_jump = friction_by_normal(slider_of(problem, s)) * max(jump, -max(normal, 0.0))
    for c in range(derivatives.y.shape[0]):
        d_delta = change_of(run, past.x, c, s, 0, t)
        derivatives.shift[c, problem.law.size] = -d_delta / rate if abs(rate) > rate_rounding else 0.0
    if rubs(problem, s) and held:  # by the motion before the knot
        pass_slider(run, s, np.int64(SLIDES))
    for c in range(derivatives.y.shape[0]):
        shift = derivatives.shift[c, problem.law.size]
        if entering:
            floored = abs(rate) < problem.floor[s]
            change = change_of(run, past.x, c, s, 1, t) + acceleration * shift
            derivatives.shift[c, s] = shift
            derivatives.entry[c, s] = 0.0 if floored else change
        add_push(problem, s, -jump * shift, past.x, derivatives.y[c])
        if rubs(problem, s) and friction_jump != 0.0:
            add_tangential(problem, s, -friction_jump * shift, past.x, derivatives.y[c])
    past.segment[s] += direction
    if rubs(problem, s) and entering:
        begin_rubbing(run, s)
    elif rubs(problem, s) and past.segment[s] == 0:
        end_rubbing(run, s)


@merged
def _inside_segment(run, s, x):
    """Indentation, m, kept off the knots, where the slope of the law could be that of the next segment."""
    problem, past = run.problem, run.past
    lower, upper = problem.knots[s, past.segment[s] - 1], problem.knots[s, past.segment[s]]
    return min(max(indentation(problem, s, x), lower * (1.0 + _OFF)), upper * (1.0 - _OFF))


@inner
def _update_sides(run, x):
    """Force before its cut in a state of a landing, for laws cut at zero force, into ``scratch.before_cut``.

    Where a landing begins or ends the force may be zero, or rounding; so the force of larger size is kept. Returns
    whether the side of a law has changed by this.
    """
    past, scratch, changed = run.past, run.scratch, False
    for s in range(run.problem.law.size):
        if past.segment[s] > 0 and run.tables.bend[s] == FORCE:
            force, before = side_at(run.here, s, x, scratch.trial), scratch.before_cut[s]
            if abs(force) > abs(before):
                changed |= (force > 0.0) != (before > 0.0)
                scratch.before_cut[s] = force
    return changed


@merged
def _gradient(run, s, batch):
    """Derivatives of a law at one stage of a landing, on the side of its bend on which the landing began."""
    problem, tables = run.problem, run.tables
    d, v, rate = batch[0:1], batch[1:2], run.past.entry_rate[s]
    if tables.bend[s] != FORCE:
        contact_gradient(problem, s, d, v, rate, batch[2:3], batch[3:4], batch[4:5])
    elif run.scratch.before_cut[s] > 0.0:
        batch[0] = max(batch[0], problem.knots[s, 0])
        results = batch[2:3], batch[3:4], batch[4:5]
        call_gradient(tables.uncut_gradient[s], 1, d, v, rate, tables.uncut_parameters[s], results)
    else:
        batch[2], batch[3], batch[4] = 0.0, 0.0, 0.0


@merged
def _force_of_side(run, side, uncut, s, batch, force):
    """Force of a law at another value of the parameter, cut at zero where the landing is beyond the law's bend.

    Where it lands on the bend either value of the parameter may be on either side.
    """
    d, v, rate = batch[0:1], batch[1:2], run.past.entry_rate[s]
    force[0] = 0.0
    if run.tables.bend[s] != FORCE:
        contact_forces(side, s, d, v, rate, force)
    elif run.scratch.before_cut[s] > 0.0:
        call_force(run.tables.uncut[s], 1, d, v, rate, uncut, (force,))


@merged
def _stage_rates(run, w, factor, out):
    """Rates of all columns at one stage of a landing; ``w`` is its state and time, ``factor`` is dt along the step."""
    problem, past, derivatives, variation = run.problem, run.past, run.derivatives, run.variation
    n, t, batch = problem.k.size, w[past.x.size], derivatives.batch
    for c in range(derivatives.y.shape[0]):
        y = derivatives.trial[c]
        for b in range(n):
            out[c, b] = factor * y[n + b]
            out[c, n + b] = factor * (-problem.k[b] * y[b] - problem.c[b] * y[n + b])
    for s in range(problem.law.size):
        if past.segment[s] == 0:
            continue
        rate, force = past.entry_rate[s], 0.0
        if is_circle(problem, s):
            delta = _inside_segment(run, s, w)
            force = force_at(problem, s, delta, indentation_rate(problem, s, w), rate, batch)
        batch[0], batch[1] = _inside_segment(run, s, w), indentation_rate(problem, s, w)
        _gradient(run, s, batch)
        by_latched(run, s, 1, batch[0:1], batch[1:2])
        by_law, laws_change = 0.0, variation.law_step > 0.0
        if laws_change:
            _force_of_side(run, run.ahead, variation.uncut[0, s], s, batch, batch[5:6])
            _force_of_side(run, run.behind, variation.uncut[1, s], s, batch, batch[6:7])
            by_law = (batch[5] - batch[6]) / (2.0 * variation.law_step)
        if rubs(problem, s):
            add_rubbing_change(run, s, w, t, _inside_segment(run, s, w), factor, out)
            continue
        if is_circle(problem, s):
            add_radial_change(run, s, w, t, factor, force, by_law, out)
            continue
        for c in range(derivatives.y.shape[0]):
            y = derivatives.trial[c]
            change = batch[4] * derivatives.entry[c, s] + change_by_latched(run, c, s, 1, 0)
            for d in range(2):
                change += batch[2 + d] * row_change(run, y, c, problem.first[s], d, t)
            if laws_change and is_parameter(run, c):
                change += by_law
            add_push(problem, s, factor * change, w, out[c])


@merged
def _land(run, row):
    """Move all columns over a landing: the variational equation on the stages of its Runge–Kutta step."""
    problem, past, scratch, derivatives = run.problem, run.past, run.scratch, run.derivatives
    variable, stop, size = int(row[FIRST]), int(row[SECOND]), 2 * problem.k.size
    w, width, span = scratch.stages[START], past.x.size, row[SPAN]
    start_landing(run.here, stop, variable)
    for s in range(problem.law.size):
        scratch.before_cut[s] = 0.0
    _update_sides(run, past.x)
    while True:
        landing_step(run.here, False, np.int64(STAGES), variable, stop, span, w, scratch.before_cut)
        if not _update_sides(run, scratch.stages[LANDED]):
            break
    trial = scratch.stages[STAGES + 1]
    for i in range(STAGES + 1):
        combine(scratch.stages, A[i], i, w, trial)
        for c in range(derivatives.y.shape[0]):
            for e in range(size):
                total = 0.0
                for j in range(i):
                    total += A[i, j] * derivatives.stages[j, c, e]
                derivatives.trial[c, e] = derivatives.y[c, e] + total
        if i < STAGES:
            _stage_rates(run, trial, scratch.stages[i, width], derivatives.stages[i])
    for c in range(derivatives.y.shape[0]):
        copy(derivatives.trial[c], derivatives.y[c], size)


@inner
def _follow(run, state, modes, begins):
    """Move the derivatives along a record; here the type of ``run`` is known, so that lines need no friction."""
    problem, past, derivatives = run.problem, run.past, run.derivatives
    if begins:
        _begin(run)
    for r in range(state.count[RECORDED]):
        row = state.event_record[r]
        _fly(problem, row[BEGAN] - past.now[T], derivatives.y)
        past.now[T] = row[BEGAN]
        copy(row[HEAD:], past.x, past.x.size)
        if row[KIND] == EVENT:
            _cross_knot(run, int(row[FIRST]), int(row[SECOND]))
        elif row[KIND] == RENEWAL:
            pass_border(run, int(row[FIRST]), int(row[SECOND]))
        elif row[KIND] == LANDING:
            _land(run, row)
        else:
            linearise_step(run, row, modes)
        past.now[T] = row[ENDED]
    state.count[RECORDED] = 0
    _fly(problem, state.now[T] - past.now[T], derivatives.y)
    past.now[T] = state.now[T]
    rhs(problem, state.now[T], state.x, state.segment, state.entry_rate, derivatives.rate[0], derivatives.batch)


@merged
def _linearise(problem, ahead, behind, addresses, modes, begins):
    """Move the derivatives with the problem, and those whose laws have the value of the parameter ahead and behind."""
    _, _, _, tables_at, energy_at, state_at, scratch_at, past_at, derivatives_at, variation_at = addresses
    tables, past, scratch = _tables(tables_at), _state(past_at), _scratch(scratch_at)
    here = Run(problem, tables, _energy_tables(energy_at), past, scratch)
    known = _derivatives(derivatives_at), _variation(variation_at)
    run = Linearised(here, problem, ahead, behind, tables, past, scratch, *known)
    _follow(run, _state(state_at), modes, begins)


def _linearise_line(addresses, modes, begins):
    """For a `Problem`."""
    at = addresses
    _linearise(_problem(at[0]), _problem(at[1]), _problem(at[2]), addresses, modes, begins)


def _linearise_plane(addresses, modes, begins):
    """For a `PlanarProblem`."""
    at = addresses
    _linearise(_planar_problem(at[0]), _planar_problem(at[1]), _planar_problem(at[2]), addresses, modes, begins)


@lru_cache(maxsize=2)
def linearise_of(planar: bool) -> Any:
    """Compiled for a type of problem: it moves derivatives along the event record of a run, and empties the record.

    Its arguments: addresses, those of the three problems, of the other fields of a `Run` and then of the state reached,
    of derivatives and variation; blocks from ``modes`` on are tones; whether the run begins. The derivatives
    end at the time that the run has reached.
    """
    return entry(types.void(types.UniTuple(types.int64, 10), types.int64, types.boolean))(
        _linearise_plane if planar else _linearise_line
    )
