"""Runs as moving pictures: beams, stops, impactors and contact forces, as GIF or MP4."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fembeam.plot.bodies import BodyStage
from fembeam.plot.figure import side_by_side
from fembeam.plot.run_signals import samples_in
from fembeam.plot.style import BLUE, GREY, ORANGE, RED, entry, own_line, styled
from fembeam.plot.units import length_for, unit_for
from fembeam.scene import ON
from fembeam.support import counting, file_path, is_finite, require, require_positive, written_beside

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fembeam.model import Run

Vector = NDArray[np.float64]

MOST_FRAMES = 1000  # above it a GIF takes minutes and fills disks
POINTS = 121  # along a beam
STAY = 0.6  # of the height of the picture, the length of the arrow of the largest force


def animate(
    run: Run,
    path: str | os.PathLike[str],
    window: tuple[float, float] | None = None,
    frames: int = 150,
    fps: float = 25.0,
    progress: bool = False,
) -> Path:
    """Write a run as a moving picture: deflected beams, stops, impactors, an arrow for every contact force.

    The arrow is the largest force in the time nearest to its picture, so that no contact is lost between pictures. Of
    a frame or structure the deflected lines are shown, magnified as the title says, and beside them how the places of
    its annular stops, at most three, whirl in their circles.

    Parameters
    ----------
    run : with samples close enough to show the motion: at least `frames` of them in the window.
    path : .gif, or .mp4 where the program ffmpeg is installed.
    window : (from, to) in s; None: all of it.
    frames : how many pictures, evenly spread over the window's samples; at most 1000.
    fps : pictures per second. The title says how much slower or faster than real time that is.
    progress : show a bar (on terminals and in notebooks only).

    Returns
    -------
    The path.

    Raises
    ------
    ValueError : another suffix, no ffmpeg, fewer than 2 samples in the window, fps not above 0.
    """
    from matplotlib.animation import FFMpegWriter, FuncAnimation, PillowWriter

    target = file_path(path, "animate")
    known = target.suffix in (".gif", ".mp4")
    require(known, "the suffix must be .gif or .mp4", target.suffix, "animate", "choose one")
    able = target.suffix == ".gif" or FFMpegWriter.isAvailable()
    require(able, "an .mp4 needs the program ffmpeg", "none", "animate", "install it, or write a .gif")
    require(target.parent.is_dir(), "the folder must exist", str(target.parent), "animate", "make it first")
    require_positive("fps", fps, "animate", "give pictures per second")
    samples = _samples(run, window, frames)
    stage = _stage(run, samples, float(fps))
    film = FuncAnimation(stage.figure, stage.show, frames=len(samples), init_func=lambda: [], blit=False)
    writer = (PillowWriter if target.suffix == ".gif" else FFMpegWriter)(fps=fps)  # type: ignore[arg-type]
    with written_beside(target) as draft, counting(progress, total=len(samples), unit=" pictures") as bar:
        film.save(draft, writer=writer, dpi=100, progress_callback=lambda *_: bar.update())
    return target


def frame(run: Run, t: float, window: tuple[float, float] | None = None) -> Figure:
    """One picture of the moving picture, at the sample next to t (s).

    Examples
    --------
    >>> import fembeam as fb
    >>> from contacts import Hertz
    >>> beam = fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01))
    >>> stops, drive, damping = [fb.Stop(0.5, Hertz(1e9))], fb.Harmonic(1e-3, 150.0), fb.ModalDamping(0.05)
    >>> model = fb.Scene(beam, [fb.Clamped(0.0)], stops=stops, base=drive, damping=damping).reduce(modes=2)
    >>> figure = frame(model.simulate(duration=0.2, dt=1e-3), t=0.1)
    >>> figure.axes[0].get_xlabel()
    'z / mm'
    """
    inside = is_finite(t) and run.t[0] <= t <= run.t[-1]
    require(inside, f"t must lie within the run, {run.t[0]:g} to {run.t[-1]:g} s", t, "plot.frame", "choose one")
    samples = _samples(run, window, MOST_FRAMES)
    stage = _stage(run, samples, None)
    stage.show(int(np.argmin(np.abs(run.t[samples] - t))))
    return stage.figure


def _stage(run: Run, samples: NDArray[np.int64], fps: float | None) -> _Stage | BodyStage:
    """What is shown: a beam with its contacts, or the lines of another body."""
    pace = "" if fps is None else _pace(fps * float(np.median(np.diff(run.t[samples]))))
    if not run.shapes.named:
        straight = not any(shapes.named for shapes in run.others)
        require(straight, "moving pictures of a Beam must be of Beams alone", run.others, "animate",
                "draw plot.time_history or plot.mode_shapes")  # fmt: skip
        return _Stage(run, samples, pace)
    return BodyStage(run, samples, pace)


def _samples(run: Run, window: tuple[float, float] | None, frames: int) -> NDArray[np.int64]:
    """Numbers of the samples to show."""
    whole = isinstance(frames, (int, np.integer)) and 2 <= frames <= MOST_FRAMES
    require(whole, f"frames must be 2 to {MOST_FRAMES}", frames, "animate", "give a count")
    inside = samples_in(run, window, "animate", "widen it, or lower dt")
    return inside[np.unique(np.linspace(0, len(inside) - 1, frames).round().astype(int))]


def _peaks(run: Run, stop: int, samples: NDArray[np.int64]) -> Vector:
    """Largest force (pictures,) of a contact in the time nearest to each picture: of samples, and of logged peaks.

    A logged peak counts where the samples of its contact are highest; without any, in its middle.
    """
    force, log, t = np.abs(run._normal_force(stop)), run.contacts, run.t
    shown, found = t[samples], np.zeros(len(samples))
    between = (shown[1:] + shown[:-1]) / 2
    inside = slice(samples[0], samples[-1] + 1)
    np.maximum.at(found, np.searchsorted(between, t[inside]), force[inside])
    mine = log.stop == stop
    for t_in, t_out, peak in zip(log.t_in[mine], log.t_out[mine], log.peak_force[mine], strict=True):
        first, last = np.searchsorted(t, [t_in, np.nan_to_num(t_out, nan=np.inf)])
        when = t[first + int(np.argmax(force[first:last]))] if last > first else (t_in + t_out) / 2
        if shown[0] <= when <= shown[-1]:
            picture = int(np.searchsorted(between, when))
            found[picture] = max(found[picture], peak)
    return found


def _pace(ratio: float) -> str:
    """Time of the run per time of the film, in words.

    Examples
    --------
    >>> _pace(3.3), _pace(0.01), _pace(1.0)
    (', 3.3 times faster than real time', ', 100 times slower than real time', ', in real time')
    """
    if abs(ratio - 1.0) < 0.005:
        return ", in real time"
    way, times = ("faster", ratio) if ratio > 1.0 else ("slower", 1.0 / ratio)
    return f", {times:.{0 if times >= 100 else 1}f} times {way} than real time".replace(".0 ", " ")


class _Contact(NamedTuple):
    """A stop, element or impactor as the run knows it."""

    z: float
    push: float
    gap: float
    body: int
    on: str
    number: int
    rotation: bool
    always: bool

    @property
    def is_stop(self) -> bool:
        """Whether it is a stop on the frame that the beam runs into."""
        return self.on == "frame" and not (self.rotation or self.always)


def _contacts(run: Run) -> list[_Contact]:
    """All contacts in the order of the log."""
    rows: Any = zip(run.stops.tolist(), run.between.tolist(), run.kinds.tolist(), strict=True)
    return [
        _Contact(z, push, gap, body, ON[kind], number, rotation, always)
        for (z, push, gap), (body, kind, number), (rotation, always) in rows
    ]


class _Stage:
    """The figure and what moves in it."""

    figure: Figure

    def __init__(self, run: Run, samples: NDArray[np.int64], pace: str) -> None:
        self.run, self.samples, self.pace, self.contact_rows = run, samples, pace, _contacts(run)
        self.beams, self.impactor_places = run.readout.heights, run.readout.impactor_places
        self.forces = [
            run.force(i)[samples] if one.always else _peaks(run, i, samples) for i, one in enumerate(self.contact_rows)
        ]
        pushes = [f for f, one in zip(self.forces, self.contact_rows, strict=True) if not one.rotation]
        self.largest = max([float(np.abs(force).max()) for force in pushes], default=0.0)
        self.lines = self._displaced()
        self._build()

    def _displaced(self) -> list[tuple[Vector, Vector]]:
        """(z, height over the scene's beam (frames, z)) of every beam."""
        lines = []
        for shapes, height in zip((self.run.shapes, *self.run.others), self.beams, strict=True):
            z = np.linspace(shapes.nodes[0], shapes.nodes[-1], POINTS)
            q = self.run.with_supports(self.run.q, shapes.moving)[self.samples]
            lines.append((z, height + (q @ shapes.rows_with_supports(z).T)))
        return lines

    @styled
    def _build(self) -> Figure:
        """Axes, fixed things, and empty artists for what moves."""
        from fembeam.plot.window import Figure

        self.figure = Figure(figsize=(7.0, 4.4), layout="constrained")
        heights = [2.2, 1.0 if self.contact_rows else 0.1]  # without contacts the time alone
        self.beam_axis, self.force_axis = self.figure.subplots(2, 1, height_ratios=heights)
        self.span = self._limits(self.beam_axis)
        self.curves = [self.beam_axis.plot([], [], color=BLUE, linewidth=2.2)[0] for _ in self.lines]
        self.balls = [
            self.beam_axis.plot([], [], "o", color=GREY, markersize=10, transform=self._beside(side, 6.0))[0]
            for side in self._sides()
        ]
        self.arrows = self.beam_axis.quiver(*np.zeros((4, max(1, len(self.contact_rows)))), color=RED, angles="xy",
                                            scale_units="xy", scale=1, width=0.007, pivot="tip", zorder=5)  # fmt: skip
        self.title = self.beam_axis.set_title(" ")
        self._fixed(self.beam_axis)
        scale, unit = unit_for(self.forces, self.run.unit("force"))
        self.tick, self.second = unit_for(self.run.t[self.samples[[0, -1]]], "s")
        t = self.tick * self.run.t[self.samples]
        for i, force in enumerate(self.forces):
            label = entry(self.run.name(i))
            self.force_axis.step(t, scale * force, **own_line(i), where="mid", label=label)
        self.cursor = self.force_axis.axvline(t[0], color=ORANGE)
        self.force_axis.set(xlabel=f"time / {self.second}", ylabel=f"peak contact\nforce / {unit}")
        self.force_axis.set_xlim(*self.tick * self.run.t[self.samples[[0, -1]]])
        if not self.forces:
            self.force_axis.set(yticks=[], ylabel="")
        if len(self.forces) > 1:
            handles, labels = self.force_axis.get_legend_handles_labels()
            self.figure.legend(handles, labels, loc="outside lower center", ncols=side_by_side(labels, 4))
        for _ in range(2):  # the first may change the ticks, and so the space for them
            self.figure.draw_without_rendering()
        self.figure.set_layout_engine("none")  # takes longer than a picture
        return self.figure

    def _limits(self, axis: Axes) -> float:
        """Set the view, on the beams: an impactor may leave it; returns its height on the axis."""
        rows = [line for _, line in self.lines] + [self.impactor_places[:, 1]] * bool(len(self.impactor_places))
        stops = [-contact.push * contact.gap for contact in self.contact_rows if contact.is_stop]
        low = min(*(float(row.min()) for row in rows), *stops, 0.0)
        high = max(*(float(row.max()) for row in rows), *stops, 0.0)
        length = max(float(z[-1]) for z, _ in self.lines)
        (self.along, along), (self.across, across) = length_for(length), length_for((low, high))
        low, high = self.across * low, self.across * high
        spread = max(high - low, 1e-9)
        axis.set(xlim=(-0.03 * self.along * length, 1.03 * self.along * length))
        axis.set(ylim=(low - 0.25 * spread, high + 0.25 * spread), xlabel=f"z / {along}")
        axis.set_ylabel(f"displacement / {across}")
        return 1.5 * spread

    def _sides(self) -> list[float]:
        """For every impactor +1 when it sits over its beam, -1 under it, 0 when it embraces it."""
        pushes: list[list[float]] = [[] for _ in self.impactor_places]
        for contact in self.contact_rows:
            if contact.on == "impactor":
                pushes[contact.number].append(-contact.push)
        return [sum(each) for each in pushes]

    def _beside(self, side: float, points: float) -> Any:
        """Data coordinates moved up by so many points times `side`, so that a marker touches and does not cover."""
        from matplotlib.transforms import ScaledTranslation

        return self.beam_axis.transData + ScaledTranslation(0, side * points / 72, self.figure.dpi_scale_trans)

    def _fixed(self, axis: Axes) -> None:
        """Supports and stops on the frame."""
        for z, body in self.run.readout.supports:
            height = self.across * self.beams[int(body)]
            axis.plot(self.along * z, height, "s", color="black", markersize=7, clip_on=False)
        for contact in self.contact_rows:
            if contact.on == "frame" and not contact.is_stop:
                height = self.across * self.beams[contact.body]
                axis.plot(self.along * contact.z, height, "D", color="black", markersize=7,
                          clip_on=False, zorder=1)  # fmt: skip
            elif contact.is_stop:
                at = self.across * (self.beams[contact.body] - contact.push * contact.gap)
                marker = "^" if contact.push > 0 else "v"
                axis.plot(self.along * contact.z, at, marker=marker, color="black", markersize=9,
                          transform=self._beside(-contact.push, 6.0), clip_on=False, zorder=1)  # fmt: skip

    def show(self, number: int) -> list[Artist]:
        """Move everything to one frame."""
        for curve, (z, line) in zip(self.curves, self.lines, strict=True):
            curve.set_data(self.along * z, self.across * line[number])
        for i, (ball, (place, height)) in enumerate(zip(self.balls, self.impactor_places, strict=True)):
            moved = height + self.run.impactor_displacement(i)[self.samples[number]]
            ball.set_data([self.along * place], [self.across * moved])
        self._point(number)
        now = float(self.run.t[self.samples[number]])
        self.cursor.set_xdata([self.tick * now, self.tick * now])
        said = f"{now:.4f} s" if self.second == "s" else f"{self.tick * now:.2f} {self.second}"
        self.title.set_text(f"t = {said}{self.pace}")
        return [*self.curves, *self.balls, self.arrows, self.cursor]

    def _point(self, number: int) -> None:
        """An arrow for every contact force, ending at its place on the beam; moments have none."""
        if not self.contact_rows:
            return
        ends, lengths = [], []
        for contact, force in zip(self.contact_rows, self.forces, strict=True):
            along, line = self.lines[contact.body]
            height = float(np.interp(contact.z, along, line[number]))
            ends.append((self.along * contact.z, self.across * height))
            share = float(force[number]) / self.largest if self.largest > 0 else 0.0
            lengths.append(contact.push * share * STAY * self.span if share and not contact.rotation else np.nan)
        at: Any = np.array(ends)
        self.arrows.set_offsets(at)
        self.arrows.set_UVC(np.zeros(len(lengths)), np.array(lengths))
