"""Samples joined by straight lines, and the first two integrals of that: the convention of earthquake engineering.

    s(t) = s_j + (s_{j+1} - s_j) (t - t_j)/h,        t_j = j h

Integrators take a load as quintics through values, slopes and curvatures on a uniform grid, which cannot bend sharply.
A kink is rounded within one cell of that grid on either side, such that moments of order 0 to 3 of the error vanish:
with a jump Δ of the slope and cells of h',

    s = s_j + 3/80 Δ h',   s' = mean of both sides,   s'' = 15/4 Δ/h',        error/kink = (ω h')⁶/151200 at frequency ω

A response errs within h' of a kink, and is exact again after it.
Of the first integral, whose curvature jumps by Δ, only the slope is moved, by 3/64 Δ h': (ω h')⁶/60480. The second one
is a spline of cubics, which quintics hold exactly.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam.excitation.line_spectrum import MOST_NODES

Vector = NDArray[np.float64]
HIGHEST = 4.0  # times the Nyquist frequency of the samples: up to there the load is right to the tolerance
ERROR = 1 / 60480  # of a kink at ω h' = 1


@dataclass(frozen=True, eq=False)
class Polyline:
    """A polyline or one of its integrals; these are zero at both ends.

    Parameters
    ----------
    h : step in s. samples : (n,). integrals : 0, 1 or 2.
    """

    h: float
    samples: Vector
    integrals: int

    def at(self, t: ArrayLike) -> Any:
        """Value at the instants t (s), of any shape."""
        return self._at(np.asarray(t, dtype=np.float64), self.integrals)

    def _at(self, t: Vector, integrals: int) -> Any:
        """The polyline integrated 0 to 2 times, at any instants."""
        s, v, y = self._columns
        cell = np.clip((t / self.h).astype(np.int64), 0, s.size - 2)
        x, slope = t - cell * self.h, (s[cell + 1] - s[cell]) / self.h
        if integrals == 0:
            return s[cell] + x * slope
        if integrals == 1:
            return v[cell] + x * (s[cell] + x * slope / 2)
        return y[cell] + x * (v[cell] + x * (s[cell] / 2 + x * slope / 6))

    @property
    def _columns(self) -> tuple[Vector, Vector, Vector]:
        """Samples, first and second integral (n,) at the samples, the second one zero at both ends."""
        s, h = self.samples, self.h
        v = np.concatenate(([0.0], np.cumsum(h / 2 * (s[:-1] + s[1:]))))
        y = np.concatenate(([0.0], np.cumsum(h * v[:-1] + h**2 / 6 * (2 * s[:-1] + s[1:]))))
        mean = y[-1] / (h * (s.size - 1))
        return s, v - mean, y - mean * h * np.arange(s.size)

    def nodes(self, duration: float, rtol: float) -> tuple[float, Vector]:
        """Rows [s, s', s''] of quintics: right to `rtol` up to four times the Nyquist frequency of the samples.

        That is the relative error of the spectrum. ValueError when it takes more than 20 million rows.
        """
        cells = 1 if self.integrals == 2 else max(2, math.ceil(HIGHEST * math.pi * (ERROR / rtol) ** (1 / 6)))
        dt = self.h / cells
        count = min(math.ceil(duration / dt - 1e-9), cells * (self.samples.size - 1)) + 1
        if count > MOST_NODES:
            raise ValueError(f"a record joined by straight lines needs {count:.3g} nodes over {duration:g} s; "
                             "simulate a shorter time, or leave out interpolation")  # fmt: skip
        t = dt * np.arange(count)
        rows = np.stack([self._derived(t, order) for order in range(3)], axis=1)
        self._round(rows, cells, dt)
        return dt, rows

    def _derived(self, t: Vector, order: int) -> Any:
        """A derivative of what this is, of the side ahead where it jumps."""
        if order <= self.integrals:
            return self._at(t, self.integrals - order)
        if order > self.integrals + 1:
            return np.zeros(t.shape)
        cell = np.clip((t / self.h + 1e-9).astype(np.int64), 0, self.samples.size - 2)
        return np.diff(self.samples)[cell] / self.h

    def _round(self, rows: Vector, cells: int, dt: float) -> None:
        """Round the kinks, which lie on every so many rows; the ends of the record are none."""
        if self.integrals == 2:
            return
        slopes = np.diff(self.samples) / self.h
        kinks = np.arange(cells, min(len(rows), cells * slopes.size), cells)
        ahead, before = slopes[kinks // cells], slopes[kinks // cells - 1]
        rows[kinks, 1 + self.integrals] = (before + ahead) / 2
        if self.integrals == 0:
            rows[kinks, 0] += 3 / 80 * (ahead - before) * dt
            rows[kinks, 2] = 15 / 4 * (ahead - before) / dt
        else:
            rows[kinks, 1] += 3 / 64 * (ahead - before) * dt
