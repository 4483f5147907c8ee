"""Spectra of a run, with the natural frequencies and the peaks marked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from fembeam.model import places
from fembeam.plot.axis_names import frequency_words
from fembeam.plot.figure import after, heading, sheet
from fembeam.plot.linear import frequencies
from fembeam.plot.run_signals import (
    after_discard,
    coordinates,
    estimated,
    first_stop,
    natural,
    place_of,
    responses,
    sampling_of,
    signal_name,
)
from fembeam.plot.style import BLUE, CYCLE, GREEN, GREY, Vector, curve, drawable, entry, fit_levels, short, styled
from fembeam.plot.units import density_label
from fembeam.response import frame_motion
from fembeam.scene import signals_of
from fembeam.statistics import Spectrum, psd
from fembeam.statistics.spectra import FEWEST_OF_SLOW, FINEST_RESOLUTION
from fembeam.structures import COMPONENTS, direction_of
from fembeam.support import require_positive

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fembeam.model import Run


LABEL_WIDTH = 0.05  # of the axis, taken up by a frequency of four digits
NAME_WIDTH, UPRIGHT = 0.13, 0.026  # of the axis, taken up by the name of a natural frequency, level and upright
LINEAR_POINTS = 2000
BASES = [f"base {component}" for component in COMPONENTS]
BASE_COLOURS = GREY, *(colour for colour in CYCLE if colour not in (BLUE, GREEN)), "black"


def segment_for(samples: int, dt: float) -> int:
    """Welch segment: an eighth of a short signal, `FINEST_RESOLUTION` on a long one, finer where motion is slow."""
    return max(8, min(samples // 8, max(FEWEST_OF_SLOW, int(np.ceil(2 * np.pi / (FINEST_RESOLUTION * dt))))))


@styled
def spectrum(
    run: Run, discard: float = 0.0, omega_max: float | None = None, axes: Sequence[Axes] | None = None
) -> Figure:
    """Power spectral densities: base motion, indentation δ of the first stop (or the tip), mid-beam.

    Parameters
    ----------
    run : with at least 64 samples after `discard`.
    discard : s at the beginning to leave out.
    omega_max : rad/s, end of the axis; None: 2.5 times the highest frequency kept.
    axes : two to draw into; None makes a figure.

    Notes
    -----
    Shaded: 95 % confidence, where the run holds at least four independent parts. Under one noise the response of the
    linear scene, |H|² S with all contacts open, is dashed. Dotted lines are the natural frequencies of the linear
    model and the frequencies of its static shapes, named at the top; numbers are the peaks of the first curve. Of a
    transient the levels hold for this stretch of time only: see `floor_spectrum`.
    """
    if omega_max is not None:
        require_positive("omega_max", omega_max, "plot.spectrum", "give rad/s")
    spectra, linear = spectra_of(run, discard), _linear(run)
    figure, (upper, lower) = sheet(2, 1, (7.0, 5.6), axes, sharex=True)
    bases = [name for name in spectra if name in BASES]
    main, *others = (name for name in spectra if name not in BASES)
    colours = {main: BLUE, **dict.fromkeys(others, GREEN), **dict(zip(bases, BASE_COLOURS, strict=False))}
    top = omega_max or _axis_end(run, spectra[main])
    for axis, names in ((upper, [*bases, main]), (lower, others or [main])):
        behind = [linear[name] for name in names if name in linear]
        for name in names:
            curve(axis, spectra[name], top, color=colours[name], label=entry(signal_name(run, name)))
        for line in behind:  # thin, and in front: where both agree both are seen
            curve(axis, line, top, color="black", linestyle="--", linewidth=0.7, label="linear, no contact")
        axis.set_ylabel(density_label(spectra[name].unit for name in names))
        axis.legend(loc="upper right")
        fit_levels(axis, [spectra[name] for name in names if name not in BASES], top, behind)
    _mark_peaks(upper, spectra[main], top)
    _mark_frequencies((upper, lower), run, top)
    lower.set(xlabel="ω / rad s⁻¹", xlim=(0, top))
    heading([upper], _about(run, discard, spectra[main]), axes is None, run=run)
    return figure


def _about(run: Run, discard: float, line: Spectrum) -> str:
    """What the spectra rest on."""
    seconds = np.count_nonzero(run.t >= discard) * sampling_of(run)
    about = f"{seconds:.4g} s, {line.n_segments} segments, lines {short(line.omega[1])} rad/s apart"
    sure = line.estimate is not None and line.estimate.batches > 1
    return f"Power spectral densities{after(discard)} ({about}{', 95 % shaded' if sure else ''})"


def spectra_of(run: Run, discard: float = 0.0) -> Mapping[str, Spectrum]:
    """Spectra of the base motion (where the run knows it) and of `responses`, these with their confidence."""
    motions = {} if run.model is None else run.model.scene.motions
    t, dt = run.t[after_discard(run, discard)], sampling_of(run)
    found = {name: signal.psd for name, signal in estimated(run, discard, segment_for(len(t), dt)).items()}
    for direction, base in motions.items():
        step, rows = base.nodes(float(run.t[-1]), 1e-3) if hasattr(base, "nodes") else (np.inf, None)
        if rows is not None and step < dt:  # a sum of many lines: by FFT on its own grid
            kept = rows[int(np.ceil(discard / step - 1e-9)) :, 0]
            found[f"base {direction}"] = psd(kept, step, segment_for(len(kept), step))
        else:
            found[f"base {direction}"] = psd(np.asarray(base(t)), dt, segment_for(len(t), dt))
    if run.model is None and run.readout.base is not None:  # of a run read from a file: its samples
        for direction in run.readout.moved:
            along = direction_of(direction, "base")
            moved = frame_motion(run, 0, along)[run.t >= discard]
            found[f"base {direction}"] = psd(moved, dt, segment_for(len(t), dt))
    return found | {name: replace(found[name], unit="rad") for name in found if name in BASES[3:]}


def _linear(run: Run) -> dict[str, Spectrum]:
    """|H|² S of the `responses` with all contacts open, under one noise of known density; else nothing."""
    signals = {} if run.model is None else signals_of(run.model.scene)
    if run.model is None or len(signals) != 1 or not hasattr(next(iter(signals.values())), "psd_at"):
        return {}
    ((path, noise),) = signals.items()
    stop = first_stop(run)
    row = None if stop is None else run.model.contact_rows[stop]
    if row is not None and (row.on[0] != "frame" or row.is_circle):  # δ is of two bodies, or a distance
        return {}
    watched, found = places(run.shapes), {}
    omega = frequencies(run.model, 0.0, 2.5 * float(run.model.omega.max()), LINEAR_POINTS)
    if not len(omega):  # rigid-body modes alone
        return {}
    for name in responses(run):
        z, body = watched.get(name.removesuffix(" u")), 0
        if name == "δ" and row is not None and stop is not None:
            z, body = place_of(run, stop), row.body
        H = run.model.frequency_response(omega, path, z, body=body)
        found[name] = Spectrum(omega, H.amplitude**2 * noise.psd_at(omega), 0)
    return found


def _axis_end(run: Run, line: Spectrum) -> float:
    """2.5 times the highest frequency kept, within what the samples resolve."""
    highest = 2.5 * float(natural(run).max(initial=0.0))
    return float(min(highest or np.inf, line.omega[-1]))  # 0: rigid-body modes alone


def peaks(line: Spectrum, omega_max: float = np.inf, count: int = 10) -> Vector:
    """Frequencies (rad/s, ascending) of the `count` most prominent peaks of a spectrum, lightly smoothed."""
    from scipy.ndimage import gaussian_filter1d
    from scipy.signal import find_peaks

    omega, density = drawable(line, omega_max)
    smooth = gaussian_filter1d(np.log(density), max(2.0, 5.0 / line.omega[1]))
    scatter = 3 / np.sqrt(line.n_segments)  # of ln S; what stands out less may be chance
    found, about = find_peaks(smooth, prominence=max(0.3, scatter), distance=max(1, len(omega) // 30))
    best = found[np.argsort(about["prominences"])[::-1][:count]]
    return np.sort(omega[best])


def _mark_peaks(axis: Axes, line: Spectrum, top: float) -> None:
    """Write the frequency over every prominent peak, of close ones over the highest only."""
    from matplotlib.patheffects import withStroke

    halo = [withStroke(linewidth=2.0, foreground="white")]  # where a dotted line runs through
    omega, density = drawable(line, top)
    heights = {float(peak): density[np.abs(omega - peak) < 15].max() for peak in peaks(line, top)}
    labelled: list[float] = []
    for peak in sorted(heights, key=lambda at: -heights[at]):
        if all(abs(peak - other) >= LABEL_WIDTH * top for other in labelled):
            labelled.append(peak)
            axis.annotate(f"{peak:.0f}", (peak, heights[peak]), xytext=(0, 4), textcoords="offset points", ha="center",
                          fontsize=8, color=BLUE, path_effects=halo)  # fmt: skip


def _mark_frequencies(axes: tuple[Axes, ...], run: Run, top: float) -> None:
    """Dotted lines at the frequencies of all coordinates, their names above the first of the axes."""
    inside = sorted(pair for pair in zip(natural(run).tolist(), coordinates(run), strict=True) if pair[0] < top)
    omega, names = np.array([w for w, _ in inside]), [frequency_words(name, w) for w, name in inside]
    for axis in axes:
        for value in omega:
            axis.axvline(value, color=GREY, linestyle=":", linewidth=0.8, zorder=0)
    close = len(omega) > 1 and np.diff(omega).min() < NAME_WIDTH * top
    close = close or any("shape" in name or "of" in name for name in names)  # longer ones have room upright
    every = max(1, int(np.ceil(len(omega) * UPRIGHT)))  # more than the width holds: some
    shown = np.arange(len(omega))[::every]
    along = apart(omega[shown] / top, UPRIGHT) if close else omega[shown] / top
    for i, x in zip(shown, along, strict=True):
        axes[0].annotate(names[i], (omega[i], 1.0), xycoords=("data", "axes fraction"),
                         xytext=(x, 1.06), textcoords="axes fraction", ha="center", va="bottom", fontsize=8, color=GREY,
                         rotation=90 if close else 0, arrowprops={"arrowstyle": "-", "color": GREY, "linewidth": 0.6,
                                                                  "shrinkA": 0, "shrinkB": 0})  # fmt: skip


def apart(x: Vector, gap: float) -> Vector:
    """Ascending places x within [0, 1], moved as little as need be to lie `gap` apart; (len(x) - 1) gap <= 1.

    Examples
    --------
    >>> apart(np.array([0.0, 0.01, 0.5, 0.99, 1.0]), 0.1).round(3).tolist()
    [0.0, 0.1, 0.5, 0.9, 1.0]
    """
    steps = gap * np.arange(len(x))
    return np.minimum(np.maximum.accumulate(x - steps) + steps, 1.0 - steps[::-1])
