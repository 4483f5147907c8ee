"""A beam that meets a stop, under broad-band Gaussian base motion: spectrum and density of the response.

    q_i'' + 2 ζ_i ω_i q_i' + ω_i² q_i = -Γ_i y'' + φ_i(z_s) F,    δ = -u(z_s),    F = K δ^1.5 (1 + a δ'/δ'_entry)

The first nonlinear resonance lies near 195 rad/s, towards twice ω_1 = 109 rad/s, with its multiple near 390; the
second mode shows near 780 rad/s; energy gathers below 50 rad/s. δ is strongly skewed, mid-beam is closer to Gaussian:
N. van de Wouw et al., Int. J. Non-Linear Mech. 38 (2003) 767, Section 5. Damping and noise level are our choice.

    python examples/beam_stop.py        prints the peaks and writes beam_stop.png (--quick: of half the time)
"""

import sys

import numpy as np
from scipy.stats import kstest

import fembeam as fb
from contacts import Hysteretic

z_stop, discard = 0.24445, 5.0
steel = fb.Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)
scene = fb.Scene(
    beam=fb.Beam(0.2599, steel),
    supports=[fb.Clamped(0.0)],
    masses=[fb.LumpedMass(z_stop, mass=25.4e-3, inertia=3.0e-6)],
    stops=[fb.Stop(z_stop, law=Hysteretic.lankarani_nikravesh(2.1e8, restitution=0.5))],
    damping=fb.ModalDamping([0.02, 0.01]),
    base=fb.BandNoise(std=2.5e-4, band=(0.0, 1226.6), seed=1),
)
duration = 100.0 if "--quick" in sys.argv else 200.0
run = scene.reduce(modes=2).simulate(duration, dt=1e-3)

kept = run.t >= discard
delta, mid_beam = run.indentation()[kept], run.displacement(scene.beam.length / 2)[kept]
spectrum = fb.psd(delta, dt=1e-3, segment=2048)
peaks = fb.plot.peaks(spectrum, omega_max=1000.0)


def level(lo: float, hi: float) -> float:
    """Mean density of δ between two frequencies."""
    return spectrum.variance_in(lo, hi) / (hi - lo)


def distance(x: np.ndarray) -> float:
    """Largest difference between the distribution of x and the Gaussian of the same mean and deviation."""
    return float(kstest((x - x.mean()) / x.std(), "norm").statistic)


# every bound is at least 8 of the standard deviations, even of 100 s, that 39 realisations of the noise show away
resonance = float(peaks[np.argmin(abs(peaks - 195.0))])
assert abs(resonance - 195.0) < 15.0, f"first nonlinear resonance at {resonance:.0f} rad/s"
assert np.min(abs(peaks - 2 * resonance)) < 25.0, f"no multiple of {resonance:.0f} in {peaks}"
assert np.min(abs(peaks - 780.0)) < 15.0, f"no peak of the second mode in {peaks}"
assert level(750.0, 810.0) > 5 * level(650.0, 720.0), "the second mode does not stand out"
assert level(0.0, 50.0) > 1.2 * level(80.0, 140.0), "no energy below 50 rad/s"

tip, mid = fb.moments(delta), fb.moments(mid_beam)
assert tip.skewness < -0.7, f"δ should be strongly skewed, skewness {tip.skewness:.2f}"
assert abs(mid.skewness) < 0.6 * abs(tip.skewness), f"mid-beam skewness {mid.skewness:.2f}"
assert distance(mid_beam) < 0.6 * distance(delta), "mid-beam is no closer to Gaussian than δ"

if __name__ == "__main__":
    print("peaks of the PSD of δ: " + ", ".join(f"{peak:.0f}" for peak in peaks) + " rad/s")
    print(f"share of variance below 50 rad/s: {spectrum.variance_in(0, 50) / spectrum.variance:.2f}")
    for name, x, found in (("δ", delta, tip), ("mid-beam", mid_beam, mid)):
        print(f"{name}: skewness {found.skewness:.2f}, kurtosis {found.kurtosis:.2f}, distance {distance(x):.3f}")
    print(f"{len(run.contacts) / run.t[-1]:.1f} contacts per second, {run.cost.seconds:.1f} s of computing")
    fb.plot.spectrum(run, discard).savefig("beam_stop.png", dpi=110, metadata={"Software": None})
