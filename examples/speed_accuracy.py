"""Speed against accuracy on a beam that meets its stop, with 1, 2, 3, 5 and 10 modes.

    q_i'' + 2 ζ_i ω_i q_i' + ω_i² q_i = -Γ_i y'' + φ_i(z_s) F,    δ = -u(z_s),    F = K δ^1.5 (1 + a δ'/δ'_entry)

Errors of the tip after three drive periods, median over some starts, against a reference on which two methods agree.
Expected: `Exponential` is the front of every model below an error of 1e-4; with few modes a finer step is wasted.

    python examples/speed_accuracy.py        prints the table, writes speed_accuracy.csv and speed_accuracy.png
                                             (--quick: fewer models and rounds)
"""

import math
import sys

import fembeam as fb
from contacts import Hysteretic
from solvers import RK4, CentralDifference, DormandPrince, Exponential, GeneralizedAlpha, HenonRK2, Newmark

z_stop, omega = 0.24445, 195.0
steel = fb.Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)
scene = fb.Scene(
    beam=fb.Beam(0.2599, steel),
    supports=[fb.Clamped(0.0)],
    masses=[fb.LumpedMass(z_stop, mass=25.4e-3, inertia=3.0e-6)],
    stops=[fb.Stop(z_stop, law=Hysteretic.lankarani_nikravesh(2.1e8, restitution=0.5))],
    damping=fb.ModalDamping([0.02, 0.01]),
    base=fb.Harmonic(amplitude=1e-3, omega=omega),
)
steps = 5e-5, 1e-5, 4e-6
methods = [
    *(Exponential(rtol) for rtol in (1e-4, 1e-6, 1e-8, 1e-10)),
    *(DormandPrince(rtol) for rtol in (1e-6, 1e-8, 1e-10)),
    *(HenonRK2(dt, dt / 5) for dt in steps),
    *(method(dt) for method in (RK4, CentralDifference, Newmark, GeneralizedAlpha) for dt in steps),
    *(RK4(dt, locate=False) for dt in steps),
]
quick = "--quick" in sys.argv
models = [scene.reduce(modes=n) for n in ((1, 2, 5) if quick else (1, 2, 3, 5, 10))]
found = fb.study.speed_accuracy(models, methods, starts=4, duration=6 * math.pi / omega, rounds=2 if quick else 5)

assert max(found.floor.values()) < 1e-7, "the two references do not agree"
assert not found.beaten("Exponential", better_than=1e-4), "another method is on the front below 1e-4"
located, ignored = ({p.modes: p.error for p in found.points if p.method == name and p.setting == "dt=4e-06"}
                    for name in ("RK4", "RK4, events ignored"))  # fmt: skip
assert all(ignored[n] > 10 * located[n] for n in located), "ignoring events should cost accuracy"

if __name__ == "__main__":
    print(found)
    found.save("speed_accuracy.csv")
    fb.plot.speed_accuracy(found).savefig("speed_accuracy.png", dpi=90, metadata={"Software": None})
