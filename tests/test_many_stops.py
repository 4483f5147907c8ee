"""Many stops: motion through the blocks is that through tables of every pair, and memory grows with the stops."""

import numpy as np
import pytest

import fembeam as fb
from contacts import Hertz, Hysteretic, KelvinVoigt, PiecewiseLinear, Viscoelastic
from solvers import Contact, DormandPrince, Exponential, System, integrate
from solvers.exponential import block_tables, preparation
from solvers.exponential.preparation import prepare_system
from solvers.problem import forcing_of

MODES = 6
LAWS = [
    *(Hertz(2e7), KelvinVoigt(4e4, 8.0), Hysteretic.lankarani_nikravesh(3e7, restitution=0.6)),
    *(Viscoelastic.tsuji(2e7, 0.7, 1.0), PiecewiseLinear([2e4, 6e4], [2e-4]), Hysteretic(2e7, 0.4, clamp=True)),
]
TONE, NOISE = fb.Harmonic(9.0, 45.0), fb.BandNoise(6.0, (0.0, 300.0), seed=3)


def tube(stops, signals=(TONE,), modes=MODES, laws=LAWS):
    """A pinned tube between plates, a stop on either side of each, pushed at places of no symmetry."""
    number = np.arange(1, modes + 1)
    plates = (np.arange((stops + 1) // 2) + 0.9) / ((stops + 1) // 2 + 0.7)
    contacts = [
        Contact(
            (1.0 - 2.0 * (s % 2)) * np.sin(np.pi * number * plates[s // 2]), laws[s % len(laws)], 1e-4 * (s % 3 + 1)
        )
        for s in range(stops)
    ]
    loads = [(np.sin(np.pi * number * (0.3 + 0.2 * i)), signal) for i, signal in enumerate(signals)]
    return System.modal(40.0 * number**2, 0.02, contacts, loads)


def run(stops, signals, few, monkeypatch, laws=LAWS, **options):
    """From a start that brings several stops together, with tables up to so many stops."""
    monkeypatch.setattr(block_tables, "FEW", few)
    start = 1.0 / np.arange(1, MODES + 1) ** 3
    system = tube(stops, signals, laws=laws)
    return integrate(system, 2e-5 * start, 0.3 * start, 0.05, method=Exponential(1e-9), **options)


def same(one, other, tolerance):
    """End, log and, if there are any, samples and tangent, each relative to its largest number."""
    assert len(one.contacts.t_in) == len(other.contacts.t_in) > 8
    pairs = [(one.q, other.q), (one.q_dot, other.q_dot), (one.contacts.stop, other.contacts.stop)]
    pairs += [(getattr(one.contacts, n), getattr(other.contacts, n)) for n in ("t_in", "peak_force", "impulse")]
    if one.tangent is not None:
        pairs.append((one.tangent, other.tangent))
    for a, b in pairs:
        np.testing.assert_allclose(a, b, rtol=0.0, atol=tolerance * np.nanmax(np.abs(b)))


def touching_together(solution):
    """The largest number of stops in contact at once."""
    log = solution.contacts
    return max(int(((log.t_in <= t) & (t < log.t_out)).sum()) for t in log.t_in)


@pytest.mark.parametrize("signals", [(TONE,), (NOISE,), (TONE, NOISE)])
@pytest.mark.parametrize("dt", [None, 1e-3])
def test_blocks_and_tables_give_the_same_motion(signals, dt, monkeypatch):
    """Forces that go on, forces that enter with every kind of nodes, and signals; rounding grows by impacts."""
    through, tables = (run(6, signals, few, monkeypatch, dt=dt) for few in (0, 6))
    assert touching_together(tables) > 1
    same(through, tables, 1e-8)


@pytest.mark.parametrize("rtol", [1e-7, 1e-8, 1e-9])
def test_the_tangent_where_a_stop_is_left_just_after_another_was_entered(rtol):
    """Here 12 µs after: the slope of the law entered counts, though its force begins at zero, and grows like √δ."""
    system, start = tube(6, (NOISE,), laws=[LAWS[i] for i in (0, 1, 2, 4, 5)]), 1.0 / np.arange(1, MODES + 1) ** 3
    found, exact = (
        integrate(system, 2e-5 * start, 0.3 * start, 0.05, method=Exponential(r), tangent=True).tangent
        for r in (rtol, 1e-11)
    )
    assert np.abs(found - exact).max() < 1e-4 * np.abs(exact).max()


@pytest.mark.parametrize("signals", [(TONE,), (fb.BandNoise(6.0, (0.0, 300.0), seed=4),)])
def test_blocks_and_tables_have_the_same_tangent(signals, monkeypatch):
    """So has the tangent, which takes free motion, pairs and the end of a step from them.

    By rounding one takes up to seven steps more than the other: over a tone and twelve noises that changed the motion
    by 2e-11 at most and the tangent by 1e-9.
    """
    laws = [LAWS[i] for i in (0, 1, 2, 4, 5)]  # without that of an infinite slope at the surface
    through, tables = (run(6, signals, few, monkeypatch, laws, tangent=True) for few in (0, 6))
    same(through, tables, 1e-6)


def test_pairs_that_share_a_place_in_the_pool_are_summed_up_again(monkeypatch):
    """A pool with room for a single pair gives the same numbers to the last bit."""
    wanted = run(6, (TONE,), 0, monkeypatch)
    monkeypatch.setattr(preparation, "POOL", 1)
    found = run(6, (TONE,), 0, monkeypatch)
    np.testing.assert_array_equal(found.q, wanted.q)
    np.testing.assert_array_equal(found.contacts.peak_force, wanted.contacts.peak_force)


def test_many_stops_meet_an_independent_method():
    """40 stops of all laws against DOP853 with events; the first contacts, before errors have grown."""
    system, start = tube(40), 1.0 / np.arange(1, MODES + 1) ** 3
    one, other = (
        integrate(system, 0.0 * start, 0.2 * start, 0.01, method=method)
        for method in (Exponential(1e-9), DormandPrince(1e-11, 1e-16))
    )
    assert len(one.contacts.t_in) > 5
    np.testing.assert_array_equal(one.contacts.stop, other.contacts.stop)
    np.testing.assert_allclose(one.contacts.t_in, other.contacts.t_in, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(one.q, other.q, rtol=0.0, atol=1e-7 * np.abs(other.q).max())


def size_of(stops):
    """Bytes of the tables of so many stops of one law."""
    system = tube(stops, modes=30, laws=LAWS[:1])
    tables = prepare_system(system, forcing_of([signal for _, signal in system.loads], 1.0, 1e-8)).tables.value
    return sum(array.nbytes for array in tables if isinstance(array, np.ndarray))


@pytest.mark.parametrize("springs", [6, 30])  # by pairs of rows, and through the blocks
def test_many_springs_that_always_act_are_part_of_the_structure(springs):
    number, rng = np.arange(1, MODES + 1), np.random.default_rng(4)
    plain = tube(0)
    rows, stiffness = np.sin(np.pi * number * rng.random((springs, 1))), rng.uniform(20.0, 60.0, springs)
    contacts = [Contact(row, KelvinVoigt(k, 0.02), always=True) for row, k in zip(rows, stiffness, strict=True)]
    whole = System(plain.M, plain.C + 0.02 * rows.T @ rows, plain.K + (rows.T * stiffness) @ rows, loads=plain.loads)
    start = 1.0 / number**3
    found, wanted = (
        integrate(system, 0.01 * start, 0.3 * start, 0.3, 0.01, Exponential(1e-11))
        for system in (System(plain.M, plain.C, plain.K, contacts, plain.loads), whole)
    )
    assert np.abs(found.q - wanted.q).max() < 1e-10 * np.abs(wanted.q).max()
    assert np.abs(found.q_dot - wanted.q_dot).max() < 1e-10 * np.abs(wanted.q_dot).max()
    assert np.abs(found.energy.residual).max() < 1e-11 * np.abs(found.energy.input).max()


def test_memory_grows_linearly_with_the_stops():
    """But for the matrix of mobilities, eight bytes for each pair."""
    sizes = np.array([size_of(stops) for stops in (20, 40, 60)])
    assert np.diff(sizes, 2) == 8 * 2 * 20**2
    assert sizes[1] < 20e6


def test_runs_leave_no_trace_in_the_working_space_of_the_next():
    """Matrices and pairs stay there from run to run; the second run is the first to the last bit."""
    system, rest = tube(8), np.zeros(MODES)
    first, second = (integrate(system, rest, rest + 0.1, 0.03, method=Exponential(1e-8)) for _ in range(2))
    np.testing.assert_array_equal(first.q, second.q)
    assert first.cost.steps == second.cost.steps


def test_more_than_fits_is_refused_in_words(monkeypatch):
    """Before anything is allocated."""
    monkeypatch.setattr(block_tables, "MOST_BYTES", 1e7)
    rest = np.zeros(MODES)
    with pytest.raises(ValueError, match=r"Exponential would need .* GB for 300 stops and 7 modes.*use DormandPrince"):
        integrate(tube(300, laws=LAWS[:1]), rest, rest, 0.01, method=Exponential())
