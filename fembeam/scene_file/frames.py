"""The table [frame] of a scene file: nodes by name and members between them, or the lines of a mesh."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from fembeam.structures import Frame, Member

if TYPE_CHECKING:
    from fembeam.scene_file.tables import TableReader

OPTIONS = ("spin", "bending_only")
DRAWN = ("nodes", "members")
READ = ("mesh", "sections", "data", "up", "plane")
MEMBER = ("up", "name", "release", "offset", "axial_force", "foundation")  # besides its nodes and section


def frame(reader: TableReader, table: Mapping[str, Any]) -> Frame:
    """The frame of a table: `nodes` and `members`, or `mesh` and `sections`; `spin`, `bending_only`."""
    where = "[frame]"
    options = {key: table[key] for key in OPTIONS if key in table}
    if "mesh" in table:
        return _of_mesh(reader, table, options)
    reader.check_keys(table, (*DRAWN, *OPTIONS), where, "key")
    reader.need(table, DRAWN, where, ": nodes = { A = [0, 0], … } and [[frame.members]]")
    if not isinstance(table["members"], list):
        reader.fail(where, "members must be tables [[frame.members]] with nodes and section")
    members = [one for number, entry in enumerate(table["members"], start=1) for one in _members(reader, entry, number)]
    made: Frame = reader.made(Frame, {"nodes": table["nodes"], "members": members, **options}, where)
    return made


def _members(reader: TableReader, entry: Any, number: int) -> list[Member]:
    """The members along a chain of nodes."""
    where = f"[[frame.members]] number {number}"
    if not isinstance(entry, dict):
        reader.fail(where, f"must be a table, got {entry!r}")
    reader.check_keys(entry, ("nodes", "section", *MEMBER), where, "key")
    reader.need(entry, ("nodes", "section"), where)
    chain = entry["nodes"]
    if not (isinstance(chain, list) and len(chain) > 1):
        reader.fail(where, f"nodes must be two names or a chain of more, got {chain!r}")
    if "name" in entry and len(chain) > 2:
        reader.fail(where, "name must be left out for a chain: its members are named after their nodes")
    common = {"section": reader.section(entry["section"], f"{where} section")}
    common |= {key: entry[key] for key in MEMBER if key in entry}
    return [reader.made(Member, {"a": a, "b": b, **common}, where) for a, b in pairwise(chain)]


def _of_mesh(reader: TableReader, table: Mapping[str, Any], options: dict[str, Any]) -> Frame:
    """The frame in a file of lines."""
    where = "[frame]"
    reader.check_keys(table, (*READ, *OPTIONS), where, "key")
    given = {key: table[key] for key in ("data", "up", "plane") if key in table}
    made: Frame = reader.made(Frame.from_mesh, {**reader.mesh(table, where), **given, **options}, where)
    return made
