"""Random systems with memory: `Exponential` against `DormandPrince`, thousands of them; prints every failure.

    python tests/bench/random_memory.py [count] [first seed] [processes]

A system has one to four modes and one to four elements with memory: sliders, dry friction, Iwan's and Bouc and Wen's
hysteresis, yielding with hardening and yielding stops, alone or summed with one another and with springs and dashpots,
on coordinates of their own or on a shared one, beside other stops; it is free, driven by tones or by sampled noise.
Compared at rtol 1e-4, 1e-6 and 1e-8 are the motion, the log of contacts, the transitions (which, when, at which place
and force), the work of every element and the energy balance. What a difference is worth is told as in `random_scenes`.
"""

from __future__ import annotations

import sys
import warnings
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
from drawn import Scene, draw_law, draw_signal
from random_scenes import TooStiffError, Verdict, against, numbers_of, references, run

import fembeam as fb
from contacts import KelvinVoigt, Polynomial
from contacts.memory import BoucWen, Coulomb, ElastoPlastic, Iwan, Jenkins, WaltonBraun
from solvers import Contact, DormandPrince, SolverError, System

TOLERANCES = (1e-4, 1e-6, 1e-8)
MOST_TRANSITIONS = 40


def draw_memory(rng: np.random.Generator, mass: float, speed: float, low: float) -> Any:
    """A law with memory, stiffer or softer than the structure, that lets go in some or most of the motion."""
    k = mass * (low * 10.0 ** rng.uniform(-0.3, 1.0)) ** 2
    limit = k * speed / low * 10.0 ** rng.uniform(-1.5, 0.0) * min(1.0, mass * low**2 / k) ** 0.5
    knee = limit / k
    kinds: list[Callable[[], Any]] = [
        lambda: Jenkins(k, limit),
        lambda: Coulomb(limit, k, damping=rng.uniform(0.1, 2.0) * np.sqrt(k * mass)),
        lambda: Coulomb(limit, k, rng.uniform(1.05, 1.5) * limit, rng.uniform(0.5, 2.0) * np.sqrt(k * mass)),
        lambda: Iwan(rng.uniform(0.2, 1.0, 3) * k, rng.uniform(0.05, 1.0, 3) * limit),
        lambda: Iwan.uniform(k, limit, int(rng.integers(2, 6))),
        lambda: ElastoPlastic(k, limit, rng.uniform(0.0, 0.5) * k),
        lambda: _bouc_wen(rng, k, knee, 1),
        lambda: _bouc_wen(rng, k, knee, 2),
    ]
    return kinds[rng.integers(len(kinds))]()


def _bouc_wen(rng: np.random.Generator, k: float, knee: float, n: int) -> BoucWen:
    """Softening hysteresis that saturates at the knee."""
    beta = rng.uniform(0.3, 0.9) / knee**n
    return BoucWen(k, rng.uniform(0.0, 0.5), 1.0, beta, knee**-n - beta, n)


def draw_element(rng: np.random.Generator, row: Any, speed: float, low: float) -> Contact:
    """An element that always acts, or a yielding stop."""
    mass, size = 1.0 / (row @ row), speed / low
    if rng.random() < 0.2:
        loading = mass * (low * 10.0 ** rng.uniform(0.3, 1.5)) ** 2
        kind = str(rng.choice(["kept", "forgotten"]))
        gap = size * rng.choice([0.0, rng.uniform(0.05, 0.6), -rng.uniform(0.0, 0.1)])
        return Contact(row, WaltonBraun(loading, loading * rng.uniform(1.0, 6.0), kind), gap)
    law = draw_memory(rng, mass, speed, low)
    others: list[Callable[[], Any]] = [
        lambda: KelvinVoigt(rng.uniform(0.0, 1.0) * mass * low**2, rng.uniform(0.0, 0.1) * mass * low),
        lambda: Polynomial([0.0, 0.0, rng.uniform(0.1, 2.0) * mass * (low / size) ** 2]),
        lambda: draw_memory(rng, mass, speed, low),
    ]
    if rng.random() < 0.35:
        law = law + others[rng.integers(len(others))]()
    return Contact(row, law, size * rng.choice([0.0, rng.uniform(-0.3, 0.3)]), always=True)


def draw(seed: int) -> Scene:
    """The system of a seed."""
    rng = np.random.default_rng([seed, 21])
    n = int(rng.integers(1, 5))
    low = 10.0 ** rng.uniform(0.0, 2.0)
    omega = np.sort(low * np.concatenate(([1.0], 10.0 ** rng.uniform(0.1, 1.0, n - 1))))
    if rng.random() < 0.1:
        omega[0] = 0.0
    zeta = 10.0 ** rng.uniform(-2.5, -0.7, n)
    C = np.diag(2.0 * zeta * np.maximum(omega, 0.1 * low))
    speed = 10.0 ** rng.uniform(-2.0, 0.5)
    rows = [_row(rng, n)]
    contacts, loads, words = [draw_element(rng, rows[0], speed, low)], [], ""
    for _ in range(rng.integers(0, 4)):
        rows.append(rows[0] * rng.choice([-1.0, 1.0, rng.uniform(0.3, 3.0)]) if rng.random() < 0.35 else _row(rng, n))
        contacts.append(draw_element(rng, rows[-1], speed, low))
    if rng.random() < 0.25:
        row = _row(rng, n)
        time = 10.0 ** rng.uniform(-1.5, -0.3) / low
        contacts.append(
            Contact(row, draw_law(rng, 1.0 / (row @ row), speed, time), rng.uniform(0.0, 0.5) * speed / low)
        )
    for _ in range(rng.integers(0, 3)):
        signal, kind = draw_signal(rng, speed * low * 10.0 ** rng.uniform(-0.5, 0.3), low)
        loads.append((rng.standard_normal(n), signal))
        words += " " + kind
    q0, q_dot0 = speed / low * rng.standard_normal(n), speed * rng.standard_normal(n)
    if loads and rng.random() < 0.3:
        q0, q_dot0 = np.zeros(n), np.zeros(n)
    laws = ", ".join(told(contact) for contact in contacts)
    words = f"n={n} ω=[{omega[0]:.3g}..{omega[-1]:.3g}]{words}; {laws}"
    system = System(np.eye(n), C, np.diag(omega**2), contacts, loads)
    return Scene(system, q0, q_dot0, rng.uniform(3.0, 15.0) / low, words)


def _row(rng: np.random.Generator, n: int) -> Any:
    """A direction."""
    row = rng.standard_normal(n)
    return row / max(np.linalg.norm(row), 1e-3) * rng.uniform(0.5, 1.5)


def told(contact: Contact) -> str:
    """A contact in words."""
    law: Any = contact.law
    return "+".join(type(part).__name__ for part in getattr(law, "parts", (law,)))


def shortened(scene: Scene) -> Scene:
    """The system cut after so many transitions, between two."""
    times = run(scene, DormandPrince(1e-7)).transitions.t
    times = np.unique(times[times > 0.0])
    if len(times) > MOST_TRANSITIONS:
        scene.duration = 0.5 * float(times[MOST_TRANSITIONS - 1] + times[MOST_TRANSITIONS])
    return scene


def disturbed(scene: Scene, rng: np.random.Generator, by: float) -> Scene:
    """The system under small tones besides: a slider forgets how a run began, not what goes on."""
    system, n = scene.system, scene.system.size
    omega = np.sqrt(np.diag(system.K))
    times = np.linspace(0.0, scene.duration, 64)
    largest = [np.linalg.norm(np.hstack((omega**2 * scene.q0, omega * scene.q_dot0)))]
    largest += [np.abs(signal(times)).max() * np.linalg.norm(vector) for vector, signal in system.loads]
    size = by * max(largest)
    tones = [(rng.standard_normal(n), fb.Harmonic(size, w, rng.uniform(0.0, 6.0))) for w in (0.0, *omega)]
    return replace(scene, system=System(system.M, system.C, system.K, system.contacts, [*system.loads, *tones]))


def numbers(solution: Any, scene: Scene, size: float, duration: float) -> dict[str, Any]:
    """What `numbers_of` compares, with the transitions, element by element and border by border."""
    found, rows = numbers_of(solution, scene, size, duration), solution.transitions
    i = np.lexsort((rows.t, rows.border, rows.contact))
    i = i[rows.t[i] > 1e-7 * duration]  # a start beyond borders passes them in any order, or within a shortest step
    contact = rows.contact[i].astype(int)
    found["order"] = [
        *found["order"],
        *zip(contact.tolist(), rows.border[i].tolist(), rows.event[i].tolist(), strict=True),
    ]
    values = {"t": rows.t[i], "delta": rows.delta[i], "force": rows.force[i], "work": rows.work[i]}
    largest = {name: np.zeros(len(scene.system.contacts)) for name in values}
    for name, row in values.items():
        np.maximum.at(largest[name], contact, np.abs(row))
    log = solution.contacts
    np.maximum.at(largest["force"], np.asarray(log.stop, dtype=int), np.abs(log.peak_force))  # it opens at zero
    largest["work"] = np.maximum(largest["work"], largest["force"] * largest["delta"])
    spacing = duration / (1.0 + np.bincount(contact, minlength=len(scene.system.contacts)))
    for name, row in values.items():
        found[f"border {name}"] = row
        scale = spacing if name == "t" else largest[name]
        found["scale"][f"border {name}"] = np.maximum(scale[contact], 1e-300)
    return found


def judge(seed: int) -> list[tuple[str, Verdict, int]]:
    """Draw, run and compare, at every tolerance."""
    scene, found = draw(seed), []
    with warnings.catch_warnings(), np.errstate(over="ignore"):
        warnings.simplefilter("error", RuntimeWarning)
        try:
            known = references(shortened(scene))
        except (TooStiffError, SolverError):
            known = None, None
        count = len(known[0].transitions) if known[0] is not None else 0
        for rtol in TOLERANCES:
            words = f"seed {seed} rtol {rtol:g}: {scene.words}"
            found.append((words, against(scene, *known, rtol, seed, numbers, disturbed), count))
    return found


def main(count: int = 500, first: int = 0, processes: int = 2) -> int:
    """Run and print; returns the number of failures."""
    kinds: Counter[str] = Counter()
    errors: dict[str, list[float]] = {}
    transitions = 0
    with ProcessPoolExecutor(processes) as pool:
        for i, verdicts in enumerate(pool.map(judge, range(first, first + count), chunksize=2)):
            for words, verdict, met in verdicts:
                passed = verdict.kind in ("fine", "ill-conditioned", "the reference failed")
                kinds[verdict.kind if passed else "failures"] += 1
                transitions += met if verdict.kind == "fine" else 0
                if not passed:
                    print(f"{words}\n    {verdict.kind[:400]}", flush=True)
                for name, error in verdict.errors.items():
                    errors.setdefault(name, []).append(error)
            if i % 100 == 99:
                print(f"... {i + 1}: {dict(kinds)}", flush=True)
    print(f"{count} systems at {len(TOLERANCES)} tolerances, {transitions} transitions compared: {dict(kinds)}")
    for name, values in errors.items():
        at = np.quantile(values, [0.5, 0.99, 1.0])
        print(f"  {name:17s} error in units of rtol × amplification: median {at[0]:.2g}, 99 % {at[1]:.3g}, {at[2]:.3g}")
    return kinds["failures"]


if __name__ == "__main__":
    sys.exit(main(*(int(x) for x in sys.argv[1:])) > 0)
