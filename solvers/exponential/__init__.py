"""The main method: exact flight between contacts, forces by collocation within them, exact derivatives.

`method` has the settings and the loop over flights and contacts. `safe_steps` takes flight steps that miss no contact
and finds where a contact begins, `flight` evaluates them; the folder `contact` takes a step in contact and locates
where it ends. `preparation` prepares a system, `tables`, `block_tables`, `responses` and `phi_functions` make the
tables. The folder `energy` has the energy balance and refuses runs that do not balance. `tangent`, `linearised` and
`linearised_step` differentiate a run; `many_starts` integrates many starts. Imports: `compiled`, `problem`. Its files
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
