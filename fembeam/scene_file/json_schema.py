"""Scene files as JSON Schema, made from the constructors that read them, so that editors complete and check keys.

Put `#:schema scene.schema.json` in the first line of a scene file; editors with a TOML language server understand it.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from fembeam.beams import ModalDamping, Rayleigh
from fembeam.scene import FEATURES, Scene
from fembeam.scene_file import bodies
from fembeam.scene_file.frames import MEMBER
from fembeam.scene_file.keys import entries_of, options, parameters, required, takes_list
from fembeam.scene_file.kinds import MAKERS, SECTION, SIGNAL, Nested, nested
from fembeam.scene_file.structures import FILES, KEYS, MODES, NEEDED, PLACES
from fembeam.scene_file.study_tables import STUDIES
from fembeam.scene_file.tables import USUAL, beam_of_section, kind_name
from fembeam.structures import COMPONENTS

Schema = dict[str, Any]
NUMBERS: Schema = {"type": "array", "items": {"type": "number"}}
THREE = {**NUMBERS, "minItems": 3, "maxItems": 3}
PLACE: Schema = {
    "description": "a name, a number, [member, distance in m], or [number of a body, place]",
    "anyOf": [{"type": "string"}, {"type": "number"}, {"type": "array", "items": {}, "minItems": 2, "maxItems": 2}],
}
DIRECTION: Schema = {
    "description": "the way a place moves: x, -y, rz, or a vector",
    "anyOf": [
        {"enum": [sign + c for c in COMPONENTS for sign in ("", "-")]},
        {**NUMBERS, "minItems": 2, "maxItems": 3},
    ],
}
GRAVITY: Schema = {
    "description": "m/s², 9.81 on the ground, or [0, 0, -9.81], in the plane [0, -9.81]",
    "anyOf": [{"type": "number"}, {**THREE, "minItems": 2}],
}
REDUCED: Schema = {
    "type": "object",
    "description": "a superelement: nodes of joints, supports, stops; modes with these held",
    "properties": {
        "nodes": {"type": "array", "items": {}},
        "modes": {"type": "integer"},
        "elements": {"type": "integer"},
    },
    "required": ["nodes", "modes"],
    "additionalProperties": False,
}
SIMPLE = {float: "number", int: "integer", bool: "boolean", str: "string", Path: "string"}


def json_schema() -> Schema:
    """The schema of a scene file, a JSON object (draft 2020-12).

    Examples
    --------
    >>> [one["required"] for one in json_schema()["oneOf"]]
    [['beam'], ['structure'], ['frame']]
    """
    kinds = _Kinds()
    tables: Schema = {"beam": kinds.beam(), "gravity": GRAVITY}
    for name, features in FEATURES.items():
        tables[name] = {"type": "array", "items": kinds.feature(features)}
    tables["damping"] = {"anyOf": [kinds.table(ModalDamping), kinds.table(Rayleigh)]}
    along = _object({direction: kinds.reference(SIGNAL) for direction in COMPONENTS[:3]}, [])
    tables["base"] = {"anyOf": [kinds.reference(SIGNAL), along]}
    known = {"structure": kinds.structure(), "frame": kinds.frame()}
    like = _object({"body": {"type": "integer"}, "turned": THREE}, ["body"])
    parts = {name: tables[name] for name in bodies.PARTS}
    body = _object({"beam": tables["beam"], **known, "like": like, **parts}, [])
    tables |= {**known, "bodies": {"type": "array", "items": body}, "joints": {"type": "array", "items": kinds.joint()}}
    tables["reduce"] = kinds.table(Scene.reduce)
    tables |= {name: kinds.table(study) for name, study in STUDIES.items()}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "fembeam scene",
        "description": "A beam, frame or structure that meets stops. SI units: m, kg, s, N, rad/s.",
        **_object(tables, []),
        "oneOf": [{"required": [name]} for name in ("beam", *bodies.MAKERS)],
        "$defs": kinds.definitions,
    }


class _Kinds:
    """Tables chosen by their kind, each defined once."""

    def __init__(self) -> None:
        self.definitions: dict[str, Schema] = {}

    def table(self, constructor: Callable[..., Any], key: str = "", name: str = "", optional: bool = False) -> Schema:
        """The table of one constructor; `key` = `name` chooses it."""
        keys = parameters(constructor)
        properties = {k: self.value(k, parameter) for k, parameter in keys.items()}
        needed = required(keys)
        if key:
            properties = {key: {"const": name}, **properties}
            needed = needed if optional else [key, *needed]
        about = (inspect.getdoc(constructor) or "").split("\n\n")[0].replace("\n", " ")
        return {**({"description": about} if about else {}), **_object(properties, needed)}

    def value(self, key: str, parameter: inspect.Parameter) -> Schema:
        """One key."""
        if key == "motion":
            return _object({dof: self.reference(SIGNAL) for dof in COMPONENTS}, [])
        if key == "places":
            return {"type": "array", "items": PLACE}
        if kind := nested(key, parameter):
            one = self.reference(kind)
            several = {"type": "array", "items": one}
            found = several if kind.listed else {"anyOf": [one, several]} if takes_list(parameter) else one
        else:
            found = of_type(parameter.annotation)
        default = parameter.default
        return found if default is parameter.empty or default is None else {**found, "default": default}

    def reference(self, kind: Nested) -> Schema:
        """A table of a kind, defined under the name of its first choice."""
        choices = kind.constructors()
        name = f"{kind.key} such as {next(iter(choices))}"
        if name not in self.definitions:
            self.definitions[name] = {}  # laws may hold laws
            tables = [self.table(c, kind.key, n, n == kind.default) for n, c in choices.items()]
            self.definitions[name] = {"anyOf": [{"enum": list(choices)}] * kind.by_name + tables}
        return {"$ref": f"#/$defs/{name.replace(' ', '%20')}"}

    def feature(self, features: tuple[type, ...]) -> Schema:
        """One entry of [[supports]], [[masses]], ...: on a beam at z, then at a place by name."""
        makers = [(MAKERS.get(one, one), kind_name(one.__name__)) for one in features]
        alone = len(features) == 1
        tables = [self.table(m) if alone else self.table(m, "kind", name, name in USUAL) for m, name in makers]
        return {"anyOf": [*tables, *(_named(one) for one in tables)]}

    def structure(self) -> Schema:
        """[structure]: files of matrices, a file of modes, or modes."""
        files = _object({**{key: {} for key in KEYS}, "turned": THREE, "reduced": REDUCED}, list(FILES[:2]))
        file = _object({key: {} for key in MODES}, [MODES[0]])
        return {"anyOf": [files, file, _object({key: {} for key in MODES[1:]}, list(NEEDED))]}

    def frame(self) -> Schema:
        """[frame]: nodes and members, or the lines of a mesh."""
        section, name = self.reference(SECTION), {"type": "string"}
        more = {"spin": {"type": "number"}, "bending_only": {"type": "boolean"}, "turned": THREE, "reduced": REDUCED}
        chain = {"type": "array", "items": name, "minItems": 2}
        of_member: Schema = {key: {} for key in MEMBER} | {"up": DIRECTION, "name": name}
        of_member |= {"axial_force": {"type": "number"}, "foundation": {"type": "number"}}
        members = {
            "type": "array",
            "items": _object({"nodes": chain, "section": section, **of_member}, ["nodes", "section"]),
        }
        nodes = {"type": "object", "additionalProperties": {**NUMBERS, "minItems": 2, "maxItems": 3}}
        sections = {"type": "object", "additionalProperties": section}
        mesh = {"mesh": name, "sections": sections, "data": name, "up": {}, "plane": {"type": "boolean"}}
        drawn = _object({"nodes": nodes, "members": members, **more}, ["nodes", "members"])
        return {"anyOf": [drawn, _object({**mesh, **more}, ["mesh", "sections"])]}

    def joint(self) -> Schema:
        """[[joints]]."""
        dofs = {"anyOf": [{"type": "string"}, {"type": "array", "items": {"enum": list(COMPONENTS)}}]}
        return _object({"at": PLACE, "to": PLACE, "dofs": dofs, "body": {"type": "integer"}}, ["at", "to"])

    def beam(self) -> Schema:
        """A beam of one section, of spans, or of a mesh."""
        plain = self.table(beam_of_section)
        length, section, common = _split(plain["properties"])
        span = _object({"length": length, "section": section}, ["length", "section"])
        sections = {"type": "object", "additionalProperties": self.reference(SECTION)}
        mesh = {"mesh": {"type": "string"}, "sections": sections, "data": {"type": "string"}, **common}
        spans = {"spans": {"type": "array", "items": span, "minItems": 1}, **common}
        return {"anyOf": [plain, _object(spans, ["spans"]), _object(mesh, ["mesh", "sections"])]}


def _named(table: Schema) -> Schema:
    """A part at a place by name: `at` for z, a direction."""
    places = {key: PLACE for key in PLACES if key in table["properties"] or key == "at"}
    properties = {key: value for key, value in table["properties"].items() if key != "z"} | places
    properties |= {key: DIRECTION for key in ("direction", "tangent") if key in properties}
    return {**table, "properties": properties, "required": [{"z": "at"}.get(key, key) for key in table["required"]]}


def _split(properties: Schema) -> tuple[Schema, Schema, Schema]:
    """Length, section, and the rest."""
    return properties["length"], properties["section"], {k: properties[k] for k in list(properties)[2:]}


def _object(properties: Schema, needed: list[str]) -> Schema:
    """A table without other keys."""
    return {"type": "object", "properties": properties, "required": needed, "additionalProperties": False}


def of_type(hint: Any) -> Schema:
    """An annotation as a schema; {} where any value may stand.

    Examples
    --------
    >>> of_type(tuple[float, float] | None)
    {'type': 'array', 'items': {'type': 'number'}, 'minItems': 2, 'maxItems': 2}
    """
    found = [_of_option(option) for option in options(hint)]
    distinct = [one for i, one in enumerate(found) if one not in found[:i]]
    return distinct[0] if len(distinct) == 1 else {"anyOf": distinct}


def _of_option(hint: Any) -> Schema:
    """One of the types allowed."""
    if get_origin(hint) is Literal:
        return {"enum": list(get_args(hint))}
    if hint in SIMPLE:
        return {"type": SIMPLE[hint]}
    if get_origin(hint) is Mapping:
        return {"type": "object", "additionalProperties": of_type(get_args(hint)[1])}
    entry, count = entries_of(hint)
    if entry is None:
        return {}
    fixed = {} if count is None else {"minItems": count, "maxItems": count}
    return {"type": "array", "items": of_type(entry), **fixed}
