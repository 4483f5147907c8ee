"""Names of parts: given or made, and where they are used: logs, tables, files, figures, parameters, messages."""

import csv
import json
import pickle
import re
from dataclasses import replace

import numpy as np
import pytest
from problems import ROD_FILE

import fembeam as fb
import solvers
from contacts import Hertz, Jenkins, KelvinVoigt, Polynomial
from fembeam.plot.axis_names import axis_name
from fembeam.results import files, html_page
from fembeam.scene import keys_of, path_of, value_of, with_value
from fembeam.scene_file import SceneFileError, json_schema

STEEL = fb.Section.circle(E=2.1e11, rho=7800.0, diameter=0.01)
TONE = fb.Harmonic(1.0, 50.0)
EACH = [
    fb.Clamped(0.0), fb.Pinned(0.1), fb.Guided(0.2), fb.LumpedMass(0.3, 1.0), fb.Spring(0.3, 1e3),
    fb.Dashpot(0.3, 1.0), fb.Stop(0.3, Hertz(1e8)), fb.Element(0.3, KelvinVoigt(1e3, 1.0)), fb.PointForce(0.3, TONE),
    fb.PointMoment(0.3, TONE), fb.Impactor(0.3, 0.1, -1.0, Hertz(1e8)),
]  # fmt: skip


def cantilever(**parts):
    return fb.Scene(fb.Beam(0.5, STEEL), [fb.Clamped(0.0)], **{"damping": fb.ModalDamping(0.02), **parts})


@pytest.fixture(scope="module")
def run():
    """A named stop, one without a name, a named slider, a named impactor on both sides, a named foot of the beam."""
    scene = fb.Scene(
        fb.Beam(0.5, STEEL), [fb.Clamped(0.0, name="wall")], damping=fb.ModalDamping(0.02),
        stops=[fb.Stop(0.5, Hertz(1e7), name="valve, main"), fb.Stop(0.3, Hertz(1e7), gap=1e-5, side="above")],
        elements=[fb.Element(0.4, Jenkins(1e4, 0.5), name="damper")], base=fb.Harmonic(2e-3, 140.0),
        impactors=[fb.Impactor(0.2, 0.05, 0.0, Hertz(1e7), gap=1e-4, side="both", stiffness=10.0, name="ball")],
    )  # fmt: skip
    return scene.reduce(2).simulate(0.5, 1e-3)


NAMES = ["valve, main", "stop at 0.3 m, above", "damper", "ball, below", "ball, above"]


@pytest.mark.parametrize("part", EACH, ids=lambda part: type(part).__name__)
def test_every_part_takes_a_name(part):
    named = replace(part, name="this one")
    assert named.name == named.label == "this one"
    assert named != part
    assert repr(named) == f"{repr(part)[:-1]}, name='this one')"
    assert "name" not in repr(part)
    assert pickle.loads(pickle.dumps(named)) == named
    with pytest.raises(TypeError):
        type(part)(0.1, *[1.0] * 12)  # by keyword only
    for wrong in ("", "  ", 3, "two\nlines"):
        message = f"name must be text of one line, not empty, got {wrong!r} in {type(part).__name__} at z = {part.z}"
        with pytest.raises(ValueError, match=re.escape(message)):
            replace(part, name=wrong)


def test_made_names_say_what_and_where():
    assert [part.label for part in EACH] == [
        "clamp at 0 m", "pin at 0.1 m", "guide at 0.2 m", "mass at 0.3 m", "spring at 0.3 m", "dashpot at 0.3 m",
        "stop at 0.3 m, below", "element at 0.3 m", "force at 0.3 m", "moment at 0.3 m", "impactor at 0.3 m, above",
    ]  # fmt: skip
    law = KelvinVoigt(1e3, 1.0)
    assert fb.Stop(3.0, law).label == "stop at 3 m, below"
    assert fb.Stop(0.0, law, of="rotation", side="above").label == "stop of rotation at 0 m, above"
    assert fb.Stop(0.3, law, on=(1, 0.2)).label == "stop at 0.3 m, below, on 0.2 m of beam 1"
    assert fb.Element(0.3, law, to=0.1).label == "element from 0.3 m to 0.1 m"
    assert fb.Element(0.3, law, of="rotation").label == "element of rotation at 0.3 m"
    assert fb.Impactor(0.3, 0.1, 1.0, law).label == "impactor at 0.3 m, below"


def test_made_names_of_contacts_differ():
    law, body = Polynomial([0.0, 0.0, 1e3]), cantilever(stops=[fb.Stop(0.5, Hertz(1e7))])
    stop = fb.Stop(0.5, Hertz(1e7), on=(1, 0.5))
    given = fb.Element(0.1, law, name="element at 0.3 m (2)")  # taken, though not made
    scene = cantilever(elements=[fb.Element(0.3, law), fb.Element(0.3, law), given], bodies=[body], stops=[stop])
    assert [row.name for row in scene.reduce(1).contact_rows] == [
        "stop at 0.5 m, below, on 0.5 m of beam 1", "element at 0.3 m", "element at 0.3 m (3)", "element at 0.3 m (2)",
        "stop at 0.5 m of beam 1, below",
    ]  # fmt: skip


def test_files_tell_a_stop_from_one_that_is_called_as_it_would_be(tmp_path):
    """The made name of the second column took the place of the first one, whose history was lost."""
    stops = [fb.Stop(0.5, Hertz(1e7), name="stop 1"), fb.Stop(0.4, Hertz(1e7))]
    run = cantilever(stops=stops).reduce(modes=1).simulate(1e-3, 1e-3)
    assert [run.key(i) for i in range(2)] == ["stop 1", "stop 1 (2)"] == list(keys_of(run.model.contact_rows))
    histories, _ = run.to_csv(tmp_path, quantities=["force"])
    head = next(csv.reader(histories.open(encoding="utf-8")))
    assert head[-2:] == ["force stop 1 [N]", "force stop 1 (2) [N]"]


def test_names_are_unique_in_a_scene_and_its_bodies():
    law = Hertz(1e7)
    message = "names must be unique, got 'tip' in masses[0] and stops[1] of Scene; give each part its own, or none"
    with pytest.raises(ValueError, match=re.escape(message)):
        cantilever(masses=[fb.LumpedMass(0.5, 1.0, name="tip")],
                   stops=[fb.Stop(0.5, law), fb.Stop(0.4, law, name="tip")])  # fmt: skip
    body = cantilever(stops=[fb.Stop(0.5, law, name="valve")])
    with pytest.raises(ValueError, match=r"got 'valve' in stops\[0\] and bodies\[0\].stops\[0\] of Scene"):
        cantilever(stops=[fb.Stop(0.5, law, on=(1, 0.5), name="valve")], bodies=[body])


def test_the_log_has_names(run):
    log = run.contacts
    assert run.names == tuple(NAMES)
    assert {0, 1, 3, 4} >= set(log.stop.tolist()) >= {0, 1}
    assert log.name.tolist() == [NAMES[stop] for stop in log.stop]
    assert list(log.named_arrays())[:5] == ["stop", "name", "z", "side", "t_in"]
    assert set(run.transitions.name) == {"damper"}
    assert run.losses.names == run.names


def test_data_frames_have_names(run):
    pytest.importorskip("pandas")
    assert run.contacts.to_dataframe()["name"].tolist() == run.contacts.name.tolist()
    assert run.losses.to_dataframe()["name"].tolist() == NAMES
    assert "force valve, main [N]" in run.to_dataframe()


def test_contacts_are_found_by_name(run):
    np.testing.assert_array_equal(run.force("valve, main"), run.force(0))
    np.testing.assert_array_equal(run.force("damper", mean=True), run.force(2, mean=True))
    np.testing.assert_array_equal(run.indentation("stop at 0.3 m, above"), run.indentation(1))
    np.testing.assert_array_equal(run.indentation_rate("ball, above"), run.indentation_rate(4))
    message = "no contact has this name, got 'valve' in Run; the nearest is 'valve, main'"
    with pytest.raises(ValueError, match=message):
        run.force("valve")


def test_names_in_csv(run, tmp_path):
    """Text with a comma stands in quotes, numbers keep twelve digits, the rows are those of the log."""
    histories, contacts = run.to_csv(tmp_path, quantities=["force", "work", "reactions"])
    with histories.open(newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    assert head[:4] == ["t [s]", "force valve, main [N]", "work valve, main [J]", "force stop 1 [N]"]
    assert head[-2:] == ["reaction force wall [N]", "reaction moment wall [N m]"]
    assert {len(row) for row in rows} == {len(head)}
    assert [float(row[1]) for row in rows] == pytest.approx(run.force(0), rel=1e-11)
    with contacts.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["name"] for row in rows] == run.contacts.name.tolist()
    assert list(rows[0])[:2] == ["stop", "name"]
    assert [float(row["t_in [s]"]) for row in rows] == pytest.approx(run.contacts.t_in, rel=1e-11)


def test_names_are_saved(run, tmp_path):
    again = fb.load(run.save(tmp_path / "run"))
    assert again.names == run.names
    assert [again.key(i) for i in range(5)] == ["valve, main", "stop 1", "damper", "ball, below", "ball, above"]
    assert again.contacts.name.tolist() == run.contacts.name.tolist()
    assert again.transitions.name.tolist() == run.transitions.name.tolist()
    np.testing.assert_array_equal(again.force("damper"), run.force("damper"))
    assert again.reactions()[0].name == "wall"
    assert str(again) == str(run)


def test_names_in_tables_and_pages(run, tmp_path):
    assert re.search(r"^valve, main +\d+ ", str(run), re.M)
    assert "indentation, stop at 0.3 m, above" in str(run)
    found = files.summary(run)
    assert [row["name"] for row in found["contacts"]] == [NAMES[i] for i in (0, 1, 3, 4)]
    assert {"indentation, valve, main", "indentation, stop 1"} <= set(found["moments"])
    assert re.search(r"^valve, main +\d+ ", files.text(found), re.M)
    (tmp_path / "summary.json").write_text(json.dumps(found))
    assert "<th>valve, main</th>" in html_page.write_page(tmp_path).read_text(encoding="utf-8")


def test_names_in_figures(run):
    figure = fb.plot.time_history(run, window=(0.0, 0.5))
    assert {text.get_text() for text in figure.axes[1].get_legend().get_texts()} <= set(NAMES)
    assert "contacts of valve, main shaded" in fb.plot.time_history(run, z=0.5, window=(0.0, 0.5)).get_suptitle()


def test_names_of_parameters():
    stops = [fb.Stop(0.5, Hertz(1e7)), fb.Stop(0.4, Hertz(1e7), gap=2e-3, name="valve 3 [old]")]
    scene = cantilever(stops=stops, springs=[fb.Spring(0.2, 7.0, name="rod")])
    assert path_of(scene, "stops[valve 3 [old]].gap") == "stops[1].gap"
    assert value_of(scene, "stops[valve 3 [old]].law.stiffness") == 1e7
    assert with_value(scene, "springs[rod].stiffness", 8.0).springs[0] == fb.Spring(0.2, 8.0, name="rod")
    assert axis_name("stops[1].gap", scene) == "gap of valve 3 [old] / m"
    assert axis_name("springs[0].stiffness", scene) == "stiffness of rod / N/m"
    with pytest.raises(ValueError, match="no such parameter"):
        path_of(scene, "stops[valve].gap")
    holes = cantilever(stops=[fb.Stop(z, Hertz(1e7), name=name) for z, name in ((0.3, "1"), (0.4, "2"), (0.5, "3"))])
    for number, z in enumerate((0.3, 0.4, 0.5)):  # stops[1] was the one called so, as stops[0]
        assert value_of(holes, f"stops[{number}].z") == z
        assert with_value(holes, f"stops[{number}].gap", 1e-3).stops[number].gap == 1e-3
    assert path_of(holes, "stops[3].z") == "stops[2].z"  # no number of a stop, but a name
    body = cantilever(stops=[fb.Stop(0.5, Hertz(1e7), name="far")])
    assert path_of(cantilever(bodies=[body]), "bodies[0].stops[far].gap") == "bodies[0].stops[0].gap"


FILE = (
    ROD_FILE
    + """name = "wall"
[[stops]]
z = 0.5
law = { kind = "hertz", stiffness = 1e7 }
name = "valve"
[damping]
zeta = 0.02
[base]
kind = "harmonic"
amplitude = 1e-3
omega = 140.0
[simulate]
duration = 0.2
dt = 1e-3
"""
)


def test_names_in_scene_files(tmp_path, file_of):
    file = file_of(FILE, "stops[valve].gap=1e-4")
    assert file.scene.stops[0] == fb.Stop(0.5, Hertz(1e7), gap=1e-4, name="valve")
    assert file.scene.supports[0].name == "wall"
    assert file_of(FILE, "stops[0].name=exhaust").scene.stops[0].name == "exhaust"
    again = fb.load(replace(file.model().simulate(0.05, 1e-3), source=file.source).save(tmp_path / "run"))
    assert again.scene_file.scene == file.scene
    second = '[[stops]]\nz = 0.4\nlaw = { kind = "hertz", stiffness = 1e7 }\nname = "0"\n[damping]'
    numbered = file_of(FILE.replace("[damping]", second), "stops[0].gap=1e-4").scene
    assert [stop.gap for stop in numbered.stops] == [1e-4, 0.0]
    for change, message in (
        ("stops[valv].gap=1", "stops has 1 item, counted from 0, none of the name 'valv'"),
        ("stops[0].name=3", r"\[\[stops\]\] number 1: name must be text, got 3"),
        ("stops[0].name=wall", r"names must be unique, got 'wall' in supports\[0\] and stops\[0\] of Scene"),
        ("stops[0].name=''", r"name must be text of one line, not empty"),
    ):
        with pytest.raises(SceneFileError, match=message):
            file_of(FILE, change)
    assert json_schema()["properties"]["stops"]["items"]["anyOf"][0]["properties"]["name"] == {"type": "string"}


def test_names_of_matrices_of_ones_own():
    """Contacts of `solvers` have names as well, else numbers."""
    ball = solvers.System([[1.0]], [[0.0]], [[0.0]], [solvers.Contact([1.0], Hertz(1e6), name="floor"),
                                                      solvers.Contact([-1.0], Hertz(1e6), gap=0.5)])  # fmt: skip
    log = solvers.integrate(ball, [1e-2], [-1.0], duration=0.8).contacts
    assert log.stop.tolist() == [0, 1]
    assert log.name.tolist() == ["floor", "stop 1"]


def test_names_in_an_orbit():
    model = cantilever(stops=[fb.Stop(0.5, KelvinVoigt(1e5, 10.0), gap=1e-4, name="valve")],
                       base=fb.Harmonic(1e-3, 100.0)).reduce(1)  # fmt: skip
    orbit = model.orbit(1)
    assert set(orbit.contacts.name) == {"valve"}
    assert "\nvalve " in str(orbit)


def test_messages_use_names():
    with pytest.raises(ValueError, match=r"gap must be finite, got nan in Stop 'valve' at z = 0.5"):
        fb.Stop(0.5, Hertz(1e7), gap=float("nan"), name="valve")
    with pytest.raises(ValueError, match=r"in stops\[0\] \(Stop 'valve'\) of Scene"):
        cantilever(stops=[fb.Stop(0.7, Hertz(1e7), name="valve")])
    said = list(cantilever(stops=[fb.Stop(0.5, Hertz(1e7), gap=0.3, name="valve")]).check())
    assert "stops[0] 'valve': a gap of 0.3 m on a beam of 0.5 m: is it in mm?" in said
