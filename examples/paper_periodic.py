"""The periodic response of the paper's beam: harmonic, 1/2 and 1/3 subharmonic branches, with one mode and with two.

Reproduces Figs 4 and 5 of van de Wouw et al., Int. J. Non-Linear Mech. 38 (2003) 767: the subharmonic resonances reach
higher than the harmonic one, and the second mode dents the tops of the harmonic and the 1/2 subharmonic peak. Grey are
brute-force simulations. Away from resonances branches fold hundreds of times: --whole follows them; --quick does less.

    python examples/paper_periodic.py [FIGURE.png] [--quick | --whole]
"""

import sys
import time
from itertools import islice

import numpy as np
from matplotlib.figure import Figure
from scipy.signal import find_peaks

import fembeam as fb
from contacts import Hysteretic

TIP = 0.24445
STARTS = {1: 215.0, 2: 430.0, 3: 650.0}  # by period: rad/s where to look for a branch
MOST = {1: 750, 2: 1500, 3: 1500} if "--whole" in sys.argv else {1: 650, 2: 200, 3: 210}  # orbits
SPANS = dict.fromkeys(STARTS, (60.0, 900.0))
if "--quick" in sys.argv:
    SPANS = {1: (190.0, 240.0), 2: (385.0, 470.0), 3: (610.0, 690.0)}
TOPS = {1: (150.0, 330.0), 2: (370.0, 560.0), 3: (600.0, 740.0)}  # rad/s around each resonance

scene = fb.Scene(
    beam=fb.Beam(0.2599, fb.Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)),
    supports=[fb.Clamped(0.0)],
    masses=[fb.LumpedMass(TIP, mass=25.4e-3, inertia=3.0e-6)],
    stops=[fb.Stop(TIP, law=Hysteretic.lankarani_nikravesh(2.1e8, restitution=0.5))],
    damping=fb.ModalDamping([0.02, 0.01]),
    base=fb.Harmonic(amplitude=1e-3, omega=195.0),
)


def branches(model):
    """The harmonic branch and the two subharmonic ones, each from an attractor of its period; seconds they took."""
    found, seconds = [], 0.0
    for period, omega in STARTS.items():
        start = next(a.orbit for a in model.attractors(omega, starts=6) if a.period == period)
        found.append(model.branch("omega", SPANS[period], period, start, at=omega))
        started = time.perf_counter()
        list(islice(found[-1], MOST[period]))
        seconds += time.perf_counter() - started
    return found, seconds


def summits(branch, period):
    """(rad/s, mm) of the summits of a branch around its resonance that stand out by a fifth of the highest."""
    heights = 1e3 * np.array([fb.plot.peak(orbit, TIP) for orbit in branch.orbits])
    low, high = TOPS[period]
    heights = np.where((branch.parameter > low) & (branch.parameter < high), heights, 0.0)
    found, _ = find_peaks(heights, height=0.4 * heights.max(), prominence=0.2 * heights.max())
    return branch.parameter[found], heights[found]


figure, total = Figure(figsize=(8.8, 6.4), layout="constrained"), 0.0
for modes, axis in zip((1, 2), figure.subplots(2, 1, sharex=True, sharey=True), strict=True):
    model = scene.reduce(modes=modes)
    found, seconds = branches(model)
    total += seconds
    tops = [summits(branch, period) for branch, period in zip(found, STARTS, strict=True)]
    for period, (omega, height) in zip(STARTS, tops, strict=True):
        print(f"{modes} mode(s), period {period}: summits {np.round(height, 2)} mm at {np.round(omega, 1)} rad/s")
    print("; ".join(f"period {one.family.period}: {len(one.found.orbits)} orbits, {one.status}" for one in found))
    assert not any("lost" in one.status for one in found), "branches go on to an end of their own"
    assert tops[0][1].max() < tops[1][1].max() < tops[2][1].max(), "subharmonic resonances reach higher"
    assert [len(height) for _, height in tops[:2]] == [modes, modes], "only the second mode dents the tops"
    values = np.linspace(60.0, 900.0, 6 if "--quick" in sys.argv else 85)
    cloud = fb.study.bifurcation(model, "omega", values, settle=120, keep=6).cloud()
    fb.plot.branch(found, TIP, cloud, axis)
    axis.set(title=f"{modes} mode{'s' * (modes > 1)}", ylim=(0.0, 60.0))
fb.plot.one_legend(figure.axes)
print(f"all branches in {total:.1f} s")
for path in [name for name in sys.argv[1:] if name.endswith(".png")]:
    figure.savefig(path, dpi=150)
