"""Periodic motion by shooting, and Lyapunov exponents.

`shots` integrates the parts of a period, `newton` corrects their states, `open_times` chooses where a shot may begin,
`shooting` puts them together, `periodic_orbit` is the result with its Floquet multipliers. Imports: `integration` and
the rooms below it. Begin with `shooting.orbit`.
"""

from solvers.orbits.newton import Border, newton, weights
from solvers.orbits.open_times import is_cut, latching_stops, open_begins
from solvers.orbits.periodic_orbit import Orbit, OrbitError, at_zero, flown, orbit_of
from solvers.orbits.shooting import checked, checked_start, misfit, solved_chain
from solvers.orbits.shots import Chain, PeriodicProblem, delayed

__all__ = [
    "Border",
    "Chain",
    "Orbit",
    "OrbitError",
    "PeriodicProblem",
    "at_zero",
    "checked",
    "checked_start",
    "delayed",
    "flown",
    "is_cut",
    "latching_stops",
    "misfit",
    "newton",
    "open_begins",
    "orbit_of",
    "solved_chain",
    "weights",
]
