"""Two result folders side by side: every number both have, how far apart, and their curves overlaid."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fembeam import plot
from fembeam.plot.figure import sheet
from fembeam.plot.style import verbatim
from fembeam.plot.units import length_for, unit_for
from fembeam.results.compare_branches import at_equal_parameters
from fembeam.results.files import prepared, write_figure
from fembeam.statistics import pdf, psd
from fembeam.support import aligned

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fembeam.model import Run

SKIPPED = ("versions", "units", "scene", "cost", "wall_seconds", "warnings", "measured")
# of a number, and of one in a table of them; "uncertainty" of studies of modes is that of their relative error
ERRORS = {"mean": "standard_error", "value": "standard_error", "std": "std_error", "rate": "rate_error"}
TABLES = {" values ": " standard_error "}


@dataclass(frozen=True)
class Row:
    """One number of both.

    Attributes
    ----------
    difference : (b - a)/|a|, in standard errors of the difference where both have one (`deviations`), else None.
    """

    name: str
    a: Any
    b: Any
    difference: float | None
    deviations: float | None


def compare(a: Path, b: Path) -> list[Row]:
    """All numbers of two result folders, in the order of the first; those only one has are None in the other.

    Those of branches at equal values of their parameter: the second is interpolated there.

    Raises
    ------
    ValueError : a folder holds no results, or a file in it is damaged.
    """
    contents, others = _contents(a), _contents(b)
    both = [contents.get("branch"), others.get("branch")]
    if all(both):
        contents["branch"], others["branch"] = at_equal_parameters(*(one["orbits"] for one in both if one))
    first, second = _numbers(contents), _numbers(others)
    names = [*first, *(name for name in second if name not in first)]
    errors = {*map(_error_of, names)}
    rows = [_row(name, first, second) for name in names if name not in errors]
    return [row for row in rows if (row.a, row.b) != (None, None)]


def _contents(folder: Path) -> dict[str, Any]:
    """The JSON files of a folder."""
    files = sorted(Path(folder).glob("*.json"))
    if not files:
        raise ValueError(f"{folder} holds no results; give a folder that `fembeam run` wrote")
    found: dict[str, Any] = {}
    for path in files:
        try:
            found[path.stem] = json.loads(path.read_text(encoding="utf-8"))
        except ValueError as error:
            raise ValueError(f"{path} is damaged: {error}; run it again") from None
    return found


def _numbers(contents: dict[str, Any]) -> dict[str, Any]:
    """Every number by its path."""
    return {name: value for stem, content in contents.items() for name, value in _flat(stem, content)}


def _flat(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Leaves with their paths."""
    entries = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else None
    if entries is None:
        if value is None or isinstance(value, (bool, int, float)):
            yield name, value
        return
    for key, entry in entries:
        if key not in SKIPPED:
            yield from _flat(f"{name} {key}", entry)


def _error_of(name: str) -> str:
    """The path at which a number's standard error stands, if it has one; "" for numbers that never have."""
    stem, _, last = name.rpartition(" ")
    if last in ERRORS:
        return f"{stem} {ERRORS[last]}"
    return next((name.replace(*pair, 1) for pair in TABLES.items() if pair[0] in name), "")


def _row(name: str, first: dict[str, Any], second: dict[str, Any]) -> Row:
    """One number, and how far apart."""
    a, b = first.get(name), second.get(name)
    difference = deviations = None
    if a is not None and b is not None:
        difference = (b - a) / abs(a) if a else (0.0 if b == a else math.inf)
        error = _error_of(name)
        both = math.hypot(first.get(error) or 0.0, second.get(error) or 0.0)
        deviations = (b - a) / both if both > 0 else None
    return Row(name, a, b, difference, deviations)


def plain(rows: list[Row]) -> list[dict[str, Any]]:
    """For JSON."""
    return [asdict(row) for row in rows]


def table(rows: list[Row], a: Path, b: Path) -> str:
    """The numbers that differ as text, and how many do not."""
    unlike = [row for row in rows if row.a != row.b]
    cells = [
        (row.name, row.a, row.b, None if row.difference is None else f"{100 * row.difference:+.3g} %",
         None if row.deviations is None else f"{row.deviations:+.1f}")
        for row in unlike
    ]  # fmt: skip
    same = f"{len(rows) - len(unlike)} of {len(rows)} numbers are equal"
    head = ("", str(a), str(b), "difference", "in standard errors")
    between = ["branches: the second interpolated linearly where the first has an orbit"]
    notes = between if any(row.name.startswith("branch at ") for row in unlike) else []
    return "\n\n".join([aligned(head, cells), *notes, same] if unlike else [same])


def write_figures(a: Path, b: Path, out: Path) -> list[Path]:
    """Overlaid spectra, densities and time histories as PNG; none where a folder has no `run.npz`."""
    from fembeam.model import load

    if not all((Path(folder) / "run.npz").exists() for folder in (a, b)):
        return []
    out = prepared(out)
    runs = {str(folder): load(Path(folder) / "run.npz") for folder in (a, b)}
    return [write_figure(out / "compare.png", overlaid(runs))]


@plot.styled
def overlaid(runs: dict[str, Run]) -> Figure:
    """Indentation of the first stop (else the tip): the end of the history, its spectrum, its density."""
    (figure, axes), highest = sheet(3, 1, (7.0, 7.0)), 0.0
    scale, unit = length_for([next(iter(plot.responses(run).values())) for run in runs.values()])
    tick, second = unit_for([run.t[-1] for run in runs.values()], "s")
    for i, (name, run) in enumerate(runs.items()):
        what, signal = next(iter(plot.responses(run).items()))
        dt, style = float(run.t[1] - run.t[0]), "-" if i == 0 else "--"
        last = min(len(run.t), 600)
        axes[0].plot(tick * run.t[-last:], scale * signal[-last:], style, label=verbatim(name))
        omega, level = psd(signal - signal.mean(), dt, plot.segment_for(len(signal), dt))
        axes[1].semilogy(omega[1:], np.maximum(level[1:], 1e-300), style)
        highest = max(highest, float(level.max()))
        x, density = pdf(signal, 50)
        axes[2].plot(scale * x, density / scale, style)
    axes[0].set(xlabel=f"time / {second}", ylabel=f"{verbatim(what)} / {unit}")
    axes[1].set(xlabel="ω / rad s⁻¹", ylabel="PSD / m² s rad⁻¹")
    axes[2].set(xlabel=f"{verbatim(what)} / {unit}", ylabel=f"density / {unit}⁻¹")
    if highest > 0:
        axes[1].set_ylim(1e-8 * highest, 5 * highest)  # below it is leakage and rounding
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper left", ncols=2)
    return figure
