"""Extremes of a motion between its samples: of the cubics through values u and slopes v."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


def extremes_of(t: Vector, u: Vector, v: Vector) -> tuple[float, float]:
    """Extremes of the cubics through values u and slopes v."""
    values = _between(t, u, v)[1]
    found = np.concatenate((u, values[np.isfinite(values)]))
    return float(found.min()), float(found.max())


def time_of_top(t: Vector, u: Vector, v: Vector) -> float:
    """Time of the highest value of the cubics through u and v."""
    j, s = _top(t, u, v)
    return float(t[j] + s * (t[j + 1] - t[j]) if s else t[j])


def of_top(t: Vector, u: Vector, v: Vector, du: Vector, dv: Vector) -> float:
    """Derivative of the highest value of the cubics through u and v, by those of u and v at fixed times.

    The highest value is stationary in its place, so that it changes as the cubic does there.
    """
    j, s = _top(t, u, v)
    if not s:
        return float(du[j])
    h, rest, (a, b), (a_dot, b_dot) = t[j + 1] - t[j], 1.0 - s, du[j : j + 2], dv[j : j + 2]
    return float(rest**2 * ((1.0 + 2.0 * s) * a + s * h * a_dot) + s**2 * ((3.0 - 2.0 * s) * b - rest * h * b_dot))


def _top(t: Vector, u: Vector, v: Vector) -> tuple[int, float]:
    """Interval and place in it, in [0, 1), of the highest value; place 0 is a sample."""
    i, (places, values) = int(np.argmax(u)), _between(t, u, v)
    values = np.where(np.isfinite(values), values, -np.inf)
    if not values.max(initial=-np.inf) > u[i]:
        return i, 0.0
    s, j = np.unravel_index(np.argmax(values), values.shape)
    return int(j), float(places[s, j])


def _between(t: Vector, u: Vector, v: Vector) -> tuple[Vector, Vector]:
    """Places and values (2, k - 1) of the extremes inside the intervals; NaN where there is none."""
    h, rise = np.diff(t), np.diff(u)
    a, b, c = v[:-1] * h, 3.0 * rise - (2.0 * v[:-1] + v[1:]) * h, -2.0 * rise + (v[:-1] + v[1:]) * h
    with np.errstate(divide="ignore", invalid="ignore"):
        # a + 2 b s + 3 c s² = 0, in the form without cancellation: one root where a = 0, as at rest, is not 0
        large = -b - np.copysign(np.sqrt(b * b - 3.0 * a * c), b)
        s = np.stack((a / large, large / (3.0 * c)))
        s = np.where((s > 0.0) & (s < 1.0), s, np.nan)
    return s, u[:-1] + s * (a + s * (b + s * c))
