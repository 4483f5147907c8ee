"""Starts exactly on a border of a law, and forces that jump at a knot, for `drawn.py` and `drawn_memory.py`.

Drawn by a generator of its own, so that what a seed below `FROM` stands for has stayed.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from contacts import KelvinVoigt, PiecewiseLinear
from contacts.sums import parts_of
from solvers import Contact, System

FROM = 200_000  # the first seed


def on_a_border(seed: int, scene: Any) -> Any:
    """The scene of a seed with stops whose dashpots begin at knots, begun on a border; as it is for seeds before."""
    if seed < FROM:
        return scene
    rng, system = np.random.default_rng([seed, 24]), scene.system
    speed = float(np.abs(scene.q_dot0).max())
    contacts = [_with_branches(rng, contact, speed) for contact in system.contacts]
    scene = replace(scene, system=System(system.M, system.C, system.K, contacts, system.loads))
    return scene if scene.memory is not None else _placed(rng, scene)


def _with_branches(rng: np.random.Generator, contact: Contact, speed: float) -> Contact:
    """A stop of Kelvin and Voigt as one of two or three branches, each with its own slope and dashpot, or with none."""
    law: Any = contact.law
    if not isinstance(law, KelvinVoigt) or contact.always or law.clamp:
        return contact
    count = int(rng.integers(2, 4))
    depth = (speed + 1e-3) / np.sqrt(law.stiffness * (contact.direction @ contact.direction))
    knots = np.sort(rng.uniform(0.05, 1.2, count - 1)) * depth
    dashpots = law.damping * rng.choice([0.0, 0.3, 1.0], count)
    return replace(contact, law=PiecewiseLinear(law.stiffness * rng.uniform(0.3, 2.0, count), tuple(knots), dashpots))


def _placed(rng: np.random.Generator, scene: Any) -> Any:
    """A start with one contact at δ = 0, a knot or a limit, to rounding; at its rate, at the opposite or at rest."""
    contacts, q0, q_dot0 = scene.system.contacts, scene.q0, scene.q_dot0
    contact = contacts[rng.integers(len(contacts))]
    row, at = contact.direction, rng.choice([0.0, 0.0, *_places(contact.law)])
    for _ in range(2):  # the second time takes back the first one's rounding
        q0 = q0 + row * (-row @ q0 - contact.gap - at) / (row @ row)
    kept, kind = np.array([np.append(row, 0.0 * row), np.append(0.0 * row, row)]), rng.random()
    if kind < 0.2:
        q_dot0 = q_dot0 - row * (row @ q_dot0) / (row @ row)
    elif kind < 0.5:
        q_dot0 = -q_dot0
    words = f"{scene.words}; begun at {at:.3g}"
    return replace(scene, q0=q0, q_dot0=q_dot0, kept=kept if kind < 0.2 else kept[:1], words=words)


def _places(law: Any) -> list[float]:
    """Indentations at which a law at rest bends, or a slider lets go."""
    found = list(law.knots)
    for part in parts_of(law):
        for k, _, f, _ in getattr(part, "sliders", ()):
            found += [f / k, -f / k] if np.isfinite(f) else []
    return found
