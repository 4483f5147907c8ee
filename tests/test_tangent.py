"""The derivative of a whole run, against differences of runs, closed forms and the volume of state space."""

import math
from itertools import product

import numpy as np
import pytest
from differences import central, end_of, five_points, jacobian
from numpy.testing import assert_allclose
from oscillators import Tone
from refusals import refused
from scipy.linalg import expm

from contacts import (
    BoucWen,
    ElastoPlastic,
    Hertz,
    Hysteretic,
    Jenkins,
    KelvinVoigt,
    PiecewiseLinear,
    Viscoelastic,
    WaltonBraun,
    law,
)
from solvers import Contact, DormandPrince, Exponential, Parameter, SolverError, System, integrate, lyapunov, orbit

OMEGA, ZETA = np.array([109.13, 790.6, 2303.7, 4700.0, 7800.0]), np.array([0.02, 0.01, 0.01, 0.01, 0.01])
PHI, GAMMA = np.array([6.2, -1.9, 3.0, -2.5, 2.2]), np.array([0.16, 0.02, 0.01, 0.01, 0.005])
LAWS = {
    "hysteretic": Hysteretic(2.1e8, damping_factor=0.5625),
    "hertz": Hertz(2.1e8),
    "kelvin_voigt": KelvinVoigt(2e5, 30.0),
    "piecewise": PiecewiseLinear([1e5, 4e5], knots=[2e-5]),
}


def beam(n=2, law=LAWS["hysteretic"], amplitude=40.0, omega=195.0, gap=0.0, opposite=None, sampled=False, zeta=1.0):
    contacts = [Contact(PHI[:n], law, gap)]
    if opposite:
        contacts.append(Contact(-0.8 * PHI[:n], opposite, 3e-4))
    tone = Tone(amplitude, omega)
    signal = (lambda t: tone(t)) if sampled else tone
    return System.modal(OMEGA[:n], zeta * ZETA[:n], contacts, [(GAMMA[:n], signal)])


def start(n, seed=0):
    rng = np.random.default_rng(seed)
    return rng.normal(size=n) * 1e-4 / np.arange(1, n + 1) ** 2, rng.normal(size=n) * 2e-2 / np.arange(1, n + 1)


def end(system, q, q_dot, duration):
    return end_of(system, duration)(np.concatenate((q, q_dot)))


def differences(system, q, q_dot, duration):
    x = np.concatenate((q, q_dot))
    scale = np.abs(x) + 1e-3 * np.abs(x).max()
    return jacobian(end_of(system, duration), x, 1.5e-5 * scale)


def differenced(system, q, q_dot, duration):
    """A run whose tangent is that of differences."""
    solution = integrate(system, q, q_dot, duration, method=Exponential(1e-11), tangent=True)
    expected = differences(system, q, q_dot, duration)
    assert_allclose(solution.tangent, expected, rtol=0, atol=1e-7 * np.abs(expected).max())
    return solution


JUMPING = PiecewiseLinear([1e5, 2e6], [2e-5], damping=[30.0, 250.0])


@pytest.mark.parametrize(("law", "modes"), [*product(LAWS.values(), (1, 2, 5)), (JUMPING, 2)])
def test_against_differences_of_runs(law, modes):
    assert len(differenced(beam(modes, law), *start(modes, seed=3), 0.06).contacts) >= 2


@pytest.mark.parametrize("sampled", [False, True])
@pytest.mark.parametrize("name", ["hysteretic", "kelvin_voigt"])
def test_two_stops_on_opposite_sides(name, sampled):
    system = beam(2, LAWS[name], opposite=LAWS["hertz"], sampled=sampled)
    assert set(differenced(system, *start(2, seed=1), 0.03).contacts.stop) == {0, 1}


def test_preload_end_in_contact_and_user_law():
    @law
    def cubic(delta, delta_dot, entry_rate, stiffness):
        return stiffness * (delta + 1e3 * delta**3)

    for duration in (1e-3, 2.3e-3):
        differenced(beam(2, cubic(stiffness=3e5), gap=-2e-5), *start(2), duration)


@pytest.mark.parametrize(("knots", "hard", "damped"), [([2e-5], 2e6, 250.0), ([2e-5, 2.0001e-5], 4e5, 0.0)])
def test_user_law_with_knots(knots, hard, damped):
    """Slopes are those of one side of a knot, where slope and force jump."""

    @law(knots=knots, jump=True)
    def two_slopes(delta, delta_dot, entry_rate, soft=1e5, hard=1.0, damped=0.0):
        if delta <= 2e-5:
            return soft * delta + 30.0 * delta_dot
        return soft * 2e-5 + hard * (delta - 2e-5) + (30.0 + damped) * delta_dot

    used = two_slopes(hard=hard, damped=damped)
    found = differenced(beam(2, used), *start(2, seed=3), 0.06)
    assert found.contacts.peak_indentation.max() > 2.1e-5
    known = PiecewiseLinear([1e5, hard], [2e-5], damping=[30.0, 30.0 + damped])
    expected = integrate(beam(2, known), *start(2, seed=3), 0.06, method=Exponential(1e-11), tangent=True).tangent
    assert_allclose(found.tangent, expected, rtol=0, atol=1e-7 * np.abs(expected).max())


def test_the_end_within_every_kind_of_contact_step():
    system, (q, q_dot) = beam(2), start(2)
    log = integrate(system, q, q_dot, 0.05).contacts
    for share in (0.003, 0.3, 0.97, 0.9999):
        differenced(system, q, q_dot, log.t_in[-1] + share * (log.t_out[-1] - log.t_in[-1]))


PARAMETERS = {
    "omega": (lambda p: beam(omega=p), 195.0),
    "omega, two stops": (lambda p: beam(omega=p, opposite=LAWS["hertz"]), 195.0),
    "amplitude": (lambda p: beam(amplitude=p), 40.0),
    "gap": (lambda p: beam(gap=p), 1e-5),
    "stiffness": (lambda p: beam(law=Hysteretic(p, damping_factor=0.5)), 2.1e8),
    "damping_factor": (lambda p: beam(law=Hysteretic(2.1e8, damping_factor=p)), 0.5),
    "dashpot": (lambda p: beam(law=KelvinVoigt(2e5, p)), 30.0),
    "dashpot, cut at zero": (lambda p: beam(law=KelvinVoigt(2e5, p, clamp=True)), 30.0),
    "stiffness, cut at zero": (lambda p: beam(law=KelvinVoigt(p, 30.0, clamp=True)), 2e5),
    "slope": (lambda p: beam(law=PiecewiseLinear([1e5, p], knots=[2e-5])), 4e5),
    "knot": (lambda p: beam(law=PiecewiseLinear([1e5, 4e5], knots=[p])), 2e-5),
    "zeta": (lambda p: beam(zeta=p), 1.0),
    "sampled": (lambda p: beam(omega=p, sampled=True), 195.0),
}
DIFFERENCED = {"knot", "zeta", "sampled"}


@pytest.mark.parametrize("name", PARAMETERS)
def test_parameter(name):
    make, value = PARAMETERS[name]
    step, (q, q_dot) = 1e-5 * value, start(2, seed=3)
    parameter = Parameter(make(value - step), make(value + step), step)
    solution = integrate(make(value), q, q_dot, 0.05, method=Exponential(1e-11), tangent=parameter)
    assert solution.tangent.shape == (4, 5)
    assert len(solution.contacts) >= 1
    expected = five_points(lambda h: end(make(value + h), q, q_dot, 0.05), 1.5e-5 * value)
    tolerance = 1e-6 if name in DIFFERENCED else 1e-7
    np.testing.assert_allclose(solution.tangent[:, -1], expected, rtol=0, atol=tolerance * np.abs(expected).max())


def test_flight_is_the_matrix_exponential():
    C = np.array([[3.0, -1.0], [-1.0, 4.0]])  # couples the modes
    K = np.diag([100.0, 900.0])
    system = System(np.eye(2), C, K)
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-K, -C]])
    found = integrate(system, [1.0, 0.0], [0.0, 1.0], 0.3, tangent=True).tangent
    np.testing.assert_allclose(found, expm(0.3 * A), atol=1e-12)


@pytest.mark.parametrize("name", ["hertz", "piecewise"])
def test_an_elastic_stop_keeps_the_volume_of_state_space(name):
    # Liouville: det = exp(-∫ trace C dt), whatever the elastic stops do
    system, (q, q_dot) = beam(3, LAWS[name], opposite=LAWS["hertz"]), start(3)
    solution = integrate(system, q, q_dot, 0.02, method=Exponential(1e-11), tangent=True)
    assert len(solution.contacts) >= 3
    expected = np.exp(-2.0 * 0.02 * np.sum(ZETA[:3] * OMEGA[:3]))
    assert np.linalg.det(solution.tangent) == pytest.approx(expected, rel=1e-8)


def test_saltation_of_a_force_jump_in_closed_form():
    # without stiffness the dashpot alone acts: a mass m at speed v meets c v at once, so v' = -c v/m from then on
    m, c, v, gap = 2.0, 3.0, 0.7, 0.1
    system = System([[m]], [[0.0]], [[0.0]], [Contact([-1.0], KelvinVoigt(1e-9, c), gap)])
    duration = 0.5
    inside = duration - gap / v
    found = integrate(system, [0.0], [v], duration, method=Exponential(1e-12), tangent=True).tangent
    decay = np.exp(-c * inside / m)
    # q = gap + (v m/c)(1 - decay), with the entry at (gap - q0)/v
    expected = [[decay, (1.0 - decay) * m / c + gap / v * decay], [-c / m * decay, decay * (1.0 - c / m * gap / v)]]
    np.testing.assert_allclose(found, expected, atol=1e-8)


@pytest.mark.parametrize("speed", [1e-7, 3e-7, 1e-6])
def test_hysteresis_that_turns_at_once(speed):
    """z of Bouc and Wen is 1e-13 m at the reversal, less than what its border's slopes are differences over."""
    element = Contact([1.0], BoucWen(45.0, 0.3, 1.0, 4e6, 8e5, n=2), always=True)
    system = System([[1.0]], [[0.1]], [[30.0]], [element], [([1.0], Tone(-0.01, 1e-3))])
    run = integrate(system, [0.0], [speed], 1.0, method=Exponential(1e-11), tangent=True)
    assert run.transitions.event[:2].tolist() == ["reversal", "zero"]
    assert_allclose(run.tangent, jacobian(end_of(system, 1.0), [0.0, speed], 1e-8, central), atol=1e-5)


def test_error_falls_with_the_tolerance():
    system, (q, q_dot) = beam(2), start(2, seed=3)
    found = [
        integrate(system, q, q_dot, 0.06, method=Exponential(r), tangent=True).tangent for r in (1e-5, 1e-8, 1e-12)
    ]
    errors = [np.abs(x - found[-1]).max() / np.abs(found[-1]).max() for x in found[:-1]]
    assert errors[0] < 1e-3
    assert errors[1] < 1e-6


def test_the_run_is_the_same_and_long_runs_replay_in_pieces():
    system, (q, q_dot) = beam(2), start(2)
    plain, followed = (integrate(system, q, q_dot, 3.0, tangent=flag) for flag in (False, True))
    assert plain.tangent is None
    np.testing.assert_array_equal(plain.q, followed.q)
    np.testing.assert_array_equal(plain.contacts.t_in, followed.contacts.t_in)
    assert followed.cost.steps > 1024  # more than one tape


def test_a_start_at_rest_on_the_stop_has_a_finite_tangent():
    # the entry at t = 0 has no rate, so that its time has no derivative; what follows has
    tangent = integrate(beam(2), np.zeros(2), np.zeros(2), 0.3, tangent=True).tangent
    assert np.all(np.isfinite(tangent))


def test_an_entry_at_the_start_does_not_time_what_begins_beyond_its_border():
    """A spring that is met at t = 0 wherever the start is, and a stop that the start just touches, moving in."""
    stops = [Contact([1.0, 0.3], WaltonBraun(8e4, 9e4), -0.5), Contact([-0.5, 1.0], Hertz(4e7, 2.0))]
    system = System.modal([10.0, 40.0], 0.01, stops)
    q, v, duration = np.zeros(2), np.array([0.2, -1.0]), 5e-3
    found = integrate(system, q, v, duration, method=Exponential(1e-11), tangent=True)
    assert found.contacts.t_in[:2].tolist() == [0.0, 0.0]
    exact = jacobian(end_of(system, duration), np.append(q, v), 1e-6, central)
    assert_allclose(found.tangent, exact, rtol=0.0, atol=1e-4 * np.abs(exact).max())


def stiffened(system, row, law):
    """The matrix of the first-order system of a structure with the law as an element of it."""
    n, stiffness = system.size, np.outer(row, row)
    K, C = system.K + law.stiffness * stiffness, system.C + law.damping * stiffness
    return np.block([[np.zeros((n, n)), np.eye(n)], [-K, -C]])


@pytest.mark.parametrize("rtol", [1e-6, 1e-8, 1e-11])
@pytest.mark.parametrize(
    "law", [KelvinVoigt(25.0, 0.3), KelvinVoigt(1e3, 0.0), KelvinVoigt(25.0, 300.0)], ids=["damped", "stiff", "dashpot"]
)
def test_at_rest_in_contact_the_neighbours_are_resolved(law, rtol):
    """A motion at rest lets steps grow beyond what the contact's stiffness makes of the structure's periods."""
    row = np.array([1.0, 0.5])
    system = System.modal([1.0, 3.0], [0.02, 0.01], [Contact(row, law, gap=-1.0)])
    rest = np.linalg.solve(system.K + law.stiffness * np.outer(row, row), row * law.stiffness)
    found = integrate(system, rest, np.zeros(2), 10.0, method=Exponential(rtol), tangent=True)
    exact = expm(10.0 * stiffened(system, row, law))
    assert_allclose(found.tangent, exact, rtol=0.0, atol=10.0 * rtol * np.abs(exact).max())


@pytest.mark.parametrize("rtol", [1e-8, 1e-9, 1e-11])
@pytest.mark.parametrize("law", [KelvinVoigt(40.0, 0.5), ElastoPlastic(40.0, 1e3)], ids=["dashpot", "elastic"])
def test_neighbours_that_move_in_a_fast_mode_feel_a_slow_element(law, rtol):
    """The motion is slow and takes long steps; an element turns the phase of what is beside it in the third mode."""
    omega, row = np.array([3.0, 13.0, 5e3]), np.array([1.0, 0.8, 0.7])
    system = System.modal(omega, 1e-5, [Contact(row, law, always=True)])
    found = integrate(system, [0.1, 0.05, 0.0], [0.2, 0.1, 0.0], 1.3, method=Exponential(rtol), tangent=True).tangent
    exact = expm(1.3 * stiffened(system, row, KelvinVoigt(law.stiffness, getattr(law, "damping", 0.0))))
    unit = np.append(1.0 / omega, np.ones(3))  # of equal energy
    assert_allclose(found * unit / unit[:, None], exact * unit / unit[:, None], rtol=0.0, atol=1000.0 * rtol)


def test_multipliers_under_a_slow_drive_of_a_stiff_element():
    """The drive does not shake what the element stiffens 10⁴ times; |μ| was told as 19."""
    row, law, omega = np.array([1.0, 0.7]), KelvinVoigt(1e4, 0.0), 1.3
    load = [([1.0, 0.3], Tone(1.0, omega))]
    system = System.modal([1.0, 3.0], [0.02, 0.01], [Contact(row, law, always=True)], load)
    found = orbit(system, 2.0 * np.pi / omega)
    exact = np.exp(np.linalg.eigvals(stiffened(system, row, law)) * found.period)
    assert_allclose(np.sort(np.abs(found.multipliers)), np.sort(np.abs(exact)), rtol=1e-7)
    assert (found.stable, found.doubt) == (True, "")


def tangent_of(law, tangent=True, always=False, **options):
    """That of a run of one mode beside the law."""
    system = System.modal([1.0], [0.0], [Contact([1.0], law, always=always)])
    return integrate(system, [0.0], [0.0], 1.0, tangent=tangent, **options)


TSUJI = Viscoelastic.tsuji(2e7, 0.6, 0.3)

test_bad_input = refused(
    (lambda: tangent_of(Hertz(1e6), method=DormandPrince()), "not offered by DormandPrince; use Exponential"),
    (lambda: tangent_of(Hertz(1e6), "omega"), r"must be True, False or a solvers\.Parameter", TypeError),
    (lambda: tangent_of(TSUJI), "tangent is not offered for the law of contact 0: its slope is infinite"),
    (lambda: tangent_of(Viscoelastic(1e8, 1e3, exponent=2.8)), "its slope is infinite"),
    (lambda: tangent_of(WaltonBraun(1e6, 2e6) + TSUJI, always=True), "its slope is infinite"),
    (lambda: tangent_of(Jenkins(1e6, 10.0) + TSUJI, always=True), "its slope is infinite"),
    (lambda: Parameter(beam(1), beam(2), 1.0), "differ in coordinates"),
    (lambda: Parameter(beam(1), beam(1), 0.0), "step"),
)


def test_what_is_discarded_does_not_count():
    # a fast decay first, then the slow one alone: e^(-0.5 t); without contacts, and with a few at the beginning
    period = 2 * math.pi / (10.0 * math.sqrt(1.0 - 0.05**2))  # of which the size of the tangent has half
    for contacts in ((), [Contact([1.0, 1.0], Hertz(1e4), 0.2)]):
        model = System.modal([10.0, 40.0], [0.05, 0.5], contacts)
        late = lyapunov(model, [0.5, 0.0], [0.0, 0.0], duration=40 * period, discard=10 * period)
        assert late.value == pytest.approx(-0.5, rel=1e-6)
        assert late.error < 1e-6


@pytest.mark.parametrize("unit", [1.0, 1e-6, 1e4])
def test_exponent_in_any_unit_of_time(unit):
    """Of the norm of energy, in which e^(-2 t) shows from the start; contacts at a stop as stiff are no exception."""
    omega = np.array([100.0]) / unit
    value, error = lyapunov(System.modal(omega, [0.02]), [1.0], [0.0], duration=10.0 * unit)
    assert value * unit == pytest.approx(-2.0, rel=3e-3)
    assert error * unit < 0.03
    stop = Contact([1.0], KelvinVoigt(1e4 / unit**2, 10.0 / unit), 0.1)
    impacting = lyapunov(System.modal(omega, [0.02], [stop]), [1.0], [0.0], duration=1.0 * unit)
    in_seconds = lyapunov(System.modal(omega * unit, [0.02], [Contact([1.0], KelvinVoigt(1e4, 10.0), 0.1)]), [1.0],
                          [0.0], duration=1.0)  # fmt: skip
    assert np.array(impacting) * unit == pytest.approx(in_seconds, rel=1e-6)


def test_exponent_of_a_motion_whose_tangent_nearly_vanishes():
    free = System.modal(omega=[10.0], zeta=[0.1])
    assert lyapunov(free, [1.0], [0.0], duration=600.0).value == pytest.approx(-1.0, rel=0.01)  # e^-600 squared is 0
    with pytest.raises(SolverError, match="the tangent vanished"):
        lyapunov(free, [1.0], [0.0], duration=20000.0)
