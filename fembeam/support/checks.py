"""Checks of arguments: what is wrong, the value, where, what to do."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

LARGEST = 1e50  # size of a number, its inverse the least of a positive one: works stay floats, as in `contacts`
LONG = 5.0  # lengths of a body, from where on a place off it looks like one in mm


def is_number(value: object) -> TypeGuard[float]:
    """Whether value is a real number of Python or NumPy, finite or not (booleans are not numbers here)."""
    return isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)


def is_finite(value: object) -> bool:
    """Whether value is a real number that can be computed with: finite and at most `LARGEST` in size."""
    try:
        return is_number(value) and math.fabs(value) <= LARGEST
    except OverflowError:  # a whole number beyond the floats
        return False


def is_whole(value: object) -> TypeGuard[int]:
    """Whether value is a whole number (booleans are not numbers here)."""
    return isinstance(value, (int, np.integer)) and not isinstance(value, bool)


def require(valid: bool, rule: str, got: object, where: str, advice: str) -> None:
    """Raise ValueError as `what, got, where; do` unless valid."""
    if not valid:
        shown = got if is_finite(got) or isinstance(got, float) else repr(got)
        given = got if isinstance(got, (tuple, list)) else [got]
        large = any(is_number(one) and not is_finite(one) and abs(one) < math.inf for one in given)
        size = f" and at most {LARGEST:g} in size" if large else ""
        raise ValueError(f"{rule}{size}, got {shown} in {where}; {advice}")


def require_finite(name: str, value: Any, where: str, advice: str, bound: str = "", valid: bool = True) -> None:
    """Raise ValueError unless value is a number, finite and at most `LARGEST`, and valid by a bound told in words."""
    require(is_number(value), f"{name} must be a number", value, where, advice)
    require(is_finite(value) and valid, f"{name} must be finite{bound}", value, where, advice)


def require_positive(name: str, value: Any, where: str, advice: str) -> None:
    """Raise ValueError unless value is finite and > 0."""
    require_finite(name, value, where, advice, " and positive", is_finite(value) and value > 0)
    require(float(value) >= 1.0 / LARGEST, f"{name} must be at least {1.0 / LARGEST:g}", value, where, advice)


def require_non_negative(name: str, value: Any, where: str, advice: str) -> None:
    """Raise ValueError unless value is finite and >= 0."""
    require_finite(name, value, where, advice, " and not negative", is_finite(value) and value >= 0)


def require_switch(name: str, value: Any, where: str, advice: str = "without quotes") -> None:
    """Raise ValueError unless value is True or False: "no" counts as true in Python."""
    require(isinstance(value, (bool, np.bool_)), f"{name} must be True or False", value, where, advice)


def require_seed(value: Any, where: str) -> None:
    """Raise ValueError unless value is a seed of random numbers."""
    require(is_whole(value) and value >= 0, "seed must be a whole number of at least 0", value, where, "e.g. 1")


def in_mm(value: Any, most: float) -> str:
    """For messages: a length in m that lies beyond the largest one, and would not in mm.

    Examples
    --------
    >>> "move it" + in_mm(300, 1.5), "move it" + in_mm(2.0, 1.5)
    ('move it, or is it in mm?', 'move it')
    """
    meant = is_finite(value) and value > LONG * most and 1e-3 * value <= most
    return ", or is it in mm?" if meant else ""


def is_name(value: object) -> TypeGuard[str]:
    """Whether value is text that names something: neither empty nor a decimal number in quotes; "33" may be a node."""
    if isinstance(value, str) and value.isdecimal():
        return True
    try:
        float(value)  # type: ignore[arg-type]
    except ValueError:
        return isinstance(value, str) and bool(value.strip())
    except (TypeError, OverflowError):  # the latter of a whole number beyond the floats
        return False
    return False


def is_listed(value: Any) -> bool:
    """Whether a value is several in a row: no text, and no array of NumPy without a length."""
    return hasattr(value, "__iter__") and not isinstance(value, str) and getattr(value, "ndim", 1) > 0


def is_one_of(value: Any, names: Iterable[str]) -> bool:
    """Whether a value is one of the words; an array, which ``in`` would compare with each, is none."""
    return isinstance(value, str) and value in names


def is_pair(value: Any) -> bool:
    """Whether a value is two things in a row."""
    return isinstance(value, (tuple, list)) and len(value) == 2


def is_numbered(place: Any) -> bool:
    """Whether a place is (number of a body, its place)."""
    return is_pair(place) and is_whole(place[0])


def require_place(z: Any, part: object) -> None:
    """Raise ValueError unless z is a place for a part of a scene: a coordinate along a beam, or a name."""
    if is_numbered(z) and z[0] >= 0:
        return require_place(z[1], part)
    if is_name(z) or (is_pair(z) and is_name(z[0]) and is_finite(z[1])):
        return
    require_finite("z", z, type(part).__name__, "give the coordinate along the beam in m")


def number(name: str, value: Any, above: float = -math.inf, least: float = -math.inf) -> float:
    """The value as a finite float above one bound and not below another, or a clear error."""
    try:
        if isinstance(value, (str, bytes, bool, np.bool_, complex, np.complexfloating)):
            raise TypeError
        result = float(value)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be a number, got {value!r}") from None
    except OverflowError:
        result = math.inf
    if not (math.isfinite(result) and result > above and result >= least):
        bound = f" above {above:g}" if above > -math.inf else f" of at least {least:g}"
        raise ValueError(f"{name} must be finite{bound if max(above, least) > -math.inf else ''}, got {value!r}")
    if abs(result) > LARGEST or (above == 0.0 and result < 1.0 / LARGEST):
        bound = f"at most {LARGEST:g} in size" if abs(result) > LARGEST else f"at least {1.0 / LARGEST:g}"
        raise ValueError(f"{name} must be {bound}, got {value!r}")
    return result


def numbers(name: str, values: Any, where: str, advice: str) -> NDArray[np.float64]:
    """Real numbers of any shape as a new array of floats, nan and inf among them, or a clear error."""
    try:
        given = np.asarray(values)
    except ValueError:  # rows of unequal length
        given = np.asarray(None)
    right = given.dtype.kind in "iuf" and not has_switches(values)
    require(right, f"{name} must be real numbers", values, where, advice)
    return given.astype(np.float64)


def has_switches(values: Any) -> bool:
    """Whether True or False stand among numbers, in rows of equal length, which NumPy takes for 1 and 0.

    Examples
    --------
    >>> has_switches([[0.5, True], [1, 2]]), has_switches([0.5, 1])
    (True, False)
    """
    if isinstance(values, np.ndarray) and values.dtype != object:
        return values.dtype == bool
    if not isinstance(values, (list, tuple, np.ndarray)):
        return isinstance(values, (bool, np.bool_))
    listed = values.ravel().tolist() if isinstance(values, np.ndarray) else values
    kinds = set(map(type, listed))  # of many numbers quicker than each by itself
    nested = not kinds.isdisjoint((list, tuple, np.ndarray))
    return not kinds.isdisjoint((bool, np.bool_)) or (nested and any(map(has_switches, listed)))


def vector(
    name: str, values: Any, where: str, advice: str, rule: str, valid: Callable[[NDArray[np.float64]], Any]
) -> NDArray[np.float64]:
    """One number or a row of them (k,), all valid by a rule told in words, or a clear error."""
    found = np.atleast_1d(numbers(name, values, where, advice))
    right = found.ndim == 1 and found.size > 0 and bool(np.all(valid(found)))
    require(right, f"{name} {rule}", values, where, advice)
    largest = float(np.abs(found).max())
    require(largest <= LARGEST, f"{name} must be finite", largest, where, advice)
    return found


def native(value: Any) -> Any:
    """A number of Python for one of NumPy, also within a tuple; what is neither as it is.

    Small and unsigned whole numbers of NumPy would wrap around.

    Examples
    --------
    >>> -native(np.uint8(1)), native((np.int16(300), 0.5))[0] ** 3, native("lever")
    (-1, 27000000, 'lever')
    """
    if isinstance(value, np.integer):
        return int(value)
    if isinstance(value, np.floating):
        return float(value)
    return tuple(map(native, value)) if type(value) is tuple else value


def make_native(part: Any) -> None:
    """Make the numbers in the fields of a frozen dataclass those of Python."""
    for name, value in vars(part).items():
        object.__setattr__(part, name, native(value))


def tuples(value: Any) -> Any:
    """Tuples for lists, as files have them: of places, directions, pairs of these.

    Examples
    --------
    >>> tuples("lever"), tuples(["A-B", 0.4]), tuples([["A-B", 0.4], "x"])
    ('lever', ('A-B', 0.4), (('A-B', 0.4), 'x'))
    """
    return tuple(tuples(one) for one in value) if isinstance(value, list) else value


def frozen(values: ArrayLike) -> NDArray[np.float64]:
    """A read-only copy, so that neither side can change the other's numbers."""
    result = np.array(values, dtype=np.float64)
    result.flags.writeable = False
    return result
