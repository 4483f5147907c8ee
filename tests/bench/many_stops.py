r"""Cost against the number of stops: a tube in support plates with gaps on both sides, 30 modes.

``python tests/bench/many_stops.py [--stops 1 4 40] [--modes 30] [--seconds 0.5] [--chart FILE.png]`` prints for each
number of stops the size of the method's tables, what a process's largest memory grows by, the time of the first call
(machine code loaded, tables not made), processor time per simulated second and per contact. Every number of stops has
a process of its own, and its shortest of several runs counts. ``--chart docs/many_stops.png`` makes
the figure of docs/explanation/cost.md.
"""

from __future__ import annotations

import argparse
import resource
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import numpy as np

import solvers
from contacts import Hysteretic
from fembeam.excitation import Harmonic

STOPS = (1, 2, 4, 10, 20, 40, 100, 300)
LENGTH, FIRST_HZ, DAMPING, MASS = 2.0, 12.0, 0.01, 1.6  # a pinned steel tube: m, Hz, -, kg
GAP = 4e-4  # m, and up to a tenth more
ROUNDS = 5


def tube(stops: int, modes: int, seed: int = 0) -> solvers.System:
    """A pinned tube between plates, two stops each, shaken a little above its first frequency."""
    number = np.arange(1, modes + 1)
    omega, size = 2.0 * np.pi * FIRST_HZ * number**2.0, np.sqrt(2.0 / MASS)
    plates = np.arange(1, (stops + 1) // 2 + 1) / ((stops + 1) // 2 + 1) - 0.07 / (stops + 1)
    law = Hysteretic.lankarani_nikravesh(2e8, restitution=0.5)
    gaps = GAP * (1.0 + 0.1 * np.random.default_rng(seed).random(stops))
    contacts = [
        solvers.Contact((1.0 - 2.0 * (s % 2)) * size * np.sin(np.pi * number * plates[s // 2]), law, gap=gaps[s])
        for s in range(stops)
    ]
    participation = MASS * size * (1.0 - np.cos(np.pi * number)) / (np.pi * number)
    base = Harmonic(amplitude=5e-4, omega=1.1 * omega[0])
    return solvers.System.modal(omega, DAMPING, contacts=contacts, loads=[(-participation, base.derivative(2))])


def run(system: solvers.System, seconds: float) -> Any:
    """The system from rest."""
    rest = np.zeros(system.size)
    return solvers.integrate(system, rest, rest, seconds, method=solvers.Exponential(1e-8, ledger=False))


def table_bytes(system: solvers.System) -> int:
    """Size of the method's tables of a system; a run's working space is in what the process grows by."""
    prepared = next(kept for kept, _ in system.kept._entries.values() if hasattr(kept, "tables"))
    return sum(array.nbytes for array in prepared.tables.value if isinstance(array, np.ndarray))


def peak() -> int:
    """Largest resident memory of this process, bytes."""
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def measured(stops: int, modes: int, seconds: float) -> dict[str, float]:
    """All figures of one number of stops."""
    run(tube(1, 2), 0.1)
    run(tube(2, 2), 0.1)  # machine code is loaded
    system, before, started = tube(stops, modes), peak(), time.process_time()
    run(system, 1e-6)
    first, times, contacts = time.process_time() - started, [], 0
    for _ in range(ROUNDS):
        started = time.process_time()
        solution = run(system, seconds)
        times.append(time.process_time() - started)
        contacts = len(solution.contacts.t_in)
    return {
        **{"stops": stops, "tables": table_bytes(system), "peak": peak() - before, "first": first},
        **{"second": min(times) / seconds, "contact": min(times) / max(contacts, 1), "contacts": contacts},
    }


def table(rows: list[dict[str, float]]) -> None:
    """Print the figures."""
    print("stops  tables MB  peak MB  first s  s per simulated s  contacts  µs per contact")
    for row in rows:
        print(
            f"{row['stops']:5d}  {row['tables'] / 1e6:9.1f}  {row['peak'] / 1e6:7.1f}  {row['first']:7.2f}  "
            f"{row['second']:17.3f}  {row['contacts']:8d}  {1e6 * row['contact']:14.1f}"
        )


def chart(rows: list[dict[str, float]], path: str) -> None:
    """Time per contact and memory against the number of stops."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(9.0, 3.6), layout="constrained")
    stops = [row["stops"] for row in rows]
    axes[0].loglog(stops, [1e6 * row["contact"] for row in rows], "o-")
    axes[0].set(xlabel="stops", ylabel="µs per contact", title="time")
    axes[1].loglog(stops, [row["tables"] / 1e6 for row in rows], "o-", label="tables")
    axes[1].loglog(stops, [row["peak"] / 1e6 for row in rows], "s--", label="growth of the process")
    axes[1].set(xlabel="stops", ylabel="MB", title="memory")
    axes[1].legend()
    for axis in axes:
        lowest, highest = axis.get_ylim()
        axis.grid(True, alpha=0.3)
        axis.set_xticks(stops, [str(number) for number in stops])
        ticks = [tick for power in range(5) for tick in (10**power, 2 * 10**power, 5 * 10**power)]
        axis.set_yticks(ticks, [str(tick) for tick in ticks])
        axis.set_ylim(lowest, highest)
        axis.minorticks_off()
    figure.savefig(path, dpi=130)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stops", type=int, nargs="+", default=STOPS)
    parser.add_argument("--modes", type=int, default=30)
    parser.add_argument("--seconds", type=float, default=0.5)
    parser.add_argument("--chart", help="file to draw the figures into")
    options = parser.parse_args()
    rows = []
    with ProcessPoolExecutor(1, get_context("spawn"), max_tasks_per_child=1) as pool:
        for stops in options.stops:
            rows.append(pool.submit(measured, stops, options.modes, options.seconds).result())
    table(rows)
    if options.chart:
        chart(rows, options.chart)


if __name__ == "__main__":
    main()
