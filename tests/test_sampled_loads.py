"""Loads given as node tables: their responses, several on unequal grids, and none passed over where all is at rest."""

import math
import tracemalloc
from dataclasses import dataclass
from functools import cache, partial
from itertools import combinations
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import brentq

import fembeam as fb
from contacts import Hertz, Hysteretic, KelvinVoigt, Polynomial
from solvers import RK4, Contact, DormandPrince, Exponential, System, integrate, integrate_many
from solvers.exponential.flight import cell_of
from solvers.exponential.phi_functions import signal_responses
from solvers.exponential.responses import propagate
from solvers.integration import prepared_once
from solvers.problem import forcing_of, on_one_grid

REST = np.zeros(2)
STEEL = fb.Section(E=2.1e11, rho=7800.0, A=1e-4, I=8.3e-10)


class Table:
    """A node table as it is."""

    def __init__(self, dt, rows):
        self.dt, self.rows = dt, rows

    def __call__(self, t):
        raise AssertionError("its nodes say all")

    def nodes(self, duration, rtol):
        return self.dt, self.rows


def rough(dt, count, seed):
    """A table whose every node is a kink of the third derivative."""
    return Table(dt, np.random.default_rng(seed).standard_normal((count, 3)) / dt ** np.arange(3))


def record(h, count, quantity="force"):
    """Samples joined by straight lines."""
    values = np.random.default_rng(count).standard_normal(count)
    return fb.Record(h * np.arange(count), values, quantity=quantity, interpolation="linear", detrend=True)


# --- responses ----------------------------------------------------------------------------------------------------


def responses(k, c, steps):
    """State changes by loads on the rate of a block."""
    problem = SimpleNamespace(k=np.array([k]), c=np.array([c]), load=np.array([[0.0, 1.0]]))
    return signal_responses(problem, np.array(steps))[:, 0]


@pytest.mark.parametrize(("k", "c"), [(0.0, 0.0), (1.0, 1e-9), (1e6, 0.0), (1e4, 300.0)])
def test_responses_of_short_steps_do_not_depend_on_long_ones_beside_them(k, c):
    """A load t^j/j! moves a block by h^(j+2)/(j+2)! and gives it h^(j+1)/(j+1)!, to the first order in ωh and ch."""
    short = 1e-6 / max(math.sqrt(k), c, 1.0)
    found = responses(k, c, [1e12, 1.0, short])
    for order, (place, rate) in enumerate(found[2]):
        assert place == pytest.approx(short ** (order + 2) / math.factorial(order + 2), rel=2e-6)
        assert rate == pytest.approx(short ** (order + 1) / math.factorial(order + 1), rel=2e-6)
    for row, step in zip(found[1:], (1.0, short), strict=True):
        np.testing.assert_allclose(row, responses(k, c, [step])[0], rtol=1e-13)


@pytest.mark.parametrize("c", [0.0, 4e4, 3e6])
@pytest.mark.parametrize("h", [1e-4, 0.03])
def test_what_follows_a_load_does_so_to_rounding(c, h):
    """Under t^i/i!, x = Σ F_j t^(i-j)/(i-j)! with F_0 = -A⁻¹g and F_j = A⁻¹F_(j-1): E F_i and the response make it."""
    k = 1e12
    (alpha, beta), found = propagate(k, c, h), responses(k, c, [h])[0]
    follows = [np.array([1.0 / k, 0.0])]
    for _ in range(5):
        place, rate = follows[-1]
        follows.append(np.array([-(rate + c * place) / k, place]))
    for i, (place, rate) in enumerate(follows):
        moved = found[i] + [alpha * place + beta * rate, alpha * rate - beta * (k * place + c * rate)]
        parts = [follows[j] * h ** (i - j) / math.factorial(i - j) for j in range(i + 1)]
        largest = max(np.hypot(1e6 * p, v) for p, v in [*parts, found[i]])
        assert np.abs((moved - sum(parts)) * [1e6, 1.0]).max() < 1e-14 * largest  # 3e-16 measured; by doubling 2e-12


# --- damping that is rounding -------------------------------------------------------------------------------------


def on_pins(load, damping=0.0, dashpot=5.0):
    """Four modes of a beam on two pins with a dashpot in its middle, a node of every even mode."""
    return fb.Scene(
        fb.Beam(1.0, STEEL),
        [fb.Pinned(0.0), fb.Pinned(1.0)],
        dashpots=[fb.Dashpot(0.5, dashpot)] if dashpot else [],
        forces=[fb.PointForce(0.3, load)],
        damping=fb.ModalDamping(damping),
    ).reduce(modes=4)


LOADS = {"pulse": fb.Pulse(10.0, 0.02, 0.01), "noise": fb.BandNoise(10.0, (0.0, 1000.0), seed=1)}


@pytest.mark.parametrize("load", LOADS)
def test_a_dashpot_on_a_node_of_modes_leaves_them_undamped(load):
    system, rest = on_pins(LOADS[load]).system, np.zeros(4)
    assert np.count_nonzero(system.blocks.c == 0.0) == 2
    exact = integrate(system, rest, rest, 0.3, 1e-2, DormandPrince(1e-12))
    for rtol in (1e-6, 1e-8):
        method = Exponential(rtol)
        sampled = integrate(system, rest, rest, 0.3, 1e-2, method)
        plain = integrate_many(system, rest[None], rest[None], 0.3, method)
        assert np.abs(sampled.q - exact.q).max() < rtol * np.abs(exact.q).max()
        assert np.abs(plain.q[0] - exact.q[-1]).max() < rtol * np.abs(exact.q).max()


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("zeta", [1e-20, 1e-300, 5e-324, 1e-13, 1e-10])
def test_damping_of_any_size(zeta):
    rest = np.zeros(4)
    ours, undamped = (
        integrate(on_pins(LOADS["noise"], z, 0.0).system, rest, rest, 0.1, 1e-2, Exponential(1e-8)) for z in (zeta, 0.0)
    )
    assert np.abs(ours.q - undamped.q).max() <= 1e-8 * np.abs(undamped.q).max()


# --- several on one grid ------------------------------------------------------------------------------------------

SAMPLED = {
    "record": record(0.01, 130),
    "record of half the step": record(0.005, 240),
    "another record": record(0.0137, 90),
    "foot of a spring": record(0.0171, 80, "acceleration"),
    "pulse": fb.Pulse(3.0, 0.0111, 0.503),
    "noise": fb.BandNoise(1.0, (0.0, 300.0), seed=2),
    "coarse table": rough(0.05, 30, 1),
    "table": rough(0.003, 400, 2),
}


def under(*loads):
    """Motion of three modes under loads, one after the other along the same vectors."""
    vectors = [1.0, 0.7, 0.4], [0.5, -1.0, 0.6]
    system = System.modal([20.0, 130.0, 400.0], 0.02, [], [(v, s) for v, s in zip(vectors, loads, strict=True) if s])
    return integrate(system, np.zeros(3), np.zeros(3), 1.0, 0.01, Exponential(1e-8)).q


def test_sampled_loads_together_move_as_the_sum_of_each_alone():
    first, second = ({name: under(*place(load)) for name, load in SAMPLED.items()} for place in (
        lambda load: (load, None), lambda load: (None, load)))  # fmt: skip
    for one, other in combinations(SAMPLED, 2):
        both, alone = under(SAMPLED[one], SAMPLED[other]), first[one] + second[other]
        size = max(np.abs(first[one]).max(), np.abs(second[other]).max())
        assert np.abs(both - alone).max() < 1e-9 * size, (one, other)


def under_straight_lines(records, omega, duration):
    """[q, q̇] of an undamped oscillator from rest at every node of records of straight lines, by closed form."""
    nodes = np.unique(np.round(np.concatenate([one.t[one.t < duration] for one in records] + [[duration]]), 12))
    force = sum(one(nodes) for one in records) / omega**2
    motion, q, v = [(0.0, 0.0)], 0.0, 0.0
    for h, start, end in zip(np.diff(nodes), force[:-1], force[1:], strict=True):
        slope = (end - start) / h
        free, rate = q - start, (v - slope) / omega
        c, s = math.cos(omega * h), math.sin(omega * h)
        q, v = end + free * c + rate * s, slope + omega * (rate * c - free * s)
        motion.append((q, v))
    return np.array(motion)


@pytest.mark.parametrize("omega", [0.1, 1.0, 10.0, 100.0, 1000.0])
@pytest.mark.parametrize("step", [0.75, 2.0 / 3.0, math.sqrt(0.5), 0.5])
def test_two_records_of_unequal_steps(step, omega):
    """Their nodes coincide here and there, or never; one step of the first is ``omega`` radians."""
    records = [record(1.0, 19), record(step, int(10.3 / step) + 9)]
    system = System.modal([omega], [0.0], [], [([1.0], one) for one in records])
    run = integrate(system, [0.0], [0.0], 10.3, method=Exponential(1e-10))
    exact = under_straight_lines(records, omega, 10.3)
    assert (np.abs([run.q[-1, 0], run.q_dot[-1, 0]] - exact[-1]) / np.abs(exact).max(axis=0)).max() < 1e-9


def test_a_coarse_record_beside_a_fine_smooth_one_keeps_the_grid_of_the_fine():
    """One step of it holds more cells than a rough table is cut into; a fast structure must not cut these further."""
    fine = fb.BandNoise(1.0, (0.0, 400.0), seed=1)
    system = System.modal([1e5], 0.01, [], [([1.0], record(5.0, 9)), ([1.0], fine)])
    alone = System.modal([1e5], 0.01, [], [([1.0], fine)])
    together, by_itself = (prepared_once(one, Exponential(1e-8), 20.0)[0].table_dt for one in (system, alone))
    assert 0.5 * by_itself[0] < together[0] <= by_itself[0]


def test_a_short_pulse_beside_a_record_takes_little_more_memory_than_its_table():
    """It took 15 times as much, and 50 times the time of the integration."""
    fine, coarse = fb.Pulse(1.0, 0.01, 0.3).nodes(4.0, 1e-8), rough(0.05, 81, 0)
    loads = [(np.eye(1)[0], Table(*fine)), (np.eye(1)[0], coarse)]
    forcing = forcing_of([signal for _, signal in loads], 4.0, 1e-8)
    tracemalloc.start()
    together = on_one_grid(forcing, 4.0, 10.0)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert together.table.nbytes > forcing.table.nbytes
    assert peak < 4.0 * together.table.nbytes


# --- kinks --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("omega", "phase"), [(2.86, [3.07, 5.86, 0.49]), (1.13, [5.68, 1.14, 1.08])])
def test_a_stop_at_rest_on_its_surface_beside_one_that_is_pressed(omega, phase):
    """Tones give its rate a rounding into the stop, and no time is left to its surface: such runs did not end."""
    tones = fb.Multisine([1.0, 1.0, 1.0], omega * np.array([1.0, 1.7, 2.3]), phase)
    stops = [Contact([1.0], Hertz(1e3)), Contact([1.0], Hertz(1e3), gap=-0.1)]
    system = System.modal([2.0], [0.01], stops, [([1.0], tones), ([1.0], fb.Step(0.1, 0.5, 0.3))])
    here, there = (integrate(system, [0.0], [0.0], 0.5, method=make(1e-10)) for make in (Exponential, DormandPrince))
    np.testing.assert_allclose([here.q, here.q_dot], [there.q, there.q_dot], rtol=1e-7)


@pytest.mark.parametrize("place", [0.1, 1e-3, 1e-6, 0.0])
def test_an_entry_just_before_a_kink(place):
    """Under a constant load of 1 N, q = 1 - cos t reaches the stop; a part of a cell later the load has a kink."""
    gap = 1.3
    t_in = math.acos(1.0 - gap)
    h = t_in / (4.0 - place)
    load = fb.Record(h * np.arange(9), [1, 1, 1, 1, 1, -2, 0.5, 1, 0], quantity="force", interpolation="linear")
    system = System.modal([1.0], 0.0, [Contact([-1.0], KelvinVoigt(1e4, 0.0), gap)], [([1.0], load)])
    ours, other = (
        integrate(system, [0.0], [0.0], 7.0 * h, h / 3.0, method)
        for method in (Exponential(1e-9), DormandPrince(1e-12, 1e-15))
    )
    assert ours.contacts.t_in[0] == pytest.approx(t_in, rel=1e-13)
    assert ours.contacts.speed_in[0] == pytest.approx(math.sin(t_in), rel=1e-12)
    assert ours.q == pytest.approx(other.q, abs=1e-8)
    assert ours.cost.steps < 50  # cells are as long as the time between samples


@pytest.mark.parametrize("rtol", [1e-5, 1e-6, 1e-7])
def test_a_stop_that_opens_for_a_moment_within_a_landing_is_seen(rtol):
    """A swift mode lifts a stop by 2e-7 m on the way to a kink; by a cubic for δ it stayed in contact."""
    k = np.arange(1, 7)
    middle, third, place, pushed = (np.sin(k * math.pi * z) for z in (0.5, 1.0 / 3.0, 0.48323, 0.20897))
    C = 15.425 * np.outer(middle, middle) + 4.564 * np.outer(third, third)
    stop = Contact(place, Hysteretic(742993.0, 1.65724, clamp=False))
    forces = [0.1177, -1.1661, 2.1103, 0.7143, 0.0832, 0.9392, -1.0142, 0.3397, 1.6482, -5.4487, -4.8238]
    load = fb.Record(0.002650937 * np.arange(11), forces, quantity="force", interpolation="linear")
    system = System(np.eye(6), C, np.diag(37.46855 * k**2) ** 2, [stop], [(pushed, load)])
    q = [-0.000342415, 0.000430492, -0.000676116, -0.000695854, -0.000321337, 0.000839515]
    q_dot = [-0.295, 0.312761, 0.210523, -0.04811, -0.0847417, -0.406261]
    ours, exact = (integrate(system, q, q_dot, 0.0265, method=m) for m in (Exponential(rtol), DormandPrince(1e-11)))
    assert len(exact.contacts) == len(ours.contacts) == 2
    assert ours.contacts.t_out == pytest.approx(exact.contacts.t_out, abs=0.1 * rtol)
    assert ours.q[-1] == pytest.approx(exact.q[-1], abs=10.0 * rtol * np.abs(exact.q[-1]).max())


def test_a_table_may_tell_both_sides_of_kinks_but_not_of_jumps():
    """A load of |t - 1| on a free mass: q = t²/2 - t³/6 up to the kink, and on with the same rate."""
    rows = np.zeros((3, 2, 3))
    rows[:, :, 0] = [[1.0], [0.0], [1.0]]
    rows[:, :, 1] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0]]
    free = partial(System, np.eye(1), np.zeros((1, 1)), np.zeros((1, 1)))
    for method in (Exponential(1e-9), DormandPrince(1e-10)):
        run = integrate(free(loads=[([1.0], Table(1.0, rows.reshape(3, 6)))]), [0.0], [0.0], 2.0, 0.5, method)
        t = run.t
        exact = np.where(t < 1.0, t**2 / 2 - t**3 / 6, 1 / 3 + (t - 1) / 2 + (t - 1) ** 3 / 6)
        assert run.q[:, 0] == pytest.approx(exact, abs=1e-12)
    rows[1, 1, 0] = 0.1
    with pytest.raises(ValueError, match=r"load 0 jumps at t = 1 s; only slope and curvature may"):
        integrate(free(loads=[([1.0], Table(1.0, rows.reshape(3, 6)))]), [0.0], [0.0], 2.0)
    with pytest.raises(ValueError, match=r"load 0 must give rows .*, \(N, 6\); got the shape \(3, 4\)"):
        integrate(free(loads=[([1.0], Table(1.0, rows.reshape(3, 6)[:, :4]))]), [0.0], [0.0], 2.0)


@pytest.mark.parametrize("dt", [0.01, 0.05])
def test_stepping_through_a_coarse_table(dt):
    """Steps that passed over nodes erred by 50 to 100 times the tolerance, and were told to be right."""
    system = System.modal([10.0, 31.0], 0.01, [], [([1.0, 0.5], rough(dt, round(2.0 / dt) + 1, 1))])
    exact, ours = (integrate(system, [0, 0], [0, 0], 2.0, method=m) for m in (Exponential(1e-12), DormandPrince(1e-8)))
    assert np.abs(ours.q - exact.q).max() < 1e-8 * np.abs(exact.q).max()


CELLS = {  # value, slope, curvature of the load at both ends of a cell of 1 s, initial rate, gap, motion of a free mass
    "quintic": ([[0.0, 0.0, 0.0], [1.0, 5.0, 20.0]], 0.01, 0.02, lambda t: 0.01 * t + t**7 / 42.0),
    "there and back": ([[8.0, -16.0, 0.0], [-8.0, -16.0, 0.0]], -1.0, 0.4, lambda t: (4.0 - 8.0 / 3.0 * t) * t**2 - t),
}


@pytest.mark.parametrize("k", [0.0, 1e-12, 3.6e-4])
@pytest.mark.parametrize("name", CELLS)
def test_contacts_within_a_cell_that_is_short_for_the_structure(name, k):
    """A mass that hardly moves in a cell but by the load meets a soft stop; it was missed, or met 0.04 s late."""
    rows, rate, gap, free = CELLS[name]
    table = Table(1.0, np.vstack([rows, np.zeros(3)]))
    system = System([[1.0]], [[0.0]], [[k]], [Contact([-1.0], KelvinVoigt(1e-9, 0.0), gap)], [([1.0], table)])
    ours, theirs = (integrate(system, [0.0], [rate], 1.0, method=m) for m in (Exponential(1e-9), DormandPrince(1e-12)))
    assert len(theirs.contacts) == 1
    assert ours.contacts.t_in == pytest.approx(theirs.contacts.t_in, abs=1e-12)
    assert ours.contacts.speed_in == pytest.approx(theirs.contacts.speed_in, abs=1e-12)
    if k <= 1e-12:
        entry = brentq(lambda t: free(t) - gap, 0.5, theirs.contacts.t_in[0] + 0.02, xtol=1e-15)
        assert ours.contacts.t_in == pytest.approx([entry], abs=1e-12)


def test_tables_are_of_real_numbers_in_whatever_form():
    """Whole numbers and lists are tables, alone and beside others; others are refused with what they are."""
    rows = np.array([[1.0, -1.0, 0.0, 1.0, -1.0, 0.0], [0.0, 1.0, 0.0, 0.0, -1.0, 0.0], [1.0, 1.0, 0.0, 1.0, 1.0, 0.0]])
    steady = Table(1.0, np.outer([1, 1, 1], [1, 0, 0]))

    def end(*tables):
        system = System(np.eye(1), np.zeros((1, 1)), np.zeros((1, 1)), loads=[([1.0], one) for one in tables])
        return integrate(system, [0.0], [0.0], 2.0).q[-1]

    for form in (rows.astype(int), rows.tolist(), [tuple(row) for row in rows]):
        assert end(Table(1, form)) == pytest.approx(5.0 / 6.0 + 1.0 / 6.0, abs=1e-9)
        assert end(Table(1, form), steady) == pytest.approx(3.0, abs=1e-9)
    for wrong in (rows + 0.5j, None, [["a", "b", "c"]], rows[0, 0]):
        with pytest.raises(ValueError, match=r"load 0 must give (dt and rows of real numbers, got|rows)"):
            end(Table(1.0, wrong))


# --- nothing is passed over ---------------------------------------------------------------------------------------

STOPS = {"polynomial": Polynomial([2e4, 0.0, 1e9]), "Kelvin-Voigt": KelvinVoigt(2e4, 5.0), "Hertz": Hertz(1e6)}
METHODS = [Exponential(1e-3), Exponential(1e-8), DormandPrince(1e-4)]


def test_a_load_that_lifts_coupled_modes_off_a_stop_they_rest_on_begins_no_contact():
    """A dashpot couples two modes at rest at δ = 0; δ̈ = -w·load is negative, and so is δ from then on."""
    rng = np.random.default_rng(1)
    for _ in range(40):
        row, load, across = rng.uniform(0.3, 1.0, (3, 2))
        contact, table = Contact(row, KelvinVoigt(1e5, 10.0)), Table(1e-3, np.array([[3.0, 1.0, 0.0], [3.0, 1.0, 0.0]]))
        damping = np.diag([0.8, 5.0]) + 20.0 * np.outer(across, across)
        system = System(np.eye(2), damping, np.diag([1600.0, 90000.0]), [contact], [(load, table)])
        assert not len(integrate(system, REST, REST, 1e-3).contacts)


def pressed(stop, load):
    """Two modes at rest on a preloaded stop, under a load, and their place."""
    contact = Contact([1.0, 0.6], stop, -1e-4)
    system = System.modal([60.0, 380.0], 0.02, [contact], [([-1.0, 0.5], load)])
    share = contact.direction / np.diag(system.K)
    mobility = contact.direction @ share
    depth = brentq(lambda d: 1e-4 - mobility * float(stop.force(d, 0.0, 1.0)) - d, 0.0, 1e-3)
    return system, share * float(stop.force(depth, 0.0, 1.0))


@cache
def pushed(name, length, at):
    """A pulse on the modes at rest, their place, and their rates by small steps."""
    system, q = pressed(STOPS[name], fb.Pulse(30.0, length, at))
    return system, q, integrate(system, q, REST, 0.35, method=RK4(2e-5)).q_dot


@pytest.mark.parametrize("method", METHODS, ids=repr)
@pytest.mark.parametrize("name", STOPS)
def test_no_pulse_is_passed_over_at_rest_in_contact(name, method):
    for length, at in ((1e-3, 0.11), (1e-3, 0.273), (3e-3, 0.31), (1e-2, 0.2)):
        system, q, exact = pushed(name, length, at)
        ours = integrate(system, q, REST, 0.35, method=method)
        size = np.abs(exact).max()
        assert size > 1e-3
        assert np.abs(ours.q_dot - exact).max() < (20.0 * method.rtol + 1e-5) * size, (length, at)


@pytest.mark.parametrize("method", [Exponential(1e-3), DormandPrince(1e-8)], ids=repr)
def test_a_single_node_of_a_table_is_not_passed_over(method):
    """One value of 3000 is not zero: at rest on a stop, and a free mass in flight."""
    rows = np.zeros((3001, 3))
    rows[1713, 0] = 1.0
    system, q = pressed(STOPS["Kelvin-Voigt"], Table(1e-4, rows))
    system = system.like(loads=[([-30.0, 15.0], Table(1e-4, rows))])
    exact = integrate(system, q, REST, 0.2, method=RK4(1e-5))
    ours = integrate(system, q, REST, 0.2, method=method)
    assert np.abs(ours.q_dot - exact.q_dot).max() < 5e-3 * np.abs(exact.q_dot).max() < 1e-3
    free = integrate(System([[1.0]], [[0.0]], [[0.0]], loads=[([1.0], Table(1e-4, rows))]), [0.0], [0.0], 0.3,
                     method=method)  # fmt: skip
    assert free.q_dot[0, 0] == pytest.approx(1e-4, rel=1e-3)


def test_a_short_pulse_of_a_plain_function_is_sampled():
    """A thousandth of the run, between any of 64 cells: it gives a free mass its impulse."""
    for at in np.linspace(0.3, 0.32, 7):
        pulse = fb.Pulse(1.0, 1e-3, at)
        system = System([[1.0]], [[0.0]], [[0.0]], loads=[([1.0], lambda t, pulse=pulse: pulse(t))])
        end = integrate(system, [0.0], [0.0], 1.0, method=Exponential(1e-6))
        assert end.q_dot[0, 0] == pytest.approx(pulse.impulse, rel=1e-6)


@dataclass(frozen=True)
class Straight:
    """A load that grows along a line; its slope can be changed as long as its array can be written to."""

    slope: np.ndarray

    def __call__(self, t):
        return self.slope[0] * np.asarray(t)

    def nodes(self, duration, _rtol):
        return duration, np.array([[0.0, self.slope[0], 0.0], [self.slope[0] * duration, self.slope[0], 0.0]])


def test_signals_that_cannot_change_are_sampled_once():
    noise = System.modal([30.0], 0.01, [], [([1.0], fb.BandNoise(1.0, (0.0, 20.0), seed=3))])
    first, again = (prepared_once(noise, Exponential(), 2.0) for _ in range(2))
    assert again is first
    assert prepared_once(noise, Exponential(), 3.0) is not first
    assert prepared_once(noise, Exponential(1e-6), 2.0) is not first


def test_a_signal_that_can_change_is_sampled_anew():
    """q̈ = a t from rest: q = a t³/6."""
    slope = np.array([6.0])
    system = System.modal([0.0], 0.0, [], [([1.0], Straight(slope))])
    ends = []
    for slope[0] in (6.0, 12.0):
        ends.append(integrate(system, [0.0], [0.0], 1.0).q[-1, 0])
    assert ends == pytest.approx([1.0, 2.0], rel=1e-12)
    slope.setflags(write=False)
    assert prepared_once(system, Exponential(), 1.0) is prepared_once(system, Exponential(), 1.0)


@pytest.mark.parametrize("dt", [1e-3, 0.0009765625, 0.0007, 1.0 / 3.0])
def test_a_time_on_a_node_is_in_the_cell_behind_it_however_late(dt):
    """From 2^23 cells on rounding put it in the cell before: the input of band noise was off by a quarter."""
    problem = SimpleNamespace(table_dt=np.array([dt]), table_start=np.array([0, 1 << 40]))
    cells = np.random.default_rng(1).integers(0, 1 << 33, 2000).tolist()
    for times in ([cell * dt for cell in cells], [cell * dt - dt + dt for cell in cells]):
        assert [cell_of.py_func(problem, t)[0] for t in times] == cells


@pytest.mark.parametrize(
    "law", [KelvinVoigt(1e5, 0.0), KelvinVoigt(1e5, 5.0), Hertz(1e7)], ids=["linear", "damped", "hertz"]
)
@pytest.mark.parametrize("omega", [1e4, 3e4])
def test_contacts_of_a_mode_that_follows_the_load(omega, law):
    """Two modes, one of which follows the load with ωh of some hundred: by DormandPrince, and in few steps.

    The mode rests on the load when a contact begins: what the contact's force sets swinging counts from then on.
    """
    load = [1.0, 1e-3 * omega**2], fb.SineSweep(1.0, 2.0, 6.0, 1.5)
    system = System.modal([10.0, omega], [0.001, 0.05], [Contact([0.6, 0.8], law, 0.002)], [load])
    run, by_stages = (
        integrate(system, [0.0, 0.0], [0.3, 0.0], 1.5, method=method)
        for method in (Exponential(1e-10), DormandPrince(1e-12))
    )
    assert len(run.contacts) == len(by_stages.contacts) > 3
    assert np.abs(run.end - by_stages.end)[[0, 2]].max() < 3e-9 * np.abs(by_stages.end[[0, 2]]).max()  # 1e-10 measured
    assert run.cost.steps < by_stages.cost.steps / 20


@pytest.mark.parametrize("coupled", ["gyroscopic", "dashpot"])
@pytest.mark.parametrize("depth", [1e-4, 1e-6])
def test_a_touch_by_a_mode_that_a_coupled_one_drives(coupled, depth):
    """A fast mode follows the load, and its rate drives a slow one to 1 + depth of the gap: the contact is found.

    Coupled blocks share the load out as rates of their places, whose part in the signal's slope bends the slow share.
    """
    turn, dashpot = np.array([[0.0, -10.0], [10.0, 0.0]]), np.array([[10.0, -10.0], [-10.0, 10.0]])
    damping, gyroscopic = (np.zeros((2, 2)), turn) if coupled == "gyroscopic" else (dashpot, None)
    load, stiffness = [0.0, 1e6], np.diag([1.0, 1e8])

    def run(contacts, dt=None):
        loads = [(load, fb.SineSweep(1.0, 30.0, 39.0, 1.0))]
        system = System(np.eye(2), damping, stiffness, contacts, loads, gyroscopic=gyroscopic)
        return integrate(system, REST, REST, 1.0, dt, Exponential(1e-8))

    largest = -run([], 2.5e-5).q[:, 0].min()
    assert len(run([Contact([1.0, 0.0], KelvinVoigt(1e4, 0.0), (1.0 - depth) * largest)]).contacts) > 0
