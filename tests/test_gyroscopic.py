"""Gyroscopic matrices: exact whirling frequencies, flight by matrix exponentials, contacts, balance, orbits, bad input.

The overhung disk is made of two planes of one-plane matrices: of the inclinations a = ∂u_x/∂z
and b = ∂u_y/∂z, I_d a'' + I_p Ω b' = M and I_d b'' - I_p Ω a' = M, so that G[a, b] = I_p Ω = -G[b, a].
"""

import math
import pickle
from functools import lru_cache

import numpy as np
import pytest
from differences import end_of, jacobian
from oscillators import Tone
from problems import state_matrix
from refusals import refused_by
from scipy import linalg, sparse
from scipy.optimize import brentq

import fembeam as fb
import reduction
from contacts import Hertz, Hysteretic, KelvinVoigt, PiecewiseLinear
from solvers import (
    RK4,
    CentralDifference,
    Contact,
    DormandPrince,
    Exponential,
    GeneralizedAlpha,
    HenonRK2,
    Newmark,
    Parameter,
    System,
    integrate,
    integrate_many,
    orbit,
)

SHAFT = fb.Section.circle(2.1e11, 7850.0, 0.04)
MASS, DIAMETRAL, POLAR, LENGTH = 12.0, 0.04, 0.075, 0.5
TURN = np.array([[0.0, 1.0], [-1.0, 0.0]])


def skew(n, size, seed=0):
    G = size * np.random.default_rng(seed).normal(size=(n, n))
    return G - G.T


def rotor(matrices, G, modes):
    """Basis of both planes from that of one; G as it is; rows of the tip along x and y."""
    one = reduction.modal_basis(matrices.M, matrices.K, modes, root=matrices.root)
    basis = reduction.Basis(np.kron(one.vectors, np.eye(2)).reshape(-1, 2, modes, 2).swapaxes(0, 1).reshape(
        2 * len(one.vectors), -1), np.repeat(one.omega, 2))  # fmt: skip
    tip, size = matrices.interpolation(matrices.nodes[-1]).toarray(), len(one.vectors)
    return basis, G, np.hstack((tip, np.zeros((1, size)))), np.hstack((np.zeros((1, size)), tip))


@lru_cache(maxsize=8)
def overhung(modes):
    """The clamped shaft with a disk at its end; G per unit of spin."""
    disk = fb.LumpedMass(LENGTH, mass=MASS, inertia=DIAMETRAL)
    matrices = fb.Scene(fb.Beam(LENGTH, SHAFT), [fb.Clamped(0.0)], masses=[disk]).matrices(modes=20)
    slope = matrices.interpolation(LENGTH, 1)
    return rotor(matrices, POLAR * sparse.kron(TURN, slope.T @ slope), modes)


def frequency(inertia, near):
    """Root next to a value: EI u''' = -m ω² u, EI u'' = inertia(ω) u' at the end of the exact clamped shaft."""

    def determinant(omega):
        k = (SHAFT.line_mass * omega**2 / SHAFT.bending_stiffness) ** 0.25
        x = k * LENGTH
        shapes = np.array([[f(x) for f in (np.cosh, np.cos, np.sinh, np.sin)]]).ravel()
        ch, c, sh, s = shapes
        u, u1, u2, u3 = (np.array(row) for row in (
            [ch - c, sh - s], [k * (sh + s), k * (ch - c)],
            [k**2 * (ch + c), k**2 * (sh + s)], [k**3 * (sh - s), k**3 * (ch + c)]))  # fmt: skip
        EI = SHAFT.bending_stiffness
        rows = EI * u3 + MASS * omega**2 * u, EI * u2 - inertia(omega) * u1
        return rows[0][0] * rows[1][1] - rows[0][1] * rows[1][0]

    return brentq(determinant, 0.999 * near, 1.001 * near, xtol=1e-11 * near)


# --- whirling ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sense", [1, -1])
def test_the_overhung_disk_whirls_as_the_exact_shaft(sense):
    """Forward 223.87 and 2183.9, backward 208.86 and 1790.3 rad/s at 300 rad/s."""
    basis, G, x, y = overhung(14)
    found = reduction.whirl(basis, 300.0 * sense * G, x, y)
    expected = [-208.8577927993087, 223.8720794147543, -1790.270791832366, 2183.894511988107]
    np.testing.assert_allclose(sense * found.signed[:4], expected, rtol=2e-9)
    np.testing.assert_allclose(np.abs(found.sense), 1.0, rtol=1e-9)
    for value, spin in zip(expected, (-300.0, 300.0, -300.0, 300.0), strict=True):
        exact = frequency(lambda w, spin=spin: DIAMETRAL * w**2 - POLAR * spin * w, abs(value))
        assert exact == pytest.approx(abs(value), rel=1e-10)


def test_at_standstill_each_mode_is_two_circles():
    basis, G, x, y = overhung(14)
    found = reduction.whirl(basis, 0.0 * G, x, y)
    np.testing.assert_allclose(found.signed[:4], [-216.4076249565131, 216.4076249565131, -1977.830202970811,
                                                  1977.830202970811], rtol=2e-9)  # fmt: skip
    np.testing.assert_allclose(np.abs(found.sense), 1.0, rtol=1e-9)  # of the last pair too


def test_shapes_solve_their_equations():
    """(K - ω²M + iωG) φ = 0 and K φ = Ω² (M - iG) φ, of structures that are not round."""
    M, _, K, G = drawn(3, 5, False, 0.3)
    basis, rows = reduction.modal_basis(M, K), np.eye(5)
    for found, spin in (
        (reduction.whirl(basis, G, *rows[:2]), 1.0),
        (reduction.critical_speeds(basis, G, *rows[:2]), None),
    ):
        for omega, shape in zip(found.omega, found.shapes.T, strict=True):
            terms = K @ shape, -(omega**2) * M @ shape, 1j * omega * (spin or omega) * G @ shape
            assert np.abs(sum(terms)).max() < 1e-10 * np.abs(terms).max()


def test_modes_at_standstill_converge_fast():
    """Errors of the first forward frequency at 300 rad/s: 0.18, 7e-3, 2e-4, 1.5e-5, 5e-7 with 1, 2, 3, 4, 6 a plane."""
    errors = []
    for modes in (1, 2, 3, 4, 6):
        basis, G, x, y = overhung(modes)
        errors.append(reduction.whirl(basis, 300.0 * G, x, y).signed[1] - 223.8720794147543)
    np.testing.assert_allclose(errors, [0.1813, 7.48e-3, 1.94e-4, 1.46e-5, 4.7e-7], rtol=0.03)


def test_critical_speeds_are_those_of_a_disk_of_other_inertia():
    """Of I_d - I_p forward (where I_p > I_d the inclination has none) and I_d + I_p backward, at standstill."""
    basis, G, x, y = overhung(14)
    found = reduction.critical_speeds(basis, G, x, y)
    forward, backward = found.omega[found.turning == 1], found.omega[found.turning == -1]
    for sign, speeds in ((-1, forward), (1, backward)):
        exact = [frequency(lambda w, s=sign: (DIAMETRAL + s * POLAR) * w**2, speed) for speed in speeds[:2]]
        np.testing.assert_allclose(speeds[:2], exact, rtol=1e-7)
    at_speed = reduction.whirl(basis, forward[0] * G, x, y)
    assert np.min(np.abs(at_speed.signed - forward[0])) < 1e-9 * forward[0]
    assert len(forward) == len(backward) - 1


def test_blocks_have_the_whirling_frequencies_and_no_damping():
    """An undamped rotor is exactly undamped: c = 0, not ±1e-14 |λ|."""
    basis, G, x, y = overhung(8)
    turning = basis.project_matrix(300.0 * G)
    blocks = System(np.eye(16), np.zeros((16, 16)), np.diag(basis.omega**2), gyroscopic=turning).blocks
    np.testing.assert_allclose(np.sqrt(blocks.k), reduction.whirl(basis, 300.0 * G, x, y).omega, rtol=1e-12)
    np.testing.assert_array_equal(blocks.c, 0.0)


def test_as_text_it_counts_the_senses():
    found = reduction.Whirl(np.arange(1.0, 5.0), np.array([1.0, -1.0, 0.0, -0.5]), np.zeros((1, 4), dtype=complex))
    assert repr(found) == "<whirl of 4 modes, 1 from x to y, 2 from y to x>"


PAIR, ROWS = reduction.Basis(np.eye(2), np.array([1.0, 2.0])), np.eye(2)
LOOSE = reduction.Basis(np.eye(2), np.array([0.0, 2.0]))

test_whirl_arguments_are_refused = refused_by(
    reduction.whirl,
    (PAIR, [[0.0, 1.0], [-0.5, 0.0]], *ROWS, r"G must be skew, G = -Gᵀ; its largest \|G \+ Gᵀ\| is 0.5"),
    (PAIR, np.zeros((3, 3)), *ROWS, r"G must be \(2, 2\), as the basis has 2 dofs, got \(3, 3\)"),
    (PAIR, TURN, ROWS[0], np.array([0.0, np.nan]), r"x and y must be finite rows"),
    (PAIR, TURN, ROWS[0], ROWS, r"rows \(k, 2\) of the same places, got \(1, 2\) and \(2, 2\)"),
)
test_a_loose_rotor_has_no_critical_speeds = refused_by(
    reduction.critical_speeds, (LOOSE, TURN, *ROWS, "needs a rotor that is held, got 1 rigid-body modes")
)


# --- flight -----------------------------------------------------------------------------------------------------------


def drawn(seed, n, damped, turning):
    rng = np.random.default_rng(seed)
    M, K, C = (root @ root.T for root in rng.normal(size=(3, n, n)))
    return M + 0.5 * np.eye(n), 0.05 * damped * C, 4.0 * K + np.eye(n), skew(n, turning, seed)


@pytest.mark.parametrize("damped", [0.0, 1.0])
@pytest.mark.parametrize(("n", "turning"), [(2, 0.01), (2, 1.0), (3, 1.0), (4, 5.0), (6, 1.0)])
def test_flight_is_the_matrix_exponential(n, turning, damped):
    M, C, K, G = drawn(n, n, damped, turning)
    kept, start = G.copy(), np.random.default_rng(1).normal(size=2 * n)
    run = integrate(System(M, C, K, gyroscopic=G), start[:n], start[n:], 10.0, dt=0.5)
    A = state_matrix(M, C + G, K)
    exact = np.array([linalg.expm(A * t) @ start for t in run.t])
    np.testing.assert_allclose(np.hstack((run.q, run.q_dot)), exact, atol=1e-12 * np.abs(exact).max() * max(1, turning))
    np.testing.assert_array_equal(G, kept)
    assert np.abs(run.energy.residual).max() < 1e-12 * run.energy.stored[0]
    assert (np.ptp(run.energy.stored) < 1e-12 * run.energy.stored[0]) == (damped == 0.0)


def test_a_steady_load_gives_the_steady_whirl():
    """From the state Re Z e^{iωt} with (K - ω²M + iω(C + G)) Z = v nothing dies out."""
    M, C, K, G = drawn(3, 4, 1.0, 2.0)
    v, omega = np.array([1.0, -0.5, 0.2, 0.7]), 2.3
    Z = np.linalg.solve(K - omega**2 * M + 1j * omega * (C + G), v)
    system = System(M, C, K, loads=[(v, Tone(1.0, omega))], gyroscopic=G)
    run = integrate(system, Z.real, (1j * omega * Z).real, 20.0, dt=0.1)
    exact = (Z * np.exp(1j * omega * run.t[:, None])).real
    np.testing.assert_allclose(run.q, exact, atol=1e-12 * np.abs(Z).max())
    assert np.abs(run.energy.residual).max() < 1e-11 * run.energy.input.max()


def test_sampled_loads_against_dormand_prince():
    M, C, K, G = drawn(5, 3, 1.0, 1.0)
    system = System(M, C, K, loads=[([1.0, 0.0, -1.0], lambda t: np.sin(3.0 * t) * np.exp(-t))], gyroscopic=G)
    one, other = (integrate(system, [0.0] * 3, [0.0] * 3, 5.0, dt=0.1, method=m) for m in
                  (Exponential(1e-11), DormandPrince(1e-13, 1e-16)))  # fmt: skip
    np.testing.assert_allclose(one.q, other.q, atol=1e-10 * np.abs(other.q).max())


def test_no_gyroscopic_matrix_and_one_of_zeros_are_the_same():
    M, C, K, G = drawn(2, 3, 1.0, 1.0)
    plain, zeros = System(M, C, K), System(M, C, K, gyroscopic=0.0 * G)
    for name in ("k", "c", "T", "inverse", "loss"):
        np.testing.assert_array_equal(getattr(plain.blocks, name), getattr(zeros.blocks, name))
    assert plain.by_rate is plain.C


def test_a_coordinate_that_neither_is_held_nor_turns_stays_free():
    """Torsion of a shaft beside its bending."""
    G = np.zeros((3, 3))
    G[1:, 1:] = 2.0 * TURN
    system = System(np.eye(3), np.zeros((3, 3)), np.diag([0.0, 4.0, 4.0]), gyroscopic=G)
    run = integrate(system, [1.0, 0.0, 0.0], [0.5, 1.0, 0.0], 3.0)
    np.testing.assert_allclose(run.q[-1, 0], 2.5, rtol=1e-14)


# --- contact ----------------------------------------------------------------------------------------------------------


def rubbing(laws=None, damped=0.0, spin=300.0, modes=3, gap=1e-4, loads=()):
    """The overhung disk between stops on its housing, in modal coordinates; and a start."""
    basis, G, x, y = overhung(modes)
    rows = [basis.project(row[0]) for row in (x, y)]
    laws = laws or [Hertz(1e9), PiecewiseLinear([5e6])]
    stops = [Contact(-rows[0], laws[0], gap), Contact(rows[1], laws[1], 1.5 * gap)]
    n = basis.count
    C = np.diag(2.0 * damped * basis.omega)
    loads = [(basis.project(row[0]), signal) for row, signal in zip((x, y), loads, strict=False)]
    return System(np.eye(n), C, np.diag(basis.omega**2), stops, loads, basis.project_matrix(spin * G))


def thrown(system, speed=0.15):
    """In the middle, the disk thrown towards both stops."""
    one, other = (c.direction / (c.direction @ c.direction) for c in system.contacts)
    return np.zeros(system.size), -speed * (one + 0.8 * other)


@pytest.mark.parametrize("laws", [None, [Hysteretic(1e9, damping_factor=0.3), KelvinVoigt(5e6, 300.0)]])
def test_impacts_agree_with_dormand_prince(laws):
    system = rubbing(laws)
    one, other = (integrate(system, *thrown(system), 0.06, dt=1e-3, method=m)
                  for m in (Exponential(1e-11), DormandPrince(1e-13, 1e-17)))  # fmt: skip
    assert len(one.contacts) == len(other.contacts) >= 4
    assert {0, 1} == set(one.contacts.stop)
    np.testing.assert_allclose(one.q, other.q, atol=2e-8 * np.abs(other.q).max())
    np.testing.assert_allclose(one.contacts.t_in, other.contacts.t_in, atol=1e-10)
    np.testing.assert_allclose(one.contacts.peak_force, other.contacts.peak_force, rtol=1e-6)


@pytest.mark.parametrize("damped", [0.0, 1e-3])
def test_the_balance_closes_over_a_hundred_contacts(damped):
    """G does no work: what is stored and lost comes from the start and the loads."""
    loads = [Tone(20.0, 180.0), Tone(-20.0j, 180.0)]
    system = rubbing([Hysteretic(1e9, damping_factor=0.2), PiecewiseLinear([5e6])], damped, loads=loads)
    run = integrate(system, *thrown(system, 0.3), 2.0, dt=1e-3, method=Exponential(1e-10))
    assert len(run.contacts) > 100
    handled = run.energy.stored.max() + np.abs(run.energy.input).max()
    assert np.abs(run.energy.residual).max() < 1e-8 * handled
    assert (run.energy.damping[-1] > 0.0) == (damped > 0.0)


def test_turning_the_other_way_is_the_mirrored_motion():
    """y to -y and the spin to its opposite: the same log."""
    system = rubbing()
    mirror = np.tile([1.0, -1.0], 3)
    other = System(system.M, system.C, system.K, [Contact(c.direction * mirror, c.law, c.gap) for c in system.contacts],
                   gyroscopic=-np.asarray(system.gyroscopic))  # fmt: skip
    one, two = (integrate(s, *thrown(s), 0.05, dt=1e-3) for s in (system, other))
    np.testing.assert_allclose(two.q * mirror, one.q, atol=1e-8 * np.abs(one.q).max())
    np.testing.assert_allclose(two.contacts.t_in, one.contacts.t_in, rtol=1e-8)


def test_many_runs_are_the_single_ones():
    system = rubbing()
    q, v = thrown(system)
    runs = integrate_many(system, [q, q], [v, 1.5 * v], 0.03)
    for i, speed in enumerate((1.0, 1.5)):
        single = integrate(system, q, speed * v, 0.03)
        np.testing.assert_allclose(runs.q[i], single.q[-1], atol=1e-12 * np.abs(single.q).max())


# --- derivatives, orbits ----------------------------------------------------------------------------------------------


def differenced(system, x, duration):
    """Derivative of the end of a run by its start; positions count with the lowest frequency."""
    scale = np.linalg.norm(x[system.size :]) * np.repeat([1.0 / math.sqrt(system.K[0, 0]), 1.0], system.size)
    return jacobian(end_of(system, duration), x, 5e-6 * scale)


def test_tangent_against_differences():
    system = rubbing(modes=2)
    x = np.concatenate(thrown(system))
    found = integrate(system, *thrown(system), 0.02, tangent=True, method=Exponential(1e-12))
    assert len(found.contacts) >= 2
    expected = differenced(system, x, 0.02)
    np.testing.assert_allclose(found.tangent, expected, atol=1e-6 * np.abs(expected).max())
    assert np.linalg.det(found.tangent) == pytest.approx(1.0, rel=1e-7)  # elastic, and G keeps the volume


def test_the_derivative_by_the_spin_is_that_of_two_runs():
    """Systems of other G differ in more than their loads: central differences, not the change of nothing."""
    system, step = rubbing(modes=2), 1e-3
    behind, ahead = (rubbing(modes=2, spin=300.0 + s) for s in (-step, step))
    found = integrate(system, *thrown(system), 0.02, tangent=Parameter(behind, ahead, step))
    ends = [end_of(rubbing(modes=2, spin=300.0 + s), 0.02)(np.concatenate(thrown(system))) for s in (-0.01, 0.01)]
    np.testing.assert_allclose(found.tangent[:, -1], (ends[1] - ends[0]) / 0.02, atol=1e-4 * np.abs(ends).max())
    assert np.abs(found.tangent[:, -1]).max() > 0.0


def test_an_impacting_orbit_has_the_multipliers_of_differences():
    """An unbalance near the critical speed, against a stop; the monodromy matrix of a run and of differences."""
    spin = 200.0
    system = rubbing([Hertz(1e9), PiecewiseLinear([5e6])], 0.02, spin, 2, loads=[Tone(25.0, spin), Tone(-25.0j, spin)])
    found = orbit(system, 2.0 * math.pi / spin)
    assert len(found.contacts) >= 1
    expected = differenced(system, found.state, found.period)
    np.testing.assert_allclose(found.monodromy, expected, atol=2e-6 * np.abs(expected).max())
    volume = math.exp(-np.trace(system.C) * found.period)  # elastic stops: only C takes volume
    assert np.prod(found.multipliers).real == pytest.approx(volume, rel=1e-7)


# --- every method -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("method", "order", "as_matrices"),
    [(RK4, 4, np.asarray), (CentralDifference, 2, sparse.csc_array), (Newmark, 2, sparse.csc_array),
     (GeneralizedAlpha, 2, np.asarray), (HenonRK2, 2, np.asarray)],
)  # fmt: skip
def test_constant_steps_converge_to_the_exact_flight(method, order, as_matrices):
    M, C, K, G = drawn(7, 3, 1.0, 2.0)
    system = System(*map(as_matrices, (M, C, K)), gyroscopic=as_matrices(G))
    start = np.array([1.0, 0.0, -0.5, 0.0, 1.0, 0.3])
    exact, errors = linalg.expm(state_matrix(M, C + G, K) * 2.0) @ start, []
    for h in (0.01, 0.005):
        made = method(h, h) if method is HenonRK2 else method(h)
        run = integrate(system, start[:3], start[3:], 2.0, dt=0.5, method=made)
        errors.append(np.abs(np.concatenate((run.q[-1], run.q_dot[-1])) - exact).max())
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.15)
    assert np.abs(run.energy.residual).max() < 2e-3 * run.energy.stored[0]


@pytest.mark.parametrize("as_matrices", [np.asarray, sparse.csc_array], ids=["dense", "sparse"])
@pytest.mark.parametrize("method", [RK4(1e-5), CentralDifference(4e-6), Newmark(4e-6), HenonRK2(4e-6, 1e-6)])
def test_constant_steps_see_the_same_contacts(method, as_matrices):
    system = rubbing(modes=2)
    own = System(*map(as_matrices, (system.M, system.C, system.K)), system.contacts,
                 gyroscopic=as_matrices(system.gyroscopic))  # fmt: skip
    exact = integrate(system, *thrown(system), 4e-3)
    run = integrate(own, *thrown(own), 4e-3, method=method)
    assert len(run.contacts) == len(exact.contacts) >= 1
    np.testing.assert_allclose(run.q[-1], exact.q[-1], atol=2e-4 * np.abs(exact.q[-1]).max())


@pytest.mark.parametrize("method", [RK4, CentralDifference, lambda h, **kept: Newmark(h, 0.1, 0.6, **kept)])
def test_limits_of_the_step_hold_with_gyroscopic_terms(method):
    """Below the limit nothing grows, above it the run is refused, or stopped."""
    M, C, K, G = drawn(9, 3, 0.0, 3.0)
    system = System(M, C, K, gyroscopic=G)
    limit, start = method(1.0).stable_dt(system).flight, [1.0, 0.5, -0.2]
    run = integrate(system, start, [0.0] * 3, 1500 * limit, method=method(0.6 * limit))
    first = system.energy(np.array(start), np.zeros(3))
    assert system.energy(run.q[-1], run.q_dot[-1]) < 2.0 * first
    beyond = integrate(system, start, [0.0] * 3, 1500 * limit, check=False, method=method(1.05 * limit,
                       force_unstable=True))  # fmt: skip
    assert not beyond.status.good
    with pytest.raises(ValueError, match=r"unstable in flight"):
        integrate(system, start, [0.0] * 3, 1500 * limit, method=method(1.05 * limit))


# --- handed over ------------------------------------------------------------------------------------------------------


def test_systems_made_of_others_keep_the_matrix():
    system = rubbing()
    for other in (pickle.loads(pickle.dumps(system)), system.like(contacts=system.contacts[:1])):
        np.testing.assert_array_equal(other.gyroscopic, system.gyroscopic)
        np.testing.assert_array_equal(other.blocks.k, system.blocks.k)


def test_it_is_copied_and_made_of_one_kind():
    G = 3.0 * TURN
    system = System(np.eye(2), np.zeros((2, 2)), np.eye(2), gyroscopic=G)
    G[:] = 7.0
    np.testing.assert_array_equal(system.gyroscopic, 3.0 * TURN)
    np.testing.assert_array_equal(system.by_rate, 3.0 * TURN)
    with pytest.raises(ValueError, match=r"read-only"):
        system.gyroscopic[0, 0] = 1.0
    mixed = System(*[sparse.eye_array(2)] * 3, gyroscopic=3.0 * TURN)
    assert not mixed.sparse
    thin = System(*[sparse.eye_array(2)] * 3, gyroscopic=sparse.csr_array(3.0 * TURN))
    assert thin.sparse
    np.testing.assert_allclose(thin.blocks.k, System(*[np.eye(2)] * 3, gyroscopic=3.0 * TURN).blocks.k, rtol=1e-13)


test_matrices_are_refused = refused_by(
    lambda G: System(np.eye(2), np.zeros((2, 2)), np.eye(2), gyroscopic=G),
    ([[0.0, 1.0], [1.0, 0.0]], r"gyroscopic must be skew, G = -Gᵀ; its largest \|G \+ Gᵀ\| is 2"),
    ([[0.1, 1.0], [-1.0, 0.0]], r"its largest \|G \+ Gᵀ\| is 0.2"),
    (sparse.csr_array([[0.0, 1.0], [0.5, 0.0]]), r"its largest \|G \+ Gᵀ\| is 1.5"),
    (np.zeros((3, 3)), r"gyroscopic must have the shape of M, \(2, 2\), got \(3, 3\)"),
    ([[0.0, math.nan], [0.0, 0.0]], r"gyroscopic must be finite, got nan at row 0, column 1"),
    (np.zeros(2), r"gyroscopic must be square, got shape \(1, 2\)"),
)


def test_a_rotor_that_can_float_is_refused_in_words():
    system = System(np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)), gyroscopic=TURN)
    with pytest.raises(ValueError, match=r"body with gyroscopic terms can float.*hold it by a spring, however soft"):
        integrate(system, [0.0, 0.0], [1.0, 0.0], 1.0)
    held = System(np.eye(2), np.zeros((2, 2)), 1e-8 * np.eye(2), gyroscopic=TURN)
    run = integrate(held, [0.0, 0.0], [1.0, 0.0], 1.0)
    np.testing.assert_allclose(run.q_dot[-1], [math.cos(1.0), math.sin(1.0)], rtol=1e-7)
