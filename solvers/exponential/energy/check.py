"""Whether the energy of a finished run balances: by its samples, or if it has none by a bound that costs nothing.

The energy handled is the initial energy, the input, the energy dissipated and stored, and for every contact the peak
force times the peak indentation. A run with an energy balance is refused if the residual exceeds (`MULTIPLE` rtol +
`ROUNDING`) times the energy handled. `ROUNDED` roundings of the terms that cancel in the energy, of coordinates that
stretch stiff parts and of coupled blocks, are tolerated too, up to `CANCELLED` of that; and `ROUNDINGS` roundings of
the energy that each load would give alone, as loads may cancel, and of that of each contact's peak force over the
distances whose difference δ is: at rest nothing else is handled. A stiff coordinate that follows a sampled load, as
that of a support's motion, moves at rounding of ωp: in the time T the load does work of ωT roundings of that energy.

Without a balance, let E be the energy of the motion minus the steady response to tones. At the end it is at most that
at the start plus the work of the contacts,

    E <= E₀ + Σ_s (2 max|δ̇_s of the steady response| |∫F_s dt| - ∫F_s δ̇_s dt) =: E_c,

and sampled loads v_l s_l(t) raise √(2E) by at most Σ_l |v_l|_{M⁻¹} ∫|s_l| dt. A run is refused if E is more than
`FACTOR` times this bound plus the tolerated energy. A run that only loses too much energy passes. Under tones E_c is no
bound where a force pulls, as ∫|F_s| dt then exceeds |∫F_s dt|: such a run that exceeds it is repeated with a balance,
but passes if it is one of many.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from solvers.compiled.kernels import inner, merged, row_of, rubs, slider_of, work_column
from solvers.compiled.state import PEAK_FORCE, T
from solvers.problem import Array, Record, System, dense
from solvers.problem import event_list as at
from solvers.problem.friction import ARM, MU, SPIN, may_pull

MULTIPLE, ROUNDING = 20.0, 1e-9  # see the module; relative to the energy handled
CANCELLED = 1e-6  # the most tolerated of what cancels in the energy, relative to the energy handled
ROUNDED = 3.0  # roundings tolerated of what cancels: 0.7 was met in 108 runs on three processors
ROUNDINGS = 100.0  # tolerated of the energy of loads that cancel, and of distances that make δ
FACTOR = 4.0  # margin of the check without a balance
_SAMPLES = 64  # samples whose balance is checked, the last one among them
_MEAN = np.full(_SAMPLES, 1.0 / _SAMPLES)
FIRST, LAST, ALLOWED = range(3)  # places in Scratch.energy: own energy at start and end, and E_c, J


@inner
def own_energy(run, x):
    """Energy, J, of the motion minus the steady response to tones."""
    n, energy = run.problem.k.size, 0.0
    for b in range(int(run.tables.own_blocks)):
        energy += 0.5 * (x[n + b] * x[n + b] + run.problem.k[b] * x[b] * x[b])
    return energy


@merged
def note_energy(run):
    """At the end of a run write its energy and the bound E_c into ``scratch.energy``."""
    problem, state, scratch = run.problem, run.state, run.scratch
    n = problem.k.size
    allowed = scratch.energy[FIRST]
    for s in range(problem.law.size):
        steady = 0.0
        for r in range(row_of(problem, s), row_of(problem, s + 1)):
            row = problem.read_rate[r]
            for b in range(int(run.tables.own_blocks), n):
                speed = np.hypot(row[b], row[n + b] * np.sqrt(problem.k[b]))
                steady += speed * np.hypot(
                    state.x[b], state.x[n + b] / np.sqrt(problem.k[b]) if problem.k[b] > 0.0 else 0.0
                )
        work, impulse = state.x[work_column(problem, s)], abs(state.x[work_column(problem, s) + 1])
        if rubs(problem, s):  # |F_t| <= μN; the work of a prescribed spin is given
            slider, account = slider_of(problem, s), problem.friction[s, 1]
            impulse *= 1.0 + slider[MU]
            work += state.x[account] - slider[ARM] * slider[SPIN] * state.x[account + 1]
        if problem.knots[s, 0] < 0.0:  # a force of both signs
            impulse = state.active[s, PEAK_FORCE] * state.now[T]
        allowed += 2.0 * steady * impulse - work
    scratch.energy[LAST], scratch.energy[ALLOWED] = own_energy(run, state.x), max(allowed, 0.0)


def tolerated_energy(handled: float, rtol: float) -> float:
    """Residual, J, that the balance of a run may have."""
    return (MULTIPLE * rtol + ROUNDING) * handled


def is_bounded(system: System) -> bool:
    """Whether E_c is a bound: no stop's force pulls, or no tone drives the structure."""
    tones = any(hasattr(signal, "tones") for _, signal in system.loads)
    return not (tones and system.about_laws.get("pulls", lambda: any(_pulls(contact) for contact in system.contacts)))


def _pulls(contact: Any) -> bool:
    """Whether the force of a stop may be negative."""
    law = contact.law.law if contact.friction is not None else contact.law
    return not contact.always and getattr(law, "bend", None) != "force" and may_pull(law)


def has_gained(
    system: System, energy: Any, sampled: Any, duration: float, exchanged: Callable[[], Any], rtol: float
) -> bool:
    """Whether a run without balance ends with more energy than it can have been given.

    ``sampled`` has its sampled loads; ``exchanged`` gives peak force times peak indentation of every contact.
    """
    first, last, allowed = energy.tolist()
    if not last > FACTOR * allowed or system.blocks.loss.size:
        return False
    allowed += tolerated_energy(first + float(np.abs(exchanged()).sum()), rtol)
    if not last > FACTOR * allowed:
        return False
    speed = math.sqrt(2.0 * allowed)
    for j, load in enumerate(sampled.table_load):
        rows = sampled.table[sampled.table_start[j] : sampled.table_start[j + 1], 0]
        speed += _accelerances(system)[load] * np.abs(rows).mean() * duration
    return bool(last > FACTOR * 0.5 * speed**2)


def _accelerances(system: System) -> Any:
    """(loads,) √(vᵀM⁻¹v) of each load's vector v: the rate of √(2E) that its value 1 can give at most."""

    def make() -> Any:
        vectors = np.array([vector for vector, _ in system.loads])
        return np.sqrt((vectors * np.linalg.solve(dense(system.M), vectors.T).T).sum(axis=1))

    return system.kept.get("accelerances of loads", make)


@lru_cache(maxsize=64)
def _checked_places(count: int) -> Any:
    """Indices of the samples that are checked."""
    return np.linspace(0, count - 1, _SAMPLES).astype(int)


def unbalanced(record: Record, rtol: float) -> bool:
    """Whether the energy balance at the samples of a run has a residual above the tolerated one."""
    rows, system = _checked_places(len(record.motion)), record.system
    motion, works = record.motion.take(rows, axis=0), record.works.take(rows, axis=0)
    stored = system.energy_of(motion)
    begun = float(stored[0] if record.t[0] == 0.0 else system.energy_of((record.back @ record.begin)[None])[0])
    left, rubbed = stored - begun - works.dot(_signs(works.shape[1])), 0.0
    if record.rubbed is not None:
        friction, spin = (part[rows] for part in record.works_of_friction)
        left, rubbed = left + friction - spin, np.abs(friction).max() + np.abs(spin).max()
    # Cheap bounds come first: the largest residual is at most their sum, the largest energy at least the mean.
    if _SAMPLES * float(np.abs(left).dot(_MEAN)) <= tolerated_energy(begun + float(stored.dot(_MEAN)), rtol):
        return False
    residual = np.abs(left).max()
    handled = begun + np.abs(stored).max() + np.abs(works[:, :2]).max(axis=0).sum() + rubbed
    allowed = tolerated_energy(handled, rtol)
    if residual <= allowed:
        return False
    allowed = tolerated_energy(handled + float(np.abs(record.exchanged()).sum()), rtol)
    size = max(float(stored.max()), begun)
    if residual > allowed and size > 0.0:
        allowed += handled * min(ROUNDED * np.finfo(float).eps * _told(system, motion) / size, CANCELLED)
    if residual > allowed:
        told = _energy_of_loads(system, record.t[rows]) + _energy_over_distances(record, motion)
        allowed += ROUNDINGS * np.finfo(float).eps * told
    return not residual <= allowed


def cancelling(system: System, motion: Array) -> str:
    """Why no setting lets the energy of motions [q, q̇] (k, 2n) balance, in words; empty where one may.

    That is where `ROUNDED` roundings of the terms that cancel in it are more than `CANCELLED` of it.
    """
    told, size = _told(system, motion), float(system.energy_of(motion).max())
    if not ROUNDED * np.finfo(float).eps * told > CANCELLED * size:
        return ""
    return (
        f"the energy does not balance, and no setting helps: it is a sum of terms up to {told / max(size, 1e-300):.0e} "
        "times as large, so that M, C and K have too few digits for it; take coordinates in which soft and stiff "
        "motions are not mixed, such as modes, and alike in size"
    )


@lru_cache(maxsize=64)
def _signs(count: int) -> Any:
    """(2 + 2m,) what a work adds to the energy: input, damping, then work and impulse of every contact."""
    signs = np.zeros(count)
    signs[0], signs[1], signs[2::2] = 1.0, -1.0, -1.0
    return signs


def _energy_of_loads(system: System, t: Array) -> float:
    """Energy, J, of the motion that the loads would give if they did not cancel, by their largest values at times t.

    A block answers a force by at most about its static amplitude or, within a duration below 1/ω, by its impulse. That
    of a sampled load counts 1 + ωT times.
    """
    k, n, root = system.blocks.k, system.size, 0.0
    lasts, times = 1.0 / np.maximum(np.sqrt(k), 1.0 / t[-1]), np.sqrt(1.0 + np.sqrt(k) * t[-1])
    for vector, signal in system.loads:
        rate = system.push @ np.asarray(vector)
        amplitude = np.hypot(rate[n:], np.sqrt(k) * rate[:n]) * lasts
        size = np.linalg.norm(amplitude if hasattr(signal, "tones") else amplitude * times)
        root += float(np.abs([signal(float(at)) for at in t]).max() * size)
    return 0.5 * root**2


def _energy_over_distances(record: Record, motion: Array) -> float:
    """Σ F (|g| + |w|·|q|), J, with the peak force of each contact: rounding of δ = ±w·q - g is a share of the sum."""
    ends, largest = at.ends_of(record.rows), np.abs(motion[:, : record.system.size]).max(axis=0)
    distances = np.array([abs(one.gap) + np.abs(one.rows).max(axis=0) @ largest for one in record.system.contacts])
    return float(np.abs(ends[:, at.LARGEST]) @ distances[ends[:, at.ELEMENT].astype(int)]) if len(ends) else 0.0


def _told(system: System, motion: Array) -> float:
    """Largest sum of the sizes of the terms that add up to the energy, of motions [q, q̇] (k, 2n).

    These are ½|q|ᵀ|K||q| + ½|q̇|ᵀ|M||q̇|, which cancel in coordinates that stretch stiff parts, and for coupled blocks z
    with the energy zᵀHz those of |z|ᵀ|H||z|: nearly critical damping makes two blocks almost alike. Large parts of them
    cancel in q and q̇, by 1e4 where the rates of decay differ by 1e-4 of themselves, and their squares in the energy.
    """
    q, q_dot = np.split(np.abs(motion), 2, axis=1)
    told = (q * (q @ abs(system.K)) + q_dot * (q_dot @ abs(system.M))).sum(axis=1).max()
    blocks = system.blocks
    if blocks.loss.size:
        (q, q_dot), z = np.split(blocks.T, 2), np.abs(motion @ blocks.inverse.T)
        form = np.abs(q.T @ (system.K @ q) + q_dot.T @ (system.M @ q_dot))
        told = max(told, (z @ form * z).sum(axis=1).max())
    return float(0.5 * told)
