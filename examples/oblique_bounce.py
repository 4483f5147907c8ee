"""An elastic sphere bounces at an angle: it sticks, sticks for a while, or slips throughout (Maw, Barber, Fawcett).

At the point of contact a sphere resists along the surface like 2/7 of its mass, as the force turns it as well.
With the ratio k_n/k_t = (2 - ν)/(2 (1 - ν)) of the stiffnesses (Mindlin), its speeds v_n and v_t of approach, and

    ψ = v_t k_t/(μ v_n k_n),    χ = 7 k_t/(4 k_n),

it sticks from the beginning for ψ < 1 and slips throughout for ψ > 4χ - 1; between these it slips, sticks and slips.
The point of contact may come back the other way: the tangential spring returns what it has taken.

N. Maw, J.R. Barber, J.N. Fawcett, The oblique impact of elastic spheres, Wear 38 (1976) 101-114.

    python examples/oblique_bounce.py [FIGURE.png]
"""

import sys

import numpy as np
from matplotlib.figure import Figure

import fembeam as fb
import solvers
from contacts import KelvinVoigt

MASS, NU, MU, STIFFNESS, SPEED = 0.08, 0.3, 0.2, 4e5, 0.8  # kg, -, -, N/m, m/s
RATIO = 2.0 * (1.0 - NU) / (2.0 - NU)  # k_t/k_n
GROSS = 7.0 * RATIO - 1.0  # 4χ - 1

sphere = fb.Structure(
    K=np.zeros((2, 2)),
    M=np.diag([2.0 / 7.0 * MASS, MASS]),
    labels=[("contact", "x"), ("contact", "y")],
    nodes={"contact": (0.0, 0.0, 0.0)},
)
floor = fb.Stop(
    "contact",
    KelvinVoigt(STIFFNESS, 0.0),
    direction="-y",
    tangent="x",
    friction=fb.Friction(MU, stiffness=RATIO * STIFFNESS),
)
model = fb.Scene(sphere, stops=[floor]).reduce(modes=2)


def bounce(psi):
    """The run of one bounce that begins at the floor."""
    speeds = {("contact", "x"): psi * MU * SPEED / RATIO, ("contact", "y"): -SPEED}
    start = model.state({("contact", "y"): 1e-6}, speeds)
    return model.simulate(0.002, 5e-6, start, solver=solvers.Exponential(1e-10))


def regime(run):
    """What its slider did before the last slip, by which every contact ends."""
    return {("slip",): "sticks", ("stick", "slip"): "slips, sticks", (): "slips"}[tuple(run.transitions.event)]


angles = np.linspace(0.05, 6.95, 70)
runs = [bounce(psi) for psi in angles]
found = np.array([regime(run) for run in runs])
assert set(angles[found == "sticks"]) == set(angles[angles < 1.0])
assert set(angles[found == "slips"]) == set(angles[angles > GROSS])
after = np.array([run.velocity("contact", "x")[-1] for run in runs]) * RATIO / (MU * SPEED)
assert np.allclose(after[found == "slips"], (angles - 7.0 * RATIO)[found == "slips"], atol=1e-6)  # v_t - 7 μ v_n
print(f"sticks below ψ = 1, slips throughout above 4χ - 1 = {GROSS:.4f}; least ψ' = {after.min():.3f}")

figure = Figure(figsize=(8.4, 3.6), layout="constrained")
left, right = figure.subplots(1, 2)
for name in ("sticks", "slips, sticks", "slips"):
    left.plot(angles[found == name], after[found == name], ".", label=name)
left.set(xlabel="ψ before", ylabel="ψ after", title="Speed of the contact point along the floor")
left.legend()
for psi in (0.5, 3.0, 6.5):
    run = bounce(psi)
    right.plot(1e3 * run.t, run.friction() / (MU * run.contacts.peak_force[0]), label=f"ψ = {psi:g}")
right.set(xlabel="t / ms", ylabel="$F_t$ / largest μN", title="Force of friction", xlim=(0.0, 1.5))
right.legend()
for path in sys.argv[1:]:
    figure.savefig(path, dpi=100)
