"""Branches of random systems with one stop, two or three, over omega, amplitude or gap.

    python tests/bench/random_branches.py [count] [first seed] [omega | amplitude | gap] [most orbits] [stops]

Prints how the directions ended, the special points on the way, the work per orbit, every direction that was lost, and
every change of stability or of the contacts that no mark tells of. Every orbit must satisfy its residual within the
span, and some of each branch must come back after a second period, by their own method and by `DormandPrince`: to 1e-6,
or as near as errors of their tolerance in every step allow. Such orbits are told of as unstable, others as open.
"""

from __future__ import annotations

import math
import sys
from collections import Counter
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from oscillators import random_family, random_stops_family

import solvers.branches.walk
from solvers import Branch, DormandPrince, Orbit, OrbitError, branch, integrate, orbit
from solvers.branches.continuation import BranchStatus
from solvers.branches.grazing import signature
from solvers.orbits import PeriodicProblem, delayed, open_starts, state_after

CHECKED = 5  # orbits of a branch that are integrated again


class Counted:
    """`PeriodicProblem.evaluate`, counted."""

    def __init__(self) -> None:
        self.count, self.evaluate = 0, PeriodicProblem.evaluate
        PeriodicProblem.evaluate = lambda *arguments: self(*arguments)  # type: ignore[method-assign]

    def __call__(self, *arguments):
        """One evaluation."""
        self.count += 1
        return self.evaluate(*arguments)


def drift(one: Orbit, method: Any) -> tuple[float, int]:
    """How far an orbit is from its start after two periods, of its size, and the steps that takes."""
    later, x = delayed(one.system, one.phase), one.state
    n = one.system.size
    end = integrate(later, x[:n], x[n:], 2.0 * one.period, method=method)
    off = np.abs(np.concatenate((end.q[-1], end.q_dot[-1])) - x).max()
    return float(off / np.abs(x).max()), end.cost.steps


def reach(one: Orbit, error: float) -> float:
    """How far an error can carry an orbit off by the end of two periods, of its size.

    The error is one of each coordinate's size, either way, made at an open time, of which there are up to eight; its
    worst direction lies within √(2n) of theirs. Beside a jump of the return map such errors end on its other side.
    """
    n, run, worst = one.system.size, one.samples(), 0.0
    scale = np.concatenate([np.full(n, np.abs(part).max()) for part in (run.q, run.q_dot)])
    for t in [0.0, *open_starts(one.system, one.contacts, one.period, 8, False)]:
        x = state_after(delayed(one.system, one.phase), one.state, t, one.method) if t else one.state
        for off in error * np.vstack((np.diag(scale), -np.diag(scale))):
            end = state_after(delayed(one.system, one.phase + t), x + off, 2.0 * one.period - t, one.method)
            worst = max(worst, float(np.abs(end - one.state).max()))
    return math.sqrt(2.0 * n) * worst / float(np.abs(one.state).max())


def check_orbits(seed: int, found: Branch, ends: Counter[str]) -> None:
    """Integrate some of a branch's orbits again and tell which do not close.

    Off by more than 1e-6 they must be within reach of the errors of all steps, each at most the tolerance, and of the
    residual.
    """
    for one in found.orbits[:: max(1, len(found.orbits) // CHECKED)]:
        for name, method in (("own", one.method), ("DormandPrince", DormandPrince(1e-10))):
            ends[f"closed by {name}"] += 1
            off, steps = drift(one, method)
            if off <= 1e-6:
                continue
            far = reach(one, steps * method.rtol + one.residual)
            kind = "unstable" if off <= far else "open"
            ends[f"{kind} by {name}"] += 1
            print(f"seed {seed}: {name}: {kind} at {one.parameter:.9g} {one.mark}, off {off:.1e}, reach {far:.1e}")


def check_marks(seed: int, found: Branch, ends: Counter[str]) -> None:
    """Tell what changes between two orbits without a mark."""
    for walk in found.walks:
        for a, b in pairwise(walk.orbits):
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
    solvers.branches.walk.MOST_ORBITS = int(most)
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
        for walk in found.walks:
            ends[walk.status.name] += 1
            if walk.status in (BranchStatus.LOST, BranchStatus.JUMP):
                last = walk.orbits[-1]
                laws = [(contact.law, round(contact.gap, 6)) for contact in last.system.contacts]
                print(f"seed {seed}: {walk.status.name} at {last.parameter:.9g}, {len(walk.orbits)} orbits, {laws}, "
                      f"entered at {last.contacts.speed_in} m/s, |mu| {np.abs(last.multipliers)}")  # fmt: skip
    print(
        f"{count} systems of {stops} stop(s) over {over}: directions ended {dict(ends)}; special points {dict(marks)}"
    )
    print(f"{dict(checks)}; {orbits} orbits, {work.count / max(orbits, 1):.2f} evaluations each")


if __name__ == "__main__":
    main(*sys.argv[1:])
