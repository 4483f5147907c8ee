"""Friction of stops, under their own contact force: along what it acts, and its checks.

oblique: ξ = t·u, the force -F_t t on the place
annular: ξ = c θ + R (φ + Ω t), the force -F_t (c/r) e_θ, the torque -R F_t on φ
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fembeam.scene.local_coordinate import LocalCoordinate
from fembeam.scene.places import quoted
from fembeam.scene.rotors import carrier
from fembeam.structures import COMPONENTS, Six, direction_of, turns
from fembeam.support import require, require_positive
from solvers import Friction

ACROSS = 1e-9  # of 1: products of directions that are at right angles


def check_friction(friction: Any, where: str) -> None:
    """Raise TypeError for a friction that is none."""
    if friction is not None and not isinstance(friction, Friction):
        raise TypeError(f"friction must be a Friction(mu, stiffness), got {friction!r} in {where}")


def check_oblique(stop: Any, where: str) -> None:
    """Raise ValueError unless a stop with friction lies along a displacement, and its tangent across that."""
    check_friction(stop.friction, where)
    if stop.friction is None:
        require(stop.tangent is None, "tangent is for a stop with friction", stop.tangent, where,
                "give friction=Friction(mu, stiffness), or leave it out")  # fmt: skip
        return
    normal = stop.coordinate
    require(not normal.rotation, "friction is for stops of displacement", stop.friction, where, "leave it out")
    if stop.tangent is None or stop.direction is None:  # the body says what that means
        return
    along = direction_of(stop.tangent, f"tangent of {where}")
    across = not turns(along) and abs(np.dot(along, normal.along)) < ACROSS
    require(across, "tangent must be a displacement at right angles to the stop's direction", stop.tangent, where,
            f"the stop acts along {stop.direction!r}")  # fmt: skip


def completed(body: Any, stop: Any, where: str) -> Any:
    """The tangent of a stop with friction: that given, in a plane frame the other way in its plane."""
    if stop.tangent is not None or stop.direction is None:
        return stop.tangent
    own = carrier(body, stop.z)
    require(getattr(own, "in_plane", False), "friction of a stop in space needs tangent=, the way along its surface",
            None, where, "write tangent='y' or a vector")  # fmt: skip
    x, y = stop.coordinate.along[:2]
    return (-float(y), float(x)) if x or y else None  # a direction out of the plane is refused with the others


def check_round(stop: Any, where: str) -> None:
    """Raise ValueError for a radius without friction, or one that is not positive."""
    check_friction(stop.friction, where)
    if stop.radius is None:
        return
    require(stop.friction is not None, "radius is for an annular stop with friction", stop.radius, where,
            "give friction=Friction(mu, stiffness), or leave it out")  # fmt: skip
    require_positive("radius", stop.radius, where, "give that of the shaft or tube itself, m")


def axis_of(stop: Any) -> Six:
    """Rotation about the axis of an annular stop, e₁ × e₂ of its directions, on the six components."""
    first, second = (place.along[:3] for place in stop.coordinates)
    axis = np.cross(first, second)
    return (0.0, 0.0, 0.0, *(float(part) + 0.0 for part in axis))


def spin_of(body: Any, stop: Any) -> float:
    """Ω about the axis of an annular stop, rad/s: that of the shaft that its place is on."""
    own = carrier(body, stop.z)
    spin = float(getattr(own, "spin", 0.0))
    return spin * float(np.dot(np.asarray(own.axes)[0, 2], axis_of(stop)[3:])) if spin else 0.0


def check_spin(body: Any, stop: Any, where: str) -> None:
    """Raise ValueError for friction on a shaft that spins whose radius is not known."""
    spins = stop.friction is not None and stop.radius is None and spin_of(body, stop) != 0.0
    require(not spins, f"friction on a shaft that spins needs radius= ({quoted(stop.z)})", stop.radius, where,
            "give the radius of the shaft there, m")  # fmt: skip


def turning_row(stop: Any, components: tuple[str, ...]) -> LocalCoordinate | None:
    """The rotation of the place about the axis of an annular stop; None without radius, or where it cannot turn so."""
    along = axis_of(stop)
    has = all(name in components for name, part in zip(COMPONENTS, along, strict=True) if part)
    return LocalCoordinate(stop.z, 0, None, along) if stop.radius is not None and has else None
