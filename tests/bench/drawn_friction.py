"""Random systems in two planes for `random_friction.py`: holes, posts, oblique stops, and what is beside them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from drawn import Scene, draw_law, draw_sampled_signal, draw_signal
from drawn_memory import draw_memory
from drawn_wider import in_other_coordinates, reached

from contacts import KelvinVoigt, Polynomial
from contacts.memory import Jenkins
from solvers import Contact, Friction, System

RTOLS = (1e-5, 1e-6, 1e-7, 1e-8, 1e-8, 1e-9, 1e-10, 1e-11)
STARTS = ("open", "open", "open", "under way", "pressed", "at rest")
SHALLOW = 8.0  # clearance in units of what a place can indent, at least: it shall not come to the centre of a post


@dataclass
class Drawer:
    """What the elements of one system have in common: x modes, y modes, then a rotation of its own or none."""

    rng: np.random.Generator
    modes: int
    turns: bool
    low: float
    speed: float

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return 2 * self.modes + int(self.turns)

    def plane(self, y: bool) -> Any:
        """(n,) a place's displacement in one plane."""
        row = np.zeros(self.size)
        own = self.rng.standard_normal(self.modes) + np.sign(self.rng.standard_normal())
        row[self.modes * int(y) :][: self.modes] = own / np.linalg.norm(own) * self.rng.uniform(0.6, 1.4)
        return row

    def place(self) -> Any:
        """(2, n) a place's displacements: of one shape in both planes, of two, or of planes that are mixed."""
        x, y = self.plane(False), self.plane(True)
        kind = self.rng.random()
        if kind < 0.5:
            y[self.modes : 2 * self.modes] = x[: self.modes]
        elif kind < 0.7:
            x, y = x + 0.3 * self.rng.standard_normal(self.size), y + 0.3 * self.rng.standard_normal(self.size)
        return np.stack((x, y))

    def law(self, row: Any, time: float) -> Any:
        """A law without memory of either kind."""
        mass = 1.0 / float(row @ row)
        if self.rng.random() < 0.1:
            depth = self.speed * time / 3.0
            k = mass * (self.speed / depth) ** 2
            return Polynomial([[k, 0.0, k / depth**2], [0.0, k / depth]][self.rng.integers(2)])
        return draw_law(self.rng, mass, self.speed, time)

    def friction(self, row: Any, time: float) -> Friction:
        """Small and large μ, springs much softer or stiffer than the contact."""
        mu = self.rng.choice([0.0, *10.0 ** self.rng.uniform([-3.0, -1.0, -1.0, 0.0], [-1.0, 0.0, 0.0, 1.0])])
        k = 9.0 / (row @ row) / time**2
        softer = self.rng.choice([self.rng.uniform(-1, 0.5), self.rng.uniform(-3, 2)])
        return Friction(float(mu), float(k * 10.0**softer))

    def time(self) -> float:
        """How long a contact lasts."""
        return float(10.0 ** self.rng.uniform(-2.3, -0.3) / self.low)

    def gap(self) -> float:
        """A clearance of the size of the motion, or less."""
        share = self.rng.choice([self.rng.uniform(0.02, 1.0), 10.0 ** self.rng.uniform(-2, 0)])
        return float(self.speed / self.low * share)

    def annulus(self) -> Contact:
        """A hole or a post, with friction or without."""
        rows, time, outer = self.place(), self.time(), bool(self.rng.random() < 0.3)
        law = self.law(rows[0], time)
        gap = max(self.gap(), SHALLOW * self.speed * time if outer else 0.0)
        angle, away = self.rng.uniform(0.0, 2.0 * math.pi), gap * self.rng.choice([0.0, self.rng.uniform(0.0, 0.6)])
        if outer:
            away = gap + self.gap()
        more: dict[str, Any] = {"map": "annulus", "outer": outer}
        more["centre"] = (away * math.cos(angle), away * math.sin(angle))
        if self.rng.random() < 0.75:
            more["friction"] = self.friction(rows[0], time)
            radius = gap * 10.0 ** self.rng.uniform(-0.5, 1.0)
            if self.turns or self.rng.random() < 0.3:
                turned = np.zeros(self.size)
                turned[-1] = self.rng.uniform(0.5, 2.0)
                if not self.turns:
                    turned = self.rng.standard_normal(self.size) * 0.3
                more |= {"rotation": turned / radius, "radius": radius}
            if self.rng.random() < 0.4:
                more |= {
                    "spin": self.speed * self.rng.normal() * 10.0 ** self.rng.uniform(-1, 0.7) / radius,
                    "radius": radius,
                }
        return Contact(rows, law, gap, **more)

    def oblique(self) -> Contact:
        """A stop on a line of any direction, with friction along it."""
        rows, time, angle = self.place(), self.time(), self.rng.uniform(0.0, 2.0 * math.pi)
        row = rows[0] * math.cos(angle) + rows[1] * math.sin(angle)
        tangent = rows[1] * math.cos(angle) - rows[0] * math.sin(angle)
        gap = self.gap() * self.rng.choice([1.0, 1.0, 0.0, -0.3])
        return Contact(row, self.law(row, time), gap, map="oblique", tangent=tangent, friction=self.friction(row, time))

    def scalar(self) -> Contact:
        """A stop on a line without friction."""
        row = self.plane(bool(self.rng.random() < 0.5)) * self.rng.choice([-1.0, 1.0])
        return Contact(row, self.law(row, self.time()), self.gap())

    def beside(self, others: list[Contact]) -> Contact:
        """A spring or a slider that always acts, on a row of an element that is there."""
        row = np.atleast_2d(others[0].direction)[0] * self.rng.choice([-1.0, 1.0, self.rng.uniform(0.3, 2.0)])
        mass, kind = 1.0 / float(row @ row), self.rng.random()
        k = mass * (self.low * 10.0 ** self.rng.uniform(-0.3, 1.0)) ** 2
        if kind < 0.4:
            return Contact(row, KelvinVoigt(k, self.rng.uniform(0.0, 0.1) * math.sqrt(k * mass)), always=True)
        if kind < 0.8:
            limit = k * self.speed / self.low * 10.0 ** self.rng.uniform(-1.5, 0.0)
            return Contact(row, Jenkins(k, limit), always=True)
        return Contact(row, draw_memory(self.rng, mass, self.speed, self.low), always=True)

    def loads(self, duration: float) -> tuple[list[Any], str]:
        """None to three, tones, constants, sampled ones."""
        found, words = [], ""
        for _ in range(self.rng.choice([0, 1, 1, 2, 3])):
            size = self.speed * self.low * 10.0 ** self.rng.uniform(-1.0, 0.5)
            if self.rng.random() < 0.25:
                signal, kind = draw_sampled_signal(self.rng, size, self.low, duration)
            else:
                signal, kind = draw_signal(self.rng, size, self.low)
            found.append((self.rng.standard_normal(self.size), signal))
            words += " " + kind
        return found, words


def draw_damping(draw: Drawer, omega: Any) -> Any:
    """(n, n) C: modal, none, or with a dashpot between coordinates."""
    rng, n = draw.rng, draw.size
    zeta = np.where(rng.random(n) < 0.1, 0.0, 10.0 ** rng.uniform(-3.0, -1.0, n)) * rng.choice([0.0, 1.0, 1.0, 1.0])
    C = np.diag(2.0 * zeta * omega)
    if rng.random() < 0.15:
        row = rng.standard_normal(n)
        C = C + np.outer(row, row) * draw.low * 10.0 ** rng.uniform(-2.0, -0.3)
    return C


def draw_frequencies(draw: Drawer) -> Any:
    """(n,) up to 1:100; the same in both planes, or not; a rotation that may be free."""
    rng, m = draw.rng, draw.modes
    widest = rng.choice([1.0, 2.0])
    x, y = (draw.low * np.sort(np.concatenate(([1.0], 10.0 ** rng.uniform(0.1, widest, m - 1)))) for _ in range(2))
    own = [x, x if rng.random() < 0.5 else y * rng.uniform(0.7, 1.4)]
    if draw.turns:
        own.append(np.array([draw.low * rng.choice([0.0, 10.0 ** rng.uniform(-0.3, 1.0)])]))
    omega = np.concatenate(own)
    if rng.random() < 0.1:
        omega[0] = 0.0
    return omega


def placed(draw: Drawer, contacts: list[Contact], q: Any, pressed: bool) -> Any:
    """The coordinates moved until annuli and stops are open, or until one of them is pressed a little."""
    for contact in [c for c in contacts if c.map != "line" or c.friction] * 20:
        deep = 0.05 * contact.gap if contact.map == "annulus" else 0.05 * draw.speed / draw.low
        wanted = deep if pressed and contact is contacts[0] else -deep
        now = float(contact.indentation(q))
        if (now > wanted) if wanted < 0.0 else abs(now - wanted) > 1e-3 * deep:
            q = q + _step(contact, q, wanted - now)
    return q


def _step(contact: Contact, q: Any, by: float) -> Any:
    """Change of coordinates by which the indentation changes so much."""
    slope = -contact.direction
    if contact.map == "annulus":
        d = contact.direction @ q - contact.centre
        d = d if np.any(d) else np.array([1.0, 0.0])
        slope = (-d if contact.outer else d) / np.linalg.norm(d) @ contact.direction
    return by * slope / (slope @ slope)


def draw(seed: int) -> tuple[Scene, float]:
    """The system of a seed, and its tolerance."""
    rng = np.random.default_rng([seed, 35])
    draw = Drawer(
        rng,
        int(rng.integers(1, 5)),
        bool(rng.random() < 0.4),
        10.0 ** rng.uniform(0.0, 2.5),
        10.0 ** rng.uniform(-2, 0.5),
    )
    omega = draw_frequencies(draw)
    kinds: list[Callable[[], Contact]] = [draw.annulus, draw.annulus, draw.oblique, draw.oblique, draw.scalar]
    contacts = [kinds[rng.integers(4)]()]
    while len(contacts) < 3 and rng.random() < 0.35:
        contacts.append(draw.beside(contacts) if rng.random() < 0.4 else kinds[rng.integers(5)]())
    duration = rng.uniform(2.0, 10.0) / draw.low
    loads, words = draw.loads(duration)
    system = System(np.eye(draw.size), draw_damping(draw, omega), np.diag(omega**2), contacts, loads)
    start = str(rng.choice(STARTS))
    rest = start == "at rest" and bool(loads)
    q0 = 0.3 * draw.speed / draw.low * rng.standard_normal(draw.size) * (0.0 if rest else 1.0)
    q0 = placed(draw, contacts, q0, start == "pressed")
    q_dot0 = draw.speed * rng.standard_normal(draw.size) * (0.0 if rest else 1.0)
    scene = Scene(system, q0, q_dot0, duration, "")
    if rng.random() < 0.25:
        scene, words = in_other_coordinates(rng, scene), words + " full"
    if start == "under way":
        scene = reached(scene, rng.uniform(0.2, 2.0) / draw.low)
    rtol = float(rng.choice(RTOLS))
    words = f"rtol {rtol:g} {draw.modes} modes a plane ω=[{omega.min():.3g}..{omega.max():.3g}]{words} {start}; "
    return replace(scene, words=words + ", ".join(told(contact) for contact in contacts)), rtol


def told(contact: Contact) -> str:
    """An element in words."""
    law: Any = contact.law if contact.friction is None else contact.law.law  # type: ignore[attr-defined]
    cut = " cut" if getattr(law, "clamp", False) else ""
    kind = f"{contact.map}{' outer' if contact.outer else ''} {type(law).__name__}(p={law.exponent:g}{cut})"
    if contact.friction is None:
        return kind
    turns = f"{' turns' if contact.rotation is not None else ''}{' spins' if contact.spin else ''}"
    return f"{kind} μ={contact.friction.mu:.2g}{turns}"
