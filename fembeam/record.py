"""Measured motion as a signal with exact derivatives.

    y(t) = c_0 + c_1 t + Σ_k b_k sin(k π t/T),        0 <= t <= T

The straight line joins the first and the last sample; what is left vanishes at both ends, so its odd
extension is continuous with its rate, and the sine series passes through every sample. Derivatives are taken
line by line.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam.lines import LineSpectrum, checked_band, checked_order, frozen, number

FEWEST_SAMPLES = 8
UNIFORM = 1e-4  # samples this close to a uniform grid, in steps, count as uniform
EDGE = 0.25  # the band fades out over this part of lo below it and of hi above it
LARGEST_GAP = 10.0  # a hole longer than this many median steps is not interpolated


@dataclass(frozen=True, eq=False)
class Record:
    """A measured motion, resampled if need be, band-limited, and differentiated through its spectrum.

    Parameters
    ----------
    t : array, shape (n,)
        Times in s, strictly increasing, uniform or not, n >= 8. The signal counts time from the first sample:
        the attribute `t` starts at 0.
    y : array, shape (n,)
        Motion in m, or m/s² for kind="acceleration".
    band : (lo, hi), optional
        Keep only the lines in this band (rad/s), fading out from lo to 0.75 lo and from hi to 1.25 hi. With
        lo > 0 the straight line (drift, mean) goes as well.
    kind : "displacement" or "acceleration"
        What `y` is. For an acceleration `derivative(2)` is the record itself, and the value is its double
        integral without straight line and constants, zero at both ends; slow drift stays unless lo > 0.
    detrend : bool
        Remove the least-squares straight line first: offset and drift of the sensor. An acceleration needs it
        unless lo > 0: its offset is a load like gravity.
    order : int, keyword only
        How many derivatives of the motion this signal is; use `derivative`.

    Raises
    ------
    ValueError
        Unequal lengths, fewer than 8 rows, times that do not increase, values that are not finite, a gap of
        more than 10 median steps (naming the first bad row, counted from 0), a band without lines.

    Notes
    -----
    Samples off a uniform grid by more than 1e-4 of a step are carried over by a quintic spline; keep ten
    samples per shortest period then (error of y'' 0.2 % of its rms; 20 samples: 0.03 %). Nothing is
    extrapolated at the ends: y'' is zero there and wrong by its own size within the first two samples. For 40
    tones up to half the Nyquist frequency the error of y'' is below 1 % of its rms 10 samples from an end,
    0.05 % at 50 and 1e-6 at 1000. With a `band` the same loss reaches farther: 7 % at 3 periods of hi from an
    end, 0.1 % at 10; stay as many periods of lo away from the ends when lo > 0.

    Examples
    --------
    >>> t = np.linspace(0.0, 1.0, 2001)
    >>> record = Record(t, 1e-3 * np.sin(100.0 * t))
    >>> bool(abs(record.derivative(2)(0.5) + 10.0 * np.sin(50.0)) < 1e-4)
    True
    """

    t: NDArray[np.float64]
    y: NDArray[np.float64]
    band: tuple[float, float] | None = None
    kind: Literal["displacement", "acceleration"] = "displacement"
    detrend: bool = False
    order: int = field(default=0, kw_only=True)
    _spectrum: tuple[LineSpectrum, float, float] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if self.kind not in ("displacement", "acceleration"):
            raise ValueError(f"Record kind must be 'displacement' or 'acceleration', got {self.kind!r}")
        t, y = _checked_samples(self.t, self.y)
        band = None if self.band is None else checked_band("Record band", self.band)
        for name, value in (("t", t), ("y", y), ("band", band), ("order", checked_order(self.order))):
            object.__setattr__(self, name, value)
        object.__setattr__(self, "_spectrum", self._transformed())

    @classmethod
    def from_csv(
        cls,
        path: str | Path,
        columns: tuple[int, int] = (0, 1),
        scale: float = 1.0,
        band: tuple[float, float] | None = None,
        kind: Literal["displacement", "acceleration"] = "displacement",
        detrend: bool = False,
    ) -> Record:
        """A record from a text file with columns separated by semicolon, tab, comma or blanks.

        Parameters
        ----------
        path : path
            Lines before the first numeric row (the header), empty lines and # comments are skipped.
        columns : (int, int)
            Columns of time (s) and motion, counted from 0.
        scale : float
            Factor on the motion, for example 1e-3 for mm.
        band, kind, detrend
            As for `Record`.

        Raises
        ------
        ValueError
            No numeric row, or a row that is not numeric after the first one (with its line number).
        """
        rows = _read_rows(Path(path), columns)
        scaled = rows[:, 1] * number("scale", scale)
        try:
            return cls(rows[:, 0], scaled, band=band, kind=kind, detrend=detrend)
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from None

    def __repr__(self) -> str:
        tail = f".derivative({self.order})" if self.order else ""
        head = f"Record({self.t.size} samples over {self.duration:.6g} s"
        return f"{head}, band={self.band}, kind={self.kind!r}){tail}"

    @property
    def duration(self) -> float:
        """Length of the record in s."""
        return float(self.t[-1])

    def _transformed(self) -> tuple[LineSpectrum, float, float]:
        """Sine lines of this signal and its straight line c_0 + c_1 t."""
        from scipy.fft import dst

        y = _on_uniform_grid(self.t, self.y)
        if self.detrend:
            from scipy.signal import detrend

            y = detrend(y)
        n = y.size - 1
        line = (float(y[0]), float(y[-1] - y[0]) / self.duration)
        sines = dst(y[1:-1] - (line[0] + line[1] * self.duration / n * np.arange(1, n)), type=1) / n
        lines = LineSpectrum(math.pi / self.duration, 1, -1j * sines)
        power = self.order - (2 if self.kind == "acceleration" else 0)
        if self.band is not None:
            lines = _within(lines, self.band)
        if self.band is not None and self.band[0] > 0:
            line = (0.0, 0.0)
        c_0, c_1 = (*line, 0.0, 0.0)[power : power + 2] if 0 <= power <= 2 else (0.0, 0.0)
        return lines.derivative(power), c_0, c_1

    def __call__(self, t: ArrayLike) -> Any:
        """Value at the instants t (s from the first sample), of any shape; an error outside the record."""
        times = np.asarray(t, dtype=np.float64)
        slack = 1e-9 * self.duration
        outside = ~((times >= -slack) & (times <= self.duration + slack))
        if outside.any():
            worst = float(times[outside].flat[0])
            raise ValueError(f"Record covers 0 to {self.duration:.6g} s, got t = {worst:.6g} s")
        lines, c_0, c_1 = self._spectrum
        return lines.at(times) + c_0 + c_1 * times

    def nodes(self, duration: float, rtol: float) -> tuple[float, NDArray[np.float64]]:
        """Hermite data of the signal on a uniform grid, with a proven interpolation error.

            rms(error) <= dt^6/√13! rms(s^(6)) <= rtol rms(s - straight line)

        Parameters
        ----------
        duration : float
            The grid covers [0, duration], in s; at most the length of the record.
        rtol : float
            Rms error of the quintic Hermite interpolant relative to that of the record, in [1e-13, 1).

        Returns
        -------
        dt : float
            Step in s.
        values : array, shape (N, 3)
            Rows [s, s', s''] at t = j dt.

        Raises
        ------
        ValueError
            duration beyond the record, or rtol out of range.
        """
        self.lasting(duration)
        lines, c_0, c_1 = self._spectrum
        dt, values = lines.nodes(duration, rtol)
        values[:, 0] += c_0 + c_1 * dt * np.arange(len(values))
        values[:, 1] += c_1
        return dt, values

    def derivative(self, order: int) -> Record:
        """The signal d^order s/dt^order."""
        return replace(self, order=self.order + checked_order(order))

    def lasting(self, duration: float) -> Record:
        """Return the signal itself, when the record is at least `duration` (s) long; an error otherwise."""
        if number("duration (s)", duration, least=0.0) > self.duration * (1 + 1e-9):
            raise ValueError(
                f"Record is {self.duration:.6g} s long and shorter than the duration of {duration:.6g} s; "
                f"shorten the run or bring a longer record"
            )
        return self


def _checked_samples(t: ArrayLike, y: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Read-only times from 0 and values, or an error that names the first bad row."""
    try:
        times, values = np.asarray(t, dtype=np.float64), np.asarray(y, dtype=np.float64)
    except (TypeError, ValueError):
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


def _check_steps(t: NDArray[np.float64]) -> None:
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


def _on_uniform_grid(t: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """The samples on a uniform grid from the first to the last time."""
    step = t[-1] / (t.size - 1)
    if np.abs(t - step * np.arange(t.size)).max() <= UNIFORM * step:
        return y
    from scipy.interpolate import make_interp_spline

    n = math.ceil(t[-1] / min(step, float(np.median(np.diff(t)))))
    return make_interp_spline(t, y, k=5)(np.linspace(0.0, t[-1], n + 1))


def _within(lines: LineSpectrum, band: tuple[float, float]) -> LineSpectrum:
    """The lines in the band, with smooth edges outside it: a sharp edge rings over the whole record."""
    omega, (lo, hi) = lines.omega, band
    if not np.any((omega >= lo) & (omega <= hi)):
        raise ValueError(
            f"Record band {band} rad/s holds no line: the record resolves {lines.spacing:.6g} to "
            f"{omega[-1]:.6g} rad/s; widen the band"
        )
    outside = np.maximum(omega / hi - 1, 0.0)
    if lo > 0:
        outside = np.maximum(outside, 1 - omega / lo)
    weight = np.cos(np.pi / 2 * np.minimum(outside / EDGE, 1.0)) ** 2
    kept = np.flatnonzero(outside < EDGE)
    return LineSpectrum(lines.spacing, int(kept[0]) + 1, (weight * lines.amplitude)[kept])


def _cells(text: str) -> list[str]:
    """The cells of one line; a semicolon or tab wins over a comma, a comma over blanks."""
    mark = next((mark for mark in (";", "\t", ",") if mark in text), None)
    return text.split(mark) if mark else re.split(r"\s+", text)


def _read_rows(path: Path, columns: tuple[int, int]) -> NDArray[np.float64]:
    """The two columns of a text file, header skipped, shape (n, 2)."""
    if len(columns) != 2 or not all(isinstance(column, int) for column in columns):
        raise ValueError(f"columns must be two whole numbers (time, motion), got {columns!r}")
    rows: list[tuple[float, float]] = []
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
        raise ValueError(f"{path} has no row with numbers in columns {columns}; give columns=(time, motion)")
    return np.array(rows)
