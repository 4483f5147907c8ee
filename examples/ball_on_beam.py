"""A steel ball falls on a steel beam: Timoshenko's problem, against his integral equation for a long beam.

    δ(t) = v t - 1/m ∫₀ᵗ (t - τ) F dτ - 1/(ρA √(2πa)) ∫₀ᵗ √(t - τ) F dτ,    F = K δ^1.5,  a = √(EI/ρA)

The last term is what an infinite beam gives way under a point force; it holds until waves come back from the supports.
A ball of 1 cm radius hits the middle of a beam of 1 cm × 1 cm at 1 cm/s, as in S.P. Timoshenko, Zeitschrift für
Mathematik und Physik 62 (1913); the beam here is 60 cm long.

    python examples/ball_on_beam.py        prints peak force and contact time, of the scene and of the theory
"""

import math

import numpy as np

import fembeam as fb
from contacts import Hertz

E, rho, radius, speed, length = 2.16e11, 7960.0, 0.01, 0.01, 0.6
steel = fb.Section.rectangle(E, rho, width=0.01, height=0.01)
law = Hertz.of_spheres(E, 0.3, radius, E, 0.3, math.inf)
mass = 4 / 3 * math.pi * radius**3 * rho
scene = fb.Scene(
    beam=fb.Beam(length, steel),
    supports=[fb.Pinned(0.0), fb.Pinned(length)],
    impactors=[fb.Impactor(length / 2, mass, velocity=-speed, law=law)],
)


def long_beam(steps: int = 4000, duration: float = 2.5e-4) -> tuple[float, float]:
    """Peak force and contact time by the trapezoidal rule; both kernels vanish at τ = t, so it is explicit."""
    h = duration / steps
    t = h * np.arange(steps + 1)
    a = math.sqrt(steel.bending_stiffness / steel.line_mass)
    kernel = t / mass + np.sqrt(t) / (steel.line_mass * math.sqrt(2 * math.pi * a))
    force = np.zeros(steps + 1)
    for i in range(1, steps + 1):
        delta = speed * t[i] - h * (force[:i] @ kernel[i:0:-1])
        if delta <= 0:
            break
        force[i] = law.stiffness * delta**1.5
    return float(force.max()), float(t[i])


peak, time = long_beam()
peaks = []
for modes in (5, 15, 45):
    log = scene.reduce(modes).simulate(2.5e-4).contacts
    peaks.append(float(log.peak_force[0]))

assert len(log) == 1
assert abs(peaks[-1] / peak - 1) < 2e-3, f"peak force {peaks[-1]:.4f} N, theory {peak:.4f} N"
assert abs(log.t_out[0] / time - 1) < 2e-3, f"contact time {log.t_out[0]:.6g} s, theory {time:.6g} s"
assert abs(peaks[1] / peaks[2] - 1) < 0.2 * abs(peaks[0] / peaks[2] - 1), "the peak does not converge with the modes"

if __name__ == "__main__":
    print("peak force with 5, 15, 45 modes: " + ", ".join(f"{value:.4f} N" for value in peaks))
    print(f"Timoshenko's equation for a long beam: {peak:.4f} N")
    print(f"contact time {1e6 * log.t_out[0]:.2f} µs, theory {1e6 * time:.2f} µs")
    print(f"the ball leaves with {log.impulse[0] / mass - speed:.5f} m/s of its {speed} m/s")
