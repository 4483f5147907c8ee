"""Independent realisations on all processors, kept as they come: interrupt it, call again, it goes on.

    E[q̇²] = π S φ²/(4 ζ ω₁),    S one-sided density of the force at the tip, N² s/rad

Under white noise the mean kinetic energy of one mode does not care about springs, not even about a Hertzian stop
(T.K. Caughey, J. Acoust. Soc. Am. 35 (1963) 1683): the ensemble's interval of 99.99 % confidence must hold it.

    python examples/ensemble.py        prints mean ± standard error, leaves ensemble.npz with the realisations
"""

import math
from concurrent.futures import ProcessPoolExecutor

import fembeam as fb
from contacts import Hertz

length, band, std, zeta = 0.26, 8000.0, 0.5, 0.05
scene = fb.Scene(
    beam=fb.Beam(length, fb.Section.rectangle(E=2.1e11, rho=7850.0, width=0.02, height=0.003)),
    supports=[fb.Clamped(0.0)],
    stops=[fb.Stop(length, law=Hertz(1e6))],
    damping=fb.ModalDamping(zeta),
    forces=[fb.PointForce(length, fb.BandNoise(std, (0.0, band), seed=1))],
)


def rate_variance(model: fb.Model) -> float:
    """Mean square of q̇ once the start is forgotten."""
    run = model.simulate(duration=8.0, dt=2e-3)
    return float((run.q_dot[run.t > 1.0] ** 2).mean())


def main() -> None:
    model = scene.reduce(modes=1)
    (omega,), (phi,) = model.omega, model.phi(length)
    expected = math.pi * std**2 / band * phi**2 / (4 * zeta * omega)
    with ProcessPoolExecutor(2) as pool:
        some = fb.study.ensemble(model, 4, rate_variance, pool, checkpoint="ensemble.npz")
        found = fb.study.ensemble(model, 12, rate_variance, pool, checkpoint="ensemble.npz")  # computes eight
    again = fb.study.ensemble(model, 4, rate_variance)  # here, without a pool
    assert again.mean.value == some.mean.value, "the same seeds must give the same bits wherever they are computed"
    lo, hi = found.mean.interval(0.9999)
    away = abs(found.mean.value - expected) / found.mean.standard_error
    assert lo < expected < hi, f"{found.mean!r}, theory {expected:.6g}: {away:.1f} standard errors"
    assert found.mean.relative < 0.05
    print(found)
    print(f"theory {expected:.6g}, {away:.1f} standard errors away")


if __name__ == "__main__":
    main()
