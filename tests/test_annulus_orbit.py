"""Periodic motions in circular clearances: synchronous rub in closed form, bouncing orbits against another method."""

import numpy as np
import pytest
from oscillators import Tone
from scipy.optimize import brentq

import fembeam as fb
from contacts import KelvinVoigt
from solvers import Contact, DormandPrince, OrbitError, System, branch, integrate, orbit

MASS, DAMPING, STIFFNESS, WALL, CLEARANCE, ECCENTRICITY = 2.0, 60.0, 8e4, 3e5, 2e-4, 1e-4
PLANE = np.eye(2)
QUARTER = np.array([[0.0, -1.0], [1.0, 0.0]])


class Quadrature(Tone):
    """A sin ωt."""

    def __call__(self, t):
        return self.amplitude * np.sin(self.omega * t)

    def tones(self):
        return np.array([self.omega]), np.array([-1j * self.amplitude])


def rotor(omega, across=1.0, centre=(0.0, 0.0), share=1.0):
    """A disk on a flexible shaft, unbalanced, in a smooth hole; the force across is a multiple of that of a rotor."""
    push = share * MASS * ECCENTRICITY * omega**2
    loads = [(PLANE[0], Tone(push, omega)), (PLANE[1], Quadrature(across * push, omega))]
    hole = Contact(PLANE, KelvinVoigt(WALL, 0.0), CLEARANCE, map="annulus", centre=centre)
    return System(MASS * PLANE, DAMPING * PLANE, STIFFNESS * PLANE, [hole], loads)


def whirl(omega):
    """Radius of the whirl in full contact, and its eigenvalues in the frame that turns with the shaft.

    |k - mΩ² + k_c (1 - g/r) + i c Ω| r = m e Ω²;  the wall is k_c along the radius, k_c (1 - g/r) across it.
    """

    def apart(r):
        stiffness = STIFFNESS - MASS * omega**2 + WALL * (1.0 - CLEARANCE / r)
        return abs(stiffness + 1j * DAMPING * omega) * r - MASS * ECCENTRICITY * omega**2

    r = brentq(apart, CLEARANCE, 10.0 * CLEARANCE, xtol=1e-18)
    damping = DAMPING * PLANE + 2.0 * MASS * omega * QUARTER
    stiffness = (STIFFNESS - MASS * omega**2) * PLANE + DAMPING * omega * QUARTER
    stiffness += np.diag([WALL, WALL * (1.0 - CLEARANCE / r)])
    matrix = np.block([[np.zeros((2, 2)), PLANE], [-stiffness / MASS, -damping / MASS]])
    return r, np.linalg.eigvals(matrix)


@pytest.mark.parametrize("omega", [180.0, 220.0])
def test_synchronous_rub_is_an_equilibrium_of_the_turning_frame(omega):
    """A contact that never opens: radius, and multipliers exp(λT)."""
    r, values = whirl(omega)
    found = orbit(rotor(omega), 2.0 * np.pi / omega)
    assert np.linalg.norm(found.state[:2]) == pytest.approx(r, rel=1e-9)
    assert np.linalg.norm(found.state[2:]) == pytest.approx(omega * r, rel=1e-9)
    expected = np.exp(2.0 * np.pi / omega * values)
    for value in expected:
        assert np.abs(found.multipliers - value).min() < 1e-7
    assert found.stable == bool(np.abs(expected).max() < 1.0)


def test_a_bouncing_orbit_closes_for_another_method():
    """An elliptic force and a hole off the centre, so that the contact opens."""
    system, period = rotor(170.0, across=0.3, centre=(1e-4, 0.0)), 2.0 * np.pi / 170.0
    found = orbit(system, period)
    run = integrate(system, *np.split(found.state, 2), period, method=DormandPrince(1e-13, 1e-20))
    assert len(run.contacts.t_in) > 0
    np.testing.assert_allclose(run.end, found.state, rtol=0.0, atol=1e-8 * np.abs(found.state).max())


def test_grazing_of_the_circle_against_the_linear_amplitude():
    """The place moves on an ellipse of half-axes a X and 0.3 a X about a point beside the centre: a X = c - offset."""
    omega, offset = 170.0, 5e-5
    period, push = 2.0 * np.pi / omega, MASS * ECCENTRICITY * omega**2
    response = push / (STIFFNESS - MASS * omega**2 + 1j * DAMPING * omega)
    exact = (CLEARANCE - offset) / abs(response)
    x, y = 0.8 * exact * response * np.array([1.0, -0.3j])
    start = np.array([x, y, 1j * omega * x, 1j * omega * y]).real

    def make(share):
        return rotor(omega, 0.3, (offset, 0.0), share), period

    found = branch(make, (0.7 * exact, 1.2 * exact), start, at=0.8 * exact, step=0.25).run()
    grazings = [one.parameter for one in found.special if one.mark == "grazing"]
    assert grazings == pytest.approx([exact], rel=1e-9)
    assert sorted(len(one.contacts) for one in (found.orbits[0], found.orbits[-1])) == [0, 1]


@pytest.mark.parametrize("outer", [False, True])
def test_derivatives_of_an_indentation_are_those_of_differences(outer):
    rows, law = [[1.0, 0.2], [-0.3, 0.8]], KelvinVoigt(1e3, 0.0)
    contact = Contact(rows, law, 0.5, map="annulus", centre=(0.1, 0.2), outer=outer)
    q, v, step = np.array([0.7, -0.4]), np.array([0.3, 1.1]), 1e-6
    delta, rate, by_q, rate_by_q = contact.motion(q, v)
    assert delta == contact.indentation(q)
    ahead, behind = (contact.indentation(q + h * v) for h in (step, -step))
    assert rate == pytest.approx((ahead - behind) / (2.0 * step), rel=1e-8)
    for i, unit in enumerate(np.eye(2)):
        ahead, behind = (contact.motion(q + h * unit, v)[:2] for h in (step, -step))
        assert by_q[i] == pytest.approx((ahead[0] - behind[0]) / (2.0 * step), rel=1e-8)
        assert rate_by_q[i] == pytest.approx((ahead[1] - behind[1]) / (2.0 * step), rel=1e-7)
        faster, slower = (contact.motion(q, v + h * unit)[1] for h in (step, -step))
        assert by_q[i] == pytest.approx((faster - slower) / (2.0 * step), rel=1e-8)


def test_random_starts_whose_runs_are_refused_are_left_out():
    """One of them drew the spring of friction by half a turn, and the search ended, though rest settles to an orbit."""
    matrices, labels = [one * PLANE for one in (STIFFNESS, MASS, DAMPING)], [("D", "x"), ("D", "y")]
    body = fb.Structure(*matrices, labels=labels, nodes={"D": (0, 0, 0)})
    hole = fb.AnnularStop("D", KelvinVoigt(3e5, 50.0), 2e-4, directions=("x", "y"), friction=fb.Friction(0.3, 3e4))
    drive = [fb.PointForce("D", fb.Harmonic(60.0, 150.0), direction="x"),
             fb.PointForce("D", fb.Harmonic(24.0, 150.0, 1.0), direction="y")]  # fmt: skip
    model = fb.Scene(body, stops=[hole], forces=drive).reduce(modes=2)
    with pytest.warns(UserWarning, match="1 of 3 starts are left out, whose runs are refused: .* half a turn") as told:
        (found,) = model.attractors(starts=3)
    assert (found.name, found.count) == ("period 1 with 2 impacts", 2)
    assert told[0].filename == __file__
    with pytest.raises(OrbitError, match=r"^\d+ starts settled to period 1 with 2 impacts, none to period 3"):
        model.orbit(period=3)  # that warned, of a line inside the package
