"""One periodic orbit and its Floquet multipliers, which tell whether a small disturbance dies out.

    μ_1 μ_2 … μ_2n = exp(-2 T Σ ζ_i ω_i)

An elastic stop neither adds nor takes volume in phase space, so the product of all multipliers is that of the modal
damping alone (Liouville), however hard the beam strikes. The largest decides: an orbit can lose volume and yet be
unstable.

    python examples/orbit.py        prints the orbit and writes orbit.png
"""

import math
from dataclasses import replace

import numpy as np

import fembeam as fb
from contacts import Hertz

z_stop = 0.24445
scene = fb.Scene(
    beam=fb.Beam(0.2599, fb.Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)),
    supports=[fb.Clamped(0.0)],
    masses=[fb.LumpedMass(z_stop, mass=25.4e-3, inertia=3.0e-6)],
    stops=[fb.Stop(z_stop, law=Hertz(2.1e8))],
    damping=fb.ModalDamping([0.02, 0.01]),
    base=fb.Harmonic(amplitude=1e-3, omega=215.0),
)
slower = replace(scene, base=fb.Harmonic(amplitude=1e-3, omega=180.0))


def studied(scene: fb.Scene, near: fb.Orbit | None = None) -> tuple[fb.Orbit, float, float]:
    """The orbit of the load's period, the product of its multipliers and what damping alone says."""
    model = scene.reduce(modes=2)
    orbit = model.orbit(period=1, start=near)
    period = 2 * math.pi / scene.base.omega
    return orbit, float(np.prod(orbit.multipliers).real), math.exp(-2 * period * model.zeta @ model.omega)


results = [studied(scene)]
results.append(studied(slower, results[0][0]))  # motion from rest is chaotic there and need not come near

for orbit, product, volume in results:
    assert abs(product / volume - 1) < 1e-9, f"product of the multipliers {product}, from damping {volume}"
    assert orbit.stable == (max(abs(orbit.multipliers)) < 1)
assert [orbit.stable for orbit, *_ in results] == [True, False], "215 rad/s is stable, 180 rad/s is not"

if __name__ == "__main__":
    for orbit, product, volume in results:
        print(f"{orbit} moduli " + ", ".join(f"{abs(multiplier):.4f}" for multiplier in orbit.multipliers))
        print(f"    product {product:.12f}, from modal damping alone {volume:.12f}")
    fb.plot.orbit(results[0][0]).savefig("orbit.png", dpi=110, metadata={"Software": None})
