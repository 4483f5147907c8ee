"""Ctrl-C while a result is made of several runs: none of them is taken for a whole one, and what was found is kept."""

import json
import os
import signal
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from threading import Timer

import numpy as np
import pytest
from problems import ROD, paper_scene

import fembeam as fb
import solvers
from contacts import Hertz, Jenkins, KelvinVoigt, Polynomial
from fembeam.model import branch as of_branch
from fembeam.scene_file import study_tables
from fembeam.study import backbone, bifurcation, ensemble, fold, peak, speed_accuracy, stationary, vary
from fembeam.study.execution import checkpoint as of_checkpoint
from fembeam.study.execution import executors
from fembeam.study.execution.checkpoint import Checkpoint
from fembeam.support import written_beside, written_whole
from solvers.branches.walk import Walk
from solvers.exponential.method import Engine as Engine

SCENE = paper_scene(fb.BandNoise(2.5e-4, (0.0, 1226.6), seed=1), 0.02, Hertz(2.1e8), masses=())
MODEL = SCENE.reduce(modes=2)
DRIVE = {"base": fb.Harmonic(5e-4, 150.0), "damping": fb.ModalDamping(0.1)}  # settles into one orbit, |μ| = 0.6
DRIVEN = replace(SCENE, **DRIVE).reduce(modes=2)
ORBIT = DRIVEN.orbit()


@pytest.fixture
def interrupt(monkeypatch):
    """Make the compiled loop of some later call end in Ctrl-C, as a signal does."""

    def after(calls):
        march, left = Engine.march, [calls]

        def interrupted(self, *arguments):
            left[0] -= 1
            if left[0] == 0:
                raise KeyboardInterrupt
            return march(self, *arguments)

        monkeypatch.setattr(Engine, "march", interrupted)

    return after


def contacts(model, duration=1.0):
    return len(model.simulate(duration, 1e-3).contacts)


def test_a_run_alone_is_partial(interrupt):
    interrupt(1)
    assert MODEL.simulate(1.0, 1e-3).status.startswith("interrupted: partial result")


def test_an_ensemble_keeps_no_partial_realisation(interrupt, tmp_path):
    kept = tmp_path / "kept.npz"
    quantity = partial(contacts, duration=1.0)
    whole = ensemble(MODEL, 4, quantity).values[""]
    interrupt(3)
    with pytest.raises(KeyboardInterrupt):
        ensemble(MODEL, 4, quantity, checkpoint=kept)
    np.testing.assert_array_equal(ensemble(MODEL, 4, quantity, checkpoint=kept).values[""], whole)


@pytest.mark.parametrize(
    "asked",
    [
        lambda: DRIVEN.attractors(3),
        lambda: DRIVEN.orbit(),
        lambda: ORBIT.extremes(0.2),
        lambda: ORBIT.sensitivity("omega"),
        lambda: MODEL.strike(0.1),
        lambda: solvers.lyapunov(DRIVEN.system, np.zeros(2), np.zeros(2), 1.0),
        lambda: vary(SCENE, {"stops[0].gap": [0.0, 1e-3]}, "peak_force", duration=0.2, dt=1e-3, modes=2),
        lambda: executors.spread(contacts, [MODEL]),
    ],
    ids=["attractors", "orbit", "extremes", "sensitivity", "strike", "lyapunov", "vary", "spread"],
)
def test_what_is_made_of_runs_stops(interrupt, asked):
    interrupt(1)
    with pytest.raises(KeyboardInterrupt):
        asked()


def test_an_interrupted_branch_goes_on_as_if_it_had_not_been(interrupt):
    whole = DRIVEN.branch("omega", (145.0, 155.0)).run()
    branch = DRIVEN.branch("omega", (145.0, 155.0))
    for calls in (2, 3, 5, 8, 13):
        interrupt(calls)
        with pytest.raises(KeyboardInterrupt):
            branch.run()
    branch.run()
    np.testing.assert_array_equal(branch.parameter, whole.parameter)
    assert [one.mark for one in branch.orbits] == [one.mark for one in whole.orbits]


def test_a_killed_branch_goes_on_from_its_file_as_if_it_had_not_been(tmp_path, monkeypatch):
    """It was written at Ctrl-C and at the end only, so that SIGKILL lost all of it."""
    path, whole = tmp_path / "branch.npz", DRIVEN.branch("omega", (145.0, 155.0)).run()
    monkeypatch.setattr(of_branch, "EVERY", -1.0)
    save, kept = of_branch.Branch.save, []

    def saved(self, target):
        save(self, target)
        kept.append(path.read_bytes())

    monkeypatch.setattr(of_branch.Branch, "save", saved)
    DRIVEN.branch("omega", (145.0, 155.0)).run(checkpoint=path)
    assert len(kept) == len(whole.orbits) + 2
    for content in kept[:: len(kept) // 3]:
        path.write_bytes(content)
        known, again = DRIVEN.resume(path), DRIVEN.branch("omega", (145.0, 155.0))
        steps = count_of_steps(monkeypatch, partial(again.run, checkpoint=path))
        assert steps + len(known.orbits) <= len(whole.orbits)
        for resumed in (known.run(), again):
            np.testing.assert_array_equal(resumed.parameter, whole.parameter)
            np.testing.assert_array_equal([one.state for one in resumed.orbits], [one.state for one in whole.orbits])
            assert [one.mark for one in resumed.orbits] == [one.mark for one in whole.orbits]


def count_of_steps(monkeypatch, call):
    """How many steps branches take in a call."""
    extend, steps = Walk.extend, []
    with monkeypatch.context() as patched:
        patched.setattr(Walk, "extend", lambda walk: (steps.append(walk), extend(walk)))
        call()
    return len(steps)


OTHER_BRANCHES = {
    "parameter is 'base.omega' there and 'base.amplitude' here; span": {"parameter": "amplitude", "span": (1e-4, 1e-3)},
    r"span\[1\] is 155.0 there and 160.0 here; set it back": {"span": (145.0, 160.0)},
    "step is 0.2 there and 0.1 here": {"step": 0.1},
    "shots is 1 there and 2 here": {"shots": 2},
    "rtol is 1e-11 there and 1e-10 here": {"method": solvers.Exponential(1e-10)},
    "its first orbit, at 150 there and 149 here, is another one": {"at": 149.0},
    "directions is 2 there and 1 here": {"at": 145.0},
}


def test_a_checkpoint_of_another_branch_is_refused_and_stays(tmp_path):
    """It was overwritten, another scene's too, and an unfinished one's by a script that was run again."""
    path, asked = tmp_path / "branch.npz", {"parameter": "omega", "span": (145.0, 155.0), "step": 0.2}
    DRIVEN.branch(**asked).run(checkpoint=path)
    content = path.read_bytes()
    for message, change in OTHER_BRANCHES.items():
        with pytest.raises(ValueError, match=rf"branch\.npz belongs to another branch: .*{message}"):
            DRIVEN.branch(**asked | change).run(checkpoint=path)
    stiffer = replace(SCENE, **DRIVE, stops=[fb.Stop(0.24445, law=Hertz(3e8))]).reduce(modes=2)
    with pytest.raises(ValueError, match="belongs to another scene: stops"):
        stiffer.branch(**asked).run(checkpoint=path)
    with pytest.raises(ValueError, match="belongs to another scene: modes"):
        replace(SCENE, **DRIVE).reduce(modes=1).branch(**asked).run(checkpoint=path)
    assert path.read_bytes() == content
    run = DRIVEN.simulate(0.01, 1e-3).save(tmp_path / "run.npz")
    with pytest.raises(ValueError, match=r"run.npz holds no branch, .* or choose another place"):
        DRIVEN.branch(**asked).run(checkpoint=run)


@pytest.mark.parametrize(
    ("path", "message"),
    [
        (3, "path must be text or a pathlib.Path, got 3 in Branch.run"),
        ("nowhere/branch.npz", "no such folder to write branch.npz to; make it first: 'nowhere'"),
        (".", "a folder is there; give the name of a file: '.'"),
    ],
)
def test_a_branch_that_cannot_be_kept_is_refused_before_it_is_computed(path, message):
    """All of it was computed, and then lost."""
    branch = DRIVEN.branch("omega", (145.0, 155.0))
    with pytest.raises((ValueError, OSError), match=message):
        branch.run(checkpoint=path)
    assert len(branch.orbits) == 1
    if path == 3:
        with pytest.raises(ValueError, match=r"got 3 in Model\.resume"):
            DRIVEN.resume(path)


def test_a_branch_that_fails_is_kept(tmp_path, monkeypatch):
    path, branch = tmp_path / "branch.npz", DRIVEN.branch("omega", (145.0, 155.0))

    def failing():
        yield from list(branch.found.orbits)
        raise solvers.SolverError("diverged", None)

    monkeypatch.setattr(type(branch.found), "__iter__", lambda _: failing())
    with pytest.raises(solvers.SolverError, match="diverged"):
        branch.run(checkpoint=path)
    assert len(DRIVEN.resume(path).orbits) == 1


NOISE = fb.BandNoise(std=3e-4, band=(0.0, 1226.6), seed=3)
TWO_TONES = fb.Multisine([4e-4, 3e-4], [108.0, 171.0], [0.0, 0.4])
TIMES = np.arange(0.0, 30.0, 0.01)
RECORD = fb.Record(TIMES, 20.0 * np.sin(40.0 * TIMES), quantity="acceleration")


@pytest.mark.parametrize(("base", "segments", "every"), [(NOISE, 16, 3), (TWO_TONES, 2, 1), (RECORD, 1, 1)])
def test_a_stationary_response_goes_on_as_if_it_had_not_been_interrupted(base, segments, every, tmp_path, monkeypatch):
    """To the last bit; what was asked of another motion is refused."""
    model = replace(SCENE, base=base, damping=fb.ModalDamping(0.05)).reduce(modes=2)
    asked = {"duration": 25.0, "dt": 2e-3, "segment": 512, "discard": 0.5 if base is RECORD else None}
    whole, path, add, written = stationary(model, **asked), tmp_path / "kept.npz", Checkpoint.add, []

    def stopped(self, *given):
        add(self, *given)
        written.append(given)
        if len(written) % every == 0:
            raise KeyboardInterrupt

    monkeypatch.setattr(Checkpoint, "add", stopped)
    for _ in range(20):
        try:
            found = stationary(model, checkpoint=path, **asked)
            break
        except KeyboardInterrupt:
            continue
    assert len(written) == segments
    numbers = [{name: (*one.interval(), one.value) for name, one in each.numbers().items()} for each in (whole, found)]
    np.testing.assert_equal(numbers[1], numbers[0])
    for name, one in whole.signals.items():
        np.testing.assert_array_equal(found[name].psd.density, one.psd.density)
        np.testing.assert_array_equal(found[name].pdf.density, one.pdf.density)
    assert (found.duration, found.discarded, found.settling) == (whole.duration, whole.discarded, whole.settling)
    with pytest.raises(ValueError, match="belongs to another study: stationary"):
        stationary(model, checkpoint=path, **asked | {"segment": 500})


def pushed(force=1.0, **parts):
    """A rod with one mode, pushed at its tip."""
    load = fb.PointForce(0.5, fb.Harmonic(force, 200.0))
    return fb.Scene(ROD, [fb.Clamped(0.0)], forces=[load], damping=fb.ModalDamping(0.02), **parts).reduce(modes=1)


DAMPED = pushed(elements=[fb.Element(0.5, Jenkins(2e3, 1.0), name="damper")])
SOFT = pushed(1.0, elements=[fb.Element(0.5, Polynomial([0.0, 0.0, 2e7]))])
STRUCK = pushed(stops=[fb.Stop(0.5, KelvinVoigt(1e5, 5.0), gap=1e-4)])
FOLDED = SOFT.branch("omega", (180.0, 230.0), step=0.2).run()
METHODS = [solvers.Exponential(1e-4), solvers.RK4(1e-5)]
CURVES = {
    "peak": partial(peak, DAMPED, over="elements[damper].law.limit", values=[1.4, 1.8], span=(195.0, 235.0)),
    "backbone": partial(backbone, DAMPED, [0.01, 0.1, 0.8], span=(160.0, 280.0)),
    "bifurcation": partial(bifurcation, STRUCK, "omega", [180.0, 200.0, 230.0], settle=10, keep=4),
    "fold": partial(fold, FOLDED, "forces[0].signal.amplitude", span=(0.9, 1.1)),
    "speed_accuracy": partial(speed_accuracy, STRUCK, METHODS, 2, duration=0.05, rounds=1),
}
OTHERS = {"peak": {"span": (180.0, 250.0)}, "backbone": {"span": (150.0, 280.0)}, "fold": {"span": (0.9, 1.2)},
          "speed_accuracy": {"duration": 0.06}, "bifurcation": {"settle": 12}}  # fmt: skip


def all_of(found):
    """What was found, to the last bit, without what a clock tells."""
    if isinstance(found, fb.study.SpeedAccuracy):
        return found.floor, [(one.errors, one.totals, one.law_calls, one.steps) for one in found.points]
    if isinstance(found, fb.study.Bifurcation):
        return found.strobes, found.peaks
    points = getattr(found, "tops", None) or getattr(found, "resonances", None)
    orbits = found.orbits if points is None else [one.orbit for one in points]
    return found.plain(), [(one.found.whole, one.found.monodromy, one.found.doubt, one.parameter) for one in orbits]


def test_two_orbits_of_one_frequency_have_each_its_own_branch(tmp_path):
    path, upper = tmp_path / "branch.npz", FOLDED.orbits[5]
    begun = {"span": (205.0, 210.0), "at": upper.parameter, "step": 0.5}
    SOFT.branch(**begun).run(checkpoint=path)
    with pytest.raises(ValueError, match=r"its first orbit, at 207\.\d+ there and 207\.\d+ here, is another one"):
        SOFT.branch(**begun, start=upper).run(checkpoint=path)
    SOFT.branch(**begun, start=SOFT.branch(**begun).orbits[0].state).run(checkpoint=path)  # the same to rounding


@pytest.mark.parametrize("name", CURVES)
@pytest.mark.parametrize("every", [1, 3])
def test_a_curve_goes_on_as_if_it_had_not_been_interrupted(name, every, tmp_path, monkeypatch):
    """To the last bit, each result computed once; what was asked differently is refused."""
    call, path, add, written = CURVES[name], tmp_path / "kept.npz", Checkpoint.add, []
    whole = call()

    def stopped(self, *given):
        add(self, *given)
        written.append(given[0])
        if len(written) % every == 0:
            raise KeyboardInterrupt

    monkeypatch.setattr(Checkpoint, "add", stopped)
    for _ in range(100):
        try:
            found = call(checkpoint=path)
            break
        except KeyboardInterrupt:
            continue
    assert len({*written}) == len(written)
    np.testing.assert_equal(all_of(found), all_of(whole))
    with pytest.raises(ValueError, match=f"belongs to another study: .*{next(iter(OTHERS[name]))}"):
        call(checkpoint=path, **OTHERS[name])


CALLS = {"peak": 300, "backbone": 240, "bifurcation": 2, "fold": 60, "speed_accuracy": 3}  # of the compiled loop


@pytest.mark.parametrize(("name", "calls"), CALLS.items())
def test_a_curve_stopped_within_a_run_keeps_what_was_found(name, calls, interrupt, tmp_path):
    call, path = CURVES[name], tmp_path / "kept.npz"
    interrupt(calls)
    with pytest.raises(KeyboardInterrupt):
        call(checkpoint=path)
    assert path.exists()
    np.testing.assert_equal(all_of(call(checkpoint=path)), all_of(call()))


def test_what_is_no_checkpoint_need_not_be_deleted(tmp_path):
    """The advice for a folder, and for a run that was saved, was to delete it."""
    with pytest.raises(ValueError, match=r"checkpoint must be the path of a file, got .* in study"):
        CURVES["peak"](checkpoint=tmp_path)
    with pytest.raises(ValueError, match="checkpoint must be the path of a file, got '' in study"):
        CURVES["peak"](checkpoint="")
    run = MODEL.simulate(0.01, 1e-3).save(tmp_path / "run.npz")
    with pytest.raises(ValueError, match=r"run.npz is not a checkpoint, .*; delete it to begin anew, or choose"):
        CURVES["peak"](checkpoint=run)
    kept = tmp_path / "kept.npz"
    Checkpoint(kept).add("0", {"x": np.array(0.0)})
    with pytest.raises(ValueError, match=r"kept.npz is not a saved run, .* it holds header, value x; give a file"):
        fb.load(kept)


@pytest.mark.parametrize("every", [-1.0, 1e9])
def test_values_that_come_fast_are_written_seldom_and_all_of_them_at_the_end(every, interrupt, tmp_path, monkeypatch):
    """Each of 73 answers of a fold was written to the disk at once, which took as long as to find them."""
    monkeypatch.setattr(of_checkpoint, "EVERY", every)
    path, add, put, added, written = tmp_path / "kept.npz", Checkpoint.add, Checkpoint._put, [], []
    monkeypatch.setattr(Checkpoint, "add", lambda *given: (added.append(given), add(*given)))
    monkeypatch.setattr(Checkpoint, "_put", lambda *given: (written.append(given), put(*given)))
    interrupt(60)
    with pytest.raises(KeyboardInterrupt):
        CURVES["fold"](checkpoint=path)
    assert len(added) > 2
    assert len(written) == (2 if every > 0.0 else len(added))
    with np.load(path) as found:
        assert len(json.loads(str(found["header"]))["seeds"]) == len(added)


def test_values_are_kept_as_they_were(tmp_path):
    path, sums = tmp_path / "kept.npz", np.zeros(3)
    with Checkpoint(path) as kept:
        for _ in range(2):
            kept.add("so far", {"sums": sums})
            sums += 1.0  # of a part that is not done
    assert Checkpoint(path).values["so far"]["sums"].tolist() == [1.0, 1.0, 1.0]


def test_two_that_keep_values_in_one_file_keep_all(tmp_path, monkeypatch):
    """The last to write left its own alone; another study's file that has come meanwhile is not overwritten."""
    monkeypatch.setattr(of_checkpoint, "EVERY", -1.0)
    path = tmp_path / "kept.npz"
    a, b = Checkpoint(path), Checkpoint(path)
    for key in range(4):
        (a, b)[key % 2].add(str(key), {"x": np.array(float(key))})
    kept = Checkpoint(path).values
    assert {key: float(one["x"]) for key, one in kept.items()} == {str(key): float(key) for key in range(4)}
    other = Checkpoint(tmp_path / "other.npz", lambda: {"study": "another"})
    os.replace(path, other.path)
    with pytest.raises(ValueError, match="belongs to another study: study"):
        other.add("4", {"x": np.array(4.0)})
    assert len(Checkpoint(other.path).values) == 4


def kept_by(path, first):
    of_checkpoint.EVERY = -1.0
    kept = Checkpoint(path)
    for key in range(first, first + 20):
        kept.add(str(key), {"x": np.array(float(key))})


@pytest.mark.skipif(os.name != "posix", reason="needs locks of files")
def test_processes_that_write_one_checkpoint_at_the_same_time_keep_all(tmp_path):
    path = tmp_path / "kept.npz"
    with ProcessPoolExecutor(3) as pool:
        list(pool.map(partial(kept_by, path), (0, 20, 40)))
    assert {*Checkpoint(path).values} == {*map(str, range(60))}
    assert [one.name for one in tmp_path.iterdir()] == ["kept.npz"]


def test_a_file_that_has_its_name_stays_when_ctrl_c_comes_then(tmp_path, monkeypatch):
    """It ended as "results cannot be written", of the draft that had been renamed."""
    rename = os.replace

    def replaced(*names):
        rename(*names)
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", replaced)
    with pytest.raises(KeyboardInterrupt), written_whole(tmp_path / "kept.npz") as file:
        file.write(b"all")
    assert [(one.name, one.read_bytes()) for one in tmp_path.iterdir()] == [("kept.npz", b"all")]


@pytest.mark.parametrize("writing", [written_whole, written_beside])
def test_what_cannot_be_written_is_named(writing, tmp_path):
    """A full disk was said of no file where others' code writes, a folder that is read only of the draft."""
    path = tmp_path / "kept.vtu"
    with pytest.raises(OSError, match=r"No space left on device: '.*kept\.vtu'"), writing(path):
        raise OSError(28, "No space left on device")
    with pytest.raises(PermissionError, match=r"Permission denied: '.*kept\.vtu'"), writing(path):
        raise PermissionError(13, "Permission denied", str(tmp_path / ".kept.vtu.a1b2.part"))
    assert not [*tmp_path.iterdir()]


def test_a_checkpoint_that_cannot_be_written_is_refused_before_it_is_computed(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(ValueError, match=r"checkpoint: the folder .* cannot be written to; choose another place"):
        CURVES["peak"](checkpoint=tmp_path / "kept.npz")


@pytest.mark.skipif(os.name != "posix", reason="sends signals")
@pytest.mark.parametrize(
    "seconds", [[60.0, 60.0, 60.0, 60.0, 60.0, 60.0], [60.0, 0.1]], ids=["more follow", "one idle"]
)
def test_ctrl_c_does_not_wait_for_processes_and_these_say_nothing(seconds, capfd):
    def interrupted():
        with study_tables._pool(2) as pool:
            Timer(2.0, os.kill, [os.getpid(), signal.SIGINT]).start()
            executors.spread(time.sleep, seconds, pool)

    before, started = signal.signal(signal.SIGINT, signal.default_int_handler), time.monotonic()
    try:
        with pytest.raises(KeyboardInterrupt):
            interrupted()
    finally:
        signal.signal(signal.SIGINT, before)
    assert time.monotonic() - started < 30.0
    assert capfd.readouterr().err == ""
