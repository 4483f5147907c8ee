"""Samples joined by straight lines, and the first two integrals of that: the convention of earthquake engineering.

    s(t) = s_j + (s_{j+1} - s_j) (t - t_j)/h,        t_j = j h

Integrators take a load as polynomials between nodes at which slope and curvature may jump, so it is exact to rounding.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Vector = NDArray[np.float64]


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
        """Rows [s, s', s''] of the cell that begins at a sample, then of the cell that ends there; see `signals`."""
        last = self.samples.size - 1
        i = np.arange(min(int(np.ceil(duration / self.h - 1e-9)), last) + 1)
        t: Any = self.h * i
        rows, slopes = np.zeros((i.size, 2, 3)), np.diff(self.samples) / self.h
        for order in range(self.integrals + 1):
            rows[:, :, order] = self._at(t, self.integrals - order)[:, None]
        if self.integrals == 2:
            return self.h, rows[:, 0]
        rows[:, 0, self.integrals + 1] = slopes[np.minimum(i, last - 1)]
        rows[:, 1, self.integrals + 1] = slopes[np.maximum(i - 1, 0)]
        return self.h, rows.reshape(-1, 6)
