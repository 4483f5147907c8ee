"""A periodic motion: its state, contacts, Floquet multipliers, and why its stability may be in doubt."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from solvers.exponential.method import Exponential
from solvers.orbits.open_times import latching_stops
from solvers.orbits.shots import Chain, PeriodicProblem, delayed
from solvers.orbits.whole_state import codes, counts, derivatives, memory_of, run, state_after, transitions_of
from solvers.problem import Array, ContactLog, Solution, SolverError, System, Transitions, counted
from solvers.problem.event_list import NO_EVENTS

_LOST = 1e-13  # relative size of a direction after one period below which it counts as lost
_NEAR_ONE = 0.01  # | |μ| - 1 | of the largest multiplier below which the verdict on stability is doubtful


class OrbitError(SolverError):
    """No orbit was found; the message says what was tried, ``solution`` is the last attempt."""


@dataclass(frozen=True, eq=False)
class Orbit:
    """A periodic motion, found by `solvers.orbit` or on a branch.

    Attributes
    ----------
    state : (2n,) [q, q̇] at time ``phase`` within the period.
    period : s. phase : s, 0 unless a stop whose law latches its entry rate is closed then; on a branch also where a
        contact with such a law, or with one whose force jumps, comes near t = 0, or laws with memory pass borders.
    memory : what each contact has latched then, as `Solution.memory`; empty without laws with memory.
    monodromy : (2n + r, 2n + r) derivative of the state one period later, the r latched numbers included that are no
        codes of segments.
    family : (contact, place in its memory) of what is latched but never renewed within the period, such as a slider
        that sticks all the time. Other values give other orbits: this is one of a family, the one of the present
        values. Each gives a multiplier 1, left out of `transverse`.
    residual : size of Φ(x) - x relative to the orbit's. iterations : of Newton's method.
    contacts : log of one period, times counted from ``phase``. transitions : likewise of laws with memory; impulse and
        work are counted from the start of the shot.
    system, method : of what, and how it was integrated.
    doubt : why `stable` may be wrong; empty when no reason was found.
    parameter : value of the branch's parameter, NaN outside a branch.
    shots : when the runs began that it was made of, in periods, and their states (m, 2n + l); None where unknown.
    mark : "fold", "flip", "neimark-sacker", "branch point", "grazing", "stick", "floor" or "merging" at special points
        of a branch, else empty. Two orbits marked "merging" follow each other where a branch jumps because two contacts
        become one. At a "grazing" or "floor" (an entry rate meets its law's floor) multipliers jump, and the branch may
        turn back with a corner; likewise at a "stick", where the number of `transitions` changes: a phase of stick or
        slip, a yielding or a reversal comes or goes.

    Examples
    --------
    >>> from solvers import orbit
    >>> still = orbit(System.modal(omega=[2.0], zeta=[0.1]), period=3.0)
    >>> bool(np.allclose(abs(still.multipliers), np.exp(-0.2 * 3.0)))  # e^{-ζωT}
    True
    """

    state: Array
    period: float
    phase: float
    monodromy: Array
    residual: float
    iterations: int
    contacts: ContactLog
    system: System
    method: Any
    doubt: str = ""
    parameter: float = math.nan
    mark: str = ""
    memory: tuple[Array, ...] = ()
    family: tuple[tuple[int, int], ...] = ()
    transitions: Transitions = field(default_factory=lambda: Transitions.of_events(NO_EVENTS, ()))
    shots: tuple[tuple[float, ...], Array] | None = None

    def __repr__(self) -> str:
        kind = "stable" if self.stable else "unstable"
        one = ", one of a family" if self.family else ""
        return f"<{kind} orbit of {self.period:.6g} s, {counted(len(self.contacts), 'contact')}{one}>"

    @property
    def whole(self) -> Array:
        """[q, q̇] and the latched numbers, (2n + l,)."""
        return np.concatenate((self.state, *self.memory)) if self.memory else self.state

    @cached_property
    def multipliers(self) -> Any:
        """Floquet multipliers (2n + r,), largest first: eigenvalues of the monodromy matrix.

        Exactly 1 for each entry of `family`, exactly 0 as often as `forgotten` tells.
        """
        return _in_order(np.concatenate((self.transverse, np.ones(len(self.family)))))

    @cached_property
    def transverse(self) -> Any:
        """Multipliers without those of the family."""
        if not self.memory:
            return _in_order(np.linalg.eigvals(self.monodromy))
        real = np.flatnonzero(~codes(self.system)).tolist()
        first = 2 * self.system.size + np.concatenate(([0], np.cumsum(counts(self.system))))
        kept = [i for i in range(len(real)) if real[i] not in {int(first[c]) + place for c, place in self.family}]
        return _in_order(_eigenvalues(self.monodromy[np.ix_(kept, kept)]))

    @property
    def forgotten(self) -> int:
        """Number of multipliers that are zero: numbers latched from δ and δ̇ within the period lose their past."""
        return int(np.sum(self.transverse == 0.0)) if self.memory else 0

    @property
    def stable(self) -> bool:
        """Whether every multiplier but those of the family lies within the unit circle."""
        return bool(np.abs(self.transverse[0]) < 1.0)

    def samples(self, count: int = 400) -> Solution:
        """One period from ``phase`` on at ``count`` + 1 times, times counted from ``phase``."""
        later = delayed(self.system, self.phase)
        method = replace(self.method, ledger=False) if isinstance(self.method, Exponential) else self.method
        return run(later, self.whole, self.period, self.period / count, method)


def _in_order(values: Any) -> Any:
    """Eigenvalues, largest first, in a read-only array."""
    values = values[np.argsort(-np.abs(values), kind="stable")]
    values.setflags(write=False)
    return values


def _eigenvalues(matrix: Array) -> Any:
    """Eigenvalues; those that singular values show to be zero are set to 0, as rounding spreads multiple ones."""
    from scipy.linalg import matrix_balance

    with np.errstate(invalid="ignore"):  # scales beyond the range of integers
        matrix, whole = matrix_balance(matrix, permute=False)[0], len(matrix)
    while len(matrix):
        u, s, v = np.linalg.svd(matrix)
        rank = int(np.sum(s > _LOST * s[0]))
        if rank == len(matrix):
            break
        matrix = (s[:rank, None] * v[:rank]) @ u[:, :rank]  # it has the eigenvalues of u S v without the zeros
    return np.concatenate((np.linalg.eigvals(matrix), np.zeros(whole - len(matrix))))


def states_at(orbit: Orbit, times: Sequence[float]) -> list[Array]:
    """States of an orbit, with the latched numbers, at times counted from its phase."""
    later = delayed(orbit.system, orbit.phase)
    return [state_after(later, orbit.whole, t, orbit.method) for t in times]


def at_zero(orbit: Orbit) -> Array:
    """State of an orbit at t = 0, with the latched numbers."""
    return orbit.whole if orbit.phase == 0.0 else states_at(orbit, [orbit.period - orbit.phase])[0]


def orbit_of(problem: PeriodicProblem, chain: Chain, mark: str = "") -> Orbit:
    """The orbit a solved chain describes."""
    system, period = problem.make(chain.parameter)
    phase = problem.fractions[0] * period
    logs = [solution.contacts for solution in chain.solutions]
    starts = [fraction * period - phase for fraction in problem.fractions]
    state, matrix = chain.x[0].copy(), chain.monodromy()
    more: dict[str, Any] = {"parameter": chain.parameter if problem.step else math.nan, "mark": mark}
    if chain.coordinates < len(state):
        places = [(contact, place) for contact, count in enumerate(counts(system)) for place in range(count)]
        more["family"] = tuple(places[i - chain.coordinates] for i in chain.frozen)
        more["memory"] = memory_of(system, state)
        more["transitions"] = transitions_of(chain.solutions, starts)
        real = np.flatnonzero(~problem.codes(chain))
        state, matrix = state[: chain.coordinates], matrix[np.ix_(real, real)]
    return Orbit(
        *(state, period, phase, matrix, chain.error, chain.iterations),
        *(ContactLog.of_period(logs, starts, period), system, problem.method),
        shots=(problem.fractions, chain.x),
        **more,
    )


def with_doubts(orbit: Orbit) -> Orbit:
    """The orbit with the reasons why `stable` may be wrong, from itself and from a tighter tolerance."""
    tight = replace(orbit.method, rtol=max(0.03 * orbit.method.rtol, 1e-12))
    later = delayed(orbit.system, orbit.phase)
    _, again = derivatives(later, orbit.whole, orbit.period, tight, True)
    if orbit.memory:
        real = np.flatnonzero(~codes(orbit.system))
        again = again[np.ix_(real, real)]
    doubts = list(_doubts(orbit))
    largest, second = (abs(one.transverse[0]) for one in (orbit, replace(orbit, monodromy=again)))
    if (largest < 1.0) != (second < 1.0):
        doubts.append(f"a tighter tolerance gives |μ| = {second:.6g} instead of {largest:.6g}")
    return replace(orbit, doubt="; ".join(doubts))


def _doubts(orbit: Orbit) -> Iterator[str]:
    """Reasons that the orbit itself shows."""
    largest = abs(orbit.transverse[0])
    if abs(largest - 1.0) < _NEAR_ONE:
        yield f"|μ| = {largest:.6g} is within {_NEAR_ONE:g} of one"
    log = orbit.contacts
    if len(log) and log.speed_in.min() < 0.01 * log.speed_in.max():
        slowest = log.speed_in.argmin()
        name, t_in, speed = log.name[slowest], log.t_in[slowest], log.speed_in[slowest]
        yield f"the contact of {name} at {t_in:.6g} s grazes: it is entered at {speed:.3g} m/s"
    elif np.any(log.entry_rate_clipped[np.isin(log.stop, latching_stops(orbit.system))]):
        yield "an entry rate lies below its law's floor"
