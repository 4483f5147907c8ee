"""A friction damper under a random force: where the power goes, which does not depend on the damper.

A white force of the one-sided level S (N² s/rad) gives a mode of modal mass 1 and shape φ, on average, the power

    P = π φ² S/2

whatever else acts on it. A damper of limit f at the same place takes most of it if f is neither small nor large.
With a force up to ω_c only, P is less by 2 ζ ω φ² S/ω_c.

    python examples/friction_noise.py [FIGURE.png]
"""

import sys

import numpy as np
from matplotlib.figure import Figure

import fembeam as fb
from contacts import Jenkins
from fembeam.statistics import Estimate
from fembeam.study import stationary

TIP, ZETA, LEVEL, BAND = 0.5, 0.02, 1e-2, 40.0  # m, -, N² s/rad, ω_c over ω
LIMITS = np.geomspace(0.5, 50.0, 7)  # N
BEAM = fb.Scene(fb.Beam(TIP, fb.Section.circle(2.1e11, 7800.0, 0.01)), [fb.Clamped(0.0)]).reduce(modes=1)
OMEGA, PHI = float(BEAM.omega[0]), float(BEAM.phi(TIP)[0])
STIFFNESS = 3.0 * (OMEGA / PHI) ** 2  # N/m, of the damper
GIVEN = PHI**2 * LEVEL * (0.5 * np.pi - 2.0 * ZETA / BAND)


def powers(limit):
    """Power taken by the damper, and by all, W."""
    noise = fb.BandNoise(np.sqrt(LEVEL * BAND * OMEGA), (0.0, BAND * OMEGA), seed=1)
    scene = fb.Scene(
        BEAM.scene.beam,
        BEAM.scene.supports,
        forces=[fb.PointForce(TIP, noise)],
        elements=[fb.Element(TIP, Jenkins(STIFFNESS, limit))],
        damping=fb.ModalDamping(ZETA),
    )
    rate = {"q_dot": lambda run: run.q_dot[:, 0]}
    found = stationary(scene.reduce(modes=1), 16 * 600.0 / OMEGA, 0.15 / OMEGA, rate, segment=256)
    damper = found.power(0)
    return damper, Estimate.joint(lambda p, v2: p + 2 * ZETA * OMEGA * v2, damper, found["q_dot"].variance)


rows = [powers(limit) for limit in LIMITS]
print(f"given: {GIVEN:.4g} W\nlimit / N   damper / W   all / W")
for limit, (damper, taken) in zip(LIMITS, rows, strict=True):
    print(f"{limit:9.2f}   {damper!r:20} {taken!r}")
    low, high = taken.interval(0.999999)  # seven limits share one noise
    assert low - 1e-3 * GIVEN < GIVEN < high + 1e-3 * GIVEN
shares = [damper.value / GIVEN for damper, _ in rows]
assert 0 < np.argmax(shares) < len(LIMITS) - 1
assert max(shares) > 0.8

figure = Figure(figsize=(6.4, 3.6), layout="constrained")
axis = figure.subplots()
axis.axhline(1.0, color="0.6", lw=1.0, label="given, π φ² S/2")
for number, name in enumerate(("damper", "damper and beam")):
    ends = np.array([row[number].interval() for row in rows]).T / GIVEN
    values = np.array([row[number].value for row in rows]) / GIVEN
    axis.errorbar(LIMITS, values, abs(ends - values), marker="o", ms=4, lw=1.0, capsize=3, label=name)
axis.set(xscale="log", xlabel="limit of slip (N)", ylabel="mean power taken / given", ylim=(0.0, 1.25))
axis.set_title("A friction damper under a white force; bars: 95 %")
axis.legend(loc="lower center")
for path in sys.argv[1:]:
    figure.savefig(path, dpi=100)
