"""Checks of random systems with memory beside the comparison of motions: derivatives, two parts, constant steps.

Each returns what is wrong in words, or nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from drawn import Scene
from random_scenes import ALLOWED

import fembeam as fb
from solvers import DormandPrince, Exponential, Newmark, System, integrate

STEP = 1e-5  # of differences, in units of the largest motion
EVERY = 10  # of so many systems one is checked
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
    """`memory_tangent` by the start against central differences of the reference, with two steps.

    Two steps differ by their errors of the second order, three times that of the shorter one; ends of the reference are
    off by 1e-13 of the largest of the run × the amplification, the derivative by rtol likewise. Rows are compared in
    units of their largest entry.
    """
    n = scene.system.size
    scale = np.repeat([np.abs(reference.q).max(), np.abs(reference.q_dot).max()], n)
    run = _end(scene, Exponential(1e-11), tangent=True)[1]
    matrix = run.tangent if run.memory_tangent is None else run.memory_tangent
    found, one = matrix[:, : 2 * n] * scale, []
    for step in (STEP, 2.0 * STEP):
        moved = [
            [_end(scene, DormandPrince(1e-13, 1e-15), side * step * scale * e) for side in (1.0, -1.0)]
            for e in np.eye(2 * n)
        ]
        if any(len(end[1].transitions) != len(run.transitions) for ends in moved for end in ends):
            return ""  # borders come or go within the differences
        one.append(np.transpose([(ends[0][0] - ends[1][0]) / (2.0 * step) for ends in moved]))
    found = found[: len(one[0])]
    size = np.maximum(np.abs(one[0]).max(axis=1, keepdims=True), 1e-4 * np.abs(one[0]).max())
    doubt = np.abs(one[1] - one[0]) / size
    amplification = max(1.0, np.abs(found[: 2 * n] / scale[:, None]).max())
    largest = np.append(scale, np.abs(np.concatenate((np.zeros(0), *run.memory))))[:, None]
    off = np.abs(found - one[0]) / size - doubt - (1e-13 / STEP + ALLOWED * 1e-11) * amplification * largest / size
    return f"derivative off by {off.max():.2g}" if off.max() > 1e-6 else ""


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
    """`Newmark` with steps of 1/2000 and 1/32 000 of the run against the reference.

    Of order two, and of order one at borders, whose places within a step come by chance: a step 16 times shorter errs
    16 times less, times a factor of chance below 4.
    """
    n = scene.system.size
    size = np.repeat([np.abs(reference.q).max(), np.abs(reference.q_dot).max()], n)
    exact = _end(scene, DormandPrince(1e-13, 1e-15))[0][: 2 * n]  # the last sample may lie before the end
    off = [
        (np.abs(_end(scene, Newmark(scene.duration / count))[0][: 2 * n] - exact) / size).max()
        for count in (2000, 32_000)
    ]
    if off[0] > 0.1 or off[1] < CONVERGED:
        return ""  # too coarse to converge yet, or converged
    return f"constant steps off by {off[0]:.2g}, then by {off[1]:.2g}" if off[1] > 0.25 * off[0] else ""
