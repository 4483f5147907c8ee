"""Matrices of joined bodies: the whole from its parts, hinges, places within elements, what is refused."""

import numpy as np
import pytest
from frames import PORTAL, SPACE_L, frequencies, portal, static
from refusals import refused
from structures import ELEMENTS, beam_labels, beam_matrices

import fembeam as fb
from fembeam.structures import JoinedBodies, Joint, Structure

FLAT = fb.Section.rectangle(2.1e11, 7850.0, width=0.02, height=0.01)


def legs():
    """The two legs of the space L, each a frame of its own."""
    return [fb.Frame.polyline({name: SPACE_L[name] for name in leg}, FLAT, up="z") for leg in ("AB", "BC")]


def test_two_legs_are_the_l():
    """Joined at B they have the frequencies of the frame in one piece, on the same elements."""
    bodies = legs()
    whole = JoinedBodies(bodies, [Joint("B", to=(1, "B"))]).joined([body.assembled(elements=5) for body in bodies])
    places = [("A-B", 0.1 * i) for i in range(1, 5)] + [("B-C", 0.06 * i) for i in range(1, 5)]
    one = fb.Frame.polyline(SPACE_L, FLAT, up="z").assembled(elements=10, places=places)
    assert len(whole.labels) == len(one.labels)
    assert np.allclose(frequencies(whole, 5, (0, "A")), frequencies(one, 5, "A"), rtol=1e-10)
    mass = whole.translations.T @ whole.M @ whole.translations
    assert np.allclose(mass, 7850 * 2e-4 * 0.8 * np.eye(3), atol=1e-12)
    at_joint = [whole.rows((0, "B")) - whole.rows((1, "B")), whole.rows((1, ("B-C", 0.0))) - whole.rows((0, "B"))]
    assert all(abs(rows).max() < 1e-12 for rows in at_joint)


def test_hinge_is_a_release():
    """A joint of displacements alone is a hinge."""
    left = fb.Frame({name: PORTAL[name] for name in "ABC"}, portal().members[:2])
    right = fb.Frame({name: PORTAL[name] for name in "CD"}, portal().members[2:])
    made = [left.assembled(elements=14), right.assembled(elements=6)]
    hinged = JoinedBodies((left, right), [Joint("C", to=(1, "C"), dofs="xy")]).joined(made)
    hinge = fb.Member("D", "C", portal().members[2].section, release="end rz")
    whole = fb.Frame(PORTAL, [*portal().members[:2], hinge]).assembled(elements=20)
    assert np.allclose(frequencies(hinged, 4, (0, "A"), (1, "D")), frequencies(whole, 4, "A", "D"), rtol=1e-10)


def test_joint_between_nodes():
    """A spring under a place of a beam, by formula; within an element both still move as one."""
    beam = fb.Frame({"A": (0, 0), "B": (1.0, 0)}, [fb.Member("A", "B", FLAT)])
    prop = Structure([[3e4]], [[1.0]], labels=[("top", "y")])
    middle = ("A-B", 0.5)
    made, coarse = (
        JoinedBodies((beam, prop), [Joint(middle, to=(1, "top"))]).joined([one, prop.assembled()])
        for one in (beam.assembled(elements=2, places=[middle]), beam.assembled(elements=1))
    )
    assert abs(coarse.rows((0, middle))[1] - coarse.rows((1, "top"))[1]).max() < 1e-15
    load = made.rows((0, "B")).toarray()[1]
    EI, k = FLAT.bending_stiffness, 3e4
    reaction = (5 / (48 * EI)) / (1 / (24 * EI) + 1 / k)
    row = made.rows((1, "top")).toarray()[1]
    assert row @ static(made, load, (0, "A")) * k == pytest.approx(reaction, rel=1e-9)


@pytest.mark.parametrize(("joints", "says"), [
    ([Joint("B", to=(1, "B")), Joint("B", to=(1, ("B-C", 0.0)), dofs="x")], "twice, got \"'x' of joints.1.\""),
    ([Joint("E", to=(1, "B"))], "'B' is the nearest there is, got 'E' in joints.0."),
    ([Joint("B", to=(2, "B"))], "bodies below 2, got 2"),
])  # fmt: skip
def test_refused(joints, says):
    """A motion fixed twice, places and bodies that do not exist."""
    bodies = legs()
    with pytest.raises(ValueError, match=says):
        JoinedBodies(bodies, joints).assembled(elements=2)


LEVEL = fb.Frame({"A": (0, 0), "B": (1.0, 0)}, [fb.Member("A", "B", FLAT)])

test_refused_alone = refused(
    (lambda: Joint("A", to=(0, "B")), "two bodies"),
    (lambda: Joint("A", to=(1, "B"), dofs="xx"), "each once"),
    (lambda: Joint("A", to=(1, "B"), dofs=0), "dofs must be some of x, y, z"),
    (lambda: Joint("A", to=(1, "B"), dofs=[["x"]]), "dofs must be some of x, y, z"),
    (
        lambda: JoinedBodies([legs()[0], LEVEL], [Joint("B", to=(1, "A"), dofs="xyz")]),
        r"they share x, y, rz, got .'z'. in",
    ),
)


def test_a_superelement_held_by_its_own_stiffness_is_loaded_as_it_is_moved():
    """Base motion and weight of a chain with springs to the frame inside: reduced, turned, joined, and the whole."""
    rng = np.random.default_rng(3)
    nodes = range(6)
    labels = [(node, c) for node in nodes for c in "xy"]
    bars = np.diff(np.eye(6), axis=0)
    K = np.kron(bars.T @ np.diag(rng.uniform(1e4, 3e4, 5)) @ bars, np.array([[2.0, 0.3], [0.3, 1.0]]))
    K[4:8, 4:8] += np.diag(rng.uniform(2e3, 6e3, 4))
    M = np.diag(rng.uniform(0.5, 2.0, 12))
    body = fb.Structure(K, M, labels=labels)
    small, angle = body.reduced([0, 5], modes=8), (0.0, 0.0, 0.7)
    whole, turned = body.turned(angle), small.turned(angle)
    post = fb.Structure([[5e3, 0.0], [0.0, 4e3]], np.diag([1.0, 2.0]), labels=[("top", "x"), ("top", "y")])
    assert small.digest != small.knowing(small.root, 2.0 * small.moved).digest
    for one, other in ((body, small), (whole, turned), (body, small.reduced([0, 5], modes=8))):
        for to, mates in ((None, (None, None)), ("top", (post, post)), (5, (body, small))):
            rest = {"supports": [fb.Fixed(0)], "joints": [fb.Joint(5, to=(1, to))] if to else []}
            rest |= {"masses": [fb.LumpedMass(5, 0.5)], "gravity": (3.0, -9.81)}
            rest |= {"base": {"x": fb.Harmonic(1e-3, 40.0), "y": fb.Harmonic(2e-3, 55.0)}}
            pairs = ((one, mates[0]), (other, mates[1]))
            scenes = [fb.Scene(b, bodies=[fb.Scene(mate)] if mate else [], **rest) for b, mate in pairs]
            runs = [scene.reduce(modes="all").simulate(0.3, 1e-3) for scene in scenes]
            for c in "xy":
                exact = runs[0].displacement(5, c)
                np.testing.assert_allclose(runs[1].displacement(5, c), exact, atol=1e-8 * np.ptp(exact))
                exact = runs[0].reactions()[0][c]
                np.testing.assert_allclose(runs[1].reactions()[0][c], exact, atol=1e-8 * np.ptp(exact))


def test_a_superelement_keeps_dofs_without_mass_of_its_nodes():
    """A clamped beam of two halves whose rotations have no mass is joined in these too, as it is without reduction."""
    K, M = beam_matrices()
    half = Structure(K, np.diag(np.diag(M) * np.tile([1.0, 0.0], ELEMENTS + 1)), labels=beam_labels())
    joints = [fb.Joint(ELEMENTS, to=(1, 0))]
    exact, found = (
        fb.Scene(half, [fb.Clamped(0)], bodies=[fb.Scene(other)], joints=joints).reduce(4).omega
        for other in (half, half.reduced([0, ELEMENTS], modes=4))
    )
    np.testing.assert_allclose(found, exact, rtol=3e-4)


def hinged(side, release):
    """Half of a beam of 2 m in the plane, in one member."""
    ends = {"A": (side, 0), "B": (side + 1.0, 0)}
    return fb.Frame(ends, [fb.Member("A", "B", FLAT, release=release)])


def test_a_hinge_on_both_sides_of_a_joint_frees_its_nodes():
    """The modes failed from inside: "Factor is exactly singular"; a support or inertia on either side holds both."""
    left, right, joint = hinged(0.0, "end rz"), hinged(1.0, "start rz"), fb.Joint("B", to=(1, "A"))
    clamps = [fb.Clamped("A"), fb.Clamped((1, "B"))]

    def rig(*supports, **parts):
        return fb.Scene(left, [*clamps, *supports], bodies=[fb.Scene(right)], joints=[joint], **parts)

    with pytest.raises(ValueError, match=r"'B' moves along 'rz', with no inertia, got .'A-B', 'A-B'. in Scene"):
        rig().reduce(3)
    whole = fb.Scene(left, clamps, bodies=[fb.Scene(hinged(1.0, ()))], joints=[joint]).reduce(3)
    held = [rig(fb.Fixed(place, "rz")).reduce(3) for place in ((0, "B"), (1, "A"))]
    for model in held:
        assert np.allclose(model.omega, whole.omega, rtol=1e-9)


def test_what_holds_a_released_node():
    """An offset mass does, by m e²; a spring without inertia does not, which failed with the pivots of M."""
    frame = fb.Frame(
        {"A": (0, 0), "B": (1, 0), "C": (2, 0)},
        [fb.Member("A", "B", FLAT, release="end rz"), fb.Member("B", "C", FLAT, release="start rz")],
    )
    clamps, spring = [fb.Clamped("A"), fb.Clamped("C")], fb.Spring("B", 0.1, direction="rz")
    with pytest.raises(ValueError, match="'B' moves along 'rz', with no inertia"):
        fb.Scene(frame, clamps, springs=[spring]).reduce(2)
    hinges = [(f"{end} rx", f"{end} ry", f"{end} rz") for end in ("end", "start")]
    chain = [fb.Member(*ends, FLAT, release=free) for ends, free in zip(("AB", "BC"), hinges, strict=True)]
    space = fb.Frame({"A": (0, 0, 0), "B": (1, 0.5, 0.2), "C": (2, 0, 1)}, chain)
    with pytest.raises(
        ValueError, match="releases must not free a node; 'B' moves along"
    ):  # about its arm it turns freely
        fb.Scene(space, clamps, [fb.LumpedMass("B", 1.0, offset=(0.1, 0.1, 0.0))]).reduce(2)
    arm, inertia = (
        fb.Scene(frame, clamps, [mass], [spring]).reduce(2)
        for mass in (fb.LumpedMass(1.0, 1.0, offset=(0.0, 0.1)), fb.LumpedMass("B", 1.0, inertia=0.01))
    )
    assert arm.omega[0] == pytest.approx(np.sqrt(10.0), rel=1e-3)
    assert inertia.omega[0] == pytest.approx(np.sqrt(10.0), rel=1e-9)


def matrices_alone(frame):
    """The same body without the strains that a frame knows."""
    made = frame.assembled(elements=24)
    labels = [one if one[0] in frame.nodes else (f"inside {i}", "mode") for i, one in enumerate(made.labels)]
    return Structure(made.K, made.M, labels=labels)


@pytest.mark.parametrize("modes", [0, 1, 3, 6, 12, 24])
@pytest.mark.parametrize("nodes", [["f"], ["f", "t"]])
@pytest.mark.parametrize("given", [lambda frame: frame, matrices_alone])
def test_a_free_superelement_has_six_rigid_motions(given, nodes, modes):
    """A slender arm on one flange or two: its interface resists no rigid motion, its frequencies come from above."""
    arm = fb.Frame.polyline({"f": (0, 0, 0), "m": (0, 0.4, 0), "t": (0.1, 0.5, 0.3)}, FLAT)
    small = given(arm).reduced(nodes, modes=modes)
    found = fb.Scene(small).reduce(modes="all").omega
    exact = fb.Scene(arm).reduce(modes=10).omega[6]
    assert np.all(found[:6] == 0.0)
    assert np.all(found[6:] > exact * (1.0 - 1e-6))
    assert modes < 6 or found[6] < exact * 1.01
    assert "resists" not in " ".join(small.check())
