"""Which motion a start comes to: basins of attraction of the paper's beam where two periodic orbits compete.

At 330 rad/s one mode of the beam has two stable orbits of twice the load's period, with two and with three impacts. The
map takes every start of a grid to its end in one compiled loop. The independent check: random starts of the same
plane, settled one by one with Newton's method at the end, come to either orbit as often as the map's areas say.

    python examples/basins.py        prints the shares and writes basins.png
"""

import os

import numpy as np

import fembeam as fb
from contacts import Hysteretic

z_stop, sample = 0.24445, 200
scene = fb.Scene(
    beam=fb.Beam(0.2599, fb.Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)),
    supports=[fb.Clamped(0.0)],
    masses=[fb.LumpedMass(z_stop, mass=25.4e-3, inertia=3.0e-6)],
    stops=[fb.Stop(z_stop, law=Hysteretic.lankarani_nikravesh(2.1e8, restitution=0.5))],
    damping=fb.ModalDamping(0.02),
    base=fb.Harmonic(amplitude=1e-3, omega=330.0),
)
model = scene.reduce(modes=1)
x_span, y_span = (0.0, 0.04), (-6.0, 6.0)  # m above the stop, m/s
found = fb.study.basins(
    model, "displacement", x_span, "velocity", y_span, points=(120, 90), threads=os.cpu_count() or 1
)

random = np.random.default_rng(2003)
places, speeds = random.uniform(*x_span, sample), random.uniform(*y_span, sample)
starts = np.outer(places, found.x.direction) + np.outer(speeds, found.y.direction)
settled = model.attractors(starts=list(starts))

share = found.shares[0]
sampled = sum(one.count for one in settled if one.name == found.attractors[0].name) / sample
bound = 4.0 * np.sqrt(share * (1.0 - share) / sample)  # four standard errors: 99.99 %
assert abs(sampled - share) < bound, f"{sampled:.3f} of random starts, {share:.3f} of the map, bound {bound:.3f}"
assert found.shares.sum() > 0.99, "next to all starts settle"

if __name__ == "__main__":
    print(found)
    print(f"{found.attractors[0].name}: {share:.1%} of the map, {sampled:.1%} of {sample} random starts")
    found.figure().savefig("basins.png", dpi=110, metadata={"Software": None})
