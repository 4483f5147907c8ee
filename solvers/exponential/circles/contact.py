"""Steps in contact with a circular clearance: the unknowns are both components of its force at the nodes.

δ, δ̇ and N are stored behind the rows, at the index ``problem.own`` of `Scratch.motion` and `Scratch.law_force`, where
`node_response.motion_of` and `force_of` read them.
"""

from __future__ import annotations

import math

from numba import types

from solvers.compiled.kernels import (
    REAL,
    copy,
    dot,
    inlined,
    inner,
    law_forces,
    merged,
    radial_motion,
    rhs,
    surface_tolerance,
)
from solvers.compiled.parts import (
    CIRCLE_AWAY,
    CIRCLE_FORCES,
    CIRCLE_GUESS,
    CIRCLE_LANDED,
    CIRCLE_MOTION,
    CIRCLE_NEWTON,
    CIRCLE_WITHIN,
    CIRCLE_WORK,
    part,
)
from solvers.compiled.simd import load8, positive8, splat8, sqrt8, store8
from solvers.compiled.state import CALLS, T, acts
from solvers.compiled.sums import above
from solvers.exponential.contact.many_stops import pair_response
from solvers.exponential.contact.nodes import S
from solvers.exponential.contact.step_integrals import resolves_rates, work_by_places, work_by_rates
from solvers.exponential.tables import DAMPING, EXPONENT, FACTOR, FORCE, STIFFNESS

_TINY = 1e-300  # m²: makes δ̇ at the centre, where there is no direction, 0 instead of NaN


@inlined
def _radial_nodes(run, s):
    """Write δ and δ̇ at the nodes from the motion of both rows; returns both components of σ e."""
    problem, scratch = run.problem, run.scratch
    u, w, own = scratch.motion[problem.first[s]], scratch.motion[problem.first[s] + 1], scratch.motion[problem.own[s]]
    along, across, sign = load8(u[0], 0), load8(w[0], 0), 1.0 if problem.radius[s] > 0.0 else -1.0
    r = sqrt8(along * along + across * across + splat8(_TINY))
    turned = splat8(sign) / r
    along, across = along * turned, across * turned
    store8(own[0], 0, splat8(sign) * r - splat8(problem.radius[s]))
    store8(own[1], 0, along * load8(u[1], 0) + across * load8(w[1], 0))
    return along, across


@inlined
def _signed(problem, s, value):
    """σ times a value."""
    return value if problem.radius[s] > 0.0 else -value


@part(CIRCLE_MOTION, types.void, types.int64)
def radial_nodes(run, s):
    """`_radial_nodes`, called at an address."""
    _radial_nodes(run, s)


@inlined
def _radial_forces(run, s):
    """Write N at the nodes for the motion of both rows, and its components, into ``scratch.law_force``."""
    problem, state, scratch = run.problem, run.state, run.scratch
    along, across = _radial_nodes(run, s)
    row, own = problem.first[s], problem.own[s]
    motion, force = scratch.motion[own], scratch.law_force[own]
    law = run.tables.power_law[s]
    if law[EXPONENT] > 0.0:
        deep, rate = positive8(load8(motion[0], 0)), load8(motion[1], 0)
        deep = deep * sqrt8(deep) if law[EXPONENT] == 1.5 else deep
        growth = splat8(1.0) + splat8(law[FACTOR] / state.entry_rate[s]) * rate
        push = splat8(law[STIFFNESS]) * deep * growth + splat8(law[DAMPING]) * rate
        store8(force, 0, positive8(push) if run.tables.bend[s] == FORCE else push)
    else:
        above(motion[0], problem.knots[s, 0], scratch.clipped)
        law_forces(problem, s, S, scratch.clipped, motion[1], state.entry_rate[s], force)
    state.count[CALLS] += S
    store8(scratch.law_force[row], 0, load8(force, 0) * along)
    store8(scratch.law_force[row + 1], 0, load8(force, 0) * across)


@part(CIRCLE_FORCES, types.void, types.int64)
def radial_forces(run, s):
    """`_radial_forces`, called at an address."""
    _radial_forces(run, s)


@part(CIRCLE_GUESS, types.void, types.int64)
def guess_radial_forces(run, s):
    """First guess of the components at the nodes: the law for the free response."""
    problem, scratch = run.problem, run.scratch
    for r in range(problem.first[s], problem.first[s] + 2):
        copy(scratch.free[r, 0], scratch.motion[r, 0], S)
        copy(scratch.free[r, 1], scratch.motion[r, 1], S)
    _radial_forces(run, s)
    for r in range(problem.first[s], problem.first[s] + 2):
        copy(scratch.law_force[r], scratch.force[r], S)


@part(CIRCLE_AWAY, types.boolean, types.int64, REAL)
def stays_in_circle(run, s, h):
    """Whether a circle cannot be reached on the step; the motion at the nodes is set to that at the start.

    ``scratch.per_row`` bounds the accelerations of the rows. A disc is convex: u + tu̇ is inside if both its ends are.
    """
    problem, scratch = run.problem, run.scratch
    row, size = problem.first[s], 2 * problem.k.size
    bound, extrapolated = 0.5 * h * h * math.hypot(scratch.per_row[row], scratch.per_row[row + 1]), 0.0
    for r in range(row, row + 2):
        u = dot(problem.read[r], run.state.x, size) - problem.gap[r]
        v = dot(problem.read_rate[r], run.state.x, size)
        extrapolated += (u + h * v) ** 2
        for i in range(S):
            scratch.motion[r, 0, i], scratch.motion[r, 1, i] = u, v
    delta, rate = scratch.start_motion[s, 0], scratch.start_motion[s, 1]
    for i in range(S):
        scratch.motion[problem.own[s], 0, i], scratch.motion[problem.own[s], 1, i] = delta, rate
    if problem.radius[s] < 0.0:
        return delta + h * max(rate, 0.0) + bound < 0.0
    return max(delta, math.sqrt(extrapolated) - problem.radius[s]) + bound < 0.0


@inlined
def turn_slopes(u, w, u_dot, w_dot, force, by_delta, by_rate, radius, i, out):
    """Slopes of a force's components at point i: of a by u_b, then by u̇_b, into row 2a + b of ``out``; u is (u, w).

    Row 4 gets the direction of the force, σ e.

        ∂F_a/∂u_b = N_δ e_a e_b + N_δ̇ e_a (u̇_b - ṙ e_b)/r + σ (N/r) (1 if a = b - e_a e_b),   ∂F_a/∂u̇_b = N_δ̇ e_a e_b
    """
    r = math.sqrt(u * u + w * w)
    e_u, e_w = u / r, w / r
    along, sideways = e_u * u_dot + e_w * w_dot, (force if radius > 0.0 else -force) / r
    for a in range(2):
        e_a = e_u if a == 0 else e_w
        for b in range(2):
            e_b, faster = (e_u, u_dot) if b == 0 else (e_w, w_dot)
            turning = by_rate * e_a * (faster - along * e_b) / r + sideways * ((1.0 if a == b else 0.0) - e_a * e_b)
            out[2 * a + b, 0, i], out[2 * a + b, 1, i] = by_delta * e_a * e_b + turning, by_rate * e_a * e_b
        out[4, a, i] = e_a if radius > 0.0 else -e_a


@merged
def turned_of(run, s):
    """(5, 2, S) slopes and directions of `turn_slopes` at the nodes."""
    problem = run.problem
    return run.scratch.turned[5 * (problem.own[s] - problem.gap.size) : 5 * (problem.own[s] - problem.gap.size) + 5]


@inner
def slopes_at_nodes(run, s):
    """Slopes of the components at the nodes into ``scratch.turned``, from those of the law in ``scratch.slope``."""
    problem, scratch = run.problem, run.scratch
    u, w, own = scratch.motion[problem.first[s]], scratch.motion[problem.first[s] + 1], problem.own[s]
    slope, force, out = scratch.slope[s], scratch.law_force[own], turned_of(run, s)
    radius = problem.radius[s]
    for i in range(S):
        turn_slopes(u[0, i], w[0, i], u[1, i], w[1, i], force[i], slope[0, i], slope[1, i], radius, i, out)


@part(CIRCLE_NEWTON, types.void, *[types.int64] * 4)
def linearise_circle(run, node_set, level, s, begin):
    """Write the 2S rows of Newton's matrix that belong to a circle, from its row ``begin`` on."""
    problem = run.problem
    slopes_at_nodes(run, s)
    row, turned, column = problem.first[s], turned_of(run, s), 0
    for u in range(problem.gap.size):
        if not acts(problem, run.state, u):
            continue
        for a in range(2):
            for i in range(S):
                for j in range(S):
                    own = u == row + a and i == j
                    run.scratch.jacobian[begin + a * S + i, column + j] = 1.0 if own else 0.0
        for b in range(2):
            matrix = pair_response(run, node_set, level, row + b, u)
            for a in range(2):
                slope = turned[2 * a + b]
                for i in range(S):
                    for j in range(S):
                        run.scratch.jacobian[begin + a * S + i, column + j] -= (
                            slope[0, i] * matrix[j, i] + slope[1, i] * matrix[j, S + i]
                        )
        column += S


@part(CIRCLE_WORK, REAL, *[types.int64] * 3)
def work_in_circle(run, node_set, level, s):
    """Work, J, of the forces on all rows of an element over the step just solved; each as in `step_integrals`."""
    problem, tables, scratch = run.problem, run.tables, run.scratch
    size, h, work = 2 * problem.k.size, tables.contact_step[level], 0.0
    for r in range(problem.first[s], problem.first[s + 1]):
        force, motion = scratch.force[r], scratch.motion[r]
        if resolves_rates(tables, node_set, s, h):
            work += work_by_rates(tables, node_set, s, h, force, motion[1])
            continue
        begin = dot(problem.read[r], run.state.x, size) - problem.gap[r]
        end = dot(problem.read[r], scratch.x_new, size) - problem.gap[r]
        work += work_by_places(tables, node_set, force, motion[0], (begin, end), scratch.trial)
    return work


@part(CIRCLE_WITHIN, types.UniTuple(REAL, 2), types.int64, types.int64)
def work_within_circle(run, s, first):
    """(work, J, impulse, N s) of an element over a panel of the step, from motion and forces at its points.

    The motion of the blocks is in ``scratch.along``, the rows' forces in ``scratch.between`` from row ``first`` on.
    """
    problem, scratch = run.problem, run.scratch
    size, work, row = 2 * problem.k.size, 0.0, problem.first[s]
    weights = run.tables.gauss[1]
    product, square = scratch.trial, scratch.clipped
    for i in range(S):
        product[i], square[i] = 0.0, 0.0
    for r in range(row, row + 2):
        force = scratch.between[first + r]
        for i in range(S):
            u, v = -problem.gap[r], 0.0
            for e in range(size):
                u += problem.read[r, e] * scratch.along[e, i]
                v += problem.read_rate[r, e] * scratch.along[e, i]
            work += weights[i] * force[i] * v
            product[i] += force[i] * u
            square[i] += u * u
    impulse = 0.0
    for i in range(S):
        impulse += weights[i] * _signed(problem, s, product[i]) / math.sqrt(square[i] + _TINY)
    return work, impulse


@part(CIRCLE_LANDED, types.void, types.int64, REAL)
def land_on_circle(run, s, level):
    """Move a state that has landed near δ = ``level`` onto it, along its motion: dt = (level - δ)/δ̇.

    The indentation is not linear in the state, so a landing ends there only to its own tolerance; this leaves rounding.
    """
    problem, state = run.problem, run.state
    size = 2 * problem.k.size
    for _ in range(2):
        delta, rate = radial_motion(problem, s, state.x)
        if abs(delta - level) <= 0.5 * surface_tolerance(problem, s, state.x) or rate == 0.0:
            break
        rhs(problem, state.now[T], state.x, state.segment, state.entry_rate, state.rate, run.scratch.trial)
        shift = (level - delta) / rate
        for e in range(state.x.size):
            if e < size or e > size + 1:
                state.x[e] += shift * state.rate[e]
        state.now[T] += shift
