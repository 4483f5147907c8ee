"""A run written to a file, ``.npz`` or HDF5, and read from one."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np

import solvers
from fembeam.model import saved_arrays
from fembeam.model.run import Run
from fembeam.response import (
    READOUT_UNITS,
    PlacedLog,
    PlacedShapes,
    Shapes,
    Site,
    known_along_members,
    packed,
    site,
    unpacked,
)
from fembeam.scene import Source
from fembeam.support import file_path, tuples, versions, written_whole
from solvers.problem import FrictionLog, Losses, Transitions, columns_of, optional

FORMAT = 5
HDF5 = (".h5", ".hdf5")
MOST_WORDS = 1 << 28  # bytes
SIGNATURE, ZIPPED = b"\x89HDF\r\n\x1a\n", b"PK"  # of HDF5 and npz
UNITS = {
    "t, contact_t_in, contact_t_out": "s",
    "q": "m √kg",
    "q_dot": "m √kg/s",
    "force, mean_force, contact_peak_force": "N",
    "contact_speed_in, contact_speed_out": "m/s",
    "contact_peak_indentation, nodes, stops[:, 0], stops[:, 2]": "m",
    "contact_impulse": "N s",
    "contact_energy_loss, energy_*, work": "J",
    "losses": "of each contact: work / J, stored / J, slip / m",
    "shapes, directions": "1/√kg",
    "impactor_masses": "kg",
    **READOUT_UNITS,
    "on": "of each contact: the beam it pushes, whether from frame 0, body 1 or impactor 2, the number of that",
    "transitions": "rows of contact, t / s, border, number in events, δ / m, δ̇ / m/s, F / N, impulse / N s, work / J",
    "kinds": "(of rotation, always acting) of each contact: rad for m, N m for N where it is of rotation",
}

RUBS = "of each contact with friction: μ, k_t / N/m, R / m (negative outside a circle), Ω / rad/s; or zeros"
FRICTION_LOG = "rows of stop, t_in, t_out / s, angles / rad, speeds / m/s, peak / N, N s, slip / m, loss / J"
CIRCLES = "m, of each contact: radius of a circular clearance, negative of an outer one, and its centre; or zeros"


def save(run: Run, path: Path) -> Path:
    """Write everything to one file, whole or not at all: HDF5 if it ends in .h5 or .hdf5, else ``.npz``."""
    hdf5 = optional("h5py", "a run in HDF5") if path.suffix in HDF5 else None
    about, arrays = _contents(run)
    target = path if hdf5 or path.suffix == ".npz" else path.with_name(path.name + ".npz")
    with written_whole(target) as file:
        if hdf5 is None:
            np.savez(file, about=about, **arrays)  # type: ignore[arg-type]
        else:
            with hdf5.File(file, "w") as group:
                for name, content in {"about": about, **arrays}.items():
                    group[name] = content
                    group[name].attrs["crc32"] = _crc(content)
    return target


def _crc(content: Any) -> int:
    """Checksum of words or an array, such as an npz has of its own."""
    return crc32(content.encode() if isinstance(content, str) else np.ascontiguousarray(content).tobytes())


def _sound(entry: Any) -> Any:
    """Words or an array of an HDF5 file; ValueError if its bytes are no longer those written."""
    content = entry.asstr()[()] if entry.dtype.kind == "O" else entry[()]
    if "crc32" in entry.attrs and _crc(content) != entry.attrs["crc32"]:
        raise ValueError(f"{entry.name.strip('/')} differs from what was written")
    return content


def _contents(run: Run) -> tuple[str, dict[str, Any]]:
    """Words as JSON, and arrays by name."""
    about = {
        "format": FORMAT,
        "status": run.status,
        "sampled": run.sampled,
        "names": run.names,
        "given": run.name_given,
        "scene": run.scene,
        "cost": {f.name: getattr(run.cost, f.name) for f in fields(run.cost)},
        "units": UNITS
        | ({"circles": CIRCLES} if run.circles.any() else {})
        | ({"rubs": RUBS, "friction_log": FRICTION_LOG} if run.rubs.any() else {}),
        "reached": run.reached,
        "versions": versions(),
        "acting": run.places,
        "bodies": [shapes.words for shapes in (run.shapes, *run.others)],
    }
    if run.source is not None:
        about["scene_file"] = {"name": run.source.path.name, "text": run.source.text,
                               "overrides": run.source.overrides, "files": list(run.source.files)}  # fmt: skip
    carried, lost = run.source.files.values() if run.source else (), run.losses
    arrays = {
        **{"t": run.t, "q": run.q, "q_dot": run.q_dot, "force": run._forces, "mean_force": _means(run)},
        **{"losses": np.stack((lost.work, lost.stored, lost.slip), axis=1), "work": lost.history, "end": run.end},
        **{"stops": run.stops, "on": run.between, "kinds": run.kinds},
        **{"directions": run.directions, "impactor_masses": run.impactor_masses},
        **dict(zip(("nodes", "shapes"), _arrays_of(run.shapes), strict=True)),
        **{f"nodes_{i}": _arrays_of(shapes)[0] for i, shapes in enumerate(run.others, 1)},
        **{f"shapes_{i}": _arrays_of(shapes)[1] for i, shapes in enumerate(run.others, 1)},
        **{f"contact_{name}": column for name, column in run.contacts.arrays().items()},
        **{
            f"energy_{name}": values
            for name, values in vars(run.energy).items()
            if name == "initial" or np.ndim(values)
        },
        **{f"file_{i}": np.frombuffer(content, dtype=np.uint8) for i, content in enumerate(carried)},
    }
    arrays |= {"circles": run.circles} if run.circles.any() else {}
    if run.rubs.any():
        arrays |= {"rubs": run.rubs, "friction_log": np.array(list(run.friction_log.arrays().values()), dtype=float).T}
        arrays["losses"] = np.column_stack((arrays["losses"], lost.friction, lost.spin))
    about["readout"], read = packed(run.readout)
    about["events"], arrays["transitions"] = _packed(run.transitions)
    arrays |= read
    return json.dumps(about | {"arrays": list(arrays)}, default=float), arrays


def _arrays_of(shapes: Any) -> tuple[Any, Any]:
    """Nodes and values of a beam's shapes; of a body numbers of its places, and the values one place after another."""
    if shapes.named:
        return np.arange(len(shapes.known), dtype=float), shapes.values.reshape(-1, shapes.values.shape[2])
    return shapes.nodes, shapes.values


def _shapes_of(words: Any, nodes: Any, values: Any) -> Any:
    """The shapes that these are of."""
    placed = words is not None and "components" in words
    count = len(words["components"]) if placed else 2
    if len(values) != count * len(nodes):
        raise ValueError(f"shapes must have {count} rows for each of {len(nodes)} places, there are {len(values)}")
    return PlacedShapes.of_words(words, values) if placed else Shapes.of_words(words, nodes, values)


def _means(run: Run) -> Any:
    """Mean forces (m, k) of all contacts; NaN where there are too few samples for one."""
    if len(run.t) < 2:
        return np.full((len(run.stops), len(run.t)), np.nan)
    means = [run.force(stop, mean=True) for stop in range(len(run.stops))]
    return np.array(means).reshape(len(means), len(run.t))


def _packed(log: Transitions) -> tuple[list[str], Any]:
    """Names of events, and the log as a table (k, 9) that numbers them."""
    columns = log.arrays()
    events = sorted(set(log.event))
    columns["event"] = [events.index(event) for event in log.event]
    return events, np.array(list(columns.values()), dtype=float).T


def _unpacked(events: list[str], table: Any) -> list[Any]:
    """The columns of the log of that table."""
    contact, t, border, event, *others = table.T.copy()
    return [contact.astype(int), t, border.astype(int), np.array(events, dtype=object)[event.astype(int)], *others]


class _OtherFormatError(ValueError):
    """A run saved by another version."""


def load(path: str | os.PathLike[str]) -> Run:
    """Read a run written by `Run.save`.

    Raises
    ------
    FileNotFoundError; ImportError for HDF5 without h5py; ValueError when the file is not a run of this library, is
    damaged, or its arrays contradict each other.

    Examples
    --------
    >>> import fembeam as fb
    >>> import tempfile
    >>> scene = fb.Scene(fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01)), [fb.Clamped(0.0)],
    ...                  damping=fb.ModalDamping(0.01), base=fb.Harmonic(1e-3, 100.0))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     again = load(scene.reduce(modes=1).simulate(0.1, 0.01).save(f"{folder}/run"))
    >>> again.status, len(again.t)
    ('finished', 11)
    """
    file = file_path(path, "load")
    if file.is_dir():
        raise ValueError(f"{path} is a folder: give the file of a run in it, {file / 'run.npz'}")
    try:
        return _of_arrays(*_read(file), file)
    except _OtherFormatError as error:
        raise ValueError(f"{path} {error}") from None
    except (FileNotFoundError, ImportError):
        raise
    except Exception as error:
        raise ValueError(f"{path} is not a saved run, or is damaged: {error}") from error


def _read(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """The words, and arrays by name."""
    with path.open("rb") as file:
        first_bytes = file.read(len(SIGNATURE))
    if not first_bytes.startswith((SIGNATURE, ZIPPED)):
        raise ValueError("it is neither npz nor HDF5; give a file of Run.save")
    if first_bytes != SIGNATURE:
        with np.load(path, allow_pickle=False) as data:
            names = [name.removesuffix(".npy") for name in data.zip.namelist() if name.endswith(".npy")]
            return _known({name: _header(data.zip, name) for name in names}, data.__getitem__)
    with optional("h5py", "a run in HDF5").File(path, "r") as group:
        headers = {name: (entry.shape, entry.dtype) for name, entry in group.items() if hasattr(entry, "shape")}
        return _known(headers, lambda name: _sound(group[name]))


def _header(archive: Any, name: str) -> tuple[tuple[int, ...], Any]:
    """Shape and type of an array in an npz, which is not read."""
    with archive.open(f"{name}.npy") as file:
        old = np.lib.format.read_magic(file) == (1, 0)
        shape, _, dtype = (np.lib.format.read_array_header_1_0 if old else np.lib.format.read_array_header_2_0)(file)
    return shape, dtype


def _known(
    headers: dict[str, tuple[tuple[int, ...], Any]], read: Callable[[str], Any]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """The words, and what a run is read from: types and shapes are checked before any array is read, others never."""
    if "about" not in headers:
        raise ValueError(f"it holds {', '.join(sorted(headers)) or 'nothing'}; give a file of Run.save")
    if headers["about"][1].itemsize > MOST_WORDS:
        raise ValueError("its words are too long")
    about = json.loads(str(read("about")))
    if about["format"] != FORMAT:
        raise _OtherFormatError(f"has format {about['format']}, this version reads {FORMAT}; simulate again")
    if missing := {*about.get("arrays", ())} - {*headers}:  # a byte of the archive's list of them hides the next one
        raise ValueError(f"it has lost {', '.join(sorted(missing))}")
    outlines = {name: saved_arrays.outline(*headers[name]) for name in headers}
    names = saved_arrays.known(outlines, len((about.get("scene_file") or {"files": ()})["files"]))
    return about, {name: read(name) for name in names}


def _of_arrays(about: dict[str, Any], arrays: dict[str, Any], path: Path) -> Run:
    """A run from the contents of its file."""
    saved_arrays.check({name: array for name, array in arrays.items() if not name.startswith("file_")})
    source = None
    if given := about.get("scene_file"):
        files = {name: arrays[f"file_{i}"].tobytes() for i, name in enumerate(given["files"])}
        name = Path(given["name"]).name
        source = Source(path.with_name(name), given["text"], tuple(given["overrides"]), files, of_run=True)
    bodies = sum(name.split("_")[0] == "nodes" for name in arrays)
    if len(about["bodies"]) != bodies or len(about["acting"]) != len(arrays["stops"]):
        raise ValueError("its words and its arrays are of other bodies and stops")
    numbered = zip(about["bodies"], ("", *(f"_{j}" for j in range(1, bodies))), strict=True)
    shapes = [_shapes_of(words, arrays[f"nodes{i}"], arrays[f"shapes{i}"]) for words, i in numbered]
    readout = unpacked(about["readout"], arrays, [getattr(one, "nodes", None) for one in shapes])
    shapes = [known_along_members(*one) for one in zip(shapes, readout["section_forces"], strict=True)]
    work, stored, slip, *rubbed = arrays["losses"].T
    names = _names(about, len(arrays["stops"]))
    log = (arrays[f"contact_{name}"] for name in columns_of(solvers.ContactLog))
    energy = {name.removeprefix("energy_"): array for name, array in arrays.items() if name.startswith("energy_")}
    return Run(
        *(arrays["t"], arrays["q"], arrays["q_dot"]),
        contacts=PlacedLog(*log, names=names, sites=_sites(about, arrays, shapes)),
        ledger=partial(solvers.Energy, **energy),
        status=about["status"],
        cost=solvers.Cost(**about["cost"]),
        shapes=shapes[0],
        stops=arrays["stops"],
        directions=arrays["directions"],
        impactor_masses=arrays["impactor_masses"],
        scene=about["scene"],
        make_transitions=partial(Transitions, *_unpacked(about["events"], arrays["transitions"]), names=names),
        make_losses=partial(Losses, work, stored, slip, arrays["work"], names=names, **_rubbed(rubbed)),
        end=arrays["end"],
        kept_readout=readout,
        others=tuple(shapes[1:]),
        source=source,
        versions=about["versions"],
        between=arrays["on"],
        kinds=arrays["kinds"],
        circles=arrays.get("circles", np.zeros((len(arrays["stops"]), 3))),
        rubs=arrays.get("rubs", np.zeros((len(arrays["stops"]), 4))),
        make_friction_log=partial(_friction_log, arrays["friction_log"], names) if "friction_log" in arrays else None,
        reached=float(about.get("reached", 0.0)),
        places=tuples(about["acting"]),
        sampled=about["sampled"],
        names=names,
        name_given=tuple(map(bool, about["given"])),
    )


def _sites(about: dict[str, Any], arrays: dict[str, Any], shapes: list[Any]) -> tuple[Site, ...]:
    """Where the contacts are."""
    plane = [isinstance(one, Shapes) for one in shapes]
    columns = (arrays["stops"][:, 1], arrays["on"][:, 0], arrays["kinds"])
    each: Any = zip(tuples(about["acting"]), *(column.tolist() for column in columns), strict=True)
    return tuple(site(at, push, body, rotation, always, plane[body]) for at, push, body, (rotation, always) in each)


def _rubbed(columns: list[Any]) -> dict[str, Any]:
    """Losses by friction and works of spins by name, if there are any."""
    return dict(zip(("friction", "spin"), columns, strict=False))


def _friction_log(table: Any, names: tuple[str, ...]) -> FrictionLog:
    """The log of friction of its table."""
    contact, *others = table.T.copy()
    return FrictionLog(contact.astype(int), *others, names=names)


def _names(about: dict[str, Any], contacts: int) -> tuple[str, ...]:
    """What the contacts are called; ValueError unless each has one name and says whether it was given."""
    names = about["names"]
    if not len(names) == len(about["given"]) == contacts or not all(isinstance(name, str) for name in names):
        raise ValueError(f"its words contradict its arrays: {contacts} contacts need as many names, it has {names}")
    return tuple(names)
