"""A folded solar panel held by preloaded snubbers: stiff while all hold, softer once some let go.

Snubbers of stiffness k press on both sides of the panel at two places, each with preload k p. As long as |u| < p there,
both sides hold and are a spring 2k; beyond, one side lets go and k u + k p is left, in the end a spring k. So the
frequency of free vibration falls from that of the panel on springs 2k, exact for small motion, towards that on springs
k. Both come from the exact transfer matrices of the panel,

    (u, u', M, V)' = A (u, u', M, V),    V jumps by -k u at a spring,    u = u' = 0 and M = V = 0 at the ends.

    python examples/solar_panel.py        prints the frequency over the amplitude
"""

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq

import fembeam as fb
from contacts import PiecewiseLinear

length, places, k, preload = 2.0, (0.9, 1.7), 4e3, 2e-3
panel = fb.Section.rectangle(7e10, 700.0, width=1.0, height=0.02)
scene = fb.Scene(
    beam=fb.Beam(length, panel),
    supports=[fb.Clamped(0.0)],
    stops=[fb.Stop(z, PiecewiseLinear([k]), -preload, side) for z in places for side in ("below", "above")],
)
model = scene.reduce(modes=8)


def exact(spring: float) -> float:
    """First natural frequency (rad/s) of the panel on two such springs."""

    def determinant(omega: float) -> float:
        A = np.diag([1.0, 1 / panel.bending_stiffness, 1.0], 1)
        A[3, 0] = panel.line_mass * omega**2
        jump = np.eye(4)
        jump[3, 0] = -spring
        T = expm(A * places[0])
        for before, after in zip(places, (*places[1:], length), strict=True):
            T = expm(A * (after - before)) @ jump @ T
        return float(np.linalg.det(T[2:, 2:]))

    return brentq(determinant, 51.0, 62.0, xtol=1e-12)


def frequency(tip: float) -> float:
    """Mean frequency (rad/s) of the free vibration after a pull that moves the tip by so much."""
    force = brentq(lambda force: tip_of(model.equilibrium({length: force})) - tip, 0.0, 1e5 * tip)
    run = model.simulate(duration=2.0, dt=5e-4, start=model.equilibrium({length: force}))
    q = run.q[:, 0]  # the first mode, free of the small fast ones
    up = np.flatnonzero((q[:-1] < 0) & (q[1:] >= 0))
    instants = run.t[up] - q[up] * 5e-4 / (q[up + 1] - q[up])
    return float(2 * np.pi * (len(instants) - 1) / (instants[-1] - instants[0]))


def tip_of(start: np.ndarray) -> float:
    """Displacement of the tip, m."""
    return float(model.phi(length) @ start[: len(model.omega)])


stiff, soft = exact(2 * k), exact(k)
pulls = [1e-3, 5e-3, 2e-2, 8e-2]
found = [frequency(tip) for tip in pulls]

assert abs(found[0] / stiff - 1) < 1e-5, f"small motion at {found[0]:.5f} rad/s, exact {stiff:.5f} rad/s"
assert all(np.diff(found) < 0), "the frequency does not fall with the amplitude"
assert 0 < found[-1] / soft - 1 < 0.01, f"large motion at {found[-1]:.3f} rad/s, limit {soft:.3f} rad/s"

if __name__ == "__main__":
    print(f"all snubbers hold: {stiff:.5f} rad/s, one side holds: {soft:.5f} rad/s (exact)")
    for tip, omega in zip(pulls, found, strict=True):
        print(f"pulled by {1e3 * tip:4.0f} mm: {omega:.5f} rad/s")
