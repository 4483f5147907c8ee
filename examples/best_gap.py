"""The best gap of a stop under noise: least rms of the tip at a bound on the mean force of impacts.

    minimise √(mean (u - ū)²)  over the gap,    mean largest force of a contact <= limit

A bar with a mass at its tip is shaken by noise, and a rubber stop holds it back: the more the stop is pressed on (a
negative gap), the less the tip moves, and the harder the stop works. Every gap meets the same realisations of the noise
(common random numbers), so that even small differences between gaps are not chance. The independent check is brute
force: a grid of gaps, and where the force crosses its limit on it.

    python examples/best_gap.py       prints the best gap with the standard error of its rms, writes best_gap.png
"""

import numpy as np

import fembeam as fb
from contacts import KelvinVoigt

length, limit = 0.8, 12.5  # m, N
bar = fb.Section.rectangle(E=7.0e10, rho=2700.0, width=0.04, height=0.008)
scene = fb.Scene(
    fb.Beam(length, bar),
    [fb.Clamped(0.0)],
    masses=[fb.LumpedMass(length, mass=0.5)],
    stops=[fb.Stop(length, KelvinVoigt(3e3, damping=30.0))],
    damping=fb.ModalDamping(0.02),
    base=fb.BandNoise(std=2e-3, band=(5.0, 60.0), seed=1),
)
runs = {"duration": 30.0, "dt": 5e-3, "discard": 5.0, "seeds": range(6), "modes": 2}


def brute_force() -> tuple[float, float]:
    """Gap (m) and rms (m) where the force crosses its limit, between two gaps of a grid."""
    grid = fb.study.vary(scene, {"stops[0].gap": np.linspace(-10e-3, 0.0, 16)}, ["rms", "mean_force"], **runs)
    print(grid)
    gap = float(np.interp(-limit, -grid["mean_force"], grid.axes[0]))  # the force falls with the gap
    return gap, float(np.interp(gap, grid.axes[0], grid["rms"]))


if __name__ == "__main__":
    best = fb.study.minimise(scene, {"stops[0].gap": (-10e-3, 0.0)}, "rms", {"mean_force": limit}, **runs)
    print(best)
    best.figure().savefig("best_gap.png")
    gap, rms = brute_force()
    print(f"brute force: gap {1e3 * gap:.3f} mm, rms {1e3 * rms:.4f} mm")
    assert best.active == ("mean_force",)
    # the force scatters from gap to gap: over other noises both gaps are 0.07 mm apart (rms), of 0.67 mm between two
    assert abs(best.at["stops[0].gap"] - gap) < 0.5e-3, f"gap {gap:.4g} m by brute force"
    assert abs(best.value / rms - 1.0) < 0.08, f"rms {rms:.4g} m by brute force"
