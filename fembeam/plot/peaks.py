"""Figures of a resonance: its peak and its folds over a second parameter, frequency and damping over amplitude."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fembeam.plot.figure import heading, sheet
from fembeam.plot.style import ALONG, BLUE, RED, UP, Vector, displacement_name, entry, styled
from fembeam.plot.units import motion_for

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fembeam.study import Backbone, Fold, Peak

FINE = 24  # points between two values
WIDE = 20.0  # ratio of the last value to the first, from which on the axis is logarithmic


@styled
def peak_curve(found: Peak, axes: Sequence[Axes] | None = None) -> Figure:
    """Height of the peak over the second parameter, and where it lies; the least marked, unstable peaks hollow.

    `axes` to draw into are two; None makes a figure.

    Examples
    --------
    >>> import fembeam as fb
    >>> scene = fb.Scene(fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01)), [fb.Clamped(0.0)],
    ...                  forces=[fb.PointForce(0.5, fb.Harmonic(1.0, 200.0))], damping=fb.ModalDamping(0.05))
    >>> found = fb.study.peak(scene.reduce(modes=1), "omega", "zeta[0]", [0.05, 0.1], (100.0, 300.0))
    >>> peak_curve(found).axes[1].get_xlabel()
    'damping ratio ζ'
    """
    figure, (upper, lower) = sheet(2, 1, (6.4, 4.8), axes, sharex=True, height_ratios=(3, 2))
    tops = sorted([*found.tops, *([found.least] if found.least else [])], key=lambda one: one.value)
    p, at = np.array([one.value for one in tops]), np.array([one.at for one in tops])
    amplitude = np.array([one.amplitude for one in tops])
    scale, unit = motion_for(found.z, amplitude)
    height = scale * amplitude
    stable = np.array([one.stable for one in tops])
    upper.plot(*_between(p, height, scale * np.array([one.slope for one in tops])), "-", color=BLUE)
    lower.plot(p, at, "-", color=BLUE)
    _dots(upper, p, height, stable)
    _dots(lower, p, at, stable)
    if found.least is not None:
        label = f"least: {scale * found.least.amplitude:.4g} {unit} at {found.least.value:.4g}"
        upper.plot(found.least.value, scale * found.least.amplitude, "*", color=RED, markersize=11, label=label)
        lower.plot(found.least.value, found.least.at, "*", color=RED, markersize=11)
    if p[0] > 0.0 and p[-1] > WIDE * p[0]:
        lower.set_xscale("log")
    upper.set_ylabel(f"amplitude of {displacement_name(found.z)} / {unit}")
    lower.set(xlabel=entry(found.titles[0], ALONG), ylabel=entry(found.titles[1], UP))
    if found.least is not None or not stable.all():
        upper.legend()
    heading([upper, lower], "Peak of the response", axes is None)
    return figure


@styled
def backbone(found: Backbone, axes: Sequence[Axes] | None = None) -> Figure:
    """Frequency and damping of a resonance over the amplitude, unstable orbits hollow.

    `axes` to draw into are two; None makes a figure.

    Examples
    --------
    >>> import fembeam as fb
    >>> scene = fb.Scene(fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01)), [fb.Clamped(0.0)],
    ...                  forces=[fb.PointForce(0.5, fb.Harmonic(1.0, 200.0))], damping=fb.ModalDamping(0.05))
    >>> backbone(fb.study.backbone(scene.reduce(modes=1), [0.1, 1.0], (100.0, 300.0))).axes[0].get_ylabel()
    'ω / rad s⁻¹'
    """
    figure, (upper, lower) = sheet(2, 1, (6.4, 4.8), axes, sharex=True)
    scale, unit = motion_for(found.z, found.amplitude)
    x, stable = scale * found.amplitude, found.stable
    for axis, y in ((upper, found.omega), (lower, found.zeta)):
        axis.plot(x, y, "-", color=BLUE)
        _dots(axis, x, y, stable)
    if x.max() > WIDE * x.min():
        lower.set_xscale("log")
    upper.set_ylabel("ω / rad s⁻¹")
    lower.set(xlabel=f"amplitude of {displacement_name(found.z)} / {unit}", ylabel="equivalent damping ratio ζ")
    lower.set_ylim(bottom=0.0)
    if not stable.all():
        upper.legend()
    heading([upper, lower], "Backbone by phase resonance", axes is None)
    return figure


@styled
def fold_curve(found: Fold, axes: Sequence[Axes] | None = None) -> Figure:
    """Where a branch folds over a second parameter, and the amplitudes there; cusps marked, jumps in between shaded.

    `axes` to draw into are two; None makes a figure.

    Examples
    --------
    >>> import fembeam as fb
    >>> from contacts import Polynomial
    >>> scene = fb.Scene(fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01)), [fb.Clamped(0.0)],
    ...                  elements=[fb.Element(0.5, Polynomial([0.0, 0.0, 2e7]))], damping=fb.ModalDamping(0.01),
    ...                  forces=[fb.PointForce(0.5, fb.Harmonic(0.2, 190.0))])
    >>> branch = scene.reduce(modes=1).branch("omega", (182.0, 192.0)).run()
    >>> found = fb.study.fold(branch, "forces[0].signal.amplitude", (0.19, 0.21))
    >>> fold_curve(found).axes[0].get_ylabel()
    'drive frequency ω / rad s⁻¹'
    """
    figure, (upper, lower) = sheet(2, 1, (6.4, 4.8), axes, sharex=True, height_ratios=(1, 1))
    scale, unit = motion_for(found.z, found.amplitude)
    height = scale * found.amplitude
    for axis, y in ((upper, found.at), (lower, height)):
        axis.plot(found.values, y, ".-", color=BLUE)
        axis.plot(found.values[found.cusps], y[found.cusps], "*", color=RED, markersize=11, label="cusp")
    if len(found.cusps) == 1:
        upper.fill(found.values, found.at, color=BLUE, alpha=0.15, label="three orbits")
    upper.set_ylabel(entry(found.titles[1], UP))
    lower.set(xlabel=entry(found.titles[0], ALONG), ylabel=f"amplitude of {displacement_name(found.z)} / {unit}")
    if found.cusps:
        upper.legend()
    heading([upper, lower], "Folds of the response", axes is None)
    return figure


def _dots(axis: Axes, x: Vector, y: Vector, stable: NDArray[np.bool_]) -> None:
    """Dots, hollow where unstable."""
    axis.plot(x[stable], y[stable], "o", color=BLUE, markersize=3)
    if not stable.all():
        axis.plot(x[~stable], y[~stable], "o", color=BLUE, markersize=4, markerfacecolor="white", label="unstable")


def _between(x: Vector, y: Vector, slope: Vector) -> tuple[Vector, Vector]:
    """A curve through values with their slopes; straight lines if one has none."""
    from scipy.interpolate import CubicHermiteSpline

    if not np.isfinite(slope).all():
        return x, y
    fine = np.unique(np.concatenate([np.linspace(a, b, FINE) for a, b in pairwise(x)]))
    return fine, CubicHermiteSpline(x, y, slope)(fine)
