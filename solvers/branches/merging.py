"""Where two contacts of one stop become one, or one becomes two, and a branch goes over to another.

A law that latches its entry rate forgets it in the shortest flight. As the flight between two contacts vanishes, the
second is entered ever more slowly, down to its law's floor; without the flight the first one's rate still acts. So the
return map jumps, and a branch ends there. The way over the jump are orbits that touch the surface from within and go
on with any rate between both: no motions of the system, but those of every law that forgets gradually as the flight
grows. They lead from the end of one branch (the floor) to that of the other (the first contact's entry rate).
"""

from __future__ import annotations

import math

import numpy as np

from solvers.branches.grazing import Touch, solved
from solvers.branches.point import Point
from solvers.orbits import OrbitError
from solvers.problem import Array, SolverError

_MOST_STEPS = 60  # of the rate
_FACTORS = 1.02, 1.5, 4.0  # least, first and largest ratio of successive rates
_SAME = 1e-7  # relative difference of rates that are the same


def led(point: Point, touch: Touch, floor: float | None) -> Touch:
    """The touch with another rate, None: that of the contact before it, reached in steps; raises OrbitError."""
    known, factor = [touch], _FACTORS[1]
    for _ in range(_MOST_STEPS):
        last = known[-1]
        ratio = (floor or last.rate_before) / last.floor
        if abs(ratio - 1.0) < _SAME:
            return last
        following = last.floor * min(max(ratio, 1.0 / factor), factor)
        try:
            guess = _ahead(known[-3:], following)
            known.append(solved(point, last.stops, last.fractions, guess, 0.0, following))
            factor = min(factor**1.5, _FACTORS[2])
        except (SolverError, np.linalg.LinAlgError, ValueError, ArithmeticError):
            factor = math.sqrt(factor)
            if factor < _FACTORS[0]:
                break
    raise OrbitError("the way over the jump was lost")


def _ahead(known: list[Touch], rate: float) -> Array:
    """Guess of the unknowns at a rate: the polynomial in its logarithm through the ones known (Lagrange)."""
    places = np.log([touch.floor for touch in known])
    weights = [np.prod([(math.log(rate) - b) / (a - b) for b in places if b != a]) for a in places]
    guess: Array = sum(w * touch.unknowns for w, touch in zip(weights, known, strict=True))
    return guess
