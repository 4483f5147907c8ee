"""The periodic response of the paper's beam: harmonic, 1/2 and 1/3 subharmonic branches, with one mode and with two.

Reproduces Figs 4 and 5 of van de Wouw et al., Int. J. Non-Linear Mech. 38 (2003) 767: both subharmonic resonances reach
higher than the harmonic one, and the second mode dents the tops of the harmonic and the 1/2 subharmonic peak.

    python examples/paper_periodic.py [FIGURE.png]
"""

import sys
import time
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import fembeam as fb
from contacts import Hysteretic

TIP = 0.24445
SPAN = (60.0, 900.0)
STARTS = {1: 195.0, 2: 390.0, 3: 585.0}  # rad/s where each branch is looked for, by its period

scene = fb.Scene(
    beam=fb.Beam(0.2599, fb.Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)),
    supports=[fb.Clamped(0.0)],
    masses=[fb.LumpedMass(TIP, mass=25.4e-3, inertia=3.0e-6)],
    stops=[fb.Stop(TIP, law=Hysteretic.lankarani_nikravesh(2.1e8, restitution=0.5))],
    damping=fb.ModalDamping([0.02, 0.01]),
    base=fb.Harmonic(amplitude=1e-3, omega=195.0),
)


def branches(model):
    """The harmonic branch and the two subharmonic ones, each from an attractor of its period."""
    found = []
    for period, omega in STARTS.items():
        start = next(a.orbit for a in model.attractors(omega) if a.period == period)
        found.append(model.branch("omega", SPAN, period, start, at=omega).run(progress=True))
    return found


def dents(branch):
    """Local minima of the branch's peak height above 0.8 of its highest point."""
    height = np.array([fb.plot.peak(orbit, TIP) for orbit in branch.orbits])
    inner = (height[1:-1] < height[:-2]) & (height[1:-1] < height[2:]) & (height[1:-1] > 0.8 * height.max())
    return branch.parameter[1:-1][inner]


def main():
    figure = Figure(figsize=(6.8, 6.4), layout="constrained")
    panels = figure.subplots(2, 1, sharex=True, sharey=True)
    begin = time.perf_counter()
    for modes, axis in zip((1, 2), panels, strict=True):
        model = scene.reduce(modes=modes)
        found = branches(model)
        tops = [max(fb.plot.peak(orbit, TIP) for orbit in branch.orbits) for branch in found]
        places = [branch.parameter[np.argmax(branch.extremes(TIP).max(axis=1))] for branch in found]
        for period, top, place, branch in zip(STARTS, tops, places, found, strict=True):
            print(
                f"{modes} mode(s), period {period}: {1e3 * top:.2f} mm at {place:.1f} rad/s, dents at {dents(branch)}"
            )
        assert tops[0] < tops[1] < tops[2], "subharmonic resonances reach higher than the harmonic one"
        assert all(bool(len(dents(branch))) == (modes == 2) for branch in found[:2]), "dents belong to the second mode"
        fb.plot.branch(found, TIP, axes=axis)
        axis.set_title(f"{modes} mode{'s' * (modes > 1)}")
    print(f"all branches in {time.perf_counter() - begin:.1f} s")
    return figure


if __name__ == "__main__":
    drawn = main()
    if len(sys.argv) > 1:
        drawn.savefig(Path(sys.argv[1]), dpi=150)
