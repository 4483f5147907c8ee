"""Scene files: TOML tables in, a Scene and its studies out.

    [beam], [frame] or [structure], [[bodies]] [[joints]]
    [[supports]] [[masses]] [[springs]] [[dashpots]] [[stops]] [[elements]] [[forces]] [[impactors]]
    [damping] [base]
    gravity = 9.81
    [reduce] [simulate] [orbit] [branch] [basins] [mode_count] [smallest_model]
    [ensemble] [speed_accuracy] [vary] [minimise] [floor_spectra]

The keys of a table are the arguments of the constructor behind it, read from its signature, so that nothing is
declared twice: a constructor that gains an argument gains a key. Units are SI, names those of the library.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fembeam.scene import Scene, Source
from fembeam.scene_file.study_tables import STUDIES
from fembeam.scene_file.tables import SceneFileError, TableReader
from fembeam.support import file_path

if TYPE_CHECKING:
    from fembeam.model import Model


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

    @property
    def of_run(self) -> dict[str, Any]:
        """Duration, output step and transient of [simulate], for `fembeam.inspection`; empty without that study."""
        study = self.studies.get("simulate")
        return {} if study is None else {"duration": study.duration, "dt": study.dt, "discard": study.discard}

    def model(self, **others: Any) -> Model:
        """The scene reduced as [reduce] says, or with other arguments; ValueError names the file."""
        try:
            return self.scene.reduce(**{**self.reduce, **others})
        except (ValueError, TypeError, RuntimeError) as error:  # RuntimeError: modes that cannot be computed
            raise ValueError(self.placed("[reduce]", error)) from error

    def placed(self, where: str, error: Exception) -> str:
        """What an error says, with its line in the file, unless it says so already."""
        said = " ".join(str(error).split()) or type(error).__name__
        return said if said.startswith(str(self.path)) else f"{self.source.place(where, said)}: {said}"


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
    source = _source(file_path(path, "scene_file.read"))
    return built(replace(source, overrides=(*source.overrides, *overrides)), overrides)


def _source(path: Path) -> Source:
    """The text of a scene file or of the one a run was made from."""
    if path.suffix in (".npz", ".h5", ".hdf5"):
        from fembeam.model import load

        try:
            source = load(path).source
        except (OSError, ValueError, ImportError) as error:
            raise SceneFileError(f"{path}: cannot be read: {error}") from None
        if source is None:
            raise SceneFileError(f"{path}: holds no scene file; this run was made in Python, so repeat it there")
        return source
    try:
        content = path.read_bytes()
        if b"\0" in content:
            raise SceneFileError(f"{path}: is not a text file in UTF-8 (zero bytes, as in UTF-16); save it as UTF-8")
        return Source(path, content.decode("utf-8-sig"))  # some editors begin a file with a mark
    except OSError as error:
        raise SceneFileError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise SceneFileError(f"{path}: is not a text file in UTF-8; save it as UTF-8") from None


def built(source: Source, asked: Sequence[str] = ()) -> SceneFile:
    """The scene file of a source. Files that it names are read from copies saved with a run, if any, else from disk.

    `asked`: those of its overrides that are asked for now, and are not the text's own.
    """
    with source.unpacked() as places:
        reader = TableReader(source, places, [override.partition("=")[2] for override in asked])
        try:
            tables = source.tables()
        except ValueError as error:
            raise SceneFileError(str(error)) from None
        file = SceneFile(source, *reader.contents(tables, STUDIES))
        carried = {name: place.read_bytes() for name, place in places.items()}
        return replace(file, source=replace(source, files=carried))


def template(name: str = "scene.toml") -> str:
    """The annotated file that `fembeam new` writes: it runs as it is, and shows what else a file may hold."""
    return Path(__file__).with_name("template.toml").read_text(encoding="utf-8").replace("scene.toml", name)
