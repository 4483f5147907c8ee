"""Friction under a contact's own force: SciPy's DOP853 with its own events, closed forms, identities, energy."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from oscillators import Tone
from refusals import refused, refused_by
from scipy.integrate import solve_ivp

import fembeam as fb
from contacts import Hertz, Hysteretic, Jenkins, KelvinVoigt, PiecewiseLinear, Polynomial, Viscoelastic
from solvers import (
    RK4,
    CentralDifference,
    Contact,
    DormandPrince,
    Exponential,
    Friction,
    OrbitError,
    SolverError,
    System,
    integrate,
    integrate_many,
    orbit,
)
from solvers.compiled.decorators import kernel
from solvers.compiled.friction import angle_at, latch_angle

SHARP = DormandPrince(1e-12)
TILTS = np.linspace(0.02, 0.9, 12)
METHODS = [SHARP, Exponential(1e-12)]
NAMES = ["dormand", "exponential"]
EYE = np.eye(3)
every_method = pytest.mark.parametrize("method", METHODS, ids=NAMES)


def wall(law=None, mu=0.25, k_t=3e5, mass=0.08):
    """A mass in the plane that meets a wall in its first coordinate, at rest on 1 mm from it."""
    law = KelvinVoigt(4e5, 0.0) if law is None else law
    contact = Contact([-1.0, 0.0], law, map="oblique", tangent=[0.0, 1.0], friction=Friction(mu, k_t))
    return System(mass * np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)), [contact])


def bounce(system, v_t, method, v_n=0.8):
    return integrate(system, [-1e-3, 0.0], [v_n, v_t], 0.004, 1e-4, method)


def disc(law=None, mu=0.25, spin=0.0, springs=0.0, outer=False, turns=True, loads=()):
    """A disc of radius 0.4 m in (around) a circle of 1 m."""
    law = KelvinVoigt(1e4, 0.0) if law is None else law
    own = {"rotation": EYE[2]} if turns else {}
    rub = Friction(mu, 5e3)
    hole = Contact(EYE[:2], law, 1.0, map="annulus", outer=outer, radius=0.4, spin=spin, friction=rub, **own)
    stiff = springs * np.diag([1.0, 1.0, 0.02])
    return System(np.diag([1.0, 1.0, 0.08]), 0.02 * stiff, stiff, [hole], loads)


def by_scipy(normal, growth, start, duration, spin=0.0, outer=False, springs=0.0, mu=0.25, k_t=5e3):
    """(state, names of the segments passed) of the disc under N(δ, δ̇), Ṅ(δ, δ̇, δ̈): one piece after the other."""
    arm, sigma = (-0.4, -1.0) if outer else (0.4, 1.0)
    mass = np.array([1.0, 1.0, 0.08])
    stiff = springs * np.array([1.0, 1.0, 0.02])

    def look(t, y):
        r = np.hypot(y[0], y[1])
        swept = (y[0] * y[4] - y[1] * y[3]) / r**2
        delta, rate = sigma * (r - 1.0), sigma * (y[0] * y[3] + y[1] * y[4]) / r
        return r, delta, rate, np.arctan2(y[1], y[0]) + arm * (y[2] + spin * t), swept + arm * (y[5] + spin)

    def forces(t, y, code, s):
        r, delta, rate, way, _ = look(t, y)
        if code is None:
            return np.zeros(3), 0.0, 0.0
        n = normal(delta, rate)
        tangential = code * mu * n if code else k_t * (np.mod(way - s + np.pi, 2.0 * np.pi) - np.pi)
        e_r, e_t = np.array([y[0], y[1]]) / r, np.array([-y[1], y[0]]) / r
        return np.append(-sigma * n * e_r - tangential / r * e_t, -arm * tangential), n, tangential

    def acceleration(t, y, code, s):
        return (forces(t, y, code, s)[0] - stiff * y[:3] - 0.02 * stiff * y[3:]) / mass

    def margin(t, y, code, s):
        if code is None:
            return -look(t, y)[1]
        n, f = forces(t, y, code, s)[1:]
        if code == 0:
            return mu * n - abs(f)
        r, delta, rate, _, speed = look(t, y)
        a = acceleration(t, y, code, s)
        twice = sigma * (y[3] ** 2 + y[4] ** 2 + y[0] * a[0] + y[1] * a[1] - rate**2) / r
        return code * speed - mu / k_t * growth(delta, rate, twice)

    t, y, code, s, passed = 0.0, np.array(start), None, 0.0, ["open"]
    while t < duration:

        def ends(t, y, code=code, s=s):
            return margin(t, y, code, s)

        def leaves(t, y):
            return look(t, y)[1]

        events = [ends] if code is None else [ends, leaves]
        for event in events:
            event.terminal, event.direction = True, -1.0
        run = solve_ivp(
            lambda t, y, code=code, s=s: np.append(y[3:], acceleration(t, y, code, s)),
            *((t, duration), y, "DOP853"),
            **{"rtol": 1e-13, "atol": 1e-15, "events": events, "max_step": duration if code is None else 1e-4},
        )
        t, y = run.t[-1], run.y[:, -1]
        if run.status == 0:
            break
        _, _, rate, way, speed = look(t, y)
        if code is None:
            code = int(np.sign(speed)) if k_t * abs(speed) > mu * growth(0.0, rate, 0.0) else 0
            s = way
        elif len(run.t_events) > 1 and len(run.t_events[1]):
            code = None
        elif code == 0:
            code = int(np.sign(forces(t, y, code, s)[2]))
        else:
            code, s = 0, way - forces(t, y, code, s)[2] / k_t
        passed.append("open" if code is None else ["stick", "slip+", "slip-"][code])
    return y, passed


LAWS = {
    "linear": (KelvinVoigt(1e4, 0.0), lambda d, v: 1e4 * d, lambda d, v, a: 1e4 * v),
    "hertz": (Hertz(1e5), lambda d, v: 1e5 * max(d, 0.0) ** 1.5, lambda d, v, a: 1.5e5 * np.sqrt(max(d, 0.0)) * v),
}


@every_method
@pytest.mark.parametrize(("v_t", "after"), [(0.1, -0.0865662391654), (0.6, 0.2), (1.5, 1.1)])
def test_an_oblique_impact_sticks_or_slips(method, v_t, after):
    """Slip throughout leaves v_t - μ(1 + e) v_n; a slow one sticks and recoils."""
    run = bounce(wall(), v_t, method)
    np.testing.assert_allclose(run.q_dot[-1], [-0.8, after], rtol=0.0, atol=1e-10)
    assert run.transitions.event.tolist() == (["slip"] if v_t < 0.2 else [])


@every_method
def test_the_log_of_a_slipping_impact(method):
    """N is half a sine: peaks, impulses, the loss and the way of the slider in closed form."""
    run, slow = bounce(wall(), 1.5, method), bounce(wall(), 0.1, method)
    log, peak = run.friction, 0.8 * np.sqrt(0.08 * 4e5)
    assert log.peak_friction[0] == pytest.approx(0.25 * peak, rel=1e-9)
    assert log.impulse[0] == pytest.approx(0.25 * 2.0 * 0.08 * 0.8, rel=1e-9)
    assert log.energy_loss[0] == pytest.approx(0.04 * (1.5**2 - 1.1**2), rel=1e-9)
    assert log.slip[0] == pytest.approx(0.5 * (1.5 + 1.1) * np.pi * np.sqrt(0.08 / 4e5), rel=1e-9)
    assert (log.speed_in[0], log.speed_out[0]) == pytest.approx((1.5, 1.1), rel=1e-9)
    assert np.isnan(log.angle_in[0])
    assert 0.0 < slow.friction.slip[0] < 0.1 * 1.4e-3
    taken = 0.04 * (0.1**2 - slow.q_dot[-1, 1] ** 2)
    assert slow.friction.energy_loss[0] == pytest.approx(taken, rel=1e-8)
    assert (slow.losses.friction[0], slow.losses.impact[0]) == pytest.approx((taken, 0.0), abs=1e-10)


@every_method
def test_a_disc_in_an_annulus(method):
    run = integrate(disc(), [0.5, 0.0, 0.0], [0.2, 0.8, -1.5], 4.0, 0.01, method)
    expected = [-0.31970493889, -0.41690718554, -4.7094931086, 0.49085306607, -0.67495046553, -1.3978741619]
    np.testing.assert_allclose(run.end[:6], expected, rtol=0.0, atol=1e-9)
    assert run.transitions.event.tolist() == ["slip", "slip"]
    assert np.sign(run.transitions.force).tolist() == [1.0, -1.0]
    (x, y, _), (v, w, turning) = run.q.T, run.q_dot.T
    apart = np.hypot(x, y) < 1.0
    assert np.ptp((x * w - y * v - 0.08 / 0.4 * turning)[apart]) < 1e-10  # L/c - Jφ'/R is kept
    assert abs(run.energy.residual).max() < 1e-9
    energy = 0.5 * np.sum([1.0, 1.0, 0.08] * run.q_dot**2, axis=1)
    assert run.losses.friction[0] == pytest.approx(energy[0] - energy[-1], rel=1e-7)
    np.testing.assert_allclose(run.friction.angle_in, [0.81937302, 2.71323681], atol=1e-7)


@cache
def driven(name, outer):
    """Start and options of a disc on springs, with spin; its end and segments by SciPy."""
    _, normal, growth = LAWS[name]
    start = [-1.5, 0.3, 0.0, 4.0, 0.9, -3.0] if outer else [0.5, 0.1, 0.0, 4.5, 1.8, -1.5]
    options = {"spin": 6.0, "springs": 20.0, "outer": outer}
    return start, options, *by_scipy(normal, growth, start, 1.2, **options)


@every_method
@pytest.mark.parametrize(("name", "outer"), [("linear", True), ("hertz", False)])
def test_a_driven_disc_follows_scipy(method, name, outer):
    """Some ten segments."""
    start, options, expected, passed = driven(name, outer)
    law = LAWS[name][0]
    run = integrate(disc(law, **options), start[:3], start[3:], 1.2, 0.01, method)
    assert len(passed) > 4
    assert len(run.contacts.t_in) == passed.count("open") - (passed[-1] == "open") + (passed[-1] != "open")
    np.testing.assert_allclose(run.end[:6], expected, rtol=0.0, atol=2e-9)
    assert abs(run.energy.residual).max() < 1e-8
    assert abs(run.energy.spin[-1]) > 1e-3
    assert run.losses.spin[0] == pytest.approx(run.energy.spin[-1], rel=1e-12)


def shapes(beta, x):
    """(2,) clamped-free shapes of unit modal mass at x of a length of 1."""
    ratio = (np.cosh(beta) + np.cos(beta)) / (np.sinh(beta) + np.sin(beta))
    return np.cosh(beta * x) - np.cos(beta * x) - ratio * (np.sinh(beta * x) - np.sin(beta * x))


@every_method
def test_a_tube_in_a_hole(method):
    """Two modes a plane, a hole at the tip, forces at mid-span; the figures are of SciPy's DOP853."""
    beta, none = np.array([1.8751040687119611, 4.694091132974175]), np.zeros(2)
    tip, mid = shapes(beta, 1.0), shapes(beta, 0.5)
    rows = np.array([np.append(tip, none), np.append(none, tip)])
    hole = Contact(rows, KelvinVoigt(300.0, 0.0), 0.012, map="annulus", friction=Friction(0.2, 240.0))
    loads = [(np.append(mid, none), Tone(-1.5j, 3.2)), (np.append(none, mid), Tone(1.05, 3.9))]
    run = integrate(System.modal(np.tile(beta**2, 2), 0.01, [hole], loads), [0.0] * 4, [0.0] * 4, 0.6, method=method)
    np.testing.assert_allclose(rows @ run.q[-1], [9.106191672804725e-3, -5.789123389204e-3], atol=1e-11)
    np.testing.assert_allclose(rows @ run.q_dot[-1], [0.11648029303735, -0.15887146589979], atol=1e-10)
    np.testing.assert_allclose(run.contacts.t_in, [0.17926830372536, 0.31542356791999, 0.444297128478], atol=1e-10)


@every_method
@pytest.mark.parametrize("seed", range(4))
def test_random_discs_follow_scipy(method, seed):
    rng = np.random.default_rng(seed)
    name, outer = ["linear", "hertz"][seed % 2], bool(seed // 2)
    law, normal, growth = LAWS[name]
    angle, r = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(1.05, 1.3) if outer else rng.uniform(0.0, 0.9)
    start = [r * np.cos(angle), r * np.sin(angle), 0.0, *(rng.normal(size=3) * [3.0, 3.0, 4.0])]
    options = {"spin": 5.0 * rng.normal(), "springs": 20.0, "outer": outer, "mu": rng.choice([0.05, 0.8])}
    expected, _ = by_scipy(normal, growth, start, 0.5, **options)
    run = integrate(disc(law, **options), start[:3], start[3:], 0.5, method=method)
    np.testing.assert_allclose(run.end[:6], expected, rtol=0.0, atol=1e-8)


@every_method
def test_without_friction_coefficient_nothing_rubs(method):
    start = [0.5, 0.1, 0.0], [2.0, 0.8, -1.5]
    plain = Contact(EYE[:2], Hertz(1e5), 1.0, map="annulus")
    one = integrate(disc(Hertz(1e5), mu=0.0), *start, 2.0, method=method)
    other = integrate(System(np.diag([1.0, 1.0, 0.08]), 0.0 * EYE, 0.0 * EYE, [plain]), *start, 2.0, method=method)
    np.testing.assert_allclose(one.end[:6], other.end, rtol=0.0, atol=1e-9)
    assert one.friction.peak_friction.max() == 0.0


@every_method
def test_a_planar_start_keeps_to_its_line(method):
    """Nothing is drawn where nothing moves sideways."""
    run = integrate(disc(Hertz(1e5)), [0.3, 0.4, 0.0], [1.2, 1.6, 0.0], 2.0, method=method)
    assert len(run.contacts.t_in) > 1
    assert abs(run.q[-1, 0] * 0.8 - run.q[-1, 1] * 0.6) < 1e-10
    assert abs(run.q[-1, 2]) < 1e-10


@every_method
def test_a_run_goes_on_from_the_middle_of_a_stick(method):
    system, end = wall(), 0.002
    whole = bounce(system, 0.1, method)
    part = integrate(system, [-1e-3, 0.0], [0.8, 0.1], end, method=method)
    assert part.memory[0][0] == 0.0
    rest = integrate(system, part.q[-1], part.q_dot[-1], 0.004 - end, method=method, memory=part.memory)
    np.testing.assert_allclose(rest.end[:4], whole.end[:4], rtol=0.0, atol=1e-10)
    both = part.losses.friction[0] + rest.losses.friction[0], part.losses.slip[0] + rest.losses.slip[0]
    assert both == pytest.approx((whole.losses.friction[0], whole.losses.slip[0]), rel=1e-7)
    assert np.isnan(part.friction.t_out).tolist() == [True]


@pytest.mark.parametrize("method", [Exponential(1e-8), Exponential(1e-12), SHARP])
def test_the_last_slip_before_an_opening_is_one(method):
    """Under N ~ δ^{6/5} a slip sticks 3e-13 s before the opening, where N is 1e-10 of its peak, and slips again."""
    run = integrate(wall(Hertz(4e6, exponent=1.2)), [-1e-3, 0.0], [0.8, 0.025], 0.006, 1e-4, method)
    assert run.transitions.event.tolist() == ["stick", "slip", "stick", "slip"]
    before = run.contacts.t_out[0] - run.transitions.t
    np.testing.assert_allclose(before, [1.0299075e-3, 3.668486e-5, 2.7209e-13, 2.955e-14], rtol=1e-3)


@pytest.mark.parametrize(("mu", "k", "v_t"), [(0.3, (300.0, 60.0), 3.0), (0.5, (400.0, 100.0), 3.0)])
def test_forces_in_another_unit_give_the_same_bits(mu, k, v_t):
    """Margins of stick, N, and of slip, m/s, each have their own rounding: slips before an opening stay, none comes."""

    def bounced(unit):
        law, friction = Hertz(unit * 1e4, 2.0), Friction(mu, unit * 1e3)
        wall = Contact([-1.0, 0.0], law, map="oblique", tangent=[0.0, 1.0], friction=friction)
        ball = System(unit * np.eye(2), np.zeros((2, 2)), unit * np.diag(k), [wall])
        return integrate(ball, [-0.05, 0.0], [2.0, v_t], 1.0)

    here = bounced(1.0)
    for unit in (2.0**30, 2.0**-30):
        there = bounced(unit)
        assert np.array_equal(there.q, here.q)
        assert np.array_equal(there.transitions.t, here.transitions.t)
        assert list(there.transitions.event) == list(here.transitions.event)


@every_method
def test_a_start_where_the_law_pulls_is_free_whatever_is_latched(method):
    """N = 4 N - 40 N, cut at zero: a spring that was drawn before holds nothing."""
    system, start = wall(KelvinVoigt(4e5, 50.0, clamp=True)), ([1e-5, 0.0], [-0.8, 0.1])
    free, latched = (
        integrate(system, *start, 0.004, method=method, memory=memory) for memory in (None, [np.array([0.0, -1e-5])])
    )
    assert latched.end.tolist() == free.end.tolist()
    assert len(latched.transitions) == 0


@every_method
@pytest.mark.parametrize("cut", [0.0014, 0.0017, 0.002])
def test_the_log_of_a_contact_cut_in_slip_or_stick(method, cut):
    """Loss and slip of both parts add up to those of the whole contact: what the spring holds belongs to neither."""
    system, start = wall(), ([-1e-3, 0.0], [0.8, 0.6])
    whole = integrate(system, *start, 0.004, method=method)
    first = integrate(system, *start, cut, method=method)
    rest = integrate(system, first.q[-1], first.q_dot[-1], 0.004 - cut, method=method, memory=first.memory)
    assert np.isnan(first.friction.t_out[0])
    for name, size in (("energy_loss", 0.02), ("slip", 1e-4), ("impulse", 0.01)):
        total = sum(getattr(part.friction, name)[0] for part in (first, rest))
        assert total == pytest.approx(getattr(whole.friction, name)[0], abs=1e-8 * size), name
    for part in (first, rest):
        assert part.friction.energy_loss[0] == pytest.approx(part.losses.friction[0], abs=1e-10)
        assert part.friction.slip[0] == pytest.approx(part.losses.slip[0], abs=1e-12)


@every_method
def test_a_slip_from_the_entry_sticks_within_the_first_step(method):
    """N = 0 at the entry, and Ṅ begins below what slip needs and grows; times are of `DormandPrince`."""
    run = bounce(wall(Polynomial([4e5, 0.0, 4e12])), 0.27, method)
    assert run.transitions.event.tolist() == ["stick", "slip"]
    apart = run.transitions.t - run.contacts.t_in[0]
    np.testing.assert_allclose(apart, [2.59798711e-5, 7.30534583e-4], rtol=0.0, atol=1e-11)


@every_method
@pytest.mark.parametrize("v_t", [0.1, 0.4, 1.5])
def test_a_force_that_grows_without_bound_begins_in_stick(method, v_t):
    """A dashpot of δ^{1/4} has Ṅ = ∞ at the entry."""
    run = bounce(wall(Viscoelastic(1e7, 500.0)), v_t, method)
    assert run.transitions.event.tolist() == ["slip", "free"]  # the dashpot pulls as it opens


@every_method
@pytest.mark.parametrize(("k_t", "v_t"), [(2e5, 0.15), (2e5, 0.2), (3e5, 0.2)])
def test_the_peak_of_friction_just_before_a_slip(method, k_t, v_t):
    """In stick the mass swings on the spring, |F_t| <= v_t √(k_t m), and slips soon after the peak."""
    run = bounce(wall(k_t=k_t), v_t, replace(method, rtol=1e-8))
    assert run.friction.peak_friction[0] == pytest.approx(v_t * np.sqrt(k_t * 0.08), rel=1e-7)


@every_method
def test_a_spring_drawn_beyond_the_limit_at_the_start_gives_no_peak(method):
    """It slips at once: |F_t| is largest at the start, μN = 0.25 · 4e5 · 1e-4 = 10 N, not k_t s = 30 N."""
    start = [1e-4, 0.0], [-0.8, 0.1]
    run = integrate(wall(Hertz(4e5, 1.0)), *start, 0.001, method=method, memory=[np.array([0.0, -1e-4])])
    assert run.transitions.event[0] == "slip"
    assert run.friction.peak_friction[0] == pytest.approx(10.0, rel=1e-10)


def test_the_peak_of_friction_in_a_landing_on_the_way_out():
    """In stick |F_t| <= v_t √(k_t m), reached about where a linear law with a knot that changes nothing passes it."""
    law = PiecewiseLinear([4e5, 4e5], [2e-4])
    for after in np.linspace(0.74, 0.86, 30):  # peak, in units of the contact's duration
        k_t = 4e5 / (2.0 * after) ** 2
        run = bounce(wall(law, 5.0, k_t), 0.2, Exponential(1e-8))
        assert run.friction.peak_friction[0] == pytest.approx(0.2 * np.sqrt(k_t * 0.08), rel=1e-8)


@every_method
def test_a_slip_at_entry_far_shorter_than_any_step(method):
    """Under δ^1.2 it ends where k_t ξ̇ = μ N_δ v, here after 6e-13 s of a contact of 4e-5 s."""
    friction = Friction(0.86, 1.5e9)
    stop = Contact([-1.0, 0.0], Hertz(9e10, exponent=1.2), map="oblique", tangent=[0.0, 1.0], friction=friction)
    system = System(EYE[:2, :2], 0.0 * EYE[:2, :2], 0.0 * EYE[:2, :2], [stop])
    run = integrate(system, [-1e-5, 0.0], [1.15, 0.26], 1e-4, method=method)
    assert run.transitions.event.tolist() == ["stick", "slip"]
    after = (1.5e9 * 0.26 / (1.2 * 0.86 * 9e10 * 1.15)) ** 5 / 1.15
    assert run.transitions.t[0] - run.contacts.t_in[0] == pytest.approx(after, rel=1e-4)
    assert run.q_dot[-1, 1] == pytest.approx(0.0827468039, abs=1e-8)  # of DOP853 with events


@pytest.mark.parametrize(("k_t", "mu"), [(1.8e14, 1e-3), (1e15, 1e-3), (1.8e15, 1e-2), (5.6e15, 1e-2)])
def test_a_slip_within_a_swing_as_short_as_the_shortest_step(k_t, mu):
    """Its spring swings in 1e-9 s, as long as the shortest step of a free mass, and the slip begins long before."""
    system = replace(wall(KelvinVoigt(1e6, 5.0), mu, k_t, mass=1e-3), loads=[([1.0, 0.2], fb.Harmonic(1.0, 0.0))])
    start = [-1e-9, 0.0], [0.1, 0.01], 1e-3
    run, exact = (integrate(system, *start, method=method) for method in (Exponential(1e-9), SHARP))
    assert run.transitions.event.tolist() == exact.transitions.event.tolist()
    np.testing.assert_allclose(run.q_dot[-1], exact.q_dot[-1], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(run.losses.loss, exact.losses.loss, rtol=1e-7)


@pytest.mark.parametrize("turning", [-0.00764, -0.00722, -0.00714, -0.0067])
def test_slips_within_the_rounding_of_an_indentation(turning):
    """Under δ^1.2 one at entry ends at 1e-23 m, and before the opening others begin at 1e-16 m and less."""
    rows = np.array([[-0.788, 0.0, 0.0], [0.0, 0.8475, 0.0]])
    rub = {"friction": Friction(0.11, 6.76e7), "rotation": [0.0, 0.0, 84752.0], "radius": 1.12e-5, "spin": 935.6}
    hole = Contact(rows, Hertz(4.8e10, exponent=1.2), 1.445e-6, map="annulus", centre=(1.68e-7, 2.51e-7), **rub)
    system = System(EYE, 0.0 * EYE, 0.0 * EYE, [hole])
    start = [-1.0048e-06, 8.4061e-07, -4.825e-05], [-0.010063, -0.0031601, turning]
    exact, run = (integrate(system, *start, 3e-4, method=method) for method in (SHARP, Exponential(1e-10)))
    np.testing.assert_allclose(run.contacts.t_out, exact.contacts.t_out, rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(run.q_dot[-1], exact.q_dot[-1], rtol=0.0, atol=1e-11)


@every_method
@pytest.mark.parametrize(
    ("v_t", "mu", "k_t"),
    [(0.0379835, 0.583893, 1347551.0), (-1.139127, 0.90991, 1612806.0), (0.346073, 1.81766, 1229449.0)],
)
def test_stick_and_slip_just_before_a_contact_opens(method, v_t, mu, k_t):
    """At a time τ before it N = K (v τ)^{3/2}: slip against ξ̇ ends at τ_1, the next one begins at τ_1/4, some 1e-10 s.

    With k_t |ξ̇| = 3/2 μ K v^{3/2} √τ_1, and from there on μN = |F_t| where 1 - 3 y² - 2 y³ = 0, y = √(τ/τ_1) = 1/2.
    """
    run = bounce(wall(Hertz(4e8), mu, k_t), v_t, method)
    assert run.transitions.event.tolist()[-2:] == ["stick", "slip"]
    first = (k_t * run.friction.speed_out[0] / (1.5 * mu * 4e8 * 0.8**1.5)) ** 2
    assert first < 4e-9
    left = run.contacts.t_out[0] - run.transitions.t[-2:]
    np.testing.assert_allclose(left / first, [1.0, 0.25], rtol=0.0, atol=1e-5)


@pytest.mark.parametrize(
    ("mass", "away", "v_n", "v_t", "resolved"),
    [
        (0.03984613235319847, 0.018520297776793117, 0.10889008739605581, -5.214269732248776e-06, True),
        (0.016336069637335547, 0.0013169162407835494, 0.8566647772546203, 4.618849945380157e-06, False),
    ],
)
def test_stick_and_slip_within_a_millionth_of_the_last_step(mass, away, v_n, v_t, resolved):
    """The same behind a dashpot of approach: τ_1 is 3e-11 s, or 3e-14 s, where the slip after it is rounding."""
    K, mu, k_t = 45830807.4, 0.764, 201351.7
    system = wall(Viscoelastic(K, 6788.7, approach_only=True), mu, k_t, mass)
    run = integrate(system, [-away, 0.0], [v_n, v_t], away / v_n + 0.01, method=SHARP)
    assert run.transitions.event.tolist() == ["slip", "stick", "slip"][: 3 if resolved else 2]
    first = (k_t * run.friction.speed_out[0] / (1.5 * mu * K * run.contacts.speed_out[0] ** 1.5)) ** 2
    left = run.contacts.t_out[0] - run.transitions.t[1:]
    np.testing.assert_allclose(left, first * np.array([1.0, 0.25])[: len(left)], rtol=0.0, atol=1e-3 * first + 1e-16)


@every_method
@pytest.mark.parametrize("after", [2e-10, 6e-10])
def test_a_slip_just_after_an_entry(method, after):
    """It begins where k_t ξ̇ t = μ (C δ^{1/4} v + K δ^{3/2}), δ = v t, within the shortest step of `Exponential`."""
    delta = 0.8 * after
    damping = (3e5 * 1.5 * after / 0.2 - 4e8 * delta**1.5) / (delta**0.25 * 0.8)
    run = bounce(wall(Viscoelastic(4e8, damping), 0.2, 3e5), 1.5, method)
    assert run.transitions.event[0] == "slip"
    assert run.transitions.t[0] - run.contacts.t_in[0] == pytest.approx(after, rel=1e-5)


@every_method
@pytest.mark.parametrize("clamp", [False, True])
@pytest.mark.parametrize("v_t", [0.1, 1.5])
def test_a_slider_is_free_where_its_law_pulls(method, clamp, v_t):
    """Or is cut: F_t is 0 from there on, and the way of the slider ends, ξ - F_t/k_t from slip to there."""
    run = bounce(wall(KelvinVoigt(4e5, 60.0, clamp=clamp)), v_t, method)
    assert run.transitions.event.tolist() == ["slip", "free"]
    (begun, free), way = run.transitions.force, np.diff(run.transitions.delta)[0]
    assert free == 0.0
    assert np.sign(begun) == np.copysign(1.0, free) == 1.0
    assert run.transitions.t[1] < run.contacts.t_out[0] - 1e-5
    assert run.friction.slip[0] == pytest.approx(way + begun / 3e5, rel=1e-8)


def returned(slopes, knot, damping, mu, k_t, start, duration, mass=0.08, steps=40_000):
    """Tangential velocity behind a wall whose dashpot changes at a knot: small steps, F_t cut at μN after each."""
    h, (x, xi), (v, w) = duration / steps, *start
    drawn, bent = 0.0, slopes[0] * knot
    for _ in range(steps):
        deep = x > knot
        normal = (bent + slopes[1] * (x - knot) if deep else slopes[0] * x) + damping[deep] * v
        normal = normal if x > 0.0 else 0.0
        limit = mu * max(normal, 0.0) / k_t
        drawn = min(max(drawn + h * w, -limit), limit)
        v, w = v - h * normal / mass, w - h * k_t * drawn / mass
        x, xi = x + h * v, xi + h * w
    return w


JUMPS = {
    "a slip is held where N jumps up": ([4e5, 4e5], [0.0, 20.0], 0.2, ["slip", "stick", "slip"]),
    "free, it sticks where N jumps up": ([4e5, 8e5], [100.0, 250.0], 0.5, ["slip", "free", "stick", "slip", "free"]),
    "it slips where N jumps down": ([4e5, 4e5], [150.0, 5.0], 0.5, ["slip", "free"]),
}


@every_method
@pytest.mark.parametrize("name", JUMPS)
def test_a_slider_where_the_force_jumps_on_a_knot(name, method):
    """Its spring keeps what it holds up to the new limit."""
    slopes, damping, v_t, events = JUMPS[name]
    system = wall(PiecewiseLinear(slopes, [1e-4], damping=damping))
    run = integrate(system, [-1e-4, 0.0], [0.8, v_t], 0.0022, 1e-5, method)
    assert run.transitions.event.tolist() == events
    expected = returned(slopes, 1e-4, damping, 0.25, 3e5, ([-1e-4, 0.0], [0.8, v_t]), 0.0022)
    assert run.q_dot[-1, 1] == pytest.approx(expected, abs=1e-3 * v_t)
    assert abs(run.energy.residual).max() < 1e-9 * run.energy.initial


def pulled(clamp, amplitude=400.0):
    """A mass on a dashpot stronger than its spring, shaken so that N falls to zero and comes back within a contact."""
    law, friction = KelvinVoigt(4e5, 300.0, clamp=clamp), Friction(0.25, 3e5)
    stop = Contact([-1.0, 0.0], law, map="oblique", tangent=[0.0, 1.0], friction=friction)
    loads = [(EYE[0, :2], Tone(amplitude, 9e3)), (150.0 * EYE[0, :2], np.ones_like)]
    return System(0.08 * EYE[:2, :2], 0.0 * EYE[:2, :2], 0.0 * EYE[:2, :2], [stop], loads)


@pytest.mark.parametrize("clamp", [False, True])
def test_a_slider_begins_anew_where_its_law_pushes_again(clamp):
    start = [-1e-4, 0.0], [0.3, 0.3], 0.004
    one, other = (integrate(pulled(clamp), *start, method=method) for method in METHODS)
    assert one.transitions.event.tolist().count("free") == 4
    assert one.transitions.event.tolist() == other.transitions.event.tolist()
    np.testing.assert_allclose(one.transitions.t, other.transitions.t, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(one.end[:4], other.end[:4], rtol=0.0, atol=1e-10)
    assert one.friction.slip[0] == pytest.approx(other.friction.slip[0], rel=1e-8)


@every_method
@pytest.mark.parametrize(
    "law", [KelvinVoigt(4e5, 60.0), Hysteretic(1e7, 0.5), Viscoelastic(1e7, 500.0), PiecewiseLinear([2e5, 8e5], [1e-4])]
)
def test_energy_balances_with_dashpots_and_knots(method, law):
    """A dashpot pulls as it opens, and the friction is 0 there."""
    for v_t in (0.1, 0.4, 1.5):
        run = bounce(wall(law), v_t, method)
        assert len(run.contacts.t_out) == 1
        assert abs(run.energy.residual).max() < 1e-8
        gone = 0.04 * (0.8**2 + v_t**2 - np.sum(run.q_dot[-1] ** 2))
        assert run.losses.loss[0] == pytest.approx(gone, rel=1e-6)
        assert run.losses.friction[0] > 0.0


def test_a_spring_that_is_drawn_by_half_a_turn_is_refused():
    """ξ - s is known up to whole turns: beyond half of one the force would jump."""
    options = {"map": "annulus", "friction": Friction(5.0, 1e4), "radius": 0.01, "spin": 100.0}
    shaft = Contact(EYE[:2, :2], KelvinVoigt(1e6, 0.0), 1e-3, **options)
    none = 0.0 * EYE[:2, :2]
    system = System(10.0 * EYE[:2, :2], none, none, [shaft], [([100.0, 0.0], np.ones_like)])
    said = r"friction of contact 0 came to \d+\.\d+ N, of 29\.85 N at most: .* drawn by half a turn"  # 0.95 k_t π c
    with pytest.raises(SolverError, match=said):
        integrate(system, [1.1e-3, 0.0], [0.0, 0.0], 0.02)


@every_method
def test_a_contact_that_opens_while_sliding_back_has_stuck_before(method):
    """A nonlinear wall: the spring has recoiled as N falls to zero, and turns the slip round before the exit."""
    run = bounce(wall(Polynomial([0.0, 4e9]), mu=0.31, k_t=3e5), 0.25, method, v_n=0.8)
    events = run.transitions.event.tolist()
    slips = np.sign(run.transitions.force[run.transitions.event == "slip"])
    assert events[-1] == "slip"
    assert np.sign(run.friction.speed_out[0]) == slips[-1]


def test_a_rub_slips_all_the_way():
    """A place held off the centre by a load, driven by the spin: slip for ever, the way of the slider is R Ω t."""
    system = disc(spin=50.0, springs=1e4, turns=False, loads=[(3e4 * EYE[0], np.ones_like)])
    start = np.array([1.9, 0.0, 0.0])
    run = integrate(system, start, np.zeros(3), 0.5, method=SHARP)
    assert len(run.transitions) < 20
    assert run.losses.slip[0] == pytest.approx(0.4 * 50.0 * 0.5, rel=0.1)
    assert run.losses.spin[0] > 0.0
    assert run.losses.friction[0] > 0.5 * run.losses.spin[0]


BAD = {"law": Hertz(1e6), "friction": Friction(0.3, 1e5)}

test_bad_oblique_contacts_are_refused = refused_by(
    lambda options: Contact(**{"direction": [-1.0, 0.0], "tangent": [0.0, 1.0], "map": "oblique", **BAD, **options}),
    ({"friction": None}, 'map="oblique" is that of friction'),
    ({"tangent": None}, "needs tangent="),
    ({"tangent": [-2.0, 0.0]}, "must not lie along its direction"),
    ({"tangent": [0.0, 1.0, 0.0]}, "finite row of 2 numbers"),
    ({"tangent": [0.0, 0.0]}, "not all 0"),
    ({"map": "line"}, 'belongs to map="oblique"'),
    ({"map": "line", "tangent": None}, 'needs map="oblique" and tangent='),
    ({"spin": 3.0}, 'spin of a Contact belongs to map="annulus"'),
    ({"law": Jenkins(1e3, 1.0), "always": True}, "without memory"),
    ({"friction": 0.3}, "must be a Friction"),
    error=(ValueError, TypeError),
)


test_bad_annuli_with_friction_are_refused = refused_by(
    lambda options: Contact(**{"direction": EYE[:2], "gap": 1e-3, "map": "annulus", **BAD, **options}),
    ({"spin": 3.0}, "radius .* is missing"),
    ({"rotation": EYE[2]}, "radius .* is missing"),
    ({"radius": 0.0}, "positive and finite"),
    ({"radius": 0.1, "spin": np.nan}, "must be finite"),
    ({"radius": 0.1, "friction": None}, "with friction"),
    ({"tangent": EYE[2]}, 'belongs to map="oblique"'),
)


test_bad_friction_is_refused = refused(
    (lambda: Friction(-0.1, 1e5), "mu of Friction must be finite and >= 0"),
    (lambda: Friction(0.1, 0.0), "stiffness of Friction must be finite and > 0"),
    (lambda: Friction(0.1, np.inf), "stiffness of Friction"),
    (lambda: Friction(0.1), "needs stiffness"),
    (lambda: Friction("much", 1e5), "must be a number", TypeError),
)


@pytest.mark.parametrize("method", [RK4(1e-4, 1e-5), CentralDifference(1e-4)])
def test_other_methods_refuse(method):
    with pytest.raises(ValueError, match="takes contacts without friction, and contact 0 has some"):
        integrate(wall(), [0.0, 0.0], [1.0, 0.0], 1.0, method=method)


def test_a_whirl_without_loads_is_not_periodic_and_that_is_said():
    with pytest.raises(OrbitError, match="relative periodic"):
        orbit(disc(turns=False), 1.3, np.array([0.9, 0.0, 0.0, 0.0, 4.0, 0.0]))


@every_method
@pytest.mark.parametrize("side", [2.0, -2.0, 0.9])
def test_a_mass_pressed_and_pushed_from_rest_on_the_surface_slips_at_once(method, side):
    """x = F (1 - cos ωt)/k, w = (S - μF) t²/2 + μF (1 - cos ωt)/(m ω²): no speed tells the way at first."""
    m, k, mu, F = 0.08, 4e5, 0.25, 3.0
    omega, way = np.sqrt(k / m), np.sign(side)
    pressed = replace(wall().contacts[0], direction=[-1.0, 0.0], friction=Friction(mu, 10.0 * k))
    system = System(m * np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)), [pressed], [([F, side], Tone(1.0, 0.0))])
    run = integrate(system, [0.0, 0.0], [0.0, 0.0], 2.0 / omega, method=method)
    x = F / k * (1.0 - np.cos(2.0))
    w = (side - way * mu * F) / m * (2.0 / omega) ** 2 / 2.0 + way * mu * x
    np.testing.assert_allclose(run.q[-1], [x, w], rtol=1e-8)
    assert len(run.contacts) == 1


def test_what_rests_beside_a_hole_is_an_orbit():
    found = orbit(disc(springs=50.0), 1.3)
    assert found.stable
    assert not found.state.any()


def test_many_starts_are_single_runs_bit_for_bit():
    """Also what is latched begins anew in each."""
    system, speeds = wall(Hertz(1e7)), np.array([[0.8, 0.1], [0.8, 1.5], [0.3, 0.4]])
    many = integrate_many(system, np.tile([-1e-3, 0.0], (3, 1)), speeds, 0.006)
    for i, speed in enumerate(speeds):
        one = integrate(system, [-1e-3, 0.0], speed, 0.006)
        assert many.q[i].tolist() == one.q[-1].tolist()
        assert many.q_dot[i].tolist() == one.q_dot[-1].tolist()


def test_a_border_takes_few_law_values():
    """140 more than the contact without friction: a step that crosses it, a landing, the step after it."""
    runs = [integrate(wall(Hertz(1e7), mu, 8e6), [-1e-3, 0.0], [0.8, v], 0.006) for mu in (0.0, 0.4) for v in TILTS]
    without, rubs = runs[: len(TILTS)], runs[len(TILTS) :]
    borders = sum(len(run.transitions.t) for run in rubs)
    assert borders > 2 * len(rubs)
    assert sum(run.cost.law_calls for run in rubs) < sum(run.cost.law_calls for run in without) + 155 * borders


@kernel
def latched_angle(slider, along, across, u, w):
    """Angle of (u, w), measured from another direction."""
    latch_angle(slider, along, across)
    return angle_at(slider, u, w)


def test_angles_from_a_latched_direction_are_those_of_the_arctangent():
    """Near it by a series, else by the arctangent, both to rounding, up to whole turns."""
    rng, slider = np.random.default_rng(1), np.zeros(19)
    for near in (1e-9, 1e-3, 0.09, 0.11, 3.0):
        for at, off in zip(rng.uniform(-np.pi, np.pi, 50), near * rng.uniform(-1.0, 1.0, 50), strict=True):
            u, w = 0.7 * np.cos(at + off), 0.7 * np.sin(at + off)
            found = latched_angle(slider, 0.3 * np.cos(at), 0.3 * np.sin(at), u, w) - np.arctan2(w, u)
            assert abs(np.remainder(found + np.pi, 2.0 * np.pi) - np.pi) < 2e-15


@every_method
@pytest.mark.parametrize(
    ("law", "mu", "k_t", "v_t", "events"),
    [
        (Viscoelastic(3.6e7, 2500.0, approach_only=True), 0.9, 1.2e6, 0.33, ["slip", "stick", "slip"]),
        (Viscoelastic(2.5e7, 18000.0, approach_only=True), 0.9, 6e4, 0.53, ["slip"]),
    ],
    ids=["sticks", "slips on"],
)
def test_a_slider_where_damping_of_the_approach_ends(method, law, mu, k_t, v_t, events):
    """At δ̇ = 0 N_δ̇ falls to zero: the slider's own speed |ξ̇| - μṄ/k_t jumps through zero there, or stays above it."""
    system = wall(law, mu, k_t)
    run = bounce(system, v_t, method)
    assert run.transitions.event.tolist() == events
    if "stick" in events:  # just where the mass is deepest
        deepest = integrate(system, [-1e-3, 0.0], [0.8, v_t], run.transitions.t[1], method=method)
        assert abs(deepest.q_dot[-1, 0]) < 1e-9


@pytest.mark.parametrize("v_t", [0.2, 0.22, 0.5, 0.58])
def test_borders_are_met_where_dashpots_couple_rigid_motions(v_t):
    """Blocks of such motions read δ of p and of v, which cancel: rounding of v is no error of δ."""
    coupled = replace(wall(mu=0.5, k_t=1e6), C=np.array([[1.0, -0.9], [-0.9, 0.9]]))
    exact, run = (bounce(coupled, v_t, method).transitions for method in METHODS)
    assert run.event.tolist() == exact.event.tolist() == ["stick", "slip"]
    np.testing.assert_allclose(run.t, exact.t, rtol=0.0, atol=1e-11)


@pytest.mark.parametrize("rtol", [1e-6, 1e-7, 1e-8, 1e-10])
def test_a_stick_before_an_opening_lasts_as_long_as_that_of_a_second_method(rtol):
    """A stick begins where a slip ends, with a margin of zero that rises; it slips again just before it opens."""
    law = Hysteretic(1e11, damping_factor=0.86, exponent=1.5, entry_rate_floor=1.2e-5)
    row, across = np.array([-1.19, -0.31]), np.array([0.31, -1.19])
    contact = Contact(row, law, map="oblique", tangent=across, friction=Friction(1.95, 1.6e7))
    tones = Tone(1.0, 41.4), Tone(1j, 41.4), Tone(1.0, 0.0)
    loads = zip([[0.25, -0.24], [-0.23, -0.73], [0.028, 0.052]], tones, strict=True)
    system = System(np.eye(2), np.diag([19.3, 11.0]), np.diag([7750.0, 4110.0]), [contact], list(loads))
    found, other = (
        integrate(system, [0.0, 0.0], [0.0, 0.0], 0.6, method=method).transitions
        for method in (Exponential(rtol), DormandPrince(1e-10))
    )
    later, same = found.t > 1e-3, other.t > 1e-3  # at first it slips for a nanosecond, or not
    assert found.event[later].tolist() == other.event[same].tolist()
    np.testing.assert_allclose(found.t[later], other.t[same], rtol=0.0, atol=10.0 * rtol)


@pytest.mark.parametrize("rtol", [1e-9, 1e-10, 1e-11])
def test_a_slip_that_ends_as_the_force_does_has_taken_its_share_of_the_impulse(rtol):
    """A landing on N = 0 has stages beyond, where F_t = μN stays smooth."""
    law = Viscoelastic(5.65e9, 5.03e4, clamp=True)
    for speed in np.linspace(0.03, 0.06, 8):
        system, start = wall(law, 0.0063, 7.5e6, 1.0), [speed, 0.3 * speed]
        runs = [integrate(system, [-1e-5, 0.0], start, 3e-3, method=method) for method in (Exponential(rtol), SHARP)]
        found, exact = (run.friction.impulse[0] for run in runs)
        assert runs[0].transitions.event.tolist() == ["slip", "free"]
        assert found == pytest.approx(exact, rel=1e-10)


@pytest.mark.parametrize("depth", [2e-5, 2.5e-5, 2.9e-5])
def test_a_slip_under_a_strong_dashpot_ends_in_time(depth):
    """The rate of N has N_δ̇ δ̈, N_δ̇ = 5e7/s: δ̇ to rtol alone does not tell where k_t ξ̇ = μṄ."""
    law = Hysteretic(1.72e13, damping_factor=1.236, exponent=1.5, clamp=True, entry_rate_floor=1e-4)
    row = np.array([0.0055, 0.1393, 0.3674, 0.0095, 0.2426, 0.6398])
    start = np.array([-3.6e-4, -5.42e-5, -4.83e-5, 3.3e-5, 1.56e-4, 1.08e-4]), [0.05, 0.197, -0.048, 0.02, 0.064, 0.012]
    across, friction = np.r_[-row[3:], row[:3]], Friction(0.8675, 4.087e9)
    contact = Contact(row, law, -row @ start[0] - depth, map="oblique", tangent=across, friction=friction)
    K = np.diag([3.03e4, 2.05e6, 6.02e7, 4.63e4, 2.03e6, 2.68e7])
    system = System(np.eye(6), np.zeros((6, 6)), K, [contact])
    exact, run = (integrate(system, *start, 1e-3, method=method) for method in (SHARP, Exponential(1e-7)))
    np.testing.assert_allclose(run.transitions.t, exact.transitions.t, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("rtol", [1e-6, 1e-9, 1e-11])
def test_a_hole_hardly_touched_at_rest_takes_few_steps(rtol):
    """2e-8 m deep at 9 mm, δ and the drawn spring have eight digits: shorter steps do not find more of the forces."""
    start, depth, law = np.array([0.0087, -0.0031]), 2e-8, Hertz(3.2e6) + KelvinVoigt(8.6e4, 45.0)
    away, K = start / np.hypot(*start), np.diag([41.0**2, 51.0**2])
    load = K @ start + away * (3.2e6 * depth**1.5 + 8.6e4 * depth), fb.Harmonic(1.0, 0.0)
    hole = Contact(np.eye(2), law, np.hypot(*start) - depth, map="annulus", friction=Friction(1.0, 2.5e6))
    system = System(np.eye(2), np.diag([25.0, 32.0]), K, [hole], [load])
    assert integrate(system, start, [0, 0], 0.1, method=Exponential(rtol)).cost.steps < 250


@pytest.mark.parametrize(
    ("stiffness", "mu", "k_t", "v_n", "v_t", "push", "rtol"),
    [
        (2528155.5031932, 0.25417813, 75752.24890717775, 0.0646663756922, 0.0007775484294, -9.234541000459, 1.0257e-06),
        (14870280.8325, 0.316066702, 101923.0315556, 0.34710152194, 0.02585238695653, -950.01027109, 5.0858642e-08),
        (3346625.9371046, 0.0723452814, 58109.4711982, 0.0898755814463, 0.00042818153163, -8.210559534, 6.8044302e-08),
    ],
)
def test_a_stick_just_after_an_entry_that_turns_round(stiffness, mu, k_t, v_n, v_t, push, rtol):
    """The polynomial of a margin that N^1.5 and |F_t| = 0 bend began it far below zero, so that it never ended."""
    system = wall(Hertz(stiffness), mu, k_t, mass=1.0)
    pushed = replace(system, loads=[([0.0, 1.0], fb.Harmonic(push, 0.0))])
    start, before = [-1e-5, 0.0], 1e-5 / v_n
    duration = before + 3.2 * (1.25 / stiffness) ** 0.4 * v_n**-0.2
    first, second = (
        integrate(pushed, start, [v_n, v_t - push * before], duration, None, method)
        for method in (Exponential(rtol), SHARP)
    )
    assert first.transitions.event.tolist() == second.transitions.event.tolist()
    np.testing.assert_allclose(first.transitions.t, second.transitions.t, rtol=0.0, atol=1e-5 * duration)
    np.testing.assert_allclose(first.q_dot[-1], second.q_dot[-1], rtol=1e-4)


@pytest.mark.parametrize("v_t", [-0.1280118905217087, -0.128011610206974, -0.12801154888812577])
def test_a_stick_just_before_the_force_falls_to_zero(v_t):
    """Its margin rises by less than its noise before it falls: the slider stuck and slipped at one instant for ever."""
    law, push, v_n = KelvinVoigt(38516.70853165049, 26.079317489340514), 5.542014178595589, 0.1
    system = wall(law, 0.3403823395619191, 56412.948068841135, mass=1.0)
    pushed = replace(system, loads=[([0.0, 1.0], fb.Harmonic(push, 0.0))])
    start = [-1e-6, 0.0], [v_n, v_t], 0.032, None
    first, second = (integrate(pushed, *start, method) for method in (Exponential(1e-9), SHARP))
    assert first.contacts.t_out.shape == second.contacts.t_out.shape == (1,)
    np.testing.assert_allclose(first.q_dot[-1], second.q_dot[-1], rtol=1e-7)
    assert len(first.transitions.t) <= len(second.transitions.t) + 4


@pytest.mark.parametrize(
    ("law", "rtol"), [(KelvinVoigt(1e4, 20.0), 1e-5), (Hertz(1e6), 1e-6)], ids=["dashpot", "hertz"]
)
def test_a_slip_that_creeps_to_rest_goes_on(law, rtol):
    """ξ̇ ~ e^{-0.38t} keeps its sign; by what iterations leave of it the slider stuck and slipped thousands of times."""
    wall = Contact([0.0, 1.0], law, map="oblique", tangent=[1.0, 0.0], friction=Friction(0.02, 1e4))
    loads = [([1.0, 0.0], fb.Harmonic(1.0, 0.0)), ([0.0, -10.0], fb.Harmonic(1.0, 0.0))]
    system = System(np.eye(2), np.diag([3.0, 6.0]), np.diag([1.0, 100.0]), [wall], loads)
    run = integrate(system, [0.0, 0.0], [0.3, 0.0], 150.0, method=Exponential(rtol))
    normal = 10.0 - 100.0 * abs(run.q[-1, 1])
    np.testing.assert_allclose(run.q[-1, 0], 1.0 - 0.02 * normal, rtol=10.0 * rtol)
    assert len(run.transitions.t) <= 4
