"""Figures of linear response: response spectra, frequency response."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fembeam.plot.style import styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fembeam.response import FrequencyResponse, ResponseSpectrum


@styled
def response_spectrum(spectrum: ResponseSpectrum) -> Figure:
    """Largest absolute acceleration and relative displacement over the period, a line for each damping ratio.

    Dashed: pseudo-acceleration ω² max |x|, the largest spring force per mass.

    Examples
    --------
    >>> import fembeam as fb
    >>> t = np.linspace(0.0, 4.0, 401)
    >>> found = fb.response_spectrum(t, np.sin(9.0 * t), periods=np.geomspace(0.05, 5.0, 40), zeta=[0.02, 0.05])
    >>> [axis.get_ylabel() for axis in response_spectrum(found).axes]
    ['largest acceleration / m s⁻²', 'largest displacement / mm']
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 5.2), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    order = np.argsort(spectrum.period)
    period = spectrum.period[order]
    for i, zeta in enumerate(spectrum.zeta):
        (line,) = upper.loglog(period, spectrum.acceleration[i, order], label=f"ζ = {zeta:g}")
        colour = line.get_color()
        upper.loglog(period, spectrum.pseudo_acceleration[i, order], color=colour, linestyle="--", alpha=0.6)
        lower.loglog(period, 1e3 * spectrum.displacement[i, order], color=colour)
    upper.set(ylabel="largest acceleration / m s⁻²", title="Response spectrum; dashed: pseudo-acceleration ω² max |x|")
    lower.set(xlabel="period / s", ylabel="largest displacement / mm", xlim=(period[0], period[-1]))
    upper.legend()
    return figure


@styled
def frequency_response(found: FrequencyResponse) -> Figure:
    """Amplitude (logarithmic) and phase over frequency, a line for each place; dotted: natural frequencies.

    Examples
    --------
    >>> import fembeam as fb
    >>> beam = fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01))
    >>> model = fb.Scene(beam, [fb.Clamped(0.0)], damping=fb.ModalDamping(0.02)).reduce(modes=2)
    >>> found = model.frequency_response(np.arange(1.0, 2e3), output=0.5)
    >>> [axis.get_ylabel() for axis in frequency_response(found).axes]
    ['|H| / m/m', 'phase / °']
    """
    from matplotlib.figure import Figure
    from matplotlib.ticker import MultipleLocator

    figure = Figure(figsize=(7.0, 4.8), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    amplitude, phase = (values.reshape(len(found.omega), -1).T for values in (found.amplitude, found.phase))
    for size, angle, z in zip(amplitude, phase, np.atleast_1d(found.output), strict=True):
        upper.semilogy(found.omega, size, label=f"z = {z:.4g} m")
        lower.plot(found.omega, np.degrees(angle))
    for natural in found.natural[found.natural < found.omega[-1]]:
        for axis in (upper, lower):
            axis.axvline(natural, color="0.6", linestyle=":", linewidth=0.8, zorder=0)
    kind = "absolute" if found.absolute else "relative"
    upper.set(ylabel=f"|H| / {found.unit}", title=f"Linear frequency response, {kind} displacement per {found.input}")
    lower.set(xlabel="ω / rad s⁻¹", ylabel="phase / °")
    lower.yaxis.set_major_locator(MultipleLocator(90.0))
    lower.set_xlim(float(found.omega[0]), float(found.omega[-1]))
    upper.legend()
    return figure
