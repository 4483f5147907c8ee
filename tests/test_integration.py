"""The main loop and its two methods: order, agreement, outputs, ledger, signals, ends, refusals."""

import dataclasses
import math

import numpy as np
import pytest
from oscillators import Tone
from problems import bounce, coupled_dashpot, free_mass, linear_stop, paper_scene, reference
from refusals import refused, refused_by
from scipy.linalg import expm

import fembeam as fb
from contacts import Hertz, Hysteretic, KelvinVoigt, PiecewiseLinear, law
from solvers import (
    RK4,
    Contact,
    DormandPrince,
    Exponential,
    HenonRK2,
    Newmark,
    SolverError,
    Status,
    System,
    integrate,
    integrate_many,
    orbit,
)

FINE = DormandPrince(rtol=1e-13)
PERIOD = 2 * math.pi / 195.0

# states over the stop, away from grazing during two periods
STARTS = np.array(
    [
        [0.0, 0.0, 0.0, 0.0],
        [1.257e-05, -1.321e-06, 1.281e-02, 1.049e-03],
        [4.117e-05, 1.0421e-05, -2.57e-03, 1.3665e-02],
    ]
)


@pytest.fixture(scope="module")
def paper():
    return paper_scene().reduce(2).system


def distance(one, other):
    """Largest difference of q, relative to the largest q."""
    return np.abs(one.q - other.q).max() / np.abs(other.q).max()


def same(one, other):
    """Whether two runs have the same bits."""
    logs = zip(one.contacts.arrays().values(), other.contacts.arrays().values(), strict=True)
    return np.array_equal(one.q, other.q) and all(np.array_equal(a, b, equal_nan=True) for a, b in logs)


# --- convergence and agreement ------------------------------------------------------------------------------------


def test_paper_scene_agrees_with_an_independent_integrator(paper):
    duration = 3 * PERIOD
    ours = integrate(paper, np.zeros(2), np.zeros(2), duration, duration / 60, FINE)
    theirs = reference(paper, np.zeros(2), np.zeros(2), duration, ours.t)
    log = ours.contacts
    assert len(log) == len(theirs.contacts) == 4
    assert distance(ours, theirs) < 5e-11
    np.testing.assert_allclose(ours.q_dot, theirs.q_dot, atol=5e-11 * np.abs(theirs.q_dot).max())
    found = np.array([log.stop, log.t_in, log.t_out, log.speed_in]).T
    np.testing.assert_allclose(found, theirs.contacts, rtol=1e-10)


def test_tolerance_is_proportional_to_the_error(paper):
    duration = 2.2 * PERIOD
    exact = integrate(paper, np.zeros(2), np.zeros(2), duration, duration / 40, FINE)
    rtols = 10.0 ** -np.arange(4.0, 11.5, 0.5)
    errors = [
        distance(integrate(paper, np.zeros(2), np.zeros(2), duration, duration / 40, DormandPrince(r)), exact)
        for r in rtols
    ]
    slope = np.polyfit(np.log(rtols), np.log(errors), 1)[0]
    assert 0.85 < slope < 1.15
    assert np.all(np.array(errors) < 20.0 * rtols)


@pytest.mark.parametrize("start", STARTS[1:])
def test_heun_with_henon_steps_has_order_two(paper, start):
    duration = 2 * PERIOD
    exact = integrate(paper, start[:2], start[2:], duration, duration / 50, FINE)
    assert len(exact.contacts) >= 2
    assert np.all(exact.contacts.speed_in > 0.1)  # no grazing
    steps = 1.6e-5 / 2.0 ** np.arange(5)
    errors = []
    for h in steps:
        run = integrate(paper, start[:2], start[2:], duration, duration / 50, HenonRK2(h, h / 4))
        errors.append(np.sqrt(np.mean((run.q - exact.q) ** 2)) / np.abs(exact.q).max())
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert abs(slope - 2.0) < 0.15
    assert errors[-1] < 5e-6


def test_heun_alone_has_order_two_and_its_known_constant():
    # undamped oscillator: Heun runs ahead by (hω)²/6 per radian
    system, omega = System.modal([3.0], 0.0), 3.0
    for h in (1e-3, 5e-4):
        run = integrate(system, [1.0], [0.0], 2.0, method=HenonRK2(h, h))
        phase = math.atan2(-run.q_dot[0, 0] / omega, run.q[0, 0]) - (omega * 2.0 - 2 * math.pi)
        assert phase == pytest.approx((h * omega) ** 2 / 6 * omega * 2.0, rel=5e-3)


def test_one_step_of_heun_is_its_formula():
    omega, h = 2.0, 0.05
    run = integrate(System.modal([omega], 0.0), [1.0], [0.5], h, method=HenonRK2(h, h))
    A = h * np.array([[0.0, 1.0], [-(omega**2), 0.0]])
    exact = (np.eye(2) + A + A @ A / 2) @ [1.0, 0.5]
    np.testing.assert_allclose([run.q[0, 0], run.q_dot[0, 0]], exact, rtol=1e-15)
    assert run.cost.steps == 1


def test_dormand_prince_steps_have_order_eight():
    # accepted steps on a smooth problem scale as rtol**(-1/8)
    system = System.modal([1.0], 0.0)
    counts = [integrate(system, [1.0], [0.0], 500.0, method=DormandPrince(r)).cost.steps for r in (1e-5, 1e-13)]
    assert 1e8 ** (1 / 8.6) < counts[1] / counts[0] < 1e8 ** (1 / 7.4)


@pytest.mark.parametrize("dt", [None, 1e-3])
def test_runs_do_not_disturb_what_earlier_ones_returned(dt):
    used, fresh = paper_scene().reduce(2).system, paper_scene().reduce(2).system
    kept = [integrate(used, start[:2], start[2:], 2.7 * PERIOD, dt) for start in STARTS]
    for run, start in zip(kept, STARTS, strict=True):  # logs and ledgers are made only now
        again = integrate(fresh, start[:2], start[2:], 2.7 * PERIOD, dt)
        assert same(run, again)
        np.testing.assert_array_equal(run.energy.stored, again.energy.stored)
        np.testing.assert_array_equal(run.energy.initial, again.energy.initial)


def test_run_started_from_the_progress_of_another_is_apart():
    system = paper_scene().reduce(2).system
    alone = integrate(system, STARTS[1][:2], STARTS[1][2:], 9.0)
    inner = []

    def progress(_):
        inner.append(integrate(system, STARTS[2][:2], STARTS[2][2:], 0.3))

    assert same(integrate(system, STARTS[1][:2], STARTS[1][2:], 9.0, progress=progress), alone)
    assert len(inner) > 1
    assert all(same(run, inner[0]) for run in inner)


@pytest.mark.parametrize("seed", range(3))
def test_room_for_outputs_is_used_again_for_the_same_samples_only(seed):
    rng, used = np.random.default_rng(seed), paper_scene().reduce(2).system
    samplings, kept = [None, 1e-3, 7e-4, np.linspace(0.0, 0.04, 9), np.array([0.01, 0.013])], []
    for _ in range(12):
        duration, sampling, start = rng.choice([0.05, 0.06]), samplings[rng.integers(5)], STARTS[rng.integers(3)]
        asked = start[:2], start[2:], float(duration), sampling
        kept.append((integrate(used, *asked), integrate(paper_scene().reduce(2).system, *asked)))
    for found, alone in kept:  # none is changed by those after it
        assert same(found, alone)
        assert np.array_equal(found.t, alone.t)
        assert np.array_equal(found.energy.input, alone.energy.input, equal_nan=True)
    kept[0][0].t[:] = -1.0  # belongs to the caller
    assert all(found.t[0] >= 0.0 for found, _ in kept[1:])


def test_arguments_are_left_alone(paper):
    q0, q_dot0 = STARTS[1][:2].copy(), STARTS[1][2:].copy()
    integrate(paper, q0, q_dot0, 0.05, 1e-3)
    assert np.array_equal(q0, STARTS[1][:2])
    assert np.array_equal(q_dot0, STARTS[1][2:])


# --- outputs ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", [DormandPrince(1e-11), HenonRK2(1e-5, 1e-6)])
def test_samples_equal_runs_that_end_there(paper, method):
    tolerance = 1e-8 if method.adaptive else 2e-6
    dt = 7.3e-4
    sampled = integrate(paper, STARTS[1][:2], STARTS[1][2:], 0.06, dt, method)
    np.testing.assert_allclose(sampled.t, dt * np.arange(sampled.t.size), rtol=1e-15)
    scale = np.abs(sampled.q).max(axis=0), np.abs(sampled.q_dot).max(axis=0)
    for i in range(1, sampled.t.size, 9):
        direct = integrate(paper, STARTS[1][:2], STARTS[1][2:], sampled.t[i], method=method)
        assert np.all(np.abs(direct.q[-1] - sampled.q[i]) < tolerance * scale[0])
        assert np.all(np.abs(direct.q_dot[-1] - sampled.q_dot[i]) < 20 * tolerance * scale[1])


def test_samples_inside_a_contact_are_as_good_as_outside():
    samples = bounce(PiecewiseLinear([1e4]), duration=0.05, dt=5e-4)
    touching = samples.t < math.pi / 100
    np.testing.assert_allclose(samples.q[touching, 0], -np.sin(100 * samples.t[touching]) / 100, atol=1e-13)
    np.testing.assert_allclose(samples.q_dot[touching, 0], -np.cos(100 * samples.t[touching]), atol=1e-11)
    np.testing.assert_allclose(samples.q[~touching, 0], samples.t[~touching] - math.pi / 100, atol=1e-14)


@pytest.mark.parametrize("dt", [0.05 / 7, 0.05 / 64, 0.05 / 1000])
def test_no_sampling_keeps_the_last_sample(paper, dt):
    sampled = integrate(paper, np.zeros(2), np.zeros(2), 0.05, dt)
    final = integrate(paper, np.zeros(2), np.zeros(2), 0.05)
    assert final.t.shape == (1,)
    assert final.q.shape == final.q_dot.shape == (1, 2)
    assert final.t[0] == 0.05
    assert sampled.t[-1] == pytest.approx(0.05, rel=1e-15)
    np.testing.assert_allclose(sampled.q[-1], final.q[0], rtol=1e-12)
    np.testing.assert_allclose(sampled.q_dot[-1], final.q_dot[0], rtol=1e-12)
    np.testing.assert_allclose(sampled.contacts.t_out, final.contacts.t_out, rtol=1e-12)


def test_sampling_interval_that_does_not_divide_the_duration():
    run = integrate(System.modal([2.0], 0.0), [1.0], [0.0], 1.0, dt=0.3)
    np.testing.assert_allclose(run.t, [0.0, 0.3, 0.6, 0.9], rtol=1e-15)
    np.testing.assert_allclose(run.q[:, 0], np.cos(2 * run.t), atol=1e-7)
    whole = integrate(System.modal([2.0], 0.0), [1.0], [0.0], 1.0, dt=1.0)
    assert whole.t.tolist() == [0.0, 1.0]


@pytest.mark.parametrize("method", [Exponential(1e-10), Exponential(1e-10, ledger=False), DormandPrince(1e-12), FINE])
def test_output_times_may_crowd_in_one_contact(paper, method):
    """Dense values inside a contact equal runs that end there."""
    log = integrate(paper, STARTS[1][:2], STARTS[1][2:], 0.06).contacts
    inside = np.linspace(log.t_in[1] - 1e-5, log.t_out[1] + 1e-5, 40)
    times = np.sort(np.concatenate((inside, [0.0, 1e-9, 0.0123, 0.0597, 0.06])))
    run = integrate(paper, STARTS[1][:2], STARTS[1][2:], 0.06, times, method)
    np.testing.assert_array_equal(run.t, times)
    for i in range(1, times.size, 4):
        direct = integrate(paper, STARTS[1][:2], STARTS[1][2:], times[i], method=Exponential(1e-11))
        assert np.all(np.abs(direct.q[-1] - run.q[i]) < 1e-8 * np.abs(run.q).max(axis=0))


def test_cost_counts_the_work():
    solution = integrate(linear_stop(), [0.01], [0.0], 1.0, method=HenonRK2(1e-3, 1e-4))
    assert solution.cost.steps >= 1000
    assert solution.cost.events == 2 * len(solution.contacts) - np.isnan(solution.contacts.t_out).sum()
    assert solution.cost.law_calls > 0
    assert solution.cost.seconds > 0.0
    assert integrate(System.modal([2.0], 0.0), [1.0], [0.0], 1.0).cost.law_calls == 0


# --- energy -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rtol", [1e-6, 1e-9, 1e-12])
def test_energy_ledger_closes_to_the_tolerance(paper, rtol):
    energy = integrate(paper, STARTS[1][:2], STARTS[1][2:], 0.1, 1e-3, DormandPrince(rtol)).energy
    assert energy.stored.max() > 10 * energy.initial
    assert np.abs(energy.residual).max() < 10 * rtol * energy.stored.max()
    for work in (energy.damping, energy.contact):
        assert work[-1] > 0.01 * energy.stored.max()


def test_heun_ledger_closes_with_order_two(paper):
    worst = [
        np.abs(integrate(paper, np.zeros(2), np.zeros(2), 0.06, 1e-3, HenonRK2(h, h / 4)).energy.residual).max()
        for h in (2e-5, 1e-5, 5e-6)
    ]
    assert worst[0] / worst[2] > 12.0


def test_ledger_of_a_damped_oscillator_is_the_closed_one():
    # from q = 1: stored + damping = initial at every instant
    system = System.modal([3.0], 0.05)
    run = integrate(system, [1.0], [0.0], 4.0, 0.01, FINE)
    decay, omega = 0.15, 3.0 * math.sqrt(1 - 0.05**2)
    q = np.exp(-decay * run.t) * (np.cos(omega * run.t) + decay / omega * np.sin(omega * run.t))
    np.testing.assert_allclose(run.q[:, 0], q, atol=1e-12)
    np.testing.assert_allclose(run.energy.damping, 4.5 - run.energy.stored, atol=1e-11)
    assert run.energy.initial == 4.5


def test_ledger_input_is_the_work_of_the_loads():
    # resonant drive of an undamped mode from rest: q = F t sin(ωt)/(2ω)
    system = System.modal([5.0], 0.0, loads=[([2.0], fb.Harmonic(1.5, 5.0))])
    run = integrate(system, [0.0], [0.0], 3.0, 0.1, FINE)
    np.testing.assert_allclose(run.q[:, 0], 3.0 * run.t * np.sin(5 * run.t) / 10, atol=1e-12)
    np.testing.assert_allclose(run.energy.input, run.energy.stored, atol=1e-11)


def test_ledger_closes_with_coupled_damping():
    system = coupled_dashpot([Contact([0.0, 0.0, 1.0], Hysteretic(1e7, 0.8))], [([1, 0, 0], fb.Harmonic(5.0, 60.0))])
    energy = integrate(system, [0, 0, 0], [0.0, 0.0, -1.0], 0.5, 1e-2, DormandPrince(1e-12)).energy
    assert energy.damping[-1] > 0.1 * energy.stored.max()
    assert np.abs(energy.residual).max() < 1e-11 * energy.stored.max()


# --- linear systems of every kind ---------------------------------------------------------------------------------


@pytest.mark.parametrize("zeta", [0.0, 0.3, 1.0, 1.0 + 1e-9, 4.0])
def test_linear_mode_of_any_damping(zeta):
    omega, q0, v0 = 7.0, 0.4, -2.0
    run = integrate(System.modal([omega], zeta), [q0], [v0], 1.3, 0.1, FINE)
    A = np.array([[0.0, 1.0], [-(omega**2), -2 * zeta * omega]])
    exact = np.array([expm(A * t) @ [q0, v0] for t in run.t])
    np.testing.assert_allclose(run.q[:, 0], exact[:, 0], atol=2e-13)
    np.testing.assert_allclose(run.q_dot[:, 0], exact[:, 1], atol=2e-12)


def test_rigid_body_and_overdamped_modes_that_hit():
    stop = Contact([1.0, 0.7, 0.3], Hysteretic(1e6, 0.6), gap=0.01)
    system = System.modal([0.0, 20.0, 90.0], [0.0, 1.0, 2.5], [stop], [([1.0, 0.0, 1.0], fb.Harmonic(9.0, 11.0))])
    q0, v0 = [0.0, 0.01, 0.0], [-1.0, 0.0, 0.3]
    ours = integrate(system, q0, v0, 0.3, 0.01, FINE)
    theirs = reference(system, q0, v0, 0.3, ours.t)
    assert len(theirs.contacts) >= 1
    np.testing.assert_allclose(ours.q, theirs.q, atol=1e-11)


def test_dashpot_that_couples_the_modes():
    stops = [Contact([0.0, 0.0, 1.0], Hysteretic(1e7, 0.8)), Contact([0.0, -1.0, 0.0], PiecewiseLinear([1e5]), 2e-3)]
    system = coupled_dashpot(stops, [([1.0, 0.0, 0.5], fb.Harmonic(50.0, 60.0, 0.3))])
    q0, v0 = [1e-3, 0.0, 2e-3], [0.1, -0.2, -1.0]
    ours, steps = (integrate(system, q0, v0, 0.2, 0.01, method) for method in (FINE, HenonRK2(2e-5, 2e-6)))
    theirs = reference(system, q0, v0, 0.2, ours.t)
    assert {int(c[0]) for c in theirs.contacts} == {0, 1}
    assert distance(ours, theirs) < 1e-10
    assert distance(steps, theirs) < 2e-4


# --- signals ------------------------------------------------------------------------------------------------------


class Nodes:
    """A sine handed over as a table of values, slopes and curvatures, good for ``length`` seconds."""

    def __init__(self, length=math.inf):
        self.length = length

    def __call__(self, t):
        return 3.0 * np.sin(40.0 * np.asarray(t) + 0.2)

    def nodes(self, duration, rtol):
        dt = 1e-3
        t = dt * np.arange(math.ceil(min(duration, self.length) / dt) + 1)
        s = 3.0 * np.sin(40.0 * t + 0.2)
        return dt, np.stack([s, 120.0 * np.cos(40.0 * t + 0.2), -1600.0 * s], axis=1)


def hit_by(signal, duration=0.5, method=FINE):
    """A mode over a stop under one load."""
    system = System.modal([30.0], 0.02, [Contact([1.0], Hysteretic(1e7, 0.5))], [([1.0], signal)])
    return integrate(system, [0.0], [0.0], duration, 0.01, method)


def test_tones_nodes_and_plain_callables_give_one_answer():
    tones = hit_by(fb.Harmonic(3.0, 40.0, 0.2 - math.pi / 2))
    nodes, plain = hit_by(Nodes()), hit_by(lambda t: 3.0 * np.sin(40.0 * np.asarray(t) + 0.2))
    assert len(tones.contacts) >= 3
    assert distance(nodes, tones) < 1e-10
    assert distance(plain, tones) < 1e-9


def test_several_tones_equal_several_loads():
    many = fb.Multisine([1.0, 2.0], [31.0, 47.0], [0.1, 0.2])
    separate = [([1.0], fb.Harmonic(1.0, 31.0, 0.1)), ([2.0], fb.Harmonic(1.0, 47.0, 0.2))]
    stop = [Contact([1.0], Hertz(1e7))]
    runs = [
        integrate(System.modal([30.0], 0.02, stop, loads), [0.0], [0.0], 0.5, 0.01, FINE)
        for loads in ([([1.0], many)], separate)
    ]
    assert distance(*runs) < 1e-11


@pytest.mark.parametrize("dt", [None, 0.01])
def test_a_tone_of_negative_frequency_is_its_mirror_image(dt):
    """Re a e^{iωt} is Re ā e^{-iωt}; without samples the motion was wrong, with them it was refused."""
    signals = Tone(1.0 + 2.0j, 31.0), Tone(1.0 - 2.0j, -31.0)
    systems = [System.modal([30.0], 0.02, [Contact([1.0], Hertz(1e7))], [([1.0], signal)]) for signal in signals]
    here, mirrored = (integrate(system, [0.0], [0.0], 0.5, dt).end for system in systems)
    np.testing.assert_array_equal(here, mirrored)


def test_a_plain_callable_may_change_the_times_it_is_given():
    def shifted(t):
        t += 0.1
        return np.sin(31.0 * t)

    assert distance(hit_by(shifted), hit_by(lambda t: np.sin(31.0 * (t + 0.1)))) == 0.0


def test_a_duration_may_be_an_array_without_dimensions():
    system, start = System.modal([30.0], 0.02, [Contact([1.0], Hertz(1e7))]), ([0.0], [-0.1])
    run = integrate(system, *start, np.array(0.5))
    np.testing.assert_array_equal(run.end, integrate(system, *start, 0.5).end)
    np.testing.assert_array_equal(integrate_many(system, *np.array(start)[:, None], np.array(0.5)).q, run.q)


def test_plain_loads_that_the_first_nodes_miss_are_no_jumps():
    """At these the sine is zero but for rounding, which was taken for a jump."""
    omega = 2.0 * np.pi * 64.0
    loads = lambda t: np.sin(omega * np.asarray(t)), Tone(-1j, omega)
    ends = [integrate(System([[1.0]], [[0.1]], [[100.0]], loads=[([1.0], load)]), [0.0], [0.0], 32.0) for load in loads]
    np.testing.assert_allclose(ends[0].q, ends[1].q, atol=1e-9)


test_signals_that_are_no_signals_are_refused = refused_by(
    lambda signal: hit_by(signal),
    (Nodes(length=0.2), r"the signal of load 0 ends at 0.2 s, the run at 0.5 s"),
    (lambda t: 1.0, r"the signal of load 0 must broadcast: \(65,\) times gave \(\) values; a constant is np.full_like"),
    (lambda t: 1.0 if t > 0.3 else 0.0, r"the signal of load 0 must take an array of times, got ValueError .*np.where"),
    (math.sin, r"the signal of load 0 must take an array of times, got TypeError .*np.sin for math.sin"),
    (lambda t: np.where(np.asarray(t) > 0.3, np.nan, 1.0), r"the signal of load 0 is nan at t = 0.304688 s"),
    (lambda t: np.exp(1j * t), "the signal of load 0 must be real"),
    (lambda t: np.where(t > 0.3, 1.0, 0.0), r"the signal of load 0 jumps at t = 0.3 s"),  # took up to 90 s
    (lambda t: 10.0 * np.sin(7.0 * t) + 1e-2 * (t > 0.3), r"the signal of load 0 jumps at t = 0.3 s"),
    (lambda t: np.abs(np.sin(7.0 * t - 1.0)), r"the signal of load 0 has a kink at t = 0.142857 s"),  # 90 s, 3.3 GB
    (lambda t: np.interp(t, [0.0, 0.1, 0.5], [0.0, 1.0, 0.0]), r"load 0 has a kink at t = 0.1 s, where no spline"),
    (lambda t: np.ones(65), r"the signal of load 0 must broadcast: \(4096,\) times gave \(65,\) values"),
    (Tone(1.0, np.nan), r"tones\(\) of the signal of load 0 must be finite"),
    (Tone(np.inf, 31.0), r"tones\(\) of the signal of load 0 must be finite"),
    (Tone(np.array([1.0, 2.0]), 31.0), r"tones\(\) of the signal of load 0 must give frequencies and as many"),
)

WAVES, STILL = np.array([0.1 + 0.2j]), np.zeros(1)  # as eigenvectors are: numpy drops imaginary parts with a warning
ONE = System([[1.0]], [[0.1]], [[100.0]])

test_complex_arrays_are_no_motions = refused_by(
    lambda ask: ask(),
    (lambda: integrate(ONE, WAVES, STILL, 1.0), "q0 must be real numbers"),
    (lambda: integrate(ONE, STILL, WAVES, 1.0), "q_dot0 must be real numbers"),
    (lambda: integrate(ONE, STILL, STILL, 1.0, WAVES), "dt as output times must be real numbers"),
    (lambda: integrate_many(ONE, WAVES[None], STILL[None], 1.0), "q0 must be real numbers"),
    (lambda: orbit(ONE, 1.0, np.append(WAVES, STILL)), "start must be real numbers"),
    (lambda: System([[1.0]], [[0.1]], [[100.0]], loads=[(WAVES, np.sin)]), "vector of load 0 must be real numbers"),
    (lambda: Contact(WAVES, KelvinVoigt(1e3, 0.0)), "direction of a Contact must be real numbers"),
)


# --- ends and failures --------------------------------------------------------------------------------------------


class Interrupt:
    """Progress callback that behaves like Ctrl-C at its n-th call."""

    def __init__(self, after):
        self.left = after

    def __call__(self, t):
        self.left -= 1
        if self.left < 0:
            raise KeyboardInterrupt


@pytest.mark.parametrize("dt", [None, 0.01])
def test_ctrl_c_keeps_what_was_computed(dt):
    system, method = System.modal([50.0], 0.05, loads=[([1.0], fb.Harmonic(1.0, 45.0))]), HenonRK2(1e-5, 1e-5)
    partial = integrate(system, [0.0], [0.1], 10.0, dt, method, progress=Interrupt(2))
    assert partial.status is Status.INTERRUPTED
    assert not partial.status.good
    reached = partial.t[-1]
    assert 0.3 < reached < 5.0
    whole = integrate(system, [0.0], [0.1], reached, dt, method)
    assert partial.q.shape == whole.q.shape
    np.testing.assert_allclose(partial.q, whole.q, atol=1e-12)
    assert np.all(np.isfinite(partial.energy.residual))


def test_ctrl_c_inside_a_contact_logs_it_as_open():
    system = free_mass(PiecewiseLinear([1e2]), loads=[([-1.0], fb.Harmonic(1.0, 0.0))])
    partial = integrate(system, [0.0], [-1.0], 100.0, method=HenonRK2(1e-6, 1e-6), progress=Interrupt(1))
    assert partial.status is Status.INTERRUPTED
    t, omega = partial.t[0], 10.0
    assert 0.0 < t < math.pi / omega
    assert -partial.q[0, 0] == pytest.approx(np.sin(omega * t) / omega + (1 - np.cos(omega * t)) / omega**2, rel=1e-9)
    assert np.isnan(partial.contacts.t_out).tolist() == [True]


def test_progress_is_told_the_time():
    seen = []
    integrate(System.modal([5.0], 0.1), [1.0], [0.0], 0.5, method=HenonRK2(1e-5, 1e-5), progress=seen.append)
    assert len(seen) >= 2
    assert seen == sorted(seen)
    assert seen[-1] == 0.5


def test_heun_on_an_undamped_high_mode_diverges_and_says_so():
    system, method = System.modal([10.0, 5000.0], 0.0), HenonRK2(1e-4, 1e-4, force_unstable=True)
    expected = r"stopped at t = .* s of 100 s: the motion holds more energy .*mode 2 of 2 \(ω = 5000 rad/s\).* try "
    with pytest.raises(SolverError, match=expected):
        integrate(system, [1.0, 1e-6], [0.0, 0.0], 100.0, 0.01, method)
    partial = integrate(system, [1.0, 1e-6], [0.0, 0.0], 100.0, 0.01, method, check=False)
    assert partial.status is Status.GAINED
    assert not partial.status.good
    assert np.all(np.isfinite(partial.q))
    assert 0.0 < partial.t[-1] < 100.0


def test_heun_grows_at_its_known_rate():
    # |R|² = 1 + (hω)⁴/4 a step on an undamped mode
    h, omega, steps = 1e-3, 100.0, 4000
    run = integrate(System.modal([omega], 0.0), [1.0], [0.0], h * steps, method=HenonRK2(h, h))
    growth = math.hypot(run.q[0, 0], run.q_dot[0, 0] / omega)
    assert math.log(growth) == pytest.approx(0.5 * steps * math.log1p((h * omega) ** 4 / 4), rel=1e-9)


@law
def brittle(delta, delta_dot, entry_rate, stiffness, depth):
    """A spring that has no value beyond a depth."""
    return stiffness * delta + math.sqrt(depth - delta) - math.sqrt(depth)


METHODS = [DormandPrince(), HenonRK2(1e-4, 1e-5)]


@pytest.mark.parametrize("method", METHODS)
def test_law_that_is_finite_where_the_run_goes_is_fine(method):
    run = integrate(free_mass(brittle(stiffness=1e4, depth=0.05)), [0.0], [-1.0], 0.1, method=method)
    assert run.status is Status.DONE
    assert 0.009 < run.contacts.peak_indentation[0] < 0.011


@pytest.mark.parametrize("method", METHODS)
def test_law_that_turns_nan_during_the_run_is_named_as_the_cause(method):
    """The interrupt ends a loop that would not end by itself."""
    system = free_mass(brittle(stiffness=1e4, depth=0.005))
    with pytest.raises(SolverError, match="a contact law gave a force that is not finite"):
        integrate(system, [0.0], [-1.0], 0.1, method=method, progress=Interrupt(2))


EVERY = [DormandPrince(), Exponential(), RK4(1e-3, 1e-4), Newmark(1e-3, 1e-4), HenonRK2(1e-3, 1e-4)]


@law
def breaks(delta, delta_dot, entry_rate, k):
    """Finite where laws are looked at before a run, and not farther in."""
    return np.nan if delta > 0.01 else k * delta


@law
def stalls(delta, delta_dot, entry_rate, k):
    """Not finite while it goes in."""
    return np.nan if delta_dot > 1e-9 else k * delta


def pressed(chosen, push=0.0):
    """A mass that begins 20 mm in under a constant force, N."""
    contacts, loads = [Contact([1.0], chosen)], [([-1.0], lambda t: push + 0.0 * np.asarray(t))]
    return System(np.eye(1), [[0.1]], [[100.0]], contacts, loads if push else []), [-0.02], [0.0]


@pytest.mark.parametrize("method", EVERY, ids=lambda one: type(one).__name__)
def test_a_law_that_is_not_finite_at_the_start_is_named(method):
    """At t = 0, where any step however short still moves the clock."""
    with pytest.raises(SolverError, match=r"stopped at t = 0 s .* a contact law gave a force that is not finite"):
        integrate(*pressed(breaks(k=100.0)), 1.0, method=method)


@pytest.mark.parametrize("method", EVERY[:2], ids=lambda one: type(one).__name__)
def test_a_law_that_is_not_finite_later_on_is_named(method):
    """Finite at t = 0 itself, and no more once a load has pushed the mass in."""
    with pytest.raises(SolverError, match="a contact law gave a force that is not finite"):
        integrate(*pressed(stalls(k=100.0), 10.0), 1.0, method=method)


def test_a_law_that_is_not_finite_is_named_with_many_starts():
    """The same for many starts at once."""
    system, q, v = pressed(breaks(k=100.0))
    with pytest.raises(SolverError, match=r"t = 0 s of 1 s: a contact law gave .* \(2 of 2 starts failed\)"):
        integrate_many(system, [q, q], [v, v], 1.0, Exponential())


# --- refused arguments --------------------------------------------------------------------------------------------


test_arguments_are_refused = refused_by(
    lambda arguments: integrate(linear_stop(), *arguments),
    (([math.nan], [0.0], 1.0), "q0 must be finite, got nan at coordinate 0"),
    (([0.0], [math.inf], 1.0), "q_dot0 must be finite, got inf at coordinate 0"),
    (([0.0, 0.0], [0.0], 1.0), r"q0 must have shape \(1,\), got \(2,\)"),
    (([0.0], [[0.0]], 1.0), r"q_dot0 must have shape \(1,\), got \(1, 1\)"),
    (([0.0], [0.0], 0.0), "duration must be positive and finite"),
    (([0.0], [0.0], 1e300), r"duration must be at most 1e\+50 s, got 1e\+300"),
    (([0.0], [0.0], math.nan), "duration must be positive and finite"),
    (([0.0], [0.0], math.inf), "duration must be positive and finite"),
    (([0.0], [0.0], 1e-300), "duration must be at least 1e-50 s, got 1e-300"),
    (([0.0], [0.0], 1.0, 0.0), "dt must be positive and finite"),
    (([0.0], [0.0], 1.0, math.nan), "dt must be positive and finite"),
    (([0.0], [0.0], 1.0, 1.5), r"dt = 1\.5 s is longer than the duration of 1 s.*or leave dt out"),
    (([0.0], [0.0], 1.0, [0.1, 0.1]), "dt as output times must be one increasing row"),
    (([0.0], [0.0], 1.0, [[0.1, 0.2]]), "dt as output times must be one increasing row"),
    (([0.0], [0.0], 1.0, [0.1, math.nan]), "dt as output times must be one increasing row"),
    (([0.0], [0.0], 1.0, [-0.1, 0.2]), r"output times must lie in \[0, 1\] s, got -0.1 to 0.2 s"),
    (([0.0], [0.0], 1.0, [0.1, 1.2]), r"output times must lie in \[0, 1\] s, got 0.1 to 1.2 s"),
    (([0.0], [0.0], 1.0, 1e-12), r"asks for 1e\+12 samples, more than 5e\+08; choose a larger dt or a shorter"),
    (([0.0], [0.0], 1e40, 1e-300), "asks for inf samples, more than"),
)


@pytest.mark.parametrize("method", ["DormandPrince", DormandPrince, 3])
def test_something_that_is_no_method_is_refused(method):
    with pytest.raises((TypeError, ValueError), match=r"method must be"):
        integrate(linear_stop(), [0.0], [0.0], 1.0, method=method)


@pytest.mark.parametrize("rtol", [0.0, 1e-15, 0.1, -1e-8, math.nan, math.inf])
def test_tolerance_out_of_range_is_refused(rtol):
    with pytest.raises(ValueError, match=r"rtol must lie in \[1e-14, 1e-2\], got"):
        DormandPrince(rtol=rtol)


@pytest.mark.parametrize("mass", [1.0, 1e-9, 1e-15])
def test_what_a_pressed_stop_sets_moving_from_rest_keeps_to_rtol(mass):
    """δ = δ₀ cos ωt until it opens at t = π/2ω with the speed δ₀ω, whatever the size of √m δ₀ beside atol."""
    depth, omega, rtol = 1e-9, 1e4, 1e-10
    stop = Contact([1.0], KelvinVoigt(mass * omega**2, 0.0), gap=-depth)
    ball = System([[mass]], [[0.0]], [[0.0]], [stop])
    log = integrate(ball, [0.0], [0.0], 1e-3, method=DormandPrince(rtol)).contacts
    assert log.t_out[0] == pytest.approx(0.5 * math.pi / omega, rel=30.0 * rtol)
    assert log.speed_out[0] == pytest.approx(depth * omega, rel=30.0 * rtol)


@pytest.mark.parametrize("bad", [0.0, -1e-5, math.nan, math.inf])
def test_absolute_tolerances_and_constant_steps_must_be_positive(bad):
    for make, name in (
        (lambda: DormandPrince(atol=bad), "atol"),
        (lambda: HenonRK2(bad, 1e-6), "dt_flight"),
        (lambda: HenonRK2(1e-5, bad), "dt_contact"),
    ):
        with pytest.raises(ValueError, match=f"{name} must be positive and finite"):
            make()


test_unknown_options_are_refused = refused(
    (lambda: DormandPrince(rtoll=1e-8), r"rtoll"),
    (lambda: integrate(linear_stop(), [0.0], [0.0], 1.0, tangents=True), r"tangents"),
    error=TypeError,
)


def test_law_that_is_nan_at_rest_is_refused_before_computing():
    class Nowhere(KelvinVoigt):
        @property
        def parameters(self):
            return np.full(6, np.nan)

    with pytest.raises(ValueError, match=r"the law of contact 0 is not finite at delta = 1e-12 m"):
        integrate(free_mass(Nowhere(1e6, 1.0)), [1.0], [0.0], 0.1)


@dataclasses.dataclass(frozen=True, slots=True)
class SlottedTone:
    """A tone whose amplitude is an array that may be written to."""

    amplitude: np.ndarray

    def __call__(self, t):
        return self.amplitude[0] * np.cos(3.0 * np.asarray(t))

    def tones(self):
        return np.array([3.0]), self.amplitude + 0j


def test_an_array_in_a_slot_may_change():
    """The second run had the amplitude of the first."""
    tone = SlottedTone(np.ones(1))
    system = System(np.eye(1), 0.1 * np.eye(1), 4.0 * np.eye(1), loads=[([1.0], tone)])
    once = integrate(system, [0.0], [0.0], 1.0, 0.5).q
    tone.amplitude[0] = 2.0
    np.testing.assert_allclose(integrate(system, [0.0], [0.0], 1.0, 0.5).q, 2.0 * once, rtol=1e-12)
