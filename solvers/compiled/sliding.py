"""Stick and slip of friction under a contact's own force: where a slider's segment ends, and what begins there.

    stick      margin μN - |F_t|            at zero: slip in the direction of F_t
    slip σ     margin σξ̇ - μṄ/k_t = σṡ      at zero, and where N jumps up: stick, s = ξ - σμN/k_t with N before
               margin N                     at zero: free
    free       margin -N                    at zero, and where N jumps up from below: as at an entry
    entry      stick if N jumps or k_t |ξ̇| <= μṄ, s = ξ; else slip in the direction of ξ̇

With μ = 0 the slider always slips, and changes its direction with ξ̇.

A *point* of an element is its motion there, as the places below name it; Ṅ = N_δ δ̇ + N_δ̇ δ̈. N of a law that is cut
at zero is taken without the cut here: its sign tells when the cut ends.
"""

from __future__ import annotations

import math

from solvers.compiled.friction import (
    TURN,
    friction_force,
    latch_angle,
    spring_stretch,
    xi_acceleration_of,
    xi_of,
    xi_rate_of,
)
from solvers.compiled.kernels import (
    abs_dot,
    acceleration_of,
    accelerations_at,
    call_gradient,
    delta_of,
    force_at,
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
    slider_of,
    surface_tolerance,
    xi_and_rate_at,
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
    STICK,
    STIFFNESS,
)

DELTA, RATE, ACCELERATION, XI, XI_RATE, XI_ACCELERATION = range(6)  # places in a point: δ, δ̇, δ̈, ξ, ξ̇, ξ̈
POINT = 6
STUCK, SLIPPED, FREED = range(3)  # codes of events, see `problem.friction.Rubbing`
WITHIN_ROUNDING = 100.0  # δ, in units of its rounding, below which a slip as a contact begins or ends is not told
_JUMP = 1e-6  # of what its terms give: N that begins beyond zero by more, or grows by more on a knot, jumps
_JUST_INSIDE = 1e-200  # m: there forces like δ^{1/4} have an unbounded slope, and those like δ^{3/2} a slope of zero


@inner
def point_of(problem, s, t, x, rate, point):
    """Write the point of an element with friction in a state x with the rate x'; ξ only of a slider that sticks."""
    u, u_dot, w, w_dot, _, _ = motion_without_accelerations(problem, s, t, x, point)
    u_twice, w_twice, turning_rate = accelerations_at(problem, s, rate)
    radius, slider = radius_of(problem, s), slider_of(problem, s)
    point[ACCELERATION] = radial_acceleration(radius, u, u_dot, u_twice, w, w_dot, w_twice)
    args = u, u_dot, u_twice, w, w_dot, w_twice, turning_rate
    point[XI_ACCELERATION] = xi_acceleration_of(radius, slider, *args)


@inner
def motion_without_accelerations(problem, s, t, x, point):
    """The same without accelerations, which is enough for most margins; returns the motion of the rows."""
    radius, slider, rows = radius_of(problem, s), slider_of(problem, s), rows_at(problem, s, x)
    u, u_dot, w, w_dot, turned, turning = rows
    point[DELTA], point[RATE] = delta_of(radius, rows)
    point[XI] = xi_of(radius, slider, t, u, w, turned) if slider[CODE] == STICK else 0.0
    point[XI_RATE] = xi_rate_of(radius, slider, u, u_dot, w, w_dot, turning)
    point[ACCELERATION] = point[XI_ACCELERATION] = 0.0
    return rows


@inlined
def move_point(point, time, moved):
    """Extrapolate a point by a short time, with constant accelerations."""
    moved[DELTA] = point[DELTA] + time * (point[RATE] + 0.5 * time * point[ACCELERATION])
    moved[RATE] = point[RATE] + time * point[ACCELERATION]
    moved[ACCELERATION] = point[ACCELERATION]
    moved[XI] = point[XI] + time * (point[XI_RATE] + 0.5 * time * point[XI_ACCELERATION])
    moved[XI_RATE] = point[XI_RATE] + time * point[XI_ACCELERATION]


@inlined
def _cut(problem, s, value):
    """Switch the cut of a law at N = 0 on, 1, or off, 0."""
    place = int(slider_of(problem, s)[CUT])
    if place >= 0:
        problem.parameters[s, place] = value


@inner
def normal_forces(problem, s, n, delta, rate, entry_rate, normal):
    """N at n points with δ >= 0, without a cut at zero."""
    _cut(problem, s, 0.0)
    law_forces(problem, s, n, delta, rate, entry_rate, normal)
    _cut(problem, s, 1.0)


@inner
def normal_slopes(problem, s, n, delta, rate, entry_rate, by_delta, by_rate, by_entry):
    """N_δ, N_δ̇ and the slope by the entry rate at n points, without a cut at zero."""
    results = by_delta, by_rate, by_entry
    _cut(problem, s, 0.0)
    call_gradient(problem.gradient[s], n, delta, rate, entry_rate, problem.parameters[s], results)
    _cut(problem, s, 1.0)


@inner
def normal_force(problem, s, segment, entry_rate, delta, rate):
    """N of a stop with friction; the slider's scratch is left with δ, δ̇ and N.

    On a knot the law is evaluated beside it and extrapolated back along its slope, so that N jumps only where the law
    does.
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
    """N_δ, N_δ̇ and the slope by the entry rate at the point of the last `normal_force`."""
    scratch = slider_of(problem, s)[SCRATCH:]
    points, slopes = (scratch[0:1], scratch[1:2]), (scratch[3:4], scratch[4:5], scratch[5:6])
    normal_slopes(problem, s, 1, points[0], points[1], entry_rate, slopes[0], slopes[1], slopes[2])
    return scratch[3], scratch[4], scratch[5]


@kernel
def slider_force(problem, s, segment, entry_rate, t, x):
    """F_t, N, of a stop with friction in a state, 0 while it is open."""
    if segment == 0:
        return 0.0
    radius, slider, rows = radius_of(problem, s), slider_of(problem, s), rows_at(problem, s, x)
    u, _, w, _, turned, _ = rows
    xi = xi_of(radius, slider, t, u, w, turned) if slider[CODE] == STICK else 0.0
    normal = normal_force(problem, s, segment, entry_rate, *delta_of(radius, rows))
    return friction_force(radius, slider, xi, normal if slider[CODE] == STICK else max(normal, 0.0))


@inner
def normal_rate(problem, s, rate, acceleration, entry_rate):
    """Ṅ, N/s, at the point of the last `normal_force`."""
    by_delta, by_rate, _ = slopes_of(problem, s, entry_rate)
    found = by_delta * rate
    return found + by_rate * acceleration if by_rate != 0.0 else found


@inner
def slider_margins(problem, s, segment, entry_rate, point, out):
    """Margins of a slider's segment at a point: of its own border, N or in slip m/s; then N in slip.

    The second one exists if N may fall to zero before the contact opens.
    """
    slider, two_borders = slider_of(problem, s), problem.border_count[s] > PRESSES
    code = slider[CODE]
    out[SLIDES] = 1.0
    if two_borders:
        out[PRESSES] = 1.0
    if segment == 0:
        return
    normal = normal_force(problem, s, segment, entry_rate, point[DELTA], point[RATE])
    if code == FREE:
        out[SLIDES] = -normal
    elif code == STICK:
        out[SLIDES] = slider[MU] * normal - abs(friction_force(radius_of(problem, s), slider, point[XI], normal))
    else:
        out[SLIDES] = code * point[XI_RATE]
        if slider[MU] > 0.0:
            growth = normal_rate(problem, s, point[RATE], point[ACCELERATION], entry_rate)
            out[SLIDES] -= slider[MU] / slider[STIFFNESS] * growth
        if two_borders:
            out[PRESSES] = normal


@inlined
def _latch_stick_or_slip(slider, xi, xi_rate, growth):
    """Latch stick at ξ or slip, where N begins to grow at a rate, N/s; with μ = 0 it slips."""
    slider[SLIDER], slider[CODE] = xi, 0.0
    if slider[MU] == 0.0 or slider[STIFFNESS] * abs(xi_rate) > slider[MU] * growth:
        slider[CODE] = math.copysign(1.0, xi_rate)


@inlined
def _growth_at(problem, s, entry_rate, delta, rate):
    """Ṅ, N/s, at a small indentation that grows at a rate."""
    normal_force(problem, s, 1, entry_rate, delta, rate)
    return normal_rate(problem, s, rate, 0.0, entry_rate)


@inner
def pulls(problem, s, entry_rate, x):
    """Whether N, which may fall to zero within a contact, does not press in a state."""
    delta, rate = indentation_and_rate(problem, s, x)
    return problem.border_count[s] > PRESSES and normal_force(problem, s, 1, entry_rate, delta, rate) <= 0.0


@inner
def begin_slider(problem, s, t, x, entry_rate, under_way):
    """Latch stick, slip or freedom of a slider as a contact begins.

    A contact ``under_way`` as the run begins sticks or is free. A slip that would end within the rounding of δ, as
    N ~ δ^{6/5} grows, is not begun.
    """
    slider, growth = slider_of(problem, s), math.inf
    if is_circle(problem, s):
        u, _, w, _, _, _ = rows_at(problem, s, x)
        latch_angle(slider, u, w)
    (xi, xi_rate), rate = xi_and_rate_at(problem, s, t, x), indentation_rate(problem, s, x)
    slider[PEAK] = 0.0
    if under_way and pulls(problem, s, entry_rate, x):
        slider[CODE], slider[SLIDER] = FREE, 0.0
        return
    if not under_way and normal_force(problem, s, 1, entry_rate, 0.0, rate) <= 0.0:
        growth = max(
            _growth_at(problem, s, entry_rate, _JUST_INSIDE, rate),
            _growth_at(problem, s, entry_rate, WITHIN_ROUNDING * surface_tolerance(problem, s, x), rate),
        )
    _latch_stick_or_slip(slider, xi, xi_rate, growth)


@inner
def is_held(problem, s, entry_rate, segment, following, delta, rate):
    """Whether N jumps up on a knot, from one segment to another, while the slider slips: it sticks from then on.

    Its spring stays drawn by μN of before, which is less than the new limit.
    """
    slider = slider_of(problem, s)
    if abs(slider[CODE]) != 1.0 or slider[MU] == 0.0:
        return False
    before = normal_force(problem, s, segment, entry_rate, delta, rate)
    after = normal_force(problem, s, following, entry_rate, delta, rate)
    return after - before > _JUMP * abs(after)


@inner
def begins_beyond_zero(problem, s, entry_rate, segment, x):
    """Whether N, of what was free, is positive by more than the place of a border is known to: it has jumped."""
    delta, rate = indentation_and_rate(problem, s, x)
    normal = normal_force(problem, s, segment, entry_rate, delta, rate)
    by_delta, by_rate, _ = slopes_of(problem, s, entry_rate)
    return normal > _JUMP * (abs(by_delta * delta) + abs(by_rate * rate))


@inner
def end_slider(problem, s):
    """Reset the slider of a contact that has ended."""
    slider = slider_of(problem, s)
    slider[CODE], slider[SLIDER] = FREE, 0.0


@inner
def xi_tolerances(problem, s, t, x):
    """Rounding of ξ, m, and of ξ̇, m/s; of an oblique stop both are read by the second row alone."""
    slider, first, size = slider_of(problem, s), problem.first[s], 2 * problem.k.size
    xi, rate = TURN * abs(radius_of(problem, s)) + abs(slider[ARM] * slider[SPIN] * t), abs(slider[ARM] * slider[SPIN])
    for r in range(first if is_circle(problem, s) else first + 1, problem.first[s + 1]):
        xi += abs(problem.gap[r]) + abs_dot(problem.read[r], x, size)
        rate += abs_dot(problem.read_rate[r], x, size)
    return 1e-15 * xi + 1e-20, 1e-13 * rate


@inner
def _xi_acceleration_at(problem, s, x, rate_of_x):
    """ξ̈, m/s², in a state whose rate is known."""
    u, u_dot, w, w_dot, _, _ = rows_at(problem, s, x)
    u_twice, w_twice, turning_rate = accelerations_at(problem, s, rate_of_x)
    args = u, u_dot, u_twice, w, w_dot, w_twice, turning_rate
    return xi_acceleration_of(radius_of(problem, s), slider_of(problem, s), *args)


@inner
def renew_slider(problem, s, j, entry_rate, segment, t, x, rate_of_x, out):
    """Begin the segment behind border j in a state; writes ξ, ξ̇ and F_t to ``out``, returns the code of the event.

    F_t, even if zero, has the sign of the slip that begins, or of the slip that ends as N does.
    """
    slider, radius = slider_of(problem, s), radius_of(problem, s)
    xi, xi_rate = xi_and_rate_at(problem, s, t, x)
    force = slider_force(problem, s, segment, entry_rate, t, x)
    out[0], out[1], out[2] = xi, xi_rate, force
    if j == PRESSES:
        out[2] = math.copysign(0.0, slider[CODE])
        slider[CODE], slider[SLIDER] = FREE, 0.0
        return FREED
    if slider[CODE] == FREE:
        growth, acceleration = math.inf, acceleration_of(problem, s, x, rate_of_x)
        if not begins_beyond_zero(problem, s, entry_rate, segment, x):
            growth = normal_rate(problem, s, indentation_rate(problem, s, x), acceleration, entry_rate)
        _latch_stick_or_slip(slider, xi, xi_rate, growth)
        return STUCK if slider[CODE] == STICK else SLIPPED
    if slider[MU] == 0.0 and slider[CODE] != STICK:
        slider[CODE] = -slider[CODE]
        return SLIPPED
    if slider[CODE] == STICK:
        xi_rounding, rate_rounding = xi_tolerances(problem, s, t, x)
        if abs(spring_stretch(radius, slider, xi)) > xi_rounding:
            slider[CODE] = math.copysign(1.0, force)
        elif abs(xi_rate) > rate_rounding:
            slider[CODE] = math.copysign(1.0, xi_rate)
        else:  # from rest it slips in the direction of its acceleration
            slider[CODE] = math.copysign(1.0, _xi_acceleration_at(problem, s, x, rate_of_x))
        out[2] = math.copysign(force, slider[CODE])
        return SLIPPED
    slider[SLIDER] = xi - force / slider[STIFFNESS]
    slider[CODE] = 0.0
    return STUCK
