"""Starts: fields and what the kept modes miss of them, static equilibrium with contact."""

import math

import numpy as np
import pytest
from refusals import refused

import fembeam as fb
import reduction
from contacts import Hertz, KelvinVoigt, PiecewiseLinear

STEEL = fb.Section.rectangle(2.1e11, 7850.0, 0.01, 0.01)
L = 0.4
CLAMPED = [fb.Clamped(0.0)]


def tip_flexibility(model):
    """What the kept modes have of L³/3EI."""
    return float(np.sum(model.phi(L) ** 2 / model.omega**2))


def test_rest_holds_the_velocities_of_impactors():
    scene = fb.Scene(fb.Beam(L, STEEL), CLAMPED, impactors=[fb.Impactor(0.2, 4.0, -3.0, Hertz(1e9), 1e-3)])
    model = scene.reduce(2)
    assert model.rest().tolist() == [0, 0, 0, 0, 0, -6.0]
    run = model.simulate(1e-4, 1e-4)
    assert run.impactor_velocity()[0] == pytest.approx(-3.0)


def test_what_the_modes_miss_is_reported():
    scene = fb.Scene(fb.Beam(L, STEEL), CLAMPED)
    model = scene.reduce(3)
    higher = scene.reduce([5])
    assert model.missed(lambda z: model.phi(z)[:, 1]) < 1e-6
    assert model.missed(lambda z: higher.phi(z)[:, 0]) == pytest.approx(1.0, abs=1e-6)
    half = model.missed(lambda z: model.phi(z)[:, 0] + higher.phi(z)[:, 0])
    assert half == pytest.approx(math.sqrt(0.5), rel=1e-4)
    with pytest.warns(UserWarning, match=r"70\.7% of the velocity \(mass norm\) in Model.state is not represented"):
        model.state(velocity=lambda z: model.phi(z)[:, 0] + higher.phi(z)[:, 0])


def test_fields_are_one_for_each_beam():
    other = fb.Scene(fb.Beam(0.2, STEEL), CLAMPED)
    model = fb.Scene(fb.Beam(L, STEEL), CLAMPED, bodies=[other]).reduce(2)
    start = model.state([None, lambda z: 0.5 * model.phi(z, body=1)[:, 2]])
    np.testing.assert_allclose(start[:4], [0, 0, 0.5, 0], atol=1e-6)
    with pytest.raises(ValueError, match="fields must be 2, one for each beam, got 1"):
        model.state([None])


def test_what_a_field_of_a_structure_does_not_name_rests():
    pair = fb.Structure(np.diag([900.0, 400.0]), np.eye(2), labels=[("a", "x"), ("b", "x")])
    model = fb.Scene(pair).reduce("all")
    start = model.state({("b", "x"): 1e-3}, {("a", "x"): 0.2})
    assert [model.phi((one, "x")) @ start[:2] for one in "ab"] == pytest.approx([0.0, 1e-3])
    assert [model.phi((one, "x")) @ start[2:] for one in "ab"] == pytest.approx([0.2, 0.0])


def test_static_tip_load():
    model = fb.Scene(fb.Beam(L, STEEL), CLAMPED).reduce(5)
    start = model.equilibrium({L: -10.0})
    assert model.phi(L) @ start[:5] == pytest.approx(-10.0 * tip_flexibility(model), rel=1e-12)
    assert np.all(start[5:] == 0)


@pytest.mark.parametrize("law", [Hertz(1e7), PiecewiseLinear([1e3, 1e5], knots=[1e-3])])
def test_beam_pressed_on_its_stop_stays_there(law):
    scene = fb.Scene(fb.Beam(L, STEEL), CLAMPED, stops=[fb.Stop(L, law, gap=2e-3)], gravity=9.81)
    model = scene.reduce(4)
    start = model.equilibrium({0.3: -200.0})
    delta = -model.phi(L) @ start[:4] - 2e-3
    balance = -model.participation * 9.81 - 200.0 * model.phi(0.3) + model.phi(L) * float(law.force(delta, 0.0, 1.0))
    assert delta > 0
    np.testing.assert_allclose(model.omega**2 * start[:4], balance, rtol=1e-8)
    held = fb.Scene(fb.Beam(L, STEEL), CLAMPED, stops=scene.stops, gravity=9.81,
                    forces=[fb.PointForce(0.3, fb.Harmonic(-200.0, 0.0))]).reduce(4)  # fmt: skip
    run = held.simulate(0.05, 1e-3, start=start)
    np.testing.assert_allclose(run.displacement(L), run.displacement(L)[0], rtol=1e-7)


def test_preload_alone_moves_the_beam():
    k = 2e3
    scene = fb.Scene(fb.Beam(L, STEEL), CLAMPED, stops=[fb.Stop(L, PiecewiseLinear([k]), gap=-1e-3)])
    model = scene.reduce(3)
    f = tip_flexibility(model)
    assert model.phi(L) @ model.equilibrium()[:3] == pytest.approx(1e-3 * k * f / (1 + k * f), rel=1e-10)


@pytest.mark.parametrize("E", [2.1e11, 1e-3])
def test_a_lowered_support_presses_the_beam_on_its_stop(E):
    """Half of it at the middle, where the stop carries k u: u (1 + f k) = h/2; of a beam of 4e-5 rad/s as well."""
    section, h = fb.Section.rectangle(E, 7850.0, 0.01, 0.01), -1e-3
    k = 50.0 * section.bending_stiffness / L**3
    supports = [fb.Pinned(0.0), fb.Pinned(L, motion={"y": fb.Harmonic(h, 0.0)})]
    held = fb.Scene(fb.Beam(L, section), supports).reduce(4)
    assert held.phi(L / 2) @ held.equilibrium()[:5] == pytest.approx(0.5 * h, rel=1e-9)
    stop = fb.Stop(L / 2, KelvinVoigt(k, 0.0), gap=0.0)
    model = fb.Scene(fb.Beam(L, section), supports, stops=[stop]).reduce(4)
    f = float(np.sum(model.phi(L / 2) ** 2 / model.omega**2))
    assert model.phi(L / 2) @ model.equilibrium()[:5] == pytest.approx(0.5 * h / (1.0 + f * k), rel=1e-9)


def test_resting_mass_finds_the_beam_it_lies_on():
    K, m = 1e8, 2.0
    scene = fb.Scene(fb.Beam(L, STEEL), CLAMPED, gravity=9.81,
                     impactors=[fb.Impactor(L, m, 0.0, Hertz(K), gap=5e-3)])  # fmt: skip
    model = scene.reduce(4)
    start = model.equilibrium()
    run = model.simulate(0.1, 1e-2, start=start)
    assert run.indentation()[0] == pytest.approx((m * 9.81 / K) ** (2 / 3), rel=1e-9)
    np.testing.assert_allclose(run.impactor_displacement(), run.impactor_displacement()[0], rtol=1e-7)


def test_a_flying_mass_waits_while_the_beam_settles():
    scene = fb.Scene(fb.Beam(L, STEEL), CLAMPED, gravity=9.81,
                     impactors=[fb.Impactor(L, 2.0, -1.0, Hertz(1e8), gap=5e-3)])  # fmt: skip
    model = scene.reduce(4)
    start = model.equilibrium()
    assert start[4] == 0.0
    assert start[-1] == pytest.approx(-math.sqrt(2.0))
    assert model.phi(L)[:4] @ start[:4] < 0


@pytest.mark.filterwarnings("ignore:.*rigid-body:UserWarning")
def test_a_falling_beam_has_no_equilibrium():
    with pytest.raises(reduction.AccuracyError, match=r"no static equilibrium found.*does anything carry the loads"):
        fb.Scene(fb.Beam(L, STEEL), gravity=9.81).reduce(3).equilibrium()


@pytest.mark.filterwarnings("ignore:.*rigid-body:UserWarning")
@pytest.mark.parametrize("stiffness", [1e3, 1e9, 1e13])
@pytest.mark.parametrize("places", [(L,), (L, 0.3), (0.2002,)])
@pytest.mark.parametrize("size", [1e-4, 1.0])
def test_a_beam_on_stops_beside_its_middle_has_no_equilibrium(places, stiffness, size):
    """It turns off them: no forces balance the moment about them, however far it has gone, in whatever size."""
    section = fb.Section.rectangle(2.1e11, 7850.0, 0.01 * size, 0.01 * size)
    stops = [fb.Stop(z * size, KelvinVoigt(stiffness * size, 1.0), gap=1e-4 * size) for z in places]
    with pytest.raises(reduction.AccuracyError, match=r"no static equilibrium found"):
        fb.Scene(fb.Beam(L * size, section), stops=stops, gravity=9.81).reduce(6).equilibrium()


@pytest.mark.parametrize("gravity", [1e-3, 100.0])
@pytest.mark.parametrize("law", [KelvinVoigt(1e5, 1.0), Hertz(1e12)])
def test_a_free_beam_rests_on_two_stops_as_the_lever_has_it(law, gravity):
    weight = STEEL.line_mass * L * gravity
    scene = fb.Scene(fb.Beam(L, STEEL), stops=[fb.Stop(z, law, gap=0.03) for z in (0.1, 0.35)], gravity=gravity)
    model = scene.reduce(6)
    run = model.simulate(1e-9, 1e-9, start=model.equilibrium())
    assert [run.force(i)[0] for i in (0, 1)] == pytest.approx([0.6 * weight, 0.4 * weight], rel=1e-4)


@pytest.mark.parametrize("gap", [1e-4, 0.1, 10.0])
@pytest.mark.parametrize("stiffness", [1e7, 1e11])
def test_a_body_comes_to_rest_on_the_beam_however_far_it_falls(gap, stiffness):
    """Its indentation is the difference of numbers as large as the gap: forces are in balance to that rounding."""
    mass, law = 0.01, Hertz(stiffness)
    fallen = fb.Impactor(0.2, mass, 0.0, law, gap)
    model = fb.Scene(fb.Beam(L, STEEL), CLAMPED, impactors=[fallen], gravity=9.81).reduce(2)
    q = model.equilibrium()[:3]
    delta = float(-model.directions[0] @ q) - gap
    expected = (mass * 9.81 / stiffness) ** (2.0 / 3.0)
    assert delta == pytest.approx(expected, rel=1e-9, abs=50.0 * np.spacing(gap))


HELD = fb.Scene(fb.Beam(L, STEEL), CLAMPED)

test_what_is_no_field_of_the_beam_is_refused = refused(
    (
        lambda: HELD.reduce(2).state(1e-3),
        "a field must be a function of z, .* got 0.001 in Model.state; write lambda z",
    ),
    (lambda: HELD.reduce(2).state(velocity=np.ones(3)), "a field must be a function of z, .* got array"),
    (lambda: HELD.reduce(2).state(lambda z: math.sin(z)), "a field must take an array of coordinates z, got TypeError"),
    (lambda: HELD.reduce(2).missed(lambda z: np.ones(3)), r"must give one value for each of \d+ z, got \(3,\)"),
)


@pytest.mark.parametrize("stiffness", [1e2, 1e6])
def test_what_is_not_loaded_rests_at_a_free_spring(stiffness):
    """A bar on a hinge lies where a spring is free; of 60 gaps, five were refused, for forces of 1e-15 N."""
    bar = fb.Section.rectangle(2.1e11, 7850.0, 0.02, 0.01)
    for gap in np.linspace(1e-3, 0.4, 60):
        spring = fb.Element(0.8, KelvinVoigt(stiffness, 0.0), gap=float(gap))
        model = fb.Scene(fb.Beam(0.8, bar), [fb.Pinned(0.0)], elements=[spring]).reduce(2)
        assert model.directions[0] @ model.equilibrium()[:2] == pytest.approx(-gap, rel=1e-12)
