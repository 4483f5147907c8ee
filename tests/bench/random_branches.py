"""Branches of random systems, one or two modes with a stop of three laws, over omega, amplitude or gap.

    python tests/bench/random_branches.py [count] [first seed] [omega | amplitude | gap] [most orbits per direction]

Prints how the directions ended, the special points on the way, the work per orbit, and every direction that was lost.
Every orbit must satisfy its residual within the span, and come back after a second period too, whatever happens.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from oscillators import random_family

import solvers.arm
from solvers import OrbitError, branch, integrate
from solvers.chain import Problem, delayed
from solvers.continuation import BranchStatus


class Counted:
    """`Problem.evaluate`, counted."""

    def __init__(self) -> None:
        self.count, self.evaluate = 0, Problem.evaluate
        Problem.evaluate = lambda *arguments: self(*arguments)  # type: ignore[method-assign]

    def __call__(self, *arguments):
        """One evaluation."""
        self.count += 1
        return self.evaluate(*arguments)


def drift(one: Any) -> float:
    """How far an orbit is from its begin after two periods, of its size and in units of what its multipliers make."""
    later, x = delayed(one.system, one.phase), one.state
    n, largest = one.system.size, max(1.0, abs(one.multipliers[0]))
    end = integrate(later, x[:n], x[n:], 2.0 * one.period, method=one.method)
    off = np.abs(np.concatenate((end.q[-1], end.q_dot[-1])) - x).max()
    return float(off / (np.abs(x).max() * largest**2))


def main(count: str = "100", first: str = "0", over: str = "omega", most: str = "60") -> None:
    """Follow the branches."""
    solvers.arm.MOST_ORBITS = int(most)
    ends, marks, work, orbits = Counter(), Counter(), Counted(), 0
    for seed in range(int(first), int(first) + int(count)):
        make, span, modes = random_family(np.random.default_rng(seed), over)
        try:
            found = branch(make, span, np.zeros(2 * modes), step=0.3).run()
        except OrbitError:
            ends["no orbit to start from"] += 1
            continue
        orbits += len(found.orbits)
        marks.update(orbit.mark for orbit in found.special)
        assert all(one.residual <= 1e-10 and span[0] <= one.parameter <= span[1] for one in found.orbits), seed
        for one in found.orbits[:: max(1, len(found.orbits) // 10)]:
            if (off := drift(one)) > 1e-6:
                print(f"seed {seed}: no orbit at {one.parameter:.9g} {one.mark}, off by {off:.1e} after two periods")
        for arm in found.arms:
            ends[arm.status.name] += 1
            if arm.status is BranchStatus.LOST:
                last = arm.orbits[-1]
                law, gap = last.system.contacts[0].law, last.system.contacts[0].gap
                print(f"seed {seed}: lost at {last.parameter:.9g}, {len(arm.orbits)} orbits, {law!r}, gap {gap:g}, "
                      f"entered at {last.contacts.speed_in} m/s, |mu| {np.abs(last.multipliers)}")  # fmt: skip
    print(f"{count} systems: directions ended {dict(ends)}; special points {dict(marks)}")
    print(f"{orbits} orbits, {work.count / max(orbits, 1):.2f} evaluations each")


if __name__ == "__main__":
    main(*sys.argv[1:])
