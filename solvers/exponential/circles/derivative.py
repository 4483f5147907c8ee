"""Derivative of a run through contacts with circular clearances; see `linearised`.

With δ = σ|u| - c' (c' = c, or -c of an outer circle) and e = u/|u|, at fixed time

    dδ = σ e·du - dc',   dδ̇ = σ (e·du̇ + (u̇ - ṙe)·du/r),

and the components of the force change by their slopes, see `contact.turn_slopes`, and by the change of N at fixed u,
u̇. Every ``run`` is a `linearised_step.Linearised`.
"""

from __future__ import annotations

import math

from solvers.compiled.kernels import dot, inlined, inner, is_circle
from solvers.compiled.state import T
from solvers.exponential.circles.contact import turn_slopes, turned_of
from solvers.exponential.contact.nodes import S


@inlined
def explicit_change(variation, r, d, t):
    """Derivative of a row's displacement (d = 0) or rate (d = 1) by the parameter, the state held fixed."""
    total = -variation.gap[r] if d == 0 else 0.0
    for j in range(variation.omega.size):
        a = variation.steady[j, r, d]
        angle = variation.omega[j] * t
        total += (a[0] + t * a[2]) * math.cos(angle) - (a[1] + t * a[3]) * math.sin(angle)
    return total


@inlined
def is_parameter(run, column):
    """Whether a column is the derivative by the parameter; the others are by the start."""
    return run.variation.step > 0.0 and column == run.derivatives.y.shape[0] - 1


@inner
def row_change(run, y, c, r, d, t):
    """Change of a row's displacement (d = 0) or rate (d = 1) at fixed time, in column c, whose state is y."""
    problem = run.problem
    value = dot(problem.read[r] if d == 0 else problem.read_rate[r], y, 2 * problem.k.size)
    return value + explicit_change(run.variation, r, d, t) if is_parameter(run, c) else value


@inner
def radial_change(run, x, c, s, d, t):
    """Change of δ (d = 0) or δ̇ (d = 1) of a circle in the state x at fixed time, in column c."""
    problem, y = run.problem, run.derivatives.y[c]
    row, size = problem.first[s], 2 * problem.k.size
    u, w = (
        dot(problem.read[row], x, size) - problem.gap[row],
        dot(problem.read[row + 1], x, size) - problem.gap[row + 1],
    )
    r = math.sqrt(u * u + w * w)
    u, w = u / r, w / r
    change = u * row_change(run, y, c, row, d, t) + w * row_change(run, y, c, row + 1, d, t)
    if d == 1:
        u_dot, w_dot = dot(problem.read_rate[row], x, size), dot(problem.read_rate[row + 1], x, size)
        along = u * u_dot + w * w_dot
        change += (u_dot - along * u) / r * row_change(run, y, c, row, 0, t)
        change += (w_dot - along * w) / r * row_change(run, y, c, row + 1, 0, t)
    change = change if problem.radius[s] > 0.0 else -change
    return change - run.variation.radius[s] if d == 0 and is_parameter(run, c) else change


@inlined
def change_of(run, x, column, s, d, t):
    """Change of δ (d = 0) or δ̇ (d = 1) of any stop in the state x at fixed time, in one column."""
    if is_circle(run.problem, s):
        return radial_change(run, x, column, s, d, t)
    return row_change(run, run.derivatives.y[column], column, run.problem.first[s], d, t)


@inner
def radial_residual(run, node_set, level, c, s, shift, place):
    """Right-hand sides for the changes of the force's components at the nodes, in column c, into ``scratch.residual``.

    ``scratch.motion`` holds the change of motion of both rows without that of the forces.
    """
    scratch, tables, derivatives, variation = run.scratch, run.tables, run.derivatives, run.variation
    row, turned, parameter = run.problem.first[s], turned_of(run.here, s), is_parameter(run, c)
    for i in range(S):
        t = run.past.now[T] + tables.contact_step[level] * tables.times[node_set, i]
        along = derivatives.entry[c, s] * scratch.slope[s, 2, i]
        if parameter:
            along += derivatives.by_parameter[s, i]
            along -= scratch.slope[s, 0, i] * variation.radius[s]
        for a in range(2):
            change = along * turned[4, a, i]
            for b in range(2):
                for d in range(2):
                    value = scratch.motion[row + b, d, i]
                    if shift != 0.0:
                        value += shift * derivatives.response[row + b, d, i]
                    if parameter:
                        value += explicit_change(variation, row + b, d, t)
                    change += turned[2 * a + b, d, i] * value
            scratch.residual[place + a * S + i] = change


@inner
def add_radial_change(run, s, w, t, factor, force, by_law, out):
    """Add the changes of a circle's force, in the state w of a landing, to the rates of all columns.

    The slopes of the law are in ``derivatives.batch[2:5]``; ``by_law`` is its derivative by the parameter.
    """
    problem, derivatives = run.problem, run.derivatives
    row, size, batch, turned = problem.first[s], 2 * problem.k.size, derivatives.batch, derivatives.turned
    read, rate = problem.read, problem.read_rate
    u, u_dot = dot(read[row], w, size) - problem.gap[row], dot(rate[row], w, size)
    v, v_dot = dot(read[row + 1], w, size) - problem.gap[row + 1], dot(rate[row + 1], w, size)
    turn_slopes(u, v, u_dot, v_dot, force, batch[2], batch[3], problem.radius[s], 0, turned)
    for c in range(derivatives.y.shape[0]):
        y, along = derivatives.trial[c], batch[4] * derivatives.entry[c, s]
        if is_parameter(run, c):
            along += by_law - batch[2] * run.variation.radius[s]
        for a in range(2):
            change = along * turned[4, a, 0]
            for b in range(2):
                for d in range(2):
                    moved = row_change(run, y, c, row + b, d, t)
                    change += turned[2 * a + b, d, 0] * moved
            for e in range(size):
                out[c, e] += factor * change * problem.push[row + a, e]
