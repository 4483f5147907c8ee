"""Periodic motion by shooting, and Lyapunov exponents.

`shots` flies the parts of a period, `newton` corrects their states, `open_times` chooses where a shot may begin,
`shooting` puts them together, `periodic_orbit` is the result with its Floquet multipliers. Imports: `integration` and
the rooms below it. Begin with `shooting.orbit`.
"""

from solvers.orbits.newton import Border, newton, weights
from solvers.orbits.open_times import is_cut, quiet_begins, with_memory
from solvers.orbits.periodic_orbit import Orbit, OrbitError, at_zero, flown, orbit_of
from solvers.orbits.shooting import checked, checked_start, misfit, solved_chain
from solvers.orbits.shots import Chain, Problem, delayed

__all__ = [
    "Border",
    "Chain",
    "Orbit",
    "OrbitError",
    "Problem",
    "at_zero",
    "checked",
    "checked_start",
    "delayed",
    "flown",
    "is_cut",
    "misfit",
    "newton",
    "orbit_of",
    "quiet_begins",
    "solved_chain",
    "weights",
    "with_memory",
]
