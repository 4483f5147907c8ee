"""A stop's law from measured collisions: K, exponent, damping factor and restitution with confidence intervals.

    F = K δ^p (1 + a δ'/δ'_entry),  fitted to all collisions at once with the zeros of both channels

identify_stop.csv holds five collisions as a data logger gives them: time, indentation, force, with noise on both and a
force zero that is off. They were made with K = 2.1e8 N/m^1.5, a = 0.5625: Eqs (4)-(6) of N. van de Wouw et al., Int.
J. Non-Linear Mech. 38 (2003) 767, call that a restitution of 0.5; a free mass achieves 0.725.

    python examples/identify_stop.py        prints what it finds and writes identify_stop.png
"""

from pathlib import Path

import fembeam as fb
from contacts import identify, read_collisions

measured = read_collisions(Path(__file__).with_name("identify_stop.csv"))
found = identify(**measured)

assert 2.1e8 in found.stiffness, f"stiffness {found.stiffness}"
assert 0.5625 in found.damping_factor, f"damping factor {found.damping_factor}"
assert 0.725241 in found.restitution, f"restitution {found.restitution}"
assert found.stiffness.high / found.stiffness.low < 1.1, "the interval should be narrow"

stop = fb.Stop(0.24445, law=found.law)

if __name__ == "__main__":
    print(found)
    print(f"with the exponent free: {identify(**measured, exponent=None).exponent}")
    print(stop.law.describe())
    fb.plot.identification(found).savefig("identify_stop.png", dpi=110, metadata={"Software": None})
