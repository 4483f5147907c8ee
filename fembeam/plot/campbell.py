"""Campbell diagrams: frequencies of a rotor over its spin."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fembeam.plot.figure import sheet
from fembeam.plot.style import BLUE, GREY, ORANGE, RED, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fembeam.study import Campbell

KINDS = ((1, RED, "forward"), (-1, BLUE, "backward"), (0, GREY, "on a line"))


@styled
def campbell(result: Campbell, axes: Axes | None = None) -> Figure:
    """Frequencies over spin, forward and backward whirl in different colours; where ω = |Ω| lie the critical speeds.

    `axes` to draw into; None makes a figure.

    Examples
    --------
    >>> import fembeam as fb
    >>> shaft = fb.Frame.straight(0.5, fb.Section.circle(2.1e11, 7850.0, 0.04), bending_only=True)
    >>> scene = fb.Scene(shaft, [fb.Clamped("A")], masses=[fb.Disk("B", 12.0, diametral=0.04, polar=0.075)])
    >>> campbell(scene.campbell(np.linspace(0.0, 400.0, 41), modes=2)).axes[0].get_xlabel()
    'spin Ω / rad s⁻¹'
    """
    figure, (axis,) = sheet(1, 1, (6.0, 4.2), axes)
    spins = np.repeat(result.spins[:, None], result.omega.shape[1], axis=1)
    for kind, colour, name in KINDS:
        mine = result.turning == kind
        if mine.any():
            axis.scatter(spins[mine], result.omega[mine], 9.0, color=colour, marker=".", label=name)
    low, high = result.spins[0], result.spins[-1]
    line = np.unique([low, min(max(0.0, low), high), high])
    axis.plot(line, np.abs(line), "--", color=GREY, linewidth=1.0, label="ω = Ω" if low >= 0.0 else "ω = |Ω|")
    met = np.concatenate((result.critical, -result.critical))
    met = met[(low <= met) & (met <= high)]
    if met.size:
        axis.plot(met, np.abs(met), "o", color=ORANGE, fillstyle="none", label="critical speeds")
    axis.set(xlabel="spin Ω / rad s⁻¹", ylabel="frequency ω / rad s⁻¹", title="Campbell diagram")
    axis.set_ylim(bottom=0.0, top=1.05 * result.omega.max())
    axis.margins(x=0.0 if high > low else None)
    axis.legend()
    return figure
