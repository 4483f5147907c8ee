"""Support reactions: statics in closed form, momentum and angular momentum, the unreduced equations, bad input."""

import numpy as np
import pytest
from problems import PAPER_BEAM

import fembeam as fb
from contacts import Hertz, Hysteretic, PiecewiseLinear
from fembeam.response import modal_accelerations

SQUARE = fb.Section.rectangle(2.1e11, 7850.0, 0.01, 0.01)
L, G = 0.4, 9.81
WEIGHT = SQUARE.line_mass * L * G


def at_rest(axial_force=0.0, **parts):
    """Reactions of a scene whose forces are constant, in equilibrium."""
    model = fb.Scene(fb.Beam(L, SQUARE, axial_force=axial_force), **parts).reduce(4)
    dead = {force.z: float(force.signal(0.0)) for force in parts.get("forces", ())}
    return model.simulate(1e-4, 1e-4, start=model.equilibrium(dead)).reactions()


@pytest.mark.parametrize(
    ("supports", "forces", "moments"),
    [
        ([fb.Clamped(0.0)], [1.0], [0.5]),
        ([fb.Clamped(0.0), fb.Clamped(L)], [0.5, 0.5], [1 / 12, -1 / 12]),
        ([fb.Clamped(0.0), fb.Pinned(L)], [5 / 8, 3 / 8], [1 / 8, 0.0]),
        ([fb.Pinned(0.0), fb.Pinned(L / 2), fb.Pinned(L)], [3 / 16, 10 / 16, 3 / 16], [0.0, 0.0, 0.0]),
        ([fb.Clamped(0.0), fb.Guided(L)], [1.0, 0.0], [1 / 3, 1 / 6]),
    ],
)
def test_weight_on_supports(supports, forces, moments):
    """Static reactions of a uniform load, as multiples of m g and m g L, with four modes."""
    found = at_rest(supports=supports, gravity=G)
    np.testing.assert_allclose([one.force[0] for one in found], np.multiply(forces, WEIGHT), atol=1e-10 * WEIGHT)
    np.testing.assert_allclose([one.moment[0] for one in found], np.multiply(moments, WEIGHT * L), atol=1e-10 * WEIGHT)
    np.testing.assert_allclose(found.force, WEIGHT, rtol=1e-10)


def test_statics_with_springs_tension_and_a_load_beside_a_support():
    load = [fb.PointForce(L / 2, fb.Harmonic(-30.0, 0.0)), fb.PointForce(1e-6 * L, fb.Harmonic(-50.0, 0.0))]
    held = [fb.Pinned(0.0), fb.Pinned(L)]
    for force in (500.0, -200.0, 0.0):  # the near load lies inside the first element: most of it on the support
        found = at_rest(supports=held, forces=load, axial_force=force)
        assert found.force[0] == pytest.approx(80.0, rel=1e-10)
        assert found[0].force[0] == pytest.approx(15.0 + 50.0 * (1 - 1e-6), rel=1e-8)
    foot = fb.Harmonic(1e-3, 0.0)
    springs = [fb.Spring(L, 2e4, foot=foot), fb.Spring(0.0, 1e4, rotational=3.0)]
    model = fb.Scene(fb.Beam(L, SQUARE), [fb.Guided(L)], springs=springs).reduce(2, residual=True)
    stiffness = 1 / (1 / 2e4 + 1 / 1e4)  # nothing turns the free end: u differs by the bending of the spring's moment
    run = model.simulate(1e-4, 1e-4, start=model.equilibrium({L: 20.0}))
    guide, lifted, other = run.reactions()
    assert abs(guide.force).max() == 0.0
    assert lifted.force[0] + other.force[0] == pytest.approx(0.0, abs=1e-9)
    assert 0.5 * stiffness * 1e-3 < lifted.force[0] < stiffness * 1e-3
    about_the_left = guide.moment[0] + lifted.moment[0] + other.moment[0] + lifted.force[0] * L
    assert about_the_left == pytest.approx(0.0, abs=1e-9)


def rig(**more):
    """Everything that can act, on one beam."""
    return fb.Scene(
        PAPER_BEAM,
        [fb.Clamped(0.0), fb.Pinned(0.12)],
        masses=[fb.LumpedMass(0.24445, mass=25.4e-3, inertia=3.0e-6, offset=0.01)],
        springs=[fb.Spring(0.2, 300.0, rotational=0.05, foot=fb.Harmonic(1e-3, 90.0))],
        dashpots=[fb.Dashpot(0.22, 0.3, rotational=1e-4)],
        stops=[fb.Stop(0.24445, Hysteretic(2.1e8, 0.5), gap=1e-4), fb.Stop(0.06, Hertz(1e8), gap=1e-5, side="above")],
        forces=[fb.PointForce(0.23, fb.Harmonic(2.0, 300.0)), fb.PointMoment(0.12, fb.Harmonic(0.1, 200.0))],
        damping=fb.ModalDamping(0.02),
        base=fb.Harmonic(1e-3, 195.0),
        gravity=G,
        **more,
    )


def test_momentum_and_angular_momentum_balance_at_every_sample():
    """Σ reactions + contact forces + loads = Σ m (ü + ÿ + g), and the same about z = 0, whatever the modes."""
    for modes in (1, 4):
        scene = rig()
        model = scene.reduce(modes)
        run = model.simulate(0.3, 1e-4)
        assert len(np.unique(run.contacts.stop)) == 2
        t, found = run.t, run.reactions()
        pushes = [(s.z, s.push * run.force(i)) for i, s in enumerate(scene.stops)]
        pushes += [(0.23, 2.0 * np.cos(300.0 * t))]
        pushes += [(one.part.z, one.force) for one in found]
        turns = 0.1 * np.cos(200.0 * t) + sum(one.moment for one in found)
        # inertia by quadrature along the beam, independent of M
        frame = scene.base.derivative(2)(t) + G
        nodes = model.matrices.nodes
        x, w = np.polynomial.legendre.leggauss(6)
        z = (nodes[:-1, None] + np.diff(nodes)[:, None] * (0.5 + x / 2)).ravel()
        mass = scene.beam.section.line_mass * (np.diff(nodes)[:, None] * w / 2).ravel()
        along = run.acceleration(z) + frame[:, None]
        tip, turning = run.acceleration(0.24445) + frame, modal_accelerations(run) @ model.phi(0.24445, 1)
        lump = 25.4e-3 * (tip + 0.01 * turning)
        momentum, angular = along @ mass + lump, along @ (mass * z) + lump * 0.25445 + 3.0e-6 * turning
        size = max(np.abs(force).max() for _, force in pushes)
        np.testing.assert_allclose(sum(force for _, force in pushes), momentum, atol=1e-9 * size)
        np.testing.assert_allclose(sum(z * force for z, force in pushes) + turns, angular, atol=1e-10 * size)


def test_all_modes_are_the_residual_of_the_unreduced_equations():
    """With every mode K u + M (ü + r ÿ) - f on the supported dofs is the reaction, without a static solution."""
    scene = fb.Scene(fb.Beam(L, SQUARE), [fb.Clamped(0.0), fb.Pinned(0.3)], stops=[fb.Stop(L, PiecewiseLinear(1e5))],
                     base=fb.Harmonic(1e-3, 200.0))  # fmt: skip
    model = scene.reduce("all", elements=8)
    run = model.simulate(0.02, 1e-4)
    assert len(run.contacts)
    loose = fb.Scene(scene.beam, springs=[fb.Spring(0.3, 0.0)]).matrices(elements=8, probes=[L, 0.3])
    np.testing.assert_allclose(loose.nodes, model.matrices.nodes)
    free = model.matrices.dofs.ravel() >= 0
    u, a = np.zeros((2, len(run.t), len(free)))
    u[:, free] = run.q @ model.basis.vectors.T
    a[:, free] = modal_accelerations(run) @ model.basis.vectors.T
    a[:, ::2] += scene.base.derivative(2)(run.t)[:, None]
    residual = (loose.K @ u.T + loose.M @ a.T)[~free]
    clamp, pin = run.reactions()
    found = np.array([clamp.force, clamp.moment, pin.force])
    np.testing.assert_allclose(found, residual, atol=1e-8 * np.abs(residual).max())
    assert np.abs(pin.moment).max() == 0.0


@pytest.mark.parametrize("damping", [fb.ModalDamping(0.05), fb.Rayleigh(3.0, 1e-5)])
def test_a_hinged_beam_on_a_stop(damping):
    """A rigid-body mode: hinge and stop carry the weight; in free fall the hinge carries a quarter of it."""
    beam = fb.Beam(0.5, fb.Section.rectangle(2.1e11, 7850.0, 0.03, 0.01))
    stops = [fb.Stop(0.4, Hysteretic.achieving(1e8, 0.5))]
    model = fb.Scene(beam, [fb.Pinned(0.0)], stops=stops, damping=damping, gravity=G).reduce(4)
    weight = 0.5 * beam.section.line_mass * G
    rest = model.simulate(1e-3, 1e-3, start=model.equilibrium())
    np.testing.assert_allclose(rest.reactions().force, weight * (1 - 0.5 / 0.8), rtol=1e-8)
    one = fb.Scene(beam, [fb.Pinned(0.0)], stops=stops, damping=damping, gravity=G).reduce(1)
    fall = one.simulate(0.01, 0.01, start=one.state(displacement=lambda z: 0.1 * z))
    assert fall.reactions()[0].force[0] == pytest.approx(weight / 4, rel=1e-6)


def test_bodies_balance_each_by_itself():
    other = fb.Scene(fb.Beam(L, SQUARE), [fb.Clamped(L)], damping=fb.ModalDamping(0.01))
    stop = fb.Stop(0.35, Hertz(1e7), gap=1e-4, on=(1, 0.1))
    striker = fb.Impactor(0.2, 0.1, -0.5, Hertz(1e8), gap=1e-3)
    scene = fb.Scene(fb.Beam(L, SQUARE), [fb.Clamped(0.0)], bodies=[other], stops=[stop], impactors=[striker],
                     base=fb.Harmonic(1e-3, 150.0))  # fmt: skip
    model = scene.reduce(3)
    run = model.simulate(0.1, 1e-4)
    assert set(run.contacts.stop) == {0, 1}
    first, second = run.reactions()
    assert (first.name, second.name) == ("Clamped at z = 0 m", "Clamped at z = 0.4 m of beam 1")
    frame, z = scene.base.derivative(2)(run.t), (np.arange(4000) + 0.5) * L / 4000
    for body, one, pushed in ((0, first, run.force(0) - run.force(1)), (1, second, -run.force(0))):
        inertia = SQUARE.line_mass * L * (run.acceleration(z, body).mean(axis=1) + frame)
        np.testing.assert_allclose(one.force + pushed, inertia, atol=1e-4 * np.abs(run.force(0)).max())


def test_extremes_tables_and_bad_input():
    run = rig().reduce(2).simulate(0.05, 1e-4)
    found = run.reactions()
    clamp = found[0]
    (low, t_low), (high, t_high) = clamp.extremes()
    assert (low, high) == (clamp.force.min(), clamp.force.max())
    assert clamp.force[run.t == t_low] == low
    assert clamp.force[run.t == t_high] == high
    assert abs(clamp.largest("moment")[0]) == np.abs(clamp.moment).max()
    assert [type(one.part).__name__ for one in found] == ["Clamped", "Pinned", "Spring", "Dashpot"]
    assert "Dashpot at z = 0.22 m" in str(found)
    assert "<td>Dashpot at z = 0.22 m</td>" in found._repr_html_()
    assert len(repr(found)) < 200
    with pytest.raises(ValueError, match="quantity must be 'force' or 'moment'"):
        clamp.extremes("stress")
    bare = fb.Scene(fb.Beam(L, SQUARE)).reduce(3).simulate(1e-3, 1e-3).reactions()
    assert len(bare) == 0
