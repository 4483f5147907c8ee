"""Random scenes: `Exponential` against `DormandPrince`, thousands of them; prints every failure.

    python tests/bench/random_scenes.py [count] [first seed] [rtol]

A scene has 1 to 6 modes (rigid ones, overdamped ones, dashpots that couple them), 1 to 3 stops on either side with
gap or preload, laws of every kind, loads of every kind. What a difference is worth is told by the scene itself: the
reference is run again from slightly moved starts, and the errors are taken in units of rtol × that amplification.
What is run with samples is run without, too, which flies in other steps.
Scenes whose contacts change in number already under such a move are ill-conditioned: counted, not compared.
"""

from __future__ import annotations

import math
import sys
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

import fembeam as fb
from contacts import Hertz, Hysteretic, KelvinVoigt, PiecewiseLinear, law
from solvers import Contact, DormandPrince, Exponential, SolverError, System, integrate

REFERENCE = DormandPrince(rtol=1e-13, atol=1e-15)
PATIENCE = 12  # stretches of 20 000 steps that a run of the reference may take
MOST_CONTACTS = 6
MOVE = 1e-7  # of the start, relative
SAMPLES = 16
SMOOTH, BENT = 300.0, 1e4  # errors allowed, in units of rtol × amplification; laws that bend between knots


@law(exponent=1.5)
def softening(delta, delta_dot, entry_rate, stiffness, loss, scale):
    """A user's law: Hertz with a loss, softening with depth."""
    return stiffness * delta * math.sqrt(delta) * (1.0 + loss * delta_dot / entry_rate) / (1.0 + delta / scale)


class TooStiffError(RuntimeError):
    """A run took more steps than it may."""


@dataclass
class Scene:
    """One problem and what was drawn for it."""

    system: System
    q0: Any
    q_dot0: Any
    duration: float
    words: str


@dataclass
class Verdict:
    """How the method did: kind is 'fine', 'ill-conditioned', 'the reference failed' or the failure in words."""

    kind: str
    contacts: int = 0
    error: float = math.nan  # in units of rtol × amplification
    amplification: float = math.nan


def draw_law(rng: np.random.Generator, mass: float, speed: float, time: float) -> Any:
    """A law whose contact at ``speed`` lasts about ``time``."""
    depth = speed * time / 3.0
    kind = rng.integers(9)
    floor = 1e-3 * speed
    if kind <= 2:
        p = (1.5, 1.0, 2.0, 1.2)[rng.integers(4)]
        stiffness = 0.5 * (p + 1.0) * mass * speed**2 / depth ** (p + 1.0)
        if kind == 0:
            return Hertz(stiffness, p)
        return Hysteretic(stiffness, rng.uniform(0.05, 1.2), p, clamp=kind == 2, entry_rate_floor=floor)
    stiffness = mass * (speed / depth) ** 2
    if kind <= 4:
        return KelvinVoigt(stiffness, rng.uniform(0.02, 0.8) * math.sqrt(stiffness * mass), clamp=kind == 4)
    if kind <= 6:
        count = rng.integers(1, 4)
        knots = tuple(np.sort(rng.uniform(0.05, 0.9, count)) * depth)
        return PiecewiseLinear(list(stiffness * rng.uniform(0.2, 3.0, count + 1)), knots)
    if kind == 7:
        return PiecewiseLinear([stiffness])
    hertz = 1.25 * mass * speed**2 / depth**2.5
    return softening(stiffness=hertz, loss=rng.uniform(0.0, 0.6), scale=4.0 * depth)


def draw_signal(rng: np.random.Generator, size: float, omega: float, kinds: int = 5) -> tuple[Any, str]:
    """A load of about ``size`` around the frequency ``omega``."""
    kind = rng.integers(kinds)
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
    return fb.BandNoise(size, (0.0, 3.0 * omega), seed=int(rng.integers(1 << 30)), period=200.0 / omega), "noise"


def draw(seed: int) -> Scene:
    """The scene of a seed."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 7))
    low = 10.0 ** rng.uniform(0.5, 2.5)
    omega = np.sort(low * np.concatenate(([1.0], 10.0 ** rng.uniform(0.1, 1.5, n - 1))))
    omega = np.minimum(omega, 1e4)
    rigid = rng.random() < 0.2
    if rigid:
        omega[0] = 0.0
    zeta = np.where(rng.random(n) < 0.15, rng.uniform(0.5, 1.5, n), 10.0 ** rng.uniform(-3.0, -1.0, n))
    zeta[rng.random(n) < 0.1] = 0.0
    zeta[rng.random(n) < 0.03] = 1.0
    K, C, M = np.diag(omega**2), np.diag(2 * zeta * omega), np.eye(n)
    words = f"n={n} ω=[{omega[0]:.3g}..{omega[-1]:.3g}]"
    if rng.random() < 0.25:
        row = rng.standard_normal(n)
        C = C + np.outer(row, row) * low * 10.0 ** rng.uniform(-2.0, 0.3)
        words += " coupled"
    speed = 10.0 ** rng.uniform(-2.0, 0.5)
    size = speed / low
    contacts = []
    for _ in range(rng.integers(1, 4)):
        row = rng.standard_normal(n) * (1.0 if rng.random() < 0.8 else 1e-1)
        side = (rng.random() < 0.5) * 2.0 - 1.0
        row *= side / max(np.linalg.norm(row), 1e-3)
        gap = size * rng.choice([0.0, rng.uniform(0.01, 0.7), rng.uniform(0.01, 0.7), -rng.uniform(0.001, 0.05)])
        time = 10.0 ** rng.uniform(-2.5, -0.3) / low
        contacts.append(Contact(row, draw_law(rng, 1.0 / (row @ row), speed, time), gap))
    loads = []
    for _ in range(rng.integers(0, 3)):
        signal, kind = draw_signal(rng, speed * low * 10.0 ** rng.uniform(-1.0, 0.3), low)
        loads.append((rng.standard_normal(n), signal))
        words += " " + kind
    words += " stops " + ", ".join(f"{type(c.law).__name__}(p={c.law.exponent:g}) gap {c.gap:.2g}" for c in contacts)
    q0 = size * rng.standard_normal(n) * 10.0 ** rng.uniform(-2.0, -0.5)
    q_dot0 = speed * rng.standard_normal(n)
    if rng.random() < 0.15:
        q0, q_dot0 = np.zeros(n), np.zeros(n)
    return Scene(System(M, C, K, contacts, loads), q0, q_dot0, rng.uniform(2.0, 12.0) / low, words)


def shortened(scene: Scene, seed: int) -> Scene:
    """The scene cut after a few contacts, at a random place."""
    t_in = np.sort(run(scene, DormandPrince(1e-7)).contacts.t_in)
    if len(t_in) > MOST_CONTACTS:
        rng = np.random.default_rng([seed, 1])
        scene.duration = t_in[MOST_CONTACTS - 1] + rng.random() * (t_in[MOST_CONTACTS] - t_in[MOST_CONTACTS - 1])
        if scene.duration <= 0.0:  # stops loaded from the start
            scene.duration = 0.1 * t_in[-1]
    return scene


def run(scene: Scene, method: Any, move: Any = 0.0, sampled: bool = True) -> Any:
    """One run, with the start moved by ``move``; its end only unless ``sampled``."""
    n = scene.system.size
    move = np.broadcast_to(move, 2 * n)
    left = iter(range(PATIENCE))

    def progress(_t: float) -> None:
        if next(left, None) is None:
            raise TooStiffError

    return integrate(
        *(scene.system, scene.q0 + move[:n], scene.q_dot0 + move[n:], scene.duration),
        *(scene.duration / SAMPLES if sampled else None, method),
        progress=progress,
    )


def difference(a: Any, b: Any) -> float:
    """Largest difference of coordinates and rates at the samples, in units of their largest."""
    q = np.abs(a.q - b.q).max() / max(np.abs(b.q).max(), 1e-300)
    return float(max(q, np.abs(a.q_dot - b.q_dot).max() / max(np.abs(b.q_dot).max(), 1e-300)))


def ends_apart(a: Any, b: Any) -> float:
    """The same between the ends of a run with samples and one without."""
    q = np.abs(a.q[-1] - b.q[-1]).max() / max(np.abs(a.q).max(), 1e-300)
    return float(max(q, np.abs(a.q_dot[-1] - b.q_dot[-1]).max() / max(np.abs(a.q_dot).max(), 1e-300)))


def stops_hit(solution: Any, theirs: Any) -> list[int]:
    """Stop of every contact but those that are rounding: a start at rest on the surface may count or not."""
    log = solution.contacts
    deep = ~log.floored | (log.peak_indentation > 1e-9 * np.abs(theirs.q).max())
    return sorted(log.stop[deep].tolist())


def judge(seed: int, rtol: float = 1e-8) -> tuple[Scene, Verdict]:
    """Draw, run and compare."""
    scene = draw(seed)
    try:
        scene = shortened(scene, seed)
        theirs = run(scene, REFERENCE)
    except (TooStiffError, SolverError):
        theirs = None
    try:
        ours, end = (run(scene, Exponential(rtol), sampled=sampled) for sampled in (True, False))
    except (RuntimeError, RuntimeWarning, ValueError) as error:
        return scene, Verdict(f"{type(error).__name__}: {error}")
    if theirs is None:
        return scene, Verdict("the reference failed", len(ours.contacts))
    if not (np.all(np.isfinite(ours.q)) and np.all(np.isfinite(ours.q_dot))):
        return scene, Verdict("not finite")
    rng = np.random.default_rng([seed, 2])
    n, amplification, steady = scene.system.size, 1.0, True
    sizes = np.concatenate((np.full(n, np.abs(theirs.q).max()), np.full(n, np.abs(theirs.q_dot).max())))
    for _ in range(3):
        move = MOVE * sizes * rng.choice([-1.0, 1.0], 2 * n)
        try:
            moved = run(scene, DormandPrince(1e-12), move)
        except (TooStiffError, SolverError):
            steady = False
            break
        amplification = max(amplification, difference(moved, theirs) / MOVE)
        steady &= stops_hit(moved, theirs) == stops_hit(theirs, theirs)
    same = stops_hit(ours, theirs) == stops_hit(end, theirs) == stops_hit(theirs, theirs)
    error = max(difference(ours, theirs), ends_apart(ours, end)) / (rtol * amplification)
    verdict = Verdict("fine", len(theirs.contacts), error, amplification)
    if not steady or amplification > 1e4:
        verdict.kind = "ill-conditioned"
    elif not same:
        verdict.kind = f"{len(ours.contacts)} contacts, the reference has {len(theirs.contacts)}"
    elif error > (BENT if any(getattr(c.law, "clamp", False) for c in scene.system.contacts) else SMOOTH):
        verdict.kind = f"error {error:.3g} rtol"
    return scene, verdict


def main(count: int = 1000, first: int = 0, rtol: float = 1e-8) -> int:
    """Run and print; returns the number of failures."""
    failures, ill, errors = 0, 0, []
    for seed in range(first, first + count):
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            scene, verdict = judge(seed, rtol)
        if verdict.kind in ("ill-conditioned", "the reference failed"):
            ill += 1
        elif verdict.kind != "fine":
            failures += 1
            print(f"seed {seed}: {verdict.kind}; {scene.words}", flush=True)
        else:
            errors.append(verdict.error)
        if seed % 200 == 199 and errors:
            print(
                f"... {seed + 1 - first} done, {failures} failures, {ill} ill, largest error {max(errors):.3g}",
                flush=True,
            )
    print(
        f"{count} scenes: {failures} failures, {ill} ill-conditioned; error in units of rtol × amplification: "
        f"median {np.median(errors):.3g}, 99 % {np.quantile(errors, 0.99):.3g}, largest {max(errors):.3g}"
    )
    return failures


if __name__ == "__main__":
    numbers = [float(x) for x in sys.argv[1:]]
    sys.exit(main(*(int(x) for x in numbers[:2]), *numbers[2:]) > 0)
