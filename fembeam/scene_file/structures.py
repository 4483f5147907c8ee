"""The table [structure] of a scene file: matrices of another program by their files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from fembeam.scene import Fixed
from fembeam.structures import Scale, Structure

if TYPE_CHECKING:
    from fembeam.scene_file.tables import TableReader

PLACES = ("at", "on", "to")  # keys that hold places by name
FILES = ("stiffness", "mass", "damping")
KEYS = (*FILES, "labels", "nodes", "points", "lines", "scale")


def fixed(z: float, dofs: Sequence[str] = (), motion: Any = None, name: str | None = None) -> Fixed:
    """`Fixed` for a scene file: none of dofs named: all."""
    return Fixed(z, *dofs, motion=motion, name=name)


def structure(reader: TableReader, table: Mapping[str, Any]) -> Structure:
    """The structure of a table: files of stiffness, mass and damping; labels, nodes, points, lines, scale."""
    where = "[structure]"
    reader.check_keys(table, KEYS, where, "key")
    for key in FILES[:2]:
        if key not in table:
            reader.fail(where, f"the key {key!r} is missing (a path, or path and name of one of several matrices)")
    given: dict[str, Any] = {}
    for key in (*FILES, "labels", "nodes"):
        if key in table:
            named, value = isinstance(table[key], str), table[key]
            if key in FILES and isinstance(value, list) and len(value) == 2 and all(isinstance(v, str) for v in value):
                given[key] = reader.file(value[0], where), value[1]
                continue
            if key in FILES and not named:
                reader.fail(where, f"{key} must be the path of a file, got {value!r}")
            given[key] = reader.file(value, where) if named else _inline(key, value)
    given |= {key: table[key] for key in ("points", "lines") if key in table}
    if "scale" in table:
        units = table["scale"]
        if not (isinstance(units, list) and len(units) == 3):
            reader.fail(where, f"scale must be a list of three units, such as ['mm', 't', 's'], got {units!r}")
        given["scale"] = reader.made(Scale, dict(zip(("length", "mass", "time"), units, strict=True)), where)
    made: Structure = reader.made(Structure.read, given, where)
    return made


def _inline(key: str, value: Any) -> Any:
    """Labels and nodes written in the file itself; keys of TOML are text, so that numbers of nodes are told by it."""
    if key == "nodes" and isinstance(value, dict):
        return {int(node) if node.lstrip("+-").isdecimal() else node: at for node, at in value.items()}
    return value


def place(value: Any) -> Any:
    """A place, or a place and its direction, as the file writes them: lists as tuples.

    Examples
    --------
    >>> place("lever"), place(["A-B", 0.4]), place([["A-B", 0.4], "x"])
    ('lever', ('A-B', 0.4), (('A-B', 0.4), 'x'))
    """
    return tuple(place(one) for one in value) if isinstance(value, list) else value


def is_place(value: Any) -> bool:
    """Whether a value of the file can be one: text, a number, or a list of two that begins with one.

    Examples
    --------
    >>> [is_place(value) for value in ("lever", 88, ["lever", "x"], ["A-B", 0.4], {}, [])]
    [True, True, True, True, False, False]
    """
    if isinstance(value, list):
        return len(value) == 2 and is_place(value[0]) and not isinstance(value[1], dict)
    return isinstance(value, (str, int, float)) and not isinstance(value, bool)
