"""A run as tables: CSV for spreadsheets, pandas, xarray, what print shows; units in the head of every column."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fembeam.model.watched_places import places
from fembeam.scene import unit_of
from fembeam.support import require
from solvers.problem import dataframe, optional

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import ArrayLike

    from fembeam.model.run import Run, Vector
    from fembeam.support import Part

CONTACT_UNITS = {"t_in": "s", "t_out": "s", "energy_loss": "J"}
CONTACT_QUANTITIES = {"speed_in": "speed", "speed_out": "speed", "peak_indentation": "indentation",
                      "peak_force": "force", "impulse": "impulse"}  # fmt: skip
DIGITS = "%.12g"


def write(run: Run, folder: Path, stride: int = 1) -> list[Path]:
    """Write `histories.csv` and `contacts.csv`; see `Run.to_csv`."""
    kept = histories(run, stride)
    units = ((name, _unit_of_column(run, name), column) for name, column in run.contacts.arrays().items())
    log = {f"{name} [{unit}]" if unit else name: column for name, unit, column in units}
    return [_write(folder / "histories.csv", kept), _write(folder / "contacts.csv", log)]


def _unit_of_column(run: Run, name: str) -> str:
    """Unit of a column of the log; "m or rad" where stops of both kinds share it."""
    return run.unit(CONTACT_QUANTITIES[name]) if name in CONTACT_QUANTITIES else CONTACT_UNITS.get(name, "")


def histories(run: Run, stride: int) -> dict[str, Vector]:
    """Columns of every `stride`-th sample at the usual places and stops, by name and unit."""
    require(stride >= 1, "stride must be at least 1", stride, "Run", "1 keeps every sample")
    columns = {"t [s]": run.t}
    for name, z in places(run.shapes).items():
        columns |= {f"displacement {name} [m]": run.displacement(z), f"velocity {name} [m/s]": run.velocity(z)}
    for stop in range(len(run.stops)):
        for name, history in (("indentation", run.indentation), ("force", run.force)):
            columns[f"{name} {stop} [{run.unit(name, stop)}]"] = history(stop)
    return {name: column[::stride] for name, column in columns.items()}


def to_dataframe(run: Run, stride: int = 1) -> Any:
    """See `Run.to_dataframe`."""
    return dataframe(histories(run, stride)).set_index("t [s]")


def to_xarray(run: Run, z: ArrayLike | None = None) -> Any:
    """See `Run.to_xarray`."""
    place = run.shapes.nodes if z is None else np.atleast_1d(np.asarray(z, dtype=float))
    variables = {
        "displacement": (("t", "z"), run.displacement(place), {"units": "m"}),
        "velocity": (("t", "z"), run.velocity(place), {"units": "m/s"}),
        "indentation": (("t", "stop"), _side_by_side(run, run.indentation), {"units": run.unit("indentation")}),
        "force": (("t", "stop"), _side_by_side(run, run.force), {"units": run.unit("force")}),
        "q": (("t", "coordinate"), run.q, {"units": "m √kg"}),
        "q_dot": (("t", "coordinate"), run.q_dot, {"units": "m √kg/s"}),
    }
    axes = {"t": ("t", run.t, {"units": "s"}), "z": ("z", place, {"units": "m"}), "stop": np.arange(len(run.stops))}
    return optional("xarray", "a data set").Dataset(variables, axes, {"status": run.status, "scene": run.scene})


def _side_by_side(run: Run, history: Callable[[int], Vector]) -> Vector:
    """A history of every stop, (k, m)."""
    return np.array([history(stop) for stop in range(len(run.stops))]).reshape(len(run.stops), len(run.t)).T


def _write(target: Path, columns: Mapping[str, Vector]) -> Path:
    """One file with a column each."""
    from fembeam.support import written_whole

    with written_whole(target) as file:
        rows = np.column_stack([np.asarray(column, dtype=float) for column in columns.values()])
        np.savetxt(file, rows, fmt=DIGITS, delimiter=",", header=",".join(columns), comments="", encoding="utf-8")
    return target


def parts(run: Run) -> list[Part]:
    """What print shows of a run: how it ended, its signals, the contacts of each stop."""
    signals = {f"displacement, {name}": run.displacement(z) for name, z in places(run.shapes).items()}
    signals |= {f"indentation, {run.name(i)}": run.indentation(i) for i in range(len(run.stops))}
    moved = [(name, *map(float, (x.mean(), x.std(), x.min(), x.max()))) for name, x in signals.items() if len(x)]
    log, rows = run.contacts, []
    for stop in range(len(run.stops)):
        mine = log.stop == stop
        peak, entry = log.peak_force[mine], log.speed_in[mine]
        numbers = (float(peak.max()), float(peak.mean()), float(entry.mean())) if mine.any() else (None,) * 3
        if not run.kinds[stop, 1]:
            rows.append((run.name(stop), int(mine.sum()), *numbers))
    length, force, speed = unit_of("indentation", [False, *run.kinds[:, 0]]), run.unit("force"), run.unit("speed")
    found: list[Part] = [repr(run), (("", *(f"{name} / {length}" for name in ("mean", "std", "min", "max"))), moved)]
    head = "", "contacts", f"largest force / {force}", f"mean peak force / {force}", f"mean entry speed / {speed}"
    return [*found, (head, rows)] if rows else found
