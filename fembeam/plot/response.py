"""Figures of runs and models, as matplotlib Figures that need no display: save them with `figure.savefig(path)`.

Displacements are shown in mm, forces in N, times in s, or with the prefix that suits very small and large ones; spectra
are one-sided and per rad/s. A run that did not finish says so
in the title and, in red, at the foot of every figure.

Examples
--------
>>> import fembeam as fb
>>> from contacts import Hertz
>>> beam = fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01))
>>> stops, drive = [fb.Stop(0.5, Hertz(1e9))], fb.Harmonic(1e-3, 150.0)
>>> model = fb.Scene(beam, [fb.Clamped(0.0)], stops=stops, base=drive, damping=fb.ModalDamping(0.05)).reduce(modes=2)
>>> run = model.simulate(duration=1.0, dt=1e-3)
>>> [axis.get_ylabel() for axis in time_history(run).axes]
['displacement / mm', 'peak contact force / N']
>>> [axis.get_ylabel() for axis in fb.plot.spectrum(run, discard=0.2).axes]
['PSD / m² s rad⁻¹', 'PSD / m² s rad⁻¹']
>>> [axis.get_xlabel() for axis in densities(run, discard=0.2).axes]
['δ / mm', 'mid-beam u / mm']
>>> fb.plot.contacts(run).axes[3].get_xlabel(), mode_shapes(model).axes[0].get_xlabel()
('entry speed / m s⁻¹', 'z / mm')
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fembeam.model import places
from fembeam.plot.axis_names import coordinate_name
from fembeam.plot.bodies import deflected_figure
from fembeam.plot.body_shapes import body_mode_shapes
from fembeam.plot.figure import after, heading, sheet, side_by_side
from fembeam.plot.random import density_panels
from fembeam.plot.run_signals import (
    after_discard,
    between_samples,
    estimated,
    first_stop,
    natural,
    place_of,
    sampling_of,
    signal_name,
    stationary,
    two_times,
)
from fembeam.plot.spectra import segment_for
from fembeam.plot.style import BLUE, GREY, ORANGE, Vector, entry, own_line, place_name, styled, verbatim
from fembeam.plot.units import length_for, motion_for, unit_for
from fembeam.scene import persistent_drive, turns_at, unit_of
from fembeam.support import require

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from fembeam.model import Model, Run

PERIODS = 8  # of the lowest mode in a time history
BEFORE = 0.3  # of a transient's window, before the largest force
FEW = 10  # samples in a contact, below which its peak is drawn instead of its history
LEGEND_COLUMNS, LEGEND_ROW = 2, 0.2  # of mode shapes; a row's height in units of the axis
LEGEND_ROWS = 4  # of forces, above their axis


@styled
def time_history(
    run: Run, window: tuple[float, float] | None = None, z: Any = None, axes: Axes | Sequence[Axes] | None = None
) -> Figure:
    """Displacement and contact force over a readable window, contacts shaded.

    Parameters
    ----------
    run : with at least 2 samples.
    window : (from, to) in s; None: eight periods of the lowest mode (or 400 samples), about the largest contact force,
        without contacts the largest displacement. Of motion that tones and noise drive the last ones, if they hold
        contacts; without any, of all that lasts.
    z : where, in m; None: the stop of the largest force in the window, on its beam; without contacts the tip.
    axes : to draw into, two where there are stops; None makes a figure.

    Raises
    ------
    ValueError : a window that is none, or does not overlap the run; fewer than 2 samples.

    Notes
    -----
    Shaded are the contacts of the stops at z, of all stops where there is none. Between samples the displacement is the
    cubic through values and rates. Contacts shorter than ten samples are drawn as their logged peak.
    """
    step = sampling_of(run)
    lo, hi = _window(run) if window is None else two_times(window, "time_history")
    seen = f"the window must overlap the run, {run.t[0]:g} to {run.t[-1]:g} s"
    require(lo < run.t[-1] and hi > run.t[0], seen, (lo, hi), "time_history", "move it")
    body, place = _watched(run, lo, hi) if z is None else (0, z)
    figure, drawn = sheet(2 if len(run.stops) else 1, 1, (7.0, 4.2), axes, sharex=True)
    t, u = _displacement(run, place, body, lo, hi)
    (scale, unit), (tick, second) = motion_for(place, u), unit_for((lo, hi), "s")
    drawn[0].plot(tick * t, scale * u, color=BLUE)
    kind = "rotation" if turns_at(place) else "displacement"
    drawn[0].set_ylabel(f"{kind} / {unit}")
    title = f"{kind.capitalize()} at {verbatim(_name(run, body, place))} relative to the frame"
    if len(run.stops):
        stops = _stops_at(run, body, place)
        _shade_contacts(drawn, run, stops, lo, hi, tick)
        _draw_forces(drawn[1], run, lo, hi, FEW * step, tick)
        here = np.isin(run.contacts.stop, stops) & _within(run, lo, hi)
        title += f", contacts of {_listed(stops, run)} shaded" if here.any() else ""
    beside = 0.0 if window is not None else 0.01 * (hi - lo)  # so that a contact at the first instant is seen
    drawn[-1].set(xlabel=f"time / {second}", xlim=(tick * (lo - beside), tick * (hi + beside)))
    heading(drawn, title, axes is None, run=run)
    return figure


@styled
def densities(run: Run, discard: float = 0.0, axes: Axes | Sequence[Axes] | None = None) -> Figure:
    """Probability densities of δ (or the tip) and mid-beam against the Gaussian of the same mean and deviation.

    Shaded: 95 % confidence, where the run holds at least four independent parts. `axes` to draw into: one each.
    """
    signals = estimated(run, discard, segment_for(int(np.count_nonzero(after_discard(run, discard))), sampling_of(run)))
    figure, drawn = sheet(1, len(signals), (7.0, 3.1), axes)
    density_panels(drawn, {signal_name(run, name): one for name, one in signals.items()})
    if axes is None:
        title = f"Probability densities{after(discard)}, and Gaussians of equal mean and deviation"
        heading(drawn, title, True, run=run)
    return figure


@styled
def mode_shapes(model: Model, axes: Axes | None = None) -> Figure:
    """The first modes (at most six), scaled to 1, with supports, stops and masses at their places.

    `axes` to draw into; None makes a figure. Of a frame or structure with lines each mode has a panel of its own, drawn
    over the body at rest.
    """
    if model.scene.named:
        return body_mode_shapes(model, axes)
    figure, (axis,) = sheet(1, 1, (7.0, 3.8), axes)
    z = np.linspace(0.0, model.scene.beam.length, 401)
    unit, name = length_for(z)
    shapes = model.phi(z)
    scale = np.abs(shapes).max(axis=0)
    axis.axhline(0.0, color=GREY, linewidth=0.6)
    for i in np.flatnonzero(scale)[:6]:  # other bodies' modes do not move this beam
        label = f"{coordinate_name(model.names[i])}: {model.omega[i]:.{0 if model.omega[i] >= 1e3 else 1}f} rad/s"
        axis.plot(unit * z, shapes[:, i] / scale[i], label=f"{label}, ζ = {model.zeta[i]:.3g}")
    _mark_features(axis, model, unit)
    axis.set(xlabel=f"z / {name}", ylabel="φ / max |φ|", yticks=[-1.0, -0.5, 0.0, 0.5, 1.0])
    rows = -(-len(axis.get_legend_handles_labels()[1]) // LEGEND_COLUMNS)
    axis.set_ylim(-1.15, 1.2 + LEGEND_ROW * rows)  # the legend has space of its own above the curves
    axis.legend(loc="upper center", ncols=LEGEND_COLUMNS, fontsize=8)
    heading([axis], "Mode shapes of the linear beam", axes is None)
    return figure


@styled
def deflected(run: Run, t: float | None = None, scale: float | None = None, axes: Axes | None = None) -> Figure:
    """A frame or structure as it is deflected at one time, over itself at rest.

    Parameters
    ----------
    run : of a body whose nodes are known. t : s; None: when it is displaced most.
    scale : what displacements are multiplied by; None: so that they show, the title says how much.
    axes : to draw into, of three dimensions for a body in space; None makes a figure.

    Examples
    --------
    >>> import fembeam as fb
    >>> frame = fb.Frame.polyline({"A": (0, 0), "B": (0, 1), "C": (1, 1)}, fb.Section.circle(2.1e11, 7800.0, 0.02))
    >>> scene = fb.Scene(frame, [fb.Clamped("A")], base={"x": fb.Harmonic(1e-3, 20.0)})
    >>> figure = deflected(scene.reduce(modes=2).simulate(duration=0.5, dt=1e-2), t=0.4)
    >>> len(figure.axes[0].lines)
    2
    """
    require(run.shapes.named, "the body must be a frame or a structure", "a Beam", "deflected",
            "use time_history or animate")  # fmt: skip
    return deflected_figure(run, t, scale, axes)


def _window(run: Run) -> tuple[float, float]:
    """Eight periods of the lowest mode that swings (or 400 samples): about the peak, or the last ones."""
    first, end = float(run.t[0]), float(run.t[-1])
    swinging = [omega for omega in natural(run) if omega > 0]
    length = min(PERIODS * 2 * np.pi / min(swinging) if swinging else 400 * sampling_of(run), end - first)
    driven = run.model is not None and persistent_drive(run.model.scene)
    if (driven and _within(run, end - length, end).any()) or (not len(run.contacts) and stationary(run)):
        return end - length, end
    if len(run.contacts):
        about = float(run.contacts.t_in[np.argmax(run.contacts.peak_force)])
    else:
        about = float(run.t[np.argmax(np.abs(run.displacement(_resting_place(run))))])
    start = min(max(first, about - BEFORE * length), end - length)
    return start, start + length


def _resting_place(run: Run) -> Any:
    """Where to look when nothing touches: the tip, else mid-beam."""
    return next(iter(places(run.shapes).values()))


def _watched(run: Run, lo: float, hi: float) -> tuple[int, Any]:
    """Beam and z of the stop of displacement with the largest force between two times; of the first one; of the tip."""
    log, first = run.contacts, first_stop(run)
    if first is None:
        return 0, _resting_place(run)
    inside = np.flatnonzero(_within(run, lo, hi) & ~run.rotational[log.stop])
    stop = int(log.stop[inside[np.argmax(log.peak_force[inside])]]) if len(inside) else first
    return int(run.between[stop, 0]), place_of(run, stop)


def _stops_at(run: Run, body: int, z: Any) -> NDArray[np.int64]:
    """Numbers of the stops at a place, or of all where there is none; elements have no contacts."""
    stops, z = ~run.always_acting, run._beam(body).place(z)
    if isinstance(z, tuple):
        here = np.array([place_of(run, stop) == z for stop in range(len(run.stops))], dtype=bool)
    else:
        here = np.isclose(run.stops[:, 0], z)
    near = stops & here & (run.between[:, 0] == body)
    return np.flatnonzero(near if near.any() else stops)


def _listed(stops: NDArray[np.int64], run: Run) -> str:
    """Stops as words."""
    if len(stops) == np.count_nonzero(~run.always_acting) > 1:
        return "all stops"
    return " and ".join(verbatim(run.name(stop)) for stop in stops.tolist())


def _name(run: Run, body: int, z: Any) -> str:
    """A place as words."""
    if isinstance(z, (tuple, str)):
        return place_name(z) + (f" of body {body}" if body else "")
    known = (name for name, at in places(run.shapes).items() if body == 0 and np.isclose(at, z))
    return next(known, place_name(z)) + (f" of beam {body}" if body else "")


def _within(run: Run, lo: float, hi: float) -> NDArray[np.bool_]:
    """Which contacts overlap a window."""
    return (run.contacts.t_in < hi) & ~(run.contacts.t_out <= lo)  # NaN: not ended yet


def _displacement(run: Run, z: Any, body: int, lo: float, hi: float) -> tuple[Vector, Vector]:
    """(t, u) in a window."""
    first, last = np.searchsorted(run.t, [lo, hi])
    kept = slice(max(0, first - 1), last + 1)
    return between_samples(run.t[kept], run.displacement(z, body=body)[kept], run.velocity(z, body=body)[kept])


def _shade_contacts(axes: list[Axes], run: Run, stops: NDArray[np.int64], lo: float, hi: float, tick: float) -> None:
    """A band for every contact of some stops in the window."""
    left, right = run.contacts.t_in, np.where(np.isnan(run.contacts.t_out), run.t[-1], run.contacts.t_out)
    for index in np.flatnonzero(_within(run, lo, hi) & np.isin(run.contacts.stop, stops)):
        for axis in axes:
            axis.axvspan(tick * left[index], tick * right[index], color=ORANGE, alpha=0.4, linewidth=0.8)


def _draw_forces(axis: Axes, run: Run, lo: float, hi: float, least: float, tick: float) -> None:
    """The force of every element and stop touched in the window: sampled, peaks of contacts below `least` s."""
    log, inside = run.contacts, _within(run, lo, hi)
    short = inside & (log.t_out - log.t_in < least)
    kept = (run.t >= lo) & (run.t <= hi)
    always = np.flatnonzero(run.always_acting)
    drawn = np.union1d(always, log.stop[inside])
    forces = {int(stop): run._normal_force(int(stop))[kept] for stop in drawn}
    plain = unit_of("force", run.rotational[drawn]) if len(drawn) else run.unit("force")
    scale, unit = unit_for((log.peak_force[inside], *forces.values()), plain)
    for stop in drawn:
        mine = log.stop == stop
        look: dict[str, Any] = own_line(int(stop)) | {"label": entry(run.name(int(stop)))}
        if stop in always or np.any(mine & inside & ~short):
            axis.plot(tick * run.t[kept], scale * forces[int(stop)], **look)
            look.pop("label")
        axis.vlines(tick * log.t_in[mine & short], 0.0, scale * log.peak_force[mine & short], linewidth=1.2, **look)
    kind = "peak contact force" if len(drawn) > len(always) and np.all(short[inside]) else "contact force"
    axis.set_ylabel(f"{'force' if len(always) else kind} / {unit}")
    if len(run.stops) > 1 and len(drawn):
        columns = side_by_side(axis.get_legend_handles_labels()[1], max(2, -(-len(drawn) // LEGEND_ROWS)))
        axis.legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=columns, borderaxespad=0.0, fontsize=8)
    if len(drawn):
        axis.set_ylim(bottom=min(0.0, axis.get_ylim()[0]))
    else:
        axis.set(ylim=(0.0, 1.0), yticks=[0.0])
        axis.text(0.5, 0.5, "no contact in this window", transform=axis.transAxes, ha="center", color=GREY)


def _mark_features(axis: Axes, model: Model, unit: float) -> None:
    """Supports as squares, masses as circles, stops as triangles on their side of the beam, elements as diamonds."""
    scene = model.scene
    stops = [stop for stop in scene.stops if not stop.coordinate.rotation]
    turned = [stop for stop in scene.stops if stop.coordinate.rotation]
    marks: list[tuple[str, list[tuple[float, float]], str, str]] = [
        ("support", [(s.z, 0.0) for s in scene.supports], "s", "black"),
        ("mass", [(m.z, 0.0) for m in scene.masses], "o", GREY),
        ("stop below", [(s.z, -0.13) for s in stops if s.push > 0], "^", "black"),
        ("stop above", [(s.z, 0.13) for s in stops if s.push < 0], "v", "black"),
        ("stop of rotation", [(s.z, 0.0) for s in turned], "P", "black"),
        ("element", [(e.z, 0.0) for e in scene.elements], "D", "black"),
    ]
    for label, points, marker, colour in marks:
        if points:
            z, height = np.array(points).T
            axis.plot(unit * z, height, marker, color=colour, label=label, clip_on=False, markersize=7)
