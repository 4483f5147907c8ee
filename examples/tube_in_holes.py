"""A heat-exchanger tube in the holes of four baffle plates under a random force: the work rate of the impacts.

The tube moves in both directions across itself, with a radial clearance in each hole. White forces of the one-sided
level S (N² s/rad) along x and y, at z_f, give modes of modal mass 1 on average the power

    P = Σ π φ_i(z_f)² S/2

whatever the holes do; with forces up to ω_c only, mode i takes less by 2 ζ ω_i φ_i² S/ω_c. What is not lost in the tube
itself is what impacts in the holes take, plate by plate: the work rate, which wear goes by.

    python examples/tube_in_holes.py [FIGURE.png]
"""

import sys

import numpy as np
from matplotlib.figure import Figure

import fembeam as fb
from contacts import Hysteretic
from fembeam.statistics import Estimate
from fembeam.study import stationary

PLATES, FORCED = (0.6, 1.2, 1.8, 2.4), 1.4  # m
ZETA, LEVEL, HIGHEST = 0.04, 0.05, 2e4  # -, N² s/rad, ω_c in rad/s
CLEARANCES = (2e-4, 4e-4, 8e-4)  # m
TUBE = fb.Frame.straight(3.0, fb.Section.tube(E=2.0e11, rho=7850.0, outer=0.0191, inner=0.0168), bending_only=True)
LAW = Hysteretic.lankarani_nikravesh(1e9, restitution=0.6)


def model(clearance):
    """The tube between its end plates, four modes in each plane."""
    noise = [fb.BandNoise(np.sqrt(LEVEL * HIGHEST), (0.0, HIGHEST), seed=seed) for seed in (1, 2)]
    return fb.Scene(
        TUBE,
        supports=[fb.Clamped("A"), fb.Clamped("B")],
        stops=[fb.AnnularStop(z, LAW, clearance) for z in PLATES],
        damping=fb.ModalDamping(ZETA),
        forces=[fb.PointForce(FORCED, one, direction=way) for one, way in zip(noise, "xy", strict=True)],
    ).reduce(modes=8)


def powers(tube):
    """Power taken by each hole, and by all of them and the tube itself, W."""
    dampers = 2.0 * ZETA * tube.omega
    watch = {"tube": lambda run: run.q_dot**2 @ dampers}
    found = stationary(tube, 24.0, 1e-3, watch, discard=2.0, segment=256)
    return [found.power(i) for i in range(len(PLATES))], Estimate.joint(np.add, found.power(), found["tube"].mean)


def given(tube):
    """What the force gives, W."""
    squares = sum(tube.phi((FORCED, way)) ** 2 for way in "xy")
    return LEVEL * float(squares @ (0.5 * np.pi - 2.0 * ZETA * tube.omega / HIGHEST))


tubes = [model(clearance) for clearance in CLEARANCES]
rows, GIVEN = [powers(tube) for tube in tubes], given(tubes[0])
print(f"given: {GIVEN:.4g} W\nclearance / mm   work rates of the holes at {PLATES} m / mW, 95 %          all / W")
for clearance, (holes, taken) in zip(CLEARANCES, rows, strict=True):
    rates = "  ".join(f"{1e3 * one.value:6.1f} ± {1.96e3 * one.standard_error:3.1f}" for one in holes)
    print(f"{1e3 * clearance:14.2f}   {rates}   {taken!r}")
    low, high = taken.interval(0.9999)
    assert low - 1e-2 * GIVEN < GIVEN < high + 1e-2 * GIVEN
shares = [sum(one.value for one in holes) / GIVEN for holes, _ in rows]
assert shares[0] > shares[-1] > 0.1

run = tubes[1].simulate(duration=1.0, dt=2e-4)
figure = Figure(figsize=(8.4, 4.0), layout="constrained")
left, right = figure.subplots(1, 2)
for clearance, (holes, _) in zip(CLEARANCES, rows, strict=True):
    values, bars = 1e3 * np.array([(one.value, 1.96 * one.standard_error) for one in holes]).T
    left.errorbar(PLATES, values, bars, marker="o", ms=4, lw=1.0, capsize=3, label=f"{1e3 * clearance:g} mm")
left.set(xlabel="plate at z (m)", ylabel="work rate (mW)", ylim=0.0, title="Work rates; bars: 95 %")
left.legend(title="radial clearance")
fb.plot.orbit_in_clearance(run, stop=1, window=(0.5, 1.0), axes=right)
for path in sys.argv[1:]:
    figure.savefig(path, dpi=100)
