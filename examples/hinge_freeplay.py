"""A flap on a hinge with freeplay: the period grows as the swing gets smaller, since it drifts between its stops.

A bar of moment of inertia J, free to turn by ±gap, then held by a moment κ (|θ| - gap):

    T = 4 gap/Ω + 2π √(J/κ),    Ω its rate between the stops

At a stiff hinge modes alone converge like 1/N; with the static shape of its moment few are enough. A beam pinned at
both ends with a hinge spring has κ (cot x - coth x) = 2 x EI/L, ω = (x/L)² √(EI/ρA).
"""

import numpy as np
from scipy.optimize import brentq

import fembeam as fb
from contacts import KelvinVoigt

L, KAPPA, GAP = 0.4, 120.0, np.radians(0.5)
steel = fb.Section.rectangle(2.1e11, 7850.0, width=0.03, height=0.006)
inertia = steel.rho * steel.A * L**3 / 3

stops = [fb.Stop(0.0, KelvinVoigt(KAPPA, 0.0), GAP, side, of="rotation") for side in ("below", "above")]
flap = fb.Scene(fb.Beam(L, steel), [fb.Pinned(0.0)], stops=stops).reduce(modes=1)  # the rigid rotation
print("rate rad/s   period s   theory s")
for rate in (0.1, 0.3, 1.0, 3.0):
    theory = 4 * GAP / rate + 2 * np.pi * np.sqrt(inertia / KAPPA)
    run = flap.simulate(3.2 * theory, start=flap.state(velocity=lambda z, rate=rate: rate * z))
    log = run.contacts
    entries = log.t_in[log.stop == 1]  # the stop above, reached first
    period = np.diff(entries).mean()
    print(f"{rate:10.1f} {period:10.6f} {theory:10.6f}")
    assert abs(period / theory - 1) < 1e-8

EI = steel.E * steel.I
stiff = 1000 * EI / L
root = brentq(lambda x: stiff * L / EI * (np.cos(x) - np.sin(x) / np.tanh(x)) - 2 * x * np.sin(x), np.pi + 1e-6, 6.2)
exact = (root / L) ** 2 * np.sqrt(EI / (steel.rho * steel.A))
hinge = fb.Element(0.0, KelvinVoigt(stiff, 0.0), of="rotation")  # acts always, both ways
held = fb.Scene(fb.Beam(L, steel), [fb.Pinned(0.0), fb.Pinned(L)], elements=[hinge])
print(f"\nstiff hinge spring, first frequency: exact {exact:.3f} rad/s")
for modes, residual in ((1, False), (20, False), (1, True), (4, True)):
    model = held.reduce(modes, residual=residual)
    stiffness, _ = model.linear_elements
    omega = np.sqrt(np.linalg.eigvalsh(model.system.K + stiffness)[0])
    shape = " and static shape" if residual else ""
    print(f"{modes:3d} modes{shape:17s} {omega:12.3f} rad/s, {omega / exact:.6f} of it")
assert abs(omega / exact - 1) < 1e-6
