"""Figures of random response: spectra and densities with their confidence, many to a sheet."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from fembeam.plot.figure import NARROWEST, sheet
from fembeam.plot.orbits import branch
from fembeam.plot.style import (
    BLUE,
    GREY,
    RED,
    curve,
    entry,
    fit_levels,
    one_legend,
    own_colour,
    ribbon,
    styled,
    verbatim,
)
from fembeam.plot.units import density_label, signal_for
from fembeam.statistics import Spectrum

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fembeam.model import Branch
    from fembeam.statistics import Estimate, Signal

FURTHEST = 5.0  # standard deviations shown of a density
WIDTH, BROADEST = 44, 215.0  # characters and points of a line over a density
TICKS = 5  # at most, between the ends of a density
ROOM = 1.3  # of the highest density, the height of its axis, so that the legend has room


@styled
def random_spectra(
    panels: Mapping[str, Mapping[str, Spectrum | Signal]],
    omega_max: float,
    bands: Mapping[str, tuple[float, float]] | None = None,
    branches: Mapping[str, Sequence[Branch]] | None = None,
    axes: Axes | Sequence[Axes] | None = None,
) -> Figure:
    """Power spectral densities, one panel each, with 95 % confidence shaded where it is known.

    Parameters
    ----------
    panels : title -> label -> spectrum, or the signal it is of.
    omega_max : rad/s, end of the axes.
    bands : title -> excited band in rad/s, marked on top of its panel.
    branches : title -> branches of periodic motion along ω, drawn beside the panel of that title.
    axes : to draw into, one per panel, with branches two, the spectrum's first; None makes a figure.
    """
    columns = 2 if branches else 1
    size = 4.6 * columns + 2.4, 2.1 * len(panels) + 0.5
    figure, drawn = sheet(len(panels), columns, size, axes, squeeze=False)
    for row, (title, shown) in enumerate(panels.items()):
        lines = {label: x if isinstance(x, Spectrum) else x.psd for label, x in shown.items()}
        axis = drawn[row * columns]
        for i, (label, line) in enumerate(lines.items()):
            curve(axis, line, omega_max, label=entry(label), color=own_colour(i))
        fit_levels(axis, list(lines.values()), omega_max)
        if bands and title in bands:
            axis.axvspan(*bands[title], ymin=0.96, color=GREY, alpha=0.6, linewidth=0)
        level = density_label(line.unit for line in lines.values())
        axis.set(title=verbatim(title), xlim=(0, omega_max), ylabel=level)
        if len(lines) > 1:
            _legend(axis, beside=axes is None)
        if branches:
            _beside(drawn[row * columns + 1], branches.get(title), omega_max)
    for axis in drawn[-columns:]:
        axis.set_xlabel("ω / rad s⁻¹")
    if branches and axes is None:
        one_legend(drawn[1::2])
    return figure


@styled
def random_densities(signals: Mapping[str, Signal], axes: Axes | Sequence[Axes] | None = None) -> Figure:
    """Probability densities with 95 % confidence against the Gaussian of the same mean and deviation.

    Parameters
    ----------
    signals : name -> signal, such as those of `fembeam.study.stationary`.
    axes : to draw into, one per signal; None makes a figure.

    Examples
    --------
    >>> import fembeam as fb
    >>> beam = fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01))
    >>> noise, damping = fb.BandNoise(1e-5, (0.0, 400.0), seed=1), fb.ModalDamping(0.05)
    >>> model = fb.Scene(beam, [fb.Clamped(0.0)], damping=damping, base=noise).reduce(modes=1)
    >>> found = fb.study.stationary(model, duration=400.0, dt=2e-3)
    >>> random_densities({"tip": found["tip u"]}).axes[0].get_xlabel()
    'tip / mm'
    """
    figure, drawn = sheet(1, len(signals), (3.5 * len(signals), 3.1), axes)
    density_panels(drawn, signals)
    return figure


def _legend(axis: Axes, beside: bool) -> None:
    """Names within the axes, long ones beside them where there is room, as they would cover curves."""
    inner = axis.legend(loc="upper right")
    if beside and any("\n" in text.get_text() for text in inner.get_texts()):
        axis.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=8)


def density_panels(axes: Sequence[Axes], signals: Mapping[str, Signal]) -> None:
    """One density each, with its confidence where it is known, against its Gaussian."""
    said: str | None = None
    for axis, (name, signal) in zip(axes, signals.items(), strict=True):
        density = signal.pdf
        scale, unit = signal_for(signal.unit, density.x)
        mean, std = scale * float(signal.mean.value), scale * float(signal.std.value)
        x, p = scale * density.x, density.density / scale
        sure = density.estimate is not None and density.estimate.batches > 1
        axis.step(x, p, where="mid", color=BLUE, label="simulated, 95 % shaded" if sure else "simulated")
        if sure:
            ribbon(axis, x, [bound / scale for bound in density.interval()], BLUE, step="mid")
        wide = mean + std * np.linspace(-FURTHEST, FURTHEST, 301)
        normal = np.exp(-0.5 * ((wide - mean) / std) ** 2) / (std * np.sqrt(2 * np.pi))
        axis.plot(wide, normal, color=RED, linestyle="--", label="Gaussian")
        shape = f"skewness\xa0{_rounded(signal.skewness)}", f"kurtosis {_rounded(signal.kurtosis)}"
        axis.set_title(",\n".join((_filled(f"{name}: {shape[0]}"), shape[1])))
        axis.set_xlabel(_filled(f"{name}\xa0/\xa0{unit}" if unit else name))
        axis.locator_params(axis="x", nbins=TICKS)
        axis.set(xlim=(wide[0], wide[-1]), ylim=(0, ROOM * max(p.max(), normal.max())))
        if unit != said:
            axis.set_ylabel(f"probability density / {unit}⁻¹" if unit else "probability density")
        said = unit
    axes[0].legend(loc="upper left", fontsize=8)


def _filled(text: str) -> str:
    """A text over or below a density, on several lines where it is longer than the density is wide."""
    wide = WIDTH
    while _points(filled := _lines(text, wide)) > BROADEST and wide > NARROWEST:  # of broad letters
        wide -= 4
    return filled


def _lines(text: str, wide: int) -> str:
    """A text on lines of so many characters."""
    return verbatim(textwrap.fill(text, wide, break_on_hyphens=False).replace("\xa0", " "))


def _points(text: str) -> float:
    """How broad the broadest line of a title or label is, in points."""
    from matplotlib import rcParams
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextPath

    font = FontProperties(size=rcParams["axes.titlesize"])
    return max(float(TextPath((0.0, 0.0), line, prop=font).get_extents().width) for line in text.splitlines())


def _rounded(found: Estimate) -> str:
    """An estimate to two decimals, or to two digits of its standard error where it has one."""
    error = float(found.standard_error)
    digits = max(2, 1 - int(np.floor(np.log10(error)))) if error > 0.0 else 2
    return f"{float(found.value):z.{digits}f}" + (f" ± {error:.{digits}f}" if error > 0.0 else "")


def _beside(axis: Axes, several: Sequence[Branch] | None, omega_max: float) -> None:
    """Periodic motion that explains a spectrum, on the same frequencies."""
    if several:
        branch(several, axes=axis)
    unit = axis.get_ylabel().rpartition(" / ")[2] or "mm"
    axis.set(title="periodic motion", xlim=(0, omega_max), ylim=(0, None), xlabel="")
    axis.set_ylabel(f"max |u| at the stop / {unit}")
