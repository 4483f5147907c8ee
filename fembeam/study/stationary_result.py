"""A stationary response: its statistics, and the sums over segments they are made from."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam.model import Run
from fembeam.statistics import Batches, Estimate, Impacts, Signal
from fembeam.statistics.initial_transient import Settling
from fembeam.study.segments import Segment, Segments
from fembeam.support import Part, Printed
from solvers.problem import dataframe

Vector = NDArray[np.float64]
Watch = Callable[[Run], Any]


@dataclass
class Sums:
    """Sums over the segments taken so far."""

    watched: Mapping[str, Watch]
    dt: float
    segment: int
    bins: dict[str, ArrayLike]
    levels: dict[str, float]
    stops: int
    signals: dict[str, Signal] = field(default_factory=dict)
    impacts: list[Impacts] = field(default_factory=list)
    names: tuple[str, ...] = ()  # of all contacts
    work: Batches = field(default_factory=lambda: Batches(1))  # rows: seconds, work done on each contact

    def __post_init__(self) -> None:
        for option, given in (("bins", self.bins), ("levels", self.levels)):
            for name in given:
                if name not in self.watched:
                    raise ValueError(
                        f"{option} names {name!r}, which is not watched; there are {', '.join(self.watched)}"
                    )
        self.impacts = [Impacts() for _ in range(self.stops)]

    def add(self, piece: Segment, seen: Mapping[str, tuple[Vector, Vector | None]], batches: int) -> float:
        """Take in a segment, batch by batch; returns its seconds."""
        first = math.ceil(piece.start / self.dt - 1e-9)
        borders = np.linspace(first, piece.end, batches + 1).round().astype(int)
        for name, (x, rate) in seen.items():
            if name not in self.signals:
                self.signals[name] = self._signal(name, x[first : piece.end], batches)
            self.signals[name].cut()
            for a, b in pairwise(borders):
                self.signals[name].add(x[a:b], None if rate is None else rate[a:b])
        for stop, impacts in enumerate(self.impacts):
            for a, b in pairwise(borders):
                impacts.add(piece.run.contacts, stop, a * self.dt, b * self.dt)
        self._add_work(piece.run, borders)
        return self.dt * float(piece.end - first)

    def _add_work(self, run: Run, borders: Any) -> None:
        """Take in what each contact took between samples."""
        if not self.names:
            self.names = tuple(run.name(i) for i in range(len(run.stops)))
            self.work = Batches(1 + len(self.names))
        for a, b in pairwise(borders) if self.names else ():
            self.work.add([(b - a) * self.dt, *(run.losses.history[b] - run.losses.history[a])])

    def _signal(self, name: str, x: Vector, batches: int) -> Signal:
        """Empty sums for a signal, arranged by its first samples."""
        segment = min(self.segment, max(8, x.size // 2 if batches > 1 else x.size - 1))
        bins = self.bins.get(name)
        edges = None if bins is None else np.asarray(bins, dtype=np.float64)
        return Signal(x, self.dt, segment, self.levels.get(name, 0.0), edges)

    def response(self, plan: Segments, settled: Settling | None, enough: bool | None) -> Response:
        """The statistics so far."""
        seen = self.signals, self.impacts, plan.kept, plan.discarded, settled, enough, plan.seconds
        return Response(*seen, self.names, self.work)


@dataclass(frozen=True, eq=False)
class Response(Printed):
    """Statistics of a stationary response.

    Attributes
    ----------
    signals : name -> `statistics.Signal`: mean, variance, std, skewness, kurtosis, crossing_rate, pdf, psd; also
        ``response["δ"]``.
    impacts : one `statistics.Impacts` per stop: rate, probability, mean(quantity).
    duration : s the statistics use. discarded : s left out, lead-ins included.
    settling : end of the transient; None when `discard` was given.
    enough : whether the standard error asked for by `until` was reached; None when none was.
    seconds : wall seconds of integration.
    names : of stops, elements and impactors, in the order of `power`.
    """

    signals: dict[str, Signal]
    impacts: list[Impacts]
    duration: float
    discarded: float
    settling: Settling | None
    enough: bool | None
    seconds: float
    names: tuple[str, ...] = ()
    work: Batches = field(default_factory=lambda: Batches(1), repr=False)

    def __getitem__(self, name: str) -> Signal:
        if name not in self.signals:
            raise KeyError(f"no signal {name!r} was watched; there are {', '.join(self.signals)}")
        return self.signals[name]

    def __repr__(self) -> str:
        return f"<stationary response of {', '.join(self.signals)} over {self.duration:.4g} s>"

    def _parts(self) -> list[Part]:
        """Every number with its standard error and 95 % interval."""
        rows = [(name, repr(one), *map(float, one.interval())) for name, one in self.numbers().items()]
        return [repr(self), (("", "value ± standard error", "95 % from", "to"), rows)]

    def to_dataframe(self) -> Any:
        """A table of pandas: value, standard error and 95 % interval by name; ImportError without pandas."""
        found = self.numbers()
        columns = "value", "standard_error", "low", "high"
        rows = [(one.value, one.standard_error, *one.interval()) for one in found.values()]
        return dataframe([dict(zip(columns, map(float, row), strict=True)) for row in rows], index=list(found))

    def power(self, contact: int | None = None) -> Estimate:
        """Mean power (W) that a stop or element takes, numbered as in a `Run`; None: all of them together.

        From the work done on it; the change of the energy stored averages to zero.
        """
        count = len(self.names)
        if contact is not None and not -count <= contact < count:
            raise ValueError(f"contact must be below {count}, the number of stops and elements, got {contact!r}")
        mine = slice(1, None) if contact is None else slice(1 + contact % count, 2 + contact % count)
        return self.work.estimate(lambda sums: sums[mine].sum() / sums[0])

    def numbers(self) -> dict[str, Estimate]:
        """Every number with its standard error, by names such as "δ std" and "stop 0 rate"."""
        names = ("mean", "std", "skewness", "kurtosis", "crossing_rate")
        found = {f"{key} {name}": getattr(s, name) for key, s in self.signals.items() for name in names}
        for i, impacts in enumerate(self.impacts):
            found |= {f"stop {i} {name}": getattr(impacts, name) for name in ("rate", "probability")}
            found |= {f"stop {i} {name}": impacts.mean(name) for name in impacts.largest}
        return found | {f"{name} power": self.power(i) for i, name in enumerate(self.names)}
