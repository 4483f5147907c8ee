"""Stationary response of structures that their elements alone damp: exact power and variance, decay times, refusals."""

import math
from dataclasses import replace

import numpy as np
import pytest
from problems import ROD
from refusals import refused_by

import fembeam as fb
from contacts import Jenkins, KelvinVoigt, Polynomial
from fembeam.statistics import Estimate
from fembeam.study import stationary
from fembeam.study.decay import correlation_time

BAND, LENGTH, SIZE = 60.0, 0.5, 1e-3  # over ω; m; of the motion, m


def undamped(make, modes=1, size=SIZE):
    """One mode of a cantilever without damping, an element and a white force at its tip; φ and ω; what is given, W.

    ``make(k)`` is the law beside a modal stiffness of k N/m at the tip.
    """
    bare = fb.Scene(ROD, [fb.Clamped(0.0)])
    mode = bare.reduce(modes=1)
    phi, omega = float(mode.phi(LENGTH)[0]), float(mode.omega[0])
    level = 0.05 * size**2 * omega**3 / phi**4
    noise = fb.BandNoise(math.sqrt(level * BAND * omega), (0.0, BAND * omega), seed=3)
    scene = replace(
        bare, forces=[fb.PointForce(LENGTH, noise)], elements=[fb.Element(LENGTH, make((omega / phi) ** 2))]
    )
    return scene.reduce(modes=modes), phi, omega, level


def rate(run):
    """Rate of the mode."""
    return run.q_dot[:, 0]


@pytest.mark.drawn
def test_a_dashpot_among_the_elements_gives_the_variance():
    """c φ² E[q'²] is the power of a white force, G φ² π/2, less c φ²/ω_c of it."""
    model, phi, omega, level = undamped(lambda k: KelvinVoigt(0.2 * k, 0.1 * k / 100.0))
    c = model.scene.elements[0].law.damping * phi**2
    assert correlation_time(model) == pytest.approx(2.0 / c, rel=1e-9)
    found = stationary(model, 16 * 400.0 / omega, 0.15 / omega, {"rate": rate}, segment=256)
    exact = phi**2 * level * (math.pi / 2.0 - c / (BAND * omega)) / c
    low, high = found["rate"].variance.interval(0.9999)
    assert found["rate"].variance.relative < 0.05
    assert low < exact * 1.002
    assert exact * 0.998 < high


@pytest.mark.drawn
def test_a_slider_takes_all_that_is_given():
    """Friction is all the damping there is: its mean power is that of the white force, whatever the limit."""
    model, phi, omega, level = undamped(lambda k: Jenkins(3.0 * k, 0.3 * k * SIZE))
    found = stationary(model, 16 * 500.0 / omega, 0.15 / omega, {"rate": rate}, segment=256)
    given = phi**2 * level * math.pi / 2.0
    power: Estimate = found.power(0)
    low, high = power.interval(0.9999)
    assert power.batches >= 16
    assert power.relative < 0.03
    assert low < 1.002 * given
    assert 0.998 * given < high
    assert not low < 1.3 * given < high


def test_the_time_of_friction_is_that_of_its_equivalent_dashpot():
    """ω c = 4 f (X - f/k)/(π X²) and 1/τ = c φ²/2, at twice the amplitude of a pilot run of known size."""
    model, phi, omega, _ = undamped(lambda k: Jenkins(3.0 * k, 0.3 * k * SIZE))
    law = model.scene.elements[0].law
    w = model.directions[0]

    def pilot(seconds):
        class Seen:
            t = np.linspace(0.0, seconds, 40_001)
            q = (SIZE * np.sin(omega * t) / abs(w[0]))[:, None]
            q_dot = (SIZE * omega * np.cos(omega * t) / abs(w[0]))[:, None]

        return Seen

    found = correlation_time(model, pilot)
    X = 2.0 * SIZE  # the slower of two sizes
    c = 4.0 * law.limit * (X - law.limit / law.stiffness) / (math.pi * X**2 * omega) * phi**2
    assert found == pytest.approx(2.0 / c, rel=1e-2)


def test_what_nothing_damps_is_refused():
    for law in (lambda k: Polynomial([k]), lambda k: Jenkins(3.0 * k, 1e6 * k * SIZE)):
        model, _, omega, _ = undamped(law)
        with pytest.raises(ValueError, match="needs damping in every mode"):
            stationary(model, 2000.0 / omega, 0.15 / omega, {"rate": rate}, segment=64)
    stuck, _, omega, _ = undamped(lambda k: Jenkins(3.0 * k, 1e6 * k * SIZE))
    with pytest.raises(ValueError, match="friction takes nothing"):
        stationary(stuck, 2000.0 / omega, 0.15 / omega, {"rate": rate}, segment=64)


def test_damping_of_the_structure_counts_first():
    """As before, where every mode is damped: elements are left out of the correlation time."""
    model, _, omega, _ = undamped(lambda k: KelvinVoigt(0.2 * k, 0.1 * k / 100.0))
    damped = replace(model.scene, damping=fb.ModalDamping(0.05)).reduce(modes=1)
    assert correlation_time(damped) == pytest.approx(1.0 / (0.05 * omega))


def damped_model():
    noise = fb.BandNoise(1e-5, (0.0, 400.0), seed=1)
    return fb.Scene(ROD, [fb.Clamped(0.0)], damping=fb.ModalDamping(0.05), base=noise).reduce(modes=1)


test_wrong_options_of_a_stationary_response_are_named = refused_by(
    lambda wrong: stationary(damped_model(), 5.0, 5e-3, **{"watch": {"rate": lambda run: run.q[:, 0]}, **wrong}),
    ({"segment": "x"}, "segment must be a whole number of samples, at least 8, got 'x'"),
    ({"segment": -5}, "segment must be .* got -5"),
    ({"bins": {"rate": [3.0, 2.0, 1.0]}}, r"bins\['rate'\] must be two or more finite edges that rise"),
    ({"levels": {"rate": "x"}}, r"levels\['rate'\] must be a number, got 'x'"),
    ({"levels": 3}, "levels must be a mapping by names of signals, got 3"),
    ({"watch": {"rate": 5}}, r"watch\['rate'\] must be a function of a run, got 5"),
    ({"watch": {"rate": lambda run: 1.0}}, r"watch\['rate'\] must return a value for each of the \d+ samples"),
    ({"watch": {"rate": lambda run: "x"}}, r"watch\['rate'\] must be real numbers, got 'x'"),
    ({"watch": {3: lambda run: run.t}}, "names of watch must be text, got 3"),
    ({"until": 0.1, "of": 3}, "of must be a function of a response, got 3"),
    ({"until": 0.1, "of": lambda r: r["rate"].std.value}, "of must return an Estimate, or several, got "),
    ({"start": "x"}, "start must be real numbers, got 'x'"),
)
