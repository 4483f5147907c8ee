"""Frames from mesh files: members of groups, named nodes, the numbers of the frame made by hand."""

import meshio
import numpy as np
import pytest
from frames import SPACE_L, frequencies, space_l

import fembeam as fb

FLAT = fb.Section.rectangle(2.1e11, 7850.0, width=0.02, height=0.01)


def written(path, branch=False):
    """The space L as a gmsh file of eight lines in two groups, with named ends."""
    A, B, C = (np.array(at) for at in SPACE_L.values())
    points = np.array([*np.linspace(A, B, 6), *np.linspace(B, C, 4)[1:]])
    lines = np.array([[i, i + 1] for i in range(8)])
    lines[2] = lines[2, ::-1]  # drawn backwards
    group = np.array([1] * 5 + [2] * 3)
    cells = [("line", lines), ("vertex", np.array([[0], [8]]))]
    tags = [group, np.array([3, 4])]
    names = {"run": np.array([1, 1]), "drop": np.array([2, 1]), "foot": np.array([3, 0]), "tip": np.array([4, 0])}
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    meshio.write(path, meshio.Mesh(points, cells, cell_data=data, field_data=names), "gmsh22", binary=False)
    return path


def test_groups_become_members(tmp_path):
    """Two members of eight lines, the frequencies of the space L."""
    frame = fb.Frame.from_mesh(written(tmp_path / "l.msh"), {"run": FLAT, "drop": FLAT}, up="z", plane=False)
    assert [(one.name, one.a, one.b) for one in frame.members] == [("run", "foot", "n5"), ("drop", "n5", "tip")]
    found = frequencies(frame.assembled(elements=40), 5, "foot")
    assert np.allclose(found, frequencies(space_l().assembled(elements=40), 5, "A"), rtol=1e-10)


def test_plane_where_z_is_zero(tmp_path):
    """Nodes get two numbers; a loop of one group is cut at its corners."""
    points = np.array([[0, 0], [1, 0], [2, 0], [2, 1], [0, 1.0]])
    lines = np.array([[0, 1], [1, 2], [2, 3], [3, 4], [4, 0]])
    path = tmp_path / "loop.vtu"
    meshio.write(path, meshio.Mesh(np.column_stack([points, np.zeros(5)]), [("line", lines)]))
    frame = fb.Frame.from_mesh(path, FLAT)
    assert frame.components == ("x", "y", "rz")
    assert [one.name for one in frame.members] == ["n0-n2", "n2-n3", "n3-n4", "n4-n0"]
    assert frame.lengths.tolist() == [2.0, 1.0, 2.0, 1.0]


def test_refused(tmp_path):
    """A group without section is named, with the place of a line of it."""
    with pytest.raises(ValueError, match=r"one section, got 'none for 2, drop' in .* at \(0.5, 0.05, 0.0\) m"):
        fb.Frame.from_mesh(written(tmp_path / "l.msh"), {"run": FLAT})
    with pytest.raises(FileNotFoundError):
        fb.Frame.from_mesh(tmp_path / "none.msh", FLAT)
    with pytest.raises(TypeError, match="section must be a Section, got Taper"):
        fb.Frame.from_mesh(tmp_path / "l.msh", fb.Taper(FLAT, FLAT))


@pytest.mark.parametrize("more", [[1, 2], [2, 1], [0, 2]])
def test_lines_that_lie_on_each_other_are_refused(tmp_path, more):
    """A line in two groups with sections comes twice from gmsh: it counted twice, 1.4 times the frequency."""
    points = np.array([[0.0, 0, 0], [0.3, 0, 0], [0.6, 0, 0], [0.6, 0.5, 0]])
    lines, groups = np.array([[0, 1], [1, 2], [2, 3], more]), {"section": [np.array([1, 1, 1, 2])]}
    meshio.Mesh(points, [("line", lines)], cell_data=groups).write(tmp_path / "twice.vtu")
    with pytest.raises(ValueError, match=r"lines must not lie on each other, got \(0.\d, 0.0, 0.0\) in"):
        fb.Frame.from_mesh(tmp_path / "twice.vtu", {1: FLAT, 2: FLAT})


def shuffled_shaft(path, seed, both_ways=True, length=1.0):
    """A straight shaft of three groups, its nodes, its lines and their ways in any order."""
    rng, z = np.random.default_rng(seed), np.linspace(0.0, 1.0, 11)
    order, node = rng.permutation(10), rng.permutation(11)
    points = np.zeros((11, 3))
    points[node, 2] = length * z
    lines = node[np.column_stack((order, order + 1))]
    turned = rng.random(10) < 0.5
    lines[turned & both_ways] = lines[turned & both_ways][:, ::-1]
    group = np.searchsorted([0.3, 0.7], (z[:-1] + z[1:]) / 2.0)[order]
    sets = {f"g{i}": [np.flatnonzero(group == i)] for i in range(3)}
    meshio.Mesh(points, [("line", lines)], cell_sets=sets).write(path)
    return path


@pytest.mark.parametrize(("seed", "length"), [(0, 1.0), (1, 1.0), (2, 0.2), (3, 5.0)])
def test_a_straight_frame_is_one_in_whatever_order_its_lines_are(tmp_path, seed, length):
    """Where z is counted from, and which way the spin turns, is not left to the first line of the file."""
    path, section = shuffled_shaft(tmp_path / "shaft.inp", seed, length=length), fb.Section.circle(2e11, 7850.0, 0.02)
    frame = fb.Frame.from_mesh(path, {f"g{i}": section for i in range(3)}, spin=300.0, bending_only=True)
    ends = [[frame.nodes[name][2] / length for name in (one.a, one.b)] for one in frame.members]
    np.testing.assert_allclose(ends, [[0.0, 0.3], [0.3, 0.7], [0.7, 1.0]], atol=1e-12)
    assert frame.nodes[frame.site(0.7 * length, "test")][2] == pytest.approx(0.7 * length)
    np.testing.assert_array_equal(frame.axis, [0.0, 0.0, 1.0])


def test_lines_of_both_ways_leave_a_product_of_area_without_a_sign(tmp_path):
    skew = fb.Section(7e10, 2700.0, 3e-4, 6e-9, I2=9e-9, I12=2e-9, J=5e-9)
    path = shuffled_shaft(tmp_path / "shaft.inp", 0)
    with pytest.raises(ValueError, match="must run one way, by which the sign of I12 goes"):
        fb.Frame.from_mesh(path, skew)
    fb.Frame.from_mesh(shuffled_shaft(tmp_path / "shaft.inp", 0, both_ways=False), skew)


def test_a_member_with_a_product_of_area_keeps_its_way(tmp_path):
    """In the middle of a straight frame that runs the other way: by its own lines goes the sign of I12."""
    skew, own = fb.Section(7e10, 2700.0, 3e-4, 6e-9, I2=9e-9, I12=2e-9, J=5e-9), fb.Section.circle(7e10, 2700.0, 0.02)
    points, lines = np.outer([0.0, 0.3, 0.7, 1.0], [0, 0, 1]), np.array([[0, 1], [2, 1], [3, 2]])
    sets = {name: [np.array([i])] for i, name in enumerate(("low", "skew", "high"))}
    meshio.Mesh(points, [("line", lines)], cell_sets=sets).write(tmp_path / "shaft.inp")
    frame = fb.Frame.from_mesh(tmp_path / "shaft.inp", {"low": own, "skew": skew, "high": own})
    ends = [[frame.nodes[name][2] for name in (one.a, one.b)] for one in frame.members]
    assert ends == [[0.0, 0.3], [0.7, 0.3], [0.7, 1.0]]
