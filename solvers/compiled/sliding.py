"""Stick and slip of friction under a contact's own force: where a slider's segment ends, and what begins there.

    stick      μN - |F_t|                     falls to zero: slip the way of F_t
    slip σ     σξ̇ - μṄ/k_t, its own speed     falls to zero: stick, s = ξ - σμN/k_t
               N                              falls to zero: free
    free       -N                             falls to zero: as at an entry
    entry      stick if N jumps or k_t |ξ̇| <= μṄ, s = ξ; else slip the way of ξ̇

With μ = 0 the slider always slips, and turns where ξ̇ does.

A *point* of an element is its motion there, as the places below name it; Ṅ = N_δ δ̇ + N_δ̇ δ̈. N of a law that is cut at
zero is here what it would be without the cut: its sign tells when the cut ends.
"""

from __future__ import annotations

import math

from solvers.compiled.friction import TURN, drawn, friction_force, slide, slide_acceleration, speed_of, way_of
from solvers.compiled.kernels import (
    abs_dot,
    acceleration_of,
    accelerations_at,
    call_gradient,
    delta_of,
    force_at,
    indentation,
    indentation_and_rate,
    indentation_rate,
    inlined,
    inner,
    is_circle,
    kernel,
    law_forces,
    off_knots,
    radial_acceleration,
    radius_of,
    rows_at,
    slide_of,
    slider_of,
)
from solvers.problem.friction import (
    ARM,
    CODE,
    CUT,
    FREE,
    MU,
    PEAK,
    PRESSES,
    SCRATCH,
    SLIDER,
    SLIDES,
    SPIN,
    STIFFNESS,
)

DELTA, RATE, ACCELERATION, WAY, SPEED, WAY_ACCELERATION = range(6)  # places in a point: δ, δ̇, δ̈, ξ, ξ̇, ξ̈
POINT = 6
STUCK, SLIPPED, FREED = range(3)  # codes of events, see `problem.friction.Rubbing`
_INSIDE = 1e-200  # m, where forces like δ^{1/4} grow without bound, and those like δ^{3/2} do not grow


@inner
def point_of(problem, s, t, x, rate, point):
    """Write the motion of an element with friction in a state with its rate."""
    radius, own, rows = radius_of(problem, s), slider_of(problem, s), rows_at(problem, s, x)
    u, u_dot, w, w_dot, turned, turning = rows
    u_twice, w_twice, turning_rate = accelerations_at(problem, s, rate)
    point[DELTA], point[RATE] = delta_of(radius, rows)
    point[ACCELERATION] = radial_acceleration(radius, u, u_dot, u_twice, w, w_dot, w_twice)
    point[WAY], point[SPEED] = slide(radius, own, t, u, u_dot, w, w_dot, turned, turning)
    args = u, u_dot, u_twice, w, w_dot, w_twice, turning_rate
    point[WAY_ACCELERATION] = slide_acceleration(radius, own, *args)


@inner
def motion_of_slider(problem, s, t, x, point):
    """The same without accelerations, and without the place of a slider that slips, which its margins do not need."""
    radius, own, rows = radius_of(problem, s), slider_of(problem, s), rows_at(problem, s, x)
    u, u_dot, w, w_dot, turned, turning = rows
    point[DELTA], point[RATE] = delta_of(radius, rows)
    point[WAY] = way_of(radius, own, t, u, w, turned) if own[CODE] == 0.0 else 0.0
    point[SPEED] = speed_of(radius, own, u, u_dot, w, w_dot, turning)
    point[ACCELERATION] = point[WAY_ACCELERATION] = 0.0


@inlined
def move_point(point, time, moved):
    """Where a point is a short time later."""
    moved[DELTA] = point[DELTA] + time * (point[RATE] + 0.5 * time * point[ACCELERATION])
    moved[RATE] = point[RATE] + time * point[ACCELERATION]
    moved[ACCELERATION] = point[ACCELERATION]
    moved[WAY] = point[WAY] + time * (point[SPEED] + 0.5 * time * point[WAY_ACCELERATION])
    moved[SPEED] = point[SPEED] + time * point[WAY_ACCELERATION]


@inlined
def _cut(problem, s, value):
    """Switch the cut of a law at N = 0 on, 1, or off, 0."""
    place = int(slider_of(problem, s)[CUT])
    if place >= 0:
        problem.parameters[s, place] = value


@inner
def normal_forces(problem, s, n, delta, rate, entry_rate, normal):
    """N at n points that are not below the surface, without a cut at zero."""
    _cut(problem, s, 0.0)
    law_forces(problem, s, n, delta, rate, entry_rate, normal)
    _cut(problem, s, 1.0)


@inner
def normal_slopes(problem, s, n, delta, rate, entry_rate, by_delta, by_rate, by_entry):
    """N_δ, N_δ̇ and the slope by the entry rate there."""
    results = by_delta, by_rate, by_entry
    _cut(problem, s, 0.0)
    call_gradient(problem.gradient[s], n, delta, rate, entry_rate, problem.parameters[s], results)
    _cut(problem, s, 1.0)


@inner
def normal_force(problem, s, segment, entry_rate, delta, rate):
    """N of a stop with friction; its scratch is left with δ, δ̇ and N.

    On a knot the law is asked beside it, and followed back along its slope: N must not jump where the law does not.
    """
    scratch = slider_of(problem, s)[SCRATCH:]
    beside = off_knots(problem, s, max(segment, 1), delta)
    _cut(problem, s, 0.0)
    normal = force_at(problem, s, beside, rate, entry_rate, scratch)
    _cut(problem, s, 1.0)
    if beside == delta:
        return normal
    slopes_of(problem, s, entry_rate)
    return normal - scratch[3] * (beside - delta)


@inner
def slopes_of(problem, s, entry_rate):
    """N_δ, N_δ̇ and the slope by the entry rate where `normal_force` was asked for."""
    scratch = slider_of(problem, s)[SCRATCH:]
    points, slopes = (scratch[0:1], scratch[1:2]), (scratch[3:4], scratch[4:5], scratch[5:6])
    normal_slopes(problem, s, 1, points[0], points[1], entry_rate, slopes[0], slopes[1], slopes[2])
    return scratch[3], scratch[4], scratch[5]


@kernel
def slider_force(problem, s, segment, entry_rate, t, x):
    """F_t of a stop with friction in a state, 0 while it is open."""
    if segment == 0:
        return 0.0
    normal = normal_force(problem, s, segment, entry_rate, *indentation_and_rate(problem, s, x))
    return friction_force(radius_of(problem, s), slider_of(problem, s), slide_of(problem, s, t, x)[0], normal)


@inner
def normal_rate(problem, s, rate, acceleration, entry_rate):
    """Ṅ, N/s, where `normal_force` was asked for."""
    by_delta, by_rate, _ = slopes_of(problem, s, entry_rate)
    found = by_delta * rate
    return found + by_rate * acceleration if by_rate != 0.0 else found


@inner
def slider_margins(problem, s, segment, entry_rate, point, out):
    """Margins of a slider's segment at a point: of its own border, N, of slip m/s; and of the second one, N in slip."""
    own, two = slider_of(problem, s), problem.border_count[s] > PRESSES
    code = own[CODE]
    out[SLIDES] = 1.0
    if two:
        out[PRESSES] = 1.0
    if segment == 0:
        return
    normal = normal_force(problem, s, segment, entry_rate, point[DELTA], point[RATE])
    if code == FREE:
        out[SLIDES] = -normal
    elif code == 0.0:
        out[SLIDES] = own[MU] * normal - abs(friction_force(radius_of(problem, s), own, point[WAY], normal))
    else:
        out[SLIDES] = code * point[SPEED]
        if own[MU] > 0.0:
            growing = normal_rate(problem, s, point[RATE], point[ACCELERATION], entry_rate)
            out[SLIDES] -= own[MU] / own[STIFFNESS] * growing
        if two:
            out[PRESSES] = normal


@inlined
def _latch(own, way, speed, growing):
    """Latch stick or slip where N begins to grow at a rate; without μ it slips."""
    own[SLIDER], own[CODE] = way, 0.0
    if own[MU] == 0.0 or own[STIFFNESS] * abs(speed) > own[MU] * growing:
        own[CODE] = math.copysign(1.0, speed)


@inner
def begin_slider(problem, s, t, x, entry_rate, under_way):
    """Latch what a slider does as a contact begins; one that is under way as the run begins sticks, or is free."""
    own, growing = slider_of(problem, s), math.inf
    (way, speed), rate = slide_of(problem, s, t, x), indentation_rate(problem, s, x)
    own[PEAK] = 0.0
    pressed = normal_force(problem, s, 1, entry_rate, indentation(problem, s, x) if under_way else 0.0, rate)
    if under_way and pressed <= 0.0 and problem.border_count[s] > PRESSES:
        own[CODE], own[SLIDER] = FREE, 0.0
        return
    if not under_way and pressed <= 0.0:
        normal_force(problem, s, 1, entry_rate, _INSIDE, rate)
        growing = normal_rate(problem, s, rate, 0.0, entry_rate)
    _latch(own, way, speed, growing)


@inner
def end_slider(problem, s):
    """Forget the slider of a contact that has ended."""
    own = slider_of(problem, s)
    own[CODE], own[SLIDER] = FREE, 0.0


@inner
def way_tolerance(problem, s, t, x):
    """What rounding may make of ξ, m, and of ξ̇, m/s; on a line both are read by the second row alone."""
    own, first, size = slider_of(problem, s), problem.first[s], 2 * problem.k.size
    way, speed = TURN * abs(radius_of(problem, s)) + abs(own[ARM] * own[SPIN] * t), abs(own[ARM] * own[SPIN])
    for r in range(first if is_circle(problem, s) else first + 1, problem.first[s + 1]):
        way += abs(problem.gap[r]) + abs_dot(problem.read[r], x, size)
        speed += abs_dot(problem.read_rate[r], x, size)
    return 1e-15 * way + 1e-20, 1e-13 * speed


@inner
def _slide_acceleration(problem, s, x, rate_of_x):
    """ξ̈ in a state whose rate is known."""
    u, u_dot, w, w_dot, _, _ = rows_at(problem, s, x)
    u_twice, w_twice, turning_rate = accelerations_at(problem, s, rate_of_x)
    args = u, u_dot, u_twice, w, w_dot, w_twice, turning_rate
    return slide_acceleration(radius_of(problem, s), slider_of(problem, s), *args)


@inner
def renew_slider(problem, s, j, entry_rate, segment, t, x, rate_of_x, out):
    """Begin the segment behind border j in a state; ξ, ξ̇ and F_t go to ``out``. Returns the code of the event.

    F_t has the sign of the slip that begins, though it be a zero, and of one that ends because N does.
    """
    own, radius = slider_of(problem, s), radius_of(problem, s)
    way, speed = slide_of(problem, s, t, x)
    force = slider_force(problem, s, segment, entry_rate, t, x)
    out[0], out[1], out[2] = way, speed, force
    if j == PRESSES:
        out[2] = math.copysign(0.0, own[CODE])
        own[CODE], own[SLIDER] = FREE, 0.0
        return FREED
    if own[CODE] == FREE:
        acceleration = acceleration_of(problem, s, x, rate_of_x)
        _latch(own, way, speed, normal_rate(problem, s, indentation_rate(problem, s, x), acceleration, entry_rate))
        return STUCK if own[CODE] == 0.0 else SLIPPED
    if own[MU] == 0.0 and own[CODE] != 0.0:
        own[CODE] = -own[CODE]
        return SLIPPED
    if own[CODE] == 0.0:
        little, slow = way_tolerance(problem, s, t, x)
        if abs(drawn(radius, own, way)) > little:
            own[CODE] = math.copysign(1.0, force)
        elif abs(speed) > slow:
            own[CODE] = math.copysign(1.0, speed)
        else:  # at rest on the surface it goes where it is pushed
            own[CODE] = math.copysign(1.0, _slide_acceleration(problem, s, x, rate_of_x))
        out[2] = math.copysign(force, own[CODE])
        return SLIPPED
    own[SLIDER] = way - force / own[STIFFNESS]
    own[CODE] = 0.0
    return STUCK
