"""Circular clearances: identities, closed forms, SciPy's DOP853, and the methods against each other."""

import numpy as np
import pytest
from bench.circle_flights import missed
from oscillators import Tone
from refusals import refused, refused_by
from scipy.integrate import solve_ivp
from test_annulus_tangent import tube

from contacts import Hertz, Hysteretic, KelvinVoigt, PiecewiseLinear, WaltonBraun
from solvers import (
    CentralDifference,
    Contact,
    DormandPrince,
    Exponential,
    HenonRK2,
    Newmark,
    System,
    integrate,
    integrate_many,
)

PLANE = np.eye(2)
NOTHING = np.zeros((2, 2))
SHARP = DormandPrince(1e-12)


def hole(law, clearance=1.0, **options):
    return Contact(PLANE, law, clearance, map="annulus", **options)


def free_mass(law, *contacts, **options):
    """A mass of 1 kg in the plane, in a hole of 1 m."""
    return System(PLANE, NOTHING, NOTHING, [hole(law, **options), *contacts])


def angular_momentum(run):
    return run.q[:, 0] * run.q_dot[:, 1] - run.q[:, 1] * run.q_dot[:, 0]


def by_scipy(force, start, duration):
    """[q, q̇] of the free mass under a radial force of r - 1, every border met by an event."""

    def rate(_, y):
        r = np.hypot(y[0], y[1])
        return [y[2], y[3], *(-force(max(r - 1.0, 0.0)) * y[:2] / r)]

    def apart(_, y):
        return np.hypot(y[0], y[1]) - 1.0

    apart.terminal, apart.direction = True, 1.0
    t, y = 0.0, np.array(start)
    while t < duration:
        run = solve_ivp(rate, (t, duration), y, method="DOP853", rtol=1e-13, atol=1e-15, events=apart)
        t, y, apart.direction = run.t[-1], run.y[:, -1], -apart.direction
    return y


@pytest.mark.parametrize(
    ("method", "law"),
    [(DormandPrince(1e-13), KelvinVoigt(1e4, 0.0)), (Exponential(1e-12), Hertz(1e4))],
    ids=["dormand", "exponential"],
)
def test_a_free_mass_moves_as_scipy_says(method, law):
    start = [0.5, 0.0, 0.2, 0.8]
    run = integrate(free_mass(law), start[:2], start[2:], 4.0, method=method)
    assert len(run.contacts.t_in) == 2
    expected = by_scipy(lambda delta: float(law.force(delta, 0.0, 1.0)), start, 4.0)
    np.testing.assert_allclose(run.end, expected, rtol=0.0, atol=3e-11)


@pytest.mark.parametrize("method", [SHARP, Exponential(1e-11)], ids=["dormand", "exponential"])
def test_angular_momentum_and_energy_are_kept(method):
    run = integrate(free_mass(KelvinVoigt(1e4, 0.0)), [0.5, 0.0], [0.2, 0.8], 220.0, 1.0, method)
    assert len(run.contacts.t_in) >= 100
    assert np.ptp(angular_momentum(run)) < 1e-12
    assert np.ptp(np.sum(run.q_dot**2, axis=1)[np.linalg.norm(run.q, axis=1) < 1.0]) < 1e-9
    np.testing.assert_allclose(run.contacts.speed_in, run.contacts.speed_in[0], rtol=1e-8)


def test_a_fast_bounce_reflects_the_speed():
    """With c against the indentation large, the wall is a plane: the time of contact is that of half an oscillation."""
    stiffness = 1e8
    run = integrate(free_mass(KelvinVoigt(stiffness, 0.0)), [0.6, 0.0], [0.0, 1.0], 1.0, method=SHARP)
    assert run.contacts.t_in[0] == pytest.approx(0.8, rel=1e-13)
    assert run.contacts.speed_in[0] == pytest.approx(0.8, rel=1e-13)
    assert run.contacts.t_out[0] - run.contacts.t_in[0] == pytest.approx(np.pi / np.sqrt(stiffness), rel=1e-4)
    assert run.contacts.peak_indentation[0] == pytest.approx(0.8 / np.sqrt(stiffness), rel=1e-4)
    np.testing.assert_allclose(run.q_dot[-1], [-0.96, -0.28], atol=1e-3)  # (0, 1) less twice its part along (0.6, 0.8)


@pytest.mark.parametrize("method", [SHARP, Exponential(1e-11)], ids=["dormand", "exponential"])
def test_a_planar_start_meets_two_one_sided_stops(method):
    """A start in one line through the centre stays on it."""
    law, along = KelvinVoigt(2e3, 5.0), np.array([0.6, 0.8])
    K, C = np.diag([4.0, 9.0]), 0.1 * PLANE
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    matrices = PLANE, C, turn @ K @ turn.T
    one = System(*matrices, [hole(law, 0.3)], [(along, np.cos)])
    two = System(*matrices, [Contact(-along, law, 0.3), Contact(along, law, 0.3)], [(along, np.cos)])
    runs = [integrate(system, 0.1 * along, 2.0 * along, 5.0, method=method) for system in (one, two)]
    assert len(runs[0].contacts.t_in) > 3
    np.testing.assert_allclose(runs[0].contacts.t_in, runs[1].contacts.t_in, rtol=1e-9)
    np.testing.assert_allclose(runs[0].contacts.peak_force, runs[1].contacts.peak_force, rtol=1e-8)
    np.testing.assert_allclose(runs[0].end, runs[1].end, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("clearance", [1e-3, 1e-14])
def test_a_way_through_the_middle_of_a_narrow_hole_is_an_end_and_a_beginning(clearance):
    """Every π/√(1e4 + 1) s and 2c/v in between, however narrow the hole is to the step."""
    system = System(PLANE, NOTHING, PLANE, [hole(KelvinVoigt(1e4, 0.0), clearance)])
    run = integrate(system, [0.0, 0.0], [1.0, 0.3], 0.315, method=DormandPrince(1e-8))
    assert len(run.contacts) == (11 if clearance < 1e-6 else 10)
    open_for = run.contacts.t_in[1:] - run.contacts.t_out[:-1]  # of two times, each rounded
    np.testing.assert_allclose(open_for, 2.0 * clearance / np.hypot(1.0, 0.3), rtol=2e-3, atol=np.spacing(0.315))


@pytest.mark.parametrize("outer", [False, True])
@pytest.mark.parametrize("method", [SHARP, Exponential(1e-11)], ids=["dormand", "exponential"])
def test_turning_everything_turns_everything(method, outer):
    law, turn = KelvinVoigt(2e3, 5.0), np.array([[0.8, -0.6], [0.6, 0.8]])
    K, C = np.diag([4.0, 9.0]), np.array([[0.2, 0.05], [0.05, 0.1]])
    q, v, push = np.array([0.6, 0.1]), np.array([-2.0, 1.2]), np.array([5.0, 3.0])
    centre = np.array([0.05, 0.1])
    options = {"outer": outer}
    plain = System(PLANE, C, K, [hole(law, 0.4 if outer else 0.8, centre=centre, **options)], [(push, np.cos)])
    turned = System(
        *(PLANE, turn @ C @ turn.T, turn @ K @ turn.T),
        *([hole(law, plain.contacts[0].gap, centre=turn @ centre, **options)], [(turn @ push, np.cos)]),
    )
    one = integrate(plain, q, v, 6.0, method=method)
    other = integrate(turned, turn @ q, turn @ v, 6.0, method=method)
    assert len(one.contacts.t_in) > 1
    np.testing.assert_allclose(other.q[-1], turn @ one.q[-1], rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(other.contacts.t_out, one.contacts.t_out, rtol=0.0, atol=1e-8)


LAWS = {
    "linear": KelvinVoigt(1e5, 0.0),
    "dashpot": KelvinVoigt(1e5, 20.0),
    "strong dashpot": KelvinVoigt(1e5, 400.0),
    "clamped": KelvinVoigt(1e5, 40.0, clamp=True),
    "hertz": Hertz(1e7),
    "lankarani": Hysteretic.lankarani_nikravesh(1e7, restitution=0.6),
    "piecewise": PiecewiseLinear([1e5, 3e5], [4e-5]),
}
V = np.array([0.3, -0.2, 0.1, 0.4])


def agree(one, other, rtol):
    """Events one by one and the ends, in units of the largest."""
    assert np.array_equal(one.contacts.stop, other.contacts.stop)
    for name in ("t_in", "t_out", "speed_in", "peak_indentation", "peak_force", "impulse"):
        a, b = getattr(one.contacts, name), getattr(other.contacts, name)
        np.testing.assert_allclose(a, b, rtol=0.0, atol=rtol * np.nanmax(np.abs(b)), err_msg=name)
    np.testing.assert_allclose(one.end, other.end, rtol=0.0, atol=rtol * np.abs(other.end).max())


def noise(t):
    """A load without tones: it is sampled."""
    return 4.0 * np.exp(-(((t - 0.04) / 0.03) ** 2)) * np.cos(80.0 * t)


@pytest.mark.parametrize("outer", [False, True], ids=["hole", "post"])
@pytest.mark.parametrize(("name", "load"), [*((name, None) for name in LAWS), ("dashpot", noise)])
def test_two_planes_move_as_the_independent_method_says(name, load, outer):
    plain = tube(LAWS[name], outer=outer, gap=6e-4 if outer else 1e-3)
    system = plain.like(loads=[*plain.loads, ([1.0, -0.5, 0.0, 0.0], load)]) if load else plain
    q = np.array([-1e-4, 9e-4, 0.0, 0.0]) if outer else np.zeros(4)
    one, other = (integrate(system, q, V, 0.1, method=m) for m in (Exponential(1e-11), DormandPrince(1e-13, 1e-20)))
    assert len(other.contacts.t_in) > 0
    agree(one, other, 1e-7)


def bundle(loads=()):
    """A tube of two modes a plane in two holes, with a stop on one side: five rows."""
    omega = np.array([30.0, 33.0, 190.0, 209.0])
    first, second = [[1.0, 0.0, -0.8, 0.0], [0.0, 1.0, 0.0, -0.7]], [[0.6, 0.0, 0.9, 0.0], [0.0, 0.5, 0.0, 1.0]]
    contacts = [
        Contact(first, LAWS["dashpot"], 1e-3, map="annulus"),
        Contact(second, LAWS["lankarani"], 8e-4, map="annulus", centre=(1e-4, 0.0)),
        Contact([0.8, 0.3, 0.0, 0.0], Hertz(1e7), 5e-4),
    ]
    push = [1.0, 0.6, -0.5, 0.3]
    return System.modal(omega, 0.02, contacts, [(push, Tone(3.0, 25.0)), *((push, load) for load in loads)])


def test_many_holes_and_a_stop_move_as_the_independent_method_says():
    one, other = (integrate(bundle(), np.zeros(4), V, 0.1, method=m) for m in (Exponential(1e-11), SHARP))
    assert set(one.contacts.stop) == {0, 1, 2}
    agree(one, other, 1e-6)


@pytest.mark.parametrize("name", ["linear", "dashpot", "lankarani"])
@pytest.mark.parametrize("make", [tube, lambda law: bundle([noise])], ids=["tables", "blocks"])
def test_the_energy_balance_closes(name, make):
    run = integrate(make(LAWS[name]), np.zeros(4), V, 0.2, 1e-3, Exponential(1e-10))
    handled = np.abs(run.energy.input).max() + run.energy.stored[0]
    assert np.abs(run.energy.residual).max() < 1e-8 * handled
    if name == "linear" and make is tube:
        np.testing.assert_allclose(run.contacts.energy_loss, 0.0, atol=1e-9 * handled)


def test_samples_lie_on_the_motion():
    """Within contact steps, landings and flights."""
    times = np.linspace(0.0, 0.05, 301)
    one, other = (integrate(tube(LAWS["hertz"]), np.zeros(4), V, 0.05, times, m) for m in (Exponential(1e-10), SHARP))
    np.testing.assert_allclose(one.q, other.q, rtol=0.0, atol=1e-8 * np.abs(other.q).max())
    np.testing.assert_allclose(one.q_dot, other.q_dot, rtol=0.0, atol=1e-7 * np.abs(other.q_dot).max())


def test_a_tighter_tolerance_brings_less_error():
    system, errors = tube(LAWS["hertz"]), []
    exact = integrate(system, np.zeros(4), V, 0.05, method=DormandPrince(1e-14, 1e-20)).end
    for rtol in (1e-4, 1e-6, 1e-8, 1e-10):
        end = integrate(system, np.zeros(4), V, 0.05, method=Exponential(rtol)).end
        errors.append(np.abs(end - exact).max() / np.abs(exact).max())
    assert all(error < 100.0 * rtol for error, rtol in zip(errors, (1e-4, 1e-6, 1e-8, 1e-10), strict=True))
    assert errors[-1] < 1e-4 * errors[0]


def test_a_run_goes_on_from_its_end_within_a_contact():
    system = tube(LAWS["linear"])
    log = integrate(system, np.zeros(4), V, 0.05, method=Exponential(1e-11)).contacts
    middle = 0.5 * (log.t_in[0] + log.t_out[0])
    half = integrate(system, np.zeros(4), V, middle, method=Exponential(1e-11))
    assert len(half.contacts.t_in) == 1
    assert np.isnan(half.contacts.t_out[0])
    free = system.like(loads=[])
    ends = [integrate(free, half.q[-1], half.q_dot[-1], 0.01, method=m).end for m in (Exponential(1e-11), SHARP)]
    np.testing.assert_allclose(*ends, rtol=0.0, atol=1e-8 * np.abs(ends[1]).max())


def test_many_starts_are_single_runs_with_their_own_clearances():
    system, factors = tube(LAWS["dashpot"]), np.array([1.0, 0.8, 1.3])
    gaps = 1e-3 * factors[::-1, None]
    many = integrate_many(system, np.zeros((3, 4)), np.outer(factors, V), 0.05, gaps=gaps)
    for i in range(3):
        one = integrate(tube(LAWS["dashpot"], gap=gaps[i, 0]), np.zeros(4), factors[i] * V, 0.05)
        assert np.array_equal(np.concatenate((many.q[i], many.q_dot[i])), one.end)
        assert many.peak_force[i, 0] == one.contacts.peak_force.max()


def test_no_flight_misses_the_circle():
    assert missed(100, seed=7) == (100, 0)


test_bad_contacts_are_refused = refused_by(
    lambda options: Contact(**{"direction": PLANE, "law": Hertz(1e6), "gap": 1e-3, "map": "annulus", **options}),
    ({"gap": 0.0}, "clearance, must be positive"),
    ({"gap": np.inf}, "clearance, must be positive"),
    ({"direction": [1.0, 0.0]}, "two finite rows"),
    ({"direction": [[1.0, 0.0], [2.0, 0.0]]}, "must differ"),
    ({"direction": [[1.0, np.nan], [0.0, 1.0]]}, "two finite rows"),
    ({"centre": (0.0, 0.0, 0.0)}, "two finite numbers"),
    ({"centre": (0.0, np.nan)}, "two finite numbers"),
    ({"map": "circle"}, 'must be "line" or "annulus"'),
    ({"always": True}, "without memory"),
    ({"law": WaltonBraun(1e3, 2e3, "kept")}, "without memory"),
    ({"map": "line", "direction": [1.0, 0.0], "outer": True}, "belong to an annulus"),
    ({"map": "line", "direction": [1.0, 0.0], "centre": (1.0, 0.0)}, "belong to an annulus"),
)


ZEROS = np.zeros((2, 4))

test_sizes_are_refused = refused(
    (lambda: integrate_many(tube(LAWS["dashpot"]), ZEROS, ZEROS, 0.05, gaps=[[1e-3], [0.0]]), "clearance"),
    (lambda: System(np.eye(3), np.eye(3), np.eye(3), [hole(Hertz(1e6))]), "direction of 2, the system 3"),
)


@pytest.mark.parametrize("method", [SHARP, Exponential()], ids=["dormand", "exponential"])
def test_a_start_at_the_centre_of_a_post_is_refused(method):
    system = System(PLANE, NOTHING, PLANE, [hole(Hertz(1e4), 0.5, outer=True, centre=(0.1, 0.2))])
    with pytest.raises(ValueError, match=r"contact 0 begins at the centre of its post, 0.5 m deep"):
        integrate(system, [0.1, 0.2], [0.0, 0.0], 1.0, method=method)


@pytest.mark.parametrize("method", [Newmark(1e-4), CentralDifference(1e-4), HenonRK2(1e-4, 1e-5)])
def test_methods_of_constant_step_refuse(method):
    system = free_mass(Hertz(1e6))
    with pytest.raises(ValueError, match="takes scalar stops, and contact 0 is an annulus; use Exponential"):
        integrate(system, [0.0, 0.0], [1.0, 0.0], 1.0, method=method)
    with pytest.raises(ValueError, match="takes scalar stops"):
        method.stable_dt(system)
