"""A stop that just touches raises the frequency, to no more than twice: half a period without it, half with it.

    ω = 2 ω₁ω₂/(ω₁ + ω₂),    ω₂ = √(ω₁² + φ² k)

One mode of a cantilever and a linear stop of stiffness k: this is why the paper's beam resonates near twice its first
frequency (S.W. Shaw, P.J. Holmes, J. Sound Vib. 90 (1983) 129).

    python examples/bilinear.py        prints frequencies for softer and stiffer stops
"""

import math

import numpy as np

import fembeam as fb
from contacts import PiecewiseLinear

length = 0.26
steel = fb.Section.rectangle(E=2.1e11, rho=7850.0, width=0.02, height=0.003)


def frequencies(stiffness: float) -> tuple[float, float, float]:
    """Frequency (rad/s) of free vibration, its formula, and that without the stop."""
    scene = fb.Scene(
        beam=fb.Beam(length, steel),
        supports=[fb.Clamped(0.0)],
        stops=[fb.Stop(length, law=PiecewiseLinear([stiffness]))],
    )
    model = scene.reduce(modes=1)
    (free,), (phi,) = model.omega, model.phi(length)
    log = model.simulate(duration=0.3, start=[1e-3 / phi, 0.0]).contacts  # tip let go at 1 mm
    touching = math.sqrt(free**2 + phi**2 * stiffness)
    found = 2 * math.pi / np.diff(log.t_in)
    assert np.ptp(found) < 1e-6 * free, "not periodic"
    return float(found.mean()), 2 * free * touching / (free + touching), float(free)


results = {k: frequencies(k) for k in (1e2, 1e3, 1e4, 1e6)}

for k, (found, formula, free) in results.items():
    assert abs(found / formula - 1) < 1e-8, f"k = {k:g} N/m: {found:.6f} rad/s, formula {formula:.6f} rad/s"
    assert found < 2 * free

if __name__ == "__main__":
    for k, (found, formula, free) in results.items():
        print(
            f"k = {k:9g} N/m: {found:.4f} rad/s, formula {formula:.4f}, {found / free:.3f} times that of the beam alone"
        )
