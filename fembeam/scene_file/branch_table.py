"""The table [branch] of a scene file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from fembeam.support import require

if TYPE_CHECKING:
    from fembeam.model import Branch, Model


@dataclass(frozen=True)
class BranchTable:
    """The table [branch]: periodic motion along one number of the scene; `Model.branch` explains the keys.

    Parameters
    ----------
    span : (lowest, highest) value of the parameter.
    parameter : such as "omega", "amplitude", "stops[0].gap".
    period : in periods of the load.
    at : value of the parameter to start at; None: the scene's, if it lies in the span.
    step : largest step along the branch, in units of the span and the first orbit's size.
    """

    span: tuple[float, float]
    parameter: str = "omega"
    period: int = 1
    at: float | None = None
    step: float = 0.04

    def __post_init__(self) -> None:
        low, high = self.span
        require(low < high, "span must be two values, ascending", self.span, "[branch]", "give [lowest, highest]")
        require(self.period >= 1, "period must be at least 1", self.period, "[branch]", "2 is a 1/2 subharmonic")

    def run(self, model: Model, folder: Path, progress: bool = False) -> Branch:
        """The branch; goes on where an interrupted one left ``branch.npz`` in the folder.

        Raises
        ------
        ValueError : that branch belongs to another table, scene or number of modes.
        """
        kept = Path(folder) / "branch.npz"
        if kept.exists():
            branch = model.resume(kept)
            self._check(branch, model, kept)
        else:
            branch = model.branch(self.parameter, self.span, self.period, at=self.at, step=self.step)
        try:
            return branch.run(progress)
        except KeyboardInterrupt:
            branch.save(kept)
            raise

    def _check(self, branch: Branch, model: Model, path: Path) -> None:
        """A saved branch answers this table."""
        from fembeam.scene import path_of

        arm = branch.found.arms[0]
        theirs = branch.family.name, branch.family.period, *map(float, arm.span), arm.largest
        mine = path_of(model.scene, self.parameter), self.period, *map(float, self.span), self.step
        require(theirs == mine, f"{path} belongs to another branch", theirs, "[branch]",
                f"parameter, period, span, step are {mine} here; choose another folder or delete it")  # fmt: skip

    def write(self, result: Branch, folder: Path) -> list[Path]:
        """``branch.npz``, ``branch.json``, ``branch.csv`` and ``branch.png``."""
        from fembeam import plot
        from fembeam.results.files import plain, write_figure, write_json

        folder = Path(folder)
        result.save(folder / "branch.npz")
        result.to_csv(folder / "branch.csv")
        return [
            folder / "branch.npz",
            write_json(folder / "branch.json", {"orbits": plain(result.table()), "status": result.status}),
            folder / "branch.csv",
            write_figure(folder / "branch.png", plot.branch(result)),
        ]
