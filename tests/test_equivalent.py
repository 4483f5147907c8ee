"""Laws as springs and dashpots over amplitude: closed forms of friction, Masing's rule, stops, dashpots, bad input."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

import fembeam as fb
from contacts import (
    BoucWen,
    Coulomb,
    ElastoPlastic,
    Hertz,
    Hysteretic,
    Iwan,
    Jenkins,
    KelvinVoigt,
    Polynomial,
    WaltonBraun,
)
from fembeam.study import equivalent

K, F = 2e4, 10.0
SLIP = F / K
AMPLITUDES = SLIP * np.array([0.5, 0.999, 1.001, 1.5, 4.0, 50.0])


def jenkins(k, f, X):
    """Energy per cycle and equivalent stiffness of a spring and a slider in series; Caughey 1960."""
    if k * X <= f:
        return 0.0, k
    angle = math.acos(1.0 - 2.0 * f / (k * X))
    return 4.0 * f * (X - f / k), k / math.pi * (angle - 0.5 * math.sin(2.0 * angle))


def test_spring_and_slider():
    found = equivalent(Jenkins(K, F), AMPLITUDES)
    energy, stiffness = np.array([jenkins(K, F, X) for X in AMPLITUDES]).T
    np.testing.assert_allclose(found.energy, energy, rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(found.stiffness, stiffness, rtol=1e-12)
    np.testing.assert_allclose(found.loss_stiffness, energy / (math.pi * AMPLITUDES**2), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found.loss_factor, found.loss_stiffness / stiffness, rtol=1e-12, atol=1e-15)
    moved = equivalent(Jenkins(K, F), AMPLITUDES, mean=3.0 * SLIP)  # the same once it has slipped
    exact = 1e-7  # √(2 eps m/X), of the angles where it turns
    np.testing.assert_allclose(moved.energy, energy, rtol=exact, atol=exact * F * SLIP)
    np.testing.assert_allclose(moved.stiffness, stiffness, rtol=exact)
    with pytest.raises(ValueError, match="give omega="):
        _ = found.damping


def test_the_most_damping_of_a_slider_is_known():
    """ω c = 4 f (X - f/k)/(π X²) is largest at X = 2 f/k: k/π."""
    found = equivalent(Jenkins(K, F), [1.9 * SLIP, 2.0 * SLIP, 2.1 * SLIP])
    assert found.loss_stiffness[1] == pytest.approx(K / math.pi, rel=1e-12)
    assert max(found.loss_stiffness[[0, 2]]) < found.loss_stiffness[1]


def test_elements_beside_each_other_add():
    """Linear hardening is a slider beside a spring; Iwan's model is many sliders."""
    one = equivalent(Jenkins(K, F), AMPLITUDES)
    sum_ = equivalent(Jenkins(K, F) + Polynomial([3e3]), AMPLITUDES)
    np.testing.assert_allclose(sum_.stiffness, one.stiffness + 3e3, rtol=1e-10)
    np.testing.assert_allclose(sum_.energy, one.energy, rtol=1e-9, atol=1e-14)
    law = Iwan([1e4, 2e4, 4e4], [5.0, 2.0, 9.0])
    each = np.array([[jenkins(k, f, X) for k, f in zip(law.stiffness, law.limits, strict=True)] for X in AMPLITUDES])
    found = equivalent(law, AMPLITUDES)
    np.testing.assert_allclose(found.energy, each[:, :, 0].sum(axis=1), rtol=1e-11, atol=1e-17)
    np.testing.assert_allclose(found.stiffness, each[:, :, 1].sum(axis=1), rtol=1e-11)


def test_uniform_limits():
    """Iwan 1966: W = k² X³/3f up to X = 2 f/k, 4 f (X - 4f/3k) beyond, with N parts but for 1/N²."""
    X = np.array([0.5, 1.0, 2.0, 3.0]) * SLIP
    exact = np.where(X <= 2 * SLIP, K**2 * X**3 / (3 * F), 4 * F * (X - 4 * F / (3 * K)))
    coarse, fine = (equivalent(Iwan.uniform(K, F, parts), X).energy / exact - 1.0 for parts in (20, 40))
    assert abs(fine).max() < 6e-3
    assert abs(coarse / fine - 4.0).max() < 0.2


def test_masing_rule():
    """W = 8 ∫_0^X F_b dδ - 4 X F_b(X) of every law whose branches are its first loading twice as large."""
    law = Iwan.from_backbone([1e-4, 3e-4, 8e-4], [2.0, 4.0, 6.0], slope=1e3)
    for X in (5e-5, 2e-4, 7e-4, 2e-3):
        loading = quad(lambda d: law.along([d])[0], 0.0, X, points=[x for x in (1e-4, 3e-4, 8e-4) if x < X])[0]
        energy = 8.0 * loading - 4.0 * X * law.along([X])[0]
        assert equivalent(law, X).energy[0] == pytest.approx(energy, rel=1e-9, abs=1e-15)


def test_the_energy_is_the_area_of_the_loop():
    for law in (BoucWen(K, 0.2, 1.0, 3e3, 1e3), ElastoPlastic(K, F, 4e3), Coulomb(F, K)):
        found = equivalent(law, [1e-3])
        loop = 1e-3 * np.cos(np.linspace(0.0, 2.0 * math.pi, 4001))
        path = np.concatenate((np.tile([1e-3, -1e-3], 40), loop))
        force = law.along(path)[80:]
        area = float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(loop)))
        assert found.energy[0] == pytest.approx(area, rel=2e-5)


def test_small_cycles_of_bouc_wen_forget_their_start_slowly():
    """W = (1 - α) k β X⁴ for n = 2 and small β X²: at 7e-4 it was off by 5e-4, 1.5e-3 was refused."""
    amplitudes = np.array([2e-4, 7e-4, 1.5e-3])
    found = equivalent(BoucWen(1e3, 0.2, 1.0, 800.0, 300.0, 2), amplitudes)
    np.testing.assert_allclose(found.energy, 0.8e3 * 800.0 * amplitudes**4, rtol=2e-6)
    with pytest.raises(ValueError, match=r"not the same after .*: it has no steady loop"):
        equivalent(BoucWen(1e3, 0.2, 1.0, -300.0, -300.0), 7e-4)


def test_springs_and_dashpots_give_themselves():
    found = equivalent(KelvinVoigt(5e3, 7.0), [1e-3, 2e-3], omega=30.0)
    np.testing.assert_allclose(found.stiffness, 5e3, rtol=1e-9)
    np.testing.assert_allclose(found.damping, 7.0, rtol=1e-9)
    slow = equivalent(KelvinVoigt(5e3, 7.0), [1e-3])
    assert slow.energy[0] == pytest.approx(0.0, abs=1e-15)
    cubic = equivalent(Polynomial([0.0, 0.0, 1e9]), [2e-3])  # 3/4 k X²
    assert cubic.stiffness[0] == pytest.approx(0.75e9 * 4e-6, rel=1e-9)


def test_a_stop():
    """Half of a spring without a gap; with one, that of the bilinear oscillator; Hertz as an integral."""
    assert equivalent(KelvinVoigt(5e3, 0.0), 1e-3, stop=True).stiffness[0] == pytest.approx(2.5e3, rel=1e-9)
    angle = math.acos(0.4)
    gap = equivalent(KelvinVoigt(5e3, 0.0), 1e-3, mean=-4e-4, stop=True).stiffness[0]
    assert gap == pytest.approx(5e3 / math.pi * (angle - 0.5 * math.sin(2 * angle)), rel=1e-9)
    assert equivalent(KelvinVoigt(5e3, 0.0), 1e-3, mean=-2e-3, stop=True).stiffness[0] == 0.0
    hertz = quad(lambda x: math.cos(x) ** 2.5, 0.0, math.pi / 2)[0] * 2.0 / math.pi * 1e7 * 1e-3**0.5
    assert equivalent(Hertz(1e7), 1e-3).stiffness[0] == pytest.approx(hertz, rel=1e-8)


@pytest.mark.parametrize("mean", [0.0, -4e-4, 6e-4])
def test_a_law_that_goes_by_the_rate_of_entry(mean):
    """F = K δ (1 + a δ̇/v), v = ω √(X² - m²): W = K a X (m (α - sin α cos α) + 2/3 X sin³ α)/sin α, whatever ω."""
    X, angle = 1e-3, math.acos(-mean / 1e-3)
    lost = mean * (angle - math.sin(angle) * math.cos(angle)) + 2.0 / 3.0 * X * math.sin(angle) ** 3
    for omega in (30.0, 100.0):
        found = equivalent(Hysteretic(1e5, 0.3, exponent=1.0), X, omega, mean)
        assert found.energy[0] == pytest.approx(1e5 * 0.3 * X * lost / math.sin(angle), rel=1e-8)


@pytest.mark.parametrize("beside", [WaltonBraun(1e4, 3e4), WaltonBraun(1e4, 3e4) + Jenkins(2e3, 0.1), Hertz(1e7)])
@pytest.mark.parametrize("mean", [0.0, 3e-4])
def test_what_acts_beside_a_stop_acts_as_long_as_it_is_closed(beside, mean):
    """c X² ω (θ - sin θ cos θ) in place of π c X² ω, θ the angle at which the stop opens."""
    X, omega, c = 1e-3, 10.0, 10.0
    angle = math.acos(-mean / X)
    both, alone = (equivalent(law, [X], omega, mean) for law in (beside + KelvinVoigt(1.0, c), beside))
    lost = c * X**2 * omega * (angle - math.sin(angle) * math.cos(angle))
    assert both.energy[0] - alone.energy[0] == pytest.approx(lost, rel=1e-6)


def test_bad_input_and_what_is_shown():
    for wrong in ([], [0.0], [-1e-3], [math.nan], [[1e-3]]):
        with pytest.raises(ValueError, match="amplitudes must be above 0"):
            equivalent(Jenkins(K, F), wrong)
    with pytest.raises(ValueError, match="law must be a contact law"):
        equivalent(3.0, [1e-3])
    with pytest.raises(ValueError, match="omega"):
        equivalent(Jenkins(K, F), [1e-3], omega=-1.0)
    with pytest.raises(ValueError, match="mean"):
        equivalent(Jenkins(K, F), [1e-3], mean=math.inf)
    given = np.array([1e-3, 2e-3])
    found = equivalent(Jenkins(K, F), given)
    assert given.tolist() == [1e-3, 2e-3]
    assert "energy per cycle" in str(found)
    assert [row["amplitude"] for row in found.table()] == [1e-3, 2e-3]
    assert [axis.get_ylabel().split(" /")[0] for axis in found.figure().axes] == [
        "energy per cycle", "equivalent stiffness", "loss factor",
    ]  # fmt: skip
    assert fb.study.Equivalent is type(found)


def test_files_have_units(tmp_path):
    equivalent(Jenkins(K, F), AMPLITUDES).save(tmp_path / "law.csv")
    head = (tmp_path / "law.csv").read_text(encoding="utf-8").splitlines()[0]
    assert head == "amplitude [m],energy [J],stiffness [N/m],loss_stiffness [N/m],loss_factor"
