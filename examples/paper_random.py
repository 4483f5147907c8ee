"""The random response of the paper's beam, its Figures 6-13 and 16-22: every statement holds with 99.99 % confidence.

    q_i'' + 2 ζ_i ω_i q_i' + ω_i² q_i = -Γ_i y'' + φ_i(z_s) F,    δ = -u(z_s),    F = K δ^1.5 (1 + a δ'/δ'_entry)

N. van de Wouw et al., Int. J. Non-Linear Mech. 38 (2003) 767, Sections 5 and 7; damping, levels and filter are ours.
Two statements hold in part: a third mode takes a sixth of the variance; mid-beam is near Gaussian in skewness only.

    python examples/paper_random.py    15 000 s simulated, minutes (--quick: 4 000 s, pieces of branches); three figures
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import fembeam as fb
import solvers
from fembeam import scene_file, statistics

paper, quick = scene_file.read(Path(__file__).with_name("beam_stop.toml")).scene, "--quick" in sys.argv
scenes = {modes: replace(paper, damping=fb.ModalDamping([0.02, 0.01, 0.01][:modes])) for modes in (1, 2, 3)}
broad, narrow = (0.0, 1226.6), {"harmonic": (144.5, 270.2), "1/2": (351.9, 477.5), "1/3": (559.2, 684.9)}


def claim(text, least, most, found, other=None):
    """Numbers, or their ratios to others under the same noise, lie between two bounds with 99.99 % confidence."""
    found = found if other is None else statistics.Estimate.joint(np.divide, found, other)
    lo, hi = found.interval(0.9999)
    assert np.all((least < lo) & (hi < most)), f"{text}: {lo} to {hi} is not within {least} to {most}"
    print(f"{text}: {np.round(found.value, 3).tolist()} ± {np.round(found.standard_error, 4).tolist()}")


def response(base, modes=2, duration=400.0):
    """Statistics of δ and mid-beam under a base motion: bounds are 12 standard errors off even in quick runs."""
    model, method = replace(scenes[modes], base=base).reduce(modes), solvers.Exponential(1e-6, ledger=False)
    return fb.study.stationary(model, duration if quick else 1500.0, 1e-3, solver=method)


def periodic(period, band):
    """The branch of that period through a band, under a harmonic base motion as strong as the noise."""
    model = replace(scenes[2], base=fb.Harmonic(2.5e-4 * 2**0.5, 215.0 * period)).reduce(2)
    start = next(found.orbit for found in model.attractors(starts=6) if found.period == period)
    reach = (215.0 * period - 3.0, 215.0 * period + 3.0) if quick else band
    return model.branch("omega", reach, period, start).run(progress=True)


tip, mid = response(fb.BandNoise(2.5e-4, broad, seed=1), duration=800.0).signals.values()  # Figures 6-10
for name, x, at in (("δ", tip, 195.0 * np.array([1, 2, 4])), ("mid-beam", mid, 195.0 * np.array([1, 2, 3, 4]))):
    near, beside = (x.power(omega - 16.0, omega + 16.0) for omega in (at, at + np.array([[-32.0], [32.0]])))
    claim(f"{name}: power near {at.tolist()} rad/s over that 32 rad/s off", 1.0, 30.0, near, beside)
claim("δ: power below 50 rad/s over 75-125 rad/s", 1.5, 5.0, tip.power(0.0, 50.0), tip.power(75.0, 125.0))
claim("skewness of δ", -1.3, -0.7, tip.skewness)
claim("skewness of δ over mid-beam", -4.0, -2.0, tip.skewness, mid.skewness)
excess = [statistics.Estimate.joint(lambda kurtosis: kurtosis - 3.0, x.kurtosis) for x in (mid, tip)]
claim("excess kurtosis of mid-beam over δ", *((0.2, 1.6) if quick else (0.5, 1.1)), *excess)
bands = {name: response(fb.BandNoise(2.5e-4, band, seed=2))["δ"] for name, band in narrow.items()}  # Figures 11-13
for more, less in (("1/3", "1/2"), ("1/2", "harmonic")):
    claim(f"variance of {more} over {less}", 2.0, 6.0, bands[more].variance, bands[less].variance)
for n, (name, (lo, hi)) in enumerate(narrow.items(), start=1):
    own, others = bands[name].power(lo / n, hi / n), bands[name].power([60.0, hi / n], [lo / n, 3000.0])
    claim(f"{name}: power in the band over {n} over that below and above", 2.0, 30.0, own, others)
rolled = {n: response(fb.BandNoise.rolled_off(2.5e-4, broad, 300.0, seed=3), n)["δ"] for n in (1, 2, 3)}  # 16, 17
filtered = fb.BandNoise.of_psd(fb.RollOff(1e-9, 300.0), narrow["harmonic"], seed=4)  # 18-22
coloured, half = {n: response(filtered, n)["δ"] for n in (1, 2)}, response(replace(filtered, band=narrow["1/2"]))["δ"]
parts, wide = ([0, 300, 600, 900, 0], [300, 600, 900, 1200, np.inf]), (0.6, 1.15) if quick else (0.7, 1.0)
for name, x, least, most in (("broad", rolled, *wide), ("harmonic", coloured, *((1.2, 2.4) if quick else (1.5, 2.0)))):
    claim(f"{name}: one mode over two", [least, 0.0], [most, 0.3], *(x[n].power([0, 750], [300, 810]) for n in (1, 2)))
claim("three modes over two", wide[0], np.maximum([1.1] * 4 + [1], wide[1]), *(rolled[n].power(*parts) for n in (3, 2)))
claim("variance of 1/2 over harmonic, rolled off", 1.0, 2.0, half.variance, coloured[2].variance)
if __name__ == "__main__":
    panels = {"broad": {"δ": tip, "mid-beam": mid}, **{name: {"δ": x} for name, x in bands.items()}}
    branches = {name: [periodic(n, band)] for n, (name, band) in enumerate(narrow.items(), start=1)}
    branches["broad"] = [branch for (branch,) in branches.values()]
    fb.plot.random_spectra(panels, 1300.0, {"broad": broad, **narrow}, branches).savefig("paper_random_flat.png")
    sheets = {"rolled-off broad band": rolled, "harmonic, rolled off": coloured, "1/2, rolled off": {2: half}}
    named = {title: {f"modes: {n}": x for n, x in lines.items()} for title, lines in sheets.items()}
    fb.plot.random_spectra(named, 1300.0).savefig("paper_random_coloured.png")
    fb.plot.random_densities({"δ": tip, "mid-beam u": mid}).savefig("paper_random_densities.png")
