"""Derivatives of runs through circular clearances: against differences of another method, and of periodic orbits."""

import numpy as np
import pytest
from differences import end_of, five_points, jacobian
from oscillators import Tone

from contacts import Hertz, Hysteretic, KelvinVoigt
from solvers import Contact, DormandPrince, Exponential, Parameter, System, integrate

SHARP = DormandPrince(1e-13, 1e-20)
SCALE = np.repeat([1e-3, 0.3], 4)  # m and m/s in modal units
V = np.array([0.3, -0.2, 0.1, 0.4])
DURATION = 0.06


def tube(law, *more, outer=False, gap=1e-3, centre=(1e-4, -2e-4)):
    """Two modes in each of two planes, a hole, or a post, and two loads."""
    omega = np.array([30.0, 33.0, 190.0, 209.0])
    rows = np.array([[1.0, 0.0, -0.8, 0.0], [0.0, 1.0, 0.0, -0.7]])
    loads = [([1.0, 0.6, -0.5, 0.0], Tone(3.0, 25.0)), ([0.0, 1.0, 0.0, 0.3], Tone(2.0, 41.0))]
    hole = Contact(rows, law, gap, map="annulus", centre=centre, outer=outer)
    return System.modal(omega, 0.02, [hole, *more], loads)


def assert_tangent(system, run, q, tolerance):
    """The derivative of the end by the start, in units of `SCALE`, is that from runs of the independent method."""
    expected = jacobian(end_of(system, DURATION, SHARP), np.append(q, V), 2e-6 * SCALE) * SCALE / SCALE[:, None]
    found = run.tangent * SCALE / SCALE[:, None]
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=tolerance * np.abs(expected).max())


@pytest.mark.parametrize("outer", [False, True], ids=["hole", "post"])
@pytest.mark.parametrize(
    "law",
    [KelvinVoigt(1e5, 20.0), KelvinVoigt(1e5, 400.0), Hysteretic.lankarani_nikravesh(1e7, restitution=0.6)],
    ids=["dashpot", "strong dashpot", "lankarani"],
)
def test_derivative_by_the_start_is_that_of_differences(law, outer):
    system = tube(law, outer=outer, gap=6e-4 if outer else 1e-3)
    q = np.array([-1e-4, 9e-4, 0.0, 0.0]) if outer else np.zeros(4)
    run = integrate(system, q, V, DURATION, method=Exponential(1e-11), tangent=True)
    assert len(run.contacts.t_in) > 0
    assert_tangent(system, run, q, 5e-7)


@pytest.mark.parametrize("change", ["gap", "centre", "law"])
def test_derivative_by_a_parameter_is_that_of_differences(change):
    def moved(step):
        if change == "law":
            return tube(KelvinVoigt(1e5 + 1e8 * step, 20.0))
        shift = {"gap": 1e-3 + step} if change == "gap" else {"centre": (1e-4 + step, -2e-4 + 0.5 * step)}
        return tube(LAW, **shift)

    LAW = KelvinVoigt(1e5, 20.0)
    parameter = Parameter(moved(-1e-8), moved(1e-8), 1e-8)
    run = integrate(tube(LAW), np.zeros(4), V, DURATION, method=Exponential(1e-11), tangent=parameter)
    expected = five_points(lambda h: end_of(moved(h), DURATION, SHARP)(np.append(np.zeros(4), V)), 2e-9) / SCALE
    np.testing.assert_allclose(run.tangent[:, -1] / SCALE, expected, rtol=0.0, atol=1e-6 * np.abs(expected).max())


def test_derivative_with_scalar_stops_beside_it():
    """Three rows: the motion of the blocks is computed first."""
    stop = Contact([0.5, 0.5, 0.5, 0.0], Hertz(1e7), 2e-4)
    system = tube(KelvinVoigt(1e5, 20.0), stop)
    run = integrate(system, np.zeros(4), V, DURATION, method=Exponential(1e-11), tangent=True)
    assert set(run.contacts.stop) == {0, 1}
    assert_tangent(system, run, np.zeros(4), 1e-6)


def test_tangent_of_a_mirrored_start_is_mirrored():
    """The free mass in its hole: the derivative of the end by the start turns with everything."""
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    hole = Contact(np.eye(2), Hertz(1e4), 1.0, map="annulus")
    system = System(np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)), [hole])
    q, v = np.array([0.5, 0.0]), np.array([0.2, 0.8])
    one, other = (integrate(system, r @ q, r @ v, 4.0, tangent=True).tangent for r in (np.eye(2), turn))
    both = np.kron(np.eye(2), turn)
    np.testing.assert_allclose(both @ one @ both.T, other, rtol=0.0, atol=1e-7 * np.abs(one).max())


def test_derivative_of_a_run_keeps_areas():
    """Without damping the flow keeps volume and pairs: the tangent is symplectic, through entries and exits."""
    hole = Contact(np.eye(2), KelvinVoigt(1e4, 0.0), 1.0, map="annulus")
    system = System(np.eye(2), np.zeros((2, 2)), np.diag([1.0, 1.7]), [hole])
    tangent = integrate(system, [0.5, 0.0], [0.9, 0.8], 8.0, method=Exponential(1e-12), tangent=True).tangent
    pairs = np.kron([[0.0, 1.0], [-1.0, 0.0]], np.eye(2))
    np.testing.assert_allclose(tangent.T @ pairs @ tangent, pairs, rtol=0.0, atol=1e-8 * np.abs(tangent).max() ** 2)
