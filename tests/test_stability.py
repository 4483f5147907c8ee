"""Predicted limits of the step against measured ones; runs that are refused, and runs that are stopped."""

import math
from functools import partial

import numpy as np
import pytest
from problems import coupled_dashpot, paper_scene
from scipy import sparse

import solvers
from contacts import Hertz, Hysteretic, PiecewiseLinear
from solvers import RK4, CentralDifference, Contact, GeneralizedAlpha, HenonRK2, Newmark, Status, System, integrate


def heun(dt, **options):
    return HenonRK2(dt, dt, **options)


def linear_acceleration(dt, **options):
    return Newmark(dt, beta=1 / 6, **options)


def damped_newmark(dt, **options):
    return Newmark(dt, beta=0.1, gamma=0.6, **options)


def as_sparse(system):
    return System(*(sparse.csc_array(A) for A in (system.M, system.C, system.K)), system.contacts)


def grows(method, system, q0, q_dot0, dt, rest=None, steps=4000):
    """Whether the motion about ``rest`` ends larger than it began, or the run is stopped."""
    run = integrate(system, q0, q_dot0, steps * dt, method=method(dt, force_unstable=True), check=False)
    if not run.status.good:
        return True
    deviation = run.q[-1] - (0.0 if rest is None else rest)
    start = np.asarray(q0) - (0.0 if rest is None else rest)
    return system.energy(deviation, run.q_dot[-1]) > 1.001 * system.energy(start, np.asarray(q_dot0))


def measured(method, system, q0, q_dot0, low, high, rest=None):
    """Smallest step that grows, by bisection to 1 %."""
    assert not grows(method, system, q0, q_dot0, low, rest)
    assert grows(method, system, q0, q_dot0, high, rest)
    while high > 1.01 * low:
        middle = math.sqrt(low * high)
        low, high = (low, middle) if grows(method, system, q0, q_dot0, middle, rest) else (middle, high)
    return math.sqrt(low * high)


# --- in flight -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", [heun, RK4, CentralDifference, linear_acceleration, damped_newmark])
@pytest.mark.parametrize("zeta", [1e-3, 0.01, 0.1])
def test_predicted_limit_is_the_measured_one(method, zeta):
    system = System.modal([2.0, 50.0], [0.02, zeta])
    predicted = method(1.0).stable_dt(system).flight
    start = [0.0, 1.0], [0.0, 10.0]
    assert measured(method, system, *start, 0.5 * predicted, 2.0 * predicted) == pytest.approx(predicted, rel=0.05)


@pytest.mark.parametrize("zeta", [1e-4, 1e-3, 1e-2])
def test_heun_is_limited_by_the_cube_root_of_the_damping(zeta):
    limit = heun(1.0).stable_dt(System.modal([100.0], zeta)).flight
    assert limit * 100.0 == pytest.approx((8 * zeta) ** (1 / 3), rel=0.1)


def test_closed_limits():
    system = System.modal([100.0], 0.0)
    assert heun(1.0).stable_dt(system).flight == 0.0
    assert RK4(1.0).stable_dt(system).flight == pytest.approx(2 * math.sqrt(2) / 100, rel=1e-6)
    assert CentralDifference(1.0).stable_dt(system).flight == pytest.approx(0.02, rel=1e-6)
    assert linear_acceleration(1.0).stable_dt(system).flight == pytest.approx(math.sqrt(12) / 100, rel=1e-6)
    assert damped_newmark(1.0).stable_dt(system).flight == pytest.approx(1 / math.sqrt(0.2) / 100, rel=1e-6)
    assert CentralDifference(1.0).stable_dt(System.modal([100.0], 0.3)).flight == pytest.approx(0.02, rel=1e-6)
    for free in (Newmark(1.0), Newmark(1.0, 0.3025, 0.6), GeneralizedAlpha(1.0, 0.0), GeneralizedAlpha(1.0, 1.0)):
        assert free.stable_dt(system).flight == math.inf
    assert RK4(1.0).stable_dt(System.modal([0.0], 0.0)).flight == math.inf


def test_overdamped_and_dragged_bodies():
    assert RK4(1.0).stable_dt(System([[1.0]], [[200.0]], [[0.0]])).flight == pytest.approx(2.785294 / 200, rel=1e-5)
    assert heun(1.0).stable_dt(System([[1.0]], [[200.0]], [[0.0]])).flight == pytest.approx(0.01, rel=1e-6)


@pytest.mark.parametrize("method", [heun, RK4, CentralDifference, Newmark, linear_acceleration, GeneralizedAlpha])
def test_a_run_grows_by_the_spectral_radius_a_step(method):
    omega, zeta, x = 10.0, 0.03, 0.6 if method is heun else 1.1
    made = method(x / omega, force_unstable=True)
    run = integrate(System.modal([omega], zeta), [1.0], [0.0], 60 * made.steps[0], made.steps[0], made, check=False)
    size = np.hypot(run.q[:, 0], run.q_dot[:, 0] / omega)
    rate = np.polyfit(np.arange(20, 60), np.log(size[20:60]), 1)[0]
    assert math.exp(rate) == pytest.approx(made.radius(x / omega, omega**2, 2 * zeta * omega), rel=3e-3)


def test_unconditional_methods_stay_bounded_at_huge_steps():
    system = System.modal([10.0, 1e5], 0.0)
    for method in (Newmark(0.1), GeneralizedAlpha(0.1, 0.5)):
        run = integrate(system, [1.0, 1e-6], [0.0, 0.0], 100.0, method=method)
        assert np.abs(run.q).max() < 1.1


def test_coupled_damping_has_limits_too():
    system = coupled_dashpot()
    predicted = RK4(1.0).stable_dt(system).flight
    found = measured(RK4, system, [0.1, 0.0, -0.1], np.zeros(3), 0.5 * predicted, 2.0 * predicted)
    assert found == pytest.approx(predicted, rel=0.05)
    central = CentralDifference(1.0).stable_dt(system).flight
    found = measured(CentralDifference, system, [0.1, 0.0, -0.1], np.zeros(3), 0.5 * central, 2.0 * central)
    assert found == pytest.approx(central, rel=0.1)


# --- in contact ------------------------------------------------------------------------------------------------------


def pressed(depth, law=None, zeta=0.02):
    """Two modes at rest on a stop with a preload that indents it by ``depth``; (system, rest)."""
    law = Hertz(1e6) if law is None else law
    omega, w = np.array([20.0, 150.0]), np.array([1.0, 0.7])
    rest = w * float(law.force(depth, 0.0, 1.0)) / omega**2
    return System.modal(omega, zeta, [Contact(w, law, float(-w @ rest - depth))]), rest


@pytest.mark.parametrize("method", [heun, RK4, CentralDifference, linear_acceleration])
@pytest.mark.parametrize("law", [Hertz(1e6), PiecewiseLinear([5e4])], ids=["hertz", "linear"])
def test_limit_in_a_lasting_contact(method, law):
    depth = 1e-3
    system, rest = pressed(depth, law)
    predicted = method(1.0).stable_dt(system, indentation=depth)
    assert predicted.contact < 0.8 * predicted.flight
    start = rest + 1e-4 * depth, np.zeros(2)
    found = measured(method, system, *start, 0.5 * predicted.contact, 1.6 * predicted.contact, rest)
    assert found == pytest.approx(predicted.contact, rel=0.1)


def test_the_papers_two_steps_have_two_limits():
    depth = 1e-3
    system, rest = pressed(depth)
    predicted = heun(1.0).stable_dt(system, indentation=depth)
    low, high = 0.5 * predicted.contact, 1.6 * predicted.contact
    found = measured(partial(HenonRK2, 0.9 * predicted.flight), system, rest + 1e-7, np.zeros(2), low, high, rest)
    assert found == pytest.approx(predicted.contact, rel=0.1)


def test_expected_indentation_scales_the_limit_as_hertz_does():
    # k_t = 1.5 K δ^½, so the limit of a stiff stop goes with δ^-¼
    system = System.modal([1.0], 0.0, [Contact([1.0], Hertz(1e9))])
    one, two = (CentralDifference(1.0).stable_dt(system, indentation=d).contact for d in (1e-5, 16e-5))
    assert one / two == pytest.approx(2.0, rel=1e-3)
    assert one == pytest.approx(2.0 / math.sqrt(1.5 * 1e9 * math.sqrt(1e-5)), rel=1e-3)


def test_default_indentation_is_that_of_a_hit_at_one_metre_a_second():
    system = System([[2.0]], [[0.0]], [[0.0]], [Contact([1.0], PiecewiseLinear([800.0]))])
    assert CentralDifference(1.0).stable_dt(system).contact == pytest.approx(2.0 / 20.0, rel=1e-6)
    hertz = System([[2.0]], [[0.0]], [[0.0]], [Contact([1.0], Hertz(1e6))])
    depth = (5 * 2.0 / (4 * 1e6)) ** 0.4
    limit = CentralDifference(1.0)
    assert limit.stable_dt(hertz).contact == pytest.approx(limit.stable_dt(hertz, depth).contact, rel=1e-4)


def test_sparse_limits_are_those_of_dense_matrices():
    model = paper_scene().matrices(15)
    w = model.interpolation(0.24445).toarray()[0]
    dense = System(model.M.toarray(), 1e-6 * model.K.toarray(), model.K.toarray(), [Contact(w, Hertz(1e8))])
    for method in (RK4, CentralDifference):
        one, two = method(1.0).stable_dt(dense), method(1.0).stable_dt(as_sparse(dense))
        assert two.flight == pytest.approx(one.flight, rel=1e-6)
        assert two.contact == pytest.approx(one.contact, rel=1e-2)


# --- refused -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", [heun, RK4, CentralDifference, linear_acceleration])
def test_a_step_above_the_limit_is_refused_with_the_mode_and_the_step(method):
    model = paper_scene().reduce(modes=3)
    limit = method(1.0).stable_dt(model.system, duration=0.1)
    with pytest.raises(ValueError, match=r"unstable in flight: mode 3 of 3 allows .* take a step below .*force_unst"):
        model.simulate(0.1, solver=method(1.01 * limit.flight))
    if limit.contact < limit.flight:
        with pytest.raises(ValueError, match=r"unstable in contact"):
            model.simulate(0.1, solver=method(0.5 * (limit.flight + limit.contact)))
    assert model.simulate(0.05, solver=method(0.9 * min(limit[:2]))).complete


def test_refusal_knows_how_long_the_run_is():
    # undamped, Heun amplifies a mode by the factor exp((hω)³ωT/8)
    system = System.modal([100.0], 0.0)
    h = 1e-3
    assert integrate(system, [1.0], [0.0], 7.0, method=heun(h)).status.good
    with pytest.raises(ValueError, match="unstable in flight"):
        integrate(system, [1.0], [0.0], 9.0, method=heun(h))


def test_refusal_can_be_overridden():
    system = System.modal([100.0], 0.1)
    with pytest.raises(ValueError, match="unstable"):
        integrate(system, [0.0], [0.0], 1.0, method=RK4(0.1))
    assert integrate(system, [0.0], [0.0], 1.0, method=RK4(0.1, force_unstable=True)).status.good


# --- stopped -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", [heun, RK4, CentralDifference, linear_acceleration])
@pytest.mark.parametrize("form", ["modes", "sparse"])
def test_a_run_that_blows_up_is_stopped_early_and_explained(method, form):
    model = System.modal([10.0, 700.0], 0.005)
    if form == "sparse":
        turn = np.array([[0.8, -0.6], [0.6, 0.8]])
        model = as_sparse(System(np.eye(2), turn @ model.C @ turn.T, turn @ model.K @ turn.T))
        if method is heun:
            pytest.skip("steps on modes")
    dt = 1.2 * method(1.0).stable_dt(model).flight
    with pytest.raises(solvers.SolverError, match=r"stopped at t = .*more energy.*it grew in .*try ") as caught:
        integrate(model, [0.1, 1e-6], [0.0, 0.0], 1e4 * dt, dt, method(dt, force_unstable=True))
    solution = caught.value.solution
    assert solution.status is Status.GAINED
    assert np.abs(solution.q).max() < 1e9
    advised = float(str(caught.value).rsplit("try ", 1)[1].split()[0])
    assert advised < dt / 1.2
    assert integrate(model, [0.1, 1e-6], [0.0, 0.0], 100 * dt, method=method(advised)).status.good


def test_blow_up_with_coupled_damping_is_stopped():
    system = coupled_dashpot()
    dt = 1.3 * RK4(1.0).stable_dt(system).flight
    run = integrate(system, [0.1, 0.0, 0.0], np.zeros(3), 1000 * dt, method=RK4(dt, force_unstable=True), check=False)
    assert run.status in (Status.GAINED, Status.DIVERGED)


def test_blow_up_in_contact_is_stopped():
    system, rest = pressed(1e-3)
    dt = 1.5 * RK4(1.0).stable_dt(system, 1e-3).contact
    run = integrate(system, rest + 1e-5, np.zeros(2), 4000 * dt, method=RK4(dt, force_unstable=True), check=False)
    assert not run.status.good or np.abs(run.q[-1] - rest).max() < 1.0


@pytest.mark.parametrize("method", [heun, RK4, CentralDifference, Newmark, GeneralizedAlpha])
def test_good_runs_are_not_stopped(method):
    # loads that begin at zero, rest, a stop that gives energy back, a light start
    law = Hysteretic.lankarani_nikravesh(1e6, 0.5)
    system = System.modal(
        [20.0, 150.0], 0.02, [Contact([1.0, 0.7], law, 1e-4)], [([1.0, -1.0], lambda t: np.sin(9 * t) ** 3)]
    )
    for start in (0.0, 1e-12):
        assert integrate(system, [start, 0.0], [0.0, 0.0], 2.0, method=method(1e-4)).status.good
    late = System.modal([20.0], 0.02, loads=[([1.0], lambda t: np.where(t > 0.5, (t - 0.5) ** 3, 0.0))])
    assert integrate(late, [0.0], [0.0], 1.0, method=method(1e-3)).status.good
