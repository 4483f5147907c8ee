"""Contacts with friction in a step: forces on their rows at the nodes, slopes of these, works.

With y the displacements that the rows of an element read, see `compiled.friction`,

    force on the rows = N ∂δ/∂y + F_t ∂ξ/∂y,   its power is N δ̇ + F_t (ξ̇ - RΩ),

F_t = k_t (ξ - s) in stick and ±μN in slip. The prescribed part RΩt of ξ is known at the nodes. Stick and slip are
segments whose ends are borders, see `contact.slider_margins`.
"""

from __future__ import annotations

import math

from numba import types

from solvers.compiled.friction import (
    SMALL_ANGLE,
    TURN,
    angle_at,
    angle_between,
    slip_sign,
    spring_stretch,
    xi_of,
)
from solvers.compiled.kernels import (
    REAL,
    copy,
    inlined,
    inner,
    is_circle,
    law_forces,
    place_of,
    radius_of,
    row_of,
    rows_at,
    slider_of,
)
from solvers.compiled.parts import RUB_FORCES, RUB_GUESS, RUB_NEWTON, RUB_WITHIN, RUB_WORK, part
from solvers.compiled.simd import largest8, least8, load8, positive8, size8, splat8, store8, sum8
from solvers.compiled.state import CALLS, T, acts
from solvers.compiled.sums import above
from solvers.exponential.circles.contact import radial_forces, work_in_circle
from solvers.exponential.contact.many_stops import pair_response
from solvers.exponential.contact.nodes import S
from solvers.exponential.contact.step_integrals import resolves_rates, weights_of, work_by_places, work_by_rates
from solvers.problem.friction import ACROSS, ALONG, ANGLE, ARM, CODE, MU, SLIDER, SPIN, STICK, STIFFNESS

NODE_XI, NODE_XI_RATE, TANGENTIAL, SPARE = range(4)  # rows of `Scratch.slid`: ξ, ξ̇ and F_t at the nodes, scratch
_TINY = 1e-300  # m²


@inlined
def count_of(problem, s):
    """Number of rows of an element."""
    return row_of(problem, s + 1) - row_of(problem, s)


@inlined
def surface_part(slider, t, turned):
    """Part of ξ by the rotation of the surface, which is known and may be whole turns within a step."""
    return math.copysign(1.0, slider[ARM]) * turned + slider[ARM] * slider[SPIN] * t


@inlined
def nearest_turn(xi, known, radius):
    """ξ on a circle, which is known up to whole turns, at the turn that is nearest to a ``known`` value."""
    if radius == 0.0:
        return xi
    turn = TURN * abs(radius)
    return xi - turn * math.floor((xi - known) / turn + 0.5)


@inner
def xi_continued(run, s, t, x, i):
    """ξ in the state x at time t, at the turn that continues ξ at node i."""
    problem, scratch = run.problem, run.scratch
    slider, first = slider_of(problem, s), row_of(problem, s)
    u, _, w, _, turned, _ = rows_at(problem, s, x)
    if not is_circle(problem, s):
        return -w
    u_i, w_i = scratch.motion[first, 0, i], scratch.motion[first + 1, 0, i]
    turned_at_node = -scratch.motion[first + 2, 0, i] if count_of(problem, s) > 2 else 0.0
    rotation = surface_part(slider, t, turned) - surface_part(slider, scratch.node_time[i], turned_at_node)
    angle = angle_between(u_i * w - w_i * u, u_i * u + w_i * w)
    return scratch.slid[s, NODE_XI, i] + abs(radius_of(problem, s)) * angle + rotation


@inner
def xi_and_rate_at_nodes(problem, scratch, s):
    """ξ and ξ̇ at the nodes from the motion of the rows; ξ does not jump by a turn between two nodes."""
    first, slider, out = row_of(problem, s), slider_of(problem, s), scratch.slid[s, NODE_XI_RATE]
    u, w = load8(scratch.motion[first, 0], 0), load8(scratch.motion[first + 1, 0], 0)
    u_dot, w_dot = load8(scratch.motion[first, 1], 0), load8(scratch.motion[first + 1, 1], 0)
    _xi_at_nodes(problem, scratch, s)
    if not is_circle(problem, s):
        store8(out, 0, splat8(0.0) - w_dot)
        return
    rate = splat8(abs(radius_of(problem, s))) * (u * w_dot - w * u_dot) / (u * u + w * w)
    rate = rate + splat8(slider[ARM] * slider[SPIN])
    if count_of(problem, s) > 2:
        rate = rate - splat8(math.copysign(1.0, slider[ARM])) * load8(scratch.motion[first + 2, 1], 0)
    store8(out, 0, rate)


@inlined
def _small_arctangents(tangent):
    """Arctangents of eight numbers up to `SMALL_ANGLE` by their series, to rounding."""
    z = tangent * tangent
    z_2 = z * z
    low = (splat8(1.0 / 3.0) - z * splat8(1.0 / 5.0)) + z_2 * (splat8(1.0 / 7.0) - z * splat8(1.0 / 9.0))
    high = (splat8(1.0 / 11.0) - z * splat8(1.0 / 13.0)) + z_2 * splat8(1.0 / 15.0)
    return tangent - tangent * (z * (low + z_2 * z_2 * high))


@inlined
def _xi_by_small_angles(problem, scratch, s, u_0, w_0, angle):
    """Write ξ at the nodes of a circle by the angles from a direction, if these are small; returns whether they are."""
    first, slider, out = row_of(problem, s), slider_of(problem, s), scratch.slid[s, NODE_XI]
    x, y = scratch.motion[first, 0], scratch.motion[first + 1, 0]
    u, w = load8(x, 0), load8(y, 0)
    along = splat8(u_0) * u + splat8(w_0) * w
    tangent = (splat8(u_0) * w - splat8(w_0) * u) / along
    if not (largest8(size8(tangent)) <= SMALL_ANGLE and least8(along) > 0.0):
        return False
    xi = splat8(abs(radius_of(problem, s))) * (splat8(angle) + _small_arctangents(tangent))
    xi = xi + splat8(slider[ARM] * slider[SPIN]) * load8(scratch.node_time, 0)
    if count_of(problem, s) > 2:
        xi = xi - splat8(math.copysign(1.0, slider[ARM])) * load8(scratch.motion[first + 2, 0], 0)
    store8(out, 0, xi)
    return True


@inlined
def _xi_at_nodes(problem, scratch, s):
    """ξ at the nodes, by the latched direction if it is near, else by that of the first node."""
    first, slider, radius = row_of(problem, s), slider_of(problem, s), radius_of(problem, s)
    u, w, out = scratch.motion[first, 0], scratch.motion[first + 1, 0], scratch.slid[s, NODE_XI]
    if is_circle(problem, s):
        if _xi_by_small_angles(problem, scratch, s, slider[ALONG], slider[ACROSS], slider[ANGLE]):
            return
        if _xi_by_small_angles(problem, scratch, s, u[0], w[0], angle_at(slider, u[0], w[0])):
            return
    third, rotation_before = count_of(problem, s) > 2, 0.0
    for i in range(S):
        turned = -scratch.motion[first + 2, 0, i] if third else 0.0
        xi, rotation = xi_of(radius, slider, scratch.node_time[i], u[i], w[i], turned), 0.0
        if radius != 0.0:
            rotation = surface_part(slider, scratch.node_time[i], turned)
        out[i] = rotation + nearest_turn(xi - rotation, out[i - 1] - rotation_before, radius) if i > 0 else xi
        rotation_before = rotation


@inlined
def _add_friction(run, s):
    """Add F_t ∂ξ/∂y to the forces on the rows at the nodes."""
    problem, scratch = run.problem, run.scratch
    first, out, force = row_of(problem, s), scratch.law_force, load8(scratch.slid[s, TANGENTIAL], 0)
    if not is_circle(problem, s):
        store8(out[first + 1], 0, splat8(0.0) - force)
        return
    u, w = load8(scratch.motion[first, 0], 0), load8(scratch.motion[first + 1, 0], 0)
    share = splat8(abs(radius_of(problem, s))) * force / (u * u + w * w)
    store8(out[first], 0, load8(out[first], 0) - share * w)
    store8(out[first + 1], 0, load8(out[first + 1], 0) + share * u)
    if count_of(problem, s) > 2:
        store8(out[first + 2], 0, splat8(-math.copysign(1.0, slider_of(problem, s)[ARM])) * force)


@inlined
def _spring_forces(radius, slider, slid):
    """F_t at the nodes of a slider that sticks."""
    stretch = load8(slid[NODE_XI], 0) - splat8(slider[SLIDER])
    store8(slid[TANGENTIAL], 0, splat8(slider[STIFFNESS]) * stretch)
    if largest8(size8(stretch)) < 0.5 * TURN * abs(radius):
        return
    for i in range(S):
        slid[TANGENTIAL, i] = slider[STIFFNESS] * spring_stretch(radius, slider, slid[NODE_XI, i])


@inner
def _forces(run, s):
    """Write N and the forces on the rows at the nodes into ``scratch.law_force``, F_t into ``scratch.slid``."""
    problem, scratch = run.problem, run.scratch
    slider, radius, slid, place = slider_of(problem, s), radius_of(problem, s), scratch.slid[s], place_of(problem, s)
    if is_circle(problem, s):
        radial_forces(run, s)
    else:
        motion = scratch.motion[place]
        above(motion[0], problem.knots[s, 0], scratch.clipped)
        law_forces(problem, s, S, scratch.clipped, motion[1], run.state.entry_rate[s], scratch.law_force[place])
        run.state.count[CALLS] += S
    if slider[CODE] == STICK:
        _xi_at_nodes(problem, scratch, s)
        _spring_forces(radius, slider, slid)
    else:
        store8(slid[TANGENTIAL], 0, splat8(friction_by_normal(slider)) * positive8(load8(scratch.law_force[place], 0)))
    _add_friction(run, s)


@part(RUB_FORCES, types.void, types.int64)
def rubbing_forces(run, s):
    """`_forces`, called at an address."""
    _forces(run, s)


@part(RUB_GUESS, types.void, types.int64)
def guess_rubbing_forces(run, s):
    """First guess of the forces on the rows at the nodes: those for the free response."""
    problem, scratch = run.problem, run.scratch
    for r in range(row_of(problem, s), row_of(problem, s + 1)):
        copy(scratch.free[r, 0], scratch.motion[r, 0], S)
        copy(scratch.free[r, 1], scratch.motion[r, 1], S)
    _forces(run, s)
    for r in range(row_of(problem, s), row_of(problem, s + 1)):
        copy(scratch.law_force[r], scratch.force[r], S)


@inlined
def _directions(sigma, radius, slider, u, w, a):
    """∂δ/∂y and ∂ξ/∂y of row a at a point (u, w); σ is 0 of an oblique stop."""
    if sigma == 0.0:
        return (1.0, 0.0) if a == 0 else (0.0, -1.0)
    if a == 2:
        return 0.0, -math.copysign(1.0, slider[ARM])
    square = u * u + w * w
    r, c = math.sqrt(square), abs(radius)
    return (sigma * u / r, -c * w / square) if a == 0 else (sigma * w / r, c * u / square)


@inlined
def _curvature_terms(sigma, radius, u, w, a, b, normal, tangential):
    """N ∂²δ/∂y_a∂y_b + F_t ∂²ξ/∂y_a∂y_b at a point (u, w)."""
    if sigma == 0.0 or a == 2 or b == 2:
        return 0.0
    square = u * u + w * w
    along, across = u if a == 0 else w, u if b == 0 else w
    same = 1.0 if a == b else 0.0
    by_radius = sigma * (same - along * across / square) / math.sqrt(square)
    sideways, c = -w if a == 0 else u, abs(radius)
    turn = -1.0 if a == 0 and b == 1 else 1.0 if a == 1 and b == 0 else 0.0
    return normal * by_radius + tangential * c * (turn - 2.0 * sideways * across / square) / square


@inlined
def sigma_of(problem, s):
    """1 of a circle, -1 of an outer one, 0 of an oblique stop."""
    return math.copysign(1.0, problem.radius[s]) if is_circle(problem, s) else 0.0


@inlined
def row_directions(problem, s, u, w, a):
    """∂δ/∂y and ∂ξ/∂y of row a of an element with friction, whose first two rows are displaced by u and w."""
    return _directions(sigma_of(problem, s), radius_of(problem, s), slider_of(problem, s), u, w, a)


@inlined
def friction_by_xi(slider):
    """∂F_t/∂ξ, N/m."""
    return slider[STIFFNESS] if slider[CODE] == STICK else 0.0


@inlined
def friction_by_normal(slider):
    """∂F_t/∂N; also at N = 0, where slip ends."""
    return slip_sign(slider) * slider[MU]


@inner
def row_slopes(problem, s, motion, i, rate, normal, tangential, by_delta, by_rate, out):
    """Slopes of the forces on the rows at point i: of a by displacement and rate of b, into row a m + b of ``out``.

    ``motion`` (m, 2, points) is that of the rows, ``rate`` is δ̇, ``by_delta`` and ``by_rate`` are slopes of the law.
    """
    slider, radius, m, sigma = slider_of(problem, s), radius_of(problem, s), count_of(problem, s), sigma_of(problem, s)
    u, w = motion[0, 0, i], motion[1, 0, i]
    r, by_xi, by_normal = math.sqrt(u * u + w * w), friction_by_xi(slider), friction_by_normal(slider)
    for b in range(m):
        delta_b, xi_b = _directions(sigma, radius, slider, u, w, b)
        turning = (sigma * motion[b, 1, i] - rate * sigma * delta_b) / r if sigma != 0.0 and b < 2 else 0.0
        for a in range(m):
            delta_a, xi_a = _directions(sigma, radius, slider, u, w, a)
            force_a = delta_a + by_normal * xi_a
            slope = force_a * (by_delta * delta_b + by_rate * turning) + xi_a * by_xi * xi_b
            out[a * m + b, 0, i] = slope + _curvature_terms(sigma, radius, u, w, a, b, normal, tangential)
            out[a * m + b, 1, i] = force_a * by_rate * delta_b


@part(RUB_NEWTON, types.void, *[types.int64] * 4)
def linearise_rubbing(run, node_set, level, s, begin):
    """Write the rows of Newton's matrix that belong to an element with friction, from its row ``begin`` on."""
    problem, scratch = run.problem, run.scratch
    first, m, slopes, column = row_of(problem, s), count_of(problem, s), scratch.row_slopes[9 * s : 9 * s + 9], 0
    place = place_of(problem, s)
    for i in range(S):
        row_slopes(
            *(problem, s, scratch.motion[first:], i, scratch.motion[place, 1, i], scratch.law_force[place, i]),
            *(scratch.slid[s, TANGENTIAL, i], scratch.slope[s, 0, i], scratch.slope[s, 1, i], slopes),
        )
    for u in range(problem.gap.size):
        if not acts(problem, run.state, u):
            continue
        for a in range(m):
            for i in range(S):
                for j in range(S):
                    own = u == first + a and i == j
                    scratch.jacobian[begin + a * S + i, column + j] = 1.0 if own else 0.0
        for b in range(m):
            matrix = pair_response(run, node_set, level, first + b, u)
            for a in range(m):
                slope = slopes[a * m + b]
                for i in range(S):
                    for j in range(S):
                        scratch.jacobian[begin + a * S + i, column + j] -= (
                            slope[0, i] * matrix[j, i] + slope[1, i] * matrix[j, S + i]
                        )
        column += S


@inner
def _work_of_friction(run, node_set, level, s, begin, end):
    """∫ F_t dξ, J, over the step just solved, in which ξ goes from ``begin`` to ``end``; see `step_integrals`."""
    tables = run.tables
    slider, slid, h = slider_of(run.problem, s), run.scratch.slid[s], tables.contact_step[level]
    if slider[CODE] == STICK:
        radius = radius_of(run.problem, s)
        first, last = spring_stretch(radius, slider, begin), spring_stretch(radius, slider, end)
        return 0.5 * slider[STIFFNESS] * (last - first) * (last + first)
    if resolves_rates(tables, node_set, s, h):
        return work_by_rates(tables, node_set, s, h, slid[TANGENTIAL], slid[NODE_XI_RATE])
    return work_by_places(tables, node_set, slid[TANGENTIAL], slid[NODE_XI], (begin, end), slid[SPARE])


@part(RUB_WORK, REAL, *[types.int64] * 3)
def work_with_friction(run, node_set, level, s):
    """Work of N, J, over the step just solved; work, impulse and slip distance of friction are added to the state."""
    state = run.state
    slider, slid, h = slider_of(run.problem, s), run.scratch.slid[s], run.tables.contact_step[level]
    account, t = run.problem.friction[s, 1], state.now[T]
    begin = xi_continued(run, s, t, state.x, 0)
    end = xi_continued(run, s, t + h, run.scratch.x_new, S - 1)
    work = _work_of_friction(run, node_set, level, s, begin, end)
    impulse = h * sum8(weights_of(run.tables, node_set, s) * load8(slid[TANGENTIAL], 0))
    state.x[account] += work
    state.x[account + 1] += impulse
    state.x[account + 2] += slip_sign(slider) * (end - begin)
    rows = work_in_circle(run, node_set, level, s)
    return rows - work + slider[ARM] * slider[SPIN] * impulse


@inlined
def _motion_at(run, r, i):
    """Displacement and rate of a row at point i of a panel."""
    problem = run.problem
    u, v = -problem.gap[r], 0.0
    for e in range(2 * problem.k.size):
        u += problem.read[r, e] * run.scratch.along[e, i]
        v += problem.read_rate[r, e] * run.scratch.along[e, i]
    return u, v


@part(RUB_WITHIN, types.UniTuple(REAL, 5), types.int64, types.int64)
def work_within_rubbing(run, s, first):
    """(work and impulse of N, work and impulse of F_t, slip distance) over a panel of the step.

    Motion and forces are given as for `work_within_circle`.
    """
    problem, scratch = run.problem, run.scratch
    row, radius, slider, weights = row_of(problem, s), radius_of(problem, s), slider_of(problem, s), run.tables.gauss[1]
    work, impulse, friction_work, friction_impulse, slip_distance, turning = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(S):
        u, u_dot = _motion_at(run, row, i)
        w, w_dot = _motion_at(run, row + 1, i)
        if count_of(problem, s) > 2:
            turning = -_motion_at(run, row + 2, i)[1]
        f, g = scratch.between[first + row, i], scratch.between[first + row + 1, i]
        rate, normal, tangential, xi_rate = u_dot, f, -g, -w_dot
        if radius != 0.0:
            square = u * u + w * w + _TINY  # the motion may be a change of one, for a derivative
            r = math.copysign(math.sqrt(square), radius)
            rate, normal = (u * u_dot + w * w_dot) / r, (f * u + g * w) / r
            tangential = (g * u - f * w) / abs(radius)
            xi_rate = abs(radius) * (u * w_dot - w * u_dot) / square + math.copysign(1.0, slider[ARM]) * turning
            xi_rate += slider[ARM] * slider[SPIN]
        if slip_sign(slider) != 0.0:  # from interpolated components it would have an error as large as that of N
            tangential = friction_by_normal(slider) * max(normal, 0.0)
        work += weights[i] * normal * rate
        impulse += weights[i] * normal
        friction_work += weights[i] * tangential * xi_rate
        friction_impulse += weights[i] * tangential
        slip_distance += weights[i] * scratch.between[first - 1, i] * slip_sign(slider) * xi_rate
    return work, impulse, friction_work, friction_impulse, slip_distance
