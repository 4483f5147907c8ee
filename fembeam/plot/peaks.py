"""The figure of a resonance peak over a second parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fembeam.plot.figure import heading, sheet
from fembeam.plot.style import BLUE, RED, displacement_name, styled

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fembeam.study import Peak

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
    height = 1e3 * np.array([one.amplitude for one in tops])
    stable = np.array([one.stable for one in tops])
    for axis, y in ((upper, height), (lower, at)):
        axis.plot(p, y, "-", color=BLUE)
        axis.plot(p[stable], y[stable], "o", color=BLUE, markersize=3)
        axis.plot(p[~stable], y[~stable], "o", color=BLUE, markersize=4, markerfacecolor="white", label="unstable")
    if found.least is not None:
        label = f"least: {1e3 * found.least.amplitude:.4g} mm at {found.least.value:.4g}"
        upper.plot(found.least.value, 1e3 * found.least.amplitude, "*", color=RED, markersize=11, label=label)
        lower.plot(found.least.value, found.least.at, "*", color=RED, markersize=11)
    if p[0] > 0.0 and p[-1] > WIDE * p[0]:
        lower.set_xscale("log")
    upper.set_ylabel(f"amplitude of {displacement_name(found.z)} / mm")
    lower.set(xlabel=found.titles[0], ylabel=found.titles[1])
    if found.least is not None or not stable.all():
        upper.legend()
    heading([upper, lower], "Peak of the response", axes is None)
    return figure
