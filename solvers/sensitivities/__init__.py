"""Derivatives of a whole motion by its start and by a parameter: states, contact times, peak forces, impulses.

`nearby` differences the data of a system, `laws` calls compiled laws and their derivatives, `elements` has the forces
of stops on lines, of circular clearances and of friction, `panels` integrates linear modes under forces given at nodes,
`stretches` divides a run at its events, `sampled` where loads are quick, `events` has the jumps there, `flow` solves
the variational equation in between, `variation` follows a run and collects the results. Imports: `integration` and what
it imports. Begin with `variation.sensitivity`.
"""

from solvers.sensitivities.events import NoDerivativeError
from solvers.sensitivities.nearby import Nearby, indentation_change
from solvers.sensitivities.variation import Sensitivity, sensitivities, sensitivity
