"""An L-shaped pipe in gapped supports under an earthquake of three components: floor spectra of a valve, stresses.

The pipe runs from A through B and C to D; halfway up the riser B-C a box holds it with 1 mm play along x and y.
pipe.toml is the same scene, and asks for the same floor spectra.
Asserted: reactions and contact forces are the inertia of pipe and valve, in all three directions, to 1e-4.

python examples/pipe.py     prints them and writes pipe.png
"""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import fembeam as fb
from contacts import KelvinVoigt


def ground(column):
    """A made record (m/s²) of 8 s that rises and dies away."""
    path = Path(__file__).with_name("pipe_ground.csv")
    return fb.Record.from_csv(path, (0, column), quantity="acceleration", interpolation="linear")


section = fb.Section.tube(E=2.0e11, rho=7900.0, outer=0.0603, inner=0.0525)
nodes = {"A": (0, 0, 0), "B": (2, 0, 0), "C": (2, 0, 1.5), "D": (2, 1, 1.5)}
pipe = fb.Frame.polyline(nodes, section)
box = KelvinVoigt(stiffness=1e6, damping=8e2, clamp=True)
scene = fb.Scene(
    pipe,
    supports=[fb.Clamped("A"), fb.Clamped("D")],
    masses=[fb.LumpedMass("C", mass=12.0, inertia=(0.05, 0.05, 0.08), offset=(0.0, 0.0, 0.1), name="valve")],
    stops=[fb.Stop(("B-C", 0.75), box, gap=1e-3, direction=way) for way in ("x", "-x", "y", "-y")],
    damping=fb.Rayleigh(alpha=1.0, beta=1e-4),
    base={"x": ground(1), "y": ground(2), "z": ground(3)},
)
model = scene.reduce(modes=10, residual=True)
run = model.simulate(duration=8.0, dt=2.5e-4)
reactions = run.reactions()

periods = np.geomspace(0.02, 1.0, 50)
floor = {way: run.floor_spectrum(("valve", way), periods=periods, zeta=0.02) for way in "xyz"}
stress = run.extremes("stress").largest

# momentum, along x, y, z: what supports and box exert is the inertia of the pipe, here summed along it, and the valve
pushed = {"x": run.force(1) - run.force(0), "y": run.force(3) - run.force(2), "z": 0.0}
arm = 0.1  # m; the valve's centre turns with C
turned = {"x": arm * run.acceleration("valve", "ry"), "y": -arm * run.acceleration("valve", "rx"), "z": 0.0}
errors = []
for way in "xyz":
    inertia = 12.0 * (run.acceleration("valve", way, absolute=True) + turned[way])
    for member, length in zip(pipe.members, pipe.lengths, strict=True):
        places = [(member.name, float(s)) for s in length * (np.arange(100) + 0.5) / 100]
        inertia += section.line_mass * length * run.acceleration(places, way, absolute=True).mean(axis=1)
    given = reactions[0][way] + reactions[1][way] + pushed[way]
    errors.append(np.abs(given - inertia).max() / np.abs(inertia).max())
assert max(errors) < 1e-4, f"reactions and inertia differ by {max(errors):.2g}"

if __name__ == "__main__":
    print(model)
    peak = run.contacts.peak_force.max()
    print(f"{len(run.contacts)} contacts, largest force {peak:.0f} N, balance to {max(errors):.1g}")
    print(f"largest stress at the lower fibre {stress[0] / 1e6:.1f} MPa at {stress[1]}, t = {stress[2]:.3f} s")
    forces = run.section_forces(("A-B", 0.0))
    print("at A:", ", ".join(f"{name} {np.abs(values).max():.0f}" for name, values in forces.items()), "N, N m")
    for way, found in floor.items():
        most = int(np.argmax(found.acceleration[0]))
        print(f"valve along {way}: {found.acceleration[0, most]:.0f} m/s² at {periods[most]:.3f} s")
    figure = Figure(figsize=(8.0, 4.0), layout="constrained")
    fb.plot.deflected(run, axes=figure.add_subplot(1, 2, 1, projection="3d"))
    axis = figure.add_subplot(1, 2, 2)
    for way, found in floor.items():
        axis.loglog(periods, found.acceleration[0], label=f"along {way}")
    axis.set(xlabel="period / s", ylabel="acceleration of the valve / m s⁻²")
    axis.legend()
    figure.savefig("pipe.png")
