"""Figures of contact laws: loops of force against indentation, nominal against achieved restitution, a fit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from contacts import PUBLISHED, Bounce, Hysteretic, Identified, KelvinVoigt, Law, Viscoelastic, bounce, restitution
from fembeam.plot.figure import heading, legend, sheet
from fembeam.plot.style import BLUE, GREY, RED, Vector, entry, logarithmic, own_line, styled, verbatim
from fembeam.plot.units import length_for, unit_for
from fembeam.support import require

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike

    from fembeam.study import Equivalent

POINTS = 100  # between two turning points of a path
ROWS = 18  # of a legend, as high as the figure


@styled
def loops(laws: Mapping[str, Law], entry_rate: float = 1.0, mass: float = 1.0, axes: Axes | None = None) -> Figure:
    """Force against indentation while a free mass bounces off each law.

    Parameters
    ----------
    laws : by the name to show.
    entry_rate, mass : of the bounce, m/s and kg.
    axes : to draw into; None makes a figure.

    Notes
    -----
    The area of a loop is the energy lost, ½ m v² (1 - e²); the legend gives the achieved restitution e.

    Examples
    --------
    >>> figure = loops({"Flores": Hysteretic.flores(1e8, restitution=0.5)})
    >>> figure.axes[0].get_ylabel()
    'contact force / N'
    """
    require(bool(laws), "nothing to draw", laws, "plot.loops", "give laws by name, {name: law}")
    thrown = {name: bounce(law, entry_rate, mass) for name, law in laws.items()}
    curves = {f"{name}: e = {one.restitution:.3f}": _traced(laws[name], one, mass) for name, one in thrown.items()}
    title = f"Bounce of {mass:g} kg at {entry_rate:g} m/s, achieved restitution e"
    return _drawn(curves, ("indentation δ", "contact force"), title, axes)


@styled
def hysteresis(laws: Mapping[str, Law], path: ArrayLike | None = None, axes: Axes | None = None) -> Figure:
    """Force along a slow path of δ for laws with memory: their loops.

    Parameters
    ----------
    laws : by the name to show.
    path : (k,) m, turning points; None takes four growing cycles, up to all of each law's memory.
    axes : to draw into; None makes a figure.

    Notes
    -----
    The area of a loop is the energy lost in it. Raises ValueError without a path for a law that has no size of its
    own, as `contacts.WaltonBraun`.

    Examples
    --------
    >>> from contacts import Jenkins
    >>> figure = hysteresis({"damper": Jenkins(2e4, 10.0)})
    >>> figure.axes[0].get_xlabel()
    'δ / mm'
    """
    require(bool(laws), "nothing to draw", laws, "plot.hysteresis", "give laws by name, {name: law}")
    paths = {name: _turns(name, law, path) for name, law in laws.items()}
    curves = {name: (paths[name], law.along(paths[name])) for name, law in laws.items()}
    return _drawn(curves, ("δ", "force"), "Force along a slow path", axes)


@styled
def equivalent(found: Equivalent, axes: Sequence[Axes] | None = None) -> Figure:
    """Energy per cycle, equivalent stiffness and loss factor of a law over amplitude; see `study.equivalent`.

    Parameters
    ----------
    found : what to draw. axes : three to draw into; None makes a figure.
    """
    figure, three = sheet(1, 3, (8.4, 2.6), axes)
    columns = (found.energy, found.stiffness, found.loss_factor)
    names = ("energy per cycle / J", "equivalent stiffness / N/m", "loss factor")
    scale, unit = length_for(found.amplitude)
    for axis, values, name in zip(three, columns, names, strict=True):
        axis.plot(scale * found.amplitude, values, marker="o" if len(values) == 1 else None)
        logarithmic(axis, found.amplitude)
        axis.set(xlabel=f"amplitude of δ / {unit}", ylabel=name)
        axis.set_ylim(bottom=min(0.0, float(np.nanmin(values))))
    heading(three, f"{verbatim(found.name)} as a spring and a dashpot", axes is None)
    return figure


@styled
def restitutions(axes: Sequence[Axes] | None = None) -> Figure:
    """Achieved against nominal restitution for every constructor that takes one: what the published formulas do.

    Parameters
    ----------
    axes : two to draw into; None makes a figure.

    Notes
    -----
    `KelvinVoigt.anagnostopoulos` does as `Viscoelastic.tsuji`: exact, and on the same line with ``clamp=True``.
    """
    figure, (whole, near) = sheet(1, 2, (7.0, 5.0), axes)
    nominal = np.linspace(0.02, 1.0, 99)
    makers = {name: getattr(Hysteretic, name) for name in PUBLISHED if name not in ("zhang_sharf", "achieving")}
    lines = {name: [restitution(make(1e8, e)) for e in nominal] for name, make in makers.items()}
    lines["jankowski"] = [restitution(Viscoelastic.jankowski(1e8, e, mass=1.0)) for e in nominal]
    clamped = [restitution(KelvinVoigt.anagnostopoulos(1e6, e, mass=1.0, clamp=True)) for e in nominal]
    lines["tsuji with clamp=True"] = clamped
    exact = "achieving, zhang_sharf, tsuji"
    whole.plot([0, 1], [0, 1], color=GREY, linewidth=4, alpha=0.4, label=exact)
    near.axhline(0.0, color=GREY, linewidth=4, alpha=0.4)
    for number, (name, achieved) in enumerate(lines.items()):
        whole.plot(nominal, achieved, **own_line(number), label=name)
        near.plot(nominal, np.array(achieved) - nominal, **own_line(number))
    whole.set(xlim=(0, 1), ylim=(0, 1), xlabel="nominal restitution", ylabel="achieved by a free mass")
    near.set(xlim=(0, 1), ylim=(-0.05, 0.1), xlabel="nominal restitution", ylabel="achieved - nominal")
    legend(whole, axes is None, "outside lower center", ncols=3 if axes is None else 1)
    return figure


@styled
def identification(found: Identified, axes: Sequence[Axes] | None = None) -> Figure:
    """Measured and fitted loops of every collision, and the residuals; into two `axes` where they are given."""
    figure, (above, below) = sheet(2, 1, (7.0, 4.8), axes, sharex=True, height_ratios=[2, 1])
    scale, unit = unit_for([one.force for one in found.collisions], "N")
    per_length, of_length = length_for([one.delta for one in found.collisions])
    for number, one in enumerate(found.collisions):
        delta, (measured, fitted) = per_length * one.delta, ("measured", "fitted") if number == 0 else (None, None)
        above.plot(delta, scale * one.force, ".", color=BLUE, markersize=3, label=measured)
        below.plot(delta, scale * (one.force - one.fitted), ".", color=BLUE, markersize=3)
        order = np.flatnonzero(one.delta > 0.0)
        above.plot(delta[order], scale * one.fitted[order], color=RED, label=fitted)
    below.axhline(0.0, color=GREY, linewidth=0.6)
    for sign in (-2.0, 2.0):
        below.axhline(sign * scale * found.noise, color=GREY, linewidth=0.6, linestyle="--")
    above.set_ylabel(f"contact force / {unit}")
    above.legend(loc="upper left")
    below.set_ylabel(f"residual / {unit}")
    below.set_xlabel(f"indentation δ / {of_length}, offsets taken off; dashed: two standard deviations of the noise")
    p, a, r = found.exponent.value, found.damping_factor, found.restitution
    title = f"K = {found.stiffness.value:.4g} N/m^{p:.3g}, a = {a.value:.3g} ({a.low:.3g} to {a.high:.3g}), "
    title += f"restitution {r.value:.3g} ({r.low:.3g} to {r.high:.3g})"
    heading([above], title, axes is None)
    return figure


def _drawn(
    curves: Mapping[str, tuple[Vector, Vector]], words: tuple[str, str], title: str, axes: Axes | None
) -> Figure:
    """Curves (δ, F) by name, under two names of the axes."""
    figure, (axis,) = sheet(1, 1, (7.0, 4.2), axes)
    scale, unit = unit_for([force for _, force in curves.values()], "N")
    per_length, of_length = length_for([delta for delta, _ in curves.values()])
    for number, (name, (delta, force)) in enumerate(curves.items()):
        axis.plot(per_length * delta, scale * force, **own_line(number), label=entry(name))
    axis.axhline(0.0, color=GREY, linewidth=0.6)
    axis.set(xlabel=f"{words[0]} / {of_length}", ylabel=f"{words[1]} / {unit}")
    legend(axis, axes is None, "outside right center", ncols=-(-len(curves) // ROWS))
    heading([axis], title, axes is None)
    return figure


def _turns(name: str, law: Law, path: ArrayLike | None) -> Vector:
    """A path through turning points, with points enough between them to look smooth."""
    if path is None:
        need = "give turning points in m, path=[0, 1e-3, 0]"
        require(law.reach > 0.0, "there is no path for a law without a size of its own", name, "plot.hysteresis", need)
        turns = np.append(0.0, law.reach * np.repeat([0.25, 0.5, 0.75, 1.0], 2) * np.tile([1.0, -1.0], 4))
    else:
        turns = np.asarray(path, dtype=float)
    places = np.linspace(0.0, turns.size - 1.0, POINTS * (turns.size - 1) + 1)
    return np.interp(places, np.arange(turns.size), turns)


def _traced(law: Law, thrown: Bounce, mass: float) -> tuple[Vector, Vector]:
    """(δ, F) of a bounce, dense enough to look smooth, by cubics between its samples."""
    from scipy.interpolate import CubicHermiteSpline

    t = np.linspace(0.0, thrown.t[-1], 600)
    delta = CubicHermiteSpline(thrown.t, thrown.delta, thrown.delta_dot)(t)
    delta_dot = CubicHermiteSpline(thrown.t, thrown.delta_dot, -thrown.force / mass)(t)
    return delta, law.force(np.maximum(delta, 1e-300), delta_dot, thrown.delta_dot[0])
