"""Laws with memory from synthetic loops whose truth is known."""

import re
import warnings

import numpy as np
import pytest
from refusals import refused
from scipy.stats import binom, chi2

from contacts import BoucWen, Hertz, Iwan, Jenkins, identify_loop
from contacts.identification.loop_fit import Fit, Measured
from contacts.identification.loop_models import Sliders, Smooth
from contacts.identification.loop_starts import _Tried

S = np.linspace(0.0, 30.0, 600)
PATH = 1e-3 * np.sin(S) * (1.0 + 0.5 * np.sin(0.21 * S))
DAMPER = Jenkins(2e4, 10.0)
JOINT = Iwan([2e4, 1e4, 5e3, 3e3], [4.0, 6.0, 4.0, np.inf])
WEN = BoucWen(2e4, 0.1, 1.0, 1500.0, 500.0)
SHARP = BoucWen(2e4, 0.1, 1.0, 3e6, -1e6, n=2)
MILLION = 1e-6  # chance of each statistical bound below to fail, some twenty of them


def truth(law):
    """Parameters of a law by the names of the estimates."""
    if isinstance(law, Iwan):
        finite = [(k, f) for k, f in zip(law.stiffness, law.limits, strict=True) if f < np.inf]
        named = {f"stiffness[{i}]": k for i, (k, _) in enumerate(finite)}
        return {**named, **{f"limits[{i}]": f for i, (_, f) in enumerate(finite)}, "spring": law.spring}
    names = ("stiffness", "limit") if isinstance(law, Jenkins) else ("stiffness", "alpha", "beta", "gamma")
    return {name: getattr(law, name) for name in names}


def noisy(law, path, level, rng):
    """Forces with noise relative to the largest."""
    force = law.along(path)
    return force + level * np.abs(force).max() * rng.standard_normal(force.size)


@pytest.mark.parametrize(
    ("law", "first"),
    [(WEN, 0), (JOINT, 40), (DAMPER, 137), (SHARP, 137)],
    ids=["wen", "iwan 40", "jenkins 137", "sharp 137"],
)
def test_clean_loops_give_the_law_back(law, first):
    """From a fresh start, from the first turn on, and from the middle of what went before."""
    path, force = PATH[first:], law.along(PATH)[first:]
    kept = path.copy(), force.copy()
    found = identify_loop(path, force, type(law))
    expected = truth(law)
    assert list(found.estimates) == list(expected)
    for name, value in expected.items():
        assert found.estimates[name].value == pytest.approx(value, rel=1e-6), name
    assert abs(found.force_offset.value) < 1e-6 * np.abs(force).max()
    assert found.noise < 1e-8 * np.abs(force).max()
    assert not found.remarks
    np.testing.assert_allclose(found.law.along(PATH), law.along(PATH), atol=1e-6 * np.abs(force).max())
    np.testing.assert_allclose(found.records[0].fitted, force, atol=1e-7 * np.abs(force).max())
    np.testing.assert_array_equal(kept, (path, force))


def test_a_slider_from_four_corners():
    """Stick and slip on either side, by hand."""
    path = np.array([0.0, 0.5, 1.0, 1.5, 2.0, 1.5, 1.0, 0.5, 0.0, -0.5, -0.1, 0.3]) * 1e-3
    force = [0.0, 5.0, 10.0, 10.0, 10.0, 5.0, 0.0, -5.0, -10.0, -10.0, -6.0, -2.0]
    found = identify_loop(path, force)
    assert found.law.stiffness == pytest.approx(1e4, rel=1e-8)
    assert found.law.limit == pytest.approx(10.0, rel=1e-8)


def test_several_records_with_one_zero_of_force():
    """Each begins with a memory of its own."""
    whole = DAMPER.along(PATH) + 3.0
    parts = [slice(0, 150), slice(170, 320), slice(390, 600)]
    found = identify_loop([PATH[p] for p in parts], [whole[p] for p in parts])
    assert (found.law.stiffness, found.law.limit) == (pytest.approx(2e4, rel=1e-6), pytest.approx(10.0, rel=1e-6))
    assert found.force_offset.value == pytest.approx(3.0, rel=1e-6)
    assert len(found.records) == 3
    with pytest.warns(UserWarning, match="neighbouring residuals are correlated"):
        identify_loop(PATH, whole, offset=False)


@pytest.mark.drawn
@pytest.mark.parametrize("law", [Iwan([2e4, 1e4, 3e3], [4.0, 9.0, np.inf]), WEN], ids=["iwan", "wen"])
def test_intervals_hold_the_truth_as_often_as_they_say(law):
    """Counts are binomial with 95 %, and the estimates scatter as the intervals say: χ² of their variance.

    So few experiments tell intervals twice too narrow or wide; `tests/bench/realisations.py` repeats them.
    """
    rng, expected, level, count = np.random.default_rng(3), truth(law), 0.02, 16
    option = {"n": law.n} if isinstance(law, BoucWen) else {"parts": 2}
    path, force = PATH[40:340], law.along(PATH)
    noise = level * np.abs(force).max()
    whole = [(force + noise * rng.standard_normal(force.size))[40:340] for _ in range(count)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = [identify_loop(path, one, type(law), **option) for one in whole]
    for name, value in expected.items():
        held = sum(value in one.estimates[name] for one in found)
        assert held >= binom.ppf(MILLION, count, 0.95), name
        values = np.array([one.estimates[name].value for one in found])
        claimed = np.mean([(one.estimates[name].high - one.estimates[name].value) / 1.968 for one in found])  # t, 295
        ratio = np.sum((values - values.mean()) ** 2) / claimed**2
        assert 0.9 * chi2.ppf(MILLION, count - 1) < ratio < 1.1 * chi2.isf(MILLION, count - 1), name
    left = np.array([one.noise for one in found]) / noise
    assert abs(np.mean(left**2) - 1.0) < 5.0 * np.sqrt(2.0 / 290.0 / count)


@pytest.mark.drawn
@pytest.mark.parametrize(("law", "other"), [(WEN, Jenkins), (DAMPER, BoucWen)], ids=str)
def test_residuals_tell_a_wrong_law(law, other):
    force = noisy(law, PATH, 0.005, np.random.default_rng(4))
    with pytest.warns(UserWarning, match="neighbouring residuals are correlated"):
        found = identify_loop(PATH, force, other)
    assert found.noise > 0.01 * np.abs(force).max()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        right = identify_loop(PATH, force, type(law))
    assert right.noise < 0.006 * np.abs(force).max()


@pytest.mark.drawn
@pytest.mark.parametrize("law", [Jenkins, Iwan, BoucWen])
@pytest.mark.parametrize("level", [0.0, 0.02])
def test_what_never_slips_tells_nothing_of_the_limit(law, level):
    force = noisy(Jenkins(2e4, 40.0), PATH, level, np.random.default_rng(5))
    with pytest.raises(ValueError, match=r"nothing slips in these records: the force is a line of slope (20|199)\d+"):
        identify_loop(PATH, force, law)


@pytest.mark.drawn
def test_a_first_loading_tells_the_limit_only_with_the_zero():
    path = np.linspace(0.0, 2e-3, 200)
    force = noisy(DAMPER, path, 0.01, np.random.default_rng(6))
    with pytest.warns(UserWarning, match="the records do not tell limit"):
        found = identify_loop(path, force)
    assert found.law.stiffness == pytest.approx(2e4, rel=0.02)
    assert 10.0 in identify_loop(path, force, offset=False, confidence=0.9999).estimates["limit"]


@pytest.mark.drawn
def test_slip_in_one_direction_bounds_the_limit_from_below_only():
    """By noise, least squares end on either side of where slip in the other direction begins; what is told is the same.

    Counts are binomial with 95 %. Were the zero of force known, the limit would be told.
    """
    t, rng, count = np.linspace(0.0, 1.0, 500), np.random.default_rng(9), 12
    path, law = -1e-3 * np.sin(8.0 * np.pi * t) * (0.4 + 0.6 * t) + 1e-4 * t, Jenkins(3e4, 28.0)
    force, name = law.along(path), "limit"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        forces = force + 0.4 + 0.5 * rng.standard_normal((count, 500))
        found = [identify_loop(path, one) for one in forces]
        known = identify_loop(path, force + 0.5 * rng.standard_normal(500), offset=False)
    open_ends = [-one.force_offset.low for one in found]
    for held in (
        [28.0 in one.estimates[name] and 0.4 in one.force_offset for one in found],
        [one.estimates[name].high == np.inf == end for one, end in zip(found, open_ends, strict=True)],
        [any(f"the records do not tell {name}" in told for told in one.remarks) for one in found],
    ):
        assert sum(held) >= binom.ppf(MILLION, count, 0.95)
    assert known.estimates[name].high < np.inf


@pytest.mark.drawn
def test_a_first_loading_tells_the_sum_of_beta_and_gamma():
    path = np.linspace(0.0, 2e-3, 400)
    force = noisy(WEN, path, 0.001, np.random.default_rng(7))
    with pytest.warns(UserWarning, match=r"stiffness and alpha trade off, correlation -(0\.99|1\.00)"):
        found = identify_loop(path, force, BoucWen, n=1)
    assert found.law.beta + found.law.gamma == pytest.approx(2000.0, rel=0.05)  # of 12 draws 0.6 % apart


@pytest.mark.filterwarnings("ignore:neighbouring residuals")
def test_records_of_very_different_ranges_have_no_message_of_scipy():
    """Starts beyond the bounds of least squares ended in "Initial guess is outside of provided bounds"."""
    short, ends = 1e-3 * np.sin(np.linspace(0.0, 12.0, 200)), np.array([1.0, 2.0])
    with pytest.warns(UserWarning, match="the records do not tell limits"):
        found = identify_loop([short, ends], [DAMPER.along(short), ends], Iwan)
    assert found.estimates["limits[0]"].high == np.inf


@pytest.mark.drawn
def test_no_more_sliders_than_there_are():
    for law in (DAMPER, Iwan([2e4, 1e4], [4.0, 9.0])):
        for level in (0.0, 0.01):
            found = identify_loop(PATH, noisy(law, PATH, level, np.random.default_rng(8)), Iwan, parts=6)
            assert len(found.law.sliders) == len(law.sliders)


@pytest.mark.drawn
def test_a_smooth_loop_by_many_sliders():
    """What a law misses becomes small with their number."""
    force = noisy(WEN, PATH, 0.002, np.random.default_rng(9))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        left = [identify_loop(PATH, force, Iwan, parts=parts).noise for parts in (1, 2, 4)]
    assert left[0] > 1.5 * left[1]
    assert left[1] > 1.3 * left[2]


@pytest.mark.drawn
def test_a_filtered_channel_widens():
    rng = np.random.default_rng(10)
    white = 0.3 * rng.standard_normal(619)
    smooth = np.convolve(white, np.full(20, 20**-0.5), "valid")
    with pytest.warns(UserWarning, match="neighbouring residuals are correlated"):
        wide = identify_loop(PATH, DAMPER.along(PATH) + smooth).estimates["limit"]
    narrow = identify_loop(PATH, DAMPER.along(PATH) + white[:600]).estimates["limit"]
    half = 0.5 * (wide.high - wide.low)  # of 95 %, from 30 independent values: 120 draws miss at most 2.3 of it
    assert abs(wide.high - half - 10.0) < 4.0 * half
    assert wide.high - wide.low > 2.0 * (narrow.high - narrow.low)


@pytest.mark.drawn
def test_noise_in_the_displacement_is_told():
    """Every turn of the noise is one of the slider's in the model: the limit comes out too large."""
    rough = PATH + 1e-5 * np.random.default_rng(11).standard_normal(PATH.size)
    with pytest.warns(UserWarning, match=r"delta turns back \d+ times by less than 1 % of its range"):
        identify_loop(rough, DAMPER.along(PATH))


@pytest.mark.parametrize(
    ("model", "main"),
    [
        (Sliders(2, True), [0.3, -0.4, -1.2, -0.5, 0.2]),
        (Sliders(1, False), [0.3, -1.2]),
        (Smooth(2), [0.2, 0.1, 3.0, -1.0]),
    ],
    ids=str,
)
def test_slopes_are_those_of_the_forces(model, main):
    """Two records; where no sample lies on a kink."""
    measured = Measured([PATH[:200], PATH[250:]], [DAMPER.along(PATH)[:200], DAMPER.along(PATH)[250:]], True)
    fit = Fit(measured, model, np.array([*main, 0.1, *np.linspace(-0.4, 0.3, 2 * model.states)]), most=1)
    theta = fit.theta + 1e-3
    wanted = [(fit.residual(theta + h) - fit.residual(theta - h)) / 2e-6 for h in 1e-6 * np.eye(theta.size)]
    assert np.abs(fit.jacobian(theta) - np.transpose(wanted)).max() < 1e-6


@pytest.mark.parametrize("side", [1, -1])
def test_a_slider_widened_has_the_forces_it_had(side):
    """While it slips towards one side: the zero of force takes what its limit gains; one at its limit moves off it."""
    path = (
        side * 1e-3 * np.concatenate((np.linspace(0.2, 1.9, 60), np.linspace(1.9, 1.0, 30), np.linspace(1.0, 2.2, 40)))
    )
    paths = [path, side * 1e-3 * np.linspace(-0.1, 1.6, 80), path[50:]]
    measured = Measured(paths, [DAMPER.along(one) for one in paths], True)
    width = DAMPER.limit / DAMPER.stiffness / measured.depth
    stiffness = DAMPER.stiffness * measured.depth / measured.strength
    start = np.array([np.log(stiffness), np.log(width), 0.1, 0.4 * side, -0.2 * side, 0.5 * np.pi * side])
    fit = Fit(measured, Sliders(1, False), start)
    fit.theta = start
    wide = fit._widened(0, side)
    assert wide[1] == 0.5
    change = np.abs(fit.residual(wide) - fit.residual(start))
    first = path.size + paths[1].size
    assert change[:first].max() < 1e-12
    assert change[first:].max() < 1.001e-3 * stiffness * np.exp(0.5)
    assert np.abs(np.sin(wide[-1])) < 0.9991  # where its slope is not zero


@pytest.mark.parametrize("chosen", [[40, 80], [48, 88]])
def test_starts_leave_what_they_do_not_explain(chosen):
    """Two sliders, each with a load of its own at the start of each record: |target|² - explained by linear algebra."""
    paths, force = [PATH[40:250], PATH[270:]], JOINT.along(PATH)
    measured = Measured(paths, [force[40:250], force[270:]], True)
    tried = _Tried(measured, True)
    assert len(set(tried.loads[chosen].ravel())) > 2
    theta = tried.starts(chosen)[0]
    left = Fit(measured, Sliders(2, True), theta, most=1).residual(theta)
    explained = tried.explained(chosen)
    assert explained > 0.0
    assert left @ left == pytest.approx(measured.target @ measured.target - explained, rel=1e-9)


def test_it_prints():
    found = identify_loop(PATH, WEN.along(PATH), BoucWen)
    said = str(found)
    assert "BoucWen from 1 record, 95 % intervals" in said
    assert "A, n           1 (chosen: loops tell A and beta, gamma together only), 1" in said
    assert re.search(r"  stiffness +20000.* N/m\n  alpha +0\.1[^/]*\n  beta .* 1/m\n", said)
    assert "stiffness 20000" in repr(found)


FORCE = DAMPER.along(PATH)


test_bad_records_are_refused = refused(
    (lambda: identify_loop(PATH, FORCE, Hertz), "law of identify_loop must be Jenkins, Iwan or BoucWen", TypeError),
    (lambda: identify_loop(PATH, FORCE, DAMPER), "the class, got Jenkins", TypeError),
    (lambda: identify_loop(PATH, FORCE, Jenkins, parts=2), "parts of identify_loop belongs to Iwan, got 2 for Jenkins"),
    (lambda: identify_loop(PATH, FORCE, Iwan, n=2), "n of identify_loop belongs to BoucWen"),
    (lambda: identify_loop(PATH, FORCE, Iwan, parts=0), "must be a whole number from 1 to 20, got 0"),
    (lambda: identify_loop(PATH, FORCE, BoucWen, n=3), "must be 1 or 2, got 3"),
    (lambda: identify_loop(PATH, FORCE, confidence=0.0), r"confidence must lie in \(0, 1\)"),
    (lambda: identify_loop(PATH, FORCE[:-1]), "record 1 has 600 samples of delta and 599 of force"),
    (lambda: identify_loop([PATH], [FORCE, FORCE]), "force must have as many records as delta, 1, got 2"),
    (lambda: identify_loop(np.full(600, np.nan), FORCE), "delta of record 1 must be a finite vector, got nan"),
    (lambda: identify_loop(["a"] * 600, FORCE), "delta of record 1 must be a number, got"),
    (lambda: identify_loop(0.0 * PATH, FORCE), "delta of record 1 does not move"),
    (lambda: identify_loop(PATH, 0.0 * FORCE), "there is no loop"),
    (lambda: identify_loop(PATH[:7], FORCE[:7]), "the records have 7 samples, at least 8 are needed"),
)
