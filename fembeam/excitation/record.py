"""Measured motion as a signal with exact derivatives.

    y(t) = c_0 + c_1 t + Σ_k b_k sin(k π t/T),        0 <= t <= T

The straight line joins the first and the last sample; what is left vanishes at both ends, so its odd
extension is continuous with its rate, and the sine series passes through every sample. Derivatives are taken
line by line, integrals too; those of the straight line are a parabola and a cubic, the cubic zero at both ends as the
sines are. Or the samples are joined by straight lines, see `polyline`.
"""

from __future__ import annotations

import math
from dataclasses import InitVar, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike, NDArray

from fembeam.excitation.line_spectrum import LineSpectrum, checked_band, checked_order, within
from fembeam.excitation.polyline import Polyline
from fembeam.excitation.samples import (
    checked_samples,
    initial_curvature,
    is_uniform,
    on_uniform_grid,
    padded,
    read_rows,
)
from fembeam.support import file_path, number, require_switch

Quantity = Literal["displacement", "acceleration", "force"]
Interpolation = Literal["spectral", "linear"]
MOVING = 0.3  # y''(0) above this part of the rms of y'' is warned of


class _Known(str):
    """What `Record.kind` says: `dataclasses.replace` hands it back, as if it had been asked for."""


@dataclass(frozen=True, eq=False)
class Record:
    """A measured motion, resampled if need be, band-limited, and differentiated through its spectrum.

    Parameters
    ----------
    t : array, shape (n,)
        Times in s, strictly increasing, uniform or not, n >= 8. The signal counts time from the first sample:
        the attribute `t` starts at 0.
    y : array, shape (n,)
        What `quantity` says: motion in m, acceleration in m/s², or force in N.
    band : (lo, hi), optional
        Keep only the lines in this band (rad/s), fading out from lo to 0.75 lo and from hi to 1.25 hi. With
        lo > 0 the straight line (drift, mean) goes as well.
    quantity : "displacement", "acceleration" or "force"
        What `y` is. For an acceleration `derivative(2)` is the record itself, and the value is its double
        integral, with constants such that it is zero at both ends; slow drift stays unless lo > 0. A force
        (or moment) is no motion: it has no derivatives. A scene refuses an acceleration as a load, a force as a
        motion. A scene file must say it.
    detrend : bool
        Remove the least-squares straight line first: offset and drift of the sensor. An acceleration needs it
        unless lo > 0: its offset is a load like gravity.
    interpolation : "spectral" or "linear"
        Linear joins the samples by straight lines, as earthquake engineering does: of an acceleration, force or
        the foot of a spring on a uniform grid without `band`. A displacement has no y'' then.
    padding : float
        Zeros behind the record, in s, so that a run may last longer; >= 0.
    order : int, keyword only
        How many derivatives of the motion this signal is; use `derivative`.
    kind : keyword only
        Another name of `quantity`.

    Raises
    ------
    ValueError
        Unequal lengths, fewer than 8 rows, times that do not increase, values that are not finite, a gap of
        more than 10 median steps (naming the first bad row, counted from 0), a band without lines.

    Warns
    -----
    UserWarning : padding makes the record jump to zero. A `Scene` warns of a displacement as base motion whose
        y'' does not begin near zero.

    Notes
    -----
    Samples off a uniform grid by more than 1e-4 of a step are carried over by a quintic spline; keep ten
    samples per shortest period then (error of y'' 0.2 % of its rms; 20 samples: 0.03 %). Nothing is
    extrapolated at the ends: y'' is zero there and wrong by its own size within the first two samples. For 40
    tones up to half the Nyquist frequency the error of y'' is below 3 % of its rms 10 samples from an end,
    0.15 % at 50 and 3e-6 at 1000. With a `band` the error extends farther: 7 % at 3 periods of hi from an
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
    quantity: Quantity = "displacement"
    detrend: bool = False
    interpolation: Interpolation = "spectral"
    padding: float = 0.0
    order: int = field(default=0, kw_only=True)
    kind: InitVar[Quantity | None] = field(default=None, kw_only=True)
    _spectrum: tuple[LineSpectrum | Polyline, tuple[float, ...]] = field(init=False, repr=False)

    def __post_init__(self, kind: Quantity | None) -> None:
        t, y = checked_samples(self.t, self.y)
        band = None if self.band is None else checked_band("Record band", self.band)
        padding = number("Record padding (s)", self.padding, least=0.0)
        quantity = self.quantity if kind is None or isinstance(kind, _Known) else kind
        for name, value in (("t", t), ("y", y), ("band", band), ("order", checked_order(self.order)),
                            ("quantity", quantity), ("kind", _Known(quantity)), ("padding", padding)):  # fmt: skip
            object.__setattr__(self, name, value)
        self._check_choices()
        object.__setattr__(self, "_spectrum", self._transformed())

    def _check_choices(self) -> None:
        """Words that are none, and what does not go together."""
        for name, choices in (("quantity", get_args(Quantity)), ("interpolation", get_args(Interpolation))):
            if getattr(self, name) not in choices:
                said = " or ".join(map(repr, choices))
                raise ValueError(f"Record {name} must be {said}, got {getattr(self, name)!r}")
        require_switch("detrend", self.detrend, "Record")
        if self.order and self.quantity == "force":
            raise ValueError("Record of a force has no derivatives, got quantity='force' as a motion; give "
                             "quantity='displacement' or 'acceleration'")  # fmt: skip
        if self.interpolation == "spectral":
            return
        if self._power > 0:
            raise ValueError("Record y'' of a displacement joined by straight lines does not exist; give an "
                             "acceleration (quantity='acceleration'), or leave out interpolation='linear'")  # fmt: skip
        if self.band is not None or not is_uniform(self.t):
            got = "a band" if self.band is not None else "times off a uniform grid"
            raise ValueError(f"Record with interpolation='linear' takes uniform samples as they are, got {got}; "
                             "filter and resample them before, or leave out interpolation")  # fmt: skip

    @property
    def _power(self) -> int:
        """How many derivatives of the samples this signal is; below 0 integrals."""
        return self.order - (2 if self.quantity == "acceleration" else 0)

    @classmethod
    def from_csv(
        cls,
        path: str | Path,
        columns: tuple[int, int] = (0, 1),
        scale: float = 1.0,
        band: tuple[float, float] | None = None,
        quantity: Quantity = "displacement",
        detrend: bool = False,
        interpolation: Interpolation = "spectral",
        padding: float = 0.0,
        *,
        kind: Quantity | None = None,
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
        band, quantity, detrend, interpolation, padding, kind
            As for `Record`.

        Raises
        ------
        ValueError
            No numeric row, or a row that is not numeric after the first one (with its line number).
        """
        rows = read_rows(file_path(path, "Record.from_csv"), columns)
        scaled = rows[:, 1] * number("scale", scale)
        try:
            return cls(rows[:, 0], scaled, band, quantity, detrend, interpolation, padding, kind=kind)
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from None

    @classmethod
    def earthquake(cls, path: str | Path, unit: str | None = None, **options: Any) -> Record:
        """An earthquake's acceleration from columns, a PEER (AT2) or a COSMOS file: `excitation.earthquake.earthquake`.

        ``unit`` "g", "m/s2" or "cm/s2" of columns; options are ``columns``, ``baseline=True``, ``band``,
        ``interpolation="linear"``, ``padding``.
        """
        from fembeam.excitation.earthquake import earthquake

        return earthquake(path, unit, **options)  # type: ignore[arg-type]

    def __repr__(self) -> str:
        tail = f".derivative({self.order})" if self.order else ""
        head = f"Record({self.t.size} samples over {self.duration:.6g} s"
        more = ", interpolation='linear'" if self.interpolation == "linear" else ""
        more += f", padding={self.padding:g}" if self.padding else ""
        return f"{head}, band={self.band}, quantity={self.quantity!r}{more}){tail}"

    @property
    def duration(self) -> float:
        """Length of the record in s, padding included."""
        h, y = self._samples
        return h * (y.size - 1)

    @cached_property
    def _samples(self) -> tuple[float, NDArray[np.float64]]:
        """Step and samples on a uniform grid, without straight line if asked for, padded."""
        y = on_uniform_grid(self.t, self.y)
        if self.detrend:
            from scipy.signal import detrend

            y = detrend(y)
        h = float(self.t[-1]) / (y.size - 1)
        return h, padded(y, math.ceil(self.padding / h - 1e-9))

    def _transformed(self) -> tuple[LineSpectrum | Polyline, tuple[float, ...]]:
        """Sine lines of this signal and the coefficients of its straight line, or of what it is integrated to.

        Or the polyline, and zero.
        """
        from scipy.fft import dst

        (h, y), power = self._samples, self._power
        if self.interpolation == "linear":
            return Polyline(h, y, -power), (0.0,)
        n = y.size - 1
        line = (float(y[0]), float(y[-1] - y[0]) / self.duration)
        sines = dst(y[1:-1] - (line[0] + line[1] * h * np.arange(1, n)), type=1) / n
        lines = LineSpectrum(math.pi / self.duration, 1, -1j * sines)
        if self.band is not None:
            lines = within(lines, self.band)
        if self.band is not None and self.band[0] > 0:
            line = (0.0, 0.0)
        twice = Polynomial(line).integ(2)
        twice -= Polynomial([0.0, twice(self.duration) / self.duration])
        rest = Polynomial(line).deriv(power) if power >= 0 else twice.deriv(2 + power)
        return lines.derivative(power), tuple(rest.coef.tolist())

    def __call__(self, t: ArrayLike) -> Any:
        """Value at the instants t (s from the first sample), of any shape; an error outside the record."""
        times = np.asarray(t, dtype=np.float64)
        slack = 1e-9 * self.duration
        outside = ~((times >= -slack) & (times <= self.duration + slack))
        if outside.any():
            worst = float(times[outside].flat[0])
            raise ValueError(f"Record covers 0 to {self.duration:.6g} s, got t = {worst:.6g} s")
        lines, rest = self._spectrum
        return lines.at(times) + Polynomial(rest)(times)

    def nodes(self, duration: float, rtol: float) -> tuple[float, NDArray[np.float64]]:
        """Hermite data of the signal on a uniform grid, with a proven interpolation error.

            rms(error) <= dt^6/√13! rms(s^(6)) <= rtol rms(s - straight line)

        Arguments and results are those of `BandNoise.nodes`; the duration is at most the length of the record, and with
        linear interpolation the error is that of its spectrum, see `polyline`.
        """
        self.for_duration(duration)
        lines, coefficients = self._spectrum
        dt, values = lines.nodes(duration, rtol)
        rest, t = Polynomial(coefficients), dt * np.arange(len(values))
        for order in range(3):
            values[:, order] += rest.deriv(order)(t)
        return dt, values

    def derivative(self, order: int) -> Record:
        """The signal d^order s/dt^order."""
        return replace(self, order=self.order + checked_order(order))

    def for_duration(self, duration: float) -> Record:
        """Return the signal itself, when the record is at least `duration` (s) long; an error otherwise."""
        if number("duration (s)", duration, least=0.0) > self.duration * (1 + 1e-9):
            raise ValueError(
                f"Record is {self.duration:.6g} s long and shorter than the duration of {duration:.6g} s; "
                f"shorten the run, bring a longer record, or give padding (s of zeros behind it)"
            )
        return self

    @cached_property
    def doubt(self) -> str:
        """Warning for a record as base motion of a scene; "" for none."""
        if self.quantity != "displacement" or self.order or not isinstance(self._spectrum[0], LineSpectrum):
            return ""
        h, y = self._samples
        rms = self._spectrum[0].derivative(2).rms
        start = initial_curvature(y, h, math.pi / h if self.band is None else self.band[1])
        if not abs(start) > MOVING * rms:
            return ""
        return (f"Record begins with y'' near {start:.2g} m/s² (rms {rms:.3g}), but y'' of a displacement record is "
                "zero at its ends: its first samples load the structure wrongly; begin where it is at rest, fade it "
                "in, or give the acceleration")  # fmt: skip
