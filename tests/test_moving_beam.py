"""Supports of a `Beam` with motions of their own: a frame's motion, formulas, files, what is refused."""

import numpy as np
import pytest
from refusals import refused
from test_moving_supports import DAMPED, SPAN, WAVE, equal

import fembeam as fb
from contacts import Hertz, KelvinVoigt

STEEL = fb.Section(E=2.1e11, rho=7850.0, A=1e-4, I=1e-9)
RAIL, END = fb.Harmonic(2e-3, 30.0), fb.Harmonic(1e-3, 20.0, phase=0.3)
TURN = fb.Harmonic(5e-3, 25.0, phase=0.3)
BEAM = fb.Beam(1.0, STEEL)


def two_supports(first, second, **options):
    """A beam clamped at one end and pinned at the other, which move up and down."""
    supports = [fb.Clamped(0.0, motion={"y": first}), fb.Pinned(1.0, motion={"y": second})]
    return fb.Scene(BEAM, supports, [fb.LumpedMass(0.4, 0.2)], **DAMPED, **options)


def overhang(law=None):
    """A clamp that moves and turns, a pin with all that can stand on it, a stop at the tip."""
    return fb.Scene(
        BEAM,
        [fb.Clamped(0.0, motion={"y": WAVE, "rx": TURN}), fb.Pinned(0.7, motion={"y": RAIL})],
        [fb.LumpedMass(0.4, 0.2), fb.LumpedMass(0.7, 0.1)],
        [fb.Spring(0.7, 3e3, foot=END), fb.Spring(1.0, 1e3)],
        [fb.Dashpot(0.7, 5.0), fb.Dashpot(0.4, 2.0)],
        [] if law is None else [fb.Stop(1.0, law, gap=1e-3)],
        **DAMPED,
    )


def framed(law):
    """The same as a frame."""
    nodes = {"A": (0, 0), "B": (0.4, 0), "C": (0.7, 0), "D": (1.0, 0)}
    turn = fb.Harmonic(-TURN.amplitude, TURN.omega, phase=TURN.phase)
    return fb.Scene(
        fb.Frame(nodes, [fb.Member(*pair, STEEL) for pair in ("AB", "BC", "CD")]),
        [fb.Fixed("A", motion={"y": WAVE, "rz": turn}), fb.Fixed("C", "x", "y", motion={"y": RAIL})],
        [fb.LumpedMass("B", 0.2), fb.LumpedMass("C", 0.1)],
        [fb.Spring("C", 3e3, foot=END, direction="y"), fb.Spring("D", 1e3, direction="y")],
        [fb.Dashpot("C", 5.0, direction="y"), fb.Dashpot("B", 2.0, direction="y")],
        [fb.Stop("D", law, gap=1e-3, direction="-y")],
        **DAMPED,
    )


def test_as_a_frame():
    """On a line: motion, contacts, reactions of all parts, section forces; the balance of energy closes."""
    law = KelvinVoigt(1e5, 50.0)
    one, two = (scene.reduce(modes=4).simulate(0.3, 5e-3) for scene in (overhang(law), framed(law)))
    for z, place in ((0.0, "A"), (0.4, "B"), (0.7, "C"), (1.0, "D")):
        for quantity in ("displacement", "velocity", "acceleration"):
            assert equal(getattr(one, quantity)(z), getattr(two, quantity)(place, "y"), 1e-6), (place, quantity)
    assert len(one.contacts) == len(two.contacts) > 1
    assert np.allclose(one.contacts.t_in, two.contacts.t_in, rtol=1e-8)
    for mine, other in zip(one.reactions(), two.reactions(), strict=True):
        assert np.allclose(mine["y"], other["y"], rtol=0, atol=1e-6 * abs(mine["y"]).max())
        assert np.allclose(mine.moment, other["rz"], rtol=0, atol=1e-7 * abs(mine.moment).max())
    for z, place in ((0.0, ("A-B", 0.0)), (0.55, ("B-C", 0.15)), (0.8, ("C-D", 0.1))):
        forces = two.section_forces(place)
        assert equal(one.moment(z), forces["M"], 1e-7)
        assert equal(one.shear(z), forces["Q"], 1e-7)
    assert equal(one.slope(0.0), -TURN(one.t), 1e-12)
    assert abs(one.energy.residual).max() < 1e-9 * abs(one.energy.input).max()


def test_parts_on_a_moving_support():
    """A spring and a dashpot on it are pulled by the motion itself; its mass needs a force of its own."""
    reactions = {one.name: one for one in overhang().reduce(3).simulate(0.1, 1e-3).reactions()}
    t, whole = reactions["Pinned at z = 0.7 m"].t, overhang()
    kept = {"springs": whole.springs[1:], "dashpots": whole.dashpots[1:]}
    without = fb.Scene(BEAM, whole.supports, whole.masses[:1], **kept, **DAMPED)
    pulled, damped = 3e3 * (END(t) - RAIL(t)), -5.0 * RAIL.derivative(1)(t)
    assert np.allclose(reactions["Spring at z = 0.7 m"].force, pulled, atol=1e-9)
    assert np.allclose(reactions["Dashpot at z = 0.7 m"].force, damped, atol=1e-9)
    bare = without.reduce(3).simulate(0.1, 1e-3).reactions()[1].force
    carried = 0.1 * RAIL.derivative(2)(t) - pulled - damped
    assert np.allclose(reactions["Pinned at z = 0.7 m"].force - bare, carried, atol=1e-6 * abs(bare).max())


def test_settlement():
    """A slow settlement y of a propped end, and a slow turn θ of the clamp: 3 EI y/L³ and 3 EI θ/L² in the prop."""
    slow, turn = fb.Harmonic(1.0, 1e-4, phase=0.5), fb.Harmonic(0.3, 1e-4, phase=0.5)
    supports = [fb.Clamped(0.0, motion={"rx": turn}), fb.Pinned(2.0, motion={"y": slow})]
    run = fb.Scene(fb.Beam(2.0, SPAN), supports).reduce(modes=1).simulate(1.0, 0.25)
    y, theta = slow(run.t), -turn(run.t)  # u_z of the clamp
    assert np.allclose(run.reactions()[1].force, 3 / 8 * y - 3 / 4 * theta, rtol=1e-6)
    assert np.allclose(run.moment(0.0), 3 / 4 * y - 3 / 2 * theta, rtol=1e-6)
    assert np.allclose(run.displacement(1.0), 5 / 16 * y + (1 - 5 / 8) * theta, rtol=1e-6)
    assert np.allclose(run.slope(0.0), theta, rtol=1e-12)


def test_settlement_of_an_interface():
    """Craig–Bampton's static shapes hold those that follow supports, beside any number of modes: u = y (3z² - z³)/2."""
    z = np.linspace(0.0, 1.0, 5)
    supports = [fb.Clamped(0.0), fb.Pinned(1.0, motion={"y": fb.Harmonic(1.0, 1.0)})]
    scene = fb.Scene(fb.Beam(1.0, SPAN), supports, stops=[fb.Stop(0.3, Hertz(1.0)), fb.Stop(0.6, Hertz(1.0))])
    for modes in (0, 1):
        model = scene.reduce(modes, interface=True)
        followed = model.shapes.rows_with_supports(z) @ np.append(model.following[0], 1.0)
        assert np.allclose(followed, (3 * z**2 - z**3) / 2, rtol=0, atol=1e-10)


def test_a_stop_sees_the_gap():
    """Everything moves by the same hump: the stop, which stays at rest, is met when the beam has come as far."""
    hump = fb.Pulse(peak=4e-3, length=4.0)
    run = two_supports(hump, hump, stops=[fb.Stop(0.5, Hertz(1e6), gap=3e-3, side="above")]).reduce(3).simulate(2.0)
    t = np.linspace(0.0, 2.0, 20001)
    assert run.contacts.t_in[0] == pytest.approx(t[np.argmax(hump(t) > 3e-3)], abs=5e-3)


def test_on_another_beam():
    """Supports of a further beam move it, not the first; inputs are told apart by their paths."""
    body = two_supports(WAVE, RAIL, forces=[fb.PointForce(0.5, fb.Harmonic(1.0, 5.0))])
    scene = fb.Scene(BEAM, [fb.Clamped(0.0, motion={"y": END})], bodies=[body], **DAMPED,
                     forces=[fb.PointForce(0.5, fb.Harmonic(1.0, 5.0))])  # fmt: skip
    model, alone = scene.reduce(3), body.reduce(3)
    run, own = model.simulate(0.2, 5e-3), alone.simulate(0.2, 5e-3)
    assert np.allclose(run.displacement(0.5, body=1), own.displacement(0.5), atol=1e-12)
    assert np.allclose(run.displacement([0.0, 1.0], body=1).T, [WAVE(run.t), RAIL(run.t)], atol=1e-15)
    assert np.allclose(run.displacement(0.0), END(run.t), atol=1e-15)
    assert np.allclose(run.moment(0.3, body=1), own.moment(0.3), atol=1e-9)
    for path in ("supports[1].motion.y", "forces[0]"):
        known = alone.frequency_response([50.0], path, 0.5).values
        assert np.allclose(model.frequency_response([50.0], f"bodies[0].{path}", 0.5, body=1).values, known)


def test_start():
    """At rest everything follows the supports; a given field is all of u."""
    model = two_supports(WAVE, RAIL).reduce(4)
    start, field = model.rest(), lambda z: WAVE(0.0) + (RAIL(0.0) - WAVE(0.0)) * z**2 * (3 - z) / 2
    n = len(start) // 2
    assert np.any(start[n:])
    again = model.state(displacement=field)
    assert np.allclose(again[:n], start[:n], atol=1e-6 * abs(start[:n]).max())  # the field's slopes are a spline's
    assert np.array_equal(again[n:], start[n:])


def test_kept_by_a_file(tmp_path):
    """Motion, moments and reactions from the file alone, those on supports too; tables and ParaView."""
    run = overhang().reduce(2).simulate(0.1, 5e-3)
    run.save(tmp_path / "run.npz")
    read = fb.load(tmp_path / "run.npz")
    z = np.array([0.0, 0.01, 0.7, 0.71, 1.0])
    for quantity in ("displacement", "velocity", "slope", "moment", "shear"):
        values = getattr(run, quantity)(z)
        assert np.array_equal(values, getattr(read, quantity)(z)), quantity
    assert np.allclose(run.displacement(0.7), RAIL(run.t), rtol=0, atol=1e-15)
    assert all(np.allclose(a.force, b.force) for a, b in zip(run.reactions(), read.reactions(), strict=True))
    assert run.extremes(z=[0.7]).highest[0] == run.displacement(0.7).max()
    assert np.array_equal(run.motion(0.0).T, [run.displacement(0.0), run.slope(0.0)])
    assert run.to_vtu(tmp_path / "run").is_file()


def test_in_a_file(file_of):
    """A table of signals by dof, also along a beam."""
    text = """
[beam]
length = 1.0
section = { E = 2.1e11, rho = 7850.0, A = 1e-4, I = 1e-9 }
[[supports]]
kind = "clamped"
z = 0.0
motion = { y = { kind = "harmonic", amplitude = 1e-3, omega = 46.0, phase = 0.7 } }
"""
    assert file_of(text).scene.supports == (fb.Clamped(0.0, motion={"y": WAVE}),)


def test_drawn():
    """The rig says how supports move; a moving picture shows them move."""
    scene = two_supports(WAVE, fb.Harmonic(1e-3, 20.0))
    texts = " ".join(text.get_text().replace("\n", " ") for axes in scene.figure().axes for text in axes.texts)
    assert "y: Harmonic, 1 mm, 46 rad/s" in texts
    run = scene.reduce(2).simulate(0.1, 5e-3)
    line = fb.plot.frame(run, 0.05).axes[0].lines[0].get_ydata()
    assert line[-1] == pytest.approx(np.cos(1.0), rel=1e-6)  # mm


# Where δ would not know of the motion, and what a beam cannot do.
test_refused = refused(
    (lambda: fb.Scene(BEAM, [fb.Clamped(0.0, motion={"x": WAVE})]), r"motion on a Beam must be of y, .* got \['x'\]"),
    (lambda: two_supports(WAVE, WAVE, stops=[fb.Stop(1.0, Hertz(1e8))]), r"moves along y.* got .*stops\[0\]"),
    (lambda: two_supports(WAVE, WAVE, stops=[fb.Stop(0.5, Hertz(1e8), on=1.0)]), r"moves along y.* got .*stops\[0\]"),
    (lambda: two_supports(WAVE, WAVE, stops=[fb.Stop(1.0 - 1e-6, Hertz(1e8), name="near")]).reduce(2),
     r"must not sit where a support moves, got \['0.999999 m'\] in stops\[0\] 'near'"),
    (lambda: two_supports(WAVE, WAVE, impactors=[fb.Impactor(1.0, 1.0, -1.0, Hertz(1e8))]).reduce(2),
     r"must not sit where a support moves, got \['1 m'\] in impactors\[0\]"),
    (lambda: fb.Scene(BEAM, [fb.Clamped(0.0)], bodies=[two_supports(WAVE, WAVE)],
                      stops=[fb.Stop(0.5, Hertz(1e8), on=(1, 1.0))]).reduce(2), r"moves along y"),
)  # fmt: skip


def test_beside_it():
    """A stop of rotation on a pin that moves up and down sees all that there is."""
    stop = fb.Stop(1.0, KelvinVoigt(500.0, 0.1), gap=1e-3, side="above", of="rotation")
    run = two_supports(WAVE, RAIL, stops=[stop]).reduce(3).simulate(0.3, 1e-3)
    assert np.allclose(run.indentation(0), run.slope(1.0) - 1e-3, atol=1e-12)
