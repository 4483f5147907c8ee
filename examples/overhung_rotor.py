"""An overhung rotor: its Campbell diagram, and a run through the critical speed against a stop on the housing.

The disk at the end of a clamped shaft (I_p > I_d) splits each frequency of standstill into a forward and a backward
whirl; an unbalance excites the forward one, where it has the frequency of the spin. A stop on one side stiffens the
rotor: on the way up it rubs far beyond that speed, on the way down it is met again only where the whirl without contact
has grown to the gap. Each spin is held for some revolutions, and starts from where the one before has left the rotor.

    python examples/overhung_rotor.py [FIGURE.png]
"""

import sys

import numpy as np
from matplotlib.figure import Figure

import fembeam as fb
from contacts import KelvinVoigt

SHAFT, LENGTH = fb.Section.circle(2.1e11, 7850.0, 0.04), 0.5
GAP, HOLD, LAW = 1e-4, 0.5, KelvinVoigt(2e6, 300.0)  # m, s


def rotor(spin=0.0, phase=0.0, stops=()):
    """The shaft with its disk and an unbalance of 100 g mm."""
    return fb.Scene(
        fb.Frame.straight(LENGTH, SHAFT, spin=spin, bending_only=True),
        supports=[fb.Clamped("A")],
        masses=[fb.Disk("B", mass=12.0, diametral=0.04, polar=0.075)],
        forces=[fb.Unbalance("B", 1e-4, phase)] if spin else [],
        stops=stops,
        damping=fb.ModalDamping(0.02),
    )


def without_contact(spin):
    """Amplitude along x of the steady whirl, m."""
    model = rotor(spin).reduce(4)
    pushed = sum(np.asarray(vector) * signal.tones()[1][0] for vector, signal in model.system.loads)
    resisting = np.diag(model.omega**2 - spin**2) + 1j * spin * model.system.by_rate
    return abs(model.phi(("B", "x")) @ np.linalg.solve(resisting, pushed))


def passed(spins):
    """Largest amplitude along x, and contacts, in the second half of each spin."""
    state, phase, found = None, 0.0, []
    for spin in spins:
        stop = fb.Stop("B", LAW, GAP, direction="x", name="housing")
        run = rotor(spin, phase, [stop]).reduce(4).simulate(HOLD, HOLD / 400, state)
        state, phase = run.end, phase + spin * HOLD
        found.append((np.abs(run.displacement("B", "x")[200:]).max(), np.sum(run.contacts.t_in > 0.5 * HOLD)))
    return np.transpose(found)


campbell = rotor().campbell(np.linspace(0.0, 400.0, 41), modes=4)
print(f"critical speeds: {campbell.critical.round(3)} rad/s")
exact = [-208.8577927993087, 223.8720794147543, -1790.270791832366, 2183.894511988107]  # shaft without rotary inertia
assert np.allclose(campbell.signed[30], exact, rtol=1e-3), "whirl at 300 rad/s"

spins = np.arange(212.0, 262.0, 4.0)
(up, rubs), (down, meets) = passed(spins), passed(spins[::-1])
critical, free = campbell.critical.max(), np.array([without_contact(spin) for spin in spins])
left, met = spins[rubs > 0].max(), spins[::-1][meets > 0].max()
print(f"critical speed {critical:.2f}; rubs up to {left:g} rad/s on the way up, from {met:g} rad/s on the way down")
assert met == spins[free > GAP].max(), "on the way down the stop is met where the free whirl reaches it"
assert left > 1.1 * critical, "on the way up it rubs far beyond the critical speed"
assert up.max() > 1.7 * GAP

figure = Figure(figsize=(8.4, 3.6), layout="constrained")
first, second = figure.subplots(1, 2)
fb.plot.campbell(campbell, axes=first)
first.set_ylim(150.0, 300.0)
for values, order, name in ((up, spins, "spin rising"), (down, spins[::-1], "spin falling"), (free, spins, "no stop")):
    second.plot(order, 1e3 * values, ".-" if name != "no stop" else "--", label=name)
second.axhline(1e3 * GAP, color="grey", linewidth=0.8)
second.set(xlabel="spin Ω / rad s⁻¹", ylabel="amplitude along x / mm", ylim=(0.0, 0.3))
second.legend()
for path in sys.argv[1:]:
    figure.savefig(path, dpi=150)
