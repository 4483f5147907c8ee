"""Charts of methods: speed against accuracy, where they are stable."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fembeam.plot.figure import legend, sheet
from fembeam.plot.style import styled, verbatim
from fembeam.support import require

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fembeam.study import Point, SpeedAccuracy, StabilityMap

MARKERS = "osD^v<>PX*hpd8H1234"
_SMALLEST = 1e-16


@styled
def speed_accuracy(result: SpeedAccuracy, axes: Axes | Sequence[Axes] | None = None) -> Figure:
    """Error against time: of integration on the left, with the error of too few modes on the right.

    Modes are colours, methods markers; medians over the starts with quartiles; a line joins the settings of a method,
    a thick one the front of each model. On the right a finer step below a dashed line (the exact model with so few
    modes) is wasted. What lies below the disagreement of the references is drawn there: it is not known. `axes` to draw
    into are one, or two where there are several models.
    """
    sizes = sorted(result.reduction)
    panels = 2 if max(result.reduction.values()) > 0.0 else 1
    figure, drawn = sheet(1, panels, (5.2 * panels + 2.1, 4.8), axes, sharey=True)
    methods = list(dict.fromkeys(point.method for point in result.points))
    for ax, name in zip(drawn, ("errors", "totals"), strict=False):
        for n, colour in zip(sizes, _colours(len(sizes)), strict=True):
            for method, marker in zip(methods, MARKERS * 3, strict=False):
                mine = [p for p in result.points if p.modes == n and p.method == method and p.seconds.size]
                _draw(ax, mine, name, colour, marker, result.floor.get(n, 0.0))
            if name == "errors":
                front = result.front(n)
                errors = [_known(p.error, result.floor.get(n, 0.0)) for p in front]
                ax.plot(errors, [1e3 * p.time for p in front], color=colour, lw=3.0, alpha=0.35)
            elif result.reduction[n] > 0.0:
                ax.axvline(result.reduction[n], color=colour, ls="--", lw=0.8)
        ax.set(xscale="log", yscale="log")
        ax.invert_xaxis()
        ax.grid(alpha=0.25, lw=0.5)
    drawn[0].set(xlabel=f"error of integration: {verbatim(result.quantity)}", ylabel="time of a run / ms")
    claim = result.claim()
    drawn[0].set_title("Integration alone; thick: the front of each model" + (f"\n{verbatim(claim)}" if claim else ""))
    if panels == 2:
        drawn[1].set(xlabel=f"error against {sizes[-1]} modes: {verbatim(result.quantity)}")
        drawn[1].set_title("Integration and reduction; dashed: exact solution with so few modes")
    _legends(drawn[-1], sizes, methods, axes is None)
    return figure


def _draw(ax: Axes, points: Sequence[Point], name: str, colour: object, marker: str, floor: float) -> None:
    """One method's settings on one model."""
    if not points:
        return
    values = [getattr(p, name) for p in points]
    x = np.array([_known(float(np.median(v)), floor) for v in values])
    low, high = (np.array([_known(float(np.quantile(v, q)), floor) for v in values]) for q in (0.25, 0.75))
    y = np.array([1e3 * p.time for p in points])
    ax.errorbar(x, y, xerr=[x - low, high - x], color=colour, lw=0.7, elinewidth=0.5, marker=marker, ms=4.5)


def _known(value: float, floor: float) -> float:
    """Points whose error exceeds the reference's and is positive."""
    return max(value, floor, _SMALLEST)


def _colours(count: int) -> list:
    """Light for few modes, dark for many."""
    from matplotlib import colormaps

    return [colormaps["viridis_r"](0.15 + 0.8 * i / max(count - 1, 1)) for i in range(count)]


def _legends(axis: Axes, sizes: Sequence[int], methods: Sequence[str], own: bool) -> None:
    """Markers for methods, colours for modes, beside the axes."""
    from matplotlib.lines import Line2D

    entries = [Line2D([], [], color=c, lw=3, label=f"{n} mode{'s' if n > 1 else ''}")
               for n, c in zip(sizes, _colours(len(sizes)), strict=True)]  # fmt: skip
    entries += [
        Line2D([], [], color="black", marker=k, lw=0, ms=5, label=verbatim(m))
        for m, k in zip(methods, MARKERS * 3, strict=False)
    ]
    legend(axis, own, "outside right upper", handles=entries)


@styled
def stability_map(*maps: StabilityMap, axes: Axes | Sequence[Axes] | None = None) -> Figure:
    """Verdicts over step and modes (or stiffness), one panel per map, predicted limits drawn over them.

    Parameters
    ----------
    maps : one or more. axes : to draw into, one per map; None makes a figure.
    """
    from matplotlib.colors import ListedColormap
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    require(bool(maps), "nothing to draw", maps, "plot.stability_map", "give one map or more of fb.study.stability_map")
    colours = dict(zip(maps[0].VERDICTS, ("#8fd0b5", "#f6d58a", "#b7c9e8", "#eba07a"), strict=True))
    columns = min(len(maps), 2)
    figure, drawn = _panels(len(maps), columns, axes)
    for ax, found in zip(drawn, maps, strict=True):
        places = np.arange(len(found.rows) + 1) - 0.5
        ax.pcolormesh(_edges(found.steps), places, found.verdict, cmap=ListedColormap(list(colours.values())),
                      vmin=-0.5, vmax=3.5, edgecolors="white", lw=0.4)  # fmt: skip
        for limit, style in ((found.flight, "-"), (found.contact, ":")):
            kept = np.where(np.isfinite(limit) & (limit > 0.0), limit, np.nan)
            ax.step(np.append(kept, kept[-1]), places, color="black", ls=style, lw=1.6, where="pre")
            ax.vlines(kept, places[:-1], places[1:], color="black", ls=style, lw=1.6)
        ax.set(xscale="log", xlabel="step / s", yticks=range(len(found.rows)), title=verbatim(found.method))
        ax.set_xlim(*_edges(found.steps)[[0, -1]])
        ax.set_yticklabels([f"{row:g}" for row in found.rows])
        ax.set_ylabel({"modes": "number of modes", "stiffness": "contact stiffness / N/m^p"}[found.axis])
    entries: list = [Patch(color=colour, label=verdict.words) for verdict, colour in colours.items()]
    entries += [
        Line2D([], [], color="black", ls=s, label=f"predicted limit {w}")
        for s, w in (("-", "in flight"), (":", "in contact"))
    ]
    legend(drawn[-1], axes is None, "outside lower center", handles=entries, ncols=3 if len(maps) > 1 else 2)
    return figure


def _panels(count: int, columns: int, axes: Axes | Sequence[Axes] | None) -> tuple[Figure, list[Axes]]:
    """That many panels in columns, the rest of the last row empty."""
    if axes is not None:
        return sheet(count, 1, (0.0, 0.0), axes)
    rows = -(-count // columns)
    figure, made = sheet(rows, columns, (4.6 * columns + 0.2, 3.0 * rows + 0.7), squeeze=False)
    for unused in made[count:]:
        unused.set_axis_off()
    return figure, made[:count]


def _edges(steps: np.ndarray) -> np.ndarray:
    """Borders of the cells of a logarithmic axis."""
    if len(steps) < 2:
        return np.array([steps[0] / 1.5, steps[0] * 1.5])
    middle = np.sqrt(steps[1:] * steps[:-1])
    return np.concatenate(([steps[0] ** 2 / middle[0]], middle, [steps[-1] ** 2 / middle[-1]]))
