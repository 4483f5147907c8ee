"""A period as a chain of shots: each is a run from its start to the next one's, with its exact tangent."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from solvers.orbits.whole_state import codes, derivatives, rate_at_end, units
from solvers.problem import Array, Parameter, Solution, System

_UNIT = 1e-12  # rounding of the derivatives of latched numbers that are not renewed
_KEPT = 4  # values of the parameter whose systems are kept, since Newton's method needs them again


class _Delayed:
    """A signal seen ``delay`` seconds later."""

    def __init__(self, signal: Any, delay: float) -> None:
        self.signal, self.delay = signal, delay
        if hasattr(signal, "tones"):
            self.tones = self._tones

    def __call__(self, t: Any) -> Any:
        return self.signal(np.asarray(t) + self.delay)

    def _tones(self) -> tuple[Array, Any]:
        omega, amplitude = self.signal.tones()
        return omega, np.asarray(amplitude) * np.exp(1j * np.asarray(omega) * self.delay)


def delayed(system: System, delay: float) -> System:
    """The system ``delay`` seconds later: its loads are shifted in time."""
    if delay == 0.0 or not system.loads:
        return system
    return system.like(loads=[(vector, _Delayed(signal, delay)) for vector, signal in system.loads])


@dataclass(frozen=True, eq=False)
class PeriodicProblem:
    """A family of periodic problems: the system and its period for each value of a parameter.

    ``fractions`` (m,) are the shots' starts in units of the period, ascending; ``step`` is for differences by the
    parameter, zero if there is none.
    """

    make: Callable[[float], tuple[System, float]]
    method: Any
    fractions: tuple[float, ...] = (0.0,)
    step: float = 0.0
    kept: dict[float, list[tuple[System, float]]] = field(default_factory=dict, init=False, repr=False)

    def shots(self, parameter: float) -> list[tuple[System, float]]:
        """(system from the shot's start on, duration) of every shot."""
        if parameter not in self.kept:
            system, period = self.make(parameter)
            ends = (*self.fractions[1:], self.fractions[0] + 1.0)
            while len(self.kept) >= _KEPT:
                self.kept.pop(next(iter(self.kept)))
            self.kept[parameter] = [
                (delayed(system, a * period), (b - a) * period) for a, b in zip(self.fractions, ends, strict=True)
            ]
        return self.kept[parameter]

    def beside(self, parameter: float) -> tuple[float, float]:
        """The parameter less and plus ``step``; itself for one that the family refuses, as a μ below 0."""
        low, high = parameter - self.step, parameter + self.step
        try:
            self.shots(low)
        except ValueError:
            return parameter, high
        try:
            self.shots(high)
        except ValueError:
            return low, parameter
        return low, high

    def evaluate(self, x: Array, parameter: float, slope: bool = True) -> Chain:
        """Integrate all shots from x (m, N); without ``slope`` the derivatives by the parameter are zero."""
        here = self.shots(parameter)
        low, high = self.beside(parameter) if slope and self.step else (parameter, parameter)
        h, (m, size) = 0.5 * (high - low), x.shape
        sides = [self.shots(low), self.shots(high)] if h else []
        residual, tangents, by_parameter, solutions = np.empty((m, size)), [], np.zeros((m, size)), []
        for i, (system, duration) in enumerate(here):
            tangent: Any = Parameter(sides[0][i][0], sides[1][i][0], h) if h else True
            solution, matrix = derivatives(system, x[i], duration, self.method, tangent)
            residual[i] = solution.end - x[(i + 1) % m]
            tangents.append(matrix[:, :size])
            if h:
                lengthening = (sides[1][i][1] - sides[0][i][1]) / (2.0 * h)
                by_parameter[i] = matrix[:, -1] + rate_at_end(system, solution) * lengthening
            solutions.append(solution)
        return Chain(x, parameter, residual, np.array(tangents), by_parameter, solutions, slope or self.step == 0.0)

    def system(self, parameter: float) -> System:
        """The system from the first shot's start on, which is kept."""
        return self.shots(parameter)[0][0]

    def units(self, chain: Chain) -> Array:
        """Sizes of the latched numbers over the period."""
        systems = [system for system, _ in self.shots(chain.parameter)]
        rows = zip(systems, chain.x, chain.solutions, strict=True)
        return np.max([units(system, x, solution.transitions) for system, x, solution in rows], axis=0)

    def codes(self, chain: Chain) -> Any:
        """Which entries of a state are codes of segments."""
        return codes(self.system(chain.parameter))


def constant(system: System, period: float, method: Any) -> PeriodicProblem:
    """A family of one member, whatever the parameter."""
    return PeriodicProblem(lambda _: (system, period), method)


@dataclass(frozen=True, eq=False)
class Chain:
    """Results of the shots from x (m, N): residuals (m, N), their derivatives (m, N, N) and by the parameter.

    N = 2n + l counts [q, q̇] and latched numbers, see `whole_state`.
    """

    x: Array
    parameter: float
    residual: Array
    tangents: Array
    by_parameter: Array
    solutions: list[Solution]
    has_slope: bool = True  # whether ``by_parameter`` is known
    error: float = math.nan  # size of the residuals relative to the motion's, once judged by `newton`
    iterations: int = 0  # of Newton's method

    def jacobian(self) -> Array:
        """Derivative (m N, m N) of the residuals by all states; latched numbers never renewed are held constant."""
        m, size = self.residual.shape
        matrix = np.zeros((m, size, m, size))
        for i in range(m):
            matrix[i, :, i, :] += self.tangents[i]
            matrix[i, :, (i + 1) % m, :] -= np.eye(size)
        if len(self.frozen):
            matrix[-1, self.frozen] = 0.0
            matrix[-1, self.frozen, 0, self.frozen] = -1.0
        return matrix.reshape(m * size, m * size)

    @cached_property
    def unknowns(self) -> Array:
        """(m N + 1,) [states, parameter]."""
        return np.append(self.x.ravel(), self.parameter)

    @property
    def coordinates(self) -> int:
        """2n, the length of [q, q̇]."""
        return 2 * self.solutions[0].q.shape[1]

    @cached_property
    def frozen(self) -> Any:
        """Indices in a state of the latched numbers that are never renewed within the period."""
        first, unit = self.coordinates, np.eye(self.x.shape[1])
        same = np.abs(self.tangents[:, first:] - unit[first:]) < _UNIT
        return first + np.flatnonzero(same.all(axis=(0, 2)))

    def monodromy(self) -> Array:
        """Product of the shots' tangents."""
        product = np.eye(self.residual.shape[1])
        for tangent in self.tangents:
            product = tangent @ product
        return product
