"""Frames in scenes: the one-plane beam's own motion, balance of reactions, section forces, releases, meshes."""

from dataclasses import replace

import numpy as np
import pytest
from frames import portal, rigid_motions, space_l, turned

import fembeam as fb
import reduction
import solvers
from contacts import Hysteretic, KelvinVoigt
from fembeam.response import modal_accelerations
from fembeam.scene import with_value

STEEL = fb.Section.rectangle(2.1e11, 7850.0, width=0.02, height=0.01)
LAW = Hysteretic.lankarani_nikravesh(2.1e8, restitution=0.6)
PARTS = {"damping": fb.ModalDamping(0.01)}
DRIVE = fb.Harmonic(amplitude=2e-3, omega=60.0)


def one_plane(**options):
    """A cantilever on a plane with a stop below its middle."""
    return fb.Scene(fb.Beam(0.6, STEEL), [fb.Clamped(0.0)], base=DRIVE, **PARTS,
                    stops=[fb.Stop(0.4, LAW, gap=1e-4, side="below")], **options)  # fmt: skip


def as_frame(kind):
    """The same as a plane frame, as one in space turned anyhow, and as one of two planes; and which way is up."""
    Q = {"plane": np.eye(3), "turned": turned(8), "bending": np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])}[kind]
    end, up = Q @ [0.6, 0.0, 0.0], Q[:, 1]
    if kind == "plane":
        frame = fb.Frame({"A": (0, 0), "B": (0.6, 0)}, [fb.Member("A", "B", STEEL)])
    elif kind == "turned":
        frame = fb.Frame({"A": (0, 0, 0), "B": tuple(end)}, [fb.Member("A", "B", STEEL, up=tuple(up))])
    else:
        frame = fb.Frame.straight(0.6, STEEL, bending_only=True)
        up = np.array([0.0, 1.0, 0.0])
    base = dict(zip("xyz", (fb.Harmonic(2e-3 * n, 60.0) if n else None for n in up), strict=True))
    stop = fb.Stop(("A-B", 0.4), LAW, gap=1e-4, direction=tuple(-up))
    base = {name: signal for name, signal in base.items() if signal is not None}
    return fb.Scene(frame, [fb.Clamped("A")], stops=[stop], base=base, **PARTS), tuple(up)


@pytest.mark.parametrize("kind", ["plane", "turned", "bending"])
def test_the_motion_of_a_beam(kind):
    """Motion, contact log and spectrum of a frame on one line are those of the `Beam`, to rounding of its modes."""
    beam = one_plane().reduce(modes=3, elements=12)
    scene, up = as_frame(kind)
    whole = scene.reduce(modes=8, elements=12)
    mine = [i for i, w in enumerate(whole.omega) if np.min(np.abs(w / beam.omega - 1)) < 1e-8]
    frame = scene.reduce(modes=mine, elements=12)
    assert np.allclose(frame.omega, beam.omega, rtol=1e-9)
    runs = [model.simulate(duration=0.3, dt=1e-4) for model in (beam, frame)]
    places = (0.55, ("A-B", 0.55))
    u, v = runs[0].displacement(places[0]), runs[1].displacement(places[1], up)
    logs = [run.contacts for run in runs]
    assert len(logs[0].t_in) == len(logs[1].t_in) > 3
    assert np.allclose(logs[0].t_in, logs[1].t_in, rtol=0, atol=1e-8)
    assert np.allclose(logs[0].peak_force, logs[1].peak_force, rtol=1e-5)
    assert np.allclose(u, v, rtol=0, atol=1e-7 * np.abs(u).max())
    omega = [100.0, 400.0]
    spectra = [run.floor_spectrum(at, omega).acceleration for run, at in zip(runs, (0.6, ("B", up)), strict=True)]
    assert np.allclose(*spectra, rtol=1e-5)


def test_section_forces_of_a_run():
    """Moment and shear of the frame are those of the beam; N of a plane frame in bending is 0."""
    scene, _ = as_frame("plane")
    runs = [one.reduce(modes=3, elements=12).simulate(duration=0.05, dt=1e-3) for one in (one_plane(), scene)]
    found = runs[1].section_forces(("A-B", 0.13))
    assert list(found) == ["N", "Q", "M"]
    assert np.allclose(found["M"], runs[0].moment(0.13), rtol=0, atol=1e-6 * np.abs(found["M"]).max())
    assert np.allclose(found["Q"], runs[0].shear(0.13), rtol=0, atol=1e-6 * np.abs(found["Q"]).max())
    assert np.abs(found["N"]).max() < 1e-6 * np.abs(found["Q"]).max()
    assert np.allclose(runs[1].stress(("A-B", 0.0)), runs[0].stress(0.0), rtol=0, atol=1e-6 * 1e8)
    value, place, _ = runs[1].extremes("moment").largest
    assert place == ("A-B", 0.0)
    assert abs(value) == pytest.approx(np.abs(runs[0].moment(0.0)).max(), rel=1e-6)


def shaken(damping=0.01):
    """The space L, held at A, with stops on both sides of the corner and a mass on an arm, shaken along three axes."""
    signals = {c: fb.Harmonic(1e-3, 70.0 + 10 * i) for i, c in enumerate("xyz")}
    stops = [fb.Stop("B", KelvinVoigt(1e6, 50.0), gap=2e-4, direction=n) for n in ("z", "-z", "y", "-y")]
    masses = [fb.LumpedMass("C", mass=0.2, inertia=(1e-4, 2e-4, 3e-4), offset=(0.01, 0.0, 0.02))]
    return fb.Scene(space_l(), [fb.Clamped("A")], masses, stops=stops, base=signals, damping=fb.ModalDamping(damping))


def test_reactions_balance_inertia():
    """Reactions and contact forces, in six components, are the rate of momentum; in contact, too."""
    model = shaken(0.0).reduce(modes=6, elements=6)
    run = model.simulate(duration=0.2, dt=5e-4)
    made, position = model.matrices.assembled, model.scene.beam.position
    r = rigid_motions(made, position)
    M = model.matrices.loosened(replace(model.scene, supports=())).M
    motion = model.matrices.spread @ model.basis.vectors @ modal_accelerations(run).T
    for i, signal in enumerate(model.scene.base.values()):
        motion += np.outer(made.translations[:, i], signal.derivative(2)(run.t))
    reaction = run.reactions()[0]
    given = np.array([reaction[c] for c in ("x", "y", "z", "rx", "ry", "rz")])
    for i, way in enumerate([(0, 0, 1), (0, 0, -1), (0, 1, 0), (0, -1, 0)]):
        push = -np.outer(way, run.force(i))  # on the frame, against the way it closes
        given += np.vstack([push, np.cross(position("B"), push.T).T])
    assert sum(np.any(run.force(i) > 0) for i in range(4)) >= 2
    rate = r.T @ M @ motion
    assert np.allclose(given, rate, rtol=0, atol=1e-8 * np.abs(rate).max())


def test_section_forces_meet_the_reaction():
    """With all modes of the mesh the section forces at the clamp are the reaction, turned to the member's axes."""
    push = fb.PointForce("C", fb.Harmonic(30.0, 300.0), direction=(1.0, 2.0, -1.0))
    scene = fb.Scene(space_l(), [fb.Clamped("A")], forces=[push])
    run = scene.reduce(modes="all", elements=14).simulate(duration=0.02, dt=5e-4)
    found, reaction = run.section_forces(("A-B", 0.0)), run.reactions()[0]
    across, up, along = scene.beam.axes[0]
    force = np.array([reaction[c] for c in "xyz"])
    moment = np.array([reaction[c] for c in ("rx", "ry", "rz")])
    expected = {"N": -along @ force, "Q": up @ force, "Q2": across @ force}
    expected |= {"M": across @ moment, "M2": -up @ moment, "T": -along @ moment}
    for name, values in expected.items():
        assert np.allclose(found[name], values, rtol=0, atol=1e-6 * np.abs(values).max()), name


def skew(e):
    """e × as a matrix."""
    return np.cross(np.eye(3), e)


def test_inertia_tensor():
    """The mass matrix of a rigid body on an arm, J and m about the node; frequencies do not depend on the axes."""
    J = np.array([[0.02, 0.006, -0.004], [0.006, 0.015, 0.003], [-0.004, 0.003, 0.03]])
    m, arm = 0.3, np.array([0.01, 0.02, 0.03])

    def scene(Q, tensor):
        return fb.Scene(space_l(Q), [fb.Clamped("A")], masses=[fb.LumpedMass("C", m, tensor, Q @ arm)])

    made = scene(np.eye(3), J.tolist()).matrices(8)
    bare = fb.Scene(space_l(), [fb.Clamped("A")]).matrices(8)
    at = (made.assembled.rows("C") @ made.spread).toarray()
    lever = -m * skew(arm)
    expected = np.block([[m * np.eye(3), lever], [lever.T, J - m * skew(arm) @ skew(arm)]])
    assert np.allclose(at @ (made.M - bare.M) @ at.T, expected, atol=1e-14)
    omega = scene(np.eye(3), J).reduce(5, elements=8).omega
    turn = turned(4)
    assert np.allclose(scene(turn, turn @ J @ turn.T).reduce(5, elements=8).omega, omega, rtol=1e-9)
    assert not np.allclose(scene(np.eye(3), np.diag(J)).reduce(5, elements=8).omega, omega, rtol=1e-3)


@pytest.mark.parametrize(("tensor", "says"), [
    ([[1.0, 0.1, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], "must be symmetric"),
    ([[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 1.0]], "must not be negative about any axis, got -1.0"),
    ([[1.0, 0.1], [0.1, 1.0]], "must be three rows of three finite numbers"),
    ([1.0, [0.0, 1.0, 0.0], 1.0], "must be three rows of three finite numbers"),
    ([[1.0, 0.0, 0.0], [0.0, np.nan, 0.0], [0.0, 0.0, 1.0]], "must be three rows of three finite numbers"),
])  # fmt: skip
def test_inertia_tensors_that_are_none(tensor, says):
    """What is no tensor is refused in words."""
    with pytest.raises(ValueError, match=f"{says}.* in LumpedMass at 'C'"):
        fb.LumpedMass("C", 1.0, inertia=tensor)


def test_mesh_of_a_scene():
    """As few elements as its frequencies with supports ask: right to 1e-6, and fewer than whatever may hold it."""
    model = portal_scene().reduce(modes=4)
    exact = [46.79676568080308, 137.6560947561103, 306.7971337148636, 327.2072572248291]
    assert np.allclose(model.omega, exact, rtol=1e-6)
    places = portal_scene().places
    bound = portal().assembled(modes=4, places=places).mesh.elements.count
    assert model.matrices.assembled.mesh.elements.count < bound


def portal_scene():
    stop = fb.Stop("C", LAW, gap=1e-3, direction="x")
    return fb.Scene(portal(), [fb.Clamped("A"), fb.Clamped("D")], stops=[stop], base={"x": DRIVE})


def test_released_nodes():
    """A hinge at a clamped foot is one; all members released at a free node are refused, but for an inertia there."""
    hinged = replace(portal(), members=[replace(one, release="start rz") if one.a in "AD" else one
                                        for one in portal().members])  # fmt: skip
    pinned = fb.Scene(portal(), [fb.Pinned("A"), fb.Pinned("D")]).reduce(modes=3, elements=30)
    found = fb.Scene(hinged, [fb.Clamped("A"), fb.Clamped("D")]).reduce(modes=3, elements=30)
    assert np.allclose(found.omega, pinned.omega, rtol=1e-9)
    loose = replace(portal(), members=[replace(one, release="end rz") if one.a == "A" else
                                       replace(one, release="start rz") if one.a == "B" else one
                                       for one in portal().members])  # fmt: skip
    with pytest.raises(ValueError, match="releases must not free a node; 'B' moves along 'rz'"):
        fb.Scene(loose, [fb.Clamped("A"), fb.Clamped("D")]).reduce(modes=2)
    wheel, spring = fb.LumpedMass("B", mass=0.1, inertia=1.0), fb.Spring("B", 1e3, direction="rz")
    found = fb.Scene(loose, [fb.Clamped("A"), fb.Clamped("D")], [wheel], [spring]).reduce(modes=3, elements=9).omega
    assert np.min(np.abs(found / np.sqrt(1e3) - 1)) < 1e-9
    bar = fb.Section.rectangle(2e11, 7800.0, 0.02, 0.02)
    sides = (
        fb.Member("A", "B", bar, release=["end y", "end rz"]),
        fb.Member("B", "C", bar, release=["start y", "start rz"]),
    )
    row, ends = fb.Frame({"A": (0, 0), "B": (1, 0), "C": (2, 0)}, sides), [fb.Clamped("A"), fb.Clamped("C")]
    with pytest.raises(ValueError, match="releases must not free a node; 'B' moves along 'rz'"):  # y + 0.1 rz alone
        fb.Scene(row, ends, [fb.LumpedMass("B", 1.0, offset=(0.1, 0.0))]).reduce(modes=3)


def test_mechanisms():
    """Hinges that let a frame collapse are refused, with the motion; a frame that moves as a whole is not."""
    hinged = replace(portal(), members=[replace(one, release=("start rz", "end rz")) if one.name == "B-C" else one
                                        for one in portal().members])  # fmt: skip
    with pytest.raises(ValueError, match=r"must not be a mechanism; '[BC]' moves along 'x' .*, got \['B-C'\] in Scene"):
        fb.Scene(hinged, [fb.Pinned("A"), fb.Pinned("D")]).reduce(modes=2)
    low = replace(hinged, nodes={name: (x / 10, y / 10) for name, (x, y) in portal().nodes.items()})
    with pytest.raises(ValueError, match=r"'[BC]' moves along 'x'"):  # the turn of its posts is 3.3 times the number
        fb.Scene(low, [fb.Pinned("A"), fb.Pinned("D")]).reduce(modes=2)
    line = fb.Frame({"A": (0, 0, 0), "B": (0.5, 0, 0), "C": (1, 0, 0)},
                    [fb.Member("A", "B", STEEL, release="end along"), fb.Member("B", "C", STEEL)])  # fmt: skip
    with pytest.raises(ValueError, match=r"'A' moves along 'rx' .*, got \['A-B'\]"):  # turns only, none is a shift
        fb.Scene(line, [fb.Pinned("A"), fb.Clamped("C")]).reduce(modes=2)
    assert fb.Scene(hinged, [fb.Clamped("A"), fb.Pinned("D")]).reduce(modes=2, elements=9).omega[0] > 1.0
    for length, free in ((1e-8, False), (1e-6, True)):
        points = {"A": (0, 0, 0), "B": (0, 0, 2), "C": (length, 0, 2), "D": (1.5, 0, 2)}
        pipe = fb.Section.tube(2.1e11, 7850.0, 0.05, 0.04)
        stub = fb.Scene(fb.Frame.polyline(points, pipe), [] if free else [fb.Clamped("A")])
        said = "must settle|must be independent"  # by the rounding of the linear algebra, either sentence
        said += "" if free else "|the shortest member B-C of 1e-08 m.*nothing is released"
        with pytest.raises((ValueError, reduction.AccuracyError), match=said):
            stub.reduce(modes=8 if free else 1)
    free = fb.Scene(portal()).reduce(modes=4, elements=9)
    assert np.count_nonzero(free.omega == 0.0) == 3
    turning = fb.Scene(space_l(turned(3)), [fb.Pinned("A")]).reduce(modes=4, elements=4)
    assert np.count_nonzero(turning.omega == 0.0) == 3


def test_a_wheel_turns_in_its_bearing():
    """It has inertia but nothing that resists: a rigid motion, no mechanism; it turns by the share of the moment."""
    bar = fb.Section.circle(2.1e11, 7850.0, 0.03)
    shaft = fb.Frame({"A": (0, 0, 0), "B": (0.6, 0.3, 0.5)}, [fb.Member("A", "B", bar, release="end along")])
    moment = fb.PointMoment("B", fb.Harmonic(2.0, 0.0), direction="rx")
    scene = fb.Scene(shaft, [fb.Clamped("A")], [fb.LumpedMass("B", 1.0, 0.01)], forces=[moment])
    with pytest.warns(UserWarning, match="1 rigid-body mode appears"):
        model = scene.reduce(modes=5)
    assert np.count_nonzero(model.omega == 0.0) == 1
    run, axis = model.simulate(1e-3, 1e-4), shaft.axes[0, 2]
    found = sum(axis[i] * run.acceleration("B", way) for i, way in enumerate(("rx", "ry", "rz")))
    np.testing.assert_allclose(found, 2.0 * axis[0] / 0.01, rtol=1e-9)
    np.testing.assert_allclose(run.reactions()[0].moment @ axis, 0.0, atol=1e-9)


def pressed(force, upper=0.0, space=False):
    """Euler's column, clamped below, in one member or in two; in space its weak axis is the other one."""
    nodes = {"A": (0, 0), "B": (0.3, 0), "C": (1.0, 0)}
    nodes = {name: (*at, 0) for name, at in nodes.items()} if space else nodes
    up = {"up": "z"} if space else {}
    members = [fb.Member("A", "B", STEEL, axial_force=force, **up), fb.Member("B", "C", STEEL, axial_force=upper, **up)]
    return fb.Scene(fb.Frame(nodes, members), [fb.Clamped("A")])


def test_static_shapes_of_a_compressed_frame_on_a_fine_mesh():
    """Rounding of its stiffness grows to 6e-7 of a compliance, that of its root does not."""
    frame = fb.Frame(
        {"A": (0, 0, 0), "B": (0, 0, 1.0), "C": (0.8, 0.3, 1.0)},
        [fb.Member("A", "B", STEEL, up="y", axial_force=-300.0), fb.Member("B", "C", STEEL, up="z")],
    )
    stops = [
        fb.Stop("C", KelvinVoigt(1e6, 1.0), direction=(1, 2, -2)),
        fb.Stop("B", KelvinVoigt(1e6, 1.0), direction="y"),
    ]
    scene = fb.Scene(frame, [fb.Clamped("A")], masses=[fb.LumpedMass("C", 3.0, offset=(0.05, 0, 0.1))], stops=stops)
    for modes in (24, 34):
        assert scene.reduce(modes=modes, residual=True).omega.size == modes + 2


@pytest.mark.parametrize("space", [False, True], ids=["plane", "space"])
@pytest.mark.parametrize(("share", "elements"), [(0.5, 100), (0.5, 400), (0.999, 400)])
def test_a_compressed_column_on_a_fine_mesh(share, elements, space):
    """A load across its free end, N = EI k²: u = (tan k - k)/(EI k³), L = 1; by K alone off by 8e-8, or refused."""
    k, EI = 0.5 * np.pi * np.sqrt(share), STEEL.bending_stiffness
    scene = pressed(-EI * k**2, -EI * k**2, space)
    scene = replace(scene, stops=[fb.Stop("C", KelvinVoigt(1e6, 1.0), direction="z" if space else "y")])
    model = scene.reduce(modes=3, elements=elements, residual=True)
    found = np.sum(model.directions[0] ** 2 / model.omega**2)
    rounding, mesh = 4 * np.finfo(float).eps * elements**2, (np.pi / elements) ** 4 / 720
    assert found == pytest.approx((np.tan(k) - k) / (EI * k**3), rel=2 * (rounding + mesh) / (1 - share))


def test_reactions_of_joined_frames_near_buckling():
    """Under 1 N across the end of two halves of a column, N = EI k², moment tan(k)/k; both were off by 3e-4."""
    k, EI = 0.5 * np.pi * np.sqrt(0.999), STEEL.bending_stiffness
    lower, upper = (
        fb.Frame({a: (start, 0), b: (end, 0)}, [fb.Member(a, b, STEEL, axial_force=-EI * k**2)])
        for a, b, start, end in (("A", "B", 0.0, 0.4), ("B", "C", 0.4, 1.0))
    )
    push = fb.PointForce("C", fb.Harmonic(1.0, 0.0), direction="y")
    scene = fb.Scene(lower, [fb.Clamped("A")], damping=fb.ModalDamping(0.8), bodies=[fb.Scene(upper, forces=[push])],
                     joints=[fb.Joint("B", to=(1, "B"))])  # fmt: skip
    model = scene.reduce(4, elements=400, residual=True)
    foot = model.simulate(400.0 / model.omega[0], 10.0 / model.omega[0]).reactions()[0]
    assert abs(foot["y"][-1]) == pytest.approx(1.0, rel=1e-6)
    assert abs(foot["rz"][-1]) == pytest.approx(np.tan(k) / k, rel=1e-6)


def test_a_superelement_of_a_compressed_frame():
    """In all its modes it is the frame itself; its K keeps a root."""
    frame = pressed(-20.0, 5.0).beam
    part = frame.reduced(["A", "C"], modes=20)
    np.testing.assert_allclose(
        (part.root.T @ part.root).toarray(), part.K.toarray(), rtol=0, atol=1e-12 * abs(part.K).max()
    )
    whole, found = (fb.Scene(body, [fb.Clamped("A")]).reduce(modes=2).omega for body in (frame, part))
    np.testing.assert_allclose(found, whole, rtol=3e-6)


@pytest.mark.parametrize("space", [False, True], ids=["plane", "space"])
def test_a_frame_that_buckles_is_refused_with_the_critical_force(space):
    """Euler: π² EI/4L², the sentence names the member that loses most and its force then."""
    critical = np.pi**2 * STEEL.bending_stiffness / 4.0
    assert pressed(-0.999 * critical, -0.999 * critical, space).reduce(modes=1).omega[0] > 0.0
    for force in (1.001 * critical, 100.0 * critical):
        with pytest.raises(ValueError, match="axial_force of member 'B-C' must stay above") as refused:
            pressed(-force, -force, space).reduce(modes=1)
        assert "with all axial forces in proportion" in str(refused.value)
        said = float(str(refused.value).split("above ")[1].split(" N")[0])
        assert said == pytest.approx(-critical, rel=1e-4)


def test_one_member_that_buckles_is_named():
    with pytest.raises(ValueError, match=r"member 'A-B' must stay above .* where the frame buckles as it is held"):
        pressed(-1e6).reduce(modes=1)


def test_a_joined_frame_that_buckles_is_refused():
    lower = fb.Frame({"A": (0, 0), "B": (0.3, 0)}, [fb.Member("A", "B", STEEL)])
    upper = fb.Frame({"C": (0, 0), "D": (0.7, 0)}, [fb.Member("C", "D", STEEL, axial_force=-1e5)])
    scene = fb.Scene(lower, [fb.Clamped("A")], bodies=[fb.Scene(upper)], joints=[fb.Joint("B", to=(1, "C"))])
    with pytest.raises(ValueError, match="axial_force of member 'C-D' must stay above"):
        scene.reduce(modes=1)


def test_numbers_of_members_can_be_varied():
    """A softer first member, by its path, is the frame made so; in space with the way of its height."""
    scene = pressed(-10.0, space=True)
    changed = with_value(scene, "beam.members[0].axial_force", -100.0)
    expected = pressed(-100.0, space=True).reduce(modes=2).omega
    np.testing.assert_allclose(changed.reduce(modes=2).omega, expected, rtol=1e-12)


def across_its_plane(way):
    """A flat cantilever in space, softest along z, its base moving one way, stops at its tip along z and y."""
    frame = fb.Frame({"A": (0, 0, 0), "B": (1, 0, 0)}, [fb.Member("A", "B", STEEL, up="z")])
    stops = [fb.Stop("B", LAW, direction=one) for one in "zy"]
    return fb.Scene(frame, [fb.Clamped("A")], stops=stops, base={way: fb.Harmonic(1e-3, 40.0)}, **PARTS)


def test_a_stop_across_all_modes_is_at_rest_and_told():
    """Rounding of shapes is no motion: of it came contacts 1e-18 m deep, which changed those of others by 2e-6."""
    scene = across_its_plane("z")
    with pytest.warns(UserWarning, match="no mode kept moves the place of 'stop at B, y'"):
        model = scene.reduce(modes=[0])
    assert model.directions[1].tolist() == [0.0]
    assert set(model.simulate(0.5, 1e-3).contacts.stop) == {0}
    assert solvers.Newmark(dt=1e-4).stable_dt(model.system).flight > 0.0
    with pytest.raises(ValueError, match="a mode must move the stop"):
        model.strike(0.1, stop=1)
    assert "no mode kept moves" in str(scene.check(0.5, 1e-3, modes=1))


def test_a_load_across_all_modes_moves_nothing():
    """It moved them by 1e-20 m, and the log of a stop that just touches had 28 contacts."""
    with pytest.warns(UserWarning, match="no mode kept moves"):
        run = across_its_plane("y").reduce(modes=[0]).simulate(0.5, 1e-3)
    assert len(run.contacts) == 0
    assert not run.q.any()


def bent_frame(space, shear):
    section = fb.Section.tube(2.1e11, 7850.0, 0.05, 0.04)
    section = replace(section, shear=0.5 if shear else None)
    corner = (1.2, 0.3, 1.0) if space else (1.2, 1.0)
    up = (0.0, 0.0, 1.0) if space else (0.0, 1.0)
    nodes = {"A": (0.0,) * len(up), "B": up, "C": corner}
    return fb.Frame(nodes, [fb.Member("A", "B", section), fb.Member("B", "C", section)])


@pytest.mark.parametrize("space", [False, True])
@pytest.mark.parametrize("shear", [False, True])
def test_a_run_read_from_a_file_moves_between_the_nodes_of_members(tmp_path, space, shear):
    """Across a member as the model does; along and about it up to the parabolas, which are not in the file."""
    scene = fb.Scene(bent_frame(space, shear), [fb.Clamped("A")], base={"x": fb.Harmonic(1e-3, 60.0)})
    run = scene.reduce(modes=6).simulate(0.1, 1e-3)
    again = fb.load(run.save(tmp_path / "run.npz"))
    for s in (0.1, 0.3331, 0.7123):
        mine, theirs = run.motion(("B-C", s)), again.motion(("B-C", s))
        np.testing.assert_allclose(theirs, mine, atol=1e-4 * np.abs(mine).max())
    with pytest.raises(ValueError, match=r"the distance along member 'B-C' must lie within 0 to"):
        again.displacement(("B-C", 7.0), "x")
    with pytest.raises(ValueError, match="must be one that the run keeps; 'C' is the nearest there is, got 'Q'"):
        again.displacement("Q", "x")


def test_a_joined_run_read_from_a_file_moves_between_the_nodes_of_members(tmp_path):
    held = fb.Scene(bent_frame(True, False), [fb.Clamped("A")], base={"x": fb.Harmonic(1e-3, 60.0)})
    scene = replace(held, bodies=[fb.Scene(bent_frame(True, False))], joints=[fb.Joint("C", to=(1, "A"))])
    run = scene.reduce(modes=6).simulate(0.1, 1e-3)
    again = fb.load(run.save(tmp_path / "run.npz"))
    for place in (("B-C", 0.3331), (1, ("B-C", 0.3331))):
        mine = run.displacement(place, "y")
        np.testing.assert_allclose(again.displacement(place, "y"), mine, atol=1e-5 * np.abs(mine).max())


def test_the_base_load_of_a_frame_is_that_along_y():
    own = fb.Scene(portal(), [fb.Clamped("A"), fb.Clamped("D")]).matrices(4)
    assert np.array_equal(own.base_load, own.base_loads["y"])
    assert own.base_load.any()
