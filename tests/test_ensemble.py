"""Ensembles: the same bits whatever computes them, in whatever order, however often interrupted."""

import multiprocessing
import os
import platform
import shutil
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from problems import ROD
from refusals import refused, refused_by

import fembeam as fb
import solvers
from contacts import Hertz, Hysteretic, law
from fembeam.statistics import Estimate
from fembeam.study import Ensemble, characteristics, ensemble
from fembeam.support import warn

HERE = Path(__file__).parent


def small_model(base=None, stop=None, forces=()):
    """One mode of a cantilever that meets a stop under noise."""
    scene = fb.Scene(
        beam=ROD,
        supports=[fb.Clamped(0.0)],
        stops=[fb.Stop(0.5, law=stop or Hysteretic.achieving(1e8, restitution=0.7))],
        damping=fb.ModalDamping(0.05),
        base=base or fb.BandNoise(1e-4, (0.0, 600.0), seed=3),
        forces=forces,
    )
    return scene.reduce(modes=1)


def peaks(model):
    """A mapping of a number and an array."""
    log = model.simulate(1.0).contacts
    return {"peak": log.peak_force.max(), "entries": log.t_in[:3]}


def slow_peaks(model):
    """The same, slow enough to be killed in the middle; hangs after so many calls when told to."""
    time.sleep(float(os.environ.get("PAUSE", "0.02")))
    os.environ["CALLS"] = str(calls() + 1)  # no variable of this module: it would belong to the checkpoint
    if calls() > int(os.environ.get("HANG_AFTER", "1000")):
        time.sleep(600.0)
    return peaks(model)


def calls():
    """Calls of `slow_peaks` in this process and those it came from."""
    return int(os.environ.get("CALLS", "0"))


def fails_for_some(model):
    """Fail for the seeds 1 and 4."""
    if model.scene.base.seed.entropy in (1, 4):
        raise ArithmeticError("no luck")
    return float(model.scene.base(0.1))


def base_at(model):
    return float(model.scene.base(0.1))


def displaced(model, run):
    return replace(run, model=model).displacement(0.5)


def counted(model, path):
    """Note every call in a file."""
    with open(path, "a") as file:
        file.write("x")
    return base_at(model)


def same(a, b):
    return a.values.keys() == b.values.keys() and all(np.array_equal(a.values[k], b.values[k]) for k in a.values)


@pytest.fixture(scope="module")
def alone():
    return ensemble(small_model(), 12, slow_peaks)


def test_realisations_are_independent_and_the_longer_contains_the_shorter(alone):
    assert len(set(alone.values["peak"])) == 12
    shorter = ensemble(small_model(), 3, peaks)
    assert np.array_equal(shorter.values["entries"], alone.values["entries"][:3])
    assert alone["peak"].value == alone.values["peak"].mean()
    assert alone["peak"].standard_error == pytest.approx(alone.values["peak"].std(ddof=1) / np.sqrt(12))


def test_threads_and_processes_give_the_same_bits(alone):
    with ThreadPoolExecutor(3) as pool:
        assert same(ensemble(small_model(), 12, peaks, pool), alone)
    with ProcessPoolExecutor(2) as pool:
        assert same(ensemble(small_model(), 12, slow_peaks, pool), alone)


def test_statistics_by_threads_are_those_computed_here(tmp_path):
    """Moments, spectra and contacts of long runs, whose noise, motion and sums are computed at the same time."""
    model, quantity = small_model(), partial(characteristics, duration=12.0, dt=2e-3)
    here = ensemble(model, 6, quantity)
    with ThreadPoolExecutor(2) as pool:
        first = ensemble(model, 2, quantity, pool, tmp_path / "kept.npz")
        assert same(ensemble(model, 6, quantity, pool, tmp_path / "kept.npz"), here)
    assert np.array_equal(first.values["δ psd"], here.values["δ psd"][:2])


def telling(model):
    """A number, of which something is to be said."""
    warn("the same words of all realisations")
    return 1.0


def test_processes_warn_where_they_were_asked_once():
    with ProcessPoolExecutor(2) as pool, pytest.warns(UserWarning, match="the same words") as told:
        ensemble(small_model(), 6, telling, pool)
    assert [one.filename for one in told] == [__file__]


def test_a_model_that_was_run_can_be_sent_to_another_process():
    model = small_model(base=fb.Harmonic(1e-4, 200.0))
    here = model.simulate(0.5, 0.1)
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        assert np.array_equal(pool.submit(model.simulate, 0.5, 0.1).result().q, here.q)
        assert np.array_equal(pool.submit(displaced, model, here).result(), here.displacement(0.5))


def test_other_signals_gaps_and_laws_leave_the_rest_of_a_model_as_it_is():
    foot = fb.Spring(0.4, 2e3, foot=fb.Harmonic(1e-4, 90.0))
    held = [fb.Clamped(0.0, motion={"y": fb.Harmonic(1e-4, 70.0)})]
    noise = fb.PointForce(0.3, fb.BandNoise(1.0, (0.0, 300.0), seed=2))
    scene = replace(small_model(forces=[noise]).scene, springs=[foot], supports=held)
    model = scene.reduce(modes=1)
    rows, stop = model.contact_rows, model.scene.stops[0]
    for change, same in (
        ({"base": fb.BandNoise(2e-4, (0.0, 500.0), seed=8)}, True),
        ({"base": None, "forces": [fb.PointForce(0.3, fb.Harmonic(2.0, 50.0))]}, True),
        ({"base": fb.Harmonic(1e-4, 200.0), "forces": []}, True),
        ({"forces": [fb.PointForce(0.35, noise.signal)]}, True),
        ({"springs": [replace(foot, foot=fb.Harmonic(2e-4, 40.0))]}, True),
        ({"supports": [replace(held[0], motion={"y": fb.Harmonic(2e-4, 40.0)})]}, True),
        ({"stops": [replace(stop, law=Hertz(1e6), gap=1e-5)]}, False),
    ):
        scene = replace(model.scene, **change)
        quick, anew = (other.simulate(0.4, 0.01) for other in (model.under(scene), replace(model, scene=scene)))
        assert np.array_equal(quick.q, anew.q)
        assert np.array_equal(quick.contacts.t_in, anew.contacts.t_in)
        assert (model.under(scene).contact_rows is rows) == same


def test_a_model_under_loads_that_come_or_go_is_that_made_anew():
    model = small_model(base=fb.Harmonic(1e-4, 200.0))
    for change in ({"base": None}, {"gravity": 9.81}, {"base": None, "gravity": 9.81}):
        scene = replace(model.scene, **change)
        under, anew = (other.simulate(0.1, 0.01) for other in (model.under(scene), replace(model, scene=scene)))
        np.testing.assert_array_equal(under.q, anew.q)


def test_realisations_take_no_fresh_memory():
    resource = pytest.importorskip("resource")
    if not platform.libc_ver()[0].startswith("glibc"):
        pytest.skip("this is about glibc's allocator")
    model, method = small_model(), solvers.Exponential(1e-6, ledger=False)
    fresh = []
    for _ in range(3):
        before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
        model.simulate(100.0, 2e-3, solver=method)
        fresh.append(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
    if fresh[0] <= 100:  # of 4 kB the node table alone has 500
        pytest.skip("pages are too large to be counted, or were there already")
    assert min(fresh) < 100


def test_the_order_of_the_seeds_is_that_of_the_values():
    a, b = ensemble(small_model(), [5, 6, 7], base_at), ensemble(small_model(), [7, 5, 6], base_at)
    assert np.array_equal(a.values[""][[2, 0, 1]], b.values[""])


def test_noises_of_one_seed_stay_one_realisation():
    def together(model):
        y, f, g = model.scene.base, *(force.signal for force in model.scene.forces)
        return [y(0.3) - f(0.3), y(0.3) - g(0.3)]

    noise = fb.BandNoise(1e-4, (0.0, 600.0), seed=3)
    other = replace(noise, seed=4)
    found = ensemble(small_model(noise, forces=[fb.PointForce(0.5, noise), fb.PointForce(0.3, other)]), 3, together)
    assert np.all(found.values[""][:, 0] == 0.0)
    assert np.all(found.values[""][:, 1] != 0.0)


def test_failures_are_told_with_their_seed_and_the_rest_survives():
    with pytest.warns(UserWarning, match="2 of 6 realisations failed; seed 1: ArithmeticError: no luck"):
        found = ensemble(small_model(), range(6), fails_for_some)
    assert found.seeds == (0, 2, 3, 5)
    assert [failure.seed for failure in found.failures] == [1, 4]
    with pytest.raises(RuntimeError, match="every realisation failed; seed 4: ArithmeticError"):
        ensemble(small_model(), [4], fails_for_some)


def test_resuming_computes_only_what_is_missing(tmp_path):
    path, calls = tmp_path / "kept.npz", tmp_path / "calls"
    quantity = partial(counted, path=str(calls))
    ensemble(small_model(), 3, quantity, checkpoint=path)
    found = ensemble(small_model(), 5, quantity, checkpoint=path)
    assert calls.read_text() == 5 * "x"
    assert same(found, ensemble(small_model(), 5, base_at))
    assert [entry.name for entry in tmp_path.iterdir() if entry not in (path, calls)] == []


def slowly(path):
    return ensemble(small_model(), 12, slow_peaks, checkpoint=path)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no such processes")
def test_killed_and_resumed_is_bit_identical(tmp_path, alone, monkeypatch):
    path = tmp_path / "kept.npz"
    monkeypatch.setenv("HANG_AFTER", str(calls() + 3))
    monkeypatch.setattr("fembeam.study.execution.checkpoint.EVERY", -1.0)
    victim = multiprocessing.get_context("fork").Process(target=slowly, args=(path,))
    victim.start()
    try:
        finished = wait_for(lambda: path.exists() and len(np.load(path)["value peak"]) >= 3 and path)
        assert finished
        os.kill(victim.pid, signal.SIGKILL)
    finally:
        victim.kill()
        victim.join()
    done = len(np.load(path)["value peak"])
    assert done == 3
    monkeypatch.delenv("HANG_AFTER")
    assert same(slowly(path), alone)


def wait_for(condition, seconds=200.0):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if found := condition():
            return found
        time.sleep(0.02)
    return None


def test_two_dask_workers_one_killed(tmp_path, alone, monkeypatch):
    distributed = pytest.importorskip("distributed", reason="the extra 'cluster' is not installed")
    path = tmp_path / "kept.npz"
    monkeypatch.setenv("PAUSE", "0.1")  # some are left when one is killed
    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None, "local_directory": str(tmp_path)}
    with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as client:
        pids = list(client.run(os.getpid).values())
        assert len(set(pids)) == 2
        with ThreadPoolExecutor(1) as side:
            result = side.submit(ensemble, small_model(), 12, slow_peaks, client.get_executor(), path)
            assert wait_for(path.exists)
            os.kill(pids[0], signal.SIGKILL)
            assert same(result.result(300), alone)


def test_mpi_gives_the_same_bits(tmp_path, alone):
    pytest.importorskip("mpi4py.futures", reason="mpi4py is not installed")
    mpiexec = shutil.which("mpiexec", path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    if mpiexec is None:
        pytest.skip("no mpiexec")
    path, script = tmp_path / "kept.npz", tmp_path / "by_mpi.py"
    script.write_text(
        "import mpi4py.futures, test_ensemble as t\n"
        "with mpi4py.futures.MPIPoolExecutor() as pool:\n"
        f"    t.ensemble(t.small_model(), 12, t.slow_peaks, pool, {str(path)!r})\n"
    )
    command = [mpiexec, "-n", "3", sys.executable, "-m", "mpi4py.futures", str(script)]
    places = os.pathsep.join([str(HERE), os.environ.get("PYTHONPATH", "")])
    subprocess.run(command, env={**os.environ, "PYTHONPATH": places}, check=True, timeout=300)
    assert len(np.load(path)["value peak"]) == 12
    assert same(ensemble(small_model(), 12, slow_peaks, checkpoint=path), alone)


def test_a_broken_pool_is_told_and_resumed(tmp_path, alone, monkeypatch):
    path = tmp_path / "kept.npz"
    monkeypatch.setenv("HANG_AFTER", str(calls() + 3))  # workers are forked from here
    with ProcessPoolExecutor(1) as pool:
        pid = pool.submit(os.getpid).result()
        with ThreadPoolExecutor(1) as side:
            result = side.submit(ensemble, small_model(), 12, slow_peaks, pool, path)
            assert wait_for(path.exists)
            os.kill(pid, signal.SIGKILL)
            with pytest.raises(RuntimeError, match=r"executor failed with \d+ realisations .*call again to go on"):
                result.result(300)
    monkeypatch.delenv("HANG_AFTER")
    assert same(ensemble(small_model(), 12, slow_peaks, checkpoint=path), alone)


def test_an_executor_that_is_gone():
    pool = ThreadPoolExecutor(1)
    pool.shutdown()
    with pytest.raises(RuntimeError, match="the executor failed with 0 realisations finished"):
        ensemble(small_model(), 2, base_at, pool)


def test_until_stops_at_the_same_place_everywhere():
    wanted = ensemble(small_model(), 64, base_at, until=0.9)
    first = [n for n in (8, 16, 32, 64) if ensemble(small_model(), n, base_at).mean.relative <= 0.9]
    assert wanted.enough
    assert len(wanted) == first[0]
    with ThreadPoolExecutor(4) as pool:
        assert same(ensemble(small_model(), 64, base_at, pool, until=0.9), wanted)
    assert ensemble(small_model(), 8, base_at, until=1e-9).enough is False


def test_characteristics_are_a_quantity():
    scene = small_model().scene
    scene = replace(scene, stops=[*scene.stops, fb.Stop(0.5, Hertz(1e8), gap=1.0, side="above", name="far")])
    found = ensemble(scene.reduce(modes=1), 2, partial(characteristics, duration=10.0, dt=2e-3))
    assert found["δ 0 psd"].value.shape == found.values["omega"].shape[1:]
    assert found["stop 0 rate"].value > 1.0
    assert (found["far rate"].value, len(found.failures)) == (0.0, 0)
    assert np.isnan(found["far peak_force"].value)  # of no contact
    assert found.plain()["numbers"]["stop 0 peak_force"]["mean"] > 0.0


def at_times(model):
    """A number that one realisation in two has."""
    seed = model.scene.base.seed.spawn_key[0]
    return {"sometimes": float(seed) if seed % 2 else None, "never": None, "always": 2.0}


def test_numbers_that_some_realisations_lack():
    found = ensemble(small_model(), 32, at_times, until=0.3)
    assert (len(found), found.enough) == (16, True)  # 1, 3, … 15: 8 ± 1.73; of 1, 3, 5, 7 it is 4 ± 1.29
    assert (found["sometimes"].value, found["sometimes"].batches) == (8.0, 8)
    assert np.isnan(found["never"].value)


def test_complex_values_keep_their_imaginary_part():
    """Of the parts' means and errors: the squares of the errors add up."""
    values = np.array([1.0 + 2.0j, 2.0 - 1.0j, 4.0 + 0.5j])
    found, parts = Ensemble((1, 2, 3), {"": values}).mean, [Estimate.of_mean(one) for one in (values.real, values.imag)]
    assert found.value == pytest.approx(parts[0].value + 1j * parts[1].value)
    assert found.standard_error == pytest.approx(np.hypot(*(one.standard_error for one in parts)))
    assert Estimate.joint(lambda x: 2.0 * x, found).standard_error == pytest.approx(2.0 * found.standard_error)
    assert repr(found) == "2.33333+0.5j ± 1.24"
    with pytest.raises(ValueError, match="an interval must be of real values"):
        found.interval()


def test_values_that_other_realisations_lack_are_not_paired():
    """Of 1, 2 and of 2, 4 by twos: the ratio of what the same two realisations have is 2 without scatter."""
    values = {"a": np.array([1.0, np.nan, 2.0]), "b": np.array([2.0, 4.0, np.nan]), "twice": np.array([2.0, 5.0, 4.0])}
    found = Ensemble((7, 8, 9), values)
    with pytest.raises(ValueError, match="must have the same parts in one order, but some lack 8, 9; make each"):
        Estimate.joint(np.divide, found["b"], found["a"])
    other = Ensemble((7, 9), {"twice": values["twice"][[0, 2]]})
    ratio = Estimate.joint(np.divide, other["twice"], found["a"])
    assert (ratio.value, ratio.standard_error) == (2.0, 0.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda: small_model(stop=Hertz(1e8)), r"stops\[0\].law is .* there and .*Hertz"),
        (lambda: small_model(fb.BandNoise(2e-4, (0.0, 600.0))), "base.std is 0.0001 there and 0.0002 here"),
        (lambda: small_model(fb.BandNoise.of_psd(lambda w: 1e-11 + 0 * w, (0.0, 600.0))), "base is"),
        (lambda: replace(small_model(), modes=(1,)), r"modes\[0\] is 0 there and 1 here"),
    ],
)
def test_a_checkpoint_of_another_study_is_refused(tmp_path, change, message):
    path = tmp_path / "kept.npz"
    ensemble(small_model(), 1, base_at, checkpoint=path)
    with pytest.raises(ValueError, match=f"belongs to another study: {message}"):
        ensemble(change(), 1, base_at, checkpoint=path)
    with pytest.raises(ValueError, match=r"quantity is test_ensemble\.base_at .* and test_ensemble\.peaks"):
        ensemble(small_model(), 1, peaks, checkpoint=path)


def edited(text, name="quantity", **names):
    """The function of that name in a piece of code."""
    space = {"__name__": "study", **names}
    exec(text, space)
    return space[name]


LAW = "def stop(delta, delta_dot, entry_rate):\n    return {} * delta**1.5"
GLOBAL = "def quantity(model): return scale * float(model.scene.base(0.1))"
CLOSURE = "def of(scale): return lambda model: scale * float(model.scene.base(0.1))"


@pytest.mark.parametrize(
    ("one", "other", "what"),
    [
        (lambda: (edited(GLOBAL, scale=1.0), None), lambda: (edited(GLOBAL, scale=2.0), None), "quantity study.*"),
        (lambda: (edited(CLOSURE, "of")(1.0), None), lambda: (edited(CLOSURE, "of")(2.0), None), "quantity study.*"),
        (
            lambda: (base_at, law(edited(LAW.format(1e8), "stop"))()),
            lambda: (base_at, law(edited(LAW.format(2e8), "stop"))()),
            "stops .*",
        ),
    ],
)
def test_a_checkpoint_knows_the_code_it_belongs_to(tmp_path, one, other, what):
    path = tmp_path / "kept.npz"
    for _ in range(2):
        quantity, contact = one()
        ensemble(small_model(stop=contact), 1, quantity, checkpoint=path)
    quantity, contact = other()
    with pytest.raises(ValueError, match=f"belongs to another study: {what} has other code, or reads other values"):
        ensemble(small_model(stop=contact), 1, quantity, checkpoint=path)


def test_a_checkpoint_knows_which_noises_are_one(tmp_path):
    def with_force(base, force):
        noise = fb.BandNoise(1e-4, (0.0, 600.0), seed=base)
        return small_model(noise, forces=[fb.PointForce(0.5, replace(noise, seed=force))])

    path = tmp_path / "kept.npz"
    ensemble(with_force(3, 3), 1, base_at, checkpoint=path)
    ensemble(with_force(5, 5), [9], base_at, checkpoint=path)  # their seeds are those of the values
    with pytest.raises(ValueError, match=r"belongs to another study: forces\[0\].signal.seed is 0 there and 1 here"):
        ensemble(with_force(3, 4), 1, base_at, checkpoint=path)


def test_a_checkpoint_of_another_version(tmp_path, monkeypatch):
    path = tmp_path / "kept.npz"
    ensemble(small_model(), 1, base_at, checkpoint=path)
    monkeypatch.setattr(fb, "__version__", "0.0")
    with pytest.raises(ValueError, match=r"fembeam is .* there and 0\.0 here"):
        ensemble(small_model(), 1, base_at, checkpoint=path)


def test_a_quantity_that_cannot_be_told_from_another_has_no_checkpoint(tmp_path):
    lock = threading.Lock()
    ensemble(small_model(), 1, lambda model: float(lock.locked()))
    with pytest.raises(ValueError, match=r"the quantity → lock is a _thread.lock, which cannot be told from"):
        ensemble(small_model(), 1, lambda model: float(lock.locked()), checkpoint=tmp_path / "kept.npz")


def test_a_damaged_checkpoint(tmp_path):
    path = tmp_path / "kept.npz"
    path.write_bytes(b"PK not really")
    with pytest.raises(ValueError, match="not a checkpoint, or is damaged"):
        ensemble(small_model(), 1, base_at, checkpoint=path)


def first_and_last(model):
    return {"first": base_at(model), "last": -base_at(model)}


def test_a_checkpoint_that_has_lost_values(tmp_path):
    """One changed byte in the list of an npz hides a member: the ensemble had one value less and said nothing."""
    path = tmp_path / "kept.npz"
    ensemble(small_model(), 1, first_and_last, checkpoint=path)
    with np.load(path) as data:
        np.savez(path, **{name: data[name] for name in data.files if name != "value last"})
    with pytest.raises(ValueError, match="is damaged: it has lost last; delete it"):
        ensemble(small_model(), 1, first_and_last, checkpoint=path)


test_bad_seeds = refused_by(
    lambda seeds: ensemble(small_model(), seeds, base_at),
    ([1, 2, 1], "seeds must differ, got 1 at 0 and at 2"),
    (0, "at least 1"),
    ([], "must not be empty"),
    ([-1], "a seed must be"),
    ([1.5], "a seed must be"),
    ("many", "a number of at least 1 or a list"),
    (True, "a number of at least 1 or a list"),
)


test_bad_input = refused(
    (lambda: ensemble(small_model().scene, 2, base_at), r"a Model, got Scene.* scene.reduce\(modes=…\) makes one"),
    (lambda: ensemble(small_model(), 2, "peak_force"), "quantity must be a function of a model, got 'peak_force'"),
    (lambda: Estimate.of_mean(3.0), "values must be several, got 3"),
    (lambda: Estimate.joint(np.divide, Estimate.of_mean([1.0, 2.0]), 2.0), r"must be of Estimate, got \[2.0\]"),
    (lambda: ensemble(small_model(fb.Harmonic(1e-3, 100.0)), 2, base_at), "needs a BandNoise"),
    (lambda: ensemble(small_model(), 2, base_at, until=0.0), "until must be"),
    (lambda: ensemble(small_model(), 2, base_at, checkpoint="nowhere/kept.npz"), r"folder .* does not exist"),
    (lambda: ensemble(small_model(), 2, partial(next, iter([np.ones(2), np.ones(3)]))), r"one form; .* gave .*\(3,\)"),
    (lambda: ensemble(small_model(), 2, lambda model: {"x": np.nan}), "the quantity 'x' is nan", RuntimeError),
    (lambda: ensemble(small_model(), 2, lambda model: "much"), "number or an array of numbers, got str", RuntimeError),
)


def stopped(model):
    """What a run gives that Ctrl-C ends: a user's quantity sees nothing of it."""
    stop = lambda t: signal.raise_signal(signal.SIGINT)  # noqa: E731
    start = np.zeros(len(model.omega))
    return float(solvers.integrate(model.for_duration(1e3).system, start, start, 1e3, progress=stop).t[-1])


def test_ctrl_c_in_a_run_of_the_quantity_ends_the_ensemble(tmp_path):
    """The run ends there with what it has, which is no value of the quantity."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it
    try:
        with pytest.raises(KeyboardInterrupt):
            ensemble(small_model(), 2, stopped, checkpoint=tmp_path / "kept.npz")
        assert list(tmp_path.iterdir()) == []
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
