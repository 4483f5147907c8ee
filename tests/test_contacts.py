"""Contact laws: formulas, broadcasting, user laws, and what is refused at the door."""

import math
import pickle

import numpy as np
import pytest
from problems import force_of

from contacts import Hertz, Hysteretic, KelvinVoigt, Law, PiecewiseLinear, law

LAWS = [
    Hertz(2.1e8),
    Hertz(3e5, exponent=1.0),
    Hertz(4e9, exponent=2.25),
    Hysteretic(2.1e8, 0.5625),
    Hysteretic(1e7, 2.0, exponent=1.0),
    Hysteretic(1e7, 2.0, exponent=3.0, clamp=True),
    KelvinVoigt(1e6, 300.0),
    KelvinVoigt(1e6, 300.0, clamp=True),
    PiecewiseLinear([1e5]),
    PiecewiseLinear([1e5, 3e5, 2e4], knots=(1e-3, 2.5e-3)),
]


@law
def hertz_by_hand(delta, delta_dot, entry_rate, stiffness):
    """Hertz's law in one line."""
    return stiffness * delta**1.5


@law(knots=(1e-3,), exponent=2.0, entry_rate_floor=0.5)
def with_defaults(delta, delta_dot, entry_rate, k=2.0, a=0.25):
    """Return k delta² (1 + a delta_dot/entry_rate)."""
    return k * delta**2 * (1.0 + a * delta_dot / entry_rate)


@law(jump=True)
def constant(delta, delta_dot, entry_rate):
    """Ten newtons."""
    return 10.0


@pytest.mark.parametrize("one", LAWS, ids=repr)
def test_force_is_the_formula(one):
    rng = np.random.default_rng(1)
    delta, delta_dot, entry_rate = rng.uniform(0, 4e-3, 200), rng.uniform(-2, 2, 200), rng.uniform(0.01, 2, 200)
    formula = [force_of(one)(*point) for point in zip(delta, delta_dot, entry_rate, strict=True)]
    np.testing.assert_allclose(one.force(delta, delta_dot, entry_rate), formula, rtol=1e-13, atol=1e-12)


@pytest.mark.parametrize("one", [*LAWS, hertz_by_hand(stiffness=1e8), constant()], ids=repr)
def test_force_is_zero_without_indentation(one):
    assert np.array_equal(one.force([0.0, -1e-9, -1.0, -math.inf], [1.0, -1.0, 5.0, 1.0]), np.zeros(4))


@pytest.mark.parametrize("one", LAWS, ids=repr)
def test_force_broadcasts(one):
    delta, delta_dot, entry_rate = np.array([[1e-3], [-1e-3]]), np.array([0.3, -0.1, 0.0]), 0.7
    force = one.force(delta, delta_dot, entry_rate)
    assert force.shape == (2, 3)
    for column, rate in enumerate(delta_dot):
        assert force[0, column] == one.force(1e-3, rate, 0.7)
    assert not force[1].any()
    assert np.ndim(one.force(1e-3, 0.1, 0.5)) == 0
    assert one.force(np.empty((0, 3))).shape == (0, 3)


def test_force_leaves_its_arguments_alone():
    delta = np.array([1e-3, -1e-3, np.nan])
    kept = delta.copy()
    Hysteretic(1e7, 0.5).force(delta, delta, np.ones(3))
    np.testing.assert_array_equal(delta, kept)


@pytest.mark.parametrize("nan_at", [0, 1, 2])
def test_nan_in_gives_nan_out(nan_at):
    arguments = [np.full(3, 1e-3), np.full(3, 0.1), np.full(3, 0.2)]
    arguments[nan_at][1] = np.nan
    assert np.isnan(Hysteretic(1e7, 0.5).force(*arguments)).tolist() == [False, True, False]


def test_entry_rates_below_the_floor_count_as_the_floor():
    one = Hysteretic(1e7, 0.5, entry_rate_floor=0.02)
    at_floor = 1e7 * 1e-3**1.5 * (1 + 0.5 * 0.1 / 0.02)
    assert one.force(1e-3, 0.1, 1e-9) == one.force(1e-3, 0.1, 0.02) == pytest.approx(at_floor, rel=1e-14)
    assert one.force(1e-3, 0.1, 0.04) < 0.7 * at_floor


def test_clamped_laws_never_pull_and_others_do():
    for family, damping in ((Hysteretic, 2.0), (KelvinVoigt, 1e5)):
        assert family(1e7, damping).force(1e-6, -1.0, 1.0) < 0.0
        assert family(1e7, damping, clamp=True).force(1e-6, -1.0, 1.0) == 0.0
        assert family(1e7, damping, clamp=True).force(1e-3, 0.5, 1.0) == family(1e7, damping).force(1e-3, 0.5, 1.0)


def test_only_a_dashpot_makes_the_force_jump():
    assert KelvinVoigt(1e6, 1.0).jump
    assert not KelvinVoigt(1e6, 0.0).jump
    assert not Hysteretic(1e6, 1.0).jump


def test_hertz_of_spheres_against_the_classical_formula():
    # equal spheres: K = E √(2R) / (3 (1 - ν²)); sphere on a rigid flat: K = (4/3) E √R / (1 - ν²)
    same = Hertz.of_spheres(2.1e11, 0.3, 0.01, 2.1e11, 0.3, 0.01)
    assert same.stiffness == pytest.approx(2.1e11 * math.sqrt(0.02) / (3 * 0.91), rel=1e-14)
    flat = Hertz.of_spheres(2.1e11, 0.3, 0.01, 1e30, 0.3, math.inf)
    assert flat.stiffness == pytest.approx(4 / 3 * 2.1e11 * math.sqrt(0.01) / 0.91, rel=1e-14)
    assert Hertz.of_spheres(1e9, 0.2, 0.1, 2e9, 0.4, 0.3) == Hertz.of_spheres(2e9, 0.4, 0.3, 1e9, 0.2, 0.1)


def test_piecewise_linear_is_continuous_at_its_knots():
    one = PiecewiseLinear([1e5, 3e5, 2e4], knots=(1e-3, 2.5e-3))
    for knot, force in ((1e-3, 100.0), (2.5e-3, 550.0)):
        assert one.force(knot) == pytest.approx(force, rel=1e-14)
        assert one.force(np.nextafter(knot, 0.0)) == pytest.approx(force, rel=1e-12)
    assert PiecewiseLinear(1e5) == PiecewiseLinear([1e5]) == PiecewiseLinear(np.array([1e5]))


def test_piecewise_linear_may_soften_to_a_plateau():
    one = PiecewiseLinear([1e5, -5e4, 0.0], knots=[1e-3, 2e-3])
    np.testing.assert_allclose(one.force([1e-3, 2e-3, 1.0]), [100.0, 50.0, 50.0], rtol=1e-13)


# --- a user's own law ---------------------------------------------------------------------------------------------


def test_decorated_law_keeps_name_module_and_docstring():
    assert hertz_by_hand.__name__ == "hertz_by_hand"
    assert hertz_by_hand.__doc__ == "Hertz's law in one line."
    assert hertz_by_hand.__module__ == __name__
    assert with_defaults.__name__ == "with_defaults"
    assert "hertz_by_hand" in repr(hertz_by_hand(stiffness=1.0))


def test_decorated_law_is_a_law_with_its_options():
    one = with_defaults(k=3.0)
    assert isinstance(one, Law)
    assert (one.knots, one.exponent, one.entry_rate_floor, one.jump) == ((1e-3,), 2.0, 0.5, False)
    assert constant().jump
    assert one.force(0.1, 0.2, 0.8) == pytest.approx(3.0 * 0.01 * (1 + 0.25 * 0.2 / 0.8), rel=1e-15)
    assert one.force(0.1, 0.2, 0.1) == one.force(0.1, 0.2, 0.5)
    assert with_defaults().force(0.1) == pytest.approx(0.02, rel=1e-15)
    assert with_defaults(a=1.0, k=2.0) == with_defaults(k=2, a=1)
    assert with_defaults() != with_defaults(a=1.0)


def test_decorated_law_equals_the_built_in():
    delta = np.geomspace(1e-9, 1e-2, 50)
    np.testing.assert_allclose(hertz_by_hand(stiffness=2.1e8).force(delta), Hertz(2.1e8).force(delta), rtol=4e-16)


@pytest.mark.parametrize("one", [*LAWS, hertz_by_hand(stiffness=1e8), with_defaults(a=0.5), constant()], ids=repr)
def test_laws_survive_pickling(one):
    again = pickle.loads(pickle.dumps(one))
    assert again == one
    assert (again.knots, again.entry_rate_floor, again.exponent) == (one.knots, one.entry_rate_floor, one.exponent)
    assert again.force(1e-3, 0.1, 0.6) == one.force(1e-3, 0.1, 0.6)


def test_law_of_wrong_signature_is_refused():
    with pytest.raises(TypeError, match=r"'wrong' must take \(delta, delta_dot, entry_rate.*got \(x, v, r, k\)"):

        @law
        def wrong(x, v, r, k):
            return k * x


def test_missing_and_unknown_parameters_are_named():
    with pytest.raises(TypeError, match=r"'hertz_by_hand'.*missing.*'stiffness'.*parameters are \['stiffness'\]"):
        hertz_by_hand()
    with pytest.raises(TypeError, match=r"'hertz_by_hand'.*unexpected.*'softness'.*parameters are \['stiffness'\]"):
        hertz_by_hand(stiffness=1e8, softness=1.0)
    with pytest.raises(TypeError):
        hertz_by_hand(1e8)


def test_misspelt_parameters_are_named():
    with pytest.raises(TypeError, match=r"'stifness'"):
        hertz_by_hand(stifness=1.0)


def test_parameters_must_be_finite():
    with pytest.raises(ValueError, match=r"parameter stiffness of law 'hertz_by_hand' must be finite, got nan"):
        hertz_by_hand(stiffness=math.nan)


def test_law_that_returns_nan_is_met_on_binding():
    @law(jump=True)
    def shallow(delta, delta_dot, entry_rate, depth):
        return math.sqrt(depth - delta)

    with pytest.raises(ValueError, match=r"law 'shallow' gives a force of nan at delta = 0.001 m"):
        shallow(depth=1e-4)
    assert np.isfinite(shallow(depth=1.0).force(0.5))


def test_law_that_cannot_be_compiled_names_itself():
    @law
    def talks(delta, delta_dot, entry_rate):
        return open("somewhere").read()

    with pytest.raises(
        TypeError, match=r"law 'talks' \(.*test_contacts.py, line \d+: 'return open\(.*\) cannot be compiled"
    ):
        talks()


@pytest.mark.parametrize("knots", [(0.0,), (2e-3, 1e-3), (1e-3, 1e-3), (math.nan,), (-1e-3,), (math.inf,)])
def test_knots_must_ascend(knots):
    with pytest.raises(ValueError, match=r"knots of law 'bent' must be positive, finite and ascending"):

        @law(knots=knots)
        def bent(delta, delta_dot, entry_rate):
            return delta

    with pytest.raises(ValueError, match=r"knots of PiecewiseLinear must be finite, positive and ascending"):
        PiecewiseLinear([1e5] * (len(knots) + 1), knots=knots)


# --- refused values -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("bad", [-1.0, 0.0, math.nan, math.inf, "stiff", None])
@pytest.mark.parametrize("make", [Hertz, lambda k: Hysteretic(k, 0.1), lambda k: KelvinVoigt(k, 0.1)])
def test_stiffness_must_be_positive(make, bad):
    with pytest.raises(ValueError, match=r"stiffness of .* must be finite and > 0, got"):
        make(bad)


@pytest.mark.parametrize("bad", [-1e-9, math.nan, math.inf, "much"])
def test_damping_must_not_be_negative(bad):
    with pytest.raises(ValueError, match=r"damping_factor of Hysteretic must be finite and >= 0"):
        Hysteretic(1e8, bad)
    with pytest.raises(ValueError, match=r"damping of KelvinVoigt must be finite and >= 0"):
        KelvinVoigt(1e8, bad)


@pytest.mark.parametrize("bad", [0.999, 0.0, -1.5, math.nan])
def test_exponent_must_be_at_least_one(bad):
    with pytest.raises(ValueError, match=r"exponent of Hertz must be finite and >= 1"):
        Hertz(1e8, bad)
    with pytest.raises(ValueError, match=r"exponent of Hysteretic must be finite and >= 1"):
        Hysteretic(1e8, 0.5, bad)


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan])
def test_entry_rate_floor_must_be_positive(bad):
    with pytest.raises(ValueError, match=r"entry_rate_floor of Hysteretic must be finite and > 0"):
        Hysteretic(1e8, 0.5, entry_rate_floor=bad)


@pytest.mark.parametrize(
    ("slopes", "knots", "message"),
    [
        ([1e5, 2e5], (), "2 slopes needs 1 knots"),
        ([1e5], (1e-3,), "1 slopes needs 0 knots"),
        ([0.0], (), "the first positive"),
        ([-1e5], (), "the first positive"),
        ([math.nan], (), "must be finite"),
        ([1e5, -1e5], (1e-3,), "soften to a negative force"),
        ([1e5, -1e6, 1e5], (1e-3, 2e-3), "soften to a negative force"),
    ],
)
def test_piecewise_linear_refuses(slopes, knots, message):
    with pytest.raises(ValueError, match=message):
        PiecewiseLinear(slopes, knots=knots)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"E1": -1.0}, "E1 of Hertz.of_spheres must be positive"),
        ({"E2": math.inf}, "E2 of Hertz.of_spheres must be positive"),
        ({"R2": 0.0}, "R2 of Hertz.of_spheres must be positive"),
        ({"R1": math.nan}, "R1 of Hertz.of_spheres must be positive"),
        ({"nu1": 0.6}, "nu1 of Hertz.of_spheres must lie in"),
        ({"nu2": -1.0}, "nu2 of Hertz.of_spheres must lie in"),
        ({"R1": math.inf, "R2": math.inf}, "both infinite"),
    ],
)
def test_hertz_of_spheres_refuses(change, message):
    with pytest.raises(ValueError, match=message):
        Hertz.of_spheres(**({"E1": 1e9, "nu1": 0.3, "R1": 0.1, "E2": 1e9, "nu2": 0.3, "R2": 0.1} | change))
