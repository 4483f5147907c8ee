"""The table [structure] of a scene file: matrices of another program by their files, or modes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from fembeam.scene import Fixed
from fembeam.structures import GivenModes, Scale, Structure
from fembeam.structures.readers import read_modes, read_nodes

if TYPE_CHECKING:
    from fembeam.scene_file.tables import TableReader

PLACES = ("at", "on", "to")  # keys that hold places by name
FILES = ("stiffness", "mass", "damping")
PLACED = ("labels", "nodes", "points", "lines")
KEYS = (*FILES, *PLACED, "scale")
GIVEN = ("omega", "shapes", "participation")
NEEDED = ("omega", "shapes", "labels")  # of modes
MODES = ("modes", *GIVEN, *PLACED)


def fixed(z: float, dofs: Sequence[str] = (), motion: Any = None, name: str | None = None) -> Fixed:
    """`Fixed` for a scene file: none of dofs named: all."""
    return Fixed(z, *dofs, motion=motion, name=name)


def structure(reader: TableReader, table: Mapping[str, Any]) -> Structure | GivenModes:
    """The structure of a table: files of stiffness, mass and damping, or modes; labels, nodes, points, lines, scale."""
    where = "[structure]"
    nodes = table.get("nodes", {})
    if not isinstance(nodes, (str, dict)):
        reader.fail(where, f"nodes must be the path of a file or a table {{ node = [x, y, z] }}, got {nodes!r}")
    if any(key in table for key in MODES[:3]):
        return _of_modes(reader, table, where)
    reader.check_keys(table, KEYS, where, "key")
    reader.need(table, FILES[:2], where, " (a path, or path and name of one of several matrices)")
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


def _of_modes(reader: TableReader, table: Mapping[str, Any], where: str) -> GivenModes:
    """The structure of modes that a .npz or the table itself holds."""
    reader.check_keys(table, MODES, where, "key")
    given: dict[str, Any] = {}
    if "modes" in table:
        if not isinstance(table["modes"], str):
            reader.fail(where, f"modes must be the path of a .npz, got {table['modes']!r}")
        given = reader.made(read_modes, {"path": reader.file(table["modes"], where)}, where)
    twice = [key for key in given if key in table]
    if twice:
        reader.fail(where, f"{twice[0]} stands here and in {table['modes']}; keep one")
    if isinstance(table.get("nodes"), str):
        given["nodes"] = reader.made(read_nodes, {"path": reader.file(table["nodes"], where)}, where)
    given |= {key: _inline(key, table[key]) for key in (*GIVEN, *PLACED) if key in table and key not in given}
    reader.need(given, NEEDED, where, "; modes need omega, shapes and labels, here or in a .npz")
    made: GivenModes = reader.made(Structure.of_modes, given, where)
    return made


def _inline(key: str, value: Any) -> Any:
    """Labels and nodes written in the file itself; keys of TOML are text, so that numbers of nodes are told by it."""
    if key == "nodes" and isinstance(value, dict):
        return {int(node) if node.lstrip("+-").isdecimal() else node: at for node, at in value.items()}
    return value


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
