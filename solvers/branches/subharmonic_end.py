"""Where a subharmonic branch ends: at a flip of the branch of half its period, beyond which it would retrace itself.

Along a branch of period T the difference d(x) = Φ_{T/2}(x) - x over half a period vanishes and changes its sign there,
and the branch folds. The end is located on the branch of half the period, as its flip.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from solvers.branches.bifurcations import indicators
from solvers.branches.point import Point
from solvers.orbits import Orbit, OrbitError, newton, orbit_of, states_at, why_not_periodic
from solvers.problem import Array, System

_SHARP = 1e-10  # of the span: the parameter itself may be 0 there


@dataclass(frozen=True)
class Scaled:
    """A family with a multiple of its period."""

    make: Callable[[float], tuple[System, float]]
    factor: float

    def __call__(self, parameter: float) -> tuple[System, float]:
        """The member at a parameter."""
        system, period = self.make(parameter)
        return system, self.factor * period


def subharmonic_end(a: Point, b: Point, fold: Orbit) -> Orbit | None:
    """The flip of half the period that a fold between two points of a branch really is; None if it is a plain fold."""
    if why_not_periodic(fold.system, 0.5 * fold.period) or a.problem.fractions != b.problem.fractions:
        return None
    before, after = (_half_apart(point.orbit) for point in (a, b))
    if before @ a.metric[: len(before), : len(before)] @ after >= 0.0:
        return None
    try:
        return _flip(a, fold)
    except (OrbitError, np.linalg.LinAlgError, ArithmeticError, RuntimeError):
        return None


def _half_apart(orbit: Orbit) -> Array:
    """d(x) of an orbit, its change over half a period."""
    return states_at(orbit, [0.5 * orbit.period])[0] - orbit.whole


def _flip(a: Point, fold: Orbit) -> Orbit | None:
    """The flip near a fold of twice the period, as an orbit of twice the period."""
    from scipy.optimize import newton as secant

    begin = a.problem.fractions[0]
    half = replace(a.problem, make=Scaled(a.problem.make, 0.5), fractions=(2.0 * begin % 1.0,))
    x = (fold.whole + 0.5 * _half_apart(fold))[None, :]

    def indicator(parameter: float) -> float:
        return indicators(orbit_of(half, newton(half, x, parameter)), a.tangent)["flip"]

    apart, width = a.chain.parameter - fold.parameter, float(a.metric[-1, -1] ** -0.5)
    step = 0.01 * apart or 1e-6 * width
    place = float(secant(indicator, fold.parameter, x1=fold.parameter + step, tol=_SHARP * width))
    if not abs(place - fold.parameter) <= 1e-3 * abs(apart) + 1e-6 * width:
        return None
    found, whole = newton(half, x, place), replace(a.problem, fractions=(begin,))
    chain = replace(whole.evaluate(found.x, place), error=found.error, iterations=found.iterations)
    return orbit_of(whole, chain, "flip")
