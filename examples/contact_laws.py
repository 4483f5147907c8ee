"""What contact laws really do: loops, nominal against achieved restitution, a law of one's own.

    F = K δ^p (1 + a δ'/δ'_entry)  on a free mass:  a (1 + r) = ln[(1 + a)/(1 - a r)]

Asked for a restitution of 0.5, Lankarani and Nikravesh's factor achieves 0.725, Hunt and Crossley's 0.663; only the
root of the relation achieves what it is asked for.

    python examples/contact_laws.py        prints the table and writes contact_laws.png, restitutions.png
"""

import numpy as np

import fembeam as fb
from contacts import PUBLISHED, Hysteretic, KelvinVoigt, PiecewiseLinear, Viscoelastic, law, restitution

mass, speed, asked = 0.03, 0.3, (0.1, 0.3, 0.5, 0.7, 0.9)
achieved = {name: [restitution(getattr(Hysteretic, name)(2.1e8, e), speed, mass) for e in asked] for name in PUBLISHED}


@law
def rubber(delta, delta_dot, entry_rate, stiffness=3e5, hardening=6e12, damping=4e3):
    """F = stiffness δ + hardening δ³ + damping √δ δ̇: a bumper that hardens."""
    return stiffness * delta + hardening * delta**3 + damping * delta**0.5 * delta_dot


laws = {
    "lankarani_nikravesh": Hysteretic.lankarani_nikravesh(2.1e8, 0.5),
    "achieving": Hysteretic.achieving(2.1e8, 0.5),
    "anagnostopoulos": KelvinVoigt.anagnostopoulos(8e5, 0.5, mass),
    "the same, clamp=True": KelvinVoigt.anagnostopoulos(8e5, 0.5, mass, clamp=True),
    "tsuji": Viscoelastic.tsuji(2.1e8, 0.5, mass),
    "jankowski": Viscoelastic.jankowski(2.1e8, 0.5, mass),
    "piecewise, damped": PiecewiseLinear([4e5, 2e6], knots=[3e-5], damping=[20.0, 60.0]),
    "a law of one's own": rubber(),
    "two in parallel": rubber() + Hysteretic.hunt_crossley(1e8, 0.5),
}

assert abs(achieved["lankarani_nikravesh"][2] - 0.725241114010) < 1e-11
assert np.allclose(achieved["achieving"], asked, rtol=0, atol=1e-12)

if __name__ == "__main__":
    print(f"{'nominal':24}" + "".join(f"{e:8}" for e in asked))
    for name, values in achieved.items():
        print(f"{name:24}" + "".join(f"{r:8.4f}" for r in values))
    print(*(one.describe(speed, mass) for one in laws.values()), sep="\n")
    fb.plot.loops(laws, speed, mass).savefig("contact_laws.png", dpi=110, metadata={"Software": None})
    fb.plot.restitutions().savefig("restitutions.png", dpi=110, metadata={"Software": None})
