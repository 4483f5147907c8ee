"""Laws with memory under noise: power by element, its balance, runs in pieces, ensembles."""

import math
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np
import pytest

import fembeam as fb
from contacts import BoucWen, Coulomb, Jenkins, Polynomial, WaltonBraun
from fembeam.statistics import Estimate
from fembeam.study import characteristics, ensemble, stationary
from fembeam.study.measure import cut
from fembeam.study.quantities import Power
from fembeam.study.segments import Segments
from solvers import Exponential

ZETA, BAND = 0.02, 60.0  # of the first mode, over its ω
LENGTH, SIZE = 0.5, 1e-3  # m; of the motion


def damped(make, length=LENGTH, seed=7):
    """One mode of a cantilever with an element at its tip under a white force there; what the force gives, W.

    ``make(k)`` is the law beside a modal stiffness of k N/m at the tip.
    """
    bare = fb.Scene(fb.Beam(length, fb.Section.circle(2.1e11, 7800.0, 0.01)), [fb.Clamped(0.0)])
    mode = bare.reduce(modes=1)
    phi, omega = float(mode.phi(length)[0]), float(mode.omega[0])
    level = SIZE**2 * omega**3 / phi**4  # N² s/rad, one-sided
    force = fb.PointForce(length, fb.BandNoise(math.sqrt(level * BAND * omega), (0.0, BAND * omega), seed=seed))
    scene = fb.Scene(
        bare.beam, bare.supports, damping=fb.ModalDamping(ZETA), forces=[force],
        elements=[fb.Element(length, make((omega / phi) ** 2))],
    )  # fmt: skip
    return scene.reduce(modes=1), phi**2 * level * (math.pi / 2.0 - 2.0 * ZETA / BAND)


LAWS = {
    "jenkins": lambda k: Jenkins(3.0 * k, 1.0 * k * SIZE),
    "bouc_wen": lambda k: BoucWen(2.0 * k, 0.1, 1.0, 0.7 / SIZE, 0.3 / SIZE),
    "coulomb": lambda k: Coulomb(0.7 * k * SIZE, 25.0 * k),
}


@pytest.mark.drawn
@pytest.mark.parametrize("name", ["jenkins", "coulomb"])
def test_white_noise_gives_the_same_power_whatever_the_law(name):
    r"""A force of one-sided level G (per rad/s) up to ω_c gives, on average, G φ² (π/2 - c/ω_c): all of it is taken.

    P = ∫_0^∞ R(τ) g(τ) dτ with R = G sin(ω_c τ)/τ and g the mean response of the velocity to an impulse (Furutsu and
    Novikov), g(0) = 1 and g'(0) = -c = -2 ζ ω for every law whose force follows δ continuously. The next term is below
    (ω_s/ω_c)³, ω_s the frequency in stick: 1e-3. The interval is that of 99.99 % over independent realisations.
    """
    model, given = damped(LAWS[name])
    omega = float(model.omega[0])
    rate = {"rate": lambda run: run.q_dot[:, 0]}
    found = stationary(model, 16 * 1500.0 / omega, 0.15 / omega, rate, segment=256)
    damping = 2.0 * ZETA * omega
    taken = Estimate.joint(lambda power, v2: power + damping * v2, found.power(0), found["rate"].variance)
    low, high = taken.interval(0.9999)
    assert taken.batches >= 16
    assert taken.relative < 0.016  # 0.008 on average, from 16 batches: twice that is beyond 99.99 %
    assert low - 1e-3 * given < given < high + 1e-3 * given
    assert found.power(0).value > 0.5 * given  # most of it in the element
    assert not low < 1.1 * given < high


def test_power_of_each_element_and_of_all():
    """Two sliders beside each other take what one of both takes, each its share; printed by name."""
    one, _ = damped(lambda k: Jenkins(3.0 * k, k * SIZE))
    half = fb.Element(LENGTH, Jenkins(one.scene.elements[0].law.stiffness / 2, one.scene.elements[0].law.limit / 2))
    two = replace(one.scene, elements=[half, half]).reduce(modes=1)
    duration, dt = 1700.0 / one.omega[0], 0.15 / one.omega[0]
    apart, whole = (stationary(model, duration, dt, discard=0.1 * duration, segment=64) for model in (two, one))
    assert apart.power(0).value == apart.power(1).value == pytest.approx(0.5 * whole.power().value, rel=1e-5)
    assert apart.power().value == pytest.approx(2.0 * apart.power(1).value, rel=1e-12)
    assert apart.numbers()["element 1 power"].standard_error > 0.0
    assert "element 1 power" in str(apart)
    assert apart.power("element 1").value == apart.power(1).value
    for wrong in (2, 0.5, True):
        with pytest.raises(ValueError, match="contact must be below 2"):
            apart.power(wrong)
    with pytest.raises(ValueError, match="contact must be one of element 0, element 1, got 'x'"):
        apart.power("x")


def test_power_of_a_run_and_of_its_parts():
    """The quantity is the loss over the time, up to what is stored at the ends; a part of a run has its own."""
    model, _ = damped(LAWS["jenkins"])
    run = model.simulate(400.0 / model.omega[0], 0.15 / model.omega[0])
    power, losses = Power()(run), run.losses
    assert power * run.t[-1] == pytest.approx(losses.work[0], rel=2e-3)  # the last sample is not the end
    assert losses.loss[0] == pytest.approx(losses.slip[0] * model.scene.elements[0].law.limit, rel=1e-7)
    middle = run.t[len(run.t) // 2]
    parts = [cut(run, 0.0, middle), cut(run, middle, run.t[-1])]
    total = sum(Power()(part) * part.t[-1] for part in parts)
    assert total == pytest.approx(power * run.t[-1], rel=1e-12)
    assert np.isnan(parts[0].losses.loss).all()


@pytest.mark.parametrize("name", LAWS)
def test_a_run_goes_on_from_the_end_of_another(name):
    """Motion, force and loss of two runs are those of one, to the tolerance of the method."""
    model, _ = damped(LAWS[name])
    tone = fb.Harmonic(model.scene.forces[0].signal.std * 0.1, float(model.omega[0]))  # continued by its phase
    model = replace(model.scene, forces=[fb.PointForce(LENGTH, tone)]).reduce(modes=1)
    period, solver = 2.0 * math.pi / float(model.omega[0]), Exponential(1e-10)
    whole = model.simulate(12 * period, period / 50, solver=solver)
    first = model.simulate(6 * period, 0.7 * period, solver=solver)  # the last sample is not the end
    rest = model.simulate(6 * period, period / 50, first.end, solver)
    assert np.abs(rest.q - whole.q[300:]).max() < 1e-7 * np.abs(whole.q).max()
    assert np.abs(rest.force() - whole.force()[300:]).max() < 1e-6 * np.abs(whole.force()).max()
    np.testing.assert_allclose(first.losses.loss + rest.losses.loss, whole.losses.loss, rtol=1e-7)
    np.testing.assert_allclose(first.losses.slip + rest.losses.slip, whole.losses.slip, rtol=1e-7)
    forgetful = model.simulate(6 * period, period / 50, first.end[:2], solver)
    assert np.abs(forgetful.q - whole.q[300:]).max() > 1e-3 * np.abs(whole.q).max()
    with pytest.raises(ValueError, match=r"start must have shape \(2,\)"):
        model.simulate(period, start=first.end[:3])


def segmented(model, length, count, dt, solver=None):
    """Runs of the segments of a stationary response, each of ``length`` s, from rest."""
    plan = Segments.of(model, count * length, dt, 0.0, None, solver, 64)
    plan.longest, plan.first_lead = length, 0.0
    runs = []
    for piece in plan.pieces():
        runs.append(piece.run)
        plan.keep(piece, length)
    return runs


@pytest.mark.parametrize("name", LAWS)
def test_segments_of_a_long_run_are_one_run(name):
    """Under tones: the same motion, force and loss to the tolerance, whatever was latched at the cuts."""
    model, _ = damped(LAWS[name])
    omega, force = float(model.omega[0]), 0.1 * model.scene.forces[0].signal.std
    tones = fb.Multisine([force, 0.7 * force], [omega, 1.37 * omega])
    model = replace(model.scene, forces=[fb.PointForce(LENGTH, tones)]).reduce(modes=1)
    length, solver = 400 * 0.1 / omega, Exponential(1e-10)
    runs = segmented(model, length, 5, 0.1 / omega, solver)
    whole = model.simulate(5 * length, 0.1 / omega, solver=solver)
    assert len(runs) == 5
    q, force = (np.concatenate([f(runs[0])[:1], *(f(run)[1:] for run in runs)])
                for f in (lambda run: run.q[:, 0], lambda run: run.force()))  # fmt: skip
    assert np.abs(q - whole.q[:, 0]).max() < 1e-7 * np.abs(q).max()
    assert np.abs(force - whole.force()).max() < 1e-6 * np.abs(force).max()
    assert sum(run.losses.loss[0] for run in runs) == pytest.approx(whole.losses.loss[0], rel=1e-7)


def test_the_set_of_a_yielding_stop_outlasts_segments_of_noise():
    """The largest force so far never falls: the stop stays dented when the noise is renewed."""
    model, _ = damped(lambda k: Polynomial([1e-3 * k]))
    stiffness = (model.omega[0] / model.phi(LENGTH)[0]) ** 2
    stop = fb.Stop(LENGTH, WaltonBraun(5.0 * float(stiffness), 20.0 * float(stiffness), "kept"))
    model = replace(model.scene, elements=[], stops=[stop]).reduce(modes=1)
    runs = segmented(model, 60.0 / model.omega[0], 5, 0.15 / model.omega[0])
    largest = [run.end[-1] for run in runs]
    assert largest[0] > 0.0
    assert np.all(np.diff(largest) >= 0.0)
    for before, run in pairwise(runs):
        assert np.array_equal(run.memory_at_start[0], before.end[2:])


def test_realisations_are_independent_resumable_and_the_same_with_two_workers(tmp_path):
    model, _ = damped(LAWS["jenkins"])
    omega = float(model.omega[0])
    options = {"duration": 850.0 / omega, "dt": 0.15 / omega, "discard": 50.0 / omega, "segment": 64}
    quantity, path = partial(characteristics, **options), tmp_path / "kept"
    alone = ensemble(model, 4, quantity)
    first = ensemble(model, 2, quantity, checkpoint=path)
    with ProcessPoolExecutor(2) as executor:
        rest = ensemble(model, 4, quantity, executor, path)
    for name, values in alone.values.items():
        np.testing.assert_array_equal(rest.values[name], values)
        np.testing.assert_array_equal(first.values[name], values[:2])
    power = alone.values["element 0 power"]
    assert len(set(power.tolist())) == 4
    assert alone["element 0 power"].standard_error > 0.01 * power.mean()
