r"""Cost of a contact in a plane, times that of a scalar stop: holes and oblique stops, without and with friction.

    nice python tests/bench/friction_cost.py [--starts 200] [--rounds 7] [--many]

A clamped-free tube with two modes in each of two planes meets a stop or the wall of a hole at its tip, about once a
run; laws are linear, of Lankarani and Nikravesh, and of Hertz. All cases run by turns in one process, each over the
same starts by `integrate_many` with one thread; the shortest processor time of the rounds counts, less that of the
same runs with the contacts out of reach. Printed with it are steps, rejected steps, law values and borders a contact.
``--many`` instead compares tubes with 60 modes in 4 and in 100 holes with friction: time a contact, largest memory.
"""

from __future__ import annotations

import argparse
import resource
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import numpy as np

from contacts import Hertz, Hysteretic, KelvinVoigt
from fembeam.excitation import Harmonic
from solvers import Contact, Exponential, Friction, System, integrate, integrate_many

METHOD = Exponential(1e-8, ledger=False)
BETA = np.array([1.8751040687119611, 4.694091132974175])  # of a clamped-free beam
GAP, MU, STIFFNESS = 0.01, 0.3, 2.4e3  # in units of the tube's length and mass; k_t/k_n = 0.8 of the linear law
LAWS = {"linear": KelvinVoigt(3e3, 0.0), "LN": Hysteretic.lankarani_nikravesh(2e5, 0.7), "Hertz": Hertz(2e5)}
DURATION = 0.25
OUT_OF_REACH = 1e3


def tip() -> Any:
    """(2,) shapes of unit modal mass at the tip."""
    ratio = (np.cosh(BETA) + np.cos(BETA)) / (np.sinh(BETA) + np.sin(BETA))
    return np.cosh(BETA) - np.cos(BETA) - ratio * (np.sinh(BETA) - np.sin(BETA))


def contact(kind: str, law: Any, gap: float) -> Contact:
    """A stop on a line, an oblique one, or a hole, without or with friction."""
    x, y = np.append(tip(), [0.0, 0.0]), np.append([0.0, 0.0], tip())
    friction = Friction(MU, STIFFNESS)
    if kind == "stop":
        return Contact(-x, law, gap)
    if kind == "oblique, friction":
        return Contact(-x, law, gap, map="oblique", tangent=y, friction=friction)
    return Contact(np.array([x, y]), law, gap, map="annulus", friction=friction if "friction" in kind else None)


def starts(count: int) -> tuple[Any, Any]:
    """Places and speeds of the coordinates: towards the stop, and across it."""
    rng = np.random.default_rng(0)
    speed = np.stack([rng.uniform(0.1, 0.3, count), 0.05 * rng.normal(size=count)] * 2, axis=1)
    speed[:, 2] *= rng.choice([-1.0, 1.0], count)
    return 0.002 * rng.normal(size=(count, 4)), speed


class Case:
    """One kind of contact under one law."""

    def __init__(self, kind: str, law: str, count: int) -> None:
        self.name = f"{kind}, {law}"
        self.count, self.best, self.idle = count, np.inf, np.inf
        omega = np.concatenate((BETA**2, 1.1 * BETA**2))
        self.near, self.far = (
            System.modal(omega, 0.01, [contact(kind, LAWS[law], gap)]) for gap in (GAP, OUT_OF_REACH)
        )

    def turn(self) -> None:
        """Time both."""
        self.best = min(self.best, self._time(self.near))
        self.idle = min(self.idle, self._time(self.far))

    def _time(self, system: System) -> float:
        begun = time.process_time()
        self.runs = integrate_many(system, *starts(self.count), DURATION, method=METHOD, threads=1)
        return time.process_time() - begun

    def counts(self) -> Any:
        """Contacts, then steps, rejected steps, law values and borders a contact."""
        found = np.zeros(5)
        for start in zip(*starts(self.count), strict=True):
            run, free = (integrate(one, *start, DURATION, method=METHOD) for one in (self.near, self.far))
            done, idle = run.cost, free.cost
            found += [len(run.contacts), done.steps - idle.steps, done.rejections, done.law_calls, len(run.transitions)]
        return np.append(found[0], found[1:] / found[0])


def compare(count: int, rounds: int) -> None:
    """Print the table."""
    kinds = "stop", "hole", "oblique, friction", "hole, friction"
    cases = [Case(kind, law, count) for law in LAWS for kind in kinds]
    for turn in range(rounds + 1):
        for case in cases:
            case.turn()
            if turn == 0:  # the first is not warm
                case.best = case.idle = np.inf
    print(f"{'':32s} µs a contact   times   steps rejected  law values  borders")
    scalar = np.nan
    for i, case in enumerate(cases):
        contacts, *rest = case.counts()
        spent = (case.best - case.idle) / contacts * 1e6
        if i % len(kinds) == 0:
            scalar = spent
        told = f"{rest[0]:7.1f} {rest[1]:8.2f} {rest[2]:11.1f} {rest[3]:8.2f}"
        print(f"{case.name:32s} {spent:12.2f} {spent / scalar:7.2f} {told}")


def tube(holes: int, modes: int) -> System:
    """A pinned tube in holes with friction, half of the modes in each plane, shaken in both."""
    number = np.arange(1, modes // 2 + 1)
    omega, size, none = 75.0 * number**2.0, np.sqrt(2.0 / 1.6), np.zeros(modes // 2)
    contacts = []
    for z in np.arange(1, holes + 1) / (holes + 1) - 0.07 / (holes + 1):
        row = size * np.sin(np.pi * number * z)
        rows = np.array([np.append(row, none), np.append(none, row)])
        law = Hysteretic.lankarani_nikravesh(2e8, restitution=0.5)
        contacts.append(Contact(rows, law, 4e-4, map="annulus", friction=Friction(0.3, 5e5)))
    part = 1.6 * size * (1.0 - np.cos(np.pi * number)) / (np.pi * number)
    loads = [
        (-vector, Harmonic(amplitude=5e-4, omega=1.1 * 75.0, phase=phase).derivative(2))
        for vector, phase in ((np.append(part, none), 0.0), (np.append(none, part), 1.0))
    ]
    return System.modal(np.tile(omega, 2), 0.01, contacts=contacts, loads=loads)


def measure(holes: int, modes: int = 60, seconds: float = 0.3) -> str:
    """One line of ``--many``, in a process of its own."""
    import_size = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    system, best, rest = tube(holes, modes), np.inf, np.zeros(modes)
    for _ in range(3):
        begun = time.process_time()
        run = integrate(system, rest, rest, seconds, method=METHOD)
        best = min(best, time.process_time() - begun)
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - import_size) / 1024
    each = best / max(len(run.contacts), 1) * 1e6
    done = run.cost
    return (
        f"{holes:4d} holes, {modes} modes: {len(run.contacts)} contacts, {each:.0f} µs a contact, {grown:.0f} MB more; "
        f"{done.steps} steps, {done.rejections} rejected, {done.law_calls} law values, {len(run.transitions)} borders"
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--starts", type=int, default=200)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--many", action="store_true")
    given = parser.parse_args()
    if given.many:
        for number in (4, 100):
            with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
                print(pool.submit(measure, number).result(), flush=True)
    else:
        compare(given.starts, given.rounds)
