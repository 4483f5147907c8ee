"""What objects say of themselves: a line as repr, tables in print and in notebooks, tables of pandas and xarray."""

import csv
import dataclasses
import io
import json
import logging
import re
import subprocess
import sys

import numpy as np
import pytest
from problems import ROD

import contacts
import fembeam as fb
import solvers
from contacts import Hertz, Tabulated, bounce, identify
from fembeam import study
from fembeam.results.files import json_text
from fembeam.study.result import Result
from fembeam.support import Printed, counting, html_table


@pytest.fixture(scope="module")
def things():
    """One of everything that holds arrays, by name."""
    beam = ROD
    stops, drive, damping = [fb.Stop(0.5, Hertz(1e9))], fb.Harmonic(1e-3, 150.0), fb.ModalDamping(0.05)
    scene = fb.Scene(beam, [fb.Clamped(0.0)], stops=stops, base=drive, damping=damping)
    model, bare = scene.reduce(modes=2), dataclasses.replace(scene, stops=[], base=fb.BandNoise(1e-5, (0.0, 400.0), 1))
    noisy, hit = bare.reduce(modes=1), bounce(Hertz(1e9), 0.3, 0.02)
    run, orbit = model.simulate(0.3, 1e-3), model.orbit()
    branch = model.branch("amplitude", (0.9e-3, 1e-3)).run()
    tip = lambda model: {"tip": model.simulate(2.0, 1e-2).displacement(0.5).std()}  # noqa: E731
    found = identify(hit.delta, hit.delta_dot, hit.force)
    rough = [solvers.RK4(1e-5), solvers.Exponential(1e-6)]
    return {
        **{"model": model, "run": run, "orbit": orbit, "branch": branch, "scene": scene, "hit": hit, "law": found},
        **{"matrices": scene.matrices(20), "basis": model.basis, "shapes": model.shapes, "system": model.system},
        **{"found orbit": orbit.found, "found branch": branch.found, "arm": branch.found.walks[0]},
        **{"family": branch.family, "extremes": run.extremes(), "forces": model.section_forces[0]},
        **{"collision": found.collisions[0], "psd": fb.psd(run.displacement(0.5), 1e-3)},
        **{"pdf": fb.pdf(run.displacement(0.5)), "tones": fb.Multisine(np.ones(900), np.arange(900.0))},
        **{"table": Tabulated(np.linspace(0, 1e-3, 90), np.linspace(0, 1, 90)), "log": run.contacts},
        **{"attractor": model.attractors(starts=1)[0], "ensemble": study.ensemble(noisy, 3, tip)},
        "response": (response := study.stationary(noisy, 60.0, 2e-3)),
        "signal": response["tip u"],
        "bifurcation": study.bifurcation(model, "omega", [150.0, 151.0], settle=np.int64(5), keep=3),
        "basins": study.basins(model, points=2, settle=30),
        "modes": study.mode_count(scene, [1, 2], "amplitude", duration=0.1, dt=1e-3),
        "map": study.stability_map(scene, solvers.RK4, [1e-6, 1e-5], modes=(1, 2), duration=0.01),
        "smallest": study.smallest_model(scene, "amplitude", 0.5, duration=0.1, dt=1e-3),
        "vary": study.vary(scene, {"gap": [0.0, 1e-4]}, "peak_force", 0.1),
        "least": study.minimise(scene, {"gap": (0.0, 1e-4)}, "peak_force", {}, 0.1, tolerance=1e-2),
        "speed": study.speed_accuracy(model, rough, starts=2, duration=0.05, rounds=1),
    }


def test_every_repr_fits_on_a_few_lines(things):
    for name, thing in things.items():
        assert repr(thing).count("\n") < 3, name
        assert len(repr(thing)) < 900, name
        assert not re.search(r"object at 0x", repr(thing)), name


def test_reprs_of_many_numbers_tell_one_from_another():
    tones = [fb.Multisine(np.ones(90), np.arange(90.0), phase) for phase in (np.zeros(90), np.full(90, 1e-9))]
    assert repr(tones[0]) != repr(tones[1])
    tables = [Tabulated(np.linspace(0, 1e-3, 90), np.linspace(0, top, 90)) for top in (1.0, 1.0 + 1e-12)]
    assert repr(tables[0]) != repr(tables[1])
    few = fb.Multisine([1.0, 2.0], [3.0, 4.0])
    assert eval(repr(few), {"Multisine": fb.Multisine}) == few


STUDIES = ["ensemble", "response", "bifurcation", "basins", "modes", "map", "smallest", "speed", "vary", "least"]
TABLES = ["model", "run", "orbit", "branch", *STUDIES]


@pytest.mark.parametrize("name", TABLES)
def test_notebooks_show_what_print_gives(things, name):
    thing = things[name]
    assert isinstance(thing, Printed)
    html = thing._repr_html_()
    assert html.count("<table>") == html.count("</table>") >= 1
    words = re.sub(r"<[^>]*>", " ", html).replace("&lt;", "<").replace("&gt;", ">").replace("–", "").split()
    assert words == str(thing).split()


@pytest.mark.parametrize("name", STUDIES)
def test_studies_have_one_kind_of_result(things, tmp_path, name):
    found = things[name]
    assert isinstance(found, Result)
    found.save(tmp_path / "table.csv")
    with open(tmp_path / "table.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    rows = [{head.partition(" [")[0]: one for head, one in row.items()} for row in rows]  # without units
    assert rows == [{key: "" if one is None else str(one) for key, one in row.items()} for row in found.table()]
    assert json.loads(json_text(found.plain()))
    if name == "ensemble":
        with pytest.raises(ValueError, match=r"the values must hold spectra, got \['tip'\] in Ensemble\.figure; use"):
            found.figure()
    else:
        assert found.figure().axes[0].get_ylabel()


def test_the_table_of_a_model_holds_frequency_damping_and_participation(things):
    model = things["model"]
    words = str(model).split()
    assert f"{model.omega[0]:.6f}" in words
    assert f"{model.zeta[1]:.4g}" in words
    assert f"{model.participation[1]:.6g}" in words


def test_cells_are_escaped():
    assert html_table(["<b>"], [["a & b"], [None]]).count("&lt;b&gt;") == 1
    assert "<td>–</td>" in html_table(["x"], [[None]])


def test_tables_of_pandas_hold_the_numbers(things):
    pandas = pytest.importorskip("pandas", reason="pandas is optional and not installed")
    run, log = things["run"], things["log"]
    frame = run.to_dataframe(stride=10)
    assert frame.index.name == "t [s]"
    np.testing.assert_array_equal(frame.index, run.t[::10])
    np.testing.assert_array_equal(frame["displacement tip [m]"], run.displacement(0.5)[::10])
    np.testing.assert_array_equal(frame["force stop 0 [N]"], run.force(0)[::10])
    assert list(log.to_dataframe().columns) == list(log.named_arrays())
    np.testing.assert_array_equal(log.to_dataframe()["impulse"], log.impulse)
    rows = {"branch": len(things["branch"].orbits), "modes": 4, "map": 4, "ensemble": 3, "bifurcation": 6}
    for name in ("branch", "ensemble", "response", "bifurcation", "modes", "map", "smallest", "speed"):
        table = things[name].to_dataframe()
        assert isinstance(table, pandas.DataFrame)
        assert len(table) == rows.get(name, len(table)) > 0
    assert things["ensemble"].to_dataframe()["tip"].mean() == pytest.approx(things["ensemble"]["tip"].value)
    with pytest.raises(ValueError, match="stride must be a whole number above 0, got 0"):
        run.to_dataframe(stride=0)


def test_the_data_set_of_a_run(things):
    pytest.importorskip("xarray", reason="xarray is optional and not installed")
    run = things["run"]
    found = run.to_xarray(z=[0.25, 0.5])
    assert dict(found.sizes) == {"t": len(run.t), "z": 2, "stop": 1, "coordinate": 2}
    np.testing.assert_allclose(found.displacement.sel(z=0.5), run.displacement(0.5), rtol=1e-12, atol=1e-18)
    np.testing.assert_array_equal(found.force.sel(stop=0), run.force(0))
    assert found.velocity.attrs["units"] == "m/s"
    assert run.to_xarray().sizes["z"] == len(run.shapes.nodes)


def test_what_is_missing_is_said(things, monkeypatch):
    for name in ("pandas", "xarray"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(ImportError, match="a data frame needs pandas, which is optional: pip install pandas"):
        things["log"].to_dataframe()
    with pytest.raises(ImportError, match="a data set needs xarray, which is optional: pip install xarray"):
        things["run"].to_xarray()


@pytest.mark.parametrize("package", [fb, solvers, contacts, study, fb.plot])
def test_completion_lists_everything_public(package):
    assert set(package.__all__) <= set(dir(package))
    assert all(hasattr(package, name) for name in dir(package))


def test_the_package_is_a_command():
    done = subprocess.run([sys.executable, "-m", "fembeam", "--help"], capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert "simulate a scene file" in done.stdout


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self):
        return True


@pytest.mark.parametrize(
    ("stream", "wanted", "seen"), [(Terminal, True, True), (Terminal, False, False), (io.StringIO, True, False)]
)
def test_terminals_get_a_bar_when_asked_and_pipes_none(monkeypatch, recwarn, stream, wanted, seen):
    monkeypatch.setattr(sys, "stderr", stream())
    assert list(counting(wanted, range(3))) == [0, 1, 2]
    assert ("100%" in sys.stderr.getvalue()) == seen
    assert not recwarn.list


def test_diagrams_floor_spectra_and_moving_pictures_show_a_bar_when_asked(monkeypatch, things, tmp_path):
    monkeypatch.setattr(sys, "stderr", Terminal())
    run = things["model"].simulate(0.01, 1e-3)
    shaft = fb.Frame.straight(0.6, fb.Section.circle(2.1e11, 7850.0, 0.04), bending_only=True)
    fb.Scene(shaft, [fb.Clamped("A")]).campbell([0.0, 500.0], modes=2, progress=True)
    fb.study.floor_spectra(run, [0.1, 0.2], periods=[0.1], progress=True)
    fb.plot.animate(run, tmp_path / "run.gif", frames=2, progress=True)
    for end in ("2/2 [00:00<00:00", "spins/s", "places/s", "pictures/s"):
        assert end in sys.stderr.getvalue()


def test_work_is_told_to_those_who_listen(things, caplog, capfd):
    model = things["model"]
    model.simulate(0.01, 1e-3)
    assert not caplog.records
    with caplog.at_level(logging.INFO, logger="fembeam"):
        model.simulate(0.01, 1e-3)
    assert [record.name for record in caplog.records] == ["fembeam"]
    assert "run to t = 0.01 s" in caplog.text
    assert capfd.readouterr() == ("", "")
