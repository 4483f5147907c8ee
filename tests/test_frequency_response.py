"""Frequency response of linear scenes: one mode, SciPy, the exact beam with structural damping, bad input."""

import numpy as np
import pytest
from problems import paper_scene
from refusals import refused
from scipy.signal import StateSpace, freqresp

import fembeam as fb
from contacts import Hertz

SQUARE = fb.Section.rectangle(2.1e11, 7850.0, 0.01, 0.01)
L = 0.4
BEAM, CLAMPED = fb.Beam(L, SQUARE), [fb.Clamped(0.0)]
OMEGA = np.linspace(0.0, 4000.0, 801)


def test_one_mode_is_an_oscillator():
    """H = ω² Γ φ/(ω_n² - ω² + 2iζ ω_n ω), and the transmissibility of an SDOF where Γ φ = 1."""
    model = fb.Scene(BEAM, CLAMPED, damping=fb.ModalDamping(0.03)).reduce(1)
    w, gamma, phi = model.omega[0], model.participation[0], model.phi(0.3)[0]
    found = model.frequency_response(OMEGA, "base", 0.3)
    exact = OMEGA**2 * gamma * phi / (w**2 - OMEGA**2 + 0.06j * w * OMEGA)
    np.testing.assert_allclose(found.values, exact, rtol=1e-12)
    np.testing.assert_allclose(found.amplitude, np.abs(exact), rtol=1e-12)
    np.testing.assert_allclose(found.decibel[1:], 20 * np.log10(np.abs(exact[1:])), rtol=1e-10)
    assert found.phase[-1] == pytest.approx(-np.pi, abs=0.05)
    still = model.frequency_response(OMEGA, "base", 0.3, absolute=True)
    np.testing.assert_allclose(still.values, 1 + exact, rtol=1e-12)


def test_the_exact_damped_cantilever():
    """C = βK makes E complex, E (1 + iωβ): the tip's receptance; the static shape stands for modes left out."""
    beta = 2e-6
    force = [fb.PointForce(L, fb.Harmonic(1.0, 10.0))]
    model = fb.Scene(BEAM, CLAMPED, forces=force, damping=fb.Rayleigh(0.0, beta)).reduce(6, residual=True)
    omega = np.linspace(10.0, 3000.0, 300)
    EI = SQUARE.bending_stiffness * (1 + 1j * omega * beta)
    k = (SQUARE.line_mass * omega**2 / EI) ** 0.25
    x = k * L
    exact = (np.cosh(x) * np.sin(x) - np.sinh(x) * np.cos(x)) / (EI * k**3 * (1 + np.cos(x) * np.cosh(x)))
    for driven in (L, "forces[0]", "forces[0].signal"):
        np.testing.assert_allclose(model.frequency_response(omega, driven, L).values, exact, rtol=2e-4)
    assert model.frequency_response([0.0], L, L).values[0] == pytest.approx(L**3 / (3 * SQUARE.bending_stiffness))


@pytest.mark.filterwarnings("ignore:Badly conditioned")
def test_against_scipy_with_dashpots_and_a_shaken_foot():
    scene = fb.Scene(
        BEAM, [fb.Pinned(0.0)], springs=[fb.Spring(0.3, 5e4, foot=fb.Harmonic(1e-3, 10.0))],
        dashpots=[fb.Dashpot(L, 4.0)], stops=[fb.Stop(L, Hertz(1e8), gap=1e-3)],
        forces=[fb.PointMoment(0.1, fb.Harmonic(1.0, 5.0))], damping=fb.ModalDamping(0.01),
        base=fb.Harmonic(1e-4, 30.0))  # fmt: skip
    model = scene.reduce(2)  # SciPy goes by polynomials, which lose their digits with more
    system, n = model.system, len(model.omega)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-system.K, -system.C]])
    seen = np.hstack([model.phi([0.2, L]), np.zeros((2, n))])
    omega = np.linspace(20.0, 4000.0, 300)
    for driven, vector, power in (("forces[0]", model.phi(0.1, 1), 0), ("springs[0].foot", 5e4 * model.phi(0.3), 0),
                                  ("base", model.participation, 2)):  # fmt: skip
        found = model.frequency_response(omega, driven, [0.2, L])
        for j in range(2):
            one = StateSpace(A, np.concatenate([np.zeros(n), vector])[:, None], seen[j : j + 1], [[0.0]])
            expected = freqresp(one, omega)[1] * omega**power
            np.testing.assert_allclose(found.values[:, j], expected, rtol=1e-7, atol=1e-7 * np.abs(expected).max())
    assert found.unit == "m/m"


def test_it_is_what_a_simulation_settles_to():
    drive = fb.Harmonic(1e-4, 300.0)
    model = fb.Scene(BEAM, CLAMPED, dashpots=[fb.Dashpot(L, 20.0)], damping=fb.ModalDamping(0.05), base=drive).reduce(3)
    run = model.simulate(2.0, 1e-3)
    H = model.frequency_response([300.0], output=0.3).values[0]
    settled = (H * 1e-4 * np.exp(300.0j * run.t)).real
    late = run.t > 1.5
    np.testing.assert_allclose(run.displacement(0.3)[late], settled[late], atol=1e-6 * abs(H) * 1e-4)


def test_the_figure_shows_amplitude_and_phase():
    model = fb.Scene(BEAM, CLAMPED, damping=fb.ModalDamping(0.02)).reduce(3)
    found = model.frequency_response(OMEGA[1:], output=[0.2, L])
    upper, lower = fb.plot.frequency_response(found).axes
    np.testing.assert_allclose(upper.lines[1].get_ydata(), found.amplitude[:, 1])
    assert np.abs(np.diff(lower.lines[0].get_ydata())).max() < 90.0  # no jump by a turn
    assert len(repr(found)) < 200


STRUCK = fb.Scene(BEAM, CLAMPED, forces=[fb.PointForce(L, fb.Harmonic(1.0, 2.0))])
FREE = fb.Scene(BEAM, damping=fb.ModalDamping(0.1))

test_bad_input = refused(
    (lambda: STRUCK.reduce(2).frequency_response([1.0], "forces[1]"), r"one of base, forces\[0\], got 'forces\[1\]'"),
    (lambda: STRUCK.reduce(2).frequency_response([-1.0]), "omega must be at least 0"),
    (lambda: (one := STRUCK.reduce(2)).frequency_response(one.omega), "must not be an undamped natural frequency"),
    (lambda: STRUCK.reduce(2).frequency_response([1.0], output=1.0), "must lie on the beam"),
    (lambda: STRUCK.reduce(2).frequency_response([1.0], L, L, absolute=True), "absolute is for"),
    (lambda: STRUCK.reduce(2).frequency_response([1.0], "base", L, absolute="no"), "True or False, got 'no'"),
    (lambda: STRUCK.reduce(2).frequency_response([1.0], (L, "y")), "input must be a place z in m"),
    (lambda: FREE.reduce(3).frequency_response([0.0], 0.1, 0.2), "natural frequency"),
)


def test_modes_that_nothing_couples_are_not_solved_together(monkeypatch):
    """Against the same with all modes in one matrix."""
    model, omega = paper_scene().reduce(8), np.linspace(0.0, 2e4, 301)
    found = model.frequency_response(omega, "base")
    K, C = model.system.K, model.system.C
    v = model.participation
    q = [w**2 * np.linalg.solve(K + 1j * w * C - w**2 * np.eye(8), v) for w in omega]
    np.testing.assert_allclose(found.values, q @ model.phi(found.output), rtol=1e-10)
    monkeypatch.setattr(np.linalg, "solve", None)
    np.testing.assert_array_equal(model.frequency_response(omega, "base").values, found.values)
