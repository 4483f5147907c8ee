"""States with latched numbers: x = [q, q̇, L], L the latched numbers of all contacts in a row.

Codes of segments are among L. They are whole numbers, rounded when a run begins, without derivatives. Without laws with
memory L is empty and x is [q, q̇].
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from solvers.integration import integrate
from solvers.problem import Array, Parameter, Solution, System, Transitions, columns_of, renew, renewal_slopes
from solvers.problem.friction import told_rates
from solvers.problem.whole_runs import whole_runs

_OF_SLIDER = np.array([False, True])  # which numbers of friction are no codes: code of the segment, place of the slider


def counts(system: System) -> list[int]:
    """Number of latched numbers of each contact."""
    return system.about_laws.get("counts", lambda: [len(contact.memory) for contact in system.contacts])


def codes(system: System) -> Any:
    """Which entries of x are codes of segments."""

    def found() -> Any:
        real = [_OF_SLIDER if contact.friction else _reals(contact.law) for contact in _remembering(system)]
        return ~np.concatenate((np.ones(2 * system.size, dtype=bool), *real))

    return system.about_laws.get(("codes", system.size), found)


def _remembering(system: System) -> list[Any]:
    """The contacts whose law has a memory."""
    return [contact for contact, count in zip(system.contacts, counts(system), strict=True) if count]


def with_initial_memory(system: System, x: Array) -> Array:
    """A state [q, q̇] with the numbers that laws begin with."""
    latched = [np.asarray(one.law.parameters)[one.memory] for one in _remembering(system)]
    return np.concatenate((x, *latched)) if latched else x


def memory_of(system: System, x: Array) -> tuple[Array, ...]:
    """The latched numbers of each contact in a state, codes rounded; empty without laws with memory."""
    own = counts(system)
    if not any(own):
        return ()
    latched = np.where(codes(system), np.round(x), x)[2 * system.size :]
    return tuple(np.split(latched, np.cumsum(own)[:-1]))


def run(system: System, x: Array, duration: float, dt: Any = None, method: Any = None, **more: Any) -> Solution:
    """A run from a state."""
    n, memory = system.size, memory_of(system, x)
    with whole_runs():
        return integrate(system, x[:n], x[n : 2 * n], duration, dt, method, memory=memory or None, **more)


def rate_at_end(system: System, solution: Solution) -> Array:
    """Derivative of `Solution.end` by the duration, of a run with a tangent."""
    assert solution.rate is not None
    return np.concatenate((solution.rate, told_rates(system.contacts, solution.memory)))


def state_after(system: System, x: Array, duration: float, method: Any) -> Array:
    """State after a duration."""
    return run(system, x, duration, method=method).end


def derivatives(system: System, x: Array, duration: float, method: Any, tangent: Any) -> tuple[Solution, Array]:
    """A run, and the derivative of its end state by its start, then by a parameter."""
    solution = run(system, x, duration, method=method, tangent=tangent)
    if solution.memory_tangent is None:
        assert solution.tangent is not None
        return solution, solution.tangent
    matrix = solution.memory_tangent
    if isinstance(tangent, Parameter) and matrix.shape[1] == len(x):
        behind, ahead = (state_after(side, x, duration, method) for side in (tangent.behind, tangent.ahead))
        matrix = np.column_stack((matrix, (ahead - behind) / (2.0 * tangent.step)))
    without = np.flatnonzero(codes(system))
    matrix[without] = matrix[:, without] = 0.0
    return solution, matrix


def units(system: System, x: Array, log: Transitions) -> Array:
    """Size of each latched number over a run from x: of its values, and of the terms of its renewals by δ and δ̇."""
    sizes: list[Array] = []
    for number, latched in enumerate(memory_of(system, x)):
        law: Any = system.contacts[number].law
        row, places, size = np.array(law.parameters, dtype=float), system.contacts[number].memory, np.abs(latched)
        row[places] = latched
        mine = np.flatnonzero(log.contact == number)
        if system.contacts[number].friction is not None:
            drawn = np.abs(log.force[mine]).max(initial=0.0) / law.friction.stiffness
            size, mine = np.maximum(size, np.abs(log.delta[mine]).max(initial=0.0) + drawn), mine[:0]
        for i in mine:
            at = int(log.border[i]), float(log.delta[i]), float(log.delta_dot[i])
            taken = np.abs(renewal_slopes(law, row, *at)[:, :2] * at[1:]).max(axis=1)
            renew(law, row, *at)
            size = np.maximum(size, np.maximum(taken, np.abs(row[places])))
        sizes.append(np.where(size > 0.0, size, 1.0))
    return np.concatenate((np.zeros(0), *sizes))


def _reals(law: Any) -> Array:
    """Which latched numbers of a law are no codes."""
    return np.diag(renewal_slopes(law, np.array(law.parameters))[:, 2:]) != 0.0


def transitions_of(solutions: Sequence[Solution], starts: Sequence[float]) -> Transitions:
    """One log of the runs of a period; the times of each are counted from its own start."""
    logs = [solution.transitions for solution in solutions]
    columns = {name: [getattr(log, name) for log in logs] for name in columns_of(Transitions)}
    columns["t"] = [t + start for t, start in zip(columns["t"], starts, strict=True)]
    return Transitions(*(np.concatenate(column) for column in columns.values()), names=logs[0].names)
