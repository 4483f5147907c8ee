"""A period as a chain of shots: each is a run from its begin to the next one's, with its exact tangent."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from solvers.integration import integrate
from solvers.problem import Array, Parameter, Solution, System

_KEPT = 4  # values of the parameter whose systems are kept: Newton's method asks for them again


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
    """The system as it is ``delay`` seconds later: all its loads move on."""
    if delay == 0.0 or not system.loads:
        return system
    return system.like(loads=[(vector, _Delayed(signal, delay)) for vector, signal in system.loads])


@dataclass(frozen=True, eq=False)
class PeriodicProblem:
    """A family of periodic problems: the system and its period for each value of a parameter.

    ``fractions`` (m,) are the shots' begins in units of the period, ascending; ``step`` is the parameter's difference,
    zero where there is none.
    """

    make: Callable[[float], tuple[System, float]]
    method: Any
    fractions: tuple[float, ...] = (0.0,)
    step: float = 0.0
    kept: dict[float, list[tuple[System, float]]] = field(default_factory=dict, init=False, repr=False)

    def shots(self, parameter: float) -> list[tuple[System, float]]:
        """(system from the shot's begin on, duration) of every shot."""
        if parameter not in self.kept:
            system, period = self.make(parameter)
            ends = (*self.fractions[1:], self.fractions[0] + 1.0)
            while len(self.kept) >= _KEPT:
                self.kept.pop(next(iter(self.kept)))
            self.kept[parameter] = [
                (delayed(system, a * period), (b - a) * period) for a, b in zip(self.fractions, ends, strict=True)
            ]
        return self.kept[parameter]

    def evaluate(self, x: Array, parameter: float, slope: bool = True) -> Chain:
        """Fire all shots from x (m, 2n); without ``slope`` the derivatives by the parameter are left out, as zeros."""
        here = self.shots(parameter)
        n, h, m = here[0][0].size, self.step if slope else 0.0, len(here)
        sides = [self.shots(parameter + s * h) for s in (-1.0, 1.0)] if h else []
        residual, tangents, by_parameter, solutions = np.empty((m, 2 * n)), [], np.zeros((m, 2 * n)), []
        for i, (system, duration) in enumerate(here):
            tangent: Any = Parameter(sides[0][i][0], sides[1][i][0], h) if h else True
            solution = integrate(system, x[i, :n], x[i, n:], duration, method=self.method, tangent=tangent)
            assert solution.tangent is not None
            assert solution.rate is not None
            residual[i] = np.concatenate((solution.q[-1], solution.q_dot[-1])) - x[(i + 1) % m]
            tangents.append(solution.tangent[:, : 2 * n])
            if h:
                lengthening = (sides[1][i][1] - sides[0][i][1]) / (2.0 * h)
                by_parameter[i] = solution.tangent[:, -1] + solution.rate * lengthening
            solutions.append(solution)
        return Chain(x, parameter, residual, np.array(tangents), by_parameter, solutions, slope or self.step == 0.0)


@dataclass(frozen=True, eq=False)
class Chain:
    """What the shots from x (m, 2n) gave: residuals (m, 2n), their derivatives (m, 2n, 2n) and by the parameter."""

    x: Array
    parameter: float
    residual: Array
    tangents: Array
    by_parameter: Array
    solutions: list[Solution]
    has_slope: bool = True  # whether ``by_parameter`` is known

    def jacobian(self) -> Array:
        """Derivative (m 2n, m 2n) of the residuals by all states."""
        m, size = self.residual.shape
        matrix = np.zeros((m, size, m, size))
        for i in range(m):
            matrix[i, :, i, :] += self.tangents[i]
            matrix[i, :, (i + 1) % m, :] -= np.eye(size)
        return matrix.reshape(m * size, m * size)

    def monodromy(self) -> Array:
        """Product of the shots' tangents."""
        product = np.eye(self.residual.shape[1])
        for tangent in self.tangents:
            product = tangent @ product
        return product
