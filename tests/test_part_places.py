"""The name of a part as a place: of other parts, in questions to runs and models, in scene files, read from files."""

import re

import numpy as np
import pytest
from problems import ROD, ROD_FILE
from refusals import refused_files
from structures import beam_structure

import fembeam as fb
from contacts import KelvinVoigt
from fembeam.scene_file import SceneFileError

LAW = KelvinVoigt(1e5, 10.0)
STEEL = fb.Section.tube(2.0e11, 7900.0, 0.0603, 0.0525)
PIPE = fb.Frame.polyline({"A": (0, 0, 0), "B": (2, 0, 0), "C": (2, 0, 1.5), "D": (2, 1, 1.5)}, STEEL)
MASSES = [fb.LumpedMass("C", 12.0, name="valve"), fb.LumpedMass(("B-C", 0.75), 1.0, name="box")]
ENDS = [fb.Clamped("A"), fb.Clamped("D")]


def pipe(**parts):
    return fb.Scene(PIPE, ENDS, MASSES, base={"x": fb.Harmonic(1e-3, 50.0)}, damping=fb.ModalDamping(0.02), **parts)


def beam(**parts):
    given = {"masses": [fb.LumpedMass(0.4, 0.1, name="valve")], **parts}
    return fb.Scene(ROD, [fb.Clamped(0.0)], base=fb.Harmonic(1e-3, 100.0), damping=fb.ModalDamping(0.02), **given)


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Of the pipe and of a beam, and both read from files."""
    stops = [fb.Stop("box", LAW, gap=1e-4, direction=way) for way in ("x", "-x")]
    made = [one.reduce(2).simulate(0.05, 1e-3) for one in (pipe(stops=stops), beam(stops=[fb.Stop("valve", LAW)]))]
    return [*made, *(fb.load(one.save(tmp_path_factory.mktemp("runs") / "run")) for one in made)]


def test_parts_stand_at_parts():
    """The scene is the one with the places written out: of stops, second places, forces, on frames and beams."""
    tone = fb.Harmonic(1.0, 9.0)
    made = pipe(stops=[fb.Stop("box", LAW, direction="x", name="bumper"), fb.Stop("bumper", LAW, direction="y")],
                forces=[fb.PointForce("valve", tone, direction="y")],
                elements=[fb.Element("valve", LAW, direction="z", to="box")])  # fmt: skip
    assert [stop.z for stop in made.stops] == [("B-C", 0.75)] * 2
    assert made.forces[0].z == "C"
    assert (made.elements[0].z, made.elements[0].to) == ("C", ("B-C", 0.75))
    flat = beam(stops=[fb.Stop("valve", LAW)], springs=[fb.Spring("valve", 9.0)],
                elements=[fb.Element(0.2, LAW, to="valve")])  # fmt: skip
    assert (flat.stops[0].z, flat.springs[0].z, flat.elements[0].to) == (0.4, 0.4, 0.4)
    body = fb.Scene(ROD, [fb.Clamped(0.0)], [fb.LumpedMass(0.1, 1.0, name="post")])
    assert beam(stops=[fb.Stop(0.4, LAW, on=(1, "post"))], bodies=[body]).stops[0].on == (1, 0.1)


def test_joints_join_parts():
    """Frequencies are those of the joint at the places themselves."""
    arm = fb.Frame.polyline({"E": (0, 0, 0), "F": (0, 1, 0)}, STEEL)
    body = fb.Scene(arm, masses=[fb.LumpedMass("E", 0.5, name="flange")])
    found = [
        fb.Scene(PIPE, ENDS, MASSES, bodies=[body], joints=[fb.Joint(*at)]).reduce(3).omega
        for at in (("valve", (1, "flange")), ("C", (1, "E")))
    ]
    np.testing.assert_allclose(found[0], found[1], rtol=1e-10)


def test_a_body_s_own_name_goes_before_and_may_be_given_to_what_is_there():
    scene = fb.Scene(PIPE, ENDS, [fb.LumpedMass("C", 1.0, name="C")], stops=[fb.Stop("C", LAW, direction="x")])
    assert scene.stops[0].z == "C"
    assert scene.part_places == {}


@pytest.mark.filterwarnings("ignore:contacts of")
@pytest.mark.parametrize("which", range(4), ids=["pipe", "beam", "pipe read", "beam read"])
def test_runs_are_asked_by_the_name(runs, which):
    run, planar = runs[which], which % 2
    name, place = ("valve", 0.4) if planar else (("valve", "x"), ("C", "x"))
    for ask in ("displacement", "velocity", "acceleration"):
        np.testing.assert_array_equal(getattr(run, ask)(name), getattr(run, ask)(place))
        np.testing.assert_array_equal(getattr(run, ask)([name, place]), getattr(run, ask)([place, place]))
    same = (run.floor_spectrum(at, periods=[0.1, 0.2]).acceleration for at in (name, place))
    np.testing.assert_array_equal(*same)
    np.testing.assert_array_equal(run.motion("valve"), run.motion(0.4 if planar else "C"))
    inside = ("valve", 0.4) if planar else ("box", ("B-C", 0.75))
    np.testing.assert_array_equal(*(run.moment(at) for at in inside))
    np.testing.assert_array_equal(*(run.extremes("moment", [at]).highest for at in inside))
    if not planar:
        assert (run.section_forces("box")["T"] == run.section_forces(("B-C", 0.75))["T"]).all()
    assert np.ptp(run.displacement(name)) > 0.0


def test_models_are_asked_by_the_name():
    flat, omega = beam().reduce(2), [30.0, 60.0]
    for at in ("valve", 0.4):
        np.testing.assert_array_equal(flat.frequency_response(omega, at, "valve").values,
                                      flat.frequency_response(omega, 0.4, 0.4).values)  # fmt: skip
    np.testing.assert_array_equal(flat.equilibrium({"valve": 2.0}), flat.equilibrium({0.4: 2.0}))
    assert 0.4 in flat.scene.matrices(probes=["valve"]).nodes
    solid = pipe().reduce(2)
    asked = ("valve", "box"), ("C", ("B-C", 0.75))
    found = [solid.frequency_response(omega, (p, "z"), (q, "x")).values for p, q in asked]
    np.testing.assert_array_equal(*found)


def test_csv_and_figures_show_the_name(runs, tmp_path):
    runs[0].to_csv(tmp_path, places=["box", ("valve", "x")], quantities=["displacement", "section forces"][:1])
    head = (tmp_path / "histories.csv").read_text(encoding="utf-8").splitlines()[0]
    assert "displacement at valve, x [m]" in head
    assert "displacement at box, rz [rad]" in head
    runs[1].to_csv(tmp_path, places=["valve", 0.2], quantities=["displacement"])
    assert (tmp_path / "histories.csv").read_text(encoding="utf-8").startswith(
        "t [s],displacement at valve [m],displacement at 0.2 m [m]")  # fmt: skip
    assert fb.plot.time_history(runs[1], z="valve").get_suptitle().startswith("Displacement at valve")


FILE = (
    ROD_FILE
    + """[[masses]]
z = 0.4
mass = 0.1
name = "valve"
[[stops]]
z = "valve"
law = { kind = "hertz", stiffness = 1e7 }
[base]
kind = "harmonic"
amplitude = 1e-3
omega = 140.0
[simulate]
duration = 0.02
dt = 1e-3
places = ["valve", 0.2]
"""
)


def test_scene_files(file_of):
    assert file_of(FILE).scene.stops[0].z == 0.4


test_refused_in_files = refused_files(
    FILE,
    ('z = "valve"', 'z = "vlave"', r"'valve' is the nearest there is, got 'vlave' in stops\[0\]"),
    ('["valve"', '["vlave"', r"\[simulate\]: .*'valve' is the nearest there is, got 'vlave' in places"),
    ('z = "valve"', 'z = "0.4"', "z must be a number, got '0.4' in Stop"),
    error=SceneFileError,
)


@pytest.mark.parametrize(("make", "message"), [
    (lambda: pipe(stops=[fb.Stop("vlave", LAW, direction="x")]),
     "must be one of the body, or the name of a part; 'valve' is the nearest there is, got 'vlave' in stops[0]"),
    (lambda: fb.Scene(PIPE, ENDS, [fb.LumpedMass("C", 1.0, name="B")]),
     "a part named 'B' must be at the place of that name, got 'C' in Scene; move it there, or give it another name"),
    (lambda: fb.Scene(PIPE, ENDS, [fb.LumpedMass("b", 1.0, name="a"), fb.LumpedMass("a", 1.0, name="b")]),
     "parts must not be placed at each other, got ['a', 'b', 'a'] in Scene"),
    (lambda: beam(stops=[fb.Stop("vlave", LAW)]),
     "a place must be z in m, or the name of a part; 'valve' is the nearest there is, got 'vlave' in stops[0] (Stop)"),
    (lambda: beam(masses=[], stops=[fb.Stop("valve", LAW)]), "z must be a number on a Beam, which has no names"),
    (lambda: beam(masses=[]).reduce(1).simulate(0.01, 1e-3).displacement("tip"),
     "places of a beam must be numbers, for no part has a name, got 'tip' in Run; give m, or name the part there"),
    (lambda: beam(masses=[]).at([0.1, "tip"], "places"),
     "places of a beam must be numbers, for no part has a name, got 'tip' in places"),
    (lambda: beam().reduce(1).simulate(0.01, 1e-3).moment("vlave"),
     "'valve' is the nearest there is, got 'vlave' in Run"),
    (lambda: beam().reduce(1).frequency_response([1.0], "vlave"), "input must be a place z in m, or one of base"),
])  # fmt: skip
def test_refused(make, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        make()


def test_of_a_structure():
    scene = fb.Scene(beam_structure(), [fb.Clamped("root")], [fb.LumpedMass(5, 0.1, name="valve")],
                     stops=[fb.Stop("valve", LAW, direction="y")])  # fmt: skip
    assert scene.stops[0].z == 5
    model = scene.reduce(2)
    np.testing.assert_array_equal(model.phi(("valve", "y")), model.phi((5, "y")))
    with pytest.raises(ValueError, match="'valve' is the nearest there is, got 'valv' in Run"):
        model.phi(("valv", "y"))
