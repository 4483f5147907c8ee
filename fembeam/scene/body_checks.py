"""Checks of a scene whose body is not a `Beam`: places by name, directions, and what has no meaning there."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fembeam.scene.annular_stop import AnnularStop
from fembeam.scene.parts import Guided, PointMoment
from fembeam.scene.places import quoted
from fembeam.scene.rotors import Disk, check_shaft
from fembeam.scene.signals import support_motion
from fembeam.structures import COMPONENTS, direction_of, named, require_components
from fembeam.support import is_finite, require

if TYPE_CHECKING:
    from fembeam.scene.scene import Scene

DIRECTED = ("springs", "dashpots", "stops", "elements", "forces", "impactors")


def is_body(value: Any) -> bool:
    """Whether a value can stand where a Beam does: it gives matrices and knows places by name."""
    offered = "assembled", "check_place", "components_at", "places", "position", "lines"
    return all(callable(getattr(value, name, None)) for name in offered)


def choice(scene: Scene) -> str:
    """For messages: which further bodies a scene has."""
    return f"1 to {len(scene.bodies)}" if scene.bodies else "and there is none"


def check_feature(body: Any, feature: Any, name: str, where: str) -> None:
    """Raise ValueError unless a part of a scene has a place on the body and says along what it acts."""
    body.check_place(feature.z, where)
    have, what = body.components_at(feature.z), f"the place {quoted(feature.z)}"
    if name == "supports":
        _check_support(feature, have, where)
    if isinstance(feature, AnnularStop):
        for place in feature.coordinates:
            require_components(place.along, have, what, where)
    elif name in DIRECTED:
        turn = isinstance(feature, PointMoment)
        write = f"add direction={'rz' if turn else 'x'!r} or so; {what} has {', '.join(have)}"
        require(feature.direction is not None, "a place by name needs a direction", None, where, write)
        require_components(direction_of(feature.direction, where), have, what, where)
        if getattr(feature, "tangent", None) is not None:
            require_components(direction_of(feature.tangent, where), have, what, where)
    if isinstance(feature, Disk):
        check_shaft(body, feature, where)
    if name == "masses":
        require(any(c in COMPONENTS[:3] for c in have), f"{what} must move to carry a mass", have, where, "move it")
        number = not isinstance(feature.offset, tuple) and feature.offset != 0
        rule = f"offset must be a vector: one number is along z, and {what} does not tilt that way"
        tilts = "rx" in have or "ry" in have
        require(tilts or not number, rule, feature.offset, where, "write offset=(0.1, 0.0)")


def _check_support(support: Any, have: tuple[str, ...], where: str) -> None:
    """Raise ValueError unless a support holds what the place has."""
    require(not isinstance(support, Guided), "Guided is for a Beam", support, where,
            "write Fixed(place, 'rx') or so, with the rotations it holds")  # fmt: skip
    every = support.dofs in (COMPONENTS, COMPONENTS[:3])
    missing = [dof for dof in support.dofs if dof not in have]
    told_at = f"the place {quoted(support.z)} has {', '.join(have)}"
    require(
        every or not missing, f"a support must hold dofs that exist; {told_at}", missing, where, "name some of these"
    )
    require(len(missing) < len(support.dofs), f"a support must hold something; {told_at}", support, where, "use Fixed")
    astray = [dof for dof in support_motion(support) if dof not in have]
    require(not astray, f"motion must be of dofs that exist; {told_at}", astray, where, "name some of these")


def check_ends(scene: Scene) -> None:
    """Raise ValueError for second places of stops and elements that do not exist, or are the first one."""
    bodies = [scene.beam, *(one.beam for one in scene.bodies)]
    for name, key in (("stops", "on"), ("elements", "to")):
        for index, part in enumerate(getattr(scene, name)):
            second, where = part.coordinates[0].to, f"{name}[{index}] of Scene"
            if second is None:
                continue
            number, place = second
            known = 0 <= number < len(bodies)
            require(known, f"{key} must name a body, {choice(scene)}", number, where, "add it to bodies")
            require(number > 0 or place != part.z, f"{key} must be another place", place, where,
                    "leave it out for an end on the frame")  # fmt: skip
            for one in part.coordinates:
                check_end(bodies[number], place, one.along, key, where)


def check_end(body: Any, place: Any, along: Any, key: str, where: str) -> None:
    """Raise ValueError unless a second place exists on a body and moves along a direction."""
    if is_body(body):
        body.check_place(place, f"{key} of {where}")
        require_components(along, body.components_at(place), f"the place {quoted(place)} of {key}", where)
        return
    inside = is_finite(place) and 0 <= place <= body.length
    require(inside, f"z of {key} must lie on the beam, 0 to {body.length} m", place, where, "move it")
    require_components(along, ("y", "rx"), f"a Beam bends in one plane: the place {quoted(place)} of {key}", where)


def check_conflicts(scene: Scene) -> None:
    """Raise ValueError where two supports hold one dof, or two stops are one."""
    held: dict[Any, int] = {}
    for index, support in enumerate(scene.supports):
        for dof in support.dofs:
            if dof not in scene.beam.components_at(support.z):
                continue
            key = (scene.beam.node(support.z) if hasattr(scene.beam, "node") else support.z), dof
            require(key not in held, f"supports must not hold one dof twice ({dof} at {quoted(support.z)})",
                    (held.get(key), index), "supports of Scene", "keep one")  # fmt: skip
            held[key] = index
    _check_moved(scene)
    known: dict[Any, int] = {}
    for index, stop in enumerate(scene.stops):
        one: Any = (stop.z, stop.push, stop.coordinate.along, stop.coordinate.to, stop.gap)
        if isinstance(stop, AnnularStop):
            one = (*one, stop.coordinates[1].along, stop.centre, stop.outer)
            ways = [named(place.along) for place in stop.coordinates]
        else:
            ways = [named(direction_of(stop.direction, "Stop"))]
        at = f"{quoted(stop.z)}, {' and '.join(ways)}"
        require(one not in known, f"stops must not share one place, direction and gap ({at})",
                (known.get(one), index), "stops of Scene",
                "make them one stop with one law, such as PiecewiseLinear, or give each its own gap")  # fmt: skip
        known[one] = index


def _check_moved(scene: Scene) -> None:
    """Raise ValueError for stops and elements on a support that moves, of whose motion their δ would not know."""
    node: Any = getattr(scene.beam, "node", lambda place: place)
    moved = {(node(one.z), dof) for one in scene.supports for dof in support_motion(one)}
    for name in ("stops", "elements") if moved else ():
        for index, part in enumerate(getattr(scene, name)):
            to = part.coordinate.to
            for place in (part.z, *([to[1]] if to is not None and to[0] == 0 else [])):
                along = zip(COMPONENTS, part.coordinate.along, strict=True)
                met = [dof for dof, size in along if size and (node(place), dof) in moved]
                require(not met, f"a {part.word} must not act where a support moves along {', '.join(met)}", place,
                        f"{name}[{index}] of Scene", "put it at a place beside the support")  # fmt: skip


def check_plain(feature: Any, name: str, where: str) -> None:
    """Raise ValueError for what a part on a Beam cannot say: a place by name, a direction out of its plane."""
    require(not isinstance(feature, AnnularStop), "an AnnularStop needs a body in space, a Beam bends in one plane",
            feature, where, "use two stops of this gap, side='below' and side='above'")  # fmt: skip
    require(is_finite(feature.z), "z must be a number on a Beam, which has no names", feature.z, where,
            "give m, or name the part there")  # fmt: skip
    require(not isinstance(feature, Disk), "a Disk needs a shaft: a straight Frame in space", feature, where,
            "use Frame.straight, or a LumpedMass")  # fmt: skip
    rubs = getattr(feature, "friction", None) is not None or getattr(feature, "tangent", None) is not None
    require(not rubs, "friction acts along the surface of a stop, and a Beam bends in one plane", feature, where,
            "make the Beam a Frame.straight, or leave the friction out")  # fmt: skip
    for key in ("offset", "inertia"):
        require(not isinstance(getattr(feature, key, 0.0), tuple), f"{key} must be one number on a Beam",
                getattr(feature, key, 0.0), where, "give kg m², m")  # fmt: skip
    direction = getattr(feature, "direction", None)
    if direction is not None:
        along = direction_of(direction, where)
        require_components(along, ("y", "rx"), "a Beam bends in one plane: its places", where)
        require(name in ("stops", "elements"), "direction is for bodies that are not a Beam", direction, where,
                "leave it out: u is along y")  # fmt: skip
    if name == "supports":
        astray = [dof for dof in support_motion(feature) if dof not in ("y", "rx")]
        require(
            not astray, "motion on a Beam must be of y, which is u, or rx, -u_z", astray, where, "leave the others out"
        )
        beyond = [dof for dof in feature.dofs if dof not in ("y", "rx")]
        whole = feature.dofs in ((), COMPONENTS, COMPONENTS[:3])
        require(whole or not beyond, "a Beam bends in one plane: it has y and rx", beyond, where, "leave them out")
