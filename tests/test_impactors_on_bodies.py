"""Impactors that strike frames and structures: the run of the beam, momentum, what is refused."""

import numpy as np
import pytest
from refusals import refused
from structures import beam_structure, space_truss

import fembeam as fb
from contacts import Hertz

STEEL = fb.Section(E=2.1e11, rho=7850.0, A=1e-4, I=1e-9)
LAW = Hertz(1e8)
BALL = {"mass": 0.05, "velocity": -2.0, "law": LAW, "gap": 1e-3}
WAVE = fb.Harmonic(1e-3, 60.0)
DAMPED = {"damping": fb.ModalDamping(0.02), "gravity": 9.81}


def framed(z, **ball):
    """A cantilever as a frame along x."""
    frame = fb.Frame({"A": (0, 0), "B": (0.4, 0)}, [fb.Member("A", "B", STEEL)])
    return fb.Scene(frame, [fb.Clamped("A")], impactors=[fb.Impactor(z, **(BALL | ball))], base={"y": WAVE}, **DAMPED)


@pytest.fixture(scope="module")
def known():
    """The run of the beam's scene, under base motion and gravity."""
    ball = fb.Impactor(0.3, **BALL)
    scene = fb.Scene(fb.Beam(0.4, STEEL), [fb.Clamped(0.0)], impactors=[ball], base=WAVE, **DAMPED)
    return scene.reduce(3).simulate(0.2, 1e-3)


def test_as_on_a_beam(known):
    """On a frame, inside a member: contacts, the mass and the frame move as the beam's; base and gravity carry both."""
    run = framed(("A-B", 0.3), direction="y").reduce(3).simulate(0.2, 1e-3)
    assert len(run.contacts) == len(known.contacts) == 2
    assert np.allclose(run.contacts.t_in, known.contacts.t_in, rtol=1e-9)
    assert np.allclose(run.contacts.impulse, known.contacts.impulse, rtol=1e-7)
    assert np.allclose(run.impactor_displacement(), known.impactor_displacement(), atol=1e-9)
    assert np.allclose(run.displacement("B", "y"), known.displacement(0.4), atol=1e-9)
    force = known.reactions()[0].force
    assert np.allclose(run.reactions()[0]["y"], force, atol=1e-5 * force.max())
    assert run.names == ("impactor at A-B + 0.3 m, y, above",)


def test_up_is_a_choice(known):
    """Along "-y" with all signs turned it is the same."""
    run = framed(("A-B", 0.3), direction="-y", velocity=2.0, side="below").reduce(3).simulate(0.2, 1e-3)
    assert np.allclose(run.impactor_displacement(), -known.impactor_displacement(), atol=1e-9)


def test_on_a_structure():
    """Matrices of a beam give that beam's run; a place by its name."""
    ball = {**BALL, "velocity": -1.0}
    beam = fb.Scene(fb.Beam(0.5, fb.Section.rectangle(2.1e11, 7850.0, 0.02, 0.01)), [fb.Clamped(0.0)],
                    impactors=[fb.Impactor(0.5, **ball)])  # fmt: skip
    body = fb.Scene(beam_structure(), [fb.Clamped("root")], impactors=[fb.Impactor("tip", **ball, direction="y")])
    one, two = beam.reduce("all", elements=8).simulate(0.02, 1e-4), body.reduce("all").simulate(0.02, 1e-4)
    assert np.allclose(one.contacts.t_in, two.contacts.t_in, rtol=1e-6)
    assert np.allclose(one.impactor_velocity(), two.impactor_velocity(), atol=1e-6)


def test_momentum_and_energy():
    """A free truss struck along a slant: the mass gives what the truss gets along it; the balance closes."""
    n = np.array([0.48, 0.6, 0.64])
    ball = fb.Impactor(4, **BALL, direction=tuple(n))
    model = fb.Scene(space_truss(), impactors=[ball]).reduce("all")
    run = model.simulate(0.05, 1e-4)
    masses, labels = [2.0, 1.0, 1.5, 0.5], "xyz"
    truss = sum(m * np.array([run.velocity(i + 1, c) for c in labels]) for i, m in enumerate(masses))
    assert len(run.contacts) >= 1
    struck = 0.05 * (run.impactor_velocity() + 2.0)  # what the mass has lost, along n
    assert np.allclose(truss, -n[:, None] * struck, atol=1e-9)
    assert abs(struck[-1] - run.contacts.impulse.sum()) < 1e-9
    assert abs(run.energy.residual).max() < 1e-9 * run.energy.stored[0]


def test_base_motion_by_components():
    """The frame's motion loads a mass along its direction alone: x = n·(y₀ - y) in free flight from rest."""
    n, wave, other = (0.6, 0.8), fb.Harmonic(1e-3, 40.0, phase=0.2), fb.Harmonic(2e-3, 25.0)
    frame = fb.Frame({"A": (0, 0), "B": (0.4, 0)}, [fb.Member("A", "B", STEEL)])
    ball = fb.Impactor("B", mass=0.05, velocity=0.0, law=LAW, gap=1.0, direction=n)
    scene = fb.Scene(frame, [fb.Clamped("A")], base={"x": wave, "y": other}, impactors=[ball])
    run = scene.reduce(2).simulate(0.1, 5e-3)
    t = run.t
    part = [s(t) - s(0.0) - s.derivative(1)(0.0) * t for s in (wave, other)]
    assert np.allclose(run.impactor_displacement(), -n[0] * part[0] - n[1] * part[1], atol=1e-13)


def test_kept_and_drawn(tmp_path, file_of):
    """A saved run knows it; the rig says its mass and gap; a scene file has `at` and `direction`."""
    scene = framed(("A-B", 0.3), direction="y", name="ball")
    run = scene.reduce(2).simulate(0.05, 1e-3)
    read = fb.load(run.save(tmp_path / "run.npz"))
    assert np.array_equal(read.impactor_velocity(), run.impactor_velocity())
    assert read.contacts.names == ("ball",)
    texts = " ".join(text.get_text().replace("\n", " ") for axes in scene.figure().axes for text in axes.texts)
    assert "ball, 0.05 kg, gap 1 mm" in texts
    text = """
[frame]
nodes = { A = [0, 0], B = [0.4, 0] }
[[frame.members]]
nodes = ["A", "B"]
section = { E = 2.1e11, rho = 7850.0, A = 1e-4, I = 1e-9 }
[[supports]]
kind = "clamped"
at = "A"
[[impactors]]
at = ["A-B", 0.3]
mass = 0.05
velocity = -2.0
gap = 1e-3
direction = "y"
law = { kind = "hertz", stiffness = 1e8 }
"""
    assert file_of(text).scene.impactors == (fb.Impactor(("A-B", 0.3), **BALL, direction="y"),)


# Where a direction is missing, or none that the place has.
test_refused = refused(
    (lambda: framed("B"), r"needs a direction, got None in impactors\[0\].*add direction='x' or so.* has x, y, rz"),
    (lambda: framed("B", direction="z"), "must move along z; it has x, y, rz"),
    (lambda: framed("B", direction="rz"), "direction of an impactor must be no rotation, got 'rz' in Impactor at 'B'"),
    (lambda: framed("B", direction="up"), "direction must be one of x, y, z"),
    (lambda: framed("C", direction="y"), "'B'|'A'"),
    (lambda: framed(("A-B", 0.5), direction="y"), "0.4"),
    (lambda: fb.Scene(fb.Beam(0.4, STEEL), [fb.Clamped(0.0)], impactors=[fb.Impactor(0.3, **BALL, direction="y")]),
     "direction is for bodies that are not a Beam"),
)  # fmt: skip
