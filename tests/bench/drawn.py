"""Random scenes for `random_scenes.py`: systems, starts and durations of every kind a user can build."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from drawn_slow import Table, draw_slow, draw_stiff
from drawn_starts import on_a_border
from scipy.optimize import brentq

import fembeam as fb
from contacts import PUBLISHED, Hertz, Hysteretic, KelvinVoigt, PiecewiseLinear, Tabulated, Viscoelastic, law
from solvers import Contact, System

# First seeds of the kinds; what one below stands for has stayed.
SAMPLED_FROM, RESTING_FROM, SLOW_FROM = 100_000, 200_000_000, 300_000_000
FOLLOWING_FROM, STRUCK_FROM = 800_000_000, 900_000_000  # behind those of `random_scenes.COINCIDING_FROM`


@law(exponent=1.5)
def softening(delta, delta_dot, entry_rate, stiffness, loss, scale):
    """A user's law: Hertz with a loss, softening with depth."""
    return stiffness * delta * math.sqrt(delta) * (1.0 + loss * delta_dot / entry_rate) / (1.0 + delta / scale)


@dataclass
class Scene:
    """One problem and what was drawn for it."""

    system: System
    q0: Any
    q_dot0: Any
    duration: float
    words: str
    parts: int = 1  # groups of as many coordinates each that may influence each other little
    memory: Any = None  # what the laws have latched at the start, as `integrate` takes it
    kept: Any = None  # (rows, 2n) of what a start moved a little keeps, as δ of one that is on a border


def draw_law(rng: np.random.Generator, mass: float, speed: float, time: float) -> Any:
    """A law whose contact at ``speed`` lasts about ``time``."""
    depth = speed * time / 3.0
    floor = 1e-3 * speed
    p = (1.5, 1.0, 2.0, 1.2)[rng.integers(4)]
    power = 0.5 * (p + 1.0) * mass * speed**2 / depth ** (p + 1.0)
    hertz = 1.25 * mass * speed**2 / depth**2.5
    stiffness = mass * (speed / depth) ** 2
    e, clamp = rng.uniform(0.3, 0.95), bool(rng.random() < 0.4)
    options = {"clamp": clamp, "entry_rate_floor": floor}
    kinds: list[Callable[[], Any]] = [
        lambda: Hertz(power, p),
        lambda: Hysteretic(power, rng.uniform(0.05, 1.2), p, **options),
        lambda: getattr(Hysteretic, str(rng.choice(PUBLISHED)))(hertz, e, **options),
        lambda: KelvinVoigt(stiffness, rng.uniform(0.02, 0.8) * math.sqrt(stiffness * mass), clamp),
        lambda: Viscoelastic.tsuji(hertz, e, mass, clamp=clamp),
        lambda: Viscoelastic.jankowski(hertz, e, mass),
        lambda: _polyline(rng, stiffness, depth),
        lambda: PiecewiseLinear([stiffness]),
        lambda: softening(stiffness=hertz, loss=rng.uniform(0.0, 0.6), scale=4.0 * depth),
        lambda: _table(stiffness, depth),
        lambda: Hertz(0.5 * hertz) + KelvinVoigt(0.5 * stiffness, 0.1 * math.sqrt(stiffness * mass)),
    ]
    return kinds[rng.integers(len(kinds))]()


def _polyline(rng: np.random.Generator, stiffness: float, depth: float) -> PiecewiseLinear:
    """Up to four slopes."""
    count = rng.integers(1, 4)
    knots = tuple(np.sort(rng.uniform(0.05, 0.9, count)) * depth)
    damping = rng.choice([0.0, 0.1]) * stiffness * depth
    return PiecewiseLinear(list(stiffness * rng.uniform(0.2, 3.0, count + 1)), knots, damping)


def _table(stiffness: float, depth: float) -> Tabulated:
    """A measured curve."""
    delta = np.linspace(0.0, 3.0 * depth, 7)
    return Tabulated(delta, stiffness * delta * (0.5 + delta / depth))


def draw_signal(rng: np.random.Generator, size: float, omega: float) -> tuple[Any, str]:
    """A load of about ``size`` around the frequency ``omega``."""
    kind = rng.integers(5)
    w = omega * rng.uniform(0.3, 3.0)
    phase = rng.uniform(0, 2 * math.pi)
    if kind == 0:
        return fb.Harmonic(size, w, phase), "tone"
    if kind == 1:
        many = rng.integers(2, 6)
        return fb.Multisine(
            size / many * np.ones(many), w * rng.uniform(0.1, 2.0, many), rng.uniform(0, 6.0, many)
        ), "multisine"
    if kind == 2:
        return fb.Harmonic(size, 0.0), "constant"
    if kind == 3:
        return lambda t: size * np.sin(w * t + phase) * np.exp(-0.1 * omega * np.asarray(t)), "callable"
    return fb.BandNoise(size, (0.0, 3.0 * omega), seed=int(rng.integers(1 << 30))), "noise"


def _gap(rng: np.random.Generator, size: float) -> float:
    """A gap, none, a preload, or a strong one."""
    return size * float(
        rng.choice([0.0, rng.uniform(0.01, 0.7), rng.uniform(0.01, 0.7), -rng.uniform(0.001, 0.05), -rng.uniform(0, 1)])
    )


def draw_structure(rng: np.random.Generator) -> Scene:
    """One to six modes, rigid or overdamped ones too, dashpots that couple them, one to four stops."""
    n = int(rng.integers(1, 7))
    low = 10.0 ** rng.uniform(0.5, 2.5)
    omega = np.sort(low * np.concatenate(([1.0], 10.0 ** rng.uniform(0.1, 1.5, n - 1))))
    omega = np.minimum(omega, 1e4)
    if rng.random() < 0.2:
        omega[0] = 0.0
    zeta = np.where(rng.random(n) < 0.15, rng.uniform(0.5, 1.5, n), 10.0 ** rng.uniform(-3.0, -1.0, n))
    zeta[rng.random(n) < 0.1] = 0.0
    zeta[rng.random(n) < 0.03] = 1.0
    C, words = np.diag(2 * zeta * omega), f"n={n} ω=[{omega[0]:.3g}..{omega[-1]:.3g}]"
    if rng.random() < 0.25:
        row = rng.standard_normal(n)
        C = C + np.outer(row, row) * low * 10.0 ** rng.uniform(-2.0, 0.3)
        words += " coupled"
    speed = 10.0 ** rng.uniform(-2.0, 0.5)
    size = speed / low
    contacts, loads = [], []
    for _ in range(rng.integers(1, 5)):
        row = rng.standard_normal(n) * (1.0 if rng.random() < 0.8 else 1e-1)
        row *= rng.choice([-1.0, 1.0]) / max(np.linalg.norm(row), 1e-3)
        time = 10.0 ** rng.uniform(-2.5, -0.3) / low
        contacts.append(Contact(row, draw_law(rng, 1.0 / (row @ row), speed, time), _gap(rng, size)))
    for _ in range(rng.integers(0, 3)):
        signal, kind = draw_signal(rng, speed * low * 10.0 ** rng.uniform(-1.0, 0.3), low)
        loads.append((rng.standard_normal(n), signal))
        words += " " + kind
    q0 = size * rng.standard_normal(n) * 10.0 ** rng.uniform(-2.0, 0.2)
    q_dot0 = speed * rng.standard_normal(n)
    if rng.random() < 0.15:
        q0, q_dot0 = np.zeros(n), np.zeros(n)
    system = System(np.eye(n), C, np.diag(omega**2), contacts, loads)
    return Scene(system, q0, q_dot0, rng.uniform(2.0, 12.0) / low, words)


def draw_parts(rng: np.random.Generator) -> Scene:
    """Two to five oscillators of one or two modes, each with its own stop, coupled by a spring of 0 or 1e-12 to 1."""
    count = int(rng.integers(2, 6))
    each = int(rng.integers(1, 3))
    n = count * each
    low = 10.0 ** rng.uniform(0.5, 2.0)
    ratio = 10.0 ** rng.uniform(0.0, 2.0 if count > 2 else 3.0)
    base = low * ratio ** rng.permutation(np.linspace(0.0, 1.0, count))
    omega = np.concatenate([w * np.array([1.0, rng.uniform(2.0, 9.0)])[:each] for w in base])
    K = np.diag(omega**2)
    coupling = rng.choice([0.0, 10.0 ** rng.uniform(-12.0, 0.0)])
    speed = 10.0 ** rng.uniform(-2.0, 0.5)
    contacts, loads, kinds = [], [], ""
    for i, w in enumerate(base):
        own = np.zeros(n)
        own[i * each : (i + 1) * each] = rng.uniform(0.3, 1.0, each)
        row = own + coupling * rng.standard_normal(n) * (rng.random() < 0.5)
        time = 10.0 ** rng.uniform(-2.0, -0.3) / w
        contacts.append(Contact(row, draw_law(rng, 1.0 / (row @ row), speed, time), _gap(rng, speed / w)))
        if rng.random() < 0.6:
            signal, kind = draw_signal(rng, speed * w * 10.0 ** rng.uniform(-1.0, 0.3), w)
            kinds += " " + kind
            loads.append((own, signal))
    for i in range(count - 1):
        row = np.zeros(n)
        row[i * each], row[(i + 1) * each] = 1.0, -1.0
        K = K + coupling * low**2 * np.outer(row, row)
    C = np.diag(2.0 * 10.0 ** rng.uniform(-3.0, -1.0, n) * omega)
    speeds = speed * rng.standard_normal(n)
    words = f"parts={count}x{each} ω=[{omega.min():.3g}..{omega.max():.3g}] coupling {coupling:.2g}{kinds}"
    system = System(np.eye(n), C, K, contacts, loads)
    return Scene(system, 0.3 * speeds / omega, speeds, rng.uniform(2.0, 8.0) / low, words, count)


def draw_pair(rng: np.random.Generator) -> Scene:
    """A symmetric structure with two or four stops that mirror each other, moved (nearly) symmetrically."""
    n = int(rng.integers(2, 6))
    low = 10.0 ** rng.uniform(0.5, 2.5)
    omega = low * np.arange(1, n + 1) ** 2.0
    mirror = (-1.0) ** np.arange(n)
    row = rng.standard_normal(n)
    speed = 10.0 ** rng.uniform(-2.0, 0.5)
    time = 10.0 ** rng.uniform(-2.0, -0.3) / low
    made, gap = draw_law(rng, 1.0 / (row @ row), speed, time), abs(_gap(rng, speed / low))
    rows = [row, row * mirror]
    if rng.random() < 0.5:
        rows += [-row, -row * mirror]
    even = np.where(mirror > 0.0, 1.0, rng.choice([0.0, 10.0 ** rng.uniform(-14.0, -2.0)]))
    q0, q_dot0 = speed / omega * rng.standard_normal(n) * even, speed * rng.standard_normal(n) * even
    loads = []
    if rng.random() < 0.6:
        loads = [(rng.standard_normal(n) * even, draw_signal(rng, speed * low, low)[0])]
    zeta = 10.0 ** rng.uniform(-3.0, -1.0)
    system = System.modal(omega, zeta, [Contact(r, made, gap) for r in rows], loads)
    return Scene(system, q0, q_dot0, rng.uniform(2.0, 10.0) / low, f"pair n={n} uneven {even.min():.2g}")


def draw_sampled_signal(rng: np.random.Generator, size: float, omega: float, duration: float) -> tuple[Any, str]:
    """A load that is sampled: a record with kinks, a pulse, a step, noise, or a table whose nodes are kinks."""
    kind, h = rng.integers(5), 10.0 ** rng.uniform(-1.5, 0.0) / omega
    if kind == 0:
        count = max(8, math.ceil(duration / h) + 1)
        values = size * rng.standard_normal(count)
        return fb.Record(h * np.arange(count), values, quantity="force", interpolation="linear"), "record"
    if kind == 1:
        return fb.Pulse(10.0 * size, 0.3 * h, rng.uniform(0.0, 0.8) * duration), "pulse"
    if kind == 2:
        return fb.Step(size, h, rng.uniform(0.0, 0.8) * duration), "step"
    if kind == 3:
        return fb.BandNoise(size, (0.0, 1.0 / h), seed=int(rng.integers(1 << 30))), "noise"
    return Table(h, size * rng.standard_normal((math.ceil(duration / h) + 1, 3)) * 0.3 / h ** np.arange(3.0)), "table"


def draw_sampled(rng: np.random.Generator) -> Scene:
    """A beam on two pins under one to three sampled loads: dashpots on nodes of modes, a stop pressed at rest, others.

    Modes k = 1 ... n with ω ~ k² and shapes sin(kπz): the middle is a node of the even ones, a third that of others.
    """
    n, low = int(rng.integers(2, 7)), 10.0 ** rng.uniform(0.5, 2.5)
    number = np.arange(1, n + 1)
    omega, speed = low * number**2.0, 10.0 ** rng.uniform(-2.0, 0.5)
    size, duration = speed / low, rng.uniform(2.0, 8.0) / low
    C, words = np.diag(2.0 * rng.choice([0.0, 1e-17, 1e-12, 0.01]) * omega), f"pinned n={n} ω=[{low:.3g}..]"
    for z in (1 / 2, 1 / 3):
        if rng.random() < 0.6:
            row = np.sin(number * math.pi * z)
            C = C + np.outer(row, row) * low * 10.0 ** rng.uniform(-2.0, 0.5)
            words += f" dashpot at {z:.2g}"
    row = np.sin(number * math.pi * rng.choice([0.5, rng.uniform(0.1, 0.9)]))
    made = draw_law(rng, 1.0 / (row @ row), speed, 10.0 ** rng.uniform(-2.0, -0.3) / low)
    loads = []
    for _ in range(rng.integers(1, 4)):
        signal, kind = draw_sampled_signal(rng, speed * low * 10.0 ** rng.uniform(-1.0, 0.3), low, duration)
        loads.append((np.sin(number * math.pi * rng.uniform(0.1, 0.9)), signal))
        words += " " + kind
    q0, q_dot0, gap = size * rng.standard_normal(n) / number**2, speed * rng.standard_normal(n), _gap(rng, size)
    if rng.random() < 0.5:
        gap, share = -0.3 * size, row / omega**2
        depth = brentq(lambda d: d + gap + row @ share * float(made.force(d, 0.0, speed)), 0.0, -gap)
        q0, q_dot0, words = share * float(made.force(depth, 0.0, speed)), np.zeros(n), words + " at rest"
    return Scene(System(np.eye(n), C, np.diag(omega**2), [Contact(row, made, gap)], loads), q0, q_dot0, duration, words)


def draw_resting(rng: np.random.Generator) -> Scene:
    """A mass, free but for gravity, and up to three modes that it pulls along: it falls, lies, is pushed by loads.

    Its stop has no gap or a small one; there may be a second one that is pressed. Loads may come in pairs that cancel
    but for rounding.
    """
    n, low, speed = int(rng.integers(1, 5)), 10.0 ** rng.uniform(0.5, 2.0), 10.0 ** rng.uniform(-2.0, 0.5)
    omega = low * np.concatenate(([0.0], 10.0 ** rng.uniform(0.0, 1.3, n - 1)))
    size, gravity, words = speed / low, -speed * low * 10.0 ** rng.uniform(-1.0, 0.5), f"n={n} weight"
    down, C = np.concatenate(([1.0], rng.uniform(-0.5, 0.5, n - 1))), np.diag(0.02 * omega)
    time = 10.0 ** rng.uniform(-2.0, -0.5) / low
    gap = size * float(rng.choice([0.0, 0.0, rng.uniform(0.0, 0.3)]))
    contacts, loads = [Contact(down, draw_law(rng, 1.0, speed, time), gap)], [(gravity * down, fb.Harmonic(1.0, 0.0))]
    if n > 1 and rng.random() < 0.5:
        row = np.concatenate(([0.0], rng.standard_normal(n - 1)))
        contacts.append(Contact(row, draw_law(rng, 1.0 / (row @ row), speed, time), -size * rng.uniform(0.0, 0.5)))
    for _ in range(rng.integers(0, 3)):
        signal, kind = draw_signal(rng, speed * low * 10.0 ** rng.uniform(-1.5, 0.3), low)
        row, angle = rng.standard_normal(n), rng.uniform(0.0, 2.0 * math.pi)
        alone = rng.random() < 0.5
        loads.append((row if alone else math.cos(angle) * row, signal))
        if not alone:
            loads.append((math.sin(angle - 0.5 * math.pi) * row, signal))
        words += f" {kind}" if alone else f" {kind} cancelled"
    q0, q_dot0 = np.zeros(n), np.zeros(n)
    if rng.random() < 0.7:
        q0[0], q_dot0[0] = rng.choice([0.0, rng.uniform(0.0, size)]), speed * rng.choice([0.0, rng.standard_normal()])
    system = System(np.eye(n), C, np.diag(omega**2), contacts, loads)
    return Scene(system, q0, q_dot0, rng.uniform(2.0, 10.0) / low, words)


def draw(seed: int) -> tuple[Scene, float]:
    """The scene of a seed and the tolerance to run it with; kinds go by its range, see `random_scenes`."""
    rng = np.random.default_rng(seed)
    kind = (draw_structure, draw_structure, draw_parts, draw_pair)[rng.integers(4)]
    kind = draw_resting if seed >= RESTING_FROM else draw_sampled if seed >= SAMPLED_FROM else kind
    kind = draw_slow if seed >= SLOW_FROM else kind
    kind = partial(draw_stiff, moved=seed < STRUCK_FROM) if seed >= FOLLOWING_FROM else kind
    rtol = float(rng.choice([1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-8, 1e-9, 1e-10, 1e-11]))
    scene = kind(rng)
    if seed < RESTING_FROM:  # others lie on their surfaces by themselves
        scene = on_a_border(seed, scene)
    laws = ", ".join(_told(c) for c in scene.system.contacts)
    scene.words = f"rtol {rtol:g} {scene.words}; stops {laws}"
    return scene, rtol


def _told(contact: Contact) -> str:
    """A stop in words."""
    made: Any = contact.law
    cut = " cut" if getattr(made, "clamp", False) else ""
    return f"{type(made).__name__}(p={made.exponent:g}{cut}) gap {contact.gap:.2g}"
