"""Sine sweeps: SciPy's chirp, derivatives in closed form and by differences, nodes, resonances, scene files."""

from dataclasses import replace

import numpy as np
import pytest
from problems import PAPER_LAW, TIP, paper_scene
from refusals import refused
from scipy.interpolate import BPoly
from scipy.signal import StateSpace, chirp, lsim

import fembeam as fb

KINDS = ["linear", "logarithmic"]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("start", "end"), [(20.0, 300.0), (300.0, 20.0), (50.0, 50.0)])
def test_it_is_the_chirp_of_scipy(kind, start, end):
    sweep, t = fb.SineSweep(2.0, start, end, 10.0, kind), np.linspace(0.0, 10.0, 5001)
    expected = chirp(t, start / (2 * np.pi), 10.0, end / (2 * np.pi), kind, phi=-90.0)
    np.testing.assert_allclose(sweep(t), 2.0 * expected, atol=1e-9)
    assert sweep.omega(0.0) == pytest.approx(start)
    assert sweep.omega(10.0) == pytest.approx(end)
    np.testing.assert_allclose(sweep.rate(t[1:-1]), np.gradient(sweep.omega(t), t)[1:-1], rtol=1e-5, atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_are_exact(kind):
    """The second in closed form, A (ω̇ cos θ - ω² sin θ); the others against differences of fourth order."""
    sweep, t = fb.SineSweep(1e-3, 100.0, 30.0, 5.0, kind), np.linspace(0.0, 5.0, 301)
    theta, omega = sweep.angle(t), sweep.omega(t)
    np.testing.assert_allclose(sweep.derivative(1)(t), 1e-3 * omega * np.cos(theta), atol=1e-12)
    second = 1e-3 * (sweep.rate(t) * np.cos(theta) - omega**2 * np.sin(theta))
    np.testing.assert_allclose(sweep.derivative(2)(t), second, atol=1e-11)
    for order in range(2, 6):
        one, h = sweep.derivative(order), 1e-5
        slope = (8 * (one(t + h) - one(t - h)) - (one(t + 2 * h) - one(t - 2 * h))) / (12 * h)
        expected = sweep.derivative(order + 1)(t)
        np.testing.assert_allclose(slope, expected, atol=1e-8 * np.abs(expected).max())
        assert one.derivative(1) == sweep.derivative(order + 1)


@pytest.mark.parametrize("kind", KINDS)
def test_nodes_keep_their_promise(kind):
    y = fb.SineSweep(1e-3, 20.0, 200.0, 6.0, kind).derivative(2)
    t = np.random.default_rng(2).uniform(0.0, 6.0, 4000)
    for rtol in (1e-4, 1e-8):
        dt, rows = y.nodes(6.0, rtol)
        inside = BPoly.from_derivatives(dt * np.arange(len(rows)), rows)(t)
        error = np.abs(inside - y(t)).max() / np.abs(y(t)).max()
        assert 0.01 * rtol < error < rtol


def test_sweeps_over_a_branch_jump_at_its_folds():
    """Up, the motion stays on the upper branch to the fold; down, on the branch without contact until it grazes."""
    scene = replace(paper_scene(fb.Harmonic(2e-4, 130.0), 0.02), stops=[fb.Stop(TIP, PAPER_LAW, gap=3e-3)])
    model = scene.reduce(1)
    special = model.branch("omega", span=(90.0, 150.0)).run().special
    grazing, fold = (max(one.parameter for one in special if one.mark == kind) for kind in ("grazing", "fold"))
    last = []
    for start, end in ((90.0, 150.0), (150.0, 90.0)):
        sweep = fb.SineSweep(2e-4, start, end, 60.0)
        run = model.under(replace(scene, base=sweep)).simulate(60.0)
        touched = sweep.omega(run.contacts.t_in)
        last.append(touched[(touched > 100.0) & (touched < 149.0)].max())
    assert fold - 1.0 < last[0] < fold + 1.5
    assert grazing - 1.0 < last[1] < grazing + 0.2


@pytest.mark.parametrize(("start", "end"), [(60.0, 160.0), (160.0, 60.0)])
def test_a_slow_sweep_finds_the_resonance_up_and_down(start, end):
    """|ω̇| = 0.06 (ζω)²: the maximum is that of steady motion to 1 %."""
    sweep = fb.SineSweep(1e-4, start, end, 60.0)
    model = replace(paper_scene(sweep, 0.05), stops=[]).reduce(1)
    run = model.simulate(60.0, 1e-3)
    steady = 1e-4 * model.frequency_response(np.linspace(60.0, 160.0, 2001), output=0.24445).amplitude
    assert np.abs(run.displacement(0.24445)).max() == pytest.approx(steady.max(), rel=1e-2)
    with pytest.raises(ValueError, match="SineSweep is 60 s long and shorter than the duration of 61 s"):
        model.simulate(61.0, 1e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_the_response_to_a_sweep_is_that_of_scipy(kind):
    """Straight lines between samples h apart err by about (ωh)²/12 = 3e-6 at most."""
    beam = fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.005))
    sweep = fb.SineSweep(1e-3, 20.0, 300.0, 1.0, kind)
    model = fb.Scene(beam, [fb.Clamped(0.0)], damping=fb.ModalDamping(0.03), base=sweep).reduce(2)
    run, fine = model.simulate(1.0, 1e-3), np.linspace(0.0, 1.0, 50_001)
    n, load = len(model.omega), -model.participation
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-model.system.K, -model.system.C]])
    system = StateSpace(A, np.r_[np.zeros(n), load][:, None], np.r_[model.phi(0.4), np.zeros(n)][None], [[0.0]])
    expected = lsim(system, sweep.derivative(2)(fine), fine)[1][::50]
    np.testing.assert_allclose(run.displacement(0.4), expected, atol=1e-5 * np.abs(expected).max())


def test_scene_file(file_of):
    text = """
    beam = {length = 0.5, section = {E = 2.1e11, rho = 7800.0, A = 1e-4, I = 1e-9}}
    supports = [{kind = "clamped", z = 0.0}]
    base = {kind = "sine_sweep", amplitude = 1e-3, omega0 = 60.0, omega1 = 200.0, duration = 5.0, rate = "logarithmic"}
    """
    assert file_of(text).scene.base == fb.SineSweep(1e-3, 60.0, 200.0, 5.0, "logarithmic")


def changed(**parts):
    return fb.SineSweep(**{"amplitude": 1.0, "omega0": 1.0, "omega1": 2.0, "duration": 1.0, **parts})


test_bad_input = refused(
    (lambda: changed(omega0=0.0), "omega0"),
    (lambda: changed(omega1=-1.0), "omega1"),
    (lambda: changed(duration=np.nan), "duration"),
    (lambda: changed(amplitude=np.inf), "amplitude"),
    (lambda: changed(kind="quadratic"), "kind must be 'linear' or 'logarithmic', got 'quadratic'"),
    (lambda: changed().derivative(-1), "integer of at least 0"),
)
