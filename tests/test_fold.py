"""Folds of branches over a second number: harmonic balance, brute force, multipliers, scaling, bad input."""

import math
from functools import cache

import numpy as np
import pytest
from problems import ROD, ROD_FILE
from refusals import refused_by

import fembeam as fb
from contacts import KelvinVoigt, Polynomial
from fembeam.scene_file import SceneFileError

TIP = 0.5
CUBIC, ZETA, FORCE = 2e7, 0.01, "forces[0].signal.amplitude"


def duffing(force=0.3, faster=1.0, omega=190.0):
    """One mode of a rod with a cubic spring at its tip; all of it may move ``faster``, as on a clock that goes slow."""
    scene = fb.Scene(
        fb.Beam(0.5, fb.Section.circle(2.1e11 * faster**2, 7800.0, 0.01)),
        [fb.Clamped(0.0)],
        elements=[fb.Element(TIP, Polynomial([0.0, 0.0, CUBIC * faster**2]), name="spring")],
        forces=[fb.PointForce(TIP, fb.Harmonic(force * faster**2, omega * faster))],
        damping=fb.ModalDamping(ZETA),
    )
    return scene.reduce(modes=1)


def of_branch(model, span):
    return model.branch("omega", span, step=0.2).run()


def places(branch):
    return sorted(one.parameter for one in branch.special if one.mark == "fold")


@cache
def known():
    return of_branch(duffing(), (175.0, 210.0))


@cache
def curve():
    return fb.study.fold(known(), FORCE, (0.05, 0.4))


def test_the_cusp_against_harmonic_balance():
    """Of one term, Δ = ω² - ω₀² = 2√3 ζ ω₀ ω and f² = 8 Δ³/27β, to its own error: third harmonics, some Δ/8ω²."""
    model, found = duffing(), curve()
    omega, phi = float(model.omega[0]), float(model.phi(TIP)[0])
    root = math.sqrt(3.0) * ZETA * omega
    at = root + math.hypot(root, omega)
    delta = at**2 - omega**2
    force = math.sqrt(8.0 * delta**3 / (27.0 * 0.75 * CUBIC * phi**4)) / phi
    (i,) = found.cusps
    assert found.at[i] == pytest.approx(at, rel=2e-4)
    assert found.values[i] == pytest.approx(force, rel=0.125 * delta / at**2)
    assert found.values.min() == found.values[i]


def test_the_ends_against_a_branch_there():
    """At the end of the span, met exactly from both sides of the cusp, folds are those of a branch."""
    found = curve()
    np.testing.assert_array_equal(found.values[[0, -1]], 0.4)
    np.testing.assert_allclose(sorted(found.at[[0, -1]]), places(of_branch(duffing(0.4), (180.0, 220.0))), rtol=1e-9)


def test_every_orbit_has_a_multiplier_1():
    for one in curve().orbits:
        assert np.abs(one.multipliers - 1.0).min() < 1e-7
        assert one.found.residual < 1e-9


def test_folds_alone_have_no_derivative():
    """Of a structure 1e6 times as fast too, where a condition of Φ that mixes q and q̇ took any orbit for a fold."""
    branch, faster = known(), 1e6
    folds = of_branch(duffing(faster=faster), (175.0 * faster, 210.0 * faster)).special
    assert len(folds) == 2
    for one in [*branch.special, *folds]:
        with pytest.raises(ArithmeticError, match="a multiplier is 1"):
            one.sensitivity("omega")
    slow = branch.orbits[3]
    fast = duffing(faster=faster, omega=slow.parameter).orbit(start=slow.state * [1.0, faster])
    for path, unit in (("omega", faster), (FORCE, faster**2)):
        found, expected = unit * fast.sensitivity(path).q, slow.sensitivity(path).q
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


def of_stop():
    """A branch of a rod that strikes a stop."""
    scene = fb.Scene(ROD, [fb.Clamped(0.0)], stops=[fb.Stop(TIP, KelvinVoigt(5e3, 1.0), gap=1e-3, name="stop")],
                     forces=[fb.PointForce(TIP, fb.Harmonic(1.0, 200.0))], damping=fb.ModalDamping(0.02))  # fmt: skip
    return of_branch(scene.reduce(modes=1), (160.0, 280.0))


@pytest.mark.parametrize("number", [0, 1])
def test_a_closed_curve_is_passed_once(number):
    """Gaps near nothing and gaps beyond the amplitude at resonance fold nothing: in between the folds form a ring."""
    found = fb.study.fold(of_stop(), "stops[stop].gap", (1e-4, 0.1), number=number)
    assert set(found.endings) == {"closed: came back to its first fold"}
    assert len(found.cusps) == 2
    np.testing.assert_allclose(found.values[[0, -1]], 1e-3, rtol=1e-12)
    assert found.at[0] == found.at[-1]
    model = found.orbits[0].model
    resonance = float(model.phi(TIP)[0] ** 2 / (2.0 * 0.02 * model.omega[0] ** 2))
    assert 0.9 * resonance < found.values.max() < resonance


def test_steps_grow_with_the_motion():
    """Followed to 30 times the force, from near the cusp as from far: steps were those of the motion at the start."""
    near, far = of_branch(duffing(0.13), (180.0, 195.0)), of_branch(duffing(3.9), (175.0, 500.0))
    counts = [len(fb.study.fold(one, FORCE, (0.1, 4.0)).values) for one in (near, far)]
    assert counts[0] < 3 * counts[1]


def test_a_stop_by_its_gap_and_by_the_force():
    """Lengths scale with the force: a gap 1.02 times as wide has the folds of a force 1.02 times as small."""
    branch = of_stop()
    by_gap = fb.study.fold(branch, "stops[stop].gap", (1e-3, 1.02e-3))
    by_force = fb.study.fold(branch, FORCE, (1.0 / 1.02, 1.0))
    assert by_gap.at[-1] == pytest.approx(by_force.at[0], rel=1e-9)
    assert abs(by_gap.at[-1] - by_gap.at[0]) > 1e-4 * by_gap.at[0]


def test_it_prints_and_is_drawn(tmp_path):
    found = curve()
    assert "cusp" in str(found)
    assert found.table()[0].keys() == {"value", "at", "amplitude", "mark"}
    assert len(found.plain()["folds"]) == len(found.values)
    said = " ".join(str(found).split())
    assert f"{FORCE} / N fold at forces[0].signal.omega / rad s⁻¹ amplitude / m" in said
    found.save(tmp_path / "folds.csv")
    assert (tmp_path / "folds.csv").read_text().startswith("value [N],at [rad/s],amplitude [m],mark\n")
    figure = found.figure()
    assert figure.axes[1].get_xlabel().startswith("drive amplitude")
    fb.plot.fold_curve(found, figure.axes)


FILE = f"""{ROD_FILE}
[[elements]]
z = 0.5
law = {{ kind = "polynomial", coefficients = [0.0, 0.0, {CUBIC}] }}
[[forces]]
z = 0.5
signal = {{ kind = "harmonic", amplitude = 0.3, omega = 190.0 }}
[damping]
zeta = {ZETA}
[reduce]
modes = 1
[fold]
over = "forces[0].signal.amplitude"
values = [0.298, 0.3]
span = [175.0, 210.0]
"""


def test_the_table_of_a_scene_file(tmp_path, file_of):
    file = file_of(FILE)
    found = file.studies["fold"].run(file, tmp_path)
    assert np.abs(np.array(places(known())) - found.at[found.values == 0.3]).min() < 1e-7
    assert np.count_nonzero(found.values == 0.3) == 1  # the end that it begins at, once


def test_the_branch_of_a_fold_is_kept(tmp_path, file_of, monkeypatch):
    """What came after it failed or was killed, and the branch was lost."""
    file = file_of(FILE)

    def failing(branch, *_):
        raise KeyboardInterrupt

    monkeypatch.setattr("fembeam.study.fold", failing)
    with pytest.raises(KeyboardInterrupt):
        file.studies["fold"].run(file, tmp_path)
    monkeypatch.setattr("fembeam.study.fold", lambda branch, *_: branch)
    orbits = file.model().resume(tmp_path / "fold.npz").orbits
    monkeypatch.setattr("solvers.branches.walk.Walk.extend", failing)  # not computed again
    kept = file.studies["fold"].run(file, tmp_path)
    np.testing.assert_array_equal(kept.parameter, [one.parameter for one in orbits])


def test_values_without_the_present_one_are_refused_when_read(file_of):
    """Before the branch is computed, by the name of the key."""
    with pytest.raises(SceneFileError, match=r"\[fold\]: values must hold the present value 0.3 of forces"):
        file_of(FILE.replace("[0.298, 0.3]", "[0.1, 0.2]"))


test_bad_input = refused_by(
    lambda change: fb.study.fold(**{"branch": known(), "over": FORCE, "span": (0.05, 0.4), **change}),
    ({"over": "omega"}, "another number"),
    ({"over": "forces[0].signal.amplitud"}, "amplitude"),
    ({"number": 7}, "one of the 2 folds"),
    ({"span": (0.6, 0.8)}, "must hold the present value 0.3"),
    ({"span": (0.8, 0.1)}, "must hold the present value"),
    ({"z": 7.0}, "z"),
)
