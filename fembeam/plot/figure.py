"""What figures begin and end with: a sheet of axes, a heading, a legend."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from fembeam.plot.style import RED
from fembeam.support import require

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fembeam.model import Run

TITLE = 12.5  # characters of a title on an inch of a figure
NARROWEST = 20  # characters of a line
FULL = 0.96  # of the width, as letters are wider where there are fewer dots an inch
ACROSS, HANDLE = 96, 8  # characters of a legend side by side, and as many as the handle of an entry takes
MANY_ROOM = "the axes must be as many as the figure has panels"


def sheet(
    rows: int, columns: int, size: tuple[float, float], axes: Axes | Sequence[Axes] | None = None, **options: Any
) -> tuple[Figure, list[Axes]]:
    """A new figure with its axes as a flat list, or the axes that are given and their figure.

    Parameters
    ----------
    rows, columns, size : of the panels, and of the figure in inches.
    axes : to draw into: one, or as many as there are panels, row by row; None makes a figure.
    options : of `Figure.subplots`.

    Raises
    ------
    ValueError : another number of axes, or what is none.
    """
    if axes is None:
        from fembeam.plot.window import Figure

        made = Figure(figsize=size, layout="constrained")
        return made, list(np.atleast_1d(made.subplots(rows, columns, **options)).ravel())
    given: list[Axes] = list(np.ravel(np.asarray(axes, dtype=object)))
    drawn = all(hasattr(one, "set_title") for one in given)
    require(drawn, "axes must be axes of matplotlib", axes, "fembeam.plot", "make them by plt.subplots()")
    require(len(given) == rows * columns, MANY_ROOM, len(given), "fembeam.plot", f"give {rows * columns}")
    figure: Any = given[0].figure
    return figure, given


def heading(axes: Sequence[Axes], title: str, own: bool, weight: str = "bold", run: Run | None = None) -> None:
    """A title over a figure of our own, or over the first of the axes that were given.

    A run that did not finish says so in it and, in a figure of our own, in red at the foot.
    """
    figure: Any = axes[0].figure
    partial = run is not None and not run.complete
    wide = int(TITLE * figure.bbox.width / figure.dpi)
    title = textwrap.fill("Partial: " * partial + title, wide, break_on_hyphens=False)
    if not own:
        axes[0].set_title(title)
        return
    drawn = figure.suptitle(title, x=0.01, ha="left", fontsize=10, fontweight=weight)
    while drawn.get_window_extent().x1 > FULL * figure.bbox.x1 and wide > NARROWEST:  # of many digits
        wide -= 4
        drawn.set_text(textwrap.fill(title, wide, break_on_hyphens=False))
    if run is not None and partial:
        figure.supxlabel(f"PARTIAL RESULT: {run.status}", color=RED, fontsize=8, wrap=True)


def after(discard: float) -> str:
    """What part of a run a figure shows, for its heading; nothing where it is the whole.

    Examples
    --------
    >>> f"Contacts{after(5.0)}", f"Contacts{after(0.0)}"
    ('Contacts after 5 s', 'Contacts')
    """
    return f" after {discard:g} s" if discard > 0.0 else ""


def legend(axis: Axes, own: bool, loc: str, **options: Any) -> None:
    """A legend beside the axes of a figure of our own, or within axes that were given."""
    figure: Any = axis.figure
    if own:
        figure.legend(loc=loc, **options)
    else:
        axis.legend(**options)


def side_by_side(labels: Sequence[str], most: int) -> int:
    """How many columns of a legend as wide as a figure its entries fit into, at most ``most``.

    Examples
    --------
    >>> side_by_side(["valve"] * 19, 5), side_by_side(["a stop with a name of forty letters, thick"], 5)
    (5, 1)
    """
    longest = max(len(line) for label in labels for line in label.splitlines())
    return max(1, min(most, ACROSS // (longest + HANDLE)))
