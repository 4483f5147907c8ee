"""Contact laws: formulas, broadcasting, user laws, and what is refused at the door."""

import ctypes
import math
import pickle

import numpy as np
import pytest
from numba import njit
from problems import force_of
from refusals import refused

from contacts import (
    PUBLISHED,
    Hertz,
    Hysteretic,
    KelvinVoigt,
    Law,
    PiecewiseLinear,
    Polynomial,
    Sum,
    Tabulated,
    Viscoelastic,
    bounce,
    law,
    parallel,
    restitution,
)

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
    PiecewiseLinear([1e5, 3e5], knots=(1e-3,), damping=[10.0, 300.0]),
    Viscoelastic(1e7, 3000.0),
    Viscoelastic(1e7, 3000.0, exponent=2.5, clamp=True),
    Viscoelastic(1e7, 3000.0, approach_only=True),
    Tabulated([1e-3, 2e-3, 3.5e-3], [10.0, 10.0, 80.0]),
    Polynomial([1e5]),
    Polynomial([1e5, -3e7, 2e10]),
    Hysteretic(1e7, 2.0, entry_rate_floor=0.5) + KelvinVoigt(1e5, 30.0) + Hysteretic(1e8, 0.3, 2.0),
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


@law
def untold(delta, delta_dot, entry_rate, k=2.0):
    return k * delta


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


def test_a_force_at_many_entry_rates_prepares_its_kernel_once(monkeypatch):
    """Mean forces ask for one rate per contact: 20 000 of them took 0.8 s, now 0.13 s."""
    one, asked, rates = Hertz(1e8), [], np.linspace(0.1, 1.0, 50)
    kernel = one.kernel
    monkeypatch.setattr(Hertz, "kernel", property(lambda law: asked.append(law) or kernel))
    np.testing.assert_allclose(one.force(1e-4, 0.0, rates[::-1]), 1e2, rtol=1e-13)
    assert len(asked) == 1


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


@pytest.mark.parametrize("one", LAWS, ids=repr)
def test_compiled_derivatives_are_those_of_the_force(one):
    rng = np.random.default_rng(2)
    d, v, r = rng.uniform(1e-4, 4e-3, 300), rng.uniform(-2, 2, 300), 0.7
    found = slopes(one, d, v, r)
    h = 1e-6
    expected = [
        (one.force(d * (1 + h), v, r) - one.force(d * (1 - h), v, r)) / (2 * h * d),
        (one.force(d, v + h, r) - one.force(d, v - h, r)) / (2 * h),
        (one.force(d, v, r * (1 + h)) - one.force(d, v, r * (1 - h))) / (2 * h * r),
    ]
    smooth = np.ones(d.size, dtype=bool)  # differences across a kink mean nothing
    for shift in (1 + 2 * h, 1 - 2 * h):
        smooth &= np.searchsorted(one.knots, d * shift) == np.searchsorted(one.knots, d)
        smooth &= (one.force(d * shift, v, r) == 0.0) == (one.force(d, v, r) == 0.0)
    assert smooth.sum() > 290
    for given, wanted in zip(found, expected, strict=True):
        np.testing.assert_allclose(given[smooth], wanted[smooth], rtol=1e-6, atol=1e-7 * np.abs(wanted).max() + 1e-12)


def slopes(one, delta, delta_dot, entry_rate):
    """Compiled derivatives of a law on arrays."""
    pointer = ctypes.POINTER(ctypes.c_double)
    out = np.empty((3, delta.size))
    d, v, p = (np.ascontiguousarray(x) for x in (delta, delta_dot, one.parameters))
    d, v, p, *rows = (x.ctypes.data_as(pointer) for x in (d, v, p, *out))
    one.gradient.ctypes(delta.size, d, v, max(entry_rate, one.entry_rate_floor), p, *rows)
    return out


def test_laws_add():
    a, b, c = Hertz(1e8), KelvinVoigt(1e5, 30.0), PiecewiseLinear([1e5, 2e5], [1e-3])
    both = a + b + c
    assert both == Sum((a, b, c)) == a + (b + c) == parallel([a, b, c])
    assert both.knots == (1e-3,)
    assert both.jump
    assert not (a + c).jump
    points = np.array([1e-5, 5e-4, 3e-3]), np.array([0.3, -0.2, 0.0])
    np.testing.assert_allclose(both.force(*points), sum(x.force(*points) for x in (a, b, c)), rtol=1e-15)
    with pytest.raises(TypeError, match="unsupported operand"):
        a + 1.0
    for wrong in ((), (a, 1.0)):
        with pytest.raises(ValueError, match="parts of Sum must be contact laws, at least one, got"):
            Sum(wrong)
    assert (Hertz(1.0) + Hertz(1.0, 2.5)).exponent == 1.5
    assert (Hertz(1.0) + Hertz(1.0, 1.0)).exponent == 1.0
    assert (Hertz(1.0) + Hertz(1.0, 1.0)).powers == (1.0, 1.5)
    assert (Hertz(1.0) + KelvinVoigt(1.0, 1.0)).powers == (0.0, 1.0, 1.5)
    assert Viscoelastic.tsuji(1.0, 0.5, 1.0).powers == (0.25, 1.5)


def test_a_user_law_adds_to_a_built_in():
    both = hertz_by_hand(stiffness=1e8) + Hertz(1e8)
    assert both.force(1e-3) == pytest.approx(2 * Hertz(1e8).force(1e-3), rel=1e-15)
    assert pickle.loads(pickle.dumps(both)) == both


@pytest.mark.parametrize("name", PUBLISHED)
def test_published_factors_agree_near_one(name):
    # all but two tend to 3(1 - e)/2, what the exact relation needs
    near = getattr(Hysteretic, name)(1e8, 0.999).damping_factor / 1.5e-3
    expected = {"lee_wang": 0.5, "gonthier": 4 / 3, "flores": 16 / 15}.get(name, 1.0)
    assert near == pytest.approx(expected, rel=4e-3)
    assert getattr(Hysteretic, name)(1e8, 1.0).damping_factor == 0.0


@pytest.mark.parametrize(
    ("name", "factor"),
    [("hunt_crossley", 1.05), ("herbert_mcwhannell", 4.2 / 3.16), ("lee_wang", 0.525), ("gonthier", 0.91 / 0.3),
     ("zhiying_qishao", 0.6825 * math.exp(1.4)), ("flores", 1.12 / 0.3), ("hu_guo", 3.5),
     ("carvalho_martins", 1.05 * 10.7 / 3.7)],
)  # fmt: skip
def test_published_factors(name, factor):
    one = getattr(Hysteretic, name)(1e8, 0.3, exponent=2.0)
    assert one.damping_factor == pytest.approx(factor, rel=1e-14)
    assert one.nominal == (name, 0.3)
    assert one == Hysteretic(1e8, one.damping_factor, 2.0)


def test_a_polynomial_is_its_formula():
    coefficients, delta = [1e5, -3e7, 0.0, 2e12], np.linspace(1e-6, 4e-3, 50)
    formula = np.polynomial.Polynomial([0.0, *coefficients])(delta)
    np.testing.assert_allclose(Polynomial(coefficients).force(delta, 1.0), formula, rtol=1e-14)


@pytest.mark.parametrize("coefficients", [(1e5, 2e8, 3e11), (0.0, 4e8), (1e5, -3e7, 2e10)])
def test_a_polynomial_stores_what_a_mass_brings(coefficients):
    one, mass, speed = Polynomial(coefficients), 0.05, 0.7
    thrown = bounce(one, speed, mass)
    deepest = thrown.delta.max()
    stored = sum(c * deepest ** (j + 1) / (j + 1) for j, c in enumerate(coefficients, start=1))
    assert stored == pytest.approx(0.5 * mass * speed**2, rel=1e-6)  # sampled near, not at, the deepest point
    assert thrown.restitution == pytest.approx(1.0, rel=1e-9)
    assert restitution(one, speed, mass) == pytest.approx(1.0, rel=1e-9)


def test_a_polynomial_tells_its_terms_and_where_it_pulls():
    assert Polynomial([0.0, 4e8, 0.0, 1.0]).powers == (2.0, 4.0)
    assert Polynomial([0.0, 4e8]).exponent == 2.0
    assert "never pulls" in Polynomial([1e5, -3e7, 2e10]).describe()
    assert "force zero at δ = 0.001, 0.002 m" in Polynomial([2.0, -3e3, 1e6]).describe(1e-4, 1e-3)


def test_table_is_monotone_and_goes_on_straight():
    one = Tabulated([0.0, 1e-3, 2e-3, 3e-3], [0.0, 10.0, 10.0, 90.0])
    force = one.force(np.linspace(1e-9, 5e-3, 2001))
    assert np.all(np.diff(force) >= 0.0)
    assert one.force(2e-3) == pytest.approx(10.0, rel=1e-14)
    assert one.force(5e-3) - one.force(4e-3) == pytest.approx(one.force(4e-3) - one.force(3e-3), rel=1e-12)
    assert one == Tabulated((1e-3, 2e-3, 3e-3), (10.0, 10.0, 90.0))


def test_table_from_a_file(tmp_path):
    path = tmp_path / "curve.csv"
    path.write_text("# rubber\nforce;delta\n10;1e-3\n\n40;2e-3\n")
    assert Tabulated.from_csv(path) == Tabulated([1e-3, 2e-3], [10.0, 40.0])
    path.write_text("force,depth\n1,2\n")
    with pytest.raises(ValueError, match=r"curve.csv: no column 'delta'; its first line names force, depth"):
        Tabulated.from_csv(path)
    path.write_text("delta,force\n1e-3,ten\n")
    with pytest.raises(ValueError, match=r"line 2: column 2 must be a number, got 'ten'"):
        Tabulated.from_csv(path)


@pytest.mark.parametrize(("text", "message"), [
    ("delta;force\n0,0;0,0\n1,5;7,5\n2,5;9,5\n", "line 2: column 1 must be a number, got '0,0'"),
    ("delta,force\n0,0,0,0\n1,5,7,5\n", "line 2: 4 entries, but the first line names 2 columns; write decimal points"),
    ("delta\tforce\n1\t7,5\n", "line 2: column 2 must be a number, got '7,5'"),
])  # fmt: skip
def test_decimal_commas_are_no_columns(tmp_path, text, message):
    """Each was read as a table of other points: 1,5 and 7,5 as δ = 1 and F = 5."""
    path = tmp_path / "curve.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=message):
        Tabulated.from_csv(path)


def test_a_table_that_is_no_text(tmp_path):
    path = tmp_path / "curve.xls"
    path.write_bytes(b"\xd0\xcf\x11\xe0")
    with pytest.raises(ValueError, match=r"curve.xls is no text file in UTF-8"):
        Tabulated.from_csv(path)


@pytest.mark.parametrize(
    ("one", "words"),
    [
        (Hysteretic.lankarani_nikravesh(2.1e8, 0.5),
         "stiffness = 2.1e+08 N/m^p|nominal 0.5|0.725241 (exactly)|J. Mech. Des. 112|pulls where|singular"),
        (KelvinVoigt(1e6, 300.0, clamp=True), "damping = 300 N s/m|0.649895|moves with the rate|jumps"),
        (Viscoelastic.jankowski(2.1e8, 0.5, 1.0), "approach|0.494588|never pulls|kink where δ̇ = 0"),
        (PiecewiseLinear([1e5, 2e6], [1e-3], [0.0, 100.0]), "(by integration)|kinks at δ = 0.001 m"),
        (Hertz(1e8) + KelvinVoigt(1e5, 50.0), "Hertz: F = |KelvinVoigt: F = |pulls, for example|jumps"),
        (with_defaults(), "Return k delta²|k = 2, a = 0.25|pulls nowhere|begins like δ^2"),
        (untold(k=3.0), "F = untold(delta, delta_dot, entry_rate, k)|k = 3|1.000000"),
    ],
    ids=lambda x: type(x).__name__,
)  # fmt: skip
def test_describe(one, words):
    text = one.describe()
    for word in words.split("|"):
        assert word in text


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


test_missing_and_unknown_parameters_are_named = refused(
    (lambda: hertz_by_hand(), r"'hertz_by_hand'.*missing.*'stiffness'.*parameters are \['stiffness'\]"),
    (lambda: hertz_by_hand(stiffness=1e8, softness=1.0), r"'hertz_by_hand'.*unexpected.*'softness'.*parameters are"),
    (lambda: hertz_by_hand(stifness=1.0), "'stifness'"),
    (lambda: hertz_by_hand(1e8), "positional"),
    (lambda: hertz_by_hand(stiffness=math.nan), "stiffness .* 'hertz_by_hand' must be finite, got nan", ValueError),
    error=TypeError,
)


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

    with pytest.raises(TypeError, match=r"'talks' \(.*contacts.py, line \d+: 'return open\(.*\) cannot be compiled"):
        talks()


def test_a_derivative_that_returns_too_few_numbers_is_told_how_many():
    def slope_alone(delta, delta_dot, entry_rate):
        return 1e5

    with pytest.raises(TypeError, match=r"derivative 'slope_alone' .* and return three numbers from every branch"):
        law(lambda delta, delta_dot, entry_rate: 1e5 * delta, derivative=slope_alone)()


def test_law_that_imports_names_the_line():
    @law
    def imports(delta, delta_dot, entry_rate):
        import scipy.special

        return scipy.special.erf(delta)

    with pytest.raises(TypeError, match=r"law 'imports' \(.*, line \d+: 'import scipy.special'\) cannot be compiled"):
        imports()


@pytest.mark.parametrize("knots", [(0.0,), (2e-3, 1e-3), (1e-3, 1e-3), (math.nan,), (-1e-3,), (math.inf,)])
def test_knots_must_ascend(knots):
    with pytest.raises(ValueError, match=r"knots of law 'bent' must be positive, finite and ascending"):

        @law(knots=knots)
        def bent(delta, delta_dot, entry_rate):
            return delta

    with pytest.raises(ValueError, match=r"knots of PiecewiseLinear must be finite, .*got"):
        PiecewiseLinear([1e5] * (len(knots) + 1), knots=knots)


def cubic_slopes(delta, delta_dot, entry_rate, stiffness, damping=0.0):
    return 3.0 * stiffness * delta**2 + damping * delta_dot, damping * delta, 0.0


@law(derivative=cubic_slopes)
def cubic(delta, delta_dot, entry_rate, stiffness, damping=0.0):
    """A law with its own derivative."""
    return stiffness * delta**3 + damping * delta * delta_dot


@law(derivative=cubic_slopes)
def wrong_slope(delta, delta_dot, entry_rate, stiffness, damping=0.0):
    return stiffness * delta**2 + damping * delta * delta_dot


def kinked(delta, delta_dot, entry_rate, stiffness):
    return stiffness * max(delta, 5.0 * delta - 4e-4)


def kinked_slopes(delta, delta_dot, entry_rate, stiffness):
    return stiffness * (5.0 if delta > 1e-4 else 1.0), 0.0, 0.0


LAW_OF_A_FUNCTION = law(kinked, knots=(1e-4,), derivative=kinked_slopes)


def test_a_law_made_without_a_decorator():
    """Its function keeps its own name; and a knot lies where derivatives are usually compared."""
    one = LAW_OF_A_FUNCTION(stiffness=1e5) + Hertz(1e6)
    again = pickle.loads(pickle.dumps(one))
    assert (again, again.knots) == (one, (1e-4,))
    assert again.force(3e-4) == one.force(3e-4)


SCALE = 1e5


@law
def scaled(delta, delta_dot, entry_rate):
    return SCALE * delta


def test_a_law_is_of_what_it_read_when_it_was_bound(monkeypatch):
    """Its derivatives too, which are compiled when they are first asked for."""
    before = scaled()
    monkeypatch.setitem(globals(), "SCALE", 3e5)
    after = scaled()
    for one, stiffness in ((before, 1e5), (after, 3e5)):
        assert one.force(1e-3) == pytest.approx(1e-3 * stiffness, rel=1e-15)
        assert slopes(one, np.array([1e-3]), np.array([0.0]), 1.0)[0, 0] == pytest.approx(stiffness, rel=1e-9)
    assert before != after == scaled() == pickle.loads(pickle.dumps(after))
    with pytest.raises(pickle.PicklingError, match=r"law 'scaled' cannot be pickled: .*scaled is not there, or no"):
        pickle.dumps(before)


def test_an_array_of_a_law_may_change_after_it_was_bound():
    table = np.array([1e5, 2e5])

    @law
    def read(delta, delta_dot, entry_rate):
        return table[0] * delta

    before = read()
    table[0] = 3e5
    found = [slopes(one, np.array([1e-3]), np.array([0.0]), 1.0)[0, 0] for one in (before, read())]
    assert found == pytest.approx([1e5, 3e5], rel=1e-9)


def test_beyond_the_end_of_an_array_there_is_no_force():
    points = np.linspace(0.0, 100.0, 11)

    @njit
    def at(x):
        return points[int(x)]

    @law
    def table(delta, delta_dot, entry_rate):
        return points[int(1e4 * delta)]

    @law
    def within(delta, delta_dot, entry_rate):
        return at(1e4 * delta)

    for one in (table(), within()):
        np.testing.assert_array_equal(one.force([5.5e-4, 1.05e-3, 1.15e-3, 2e-3]), [50.0, 100.0, np.nan, np.nan])


def test_a_law_within_a_function_is_refused_by_pickle_at_once():
    @law
    def local(delta, delta_dot, entry_rate):
        return delta

    with pytest.raises(pickle.PicklingError, match=r"law 'local' cannot be pickled: .*define it at the top of a mod"):
        pickle.dumps(local() + Hertz(1e6))


def test_a_force_that_jumps_with_the_sign_of_the_rate_is_told():
    @law
    def rubbing(delta, delta_dot, entry_rate, mu):
        return 1e5 * delta * (1.0 + mu * np.sign(delta_dot))

    with pytest.warns(UserWarning, match="'rubbing' jumps by 60 N with the sign of the rate.*memory"):
        rubbing(mu=0.3)
    rubbing(mu=0.0)


def test_a_given_derivative_is_used_and_checked():
    one = cubic(stiffness=1e9, damping=20.0)
    assert one.exponent == 3.0
    found = slopes(one, np.array([2e-3]), np.array([0.5]), 1.0)
    np.testing.assert_allclose(found[:, 0], [12010.0, 0.04, 0.0], rtol=1e-15)
    assert pickle.loads(pickle.dumps(one)) == one
    with pytest.raises(ValueError, match=r"derivative of law 'wrong_slope' by delta is .* but differences .* give"):
        wrong_slope(stiffness=1e9)
    with pytest.raises(TypeError, match=r"derivative of law 'other' must take the law's arguments"):

        @law(derivative=cubic_slopes)
        def other(delta, delta_dot, entry_rate):
            return delta


@pytest.mark.parametrize("power", [1.0, 1.25, 1.5, 1.507, 2.0, 3.0])
def test_the_leading_exponent_is_found(power):
    @law
    def found(delta, delta_dot, entry_rate, p, more=0.0):
        return 1e6 * delta**p + more * delta ** (p + 0.5)

    assert found(p=power).exponent == pytest.approx(power, abs=1e-4)
    if power % 0.25 == 0.0:
        assert found(p=power, more=1e9).exponent == power


def test_an_undeclared_jump_is_refused():
    def dashpot(delta, delta_dot, entry_rate, c):
        return 1e5 * delta + c * delta_dot

    with pytest.raises(
        ValueError, match=r"'dashpot' jumps to 20 N at delta = 0\+ with delta_dot = 1 m.*jump=True.*Element"
    ):
        law(dashpot)(c=20.0)
    assert law(dashpot)(c=0.0).force(1e-3) == pytest.approx(100.0, rel=1e-15)
    assert law(jump=True)(dashpot)(c=20.0).jump


def test_a_law_that_pulls_at_rest_is_refused():
    @law
    def sticky(delta, delta_dot, entry_rate, k):
        return k * delta - 1e9 * delta**2

    with pytest.raises(ValueError, match=r"'sticky' gives a force of -990.* at delta = 0.001 m.*must not pull at rest"):
        sticky(k=1e4)


test_odd_signatures_and_values_are_refused = refused(
    (lambda: law(3.0), "decorates a plain function"),
    (lambda: law(derivative=3.0)(lambda delta, delta_dot, entry_rate: delta), "derivative of law .* got 3.0"),
    (lambda: law(lambda delta, delta_dot, entry_rate, *more: delta), r"plain arguments only, got '\*more'"),
    (lambda: law(lambda delta, delta_dot, entry_rate=1.0: delta), "have no default"),
    error=TypeError,
)


def test_the_line_that_cannot_be_compiled_is_named():
    @law
    def forgets(delta, delta_dot, entry_rate):
        depth = 2.0 * delta
        return depth + missing  # noqa: F821

    with pytest.raises(TypeError, match=r"line \d+: 'return depth \+ missing"):
        forgets()


# --- refused values -----------------------------------------------------------------------------------------------


def linear(delta, delta_dot, entry_rate, stiffness):
    return stiffness * delta


NONE = math.nan, math.inf
SHARE = r"restitution of \w+ must lie in \(0, 1\], got .*; \w+"
SPHERES = {"E1": 1e9, "nu1": 0.3, "R1": 0.1, "E2": 1e9, "nu2": 0.3, "R2": 0.1}
OF_A_MASS = KelvinVoigt.anagnostopoulos, Viscoelastic.tsuji, Viscoelastic.jankowski
REFUSED = [  # what is made of a value, the values that are refused, and in which words
    (Hertz, (-1.0, 0.0, *NONE), "stiffness of Hertz must be finite and > 0, got"),
    (lambda x: Hysteretic(x, 0.1), (-1.0, 0.0, *NONE), "stiffness of Hysteretic must be finite and > 0, got"),
    (lambda x: KelvinVoigt(x, 0.1), (-1.0, 0.0, *NONE), "stiffness of KelvinVoigt must be finite and > 0, got"),
    (lambda x: Hysteretic(1e8, 0.1, clamp=x), (math.nan, 2, "yes", None), "clamp of .* must be True or False, got"),
    (lambda x: KelvinVoigt(1e5, 1.0, clamp=x), (math.nan, 2, "yes", None), "clamp of .* must be True or False, got"),
    (lambda x: Hysteretic(1e8, x), (-1e-9, *NONE), "damping_factor of Hysteretic must be finite and >= 0"),
    (lambda x: KelvinVoigt(1e8, x), (-1e-9, *NONE), "damping of KelvinVoigt must be finite and >= 0"),
    (lambda x: Hertz(1e8, x), (0.999, 0.0, -1.5, math.nan), "exponent of Hertz must be finite and >= 1"),
    (lambda x: Hysteretic(1e8, 0.5, x), (0.999, 0.0, -1.5, math.nan), "exponent of Hysteretic must be finite and >= 1"),
    (lambda x: Hysteretic(1e8, 0.5, entry_rate_floor=x), (0.0, -1.0, math.nan),
     "entry_rate_floor of Hysteretic must be finite and > 0"),
    (lambda x: law(entry_rate_floor=x)(linear), (math.nan, -1.0),
     "entry_rate_floor of law 'linear' must be finite and >= 0, got"),
    (lambda x: law(exponent=x)(linear), (0,), "exponent of law 'linear' must be finite and > 0, got 0"),
    (Polynomial, ([], [0.0], [-1.0, 2.0], [1.0, math.nan], "steep", [[1.0], [2.0]]), "coefficients of Polynomial"),
    (PiecewiseLinear, ([0.0], [-1e5]), "the first positive"),
    (PiecewiseLinear, ([math.nan],), "must be finite"),
    (PiecewiseLinear, (["soft"],), "slopes of PiecewiseLinear must be a number, got"),
    (lambda x: PiecewiseLinear(x, ()), ([1e5, 2e5],), "2 slopes needs 1 knots"),
    (lambda x: PiecewiseLinear(x, (1e-3,)), ([1e5],), "1 slopes needs 0 knots"),
    (lambda x: PiecewiseLinear(x, (1e-3,)), ([1e5, -1e5],), "soften to a negative force"),
    (lambda x: PiecewiseLinear(x, (1e-3, 2e-3)), ([1e5, -1e6, 1e5],), "soften to a negative force"),
    (lambda x: PiecewiseLinear([1e5, 2e5], [1e-3], x), ([-1.0], [1.0, 2.0, 3.0], [math.nan, 1.0], "much"),
     "damping (of PiecewiseLinear )?must be"),
    *((lambda x, name=name: Hertz.of_spheres(**SPHERES | {name: x}), bad, f"{name} of Hertz.of_spheres must {rule}")
      for name, bad, rule in (("E1", (-1.0,), "be finite and > 0"), ("E2", (math.inf,), "be finite and > 0"),
                              ("R2", (0.0,), "be finite and > 0"), ("R1", (math.nan,), "be finite and > 0"),
                              ("nu1", (0.6,), "lie in"), ("nu2", (-1.0,), "lie in"))),
    (lambda x: Hertz.of_spheres(**SPHERES | {"R1": x, "R2": x}), (math.inf,), "both infinite"),
    *((lambda x, make=make: make(1e6, x, 1.0), (0.0, -0.1, 1.1, math.nan), SHARE) for make in OF_A_MASS),
    *((lambda x, make=make: make(1e6, 0.5, x), (0.0, -1.0, math.inf), "mass of .* must be finite and > 0")
      for make in OF_A_MASS),
    *((lambda x, make=make: make(x, 0.5, 1.0), (0.0, -1.0, math.inf), "stiffness of .* must be finite and > 0")
      for make in OF_A_MASS),
    *((lambda x: Tabulated(*x), (table,), message) for table, message in (
        (([1e-3, 2e-3], [10.0]), "as many forces as indentations, got 1 and 2"),
        (([2e-3, 1e-3], [10.0, 20.0]), "must be >= 0 and ascend, got 0.002 m, then 0.001 m"),
        (([-1e-3, 1e-3], [0.0, 20.0]), "must be >= 0 and ascend"),
        (([-1e-3], [1.0]), "must be >= 0 and ascend, got -0.001 m first"),
        (([1e-3, 2e-3], [20.0, 10.0]), "must not fall with indentation .* got 20 then 10 N; smooth"),
        (([0.0, 1e-3], [1.0, 10.0]), "force 0 at indentation 0, got 1 N; subtract the offset"),
        (([1e-3], [0.0]), "must end above 0"),
        (([], []), "got no point"),
        (([math.nan], [1.0]), "must be finite"),
        ((["a"], [1.0]), "indentation of Tabulated must be a number, got"),
    )),
]  # fmt: skip


@pytest.mark.parametrize(("make", "values", "message"), REFUSED)
def test_values_are_refused(make, values, message):
    for bad in values:
        with pytest.raises(ValueError, match=message):
            make(bad)


def test_clamp_may_be_a_bool_of_numpy():
    assert Hysteretic(1e8, 0.1, clamp=np.True_).clamp
    assert KelvinVoigt(1e5, 1.0, clamp=np.True_).clamp


@pytest.mark.parametrize("of", [Hertz(3e8), Hysteretic(2e8, 0.7), Hysteretic(5e4, 0.3, 1.0), KelvinVoigt(1e5, 30.0)])
def test_the_formula_of_inlined_laws_is_their_kernel(of):
    K, p, a, c = of.inlined
    d, v, rate = np.linspace(0.0, 1e-3, 7)[1:], np.linspace(-0.6, 0.5, 6)[:, None], 0.4
    np.testing.assert_allclose(of.force(d, v, rate), K * d**p * (1.0 + a * v / rate) + c * v, rtol=1e-13)


@pytest.mark.parametrize(
    "of",
    [
        *(Hysteretic(2e8, 0.7, clamp=True), Hysteretic(2e8, 0.7, exponent=2.0), KelvinVoigt(1e5, 30.0, clamp=True)),
        *(Viscoelastic(1e8, 3e3), PiecewiseLinear([1e5]), Hertz(1e8) + Hertz(1e8)),
    ],
)
def test_other_laws_are_not_inlined(of):
    assert of.inlined is None
