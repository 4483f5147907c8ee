"""Backbone of the lowest mode against closed forms and simulated free vibration."""

import dataclasses

import numpy as np
import pytest
from problems import ROD

import fembeam as fb
from contacts import Hertz, Jenkins, KelvinVoigt, PiecewiseLinear, Polynomial
from fembeam.response import backbone

AMPLITUDES = np.array([1e-4, 1e-3, 2e-3, 8e-3])


def model(*stops, **changes):
    scene = fb.Scene(ROD, [fb.Clamped(0.0)], stops=list(stops), **changes)
    return scene.reduce(modes=1)


def test_without_stops_it_is_the_natural_frequency():
    one = model()
    assert backbone(one, 0.5, AMPLITUDES) == pytest.approx(np.full(4, one.omega[0]), rel=1e-10)


def test_a_stop_that_just_touches_is_a_bilinear_oscillator():
    one = model(fb.Stop(0.5, KelvinVoigt(4e4, 0.0)))
    stiff = np.sqrt(one.omega[0] ** 2 + 4e4 * one.phi(0.5)[0] ** 2)
    exact = 2 * one.omega[0] * stiff / (one.omega[0] + stiff)
    assert backbone(one, 0.5, AMPLITUDES) == pytest.approx(np.full(4, exact), rel=1e-8)


def test_two_linear_stops_with_a_gap():
    gap, k = 1e-3, 4e4
    one = model(*(fb.Stop(0.5, KelvinVoigt(k, 0.0), gap, side) for side in ("below", "above")))
    free = one.omega[0]
    stiff = np.sqrt(free**2 + k * one.phi(0.5)[0] ** 2)
    for amplitude in (0.5e-3, 2e-3, 8e-3):
        if amplitude < gap:
            exact = free
        else:  # a quarter: through the gap, then about the displaced rest of the stiff branch
            rest = gap * (1 - free**2 / stiff**2)
            turn = np.arccos((gap - rest) / (amplitude - rest)) / stiff
            speed = stiff * np.sqrt((amplitude - rest) ** 2 - (gap - rest) ** 2)
            through = np.arctan(free * gap / speed) / free
            exact = np.pi / 2 / (turn + through)
        assert backbone(one, 0.5, np.array([amplitude]))[0] == pytest.approx(exact, rel=1e-8)


def test_a_knot_is_a_stop_with_a_gap():
    """A law whose slope rises at a knot is two springs, one of them behind a gap."""
    soft, rise, knot = 4e4, 4e6, 2e-4
    one = model(fb.Stop(0.5, PiecewiseLinear([soft, soft + rise], knots=[knot])))
    share = float(one.phi(0.25)[0] / one.phi(0.5)[0])  # of the tip's motion at a place where a stop may stand, too
    behind = fb.Stop(0.25, KelvinVoigt(rise / share**2, 0.0), gap=share * knot)
    two = model(fb.Stop(0.5, KelvinVoigt(soft, 0.0)), behind)
    assert backbone(one, 0.5, AMPLITUDES) == pytest.approx(backbone(two, 0.5, AMPLITUDES), rel=1e-6)


def test_an_element_acts_on_both_sides():
    """Two stops without a gap are the same; a stiffening offset loads the beam at rest, friction has no backbone."""
    cubic = Polynomial([1e3, 0.0, 1e11])
    pair = model(*(fb.Stop(0.5, cubic, side=side) for side in ("below", "above")))
    one = model(elements=[fb.Element(0.5, cubic)])
    assert backbone(one, 0.5, AMPLITUDES) == pytest.approx(backbone(pair, 0.5, AMPLITUDES), rel=1e-8)
    for element in (fb.Element(0.5, cubic, gap=1e-3), fb.Element(0.5, Jenkins(1e4, 1.0))):
        assert np.isnan(backbone(model(elements=[element]), 0.5, AMPLITUDES)).all()


def test_free_vibration_against_a_stiff_stop_has_its_period():
    one = model(fb.Stop(0.5, Hertz(1e9), gap=5e-4), damping=fb.ModalDamping(0.0))
    start = np.array([2e-3 / one.phi(0.5)[0], 0.0])
    run = one.simulate(0.4, 1e-5, start=start)
    t = run.contacts.t_in
    period = (t[-1] - t[0]) / (len(t) - 1)
    assert backbone(one, 0.5, np.array([2e-3]))[0] == pytest.approx(2 * np.pi / period, rel=1e-5)


def test_what_has_no_backbone_of_this_kind_is_nan():
    stop = fb.Stop(0.5, Hertz(1e9))
    other = fb.Scene(fb.Beam(0.3, ROD.section), [fb.Clamped(0.0)])
    cases = [
        model(stop, gravity=9.81),
        model(dataclasses.replace(stop, gap=-1e-4)),
        model(fb.Stop(0.3, Hertz(1e8), 2e-3, on=(1, 0.3)), bodies=[other]),
    ]
    for one in cases:
        assert np.isnan(backbone(one, 0.5, AMPLITUDES)).all()
    assert np.isnan(backbone(model(stop), 0.0, AMPLITUDES)).all()
