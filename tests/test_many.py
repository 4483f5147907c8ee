"""Many starts at once are what each is alone; basins of attraction are those known otherwise."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from problems import TIP, coupled_dashpot, paper_scene, two_sided_scene
from refusals import refused_by

import fembeam as fb
import solvers
from contacts import Hertz, Hysteretic, KelvinVoigt, PiecewiseLinear, law
from fembeam import cli
from fembeam.study.basins import _Known, _labels, _settled, axis_of, starts_of
from solvers import Contact, Exponential, Friction, SolverError, Status, System, integrate, integrate_many
from solvers.exponential import many_starts
from solvers.exponential.energy import check
from solvers.many import _shared_out

LAWS = Hysteretic.lankarani_nikravesh(1e7, 0.6), PiecewiseLinear([1e5, 4e5], [2e-4]), KelvinVoigt(3e5, 20.0), Hertz(2e7)


class Wobble:
    """A load that is sampled: it has neither tones nor nodes."""

    def __call__(self, t):
        return 40.0 * np.sin(30.0 * np.asarray(t)) / (1.0 + np.asarray(t))


def random_system(rng, stops):
    """Two to four modes against stops on both sides, under a tone and, now and then, a sampled load."""
    n = int(rng.integers(2, 5))
    contacts = [
        Contact(rng.normal(size=n), LAWS[rng.integers(len(LAWS))], float(rng.uniform(-1e-4, 1e-3)))
        for _ in range(stops)
    ]
    loads = [(rng.normal(size=n), fb.Harmonic(float(rng.uniform(5.0, 50.0)), float(rng.uniform(20.0, 200.0))))]
    loads += [(rng.normal(size=n), Wobble())] * int(rng.integers(2))
    return System.modal(np.sort(rng.uniform(20.0, 900.0, n)), rng.uniform(0.005, 0.1, n), contacts, loads)


def alone(system, q, q_dot, duration, method):
    """Each start by itself, as `ManySolutions` has it."""
    for start in zip(q, q_dot, strict=True):
        run = integrate(system, *start, duration, method=method, check=False)
        log, stops = run.contacts, range(len(system.contacts))
        peaks = [[p[log.stop == s].max(initial=0.0) for s in stops] for p in (log.peak_indentation, log.peak_force)]
        yield run.q[-1], run.q_dot[-1], run.t[-1], run.status, len(log), *peaks


def assert_same(found, runs):
    """Bit for bit."""
    names = "q", "q_dot", "t", "status", "contacts", "peak_indentation", "peak_force"
    for name, wanted in zip(names, zip(*runs, strict=True), strict=True):
        np.testing.assert_array_equal(getattr(found, name), np.array(wanted), err_msg=name)


@pytest.mark.parametrize("stops", [0, 1, 2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_every_start_ends_as_alone_bit_for_bit(stops, seed):
    rng = np.random.default_rng([seed, stops])
    system, method = random_system(rng, stops), Exponential(10.0 ** -rng.uniform(4.0, 10.0))
    q, q_dot = 1e-3 * rng.normal(size=(7, system.size)), rng.normal(size=(7, system.size))
    before = q.copy(), q_dot.copy()
    found = integrate_many(system, q, q_dot, 0.4, method, threads=seed % 3 + 1, check=False)
    assert_same(found, alone(system, q, q_dot, 0.4, method))
    assert stops == 0 or found.contacts.sum() > 0
    np.testing.assert_array_equal(before, (q, q_dot))


def test_a_sampled_run_before_leaves_no_trace():
    """Runs share working memory: they ended at its samples, took some hundred times as long, and differed by 1e-15."""
    system, q, q_dot = System.modal([3.0, 7.0, 11.0], 0.01), [[1.0, 0.3, 0.2]], [[0.1, 0.2, 0.5]]
    end = integrate(system, q[0], q_dot[0], 5.0)
    integrate(system, q[0], q_dot[0], 5.0, dt=0.1)
    found = integrate_many(system, q, q_dot, 5.0)
    np.testing.assert_array_equal(found.q, end.q)
    np.testing.assert_array_equal(found.q_dot, end.q_dot)


def test_coupled_damping_and_a_contact_under_way_at_the_end():
    system = coupled_dashpot([Contact([0.0, 0.0, 1.0], Hertz(1e6), -1e-3)], [(np.ones(3), fb.Harmonic(3.0, 40.0))])
    q, q_dot = np.zeros((5, 3)), np.linspace(-0.1, 0.1, 15).reshape(5, 3)
    found = integrate_many(system, q, q_dot, 0.31)
    assert_same(found, alone(system, q, q_dot, 0.31, None))
    assert found.contacts.min() >= 1  # pressed on, some contact lasts to the end of each run or ended before


def test_long_runs_with_more_contacts_than_the_log_holds_and_more_steps_than_one_call_takes():
    """A mass between two elastic stops 2 mm apart at 1 m/s: some 500 impacts a second, less a few."""
    stops = [Contact([1.0], Hertz(1e9), 1e-3), Contact([-1.0], Hertz(1e9), 1e-3)]
    system = System([[1.0]], [[0.0]], [[0.0]], stops)
    q, q_dot = np.zeros((3, 1)), np.array([[1.0], [-0.9], [1.1]])
    found = integrate_many(system, q, q_dot, 10.0)
    assert_same(found, alone(system, q, q_dot, 10.0, None))
    assert found.contacts.min() > 2000
    # energy: K δ^{5/2} 2/5 = v²/2
    np.testing.assert_allclose(found.peak_indentation, np.repeat((1.25e-9 * q_dot**2) ** 0.4, 2, axis=1), rtol=1e-5)


def with_factor(signal, factor):
    """A tone times r e^{iφ}."""
    return replace(signal, amplitude=signal.amplitude * abs(factor), phase=signal.phase + np.angle(factor))


@pytest.mark.parametrize("stops", [1, 3])
def test_runs_over_gaps_amplitudes_and_phases_are_those_of_systems_of_their_own(stops):
    rng, k = np.random.default_rng([3, stops]), 12
    contacts = [Contact(rng.normal(size=3), law, 1e-4) for law in LAWS[:stops]]
    loads = [(rng.normal(size=3), fb.Harmonic(float(rng.uniform(5.0, 50.0)), omega)) for omega in (40.0, 170.0)]
    system = System.modal([30.0, 200.0, 700.0], [0.02, 0.01, 0.03], contacts, [*loads, (rng.normal(size=3), Wobble())])
    q, q_dot = 1e-4 * rng.normal(size=(k, 3)), 0.1 * rng.normal(size=(k, 3))
    gaps, turn = rng.uniform(-1e-4, 1e-3, (k, stops)), np.exp(2j * np.pi * rng.uniform(size=(k, 2)))
    factors = np.hstack((rng.uniform(0.0, 4.0, (k, 2)) * turn, np.ones((k, 1))))
    moved, scaled = (integrate_many(system, q, q_dot, 0.2, gaps=gaps, factors=by, threads=2) for by in (None, factors))
    for i in range(k):
        own = system.like([replace(c, gap=gap) for c, gap in zip(contacts, gaps[i].tolist(), strict=True)])
        run = integrate(own, q[i], q_dot[i], 0.2)
        np.testing.assert_array_equal(moved.q[i], run.q[-1])  # the same tables
        turned = [(vector, with_factor(signal, by)) for (vector, signal), by in zip(loads, factors[i], strict=False)]
        run = integrate(own.like(loads=[*turned, system.loads[2]]), q[i], q_dot[i], 0.2)
        assert scaled.contacts[i] == len(run.contacts)
        np.testing.assert_allclose(scaled.q_dot[i], run.q_dot[-1], atol=1e-7 * np.abs(scaled.q_dot).max())
    assert min(scaled.contacts.sum(), moved.contacts.sum()) > 2 * k
    assert [contact.gap for contact in system.contacts] == [1e-4] * stops


WOBBLING = System.modal([30.0], [0.02], [Contact([1.0], Hertz(1e6), 1e-3)], [([1.0], Wobble())])

test_what_gaps_and_factors_may_not_be_is_said_before_computing = refused_by(
    lambda options: integrate_many(WOBBLING, np.zeros((2, 1)), np.zeros((2, 1)), 0.1, **options),
    ({"gaps": [1e-3, 2e-3]}, r"gaps must have shape \(2, 1\), that of each contact .* got \(2,\)"),
    ({"gaps": [[1e-3], [math.nan]]}, "gaps must be finite, got nan in run 1, column 0"),
    ({"factors": [[1.0], [2.0]]}, "load 0 is sampled or at resonance, so its factor must be 1, got .* in run 1"),
    ({"factors": [1.0]}, r"factors must have shape \(2, 1\)"),
)


def test_results_do_not_depend_on_threads_order_or_company():
    system = paper_scene().reduce(2).system
    rng = np.random.default_rng(5)
    q, q_dot, order = 1e-4 * rng.normal(size=(300, 2)), 0.1 * rng.normal(size=(300, 2)), rng.permutation(300)
    first = integrate_many(system, q, q_dot, 0.2)
    for threads in (2, 3, 5):
        np.testing.assert_array_equal(integrate_many(system, q, q_dot, 0.2, threads=threads).q, first.q)
    np.testing.assert_array_equal(integrate_many(system, q[order], q_dot[order], 0.2, threads=2).q, first.q[order])
    np.testing.assert_array_equal(integrate_many(system, q[7:8], q_dot[7:8], 0.2).q_dot, first.q_dot[7:8])
    assert "300 runs" in repr(first)
    assert "300 finished" in repr(first)


@law
def broken(delta, delta_dot, entry_rate, limit):
    """A linear force that is not a number beyond a limit."""
    return 1e6 * delta if delta < limit else math.nan


@pytest.mark.parametrize(("count", "threads"), [(1, 1), (5, 3), (300, 1), (1200, 2), (160_000, 7)])
def test_threads_end_together_with_short_groups(count, threads):
    """What one thread may still have to do when the others find nothing left is the last groups only."""
    groups = _shared_out(count, threads)
    assert [i for first, beyond in groups for i in range(first, beyond)] == list(range(count))
    for i, (first, beyond) in enumerate(groups):
        assert beyond - first <= max(1, math.ceil((count - first) / (2 * threads)))
        assert i == 0 or beyond - first <= np.diff(groups[i - 1])


def test_a_run_that_fails_is_named_and_keeps_the_others():
    system = System([[1.0]], [[0.0]], [[0.0]], [Contact([1.0], broken(limit=2e-3), 1e-3)])
    q, q_dot = np.zeros((4, 1)), np.array([[-0.5], [-0.1], [-9.0], [-8.0]])
    found = integrate_many(system, q, q_dot, 0.1, check=False)
    assert_same(found, alone(system, q, q_dot, 0.1, None))
    assert [s is Status.DONE for s in found.status] == [True, True, False, False]
    with pytest.raises(SolverError, match=r"^start 2 stopped at t = .* \(2 of 4 starts failed\)") as error:
        integrate_many(system, q, q_dot, 0.1)
    assert len(error.value.solution) == 4


def test_forces_that_pull_give_no_bound_of_the_energy():
    """A mass at rest deep in a hysteretic stop, which pulls as it leaves: refused once, though its balance closes."""
    model = paper_scene(fb.Harmonic(1e-3, 430.0)).reduce(1)
    q = np.array([[-0.017], [-0.0165], [0.01]]) / model.phi(TIP)
    q_dot = np.full((3, 1), -0.0451) / model.phi(TIP)
    found = integrate_many(model.system, q, q_dot, 0.3653)
    assert_same(found, alone(model.system, q, q_dot, 0.3653, None))
    energy = integrate(model.system, q[0], q_dot[0], 0.3653, 0.3653 / 64).energy
    assert np.abs(energy.residual).max() < 1e-7 * energy.stored.max()


@pytest.mark.parametrize("threads", [1, 2])
def test_after_an_interrupt_finished_starts_are_kept(threads):
    system = paper_scene().reduce(2).system
    q, q_dot = np.zeros((3000, 2)), np.linspace(0.0, 0.2, 6000).reshape(3000, 2)
    seen = []

    def stop(finished):
        seen.append(finished)
        if len(seen) == 1:
            raise KeyboardInterrupt

    found = integrate_many(system, q, q_dot, 1.0, threads=threads, progress=stop)
    left = found.status == Status.INTERRUPTED
    np.testing.assert_array_equal(np.isnan(found.q).any(axis=1), left)
    assert seen[-1] <= (~left).sum()
    assert threads > 1 or 0 < left.sum() < 3000
    done = np.flatnonzero(~left)[:3]
    assert_same(integrate_many(system, q[done], q_dot[done], 1.0), alone(system, q[done], q_dot[done], 1.0, None))
    np.testing.assert_array_equal(found.q[done], integrate_many(system, q[done], q_dot[done], 1.0).q)


def test_errors_of_the_caller_come_through_and_progress_counts():
    system = paper_scene().reduce(1).system
    seen = []
    integrate_many(system, np.zeros((500, 1)), np.zeros((500, 1)), 0.05, threads=2, progress=seen.append)
    assert seen[-1] == 500
    assert seen == sorted(seen)
    for threads in (1, 2):
        with pytest.raises(ZeroDivisionError):
            integrate_many(system, np.zeros((50, 1)), np.zeros((50, 1)), 0.05, None, threads, lambda done: 1 // 0)


GOOD = {"q0": np.zeros((3, 2)), "q_dot0": np.zeros((3, 2)), "duration": 0.1}
test_bad_input = refused_by(
    lambda change: integrate_many(paper_scene().reduce(2).system, **(GOOD | change)),
    ({"q0": np.zeros(2)}, r"q0 must have shape \(k, 2\), a start in each of k > 0 rows, got \(2,\)"),
    ({"q0": np.zeros((0, 2))}, r"q0 must have shape"),
    ({"q_dot0": np.zeros((3, 3))}, r"q_dot0 must have shape \(k, 2\)"),
    ({"q_dot0": np.zeros((4, 2))}, "as many rows, got 3 and 4"),
    ({"q_dot0": [[0, 0], [0, math.nan], [0, 0]]}, "q_dot0 must be finite, got nan at start 1, coordinate 1"),
    ({"duration": 0.0}, "duration must be positive"),
    ({"threads": 0}, "threads must be a whole number above 0, got 0"),
    ({"threads": True}, "threads must be"),
    ({"method": solvers.DormandPrince()}, "offers Exponential only, got DormandPrince.*; call integrate"),
    error=(ValueError, TypeError),
)


# --- basins of attraction --------------------------------------------------------------------------------

BOTH = paper_scene(fb.Harmonic(1e-3, 330.0)).reduce(1)  # two orbits of period 2, with 2 and 3 impacts
PLANE = {"x_span": (0.0, 0.04), "y_span": (-6.0, 6.0)}


@pytest.fixture(scope="module")
def map_of_both():
    return fb.study.basins(BOTH, **PLANE, points=(40, 30))


def interior(label):
    """(row, column) of starts all whose neighbours, two steps around, come to the same orbit."""
    views = np.lib.stride_tricks.sliding_window_view(label, (5, 5)).reshape(-1, 25)
    same = (views == views[:, :1]).all(axis=1) & (views[:, 0] >= 0)
    rows, columns = np.divmod(np.flatnonzero(same), label.shape[1] - 4)
    return rows + 2, columns + 2


def test_a_linear_beam_has_one_basin():
    scene = replace(paper_scene(), stops=[])
    found = fb.study.basins(scene.reduce(2), points=(5, 4), threads=2)
    assert found.label.tolist() == [[0] * 5] * 4
    assert found.shares.tolist() == [1.0]
    assert str(found).splitlines()[-1].split() == ["period", "1", "with", "0", "impacts", "20", "100.00%"]


def test_a_start_whose_run_fails_is_marked_and_the_others_are_settled():
    """Forces of the far starts overflow: they are marked wherever they lie, on the coarse grid too."""
    scene = replace(paper_scene(), stops=[fb.Stop(0.2, Hertz(1e9, exponent=3.0), gap=1.0)])
    found = fb.study.basins(scene.reduce(1), x_span=(-1e110, 0.0), y_span=(0.0, 1.0), points=(2, 3))
    assert found.label[:, 0].tolist() == [-2] * 3
    assert (found.label[:, 1] >= 0).all()


def test_starts_settled_one_by_one_come_to_what_the_map_says(map_of_both):
    """Well inside of a basin, where rounding does not decide."""
    assert {one.name for one in map_of_both.attractors} == {"period 2 with 2 impacts", "period 2 with 3 impacts"}
    rows, columns = interior(map_of_both.label)
    starts = starts_of(map_of_both.origin, map_of_both.x, map_of_both.y)
    for row, column in np.random.default_rng(1).permutation(np.transpose((rows, columns)))[:12]:
        (alone,) = BOTH.attractors(starts=[starts[row, column]])
        assert alone.name == map_of_both.attractors[map_of_both.label[row, column]].name
    assert len(rows) > 40


def test_basins_are_invariant(map_of_both):
    """After a period of the load a start is still in its basin."""
    rows, columns = interior(map_of_both.label)
    starts = starts_of(map_of_both.origin, map_of_both.x, map_of_both.y)[rows, columns]
    once = 2.0 * math.pi / 330.0
    moved = integrate_many(BOTH.system, starts[:, :1], starts[:, 1:], once)
    images = np.hstack((moved.q, moved.q_dot))
    free = np.array([-one[:1] @ BOTH.directions[0] for one in images]).reshape(-1) < 0.0  # in contact it would forget
    known = [_Known.of(one.orbit, once) for one in map_of_both.attractors]
    ends = _settled(BOTH, images[None, free], known, 200, once, 1, 0)
    wanted = map_of_both.label[rows, columns][free]
    # of 65 none is in another basin here; elsewhere rounding may decide for one near an edge between grid points
    assert np.sum(_labels(ends, known) != wanted) <= 3


def test_starts_on_an_orbit_belong_to_it(map_of_both):
    for one in map_of_both.attractors:
        tiny = {"x_span": (-1e-6, 1e-6), "y_span": (-1e-5, 1e-5)}
        found = fb.study.basins(BOTH, **tiny, points=3, start=one.state)
        assert [(a.name, a.count) for a in found.attractors] == [(one.name, 9)]


def gapped(phase, omega=330.0, gap=2e-3):
    """One mode between equal stops, which the steady motion without them does not reach."""
    scene = two_sided_scene(gap)
    return replace(scene, base=fb.Harmonic(1e-3, omega, phase)).reduce(1)


def free_motion(model, starts, gap):
    """Whether the linear response from each start stays within the gap, by its closed form."""
    (omega,), (zeta,), base = model.omega, model.zeta, model.scene.base
    t = np.arange(0.0, 2.0, 2e-4)  # then the transient is below 2 %
    load = model.participation[0] * base.amplitude * base.omega**2 * np.exp(1j * base.phase)
    steady = load / (omega**2 - base.omega**2 + 2j * zeta * omega * base.omega)
    rate = -zeta * omega + 1j * omega * math.sqrt(1.0 - zeta**2)
    q, v = starts[:, 0] - steady.real, starts[:, 1] - (1j * base.omega * steady).real
    turning = q + 1j * (zeta * omega * q - v) / rate.imag
    u = np.real(steady * np.exp(1j * base.omega * t)) + np.real(turning[:, None] * np.exp(rate * t))
    return np.abs(model.phi(TIP)[0] * u).max(axis=1) < 0.99 * gap


def test_a_slow_transient_does_not_make_an_orbit_longer():
    """At 80 rad/s three periods of the load are nearly four of the beam's: the transient repeats after 3."""
    found = gapped(0.3, omega=80.0).attractors(starts=3)
    assert [one.name for one in found] == ["period 1 with 0 impacts"]


def test_starts_that_never_touch_a_stop_come_to_the_linear_motion():
    model = gapped(0.3)
    found = fb.study.basins(model, x_span=(-2e-3, 2e-3), y_span=(-0.4, 0.4), points=14, threads=2)
    starts = starts_of(found.origin, found.x, found.y).reshape(-1, 2)
    linear = [i for i, one in enumerate(found.attractors) if one.name == "period 1 with 0 impacts"]
    known = free_motion(model, starts, 2e-3)
    assert known.sum() > 3
    assert len(linear) == 1
    assert len(found.attractors) > 1
    assert (found.label.ravel()[known] == linear[0]).all()


def test_resumed_rows_are_not_computed_again(tmp_path, monkeypatch, map_of_both):
    path, calls, real = tmp_path / "kept.npz", [], solvers.integrate_many

    def counted(*arguments, **options):
        calls.append(1)
        if len(calls) > 20:
            raise KeyboardInterrupt
        return real(*arguments, **options)

    monkeypatch.setattr(solvers, "integrate_many", counted)
    with pytest.raises(KeyboardInterrupt):
        fb.study.basins(BOTH, **PLANE, points=(40, 30), checkpoint=path)
    assert path.exists()
    monkeypatch.setattr(solvers, "integrate_many", real)
    found = fb.study.basins(BOTH, **PLANE, points=(40, 30), checkpoint=path)
    np.testing.assert_array_equal(found.label, map_of_both.label)
    monkeypatch.setattr(solvers, "integrate_many", None)  # nothing is left to do
    np.testing.assert_array_equal(fb.study.basins(BOTH, **PLANE, points=(40, 30), checkpoint=path).label, found.label)
    with pytest.raises(ValueError, match="belongs to another study"):
        fb.study.basins(BOTH, **PLANE, points=(40, 30), checkpoint=path, settle=100)


def test_an_interrupt_within_a_row_is_one(monkeypatch):
    real = solvers.integrate_many

    def interrupted(*arguments, **options):
        done = real(*arguments, **options)
        done.status[-1] = Status.INTERRUPTED
        return done

    monkeypatch.setattr(solvers, "integrate_many", interrupted)
    with pytest.raises(KeyboardInterrupt):
        fb.study.basins(BOTH, **PLANE, points=3)


def test_what_does_not_settle_and_what_fails_is_marked(monkeypatch):
    """At 300 rad/s the motion is chaotic; runs fail where next to no energy is allowed for."""
    model = paper_scene(fb.Harmonic(1e-3, 300.0)).reduce(1)
    found = fb.study.basins(model, x_span=(0.0, 0.01), y_span=(-1.0, 1.0), points=4, settle=50)
    assert (found.label == -1).all()
    assert not found.attractors
    assert str(found).splitlines()[-1].split() == ["not", "settled", "16", "100.00%"]
    for module in (check, many_starts):
        monkeypatch.setattr(module, "FACTOR", 1e-9)
    elastic = replace(paper_scene(fb.Harmonic(1e-3, 430.0)), stops=[fb.Stop(TIP, Hertz(2.1e8))]).reduce(1)
    failed = fb.study.basins(elastic, x_span=(0.0, 0.017), y_span=(-0.0451, 0.0451), points=2, settle=25)
    assert (failed.label == -2).any()
    assert "run failed" in str(failed)
    assert len(failed.figure().legends) == 1


def test_axes_are_what_they_say():
    model = paper_scene().reduce(3)
    pulled = axis_of(model, "displacement", (0.0, 1.0), 2, 0.2).direction
    struck = axis_of(model, "velocity", (0.0, 1.0), 2, 0.2).direction
    assert model.phi(0.2) @ pulled[:3] == pytest.approx(1.0)
    assert not pulled[3:].any()
    assert model.phi(0.2) @ struck[3:] == pytest.approx(1.0)
    assert not struck[:3].any()
    exact = model.equilibrium({0.2: 1e-3})[:3]
    np.testing.assert_allclose(pulled[:3] / pulled[0], exact / exact[0])
    assert axis_of(model, 4, (0.0, 1.0), 2, 0.2).name == "q_dot[1]"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"x": "angle"}, "an axis is not known, got 'angle'"),
        ({"x": 2}, r"number of a state must lie in \[0, 2\)"),
        ({"x": [1.0, 2.0, 3.0]}, "an axis must be 2 finite numbers"),
        ({"y": "displacement"}, "x and y must be two directions"),
        ({"x_span": (1.0, 0.0)}, "a span must be two finite values, ascending"),
        ({"points": 1}, "points must be one or two whole numbers"),
        ({"points": (3, 4, 5)}, "points must be one or two whole numbers"),
        ({"z": 0.0}, "the modes kept do not move at z"),
        ({"start": [0.0]}, "start must be 2 finite numbers"),
        ({"settle": 0}, "settle counts periods of the load"),
        ({"longest": 1.5}, "longest counts periods of the load"),
        ({"threads": 0}, "threads must be"),
    ],
)
def test_bad_basins(change, message):
    with pytest.raises(ValueError, match=message):
        fb.study.basins(BOTH, **({**PLANE, "points": 3} | change))
    with pytest.raises(ValueError, match="needs periodic loads"):
        fb.study.basins(paper_scene(fb.BandNoise(1e-4, (0.0, 100.0), seed=1)).reduce(1), points=2)


def test_the_table_basins(tmp_path, capsys):
    text = (Path(__file__).parent.parent / "examples" / "beam_stop.toml").read_text()
    file = tmp_path / "scene.toml"
    file.write_text(
        text[: text.index("[base]")]
        + '[base]\nkind = "harmonic"\namplitude = 1e-3\nomega = 330.0\n[reduce]\nmodes = 1\n'
        + "[basins]\nx_span = [0.0, 0.04]\ny_span = [-6, 6]\npoints = [6, 4]\n"
    )
    out = tmp_path / "out"
    assert cli.main(["run", str(file), "--out", str(out), "--quiet"]) == 0
    assert "24 starts" not in capsys.readouterr().err
    assert {path.name for path in out.iterdir()} >= {"basins.npz", "basins.json", "basins.png", "basins.txt"}
    assert cli.main(["run", str(file), "--out", str(out), "--quiet"]) != 0  # dear results are not overwritten
    assert cli.main(["run", str(file), "--out", str(out), "--quiet", "--resume"]) == 0


@pytest.mark.parametrize(("clearance", "refused"), [(2e-4, 2), (8e-4, 0)])
def test_friction_beyond_half_a_turn_is_refused_as_in_a_run(clearance, refused):
    """Starts that `integrate` refuses were given as finished; clearances of their own count too."""
    rng, plane = np.random.default_rng(3), np.eye(2)

    def system(c):
        hole = Contact(plane, KelvinVoigt(3e5, 50.0), c, map="annulus", friction=Friction(1.0, 6e3))
        return System(2.0 * plane, 60.0 * plane, 8e4 * plane, [hole])

    q, q_dot = 1e-4 * rng.normal(size=(30, 2)), 2.0 * rng.normal(size=(30, 2))
    found = integrate_many(system(1e-3 - clearance), q, q_dot, 0.1, gaps=np.full((30, 1), clearance), check=False)
    alone = [integrate(system(clearance), *start, 0.1, check=False).status for start in zip(q, q_dot, strict=True)]
    assert list(found.status) == alone
    assert alone.count(Status.OVERDRAWN) == refused
