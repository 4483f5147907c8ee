"""Places and directions as they are written: z of a beam, the name of a node or point, (member, distance).

A place of a joined body is (number of the body, its place).

Where a quantity is asked for at a place by name, the place and its direction stand together: ("lever", "z").
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

from fembeam.structures import COMPONENTS, Six, direction_of, named, turns
from fembeam.support import is_finite, is_name, is_numbered, is_pair, is_whole, require

if TYPE_CHECKING:
    Place: TypeAlias = Any
    Second: TypeAlias = Any
else:  # as a scene file on a beam gives them
    Place = float | str
    Second = float | tuple[int, float] | str
At: TypeAlias = tuple[Any, Any]  # (place, direction)


def unsigned(direction: Any) -> Any:
    """A direction by name without the "-" before it, which is the sign of `sign_of`.

    Examples
    --------
    >>> unsigned("-rz"), sign_of("-rz"), sign_of((0.0, -1.0))
    ('rz', -1.0, 1.0)
    """
    return direction.removeprefix("-") if isinstance(direction, str) else direction


def sign_of(direction: Any) -> float:
    """-1 of a name that begins with "-", else 1."""
    return -1.0 if isinstance(direction, str) and direction.startswith("-") else 1.0


def opposite(direction: Any) -> Any:
    """The direction turned round; None of none.

    Examples
    --------
    >>> opposite("-y"), opposite("x"), opposite((0.0, 2.0))
    ('y', '-x', (-0.0, -2.0))
    """
    if isinstance(direction, str):
        return direction[1:] if direction.startswith("-") else "-" + direction.removeprefix("+")
    return None if direction is None else tuple(-number for number in direction)


def is_place(value: Any) -> bool:
    """Whether a value can name a place: a finite number, a name, (member, distance), (body, place).

    Examples
    --------
    >>> [is_place(value) for value in (0.3, "lever", ("A-B", 0.4), None, (1, 2, 3), (1, "lever"))]
    [True, True, True, False, False, True]
    """
    if is_pair(value):
        return is_place(value[1]) if is_whole(value[0]) else is_name(value[0]) and is_finite(value[1])
    return is_finite(value) or is_name(value)


def quoted(place: Any) -> str:
    """Where something is, as messages have it: names in quotation marks, a number as z.

    Examples
    --------
    >>> quoted(0.25), quoted("lever"), quoted(("A-B", 0.4)), quoted((1, "lever"))
    ('z = 0.25', "'lever'", "0.4 m along 'A-B'", "'lever' of body 1")
    """
    if is_numbered(place):
        return f"{quoted(place[1]).removeprefix('z = ')} of body {place[0]}"
    if is_pair(place):
        return f"{place[1]} m along {place[0]!r}"
    return f"{place!r}" if isinstance(place, str) else f"z = {place}"


def scene_words(body: int) -> str:
    """For messages: the scene itself, or a further body of it by its number."""
    return f"bodies[{body - 1}] of Scene" if body else "Scene"


def body_words(body: int) -> str:
    """The same as a part of a sentence that ends with where it was said."""
    return f"bodies[{body - 1}]" if body else "the scene's own body"


def place_words(place: Any) -> str:
    """A place as names have it: a number is z in m.

    Examples
    --------
    >>> place_words(0.25), place_words("lever"), place_words(("A-B", 0.4)), place_words((1, "lever"))
    ('0.25 m', 'lever', 'A-B + 0.4 m', 'lever of body 1')
    """
    if is_numbered(place):
        inner = place[1]
        return f"{inner if is_whole(inner) else place_words(inner)} of body {place[0]}"
    if is_pair(place) and is_finite(place[1]):
        return f"{place[0]} + {place[1]:g} m"
    return f"{place:.6g} m" if is_finite(place) else str(place)


def turns_at(at: Any) -> bool:
    """Whether a place stands with a rotation: rad, not m.

    Examples
    --------
    >>> [turns_at(at) for at in (0.3, ("lever", "-x"), ("lever", "rx"), ("A-B", 0.4))]
    [False, False, True, False]
    """
    return is_directed(at) and turns(direction_of(at[1], "place"))


def is_directed(at: Any) -> bool:
    """Whether a place stands with a direction.

    Examples
    --------
    >>> [is_directed(at) for at in ("lever", ("lever", "-x"), ("A-B", 0.4), (1, "lever"), ("lever", (0, 1, 0)))]
    [False, True, False, False, True]
    """
    if not is_pair(at):
        return False
    way = at[1]
    if isinstance(way, str):
        return way.lstrip("+-") in COMPONENTS
    return isinstance(way, (tuple, list)) and all(is_finite(number) for number in way)


def split(at: Any, components: Sequence[str] = COMPONENTS) -> tuple[Any, Six]:
    """Place and direction of a pair; ValueError for a place alone, unless it has but one way to move.

    Examples
    --------
    >>> split((("A-B", 0.4), "x"))[0], split(("lever", (0, 1, 0)))[0]
    (('A-B', 0.4), 'lever')
    """
    pair = is_pair(at) and not is_finite(at[1])
    if not pair and len(components) == 1:
        return at, direction_of(components[0], "a place")
    require(pair, f"a place of a frame or structure needs a direction of {', '.join(components)}", at, "a place",
            f"write ({at!r}, {components[0]!r})")  # fmt: skip
    return at[0], direction_of(at[1], f"the place {quoted(at[0])}")


def directed_words(at: At) -> str:
    """A place and its direction, as names have them.

    Examples
    --------
    >>> directed_words(("lever", "-z"))
    'lever, -z'
    """
    place, along = at
    words = place_words(place) if is_pair(place) else str(place)
    return f"{words}, {along if isinstance(along, str) else named(direction_of(along, 'a place'))}"
