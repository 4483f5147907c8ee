"""Exact gradients of studies, and searches by them: differences, closed forms, fewer evaluations, bad input."""

import math
from dataclasses import dataclass
from functools import cache, partial

import numpy as np
import pytest
from differences import jacobian
from refusals import refused_by
from test_vary import kick, reach, rod, struck

import fembeam as fb
import solvers
from contacts import Jenkins, KelvinVoigt
from fembeam.model import extremes_of
from fembeam.model.extremes import of_top
from fembeam.scene import value_of
from fembeam.study.gradients import NoGradientError, gradient
from fembeam.study.measure import Plan
from fembeam.study.quantities import Amplitude, Density, MeanEnergy, Rms
from fembeam.study.trial import Trial

NAMES = ("stops[0].gap", "damping.zeta[0]", "forces[0].signal.omega", "masses[0].mass", "stops[0].law.stiffness")
ASKED = ("amplitude", "rms", "peak_force", "mean_force", "contact_time", "energy", Rms(z=0.3))
BLOW = {"duration": 0.1, "dt": 2.5e-4, "start": struck, "modes": 1, "elements": 4}
TRANSIENT, SETTLED = Plan(0.2, 2e-3, 0.05), Plan()


def stopped(**parts):
    """A rod with a mass that strikes a stop."""
    load, law = fb.Harmonic(3.0, 150.0), KelvinVoigt(2e4, 5.0)
    return rod(**{
        "stops": [fb.Stop(0.5, law, 1e-3)], "masses": [fb.LumpedMass(0.4, 0.1)], "forces": [fb.PointForce(0.5, load)],
        "damping": fb.ModalDamping([0.05, 0.05]), **parts,
    })  # fmt: skip


def trial_of(scene, names, asked, plan, modes=2):
    x = np.array([value_of(scene, name) for name in names])
    return Trial.of(scene, names, asked, plan, {"modes": modes, "elements": 4}).prepared(x[None]), x


def differences(trial, x):
    """Of the quantities themselves: (q, d)."""
    return jacobian(lambda x: np.mean(trial(x), axis=0), x, 1e-4 * x)


# --- gradients --------------------------------------------------------------------------------------------------------


def test_an_amplitude_between_samples():
    """The highest of two maxima may lie between samples, the highest sample beside the other."""
    t, beat = np.linspace(0.0, 2.0 * math.pi, 14), 0.002

    def motion(p):
        first, second = np.cos(2.0 * t - 0.1), p * np.cos(t) + beat * np.cos(3.0 * t)
        return first + second, -2.0 * np.sin(2.0 * t - 0.1) - p * np.sin(t) - 3.0 * beat * np.sin(3.0 * t)

    for p in np.linspace(-0.05, 0.05, 41):
        up, down = (motion(p + step) for step in (1e-6, -1e-6))
        change = [(a - b) / 2e-6 for a, b in zip(up, down, strict=True)]
        by_differences = (extremes_of(t, *up)[1] - extremes_of(t, *down)[1]) / 2e-6
        assert of_top(t, *motion(p), *change) == pytest.approx(by_differences, abs=1e-6)


@pytest.mark.parametrize("names", [NAMES[:2], NAMES[2:4], NAMES[4:]])
def test_of_a_run_against_differences_of_runs(names):
    """All quantities, from `discard` on; in units of value over parameter (amplitudes are cubics through samples)."""
    trial, x = trial_of(stopped(), names, ASKED, TRANSIENT)
    scale = np.abs(np.mean(trial(x), axis=0))[:, None] / x
    off = np.abs(gradient(trial, x) - differences(trial, x)) / scale
    np.testing.assert_array_less(off[1:], 1e-6)
    np.testing.assert_array_less(off[0], 1e-3)


def test_of_a_settled_response_against_differences():
    """The orbit has finer samples than the run: means over it differ a little, forces do not."""
    trial, x = trial_of(stopped(), NAMES[::2], ASKED, SETTLED)
    scale = np.abs(np.mean(trial(x), axis=0))[:, None] / x
    off = np.abs(gradient(trial, x) - differences(trial, x)) / scale
    np.testing.assert_array_less(off, 5e-3)
    np.testing.assert_array_less(off[2:4], 1e-6)


def test_of_a_settled_friction_damper():
    """By the limit of its slider, which remembers."""
    damper = fb.Element(0.5, Jenkins(2e3, 1.0), name="damper")
    scene = rod(forces=[fb.PointForce(0.5, fb.Harmonic(1, 215))], elements=[damper], damping=fb.ModalDamping([0.01]))
    trial, x = trial_of(scene, ["elements[damper].law.limit"], [Amplitude(z=0.5), "rms"], SETTLED, modes=1)
    np.testing.assert_allclose(gradient(trial, x), differences(trial, x), rtol=5e-3)


def test_of_the_energy_of_modes_that_turn_among_themselves():
    """Those of the two planes of a round rod, by a spring across neither."""
    bar = fb.Frame.straight(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01), bending_only=True)
    oblique = fb.Spring("B", 20.0, direction=(0.6, 0.8, 0.0))
    scene = fb.Scene(bar, [fb.Clamped("A")], springs=[oblique], damping=fb.ModalDamping(0.05),
                     forces=[fb.PointForce("B", fb.Harmonic(3.0, 150.0), direction="x")])  # fmt: skip
    trial, x = trial_of(scene, ("springs[0].stiffness",), ("energy",), TRANSIENT)
    by_differences = jacobian(lambda x: np.mean(trial(x), axis=0), x, 0.1 * x)
    np.testing.assert_allclose(gradient(trial, x), by_differences, rtol=1e-5)


def test_of_a_settled_oscillator_in_closed_form():
    """Rms of u at the tip: F φ²/(√2 |ω₀² - ω² + 2iζω₀ω|), by ω, of which the period is a part, and by F."""
    scene = rod(forces=[fb.PointForce(0.5, fb.Harmonic(3.0, 150.0))], damping=fb.ModalDamping([0.1]))
    trial, x = trial_of(scene, ["forces[0].signal.omega", "forces[0].signal.amplitude"], "rms", SETTLED, modes=1)
    model = scene.reduce(modes=1, elements=4)
    omega, phi = model.omega[0], model.phi(0.5)[0]
    square = (omega**2 - 150.0**2) ** 2 + (0.2 * omega * 150.0) ** 2
    rms = 3.0 * phi**2 / math.sqrt(2.0 * square)
    by_omega = -rms / (2.0 * square) * (-600.0 * (omega**2 - 150.0**2) + 2.0 * 150.0 * (0.2 * omega) ** 2)
    np.testing.assert_allclose(gradient(trial, x), [[by_omega, rms / 3.0]], rtol=1e-5)
    np.testing.assert_allclose(trial(x), rms, rtol=1e-9)


@pytest.mark.parametrize("phase", [0.0, 0.7, 1.5])
def test_of_a_period_each_sample_counts_once(phase):
    """Linear response in closed form: rms, mean energy Σ|Q|² (ω² + ω₀²)/4, and quantiles that are as far up as down."""
    scene = rod(forces=[fb.PointForce(0.5, fb.Harmonic(1.0, 190.0, phase=phase))], damping=fb.ModalDamping([0.03]))
    model = scene.reduce(modes=1, elements=4)
    phi, omega = model.phi(0.5)[0], model.omega[0]
    Q, run = phi / abs(omega**2 - 190.0**2 + 0.06j * omega * 190.0), model.orbit(1).run
    assert Rms(z=0.5)(run) == pytest.approx(phi * Q / math.sqrt(2.0), rel=1e-9)
    assert MeanEnergy()(run) == pytest.approx(Q**2 * (190.0**2 + omega**2) / 4.0, rel=1e-9)
    quantiles = Density(z=0.5)(run)
    np.testing.assert_allclose(quantiles, -quantiles[::-1], atol=1e-9 * phi * Q)


def test_derivatives_of_an_indentation():
    """δ and δ̇ of a stop by its own gap and by a mass, against runs nearby."""
    run = stopped().reduce(modes=2, elements=4).simulate(0.1, 5e-3)
    for path, value, step in (("stops[0].gap", 1e-3, 1e-7), ("masses[0].mass", 0.1, 1e-5)):
        found = run.sensitivity(path)
        near = [
            fb.scene.with_value(stopped(), path, value + k * step).reduce(modes=2, elements=4).simulate(0.1, 5e-3)
            for k in (-1.0, 1.0)
        ]
        for name in ("indentation", "indentation_rate"):
            exact = np.subtract(*(getattr(one, name)(0) for one in near[::-1])) / (2.0 * step)
            np.testing.assert_allclose(getattr(found, name)(0), exact, rtol=0.0, atol=1e-5 * np.abs(exact).max())


def test_where_there_is_none():
    scene = stopped(stops=[fb.Stop(0.5, KelvinVoigt(2e4, 5.0), 0.0)])
    trial, x = trial_of(scene, ["stops[0].gap"], "peak_force", TRANSIENT)
    with pytest.raises(NoGradientError, match=r"no gradient at stops\[0\].gap = 0"):
        gradient(trial, x)  # begins on the surface


# --- searches ---------------------------------------------------------------------------------------------------------


class Kick:
    """`kick` with its derivative: by a damping ratio 2ω q̇ beside that of the motion."""

    sampled = True

    def __call__(self, run):
        return kick(run)

    def derivative(self, change):
        run = change.run
        omega, zeta = run.model.omega[0], run.model.zeta[0]
        felt = omega**2 * run.q[:, 0] + 2.0 * zeta * omega * run.q_dot[:, 0]
        by = omega**2 * change.q[:, 0] + 2.0 * zeta * omega * change.q_dot[:, 0] + 2.0 * omega * run.q_dot[:, 0]
        return float(np.trapezoid(2.0 * felt * by, run.t))


class Reach:
    """`reach` with its derivative."""

    sampled = True

    def __call__(self, run):
        return reach(run)

    def derivative(self, change):
        i = int(np.abs(change.run.q[:, 0]).argmax())
        return float(np.sign(change.run.q[i, 0]) * change.q[i, 0])


@cache
def searched(gradients, bounded=False):
    omega, zeta = rod().reduce(modes=1, elements=4).omega[0], 0.7
    bound = math.exp(-zeta / math.sqrt(1 - zeta**2) * math.acos(zeta)) / omega
    limits = {Reach(): bound} if bounded else {}
    scene = rod(damping=fb.ModalDamping([0.1]))
    return fb.study.minimise(scene, {"zeta[0]": (0.05, 0.95)}, Kick(), limits, gradients=gradients, **BLOW)


def test_the_damping_that_isolates_a_blow_best():
    """∫ (ω² q + 2ζω q̇)² dt = ω (1 + 4ζ²)/(4ζ) for unit velocity: least at ζ = 1/2; fewer evaluations than without."""
    found, without = searched(True), searched(False)
    assert found.value == pytest.approx(rod().reduce(modes=1, elements=4).omega[0], rel=2e-4)
    assert found.at["damping.zeta[0]"] == pytest.approx(0.5, abs=3e-3)
    assert found.value == pytest.approx(without.value, rel=1e-5)
    assert found.evaluations < without.evaluations
    assert (found.gradients > 0, without.gradients, found.converged) == (True, 0, True)
    assert f"{found.gradients} gradients, converged" in str(found)


def test_the_same_with_a_bound_on_the_reach():
    """The bound is active, at its root ζ = 0.7; it is kept."""
    found, without = searched(True, True), searched(False, True)
    assert found.at["damping.zeta[0]"] == pytest.approx(0.7, abs=2e-3)
    assert found.limits[0].value <= found.limits[0].bound
    assert len(found.active) == 1
    assert found.evaluations < without.evaluations


def test_force_and_stiffness_of_a_stop():
    """Two parameters and a limit: the same minimum, at a bound and at the limit.

    By rounding a search there takes 30 to 50 evaluations with gradients or without.
    """
    box = {"stops[0].gap": (2e-4, 3e-3), "stops[0].law.stiffness": (5e3, 4e4)}
    ask = partial(fb.study.minimise, stopped(), box, "peak_force", {Amplitude(z=0.5): 2e-3}, 0.1, 2e-3, modes=2,
                  elements=4, tolerance=1e-3)  # fmt: skip
    found, without = ask(), ask(gradients=False)
    assert found.value <= 1.001 * without.value
    assert found.gradients > 0


def test_a_kink_is_left_to_the_method_without_gradients():
    """The least of the larger of two forces: its slope jumps there."""

    @dataclass(frozen=True)
    class Larger:
        """Of zeta and 0.6 - zeta."""

        def __call__(self, run):
            zeta = float(run.model.zeta[0])
            return max(zeta, 0.6 - zeta)

        def derivative(self, change):
            return 1.0 if change.run.model.zeta[0] > 0.3 else -1.0

    scene = rod(damping=fb.ModalDamping([0.1]))
    found = fb.study.minimise(scene, {"zeta[0]": (0.05, 0.9)}, Larger(), {}, 0.01, 5e-3, modes=1, elements=4,
                              gradients=True)  # fmt: skip
    assert found.at["damping.zeta[0]"] == pytest.approx(0.3, abs=1e-3)
    assert found.converged


def test_a_search_from_a_graze_goes_on_without():
    """At the first gap of the search the stop is just not touched, or its run begins on it."""
    found = fb.study.minimise(stopped(), {"stops[0].gap": (0.0, 3e-3)}, "rms", {}, 0.1, 2e-3, modes=2, elements=4,
                              tolerance=1e-2, gradients=True)  # fmt: skip
    assert found.active == ("stops[0].gap",)
    assert found.converged


def noisy():
    return rod(base=fb.BandNoise(1e-5, (0.0, 400.0), seed=1), damping=fb.ModalDamping([0.1]))


SEARCH = {"parameters": {"stops[0].gap": (1e-3, 2e-3)}, "quantity": "rms", "duration": 0.1, "dt": 2e-3}
SEARCH |= {"gradients": True, "modes": 1, "elements": 4}

test_what_has_none_is_refused = refused_by(
    lambda change: fb.study.minimise(**{**SEARCH, "scene": stopped(), **change}),
    ({"quantity": kick}, "kick has no exact derivative"),
    ({"quantity": "impact_rate"}, "impact_rate has no exact derivative"),
    ({"constraints": {"power": 1.0}}, "power has no exact derivative"),
    ({"scene": noisy(), "parameters": {"zeta[0]": (0.1, 0.2)}, "seeds": range(3)}, "means over noise"),
    ({"solver": solvers.DormandPrince()}, "method Exponential"),
    ({"gradients": 1}, "True, False or None"),
)
