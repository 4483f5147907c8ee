"""Figure of a run's contacts: durations, peak forces, entry speeds, restitution."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fembeam.plot.figure import after, heading, sheet
from fembeam.plot.style import BLUE, GREEN, RED, Vector, plain_decades, styled
from fembeam.plot.units import unit_for
from fembeam.scene import unit_of
from fembeam.support import require_non_negative
from solvers.problem import counted

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fembeam.model import Run


MOST_DOTS = 4000
MANY = 200  # contacts: from here on histograms leave out the top 1 %, which would squeeze the rest
FEWEST_BINS, MOST_BINS = 10, 50
SLOWEST = 0.005  # part of the contacts, the slowest, left out of restitutions: a logarithmic axis would be theirs
HIGHEST = 0.98  # quantile of restitutions up to which they are drawn at their place


@styled
def contacts(run: Run, discard: float = 0.0, axes: Sequence[Axes] | None = None) -> Figure:
    """Histograms of duration, peak force and entry speed, and restitution (exit over entry speed) per contact.

    Only contacts that began after `discard` and ended count. `axes` to draw into are four; None makes a figure. Raises
    ValueError when there is no contact.
    """
    require_non_negative("discard", discard, "plot.contacts", "give s at the beginning to leave out")
    log = run.contacts
    kept = np.isfinite(log.t_out) & (log.t_in >= discard)
    if not np.any(kept):
        raise ValueError("the run has no finished contact to draw")
    figure, drawn = sheet(2, 2, (7.0, 4.8), axes)
    turning = run.rotational[np.unique(log.stop[kept])]
    force, speed = unit_of("force", turning), unit_of("speed", turning).replace("/s", " s⁻¹")
    per_speed, fast = unit_for(log.speed_in[kept], speed)
    for axis, values, name, (scale, unit) in (
        (drawn[0], (times := (log.t_out - log.t_in)[kept]), "duration", unit_for(times, "s", usual=-3)),
        (drawn[1], (peaks := log.peak_force[kept]), "peak force", unit_for(peaks, force)),
        (drawn[2], log.speed_in[kept], "entry speed", (per_speed, fast)),
    ):
        _histogram(axis, scale * values, name, unit)
    _restitutions(drawn[3], per_speed * log.speed_in[kept], per_speed * log.speed_out[kept], fast)
    if axes is None:
        count, stops = int(np.count_nonzero(kept)), len(np.unique(log.stop[kept]))
        of = f" of {stops} stops" if stops > 1 else ""
        rate = count / (run.reached - discard)
        heading(drawn, f"{counted(count, 'contact')}{of}{after(discard)}, {rate:.3g} per second", True, run=run)
    return figure


def _histogram(axis: Axes, values: Vector, name: str, unit: str) -> None:
    """Counts, of many contacts up to the 99 % quantile, with the mean."""
    from matplotlib.ticker import MaxNLocator

    cut = len(values) >= MANY
    top = float(np.quantile(values, 0.99)) if cut else float(values.max())
    bins = int(np.clip(np.sqrt(len(values)), FEWEST_BINS, MOST_BINS))
    axis.hist(values, np.histogram_bin_edges(values, bins, (0.0, top or 1.0)).tolist(), color=BLUE, alpha=0.7)
    axis.axvline(values.mean(), color=RED, linestyle="--")
    of = "" if " or " in unit else f" {unit}"  # a mixed one is on the axis alone
    axis.set_title(f"mean {values.mean():.4g}{of} (dashed), largest {values.max():.4g}{of}", fontsize=8)
    axis.set(xlabel=f"{name} / {unit}" + ", without the top 1 %" * cut, ylabel="contacts")
    axis.yaxis.set_major_locator(MaxNLocator(integer=True))


def _restitutions(axis: Axes, speed_in: Vector, speed_out: Vector, unit: str) -> None:
    """Restitution against entry speed, at most MOST_DOTS evenly picked contacts; triangles lie above the axis."""
    moving = speed_in > 0.0
    if not moving.any():  # all began at rest on the stop
        axis.set_title("no contact began with a speed")
        axis.set_axis_off()
        return
    speed, restitution = speed_in[moving], speed_out[moving] / speed_in[moving]
    every = -(-len(speed) // MOST_DOTS)
    slow = np.quantile(speed, SLOWEST) if len(speed) >= MANY else 0.0
    top = max(1.05, 1.1 * float(np.quantile(restitution, HIGHEST)))
    median = float(np.median(restitution))
    beyond = (restitution > top) & (speed >= slow)
    dots = {"markersize": 2, "alpha": 0.4} if len(speed) >= MANY else {"markersize": 6, "zorder": 3}
    axis.plot(speed[::every], np.where(beyond, np.nan, restitution)[::every], ".", color=GREEN, **dots)
    axis.axhline(median, color=RED, linestyle="--")
    axis.set_ylim(0, top)
    if beyond.any():
        axis.plot(speed[beyond], np.full(np.count_nonzero(beyond), 1.06 * top), "^", markersize=4, color=GREEN,
                  label=f"{np.count_nonzero(beyond)} above, up to {restitution[beyond].max():.3g}")  # fmt: skip
        axis.legend(loc="upper right", fontsize=8, handletextpad=0.2, borderpad=0.0)
        axis.set_ylim(0, 1.3 * top)
    shown = f"{len(speed[::every])} of {len(speed)} drawn" if every > 1 else f"of {counted(len(speed), 'contact')}"
    axis.set_title(f"median {median:.3f} (dashed){';' * (every > 1)} {shown}", fontsize=8)
    low, high = 0.8 * max(float(slow), float(speed.min())), 1.2 * float(speed.max())
    if high > 10 * low:
        axis.set_xscale("log")
        plain_decades(axis.xaxis, low, high)
    slowest = ", top 99.5 %" * bool(slow)
    axis.set(xlim=(low, high), xlabel=f"entry speed / {unit}{slowest}", ylabel="exit / entry speed")
