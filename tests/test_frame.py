"""Frames: places on them, rows between nodes, meshes from places, what is refused and in which words."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from frames import PORTAL, SPACE_L, portal, space_l, static, turned
from refusals import refused

import fembeam as fb
from fembeam.structures.element_matrices import Elements

STEEL = fb.Section.rectangle(2.1e11, 7850.0, width=0.02, height=0.01)
BARE = fb.Section(E=2.1e11, rho=7850.0, A=2e-4, I=1.7e-9)


def test_places():
    """Names, members with distances, and z on straight frames; positions follow offsets."""
    frame = portal()
    assert frame.position("C").tolist() == [4.0, 3.0, 0.0]
    assert frame.position(("D-C", 1.0)).tolist() == [4.0, 1.0, 0.0]
    assert frame.components_at("B") == ("x", "y", "rz")
    shaft = fb.Frame.straight(0.5, fb.Section.circle(2.1e11, 7850.0, 0.04))
    assert shaft.site(0.5, "") == "B"
    assert shaft.site(0.2, "") == (0, 0.2)
    assert shaft.position(0.2).tolist() == [0.0, 0.0, 0.2]
    ahead = fb.Frame({"A": (0, 0), "B": (1, 0)}, [fb.Member("A", "B", STEEL, offset=((0.1, 0), (0, 0.2)))])
    assert ahead.position(("A-B", 0.0)).tolist() == [0.1, 0.0, 0.0]
    assert np.allclose(ahead.lines()[0], [[0.1, 0, 0], [1.0, 0.2, 0]])


@pytest.mark.parametrize("place", [0.13, 0.25])
@pytest.mark.parametrize("seed", [0, 3])
def test_rows_between_nodes(place, seed):
    """Static answers to loads at nodes are cubic: rows inside an element are exact, those of mesh nodes unit rows."""
    frame = space_l(turned(seed))
    whole, split = frame.assembled(elements=2), frame.assembled(elements=4, places=[("B-C", place)])
    loads = [made.rows("C").toarray()[2] + 0.1 * made.rows("C").toarray()[4] for made in (whole, split)]
    pairs = zip((whole, split), loads, strict=True)
    found = [made.rows(("B-C", place)) @ static(made, load, "A") for made, load in pairs]
    # rounding of u: eps times the condition 5e5 of K scaled to a diagonal of 1
    assert np.allclose(found[0], found[1], rtol=0, atol=1.2e-10 * np.abs(found[1]).max())
    unit = split.rows(("B-C", place))
    assert unit.nnz == 6
    assert np.all(unit.data == 1.0)
    assert [split.labels[j] for j in unit.indices] == [(("B-C", place), c) for c in frame.components]


def test_rows_of_many_places():
    """`along` gives what `rows` gives one by one, mesh nodes among them."""
    made = space_l().assembled(elements=5)
    s = np.array([0.31, 0.0, 0.5, 0.12])
    one_by_one = np.vstack([made.rows(("A-B", place)).toarray() for place in s])
    assert np.array_equal(made.mesh.along(0, s).toarray(), one_by_one)


def test_fields_of_all_members_are_evaluated_at_once(monkeypatch):
    """Of 800 members one after another they took 11 s of the 12 s of `reduce`."""
    line = fb.Frame.polyline({f"n{i}": (0.1 * i, 0.0) for i in range(9)}, STEEL)
    matrices, counts = line.assembled(modes=3), []
    motion = Elements.motion
    monkeypatch.setattr(Elements, "motion", lambda self, at, x: counts.append(len(x)) or motion(self, at, x))
    matrices.rows_of([(one.name, 0.03) for one in line.members])
    assert counts == [8]


def test_rows_at_released_and_offset_ends():
    """A node is not the end of the member there: the hinge turns alone, the arm carries the rotation along."""
    nodes = {"A": (0, 0), "B": (1, 0), "C": (2, 0)}
    arm = ((0.0, 0.1), (0.0, 0.0))
    members = [fb.Member("A", "B", STEEL), fb.Member("B", "C", STEEL, release="start rz", offset=arm)]
    made = fb.Frame(nodes, members).assembled(elements=2)
    node, end = made.rows("B").toarray(), made.rows(("B-C", 0.0)).toarray()
    own = made.labels.index(("B-C", "start rz"))
    assert np.array_equal(end[2] - node[2], np.eye(len(made.labels))[own])
    assert np.allclose(end[0], node[0] - 0.1 * node[2])
    assert np.array_equal(end[1], node[1])


def test_close_places_share_a_node():
    """Features nearer than 1e-4 of a member are interpolated, so that K keeps its digits."""
    made = portal().assembled(elements=3, places=[("B-C", 1.0), ("B-C", 1.0001), ("B-C", 1e-9)])
    assert made.mesh.elements.count == 4
    assert made.rows(("B-C", 1.0001)).nnz > 3


def test_values_stay_as_given():
    """Frames do not keep hold of what they are made of, compare by value and survive a copy through a file."""
    nodes = {name: list(at) for name, at in PORTAL.items()}
    frame = fb.Frame(nodes, portal().members)
    nodes["A"][0] = 7.0
    assert frame == portal()
    again = pickle.loads(pickle.dumps(frame))
    assert again == frame
    assert again.assembled(elements=3).labels == frame.assembled(elements=3).labels


def test_plane_and_space_agree():
    """The motions in its plane of a frame with z = 0 are those of the plane frame."""
    flat = portal()
    upright = [replace(one, up="-x") if one.name != "B-C" else one for one in flat.members]
    space = fb.Frame({name: (*at, 0) for name, at in PORTAL.items()}, upright)
    a, b = flat.assembled(elements=6), space.assembled(elements=6)
    kept = [b.labels.index(label) for label in a.labels]
    assert abs(a.K - b.K[kept][:, kept]).max() < 1e-12 * abs(a.K).max()
    assert abs(a.M - b.M[kept][:, kept]).max() < 1e-12 * abs(a.M).max()


def members(**options):
    return [fb.Member("A", "B", STEEL, **options), fb.Member("B", "C", STEEL)]


# Before anything is computed, in a sentence that names what and what to do.
test_refused = refused(
    (lambda: fb.Frame({"A": (0, 0), "B": (0, 0), "C": (1, 0)}, members()), "'A' and 'B' at one place"),
    (lambda: fb.Frame({"A": (0, 0), "B": (1, 0, 0)}, members()[:1]), "node 'B' differs"),
    (lambda: fb.Frame({"A": (0, np.nan), "B": (1, 0)}, members()[:1]), "'A' must have two or three finite"),
    (lambda: fb.Frame({"A": (0, 0), "B": (1, 0)}, members()), "'B-C' must join nodes of the frame; 'B' is the nearest"),
    (lambda: fb.Frame(SPACE_L, members(up="x")), "up must not lie along the member, got .* in Member 'A-B'"),
    (lambda: fb.Frame(SPACE_L, members(up="rx")), "up must be a direction"),
    (lambda: fb.Frame(PORTAL, members()), "connected by members; 'A' and 'D' move apart"),
    (lambda: fb.Frame(SPACE_L, [*members(), fb.Member("C", "B", BARE)]), "'C-B' must know I2 and J in space"),
    (lambda: fb.Frame.straight(1.0, BARE, bending_only=True), "must know I2 in space"),
    (lambda: fb.Frame(SPACE_L, members(), bending_only=True), "along the z axis"),
    (lambda: fb.Frame.straight(1.0, STEEL, bending_only="false"), "bending_only must be True or False, got 'false'"),
    (lambda: fb.Frame(SPACE_L, members(release=1.0)), "release must be 'start' or 'end' and one of .* got 1.0"),
    (lambda: fb.Frame.straight(1.0, STEEL, spin=10.0), "must be round to spin"),
    (lambda: fb.Frame(SPACE_L, members(), spin=10.0), "spin is for a straight shaft"),
    (lambda: fb.Frame(SPACE_L, [*members(), fb.Member("A", "B", STEEL)]), "names of members must differ"),
    (lambda: fb.Frame(SPACE_L, members(release=("start rx", "end rx"))), "'A-B' moves along 'rx' between its nodes"),
    (lambda: fb.Frame(SPACE_L, members(release="rx")), "release must be 'start' or 'end' and one of"),
    (lambda: fb.Frame({"A": (0, 0), "B": (1, 0), "C": (2, 0)}, members(release="end rx")), "must be among x, y, rz"),
    (lambda: fb.Frame(SPACE_L, members(offset=((0.5, 0, 0), (0, 0, 0)))), "'A-B' must have a length"),
    (lambda: fb.Member("A", "A", STEEL), "two nodes"),
    (lambda: fb.Member("A", "B", STEEL, offset=(0, 0, 0)), "offset must be two vectors"),
    (lambda: fb.Member("A", "B", STEEL, offset=((0, 0), 0)), "offset must be two vectors"),
    (lambda: fb.Frame.polyline(None, STEEL), "nodes must be two or more by name, got None"),
    *((lambda bad=bad: portal().reduced(bad, 1), "nodes must name the places .* in Frame.reduced; write .'A', 'B'.")
      for bad in ("AD", None, 5, [])),
    (lambda: fb.Frame(PORTAL, []), "members must not be empty"),
    (lambda: portal().check_place("E", "Stop"), "must be a node of the frame; 'D' is the nearest"),
    (lambda: portal().check_place("B-C", "Stop"), "write .'B-C', s. for a place s along"),
    (lambda: portal().check_place(("B-D", 1.0), "Stop"), "'B-C' is the nearest"),
    (lambda: portal().check_place(("B-C", 4.2), "Stop"), "within 0 to 4 m, got 4.2 in Stop"),
    (lambda: portal().check_place(1.0, "Stop"), "not straight, got 1.0 in Stop"),
    (lambda: fb.Frame.straight(1.0, STEEL).check_place(1.2, "Stop"), "0 to 1 m, got 1.2"),
    (lambda: portal().assembled(modes=0), "modes must be a whole number"),
    (lambda: portal().assembled(elements=20_000), "at most 10000"),
    (lambda: portal().assembled(modes=20_000), "modes must be at most 300, got 20000 in Frame.assembled"),
    (lambda: fb.Scene(portal(), [fb.Clamped("A")]).reduce(modes=20_000), "modes must be at most 300, got 20000"),
    (lambda: fb.Scene(portal(), [fb.Clamped("A")]).reduce(20_000, elements=9), "at most .*free dofs., got 20000"),
    (lambda: fb.Section(2e11, 7800.0, 1e-4, 1e-9, I2=1e-9, I12=2e-9), "I12 must stay below"),
    (lambda: fb.Section.circle(2e11, 7800.0, 0.1, nu=0.7), "above -1 and at most 0.5, got 0.7"),
)  # fmt: skip


def test_released_node():
    """All members released at a node leave it free, unless a support or an inertia holds it."""
    nodes = {"A": (0, 0), "B": (1, 0), "C": (2, 0)}
    ends = fb.Member("A", "B", STEEL, release="end rz"), fb.Member("B", "C", STEEL, release="start rz")
    frame = fb.Frame(nodes, ends)
    with pytest.raises(ValueError, match="'B' moves along 'rz'"):
        frame.check_held({"A": ("x", "y")}, "Scene")
    for place in ("B", 1.0):  # by its distance it was not found
        frame.check_held({place: ("rz",)}, "Scene")


def test_skew_hinges_do_not_free_a_node():
    """Hinges about different axes of two members hold each other."""
    members = [fb.Member("A", "B", STEEL, release="end across"), fb.Member("B", "C", STEEL, release="start across")]
    fb.Frame(SPACE_L, members).check_held({}, "Scene")
    with pytest.raises(ValueError, match="'B' moves along 'rz'"):
        fb.Frame(SPACE_L, [replace(one, up="z", release=r) for one, r in
                           zip(members, ("end up", "start up"), strict=True)]).check_held({}, "Scene")  # fmt: skip
