"""Derivatives carried along a run, and the derivative of one collocated step; see `linearised`."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import types

from solvers.compiled.kernels import MATRIX, REAL, VECTOR, call_force, contact_forces, copy, dot, inlined, inner, rhs
from solvers.compiled.state import BEGAN, ENDED, FIRST, HEAD, KIND, PART, SECOND, SPAN, T
from solvers.compiled.sums import combine
from solvers.exponential.contact.blocks import carry_free, goes_through_blocks, kick, pair, see, way_of
from solvers.exponential.contact.collocation import arrive
from solvers.exponential.contact.node_newton import factorise, linearise, substitute
from solvers.exponential.contact.node_response import free_response, respond
from solvers.exponential.contact.nodes import S
from solvers.exponential.energy.quadrature import inside
from solvers.exponential.flight import signal_derivatives, turn


class Slopes(NamedTuple):
    """Derivatives carried along and working space; columns are the first index."""

    y: Any  # (columns, x.size) of the state at fixed time
    entry: Any  # (columns, m) of the latched entry rates
    shift: Any  # (columns, m) of the entry times
    force: Any  # (m + L, S) of one column: forces, then signals, at the nodes of a step
    signal: Any  # (L, S) slopes of the sampled signals there
    response: Any  # (m, 2, S) of δ and δ̇ to these slopes
    by_parameter: Any  # (m, S) ∂F/∂parameter there
    rate: Any  # (2, x.size) of the state at both ends of a step; at last the first is that at the time reached
    stages: Any  # (STAGES, columns, x.size) of a landing
    trial: Any  # (columns, x.size)
    batch: Any  # (8,)
    latched: Any  # (columns, m l) of what laws with memory have latched, see Problem.latched
    by_latched: Any  # (m, l S) derivatives of their forces by it, row by row
    renewed: Any  # (l (2 + l) + 4 P + 2 B,) working space


class Nudge(NamedTuple):
    """What a parameter changes per unit, besides the state; none when ``step`` is zero."""

    step: float  # half the distance of the two systems it was taken from
    law_step: float  # the same; zero where their laws are the same
    omega: Any  # (K,) tones
    steady: Any  # (K, m, 2, 4): (Re a, Im a, Re b, Im b) of δ and δ̇ = Re (a + t b) e^{iωt}
    gap: Any  # (m,)


_CUBE = types.Array(REAL, 3, "C")
SLOPES = types.NamedTuple([*[MATRIX] * 5, _CUBE, MATRIX, MATRIX, _CUBE, MATRIX, VECTOR, MATRIX, MATRIX, VECTOR], Slopes)
NUDGE = types.NamedTuple([REAL, REAL, VECTOR, types.Array(REAL, 4, "C"), VECTOR], Nudge)


@inlined
def explicit(nudge, s, d, t):
    """Change of δ (d = 0) or δ̇ that the parameter makes by itself at time t."""
    total = -nudge.gap[s] if d == 0 else 0.0
    for j in range(nudge.omega.size):
        a = nudge.steady[j, s, d]
        angle = nudge.omega[j] * t
        total += (a[0] + t * a[2]) * np.cos(angle) - (a[1] + t * a[3]) * np.sin(angle)
    return total


@inlined
def change_of(problem, nudge, slopes, column, s, d, t):
    """Change of δ or δ̇ of a stop at fixed time."""
    row = problem.read[s] if d == 0 else problem.read_rate[s]
    value = dot(row, slopes.y[column], 2 * problem.k.size)
    return value + explicit(nudge, s, d, t) if is_parameter(nudge, slopes, column) else value


@inlined
def is_parameter(nudge, slopes, column):
    """Whether a column is the parameter's."""
    return nudge.step > 0.0 and column == slopes.y.shape[0] - 1


@inlined
def by_latched(problem, shadow, slopes, s, n, delta, rate):
    """∂F/∂(latched numbers) of a law with memory at n points."""
    if problem.by_latched[s] != 0:
        address, out = problem.by_latched[s], slopes.by_latched[s]
        call_force(address, n, delta, rate, shadow.entry_rate[s], problem.parameters[s], (out,))


@inlined
def change_by_latched(problem, slopes, column, s, n, i):
    """Change of a force at point i of n by the changes of what is latched."""
    total, most = 0.0, problem.latched.shape[1]
    for place in range(most if problem.by_latched[s] != 0 else 0):
        if problem.latched[s, place] >= 0:
            total += slopes.by_latched[s, place * n + i] * slopes.latched[column, s * most + place]
    return total


@inlined
def _by_parameter(ahead, behind, shadow, space, nudge, slopes, s):
    """∂F/∂parameter at the nodes of a stop, from the law at both parameters."""
    for i in range(S):
        slopes.by_parameter[s, i] = 0.0
    if nudge.law_step == 0.0:
        return
    delta, rate = space.motion[s, 0], space.motion[s, 1]
    copy(delta, space.clipped, S)
    contact_forces(ahead, s, space.clipped, rate, shadow.entry_rate[s], slopes.by_parameter[s])
    contact_forces(behind, s, space.clipped, rate, shadow.entry_rate[s], space.trial)
    for i in range(S):
        slopes.by_parameter[s, i] = (slopes.by_parameter[s, i] - space.trial[i]) / (2.0 * nudge.law_step)


@inlined
def _signal_slopes(problem, tables, shadow, space, slopes, family, level, t):
    """Slopes of the sampled signals at the nodes, and the response of the stops in contact to them."""
    stops, h = problem.gap.size, tables.step[level]
    for j in range(problem.table_dt.size):
        for i in range(S):
            signal_derivatives(problem, j, t + h * tables.times[family, i], space.six[j])
            slopes.signal[problem.table_load[j], i] = space.six[j, 1]
    for s in range(stops):
        if shadow.piece[s] == 0:
            continue
        response = slopes.response[s]
        for i in range(S):
            response[0, i], response[1, i] = 0.0, 0.0
        for load in problem.table_load:
            matrix = pair(problem, tables, space, family, level, s, stops + load)
            combine(matrix, slopes.signal[load], S, response, response)


@inlined
def _solve(problem, tables, shadow, space, slopes, nudge, family, level, column, shift):
    """Changes of all forces (and, in a moving frame, signals) at the nodes, one column."""
    row, size, stops, through = 0, 2 * problem.k.size, problem.gap.size, goes_through_blocks(tables)
    if through:
        carry_free(problem, tables, space, family, level, slopes.y[column])
    for s in range(stops):
        if shadow.piece[s] == 0:
            continue
        if through:
            see(problem, space, s, 0.0, space.motion[s])
        else:
            combine(tables.free[tables.kind[family], level, s], slopes.y[column], size, None, space.motion[s])
        for i in range(S):
            change = slopes.entry[column, s] * space.slope[s, 2, i]
            change += change_by_latched(problem, slopes, column, s, S, i)
            if is_parameter(nudge, slopes, column):
                change += slopes.by_parameter[s, i]
            for d in range(2):
                value = space.motion[s, d, i]
                if shift != 0.0:
                    value += shift * slopes.response[s, d, i]
                if is_parameter(nudge, slopes, column):
                    value += explicit(nudge, s, d, shadow.now[T] + tables.step[level] * tables.times[family, i])
                change += space.slope[s, d, i] * value
            space.residual[row + i] = change
        row += S
    substitute(space.jacobian, space.pivots, row, space.residual)
    row = 0
    for s in range(stops):
        if shadow.piece[s] > 0:
            copy(space.residual[row : row + S], slopes.force[s], S)
            row += S
    for load in problem.table_load:
        for i in range(S):
            slopes.force[stops + load, i] = shift * slopes.signal[load, i]


@inlined
def _move(problem, tables, shadow, space, slopes, family, level, y, part):
    """Take one column to the end of the step, or to the ``part`` of it that lies within the run."""
    size, stops = 2 * problem.k.size, problem.gap.size
    if part < np.inf:
        for u in range(space.force.shape[0]):
            copy(slopes.force[u], space.force[u], S)
        inside(problem, tables, shadow, space, family, tables.step[level], part, y)
        return
    turn(problem, tables.step_propagator[level, 0], tables.step_propagator[level, 1], y)
    if goes_through_blocks(tables):
        kick(problem, tables, shadow, space, slopes.force, family, level, y)
    for u in range(0 if goes_through_blocks(tables) else space.force.shape[0]):
        if u < stops and shadow.piece[u] == 0:
            continue
        for j in range(S):
            row = tables.kick[way_of(tables, family, u), level, u, j]
            for e in range(size):
                y[e] += row[e] * slopes.force[u, j]


@inner
def linearise_step(problem, ahead, behind, tables, shadow, space, slopes, nudge, row, modes):
    """A collocated step, linearised as it was taken."""
    family, level, t = int(row[FIRST]), int(row[SECOND]), row[BEGAN]
    size, stops = 2 * problem.k.size, problem.gap.size
    free_response(problem, tables, shadow, space, family, level)
    for s in range(stops):
        copy(row[HEAD + shadow.x.size + s * S : HEAD + shadow.x.size + (s + 1) * S], space.force[s], S)
    for s in range(stops):
        if shadow.piece[s] > 0:
            respond(problem, tables, shadow, space, family, level, s)
            _by_parameter(ahead, behind, shadow, space, nudge, slopes, s)
            by_latched(problem, shadow, slopes, s, S, space.motion[s, 0], space.motion[s, 1])
    factorise(space.jacobian, space.pivots, linearise(problem, tables, shadow, space, family, level))
    moving = tables.power[family] > 1.0
    part = row[SPAN] if row[KIND] == PART else np.inf
    if moving:
        rhs(problem, t, shadow.x, shadow.piece, shadow.entry_rate, slopes.rate[0], slopes.batch)
        end = space.x_new
        if part < np.inf:
            copy(shadow.x, end, shadow.x.size)
            inside(problem, tables, shadow, space, family, tables.step[level], part, end)
        else:
            arrive(problem, tables, shadow, space, family, level)
        rhs(problem, row[ENDED], end, shadow.piece, shadow.entry_rate, slopes.rate[1], slopes.batch)
        _signal_slopes(problem, tables, shadow, space, slopes, family, level, t)
    for c in range(slopes.y.shape[0]):
        y = slopes.y[c]
        shift = slopes.shift[c, family - 1] if moving else 0.0
        for e in range(size if moving else 0):
            y[e] += slopes.rate[0, e] * shift
        _solve(problem, tables, shadow, space, slopes, nudge, family, level, c, shift)
        _move(problem, tables, shadow, space, slopes, family, level, y, part)
        if moving:
            for e in range(size):
                y[e] -= slopes.rate[1, e] * shift
            for b in range(modes, problem.k.size):  # tones do not change; their rounding would outlive the rest
                y[b], y[problem.k.size + b] = 0.0, 0.0
