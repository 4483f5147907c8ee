"""Where Heun's method, RK4 and Newmark's trapezoidal rule fail on a beam with a stop, and where that was predicted.

    q_i'' + 2 ζ_i ω_i q_i' + ω_i² q_i = -Γ_i y'' + φ_i(z_s) F,    δ = -u(z_s),    F = K δ^1.5 (1 + a δ'/δ'_entry)

The paper's scheme (Heun, contact with a fifth of the flight step) allows about (8ζ)^(1/3)/ω of the fastest mode, RK4
2.83/ω. Newmark's trapezoidal rule is stable at every step here, but wrong, or misses contacts.

    python examples/stability_map.py        prints the maps and writes stability_map.png
"""

import numpy as np

import fembeam as fb
import solvers
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


def heun(dt: float) -> solvers.HenonRK2:
    return solvers.HenonRK2(dt, dt / 5)


steps, unstable = np.geomspace(2e-5, 2e-3, 14), fb.study.Verdict.UNSTABLE
maps = [fb.study.stability_map(scene, method, steps, duration=0.1) for method in (heun, solvers.RK4, solvers.Newmark)]
stiffness = np.geomspace(1e6, 1e10, 5)
maps.append(fb.study.stability_map(scene, solvers.RK4, steps, modes=2, stiffness=stiffness, duration=0.1))

for found in maps[:2]:
    for modes, line, limit in zip(found.rows, found.verdict, np.minimum(found.flight, found.contact), strict=True):
        below = line[steps < 0.9 * limit]
        assert not np.any(below == unstable), f"{found.method}, {modes:g} modes: unstable below {limit:g} s"
    five, ten = (line[steps > 1.5 * flight] for line, flight in zip(found.verdict[3:], found.flight[3:], strict=True))
    assert np.all(five == unstable), f"{found.method}: stable with 5 modes above the predicted limit"
    assert np.all(ten == unstable), f"{found.method}: stable with 10 modes above the predicted limit"
assert not np.any(maps[2].verdict == unstable), "Newmark's trapezoidal rule became unstable"
assert np.any(maps[2].verdict == fb.study.Verdict.MISSED), "no contact was missed"

if __name__ == "__main__":
    print(*maps, sep="\n\n")
    fb.plot.stability_map(*maps).savefig("stability_map.png", dpi=90, metadata={"Software": None})
