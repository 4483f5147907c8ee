"""The table [orbit] of a scene file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fembeam.support import require

if TYPE_CHECKING:
    from fembeam.model import Model, Orbit


@dataclass(frozen=True)
class OrbitTable:
    """The table [orbit]: one periodic motion by shooting; `Model.orbit` explains more.

    Parameters
    ----------
    period : in periods of the load; 2 is a 1/2 subharmonic.
    """

    period: int = 1

    def __post_init__(self) -> None:
        require(self.period >= 1, "period must be at least 1", self.period, "[orbit]", "2 is a 1/2 subharmonic")

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
