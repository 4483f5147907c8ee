"""Quasi-static force of a law along a given path of δ: exact between borders, which are found to rounding.

The rate enters by its sign alone, so that dashpots give nothing. A path is cut into runs at its turning points
and runs into stretches at the borders: all borders that are below zero, and stay so, are renewed together.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contacts.law import BATCH, Law
from contacts.numbers import reals

Vector = NDArray[np.float64]
SLOW = 1e-100  # m/s: a sign, hardly a force
SAMPLES = np.linspace(0.0, 1.0, 17)  # of the borders over a run; one that dips below zero between two is not seen
NEAR = 2.0**-20  # part of a run over which a border that is zero to rounding is seen to rise or fall, ...
ROUNDING = 64.0  # ... or spacings of numbers as large as the path, over which one that soon falls again is seen to rise
_REALS = ctypes.POINTER(ctypes.c_double)


@dataclass(frozen=True)
class Piece:
    """A piece of a path without a border: from ``start`` to ``end``, within the points ``first`` to ``last``."""

    start: float
    end: float
    first: int
    last: int
    rate: float
    parameters: Vector


def along(law: Law, delta: ArrayLike) -> Vector:
    """Force at every point of a path; see `Law.along`."""
    path = _checked(law, delta)
    forces = np.empty(path.size)
    for one in walk(law, path):
        points = path[one.first : one.last + 1]
        inside = (points >= min(one.start, one.end)) & (points <= max(one.start, one.end))
        forces[one.first : one.last + 1][inside] = _force(law, points[inside], one)
    return forces


def work(law: Law, delta: ArrayLike) -> float:
    """Work done on a law along a path, ∫F dδ in J: the area of a closed loop; see `Law.along`."""
    nodes, weights = np.polynomial.legendre.leggauss(16)
    total = 0.0
    for one in walk(law, _checked(law, delta)):
        half, middle = 0.5 * (one.end - one.start), 0.5 * (one.end + one.start)
        total += half * float(weights @ _force(law, middle + half * nodes, one))
    return total


def walk(law: Law, path: Vector, start: Vector | None = None) -> Iterator[Piece]:
    """The pieces of a path, one after the other; their parameters are not kept by the next.

    ``start`` : parameters with what is latched at the first point; None: those of a law at its start.
    """
    row = law.parameters if start is None else start.copy()
    tiny = ROUNDING * float(np.spacing(np.abs(path).max()))
    for first, last in monotone_runs(path):
        begin, end = float(path[first]), float(path[last])
        rate = math.copysign(SLOW, end - begin)
        goal = end if end != begin else begin + ROUNDING * tiny  # a path that rests is one about to rise
        for a, b in _pieces(law, row, begin, goal, rate, tiny):
            yield Piece(a, b if end != begin else begin, first, last, rate, row.copy())


def name_of(law: Law) -> str:
    """A law's class, or the name of a user's own."""
    return str(getattr(law, "name", type(law).__name__))


def _checked(law: Law, delta: ArrayLike) -> Vector:
    path = reals(delta, f"path of {name_of(law)}")
    if path.ndim != 1 or not path.size or not np.all(np.isfinite(path)):
        raise ValueError(
            f"path of {name_of(law)} must be a row of finite indentations in m, got an array of shape "
            f"{path.shape}{'' if np.all(np.isfinite(path)) else ' that holds nan or inf'}"
        )
    return path


def monotone_runs(path: Vector) -> Iterator[tuple[int, int]]:
    """First and last point of every monotone run of a path."""
    steps = np.sign(np.diff(path))
    moving = np.flatnonzero(steps)
    turns = moving[1:][steps[moving[1:]] != steps[moving[:-1]]].tolist()
    ends = [0, *turns, path.size - 1]
    yield from pairwise(ends)


def _pieces(law: Law, row: Vector, at: float, goal: float, rate: float, tiny: float) -> Iterator[tuple[float, float]]:
    """Begin and end of every stretch of a run; renews the row between them."""
    near, since, met = max(NEAR * abs(goal - at), tiny), at, list[str]()
    borders = borders_of(law, rate, row)
    while True:
        if abs(at - since) > near:
            since, met = at, []
        length = abs(goal - at)
        ahead = np.unique(np.minimum([tiny, NEAR * length, *length * SAMPLES[1:-1]], length))
        points = np.concatenate(([at], at + math.copysign(1.0, goal - at) * ahead, [goal]))
        values = borders(points)
        fired = np.flatnonzero(np.all(values[:, :3] < 0.0, axis=1))
        if fired.size and at != goal:
            met += [law.border_name(int(j), row) for j in fired]
            _check_met(law, met, at, rate)
            for j in fired:
                renew(law, int(j), at, rate, row)
            continue
        floor = np.minimum(values[:, :1], 0.0)  # a border may begin a little below zero, by rounding, and rise
        fallen = np.any(values[:, 1:] < floor, axis=0)
        if at == goal or not np.any(fallen):
            yield at, goal
            return
        k = int(np.argmax(fallen))
        end = _first_fallen(borders, points[k], points[k + 1], floor)
        yield at, end
        at = end
        met.append(law.border_name(int(np.argmin(borders(np.array([at])))), row))
        _check_met(law, met, at, rate)


def _first_fallen(borders: Callable[[Vector], Vector], low: float, high: float, floor: Vector) -> float:
    """Where the first border falls below its floor between two points, to rounding: at ``high`` it has."""
    least = abs(high - low) * 2.0**-60  # whose rounding will do at δ = 0, where numbers have no least spacing
    while True:
        points = low + (high - low) * SAMPLES
        points[-1] = high
        k = int(np.argmax(np.any(borders(points[1:]) < floor, axis=0)))
        if points[k] == low and points[k + 1] == high:
            return high
        if abs(high - low) <= 2.0 * np.spacing(max(abs(high), abs(low), least)):
            return high
        low, high = float(points[k]), float(points[k + 1])


def _check_met(law: Law, met: list[str], at: float, rate: float) -> None:
    """Refuse a law that meets border after border while the path hardly moves: it would do so for ever.

    At one place every part of a law may begin to stick and to slip, and every segment may be passed, twice at most;
    each is met as a border that falls and as one that is renewed.
    """
    if len(met) <= 8 * (law.borders + len(law.events)):
        return
    first, *others = sorted(set(met[len(met) // 2 :]))
    told = f", in turn with {', '.join(others)}" if others else ""
    sign = ">" if rate > 0.0 else "<"
    raise ValueError(
        f"{first} of {name_of(law)} falls to zero again and again at δ = {at:.6g} m, δ̇ {sign} 0{told}: after a renewal "
        "the borders of the segment that begins must be positive, or zero and rising. Check the sign of these borders, "
        "what is latched there, and which segment follows"
    )


def borders(law: Law, delta: Vector, rate: float, row: Vector) -> Vector:
    """Border functions of a law at points, (B, n)."""
    return borders_of(law, rate, row)(delta)


def borders_of(law: Law, rate: float, row: Vector) -> Callable[[Vector], Vector]:
    """`borders` as a lean function of points (n,), also after ``row`` was renewed in place."""
    count = law.borders
    kernel = BATCH(law.memory_kernel("borders").address) if count else None

    def at(delta: Vector) -> Vector:
        values = np.empty((count, delta.size))
        if kernel:
            d, v = np.ascontiguousarray(delta), np.full(delta.size, rate)
            kernel(delta.size, d.ctypes.data, v.ctypes.data, 1.0, row.ctypes.data, values.ctypes.data)
        return values

    return at


def renew(law: Law, border: int, delta: float, rate: float, row: Vector) -> int:
    """Renew a law's latched numbers in a row of parameters; returns the event."""
    return int(law.memory_kernel("renew").ctypes(border, delta, rate, 1.0, row.ctypes.data_as(_REALS)))


def _force(law: Law, delta: Vector, one: Piece) -> Vector:
    """Force in a stretch."""
    forces = law.batch(1.0, one.parameters)(delta, np.full(delta.size, one.rate))
    if law.one_sided and not law.memory:
        forces[delta <= 0.0] = 0.0
    if not np.all(np.isfinite(forces)):
        wrong = int(np.argmin(np.isfinite(forces)))
        raise ValueError(f"force of {name_of(law)} is {forces[wrong]} N at δ = {delta[wrong]:.6g} m")
    return forces
