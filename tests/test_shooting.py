"""Periodic orbits: against long runs, differences, closed pieces, an elliptic function and harmonic balance."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from differences import end_of, jacobian
from oscillators import Bilinear, Duffing, Tone, from_phase, random_family
from problems import cubic, reference
from refusals import refused_by
from scipy.special import ellipj, ellipk

from contacts import Hertz, Hysteretic, KelvinVoigt, PiecewiseLinear, law
from solvers import Contact, DormandPrince, Exponential, HenonRK2, OrbitError, System, integrate, orbit
from solvers.orbits.open_times import latches, open_intervals
from solvers.problem import ContactLog

OMEGA, ZETA = np.array([109.13, 790.6]), np.array([0.02, 0.01])
PHI, GAMMA = np.array([6.2, -1.9]), np.array([0.16, 0.02])
ELASTIC = PiecewiseLinear([1e5, 4e5], knots=[2e-5])
HYSTERETIC = Hysteretic(2.1e8, damping_factor=0.5625)
STABLE = Bilinear(1.3, zeta=0.1)
UNSTABLE = Bilinear(0.89, zeta=0.05)  # between two period doublings


def beam(law, omega=195.0, n=2, amplitude=40.0, zeta=5.0, phase=0.0, gap=0.0, opposite=None):
    """The paper's modes over a stop, strongly damped; ``phase`` s later."""
    contacts = [Contact(PHI[:n], law, gap)] + ([Contact(-0.8 * PHI[:n], opposite, 3e-5)] if opposite else [])
    tone = Tone(amplitude * np.exp(1j * omega * phase), omega)
    return System.modal(OMEGA[:n], zeta * ZETA[:n], contacts, [(GAMMA[:n], tone)])


def distance(system, x, y):
    """Of two states, relative: positions count with the lowest frequency."""
    scale = np.repeat((math.sqrt(np.diag(system.K)[0]), 1.0), system.size)
    return np.linalg.norm(scale * (x - y)) / np.linalg.norm(scale * y)


def differenced(system, x, duration):
    """Derivative of the state one period later."""
    return jacobian(end_of(system, duration), x, 1.5e-5 * (np.abs(x) + 1e-3 * np.abs(x).max()))


# --- long runs, residuals, derivatives ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    "law", [HYSTERETIC, Hertz(2.1e8), KelvinVoigt(2e5, 30.0), ELASTIC], ids=lambda law: type(law).__name__
)
def test_stable_orbit_is_what_a_long_run_settles_to(law):
    system, period = beam(law, phase=0.01), 2.0 * math.pi / 195.0
    found = orbit(system, period)
    assert found.stable
    assert not found.doubt
    assert len(found.contacts) >= 1
    settled = end_of(system, 100 * period + found.phase)(np.zeros(4))
    assert distance(system, found.state, settled) < 1e-9


@pytest.mark.parametrize("law", [HYSTERETIC, Hertz(2.1e8)], ids=["hysteretic", "hertz"])
def test_orbit_returns_in_an_independent_integrator(law):
    """SciPy's DOP853 and this library's, one period from the state."""
    system, period = beam(law), 2.0 * math.pi / 195.0
    found = orbit(system, period)
    assert found.phase == 0.0
    assert found.residual < 1e-10
    other = end_of(system, period, DormandPrince(rtol=1e-13, atol=1e-18))(found.state)
    assert distance(system, other, found.state) < 1e-9
    again = reference(system, found.state[:2], found.state[2:], period)
    assert distance(system, np.concatenate((again.q[-1], again.q_dot[-1])), found.state) < 1e-9
    np.testing.assert_allclose([c[2] for c in again.contacts], found.contacts.t_out, rtol=1e-7)


@pytest.mark.parametrize("name", ["hysteretic", "hertz", "kelvin-voigt", "elastic", "two stops"])
def test_monodromy_against_differences(name):
    laws = {"hysteretic": HYSTERETIC, "hertz": Hertz(2.1e8), "kelvin-voigt": KelvinVoigt(2e5, 30.0), "elastic": ELASTIC}
    opposite = Hertz(2.1e8) if name == "two stops" else None
    system, period = beam(laws.get(name, HYSTERETIC), opposite=opposite), 2.0 * math.pi / 195.0
    found = orbit(system, period)
    assert found.phase == 0.0
    expected = differenced(system, found.state, period)
    np.testing.assert_allclose(found.monodromy, expected, rtol=0.0, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize(
    ("law", "opposite", "near"),
    [
        (Hertz(2.1e8), None, None),
        (ELASTIC, None, None),
        (Hertz(2.1e8), Hertz(1e8), [7.865e-06, 5.213e-06, 3.871e-03, -1.517e-03]),  # motion from rest is chaotic
        (ELASTIC, Hertz(1e8), [7.201e-06, 4.707e-06, 4.487e-03, -1.738e-03]),
    ],
    ids=["hertz, one stop", "piecewise, one stop", "hertz, two stops", "piecewise, two stops"],
)
def test_elastic_stops_leave_the_volume_to_damping(law, opposite, near):
    system, period = beam(law, opposite=opposite), 2.0 * math.pi / 195.0
    found = orbit(system, period, near)
    assert set(found.contacts.stop) == ({0, 1} if opposite else {0})
    product = np.prod(found.multipliers)
    assert product == pytest.approx(math.exp(-2.0 * np.sum(5.0 * ZETA * OMEGA) * period), rel=1e-8)


# --- closed pieces ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("problem", [STABLE, UNSTABLE, replace(STABLE, gap=0.8), replace(STABLE, gap=-0.5)])
def test_bilinear_orbit_against_closed_pieces(problem):
    found = orbit(problem.system(), problem.period, problem.settled(60))
    start = found.state if found.phase == 0.0 else problem.march(problem.settled(60), problem.period)[0]
    x, monodromy, switches = problem.orbit(start)
    assert found.residual < 1e-10
    entries, exits = (np.sort((t + found.phase) % problem.period) for t in (found.contacts.t_in, found.contacts.t_out))
    np.testing.assert_allclose(np.sort(np.append(entries, exits)), np.sort(switches), rtol=0.0, atol=1e-10)
    there = problem.march(x, found.phase)[0] if found.phase else x
    np.testing.assert_allclose(found.state, there, rtol=0.0, atol=1e-10)
    mine, exact = np.poly(found.monodromy), np.poly(monodromy)
    np.testing.assert_allclose(mine, exact, rtol=0.0, atol=1e-9)
    assert found.stable == (problem is not UNSTABLE)


def test_unstable_orbit_is_left_by_a_run_but_satisfies_the_pieces():
    x, monodromy, _ = UNSTABLE.orbit(UNSTABLE.settled(101))
    found = orbit(UNSTABLE.system(), UNSTABLE.period, x + 1e-3)
    assert np.linalg.eigvals(monodromy).real.min() < -1.1
    assert not found.stable
    assert np.abs(UNSTABLE.march(found.state, UNSTABLE.period)[0] - found.state).max() < 1e-10
    assert np.abs(end_of(UNSTABLE.system(), 120 * UNSTABLE.period)(found.state + 1e-6) - found.state).max() > 1e-2


def test_subharmonic_and_the_same_orbit_over_two_periods():
    period = UNSTABLE.period
    once = orbit(UNSTABLE.system(), period, UNSTABLE.orbit(UNSTABLE.settled(101))[0])
    twice = orbit(UNSTABLE.system(), 2 * period, once.state)
    np.testing.assert_allclose(twice.state, once.state, rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(twice.monodromy, once.monodromy @ once.monodromy, rtol=0.0, atol=1e-9)
    settled = UNSTABLE.settled()
    sub = orbit(UNSTABLE.system(), 2 * period, settled)
    x, monodromy, switches = UNSTABLE.orbit(settled, periods=2)
    assert sub.stable
    assert np.abs(x - once.state).max() > 0.1
    np.testing.assert_allclose(sub.state, x, rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(np.poly(sub.monodromy), np.poly(monodromy), rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(sub.contacts.t_out, switches[1::2], rtol=0.0, atol=1e-10)


def test_permanent_contact_is_linear():
    problem = replace(STABLE, gap=-3.0, amplitude=1e-3)
    found = orbit(problem.system(), problem.period)
    np.testing.assert_allclose(found.state, problem.steady(True, found.phase), rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(found.monodromy, problem.propagator(True, problem.period), rtol=0.0, atol=1e-10)
    assert found.contacts.entry_rate_clipped.all()  # it began before, and its law does not ask how fast
    assert not found.doubt


def test_preloaded_hertz_in_permanent_contact():
    system = beam(Hertz(2.1e8), gap=-2e-4, amplitude=1.0)
    found = orbit(system, 2.0 * math.pi / 195.0, method=Exponential(1e-12))
    settled = end_of(system, 100 * found.period + found.phase)(np.zeros(4))
    assert distance(system, found.state, settled) < 1e-9
    assert np.prod(found.multipliers).real == pytest.approx(math.exp(-10.0 * ZETA @ OMEGA * found.period), rel=1e-8)


# --- shots, phase, symmetry, starts -------------------------------------------------------------------------------


@pytest.mark.parametrize("law", [HYSTERETIC, ELASTIC], ids=["hysteretic", "elastic"])
def test_same_orbit_with_one_two_three_shots(law):
    system, period = beam(law), 2.0 * math.pi / 195.0
    one, *others = (orbit(system, period, shots=count) for count in np.arange(1, 4))
    for other in others:
        assert other.phase == one.phase == 0.0
        assert distance(system, other.state, one.state) < 1e-9
        np.testing.assert_allclose(np.poly(other.monodromy), np.poly(one.monodromy), rtol=0.0, atol=1e-8)
        np.testing.assert_allclose(other.contacts.t_in, one.contacts.t_in, rtol=0.0, atol=1e-10 * period)


def test_phase_when_the_hysteretic_stop_is_closed_at_zero():
    period = 2.0 * math.pi / 195.0
    plain = orbit(beam(HYSTERETIC), period)
    assert plain.phase == 0.0
    middle = 0.5 * (plain.contacts.t_in[0] + plain.contacts.t_out[0])
    shifted = orbit(beam(HYSTERETIC, phase=middle), period)
    assert 0.0 < shifted.phase < period
    same = end_of(beam(HYSTERETIC), middle + shifted.phase)(plain.state)
    assert distance(beam(HYSTERETIC), shifted.state, same) < 1e-9
    np.testing.assert_allclose(np.poly(shifted.monodromy), np.poly(plain.monodromy), rtol=0.0, atol=1e-8)
    times = (shifted.contacts.t_in + shifted.phase + middle) % period
    np.testing.assert_allclose(np.sort(times), np.sort(plain.contacts.t_in), rtol=0.0, atol=1e-9 * period)
    samples = shifted.samples(50)
    np.testing.assert_allclose(samples.q[-1], samples.q[0], rtol=0.0, atol=1e-10 * np.abs(samples.q).max())


def test_two_equal_stops_give_a_symmetric_orbit():
    stops = [Contact([1.0], Hertz(5.0), 0.5), Contact([-1.0], Hertz(5.0), 0.5)]
    system = System.modal([1.0], 0.1, stops, [([1.0], Tone(1.0, 1.3))])
    found = orbit(system, 2.0 * math.pi / 1.3)
    assert set(found.contacts.stop) == {0, 1}
    samples = found.samples(2)
    np.testing.assert_allclose(samples.q[1], -samples.q[0], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(samples.q_dot[1], -samples.q_dot[0], rtol=0.0, atol=1e-9)


def test_start_from_nothing_finds_what_a_given_start_finds():
    system, period = beam(HYSTERETIC), 2.0 * math.pi / 195.0
    settled = orbit(system, period)
    given = orbit(system, period, 1.2 * settled.state)
    assert distance(system, given.state, settled.state) < 1e-9
    start = 1.2 * settled.state
    kept = start.copy()
    orbit(system, period, start)
    np.testing.assert_array_equal(start, kept)


def closes(problem, found):
    """Whether an orbit is one of the closed pieces, with the multipliers of these."""
    x, monodromy, _ = problem.orbit(found.state)
    np.testing.assert_allclose(found.state, x, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(np.poly(found.monodromy), np.poly(monodromy), rtol=0.0, atol=1e-7)


@pytest.mark.parametrize("omega", [3.0, 3.4, 3.8])
def test_an_unstable_orbit_is_found_from_rest_where_motion_is_chaotic(omega):
    problem = Bilinear(omega, stiffness=100.0)
    found = orbit(problem.system(), problem.period)
    assert found.phase == 0.0
    assert not found.stable
    closes(problem, found)


def test_orbit_at_rest_from_a_start_that_is_not():
    system = System.modal([2.0, 5.0], [0.1, 0.05], [Contact([1.0, 0.3], Hertz(10.0), 5.0)])
    found = orbit(system, 3.0, start=[1.0, 0.2, 0.0, 0.0])
    assert np.abs(found.state).max() < 1e-12
    assert found.stable


def test_verdict_near_the_unit_circle_and_near_grazing_is_doubted():
    slow = orbit(replace(STABLE, zeta=1e-4, gap=5.0, omega=2.0).system(), math.pi)
    assert slow.stable
    assert "within" in slow.doubt
    touching = replace(STABLE, gap=STABLE.linear_amplitude() * (1.0 - 1e-7))
    assert not orbit(replace(touching, gap=0.0).system(), STABLE.period).doubt
    soft = Contact([1.0], PiecewiseLinear([4.0]), touching.gap)
    hard = Contact([-1.0], PiecewiseLinear([4.0]), 0.5 * touching.gap)
    system = System.modal([1.0], 0.1, [hard], [([1.0], Tone(1.0, 1.3))])
    lowest = orbit(system, STABLE.period).samples(4000).q.min()
    grazed = Contact([1.0], soft.law, -lowest * (1.0 - 1e-7))
    both = orbit(System.modal([1.0], 0.1, [hard, grazed], system.loads), STABLE.period)
    assert "grazes" in both.doubt


# --- Duffing: an elliptic function, harmonic balance --------------------------------------------------------------


def duffing(beta, zeta, signal):
    """q³ both ways: two stops without gap."""
    stops = [Contact([sign], cubic(stiffness=beta)) for sign in (1.0, -1.0)]
    return System.modal([1.0], zeta, stops, [([1.0], signal)])


@pytest.mark.parametrize("m", [0.3, 0.8])
def test_duffing_against_an_elliptic_function(m):
    """q = A cn(pt | m) under the drive that makes it exact; after Hsu, Q. Appl. Math., 1960."""
    beta, zeta, size = 2.0, 0.05, 0.9
    p = size * math.sqrt(0.5 * beta / m)
    period = 4.0 * ellipk(m) / p

    def drive(t):
        sn, cn, dn, _ = ellipj(p * np.mod(t, period), m)
        return size * ((p**2 * (2.0 * m - 1.0) + 1.0) * cn - 2.0 * zeta * p * sn * dn)

    found = orbit(duffing(beta, zeta, drive), period, [size, 0.01])
    sn, cn, dn, _ = ellipj(p * found.phase, m)
    np.testing.assert_allclose(found.state, [size * cn, -size * p * sn * dn], rtol=0.0, atol=1e-8)
    assert np.prod(found.multipliers).real == pytest.approx(math.exp(-2.0 * zeta * period), rel=1e-6)


def test_three_duffing_orbits_against_harmonic_balance():
    """Between the folds: large, middle (unstable) and small motion."""
    balance, omega = Duffing(), 1.4
    lags = np.linspace(3.0, 0.5, 40)
    points = balance.walk(lags)
    crossings = [i for i, (a, b) in enumerate(itertools.pairwise(points)) if (a[1] - omega) * (b[1] - omega) < 0]
    verdicts = []
    for i in crossings:
        state = balance.state(points[i][0], points[i][1])
        found = orbit(duffing(1.0, 0.05, Tone(0.2, omega)), 2.0 * math.pi / omega, state)
        verdicts.append(found.stable)
        there = balance.at_frequency(omega, points[i][0])
        np.testing.assert_allclose(balance.state(there, omega, found.phase), found.state, rtol=0.0, atol=1e-9)
    assert verdicts == [True, False, True]


# --- bad input ----------------------------------------------------------------------------------------------------


test_bad_input = refused_by(
    lambda arguments: orbit(**{"system": STABLE.system(), "period": STABLE.period, **arguments}),
    ({"period": 0.0}, "period must be positive and finite"),
    ({"period": -1.0}, "period must be positive"),
    ({"period": math.nan}, "period must be positive"),
    ({"period": 1.1 * STABLE.period}, "load 0 does not have the period"),
    ({"period": 0.5 * STABLE.period}, "it makes .* cycles"),
    ({"shots": 0}, "shots must be a whole number from 1"),
    ({"shots": 1.5}, "shots must be a whole number"),
    ({"start": [1.0]}, "start must be 2 finite numbers"),
    ({"start": [1.0, math.nan]}, "start must be 2 finite numbers"),
    ({"method": HenonRK2(1e-3, 1e-4)}, "method must offer tangents"),
)


def test_plain_signal_without_the_period():
    system = System.modal([1.0], 0.1, [], [([1.0], lambda t: np.cos(1.3 * t) + 1e-3 * np.cos(0.7 * t))])
    with pytest.raises(ValueError, match="load 0 does not have the period"):
        orbit(system, 2.0 * math.pi / 1.3)


def test_no_orbit_at_all_says_what_was_tried():
    """A mean load away from the stop drives a free mass off for ever: mean forces cannot balance."""
    stop = Contact([1.0], PiecewiseLinear([4.0]))
    system = System([[1.0]], [[0.1]], [[0.0]], [stop], [([1.0], lambda t: 1.0 + 0.1 * np.cos(t))])
    with pytest.raises(OrbitError):
        orbit(system, 2.0 * math.pi, [-1.0, 0.0])


def test_motion_that_sinks_for_ever():
    """The mean load exceeds all that the stop can carry; a residual relative to the motion's size tends to zero."""

    @law
    def saturating(delta, delta_dot, entry_rate, top):
        return top * delta / (1.0 + delta)

    stop = Contact([1.0], saturating(top=1.0), -0.5)
    loads = [([1.0], Tone(-1.5, 0.0)), ([1.0], Tone(0.1, 1.0))]
    with pytest.raises(OrbitError):
        orbit(System([[1.0]], [[0.2]], [[0.0]], [stop], loads), 2.0 * math.pi, [0.0, 0.0])


def test_no_orbit_near_a_start_tells_of_its_iterations():
    """Ten periods of a hard, nearly elastic stop in one shot."""
    problem = Bilinear(0.7, stiffness=1e3, zeta=0.01)
    with pytest.raises(OrbitError, match=r"1 shot\(s\): .* of Newton's method reduced the residual from .* to"):
        orbit(problem.system(), 10 * problem.period, [-0.3, 5.0], shots=1)


def test_undamped_resonance_has_no_orbit():
    system = System.modal([1.0], 0.0, [], [([1.0], Tone(1.0, 1.0))])
    with pytest.raises(OrbitError, match="no orbit found"):
        orbit(system, 2.0 * math.pi, [1.0, 0.0])


def test_hysteretic_stop_that_never_opens():
    stop = Contact([1.0], Hysteretic(10.0, damping_factor=0.3), -0.5)
    system = System.modal([1.0], 0.1, [stop], [([1.0], Tone(0.01, 1.0))])
    with pytest.raises(OrbitError, match="all stops open"):
        orbit(system, 2.0 * math.pi)


@pytest.mark.parametrize(
    ("stop", "latched"), [(HYSTERETIC, True), (replace(HYSTERETIC, entry_rate_floor=0.5), True), (Hertz(2.1e8), False)]
)
def test_a_law_that_latches_is_known_whatever_its_floor(stop, latched):
    assert latches(Contact([1.0], stop)) is latched


@pytest.mark.parametrize("seed", [170, 229])
def test_an_orbit_whose_contacts_lie_elsewhere_than_the_start_says_is_an_orbit_for_ever(seed):
    """From rest no stop is closed at t = 0, on the orbit one whose law latches the entry rate is."""
    make, (low, _), modes = random_family(np.random.default_rng(seed))
    system, period = make(low)
    found = orbit(system, period, np.zeros(2 * modes))
    assert not np.any(found.contacts.t_out > found.period)
    later, x = from_phase(found), found.state
    run = integrate(later, x[:modes], x[modes:], 4 * period, dt=period, method=found.method)
    np.testing.assert_allclose(np.hstack((run.q, run.q_dot)), np.tile(x, (5, 1)), atol=1e-9 * np.abs(x).max())


def test_quiet_times_leave_out_what_goes_on_in_the_next_period():
    system = System.modal([1.0], [0.1], [Contact([1.0], HYSTERETIC)])
    rows = np.zeros((2, 10))
    rows[:, 1:3] = [(2.0, 3.0), (8.0, 11.0)]
    assert open_intervals(system, ContactLog.of_rows(rows), 10.0) == [(1.0, 2.0), (3.0, 8.0)]
