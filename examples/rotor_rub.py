"""An unbalanced overhung rotor rubs in its housing: the coefficient of friction from which on it starts a dry whirl.

Near its critical speed the unbalance presses the rotor against the wall, where it slips all the way round. Seen from
the shaft that is an equilibrium. Friction drags the rotor backwards; where it gives the backward whirl on the stiff
wall more than damping takes, an eigenvalue has a positive real part and small disturbances grow. Asserted: runs on
both sides of the threshold decay and grow at the rate of that eigenvalue.

    python examples/rotor_rub.py [FIGURE.png]
"""

import sys

import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import brentq

import fembeam as fb
from contacts import KelvinVoigt

SPIN, CLEARANCE, RADIUS, WALL = 200.0, 2e-4, 0.02, KelvinVoigt(2e6, 300.0)
SECTION = fb.Section.circle(2.1e11, 7850.0, 2.0 * RADIUS)


def rotor(mu):
    """A shaft of half a metre with a disk at its end and an unbalance of 1000 g mm."""
    housing = fb.AnnularStop("B", WALL, CLEARANCE, friction=fb.Friction(mu, stiffness=2e6), radius=RADIUS)
    return fb.Scene(
        fb.Frame.straight(0.5, SECTION, spin=SPIN, bending_only=True),
        supports=[fb.Clamped("A")],
        masses=[fb.Disk("B", mass=12.0, diametral=0.04, polar=0.075)],
        stops=[housing],
        forces=[fb.Unbalance("B", 1e-3)],
        damping=fb.ModalDamping(0.02),
    ).reduce(modes=4)


def threshold(spin):
    """The coefficient of friction at which the rub becomes unstable."""
    return brentq(lambda mu: rotor(mu).rub(spin).growth, 0.01, 0.6, xtol=1e-4)


def disturbed(mu):
    """The rub, a run that begins a ten-thousandth beside it, and the rate at which it leaves or comes back, 1/s."""
    model = rotor(mu)
    rub = model.rub()
    run = model.simulate(0.7, 2e-4, rub.state * (1.0 + 1e-4 * np.eye(8)[0]))
    seen = run.place_in_clearance() @ [1.0, 1.0j] * np.exp(-1j * SPIN * run.t)  # from the shaft
    off = np.abs(seen - rub.radius * np.exp(1j * rub.angle))
    early, late = (off[(run.t > at) & (run.t < at + 0.05)].max() for at in (0.4, 0.65))
    return rub, run, np.log(late / early) / 0.25


spins = np.linspace(190.0, 290.0, 5)
borders = np.array([threshold(spin) for spin in spins])
at = threshold(SPIN)
results = {factor: disturbed(factor * at) for factor in (0.8, 1.2)}
for factor, (rub, _, rate) in results.items():
    print(f"μ = {factor * at:.4f}: {rub!r}; growth {rub.growth:.3f}, of the run {rate:.3f} 1/s")
    assert np.isclose(rate, rub.growth, rtol=0.05)
    assert rub.stable == (factor < 1.0)
print(f"threshold at {SPIN:g} rad/s: μ = {at:.4f}; from {borders.min():.4f} at {spins[np.argmin(borders)]:g} rad/s on")

whip = rotor(2.0 * at)
grown = whip.simulate(0.5, 5e-5, whip.rub().state * (1.0 + 0.05 * np.eye(8)[0]))
figure = Figure(figsize=(9.4, 4.0), layout="constrained")
left, right = figure.subplots(1, 2)
left.plot(spins, borders)
left.fill_between(spins, borders, 0.3, alpha=0.2, label="dry whirl")
left.set(xlabel="spin Ω / rad s⁻¹", ylabel="coefficient of friction μ", ylim=(0.0, 0.3))
left.legend(loc="upper left")
left.text(240.0, 0.08, "the rub is stable", ha="center")
fb.plot.orbit_in_clearance(grown, window=(0.0, 0.5), axes=right)
right.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8)
for path in sys.argv[1:]:
    figure.savefig(path, dpi=100)
