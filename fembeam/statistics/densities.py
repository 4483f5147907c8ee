"""Probability densities and moments of samples."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam.statistics.batches import Estimate
from fembeam.support import is_listed, is_whole, numbers

MOST_BINS = 200


@dataclass(frozen=True, eq=False)
class Density:
    """An estimated probability density; unpacks as `x, density`.

    Parameters
    ----------
    x : array, shape (n,)
        Centres of the bins.
    density : array, shape (n,)
        Probability per unit of x; the sum of density times bin width is 1.
    standard_error : array, shape (n,), optional
        Of the density, where it was estimated from batches of a long run.
    estimate : Estimate, optional
        The density with what its intervals are made from.
    """

    x: NDArray[np.float64]
    density: NDArray[np.float64]
    standard_error: NDArray[np.float64] | None = None
    estimate: Estimate | None = None

    def interval(self, confidence: float = 0.95) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Bounds (n,), (n,) of the density's confidence interval in each bin; see `Estimate.interval`."""
        if self.estimate is None:
            raise ValueError("this density has no scatter to tell an interval from; take one of `stationary`")
        return self.estimate.interval(confidence)

    def __repr__(self) -> str:
        return f"<density of {self.x.size} bins, {self.x[0]:.4g} to {self.x[-1]:.4g}>"

    def __iter__(self) -> Iterator[NDArray[np.float64]]:
        return iter((self.x, self.density))


@dataclass(frozen=True)
class Moments:
    """Mean, standard deviation, skewness and kurtosis (3 for a Gaussian)."""

    mean: float
    std: float
    skewness: float
    kurtosis: float


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
    values = checked_samples("pdf", samples).ravel()
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
    values = checked_samples("moments", samples).ravel()
    mean, std = float(values.mean()), float(values.std())
    if values.min() == values.max():
        return Moments(mean, 0.0, math.nan, math.nan)
    scaled = (values - mean) / std
    return Moments(mean, std, float((scaled**3).mean()), float((scaled**4).mean()))


def checked_samples(caller: str, samples: ArrayLike, fewest: int = 2) -> NDArray[np.float64]:
    """The samples as finite floats, or an error that names the first bad one."""
    values = numbers("samples", samples, caller, "give an array of a signal's values")
    if values.size < fewest:
        raise ValueError(f"{caller} needs at least {fewest} samples, got {values.size}")
    if not np.isfinite(values).all():
        i = int(np.argmin(np.isfinite(values)))
        raise ValueError(f"{caller}: samples must be finite, got {values.flat[i]} at index {i}")
    return values


def _bin_count(values: NDArray[np.float64]) -> int:
    """Freedman and Diaconis' number of bins, within reason for heavy tails."""
    lower, upper = np.percentile(values, [25, 75])
    width = 2 * (upper - lower) / values.size ** (1 / 3)
    return max(10, int(np.ptp(values) / width)) if np.ptp(values) < MOST_BINS * width else MOST_BINS


def _edges(values: NDArray[np.float64], bins: int | ArrayLike) -> NDArray[np.float64]:
    """Bin edges from a count or from the caller, checked."""
    if not is_listed(bins):
        if not is_whole(bins) or bins < 1:
            raise ValueError(f"pdf: bins must be a whole number of at least 1, or edges, got {bins!r}")
        return np.histogram_bin_edges(values, int(bins))
    edges = numbers("edges of bins", bins, "pdf", "give rising values, or a count")
    if edges.ndim != 1 or edges.size < 2 or not np.all(np.diff(edges) > 0):
        raise ValueError("pdf: edges of bins must increase strictly and be at least 2")
    if not (edges[0] <= values.min() and values.max() <= edges[-1]):
        raise ValueError(
            f"pdf: edges [{edges[0]:g}, {edges[-1]:g}] leave out samples, which span "
            f"[{values.min():g}, {values.max():g}]; widen them"
        )
    return edges
