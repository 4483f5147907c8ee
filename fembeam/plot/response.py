"""Figures of runs and models, as matplotlib Figures that need no display: save them with `figure.savefig(path)`.

Displacements are shown in mm, times in s, spectra one-sided and per rad/s. A run that did not finish says so
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

from typing import TYPE_CHECKING

import numpy as np

from fembeam.model import places
from fembeam.plot.style import BLUE, GREY, ORANGE, RED, Vector, sheet, styled, titled
from fembeam.statistics import moments, pdf

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fembeam.model import Model, Run


@styled
def time_history(run: Run, window: tuple[float, float] | None = None, z: float | None = None) -> Figure:
    """Displacement and contact force over a readable window, contacts shaded.

    Parameters
    ----------
    run : with at least 2 samples.
    window : (from, to) in s; None: the last eight periods of the lowest mode (or 400 samples).
    z : where, in m; None: the tip.

    Notes
    -----
    Between samples the displacement is the cubic through values and rates. The force is drawn as sampled where a
    contact has ten samples, else as the logged peak of each contact.
    """
    lo, hi = window or _last_window(run)
    if z is None:
        name, z = next(iter(places(run.shapes).items()))
    else:
        name = f"z = {z:.4g} m"
    figure, axes = sheet(run, 2 if len(run.stops) else 1, 1, (7.0, 4.2), sharex=True)
    t, u = _between_samples(run, z, lo, hi)
    axes[0].plot(t, 1e3 * u, color=BLUE)
    axes[0].set_ylabel("displacement / mm")
    if len(run.stops):
        _shade_contacts(axes, run, lo, hi)
        _draw_forces(axes[1], run, lo, hi)
    axes[-1].set_xlabel("time / s")
    axes[-1].set_xlim(lo, hi)
    shaded = ", contacts shaded" if len(run.stops) else ""
    return titled(figure, run, f"Displacement at {name} relative to the frame{shaded}")


@styled
def densities(run: Run, discard: float = 0.0) -> Figure:
    """Probability densities of δ (or the tip) and mid-beam against the Gaussian of the same mean and deviation."""
    signals = responses(run, discard)
    figure, axes = sheet(run, 1, len(signals), (7.0, 3.1))
    for axis, (name, values) in zip(axes, signals.items(), strict=True):
        x, density = pdf(1e3 * values)
        found = moments(1e3 * values)
        axis.fill_between(x, density, step="mid", color=BLUE, alpha=0.3, linewidth=0)
        axis.step(x, density, where="mid", color=BLUE, label="simulated")
        wide = np.linspace(-5, 5, 301)
        normal = np.exp(-0.5 * wide**2) / (found.std * np.sqrt(2 * np.pi))
        axis.plot(found.mean + wide * found.std, normal, color=RED, linestyle="--", label="Gaussian")
        axis.set_title(f"{name}: skewness {found.skewness:.2f}, kurtosis {found.kurtosis:.2f}")
        axis.set_xlabel(f"{name} / mm")
        axis.set_xlim(found.mean - 5 * found.std, found.mean + 5 * found.std)
        axis.set_ylim(bottom=0)
    axes[0].set_ylabel("probability density / mm⁻¹")
    axes[0].legend(loc="upper left")
    return titled(figure, run, "Probability densities against the Gaussian of the same mean and deviation")


@styled
def mode_shapes(model: Model) -> Figure:
    """The first modes (at most six), scaled to 1, with supports, stops and masses at their places."""
    figure, (axis,) = sheet(None, 1, 1, (7.0, 3.4))
    z = np.linspace(0.0, model.scene.beam.length, 401)
    shapes = model.phi(z)
    scale = np.abs(shapes).max(axis=0)
    axis.axhline(0.0, color=GREY, linewidth=0.6)
    for i in np.flatnonzero(scale)[:6]:  # other bodies' modes do not move this beam
        label = f"mode {model.names[i]}: {model.omega[i]:.4g} rad/s, ζ = {model.zeta[i]:.3g}"
        axis.plot(1e3 * z, shapes[:, i] / scale[i], label=label)
    _mark_features(axis, model)
    axis.set_xlabel("z / mm")
    axis.set_ylabel("φ / max |φ|")
    axis.set_ylim(-1.25, 1.25)
    figure.legend(*axis.get_legend_handles_labels(), loc="outside right upper")
    return titled(figure, None, "Mode shapes of the linear beam")


def responses(run: Run, discard: float = 0.0) -> dict[str, Vector]:
    """Signals worth a density, m: δ of the first stop (the tip when there is none) and mid-beam."""
    kept = run.t >= discard
    named = places(run.shapes)
    first = {"δ": run.indentation(0)} if len(run.stops) else {}
    if not first and "tip" in named:
        first = {"tip u": run.displacement(named["tip"])}
    return {name: x[kept] for name, x in {**first, "mid-beam u": run.displacement(named["mid-beam"])}.items()}


def sampling_of(run: Run) -> float:
    """Output sampling, s."""
    return float(run.t[1] - run.t[0])


def _last_window(run: Run) -> tuple[float, float]:
    """The last eight periods of the lowest mode that swings, or 400 samples."""
    end = float(run.t[-1])
    swinging = [] if run.model is None else [omega for omega in run.model.omega if omega > 0]
    length = 8 * 2 * np.pi / min(swinging) if swinging else 400 * sampling_of(run)
    return max(float(run.t[0]), end - length), end


def _between_samples(run: Run, z: float, lo: float, hi: float) -> tuple[Vector, Vector]:
    """(t, u) on a grid eight times finer than the samples, by cubics through values and rates."""
    from scipy.interpolate import CubicHermiteSpline

    first, last = np.searchsorted(run.t, [lo, hi])
    kept = slice(max(0, first - 1), last + 1)
    t, shape = run.t[kept], run.shapes(z)
    fine = np.linspace(t[0], t[-1], 8 * (len(t) - 1) + 1)
    return fine, CubicHermiteSpline(t, run.q[kept] @ shape, run.q_dot[kept] @ shape)(fine)


def _shade_contacts(axes: list[Axes], run: Run, lo: float, hi: float) -> None:
    """A band for every contact in the window."""
    left, right = run.contacts.t_in, np.where(np.isnan(run.contacts.t_out), run.t[-1], run.contacts.t_out)
    for index in np.flatnonzero((right > lo) & (left < hi)):
        for axis in axes:
            axis.axvspan(left[index], right[index], color=ORANGE, alpha=0.4, linewidth=0.8)


def _draw_forces(axis: Axes, run: Run, lo: float, hi: float) -> None:
    """The force of every stop: as sampled, or as peaks where samples are too coarse for it."""
    log = run.contacts
    inside = (log.t_in < hi) & ~(log.t_out < lo)
    lasting = (log.t_out - log.t_in)[inside & np.isfinite(log.t_out)]
    if len(lasting) and np.median(lasting) < 10 * sampling_of(run):
        for stop in np.unique(log.stop[inside]):
            mine = inside & (log.stop == stop)
            axis.vlines(
                log.t_in[mine], 0.0, log.peak_force[mine], color=f"C{stop}", linewidth=1.2, label=f"stop {stop}"
            )
        axis.set_ylabel("peak contact force / N")
    else:
        kept = (run.t >= lo) & (run.t <= hi)
        for stop in range(len(run.stops)):
            axis.plot(run.t[kept], run.force(stop)[kept], color=f"C{stop}", label=f"stop {stop}")
        axis.set_ylabel("contact force / N")
    if len(run.stops) > 1:
        axis.legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=len(run.stops), borderaxespad=0.0)
    axis.set_ylim(bottom=min(0.0, axis.get_ylim()[0]))


def _mark_features(axis: Axes, model: Model) -> None:
    """Supports as squares, masses as circles, stops as triangles on their side of the beam."""
    scene = model.scene
    marks: list[tuple[str, list[tuple[float, float]], str, str]] = [
        ("support", [(s.z, 0.0) for s in scene.supports], "s", "black"),
        ("mass", [(m.z, 0.0) for m in scene.masses], "o", GREY),
        ("stop below", [(s.z, -0.13) for s in scene.stops if s.push > 0], "^", "black"),
        ("stop above", [(s.z, 0.13) for s in scene.stops if s.push < 0], "v", "black"),
    ]
    for label, points, marker, colour in marks:
        if points:
            z, height = np.array(points).T
            axis.plot(1e3 * z, height, marker, color=colour, label=label, clip_on=False, markersize=7)
