"""Points of a branch, and the step from one to the next.

The unknowns y = [states of the shots, parameter] move along the branch's unit tangent t; lengths are measured with
states relative to the first orbit's size and the parameter relative to the span. Newton's method returns to the branch
at a fixed parameter, which needs one system only, or, near folds, at right angles to the tangent.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import block_diag

from solvers.orbits import Chain, Orbit, PeriodicProblem, newton, orbit_of, weights
from solvers.problem import Array, SolverError

_STEEP = 0.02  # parameter's share of the tangent below which the parameter is not held fixed
_LATCHED = 1e-10  # arclength of latched numbers, in units of their own size: only keeps the metric regular
_MOST_ITERATIONS = 9  # of Newton's method for a point
NO_ORBIT = SolverError, np.linalg.LinAlgError, ValueError, ArithmeticError  # what a search for an orbit may raise


@dataclass(frozen=True, eq=False)
class Point:
    """An orbit on the branch, with all that a step from it needs."""

    orbit: Orbit
    problem: PeriodicProblem
    chain: Chain
    tangent: Array
    metric: Array
    tests: dict[str, float] = field(default_factory=dict, init=False, repr=False)  # test functions, once computed

    @property
    def unknowns(self) -> Array:
        """[states, parameter]."""
        return self.chain.unknowns

    @property
    def share(self) -> float:
        """Part of the tangent's length that is the parameter's, signed; zero at a fold."""
        return float(self.tangent[-1] * math.sqrt(self.metric[-1, -1]))

    @property
    def size(self) -> float:
        """The orbit's size in units of the first one's."""
        return self.length(np.append(self.chain.x.ravel(), 0.0))

    def length(self, change: Array) -> float:
        """Arclength of a change of the unknowns."""
        return math.sqrt(change @ self.metric @ change)

    def along(self, change: Array) -> float:
        """Share of the tangent in a change of the unknowns, an arclength."""
        return float(self.tangent @ self.metric @ change)


def metric_of(problem: PeriodicProblem, chain: Chain, width: float) -> Array:
    """Matrix of the arclength over [states, parameter].

    Latched numbers hardly count: they may jump while they do not act, and act on the state where they do.
    """
    W, x, (m, whole) = weights(*problem.make(chain.parameter)), chain.x[:, : chain.coordinates], chain.x.shape
    size = float(np.linalg.norm(x @ W.T, axis=1).max()) or 1.0  # an orbit at rest has none
    each = W.T @ W / (m * size**2)
    if chain.coordinates < whole:
        each = block_diag(each, np.diag((_LATCHED / problem.units(chain)) ** 2 / m))
    metric: Array = np.zeros((m * whole + 1, m * whole + 1))
    metric[:-1, :-1] = np.kron(np.eye(m), each)
    metric[-1, -1] = 1.0 / width**2
    return metric


def tangent_of(chain: Chain, metric: Array, along: Array) -> Array:
    """Unit tangent of the branch that points along a given direction."""
    size = chain.residual.size
    matrix = np.block([[chain.jacobian(), chain.by_parameter.reshape(-1, 1)], [(metric @ along)[None, :]]])
    right = np.zeros(size + 1)
    right[-1] = 1.0
    tangent = np.linalg.solve(matrix, right)
    return tangent / math.sqrt(tangent @ metric @ tangent)


def point_of(problem: PeriodicProblem, chain: Chain, metric: Array, along: Array) -> Point:
    """The point of a solved chain."""
    tangent = tangent_of(chain, metric, along)
    return Point(orbit_of(problem, chain), problem, chain, tangent, metric)


def cubic(a: Point, b: Point, length: float, s: float) -> Array:
    """Unknowns at arclength s from a, on the cubic through two points ``length`` apart and their tangents."""
    r = s / length
    whole = (1.0 + 2.0 * r) * (1.0 - r) ** 2 * a.unknowns + r * r * (3.0 - 2.0 * r) * b.unknowns
    slopes: Array = length * (r * (1.0 - r) ** 2 * a.tangent + r * r * (r - 1.0) * b.tangent)
    return whole + slopes


def corrected(a: Point, guess: Array, straight: bool, slope: bool = False) -> Chain:
    """The branch near a guess: at its parameter if ``straight``, else at right angles to a's tangent.

    Raises OrbitError.
    """
    row = None if straight else a.metric @ a.tangent
    return newton(a.problem, guess[:-1].reshape(a.chain.x.shape), float(guess[-1]), row, slope, _MOST_ITERATIONS)


def moved(a: Point, guess: Array, straight: bool) -> Point:
    """The point of the branch near a guess; raises OrbitError."""
    return point_of(a.problem, corrected(a, guess, straight, True), a.metric, a.tangent)


def is_straight(*shares: float) -> bool:
    """Whether no fold is near, by the parameter's shares of some tangents."""
    least, most = min(np.abs(shares)), max(np.abs(shares))
    return bool(least > max(_STEEP, 0.3 * most) and abs(np.sign(shares).sum()) == len(shares))
