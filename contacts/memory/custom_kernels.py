"""Compiling a user's law with memory: scalar functions per segment and border into the six kernels.

Every function takes (δ, δ̇, latched numbers, parameters); a row of parameters is (segment, latched numbers, parameters).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache, lru_cache
from typing import Any

import numpy as np

from contacts.custom_kernels import Function, batch_of, gradient_batch, inner, kept, or_say_where

Pieces = tuple[tuple[Function, Function | None, tuple[tuple[Function, Function | None, int], ...]], ...]
LEAST = 1e-8, 1e-5, 1e-6  # steps of differences at zero, in units of a law's reach: of δ, its rate, a latched number
RELATIVE = 1e-5


@lru_cache(maxsize=256)
def compiled(pieces: Pieces, latched: int, count: int, reach: float, name: str) -> Any:
    """One kernel of segments (force, slopes, borders (value, renewal, next)) with ``count`` numbers in a row."""
    signature, function = _kernels(pieces, latched, count, reach)[name]
    return or_say_where(lambda: kept(signature, function), pieces[0][0], "law with memory")


@lru_cache(maxsize=256)
def _kernels(pieces: Pieces, latched: int, count: int, reach: float) -> dict[str, tuple[Any, Function]]:
    """Signature and function of every kernel by name; nothing is compiled yet."""
    from contacts.kernels import GRADIENT, SIGNATURE
    from contacts.sum_kernels import RENEW, RENEW_GRADIENT

    scalar, several = cache(inner), 2 + latched  # what serves several segments is compiled once
    least = tuple(part * reach for part in LEAST)
    width = max(1, *(len(borders) for *_, borders in pieces))
    padded = [border for *_, borders in pieces for border in (*borders, *[None] * width)[:width]]
    force = _chosen([_read(scalar(f)) for f, *_ in pieces])
    slopes = [_floats(scalar(s), several) if s else _slopes(scalar(f), several, least) for f, s, _ in pieces]
    value = _chosen([_read(scalar(b[0])) if b else _nowhere() for b in padded])
    renewals = [_floats(scalar(b[1]), latched) if b and b[1] else _kept(latched) for b in padded]
    renewal_slopes = [_jacobian(f, latched, several, least) for f in renewals]
    following = tuple(float(b[2]) if b else 0.0 for b in padded)
    forces, by_point, by_memory, borders = _points(force, _chosen(slopes), value, latched, width)
    return {
        "": (SIGNATURE, batch_of(forces, count)),
        "gradient": (GRADIENT, gradient_batch(by_point, count)),
        "memory_gradient": (SIGNATURE, batch_of(by_memory, count)),
        "borders": (SIGNATURE, batch_of(borders, count)),
        "renew": (RENEW, _renew(_chosen(renewals), following, width, latched, count)),
        "renew_gradient": (RENEW_GRADIENT, _renew_gradient(_chosen(renewal_slopes), width, latched, count)),
    }


def _given(delta: float, delta_dot: float, row: tuple[float, ...]) -> tuple[float, ...]:
    """Arguments of a user's function; as one sum, which compiles where unpacking does not."""
    motion = delta, delta_dot
    return motion + row[1:]


def _chosen(functions: Sequence[Function]) -> Function:
    """The function of a number, called with a tuple: a chain of branches, as compiled code holds no such list."""

    def either(k: int, function: Function, rest: Function | None) -> Function:
        if rest is None:
            return inner(lambda s, given: function(given))

        def pick(s, given):  # type: ignore[no-untyped-def]
            if s == k:
                return function(given)
            return rest(s, given)

        return inner(pick)

    chain = None
    for k in range(len(functions) - 1, -1, -1):
        chain = either(k, functions[k], chain)
    assert chain is not None
    return chain


@lru_cache(maxsize=256)
def _read(function: Function) -> Function:
    """A user's function of a tuple."""
    return inner(lambda given: function(*given))


@lru_cache(maxsize=256)
def _nowhere() -> Function:
    """A border that does not exist."""
    return inner(lambda given: 1.0)


@lru_cache(maxsize=256)
def _kept(latched: int) -> Function:
    """A renewal that changes nothing but the segment; no number latched counts as one, as in `_floats`."""
    from numba.cpython.unsafe.tuple import tuple_setitem

    start = (0.0,) * max(1, latched)

    def keep(given):  # type: ignore[no-untyped-def]
        out = start
        for i in range(latched):
            out = tuple_setitem(out, i, given[2 + i])
        return out

    return inner(keep)


@lru_cache(maxsize=256)
def _floats(function: Function, count: int) -> Function:
    """A user's function of a tuple that returns one number or a tuple of several, of any types: they become floats."""

    def entry(i: int, rest: Function | None) -> Function:
        def one(new):  # type: ignore[no-untyped-def]
            return (float(new[i]),)

        def more(new):  # type: ignore[no-untyped-def]
            first = (float(new[i]),)
            return first + rest(new)

        return inner(one if rest is None else more)

    if count <= 1:
        return inner(lambda given: (float(function(*given)),))
    chain = entry(count - 1, None)
    for i in range(count - 2, -1, -1):
        chain = entry(i, chain)
    return inner(lambda given: chain(function(*given)))


@lru_cache(maxsize=256)
def _slopes(force: Function, columns: int, least: tuple[float, ...]) -> Function:
    """Derivatives of a force by its first arguments by central differences; without arrays, which are counted."""
    from numba.cpython.unsafe.tuple import tuple_setitem

    start = (0.0,) * columns

    def slopes(given):  # type: ignore[no-untyped-def]
        out = start
        for c in range(columns):
            x = given[c]
            h = RELATIVE * abs(x) + least[min(c, 2)]
            above, below = force(*tuple_setitem(given, c, x + h)), force(*tuple_setitem(given, c, x - h))
            out = tuple_setitem(out, c, (float(above) - float(below)) / (2.0 * h))
        return out

    return inner(slopes)


@lru_cache(maxsize=256)
def _jacobian(function: Function, rows: int, columns: int, least: tuple[float, ...]) -> Function:
    """Writes derivatives of what a function of a tuple returns by its first entries, by central differences."""
    from numba.cpython.unsafe.tuple import tuple_setitem

    def fill(to):  # type: ignore[no-untyped-def]
        table, given = to
        for c in range(columns):
            x = given[c]
            h = RELATIVE * abs(x) + least[min(c, 2)]
            above, below = function(tuple_setitem(given, c, x + h)), function(tuple_setitem(given, c, x - h))
            for i in range(rows):
                table[i, c] = (above[i] - below[i]) / (2.0 * h)

    return inner(fill)


def _points(force: Function, slopes: Function, value: Function, latched: int, width: int) -> tuple[Function, ...]:
    """Force, its derivatives by the motion and by the latched numbers, and borders, at n points.

    The force is nan where a border of its segment is, which would else never be met.
    """
    given = inner(_given)

    def forces(n, delta, delta_dot, entry_rate, row, out):  # type: ignore[no-untyped-def]
        for i in range(n):
            at = given(delta[i], delta_dot[i], row)
            out[i] = force(row[0], at)
            for j in range(width):
                if math.isnan(value(row[0] * width + j, at)):
                    out[i] = math.nan

    def by_point(n, delta, delta_dot, entry_rate, row, by_delta, by_rate, by_entry):  # type: ignore[no-untyped-def]
        for i in range(n):
            found = slopes(row[0], given(delta[i], delta_dot[i], row))
            by_delta[i], by_rate[i], by_entry[i] = found[0], found[1], 0.0

    def by_memory(n, delta, delta_dot, entry_rate, row, rows):  # type: ignore[no-untyped-def]
        for i in range(n):
            found = slopes(row[0], given(delta[i], delta_dot[i], row))
            rows[i] = 0.0
            for k in range(latched):
                rows[(1 + k) * n + i] = found[2 + k]

    def borders(n, delta, delta_dot, entry_rate, row, values):  # type: ignore[no-untyped-def]
        for j in range(width):
            for i in range(n):
                values[j * n + i] = value(row[0] * width + j, given(delta[i], delta_dot[i], row))

    return tuple(inner(f) for f in (forces, by_point, by_memory, borders))


def _renew(renewal: Function, following: tuple[float, ...], width: int, latched: int, count: int) -> Function:
    """The renewal of the latched numbers, nan where it raises, and of the segment, whose place is the event."""
    from numba import carray
    from numba.np.unsafe.ndarray import to_fixed_tuple

    given, unknown = inner(_given), (math.nan,) * max(1, latched)

    def renew(j, delta, delta_dot, entry_rate, parameters):  # type: ignore[no-untyped-def]
        row, out = to_fixed_tuple(carray(parameters, (count,)), count), unknown
        place = int(row[0]) * width + j
        try:
            out = renewal(place, given(delta, delta_dot, row))
        except Exception:
            out = unknown
        for k in range(latched):
            parameters[1 + k] = out[k]
        parameters[0] = following[place]
        return int(following[place])

    return renew


def _renew_gradient(slopes: Function, width: int, latched: int, count: int) -> Function:
    """Derivatives of the renewal, nan where it raises; those by and of the segment are zero."""
    from numba import carray
    from numba.np.unsafe.ndarray import to_fixed_tuple

    columns, given = 3 + latched, inner(_given)

    def renew_gradient(j, delta, delta_dot, entry_rate, parameters, out):  # type: ignore[no-untyped-def]
        row, table = to_fixed_tuple(carray(parameters, (count,)), count), np.zeros((latched, 2 + latched))
        for k in range(latched):
            table[k, 2 + k] = 1.0
        try:
            if j >= 0:
                slopes(int(row[0]) * width + j, (table, given(delta, delta_dot, row)))
        except Exception:
            table[:] = math.nan
        for i in range((1 + latched) * columns):
            out[i] = 0.0
        for k in range(latched):
            for c in range(2 + latched):
                out[(1 + k) * columns + (c if c < 2 else c + 1)] = table[k, c]

    return renew_gradient
