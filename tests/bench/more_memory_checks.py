"""Checks of random systems with memory beside the comparison of motions: derivatives, two parts, constant steps.

Each returns what is wrong in words, or nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from comparison import ALLOWED
from drawn import Scene

import fembeam as fb
from solvers import DormandPrince, Exponential, Newmark, System, integrate

STEPS = (1e-5, 1e-6, 1e-7)  # of differences, in units of the largest motion
SURE = 1e-5  # doubt of a difference, in units of its row, from which on a shorter step is tried
SLOWEST = 2.5  # 1/(√2 - 1): error of a difference over what two steps differ by, where it falls like √step
EVERY = 10  # of so many systems one is checked
COUNTS = (1877, 1931, 1979, 2027, 2081, 2131, 2179)  # long steps of `Newmark` in a run
CONVERGED = 1e-7  # of the largest motion: constant steps as good as that are compared no further


def more_checks(scene: Scene, rtol: float, seed: int, reference: Any) -> str:
    """All of them, each for some systems; empty if nothing is wrong."""
    checks: tuple[Callable[[], str], ...] = (
        lambda: derivative(scene, reference),
        lambda: two_parts(scene, rtol),
        lambda: constant_steps(scene, reference),
    )
    chosen = seed % EVERY
    try:
        return checks[chosen]() if chosen < len(checks) else ""
    except (RuntimeError, RuntimeWarning) as error:
        return f"check {chosen}: {type(error).__name__}: {error}"
    except ValueError as error:  # slopes that are infinite at a surface: refused in words
        return "" if "tangent is not offered" in str(error) else f"check {chosen}: {error}"


def _end(scene: Scene, method: Any, move: Any = 0.0, **more: Any) -> tuple[Any, Any]:
    """[q, q̇, latched numbers] at the end of a run from a moved start, and the run."""
    n = scene.system.size
    move = np.broadcast_to(move, 2 * n)
    begin = scene.q0 + move[:n], scene.q_dot0 + move[n:]
    run = integrate(scene.system, *begin, scene.duration, method=method, memory=scene.memory, **more)
    return np.concatenate((run.q[-1], run.q_dot[-1], *run.memory)), run


def derivative(scene: Scene, reference: Any) -> str:
    """`memory_tangent` by the start against central differences of the reference.

    Two steps, one twice the other, tell the error of the shorter one: it falls like step², from a start on a border
    like √step or faster. They tell rounding too: that of an end does not depend on what was moved, so of each row the
    largest difference counts. Each row is compared at the step that leaves the least doubt. Ends of the reference are
    off by 1e-13 of the largest of the run × the amplification, the derivative by rtol likewise. Rows are in units of
    their largest entry.
    """
    if _begins_on_jump(scene):  # the tangent is that of one side
        return ""
    n = scene.system.size
    scale = np.repeat([np.abs(reference.q).max(), np.abs(reference.q_dot).max()], n)
    if not scale.all():  # at rest all along
        return ""
    run = _end(scene, Exponential(1e-11), tangent=True)[1]
    matrix = run.tangent if run.memory_tangent is None else run.memory_tangent
    found, least, off = matrix[:, : 2 * n] * scale, np.inf, np.zeros(1)
    amplification = max(1.0, np.abs(found[: 2 * n] / scale[:, None]).max())
    largest = np.append(scale, np.abs(np.concatenate((np.zeros(0), *run.memory))))
    for step in STEPS:
        one = [_differences(scene, length * scale, scale, len(run.transitions)) for length in (step, 2.0 * step)]
        if one[0] is None or one[1] is None:
            continue  # borders come or go within the differences
        size = np.maximum(np.abs(one[0]).max(axis=1), 1e-4 * np.abs(one[0]).max())
        apart = np.abs(found[: len(size)] - one[0]).max(axis=1) / size
        doubt = SLOWEST * np.abs(one[1] - one[0]).max(axis=1) / size
        doubt += (1e-13 / step + ALLOWED * 1e-11) * amplification * largest[: len(size)] / size
        off, least = np.where(doubt < least, apart - doubt, off), np.minimum(doubt, least)
        if least.max() <= SURE:
            break
    return f"derivative off by {off.max():.2g}" if off.max() > 1e-6 else ""


def _begins_on_jump(scene: Scene) -> bool:
    """Whether a stop begins where its force jumps, as on a knot between two dashpots."""
    for contact in scene.system.contacts:
        delta, rate = (float(np.squeeze(x)) for x in contact.motion(scene.q0, scene.q_dot0)[:2])
        if contact.always or delta < -1e-12 * abs(contact.gap):
            continue
        if delta <= 1e-12 * abs(contact.gap):
            if contact.law.jump:
                return True
            continue
        below, at, above = (float(contact.law.force(delta * (1.0 + by), rate, abs(rate))) for by in (-1e-9, 0.0, 1e-9))
        if abs(above - below) > 1e-6 * max(abs(below), abs(at), abs(above)):
            return True
    return False


def _differences(scene: Scene, moves: Any, scale: Any, borders: int) -> Any:
    """Central differences of the end by the start, in units of ``scale``; None unless all runs pass so many borders."""
    columns = []
    for i, move in enumerate(moves):
        one = move * np.eye(len(moves))[i]
        ends = [_end(scene, DormandPrince(1e-13, 1e-15), side * one) for side in (1.0, -1.0)]
        if any(len(end[1].transitions) != borders for end in ends):
            return None
        columns.append((ends[0][0] - ends[1][0]) * scale[i] / (2.0 * move))
    return np.transpose(columns)


def two_parts(scene: Scene, rtol: float) -> str:
    """A run that goes on from what the first part has latched, against the whole run.

    Both are right to rtol × the amplification of the end by the start of the second part, which is told by a third run
    that begins the second part moved by √rtol.
    """
    signals = [signal for _, signal in scene.system.loads]
    plain = any(not contact.always for contact in scene.system.contacts)
    if plain or any(not isinstance(signal, fb.Harmonic) for signal in signals):
        return ""
    whole, method = _end(scene, Exponential(rtol))[0], Exponential(rtol)
    cut = 0.382 * scene.duration
    first = integrate(scene.system, scene.q0, scene.q_dot0, cut, method=method, memory=scene.memory)
    begin, system = np.concatenate((first.q[-1], first.q_dot[-1])), _later(scene.system, cut)
    n, size = scene.system.size, np.repeat([np.abs(first.q).max(), np.abs(first.q_dot).max()], scene.system.size)

    def second(move: Any) -> Any:
        x = begin + move
        rest = integrate(system, x[:n], x[n:], scene.duration - cut, method=method, memory=first.memory)
        return np.concatenate((rest.q[-1], rest.q_dot[-1]))

    found, moved = second(0.0), second(np.sqrt(rtol) * size)
    amplification = np.maximum(np.abs(moved - found) / np.sqrt(rtol), size)
    off = (np.abs(found - whole[: 2 * n]) / amplification).max() / (rtol + 1e-11)
    return f"two parts off by {off:.3g}" if off > ALLOWED else ""


def _later(system: System, time: float) -> System:
    """A system under tones, from a later time on."""
    loads = [(vector, replace(tone, phase=tone.phase + tone.omega * time)) for vector, tone in system.loads]
    return System(system.M, system.C, system.K, system.contacts, loads)


def constant_steps(scene: Scene, reference: Any) -> str:
    """`Newmark` with steps of about 1/2000 and of 1/32 000 of the run against the reference.

    Of order two, and of order one at borders: there it errs by step × chance, a number up to 1 for the place of the
    border within a step. 16 times shorter steps err by less than a quarter of the largest of seven runs whose steps
    differ a little, unless chance is below 1/4 in each, which it is once in 4⁷ times. Steps that pass other borders
    than the reference are too long to converge.
    """
    n = scene.system.size
    size = np.repeat([np.abs(reference.q).max(), np.abs(reference.q_dot).max()], n)
    exact, run = _end(scene, DormandPrince(1e-13, 1e-15))  # the last sample may lie before the end
    off = []
    for count in (*COUNTS, 32_000):
        end, found = _end(scene, Newmark(scene.duration / count))
        if len(found.transitions) != len(run.transitions):
            return ""
        off.append((np.abs((end - exact)[: 2 * n]) / size).max())
    coarse, fine = max(off[:-1]), off[-1]
    if coarse > 0.1 or fine < CONVERGED:
        return ""  # too coarse to converge yet, or converged
    return f"constant steps off by {coarse:.2g}, then by {fine:.2g}" if fine > 0.25 * coarse else ""
