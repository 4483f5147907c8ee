"""Runs in eight threads at once, on one system and on many, give the numbers of runs one after the other."""

import copy
import pickle
import random
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import solvers
from contacts import Hertz, Hysteretic
from fembeam import BandNoise, Harmonic
from solvers import Contact, System
from solvers.exponential import block_tables
from solvers.exponential.preparation import prepare_system
from solvers.problem import Memo, forcing_of

THREADS = 8
WATCHED = "preparation.py", "tables.py", "system.py", "memo.py"
STOPS = [Contact([1.0, 0.5], Hertz(1e8), 1e-4), Contact([-0.5, 1.0], Hysteretic(1e7, 1.0), 2e-4)]
NOISE, TONE = BandNoise(50.0, (0.0, 300.0), seed=1), Harmonic(60.0, 130.0)
OTHERS = {"tones": (Harmonic(40.0, 260.0), TONE), "noise": (NOISE, BandNoise(80.0, (0.0, 200.0), seed=2))}


def shake(t):
    """A signal without tones or nodes: its grid depends on the duration."""
    return 30.0 * np.sin(130.0 * np.asarray(t))


@pytest.fixture(autouse=True)
def interrupted():
    """Threads take turns often, and between any two lines of what prepares a run."""
    chance, before = random.Random(1), (sys.getswitchinterval(), threading.gettrace())

    def on_line(frame, event, argument):
        if event == "line" and chance.random() < 0.3:
            time.sleep(1e-5)
        return on_line

    def on_call(frame, event, argument):
        return on_line if frame.f_code.co_filename.endswith(WATCHED) else None

    sys.setswitchinterval(1e-6)
    threading.settrace(on_call)
    yield
    sys.setswitchinterval(before[0])
    threading.settrace(before[1])


def at_once(work, asked):
    """The results of all that is asked, by eight threads that begin together."""
    gate = threading.Barrier(THREADS)

    def share(first):
        gate.wait()
        return [work(*one) for one in asked[first::THREADS]]

    with ThreadPoolExecutor(THREADS) as pool:
        parts = list(pool.map(share, range(THREADS)))
    return [parts[i % THREADS][i // THREADS] for i in range(len(asked))]


def system(omega=100.0, loads=(NOISE, TONE, shake)):
    """Two modes between two stops."""
    vectors = [[1.0, 0.7], [0.4, 1.0], [0.2, 0.1]]
    return System.modal([omega, 900.0], [0.01, 0.03], STOPS, list(zip(vectors, loads, strict=False)))


def end(one, duration):
    """What a run says, bit for bit."""
    run = solvers.integrate(one, [0.0, 0.0], [-0.3, 0.1], duration, 1e-3)
    return b"".join(part.tobytes() for part in (run.q, run.q_dot, run.contacts.t_out, run.contacts.peak_force))


def test_runs_at_once_on_one_system_are_those_one_after_the_other():
    def work(one, duration, kind):
        if kind == "own":
            return end(one, duration)
        vectors = [vector for vector, _ in one.loads]
        return end(one.like(loads=list(zip(vectors, (*OTHERS[kind], shake), strict=True))), duration)

    asked = [(duration, kind) for duration in (0.01, 0.015, 0.021) for kind in ("own", "tones", "own", "noise")] * 4
    wanted = {key: work(system(), *key) for key in set(asked)}
    shared = system()
    found = at_once(lambda *key: work(shared, *key), asked)
    assert [i for i, key in enumerate(asked) if found[i] != wanted[key]] == []
    assert len(set(wanted.values())) == 9


def test_no_thread_gets_the_tables_of_anothers_grid():
    shared = system(loads=[shake])
    forcings = [forcing_of([shake], duration, 1e-8) for duration in (0.02, 0.03)]
    asked = [(i % 3 % 2,) for i in range(800)]
    found = at_once(lambda i: float(prepare_system(shared, forcings[i]).problem.value.table_dt[0]), asked)
    assert [i for i, (key,) in enumerate(asked) if found[i] != forcings[key].table_dt[0]] == []


def test_tables_let_go_by_other_threads_are_made_again(monkeypatch):
    def work(omega):
        return end(system(omega, loads=[]), 0.01)

    monkeypatch.setattr(block_tables, "_CACHE", Memo(1))
    asked = [(100.0 + i % 5,) for i in range(15)]
    wanted = {key: work(*key) for key in set(asked)}
    assert at_once(work, asked) == [wanted[key] for key in asked]


def test_every_thread_gets_what_was_stored_first():
    memo = Memo()
    found = at_once(lambda key: memo.get(key, lambda: object()), [(i // THREADS,) for i in range(40 * THREADS)])
    assert all(len(set(found[i : i + THREADS])) == 1 for i in range(0, len(found), THREADS))


def test_bytes_stay_below_the_bound_but_the_last_value_stays():
    memo = Memo(10_000)
    for i in range(20):
        memo.get(i, lambda: np.zeros(250))  # 2000 bytes
        assert memo.get(0, lambda: np.ones(1))[0] == 0.0  # used all the time
        assert memo.size <= 10_000
    assert [i for i in range(20) if memo.find(i) is not None] == [0, 16, 17, 18, 19]
    memo.store("large", (np.zeros(5000), [np.zeros(5000)]))
    assert len(memo) == 1
    assert memo.size > 80_000


def test_what_cannot_be_made_is_not_kept():
    memo = Memo()
    with pytest.raises(ZeroDivisionError):
        memo.get("key", lambda: 1 / 0)
    assert memo.get("key", lambda: 2) == 2


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda memo: pickle.loads(pickle.dumps(memo))])
def test_a_copy_is_empty(copied):
    memo = Memo(77)
    memo.store("key", 1)
    assert (len(copied(memo)), copied(memo).most) == (0, 77)
