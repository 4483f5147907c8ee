"""Several bodies in one scene: impactors, sprung masses, beams that collide; free flight and momentum."""

import math
from dataclasses import replace

import numpy as np
import pytest
from refusals import refused, refused_by
from scipy.integrate import solve_ivp

import fembeam as fb
import solvers
from contacts import Hertz, Hysteretic, KelvinVoigt, PiecewiseLinear
from fembeam.study import quantities
from fembeam.study.stationary import indentation

STEEL = fb.Section.rectangle(2.1e11, 7850.0, 0.01, 0.01)
HERTZ = Hertz(5e9)
pytestmark = pytest.mark.filterwarnings("ignore:.*rigid-body:UserWarning")


def momenta(model, q_dot):
    """Linear momentum and angular momentum about z = 0 of everything that moves."""
    lever = np.concatenate([
        *(np.column_stack([beam.nodes, np.ones_like(beam.nodes)])[beam.dofs >= 0] for beam in model.matrices.beams),
        [impactor.z for impactor in model.matrices.impactors],
    ])  # fmt: skip
    return np.array([q_dot @ model.participation, q_dot @ model.basis.project(model.matrices.M @ lever)])


# --- impactors ----------------------------------------------------------------------------------------------------


def test_ball_on_a_rigid_body_is_the_two_body_collision():
    # Struck at its centre with only rigid-body modes kept, the beam is a mass: Hertz with the reduced mass.
    mass, speed, body = 0.3, 2.0, 7850.0 * 1e-4
    scene = fb.Scene(fb.Beam(1.0, STEEL), impactors=[fb.Impactor(0.5, mass, -speed, HERTZ, gap=1e-3)])
    model = scene.reduce(2)
    run = model.simulate(5e-3, 1e-5)
    m = mass * body / (mass + body)
    peak = (5 * m * speed**2 / (4 * 5e9)) ** 0.4
    log = run.contacts
    assert log.t_in == pytest.approx([1e-3 / speed], rel=1e-12)
    assert log.peak_indentation == pytest.approx([peak], rel=1e-7)
    assert log.t_out - log.t_in == pytest.approx([2.943275184325 * peak / speed], rel=1e-7)
    assert log.impulse == pytest.approx([2 * m * speed], rel=1e-7)
    assert run.impactor_velocity()[-1] == pytest.approx(-speed + 2 * m * speed / mass, rel=1e-7)
    assert run.velocity(0.5)[-1] == pytest.approx(-2 * m * speed / body, rel=1e-7)
    assert run.indentation()[0] == pytest.approx(-1e-3)
    assert np.abs(run.energy.residual).max() < 1e-8 * run.energy.stored[0]


@pytest.mark.parametrize("law", [HERTZ, Hysteretic.achieving(5e9, 0.6)])
def test_momentum_is_conserved_to_rounding_between_free_bodies(law):
    scene = fb.Scene(fb.Beam(0.4, STEEL), impactors=[fb.Impactor(0.1, 0.05, -3.0, law)])
    model = scene.reduce(8)
    run = model.simulate(0.02, 1e-4)
    before, after = momenta(model, run.q_dot[0]), momenta(model, run.q_dot[-1])
    assert len(run.contacts) >= 1
    np.testing.assert_allclose(before, [-0.15, -0.015], rtol=1e-12)
    np.testing.assert_allclose(after, before, rtol=2e-12)
    assert np.abs(run.energy.residual).max() < 1e-7 * run.energy.stored[0]


def test_impactor_from_below_is_the_mirror_image():
    def scene(side):
        ball = fb.Impactor(0.3, 0.05, side * 2.0, HERTZ, 1e-4)
        return fb.Scene(fb.Beam(0.4, STEEL), [fb.Clamped(0.0)], impactors=[ball])

    above, below = (scene(side).reduce(4).simulate(0.01, 1e-4) for side in (-1, 1))
    np.testing.assert_allclose(below.displacement(0.4), -above.displacement(0.4), atol=1e-13)
    np.testing.assert_allclose(below.impactor_displacement(), -above.impactor_displacement(), atol=1e-13)


def test_impactor_on_both_sides_rattles_within_its_clearance():
    scene = fb.Scene(fb.Beam(0.4, STEEL), [fb.Clamped(0.0)],
                     impactors=[fb.Impactor(0.3, 0.05, 1.0, HERTZ, gap=1e-3, side="both")])  # fmt: skip
    run = scene.reduce(3).simulate(0.05, 1e-4)
    assert set(run.contacts.stop) == {0, 1}
    assert run.contacts.stop[0] == 0  # moving up, its lower arm comes first
    relative = run.impactor_displacement() - run.displacement(0.3)
    assert np.abs(relative).max() < 1.2e-3
    assert np.abs(relative).max() > 0.9e-3


def test_the_count_of_dofs_says_whose_they_are():
    beam = fb.Scene(fb.Beam(0.4, STEEL), [fb.Clamped(0.0)])
    assert "further" not in str(beam.matrices(modes=2))
    assert " free dofs with those of further bodies: " in str(replace(beam, bodies=[beam]).matrices(modes=2))
    column = fb.Scene(fb.Frame({"A": (0, 0), "B": (0, 1)}, [fb.Member("A", "B", STEEL)]), [fb.Clamped("A")])
    assert "further" not in str(column.matrices(modes=2))
    assert str(replace(column, bodies=[column]).matrices(modes=2)).endswith(" free, with those of further bodies")


def test_impactors_are_called_by_name_too(tmp_path):
    ball = fb.Impactor(0.3, 0.05, -2.0, HERTZ, 1e-3, name="ball")
    ring = fb.Impactor(0.2, 0.05, 1.0, HERTZ, 1e-3, "both", name="ring")
    stop = fb.Stop(0.4, HERTZ, 1e-2, name="guard")
    run = (
        fb.Scene(fb.Beam(0.4, STEEL), [fb.Clamped(0.0)], stops=[stop], impactors=[ball, ring])
        .reduce(2)
        .simulate(0.01, 1e-3)
    )
    for one in (run, fb.load(run.save(tmp_path / "run.npz"))):
        for number, name in enumerate(("ball", "ring")):
            np.testing.assert_array_equal(one.impactor_displacement(name), run.impactor_displacement(number))
            np.testing.assert_array_equal(one.impactor_velocity(name), run.impactor_velocity(number))
    for none in ("guard", "bell"):
        with pytest.raises(ValueError, match="impactor must be below 2, the number of impactors, or the name of one"):
            run.impactor_displacement(none)


def test_sprung_mass_without_contact_swings_by_itself():
    k, m, v = 400.0, 0.25, 0.3
    scene = fb.Scene(fb.Beam(0.4, STEEL), [fb.Clamped(0.0)],
                     impactors=[fb.Impactor(0.3, m, v, HERTZ, 1.0, "above", stiffness=k, damping=0.5)])  # fmt: skip
    model = scene.reduce(2)
    run = model.simulate(1.0, 0.01)
    decay, omega = 0.5 / (2 * m), math.sqrt(k / m)
    damped = math.sqrt(omega**2 - decay**2)
    assert model.omega[-1] == pytest.approx(omega)
    expected = v / damped * np.exp(-decay * run.t) * np.sin(damped * run.t)
    np.testing.assert_allclose(run.impactor_displacement(), expected, atol=1e-13)
    np.testing.assert_allclose(run.displacement(0.4), 0.0, atol=1e-15)


def test_frame_motion_and_gravity_act_on_impactors():
    scene = fb.Scene(fb.Beam(0.4, STEEL), [fb.Clamped(0.0)], base=fb.Harmonic(1e-3, 20.0), gravity=9.81,
                     impactors=[fb.Impactor(0.3, 0.1, 0.0, HERTZ, gap=9.0)])  # fmt: skip
    run = scene.reduce(2).simulate(1.0, 0.05)
    t = run.t
    expected = -0.5 * 9.81 * t**2 - 1e-3 * (np.cos(20 * t) - 1)  # it stays where it is, the frame moves
    np.testing.assert_allclose(run.impactor_displacement(), expected, atol=1e-11)


# --- the ball on a simply supported beam --------------------------------------------------------------------------


def independent_ball(L, section, z, mass, speed, law, modes, duration):
    """Timoshenko's problem with the exact modes of the pinned beam, by SciPy with events: (t_in, t_out, peak force)."""
    n = np.arange(1, modes + 1)
    beam_mass = section.line_mass * L
    omega = (n * np.pi / L) ** 2 * math.sqrt(section.bending_stiffness / section.line_mass)
    phi = math.sqrt(2 / beam_mass) * np.sin(n * np.pi * z / L)
    K = law.stiffness

    def delta(y):
        return phi @ y[:modes] - y[2 * modes]

    def motion(t, y):
        force = K * max(delta(y), 0.0) ** 1.5
        return np.concatenate([y[modes : 2 * modes], -(omega**2) * y[:modes] - phi * force, [y[-1], force / mass]])

    y = np.zeros(2 * modes + 2)
    y[-1] = -speed
    solution = solve_ivp(motion, (0, duration), y, "DOP853", rtol=1e-11, atol=1e-16, max_step=0.2 / omega[-1],
                         dense_output=False, events=[lambda t, y: delta(y) - 1e-18])  # fmt: skip
    depth = phi @ solution.y[:modes] - solution.y[2 * modes]
    return solution.t_events[0], K * depth.max() ** 1.5, solution.y[-1, -1]


@pytest.mark.parametrize(("ratio", "contacts"), [(0.2, 2), (1.0, 5)])
def test_ball_on_beam_against_an_independent_integration(ratio, contacts):
    L, modes = 0.3, 9
    mass = ratio * STEEL.line_mass * L
    scene = fb.Scene(fb.Beam(L, STEEL), [fb.Pinned(0.0), fb.Pinned(L)],
                     impactors=[fb.Impactor(L / 2, mass, -1.0, HERTZ)])  # fmt: skip
    run = scene.reduce(modes).simulate(4e-3, [4e-3])
    crossings, peak, speed = independent_ball(L, STEEL, L / 2, mass, 1.0, HERTZ, modes, 4e-3)
    log = run.contacts
    switched = np.sort(np.concatenate([log.t_in, log.t_out]))
    assert len(log) == contacts
    crossings = crossings[crossings > 1e-9]
    np.testing.assert_allclose(switched[switched > 1e-9], crossings, rtol=1e-5)
    assert log.peak_force.max() == pytest.approx(peak, rel=2e-3)  # its largest sample
    assert run.impactor_velocity()[-1] == pytest.approx(speed, rel=1e-5)


# --- beams that collide -------------------------------------------------------------------------------------------


def test_two_free_beams_collide_and_keep_their_momentum():
    other = fb.Scene(fb.Beam(0.3, STEEL))
    stop = fb.Stop(0.15, HERTZ, gap=1e-4, side="above", on=(1, 0.2))
    scene = fb.Scene(fb.Beam(0.4, STEEL), bodies=[other], stops=[stop])
    model = scene.reduce(6)
    start = model.state(velocity=[lambda z: 0.5 + 0 * z, lambda z: -0.5 + 0 * z])
    run = model.simulate(0.01, 1e-4, start=start)
    p = np.array([momenta(model, q_dot)[0] for q_dot in run.q_dot])
    assert len(run.contacts) >= 1
    assert run.contacts.t_in[0] == pytest.approx(1e-4, rel=1e-9)
    assert p[0] == pytest.approx(0.5 * STEEL.line_mass * 0.1, rel=1e-10)
    np.testing.assert_allclose(p, p[0], atol=1e-13)
    assert run.indentation()[0] == pytest.approx(-1e-4, rel=1e-9)
    assert np.abs(run.energy.residual).max() < 1e-7 * run.energy.stored[0]


def test_two_beams_against_the_same_problem_at_the_matrix_level():
    law = PiecewiseLinear([1e5])
    long, short = (fb.Scene(fb.Beam(length, STEEL), [fb.Clamped(0.0)]) for length in (0.5, 0.3))
    scene = fb.Scene(fb.Beam(0.5, STEEL), [fb.Clamped(0.0)], bodies=[short], damping=fb.ModalDamping(0.01),
                     stops=[fb.Stop(0.28, law, side="below", on=(1, 0.28))], base=fb.Harmonic(1e-3, 150.0))  # fmt: skip
    run = scene.reduce(3).simulate(0.1, [0.1])
    a, b = long.reduce(3), short.reduce(3)
    w = np.concatenate([a.phi(0.28), -b.phi(0.28)])
    omega = np.concatenate([a.omega, b.omega])
    load = -np.concatenate([a.participation, b.participation])
    system = solvers.System.modal(omega, [0.01] * 3 + [0.0] * 3, [solvers.Contact(w, law)],
                                  [(load, fb.Harmonic(1e-3, 150.0).derivative(2))])  # fmt: skip
    solution = solvers.integrate(system, np.zeros(6), np.zeros(6), 0.1)
    assert len(run.contacts) == len(solution.contacts) > 5
    tip = np.concatenate([a.phi(0.5), np.zeros(3)])
    assert run.displacement(0.5)[-1] == pytest.approx(solution.q[-1] @ tip, rel=1e-4)  # meshes differ by 1e-7
    with pytest.raises(ValueError, match="impactor must be below 0"):
        run.impactor_displacement()


def test_numbers_of_contacts_follow_the_bodies(tmp_path):
    other = fb.Scene(fb.Beam(0.3, STEEL), [fb.Clamped(0.0)], stops=[fb.Stop(0.3, HERTZ, 2e-3)])
    scene = fb.Scene(fb.Beam(0.5, STEEL), [fb.Clamped(0.0)], bodies=[other],
                     impactors=[fb.Impactor(0.4, 0.1, -1.0, HERTZ, gap=3e-3)],
                     stops=[fb.Stop(0.5, HERTZ, 1e-3), fb.Stop(0.2, HERTZ, 4e-3, on=(1, 0.2))])  # fmt: skip
    model = scene.reduce(2)
    assert [row.gap for row in model.contact_rows] == [1e-3, 4e-3, 3e-3, 2e-3]
    assert [row.body for row in model.contact_rows] == [0, 0, 0, 1]
    assert model.phi(0.5)[0] > 0
    assert model.phi(0.3, body=1)[2] > 0
    assert model.names == ["1", "2", "1 of beam 1", "2 of beam 1", "impactor 0"]
    assert len(fb.plot.mode_shapes(model).axes[0].lines) >= 3
    run = model.simulate(0.02, 1e-3)
    again = fb.load(run.save(tmp_path / "run"))
    np.testing.assert_array_equal(again.displacement(0.3, body=1), run.displacement(0.3, body=1))
    np.testing.assert_array_equal(again.impactor_velocity(), run.impactor_velocity())
    np.testing.assert_array_equal(again.indentation(3), run.indentation(3))


def test_indentation_rate_of_a_stop_between_two_beams_is_that_of_both():
    other = fb.Scene(fb.Beam(0.5, STEEL), [fb.Clamped(0.0)], damping=fb.ModalDamping(0.02))
    stop = fb.Stop(0.5, HERTZ, gap=1e-4, on=(1, 0.5))
    scene = fb.Scene(fb.Beam(0.5, STEEL), [fb.Clamped(0.0)], stops=[stop], bodies=[other], base=fb.Harmonic(1e-3, 150))
    model = scene.reduce(2)
    run = model.simulate(0.1, 1e-5, start=model.state(velocity=lambda z: -0.1 * model.phi(z)[..., 0]))
    assert len(run.contacts)
    delta, rate = quantities.signal(run)
    difference = np.gradient(delta, run.t)[1:-1]
    away = np.abs(rate[1:-1] - difference)
    assert np.median(away) < 1e-4 * np.abs(difference).max()  # at impacts the difference is smeared
    np.testing.assert_array_equal(rate, indentation(run, 0)[1])


def test_all_modes_of_several_bodies_are_the_finite_elements_themselves():
    """The dofs of all bodies together were counted, and every beam asked for so many modes."""
    short = fb.Scene(fb.Beam(0.3, STEEL), [fb.Pinned(0.0), fb.Pinned(0.3)])
    scene = fb.Scene(fb.Beam(0.5, STEEL), [fb.Clamped(0.0)], bodies=[short],
                     stops=[fb.Stop(0.28, HERTZ, gap=1e-3, on=(1, 0.15))],
                     impactors=[fb.Impactor(0.5, 0.1, -1.0, HERTZ, gap=1e-3)])  # fmt: skip
    model, full = scene.reduce("all", elements=4), scene.matrices(4)
    assert model.counts == tuple((beam.M.shape[0], 0) for beam in full.beams)
    assert model.basis.vectors.shape == full.M.shape
    start = np.linspace(0.1, 1.0, len(model.omega))
    u = model.basis.expand(start)
    np.testing.assert_allclose(model.basis.project(full.K @ u), model.omega**2 * start, rtol=1e-6, atol=1e-3)
    again = model.again(fb.Scene(scene.beam, scene.supports, bodies=[short]))  # other nodes
    assert again.counts == ((8, 0), (8, 0))


# --- free flight --------------------------------------------------------------------------------------------------


FRAME = fb.Frame({"A": (0, 0), "B": (0, 1)}, [fb.Member("A", "B", fb.Section.rectangle(2e11, 7800.0, 0.05, 0.05))])
BLOCK = fb.Scene(fb.Structure([[1e4]], [[2.0]], labels=[("b", "x")]))
SHORT = fb.Structure([[1e6]], [[2.0]], labels=[("b", "x")])
PLAIN = KelvinVoigt(1e5, 10.0)


def beside_a_block(**parts):
    """A clamped frame, driven into a block on a spring that is a body of one dof, or what else stands there."""
    drive, damping = fb.PointForce("B", fb.Harmonic(500.0, 30.0), direction="x"), fb.ModalDamping(0.02)
    parts = parts or {"bodies": [BLOCK], "stops": [fb.Stop("B", PLAIN, gap=1e-3, direction="x", on=(1, "b"))]}
    return fb.Scene(FRAME, [fb.Clamped("A")], forces=[drive], damping=damping, **parts)


@pytest.mark.parametrize(
    ("options", "counts"),
    [
        ({"modes": 4}, ((4, 0), (1, 0))),
        ({"modes": [0, 2]}, ((2, 0), (1, 0))),
        ({"modes": 4, "residual": True}, ((4, 1), (1, 0))),
        ({"modes": 4, "interface": True}, ((5, 0), (1, 0))),
        ({"omega_max": 5e3}, ((3, 0), (1, 0))),
        ({"mass_share": 0.6}, ((4, 0), (1, 0))),
    ],
)
def test_a_body_of_fewer_dofs_keeps_all_of_them(options, counts):
    # independent: the same block as an impactor on a spring, which no choice of modes concerns
    model = beside_a_block().reduce(**options)
    ball = fb.Impactor("B", 2.0, 0.0, PLAIN, stiffness=1e4, gap=1e-3, direction="x", side="above")
    run, other = (one.simulate(0.3, 1e-3) for one in (model, beside_a_block(impactors=[ball]).reduce(**options)))
    assert (model.counts, model.again(model.scene).counts) == (counts, counts)
    assert len(run.contacts) == len(other.contacts) > 0
    np.testing.assert_allclose(run.q, other.q, atol=1e-7 * np.abs(run.q).max())


test_of_modes_that_no_body_has_the_body_is_named = refused(
    (lambda: beside_a_block().reduce([1, 2]), r"one that every body has \(bodies\[0\] has 1 mode only\), got \[1, 2\]"),
    (
        lambda: fb.Scene(BLOCK.beam, bodies=[BLOCK]).reduce(modes=2),
        r"modes must be at most 1 \(free dofs of the scene's own body\), got 2",
    ),
    (
        lambda: fb.Scene(FRAME, [fb.Clamped("A")], bodies=[replace(BLOCK, beam=SHORT)]).reduce(omega_max=300.0),
        r"first frequency, 707.107 rad/s, of bodies\[0\], got 300",
    ),
)


def test_free_flight_is_exact_for_hours():
    model = fb.Scene(fb.Beam(0.4, STEEL)).reduce(4)
    start = model.state(velocity=lambda z: 2.0 - 3.0 * z)
    run = model.simulate(7200.0, [7200.0], start)
    z = np.array([0.0, 0.25, 0.4])
    np.testing.assert_allclose(run.displacement(z)[-1], 7200.0 * (2.0 - 3.0 * z), rtol=1e-10)
    np.testing.assert_allclose(run.velocity(z)[-1], 2.0 - 3.0 * z, rtol=1e-10)


def test_a_free_mass_flies_beside_a_beam_whose_dashpot_couples_modes():
    ball = fb.Impactor(0.3, mass=0.01, velocity=-1.0, law=Hertz(1e8), gap=0.5)
    beam = fb.Scene(fb.Beam(0.4, STEEL), [fb.Clamped(0.0)], dashpots=[fb.Dashpot(0.35, 0.5)], impactors=[ball])
    run = beam.reduce(2).simulate(0.4, 0.1)
    np.testing.assert_allclose(run.indentation(), run.t - 0.5, rtol=1e-12)
    assert len(run.contacts) == 0


# --- bad input ----------------------------------------------------------------------------------------------------


test_impactors_reject = refused_by(
    lambda options: fb.Impactor(**{"z": 0.3, "mass": 1.0, "velocity": -1.0, "law": HERTZ, **options}),
    ({"mass": 0.0}, "mass must be finite and positive, got 0.0 in Impactor at z = 0.3"),
    ({"velocity": math.nan}, "velocity must be finite, got nan"),
    ({"gap": -1e-3}, "the mass would start inside the beam, got -0.001 in Impactor at z = 0.3"),
    ({"gap": -1e-3, "side": "both", "stiffness": 1.0}, "would start inside"),
    ({"side": "left"}, "side must be 'above', 'below', 'both' or None, got 'left'"),
    ({"law": 3.0}, "law must offer force"),
    ({"law": lambda d, v, e: d}, "law must not be a bare function"),
    ({"stiffness": -1.0}, "stiffness must be finite and not negative"),
)


def test_a_field_that_starts_in_the_impactor_is_refused():
    scene = fb.Scene(fb.Beam(0.4, STEEL), [fb.Clamped(0.0)], impactors=[fb.Impactor(0.4, 0.1, -1.0, HERTZ, gap=1e-3)])
    with pytest.raises(ValueError, match=r"impactor 0 \(z = 0.4 m\) must start outside the beam"):
        scene.reduce(6).state(lambda z: 0.1 * z**2)


def test_scenes_reject_stops_in_one_place_and_bodies_that_are_not_there():
    beam, clamp = fb.Beam(0.4, STEEL), [fb.Clamped(0.0)]
    with pytest.raises(ValueError, match=r"one place, side and gap \(z = 0.3 m, below\), got \(0, 1\) in stops"):
        fb.Scene(beam, clamp, stops=[fb.Stop(0.3, HERTZ, gap=1e-3), fb.Stop(0.3, PLAIN, gap=1e-3)])
    fb.Scene(beam, clamp, stops=[fb.Stop(0.3, HERTZ), fb.Stop(0.3, HERTZ, side="above")])
    with pytest.raises(ValueError, match=r"on must name a body, and there is none, got 1 in stops\[0\] of Scene"):
        fb.Scene(beam, clamp, stops=[fb.Stop(0.3, HERTZ, on=(1, 0.1))])
    other = fb.Scene(fb.Beam(0.2, STEEL), clamp)
    with pytest.raises(ValueError, match=r"z of on must lie on body 1, 0 to 0.2 m, got 0.3"):
        fb.Scene(beam, clamp, bodies=[other], stops=[fb.Stop(0.3, HERTZ, on=(1, 0.3))])
    with pytest.raises(ValueError, match="must not have base, gravity or bodies of its own"):
        fb.Scene(beam, clamp, bodies=[fb.Scene(beam, clamp, gravity=9.81)])
    with pytest.raises(TypeError, match=r"bodies\[0\] must be a Scene"):
        fb.Scene(beam, clamp, bodies=[beam])
