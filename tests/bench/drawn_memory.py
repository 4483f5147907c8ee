"""Random systems whose elements have memory, for `random_memory.py`: laws, places, loads and starts of every kind."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from drawn import Scene, Table, draw_law, draw_signal
from drawn_starts import on_a_border
from drawn_wider import reached, widened

import fembeam as fb
from contacts import KelvinVoigt, Polynomial
from contacts.memory import BoucWen, Coulomb, ElastoPlastic, Iwan, Jenkins, WaltonBraun
from solvers import Contact, System

RTOLS = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)


def draw_memory(rng: np.random.Generator, mass: float, speed: float, low: float) -> Any:
    """A law with memory, stiffer or softer than the structure, that lets go in some or most of the motion."""
    k = mass * (low * 10.0 ** rng.uniform(-0.3, 1.0)) ** 2
    limit = k * speed / low * 10.0 ** rng.uniform(-1.5, 0.0) * min(1.0, mass * low**2 / k) ** 0.5
    knee, many = limit / k, int(rng.integers(2, 6))
    kinds: list[Callable[[], Any]] = [
        lambda: Jenkins(k, limit),
        lambda: Coulomb(limit, k, damping=rng.uniform(0.1, 2.0) * np.sqrt(k * mass)),
        lambda: Coulomb(limit, k, rng.uniform(1.05, 1.5) * limit, rng.uniform(0.5, 2.0) * np.sqrt(k * mass)),
        lambda: Iwan(rng.uniform(0.2, 1.0, 3) * k, rng.uniform(0.05, 1.0, 3) * limit),
        lambda: Iwan([k / many] * many, [limit / many] * many),  # all let go together
        lambda: Iwan.uniform(k, limit, many),
        lambda: ElastoPlastic(k, limit, rng.choice([0.0, rng.uniform(0.0, 0.5)]) * k),
        lambda: _bouc_wen(rng, k, knee, 1),
        lambda: _bouc_wen(rng, k, knee, 2),
    ]
    return kinds[rng.integers(len(kinds))]()


def _bouc_wen(rng: np.random.Generator, k: float, knee: float, n: int) -> BoucWen:
    """Softening hysteresis that saturates at the knee, with γ of either sign."""
    beta = rng.uniform(0.3, 1.4) / knee**n
    return BoucWen(k, rng.uniform(0.0, 0.5), 1.0, beta, knee**-n - beta, n)


def draw_yielding(rng: np.random.Generator, row: Any, mass: float, size: float, low: float) -> Contact:
    """A yielding stop at a gap, at none or pressed, that unloads along nearly the same or a much steeper line."""
    loading = mass * (low * 10.0 ** rng.uniform(0.3, 1.5)) ** 2
    kind = "kept" if rng.random() < 0.5 else "forgotten"
    gap = size * rng.choice([0.0, rng.uniform(0.05, 0.6), -rng.uniform(0.0, 0.1), -rng.uniform(0.1, 1.0)])
    ratio = rng.choice([1.0 + 10.0 ** rng.uniform(-4.0, -1.0), rng.uniform(1.0, 6.0), rng.uniform(6.0, 40.0)])
    return Contact(row, WaltonBraun(loading, loading * ratio, kind), gap)


def draw_element(rng: np.random.Generator, row: Any, speed: float, low: float) -> Contact:
    """An element that always acts, most with memory, or a yielding stop."""
    mass, size = 1.0 / (row @ row), speed / low
    if rng.random() < 0.2:
        return draw_yielding(rng, row, mass, size, low)
    others: list[Callable[[], Any]] = [
        lambda: KelvinVoigt(rng.uniform(0.0, 1.0) * mass * low**2, rng.uniform(0.0, 0.1) * mass * low),
        lambda: Polynomial([0.0, 0.0, rng.uniform(0.1, 2.0) * mass * (low / size) ** 2]),
        lambda: draw_memory(rng, mass, speed, low),
    ]
    law = others[rng.integers(2)]() if rng.random() < 0.1 else draw_memory(rng, mass, speed, low)
    if rng.random() < 0.35:
        law = law + others[rng.integers(len(others))]()
    return Contact(row, law, size * rng.choice([0.0, rng.uniform(-0.3, 0.3)]), always=True)


def draw_row(rng: np.random.Generator, omega: Any, rows: list[Any]) -> Any:
    """A displacement, a rotation, whose shapes grow with the wave number, or what two places or one have already."""
    kind = rng.random()
    if rows and kind < 0.3:
        return rows[rng.integers(len(rows))] * rng.choice([-1.0, 1.0, rng.uniform(0.3, 3.0)])
    if len(rows) > 1 and kind < 0.4:
        apart = rows[0] - rows[1]
        if np.linalg.norm(apart) > 0.1:
            return apart
    row = rng.standard_normal(len(omega))
    if kind > 0.8:
        row *= np.sqrt(omega / omega[-1])
    return row / max(np.linalg.norm(row), 1e-3) * rng.uniform(0.5, 1.5)


def draw_load(rng: np.random.Generator, n: int, speed: float, low: float) -> tuple[Any, str]:
    """A force on all modes, or a base motion, as a tone, a sum of them, a constant, noise or a pulse."""
    size, vector, where = speed * low * 10.0 ** rng.uniform(-0.5, 0.3), rng.standard_normal(n), ""
    if rng.random() < 0.3:
        vector, where = -np.abs(vector) / np.arange(1, n + 1), "base "
    signal, kind = draw_signal(rng, size, low)
    if rng.random() < 0.2:
        signal = fb.Pulse(size, 10.0 ** rng.uniform(-0.3, 1.0) / low, rng.uniform(0.0, 5.0) / low)
        kind = "pulse"
    return (vector, signal), where + kind


def draw_contacts(rng: np.random.Generator, omega: Any, speed: float, low: float) -> list[Contact]:
    """One to four elements, and perhaps a stop."""
    rows: list[Any] = []
    for _ in range(rng.integers(1, 5)):
        rows.append(draw_row(rng, omega, rows))
    contacts = [draw_element(rng, row, speed, low) for row in rows]
    if rng.random() < 0.25:
        row = draw_row(rng, omega, [])
        time = 10.0 ** rng.uniform(-1.5, -0.3) / low
        law = draw_law(rng, 1.0 / (row @ row), speed, time)
        contacts.append(Contact(row, law, rng.uniform(0.0, 0.5) * speed / low))
    return contacts


def draw(seed: int) -> tuple[Scene, float]:
    """The system of a seed, and its tolerance."""
    rng = np.random.default_rng([seed, 22])
    n = int(rng.integers(1, 5) if rng.random() < 0.8 else rng.integers(5, 11))
    low = 10.0 ** rng.uniform(0.0, 2.0)
    omega = np.sort(low * np.concatenate(([1.0], 10.0 ** rng.uniform(0.1, 1.0 if n < 5 else 1.5, n - 1))))
    if rng.random() < 0.1:
        omega[0] = 0.0
    C = np.diag(2.0 * 10.0 ** rng.uniform(-2.5, -0.7, n) * np.maximum(omega, 0.1 * low))
    if rng.random() < 0.2:
        row = rng.standard_normal(n)
        C = C + np.outer(row, row) * low * 10.0 ** rng.uniform(-2.0, -0.5)
    speed = 10.0 ** rng.uniform(-2.0, 0.5)
    contacts = draw_contacts(rng, np.maximum(omega, 0.1 * low), speed, low)
    loads = [draw_load(rng, n, speed, low) for _ in range(rng.integers(0, 3))]
    q0, q_dot0 = speed / low * rng.standard_normal(n), speed * rng.standard_normal(n)
    if loads and rng.random() < 0.3:
        q0, q_dot0 = np.zeros(n), np.zeros(n)
    rtol = float(rng.choice(RTOLS))
    kinds = " ".join(kind for _, kind in loads)
    words = f"rtol {rtol:g} n={n} ω=[{omega[0]:.3g}..{omega[-1]:.3g}] {kinds}"
    system = System(np.eye(n), C, np.diag(omega**2), contacts, [load for load, _ in loads])
    scene = widened(seed, Scene(system, q0, q_dot0, rng.uniform(3.0, 15.0) / low, words), speed, low, draw_memory)
    if rng.random() < 0.25:
        scene = replace(reached(scene, rng.uniform(0.5, 8.0) / low), words=scene.words + " under way")
    scene = on_a_border(seed, scene)
    laws = ", ".join(told(contact) for contact in scene.system.contacts)
    return replace(scene, words=f"{scene.words}; {laws}"), rtol


def told(contact: Contact) -> str:
    """A contact in words."""
    law: Any = contact.law
    return "+".join(getattr(part, "name", type(part).__name__) for part in getattr(law, "parts", (law,)))


def disturbed(scene: Scene, rng: np.random.Generator, by: float) -> Scene:
    """The system under small tones besides: a slider forgets how a run began, not what goes on."""
    system, n = scene.system, scene.system.size
    omega = np.sqrt(np.diag(system.K))
    times = np.linspace(0.0, scene.duration, 64)
    largest = [np.linalg.norm(np.hstack((omega**2 * scene.q0, omega * scene.q_dot0)))]
    for vector, signal in system.loads:
        values = signal.rows[:, 0] if isinstance(signal, Table) else signal(times)
        largest.append(np.abs(values).max() * np.linalg.norm(vector))
    size = by * max(largest)
    tones = [(rng.standard_normal(n), fb.Harmonic(size, w, rng.uniform(0.0, 6.0))) for w in (0.0, *omega)]
    return replace(scene, system=System(system.M, system.C, system.K, system.contacts, [*system.loads, *tones]))
