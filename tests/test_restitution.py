"""Restitution: the exact relation a (1 + r) = ln[(1 + a)/(1 - a r)], and free masses that obey it."""

import math
import sys
from functools import partial

import numpy as np
import pytest
from problems import DampedHalfWave, HertzBounce, bounce, free_mass, paper_scene

import solvers
from contacts import (
    PUBLISHED,
    Hertz,
    Hysteretic,
    KelvinVoigt,
    PiecewiseLinear,
    Tabulated,
    Viscoelastic,
    achieved_restitution,
    damping_factor_for,
    law,
    restitution,
)
from contacts import bounce as throw


def relation(a, r):
    """Residual of the exact relation."""
    return a * (1.0 + r) - math.log1p(a) + math.log1p(-a * r)


def test_published_values():
    assert Hysteretic.lankarani_nikravesh(1e8, 0.5).damping_factor == 0.5625
    assert achieved_restitution(0.5625) == pytest.approx(0.725241114010, abs=5e-13)
    assert damping_factor_for(0.5) == pytest.approx(1.432750533, abs=5e-10)
    assert Hysteretic.achieving(1e8, 0.5).damping_factor == damping_factor_for(0.5)


@pytest.mark.parametrize("bad", [0.0, -0.1, 1.0000001, math.nan, math.inf])
def test_restitution_out_of_range_is_refused(bad):
    with pytest.raises(ValueError, match=r"of achieving must lie in \(0, 1\], got .*; its factor is infinite at 0"):
        Hysteretic.achieving(1e8, bad)
    if bad != 0.0:
        with pytest.raises(ValueError, match=r"of lankarani_nikravesh must lie in \[0, 1\], got [-0-9a-z.]*$"):
            Hysteretic.lankarani_nikravesh(1e8, bad)


@pytest.mark.parametrize("bad", [-0.1, math.nan, math.inf])
def test_damping_factor_out_of_range_is_refused(bad):
    with pytest.raises(ValueError, match=r"damping_factor must be finite and >= 0"):
        achieved_restitution(bad)


# --- a free mass on each law --------------------------------------------------------------------------------------


@pytest.mark.parametrize("a", [0.05, 0.5625, 1.432750533, 5.0])
@pytest.mark.parametrize(
    ("mass", "speed", "stiffness", "exponent"),
    [(1.0, 1.0, 2.1e8, 1.5), (0.03, 0.02, 2.1e8, 1.5), (40.0, 8.0, 1e6, 1.0), (2.0, 0.5, 1e9, 2.5)],
)
def test_free_mass_rebounds_by_the_relation(a, mass, speed, stiffness, exponent):
    log = bounce(Hysteretic(stiffness, a, exponent), speed, mass, duration=100.0).contacts
    assert len(log) == 1
    assert log.speed_in[0] == pytest.approx(speed, rel=1e-15)
    assert log.speed_out[0] / speed == pytest.approx(achieved_restitution(a), rel=1e-10)
    assert abs(relation(a, log.speed_out[0] / speed)) < 1e-9


@pytest.mark.parametrize("speed", [0.01, 1.0, 7.0])
@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.0, 3.0])
def test_elastic_power_law_bounce(speed, exponent):
    exact = HertzBounce(stiffness=3e8, mass=2.5, speed=speed, exponent=exponent)
    log = bounce(Hertz(3e8, exponent), speed, 2.5, duration=100.0).contacts
    assert log.speed_out[0] == pytest.approx(speed, rel=1e-11)
    assert log.t_out[0] - log.t_in[0] == pytest.approx(exact.duration, rel=1e-10)
    assert log.peak_indentation[0] == pytest.approx(exact.peak_indentation, rel=1e-10)
    assert log.peak_force[0] == pytest.approx(exact.peak_force, rel=1e-10)


@pytest.mark.parametrize("damping", [0.0, 20.0, 200.0, 1500.0])
def test_kelvin_voigt_bounce_is_a_damped_half_wave(damping):
    exact = DampedHalfWave(stiffness=1e6, damping=damping, mass=2.0, speed=1.3)
    solution = bounce(KelvinVoigt(1e6, damping), 1.3, 2.0, duration=0.02)
    log = solution.contacts
    assert log.t_out[0] == pytest.approx(exact.exit_time, rel=1e-11)
    assert log.speed_out[0] == pytest.approx(exact.exit_speed, rel=1e-11)
    assert log.peak_indentation[0] == pytest.approx(exact.peak_indentation, rel=1e-11)
    assert log.peak_force[0] >= damping * 1.3 * (1 - 1e-12)  # the dashpot's force at entry
    assert solution.q[-1, 0] == pytest.approx(exact.exit_speed * (0.02 - exact.exit_time), rel=1e-10)


def test_kelvin_voigt_pulls_before_it_lets_go_unless_clamped():
    exact = DampedHalfWave(stiffness=1e6, damping=200.0, mass=2.0, speed=1.3)
    free, clamped = (bounce(KelvinVoigt(1e6, 200.0, cut), 1.3, 2.0, duration=0.02).contacts for cut in (False, True))
    release = exact.release_time
    assert release < exact.exit_time
    # after the release nothing acts: the mass coasts out of the remaining indentation
    speed = -exact.delta_dot(release)
    assert clamped.speed_out[0] == pytest.approx(speed, rel=1e-10)
    assert clamped.t_out[0] == pytest.approx(release + exact.delta(release) / speed, rel=1e-10)
    assert clamped.speed_out[0] > free.speed_out[0] * 1.01
    assert clamped.impulse[0] > free.impulse[0]


def test_bounce_that_turns_before_the_knot_sees_one_slope():
    log = bounce(PiecewiseLinear([1e5, 2e6], [1e-2]), 0.8, 3.0, duration=0.1).contacts
    assert log.t_out[0] == pytest.approx(math.pi / math.sqrt(1e5 / 3.0), rel=1e-12)


LAWS = [
    Hertz(2.1e8),
    Hysteretic(2.1e8, 1.4),
    KelvinVoigt(1e6, 150.0),
    KelvinVoigt(1e6, 150.0, clamp=True),
    PiecewiseLinear([1e5, 2e6], [1e-3]),
]


@pytest.mark.parametrize("one", LAWS, ids=repr)
def test_ledger_of_a_bounce(one):
    mass, speed = 1.7, 1.1
    solution = bounce(one, speed, mass, duration=0.1)
    log = solution.contacts
    before, after = 0.5 * mass * speed**2, 0.5 * mass * log.speed_out[0] ** 2
    assert log.energy_loss[0] == pytest.approx(before - after, abs=1e-12 * before)
    assert log.impulse[0] == pytest.approx(mass * (speed + log.speed_out[0]), rel=1e-12)
    assert solution.energy.contact[-1] == log.energy_loss[0]
    assert solution.energy.input[-1] == solution.energy.damping[-1] == 0.0
    assert abs(solution.energy.residual[-1]) < 1e-12 * before
    assert np.isclose(solution.energy.stored[-1], after, rtol=1e-12)


# --- what every law really does -----------------------------------------------------------------------------------

NOMINAL = [0.1, 0.5, 0.9]
MAKERS = {
    **{name: getattr(Hysteretic, name) for name in PUBLISHED},
    "anagnostopoulos": partial(KelvinVoigt.anagnostopoulos, mass=0.3),
    "anagnostopoulos, clamp": partial(KelvinVoigt.anagnostopoulos, mass=0.3, clamp=True),
    "tsuji": partial(Viscoelastic.tsuji, mass=0.3),
    "tsuji, clamp": partial(Viscoelastic.tsuji, mass=0.3, clamp=True),
    "tsuji, p = 2": partial(Viscoelastic.tsuji, mass=0.3, exponent=2.0),
    "jankowski": partial(Viscoelastic.jankowski, mass=0.3),
}
ACHIEVING = ("achieving", "zhang_sharf", "anagnostopoulos", "tsuji", "tsuji, p = 2")


@pytest.mark.parametrize("name", MAKERS)
def test_achieved_restitution_against_integration(name):
    for nominal in NOMINAL:
        one = MAKERS[name](2e7, nominal)
        achieved = restitution(one, entry_rate=0.4, mass=0.3)
        assert throw(one, 0.4, 0.3).restitution == pytest.approx(achieved, abs=1e-9)
        if name in ACHIEVING:
            assert achieved == pytest.approx(nominal, abs=1e-12)
        if isinstance(one, Hysteretic):
            assert abs(relation(one.damping_factor, achieved)) < 1e-9


def test_viscous_restitution_depends_on_mass_but_not_on_speed():
    for one in (KelvinVoigt(1e6, 300.0), Viscoelastic(1e8, 3e3), Viscoelastic(1e8, 3e3, approach_only=True)):
        slow, fast = (throw(one, v, 1.0).restitution for v in (0.05, 2.0))
        assert slow == pytest.approx(fast, abs=1e-9)
        assert restitution(one, mass=10.0) > slow + 0.05


def test_an_entry_below_the_floor_sees_less_damping():
    one = Hysteretic(1e8, 1.2, entry_rate_floor=0.02)
    assert restitution(one, 0.005) == achieved_restitution(0.3)
    assert throw(one, 0.005).restitution == pytest.approx(achieved_restitution(0.3), abs=1e-9)


def test_overdamped_stops():
    assert restitution(KelvinVoigt(1e6, 5000.0)) == 0.0  # creeps out for ever
    for damping in (1999.0, 2000.0, 2001.0, 5000.0):
        clamped = KelvinVoigt(1e6, damping, clamp=True)
        assert throw(clamped).restitution == pytest.approx(restitution(clamped), abs=1e-9)
    approach = Viscoelastic(1e8, 1e5, approach_only=True)
    assert throw(approach).restitution == pytest.approx(restitution(approach), abs=1e-9)


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
def test_throws_are_checked(bad):
    with pytest.raises(ValueError, match="entry_rate must be finite and > 0"):
        restitution(Hertz(1e8), bad)
    with pytest.raises(ValueError, match="mass must be finite and > 0"):
        restitution(Hertz(1e8), 1.0, bad)


@law
def by_hand(delta, delta_dot, entry_rate, stiffness, a):
    """Hysteretic Hertz."""
    return stiffness * delta * math.sqrt(delta) * (1.0 + a / entry_rate * delta_dot)


@law
def nothing(delta, delta_dot, entry_rate):
    """A stop that is not there."""
    return 0.0 * delta


def test_a_law_that_never_stops_the_mass_is_an_error():
    with pytest.raises(ValueError, match=r"a bounce of 1 kg at 1 m/s on .*: the law never stops the mass"):
        restitution(nothing())


def named(method):
    """Class of a method."""
    return type(method).__name__


EVERY = [
    *(MAKERS[name](2e7, 0.6) for name in ("hunt_crossley", "anagnostopoulos", "tsuji", "tsuji, clamp", "jankowski")),
    Hysteretic(2e7, 0.4, 2.5, clamp=True),
    PiecewiseLinear([1e5, 2e6, 4e5], [1e-4, 4e-4]),
    PiecewiseLinear([1e5, 2e6], [2e-4], damping=[30.0, 250.0]),
    PiecewiseLinear([2e5, -1e5, 3e5], [3e-4, 5e-4], damping=[0.0, 40.0, 0.0]),
    Tabulated([1e-4, 2e-4, 4e-4, 8e-4], [5.0, 20.0, 90.0, 200.0]),
    by_hand(stiffness=2e7, a=0.8),
    Hertz(2e7) + KelvinVoigt(1e5, 20.0),
    Hertz(2e7) + Hertz(1e5, 1.0) + Viscoelastic(1e6, 100.0),
    by_hand(stiffness=2e7, a=0.8) + PiecewiseLinear([1e4, 2e5], [2e-4]),
]


@pytest.mark.parametrize("one", EVERY, ids=repr)
@pytest.mark.parametrize("method", [solvers.Exponential(1e-11), solvers.DormandPrince(1e-12, 1e-18)], ids=named)
def test_every_law_in_both_integrators(one, method):
    mass, speed = 0.3, 0.4
    thrown = throw(one, speed, mass)
    lasting = thrown.t[-1]
    solution = solvers.integrate(free_mass(one, mass), [0.0], [-speed], 1.2 * lasting, dt=lasting / 4000, method=method)
    log = solution.contacts
    assert len(log) == 1
    # a kink that moves with the rate costs some order, and the exponential method may miss it
    hidden = getattr(one, "clamp", False) and isinstance(method, solvers.Exponential)
    assert log.speed_out[0] / speed == pytest.approx(thrown.restitution, abs=1e-5 if hidden else 2e-9)
    assert log.t_out[0] == pytest.approx(lasting, rel=1e-5 if hidden else 1e-7)
    assert log.peak_indentation[0] == pytest.approx(thrown.delta.max(), rel=1e-8)
    energy = 0.5 * mass * (speed**2 - log.speed_out[0] ** 2)
    assert log.energy_loss[0] == pytest.approx(energy, abs=1e-9 * mass * speed**2)
    force = one.force(-solution.q[:, 0], -solution.q_dot[:, 0], speed)
    loop = np.trapezoid(force, -solution.q[:, 0])
    assert loop == pytest.approx(log.energy_loss[0], abs=1e-3 * 0.5 * mass * speed**2)


def test_three_slopes_against_their_pieces():
    # stiffening, then softening; from knot to knot by energy, the turning point in the last branch
    slopes, knots, mass, speed = (1e5, 2e6, 4e5), (1e-4, 4e-4), 0.3, 1.2
    t, delta, force, v = 0.0, 0.0, 0.0, speed
    for slope, knot in zip(slopes, (*knots, math.inf), strict=True):
        omega = math.sqrt(slope / mass)
        radius = math.hypot(v / omega, force / slope)  # about the branch's own zero of force
        phase = math.asin(force / slope / radius)
        if knot == math.inf:
            t, peak = t + (math.pi / 2 - phase) / omega, slope * radius
            delta += radius - force / slope
            break
        there = math.asin((force / slope + knot - delta) / radius)
        t += (there - phase) / omega
        force, delta, v = force + slope * (knot - delta), knot, radius * omega * math.cos(there)
    for method in (solvers.Exponential(1e-11), solvers.DormandPrince(1e-12, 1e-18)):
        system = free_mass(PiecewiseLinear(slopes, knots), mass)
        log = solvers.integrate(system, [0.0], [-speed], 0.1, method=method).contacts
        assert log.peak_indentation[0] == pytest.approx(delta, rel=1e-9)
        assert log.peak_force[0] == pytest.approx(peak, rel=1e-9)
        assert log.t_out[0] == pytest.approx(2.0 * t, rel=1e-9)
        assert log.speed_out[0] == pytest.approx(speed, rel=1e-9)


def compiled():
    """(signatures, cache misses) of every compiled function of the integrators."""
    from numba.core.dispatcher import Dispatcher

    rooms = [module for name, module in sys.modules.items() if name.split(".")[0] == "solvers"]
    functions = {id(f): f for room in rooms for f in vars(room).values() if isinstance(f, Dispatcher)}
    return [(len(f.signatures), sum(f.stats.cache_misses.values())) for f in functions.values()]


@pytest.mark.parametrize("method", [solvers.Exponential(1e-8), solvers.DormandPrince(1e-9)], ids=named)
def test_a_user_law_runs_as_the_built_in_and_recompiles_nothing(method):
    model = paper_scene(law=Hysteretic(2.1e8, 0.5625)).reduce(2)
    same = paper_scene(law=by_hand(stiffness=2.1e8, a=0.5625)).reduce(2)
    run = model.simulate(0.1, None, solver=method)
    before = compiled()
    again = same.simulate(0.1, None, solver=method)
    assert compiled() == before
    assert len(before) > 10
    assert len(run.contacts) > 2
    assert again.cost.steps == pytest.approx(run.cost.steps, rel=0.01)  # rounding decides a rejection or two
    assert again.cost.law_calls == pytest.approx(run.cost.law_calls, rel=0.05)
    np.testing.assert_allclose(again.q, run.q, rtol=0, atol=1e-10 * np.abs(run.q).max())
    np.testing.assert_allclose(again.contacts.t_in, run.contacts.t_in, rtol=1e-11)
