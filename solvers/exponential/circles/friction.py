"""Contacts with friction in a step: forces on their rows at the nodes, slopes of these, works.

With y the motions that the rows of an element read, see `compiled.friction`,

    force on the rows = N ∂δ/∂y + F_t ∂ξ/∂y,   it takes the power N δ̇ + F_t (ξ̇ - RΩ),

F_t = k_t (ξ - s) in stick and ±μN in slip. The prescribed part RΩt of ξ is known at the nodes, nothing else is special:
stick and slip are segments whose ends are borders, see `contact.slider_margins`.
"""

from __future__ import annotations

import math

from numba import types

from solvers.compiled.friction import TURN, drawn, slip_of, speed_of, way_of
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
from solvers.compiled.sums import above, combine
from solvers.exponential.circles.contact import radial_forces, work_in_circle
from solvers.exponential.contact.many_stops import pair_response
from solvers.exponential.contact.nodes import S
from solvers.problem.friction import ARM, CODE, MU, SPIN, STIFFNESS

WAYS, SPEEDS, TANGENTIAL, SPARE = range(4)  # rows of `Scratch.slid`: ξ, ξ̇ and F_t at the nodes, and numbers of a moment
_TINY = 1e-300  # m²
_SMALL = 0.1  # tangent of an angle whose series to the fifteenth power is exact to rounding
_BRIEF = 1.0  # radians of the fastest block in which nodes miss nothing of a rate


@inlined
def count_of(problem, s):
    """Number of rows of an element."""
    return row_of(problem, s + 1) - row_of(problem, s)


@inlined
def carried(own, t, turned):
    """The part of ξ by which the surface turns: it is known, and may be turns within a step."""
    return math.copysign(1.0, own[ARM]) * turned + own[ARM] * own[SPIN] * t


@inlined
def nearest_way(way, known, radius):
    """A way along a circle that is known up to whole turns, next to another one."""
    if radius == 0.0:
        return way
    turn = TURN * abs(radius)
    return way - turn * math.floor((way - known) / turn + 0.5)


@inner
def way_beside(problem, scratch, s, t, x, i):
    """ξ in the state x at time t, without a jump from that at node i."""
    own, radius, first = slider_of(problem, s), radius_of(problem, s), row_of(problem, s)
    u, _, w, _, turned, _ = rows_at(problem, s, x)
    there = -scratch.motion[first + 2, 0, i] if count_of(problem, s) > 2 else 0.0
    rest, known = carried(own, t, turned), scratch.slid[s, WAYS, i] - carried(own, scratch.node_time[i], there)
    return rest + nearest_way(way_of(radius, own, t, u, w, turned) - rest, known, radius)


@inner
def slide_at_nodes(problem, scratch, s):
    """ξ and ξ̇ at the nodes from the motion of the rows; ξ does not jump by a turn between two nodes."""
    first, own, radius = row_of(problem, s), slider_of(problem, s), radius_of(problem, s)
    u, w, slid, third = scratch.motion[first], scratch.motion[first + 1], scratch.slid[s], count_of(problem, s) > 2
    _ways_at_nodes(problem, scratch, s)
    for i in range(S):
        turning = -scratch.motion[first + 2, 1, i] if third else 0.0
        slid[SPEEDS, i] = speed_of(radius, own, u[0, i], u[1, i], w[0, i], w[1, i], turning)


@inlined
def _small_angles(tangent):
    """Arctangents up to `_SMALL` by their series, to rounding."""
    square, total = tangent * tangent, splat8(-1.0 / 15.0)
    total = splat8(1.0 / 13.0) + square * total
    total = splat8(-1.0 / 11.0) + square * total
    total = splat8(1.0 / 9.0) + square * total
    total = splat8(-1.0 / 7.0) + square * total
    total = splat8(1.0 / 5.0) + square * total
    total = splat8(-1.0 / 3.0) + square * total
    return tangent + tangent * square * total


@inlined
def _turns_little(problem, scratch, s):
    """ξ at the nodes of a circle by the angles from the first node on; whether these are small enough."""
    first, own, ways = row_of(problem, s), slider_of(problem, s), scratch.slid[s, WAYS]
    x, y = scratch.motion[first, 0], scratch.motion[first + 1, 0]
    u, w, u_0, w_0 = load8(x, 0), load8(y, 0), splat8(x[0]), splat8(y[0])
    along = u_0 * u + w_0 * w
    tangent = (u_0 * w - w_0 * u) / along
    if not (largest8(size8(tangent)) <= _SMALL and least8(along) > 0.0):
        return False
    way = splat8(abs(radius_of(problem, s))) * (splat8(math.atan2(y[0], x[0])) + _small_angles(tangent))
    way = way + splat8(own[ARM] * own[SPIN]) * load8(scratch.node_time, 0)
    if count_of(problem, s) > 2:
        way = way - splat8(math.copysign(1.0, own[ARM])) * load8(scratch.motion[first + 2, 0], 0)
    store8(ways, 0, way)
    return True


@inlined
def _ways_at_nodes(problem, scratch, s):
    """ξ alone; nearly always one arctangent tells the angles at all nodes."""
    if is_circle(problem, s) and _turns_little(problem, scratch, s):
        return
    first, own, radius = row_of(problem, s), slider_of(problem, s), radius_of(problem, s)
    u, w, ways = scratch.motion[first, 0], scratch.motion[first + 1, 0], scratch.slid[s, WAYS]
    third, before = count_of(problem, s) > 2, 0.0
    for i in range(S):
        turned = -scratch.motion[first + 2, 0, i] if third else 0.0
        way, rest = way_of(radius, own, scratch.node_time[i], u[i], w[i], turned), 0.0
        if radius != 0.0:
            rest = carried(own, scratch.node_time[i], turned)
        ways[i] = rest + nearest_way(way - rest, ways[i - 1] - before, radius) if i > 0 else way
        before = rest


@inlined
def _add_sideways(problem, scratch, s):
    """Add F_t ∂ξ/∂y to the forces on the rows at the nodes."""
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


@inner
def _forces(problem, tables, state, scratch, s):
    """N, F_t and the forces on the rows at the nodes for the motion of the rows, into ``scratch.law_force``."""
    own, radius, slid, place = slider_of(problem, s), radius_of(problem, s), scratch.slid[s], place_of(problem, s)
    if is_circle(problem, s):
        radial_forces(problem, tables, state, scratch, s)
    else:
        motion = scratch.motion[place]
        above(motion[0], problem.knots[s, 0], scratch.clipped)
        law_forces(problem, s, S, scratch.clipped, motion[1], state.entry_rate[s], scratch.law_force[place])
        state.count[CALLS] += S
    if own[CODE] == 0.0:
        _ways_at_nodes(problem, scratch, s)
        for i in range(S):
            slid[TANGENTIAL, i] = own[STIFFNESS] * drawn(radius, own, slid[WAYS, i])
    else:
        store8(slid[TANGENTIAL], 0, splat8(share_of(own)) * positive8(load8(scratch.law_force[place], 0)))
    _add_sideways(problem, scratch, s)


@part(RUB_FORCES, types.void, types.int64)
def rubbing_forces(problem, tables, state, scratch, s):
    """The same at an address."""
    _forces(problem, tables, state, scratch, s)


@part(RUB_GUESS, types.void, types.int64)
def guess_rubbing_forces(problem, tables, state, scratch, s):
    """First guess of the forces on the rows: those for the free response."""
    for r in range(row_of(problem, s), row_of(problem, s + 1)):
        copy(scratch.free[r, 0], scratch.motion[r, 0], S)
        copy(scratch.free[r, 1], scratch.motion[r, 1], S)
    _forces(problem, tables, state, scratch, s)
    for r in range(row_of(problem, s), row_of(problem, s + 1)):
        copy(scratch.law_force[r], scratch.force[r], S)


@inlined
def _ways(sigma, radius, own, u, w, a):
    """∂δ/∂y and ∂ξ/∂y by row a at a point, where σ is 0 of an oblique stop; u is (u, w)."""
    if sigma == 0.0:
        return (1.0, 0.0) if a == 0 else (0.0, -1.0)
    if a == 2:
        return 0.0, -math.copysign(1.0, own[ARM])
    square = u * u + w * w
    r, c = math.sqrt(square), abs(radius)
    return (sigma * u / r, -c * w / square) if a == 0 else (sigma * w / r, c * u / square)


@inlined
def _bent(sigma, radius, u, w, a, b, normal, tangential):
    """N ∂²δ/∂y_a∂y_b + F_t ∂²ξ/∂y_a∂y_b at a point."""
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
def ways_of(problem, s, u, w, a):
    """∂δ/∂y and ∂ξ/∂y by row a of an element with friction, where its first two rows are at u and w."""
    return _ways(sigma_of(problem, s), radius_of(problem, s), slider_of(problem, s), u, w, a)


@inlined
def spring_of(own):
    """∂F_t/∂ξ."""
    return own[STIFFNESS] if own[CODE] == 0.0 else 0.0


@inlined
def share_of(own):
    """∂F_t/∂N; at N = 0, where slip ends, that of the slip."""
    return slip_of(own) * own[MU]


@inner
def row_slopes(problem, s, motion, i, rate, normal, tangential, by_delta, by_rate, out):
    """Slopes of the forces on the rows at point i by the rows' displacements and rates, rows a m + b of ``out``.

    ``motion`` (m, 2, points) is that of the rows, ``rate`` δ̇; the law's slopes are given.
    """
    own, radius, m, sigma = slider_of(problem, s), radius_of(problem, s), count_of(problem, s), sigma_of(problem, s)
    u, w = motion[0, 0, i], motion[1, 0, i]
    r, drawn_by, pressed_by = math.sqrt(u * u + w * w), spring_of(own), share_of(own)
    for b in range(m):
        away, aside = _ways(sigma, radius, own, u, w, b)
        turning = (sigma * motion[b, 1, i] - rate * sigma * away) / r if sigma != 0.0 and b < 2 else 0.0
        for a in range(m):
            press, rub = _ways(sigma, radius, own, u, w, a)
            both = press + pressed_by * rub
            slope = both * (by_delta * away + by_rate * turning) + rub * drawn_by * aside
            out[a * m + b, 0, i] = slope + _bent(sigma, radius, u, w, a, b, normal, tangential)
            out[a * m + b, 1, i] = both * by_rate * away


@part(RUB_NEWTON, types.void, *[types.int64] * 4)
def linearise_rubbing(problem, tables, state, scratch, node_set, level, s, begin):
    """Write what the rows of an element with friction add to the matrix of Newton's method, from row ``begin`` on."""
    first, m, slopes, column = row_of(problem, s), count_of(problem, s), scratch.row_slopes[9 * s : 9 * s + 9], 0
    place = place_of(problem, s)
    for i in range(S):
        row_slopes(
            *(problem, s, scratch.motion[first:], i, scratch.motion[place, 1, i], scratch.law_force[place, i]),
            *(scratch.slid[s, TANGENTIAL, i], scratch.slope[s, 0, i], scratch.slope[s, 1, i], slopes),
        )
    for u in range(problem.gap.size):
        if not acts(problem, state, u):
            continue
        for a in range(m):
            for i in range(S):
                for j in range(S):
                    own = u == first + a and i == j
                    scratch.jacobian[begin + a * S + i, column + j] = 1.0 if own else 0.0
        for b in range(m):
            matrix = pair_response(problem, tables, scratch, node_set, level, first + b, u)
            for a in range(m):
                slope = slopes[a * m + b]
                for i in range(S):
                    for j in range(S):
                        scratch.jacobian[begin + a * S + i, column + j] -= (
                            slope[0, i] * matrix[j, i] + slope[1, i] * matrix[j, S + i]
                        )
        column += S


@inner
def _work_of_friction(problem, tables, scratch, node_set, level, s, begin, end):
    """∫ F_t dξ over the step just found, ξ going from ``begin`` to ``end``; see `contact.outputs`."""
    own, slid, h = slider_of(problem, s), scratch.slid[s], tables.contact_step[level]
    if own[CODE] == 0.0:
        radius = radius_of(problem, s)
        first, last = drawn(radius, own, begin), drawn(radius, own, end)
        return 0.5 * own[STIFFNESS] * (last - first) * (last + first)
    if s == node_set - 1 and tables.weight_exponent[node_set] > 0.0:
        return h * sum8(load8(tables.weights[node_set], 0) * load8(slid[TANGENTIAL], 0) * load8(slid[SPEEDS], 0))
    if h * tables.fastest <= _BRIEF:
        return h * sum8(load8(tables.plain[node_set], 0) * load8(slid[TANGENTIAL], 0) * load8(slid[SPEEDS], 0))
    combine(tables.work[node_set], slid[TANGENTIAL], S, None, slid[SPARE])
    work = sum8(load8(tables.work_end[node_set], 0) * load8(slid[TANGENTIAL], 0)) * (end - begin)
    for i in range(S):
        work += slid[SPARE, i] * (slid[WAYS, i] - begin)
    return work


@part(RUB_WORK, REAL, *[types.int64] * 3)
def work_with_friction(problem, tables, state, scratch, node_set, level, s):
    """Work of N, J, over the step just found; that of friction, its impulse and way go to the state."""
    own, slid, h = slider_of(problem, s), scratch.slid[s], tables.contact_step[level]
    account, t = problem.friction[s, 1], state.now[T]
    begin = way_beside(problem, scratch, s, t, state.x, 0)
    end = way_beside(problem, scratch, s, t + h, scratch.x_new, S - 1)
    work = _work_of_friction(problem, tables, scratch, node_set, level, s, begin, end)
    weighted = s == node_set - 1 and tables.weight_exponent[node_set] > 0.0
    weights = tables.weights[node_set] if weighted else tables.plain[node_set]
    impulse = h * sum8(load8(weights, 0) * load8(slid[TANGENTIAL], 0))
    state.x[account] += work
    state.x[account + 1] += impulse
    state.x[account + 2] += slip_of(own) * (end - begin)
    rows = work_in_circle(problem, tables, state, scratch, node_set, level, s)
    return rows - work + own[ARM] * own[SPIN] * impulse


@inlined
def _motion_at(problem, scratch, r, i):
    """Displacement and rate of a row at point i of a panel."""
    u, v = -problem.gap[r], 0.0
    for e in range(2 * problem.k.size):
        u += problem.read[r, e] * scratch.along[e, i]
        v += problem.read_rate[r, e] * scratch.along[e, i]
    return u, v


@part(RUB_WITHIN, types.UniTuple(REAL, 5), types.int64, types.int64)
def work_within_rubbing(problem, tables, scratch, s, first):
    """(works, impulses of N, F_t; way) on a panel within a step; the rows' forces as in `work_within_circle`."""
    row, radius, own, weights = row_of(problem, s), radius_of(problem, s), slider_of(problem, s), tables.gauss[1]
    pressed, push, rubbed, drag, way, turning = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(S):
        u, u_dot = _motion_at(problem, scratch, row, i)
        w, w_dot = _motion_at(problem, scratch, row + 1, i)
        if count_of(problem, s) > 2:
            turning = -_motion_at(problem, scratch, row + 2, i)[1]
        f, g = scratch.between[first + row, i], scratch.between[first + row + 1, i]
        rate, normal, tangential, speed = u_dot, f, -g, -w_dot
        if radius != 0.0:
            square = u * u + w * w + _TINY  # the motion may be a change of one, for a derivative
            r = math.copysign(math.sqrt(square), radius)
            rate, normal = (u * u_dot + w * w_dot) / r, (f * u + g * w) / r
            tangential = (g * u - f * w) / abs(radius)
            speed = abs(radius) * (u * w_dot - w * u_dot) / square + math.copysign(1.0, own[ARM]) * turning
            speed += own[ARM] * own[SPIN]
        if slip_of(own) != 0.0:  # of components that are interpolated it would have the error of N
            tangential = share_of(own) * max(normal, 0.0)
        pressed += weights[i] * normal * rate
        push += weights[i] * normal
        rubbed += weights[i] * tangential * speed
        drag += weights[i] * tangential
        way += weights[i] * scratch.between[first - 1, i] * slip_of(own) * speed
    return pressed, push, rubbed, drag, way
