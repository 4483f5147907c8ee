"""Friction of an element: its tangential displacement ξ, and the force of its slider.

The numbers of a slider stand among the element's parameters from ``problem.friction[s, 0]`` on, see
`problem.friction`. The rows of an oblique stop read δ + g and minus ξ, those of a circular clearance u = -d and, where
there is a third, -|R| φ:

    ξ = c θ + R (φ + Ω t),   ξ̇ = c (u × u̇)/r² + R (φ̇ + Ω),   forces F_t (c/r) (-u_y, u_x)/r and, on |R| φ, -F_t R/|R|

θ is known up to whole turns, and ξ - s of a slider that sticks is far below half a turn: that is how it is read.
"""

from __future__ import annotations

import math

from solvers.compiled.decorators import inlined
from solvers.problem.friction import ARM, CODE, FREE, MU, SLIDER, SPIN, STIFFNESS

TURN = 2.0 * math.pi


@inlined
def way_of(radius, own, t, u, w, turned):
    """ξ from the displacements of the rows: of the first, of the second, and of the third with its sign turned."""
    if radius == 0.0:
        return -w
    return abs(radius) * math.atan2(w, u) + math.copysign(1.0, own[ARM]) * turned + own[ARM] * own[SPIN] * t


@inlined
def speed_of(radius, own, u, u_dot, w, w_dot, turning):
    """ξ̇ from their motion."""
    if radius == 0.0:
        return -w_dot
    rate = abs(radius) * (u * w_dot - w * u_dot) / (u * u + w * w)
    return rate + math.copysign(1.0, own[ARM]) * turning + own[ARM] * own[SPIN]


@inlined
def slide(radius, own, t, u, u_dot, w, w_dot, turned, turning):
    """Both."""
    return way_of(radius, own, t, u, w, turned), speed_of(radius, own, u, u_dot, w, w_dot, turning)


@inlined
def slide_acceleration(radius, own, u, u_dot, u_twice, w, w_dot, w_twice, turning_rate):
    """ξ̈ from the motion of the rows."""
    if radius == 0.0:
        return -w_twice
    square, along = u * u + w * w, u * u_dot + w * w_dot
    rate = (u * w_dot - w * u_dot) / square
    return (
        abs(radius) * ((u * w_twice - w * u_twice) / square - 2.0 * rate * along / square)
        + math.copysign(1.0, own[ARM]) * turning_rate
    )


@inlined
def drawn(radius, own, way):
    """ξ - s of a slider that sticks, to the nearest turn."""
    left = way - own[SLIDER]
    if radius == 0.0:
        return left
    turn = TURN * abs(radius)
    return left - turn * math.floor(left / turn + 0.5)


@inlined
def friction_force(radius, own, way, normal):
    """F_t at a tangential displacement and a normal force, N."""
    if own[CODE] == 0.0:
        return own[STIFFNESS] * drawn(radius, own, way)
    if own[CODE] == FREE or normal <= 0.0:
        return 0.0
    return own[CODE] * own[MU] * normal


@inlined
def slip_of(own):
    """Sign of the slip, 0 where there is none."""
    return own[CODE] if abs(own[CODE]) == 1.0 else 0.0
