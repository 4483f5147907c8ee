"""Tables of mode counts for the paper's scene, a stiff stop struck fast, and the cost of a full model.

python tests/bench/mode_tables.py [harmonic] [noise] [strike] [full]      all of them: some minutes
"""

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from problems import paper_scene

import fembeam as fb
import solvers
from contacts import Hertz
from fembeam.study.quantities import Psd

SCENE = paper_scene()
STIFF = replace(SCENE, base=None, stops=[fb.Stop(0.24445, law=Hertz(1e10))])
COUNTS = [1, 2, 3, 5, 10, 20]


def swing(model):
    """A fast strike, 2 m/s at the tip."""
    return model.state(velocity=lambda z: -2.0 * (z / 0.2599) ** 2)


def harmonic():
    """Periodic response at 195 and 400 rad/s, 1 mm; reference 40 modes with static shape."""
    for omega in (195.0, 400.0):
        for quantity in ("amplitude", "peak_force", "contact_time"):
            print(f"\nharmonic, {omega:g} rad/s:", end=" ")
            scene = replace(SCENE, base=fb.Harmonic(1e-3, omega))
            print(fb.study.mode_count(scene, COUNTS, quantity, reference=40))


def noise():
    """Broad-band noise, eight realisations of 40 s; reference 20 modes with static shape."""
    scene = replace(SCENE, base=fb.BandNoise(2.5e-4, (0.0, 1226.6)))
    for quantity in (Psd((1.0, 1200.0), 12), "density", "impact_rate", "contact_time", "mean_force", "peak_force"):
        print("\nnoise to 1226.6 rad/s:", end=" ")
        print(fb.study.mode_count(scene, COUNTS, quantity, 42.0, 1e-3, 2.0, range(8)))


def strike():
    """A stiff stop struck fast, and the smallest model for its peak force to 2 %."""
    print("\nstrike:", end=" ")
    print(fb.study.mode_count(STIFF, COUNTS, "peak_force", 0.05, start=swing, reference=40))
    print(fb.study.smallest_model(STIFF, "peak_force", 0.02, 0.05, start=swing))


def full(repeats=5):
    """Cost of ten drive periods for a model of 200 elements with all its 400 modes, and for fewer of them."""
    print(
        "\nall modes of 200 elements, ten periods at 195 rad/s\nmodes  peak force/N  µs/run  µs/run/mode  s to prepare"
    )
    for modes in (2, 20, 100, 400):
        started = time.perf_counter()
        model = SCENE.reduce("all" if modes == 400 else modes, elements=200)
        solver, duration = solvers.Exponential(1e-8), 10 * 2 * np.pi / 195.0
        run = model.simulate(duration, solver=solver)
        prepared = time.perf_counter() - started
        spent = min(model.simulate(duration, solver=solver).cost.seconds for _ in range(repeats)) * 1e6
        peak = run.contacts.peak_force.max()
        print(f"{modes:5d}  {peak:12.4f}  {spent:6.0f}  {spent / modes:11.1f}  {prepared:12.2f}")


if __name__ == "__main__":
    for name in sys.argv[1:] or ["harmonic", "noise", "strike", "full"]:
        {"harmonic": harmonic, "noise": noise, "strike": strike, "full": full}[name]()
