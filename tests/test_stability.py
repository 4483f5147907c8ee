"""Predicted limits of the step against measured ones; runs that are refused, and runs that are stopped."""

import math
from functools import partial

import numpy as np
import pytest
from problems import as_sparse, coupled_dashpot, paper_scene, state_matrix
from scipy.integrate import quad
from scipy.linalg import expm

import fembeam as fb
import solvers
from contacts import Hertz, Hysteretic, Jenkins, KelvinVoigt, PiecewiseLinear, Polynomial, law
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
)


def heun(dt, **options):
    return HenonRK2(dt, dt, **options)


def linear_acceleration(dt, **options):
    return Newmark(dt, beta=1 / 6, **options)


def damped_newmark(dt, **options):
    return Newmark(dt, beta=0.1, gamma=0.6, **options)


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
@pytest.mark.parametrize("zeta", [1e-3, 0.1])
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


@pytest.mark.parametrize("zeta", [2.0, 30.0, 300.0])
def test_limits_of_overdamped_modes(zeta):
    """4 + (4γ-2) h c - (2γ-4β) h² k = 0, see `critical_step`: far beyond 1/c, and with γ > ½ beyond 1/√k."""
    c, k = 2.0 * zeta, 1.0
    system = System.modal([1.0], zeta)
    assert CentralDifference(1.0).stable_dt(system).flight == pytest.approx(2.0, rel=1e-6)
    assert linear_acceleration(1.0).stable_dt(system).flight == pytest.approx(math.sqrt(12.0), rel=1e-6)
    longest = max(np.roots([-1.5 * k, c, 4.0]))  # β = 0, γ = ¾
    assert Newmark(1.0, 0.0, 0.75).stable_dt(system).flight == pytest.approx(longest, rel=1e-4)
    assert Newmark(1.0).stable_dt(system).flight == math.inf
    with pytest.raises(ValueError, match="unstable in flight"):
        integrate(system, [1.0], [0.0], 1e3, method=CentralDifference(2.1))


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


def chain(seed):
    """Masses in a row with springs and with dashpots anywhere, up to several times critical: (M, C, K)."""
    random = np.random.default_rng(seed)
    n = int(random.integers(3, 21))

    def between(values):
        return np.diag(values) + np.diag(np.append(values[1:], 0.0)) - np.diag(values[1:], 1) - np.diag(values[1:], -1)

    M, K = np.diag(random.uniform(0.5, 2.0, n)), between(10.0 ** random.uniform(3.0, 5.0, n))
    ground = np.where(random.random(n) < 0.2, 10.0 ** random.uniform(0.0, 3.5, n), 0.0)
    dashpots = np.where(random.random(n) < 0.4, 10.0 ** random.uniform(0.0, 3.5, n), 0.0)
    return M, np.diag(ground) + between(dashpots) + 1e-5 * K, K


def damped_beam(elements, damping):
    """A beam with a dashpot at its stop."""
    model = paper_scene().matrices(elements)
    w = model.interpolation(0.24445).toarray()[0]
    M, K = model.M.toarray(), model.K.toarray()
    return M, damping * np.outer(w, w) + 1e-7 * K, K


def one_step(method, M, C, K):
    """The matrix by which a step of the made method multiplies [q, q']."""
    n, h = M.shape[0], method.steps[0]
    if isinstance(method, (RK4, HenonRK2)):
        A = state_matrix(M, C, K)
        order = 4 if isinstance(method, RK4) else 2
        return sum(np.linalg.matrix_power(h * A, j) / math.factorial(j) for j in range(order + 1))
    beta, gamma = method.constants[2:]
    old = np.linalg.solve(M, np.hstack((-K, -C)))
    q = np.hstack((np.eye(n), h * np.eye(n))) + h * h * (0.5 - beta) * old
    v = np.hstack((np.zeros((n, n)), np.eye(n))) + h * (1.0 - gamma) * old
    new = np.linalg.solve(M + gamma * h * C + beta * h * h * K, -C @ v - K @ q)
    return np.vstack((q + beta * h * h * new, v + gamma * h * new))


def exact_limit(method, M, C, K, around):
    """Smallest step whose matrix has an eigenvalue above 1, by bisection between half and twice a guess."""
    low, high = 0.5 * around, 2.0 * around
    for _ in range(10):
        middle = math.sqrt(low * high)
        grown = np.abs(np.linalg.eigvals(one_step(method(middle), M, C, K))).max() > 1.0 + 1e-7
        low, high = (low, middle) if grown else (middle, high)
    return low


DASHPOTS = [
    *(partial(chain, seed) for seed in range(4)),
    partial(damped_beam, 12, 3.0),
    partial(damped_beam, 31, 300.0),
]
strongly_damped = partial(Newmark, beta=0.2, gamma=0.7)


@pytest.mark.parametrize("matrices", DASHPOTS)
@pytest.mark.parametrize("method", [heun, RK4, CentralDifference, linear_acceleration, strongly_damped])
def test_limits_with_dashpots_are_those_of_the_matrix_of_one_step(method, matrices):
    M, C, K = matrices()
    forms = [System(M, C, K)] if method is heun else [System(M, C, K), as_sparse(System(M, C, K))]
    for system in forms:
        predicted = method(1.0).stable_dt(system).flight
        assert predicted == pytest.approx(exact_limit(method, M, C, K, predicted), rel=0.05)


def test_the_matrix_of_one_step_is_that_of_a_run():
    M, C, K = chain(3)
    for made in (RK4(1e-3), CentralDifference(1e-3), strongly_damped(1e-3)):
        for system in (System(M, C, K), as_sparse(System(M, C, K))):
            run = integrate(system, np.ones(len(M)), np.zeros(len(M)), 1e-3, method=made)
            expected = one_step(made, M, C, K) @ np.append(np.ones(len(M)), np.zeros(len(M)))
            np.testing.assert_allclose(np.append(run.q[-1], run.q_dot[-1]), expected, rtol=1e-9, atol=1e-10)


@pytest.mark.parametrize("method", [RK4, CentralDifference, linear_acceleration, strongly_damped])
def test_limits_in_contact_with_a_dashpot_are_those_of_the_matrix_of_one_step(method):
    omega, w, law = np.array([20.0, 150.0, 400.0]), np.array([1.0, 0.7, -0.4]), KelvinVoigt(5e4, 300.0)
    system = System.modal(omega, 0.02, [Contact(w, law)])
    predicted = method(1.0).stable_dt(system).contact
    M, C, K = system.M, system.C + 300.0 * np.outer(w, w), system.K + 5e4 * np.outer(w, w)
    assert predicted == pytest.approx(exact_limit(method, M, C, K, predicted), rel=0.01)


# --- in contact ------------------------------------------------------------------------------------------------------


def pressed(depth, law=None, zeta=0.02):
    """Two modes at rest on a stop with a preload that indents it by ``depth``; (system, rest)."""
    law = Hertz(1e6) if law is None else law
    omega, w = np.array([20.0, 150.0]), np.array([1.0, 0.7])
    rest = w * float(law.force(depth, 0.0, 1.0)) / omega**2
    return System.modal(omega, zeta, [Contact(w, law, float(-w @ rest - depth))]), rest


@pytest.mark.parametrize(
    ("method", "law"),
    [(heun, Hertz(1e6)), (RK4, PiecewiseLinear([5e4])), (CentralDifference, Hertz(1e6)),
     (linear_acceleration, PiecewiseLinear([5e4]))],
)  # fmt: skip
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


def test_a_stop_that_gives_more_than_it_took_is_noticed():
    # stable by Newmark's rule, but a contact of one step returns a hundred times the energy it took
    system = System.modal([10.0], 0.0, [Contact([1.0], PiecewiseLinear([1e7]))])
    with pytest.raises(solvers.SolverError, match=r"more energy.*try ") as caught:
        integrate(system, [1.0], [0.0], 3.0, method=Newmark(1e-3, locate=False))
    assert caught.value.solution.status is Status.GAINED
    advised = float(str(caught.value).rsplit("try ", 1)[1].split()[0])
    run = integrate(system, [1.0], [0.0], 3.0, 0.1, method=Newmark(advised, locate=False))
    assert run.energy.stored.max() < 1.5 * run.energy.initial


def test_a_run_that_ends_while_it_blows_up_is_noticed():
    dt = 0.2
    run = integrate(System.modal([100.0], 0.0), [1.0], [0.0], 6 * dt, method=heun(dt, force_unstable=True), check=False)
    assert run.status is Status.GAINED


@pytest.mark.parametrize("spring", [PiecewiseLinear(4.0), Hertz(4.0, 1.0), PiecewiseLinear(1.0) + Hertz(3.0, 1.0)])
def test_springs_begun_drawn_give_back_what_they_hold(spring):
    """At q = 1, δ = -1, a law for stops that acts both ways holds 2 J: ω² = 1 + 4."""
    system = System.modal([1.0], 0.0, [Contact([1.0], spring, always=True)])
    end = integrate(system, [1.0], [0.0], 10.0, method=DormandPrince(1e-11))
    assert end.q[-1, 0] == pytest.approx(math.cos(math.sqrt(5.0) * 10.0), abs=1e-8)
    assert end.losses.stored[0] == pytest.approx(2.0 * (end.q[-1, 0] ** 2 - 1.0), rel=1e-8)


@pytest.mark.parametrize("beside", [None, Jenkins(1e-9, 1.0)])
def test_a_snap_through_spring_may_fall_into_its_other_well(beside):
    """F = δ + 2.5 δ² + δ³ from its hill at δ = -½ to the well at -2, 0.7 J below: the energy is that of the start."""
    spring = Polynomial([1.0, 2.5, 1.0])
    system = System.modal([0.1], 0.0, [Contact([1.0], spring if beside is None else spring + beside, always=True)])
    run = integrate(system, [0.6], [0.0], 10.0, 0.1, method=DormandPrince(1e-11))
    assert run.q.max() > 2.0
    held = np.polynomial.Polynomial([0.0, 0.0, 0.505, -2.5 / 3.0, 0.25])
    np.testing.assert_allclose(0.5 * run.q_dot[:, 0] ** 2 + held(run.q[:, 0]), held(0.6), atol=1e-8)


def test_a_constant_whose_phase_leaves_nothing_is_no_load():
    """cos(π/2) is 6e-17: that was taken for rounding beside an amplitude of 10 N, and the motion for gained."""
    system = System.modal([100.0, 800.0], 0.01, loads=[([1.0, 1.0], fb.Harmonic(10.0, 0.0, math.pi / 2.0))])
    run = integrate(system, np.zeros(2), np.zeros(2), 0.1, method=DormandPrince())
    assert np.abs(run.q).max() < 1e-18


def test_laws_that_give_energy_on_purpose_are_let():
    @law
    def driving(delta, delta_dot, entry_rate, stiffness=1e4, push=0.1):
        return stiffness * delta - push * stiffness * delta * delta_dot

    system = System.modal([10.0], 0.0, [Contact([1.0], driving())])
    run = integrate(system, [0.1], [0.0], 4.0, 0.1, RK4(1e-4, force_unstable=True))
    assert run.energy.stored.max() > 2.5 * run.energy.initial


def test_what_a_preload_holds_may_come_out():
    system = System.modal([1.0], 0.0, [Contact([1.0], Hertz(1e6), -0.01)])
    run = integrate(system, [0.0], [0.0], 1.0, 1e-3, RK4(1e-5))
    assert run.energy.stored.max() == pytest.approx(1e6 * 0.01**2.5 / 2.5, rel=1e-3)


@pytest.mark.parametrize("method", [RK4, CentralDifference, Newmark, GeneralizedAlpha, heun])
def test_a_step_blind_to_its_load_is_refused(method):
    fast = System.modal([0.1], 0.1, loads=[([1.0], fb.Harmonic(1.0, 400.0))])
    with pytest.raises(ValueError, match=r"samples a load of 400 rad/s less than twice .* take a step below 0.00785 s"):
        integrate(fast, [0.0], [0.0], 1.0, method=method(0.01))
    forced = integrate(fast, [0.0], [0.0], 1.0, method=method(0.01, force_unstable=True), check=False)
    assert forced.cost.steps > 2
    rough = System.modal([0.1], 0.1, loads=[([1.0], fb.BandNoise(1.0, (300.0, 500.0), seed=1))])
    with pytest.raises(ValueError, match="samples a load of"):
        integrate(rough, [0.0], [0.0], 1.0, method=method(0.01))


def tried(seed):
    """A random system, start, method and step: (arguments of `integrate`, step)."""
    random = np.random.default_rng(seed)
    n = int(random.integers(1, 4))
    omega = np.sort(10.0 ** random.uniform(0.5, 3.5, n))
    stiffness = 10.0 ** random.uniform(3, 9)
    laws = Hertz(stiffness), Hysteretic(stiffness, 0.5625), KelvinVoigt(stiffness, 10.0), PiecewiseLinear([stiffness])
    stops = [
        Contact(random.uniform(-1, 1, n), laws[random.integers(4)], random.choice([-1e-4, 0.0, 1e-3]))
        for _ in range(random.integers(0, 3))
    ]
    loads = [(random.uniform(-10, 10, n), fb.Harmonic(1.0, 10.0 ** random.uniform(0, 3)))] * int(random.random() < 0.5)
    h = 10.0 ** random.uniform(-2, 1.3) / omega[-1]
    locate = {"locate": bool(random.random() < 0.5)}
    kinds = [heun, *(partial(kind, **locate) for kind in (RK4, CentralDifference, Newmark, linear_acceleration))]
    method = kinds[random.integers(5)](h, force_unstable=bool(random.random() < 0.5))
    start = 10.0 ** random.uniform(-4, -1) * random.normal(size=n), random.normal(size=n)
    return System.modal(omega, 0.01, stops, loads), *start, min(500 * h, 40.0 / omega[0]), method, h


def test_nothing_that_is_done_holds_energy_from_nowhere():
    """Random runs are refused, stopped, or end with no more than twice the energy that was there or came in."""
    count = {"refused": 0, "stopped": 0, "done": 0}
    for seed in range(80):
        system, q0, q_dot0, duration, method, h = tried(seed)
        try:
            run = integrate(system, q0, q_dot0, duration, max(h, duration / 300), method, check=False)
        except ValueError:
            count["refused"] += 1
            continue
        count["done" if run.status.good else "stopped"] += 1
        assert run.status in (Status.DONE, Status.GAINED, Status.DIVERGED), seed
        if run.status.good:
            depths = [max(-c.direction @ q0 - c.gap, 0.0) for c in system.contacts]
            held = sum(quad(c.law.force, 0.0, d, (0.0, 1.0))[0] for c, d in zip(system.contacts, depths, strict=True))
            given = run.energy.initial + held + run.energy.input.max(initial=0.0)
            assert run.energy.stored[-9:].min() < 3.0 * given, seed
    assert min(count.values()) >= 5, count


@pytest.mark.parametrize("method", [heun, RK4, CentralDifference, Newmark, GeneralizedAlpha])
def test_good_runs_are_not_stopped(method):
    # loads that begin at zero, rest, a stop that gives energy back, a light start
    hysteretic = Hysteretic.lankarani_nikravesh(1e6, 0.5)
    system = System.modal(
        [20.0, 150.0], 0.02, [Contact([1.0, 0.7], hysteretic, 1e-4)], [([1.0, -1.0], lambda t: np.sin(9 * t) ** 3)]
    )
    for start in (0.0, 1e-12):
        assert integrate(system, [start, 0.0], [0.0, 0.0], 2.0, method=method(1e-4)).status.good
    late = System.modal([20.0], 0.02, loads=[([1.0], lambda t: np.where(t > 0.5, (t - 0.5) ** 3, 0.0))])
    assert integrate(late, [0.0], [0.0], 1.0, method=method(1e-3)).status.good


@pytest.mark.parametrize("rtol", [1e-8, 1e-10])
@pytest.mark.parametrize(
    ("omega", "direction", "stiffness", "damping", "duration"),
    [
        ([1.0, 61.95, 134.46], [-0.035, 0.672, -0.9173], 92.9, 52.8, 98.4),
        ([1.0, 10.0, 35.0, 525.0, 986.0], [0.3, -0.5, -0.6, -0.4, -0.5], 13.0, 610.0, 40.0),
        ([1.0, 14.8, 25.0, 403.0], [0.43, -0.2, -0.11, 0.165], 3.0, 740.0, 23.0),
    ],
)
def test_undamped_modes_between_the_nodes_do_not_swing_by_a_dashpot_in_contact(
    omega, direction, stiffness, damping, duration, rtol
):
    """A stop that is never left, beside its matrix exponential.

    The force that a fast mode makes at the nodes, a smooth polynomial between them, moved it more than it swung itself:
    from rounding on it grew by up to 5 a step. Rates were off by up to a thousand rtol, and in the first case by 13 to
    43 if only the ripple of the dashpot counts.
    """
    n, row = len(omega), np.array(direction)
    K = np.diag(np.square(omega)) + stiffness * np.outer(row, row)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-K, -damping * np.outer(row, row)]])
    rest = np.linalg.solve(K, 50.0 * stiffness * row)
    start = np.append(np.eye(n)[0], np.zeros(n))
    stop = Contact(row, KelvinVoigt(stiffness, damping, clamp=False), gap=-50.0)
    system = System.modal(omega, 0.0, [stop])
    run = integrate(system, rest + start[:n], start[n:], duration, dt=duration / 8, method=Exponential(rtol))
    exact = [expm(A * t) @ start for t in run.t]
    assert np.abs(run.q_dot - np.array(exact)[:, n:]).max() < 5.0 * rtol
