"""What a study of speed against accuracy found: points, fronts, tables."""

from __future__ import annotations

import csv
import io
import math
import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fembeam.support import Part, Printed, written_whole
from solvers.problem import dataframe

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Point:
    """One method at one setting on one model, over several starts.

    Attributes
    ----------
    method, setting : names. modes : number of coordinates of the model.
    seconds : (s,) fastest of the rounds for each start. errors : (s,) of integration, against the model's own
        reference. totals : (s,) against the reference of the largest model: integration and reduction together.
    law_calls, steps : median over the starts. failure : why there are no numbers, else "".
    """

    method: str
    setting: str
    modes: int
    seconds: Vector
    errors: Vector
    totals: Vector
    law_calls: float
    steps: float
    failure: str = ""

    @property
    def time(self) -> float:
        """Median over the starts, s."""
        return median(self.seconds)

    @property
    def error(self) -> float:
        """Median over the starts."""
        return median(self.errors)

    @property
    def total(self) -> float:
        """Median over the starts."""
        return median(self.totals)

    def spread(self, values: Vector) -> tuple[float, float]:
        """Quartiles of ``seconds``, ``errors`` or ``totals``."""
        return (math.nan, math.nan) if not len(values) else tuple(np.quantile(values, [0.25, 0.75]))  # type: ignore[return-value]


@dataclass(frozen=True, eq=False)
class SpeedAccuracy(Printed):
    """The answer of `speed_accuracy`.

    Attributes
    ----------
    points : all of them. unit : what an error of 1 is, in the quantity's unit. floor : {modes: disagreement of the two
        references}; errors below it are not known. reduction : {modes: error of the exact model against the largest}.
    """

    points: list[Point]
    unit: float
    floor: dict[int, float]
    reduction: dict[int, float]
    quantity: str = "displacement at the end"

    def front(self, modes: int) -> list[Point]:
        """Points that no other beats in median time and error, the coarsest first; errors below the floor are equal."""
        best: list[Point] = []
        floor = self.floor.get(modes, 0.0)
        for point in sorted((p for p in self.points if p.modes == modes and p.seconds.size), key=lambda p: p.time):
            if not best or max(point.error, floor) < max(best[-1].error, floor):
                best.append(point)
        return best

    def beaten(self, method: str, better_than: float = 1e-4) -> list[Point]:
        """Points of the fronts, more accurate than a limit, that belong to other methods."""
        return [
            point
            for modes in self.reduction
            for point in self.front(modes)
            if point.error < better_than and point.method != method
        ]

    def claim(self, method: str = "Exponential", better_than: float = 1e-4) -> str:
        """A sentence: whether a method is the front below an error, or which others are; "" without others."""
        methods = {point.method for point in self.points}
        reached = any(point.error < better_than for point in self.points)
        if method not in methods or len(methods) < 2 or not reached:
            return ""
        others = sorted({f"{p.method} with {p.modes} modes" for p in self.beaten(method, better_than)})
        claim = f"below {better_than:g} {method} is the front"
        return claim + (", but for " + ", ".join(others) if others else " everywhere")

    def rows(self) -> list[dict[str, Any]]:
        """One dictionary per point."""
        fronts = {id(point) for modes in self.reduction for point in self.front(modes)}
        return [
            {
                **{"method": p.method, "setting": p.setting, "modes": p.modes, "starts": len(p.errors)},
                **{"seconds": p.time, "seconds_q1": p.spread(p.seconds)[0], "seconds_q3": p.spread(p.seconds)[1]},
                **{"error": p.error, "error_q1": p.spread(p.errors)[0], "error_q3": p.spread(p.errors)[1]},
                **{"total_error": p.total, "law_calls": p.law_calls, "steps": p.steps},
                **{"front": id(p) in fronts, "failure": p.failure},
            }
            for p in self.points
        ]

    def __repr__(self) -> str:
        return f"<speed against accuracy of {len(self.points)} points, {self.quantity}>"

    def _parts(self) -> list[Part]:
        head = "method", "setting", "modes", "µs", "error", "total", "law calls", ""
        known = [f"{n} modes: reduction error {self.reduction[n]:.1e}, reference known to {self.floor[n]:.0e}"
                 for n in self.reduction]  # fmt: skip
        return [(head, [_cells(row) for row in self.rows()]), *known, *filter(None, [self.claim()])]

    def to_dataframe(self) -> Any:
        """The rows as a table of pandas; ImportError without pandas."""
        return dataframe(self.rows())

    def figure(self) -> Figure:
        """``fb.plot.speed_accuracy`` of it."""
        from fembeam.plot.methods import speed_accuracy

        return speed_accuracy(self)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the table as CSV, whole or not at all."""
        from pathlib import Path

        text, rows = io.StringIO(), self.rows()
        writer = csv.DictWriter(text, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
        with written_whole(Path(path)) as file:
            file.write(text.getvalue().encode())


def _cells(row: dict[str, Any]) -> tuple[str, ...]:
    """A line of the printed table; a failure stands in its last column."""
    named = row["method"], row["setting"], str(row["modes"])
    if row["failure"]:
        return *named, "", "", "", "", row["failure"]
    error, total = f"{row['error']:.1e}", f"{row['total_error']:.1e}"
    numbers = f"{1e6 * row['seconds']:.0f}", error, total, f"{row['law_calls']:.0f}"
    return *named, *numbers, "front" if row["front"] else ""


def median(values: Vector) -> float:
    """NaN of nothing."""
    return float(np.median(values)) if len(values) else math.nan
