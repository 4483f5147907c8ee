"""Runs for ParaView: XDMF time series and VTU files through meshio, written whole or not at all.

Beams lie along x, deflect along y; bodies and impactors at their distance from the scene's beam. `displacement` and
`velocity` are vectors (use the filter Warp By Vector), `slope`, `moment`, `shear`, `stress` numbers at the nodes.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fembeam.scene import heights
from fembeam.support import require

if TYPE_CHECKING:
    from fembeam.model.run import Run

Vector = NDArray[np.float64]

SECTION_FIELDS = ("slope", "moment", "shear", "stress")


def to_xdmf(run: Run, path: str | os.PathLike[str], stride: int = 1) -> Path:
    """Write every `stride`-th sample of a run as an XDMF time series; returns the path.

    Raises
    ------
    ValueError : the run was read from a file and does not know its scene, stride below 1, a path without folder.
    """
    import meshio

    require(isinstance(stride, int) and stride >= 1, "stride must be a whole number above 0", stride, "to_xdmf",
            "give 1 for every sample")  # fmt: skip
    points, cells = _geometry(run)

    def write(target: str) -> None:
        with meshio.xdmf.TimeSeriesWriter(target, data_format="XML") as writer:
            writer.write_points_cells(points, cells)
            for sample in range(0, len(run.t), stride):
                writer.write_data(float(run.t[sample]), point_data=_values(run, sample))

    return _whole(Path(path), ".xdmf", write)


def to_vtu(run: Run, path: str | os.PathLike[str], sample: int = -1) -> Path:
    """Write one sample of a run as VTU; returns the path."""
    import meshio

    require(-len(run.t) <= sample < len(run.t), f"sample must be below {len(run.t)}, the number of samples", sample,
            "to_vtu", "count from 0, or from the end with -1")  # fmt: skip
    points, cells = _geometry(run)
    mesh = meshio.Mesh(points, cells, point_data=_values(run, sample % len(run.t)))
    return _whole(Path(path), ".vtu", lambda target: meshio.write(target, mesh, file_format="vtu"))


def _geometry(run: Run) -> tuple[Vector, list[tuple[str, Any]]]:
    """Points (p, 3) of all beams, then impactors; lines, of zero length for impactors, as XDMF has one kind of cell."""
    require(run.model is not None, "the fields need the model of the run", "a run read from a file", "export",
            "simulate again, or use dataclasses.replace(run, model=model)")  # fmt: skip
    assert run.model is not None
    beams, strikers = heights(run.model.scene)
    parts, lines, count = [], [], 0
    for shapes, height in zip((run.shapes, *run.others), beams, strict=True):
        size = len(shapes.nodes)
        parts.append(np.column_stack([shapes.nodes, np.full(size, height), np.zeros(size)]))
        lines.append(np.column_stack([np.arange(size - 1), np.arange(1, size)]) + count)
        count += size
    places = [impactor.z for impactor in run.model.matrices.impactors]
    parts.append(np.column_stack([places, strikers, np.zeros(len(places))]))
    lines.append(np.repeat(count + np.arange(len(places))[:, None], 2, axis=1))
    return np.concatenate(parts), [("line", np.concatenate(lines))]


def _values(run: Run, sample: int) -> dict[str, Vector]:
    """Fields at one sample; stress only where every section knows its fibre."""
    from dataclasses import replace

    now = replace(run, t=run.t[[sample]], q=run.q[[sample]], q_dot=run.q_dot[[sample]])
    bodies = list(enumerate((run.shapes, *run.others)))
    vectors = {
        "displacement": [now.displacement(shapes.nodes, body)[0] for body, shapes in bodies],
        "velocity": [now.velocity(shapes.nodes, body)[0] for body, shapes in bodies],
    }
    count = range(len(run.strikers))
    vectors["displacement"].append(np.array([now.impactor_displacement(i)[0] for i in count]))
    vectors["velocity"].append(np.array([now.impactor_velocity(i)[0] for i in count]))
    fields = {}
    for name, values in vectors.items():
        up = np.concatenate(values)
        fields[name] = np.column_stack([np.zeros(len(up)), up, np.zeros(len(up))])
    assert run.model is not None
    known = all(np.isfinite(f.beam.profile(f.nodes).fibre).all() for f in run.model.section_forces)
    for name in SECTION_FIELDS if known else SECTION_FIELDS[:-1]:
        parts = [now._field(name, shapes.nodes, body)[0] for body, shapes in bodies]
        fields[name] = np.concatenate([*parts, np.zeros(len(run.strikers))])
    return fields


def _whole(target: Path, suffix: str, write: Callable[[str], None]) -> Path:
    """Let meshio write beside the target, then give the file its name."""
    target = target if target.suffix == suffix else target.with_name(target.name + suffix)
    require(target.parent.is_dir(), "the folder must exist", str(target.parent), f"export to {suffix}", "make it first")
    with tempfile.TemporaryDirectory(dir=target.parent, prefix=f".{target.name}.") as folder:
        draft = os.path.join(folder, target.name)
        write(draft)
        os.replace(draft, target)
    return target
