"""A ship berths against a fender on a steel pile: peak force from the energy it brings.

    ½ m v² = ½ F²/k_pile + E_fender(F),    k_pile = 3 EI/L³

holds when the pile bends slowly compared with its own vibrations. The fender is soft for 0.3 m, then 4 times stiffer:
a piecewise-linear law, landed on at its knee. The ship floats 0.5 m away at the start.

    python examples/ship_fender.py        prints the forces
"""

import math

from scipy.optimize import brentq

import fembeam as fb
from contacts import PiecewiseLinear

ship, speed = 1.2e6, 0.25  # kg with the water that moves along, m/s
soft, hard, knee = 2.5e5, 1e6, 0.3  # N/m, N/m, m
pile = fb.Section.tube(2.1e11, 7850.0, outer=1.2, inner=1.16)
length = 15.0
scene = fb.Scene(
    beam=fb.Beam(length, pile),
    supports=[fb.Clamped(0.0)],
    impactors=[fb.Impactor(length, ship, velocity=-speed, law=PiecewiseLinear([soft, hard], knots=[knee]), gap=0.5)],
)
k_pile = 3 * pile.bending_stiffness / length**3


def energy(force: float) -> float:
    """Stored in pile and fender at a force, J."""
    first = min(force, soft * knee)
    second = force - first
    return force**2 / (2 * k_pile) + first**2 / (2 * soft) + soft * knee * second / hard + second**2 / (2 * hard)


expected = brentq(lambda force: energy(force) - ship * speed**2 / 2, 0.0, 1e8)
run = scene.reduce(modes=3).simulate(duration=10.0, dt=0.01)
log = run.contacts

assert len(log) == 1
assert abs(log.t_in[0] - 0.5 / speed) < 1e-9, "it does not arrive when it should"
assert abs(log.peak_force[0] / expected - 1) < 0.01, f"peak {log.peak_force[0]:.0f} N, energy says {expected:.0f} N"
assert abs(run.moment(0.0)).max() > 0.98 * expected * length, "the pile is not bent by the force"
assert log.peak_indentation[0] > knee, "the fender's knee is not reached"

if __name__ == "__main__":
    stress, z, t = run.extremes("stress").largest
    print(f"peak force {log.peak_force[0] / 1e3:.1f} kN, from energy {expected / 1e3:.1f} kN")
    print(f"fender pressed by {log.peak_indentation[0]:.3f} m in a contact of {log.t_out[0] - log.t_in[0]:.2f} s")
    print(f"largest stress in the pile {abs(stress) / 1e6:.0f} N/mm² at z = {z:.2f} m, t = {t:.2f} s")
    leaving = run.impactor_velocity()[-1]
    print(f"the ship leaves with {math.copysign(leaving, 1):.3f} m/s")
