"""Contact events: closed answers, corners, several stops, starts and ends inside contacts, the log."""

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from problems import DampedHalfWave, HertzBounce, bilinear, bounce, free_mass, paper_scene
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import fembeam as fb
from contacts import Hertz, Hysteretic, KelvinVoigt, PiecewiseLinear, Viscoelastic, achieved_restitution
from solvers import Contact, DormandPrince, Exponential, HenonRK2, Newmark, SolverError, Status, System, integrate

FINE = DormandPrince(rtol=1e-13)
PERIOD = 2 * math.pi / 195.0
WEIGHT = [([-1.0], fb.Harmonic(9.81, 0.0))]
LN = Hysteretic.lankarani_nikravesh(2.1e8, restitution=0.5)


# --- closed answers -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ratio", [1.5, 3.0, 10.0])
def test_bilinear_oscillator_has_its_period(ratio):
    omega_1, omega_2 = 20.0, 20.0 * ratio
    run = integrate(bilinear(omega_1, omega_2), [0.0], [-1.0], 5.0, method=FINE)
    omega = 2 * omega_1 * omega_2 / (omega_1 + omega_2)
    entries = run.contacts.t_in
    assert len(entries) == math.floor(5.0 * omega / (2 * math.pi)) + 1
    np.testing.assert_allclose(entries, 2 * math.pi / omega * np.arange(len(entries)), rtol=1e-11, atol=1e-13)
    closed = np.isfinite(run.contacts.t_out)
    np.testing.assert_allclose((run.contacts.t_out - entries)[closed], math.pi / omega_2, rtol=1e-10)


def test_preloaded_linear_stop_against_its_pieces():
    # gap -p: contact while q < p; the equilibrium moves to k_s p/(k + k_s)
    k, k_stop, preload, swing = 1e4, 1e6, 1e-3, 5e-3
    centre, omega_2, omega_1 = k_stop * preload / (k + k_stop), math.sqrt((k + k_stop) / 100.0), 10.0
    system = System([[100.0]], [[0.0]], [[k]], [Contact([1.0], PiecewiseLinear([k_stop]), -preload)])
    run = integrate(system, [centre - swing], [0.0], 0.4, method=FINE)
    to_exit = math.acos((centre - preload) / swing) / omega_2
    speed = swing * omega_2 * math.sin(omega_2 * to_exit)
    flight = 2.0 * math.atan2(speed, omega_1 * preload) / omega_1
    log = run.contacts
    assert log.t_in[0] == 0.0
    assert log.t_out[0] == pytest.approx(to_exit, rel=1e-11)
    assert log.speed_out[0] == pytest.approx(speed, rel=1e-11)
    assert log.t_in[1] == pytest.approx(to_exit + flight, rel=1e-11)
    assert log.peak_indentation[0] == pytest.approx(preload - centre + swing, rel=1e-11)


def test_flight_under_gravity_is_a_parabola_between_elastic_hits():
    height, law = 0.3, Hertz(1e9)
    run = integrate(free_mass(law, loads=WEIGHT), [height], [0.0], 2.0, method=FINE)
    log = run.contacts
    assert log.t_in[0] == pytest.approx(math.sqrt(2 * height / 9.81), rel=1e-12)
    np.testing.assert_allclose(log.speed_in, math.sqrt(2 * 9.81 * height), rtol=1e-10)
    np.testing.assert_allclose(log.t_in[1:] - log.t_out[:-1], 2 * math.sqrt(2 * height / 9.81), rtol=1e-9)


def test_gap_shifts_the_contact_in_time_only():
    near, far = (integrate(free_mass(LN, gap=gap), [0.0], [-2.0], 1.0, method=FINE).contacts for gap in (0.0, 0.125))
    assert far.t_in[0] == pytest.approx(0.0625, rel=1e-14)
    for name in ("speed_in", "speed_out", "peak_indentation", "peak_force", "impulse", "energy_loss"):
        np.testing.assert_allclose(far.arrays()[name], near.arrays()[name], rtol=1e-9)
    assert far.t_out[0] - 0.0625 == pytest.approx(near.t_out[0], rel=1e-8)


@pytest.mark.parametrize(
    ("method", "rtol"), [(FINE, 1e-13), (HenonRK2(1e-5, 1e-6), 1e-13), (HenonRK2(1e-5, 1e-5), 1e-12)]
)
def test_entry_lands_on_the_surface(method, rtol):
    """All locate the entry, not only notice it."""
    log = integrate(free_mass(KelvinVoigt(1e6, 20.0), gap=0.0123), [0.0], [-1.3], 0.0125, method=method).contacts
    assert log.t_in[0] == pytest.approx(0.0123 / 1.3, rel=rtol)
    assert log.speed_in[0] == pytest.approx(1.3, rel=1e-14)


def test_henon_landing_in_curved_flight_is_of_second_order_globally():
    # a falling mass: entry at √(2h/g), one Heun step in δ from up to one flight step away
    exact = math.sqrt(2 * 0.01 / 9.81)
    errors = []
    for h in (1.2e-3, 1.2e-4):
        run = integrate(free_mass(LN, loads=WEIGHT), [0.01], [0.0], 0.0455, method=HenonRK2(h, h / 100))
        errors.append(abs(run.contacts.t_in[0] - exact))
    assert errors[0] < 2e-9
    assert errors[1] < 1e-13


# --- entry rate ---------------------------------------------------------------------------------------------------


def test_entry_rate_is_latched_for_each_contact():
    # each rebound obeys the restitution of its own entry speed: a wrong latch would change the ratio
    law = Hysteretic(1e13, 0.8)
    log = integrate(free_mass(law, loads=WEIGHT), [0.3], [0.0], 1.1, method=FINE).contacts
    assert len(log) >= 4
    ratio = log.speed_out[:4] / log.speed_in[:4]
    np.testing.assert_allclose(ratio, achieved_restitution(0.8), rtol=3e-4)  # the weight acts in contact, too
    assert log.speed_in[3] < 0.3 * log.speed_in[0]
    np.testing.assert_allclose(log.speed_in[1:4], log.speed_out[:3], rtol=1e-10)


@pytest.mark.parametrize("speed", [1e-5, 4e-4])
def test_slow_entries_use_the_floor_and_say_so(speed):
    slow, fast = bounce(LN, speed).contacts, bounce(LN, 2e-3).contacts
    assert slow.entry_rate_clipped.tolist() == [True]
    assert fast.entry_rate_clipped.tolist() == [False]
    # below the floor the law is F = K δ^p (1 + a' δ̇/speed) with the smaller a' = a speed/floor
    assert slow.speed_out[0] / speed == pytest.approx(achieved_restitution(0.5625 * speed / 1e-3), rel=1e-9)
    assert slow.speed_in[0] == pytest.approx(speed, rel=1e-14)


def test_floor_is_the_laws_own():
    law = replace(LN, entry_rate_floor=0.5)
    assert bounce(law, 0.4).contacts.entry_rate_clipped[0]
    assert not bounce(law, 0.6).contacts.entry_rate_clipped[0]


@pytest.mark.parametrize("method", [FINE, Exponential(1e-11)])
def test_each_part_of_a_sum_has_its_own_floor(method):
    """Entry at 0.3 m/s: one part divides by its floor of 0.5 m/s, the other, with a floor of 0.1, by the entry rate."""
    parts = Hysteretic(1e5, 0.4, entry_rate_floor=0.5), Hysteretic(2e5, 0.6, entry_rate_floor=0.1)

    def motion(t, y):
        depth = max(y[0], 0.0) ** 1.5
        return y[1], -depth * (1e5 * (1.0 + 0.4 * y[1] / 0.5) + 2e5 * (1.0 + 0.6 * y[1] / 0.3))

    def leaves(t, y):
        return y[0]

    leaves.terminal, leaves.direction = True, -1
    alone = solve_ivp(motion, (0.0, 1.0), [0.0, 0.3], "DOP853", events=leaves, rtol=1e-12, atol=1e-16, max_step=1e-4)
    log = integrate(free_mass(parts[0] + parts[1]), [0.0], [-0.3], 0.1, method=method).contacts
    assert log.t_out == pytest.approx(alone.t_events[0], rel=1e-8)
    assert log.speed_out == pytest.approx(-alone.y_events[0][:, 1], rel=1e-8)


def test_grazing_leaves_no_trace():
    # the swing just misses the stop, or just touches it
    system = [System.modal([10.0], 0.0, [Contact([1.0], LN, gap)]) for gap in (1.0 + 1e-9, 1.0 - 1e-9)]
    missed, touched = (integrate(s, [1.0], [0.0], 0.6, 0.1, FINE) for s in system)
    assert len(missed.contacts) == 0
    assert len(touched.contacts) == 1
    assert touched.contacts.entry_rate_clipped[0]
    assert touched.contacts.peak_indentation[0] <= 1.001e-9
    np.testing.assert_allclose(touched.q, missed.q, atol=1e-8)


@lru_cache(maxsize=1)
def swing(depth):
    """A swing that, at unit amplitude, dips into a soft stop by ``depth``; made once for all phases."""
    return System.modal([10.0], 0.0, [Contact([1.0], Hertz(1e3), 1.0 - depth)])


def dip(depth, phase, rtol):
    """That swing, begun at a phase, so that it dips once."""
    start = [math.cos(phase)], [-10 * math.sin(phase)]
    return integrate(swing(depth), *start, 0.1 * (3.7 - phase), method=DormandPrince(rtol), check=False)


PHASES = np.linspace(0.05, 2.5, 61)


@pytest.mark.parametrize("depth", [1e-2, 1e-4, 1e-6])
@pytest.mark.parametrize("rtol", [1e-8, 1e-10])
def test_dips_longer_and_shorter_than_a_step_are_all_found(depth, rtol):
    # entry and exit of the shorter ones lie within one step, and all are far deeper than the tolerance
    runs = [dip(depth, phase, rtol) for phase in PHASES]
    assert [len(run.contacts) for run in runs] == [1] * len(PHASES)
    lengths = [run.contacts.t_out[0] - run.contacts.t_in[0] for run in runs]
    np.testing.assert_allclose(lengths, 2 * math.acos(1.0 - depth) / 10, rtol=0.05)


@pytest.mark.parametrize("rtol", [1e-6, 1e-10])
def test_grazing_within_the_tolerance_ends_no_run(rtol):
    # whether the stop is met is beyond what the tolerance can tell; that the run goes on is not
    runs = [dip(depth * rtol, phase, rtol) for depth in (0.01, 0.1, 1.0) for phase in PHASES]
    assert {run.status for run in runs} == {Status.DONE}


GRAZES = np.geomspace(1e-15, 1e-9, 7)


@pytest.mark.parametrize("rtol", [1e-6, 1e-10])
def test_grazes_shift_no_time(rtol):
    # where the surface is only just reached the state must be that of the time it is given: the rest is a cosine
    apart = []
    for depth in GRAZES:
        system = System.modal([10.0], 0.0, [Contact([1.0], Hertz(1.0), 1.0 - depth)])
        for phase in PHASES[::3]:
            start = [math.cos(phase)], [-10 * math.sin(phase)]
            run = integrate(system, *start, 0.1 * (3.7 - phase), method=DormandPrince(rtol))
            apart.append(abs(run.q_dot[-1, 0] / 10 + math.sin(3.7)))
    assert max(apart) < 5.0 * rtol


@pytest.mark.parametrize("law", [lambda size: PiecewiseLinear([1e4]), lambda size: Hertz(1e4 / math.sqrt(size))])
def test_amplitudes_of_any_size_are_right_or_refused(law):
    def run(size):
        system = System.modal([10.0], 0.01, [Contact([1.0], law(size), 0.5 * size)])
        return integrate(system, [size], [0.0], 1.0, 0.01, DormandPrince(1e-8)).q / size

    for size in (1e-15, 1e-12, 1e-9, 1e9, 1e75):
        np.testing.assert_allclose(run(size), run(1.0), atol=1e-6)
    for size in (1e100, 1e150):
        with pytest.raises(SolverError, match="not finite any more"):
            run(size)


# --- several stops ------------------------------------------------------------------------------------------------


def test_stop_above_under_mirrored_motion_equals_stop_below():
    scene = paper_scene()
    above = replace(scene, stops=[fb.Stop(0.24445, LN, 1e-4, "above")], base=fb.Harmonic(amplitude=-1e-3, omega=195.0))
    below = replace(scene, stops=[fb.Stop(0.24445, LN, 1e-4, "below")])
    runs = [s.reduce(2).simulate(3 * PERIOD, PERIOD / 20, solver=DormandPrince(1e-9)) for s in (below, above)]
    assert len(runs[0].contacts) >= 3
    np.testing.assert_allclose(runs[1].q, -runs[0].q, atol=1e-15)
    np.testing.assert_allclose(runs[1].indentation(), runs[0].indentation(), atol=1e-15)
    np.testing.assert_allclose(runs[1].force(), runs[0].force(), rtol=1e-9, atol=1e-9)


def test_free_mass_between_two_walls_bounces_to_and_fro():
    walls = [Contact([1.0], Hertz(1e9), 0.1), Contact([-1.0], Hertz(1e9), 0.3)]
    log = integrate(System([[1.0]], [[0.0]], [[0.0]], walls), [0.0], [-1.0], 5.0, method=FINE).contacts
    assert log.stop.tolist() == [0, 1] * (len(log) // 2) + [0] * (len(log) % 2)
    contact = HertzBounce(1e9, 1.0, 1.0).duration
    np.testing.assert_allclose(log.t_in, 0.1 + (0.4 + contact) * np.arange(len(log)), rtol=1e-9)


@pytest.mark.parametrize("method", [FINE, Exponential(1e-11), Newmark(1e-5)], ids=lambda method: type(method).__name__)
def test_two_identical_stops_at_one_instant_act_as_one_of_twice_the_stiffness(method):
    twins = [Contact([1.0], Hysteretic(1e8, 0.7), 0.01)] * 2
    one = integrate(free_mass(Hysteretic(2e8, 0.7), gap=0.01), [0.0], [-1.0], 0.1, method=method)
    two = integrate(System([[1.0]], [[0.0]], [[0.0]], twins), [0.0], [-1.0], 0.1, method=method)
    assert two.contacts.stop.tolist() in ([0, 1], [1, 0])
    np.testing.assert_allclose(two.contacts.t_in, one.contacts.t_in[0], rtol=1e-14)
    np.testing.assert_allclose(two.contacts.t_out, one.contacts.t_out[0], rtol=5e-11)
    np.testing.assert_allclose(two.contacts.peak_force, one.contacts.peak_force[0] / 2, rtol=5e-11)
    np.testing.assert_allclose(two.contacts.energy_loss, one.contacts.energy_loss[0] / 2, rtol=1e-10)
    np.testing.assert_allclose(two.q, one.q, rtol=5e-11)


def test_stops_in_a_row_are_met_one_after_the_other():
    # the second stop begins at the indentation at which one polyline has its knot
    row = [Contact([1.0], PiecewiseLinear([1e5])), Contact([1.0], PiecewiseLinear([4e5]), 2e-3)]
    two = integrate(System([[1.0]], [[0.0]], [[0.0]], row), [0.0], [-1.0], 0.1, method=FINE)
    one = bounce(PiecewiseLinear([1e5, 5e5], [2e-3]), duration=0.1)
    order = np.argsort(two.contacts.t_in)
    assert two.contacts.stop[order].tolist() == [0, 1]
    assert two.contacts.t_in[order][1] == pytest.approx(math.asin(2e-3 * math.sqrt(1e5)) / math.sqrt(1e5), rel=1e-11)
    np.testing.assert_allclose(two.q, one.q, rtol=1e-11)
    assert two.contacts.t_out[order][0] == pytest.approx(one.contacts.t_out[0], rel=1e-12)


def test_two_bodies_that_hit_each_other_keep_their_momentum():
    # the contact direction couples two coordinates: δ = -(q1 - q0) - gap
    system = System(np.diag([2.0, 3.0]), np.zeros((2, 2)), np.zeros((2, 2)), [Contact([-1.0, 1.0], LN, 0.05)])
    run = integrate(system, [0.0, 0.0], [0.5, -1.0], 0.2, 0.01, FINE)
    np.testing.assert_allclose(run.q_dot @ [2.0, 3.0], -2.0, atol=1e-12)
    log = run.contacts
    assert log.speed_in[0] == pytest.approx(1.5, rel=1e-13)
    assert log.speed_out[0] / 1.5 == pytest.approx(0.725241114010, rel=1e-10)
    assert log.impulse[0] == pytest.approx(1.2 * 1.5 * 1.725241114010, rel=1e-10)


# --- starts -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", [FINE, HenonRK2(1e-4, 1e-5)])
def test_start_on_the_surface_moving_out_is_no_contact(method):
    run = integrate(free_mass(LN), [0.0], [0.7], 1.0, 0.25, method)
    assert len(run.contacts) == 0
    np.testing.assert_allclose(run.q[:, 0], 0.7 * run.t, rtol=1e-12)


@pytest.mark.parametrize("method", [FINE, HenonRK2(1e-4, 1e-5)])
def test_start_at_rest_on_the_surface_without_load_stays(method):
    run = integrate(System.modal([10.0], 0.0, [Contact([1.0], LN)]), [0.0], [0.0], 1.0, 0.25, method)
    assert not run.q.any()


def test_start_at_rest_on_the_surface_pushed_in():
    # a constant push from δ = 0: ½ harmonic about the static indentation
    stiffness, push = 1e4, 3.0
    loads = [([-1.0], fb.Harmonic(push, 0.0))]
    run = integrate(free_mass(PiecewiseLinear([stiffness]), loads=loads), [0.0], [0.0], 0.1, 1e-3, FINE)
    static = push / stiffness
    np.testing.assert_allclose(run.q[:, 0], -static * (1 - np.cos(100 * run.t)), atol=1e-11)
    assert run.contacts.t_in[0] == pytest.approx(0.0, abs=1e-6)
    assert run.contacts.entry_rate_clipped[0]
    assert run.contacts.peak_indentation[0] == pytest.approx(2 * static, rel=1e-9)


def test_start_at_rest_on_the_surface_pulled_out():
    run = integrate(free_mass(LN, loads=[([1.0], fb.Harmonic(3.0, 0.0))]), [0.0], [0.0], 1.0, 0.25, FINE)
    assert len(run.contacts) == 0
    np.testing.assert_allclose(run.q[:, 0], 1.5 * run.t**2, atol=1e-13)


def test_start_inside_a_contact_is_logged_from_the_start():
    stiffness, depth = 1e4, 0.02
    run = integrate(free_mass(PiecewiseLinear([stiffness])), [-depth], [0.0], 0.1, method=FINE)
    log = run.contacts
    assert log.t_in[0] == 0.0
    assert log.t_out[0] == pytest.approx(math.pi / 200, rel=1e-12)
    assert log.speed_out[0] == pytest.approx(depth * 100, rel=1e-12)
    assert log.entry_rate_clipped[0]
    assert log.peak_force[0] == pytest.approx(200.0, rel=1e-12)
    assert log.energy_loss[0] == pytest.approx(-0.5 * stiffness * depth**2, rel=1e-12)


def test_start_inside_a_contact_moving_out_has_a_positive_entry_speed():
    log = integrate(free_mass(PiecewiseLinear([1e4])), [-0.02], [0.5], 0.1, method=FINE).contacts
    assert log.speed_in[0] == pytest.approx(0.5, rel=1e-14)


@pytest.mark.parametrize("method", [DormandPrince(1e-13, atol=1e-18), HenonRK2(1e-4, 1e-5)])
def test_preloaded_rest_at_static_equilibrium_lasts(method):
    # K q = K_s (p - q)^1.5
    law, stiffness, preload = Hysteretic(1e8, 0.5), 1e4, 1e-4
    q = brentq(lambda x: stiffness * x - law.stiffness * (preload - x) ** 1.5, 0.0, preload, xtol=1e-20, rtol=1e-15)
    system = System([[1.0]], [[5.0]], [[stiffness]], [Contact([1.0], law, -preload)])
    run = integrate(system, [q], [0.0], 2.0, 0.1, method)
    np.testing.assert_allclose(run.q[:, 0], q, rtol=1e-10)
    assert np.isnan(run.contacts.t_out).tolist() == [True]
    assert run.contacts.impulse[0] == pytest.approx(2.0 * stiffness * q, rel=1e-9)
    assert run.status is Status.DONE


@pytest.mark.parametrize("law", [KelvinVoigt(1e4, 20.0), Hysteretic(1e6, 1.4)])
@pytest.mark.parametrize("method", [DormandPrince(1e-9), Exponential(1e-9)], ids=["dormand", "exponential"])
def test_bouncing_ball_comes_to_rest_in_permanent_contact(law, method):
    run = integrate(free_mass(law, loads=WEIGHT), [0.1], [0.0], 20.0, method=method)
    assert run.cost.steps < 20_000
    assert run.status is Status.DONE
    assert np.isnan(run.contacts.t_out).sum() == 1
    assert law.force(-run.q[0, 0], 0.0, 1.0) == pytest.approx(9.81, rel=1e-6)
    assert abs(run.q_dot[0, 0]) < 1e-6
    peaks = run.contacts.peak_indentation
    assert np.all(np.diff(peaks) < 0.0)


# --- ends and the log ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", [FINE, HenonRK2(1e-5, 1e-6)])
def test_run_that_ends_inside_a_contact_leaves_it_open(method):
    exact = DampedHalfWave(1e6, 200.0, 2.0, 1.3)
    end = 0.6 * exact.exit_time
    run = integrate(free_mass(KelvinVoigt(1e6, 200.0), 2.0), [0.0], [-1.3], end, method=method)
    tolerance = 1e-11 if method.adaptive else 1e-5
    assert run.status is Status.DONE
    assert run.t[0] == end
    assert -run.q[0, 0] == pytest.approx(exact.delta(end), rel=tolerance)
    log = run.contacts
    assert np.isnan(log.t_out[0])
    assert np.isnan(log.speed_out[0])
    assert log.impulse[0] == pytest.approx(2.0 * (1.3 - exact.delta_dot(end)), rel=tolerance)
    assert log.energy_loss[0] == pytest.approx(1.3**2 - exact.delta_dot(end) ** 2, rel=10 * tolerance)


def test_open_contacts_come_last_and_the_log_is_in_order_of_ends():
    # one stop stays loaded from the start, the other is hit again and again
    stops = [Contact([1.0, 0.0], PiecewiseLinear([1e4]), -1e-3), Contact([0.0, 1.0], Hertz(1e8))]
    weight = [0.0, -1.0], fb.Harmonic(9.81, 0.0)
    system = System(np.eye(2), np.zeros((2, 2)), np.diag([1e4, 0.0]), stops, [weight])
    log = integrate(system, [5e-4, 0.01], [0.0, 0.0], 1.0, method=FINE).contacts
    assert log.stop[-1] == 0
    assert log.t_in[-1] == 0.0
    assert np.isnan(log.t_out[-1])
    assert np.all(np.diff(log.t_out[:-1]) > 0.0)
    assert set(log.stop[:-1].tolist()) == {1}


def test_log_grows_with_the_number_of_contacts():
    # far more contacts than the log begins with
    run = integrate(bilinear(200.0, 400.0), [0.0], [-1.0], 60.0, method=DormandPrince(1e-8))
    omega = 2 * 200.0 * 400.0 / 600.0
    assert len(run.contacts) == math.floor(60.0 * omega / (2 * math.pi)) + 1
    assert np.all(np.diff(run.contacts.t_in) > 0.0)
    np.testing.assert_allclose(run.contacts.speed_in, 1.0, rtol=1e-4)


def test_peak_force_of_a_dashpot_is_at_entry():
    # heavily damped: the force is largest at the instant of entry, c v
    log = bounce(KelvinVoigt(1e4, 150.0), speed=2.0, duration=0.1).contacts
    assert log.peak_force[0] == pytest.approx(300.0, rel=1e-12)


def test_rounding_of_the_indentation_is_no_peak_force():
    """A dashpot that acts on approach only lets a pressed body go: its force is largest as the run begins.

    Steps of 1e-9 s tell δ̇ by its own values; by the slope of δ the peak would be 3.5e-7 larger in nine of these runs.
    """
    damping, stiffness = np.array([[0.002, 0.02], [0.02, 0.4]]), np.diag([0.0, 2000.0])
    for pressed in np.linspace(3e-3, 4e-3, 24):
        law = Viscoelastic(2e5, 1e3, approach_only=True)
        stops = [Contact([0.4, -0.9], law, -pressed), Contact([-0.9, 0.5], Hertz(1e4)), Contact([0.9, 0.4], law, 0.1)]
        log = integrate(System(np.eye(2), damping, stiffness, stops), np.zeros(2), np.zeros(2), 1e-6).contacts
        assert log.peak_force[0] == pytest.approx(law.force(pressed), rel=1e-12)


@pytest.mark.parametrize("method", [Exponential(1e-4), Exponential(1e-12), DormandPrince(1e-6), DormandPrince(1e-12)])
@pytest.mark.parametrize("mass", [1.4, 0.35, 0.02])
def test_peak_force_where_a_dashpot_begins(mass, method):
    """The force jumps to F + c v at the knot, which is its largest: F alone acts until there, and both fall beyond."""
    stiffness, knot, damping = 400.0, 0.02, 8.0
    law = PiecewiseLinear([stiffness, 500.0], (knot,), [0.0, damping])
    rate = 1.02 * knot * math.sqrt(stiffness / mass)
    log = integrate(free_mass(law, mass), [0.0], [-rate], 0.1, method=method).contacts
    beyond = math.sqrt(rate**2 - stiffness * knot**2 / mass)
    assert log.peak_force[0] == pytest.approx(stiffness * knot + damping * beyond, rel=10.0 * method.rtol + 1e-9)


@pytest.mark.parametrize("method", [Exponential(1e-4), Exponential(1e-12), DormandPrince(1e-12)])
def test_peak_force_where_a_dashpot_ends(method):
    """The largest is that just before the knot, F + c v; beyond it there is F alone."""
    law, mass, knot = PiecewiseLinear([400.0, 20.0], (0.02,), [8.0, 0.0]), 0.7, 0.02
    gamma = 0.5 * 8.0 / mass
    omega = math.sqrt(400.0 / mass - gamma**2)

    def motion(t):
        decay = 1.5 * math.exp(-gamma * t)
        delta = decay * math.sin(omega * t) / omega
        return delta, decay * math.cos(omega * t) - gamma * delta

    t = brentq(lambda t: motion(t)[0] - knot, 0.0, 1.0 / omega)
    log = integrate(free_mass(law, mass), [0.0], [-1.5], 0.1, method=method).contacts
    assert log.peak_force[0] == pytest.approx(400.0 * knot + 8.0 * motion(t)[1], rel=10.0 * method.rtol + 1e-9)


def test_first_contact_of_two_in_one_step_is_taken_first():
    # the second stop in the list is hit first, both within one flight step
    stops = [Contact([1.0], PiecewiseLinear([1e5]), 0.0101), Contact([1.0], PiecewiseLinear([1e5]), 0.01)]
    run = integrate(System([[1.0]], [[0.0]], [[0.0]], stops), [0.0], [-1.0], 0.0115, method=FINE)
    entered = dict(zip(run.contacts.stop.tolist(), run.contacts.t_in.tolist(), strict=True))
    omega = math.sqrt(1e5)
    assert entered[1] == pytest.approx(0.01, rel=1e-13)
    assert entered[0] == pytest.approx(0.01 + math.asin(1e-4 * omega) / omega, rel=1e-12)


def test_start_beyond_a_knot_is_on_the_right_piece():
    run = integrate(free_mass(PiecewiseLinear([1e4, 4e4], [1e-3])), [-5e-3], [0.0], 0.1, method=FINE)
    log = run.contacts
    assert log.peak_force[0] == pytest.approx(170.0, rel=1e-12)
    work = 0.5 * 10.0 * 1e-3 + 0.5 * (10.0 + 170.0) * 4e-3
    assert log.speed_out[0] == pytest.approx(math.sqrt(2 * work), rel=1e-12)
