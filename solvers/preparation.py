"""What the exponential method prepares once per system: tones among the blocks, tables, layout of the working space."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numba import types

from solvers.forcing import Forcing, tones_as_nodes
from solvers.handle import Layout, Packed
from solvers.kernels import INTEGERS, MATRIX, PROBLEM, REAL, VECTOR, Problem
from solvers.response import Space
from solvers.state import STATE, problem_of, rate_rows, state_shapes
from solvers.system import Array, System
from solvers.tables import S, Tables, build
from solvers.vector import padded


def _arrays(*dimensions: int) -> list[Any]:
    """Types of contiguous float arrays with so many dimensions; a plain number for none."""
    return [types.Array(REAL, d, "C") if d else REAL for d in dimensions]


TABLES = types.NamedTuple(
    [
        *_arrays(1, 3, 4, 2, 3, 2, 2, 2, 2, 0, 2, 1),
        *_arrays(1, 3, 2, 2, 2, 3, 3, 2, 5, 6, 5, 4, 2, 2, 2, 2, 4),
    ],
    Tables,
)
SPACE = types.NamedTuple(
    [*_arrays(1, 2, 2, 1, 1, 1, 1, 3, 1, 3, 2, 1, 3, 2, 3, 2, 1), INTEGERS, MATRIX, VECTOR, INTEGERS], Space
)


class Prepared(NamedTuple):
    """What does not change from run to run of one system."""

    problem: Packed
    tables: Packed
    back: Array  # (2n, 2N): [q, q̇] from the state of all blocks
    layout: Layout  # of State and Space
    rest: Array  # state of the tones' blocks at t = 0, the structure's less their steady response


def prepared_for(system: System, forcing: Forcing) -> Prepared:
    """Tables of a system, made once and kept on it, those of the last grid of its sampled signals only."""
    dt_cell = float(forcing.table_dt[0]) if forcing.table_dt.size else 1.0
    key = dt_cell, *(part.tobytes() for part in (forcing.tone_omega, forcing.tone_amplitude, forcing.tone_load))
    if system.kept.get("exponential", (None,))[0] != key:
        if "passive" not in system.about_structure:
            _check_passive(system)
            system.about_structure["passive"] = True
        plain = problem_of(system, forcing)
        problem, steady = with_tones(plain, forcing)
        laws = [contact.law for contact in system.contacts]
        ledger = (_signal_rows(problem, forcing), problem.power, _loss_rows(plain) @ steady)
        tables = build(
            *(problem, len(forcing.tone_omega), [law.exponent for law in laws], [law.jump for law in laws]),
            *(dt_cell, ledger),
        )
        layout = _layout(len(problem.gap), len(problem.load), len(problem.k), len(forcing.table_dt))
        made = Prepared(
            *(Packed(problem, PROBLEM), Packed(tables, TABLES), system.blocks.T @ steady),
            *(layout, _rest(steady, len(forcing.tone_omega))),
        )
        system.kept["exponential"] = (key, made)
    prepared: Prepared = system.kept["exponential"][1]
    return prepared


def _check_passive(system: System) -> None:
    """No block gains energy by itself: what proves that no contact is missed rests on that."""
    k, c = system.blocks.k, system.blocks.c
    if np.any(k < 0.0):
        raise ValueError(
            f"K must be positive semi-definite for Exponential, its lowest ω² is {k.min():g} (buckled?); "
            "use DormandPrince"
        )
    if c.min() < -1e-12 * (np.sqrt(k).max() + np.abs(c).max()):
        raise ValueError(
            f"C must not drive the motion for Exponential, its lowest 2ζω is {c.min():g}; use DormandPrince, or a law"
        )


@lru_cache(maxsize=64)
def _layout(stops: int, loads: int, blocks: int, signals: int) -> Layout:
    """Places of the arrays of `State` and `Space`."""
    size, width = 2 * blocks, 2 * blocks + 2 + 2 * stops
    space = [
        *((padded(width),), (7, padded(size)), (signals, 6), (7,), (blocks,), (loads,), (stops,)),
        *((stops, 2, S), (S,), (stops, 2, S), (stops + loads, S), (S,), (stops, 2, 8), (stops, S), (stops, 3, S)),
        *((stops * S, stops * S), (stops * S,), (stops * S,), (18, padded(width + 2)), (2 + stops,), (6,)),
    ]
    return Layout([STATE, SPACE], [state_shapes(width, stops), space])


def without_resonance(system: System, forcing: Forcing, duration: float, rtol: float) -> Forcing:
    """Tones without a useful steady response are sampled instead.

    That is those on the frequency of a block hardly damped, and those whose steady response l/|k - Ω² + iΩc| is a
    thousand times what the load can do within the duration, l duration²/2: their difference would lose its digits.
    """
    key = forcing.tone_omega.tobytes(), forcing.tone_load.tobytes()
    if system.kept.get("distances", (None,))[0] != key:
        tones = zip(forcing.tone_omega, forcing.tone_load, strict=True)
        system.kept["distances"] = key, [_distance(system, omega, load) for omega, load in tones]
    resonant = [
        i
        for i, (absolute, relative) in enumerate(system.kept["distances"][1])
        if relative <= 1e-6 or absolute * duration**2 < 2e-3
    ]
    return tones_as_nodes(forcing, resonant, duration, rtol) if resonant else forcing


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


def _signal_rows(problem: Problem, forcing: Forcing) -> Array:
    """Each load's tones as a row of the state: Re(a e^{iΩt}) = Re a · p + Im a/Ω · v."""
    tones, N = len(forcing.tone_omega), len(problem.k)
    rows = np.zeros((len(problem.load), 2 * N))
    for i, (omega, amplitude, load) in enumerate(
        zip(forcing.tone_omega, forcing.tone_amplitude, forcing.tone_load, strict=True)
    ):
        rows[load, N - tones + i] = amplitude.real
        rows[load, 2 * N - tones + i] = amplitude.imag / omega if omega > 0.0 else 0.0
    return rows


def _loss_rows(problem: Problem) -> Array:
    """Rows whose squares sum to the damping power: √c v, or a root of the coupled loss."""
    n = len(problem.k)
    if not problem.loss.size:
        return np.hstack((np.zeros((n, n)), np.diag(np.sqrt(np.maximum(problem.c, 0.0)))))
    values, vectors = np.linalg.eigh(0.5 * (problem.loss + problem.loss.T))
    return np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T


def steady_response(k: Array, c: Array, load: Any, omega: Any) -> Any:
    """(..., 2n) complex amplitude Z of the blocks' response Re(Z e^{iΩt}) to the state rate Re(load e^{iΩt})."""
    lp, lv, turn = load[..., : k.size], load[..., k.size :], 1j * omega
    # (iΩ - A)⁻¹ of a block: [[iΩ + c, 1], [-k, iΩ]] / (k - Ω² + iΩc)
    inverse = 1.0 / np.where((lp == 0.0) & (lv == 0.0), 1.0, k - omega**2 + turn * c)
    return np.concatenate((((turn + c) * lp + lv) * inverse, (turn * lv - k * lp) * inverse), axis=-1)


def with_tones(problem: Problem, forcing: Forcing) -> tuple[Problem, Array]:
    """The problem with one undamped block per tone, and the map (2n, 2N) from its state to the blocks' z.

    The steady response to Re(a e^{iΩt}) is Re(Z e^{iΩt}) = Re Z · p + Im Z/Ω · v with p = cos Ωt, v = -Ω sin Ωt.
    """
    n, tones = len(problem.k), len(forcing.tone_omega)
    steady = np.zeros((2 * n, 2 * (n + tones)))
    steady[:n, :n] = steady[n:, n + tones : 2 * n + tones] = np.eye(n)
    for i, (omega, amplitude, load) in enumerate(
        zip(forcing.tone_omega, forcing.tone_amplitude, forcing.tone_load, strict=True)
    ):
        response = steady_response(problem.k, problem.c, problem.load[load] * amplitude, omega)
        steady[:, n + i] = response.real
        if omega > 0.0:
            steady[:, 2 * n + tones + i] = response.imag / omega
    none = np.zeros(0)
    push = np.zeros((len(problem.gap), 2 * (n + tones)))
    push[:, :n], push[:, n + tones : 2 * n + tones] = problem.push[:, :n], problem.push[:, n:]
    sampled = np.zeros((len(problem.load), 2 * (n + tones)))
    for load in forcing.table_load:
        sampled[load, :n], sampled[load, n + tones : 2 * n + tones] = problem.load[load, :n], problem.load[load, n:]
    k = np.concatenate((problem.k, forcing.tone_omega**2))
    c = np.concatenate((problem.c, np.zeros(tones)))
    return problem._replace(
        k=k,
        c=c,
        loss=np.empty((0, 0)),
        push=push,
        read=problem.read @ steady,
        read_rate=rate_rows(problem.read @ steady, k, c),
        load=sampled,
        power=problem.power @ steady,
        tone_omega=none,
        tone_amplitude=none.astype(complex),
        tone_load=none.astype(np.int64),
    ), steady


def _rest(steady: Array, tones: int) -> Array:
    """State at t = 0 of a structure at rest: the tones' blocks have p = 1, v = 0, the others less their response."""
    pseudo = np.zeros(steady.shape[1])
    pseudo[len(pseudo) // 2 - tones : len(pseudo) // 2] = 1.0
    return pseudo - among_tones(steady @ pseudo, tones)


def places_among_tones(n: int, tones: int) -> Any:
    """(2n,) where the blocks' own coordinates stand among those of the tones' blocks."""
    own = np.arange(n)
    return np.concatenate((own, own + (n + tones)))


def among_tones(z: Array, tones: int) -> Array:
    """Block coordinates with zeros for the tones' blocks."""
    n = len(z) // 2
    return np.concatenate((z[:n], np.zeros(tones), z[n:], np.zeros(tones)))
