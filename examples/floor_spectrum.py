"""A pipe between gapped supports in an earthquake: support forces, floor spectrum, and what the gap does to both.

Σ reactions + contact forces = Σ m (ü + ÿ);   floor spectrum: max |x'' + a| of oscillators on the pipe's absolute motion

python examples/floor_spectrum.py     prints them and writes floor_spectrum.png
"""

import numpy as np

import fembeam as fb
from contacts import Hertz

# a made record: broad-band ground acceleration (m/s²) of 10 s that rises and dies away
rng, step = np.random.default_rng(3), 0.01
t = step * np.arange(1001)
shaken = 2.0 * rng.standard_normal(len(t)) * np.sin(np.pi * t / t[-1]) ** 2
ground = fb.Record(t, shaken, quantity="acceleration", interpolation="linear")

length, middle = 6.0, 2.7
pipe = fb.Section.tube(E=2.0e11, rho=7850.0, outer=0.114, inner=0.102)
scene = fb.Scene(
    beam=fb.Beam(length, pipe),
    supports=[fb.Pinned(0.0), fb.Pinned(length)],
    stops=[fb.Stop(middle, Hertz(5e8), gap=2e-3, side=side) for side in ("below", "above")],
    damping=fb.ModalDamping(0.03),
    base=ground,
)
model = scene.reduce(modes=10)
run = model.simulate(duration=10.0, dt=1e-4)
reactions = run.reactions()

# momentum: supports and stops carry the inertia of the whole pipe, here summed along it
z = length * (np.arange(600) + 0.5) / 600
inertia = pipe.line_mass * length * run.acceleration(z, absolute=True).mean(axis=1)
pushed = run.force(0) - run.force(1)
error = np.abs(reactions.force + pushed - inertia).max() / np.abs(inertia).max()
assert error < 1e-4, f"reactions and inertia differ by {error:.2g}"

periods = np.geomspace(0.02, 2.0, 60)
ground_spectrum = fb.response_spectrum(t, shaken, periods=periods, zeta=0.05)
floor = run.floor_spectrum(middle, periods=periods, zeta=0.05)
free = scene.beam, scene.supports
smooth = fb.Scene(*free, damping=scene.damping, base=ground).reduce(modes=10).simulate(duration=10.0, dt=1e-4)
without = smooth.floor_spectrum(middle, periods=periods, zeta=0.05)

if __name__ == "__main__":
    print(f"first frequency {model.omega[0]:.1f} rad/s, {len(run.contacts)} contacts, balance to {error:.1g}")
    print(reactions)
    print(f"without stops the largest support force is {abs(smooth.reactions()[0].largest()[0]):.0f} N")
    for name, found in (("ground", ground_spectrum), ("pipe, no stops", without), ("pipe with stops", floor)):
        stiff, soft = found.acceleration[0, 0], found.acceleration[0].max()
        print(f"{name:>16}: {stiff:.1f} m/s² at {periods[0]:.2f} s, largest {soft:.1f} m/s²")
    fb.plot.response_spectrum(floor).savefig("floor_spectrum.png")
