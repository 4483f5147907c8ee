"""Figures of studies: how a quantity converges with modes, and the evidence for a smallest model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fembeam.plot.figure import heading, sheet
from fembeam.plot.style import BLUE, GREY, ORANGE, RED, styled, verbatim

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fembeam.study import ModeCount, SmallestModel

KINDS = ((False, BLUE, "o", "modes alone"), (True, RED, "s", "with static shapes"))
RING: dict[str, Any] = {"color": ORANGE, "markersize": 11, "fillstyle": "none", "markeredgewidth": 1.5}
LOWEST = 1e-12  # relative; smaller errors are drawn here


@styled
def mode_count(study: ModeCount, axes: Sequence[Axes] | None = None) -> Figure:
    """Error against the reference, with its 95 % uncertainty, and time of integration, over the coordinates kept.

    Hollow marks are errors within noise. `axes` are two to draw into; None makes a figure.

    Examples
    --------
    >>> import fembeam as fb
    >>> beam = fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01))
    >>> scene = fb.Scene(beam, [fb.Clamped(0.0)], base=fb.Harmonic(1e-3, 100.0), damping=fb.ModalDamping(0.05))
    >>> figure = mode_count(fb.study.mode_count(scene, [1, 2], "amplitude", duration=0.5, dt=1e-3))
    >>> [axis.get_ylabel() for axis in figure.axes]
    ['relative error', 'integration / s']
    """
    figure, (left, right) = sheet(1, 2, (8.0, 3.6), axes)
    for kind, colour, mark, name in KINDS:
        rows = [row for row in study.rows if row.residual == kind and np.isfinite(row.error)]
        _errors(left, [row for row in rows if not row.reference], colour, mark, name)
        cost = [(row.measured.coordinates, row.measured.seconds) for row in rows]
        if cost:
            right.plot(*np.transpose(sorted(cost)), f"{mark}-", color=colour, markersize=4)
    reference = next(row for row in study.rows if row.reference)
    _whole_numbers([left, right], [row.measured.coordinates for row in study.rows])
    left.set_ylabel("relative error")
    left.legend()
    right.set_ylim(bottom=0.0)
    right.set(ylabel="integration / s", title="time of all runs of a model")
    against = f"against {reference.measured.coordinates} coordinates; hollow: within noise"
    left.set_title(against if axes is None else f"{verbatim(study.quantity)} {against}")
    if axes is None:
        heading([left], f"Convergence of {verbatim(study.quantity)} with modes", True)
    return figure


@styled
def smallest_model(result: SmallestModel, axes: Axes | Sequence[Axes] | None = None) -> Figure:
    """Reduction errors over coordinates and, once reached, integration errors over rtol; tolerance and answer.

    `axes` to draw into are one, or two once integration was reached; None makes a figure.
    """
    reached = bool(result.integration)
    figure, drawn = sheet(1, 1 + reached, (8.0 if reached else 4.4, 3.6), axes)
    _reduction(drawn[0], result)
    if reached:
        _integration(drawn[1], result)
    for axis in drawn:
        axis.set(yscale="log", ylabel="relative error")
        axis.axhline(result.tolerance, color=GREY, linestyle="--", label=f"tolerance {result.tolerance:g}")
    drawn[0].legend()
    state = "Smallest model" if result.met else "NOT MET: smallest model"
    heading(drawn, f"{state} for {verbatim(result.quantity)}", axes is None)
    return figure


def _reduction(axis: Axes, result: SmallestModel) -> None:
    """Errors by truncation, the answer ringed."""
    for kind, colour, mark, name in KINDS:
        lines = [line for line in result.reduction if line.choice.residual == kind and line.remark != "reference"]
        points = sorted((line.measured.coordinates, max(line.error, LOWEST), line.uncertainty) for line in lines)
        if points:
            x, y, spread = np.transpose(points)
            axis.errorbar(x, y, _bars(y, spread), fmt=f"{mark}-", color=colour, markersize=4, capsize=2, label=name)
    chosen = next((line for line in result.reduction if line.choice[:2] == (result.modes, result.residual)), None)
    if chosen is not None:
        axis.plot(chosen.measured.coordinates, max(chosen.error, LOWEST), "o", **RING, label="answer")
    _whole_numbers([axis], [line.measured.coordinates for line in result.reduction])
    axis.set_title("reduction")


def _integration(axis: Axes, result: SmallestModel) -> None:
    """Errors by integration, the answer ringed."""
    x = np.array([line.choice.rtol for line in result.integration])
    y = np.array([max(line.error, LOWEST) for line in result.integration])
    spread = np.array([line.uncertainty for line in result.integration])
    axis.errorbar(x, y, _bars(y, spread), fmt="o-", color=BLUE, markersize=4, capsize=2)
    axis.plot(x[x == result.rtol], y[x == result.rtol], "o", **RING)
    axis.set(xscale="log", xlabel="rtol", title="integration, of the chosen model")


def _errors(axis: Axes, rows: Sequence[Any], colour: str, mark: str, name: str) -> None:
    """Errors with bars; hollow where they are within noise."""
    rows = sorted(rows, key=lambda row: row.measured.coordinates)
    if not rows:
        return
    x = np.array([row.measured.coordinates for row in rows], dtype=float)
    y = np.array([max(row.error, LOWEST) for row in rows])
    axis.errorbar(x, y, _bars(y, np.array([row.uncertainty for row in rows])), fmt="-", color=colour, capsize=2)
    solid = np.array([row.resolved or not row.uncertainty for row in rows])
    axis.plot(x[solid], y[solid], mark, color=colour, markersize=5, label=name)
    axis.plot(x[~solid], y[~solid], mark, color=colour, markersize=5, markerfacecolor="white")
    axis.set_yscale("log")


def _bars(y: Any, spread: Any) -> Any:
    """Error bars (2, k) that stay on a logarithmic axis."""
    return np.array([np.minimum(spread, 0.9 * y), spread])


def _whole_numbers(axes: Sequence[Axes], coordinates: Sequence[int]) -> None:
    """Logarithmic axes of coordinates with plain numbers, thinned out so that none overlap."""
    from matplotlib.ticker import NullLocator

    ticks: list[int] = []
    for n in sorted(set(coordinates)):
        if not ticks or n >= 1.3 * ticks[-1]:
            ticks.append(n)
    for axis in axes:
        axis.set_xscale("log")
        axis.set_xticks(ticks, [str(n) for n in ticks])
        axis.xaxis.set_minor_locator(NullLocator())
        axis.set_xlabel("coordinates (modes + static shapes)")
