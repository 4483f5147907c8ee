"""A run as CSV for spreadsheets: histories and contacts, units in the head of every column."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fembeam.model.watched_places import places
from fembeam.support import require

if TYPE_CHECKING:
    from collections.abc import Mapping

    from fembeam.model.run import Run, Vector

CONTACT_UNITS = {
    "stop": "", "t_in": "s", "t_out": "s", "speed_in": "m/s", "speed_out": "m/s", "peak_indentation": "m",
    "peak_force": "N", "impulse": "N s", "energy_loss": "J", "entry_rate_clipped": "",
}  # fmt: skip
DIGITS = "%.12g"


def write(run: Run, folder: Path, stride: int = 1) -> list[Path]:
    """Write `histories.csv` and `contacts.csv`; see `Run.to_csv`."""
    require(stride >= 1, "stride must be at least 1", stride, "Run.to_csv", "1 keeps every sample")
    columns = {"t [s]": run.t}
    for name, z in places(run.shapes).items():
        columns |= {f"displacement {name} [m]": run.displacement(z), f"velocity {name} [m/s]": run.velocity(z)}
    for stop in range(len(run.stops)):
        columns |= {f"indentation {stop} [m]": run.indentation(stop), f"force {stop} [N]": run.force(stop)}
    kept = {name: column[::stride] for name, column in columns.items()}
    units = ((name, CONTACT_UNITS.get(name, ""), column) for name, column in run.contacts.arrays().items())
    log = {f"{name} [{unit}]" if unit else name: column for name, unit, column in units}
    return [_write(folder / "histories.csv", kept), _write(folder / "contacts.csv", log)]


def _write(target: Path, columns: Mapping[str, Vector]) -> Path:
    """One file with a column each."""
    from fembeam.support import written_whole

    with written_whole(target) as file:
        rows = np.column_stack([np.asarray(column, dtype=float) for column in columns.values()])
        np.savetxt(file, rows, fmt=DIGITS, delimiter=",", header=",".join(columns), comments="", encoding="utf-8")
    return target
