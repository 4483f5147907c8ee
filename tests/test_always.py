"""Contacts that act at both signs of δ: springs, cubic springs, dashpots."""

import numpy as np
import pytest
from differences import central, end_of, jacobian
from scipy.integrate import quad

from contacts import Hertz, KelvinVoigt, Polynomial
from solvers import (
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

STIFFNESS, START = 4.0, 1.3


def spring(law, stiffness=0.0, direction=-1.0, gap=0.0):
    """A unit mass at a spring of its own and one contact that always acts."""
    contact = Contact([direction], law, gap=gap, always=True)
    return System(M=[[1.0]], C=[[0.0]], K=[[stiffness]], contacts=[contact])


@pytest.mark.parametrize("rtol", [1e-6, 1e-9])
def test_a_linear_element_is_a_spring(rtol):
    run = integrate(spring(KelvinVoigt(STIFFNESS, 0.0)), [1.0], [0.3], 20.0, dt=0.5, method=Exponential(rtol))
    exact = np.cos(2.0 * run.t) + 0.15 * np.sin(2.0 * run.t)
    assert abs(run.q[:, 0] - exact).max() < 10.0 * rtol
    assert abs(run.energy.residual).max() < 10.0 * rtol


def test_a_dashpot_acts_both_ways():
    run = integrate(spring(KelvinVoigt(STIFFNESS, 0.8)), [1.0], [0.0], 8.0, dt=0.5, method=Exponential(1e-10))
    omega = np.sqrt(STIFFNESS - 0.16)
    exact = np.exp(-0.4 * run.t) * (np.cos(omega * run.t) + 0.4 / omega * np.sin(omega * run.t))
    assert abs(run.q[:, 0] - exact).max() < 1e-9
    assert abs(run.energy.residual).max() < 1e-9


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_period_of_a_cubic_spring_is_that_of_its_energy(sign):
    """T = 4 ∫ dq/q' over a quarter; the element's direction does not matter, its force is odd."""

    def energy(q):
        return 0.5 * q**2 + 0.5 * q**4

    def time(angle):
        return START * np.cos(angle) / np.sqrt(2.0 * (energy(START) - energy(START * np.sin(angle))))

    period = 4.0 * quad(time, 0.0, np.pi / 2.0, epsabs=1e-13)[0]
    system = spring(Polynomial([0.0, 0.0, 2.0]), stiffness=1.0, direction=sign)
    end = integrate(system, [START], [0.0], 7.0 * period, method=Exponential(1e-10))
    assert abs(end.q[-1, 0] - START) < 1e-9
    assert abs(end.q_dot[-1, 0]) < 1e-8


@pytest.mark.parametrize(
    ("method", "error"),
    [
        (DormandPrince(1e-10), 1e-8),
        (HenonRK2(1e-3, 1e-3), 1e-4),
        (Newmark(1e-3), 1e-4),
        (GeneralizedAlpha(1e-3), 1e-3),
        (CentralDifference(1e-3), 1e-4),
    ],
)
def test_other_methods_move_alike(method, error):
    system = spring(Polynomial([1.0, 0.0, 2.0]), stiffness=1.0, gap=0.1)
    exact = integrate(system, [START], [0.5], 6.0, method=Exponential(1e-11))
    other = integrate(system, [START], [0.5], 6.0, method=method)
    assert abs(other.q[-1, 0] - exact.q[-1, 0]) < error


def test_it_is_no_contact_of_the_log_and_stops_beside_it_are_seen():
    """A ball thrown at a stop, held back by a spring that always acts."""
    contacts = [Contact([-1.0], KelvinVoigt(1.0, 0.0), always=True), Contact([1.0], Hertz(1e4), gap=0.5)]
    run = integrate(System([[1.0]], [[0.0]], [[0.0]], contacts), [0.0], [-1.0], 20.0, dt=0.1)
    assert set(run.contacts.stop.tolist()) == {1}
    assert len(run.contacts) > 3
    assert np.allclose(run.contacts.speed_in, np.sqrt(0.75), atol=1e-9)
    assert abs(run.energy.residual).max() < 1e-8


def test_tangent_of_a_nonlinear_element():
    """Derivatives of the end by the start against differences of runs."""
    system, start = spring(Polynomial([0.0, 0.0, 2.0]), stiffness=1.0), np.array([START, 0.2])
    found = integrate(system, start[:1], start[1:], 9.0, method=Exponential(1e-11), tangent=True).tangent
    assert abs(found - jacobian(end_of(system, 9.0), start, 1e-5, central)).max() < 1e-6 * abs(found).max()


def test_a_law_for_positive_indentations_only_is_refused():
    with pytest.raises(ValueError, match="defined for delta > 0 only"):
        integrate(spring(Hertz(1e3)), [1.0], [0.0], 1.0)
