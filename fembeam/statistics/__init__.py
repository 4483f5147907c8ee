"""What a stationary response looks like: spectrum, density, moments, crossings, impacts, each with its standard error.

    variance = ∫_0^∞ S(ω) dω,        S one-sided, per rad/s;        S_hz(f) = 2π S(2π f) per Hz

`spectra` and `densities` estimate from samples at hand; `streaming` and `impacts` collect the same from one segment
of a run after the other; `batches` makes standard errors and intervals from batch means, on the scales of `scales`;
`initial_transient` finds from when on a signal is stationary. Nothing is known of beams or models, only of samples and
contact logs. Imports: `support`. Begin with `batches`.
"""

from fembeam.statistics.batches import Batches, Estimate
from fembeam.statistics.densities import Density, Moments, moments, pdf
from fembeam.statistics.impacts import Impacts
from fembeam.statistics.initial_transient import settling
from fembeam.statistics.spectra import Spectrum, psd
from fembeam.statistics.streaming import Signal

__all__ = [
    "Batches", "Density", "Estimate", "Impacts", "Moments", "Signal", "Spectrum", "moments", "pdf", "psd",
    "settling",
]  # fmt: skip
