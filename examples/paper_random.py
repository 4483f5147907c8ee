"""The random response of the paper's beam: its Figures 6-13 and 16-22, each statement with four standard errors.

    q_i'' + 2 ζ_i ω_i q_i' + ω_i² q_i = -Γ_i y'' + φ_i(z_s) F,    δ = -u(z_s),    F = K δ^1.5 (1 + a δ'/δ'_entry)

N. van de Wouw et al., Int. J. Non-Linear Mech. 38 (2003) 767, Sections 5 and 7. Damping, levels and the corner of
the actuator are not in its text: they are our choice. Flat spectra come first, then those an actuator rolls off.

    python examples/paper_random.py            15 000 s simulated, about a minute (--quick: 2 500 s); paper_random_*.png
"""

import sys

import numpy as np

import fembeam as fb
import solvers
from contacts import Hysteretic
from fembeam.study import stationary

seconds, z = 250.0 if "--quick" in sys.argv else 1500.0, 0.24445
broad, narrow = (0.0, 1226.6), {"harmonic": (144.5, 270.2), "1/2": (351.9, 477.5), "1/3": (559.2, 684.9)}


def response(base, modes=2):
    """Statistics of δ and mid-beam under a base motion."""
    scene = fb.Scene(
        fb.Beam(0.2599, fb.Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)),
        [fb.Clamped(0.0)],
        masses=[fb.LumpedMass(z, mass=25.4e-3, inertia=3.0e-6)],
        stops=[fb.Stop(z, law=Hysteretic.lankarani_nikravesh(2.1e8, restitution=0.5))],
        damping=fb.ModalDamping([0.02, 0.01, 0.01][:modes]),
        base=base,
    )
    return stationary(scene.reduce(modes), seconds, 1e-3, solver=solvers.Exponential(1e-6, ledger=False))


def surely(large, small, factor=1.0):
    """Whether large > factor * small by more than four standard errors."""
    return large.value - factor * small.value > 4 * np.hypot(large.standard_error, factor * small.standard_error)


flat = response(fb.BandNoise(2.5e-4, broad, seed=1))  # Figures 6-10
tip, mid, peaks = flat["δ"], flat["mid-beam u"], fb.plot.peaks(flat["δ"].psd, 1000.0)
for expected in (195.0, 390.0, 780.0):
    assert min(abs(peaks - expected)) < 16.0, f"no peak near {expected:.0f} rad/s in {peaks}"
assert surely(tip.power(0.0, 50.0), tip.power(75.0, 125.0), 1.5), "no energy gathers below 50 rad/s"
assert tip.skewness.interval(0.9999)[1] < -0.7, f"δ is not strongly skewed: {tip.skewness}"
assert max(np.abs(mid.skewness.interval(0.9999))) < 0.6, f"mid-beam is not closer to Gaussian: {mid.skewness}"

bands = {name: response(fb.BandNoise(2.5e-4, band, seed=2))["δ"] for name, band in narrow.items()}  # Figures 11-13
assert surely(bands["1/3"].variance, bands["1/2"].variance, 2.0), "1/3 subharmonic not above 1/2"
assert surely(bands["1/2"].variance, bands["harmonic"].variance, 2.0), "1/2 subharmonic not above harmonic"
for n, (name, (lo, hi)) in enumerate(narrow.items(), start=1):
    strongest = bands[name].psd.omega[np.argmax(bands[name].psd.density * (bands[name].psd.omega > 60.0))]
    assert lo / n < strongest < hi / n, f"{name}: strongest at {strongest:.0f} rad/s, not in the band over {n}"
    assert n == 1 or surely(bands[name].power(lo / n, hi / n), bands[name].power(lo, hi), 5.0), f"{name}: driven band"

rolled = {n: response(fb.BandNoise.rolled_off(2.5e-4, broad, 300.0, seed=3), n)["δ"] for n in (1, 2, 3)}  # 16, 17
filtered = fb.BandNoise.of_psd(fb.RollOff(1e-9, 300.0), narrow["harmonic"], seed=4)  # Figures 18-20
weaker = fb.BandNoise.of_psd(fb.RollOff(1e-9, 300.0), narrow["1/2"], seed=4)  # Figures 21, 22: the same filter
coloured, half = {n: response(filtered, n)["δ"] for n in (1, 2)}, response(weaker)["δ"]
assert all(surely(x[2].power(750.0, 810.0), x[1].power(750.0, 810.0), 3.0) for x in (rolled, coloured)), "no mode 2"
assert surely(coloured[1].power(0.0, 300.0), coloured[2].power(0.0, 300.0), 1.3), "one mode will do at low frequencies"
for lo, hi in ((0.0, 300.0), (300.0, 600.0), (600.0, 900.0), (900.0, 1200.0)):
    change = rolled[3].power(lo, hi).value / rolled[2].power(lo, hi).value - 1
    assert abs(change) < 1 / 3, f"the third mode changes {lo:.0f} to {hi:.0f} rad/s by {change:.0%}"
assert weaker.std < 0.75 * filtered.std, "the roll-off does not weaken the upper band"
assert surely(half.variance, coloured[2].variance, 0.4), "1/2 subharmonic response is not of comparable energy"

if __name__ == "__main__":
    for name, line in {"flat, δ": tip, "flat, mid-beam": mid, **bands, "coloured, 1/2": half}.items():
        print(f"{name}: std {line.std!r} m, skewness {line.skewness!r}, kurtosis {line.kurtosis!r}")
    print(f"third mode: variance {rolled[3].variance.value / rolled[2].variance.value - 1:+.1%}; peaks {peaks.round()}")
    panels = {"flat broad band": {"δ": tip, "mid-beam": mid}, **{name: {"δ": x} for name, x in bands.items()}}
    fb.plot.random_spectra(panels, 1300.0, {"flat broad band": broad, **narrow}).savefig("paper_random_flat.png")
    sheets = {"rolled-off broad band": rolled, "harmonic, rolled off": coloured, "1/2, rolled off": {2: half}}
    named = {title: {f"modes: {n}": x for n, x in lines.items()} for title, lines in sheets.items()}
    fb.plot.random_spectra(named, 1300.0).savefig("paper_random_coloured.png")
    fb.plot.random_densities({"δ": tip, "mid-beam u": mid}).savefig("paper_random_densities.png")
