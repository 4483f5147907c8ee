"""Section forces of frames: statics by hand, modes against the closed form, equilibrium of joints, those of a beam."""

from dataclasses import replace

import numpy as np
import pytest
from frames import free_dofs, frequencies, portal, space_l, static, turned

import fembeam as fb
import reduction
from fembeam.response import section_forces
from fembeam.structures import FORCES

STEEL = fb.Section.rectangle(2.1e11, 7850.0, width=0.02, height=0.01)


def of_static(made, load, *places):
    """Section forces of the static answer to a load (N,)."""
    u = static(made, load, *places)
    return made.section_forces(u[:, None], np.zeros((len(u), 1)))


@pytest.mark.parametrize("seed", [None, 4])
def test_statics_of_space_l(seed):
    """A tip load along z of the L: bending of both legs, torsion of the first, signs as on a straight beam."""
    Q = np.eye(3) if seed is None else turned(seed)
    made = space_l(Q).assembled(elements=4)
    found = of_static(made, Q[:, 2] @ made.rows("C").toarray()[:3], "A")
    s = 0.2  # u = z: M = EI u'' = P (L - s), Q = -P; leg A-B twists by what the load does about x, 0.3 m
    assert np.allclose(found.rows(("B-C", s)).T, [0, -1, 0.1, 0, 0, 0], atol=1e-10)
    assert np.allclose(found.rows(("A-B", s)).T, [0, -1, 0.3, 0, 0, 0.3], atol=1e-10)
    found = of_static(made, Q[:, 0] @ made.rows("C").toarray()[:3], "A")  # along x: across B-C, tension of A-B
    assert np.allclose(found.rows(("A-B", s), ("N", "Q", "M", "T")).T, [1, 0, 0, 0], atol=1e-10)
    assert np.allclose(space_l().axes[:, 0], [[0, 1, 0], [-1, 0, 0]])  # across A-B is y, across B-C is -x
    assert np.allclose(found.rows(("A-B", s), ("Q2", "M2")).T, [0, -0.3], atol=1e-10)
    assert np.allclose(found.rows(("B-C", s), ("Q2", "M2")).T, [1, -0.1], atol=1e-10)


def test_stress_of_skew_bending():
    """σ = N/A - y M/I - x M2/I2 at any point of the section; by default at the lower fibre."""
    made = fb.Frame.straight(1.0, STEEL).assembled(elements=2)
    load = 3 * made.rows("B").toarray()[1] + 2 * made.rows("B").toarray()[0] + 50 * made.rows("B").toarray()[2]
    found = of_static(made, load, "A")
    assert found.stress(0.0)[0] == pytest.approx(50 / STEEL.A + 3 * 0.005 / STEEL.I, rel=1e-9)
    corner = 50 / STEEL.A - 0.005 * 3 / STEEL.I - 0.01 * 2 / STEEL.I2
    assert found.stress("A", x=0.01, y=0.005)[0] == pytest.approx(corner, rel=1e-9)
    with pytest.raises(ValueError, match=r"among N, Q, M, Q2, M2, T"):
        found.rows(0.5, ("V",))
    with pytest.raises(ValueError, match="must lie on one member; 2 meet"):
        of_static(portal().assembled(elements=6), np.zeros(portal().assembled(elements=6).K.shape[0]), "A").rows("B")


def test_stress_in_the_plane():
    """σ = N/A - y M/I of tension and bending at once."""
    made = fb.Frame({"A": (0, 0), "B": (1, 0)}, [fb.Member("A", "B", STEEL)]).assembled(elements=2)
    found = of_static(made, np.array([50.0, 3.0, 0.0]) @ made.rows("B").toarray(), "A")
    assert found.stress(("A-B", 0.25), y=0.002)[0] == pytest.approx(50 / STEEL.A - 0.002 * 2.25 / STEEL.I, rel=1e-9)
    assert found.stress(("A-B", 0.25))[0] == pytest.approx(50 / STEEL.A + 0.005 * 2.25 / STEEL.I, rel=1e-9)


def test_modes_have_the_forces_of_the_closed_form():
    """Moment and shear of a cantilever mode, tension of a rod mode, torque of a shaft mode: to 1e-5 and better."""
    made = fb.Frame.straight(1.0, STEEL).assembled(modes=6, places=["A"])
    free = free_dofs(made, "A")
    M, K = (A[free][:, free].toarray() for A in (made.M, made.K))
    basis = reduction.modal_basis(M, K, root=made.root[:, free])
    vectors = np.zeros((len(made.labels), basis.count))
    vectors[free] = basis.vectors
    found = made.section_forces(vectors, vectors * basis.omega**2)
    rod = int(np.argmin(np.abs(basis.omega - np.pi / 2 * np.sqrt(STEEL.E / STEEL.rho))))
    shaft = np.pi / 2 * np.sqrt(STEEL.torsion_stiffness / (STEEL.rho * (STEEL.I + STEEL.I2)))
    twisted = int(np.argmin(np.abs(basis.omega - shaft)))
    tip = made.rows("B").toarray() @ vectors
    s = np.array([0.0, 0.37, 0.9])
    wave = np.pi / 2 * np.cos(np.pi / 2 * s)
    N, T = (np.array([found.rows(place, (name,))[0] for place in s]) for name in ("N", "T"))
    assert np.allclose(N[:, rod], STEEL.E * STEEL.A * wave * tip[2, rod], rtol=1e-5)
    assert np.allclose(T[:, twisted], STEEL.torsion_stiffness * wave * tip[5, twisted], rtol=1e-5)
    b = 1.875104068711961
    ratio = (np.cosh(b) + np.cos(b)) / (np.sinh(b) + np.sin(b))
    curve = b**2 * (np.cosh(b * s) + np.cos(b * s) - ratio * (np.sinh(b * s) + np.sin(b * s)))
    end = np.cosh(b) - np.cos(b) - ratio * (np.sinh(b) - np.sin(b))
    moment = np.array([found.rows(place, ("M",))[0, 0] for place in s])
    assert np.allclose(moment, STEEL.E * STEEL.I * curve / end * tip[1, 0], rtol=1e-5)


@pytest.mark.parametrize("tension", [0.0, 800.0])
def test_straight_frame_has_the_forces_of_a_beam(tension):
    """Moment and shear of the modes of a straight frame, and of a `Beam`, between nodes as well."""
    scene = fb.Scene(fb.Beam(1.0, STEEL, axial_force=tension), [fb.Clamped(0.0)])
    beam = section_forces(scene.reduce(modes=3, elements=9))
    frame = fb.Frame({"A": (0, 0), "B": (1.0, 0)}, [fb.Member("A", "B", STEEL, axial_force=tension)])
    made = frame.assembled(elements=9)
    free = free_dofs(made, "A")
    basis = reduction.modal_basis(made.M[free][:, free], made.K[free][:, free], 3, root=made.root[:, free])
    vectors = np.zeros((len(made.labels), 3))
    vectors[free] = basis.vectors
    found = made.section_forces(vectors, vectors * basis.omega**2)
    for place in (0.0, 0.234, 0.8):
        mine = found.rows(("A-B", place), ("M", "Q"))
        given = np.array([beam.moment(place)[0], beam.shear(place)[0]])
        assert np.allclose(np.abs(mine), np.abs(given), rtol=1e-6, atol=1e-8 * np.abs(given).max())


def test_joints_balance():
    """Two members meet at a joint without mass: what is tension of one is shear of the other, the moment goes on."""
    made = portal().assembled(elements=60)
    omega = frequencies(made, 3, "A", "D")
    free = free_dofs(made, "A", "D")
    vectors = np.zeros((len(made.labels), 3))
    vectors[free] = reduction.modal_basis(made.M[free][:, free], made.K[free][:, free], 3).vectors
    found = made.section_forces(vectors, vectors * omega**2)
    column, girder = found.rows(("A-B", 3.0)), found.rows(("B-C", 0.0))  # N, Q, M; up of A-B is -x
    size = np.abs(girder).max(axis=1)
    assert np.allclose(column[0], -girder[1], atol=1e-6 * size[1])
    assert np.allclose(column[1], girder[0], atol=1e-6 * size[0])
    assert np.allclose(column[2], girder[2], atol=1e-6 * size[2])
    assert found.names == FORCES[:3]


@pytest.mark.parametrize("space", [False, True])
def test_a_thick_stub_at_the_end_of_a_rod_has_the_forces_of_statics(space):
    """0.2 mm long: times its stiffness the rounding of displacements is 2e-3 of the load; stresses have none."""
    rod, stub = (fb.Section.rectangle(2.1e11, 7850.0, side, side) for side in (0.01, 0.02))
    points = {"A": (0, 0), "B": (1.5, 0), "C": (1.5002, 0), "D": (1.5002, 0.7)}
    nodes = {name: (*at, 0) if space else at for name, at in points.items()}
    frame = fb.Frame(nodes, [fb.Member("A", "B", rod), fb.Member("B", "C", stub), fb.Member("C", "D", rod)])
    loads = {("D", "x"): 20.0, ("B", "y"): 30.0}
    forces = [fb.PointForce(place, fb.Harmonic(size, 0.0), direction=way) for (place, way), size in loads.items()]
    model = fb.Scene(frame, [fb.Clamped("A")], forces=forces).reduce(modes=4, residual=True)
    run = model.simulate(1e-6, 1e-6, model.equilibrium(loads))
    for place, wanted in ((("B-C", 1e-4), (20.0, 0.0, -14.0)), (("A-B", 0.5), (20.0, -30.0, 16.0))):
        found = run.section_forces(place)
        assert [found[name][0] for name in ("N", "Q", "M")] == pytest.approx(wanted, abs=1e-6)
    reaction = run.reactions()[0]
    assert [reaction[name][0] for name in ("x", "y", "rz")] == pytest.approx((-20.0, -30.0, -31.0), abs=3e-5)


@pytest.mark.parametrize("elements", [8, 16])
def test_rotary_inertia_between_nodes(elements):
    """A pinned beam that deforms in shear: β = B cos kx, M' = Q - ρI ω² β; Q between nodes was off by 4 %."""
    own = replace(fb.Section.rectangle(2.1e11, 7850.0, width=0.1, height=0.2), shear=5 / 6)
    made = fb.Frame({"A": (0, 0), "B": (1, 0)}, [fb.Member("A", "B", own)]).assembled(elements=elements)
    free = np.setdiff1d(np.arange(len(made.labels)), [made.labels.index((n, c)) for n in "AB" for c in "xy"])
    M, K = (A[free][:, free].toarray() for A in (made.M, made.K))
    basis = reduction.modal_basis(M, K, root=made.root[:, free])
    u = np.zeros((len(made.labels), 1))
    u[free, 0] = basis.vectors[:, 0]
    found = made.section_forces(u, u * basis.omega[0] ** 2)
    k, S, EI = np.pi, 5 / 6 * 2.1e11 / 2.6 * own.A, own.bending_stiffness
    W = (made.rows(("A-B", 0.5)).toarray() @ u)[1, 0]
    B = W * (S * k**2 - own.line_mass * basis.omega[0] ** 2) / (S * k)
    for x in (0.31, 0.56, 0.81):
        assert found.rows(("A-B", x), ("Q",))[0, 0] == pytest.approx(-S * (W * k - B) * np.cos(k * x), rel=2e-3)
        assert found.rows(("A-B", x), ("M",))[0, 0] == pytest.approx(-EI * B * k * np.sin(k * x), rel=2e-4)


@pytest.mark.parametrize("links", [1, 3])
def test_rigid_motions_carry_no_section_forces(links):
    """A rod, or a chain on ball hinges with nine such motions: N and M under an oblique load grew with the angle."""
    rods = [
        fb.Frame({f"A{i}": (0, 0, 0), f"B{i}": (1, 0, 0)}, [fb.Member(f"A{i}", f"B{i}", STEEL)]) for i in range(links)
    ]
    scene = fb.Scene(
        rods[0],
        [fb.Pinned("A0")],
        bodies=[fb.Scene(rod) for rod in rods[1:]],
        joints=[fb.Joint(f"B{i}", to=(i + 1, f"A{i + 1}"), dofs="xyz", body=i) for i in range(links - 1)],
        forces=[fb.PointForce(f"B{links - 1}", fb.Harmonic(100.0, 9.0), direction=(0.6, 0.8, 0.0))],
    )
    assert scene.rigid_body_modes == 3 * links
    with pytest.warns(UserWarning, match="rigid-body modes appear"):
        model = scene.reduce(modes=3 * links + 4, residual=True)
    forces = section_forces(model)
    for s in (0.0, 0.3, 0.9):
        rows = np.abs(forces.rows(("A0-B0", s)))
        assert rows[:, model.omega == 0.0].max() < 1e-9 * rows.max()
