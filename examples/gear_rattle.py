"""A loose gear rattles in its backlash: two impacts per period, as the theory of the impact pair has it.

An idle gear is free in a clearance ±c of the gear that drives it, which moves as A cos ωt along the pitch line; x is
the distance between them. In the symmetric motion it crosses the clearance once per half period, at constant absolute
speed V, and hits at the phase φ of the drive where

    V = A ω sin φ (1 + r)/(1 - r),    A cos φ + c = V π/2ω

hence cos(φ + ε) = -c/(A √(1 + S²)) with S = tan ε = (π/2)(1 + r)/(1 - r),
for restitution r and short impacts: C.N. Bapat, N. Popplewell, K. McLachlan, J. Sound Vib. 87 (1983) 19. The closing
speed is 2V/(1 + r). There is no beam here: `solvers.System` takes any matrices.

    python examples/gear_rattle.py        prints speed and phase of the impacts
"""

import math

import numpy as np

import fembeam as fb
import solvers
from contacts import Hysteretic

mass, clearance, amplitude, omega, restitution = 0.2, 1e-4, 5e-5, 200.0, 0.6
period = 2 * math.pi / omega

S = math.pi / 2 * (1 + restitution) / (1 - restitution)
phase = math.acos(-clearance / amplitude / math.hypot(1, S)) - math.atan(S)
V = amplitude * omega * math.sin(phase) * (1 + restitution) / (1 - restitution)
closing = 2 * V / (1 + restitution)

law = Hysteretic.achieving(1e12, restitution)
drive = fb.Harmonic(amplitude, omega, phase)  # t = 0 at an impact
rattle = solvers.System(
    M=[[mass]],
    C=[[0.0]],
    K=[[0.0]],
    contacts=[solvers.Contact([1.0], law, clearance), solvers.Contact([-1.0], law, clearance)],
    loads=[([-mass], drive.derivative(2))],
)
# a start near the motion, so that of several it is this one that settles
log = solvers.integrate(rattle, [0.99 * clearance], [-0.9 * restitution * closing], duration=200.3 * period).contacts
late = log.t_in > 150 * period
upper = late & (log.stop == 1)
found = np.mod(omega * log.t_in[upper] + phase + 1.0, 2 * math.pi) - 1.0

assert late.sum() in (100, 101, 102), f"{late.sum()} impacts in 50.3 periods"
assert np.ptp(log.speed_in[late]) < 1e-6 * closing, "the motion has not settled"
assert abs(log.speed_in[late].mean() / closing - 1) < 3e-3, f"{log.speed_in[late].mean():.5f} m/s, theory {closing:.5f}"
assert abs(found - phase).max() < 0.02, f"impact at {found.mean():.4f} rad, theory {phase:.4f} rad"

if __name__ == "__main__":
    print(f"closing speed {log.speed_in[late].mean():.5f} m/s, theory for short impacts {closing:.5f} m/s")
    print(f"impact at phase {found.mean():.4f} rad of the drive, theory {phase:.4f} rad")
    duration = (log.t_out - log.t_in)[upper].mean()
    print(f"an impact lasts {1e6 * duration:.1f} µs, {100 * duration / period:.2f} % of the period")
