"""The random response of the paper's beam: its Figures 6-13 and 16-22, each statement with four standard errors.

    q_i'' + 2 ζ_i ω_i q_i' + ω_i² q_i = -Γ_i y'' + φ_i(z_s) F,    δ = -u(z_s),    F = K δ^1.5 (1 + a δ'/δ'_entry)

N. van de Wouw et al., Int. J. Non-Linear Mech. 38 (2003) 767, Sections 5 and 7. Damping, levels and the corner of
the actuator are not in its text: they are our choice. Branches under a harmonic base of the same variance stand beside.

    python examples/paper_random.py    15 000 s simulated, minutes (--quick: 2 500 s, pieces of branches); three figures
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import fembeam as fb
import solvers
from fembeam import scene_file

paper = scene_file.read(Path(__file__).with_name("beam_stop.toml")).scene
seconds = 250.0 if "--quick" in sys.argv else 1500.0
broad, narrow = (0.0, 1226.6), {"harmonic": (144.5, 270.2), "1/2": (351.9, 477.5), "1/3": (559.2, 684.9)}


def model_of(base, modes=2):
    """The paper's beam on a base motion."""
    return replace(paper, base=base, damping=fb.ModalDamping([0.02, 0.01, 0.01][:modes])).reduce(modes)


def response(base, modes=2):
    """Statistics of δ and mid-beam under a base motion."""
    return fb.study.stationary(model_of(base, modes), seconds, 1e-3, solver=solvers.Exponential(1e-6, ledger=False))


def periodic(period, band):
    """The branch of that period through a band, under a harmonic base motion as strong as the noise."""
    model = model_of(fb.Harmonic(2.5e-4 * 2**0.5, 215.0 * period))
    start = next(found.orbit for found in model.attractors(starts=6) if found.period == period)
    reach = (215.0 * period - 3.0, 215.0 * period + 3.0) if "--quick" in sys.argv else band
    return model.branch("omega", reach, period, start).run(progress=True)


flat = response(fb.BandNoise(2.5e-4, broad, seed=1))  # Figures 6-10
tip, mid, peaks = flat["δ"], flat["mid-beam u"], fb.plot.peaks(flat["δ"].psd, 1000.0)
assert all(min(abs(peaks - expected)) < 16.0 for expected in (195.0, 390.0, 780.0)), f"peaks only at {peaks} rad/s"
assert tip.power(0.0, 50.0).exceeds(tip.power(75.0, 125.0), 1.5), "no energy gathers below 50 rad/s"
assert tip.skewness.interval(0.9999)[1] < -0.7, f"δ is not strongly skewed: {tip.skewness}"
assert max(np.abs(mid.skewness.interval(0.9999))) < 0.6, f"mid-beam is not closer to Gaussian: {mid.skewness}"
bands = {name: response(fb.BandNoise(2.5e-4, band, seed=2))["δ"] for name, band in narrow.items()}  # Figures 11-13
assert bands["1/3"].variance.exceeds(bands["1/2"].variance, 2.0), "1/3 subharmonic not above 1/2"
assert bands["1/2"].variance.exceeds(bands["harmonic"].variance, 2.0), "1/2 subharmonic not above harmonic"
for n, (name, (lo, hi)) in enumerate(narrow.items(), start=1):
    strongest = bands[name].psd.omega[np.argmax(bands[name].psd.density * (bands[name].psd.omega > 60.0))]
    assert lo / n < strongest < hi / n, f"{name}: strongest at {strongest:.0f} rad/s, not in the band over {n}"
    assert n == 1 or bands[name].power(lo / n, hi / n).exceeds(bands[name].power(lo, hi), 5.0), f"{name}: driven band"

rolled = {n: response(fb.BandNoise.rolled_off(2.5e-4, broad, 300.0, seed=3), n)["δ"] for n in (1, 2, 3)}  # 16, 17
filtered = fb.BandNoise.of_psd(fb.RollOff(1e-9, 300.0), narrow["harmonic"], seed=4)  # Figures 18-20
weaker = replace(filtered, band=narrow["1/2"])  # Figures 21, 22: the same filter
coloured, half = {n: response(filtered, n)["δ"] for n in (1, 2)}, response(weaker)["δ"]
assert all(x[2].power(750.0, 810.0).exceeds(x[1].power(750.0, 810.0), 3.0) for x in (rolled, coloured)), "no mode 2"
assert coloured[1].power(0.0, 300.0).exceeds(coloured[2].power(0.0, 300.0), 1.3), "one mode will do at low frequencies"
powers = np.array([[rolled[n].power(lo, lo + 300.0).value for lo in (0.0, 300.0, 600.0, 900.0)] for n in (2, 3)])
assert np.abs(powers[1] / powers[0] - 1).max() < 1 / 3, f"the third mode changes powers below 1200 rad/s: {powers}"
assert half.variance.exceeds(coloured[2].variance, 0.4), "1/2 subharmonic response is not of comparable energy"

if __name__ == "__main__":
    for name, x in {"flat, δ": tip, "flat, mid-beam": mid, **bands, "coloured, 1/2": half}.items():
        print(f"{name}: std {x.std!r} m, skewness {x.skewness!r}, kurtosis {x.kurtosis!r}")
    print(f"third mode: variance {rolled[3].variance.value / rolled[2].variance.value - 1:+.1%}; peaks {peaks.round()}")
    panels = {"broad": {"δ": tip, "mid-beam": mid}, **{name: {"δ": x} for name, x in bands.items()}}
    branches = {name: [periodic(n, band)] for n, (name, band) in enumerate(narrow.items(), start=1)}
    branches["broad"] = [branch for (branch,) in branches.values()]
    fb.plot.random_spectra(panels, 1300.0, {"broad": broad, **narrow}, branches).savefig("paper_random_flat.png")
    sheets = {"rolled-off broad band": rolled, "harmonic, rolled off": coloured, "1/2, rolled off": {2: half}}
    named = {title: {f"modes: {n}": x for n, x in lines.items()} for title, lines in sheets.items()}
    fb.plot.random_spectra(named, 1300.0).savefig("paper_random_coloured.png")
    fb.plot.random_densities({"δ": tip, "mid-beam u": mid}).savefig("paper_random_densities.png")
