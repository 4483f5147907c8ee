"""How many modes does a beam with a stop need? The answer depends on the question.

The paper's beam (van de Wouw et al., Int. J. Non-Linear Mech. 38 (2003) 767) under broad-band noise: spectra of δ from
1, 2, 3, … modes, with and without the static shape of the stop, paired over the same realisations.

    python examples/mode_count.py        prints the table and writes mode_count.png
"""

from dataclasses import replace

import fembeam as fb
from contacts import Hertz, Hysteretic
from fembeam.study.quantities import Psd

steel = fb.Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)
scene = fb.Scene(
    beam=fb.Beam(0.2599, steel),
    supports=[fb.Clamped(0.0)],
    masses=[fb.LumpedMass(0.24445, mass=25.4e-3, inertia=3.0e-6)],
    stops=[fb.Stop(0.24445, law=Hysteretic.lankarani_nikravesh(2.1e8, restitution=0.5))],
    damping=fb.ModalDamping([0.02, 0.01]),
    base=fb.BandNoise(std=2.5e-4, band=(0.0, 1226.6)),
)
spectrum = Psd(band=(1.0, 1200.0), parts=12)
runs = {"duration": 22.0, "dt": 1e-3, "discard": 2.0, "seeds": range(6)}
study = fb.study.mode_count(scene, [1, 2, 3, 5], spectrum, **runs)

# ten sets of seeds gave errors of 0.80 ± 0.04, 0.22 ± 0.02, 0.035 ± 0.026 and a bound of 0.14 ± 0.04
one, two, three = (study.row(n) for n in (1, 2, 3))
assert one.error > 0.3, f"one mode misses much of the spectrum, error {one.error:.2f}"
assert 0.05 < two.error < one.error, f"two are closer, error {two.error:.2f}"
assert three.error - three.uncertainty < 0.06, f"three change little, error {three.error:.2f}"
assert study.row(2, residual=True).bound < 0.25, "two modes and the static shape of the stop do as well as three"

# A stiff stop struck fast asks for more: the force has passed before a wave has been to the clamp and back.
stiff = replace(scene, base=None, stops=[fb.Stop(0.24445, law=Hertz(1e10))])


def swing(model: fb.Model):
    """A fast strike, 2 m/s at the tip."""
    return model.state(velocity=lambda z: -2.0 * (z / 0.2599) ** 2)


peak = fb.study.smallest_model(stiff, "peak_force", tolerance=0.02, duration=0.05, start=swing, residual=False)
with_two = next(line for line in peak.reduction if line.choice[:2] == (2, False))
assert with_two.error > 0.1, f"two modes should miss the peak force, error {with_two.error:.2f}"
assert peak.check < 0.02

if __name__ == "__main__":
    print(study, end="\n\n")
    print(f"two modes miss the peak force of a stiff stop by {100 * with_two.error:.0f} %; {peak.verdict}")
    study.figure().savefig("mode_count.png", dpi=110, metadata={"Software": None})
