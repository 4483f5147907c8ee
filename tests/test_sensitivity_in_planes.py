"""Derivatives of runs and orbits with circular clearances and friction: closed forms, differences, the tangent."""

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from differences import five_points
from oscillators import Tone
from test_friction import EYE, SHARP, wall
from test_friction_tangent import CHANGES, RUNS
from test_sensitivity import FINE, OF_CONTACTS
from test_stops_with_friction import TUBE

import fembeam as fb
from contacts import Hertz, KelvinVoigt, PiecewiseLinear
from fembeam.scene import with_value
from solvers import Contact, Friction, Nearby, NoDerivativeError, System, integrate, lyapunov, sensitivity

# --- closed forms ----------------------------------------------------------------------------------------------------

MASS, SPEED, CLEARANCE, STIFFNESS = 2.0, 0.7, 0.1, 5e3
DIAGONAL = np.array([0.6, 0.8])


def in_circle(clearance=CLEARANCE, law=None):
    """A mass in a hole around its start."""
    law = PiecewiseLinear([STIFFNESS]) if law is None else law
    hole = Contact(EYE[:2, :2], law, clearance, map="annulus")
    return System(MASS * EYE[:2, :2], 0.0 * EYE[:2, :2], 0.0 * EYE[:2, :2], [hole])


def test_a_mass_from_the_centre_by_the_clearance():
    """Along a radius the hole is a stop: t_in = c/v, t_out = t_in + π √(m/k), then it flies back along the radius."""
    nearby = Nearby.of(in_circle, CLEARANCE, 1e-3 * CLEARANCE)
    found = sensitivity(in_circle(), [0.0, 0.0], SPEED * DIAGONAL, 0.3, [0.3], nearby, method=FINE)
    np.testing.assert_allclose(np.append(found.entries, found.exits), 1.0 / SPEED, rtol=1e-9)
    np.testing.assert_allclose(found.states[-1], [*(2.0 * DIAGONAL), 0.0, 0.0], atol=1e-8)


@pytest.mark.parametrize("mu", [0.25, 0.0])
def test_slip_throughout_by_the_coefficient(mu):
    """Off an elastic wall the speed along it becomes v_t - 2 μ v_n: its derivative is -2 v_n, also where μ begins."""
    nearby = Nearby.of(lambda value: wall(mu=value), mu, 1e-3)
    found = sensitivity(wall(mu=mu), [-1e-3, 0.0], [0.8, 1.5], 0.004, [0.004], nearby, method=FINE)
    np.testing.assert_allclose(found.states[-1][2:], [0.0, -1.6], atol=1e-9)


@pytest.mark.parametrize("side", [2.0, -2.0, 0.1])
@pytest.mark.parametrize(("omega", "phase"), [(0.0, 0.0), (900.0, -0.5 * np.pi)])
def test_from_rest_on_the_surface_all_grows_with_the_load(side, omega, phase):
    """With a linear law and no gap the motion is proportional to the load: its own derivative, in stick and slip."""

    def pressed(load):
        return replace(wall(), loads=[([3.0, side], Tone(load * np.exp(1j * phase), omega))])

    found = sensitivity(pressed(1.0), [0.0, 0.0], [0.0, 0.0], 0.01, [0.01], Nearby.of(pressed, 1.0, 1e-3), method=FINE)
    run = found.solution
    np.testing.assert_allclose(found.states[-1][:2], run.q[-1], rtol=1e-6)
    np.testing.assert_allclose(found.states[-1][2:], run.q_dot[-1], rtol=1e-6)


def test_a_slip_that_ends_at_a_knot():
    """Where N grows ten times as fast from a knot on, slip ends there: s is latched at the time of the knot."""
    system = wall(PiecewiseLinear([4e5, 4e6], [1e-4]))

    def end(v_n):
        return integrate(system, [-1e-3, 0.0], [v_n, 0.6], 0.0016, method=SHARP).end[:4]

    found = sensitivity(system, [-1e-3, 0.0], [0.8, 0.6], 0.0016, [0.0016], start=[0.0, 0.0, 1.0, 0.0], method=FINE)
    omega = np.sqrt(4e5 / 0.08)
    at_knot = 1e-3 / 0.8 + np.arcsin(1e-4 * omega / 0.8) / omega
    assert found.solution.transitions.t[0] == pytest.approx(at_knot, rel=1e-9)
    expected = five_points(lambda h: end(0.8 + h), 1e-5)
    np.testing.assert_allclose(found.states[-1], expected, rtol=0.0, atol=1e-6 * np.abs(expected).max())


def test_a_slip_that_ends_at_the_knot_that_moves():
    """N of nearby laws is one of both segments there: derivatives of the motion along the wall had the other sign."""

    def made(knot):
        return wall(PiecewiseLinear([4e5, 4e6], [knot]))

    start = [-1e-3, 0.0], [0.8, 0.6], 0.0016
    found = sensitivity(made(1e-4), *start, [0.0016], Nearby.of(made, 1e-4, 1e-11), method=FINE)
    assert list(found.solution.transitions.event[:1]) == ["stick"]
    assert found.solution.transitions.t[0] > found.contacts.t_in[0]
    expected = five_points(lambda h: integrate(made(1e-4 + h), *start, method=SHARP).end[:4], 1e-9)
    for kind in (slice(2), slice(2, 4)):
        np.testing.assert_allclose(found.states[-1, kind], expected[kind], atol=1e-5 * np.abs(expected[kind]).max())


def test_two_slips_that_one_entry_ends():
    """Two equal walls with dashpots; another stop presses the mass to both at once."""
    one, push = wall(KelvinVoigt(2e5, 50.0), k_t=2e4), Contact([0.6, -0.8], KelvinVoigt(4e5, 600.0), 4e-4)
    system = replace(one, contacts=[one.contacts[0], one.contacts[0], push])

    def end(v_n):
        return integrate(system, [-4e-5, -9e-5], [v_n, 0.9], 0.0011, method=SHARP).end[:4]

    start = [0.0, 0.0, 1.0, 0.0]
    found = sensitivity(system, [-4e-5, -9e-5], [0.4, 0.9], 0.0011, [0.0011], start=start, method=FINE)
    stuck = found.solution.transitions
    assert stuck.t[stuck.event == "stick"].tolist() == 2 * [found.solution.contacts.t_in[2]]
    expected = five_points(lambda h: end(0.4 + h), 1e-5)
    np.testing.assert_allclose(found.states[-1], expected, rtol=0.0, atol=1e-6 * np.abs(expected).max())


# --- matrix level ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", RUNS)
def test_the_derivative_by_the_start_is_the_discrete_tangent(name):
    """Two ways with nothing in common but the run, through entry, stick, slip and exit."""
    system, q, q_dot, duration = RUNS[name]
    found = sensitivity(system, q, q_dot, duration, method=FINE)
    expected = integrate(system, q, q_dot, duration, method=FINE, tangent=True).tangent
    size = len(expected)
    np.testing.assert_allclose(found.matrix[:size, :size], expected, rtol=0.0, atol=1e-6 * abs(expected).max())


def changed(system, change, d):
    return System(system.M, system.C, system.K, [change(system.contacts[0], d)])


def differences(make, start, duration, step, method):
    """States at the end and the log, by five runs of an independent method."""
    runs = {k * step: integrate(make(k * step), *start, duration, method=method) for k in (-2, -1, 1, 2)}
    state = five_points(lambda h: runs[h].end[: 2 * len(start[0])], step)
    return state, {name: five_points(lambda h, of=name: getattr(runs[h].contacts, of), step) for name in OF_CONTACTS}


@pytest.mark.parametrize("name", CHANGES)
def test_the_derivative_by_a_parameter(name):
    """A spinning disc in a hole, two contacts and four transitions, against runs of the independent method."""
    system, *start, duration = RUNS["spin"]

    def make(d):
        return changed(system, CHANGES[name], d)

    found = sensitivity(system, *start, duration, [duration], Nearby.of(make, 0.0, 1e-4), method=FINE)
    step = {"clearance": 1e-6, "centre": 1e-6, "spin": 1e-3}.get(name, 1e-4)
    state, log = differences(make, start, duration, step, SHARP)
    np.testing.assert_allclose(found.states[-1], state, rtol=0.0, atol=1e-6 * abs(state).max())
    for logged, derived in OF_CONTACTS.items():
        size = np.nanmax(abs(log[logged]))
        np.testing.assert_allclose(getattr(found, derived), log[logged], rtol=0.0, atol=2e-6 * size, err_msg=logged)


@pytest.mark.parametrize("name", ["spin", "post"])
def test_where_the_angle_counts_from_changes_no_derivative(name):
    """Axes turned so that the place crosses the angle at which a turn begins between any two events of its contacts."""
    system, *start, duration = RUNS[name]
    contact = system.contacts[0]

    def by_clearance(axes):
        turned = replace(contact, direction=axes @ contact.direction)

        def make(d):
            return changed(system, lambda _, d: replace(turned, gap=turned.gap + d), d)

        return sensitivity(make(0.0), *start, duration, [duration], Nearby.of(make, 0.0, 1e-4), method=FINE)

    found = by_clearance(np.eye(2))
    log, times = found.solution.contacts, found.solution.transitions.t
    times = np.sort(np.concatenate((log.t_in, times, log.t_out)))
    x, y = contact.direction @ integrate(system, *start, duration, dt=times, method=FINE).q.T
    angles = np.arctan2(y, x)
    for angle in 0.5 * (angles[1:] + angles[:-1]):
        axes = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        state = by_clearance(axes).states[-1]
        np.testing.assert_allclose(state, found.states[-1], rtol=0.0, atol=1e-10 * abs(state).max())


def test_a_law_that_pulls_as_it_opens():
    """The limit max(μN, 0) has a kink where N = 0, which is met to rounding."""
    system, start = wall(KelvinVoigt(4e5, 60.0)), ([-1e-3, 0.0], [0.8, 1.0])

    def make(d):
        return changed(system, CHANGES["mu"], d)

    found = sensitivity(system, *start, 0.004, [0.004], Nearby.of(make, 0.0, 1e-3), method=FINE)
    state, _ = differences(make, start, 0.004, 1e-4, SHARP)
    np.testing.assert_allclose(found.states[-1], state, rtol=0.0, atol=1e-6 * abs(state).max())


PULLS = {
    **{name: CHANGES[name] for name in ("mu", "stiffness")},
    "damping": lambda contact, d: replace(contact, law=KelvinVoigt(1e4, 100.0 * (1.0 + d))),
}


@pytest.mark.parametrize("change", PULLS.values(), ids=list(PULLS))
def test_a_contact_that_pulls_and_presses_again(change):
    """The slider is freed where N falls to zero, and begins anew, within one contact."""
    loads = [(EYE[0, :2], fb.Harmonic(60.0, 2000.0)), (EYE[1, :2], fb.Harmonic(18.0, 1400.0))]
    bare, start = wall(KelvinVoigt(1e4, 100.0)), ([-1e-3, 0.0], [0.8, 1.0])
    system = System(bare.M, bare.C, bare.K, bare.contacts, loads)

    def make(d):
        return System(bare.M, bare.C, bare.K, [change(bare.contacts[0], d)], loads)

    found = sensitivity(system, *start, 0.0032, [0.0032], Nearby.of(make, 0.0, 1e-3), method=FINE)
    run = integrate(system, *start, 0.0032, method=FINE)
    assert run.transitions.event.tolist() == ["slip", "free", "slip"]
    assert len(run.contacts) == 1
    state, _ = differences(make, start, 0.0032, 1e-4, SHARP)
    np.testing.assert_allclose(found.states[-1], state, rtol=0.0, atol=1e-6 * abs(state).max())


def test_a_place_that_touches_its_circle_has_no_derivative():
    """A circle round the origin that a circular orbit touches from inside, to rounding."""
    hole = Contact(EYE[:2, :2], Hertz(1e5), 1.0 + 1e-11, map="annulus", friction=Friction(0.2, 1e4))
    swinging = System(EYE[:2, :2], 0.0 * EYE[:2, :2], EYE[:2, :2], [hole])
    with pytest.raises(NoDerivativeError, match="touched but not entered"):
        sensitivity(swinging, [-1.0, 0.0], [0.0, 0.5], 5.0, method=FINE)


# --- scenes ----------------------------------------------------------------------------------------------------------


def tube(law=None, **other):
    """A tube driven about in a hole, all the time in contact with it once it has settled."""
    options = {"friction": fb.Friction(0.3, 1.5e5), **other}
    stop = fb.AnnularStop(0.4, Hertz(1e9) if law is None else law, 2e-4, **options)
    loads = [
        fb.PointForce(0.6, fb.Harmonic(60.0, 260.0), direction="x"),
        fb.PointForce(0.6, fb.Harmonic(40.0, 260.0, 1.0), direction="y"),
    ]
    body = fb.Frame.straight(1.0, TUBE, bending_only=True)
    return fb.Scene(body, [fb.Clamped("A"), fb.Pinned("B")], stops=[stop], forces=loads, damping=fb.ModalDamping(0.05))


def simulated(scene):
    return scene.reduce(modes=2).simulate(0.02, dt=1e-3, solver=FINE)


@pytest.fixture(scope="module")
def run():
    return simulated(tube(centre=(3e-5, 2e-5)))


@pytest.mark.parametrize(
    ("path", "share"), [("stops[0].friction.mu", 2e-3), ("forces[0].signal.amplitude", 1e-4), ("damping.zeta[0]", 1e-3)]
)
def test_a_run_of_a_scene(run, path, share):
    """Every path reaches the equations; how exact derivatives are is asked above."""
    assert len(run.contacts) > 1
    assert len(run.transitions) > 1
    found = run.sensitivity(path)
    step = share * found.value
    runs = {
        k * step: simulated(with_value(run.model.scene, path, found.value + k * step)) for k in (-2, -1, 1, 2)
    }  # fmt: skip
    asked = {
        "displacement": lambda one: one.displacement(0.4, "x"),
        "velocity": lambda one: one.velocity(0.4, "y"),
        "indentation": lambda one: one.indentation(0),
        "indentation rate": lambda one: one.indentation_rate(0),
    }
    for name, ask in asked.items():
        expected = five_points(lambda h, ask=ask: ask(runs[h]), step)
        np.testing.assert_allclose(ask(found), expected, rtol=0, atol=1e-4 * np.abs(expected).max(), err_msg=name)
    for logged, derived in OF_CONTACTS.items():
        expected = five_points(lambda h, logged=logged: getattr(runs[h].contacts, logged), step)
        size = np.nanmax(abs(expected))
        np.testing.assert_allclose(getattr(found, derived), expected, rtol=0, atol=1e-4 * size, err_msg=logged)


def test_a_search_by_gradients():
    """The coefficient of friction of least rms, through stick and slip in a hole: nothing beside it is lower."""
    rub, mu = tube(KelvinVoigt(2e5, 20.0), friction=fb.Friction(0.2, 1.5e5)), "stops[0].friction.mu"
    asked = {"quantity": "rms", "duration": 0.05, "dt": 5e-4, "modes": 2}
    found = fb.study.minimise(rub, {mu: (0.04, 0.2)}, tolerance=1e-3, gradients=True, **asked)
    assert found.converged
    assert found.gradients < 10
    assert not found.active
    near = fb.study.vary(rub, {mu: found.at[mu] * np.array([0.95, 0.99, 1.01, 1.05])}, **asked)["rms"]
    assert np.all(near.ravel() > found.value)


def test_an_orbit():
    """A rub that never opens, with stick and slip by turns."""
    path = "stops[0].friction.mu"
    scene = tube(KelvinVoigt(2e5, 20.0), friction=fb.Friction(0.02, 1.5e5))
    orbit = scene.reduce(modes=2).orbit()
    assert len(orbit.transitions) > 1
    found = orbit.sensitivity(path)
    step = 1e-4 * found.value
    near = {k: with_value(scene, path, found.value + k * step).reduce(modes=2).orbit(start=orbit) for k in (-1.0, 1.0)}
    expected = (near[1.0].state - near[-1.0].state) / (2.0 * step)
    np.testing.assert_allclose(found.state, expected, rtol=0, atol=1e-5 * np.abs(expected).max())


RUBS = [None, fb.Friction(0.02, 1.5e5)]


def test_branches_basins_and_exponents():
    """Studies of the scene: orbits along clearance and amplitude, what starts come to, the exponent of the orbit."""
    model = tube(KelvinVoigt(2e5, 20.0), friction=RUBS[1]).reduce(modes=2)
    spans = {"stops[0].clearance": (1.6e-4, 2.4e-4), "forces[0].signal.amplitude": (50.0, 70.0)}
    spans |= {"stops[0].friction.mu": (0.015, 0.025)}
    for path, span in spans.items():
        orbits = list(islice(model.branch(path, span), 3))
        last = orbits[-1]
        scene = with_value(model.scene, path, last.parameter)
        again = scene.reduce(modes=2).orbit(start=last)
        np.testing.assert_allclose(again.extremes((0.4, "x")), last.extremes((0.4, "x")), rtol=1e-6)
    orbit = model.orbit()
    largest = max(abs(m) for m in orbit.multipliers if abs(m) < 1.0 - 1e-6)
    found = lyapunov(model.system, *np.split(orbit.state, 2), 8.0, discard=1.0)
    assert found.value == pytest.approx(np.log(largest) / orbit.found.period, rel=0.05)
    basins = fb.study.basins(
        model, "displacement", (-1e-4, 1e-4), "velocity", (-0.01, 0.01), 2, z=(0.4, "x"), settle=30
    )
    assert len(basins.attractors) == 1


@pytest.mark.parametrize("friction", RUBS, ids=["smooth", "rubs"])
def test_random_response(friction):
    """Means over time and over realisations of one noise agree within their scatter."""
    scene = tube(KelvinVoigt(2e5, 20.0), friction=friction)
    loads = [fb.PointForce(0.6, fb.BandNoise(1.0, (0.0, 600.0), seed=i), direction=d) for i, d in enumerate("xy")]
    model = replace(scene, forces=loads).reduce(modes=2)

    def mean_square(one):
        return float(np.mean(one.simulate(0.4, 1e-3).displacement(0.4, "x")[100:] ** 2))

    ensemble = fb.study.ensemble(model, 6, mean_square)
    values, watch = ensemble.values[""], {"x": lambda run: run.displacement(0.4, "x")}
    long = fb.study.stationary(model, 10.0, 1e-3, watch, discard=0.2)
    power = long.power(0) if friction is None else long.wear(0)
    assert power.value > 0.0
    assert abs(values.mean() - long["x"].variance.value) < 4.0 * values.std(ddof=1)


def test_a_direction_changes_rows():
    """The way a stop acts is a number like others: modes and rows are made again."""
    frame = fb.Frame.straight(0.5, TUBE, bending_only=True)
    stop = fb.Stop("B", KelvinVoigt(2e5, 0.0), 1e-4, direction=(0.6, 0.8, 0.0))
    push = [fb.PointForce("B", fb.Harmonic(60.0, 260.0), direction=one) for one in ("x", "y")]
    scene = fb.Scene(frame, [fb.Clamped("A")], stops=[stop], forces=push, damping=fb.ModalDamping(0.05))
    found = simulated(scene).sensitivity("stops[0].direction[0]")
    runs = {k * 1e-4: simulated(with_value(scene, found.parameter, 0.6 + k * 1e-4)) for k in (-2, -1, 1, 2)}
    expected = five_points(lambda h: runs[h].displacement("B", "x"), 1e-4)
    assert abs(expected).max() > 0.0
    np.testing.assert_allclose(found.displacement("B", "x"), expected, rtol=0, atol=1e-5 * np.abs(expected).max())


@pytest.mark.parametrize("path", ["forces[1].signal.omega", "beam.spin", "stops[0].radius"])
def test_an_orbit_in_which_a_spinning_shaft_sticks(path):
    """The place of its slider is told without what the spin has turned by in a period."""
    section = fb.Section.circle(1e7, 1.0, 0.02)
    loads = [fb.PointForce("B", fb.Harmonic(20.0, 0.0), direction="y")]
    scene = fb.Scene(
        fb.Frame.straight(0.5, section, spin=0.3, bending_only=True),
        supports=[fb.Clamped("A")],
        masses=[fb.LumpedMass("B", 1.0)],
        stops=[fb.AnnularStop("B", KelvinVoigt(400.0, 2.0), 1.0, friction=fb.Friction(0.45, 300.0), radius=0.5)],
        forces=[*loads, fb.PointForce("B", fb.Harmonic(4.5, 3.1, phase=1.0), direction="x")],
        damping=fb.Rayleigh(0.4, 0.0),
    )
    orbit = scene.reduce(modes=2).orbit()
    assert orbit.found.memory[0][0] == 0.0  # it sticks where the period begins
    value, h = fb.scene.value_of(scene, path), 1e-5
    near = [with_value(scene, path, value + d).reduce(modes=2).orbit(start=orbit) for d in (-h, h)]
    ends = [np.array(one.extremes(("B", "x"))) for one in near]
    found = orbit.sensitivity(path).extremes(("B", "x"))
    np.testing.assert_allclose(found, (ends[1] - ends[0]) / (2.0 * h), rtol=1e-5)
