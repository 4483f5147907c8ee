"""What a simulation leaves in a folder: `run.npz`, `summary.json`, and figures as PNG; each written whole."""

from __future__ import annotations

import json
import math
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fembeam import plot
from fembeam.model import Run
from fembeam.model.run_csv import extremes_table, histories
from fembeam.plot.figure import after
from fembeam.plot.run_signals import FEWEST_BATCHES, MEMORIES
from fembeam.scene import unit_of
from fembeam.statistics import Batches, Estimate, moments
from fembeam.support import DRAFT, aligned, require, versions, written_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

UNDATED: dict[str, dict[str, Any]] = {"png": {"Software": None}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}
ABANDONED = 3600.0  # s: age of a draft that no run works on
FEWEST_SAMPLES = 64  # below this neither a spectrum nor a density says anything


def prepared(folder: str | Path) -> Path:
    """The folder, made if need be, cleared of old drafts and proved writable; ValueError when it is not."""
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for left in folder.glob(f".*.????????{DRAFT}"):  # of a run that was killed
            if time.time() - left.stat().st_mtime > ABANDONED:
                left.unlink(missing_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError as error:
        raise ValueError(f"output folder {folder} is not writable: {error.strerror}; choose another") from error


def write(
    run: Run,
    folder: str | Path,
    discard: float = 0.0,
    found: dict[str, Any] | None = None,
    outputs: dict[str, Any] | None = None,
) -> list[Path]:
    """Write a run with its summary and figures.

    Parameters
    ----------
    run : complete or partial.
    folder : must exist.
    discard : s at the beginning that statistics leave out.
    found : its `summary`, if made already.
    outputs : places and quantities, as for `Run.to_csv`: their extremes as text, all samples as CSV.

    Returns
    -------
    The files written, `run.npz` first.

    Raises
    ------
    OSError : the folder cannot be written.
    """
    folder = Path(folder)
    written = [run.save(folder / "run.npz")]
    found = summary(run, discard, outputs=outputs) if found is None else found
    written.append(write_json(folder / "summary.json", found))
    written += [write_figure(folder / f"{name}.png", draw()) for name, draw in figures(run, discard).items()]
    if outputs:
        written += [write_text(folder / "outputs.txt", _outputs(found)), *run.to_csv(folder, **outputs)]
    return written


def write_study(result: Any, folder: Path, name: str) -> list[Path]:
    """Write what a study found, a `Result`: text, JSON, CSV and PNG; returns them and the checkpoint it has left."""
    checkpoint, table = folder / f"{name}.npz", folder / f"{name}.csv"
    written = [write_text(folder / f"{name}.txt", str(result)), *([checkpoint] if checkpoint.exists() else [])]
    written += [write_json(folder / f"{name}.json", result.plain()), table]
    result.save(table)
    return [*written, write_figure(folder / f"{name}.png", result.figure())]


def write_text(target: Path, text: str) -> Path:
    """A table as text."""
    with written_whole(target) as file:
        file.write(f"{text}\n".encode())
    return target


def write_figure(target: Path, figure: Figure) -> Path:
    """One PNG, or SVG or PDF by the name; the same figure gives the same bytes."""
    kind = target.suffix.lower().removeprefix(".")
    require(kind in UNDATED, "a figure must end in .png, .svg or .pdf", target.name, "its file name", "choose one")
    with written_whole(target) as file:
        figure.savefig(file, format=kind, dpi=150, metadata=UNDATED[kind])
    return target


def figures(run: Run, discard: float = 0.0) -> dict[str, Callable[[], Figure]]:
    """The figures this run has enough data for, by name; call one to draw it."""
    log, kept = run.contacts, int(np.count_nonzero(run.t >= discard))
    drawn: dict[str, Callable[[], Figure]] = {}
    if len(run.t) > 1:
        drawn["time_history"] = lambda: plot.time_history(run)
    even = len(run.t) > 1 and np.ptp(np.diff(run.t)) < 1e-6 * (run.t[1] - run.t[0])
    if even and kept >= FEWEST_SAMPLES and all(np.ptp(x) > 0 for x in plot.responses(run, discard).values()):
        if plot.stationary(run, discard):
            drawn["psd"] = lambda: plot.spectrum(run, discard)
            drawn["densities"] = lambda: plot.densities(run, discard)
        elif np.any(plot.natural(run) > 0.0):
            drawn["response_spectrum"] = lambda: plot.floor_spectrum(run)
    if np.any(np.isfinite(log.t_out) & (log.t_in >= discard)):
        drawn["contacts"] = lambda: plot.contacts(run, discard)
    if (model := run.model) is not None:
        drawn["modes"] = lambda: plot.mode_shapes(model)
    return drawn


def summary(
    run: Run, discard: float = 0.0, seconds: float | None = None, outputs: dict[str, Any] | None = None
) -> dict[str, Any]:
    """What a run says in numbers: modes, moments, contacts, outputs asked for, energy, cost, status, versions."""
    return {
        "status": run.status,
        "complete": run.complete,
        "simulated_seconds": run.reached,
        "discarded_seconds": discard,
        "wall_seconds": run.cost.seconds if seconds is None else seconds,
        "coordinates": plot.coordinates(run),
        "omega": plot.natural(run).tolist(),
        "zeta": run.readout.zeta.tolist(),
        "moments": _moments(run, discard),
        "confidence": _confidence(run, discard),
        "contacts": _contacts(run, discard),
        **({"outputs": extremes_table(histories(run, **outputs), discard)} if outputs else {}),
        "energy": _energy(run),
        "losses": {name: np.asarray(x, dtype=float).tolist() for name, x in run.losses.arrays().items()},
        "cost": asdict(run.cost),
        "dt": float(run.t[1] - run.t[0]) if len(run.t) > 1 else None,
        "scene": run.scene,
        "units": "SI: m, s, N, J, rad/s",
        **({"rotations": run.rotational.tolist()} if run.rotational.any() else {}),
        "versions": versions(),
    }


def _moments(run: Run, discard: float) -> dict[str, dict[str, Any]]:
    """Moments of the displacements at the usual places and of every stop's indentation, m or rad, with its label."""
    kept = run.t >= discard
    if np.count_nonzero(kept) < 2:
        return {}
    signals = {f"displacement, {name}": run.displacement(z)[kept] for name, z in plot.places(run.shapes).items()}
    signals |= {f"indentation, {run.key(i)}": run.indentation(i)[kept] for i in range(len(run.stops))}
    named = {f"indentation, {run.key(i)}": f"indentation, {run.name(i)}" for i in range(len(run.stops))}
    extremes = {
        name: {"min": float(x.min()), "max": float(x.max()), "label": named.get(name, name)}
        for name, x in signals.items()
    }
    error = partial(_error_of_std, parts=plot.batches(run, discard))
    return {name: asdict(moments(x)) | {"std_error": error(x)} | extremes[name] for name, x in signals.items()}


def _error_of_std(x: NDArray[np.float64], parts: int) -> float | None:
    """Jackknife standard error of the standard deviation over that many batches."""
    if not parts:
        return None
    found = Batches(3)
    for part in np.array_split(x - x.mean(), parts):
        found.add([len(part), part.sum(), part @ part])
    return float(found.estimate(lambda s: math.sqrt(max(s[2] / s[0] - (s[1] / s[0]) ** 2, 0.0))).standard_error)


def _error_of_rate(entries: NDArray[np.float64], start: float, end: float, parts: int) -> float | None:
    """Standard error of the number of contacts per second over that many batches."""
    if not parts:
        return None
    counts = np.histogram(entries, parts, (start, end))[0] * parts / (end - start)
    return float(Estimate.of_mean(counts).standard_error)


def _confidence(run: Run, discard: float) -> str:
    """What the standard errors rest on."""
    parts = plot.batches(run, discard)
    if not parts:
        return f"No standard errors: {_why_no_parts(run, discard)}."
    span = (float(run.t[-1]) - discard) / parts
    return (
        f"Standard errors (s.e.) come from {parts} parts of {span:.3g} s each; 95 % lies within two of them. "
        "Under noise they are upper bounds, as one realisation has the same power for every seed; [ensemble] tells the "
        "scatter of seeds."
    )


def _why_no_parts(run: Run, discard: float) -> str:
    """Why a run has no independent parts: `plot.batches` goes by the slowest decay of a coordinate."""
    decay = np.diag(run.readout.damping) / 2
    least, modes = int(np.argmin(decay)), len(decay) - len(run.impactor_masses)
    if len(run.t) < 2:
        return "the run has a single sample"
    if not decay[least] > 0.0:
        name = f"mode {least + 1}" if least < modes else f"impactor {least - modes + 1}"
        return f"{name} has no damping, so that parts of the run never become independent"
    needed = FEWEST_BATCHES * MEMORIES / decay[least]
    # rounded up, to three digits
    return (f"the {max(float(run.t[-1]) - discard, 0.0):.3g} s behind discard are shorter than {FEWEST_BATCHES} "
            f"independent parts; simulate at least {1.005 * (discard + needed):.3g} s")  # fmt: skip


def _contacts(run: Run, discard: float) -> list[dict[str, Any]]:
    """Number, rate, means and maxima of every stop's contacts that ended."""
    log = run.contacts
    span = max(run.reached - discard, 0.0)
    rows, parts = [], plot.batches(run, discard)
    for stop in np.flatnonzero(~run.always_acting).tolist():
        kept = (log.stop == stop) & (log.t_in >= discard) & np.isfinite(log.t_out)
        row: dict[str, Any] = {"stop": stop, "name": run.name(stop)}
        row |= {head: getattr(log.sites[stop], head) for head in log.heads}
        row["number"] = int(kept.sum())
        row["rate"] = row["number"] / span if span > 0 else None
        row["rate_error"] = _error_of_rate(log.t_in[kept], discard, discard + span, parts)
        columns = {"duration": log.t_out - log.t_in, "peak_force": log.peak_force, "entry_speed": log.speed_in}
        if row["number"]:
            for name, values in columns.items():
                row[name] = {"mean": float(values[kept].mean()), "max": float(values[kept].max())}
            row["energy_loss"] = float(log.energy_loss[kept].sum())
            row["entry_rate_clipped"] = int(log.entry_rate_clipped[kept].sum())
        rows.append(row)
    return rows


def _energy(run: Run) -> dict[str, float]:
    """The energy balance at the end, J, and its residual relative to what went in, the work of spins included."""
    if not len(run.t):
        return {}
    ledger = run.energy
    rubbed = ("friction", "spin") if run.rubs[:, 1].any() else ()
    names = ("input", "damping", "contact", *rubbed, "stored", "residual")
    end = {name: float(getattr(ledger, name)[-1]) for name in names}
    scale = max(abs(end["input"]), abs(end.get("spin", 0.0)), abs(float(ledger.initial)))
    end["residual_over_input"] = abs(end["residual"]) / scale if scale > 0 else 0.0
    return end


def text(found: dict[str, Any]) -> str:
    """The tables of a summary: moments and extremes of signals, contacts of stops, outputs asked for."""
    rotations = found.get("rotations", [])
    m, force, speed = unit_of("indentation", [False, *rotations]), *(unit_of(q, rotations) for q in ("force", "speed"))
    part = after(found["discarded_seconds"]).strip()
    head = (part, f"mean/{m}", f"std/{m}", "skewness", "kurtosis", f"min/{m}", f"max/{m}")
    moments = [[row["label"], *(row[key.partition("/")[0]] for key in head[1:])] for row in found["moments"].values()]
    tables = [aligned(head, moments)] if moments else []
    columns = {"mean time/s": "duration", f"mean peak force/{force}": "peak_force",
               f"mean entry speed/({speed})": "entry_speed"}  # fmt: skip
    rows = [
        [row["name"], row["number"], row["rate"]] + [row.get(column, {}).get("mean") for column in columns.values()]
        for row in found["contacts"]
    ]
    tables += [aligned((part, "contacts", "per second", *columns), rows)] if rows else []
    return "\n\n".join(tables + ([_outputs(found)] if found.get("outputs") else []))


def _outputs(found: dict[str, Any]) -> str:
    """The table of the outputs asked for."""
    head = (f"output{after(found['discarded_seconds'])}", "mean", "std", "min", "at t/s", "max", "at t/s")
    return aligned(head, [[name, *row.values()] for name, row in found["outputs"].items()])


def json_text(content: Any, escaped: bool = False) -> str:
    """JSON as the standard has it: null for what is not finite; `escaped`: in ASCII."""
    return json.dumps(_finite(content), indent=2, ensure_ascii=escaped, allow_nan=False)


def print_json(content: Any) -> None:
    """Print JSON, in ASCII unless its encoding is a Unicode one."""
    print(json_text(content, escaped="utf" not in (getattr(sys.stdout, "encoding", None) or "").lower()))


def write_json(target: Path, content: dict[str, Any]) -> Path:
    """Write JSON."""
    return write_text(target, json_text(content))


def _finite(value: Any) -> Any:
    """A value with None for NaN and infinities."""
    if isinstance(value, dict):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
