"""Spectra of a run, with the natural frequencies and the peaks marked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from fembeam.plot.response import responses, sampling_of
from fembeam.plot.style import BLUE, GREEN, GREY, Vector, drawable, fit_levels, sheet, styled, titled
from fembeam.statistics import psd
from fembeam.statistics.spectra import FINEST_RESOLUTION

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fembeam.model import Run
    from fembeam.statistics import Spectrum


LABEL_WIDTH = 0.05  # of the axis, taken up by a frequency of four digits


def segment_for(samples: int, dt: float) -> int:
    """Welch segment: an eighth of a short signal, `FINEST_RESOLUTION` on a long one."""
    return max(8, min(samples // 8, int(np.ceil(2 * np.pi / (FINEST_RESOLUTION * dt)))))


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
    figure, (upper, lower) = sheet(run, 2, 1, (7.0, 5.2), sharex=True)
    spectra = spectra_of(run, discard)
    response = {name: s for name, s in spectra.items() if name != "base y"}
    top = omega_max or _axis_end(run, next(iter(response.values())))
    main, *others = response
    for axis, names in ((upper, [n for n in ("base y", main) if n in spectra]), (lower, others or [main])):
        for name in names:
            colour = {"base y": GREY, main: BLUE}.get(name, GREEN)
            axis.semilogy(*drawable(spectra[name], top), color=colour, label=name)
        axis.set_ylabel("PSD / m² s rad⁻¹")
        axis.legend(loc="upper right")
        fit_levels(axis, [spectra[name] for name in names if name != "base y"], top)
    _mark_peaks(upper, spectra[main], top)
    _mark_frequencies((upper, lower), run, top)
    lower.set_xlabel("ω / rad s⁻¹")
    lower.set_xlim(0, top)
    line = spectra[main]
    lasting = np.count_nonzero(run.t >= discard) * sampling_of(run)
    about = f"{lasting:.4g} s, {line.n_segments} segments, lines {line.omega[1]:.2g} rad/s apart"
    return titled(figure, run, f"Power spectral densities ({about})")


def spectra_of(run: Run, discard: float = 0.0) -> Mapping[str, Spectrum]:
    """Spectra of the base motion (where the run knows it) and of `responses`."""
    signals = {name: (x, sampling_of(run)) for name, x in responses(run, discard).items()}
    base = None if run.model is None else run.model.scene.base
    if base is not None and hasattr(base, "nodes"):  # a sum of many lines: by FFT on its own grid
        dt, values = base.nodes(float(run.t[-1]), 1e-3)
        signals["base y"] = values[:, 0], dt
    elif base is not None:
        signals["base y"] = np.asarray(base(run.t)), sampling_of(run)
    return {name: psd(x, dt, segment_for(x.size, dt)) for name, (x, dt) in signals.items()}


def _axis_end(run: Run, line: Spectrum) -> float:
    """2.5 times the highest frequency kept, within what the samples resolve."""
    highest = 0.0 if run.model is None else 2.5 * float(run.model.omega[-1])
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
    omega, density = drawable(line, top)
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
