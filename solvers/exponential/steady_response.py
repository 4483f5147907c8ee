"""Steady response of the blocks to tones, and which tones have none that is useful."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from solvers.problem import Array, Forcing, System, tones_as_nodes
from solvers.problem.signals import sampling_tolerance


def without_resonance(system: System, forcing: Forcing, duration: float, rtol: float) -> Forcing:
    """The forcing with tones near resonance replaced by samples, as exact as other sampled signals.

    A tone is replaced if it is at the frequency of a hardly damped block, or if its steady response l/|k - Ω² + iΩc| is
    a thousand times the motion it can cause within the duration T, l T min(T, 1/Ω)/2: the difference would lose its
    digits, and errors of steps are measured by what the two could reach apart.
    """
    key = "distances", forcing.tone_omega.tobytes(), forcing.tone_load.tobytes()
    tones = zip(forcing.tone_omega, forcing.tone_load, strict=True)
    found = system.kept.get(key, lambda: [_distance(system, omega, load) for omega, load in tones])
    grown = duration / np.maximum(forcing.tone_omega, 1.0 / duration)  # twice what a load of 1 moves
    resonant = [i for i, (far, relative) in enumerate(found) if relative <= 1e-6 or far * grown[i] < 2e-3]
    return tones_as_nodes(forcing, resonant, duration, sampling_tolerance(rtol)) if resonant else forcing


def _distance(system: System, omega: float, load: int) -> tuple[float, float]:
    """Smallest |k - Ω² + iΩc| of the blocks a load pushes, absolute and relative to max(k, Ω²)."""
    vector, blocks = system.push @ np.asarray(system.loads[load][0]), system.blocks
    pushed = (vector[: system.size] != 0.0) | (vector[system.size :] != 0.0)
    if not pushed.any():
        return math.inf, math.inf
    k, c = blocks.k[pushed], blocks.c[pushed]
    distance = np.abs(k - omega**2 + 1j * omega * c)
    scale = np.maximum(k, max(omega**2, 1e-300))
    return float(distance.min()), float((distance / scale).min())


def steady_response(k: Array, c: Array, load: Any, omega: Any) -> Any:
    """(..., 2n) complex amplitude Z of the blocks' response Re(Z e^{iΩt}) to the state rate Re(load e^{iΩt})."""
    lp, lv, turn = load[..., : k.size], load[..., k.size :], 1j * omega
    # (iΩ - A)⁻¹ of a block: [[iΩ + c, 1], [-k, iΩ]] / (k - Ω² + iΩc)
    inverse = 1.0 / np.where((lp == 0.0) & (lv == 0.0), 1.0, k - omega**2 + turn * c)
    return np.concatenate((((turn + c) * lp + lv) * inverse, (turn * lv - k * lp) * inverse), axis=-1)
