"""Matrices of another program: a tuning fork read from Matrix Market files, whose prongs strike each other.

    M ü + C u̇ + K u = Σ n f(t) + Σ w F(δ),    δ = u_left - u_right - gap

Driven in opposite ways the prongs mirror each other, so that each meets the plane between them: the fork is one prong
before a fixed stop of half the gap and twice the stiffness. Its mode count, an orbit and statistics under noise.

    python examples/structure.py        writes fork_K.mtx and fork_M.mtx, prints the checks and the numbers
"""

import numpy as np
from scipy import io, sparse

import fembeam as fb
from contacts import KelvinVoigt

LENGTH, NODES, GAP = 0.3, 13, 1e-3
prong = fb.Beam(LENGTH, fb.Section.rectangle(2.1e11, 7850.0, width=0.01, height=0.004))


def export() -> list[tuple[str, str]]:
    """Write K and M of two free prongs, as another program would; returns the names of the dofs."""
    free = fb.Scene(prong).matrices(NODES - 1)
    for name in "KM":
        both = sparse.block_diag([getattr(free, name)] * 2)
        io.mmwrite(f"fork_{name}.mtx", both, symmetry="symmetric", precision=16)
    return [(f"{side}{i}", c) for side in ("left", "right") for i in range(NODES) for c in ("y", "rz")]


def forked(drive: object, damping: float = 0.01) -> fb.Scene:
    """The fork, held at its yoke, with a stop between the tips and opposite forces on them."""
    labels = export()
    ends = {"left tip": f"left{NODES - 1}", "right tip": f"right{NODES - 1}"}
    at = {node: (LENGTH / (NODES - 1) * int(node.strip("leftrigh")), -0.01 * (node[0] == "l"), 0) for node, _ in labels}
    lines = [tuple(f"{side}{i}" for i in range(NODES)) for side in ("left", "right")]
    fork = fb.Structure.read("fork_K.mtx", "fork_M.mtx", labels=labels, points=ends, nodes=at, lines=lines)
    return fb.Scene(
        fork,
        [fb.Fixed("left0"), fb.Fixed("right0")],
        stops=[fb.Stop("left tip", KelvinVoigt(2e4, 0.5), GAP, direction="y", on="right tip", name="prongs")],
        forces=[fb.PointForce("left tip", drive, "y"), fb.PointForce("right tip", drive, "-y")],
        damping=fb.ModalDamping(damping),
    )


tone = fb.Harmonic(0.5, 210.0)
scene = forked(tone)
checks = scene.beam.check()
run = scene.reduce(modes=6).simulate(duration=0.5, dt=2e-4)

alone = fb.Scene(prong, [fb.Clamped(0.0)], stops=[fb.Stop(LENGTH, KelvinVoigt(4e4, 1.0), GAP / 2, "above")],
                 forces=[fb.PointForce(LENGTH, tone)], damping=fb.ModalDamping(0.01))  # fmt: skip
same = alone.reduce(modes=3, elements=NODES - 1).simulate(duration=0.5, dt=2e-4)
first = slice(0, 6)  # impacts; a rounding grows with each
assert np.abs(run.contacts.t_in[first] - same.contacts.t_in[first]).max() < 1e-7, "the fork is not its half"
assert np.abs(run.contacts.peak_force[first] / same.contacts.peak_force[first] - 1).max() < 1e-5

counts = fb.study.mode_count(scene, [2, 4, 6], "peak_force", duration=0.3, dt=1e-3, residual=False, reference=12)
orbit = scene.reduce(modes=2).orbit()
product = np.prod(orbit.multipliers)
model = orbit.model
assert abs(product / np.exp(-2 * np.sum(model.zeta * model.omega) * 2 * np.pi / tone.omega)) < 1.0, (
    "the stop loses energy"
)

noisy = forked(fb.BandNoise(0.3, (100.0, 400.0), seed=1)).reduce(modes=2).simulate(duration=40.0, dt=1e-3)
opening = noisy.displacement("left tip", "y") - noisy.displacement("right tip", "y")
estimate = fb.moments(opening[2000:])
assert estimate.skewness < -0.3, "a stop on one side leaves a longer tail on the other"

if __name__ == "__main__":
    print("\n".join(checks), run, counts, orbit, sep="\n\n")
    print(f"\nopening under noise: {estimate}, {len(noisy.contacts)} impacts")
