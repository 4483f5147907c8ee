"""Energy balance of the paper's beam with one element with memory under a tone: refused runs and the largest residual.

    python tests/bench/memory_refusals.py [count] [first seed] [processes]

Half a second of a clamped beam with a lumped mass and a Jenkins or Iwan element, base motion by one tone, 3, 5 or 10
modes, most with the residual static shape of the element, whose frequency is 40 to 400 times that of the element's
motion. Every scene runs at three tolerances. Printed are the runs refused, and the largest residual in units of the
energy handled. All of it has to be below 1e-9 beside 20 rtol.
"""

from __future__ import annotations

import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
from random_scenes import imbalance

import fembeam as fb
from contacts import Iwan, Jenkins
from solvers import Exponential, Status, integrate

RTOLS = (1e-8, 1e-10, 1e-12)
TIP = 0.24445
STEEL = fb.Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)


def draw(seed: int) -> tuple[Any, str]:
    """A reduced model, and what it is in words."""
    rng = np.random.default_rng([seed, 77])
    k, place = 10.0 ** rng.uniform(3.0, 6.0), float(rng.choice([TIP, rng.uniform(0.05, 0.25)]))
    omega, speed = 10.0 ** rng.uniform(1.5, 3.2), 10.0 ** rng.uniform(-2.0, 0.0)
    limit = 10.0 ** rng.uniform(-1.5, 1.0)
    law: Any = Jenkins(k, limit) if rng.random() < 0.5 else Iwan.uniform(k, limit, int(rng.integers(2, 7)))
    modes, residual = int(rng.choice([3, 5, 10])), bool(rng.random() < 0.75)
    scene = fb.Scene(
        beam=fb.Beam(0.2599, STEEL),
        supports=[fb.Clamped(0.0)],
        masses=[fb.LumpedMass(TIP, mass=25.4e-3, inertia=3.0e-6)],
        elements=[fb.Element(place, law)],
        damping=fb.ModalDamping([0.02, 0.01]),
        base=fb.Harmonic(speed / omega, omega),
    )
    words = f"{law!r} at {place:.4g} m, {modes} modes{' + 1' * residual}, {speed / omega:.3g} m at {omega:.4g} rad/s"
    return scene.reduce(modes=modes, residual=residual), words


def judge(seed: int) -> list[tuple[str, float, bool]]:
    """Residual of every run in units of the energy handled, and whether it was refused."""
    model, words = draw(seed)
    found, rest = [], np.zeros(model.system.size)
    for rtol in RTOLS:
        run = integrate(model.system, rest, rest, 0.5, 1e-4, Exponential(rtol), check=False)
        found.append((f"seed {seed}, rtol {rtol:g}: {words}", imbalance(run), run.status is not Status.DONE))
    return found


def main(count: int = 200, first: int = 0, processes: int = 2) -> int:
    """Run and print; returns the number of runs refused."""
    worst: dict[str, float] = {}
    kinds: Counter[str] = Counter()
    with ProcessPoolExecutor(processes) as pool:
        for i, runs in enumerate(pool.map(judge, range(first, first + count))):
            for (words, residual, refused), rtol in zip(runs, RTOLS, strict=True):
                key = f"{rtol:g}"
                worst[key] = max(worst.get(key, 0.0), residual)
                kinds[key] += refused
                if refused or residual > 1e-9 + 20.0 * rtol:
                    print(f"{words}\n    residual {residual:.3g}{', refused' * refused}", flush=True)
            if i % 100 == 99:
                print(f"... {i + 1} scenes", flush=True)
    for key, residual in worst.items():
        print(f"rtol {key}: {count} runs, {kinds[key]} refused, largest residual {residual:.3g} of the energy handled")
    return sum(kinds.values())


if __name__ == "__main__":
    sys.exit(main(*(int(x) for x in sys.argv[1:])) > 0)
