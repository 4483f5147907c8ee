"""Work and damping of whole steps and of runs: against quadrature, closed forms, and the balance of energy."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from problems import PAPER_BEAM, TIP
from scipy.integrate import solve_ivp
from scipy.interpolate import BPoly
from scipy.linalg import block_diag
from scipy.special import roots_jacobi

import fembeam as fb
from contacts import Hertz, Hysteretic, Jenkins, KelvinVoigt, PiecewiseLinear, Polynomial, Viscoelastic
from solvers import Contact, DormandPrince, Exponential, SolverError, System, integrate, integrate_many
from solvers.exponential.contact.nodes import S
from solvers.exponential.energy import flight_tables
from solvers.exponential.energy.contact_tables import BEGAN, ENTERING, SQUARES, contact_table
from solvers.integration import prepared_run

FREE = [Contact([1.0, 1.0, 1.0, 0.5], Hertz(1e6), gap=1e9)]


class Nodes:
    """A signal that is known at nodes only, in between a quintic: two unequal waves."""

    def __init__(self):
        t = np.arange(102) * 0.02
        sin, cos, fast_sin, fast_cos = np.sin(7.0 * t), np.cos(7.0 * t), np.sin(31.0 * t), np.cos(31.0 * t)
        rows = sin + 0.3 * fast_cos, 7.0 * cos - 9.3 * fast_sin, -49.0 * sin - 288.3 * fast_cos
        self.rows = np.stack(rows, axis=1)
        self.quintic = BPoly.from_derivatives(t, self.rows)

    def __call__(self, t):
        return self.quintic(t)

    def nodes(self, duration, rtol):
        """Rows [s, s', s'']."""
        return 0.02, self.rows


SIGNALS = [], [Nodes()], [fb.Harmonic(2.0, 13.0), Nodes()]


def named(law):
    """Class of a law."""
    return type(law).__name__


def blocks(signals, omega=(0.0, 9.0, 40.0, 75.0), zeta=(0.0, 1.0, 3.0, 0.02), contacts=FREE):
    """A rigid, a critically damped, an overdamped and an oscillating block, each of which every load pushes."""
    loads = [(np.array([1.0, -0.7, 0.4, 0.9]) * (i + 1.0), signal) for i, signal in enumerate(signals)]
    return System.modal(omega, zeta, contacts, loads)


@pytest.mark.parametrize("signal", [fb.Harmonic(3.0, 1.3), Nodes()])
@pytest.mark.parametrize("shared", [0.05, 0.3, 0.8])
def test_damping_that_drives_some_rates_but_no_mode_balances(signal, shared):
    """C with eigenvalues 0.1 ± shared: beyond 0.1 right runs were refused, their balance lacking what C drives."""
    C, stop = [[0.1, shared], [shared, 0.1]], Contact([1.0, 0.5], Hertz(1e3), 0.3)
    system = System(np.eye(2), C, np.diag([9.0, 81.0]), [stop], [([1.0, 0.0], signal)])
    arguments = system, [1.0, 0.3], [0.0, 1.0], 2.0, 0.1
    found = integrate(*arguments, method=Exponential(1e-10))
    known = integrate(*arguments, method=DormandPrince(1e-12, atol=1e-14))
    assert len(found.contacts) > 0
    np.testing.assert_allclose(found.energy.damping, known.energy.damping, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(found.energy.residual, 0.0, atol=1e-9)


@pytest.mark.parametrize("stops", [1, 2, 3])  # of more than two, forces act through the blocks
@pytest.mark.parametrize("law", [Hertz(1e6), Viscoelastic.tsuji(1e6, 0.6, 1.0), KelvinVoigt(2e4, 20.0)], ids=named)
@pytest.mark.parametrize("signals", SIGNALS, ids=len)
def test_strongly_damped_blocks_balance_in_contact(signals, law, stops):
    """Much of what is handled is damped: what forces do to blocks of all kinds in steps of all kinds counts."""
    rows = np.array([[1.0, 1.0, 1.0, 0.5], [-0.8, 0.3, 1.2, -0.6], [0.4, -0.9, 0.7, 1.1]])[:stops]
    system = blocks(signals, contacts=[Contact(row, law, 1e-3 * i) for i, row in enumerate(rows)])
    run = integrate(system, np.zeros(4), -2.0 * rows.sum(axis=0), 0.2, 1.7e-4, Exponential(1e-12))
    assert set(run.contacts.stop.tolist()) == set(range(stops))
    assert run.energy.damping[-1] > 0.2 * run.energy.initial
    assert unaccounted(run) < 1e-12


ROW = np.array([1.0, 1.0, 1.0, 0.5])


def powers(system, stiffness, t, y):
    """Rates of (q, q', work of the loads, damping) at a spring and a cubic spring between ROW and the ground."""
    q, v = y[:4], y[4:8]
    load = sum((vector * signal(t) for vector, signal in system.loads), np.zeros(4))
    stretch = ROW @ q
    spring = stiffness * (stretch + stretch**3) * ROW
    return np.concatenate((v, load - spring - system.C @ v - system.K @ q, [load @ v, v @ system.C @ v]))


@pytest.mark.parametrize("stiffness", [0.0, 300.0], ids=["flight", "contact"])
@pytest.mark.parametrize("signals", SIGNALS, ids=len)
def test_work_and_damping_are_those_of_a_quadrature(signals, stiffness):
    """Each by itself, of motion integrated with them by SciPy."""
    springs = [Contact(ROW, Polynomial([stiffness, 0.0, stiffness]), always=True)] if stiffness else []
    system, start = blocks(signals, contacts=springs), ([0.1, 0.2, 0.1, 0.05], [1.0, 1.0, -2.0, 3.0])
    energy = integrate(system, *start, 0.4, 1e-2, Exponential(1e-12)).energy
    ends = np.arange(41) * 1e-2
    y, found = np.concatenate((*start, [0.0, 0.0])), np.zeros((41, 2))
    for i in range(40):  # a signal known at nodes has other third derivatives in every cell
        y = solve_ivp(partial(powers, system, stiffness), ends[i : i + 2], y, "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
        found[i + 1] = y[-2:]
    for known, exact in ((energy.input, found[:, 0]), (energy.damping, found[:, 1])):
        np.testing.assert_allclose(known, exact, rtol=0.0, atol=1e-11 * found[-1, 1])


@pytest.mark.parametrize("dt", [3e-4, 1e-2, 0.3])
@pytest.mark.parametrize("signals", SIGNALS, ids=len)
def test_free_motion_balances_to_rounding(signals, dt):
    """Outputs closer than a step, within cells, and over many of them."""
    run = integrate(blocks(signals), [0.1, 0.2, 0.1, 0.05], [1.0, 1.0, -2.0, 3.0], 1.0, dt)
    energy = run.energy
    assert energy.damping[-1] > 0.1 * energy.initial
    assert np.abs(energy.residual).max() < 1e-12 * (energy.initial + np.abs(energy.input).max())


def test_work_of_a_tone_at_resonance_grows_with_time():
    """Undamped at ω from rest under sin ωt: q̇ = t sin(ωt)/2, ω q = (sin ωt - ωt cos ωt)/2ω; work like t²/8."""
    omega, t = 40.0, np.arange(401) * 5e-3
    tone = fb.Multisine([1.0], [omega], [np.pi / 2])
    run = integrate(System.modal([omega], 0.0, [], [([1.0], tone)]), [0.0], [0.0], 2.0, 5e-3)
    q_dot, omega_q = 0.5 * t * np.sin(omega * t), (np.sin(omega * t) - omega * t * np.cos(omega * t)) / (2.0 * omega)
    work = 0.5 * (q_dot**2 + omega_q**2)
    np.testing.assert_allclose(run.energy.input, work, atol=1e-8 * work.max())
    assert np.abs(run.energy.residual).max() < 1e-12 * work.max()


def test_a_signal_longer_than_the_run_and_many_tones_balance():
    """Tables that go on beyond the end; more tones than rows are kept for, where the work is summed by series."""
    noise = System.modal(
        [30.0, 200.0], 0.02, [Contact([1.0, 0.5], Hertz(1e6))], [([1.0, 0.3], fb.BandNoise(3.0, (5.0, 300.0), seed=4))]
    )
    run = integrate(noise, [0.0, 0.0], [0.0, 0.0], 1.2345, 1e-3)
    assert len(run.contacts) > 3
    assert np.abs(run.energy.residual).max() < 1e-8 * np.abs(run.energy.input).max()
    tones = fb.Multisine(np.full(300, 0.3), np.linspace(5.0, 280.0, 300), np.arange(300) ** 2 * 0.1)
    many = System.modal([30.1, 201.3], 0.02, [Contact([1.0, 0.5], Hertz(1e6))], [([1.0, 0.3], tones)])
    run = integrate(many, [0.0, 0.0], [0.0, 0.0], 0.2, 1e-3)
    assert np.abs(run.energy.residual).max() < 1e-8 * np.abs(run.energy.input).max()


def test_coupled_damping_balances():
    """A dashpot between two masses, struck; damping is a full form there."""
    M, K = np.eye(3), np.array([[900.0, -400.0, 0.0], [-400.0, 800.0, -400.0], [0.0, -400.0, 400.0]])
    C = np.zeros((3, 3))
    C[0, 0], C[1:, 1:] = 3.0, [[2.0, -2.0], [-2.0, 2.0]]
    for signal in (fb.Harmonic(20.0, 17.0), Nodes()):
        system = System(M, C, K, [Contact([0.0, 0.0, 1.0], Hertz(1e5))], [([0.0, 50.0, 0.0], signal)])
        run = integrate(system, [0.0] * 3, [0.0, 0.0, -1.0], 1.0, 2e-3)
        assert len(run.contacts) >= 3
        handled = np.abs(run.energy.input).max() + run.energy.initial
        assert run.energy.damping[-1] > 1e-2 * handled
        assert np.abs(run.energy.residual).max() < 1e-8 * handled


def nearly_critical(by, loads):
    """Two masses whose dashpots exceed, by a share of themselves, those at which two of the roots fall together."""
    C = 1.681702842677874 * (1.0 + by) * np.array([[1.0, 0.5], [0.5, 1.5]])
    return System(np.eye(2), C, np.diag([1.0, 4.0]), [Contact([1.0, 0.3], Hertz(1e4), 0.1)], loads)


@pytest.mark.parametrize("loads", [[], [([0.2, -0.1], fb.Harmonic(1.0, 3.0))]], ids=["free", "driven"])
def test_roots_of_damping_that_nearly_fall_together(loads):
    """Their blocks are almost alike and cancel in the motion: their energies are known to eps/share², whatever `rtol`.

    That is 2e-6; of 120 roundings the worst was 1.1 times it.
    """
    start = [0.3, -0.2], [-1.0, 0.4]
    run = integrate(nearly_critical(1e-5, loads), *start, 10.0, 0.1, Exponential(1e-10))
    exact = integrate(nearly_critical(1e-5, loads), *start, 10.0, 0.1, DormandPrince(1e-12))
    np.testing.assert_allclose(run.q, exact.q, rtol=0.0, atol=1e-9)
    assert run.energy.damping[-1] == pytest.approx(exact.energy.damping[-1], rel=9e-6)
    with pytest.raises(SolverError, match="does not balance"):  # to 1e-3 only
        integrate(nearly_critical(1e-7, loads), *start, 10.0, 0.1, Exponential(1e-10))


@pytest.mark.parametrize(
    ("signal", "duration"),
    [(fb.Harmonic(2.0, 13.0), 2.0), (fb.Harmonic(2.0, 13.0), 200.0), (Nodes(), 2.0)],
    ids=["short", "long", "nodes"],
)
@pytest.mark.parametrize("left", [0.0, 1e-16, 1e-9])
def test_loads_that_cancel_leave_a_motion_that_is_rounding(signal, duration, left):
    """Rounding of the work of each load was taken for a gain of energy; what they leave beyond it is right."""
    push, turned = np.array([0.6, -1.7]), np.array([[0.8, 0.6], [-0.6, 0.8]])
    vectors = turned @ push, -(turned @ push) * (1.0 - left)
    stop = Contact(turned @ np.array([1.0, 0.0]), Hertz(1e6), gap=1e-3)
    system = System(np.eye(2), 0.3 * np.eye(2), np.diag([30.0, 400.0]), [stop], [(one, signal) for one in vectors])
    run = integrate(system, [0.0, 0.0], [0.0, 0.0], duration, 0.01)
    alone = replace(system, loads=[(vectors[0] * max(left, 1e-16), signal)])
    exact = integrate(alone, [0.0, 0.0], [0.0, 0.0], duration, 0.01)
    np.testing.assert_allclose(run.q, exact.q, rtol=0.0, atol=2e-16 if left < 1e-9 else 2e-15)


@pytest.mark.parametrize("seed", [2, 3, 5, 6, 7])
def test_stops_that_rounding_moves_on_their_surface_take_few_steps(seed):
    """At a rate that is rounding a stop drifted out of a contact, which then took 1e7 steps of the shortest length."""
    rng = np.random.default_rng(seed)
    angle, push = rng.uniform(0.0, 6.28), 3.0 * rng.normal(size=2)
    turned = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    stop = Contact(turned @ np.array([1.0, 0.3]), KelvinVoigt(1e6, 0.0), gap=0.0)
    loads = [(turned @ push * way, fb.Harmonic(2.0, 60.0)) for way in (1.0, -1.0)]
    system = System(np.eye(2), 0.3 * np.eye(2), np.diag([3e4, 4e4]), [stop], loads)
    run = integrate(system, [0.0, 0.0], [0.0, 0.0], 0.05, 0.01)
    assert run.cost.steps < 20_000
    assert np.abs(run.q).max() < 1e-15


def test_energies_while_stops_rest_on_their_surfaces():
    """A landing of any error lasted as long as the rounding of δ at a slow rate: energies were off by 2e-4."""
    for seed in range(60):
        rng = np.random.default_rng(seed)
        n = int(rng.integers(3, 6))
        shapes, _ = np.linalg.qr(rng.normal(size=(n, n)))
        K = (shapes * np.sort(rng.uniform(20.0, 300.0, n)) ** 2) @ shapes.T
        C = (shapes * rng.uniform(0.3, 3.0, n)) @ shapes.T
        row, law = (
            shapes[:, 1:] @ rng.normal(size=n - 1),
            PiecewiseLinear([1e5, 1e6], [1e-4]),
        )  # rests in the first mode
        load = 50.0 * shapes[:, 0], fb.Harmonic(1.0, rng.uniform(10.0, 200.0))
        stops = [Contact(row, law, gap=0.0), Contact(-row, law, gap=0.0)]
        run = integrate(System(np.eye(n), (C + C.T) / 2, (K + K.T) / 2, stops, [load]), *np.zeros((2, n)), 0.2, 0.01)
        assert np.abs(run.energy.residual).max() <= 2e-7 * run.energy.stored.max(), seed


class RoughNodes(Nodes):
    """A signal whose values, slopes and curvatures at the nodes have nothing to do with one another."""

    def nodes(self, duration, rtol):
        """Rows [s, s', s'']."""
        rows = np.random.default_rng(5).normal(size=(int(duration / 0.02) + 3, 3))
        return 0.02, 20.0 * rows / np.array([1.0, 0.02, 0.02**2])


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e7])
def test_coupled_damping_balances_in_any_unit_of_time(unit):
    """Of frequencies of 1e7 rad/s its rows were known to 1e-16 of the largest, in which p and v were mixed."""
    omega, row = np.array([1.0, 6.3, 17.5]) * unit, np.array([1.0, -1.0, 1.0])
    stop = Contact([1.0, 0.5, 0.2], PiecewiseLinear([400.0 * unit**2]), gap=0.05)
    C = np.diag(0.02 * omega) + 0.4 * unit * np.outer(row, row)
    system = System(np.eye(3), C, np.diag(omega**2), [stop])
    run = integrate(system, [0.3, 0.1, 0.0], np.zeros(3), 5.0 / unit, 0.5 / unit)
    assert len(run.contacts)
    assert np.abs(run.energy.residual).max() < 1e-11 * unit**2


@pytest.mark.parametrize("stops", [[], [Contact([1.0, 0.5, -0.3], Hertz(1e6), gap=2e-5)]], ids=["flight", "impacts"])
def test_cells_balance_without_tables(monkeypatch, stops):
    """Of many coordinates with coupled damping there are no forms of whole cells: series give the same balance."""
    phi, omega = np.array([1.0, -2.0, 0.7]), np.array([30.0, 400.0, 6000.0])
    load = np.array([1.0, 0.3, -0.5]), fb.BandNoise(1.0, (50.0, 300.0), seed=3)

    def balance(most):
        monkeypatch.setattr(flight_tables, "_MOST_NUMBERS", most)
        C = np.diag(0.04 * omega) + 5.0 * np.outer(phi, phi)
        system = System(np.eye(3), C, np.diag(omega**2) * (1.0 + 1e-15 * most), stops, [load])
        return integrate(system, np.zeros(3), np.zeros(3), 0.05, dt=1e-3).energy

    tabled, by_series = balance(10_000_000), balance(0)
    assert np.abs(by_series.residual).max() < 1e-9 * np.abs(by_series.input).max()
    for name in ("input", "damping"):
        known = getattr(tabled, name)
        np.testing.assert_allclose(getattr(by_series, name), known, atol=1e-6 * np.abs(known).max())


@pytest.mark.parametrize("seed", [1, 4, 10])
def test_a_dashpot_across_modes_of_one_frequency_balances(seed):
    """One of two equal modes is not damped: the rounding of what damping reads of it, 1e-15, is not magnified."""
    X, damping = np.random.default_rng(seed).standard_normal((4, 4)), np.zeros((4, 4))
    damping[:2, :2], damping[2:, 2:] = np.outer([0.22, -0.66], [0.22, -0.66]), [[125.0, 34.0], [34.0, 28.0]]
    system = System(X.T @ X, X.T @ damping @ X, X.T @ np.diag([5.29e3, 5.29e3, 5.18e5, 5.18e5]) @ X)
    start = np.linalg.solve(X, [1e-3, 2e-3, -1e-3, 5e-4])
    energy = integrate(system, start, np.zeros(4), 0.02, 1e-3, Exponential(1e-10), check=False).energy
    assert np.abs(energy.residual).max() < 1e-12 * energy.damping[-1]


@pytest.mark.parametrize("dashpot", [0.0, 4.0])
def test_parts_of_cells_of_a_rough_signal_balance(dashpot):
    """Flights that begin and end within a cell: the power of a quintic there is of the eleventh power of the time."""
    direction = np.array([1.0, 0.5])
    C = np.diag([0.4, 0.9]) + dashpot * np.outer(direction, direction)
    system = System(np.eye(2), C, np.diag([20.0, 45.0]) ** 2, [Contact(direction, Hertz(1e5))],
                    [([1.0, 0.4], RoughNodes())])  # fmt: skip
    run = integrate(system, [0.0, 0.0], [0.0, 0.0], 1.0, 0.0173, Exponential(1e-11))
    assert len(run.contacts) > 5
    assert unaccounted(run) < 1e-12


@pytest.mark.parametrize("law", [Hertz(1e6), PiecewiseLinear([1e4, 5e4], [1e-3])])
@pytest.mark.parametrize("signal", [fb.Harmonic(30.0, 17.0), Nodes()])
def test_the_ledger_leaves_the_motion_alone(law, signal):
    """The same steps with and without, bit for bit; and many outputs within one contact balance as well."""
    system = System.modal([20.0, 130.0, 900.0], 0.02, [Contact([1.0, 0.6, 0.4], law)], [([1.0, 0.4, 0.2], signal)])
    start = [0.0, 0.0, 0.0], [-0.5, 0.0, 0.0]
    for dt in (2e-5, 1e-3):
        with_it, without = (integrate(system, *start, 0.2, dt, Exponential(1e-8, ledger=one)) for one in (True, False))
        np.testing.assert_array_equal(with_it.q, without.q)
        np.testing.assert_array_equal(with_it.contacts.t_out, without.contacts.t_out)
        assert with_it.cost.steps == without.cost.steps
        assert len(with_it.contacts) >= 1
        handled = np.abs(with_it.energy.input).max() + with_it.energy.initial
        assert np.abs(with_it.energy.residual).max() < 2e-9 * handled
        assert np.all(np.diff(with_it.energy.damping) >= -1e-13 * handled)
        assert np.all(np.isnan(without.energy.input))


def test_steps_with_a_ledger_are_those_it_has_tables_for():
    """Longer than 200 rad of the fastest mode a step is integrated in panels: 1.8 s for 0.05 s with 120 modes."""
    omega, duration = 1e6, 0.05
    system = System.modal([10.0, omega], 0.01, [Contact([1.0, 0.5], Jenkins(2e4, 1e3), 0.0, always=True)])
    start = [1e-3, 0.0], [0.5, 0.0]
    ends, run = integrate(system, *start, duration), integrate(system, *start, duration, 1e-3)
    assert ends.cost.steps < 100 < omega * duration / 200.0 < run.cost.steps
    assert np.abs(ends.q - run.q[-1]).max() < 1e-11
    assert unaccounted(run) < 1e-9


def test_outputs_of_another_spacing_give_the_same_ledger():
    """Where samples coincide; every other one of twice as many."""
    system = blocks([fb.Harmonic(2.0, 13.0), Nodes()])
    start = [0.1, 0.2, 0.1, 0.05], [1.0, 1.0, -2.0, 3.0]
    fine, coarse = (integrate(system, *start, 1.0, dt).energy for dt in (5e-3, 1e-2))
    for name in ("input", "damping"):
        np.testing.assert_allclose(
            getattr(fine, name)[::2], getattr(coarse, name), rtol=0.0, atol=1e-12 * fine.damping[-1]
        )


def test_tables_of_many_spacings_are_let_go():
    """They counted a 300th of their size: 2400 spacings of two modes held 660 MB, of 256 at most."""
    system = blocks([fb.Harmonic(2.0, 13.0)])
    prepared = prepared_run(system, [0.1] * 4, [0.0] * 4, 1.0, None, Exponential(), False).engine.prepared
    arrays = [array for array in prepared.energy_tables_for(0.1).value if isinstance(array, np.ndarray)]
    assert prepared.kept.size >= sum(array.nbytes for array in arrays) > 100_000
    assert prepared.kept.most < 1e8


def unaccounted(run):
    """Energy a run does not account for, in units of what it handled, the exchange within its contacts included."""
    energy, log = run.energy, run.contacts
    handled = energy.initial + sum(np.abs(part).max() for part in (energy.stored, energy.input, energy.damping))
    return np.abs(energy.residual).max() / (handled + np.abs(log.peak_force * log.peak_indentation).sum())


@pytest.mark.parametrize("rtol", [1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize(
    "law",
    [
        *(Hertz(1e6), Hysteretic(1e6, 0.4), Viscoelastic.tsuji(1e6, 0.6, 1.0), KelvinVoigt(2e4, 20.0)),
        *(PiecewiseLinear([1e4, 5e4], [5e-3]), Jenkins(400.0, 1.5)),
    ],
    ids=named,
)
def test_samples_within_contacts_balance_as_well_as_their_ends(law, rtol):
    """Many samples within every step, one mode and two: rtol or rounding, however stiff or flat the law."""
    jenkins = isinstance(law, Jenkins)
    for n in (1, 2):
        rows = np.array([1.0, -1.2])[:n]
        contact = Contact(-rows, law, gap=0.0 if jenkins else 0.01, always=jenkins)
        system = System.modal([10.0, 63.0][:n], 0.01, [contact], [(rows, fb.Harmonic(30.0, 14.0))])
        run = integrate(system, np.zeros(n), -0.8 * rows, 1.0, 1.7e-4, Exponential(rtol))
        assert len(run.contacts) >= 3 or jenkins
        assert unaccounted(run) < 2.0 * rtol + 1e-12


def test_work_against_a_force_that_hardly_changes():
    """Steps of a slider grow until fast modes oscillate between the nodes of a step, where no node sees their work."""
    omega, rows = [10.0, 63.0, 180.0, 400.0, 900.0, 2000.0], np.array([1.0, -1.2, 0.9, 1.1, -0.8, 0.7])
    contact = Contact(-rows, Jenkins(400.0, 1.5), always=True)
    for n in (2, 6):
        system = System.modal(omega[:n], 0.01, [replace(contact, direction=-rows[:n])], [])
        run = integrate(system, np.zeros(n), -0.8 * rows[:n], 1.0, 1e-3, Exponential(1e-10))
        assert len(run.transitions) > 2
        assert unaccounted(run) < 1e-11


@pytest.mark.parametrize(("ratio", "rtol"), [(300.0, 1e-11), (1e4, 1e-9)])
def test_friction_takes_limit_times_slip_beside_a_fast_coordinate(ratio, rtol):
    """A slider between two coordinates: a step of slip lasts many periods of the fast one, which no node resolves."""
    rows, limit = np.array([1.0, 1.78]), 1.6
    slider, drive = Contact(-rows, Jenkins(375.0, limit), always=True), (rows, fb.Harmonic(52.0, 75.0))
    system = System.modal([10.0, 10.0 * ratio], 3.6e-3, [slider], [drive])
    for dt in (1e-2, None):  # with an energy balance, and without
        run = integrate(system, np.zeros(2), -0.8 * rows, 2.0, dt, Exponential(rtol))
        assert run.losses.loss[0] == pytest.approx(limit * run.losses.slip[0], rel=1e-10)
        assert dt is None or unaccounted(run) < 1e-11


def test_a_slider_with_its_static_shape_balances():
    """The paper's beam in steps of slip of up to 200 rad of the fastest of its coordinates."""
    limit = 0.5335
    supports, masses = [fb.Clamped(0.0)], [fb.LumpedMass(TIP, 25.4e-3, 3.0e-6)]
    slider, damping = fb.Element(0.1471, Jenkins(8.83e5, limit)), fb.ModalDamping([0.02, 0.01])
    scene = fb.Scene(PAPER_BEAM, supports, masses, elements=[slider], damping=damping, base=fb.Harmonic(9.94e-4, 91.72))
    model = scene.reduce(5, residual=True)
    run = model.simulate(0.4, 1e-3, solver=Exponential(1e-12))
    assert unaccounted(run) < 1e-11
    for losses in (run.losses, model.simulate(0.4, solver=Exponential(1e-12)).losses):
        assert losses.loss[0] == pytest.approx(limit * losses.slip[0], rel=1e-10)


@pytest.mark.parametrize("omega", [800.0, 2000.0])
@pytest.mark.parametrize("damping", [100.0, 300.0])
def test_a_stop_that_pulls_under_a_tone_is_not_refused(omega, damping):
    """Without samples a bound takes the place of the balance, but ∫|F| dt is none of |∫F dt|: half of these fell."""
    mass, stop = np.array([[0.08]]), Contact([-1.0], KelvinVoigt(1e3, damping))
    system = System(mass, 0.0 * mass, 0.0 * mass, [stop], [([1.0], fb.Harmonic(60.0, omega))])
    run = integrate(system, [-1e-3], [0.8], 0.03)
    sampled = integrate(system, [-1e-3], [0.8], 0.03, 1e-3)
    assert len(run.contacts) >= 1
    np.testing.assert_allclose([run.q[-1], run.q_dot[-1]], [sampled.q[-1], sampled.q_dot[-1]], rtol=1e-9)
    many = integrate_many(system, [[-1e-3]], [[0.8]], 0.03)
    np.testing.assert_allclose(many.q[0], run.q[-1], rtol=1e-9)


@pytest.mark.parametrize("broken", ["end_response", "contact_propagator"])
def test_runs_in_broken_steps_are_refused(broken):
    """Wrong by 1e-4 in what forces do by the end of a contact step, or in the free motion until then."""
    law = Hysteretic(1e6, 0.4)
    system = System.modal([11, 67], 0.01, [Contact([-1.0, 1.2], law, 0.01)], [([1.0, -1.2], fb.Harmonic(30.0, 14.0))])
    arguments = system, [0.0, 0.0], [-0.8, 0.9], 1.0, 0.01, Exponential(1e-8)
    assert len(integrate(*arguments).contacts) >= 3
    table = getattr(prepared_run(*arguments, False).engine.prepared.tables.value, broken)
    kept = table.copy()
    table *= 1.0 + 1e-4
    try:
        with pytest.raises(SolverError, match="energy does not balance"):
            integrate(*arguments)
    finally:
        table[:] = kept
    integrate(*arguments)


# --- many coordinates ------------------------------------------------------------------------------------------------

COPIES = 5  # of 12 coordinates each: more than 100 rows, from which on forms are sparse


def chain(copies, tones_only):
    """Copies of twelve chain modes that do not touch each other, each with a stop, a tone, a record and noise."""
    n = 12
    K = 400.0 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    w2, V = np.linalg.eigh(K)
    t = np.linspace(0.0, 1.0, 101)
    signals = [fb.Harmonic(3.0, 11.0), fb.Record(t, np.sin(9 * t) ** 3), fb.Record(t, 2.0 * np.cos(14 * t) ** 5)]
    loads = [(np.tile(V[3 + i], copies), signal) for i, signal in enumerate(signals)]
    stops = [Contact(row, KelvinVoigt(5e3, 1.0), 1e-3) for row in np.kron(np.eye(copies), -V[6])]
    C, K = (block_diag(*[part] * copies) for part in (np.diag(0.04 * np.sqrt(w2)), np.diag(w2)))
    return System(np.eye(copies * n), C, K, stops, loads[:1] if tones_only else loads)


@pytest.mark.parametrize("tones_only", [True, False])
def test_copies_of_a_structure_take_as_many_times_its_energy(tones_only):
    one, many = (
        integrate(system, np.zeros(system.size), np.zeros(system.size), 1.0, 0.01)
        for system in (chain(1, tones_only), chain(COPIES, tones_only))
    )
    assert len(many.contacts) == COPIES * len(one.contacts) > 0
    size = COPIES * np.abs(one.energy.stored).max()
    for name in ("input", "damping", "stored", "contact"):
        found, expected = getattr(many.energy, name), COPIES * getattr(one.energy, name)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * size, err_msg=name)
    assert np.abs(many.energy.residual).max() < 1e-9 * np.abs(many.energy.input).max()


@pytest.mark.parametrize(
    ("power", "lead", "k", "c"),
    [(1.0, 0.0, 900.0, 0.6), (2.0, 3.0, 0.0, 0.0), (2.0, 3.0, 30.0, 40.0), (4.0, 1.0, 4.0, 4.0)],
)
def test_tables_of_contact_steps_are_their_quadrature(power, lead, k, c):
    """∫ L_i v dt and ∫ v² dt of a block under forces given at the nodes, all of one integration of the equation."""
    nodes = 0.5 * (1.0 + roots_jacobi(S, 0.0, lead + power - 1.0)[0])
    arrays = [np.array(values).tobytes() for values in ([k], [c], [0.7])]
    table = contact_table(*arrays, power, lead, nodes.tobytes())[0, 0]
    rng = np.random.default_rng(2)
    start, forces = [0.3, -1.0], rng.standard_normal(S)
    entering = rng.standard_normal(S) if lead else np.zeros(S)

    def lagrange(sigma):
        return np.array([np.prod([(sigma - b) / (a - b) for b in nodes if b != a]) for a in nodes])

    def rate(sigma, z):
        basis, pace = lagrange(sigma), 0.7 * power * sigma ** (power - 1.0)
        weighted = (sigma / nodes) ** lead if lead else np.zeros(S)
        force = basis @ forces + (basis * weighted) @ entering
        v = z[1]
        return pace * np.concatenate(([v, force - k * z[0] - c * v, v * v], basis * v))

    exact = solve_ivp(rate, (0.0, 1.0), [*start, *np.zeros(1 + S)], "DOP853", rtol=3e-14, atol=1e-14).y[2:, -1]
    sums = np.concatenate((forces, start)) @ table[:BEGAN] + entering @ table[ENTERING:SQUARES]
    squares = sums[S:] @ forces + table[BEGAN, :3] @ [start[0] ** 2, start[0] * start[1], start[1] ** 2]
    squares += np.concatenate((entering, start)) @ table[SQUARES:, :S] @ entering
    np.testing.assert_allclose(sums[:S], exact[1:], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(squares, exact[0], rtol=1e-12)


@pytest.mark.parametrize("dt", [0.01, None])
@pytest.mark.parametrize(("stiffness", "gap"), [(1e4, 1e-3), (1e2, -3e-4), (1e4, 0.1)])
def test_rounding_at_rest_is_not_refused(stiffness, gap, dt):
    """A bar on a hinge lies where the spring of an element is free: all energies are roundings, 1e-33 J."""
    bar = fb.Section.rectangle(2.1e11, 7850.0, 0.02, 0.01)
    spring = fb.Element(0.8, KelvinVoigt(stiffness, 0.0), gap=gap)
    model = fb.Scene(fb.Beam(0.8, bar), [fb.Pinned(0.0)], elements=[spring], damping=fb.ModalDamping(0.02)).reduce(3)
    run = model.simulate(0.2, dt, start=model.equilibrium())
    assert run.status == "finished"


def ill_conditioned(seed, least):
    """A soft mode in coordinates that mix it with stiff ones and stretch it by 1/``least``; its start and matrices."""
    rng, omega = np.random.default_rng(seed), np.array([4.0, 312.0, 314.0])
    u, v = (np.linalg.qr(rng.standard_normal((3, 3)))[0] for _ in range(2))
    T = u @ np.diag([1.0, 1.0, least]) @ v
    M, C, K = (0.5 * (A + A.T) for A in (T.T @ T, T.T @ np.diag(0.02 * omega) @ T, T.T @ np.diag(omega**2) @ T))
    system = System(M, C, K, [Contact(np.array([1.0, 0.3, 0.2]) @ T, Hertz(1e6), 0.1)])
    return system, np.linalg.solve(T, [0.3, 0.0, 0.0]), np.zeros(3)


@pytest.mark.parametrize("seed", [0, 2, 5, 7])
def test_rounding_of_ill_conditioned_coordinates_is_not_refused(seed):
    """Terms of qᵀKq cancel by 1e9 there: right runs were refused at a small rtol, and a smaller one was advised."""
    run = integrate(*ill_conditioned(seed, 1e-3), 3.0, 0.03, Exponential(1e-12))
    assert abs(run.energy.residual).max() > 1e-9 * run.energy.stored.max()


@pytest.mark.parametrize("dt", [0.03, 3.0])
def test_matrices_without_digits_for_the_motion_are_named(dt):
    """They tell its energy to 0.5 %: a smaller rtol was advised, which does not help."""
    with pytest.raises(SolverError, match=r"no setting helps: it is a sum of terms up to [1-9]e\+13 times as large"):
        integrate(*ill_conditioned(0, 1e-5), 3.0, dt)


def test_rounding_of_damping_in_ill_conditioned_coordinates_couples_no_modes():
    """Products left 4e-10 of the damping between modes: as coupled ones, two rigid bodies were not told apart."""
    rng = np.random.default_rng(3)
    u, v = (np.linalg.qr(rng.standard_normal((3, 3)))[0] for _ in range(2))
    T = u @ np.diag([1.0, 0.02, 2e-5]) @ v
    M, C, K = (
        0.5 * (A + A.T) for A in (T.T @ T, T.T @ np.diag([0.0, 1.3, 4.6]) @ T, T.T @ np.diag([0.0, 66.0, 230.0]) @ T)
    )
    assert not System(M, C, K).blocks.loss.size
