"""Derivatives of runs through contacts with friction, and periodic motion with it."""

from dataclasses import replace

import numpy as np
import pytest
from differences import central, end_of, jacobian
from oscillators import Tone
from scipy.optimize import fsolve
from test_friction import EYE, SHARP, disc, pulled, wall

from contacts import Hertz, Hysteretic, Jenkins, KelvinVoigt, PiecewiseLinear
from solvers import Contact, Exponential, Friction, Nearby, Parameter, System, branch, integrate, orbit, sensitivity
from solvers.orbits import newton

FINE = Exponential(1e-11)


def by_differences(system, q, q_dot, duration, step=1e-6, memory=None):
    """The derivative of the end by the start, by central differences of the independent method."""
    return jacobian(end_of(system, duration, SHARP, memory=memory), np.concatenate((q, q_dot)), step, central)


RUNS = {
    "stick and slip": (wall(), [-1e-3, 0.0], [0.8, 0.1], 0.004),
    "slip": (wall(), [-1e-3, 0.0], [0.8, 1.5], 0.004),
    "hertz, stick and slip": (wall(Hertz(1e8)), [-1e-3, 0.0], [0.8, 0.6], 0.006),
    "hysteretic": (wall(Hysteretic(1e8, 0.5)), [-1e-3, 0.0], [0.8, 0.6], 0.006),
    "knots": (wall(PiecewiseLinear([2e5, 8e5], [1e-4])), [-1e-3, 0.0], [0.8, 1.5], 0.004),
    "disc": (disc(), [0.5, 0.0, 0.0], [0.2, 0.8, -1.5], 4.0),
    "spin": (disc(Hertz(1e5), spin=6.0, springs=20.0), [0.5, 0.1, 0.0], [4.5, 1.8, -1.5], 1.2),
    "post": (disc(Hertz(1e5), spin=6.0, springs=20.0, outer=True), [-1.5, 0.3, 0.0], [4.0, 0.9, -3.0], 0.8),
}


@pytest.mark.parametrize("name", RUNS)
def test_the_tangent_is_that_of_differences(name):
    system, q, q_dot, duration = RUNS[name]
    run = integrate(system, q, q_dot, duration, method=FINE, tangent=True)
    assert len(run.contacts.t_out) > 0
    expected = by_differences(system, q, q_dot, duration)
    assert abs(run.tangent - expected).max() < 2e-5 * abs(expected).max()


@pytest.mark.parametrize("law", [Hertz(1e5) + KelvinVoigt(2e4, 20.0), Hertz(1e5) + PiecewiseLinear([3e5])])
@pytest.mark.parametrize("outer", [False, True])
def test_the_tangent_of_a_spinning_disc_that_sticks_at_an_entry_under_a_broken_power(law, outer):
    """The first step is linearised in a frame that moves with the entry, in which the way of the spin moves too."""
    system = disc(law, mu=5.0, spin=6.0, springs=20.0, outer=outer)
    q, q_dot = ([-1.5, 0.3, 0.0], [4.0, 0.9, -3.0]) if outer else ([0.5, 0.1, 0.0], [4.5, 1.8, -1.5])
    run = integrate(system, q, q_dot, 0.3, method=FINE, tangent=True)
    assert len(run.contacts) == 1
    expected = by_differences(system, q, q_dot, 0.3)
    assert abs(run.tangent - expected).max() < 2e-5 * abs(expected).max()


@pytest.mark.parametrize("clamp", [False, True])
@pytest.mark.parametrize("v_t", [0.1, 1.5])
def test_the_tangent_where_a_law_pulls_as_it_opens(clamp, v_t):
    """The limit max(μN, 0) has a kink where N = 0, which is an event."""
    start = wall(KelvinVoigt(4e5, 60.0, clamp=clamp)), [-1e-3, 0.0], [0.8, v_t], 0.004
    run = integrate(*start, method=FINE, tangent=True)
    assert abs(run.tangent - by_differences(*start)).max() < 1e-6


@pytest.mark.parametrize("clamp", [False, True])
@pytest.mark.parametrize(("stiffness", "damping"), [(1.0, 0.0), (0.0, 1.0)])
def test_the_derivative_by_the_law_where_it_pulls_as_it_opens(stiffness, damping, clamp):
    """N = 0 ends a slip: the limits of the laws on both sides of the parameter are beyond their zero or before it."""

    def changed(d):
        return wall(KelvinVoigt(4e5 * (1.0 + stiffness * d), 60.0 * (1.0 + damping * d), clamp=clamp))

    start, step = ([-1e-3, 0.0], [0.8, 1.5], 0.004), 1e-5
    run = integrate(changed(0.0), *start, method=FINE, tangent=Parameter(changed(-step), changed(step), step))
    assert run.transitions.event.tolist() == ["slip", "free"]
    ends = [integrate(changed(d), *start, method=SHARP).end[:4] for d in (step, -step)]
    expected = (ends[0] - ends[1]) / (2.0 * step)
    assert abs(run.tangent[:, -1] - expected).max() < 1e-7 * abs(expected).max()


@pytest.mark.parametrize("clamp", [False, True])
def test_the_tangent_where_a_law_pulls_and_pushes_again(clamp):
    """The slider begins anew where N grows from zero: s has the derivative of ξ then, the time of N = 0 included."""
    start = pulled(clamp), [-1e-4, 0.0], [0.3, 0.3], 0.004
    run = integrate(*start, method=FINE, tangent=True)
    assert run.transitions.event.tolist().count("free") == 4
    expected = by_differences(*start)
    assert abs(run.tangent - expected).max() < 5e-5 * abs(expected).max()


@pytest.mark.parametrize(
    ("slopes", "damping", "v_t"),
    [([4e5, 4e5], [5.0, 20.0], 0.2), ([4e5, 8e5], [100.0, 250.0], 0.5), ([4e5, 4e5], [150.0, 5.0], 0.5)],
)
def test_the_derivative_where_the_force_jumps_on_a_knot(slopes, damping, v_t):
    """A slip is held, one begins after the law pulled, one begins at once: by the start and by a number of the law."""

    def changed(d):
        return wall(PiecewiseLinear(slopes, [1e-4], damping=[damping[0], damping[1] * (1.0 + d)]))

    start, step = ([-1e-4, 0.0], [0.8, v_t], 0.0022), 1e-5
    nearby = Nearby.of(changed, 0.0, 1e-3)
    run = integrate(changed(0.0), *start, method=FINE, tangent=Parameter(changed(-step), changed(step), step))
    ends = [integrate(changed(d), *start, method=SHARP).end[:4] for d in (step, -step)]
    expected = np.column_stack((by_differences(changed(0.0), *start), (ends[0] - ends[1]) / (2.0 * step)))
    size = abs(expected).max(axis=0)
    assert np.all(abs(run.tangent - expected).max(axis=0) < 1e-5 * size)
    found = sensitivity(changed(0.0), *start, [start[-1]], nearby, method=FINE)
    assert abs(found.states[-1] - expected[:, -1]).max() < 1e-6 * size[-1]
    assert np.all(abs(found.matrix[:4, :4] - expected[:, :4]).max(axis=0) < 1e-5 * size[:4])


def knotted(d):
    """N grows ten times as fast from a knot on: slip ends there."""
    return wall(PiecewiseLinear([4e5 * (1.0 + d), 4e6], [1e-4]))


def pressed_on(d):
    """Slip along a wall with a dashpot ends as another stop begins with a force that presses the mass to the wall."""
    one, other = wall(KelvinVoigt(4e5, 100.0), k_t=4e4), Contact([0.6, -0.8], KelvinVoigt(4e5, 600.0), 4e-4 * (1.0 + d))
    return replace(one, contacts=[*one.contacts, other])


@pytest.mark.parametrize(
    ("changed", "q", "q_dot", "duration"),
    [(knotted, [-1e-3, 0.0], [0.8, 0.6], 0.0016), (pressed_on, [-4e-5, -9e-5], [0.4, 0.9], 0.0011)],
)
def test_the_tangent_where_a_slip_ends_because_the_rate_of_N_jumps(changed, q, q_dot, duration):
    """s has the derivative of its place at the time of the knot or the entry; also by a parameter."""
    step = 1e-5
    parameter = Parameter(changed(-step), changed(step), step)
    run = integrate(changed(0.0), q, q_dot, duration, method=FINE, tangent=parameter)
    ended = run.transitions.t[list(run.transitions.event).index("stick")]
    if changed is pressed_on:
        assert ended == run.contacts.t_in[run.contacts.stop == 1][0]
    else:
        omega = np.sqrt(4e5 / 0.08)
        assert ended == pytest.approx(1e-3 / 0.8 + np.arcsin(1e-4 * omega / 0.8) / omega, rel=1e-9)
    ends = [integrate(changed(d), q, q_dot, duration, method=SHARP).end[:4] for d in (step, -step)]
    by_start = by_differences(changed(0.0), q, q_dot, duration, 1e-7)
    expected = np.column_stack([by_start, (ends[0] - ends[1]) / (2.0 * step)])
    assert np.all(abs(run.tangent - expected).max(axis=0) < 1e-6 * abs(expected).max(axis=0))


def test_an_entry_at_the_start_does_not_time_what_slips_from_there_on():
    """The spring of friction is drawn beyond its limit, and the start just touches another stop, moving in."""
    rub = Contact(-EYE[0], KelvinVoigt(4e5, 0.0), map="oblique", tangent=EYE[1], friction=Friction(0.25, 3e5))
    met = Contact([0.2, -0.5, -1.0], Hertz(1e6, 2.0))
    system = System(0.08 * EYE, 0.0 * EYE, np.diag([10.0, 20.0, 30.0]), [rub, met])
    q, v, memory = [1e-4, 0.0, 2e-5], [-0.3, 0.2, 1.0], [np.array([0.0, -2e-4]), np.empty(0)]
    found = integrate(system, q, v, 3e-4, method=FINE, memory=memory, tangent=True)
    assert (found.transitions.t.tolist(), found.transitions.event.tolist()) == ([0.0], ["slip"])
    exact = by_differences(system, q, v, 3e-4, 1e-8, memory)
    np.testing.assert_allclose(found.tangent, exact, rtol=0.0, atol=1e-6 * np.abs(exact).max())


def test_the_tangent_beside_other_elements():
    """A hole with friction, a slider and a stop on the same place."""
    hole = Contact(EYE[:2, :2], Hertz(1e6), 1e-2, map="annulus", friction=Friction(0.3, 5e4))
    rest = [Contact([1.0, 0.0], Jenkins(2e3, 3.0), always=True), Contact([0.6, 0.8], Hertz(1e6), 8e-3)]
    system = System(EYE[:2, :2], 0.5 * EYE[:2, :2], np.diag([400.0, 900.0]), [hole, *rest])
    start = np.array([1e-3, 2e-3]), np.array([0.5, 0.2])
    run = integrate(system, *start, 0.15, method=FINE, tangent=True)
    assert len(run.transitions) > 3
    assert set(run.contacts.stop.tolist()) == {0, 2}
    expected = by_differences(system, *start, 0.15, step=1e-7)
    assert abs(run.tangent - expected).max() < 1e-4 * abs(expected).max()


CHANGES = {
    "mu": lambda contact, d: replace(contact, friction=Friction(contact.friction.mu + d, contact.friction.stiffness)),
    "stiffness": lambda contact, d: replace(
        contact, friction=Friction(contact.friction.mu, contact.friction.stiffness * (1.0 + d))
    ),
    "law": lambda contact, d: replace(contact, law=Hertz(1e5 * (1.0 + d))),
    "spin": lambda contact, d: replace(contact, spin=contact.spin + d),
    "centre": lambda contact, d: replace(contact, centre=(d, 0.0)),
    "clearance": lambda contact, d: replace(contact, gap=contact.gap + d),
}


@pytest.mark.parametrize("name", CHANGES)
def test_the_derivative_by_a_parameter(name):
    system, q, q_dot, duration = RUNS["spin"]

    def changed(d):
        return System(system.M, system.C, system.K, [CHANGES[name](system.contacts[0], d)])

    step = 1e-6
    parameter = Parameter(changed(-step), changed(step), step)
    run = integrate(system, q, q_dot, duration, method=FINE, tangent=parameter)
    ends = [integrate(changed(d), q, q_dot, duration, method=SHARP).end[:6] for d in (step, -step)]
    expected = (ends[0] - ends[1]) / (2.0 * step)
    if run.tangent.shape[1] == 6:  # a clearance changes the way along the circle: left to differences
        assert name == "clearance"
        return
    assert abs(run.tangent[:, 6] - expected).max() < 1e-4 * abs(expected).max()


def rotor(spin):
    """An unbalanced rotor of 2 kg on a spring and a dashpot in a clearance of 0.2 mm."""
    friction = Friction(0.15, 1e6)
    hole = Contact(EYE[:2, :2], KelvinVoigt(3e5, 0.0), 2e-4, map="annulus", friction=friction, radius=0.02, spin=spin)
    size = 2.0 * 1e-4 * spin**2
    loads = [(EYE[0, :2], Tone(size, spin)), (EYE[1, :2], Tone(-1j * size, spin))]
    return System(2.0 * EYE[:2, :2], 60.0 * EYE[:2, :2], 8e4 * EYE[:2, :2], [hole], loads)


def rub(spin):
    """Place in the turning frame of a synchronous rub in slip, a complex number, and its eigenvalues there.

    m z'' + (c + 2imΩ) z' + (k - mΩ² + icΩ) z + N (1 + iμ c/r) z/r = m e Ω²,   N = k_c (r - c)
    """

    def excess(y):
        z, r = y[0] + 1j * y[1], np.hypot(y[0], y[1])
        push = 3e5 * (r - 2e-4) * (1.0 + 0.15j * 2e-4 / r) * z / r
        left = (8e4 - 2.0 * spin**2 + 60.0j * spin) * z + push - 2.0 * 1e-4 * spin**2
        return np.array([left.real, left.imag])

    def slopes(y, step=1e-10):
        return np.array([(excess(y + d) - excess(y - d)) / (2.0 * step) for d in step * np.eye(2)]).T

    place = fsolve(excess, [2.2e-4, -1e-4], xtol=1e-11)
    damping = np.array([[60.0, -4.0 * spin], [4.0 * spin, 60.0]])
    matrix = np.block([[np.zeros((2, 2)), np.eye(2)], [-slopes(place) / 2.0, -damping / 2.0]])
    return place[0] + 1j * place[1], np.linalg.eigvals(matrix)


@pytest.mark.parametrize("spin", [180.0, 220.0])
def test_a_synchronous_rub(spin):
    """It is periodic, slips without end, and its multipliers are those of the equilibrium in the turning frame."""
    period, (place, eigenvalues) = 2.0 * np.pi / spin, rub(spin)
    start = np.array([place.real, place.imag, -spin * place.imag, spin * place.real])
    found = orbit(rotor(spin), period, start, method=Exponential(1e-11))
    np.testing.assert_allclose(found.state[:4], start, rtol=0.0, atol=1e-9 * abs(place) * spin)
    for value in np.exp(eigenvalues * period):
        assert abs(found.multipliers - value).min() < 1e-6
    assert found.stable == (eigenvalues.real.max() < 0.0)


def shaker(amplitude, mu=0.3):
    """A mass on springs that is shaken against an oblique stop."""
    stop = Contact([-1.0, 0.0], Hertz(1e9), 1e-4, map="oblique", tangent=[0.0, 1.0], friction=Friction(mu, 1e6))
    loads = [([amplitude, 0.0], Tone(1.0, 130.0)), ([0.0, 0.5 * amplitude], Tone(np.exp(0.7j), 130.0))]
    return System(2.0 * EYE[:2, :2], 30.0 * EYE[:2, :2], np.diag([4e4, 5.2e4]), [stop], loads)


@pytest.mark.parametrize("amplitude", [60.0, 150.0])
def test_multipliers_of_a_driven_orbit(amplitude):
    period = 2.0 * np.pi / 130.0
    found = orbit(shaker(amplitude), period, np.zeros(4), method=FINE)
    assert len(found.contacts.t_in) > 0
    expected = np.linalg.eigvals(by_differences(shaker(amplitude), *np.split(found.state[:4], 2), period, 1e-7))
    np.testing.assert_allclose(np.sort(np.abs(found.multipliers))[-2:], np.sort(np.abs(expected))[-2:], rtol=2e-4)


def rolled(spin=0.3, omega=3.1, radius=0.5, turn=1.0):
    """A mass pressed to the bottom of a hole that turns slowly, pushed along it: it sticks, and slips in between."""
    friction = Friction(0.45, 300.0)
    rotation = turn * np.array([0.2, 0.0, 1.0])
    hole = Contact(
        *(EYE[:2, :3], KelvinVoigt(400.0, 2.0), 1.0),
        **{"map": "annulus", "friction": friction, "radius": radius, "spin": spin, "rotation": rotation},
    )
    loads = [(-EYE[1, :3], Tone(20.0, 0.0)), (EYE[0, :3], Tone(4.5 * np.exp(0.5j), omega))]
    return System(EYE[:3, :3], 0.3 * EYE[:3, :3], np.diag([4.0, 5.0, 9.0]), [hole], loads)


@pytest.mark.parametrize(("name", "value"), [("omega", 3.1), ("spin", 0.3), ("radius", 0.5)])
def test_the_slope_of_a_branch_on_which_a_spinning_shaft_sticks(name, value):
    """Its slider's place is told without what the spin has turned by in a period, which each of these changes."""

    def make(x):
        return rolled(**{name: x}), 2.0 * np.pi / (x if name == "omega" else 3.1)

    point = branch(make, (0.9 * value, 1.1 * value), orbit(*make(value)), at=value).walks[0].first
    assert point.orbit.memory[0][0] == 0.0  # it sticks where the period begins
    near = [newton(point.problem, point.chain.x, value + d).x.ravel() for d in (-1e-5, 1e-5)]
    expected = (near[1] - near[0]) / 2e-5
    slope = point.tangent[:-1] / point.tangent[-1]
    np.testing.assert_allclose(slope, expected, rtol=0.0, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize(("name", "value"), [("radius", 0.5), ("turn", 1.0), ("spin", 0.3)])
def test_derivatives_by_what_turns_a_shaft_in_its_hole(name, value):
    """The radius at which a rotation rubs is part of the row that the element acts on."""

    def system(d):
        return rolled(**{name: value + d})

    start = [0.1, -0.2, 0.1], [0.5, -1.0, 0.7]
    by = Parameter(system(-1e-6), system(1e-6), 1e-6)
    run = integrate(system(0.0), *start, 4.0, method=Exponential(1e-11), tangent=by)
    ends = [integrate(system(d), *start, 4.0, method=Exponential(1e-12)).end for d in (-1e-5, 1e-5)]
    expected = (ends[1] - ends[0]) / 2e-5
    np.testing.assert_allclose(run.tangent[:, -1], expected[:6], rtol=0.0, atol=1e-6 * np.abs(expected).max())


def test_what_never_sticks_is_no_family():
    """Nothing follows from the place of a slider that is open or slips all the time: no orbit beside belongs to it."""
    slipping, period = orbit(rotor(180.0), 2.0 * np.pi / 180.0), 2.0 * np.pi / 180.0
    system = rotor(180.0)
    open_ = orbit(system.like([replace(system.contacts[0], gap=1.0)]), period)
    for found, contacts in ((slipping, 1), (open_, 0)):
        assert (len(found.contacts), found.family, found.forgotten) == (contacts, (), 1)
        assert np.abs(found.multipliers - 1.0).min() > 1e-3


def test_a_branch_reaches_the_end_of_what_is_allowed():
    """There is no friction below 0: derivatives by the coefficient are taken from above there."""

    def make(mu):
        return shaker(60.0, mu), 2.0 * np.pi / 130.0

    found = branch(make, (0.0, 0.3), orbit(*make(0.1)), at=0.1).run()
    assert [status.name for status in found.status] == ["END", "END"]
    assert found.orbits[-1].parameter == 0.0 or found.orbits[0].parameter == 0.0


def test_branches_mark_where_a_slip_no_longer_ends_before_the_law_pulls():
    """The slip ended, and turned, at shares ε of a time before N = 0 that vanishes, its last piece like ε².

    There the slider's rate ξ̇ - σμṄ/k_t and N vanish at once: F_t = 0, so that both follow from state and loads.
    """
    law, friction, omega, drive = KelvinVoigt(21.9, 0.238, clamp=True), Friction(0.55, 10.8), 1.82, 22.9
    normal, tangent = np.array([-0.122, -0.175]), np.array([0.261, 0.146])
    stop = Contact(normal, law, gap=1.0, map="oblique", tangent=tangent, friction=friction)
    C, K = np.diag([0.108, 0.123]), np.diag([2.01, 2.61])
    base, period = System(np.eye(2), C, K, [stop]), 2.0 * np.pi / omega

    def make(size):
        tones = Tone(size * np.exp(0.614j), omega), Tone(drive * np.exp(2.364j), omega)
        return base.like(loads=list(zip(([0.122, 0.175], [-0.606, 0.0674]), tones, strict=True))), period

    found = branch(make, (11.0, 14.0), orbit(*make(13.9)), at=13.9, step=0.3).run()
    least, *_, most = sorted(found.orbits, key=lambda one: one.parameter)
    assert (least.transitions.event.tolist(), len(most.transitions)) == (["slip", "free"], 4)
    marked = [one for one in found.special if one.mark == "stick"]
    assert marked
    assert np.ptp([one.parameter for one in marked]) < 1e-4 * most.parameter  # rounding may enter it several times
    one, t = marked[-1], marked[-1].transitions.t[-1]
    assert one.phase == 0.0
    run = integrate(one.system, *np.split(one.state, 2), t, method=Exponential(1e-12))
    q, v = np.split(run.end[:4], 2)
    a = sum(np.array(vector) * signal(t) for vector, signal in one.system.loads) - C @ v - K @ q
    growth = law.stiffness * (-normal @ v) + law.damping * (-normal @ a)
    slip, way = friction.mu * growth / friction.stiffness, tangent @ v
    assert min(abs(way - slip), abs(way + slip)) < 1e-3 * abs(way)
