"""Stick and slip of friction under a contact's own force: where a slider's segment ends, and what begins there.

    stick      μN - |F_t|                     falls to zero: slip the way of F_t
    slip σ     σξ̇ - μṄ/k_t, its own speed     falls to zero: stick, s = ξ - σμN/k_t
    entry      stick if N jumps or k_t |ξ̇| <= μṄ, s = ξ; else slip the way of ξ̇

With μ = 0 the slider always slips, and turns where ξ̇ does.

A *point* of an element is its motion there, as the places below name it; Ṅ = N_δ δ̇ + N_δ̇ δ̈. Where N <= 0 the limit is 0
and the slider follows.
"""

from __future__ import annotations

import math

from solvers.compiled.friction import TURN, drawn, friction_force
from solvers.compiled.kernels import (
    abs_dot,
    acceleration_of,
    call_gradient,
    force_at,
    indentation,
    indentation_rate,
    inlined,
    inner,
    kernel,
    off_knots,
    radius_of,
    slide_acceleration_of,
    slide_of,
    slider_of,
)
from solvers.problem.friction import ARM, CODE, FREE, MU, PEAK, SCRATCH, SLIDER, SPIN, STIFFNESS

DELTA, RATE, ACCELERATION, WAY, SPEED, WAY_ACCELERATION = range(6)  # places in a point: δ, δ̇, δ̈, ξ, ξ̇, ξ̈
POINT = 6
STUCK, SLIPPED = range(2)  # codes of events, see `problem.friction.Rubbing`
NONE = 1e-8  # limit μN, in units of the largest |F_t| of the contact, that counts as none
_INSIDE = 1e-200  # m, where forces like δ^{1/4} grow without bound, and those like δ^{3/2} do not grow


@inner
def point_of(problem, s, t, x, rate, point):
    """Write the motion of an element with friction in a state with its rate."""
    point[DELTA], point[RATE] = indentation(problem, s, x), indentation_rate(problem, s, x)
    point[ACCELERATION] = acceleration_of(problem, s, x, rate)
    point[WAY], point[SPEED] = slide_of(problem, s, t, x)
    point[WAY_ACCELERATION] = slide_acceleration_of(problem, s, x, rate)


@inlined
def move_point(point, time, moved):
    """Where a point is a short time later."""
    moved[DELTA] = point[DELTA] + time * (point[RATE] + 0.5 * time * point[ACCELERATION])
    moved[RATE] = point[RATE] + time * point[ACCELERATION]
    moved[ACCELERATION] = point[ACCELERATION]
    moved[WAY] = point[WAY] + time * (point[SPEED] + 0.5 * time * point[WAY_ACCELERATION])
    moved[SPEED] = point[SPEED] + time * point[WAY_ACCELERATION]


@inner
def normal_force(problem, s, segment, entry_rate, delta, rate):
    """N of a stop with friction; its scratch is left with δ, δ̇ and N.

    On a knot the law is asked beside it, and followed back along its slope: N must not jump where the law does not.
    """
    scratch = slider_of(problem, s)[SCRATCH:]
    beside = off_knots(problem, s, max(segment, 1), delta)
    normal = force_at(problem, s, beside, rate, entry_rate, scratch)
    if beside == delta:
        return normal
    _slopes(problem, s, entry_rate, scratch)
    return normal - scratch[3] * (beside - delta)


@inlined
def _slopes(problem, s, entry_rate, scratch):
    """N_δ and N_δ̇ at the point left in the scratch, behind it."""
    results = scratch[3:4], scratch[4:5], scratch[5:6]
    call_gradient(problem.gradient[s], 1, scratch[0:1], scratch[1:2], entry_rate, problem.parameters[s], results)


@kernel
def slider_force(problem, s, segment, entry_rate, t, x):
    """F_t of a stop with friction in a state, 0 while it is open."""
    if segment == 0:
        return 0.0
    normal = normal_force(problem, s, segment, entry_rate, indentation(problem, s, x), indentation_rate(problem, s, x))
    return friction_force(radius_of(problem, s), slider_of(problem, s), slide_of(problem, s, t, x)[0], normal)


@inner
def normal_rate(problem, s, rate, acceleration, entry_rate):
    """Ṅ, N/s, where `normal_force` was asked for."""
    scratch = slider_of(problem, s)[SCRATCH:]
    _slopes(problem, s, entry_rate, scratch)
    found = scratch[3] * rate
    return found + scratch[4] * acceleration if scratch[4] != 0.0 else found


@inner
def pressed_margin(problem, s, segment, entry_rate, point):
    """Margin of a slider's segment at a point, N in stick, m/s in slip; of slip as if N > 0."""
    own = slider_of(problem, s)
    normal = normal_force(problem, s, segment, entry_rate, point[DELTA], point[RATE])
    if own[CODE] == 0.0:
        return own[MU] * max(normal, 0.0) - abs(friction_force(radius_of(problem, s), own, point[WAY], normal))
    if own[MU] == 0.0:
        return own[CODE] * point[SPEED]
    growing = normal_rate(problem, s, point[RATE], point[ACCELERATION], entry_rate)
    return own[CODE] * point[SPEED] - own[MU] / own[STIFFNESS] * growing


@inner
def slider_margin(problem, s, segment, entry_rate, point):
    """The same; slip does not end while its limit is none, but with μ = 0, which turns it."""
    own, speed = slider_of(problem, s), point[SPEED]
    code = own[CODE]
    if segment == 0 or code == FREE:
        return 1.0
    margin = pressed_margin(problem, s, segment, entry_rate, point)
    if code == 0.0 or own[MU] == 0.0 or own[MU] * own[SCRATCH + 2] > NONE * own[PEAK]:
        return margin
    return abs(speed) + abs(code * speed - margin)


@inner
def begin_slider(problem, s, t, x, entry_rate, under_way):
    """Latch stick or slip as a contact begins; one that is under way as the run begins sticks."""
    own = slider_of(problem, s)
    way, speed = slide_of(problem, s, t, x)
    own[SLIDER], own[CODE], own[PEAK] = way, 0.0, 0.0
    slips = own[MU] == 0.0
    if not under_way and not slips:
        rate = indentation_rate(problem, s, x)
        slips = normal_force(problem, s, 1, entry_rate, 0.0, rate) <= 0.0
        normal_force(problem, s, 1, entry_rate, _INSIDE, rate)
        slips &= own[STIFFNESS] * abs(speed) > own[MU] * normal_rate(problem, s, rate, 0.0, entry_rate)
    if slips:
        own[CODE] = math.copysign(1.0, speed)


@inner
def end_slider(problem, s):
    """Forget the slider of a contact that has ended."""
    own = slider_of(problem, s)
    own[CODE], own[SLIDER] = FREE, 0.0


@inner
def way_tolerance(problem, s, t, x):
    """What rounding may make of ξ, m, and of ξ̇, m/s."""
    own, first, size = slider_of(problem, s), problem.first[s], 2 * problem.k.size
    way, speed = TURN * abs(radius_of(problem, s)) + abs(own[ARM] * own[SPIN] * t), abs(own[ARM] * own[SPIN])
    for r in range(first, problem.first[s + 1]):
        way += abs(problem.gap[r]) + abs_dot(problem.read[r], x, size)
        speed += abs_dot(problem.read_rate[r], x, size)
    return 1e-15 * way + 1e-20, 1e-13 * speed


@inner
def renew_slider(problem, s, entry_rate, segment, t, x, out):
    """Begin slip or stick in a state; ξ, ξ̇ and F_t go to ``out``. Returns the code of the event."""
    own, radius = slider_of(problem, s), radius_of(problem, s)
    way, speed = slide_of(problem, s, t, x)
    force = slider_force(problem, s, segment, entry_rate, t, x)
    out[0], out[1], out[2] = way, speed, force
    if own[MU] == 0.0 and own[CODE] != 0.0:
        own[CODE] = -own[CODE]
        return SLIPPED
    if own[CODE] == 0.0:
        undrawn = abs(drawn(radius, own, way)) <= way_tolerance(problem, s, t, x)[0]
        own[CODE] = math.copysign(1.0, speed if undrawn else force)
        return SLIPPED
    own[SLIDER] = way - force / own[STIFFNESS]
    own[CODE] = 0.0
    return STUCK
