"""Peaks of response curves over a second number: closed forms, harmonic balance, brute force, symmetry, bad input."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from problems import ROD, ROD_FILE
from refusals import refused_by
from scipy.optimize import brentq, minimize_scalar
from test_equivalent import jenkins

import fembeam as fb
from contacts import Jenkins, KelvinVoigt, Polynomial
from fembeam.model.sensitivity import of_amplitude
from fembeam.scene import with_value

TIP = 0.5
SPRING, LIMIT, ZETA = 2e3, 1.0, 0.01
DAMPER, SPAN = "elements[damper].law.limit", (185.0, 250.0)


def driven(*elements, force=1.0, zeta=ZETA, omega=200.0, **parts):
    """One mode of a clamped rod, pushed at its tip."""
    load = {"forces": [fb.PointForce(TIP, fb.Harmonic(force, omega))]} if force else {}
    scene = fb.Scene(ROD, [fb.Clamped(0.0)], elements=elements, damping=fb.ModalDamping(zeta), **load, **parts)
    return scene.reduce(modes=1)


def damped(limit=LIMIT, **options):
    return driven(fb.Element(TIP, Jenkins(SPRING, limit), name="damper"), **options)


def over_limits(values):
    return fb.study.peak(damped(), "omega", DAMPER, values, SPAN)


# --- closed forms ----------------------------------------------------------------------------------------------------


def test_a_linear_oscillator_over_its_damping():
    """ω √(1 - 2ζ²), F φ²/(2ζω² √(1 - ζ²)), and the derivative of the latter."""
    model, zeta = driven(), np.array([0.02, 0.3])
    found = fb.study.peak(model, "omega", "damping.zeta[0]", zeta, (100.0, 300.0))
    omega, phi = model.omega[0], model.phi(TIP)[0]
    height = phi**2 / (2.0 * zeta * omega**2 * np.sqrt(1.0 - zeta**2))
    np.testing.assert_allclose(found.at, omega * np.sqrt(1.0 - 2.0 * zeta**2), rtol=1e-6)
    np.testing.assert_allclose(found.amplitude, height, rtol=1e-8)
    np.testing.assert_allclose(found.slope, -height / zeta * (1.0 - 2.0 * zeta**2) / (1.0 - zeta**2), rtol=1e-5)
    assert found.least is None
    assert found.stable.all()
    assert "slope" in str(found)  # which has no unit here, as ζ has none


def test_a_shaken_frame_has_its_peak_above():
    """Relative to the frame: ω/√(1 - 2ζ²), Y Γφ/(2ζ √(1 - ζ²)); proportional to Y."""
    model, zeta = driven(force=0.0, zeta=0.2, base=fb.Harmonic(1e-3, 200.0)), 0.2
    found = fb.study.peak(model, "omega", "base.amplitude", [1e-3, 2e-3], (120.0, 320.0))
    unit = abs(model.participation[0] * model.phi(TIP)[0]) / (2.0 * zeta * math.sqrt(1.0 - zeta**2))
    np.testing.assert_allclose(found.at, model.omega[0] / math.sqrt(1.0 - 2.0 * zeta**2), rtol=1e-6)
    np.testing.assert_allclose(found.amplitude, unit * found.values, rtol=1e-8)
    np.testing.assert_allclose(found.slope, unit, rtol=1e-5)


def test_a_stuck_damper_is_a_spring():
    found = over_limits([50.0, 60.0])
    model = damped()
    omega = math.sqrt(model.omega[0] ** 2 + SPRING * model.phi(TIP)[0] ** 2)
    zeta = ZETA * model.omega[0] / omega
    np.testing.assert_allclose(found.at, omega * math.sqrt(1.0 - 2.0 * zeta**2), rtol=1e-6)
    np.testing.assert_allclose(found.slope, 0.0, atol=1e-9)


# --- friction --------------------------------------------------------------------------------------------------------


@cache
def best():
    return over_limits([1.0, 1.99, 2.01])


def by_harmonic_balance(limit):
    """Height of the peak with the slider as a spring and a dashpot of the same first harmonic."""
    model = damped()
    mode, phi = model.omega[0], model.phi(TIP)[0]

    def least_force(X):  # at the best frequency for X
        energy, k = jenkins(SPRING, limit, X)
        c = energy / (math.pi * X**2)

        def force(omega):
            return X * math.hypot(k + (mode**2 - omega**2) / phi**2, c + 2.0 * ZETA * mode * omega / phi**2)

        return minimize_scalar(force, bounds=SPAN, method="bounded").fun

    return brentq(lambda X: least_force(X) - 1.0, limit / SPRING, 1e-1)


def test_the_peak_of_a_friction_damper_is_that_of_harmonic_balance():
    """The motion is nearly harmonic, so that the height agrees within a percent."""
    assert best().amplitude[1] == pytest.approx(by_harmonic_balance(best().values[1]), rel=1e-2)


def test_the_best_limit_by_brute_force():
    """No frequency near the peak is higher, and no limit beside the best has a lower peak."""
    one = best().least
    assert one is not None

    def height(limit, omega):
        scene = with_value(with_value(one.orbit.model.scene, DAMPER, limit), "omega", omega)
        lowest, highest = replace(one.orbit.model, scene=scene).orbit(start=one.orbit).extremes(TIP)
        return 0.5 * (highest - lowest)

    for step in (-2e-3, -2e-4, 2e-4, 2e-3):
        assert height(one.value, one.at * (1.0 + step)) < one.amplitude
    for share in (0.95, 1.05):
        grid = [height(share * one.value, omega) for omega in one.at + np.linspace(-6.0, 6.0, 25)]
        assert one.amplitude < max(grid) < 1.01 * one.amplitude
    assert abs(one.slope) * 0.1 * one.value < 1e-4 * one.amplitude


def test_slopes_are_those_of_the_curve():
    slope = np.diff(best().amplitude)[1] / np.diff(best().values)[1]
    assert np.mean(best().slope[1:3]) == pytest.approx(slope, rel=1e-3)


def test_force_and_limit_together_scale_the_motion():
    model = damped(3.0, force=3.0)
    forces = 3.0 / best().values[[2, 0]]
    found, known = fb.study.peak(model, "omega", "forces[0].signal.amplitude", forces, SPAN), best()
    # a(F, f) = F a(1, f/F), so that F ∂a/∂F + f ∂a/∂f = a
    for i, same in enumerate((2, 0)):
        assert found.amplitude[i] == pytest.approx(forces[i] * known.amplitude[same], rel=1e-6)
        assert found.at[i] == pytest.approx(known.at[same], rel=1e-5)
        assert forces[i] * found.slope[i] + 3.0 * known.slope[same] == pytest.approx(found.amplitude[i], rel=1e-4)


# --- overhanging curves, contacts ------------------------------------------------------------------------------------


def test_a_hardening_curve_that_overhangs():
    """Duffing: F φ²/2ζω₀ω on the backbone, of one harmonic, just before a fold."""
    force = 0.5
    model = driven(fb.Element(TIP, Polynomial([0.0, 0.0, 1e7])), zeta=0.01, force=force)
    found = fb.study.peak(model, "omega", "forces[0].signal.amplitude", [0.45, force], (185.0, 225.0))
    one, phi = found.tops[1], model.phi(TIP)[0]
    assert one.amplitude == pytest.approx(force * phi**2 / (0.02 * model.omega[0] * one.at), rel=1e-2)
    assert one.at == pytest.approx(math.hypot(model.omega[0], math.sqrt(0.75e7) * phi * one.amplitude), rel=2e-3)
    for share in (1.0 - 1e-3, 1.0 - 1e-4):
        beside = replace(model, scene=with_value(model.scene, "omega", share * one.at)).orbit(start=one.orbit)
        assert beside.extremes(TIP)[1] < one.amplitude
    assert found.slope[1] == pytest.approx(np.diff(found.amplitude)[0] / 0.05, rel=0.05)


def test_two_stops():
    """The slope of a curve of peaks by the gap is that of its points."""
    stops = [fb.Stop(TIP, KelvinVoigt(3e3, 2.0), 1e-3, side, name=side) for side in ("below", "above")]
    model = driven(stops=stops, zeta=0.02, force=0.5)
    found = fb.study.peak(model, "omega", "stops[below].gap", [0.998e-3, 1.002e-3], (195.0, 240.0))
    assert found.over == "stops[below].gap"
    assert np.mean(found.slope) == pytest.approx(np.diff(found.amplitude)[0] / 4e-6, rel=1e-3)


def test_the_derivative_of_an_amplitude():
    """Of the extremes alone, it is that of `extremes`."""
    orbit = damped(1.0, omega=215.0).orbit()
    low, high = orbit.sensitivity(DAMPER).extremes(TIP)
    assert of_amplitude(orbit, TIP, DAMPER) == pytest.approx(0.5 * (high - low), rel=1e-6)


# --- results, files, bad input ---------------------------------------------------------------------------------------


def test_what_is_found_prints_and_draws(tmp_path):
    found = best()
    assert [list(row) for row in found.table()] == 3 * [["value", "at", "amplitude", "slope", "stable"]]
    assert "least" in str(found)
    said = "elements[damper].law.limit / N peak at forces[0].signal.omega / rad s⁻¹ amplitude / m slope / m/N stable"
    assert said in " ".join(str(found).split())
    found.save(tmp_path / "peak.csv")
    head = (tmp_path / "peak.csv").read_text().splitlines()[0]
    assert head == "value [N],at [rad/s],amplitude [m],slope [m/N],stable"
    assert set(found.plain()) == {"parameter", "over", "peaks", "least"}
    upper, lower = found.figure().axes
    assert upper.get_ylabel() == "amplitude of u(0.5 m) / mm"
    assert lower.get_ylabel() == "drive frequency ω / rad s⁻¹"


FILE = (
    ROD_FILE
    + """
[[forces]]
z = 0.5
signal = { kind = "harmonic", amplitude = 1.0, omega = 200.0 }

[damping]

zeta = [0.01]

[reduce]
modes = 1

[peak]
over = "zeta[0]"
values = [0.05, 0.1]
span = [100.0, 300.0]
"""
)


def test_the_table_peak(tmp_path, file_of):
    file = file_of(FILE)
    found = file.studies["peak"].run(file, tmp_path)
    exact = file.model().omega[0] * np.sqrt(1.0 - 2.0 * np.array([0.05, 0.1]) ** 2)
    np.testing.assert_allclose(found.at, exact, rtol=1e-6)
    with pytest.raises(ValueError, match="no such parameter"):
        file_of(FILE.replace("zeta[0]", "zeta[7]"))


test_bad_input = refused_by(
    lambda change: fb.study.peak(damped(), "omega", **{"over": DAMPER, "values": [1.0, 2.0], "span": SPAN, **change}),
    ({"over": "elements[dampr].law.limit"}, "did you mean"),
    ({"over": "omega"}, "another number"),
    ({"values": [2.0, 1.0]}, "ascending"),
    ({"values": [1.0]}, "two or more"),
    ({"values": [1.0, math.nan]}, "finite"),
    ({"span": (3.0, 2.0)}, "span must be two values"),
    ({"span": (186.0, 190.0)}, "widen the span"),
    ({"z": 0.7}, "z"),
)
