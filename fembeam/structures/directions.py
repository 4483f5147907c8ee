"""Directions of motion: "x", "-y", "rz", or a vector, as numbers on the six components of a place.

Axes: z along a straight beam, y up, x = y × z. Rotations are vectors, so that u_z = -rx and x_z = +ry.
"""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from fembeam.structures.assembled import COMPONENTS, Assembled
from fembeam.support import is_finite, is_listed, require

Direction: TypeAlias = str | Sequence[float]
Six: TypeAlias = tuple[float, ...]  # one number for each of COMPONENTS
UP: Six = (0.0, 1.0, 0.0, 0.0, 0.0, 0.0)  # u of a beam
TURN: Six = (0.0, 0.0, 0.0, -1.0, 0.0, 0.0)  # its u_z
ADVICE = "write 'x', '-y', 'rz', or three numbers"


def direction_of(direction: Any, where: str) -> Six:
    """A direction as six numbers of length 1: displacements along x, y, z, rotations about them.

    Parameters
    ----------
    direction : one of "x", "y", "z", "rx", "ry", "rz", "-" before it turns it round; or a vector of three numbers, of
        two in the plane x, y.
    where : what asks, for the message.

    Raises
    ------
    ValueError : any other name, a vector of other length, of numbers that are not finite, or of length 0.

    Examples
    --------
    >>> direction_of("-y", "Stop"), direction_of((3, 4), "Stop")[:2]
    ((0.0, -1.0, 0.0, 0.0, 0.0, 0.0), (0.6, 0.8))
    """
    if isinstance(direction, str):
        sign, name = (-1.0, direction[1:]) if direction.startswith("-") else (1.0, direction.removeprefix("+"))
        require(name in COMPONENTS, f"direction must be one of {', '.join(COMPONENTS)}, or a vector", direction, where,
                ADVICE)  # fmt: skip
        return tuple(sign * (name == one) + 0.0 for one in COMPONENTS)
    vector = list(direction) if isinstance(direction, (list, tuple, np.ndarray)) and is_listed(direction) else []
    right = len(vector) in (2, 3) and all(is_finite(number) for number in vector)
    size = float(np.linalg.norm(vector)) if right else 0.0
    require(right and size > 0.0, "direction must be a name or a vector of two or three numbers, not all zero",
            direction, where, ADVICE)  # fmt: skip
    return (*(float(number) / size for number in vector), *(6 - len(vector)) * [0.0])


def turns(direction: Six) -> bool:
    """Whether a direction is a rotation: rad and N m.

    Examples
    --------
    >>> turns(direction_of("-rx", "")), turns(direction_of("x", ""))
    (True, False)
    """
    return any(direction[3:])


def named(direction: Six) -> str:
    """A direction in words: "x", "-rz", or its numbers.

    Examples
    --------
    >>> named(direction_of("-rx", "")), named(direction_of((3, 4), ""))
    ('-rx', '(0.6, 0.8, 0)')
    """
    along = [(name, number) for name, number in zip(COMPONENTS, direction, strict=True) if number]
    if len(along) == 1:
        return "-" * (along[0][1] < 0) + along[0][0]
    return f"({', '.join(f'{number:.4g}' for number in direction[:3])})"


def require_components(direction: Six, known: Sequence[str], what: str, where: str) -> None:
    """Raise ValueError unless a place moves along a direction; ``known`` are its components, ``what`` names it.

    Examples
    --------
    >>> require_components(direction_of("x", ""), ("x", "y"), "node 3", "Stop")
    """
    missing = [name for name, number in zip(COMPONENTS, direction, strict=True) if number and name not in known]
    require(not missing, f"{what} must move along {' and '.join(missing)}; it has {', '.join(known) or 'no dof'}",
            named(direction), where, "choose one of these")  # fmt: skip


def rows_along(body: Any, assembled: Assembled, place: Any, along: ArrayLike) -> sparse.csr_matrix:
    """The motion (k, N) of a body's place along directions (k, 6), or along one (6,)."""
    known = [COMPONENTS.index(component) for component in body.components]
    return (sparse.csr_matrix(np.atleast_2d(along)[:, known]) @ assembled.rows(place)).tocsr()


def nearest(name: object, known: Sequence[object]) -> str:
    """What may have been meant by a name that does not exist, as the end of a sentence.

    Examples
    --------
    >>> nearest("leverr", ["lever", "flange"]), nearest(21, [5, 20, 40])
    ("'lever' is the nearest there is", '20 is the nearest there is')
    >>> nearest(33, ["33", "34"])
    "there is '33', text in quotes"
    """
    texts = {str(one): one for one in known}
    if str(name) in texts:  # 33 for "33", or "33" for 33
        there = texts[str(name)]
        return f"there is {there!r}, {'text in quotes' if isinstance(there, str) else 'a number without quotes'}"
    if isinstance(name, (int, np.integer)) and (
        numbers := [one for one in known if isinstance(one, (int, np.integer))]
    ):
        return f"{min(numbers, key=lambda one: abs(one - name))!r} is the nearest there is"
    close = get_close_matches(str(name), list(texts), n=1, cutoff=0.0)
    return f"{texts[close[0]]!r} is the nearest there is" if close else "there is none"
