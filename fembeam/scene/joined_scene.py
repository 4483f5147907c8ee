"""A scene whose bodies are joined, as one scene of one body: parts of all bodies, in order, at places of the whole."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

from fembeam.scene.body_checks import choice, is_body
from fembeam.scene.part_places import SECOND
from fembeam.scene.places import scene_words
from fembeam.structures import JoinedBodies
from fembeam.support import is_numbered, require

if TYPE_CHECKING:
    from fembeam.scene.scene import Scene


def merged(scene: Scene, features: Sequence[str]) -> dict[str, Any]:
    """Fields of the same scene without joints: a body of those that joints lead to, and the parts of all of them.

    Parts of the scene's own body come first. Bodies that are not joined follow those that are, and stay.

    Raises
    ------
    ValueError : what joints refuse; a `Beam` among the joined bodies, joined ones after others, damping of a joined
        body, which its modes would not have.
    """
    count = _count(scene)
    joined = (scene, *scene.bodies[:count])
    for number, one in enumerate(joined):
        where = scene_words(number)
        require(is_body(one.beam), "joints must be of frames and structures", one.beam, where,
                "make a Beam a Frame.straight")  # fmt: skip
        same = number == 0 or one.damping in (type(scene).damping, scene.damping)
        require(same, "damping of a joined body must be that of the scene: modes are of the whole", one.damping, where,
                "leave it out; a Structure may have its own C, a Dashpot acts where it is")  # fmt: skip
    whole = JoinedBodies(tuple(one.beam for one in joined), scene.joints)
    parts = {
        name: [_moved(part, number, count, scene) for number, one in enumerate(joined) for part in getattr(one, name)]
        for name in features
    }
    return {"beam": whole, "bodies": scene.bodies[count:], "joints": (), **{k: tuple(v) for k, v in parts.items()}}


def _count(scene: Scene) -> int:
    """How many of the bodies are joined; they come first."""
    named = {number for joint in scene.joints for number in (joint.body, joint.to[0])}
    beyond = [number for number in named if number > len(scene.bodies)]
    require(not beyond, f"a joint must name a body, {choice(scene)}", beyond, "joints of Scene", "add it to bodies")
    count = max(named)
    skipped = sorted(set(range(count + 1)) - named)
    require(not skipped, "joined bodies must come before the others", skipped, "bodies of Scene",
            "change their order, or join them")  # fmt: skip
    return count


def _moved(part: Any, number: int, count: int, scene: Scene) -> Any:
    """A part of a body at its place of the whole, with the second place of a stop or element."""
    changes: dict[str, Any] = {"z": (number, part.z)} if number else {}
    own = {one.name for one in fields(part)}
    for key in SECOND:
        to = getattr(part, key) if key in own else None
        if to is not None:
            body, place = to if is_numbered(to) else (0, to)
            known = number > 0 or body <= len(scene.bodies)
            require(known, f"{key} must name a body, {choice(scene)}", body, part.where, "add it to bodies")
            if number:
                changes[key] = (0, (number, place))
            elif 0 < body <= count:
                changes[key] = (0, (body, place))
            elif body > count:
                changes[key] = (body - count, place)
    return replace(part, **changes) if changes else part
