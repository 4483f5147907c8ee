"""Frames in scene files: the scene made in Python, meshes, and what is refused with the table it stands in."""

import csv
from pathlib import Path

import numpy as np
import pytest
from refusals import refused_files
from test_frame_files import written

import fembeam as fb
from contacts import KelvinVoigt
from fembeam import scene_file
from fembeam.cli import main

STEEL = '{ shape = "rectangle", E = 2.1e11, rho = 7850.0, width = 0.05, height = 0.1 }'
PORTAL = f"""
[frame]
nodes = {{ A = [0, 0], B = [0, 3], C = [4, 3], D = [4, 0] }}
[[frame.members]]
nodes = ["A", "B", "C"]
section = {STEEL}
[[frame.members]]
nodes = ["D", "C"]
section = {STEEL}
release = "end rz"
axial_force = -100.0
[[supports]]
kind = "clamped"
at = "A"
[[supports]]
kind = "fixed"
at = "D"
dofs = ["x", "y"]
[[stops]]
at = ["B-C", 1.5]
direction = "-y"
gap = 2e-3
law = {{ kind = "kelvin_voigt", stiffness = 2e6, damping = 2e3 }}
[base.x]
kind = "harmonic"
amplitude = 1e-3
omega = 25.0
"""


@pytest.mark.parametrize(
    ("told", "section"),
    [
        ('shape = "rectangle", width = 0.1, height = 0.2', fb.Section.rectangle(2.1e11, 7850.0, 0.1, 0.2, shear=5 / 6)),
        ('shape = "circle", diameter = 0.1', fb.Section.circle(2.1e11, 7850.0, 0.1, shear=5 / 6)),
        ('shape = "tube", outer = 0.1, inner = 0.08', fb.Section.tube(2.1e11, 7850.0, 0.1, 0.08, shear=5 / 6)),
    ],
)
def test_sections_of_any_shape_deform_in_shear(tmp_path, told, section):
    """Only shape = "general" knew the key."""
    path = tmp_path / "sheared.toml"
    member = f'nodes = ["A", "B"], section = {{ {told}, E = 2.1e11, rho = 7850.0, shear = {5 / 6} }}'
    path.write_text(f"frame = {{ nodes = {{ A = [0, 0], B = [0, 1] }}, members = [{{ {member} }}] }}\n")
    assert scene_file.read(path).scene.beam.members[0].section == section
    assert section.shear == (5 / 6, 5 / 6)


def test_the_same_as_in_python(file_of):
    """Members along chains, supports, a stop within a member, motion along one axis."""
    steel = fb.Section.rectangle(2.1e11, 7850.0, width=0.05, height=0.1)
    members = [fb.Member("A", "B", steel), fb.Member("B", "C", steel),
               fb.Member("D", "C", steel, release="end rz", axial_force=-100.0)]  # fmt: skip
    frame = fb.Frame({"A": (0, 0), "B": (0, 3), "C": (4, 3), "D": (4, 0)}, members)
    scene = fb.Scene(
        frame,
        [fb.Clamped("A"), fb.Fixed("D", "x", "y")],
        stops=[fb.Stop(("B-C", 1.5), KelvinVoigt(2e6, 2e3), gap=2e-3, direction="-y")],
        base={"x": fb.Harmonic(1e-3, 25.0)},
    )
    found = file_of(PORTAL).scene
    assert repr(found) == repr(scene)
    assert found.beam == frame


def test_a_mesh(tmp_path, file_of):
    """Groups of lines with their sections."""
    written(tmp_path / "l.msh")
    text = f"""
[frame]
mesh = "l.msh"
plane = false
up = "z"
sections = {{ run = {STEEL}, drop = {STEEL} }}
[[supports]]
kind = "clamped"
at = "foot"
"""
    scene = file_of(text).scene
    assert [one.name for one in scene.beam.members] == ["run", "drop"]
    assert len(scene.reduce(modes=2, elements=6).omega) == 2


def test_the_pipe_of_the_examples():
    """The file of the course has the pipe of its script."""
    scene = scene_file.read(Path(__file__).parent.parent / "examples" / "pipe.toml").scene
    assert scene.beam.components == ("x", "y", "z", "rx", "ry", "rz")
    assert list(scene.motions) == ["x", "y", "z"]


# What is wrong, in which table.
test_refused = refused_files(
    PORTAL,
    ("nodes = { A = [0, 0]", "nods = { A = [0, 0]", r"\[frame\].*nods"),
    ('nodes = ["D", "C"]', 'nodes = ["D", "E"]', r"\[frame\]: member 'D-E' must join nodes of the frame; 'D' is"),
    ('nodes = ["D", "C"]', 'nodes = ["D"]', r"\[\[frame.members\]\] number 2.*a chain of more"),
    (f"section = {STEEL}", 'section = "steel"', r"\[\[frame.members\]\] number 1 section: must be a table"),
    ('release = "end rz"', 'release = "rz"', r"\[\[frame.members\]\] number 2.*release must be"),
    ('release = "end rz"', 'relase = "end rz"', r"number 2.*relase"),
    ('release = "end rz"', "offset = [[0, 0.1], [0]]", r"number 2: offset must be two vectors of finite numbers"),
    ('at = "A"', 'at = "F"', "must be a node of the frame"),
    ("[base.x]", "[base]\ny = 1e-3\n[base.x]", r"\[base.y\]: must be a table \{ kind = .* got 0.001"),
    ('at = "A"', "at = \"A\"\nmotion = { x = { kind = \"harmonic\", amplitude = 1, omega = 1e300 } }",
     r"omega \(rad/s\) must be at most 1e\+50 in size, got 1e\+300"),
    ("[frame]", "[beam]\nlength = 1.0\n[frame]", r"one of the tables \[beam\] and \[frame\]"),
)  # fmt: skip


def test_the_offset_of_a_mass_in_the_plane_has_two_numbers(file_of):
    """A file had to add the third, a scene in Python had not."""
    mass = '[[masses]]\nat = "C"\nmass = 5.0\noffset = [0.1, 0.2]\n'
    assert file_of(PORTAL + mass).scene.masses == (fb.LumpedMass("C", 5.0, offset=(0.1, 0.2)),)


OUTPUTS = """
[reduce]
modes = 3
[simulate]
duration = 0.2
dt = 1e-3
places = [["B-C", 1.5], ["C", "x"]]
quantities = ["displacement", "moment"]
"""


def heads(folder):
    """Names of the columns of its histories."""
    return next(csv.reader((folder / "histories.csv").open(encoding="utf-8")))


def test_section_forces_of_a_file(tmp_path):
    """Section forces on members, motion along directions, or of a place alone along all; `export` takes places too."""
    path, out = tmp_path / "portal.toml", tmp_path / "out"
    path.write_text(PORTAL + OUTPUTS.replace('["C", "x"]', '["B-C", 4.0]'), encoding="utf-8")
    assert main(["run", str(path), "--out", str(out), "--quiet"]) == 0
    moved = [f"displacement at B-C + 1.5 m, {c} [{unit}]" for c, unit in (("x", "m"), ("y", "m"), ("rz", "rad"))]
    assert [name for name in heads(out) if "1.5 m" in name and "at" in name] == ["moment at B-C + 1.5 m [N m]", *moved]
    run = fb.load(out / "run.npz")
    table = np.loadtxt(out / "histories.csv", delimiter=",", skiprows=1)
    column = heads(out).index("moment at B-C + 1.5 m [N m]")
    assert np.allclose(table[:, column], run.moment(("B-C", 1.5)), rtol=1e-11, atol=1e-9)
    asked = ["--places", '["B-C", 1.5]', "--quantities", "section forces"]
    assert main(["export", str(out / "run.npz"), "--out", str(tmp_path), *asked]) == 0
    assert heads(tmp_path) == ["t [s]", *(f"{name} at B-C + 1.5 m [{unit}]" for name, unit in
                                          (("N", "N"), ("Q", "N"), ("M", "N m")))]  # fmt: skip
    asked = ["--places", "C", '["B", "-x"]', "--quantities", "velocity"]
    assert main(["export", str(out / "run.npz"), "--out", str(tmp_path), *asked]) == 0
    assert [name.split(" [")[0] for name in heads(tmp_path)[1:]] == [
        *(f"velocity at C, {c}" for c in ("x", "y", "rz")),
        "velocity at B, -x",
    ]


test_outputs_that_are_not_there = refused_files(
    PORTAL + OUTPUTS,
    ('["C", "x"]', '["C", "x"], "E"', "places; use one of the names"),
    ('["C", "x"]', '["C", "q"]', "direction must be one of x, y, z, rx, ry, rz, or a vector, got 'q' in places, 'C'"),
    ('["C", "x"]', '["C", "x"], "B"', r"must be asked for on a member of a frame, got 'C' in places"),
    ('places = [["B-C", 1.5], ["C", "x"]]', "", r"section forces need places, got \['moment'\] in simulate"),
    ('"moment"', '"slope"', "slope is of a Beam"),
)
