"""A contact law of one's own: a plain function, compiled once, used like any other.

    F = k δ³ (δ > 0),    ½ q̇₀² = ½ ω² q² + ¼ k (φ q)⁴  where the beam turns back

One undamped mode of a cantilever strikes the stop with the velocity q̇₀: energy gives the peak indentation.

    python examples/user_law.py        prints it and what the law tells of itself
"""

import numpy as np
from scipy.optimize import brentq

import fembeam as fb
from contacts import law


@law
def cubic(delta, delta_dot, entry_rate, stiffness=1e9):
    """F = k δ³: soft at first touch."""
    return stiffness * delta**3


length, speed, stiffness = 0.26, 0.8, 5e10
steel = fb.Section.rectangle(E=2.1e11, rho=7850.0, width=0.02, height=0.003)
scene = fb.Scene(
    beam=fb.Beam(length, steel),
    supports=[fb.Clamped(0.0)],
    stops=[fb.Stop(length, law=cubic(stiffness=stiffness))],
)
model = scene.reduce(modes=1)
(omega,), (phi,) = model.omega, model.phi(length)
start = np.array([0.0, -speed / phi])
contact = model.simulate(duration=0.02, start=start).contacts


def kinetic(delta: float) -> float:
    """Energy left in motion at an indentation, J."""
    return ((speed / phi) ** 2 - (omega * delta / phi) ** 2) / 2 - stiffness * delta**4 / 4


expected = brentq(kinetic, 0.0, 1.0, xtol=1e-16)

assert abs(contact.peak_indentation[0] / expected - 1) < 1e-7, f"{contact.peak_indentation[0]} m, energy {expected} m"
assert abs(contact.speed_out[0] / speed - 1) < 1e-7, "a law without damping gives back what it took"

if __name__ == "__main__":
    print(scene.stops[0].law.describe())
    print(f"deepest at {1e6 * contact.peak_indentation[0]:.6f} µm, from energy {1e6 * expected:.6f} µm")
    print(
        f"peak force {contact.peak_force[0]:.3f} N in a contact of {1e3 * (contact.t_out[0] - contact.t_in[0]):.3f} ms"
    )
