"""Methods of constant step: order on smooth motion and through contact, closed answers, modes against matrices."""

import math
from functools import cache

import numpy as np
import pytest
from oscillators import Tone
from problems import HertzBounce, as_sparse, coupled_dashpot, linear_stop, paper_scene, reference, two_sided_scene
from refusals import refused

import fembeam as fb
import solvers
from contacts import Hertz, Hysteretic, KelvinVoigt, PiecewiseLinear, law
from solvers import (
    RK4,
    CentralDifference,
    Contact,
    DormandPrince,
    Exponential,
    GeneralizedAlpha,
    HenonRK2,
    Newmark,
    Status,
    System,
    integrate,
    integration,
)

METHODS = [RK4, CentralDifference, Newmark, GeneralizedAlpha]


def two_steps(dt, locate=True):
    """The paper's scheme, with one step for flight and contact."""
    return HenonRK2(dt, dt)


ORDER = {RK4: 4.0, CentralDifference: 2.0, Newmark: 2.0, GeneralizedAlpha: 2.0, two_steps: 2.0}
LINEAR = PiecewiseLinear([1e4])
HYSTERETIC = Hysteretic.lankarani_nikravesh(1e6, restitution=0.5)
HERTZIAN = Hertz(1e6), HYSTERETIC
one_of_each_kind = pytest.mark.parametrize("method", [RK4, Newmark])  # explicit, and with forces solved for
methods = pytest.mark.parametrize("method", METHODS, ids=lambda method: method.__name__)
stepping = pytest.mark.parametrize("method", [*METHODS, two_steps], ids=lambda method: method.__name__)


def slope(steps, errors):
    return np.polyfit(np.log(steps), np.log(errors), 1)[0]


# --- order -----------------------------------------------------------------------------------------------------------


@stepping
def test_order_on_smooth_motion(method):
    system = System.modal([3.0, 11.0], [0.05, 0.02], loads=[([1.0, -2.0], fb.Harmonic(4.0, 2.0))])
    exact = integrate(system, [1.0, 0.2], [0.0, 1.0], 3.0, method=DormandPrince(1e-13)).q[-1]
    steps = 0.02 / 2.0 ** np.arange(4)
    ends = [integrate(system, [1.0, 0.2], [0.0, 1.0], 3.0, method=method(h)).q[-1] for h in steps]
    errors = np.abs(ends - exact).max(axis=1)
    assert abs(slope(steps, errors) - ORDER[method]) < 0.15
    assert errors[-1] < (1e-7 if method is RK4 else 1e-3)


@pytest.mark.parametrize("gamma", [0.6, 1.0])
def test_newmark_with_numerical_damping_has_order_one(gamma):
    system, steps = System.modal([3.0], 0.0), 0.004 / 2.0 ** np.arange(3)
    errors = [
        abs(integrate(system, [1.0], [0.0], 2.0, method=Newmark(h, 0.5 * gamma, gamma)).q[-1, 0] - math.cos(6.0))
        for h in steps
    ]
    assert abs(slope(steps, errors) - 1.0) < 0.15


def test_trapezoidal_rule_has_its_known_period():
    # cos θ = (1 - x²/4)/(1 + x²/4) a step, x = hω, and no damping
    x, steps = 0.3, 1000
    run = integrate(System.modal([3.0], 0.0), [1.0], [0.0], 0.1 * steps, method=Newmark(0.1))
    assert run.q[-1, 0] == pytest.approx(math.cos(steps * math.acos((1 - x * x / 4) / (1 + x * x / 4))), abs=1e-9)


@pytest.mark.parametrize("rho", [0.0, 0.5, 1.0])
def test_generalised_alpha_damps_high_modes_as_asked(rho):
    assert GeneralizedAlpha(1.0, rho).radius(1e5, 1.0, 0.0) == pytest.approx(rho, abs=1e-3)


STARTS = 0.03, 0.04, 0.05, 0.06, 0.07, 0.08, 0.09


@cache
def struck(law):
    """A system of two modes over a stop, and its first coordinate at the end, for every start."""
    system = System.modal([5.0, 40.0], 0.02, [Contact([1.0, 0.6], law)])
    exact = [integrate(system, [a, 0.0], [-1.0, 0.3], 0.9, method=DormandPrince(1e-13, 1e-18)) for a in STARTS]
    return system, np.array([run.q[-1, 0] for run in exact])


@cache
def contact_errors(law, method, locate, count):
    """Median errors over the starts, each with two or three contacts, at so many steps."""
    system, exact = struck(law)
    steps = 1e-3 / 2.0 ** np.arange(count)
    runs = [
        [integrate(system, [a, 0.0], [-1.0, 0.3], 0.9, method=method(h, locate=locate)) for a in STARTS] for h in steps
    ]
    return steps, np.median([np.abs([run.q[-1, 0] for run in row] - exact) for row in runs], axis=1)


@pytest.mark.parametrize(
    ("method", "law"),
    [*((method, LINEAR) for method in METHODS), *((m, KelvinVoigt(1e4, 10.0)) for m in (RK4, Newmark))],
)
def test_located_events_keep_the_order_where_the_law_is_smooth_between_them(method, law):
    assert abs(slope(*contact_errors(law, method, True, 4)) - ORDER[method]) < 0.25


@pytest.mark.parametrize(
    ("law", "order"), [(LINEAR, 2.0), (Hertz(1e6), 2.0), (HYSTERETIC, 2.0), (KelvinVoigt(1e4, 10.0), 1.0)],
    ids=["linear", "hertz", "hysteretic", "force jumps"],
)  # fmt: skip
def test_order_of_the_papers_scheme_through_contact(law, order):
    # its entries are landed on, its exits are not: late by up to h, where a force that jumps leaves an impulse of h
    steps, errors = contact_errors(law, two_steps, True, 5)
    assert abs(slope(steps[2:], errors[2:]) - order) < 0.4


@one_of_each_kind
@pytest.mark.parametrize("law", HERTZIAN, ids=["hertz", "hysteretic"])
def test_hertz_force_begins_with_an_infinite_curvature_and_limits_the_order(method, law):
    # the first step of a contact integrates t^1.5 to h^2.5, so even RK4 has no more than 2.5
    expected = min(ORDER[method], 2.5)
    assert abs(slope(*contact_errors(law, method, True, 5)) - expected) < 0.4


@one_of_each_kind
@pytest.mark.parametrize(
    ("law", "lowest", "highest"),
    [(LINEAR, 1.6, 2.4), (Hertz(1e6), 2.0, 3.0), (HYSTERETIC, 0.8, 1.7), (KelvinVoigt(1e4, 10.0), 0.8, 1.7)],
    ids=["linear: 2", "hertz: 2.5", "late latch: 1", "force jumps: 1"],
)
def test_ignored_events_cost_order(method, law, lowest, highest):
    # a contact noticed up to h late loses an impulse of h², h^2.5 or, where the force jumps, h; a late entry rate h
    steps, errors = contact_errors(law, method, False, 4)
    assert lowest < slope(steps, errors) < highest
    if method is RK4:
        assert errors[-1] > 50.0 * contact_errors(law, method, True, 5 if law in HERTZIAN else 4)[1][3]


# --- closed answers --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("method", "accuracy"),
    [
        (Exponential(1e-8), 1e-9),
        (DormandPrince(1e-10), 1e-10),
        (RK4(1e-4), 3e-8),
        *((method(1e-4), 3e-5) for method in (CentralDifference, Newmark, GeneralizedAlpha)),
        (HenonRK2(1e-4, 1e-4), 1e-4),
    ],
    ids=lambda given: type(given).__name__,
)
def test_linear_stop_has_its_published_numbers(method, accuracy):
    # constant steps: hω = 0.01, so that order 2 leaves (hω)²/12 to (hω)²/3 and order 4 (hω)⁴
    log = integrate(linear_stop(), [0.0], [-1.0], 0.04, method=method).contacts
    assert log.peak_force[0] == pytest.approx(9950.371902, rel=max(accuracy, 1e-10))
    late = 1e-4 if isinstance(method, HenonRK2) else 0.0  # its exits are not located
    assert log.t_out[0] - log.t_in[0] == pytest.approx(0.03126001527, rel=max(accuracy, 3e-10), abs=late)
    assert log.impulse[0] == pytest.approx(198.0198020, rel=30 * accuracy)


@methods
def test_hertz_bounce_has_its_closed_answers(method):
    law, mass, speed = Hertz(1e6), 2.0, 0.5
    answer = HertzBounce(law.stiffness, mass, speed)
    system = System([[mass]], [[0.0]], [[0.0]], [Contact([1.0], law)])
    log = integrate(system, [0.0], [-speed], 2.0 * answer.duration, method=method(answer.duration / 400)).contacts
    assert log.peak_indentation[0] == pytest.approx(answer.peak_indentation, rel=2e-4)
    assert log.t_out[0] == pytest.approx(answer.duration, rel=2e-4)
    assert log.speed_out[0] == pytest.approx(speed, rel=1e-3)


@methods
def test_paper_scene_agrees_with_the_main_method(method):
    model, duration = paper_scene().reduce(modes=2), 0.06
    best = model.simulate(duration)
    run = model.simulate(duration, solver=method(2e-6))
    assert len(run.contacts) == len(best.contacts) >= 2
    np.testing.assert_allclose(run.contacts.t_in, best.contacts.t_in, atol=1e-6)
    assert abs((run.q[-1] - best.q[-1]) @ model.phi(0.24445)) < 1e-7


@pytest.fixture(scope="module")
def two_sided():
    """A system with stops on both sides, its start, and what the reference finds."""
    system = two_sided_scene(mid_gap=1e-4).reduce(modes=3).system
    start = np.zeros(3), np.array([0.02, -0.05, 0.0])
    return system, start, reference(system, *start, 0.02)


@pytest.mark.parametrize(
    ("method", "error"),
    [(RK4(5e-7), 3e-4), (Newmark(5e-7), 3e-4), (DormandPrince(1e-13), 1e-9)],
    ids=lambda given: type(given).__name__,
)
def test_stops_on_both_sides_agree_with_the_reference(method, error, two_sided):
    system, start, wanted = two_sided
    found = integrate(system, *start, 0.02, method=method)
    assert len(found.contacts) == len(wanted.contacts) >= 3
    entries = np.sort([entered for _, entered, *_ in wanted.contacts])
    np.testing.assert_allclose(np.sort(found.contacts.t_in), entries, atol=error * entries[-1])
    np.testing.assert_allclose(found.q[-1], wanted.q[-1], atol=error * np.abs(wanted.q[-1]).max())
    assert abs(found.energy.residual[-1]) < error * found.energy.stored.max()


# --- modes and matrices ----------------------------------------------------------------------------------------------


@methods
@pytest.mark.parametrize("locate", [True, False])
def test_sparse_matrices_give_the_run_of_the_modes(method, locate):
    K = 1e4 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    M = np.diag([1.0, 2.0, 0.5])
    contacts = [Contact([0.0, 0.0, 1.0], HYSTERETIC, 1e-3), Contact([0.0, -1.0, 0.0], LINEAR, 2e-3)]
    system = System(M, 0.4 * M + 1e-4 * K, K, contacts, [([1.0, 0.0, -1.0], fb.Harmonic(30.0, 50.0))])
    ends = [
        integrate(s, np.zeros(3), [0.3, 0.0, -0.5], 0.2, 1e-2, method(5e-4, locate=locate))
        for s in (system, as_sparse(system))
    ]
    assert len(ends[0].contacts) >= 4
    np.testing.assert_allclose(ends[1].q, ends[0].q, atol=1e-9 * np.abs(ends[0].q).max())
    np.testing.assert_allclose(ends[1].energy.residual, ends[0].energy.residual, atol=1e-9)
    assert ends[0].cost.steps == ends[1].cost.steps


@pytest.fixture(scope="module")
def coupled():
    """A system whose dashpot couples its modes, its start, and what the reference finds."""
    start, system = (np.zeros(3), [0.0, 0.0, -0.3]), coupled_dashpot([Contact([0.0, 0.0, 1.0], Hertz(1e7))])
    return system, start, reference(system, *start, 0.1)


@methods
def test_damping_that_couples_the_modes(method, coupled):
    system, start, wanted = coupled
    found = integrate(system, *start, 0.1, method=method(4e-5))
    assert len(found.contacts) == len(wanted.contacts) >= 2
    np.testing.assert_allclose(found.q[-1], wanted.q[-1], atol=2e-4 * np.abs(wanted.q[-1]).max())


def beam_matrices(mass, elements=60):
    """The paper's beam unreduced, over a hysteretic stop, struck by its own motion."""
    scene = paper_scene()
    matrices = scene.matrices(elements)
    M = solvers.lumped(matrices.M, matrices.influence) if mass == "lumped" else matrices.M
    direction = matrices.interpolation(0.24445).toarray()[0]
    stop = Contact(direction, scene.stops[0].law)
    system = System(M, 2.0 * M, matrices.K, [stop], [(-matrices.base_load, scene.base.derivative(2))])
    return system, direction


def test_unreduced_beam_runs_on_sparse_matrices_and_agrees_with_many_modes():
    system, tip = beam_matrices("consistent")
    start = np.zeros(system.size), np.zeros(system.size)
    full = integrate(system, *start, 0.04, method=GeneralizedAlpha(2e-5, 0.8))
    modal = integrate(System(system.M.toarray(), system.C.toarray(), system.K.toarray(), system.contacts, system.loads),
                      *start, 0.04, method=GeneralizedAlpha(2e-5, 0.8))  # fmt: skip
    assert len(full.contacts) == len(modal.contacts) >= 1
    assert tip @ full.q[-1] == pytest.approx(tip @ modal.q[-1], rel=1e-5)
    few = paper_scene(zeta=2.0 / (2.0 * np.array([109.13, 790.6, 2303.7]))).reduce(modes=3).simulate(0.04, [0.04])
    assert tip @ full.q[-1] == pytest.approx(few.displacement(0.24445)[-1], rel=2e-2)


def test_lumped_mass_keeps_the_total_and_its_frequencies_converge():
    matrices = paper_scene().matrices(40)
    lumped, r = solvers.lumped(matrices.M, matrices.influence), matrices.influence
    assert lumped.count_nonzero() == lumped.shape[0]
    assert r @ (lumped @ r) == pytest.approx(r @ (matrices.M @ r), rel=1e-12)
    errors = []
    for elements in (20, 40):
        system, _ = beam_matrices("lumped", elements)
        errors.append(abs(math.sqrt(system.blocks.k[1]) - 790.6101))
    assert errors[1] < 0.5
    assert errors[1] < 0.35 * errors[0]


@pytest.mark.parametrize("mass", ["lumped", "consistent"])
def test_central_differences_on_the_unreduced_beam(mass):
    system, tip = beam_matrices(mass, 12)
    start = np.zeros(system.size), np.zeros(system.size)
    dt = 0.9 * min(CentralDifference(1.0).stable_dt(system)[:2])
    explicit = integrate(system, *start, 0.01, method=CentralDifference(dt))
    fine = integrate(system, *start, 0.01, method=GeneralizedAlpha(2e-5, 1.0))
    assert tip @ explicit.q[-1] == pytest.approx(tip @ fine.q[-1], rel=2e-3)


# --- ledger, input ---------------------------------------------------------------------------------------------------


@methods
def test_ledger_closes_with_the_step(method):
    model = paper_scene().reduce(modes=2)
    worst = [np.abs(model.simulate(0.06, 1e-3, solver=method(h)).energy.residual).max() / 1e-3 for h in (1e-5, 2.5e-6)]
    assert worst[1] < 0.2 * worst[0]


@methods
def test_samples_and_repeated_runs_agree(method):
    model = paper_scene().reduce(modes=2)
    first, second = (model.simulate(0.05, 1e-3, solver=method(1e-5)) for _ in range(2))
    np.testing.assert_array_equal(first.q, second.q)
    assert np.abs(first.q[-1] - model.simulate(0.05, solver=method(1e-5)).q[-1]).max() < 1e-15


@methods
@pytest.mark.parametrize("bad", [0.0, -1e-3, math.nan, math.inf])
def test_steps_must_be_positive(method, bad):
    with pytest.raises(ValueError, match="dt must be positive and finite"):
        method(bad)


test_parameters_out_of_range_are_refused = refused(
    (lambda: Newmark(1e-3, beta=-0.1), "beta must be >= 0"),
    (lambda: Newmark(1e-3, gamma=0.4), "gamma must be >= 1/2"),
    (lambda: Newmark(1e-3, gamma=math.nan), "gamma must be"),
    (lambda: GeneralizedAlpha(1e-3, rho_inf=1.1), "rho_inf must lie in"),
)


# --- where a step does not find its event ----------------------------------------------------------------------------


def test_the_papers_scheme_walks_in_where_its_landing_divides_by_zero():
    # at rest a nanometre off the stop, pressed towards it: indentation cannot be the variable
    system = System.modal([40.0], 0.02, [Contact([1.0], Hertz(1e6), gap=1e-9)], [([-1.0], fb.Harmonic(1.0, 0.0))])
    run, exact = (integrate(system, [0.0], [0.0], 0.02, method=m) for m in (HenonRK2(1e-4, 1e-5), Exponential(1e-10)))
    assert run.cost.rejections == 1
    assert run.cost.steps > 200  # the small step throughout
    np.testing.assert_allclose(run.contacts.peak_force, exact.contacts.peak_force, rtol=1e-4)
    np.testing.assert_allclose(run.q, exact.q, rtol=1e-3)


@pytest.mark.parametrize("depth", [1e-6, 1e-9, 1e-12, -1e-9])
def test_matrices_see_the_grazes_that_modes_see(depth):
    # a swing of 0.01 m that passes its stop by a share of that
    model = System.modal([10.0], 0.0, [Contact([1.0], PiecewiseLinear([1e6]), gap=0.01 * (1.0 - depth))])
    modes, matrices = (integrate(one, [0.0], [-0.1], 0.18, method=RK4(3e-4)) for one in (model, as_sparse(model)))
    assert len(modes.contacts) == len(matrices.contacts) == (depth > 0.0)
    assert matrices.cost.rejections == modes.cost.rejections == (0 < depth < 1e-11)
    one, other = (run.contacts.peak_indentation for run in (matrices, modes))
    np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-16)
    np.testing.assert_allclose(matrices.q, modes.q, rtol=1e-10)


@pytest.mark.parametrize("method", [Exponential(1e-8), DormandPrince(1e-8), RK4(1e-4)], ids=lambda m: type(m).__name__)
def test_more_switches_at_one_instant_than_a_law_can_mean_stop_the_run(method):
    crowded = PiecewiseLinear([1.0] * 121, [1e-23 * i for i in range(1, 121)])
    system = System.modal([40.0], 0.0, [Contact([1.0], crowded)])
    run = integrate(system, [0.0], [-0.1], 0.05, method=method, check=False)
    assert run.status is Status.CHATTER
    assert run.t[-1] == 0.0
    assert run.cost.events > 100


def test_a_run_that_sticks_by_a_jump_that_its_law_does_not_declare_ends_as_stalled(monkeypatch):
    """A constant force presses a mass on a dry surface, which it then does not leave."""

    @law
    def rough(delta, delta_dot, entry_rate, stiffness):
        return stiffness * delta * (1.0 + 0.3 * np.sign(delta_dot))

    monkeypatch.setattr(integration, "_MOST_IDLE", 2)
    with pytest.warns(UserWarning, match="with the sign of the rate"):
        stop = Contact([1.0], rough(stiffness=1e5), 1e-4)
    system = System.modal([100.0], 0.02, [stop], [([-1.0], Tone(30.0, 0.0))])
    run = integrate(system, [0.0], [0.0], 2.0, check=False)
    assert run.status is Status.STALLED
    assert 0.0 < run.t[-1] < 0.1
    assert len(run.contacts) == 1
    assert run.cost.steps <= 4 * integration.BLOCK_STEPS
