"""Branches of random systems with one stop, two or three, over omega, amplitude or gap.

    python tests/bench/random_branches.py [count] [first seed] [omega | amplitude | gap] [most orbits] [stops]

Prints how the directions ended, the special points on the way, the work per orbit, every direction that was lost, and
every change of stability or of the contacts that no mark tells of. Every orbit must satisfy its residual within the
span, and some of each branch must come back after a second period, by their own method and by `DormandPrince`.
"""

from __future__ import annotations

import sys
from collections import Counter
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from oscillators import random_family, random_stops_family

import solvers.arm
from solvers import Branch, DormandPrince, Orbit, OrbitError, branch, integrate, orbit
from solvers.chain import Problem, delayed
from solvers.continuation import BranchStatus
from solvers.touch import signature

CHECKED = 5  # orbits of a branch that are integrated again


class Counted:
    """`Problem.evaluate`, counted."""

    def __init__(self) -> None:
        self.count, self.evaluate = 0, Problem.evaluate
        Problem.evaluate = lambda *arguments: self(*arguments)  # type: ignore[method-assign]

    def __call__(self, *arguments):
        """One evaluation."""
        self.count += 1
        return self.evaluate(*arguments)


def drift(one: Orbit, method: Any) -> float:
    """How far an orbit is from its begin after two periods, of its size and in units of what its multipliers make."""
    later, x = delayed(one.system, one.phase), one.state
    n, largest = one.system.size, max(1.0, abs(one.multipliers[0]))
    end = integrate(later, x[:n], x[n:], 2.0 * one.period, method=method)
    off = np.abs(np.concatenate((end.q[-1], end.q_dot[-1])) - x).max()
    return float(off / (np.abs(x).max() * largest**2))


def check_orbits(seed: int, found: Branch, ends: Counter[str]) -> None:
    """Integrate some of a branch's orbits again and tell which do not close."""
    for one in found.orbits[:: max(1, len(found.orbits) // CHECKED)]:
        for name, method in (("own", one.method), ("DormandPrince", DormandPrince(1e-10))):
            ends[f"closed by {name}"] += 1
            if not (off := drift(one, method)) <= 1e-6:
                ends[f"open by {name}"] += 1
                print(f"seed {seed}: {name}: no orbit at {one.parameter:.9g} {one.mark}, off by {off:.1e}")


def check_marks(seed: int, found: Branch, ends: Counter[str]) -> None:
    """Tell what changes between two orbits without a mark."""
    for arm in found.arms:
        for a, b in pairwise(arm.orbits):
            for what, before, after in (("contacts", *map(signature, (a, b))), ("stability", a.stable, b.stable)):
                if before != after and not (a.mark or b.mark):
                    ends[f"unmarked {what}"] += 1
                    print(f"seed {seed}: {what} {before} to {after}, {a.parameter:.9g} to {b.parameter:.9g}")
    for one in found.special:
        if one.mark == "fold" and np.abs(one.multipliers - 1.0).min() > 1e-3:
            ends["fold without a multiplier near one"] += 1


def followed(make: Any, span: tuple[float, float], modes: int) -> Branch:
    """The branch of the orbit near rest at the low end of the span, or of what a run from rest settles to."""
    try:
        return branch(make, span, np.zeros(2 * modes), step=0.3).run()
    except OrbitError:
        return branch(make, span, orbit(*make(span[0])), at=span[0], step=0.3).run()


def main(count: str = "100", first: str = "0", over: str = "omega", most: str = "60", stops: str = "1") -> None:
    """Follow the branches."""
    solvers.arm.MOST_ORBITS = int(most)
    ends: Counter[str] = Counter()
    marks: Counter[str] = Counter()
    checks: Counter[str] = Counter()
    work, orbits = Counted(), 0
    for seed in range(int(first), int(first) + int(count)):
        rng = np.random.default_rng(seed)
        family = random_family(rng, over) if stops == "1" else random_stops_family(rng, over, int(stops))
        try:
            found = followed(*family)
        except OrbitError:
            ends["no orbit to start from"] += 1
            continue
        orbits += len(found.orbits)
        marks.update(one.mark for one in found.special)
        span = family[1]
        assert all(one.residual <= 1e-10 and span[0] <= one.parameter <= span[1] for one in found.orbits), seed
        check_orbits(seed, found, checks)
        check_marks(seed, found, checks)
        for arm in found.arms:
            ends[arm.status.name] += 1
            if arm.status in (BranchStatus.LOST, BranchStatus.JUMP):
                last = arm.orbits[-1]
                laws = [(contact.law, round(contact.gap, 6)) for contact in last.system.contacts]
                print(f"seed {seed}: {arm.status.name} at {last.parameter:.9g}, {len(arm.orbits)} orbits, {laws}, "
                      f"entered at {last.contacts.speed_in} m/s, |mu| {np.abs(last.multipliers)}")  # fmt: skip
    print(
        f"{count} systems of {stops} stop(s) over {over}: directions ended {dict(ends)}; special points {dict(marks)}"
    )
    print(f"{dict(checks)}; {orbits} orbits, {work.count / max(orbits, 1):.2f} evaluations each")


if __name__ == "__main__":
    main(*sys.argv[1:])
