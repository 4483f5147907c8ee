"""Beams from mesh files and back; what a file may not hold."""

import re
from pathlib import Path

import numpy as np
import pytest
from refusals import refused_by

import fembeam as fb

meshio = pytest.importorskip("meshio")
RIG = Path(__file__).parent / "data" / "rig.msh"  # made by gmsh 4.15: 27 lines, two physical lines, two points
THICK, THIN = (fb.Section.circle(2.1e11, 7800.0, d) for d in (0.02, 0.01))
SECTIONS = {"thick": THICK, "thin": THIN}


def frequencies(beam):
    return fb.Scene(beam, [fb.Clamped(0.0)]).reduce(5).omega


def written(path, points, lines, **options):
    points = np.asarray(points, dtype=float).reshape(len(points), -1)
    points = np.column_stack([points, np.zeros((len(points), 2))])[:, :3]
    cells = lines if isinstance(lines[0], tuple) else [("line", np.array(lines))]
    meshio.Mesh(points, cells, **options).write(path)
    return path


def test_a_file_of_gmsh_is_read():
    beam = fb.Beam.from_mesh(RIG, SECTIONS, foundation=2.0)
    assert beam.borders == pytest.approx((0.0, 0.12, 0.2599), rel=1e-15)
    assert [section for _, section in beam.spans] == [THICK, THIN]
    assert beam.place("stop") == pytest.approx(0.24445, rel=1e-15)
    assert beam.place("clamp") == 0.0
    assert beam.foundation == 2.0
    with pytest.raises(ValueError, match=r"name must be one of the beam's places \(clamp, stop\), got 'tip'"):
        beam.place("tip")


def test_gmsh_itself_writes_such_a_file(tmp_path):
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        points = [gmsh.model.geo.addPoint(0.1, y, 0.2, 0.05) for y in (0.0, 0.4, 1.0)]
        lines = [gmsh.model.geo.addLine(points[i], points[i + 1]) for i in range(2)]
        gmsh.model.geo.synchronize()
        for line, name in zip(lines, SECTIONS, strict=True):
            gmsh.model.addPhysicalGroup(1, [line], name=name)
        gmsh.model.mesh.generate(1)
        gmsh.write(str(tmp_path / "new.msh"))
    finally:
        gmsh.finalize()
    beam = fb.Beam.from_mesh(tmp_path / "new.msh", SECTIONS)
    expected = fb.Beam.of_spans([(0.4, THICK), (0.6, THIN)])
    np.testing.assert_allclose(frequencies(beam), frequencies(expected), rtol=1e-12)


@pytest.mark.parametrize("suffix", ["msh", "inp", "vtu", "vtk"])
def test_round_trip_keeps_the_frequencies(tmp_path, suffix):
    beam = fb.Beam.of_spans([(0.1, THICK), (0.3 / 7, fb.Taper(THICK, THIN)), (0.2, THIN), (0.1, THICK)])
    sections = beam.to_mesh(tmp_path / f"beam.{suffix}", elements=57)
    cells = meshio.read(tmp_path / f"beam.{suffix}").cells
    assert sum(len(block.data) for block in cells) == 58  # 13, 6, 26 and 13 by the lengths of the spans
    again = fb.Beam.from_mesh(tmp_path / f"beam.{suffix}", sections)
    assert [section for _, section in again.spans] == [section for _, section in beam.spans]
    np.testing.assert_allclose(frequencies(again), frequencies(beam), rtol=1e-12)


@pytest.mark.parametrize("suffix", ["msh", "inp"])
def test_places_survive_the_file(tmp_path, suffix):
    beam = fb.Beam.from_mesh(RIG, SECTIONS)
    again = fb.Beam.from_mesh(tmp_path / f"beam.{suffix}", beam.to_mesh(tmp_path / f"beam.{suffix}"))
    assert dict(again.places) == pytest.approx(dict(beam.places), rel=1e-15)


def test_names_that_no_file_can_hold_are_not_written(tmp_path):
    beam = fb.Beam(1.0, THIN, places=(("tip, left", 1.0),))
    with pytest.raises(ValueError, match=r"names of places must have no commas and quotes, got \['tip, left'\]"):
        beam.to_mesh(tmp_path / "a.inp")


def test_one_section_for_all_and_a_slanting_axis(tmp_path):
    t = np.array([0.0, 0.3, 0.7, 1.0])
    points = np.column_stack([7 + 3 * t, 4 * t - 2, 0 * t])[:, :2]  # not through the origin
    path = written(tmp_path / "a.vtu", points, [[3, 2], [0, 1], [1, 2]])
    assert fb.Beam.from_mesh(path, THIN).length == pytest.approx(5.0, rel=1e-14)


@pytest.mark.parametrize("length", [0.1, 20.0])
def test_named_nodes_beside_the_beam_are_no_places(tmp_path, length):
    """Off the axis or beyond an end by two millionths of the length; half a millionth is rounding of the file."""
    there = {"first": [0, 0], "last": [1, 0], "above": [0.5, 5e-7], "beyond": [1 + 5e-7, 0], "before": [-5e-7, 0]}
    not_there = {"off": [0.5, 2e-6], "after": [1 + 2e-6, 0], "ahead": [-2e-6, 0], "far": [1.5, 0]}
    sets = {name: np.array([i]) for i, name in enumerate({**there, **not_there})}
    points = np.array([length * np.array([*at, 0.0]) for at in {**there, **not_there}.values()])
    meshio.Mesh(points, [("line", np.array([[0, 1]]))], point_sets=sets).write(tmp_path / "a.inp")
    beam = fb.Beam.from_mesh(tmp_path / "a.inp", THIN)
    assert {name: place / length for name, place in beam.places} == pytest.approx(
        {"first": 0.0, "last": 1.0, "above": 0.5, "beyond": 1.0, "before": 0.0}, rel=1e-9
    )


def test_cell_data_by_name_and_by_number(tmp_path):
    data = {"part": [np.array([4, 4, 7])], "noise": [np.array([1, 2, 3])]}
    path = written(tmp_path / "a.vtu", [0.0, 1.0, 2.0, 3.0], [[0, 1], [1, 2], [2, 3]], cell_data=data)
    beam = fb.Beam.from_mesh(path, {4: THICK, "7": THIN}, data="part")
    assert beam.spans == ((2.0, THICK), (1.0, THIN))
    with pytest.raises(ValueError, match="data must be one of part, noise, got 'parts'"):
        fb.Beam.from_mesh(path, {4: THICK}, data="parts")


# --- what is refused ----------------------------------------------------------------------------------------------


def test_triangles_are_refused(tmp_path):
    path = written(tmp_path / "a.vtu", [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], [("triangle", np.array([[0, 1, 2]]))])
    with pytest.raises(ValueError, match=r"cells must be lines, got \{'triangle': 1\} in .*a.vtu"):
        fb.Beam.from_mesh(path, THIN)


@pytest.mark.parametrize(
    ("points", "lines", "message"),
    [
        ([0.0, 1.0, 2.0, 3.0], [[0, 1], [2, 3]], r"connected end to end, got \(2.0, 0.0, 0.0\)"),
        ([0.0, 1.0, 1.0, 2.0], [[0, 1], [2, 3]], r"connected end to end, got \(1.0, 0.0, 0.0\).*merge double nodes"),
        ([0.0, 1.0, 2.0, 3.0], [[0, 1], [1, 2], [1, 3]], r"must not branch.*got \(1.0, 0.0, 0.0\)"),
        ([0.0, 1.0, 2.0], [[0, 1], [1, 2], [0, 2]], "connected end to end"),
        ([[0.0, 0.0], [1.0, 0.1], [2.0, 0.0]], [[0, 1], [1, 2]], r"one straight axis, got \(1.0, 0.1, 0.0\)"),
        ([0.0, 0.0], [[0, 1]], "the lines must have a length"),
        ([0.0, 1.0, 1.0, 2.0], [[0, 1], [1, 2], [2, 3]], "elements must have a length"),
    ],
)
def test_lines_that_are_no_beam_are_refused(tmp_path, points, lines, message):
    path = written(tmp_path / "a.vtu", points, lines)
    with pytest.raises(ValueError, match=message):
        fb.Beam.from_mesh(path, THIN)


test_missing_groups_are_named = refused_by(
    lambda sections: fb.Beam.from_mesh(RIG, sections),
    ({**SECTIONS, "flange": THIN}, r"groups of the file \(it has thick, thin\), got \['flange'\]"),
    ({"thick": THICK}, r"one section, got 'none for thin' in .*rig.msh at z = 0.12 m"),
    ({"thick": THICK, "thin": 3.0}, r"section of span 1 must be a Section, got 3.0"),
    error=(ValueError, TypeError),
)


def test_files_that_are_no_meshes_are_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match="does not exist"):
        fb.Beam.from_mesh(tmp_path / "none.msh", THIN)
    files = {
        "bad.msh": ("not a mesh", "unknown format"),
        "old.msh": ("$MeshFormat\n9.9 0 8\n$EndMeshFormat\n", "Need mesh format in"),
        "bad.xyz": ("not a mesh", "Could not deduce file format"),
    }
    for name, (text, reason) in files.items():
        (tmp_path / name).write_text(text)
        with pytest.raises(ValueError, match=f"cannot be read as a mesh: {reason}"):
            fb.Beam.from_mesh(tmp_path / name, THIN)
    with pytest.raises(ValueError, match=r"the suffix must be one of .msh, .inp, .vtu, .vtk, got '.stl'"):
        fb.Beam(1.0, THIN).to_mesh(tmp_path / "a.stl")
    with pytest.raises(ValueError, match="elements must be a whole number above 0, got nan in to_mesh"):
        fb.Beam(1.0, THIN).to_mesh(tmp_path / "a.inp", elements=float("nan"))


@pytest.mark.parametrize("kind", ["gmsh22", "gmsh"])
def test_nodes_that_are_not_there_are_refused(tmp_path, kind):
    """meshio takes the last node for one that is not defined: a beam of 1 m had 0.7 m."""
    points = np.array([[0.0, 0, 0], [0.3, 0, 0], [1.0, 0, 0], [0.7, 0, 0]])
    mesh = meshio.Mesh(points, [("line", np.array([[0, 1], [1, 2]]))])
    mesh.write(tmp_path / "a.msh", file_format=kind, binary=False)
    assert fb.Beam.from_mesh(tmp_path / "a.msh", THIN).length == 1.0
    text = (tmp_path / "a.msh").read_text()
    head, elements = text.split("$Elements")
    nodes = head.replace("\n3\n", "\n4000\n") if kind == "gmsh" else head.replace("\n3 ", "\n4000 ")
    (tmp_path / "a.msh").write_text(f"{nodes}$Elements{elements}")
    with pytest.raises(ValueError, match="cells must have nodes that are defined, got 'others in a line'"):
        fb.Beam.from_mesh(tmp_path / "a.msh", THIN)
    (tmp_path / "a.msh").write_text(text[: text.index("$Elements") + 14])
    with pytest.raises(ValueError, match=r"cannot be read as a mesh: .*; is it cut, or of another format"):
        fb.Beam.from_mesh(tmp_path / "a.msh", THIN)


def test_a_node_behind_the_last_one_is_not_there(tmp_path):
    path = written(tmp_path / "a.vtu", [0.0, 0.3, 1.0], [[0, 1], [1, 3]])
    with pytest.raises(ValueError, match="cells must have nodes that are defined, got 'others in a line'"):
        fb.Beam.from_mesh(path, THIN)


def test_far_too_fine_elements_are_noticed(tmp_path):
    path = written(tmp_path / "a.vtu", [0.0, 0.5, 0.500001, 1.0], [[0, 1], [1, 2], [2, 3]])
    with pytest.warns(UserWarning, match=r"far too fine: 1e-06 m at z = 0.5 m"):
        fb.Beam.from_mesh(path, THIN)


INP = """*NODE
1, 0, 0, 0
2, 0.05, 0, 0
3, 0.1, 0, 0
4, 0.2, 0, 0
5, 0.3, 0, 0
6, 0.45, 0, 0
7, 0.6, 0, 0
*ELEMENT, TYPE={kind}, ELSET=span_1
{first}
*ELEMENT, TYPE={kind}, ELSET=span_2
{second}
*Element, type={kind}, elset=span_1
{third}
"""
TWO_NODES = {"first": "1, 1, 2\n2, 2, 3", "second": "3, 3, 4\n4, 4, 5", "third": "5, 6, 5\n6, 6, 7"}
THREE_NODES = {"first": "1, 1, 2, 3", "second": "2, 3, 4, 5", "third": "3, 7, 6, 5"}  # the middle one second


@pytest.mark.parametrize(
    ("kind", "elements"), [("B33", TWO_NODES), ("B23", TWO_NODES), ("B32", THREE_NODES), ("B32R", THREE_NODES)]
)
def test_beams_of_abaqus(tmp_path, kind, elements):
    """Elements of three nodes are as long as they are, B33 has two, and one set has several blocks of elements."""
    (tmp_path / "a.inp").write_text(INP.format(kind=kind, **elements))
    beam = fb.Beam.from_mesh(tmp_path / "a.inp", {"span_1": THICK, "span_2": THIN})
    np.testing.assert_allclose(beam.borders, (0.0, 0.1, 0.3, 0.6), rtol=1e-12)
    assert [section for _, section in beam.spans] == [THICK, THIN, THICK]
    frame = fb.Frame.from_mesh(tmp_path / "a.inp", {"span_1": THICK, "span_2": THIN})
    np.testing.assert_allclose(frame.lengths, [0.1, 0.2, 0.3], rtol=1e-12)


def test_lines_of_several_groups(tmp_path):
    """The format 2.2 of gmsh has each of them once for a group; 4.1 has them once."""
    points = np.array([[0.0, 0, 0], [0.4, 0, 0], [1.0, 0, 0]])
    lines, tags = np.array([[0, 1], [1, 2], [1, 0], [1, 2]]), [np.array([1, 2, 3, 3])]
    names = {"span_1": np.array([1, 1]), "span_2": np.array([2, 1]), "all": np.array([3, 1])}
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    mesh = meshio.Mesh(points, [("line", lines)], cell_data=data, field_data=names)
    mesh.write(tmp_path / "twice.msh", file_format="gmsh22", binary=False)
    (tmp_path / "once.msh").write_text(MSH41)
    for name in ("twice.msh", "once.msh"):
        assert fb.Beam.from_mesh(tmp_path / name, {"span_1": THICK, "span_2": THIN}).borders == (0.0, 0.4, 1.0)
        assert fb.Beam.from_mesh(tmp_path / name, {"all": THIN}).borders == (0.0, 1.0)
    (tmp_path / "saved_all.msh").write_text(MSH41.replace("2 1 3 2 3 -2", "0 2 3 -2"))
    with pytest.raises(ValueError, match="every element must have one section, got 'none for no group'"):
        fb.Beam.from_mesh(tmp_path / "saved_all.msh", {"all": THIN})
    beam = fb.Beam.from_mesh(tmp_path / "saved_all.msh", THIN)
    assert (beam.borders, beam.place("tip"), beam.place("load")) == ((0.0, 1.0), 1.0, 1.0)
    part = "$ElementData\n1\npart\n1\n0.0\n3\n0\n1\n4\n4 7\n1 7\n2 7\n3 8\n$EndElementData\n"
    (tmp_path / "numbered.msh").write_text((tmp_path / "saved_all.msh").read_text() + part)
    numbered = fb.Beam.from_mesh(tmp_path / "numbered.msh", {7: THICK, 8: THIN}, data="part")
    assert numbered.spans == ((0.4, THIN), (0.6, THICK))


def test_families_of_med_have_the_names_of_their_groups(tmp_path):
    """As Salome writes them: a number for each combination of groups, of lines and of points; and a field beside."""
    pytest.importorskip("h5py")
    points = np.array([[0.0, 0, 0], [0.4, 0, 0], [0.2, 0, 0], [1.0, 0, 0], [0.7, 0, 0]])
    lines = np.array([[3, 4], [0, 2], [2, 1], [1, 4]])
    data = {"cell_tags": [np.array([-7, -6, -6, -7])], "load": [np.array([1.0, 2.0, 3.0, 4.0])]}
    mesh = meshio.Mesh(points, [("line", lines)], {"point_tags": np.array([1, 0, 0, 2, 0])}, data)
    mesh.cell_tags = {-6: ["span_1", "all"], -7: ["span_2", "all"]}
    mesh.point_tags = {1: ["clamp"], 2: ["tip", "load"]}
    mesh.write(tmp_path / "a.med")
    for names in (("span_1", "span_2"), (-6, -7)):
        beam = fb.Beam.from_mesh(tmp_path / "a.med", dict(zip(names, (THICK, THIN), strict=True)))
        assert (beam.borders, [section for _, section in beam.spans]) == ((0.0, 0.4, 1.0), [THICK, THIN])
        assert beam.places == (("clamp", 0.0), ("load", 1.0), ("tip", 1.0))
    assert fb.Beam.from_mesh(tmp_path / "a.med", {"all": THIN}).borders == (0.0, 1.0)


MSH41 = """$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
5
0 4 "tip"
0 5 "load"
1 1 "span_1"
1 2 "span_2"
1 3 "all"
$EndPhysicalNames
$Entities
3 2 0 0
2 0.4 0 0 0
3 0 0 0 0
4 1 0 0 2 4 5
1 0.4 0 0 1 0 0 2 2 3 2 2 -4
2 0 0 0 0.4 0 0 2 1 3 2 3 -2
$EndEntities
$Nodes
4 4 7 33
0 2 0 1
7
0.4 0 0
0 3 0 1
33
0 0 0
0 4 0 1
9
1 0 0
1 1 0 1
20
0.7 0 0
$EndNodes
$Elements
3 4 1 4
0 4 15 1
4 9
1 1 1 2
1 7 20
2 20 9
1 2 1 1
3 33 7
$EndElements
"""


PLAIN = {"first": "$", "system": "", "more": "", "kind": "B31", "nodes": "2", "moved": "", "second": ""}
BARS = """BEGIN BULK
{first}
GRID,10,,0.,0.,0.
GRID,7,{system},0.,0.,1.
CBAR,1,1,10,7,0.,1.,0.{more}
ENDDATA
"""


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ({"system": 5}, "GRID 7 must be in the basic system, got 'system 5'"),
        ({"first": "GRDSET,,5"}, "GRID 10 must be in the basic system"),
        ({"first": "INCLUDE 'bar.bdf'"}, "all cards must stand in one file"),
        ({"more": ",GGG,+B\n+B,56"}, "CBAR 1 must have no pin flags and no offsets, got ['56']"),
        ({"more": ",GGG,+B\n+B,,,0.,0.,.1"}, "CBAR 1 must have no pin flags and no offsets, got ['.1']"),
        ({"more": ",GGG,+B\n$ pins\n+B,56"}, "CBAR 1 must have no pin flags and no offsets, got ['56']"),
        ({"first": "CBEND,3,1,10,7"}, "cells must be lines, of CBAR, CBEAM, CROD, CTUBE, got {'CBEND': 1}"),
        ({"first": "=,*(1),="}, "all cards must be written out"),
        ({"first": "CBAR,3,1,10,99,0.,1.,0."}, "GRID 99 must be defined"),
    ],
)
def test_what_is_passed_over_in_nastran_files(tmp_path, parts, said):
    """Systems, pins, offsets and included files would be lost without a word; without them the bar is read."""
    path = tmp_path / "bar.bdf"
    path.write_text(BARS.format(**PLAIN | parts))
    with pytest.raises(ValueError, match=re.escape(said)):
        fb.Frame.from_mesh(path, {1: THICK})
    for rest in ({}, {"system": 0}, {"more": ",GGG,+B\n+B,,,0.,0.,0.0E+00"}):
        path.write_text(BARS.format(**PLAIN | rest))
        assert fb.Frame.from_mesh(path, {1: THICK}, plane=False).nodes["n1"] == (0.0, 0.0, 1.0)


PART = """*Part, name=post
*Node
1,0,0,0
2,0,0,1
*Element, type={kind}, elset=steel
1,1,{nodes}
*End Part
*Assembly, name=rig
*Instance, name=one, part=post
{moved}*End Instance
{second}*End Assembly
"""


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ({"moved": "0.,0.,2.\n"}, "an instance must not be moved, got '0.,0.,2.'"),
        ({"second": "*Instance, name=two, part=post\n0.,0.,1.\n*End Instance\n"}, "one instance of a part"),
        ({"second": "*NGEN\n1,2,1\n"}, "nodes and elements must stand there as they are, got '*NGEN'"),
        ({"nodes": "9"}, "node 9 must be defined, got 'none'"),
        ({"nodes": "2,100"}, "each element of B31 must have a number and 2 nodes, got '4 numbers'"),
        ({"kind": "MASS"}, "elements must be beams or trusses, got 'MASS'"),
        ({"second": "*Node, system=C\n9,0,0,0\n"}, "must stand there as they are, got '*NODE, SYSTEM'"),
        ({"second": "*Nset, nset=a\nb\n"}, "a number, or a set above must stand there, got 'b'"),
        ({"second": "*Include, input=no.inp\n"}, "*INCLUDE must name another file"),
        ({"second": "*Include, input=post.inp\n"}, "*INCLUDE must name another file"),
        ({"second": "*End Assembly\n*Part, name=b\n*Node\n1,0,5,0\n"}, "node 1 must be given once"),
    ],
)
def test_what_is_passed_over_in_abaqus_files(tmp_path, parts, said):
    """Instances that are moved would stay where their parts are; what cannot be read is said."""
    path = tmp_path / "post.inp"
    path.write_text(PART.format(**PLAIN | parts))
    with pytest.raises(ValueError, match=re.escape(said)):
        fb.Frame.from_mesh(path, {"steel": THICK})
    path.write_text(PART.format(**PLAIN))
    assert fb.Frame.from_mesh(path, {"steel": THICK}).nodes["n1"] == (0.0, 0.0, 1.0)


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ({"first": "RBE2,5,7,123456,10\nRBAR,6,7,10,123456\nRBE2,8,7,1,10\nCONM2,9,7,,5."}, "1 CONM2, 1 RBAR, 2 RBE2"),
        ({"first": "GRID,8,,0.,1.,1.\nCROD,5,1,7,8\nCTUBE,6,1,8,10"}, "1 CROD, 1 CTUBE in"),
        ({"second": "*MPC\nBEAM,1,2\n*Rigid body, ref node=1, elset=steel\n"}, "1 *MPC, 1 *RIGID BODY in"),
        ({"kind": "T3D2"}, "1 T3D2 in"),
    ],
)
def test_what_is_no_beam_is_counted_in_a_warning(tmp_path, parts, said):
    """Rigid elements and masses were passed over, and pinned bars became beams, rigidly joined, without a word."""
    bars = "first" in parts
    path, text = tmp_path / f"bar.{'bdf' if bars else 'inp'}", BARS if bars else PART
    path.write_text(text.format(**PLAIN | parts))
    with pytest.warns(UserWarning, match=re.escape(said)) as warned:
        fb.Frame.from_mesh(path, THICK)
    assert warned[0].filename == __file__


GRIDS = """$ nothing but cards
GRID,1 $ the clamp
GRID*,50,,.2,0.
*,0.
GRID           9          5.0D-1   0.0+0
grid          12             1.0      0.
"""


@pytest.mark.parametrize(
    "bar",
    [
        "CBAR           3       2       9      12      0.      1.      0.",
        "cbar           3       2       9      12      0.      1.      0.",
        "CBAR\t3\t2\t9\t12\t0.\t1.\t0.",
        "CBAR*                  3               2               9              12\n*        0.",
        "$\nCBAR*,3,2,9,12\n$\n*,0.,1.,0. $ upright",
        "CTUBE,3,2,9,12",
    ],
)
@pytest.mark.filterwarnings("ignore:1 CTUBE in")
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_cards_of_nastran_in_all_fields(tmp_path, bar, end):
    """A bar in large fields or small letters was passed over: the beam was 0.5 m long."""
    text = "".join((GRIDS, "CBAR,1,1,1,50,0.,1.,0.\nCBAR,2,1,50,9,0.,1.,0.\n", bar, "\nENDDATA\nGRID,1,,9.\n"))
    (tmp_path / "a.bdf").write_bytes(b"\xef\xbb\xbf" + text.replace("\n", end).encode())
    beam = fb.Beam.from_mesh(tmp_path / "a.bdf", {1: THICK, 2: THIN})
    assert (beam.borders, [section for _, section in beam.spans]) == ((0.0, 0.5, 1.0), [THICK, THIN])
    (tmp_path / "a.bdf").write_text(text.partition("ENDDATA")[0])
    with pytest.raises(ValueError, match=r"the file must end with ENDDATA, got '(CBAR|CTUBE)'"):
        fb.Beam.from_mesh(tmp_path / "a.bdf", THIN)


LEVELS = """*Part, name=post
** as CAE writes it
*Node
      1,           0.
  20, 2.0D-1, 0., 0.,
*Element, type=b31,
 elset="first span"
1, 1, 20
*Node
3, 0.5, 0.
4, 1.
*Element, type=B31, elset=second
2, 20, 3
7, 3, 4
*Elset, elset=Third, generate
7, 7
*Elset, elset=ends
Second,
*Elset, elset=ENDS
"first span"
*Nset, nset=tip
4,
*End Part
*Assembly, name=rig
*Instance, name=one, part=post
*End Instance
*Node
1, 0.5, 0.5, 0.
*Nset, nset=reference
1,
*Nset, nset=middle, instance=one
20,
*Nset, nset=middle
one.3
*End Assembly
*Step
*Element Output, directions=YES
S,
"""


def independent(text):
    """The same with the mesh in the instance, as CAE writes independent ones."""
    part, rest = text.split("*End Part\n")
    head, mesh = part.split("** as CAE writes it\n")
    return f"{head}*End Part\n{rest}".replace("*End Instance\n", f"{mesh}*End Instance\n")


@pytest.mark.parametrize(("text", "end"), [(LEVELS, "\n"), (LEVELS, "\r\n"), (independent(LEVELS), "\n")])
def test_parts_and_sets_of_abaqus(tmp_path, text, end):
    """Nodes in several blocks, sets of sets, in parts, in ranges; a reference point of the assembly is no place."""
    (tmp_path / "nodes.inp").write_bytes(text.replace("\n", end).encode())
    (tmp_path / "a.inp").write_text("*Heading\n*Include, input=nodes.inp\n")
    for name in ("nodes.inp", "a.inp"):
        beam = fb.Beam.from_mesh(tmp_path / name, {"first span": THICK, "second": THIN})
        assert (beam.borders, [section for _, section in beam.spans]) == ((0.0, 0.2, 1.0), [THICK, THIN])
        assert beam.places == (("middle", 0.2), ("middle", 0.5), ("tip", 1.0))
        assert fb.Beam.from_mesh(tmp_path / name, {"ends": THIN}).borders == (0.0, 1.0)
        with pytest.raises(ValueError, match=r"one section, got \['Third', 'ends'\]"):
            fb.Beam.from_mesh(tmp_path / name, {"ends": THIN, "Third": THICK})
