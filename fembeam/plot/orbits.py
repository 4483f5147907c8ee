"""Figures of periodic motion: response diagrams of branches, single orbits, brute-force bifurcation diagrams."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fembeam.model import observed
from fembeam.plot.axis_names import axis_name
from fembeam.plot.figure import heading, legend, sheet
from fembeam.plot.linear import frequencies
from fembeam.plot.style import (
    ALONG,
    GREEN,
    GREY,
    ORANGE,
    RED,
    Vector,
    displacement_name,
    entry,
    own_colour,
    plain_decades,
    styled,
    verbatim,
)
from fembeam.plot.units import motion_for, unit_for
from fembeam.scene import signals_of, turns_at
from fembeam.scene.parameters import scalars
from fembeam.support import require
from solvers.problem import counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fembeam.model import Branch, Orbit
    from fembeam.study import Bifurcation

MARKS = {"fold": ("o", GREY), "flip": ("s", RED), "neimark-sacker": ("D", GREEN), "branch point": ("P", "black"),
         "grazing": ("x", "black"), "stick": ("d", GREEN), "floor": ("+", "black"),
         "merging": ("^", ORANGE)}  # fmt: skip
SPAN, CLOSED = "reached the end of the span", "closed"  # ends that are no surprise
ENDS = "*Xhd8"  # marks of the others, one for each reason
LIMITS: Any = {False: ("-", ":"), True: ((0, (8, 2)), (0, (1, 3)))}  # linear responses: of one level, of several
BEHIND = 400  # points of the linear response
FAR = 3.0  # times the branches: so high a linear response would press them down


@styled
def branch(
    branches: Branch | Sequence[Branch],
    z: Any = None,
    cloud: tuple[Vector, Vector] | None = None,
    axes: Axes | None = None,
    labels: Sequence[str] | None = None,
) -> Figure:
    """Response diagram: largest |u| at z over a period against the parameter, dashed where unstable.

    Special orbits are marked, and where and why each direction ended: by a bar at an end of the span. Along the
    frequency of the only load the linear response of every level lies behind (all contacts open, elements stuck or
    elastic, and once more with all their sliders slipping), and for each period the backbone of the lowest mode: its
    free vibration against the stops, at the frequency of the load that it answers in that period. Where the linear
    response reaches far above the branches a figure of its own has a logarithmic axis.

    Parameters
    ----------
    branches : one or several along the same parameter.
    z : m; None is the first stop.
    cloud : (parameter, |u|) of runs to draw beneath, the check by brute force.
    axes : to draw into, whose limits are those of the branches; None makes a figure.
    labels : of the branches; None tells their period, and where these are the same the one number of their scenes that
        is not, such as the level.
    """
    several = [branches] if not isinstance(branches, Sequence) else list(branches)
    right = bool(several) and all(hasattr(one, "family") for one in several)
    require(right, "nothing to draw", branches, "plot.branch", "give one branch or more")
    model = several[0].family.model
    place = observed(model) if z is None else z
    figure, (axis,) = sheet(1, 1, (8.4, 3.8), axes)
    peaks = [np.array([peak(orbit, place) for orbit in one.orbits]) for one in several]
    scale, unit = motion_for(place, [*peaks, *([] if cloud is None else [cloud[1]])])
    if cloud is not None:
        _draw_cloud(axis, cloud, scale)
    periods = [one.family.period for one in several]
    same = labels is None and len(set(periods)) == len(periods)  # colours: a period has the same on every figure
    colours = [own_colour(periods[i] - 1 if same else i) for i in range(len(several))]
    names = _labels(several) if labels is None else labels
    for one, heights, colour, label in zip(several, peaks, colours, names, strict=True):
        _draw_branch(axis, one, scale * heights, colour, verbatim(label))
    _draw_ends(axis, several, place, scale)
    linear = _draw_linear(axis, several, place, colours, scale)
    _draw_backbones(axis, several, place, scale)
    if axes is None and len(linear):
        _widen(axis, linear)
    name = several[0].family.name
    axis.set(xlabel=entry(axis_name(name, model.scene), ALONG), ylabel=f"max |{displacement_name(place)}| / {unit}")
    handles, words = _entries(axis, several)
    legend(axis, axes is None, "outside right upper", handles=handles, labels=words, fontsize=8)
    return figure


@styled
def bifurcation(found: Bifurcation, axes: Axes | None = None) -> Figure:
    """Largest |u| of every settled period against the parameter; `axes` to draw into, None makes a figure."""
    figure, (axis,) = sheet(1, 1, (8.4, 3.8), axes)
    peaks = found.cloud()[1]
    scale, unit = motion_for(found.z, peaks)
    _draw_cloud(axis, found.cloud(), scale)
    axis.set(xlabel=entry(found.title, ALONG), ylabel=f"max |{displacement_name(found.z)}| / {unit}")
    return figure


def peak(orbit: Orbit, z: Any) -> float:
    """Largest |u| at z over a period, m."""
    lowest, highest = orbit.extremes(z)
    return max(-lowest, highest)


def _draw_cloud(axis: Axes, cloud: tuple[Vector, Vector], scale: float) -> None:
    """(parameter, |u|) of runs."""
    axis.plot(cloud[0], scale * cloud[1], ".", color=GREY, markersize=2.0, label="simulated", rasterized=True)


def _labels(several: list[Branch]) -> list[str]:
    """Periods of branches; where two are the same, with the one number in which their scenes differ."""
    periods = [f"period {one.family.period}" for one in several]
    if len(set(periods)) == len(periods):
        return periods
    scenes = [one.family.model.scene for one in several]
    known = [scalars(one) for one in scenes]
    shared = [path for path in known[0] if path != several[0].family.name and all(path in one for one in known)]
    apart = [path for path in shared if len({one[path] for one in known}) > 1]
    if len(apart) != 1:
        return periods
    name, _, unit = axis_name(apart[0], scenes[0]).partition(" / ")
    values = [f"{name} {one[apart[0]]:.4g} {unit}".rstrip() for one in known]
    return values if len(set(periods)) == 1 else [f"{a}, {b}" for a, b in zip(periods, values, strict=True)]


def _draw_branch(axis: Axes, one: Branch, peaks: Vector, color: str, label: str) -> None:
    """Solid and dashed pieces of a branch, and its marks."""
    parameter, stable = one.parameter, one.stable
    unstable = ~stable
    unstable[:-1] |= unstable[1:]  # a dashed piece begins at the last stable orbit
    unstable[1:] |= ~stable[:-1]
    merging = np.array([orbit.mark == "merging" for orbit in one.orbits])
    jumps = 1 + np.flatnonzero(merging[:-1] & merging[1:])
    for chosen, style in ((stable, {"linestyle": "-", "label": label}), (unstable, {"linestyle": "--", "lw": 0.8})):
        heights = np.insert(np.where(chosen, peaks, np.nan), jumps, np.nan)
        axis.plot(np.insert(parameter, jumps, np.nan), heights, color=color, **style)
    for orbit, height in zip(one.orbits, peaks, strict=True):
        if orbit.mark:
            axis.plot(orbit.parameter, height, **_look(orbit.mark))


def _draw_ends(axis: Axes, several: list[Branch], z: Any, scale: float) -> None:
    """A bar at the end of the span, elsewhere a mark for each reason; a closed branch has no end."""
    ends = [(orbit, why.split(":")[0]) for one in several for orbit, why in one.ends]
    reasons = [why for why in dict.fromkeys(why for _, why in ends) if why not in (SPAN, CLOSED)]
    marks = {SPAN: ("|", GREY), **{why: (mark, RED) for why, mark in zip(reasons, ENDS, strict=False)}}
    labelled = set()
    for orbit, why in ends:
        if why in marks:
            label = None if why in labelled else verbatim(f"end: {why}")
            mark, colour = marks[why]
            height = scale * peak(orbit, z)
            axis.plot(orbit.parameter, height, mark, color=colour, markersize=8, zorder=3, label=label)
            labelled.add(why)


def _along_the_load(one: Branch) -> str:
    """The path of a scene's only load, if its frequency is what varies; else nothing."""
    path = one.family.name.removesuffix(".omega")
    return path if path != one.family.name and list(signals_of(one.family.model.scene)) == [path] else ""


def _span(several: list[Branch]) -> tuple[float, float]:
    """Lowest and highest parameter."""
    return min(min(one.parameter) for one in several), max(max(one.parameter) for one in several)


def _draw_linear(axis: Axes, several: list[Branch], z: Any, colours: list[str], scale: float) -> Vector:
    """The linear response of every level along the frequency of the only load; all its heights (k,).

    Of elements with sliders both limits: stuck, which small motions come to, and slipping, which large ones do.
    """
    heights = np.empty(0)
    for slipping in (False, True) if _sliders(several) else (False,):
        curves: list[tuple[Vector, Vector, str]] = []
        for one, colour in zip(several, colours, strict=True):
            found = _linear_curve(one, _span(several), z, slipping, scale)
            if found and not any(len(y) == len(found[1]) and np.allclose(found[1], y) for _, y, _ in curves):
                curves.append((*found, colour))
        style, name = LIMITS[slipping][len(curves) > 1], _linear_name(several, slipping)
        for omega, y, colour in curves:
            _behind(axis, omega, y, style, name if len(curves) == 1 else None, GREY if len(curves) == 1 else colour)
        if len(curves) > 1:
            _behind(axis, np.empty(0), np.empty(0), style, name)
        heights = np.concatenate([heights, *(y for _, y, _ in curves)])
    return heights


def _linear_curve(
    one: Branch, span: tuple[float, float], z: Any, slipping: bool, scale: float
) -> tuple[Vector, Vector] | None:
    """(omega, |u| on the axis) of a branch's linear response, if the frequency of its only load is what varies."""
    model, path = one.family.model, _along_the_load(one)
    if not path:
        return None
    omega = frequencies(model, *span, BEHIND)
    H = model.frequency_response(omega, path, z, slipping=slipping)
    return omega, scale * H.amplitude * abs(signals_of(model.scene)[path].amplitude)


def _contact_rows(several: list[Branch]) -> list[Any]:
    """Contacts and elements of all their models."""
    return [row for one in several for row in one.family.model.contact_rows]


def _sliders(several: list[Branch]) -> bool:
    """Whether an element slips or yields."""
    return any(row.always and row.remembers and row.law.reach > 0.0 for row in _contact_rows(several))


def _linear_name(several: list[Branch], slipping: bool = False) -> str:
    """What the linear response leaves out: contacts are open, sliders stick or slip, others with memory are elastic."""
    rows = _contact_rows(several)
    words = ("slipping", "yielding") if slipping else ("stuck", "elastic")
    held = {words["slip" not in row.law.events] for row in rows if row.always and row.remembers}
    said = ["no contact"] * any(not row.always for row in rows) + [f"elements {' or '.join(sorted(held))}"] * bool(held)
    return ", ".join(["linear", *said])


def _draw_backbones(axis: Axes, several: list[Branch], z: Any, scale: float) -> None:
    """The backbone of the lowest mode for each period, as high as the branches."""
    from fembeam.response import backbone

    model, (low, high) = several[0].family.model, _span(several)
    if not (_along_the_load(several[0]) and model.contact_rows):
        return
    heights = np.linspace(0.0, axis.dataLim.y1, BEHIND // 2)[1:]
    for i, period in enumerate(sorted({one.family.period for one in several})):
        along = period * backbone(model, z, heights / scale)
        shown = (along >= low) & (along <= high)
        if shown.any():
            _behind(axis, np.where(shown, along, np.nan), heights, "-.", None if i else "backbone of the lowest mode")


def _behind(axis: Axes, x: Vector, y: Vector, style: Any, label: str | None, colour: str = GREY) -> None:
    """A thin line that does not widen the limits."""
    from matplotlib.lines import Line2D

    axis.add_artist(Line2D(x, y, color=colour, linestyle=style, linewidth=0.8, zorder=1, label=label))


def _widen(axis: Axes, heights: Vector) -> None:
    """Limits that hold curves behind, too; a logarithmic axis where they reach far above the branches."""
    low, high = axis.get_ylim()
    least, most = (f(axis.dataLim.intervaly[i], f(heights)) for i, f in enumerate((min, max)))
    if most > FAR * axis.dataLim.y1 and axis.dataLim.minposy > 0.0:
        axis.set_yscale("log")
        axis.set_ylim(0.8 * max(least, axis.dataLim.minposy * 1e-3), 1.25 * most)
        plain_decades(axis.yaxis, *axis.get_ylim())
    else:
        axis.set_ylim(min(low, 0.95 * least), max(high, 1.05 * most))


def _entries(axis: Axes, several: list[Branch]) -> tuple[list[Any], list[str]]:
    """Handles and labels of a legend: branches, the dashes' meaning, the marks that occur."""
    from matplotlib.lines import Line2D

    handles, labels = axis.get_legend_handles_labels()
    kinds = {orbit.mark for one in several for orbit in one.special}
    if any(not np.all(one.stable) for one in several):
        handles.append(Line2D([], [], color=GREY, linestyle="--", linewidth=0.8))
        labels.append("unstable")
    known = [kind for kind in MARKS if kind in kinds]
    handles += [Line2D([], [], **_look(kind)) for kind in known]
    return handles, labels + known


def _look(kind: str) -> dict[str, Any]:
    """How the mark of a special orbit is drawn."""
    marker, edge = MARKS[kind]
    face = "white" if marker != "x" else edge
    return {"marker": marker, "linestyle": "", "color": edge, "markerfacecolor": face, "markersize": 3.5}


@styled
def orbit(one: Orbit, z: Any = None, axes: Sequence[Axes] | None = None) -> Figure:
    """One orbit at z (m; None: the first stop): time history with its contacts shaded, and phase portrait.

    Parameters
    ----------
    one : to draw. z : m. axes : two to draw into; None makes a figure.

    Examples
    --------
    >>> import fembeam as fb
    >>> from contacts import Hertz
    >>> beam = fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01))
    >>> stops, drive, damping = [fb.Stop(0.5, Hertz(1e9))], fb.Harmonic(1e-3, 150.0), fb.ModalDamping(0.05)
    >>> model = fb.Scene(beam, [fb.Clamped(0.0)], stops=stops, base=drive, damping=damping).reduce(modes=2)
    >>> [axis.get_xlabel() for axis in orbit(model.orbit()).axes]
    ['t / ms', 'u / mm']
    """
    place = observed(one.model) if z is None else z
    figure, (left, right) = sheet(1, 2, (6.4, 2.8), axes, width_ratios=[3, 2])
    t, u, v = one.run.t, one.run.displacement(place), one.run.velocity(place)
    (scale, unit), (tick, second) = motion_for(place, u), unit_for(t, "s", usual=-3)
    rate, speed = unit_for(v, "rad/s" if turns_at(place) else "m/s")
    u, v = scale * u, rate * v
    left.plot(tick * t, u)
    for t_in, t_out in zip(one.contacts.t_in, one.contacts.t_out, strict=True):
        end = t_out if np.isfinite(t_out) else t[-1]
        for earlier in (0.0, t[-1] - t[0]):  # what goes on beyond the period stands at its beginning
            band = np.clip([t_in - earlier, end - earlier], t[0], t[-1])
            if band[0] < band[1]:
                left.axvspan(*tick * band, color=ORANGE, alpha=0.4, linewidth=0.8)
    left.set(xlabel=f"t / {second}", ylabel=f"{displacement_name(place)} / {unit}")
    right.plot(u, v)
    right.plot(u[:1], v[:1], "o", color=RED, markersize=3)
    right.set(xlabel=f"u / {unit}", ylabel=f"velocity / {speed}")
    kind = "stable" if one.stable else "unstable"
    at = "" if np.isnan(one.parameter) else f" at {one.parameter:.6g}"
    title = f"Period {one.period}, {counted(len(one.contacts), 'contact')}, {kind}{at}"
    heading([left], title, axes is None, weight="normal")
    return figure
