"""Laws over the whole range of their parameters: the right number or a refusal in words, whatever the rounding."""

import math
import re
import sys
import warnings
from decimal import Decimal, localcontext

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import contacts
from contacts import (
    PUBLISHED,
    BoucWen,
    Coulomb,
    ElastoPlastic,
    Hertz,
    Hysteretic,
    Iwan,
    Jenkins,
    KelvinVoigt,
    PiecewiseLinear,
    Polynomial,
    Tabulated,
    Viscoelastic,
    WaltonBraun,
    achieved_restitution,
    bounce,
    damping_factor_for,
    memory_law,
    restitution,
)
from fembeam.support import numbers

TINY, HUGE = sys.float_info.min, sys.float_info.max
ENDS = [5e-324, TINY, 1e-170, 1e-150, 1e-100, 1e-50, 1e-16, 0.5, 1.0, 2.0, 1e16, 1e50, 1e100, 1e150, HUGE]


def powers(low, high):
    """Numbers of any size between two powers of ten."""
    return st.floats(low, high).map(lambda x: 10.0**x)


POSITIVE = st.one_of(st.sampled_from(ENDS), powers(-300, 300), powers(-6, 9))
NONNEGATIVE = st.one_of(st.just(0.0), POSITIVE)
SIGNED = st.one_of(NONNEGATIVE, NONNEGATIVE.map(lambda x: -x))
SHARE = st.one_of(st.sampled_from([0.0, 5e-324, 1e-60, 1.0 - 2.0**-53, 1.0]), powers(-300, 0), st.floats(0.0, 1.0))
EXPONENT = st.one_of(st.sampled_from([1.0, 1.0 + 2.0**-52, 1.5, 100.0]), st.floats(1.0, 100.0))
fast = settings(
    max_examples=150, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow], database=None
)
TOLD = "must (be|lie|hold|have|not)|beyond the floats|needs|soften|infinite"


def done_or_refused(do):
    """What is done, None where it is refused in words."""
    try:
        return do()
    except ValueError as error:
        message = str(error)
    assert re.search(TOLD, message), message
    return None


# --- the exact relation ----------------------------------------------------------------------------------------------


def excess(a, r):
    """ln[(1 + a)/(1 - a r)] - a (1 + r) in decimal numbers: negative below the achieved restitution, positive above."""
    with localcontext(prec=120):
        a, r = Decimal(a), Decimal(r)
        return Decimal("inf") if a * r >= 1 else (1 + a).ln() - (1 - a * r).ln() - a * (1 + r)


@fast
@given(st.one_of(st.sampled_from([0.0, *ENDS]), powers(-323, 308), powers(-16, 2)))
def test_the_achieved_restitution_of_any_factor(a):
    r = achieved_restitution(a)
    if a < 1e-17:
        assert r == 1.0
    elif a > 1e3:
        assert r == 1.0 / a
    else:
        assert excess(a, r * (1.0 - 1e-14)) < 0 < excess(a, r * (1.0 + 1e-14))
        assert r <= 1.0


@fast
@given(st.one_of(powers(-50, 0), st.floats(1e-6, 1.0), powers(-16, -1).map(lambda x: 1.0 - x)))
def test_the_factor_of_any_restitution(r):
    a = damping_factor_for(r)
    if r == 1.0:
        assert a == 0.0
    elif r < 1e-3:
        assert a == 1.0 / r
    else:
        assert excess(a * (1.0 - 3e-14), r) < 0 < excess(a * (1.0 + 3e-14), r)


def test_the_factor_next_to_an_elastic_bounce_follows_the_series():
    for missing in (2.0**-53, 1e-15, 1e-12, 1e-9):
        r = 1.0 - missing
        missing = 1.0 - r
        assert damping_factor_for(r) == pytest.approx(1.5 * missing + 1.5 * missing**2, rel=1e-15 + 10.0 * missing**2)


@fast
@given(powers(-100, 100), POSITIVE, POSITIVE, NONNEGATIVE, st.booleans())
def test_the_restitution_of_a_dashpot_of_any_size(k, mass, speed, ratio, clamp):
    """exp(-πβ) for small damping ratios β; 0 from 1 on, or with the force cut at zero 1/4β² for large ones."""
    one = done_or_refused(lambda: KelvinVoigt(k, 2.0 * ratio * math.sqrt(k) * math.sqrt(mass), clamp))
    r = one and done_or_refused(lambda: restitution(one, speed, mass))
    if r is None:
        return
    beta = one.damping / (2.0 * math.sqrt(k) * math.sqrt(mass))
    assert 0.0 <= r <= 1.0
    if beta < 1e-8:
        assert r == pytest.approx(1.0 - math.pi * beta, abs=2e-15)
    elif beta > 1e4:
        assert r == pytest.approx(0.25 / beta / beta if clamp else 0.0, rel=1e-7)
    elif not clamp:
        assert (r == 0.0) == (beta > 0.99999)


# --- every constructor -----------------------------------------------------------------------------------------------

MOSTLY = st.one_of(powers(-6, 6), powers(-50, 50), POSITIVE)


def rows(*kinds):
    """Rows of equal length, one of each kind."""
    pairs = st.lists(st.tuples(*kinds), min_size=1, max_size=4)
    return pairs.map(lambda found: tuple(map(list, zip(*found, strict=True))))


TABLE = rows(powers(-55, 55), powers(-55, 55)).map(lambda pair: tuple(map(sorted, pair)))
BACKBONE = st.lists(powers(-6, 6), min_size=1, max_size=4).map(lambda x: (sorted(x), [y**0.5 for y in sorted(x)]))
CLAMP = st.fixed_dictionaries({}, optional={"exponent": EXPONENT, "clamp": st.booleans()})
MADE = {
    **{name: st.tuples(st.just(getattr(Hysteretic, name)), st.tuples(POSITIVE, SHARE), CLAMP) for name in PUBLISHED},
    "hertz": st.tuples(st.just(Hertz), st.tuples(POSITIVE, EXPONENT)),
    "hysteretic": st.tuples(st.just(Hysteretic), st.tuples(POSITIVE, NONNEGATIVE, EXPONENT, st.booleans(), POSITIVE)),
    "spheres": st.tuples(
        st.just(Hertz.of_spheres),
        st.tuples(
            POSITIVE, st.floats(-1.0, 0.5), POSITIVE, POSITIVE, st.just(0.3), st.one_of(st.just(math.inf), POSITIVE)
        ),
    ),
    "kelvin_voigt": st.tuples(st.just(KelvinVoigt), st.tuples(POSITIVE, NONNEGATIVE, st.booleans())),
    "anagnostopoulos": st.tuples(st.just(KelvinVoigt.anagnostopoulos), st.tuples(POSITIVE, SHARE, POSITIVE)),
    "viscoelastic": st.tuples(
        st.just(Viscoelastic), st.tuples(POSITIVE, NONNEGATIVE, EXPONENT, st.booleans(), st.booleans())
    ),
    "tsuji": st.tuples(st.just(Viscoelastic.tsuji), st.tuples(POSITIVE, SHARE, POSITIVE), CLAMP),
    "jankowski": st.tuples(st.just(Viscoelastic.jankowski), st.tuples(POSITIVE, SHARE, POSITIVE), CLAMP),
    "piecewise": st.tuples(
        st.just(PiecewiseLinear), st.tuples(st.lists(SIGNED, min_size=1, max_size=3), st.lists(POSITIVE, max_size=2))
    ),
    "tabulated": st.tuples(st.just(Tabulated), TABLE),
    "polynomial": st.tuples(st.just(Polynomial), st.tuples(st.lists(NONNEGATIVE, max_size=4))),
    "jenkins": st.tuples(st.just(Jenkins), st.tuples(POSITIVE, POSITIVE)),
    "coulomb": st.tuples(st.just(Coulomb), st.tuples(POSITIVE, POSITIVE, st.one_of(st.none(), POSITIVE), NONNEGATIVE)),
    "elasto_plastic": st.tuples(st.just(ElastoPlastic), st.tuples(POSITIVE, POSITIVE, NONNEGATIVE)),
    "iwan": st.tuples(st.just(Iwan), rows(MOSTLY, st.one_of(MOSTLY, st.just(math.inf)))),
    "iwan_uniform": st.tuples(st.just(Iwan.uniform), st.tuples(POSITIVE, POSITIVE, st.integers(-1, 9))),
    "iwan_backbone": st.tuples(st.just(Iwan.from_backbone), st.one_of(BACKBONE, TABLE)),
    "bouc_wen": st.tuples(
        st.just(BoucWen), st.tuples(POSITIVE, SHARE, POSITIVE, NONNEGATIVE, SIGNED, st.sampled_from([1, 2]))
    ),
    "walton_braun": st.tuples(
        st.just(WaltonBraun), st.tuples(POSITIVE, POSITIVE, st.sampled_from(["kept", "forgotten"]))
    ),
}


@pytest.mark.parametrize("name", MADE)
def test_any_parameters_give_a_law_that_works_or_a_refusal(name):
    """Text, restitution and forces are finite, the restitution lies in [0, 1]; nothing warns."""
    made = []

    @settings(fast, max_examples=20)
    @given(MADE[name], POSITIVE, POSITIVE)
    def tried(one_of, speed, mass):
        make, arguments, *options = one_of
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            one = done_or_refused(lambda: make(*arguments, **(options[0] if options else {})))
            if one is None:
                return
            made.append(one)
            text = done_or_refused(lambda: one.describe(speed, mass))
            assert "nan" not in (text or "")
            if one.exact_restitution(1.0, 1.0) is not None:
                assert 0.0 <= (done_or_refused(lambda: restitution(one, speed, mass)) or 0.0) <= 1.0
            if one.reach:
                assert np.all(np.isfinite(one.along(one.reach * np.array([0.0, 1.0, -1.0, 0.5]))))
            else:
                assert not np.any(np.isnan(one.force([1e-9, 1e-4, 1.0], 0.1)))
            assert eval(repr(one), {**vars(contacts), "inf": math.inf}) == one

    tried()
    assert made, "no law was made: the ranges are too narrow"


@settings(fast, max_examples=20)
@given(
    st.sampled_from(["hertz", "hysteretic", "kelvin_voigt", "viscoelastic"]),
    powers(-90, 90),
    powers(-100, 100),
    powers(-100, 100),
    st.floats(0.0, 1.5),
    st.sampled_from([1.5, 2.0, 10.0]),
)
def test_a_bounce_of_any_size_is_that_of_the_exact_relation(name, k, speed, mass, ratio, p):
    """Tolerances of the integration are relative to the size of the bounce: forces of 1e-100 N and 1e100 N."""
    damping = ratio * math.sqrt(2.0 * (p + 1.0)) * math.sqrt(k) * math.sqrt(mass)
    make = {
        "hertz": lambda: Hertz(k, p),
        "hysteretic": lambda: Hysteretic(k, ratio, p, entry_rate_floor=1e-30),
        "kelvin_voigt": lambda: KelvinVoigt(k, damping / math.sqrt(p + 1.0), clamp=True),
        "viscoelastic": lambda: Viscoelastic(k, damping, p, approach_only=True),
    }[name]
    one = done_or_refused(make)
    thrown = one and done_or_refused(lambda: bounce(one, speed, mass))
    if thrown is None:
        return
    assert thrown.restitution == pytest.approx(restitution(one, speed, mass), abs=1e-9)
    assert np.all(np.isfinite([thrown.t, thrown.delta, thrown.delta_dot, thrown.force]))


def test_bounces_that_do_not_end_are_told(monkeypatch):
    monkeypatch.setattr(sys.modules["contacts.restitution"], "LONGEST", 10.0)
    dashpot = PiecewiseLinear([1e-40], damping=1e3)  # at rest it gives nothing
    stuck = bounce(dashpot)
    assert not stuck.left
    assert stuck.restitution == restitution(dashpot) == 0.0
    assert stuck.delta.max() == pytest.approx(1e-3, rel=1e-9)
    soft = Polynomial([1e5, -1e9])
    with pytest.raises(ValueError, match=r"a bounce of 1 kg at 100 m/s on Pol.* (never stops|cannot be followed)"):
        restitution(soft, entry_rate=100.0)
    assert "achieves none: a bounce of 1 kg at 100 m/s" in soft.describe(100.0)


def test_energies_of_any_size_and_of_tables_of_any_length():
    for k in (1e-90, 1.0, 1e90):
        assert Hertz(k).stored(1e-7, np.zeros(0)) == pytest.approx(k * 1e-7**2.5 / 2.5, rel=1e-9)
    x = np.linspace(0.0, 1e-3, 90)
    assert Tabulated(x, 1e6 * x**2).stored(1e-3, np.zeros(0)) == pytest.approx(1e6 * 1e-9 / 3.0, rel=1e-3)


def test_slopes_may_soften_to_no_force_whatever_the_rounding():
    for k, x in ((1e5, 1e-3), (3e4, 7e-4), (1.1e6, 3.3e-5)):
        one = PiecewiseLinear([k, -k, k], [x, 2.0 * x])
        assert abs(one.force(2.0 * x)) < 1e-9 * k * x


@pytest.mark.parametrize("wide", [1e3, 1e6, 1e15, 1e31, 1e45])
def test_sliders_that_stick_over_less_than_a_step_or_than_rounding_are_led_along_a_path(wide):
    """The path is 4 ``wide``, the first slider sticks over 2: far less than what separates two points looked at."""
    one = Iwan([1.0, 1.0, 1.0], [1.0, 0.1 * wide, wide])
    found = one.along(wide * np.array([0.0, 2.0, -2.0, 2.0, 1.95]))
    full = 1.0 + 1.1 * wide
    assert found == pytest.approx([0.0, full, -full, full, wide - 1.0], rel=1e-12)


# --- what is no number -----------------------------------------------------------------------------------------------

ODD = [True, np.True_, None, "5", b"5", 3.0 + 0.0j, np.complex128(3.0), {}, object(), [1.0], np.array([2.0]), 10**400]
TAKES = {
    "stiffness of Hertz": Hertz,
    "exponent of Hertz": lambda x: Hertz(1.0, x),
    "damping_factor of Hysteretic": lambda x: Hysteretic(1.0, x),
    "entry_rate_floor of Hysteretic": lambda x: Hysteretic(1.0, 1.0, entry_rate_floor=x),
    "restitution of flores": lambda x: Hysteretic.flores(1.0, x),
    "E1 of Hertz.of_spheres": lambda x: Hertz.of_spheres(x, 0.3, 1.0, 1.0, 0.3, 1.0),
    "nu2 of Hertz.of_spheres": lambda x: Hertz.of_spheres(1.0, 0.3, 1.0, 1.0, x, 1.0),
    "damping of KelvinVoigt": lambda x: KelvinVoigt(1.0, x),
    "mass of tsuji": lambda x: Viscoelastic.tsuji(1.0, 0.5, x),
    "limit of Jenkins": lambda x: Jenkins(1.0, x),
    "static_limit of Coulomb": lambda x: Coulomb(1.0, 1.0, x) if x is not None else Coulomb(1.0, 1.0, "none"),
    "hardening of ElastoPlastic": lambda x: ElastoPlastic(1e3, 1.0, x),
    "stiffness of Iwan.uniform": lambda x: Iwan.uniform(x, 1.0, 2),
    "slope of Iwan.from_backbone": lambda x: Iwan.from_backbone([1.0], [1.0], x),
    "gamma of BoucWen": lambda x: BoucWen(1.0, 0.0, 1.0, 1.0, x),
    "unloading of WaltonBraun": lambda x: WaltonBraun(1.0, x),
    "damping_factor": achieved_restitution,
    "restitution of damping_factor_for": damping_factor_for,
    "entry_rate": lambda x: restitution(Hertz(1.0), x),
    "mass": lambda x: bounce(Hertz(1.0), 1.0, x),
    "start of latched 's' of law 'x'": lambda x: memory_law("x", {}, {"s": x}),
    "reach of law 'x'": lambda x: memory_law("x", {}, reach=x),
    "coefficients of Polynomial": Polynomial,
    "limits of Iwan": lambda x: Iwan(1.0, x),
    "path of Jenkins": Jenkins(1.0, 1.0).along,
    "delta of a force": Hertz(1.0).force,
}
# may be rows, and infinite
ROWS = "coefficients of Polynomial", "limits of Iwan", "path of Jenkins", "delta of a force"


@pytest.mark.parametrize("what", TAKES)
def test_what_is_no_number_is_refused_in_words(what):
    warnings.simplefilter("error")  # of this test alone: pytest keeps them
    for odd in ODD[: -3 if what in ROWS else None]:
        with pytest.raises(ValueError, match="must") as refused:
            TAKES[what](odd)
        assert str(refused.value).startswith(what)


@pytest.mark.parametrize("kind", [np.longdouble, np.float32, np.float16, np.int8, np.uint64, int])
def test_numbers_of_other_kinds_become_floats(kind):
    one = Hysteretic(kind(2), kind(1), exponent=kind(2))
    assert one == Hysteretic(2.0, 1.0, exponent=2.0)
    assert all(type(x) is float for x in (one.stiffness, one.damping_factor, one.exponent))
    assert restitution(one, kind(1), kind(1)) == achieved_restitution(1.0)
    assert type(achieved_restitution(kind(1))) is float
    rows = (Polynomial([kind(1), kind(2)]), Tabulated([kind(1)], [kind(2)]), Iwan([kind(1)], [kind(2)]))
    assert rows == (Polynomial([1.0, 2.0]), Tabulated([1.0], [2.0]), Iwan([1.0], [2.0]))
    assert BoucWen(1.0, 0.0, 1.0, 1.0, 1.0, kind(1) if kind in (np.int8, int) else 1).n == 1


def test_numbers_beyond_the_floats_are_refused():
    for big in (np.longdouble("1e4000"), 10**400):
        with pytest.raises(ValueError, match="stiffness of Hertz must be finite and > 0, got"):
            Hertz(big)
        with pytest.raises(ValueError, match="coefficients of Polynomial must be finite"):
            Polynomial([1.0, big])


@pytest.mark.parametrize("switch", [True, np.False_])
def test_a_switch_among_numbers_is_none_of_them(switch):
    with pytest.raises(ValueError, match="coefficients of Polynomial must be a number, got "):
        Polynomial([1.0, switch])


def test_arrays_of_other_libraries_are_numbers():
    """Such as those of HDF5 files: they do not become Python's objects."""

    class Stored:
        def __array__(self, dtype=None, copy=None):
            if dtype is not None and np.dtype(dtype).kind == "O":
                raise TypeError
            return np.array([0.0, 1e-3, 2e-3])

    np.testing.assert_array_equal(Hertz(1e8, 1.0).force(Stored()), [0.0, 1e5, 2e5])
    np.testing.assert_array_equal(numbers("z", Stored(), "here", ""), [0.0, 1e-3, 2e-3])
