"""Gravity in any direction: a turned frame under turned gravity hangs as it did, reactions carry the weight."""

import numpy as np
import pytest
from frames import portal, space_l, turned
from refusals import refused

import fembeam as fb

DOWN = np.array([0.0, 0.0, -9.81])
WEIGHT = 7850 * 2e-4 * 0.8 * 9.81


def hanging(frame, gravity):
    """A run at rest under gravity."""
    model = fb.Scene(frame, [fb.Clamped("A")], gravity=gravity).reduce(modes=10)
    return model.simulate(0.01, [0.01], start=model.equilibrium())


def test_turned_with_the_frame():
    """Deflections turn with both; the clamp carries the weight and nothing else."""
    turn = turned(4)
    one, two = hanging(space_l(), tuple(DOWN)), hanging(space_l(turn), tuple(turn @ DOWN))
    sag = one.motion("C")[0, :3]
    assert sag[2] < -1e-3
    assert np.allclose(turn.T @ two.motion("C")[0, :3], sag, atol=1e-6 * abs(sag[2]))
    assert np.allclose(one.reactions()[0].force[0], [0, 0, WEIGHT], atol=1e-6)
    assert np.allclose(turn.T @ two.reactions()[0].force[0], [0, 0, WEIGHT], atol=1e-6)


def test_a_number_is_along_minus_y():
    """The same run to the bit; nothing is nothing."""
    one, two = hanging(space_l(), 9.81), hanging(space_l(), (0.0, -9.81, 0.0))
    assert np.array_equal(one.q, two.q)
    assert fb.Scene(portal(), gravity=(0, 0, 0)).pulls == fb.Scene(portal()).pulls == {}


def test_in_the_plane_two_numbers_will_do():
    """As for nodes."""
    assert fb.Scene(portal(), gravity=(1, -9.81)).gravity == fb.Scene(portal(), gravity=(1, -9.81, 0)).gravity
    assert fb.Scene(portal(), gravity=(0, 0)).pulls == {}


def test_free_fall():
    """A free frame falls along the vector, after signals and a base motion are listed."""
    frame = fb.Frame.polyline({"A": (0, 0), "B": (1.0, 0)}, fb.Section.rectangle(2.1e11, 7850.0, 0.02, 0.01))
    scene = fb.Scene(frame, gravity=(3.0, -9.81, 0.0), base={"x": fb.Harmonic(0.0, 1.0)})
    with pytest.warns(UserWarning, match="rigid-body modes appear"):
        run = scene.reduce(3).simulate(0.2, [0.2])
    assert run.displacement("B", "x")[0] == pytest.approx(0.5 * 3.0 * 0.04, rel=1e-9)
    assert run.displacement("B", "y")[0] == pytest.approx(-0.5 * 9.81 * 0.04, rel=1e-9)


def test_in_a_file_and_drawn(file_of):
    """A list of three numbers; the rig says it."""
    text = """
gravity = [0, 0, -9.81]
[frame]
nodes = { A = [0, 0, 0], B = [1, 0, 0] }
[[frame.members]]
nodes = ["A", "B"]
section = { shape = "circle", E = 2.1e11, rho = 7850.0, diameter = 0.02 }
"""
    scene = file_of(text).scene
    assert scene.gravity == (0.0, 0.0, -9.81)
    texts = [text.get_text() for axes in scene.figure().axes for text in axes.texts] + [
        a.get_title() for a in scene.figure().axes
    ]
    assert any("gravity (0, 0, -9.81) m/s²" in text for text in texts)
    with pytest.raises(ValueError, match="must be a number, or three"):
        file_of(text.replace("[0, 0, -9.81]", '"down"'))


# What is no gravity.
test_refused = refused(
    (lambda: fb.Scene(portal(), gravity=(0, 0, 1)), r"must pull along x, y, got .'z'. in Scene"),
    (lambda: fb.Scene(space_l(), gravity=(0, 1)), r"must be a number, or three, got \(0, 1\) in Scene; write \(0, 0,"),
    (lambda: fb.Scene(portal(), gravity=(0, np.nan, 0)), r"or two along x and y, got .* write \(0, -9.81\)"),
    (lambda: fb.Scene(portal(), gravity=(1,)), "or two along x and y"),
    (lambda: fb.Scene(fb.Beam(1.0, fb.Section.circle(2e11, 7800.0, 0.01)), gravity=(0, 1, 0)), "of a Beam must be one"),
)  # fmt: skip


@pytest.mark.parametrize("gravity", [9.81, (0.0, -9.81, 0.0)])
def test_gravity_on_a_frame_joined_to_what_only_turns_is_refused(gravity):
    """It was a KeyError of the run, or said to be that of a Beam."""
    frame = fb.Frame({"A": (0, 0, 0), "B": (1, 0, 0)},
                     [fb.Member("A", "B", fb.Section.circle(2.1e11, 7800.0, 0.01))])  # fmt: skip
    wheel = fb.Structure(np.eye(3), 10.0 * np.eye(3), labels=[("P", c) for c in ("rx", "ry", "rz")])
    joined = {"bodies": [fb.Scene(wheel)], "joints": [fb.Joint("B", (1, "P"))]}
    assert fb.Scene(frame, [fb.Clamped("A")], **joined).gravity == 0.0
    with pytest.raises(ValueError, match="gravity needs a body that moves along x, y or z"):
        fb.Scene(frame, [fb.Clamped("A")], gravity=gravity, **joined)
