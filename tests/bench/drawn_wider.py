"""What else a user may build with laws with memory, for `drawn_memory.py`: sums with dashpots and stops, any start.

Drawn by generators of their own, so that what a seed below `WIDER_FROM` or `FASTER_FROM` stands for has stayed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from drawn import Scene, draw_law
from own_memory_laws import draw_own

import fembeam as fb
from contacts import Iwan, KelvinVoigt, Polynomial, WaltonBraun
from contacts.custom import CustomLaw
from solvers import Contact, DormandPrince, System, integrate

WIDER_FROM, FASTER_FROM = 100_000, 200_000  # the first seeds
MOST_RADIANS = 2e4  # of the fastest coordinate in a run: the reference takes a step for every fifth of a radian
LEAST_SHARE, MOST_SHARE = 1e-7, 1e-2  # of a static shape in the compliance of an element


def reached(scene: Scene, time: float) -> Scene:
    """The system begun where a run has come to after a time: stuck, slipping, yielded or pressed."""
    found = integrate(
        *(scene.system, scene.q0, scene.q_dot0, time), method=DormandPrince(1e-10), memory=scene.memory, check=False
    )
    memory = [numbers if numbers.size else None for numbers in found.memory]
    return replace(scene, q0=found.q[-1], q_dot0=found.q_dot[-1], memory=memory)


def widened_contact(rng: np.random.Generator, contact: Contact, speed: float, low: float, laws: Any) -> Contact:
    """A contact of other laws: one of a user's own, or with dashpots, stops and further laws with memory beside it."""
    mass = 1.0 / float(contact.direction @ contact.direction)
    k = mass * (low * 10.0 ** rng.uniform(-0.3, 1.2)) ** 2
    limit = k * speed / low * 10.0 ** rng.uniform(-1.5, 0.0) * min(1.0, mass * low**2 / k) ** 0.5
    if not contact.always:
        return contact
    law: Any = draw_own(rng, k, limit, speed) if rng.random() < 0.2 else contact.law
    others: list[Callable[[], Any]] = [
        lambda: KelvinVoigt(1e-6 * k, rng.uniform(0.02, 0.8) * np.sqrt(k * mass)),
        lambda: KelvinVoigt(rng.uniform(0.0, 2.0) * k, 10.0 ** rng.uniform(-3.0, 0.0) * np.sqrt(k * mass)),
        lambda: Polynomial([0.1 * k, 0.0, k * (low / speed) ** 2]),
        lambda: laws(rng, mass, speed, low),
        lambda: WaltonBraun(k, k * (1.0 + 10.0 ** rng.uniform(-1.0, 1.0)), str(rng.choice(["kept", "forgotten"]))),
        lambda: _law_of_stops(rng, mass, speed, low) if law.memory else laws(rng, mass, speed, low),
        lambda: Iwan([k, 0.3 * k], [limit, np.inf]),
        lambda: draw_own(rng, k, limit, speed),
    ]
    opens = bool(getattr(law, "opens", False))
    while rng.random() < (0.8 if opens else 0.4):
        law, opens = law + others[rng.integers(2 if opens and rng.random() < 0.6 else len(others))](), False
    return Contact(contact.direction, law, contact.gap, always=True)


def _law_of_stops(rng: np.random.Generator, mass: float, speed: float, low: float) -> Any:
    """A law of stops; none of a user's own without memory, which would act at both signs of δ and be refused."""
    law: Any = draw_law(rng, mass, speed, 10.0 ** rng.uniform(-1.5, -0.3) / low)
    return _law_of_stops(rng, mass, speed, low) if isinstance(law, CustomLaw) else law


def in_other_coordinates(rng: np.random.Generator, scene: Scene, widest: float = 0.3) -> Scene:
    """The same system in other coordinates x = T q, stretched by 10^-``widest`` to 10^``widest``: full matrices."""
    n, system = scene.system.size, scene.system
    turned = [np.linalg.qr(rng.standard_normal((n, n)))[0] for _ in range(2)]
    T = turned[0] * 10.0 ** rng.uniform(-widest, widest, n) @ turned[1]
    M, C, K = (T.T @ matrix @ T for matrix in (system.M, system.C, system.K))
    contacts = [_in_coordinates(T, contact) for contact in system.contacts]
    loads = [(T.T @ vector, signal) for vector, signal in system.loads]
    q0, q_dot0 = np.linalg.solve(T, scene.q0), np.linalg.solve(T, scene.q_dot0)
    M, C, K = (0.5 * (matrix + matrix.T) for matrix in (M, C, K))
    return replace(scene, system=System(M, C, K, contacts, loads), q0=q0, q_dot0=q_dot0)


def with_coincidences(seed: int, scene: Scene) -> Scene:
    """A scene of `drawn` with what numbers by chance do not do, in coordinates stretched by up to 1e3 to each other.

    Modes of one frequency, tones and constants that begin at 0 or a peak, at frequencies of modes, and damping of modes
    that drives by itself, beside what damps them.
    """
    rng, system, words = np.random.default_rng([seed, 26]), scene.system, scene.words
    C, K, size = system.C, system.K.copy(), system.size
    if rng.random() < 0.3:
        same = rng.random(size) < 0.5
        K[same, same] = K[size - 1, size - 1]
        words += " equal"
    omega = np.sqrt(np.linalg.eigvalsh(K).clip(0.0))
    tones = [fb.Harmonic(1.0, float(rng.choice([*omega, 0.0])), float(rng.choice([0.0, np.pi / 2]))) for _ in omega]
    loads = [
        (vector * np.abs(signal(np.linspace(0.0, scene.duration, 9))).max(), tones[rng.integers(size)])
        for vector, signal in system.loads
    ]
    row = rng.standard_normal(size)
    driven = C - np.outer(row, row) * rng.uniform(0.0, 0.3) * np.diag(C).mean() / (row @ row)
    if rng.random() < 0.3 and System(system.M, driven, K).blocks.c.min() > 0.0:
        C, words = driven, words + " driven"
    scene = replace(scene, system=System(system.M, C, K, system.contacts, loads), words=words)
    return in_other_coordinates(rng, scene, rng.uniform(0.0, 1.5)) if rng.random() < 0.7 else scene


def _in_coordinates(T: Any, contact: Contact) -> Contact:
    """A contact whose rows read coordinates x, where q = T x."""
    rows = {name: getattr(contact, name) for name in ("direction", "tangent", "rotation")}
    return replace(contact, **{name: row @ T for name, row in rows.items() if row is not None})


def with_other_start(rng: np.random.Generator, scene: Scene, time: float) -> Scene:
    """Far beyond limits, with what another run has latched, or with other rates than those under way."""
    kind = rng.random()
    if kind < 0.25:
        far = 10.0 ** rng.uniform(0.3, 1.2)
        return replace(scene, q0=far * scene.q0, q_dot0=scene.q_dot0, words=scene.words + " far")
    if kind < 0.5:
        kicked = reached(scene, time)
        return replace(kicked, q_dot0=rng.choice([-1.0, 0.0, 2.0]) * scene.q_dot0, words=scene.words + " kicked")
    if kind < 0.75:
        return replace(scene, memory=_begun_again(scene, reached(scene, time).memory), words=scene.words + " latched")
    return scene


def _begun_again(scene: Scene, memory: list[Any]) -> list[Any]:
    """What was latched with the codes of a start: sliders stick where they were held, stops are open and dented."""
    found = [None if numbers is None else numbers.copy() for numbers in memory]
    for contact, numbers in zip(scene.system.contacts, found, strict=True):
        law: Any = contact.law
        if numbers is not None:
            coded = [bool(codes) for codes in law.segment_codes]
            numbers[coded] = law.parameters[list(law.memory)][coded]
    return found


def with_static_shapes(rng: np.random.Generator, scene: Scene, speed: float, low: float) -> Scene:
    """The system with one or two more coordinates, 30 to 10 000 times as fast, as static shapes of its elements are."""
    for _ in range(rng.integers(1, 3)):
        system, omega = scene.system, low * 10.0 ** rng.uniform(1.5, 4.0)
        M, C, K = np.eye(system.size + 1), *(np.pad(matrix, (0, 1)) for matrix in (system.C, system.K))
        C[-1, -1], K[-1, -1] = 2.0 * 10.0 ** rng.uniform(-3.0, -1.0) * omega, omega**2
        contacts = [
            replace(
                contact, direction=np.append(contact.direction, _part(rng, contact.direction, system.K, omega, low))
            )
            for contact in system.contacts
        ]
        loads = [(np.append(vector, rng.standard_normal()), signal) for vector, signal in system.loads]
        q_dot = 10.0 ** rng.uniform(-3.0, 0.0) * speed * rng.choice([0.0, 1.0])
        scene = replace(
            scene,
            system=System(M, C, K, contacts, loads),
            q0=np.append(scene.q0, 0.0),
            q_dot0=np.append(scene.q_dot0, q_dot),
            duration=min(scene.duration, MOST_RADIANS / omega),
        )
    return replace(scene, words=f"{scene.words} static shapes to {omega / low:.3g}")


def _part(rng: np.random.Generator, direction: Any, K: Any, omega: float, low: float) -> float:
    """Part of a static shape in an element's direction, some share of the compliance by the other coordinates."""
    compliance = np.sum(direction**2 / np.maximum(np.diag(K), low**2))
    share = np.clip(10.0 ** rng.uniform(-1.0, 1.0) / (omega**2 * compliance), LEAST_SHARE, MOST_SHARE)
    return float(rng.choice([-1.0, 1.0]) * omega * np.sqrt(share * compliance))


def widened(seed: int, scene: Scene, speed: float, low: float, laws: Any) -> Scene:
    """The system of a seed with other laws, start and coordinates; as it is for seeds before."""
    if seed < WIDER_FROM:
        return scene
    if seed >= FASTER_FROM:
        return with_static_shapes(np.random.default_rng([seed, 24]), scene, speed, low)
    rng, system = np.random.default_rng([seed, 23]), scene.system
    contacts = [widened_contact(rng, contact, speed, low, laws) for contact in system.contacts]
    C = 0.0 * system.C if rng.random() < 0.1 else system.C
    scene = replace(scene, system=System(system.M, C, system.K, contacts, system.loads))
    scene = with_other_start(rng, scene, rng.uniform(0.5, 8.0) / low)
    return in_other_coordinates(rng, scene) if rng.random() < 0.2 else scene
