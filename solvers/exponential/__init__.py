"""The main method: exact flight between contacts, forces by collocation within them, exact derivatives.

`method` has the settings and the loop over flights and contacts. `safe_steps` takes flight steps that miss no contact
and finds where one begins, by `first_contact`; `flight` evaluates them. The folder `contact` takes a step in contact
and locates where it ends, the folder `circles` has what circular clearances and friction add. `preparation` prepares a
system, `tables`, `block_tables`, `responses`, `phi_functions` and `steady_response` make the tables. The folder
`energy` has the energy balance and refuses runs that do not balance. `tangent`, `linearised`, `linearised_step` and
`linearised_border` differentiate a run; `many_starts` integrates many starts. Imports: `compiled`, `problem`. Its files
load machine code when imported; begin with `method`.
"""

from typing import Any

__all__ = ["Exponential"]


def __getattr__(name: str) -> Any:
    """The method, loaded with its machine code when it is asked for."""
    if name != "Exponential":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from solvers.exponential.method import Exponential

    return Exponential
