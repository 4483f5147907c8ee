"""Friction of an element: its tangential displacement ξ, and the force of its slider.

``slider`` holds the numbers that begin at ``problem.friction[s, 0]`` among the parameters of the element, see
`problem.friction`. The rows of an oblique stop read δ + g and -ξ, those of a circular clearance u = (u, w) from the
place to the centre and, where there is a third, -|R| φ, which is ``turned`` with its sign changed:

    ξ = c θ + R (φ + Ω t),   ξ̇ = c (u × u̇)/r² + R (φ̇ + Ω),   forces F_t (c/r) (-u_y, u_x)/r and, on |R| φ, -F_t R/|R|

The angle θ is known up to whole turns. It is that from a direction near the place, latched at entry, to which a series
is quicker than the arctangent. The spring of a slider that sticks stretches by far less than half a turn, so
that ξ - s is taken at the nearest turn.
"""

from __future__ import annotations

import math

from solvers.compiled.decorators import inlined
from solvers.problem.friction import ACROSS, ALONG, ANGLE, ARM, CODE, FREE, MU, SLIDER, SPIN, STICK, STIFFNESS

TURN = 2.0 * math.pi
SMALL_ANGLE = 0.1  # tangent up to which the series of the arctangent to the fifteenth power is exact to rounding


@inlined
def angle_between(product, along):
    """Angle, rad, between two vectors from their products, the crossed one and the scalar one."""
    tangent = product / along
    if not (along > 0.0 and abs(tangent) <= SMALL_ANGLE):
        return math.atan2(product, along)
    z = tangent * tangent
    z_2 = z * z
    low = (1.0 / 3.0 - z * (1.0 / 5.0)) + z_2 * (1.0 / 7.0 - z * (1.0 / 9.0))
    high = (1.0 / 11.0 - z * (1.0 / 13.0)) + z_2 * (1.0 / 15.0)
    return tangent - tangent * (z * (low + z_2 * z_2 * high))


@inlined
def angle_at(slider, u, w):
    """Angle θ, rad, of the vector (u, w)."""
    along, across = slider[ALONG], slider[ACROSS]
    return slider[ANGLE] + angle_between(along * w - across * u, along * u + across * w)


@inlined
def latch_angle(slider, u, w):
    """Latch a direction (u, w), from which angles of others near it are measured."""
    slider[ALONG], slider[ACROSS], slider[ANGLE] = u, w, math.atan2(w, u)


@inlined
def xi_of(radius, slider, t, u, w, turned):
    """ξ, m, from the displacements u, w of the first two rows, and of the third with its sign changed, ``turned``."""
    if radius == 0.0:
        return -w
    return (
        abs(radius) * angle_at(slider, u, w) + math.copysign(1.0, slider[ARM]) * turned + slider[ARM] * slider[SPIN] * t
    )


@inlined
def xi_rate_of(radius, slider, u, u_dot, w, w_dot, turning):
    """ξ̇, m/s, from displacements and rates of the rows; ``turning`` is the rate of ``turned``."""
    if radius == 0.0:
        return -w_dot
    rate = abs(radius) * (u * w_dot - w * u_dot) / (u * u + w * w)
    return rate + math.copysign(1.0, slider[ARM]) * turning + slider[ARM] * slider[SPIN]


@inlined
def xi_and_rate_of(radius, slider, t, u, u_dot, w, w_dot, turned, turning):
    """(ξ, ξ̇) from the motion of the rows."""
    return xi_of(radius, slider, t, u, w, turned), xi_rate_of(radius, slider, u, u_dot, w, w_dot, turning)


@inlined
def xi_acceleration_of(radius, slider, u, u_dot, u_twice, w, w_dot, w_twice, turning_rate):
    """ξ̈, m/s², from the motion of the rows."""
    if radius == 0.0:
        return -w_twice
    square, product = u * u + w * w, u * u_dot + w * w_dot
    rate = (u * w_dot - w * u_dot) / square
    return (
        abs(radius) * ((u * w_twice - w * u_twice) / square - 2.0 * rate * product / square)
        + math.copysign(1.0, slider[ARM]) * turning_rate
    )


@inlined
def spring_stretch(radius, slider, xi):
    """ξ - s, m, of a slider that sticks, to the nearest turn."""
    stretch = xi - slider[SLIDER]
    if radius == 0.0:
        return stretch
    turn = TURN * abs(radius)
    return stretch if abs(stretch) < 0.5 * turn else stretch - turn * math.floor(stretch / turn + 0.5)


@inlined
def friction_force(radius, slider, xi, normal):
    """F_t, N, at a tangential displacement ξ under a normal force N; in slip it stays smooth where N goes through zero.

    A step that ends where N does, the slider being free from there on, has stages beyond.
    """
    if slider[CODE] == STICK:
        return slider[STIFFNESS] * spring_stretch(radius, slider, xi)
    if slider[CODE] == FREE:
        return 0.0
    return slider[CODE] * slider[MU] * normal


@inlined
def slip_sign(slider):
    """Sign of the slip, 0 where there is none."""
    return slider[CODE] if abs(slider[CODE]) == 1.0 else 0.0
