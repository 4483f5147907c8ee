"""What the energy ledger of sampled runs costs: time with it over time without, by turns, and what it leaves open.

python tests/bench/energy_cost.py [seconds] [rounds]     the paper's beam, dt = 1 ms: one line per excitation and model
"""

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from problems import paper_scene

import fembeam as fb
import solvers

BASES = {
    "noise": fb.BandNoise(2.5e-4, (0.0, 1226.6), seed=1),
    "tone": fb.Harmonic(1e-3, 195.0),
    "three tones": fb.Multisine((1e-3, 1e-4, 3e-5), (195.0, 390.0, 780.0)),
}


def compared(model, seconds, rounds):
    """Seconds of this thread with and without ledger, by turns, and the run with it; idle threads of BLAS spin."""
    runs = {}
    spent = {ledger: [] for ledger in (True, False)}
    for turn in range(rounds + 1):
        for ledger, times in spent.items():
            begin = time.thread_time()
            runs[ledger] = model.simulate(seconds, 1e-3, solver=solvers.Exponential(1e-8, ledger=ledger))
            if turn:  # the first one makes tables
                times.append(time.thread_time() - begin)
    return *(np.array(times) for times in spent.values()), runs[True]


def main(seconds=20.0, rounds=9):
    """One line per case."""
    for name, base in BASES.items():
        for modes in (2, 10, 30):
            model = paper_scene(base, [0.02, *[0.01] * (modes - 1)]).reduce(modes)
            on, off, run = compared(model, seconds, rounds)
            energy = run.energy
            scale = max(np.abs(energy.input).max(), energy.stored.max())
            print(
                f"{name}, {modes} modes: {seconds / off.min():.0f} simulated seconds per second without ledger, "
                f"{seconds / on.min():.0f} with: {np.median(on / off):.2f} times the time "
                f"({len(run.contacts)} contacts, {run.cost.steps} steps); residual "
                f"{np.abs(energy.residual).max() / scale:.1e} of the energy handled",
                flush=True,
            )


if __name__ == "__main__":
    main(*map(float, sys.argv[1:2]), *map(int, sys.argv[2:3]))
