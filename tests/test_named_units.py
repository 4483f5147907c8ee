"""Units of what turns, and parts that cannot act: bodies whose places have rotations."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import fembeam as fb
from contacts import KelvinVoigt
from fembeam.inspection.units import doubts

LAW = KelvinVoigt(1e4, 1.0)
STEEL = fb.Section.rectangle(2.1e11, 7850.0, width=0.02, height=0.01)
ELBOW = fb.Frame.polyline({"A": (0, 0), "B": (1, 0), "C": (1, 1)}, STEEL)
K = 1e3 * np.array([[2.0, -1.0], [-1.0, 1.0]])
TRAIN = fb.Structure(K, np.diag([0.1, 0.3]), labels=[("gear", "rz"), ("wheel", "rz")])
TURNED = fb.PointMoment("wheel", fb.Harmonic(5.0, 40.0), direction="rz")


def elbow(**parts):
    return fb.Scene(ELBOW, [fb.Clamped("A")], damping=fb.ModalDamping(0.02), **parts)


def test_tables_of_a_torsional_train_are_in_rad():
    run = fb.Scene(TRAIN, forces=[TURNED]).reduce("all").simulate(0.1, 1e-2)
    assert "mean / rad" in str(run)
    assert "displacement, wheel, rz" in str(run)


def test_tables_of_a_frame_show_displacements_where_a_moment_acts():
    force = fb.PointMoment("B", fb.Harmonic(5.0, 40.0), direction="rz")
    run = elbow(forces=[force]).reduce(2).simulate(0.1, 1e-2)
    assert "mean / m " in str(run)
    assert "rz" not in str(run)


@pytest.mark.parametrize(
    ("driven", "output", "unit", "said"),
    [
        (("C", "x"), ("B", "rz"), "rad/N", "force at C along x"),
        (("C", "rz"), ("C", "x"), "m/(N m)", "moment at C about rz"),
        (("C", "rz"), [("C", "x"), ("C", "rz")], "m or rad/(N m)", "moment at C about rz"),
        ("base.x", ("C", "rz"), "rad/m", "displacement of the frame along x"),
        ("base.x", ("C", "y"), "m/m", "displacement of the frame along x"),
    ],
)
def test_units_of_frequency_responses(driven, output, unit, said):
    found = elbow().reduce(2).frequency_response([3.0], driven, output)
    assert (found.unit, found.input) == (unit, said)


def test_a_base_that_moves_nothing_is_told():
    with pytest.raises(ValueError, match=r"write a place where a force acts, as no base moves this structure"):
        fb.Scene(TRAIN).reduce("all").frequency_response([3.0])


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ({"stops": [fb.Stop("A", LAW, direction="x", name="wall")]}, r"got 'A' in stops\[0\] 'wall' of Scene"),
        ({"stops": [fb.Stop(("A-B", 0.0), LAW, direction="x")]}, r"got 'A-B \+ 0 m' in stops\[0\]"),
        ({"elements": [fb.Element("A", LAW, direction="rz")]}, r"got 'A' in elements\[0\]"),
        ({"stops": [fb.Stop("B", LAW, direction="x", on=("A-B", 1.0))]}, r"got 'B on A-B \+ 1 m' in stops\[0\]"),
    ],
)
def test_parts_that_act_on_nothing_that_moves_are_refused(parts, message):
    with pytest.raises(ValueError, match=r"what stops and elements act on must be free to move, " + message):
        elbow(**parts).reduce(2)


def test_offsets_in_the_plane():
    with pytest.raises(ValueError, match=r"offset must be a vector: one number is along z, .* got 0.3 in masses\[0\]"):
        elbow(masses=[fb.LumpedMass("C", 1.0, offset=0.3)])
    mass = fb.LumpedMass("C", 1.0, offset=(0.3, 0.1))
    assert mass == fb.LumpedMass("C", 1.0, offset=(0.3, 0.1, 0.0))
    assert elbow(masses=[mass]).reduce(1).omega < elbow(masses=[fb.LumpedMass("C", 1.0)]).reduce(1).omega


def test_messages_do_not_list_whole_frames():
    for make in (lambda: elbow(masses=[fb.Disk("C", 1.0, 0.1, 0.1)]), lambda: elbow().campbell([1.0])):
        with pytest.raises(ValueError, match=r"straight Frame in space") as said:
            make()
        assert len(str(said.value)) < 200


def test_units_of_frames_that_look_wrong_are_told():
    mill = fb.Section.rectangle(2.1e5, 7.85e-9, width=20.0, height=10.0)
    frame = fb.Frame.polyline({"A": (0, 0), "B": (1000, 0), "C": (1000, 1)}, mill)
    stop = fb.Stop("C", LAW, gap=500.0, direction="x", name="wall")
    scene = fb.Scene(frame, [fb.Clamped("A")], masses=[fb.LumpedMass("C", 12.0)], stops=[stop])
    said = doubts(scene.reduce(2))
    assert said[:2] == [
        "member 'A-B': E = 210000 N/m² looks like N/mm²: steel has 2.1e11 N/m²",
        "member 'A-B': rho = 7.85e-09 kg/m³ looks like g/cm³ or t/mm³: steel has 7800 kg/m³",
    ]
    assert said[2:] == [
        "member 'A-B': length = 1000 m looks like mm",
        "masses[0] = 12 kg is 7.6e+03 times the frame: is it in grams?",
        "stops[0] 'wall': a gap of 500 m on a frame of 1000 m: is it in mm?",
    ]
    assert doubts(elbow(stops=[fb.Stop("C", LAW, gap=1e-3, direction="x")]).reduce(2)) == []


def test_sections_in_mm_are_told():
    """A slender frame or beam whose section alone is in mm: I/A² of a rectangle has no unit to tell it by."""
    section = fb.Section.rectangle(2.1e11, 7850.0, width=80.0, height=120.0)
    frame = fb.Frame.polyline({"A": (0, 0), "B": (3, 0), "C": (3, 4)}, section)
    assert doubts(fb.Scene(frame, [fb.Clamped("A")]).reduce(2)) == [
        "member 'A-B': a section 120 m high in a frame of 5 m: is it in mm?"
    ]
    said = doubts(fb.Scene(fb.Beam(3.0, section), [fb.Clamped(0.0)]).reduce(2))
    assert said == ["the beam is 0.025 times as long as high: is its section in mm?"]
    stub = fb.Frame.polyline({"A": (0, 0), "B": (3, 0), "C": (3, 0.05)}, fb.Section.circle(2.1e11, 7850.0, 0.1))
    assert doubts(fb.Scene(stub, [fb.Clamped("A")]).reduce(2)) == []


def test_friction_in_per_cent_and_radii_in_mm_are_told():
    shaft = fb.Frame.straight(1.0, fb.Section.circle(2.1e11, 7850.0, 0.02), bending_only=True)
    hole = fb.AnnularStop("B", LAW, 2e-4, friction=fb.Friction(20.0, 1e6), radius=10.0)
    said = doubts(fb.Scene(shaft, [fb.Clamped("A")], stops=[hole]).reduce(2))
    assert said == [
        "stops[0]: mu = 20 looks like per cent",
        "stops[0]: a radius of 10 m on a frame of 1 m: is it in mm?",
    ]


def test_statistics_of_a_torsional_train_are_in_rad(tmp_path):
    noise = fb.BandNoise(5.0, (10.0, 200.0), seed=1)
    parts = {"forces": [fb.PointMoment("wheel", noise, direction="rz")], "damping": fb.ModalDamping(0.1)}
    free, met = (
        fb.Scene(TRAIN, stops=stops, **parts).reduce("all")
        for stops in ([], [fb.Stop("wheel", LAW, gap=1e-3, direction="rz", name="peg")])
    )
    found = fb.study.stationary(met, 10.0, 1e-3, discard=0.1)
    rows = {row["name"]: row["unit"] for row in found.table()}
    assert {rows[name] for name in ("δ mean", "δ std")} == {"rad"}
    assert [rows[f"peg {name}"] for name in ("peak_force", "entry_speed", "power")] == ["N m", "rad/s", "W"]
    assert "δ std / rad " in str(found)
    assert found.figure().axes[0].get_xlabel() in ("δ / rad", "δ / mrad")
    many = fb.study.ensemble(free, 2, partial(fb.study.characteristics, duration=10.0, dt=1e-3, discard=0.1))
    many.save(tmp_path / "many.csv")
    head = (tmp_path / "many.csv").read_text().splitlines()[0]
    assert head.startswith("seed,")
    assert "rz u std [rad]" in head
    assert "rz u crossing_rate [1/s]" in head
    assert many.figure().axes[0].get_ylabel() == "PSD / rad² s rad⁻¹"
    for figure in (fb.plot.spectrum, fb.plot.densities):
        assert "rad" in figure(free.simulate(2.0, 1e-3)).axes[0].get_ylabel().partition(" s ")[0]


def test_units_of_what_is_watched_are_not_known():
    model = fb.Scene(TRAIN, forces=[replace(TURNED, signal=fb.BandNoise(5.0, (10.0, 200.0), seed=1))],
                     damping=fb.ModalDamping(0.1)).reduce("all")  # fmt: skip
    found = fb.study.stationary(model, 5.0, 1e-3, {"speed": lambda run: run.q_dot[:, 0]}, discard=0.1, segment=64)
    assert [row["unit"] for row in found.table()] == ["", "", "", "", "1/s"]
    assert found.figure().axes[0].get_xlabel() == "speed"
