"""Laws with memory through the integrator against closed forms: decay and rest, loops, blows, many borders."""

import math
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from contacts import BoucWen, Coulomb, Iwan, Jenkins, KelvinVoigt, PiecewiseLinear, WaltonBraun
from fembeam import Harmonic
from solvers import Contact, DormandPrince, Exponential, System, integrate

FINE = Exponential(1e-12)


def element(law, *direction):
    """One that always acts; δ = q for the direction -1."""
    return Contact(direction or [-1.0], law, always=True)


def oscillator(*laws, spring=1.0, loads=()):
    """A unit mass on a spring with elements."""
    return System([[1.0]], [[0.0]], [[spring]], [element(law) for law in laws], loads)


def force_at_end(law, run, contact=0):
    """Force of an element in the last state, with what it has latched."""
    row = np.array(law.parameters)
    row[list(law.memory)] = run.memory[contact]
    return float(law.batch(1.0, row)(run.q[-1], run.q_dot[-1])[0])


# --- borders ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", [DormandPrince(10.0**-k) for k in (6, 9, 11)], ids=str)
def test_borders_of_one_law_that_fall_together_are_passed_one_after_the_other(method):
    """Lines so near to each other that rounding holds both: the second border is none where the first has led."""
    stop = Contact([1.0], WaltonBraun(723206.2960604648, 726080.5763881964), 1e-18)
    system = System([[1.0]], [[0.0]], [[34.522346590453324**2]], [stop])
    run = integrate(system, [1.5e-18], [-1.0139691101546457e-16], 0.2317, method=method, check=False)
    assert set(run.transitions.event) <= {"contact", "unload", "reload", "open"}


@pytest.mark.parametrize("rtol", [1e-6, 1e-9, 1e-11])
@pytest.mark.parametrize("limit", [1e-5, 1e-6, 1e-7, 1e-8])
def test_a_slider_that_hardly_holds_sticks_once_at_a_turn(limit, rtol):
    """It slips from its first motion to the turn of v/ω sin ωt, sticks until δ has gone back by 2 f/k, and slips back.

    Its knee f/k is down to 1e-12 of δ, the rounding of δ to 1e-4 of the knee.
    """
    K, k, v, omega = 1e3, 1e9, 1e-2, 1e3
    system = System([[1e-3]], [[0.0]], [[K]], [Contact([-1.0], Jenkins(k, limit), gap=-1e-5, always=True)])
    run = integrate(system, [0.0], [v], 4e-3, method=Exponential(rtol))
    assert run.transitions.event.tolist() == ["slip", "stick", "slip"]
    turn, back = run.transitions.t[1:]
    assert turn == pytest.approx(0.5 * math.pi / omega, abs=1.1 * limit / (K * v))
    assert back - turn == pytest.approx(math.sqrt(4.0 * limit / k / (v * omega)), rel=0.1)
    assert run.q[-1, 0] == pytest.approx(v / omega * math.sin(4.0), abs=3.1 * limit / K)


@pytest.mark.parametrize("rtol", [1e-6, 1e-10])
@pytest.mark.parametrize("depth", [1e-2, 1e-3, 1e-4, 1e-5])
def test_every_short_reversal_of_a_slip_is_found(depth, rtol):
    """δ̇ = V + A cos θ with A = V/(1 - depth): a slider too weak to be felt sticks where δ̇ < 0, about θ = π and 3π.

    Steps are many radians long, and nothing but the margin tells them to be shorter.
    """
    slow, fast = 1e-4, 2640.0
    swing = System.modal([slow, fast], 0.0, [element(Jenkins(1e-9, 1e-15), -1.0, -1.0)])
    for phase in np.linspace(-2.5, 2.5, 21):
        q, v = math.sin(phase) / (1.0 - depth) / fast, math.cos(phase) / (1.0 - depth)
        run = integrate(swing, [-q, q], [1.0, v], (4.0 * math.pi - phase) / fast, method=Exponential(rtol))
        assert list(run.transitions.event) == ["slip", "stick", "slip", "stick", "slip"]
        half = math.acos(1.0 - depth)
        before = [math.pi - half, 3.0 * math.pi - half]
        np.testing.assert_allclose(run.transitions.t[1::2] * fast + phase, before, rtol=0, atol=rtol / half)


# --- decay and rest --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class DryFriction:
    """q'' + K q + F = 0: in stick F = k (q - s) + c q' up to |F| = f, then ±f until q' = 0, where s = q ∓ f/k."""

    spring: float
    stiffness: float
    limit: float
    damping: float

    def stick(self, q, v, s):
        """(q, v) as functions of time, and where it would rest."""
        rest = self.stiffness * s / (self.spring + self.stiffness)
        gamma = 0.5 * self.damping
        omega = math.sqrt(self.spring + self.stiffness - gamma**2)
        a, b = q - rest, (v + gamma * (q - rest)) / omega

        def motion(t):
            c, d, e = np.cos(omega * t), np.sin(omega * t), np.exp(-gamma * t)
            x = e * (a * c + b * d)
            return rest + x, -gamma * x + omega * e * (b * c - a * d)

        return motion, rest

    def decay(self, v, s=0.0, q=0.0):
        """Turning points after a push, and the place of rest."""
        turns = []
        while True:
            motion, rest = self.stick(q, v, s)

            def over(t, motion=motion, s=s):
                x, rate = motion(t)
                return np.abs(self.stiffness * (x - s) + self.damping * rate) - self.limit

            grid = np.linspace(0.0, 30.0 / self.damping, 20001)[1:]
            beyond = np.flatnonzero(over(grid) > 0.0)
            if not beyond.size:
                return np.array(turns), rest
            first = beyond[0]
            end = brentq(over, grid[first - 1], grid[first], xtol=1e-15) if first else 0.0
            q, v = motion(end)
            side, omega = math.copysign(1.0, v), math.sqrt(self.spring)
            centre = -side * self.limit / self.spring
            q = centre + side * math.hypot(q - centre, v / omega)
            turns.append(q)
            s, v = q - side * self.limit / self.stiffness, 0.0


def test_dry_friction_decays_along_a_line_and_rests_for_ever():
    """Turning points of exact pieces, 4 f/K less per cycle as for a rigid contact; rest in the dead zone, no creep."""
    exact = DryFriction(spring=1.0, stiffness=1e6, limit=0.1, damping=1e3)
    turns, rest = exact.decay(v=1.03)
    system = oscillator(Coulomb(exact.limit, exact.stiffness, damping=exact.damping))
    run = integrate(system, [0.0], [1.03], 40.0, method=FINE)
    found = run.transitions.delta[run.transitions.event == "stick"]
    assert len(found) == len(turns) == math.ceil((abs(turns[0]) - 0.1) / 0.2) + 1
    assert abs(found - turns).max() < 1e-10
    line = (np.abs(turns[0]) - 0.2 * np.arange(len(turns))) * (-1.0) ** np.arange(len(turns))
    assert abs(found - line).max() < 1e-3  # of the order √(1/k)
    assert abs(run.q[-1, 0] - rest) < 1e-10
    assert abs(rest) < exact.limit
    later = integrate(system, run.q[-1], run.q_dot[-1], 1000.0, dt=1.0, method=Exponential(2e-9), memory=run.memory)
    assert abs(later.q - run.q[-1]).max() < 1e-12
    assert np.array_equal(later.memory[0], run.memory[0])  # the slider has not moved at all
    assert not len(later.transitions)
    assert later.losses.slip[0] == 0.0


@pytest.mark.parametrize(("ratio", "percent"), [(1.0, 13.5), (1.5, 7.6), (2.0, 4.8)])
def test_the_force_of_stick_passes_the_load_by_what_the_damping_leaves(ratio, percent):
    """c = 2β√k, β = 1, 3/2, 2: where a slip ends at the load -f, F passes it by η 2f; beyond f_s it slips once more."""
    k, f, q = 1e6, 0.1, 0.0999
    angle = math.acosh(ratio) / math.sqrt(ratio**2 - 1.0) if ratio > 1.0 else 1.0
    passed = math.exp(-2.0 * ratio * angle)
    assert abs(100.0 * passed - percent) < 0.1
    for share, events in ((1.01, ["slip", "stick"]), (0.99, ["slip", "stick", "slip"])):
        law = Coulomb(f, k, (1.0 + 2.0 * share * passed) * f, 2.0 * ratio * math.sqrt(k))
        run = integrate(oscillator(law), [q], [math.sqrt(0.2**2 - (0.1 + q) ** 2)], 0.05, method=FINE)
        assert run.transitions.event.tolist()[:3] == events


# --- loops -----------------------------------------------------------------------------------------------------------

STIFFNESS, LIMITS = (40.0, 20.0, 10.0, 14.0), (0.5, 0.75, 1.0, 0.35)
TONES = [([1.0], Harmonic(3.0, 1.1)), ([1.0], Harmonic(2.0, 2.3))]


def test_sliders_in_parallel_are_one_joint():
    """Iwan's law and its sliders apart: four reverse at one instant; the force at the end is that of rationals."""
    law = Iwan(STIFFNESS, LIMITS)
    apart = [Jenkins(k, f) for k, f in zip(STIFFNESS, LIMITS, strict=True)]
    whole, parts = (integrate(oscillator(*laws, loads=TONES), [0.0], [0.5], 12.0, method=FINE)
                    for laws in ((law,), apart))  # fmt: skip
    log = whole.transitions
    stuck = log.t[log.event == "stick"]
    at_once = np.unique(stuck, return_counts=True)[1]
    assert at_once.max() == 4
    assert len(parts.transitions) == len(log) > 40
    assert abs(parts.transitions.t - log.t).max() < 1e-12 * 12.0 + 1e-12
    assert abs(parts.q[-1] - whole.q[-1]).max() < 1e-12
    assert whole.losses.loss[0] == pytest.approx(parts.losses.loss.sum(), rel=1e-11)
    turns = log.delta[log.event == "stick"]
    sliders = [Fraction(0)] * 4
    for delta in (*turns.tolist(), whole.q[-1, 0]):
        d, moved = Fraction(delta), []
        for k, f, s in zip(map(Fraction, STIFFNESS), map(Fraction, LIMITS), sliders, strict=True):
            moved.append(d - max(-f, min(f, k * (d - s))) / k)
        sliders = moved
    expected = sum(Fraction(k) * (Fraction(float(whole.q[-1, 0])) - s) for k, s in zip(STIFFNESS, sliders, strict=True))
    assert force_at_end(law, whole) == pytest.approx(float(expected), rel=1e-12, abs=1e-12)


SHAPES = [(0.7, 0.3), (0.6, -0.4), (0.4, 0.8)]  # β, γ: softening, pinched, strongly asymmetric about unloading


@pytest.mark.parametrize(("n", "beta", "gamma"), [*((1, *shape) for shape in SHAPES), (2, *SHAPES[1])])
def test_bouc_wen_in_motion_is_its_differential_equation(n, beta, gamma):
    """z' = A δ' - β |δ'| |z|^(n-1) z - γ δ' |z|^n integrated from one reversal of the run to the next."""
    law, k = BoucWen(3.0, 0.1, 1.0, beta, gamma, n), 2.7
    run = integrate(oscillator(law, loads=TONES), [0.0], [0.5], 45.0, method=FINE)
    log = run.transitions
    turns = log.delta[log.event == "reversal"]
    assert len(turns) > 10
    z, path = 0.0, [0.0, *turns[turns != 0.0].tolist(), run.q[-1, 0]]
    for begin, end in pairwise(path):
        z = led(z, begin, end, n, beta, gamma)
    assert force_at_end(law, run) == pytest.approx(0.3 * run.q[-1, 0] + k * z, rel=1e-11, abs=1e-12)


def led(z, begin, end, n, beta, gamma):
    """z at the end of a monotone way, by an independent integration that ends at zeros of z."""
    up = math.copysign(1.0, end - begin)

    def zero(_, y):
        return y[0]

    zero.terminal = True
    while begin != end:
        side = up if z == 0.0 else math.copysign(1.0, z)
        zero.direction = -side
        found = solve_ivp(lambda _, y, s=side: 1.0 - np.abs(y) ** n * (gamma + beta * up * s), (begin, end), [z],
                          "DOP853", rtol=2.3e-14, atol=1e-17, events=zero)  # fmt: skip
        begin, z = found.t[-1], 0.0 if found.status == 1 else found.y[0, -1]
    return z


# --- blows -----------------------------------------------------------------------------------------------------------

MASS, LOADING, UNLOADING = 2.0, 1e4, 4e4
SPEEDS = (0.5, 0.2, 0.6, 0.6, 0.31, 0.9, 1.4)


def blow(speed, largest):
    """(speed out, largest force, duration) of a blow on the line of unloading up to ``largest``, then on the first."""
    fast, slow = math.sqrt(UNLOADING / MASS), math.sqrt(LOADING / MASS)
    elastic = speed * math.sqrt(MASS * UNLOADING)  # force at the deepest point, were it all on that line
    if elastic <= largest:
        return speed, largest, math.pi / fast
    rest = speed**2 - largest**2 / (MASS * UNLOADING)
    force = math.sqrt(largest**2 + LOADING * MASS * rest)
    duration = math.asin(largest / elastic) / fast + math.acos(largest / force) / slow + 0.5 * math.pi / fast
    return force / math.sqrt(MASS * UNLOADING), force, duration


@pytest.mark.parametrize("method", [Exponential(1e-12), DormandPrince(1e-13)], ids=["main", "stepping"])
@pytest.mark.parametrize("kind", ["kept", "forgotten"])
def test_seven_blows_on_a_yielding_stop(kind, method):
    """Restitution, set, duration, peak, impulse and loss of each blow, of growing and of smaller speeds."""
    law = WaltonBraun(LOADING, UNLOADING, kind)
    ball = System([[MASS]], [[0.0]], [[0.0]], [Contact([1.0], law)])
    largest, memory = 0.0, None
    for number, speed in enumerate(SPEEDS):
        out, largest, duration = blow(speed, largest if kind == "kept" else 0.0)
        run = integrate(ball, [2e-3], [-speed], 0.2, method=method, memory=memory)
        log, memory = run.contacts, run.memory
        assert len(log) == 1
        assert abs(log.speed_out[0] - out) < 1e-10
        assert abs(log.t_out[0] - log.t_in[0] - duration) < 1e-10
        assert log.impulse[0] == pytest.approx(MASS * (speed + out), rel=1e-9)
        if number == 0:
            assert log.peak_force[0] == pytest.approx(largest, rel=1e-10)
            assert log.peak_indentation[0] == pytest.approx(largest / LOADING, rel=1e-10)
            passed = ["contact", "unload", "open", "forget"][: 3 if kind == "kept" else 4]
            assert run.transitions.event.tolist() == passed
        assert abs(run.losses.loss[0] - 0.5 * MASS * (speed**2 - out**2)) < 1e-10
        set_ = largest * (1.0 / LOADING - 1.0 / UNLOADING)
        left = run.transitions.delta[run.transitions.event == "open"]
        assert abs(left[0] - set_) < 1e-10
        assert memory[0][1] == pytest.approx(largest if kind == "kept" else 0.0, abs=1e-7)  # N


@pytest.mark.parametrize("rtol", [1e-6, 1e-8, 1e-10])
@pytest.mark.parametrize(("loading", "spring", "damping"), [(300.0, 100.0, 1.0), (300.0, 10.0, 6.0), (5e3, 1.0, 9.0)])
def test_peak_force_of_a_damped_yielding_stop(rtol, loading, spring, damping):
    """F = (k₁ + k) δ + c δ̇ is largest before δ̇ = 0, where the law unloads.

    δ = v/ω e^(-σt) sin ωt gives F = v e^(-σt) (a sin ωt + c cos ωt), a = (k₁ + k - cσ)/ω, and from F' = 0
    tan ωt = (a ω - c σ)/(a σ + c ω).
    """
    law = WaltonBraun(loading, 3.0 * loading) + KelvinVoigt(spring, damping)
    system = System.modal([8.0], [0.0], contacts=[Contact([1.0], law)])
    run = integrate(system, [0.3], [0.0], 0.5, method=Exponential(rtol))
    stiffness, sigma = loading + spring, 0.5 * damping
    omega = math.sqrt(64.0 + stiffness - sigma**2)
    a = (stiffness - damping * sigma) / omega
    angle = math.atan2(a * omega - damping * sigma, a * sigma + damping * omega)
    peak = 2.4 * math.exp(-sigma * angle / omega) * (a * math.sin(angle) + damping * math.cos(angle))
    assert run.contacts.peak_force[0] == pytest.approx(peak, rel=100.0 * rtol)


def test_a_pull_is_no_peak_force_of_a_yielding_stop():
    """A dashpot may pull harder when the stop opens than it pushed before."""
    law = WaltonBraun(6e3, 16e3, "kept") + KelvinVoigt(11.0, 12.0)
    loads = [([1.0, 0.5], Harmonic(10.0, 9.0, 0.3))]
    system = System.modal([8.0, 30.0], [0.01, 0.01], contacts=[Contact([1.0, 0.5], law, gap=0.01)], loads=loads)
    log, exact = (
        integrate(system, [0.1, 0.0], [0.0, 1.0], 3.0, method=m).contacts for m in (Exponential(1e-8), DormandPrince())
    )
    assert len(log) > 3
    np.testing.assert_allclose(log.peak_force, exact.peak_force, rtol=1e-5)


@pytest.mark.parametrize("method", [Exponential(1e-6), FINE, DormandPrince(1e-8)], ids=["1e-6", "1e-12", "dop853"])
@pytest.mark.parametrize("kind", ["kept", "forgotten"])
def test_a_yielding_stop_is_entered_at_once_by_a_start_on_its_surface(kind, method):
    """Moving in, or at rest under a load: t = 0, not a shortest step later."""
    stop = Contact([-1.0], WaltonBraun(400.0, 900.0, kind), 0.3)
    for rate, force in ((0.5, 0.0), (0.0, 2.0)):
        system = System([[2.0]], [[0.0]], [[0.0]], [stop], [([1.0], Harmonic(force, 0.0))])
        run = integrate(system, [0.3], [rate], 0.3, method=method)
        assert run.contacts.t_in[0] == run.transitions.t[0] == 0.0
        assert run.contacts.speed_in[0] == pytest.approx(rate, abs=1e-14)
        deepest = rate * math.sqrt(2.0 / 400.0) if rate else 2.0 * force / 400.0
        assert run.contacts.peak_indentation[0] == pytest.approx(deepest, rel=1e3 * method.rtol)


@pytest.mark.parametrize("method", [Exponential(1e-6), FINE, DormandPrince(1e-8)], ids=["1e-6", "1e-12", "dop853"])
def test_a_slider_drawn_beyond_its_limit_slips_at_once_beside_a_stop_at_rest_on_a_knot(method):
    """t = 0, where no step is possible: what it takes is its limit times its slip, and none of what it was drawn by."""
    slider, row = element(Jenkins(1e4, 1.0), 1.0, 0.1), np.array([0.5, 0.5])
    system = System.modal([90.0, 2000.0], 0.0, [slider, Contact(-row, PiecewiseLinear([400.0, 900.0], [1e-3]), 0.0)])
    run = integrate(system, [0.01, -0.008], [0.0, 0.0], 0.01, method=method)
    assert run.transitions.t[0] == 0.0
    assert run.losses.slip[0] > 1e-3
    assert run.losses.loss[0] == pytest.approx(run.losses.slip[0], rel=1e4 * method.rtol)


@pytest.mark.parametrize("rate", [-0.5, 0.5])
@pytest.mark.parametrize("method", [FINE, DormandPrince(1e-12)], ids=["main", "stepping"])
def test_smooth_hysteresis_begun_beyond_its_zero(method, rate):
    """z' = A - (β sgn z + γ)|z| from z₀ < 0: e^(γ₋y) to zero at y₀, 1 - e^(-γ₊(y - y₀)) beyond; F is continuous."""
    law, beta, gamma, before = BoucWen(1.0, 0.26, 1.0, 0.9, 0.4), 0.9, 0.4, -0.3
    zero = -math.log1p((gamma - beta) * before) / (gamma - beta)  # y at z = 0
    z = (1.0 - math.exp(-(beta + gamma) * (1.0 - zero))) / (beta + gamma)
    begun = [integrate(oscillator(law), [1.0], [rate], 2.0, method=method, memory=[latched])
             for latched in ([0.0, 0.0, before], [math.copysign(1.0, rate), 1.0, z])]  # fmt: skip
    assert begun[0].transitions.force[0] == pytest.approx(0.26 + 0.74 * z, rel=1e-12)
    assert begun[0].q[-1, 0] == pytest.approx(begun[1].q[-1, 0], abs=1e-9)
    assert begun[0].losses.loss[0] == pytest.approx(begun[1].losses.loss[0], abs=1e-9)


# --- tangents --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", [Exponential(1e-4), Exponential(1e-8), FINE, DormandPrince(1e-8)])
@pytest.mark.parametrize("rate", [-1e-3, -1e-2, 1e-2, -0.1])
def test_smooth_hysteresis_begun_at_zero_force_turns_where_its_energy_is_spent(rate, method):
    """At δ = 0 the side on which the law is loaded is that of the motion, which a load of 1 N soon turns.

    There ½ v² = W + δ with W = ∫ F dδ, F = α k δ + (1 - α) k (1 - e^{-cδ})/c; after it z falls to zero.
    """
    stiffness, alpha, c, side = 4.0, 0.2, 1.0, math.copysign(1.0, rate)

    def spent(delta):
        smooth = (delta + math.expm1(-c * delta) / c) / c
        return 0.5 * alpha * stiffness * delta**2 + (1.0 - alpha) * stiffness * smooth + delta - 0.5 * rate**2

    law = BoucWen(stiffness, alpha, 1.0, 0.7 * c, 0.3 * c)
    system = oscillator(law, spring=0.0, loads=[([1.0], Harmonic(-side, 0.0))])
    run = integrate(system, [0.0], [rate], 1.5, method=method)
    assert run.transitions.event[:2].tolist() == ["reversal", "zero"]
    assert run.transitions.delta[0] == pytest.approx(side * brentq(spent, 0.0, 0.5 * rate**2, xtol=1e-20), rel=1e-8)


@pytest.mark.parametrize("rtol", [1e-6, 1e-9])
def test_a_knee_that_is_small_beside_the_motion_is_resolved(rtol):
    """Within a fiftieth of a step from z = 0 on the force saturates: all nodes lie beyond."""
    knee = 2e-4
    system = oscillator(BoucWen(160.0, 0.1, 1.0, 1.1 / knee**2, -0.1 / knee**2, 2), spring=20.0)
    runs = [integrate(system, [0.7], [0.0], 1.5, method=method) for method in (Exponential(rtol), DormandPrince(1e-12))]
    assert np.abs(runs[0].end[:2] - runs[1].end[:2]).max() < 20.0 * rtol
