"""Figures of linear response: response spectra, frequency response."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from fembeam.plot.figure import heading, legend, sheet
from fembeam.plot.style import Vector, place_name, plain_decades, styled, verbatim
from fembeam.plot.units import length_for, unit_for
from fembeam.scene import split
from fembeam.structures import UP
from fembeam.support import require

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fembeam.model import Model, Run
    from fembeam.response import FrequencyResponse, ResponseSpectrum

MOST_INSIDE = 5  # entries of a legend that find room among the curves
OSCILLATORS = 60  # of a run's response spectrum
FEWEST = 12  # samples in the shortest period drawn: the error of straight lines between them is near 2 %


@styled
def response_spectrum(
    spectrum: ResponseSpectrum | Mapping[str, ResponseSpectrum], axes: Sequence[Axes] | None = None
) -> Figure:
    """Largest absolute acceleration and relative displacement over the period, a line for each damping ratio.

    Dashed: pseudo-acceleration ω² max |x|, the largest spring force per mass.

    Parameters
    ----------
    spectrum : one, or several by name. axes : two to draw into; None makes a figure.

    Examples
    --------
    >>> import fembeam as fb
    >>> t = np.linspace(0.0, 4.0, 401)
    >>> found = fb.response_spectrum(t, np.sin(9.0 * t), periods=np.geomspace(0.05, 5.0, 40), zeta=[0.02, 0.05])
    >>> [axis.get_ylabel() for axis in response_spectrum(found).axes]
    ['largest acceleration / m s⁻²', 'largest displacement / mm']
    """
    from matplotlib.axes import Axes

    figure, (upper, lower) = sheet(2, 1, (7.0, 5.2), axes, sharex=True)
    several = spectrum if isinstance(spectrum, Mapping) else {"": spectrum}
    right = bool(several) and all(hasattr(one, "pseudo_acceleration") for one in several.values())
    require(right, "nothing to draw", spectrum, "plot.response_spectrum", "give one spectrum or more")
    plain = " or ".join(dict.fromkeys(one.unit for one in several.values()))
    shown = [one.displacement for one in several.values()]
    scale, unit = length_for(shown) if plain == "m" else unit_for(shown, plain)
    moves = any(one.acceleration.any() or one.displacement.any() for one in several.values())
    draw = Axes.loglog if moves else Axes.semilogx
    for name, one in several.items():
        order = np.argsort(one.period)
        period = one.period[order]
        for i, zeta in enumerate(one.zeta):
            label = verbatim(f"{name}, ζ = {zeta:g}".removeprefix(", "))
            (line,) = draw(upper, period, one.acceleration[i, order], label=label)
            colour = line.get_color()
            draw(upper, period, one.pseudo_acceleration[i, order], "k--", linewidth=0.7)  # seen where they coincide
            draw(lower, period, scale * one.displacement[i, order], color=colour)
    upper.lines[-1].set_label("pseudo-acceleration ω² max |x|")
    rates = " or ".join(f"{word} s⁻²" for word in plain.split(" or "))
    upper.set(ylabel=f"largest acceleration / {rates}", title="Response spectrum")
    lower.set(xlabel="period / s", ylabel=f"largest {'rotation' if plain == 'rad' else 'displacement'} / {unit}")
    for axis in (upper, lower):
        axis.margins(x=0.0)
        plain_decades(axis.xaxis, *axis.get_xlim())
        axis.grid(which="both", alpha=0.25, linewidth=0.5)
    crowded = len(upper.get_legend_handles_labels()[1]) > MOST_INSIDE
    legend(upper, axes is None and crowded, "outside right upper")
    return figure


@styled
def floor_spectrum(run: Run, z: Any = None, zeta: float = 0.05, axes: Sequence[Axes] | None = None) -> Figure:
    """Response spectra of a transient: of the absolute motion at z and of the frame's.

    Parameters
    ----------
    run : of this session, or read from its file. zeta : damping ratio of the oscillators.
    z : m; None: the first stop, else the tip. axes : two to draw into; None makes a figure.

    Notes
    -----
    Periods from that of the highest mode kept to four times that of the lowest, and at least twelve samples. Where the
    samples do not resolve the contacts the figure says so.
    """
    from fembeam.plot.run_signals import sampling_of, watched
    from fembeam.response import frame_motion
    from fembeam.response import response_spectrum as computed

    place, step = watched(run) if z is None else z, sampling_of(run)
    swinging = run.readout.omega[run.readout.omega > 0.0]
    lowest, highest = swinging.min() / 4, min(swinging.max(), 2 * np.pi / (FEWEST * step))
    omega = np.geomspace(min(lowest, highest / 10), highest, OSCILLATORS)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        found = {place_name(place): run.floor_spectrum(place, omega, zeta)}
    if run.readout.base is not None:
        along = split(place)[1] if isinstance(place, tuple) else UP
        found["frame"] = computed(run.t, frame_motion(run, 2, along), omega, zeta)
    figure = response_spectrum(found, axes)
    drawn = figure.axes if axes is None else axes
    drawn[0].set_title("")
    heading(drawn, "Response spectra of absolute motion", axes is None, run=run)
    if said:
        drawn[0].set_title("Contacts are shorter than ten samples: levels are rough; lower dt")
    return figure


def frequencies(model: Model, low: float, high: float, count: int) -> Vector:
    """Where to draw a linear response, rad/s, > 0: even steps and the resonances, but for those without damping."""
    damped = model.zeta > 0.0
    natural = model.omega[damped & (model.omega > low) & (model.omega < high)]
    even = np.linspace(low, high, count)
    return np.setdiff1d(np.union1d(even[even > 0.0], natural), model.omega[~damped])


@styled
def frequency_response(found: FrequencyResponse, axes: Sequence[Axes] | None = None) -> Figure:
    """Amplitude (logarithmic) and phase over frequency, a line for each place; dotted: natural frequencies.

    `axes` to draw into are two.

    Examples
    --------
    >>> import fembeam as fb
    >>> beam = fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01))
    >>> model = fb.Scene(beam, [fb.Clamped(0.0)], damping=fb.ModalDamping(0.02)).reduce(modes=2)
    >>> found = model.frequency_response(np.arange(1.0, 2e3), output=0.5)
    >>> [axis.get_ylabel() for axis in frequency_response(found).axes]
    ['|H| / m/m', 'phase / °']
    """
    from matplotlib.ticker import MultipleLocator

    figure, (upper, lower) = sheet(2, 1, (7.0, 4.8), axes, sharex=True, height_ratios=(2, 1))
    amplitude, phase = (values.reshape(len(found.omega), -1).T for values in (found.amplitude, found.phase))
    named = isinstance(found.output, (tuple, list))
    places: Any = found.output if isinstance(found.output, list) else [found.output]
    for size, angle, z in zip(amplitude, phase, places if named else np.atleast_1d(found.output), strict=True):
        upper.semilogy(found.omega, size, label=verbatim(place_name(z)) if isinstance(z, tuple) else f"z = {z:.4g} m")
        lower.plot(found.omega, np.degrees(angle))
    for natural in found.natural[found.natural < found.omega[-1]]:
        for axis in (upper, lower):
            axis.axvline(natural, color="0.6", linestyle=":", linewidth=0.8, zorder=0)
    kind = "absolute" if found.absolute else "relative"
    upper.set(
        ylabel=f"|H| / {found.unit}",
        title=f"Linear frequency response, {kind} displacement per {verbatim(found.input)}",
    )
    lower.set(xlabel="ω / rad s⁻¹", ylabel="phase / °")
    lower.yaxis.set_major_locator(MultipleLocator(90.0))
    lower.set_xlim(float(found.omega[0]), float(found.omega[-1]))
    crowded = len(upper.get_legend_handles_labels()[1]) > MOST_INSIDE
    legend(upper, axes is None and crowded, "outside right upper")
    return figure
