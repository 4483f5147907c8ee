"""Matrices of one's own, `solvers` alone: a rod flies against a rigid wall and bounces off it.

    contact time 2L/c,  impulse 2 m v,  c = √(E/ρ):    a wave runs to the free end and back, then the rod leaves

B. de Saint-Venant, J. Math. Pures Appl. 12 (1867) 237. Any M, C, K will do: here bar elements with lumped masses and
C = 0, which in free flight move as a rigid body; the wall is a stiff linear stop at the first node.

    python examples/matrices.py        prints contact time and impulse, of the matrices and of the theory
"""

import math

import numpy as np

import solvers
from contacts import PiecewiseLinear

E, rho, A, length, speed, n = 2.1e11, 7850.0, 1e-4, 0.5, 0.1, 80
h = length / n
mass = rho * A * h * np.r_[0.5, np.ones(n - 1), 0.5]
K = E * A / h * (np.diag(np.r_[1.0, 2 * np.ones(n - 1), 1.0]) - np.eye(n + 1, k=1) - np.eye(n + 1, k=-1))
touching = np.eye(n + 1)[0]  # delta = -touching @ q, the wall pushes along +touching

rod = solvers.System(
    M=np.diag(mass),
    C=np.zeros_like(K),
    K=K,
    contacts=[solvers.Contact(touching, PiecewiseLinear([10 * E * A / h]))],
)
duration = 2 * length / math.sqrt(E / rho)
arrived = solvers.integrate(rod, np.zeros(n + 1), -speed * np.ones(n + 1), 1.5 * duration)
log, momentum = arrived.contacts, mass @ arrived.q_dot[-1]

assert abs(log.t_out[-1] / duration - 1) < 0.02, f"it leaves after {log.t_out[-1]:.4g} s, theory {duration:.4g} s"
assert abs(log.impulse.sum() / (2 * mass.sum() * speed) - 1) < 0.02, f"impulse {log.impulse.sum():.5f} N s"
assert abs(momentum + mass.sum() * speed - log.impulse.sum()) < 1e-9, "momentum and impulse disagree"

if __name__ == "__main__":
    print(f"{len(log)} contact(s); leaves after {1e6 * log.t_out[-1]:.2f} µs, theory {1e6 * duration:.2f} µs")
    print(f"impulse {log.impulse.sum():.6f} N s, theory {2 * mass.sum() * speed:.6f} N s")
    print(f"mean force {log.impulse.sum() / log.t_out[-1]:.1f} N, theory {speed * A * math.sqrt(E * rho):.1f} N")
