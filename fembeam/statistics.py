"""What a stationary signal looks like: its spectrum, its density, its moments.

variance = ∫_0^∞ S(ω) dω,        S one-sided, per rad/s;        S_hz(f) = 2π S(2π f) per Hz
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam.lines import number

DEFAULT_SEGMENTS = 32  # with half overlap about 63 segments: the standard error of a level is near 13 %
SHORTEST_DEFAULT = 256  # samples per segment that a short signal still gets
MOST_BINS = 200


@dataclass(frozen=True, eq=False)
class Spectrum:
    """A one-sided power spectral density; unpacks as `omega, density`.

    Parameters
    ----------
    omega : array, shape (n,)
        Angular frequencies in rad/s, equally spaced from 0.
    density : array, shape (n,)
        S(ω) in units² per rad/s.
    n_segments : int
        Segments that were averaged; the relative standard error of a level is about 1/√n_segments.
    """

    omega: NDArray[np.float64]
    density: NDArray[np.float64]
    n_segments: int

    def __iter__(self) -> Iterator[NDArray[np.float64]]:
        return iter((self.omega, self.density))

    @property
    def per_hz(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(frequency in Hz, density per Hz)."""
        return self.omega / (2 * math.pi), self.density * (2 * math.pi)

    @property
    def variance(self) -> float:
        """∫ S dω, as the sum over the bins."""
        return self.variance_in(0.0, math.inf)

    def variance_in(self, lo: float, hi: float) -> float:
        """Part of the variance carried by the bins with lo <= ω <= hi (rad/s)."""
        if not lo < hi:
            raise ValueError(f"variance_in needs lo < hi in rad/s, got ({lo!r}, {hi!r})")
        inside = (self.omega >= lo) & (self.omega <= hi)
        return float(self.density[inside].sum() * self.omega[1])


@dataclass(frozen=True, eq=False)
class Density:
    """An estimated probability density; unpacks as `x, density`.

    Parameters
    ----------
    x : array, shape (n,)
        Centres of the bins.
    density : array, shape (n,)
        Probability per unit of x; the sum of density times bin width is 1.
    """

    x: NDArray[np.float64]
    density: NDArray[np.float64]

    def __iter__(self) -> Iterator[NDArray[np.float64]]:
        return iter((self.x, self.density))


@dataclass(frozen=True)
class Moments:
    """Mean, standard deviation, skewness and kurtosis (3 for a Gaussian)."""

    mean: float
    std: float
    skewness: float
    kurtosis: float


def psd(x: ArrayLike, dt: float, segment: int | None = None, overlap: float = 0.5) -> Spectrum:
    """Power spectral density of a sampled signal by Welch's method.

        S(ω_j) = mean over segments of |FFT(w (x - x̄))_j|² dt / (π Σ w²),        w: Hann window

    Parameters
    ----------
    x : array, shape (n,)
        Samples of a stationary signal, n >= 8.
    dt : float
        Sampling step in s, > 0.
    segment : int, optional
        Samples per segment, 8 to n; the resolution is 2π/(segment dt) rad/s. Left out: n/32, at least 256.
    overlap : float
        Fraction of a segment shared with the next, in [0, 1).

    Returns
    -------
    Spectrum
        One-sided and per rad/s; `omega, S = psd(x, dt)` works, `.per_hz` converts.

    Raises
    ------
    ValueError
        Samples not finite or too few, dt not positive, segment or overlap out of range.

    Notes
    -----
    The mean of the whole signal is removed once and the segments are not detrended, so that slow motion keeps
    its energy. The integral of S is the variance of the signal weighted by the windows: the two agree within
    the scatter between segments.

    References
    ----------
    P.D. Welch, IEEE Trans. Audio Electroacoustics 15 (1967) 70.

    Examples
    --------
    >>> t = 0.01 * np.arange(4096)
    >>> spectrum = psd(np.sqrt(2) * np.sin(50.0 * t), dt=0.01)
    >>> round(spectrum.variance, 3), round(float(spectrum.omega[np.argmax(spectrum.density)]))
    (1.0, 49)
    """
    samples = _checked_samples("psd", x, fewest=8)
    if samples.ndim != 1:
        raise ValueError(f"psd needs a signal of one dimension, got shape {samples.shape}")
    length = _segment_length(samples.size, segment)
    rate = 1 / number("psd: dt (s)", dt, above=0.0)
    if not 0 <= overlap < 1:
        raise ValueError(f"psd: overlap must lie in [0, 1), got {overlap!r}")
    from scipy.signal import welch

    shared = min(int(overlap * length), length - 1)
    hz, density = welch(
        samples - samples.mean(), fs=rate, window="hann", nperseg=length, noverlap=shared, detrend=False
    )
    count = (samples.size - shared) // (length - shared)
    return Spectrum(2 * math.pi * hz, density / (2 * math.pi), count)


def pdf(samples: ArrayLike, bins: int | ArrayLike | None = None) -> Density:
    """Probability density of samples, as a histogram whose integral is 1.

    Parameters
    ----------
    samples : array, any shape
        At least 2 finite values that are not all equal.
    bins : int or array of edges, optional
        Number of equal bins, or increasing edges that enclose all samples. Left out: by the spread of
        the middle half (Freedman and Diaconis), 10 to 200 bins.

    Returns
    -------
    Density
        Bin centres and density; `x, p = pdf(samples)` works.

    Raises
    ------
    ValueError
        Samples not finite, too few or all equal; bins that are not positive or leave samples out.

    Examples
    --------
    >>> x, p = pdf([0.0, 0.5, 1.0, 1.0], bins=2)
    >>> p.tolist()
    [0.5, 1.5]
    """
    values = _checked_samples("pdf", samples).ravel()
    if values.min() == values.max():
        raise ValueError(f"pdf: all {values.size} samples equal {values[0]:g}, which has no density")
    edges = np.histogram_bin_edges(values, _bin_count(values)) if bins is None else _edges(values, bins)
    density, edges = np.histogram(values, bins=edges, density=True)
    return Density((edges[1:] + edges[:-1]) / 2, density)


def moments(samples: ArrayLike) -> Moments:
    """Mean, standard deviation, skewness and kurtosis of samples.

        skewness = mean(ξ³),    kurtosis = mean(ξ⁴),    ξ = (x - mean)/std        (0 and 3 for a Gaussian)

    Parameters
    ----------
    samples : array, any shape
        At least 2 finite values.

    Returns
    -------
    Moments
        Over all samples; std divides by n. Skewness and kurtosis of equal samples are NaN.

    Raises
    ------
    ValueError
        Fewer than 2 samples, or one that is not finite.

    Examples
    --------
    >>> moments([-1.0, 1.0, -1.0, 1.0])
    Moments(mean=0.0, std=1.0, skewness=0.0, kurtosis=1.0)
    """
    values = _checked_samples("moments", samples).ravel()
    mean, std = float(values.mean()), float(values.std())
    if values.min() == values.max():
        return Moments(mean, 0.0, math.nan, math.nan)
    scaled = (values - mean) / std
    return Moments(mean, std, float((scaled**3).mean()), float((scaled**4).mean()))


def _checked_samples(caller: str, samples: ArrayLike, fewest: int = 2) -> NDArray[np.float64]:
    """The samples as finite floats, or an error that names the first bad one."""
    try:
        values = np.asarray(samples, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"{caller}: samples must be an array of numbers") from None
    if values.size < fewest:
        raise ValueError(f"{caller} needs at least {fewest} samples, got {values.size}")
    if not np.isfinite(values).all():
        i = int(np.argmin(np.isfinite(values)))
        raise ValueError(f"{caller}: samples must be finite, got {values.flat[i]} at index {i}")
    return values


def _segment_length(n: int, segment: int | None) -> int:
    """Samples per segment, chosen or checked."""
    if segment is None:
        return min(n, max(SHORTEST_DEFAULT, n // DEFAULT_SEGMENTS))
    if isinstance(segment, bool) or not isinstance(segment, (int, np.integer)) or not 8 <= segment <= n:
        raise ValueError(f"psd: segment must be a whole number of samples from 8 to {n}, got {segment!r}")
    return int(segment)


def _bin_count(values: NDArray[np.float64]) -> int:
    """Freedman and Diaconis' number of bins, within reason for heavy tails."""
    lower, upper = np.percentile(values, [25, 75])
    width = 2 * (upper - lower) / values.size ** (1 / 3)
    return int(np.clip(np.ptp(values) / width, 10, MOST_BINS)) if width > 0 else MOST_BINS


def _edges(values: NDArray[np.float64], bins: int | ArrayLike) -> NDArray[np.float64]:
    """Bin edges from a count or from the caller, checked."""
    if np.ndim(bins) == 0:
        if isinstance(bins, bool) or not isinstance(bins, (int, np.integer)) or bins < 1:
            raise ValueError(f"pdf: bins must be a whole number of at least 1, or edges, got {bins!r}")
        return np.histogram_bin_edges(values, int(bins))
    edges = np.asarray(bins, dtype=np.float64)
    if edges.ndim != 1 or edges.size < 2 or not np.all(np.diff(edges) > 0):
        raise ValueError("pdf: edges of bins must increase strictly and be at least 2")
    if not (edges[0] <= values.min() and values.max() <= edges[-1]):
        raise ValueError(
            f"pdf: edges [{edges[0]:g}, {edges[-1]:g}] leave out samples, which span "
            f"[{values.min():g}, {values.max():g}]; widen them"
        )
    return edges
