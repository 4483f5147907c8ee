"""Shock spectra of a half sine and of a step

A base accelerates by a sin(πt/d) for 0 < t < d, or by a from t = 0 on. With β = π/ωd the relative displacement x of
an undamped oscillator ω is, times ω²/a,

    half sine, t < d:    [sin(πt/d) - β sin ωt]/(1 - β²), largest at one of t = 2πn/(ω ± π/d)
    afterwards:          amplitude 2β |cos(π/2β)|/|1 - β²|
    step, damping ζ:     1 + e^(-πζ/√(1 - ζ²))

and the spectrum is the larger of the first two. The half sine is given by 2000 samples with straight lines between.
"""

import math

import numpy as np
import sketch
from sheets import Row

import fembeam as fb

SOURCE = (
    "R.S. Ayre, chapter 8 of C.M. Harris, C.E. Crede (eds), *Shock and Vibration Handbook*, McGraw-Hill 1961; R.W. "
    "Clough, J. Penzien, *Dynamics of Structures*, McGraw-Hill 1975, chapter on impulsive loading"
)
RATIOS = (0.2, 0.5, 0.8, 1.4, 3.3)  # duration over period
DAMPING = (0.0, 0.05, 0.5)


def half_sine(ratio):
    """ω² max |x|/a."""
    omega, beta = 2.0 * math.pi * ratio, 0.5 / ratio  # d = 1
    after = abs(2.0 * beta * math.cos(math.pi / (2.0 * beta)) / (1.0 - beta**2)) if beta != 1.0 else math.pi / 2
    within = [2.0 * math.pi * n / (omega + sign * math.pi) for n in range(1, 20) for sign in (1.0, -1.0)
              if omega + sign * math.pi > 1e-9]  # fmt: skip
    sizes = [abs(math.sin(math.pi * t) - beta * math.sin(omega * t)) / abs(1.0 - beta**2)
             for t in within if t < 1.0 and beta != 1.0]  # fmt: skip
    return max([after, *sizes])


def ours(ratios):
    """The same by fembeam."""
    t = np.linspace(0.0, 8.0, 16001)
    pulse = np.where(t < 1.0, np.sin(np.pi * t), 0.0)
    return fb.response_spectrum(t, pulse, 2.0 * np.pi * np.asarray(ratios), 0.0).pseudo_acceleration[0]


def rows():
    found = [Row(f"half sine, duration/period = {r:g}", half_sine(r), float(a), 1e-5)
             for r, a in zip(RATIOS, ours(RATIOS), strict=True)]  # fmt: skip
    t = np.linspace(0.0, 3.0, 3001)
    for zeta in DAMPING:
        over = 1.0 + math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta**2))
        step = fb.response_spectrum(t, np.ones(t.size), [2.0 * np.pi], zeta).pseudo_acceleration[0, 0]
        found.append(Row(f"step, ζ = {zeta:g}", over, float(step), 1e-5))
    return found


def draw(rig, plot):
    sketch.block(rig, 0.6, 0.9, "m", 0.7, 0.35)
    sketch.spring(rig, (0.4, 0.0), (0.4, 0.72))
    sketch.dashpot(rig, (0.8, 0.0), (0.8, 0.72))
    sketch.wall(rig, 0.6, 0.0, 1.2, 0.0, -1.0)
    sketch.arrow(rig, (1.4, -0.1), (1.4, 0.4), "a(t)", shift=(0.0, 0.12))
    sketch.arrow(rig, (0.1, 0.75), (0.1, 1.2), "x", shift=(0.0, 0.1))
    sketch.view(rig, -0.3, 1.9, -0.3, 1.5)
    ratios = np.linspace(0.05, 4.0, 300)
    plot.plot(ratios, [half_sine(r) for r in ratios], color="0.6", lw=3.0, label="formula")
    marks = np.linspace(0.1, 3.9, 20)
    plot.plot(marks, ours(marks), "k.", label="fembeam")
    plot.set(xlabel="duration/period", ylabel="half sine: ω² max |x|/a")
    plot.legend()
