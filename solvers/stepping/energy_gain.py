"""Whether a run gains energy without input: the sign of a step beyond the limit of stability."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from solvers.compiled.kernels import inner, kernel, rubs, slider_of
from solvers.problem import Array, Contact, System
from solvers.problem.friction import ARM, BEGUN, SPIN, STIFFNESS
from solvers.stepping.stability import is_dissipative, work_of

NOW, BEGAN, LEAST, IN_A_ROW, MOST_INPUT, HELD = range(6)  # places in `Space.watch`, see `watched`
STEPS_OF_GAIN = 8  # consecutive steps with a gain; one alone may be an error of the balance, as in a load's first step
_FAR, STEPS_FAR = 1e3, 3  # factor on the energy given, and consecutive steps above it, that end a run sooner
_TRIED = np.geomspace(1e-9, 1e3, 241)  # m or rad, to either side, where a law that always acts must lead back to 0


@kernel
def gains(problem, state, space):
    """Whether the energy exceeds twice the initial one plus all input for `STEPS_OF_GAIN` steps, or by far sooner."""
    ledger = 2 * problem.k.size
    watch = space.watch
    watch[MOST_INPUT] = max(watch[MOST_INPUT], state.x[ledger])
    given = watch[BEGAN] + watch[MOST_INPUT]
    for s in range(problem.law.size):  # a stop returns at most what it stored
        given += min(max(-state.x[ledger + 2 + 2 * s], 0.0), watch[HELD + s])
        if rubs(problem, s):
            own = slider_of(problem, s)
            given += max(own[ARM] * own[SPIN] * state.x[problem.friction[s, 1] + 1], 0.0)
            given += 0.5 * own[BEGUN] ** 2 / own[STIFFNESS]
    more = watch[NOW] > 2.0 * given + watch[LEAST]
    watch[IN_A_ROW] = watch[IN_A_ROW] + 1.0 if more else 0.0
    far = watch[NOW] > _FAR * (given + watch[LEAST])
    return watch[IN_A_ROW] >= STEPS_OF_GAIN or (far and watch[IN_A_ROW] >= STEPS_FAR)


@inner
def modal_gains(problem, state, space):
    """The same on decoupled modes; False with damping that couples them, which the engine checks."""
    if problem.loss.shape[0] > 0:
        return False
    n, energy = problem.k.size, 0.0
    for i in range(n):
        energy += 0.5 * (state.x[n + i] ** 2 + problem.k[i] * state.x[i] ** 2)
    space.watch[NOW] = energy
    return gains(problem, state, space)


def watched(system: System, motion: Array, least: float) -> Array:
    """Initial entries of `Space.watch`: energy now, at the start, negligible, J; steps; input; held by stops, J."""
    q, q_dot = np.split(motion, 2)
    stored = abs(float(system.energy(q, q_dot)))
    known = system.about_laws.get("dissipative", lambda: [_only_takes(contact) for contact in system.contacts])
    held = [
        _held(contact, float(contact.indentation(q))) if takes else math.inf
        for contact, takes in zip(system.contacts, known, strict=True)
    ]
    return np.array([stored, stored, least, 0.0, 0.0, *held])


def _only_takes(contact: Contact) -> bool:
    """Whether a contact returns at most the energy it holds; if it acts on both sides, whether F δ >= 0 at rest."""
    law: Any = contact.law
    if not is_dissipative(law):
        return False
    if not contact.always:
        return True
    parts = [part for part in getattr(law, "parts", (law,)) if not (part.memory or (law.memory and part.one_sided))]
    delta = np.outer(_TRIED, (-1.0, 1.0)).ravel()
    with np.errstate(all="ignore"):  # what overflows is not known to lead there
        return all(bool(np.all(delta * part.batch(1.0)(delta, 0.0 * delta) >= 0.0)) for part in parts)


def _held(contact: Contact, delta: float) -> float:
    """Energy, J, that a contact may return; unknown, inf, of one that opens and begins in contact."""
    law: Any = contact.law
    if getattr(law, "opens", False) and delta > 0.0:
        return math.inf
    if not contact.always:
        return work_of(law, delta)
    return float(law.stored(delta, law.parameters) if law.memory else law.work_at_rest(delta))


def largest_loads(problem: Any) -> Array:
    """(L,) bounds of the loads' signals."""
    largest = np.zeros(len(problem.load))
    np.add.at(largest, problem.tone_load, np.abs(problem.tone_amplitude))
    for j, load in enumerate(problem.table_load):
        largest[load] += np.abs(problem.table[problem.table_start[j] : problem.table_start[j + 1], 0]).max()
    return largest


def negligible_energy(problem: Any, inverse_mass: Array, dt: float) -> float:
    """Energy, J, by rounding of the loads: 1e-10 of that of the largest in one step, ½ vᵀM⁻¹v (s dt)²."""
    return 0.5e-10 * dt**2 * float(np.sum(inverse_mass * largest_loads(problem) ** 2))
