"""Special points a branch passes and the ways it may end: torus bifurcation, subharmonic end, random systems."""

import math
from dataclasses import replace
from itertools import islice, pairwise

import numpy as np
import pytest
from oscillators import Bilinear, Tone, from_phase, over, random_family, random_stops_family, state_after, status_names

import solvers
from contacts import Hertz, KelvinVoigt, PiecewiseLinear, law
from solvers import Contact, DormandPrince, OrbitError, System, branch
from solvers.branches.bifurcations import Arc


@law(jump=True)
def hardening(delta, delta_dot, entry_rate, stiffness, damping):
    return stiffness * (delta + delta**3) + damping * delta_dot


def marked(found, mark):
    return [orbit for orbit in found.special if orbit.mark == mark]


@law(jump=True)
def dashpot(delta, delta_dot, entry_rate, damping):
    return damping * delta_dot


def driven(stops, omega):
    """q'' + 0.1 q' + q = cos ωt + what the stops do; with the period."""
    return System.modal([1.0], 0.05, stops, [([1.0], Tone(1.0, omega))]), 2.0 * math.pi / omega


def test_torus_bifurcation_where_an_oscillator_with_impacts_loses_its_damping():
    """Liouville: the product of the multipliers is exp(-(0.1 + c) T); the stop that is struck is elastic."""
    stop, start = Contact([1.0], PiecewiseLinear([4.0]), gap=0.3), Bilinear(1.4, zeta=0.05, gap=0.3).settled()

    def make(c):
        return driven([stop, Contact([1.0], dashpot(damping=c), gap=-50.0)], 1.4)

    found = branch(make, (-0.15, 0.0), start, at=0.0, step=0.3).run()
    (torus,) = found.special
    assert torus.mark == "neimark-sacker"
    assert torus.parameter == pytest.approx(-0.1, abs=1e-9)
    assert np.sum(torus.contacts.stop == 0) == 1
    assert np.abs(torus.multipliers) == pytest.approx([1.0, 1.0], abs=1e-8)
    assert abs(torus.multipliers[0].imag) > 0.05
    assert all(orbit.stable == (orbit.parameter > -0.1) for orbit in found.orbits if not orbit.mark)


def test_torus_bifurcation_where_a_nonlinear_stop_drives_as_much_as_the_mass_is_damped():
    """Always in contact: the product of the multipliers is exp(-(0.1 + c) T), whatever the stop's stiffness does."""

    def make(c):
        return driven([Contact([1.0], hardening(stiffness=2.0, damping=c), gap=-3.0)], 1.7)

    found = branch(make, (-0.15, 0.0), [2.0, 0.0], at=0.0, step=0.3).run()
    assert [orbit.mark for orbit in found.special] == ["neimark-sacker"]
    assert found.special[0].parameter == pytest.approx(-0.1, abs=1e-9)


def test_torus_bifurcation_beside_hardly_damped_modes():
    """Four idle modes share nothing with it: c = -0.1 as without them. Pairs of theirs make the test function small."""
    omega, period = 1.7, 2.0 * math.pi / 1.7

    def make(c):
        stop = Contact([1.0, 0.0, 0.0, 0.0, 0.0], hardening(stiffness=2.0, damping=c), gap=-3.0)
        loads = [([1.0, 0.0, 0.0, 0.0, 0.0], Tone(1.0, omega))]
        return System.modal([1.0, 2.0, 2.6, 3.1, 4.3], [0.05, *[1e-4] * 4], [stop], loads), period

    found = branch(make, (-0.15, 0.0), [2.0, *[0.0] * 9], at=0.0, step=0.3).run()
    assert [orbit.mark for orbit in found.special] == ["neimark-sacker"]
    assert found.special[0].parameter == pytest.approx(-0.1, abs=1e-9)


def test_subharmonic_branch_ends_at_a_flip():
    """Followed back from where it is settled, the doubled branch ends at the flip where it begins."""
    problem = Bilinear(0.88, zeta=0.05)  # doubles its period between 0.83 and 0.93 rad/s
    found = branch(over(problem, periods=2), (0.86, 1.0), problem.settled(), at=0.88, step=0.3).run()
    assert status_names(found) == ["SUBHARMONIC_END", "END"]
    ending = found.orbits[-1]
    assert ending.mark == "flip"
    there = replace(problem, omega=ending.parameter)
    exact, _ = there.special(-1.0, there.settled())
    assert ending.parameter == pytest.approx(exact, abs=1e-8)
    assert ending.period == 2.0 * there.period
    assert max(orbit.parameter for orbit in found.orbits) == ending.parameter
    assert abs(ending.multipliers[0] - 1.0) < 1e-6


def test_a_guess_at_which_no_orbit_is_found_is_left_aside(monkeypatch):
    """Rounding may keep Newton's method above its tolerance at one guess: every other one is made to fail."""
    at, asked = Arc.at, []

    def failing(segment, s):
        if s not in segment.trials and asked.count(s) == 0:
            asked.append(s)
            if len(asked) % 2:
                raise OrbitError("rounding")
        return at(segment, s)

    monkeypatch.setattr(Arc, "at", failing)
    problem = Bilinear(0.96, zeta=0.05)
    found = branch(over(problem), (0.9, 0.96), problem.settled(), at=0.96, step=0.3).run()
    (flip,) = found.special
    exact, _ = replace(problem, omega=flip.parameter).special(-1.0, flip.state)
    assert flip.parameter == pytest.approx(exact, abs=1e-6)
    assert len(asked) > 2


def test_a_graze_is_marked_however_shallow_the_contacts_beside_it():
    """Over two periods of the drive two contacts graze at once, where the linear motion just reaches the stop."""
    zeta, gap, omega, w = 0.5 * 0.14455829, 0.7000786761877948, 1.5801527935859612, 1.39034535

    def make(amplitude):
        stop = Contact([w], Hertz(75940.61027782668), gap=gap)
        load = [1.0], Tone(amplitude, omega)
        return System.modal([1.0], zeta, [stop], [load]), 4.0 * math.pi / omega

    found = branch(make, (0.46858947328201006, 1.40576841984603), np.zeros(2), step=0.3).run()
    touching = abs(1.0 - omega**2 + 2j * zeta * omega) * gap / w
    grazings = [one.parameter for one in marked(found, "grazing")]
    assert grazings
    assert grazings == pytest.approx([touching] * len(grazings), rel=1e-9)
    for a, b in pairwise(found.orbits):
        assert len(a.contacts) == len(b.contacts) or a.mark or b.mark


def begun(make, span, modes, most):
    """A branch and its first orbits, none where there is no orbit to begin with, which is said."""
    try:
        found = branch(make, span, np.zeros(2 * modes), step=0.3)
        return found, list(islice(found, most))
    except OrbitError as error:
        assert "residual" in str(error) or "open" in str(error)  # noqa: PT017
        return None, []


@pytest.mark.parametrize("seed", [0, 1, 3, 5, 6, 8, 9, 10, 11])
def test_random_systems_always_end_with_a_status(seed):
    """Of forty orbits, or fewer; systems are made for no more values than some iterations for each ask."""
    family, span, modes = random_family(np.random.default_rng(seed))
    asked = []

    def make(value):
        asked.append(value)
        return family(value)

    found, orbits = begun(make, span, modes, 40)
    if found is None:
        return
    assert len(orbits) == 40 or "RUNNING" not in status_names(found)
    assert len(asked) < 100 * len(found.status) + 40 * len(found.orbits)
    assert all(orbit.residual <= 1e-10 for orbit in found.orbits)
    assert all(span[0] <= orbit.parameter <= span[1] for orbit in found.orbits)


@pytest.mark.parametrize(("stops", "seed"), [(2, 0), (2, 1), (2, 3), (3, 0), (3, 2)])
def test_orbits_of_several_stops_close_for_another_integrator(stops, seed):
    """After two periods the motion has come back, of its size and in units of what its multipliers make."""
    make, span, modes = random_stops_family(np.random.default_rng(seed), "amplitude", stops)
    found, orbits = begun(make, span, modes, 12)
    assert found is None or "LOST" not in status_names(found)
    for one in orbits[::4]:
        x = one.state
        end = state_after(from_phase(one), x, 2.0 * one.period, DormandPrince(1e-10))
        assert np.abs(end - x).max() < 1e-6 * np.abs(x).max() * max(1.0, abs(one.multipliers[0])) ** 2


def ball(phase):
    """A ball on a vibrating plate over its amplitude: q'' = A cos(t + phase) - 1 + what a Kelvin–Voigt stop does."""
    zero, stop = np.zeros((1, 1)), Contact([1.0], KelvinVoigt(1000.0, 5.0))

    def loads(amplitude):
        return [([1.0], Tone(amplitude * np.exp(1j * phase), 1.0)), ([-1.0], Tone(1.0, 0.0))]

    base = System(np.eye(1), zero, zero, [stop], loads(1.0))  # its tables serve all

    def make(amplitude):
        return base.like(loads=loads(amplitude)), 2.0 * math.pi

    return make


@pytest.mark.parametrize(("number", "later"), [(0, 0.0), (3, 0.04)])
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_force_that_jumps_may_begin_at_any_time_of_the_period(number, later):
    """Fold and flip at 1.169860 and 1.172158 whichever phase is t = 0, contacts sliding over it on the way."""
    first = solvers.orbit(*ball(0.0)(1.3))
    t = (float(first.contacts.t_in[number]) + later * first.period) % first.period
    start = state_after(first.system, first.state, t, first.method)
    found = branch(ball(t), (0.8, 1.3), start, at=1.3, step=0.1).run()
    assert status_names(found) == ["END"]
    assert [one.mark for one in found.special] == ["fold", "flip"]
    assert [one.parameter for one in found.special] == pytest.approx([1.169860, 1.172158], abs=1e-6)
