"""The path of a place in its clearance circle, and the forces there over the angle of the place."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fembeam.plot.figure import heading, legend, sheet
from fembeam.plot.rig_words import length
from fembeam.plot.run_signals import between_samples, samples_in, sampling_of
from fembeam.plot.style import BLUE, GREEN, GREY, RED, Vector, styled, verbatim
from fembeam.plot.units import length_for, unit_for
from fembeam.response import states
from fembeam.structures import direction_of, named
from fembeam.support import require

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fembeam.model import Run

TRAIL = 25  # pictures
ROUND = np.linspace(0.0, 2.0 * np.pi, 361)


@styled
def orbit_in_clearance(
    run: Run, stop: int | str = 0, window: tuple[float, float] | None = None, axes: Axes | None = None
) -> Figure:
    """The path of a place in the circle of its annular stop, red while it is in contact; with friction green in stick.

    Parameters
    ----------
    run : with at least 2 samples. stop : number or name of an annular stop.
    window : (from, to) in s; None: all of the run. Between samples the path is the cubic through values and rates.
    axes : to draw into; None makes a figure.

    Raises
    ------
    ValueError : a stop on a line, a window without samples.

    Examples
    --------
    >>> import fembeam as fb
    >>> from contacts import Hertz
    >>> tube = fb.Frame.straight(1.0, fb.Section.circle(2.1e11, 7800.0, 0.01), bending_only=True)
    >>> loads = [fb.PointForce("B", fb.Harmonic(2.0, 40.0, phase), direction=n) for n, phase in [("x", 0.0), ("y", 1)]]
    >>> scene = fb.Scene(tube, [fb.Clamped("A")], stops=[fb.AnnularStop("B", Hertz(1e8), 1e-3)], forces=loads)
    >>> run = scene.reduce(modes=2).simulate(duration=1.0, dt=1e-3)
    >>> [line.get_label() for line in orbit_in_clearance(run).axes[0].lines]
    ['clearance 1 mm', 'free', 'in contact']
    """
    sampling_of(run)
    number = run._stop(stop)
    radius, *centre = run.circles[number].tolist()
    d, kept = run.place_in_clearance(number), samples_in(run, window, "orbit_in_clearance")
    t, path = between_samples(run.t[kept], d[kept], run.q_dot[kept] @ run.directions[run._rows[number]][:2].T)
    touching = _beyond(path, radius)
    parts = [(BLUE, "free", ~touching), (RED, "in contact", touching)]
    if run.rubs[number, 1]:
        codes = _codes(run, number, t)
        stuck, slips = touching & (codes == 0.0), touching & (np.abs(codes) == 1.0)
        parts = [(BLUE, "free", ~(stuck | slips)), (RED, "slips", slips), (GREEN, "sticks", stuck)]
    figure, (axis,) = sheet(1, 1, (5.0, 5.0), axes)
    scale, unit = length_for((path, radius))
    axis.plot(*_circle(scale * radius), "--", color=GREY, label=f"clearance {length(abs(radius))}")
    for colour, label, shown in parts:
        axis.plot(*_only(scale * path, shown), color=colour, linewidth=0.9, label=label)
    x, y = _ways(run, number)
    of_centre = " from the centre" if any(centre) else ""
    axis.set(xlabel=f"{x}{of_centre} / {unit}", ylabel=f"{y}{of_centre} / {unit}")
    axis.set_aspect("equal", adjustable="datalim")
    legend(axis, axes is None, "outside lower center", **({"ncols": len(parts) + 1} if axes is None else {}))
    heading([axis], f"Path at {verbatim(run.name(number))}", axes is None, run=run)
    return figure


def _codes(run: Run, stop: int, t: Vector) -> Any:
    """What the slider of a stop does at times: ±1 slips, 0 sticks, else free."""
    times, codes, _ = states(run, stop)
    return np.append(codes, np.nan)[np.searchsorted(times, t, side="right") - 1]


@styled
def forces_in_clearance(
    run: Run, stop: int | str = 0, window: tuple[float, float] | None = None, axes: Axes | None = None
) -> Figure:
    """Forces of an annular stop at the samples in polar form: N, with friction |F_t|, over the angle of its place.

    Parameters
    ----------
    run : with at least 2 samples. stop : number or name of an annular stop.
    window : (from, to) in s; None: all of the run.
    axes : polar ones to draw into; None makes a figure.

    Raises
    ------
    ValueError : a stop on a line, a window without samples, axes that are not polar.

    Examples
    --------
    >>> import fembeam as fb
    >>> from contacts import Hertz
    >>> tube = fb.Frame.straight(1.0, fb.Section.circle(2.1e11, 7800.0, 0.01), bending_only=True)
    >>> loads = [fb.PointForce("B", fb.Harmonic(2.0, 40.0, phase), direction=n) for n, phase in [("x", 0.0), ("y", 1)]]
    >>> scene = fb.Scene(tube, [fb.Clamped("A")], stops=[fb.AnnularStop("B", Hertz(1e8), 1e-3)], forces=loads)
    >>> run = scene.reduce(modes=2).simulate(duration=1.0, dt=1e-3)
    >>> [line.get_label() for line in forces_in_clearance(run).axes[0].lines]
    ['N']
    """
    from matplotlib.ticker import MaxNLocator

    sampling_of(run)
    number = run._stop(stop)
    d, kept = run.place_in_clearance(number), samples_in(run, window, "forces_in_clearance")
    polar = axes is None or axes.name == "polar"
    require(polar, "axes must be polar", axes, "forces_in_clearance", "make them with projection='polar'")
    figure, found = sheet(1, 1, (5.0, 5.2), axes, subplot_kw={"projection": "polar"})
    axis: Any = found[0]
    angle, normal = np.arctan2(d[:, 1], d[:, 0]), run._normal_force(number)
    drawn = {"N": (RED, normal)} | ({"$|F_t|$": (GREEN, np.abs(run.friction(number)))} if run.rubs[number, 1] else {})
    shown = kept[normal[kept] > 0.0]
    scale, unit = unit_for([force[shown] for _, force in drawn.values()], "N")
    for label, (colour, force) in drawn.items():
        axis.plot(angle[shown], scale * force[shown], ".", color=colour, markersize=2.5, label=label)
    x, y = _ways(run, number)
    axis.set_xticks(0.5 * np.pi * np.arange(4), [x, y, f"-{x}", f"-{y}"])
    axis.set_ylim(0.0)
    axis.set_rlabel_position(67.5)
    axis.yaxis.set_major_locator(MaxNLocator(4))
    axis.tick_params(axis="y", labelsize=8, labelcolor=GREY)
    axis.grid(linewidth=0.4)
    legend(axis, axes is None, "outside lower center", **({"ncols": 2} if axes is None else {"loc": "lower right"}))
    heading([axis], f"Forces at {verbatim(run.name(number))} / {unit}", axes is None, run=run)
    return figure


class Whirl:
    """The place of an annular stop as it moves in its circle, with the way it came, red where it is in contact."""

    def __init__(self, axis: Axes, run: Run, stop: int, samples: NDArray[np.int64]) -> None:
        self.run, self.samples = run, samples
        radius = float(run.circles[stop, 0])
        self.path = run.place_in_clearance(stop)
        self.touching = _beyond(self.path, radius)
        shown = self.path[samples[0] : samples[-1] + 1]
        self.scale, unit = length_for((shown, radius))
        axis.plot(*_circle(self.scale * radius), "--", color=GREY, linewidth=0.8)
        axis.plot(*self.scale * shown.T, color=GREY, linewidth=0.3)
        self.trail = axis.plot([], [], color=BLUE, linewidth=1.2)[0]
        self.pressed = axis.plot([], [], color=RED, linewidth=1.6)[0]
        self.place = axis.plot([], [], "o", color=BLUE, markersize=6)[0]
        x, y = _ways(run, stop)
        axis.set(xlabel=f"{x} / {unit}", ylabel=f"{y} / {unit}")
        axis.set_title(f"{verbatim(run.name(stop))}, clearance {length(abs(radius))}", fontsize=8)
        axis.set_aspect("equal", adjustable="datalim")
        axis.locator_params(nbins=5)

    def show(self, number: int) -> list[Any]:
        """Move the place to one picture; its way is that of the last `TRAIL` pictures."""
        first, now = int(self.samples[max(number - TRAIL, 0)]), int(self.samples[number])
        way, touching = self.scale * self.path[first : now + 1], self.touching[first : now + 1]
        self.trail.set_data(*way.T)
        self.pressed.set_data(*_only(way, touching))
        self.place.set_data(*self.scale * self.path[[now]].T)
        self.place.set_color(RED if self.touching[now] else BLUE)
        return [self.trail, self.pressed, self.place]


def _ways(run: Run, stop: int) -> list[str]:
    """The two directions of a stop, in words."""
    ways = run.places[stop][1]
    return [way if isinstance(way, str) else named(direction_of(way, "orbit_in_clearance")) for way in ways]


def _circle(radius: float) -> Vector:
    """The clearance (2, k)."""
    return abs(radius) * np.array([np.cos(ROUND), np.sin(ROUND)])


def _beyond(path: Vector, radius: float) -> NDArray[np.bool_]:
    """Where a path (k, 2) presses on the circle, from inside or, of a negative radius, from outside."""
    return np.sign(radius) * (np.linalg.norm(path, axis=1) - abs(radius)) > 0.0


def _only(path: Vector, shown: NDArray[np.bool_]) -> Vector:
    """Some of a path (k, 2), with the points before them; (2, k)."""
    return np.where((shown | np.append(shown[1:], False))[:, None], path, np.nan).T
