"""Backbones by phase resonance: linear oscillators exactly, friction, stops and springs against harmonic balance."""

import math
from functools import cache

import numpy as np
import pytest
from refusals import refused_by
from test_peak import FILE, SPRING, TIP, ZETA, damped, driven

import fembeam as fb
from contacts import Jenkins, Polynomial
from fembeam.study import equivalent

SPAN = (150.0, 300.0)


@cache
def of_a_slider():
    return fb.study.backbone(damped(), [0.01, 0.1, 0.4, 0.8, 1.2], SPAN)


@pytest.mark.parametrize("zeta", [0.01, 0.6])
def test_a_linear_oscillator_is_itself(zeta):
    """Phase resonance lies at ω₀, whatever the damping, and the tone does π F X of work."""
    model = driven(zeta=zeta)
    found = fb.study.backbone(model, [0.01, 1.0], (100.0, 300.0))
    np.testing.assert_allclose(found.omega, model.omega[0], rtol=1e-9)
    np.testing.assert_allclose(found.zeta, zeta, rtol=1e-8)
    static = found.levels * model.phi(TIP)[0] ** 2 / model.omega[0] ** 2
    np.testing.assert_allclose(found.amplitude, static / (2.0 * zeta))
    np.testing.assert_allclose(found.energy, math.pi * found.levels * found.amplitude)


def test_a_shaken_frame():
    """The load is -Γ ÿ: the same resonance."""
    model = driven(force=0.0, zeta=0.05, base=fb.Harmonic(1e-3, 200.0, phase=0.7))
    found = fb.study.backbone(model, [1e-4, 1e-3], (100.0, 300.0))
    np.testing.assert_allclose(found.omega, model.omega[0], rtol=1e-9)
    np.testing.assert_allclose(found.zeta, 0.05, rtol=1e-8)


def test_two_modes_hardly_change_each_other():
    model = fb.Scene(
        driven().scene.beam, [fb.Clamped(0.0)], damping=fb.ModalDamping([0.01, 0.02]),
        forces=[fb.PointForce(TIP, fb.Harmonic(1.0, 200.0))],
    ).reduce(modes=2)  # fmt: skip
    for i, span in ((0, (150.0, 300.0)), (1, (900.0, 1400.0))):
        found = fb.study.backbone(model, [0.5, 1.0], span)
        np.testing.assert_allclose(found.omega, model.omega[i], rtol=1e-3)
        np.testing.assert_allclose(found.zeta, [0.01, 0.02][i], rtol=1e-2)


def test_a_slider_that_sticks_is_a_spring():
    """At the lowest level it does not slip: ω² = ω₀² + k φ², and ζω = ζ₀ω₀."""
    model, found = damped(), of_a_slider()
    omega = math.sqrt(model.omega[0] ** 2 + SPRING * model.phi(TIP)[0] ** 2)
    assert found.omega[0] == pytest.approx(omega, rel=1e-9)
    assert found.zeta[0] == pytest.approx(ZETA * model.omega[0] / omega, rel=1e-8)


def test_a_slider_by_equivalent_linearisation():
    """Harmonic balance of the law at the same amplitude: ω² = ω₀² + φ² k, 2ζω² = 2ζ₀ω₀ω + φ² ωc."""
    model, found = damped(), of_a_slider()
    law, phi = equivalent(Jenkins(SPRING, 1.0), found.amplitude), model.phi(TIP)[0]
    omega = np.sqrt(model.omega[0] ** 2 + phi**2 * law.stiffness)
    zeta = (2.0 * ZETA * model.omega[0] * omega + phi**2 * law.loss_stiffness) / (2.0 * omega**2)
    np.testing.assert_allclose(found.omega, omega, rtol=2e-3)
    np.testing.assert_allclose(found.zeta, zeta, rtol=2e-2)
    assert found.zeta.argmax() == 3  # most where X = 2 f/k, about


def test_the_work_of_the_tone_is_what_is_lost():
    """4 f (X - f/k) of the slider, and 2π ζ₀ω₀ω X²/φ² of the mode, whose motion is nearly harmonic."""
    model, found = damped(), of_a_slider()
    X = found.amplitude
    mode = 2.0 * math.pi * ZETA * model.omega[0] * found.omega * (X / model.phi(TIP)[0]) ** 2
    slider = 4.0 * np.maximum(X - 1.0 / SPRING, 0.0)
    np.testing.assert_allclose(found.energy, mode + slider, rtol=2e-3)
    assert found.energy[0] == pytest.approx(mode[0], rel=1e-8)


def test_force_and_limit_together_scale_the_motion():
    found = fb.study.backbone(damped(3.0), 3.0 * of_a_slider().levels[2:4], SPAN)
    np.testing.assert_allclose(found.omega, of_a_slider().omega[2:4], rtol=1e-7)
    np.testing.assert_allclose(found.zeta, of_a_slider().zeta[2:4], rtol=1e-6)
    np.testing.assert_allclose(found.amplitude, 3.0 * of_a_slider().amplitude[2:4], rtol=1e-6)


def test_a_hardening_spring_beyond_its_folds():
    """Duffing: ω² = ω₀² + ¾ k₃ φ² X² of one harmonic; response curves overhang, the backbone goes on."""
    model = driven(fb.Element(TIP, Polynomial([0.0, 0.0, 1e7])), zeta=0.01)
    found = fb.study.backbone(model, [0.1, 0.5], SPAN)
    omega = np.sqrt(model.omega[0] ** 2 + 0.75e7 * (model.phi(TIP)[0] * found.amplitude) ** 2)
    np.testing.assert_allclose(found.omega, omega, rtol=2e-3)
    np.testing.assert_allclose(found.zeta, 0.01 * model.omega[0] / found.omega, rtol=2e-3)
    assert found.omega[-1] > 1.08 * model.omega[0]


def test_what_is_found_prints_and_draws(tmp_path):
    found = of_a_slider()
    assert [list(row) for row in found.table()] == 5 * [["level", "amplitude", "omega", "zeta", "energy", "stable"]]
    assert "amplitude / N amplitude / m ω / rad/s ζ energy per period / J stable" in " ".join(str(found).split())
    found.save(tmp_path / "backbone.csv")
    head = (tmp_path / "backbone.csv").read_text().splitlines()[0]
    assert head == "level [N],amplitude [m],omega [rad/s],zeta,energy [J],stable"
    assert set(found.plain()) == {"level", "resonances"}
    assert [axis.get_ylabel() for axis in found.figure().axes] == ["ω / rad s⁻¹", "equivalent damping ratio ζ"]


def test_the_table_backbone(tmp_path, file_of):
    text = FILE[: FILE.index("[peak]")] + "[backbone]\nlevels = [0.1, 1.0]\nspan = [100, 300]\n"
    file = file_of(text)
    found = file.studies["backbone"].run(file, tmp_path)
    np.testing.assert_allclose(found.omega, file.model().omega[0], rtol=1e-9)
    with pytest.raises(ValueError, match="ascending"):
        file_of(text.replace("0.1, 1.0", "1.0, 0.1"))


def two_tones():
    return driven(base=fb.Harmonic(1e-3, 400.0))


test_bad_input = refused_by(
    lambda make, change: fb.study.backbone(make(), **{"levels": [0.5, 1.0], "span": SPAN, **change}),
    (damped, {"levels": [1.0, 0.5]}, "levels must be finite and ascending"),
    (damped, {"levels": [0.0, 0.5]}, "levels must be above 0"),
    (damped, {"span": (300.0, 200.0)}, "span must be two values"),
    (damped, {"span": (260.0, 300.0)}, "no phase resonance"),
    (damped, {"level": "omega"}, "another number"),
    (damped, {"level": "amplitud"}, "no such parameter"),
    (two_tones, {"level": "forces[0].signal.amplitude"}, "loads of one frequency"),
)
