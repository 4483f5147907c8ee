"""Statistics of a sampled signal that arrives in pieces: constant memory however long it lasts.

row of a batch: [n, Σξ, Σξ², Σξ³, Σξ⁴, time, up-crossings | histogram | Welch's sums],        ξ = x - origin
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam.statistics.batches import Batches, Estimate
from fembeam.statistics.densities import Density
from fembeam.statistics.scales import KURTOSIS, LEVEL, LINEAR, RATE, SKEWNESS, Scale
from fembeam.statistics.spectra import Spectrum, Welch

Vector = NDArray[np.float64]
BINS = 240  # over twice the range of the first samples
N, FIRST, TIME, CROSSINGS, PLAIN = 0, 1, 5, 6, 7  # places in a row; Σξ^k at FIRST + k - 1


class Signal:
    """Moments, density, spectrum and crossing rate of one signal, each with its standard error.

    Parameters
    ----------
    first : samples (k,) that fix the origin and, unless given, the bins: twice their range, 240 bins.
    dt : sampling step, s.
    segment : samples of a Welch segment, at least 8.
    level : the level whose up-crossings are counted.
    bins : increasing edges of the histogram; what falls outside is counted in `outside`.
    unit : of the signal, "" where it is not known.

    Examples
    --------
    >>> x = np.sin(0.1 * np.arange(20_000))
    >>> signal = Signal(x, dt=0.1, segment=512)
    >>> for part in np.split(x, 20):
    ...     signal.add(part)
    >>> round(float(signal.variance.value), 3), round(2 * math.pi * float(signal.crossing_rate.value), 2)
    (0.5, 1.0)
    """

    def __init__(
        self, first: Vector, dt: float, segment: int, level: float = 0.0, bins: Vector | None = None, unit: str = "m"
    ) -> None:
        self.dt, self.level, self.origin, self.unit = dt, level, float(np.mean(first)), unit
        self.edges = _edges_around(first) if bins is None else np.asarray(bins, dtype=np.float64)
        self._equal = bins is None  # by multiplication, several times quicker than by search
        self.welch = Welch(segment, dt)
        self._welch_at = PLAIN + self.edges.size + 1
        self.batches = Batches(self._welch_at + self.welch.size)
        self._last: tuple[float, float] | None = None
        self.smallest, self.largest = math.inf, -math.inf

    def __repr__(self) -> str:
        total = self.batches.total
        return f"<signal of {int(total[N])} samples, std {float(self.std.value):.4g}>" if total[N] else "<empty signal>"

    def arrays(self) -> dict[str, Vector]:
        """All it holds between two stretches, to be kept in a file."""
        numbers = [self.origin, float(self._equal), self.welch.segment, self.smallest, self.largest]
        return {"edges": self.edges, "numbers": np.array(numbers), **self.batches.arrays()}

    @classmethod
    def of_arrays(cls, arrays: Mapping[str, Vector], dt: float, level: float, unit: str) -> Signal:
        """The one that these `arrays` are of, to go on with another stretch."""
        origin, equal, segment, smallest, largest = (float(one) for one in arrays["numbers"])
        found = cls(np.array([origin]), dt, int(segment), level, arrays["edges"], unit)
        found._equal, found.smallest, found.largest = bool(equal), smallest, largest
        found.batches.take(arrays)
        return found

    def cut(self) -> None:
        """The next samples do not follow the last ones."""
        self._last = None
        self.welch.cut()

    def add(self, x: Vector, rate: Vector | None = None) -> None:
        """One batch of samples (k,), with their rates if known: then crossings of the cubics between them count too."""
        if not np.isfinite(x).all():
            raise ValueError(f"samples must be finite, got {x[~np.isfinite(x)][0]} in a batch of {x.size}")
        row = np.zeros(self.batches.rows.shape[1])
        centred = x - self.origin
        power = np.ones_like(x)
        for k in range(5):
            row[N + k] = power.sum()
            power *= centred
        steps = np.concatenate(([] if self._last is None else [self._last[0]], x)) - self.level
        slopes = None if rate is None else np.concatenate(([] if self._last is None else [self._last[1]], rate))
        row[TIME], row[CROSSINGS] = self.dt * (steps.size - 1), up_crossings(steps, slopes, self.dt)
        row[PLAIN : self._welch_at] = np.bincount(self._bin_of(x), minlength=self.edges.size + 1)
        row[self._welch_at :] = self.welch.sums(centred)
        self.batches.add(row)
        self._last = float(x[-1]), math.nan if rate is None else float(rate[-1])
        self.smallest, self.largest = min(self.smallest, float(x.min())), max(self.largest, float(x.max()))

    def _bin_of(self, x: Vector) -> NDArray[np.int64]:
        """Number of the bin of each sample: 0 below the first edge, the number of edges above the last one."""
        if not self._equal:
            return np.searchsorted(self.edges, x, side="right")
        number = (x - self.edges[0]) * ((self.edges.size - 1) / (self.edges[-1] - self.edges[0])) + 1.0
        return np.clip(number, 0.5, self.edges.size + 0.5).astype(np.int64)

    @property
    def mean(self) -> Estimate:
        """Mean."""
        return self._of(lambda s: self.origin + s[FIRST] / s[N])

    @property
    def variance(self) -> Estimate:
        """Mean square about the mean."""
        return self._of(lambda s: _central(s)[0], LEVEL)

    @property
    def std(self) -> Estimate:
        """Standard deviation."""
        return self._of(lambda s: math.sqrt(_central(s)[0]), LEVEL)

    @property
    def skewness(self) -> Estimate:
        """Third central moment over std³; 0 for a Gaussian."""
        return self._of(lambda s: _standardised(s, 3), SKEWNESS)

    @property
    def kurtosis(self) -> Estimate:
        """Fourth central moment over std⁴; 3 for a Gaussian."""
        return self._of(lambda s: _standardised(s, 4), KURTOSIS)

    @property
    def crossing_rate(self) -> Estimate:
        """Up-crossings of `level` per second; its error is not known without one."""
        return self._of(lambda s: s[CROSSINGS] / s[TIME], RATE).if_met(self.batches.total[CROSSINGS] > 0.0)

    @property
    def outside(self) -> float:
        """Share of the samples outside the histogram."""
        total = self.batches.total
        return float((total[PLAIN] + total[self._welch_at - 1]) / total[N])

    @property
    def pdf(self) -> Density:
        """Probability density; its integral is 1 - `outside`."""
        width = np.diff(self.edges)
        found = self._of(lambda s: s[PLAIN + 1 : self._welch_at - 1] / (s[N] * width))
        return Density((self.edges[1:] + self.edges[:-1]) / 2, found.value, found.standard_error, found)

    @property
    def psd(self) -> Spectrum:
        """One-sided power spectral density per rad/s; `.per_hz` converts."""
        found = self._of(lambda s: self.welch.density(s[self._welch_at :], s[FIRST] / s[N]), LEVEL)
        count = int(self.batches.total[self._welch_at])
        return Spectrum(self.welch.omega, found.value, count, found.standard_error, found, self.unit)

    def power(self, lo: ArrayLike, hi: ArrayLike) -> Estimate:
        """Part of the variance carried by lo <= ω <= hi (rad/s): of one band, or of several (k,)."""
        lows, highs = np.broadcast_arrays(lo, hi)

        def parts(s: Vector) -> Any:
            spectrum = Spectrum(self.welch.omega, self.welch.density(s[self._welch_at :], s[FIRST] / s[N]), 0)
            found = [spectrum.variance_in(*band) for band in zip(lows.flat, highs.flat, strict=True)]
            return np.reshape(found, lows.shape)[()]

        return self._of(parts, LEVEL)

    def _of(self, function: Callable[[Vector], Any], scale: Scale = LINEAR) -> Estimate:
        """An estimate from the batches."""
        return self.batches.estimate(function, scale)


def up_crossings(x: Vector, rate: Vector | None, dt: float) -> int:
    """How often samples x (k,) go from below to above 0; with rates, the cubics between two samples.

    A cubic changes its sign no more often than its Bézier points x, x + ẋ dt/3, x - ẋ dt/3, x do. Where these do so
    more than once, its extrema decide.
    """
    count = _rises(x[:-1], x[1:])
    if rate is None:
        return count
    above, second, third = x > 0.0, (x + dt / 3 * rate)[:-1] > 0.0, (x - dt / 3 * rate)[1:] > 0.0
    changes = above[:-1] != second, second != third, third != above[1:]
    several = np.flatnonzero(changes[0] & changes[1] | changes[1] & changes[2] | changes[2] & changes[0])
    a, b = x[several], x[several + 1]
    on_the_way = (a, *_extrema(a, b, dt * rate[several], dt * rate[several + 1]), b)
    return count - _rises(a, b) + sum(_rises(*pair) for pair in pairwise(on_the_way))


def _rises(before: Vector, after: Vector) -> int:
    """How many pairs go from below to above 0."""
    return int(np.count_nonzero((before <= 0.0) & (after > 0.0)))


def _extrema(a: Vector, b: Vector, u: Vector, v: Vector) -> Vector:
    """(2, k) extrema of cubics from a to b with slopes u and v per step, in order; a for one that is none."""
    c2, c3 = 3 * (b - a) - 2 * u - v, 2 * (a - b) + u + v  # a + uθ + c2 θ² + c3 θ³
    # 3 c3 θ² + 2 c2 θ + u = 0, in the form without cancellation
    root = -c2 - np.copysign(np.sqrt(np.maximum(c2 * c2 - 3 * c3 * u, 0.0)), c2)
    with np.errstate(divide="ignore", invalid="ignore"):
        theta = np.stack((u / root, root / (3 * c3)))
    theta = np.sort(np.where((theta > 0.0) & (theta < 1.0), theta, 0.0), axis=0)
    return np.asarray(a + theta * (u + theta * (c2 + theta * c3)))


def _central(s: Vector) -> tuple[float, float, float]:
    """Central moments of order 2, 3, 4 from sums of powers."""
    m1, m2, m3, m4 = s[FIRST : FIRST + 4] / s[N]
    second = m2 - m1**2
    third = m3 - 3 * m1 * m2 + 2 * m1**3
    return second, third, m4 - 4 * m1 * m3 + 6 * m1**2 * m2 - 3 * m1**4


def _standardised(s: Vector, order: int) -> float:
    """Central moment over the power of std; NaN for a constant."""
    moments = _central(s)
    return moments[order - 2] / moments[0] ** (order / 2) if moments[0] > 0.0 else math.nan


def _edges_around(x: Vector) -> Vector:
    """Equal bins over twice the range of the samples."""
    lo, hi = float(x.min()), float(x.max())
    half = (hi - lo) / 2 or abs(hi) or 1.0
    return np.linspace(lo - half, hi + half, BINS + 1)
