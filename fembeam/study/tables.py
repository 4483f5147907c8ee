"""Studies as tables of a scene file: what to ask, checked when read, run on the file's scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from fembeam.section import require
from fembeam.study.measure import Plan
from fembeam.study.mode_count import ModeCount, checked_counts, mode_count
from fembeam.study.quantities import named
from fembeam.study.smallest_model import MOST, SmallestModel, check_goal, smallest_model

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
