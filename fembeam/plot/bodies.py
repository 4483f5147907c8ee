"""Frames and structures as they move: mode shapes and deflected shapes over their lines, in the plane and in space."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from fembeam.plot.axis_names import coordinate_name
from fembeam.plot.clearance import Whirl
from fembeam.plot.figure import heading
from fembeam.plot.style import BLUE, GREY, RED, round_factor
from fembeam.support import is_finite, require

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fembeam.model import Model, PlacedShapes, Run

Vector = NDArray[np.float64]

MOST_SHAPES = 6
SHOWN = 0.12  # of the body's size, the largest displacement drawn
COLUMNS = 3
SIDES = np.array([-1.0, 1.0])
THIN = 0.25  # of the size of a body, the least half side of the box it is drawn in
MOST_CIRCLES = 3  # annular stops shown beside a moving body
ZOOM = 0.72  # of the box of three axes, so that their names stay inside


def in_space(shapes: PlacedShapes) -> bool:
    """Whether a body moves or extends along z; else it is drawn in its plane."""
    return "z" in shapes.components or bool(np.ptp(_known(shapes)[:, 2]) > 0)


def _known(shapes: PlacedShapes) -> Vector:
    """Positions (k, 3) of the places whose position is known; ValueError if there are none."""
    known = shapes.positions[np.isfinite(shapes.positions).all(axis=1)]
    require(len(known) > 0, "the body must know where its nodes are", "none", "fembeam.plot",
            "give Structure(..., nodes=, lines=)")  # fmt: skip
    return known


def displacements(shapes: PlacedShapes, q: Vector) -> Vector:
    """(p, 3) of all places for coordinates q (n,), or (n + k,) with the support dofs that move, m."""
    moved: Vector = shapes.translations[:, :, : len(q)] @ q
    return moved


def size_of(shapes: PlacedShapes) -> float:
    """Diagonal of the box around the body, m."""
    return float(np.linalg.norm(np.ptp(_known(shapes), axis=0))) or 1.0


def panels(shapes: PlacedShapes, count: int) -> tuple[Figure, list[Any]]:
    """A figure with as many axes, of three dimensions where the body is in space."""
    from fembeam.plot.window import Figure

    columns = min(COLUMNS, count)
    rows = -(-count // columns)
    figure = Figure(figsize=(max(3.6 * columns, 5.0), 3.4 * rows), layout="constrained")
    options = {"projection": "3d"} if in_space(shapes) else {}
    return figure, [figure.add_subplot(rows, columns, i + 1, **options) for i in range(count)]  # type: ignore[arg-type]


def draw(axis: Any, shapes: PlacedShapes, moved: Vector | None, color: str, width: float) -> list[Any]:
    """The lines of the body at rest, or displaced by (p, 3); where there are none, its places as points."""
    at = shapes.positions if moved is None else shapes.positions + moved
    count = 3 if in_space(shapes) else 2
    if not len(shapes.lines):
        return list(axis.plot(*at[:, :count].T, "o", color=color, markersize=3))
    joined = at[shapes.lines].transpose(2, 0, 1)[:count]  # (x, line, end); NaN parts the lines
    parted = np.concatenate([joined, np.full((*joined.shape[:2], 1), np.nan)], axis=2).reshape(count, -1)
    return list(axis.plot(*parted, color=color, linewidth=width))


def finish(axis: Any, shapes: PlacedShapes, room: float = 0.0) -> None:
    """Equal scales and names of the axes, with room around; in space no side so thin that its numbers would meet."""
    space, size = in_space(shapes), size_of(shapes)
    limits = np.array([getattr(axis, f"get_{name}lim")() for name in ("xyz" if space else "xy")])
    limits += np.array([-room, room])
    if space:
        middle, half = limits.mean(axis=1), np.maximum(np.ptp(limits, axis=1) / 2, THIN * size)
        axis.set(xlim=middle[0] + SIDES * half[0], ylim=middle[1] + SIDES * half[1], zlim=middle[2] + SIDES * half[2])
        axis.set_box_aspect(half, zoom=ZOOM)
        for one, share in zip((axis.xaxis, axis.yaxis, axis.zaxis), half / half.max(), strict=True):
            one.set_major_locator(MaxNLocator(max(int(4 * share), 1), min_n_ticks=1))
        axis.set_xlabel("x / m", labelpad=6)
        axis.set_ylabel("y / m", labelpad=6)
        axis.set_zlabel("z / m", labelpad=14)
        return
    if room:  # not as fixed limits: matplotlib reports each one that equal scales move
        axis.update_datalim(limits.T)
        axis.autoscale_view()
    axis.set(xlabel="x / m", ylabel="y / m")
    axis.set_aspect("equal", adjustable="datalim")
    axis.locator_params(nbins=4)


def mode_figure(model: Model) -> Figure:
    """The first modes (at most six) of a body, over its lines at rest."""
    shapes = model.shapes
    moving = [i for i in range(len(model.omega)) if np.any(displacements(shapes, np.eye(len(model.omega))[i]))]
    chosen = moving[:MOST_SHAPES]
    require(bool(chosen), "the body must move in a mode", len(model.omega), "mode_shapes", "keep modes of it")
    figure, axes = panels(shapes, len(chosen))
    for axis, mode in zip(axes, chosen, strict=True):
        moved = displacements(shapes, np.eye(len(model.omega))[mode])
        moved *= SHOWN * size_of(shapes) / np.linalg.norm(moved, axis=1).max()
        draw(axis, shapes, None, GREY, 0.8)
        draw(axis, shapes, moved, BLUE, 1.8)
        axis.set_title(f"{coordinate_name(model.names[mode])}: {model.omega[mode]:.5g} rad/s", fontsize=8)
        finish(axis, shapes)
    heading(axes, "Mode shapes of the linear structure", True)
    return figure


def deflected_figure(run: Run, t: float | None, scale: float | None, axes: Axes | None) -> Figure:
    """`deflected` of `fembeam.plot` explains it."""
    shapes = run.shapes
    sample = _sample(run, t)
    moved = displacements(shapes, run.with_supports(run.q, shapes.moving)[sample])
    largest = float(np.linalg.norm(moved, axis=1).max())
    require(scale is None or (is_finite(scale) and scale > 0), "scale must be above 0", scale, "deflected",
            "leave it out for one that shows well")  # fmt: skip
    factor = scale if scale is not None else round_factor(SHOWN * size_of(shapes) / largest) if largest > 0 else 1.0
    axis: Any = panels(shapes, 1)[1][0] if axes is None else axes
    draw(axis, shapes, None, GREY, 0.8)
    draw(axis, shapes, factor * moved, RED, 1.8)
    finish(axis, shapes)
    axis.set_title(f"t = {run.t[sample]:.5g} s, displacements x {factor:g}, largest {largest:.3g} m", fontsize=8)
    whole: Figure = axis.figure
    return whole


class BodyStage:
    """One picture of a moving body: its lines at rest and deflected, at one scale throughout, and places in circles."""

    def __init__(self, run: Run, samples: NDArray[np.int64], pace: str) -> None:
        from fembeam.plot.window import Figure

        self.run, self.samples, self.pace, shapes = run, samples, pace, run.shapes
        self.q, size = run.with_supports(run.q, shapes.moving)[samples], size_of(shapes)
        largest = max(float(np.linalg.norm(displacements(shapes, q), axis=1).max()) for q in self.q)
        self.factor = round_factor(SHOWN * size / largest) if largest > 0 else 1.0
        circles = np.flatnonzero(run.circles[:, 0])[:MOST_CIRCLES].tolist()
        columns = 1 + len(circles)
        self.figure = Figure(figsize=(5.0 + 3.0 * len(circles), 3.6), layout="constrained")
        options: Any = {"projection": "3d"} if in_space(shapes) else {}
        self.axis = self.figure.add_subplot(1, columns, 1, **options)
        draw(self.axis, shapes, None, GREY, 0.8)
        finish(self.axis, shapes, SHOWN * size)
        axes = [self.figure.add_subplot(1, columns, 2 + i) for i in range(len(circles))]
        self.whirls = [Whirl(axis, run, stop, samples) for axis, stop in zip(axes, circles, strict=True)]
        self.curves: list[Any] = []

    def show(self, number: int) -> list[Any]:
        """Move everything to one picture."""
        for curve in self.curves:
            curve.remove()
        moved = self.factor * displacements(self.run.shapes, self.q[number])
        self.curves = draw(self.axis, self.run.shapes, moved, BLUE, 1.8)
        now = float(self.run.t[self.samples[number]])
        self.axis.set_title(f"t = {now:.4f} s, displacements x {self.factor:g}{self.pace}", fontsize=8)
        return [*self.curves, *(artist for whirl in self.whirls for artist in whirl.show(number))]


def _sample(run: Run, t: float | None) -> int:
    """The sample next to t, or that of the largest displacement."""
    q = run.with_supports(run.q, run.shapes.moving)
    if t is not None:
        inside = is_finite(t) and run.t[0] <= t <= run.t[-1]
        require(inside, f"t must lie within the run, {run.t[0]:g} to {run.t[-1]:g} s", t, "deflected", "choose one")
        return int(np.argmin(np.abs(run.t - t)))
    squares = np.zeros(len(run.t))
    for rows in run.shapes.translations:
        squares = np.maximum(squares, ((q @ rows.T) ** 2).sum(axis=1))
    return int(np.argmax(squares))
