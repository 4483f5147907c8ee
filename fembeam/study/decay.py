"""How long a structure remembers: the time constant of its slowest decay, of friction by equivalent linearisation.

A structure damped in every mode decays at least as fast as its modes. Else the dashpots among its elements count, with
their sliders stuck and with them slipping, the slower of both. Where only friction or yielding damps a mode, the decay
depends on the amplitude: the elements are replaced by springs and dashpots that lose the same in a cycle
(`study.equivalent`), as large as the motion of a pilot run at each element, and twice as large: what slips far decays
slowly, as W grows like X and the energy like X².
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fembeam.model import Model, Run
from fembeam.study.equivalent import harmonics

Vector = NDArray[np.float64]
PILOT = 20.0  # periods of the lowest mode that a first pilot run lasts
LASTS = 10.0  # correlation times that the last one lasts
TRIES = 8  # pilot runs, each at most so many times longer
GROWTH = 10.0
SIZES = (1.0, 2.0)  # amplitudes looked at, in those of a tone with the same rms
STUCK = 1e-9  # of an element's size: so small a motion is none


def correlation_time(model: Model, pilot: Callable[[float], Run] | None = None, longest: float = math.inf) -> float:
    """Time constant 1/min(ζω) of the slowest decay, s.

    ``pilot`` makes a run of so many seconds, ``longest`` at most; None: friction counts as no damping.
    """
    structure = _slowest(model, 0.0, 0.0)
    if structure.damped:
        return structure.time
    stuck, slipping = (_slowest(model, *found) for found in (model.linear_elements, model.slipping_elements))
    if stuck.damped and slipping.damped:
        return max(stuck.time, slipping.time)
    if pilot is not None and any(one.always and one.remembers for one in model.contact_rows):
        found = _of_friction(model, pilot, longest)
        if found.damped:
            return found.time
        raise ValueError(
            "a stationary response needs damping in every mode; friction takes nothing from one of them at this level: "
            f"its slowest decay is {found.decay:.3g} 1/s. Drive harder, or give the scene damping="
        )
    raise ValueError(
        f"a stationary response needs damping in every mode; the slowest decays at {stuck.decay:.3g} 1/s; give the "
        "scene damping=, dashpots or elements that damp"
    )


class Slowest:
    """The slowest decay of a linear structure: its rate, and the least that is more than rounding."""

    def __init__(self, decay: float, rounding: float) -> None:
        self.decay, self.damped = decay, decay > rounding
        self.time = 1.0 / decay if self.damped else math.inf


def _slowest(model: Model, stiffness: Vector | float, damping: Vector | float) -> Slowest:
    """The slowest decay with these matrices of the elements added.

    The eigenvalues are those of the state (Ωr, r'), r undamped modal coordinates: its matrix holds frequencies, not
    their squares, and so rounding (relative to the highest) stays below every decay that matters.
    """
    from scipy.linalg import eigh

    system = model.system
    square, shapes = eigh(system.K + stiffness, system.M)
    omega, rates = np.diag(np.sqrt(np.abs(square))), shapes.T @ (system.by_rate + damping) @ shapes
    A = np.block([[np.zeros_like(omega), omega], [-omega * np.sign(square), -rates]])
    decay = float((-np.linalg.eigvals(A).real).min())
    return Slowest(decay, 10.0 * len(A) * np.finfo(float).eps * float(np.abs(A).max()))


def _of_friction(model: Model, pilot: Callable[[float], Run], longest: float) -> Slowest:
    """The slowest decay at the level of a pilot run that lasts ten of its times."""
    K = model.system.K + model.linear_elements[0]
    lowest = math.sqrt(max(float(np.linalg.eigvalsh(K).min()), 0.0)) or float(model.omega.max())
    seconds, found = min(PILOT * 2.0 * math.pi / lowest, longest), Slowest(0.0, 0.0)
    for _ in range(TRIES):
        run = pilot(seconds)
        half = len(run.t) // 2
        at = [_slowest(model, *_linearised(model, run.q[half:], run.q_dot[half:], size)) for size in SIZES]
        found = min(at, key=lambda one: one.decay)
        if LASTS * found.time <= seconds or seconds >= longest:
            break
        seconds = min(GROWTH * seconds, 1.2 * LASTS * found.time, longest)
    return found


def _linearised(model: Model, q: Vector, q_dot: Vector, size: float) -> tuple[Vector, Vector]:
    """Equivalent stiffness and damping (n, n) of the elements under a motion, its amplitudes taken so many times."""
    n = len(model.omega)
    K, C = np.zeros((n, n)), np.zeros((n, n))
    for own, one in zip(model.rows_of, model.contact_rows, strict=True):
        if not one.always:
            continue
        w = model.directions[own.start]
        delta, rate = -(q @ w) - one.gap, -(q_dot @ w)
        X = size * math.sqrt(2.0) * float(delta.std())
        if not STUCK * max(one.law.reach, float(np.abs(delta).max())) < X:
            continue
        omega = float(rate.std() / delta.std())
        cosine, energy = harmonics(one.law, X, float(delta.mean()), omega)
        K += np.outer(w, w) * (cosine / (math.pi * X))
        C += np.outer(w, w) * (max(energy, 0.0) / (math.pi * X**2 * omega))
    return K, C
