"""Pulses, steps, moments: their derivatives, their tables, what they do to a beam."""

import math

import numpy as np
import pytest
from refusals import refused
from scipy.integrate import quad
from scipy.interpolate import BPoly

import fembeam as fb

UNIT = fb.Section(E=1.0, rho=1.0, A=1.0, I=1.0)
SIGNALS = [fb.Pulse(3.0, 0.2, at=0.1), fb.Step(-2.0, 0.3, at=0.05)]


@pytest.mark.parametrize("signal", SIGNALS)
def test_derivatives_follow_each_other(signal):
    t = np.linspace(0, 0.5, 41)
    for order in (1, 2):
        step = 1e-6
        lower = signal.derivative(order - 1)
        difference = (lower(t + step) - lower(t - step)) / (2 * step)
        size = np.abs(difference).max()
        np.testing.assert_allclose(signal.derivative(order)(t), difference, atol=1e-7 * size)


@pytest.mark.parametrize("signal", [*SIGNALS, SIGNALS[0].derivative(2), SIGNALS[1].derivative(2)])
@pytest.mark.parametrize("rtol", [1e-6, 1e-10])
def test_tables_keep_their_promise(signal, rtol):
    dt, rows = signal.nodes(0.5, rtol)
    assert (len(rows) - 1) * dt == pytest.approx(0.5)
    table = BPoly.from_derivatives(np.arange(len(rows)) * dt, rows)
    t = np.linspace(0, 0.5, 7919)
    size = np.abs(signal(t)).max()
    error = np.abs(table(t) - signal(t)).max() / size
    assert error < 1.1 * rtol
    assert error > 1e-3 * rtol  # no finer than needed


def test_values_outside():
    pulse, step = SIGNALS
    np.testing.assert_allclose(pulse(np.array([0.0, 0.1, 0.3, 9.0])), 0.0, atol=1e-13)
    assert pulse(0.2) == pytest.approx(3.0)
    np.testing.assert_allclose(step(np.array([0.0, 0.05, 9.0])), [0, 0, -2.0], atol=1e-13)
    assert pulse.impulse == pytest.approx(quad(pulse, 0.1, 0.3)[0], rel=1e-9)


def test_a_short_pulse_is_a_blow():
    model = fb.Scene(fb.Beam(1.0, UNIT), [fb.Clamped(0.0)], forces=[fb.PointForce(1.0, fb.Pulse(1e3, 1e-3))]).reduce(1)
    run = model.simulate(0.1)
    blow = fb.Pulse(1e3, 1e-3).impulse * model.phi(1.0)[0]
    phase = model.omega[0] * (0.1 - 0.5e-3)
    assert run.q[-1, 0] == pytest.approx(blow / model.omega[0] * math.sin(phase), rel=1e-4)


def test_a_slow_step_ends_in_equilibrium():
    scene = fb.Scene(fb.Beam(1.0, UNIT), [fb.Clamped(0.0)], forces=[fb.PointForce(1.0, fb.Step(0.01, 20.0))])
    model = scene.reduce(2)
    end = model.simulate(25.0)
    np.testing.assert_allclose(end.q[-1], model.equilibrium({1.0: 0.01})[:2], rtol=1e-4)


def test_a_moment_bends_the_beam():
    model = fb.Scene(fb.Beam(1.0, UNIT), [fb.Clamped(0.0)], damping=fb.ModalDamping(0.7),
                     forces=[fb.PointMoment(0.6, fb.Harmonic(0.01, 0.0))]).reduce(20)  # fmt: skip
    run = model.simulate(30.0, [30.0])
    assert run.displacement(0.6)[-1] == pytest.approx(0.01 * 0.6**2 / 2, rel=2e-3)


test_bad_signals = refused(
    (lambda: fb.Pulse(math.nan, 1.0), "Pulse peak must be finite"),
    (lambda: fb.Pulse(1.0, 0.0), r"Pulse length \(s\) must be finite above 0"),
    (lambda: fb.Step(1.0, 0.1, at=-1.0), r"Step at \(s\) must be finite of at least 0"),
    (lambda: fb.Pulse(1.0, 1e-9).nodes(1e3, 1e-8), "simulate a shorter time or use a longer signal"),
    (lambda: fb.PointMoment(0.1, None), "signal must be a function of t, got None in PointMoment at z = 0.1"),
)
