"""Newton's method on a chain of shots, for orbits at a given parameter or at right angles to a branch.

r_i = Φ_i(x_i) - x_{i+1},   i = 0 ... m - 1,   x_m = x_0
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from solvers.orbits.periodic_orbit import OrbitError
from solvers.orbits.shots import Chain, PeriodicProblem
from solvers.problem import Array, SolverError, System

TOLERANCE = 1e-10  # residual, in units of the orbit's size, at which Newton's method has converged
_ROUGH = 1e-8  # the same with memory if no step is better: rounding decides whether a border is just reached
_NEARLY = 1e-5  # relative residual below which the next step is expected to be the last
_MOST_HALVINGS = 6  # of a step that does not reduce the residual
_MOST_SEGMENTS = 3  # runs of a period to find the segments of laws with memory it begins with
_DEEPEST = 1e3  # energy of a stop, in units of the motion's, above which a guess is refused: its run would be slow


def weights(system: System, period: float) -> Array:
    """(2n, 2n) matrix whose product with a state has the square root of an energy per mode as entries.

    Positions count with √(k + (2π/T)²), so that floating coordinates have a size too.
    """
    blocks = system.blocks
    scale = np.sqrt(blocks.k + (2.0 * math.pi / period) ** 2)
    return np.concatenate((scale, np.ones_like(scale)))[:, None] * blocks.inverse


def newton(
    problem: PeriodicProblem,
    x: Array,
    parameter: float,
    row: Array | None = None,
    slope: bool = False,
    most: int = 25,
) -> Chain:
    """Solve the chain from a first guess.

    x is (m, N), with the latched numbers. With a ``row`` (m N + 1,) the parameter is an unknown, too: [states,
    parameter] move at right angles to it from the guess. ``slope`` asks for derivatives by the parameter; ``most`` is
    the number of iterations allowed. Raises OrbitError.
    """
    guess, measure = np.append(x.ravel(), parameter), _Measure(problem)
    chain, error = _fire(problem, guess, measure, row is not None)
    if chain is None:
        raise OrbitError("the motion from the start cannot be integrated over one period")
    history = [error]
    while not error <= TOLERANCE and len(history) <= most:
        step = _step(chain, chain.unknowns - guess, row)
        for halving in range(_MOST_HALVINGS if most > 10 else 2):
            wanted = row is not None or (slope and error < _NEARLY)
            moved = _with_zeros(problem, chain, chain.unknowns + 0.5**halving * step)
            trial, trial_error = _fire(problem, moved, measure, wanted)
            if trial_error < error:
                break
        else:
            break
        chain, error = trial, trial_error
        history.append(error)
    if error <= TOLERANCE:
        chain, error = _with_exact_zeros(problem, chain, error, measure)
    enough = _ROUGH if chain.coordinates < x.shape[1] else TOLERANCE
    if error <= enough and slope and not chain.has_slope:
        chain, error = _fire(problem, chain.unknowns, measure, True)
    if not error <= enough:
        raise OrbitError(
            f"{len(history)} iterations of Newton's method reduced the residual from {history[0]:.3g} to {error:.3g} "
            "of the motion's size"
        )
    return replace(chain, error=error, iterations=len(history) - 1)


class _Measure:
    """Size of a residual relative to the motion's.

    The size of the motion is taken between 1e-4 and 1e3 times that of the first guess, so that running off to infinity
    does not count as convergence, nor vanishing as its failure. Latched numbers count in units of their own size.
    """

    def __init__(self, problem: PeriodicProblem) -> None:
        self.problem, self.first, self.stored = problem, 0.0, 0.0

    def __call__(self, chain: Chain) -> float:
        """Relative residual."""
        if not self.first:
            self.W = weights(*self.problem.make(chain.parameter))
        x, missed = chain.x[:, : chain.coordinates], chain.residual[:, : chain.coordinates]
        turned = np.concatenate((missed[-1:], missed[:-1]))
        parts = np.concatenate((x, x + turned, missed)) @ self.W.T
        squares = np.einsum("ij,ij->i", parts, parts).reshape(3, -1).max(axis=1)
        size, ends, residual = np.sqrt(squares).tolist()
        if not self.first:
            self.first, self.stored = max(size, ends), self._held(chain.x, chain.parameter)
        relative: float = residual / max(min(size, 1e3 * self.first), 1e-4 * self.first, 1e-300)
        return max(relative, self._latched(chain)) if chain.coordinates < chain.x.shape[1] else relative

    def _latched(self, chain: Chain) -> float:
        """Relative residual of the latched numbers; a code that differs counts as one."""
        sizes = np.where(self.problem.codes(chain)[chain.coordinates :], 1.0, self.problem.units(chain))
        return float((np.abs(chain.residual[:, chain.coordinates :]) / sizes).max())

    def too_deep(self, x: Array, parameter: float) -> bool:
        """Whether the stops of a guess hold far more energy than the motion."""
        return self.first > 0.0 and self._held(x, parameter) > _DEEPEST * (self.first**2 + self.stored)

    def _held(self, x: Array, parameter: float) -> float:
        """Largest force times indentation of the stops, J."""
        system, most = self.problem.system(parameter), 0.0
        for contact in system.contacts:
            if contact.memory:
                continue
            delta = float(contact.indentation(x[:, : system.size]).max())
            most = max(most, abs(float(contact.law.force(delta, 0.0, 1.0))) * delta if delta > 0.0 else 0.0)
        return most


def _fire(problem: PeriodicProblem, unknowns: Array, measure: _Measure, slope: bool) -> tuple[Any, float]:
    """The chain at given unknowns and its relative residual; inf if it cannot be integrated."""
    x, parameter = unknowns[:-1].reshape(len(problem.fractions), -1), float(unknowns[-1])
    try:
        if measure.too_deep(x, parameter):
            return None, math.inf
        chain = problem.evaluate(x, parameter, slope)
        for _ in range(_MOST_SEGMENTS if chain.coordinates < x.shape[1] else 0):
            if not np.any(chain.residual[:, problem.codes(chain)]):
                break
            chain = problem.evaluate(_with_ends(chain), parameter, slope)
        error = measure(chain)
    except (SolverError, ValueError, ArithmeticError):
        return None, math.inf
    return chain, error if math.isfinite(error) else math.inf


def _with_zeros(problem: PeriodicProblem, chain: Chain, unknowns: Array) -> Array:
    """The same unknowns, with 0 for latched numbers that are 0 to the tolerance, like those the shots before end with.

    Laws go by their sign, as smooth hysteresis by that of z, and Newton's steps leave rounding there.
    """
    exact, first = unknowns.copy(), chain.coordinates
    if first < chain.x.shape[1]:
        latched, least = exact[:-1].reshape(chain.x.shape)[:, first:], TOLERANCE * problem.units(chain)
        ends = np.array([np.concatenate(solution.memory) for solution in chain.solutions])
        latched[(np.abs(latched) <= least) & (np.abs(np.roll(ends, 1, axis=0)) <= least)] = 0.0
    return exact


def _with_exact_zeros(problem: PeriodicProblem, chain: Chain, error: float, measure: _Measure) -> tuple[Any, float]:
    """A chain that has converged, run again with such numbers 0 where they are not, and its relative residual."""
    exact = _with_zeros(problem, chain, chain.unknowns)
    if np.array_equal(exact, chain.unknowns):
        return chain, error
    again, its_error = _fire(problem, exact, measure, chain.has_slope)
    return (again, its_error) if its_error <= TOLERANCE else (chain, error)


def _with_ends(chain: Chain) -> Array:
    """The shots' states with the numbers latched at the ends of the shots before them."""
    x = chain.x.copy()
    x[:, chain.coordinates :] += np.roll(chain.residual, 1, axis=0)[:, chain.coordinates :]
    return x


def _step(chain: Chain, moved: Array, row: Array | None) -> Array:
    """Newton's step of all unknowns."""
    matrix: Any = chain.jacobian()
    right = -chain.residual.ravel()
    try:
        if row is None:
            return np.append(np.linalg.solve(matrix, right), 0.0)
        matrix = np.block([[matrix, chain.by_parameter.reshape(-1, 1)], [row[None, :]]])
        return np.linalg.solve(matrix, np.append(right, -row @ moved))
    except np.linalg.LinAlgError:
        raise OrbitError("the orbit is not isolated: the linearised return map has the eigenvalue 1") from None
