"""Scene files: TOML tables in, a Scene and its studies out.

    [beam] [[supports]] [[masses]] [[springs]] [[dashpots]] [[stops]] [[forces]] [[impactors]] [damping] [base]
    gravity = 9.81
    [reduce] [simulate] [orbit] [branch] [basins] [mode_count] [smallest_model]
    [ensemble] [speed_accuracy]

The keys of a table are the arguments of the constructor behind it, read from its signature, so that nothing is
declared twice: a constructor that gains an argument gains a key. Units are SI, names those of the library.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NoReturn

from fembeam.beams import Beam, ModalDamping, Rayleigh, Section, Taper
from fembeam.scene import FEATURES, Scene, Source
from fembeam.scene_file.basins_table import BasinsTable
from fembeam.scene_file.branch_table import BranchTable
from fembeam.scene_file.ensemble_table import EnsembleTable
from fembeam.scene_file.keys import Constructors, converted, fits, listed, nearest, parameters, required, shown, wanted
from fembeam.scene_file.kinds import SECTION, SIGNAL, Nested, nested
from fembeam.scene_file.orbit_table import OrbitTable
from fembeam.scene_file.study_tables import ModeCountTable, SmallestModelTable, SpeedAccuracyTable
from fembeam.support import require_non_negative, require_positive

Table = Mapping[str, Any]


class SceneFileError(ValueError):
    """A scene file that cannot be read; the message names file, table, key, and what would be valid."""


@dataclass(frozen=True)
class Simulate:
    """The table [simulate]: integrate from rest.

    Parameters
    ----------
    duration : s, > 0.
    dt : output sampling in s, > 0.
    solver : a method of `solvers`; None is the library's best. In a file { kind = "…", … }.
    discard : s at the beginning that statistics leave out, 0 to below the duration.
    """

    duration: float
    dt: float
    solver: Any = None
    discard: float = 0.0

    def __post_init__(self) -> None:
        require_positive("duration", self.duration, "simulate", "give s")
        require_positive("dt", self.dt, "simulate", "give the output sampling in s")
        require_non_negative("discard", self.discard, "simulate", "give s")
        for name in ("dt", "discard"):
            if not getattr(self, name) < self.duration:
                raise ValueError(
                    f"{name} must be below the duration of {self.duration:g} s, got {getattr(self, name):g}"
                )


@dataclass(frozen=True)
class SceneFile:
    """What a scene file says: the scene, the arguments of `Scene.reduce`, the study tables by name; and its text."""

    source: Source
    scene: Scene
    reduce: dict[str, Any] = field(default_factory=dict)
    studies: dict[str, Any] = field(default_factory=dict)

    @property
    def path(self) -> Path:
        """The file."""
        return self.source.path


STUDIES: Constructors = {
    "simulate": Simulate,
    "orbit": OrbitTable,
    "branch": BranchTable,
    "basins": BasinsTable,
    "ensemble": EnsembleTable,
    "mode_count": ModeCountTable,
    "smallest_model": SmallestModelTable,
    "speed_accuracy": SpeedAccuracyTable,
}


def read(path: str | Path, overrides: Sequence[str] = ()) -> SceneFile:
    """Read and check a scene file; nothing is computed.

    Parameters
    ----------
    path : a TOML file, paths inside it being relative to its folder; or a saved run that was made from one.
    overrides : such as "simulate.duration=10", "stops[0].law.stiffness=1e9".

    Returns
    -------
    SceneFile : with the Scene, the arguments of `Scene.reduce`, the study tables.

    Raises
    ------
    SceneFileError : the file cannot be read, is no TOML (with the line), has an unknown or missing key, a value
        of the wrong type, or one its constructor refuses.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp(), "cantilever.toml")
    >>> _ = path.write_text('''
    ... [beam]
    ... length = 0.5
    ... section = { shape = "circle", E = 2.1e11, rho = 7800, diameter = 0.01 }
    ... [[supports]]
    ... kind = "clamped"
    ... z = 0
    ... ''')
    >>> read(path).scene.supports
    (Clamped(z=0.0),)
    """
    return built(replace(source := _source(Path(path)), overrides=(*source.overrides, *overrides)), overrides)


def _source(path: Path) -> Source:
    """The text of a scene file or of the one a run was made from."""
    if path.suffix == ".npz":
        from fembeam.model import load

        try:
            source = load(path).source
        except (OSError, ValueError) as error:
            raise SceneFileError(f"{path}: cannot be read: {error}") from None
        if source is None:
            raise SceneFileError(f"{path}: holds no scene file; this run was made in Python, so repeat it there")
        return source
    try:
        return Source(path, path.read_bytes().decode("utf-8"))
    except OSError as error:
        raise SceneFileError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise SceneFileError(f"{path}: is not a text file in UTF-8") from None


def built(source: Source, asked: Sequence[str] = ()) -> SceneFile:
    """What a text says; the files that it names are taken from it where it carries them, and carried from then on.

    `asked`: those of its overrides that are asked for now, and are not the text's own.
    """
    with source.unpacked() as places:
        reader = _Reader(source, places, [override.partition("=")[2] for override in asked])
        try:
            tables = source.tables()
        except ValueError as error:
            raise SceneFileError(str(error)) from None
        file = reader.scene_file(tables)
        carried = {name: place.read_bytes() for name, place in places.items()}
        return replace(file, source=replace(source, files=carried))


@dataclass(frozen=True)
class _Reader:
    """Turns tables into objects; knows the text for messages, and where the files lie that it names."""

    source: Source
    places: dict[str, Path]
    asked: Sequence[str] = ()

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
        return self.places.setdefault(name, place)

    def scene_file(self, tables: Table) -> SceneFile:
        """The whole file."""
        parts = [name for name in inspect.signature(Scene).parameters if name != "bodies"]  # one beam per file
        self.check_keys(tables, [*parts, "reduce", *STUDIES], "the file", "table")
        if "beam" not in tables:
            self.fail("the file", "needs a table [beam]")
        for name in tables:
            self.check_form(name, tables[name])
        built = {name: self.part(name, tables[name]) for name in parts if name in tables}
        try:
            scene = Scene(**built)
        except (ValueError, TypeError, ArithmeticError) as error:
            self.fail("the scene", str(error), error)
        reduce = self.arguments(Scene.reduce, tables.get("reduce", {}), "[reduce]")
        studies = {
            name: self.build(study, tables[name], f"[{name}]") for name, study in STUDIES.items() if name in tables
        }
        for name, study in studies.items():
            if hasattr(study, "check"):
                self.made(study.check, {"scene": scene}, f"[{name}]")
        return SceneFile(self.source, scene, reduce, studies)

    def check_form(self, name: str, value: Any) -> None:
        """Features come as [[name]], gravity as a number, everything else as [name]."""
        if name == "gravity":
            return
        if name in FEATURES:
            if not (isinstance(value, list) and all(isinstance(entry, dict) for entry in value)):
                self.fail(name, f"must be a list of tables; write [[{name}]]")
        elif not isinstance(value, dict):
            self.fail(name, f"must be a table; write [{name}]" + (", once" if isinstance(value, list) else ""))

    def part(self, name: str, value: Any) -> Any:
        """One argument of Scene from its table or list of tables."""
        if name == "beam":
            return self.beam(value)
        if name == "gravity":
            return value
        if name == "damping":
            if "zeta" in value and {"alpha", "beta"} & set(value):
                self.fail("[damping]", "give either zeta, or alpha and beta, not both")
            if {"alpha", "beta"} & set(value):
                return self.build(Rayleigh, value, "[damping]")
            return self.build(ModalDamping, value, "[damping]", "alpha", "beta")
        if name == "base":
            return self.chosen(SIGNAL, value, "[base]")
        kinds = {snake(kind.__name__): kind for kind in FEATURES[name]}
        made = []
        for number, table in enumerate(value):
            where = f"[[{name}]] number {number + 1}"
            only = next(iter(kinds.values())) if len(kinds) == 1 else None
            usual = "point_force" if name == "forces" else ""
            made.append(self.build(only, table, where) if only else self.choose(kinds, table, where, default=usual))
        return made

    def beam(self, table: Table) -> Beam:
        """A beam of one section, of `spans`, or of a `mesh`."""
        common = ["foundation", "axial_force"]
        options = {key: table[key] for key in common if key in table}
        if "mesh" in table:
            self.check_keys(table, ["mesh", "sections", "data", *common], "[beam]", "key")
            sections, path = table.get("sections"), table["mesh"]
            if not isinstance(sections, dict) or not isinstance(path, str):
                self.fail("[beam]", "a mesh needs its path and a table sections = { name = { section }, … }")
            found = {name: self.section(entry, f"[beam] sections {name}") for name, entry in sections.items()}
            options |= {"data": table["data"]} if "data" in table else {}
            return self.made(
                Beam.from_mesh, {"path": self.file(path, "[beam]"), "sections": found, **options}, "[beam]"
            )
        if "spans" not in table:
            return self.build(beam_of_section, table, "[beam]")
        self.check_keys(table, ["spans", *common], "[beam]", "key")
        if not isinstance(table["spans"], list):
            self.fail("[beam]", "spans must be a list of tables with length and section")
        spans = [
            self.build(_span, entry, f"[beam] span {number}") for number, entry in enumerate(table["spans"], start=1)
        ]
        return self.made(Beam.of_spans, {"spans": spans, **options}, "[beam]")

    def section(self, table: Any, where: str) -> Section | Taper:
        """A section by its shape."""
        return self.chosen(SECTION, table, where)

    def choose(self, kinds: Constructors, table: Any, where: str, key: str = "kind", default: str = "") -> Any:
        """Build the constructor that `kind` (or `shape`) names."""
        if not isinstance(table, dict):
            self.fail(where, f"must be a table {{ {key} = …, … }}, got {table!r}")
        name = table.get(key, default)
        if name not in list(kinds):  # a list: what a file gives need not be hashable
            got = f"got {name!r}{nearest(name, kinds)}" if key in table else "it is missing"
            self.fail(where, f"{key} must be one of {listed(kinds)}; {got}")
        return self.build(kinds[name], {k: v for k, v in table.items() if k != key}, where, chosen_by=key)

    def build(self, constructor: Callable[..., Any], table: Any, where: str, *also: str, chosen_by: str = "") -> Any:
        """Call the constructor with a table's values."""
        return self.made(constructor, self.arguments(constructor, table, where, *also, chosen_by=chosen_by), where)

    def made(self, constructor: Callable[..., Any], arguments: Table, where: str) -> Any:
        """Call a constructor; what it refuses is said with the table."""
        try:
            return constructor(**arguments)
        except SceneFileError:
            raise
        except OSError as error:
            self.fail(where, f"{error.filename}: {error.strerror}", error)
        except (ValueError, TypeError, ArithmeticError, MemoryError) as error:
            self.fail(where, str(error) or type(error).__name__, error)

    def arguments(
        self, constructor: Callable[..., Any], table: Any, where: str, *also: str, chosen_by: str = ""
    ) -> dict[str, Any]:
        """The values of a table, checked against the constructor's signature."""
        if not isinstance(table, dict):
            self.fail(where, f"must be a table, got {table!r}")
        keys = parameters(constructor)
        self.check_keys(table, [chosen_by, *keys, *also] if chosen_by else [*keys, *also], where, "key")
        for key, parameter in keys.items():
            if key not in table and parameter.default is inspect.Parameter.empty:
                kind = f" ({words})" if (words := wanted(parameter.annotation)) else ""
                self.fail(where, f"the key {key!r} is missing{kind}; it needs {listed(required(keys))}")
        return {
            parameter.name: self.value(table[key], key, parameter, where)
            for key, parameter in keys.items()
            if key in table
        }

    def value(self, value: Any, key: str, parameter: inspect.Parameter, where: str) -> Any:
        """One value: a table for what has its own constructor, else checked by the annotation."""
        inner = f"{where} {key}"
        if kind := nested(key, parameter):
            if kind.listed and not isinstance(value, list):
                self.fail(inner, f"must be a list of {key}, got {shown(value)}")
            if kind.listed:
                return [self.chosen(kind, one, f"{inner} number {i}") for i, one in enumerate(value, start=1)]
            return self.chosen(kind, value, inner)
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
        """Every key is a valid one; the nearest one is named otherwise."""
        for key in table:
            if key not in valid:
                self.fail(where, f"unknown {what} {key!r}{nearest(key, valid)} (valid: {listed(valid)})")

    def fail(self, where: str, message: str, cause: Exception | None = None) -> NoReturn:
        """Raise with file and table in front."""
        raise SceneFileError(f"{self.source.place(where, message)}: {message}") from cause


def _span(length: float, section: Section) -> tuple[float, Section]:
    """One span of a beam."""
    return length, section


def beam_of_section(length: float, section: Section, foundation: float = 0.0, axial_force: float = 0.0) -> Beam:
    """A beam of one section."""
    return Beam(length, section, foundation=foundation, axial_force=axial_force)


def snake(name: str) -> str:
    """LumpedMass -> lumped_mass."""
    return re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower()
