"""Further bodies and joints in scene files: the scene made in Python, a saved run's file, messages, the schema."""

import tomllib

import numpy as np
from refusals import refused_files
from test_cli import check_against

import fembeam as fb
from contacts import Hertz
from fembeam import scene_file

STEEL = '{ shape = "rectangle", E = 2.1e11, rho = 7850.0, width = 0.02, height = 0.01 }'
LEGS = f"""
[frame]
nodes = {{ A = [0, 0, 0], B = [0.4, 0, 0] }}
[[frame.members]]
nodes = ["A", "B"]
section = {STEEL}
up = "z"
[[supports]]
kind = "clamped"
at = "A"
[damping]
zeta = 0.01
[base.x]
kind = "harmonic"
amplitude = 1e-3
omega = 100.0
[[bodies]]
like = {{ body = 0, turned = [0, 0, 1.5707963267948966] }}
[[bodies.masses]]
at = "B"
mass = 0.2
[[bodies.stops]]
at = "B"
direction = "y"
name = "lift"
gap = 1e-4
law = {{ kind = "hertz", stiffness = 1e8 }}
[[bodies]]
[bodies.frame]
nodes = {{ C = [0, 0, 0], D = [0, 0, 0.2] }}
members = [{{ nodes = ["C", "D"], section = {STEEL} }}]
reduced = {{ nodes = ["C", "D"], modes = 4, elements = 4 }}
[[joints]]
at = "B"
to = [1, "A"]
[[joints]]
body = 1
at = "B"
to = [2, "C"]
dofs = ["x", "y", "z", "rx", "ry", "rz"]
[[stops]]
at = ["A-B", 0.2]
on = [2, "D"]
direction = "x"
gap = 1.0
law = {{ kind = "hertz", stiffness = 1e8 }}
"""


def in_python():
    """The same scene."""
    steel = fb.Section.rectangle(2.1e11, 7850.0, width=0.02, height=0.01)
    first = fb.Frame({"A": (0, 0, 0), "B": (0.4, 0, 0)}, [fb.Member("A", "B", steel, up="z")])
    post = fb.Frame({"C": (0, 0, 0), "D": (0, 0, 0.2)}, [fb.Member("C", "D", steel)])
    second = fb.Scene(first.turned((0, 0, np.pi / 2)), masses=[fb.LumpedMass("B", 0.2)],
                      stops=[fb.Stop("B", Hertz(1e8), 1e-4, direction="y", name="lift")])  # fmt: skip
    third = fb.Scene(post.reduced(["C", "D"], modes=4, elements=4))
    joints = [fb.Joint("B", to=(1, "A")), fb.Joint("B", to=(2, "C"), dofs=("x", "y", "z", "rx", "ry", "rz"), body=1)]
    return fb.Scene(first, [fb.Clamped("A")], damping=fb.ModalDamping(0.01), base={"x": fb.Harmonic(1e-3, 100.0)},
                    bodies=[second, third], joints=joints,
                    stops=[fb.Stop(("A-B", 0.2), Hertz(1e8), 1.0, direction="x", on=(2, "D"))])  # fmt: skip


def test_the_same_as_in_python(file_of):
    """Bodies in tables, one like another and turned, one reduced; joints; a run's own copy of the file."""
    found, scene = file_of(LEGS).scene, in_python()
    assert repr(found) == repr(scene)
    model = file_of(LEGS).model(modes=4)
    assert np.array_equal(model.omega, scene.reduce(4).omega)
    run = model.simulate(0.02, 1e-3)
    assert run.names == ("stop at A-B + 0.2 m, x, on D of body 2", "lift")


def test_a_beam_that_meets_another(file_of):
    """Without joints bodies are beams of their own; a stop lies on one of them."""
    beam = f"length = 0.5\nsection = {STEEL}"
    text = f"""
[beam]
{beam}
[[supports]]
kind = "clamped"
z = 0
[[stops]]
z = 0.5
on = [1, 0.5]
law = {{ kind = "hertz", stiffness = 1e8 }}
[[bodies]]
[bodies.beam]
{beam}
[bodies.damping]
zeta = 0.02
[[bodies.supports]]
kind = "clamped"
z = 0
"""
    scene = file_of(text).scene
    section = fb.Section.rectangle(2.1e11, 7850.0, width=0.02, height=0.01)
    other = fb.Scene(fb.Beam(0.5, section), [fb.Clamped(0.0)], damping=fb.ModalDamping(0.02))
    assert scene.bodies == (other,)
    assert scene.stops[0].coordinate.to == (1, 0.5)


# What is wrong, with its table and line.
test_refused = refused_files(
    LEGS,
    ('to = [1, "A"]', 'to = [1, "AA"]', "'A' is the nearest there is, got 'AA' in joints.0."),
    ('to = [1, "A"]', 'too = [1, "A"]', r":\d+: ..joints.. number 1: unknown key 'too'; did you mean 'to'"),
    ("modes = 4, ", "", r"number 2 .frame. reduced: the key 'modes' is missing"),
    ('nodes = ["C", "D"], modes', 'nodes = "C", modes', r"reduced: nodes must be a list of names, got 'C'"),
    ('at = "B"\nmass', "mass", r"the key 'at' is missing .the name of a point or node.; it needs at, mass$"),
    ("body = 0", "body = 2", "number 1 like: body must be 0, the file's own, to 0, got 2"),
    ('at = "B"\nmass', 'att = "B"\nmass', r"..bodies.. number 1 ..masses.. number 1: unknown key 'att'"),
    ("like = {", "nothing = {", r"unknown key 'nothing' .valid: beam, structure, frame, like"),
    ("[bodies.frame]", "[bodies.like]", "number 2 like: unknown key 'nodes'"),
    ("turned = [0, 0,", "turned = [0,", "like turned: rotation must be three finite numbers"),
)  # fmt: skip


def test_the_schema():
    """It knows frames, places, directions, bodies and joints; misspelt keys are none of it."""
    schema = scene_file.json_schema()
    assert check_against(schema, tomllib.loads(LEGS), schema) is None
    for old, new in (('at = "A"', 'att = "A"'), ("up =", "upp ="), ('direction = "y"', 'direction = "q"'),
                 ('to = [1, "A"]', ""), ("modes = 4", 'modes = "4"'), ("like = {", "like = { z = 1, ")):  # fmt: skip
        assert check_against(schema, tomllib.loads(LEGS.replace(old, new)), schema), new
