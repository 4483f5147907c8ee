"""Branches: folds, flips and grazings against closed forms and harmonic balance, ends, closed branches, bad input."""

import itertools
import json
import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from oscillators import Bilinear, Duffing, Tone, over, state_at_zero, status_names
from problems import cubic
from refusals import refused_by

import solvers.branches.count_changes
import solvers.branches.walk
from solvers import Contact, Exponential, OrbitError, System, branch, orbit
from solvers.branches import recorded, restarted
from solvers.branches.subharmonic_end import Scaled

DAMPED = Bilinear(1.1, zeta=0.05)  # doubles its period between 0.83 and 0.93 rad/s
GAPPED = Bilinear(0.8, zeta=0.05, gap=2.0)


@cache
def between_cubic_stops():
    stops = [Contact([sign], cubic(stiffness=1.0)) for sign in (1.0, -1.0)]
    return System.modal([1.0], 0.05, stops, [([1.0], Tone(0.2, 1.0))])


def duffing(omega):
    return between_cubic_stops().like(loads=[([1.0], Tone(0.2, omega))]), 2.0 * math.pi / omega


def marks(found, mark):
    return [orbit for orbit in found.special if orbit.mark == mark]


@pytest.fixture(scope="module")
def damped():
    """The harmonic branch through both period doublings, from one end of the span to the other."""
    return branch(over(DAMPED), (0.8, 1.1), DAMPED.settled(60), at=1.0, step=0.25).run()


@pytest.fixture(scope="module")
def doubled(damped):
    """The subharmonic branch born at the upper flip, its first orbits."""
    following = damped.doubled(marks(damped, "flip")[-1])
    list(itertools.islice(following, 8))
    return following


# --- special points -----------------------------------------------------------------------------------------------


def test_period_doublings_against_closed_pieces(damped):
    flips = marks(damped, "flip")
    assert len(flips) == 2
    for flip in flips:
        exact, x = replace(DAMPED, omega=flip.parameter).special(-1.0, state_at_zero(flip))
        assert flip.parameter == pytest.approx(exact, abs=1e-8)
        np.testing.assert_allclose(state_at_zero(flip), x, rtol=0.0, atol=1e-7)
        assert np.abs(flip.multipliers + 1.0).min() < 1e-6
    assert not [found for found in damped.special if found.mark != "flip"]


def test_stability_changes_at_the_flips_only(damped):
    low, high = sorted(flip.parameter for flip in marks(damped, "flip"))
    for found in damped.orbits:
        if not found.mark:
            assert found.stable != (low < found.parameter < high)


def shifted(family, shift):
    """The same family by its parameter less a number."""
    return lambda parameter: family(parameter + shift)


def test_special_points_beside_a_parameter_of_zero(damped):
    """Where a parameter is counted from is free: also from an orbit whose next one lies behind a flip or a grazing."""
    flips = [flip.parameter - 0.94 for flip in marks(damped, "flip")]
    start = replace(DAMPED, omega=0.94).settled(60)
    found = branch(shifted(over(DAMPED), 0.94), (-0.14, 0.16), start, at=0.0, step=0.25).run()
    assert [flip.parameter for flip in marks(found, "flip")] == pytest.approx(flips, abs=1e-9)
    exact = GAPPED.gap / GAPPED.linear_amplitude()
    problem = replace(GAPPED, amplitude=0.99 * exact)
    family, start = shifted(over(problem, "amplitude"), problem.amplitude), problem.steady(False, 0.0)
    found = branch(family, (-0.2 * exact, 0.1 * exact), start, at=0.0, step=0.25).run()
    assert [one.parameter for one in marks(found, "grazing")] == pytest.approx([0.01 * exact], abs=1e-8)


def test_subharmonic_end_at_a_parameter_of_zero(damped):
    """The branch of two periods ends at the flip, where the parameter is 0, and does not retrace itself."""
    flip = marks(damped, "flip")[0].parameter
    start = replace(DAMPED, omega=flip + 1e-3).settled(40)
    found = branch(Scaled(shifted(over(DAMPED), flip), 2.0), (-2e-3, 1.5e-3), start, at=1e-3, step=0.5).run()
    assert "subharmonic end" in found.endings[-1]
    assert min(abs(one.parameter) for one in marks(found, "flip")) < 1e-10


def test_every_orbit_of_a_branch_closes(damped, doubled):
    for found in damped.orbits + doubled.orbits:
        assert found.residual < 1e-10
        problem = replace(DAMPED, omega=found.parameter)
        x = state_at_zero(found)
        assert np.abs(problem.march(x, found.period)[0] - x).max() < 1e-8 * np.abs(x).max()
        assert np.prod(found.multipliers).real == pytest.approx(math.exp(-0.1 * found.period), rel=1e-8)


def test_doubled_branch_is_born_at_the_flip_with_twice_the_period(damped, doubled):
    flip = marks(damped, "flip")[-1]
    first, *later = doubled.orbits
    assert first.parameter == flip.parameter
    assert first.period == 2.0 * flip.period
    np.testing.assert_allclose(first.state, flip.state, rtol=0.0, atol=1e-12)
    assert np.abs(first.multipliers - 1.0).min() < 1e-6
    differences = []
    for found in later:
        x = state_at_zero(found)
        problem = replace(DAMPED, omega=found.parameter)
        differences.append(np.abs(problem.march(x, problem.period)[0] - x).max())
        assert found.period == pytest.approx(2.0 * problem.period, rel=1e-14)
    assert differences[0] < 0.1 * differences[-1]
    assert np.all(np.diff(differences) >= 0.0)
    assert differences[-1] > 1e-2
    assert doubled.orbits[-1].stable


def test_no_special_point_is_reported_at_the_subharmonic_end(doubled):
    assert [found.mark for found in doubled.orbits[1:5]] == [""] * 4


def test_doubling_elsewhere_than_at_a_flip(damped):
    with pytest.raises(ValueError, match="marked 'flip'"):
        damped.doubled(damped.orbits[0])


def test_duffing_folds_against_harmonic_balance():
    balance, lags = Duffing(), np.linspace(3.0, 0.5, 40)
    points = balance.walk(lags)
    start = next(p for p in points if p[2] > 0.0 and p[1] < 1.4)  # on the branch of small motions
    found = branch(duffing, (1.2, 1.6), balance.state(*start[:2]), at=start[1], step=0.4).run()
    folds = sorted(fold.parameter for fold in marks(found, "fold"))
    np.testing.assert_allclose(folds, sorted(balance.folds(lags)), rtol=0.0, atol=1e-8)
    for fold in marks(found, "fold"):
        assert np.abs(fold.multipliers - 1.0).min() < 1e-5
    unstable = [o for o in found.orbits if not o.stable and not o.mark]
    assert all(folds[0] < o.parameter < folds[1] for o in unstable)
    # Brennan, Kovacic, Carrella, Waters, J. Sound Vib. 318 (2008): one harmonic, jump down and (undamped) jump up
    alpha, zeta = 1.0 * 0.2**2, 0.05
    down = math.sqrt(0.5 * (1.0 + math.sqrt(1.0 + 0.75 * alpha / zeta**2)))
    up = math.sqrt(1.0 + 1.5 ** (4.0 / 3.0) * alpha ** (1.0 / 3.0))
    np.testing.assert_allclose(folds, [up, down], rtol=1e-2)


@pytest.mark.parametrize("name", ["amplitude", "gap"])
def test_grazing_against_the_linear_amplitude(name):
    """The mass just reaches the stop where the linear oscillator's amplitude is the gap."""
    ratio = GAPPED.linear_amplitude() / GAPPED.gap  # at the amplitude 1
    exact = 1.0 / ratio if name == "amplitude" else GAPPED.linear_amplitude()
    free = 0.8 if name == "amplitude" else 1.2
    problem = replace(GAPPED, **{name: free * exact})
    span = 0.7 * exact, 1.3 * exact
    found = branch(over(problem, name), span, problem.steady(False, 0.0), at=free * exact, step=0.25).run()
    grazings = marks(found, "grazing")
    assert [g.parameter for g in grazings] == pytest.approx([exact], rel=1e-8)
    assert len(grazings[0].contacts) <= 1
    ends = sorted((o.parameter, len(o.contacts)) for o in (found.orbits[0], found.orbits[-1]))
    assert [p for p, _ in ends] == pytest.approx(list(span), rel=1e-12)
    assert [count for _, count in ends] == ([0, 1] if name == "amplitude" else [1, 0])
    assert status_names(found) == ["END", "END"]


def test_grazing_frequencies_on_both_flanks():
    """Ω⁴ - (2 - 4ζ²) Ω² + 1 - (f/gap)² = 0."""
    problem = Bilinear(0.5, zeta=0.2, gap=2.2)
    half, product = 1.0 - 2.0 * 0.2**2, 1.0 - 1.0 / 2.2**2
    exact = np.sqrt(half + np.array([-1.0, 1.0]) * math.sqrt(half**2 - product))
    found = branch(over(problem), (0.5, 1.4), problem.steady(False, 0.0), step=0.2).run()
    np.testing.assert_allclose([g.parameter for g in marks(found, "grazing")], exact, rtol=1e-8)
    assert [found.orbits[i].parameter for i in (0, -1)] == pytest.approx([0.5, 1.4], rel=1e-12)
    assert status_names(found) == ["END"]


# --- closed branches, ends ----------------------------------------------------------------------------------------


def test_isolated_subharmonic_branch_closes_with_two_folds():
    problem = Bilinear(4.2, zeta=0.15)
    x, *_ = problem.orbit(np.array([-0.1142407, 0.14874975]), periods=3)
    found = branch(over(problem, periods=3), (3.5, 5.0), x, at=4.2, step=0.2)
    found.run()
    assert set(status_names(found)) == {"CLOSED"}
    assert str(found.status[0].value).startswith("closed")
    folds = marks(found, "fold")
    assert len(folds) in (2, 4)  # 4: the closed branch is walked in both directions
    for fold in folds:
        exact, _ = replace(problem, omega=fold.parameter).special(1.0, state_at_zero(fold), periods=3)
        assert fold.parameter == pytest.approx(exact, abs=1e-8)
        assert np.abs(fold.multipliers - 1.0).min() < 1e-4
    low, high = (extreme(fold.parameter for fold in folds) for extreme in (min, max))
    assert all(low - 1e-9 <= o.parameter <= high + 1e-9 for o in found.orbits)


def test_both_directions_meet_at_the_start(damped):
    parameters = [found.parameter for found in damped.orbits]
    assert np.all(np.diff(parameters) > 0.0) or np.all(np.diff(parameters) < 0.0)
    assert parameters.count(1.0) == 1
    assert {parameters[0], parameters[-1]} == {0.8, 1.1}
    assert status_names(damped) == ["END", "END"]


def test_a_start_at_the_end_of_the_span_has_one_direction():
    found = branch(over(DAMPED), (1.0, 1.1), DAMPED.settled(60), at=1.1, step=0.5).run()
    assert status_names(found) == ["END"]
    assert found.orbits[-1].parameter == 1.0


def test_an_interrupted_iteration_resumes():
    def fresh():
        return branch(over(DAMPED), (1.0, 1.2), start, at=1.1, step=0.5)

    start = DAMPED.orbit(DAMPED.settled(60))[0]
    whole = [found.parameter for found in fresh().run().orbits]
    interrupted = fresh()
    assert len(interrupted.orbits) == 1
    known = list(itertools.islice(interrupted, 3))
    assert [found.parameter for found in interrupted.orbits] == [found.parameter for found in known]
    assert status_names(interrupted)[0] == "RUNNING"
    assert next(iter(interrupted)) is known[0]
    assert sorted(found.parameter for found in interrupted) == sorted(whole)
    assert [found.parameter for found in interrupted.orbits] == whole
    assert len(list(interrupted)) == len(whole)


@pytest.mark.parametrize(("count", "shots"), [(1, 1), (3, 1), (5, 3)])
def test_a_branch_restarted_equals_the_one_that_was_not(count, shots):
    """From its records as text, wherever it was left: the same orbits, marks and multipliers, bit by bit."""
    start = DAMPED.orbit(DAMPED.settled(60))[0]
    options = {"at": 1.1, "step": 0.2, "shots": shots, "method": Exponential(1e-10)}
    whole = branch(over(DAMPED), (1.0, 1.2), start, **options).run()
    left = branch(over(DAMPED), (1.0, 1.2), start, **options)
    list(itertools.islice(left, count))
    again = restarted(over(DAMPED), json.loads(json.dumps(recorded(left)))).run()
    assert again.status == whole.status
    assert [one.mark for one in again.orbits] == [one.mark for one in whole.orbits]
    for one, other in zip(again.orbits, whole.orbits, strict=True):
        assert one.parameter == other.parameter
        np.testing.assert_array_equal(one.whole, other.whole)
        np.testing.assert_array_equal(one.multipliers, other.multipliers)
        assert (one.method, len(one.shots[0])) == (Exponential(1e-10), shots)


def test_a_branch_goes_on_from_a_branch(damped):
    """An orbit of a branch knows its parameter."""
    first = damped.orbits[-1] if damped.orbits[-1].parameter == 1.1 else damped.orbits[0]
    more = branch(over(DAMPED), (1.1, 1.2), first, step=0.5).run()
    assert more.orbits[0].parameter == 1.1
    np.testing.assert_allclose(state_at_zero(more.orbits[0]), state_at_zero(first), rtol=0.0, atol=1e-9)


def test_a_problem_that_ends_within_the_span_is_lost():
    def make(gap):
        if gap < 1.5:
            raise ValueError("no such gap")
        return over(GAPPED, "gap")(gap)

    problem = replace(GAPPED, gap=3.0)
    found = branch(make, (1.0, 4.0), problem.steady(False, 0.0), at=3.0, step=0.3).run()
    assert sorted(status_names(found)) == ["END", "LOST"]
    assert min(o.parameter for o in found.orbits) == pytest.approx(1.5, abs=1e-3)
    assert all(isinstance(status.value, str) and len(status.value) > 10 for status in found.status)


def test_a_resonance_without_damping_never_ends_the_program(monkeypatch):
    monkeypatch.setattr(solvers.branches.walk, "MOST_ORBITS", 25)
    problem = Bilinear(0.6, zeta=0.0, gap=1e9)
    found = branch(over(problem), (0.6, 1.5), problem.steady(False, 0.0), step=0.2).run()
    assert status_names(found)[0] in ("LIMIT", "LOST")
    assert len(found.orbits) <= 27
    assert all(o.parameter < 1.0 for o in found.orbits)


def test_orbits_at_rest_begin_a_branch_over_the_amplitude():
    found = branch(over(GAPPED, "amplitude"), (0.0, 0.3), [0.0, 0.0], at=0.0, step=0.5).run()
    assert status_names(found) == ["END"]
    assert not found.special
    last = replace(GAPPED, amplitude=0.3).steady(False, 0.0)
    np.testing.assert_allclose(found.orbits[-1].state, last, rtol=0.0, atol=1e-10)


# --- bad input ----------------------------------------------------------------------------------------------------


test_bad_input = refused_by(
    lambda arguments: branch(
        **{"make_system": over(DAMPED), "span": (1.0, 1.2), "start": [0.0, 0.0], "at": 1.1, **arguments}
    ),
    ({"span": (1.0, 1.0)}, "span must be two finite values, ascending"),
    ({"span": (1.0, math.inf)}, "span must be two finite values"),
    ({"at": 2.0}, "must lie in the span"),
    ({"at": math.nan}, "must lie in the span"),
    ({"step": 0.0}, "step must lie in"),
    ({"step": math.nan}, "step must lie in"),
    ({"shots": 0}, "shots must be a whole number"),
    ({"start": [1.0, 2.0, 3.0]}, "start must be 2 finite numbers"),
    ({"make_system": over(DAMPED, periods=0)}, "period must be positive"),
    ({"make_system": over(DAMPED, periods=1.5)}, "does not have the period"),
)


def test_no_orbit_near_the_start():
    problem = Bilinear(0.7, stiffness=1e3, zeta=0.01)
    with pytest.raises(OrbitError, match=r"iterations of Newton's method reduced"):
        branch(over(problem, periods=10), (0.6, 0.8), [-0.3, 5.0], at=0.7)


def test_an_orbit_without_parameter_needs_one():
    found = orbit(*over(DAMPED)(1.1))
    with pytest.raises(ValueError, match="at"):
        branch(over(DAMPED), (1.0, 1.2), found)
    assert branch(over(DAMPED), (1.0, 1.2), found, at=1.1).orbits[0].parameter == 1.1


def test_a_change_of_sign_that_rounding_takes_away_is_no_point():
    class Arc:
        def near(self, place, way):
            return place, None

        def sharpness(self):
            return 1e-9

    zero = solvers.branches.count_changes.zero
    assert zero(Arc(), 0.0, 1.0, lambda s: s - 0.25) == (pytest.approx(0.25), None)
    assert zero(Arc(), 0.0, 1.0, lambda s: s + 1e-300) is None
