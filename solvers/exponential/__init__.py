"""The main method: exact flight between contacts, forces by collocation within them, exact derivatives.

`method` is the loop, `preparation` and `tables` make its numbers, `responses` and `block_tables` those that grow with
blocks and stops, `flight` and `safe_steps` move free of contact, the folder `contact` holds one step in contact; the
folder `energy` keeps the energy balance and refuses runs that do not balance; `linearised`, `linearised_step` and
`tangent` differentiate a run, `many` takes many starts to their ends. Imports: `compiled`, `problem`. Its files load
machine code when imported; begin with `method`.
"""

from typing import Any

__all__ = ["Exponential"]


def __getattr__(name: str) -> Any:
    """The method, loaded with its machine code when it is asked for."""
    if name != "Exponential":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from solvers.exponential.method import Exponential

    return Exponential
