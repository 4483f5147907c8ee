"""The tables [orbit] and [branch] of a scene file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fembeam.support import require

if TYPE_CHECKING:
    from fembeam.model import Branch, Model, Orbit


def _check_period(period: int, where: str) -> None:
    """A whole number of load periods."""
    require(period >= 1, "period must be at least 1", period, where, "2 is a 1/2 subharmonic")


@dataclass(frozen=True)
class OrbitTable:
    """The table [orbit]: one periodic motion by shooting; `Model.orbit` explains more.

    Parameters
    ----------
    period : in periods of the load; 2 is a 1/2 subharmonic.
    """

    period: int = 1

    def __post_init__(self) -> None:
        _check_period(self.period, "[orbit]")

    def run(self, model: Model, folder: Path, progress: bool = False) -> Found:
        """The orbit."""
        return Found(model.orbit(self.period))

    def write(self, result: Found, folder: Path) -> list[Path]:
        """``orbit.json`` and ``orbit.png``; returns them."""
        from fembeam import plot
        from fembeam.results.files import write_figure, write_json

        return [
            write_json(folder / "orbit.json", result.plain()),
            write_figure(folder / "orbit.png", plot.orbit(result.orbit)),
        ]


@dataclass(frozen=True, eq=False)
class Found:
    """An orbit, printed as tables."""

    orbit: Orbit

    def plain(self) -> dict[str, Any]:
        """For JSON: period, stability, multipliers, extremes, contacts, state."""
        from fembeam.plot import places

        one, log = self.orbit, self.orbit.contacts
        return {
            "period": one.period,
            "seconds": one.found.period,
            "stable": bool(one.stable),
            "residual": one.found.residual,
            "multipliers": [{"size": float(abs(m)), "angle": float(np.angle(m))} for m in one.multipliers],
            "extremes": {name: dict(zip(("min", "max"), one.extremes(z), strict=True))
                         for name, z in places(one.model.shapes).items()},
            "contacts": [{name: float(column[i]) for name, column in log.arrays().items()} for i in range(len(log))],
            "phase": one.found.phase,
            "state": one.state.tolist(),
            "units": "SI: m, s, N, J, rad",
        }  # fmt: skip

    def __str__(self) -> str:
        from fembeam.support import aligned

        found = self.plain()
        kind = "stable" if found["stable"] else "unstable"
        sizes = ", ".join(f"{m['size']:.4g}" for m in found["multipliers"])
        head = f"{kind} orbit of period {found['period']}, {found['seconds']:.6g} s, |μ| = {sizes}"
        extremes = [[f"displacement, {name}", e["min"], e["max"]] for name, e in found["extremes"].items()]
        columns = {"t_in": "begins/s", "t_out": "ends/s", "speed_in": "entry speed/(m/s)", "peak_force": "peak force/N"}
        rows = [[f"stop {c['stop']:.0f}", *(c[name] for name in columns)] for c in found["contacts"]]
        tables = [aligned(("", "min/m", "max/m"), extremes)]
        return "\n\n".join([head, *tables, *([aligned(("", *columns.values()), rows)] if rows else [])])


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
        _check_period(self.period, "[branch]")

    def run(self, model: Model, folder: Path, progress: bool = False) -> Branch:
        """The branch; continues where an interrupted one left ``branch.npz`` in the folder.

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

        walk = branch.found.walks[0]
        theirs = branch.family.name, branch.family.period, *map(float, walk.span), walk.largest
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
