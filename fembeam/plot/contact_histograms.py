"""Figure of a run's contacts: durations, peak forces, entry speeds, restitution."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fembeam.plot.style import BLUE, GREEN, RED, Vector, sheet, styled, titled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fembeam.model import Run


MOST_DOTS = 4000


@styled
def contacts(run: Run, discard: float = 0.0) -> Figure:
    """Histograms of duration, peak force and entry speed, and restitution (exit over entry speed) per contact.

    Only contacts that began after `discard` and ended count. Raises ValueError when there is none.
    """
    log = run.contacts
    kept = np.isfinite(log.t_out) & (log.t_in >= discard)
    if not np.any(kept):
        raise ValueError("the run has no finished contact to draw")
    figure, axes = sheet(run, 2, 2, (7.0, 4.8))
    force, speed = run.unit("force"), _speed(run)
    for axis, values, label in (
        (axes[0], 1e3 * (log.t_out - log.t_in)[kept], "duration / ms"),
        (axes[1], log.peak_force[kept], f"peak force / {force}"),
        (axes[2], log.speed_in[kept], f"entry speed / {speed}"),
    ):
        _histogram(axis, values, label)
    _restitutions(axes[3], log.speed_in[kept], log.speed_out[kept], speed)
    span = float(run.t[-1]) - discard
    return titled(figure, run, f"{np.count_nonzero(kept)} contacts, {np.count_nonzero(kept) / span:.3g} per second")


def _speed(run: Run) -> str:
    """Unit of entry speeds."""
    return run.unit("speed").replace("/s", " s⁻¹")


def _histogram(axis: Axes, values: Vector, label: str) -> None:
    """Counts up to the 99 % quantile, with the mean."""
    edges = np.histogram_bin_edges(values, 50, (0.0, float(np.quantile(values, 0.99))))
    axis.hist(values, edges.tolist(), color=BLUE, alpha=0.7)
    axis.axvline(values.mean(), color=RED, linestyle="--")
    axis.set_title(f"mean {values.mean():.3g} (dashed), largest {values.max():.4g}")
    axis.set_xlabel(f"{label}, without the top 1 %")
    axis.set_ylabel("contacts")


def _restitutions(axis: Axes, speed_in: Vector, speed_out: Vector, unit: str) -> None:
    """Restitution against entry speed, at most MOST_DOTS evenly picked contacts."""
    moving = np.flatnonzero(speed_in > 0)
    if not len(moving):  # all began at rest on the stop
        axis.set_title("no contact began with a speed")
        axis.set_axis_off()
        return
    picked = moving[:: max(1, -(-len(moving) // MOST_DOTS))]
    restitution = speed_out[picked] / speed_in[picked]
    low, high = 0.8 * np.quantile(speed_in[picked], 0.005), 1.2 * speed_in[picked].max()
    axis.plot(speed_in[picked], restitution, ".", markersize=2, alpha=0.4, color=GREEN)
    axis.axhline(float(np.median(restitution)), color=RED, linestyle="--")
    axis.set_title(f"median {np.median(restitution):.3f} of the {len(picked)} shown (dashed)")
    axis.set_xscale("log" if high > 10 * low else "linear")  # ticks within a decade of a logarithmic axis overlap
    axis.set_xlim(low, high)
    axis.set_ylim(0, max(1.05, 1.1 * float(np.quantile(restitution, 0.98))))
    axis.set_xlabel(f"entry speed / {unit}")
    axis.set_ylabel("exit / entry speed")
