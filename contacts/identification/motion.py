"""Indentation, its rate and the entry rate of one measured collision, and the effect of their noise."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.polynomial import Legendre
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray

from contacts.identification.records import Samples, Vector

_ROUGHER = 2
"""Degrees above Akaike's choice: bias then falls well below the noise, which the intervals know."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Indentation and rate as arguments of a law, and their derivatives by numbers of known covariance.

    Attributes
    ----------
    delta, delta_dot : (k,) m, m/s.
    entry_rate, exit_rate : m/s, > 0.
    covariance : (j, j) of the numbers behind it: the coefficients of a polynomial, or the entry rate alone.
    freedom : degrees of freedom of that covariance.
    basis : (3, k, j) derivatives of delta, delta_dot and the entry rate by them.
    way_in : the samples that tell the entry rate.
    """

    delta: Vector
    delta_dot: Vector
    entry_rate: float
    exit_rate: float
    covariance: NDArray[np.float64]
    freedom: int
    basis: NDArray[np.float64]
    way_in: _Branch

    def entry_rate_at(self, offset: float, exponent: float, damping_factor: float) -> float:
        """The entry rate of these samples for another surface and law."""
        return self.way_in.rate(self.delta, self.delta_dot, offset, exponent, damping_factor)[0]

    def influence(self, by_delta: Vector, by_rate: Vector, by_entry: Vector) -> NDArray[np.float64]:
        """(k, j) change of the forces by the numbers behind the motion."""
        weights = np.array([by_delta, by_rate, by_entry])
        return np.einsum("ik,ikj->kj", weights, self.basis)


def motion_of(samples: Samples, offset: float, exponent: float, damping_factor: float, *, fully: bool = True) -> Motion:
    """The motion of a collision whose contact begins at delta = offset; not fully: without the entry rate's basis."""
    about = offset, exponent, damping_factor
    if samples.time is not None:
        return _smoothed(samples, about, fully)
    assert samples.delta_dot is not None
    measured = samples.delta, samples.delta_dot
    way_in, way_out = (_branch(*measured, offset, direction) for direction in (1, -1))
    entry, error = way_in.rate(*measured, *about)
    basis = np.zeros((3, len(samples.delta), 1))
    basis[2] = 1.0
    variance = np.array([[error**2]])
    return Motion(*measured, entry, way_out.rate(*measured, *about)[0], variance, len(basis[0]), basis, way_in)


@dataclass(frozen=True, eq=False)
class _Branch:
    """The samples of the way in (direction 1) or out (-1) that tell |δ̇| at the surface, chosen once.

    A free mass has δ̇ = δ̇_surface × S(y), y = (x/x_max)^{p+1}, with the S of `_swing`; fitted to the outer half of the
    branch, with a term S y for what else acts on the structure where the samples suffice. Derivatives by the offset or
    by the motion hold the choice: a sample more or less is a jump of the rate, no derivative.
    """

    near: NDArray[np.intp]
    top: int
    direction: int

    def rate(
        self, delta: Vector, delta_dot: Vector, offset: float, exponent: float, damping_factor: float
    ) -> tuple[float, float]:
        """|δ̇| at the surface delta = offset, and its standard error."""
        x, rate = np.maximum(delta - offset, 0.0), self.direction * delta_dot[self.near]
        y = (x[self.near] / x[self.top]) ** (exponent + 1.0)
        shape = _swing(y, self.direction * damping_factor)
        A = np.column_stack((shape, shape * y)) if len(y) >= 6 else shape[:, None]
        found, *_ = np.linalg.lstsq(A, rate, rcond=None)
        left = A @ found - rate
        variance = float(left @ left) / (len(y) - A.shape[1]) * np.linalg.pinv(A.T @ A)[0, 0]
        return max(float(found[0]), 0.5 * float(rate.max())), math.sqrt(variance)


def _branch(delta: Vector, delta_dot: Vector, offset: float, direction: int) -> _Branch:
    """The samples of one way that lie between the surface delta = offset and 0.8 of the depth."""
    x, rate = delta - offset, direction * delta_dot
    top = int(np.argmax(x))
    branch = np.arange(len(x)) <= top if direction > 0 else np.arange(len(x)) >= top
    near = np.flatnonzero(branch & (x > 0.0) & (x < 0.8 * x[top]) & (rate > 0.0))
    if len(near) < 2:
        raise ValueError(
            f"a collision has {len(near)} samples that move {'in' if direction > 0 else 'out'}; delta_dot must be the "
            "rate of delta, and samples dense enough to tell the speeds at its ends"
        )
    return _Branch(near, top, direction)


def _swing(y: Vector, a: float) -> Vector:
    """|δ̇| over its value at the surface where the elastic energy is the fraction y of the largest, for a factor ±a.

    s/(1 + a s) ds = -dE gives y = 1 - G(s)/G(1), G(s) = s/a - ln(1 + a s)/a².
    """
    a = max(min(a, 5.0), -0.9)
    s = np.linspace(0.0, 1.0, 2001)
    # two terms of the series where the difference cancels: error a²/4, as the rounding of the difference, 1e-16/a²
    energy = s**2 * (0.5 - a * s / 3.0) if abs(a) < 1e-4 else s / a - np.log1p(a * s) / a**2
    return np.interp(-y, energy / energy[-1] - 1.0, s)


def _smoothed(samples: Samples, about: tuple[float, float, float], fully: bool) -> Motion:
    """δ(t) in contact as a polynomial, with its derivative."""
    offset = about[0]
    first, last = _in_contact(samples.delta, offset)
    A, B, found, covariance, freedom = _polynomial(samples, first, last)
    position, speed = np.minimum(samples.delta, offset), np.zeros(len(samples.delta))
    position[first:last], speed[first:last] = A @ found, B @ found
    way_in, way_out = (_branch(position, speed, offset, direction) for direction in (1, -1))
    basis = np.zeros((3, len(samples.delta), len(found)))
    basis[0, first:last], basis[1, first:last] = A, B
    if fully:
        step = 1e-6 * float(samples.delta.max())
        for j, (by_delta, by_speed) in enumerate(zip(basis[0].T, basis[1].T, strict=True)):
            rates = [way_in.rate(position + h * by_delta, speed + h * by_speed, *about)[0] for h in (step, -step)]
            basis[2, :, j] = (rates[0] - rates[1]) / (2.0 * step)
    entry, leaving = (way.rate(position, speed, *about)[0] for way in (way_in, way_out))
    return Motion(position, speed, entry, leaving, covariance, freedom, basis, way_in)


@lru_cache(maxsize=64)
def _polynomial(
    samples: Samples, first: int, last: int
) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any], int]:
    """(functions, their rates, coefficients, covariance of these, degrees of freedom) on a stretch of samples."""
    assert samples.time is not None
    t, delta = samples.time[first:last], samples.delta[first:last]
    u, scale = 2.0 * (t - t[0]) / (t[-1] - t[0]) - 1.0, 2.0 / (t[-1] - t[0])
    degree = min(_akaike(u, delta) + _ROUGHER, len(t) - 3)
    A = legvander(u, degree)
    B = scale * np.column_stack([Legendre.basis(j).deriv()(u) for j in range(degree + 1)])
    found, *_ = np.linalg.lstsq(A, delta, rcond=None)
    left, freedom = A @ found - delta, len(t) - degree - 1
    return A, B, found, float(left @ left) / freedom * np.linalg.pinv(A.T @ A), freedom


def _in_contact(delta: Vector, offset: float) -> tuple[int, int]:
    """First sample of the stretch above the surface around the deepest one, and the one after its last."""
    below = np.flatnonzero(delta <= offset)
    top = int(np.argmax(delta))
    before, after = below[below < top], below[below > top]
    return int(before[-1]) + 1 if len(before) else 0, int(after[0]) if len(after) else len(delta)


def _akaike(u: Vector, delta: Vector) -> int:
    """Degree of the polynomial with the least corrected criterion."""
    scores, n = {}, len(u)
    for degree in range(3, min(12, n // 2) + 1):
        A = legvander(u, degree)
        found, *_ = np.linalg.lstsq(A, delta, rcond=None)
        k = degree + 2
        total = max(float(np.sum((A @ found - delta) ** 2)), 1e-300)
        scores[degree] = n * math.log(total / n) + 2.0 * k * n / max(n - k - 1, 1)
    return min(scores, key=lambda degree: scores[degree])
