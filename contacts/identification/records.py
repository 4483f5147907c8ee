"""Measured collisions: read from a file, checked, and cut out of longer records."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contacts.numbers import check_number, read_columns, reals

Vector = NDArray[np.float64]
FEWEST = 8
"""Samples in contact below which one collision says too little."""
LARGEST = 1e30
"""Largest size of what is measured, in SI units; the smallest of the largest is its inverse."""
_FLAT = 1e-12  # of the largest force: less is rounding
_CORE = 0.05  # of the record's largest indentation: what rises above it is a collision


@dataclass(frozen=True, eq=False)
class Samples:
    """One collision as measured: (k,) arrays; ``time`` and ``delta_dot`` may be missing, not both."""

    delta: Vector
    force: Vector
    delta_dot: Vector | None = None
    time: Vector | None = None

    def part(self, first: int, last: int) -> Samples:
        """Samples first ... last - 1."""
        rows = slice(first, last)
        cut = [None if x is None else x[rows] for x in (self.delta_dot, self.time)]
        return Samples(self.delta[rows], self.force[rows], *cut)


def read_collisions(path: str | Path) -> dict[str, list[Vector]]:
    """Arguments of `contacts.identify` from a text file: ``identify(**read_collisions("stop.csv"))``.

    Columns ``delta`` (m), ``force`` (N) and ``time`` (s) or ``delta_dot`` (m/s), named in the first line, in any order;
    a column ``collision`` tells the collisions apart, otherwise they are found in the record.

    Returns
    -------
    Lists of (k,) arrays by column; ``delta_dot`` is left out where there is a ``time``.

    Raises
    ------
    ValueError for a missing column and for an entry that is no number, with its line.

    Examples
    --------
    >>> import os, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "stop.csv")
    ...     _ = path.write_text("time,delta,force" + os.linesep + "0,0,0" + os.linesep + "1e-4,2e-5,18.8")
    ...     read_collisions(path)["force"]
    [array([ 0. , 18.8])]
    """
    columns = read_columns(path, ("delta", "force"), ("time", "delta_dot", "collision"))
    if "time" in columns:
        columns.pop("delta_dot", None)
    label = columns.pop("collision", np.zeros(len(columns["delta"])))
    starts = np.flatnonzero(np.diff(label)) + 1
    return {name: np.split(column, starts) for name, column in columns.items()}


def collisions_of(delta: Any, delta_dot: Any, force: Any, time: Any) -> list[Samples]:
    """Checked collisions from the arguments of `contacts.identify`: an array each, or lists of arrays."""
    if (delta_dot is None) == (time is None):
        raise ValueError("identify needs either delta_dot or time: identify(delta, delta_dot, force), or time=...")
    if force is None:
        raise ValueError("identify needs the force")
    given = {"delta": delta, "force": force, "delta_dot": delta_dot, "time": time}
    records = {name: records_of(name, values) for name, values in given.items() if values is not None}
    count = len(records["delta"])
    for name, values in records.items():
        if len(values) != count:
            raise ValueError(f"{name} must have as many records as delta, {count}, got {len(values)}")
    found = [part for i in range(count) for part in _split({n: r[i] for n, r in records.items()}, i)]
    for number, one in enumerate(found, 1):
        touching = int(np.count_nonzero(one.delta > 0.0))
        if touching < FEWEST:
            raise ValueError(
                f"collision {number} has {touching} samples in contact, at least {FEWEST} are needed; "
                "sample faster, or leave it out"
            )
        if np.ptp(one.force[one.delta > 0.0]) <= _FLAT * np.abs(one.force).max():
            raise ValueError(f"force of collision {number} is {one.force[0]:g} N throughout; leave the collision out")
    return found


def records_of(name: str, values: Any) -> list[Vector]:
    """A list of finite vectors, one per record."""
    several = isinstance(values, (list, tuple)) and len(values) > 0 and np.ndim(values[0]) == 1
    out = []
    for number, one in enumerate(values if several else [values], 1):
        record = reals(one, f"{name} of record {number}")
        if record.ndim != 1 or not np.all(np.isfinite(record)):
            what = f"shape {record.shape}" if record.ndim != 1 else f"{record[~np.isfinite(record)][0]}"
            raise ValueError(f"{name} of record {number} must be a finite vector, got {what}")
        out.append(record)
    largest = max((float(np.abs(record).max()) for record in out if record.size), default=0.0)
    if largest > 0.0 and not 1.0 / LARGEST <= largest <= LARGEST:
        raise ValueError(
            f"{name} reaches {largest:g} where {1.0 / LARGEST:g} to {LARGEST:g} can be computed with; give SI units"
        )
    return out


def _split(record: dict[str, Vector], index: int) -> list[Samples]:
    """The collisions of one record, each with some samples before and after."""
    lengths = {name: len(x) for name, x in record.items()}
    if len(set(lengths.values())) != 1:
        raise ValueError(f"record {index + 1} has arrays of different lengths: {lengths}")
    if "time" in record and not np.all(np.diff(record["time"]) > 0.0):
        row = int(np.argmin(np.diff(record["time"]) > 0.0)) + 1
        raise ValueError(f"time of record {index + 1} must increase, it does not at sample {row}")
    whole, delta = Samples(**record), record["delta"]
    if not np.any(delta > 0.0):
        raise ValueError(f"record {index + 1} has no contact: delta is nowhere above 0")
    inside = np.concatenate(([False], delta > _CORE * delta.max(), [False]))
    first, last = np.flatnonzero(np.diff(inside.astype(int))).reshape(-1, 2).T
    strong = np.array([delta[a:b].max() > 2.0 * _CORE * delta.max() for a, b in zip(first, last, strict=True)])
    first, last = first[strong], last[strong]
    out = []
    for i, (a, b) in enumerate(zip(first, last, strict=True)):
        before = (last[i - 1] + a) // 2 if i else 0
        after = (b + first[i + 1]) // 2 if i + 1 < len(first) else len(delta)
        reach = max(2, (b - a) // 4)
        start = _extent(delta, a, max(before, a - reach), -1)
        out.append(whole.part(start, _extent(delta, b - 1, min(after, b + reach) - 1, 1) + 1))
    return out


def _extent(delta: Vector, start: int, end: int, step: int) -> int:
    """Last sample from start towards end before which delta stays above a little below the surface."""
    place, least = start, -_CORE * delta.max()
    while place != end and delta[place + step] > least:
        place += step
    return place


def check_pushes(samples: Samples, exponent: float, offset: bool, number: int) -> None:
    """Refuse a collision whose force pulls on the way in: K x^p + c x^p δ̇ + F₀ by least squares, δ̇ as if elastic."""
    top = int(np.argmax(samples.delta))
    x = np.clip(samples.delta[: top + 1] / samples.delta[top], 0.0, 1.0)
    shapes = x**exponent, x**exponent * np.sqrt(1.0 - x ** (exponent + 1.0))
    A = np.column_stack((*shapes, np.full(top + 1, float(offset))))
    found, *_ = np.linalg.lstsq(A, samples.force[: top + 1] / np.abs(samples.force).max(), rcond=None)
    if top > 1 and not np.sum(A[:, :2] @ found[:2]) > 0.0:
        raise ValueError(
            f"force of collision {number} falls with indentation on the way in; forces that push are positive: change "
            "its sign, or look whether force and motion are of the same collision"
        )


def checked_options(offset: Any, confidence: Any) -> float:
    """The confidence of intervals as a float; whether offsets are fitted is True or False."""
    if not isinstance(offset, (bool, np.bool_)):
        raise ValueError(f"offsets must be fitted or not, True or False, got {offset!r}")
    share = check_number(confidence, "confidence", -math.inf)
    if not 0.0 < share < 1.0:
        raise ValueError(f"confidence must lie in (0, 1), got {confidence!r}")
    return share
