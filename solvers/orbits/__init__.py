"""Periodic motion by shooting, and Lyapunov exponents.

`shots` integrates the parts of a period, `newton` corrects their states, `open_times` chooses where a shot may begin,
`whole_state` appends the latched numbers to a state, `shooting` puts all together, `periodic_orbit` is the result with
its Floquet multipliers. Imports: `integration` and what it imports. Begin with `shooting.orbit`.
"""

from solvers.orbits.newton import newton, weights
from solvers.orbits.open_times import is_cut, latching_stops, open_starts
from solvers.orbits.periodic_orbit import Orbit, OrbitError, at_zero, orbit_of, states_at
from solvers.orbits.shooting import (
    MORE_DAMPING,
    checked,
    checked_start,
    orbit_by_damping,
    periods_of_decay,
    settled,
    solved_chain,
    why_not_periodic,
)
from solvers.orbits.shots import Chain, PeriodicProblem, constant, delayed
from solvers.orbits.whole_state import codes, counts, rate_at_end, run, state_after, with_initial_memory
