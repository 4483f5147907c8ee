"""The arrays of derivatives that are moved along a run, and the derivative of one collocated step; see `linearised`."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np

from solvers.compiled.fields import packed_type
from solvers.compiled.kernels import call_force, contact_forces, copy, inlined, is_circle, merged, rhs, rubs
from solvers.compiled.state import BEGAN, ENDED, FIRST, HEAD, KIND, PART, SECOND, SPAN, T, acts
from solvers.compiled.sums import combine
from solvers.exponential.circles.contact import radial_forces
from solvers.exponential.circles.derivative import explicit_change, is_parameter, radial_residual
from solvers.exponential.circles.friction_derivative import rubbing_by_parameter, rubbing_residual
from solvers.exponential.contact.collocation import end_state
from solvers.exponential.contact.many_stops import (
    add_end_response,
    free_block_motion,
    motion_at_nodes,
    pair_response,
    uses_blocks,
    weighting_of,
)
from solvers.exponential.contact.node_newton import factorise, linearise, substitute
from solvers.exponential.contact.node_response import free_response, motion_of, respond
from solvers.exponential.contact.nodes import S
from solvers.exponential.energy.quadrature import state_within
from solvers.exponential.flight import propagate_blocks, signal_derivatives


class Derivatives(NamedTuple):
    """Derivatives and scratch arrays; the first index counts columns: the 2n start coordinates, then the parameter.

    `Tangent` fills y, from then on `linearise_of` alone writes to them.
    """

    y: Annotated[Any, "columns, X"]  # of the state at fixed time
    entry: Annotated[Any, "columns, E"]  # of the latched entry rates
    shift: Annotated[Any, "columns, E+1"]  # of the entry times, and of the time of the last knot or border
    force: Annotated[Any, "R+L, S"]  # of one column: forces, then signals, at the nodes of a step
    signal: Annotated[Any, "L, S"]  # slopes of the sampled signals there
    response: Annotated[Any, "R, 2, S"]  # of δ and δ̇ to these slopes
    by_parameter: Annotated[Any, "E, S"]  # ∂F/∂parameter there
    rate: Annotated[Any, "2, X"]  # rate of the state at both ends of a step; after a call the first is that at the end
    stages: Annotated[Any, "STAGES, columns, X"]  # of a landing
    trial: Annotated[Any, "columns, X"]
    batch: Annotated[Any, "8"]
    latched: Annotated[Any, "columns, E*l"]  # of the numbers that laws with memory have latched, see Problem.latched
    by_latched: Annotated[Any, "E, l*S"]  # derivatives of their forces by these, row by row
    renewed: Annotated[Any, "renewed"]  # working space of l (5 + l) + 4 P + 2 B numbers
    turned: Annotated[Any, "9, 2, 1"]  # slopes of forces on the rows of a circle at one moment, see `circles`
    at_rows: Annotated[Any, "3, 2, 1"]  # motion of these rows
    by_rows: Annotated[Any, "R, S"]  # ∂N/∂parameter, then ∂F_t/∂parameter at the nodes, of elements with friction


class Variation(NamedTuple):
    """Changes by a parameter, per unit, besides that of the state; ``step`` is zero without a parameter."""

    step: Annotated[float, "number"]  # half the distance between the two systems of the difference
    law_step: Annotated[float, "number"]  # the same; zero where their laws are the same
    omega: Annotated[Any, "K"]  # tones
    steady: Annotated[Any, "K, R, 2, 4"]  # (Re a, Im a, Re b, Im b) of δ and δ̇ = Re (a + t b) e^{iωt}
    gap: Annotated[Any, "R"]
    radius: Annotated[Any, "C"]  # of circular clearances, as in `Problem`
    uncut: Annotated[Any, "2, E, P"]  # parameters of the laws ahead and behind without their cuts, as in `Tables`


DERIVATIVES, VARIATION = packed_type(Derivatives), packed_type(Variation)


class Linearised(NamedTuple):
    """All that the functions of this derivative share, packed; called ``run`` there."""

    here: Any  # the `Run` at the time the derivatives have reached; its fields are here, too
    problem: Any
    ahead: Any  # the problem whose laws have the value of the parameter ahead
    behind: Any
    tables: Any
    past: Any  # the state at the time the derivatives have reached
    scratch: Any
    derivatives: Any
    variation: Any


@inlined
def by_latched(run, s, n, delta, rate):
    """∂F/∂(latched numbers) of a law with memory at n points."""
    problem = run.problem
    if problem.by_latched[s] != 0:
        address, out = problem.by_latched[s], run.derivatives.by_latched[s]
        call_force(address, n, delta, rate, run.past.entry_rate[s], problem.parameters[s], (out,))


@inlined
def change_by_latched(run, column, s, n, i):
    """Change of a force at point i of n due to the changes of latched numbers."""
    problem, derivatives, total = run.problem, run.derivatives, 0.0
    most = problem.latched.shape[1]
    for place in range(most if problem.by_latched[s] != 0 else 0):
        if problem.latched[s, place] >= 0:
            total += derivatives.by_latched[s, place * n + i] * derivatives.latched[column, s * most + place]
    return total


@merged
def _by_parameter(run, s):
    """∂F/∂parameter of stop s at the nodes, by the difference of the laws at both parameters."""
    scratch, entry_rate, out = run.scratch, run.past.entry_rate[s], run.derivatives.by_parameter[s]
    for i in range(S):
        out[i] = 0.0
    if run.variation.law_step == 0.0:
        return
    motion = motion_of(run.here, s)
    copy(motion[0], scratch.clipped, S)
    contact_forces(run.ahead, s, scratch.clipped, motion[1], entry_rate, out)
    contact_forces(run.behind, s, scratch.clipped, motion[1], entry_rate, scratch.trial)
    for i in range(S):
        out[i] = (out[i] - scratch.trial[i]) / (2.0 * run.variation.law_step)


@merged
def _signal_slopes(run, node_set, level, t):
    """Slopes of the sampled signals at the nodes, and the response of the rows in contact to them."""
    problem, tables, past, scratch, derivatives = run.problem, run.tables, run.past, run.scratch, run.derivatives
    rows, h = problem.gap.size, tables.contact_step[level]
    for j in range(problem.table_dt.size):
        for i in range(S):
            signal_derivatives(problem, j, t + h * tables.times[node_set, i], scratch.signal_terms[j])
            derivatives.signal[problem.table_load[j], i] = scratch.signal_terms[j, 1]
    for r in range(rows):
        if not acts(problem, past, r):
            continue
        response = derivatives.response[r]
        for i in range(S):
            response[0, i], response[1, i] = 0.0, 0.0
        for load in problem.table_load:
            matrix = pair_response(run.here, node_set, level, r, rows + load)
            combine(matrix, derivatives.signal[load], S, response, response)


@merged
def _line_residual(run, node_set, level, c, s, shift, place):
    """Right-hand sides for the changes of the force of a stop on a line, in column c, into ``scratch.residual``.

    ``scratch.motion`` holds the change of motion without that of the forces.
    """
    scratch, tables, derivatives, r = run.scratch, run.tables, run.derivatives, run.problem.first[s]
    for i in range(S):
        t = run.past.now[T] + tables.contact_step[level] * tables.times[node_set, i]
        change = derivatives.entry[c, s] * scratch.slope[s, 2, i] + change_by_latched(run, c, s, S, i)
        if is_parameter(run, c):
            change += derivatives.by_parameter[s, i]
        for d in range(2):
            value = scratch.motion[r, d, i]
            if shift != 0.0:
                value += shift * derivatives.response[r, d, i]
            if is_parameter(run, c):
                value += explicit_change(run.variation, r, d, t)
            change += scratch.slope[s, d, i] * value
        scratch.residual[place + i] = change


@merged
def _solve(run, node_set, level, column, shift):
    """Changes of all forces at the nodes in one column and, in a moving frame, of the signals."""
    problem, tables, past, scratch, derivatives = run.problem, run.tables, run.past, run.scratch, run.derivatives
    place, size, rows, through = 0, 2 * problem.k.size, problem.gap.size, uses_blocks(tables)
    if through:
        free_block_motion(run.here, node_set, level, derivatives.y[column])
    for r in range(rows):
        s, motion = problem.element[r], scratch.motion[r]
        if past.segment[s] == 0:
            continue
        if through:
            motion_at_nodes(run.here, r, 0.0, motion)
        else:
            combine(tables.free[tables.kind[node_set], level, r], derivatives.y[column], size, None, motion)
        if rubs(problem, s):
            if r == problem.first[s + 1] - 1:  # all rows have moved
                rubbing_residual(run, node_set, level, column, s, shift, place - S * (r - problem.first[s]))
        elif is_circle(problem, s):
            if r > problem.first[s]:  # both rows have moved
                radial_residual(run, node_set, level, column, s, shift, place - S)
        else:
            _line_residual(run, node_set, level, column, s, shift, place)
        place += S
    substitute(scratch.jacobian, scratch.pivots, place, scratch.residual)
    place = 0
    for r in range(rows):
        if acts(problem, past, r):
            copy(scratch.residual[place : place + S], derivatives.force[r], S)
            place += S
    for load in problem.table_load:
        for i in range(S):
            derivatives.force[rows + load, i] = shift * derivatives.signal[load, i]


@merged
def _move_column(run, node_set, level, y, part):
    """Move one column to the end of the step, or over the ``part`` of it that lies within the run, s."""
    problem, tables, past, scratch, derivatives = run.problem, run.tables, run.past, run.scratch, run.derivatives
    if part < np.inf:
        for u in range(scratch.force.shape[0]):
            copy(derivatives.force[u], scratch.force[u], S)
        state_within(run.here, node_set, tables.contact_step[level], 0.0, part, y, False, False)
        return
    propagate_blocks(problem, tables.contact_propagator[level, 0], tables.contact_propagator[level, 1], y)
    if uses_blocks(tables):
        add_end_response(run.here, derivatives.force, node_set, level, y)
    for u in range(0 if uses_blocks(tables) else scratch.force.shape[0]):
        if u < problem.gap.size and not acts(problem, past, u):
            continue
        for j in range(S):
            row = tables.end_response[weighting_of(run.here, node_set, u), level, u, j]
            for e in range(2 * problem.k.size):
                y[e] += row[e] * derivatives.force[u, j]


@merged
def linearise_step(run, row, modes):
    """Move all columns over a collocated step, linearised as it was taken."""
    problem, tables, past, scratch, derivatives = run.problem, run.tables, run.past, run.scratch, run.derivatives
    node_set, level, t = int(row[FIRST]), int(row[SECOND]), row[BEGAN]
    size = 2 * problem.k.size
    free_response(run.here, node_set, level)
    forces = row[HEAD + past.x.size :]
    for r in range(problem.gap.size):
        copy(forces[r * S : (r + 1) * S], scratch.force[r], S)
    for r in range(problem.gap.size):
        if acts(problem, past, r):
            respond(run.here, node_set, level, r)
    for s in range(problem.law.size):
        if past.segment[s] > 0:
            if rubs(problem, s):
                rubbing_by_parameter(run, s)
                continue
            if is_circle(problem, s):
                radial_forces(run.here, s)
            motion = motion_of(run.here, s)
            _by_parameter(run, s)
            by_latched(run, s, S, motion[0], motion[1])
    factorise(scratch.jacobian, scratch.pivots, linearise(run.here, node_set, level))
    moving = tables.time_exponent[node_set] > 1.0
    part = row[SPAN] if row[KIND] == PART else np.inf
    if moving:
        rhs(problem, t, past.x, past.segment, past.entry_rate, derivatives.rate[0], derivatives.batch)
        end = scratch.x_new
        if part < np.inf:
            copy(past.x, end, past.x.size)
            state_within(run.here, node_set, tables.contact_step[level], 0.0, part, end, False, False)
        else:
            end_state(run.here, node_set, level)
        rhs(problem, row[ENDED], end, past.segment, past.entry_rate, derivatives.rate[1], derivatives.batch)
        _signal_slopes(run, node_set, level, t)
    for c in range(derivatives.y.shape[0]):
        y = derivatives.y[c]
        shift = derivatives.shift[c, node_set - 1] if moving else 0.0
        for e in range(size if moving else 0):
            y[e] += derivatives.rate[0, e] * shift
        _solve(run, node_set, level, c, shift)
        _move_column(run, node_set, level, y, part)
        if moving:
            for e in range(size):
                y[e] -= derivatives.rate[1, e] * shift
            for b in range(modes, problem.k.size):  # tones do not change; undamped, their rounding would stay
                y[b], y[problem.k.size + b] = 0.0, 0.0
