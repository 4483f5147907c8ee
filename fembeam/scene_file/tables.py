"""Tables of a scene file as objects: keys checked against constructors; errors name the table."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NoReturn

from fembeam.beams import Beam, ModalDamping, Rayleigh, Section, Taper
from fembeam.model import check_reduction
from fembeam.scene import FEATURES, Scene, Source
from fembeam.scene_file import bodies as further
from fembeam.scene_file.keys import (
    Constructors,
    angular,
    converted,
    fits,
    listed,
    nearest,
    parameters,
    required,
    shown,
    takes_list,
    wanted,
)
from fembeam.scene_file.kinds import MAKERS, SECTION, SIGNAL, Nested, nested
from fembeam.scene_file.structures import PLACES, is_place
from fembeam.structures import COMPONENTS
from fembeam.support import is_whole, read_with, tuples

Table = Mapping[str, Any]
BODIES = tuple(further.MAKERS)  # tables beside [beam]
LISTS = (*FEATURES, "bodies", "joints")

USUAL = ("lumped_mass", "point_force", "stop")  # kinds that need not be named
SHORT = {"annular_stop": "annular"}
ELSEWHERE = {"gravity": "; gravity stands above all tables", "modes": "; modes of a run stand in [reduce]"}


class SceneFileError(ValueError):
    """A scene file that cannot be read; the message names file, table, key, and what would be valid."""


@dataclass(frozen=True)
class TableReader:
    """Turns tables into objects; knows the text for messages, and where the files lie that it names."""

    source: Source
    places: dict[str, Path]
    asked: Sequence[str] = ()
    within: str = ""  # the further body whose tables are read, for messages
    kind: bool | None = None  # whether its places have names

    def inside(self, within: str, named: bool) -> TableReader:
        """The reader of a further body's tables."""
        return replace(self, within=within, kind=named)

    def file(self, name: str, where: str) -> Path:
        """A file that the scene names: an ordinary one, and within the folder if a saved run names it."""
        folder = self.source.path.parent
        place = self.places.get(name, folder / name)
        within = place.resolve().is_relative_to(folder.resolve()) or any(name in value for value in self.asked)
        if self.source.of_run and name not in self.places and not within:
            self.fail(where, f"names {name}, which this run does not carry and which lies outside its folder; copy it "
                      "there, or name it by --set")  # fmt: skip
        if place.exists() and not place.is_file():
            self.fail(where, f"{name} is no ordinary file (a folder, pipe or device); give a file with the data")
        self.places.setdefault(name, place)
        for other in read_with(place):
            self.places.setdefault(str(Path(name).parent / other), place.parent / other)
        return place

    def contents(self, tables: Table, known: Constructors) -> tuple[Scene, dict[str, Any], dict[str, Any]]:
        """The scene, the arguments of `Scene.reduce`, and the study tables among those known."""
        parts = list(inspect.signature(Scene).parameters)
        self.check_keys(tables, [*parts, *BODIES, "reduce", *known], "the file", "table")
        bodies = [name for name in ("beam", *BODIES) if name in tables]
        if not bodies:
            self.fail("the file", f"needs a table [{'] or ['.join(('beam', *BODIES))}]")
        if len(bodies) > 1:
            self.fail("the file", f"needs one of the tables [{'] and ['.join(bodies)}], not both")
        for name in tables:
            self.check_form(name, tables[name])
        built = {name: self.part(name, tables[name]) for name in parts if name in tables and name not in LISTS[-2:]}
        if bodies[0] != "beam":
            built["beam"] = further.named_body(self, bodies[0], tables[bodies[0]])
        built["bodies"] = further.bodies(self, tables.get("bodies", []), built["beam"])
        built["joints"] = [further.joint(self, one, i) for i, one in enumerate(tables.get("joints", []), start=1)]
        try:
            scene = Scene(**built)
        except (ValueError, TypeError, ArithmeticError) as error:
            self.fail("the scene", str(error), error)
        reduce = self.arguments(Scene.reduce, tables.get("reduce", {}), "[reduce]")
        self.made(check_reduction, {"scene": scene, **reduce}, "[reduce]")
        studies = {
            name: self.build(study, tables[name], f"[{name}]") for name, study in known.items() if name in tables
        }
        for name, study in studies.items():
            if hasattr(study, "check"):
                self.made(study.check, {"scene": scene}, f"[{name}]")
        return scene, reduce, studies

    @cached_property
    def named(self) -> bool:
        """Whether the file, or the further body that is read, is one whose places have names."""
        return any(name in self.source.tables() for name in BODIES) if self.kind is None else self.kind

    def check_form(self, name: str, value: Any) -> None:
        """Features come as [[name]], gravity as a number, everything else as [name]."""
        if name == "gravity":
            return
        if name in LISTS:
            if not (isinstance(value, list) and all(isinstance(entry, dict) for entry in value)):
                self.fail(name, f"must be a list of tables; write [[{name}]]")
        elif not isinstance(value, dict):
            self.fail(name, f"must be a table; write [{name}]" + (", once" if isinstance(value, list) else ""))

    def part(self, name: str, value: Any) -> Any:
        """One argument of Scene from its table or list of tables."""
        if name == "beam":
            return self.beam(value)
        if name == "gravity":
            if isinstance(value, list) or (isinstance(value, (int, float)) and not isinstance(value, bool)):
                return value
            self.fail("the file", f"gravity must be a number, or three, got {shown(value)}")
        if name == "damping":
            return self.damping(value)
        if name == "base":
            return self.base(value)
        kinds: Constructors = {kind_name(kind.__name__): MAKERS.get(kind, kind) for kind in FEATURES[name]}
        if not self.named:  # a straight beam has Clamped, Pinned and Guided
            kinds = {key: kind for key, kind in kinds.items() if kind not in MAKERS.values()}
        made = []
        for number, table in enumerate(value):
            where = f"[[{name}]] number {number + 1}"
            only = next(iter(kinds.values())) if len(kinds) == 1 else None
            usual = next((kind for kind in kinds if kind in USUAL), "")
            made.append(self.build(only, table, where) if only else self.choose(kinds, table, where, default=usual))
        return made

    def damping(self, table: Table) -> Any:
        """Ratios of the modes, or Rayleigh's two numbers."""
        if "zeta" in table and {"alpha", "beta"} & set(table):
            self.fail("[damping]", "give either zeta, or alpha and beta, not both")
        if {"alpha", "beta"} & set(table):
            return self.build(Rayleigh, table, "[damping]")
        return self.build(ModalDamping, table, "[damping]", "alpha", "beta")

    def base(self, table: Table) -> Any:
        """The motion of the frame: a signal; of bodies with named places also one for each direction."""
        if self.named and not table:
            self.fail("[base]", "must have a table for each direction, such as [base.y]")
        ways = [key for key, one in table.items() if isinstance(one, dict) or key in COMPONENTS]
        if not self.named and "kind" not in table and ways:
            self.fail(f"[base.{ways[0]}]", "the base of a beam moves along y alone: write [base] with kind = … and "
                      "the keys of that signal; tables for each direction are for frames")  # fmt: skip
        if self.named and len(ways) == len(table):
            return {direction: self.chosen(SIGNAL, one, f"[base.{direction}]") for direction, one in table.items()}
        return self.chosen(SIGNAL, table, "[base]")

    def beam(self, table: Table) -> Beam:
        """A beam of one section, of `spans`, or of a `mesh`."""
        common = ["foundation", "axial_force"]
        options = {key: table[key] for key in common if key in table}
        if "mesh" in table:
            self.check_keys(table, ["mesh", "sections", "data", *common], "[beam]", "key")
            options |= {"data": table["data"]} if "data" in table else {}
            return self.made(Beam.from_mesh, {**self.mesh(table, "[beam]"), **options}, "[beam]")
        if "spans" not in table:
            return self.build(beam_of_section, table, "[beam]")
        self.check_keys(table, ["spans", *common], "[beam]", "key")
        if not isinstance(table["spans"], list):
            self.fail("[beam]", "spans must be a list of tables with length and section")
        spans = [
            self.build(_span, entry, f"[beam] span {number}") for number, entry in enumerate(table["spans"], start=1)
        ]
        return self.made(Beam.of_spans, {"spans": spans, **options}, "[beam]")

    def mesh(self, table: Table, where: str) -> dict[str, Any]:
        """Path and sections of a beam or frame that a mesh holds."""
        sections, path = table.get("sections"), table["mesh"]
        if not isinstance(sections, dict) or not isinstance(path, str):
            self.fail(where, "a mesh needs its path and a table sections = { name = { section }, … }")
        found = {name: self.section(entry, f"{where} sections {name}") for name, entry in sections.items()}
        return {"path": self.file(path, where), "sections": found}

    def section(self, table: Any, where: str) -> Section | Taper:
        """A section by its shape."""
        return self.chosen(SECTION, table, where)

    def choose(self, kinds: Constructors, table: Any, where: str, key: str = "kind", default: str = "") -> Any:
        """Build the constructor that `kind` (or `shape`) names."""
        if not isinstance(table, dict):
            keys = list(parameters(kinds[default]))[:2] if default else [key]
            self.fail(where, f"must be a table {{ {', '.join(f'{one} = …' for one in keys)}, … }}, got {table!r}")
        name = table.get(key, default)
        if name not in list(kinds):  # a list: what a file gives need not be hashable
            got = f"got {name!r}{nearest(name, kinds)}" if key in table else "it is missing"
            self.fail(where, f"{key} must be one of {listed(kinds)}; {got}")
        return self.build(kinds[name], {k: v for k, v in table.items() if k != key}, where, chosen_by=key)

    def build(self, constructor: Callable[..., Any], table: Any, where: str, *also: str, chosen_by: str = "") -> Any:
        """Call the constructor with a table's values."""
        return self.made(constructor, self.arguments(constructor, table, where, *also, chosen_by=chosen_by), where)

    def made(self, constructor: Callable[..., Any], arguments: Table, where: str) -> Any:
        """Call a constructor; its errors name the table."""
        try:
            return constructor(**arguments)
        except SceneFileError:
            raise
        except OSError as error:
            self.fail(where, f"{error.filename}: {error.strerror}", error)
        except OverflowError as error:
            self.fail(where, "holds numbers too large or too small to compute with; give SI units", error)
        except (ValueError, TypeError, ArithmeticError, MemoryError, RuntimeError) as error:  # the last of modes
            self.fail(where, str(error) or type(error).__name__, error)

    def arguments(
        self, constructor: Callable[..., Any], table: Any, where: str, *also: str, chosen_by: str = ""
    ) -> dict[str, Any]:
        """The values of a table, checked against the constructor's signature."""
        if not isinstance(table, dict):
            self.fail(where, f"must be a table, got {table!r}")
        keys = parameters(constructor)
        by_name = self.named and "z" in keys
        known = ["at" if by_name and key == "z" else key for key in keys]
        self.check_keys(table, [*filter(None, [chosen_by]), *known, *also], where, "key")
        if by_name:
            return self._placed(keys, table, where)
        for key, parameter in keys.items():
            if key not in table and parameter.default is inspect.Parameter.empty:
                kind = f" ({words})" if (words := wanted(parameter.annotation)) else ""
                self.fail(where, f"the key {key!r} is missing{kind}; it needs {listed(required(keys))}")
        return {
            parameter.name: self.value(table[key], key, parameter, where)
            for key, parameter in keys.items()
            if key in table
        }

    def _placed(self, keys: Mapping[str, inspect.Parameter], table: Table, where: str) -> dict[str, Any]:
        """`arguments` of what has a place by name: `at` for z; `on` and `to` hold such places too."""
        found = {key: table[key] for key in PLACES if key in table}
        for key, at in found.items():
            if not is_place(at):
                self.fail(where, f"{key} must be the name of a point or node, or [member, distance], got {shown(at)}")
        needed = ["at" if key == "z" else key for key in required(keys)]
        if "at" not in found and "at" in needed:
            self.fail(where, f"the key 'at' is missing (the name of a point or node); it needs {listed(needed)}")
        rest = {key: value for key, value in table.items() if key not in PLACES}
        plain = [key for key in keys if key not in ("z", "on", "to")]
        for key in plain:
            if key not in rest and keys[key].default is inspect.Parameter.empty:
                self.fail(where, f"the key {key!r} is missing; it needs {listed(needed)}")
        values = {keys[key].name: self.value(rest[key], key, keys[key], where) for key in plain if key in rest}
        return {**values, **{"z" if key == "at" else key: tuples(one) for key, one in found.items()}}

    def value(self, value: Any, key: str, parameter: inspect.Parameter, where: str) -> Any:
        """One value: a table for what has its own constructor, else checked by the annotation."""
        inner = f"{where} {key}"
        if key == "motion":
            if not isinstance(value, dict):
                self.fail(inner, f"must be a table of signals by their dofs, got {shown(value)}")
            return {dof: self.chosen(SIGNAL, one, f"{inner} {dof}") for dof, one in value.items()}
        if kind := nested(key, parameter):
            if kind.listed and not isinstance(value, list):
                self.fail(inner, f"must be a list of {key}, got {shown(value)}")
            if kind.listed or (isinstance(value, list) and takes_list(parameter)):
                return [self.chosen(kind, one, f"{inner} number {i}") for i, one in enumerate(value, start=1)]
            return self.chosen(kind, value, inner)
        if key in PLACES and isinstance(value, list) and len(value) == 2 and is_place(value) and is_whole(value[0]):
            return tuples(value)  # of another body
        if self.named and key == "places" and isinstance(value, list) and all(map(is_place, value)):
            return [tuples(one) for one in value]
        if not fits(value, parameter.annotation):
            self.fail(where, f"{key} must be {wanted(parameter.annotation)}, got {shown(value)}")
        if key == "path":
            return self.file(value, where)
        return converted(value, parameter.annotation)

    def chosen(self, kind: Nested, value: Any, where: str) -> Any:
        """One thing of a kind; where plain text will do it is the name."""
        table = {kind.key: value} if kind.by_name and not isinstance(value, dict) else value
        return self.choose(kind.constructors(), table, where, kind.key, kind.default)

    def check_keys(self, table: Table, valid: Sequence[str], where: str, what: str) -> None:
        """Every key is a valid one, else "unknown key 'mas'; did you mean 'mass'?"."""
        for key in table:
            if key not in valid:
                hint = angular(key, valid) or nearest(key, valid)
                self.fail(where, f"unknown {what} {key!r}{hint}{ELSEWHERE.get(key, '')} (valid: {listed(valid)})")

    def need(self, table: Table, keys: Sequence[str], where: str, told: str = "") -> None:
        """Every key stands in the table."""
        for key in keys:
            if key not in table:
                self.fail(where, f"the key {key!r} is missing{told}")

    def fail(self, where: str, message: str, cause: Exception | None = None) -> NoReturn:
        """Raise with file and table in front."""
        raise SceneFileError(f"{self.source.place(self.within + where, message)}: {message}") from cause


def _span(length: float, section: Section) -> tuple[float, Section]:
    """One span of a beam."""
    return length, section


def beam_of_section(length: float, section: Section, foundation: float = 0.0, axial_force: float = 0.0) -> Beam:
    """A beam of one section."""
    return Beam(length, section, foundation=foundation, axial_force=axial_force)


def kind_name(name: str) -> str:
    """What a file calls a class of parts.

    Examples
    --------
    >>> kind_name("LumpedMass"), kind_name("AnnularStop")
    ('lumped_mass', 'annular')
    """
    found = re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower()
    return SHORT.get(found, found)
