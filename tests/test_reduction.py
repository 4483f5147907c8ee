"""Modal basis: normalisation, choice, signs, self-checks, dense against sparse, and what is refused."""

import numpy as np
import pytest
from problems import soft_behind_stiff
from refusals import refused, refused_by
from scipy import sparse

import reduction
from contacts import KelvinVoigt
from fembeam.beams import Beam, Section
from fembeam.scene import Clamped, Impactor, LumpedMass, Pinned, Scene
from reduction import modal

UNIT = Section(E=1.0, rho=1.0, A=1.0, I=1.0)


@pytest.fixture(scope="module")
def cantilever():
    return Scene(Beam(1.0, UNIT), [Clamped(0.0)], [LumpedMass(0.8, 0.5, 0.01)]).matrices(elements=50)


@pytest.fixture(scope="module")
def chain():
    """Free chain of 200 unit masses and springs: omega = 2 sin(i π / 2n)."""
    n = 200
    K = sparse.diags([[-1.0] * (n - 1), [1.0, *[2.0] * (n - 2), 1.0], [-1.0] * (n - 1)], [-1, 0, 1]).tocsr()
    return sparse.eye(n, format="csr"), K, 2 * np.sin(np.arange(n) * np.pi / (2 * n))


@pytest.mark.parametrize("count", [1, 5, 60, 200])
def test_chain(chain, count):
    M, K, omega = chain
    basis = reduction.modal_basis(M, K, count)
    np.testing.assert_allclose(basis.omega, omega[:count], rtol=1e-9)
    assert basis.omega[0] == 0.0
    assert basis.count == count
    np.testing.assert_allclose(basis.project_matrix(M), np.eye(count), atol=1e-12)
    np.testing.assert_allclose(basis.project_matrix(K), np.diag(omega[:count] ** 2), atol=1e-12)


def test_dense_and_sparse_agree(cantilever, monkeypatch):
    found = []
    for limit in (0, 1000):
        monkeypatch.setattr(modal, "DENSE_LIMIT", limit)
        found.append(reduction.modal_basis(cantilever.M, cantilever.K, 5, root=cantilever.root))
    np.testing.assert_allclose(found[0].omega, found[1].omega, rtol=1e-11)
    np.testing.assert_allclose(found[0].vectors, found[1].vectors, atol=1e-7 * np.abs(found[0].vectors).max())


@pytest.mark.parametrize("kind", ["bsr", "coo", "csc", "csr", "dia", "dok", "lil"])
def test_matrices_of_any_sparse_kind(kind):
    found = reduction.modal_basis(sparse.eye(2).asformat(kind), sparse.diags([4.0, 9.0]).asformat(kind))
    assert found.omega.tolist() == [2.0, 3.0]


def test_list_of_modes_is_a_part_of_the_whole(cantilever):
    M, K = cantilever.M, cantilever.K
    whole, part = reduction.modal_basis(M, K, 6), reduction.modal_basis(M, K, indices=[5, 0, 2])
    np.testing.assert_allclose(part.omega, whole.omega[[0, 2, 5]], rtol=1e-9)
    np.testing.assert_allclose(part.vectors, whole.vectors[:, [0, 2, 5]], atol=1e-6 * np.abs(whole.vectors).max())


def test_all_modes_rebuild_the_matrices():
    matrices = Scene(Beam(1.0, UNIT), [Clamped(0.0)]).matrices(elements=6)
    basis = reduction.modal_basis(matrices.M, matrices.K, root=matrices.root)
    inverse = np.linalg.inv(matrices.M.toarray())
    np.testing.assert_allclose(basis.vectors @ basis.vectors.T, inverse, rtol=1e-8, atol=1e-8 * abs(inverse).max())


def test_same_basis_every_time(cantilever):
    first, second = (reduction.modal_basis(cantilever.M, cantilever.K, 4) for _ in range(2))
    assert np.array_equal(first.vectors, second.vectors)


def test_expand_and_project(cantilever):
    basis = reduction.modal_basis(cantilever.M, cantilever.K, 3)
    q = np.arange(24.0).reshape(2, 4, 3)
    u = basis.expand(q)
    assert u.shape == (2, 4, 100)
    np.testing.assert_allclose(u[1, 2], basis.vectors @ q[1, 2], rtol=1e-12)
    np.testing.assert_allclose(basis.project(cantilever.M @ u[1, 2]), q[1, 2], rtol=1e-8)
    rows = cantilever.interpolation([0.3, 0.8])
    np.testing.assert_allclose(basis.project(rows.T), basis.project(rows.toarray().T), rtol=1e-14)
    load = cantilever.base_load
    np.testing.assert_allclose(basis.effective_mass(load), basis.participation(load) ** 2)


def test_arrays_are_untouched_and_basis_is_frozen():
    M, K = np.diag([1.0, 2.0, 3.0]), np.diag([3.0, 2.0, 1.0])
    copies = M.copy(), K.copy()
    basis = reduction.modal_basis(M, K, 2, root=np.sqrt(K))
    assert np.array_equal(M, copies[0])
    assert np.array_equal(K, copies[1])
    with pytest.raises(ValueError, match="read-only"):
        basis.vectors[0, 0] = 1.0
    vectors = np.eye(2)
    reduction.Basis(vectors, np.ones(2))
    vectors[0, 0] = 2.0  # the caller's array stays writable


# --- signs -----------------------------------------------------------------------------------------------


def test_sign_by_direction(cantilever):
    basis = reduction.modal_basis(cantilever.M, cantilever.K, 5)
    for z in (0.8, 0.3):
        direction = cantilever.interpolation(z).toarray()[0]
        assert np.all(reduction.oriented(basis, direction).project(direction) > 0)
        flipped = reduction.oriented(basis, -direction)
        assert np.all(flipped.project(direction) < 0)
        np.testing.assert_array_equal(np.abs(flipped.vectors), np.abs(basis.vectors))
        heavy = reduction.Basis(1e-12 * basis.vectors, basis.omega)
        assert np.all(reduction.oriented(heavy, -direction).project(direction) < 0)


def test_sign_by_largest_displacement_nearest_the_end():
    vectors = np.array([[-3.0, 1.0], [2.0, -0.5], [1.0, -1.0]])
    oriented = reduction.oriented(reduction.Basis(vectors, np.ones(2)), np.eye(3))
    np.testing.assert_array_equal(oriented.vectors, [[3, -1], [-2, 0.5], [-1, 1]])
    matrices = Scene(Beam(1.0, UNIT), [Clamped(0.0)]).matrices(elements=10)
    basis = reduction.oriented(reduction.modal_basis(matrices.M, matrices.K, 4), matrices.interpolation(matrices.nodes))
    np.testing.assert_allclose(basis.project(matrices.interpolation(1.0).T).ravel(), 2.0, rtol=1e-2)


def test_a_node_at_the_direction_falls_back():
    basis = reduction.Basis(np.array([[0.0, 1e-17], [-2.0, -2.0]]), np.ones(2))
    np.testing.assert_array_equal(reduction.oriented(basis, [1.0, 0.0]).vectors[1], [2.0, 2.0])


# --- self-checks and bad input ---------------------------------------------------------------------------


@pytest.mark.parametrize("off", [1e-6, -1e-6])
def test_wrong_vectors_are_noticed(cantilever, monkeypatch, off):
    solve = modal._solve

    def skewed(*given):
        omega_squared, vectors = solve(*given)
        return omega_squared, vectors * (1 + off)

    monkeypatch.setattr(modal, "_solve", skewed)
    with pytest.raises(reduction.AccuracyError, match="modes must be orthonormal to 1e-09, got 2e-06"):
        reduction.modal_basis(cantilever.M, cantilever.K, 3)


def test_wrong_frequencies_are_noticed(chain, monkeypatch):
    solve = modal._solve
    monkeypatch.setattr(modal, "_solve", lambda *given: (solve(*given)[0] + 1e-6, solve(*given)[1]))
    with pytest.raises(reduction.AccuracyError, match="must be below 1e-09, got"):
        reduction.modal_basis(*chain[:2], 3)


def lattice(*counts):
    """K and M of a free lattice of springs, at whose nodes three displacements are coupled; ω² = σ Σ (2 - 2 cos)."""
    lines = [sparse.diags([-np.ones(n - 1), [1.0, *[2.0] * (n - 2), 1.0], -np.ones(n - 1)], [-1, 0, 1]) for n in counts]
    K = sparse.kron(sparse.kronsum(sparse.kronsum(*lines[:2]), lines[2]), 1e6 * np.eye(3) + 2e5)
    return sparse.eye(K.shape[0], format="csr"), K.tocsr()


def test_modes_of_a_free_body_without_root():
    """Three rigid motions of 1080 dofs: with the least shift their rounding hid the elastic modes."""
    M, K = lattice(6, 6, 10)
    found = reduction.modal_basis(M, K, 6).omega
    lowest = np.sqrt(2.0 - 2.0 * np.cos(np.pi / 10)) * np.sqrt([1e6, 1e6, 1.6e6])
    assert found[:3].tolist() == [0.0] * 3
    np.testing.assert_allclose(found[3:], lowest, rtol=1e-8)


@pytest.mark.parametrize("mass", [1e-12, 1e12])
@pytest.mark.parametrize("stiffness", [1e-12, 1e12])
def test_modes_in_any_units(chain, mass, stiffness):
    """Chains, free and on a soft mount: φ goes as 1/√mass, ω as √(stiffness/mass), and what is rigid stays so."""
    M, K, _ = chain
    mount, root = sparse.csr_matrix(([1e-4], ([0], [0])), (200, 200)), np.diff(np.eye(200), axis=0)
    for own, R in ((K, None), (K, root), (K + mount, None)):
        usual = reduction.modal_basis(M, own, 6, root=R)
        scaled = None if R is None else np.sqrt(stiffness) * R
        again = reduction.modal_basis(mass * M, stiffness * own, 6, root=scaled)
        np.testing.assert_allclose(again.omega, np.sqrt(stiffness / mass) * usual.omega, rtol=1e-8)
        np.testing.assert_allclose(np.sqrt(mass) * again.vectors, usual.vectors, atol=1e-6)


@pytest.mark.parametrize("count", [1, 2, 5])
def test_soft_modes_behind_stiff_ones_without_root(count):
    """Refused, or the lowest given as a rigid-body mode."""
    M, K, exact = soft_behind_stiff()
    omega = reduction.modal_basis(M, K, count).omega
    np.testing.assert_allclose(omega**2, exact[:count], rtol=1e-11)


@pytest.mark.parametrize("count", [1, 3, 30])
def test_a_soft_mount_beside_a_stiff_support_is_no_rigid_body_mode(count):
    """Half of a chain on a spring of 1e-2, the other held by one of 1e12; the lowest frequency was given as 0."""
    springs = np.full(80, 1e5)
    springs[[0, 40]] = 1e12, 1e-2
    K = sparse.diags([-springs[1:], np.add(springs, [*springs[1:], 0.0]), -springs[1:]], [-1, 0, 1])
    omega = reduction.modal_basis(sparse.eye(80), K, count).omega
    assert omega[0] ** 2 == pytest.approx(1e-2 / 40, rel=1e-4)


def test_factors_of_large_matrices(monkeypatch):
    """Ordered as symmetric ones they have little more than half the fill, and give the same modes and shapes."""
    M, K = lattice(8, 8, 15)
    K = (K + 1e2 * M).tocsr()
    usual, factors, load = reduction.modal_basis(M, K, 6), modal.factored(K), np.eye(K.shape[0])[:, -1:]
    shapes = reduction.static_shapes(M, K, load, np.zeros((K.shape[0], 0)))
    monkeypatch.setattr(modal, "LARGE", 1000)
    assert modal.factored(K).nnz < 0.7 * factors.nnz
    np.testing.assert_allclose(reduction.modal_basis(M, K, 6).omega, usual.omega, rtol=1e-9)
    again = reduction.static_shapes(M, K, load, np.zeros((K.shape[0], 0)))
    rounding = np.finfo(float).eps * 1.9e5  # times the condition of K
    np.testing.assert_allclose(again, shapes, rtol=0, atol=rounding * abs(shapes).max())


EYE = np.eye(3)


test_modal_basis_rejects = refused_by(
    lambda arguments: reduction.modal_basis(*arguments),
    ((EYE, EYE, 0), r"count must be 1 to 3 \(free dofs\), got 0 in modal_basis"),
    ((EYE, EYE, 4), r"count must be 1 to 3 \(free dofs\), got 4 in modal_basis; ask for fewer"),
    ((EYE, EYE, 1.5), "count must be 1 to 3"),
    ((EYE, EYE, 1, [0]), "count or indices, not both"),
    ((EYE, EYE, None, []), "indices must be a list of mode numbers"),
    ((EYE, EYE, None, [0.5]), "indices must be a list of mode numbers"),
    ((EYE, EYE, None, [0, 0]), "indices must be distinct, 0 to 2, got"),
    ((EYE, EYE, None, [-1]), "indices must be distinct, 0 to 2, got"),
    ((EYE, EYE, None, [3]), "indices must be distinct, 0 to 2, got"),
    ((EYE[:2], EYE), r"M must be square, got shape \(2, 3\)"),
    ((EYE, EYE[:2]), "K must be square"),
    ((np.eye(2), EYE), "M and K must have the same shape"),
    ((EYE, EYE * np.nan), "K must be finite"),
    ((sparse.eye(3) * 1j, EYE), "M must be real numbers"),
    ((EYE + np.eye(3, k=1), EYE), "M must be symmetric, got a difference of 1 "),
    ((EYE, EYE + np.eye(3, k=1)), "K must be symmetric"),
    ((np.diag([1.0, 0.0, 1.0]), EYE), "M must be positive definite, got a pivot of 0"),
    ((np.array([[1.0, 2.0], [2.0, 1.0]]), np.eye(2)), "M must be positive definite, got a pivot of -3"),
    ((np.ones((2, 2)), np.eye(2)), "M must be positive definite"),
    ((EYE, np.diag([1.0, 2.0, -3.0])), "K must be positive semi-definite, got omega² = -3"),
    ((EYE, EYE, 1, None, 2 * EYE), "root must satisfy rootᵀ root = K, got a difference of 3"),
    ((EYE, EYE, 1, None, np.eye(2)), "root must satisfy"),
)


test_basis_rejects_shapes = refused(
    (lambda: reduction.Basis(np.eye(3), np.ones(2)), r"vectors \(N, n\) and omega \(n,\) must match"),
    (lambda: reduction.Basis(np.eye(2), np.array([1.0, np.nan])), "omega of a Basis must be finite, got nan"),
)


@pytest.mark.parametrize(("stretch", "rigid"), [(3e-12, True), (3e-11, False)])
def test_rounding_of_a_root_is_no_frequency(stretch, rigid):
    """A free chain whose root has a rounding of rigid motion, as those of superelements have: 1e-11 of the scale."""
    size = 80
    root = np.vstack([np.diff(np.eye(size), axis=0), np.full((1, size), stretch * np.sqrt(2.0 / size))])
    found = reduction.modal_basis(np.eye(size), root.T @ root, count=3, root=root).omega
    exact = 2.0 * np.sin(0.5 * np.pi * np.arange(3) / size)
    np.testing.assert_allclose(found[1:], exact[1:], rtol=1e-9)
    assert (found[0] == 0.0) == rigid


def test_a_slow_mode_with_no_gap_behind_it_is_elastic():
    omega = np.array([3e-12, 1e-7, 1.0])
    found = reduction.modal_basis(np.eye(3), np.diag(omega**2), count=2, root=np.diag(omega)).omega
    np.testing.assert_allclose(found, omega[:2], rtol=1e-9)


# --- under compression: rows of the root are imaginary where they take from K -----------------------------


def compressed(share, elements, **parts):
    """A pinned beam, EI = ρA = L = 1, pressed by a share of Euler's load."""
    beam = Beam(1.0, UNIT, axial_force=-share * np.pi**2)
    return Scene(beam, [Pinned(0.0), Pinned(1.0)], **parts).matrices(elements=elements)


@pytest.mark.parametrize("elements", [400, 1000])
@pytest.mark.parametrize("share", [0.01, 0.5, 0.999])
def test_a_compressed_beam_on_a_fine_mesh(share, elements):
    """ω_i² = (iπ)⁴ (1 - S/i² P): by K alone ω_1 was off by 4e-5 on 1000 elements, and 0 where S = 0.999 P."""
    full, i = compressed(share, elements), np.arange(1, 4)
    left = 1 - share / i**2
    found = reduction.modal_basis(full.M, full.K, 3, root=full.root).omega
    rounding, mesh = 4 * np.finfo(float).eps * elements**2, (np.pi * i / elements) ** 4 / 1440
    assert np.all(np.abs(found / (np.pi**2 * i**2 * np.sqrt(left)) - 1) <= (rounding + mesh) / left)


def test_a_rigid_body_mode_beside_a_compressed_beam():
    striker = Impactor(0.5, 0.1, 1.0, KelvinVoigt(1e3, 1.0))
    full = compressed(0.5, 20, impactors=[striker])
    found = reduction.modal_basis(full.M, full.K, 2, root=full.root).omega
    assert found[0] == 0.0
    assert found[1] == pytest.approx(np.pi**2 * np.sqrt(0.5), rel=1e-6)


def test_frequencies_far_apart_of_a_root_with_signs():
    """Springs of 1e10 and 3 in a row, and -2 on the end: by eigenvalues of K alone the lower ω² was off by 1e-6."""
    root = np.array([[1e5, 0.0], [-np.sqrt(3.0), np.sqrt(3.0)], [0.0, 1j * np.sqrt(2.0)]])
    found = reduction.modal_basis(np.eye(2), (root.T @ root).real, root=root).omega
    total, product = 1e10 + 4, 1e10 - 6  # of the two ω²: 1e10 + 3 + 1, (1e10 + 3) - 9
    high = (total + np.sqrt(total**2 - 4 * product)) / 2
    np.testing.assert_allclose(found**2, [product / high, high], rtol=1e-10)  # of ω: eps 1e5


SOFTENED = np.array([[2.0, 0.0], [0.0, 1.0], [0.0, 1.5j]])  # K = diag(4, -1.25)


test_roots_with_signs_that_are_refused = refused_by(
    lambda K, root: reduction.modal_basis(np.eye(2), K, root=root),
    (
        np.diag([4.0, -1.25]),
        SOFTENED,
        "K must be positive semi-definite, got omega² = -1.25 in modal_basis; the struct",
    ),
    (np.diag([4.0, -1.25]), None, "K must be positive semi-definite, got omega² = -1.25 in modal_basis; the struct"),
    (np.diag([4.0, 3.25]), SOFTENED, "root must satisfy rootᵀ root = K, got a difference of 4.5"),
    (np.diag([4.0, -1.25]), np.abs(SOFTENED), "root must satisfy rootᵀ root = K, got a difference of 4.5"),
)
