"""Outputs by place and quantity: from Python, of a scene file's run and of `export`; schema, check, messages."""

import json
import os

import numpy as np
import pytest
from test_cli import check_against

import fembeam as fb
from fembeam.cli import main
from fembeam.model.run_csv import UNITS, extremes_table, histories
from fembeam.results.files import prepared
from fembeam.scene_file import SceneFileError, json_schema

SCENE = """
[beam]
length = 0.26
section = { shape = "rectangle", E = 2.1e11, rho = 7800, width = 0.02, height = 0.002 }
[[supports]]
kind = "clamped"
z = 0
[[stops]]
z = 0.25
law = { kind = "hertz", stiffness = 2e8 }
[damping]
zeta = 0.02
[base]
kind = "harmonic"
amplitude = 1e-3
omega = 195.0
[reduce]
modes = 2
[simulate]
duration = 0.2
dt = 1e-3
discard = 0.1
"""
CHOSEN = """places = [0.13, 0.25]
quantities = ["stress", "absolute acceleration", "reactions"]
"""


def columns(path):
    """{name: values} of a CSV file."""
    head = path.read_text(encoding="utf-8").splitlines()[0].split(",")
    return dict(zip(head, np.loadtxt(path, delimiter=",", skiprows=1).T, strict=True))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("run")
    (made / "scene.toml").write_text(SCENE + CHOSEN, encoding="utf-8")
    assert main(["run", str(made / "scene.toml"), "--out", str(made), "--quiet"]) == 0
    return made


def test_a_scene_file_chooses_tables_and_histories(folder):
    run, found = fb.load(folder / "run.npz"), columns(folder / "histories.csv")
    reaction = run.reactions()[0]
    expected = {
        "stress at 0.25 m [N/m²]": run.stress(0.25),
        "absolute acceleration at 0.13 m [m/s²]": run.acceleration(0.13, absolute=True),
        "reaction force 0 (Clamped at z = 0 m) [N]": reaction.force,
        "reaction moment 0 (Clamped at z = 0 m) [N m]": reaction.moment,
    }
    assert len(found) == 1 + 2 * 2 + 2
    table = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["outputs"]
    late = run.t >= 0.1
    for name, values in expected.items():
        np.testing.assert_allclose(found[name], values, rtol=1e-11, atol=1e-11 * np.abs(values).max())
        row = table[name]
        assert row["std"] == pytest.approx(values[late].std())
        assert (row["min"], row["max"]) == (pytest.approx(values[late].min()), pytest.approx(values[late].max()))
        assert values[run.t == row["t_max"]] == pytest.approx(row["max"])
    text = (folder / "outputs.txt").read_text(encoding="utf-8")
    assert "stress at 0.25 m [N/m²]" in text
    assert "<tr><td>stress at 0.25 m [N/m²]</td><td>" in (folder / "report.html").read_text(encoding="utf-8")


def test_export_follows_the_file_unless_told(folder, tmp_path, capsys):
    assert main(["export", str(folder / "run.npz"), "--out", str(tmp_path), "--stride", "10"]) == 0
    whole = columns(folder / "histories.csv")
    for name, values in columns(tmp_path / "histories.csv").items():
        np.testing.assert_array_equal(values, whole[name][::10])
    told = ["--places", "0.2", "--quantities", "moment", "absolute velocity"]
    assert main(["export", str(folder / "run.npz"), "--out", str(tmp_path), *told]) == 0
    assert list(columns(tmp_path / "histories.csv")) == ["t [s]", "moment at 0.2 m [N m]",
                                                         "absolute velocity at 0.2 m [m/s]"]  # fmt: skip
    assert main(["export", str(folder / "run.npz"), "--out", str(tmp_path), "--quantities", "strain"]) == 2
    assert "quantities must be among displacement, velocity" in capsys.readouterr().err


def test_without_a_choice_nothing_is_added(tmp_path):
    (tmp_path / "scene.toml").write_text(SCENE, encoding="utf-8")
    assert main(["run", str(tmp_path / "scene.toml"), "--out", str(tmp_path), "--quiet"]) == 0
    assert not (tmp_path / "histories.csv").exists()
    assert "outputs" not in json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("simulate.places=[0.3]", r"\[simulate\] with --set simulate.places=\[0.3\]: z must lie on the beam"),
        ("simulate.places=0.1", "places must be a list of numbers, got 0.1"),
        ("simulate.quantities=['strain']", "quantities must be a list of 'displacement', .*got \\['strain'\\]"),
        ("beam.section={E=2e11,rho=7800,A=4e-5,I=1e-11}", "stress needs the outer fibre of sections; give fibre in m"),
    ],
)
def test_messages_before_anything_is_computed(file_of, change, message):
    with pytest.raises(SceneFileError, match=message):
        file_of((SCENE + CHOSEN).lstrip(), change)


def test_the_schema_knows_the_quantities():
    table = json_schema()["properties"]["simulate"]
    simple = {"duration": 1.0, "dt": 1e-3}
    assert check_against(table, simple | {"places": [0.1], "quantities": ["stress"]}, table) is None
    assert check_against(table, simple | {"quantities": ["strain"]}, table)
    assert table["properties"]["quantities"]["items"]["enum"] == list(UNITS)


def test_every_quantity_and_extremes_from_python(folder):
    run = fb.load(folder / "run.npz")
    found = histories(run, 1, [0.1], [name for name in UNITS if name != "section forces"])
    assert len(found) == 1 + 10 + 3 + 2
    np.testing.assert_array_equal(found["slope at 0.1 m [rad]"], run.slope(0.1))
    np.testing.assert_array_equal(found["force stop 0 [N]"], run.force())
    t = np.linspace(0.0, 1.0, 5)
    rows = extremes_table({"t [s]": t, "x": np.array([9.0, 1.0, -2.0, 4.0, 0.0])}, discard=0.2)
    assert rows["x"] == {"mean": 0.75, "std": pytest.approx(np.sqrt(4.6875)), "min": -2.0, "t_min": 0.5, "max": 4.0,
                         "t_max": 0.75}  # fmt: skip
    assert extremes_table({"t [s]": t, "x": t}, discard=2.0) == {}
    with pytest.raises(ValueError, match="z must lie on the beam"):
        run.to_csv(folder, places=[0.5])
    for options, says in (({"places": ["B"]}, "must be numbers"), ({"quantities": ["section forces"]}, "of a frame")):
        with pytest.raises(ValueError, match=says):
            run.to_csv(folder, **options)


def test_drafts_of_a_run_that_was_killed_are_removed(tmp_path):
    """Those of the last hour may be another run's."""
    old, new, other = (tmp_path / name for name in (".a.png.abcd1234.part", ".b.png.abcd1234.part", ".c.png.original"))
    for one in (old, new, other):
        one.touch()
    for one in (old, other):
        os.utime(one, (0.0, 0.0))
    assert prepared(tmp_path) == tmp_path
    assert sorted(tmp_path.iterdir()) == [new, other]
