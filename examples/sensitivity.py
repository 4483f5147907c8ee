"""What each number of a scene does to the blows of a stop: exact derivatives, through every contact.

    d(peak force)/dp = dF at the instant of the peak,    dt_in/dp = -dδ/δ̇ at the entry

A clamped bar with a mass at its tip is shaken against a stop. One call per number gives the derivatives of motion,
times, forces and impulses; the independent check is a fourth-order difference of four runs each. With the tolerances of
production they give the scatter of the largest force to first order, and which tolerance it comes from.

    python examples/sensitivity.py    prints the table and the scatter
"""

import numpy as np

import fembeam as fb
from contacts import Hysteretic
from fembeam.scene import with_value
from solvers import Exponential

length = 0.25  # m
scene = fb.Scene(
    fb.Beam(length, fb.Section.rectangle(E=2.0e11, rho=7800.0, width=0.02, height=0.003)),
    [fb.Clamped(0.0)],
    masses=[fb.LumpedMass(length, mass=0.05)],
    stops=[fb.Stop(length, Hysteretic(2e8, damping_factor=0.5), gap=4e-4, name="valve")],
    damping=fb.ModalDamping(0.02),
    base=fb.Harmonic(amplitude=1e-3, omega=110.0),
)
tolerances = {  # standard deviations of production; differences of runs take steps of a part of them
    "stops[valve].gap": 2e-5,
    "stops[valve].law.stiffness": 1e7,
    "stops[valve].law.damping_factor": 0.02,
    "base.amplitude": 1e-5,
    "base.omega": 0.1,
    "damping.zeta[0]": 1e-3,
    "masses[0].mass": 5e-4,
}
columns = {"t_in": "entries", "t_out": "exits", "peak_force": "peak_force", "impulse": "impulse"}


def simulated(one: fb.Scene) -> fb.Run:
    """A fifth of a second from rest."""
    return one.reduce(modes=2).simulate(0.2, dt=1e-3, solver=Exponential(1e-11))


def differences(path: str, value: float, step: float) -> dict[str, np.ndarray]:
    """The same derivatives by differences of four runs, of fourth order."""
    runs = [simulated(with_value(scene, path, value + k * step)) for k in (-2, -1, 1, 2)]
    found = {}
    for name in columns:
        a, b, c, d = (getattr(run.contacts, name) for run in runs)
        found[name] = (8.0 * (c - b) - (d - a)) / (12.0 * step)
    return found


if __name__ == "__main__":
    run = simulated(scene)
    hardest = int(np.argmax(run.contacts.peak_force))
    print(run.sensitivity("stops[valve].gap"))
    print(f"\n{'':32s}{'d peak force':>14s}{'d t_in':>12s}{'off from differences':>24s}")
    worst, scatter = 0.0, {}
    for path, deviation in tolerances.items():
        found = run.sensitivity(path)
        other = differences(found.parameter, found.value, 0.01 * deviation)
        off = [abs(getattr(found, b) - other[a]).max() / abs(other[a]).max() for a, b in columns.items()]
        scatter[path] = found.peak_force[hardest] * deviation
        print(f"{path:32s}{found.peak_force[hardest]:14.6g}{found.entries[hardest]:12.5g}{max(off):24.1e}")
        worst = max(worst, *off)
    total = np.sqrt(sum(one**2 for one in scatter.values()))
    cause = max(scatter, key=lambda path: abs(scatter[path]))
    print(f"\nlargest force {run.contacts.peak_force[hardest]:.4g} N ± {total:.2g} N, most of it from {cause}")
    assert worst < 1e-6, f"off by {worst:.2g} from differences of runs"
