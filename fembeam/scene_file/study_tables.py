"""Studies as tables of a scene file: what to ask, checked when read, run on the file's scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import solvers
from fembeam.study.measure import Plan
from fembeam.study.mode_count import ModeCount, checked_counts, mode_count
from fembeam.study.quantities import named
from fembeam.study.smallest_model import MOST, check_goal, smallest_model
from fembeam.study.smallest_model_result import SmallestModel
from fembeam.study.speed_accuracy import speed_accuracy
from fembeam.study.speed_accuracy_result import SpeedAccuracy
from fembeam.support import require, require_positive

if TYPE_CHECKING:
    from fembeam.scene import Scene

MOST_SEEDS = 100_000


def seeds_of(count: int) -> tuple[int, ...]:
    """The seeds 0, 1, ... of that many realisations."""
    require(0 <= count <= MOST_SEEDS, f"seeds must be 0 to {MOST_SEEDS}", count, "study", "e.g. 8")
    return tuple(range(count))


@dataclass(frozen=True)
class ModeCountTable:
    """The table [mode_count]; `fb.study.mode_count` explains the keys, `seeds` is how many (0, 1, …)."""

    counts: Sequence[int]
    quantity: Any
    duration: float | None = None
    dt: float | None = None
    discard: float = 0.0
    seeds: int = 0
    residual: bool | None = None
    reference: int | Literal["full"] | None = None

    def __post_init__(self) -> None:
        checked_counts(self.counts)
        Plan(self.duration, self.dt, self.discard, seeds_of(self.seeds))

    def check(self, scene: Scene) -> None:
        """Raise ValueError when the scene cannot be run like this."""
        Plan(self.duration, self.dt, self.discard, seeds_of(self.seeds)).check(scene, named(self.quantity))

    def run(self, scene: Scene) -> ModeCount:
        """The study."""
        runs = self.duration, self.dt, self.discard, seeds_of(self.seeds)
        return mode_count(scene, self.counts, self.quantity, *runs, self.residual, self.reference)


@dataclass(frozen=True)
class SmallestModelTable:
    """The table [smallest_model]; `fb.study.smallest_model` explains the keys, `seeds` is how many (0, 1, …)."""

    quantity: Any
    tolerance: float
    duration: float | None = None
    dt: float | None = None
    discard: float = 0.0
    seeds: int = 0
    residual: bool | None = None
    most: int = MOST

    def __post_init__(self) -> None:
        check_goal(self.tolerance, self.most)
        Plan(self.duration, self.dt, self.discard, seeds_of(self.seeds))

    def check(self, scene: Scene) -> None:
        """Raise ValueError when the scene cannot be run like this."""
        Plan(self.duration, self.dt, self.discard, seeds_of(self.seeds)).check(scene, named(self.quantity))

    def run(self, scene: Scene) -> SmallestModel:
        """The study; NotMetError when there is no such model."""
        runs = self.duration, self.dt, self.discard, seeds_of(self.seeds)
        return smallest_model(scene, self.quantity, self.tolerance, *runs, self.residual, self.most)


@dataclass(frozen=True)
class SpeedAccuracyTable:
    """The table [speed_accuracy] of a scene file: `Exponential`, `DormandPrince` and RK4 on some mode counts.

    Parameters
    ----------
    modes : mode counts. rtols : relative tolerances of the first two, in [1e-11, 1e-2]. steps : of `RK4`, s.
    starts, duration, rounds : see `speed_accuracy`.
    """

    modes: Sequence[int] = (1, 2, 3)
    rtols: Sequence[float] = (1e-4, 1e-6, 1e-8, 1e-10)
    steps: Sequence[float] = (5e-5, 1e-5)
    starts: int = 6
    duration: float | None = None
    rounds: int = 3

    def __post_init__(self) -> None:
        where = "speed_accuracy"
        counts = bool(self.modes) and min(self.modes) >= 1
        require(counts, "modes must be counts of at least 1", list(self.modes), where, "e.g. [1, 2, 5]")
        valid = bool(self.rtols) and 1e-11 <= min(self.rtols) <= max(self.rtols) <= 1e-2
        require(valid, "rtols must lie in [1e-11, 1e-2]", list(self.rtols), where, "e.g. [1e-4, 1e-8]")
        require(self.starts >= 1, "starts must be at least 1", self.starts, where, "e.g. 6")
        require(self.rounds >= 1, "rounds must be at least 1", self.rounds, where, "e.g. 3")
        for step in self.steps:
            require_positive("steps", step, where, "give s")
        if self.duration is not None:
            require_positive("duration", self.duration, where, "give s")

    def run(self, scene: Scene) -> SpeedAccuracy:
        """The study."""
        methods: list[Any] = [solvers.Exponential(rtol) for rtol in self.rtols]
        methods += [solvers.DormandPrince(rtol) for rtol in self.rtols] + [solvers.RK4(step) for step in self.steps]
        models = [scene.reduce(modes=n) for n in sorted(set(self.modes))]
        return speed_accuracy(models, methods, self.starts, self.duration, rounds=self.rounds, progress=True)
