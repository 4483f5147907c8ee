"""The figure of basins of attraction."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fembeam.plot.figure import heading, legend, sheet
from fembeam.plot.style import BLUE, GREEN, GREY, ORANGE, RED, styled, verbatim

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fembeam.study import Basins

COLOURS = BLUE, ORANGE, GREEN, "#CC79A7", "#56B4E9", "#F0E442", RED
OTHERS = {-1: ("not settled", "black"), -2: ("run failed", GREY)}


@styled
def basins(found: Basins, axes: Axes | None = None) -> Figure:
    """A plane of starts, coloured by what each comes to; `axes` to draw into.

    Examples
    --------
    >>> import fembeam as fb
    >>> scene = fb.Scene(fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01)), [fb.Clamped(0.0)],
    ...                  base=fb.Harmonic(1e-3, 100.0), damping=fb.ModalDamping(0.05))
    >>> figure = basins(fb.study.basins(scene.reduce(modes=1), points=3))
    >>> figure.axes[0].get_ylabel()
    'velocity at 0.5 m / (m/s)'
    """
    from matplotlib.colors import to_rgb
    from matplotlib.patches import Patch

    figure, (axis,) = sheet(1, 1, (6.4, 4.8), axes)
    names = {i: (one.name, COLOURS[i % len(COLOURS)]) for i, one in enumerate(found.attractors)}
    image = np.zeros((*found.label.shape, 3))
    entries = []
    for label, (name, colour) in {**names, **OTHERS}.items():
        here = found.label == label
        if here.any():
            image[here] = to_rgb(colour)
            entries.append(Patch(color=colour, label=f"{verbatim(name)}, {here.mean():.1%}"))
    x, y = found.x.values, found.y.values
    half = (x[1] - x[0]) / 2, (y[1] - y[0]) / 2
    extent = (x[0] - half[0], x[-1] + half[0], y[0] - half[1], y[-1] + half[1])
    axis.imshow(image, origin="lower", extent=extent, aspect="auto", interpolation="nearest")
    axis.set(xlabel=verbatim(found.x.name), ylabel=verbatim(found.y.name))
    legend(axis, axes is None, "outside lower center", handles=entries, ncols=2 if axes is None else 1)
    heading([axis], f"What {found.label.size} starts come to", axes is None)
    return figure
