"""Names of parts as places: where a place is meant, the name of a part stands for where that part is.

A mass named "valve" at "C" makes "valve" another name of "C", for stops, forces, joints, and in questions to runs.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fembeam.scene.places import is_directed
from fembeam.structures import has_place, nearest
from fembeam.support import is_numbered, require

if TYPE_CHECKING:
    from fembeam.scene.part import ScenePart
    from fembeam.scene.scene import Scene

SECOND = ("on", "to")  # fields of stops and elements that lead to a second place


def part_places(body: Any, parts: Sequence[ScenePart]) -> dict[str, Any]:
    """{name: place} of the named parts of a body; what the body itself calls so goes before.

    Raises
    ------
    ValueError : a part that has the name of another place than its own, parts placed at each other.
    """
    given: dict[str, Any] = {part.name: part.z for part in parts if part.name is not None}
    for name in [name for name in given if has_place(body, name)]:
        place = given.pop(name)
        require(_same(body, place, name), f"a part named {name!r} must be at the place of that name", place, "Scene",
                "move it there, or give it another name")  # fmt: skip
    return {name: _followed(name, given) for name in given}


def _same(body: Any, place: Any, name: str) -> bool:
    """Whether a place is the one that the body calls so."""
    if place == name or not has_place(body, place):  # what does not exist is refused elsewhere
        return True
    at, there = body.position(place), body.position(name)
    return at is not None and there is not None and bool(np.allclose(at, there))


def _followed(name: str, given: Mapping[str, Any]) -> Any:
    """The place of a part that may be at another part, and so on."""
    passed, place = [name], given[name]
    while isinstance(place, str) and place in given:
        require(place not in passed, "parts must not be placed at each other", [*passed, place], "Scene",
                "give one of them a place of the body")  # fmt: skip
        passed.append(place)
        place = given[place]
    return place


def at_parts(at: Any, parts: Mapping[str, Any], names: Collection[Any] = (), where: str = "Run") -> Any:
    """A place, (place, direction), or a list of these, with places for the names of parts.

    Parameters
    ----------
    parts : {name: place}. names : those that the body itself has. where : for the message.

    Raises
    ------
    ValueError : a name of neither, with the nearest one.

    Examples
    --------
    >>> at_parts([("valve", "-x"), "B", 0.3], {"valve": ("B-C", 0.4)}, ["B"])
    [(('B-C', 0.4), '-x'), 'B', 0.3]
    """
    if isinstance(at, list):
        return [at_parts(one, parts, names, where) for one in at]
    if is_directed(at):
        return at_parts(at[0], parts, names, where), at[1]
    if not isinstance(at, str) or at in parts:
        return parts[at] if isinstance(at, str) else at
    listed = [*parts, *names]
    known = at in names or not parts  # else the body says which places it has
    own = "one of the body" if names else "z in m"
    require(known, f"a place must be {own}, or the name of a part; {nearest(at, listed)}", at, where, "use that")
    return at


def require_number(at: Any, parts: Mapping[str, Any], where: str) -> None:
    """Raise ValueError for the name of a place on a beam none of whose parts has a name."""
    known = bool(parts) or not isinstance(at, str)
    require(known, "places of a beam must be numbers, for no part has a name", at, where,
            "give m, or name the part there")  # fmt: skip


def placed_parts(scene: Scene, names: Sequence[str]) -> Iterator[tuple[str, tuple[Any, ...]]]:
    """Each list of parts of a scene, with places for the names of parts."""
    each = [(one.part_places, one.beam) for one in (scene, *scene.bodies)]
    for name in names:
        parts = enumerate(getattr(scene, name))
        yield name, tuple(_placed(part, each, f"{name}[{i}] ({part.titled}) of Scene") for i, part in parts)
    yield "joints", tuple(_placed_joint(one, each, f"joints[{i}] of Scene") for i, one in enumerate(scene.joints))


def _placed(part: Any, each: Sequence[tuple[Mapping[str, Any], Any]], where: str) -> Any:
    """A part at its places."""
    changes = {"z": _at(part.z, each[0], where)}
    for key in SECOND:
        to: Any = getattr(part, key) if key in {one.name for one in fields(part)} else None
        if is_numbered(to) and 0 <= to[0] < len(each):
            changes[key] = to[0], _at(to[1], each[to[0]], where)
        elif isinstance(to, str):
            changes[key] = _at(to, each[0], where)
    changed = {key: value for key, value in changes.items() if value is not getattr(part, key)}
    return replace(part, **changed) if changed else part


def _placed_joint(joint: Any, each: Sequence[tuple[Mapping[str, Any], Any]], where: str) -> Any:
    """A joint at its places; numbers of bodies that do not exist are refused elsewhere."""
    if not (joint.body < len(each) and joint.to[0] < len(each)):
        return joint
    second = joint.to[0], _at(joint.to[1], each[joint.to[0]], where)
    return replace(joint, place=_at(joint.place, each[joint.body], where), to=second)


def _at(place: Any, known: tuple[Mapping[str, Any], Any], where: str) -> Any:
    """A place of a body for the name of one of its parts."""
    parts, body = known
    if not isinstance(place, str) or has_place(body, place):
        return place
    return at_parts(place, parts, names_of(body), where)


def names_of(body: Any) -> list[str]:
    """Names that a body has, of members too; what is wrong with these it says itself."""
    offered: Any = getattr(body, "places", ())
    members = [one.name for one in getattr(body, "members", ())]
    return [*(one for one in (offered() if callable(offered) else offered) if isinstance(one, str)), *members]
