"""Loads by which supports move a structure: -K e, -(C + G) e and -M e with the signals e(t), ė(t), ë(t).

Every dof of a support that moves has these three, one after the other; they stand before all other loads.
"""

from __future__ import annotations

PER_DOF = 3  # loads of one dof: of its displacement, its speed and its acceleration


def loads_of_dof(number: int) -> range:
    """Where the three loads of a dof stand.

    Examples
    --------
    >>> list(loads_of_dof(1))
    [3, 4, 5]
    """
    return range(PER_DOF * number, PER_DOF * (number + 1))


def loads_of_order(order: int, dofs: int, first: int = 0) -> slice:
    """Where the loads by displacement (order 0), speed (1) or acceleration (2) of so many dofs stand, from a first on.

    Examples
    --------
    >>> list(range(12))[loads_of_order(1, dofs=3)]
    [1, 4, 7]
    """
    return slice(first + order, first + PER_DOF * dofs, PER_DOF)
