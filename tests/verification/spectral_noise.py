"""Gaussian noise by spectral representation

Noise with a one-sided spectrum S is a sum of N cosines at equal distances Δω with amplitudes √(2 S Δω) and random
phases. Over its period 2π/Δω, and for every seed, a band from ω₁ to ω₂ of standard deviation σ has

    variance σ²,    of the rate σ² (ω₂³ - ω₁³)/3(ω₂ - ω₁),    correlation σ² [sin ω₂τ - sin ω₁τ]/((ω₂ - ω₁)τ)

the latter two up to the rectangles of a sum, 1/N; averaged over seeds its kurtosis is 3 - 3/2N. Here 0 to 1226.6
rad/s (the band of the paper of 2003), 4096 lines, σ = 0.25 mm; the kurtosis is that of 40 seeds.
"""

from functools import cache

import numpy as np
from sheets import Row

import fembeam as fb

SOURCE = (
    "M. Shinozuka, C.-M. Jan, *Digital simulation of random processes and its applications*, J. Sound Vib. 25 (1972) "
    "111; M. Shinozuka, G. Deodatis, *Simulation of stochastic processes by spectral representation*, Appl. Mech. "
    "Rev. 44 (1991) 191"
)
STD, BAND, LINES = 2.5e-4, (0.0, 1226.6), 4096
LAGS = (1e-3, 2e-3, 4e-3)  # s


@cache
def series(seed):
    """One period, in samples that resolve all lines: (s, m)."""
    return fb.BandNoise(STD, BAND, seed=seed).series()


def correlation(lag):
    """Of the formula."""
    return STD**2 * np.sin(BAND[1] * lag) / (BAND[1] * lag)


def found(lag):
    """Mean of y(t) y(t + lag) over a period, by the lines of its Fourier transform."""
    t, y = series(1)
    power = np.abs(np.fft.fft(y) / y.size) ** 2
    omega = 2.0 * np.pi * np.fft.fftfreq(y.size, t[1] - t[0])
    return np.sum(power * np.cos(omega * np.asarray(lag)[..., None]), axis=-1)


def rows():
    rate = fb.BandNoise(STD, BAND, seed=1).derivative(1).series()[1]
    kurtosis = np.mean([np.mean(y**4) / np.mean(y**2) ** 2 for y in (series(seed)[1] for seed in range(40))])
    return [
        Row("variance / m²", STD**2, float(np.mean(series(1)[1] ** 2)), 1e-9),
        Row("variance of the rate / m² s⁻²", STD**2 * BAND[1] ** 2 / 3.0, float(np.mean(rate**2)), 1e-3),
        *[Row(f"correlation / m², lag {lag:g} s", correlation(lag), float(found(lag)), 1e-2) for lag in LAGS],
        Row("kurtosis", 3.0 - 1.5 / LINES, float(kurtosis), 2e-2),
    ]


def draw(rig, plot):
    rig.set_aspect("auto")
    t, y = series(1)
    rig.plot(t[:200], 1e3 * y[:200], "k-", lw=0.8)
    rig.axis("on")
    rig.set(xlabel="t / s", ylabel="y / mm")
    lags = np.linspace(1e-5, 1.5e-2, 400)
    plot.plot(1e3 * lags, correlation(lags) / STD**2, color="0.6", lw=3.0, label="formula")
    marks = lags[::16]
    plot.plot(1e3 * marks, found(marks) / STD**2, "k.", label="fembeam")
    plot.set(xlabel="lag / ms", ylabel="correlation/σ²")
    plot.legend()
