"""A portal frame that sways against a stop at its eaves: frequencies, the branch over the drive's frequency, moments.

Asserted: four frequencies to 1e-6 of the exact dynamic stiffness; column shear + stop force = inertia of all above.

python examples/portal_frame.py     prints them and writes portal_frame.png
"""

import numpy as np
from matplotlib.figure import Figure

import fembeam as fb
from contacts import KelvinVoigt

steel = fb.Section.rectangle(E=2.1e11, rho=7850.0, width=0.05, height=0.1)
frame = fb.Frame(
    nodes={"A": (0, 0), "B": (0, 3), "C": (4, 3), "D": (4, 0)},
    members=[fb.Member("A", "B", steel), fb.Member("B", "C", steel), fb.Member("D", "C", steel)],
)
scene = fb.Scene(
    frame,
    supports=[fb.Clamped("A"), fb.Clamped("D")],
    stops=[fb.Stop("C", KelvinVoigt(2e6, 2e3), gap=4e-3, direction="x")],
    damping=fb.ModalDamping(0.02),
    base={"x": fb.Harmonic(amplitude=2e-4, omega=46.0)},
)
exact = [46.79676568080308, 137.6560947561103, 306.7971337148636, 327.2072572248291]
omega = scene.reduce(modes=4).omega
assert np.allclose(omega, exact, rtol=1e-6), omega

model = scene.reduce(modes=3, residual=True)
branch = model.branch("omega", (42.0, 60.0)).run()
highest = max(branch.orbits, key=lambda orbit: fb.plot.peak(orbit, ("C", "x")))

run = model.simulate(duration=4.0, dt=1e-3)
reactions = run.reactions()
columns = reactions[0]["x"] + reactions[1]["x"]
line, parts = steel.line_mass, []
for member, length in zip(frame.members, frame.lengths, strict=True):
    s = length * (np.arange(200) + 0.5) / 200
    moved = run.acceleration([(member.name, float(at)) for at in s], "x", absolute=True)
    parts.append(line * length * moved.mean(axis=1))
inertia = sum(parts)
error = np.abs(columns - run.force(0) - inertia).max() / np.abs(inertia).max()
assert error < 1e-4, f"reactions and inertia differ by {error:.2g}"

if __name__ == "__main__":
    print(model)
    moment = run.extremes("moment").largest
    sway = 1e3 * fb.plot.peak(highest, ("C", "x"))
    print(f"{len(branch.orbits)} orbits, {sway:.2f} mm at {highest.parameter:.2f} rad/s; balance to {error:.1g}")
    print(f"largest moment {moment[0]:.0f} N m at {moment[1]}, stop force {run.contacts.peak_force.max():.0f} N")
    figure = Figure(figsize=(8.0, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    fb.plot.branch([branch], ("C", "x"), axes=left)
    fb.plot.deflected(run, axes=right)
    figure.savefig("portal_frame.png")
