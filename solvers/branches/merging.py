"""Where two contacts of one stop become one, or one becomes two, and a branch goes over to another.

A law with an entry rate takes a new one after any flight, however short. As the flight between two contacts vanishes,
the second is entered ever more slowly, down to the law's floor; without the flight the first one's rate still acts. So
the return map jumps, and a branch ends there. The two ends are joined by auxiliary orbits: they graze the surface from
within and continue with an entry rate that is a free parameter. They solve the same equations with another rate, not
the system itself; the rate is varied from the floor (end of one branch) to the first contact's (end of the other).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from solvers.branches.grazing import Grazing, solved
from solvers.branches.point import NO_ORBIT, Point
from solvers.orbits import OrbitError
from solvers.problem import Array

_MOST_STEPS = 60  # of the rate
_FACTORS = 1.02, 1.5, 4.0  # least, first and largest ratio of successive rates
_SAME = 1e-7  # relative difference of rates up to which they are the same


def led(point: Point, grazing: Grazing, floor: float | None) -> Grazing:
    """The grazing orbit continued to another rate, if None to that of the contact before; raises OrbitError."""
    known, factor = [grazing], _FACTORS[1]
    for _ in range(_MOST_STEPS):
        last = known[-1]
        ratio = (floor or last.rate_before) / last.meeting.floor
        if abs(ratio - 1.0) < _SAME:
            return last
        following = last.meeting.floor * min(max(ratio, 1.0 / factor), factor)
        try:
            guess = _ahead(known[-3:], following)
            known.append(solved(point, replace(last.meeting, floor=following), guess, 0.0))
            factor = min(factor**1.5, _FACTORS[2])
        except NO_ORBIT:
            factor = math.sqrt(factor)
            if factor < _FACTORS[0]:
                break
    raise OrbitError("the orbits that lead over the jump were lost")


def _ahead(known: list[Grazing], rate: float) -> Array:
    """Guess of the unknowns at a rate: Lagrange's polynomial in its logarithm through the known ones."""
    places = np.log([grazing.meeting.floor for grazing in known])
    weights = [np.prod([(math.log(rate) - b) / (a - b) for b in places if b != a]) for a in places]
    return sum(w * grazing.unknowns for w, grazing in zip(weights, known, strict=True))
