"""Where contacts are: columns of the contact log, of all bodies, in tables, files, orbits and derivatives."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from structures import beam_structure

import fembeam as fb
import solvers
from contacts import Hertz, KelvinVoigt, WaltonBraun
from fembeam.response import PlacedLog, site
from fembeam.results import files, html_page

STEEL = fb.Section.circle(E=2.1e11, rho=7800.0, diameter=0.01)
LAW = KelvinVoigt(1e5, 10.0)
NAMED = beam_structure()
PIPE = fb.Frame.polyline({"A": (0, 0, 0), "B": (0.5, 0, 0), "C": (0.5, 0.3, 0)}, STEEL)


@pytest.fixture(scope="module")
def run():
    """A named stop, one of rotation, an impactor on both sides."""
    scene = fb.Scene(
        fb.Beam(0.5, STEEL), [fb.Clamped(0.0)], damping=fb.ModalDamping(0.02), base=fb.Harmonic(2e-3, 140.0),
        stops=[fb.Stop(0.5, LAW, name="valve"), fb.Stop(0.5, LAW, of="rotation", side="above", gap=1e-3)],
        elements=[fb.Element(0.4, KelvinVoigt(10.0, 0.1))],
        impactors=[fb.Impactor(0.2, 0.05, 0.0, Hertz(1e7), gap=1e-4, side="both", stiffness=10.0)],
    )  # fmt: skip
    return scene.reduce(2).simulate(0.2, 1e-3)


def sites(scene):
    return [tuple(one)[1:] for one in scene.reduce(2).sites]


def test_along_a_beam_z_and_side(run):
    known = run.contacts.sites
    assert [one.z for one in known] == [0.5, 0.5, 0.4, 0.2, 0.2]
    assert [one.side for one in known] == ["below", "above", "", "below", "above"]
    assert [one.direction for one in known] == ["-y", "-rx", "y", "-y", "y"]
    log = run.contacts
    assert list(log.named_arrays())[:5] == ["stop", "name", "z", "side", "t_in"]
    np.testing.assert_array_equal(log.z, [known[i].z for i in log.stop])
    assert log.side.tolist() == [known[i].side for i in log.stop]
    assert set(log.place) <= {"0.5 m", "0.2 m"}


def test_the_direction_is_the_way_the_place_moves_as_the_gap_closes():
    """For every stop a static displacement along its direction closes the gap: δ grows by it."""
    stops = [fb.Stop("tip", LAW, gap=1e-3, direction=way) for way in ("y", "-y", "-rx", (0, -2))]
    ball = fb.Impactor("middle", 0.05, 0.0, LAW, gap=1e-4, side="both", stiffness=10.0, direction="-y")
    model = fb.Scene(NAMED, [fb.Clamped("root")], stops=stops, impactors=[ball]).reduce(2)
    assert [one.direction for one in model.sites] == ["y", "-y", "-rx", "-y", "y", "-y"]
    for row, one in zip(model.directions, model.sites, strict=True):
        way = model.phi((one.place, one.direction))[:2]
        moved = -row[:2] @ way  # of δ, per unit of way·way
        assert moved == pytest.approx(way @ way, rel=1e-12)


@pytest.mark.parametrize("law", [WaltonBraun(1e5, 4e5), WaltonBraun(1e5, 4e5) + Hertz(1e7)])
def test_stops_whose_law_opens_have_no_angles(law):
    """A contact that a border of its law begins and ends is in no circle; its force there is no angle."""
    wall = solvers.Contact([1.0], law, gap=1e-3)
    log = solvers.integrate(solvers.System.modal([50.0], [0.01], [wall]), [0.0], [-1.0], 0.2).contacts
    assert len(log) == 3
    assert np.all(np.isnan([log.angle_in, log.angle_out]))
    assert not {"angle_in", "angle_out"} & set(log.named_arrays())


def test_a_contact_over_the_end_of_a_period_has_the_angles_of_its_begin_and_of_its_end():
    """It is cut there into a part that has not ended and a rest that begins at t = 0."""
    rest = [0.0, 0.0, 0.1, 0.3, 0.5, 2.0, 7.0, 0.4, 0.2, 0.0, 1.5, 1.8]
    part = [0.0, 0.8, np.nan, 0.9, np.nan, 1.0, 3.0, 0.6, -0.1, 0.0, 1.2, 1.5]
    whole = [0.0, 0.8, 1.1, 0.9, 0.5, 2.0, 7.0, 1.0, 0.1, 0.0, 1.2, 1.8]
    log = solvers.ContactLog.of_period([solvers.ContactLog.of_rows(np.array([rest, part]))], [0.0], period=1.0)
    np.testing.assert_allclose(np.array([*log.arrays().values()], dtype=float)[:, 0], whole)
    assert len(log) == 1


def test_by_name_place_and_direction():
    two = fb.Scene(NAMED, [fb.Clamped("root")], stops=[fb.Stop("tip", LAW, direction="-y"),
                                                      fb.Stop(4, LAW, direction="y")],
                   elements=[fb.Element("tip", LAW, direction="-y")])  # fmt: skip
    assert sites(two) == [("tip", "", "-y"), ("4", "", "y"), ("tip", "", "-y")]
    hole = fb.AnnularStop("C", LAW, 1e-3, directions=("x", "z"))
    frame = fb.Scene(PIPE, [fb.Clamped("A")], stops=[fb.Stop(("B-C", 0.1), LAW, direction=(3, 0, 4)), hole])
    assert sites(frame) == [("B-C + 0.1 m", "", "(0.6, 0, 0.8)"), ("C", "", "x, z")]
    body = fb.Scene(NAMED, [fb.Clamped("root")], stops=[fb.Stop("tip", LAW, direction="y")])
    mixed = fb.Scene(fb.Beam(0.5, STEEL), [fb.Clamped(0.0)], stops=[fb.Stop(0.5, LAW)], bodies=[body])
    model = mixed.reduce(2)
    assert [(one.place, one.direction) for one in model.sites] == [("0.5 m", "-y"), ("tip of body 1", "y")]
    none = solvers.ContactLog.of_rows(np.zeros((1, 12)), ["one"])
    assert list(PlacedLog.of(none, model.sites).where) == ["place", "direction"]


def test_a_straight_frame_tells_m_and_a_structure_nodes():
    assert site((0.25, "x"), -1.0, 0, False, False, plane=False)[1:] == ("0.25 m", "", "x")
    assert site(((1, 88), "x"), -1.0, 0, False, False, plane=False).place == "88 of body 1"
    assert site((88, "x"), -1.0, 2, False, False, plane=False).place == "88 of body 2"
    assert site((0.3, "-y"), -1.0, 0, False, True, plane=True)[1:] == ("0.3 m", "", "-y")  # an element counted down


def test_files_keep_it(run, tmp_path):
    again = fb.load(run.save(tmp_path / "run"))
    assert again.contacts.sites == run.contacts.sites
    scene = fb.Scene(PIPE, [fb.Clamped("A")], stops=[fb.Stop("C", LAW, direction="-z", name="valve"),
                                                     fb.AnnularStop(("B-C", 0.1), LAW, 1e-3, directions=("x", "z"))],
                     base={"z": fb.Harmonic(1e-3, 100.0)})  # fmt: skip
    made = scene.reduce(2).simulate(0.05, 1e-3)
    assert str(fb.load(made.save(tmp_path / "frame")).contacts) == str(made.contacts)
    assert set(made.contacts.direction[made.contacts.stop == 0]) == {"-z"}


def test_tables_and_csv(run, tmp_path):
    _, path = run.to_csv(tmp_path)
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0])[:5] == ["stop", "name", "z [m]", "side", "t_in [s]"]
    assert [float(row["z [m]"]) for row in rows] == run.contacts.z.tolist()
    assert list(rows[0])[6] == "speed_in [m/s or rad/s]"  # one of them is of rotation
    _, head, *lines = str(run.contacts).splitlines()
    assert head.split()[:5] == ["name", "z", "/", "m", "side"]
    assert ["valve", "0.5", "below"] in [line.split()[:3] for line in lines]
    assert [row["side"] for row in run.contacts.table()] == run.contacts.side.tolist()
    pytest.importorskip("pandas")
    assert run.contacts.to_dataframe()["side"].tolist() == run.contacts.side.tolist()


def test_a_long_log_is_cut_in_print(run):
    many = PlacedLog.of(replace(run.contacts, **{k: np.repeat(v, 100) for k, v in run.contacts.arrays().items()}),
                        run.contacts.sites)  # fmt: skip
    lines = str(many).splitlines()
    assert len(lines) == 63
    assert lines[-1] == f"and {len(many) - 60} contacts more"
    empty = str(replace(run.contacts, **{k: v[:0] for k, v in run.contacts.arrays().items()}))
    assert empty == "<0 contacts, 0 of them not ended>"


def test_results_of_the_command_line(run, tmp_path):
    found = files.summary(run)
    assert [(row["z"], row["side"]) for row in found["contacts"]][:2] == [(0.5, "below"), (0.5, "above")]
    (tmp_path / "summary.json").write_text(files.json_text(found))
    page = html_page.write_page(tmp_path).read_text(encoding="utf-8")
    assert "<td>at z / mm</td><td>500</td><td>500</td><td>200</td>" in page
    assert "<td>side</td><td>below</td><td>above</td>" in page
    assert "closes along" not in page


def test_orbits_derivatives_and_strikes():
    scene = fb.Scene(fb.Beam(0.5, STEEL), [fb.Clamped(0.0)], stops=[fb.Stop(0.5, LAW, gap=1e-4, name="valve")],
                     damping=fb.ModalDamping(0.02), base=fb.Harmonic(1e-3, 100.0))  # fmt: skip
    model = scene.reduce(1)
    orbit = model.orbit(1)
    for log in (orbit.contacts, model.strike(0.1), orbit.run.contacts, orbit.sensitivity("stops[valve].gap").contacts):
        assert set(log.z) == {0.5}
        assert set(log.side) == {"below"}
    row = orbit.sensitivity("stops[valve].gap").table()[0]
    assert list(row)[:5] == ["stop", "name", "z", "side", "t_in"]
    assert "side" in str(orbit)
