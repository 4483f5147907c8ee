"""How fast random response is, what it needs of memory, and how it scales; prints one line each.

python tests/bench/random_speed.py                 the paper's beam, two modes, rtol 1e-6: about two minutes
python tests/bench/random_speed.py --long 1e6      one run of that many seconds with its statistics, and its memory
"""

import argparse
import os
import resource
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import fembeam as fb
import solvers
from contacts import Hysteretic
from fembeam.study import ensemble, stationary

METHOD = solvers.Exponential(1e-6, ledger=False)


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


def best(call, repeats=5):
    """Shortest processor and wall time of several calls, s: on a busy machine only the first tells something."""
    times = []
    for _ in range(repeats):
        begin = time.process_time(), time.perf_counter()
        call()
        times.append((time.process_time() - begin[0], time.perf_counter() - begin[1]))
    return [min(column) for column in zip(*times, strict=True)]


def single():
    """Simulated seconds per second of one core, everything included."""
    model, seconds = paper_model(), 200.0
    other = replace(model, scene=replace(model.scene, base=replace(model.scene.base, seed=2)))
    cases = {
        "contact log only": partial(other.simulate, seconds, solver=METHOD),
        "samples, dt = 1 ms": partial(other.simulate, seconds, 1e-3, solver=METHOD),
        "streaming statistics, dt = 2 ms": partial(stationary, model, seconds, 2e-3, solver=METHOD),
        "streaming statistics, dt = 1 ms": partial(stationary, model, seconds, 1e-3, solver=METHOD),
    }
    for name, call in cases.items():
        call()
        processor, wall = best(call)
        print(
            f"{name}: {seconds / processor:.0f} simulated seconds per second of processor, {seconds / wall:.0f} of wall"
        )


def scaling():
    """Two workers against one of the same kind, interleaved."""
    model, count, quantity = paper_model(), 16, partial(contacts_of, seconds=200.0)
    for kind in (ProcessPoolExecutor, ThreadPoolExecutor):
        with kind(1) as one, kind(2) as two:
            for pool in (one, two):
                ensemble(model, 4, quantity, pool)  # start the workers, load the kernels
            times = {1: [], 2: []}
            for _ in range(5):
                for workers, pool in ((1, one), (2, two)):
                    begin = time.perf_counter()
                    ensemble(model, count, quantity, pool)
                    times[workers].append(time.perf_counter() - begin)
        ratio = min(times[1]) / min(times[2])
        print(
            f"{kind.__name__}: two are {ratio:.2f} times one, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
        )


def memory(seconds):
    """One long run with streaming statistics."""
    begin = time.perf_counter()
    found = stationary(paper_model(), seconds, 2e-3, solver=METHOD, progress=True)
    spent, peak = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{seconds:g} s in {spent:.0f} s ({seconds / spent:.0f} per second), peak memory {peak:.0f} MB")
    print(f"{found.impacts[0].number} contacts, rate {found.impacts[0].rate!r} 1/s, δ std {found['δ'].std!r} m")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--long", type=float, metavar="SECONDS")
    long = parser.parse_args().long
    if long:
        memory(long)
    else:
        print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
        single()
        scaling()
