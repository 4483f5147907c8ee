"""The table [basins] of a scene file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

from fembeam.study import Basins, basins

if TYPE_CHECKING:
    from fembeam.model import Model


@dataclass(frozen=True)
class BasinsTable:
    """The table [basins]: which periodic orbit each start of a plane comes to; `fb.study.basins` explains the keys."""

    x_span: Sequence[float]
    y_span: Sequence[float]
    x: str | int = "displacement"
    y: str | int = "velocity"
    points: int | Sequence[int] = 100
    z: float | None = None
    start: Sequence[float] | None = None
    settle: int = 200
    longest: int = 8
    threads: int = 1

    def run(self, model: Model, folder: Path, progress: bool = False) -> Basins:
        """The basins, with their checkpoint ``basins.npz`` in the folder."""
        keys = {field.name: getattr(self, field.name) for field in fields(self)}
        return basins(model, **keys, checkpoint=folder / "basins.npz", progress=progress)

    def write(self, result: Basins, folder: Path) -> list[Path]:
        """Write attractors, shares and labels as JSON and the map as a figure; returns them, checkpoint first."""
        from fembeam.results.files import write_figure, write_json

        rows = [
            {"name": one.name, "period": one.period, "impacts": one.impacts, "starts": one.count, "share": share,
             "state": one.state.tolist()}
            for one, share in zip(result.attractors, result.shares.tolist(), strict=True)
        ]  # fmt: skip
        axes = {k: {"name": a.name, "values": a.values.tolist()} for k, a in (("x", result.x), ("y", result.y))}
        content = {"attractors": rows, **axes, "label": result.label.tolist(), "units": "SI: m, s, N, rad/s"}
        json = write_json(folder / "basins.json", content)
        return [folder / "basins.npz", json, write_figure(folder / "basins.png", result.figure())]
