"""A friction damper at the tip of the paper's beam: too loose it hardly damps, too tight it is a spring; between, best.

The damper is a spring k in series with a slider of limit f. It sticks, and loses nothing, while the tip moves by less
than f/k; with the amplitude X it loses per cycle

    W = 4 f (X - f/k)

Each curve is a branch of periodic orbits with exact multipliers: phases of stick and slip are located, not smoothed.

    python examples/friction_damper.py [FIGURE.png]
"""

import sys

import numpy as np
from matplotlib.figure import Figure

import fembeam as fb
from contacts import Jenkins

TIP, STIFFNESS, LIMITS = 0.24445, 300.0, (0.1, 0.6, 1.2, 2.4, 10.0)  # m, N/m, N


def model(limit):
    """The paper's beam, without its stop, shaken."""
    return fb.Scene(
        beam=fb.Beam(0.2599, fb.Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)),
        supports=[fb.Clamped(0.0)],
        masses=[fb.LumpedMass(TIP, mass=25.4e-3, inertia=3.0e-6)],
        elements=[fb.Element(TIP, Jenkins(STIFFNESS, limit))],
        damping=fb.ModalDamping([0.02, 0.01]),
        base=fb.Harmonic(amplitude=1e-3, omega=95.0),
    ).reduce(modes=2)


figure = Figure(figsize=(6.8, 3.6), layout="constrained")
axis, tops = figure.subplots(), []
print("limit / N   top / mm   at / rad/s   loss / mJ   4 f (X - f/k)   largest |μ|")
for limit in LIMITS:
    branch = model(limit).branch("omega", (95.0, 145.0)).run()
    heights = np.array([0.5 * np.ptp(one) for one in branch.extremes(TIP)])
    best = branch.orbits[int(heights.argmax())]
    X = heights.max()
    loss = best.found.samples().energy.contact[-1]
    theory = 4 * limit * (X - limit / STIFFNESS) if limit < STIFFNESS * X else 0.0
    tops.append(1e3 * X)
    row = f"{limit:9.2f} {1e3 * X:10.3f} {best.parameter:12.2f} {1e3 * loss:11.5f} {1e3 * theory:15.5f}"
    print(f"{row} {abs(best.found.transverse[0]):13.4f}   {branch.status}")
    assert branch.stable.all()
    assert abs(loss - theory) < 1e-4 * limit * X
    axis.semilogy(branch.parameter, 1e3 * heights, label=f"f = {limit:g} N")
assert np.argmin(tops) == 2, "the limit between is the best"
assert abs(tops[2] - 8.625) < 0.01
assert tops[2] < 0.4 * min(tops[0], tops[-1])
axis.set(xlabel="drive frequency ω / rad s⁻¹", ylabel="amplitude at the damper / mm", yticks=[2, 5, 10, 20, 30])
axis.yaxis.set_major_formatter("{x:g}")
axis.yaxis.set_minor_formatter("")
axis.legend(title="limit of slip", frameon=False)
for path in sys.argv[1:]:
    figure.savefig(path, dpi=150)
