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
from fembeam.scene_file.frames import DRAWN, OPTIONS, READ
from fembeam.scene_file.keys import entries_of, options, parameters, required, takes_list
from fembeam.scene_file.kinds import MAKERS, SECTION, SIGNAL, Nested, nested
from fembeam.scene_file.structures import FILES, KEYS
from fembeam.scene_file.study_tables import STUDIES
from fembeam.scene_file.tables import USUAL, beam_of_section, snake

Schema = dict[str, Any]
SIMPLE = {float: "number", int: "integer", bool: "boolean", str: "string", Path: "string"}


def json_schema() -> Schema:
    """The schema of a scene file of a beam, a JSON object (draft 2020-12).

    Examples
    --------
    >>> json_schema()["required"]
    ['beam']
    """
    kinds = _Kinds()
    tables: Schema = {"beam": kinds.beam(), "gravity": {"type": "number", "description": "m/s², 9.81 on the ground"}}
    for name, features in FEATURES.items():
        tables[name] = {"type": "array", "items": kinds.feature(features)}
    tables["damping"] = {"anyOf": [kinds.table(ModalDamping), kinds.table(Rayleigh)]}
    tables["base"] = kinds.reference(SIGNAL)
    tables["structure"] = _object({key: {} for key in KEYS}, list(FILES[:2]))
    tables["frame"] = _object({key: {} for key in (*DRAWN, *READ, *OPTIONS)}, [])
    tables["reduce"] = kinds.table(Scene.reduce)
    tables |= {name: kinds.table(study) for name, study in STUDIES.items()}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "fembeam scene",
        "description": "A beam that meets stops. SI units: m, kg, s, N, rad/s.",
        **_object(tables, ["beam"]),
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
        """One entry of [[supports]], [[masses]], ..."""
        if len(features) == 1:
            return self.table(features[0])
        makers = [(MAKERS.get(one, one), snake(one.__name__)) for one in features]
        return {"anyOf": [self.table(make, "kind", name, name in USUAL) for make, name in makers]}

    def beam(self) -> Schema:
        """A beam of one section, of spans, or of a mesh."""
        plain = self.table(beam_of_section)
        length, section, common = _split(plain["properties"])
        span = _object({"length": length, "section": section}, ["length", "section"])
        sections = {"type": "object", "additionalProperties": self.reference(SECTION)}
        mesh = {"mesh": {"type": "string"}, "sections": sections, "data": {"type": "string"}, **common}
        spans = {"spans": {"type": "array", "items": span, "minItems": 1}, **common}
        return {"anyOf": [plain, _object(spans, ["spans"]), _object(mesh, ["mesh", "sections"])]}


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
