"""A run written to a file, and read from one."""

from __future__ import annotations

import json
import os
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import solvers
from fembeam.model import saved_arrays
from fembeam.model.run import Run
from fembeam.model.shapes import Shapes
from fembeam.scene import Source
from fembeam.support import versions, written_whole

OLD_NAMES = {"contact_floored": "contact_entry_rate_clipped"}  # in files of earlier versions

FORMAT = 2
UNITS = {
    "t, contact_t_in, contact_t_out": "s",
    "q": "m √kg",
    "q_dot": "m √kg/s",
    "force, contact_peak_force": "N",
    "contact_speed_in, contact_speed_out": "m/s",
    "contact_peak_indentation, nodes, stops[:, 0], stops[:, 2]": "m",
    "contact_impulse": "N s",
    "contact_energy_loss, energy_*": "J",
    "shapes, directions": "1/√kg",
    "strikers": "kg",
    "kinds": "(of rotation, always acting) of each contact: rad for m, N m for N where it is of rotation",
}


def save(run: Run, path: Path) -> Path:
    """Write everything to one ``.npz`` file, whole or not at all."""
    about = {
        "format": FORMAT,
        "status": run.status,
        "scene": run.scene,
        "cost": {f.name: getattr(run.cost, f.name) for f in fields(run.cost)},
        "units": UNITS,
        "versions": versions(),
    }
    if run.source is not None:
        about["scene_file"] = {"name": run.source.path.name, "text": run.source.text,
                               "overrides": run.source.overrides, "files": list(run.source.files)}  # fmt: skip
    carried = run.source.files.values() if run.source else ()
    arrays = {
        **{"t": run.t, "q": run.q, "q_dot": run.q_dot, "force": run._forces},
        **{"stops": run.stops, "kinds": run.kinds, "directions": run.directions, "strikers": run.strikers},
        **{"nodes": run.shapes.nodes, "shapes": run.shapes.values},
        **{f"nodes_{i}": shapes.nodes for i, shapes in enumerate(run.others, 1)},
        **{f"shapes_{i}": shapes.values for i, shapes in enumerate(run.others, 1)},
        **{f"contact_{name}": column for name, column in run.contacts.arrays().items()},
        **{f"energy_{f.name}": getattr(run.energy, f.name) for f in fields(run.energy)},
        **{f"file_{i}": np.frombuffer(content, dtype=np.uint8) for i, content in enumerate(carried)},
    }
    target = path if path.suffix == ".npz" else path.with_name(path.name + ".npz")
    with written_whole(target) as file:
        np.savez(file, about=json.dumps(about), **arrays)  # type: ignore[arg-type]
    return target


def load(path: str | os.PathLike[str]) -> Run:
    """Read a run written by `Run.save`.

    Raises
    ------
    FileNotFoundError; ValueError when the file is not a run of this library, is damaged, or its arrays contradict each
    other.

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
    try:
        with np.load(path, allow_pickle=False) as data:
            about = json.loads(str(data["about"]))
            arrays = {OLD_NAMES.get(name, name): data[name] for name in data.files if name != "about"}
        if about["format"] != FORMAT:
            raise ValueError(f"it has format {about['format']}, this version reads {FORMAT}")
        return _of_arrays(about, arrays, Path(path))
    except FileNotFoundError:
        raise
    except Exception as error:
        raise ValueError(f"{path} is not a saved run, or is damaged: {error}") from error


def _of_arrays(about: dict[str, Any], arrays: dict[str, Any], path: Path) -> Run:
    """A run from the contents of its file."""
    arrays.setdefault("kinds", np.zeros((len(arrays["stops"]), 2), dtype=bool))  # of earlier versions
    saved_arrays.check({name: array for name, array in arrays.items() if not name.startswith("file_")})
    source = None
    if given := about.get("scene_file"):
        files = {name: arrays[f"file_{i}"].tobytes() for i, name in enumerate(given["files"])}
        name = Path(given["name"]).name
        source = Source(path.with_name(name), given["text"], tuple(given["overrides"]), files, of_run=True)
    bodies = sum(name.split("_")[0] == "nodes" for name in arrays)
    return Run(
        *(arrays["t"], arrays["q"], arrays["q_dot"]),
        contacts=solvers.ContactLog(*(arrays[f"contact_{f.name}"] for f in fields(solvers.ContactLog))),
        ledger=partial(solvers.Energy, *(arrays[f"energy_{f.name}"] for f in fields(solvers.Energy))),
        status=about["status"],
        cost=solvers.Cost(**about["cost"]),
        shapes=Shapes(arrays["nodes"], arrays["shapes"]),
        stops=arrays["stops"],
        directions=arrays["directions"],
        strikers=arrays["strikers"],
        scene=about["scene"],
        stored_forces=arrays["force"],
        others=tuple(Shapes(arrays[f"nodes_{i}"], arrays[f"shapes_{i}"]) for i in range(1, bodies)),
        source=source,
        versions=about.get("versions", {}),
        kinds=arrays["kinds"].astype(bool),
    )
