"""The figure of a parameter study."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fembeam.plot.figure import heading, sheet
from fembeam.plot.style import ALONG, BLUE, RED, UP, entry, logarithmic, styled, verbatim
from solvers.problem import counted

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fembeam.study import Minimum, Variation

TWO_ERRORS = 2.0  # standard errors drawn: about 95 %
NARROW = 28  # letters along one of several panels


@styled
def variation(found: Variation, axes: Axes | Sequence[Axes] | None = None, best: int | None = None) -> Figure:
    """A row of panels for each quantity: over one parameter a line, over two a map, over more dots along each.

    Samples are dots. Bars are two standard errors. `best` marks a point by its number.

    Examples
    --------
    >>> import fembeam as fb
    >>> scene = fb.Scene(fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01)), [fb.Clamped(0.0)],
    ...                  base=fb.Harmonic(1e-3, 100.0), damping=fb.ModalDamping(0.05))
    >>> found = fb.study.vary(scene, {"base.amplitude": [1e-3, 2e-3]}, "amplitude", 0.5, 1e-3, modes=1)
    >>> variation(found).axes[0].get_xlabel()
    'base amplitude / m'
    """
    d, q = found.points.shape[1], len(found.quantities)
    columns = 1 if d <= 2 else d
    figure, panels = sheet(q, columns, (6.4 if d <= 2 else 3.0 * d, 0.8 + 2.8 * q), axes)
    for i, name in enumerate(found.value_heads):
        row = panels[i * columns : (i + 1) * columns]
        if d == 2:
            _map(row[0], found, i)
            _star(row[0], found.points, best, 0, found.points[:, 1])
            continue
        for j, axis in enumerate(row):
            _line(axis, found, i, j)
            _star(axis, found.points, best, j, found.values[:, i])
            axis.set_ylabel(entry(name, UP))
    heading(panels, f"{', '.join(map(verbatim, found.quantities))} at {counted(len(found), 'point')}", axes is None)
    return figure


@styled
def minimum(found: Minimum, axes: Axes | Sequence[Axes] | None = None) -> Figure:
    """All points of a search, its result marked; panels as in `variation`.

    Examples
    --------
    >>> import fembeam as fb
    >>> scene = fb.Scene(fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01)), [fb.Clamped(0.0)],
    ...                  base=fb.Harmonic(1e-3, 100.0), damping=fb.ModalDamping(0.05))
    >>> found = fb.study.minimise(scene, {"base.amplitude": (1e-3, 2e-3)}, "amplitude", {}, 0.5, 1e-3, modes=1)
    >>> minimum(found).axes[0].get_ylabel()
    'amplitude / m'
    """
    return variation(found.tried, axes, found.number)


def _line(axis: Axes, found: Variation, i: int, j: int) -> None:
    """Quantity i over parameter j."""
    x, error = found.points[:, j], found.standard_error[:, i]
    bars: dict[str, Any] = {"yerr": TWO_ERRORS * error} if np.isfinite(error).any() else {}
    axis.errorbar(x, found.values[:, i], fmt="o-" if len(found.axes) == 1 else "o", color=BLUE, markersize=3, **bars)
    few = len(found.titles) < 3
    axis.set_xlabel(entry(found.titles[j], ALONG if few else NARROW))
    if not (len(found.axes) == 1 and logarithmic(axis, x)):
        axis.locator_params(axis="x", nbins=5 if few else 3)


def _map(axis: Axes, found: Variation, i: int) -> None:
    """Quantity i over two parameters: a grid as cells, samples as dots."""
    figure: Any = axis.figure
    if found.axes and all(len(values) > 1 for values in found.axes):
        image: Any = axis.pcolormesh(*found.axes, found[found.quantities[i]].T, shading="nearest")
    else:
        image = axis.scatter(found.points[:, 0], found.points[:, 1], c=found.values[:, i], s=12)
    figure.colorbar(image, ax=axis, label=entry(found.value_heads[i], UP))
    axis.set(xlabel=entry(found.titles[0], ALONG), ylabel=entry(found.titles[1], UP))
    axis.locator_params(axis="x", nbins=5)  # long numbers would meet


def _star(axis: Axes, points: np.ndarray, best: int | None, j: int, height: np.ndarray) -> None:
    """Mark one point."""
    if best is not None:
        axis.plot(points[best, j], height[best], "*", color=RED, markersize=12)
