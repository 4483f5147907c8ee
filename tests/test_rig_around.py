"""Labels of frames in the plane: they cover neither each other nor what is drawn, and stay in the axes."""

import numpy as np
import pytest
from matplotlib.text import Text

import fembeam as fb
from contacts import Jenkins, KelvinVoigt
from fembeam.plot.rig_around import FREE, around, inked

ROD, LAW = fb.Section.circle(2.1e11, 7800.0, 0.05), KelvinVoigt(1e6, 50.0)


def portal(wide, high):
    """Stops on both sides of a corner, five parts on the other one, a line between two places."""
    nodes = {"A": (0.0, 0.0), "B": (0.0, high), "C": (wide, high), "D": (wide, 0.0)}
    frame = fb.Frame(nodes, [fb.Member("A", "B", ROD), fb.Member("B", "C", ROD), fb.Member("D", "C", ROD)])
    stops = [fb.Stop("B", LAW, gap=0.5, direction=way, name=name) for way, name in (("x", "east"), ("-x", "west"))]
    forces = [fb.PointForce(("B-C", wide / 2), fb.Pulse(1e6, 1.0), direction="-y"),
              fb.PointMoment("C", fb.Harmonic(1e3, 1.0), direction="rz")]  # fmt: skip
    return fb.Scene(
        frame, [fb.Clamped("A"), fb.Pinned("D")], stops=stops, forces=forces, base={"x": fb.Harmonic(1.0, 0.8)},
        elements=[fb.Element("C", Jenkins(1e6, 1e4), direction="x", to="A", name="tie")],
        springs=[fb.Spring("C", 1e5, direction=(1, 1))], dashpots=[fb.Dashpot("C", 1e3, direction="y")],
    )  # fmt: skip


def tower():
    """Four storeys with braces."""
    nodes = {f"{side}{i}": (x, 3.0 * i) for side, x in (("L", 0.0), ("R", 4.0)) for i in range(5)}
    members = [fb.Member(f"{side}{i}", f"{side}{i + 1}", ROD) for side in "LR" for i in range(4)]
    members += [fb.Member(f"L{i}", f"R{i}", ROD) for i in range(1, 5)]
    slip = Jenkins(1e6, 1e3)
    return fb.Scene(
        fb.Frame(nodes, members), [fb.Clamped("L0"), fb.Clamped("R0")],
        stops=[fb.Stop(f"R{i}", LAW, gap=1e-3 * i, direction="-x") for i in range(1, 5)],
        masses=[fb.LumpedMass(f"L{i}", 100.0, name=f"floor {i}") for i in range(1, 5)],
        elements=[fb.Element(f"L{i}", slip, direction="x", to=f"R{i - 1}", name=f"brace {i}") for i in range(1, 5)],
    )  # fmt: skip


def line(stops):
    """Twelve spans in a row."""
    frame = fb.Frame.polyline({f"P{i}": (1.0 * i, 0.0) for i in range(13)}, ROD)
    return fb.Scene(
        frame, [fb.Pinned(f"P{i}") for i in range(0, 13, 3)], springs=[fb.Spring("P5", 1e4, direction="y")],
        forces=[fb.PointForce("P8", fb.Pulse(1e3, 1.0), direction="y")],
        stops=[fb.Stop(at, LAW, gap=1e-3, direction="-y", name=f"a long name {i}") for i, at in enumerate(stops)],
    )  # fmt: skip


@pytest.mark.parametrize(
    "scene", [portal(200.0, 300.0), portal(4.0, 3.0), tower(), line(["P1", "P4", "P7", "P10"])],
    ids=["slender", "wide", "tower", "line"],
)  # fmt: skip
def test_labels_of_a_frame_cover_nothing(scene):
    figure = scene.figure()
    figure.draw_without_rendering()
    axis = figure.axes[0]
    # not of annotations: theirs hold the line to the place, too
    boxes = [Text.get_window_extent(text) for text in axis.texts]
    kinds = (scene.supports, scene.stops, scene.masses, scene.elements, scene.springs, scene.dashpots, scene.forces)
    assert len(boxes) == len({repr(part.z) for parts in kinds for part in parts})
    for i, box in enumerate(boxes):
        assert not any(box.overlaps(other) for other in boxes[:i]), axis.texts[i].get_text()
        assert axis.bbox.x0 <= box.x0 < box.x1 <= axis.bbox.x1
        assert axis.bbox.y0 <= box.y0 < box.y1 <= axis.bbox.y1
    points = figure.dpi * inked(axis.lines, figure.dpi)
    for text, box in zip(axis.texts, boxes, strict=True):
        inside = (points > box.min + 1.0) & (points < box.max - 1.0)
        assert not inside.all(axis=1).any(), text.get_text()


def test_where_there_is_no_room_for_labels_there_are_numbers_and_a_list():
    """Eighteen stops on one of twelve spans."""
    scene = line([("P3-P4", 0.05 * i) for i in range(1, 19)])
    figure = scene.figure()
    figure.draw_without_rendering()
    *numbers, listed = figure.axes[0].texts
    assert [text.get_text() for text in numbers] == [str(i) for i in range(1, 1 + len(numbers))]
    assert listed.get_text().count("a long name") == 18
    boxes = [Text.get_window_extent(text) for text in [listed, *numbers]]
    for i, box in enumerate(boxes):
        assert not any(box.overlaps(other) for other in boxes[:i]), (i, box)
    assert all(figure.bbox.contains(*corner) for corner in (boxes[0].min, boxes[0].max))


@pytest.mark.parametrize("seed", range(8))
def test_free_labels_do_not_overlap(seed):
    rng = np.random.default_rng(seed)
    places, sizes = rng.uniform(1.0, 5.0, (9, 2)), rng.uniform(0.1, 0.8, (9, 2)) * (1.0, 0.5)
    box = np.array([[0.0, 0.0], [6.0, 6.0]])
    given = places.copy(), sizes.copy()
    centres, free = around(places, sizes, places, box)
    assert np.array_equal(given[0], places)
    assert np.array_equal(given[1], sizes)
    apart = np.abs(centres[:, None] - centres) - (sizes[:, None] + sizes) / 2
    lies = (apart < FREE - 1e-12).all(axis=2) & ~np.eye(len(places), dtype=bool)
    assert free
    assert not lies.any()


def test_labels_without_room_are_told():
    box = np.array([[0.0, 0.0], [1.0, 1.0]])
    assert not around(np.full((6, 2), 0.5), np.full((6, 2), 0.4), np.empty((0, 2)), box)[1]
