"""What all figures share: colours, type, the sheet of axes with its title."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import TYPE_CHECKING, Any, ParamSpec

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fembeam.model import Run
    from fembeam.statistics import Spectrum


Vector = NDArray[np.float64]


P = ParamSpec("P")


BLUE, RED, GREEN, ORANGE, GREY = "#0072B2", "#D55E00", "#009E73", "#E69F00", "#777777"  # Okabe and Ito


STYLE = {
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "axes.prop_cycle": "cycler('color', ['#0072B2', '#D55E00', '#009E73', '#E69F00', '#CC79A7', '#56B4E9'])",
    "lines.linewidth": 1.0,
    "legend.frameon": False,
    "figure.dpi": 120,
}


def styled(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Draw in the library's style, and leave the user's settings alone."""

    @wraps(draw)
    def inside(*args: P.args, **kwargs: P.kwargs) -> Figure:
        from matplotlib import rc_context

        with rc_context(STYLE):  # type: ignore[arg-type]
            return draw(*args, **kwargs)

    return inside


def sheet(run: Run | None, rows: int, columns: int, size: tuple[float, float], **options: Any) -> tuple[Figure, Any]:
    """A figure with its axes as a flat list."""
    from fembeam.plot.figure import sheet as drawn_sheet

    return drawn_sheet(rows, columns, size, **options)


def titled(figure: Figure, run: Run | None, title: str) -> Figure:
    """Set the title, with the status of a run that did not finish."""
    partial = run is not None and not run.complete
    figure.suptitle("Partial: " * partial + title, x=0.01, ha="left", fontsize=10, fontweight="bold")
    if run is not None and partial:
        figure.supxlabel(f"PARTIAL RESULT: {run.status}", color=RED, fontsize=8, wrap=True)
    return figure


def drawable(line: Spectrum, top: float) -> tuple[Vector, Vector]:
    """The curve up to the end of the axis, without ω = 0 (the mean is gone) and without zeros."""
    kept = (line.omega > 0) & (line.omega <= top) & (line.density > 0)
    return line.omega[kept], line.density[kept]


def fit_levels(axis: Axes, lines: list[Spectrum], top: float) -> None:
    """Limits from the responses, so that a band-limited input does not stretch the axis to rounding errors."""
    levels = np.concatenate([drawable(line, top)[1] for line in lines])
    if len(levels):
        axis.set_ylim(max(levels.min(), 1e-9 * levels.max()) / 3, 10 * levels.max())
