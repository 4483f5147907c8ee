"""The hand-over: matrices, contacts and loads are checked, copied, and decoupled without loss."""

import copy
import math
import pickle

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from problems import soft_behind_stiff, state_matrix
from refusals import refused, refused_by
from scipy import sparse
from scipy.linalg import expm

import solvers
from contacts import Hertz
from solvers import Contact, System

LAW = Hertz(1e8)


def block_matrix(blocks):
    """The same in block coordinates."""
    n = blocks.k.size
    return np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(blocks.k), -np.diag(blocks.c)]])


def check_decoupled(M, C, K, times=(0.0, 0.3, 1.7)):
    """T and its inverse fit, and the blocks move as the system does."""
    blocks = System(M, C, K).blocks
    n = len(M)
    condition = np.linalg.cond(blocks.T)
    np.testing.assert_allclose(blocks.T @ blocks.inverse, np.eye(2 * n), atol=1e-14 * n * condition)
    A, B = state_matrix(M, C, K), block_matrix(blocks)
    for t in times:
        exact = expm(A * t)
        bound = 1e-13 * n * condition * max(1.0, np.abs(exact).max()) * (1.0 + np.abs(A).max() * t)
        np.testing.assert_allclose(blocks.T @ expm(B * t) @ blocks.inverse, exact, atol=bound)
    return blocks


def random_matrices(seed, n, coupled, floating, strength):
    rng = np.random.default_rng(seed)

    def definite(rank):
        root = rng.normal(size=(n, rank))
        return root @ root.T

    M = definite(n) + 0.5 * np.eye(n)
    K = 4.0 * definite(n - 1 if floating and n > 1 else n)
    C = strength * (definite(max(1, n - 1)) if coupled else 0.3 * M + 0.1 * K)
    return M, C, K


@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(1, 5),
    coupled=st.booleans(),
    floating=st.booleans(),
    strength=st.sampled_from([1e-3, 0.1, 1.0, 5.0]),
)
@settings(max_examples=150, deadline=None, derandomize=True)
def test_blocks_move_as_the_matrices_do(seed, n, coupled, floating, strength):
    M, C, K = random_matrices(seed, n, coupled, floating, strength)
    kept = [matrix.copy() for matrix in (M, C, K)]
    try:
        check_decoupled(M, C, K)
    except ValueError as refusal:
        assume("cannot be separated" not in str(refusal))
        raise
    for matrix, before in zip((M, C, K), kept, strict=True):
        np.testing.assert_array_equal(matrix, before)


def test_modes_that_rayleigh_damping_overdamps_are_named():
    """C = βK, β = 1 s, and a dashpot: slow roots -1/β (1 + 1/(β²k)), k of 1e6 and more, lie within 1e-6."""
    k, row = 1e6 * np.arange(1.0, 13.0) ** 2, np.cos(np.arange(12.0))
    with pytest.raises(ValueError, match=r"Rayleigh's beta, overdamps high modes.* lower beta, or keep fewer modes"):
        _ = System(np.eye(12), np.diag(k) + np.outer(row, row), np.diag(k)).blocks


@pytest.mark.parametrize("zeta", [0.0, 0.01, 0.999999, 1.0, 1.000001, 3.0])
def test_a_mode_of_any_damping_is_one_block(zeta):
    blocks = check_decoupled(np.eye(1), np.array([[2 * zeta * 3.0]]), np.array([[9.0]]))
    assert blocks.k[0] == 9.0
    assert blocks.c[0] == 6.0 * zeta


def test_rigid_body_modes_become_exact_zeros():
    K = 1e6 * np.array([[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    blocks = check_decoupled(np.diag([1.0, 2.0, 3.0]), 1e-5 * K, K, times=(0.01,))
    assert blocks.k[0] == 0.0
    assert np.all(blocks.k[1:] > 1e5)


@pytest.mark.parametrize("free", [0, 1, 2])
def test_a_free_coordinate_may_stand_anywhere_beside_coupled_ones(free):
    """As a free mass beside a beam with a dashpot: its block is its own, k = c = 0."""
    K, row = np.diag([4.0, 9.0, 25.0]), np.array([1.0, 0.5, 0.7])
    K[free, free] = row[free] = 0.0
    blocks = check_decoupled(np.eye(3), 0.3 * np.outer(row, row), K)
    assert blocks.k[0] == blocks.c[0] == 0.0


def test_proportional_damping_needs_no_complex_modes():
    M, K = np.diag([1.0, 2.0]), np.array([[3.0, -1.0], [-1.0, 1.0]])
    blocks = System(M, 0.1 * M + 0.02 * K, K).blocks
    assert blocks.loss.size == 0
    np.testing.assert_allclose(blocks.c, 0.1 + 0.02 * blocks.k, rtol=1e-13)
    phi = blocks.T[:2, :2]
    np.testing.assert_allclose(phi.T @ M @ phi, np.eye(2), atol=1e-14)


def test_coupled_damping_power_is_that_of_the_matrix():
    M, K = np.diag([1.0, 2.0, 0.5]), np.diag([5.0, 6.0, 7.0]) - 1.0
    C = np.diag([0.0, 0.0, 0.4])
    blocks = check_decoupled(M, C, K)
    rng = np.random.default_rng(4)
    q, q_dot = rng.normal(size=(2, 3))
    z = blocks.inverse @ np.concatenate((q, q_dot))
    assert z @ blocks.loss @ z == pytest.approx(q_dot @ C @ q_dot, rel=1e-12)
    np.testing.assert_allclose(blocks.T @ z, np.concatenate((q, q_dot)), rtol=1e-12)


def test_strongly_coupled_dashpot_gives_overdamped_pairs():
    M, K = np.eye(2), np.array([[2.0, -1.0], [-1.0, 2.0]])
    blocks = check_decoupled(M, np.diag([0.0, 30.0]), K)
    assert np.any(blocks.c**2 > 4 * blocks.k)


@pytest.mark.parametrize("turn", [0.0, 0.3])
@pytest.mark.parametrize("unit", [2.0**-20, 2.0**30])
def test_blocks_are_the_same_in_any_unit_of_time(unit, turn):
    """Of micro-beams frequencies are some 1e7 rad/s; T went to rounding with their square, and was then refused."""
    row, K = np.array([1.0, -1.0, 1.0]), np.diag([1.0, 40.0, 300.0])
    C, G = np.diag([0.02, 0.1, 0.3]) + 0.4 * np.outer(row, row), turn * (np.eye(3, k=1) - np.eye(3, k=-1))
    slow, fast = (System(np.eye(3), one * C, one**2 * K, gyroscopic=one * G).blocks for one in (1.0, unit))
    rates = np.repeat([1.0, unit], 3)
    np.testing.assert_allclose(fast.k / unit**2, slow.k, rtol=1e-12)
    np.testing.assert_allclose(fast.c / unit, slow.c, rtol=1e-12)
    np.testing.assert_allclose(fast.T * rates / rates[:, None], slow.T, atol=1e-12)
    np.testing.assert_allclose(fast.inverse * rates / rates[:, None], slow.inverse, atol=1e-12)
    np.testing.assert_allclose(fast.loss * np.outer(rates, rates) / unit**3, slow.loss, atol=1e-12)


def test_several_rigid_body_modes_that_are_all_damped():
    check_decoupled(np.eye(2), np.array([[2.0, 1.0], [1.0, 2.0]]), np.zeros((2, 2)))


def test_rigid_body_modes_of_which_one_is_undamped():
    # two free masses joined by a dashpot only: their common motion is neither held nor damped
    check_decoupled(np.eye(2), np.array([[1.0, -1.0], [-1.0, 1.0]]), np.zeros((2, 2)))


def test_energy_is_kinetic_plus_elastic():
    M, K = np.diag([2.0, 3.0]), np.array([[3.0, -1.0], [-1.0, 1.0]])
    system = System(M, np.zeros((2, 2)), K)
    q, q_dot = np.array([[1.0, 2.0], [0.5, 0.0]]), np.array([[3.0, -1.0], [0.0, 0.0]])
    exact = [0.5 * v @ M @ v + 0.5 * x @ K @ x for x, v in zip(q, q_dot, strict=True)]
    np.testing.assert_allclose(system.energy(q, q_dot), exact, rtol=1e-14)


def test_modal_system_is_its_matrices():
    system = System.modal([2.0, 5.0], [0.1, 0.2])
    np.testing.assert_array_equal(system.M, np.eye(2))
    np.testing.assert_allclose(system.C, np.diag([0.4, 2.0]), rtol=1e-15)
    np.testing.assert_array_equal(system.K, np.diag([4.0, 25.0]))
    np.testing.assert_array_equal(System.modal([2.0, 5.0], 0.1).C, np.diag([0.4, 1.0]))


def test_sparse_matrices_are_taken():
    K = np.array([[2.0, -1.0], [-1.0, 2.0]])
    system = System(sparse.eye(2), sparse.csr_matrix((2, 2)), sparse.csc_array(K))
    assert system.sparse
    np.testing.assert_array_equal(system.K.toarray(), K)
    np.testing.assert_allclose(system.blocks.k, [1.0, 3.0], rtol=1e-14)
    assert not System(np.eye(2), sparse.csr_matrix((2, 2)), K).sparse


def test_system_keeps_its_own_copies():
    M, direction, vector = np.eye(2), np.array([1.0, 0.0]), np.array([0.0, 1.0])
    system = System(M, np.zeros((2, 2)), np.eye(2), [Contact(direction, LAW)], [(vector, np.cos)])
    for array in (M, direction, vector):
        array[:] = 7.0
    np.testing.assert_array_equal(system.M, np.eye(2))
    np.testing.assert_array_equal(system.contacts[0].direction, [1.0, 0.0])
    np.testing.assert_array_equal(system.loads[0][0], [0.0, 1.0])
    with pytest.raises(ValueError, match=r"read-only"):
        system.M[0, 0] = 2.0


ZERO, ODD = np.zeros((2, 2)), ["9.81", None, True, [1.0, 2.0], 1j]


test_matrices_are_refused = refused_by(
    lambda matrices: System(*matrices),
    ((np.ones((2, 3)), ZERO, ZERO), r"M must be square, got shape \(2, 3\)"),
    ((np.eye(2), ZERO, np.diag([1.0, math.nan])), "K must be finite, got nan at row 1, column 1"),
    ((np.eye(2), np.diag([math.inf, 0.0]), ZERO), "C must be finite, got inf at row 0, column 0"),
    ((np.eye(2), ZERO, np.array([[1.0, 0.5], [0.0, 1.0]])), "K must be symmetric; its largest asymmetry is 0.5"),
    ((np.eye(2), np.array([[0.0, 1.0], [-1.0, 0.0]]), ZERO), "C must be symmetric"),
    ((np.eye(2), ZERO, np.eye(3)), r"M, C, K must have one shape, got \(2, 2\), \(2, 2\), \(3, 3\)"),
    ((np.eye(2)[0], ZERO, ZERO), r"M must be square, got shape \(1, 2\)"),
    ((np.eye(2), ZERO, (4.0 + 0.2j) * np.eye(2)), "K must be real, got imaginary parts up to 0.2"),
)


@pytest.mark.parametrize("sparse_too", [False, True])
@pytest.mark.parametrize(
    "M", [np.diag([1.0, -1.0]), np.diag([1.0, 0.0]), -np.eye(2), np.array([[1.0, 2.0], [2.0, 1.0]])]
)
def test_indefinite_mass_is_refused_when_the_system_is_made(M, sparse_too):
    matrices = [sparse.csc_array(A) if sparse_too else A for A in (M, ZERO, np.eye(2))]
    with pytest.raises(ValueError, match=r"M must be positive definite"):
        System(*matrices)


def contacts(*rows):
    return [Contact(row, LAW) for row in rows]


test_parts_are_refused = refused(
    *((lambda x=x: System.modal(x, 0.1), "omega must be finite and >= 0")
      for x in ([1.0, -2.0], [math.nan, 1.0], [math.inf])),
    *((lambda x=x: System.modal([1.0, 2.0], x), "zeta must be finite and >= 0") for x in ([0.1, -0.1], math.nan)),
    *((lambda x=x: Contact([1.0], LAW, x), "gap must be finite, got") for x in (math.nan, math.inf, -math.inf)),
    (lambda: Contact([1.0], lambda delta, delta_dot, entry_rate: delta),
     r"must be a contact law.*decorate the function with @law and call it", TypeError),
    (lambda: Contact([1.0], 5), r"must be a contact law, got 5; use one of contacts", TypeError),
    (lambda: Contact([1.0], Hertz), r"must be a contact law", TypeError),
    *((lambda x=x: Contact(x, LAW), "direction of a Contact must be a finite vector")
      for x in ([1.0, math.nan], np.eye(2))),
    (lambda: System(np.eye(2), ZERO, ZERO, contacts([1.0, 0.0], [1.0, 0.0, 0.0])),
     "contact 1 has a direction of 3, the system 2"),
    *((lambda x=x: System(np.eye(2), ZERO, ZERO, loads=[(x, np.cos)]), "load 0 needs a finite vector of 2")
      for x in ([1.0], [1.0, math.inf])),
    (lambda: System(np.eye(2), ZERO, ZERO, loads=[([1.0, 0.0], 3.0)]),
     "load 0 needs a signal t -> value, got 3.0", TypeError),
    *((lambda x=x: Contact([1.0], LAW, gap=x), "gap of a Contact must be a number, got", TypeError) for x in ODD),
    *((lambda x=x: solvers.Friction(x, 1e5), "mu of Friction must be a number, got", TypeError) for x in ODD),
    *((lambda x=x: solvers.integrate(System.modal([2.0], [0.0]), [1.0], [0.0], x),
       "duration must be a number, got", TypeError) for x in ODD),
    (lambda: System(ZERO[:0, :0], ZERO[:0, :0], ZERO[:0, :0]), r"M must be square, got shape \(0, 0\)"),
    (lambda: System(np.eye(2), ZERO, ZERO, [LAW]), "contact 0 must be a Contact, got Hertz", TypeError),
    (lambda: System(np.eye(2), ZERO, ZERO, Contact([1.0, 0.0], LAW)), "contacts must be a sequence of", TypeError),
    (lambda: System(np.eye(2), ZERO, ZERO, loads=[np.cos]), r"load 0 must be a pair \(vector, signal\)", TypeError),
    (lambda: System.modal([[1.0, 2.0]], 0.1), r"omega must be a row of numbers"),
    (lambda: System.modal([1.0, 2.0], [0.1] * 3), r"zeta one number or as many"),
    (lambda: solvers.RK4("fast"), "dt must be a number, got 'fast'", TypeError),
    (lambda: solvers.Exponentail, r"no attribute 'Exponentail'; it offers \[.*'DormandPrince'", AttributeError),
    (lambda: solvers.Friction(10**400, 1e5), "mu of Friction must be finite"),
)  # fmt: skip


@pytest.mark.parametrize("stiffness", [1e12, 1e14, 1e16])
def test_soft_modes_apart_from_a_stiff_one_are_no_rigid_bodies(stiffness):
    """Two of 1 and sqrt(3) rad/s beside one of 1e7 rad/s drifted as free bodies."""
    K = np.array([[stiffness, 0.0, 0.0], [0.0, 2.0, -1.0], [0.0, -1.0, 2.0]])
    run = solvers.integrate(System(np.eye(3), np.zeros((3, 3)), K), [0.0, 1.0, 0.0], [0.0, 0.0, 0.0], 3.0, 0.5)
    np.testing.assert_allclose(run.q[:, 1], 0.5 * (np.cos(run.t) + np.cos(math.sqrt(3.0) * run.t)), atol=1e-12)


def test_soft_modes_behind_stiff_ones_are_those_of_high_precision():
    """The lowest was zero, the second wrong by 1e-6."""
    M, K, exact = soft_behind_stiff()
    blocks = System(M, 0.0 * K, K).blocks
    np.testing.assert_allclose(blocks.k, exact, rtol=1e-11)
    np.testing.assert_allclose(blocks.T @ blocks.inverse, np.eye(10), atol=1e-12)


def test_contacts_compare_without_a_fault():
    one = Contact([1.0, 0.0], LAW)
    assert one == one
    assert one in {one}
    assert one != Contact([0.0, 1.0], LAW)


def test_copies_of_a_used_system_know_no_address_of_it():
    system = System.modal([50.0], [0.01], [Contact([1.0], LAW)])
    here = solvers.integrate(system, [0.0], [-1.0], 0.1)
    assert system.kept
    for other in (copy.copy(system), copy.deepcopy(system), pickle.loads(pickle.dumps(system))):
        assert not other.kept
        np.testing.assert_array_equal(solvers.integrate(other, [0.0], [-1.0], 0.1).q, here.q)
