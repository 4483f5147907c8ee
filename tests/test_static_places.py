"""Default meshes of structures that float, static shapes of places close together, of dashpots and of moments."""

import numpy as np
import pytest
from scipy import linalg

import fembeam as fb
import reduction
from contacts import Hertz
from fembeam.beams import Beam, ModalDamping, Rayleigh, Section
from fembeam.excitation import Harmonic
from fembeam.scene import (
    AnnularStop,
    Clamped,
    Dashpot,
    Friction,
    Guided,
    Pinned,
    PointForce,
    PointMoment,
    Scene,
    Spring,
    Stop,
)
from fembeam.structures import Frame

UNIT = Section(E=1.0, rho=1.0, A=1.0, I=1.0)
FLAT = Section.rectangle(2.1e11, 7850.0, 0.02, 0.005)


# --- floating structures ----------------------------------------------------------------------------------


@pytest.mark.parametrize("modes", [8, 11, 13])
@pytest.mark.parametrize("ends", ["free", "guided", "guided on both sides"])
@pytest.mark.filterwarnings("ignore:.*rigid-body")
def test_default_meshes_serve_floating_beams(ends, modes):
    supports = {"free": [], "guided": [Guided(0.0)], "guided on both sides": [Guided(0.0), Guided(0.5)]}[ends]
    omega = Scene(Beam(0.5, FLAT), supports).reduce(modes).omega
    # βL: of cos βL cosh βL = 1, nearly (n + 1/2)π; half of every other one with a guide in the middle; nπ
    roots = {
        "free": [0, 0, 4.730040744863, 7.853204624096, 10.995607838002, *(np.pi * (np.arange(4, 12) + 0.5))],
        "guided": [0, 2.365020372431, 5.497803919001, *(np.pi * (np.arange(3, 13) - 0.25))],
        "guided on both sides": np.pi * np.arange(13),
    }[ends]
    expected = np.array(roots[:modes]) ** 2 * np.sqrt(FLAT.E * FLAT.I / (FLAT.rho * FLAT.A)) / 0.5**2
    np.testing.assert_allclose(omega, expected, rtol=2e-6)


# --- places close together --------------------------------------------------------------------------------


def pair(apart, supports, z=0.31):
    stops = [Stop(z, Hertz(1e8), 1e-3), Stop(z + 0.5 * apart, Hertz(1e8), 1e-3, side="above")]
    return Scene(Beam(0.5, FLAT), supports, stops=stops, damping=ModalDamping(0.01))


@pytest.mark.parametrize("way", ["residual", "interface"])
@pytest.mark.parametrize("apart", [0.0, 1e-12, 1e-7, 3e-6, 10**-3.5, 1e-2])
@pytest.mark.parametrize("supports", [[Clamped(0.0)], [Pinned(0.0), Pinned(0.5)], [Guided(0.0)]])
@pytest.mark.filterwarnings("ignore:.*rigid-body")
def test_stops_close_together(supports, apart, way):
    model = pair(apart, supports).reduce(4, **{way: True})
    assert len(model.omega) == (5 if apart < 1e-6 else 6)
    if way == "residual" or not isinstance(supports[0], Guided):  # exact on a structure that floats: residual only
        np.testing.assert_allclose(model.static_share, 1.0, rtol=1e-10)


def test_a_difference_of_directions_counts_as_a_moment():
    # two loads 1e-5 apart: the basis must know u and u_z of the tip, L³/3EI, L/EI, L²/2EI
    full = Scene(Beam(1.0, UNIT), [Clamped(0.0)]).matrices(elements=40)
    M, K, R = full.M, full.K, full.root
    B = full.interpolation([1.0, 1.0 - 1e-5]).T
    for basis in (
        reduction.with_residual(reduction.modal_basis(M, K, 3, root=R), M, K, B, R),
        reduction.craig_bampton(M, K, B, 3, R),
    ):
        both = np.vstack((full.interpolation(1.0).toarray(), full.interpolation(1.0, 1).toarray())).T
        kept = basis.project(both).T @ (basis.project(both) / basis.omega[:, None] ** 2)
        np.testing.assert_allclose(kept, [[1 / 3, 1 / 2], [1 / 2, 1.0]], rtol=1e-8)


# --- dashpots, moments, moving feet -----------------------------------------------------------------------


def decay(model, size=2):
    """The `size` eigenvalues of the damped model smallest in absolute value, of the upper half plane."""
    n, C = len(model.omega), model.system.C
    values = linalg.eigvals(np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(model.omega**2), -C]]))
    turning = values[values.imag > 0]
    return turning[np.argsort(np.abs(turning))][:size]


@pytest.mark.parametrize("dashpot", [Dashpot(0.7, 2.0), Dashpot(0.7, 0.0, rotational=0.3), Dashpot(0.7, 1.0, 0.2)])
def test_static_shapes_of_dashpots(dashpot):
    scene = Scene(Beam(1.0, UNIT), [Clamped(0.0)], dashpots=[dashpot], damping=Rayleigh(0.0, 0.0))
    exact = decay(scene.reduce("all", elements=60))

    def error(modes, residual):
        return np.abs(decay(scene.reduce(modes, elements=60, residual=residual)) / exact - 1).max()

    shapes = bool(dashpot.damping) + bool(dashpot.rotational)
    assert len(scene.reduce(4, residual=True).omega) == 4 + shapes
    assert error(4, False) > 1e-4
    assert error(4, True) < 1e-4 * error(4, False)  # a rotational one needs 1e5 modes for that, at errors like 1/N
    assert error(8, True) < 5e-9


def test_static_shapes_of_moments_and_moving_feet():
    moment, spring = PointMoment(1.0, Harmonic(1.0, 0.1)), Spring(0.5, 3.0, foot=Harmonic(1.0, 0.1))
    scene = Scene(Beam(1.0, UNIT), [Clamped(0.0)], springs=[spring], forces=[moment, PointForce(1.0, moment.signal)])
    model = scene.reduce(2, residual=True)
    full = model.matrices
    assert len(model.omega) == 5
    B = np.vstack((full.interpolation(1.0, 1).toarray(), full.interpolation([0.5, 1.0]).toarray())).T
    np.testing.assert_allclose(reduction.static_share(model.basis, full.M, full.K, B, full.root), 1.0, rtol=1e-10)


@pytest.mark.parametrize("way", ["residual", "interface"])
def test_the_twist_of_a_shaft_under_friction(way):
    """A torque at the radius of an annular stop turns its place by z/GJ; φ is the third row of the contact."""
    section = Section.circle(2.1e11, 7850.0, 0.02)
    hole = AnnularStop(0.8, Hertz(1e9), 2e-4, friction=Friction(0.5, 1e6), radius=0.01)
    model = Scene(Frame.straight(1.0, section), [Clamped("A")], stops=[hole]).reduce(4, **{way: True})
    twist = np.sum((model.directions[2] / model.omega) ** 2)
    np.testing.assert_allclose(twist, 0.8 / section.torsion_stiffness, rtol=1e-9)


@pytest.mark.parametrize("tip", [False, True])
def test_a_force_on_a_support_has_no_static_shape(tip):
    """It was refused with residual=True alone."""
    steel, push = fb.Section.circle(2e11, 7800.0, 0.02), fb.Harmonic(1.0, 5.0)
    forces = [fb.PointForce("A", push, direction="x"), fb.PointForce("B", push, direction="x")]
    held, tipped = (fb.Scene(fb.Frame.straight(1.0, steel), [fb.Clamped("A")], forces=some)
                    for some in (forces[: 1 + tip], forces[1:]))  # fmt: skip
    expected = tipped.reduce(2, residual=True) if tip else held.reduce(2)
    np.testing.assert_allclose(held.reduce(2, residual=True).omega, expected.omega, rtol=1e-9)
