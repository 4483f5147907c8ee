"""Tapers, foundations, elastic supports and axial preload against exact frequency equations and buckling loads."""

import math

import numpy as np
import pytest
from refusals import refused, refused_by
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import fembeam as fb
from contacts import KelvinVoigt

UNIT = fb.Section(E=1.0, rho=1.0, A=1.0, I=1.0)
CLAMPED = [fb.Clamped(0.0)]


def omegas(scene, count, **mesh):
    return scene.reduce(count, **mesh).omega


def exact_near(omega, beam, root=None, tip_stiffness=0.0, tip_mass=0.0):
    """The exact frequency near omega: the beam's ordinary differential equation, shot from z = 0 to its free end.

    root None is a clamp, else (stiffness, rotational) of an elastic support. The determinant is taken at two
    frequencies 2e-5 apart, between which it changes its sign and is straight to 1e-10.
    """
    starts = [(0, 0, 1, 0), (0, 0, 0, 1)] if root is None else [(1, 0, 0, -root[0]), (0, 1, root[1], beam.axial_force)]
    w = omega * (1.0 + np.array([-1e-5, 1e-5]))

    def slopes(z, y):
        u, theta, M, V = y.reshape(4, 2, 2)  # a column for each frequency, a row for each start
        curvature = M / beam.bending_stiffness(z)
        load = (beam.line_mass(z) * w**2 - beam.foundation) * u
        return np.concatenate([theta, curvature, V, load + beam.axial_force * curvature], axis=None)

    y = np.repeat(np.array(starts, float).T[:, :, None], 2, axis=2).ravel()
    for left, right in zip(beam.borders[:-1], beam.borders[1:], strict=True):
        y = solve_ivp(slopes, (left, right - 1e-14), y, "DOP853", rtol=1e-10, atol=1e-13).y[:, -1]
    u, theta, M, V = y.reshape(4, 2, 2)
    Q = V - beam.axial_force * theta - (tip_stiffness - tip_mass * w**2) * u
    low, high = M[0] * Q[1] - M[1] * Q[0]
    assert low * high < 0.0
    return (w[0] * high - w[1] * low) / (high - low)


def wedge(ratio, width_ratio=1.0):
    start = fb.Section.rectangle(1.0, 12.0, 1.0, 1.0)
    return fb.Taper(start, fb.Section.rectangle(1.0, 12.0, width_ratio, ratio))


SPANS = [(0.5, wedge(0.5)), (0.25, fb.Section.rectangle(1.0, 12.0, 1.0, 0.5)), (0.5, wedge(0.7))]
EXACT = {  # a beam, other parts than a clamp, and what of them is told to `exact_near`
    "wedge": (fb.Beam(1.0, wedge(0.2)), {}, {}),
    "pyramid": (fb.Beam(1.0, wedge(0.1, 0.1)), {}, {}),
    "spans, tip mass": (fb.Beam.of_spans(SPANS), {"masses": [fb.LumpedMass(1.25, 3.0)]}, {"tip_mass": 3.0}),
    "steep wedge, heavy tip": (fb.Beam(1.0, wedge(8.0)), {"masses": [fb.LumpedMass(1.0, 1e3)]}, {"tip_mass": 1e3}),
    "short cone": (fb.Beam.of_spans([(0.02, wedge(3.0, 3.0)), (1.0, wedge(0.999))]), {}, {}),
    "elastic tip": (fb.Beam(1.0, UNIT), {"springs": [fb.Spring(1.0, 1e3)]}, {"tip_stiffness": 1e3}),
    "elastic clamp": (fb.Beam(1.0, UNIT), {"supports": [], "springs": [fb.Spring(0.0, 20.0, 5.0)]},
                      {"root": (20.0, 5.0)}),
    "dead load": (fb.Beam(1.0, UNIT, axial_force=-2.0), {}, {}),
    "tension": (fb.Beam(1.0, UNIT, axial_force=100.0), {}, {}),
}  # fmt: skip


@pytest.mark.parametrize("name", EXACT)
def test_frequencies_are_those_of_the_differential_equation(name):
    beam, parts, told = EXACT[name]
    for omega in omegas(fb.Scene(beam, **{"supports": CLAMPED, **parts}), 3):
        assert exact_near(omega, beam, **told) == pytest.approx(omega, rel=1e-6)


# --- tapers -------------------------------------------------------------------------------------------------------


def test_taper_of_circles_is_a_cone():
    cone = fb.Taper(fb.Section.circle(1.0, 1.0, 2.0), fb.Section.circle(1.0, 1.0, 1.0))
    middle, circle = cone.profile(0.3), fb.Section.circle(1.0, 1.0, 1.7)
    found = [float(one) for one in (middle.A, middle.I, middle.fibre)]
    assert found == pytest.approx([circle.A, circle.I, 0.85], rel=1e-14)


test_taper_refuses_two_materials = refused(
    (lambda: fb.Taper(UNIT, fb.Section(2.0, 1.0, 1.0, 1.0)), "start and end must have the same E and rho"),
    (lambda: fb.Taper(UNIT, 3.0), "end must be a Section", TypeError),
)


# --- elastic supports and foundations -----------------------------------------------------------------------------


@pytest.mark.parametrize("k", [0.5, 1e3, 1e6])
def test_foundation_adds_to_every_squared_frequency(k):
    bare = np.square([1.875104068711961, 4.694091132974175, 7.854757438237613])
    found = omegas(fb.Scene(fb.Beam(1.0, UNIT, foundation=k), CLAMPED), 3)
    np.testing.assert_allclose(found, np.sqrt(bare**2 + k), rtol=1e-6)


def test_free_beam_on_a_foundation_heaves_and_pitches():
    found = omegas(fb.Scene(fb.Beam(1.0, UNIT, foundation=9.0)), 3)  # no rigid-body modes to warn of
    np.testing.assert_allclose(found, [3.0, 3.0, math.sqrt(4.730040744863**4 + 9.0)], rtol=1e-6)


def test_moving_foot_of_a_spring_is_a_force():
    signal = fb.Harmonic(1e-3, 5.0)
    shaken = fb.Scene(fb.Beam(1.0, UNIT), CLAMPED, springs=[fb.Spring(0.7, 40.0, foot=signal)]).reduce(3)
    pushed = fb.Scene(fb.Beam(1.0, UNIT), CLAMPED, springs=[fb.Spring(0.7, 40.0)],
                      forces=[fb.PointForce(0.7, fb.Harmonic(0.04, 5.0))]).reduce(3)  # fmt: skip
    a, b = (model.simulate(2.0, 0.1).q for model in (shaken, pushed))
    np.testing.assert_allclose(a, b, atol=1e-12 * np.abs(b).max())


# --- axial force --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("supports", "factor"),
    [
        (CLAMPED, math.pi**2 / 4),
        ([fb.Pinned(0.0), fb.Pinned(1.0)], math.pi**2),
        ([fb.Clamped(0.0), fb.Clamped(1.0)], 4 * math.pi**2),
        ([fb.Clamped(0.0), fb.Pinned(1.0)], brentq(lambda x: math.tan(x) - x, 4.4, 4.6, xtol=1e-14) ** 2),
    ],
)
def test_buckling_loads(supports, factor):
    scene = fb.Scene(fb.Beam(1.0, UNIT), supports)
    assert scene.buckling_load() == pytest.approx(factor, rel=1e-6)
    assert scene.buckling_load(elements=150) == pytest.approx(factor, rel=1e-6)


def test_buckling_counts_from_the_force_there_is():
    scene = fb.Scene(fb.Beam(1.0, UNIT, axial_force=-1.0), CLAMPED)
    assert scene.buckling_load() == pytest.approx(math.pi**2 / 4 - 1.0, rel=1e-6)


@pytest.mark.filterwarnings("ignore:.*rigid-body:UserWarning")
@pytest.mark.parametrize("elements", [None, 20, 300])
@pytest.mark.parametrize(("supports", "count"), [([], 2), ([fb.Pinned(0.0)], 1), ([fb.Guided(0.0)], 1)])
def test_a_floating_beam_has_no_buckling_load(supports, count, elements):
    with pytest.raises(ValueError, match=rf"must hold the beam, got '{count} rigid-body modes' in buckling_load"):
        fb.Scene(fb.Beam(1.0, UNIT), supports).buckling_load(elements)
    with pytest.raises(ValueError, match=r"must hold the beam"):
        fb.Scene(fb.Beam(1.0, UNIT, axial_force=-1e-3), supports).matrices(elements)


@pytest.mark.parametrize("share", [-0.99, -0.5, 0.5, 50.0, 1e4])
def test_pinned_beam_under_axial_force(share):
    force = share * math.pi**2
    scene = fb.Scene(fb.Beam(1.0, UNIT, axial_force=force), [fb.Pinned(0.0), fb.Pinned(1.0)])
    n = np.arange(1, 4) * math.pi
    np.testing.assert_allclose(omegas(scene, 3), np.sqrt(n**4 + force * n**2), rtol=1e-6)


@pytest.mark.parametrize("apart", [1.5e-4, 1e-3, 5e-3])
@pytest.mark.parametrize("frame", [False, True])
def test_stops_close_together_under_compression(apart, frame):
    """Rounding of short elements made the first frequency 0, or the static shapes were refused."""
    law, beam = KelvinVoigt(1e3, 0.1), fb.Beam(1.0, UNIT, axial_force=-1.0)
    places = (0.77, 0.77 + apart)
    if frame:
        stiff = fb.Section(E=1.0, rho=1e-4, A=1e4, I=1.0)  # along itself
        column = fb.Frame({"A": (0, 0), "B": (1, 0)}, [fb.Member("A", "B", stiff, axial_force=-1.0)])
        stops = [fb.Stop(("A-B", s), law, 1.0, direction="-y") for s in places]
        scene = fb.Scene(column, [fb.Clamped("A")], stops=stops)
    else:
        scene = fb.Scene(beam, CLAMPED, stops=[fb.Stop(z, law, 1.0) for z in places])
    model = scene.reduce(2, residual=True)
    for omega in scene.reduce(1).omega:
        assert exact_near(omega, beam) == pytest.approx(omega, rel=1e-6)
    first = model.directions[0]
    a, b = places[0], places[0] - 1.0  # u = A (1 - cos z) - (z - sin z) to the load at a, then C + D sin(z - 1)
    A, _ = np.linalg.solve([[math.cos(a), math.sin(b)], [math.sin(a), -math.cos(b)]], [math.sin(a), 1 - math.cos(a)])
    assert first**2 @ (1 / model.omega**2) == pytest.approx(A * (1 - math.cos(a)) - a + math.sin(a), rel=1e-6)


test_bad_options = refused_by(
    lambda options: fb.Scene(fb.Beam(1.0, UNIT, **options), CLAMPED).reduce(2),
    ({"axial_force": -2.5}, r"axial_force must stay above -2.4674 N, where the beam buckles, got -2.5 in Beam"),
    ({"axial_force": math.inf}, "axial_force must be finite"),
    ({"foundation": -1.0}, "foundation must be finite"),
    ({"foundation": math.nan}, "foundation must be finite"),
)


# --- elements as asked --------------------------------------------------------------------------------------------


def test_elements_far_too_coarse_are_noticed():
    scene = fb.Scene(fb.Beam(1.0, UNIT), CLAMPED)
    with pytest.warns(UserWarning, match="elements are too coarse for the highest mode: its frequency is off by"):
        scene.reduce(6, elements=4)
