"""Elements of frames: reference frequencies, order of convergence with its constant, rigid motions, mass, spin."""

from dataclasses import replace

import numpy as np
import pytest
from frames import frequencies, portal, rigid_motions, space_l, static, turned, whirl
from refusals import refused
from scipy import linalg

import fembeam as fb
import reduction
from fembeam.beams import WAVE_STEP

STEEL = fb.Section.rectangle(2.1e11, 7850.0, width=0.02, height=0.01)
L_OMEGA = [104.6333966779874, 206.1055544860273, 329.4079614082485, 724.2568216310866, 1104.731296032686]


def test_portal():
    """Four frequencies of the exact dynamic stiffness, clamped feet."""
    exact = [46.79676568080308, 137.6560947561103, 306.7971337148636, 327.2072572248291]
    assert np.allclose(frequencies(portal().assembled(modes=4, places=["A", "D"]), 4, "A", "D"), exact, rtol=1e-6)


def test_space_l_at_any_angle():
    """Bending in both planes and torsion, whatever three angles turn it."""
    found = [frequencies(space_l(Q).assembled(elements=40), 5, "A") for Q in (np.eye(3), turned(1), turned(2))]
    assert np.allclose(found[0], L_OMEGA, rtol=1e-6)
    assert np.allclose(found[1:], found[0], rtol=1e-10)


def test_static_tip_of_space_l():
    """Castigliano's compliances, torsion of the first leg included."""
    made = space_l().assembled(elements=2)
    tip = made.rows("C")
    found = [float((tip[i] @ static(made, tip[i].toarray()[0], "A"))[0]) for i in range(3)]
    assert np.allclose(found, [3.858333333333e-5, 2.976904761905e-5, 2.665781476952e-4], rtol=1e-8)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_rigid_motions_and_mass(seed):
    """K r = 0 for six motions; rᵀMr is the mass along every axis, the inertia of thin rods about every axis."""
    frame = space_l(turned(seed))
    made = frame.assembled(elements=6)
    r = rigid_motions(made, frame.position)
    assert np.abs(made.K @ r).max() < 1e-12 * np.abs(made.K).max()
    inertia = r.T @ made.M @ r
    mass = 7850 * 2e-4 * 0.8
    assert np.allclose(inertia[:3, :3], mass * np.eye(3), atol=1e-12)
    points = [np.array([x, 0, 0]) for x in _gauss(0.5)[0]] + [np.array([0.5, y, 0]) for y in _gauss(0.3)[0]]
    weights = 1.57 * np.concatenate([_gauss(0.5)[1], _gauss(0.3)[1]])
    own = STEEL.rho * (STEEL.I + STEEL.I2)  # about the axis of each leg, of its own twist
    rods = sum(w * (p @ p * np.eye(3) - np.outer(p, p)) for w, p in zip(weights, points, strict=True))
    rods += own * np.diag([0.5, 0.3, 0.0])
    Q = turned(seed)
    assert np.allclose(inertia[3:, 3:], Q @ rods @ Q.T, atol=1e-12)


def _gauss(length):
    """Points and weights on [0, length], exact for squares."""
    x, w = np.polynomial.legendre.leggauss(2)
    return length * (0.5 + x / 2), length * w / 2


@pytest.mark.parametrize(("kind", "labels"), [("bending", ("y", "rz")), ("across", ("z", "ry")),
                                              ("stretch", ("x", "along")), ("twist", ("rx", "twist"))])  # fmt: skip
def test_order_and_constant(kind, labels):
    """Relative error of ω is (γ h)⁴/1440 for each kind of element, from below."""
    frame = fb.Frame({"A": (0, 0, 0), "B": (1.5, 0, 0)}, [fb.Member("A", "B", STEEL)])
    s = STEEL
    wave = np.pi / 1.5  # pinned at both ends, or clamped
    exact = {
        "bending": wave**2 * np.sqrt(s.E * s.I / s.line_mass),
        "across": wave**2 * np.sqrt(s.E * s.I2 / s.line_mass),
        "stretch": wave * np.sqrt(s.E / s.rho),
        "twist": wave * np.sqrt(s.torsion_stiffness / (s.rho * (s.I + s.I2))),
    }[kind]
    for elements in (3, 6, 12):
        made = frame.assembled(elements=elements)
        held = [(end, c) for end in ("A", "B") for c in ("x", "y", "z", "rx")]
        mine = [i for i, one in enumerate(made.labels) if one[1] in labels and one not in held]
        M, K = (A[mine][:, mine].toarray() for A in (made.M, made.K))
        error = np.sqrt(linalg.eigh(K, M, eigvals_only=True)[0]) / exact - 1
        order = (wave * 1.5 / elements) ** 4 / 1440
        assert 1 - 1 / elements**2 < error / order < 1.001


@pytest.mark.parametrize("options", [{}, {"axial_force": 500.0}, {"axial_force": -100.0}, {"foundation": 2e3}])
def test_straight_plane_frame_is_a_beam(options):
    """The bending dofs of a plane frame on one line have the matrices of a beam, tension and foundation included."""
    scene = fb.Scene(fb.Beam(1.5, STEEL, **options), [fb.Clamped(0.0)]).matrices(elements=7)
    frame = fb.Frame({"A": (0, 0), "B": (1.5, 0)}, [fb.Member("A", "B", STEEL, **options)])
    made = frame.assembled(elements=7)
    order = [made.labels.index((("A-B", s), c)) for s in scene.nodes[1:-1] for c in ("y", "rz")]
    order += [made.labels.index(("B", c)) for c in ("y", "rz")]
    for mine, given in ((made.M, scene.M), (made.K, scene.K)):
        assert abs(mine[order][:, order] - given).max() < 1e-13 * abs(given).max()


@pytest.mark.parametrize("plane", ["x", "y", "z"])
def test_across_uses_i2(plane):
    """In space, deflection along `up` uses I, and across it I2, whichever way the member runs."""
    along = np.roll(np.array([0.0, 0.0, 1.0]), 1 + "xyz".index(plane))
    up = np.roll(along, 1)
    frame = fb.Frame({"A": (0, 0, 0), "B": tuple(2.0 * along)}, [fb.Member("A", "B", STEEL, up=tuple(up))])
    made = frame.assembled(elements=1)
    tip = made.rows("B")[:3]
    for way, I in ((up, STEEL.I), (np.roll(up, 1), STEEL.I2)):
        row = way @ tip.toarray()
        assert row @ static(made, row, "A") == pytest.approx(8 / (3 * STEEL.E * I), rel=1e-9)


def test_unsymmetric_section():
    """I12 couples the planes: bending has the principal (I + I2)/2 ± √(((I - I2)/2)² + I12²)."""
    own = replace(STEEL, I=3e-9, I2=5e-9, I12=-2e-9)
    made = fb.Frame.straight(1.0, own, bending_only=True).assembled(modes=2, places=["A"])
    principal = 4e-9 + np.array([-1, 1]) * np.hypot(1e-9, 2e-9)
    exact = 1.875104068711961**2 * np.sqrt(own.E * principal / own.line_mass)
    assert np.allclose(frequencies(made, 2, "A"), exact, rtol=1e-6)
    tip = made.rows("B")[:2].toarray()
    compliance = tip @ np.array([static(made, row, "A") for row in tip]).T
    I = np.array([[own.I2, own.I12], [own.I12, own.I]])  # x across, y up
    assert np.allclose(compliance, np.linalg.inv(I) / (3 * own.E), rtol=1e-9)


SHAFT = fb.Section.circle(2.1e11, 7850.0, 0.04)


def test_spin_follows_the_first_member():
    """A shaft of two members drawn against each other whirls as that of one."""
    nodes = {"A": (0, 0, 0), "M": (0, 0, 0.35), "B": (0, 0, 0.6)}
    halves = fb.Frame(nodes, [fb.Member("A", "M", SHAFT), fb.Member("B", "M", SHAFT)], spin=500.0, bending_only=True)
    one = fb.Frame.straight(0.6, SHAFT, spin=500.0, bending_only=True)
    found = [whirl(frame.assembled(elements=24), "A")[:4] for frame in (halves, one)]
    assert np.allclose(*found, rtol=1e-5)


def test_hinge_by_release():
    """A member released about z at the clamp is pinned there: tan β = tanh β."""
    frame = fb.Frame({"A": (0, 0), "B": (1.0, 0)}, [fb.Member("A", "B", STEEL, release="start rz")])
    found = frequencies(frame.assembled(modes=1, places=["A", "B"]), 1, "A", "B")
    exact = 3.926602312047919**2 * np.sqrt(STEEL.bending_stiffness / STEEL.line_mass)
    assert found[0] == pytest.approx(exact, rel=1e-6)


def test_hinge_about_an_axis_of_the_member():
    """Released about its own `across`, a turned member in space is pinned for I and clamped for I2."""
    Q = turned(5)
    ends = {"A": (0.0, 0.0, 0.0), "B": tuple(Q @ [0.0, 0.0, 1.0])}
    frame = fb.Frame(ends, [fb.Member("A", "B", STEEL, up=tuple(Q[:, 1]), release="start across")])
    found = frequencies(frame.assembled(modes=3, places=["A", "B"]), 2, "A", "B")
    roots = np.array([3.926602312047919, 4.730040744862704])
    assert np.allclose(found, roots**2 * np.sqrt(STEEL.E * np.array([STEEL.I, STEEL.I2]) / STEEL.line_mass), rtol=1e-6)


def test_rigid_arm():
    """A load on a node at the end of a rigid arm ahead of the tip, and one beside the axis that twists."""
    length, arm, side = 1.2, 0.3, 0.2
    ends = {"A": (0.0, 0.0, 0.0), "B": (length + arm, 0.0, side)}
    member = fb.Member("A", "B", STEEL, offset=((0, 0, 0), (-arm, 0.0, -side)))
    made = fb.Frame(ends, [member]).assembled(elements=1)
    row = made.rows("B")[1].toarray()[0]
    EI, GJ = STEEL.bending_stiffness, STEEL.torsion_stiffness
    bent = (length**3 / 3 + arm * length**2 + arm**2 * length) / EI
    assert row @ static(made, row, "A") == pytest.approx(bent + side**2 * length / GJ, rel=1e-9)
    assert np.abs(made.K @ made.translations).max() < 1e-9 * abs(made.K).max()


def test_torsion_constant():
    """J of the square 0.1405770150 a⁴ (Timoshenko & Goodier), of a thin strip b³ a/3, of a circle 2 I."""
    assert pytest.approx(16 * 0.140577015, rel=1e-9) == fb.Section.rectangle(1.0, 1.0, 2.0, 2.0).J
    strip = fb.Section.rectangle(1.0, 1.0, 100.0, 1.0)
    assert pytest.approx(100 / 3 * (1 - 0.630249 / 100), rel=1e-6) == strip.J
    assert pytest.approx(fb.Section.rectangle(1.0, 1.0, 1.0, 100.0).J, rel=1e-14) == strip.J
    tube = fb.Section.tube(1.0, 1.0, 2.0, 1.0)
    assert tube.J == tube.I + tube.I2


def test_mesh_follows_the_modes():
    """Each of the lowest frequencies is right to 1e-6 on the mesh made for it, and not on a third of the elements."""
    made = space_l().assembled(modes=5, places=["A"])
    fine = frequencies(space_l().assembled(elements=200), 5, "A")
    assert np.all(frequencies(made, 5, "A") / fine - 1 < 1e-6)
    coarse = frequencies(space_l().assembled(elements=made.mesh.elements.count // 3), 5, "A")
    assert coarse[-1] / fine[-1] - 1 > 1e-6
    assert "1e-06" in made.accuracy


DEEP = replace(fb.Section.rectangle(2.1e11, 7850.0, width=0.1, height=0.2), shear=5 / 6)


def timoshenko(section, wave):
    """ω of a wave along a beam: EI κ⁴ - ρA ω² - ρI (1 + E/κG) κ² ω² + ρ² I ω⁴/κG = 0."""
    G = section.shear[0] * section.E / (2 * (1 + section.nu))
    rotary = section.rho * section.I
    terms = [rotary * section.rho / G, -section.line_mass - rotary * (1 + section.E / G) * wave**2]
    return np.sqrt(np.roots([*terms, section.E * section.I * wave**4]).min())


@pytest.mark.parametrize("omega", [2e3, 2e4, 2e5])
@pytest.mark.parametrize("kappa", [(5 / 6, 5 / 6), (0.85, 0.5)])
def test_as_many_elements_as_the_waves_of_shear_need(omega, kappa):
    """κ h stays below the step of the promise, whichever way a square bar bends, below and above the cut-off."""
    own = replace(fb.Section.rectangle(2.1e11, 7850.0, width=0.2, height=0.2), shear=kappa)
    G = min(kappa) * own.E / (2 * (1 + own.nu))  # cut-off √(κGA/ρI): 5.1e4 and 3.9e4 rad/s
    linear = -own.rho * own.I * (1 + own.E / G) * omega**2
    static = -own.line_mass * omega**2 + own.rho**2 * own.I * omega**4 / G
    wave = np.sqrt(np.roots([own.E * own.I, linear, static]).max())
    made = fb.Frame.straight(1.5, own).assembled(omega=omega)
    assert made.mesh.elements.count == np.ceil(1.5 * wave / WAVE_STEP)


@pytest.mark.parametrize("mode", [1, 3])
def test_shear_order_and_constant(mode):
    """Pinned at both ends, height 0.13 and 0.4 of half a wave: still fourth order, with 1.0 to 1.15 of the constant."""
    frame = fb.Frame({"A": (0, 0), "B": (1.5, 0)}, [fb.Member("A", "B", DEEP)])
    wave = mode * np.pi / 1.5
    for elements in (8, 16, 32):
        made = frame.assembled(elements=elements)
        held = [made.labels.index(one) for one in (("A", "x"), ("A", "y"), ("B", "y"))]
        free = np.setdiff1d(np.arange(len(made.labels)), held)
        omega = reduction.modal_basis(made.M[free][:, free], made.K[free][:, free], 8, root=made.root[:, free]).omega
        error = np.min(np.abs(omega / timoshenko(DEEP, wave) - 1))
        assert 1.0 < error / ((wave * 1.5 / elements) ** 4 / 1440) < 1.15


def test_shear_in_space():
    """Static tip P L³/3EI + P L/κGA in both ways of bending on one element; meshes for modes are right to 1e-6."""
    own = replace(DEEP, shear=(0.85, 0.6))
    frame = fb.Frame.straight(0.8, own)
    made = frame.assembled(elements=1)
    G = own.E / 2.6
    for component, I, shear in ((1, own.I, 0.85), (0, own.I2, 0.6)):
        row = made.rows("B").toarray()[component]
        exact = 0.8**3 / (3 * own.E * I) + 0.8 / (shear * G * own.A)
        assert row @ static(made, row, "A") == pytest.approx(exact, rel=1e-9)
    fine = frequencies(frame.assembled(elements=120), 6, "A")
    assert np.all(np.abs(frequencies(frame.assembled(modes=6, places=["A"]), 6, "A") / fine - 1) < 1e-6)


def test_shear_in_one_member_of_two():
    """Tip of a cantilever whose thick half alone has shear: ∫ (L - s)²/EI ds of bending, and a/κGA of that half."""
    thin, a, L = fb.Section.rectangle(2.1e11, 7850.0, width=0.1, height=0.1), 0.4, 0.8
    frame = fb.Frame({"A": (0, 0), "B": (a, 0), "C": (L, 0)}, [fb.Member("A", "B", DEEP), fb.Member("B", "C", thin)])
    made = frame.assembled(elements=2)
    row = made.rows("C").toarray()[1]
    bending = (L**3 - (L - a) ** 3) / (3 * DEEP.E * DEEP.I) + (L - a) ** 3 / (3 * thin.E * thin.I)
    exact = bending + a / (5 / 6 * DEEP.E / 2.6 * DEEP.A)
    assert row @ static(made, row, "A") == pytest.approx(exact, rel=1e-9)


# A `Beam` has no shear; coefficients are positive; I12 must be turned away.
test_shear_is_refused_where_it_is_not_meant = refused(
    (lambda: fb.Beam(1.0, DEEP), r"without shear deformation.* use Frame.straight"),
    (lambda: replace(STEEL, shear=(0.8, 0.0)), "one or two coefficients"),
    (lambda: replace(STEEL, shear=[[1], [1, 2]]), "shear must be one or two coefficients"),
    (lambda: replace(STEEL, shear=0.8, I12=1e-10), "I12 must be 0 with shear"),
)


@pytest.mark.parametrize("elements", [8, 20])
@pytest.mark.parametrize("seed", [3, 5])
def test_rigid_motions_in_space_do_not_hide_modes(seed, elements):
    """Held at one point by its displacements alone, a frame turns three ways at any angle, whatever number of modes."""
    made = space_l(turned(seed)).assembled(elements=elements)
    free = np.setdiff1d(np.arange(len(made.labels)), made.rows("A")[:3].indices)
    M, K = (A[free][:, free] for A in (made.M, made.K))
    found = [reduction.modal_basis(M, K, count, root=made.root[:, free]).omega for count in (4, 7, 10)]
    assert all(np.array_equal(omega[:3], np.zeros(3)) for omega in found)
    assert np.allclose([omega[3] for omega in found], found[0][3], rtol=1e-9)
