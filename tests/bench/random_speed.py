"""How fast random response is, what it needs of memory, and how it scales; prints one line each.

python tests/bench/random_speed.py                 the paper's beam, two modes, rtol 1e-6: about two minutes
python tests/bench/random_speed.py --long 1e6      one run of that many seconds with its statistics, and its memory
"""

import argparse
import os
import resource
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial

import numpy as np
import scipy.fft

import fembeam as fb
import solvers
import solvers.exponential
from contacts import Hysteretic
from fembeam.study import ensemble, stationary

METHOD = solvers.Exponential(1e-6, ledger=False)
RELEASING = [(solvers.exponential, "advance"), (scipy.fft, "irfft"), (np.fft, "rfft")]


def paper_model():
    """The paper's beam with two modes under broad-band noise."""
    scene = fb.Scene(
        beam=fb.Beam(0.2599, fb.Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)),
        supports=[fb.Clamped(0.0)],
        masses=[fb.LumpedMass(0.24445, mass=25.4e-3, inertia=3.0e-6)],
        stops=[fb.Stop(0.24445, law=Hysteretic.lankarani_nikravesh(2.1e8, restitution=0.5))],
        damping=fb.ModalDamping([0.02, 0.01]),
        base=fb.BandNoise(2.5e-4, (0.0, 1226.6), seed=1),
    )
    return scene.reduce(modes=2)


def contacts_of(model, seconds):
    """A quantity of the contact log alone: the cheapest run."""
    return float(model.simulate(seconds, solver=METHOD).contacts.peak_force.mean())


def spin(count):
    """Work that needs nothing but a processor: what two processes can gain here and now."""
    return sum(i & 3 for i in range(count))


def best(call, repeats=5):
    """Shortest processor and wall time of several calls, s: on a busy machine only the first tells something."""
    times = []
    for _ in range(repeats):
        begin = time.process_time(), time.perf_counter()
        call()
        times.append((time.process_time() - begin[0], time.perf_counter() - begin[1]))
    return [min(column) for column in zip(*times, strict=True)]


def released(call):
    """Share of a call's time spent in what releases the GIL: the compiled integration and the transforms."""
    inside, kept = [0.0], {(module, name): getattr(module, name) for module, name in RELEASING}

    def timed(function):
        def wrapped(*arguments, **options):
            begin = time.thread_time()
            result = function(*arguments, **options)
            inside[0] += time.thread_time() - begin
            return result

        return wrapped

    try:
        for (module, name), function in kept.items():
            setattr(module, name, timed(function))
        begin = time.thread_time()
        call()
        return inside[0] / (time.thread_time() - begin)
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


def scaling(rounds):
    """Two workers against one of the same kind, interleaved; and two processes that only count."""
    model, quantity = paper_model(), partial(contacts_of, seconds=200.0)
    cases = {
        "two counting processes": (ProcessPoolExecutor, lambda pool: list(pool.map(spin, [2_000_000] * 16))),
        "two processes": (ProcessPoolExecutor, partial(ensemble, model, 16, quantity)),
        "two threads": (ThreadPoolExecutor, partial(ensemble, model, 16, quantity)),
    }
    for name, (kind, call) in cases.items():
        with kind(1) as one, kind(2) as two:
            times = {pool: [] for pool in (one, two)}
            for _ in range(rounds + 1):  # the first starts workers and loads kernels
                for pool in (one, two):
                    begin = time.perf_counter()
                    call(pool)
                    times[pool].append(time.perf_counter() - begin)
        ratios = sorted(a / b for a, b in zip(times[one][1:], times[two][1:], strict=True))
        print(
            f"{name}: {ratios[len(ratios) // 2]:.2f} times one (median of {rounds}, best {ratios[-1]:.2f}), "
            f"shortest over shortest {min(times[one][1:]) / min(times[two][1:]):.2f}, load {os.getloadavg()[0]:.1f}"
        )


def memory(seconds):
    """One long run with streaming statistics."""
    begin = time.perf_counter()
    found = stationary(paper_model(), seconds, 2e-3, solver=METHOD, progress=True)
    spent, peak = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
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
