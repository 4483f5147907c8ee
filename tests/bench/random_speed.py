"""How fast random response is, what it needs of memory, and how it scales; prints one line each.

python tests/bench/random_speed.py                 the paper's beam, two modes, rtol 1e-6: about two minutes
python tests/bench/random_speed.py --long 1e6      one run of that many seconds with its statistics, and its memory
"""

import argparse
import os
import resource
import sys
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
import scipy.fft

sys.path.insert(0, str(Path(__file__).parents[1]))

from problems import paper_scene

import fembeam as fb
import solvers
import solvers.exponential.method
from fembeam.study import ensemble, stationary

METHOD = solvers.Exponential(1e-6, ledger=False)
RELEASING = [(solvers.exponential.method.Engine, "march"), (scipy.fft, "irfft"), (np.fft, "rfft")]


def paper_model():
    """The paper's beam with two modes under broad-band noise."""
    return paper_scene(fb.BandNoise(2.5e-4, (0.0, 1226.6), seed=1)).reduce(modes=2)


def timed(work):
    """Seconds of processor and of wall time that a piece of work takes its worker."""
    started = time.thread_time(), time.perf_counter()
    work()
    return {"processor": time.thread_time() - started[0], "wall": time.perf_counter() - started[1]}


def contacts_of(model, seconds):
    """A quantity of the contact log alone, the cheapest run, and what it takes."""
    return timed(lambda: model.simulate(seconds, solver=METHOD).contacts.peak_force.mean())


def spin(model):
    """Work that needs nothing but a processor, and what it takes: what two processes can gain here and now."""
    return timed(lambda: sum(i & 3 for i in range(2_000_000)))


def best(call, repeats=5):
    """Shortest processor and wall time of several calls, s: on a busy machine only the first tells something."""
    times = []
    for _ in range(repeats):
        started = time.process_time(), time.perf_counter()
        call()
        times.append((time.process_time() - started[0], time.perf_counter() - started[1]))
    return [min(column) for column in zip(*times, strict=True)]


def released(call):
    """Share of a call's time spent in what releases the GIL: the compiled integration and the transforms."""
    inside, kept = [0.0], {(module, name): getattr(module, name) for module, name in RELEASING}

    def timed(function):
        def wrapped(*arguments, **options):
            started = time.thread_time()
            result = function(*arguments, **options)
            inside[0] += time.thread_time() - started
            return result

        return wrapped

    try:
        for (module, name), function in kept.items():
            setattr(module, name, timed(function))
        started = time.thread_time()
        call()
        return inside[0] / (time.thread_time() - started)
    finally:
        for (module, name), function in kept.items():
            setattr(module, name, function)


def single():
    """Simulated seconds per second of one core, everything included."""
    model, seconds = paper_model(), 200.0
    long = 2 * 183.4 - 1.0  # two stretches
    cases = {
        "contact log only": (partial(model.simulate, seconds, solver=METHOD), seconds),
        "samples, dt = 1 ms": (partial(model.simulate, seconds, 1e-3, solver=METHOD), seconds),
        "streaming statistics, dt = 2 ms": (partial(stationary, model, long, 2e-3, solver=METHOD), long),
        "streaming statistics, dt = 1 ms": (partial(stationary, model, long, 1e-3, solver=METHOD), long),
    }
    for name, (call, duration) in cases.items():
        call()
        processor, wall = best(call)
        share = max(released(call) for _ in range(3))
        print(
            f"{name}: {duration / processor:.0f} simulated seconds per second of processor, {duration / wall:.0f} of "
            f"wall; {share:.0%} of the time without the GIL"
        )
    noise, run = model.scene.base.derivative(2), partial(model.simulate, seconds, solver=METHOD)
    made, whole = (best(call)[0] for call in (lambda: noise.for_duration(seconds).nodes(seconds, METHOD.rtol), run))
    print(f"making the noise: {made / whole:.0%} of a run with the contact log only")


def scaling(rounds):
    """Two workers against one, all cases round by round, and where what is lost of twice the speed goes.

        times one = 2 * (processor time alone / beside another) * (share of a core) * (time at work),    two over one

    Only the last is the library's, the second where other work fills the cores too: of threads with two, the wait
    for the GIL is in it.
    """
    model = paper_model()
    contacts = partial(contacts_of, seconds=200.0)
    cases = {
        "two counting processes": (ProcessPoolExecutor, spin),
        "two processes": (ProcessPoolExecutor, contacts),
        "two threads": (ThreadPoolExecutor, contacts),
    }
    rows = {name: [] for name in cases}
    for turn in range(rounds + 1):  # the first loads kernels
        for name, (kind, quantity) in cases.items():
            pair = [_round(kind(workers), workers, model, quantity) for workers in (1, 2)]
            if turn:
                rows[name].append(pair)
    for name, pairs in rows.items():
        one, two = np.median(pairs, axis=0)
        ratio = np.array([first[0] / second[0] for first, second in pairs])
        print(
            f"{name}: {np.median(ratio):.2f} times one (median of {rounds}, best {ratio.max():.2f}); a realisation "
            f"{1e3 * one[1]:.0f} ms of processor alone, {1e3 * two[1]:.0f} beside another; share of a core "
            f"{one[2]:.0%}, {two[2]:.0%}; at work {one[3]:.1%}, {two[3]:.1%}; load {os.getloadavg()[0]:.1f}"
        )


def _round(pool, workers, model, quantity, count=16):
    """Wall time; per realisation, processor time, its share of the wall time; time at work of the workers."""
    with pool:
        ensemble(model, 2 * workers, quantity, pool)  # starts workers
        started = time.perf_counter()
        spent = ensemble(model, count, quantity, pool).values
        wall = time.perf_counter() - started
    processor, work = spent["processor"].sum(), spent["wall"].sum()
    return wall, processor / count, processor / work, work / (workers * wall)


def memory(seconds):
    """One long run with streaming statistics."""
    started = time.perf_counter()
    found = stationary(paper_model(), seconds, 2e-3, solver=METHOD, progress=True)
    spent, peak = time.perf_counter() - started, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    processor = time.process_time()
    print(f"{seconds:g} s in {spent:.0f} s, {processor:.0f} s of processor ({seconds / processor:.0f} per second)")
    print(f"peak memory {peak:.0f} MB")
    print(f"{found.impacts[0].number} contacts, rate {found.impacts[0].rate!r} 1/s, δ std {found['δ'].std!r} m")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--long", type=float, metavar="SECONDS")
    parser.add_argument("--rounds", type=int, default=7, help="of one worker against two")
    options = parser.parse_args()
    if options.long:
        memory(options.long)
    else:
        print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
        single()
        scaling(options.rounds)
