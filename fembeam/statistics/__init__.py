"""What a stationary response looks like: spectrum, density, moments, crossings, impacts, each with its standard error.

variance = ∫_0^∞ S(ω) dω,        S one-sided, per rad/s;        S_hz(f) = 2π S(2π f) per Hz
"""

from fembeam.statistics.batches import Batches, Estimate
from fembeam.statistics.densities import Density, Moments, moments, pdf
from fembeam.statistics.impacts import Impacts
from fembeam.statistics.initial_transient import settling
from fembeam.statistics.spectra import Spectrum, psd
from fembeam.statistics.streaming import Signal

__all__ = [
    "Batches",
    "Density",
    "Estimate",
    "Impacts",
    "Moments",
    "Signal",
    "Spectrum",
    "moments",
    "pdf",
    "psd",
    "settling",
]
