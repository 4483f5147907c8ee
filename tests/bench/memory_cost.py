"""Cost per event of a friction damper at the beam's tip, against a Hertz stop there.

    python tests/bench/memory_cost.py [turns]

The paper's beam with 1, 2 and 3 modes, shaken by a tone or by noise; a stop switches twice per contact, a slider sticks
and slips. Both run by turns; processor time over the switches, median over the turns, with its quartiles for the ratio.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from problems import PAPER_BEAM, TIP

import fembeam as fb
from contacts import Hertz, Jenkins
from solvers import Exponential, System, integrate

DAMPER = {"elements": [fb.Element(TIP, Jenkins(300.0, 0.06))]}  # N/m, N: it slips at 0.2 mm
STOP = {"stops": [fb.Stop(TIP, Hertz(2.1e8))]}
BASES = {"sine": fb.Harmonic(1e-3, 110.0), "noise": fb.BandNoise.rolled_off(2.5e-4, (0.0, 1226.6), 300.0, seed=1)}
DURATION, RTOLS = 20.0, (1e-6, 1e-8)  # s


def system_of(part: dict[str, object], base: object, modes: int) -> System:
    """The paper's beam with a damper or a stop."""
    scene = fb.Scene(
        PAPER_BEAM, [fb.Clamped(0.0)], damping=fb.ModalDamping(0.02), base=base,
        masses=[fb.LumpedMass(TIP, mass=25.4e-3, inertia=3.0e-6)], **part,
    )  # fmt: skip
    return scene.reduce(modes).for_duration(DURATION).system


def per_event(system: System, rtol: float) -> tuple[float, int]:
    """Processor seconds per switch of a run without samples, and the switches."""
    rest, method = np.zeros(system.size), Exponential(rtol)
    begin = time.process_time()
    events = integrate(system, rest, rest, DURATION, method=method).cost.events
    return (time.process_time() - begin) / events, events


def main(turns: int = 15) -> None:
    """Print a table."""
    print("load, modes, rtol   stop us/event   damper us/event   ratio (quartiles)   events: stop, damper")
    for name, base in BASES.items():
        for modes in (1, 2, 3):
            systems = [system_of(part, base, modes) for part in (STOP, DAMPER)]
            for rtol in RTOLS:
                counts = [per_event(system, rtol)[1] for system in systems]  # tables are made in these runs
                times = np.array([[per_event(system, rtol)[0] for system in systems] for _ in range(turns)])
                ratio = np.quantile(times[:, 1] / times[:, 0], [0.5, 0.25, 0.75])
                stop, damper = 1e6 * np.median(times, axis=0)
                print(f"{name:5} {modes} {rtol:10.0e} {stop:14.2f} {damper:17.2f} {ratio[0]:9.2f} ({ratio[1]:.2f} to "
                      f"{ratio[2]:.2f}) {counts[0]:12d} {counts[1]:8d}", flush=True)  # fmt: skip


if __name__ == "__main__":
    main(*(int(x) for x in sys.argv[1:]))
