"""Laws with memory under the stepping methods: landings, return maps, order of convergence, against exact pieces."""

import math

import numpy as np
import pytest
from scipy.sparse import csc_array
from sliders import Slider

import fembeam as fb
from contacts import Coulomb, Hertz, Jenkins, KelvinVoigt
from contacts.memory import WaltonBraun
from solvers import (
    RK4,
    CentralDifference,
    Contact,
    DormandPrince,
    Exponential,
    GeneralizedAlpha,
    HenonRK2,
    Newmark,
    System,
    integrate,
)

DECAY = Slider(spring=1.0, stiffness=4.0, limit=0.3)
START, DURATION = (0.05, 3.0), 30.0
CONSTANT = [CentralDifference, Newmark, GeneralizedAlpha, RK4, lambda h: HenonRK2(h, h)]
NAMES = ["central", "newmark", "alpha", "rk4", "henon"]


def element(law, direction=-1.0):
    return Contact([direction], law, always=True)


def system_of(slider, *laws):
    """A unit mass on a spring, with elements in parallel."""
    laws = laws or (Jenkins(slider.stiffness, slider.limit),)
    return System([[1.0]], [[0.0]], [[slider.spring]], [element(law) for law in laws])


def run(method, *laws, slider=DECAY, duration=DURATION, dt=None):
    return integrate(system_of(slider, *laws), START[:1], START[1:], duration, dt=dt, method=method)


def distance(solution, slider=DECAY, duration=DURATION):
    q, v, _ = slider.run(*START, duration)
    return math.hypot(solution.q[-1, 0] - q, solution.q_dot[-1, 0] - v)


# --- error control ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8, 1e-10, 1e-13])
def test_error_control_keeps_its_order_through_stick_and_slip(rtol):
    """Twelve borders; the error stays below a few rtol, the times of the borders too."""
    solution = run(DormandPrince(rtol, 1e-16), dt=0.5)
    *_, events = DECAY.run(*START, DURATION)
    assert distance(solution) < 3.0 * rtol + 1e-12
    found = solution.transitions
    assert np.abs(found.t[: len(events)] - [t for t, _ in events]).max() < 10.0 * rtol + 1e-11
    assert found.event[: len(events)].tolist() == ["slip" if side else "stick" for _, side in events]
    assert abs(solution.energy.residual).max() < 20.0 * rtol + 1e-11


def test_times_forces_and_paths_of_the_log():
    """A slip takes f times its path; its force is the limit where it begins and where it ends."""
    found = run(DormandPrince(1e-12)).transitions
    *_, events = DECAY.run(*START, DURATION)
    first = slice(0, len(events))
    assert np.allclose(np.abs(found.force[first]), DECAY.limit, rtol=1e-12)
    assert np.allclose(found.delta_dot[first][1::2], 0.0, atol=1e-12)
    work, path = np.diff(found.work[first])[0::2], found.slid()[first][1::2]
    assert np.allclose(work, DECAY.limit * path, rtol=1e-9)


def test_elements_on_one_coordinate_are_renewed_together():
    """Two equal sliders side by side are one of twice the size: transitions in pairs at the same instant."""
    halves = Jenkins(0.5 * DECAY.stiffness, 0.5 * DECAY.limit)
    *_, events = DECAY.run(*START, DURATION)
    pairs = [(halves, halves), (halves + halves,)]
    for laws in pairs:
        solution = run(DormandPrince(1e-12), *laws)
        assert distance(solution) < 1e-10
        found = solution.transitions.t[: 2 * len(events)]
        assert np.abs(found[0::2] - found[1::2]).max() < 1e-12


@pytest.mark.parametrize("phase", np.linspace(0.1, 1.1, 7))
@pytest.mark.parametrize("over", [1e-3, 1e-6, 1e-9])
def test_a_margin_that_dips_below_zero_between_nodes_is_seen(phase, over):
    """An elastic swing whose force just exceeds the limit slips once, one that just does not never."""
    amplitude, omega = 1.0, math.sqrt(5.0)
    start = amplitude * math.cos(phase), -amplitude * omega * math.sin(phase)
    for limit, count in ((4.0 * amplitude * (1.0 - over), 2), (4.0 * amplitude * (1.0 + over), 0)):
        for rtol in (1e-4, 1e-9) if over > 1e-4 else (1e-12,):
            system = System([[1.0]], [[0.0]], [[1.0]], [element(Jenkins(4.0, limit))])
            found = integrate(system, start[:1], start[1:], 2.0, method=DormandPrince(rtol, 1e-16)).transitions
            assert len(found) == count


def test_a_start_beyond_the_limit_slips_before_a_stop_is_landed_on():
    """The stop is met within one landing, and by then the undrawn slider would be within its limit again."""
    stop = Contact([-1.0], Hertz(1e6), gap=-5e-4)
    system = System([[1.0]], [[0.0]], [[400.0]], [Contact([-1.0], Jenkins(25.0, 0.05), always=True), stop])
    run = integrate(system, [-0.0121], [0.6], 0.03, method=Exponential(1e-6))
    assert run.transitions.event[:2].tolist() == ["slip", "stick"]
    assert run.transitions.t[:2].tolist() == [0.0, 0.0]


def test_a_start_beyond_the_limit_slips_at_once():
    system = System([[1.0]], [[0.0]], [[1.0]], [element(Jenkins(4.0, 0.3))])
    solution = integrate(system, [1.0], [0.5], 3.0, method=DormandPrince(1e-12))
    found = solution.transitions
    assert (found.t[0], found.event[0], found.delta[0]) == (0.0, "slip", 1.0)
    size, angle = math.hypot(1.3, 0.5), math.atan2(0.5, 1.3)
    assert abs(found.t[1] - angle) < 1e-11
    assert abs(found.delta[1] - (size - 0.3)) < 1e-11


def test_a_run_leaves_the_law_and_other_runs_alone():
    system = system_of(DECAY)
    ends = [integrate(system, START[:1], START[1:], 5.0, method=DormandPrince(1e-9)).q[-1, 0] for _ in range(2)]
    assert ends[0] == ends[1]
    assert system.contacts[0].law.parameters.tolist() == Jenkins(4.0, 0.3).parameters.tolist()


def test_stops_and_springs_beside_a_slider():
    """A mass between a slider and a stop: the energy balance closes, the stop's log knows nothing of the slider."""
    contacts = [element(Jenkins(4.0, 0.3)), Contact([-1.0], Hertz(1e3), gap=0.2), element(KelvinVoigt(1.0, 0.01))]
    system = System([[1.0]], [[0.02]], [[1.0]], contacts)
    solution = integrate(system, START[:1], START[1:], DURATION, dt=0.1, method=DormandPrince(1e-11))
    assert set(solution.contacts.stop.tolist()) == {1}
    assert abs(solution.energy.residual).max() < 1e-9
    assert set(solution.transitions.contact.tolist()) == {0}


# --- constant steps --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", CONSTANT, ids=NAMES)
def test_constant_steps_lose_all_but_order_two(method):
    """A border is passed by part of a step: an error of its square, whatever the method's order.

    The error is the sum of twelve such parts, erratic but bounded by h²; here at most 11 h².
    """
    for n in (1000, 2000, 4000, 8000, 16000):
        h = DURATION / n
        assert distance(run(method(h))) < 15.0 * h**2


@pytest.mark.parametrize("method", CONSTANT, ids=NAMES)
def test_constant_steps_log_what_they_pass(method):
    h = 1e-3
    found = run(method(h)).transitions
    *_, events = DECAY.run(*START, DURATION)
    late = found.t[: len(events)] - [t for t, _ in events]
    assert late.min() > -0.1 * h
    assert late.max() < 1.1 * h


def test_order_four_holds_where_no_border_is_met():
    """A slider that sticks is a spring."""
    system = System([[1.0]], [[0.0]], [[1.0]], [element(Jenkins(4.0, 10.0))])
    exact = math.cos(math.sqrt(5.0) * 10.0)
    errors = [abs(integrate(system, [1.0], [0.0], 10.0, method=RK4(h)).q[-1, 0] - exact) for h in (0.02, 0.01)]
    assert errors[0] / errors[1] > 14.0


@pytest.mark.parametrize("method", [Newmark, GeneralizedAlpha])
def test_implicit_steps_solve_at_both_signs(method):
    """A stiff element that always acts is part of the structure: the same steps, however long."""
    stiff = System([[1.0]], [[0.1]], [[101.0]])
    beside = System([[1.0]], [[0.0]], [[1.0]], [element(KelvinVoigt(100.0, 0.1))])
    ends = [integrate(system, [-1.0], [0.5], 1.5, dt=0.5, method=method(0.25)).q[:, 0] for system in (stiff, beside)]
    assert np.allclose(*ends, atol=1e-9)


def test_an_element_that_holds_energy_at_the_start_may_return_it():
    """Stored at a negative δ, given back: no gain of energy."""
    system = System([[1.0]], [[0.0]], [[1e-6]], [element(KelvinVoigt(100.0, 0.0))])
    end = integrate(system, [-1.0], [0.0], 2.0, method=CentralDifference(1e-3))
    assert abs(end.q[-1, 0] + math.cos(20.0)) < 1e-3


@pytest.mark.parametrize("method", [RK4, Newmark, CentralDifference])
def test_sparse_matrices_carry_the_same_latches(method):
    laws = [Jenkins(4.0, 0.3), Jenkins(2.0, 0.1)]
    rows, M, K = np.array([[-1.0, 0.0], [1.0, -1.0]]), np.diag([1.0, 2.0]), np.array([[3.0, -1.0], [-1.0, 1.0]])
    contacts = [Contact(row, law, always=True) for row, law in zip(rows, laws, strict=True)]
    ends = []
    for kind in (np.asarray, csc_array):
        system = System(kind(M), kind(0.0 * M), kind(K), contacts)
        ends.append(integrate(system, [0.0, 0.1], [1.0, 0.5], 10.0, method=method(5e-3)))
    assert np.allclose(ends[0].q, ends[1].q, atol=1e-9)
    assert np.allclose(ends[0].transitions.t, ends[1].transitions.t, atol=1e-9)
    assert len(ends[0].transitions) > 6


# --- yielding stops --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", CONSTANT, ids=NAMES)
def test_a_start_in_a_yielding_stop_is_no_gain_of_energy(method):
    ball = System([[1.0]], [[0.0]], [[1e-4]], [Contact([1.0], WaltonBraun(1e4, 2e4))])
    end = integrate(ball, [-1e-2], [0.0], 0.1, method=method(1e-5))
    assert abs(end.q_dot[-1, 0] - math.sqrt(0.5)) < 1e-3  # ½ k₁ δ² · k₁/k₂


def test_steps_too_long_for_unloading_are_refused():
    ball = System([[1.0]], [[0.0]], [[1.0]], [Contact([1.0], WaltonBraun(1e2, 1e4))])
    limit = CentralDifference(1e-3).stable_dt(ball)
    assert abs(limit.contact - 2.0 / math.sqrt(1.0 + 1e4)) < 1e-6
    with pytest.raises(ValueError, match="unstable in contact"):
        integrate(ball, [0.1], [-1.0], 1.0, method=CentralDifference(0.03))


def test_a_force_that_jumps_leaves_constant_steps_order_one():
    """Static above kinetic friction: the jump is late by part of a step."""
    law = Coulomb(0.3, 4.0, static_limit=0.6)
    exact = run(DormandPrince(1e-12), law, duration=6.0)
    assert "slip" in exact.transitions.event
    for method in (RK4, Newmark):
        for h in (4e-3, 2e-3, 1e-3, 5e-4):
            end = run(method(h), law, duration=6.0)
            apart = math.hypot(end.q[-1, 0] - exact.q[-1, 0], end.q_dot[-1, 0] - exact.q_dot[-1, 0])
            assert apart < 1.0 * h


@pytest.mark.parametrize("seed", [0, 1, 11, 13, 22])
def test_a_coarse_tolerance_does_not_end_in_stick_and_slip_at_one_instant(seed):
    """A step too long for the fast modes tells stick and slip in turn: it has to be shorter."""
    rng, n = np.random.default_rng(seed), 10
    omega = np.append(1.0, np.sort(10.0 ** rng.uniform(0.0, 2.5, n - 1)))
    slider = Contact(rng.standard_normal(n).round(1), Jenkins(10.0, 3.0), always=True)
    load = rng.standard_normal(n).round(1), fb.Harmonic(5.0, 1.3)
    system = System.modal(omega.round(2), 0.01, [slider], [load])
    coarse, fine = (integrate(system, np.zeros(n), np.zeros(n), 20.0, 1.0, DormandPrince(r)) for r in (1e-3, 1e-10))
    np.testing.assert_allclose(coarse.q, fine.q, rtol=0.0, atol=1e-3 * np.abs(fine.q).max())
