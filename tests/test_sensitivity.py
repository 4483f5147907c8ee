"""Derivatives of runs and orbits: closed forms, differences of runs, homogeneity, the discrete tangent, refusals."""

import math
import tracemalloc
import warnings
from dataclasses import replace

import numpy as np
import pytest
from differences import five_points
from oscillators import Tone
from problems import TIP, paper_scene
from refusals import refused

import fembeam as fb
from contacts import Hertz, Hysteretic, Iwan, Jenkins, KelvinVoigt, PiecewiseLinear, Viscoelastic, law
from fembeam.scene import with_value
from fembeam.study.measure import cut
from solvers import Contact, Exponential, Nearby, NoDerivativeError, System, integrate, sensitivity
from solvers.sensitivities.panels import Clock, X, largest

FINE = Exponential(1e-11)
MASS, SPEED, GAP, STIFFNESS = 2.0, 0.7, 0.1, 5e3
OF_CONTACTS = {"t_in": "entries", "t_out": "exits", "peak_force": "peak_force", "impulse": "impulse"}


def ball(gap=GAP, law=None):
    """A mass that flies towards a stop; δ = q - gap."""
    law = PiecewiseLinear([STIFFNESS]) if law is None else law
    return System([[MASS]], [[0.0]], [[0.0]], [Contact([-1.0], law, gap)])


def thrown(make, value, **options):
    """Derivatives of the flight from 0 at SPEED over half a second."""
    nearby = Nearby.of(make, value, 1e-3 * value)
    return sensitivity(make(value), [0.0], [SPEED], 0.5, [0.05, 0.5], nearby, method=FINE, **options)


# --- closed forms ----------------------------------------------------------------------------------------------------


def test_a_linear_spring_by_its_gap():
    """t_in = g/v, t_out = t_in + π √(m/k), then q = g - v (t - t_out): everything moves with the gap."""
    found = thrown(ball, GAP)
    np.testing.assert_allclose(found.entries, 1.0 / SPEED, rtol=1e-9)
    np.testing.assert_allclose(found.exits, 1.0 / SPEED, rtol=1e-9)
    np.testing.assert_allclose(np.append(found.peak_force, found.impulse), 0.0, atol=1e-6)
    np.testing.assert_allclose(found.states, [[0.0, 0.0], [2.0, 0.0]], atol=1e-8)


def test_a_linear_spring_by_its_stiffness():
    """Contact time π √(m/k), peak force v √(k m), impulse 2 m v."""
    found = thrown(lambda k: ball(law=PiecewiseLinear([k])), STIFFNESS)
    later = -0.5 * math.pi * math.sqrt(MASS / STIFFNESS) / STIFFNESS
    assert found.entries[0] == 0.0
    assert found.exits[0] == pytest.approx(later, rel=1e-8)
    assert found.peak_force[0] == pytest.approx(0.5 * SPEED * math.sqrt(MASS / STIFFNESS), rel=1e-8)
    assert found.impulse[0] == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(found.states[-1], [SPEED * later, 0.0], atol=1e-11)


def test_a_linear_spring_by_the_speed():
    found = sensitivity(ball(), [0.0], [SPEED], 0.5, [0.5], start=[0.0, 1.0], method=FINE)
    assert found.entries[0] == pytest.approx(-GAP / SPEED**2, rel=1e-9)
    assert found.peak_force[0] == pytest.approx(math.sqrt(STIFFNESS * MASS), rel=1e-8)
    assert found.impulse[0] == pytest.approx(2.0 * MASS, rel=1e-8)


def test_a_force_that_jumps_at_entry():
    """A dashpot alone: v' = -c v/m from the entry on, so q = g + (m v/c)(1 - d), d = exp(-c (T - g/v)/m)."""
    c = 3.0
    found = thrown(lambda gap: ball(gap, KelvinVoigt(1e-9, c)), GAP)
    decay = math.exp(-c * (0.5 - GAP / SPEED) / MASS)
    np.testing.assert_allclose(found.states[-1], [1.0 - decay, c / MASS * decay], atol=1e-8)
    assert found.impulse[0] == pytest.approx(-c * decay, abs=1e-8)
    assert found.peak_force[0] == pytest.approx(0.0, abs=1e-6)  # c v, at the entry
    assert np.isnan(found.exits[0])


def test_the_peak_of_a_contact_that_only_pulls():
    """A dashpot holds back what leaves it from the start on: the log has the peak 0, whatever its strength."""
    start = [GAP + 1e-3], [-SPEED], 0.01
    strengths = Nearby.of(lambda c: ball(law=KelvinVoigt(1e3, c)), 20.0, 1e-2)
    system = ball(law=KelvinVoigt(1e3, 20.0))
    assert integrate(system, *start).contacts.peak_force == [0.0]
    found = sensitivity(system, *start, nearby=strengths, method=FINE)
    assert found.impulse[0] < -1e-5
    assert found.peak_force[0] == 0.0


KNOT = 0.02


@law(knots=[KNOT])
def breaking(delta, delta_dot, entry_rate, stiffness=STIFFNESS):
    return stiffness * delta * (1.0 if delta <= KNOT else 0.2)


def test_a_peak_just_before_the_force_drops():
    """k δ up to the knot, a fifth of it beyond: until it turns back, the largest force is k × knot."""

    def made(k):
        return ball(law=breaking(stiffness=k))

    k = 0.1 * STIFFNESS
    found = sensitivity(made(k), [0.0], [SPEED], 0.24, nearby=Nearby.of(made, k, 1.0), method=FINE)
    assert found.contacts.peak_force[0] == pytest.approx(k * KNOT, rel=1e-9)
    assert found.peak_force[0] == pytest.approx(KNOT, rel=1e-8)


@pytest.mark.parametrize("speed", [1e-6, 1e-3, 1e3])
def test_damping_by_the_entry_rate_scales_with_it(speed):
    """Of F = K δ^p (1 + a δ̇/v) and entries at v: F ~ v^(2p/(p + 1)) at any v, the impulse as v."""
    law = Hysteretic(2e8, damping_factor=30.0, entry_rate_floor=1e-3 * speed)
    found = sensitivity(ball(GAP * speed, law), [0.0], [speed], 0.5, start=[0.0, 1.0], method=FINE)
    log, p = found.contacts, law.exponent
    assert found.peak_force[0] == pytest.approx(2.0 * p / (p + 1.0) * log.peak_force[0] / speed, rel=3e-6)
    assert found.impulse[0] == pytest.approx(log.impulse[0] / speed, rel=1e-9)


@pytest.mark.parametrize("parts", [1, 2])
def test_the_floor_of_entry_rates_where_it_acts(parts):
    """F = K δ^p (1 + a δ̇/floor) of an entry below the floor is the same for a and the floor made larger alike."""
    a, floor = 0.5, 2.0 * SPEED

    def made(a, floor):
        varied = Hysteretic(1e6, damping_factor=a, entry_rate_floor=floor)
        beside = Hysteretic(1e6, damping_factor=0.2, entry_rate_floor=2.0 * SPEED)
        return ball(law=varied if parts == 1 else varied + beside)

    by_a, by_floor = thrown(lambda x: made(x, floor), a), thrown(lambda x: made(a, x), floor)
    for read in (lambda one: one.exits, lambda one: one.peak_force, lambda one: one.impulse, lambda one: one.end):
        np.testing.assert_allclose(floor * read(by_floor), -a * read(by_a), rtol=1e-7)
        assert np.all(read(by_a) != 0.0)


# --- differences of runs ---------------------------------------------------------------------------------------------

OMEGA, ZETA = np.array([109.13, 790.6]), np.array([0.02, 0.01])
PHI, GAMMA = np.array([6.2, -1.9]), np.array([0.16, 0.02])
START = np.array([1.3e-4, -2e-5, -0.03, 0.02])


def beam(law=None, amplitude=40.0, omega=195.0, gap=2e-5, zeta=1.0, sampled=False, turn=0.0, stiffer=1.0):
    """Two modes between two stops."""
    law = Hysteretic(2.1e8, damping_factor=0.5625) if law is None else law
    contacts = [Contact(PHI + turn, law, gap), Contact(-0.8 * PHI, Hertz(2.1e8), 3e-4)]
    tone = Tone(amplitude, omega)
    signal = (lambda t: tone(t)) if sampled else tone
    return System.modal(OMEGA * [1.0, stiffer], zeta * ZETA, contacts, [(GAMMA, signal)])


CASES = {
    "gap": (lambda p: beam(gap=p), 2e-5),
    "stiffness": (lambda p: beam(Hysteretic(p, damping_factor=0.5)), 2.1e8),
    "damping factor": (lambda p: beam(Hysteretic(2.1e8, damping_factor=p)), 0.5),
    "dashpot": (lambda p: beam(KelvinVoigt(2e5, p)), 30.0),
    "dashpot of a force cut at zero": (lambda p: beam(KelvinVoigt(2e5, p, clamp=True)), 300.0),
    "spring of a force cut at zero": (lambda p: beam(KelvinVoigt(p, 300.0, clamp=True)), 2e5),
    "a force cut at zero": (lambda p: beam(KelvinVoigt(2e5, 300.0, clamp=True), gap=p), 2e-5),
    "knot": (lambda p: beam(PiecewiseLinear([1e5, 4e5], knots=[p])), 1e-5),
    "amplitude": (lambda p: beam(amplitude=p), 40.0),
    "frequency": (lambda p: beam(omega=p), 195.0),
    "frequency of a sampled signal": (lambda p: beam(omega=p, sampled=True), 195.0),
    "damping": (lambda p: beam(zeta=p), 1.0),
    "structure": (lambda p: beam(stiffer=p), 1.0),
    "direction": (lambda p: beam(turn=p - 1.0), 1.0),
}


def test_a_sum_with_a_part_that_is_cut_at_zero():
    """The kink of the part is no zero of the sum; runs themselves do not land on it."""

    def make(p):
        return beam(KelvinVoigt(2e5, p, clamp=True) + PiecewiseLinear([1e5]))

    def run(step):
        return integrate(make(300.0 + step), START[:2], START[2:], 0.025, method=Exponential(1e-12)).end

    found = sensitivity(make(300.0), START[:2], START[2:], 0.025, [0.025], Nearby.of(make, 300.0, 0.03), method=FINE)
    expected = five_points(run, 6e-3)
    np.testing.assert_allclose(found.states[0], expected, rtol=0, atol=1e-5 * np.abs(expected).max())
    assert found.roughness < 1e-6


@pytest.mark.parametrize("name", [name for name in CASES if name not in ("gap", "dashpot", "amplitude", "frequency")])
def test_against_differences_of_runs(name):
    """States, times, peaks and impulses of some six contacts with two stops, to 1e-6 of the largest of each."""
    (make, value), duration, t = CASES[name], 0.025, [0.01, 0.02]

    def run(step):
        return integrate(make(value + step), START[:2], START[2:], duration, t, Exponential(1e-12))

    nearby = Nearby.of(make, value, 1e-4 * value)
    found = sensitivity(make(value), START[:2], START[2:], duration, t, nearby, method=FINE)
    step = 1e-4 * value  # rounding of peaks is 1e-11 of them: with 2e-5 differences were off by 1e-6
    runs = {k * step: run(k * step) for k in (-2, -1, 1, 2)}
    expected = five_points(lambda h: np.hstack((runs[h].q, runs[h].q_dot)), step)
    np.testing.assert_allclose(found.states, expected, rtol=0, atol=1e-6 * np.abs(expected).max())
    assert len(found.contacts) >= 4
    for logged, derived in OF_CONTACTS.items():
        expected = five_points(lambda h, logged=logged: getattr(runs[h].contacts, logged), step)
        size = np.nanmax(np.abs(expected))
        np.testing.assert_allclose(getattr(found, derived), expected, rtol=0, atol=1e-6 * size, err_msg=logged)


@pytest.mark.parametrize("name", ["gap", "dashpot", "knot", "damping"])
def test_the_derivative_by_the_start_is_the_discrete_tangent(name):
    """Two ways with nothing in common: collocation along the motion, and the integrator's own steps, linearised."""
    make, value = CASES[name]
    found = sensitivity(make(value), START[:2], START[2:], 0.025, method=FINE)
    other = integrate(make(value), START[:2], START[2:], 0.025, method=FINE, tangent=True).tangent
    np.testing.assert_allclose(found.matrix, other, rtol=0, atol=1e-8 * np.abs(other).max())


def slider(limit):
    """Three masses with friction in two places."""
    laws = Jenkins(50.0, limit), Iwan([30.0, 20.0], [0.1, 0.3])
    rows = [-1.0, -0.5, 0.3], [-0.2, 0.9, -0.5]
    contacts = [Contact(row, law, always=True) for row, law in zip(rows, laws, strict=True)]
    return System.modal([0.8, 2.0, 3.5], 0.01, contacts, [([1.0, 0.3, 0.0], Tone(0.4, 1.3))])


def test_laws_with_memory():
    """By the limit of a slider, through stick and slip, what is latched at the end included."""
    limit, duration, q, v = 0.4, 8.0, np.zeros(3), np.array([1.0, -0.5, 0.3])
    found = sensitivity(slider(limit), q, v, duration, nearby=Nearby.of(slider, limit, 1e-3), method=FINE)

    def end(step):
        return integrate(slider(limit + step), q, v, duration, method=Exponential(1e-12)).end

    expected = five_points(end, 1e-5)
    assert len(found.solution.transitions) > 8
    np.testing.assert_allclose(found.end, expected, rtol=0, atol=1e-7 * np.abs(expected).max())
    other = integrate(slider(limit), q, v, duration, method=FINE, tangent=True).memory_tangent
    np.testing.assert_allclose(found.matrix, other, rtol=0, atol=1e-9 * np.abs(other).max())


@pytest.mark.parametrize(("flight", "fastest"), [(True, 3e3), (False, 3e3), (False, 2e4)])
def test_many_modes_and_samples_need_little_memory(flight, fastest):
    """Samples of a flight, or panels of one contact, of 60 modes: tables of all at once took 720, 190 and 390 MB."""
    K = np.diag(np.append(0.0, np.linspace(100.0, fastest, 59)) ** 2)
    contact = Contact(-np.ones(60), Hertz(1e3), 1.0 if flight else 1e-3)
    system = System(np.eye(60), 0.0 * K, K, [contact])
    times = np.linspace(0.0, 0.1, 3000 if flight else 2)
    start = np.eye(60)[0]
    sensitivity(ball(), [0.0], [SPEED], 0.5, [0.5], start=[0.0, 1.0])  # compiles
    tracemalloc.start()
    found = sensitivity(system, 0.0 * start, SPEED * start, 0.1, times, start=np.append(0.0 * start, start))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 100e6
    assert len(found.contacts) == (0 if flight else 1)
    assert len(found.solution.t) == len(times)


def test_a_run_held_in_pieces_and_its_progress(monkeypatch):
    """Pieces of 50 states; the times reached are told on the way."""
    K = np.diag(np.append(0.0, np.linspace(100.0, 2000.0, 19)) ** 2)
    start, told = np.eye(20)[0], []

    def found(**options):
        system = System(np.eye(20), 0.0 * K, K, [Contact(-np.ones(20), Hertz(1e5), 1e-3)])
        start_change = np.append(0.0 * start, start)
        return sensitivity(system, 0.0 * start, SPEED * start, 0.1, [0.03, 0.1], start=start_change, **options)

    whole = found()
    monkeypatch.setattr("solvers.sensitivities.stretches._MOST_KEPT", 2000)
    again = found(progress=told.append)
    assert len(again.contacts) == 1
    for name in ("states", "matrix", "entries", "exits", "peak_force", "impulse"):
        one, other = getattr(whole, name), getattr(again, name)
        np.testing.assert_allclose(other, one, rtol=0, atol=1e-9 * np.nanmax(np.abs(one)))
    assert told == sorted(told)
    assert told[-1] == 0.1
    assert len(told) == 4


def test_panels_beyond_count_are_refused_before_they_are_passed():
    """Five million of one mode; those of each stretch were counted alone."""

    def driven(push):
        return System.modal([1e6], [0.02], loads=[([1.0], Tone(push, 3.0))])

    with pytest.raises(ValueError, match="too many for 1 mode; keep fewer modes, or shorten the run"):
        sensitivity(driven(1.0), [0.0], [0.0], 7.5, nearby=Nearby.of(driven, 1.0, 1e-3))


# --- sampled loads ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("length", [1e-3, 1e-4])
def test_a_pulse_that_hides_within_a_panel(length):
    """One slow mode in flight: motion grows with the pulse's peak, and moves with its beginning."""
    knock, times = fb.Pulse(100.0, length, 0.0103), np.linspace(0.02, 0.4, 7)

    def by(name):
        def make(value):
            return System.modal([110.0], [0.02], loads=[([1.0], replace(knock, **{name: value}))])

        value = getattr(knock, name)
        nearby = Nearby.of(make, value, 1e-6 * value)
        return sensitivity(make(value), [0.0], [0.0], 0.4, times, nearby, method=FINE)

    by_peak, by_begin = by("peak"), by("at")
    run = integrate(System.modal([110.0], [0.02], loads=[([1.0], knock)]), [0.0], [0.0], 0.4, times, FINE)
    size = np.abs(run.q).max()
    np.testing.assert_allclose(100.0 * by_peak.states[:, :1], run.q, rtol=0, atol=1e-6 * size)
    np.testing.assert_allclose(-by_begin.states[:, :1], run.q_dot, rtol=0, atol=1e-6 * np.abs(run.q_dot).max())


def test_the_peak_under_a_load_with_kinks():
    """Straight lines between samples, ten of them in a contact: the top of the force is met between two kinks."""
    load = np.random.default_rng(3).standard_normal(41)
    record = fb.Record(1e-3 * np.arange(41), 200.0 * load, quantity="force", interpolation="linear")

    def make(gap):
        return System.modal([150.0], [0.01], [Contact([-1.0], PiecewiseLinear([1e5]), gap)], [([1.0], record)])

    gap, duration = 1e-3, 0.04
    found = sensitivity(make(gap), [0.0], [0.3], duration, nearby=Nearby.of(make, gap, 1e-6), method=FINE)

    def peaks(step):
        return integrate(make(gap + step), [0.0], [0.3], duration, method=Exponential(1e-12)).contacts.peak_force

    expected = five_points(peaks, 1e-6)
    np.testing.assert_allclose(found.peak_force, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


# --- invariants ------------------------------------------------------------------------------------------------------


def test_euler_s_theorem_of_homogeneous_functions():
    """With a linear law gap, load and start times λ give motion and forces times λ, at the same times of contact."""
    law, gap, amplitude, t = PiecewiseLinear([3e5]), 2e-5, 40.0, [0.01, 0.02]

    def derived(make, value, start=None):
        nearby = None if make is None else Nearby.of(make, value, 1e-3 * value)
        return sensitivity(one(gap, amplitude), START[:2], START[2:], 0.02, t, nearby, start, FINE)

    def one(gap, amplitude):
        return System.modal(OMEGA, ZETA, [Contact(PHI, law, gap)], [(GAMMA, Tone(amplitude, 195.0))])

    parts = [
        (gap, derived(lambda p: one(p, amplitude), gap)),
        (amplitude, derived(lambda p: one(gap, p), amplitude)),
        (1.0, derived(None, 0.0, START)),
    ]
    run = integrate(one(gap, amplitude), START[:2], START[2:], 0.02, t, FINE)
    total = {name: sum(weight * getattr(part, name) for weight, part in parts) for name in OF_CONTACTS.values()}
    states = sum(weight * part.states for weight, part in parts)
    np.testing.assert_allclose(states, np.hstack((run.q, run.q_dot)), rtol=1e-7)
    np.testing.assert_allclose(total["peak_force"], run.contacts.peak_force, rtol=1e-7)
    np.testing.assert_allclose(total["impulse"], run.contacts.impulse, rtol=1e-7)
    np.testing.assert_allclose(total["entries"], 0.0, atol=1e-10)


def test_an_elastic_stop_keeps_the_volume_of_state_space():
    found = sensitivity(beam(Hertz(2.1e8)), START[:2], START[2:], 0.02, method=FINE)
    assert np.linalg.det(found.matrix) == pytest.approx(math.exp(-0.04 * np.sum(ZETA * OMEGA)), rel=1e-8)


# --- where there is none ---------------------------------------------------------------------------------------------


def swinging(gap):
    """q = -cos t over a stop: δ = q - gap."""
    return System([[1.0]], [[0.0]], [[1.0]], [Contact([-1.0], PiecewiseLinear([9.0]), gap)])


@pytest.mark.parametrize(("gap", "words"), [(1.0 - 1e-11, "grazes"), (1.0 + 1e-11, "touched but not entered")])
def test_a_graze_has_no_derivative(gap, words):
    with pytest.raises(NoDerivativeError, match=words):
        sensitivity(swinging(gap), [-1.0], [0.0], 5.0, method=FINE)
    assert len(sensitivity(swinging(0.999), [-1.0], [0.0], 5.0, method=FINE).contacts) == 1


@pytest.mark.parametrize(("name", "said"), [("valve", "no derivative: valve "), ("", "no derivative: contact 0 ")])
def test_a_graze_names_its_stop(name, said):
    stop = Contact([-1.0], PiecewiseLinear([9.0]), 1.0 - 1e-11, name=name)
    with pytest.raises(NoDerivativeError, match=said):
        sensitivity(System([[1.0]], [[0.0]], [[1.0]], [stop]), [-1.0], [0.0], 5.0, method=FINE)


def test_a_start_on_the_surface():
    """By the gap it differs on both sides, by the stiffness it does not."""

    def pushed(gap=0.0, stiffness=9.0):
        stop = Contact([-1.0], PiecewiseLinear([stiffness]), gap)
        return System([[1.0]], [[0.0]], [[1.0]], [stop], [([1.0], lambda t: -1.0 + 0.0 * t)])

    with pytest.raises(NoDerivativeError, match="touched at the start"):
        sensitivity(pushed(), [0.0], [0.0], 3.0, nearby=Nearby.of(pushed, 0.0, 1e-6), method=FINE)
    by_stiffness = Nearby.of(lambda k: pushed(stiffness=k), 9.0, 1e-3)
    found = sensitivity(pushed(), [0.0], [-0.1], 6.6, nearby=by_stiffness, method=FINE)
    assert found.peak_force.shape == (1,)
    assert found.peak_force[0] > 0.0


@pytest.mark.parametrize("damping", [0.0, 0.3])
def test_a_start_on_the_surface_into_the_stop(damping):
    """By the gap it differs on both sides where the force jumps: before the surface the ball begins in flight."""

    def thrown(gap):
        return System([[1.0]], [[0.0]], [[1.0]], [Contact([-1.0], KelvinVoigt(9.0, damping), gap)])

    by_gap = Nearby.of(thrown, 0.0, 1e-4)
    if damping:
        with pytest.raises(NoDerivativeError, match="touched at the start"):
            sensitivity(thrown(0.0), [0.0], [1.0], 0.7, nearby=by_gap, method=FINE)
        return
    found = sensitivity(thrown(0.0), [0.0], [1.0], 0.7, nearby=by_gap, method=FINE).end
    w = math.sqrt(10.0)  # q = 0.9 gap (1 - cos wt) + sin(wt)/w in contact
    np.testing.assert_allclose(found, [0.9 * (1.0 - math.cos(0.7 * w)), 0.9 * w * math.sin(0.7 * w)], rtol=1e-9)


test_refusals_of_systems = refused(
    (lambda: sensitivity(ball(law=Viscoelastic.tsuji(2e7, 0.6, 0.3)), [0.0], [SPEED], 0.5), "slope is infinite"),
    (lambda: sensitivity(ball(), [0.0], [SPEED], -1.0), "duration must be positive"),
    *((lambda x=x: sensitivity(ball(), [0.0], [SPEED], 0.5, times=x), "times must lie in") for x in ([0.6], [-0.1])),
    *((lambda x=x: sensitivity(ball(), [0.0], [SPEED], 0.5, times=x), "times must be one ascending row")
      for x in ([0.4, 0.2], [math.nan])),
    *((lambda x=x: sensitivity(ball(), [0.0], [SPEED], 0.5, start=x), "start must be 2 finite numbers")
      for x in (1.0, [1.0], [1.0, math.nan], [1.0, 0.0, 0.0])),
    (lambda: sensitivity(ball(), [0.0, 0.0], [SPEED], 0.5), r"q0 must have shape \(1,\)"),
    *((lambda x=x: Nearby.of(ball, GAP, x), "step must be finite and not 0") for x in (0.0, math.nan)),
    (lambda: Nearby.of(lambda value: _refuse(), 1.0, 1e-3), "no such value"),
)  # fmt: skip


def _refuse():
    raise ValueError("no such value")


def test_values_that_are_refused_on_one_side():
    """A value at the end of its range: a one-sided formula of the same order."""

    def positive(value):
        if value < 0.0:
            raise ValueError("negative")
        return value

    assert Nearby.of(positive, 0.0, 1e-3).derivative(math.exp) == pytest.approx(1.0, abs=1e-11)
    assert Nearby.of(lambda value: positive(-value), 0.0, 1e-3).derivative(math.exp) == pytest.approx(-1.0, abs=1e-11)


# --- scenes ----------------------------------------------------------------------------------------------------------

PLACE = 0.2


def scene(**other):
    valve = fb.Stop(TIP, Hysteretic(2.1e8, damping_factor=0.5), gap=1e-4, side="below", name="valve")
    return paper_scene(**{"stops": [valve], **other})


@pytest.fixture(scope="module")
def run():
    return simulated(scene())


def simulated(one, duration=0.06):
    return one.reduce(modes=2).simulate(duration, dt=2e-3, solver=FINE)


@pytest.mark.parametrize(
    ("path", "share"), [("stops[valve].gap", 1e-3), ("omega", 1e-5), ("damping.zeta[0]", 1e-3), ("beam.length", 1e-5)]
)
def test_a_run_of_a_scene(run, path, share):
    found = run.sensitivity(path)
    step = share * found.value
    runs = {k * step: simulated(with_value(scene(), found.parameter, found.value + k * step)) for k in (-2, -1, 1, 2)}
    for name in ("displacement", "velocity"):
        expected = five_points(lambda h, name=name: getattr(runs[h], name)(PLACE), step)
        derived = getattr(found, name)(PLACE)
        np.testing.assert_allclose(derived, expected, rtol=0, atol=1e-5 * np.abs(expected).max(), err_msg=name)
    for logged, derived in OF_CONTACTS.items():
        expected = five_points(lambda h, logged=logged: getattr(runs[h].contacts, logged), step)
        size = np.abs(expected).max()
        np.testing.assert_allclose(getattr(found, derived), expected, rtol=0, atol=1e-6 * size, err_msg=logged)


def test_what_it_prints_and_offers(run):
    found = run.sensitivity("stops[valve].gap")
    assert found.parameter == "stops[valve].gap"
    assert run.sensitivity("omega").parameter == "base.omega"
    assert found.value == 1e-4
    text = str(found)
    assert "derivatives by stops[valve].gap = 0.0001" in text
    assert "valve" in text
    rows = found.table()
    assert [row["entry"] for row in rows] == found.entries.tolist()
    assert found.displacement([0.1, PLACE]).shape == (len(run.t), 2)
    np.testing.assert_allclose(found.displacement([0.1, PLACE])[:, 1], found.displacement(PLACE), rtol=1e-12)
    assert found.q.shape == run.q.shape == found.q_dot.shape


def test_a_direction_of_the_start(run):
    """A start that moves along a field: against a run from a start moved along it."""
    model = run.model
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # two modes miss a part of the field
        way = model.state(velocity=lambda z: z)
    found = run.sensitivity(start=way)
    runs = {k: model.simulate(0.06, dt=2e-3, start=1e-4 * k * way, solver=FINE) for k in (-2, -1, 1, 2)}
    expected = five_points(lambda h: runs[round(h * 1e4)].displacement(PLACE), 1e-4)
    np.testing.assert_allclose(found.displacement(PLACE), expected, rtol=0, atol=1e-6 * np.abs(expected).max())


def test_without_samples_the_end_is_derived(run):
    model = run.model
    plain = model.simulate(0.06, solver=FINE).sensitivity("stops[0].gap")
    np.testing.assert_allclose(plain.q, run.sensitivity("stops[0].gap").q[-1:], rtol=1e-6)
    assert plain.t.tolist() == [0.06]


@pytest.mark.parametrize(("path", "share"), [("stops[0].gap", 1e-3), ("base.omega", 1e-5), ("masses[0].mass", 1e-4)])
def test_an_orbit(path, share):
    """State, period and highest displacement against orbits at other values."""
    orbit = scene().reduce(modes=2).orbit()
    found = orbit.sensitivity(path)
    step = share * found.value
    near = {
        k: with_value(scene(), path, found.value + k * step).reduce(modes=2).orbit(start=orbit) for k in (-1.0, 1.0)
    }
    for ask, derived, allowed in (
        (lambda one: one.state, found.state, 1e-5),
        (lambda one: one.found.period, found.period, 1e-7),
        (lambda one: np.array(one.extremes(PLACE)), np.array(found.extremes(PLACE)), 1e-3),  # of cubics over samples
    ):
        expected = (ask(near[1.0]) - ask(near[-1.0])) / (2.0 * step)
        np.testing.assert_allclose(derived, expected, rtol=0, atol=allowed * np.abs(expected).max() + 1e-15)


def test_an_orbit_with_a_slider():
    """The best limit of friction: where the amplitude's derivative by the limit changes its sign."""

    def damped(limit):
        damper = fb.Element(0.25, Jenkins(2e4, limit))
        return scene(stops=[], elements=[damper], base=fb.Harmonic(2e-3, 109.0)).reduce(modes=2)

    orbit = damped(1.0).orbit()
    assert len(orbit.transitions) >= 4
    found = orbit.sensitivity("elements[0].law.limit")
    near = [damped(1.0 + h).orbit(start=orbit).state for h in (-1e-4, 1e-4)]
    expected = (near[1] - near[0]) / 2e-4
    np.testing.assert_allclose(found.state, expected, rtol=0, atol=1e-5 * np.abs(expected).max())


@pytest.mark.parametrize("modes", [2, 8])
def test_an_orbit_of_a_fast_structure(modes):
    """Force and gap together scale the orbit at a linear stop: F ∂u/∂F + g ∂u/∂g = u, of silicon at 4e5 rad/s too."""
    bar, force, gap = fb.Section.rectangle(1.6e11, 2330.0, width=2e-5, height=2e-6), 2e-8, 2e-8
    stop, load = fb.Stop(2e-4, KelvinVoigt(5.0, 1e-8), gap=gap), fb.PointForce(2e-4, fb.Harmonic(force, 4e5))
    damping = fb.ModalDamping(0.02)
    beam = fb.Scene(fb.Beam(2e-4, bar), [fb.Clamped(0.0)], stops=[stop], forces=[load], damping=damping)
    orbit = beam.reduce(modes=modes).orbit()
    assert len(orbit.contacts) == 1
    assert abs(orbit.multipliers[0]) < 0.9
    by_force, by_gap = (orbit.sensitivity(path) for path in ("forces[0].signal.amplitude", "stops[0].gap"))
    scaled = force * by_force.q + gap * by_gap.q
    np.testing.assert_allclose(scaled, orbit.run.q, rtol=0, atol=1e-6 * np.abs(orbit.run.q).max())


def test_chaos_is_told():
    """Between two elastic stops small changes grow over and over."""
    stops = [fb.Stop(TIP, Hertz(2.1e8), 1e-4, side) for side in ("below", "above")]
    rattling = scene(stops=stops, base=fb.Harmonic(3e-3, 195.0))
    run = rattling.reduce(modes=2).simulate(0.12)
    with pytest.warns(UserWarning, match="small changes of the start grow by"):
        run.sensitivity("stops[0].gap")


def test_refusals_of_runs(run, tmp_path):
    with pytest.raises(ValueError, match=r"did you mean stops\[0\]\.gap"):
        run.sensitivity("stops[0].gab")
    with pytest.raises(ValueError, match=r"got 'stops\[valv\]\.gap' in parameter; did you mean stops\[valve\]\.gap"):
        run.sensitivity("stops[valv].gap")
    with pytest.raises(ValueError, match=r"no derivative by supports\[0\]\.z: values near 0 are refused"):
        run.sensitivity("supports[0].z")
    with pytest.raises(ValueError, match="must not bring a load that is not there yet"):
        run.sensitivity("gravity")
    with pytest.raises(ValueError, match="give a parameter or a direction"):
        run.sensitivity()
    with pytest.raises(ValueError, match="give a parameter or a direction"):
        run.sensitivity("stops[0].gap", start=np.zeros(4))
    with pytest.raises(ValueError, match=r"\(4,\) finite numbers"):
        run.sensitivity(start=[1.0])
    with pytest.raises(ValueError, match="nor has a part of a run, which studies look at"):
        cut(run, 0.5 * run.reached, run.reached).sensitivity(start=np.ones(2 * len(run.model.omega)))
    with pytest.raises(ValueError, match="read from a file"):
        fb.load(run.save(tmp_path / "run.npz")).sensitivity("stops[0].gap")


@pytest.mark.parametrize("power", [2, 6])
def test_a_force_that_still_rises_where_its_stretch_ends(power):
    """There the clock stands still, so that its slope vanishes: by rounding that was taken for a peak inside, whose
    derivative leaves out what the time of the event does, 1 to 12 % of a peak force.
    """
    clock, edges = Clock(0.0, 1.0, power), np.linspace(0.0, 1.0, 5)
    places = edges[:-1, None] + np.diff(edges)[:, None] * X
    for rate in np.linspace(0.1, 3.0, 30):
        for sign in (1.0, -1.0):
            found = largest(np.exp(sign * rate * clock.time(places)), (False, False))
            assert found[2] == -np.inf, rate
    inside = largest(np.sin(3.0 * clock.time(places)), (False, False))
    np.testing.assert_allclose(inside[2], 1.0, rtol=1e-9)
