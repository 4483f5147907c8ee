"""Whether a finished run's energy balances: with the ledger at its samples, without one by a bound that costs nothing.

The energy handled is what there was at first, came in, was lost to damping or is stored, and for every contact its peak
force times its peak indentation. With ledger a run is refused whose residual exceeds (`MULTIPLE` rtol + `ROUNDING`)
times that energy.

Without, the motion less the steady response to tones is looked at: its energy E at the end is at most that at the begin
plus what the contacts gave,

    E <= E₀ + Σ_s (2 max|δ̇_s of the steady response| |∫F_s dt| - ∫F_s δ̇_s dt) =: E_c,

and sampled loads v_l s_l(t) raise √(2E) by at most Σ_l |v_l|_{M⁻¹} ∫|s_l| dt. A run is refused whose energy is more
than `FACTOR` times what this allows and what it need not account for: a run that only loses too much passes.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from solvers.compiled.kernels import inner
from solvers.problem import Array, Energy, System, dense

MULTIPLE, ROUNDING = 20.0, 1e-9
FACTOR = 4.0
_SAMPLES = 64  # of the ledger that are looked at, the last one among them
FIRST, LAST, ALLOWED = range(3)  # places in Space.energy


@inner
def own_energy(problem, tables, x):
    """Energy of the motion less the steady response to tones."""
    n, energy = problem.k.size, 0.0
    for b in range(int(tables.own_blocks)):
        energy += 0.5 * (x[n + b] * x[n + b] + problem.k[b] * x[b] * x[b])
    return energy


@inner
def note_energy(problem, tables, state, scratch):
    """At the end of a run: its energy, and what it may be without sampled loads."""
    n = problem.k.size
    allowed = scratch.energy[FIRST]
    for s in range(problem.gap.size):
        steady = 0.0
        for b in range(int(tables.own_blocks), n):
            steady += np.hypot(problem.read_rate[s, b], problem.read_rate[s, n + b] * np.sqrt(problem.k[b]))
        work, impulse = state.x[2 * n + 2 + 2 * s], state.x[2 * n + 3 + 2 * s]
        allowed += 2.0 * steady * abs(impulse) - work
    scratch.energy[LAST], scratch.energy[ALLOWED] = own_energy(problem, tables, state.x), max(allowed, 0.0)


def tolerated_energy(handled: float, exchanged: Array, rtol: float) -> float:
    """Energy, J, that a run need not account for.

    ``exchanged`` (k,) : peak force times peak indentation of every contact.
    """
    return (MULTIPLE * rtol + ROUNDING) * float(handled + np.abs(exchanged).sum())


def has_gained(system: System, energy: Any, sampled: Any, duration: float, slack: float) -> bool:
    """Whether a run without ledger ends with more energy than it can have been given; ``sampled`` are its loads."""
    _, last, allowed = energy.tolist()
    allowed += slack
    if not last > FACTOR * allowed or system.blocks.loss.size:
        return False
    speed = math.sqrt(2.0 * allowed)
    for j, load in enumerate(sampled.table_load):
        rows = sampled.table[sampled.table_start[j] : sampled.table_start[j + 1], 0]
        vector = np.asarray(system.loads[load][0])
        size = np.sqrt(vector @ np.linalg.solve(dense(system.M), vector))
        speed += size * np.abs(rows).mean() * duration
    return bool(last > FACTOR * 0.5 * speed**2)


def unbalanced(system: System, powers: Array, motion: Array, begin: Array, exchanged: Array, rtol: float) -> bool:
    """Whether the ledger of a run (rows of powers and motion at its samples) does not balance; see `tolerated_energy`."""
    rows = np.unique(np.linspace(0, len(powers) - 1, _SAMPLES).astype(int))
    balance = Energy.of_run(system.M, system.K, powers[rows], motion[rows], begin)
    parts = balance.initial, *(np.abs(part).max() for part in (balance.stored, balance.input, balance.damping))
    return not np.abs(balance.residual).max() <= tolerated_energy(sum(parts), exchanged, rtol)
