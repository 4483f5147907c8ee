"""Floor spectra at several places: those of the run, in closed form, in scene files, on the command line."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from refusals import refused_files

import fembeam as fb
from fembeam.cli import main
from fembeam.scene_file import SceneFileError, json_schema, read

EXAMPLES = Path(__file__).parent.parent / "examples"
PERIODS = np.geomspace(0.02, 0.2, 5)
FILE = """
[frame]
nodes = { A = [0, 0, 0], B = [0.5, 0, 0], C = [0.5, 0.3, 0] }
[[frame.members]]
nodes = ["A", "B", "C"]
section = { shape = "circle", E = 2.1e11, rho = 7800, diameter = 0.01 }
[[supports]]
kind = "clamped"
at = "A"
[[masses]]
name = "valve"
at = "C"
mass = 0.2
[base.z]
kind = "harmonic"
amplitude = 1e-3
omega = 140.0
[damping]
zeta = 0.02
[floor_spectra]
places = ["valve", ["B", "z"]]
periods = [0.02, 0.2]
points = 5
zeta = [0.02, 0.05]
duration = 0.3
dt = 1e-3
"""


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("scene") / "scene.toml"
    path.write_text(FILE)
    return read(path)


@pytest.fixture(scope="module")
def run(file):
    return file.model().simulate(0.3, 1e-3)


def test_each_is_that_of_the_run(run):
    found = fb.study.floor_spectra(run, ["valve", ("B", "-z")], periods=PERIODS, zeta=0.03)
    assert list(found.spectra) == ["valve, x", "valve, y", "valve, z", "B, -z"]
    for name, at in (("valve, y", ("C", "y")), ("B, -z", ("B", "z"))):
        own = run.floor_spectrum(at, periods=PERIODS, zeta=0.03)
        np.testing.assert_array_equal(found[name].acceleration, own.acceleration)
        np.testing.assert_array_equal(found[name].displacement, own.displacement)


def test_a_rigid_floor_moves_as_the_frame():
    """A clamped place has the frame's spectrum: of a tone from rest the steady amplification, or more."""
    scene = fb.Scene(fb.Beam(0.1, fb.Section.circle(2.1e11, 7800.0, 0.05)), [fb.Clamped(0.0, name="wall")],
                     base=fb.Harmonic(1e-3, 60.0))  # fmt: skip
    run = scene.reduce(1).simulate(6.0, 1e-3)
    zeta, omega = 0.2, np.array([30.0, 60.0, 200.0])
    found = fb.study.floor_spectra(run, ["wall"], omega, zeta)["wall"].displacement[0]
    r = 60.0 / omega
    steady = 1e-3 * r**2 / np.hypot(1 - r**2, 2 * zeta * r)
    assert np.all(found >= (1 - 1e-3) * steady)
    assert found[1] == pytest.approx(steady[1], rel=1e-3)


def test_table_and_print(run, tmp_path):
    found = fb.study.floor_spectra(run, [("valve", "x"), ("B", "z")], periods=PERIODS, zeta=[0.02, 0.05])
    rows = found.table()
    assert len(rows) == 2 * 2 * len(PERIODS)
    one = next(row for row in rows if row["place"] == "B, z" and row["zeta"] == 0.05)
    assert one["acceleration"] == found["B, z"].acceleration[1, 0]
    assert one["period"] == pytest.approx(PERIODS[0])
    largest = found["valve, x"].acceleration[0].max()
    assert re.search(rf"^valve, x +0.02 +{largest:.5g} ", str(found), re.M)
    found.save(tmp_path / "floor.csv")
    assert (
        (tmp_path / "floor.csv")
        .read_text(encoding="utf-8")
        .startswith(
            "place,zeta,period [s],omega [rad/s],acceleration [m/s²],pseudo_acceleration [m/s²],velocity [m/s],"
        )
    )


def test_rotations_have_units_of_their_own(run, tmp_path):
    found = fb.study.floor_spectra(run, [("valve", "x"), ("B", "ry")], periods=PERIODS)
    assert "largest acceleration / m/s² or rad/s²" in str(found)
    turned = fb.study.floor_spectra(run, [("B", "ry")], periods=PERIODS)
    turned.save(tmp_path / "turned.csv")
    head = (tmp_path / "turned.csv").read_text(encoding="utf-8").splitlines()[0]
    assert head.endswith("acceleration [rad/s²],pseudo_acceleration [rad/s²],velocity [rad/s],displacement [rad]")
    acceleration, rotation = (axis.get_ylabel() for axis in turned.figure().axes)
    assert acceleration == "largest acceleration / rad s⁻²"
    assert rotation.startswith("largest rotation / ")
    assert rotation.endswith("rad")


def test_a_scene_file_gives_the_numbers_of_python(file, run, tmp_path):
    found = file.studies["floor_spectra"].run(file, tmp_path)
    assert list(found.spectra) == ["valve, x", "valve, y", "valve, z", "B, z"]
    for name, at in (("valve, z", ("valve", "z")), ("B, z", ("B", "z"))):
        own = run.floor_spectrum(at, periods=PERIODS, zeta=[0.02, 0.05])
        np.testing.assert_array_equal(found[name].acceleration, own.acceleration)


def test_on_the_command_line(tmp_path):
    (tmp_path / "scene.toml").write_text(FILE)
    assert main(["run", str(tmp_path / "scene.toml"), "--out", str(tmp_path / "results"), "--quiet"]) == 0
    written = {path.name for path in (tmp_path / "results").iterdir()}
    assert {f"floor_spectra.{kind}" for kind in ("txt", "json", "csv", "png")} <= written
    spectra = json.loads((tmp_path / "results" / "floor_spectra.json").read_text())["spectra"]
    assert len(spectra["valve, x"]["acceleration"]) == 2


test_refused_before_computing = refused_files(
    FILE,
    ('"valve", [', '"vlave", [', "'valve' is the nearest there is, got 'vlave' in places"),
    ('["B", "z"]', '["B", "w"]', "direction must be one of x, y, z"),
    ("periods = [0.02, 0.2]", "periods = [0.0, 0.2]", "periods must be positive and finite"),
    ("periods = [0.02, 0.2]", "", "give omega or periods, one of them"),
    ("points = 5", "points = 1", "points must be 2 to 100000, between two periods"),
    ("periods = [0.02, 0.2]", "periods = [0.02, 0.1, 0.2]", "points must be 2 to 100000, between two periods"),
    ("zeta = [0.02, 0.05]", "zeta = 2", "zeta must be at least 0 and below 1"),
    ("dt = 1e-3", "dt = 1.0", "dt must be below the duration, got 1.0"),
    ('places = ["valve", ["B", "z"]]', "places = []", "places must be one or more"),
    ("dt = 1e-3", "", "the key 'dt' is missing"),
    error=SceneFileError,
)  # fmt: skip


def test_a_direction_that_the_place_lacks_is_refused_before_computing(file_of):
    flat = FILE.replace("[0, 0, 0]", "[0, 0]").replace("[0.5, 0, 0]", "[0.5, 0]").replace("[0.5, 0.3, 0]", "[0.5, 0.3]")
    with pytest.raises(SceneFileError, match="the place 'B' must move along z; it has x, y, rz"):
        file_of(flat.replace("[base.z]", "[base.y]"))


def test_refused_in_python(run):
    with pytest.raises(ValueError, match="places must be a list of one or more, got 'valve' in floor_spectra"):
        fb.study.floor_spectra(run, "valve", periods=PERIODS)
    with pytest.raises(ValueError, match="places must be a list of one or more"):
        fb.study.floor_spectra(run, [], periods=PERIODS)
    with pytest.raises(ValueError, match=r"places must be a list of one or more, got 0\.1"):
        fb.study.floor_spectra(run, 0.1, periods=PERIODS)


def test_the_schema_knows_places():
    places = json_schema()["properties"]["floor_spectra"]["properties"]["places"]
    assert {"string", "number", "array"} == {one["type"] for one in places["items"]["anyOf"]}


def test_the_pipe_is_one_scene_in_both_forms():
    """pipe.py up to its model, and pipe.toml; run in the same way."""
    script, file = EXAMPLES / "pipe.py", read(EXAMPLES / "pipe.toml")
    head, run = script.read_text(encoding="utf-8").split("\nmodel = ")
    exec(head, python := {"__file__": str(script), "__name__": "pipe"})
    study = file.studies["floor_spectra"]
    assert repr(file.scene) == repr(python["scene"])
    assert run.startswith("scene.reduce(modes=10, residual=True)\nrun = model.simulate(duration=8.0, dt=2.5e-4)")
    assert file.reduce == {"modes": 10, "residual": True}
    assert (study.duration, study.dt, study.points, study.zeta) == (8.0, 2.5e-4, 50, 0.02)


def test_oscillators_beyond_the_floats_are_refused():
    t = np.linspace(0.0, 4.0, 401)
    for given, message in (
        ({"periods": [1e-300, 1.0]}, "periods must be positive and finite, at least 1e-50, got"),
        ({"omega": [1e-300, 1.0]}, "omega must be positive and finite, at least 1e-50, got"),
        ({"omega": [1e-20, 1.0]}, r"omega must be at least 1e-08 rad/s, 1e-10 / step, got 1e-20 in response_spectrum"),
        ({"periods": [1e20]}, "omega must be at least 1e-08 rad/s"),
    ):
        with pytest.raises(ValueError, match=message):
            fb.response_spectrum(t, np.sin(9.0 * t), **given)
    slow = fb.response_spectrum(t, np.sin(9.0 * t), omega=[1e-8, 1e-6], zeta=0.0).displacement[0]
    np.testing.assert_allclose(slow, (36.0 - np.sin(36.0)) / 81.0, rtol=1e-3)  # ∬ sin 9t; straight lines: (9 h)²/12
