"""Scenes of joined bodies: the same numbers as in one piece, superelements, bodies turned and used twice, bad input."""

import numpy as np
import pytest
from frames import PORTAL, SPACE_L, portal, turned
from refusals import refused

import fembeam as fb
import reduction
from contacts import Hertz, KelvinVoigt
from fembeam.structures import Structure

FLAT = fb.Section.rectangle(2.1e11, 7850.0, width=0.02, height=0.01)
UNIT = fb.Section(E=1.0, rho=1.0, A=1.0, I=1.0, I2=1.0)
BASE = {"x": fb.Harmonic(1e-3, 100.0), "z": fb.Harmonic(1e-3, 120.0)}
LAW = Hertz(1e8)
ON_B = [fb.Stop("B", LAW, 1e-4, direction="z")]
ON_C = {
    "masses": [fb.LumpedMass("C", 0.2, name="lump")],
    "stops": [fb.Stop("C", LAW, 1e-4, direction="-y", name="lift")],
}
LOSSES = {"damping": fb.ModalDamping(0.01), "base": BASE}


def leg(nodes):
    """A leg of the space L."""
    return fb.Frame.polyline({name: SPACE_L[name] for name in nodes}, FLAT, up="z")


def both(**options):
    """The space L in one piece and joined at B."""
    whole = fb.Frame.polyline(SPACE_L, FLAT, up="z")
    one = fb.Scene(whole, [fb.Clamped("A")], masses=ON_C["masses"], stops=[*ON_B, *ON_C["stops"]], **LOSSES, **options)
    bodies, joints = [fb.Scene(leg("BC"), **ON_C)], [fb.Joint("B", to=(1, "B"))]
    return one, fb.Scene(leg("AB"), [fb.Clamped("A")], stops=ON_B, bodies=bodies, joints=joints, **LOSSES, **options)


@pytest.fixture(scope="module")
def runs():
    """Both run through some contacts, on the same elements."""
    return [scene.reduce(4, elements=count).simulate(0.06, 1e-3) for scene, count in zip(both(), (12, 6), strict=True)]


def test_in_one_piece():
    """Frequencies and moved masses of the whole, to rounding."""
    equal = [("A-B", 0.5 * i / 6) for i in range(1, 6)] + [("B-C", 0.3 * i / 6) for i in range(1, 6)]
    scenes = both()
    mesh, two = scenes[0].matrices(12, probes=equal), scenes[1].reduce(6, elements=6)
    assert mesh.M.shape == two.matrices.M.shape
    assert np.allclose(reduction.modal_basis(mesh.M, mesh.K, 6, root=mesh.root).omega, two.omega, rtol=1e-11)
    for direction, load in mesh.base_loads.items():
        mass = reduction.moved_mass(mesh.M, load)
        assert reduction.moved_mass(two.matrices.M, two.matrices.base_loads[direction]) == pytest.approx(
            mass, rel=1e-11
        )
    assert two.moved_along == ("x", "y", "z")


def test_runs(runs):
    """The same motion through contacts, at all places however they are told, the names of all parts, section forces."""
    one, two = runs
    assert len(one.contacts) == len(two.contacts) > 2
    assert two.names == one.names == ("stop at B, z", "lift")
    size = np.abs(one.displacement("C", "z")).max()
    for place in ("C", (1, "C"), (1, ("B-C", 0.3))):
        assert np.allclose(two.displacement(place, "z"), one.displacement("C", "z"), atol=1e-4 * size)
    assert np.array_equal(two.displacement((1, "B"), "z"), two.displacement("B", "z"))
    for name, values in one.section_forces(("B-C", 0.1)).items():
        joined = two.section_forces((1, ("B-C", 0.1)))[name]
        assert np.allclose(joined, values, atol=2e-3 * np.abs(values).max())
    assert two.extremes("M").largest[0] == pytest.approx(one.extremes("M").largest[0], rel=2e-3)
    moment = one.reactions()[0]["ry"]
    assert np.allclose(two.reactions()[0]["ry"], moment, atol=1e-3 * np.abs(moment).max())


def test_saved_and_drawn(runs, tmp_path):
    """A saved run answers by the same places; the rig and the run are drawn."""
    two = runs[1]
    two.save(tmp_path / "run.npz")
    read = fb.load(tmp_path / "run.npz")
    for place in ("C", (1, "C")):
        assert np.allclose(read.displacement(place, "y"), two.displacement("C", "y"), rtol=0, atol=1e-15)
    assert len(both()[1].figure().axes) >= 1
    assert (two.to_vtu(tmp_path / "run.vtu")).exists()


def test_parts_of_all_bodies():
    """Springs, dashpots, elements, forces and stops of joined bodies act where they are; stops between them too."""
    parts = {
        "springs": [fb.Spring("C", 3e3, direction="x")],
        "dashpots": [fb.Dashpot("C", 2.0, direction="x")],
        "elements": [fb.Element("C", KelvinVoigt(1e3, 0.0), direction="z", to=("B-C", 0.1))],
        "forces": [fb.PointForce("C", fb.Harmonic(5.0, 30.0), direction="y")],
    }
    whole = fb.Scene(fb.Frame.polyline(SPACE_L, FLAT, up="z"), [fb.Clamped("A")], stops=[
        fb.Stop("C", LAW, 1e-3, direction="x", on=("A-B", 0.2))], **parts)  # fmt: skip
    stops, bodies = [fb.Stop(("A-B", 0.2), LAW, 1e-3, direction="-x", on=(1, "C"))], [fb.Scene(leg("BC"), **parts)]
    joined = fb.Scene(leg("AB"), [fb.Clamped("A")], stops=stops, bodies=bodies, joints=[fb.Joint("B", (1, "B"))])
    systems = [scene.reduce(3, elements=12).system for scene in (whole, joined)]
    assert [part.z for part in (*joined.springs, *joined.dashpots, *joined.forces)] == [(1, "C")] * 3
    assert joined.reduce(3).contact_rows[0].name == "stop at A-B + 0.2 m, -x, on C of body 1"
    for matrix in "KC":
        one, two = (getattr(system, matrix) for system in systems)
        assert np.allclose(one, two, rtol=1e-4, atol=1e-5 * one.max())  # on other meshes
    rows = [np.array([contact.direction for contact in system.contacts]) for system in systems]
    assert np.allclose(np.abs(rows[0]), np.abs(rows[1]), rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize(("modes", "known"), [
    (0, [22.73594240235, 81.97560612768]),
    (1, [22.3912041074231, 61.74881100982636]),
    (2, [22.37595524830725, 61.67814371298982]),
])  # fmt: skip
def test_craig_bampton_halves(modes, known):
    """One half used twice, k modes each and plane: the error of the method itself, which falls as h⁴ of the mesh's."""
    errors = []
    for elements in (8, 16):
        half = fb.Frame({"A": (0, 0, 0), "B": (0, 0, 0.5)}, [fb.Member("A", "B", UNIT)], bending_only=True)
        half = half.reduced(["A", "B"], 2 * modes, elements)
        other = [fb.Scene(half, [fb.Clamped("B")])]
        omega = fb.Scene(half, [fb.Clamped("A")], bodies=other, joints=[fb.Joint("B", to=(1, "A"))]).reduce("all").omega
        assert len(omega) == 4 * modes + 4
        errors.append(np.abs(omega[::2][: len(known)] / np.array(known)[: len(omega) // 2] - 1))
    first, second = np.array(errors)
    assert np.all(second < 2e-5)
    assert np.all((first < 1e-11) | (np.abs(first / second / 16 - 1) < 0.1))


def test_used_twice_and_turned():
    """An L of equal legs from one leg, once turned, as a frame and as a structure of all its modes."""
    nodes = {"A": (0, 0, 0), "B": (0.4, 0, 0), "C": (0.4, 0.4, 0)}
    whole = fb.Scene(fb.Frame.polyline(nodes, FLAT, up="z"), [fb.Clamped("A")])
    places = [("A-B", 0.1 * i) for i in range(1, 4)] + [("B-C", 0.1 * i) for i in range(1, 4)]
    expected = fb.Scene(whole.beam, whole.supports, springs=[fb.Spring(at, 0.0, direction="x") for at in places])
    omega = expected.reduce(6, elements=8).omega
    frame = fb.Frame.polyline({"A": (0, 0, 0), "B": (0.4, 0, 0)}, FLAT, up="z")
    element = frame.reduced(["A", "B"], modes=26, elements=4)
    assert len(element.labels) == 38
    for part, count in ((frame, 4), (element, None)):
        second = part.turned((0.0, 0.0, np.pi / 2))
        scene = fb.Scene(part, [fb.Clamped("A")], bodies=[fb.Scene(second)], joints=[fb.Joint("B", to=(1, "A"))])
        assert np.allclose(scene.reduce(6, elements=count).omega, omega, rtol=1e-9)
        assert np.allclose(scene.beam.position((1, "B")), nodes["C"])


def test_section_forces_of_bodies_whose_members_have_one_name():
    """A cantilever of twice the same frame under a load at its tip, M = P (2 - x): of each its own."""
    first, second = (fb.Frame({"A": (x, 0), "B": (x + 1, 0)}, [fb.Member("A", "B", FLAT)]) for x in (0, 1))
    tip = fb.PointForce((1, "B"), fb.Harmonic(3.0, 0.0), direction="y")
    joints = [fb.Joint("B", to=(1, "A"))]
    model = fb.Scene(first, [fb.Clamped("A")], bodies=[fb.Scene(second)], joints=joints, forces=[tip]).reduce(
        4, elements=2, residual=True
    )
    found = model.simulate(1e-6, 1e-6, model.equilibrium({((1, "B"), "y"): 3.0})).extremes("M")
    exact = {(number, s): 3.0 * (2 - number - s) for number in (0, 1) for s in (0.0, 0.5, 1.0)}
    places = [("A-B", s) if number == 0 else (1, ("A-B", s)) for number, s in exact]
    assert found.z == places
    np.testing.assert_allclose(found.highest, list(exact.values()), atol=1e-6)


def test_superelements_that_may_turn():
    """Two of a stiff arm, one on a ball hinge: three turns without resistance, the rest as with the arms as frames."""
    tube = fb.Section.tube(2e11, 7900.0, 0.0603, 0.0525)
    pipe = fb.Frame.polyline({"A": (0, 0, 0), "B": (2, 0, 0), "C": (2, 0, 1.5), "D": (2, 1, 1.5)}, tube)
    arm = fb.Frame.polyline({"f": (0, 0, 0), "l": (0, 0.3, 0)}, tube)
    joints = [fb.Joint("B", to=(1, "f")), fb.Joint("C", to=(2, "f"), dofs="xyz")]
    found = []
    for one in (arm, arm.reduced(["f", "l"], modes=2)):
        bodies = [fb.Scene(one), fb.Scene(one.turned((0, 0, np.pi)))]
        joined = fb.Scene(pipe, [fb.Clamped("A"), fb.Clamped("D")], bodies=bodies, joints=joints)
        found.append(joined.reduce(6).omega)
    assert np.allclose(found[1], found[0], rtol=3e-6)
    assert np.array_equal(found[1][:3], np.zeros(3))


def test_turned_as_frame_or_structure():
    """A superelement of a turned frame is the turned superelement."""
    from scipy.spatial.transform import Rotation

    rotation = Rotation.from_matrix(turned(3)).as_rotvec()
    frame = leg("AB")
    one, two = frame.turned(rotation).reduced(["A", "B"], 2, 4), frame.reduced(["A", "B"], 2, 4).turned(rotation)
    assert np.allclose(one.K.toarray()[:12, :12], two.K.toarray()[:12, :12], atol=1e-9 * abs(one.K).max())
    assert np.allclose(one.nodes["B"], two.nodes["B"])
    assert np.allclose(np.abs(one.M.toarray()), np.abs(two.M.toarray()), atol=1e-9)


def test_portal_in_three_pieces():
    """Joints in a chain, parts of the outer scene on any body: frequencies of the exact dynamic stiffness."""
    ends = [portal().members[i] for i in range(3)]
    column, girder, other = (fb.Frame({n: PORTAL[n] for n in (one.a, one.b)}, [one]) for one in ends)
    joints = [fb.Joint("B", (1, "B")), fb.Joint("C", (2, "C"), body=1)]
    supports = [fb.Clamped("A"), fb.Clamped((2, "D"))]
    stops = [fb.Stop((1, "C"), LAW, 1e-3, direction="x", name="eaves")]
    scene = fb.Scene(column, supports, stops=stops, bodies=[fb.Scene(girder), fb.Scene(other)], joints=joints)
    model = scene.reduce(4)
    exact = [46.79676568080308, 137.6560947561103, 306.7971337148636, 327.2072572248291]
    assert np.allclose(model.omega, exact, rtol=1e-6)
    assert [row.name for row in model.contact_rows] == ["eaves"]
    with pytest.raises(ValueError, match=r"must be of one body; bodies 1, 2 have it, got 'C' .*write \(1, 'C'\)"):
        fb.Scene(scene.beam, supports, stops=[fb.Stop("C", LAW, direction="x")])


def test_matrices_and_modes_of_other_programs():
    """A structure along a member is its springs and its mass there; given modes are an oscillator."""
    beam = fb.Frame({"A": (0, 0), "B": (4.0, 0)}, [fb.Member("A", "B", FLAT)])
    place = ("A-B", 1.3)
    body = Structure(np.diag([3e4, 2e4]), np.eye(2), labels=[("top", "x"), ("top", "y")])
    joined = fb.Scene(beam, [fb.Clamped("A")], bodies=[fb.Scene(body)], joints=[fb.Joint(place, (1, "top"))])
    springs = [fb.Spring(place, 3e4, direction="x"), fb.Spring(place, 2e4, direction="y")]
    plain = fb.Scene(beam, [fb.Clamped("A")], [fb.LumpedMass(place, 1.0)], springs)
    assert np.allclose(joined.reduce(3).omega, plain.reduce(3).omega, rtol=1e-9)
    given = Structure.of_modes([30.0], [[1.0]], [("seat", "y")], {"y": [1.0]})
    joined = fb.Scene(beam, [fb.Clamped("A")], bodies=[fb.Scene(given)], joints=[fb.Joint("B", (1, "seat"))])
    sprung = fb.Scene(beam, [fb.Clamped("A")], [fb.LumpedMass("B", 1.0)], [fb.Spring("B", 900.0, direction="y")])
    stretch = joined.reduce(4).omega  # the lumped mass moves along x, too
    assert np.allclose(stretch[:2], sprung.reduce(4).omega[:2], rtol=1e-6)
    assert joined.reduce(2).moved_along == ("y",)


def test_shaft_in_two_pieces():
    """Disks and unbalances on a joined shaft that spins: G and the loads of the shaft in one piece."""
    section = fb.Section.circle(2.1e11, 7850.0, 0.04)
    disk, unbalance = fb.Disk("B", mass=12.0, diametral=0.04, polar=0.075), fb.Unbalance("B", 1e-4)
    whole = fb.Frame.straight(0.5, section, spin=300.0, bending_only=True)
    half = fb.Frame.straight(0.25, section, spin=300.0, bending_only=True)
    one = fb.Scene(whole, [fb.Clamped("A")], masses=[disk], forces=[unbalance])
    bodies = [fb.Scene(half, masses=[disk], forces=[unbalance])]
    two = fb.Scene(half, [fb.Clamped("A")], bodies=bodies, joints=[fb.Joint("B", to=(1, "A"))])
    models = one.reduce(4, elements=8), two.reduce(4, elements=4)
    sizes = [np.linalg.svd(model.turning, compute_uv=False) for model in models]
    assert sizes[0][0] > 1.0
    assert np.allclose(*sizes, rtol=1e-3)
    pushes = [np.linalg.norm([vector for vector, _ in model.system.loads]) for model in models]  # of both planes
    assert pushes[0] == pytest.approx(pushes[1], rel=1e-3)
    assert [one(0.1) for _, one in models[0].system.loads] == [signal(0.1) for _, signal in models[1].system.loads]


def test_free_bodies_beside_joined_ones():
    """A body without a joint stays one of its own, met by stops."""
    free = fb.Scene(leg("AB"), [fb.Clamped("A")])
    stops = [fb.Stop("B", LAW, 1e-4, direction="z", on=(2, "B"))]
    scene = fb.Scene(leg("AB"), [fb.Clamped("A")], stops=stops, bodies=[fb.Scene(leg("BC")), free],
                     joints=[fb.Joint("B", to=(1, "B"))])  # fmt: skip
    assert scene.bodies == (free,)
    assert scene.stops[0].coordinate.to == (1, "B")
    assert len(scene.reduce(2).omega) == 4


def scene_of(joints, second=None, first=None, **options):
    """The legs joined in some way."""
    bodies = [second or fb.Scene(leg("BC"))]
    return fb.Scene(first or leg("AB"), [fb.Clamped("A")], bodies=bodies, joints=joints, **options)


AT_B = fb.Joint("B", (1, "B"))
HELD = fb.Scene(leg("BC"), [fb.Fixed("B", "x")])
LEGS = [fb.Scene(leg("BC")), fb.Scene(leg("BC"))]


# What cannot be joined, turned or reduced, each in a sentence.
test_refused = refused(
    (lambda: scene_of([AT_B], stops=[fb.Stop("A", LAW, direction="z", on=(5, "B"))]),
     "on must name a body, 1 to 1, got 5"),
    (lambda: scene_of([AT_B], masses=[fb.LumpedMass("B", 1.0, name="C")]),
     "part named 'C' must be at the place of that name, got 'B' in Scene"),
    (lambda: scene_of([AT_B, fb.Joint("B", (1, "B"), dofs="x")]), r"one dof twice \(x\), got \(0, 1\)"),
    (lambda: scene_of([fb.Joint("Bb", (1, "B"))]), r"'B' is the nearest there is, got 'Bb' in joints.0. of Scene"),
    (lambda: scene_of([fb.Joint("B", (1, "D"))]), r"is the nearest there is, got 'D' in joints.0. of Scene"),
    (lambda: scene_of([fb.Joint("B", (2, "B"))]), r"must name a body, 1 to 1, got \[2\]"),
    (lambda: scene_of([AT_B, fb.Joint("A", (1, "C"))]), "must meet .* got '0.58.* m between them'"),
    (lambda: scene_of([AT_B], fb.Scene(fb.Beam(1.0, FLAT))), "must be of frames and structures"),
    (lambda: scene_of([AT_B], fb.Scene(leg("BC"), damping=fb.ModalDamping(0.1))), "damping of a joined"),
    (lambda: scene_of([AT_B], stops=[fb.Stop("E", LAW, direction="x")]), "is the nearest"),
    (lambda: scene_of([AT_B], stops=[fb.Stop(("A-B", 60.0), LAW, direction="x")]),
     "the distance along member 'A-B' must lie within 0 to .* m, got 60.0 in stops"),
    (lambda: fb.Scene(leg("AB"), bodies=[fb.Scene(leg("AB")), fb.Scene(leg("BC"))], joints=[fb.Joint("B", (2, "B"))]),
     "come before the others"),
    (lambda: fb.Scene(leg("AB"), bodies=LEGS, joints=[fb.Joint("B", (2, "B"), body=1)]), "come before the others"),
    (lambda: scene_of([AT_B], HELD).beam.located("Q", "w"),
     "is the nearest there is, got 'Q' in w"),
    (lambda: leg("AB").turned((0, 0)), "must be three finite numbers"),
    (lambda: leg("AB").reduced(["Z"], 1), "nearest"),
    (lambda: leg("AB").reduced(["A"], -1), "at least 0"),
    (lambda: leg("AB").reduced([], 1), "must name the places"),
    (lambda: Structure([[1.0]], [[1.0]], labels=[("a", "x")]).turned((0, 0, 0.5)), "turns into; it has x, got 'y'"),
)  # fmt: skip


def test_held_twice():
    """Supports on both places of a joint hold one dof twice."""
    scene = scene_of([AT_B], HELD)
    scene = fb.Scene(scene.beam, [*scene.supports, fb.Fixed("B", "x")])
    with pytest.raises(ValueError, match="another one holds under another name, or by a joint"):
        scene.reduce(2)


def test_a_body_that_a_joint_moves_is_told():
    """Coordinates that meet, or begin at the joint, say nothing; others are moved, and the check says how far."""
    far = fb.Frame({"C": (5, 5), "D": (6, 5)}, [fb.Member("C", "D", fb.Section.rectangle(2.1e11, 7850.0, 0.02, 0.01))])
    near = fb.Frame.polyline({"A": (0, 0), "B": (1, 0)}, fb.Section.rectangle(2.1e11, 7850.0, 0.02, 0.01))
    said = fb.Scene(near, [fb.Clamped("A")], bodies=[fb.Scene(far)], joints=[fb.Joint("B", (1, "C"))]).check()
    assert [one for one in said if "moved by (-4, -5, 0) m, so that its 'C' meets" in one]
    for joint in (fb.Joint("B", (1, "A")), fb.Joint("A", (1, "A"))):
        said = fb.Scene(near, [fb.Clamped("A")], bodies=[fb.Scene(near)], joints=[joint]).check()
        assert not [one for one in said if "moved by" in one]


@pytest.mark.parametrize("apart", [1.1e-4, 2e-3])
def test_stops_close_together_beside_a_structure_by_its_matrices(apart):
    """Its K has no root: rounding of short elements took 1e-5 of the first frequency, static shapes were refused."""
    section = fb.Section.rectangle(1.9e11, 8000.0, width=0.03, height=0.002)
    frame = fb.Frame({"A": (0, 0), "B": (1, 0)}, [fb.Member("A", "B", section)])
    stops = [fb.Stop(("A-B", s), Hertz(1e8), 1e-4, direction="-y") for s in (0.7, 0.7 + apart)]
    K, M = np.diag([0.0, 1e3, 0.0]), np.diag([0.1, 0.1, 1e-4])
    end = fb.Structure(K, M, labels=[(1, "x"), (1, "y"), (1, "rz")], nodes={1: (0, 0, 0)})
    joints = [fb.Joint("B", to=(1, 1))]
    joined = fb.Scene(frame, [fb.Clamped("A")], stops=stops, bodies=[fb.Scene(end)], joints=joints)
    parts = {"masses": [fb.LumpedMass("B", 0.1, 1e-4)], "springs": [fb.Spring("B", 1e3, direction="y")]}
    whole = fb.Scene(frame, [fb.Clamped("A")], stops=stops, **parts).reduce(3, residual=True)
    found = joined.reduce(3, residual=True)
    np.testing.assert_allclose(found.omega[:3], whole.omega[:3], rtol=2e-7)
    compliance = [one.directions[0] ** 2 @ (1 / one.omega**2) for one in (found, whole)]
    assert compliance[0] == pytest.approx(compliance[1], rel=2e-7)
