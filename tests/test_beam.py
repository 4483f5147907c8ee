"""Sections, beams, Hermite matrices: identities, closed-form frequencies, order of convergence."""

import math
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from refusals import refused
from scipy.optimize import brentq

import reduction
from fembeam.beams import Beam, Section, Taper, bending_matrices, bending_root, hermite_rows
from fembeam.scene import Clamped, Guided, LumpedMass, Pinned, Scene

UNIT = Section(E=1.0, rho=1.0, A=1.0, I=1.0)
CLAMPED_FREE = [1.8751040687, 4.6940911330, 7.8547574382]


def omegas(scene, modes, **mesh):
    matrices = scene.matrices(modes=modes, **mesh)
    return reduction.modal_basis(matrices.M, matrices.K, modes, root=matrices.root).omega


SPANS, UNEVEN = (
    Beam.of_spans([(0.4, UNIT), (0.6, Section(2.0, 3.0, 0.5, 0.7))]),
    np.array([0.0, 0.1, 0.25, 0.4, 0.7, 1.0]),
)


def test_section_shapes():
    plate, rod = Section.rectangle(1, 1, width=2, height=3), Section.circle(1, 1, diameter=2)
    np.testing.assert_allclose([plate.A, plate.I, rod.A, rod.I], [6, 4.5, math.pi, math.pi / 4])
    tube, outer, inner = Section.tube(1, 1, 3, 2), Section.circle(1, 1, 3), Section.circle(1, 1, 2)
    np.testing.assert_allclose([tube.A, tube.I], [outer.A - inner.A, outer.I - inner.I])
    assert [(one.fibre, one.fibre2) for one in (plate, rod, tube)] == [(1.5, 1.0), (1.0, 1.0), (1.5, 1.5)]


@pytest.mark.parametrize("name", ["E", "rho", "A", "I"])
@pytest.mark.parametrize("bad", [-1.0, 0.0, math.nan, math.inf, "steel", None, True])
def test_section_rejects(name, bad):
    with pytest.raises(ValueError, match=f"^{name} must be (finite and positive|a number), got .* in Section; give"):
        replace(UNIT, **{name: bad})


test_message_reads_what_got_where_do = refused(
    (lambda: Section(-1.0, 1, 1, 1), r"E must be finite and positive, got -1\.0 in Section; give Young's mod"),
    (lambda: Section.tube(1, 1, 1.0, 2.0), r"inner must be below outer = 1\.0, got 2\.0 in Section\.tube"),
)


def test_beam_of_spans():
    beam = Beam.of_spans([(0.25, UNIT), (0.5, replace(UNIT, I=2.0)), (0.125, UNIT)])
    assert beam.length == pytest.approx(0.875)
    assert beam.borders == pytest.approx((0.0, 0.25, 0.75, 0.875))
    assert beam.bending_stiffness([0.05, 0.25, 0.74, 0.75, 0.875]) == pytest.approx([1, 2, 2, 1, 1])
    assert Beam.of_spans([(0.1, UNIT)]) == Beam(0.1, UNIT)
    assert Beam.of_spans([(0.7, UNIT), (0.1, UNIT)]).length == 0.8  # not 0.7999999999999999, where 0.8 lies outside
    assert replace(Beam(0.1, UNIT), length=0.2) == Beam(0.2, UNIT)
    with pytest.raises(FrozenInstanceError):
        beam.length = 1.0


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, "1"])
def test_beam_rejects_lengths(bad):
    with pytest.raises(ValueError, match=r"length must be (finite and positive|a number), got .* in Beam"):
        Beam(bad, UNIT)
    with pytest.raises(ValueError, match=r"length of span 1 must be (finite and positive|a number)"):
        Beam.of_spans([(1.0, UNIT), (bad, UNIT)])


test_beam_rejects_sections = refused(
    (lambda: Beam.of_spans([]), "spans must be pairs, one at least"),
    (lambda: Beam(1.0, 3.0), "section of span 0 must be a Section", TypeError),
    (lambda: replace(Beam.of_spans([(1.0, UNIT), (1.0, UNIT)]), length=3.0), "length must be"),
)


def test_textbook_element():
    h, EI, m = 0.3, 2.0, 5.0
    K, M = bending_matrices(Beam(h, Section(EI, m, 1.0, 1.0)), np.array([0.0, h]))
    K_e = [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h**2, -6 * h, 2 * h**2],
           [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h**2, -6 * h, 4 * h**2]]  # fmt: skip
    M_e = [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h**2, 13 * h, -3 * h**2],
           [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h**2, -22 * h, 4 * h**2]]  # fmt: skip
    np.testing.assert_allclose(K.toarray(), EI / h**3 * np.array(K_e), rtol=1e-13)
    np.testing.assert_allclose(M.toarray(), m * h / 420 * np.array(M_e), rtol=1e-13)


def test_rigid_motions_cost_nothing_and_carry_the_mass():
    beam, z = SPANS, UNEVEN
    K, M = bending_matrices(beam, z)
    rigid = np.zeros((2 * len(z), 2))
    rigid[0::2, 0], rigid[0::2, 1], rigid[1::2, 1] = 1.0, z, 1.0
    assert np.abs(K @ rigid).max() < 1e-13 * abs(K).max()
    r = rigid[:, 0]
    assert r @ (M @ r) == pytest.approx(0.4 + 0.6 * 1.5, rel=1e-14)
    inertia = 0.4**3 / 3 + 1.5 * (1 - 0.4**3) / 3  # ∫ ρA z² dz
    assert rigid[:, 1] @ (M @ rigid[:, 1]) == pytest.approx(inertia, rel=1e-14)


TAPERED = Taper(Section.rectangle(1.0, 12.0, 1.0, 1.0), Section.rectangle(1.0, 12.0, 0.4, 0.2))


@pytest.mark.parametrize(
    ("beam", "nodes"),
    [
        (SPANS, UNEVEN),
        (Beam(1.0, UNIT), np.linspace(0.0, 1.0, 1001)),
        (Beam(1.0, TAPERED, foundation=3.0, axial_force=2.0), np.linspace(0.0, 1.0, 8) ** 1.5),
        (Beam(1.0, TAPERED, foundation=3.0, axial_force=-2.0), np.linspace(0.0, 1.0, 8) ** 1.5),
    ],
    ids=["two spans", "fine mesh", "tapered, on a foundation, under tension", "under compression"],
)
def test_root_squares_to_the_stiffness(beam, nodes):
    K, R = bending_matrices(beam, nodes)[0], bending_root(beam, nodes)
    assert abs(R.T @ R - K).max() < 1e-13 * abs(K).max()


def test_a_tapered_element_has_the_inertia_of_its_section():
    """ρA is of second degree where width and height change: so M has integrands of degree 8."""
    beam, z = Beam(1.0, TAPERED), np.polynomial.Polynomial([0.0, 1.0])
    line_mass = 12.0 * (1.0 - 0.6 * z) * (1.0 - 0.8 * z)
    np.testing.assert_allclose(beam.line_mass([0.0, 0.5, 1.0]), line_mass(np.array([0.0, 0.5, 1.0])), rtol=1e-14)
    M = bending_matrices(beam, np.array([0.0, 1.0]))[1]
    shapes = [1 - 3 * z**2 + 2 * z**3, z - 2 * z**2 + z**3, 3 * z**2 - 2 * z**3, z**3 - z**2]
    exact = [[(line_mass * a * b).integ()(1.0) for b in shapes] for a in shapes]
    np.testing.assert_allclose(M.toarray(), exact, rtol=1e-12)


def test_interpolation_is_exact_for_cubics():
    nodes = UNEVEN
    u = np.polynomial.Polynomial([1.0, -2.0, 3.0, 4.0])
    dofs = np.column_stack([u(nodes), u.deriv()(nodes)]).ravel()
    z = np.linspace(0, 1, 41)
    for derivative in (0, 1, 2):
        exact = u.deriv(derivative)(z) if derivative else u(z)
        np.testing.assert_allclose(hermite_rows(nodes, z, derivative) @ dofs, exact, rtol=1e-12, atol=1e-12)
    with pytest.raises(ValueError, match="derivative must be 0, 1 or 2, got 3"):
        hermite_rows(nodes, z, 3)


@pytest.mark.parametrize(
    ("masses", "beta_L"),
    [
        ((), CLAMPED_FREE),
        ((LumpedMass(1.0, 1.0),), [1.247917409606, 4.031139436715]),
        ((LumpedMass(1.0, 1.0, inertia=0.01),), [1.242447907723, 3.638624542260]),
    ],
)
def test_cantilever_frequencies(masses, beta_L):
    scene = Scene(Beam(1.0, UNIT), [Clamped(0.0)], masses)
    np.testing.assert_allclose(omegas(scene, len(beta_L)), np.square(beta_L), rtol=1e-6)


def test_a_mass_of_nothing_changes_nothing():
    beam, clamp = Beam(1.0, UNIT), [Clamped(0.0)]
    light = Scene(beam, clamp, masses=[LumpedMass(0.5, 0.0)]).reduce(modes=3)
    np.testing.assert_allclose(light.omega, Scene(beam, clamp).reduce(modes=3).omega, rtol=1e-6)
    turned, dense = (Scene(beam, clamp, masses=[LumpedMass(0.5, mass, 0.1)]).reduce(modes=3) for mass in (0.0, 1e-12))
    np.testing.assert_allclose(turned.omega, dense.omega, rtol=1e-9)


@pytest.mark.parametrize("count", [1, 2, 5, 30])
def test_every_kept_mode_is_right(count):
    found = omegas(Scene(Beam(1.0, UNIT), [Clamped(0.0)]), count)
    guesses = [1.8751] + [(2 * i - 1) * np.pi / 2 for i in range(2, count + 1)]
    exact = [brentq(lambda x: np.cos(x) + 1 / np.cosh(x), g - 0.1, g + 0.1, xtol=1e-14) for g in guesses]
    error = np.abs(found / np.square(exact) - 1)
    assert error.max() < 1e-6
    assert error.max() > 3e-7  # no more elements than needed
    if count == 30:
        assert error[0] < 1e-11  # rounding of 530 elements would take 1e-6 without the root


@pytest.mark.parametrize(
    ("supports", "beta_L"),
    [
        ([Pinned(0.0), Pinned(1.0)], np.pi * np.arange(1, 9)),
        ([Guided(0.0), Guided(1.0)], np.pi * np.arange(0, 8)),
        ([Clamped(0.0), Clamped(1.0)], [4.730040744863, 7.853204624096]),
        ([], [0.0, 0.0, 4.730040744863, 7.853204624096]),
        ([Pinned(0.0)], [0.0, 3.926602312048, 7.068582745629]),
    ],
)
@pytest.mark.filterwarnings("ignore:.*rigid-body:UserWarning")
def test_other_ends(supports, beta_L):
    found = omegas(Scene(Beam(1.0, UNIT), supports), len(beta_L))
    np.testing.assert_allclose(found, np.square(beta_L), rtol=1e-6)
    assert np.all(found[np.equal(beta_L, 0)] == 0.0)  # rigid-body modes exactly


def test_fourth_order_with_constant_1_1440():
    scene = Scene(Beam(1.0, UNIT), [Pinned(0.0), Pinned(1.0)])
    counts, exact = np.array([12, 16, 24, 32]), (3 * np.pi) ** 2
    error = np.array([omegas(scene, 3, elements=int(n))[2] / exact - 1 for n in counts])
    order = -np.polyfit(np.log(counts), np.log(error), 1)[0]
    assert order == pytest.approx(4, abs=0.15)
    assert error * (counts / (3 * np.pi)) ** 4 == pytest.approx(1 / 1440, rel=0.03)


def test_stepped_beam_against_its_characteristic_determinant():
    thin = Section(1.0, 1.0, 0.1, 1e-3)  # wavenumber 10**0.5 times that of the unit section
    scene = Scene(Beam.of_spans([(1.0, UNIT), (0.5, thin)]), [Clamped(0.0)])

    def determinant(omega):
        b1, b2 = math.sqrt(omega), math.sqrt(omega) * 100**0.25
        return np.linalg.det(_join(b1, 1.0, 1.0, b2, 0.5, 1e-3)) / math.cosh(b1) / math.cosh(b2)

    found = omegas(scene, 4)
    for omega in found:
        assert brentq(determinant, omega * (1 - 1e-3), omega * (1 + 1e-3), rtol=1e-13) == pytest.approx(omega, rel=1e-6)


def _waves(b, z):
    """Rows u, u', u'', u''' of cos, sin, cosh, sinh (b z)."""
    c, s, C, S = math.cos(b * z), math.sin(b * z), math.cosh(b * z), math.sinh(b * z)
    rows = [[c, s, C, S], [-s, c, S, C], [-c, -s, C, S], [s, -c, S, C]]
    return np.array(rows) * b ** np.arange(4.0)[:, None]


def _join(b1, L1, EI1, b2, L2, EI2):
    """Clamped at 0, joined at L1, free at L1 + L2: 8 conditions on 8 amplitudes."""
    A = np.zeros((8, 8))
    A[:2, :4] = _waves(b1, 0.0)[:2]
    weights1, weights2 = np.array([1, 1, EI1, EI1]), np.array([1, 1, EI2, EI2])
    A[2:6, :4], A[2:6, 4:] = weights1[:, None] * _waves(b1, L1), -weights2[:, None] * _waves(b2, 0.0)
    A[6:, 4:] = _waves(b2, L2)[2:]
    return A
