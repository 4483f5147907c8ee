"""What a simulation leaves in a folder: `run.npz`, `summary.json`, and figures as PNG; each written whole."""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fembeam import plot
from fembeam.run import Run, versions, written_whole
from fembeam.statistics import moments

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FEWEST_SAMPLES = 64  # below this neither a spectrum nor a density says anything


def prepared(folder: str | Path) -> Path:
    """The folder, made if need be, and proved writable; ValueError when it is not."""
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError as error:
        raise ValueError(f"output folder {folder} is not writable: {error.strerror}; choose another") from error


def write(run: Run, folder: str | Path, discard: float = 0.0, seconds: float | None = None) -> list[Path]:
    """Write a run with its summary and figures.

    Parameters
    ----------
    run : complete or partial.
    folder : must exist.
    discard : s at the beginning that statistics leave out.
    seconds : wall time to report; None: that of the integration.

    Returns
    -------
    The files written, `run.npz` first.

    Raises
    ------
    OSError : the folder cannot be written.
    """
    folder = Path(folder)
    written = [run.save(folder / "run.npz")]
    written.append(write_json(folder / "summary.json", summary(run, discard, seconds)))
    written += [_write_figure(folder / f"{name}.png", draw()) for name, draw in figures(run, discard).items()]
    return written


def write_study(result: Any, folder: str | Path, name: str) -> list[Path]:
    """Write a study's table as `name.txt` and, if it saves itself, `name.csv`, and its figure as `name.png`."""
    target = Path(folder) / f"{name}.txt"
    with written_whole(target) as file:
        file.write(f"{result}\n".encode())
    written = [target, _write_figure(Path(folder) / f"{name}.png", result.figure())]
    if hasattr(result, "save"):
        written.append(Path(folder) / f"{name}.csv")
        result.save(written[-1])
    return written


def _write_figure(target: Path, figure: Figure) -> Path:
    """One PNG; the same figure gives the same bytes."""
    with written_whole(target) as file:
        figure.savefig(file, format="png", dpi=150, metadata={"Software": None})
    return target


def figures(run: Run, discard: float = 0.0) -> dict[str, Callable[[], Figure]]:
    """The figures this run has enough data for, by name; call one to draw it."""
    log, kept = run.contacts, int(np.count_nonzero(run.t >= discard))
    drawn: dict[str, Callable[[], Figure]] = {}
    if len(run.t) > 1:
        drawn["time_history"] = lambda: plot.time_history(run)
    if kept >= FEWEST_SAMPLES and all(np.ptp(x) > 0 for x in plot.responses(run, discard).values()):
        drawn["psd"] = lambda: plot.spectrum(run, discard)
        drawn["densities"] = lambda: plot.densities(run, discard)
    if np.any(np.isfinite(log.t_out) & (log.t_in >= discard)):
        drawn["contacts"] = lambda: plot.contacts(run, discard)
    if (model := run.model) is not None:
        drawn["modes"] = lambda: plot.mode_shapes(model)
    return drawn


def summary(run: Run, discard: float = 0.0, seconds: float | None = None) -> dict[str, Any]:
    """What a run says in numbers: modes, moments, contacts, energy, cost, status, versions."""
    model = run.model
    return {
        "status": run.status,
        "complete": run.complete,
        "simulated_seconds": float(run.t[-1]) if len(run.t) else 0.0,
        "discarded_seconds": discard,
        "wall_seconds": run.cost.seconds if seconds is None else seconds,
        "omega": None if model is None else model.omega.tolist(),
        "zeta": None if model is None else model.zeta.tolist(),
        "moments": _moments(run, discard),
        "contacts": _contacts(run, discard),
        "energy": _energy(run),
        "cost": asdict(run.cost),
        "scene": run.scene,
        "units": "SI: m, s, N, J, rad/s",
        "versions": versions(),
    }


def _moments(run: Run, discard: float) -> dict[str, dict[str, float]]:
    """Moments of the displacements at the usual places and of every stop's indentation, m."""
    kept = run.t >= discard
    if np.count_nonzero(kept) < 2:
        return {}
    signals = {f"displacement, {name}": run.displacement(z)[kept] for name, z in plot.places(run.shapes).items()}
    signals |= {f"indentation, stop {i}": run.indentation(i)[kept] for i in range(len(run.stops))}
    extremes = {name: {"min": float(x.min()), "max": float(x.max())} for name, x in signals.items()}
    return {name: asdict(moments(x)) | extremes[name] for name, x in signals.items()}


def _contacts(run: Run, discard: float) -> list[dict[str, Any]]:
    """Number, rate, means and maxima of every stop's contacts that ended."""
    log = run.contacts
    span = max(float(run.t[-1]) - discard, 0.0) if len(run.t) else 0.0
    rows = []
    for stop in range(len(run.stops)):
        kept = (log.stop == stop) & (log.t_in >= discard) & np.isfinite(log.t_out)
        row: dict[str, Any] = {"stop": stop, "z": float(run.stops[stop, 0]), "number": int(kept.sum())}
        row["rate"] = row["number"] / span if span > 0 else None
        columns = {"duration": log.t_out - log.t_in, "peak_force": log.peak_force, "entry_speed": log.speed_in}
        if row["number"]:
            for name, values in columns.items():
                row[name] = {"mean": float(values[kept].mean()), "max": float(values[kept].max())}
            row["energy_loss"] = float(log.energy_loss[kept].sum())
            row["floored"] = int(log.floored[kept].sum())
        rows.append(row)
    return rows


def _energy(run: Run) -> dict[str, float]:
    """The ledger at the end, J, and its residual relative to what went in."""
    if not len(run.t):
        return {}
    ledger = run.energy
    names = ("input", "damping", "contact", "stored", "residual")
    end = {name: float(getattr(ledger, name)[-1]) for name in names}
    scale = max(abs(end["input"]), abs(float(ledger.initial)))
    end["residual_over_input"] = abs(end["residual"]) / scale if scale > 0 else 0.0
    return end


def write_json(target: Path, content: dict[str, Any]) -> Path:
    """Write JSON as the standard has it: null for what is not finite."""
    with written_whole(target) as file:
        file.write((json.dumps(_finite(content), indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode())
    return target


def _finite(value: Any) -> Any:
    """The same with None for NaN and infinities."""
    if isinstance(value, dict):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_finite(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
