"""Samples of a record: read from a text file, checked, brought to a uniform grid."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam.support import frozen, is_pair, is_whole, numbers, warn

Vector = NDArray[np.float64]
FEWEST_SAMPLES = 8
UNIFORM = 1e-4  # samples this close to a uniform grid, in steps, count as uniform
LARGEST_GAP = 10.0  # a hole longer than this many median steps is not interpolated
JUMP = 0.05  # of the largest value: what a record may jump by to the zeros behind it


def checked_samples(t: ArrayLike, y: ArrayLike) -> tuple[Vector, Vector]:
    """Read-only times from 0 and values, or an error that names the first bad row."""
    try:
        times, values = (numbers(name, given, "Record", "give an array") for name, given in (("t", t), ("y", y)))
    except ValueError:
        raise ValueError("Record t and y must be arrays of numbers") from None
    if times.ndim != 1 or times.shape != values.shape or times.size < FEWEST_SAMPLES:
        need = f"Record needs t and y of one length of at least {FEWEST_SAMPLES}"
        raise ValueError(f"{need}, got shapes {times.shape} and {values.shape}")
    for name, column in (("t", times), ("y", values)):
        if not np.isfinite(column).all():
            i = int(np.argmin(np.isfinite(column)))
            raise ValueError(f"Record {name} must be finite, got {column[i]} in row {i} (t = {times[i]:g} s)")
    _check_steps(times)
    return frozen(times - times[0]), frozen(values)


def _check_steps(t: Vector) -> None:
    """Times must increase, and leave no hole that interpolation would have to invent."""
    steps = np.diff(t)
    if not np.all(steps > 0):
        i = int(np.argmin(steps > 0)) + 1
        raise ValueError(f"Record t must increase strictly, got {t[i]:g} s after {t[i - 1]:g} s in row {i}; sort it")
    median = float(np.median(steps))
    if steps.max() > LARGEST_GAP * median:
        i = int(np.argmax(steps > LARGEST_GAP * median)) + 1
        raise ValueError(
            f"Record has a gap of {steps[i - 1]:g} s before row {i}, more than {LARGEST_GAP:g} median "
            f"steps of {median:g} s; use the longer part, or fill the gap"
        )


def is_uniform(t: Vector) -> bool:
    """Whether times from 0 lie on a uniform grid."""
    step = t[-1] / (t.size - 1)
    return bool(np.abs(t - step * np.arange(t.size)).max() <= UNIFORM * step)


def on_uniform_grid(t: Vector, y: Vector) -> Vector:
    """The samples on a uniform grid from the first to the last time."""
    if is_uniform(t):
        return y
    from scipy.interpolate import make_interp_spline

    n = math.ceil(t[-1] / min(t[-1] / (t.size - 1), float(np.median(np.diff(t)))))
    return make_interp_spline(t, y, k=5)(np.linspace(0.0, t[-1], n + 1))


def _cells(text: str) -> list[str]:
    """The cells of one line; a semicolon or tab wins over a comma, a comma over blanks."""
    mark = next((mark for mark in (";", "\t", ",") if mark in text), None)
    return text.split(mark) if mark else re.split(r"\s+", text)


def read_rows(path: Path, columns: tuple[int, int]) -> Vector:
    """The two columns of a text file, header skipped, shape (n, 2)."""
    if not is_pair(columns) or not all(is_whole(column) and column >= 0 for column in columns):
        raise ValueError(f"columns must be two whole numbers from 0 (time, motion), got {columns!r}")
    if columns[0] == columns[1]:
        raise ValueError(f"columns must be two different ones (time, motion), got {columns!r}")
    rows: list[tuple[float, float]] = []
    text = ""
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        for line_number, line in enumerate(file, start=1):
            text = line.strip()
            if not text or text.startswith("#"):
                continue
            try:
                cells = _cells(text)
                rows.append((float(cells[columns[0]]), float(cells[columns[1]])))
            except (ValueError, IndexError):
                if rows:
                    raise ValueError(f"{path}, line {line_number}: no numbers in columns {columns}: {text!r}") from None
    if not rows:
        last = f"its last line is {text[:60]!r}; " if text else ""
        advice = "give columns=(time, motion), decimal points and plain text"
        raise ValueError(f"{path} has no row with numbers in columns {columns}; {last}{advice}")
    return np.array(rows)


def padded(y: Vector, more: int) -> Vector:
    """The samples with zeros behind them."""
    if more and abs(y[-1]) > JUMP * np.abs(y).max():
        warn(f"Record ends at {y[-1]:.3g}, its largest value is {np.abs(y).max():.3g}: padding with zeros "
             "lets it jump; let it end at zero, or remove its offset (detrend)")  # fmt: skip
    return np.concatenate((y, np.zeros(more)))


def initial_curvature(y: Vector, h: float, highest: float) -> float:
    """y''(0) of samples h apart: that of a quartic through the first ones by least squares.

    Over half a period of `highest` (rad/s), eight samples at least, so that the noise of a sensor counts little.
    """
    n = min(max(FEWEST_SAMPLES, math.ceil(math.pi / (highest * h))), y.size)
    quartic = np.polynomial.polynomial.polyfit(np.linspace(0.0, 1.0, n), y[:n], 4)
    return float(2 * quartic[2] / ((n - 1) * h) ** 2)
