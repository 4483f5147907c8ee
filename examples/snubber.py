"""A pipe between two snubbers with friction in an earthquake: what blows and what rubbing take, and what they bear.

The pipe sags onto the lower plate of its guide and slides on it along x; the ground shakes it along x and y. Asserted:
what supports, plates and friction exert is the inertia and weight of the pipe, along both directions to 1e-4, and the
losses of friction by the log are those of the energy balance.

    python examples/snubber.py [FIGURE.png]
"""

import sys

import numpy as np
from matplotlib.figure import Figure

import fembeam as fb
from contacts import KelvinVoigt

LENGTH, RISE = 3.0, 1.2  # m
SECTION = fb.Section.tube(E=2.0e11, rho=7900.0, outer=0.0603, inner=0.0525)


def ground(seed, size):
    """A made record (m/s²) of 4 s that rises and dies away."""
    t = 0.01 * np.arange(401)
    shaken = size * np.random.default_rng(seed).standard_normal(len(t)) * np.sin(np.pi * t / t[-1]) ** 2
    return fb.Record(t, shaken, quantity="acceleration", interpolation="linear")


def shaken(mu):
    """An L-shaped pipe in its plane; its corner in a guide."""
    rub = {"law": KelvinVoigt(stiffness=2e5, damping=3e2), "friction": fb.Friction(mu, stiffness=1.6e5), "tangent": "x"}
    model = fb.Scene(
        fb.Frame.polyline({"A": (0.0, 0.0), "B": (0.0, RISE), "C": (LENGTH, RISE)}, SECTION),
        supports=[fb.Clamped("A")],
        masses=[fb.LumpedMass("C", mass=6.0)],
        stops=[fb.Stop("C", gap=gap, direction=way, **rub) for gap, way in ((5e-3, "-y"), (8e-3, "y"))],
        damping=fb.Rayleigh(alpha=1.0, beta=2e-4),
        base={"x": ground(1, 4.0), "y": ground(2, 4.0)},
        gravity=9.81,
    ).reduce(modes=6, residual=True)
    return model.simulate(4.0, 5e-4, model.equilibrium())


def unbalanced(run):
    """Largest difference of what acts on the pipe and its inertia, relative, along x and y."""
    lower, upper = run.force(0), run.force(1)  # N and the force along x
    pushed = {"x": lower[:, 1] + upper[:, 1], "y": lower[:, 0] - upper[:, 0]}
    found = []
    for way, pull in (("x", 0.0), ("y", 9.81)):
        inertia = 6.0 * (run.acceleration("C", way, absolute=True) + pull)
        for name, length in (("A-B", RISE), ("B-C", LENGTH)):
            places = [(name, float(s)) for s in length * (np.arange(200) + 0.5) / 200]
            moved = run.acceleration(places, way, absolute=True).mean(axis=1)
            inertia += SECTION.line_mass * length * (moved + pull)
        found.append(np.abs(run.reactions()[0][way] + pushed[way] - inertia).max() / np.abs(inertia).max())
    return max(found)


rubbed, smooth = shaken(0.4), shaken(1e-3)
error = unbalanced(rubbed)
assert error < 1e-4, f"forces and inertia differ by {error:.2g}"
held = sum(rubbed.friction(i)[-1] ** 2 / 3.2e5 for i in (0, 1))  # by the tangential springs
assert np.isclose(rubbed.friction_loss[-1].sum(), rubbed.energy.friction[-1] - held, rtol=1e-6)
for name, run in (("with friction", rubbed), ("almost none", smooth)):
    sway, loss = 1e3 * np.ptp(run.displacement("C", "x")), run.losses
    print(f"{name}: sway {sway:.1f} mm, blows take {loss.impact.sum():.3g} J, rubbing {loss.friction.sum():.3g} J")
print(f"{len(rubbed.contacts)} contacts, largest {rubbed.contacts.peak_force.max():.0f} N; balance to {error:.1g}")

figure = Figure(figsize=(8.4, 3.6), layout="constrained")
left, right = figure.subplots(1, 2)
for name, run in (("almost none", smooth), ("μ = 0.4", rubbed)):
    left.plot(run.t, 1e3 * run.displacement("C", "x"), label=name)
left.set(xlabel="t / s", ylabel="displacement of C along x / mm")
left.legend()
right.plot(1e3 * rubbed.displacement("C", "x"), rubbed.friction(0), linewidth=0.6)
right.set(xlabel="displacement of C along x / mm", ylabel="$F_t$ of the lower plate / N")
for path in sys.argv[1:]:
    figure.savefig(path, dpi=100)
