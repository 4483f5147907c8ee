"""No contact of the model is missed: random flights against brute force, grazes of any shortness."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from contacts import Hertz
from solvers import Contact, Exponential, Status, System, integrate

FLIGHTS = 140  # 20 of every number of modes
SOFT = Hertz(1e-3)  # hardly disturbs the motion: the first entry is that of the flight


class Flight:
    """Modes in free decay seen through one stop: δ(t) = Σ e^{-ζωt} (a cos ω_d t + b sin ω_d t) - gap."""

    def __init__(self, rng, n):
        self.omega = np.sort(10.0 ** rng.uniform(2.0, 3.3, n))
        self.zeta = 10.0 ** rng.uniform(-3.0, -1.0, n)
        self.row = rng.standard_normal(n) / math.sqrt(n)
        self.system = System.modal(self.omega, self.zeta, [Contact(self.row, SOFT, 1.0)])
        self.damped = self.omega * np.sqrt(1.0 - self.zeta**2)
        self.decay = self.zeta * self.omega

    def throw(self, rng):
        """Another start."""
        self.q0 = rng.standard_normal(self.omega.size) / self.omega
        self.q_dot0 = rng.standard_normal(self.omega.size)
        self.size = np.abs(self.row * np.hypot(self.q0, self.q_dot0 / self.omega)).sum()

    def reading(self, t, order=0):
        """-row·q (order 0) or its rate (order 1) at times t."""
        lam = -self.decay + 1j * self.damped
        z = self.q0 - 1j * (self.q_dot0 + self.decay * self.q0) / self.damped
        return -(np.exp(np.multiply.outer(t, lam)) * (z * lam**order)).real @ self.row

    def maxima(self, duration):
        """Times and values of all local maxima: dense samples of the rate, then bisection, all at once."""
        t = np.linspace(0.0, duration, int(duration * self.omega[-1] * 4) + 2)
        rate = self.reading(t, 1)
        up = np.flatnonzero((rate[:-1] > 0.0) & (rate[1:] <= 0.0))
        a, b = t[up], t[up + 1]
        for _ in range(48):
            middle = 0.5 * (a + b)
            rising = self.reading(middle, 1) > 0.0
            a, b = np.where(rising, middle, a), np.where(rising, b, middle)
        return a, self.reading(a)

    def first_entry(self, gap, times, values):
        """First time the reading exceeds the gap, by bisection from the minimum before the first high maximum."""
        k = int(np.argmax(values > gap))
        low = times[k - 1] if k else 0.0
        t = np.linspace(low, times[k], 4001)
        a, b = t[np.flatnonzero(self.reading(t) <= gap)[-1]], times[k]
        for _ in range(60):
            middle = 0.5 * (a + b)
            a, b = (a, middle) if self.reading(middle) > gap else (middle, b)
        return b

    def run(self, gap, duration, rtol=1e-6):
        """The same flight in units of the gap, so that one system serves many starts."""
        return integrate(self.system, self.q0 / gap, self.q_dot0 / gap, duration, method=Exponential(rtol))


def flights(count, seed=0):
    """Random flights whose highest maximum is not the start."""
    rng = np.random.default_rng(seed)
    for i in range(count):
        if i % 50 == 0:
            n = (2, 3, 4, 5, 8, 12, 30)[(i // 50 + seed) % 7]
            flight = Flight(rng, n)
        while True:
            flight.throw(rng)
            duration = rng.uniform(8.0, 60.0) / flight.omega[n // 2]
            times, values = flight.maxima(duration)
            if len(times) > 1 and values.max() > max(2.0 * flight.reading(np.zeros(1))[0], 0.0):
                break
        yield rng, flight, duration, times, values


def test_no_contact_of_random_flights_is_missed():
    """The gap lies just below one of the highest maxima, so that most flights are long and end in a graze."""
    missed, wrong = [], []
    for i, (rng, flight, duration, times, values) in enumerate(flights(FLIGHTS)):
        top, depth = values.max(), 10.0 ** rng.uniform(-8.0, -0.5)
        gap = top * (1.0 - depth)
        entry = flight.first_entry(gap, times, values)
        run = flight.run(gap, min(duration, entry * (1.0 + 1e-9) + 1e-9))
        if len(run.contacts) != 1:
            missed.append((i, depth))
        elif abs(run.contacts.t_in[0] - entry) * run.contacts.speed_in[0] > 1e-12 * flight.size / gap:
            wrong.append((i, run.contacts.t_in[0] - entry))
    assert missed == []
    assert wrong == []


def test_stops_just_out_of_reach_are_not_met():
    for _, flight, duration, _, values in flights(100, seed=1):
        run = flight.run(values.max() * (1.0 + 1e-9), duration)
        assert run.status is Status.DONE
        last = flight.reading(np.array([duration]))[0]
        assert len(run.contacts) == 0 or last > values.max()


@pytest.mark.parametrize("share", [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6])
@pytest.mark.parametrize("n", [2, 6, 20])
def test_grazes_down_to_a_millionth_of_the_fastest_period(n, share):
    """A dip that lasts ``share`` of the fastest period is found while the rounding of δ can tell it."""
    found = 0
    for _, flight, duration, times, values in flights(6, seed=n):
        k = int(np.argmax(values))
        length = share * 2 * math.pi / flight.omega[-1]
        lam = -flight.decay + 1j * flight.damped
        z = flight.q0 - 1j * (flight.q_dot0 + flight.decay * flight.q0) / flight.damped
        curvature = (np.exp(lam * times[k]) * z * lam**2).real @ flight.row
        depth = abs(curvature) * length**2 / 8.0
        if depth < 64 * np.finfo(float).eps * np.abs(flight.row * z).sum():
            continue  # beyond what the state's digits hold
        run = flight.run(values[k] - depth, min(duration, times[k] + length))
        assert len(run.contacts) >= 1, (depth, length)
        found += 1
    assert found or share <= 1e-5


def test_grazes_of_one_fast_mode_at_the_limit():
    """A single mode of 1000 rad/s touches for 1e-6 of its period: depth 5e-12 of its swing."""
    omega, share = 1e3, 1e-6
    depth = (math.pi * share) ** 2 / 2.0
    for phase in np.linspace(0.1, 6.0, 60):
        stop = Contact([1.0], SOFT, 1.0 - depth)
        start = [-math.cos(phase)], [omega * math.sin(phase)]
        run = integrate(System.modal([omega], 0.0, [stop]), *start, 3 * math.pi / omega, method=Exponential(1e-12))
        # -q = cos(ωt + φ'): maxima wherever the phase is a whole turn
        assert len(run.contacts) in (1, 2)
        length = (run.contacts.t_out - run.contacts.t_in) * omega / (2 * math.pi)
        np.testing.assert_allclose(length, share, rtol=0.1)


def over_a_slow_swing(fast, gap):
    """δ = 0.05 cos(ωt) - cos t - gap, with a fast mode of 0.05 m on a slow one of 1 m."""
    return System.modal([1.0, fast], 0.0, [Contact([-1.0, -1.0], SOFT, gap)]), [-1.0, 0.05], [0.0, 0.0]


@pytest.mark.parametrize("dt", [None, 1.0])
@pytest.mark.parametrize("fast", [1e2, 1e4, 1e6])
def test_a_fast_mode_that_cannot_reach_a_stop_does_not_shorten_flight(fast, dt):
    """By |δ̈| alone 16 periods of the slow mode took 2200 to 22 million steps, with its amplitude about 170."""
    run = integrate(*over_a_slow_swing(fast, 1.1), 100.0, dt)
    assert len(run.contacts) == 0
    assert run.cost.steps < (300 if dt is None else 1200)


def test_two_rigid_modes_beside_a_fast_one_meet_a_stop():
    """δ = (0.1 + 0.4) t + 1e-3 cos(1e5 t) - 1: neither rigid mode has an amplitude; a slow one makes long steps."""
    system = System.modal([0.0, 0.0, 1.0, 1e5], 0.0, [Contact([-1.0, -1.0, -1.0, -1.0], SOFT, 1.0)])
    t = np.linspace(1.997, 2.0, 200001)
    first = t[np.flatnonzero(0.5 * t + 1e-3 * np.cos(1e5 * t) > 1.0)[0]]
    entry = brentq(lambda t: 0.5 * t + 1e-3 * math.cos(1e5 * t) - 1.0, first - 2e-8, first, xtol=1e-16, rtol=1e-15)
    run = integrate(system, [0.0, 0.0, 0.0, 1e-3], [0.1, 0.4, 0.0, 0.0], 2.1)
    assert run.contacts.t_in[0] == pytest.approx(entry, abs=1e-12)


@pytest.mark.parametrize("clearance", [1.6, -0.9])
def test_fast_modes_do_not_shorten_flight_in_a_circle_or_around_a_disk(clearance):
    """A place on a circle of 1 m, with fast modes of 0.02 m: 180 and 450 steps, by |ü| alone 3e7."""
    rows = np.array([[1.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 1.0]])
    stop = Contact(rows, SOFT, abs(clearance), map="annulus", outer=clearance < 0.0)
    system, fast = System.modal([1.0, 1.0, 1e6, 1.01e6], 0.0, [stop]), 0.02
    run = integrate(system, [-1.0, 0.0, fast, 0.0], [0.0, 1.0, 0.0, 1e6 * fast], 100.0)
    assert len(run.contacts) == 0
    assert run.cost.steps < 1000


def test_crests_of_fast_modes_meet_a_circle():
    """|u| = |e^{it} - 0.05 e^{iωt}| comes to 1.05 m where both point the same way, first at t = π/(ω - 1)."""
    rows = np.array([[1.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 1.0]])
    fast, share = 1e3, 0.05
    system = System.modal([1.0, 1.0, fast, fast], 0.0, [Contact(rows, SOFT, 1.0499, map="annulus")])
    run = integrate(system, [1.0, 0.0, -share, 0.0], [0.0, 1.0, 0.0, -share * fast], 10.0 / fast)
    between = math.acos((1.0499**2 - 1.0 - share**2) / (2.0 * share))  # of the two directions
    assert run.contacts.t_in[0] == pytest.approx((math.pi - between) / (fast - 1.0), rel=1e-12)


@pytest.mark.parametrize("fast", [1e2, 1e3, 1e4])
def test_the_first_crest_of_a_fast_mode_above_a_stop_is_met(fast):
    gap = 1.04
    crests = 2.0 * math.pi / fast * np.arange(int(fast))
    first = crests[np.flatnonzero(0.05 - np.cos(crests) > gap)[0]]
    low = first - math.pi / fast  # a trough
    entry = brentq(lambda t: 0.05 * math.cos(fast * t) - math.cos(t) - gap, low, first, xtol=1e-16, rtol=1e-15)
    run = integrate(*over_a_slow_swing(fast, gap), first)
    assert run.contacts.t_in == pytest.approx([entry], rel=1e-13)


def test_entries_land_on_the_surface():
    for _, flight, duration, _, values in flights(100, seed=2):
        gap = 0.6 * values.max()
        run = flight.run(gap, duration)
        first = run.contacts.t_in[:1]
        assert np.abs(flight.reading(first) - gap).max() < 1e-13 * flight.size


def test_flight_after_an_exit_does_not_find_the_same_contact_again():
    """Bounces of every strength: one contact each, and the log ascends."""
    system = System.modal([100.0, 700.0], 0.001, [Contact([1.0, -0.6], Hertz(1e7), 1e-4)])
    run = integrate(system, [0.0, 0.0], [-1.0, 0.4], 2.0, method=Exponential(1e-8))
    log = run.contacts
    assert len(log) > 20
    assert np.all(log.t_in[1:] > log.t_out[:-1])
    assert np.all(log.peak_indentation > 0.0)
