"""A periodic motion: its state, contacts, Floquet multipliers, and why its stability may be in doubt."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from solvers.exponential.method import Exponential
from solvers.integration import integrate
from solvers.orbits.shots import Chain, PeriodicProblem, delayed
from solvers.problem import Array, ContactLog, Solution, SolverError, System, counted

_NEAR_ONE = 0.01  # | |μ| - 1 | below which a verdict on stability is doubtful


class OrbitError(SolverError):
    """No orbit was found; the message says what was tried, ``solution`` is the last attempt."""


@dataclass(frozen=True, eq=False)
class Orbit:
    """A periodic motion, found by `solvers.orbit` or on a branch.

    Attributes
    ----------
    state : (2n,) [q, q̇] at time ``phase`` within the period.
    period : s. phase : s, 0 unless a stop whose law latches its entry rate is closed then; on a branch also where a
        contact with such a law, or with one whose force jumps, comes near t = 0.
    monodromy : (2n, 2n) derivative of the state one period later. multipliers : its eigenvalues, largest first.
    residual : size of Φ(x) - x relative to the orbit's. iterations : of Newton's method.
    contacts : log of one period, times counted from ``phase``.
    system, method : of what, and how it was integrated.
    doubt : why `stable` may be wrong; empty when no reason was found.
    parameter : value of the branch's parameter, NaN outside a branch.
    mark : "fold", "flip", "neimark-sacker", "branch point", "grazing", "floor" or "merging" at special points of a
        branch, else empty. Two orbits marked "merging" follow each other where a branch jumps because two contacts
        become one. At a "grazing" or "floor" (an entry rate meets its law's floor) multipliers jump, and the branch may
        turn back with a corner.

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

    def __repr__(self) -> str:
        kind = "stable" if self.stable else "unstable"
        return f"<{kind} orbit of {self.period:.6g} s, {counted(len(self.contacts), 'contact')}>"

    @cached_property
    def multipliers(self) -> Any:
        """Floquet multipliers (2n,), largest first."""
        values = np.linalg.eigvals(self.monodromy)
        values = values[np.argsort(-np.abs(values), kind="stable")]
        values.setflags(write=False)
        return values

    @property
    def stable(self) -> bool:
        """Whether every multiplier lies within the unit circle."""
        return bool(np.abs(self.multipliers[0]) < 1.0)

    def samples(self, count: int = 400) -> Solution:
        """One period from ``phase`` on at ``count`` + 1 times, times counted from ``phase``."""
        n, x = self.system.size, self.state
        later = delayed(self.system, self.phase)
        method = replace(self.method, ledger=False) if isinstance(self.method, Exponential) else self.method
        return integrate(later, x[:n], x[n:], self.period, self.period / count, method)


def at_zero(orbit: Orbit) -> Array:
    """State of an orbit at t = 0."""
    if orbit.phase == 0.0:
        return orbit.state
    return flown(delayed(orbit.system, orbit.phase), orbit.state, orbit.period - orbit.phase, orbit.method)


def flown(system: System, x: Array, duration: float, method: Any) -> Array:
    """State after a duration."""
    n = system.size
    end = integrate(system, x[:n], x[n:], duration, method=method)
    state: Array = np.concatenate((end.q[-1], end.q_dot[-1]))
    return state


def orbit_of(problem: PeriodicProblem, chain: Chain, residual: float, iterations: int, **more: Any) -> Orbit:
    """The orbit a solved chain describes."""
    system, period = problem.make(chain.parameter)
    phase = problem.fractions[0] * period
    logs = [solution.contacts for solution in chain.solutions]
    begins = [fraction * period - phase for fraction in problem.fractions]
    return Orbit(
        *(chain.x[0].copy(), period, phase, chain.monodromy(), residual, iterations),
        *(ContactLog.of_period(logs, begins, period), system, problem.method),
        **more,
    )


def judged(orbit: Orbit) -> Orbit:
    """The orbit with the reasons why `stable` may be wrong, checked with a tighter tolerance too."""
    n, x = orbit.system.size, orbit.state
    tight = replace(orbit.method, rtol=max(0.03 * orbit.method.rtol, 1e-12))
    later = delayed(orbit.system, orbit.phase)
    again: Any = integrate(later, x[:n], x[n:], orbit.period, method=tight, tangent=True).tangent
    doubts = list(_doubts(orbit))
    largest, second = (np.abs(np.linalg.eigvals(matrix)).max() for matrix in (orbit.monodromy, again))
    if (largest < 1.0) != (second < 1.0):
        doubts.append(f"a tighter tolerance gives |μ| = {second:.6g} instead of {largest:.6g}")
    return replace(orbit, doubt="; ".join(doubts))


def _doubts(orbit: Orbit) -> Iterator[str]:
    """Reasons that the orbit itself shows."""
    largest = abs(orbit.multipliers[0])
    if abs(largest - 1.0) < _NEAR_ONE:
        yield f"|μ| = {largest:.6g} is within {_NEAR_ONE:g} of one"
    log = orbit.contacts
    if len(log) and log.speed_in.min() < 0.01 * log.speed_in.max():
        slowest = log.speed_in.argmin()
        yield f"the contact at {log.t_in[slowest]:.6g} s grazes: it is entered at {log.speed_in[slowest]:.3g} m/s"
    elif np.any(log.entry_rate_clipped):
        yield "an entry rate lies below its law's floor"
