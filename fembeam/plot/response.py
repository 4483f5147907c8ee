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
>>> [axis.get_ylabel() for axis in spectrum(run, discard=0.2).axes]
['PSD / m² s rad⁻¹', 'PSD / m² s rad⁻¹']
>>> [axis.get_xlabel() for axis in densities(run, discard=0.2).axes]
['δ / mm', 'mid-beam u / mm']
>>> contacts(run).axes[3].get_xlabel(), mode_shapes(model).axes[0].get_xlabel()
('entry speed / m s⁻¹', 'z / mm')
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import wraps
from typing import TYPE_CHECKING, Any, ParamSpec

import numpy as np
from numpy.typing import NDArray

from fembeam.model import places
from fembeam.statistics import moments, pdf, psd
from fembeam.statistics.spectra import FINEST_RESOLUTION

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fembeam.model import Model, Run
    from fembeam.statistics import Spectrum

Vector = NDArray[np.float64]
P = ParamSpec("P")

BLUE, RED, GREEN, ORANGE, GREY = "#0072B2", "#D55E00", "#009E73", "#E69F00", "#777777"  # Okabe and Ito
STYLE = {
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "axes.prop_cycle": "cycler('color', ['#0072B2', '#D55E00', '#009E73', '#E69F00', '#CC79A7', '#56B4E9'])",
    "lines.linewidth": 1.0,
    "legend.frameon": False,
    "figure.dpi": 120,
}
MOST_DOTS = 4000
LABEL_WIDTH = 0.05  # of the axis, taken up by a frequency of four digits


def styled(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Draw in the library's style, and leave the user's settings alone."""

    @wraps(draw)
    def inside(*args: P.args, **kwargs: P.kwargs) -> Figure:
        from matplotlib import rc_context

        with rc_context(STYLE):  # type: ignore[arg-type]
            return draw(*args, **kwargs)

    return inside


def segment_for(samples: int, dt: float) -> int:
    """Welch segment: an eighth of a short signal, `FINEST_RESOLUTION` on a long one."""
    return max(8, min(samples // 8, int(np.ceil(2 * np.pi / (FINEST_RESOLUTION * dt)))))


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
    figure, axes = _sheet(run, 2 if len(run.stops) else 1, 1, (7.0, 4.2), sharex=True)
    t, u = _between_samples(run, z, lo, hi)
    axes[0].plot(t, 1e3 * u, color=BLUE)
    axes[0].set_ylabel("displacement / mm")
    if len(run.stops):
        _shade_contacts(axes, run, lo, hi)
        _draw_forces(axes[1], run, lo, hi)
    axes[-1].set_xlabel("time / s")
    axes[-1].set_xlim(lo, hi)
    shaded = ", contacts shaded" if len(run.stops) else ""
    return _titled(figure, run, f"Displacement at {name} relative to the frame{shaded}")


@styled
def spectrum(run: Run, discard: float = 0.0, omega_max: float | None = None) -> Figure:
    """Power spectral densities: base motion, indentation δ of the first stop (or the tip), mid-beam.

    Parameters
    ----------
    run : with at least 64 samples after `discard`.
    discard : s at the beginning to leave out.
    omega_max : rad/s, end of the axis; None: 2.5 times the highest frequency kept.

    Notes
    -----
    Dotted lines are the natural frequencies of the linear model, numbers the peaks of the first curve.
    """
    figure, (upper, lower) = _sheet(run, 2, 1, (7.0, 5.2), sharex=True)
    spectra = spectra_of(run, discard)
    response = {name: s for name, s in spectra.items() if name != "base y"}
    top = omega_max or _axis_end(run, next(iter(response.values())))
    main, *others = response
    for axis, names in ((upper, [n for n in ("base y", main) if n in spectra]), (lower, others or [main])):
        for name in names:
            colour = {"base y": GREY, main: BLUE}.get(name, GREEN)
            axis.semilogy(*_drawable(spectra[name], top), color=colour, label=name)
        axis.set_ylabel("PSD / m² s rad⁻¹")
        axis.legend(loc="upper right")
        _fit_levels(axis, [spectra[name] for name in names if name != "base y"], top)
    _mark_peaks(upper, spectra[main], top)
    _mark_frequencies((upper, lower), run, top)
    lower.set_xlabel("ω / rad s⁻¹")
    lower.set_xlim(0, top)
    line = spectra[main]
    lasting = np.count_nonzero(run.t >= discard) * _dt(run)
    about = f"{lasting:.4g} s, {line.n_segments} segments, lines {line.omega[1]:.2g} rad/s apart"
    return _titled(figure, run, f"Power spectral densities ({about})")


@styled
def densities(run: Run, discard: float = 0.0) -> Figure:
    """Probability densities of δ (or the tip) and mid-beam against the Gaussian of the same mean and deviation."""
    signals = responses(run, discard)
    figure, axes = _sheet(run, 1, len(signals), (7.0, 3.1))
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
    return _titled(figure, run, "Probability densities against the Gaussian of the same mean and deviation")


@styled
def contacts(run: Run, discard: float = 0.0) -> Figure:
    """Histograms of duration, peak force and entry speed, and restitution (exit over entry speed) per contact.

    Only contacts that began after `discard` and ended count. Raises ValueError when there is none.
    """
    log = run.contacts
    kept = np.isfinite(log.t_out) & (log.t_in >= discard)
    if not np.any(kept):
        raise ValueError("the run has no finished contact to draw")
    figure, axes = _sheet(run, 2, 2, (7.0, 4.8))
    for axis, values, label in (
        (axes[0], 1e3 * (log.t_out - log.t_in)[kept], "duration / ms"),
        (axes[1], log.peak_force[kept], "peak force / N"),
        (axes[2], log.speed_in[kept], "entry speed / m s⁻¹"),
    ):
        _histogram(axis, values, label)
    _restitutions(axes[3], log.speed_in[kept], log.speed_out[kept])
    span = float(run.t[-1]) - discard
    return _titled(figure, run, f"{np.count_nonzero(kept)} contacts, {np.count_nonzero(kept) / span:.3g} per second")


@styled
def mode_shapes(model: Model) -> Figure:
    """The first modes (at most six), scaled to 1, with supports, stops and masses at their places."""
    figure, (axis,) = _sheet(None, 1, 1, (7.0, 3.4))
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
    return _titled(figure, None, "Mode shapes of the linear beam")


def responses(run: Run, discard: float = 0.0) -> dict[str, Vector]:
    """Signals worth a density, m: δ of the first stop (the tip when there is none) and mid-beam."""
    kept = run.t >= discard
    named = places(run.shapes)
    first = {"δ": run.indentation(0)} if len(run.stops) else {}
    if not first and "tip" in named:
        first = {"tip u": run.displacement(named["tip"])}
    return {name: x[kept] for name, x in {**first, "mid-beam u": run.displacement(named["mid-beam"])}.items()}


def spectra_of(run: Run, discard: float = 0.0) -> Mapping[str, Spectrum]:
    """Spectra of the base motion (where the run knows it) and of `responses`."""
    signals = {name: (x, _dt(run)) for name, x in responses(run, discard).items()}
    base = None if run.model is None else run.model.scene.base
    if base is not None and hasattr(base, "nodes"):  # a sum of many lines: by FFT on its own grid
        dt, values = base.nodes(float(run.t[-1]), 1e-3)
        signals["base y"] = values[:, 0], dt
    elif base is not None:
        signals["base y"] = np.asarray(base(run.t)), _dt(run)
    return {name: psd(x, dt, segment_for(x.size, dt)) for name, (x, dt) in signals.items()}


def _sheet(run: Run | None, rows: int, columns: int, size: tuple[float, float], **options: Any) -> tuple[Figure, Any]:
    """A figure with its axes as a flat list."""
    from fembeam.plot.figure import sheet

    return sheet(rows, columns, size, **options)


def _titled(figure: Figure, run: Run | None, title: str) -> Figure:
    """Set the title, with the status of a run that did not finish."""
    partial = run is not None and not run.complete
    figure.suptitle("Partial: " * partial + title, x=0.01, ha="left", fontsize=10, fontweight="bold")
    if run is not None and partial:
        figure.supxlabel(f"PARTIAL RESULT: {run.status}", color=RED, fontsize=8, wrap=True)
    return figure


def _dt(run: Run) -> float:
    """Output sampling, s."""
    return float(run.t[1] - run.t[0])


def _last_window(run: Run) -> tuple[float, float]:
    """The last eight periods of the lowest mode that swings, or 400 samples."""
    end = float(run.t[-1])
    swinging = [] if run.model is None else [omega for omega in run.model.omega if omega > 0]
    length = 8 * 2 * np.pi / min(swinging) if swinging else 400 * _dt(run)
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
    if len(lasting) and np.median(lasting) < 10 * _dt(run):
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


def _axis_end(run: Run, line: Spectrum) -> float:
    """2.5 times the highest frequency kept, within what the samples resolve."""
    highest = 0.0 if run.model is None else 2.5 * float(run.model.omega[-1])
    return float(min(highest or np.inf, line.omega[-1]))  # 0: rigid-body modes alone


def _drawable(line: Spectrum, top: float) -> tuple[Vector, Vector]:
    """The curve up to the end of the axis, without ω = 0 (the mean is gone) and without zeros."""
    kept = (line.omega > 0) & (line.omega <= top) & (line.density > 0)
    return line.omega[kept], line.density[kept]


def _fit_levels(axis: Axes, lines: list[Spectrum], top: float) -> None:
    """Limits from the responses, so that a band-limited input does not stretch the axis to rounding errors."""
    levels = np.concatenate([_drawable(line, top)[1] for line in lines])
    if len(levels):
        axis.set_ylim(max(levels.min(), 1e-9 * levels.max()) / 3, 10 * levels.max())


def peaks(line: Spectrum, omega_max: float = np.inf, count: int = 10) -> Vector:
    """Frequencies (rad/s, ascending) of the `count` most prominent peaks of a spectrum, lightly smoothed."""
    from scipy.ndimage import gaussian_filter1d
    from scipy.signal import find_peaks

    omega, density = _drawable(line, omega_max)
    smooth = gaussian_filter1d(np.log(density), max(2.0, 5.0 / line.omega[1]))
    scatter = 3 / np.sqrt(line.n_segments)  # of ln S; what stands out less may be chance
    found, about = find_peaks(smooth, prominence=max(0.3, scatter), distance=max(1, len(omega) // 30))
    best = found[np.argsort(about["prominences"])[::-1][:count]]
    return np.sort(omega[best])


def _mark_peaks(axis: Axes, line: Spectrum, top: float) -> None:
    """Write the frequency over every prominent peak, of close ones over the highest only."""
    omega, density = _drawable(line, top)
    heights = {float(peak): density[np.abs(omega - peak) < 15].max() for peak in peaks(line, top)}
    labelled: list[float] = []
    for peak in sorted(heights, key=lambda at: -heights[at]):
        if all(abs(peak - other) >= LABEL_WIDTH * top for other in labelled):
            labelled.append(peak)
            _note(axis, f"{peak:.0f}", (peak, heights[peak]), (0, 4), BLUE)


def _mark_frequencies(axes: tuple[Axes, ...], run: Run, top: float) -> None:
    """Dotted lines at the natural frequencies, named where there is room."""
    free = 0.0  # of labels, from here on
    for i, omega in enumerate([] if run.model is None else run.model.omega[run.model.omega < top]):
        for axis in axes:
            axis.axvline(omega, color=GREY, linestyle=":", linewidth=0.8, zorder=0)
        if omega < free:
            continue
        free = omega + 3 * LABEL_WIDTH * top
        _note(axes[-1], rf"$\omega_{{{i + 1}}}$ = {omega:.0f}", (omega, 0.03), (3, 0), GREY, ("data", "axes fraction"))


def _note(
    axis: Axes, text: str, at: tuple[float, float], shift: tuple[float, float], colour: str, frame: Any = "data"
) -> None:
    """A short text shifted (points) from a place, on a white ground so that no line runs through it."""
    ground = {"facecolor": "white", "linewidth": 0, "pad": 0.5, "alpha": 0.8}
    side = "left" if shift[0] else "center"
    axis.annotate(text, at, xytext=shift, xycoords=frame, textcoords="offset points", ha=side, fontsize=8,
                  color=colour, bbox=ground)  # fmt: skip


def _histogram(axis: Axes, values: Vector, label: str) -> None:
    """Counts up to the 99 % quantile, with the mean."""
    edges = np.histogram_bin_edges(values, 50, (0.0, float(np.quantile(values, 0.99))))
    axis.hist(values, edges.tolist(), color=BLUE, alpha=0.7)
    axis.axvline(values.mean(), color=RED, linestyle="--")
    axis.set_title(f"mean {values.mean():.3g} (dashed), largest {values.max():.4g}")
    axis.set_xlabel(f"{label}, without the top 1 %")
    axis.set_ylabel("contacts")


def _restitutions(axis: Axes, speed_in: Vector, speed_out: Vector) -> None:
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
    axis.set_xlabel("entry speed / m s⁻¹")
    axis.set_ylabel("exit / entry speed")


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
