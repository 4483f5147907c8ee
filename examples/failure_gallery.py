"""Ten ways to get a wrong answer from a beam and a stop, and what the library gives or says instead.

More modes than a step allows, contacts shorter than a step, grazing, chatter, a rule that gains energy, aliased modes,
a contact that never ends, a law that is singular at grazing: red is a naive method, blue this library.

    python examples/failure_gallery.py        prints the cases and writes failure_gallery.png
"""

import fembeam as fb
from contacts import Hysteretic

z_stop = 0.24445
steel = fb.Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)
scene = fb.Scene(
    beam=fb.Beam(0.2599, steel),
    supports=[fb.Clamped(0.0)],
    masses=[fb.LumpedMass(z_stop, mass=25.4e-3, inertia=3.0e-6)],
    stops=[fb.Stop(z_stop, law=Hysteretic.lankarani_nikravesh(2.1e8, restitution=0.5))],
    damping=fb.ModalDamping([0.02, 0.01]),
    base=fb.Harmonic(amplitude=1e-3, omega=195.0),
)
cases = fb.study.gallery(scene)

for case in cases:
    assert case.naive_error > 0.05, f"{case.title}: the naive method is only {case.naive_error:.1e} off"
    assert case.our_error < 1e-3, f"{case.title}: ours is {case.our_error:.1e} off"

if __name__ == "__main__":
    for case in cases:
        print(f"{case.title}\n    naive: {case.said[0]}\n    ours:  {case.said[1]}")
    fb.plot.failures(cases).savefig("failure_gallery.png", dpi=90, metadata={"Software": None})
