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
