"""Mode shapes of bodies with places by name: their lines, deflected; without lines the components of usual places."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fembeam.plot.axis_names import coordinate_name
from fembeam.plot.bodies import SHOWN, displacements, mode_figure
from fembeam.plot.figure import heading, sheet
from fembeam.plot.style import BLUE, GREY, Vector, verbatim

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fembeam.model import Model

MOST = 6  # modes
FLAT = 1e-9  # of its size: extent along an axis below which a body lies in a plane


def body_mode_shapes(model: Model, axes: Axes | None) -> Figure:
    """The first modes, at most six, of a scene whose body is no `Beam`; into one axis the lowest that moves."""
    shapes = model.shapes
    drawable = len(shapes.lines) and np.isfinite(shapes.positions[shapes.lines.ravel()]).all()
    if axes is None and drawable:
        return mode_figure(model)
    moving = np.flatnonzero(np.abs(shapes.values).max(axis=(0, 1)) > 0)[: 1 if axes is not None else MOST]
    columns = min(len(moving), 3)
    rows = -(-len(moving) // max(columns, 1))
    figure, drawn = sheet(max(rows, 1), max(columns, 1), (7.0, 0.6 + 2.4 * rows), axes)
    view = _view(shapes.positions[np.unique(shapes.lines)]) if drawable else np.zeros((0, 3))
    for axis, mode in zip(drawn, moving, strict=False):
        if drawable:
            _deflected(axis, shapes, int(mode), view)
        else:
            _bars(axis, shapes, int(mode))
        axis.set_title(f"{coordinate_name(model.names[mode])}: {model.omega[mode]:.4g} rad/s", fontsize=8)
    for axis in drawn[len(moving) :]:
        axis.set_axis_off()
    heading(drawn, "Mode shapes of the linear structure", axes is None)
    return figure


def _view(points: Vector) -> Vector:
    """Two rows that project (3,) to the sheet: the plane of a flat body, z to the right, else askew."""
    extent = np.ptp(points, axis=0)
    wide = extent > FLAT * extent.max()
    if not wide[2]:
        return np.eye(3)[[0, 1]]
    if wide.sum() <= 2:
        other = 0 if wide[0] else 1
        return np.eye(3)[[2, other]]
    return np.array([[np.sqrt(0.5), 0.0, -np.sqrt(0.5)], [-np.sqrt(1 / 6), np.sqrt(2 / 3), -np.sqrt(1 / 6)]])


def _deflected(axis: Axes, shapes: Any, mode: int, view: Vector) -> None:
    """Lines at rest in grey, deflected in blue."""
    at, moved = shapes.positions, displacements(shapes, np.eye(shapes.values.shape[2])[mode])
    used = np.unique(shapes.lines)
    size = float(np.linalg.norm(np.ptp(at[used], axis=0)))
    largest = float(np.linalg.norm(moved[used], axis=1).max()) or 1.0
    bent = at + SHOWN * size / largest * moved
    looks: Any = ((at, {"color": GREY, "linewidth": 0.7}), (bent, {"color": BLUE, "linewidth": 1.6}))
    for points, look in looks:
        flat = points @ view.T
        for a, b in shapes.lines:
            axis.plot(*flat[[a, b]].T, **look)
    axis.set_aspect("equal", adjustable="datalim")
    axis.set_axis_off()


def _bars(axis: Axes, shapes: Any, mode: int) -> None:
    """The usual places, where there are no lines to draw."""
    values = np.array([shapes(at)[mode] for at in shapes.usual.values()])
    axis.barh(np.arange(len(values)), values / (np.abs(values).max() or 1.0), color=BLUE)
    axis.set_yticks(np.arange(len(values)), [verbatim(name) for name in shapes.usual])
    axis.set_xlim(-1.1, 1.1)
