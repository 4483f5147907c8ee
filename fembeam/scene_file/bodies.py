"""Tables [[bodies]] and [[joints]] of a scene file: further beams, frames, structures, with parts of their own.

    [[bodies]]
    frame = { … }                     # or [bodies.frame], [bodies.structure], [bodies.beam]
    [[bodies.stops]]
    …
    [[bodies]]
    like = { body = 1, turned = [0, 0, 1.5707963267948966] }      # the frame of body 1 again; 0 is the file's own
    [[joints]]
    at = "D"
    to = [1, "flange"]

A [frame] or [structure], here or in the file itself, may be ``turned``, and ``reduced`` to a superelement.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from fembeam.scene import FEATURES, Scene
from fembeam.scene_file.frames import frame
from fembeam.scene_file.structures import is_place, structure
from fembeam.structures import GivenModes, Joint
from fembeam.support import is_whole, tuples

if TYPE_CHECKING:
    from fembeam.scene_file.tables import TableReader

MAKERS = {"structure": structure, "frame": frame}  # tables beside [beam]
CHANGES = ("turned", "reduced")  # of a frame or structure
REDUCED = ("nodes", "modes", "elements")
PARTS = (*FEATURES, "damping")  # of a further body
JOINT = ("at", "to", "dofs", "body")
LIKE = ("body", "turned")


def named_body(reader: TableReader, kind: str, table: Any) -> Any:
    """The frame or structure of a table, turned and reduced as it says."""
    if not isinstance(table, dict):
        reader.fail(f"[{kind}]", f"must be a table, got {table!r}")
    plain = {key: value for key, value in table.items() if key not in CHANGES}
    return _changed(reader, MAKERS[kind](reader, plain), table, f"[{kind}]")


def _changed(reader: TableReader, body: Any, table: Mapping[str, Any], where: str) -> Any:
    """A body reduced, then turned."""
    if isinstance(body, GivenModes) and any(key in table for key in CHANGES):
        reader.fail(where, "modes can neither be turned nor reduced; give those that are wanted")
    if "reduced" in table:
        options = table["reduced"]
        if not isinstance(options, dict):
            reader.fail(where, f"reduced must be a table {{ nodes = […], modes = … }}, got {options!r}")
        known = [key for key in REDUCED if key != "elements" or hasattr(body, "members")]
        reader.check_keys(options, known, f"{where} reduced", "key")
        reader.need(options, REDUCED[:2], f"{where} reduced", "; it needs nodes and modes")
        if not isinstance(options["nodes"], list):
            reader.fail(f"{where} reduced", f"nodes must be a list of names, got {options['nodes']!r}")
        body = reader.made(body.reduced, dict(options), f"{where} reduced")
    if "turned" in table:
        body = reader.made(body.turned, {"rotation": table["turned"]}, f"{where} turned")
    return body


def bodies(reader: TableReader, tables: Sequence[Any], own: Any) -> list[Scene]:
    """The scenes of all [[bodies]]; `own` is the body of the file itself."""
    made: list[Scene] = []
    for number, table in enumerate(tables, start=1):
        made.append(_body(reader, table, number, [own, *(one.beam for one in made)]))
    return made


def _body(reader: TableReader, table: Mapping[str, Any], number: int, known: Sequence[Any]) -> Scene:
    """One of them."""
    where = f"[[bodies]] number {number}"
    kinds = ("beam", *MAKERS, "like")
    reader.check_keys(table, (*kinds, *PARTS), where, "key")
    given = [kind for kind in kinds if kind in table]
    if len(given) != 1:
        reader.fail(where, f"needs one of {', '.join(kinds)}, got {', '.join(given) or 'none'}")
    if given[0] == "like":
        inner = reader.inside(f"{where} ", named=True)
        body = _alike(inner, table["like"], known)
        inner = reader.inside(f"{where} ", named=hasattr(body, "check_place"))
    else:
        inner = reader.inside(f"{where} ", named=given[0] != "beam")
        content = table[given[0]]
        body = named_body(inner, given[0], content) if given[0] != "beam" else inner.part("beam", content)
    for name in PARTS:
        if name in table:
            inner.check_form(name, table[name])
    parts = {name: inner.part(name, table[name]) for name in PARTS if name in table}
    made: Scene = reader.made(Scene, {"beam": body, **parts}, where)
    return made


def _alike(reader: TableReader, table: Any, known: Sequence[Any]) -> Any:
    """The body of another one again, turned."""
    if not isinstance(table, dict):
        reader.fail("like", f"must be a table {{ body = 1 }}, got {table!r}")
    reader.check_keys(table, LIKE, "like", "key")
    number = table.get("body")
    if not (is_whole(number) and 0 <= number < len(known)):
        reader.fail("like", f"body must be 0, the file's own, to {len(known) - 1}, got {number!r}")
    return _changed(reader, known[number], table, "like")


def joint(reader: TableReader, table: Any, number: int) -> Joint:
    """One of [[joints]]: `at` a place, `to` = [number of the other body, place there], `dofs`, `body`."""
    where = f"[[joints]] number {number}"
    reader.check_keys(table, JOINT, where, "key")
    reader.need(table, JOINT[:2], where, "; a joint has at = a place, to = [1, a place there]")
    for key in JOINT[:2]:
        if not is_place(table[key]):
            reader.fail(where, f"{key} must name a place, got {table[key]!r}")
    values = {"place": tuples(table["at"]), "to": tuples(table["to"])}
    made: Joint = reader.made(Joint, {**values, **{k: table[k] for k in JOINT[2:] if k in table}}, where)
    return made
