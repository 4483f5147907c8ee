"""Energy balance of the paper's beam with one element with memory under a tone: refused runs and the largest residual.

    python tests/bench/memory_refusals.py [count] [first seed] [processes]

Half a second of a clamped beam with a lumped mass and a Jenkins, Iwan or Bouc-Wen element, base motion by one tone, 3,
5 or 10 modes, most with the residual static shape of the element. While it slips a step lasts up to 200 rad of the
fastest of these coordinates. Every scene runs at three tolerances, with samples and without. Printed are the runs
refused, those with a residual above 1e-9 of the energy handled, and those whose loss depends on the samples or, of a
single slider, is not limit × slip.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
from comparison import handled, imbalance, judged

import fembeam as fb
from contacts import BoucWen, Iwan, Jenkins
from solvers import Exponential, Status, integrate

RTOLS = (1e-8, 1e-10, 1e-12)
BOUND = 1e-9  # of the energy handled
TIP = 0.24445
STEEL = fb.Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)


def draw(seed: int) -> tuple[Any, str]:
    """A reduced model, and what it is in words."""
    rng = np.random.default_rng([seed, 77])
    k, place = 10.0 ** rng.uniform(3.0, 6.0), float(rng.choice([TIP, rng.uniform(0.05, 0.25)]))
    omega, speed = 10.0 ** rng.uniform(1.5, 3.2), 10.0 ** rng.uniform(-2.0, 0.0)
    limit = 10.0 ** rng.uniform(-1.5, 1.0)
    laws: list[Callable[[], Any]] = [
        lambda: Jenkins(k, limit),
        lambda: Iwan.uniform(k, limit, int(rng.integers(2, 7))),
        lambda: BoucWen(k, 0.1, 1.0, 0.7 * k / limit, 0.3 * k / limit, 1),
    ]
    law = laws[rng.choice(3, p=(0.45, 0.45, 0.1))]()
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


def judge(seed: int) -> list[tuple[str, float, float, bool]]:
    """Of every run residual and difference in losses, in units of the energy handled, and whether it was refused."""
    model, words = draw(seed)
    found, rest = [], np.zeros(model.system.size)
    for rtol in RTOLS:
        run, end = (integrate(model.system, rest, rest, 0.5, dt, Exponential(rtol), check=False) for dt in (1e-4, None))
        loss, law = run.losses.loss[0], model.system.contacts[0].law
        other = law.limit * run.losses.slip[0] if isinstance(law, Jenkins) else end.losses.loss[0]
        off = max(abs(other - loss), abs(end.losses.loss[0] - loss)) / handled(run)
        refused = any(one.status is not Status.DONE for one in (run, end))
        found.append((f"seed {seed}, rtol {rtol:g}: {words}", imbalance(run), float(off), refused))
    return found


def main(count: int = 200, first: int = 0, processes: int = 2) -> int:
    """Run and print; returns the number of runs refused or off."""
    worst, kinds = {rtol: (0.0, 0.0) for rtol in RTOLS}, Counter[float]()
    for i, runs in enumerate(judged(judge, count, first, processes)):
        for (words, residual, off, refused), rtol in zip(runs, RTOLS, strict=True):
            worst[rtol] = max(worst[rtol][0], residual), max(worst[rtol][1], off)
            kinds[rtol] += refused
            kinds[0.0] += not max(residual, off) <= BOUND and not refused
            if refused or not max(residual, off) <= BOUND:
                print(f"{words}\n    residual {residual:.3g}, loss off by {off:.3g}{', refused' * refused}", flush=True)
        if i % 100 == 99:
            print(f"... {i + 1} scenes: {dict(kinds)}", flush=True)
    for rtol, (residual, off) in worst.items():
        print(
            f"rtol {rtol:g}: {kinds[rtol]} of {count} refused, residual {residual:.3g}, loss off by {off:.3g} at most"
        )
    return sum(kinds.values())


if __name__ == "__main__":
    sys.exit(main(*(int(x) for x in sys.argv[1:])) > 0)
