"""How to write one's own law with memory: plain functions for the force of each segment, its borders and renewals."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from contacts.custom import bound_values, changed_values
from contacts.custom_kernels import frozen, original
from contacts.law import Law
from contacts.memory.custom_kernels import LEAST, RELATIVE, Function, Pieces, compiled
from contacts.numbers import LARGEST_PARAMETER, check_number
from contacts.path import Piece, walk

PROBES = 0.01, 0.1, 1.0  # parts of its reach at which a law is led through a cycle when its parameters are bound
JUMP = 1e-6  # of the largest force on the way: what may change at a border by rounding
RATE = 0.1  # m/s, at which given slopes are compared with differences


@dataclass(frozen=True)
class Border:
    """Where a segment ends.

    Parameters
    ----------
    value : function that is > 0 inside the segment and falls through zero at its end; smooth, also a little beyond.
        A border at a reversal is the rate in the direction of the segment. Where it is nan, so is the force.
    to : name of the next segment.
    renew : function that returns the latched numbers of the next segment, one number or a tuple; None keeps them.
    """

    value: Function
    to: str
    renew: Function | None = None

    def __post_init__(self) -> None:
        _check_function(self.value, "value of Border")
        if self.renew is not None:
            _check_function(self.renew, "renew of Border")
        if not isinstance(self.to, str):
            raise TypeError(f"to of Border must be the name of a segment, got {self.to!r}")

    def of(self, change: Callable[[Function], Function]) -> Border:
        """The same with functions that are changed."""
        return Border(change(self.value), self.to, None if self.renew is None else change(self.renew))


@dataclass(frozen=True)
class Segment:
    """A part of a law's motion in which its force is smooth.

    Parameters
    ----------
    force : function that returns the force, smooth and defined a little beyond the borders.
    borders : one or several; () for a segment that never ends.
    slopes : function that returns ∂F/∂δ, ∂F/∂δ̇ and ∂F/∂(each latched number); None takes central differences.
    """

    force: Function
    borders: Border | tuple[Border, ...] = ()
    slopes: Function | None = None

    def __post_init__(self) -> None:
        _check_function(self.force, "force of Segment")
        if self.slopes is not None:
            _check_function(self.slopes, "slopes of Segment")
        ends = self.borders if isinstance(self.borders, (tuple, list)) else (self.borders,)
        wrong = [one for one in ends if not isinstance(one, Border)]
        if wrong:
            raise TypeError(f"borders of Segment must be a contacts.Border or several, got {wrong[0]!r}")

    @property
    def ends(self) -> tuple[Border, ...]:
        """The borders as a tuple."""
        return (self.borders,) if isinstance(self.borders, Border) else tuple(self.borders)

    def of(self, change: Callable[[Function], Function]) -> Segment:
        """The same with functions that are changed."""
        slopes = None if self.slopes is None else change(self.slopes)
        return Segment(change(self.force), tuple(end.of(change) for end in self.ends), slopes)


@dataclass(frozen=True)
class CustomMemoryLaw(Law):
    """A user's law with memory, its parameters bound; made by what `memory_law` returns, see there."""

    name: str
    segments: tuple[tuple[str, Segment], ...] = field(repr=False)
    latched: tuple[tuple[str, float], ...]
    values: tuple[tuple[str, float], ...]
    reach: float = 1e-3
    jumps: bool = False
    opens: bool = False

    varied: ClassVar[tuple[str, ...]] = ()  # beside its parameters

    def rebound(self, **values: float) -> CustomMemoryLaw:
        """The same law with other values of some parameters, checked as when it was bound."""
        made = replace(self, values=changed_values(self, values))
        _check_cycles(made)
        return made

    @property
    def pieces(self) -> Pieces:
        """Functions of all segments, with the places of those that follow."""
        places = {name: k for k, (name, _) in enumerate(self.segments)}
        ends = [tuple((end.value, end.renew, places[end.to]) for end in one.ends) for _, one in self.segments]
        return tuple((one.force, one.slopes, own) for (_, one), own in zip(self.segments, ends, strict=True))

    @property
    def parameters(self) -> NDArray[np.float64]:
        """(segment, latched numbers, parameters), at the start of a run."""
        return np.array([0.0, *(value for _, value in (*self.latched, *self.values))])

    @property
    def memory(self) -> tuple[int, ...]:  # type: ignore[override]
        """Segment and latched numbers."""
        return tuple(range(1 + len(self.latched)))

    @property
    def segment_codes(self) -> tuple[tuple[float, ...], ...]:  # type: ignore[override]
        """The segments in order."""
        return (tuple(map(float, range(len(self.segments)))), *[()] * len(self.latched))

    @property
    def borders(self) -> int:  # type: ignore[override]
        """As many as the segment with most of them has, at least one."""
        return max(1, *(len(one.ends) for _, one in self.segments))

    @property
    def events(self) -> tuple[str, ...]:  # type: ignore[override]
        """The segment that begins."""
        return tuple(name for name, _ in self.segments)

    @property
    def one_sided(self) -> bool:  # type: ignore[override]
        """A law that opens is one of a stop."""
        return self.opens

    @property
    def equation(self) -> str:  # type: ignore[override]
        """First lines of the docstrings of the segments' forces, or their names."""
        told = ((name, inspect.getdoc(one.force) or one.force.__name__) for name, one in self.segments)
        return "; ".join(f"{name}: {text.splitlines()[0]}" for name, text in told)

    @property
    def kernel(self) -> Any:
        """The compiled force."""
        return self.memory_kernel("")

    @property
    def gradient(self) -> Any:
        """Its derivatives."""
        return self.memory_kernel("gradient")

    def memory_kernel(self, name: str) -> Any:
        """Borders, renewals and their derivatives."""
        return compiled(self.pieces, len(self.latched), 1 + len(self.latched) + len(self.values), self.reach, name)

    def border_name(self, border: int, parameters: NDArray[np.float64]) -> str:
        """The border's function and its segment."""
        name, one = self.segments[int(parameters[0])]
        own = one.ends[border].value.__name__ if border < len(one.ends) else border
        return f"border {own!r} of segment {name!r}"

    def stored(self, delta: float, parameters: NDArray[np.float64]) -> float:
        """Not known of a user's law: nan."""
        return float("nan")

    def of(self, change: Callable[[Function], Function]) -> CustomMemoryLaw:
        """The same with functions that are changed."""
        return replace(self, segments=tuple((name, one.of(change)) for name, one in self.segments))

    def __reduce__(self) -> tuple:
        """Pickle by the names of its functions."""
        made = self.of(lambda function: original(function, f"law {self.name!r}"))
        return _frozen_law, tuple(getattr(made, one.name) for one in fields(made))


def _frozen_law(*parts: Any) -> CustomMemoryLaw:
    """A law of functions as they are at present."""
    return CustomMemoryLaw(*parts).of(frozen)


def memory_law(
    name: str,
    segments: Mapping[str, Segment],
    latched: Mapping[str, float] | None = None,
    *,
    reach: float = 1e-3,
    jumps: bool = False,
    opens: bool = False,
) -> Callable[..., CustomMemoryLaw]:
    """Make a law with memory of plain functions: the force in each segment, where it ends, what is latched there.

    All functions take the same arguments, ``(delta, delta_dot, latched numbers, parameters)``, and are compiled by
    numba, once; no integrator is recompiled. The entry rate of stops is not given: latch it.

    Parameters
    ----------
    name : to show.
    segments : `Segment` by name; a run begins in the first.
    latched : start value of every latched number by name, in the order of the arguments.
    reach : m, > 0, of the motion it is for; binding leads the law through slow cycles of 1 %, 10 % and 100 % of it, to
        find mistakes. Differences for derivatives suit motions down to 1e-3 of it.
    jumps : say True if the force jumps at a border.
    opens : say True if the first segment is that of an open stop: no force, and the law is for δ > 0 only.

    Returns
    -------
    A maker: call it with the parameters by keyword to get a law.

    Raises
    ------
    TypeError for functions with other arguments or that cannot be compiled; ValueError for segments that are not there.
    On binding: ValueError for borders that fall to zero again and again at one place, a force that is not finite, or
    one that jumps at a border without ``jumps=True``, and slopes that are not those of the force.

    Examples
    --------
    >>> def spring(delta, delta_dot, set, stiffness):
    ...     return stiffness * (delta - set)
    >>> spring_with_set = memory_law("spring with set", {"always": Segment(spring)}, {"set": 1e-4})
    >>> float(spring_with_set(stiffness=1e4).along([1e-3])[0])
    9.0
    """
    if not isinstance(name, str):
        raise TypeError(f"name of a law must be text, got {name!r}")
    if not isinstance(latched, (Mapping, type(None))):
        raise TypeError(f"latched of law {name!r} must be start values by name, got {latched!r}")
    for what, value in (("jumps", jumps), ("opens", opens)):
        if not isinstance(value, bool):
            raise TypeError(f"{what} of law {name!r} must be True or False, got {value!r}")
    starts = {
        key: check_number(value, f"start of latched {key!r} of law {name!r}", -np.inf)
        for key, value in (latched or {}).items()
    }
    size = check_number(reach, f"reach of law {name!r}", strict=True, most=LARGEST_PARAMETER)
    probe = _checked_functions(name, segments, starts)

    def bind(**values: float) -> CustomMemoryLaw:
        pairs = bound_values(name, probe, values)
        made = _frozen_law(name, tuple(segments.items()), tuple(starts.items()), pairs, size, jumps, opens)
        try:
            _check_cycles(made)
        except TypeError:  # of the compiler, which names no function
            _check_renewals(made)
            raise
        return made

    return bind


def _checked_functions(name: str, segments: Mapping[str, Segment], starts: Mapping[str, float]) -> inspect.Signature:
    """Signature of the parameters, the same in all functions; segments that follow exist."""
    if (
        not isinstance(segments, Mapping)
        or not segments
        or not all(isinstance(one, Segment) for one in segments.values())
    ):
        raise ValueError(f"segments of law {name!r} must be contacts.Segment by name, at least one, got {segments!r}")
    expected = ("delta", "delta_dot", *starts)
    first: Function = next(iter(segments.values())).force
    given = inspect.signature(first)
    if tuple(given.parameters)[: len(expected)] != expected:
        raise TypeError(
            f"functions of law {name!r} must take ({', '.join(expected)}, parameters...), but {first.__name__!r} takes "
            f"{given}"
        )
    for where, one in segments.items():
        for end in one.ends:
            if end.to not in segments:
                raise ValueError(f"law {name!r}: {where!r} ends in {end.to!r}; its segments are {', '.join(segments)}")
        for function in _functions(one):
            if tuple(inspect.signature(function).parameters) != tuple(given.parameters):
                raise TypeError(
                    f"functions of law {name!r} must take the same arguments, but {first.__name__!r} takes {given} and "
                    f"{function.__name__!r} {inspect.signature(function)}"
                )
    return inspect.Signature(list(given.parameters.values())[len(expected) :])


def _check_function(value: Any, what: str) -> None:
    """A plain function, which numba can compile."""
    if not inspect.isfunction(value):
        raise TypeError(f"{what} must be a plain function, got {value!r}")


def _functions(one: Segment) -> list[Function]:
    """All functions of a segment."""
    found = [one.force, one.slopes, *(f for end in one.ends for f in (end.value, end.renew))]
    return [function for function in found if function is not None]


def _check_renewals(law: CustomMemoryLaw) -> None:
    """Raise TypeError for a renewal that returns more or fewer numbers than are latched."""
    numbers = [value for _, value in (*law.latched, *law.values)]
    for renew in (end.renew for _, one in law.segments for end in one.ends if end.renew is not None):
        with suppress(ArithmeticError, ValueError):
            count = np.size(renew(law.reach, RATE, *numbers))
            if count != len(law.latched):
                raise TypeError(
                    f"renew {renew.__name__!r} of law {law.name!r} must return as many numbers as are latched, "
                    f"{len(law.latched)}, got {count}"
                )


def _check_cycles(law: CustomMemoryLaw) -> None:
    """Lead a law through slow cycles; the walk itself refuses borders that fall again and again and forces of nan."""
    for X in (part * law.reach for part in PROBES):
        path = X * np.array([0.0, 1.0, -1.0, 1.0, 0.3, 0.8, 0.0])
        largest = np.abs(law.along(path)).max()
        pieces = list(walk(law, path))
        for one in pieces:
            _check_slopes(law, one)
        for before, after in pairwise(pieces):
            left, right = (law.batch(1.0, one.parameters) for one in (before, after))
            at, rate = np.array([after.start]), np.array([after.rate])
            jump = float((right(at, rate) - left(at, rate))[0])
            if not law.jumps and not abs(jump) <= JUMP * largest:
                names = [law.events[int(one.parameters[0])] for one in (before, after)]
                raise ValueError(
                    f"force of law {law.name!r} jumps by {jump:.6g} N from {names[0]!r} to {names[1]!r} at δ = "
                    f"{after.start:.6g} m; if it is to, declare it with jumps=True, else correct what is latched there"
                )


def _check_slopes(law: CustomMemoryLaw, piece: Piece) -> None:
    """Compare the given slopes of a segment with differences of its force, within a piece of a path."""
    name, segment = law.segments[int(piece.parameters[0])]
    if segment.slopes is None or piece.start == piece.end:
        return
    count, row = len(law.latched), piece.parameters
    x = np.array([0.5 * (piece.start + piece.end), math.copysign(RATE, piece.rate), *row[1 : 1 + count]])
    given = np.array(segment.slopes(*x.tolist(), *row[1 + count :].tolist()), dtype=float)
    if given.shape != x.shape:
        raise TypeError(
            f"slopes of segment {name!r} of law {law.name!r} must return {x.size} numbers, got {given.size}"
        )
    expected, rounding = _differences(law, row, x)
    for what, one, right, least in zip(
        ("delta", "delta_dot", *(key for key, _ in law.latched)), given, expected, rounding, strict=True
    ):
        if not abs(one - right) <= 1e-3 * abs(right) + least:
            raise ValueError(
                f"slope of segment {name!r} of law {law.name!r} by {what} is {one:g} at δ = {x[0]:.6g} m, δ̇ = {x[1]:g} "
                f"m/s, but differences of the force give {right:g}"
            )


def _differences(law: CustomMemoryLaw, row: NDArray[np.float64], x: NDArray[np.float64]) -> tuple[Any, Any]:
    """Slopes of the force by δ, its rate and latched numbers, and what of them may be rounding."""
    found, rounding = np.empty(x.size), np.empty(x.size)
    for i, value in enumerate(x):
        h = RELATIVE * abs(value) + LEAST[min(i, 2)] * law.reach
        ends = [_force_at(law, row, x + side * h * (np.arange(x.size) == i)) for side in (-1.0, 1.0)]
        found[i], rounding[i] = (ends[1] - ends[0]) / (2.0 * h), 1e-12 * max(map(abs, ends)) / h
    return found, rounding


def _force_at(law: CustomMemoryLaw, row: NDArray[np.float64], x: NDArray[np.float64]) -> float:
    """The force at δ, its rate and latched numbers."""
    changed = row.copy()
    changed[1 : x.size - 1] = x[2:]
    return float(law.batch(1.0, changed)(x[:1], x[1:2])[0])
