"""Runs for ParaView: XDMF time series, VTU files and series of them through meshio, written whole or not at all.

Beams lie along x, deflect along y; bodies and impactors at their distance from the scene's beam. `displacement` and
`velocity` are vectors (use the filter Warp By Vector), `slope`, `moment`, `shear`, `stress` numbers at the nodes.
Frames and structures lie where they are, on the lines that figures show; a frame by itself has its section forces.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from fembeam.response import rows_of
from fembeam.structures import FrameForces
from fembeam.support import file_path, is_whole, require, require_switch, written_beside
from solvers.problem import optional

if TYPE_CHECKING:
    from fembeam.model.run import Run

Vector = NDArray[np.float64]

SECTION_FIELDS = ("slope", "moment", "shear", "stress")
PVD = """<?xml version="1.0"?>
<VTKFile type="Collection" version="0.1">
<Collection>
{}
</Collection>
</VTKFile>
"""


def to_xdmf(run: Run, path: str | os.PathLike[str], stride: int = 1, hdf5: bool = False) -> Path:
    """Write every `stride`-th sample of a run as an XDMF time series, its numbers as text or in HDF5; returns the path.

    Raises
    ------
    ValueError : stride below 1, a path without folder.
    ImportError : HDF5 without h5py.
    """
    from meshio.xdmf import TimeSeriesWriter

    require_switch("hdf5", hdf5, "Run.to_xdmf")
    h5py = optional("h5py", "XDMF with HDF5 data") if hdf5 else None
    samples, points, cells, values = _samples(run, stride), *_geometry(run), _fields(run)
    target = _target(file_path(path, "Run.to_xdmf"), ".xdmf")
    with written_beside(target) as draft:
        writer: Any = TimeSeriesWriter(draft, data_format="HDF" if hdf5 else "XML")
        writer.numpy_to_xml_string = _as_text if h5py is None else writer.numpy_to_xml_string
        if h5py is not None:  # as a context it would take the working directory
            writer.h5_filename = os.path.splitext(draft)[0] + ".h5"
            writer.h5_file = h5py.File(writer.h5_filename, "w")
        writer.write_points_cells(points, cells)
        for sample in samples:
            writer.write_data(float(run.t[sample]), point_data=values(sample))
        writer.__exit__()
    return target


def _as_text(numbers: NDArray[Any]) -> str:
    """Numbers as meshio writes them, one a line; its own way takes three times as long."""
    line = "%.16e\n" if numbers.dtype.kind == "f" else "%d\n"
    return line * numbers.size % tuple(numbers.ravel().tolist())


def to_vtu(run: Run, path: str | os.PathLike[str], sample: int = -1, stride: int | None = None) -> Path:
    """Write one sample of a run as VTU, or every `stride`-th and their times as PVD; returns the path to open."""
    import meshio

    right = is_whole(sample) and -len(run.t) <= sample < len(run.t)
    require(right, f"sample must be below {len(run.t)}, the number of samples", sample,
            "to_vtu", "count from 0, or from the end with -1")  # fmt: skip
    points, cells, values = *_geometry(run), _fields(run)

    def write(target: str, number: int) -> None:
        meshio.write(target, meshio.Mesh(points, cells, point_data=values(number)), file_format="vtu")

    path = file_path(path, "Run.to_vtu")
    if stride is None:
        target = _target(path, ".vtu")
        with written_beside(target) as draft:
            write(draft, sample)
        return target
    samples, rows = _samples(run, stride), []
    target = _target(path.with_suffix("") if path.suffix == ".vtu" else path, ".pvd")
    with written_beside(target) as draft:
        for count, number in enumerate(samples):
            name = f"{os.path.splitext(draft)[0]}_{count:0{len(str(len(samples)))}d}.vtu"
            write(name, number)
            file = quoteattr(os.path.basename(name))[1:-1]
            rows.append(f'<DataSet timestep="{float(run.t[number])!r}" file="{file}"/>')
        Path(draft).write_text(PVD.format("\n".join(rows)), encoding="utf-8")
    return target


def _samples(run: Run, stride: int) -> range:
    """Numbers of the samples to be written."""
    require(is_whole(stride) and stride >= 1, "stride must be a whole number above 0", stride, "export",
            "give 1 for every sample")  # fmt: skip
    return range(0, len(run.t), stride)


def _geometry(run: Run) -> tuple[Vector, list[tuple[str, Any]]]:
    """Points (p, 3) of all beams, then impactors; lines, of zero length for impactors, as XDMF has one kind of cell."""
    placed = [shapes.named for shapes in (run.shapes, *run.others)]
    if all(placed):
        return _lines(run)
    require(not any(placed), "files for ParaView must be of beams alone, or of bodies with lines alone", run.others,
            "Run", "write histories with to_csv")  # fmt: skip
    parts, lines, count = [], [], 0
    for shapes, height in zip((run.shapes, *run.others), run.readout.heights, strict=True):
        size = len(shapes.nodes)
        parts.append(np.column_stack([shapes.nodes, np.full(size, height), np.zeros(size)]))
        lines.append(np.column_stack([np.arange(size - 1), np.arange(1, size)]) + count)
        count += size
    places = run.readout.impactor_places
    parts.append(np.column_stack([places, np.zeros(len(places))]))
    lines.append(np.repeat(count + np.arange(len(places))[:, None], 2, axis=1))
    return np.concatenate(parts), [("line", np.concatenate(lines))]


def _lines(run: Run) -> tuple[Vector, list[tuple[str, Any]]]:
    """Places and lines of frames and structures."""
    points, lines, count = [], [], 0
    for shapes in (run.shapes, *run.others):
        used = np.unique(shapes.lines)
        known = len(used) > 0 and bool(np.isfinite(shapes.positions[used]).all())
        require(known, "files for ParaView must be of beams, or of bodies with lines", shapes, "Run",
                "give Structure(..., nodes=, lines=), or write histories with to_csv")  # fmt: skip
        points.append(shapes.positions[used])
        lines.append(np.searchsorted(used, shapes.lines) + count)
        count += len(used)
    return np.concatenate(points), [("line", np.concatenate(lines))]


def _of_places(run: Run) -> tuple[Vector, dict[str, tuple[Vector, Vector]]]:
    """The motion of these places; section forces of a frame by itself."""
    moved = np.concatenate([shapes.translations[np.unique(shapes.lines)] for shapes in (run.shapes, *run.others)])
    forces = run.readout.section_forces[0] if not run.others else None
    carried = {}
    if isinstance(forces, FrameForces):  # of joined bodies places of structures have none
        places = [run.shapes.known[i] for i in np.unique(run.shapes.lines)]
        carried = {name: rows_of(run, name, places, 0) for name in forces.names}
    return moved, carried


def _of_beams(run: Run) -> tuple[Vector, dict[str, tuple[Vector, Vector]]]:
    """The motion of the points of beams and impactors; numbers, stress only where every section knows its fibre."""
    known = all(np.isfinite(f.beam.profile(f.nodes).fibre).all() for f in run.readout.section_forces)
    rows = {name: _rows(run, name) for name in ("displacement", *SECTION_FIELDS[: None if known else -1])}
    up, _ = rows.pop("displacement")
    return np.stack([np.zeros_like(up), up, np.zeros_like(up)], axis=1), rows


def _fields(run: Run) -> Callable[[int], dict[str, Vector]]:
    """The fields at the points as a function of the sample, of shapes (p, 3, n) and (p, n)."""
    moved, numbers = (_of_places if run.shapes.named else _of_beams)(run)
    q = run.with_supports(run.q, run.shapes.moving)
    q_dot = run.with_supports(run.q_dot, run.shapes.moving, 1)

    def at(sample: int) -> dict[str, Vector]:
        vectors = {"displacement": moved @ q[sample], "velocity": moved @ q_dot[sample]}
        return vectors | {name: shapes @ q[sample] + constant for name, (shapes, constant) in numbers.items()}

    return at


def _rows(run: Run, quantity: str) -> tuple[Vector, Vector]:
    """What turns q into a field at the points: shapes (p, n) and a constant part (p,); impactors have displacement."""
    parts = [rows_of(run, quantity, one.nodes, body) for body, one in enumerate((run.shapes, *run.others))]
    count = len(run.impactor_masses)
    n = run.q.shape[1]
    impactors = np.eye(n, n + run.shapes.moving)[n - count :] / np.sqrt(run.impactor_masses)[:, None]
    last = impactors if quantity == "displacement" else np.zeros_like(impactors)
    shapes, constants = zip(*parts, strict=True)
    return np.vstack([*shapes, last]), np.concatenate([*constants, np.zeros(count)])


def _target(target: Path, suffix: str) -> Path:
    """The path of the file to be opened, with its suffix."""
    target = target if target.suffix == suffix else target.with_name(target.name + suffix)
    require(target.parent.is_dir(), "the folder must exist", str(target.parent), f"export to {suffix}", "make it first")
    return target
