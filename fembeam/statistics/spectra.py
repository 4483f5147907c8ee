"""Power spectral densities by Welch's method: of samples at hand, and summed up as samples arrive.

variance = ∫_0^∞ S(ω) dω,        S one-sided, per rad/s;        S_hz(f) = 2π S(2π f) per Hz
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam.statistics.batches import Estimate
from fembeam.statistics.densities import checked_samples
from fembeam.support import is_number, is_whole, number

DEFAULT_SEGMENTS = 32  # with half overlap about 63 segments: the standard error of a level is near 13 %
SHORTEST_DEFAULT = 256  # samples per segment that a short signal still gets


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
    standard_error : array, shape (n,), optional
        Of the density, where it was estimated from batches of a long run.
    estimate : Estimate, optional
        The density with what its intervals are made from.
    unit : str
        Of the signal, "" where it is not known.
    """

    omega: NDArray[np.float64]
    density: NDArray[np.float64]
    n_segments: int
    standard_error: NDArray[np.float64] | None = None
    estimate: Estimate | None = None
    unit: str = "m"

    def __repr__(self) -> str:
        return f"<spectrum of {self.omega.size} lines to {self.omega[-1]:.6g} rad/s, {self.n_segments} segments>"

    def __iter__(self) -> Iterator[NDArray[np.float64]]:
        return iter((self.omega, self.density))

    @property
    def per_hz(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(frequency in Hz, density per Hz)."""
        return self.omega / (2 * math.pi), self.density * (2 * math.pi)

    def interval(self, confidence: float = 0.95) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Bounds (n,), (n,) of the density's confidence interval at each frequency; see `Estimate.interval`."""
        if self.estimate is None:
            raise ValueError("this spectrum has no scatter to tell an interval from; take one of `stationary`")
        return self.estimate.interval(confidence)

    @property
    def variance(self) -> float:
        """∫ S dω, as the sum over the bins."""
        return self.variance_in(0.0, math.inf)

    def variance_in(self, lo: float, hi: float) -> float:
        """Part of the variance carried by the bins with lo <= ω <= hi (rad/s)."""
        if not (is_number(lo) and is_number(hi) and lo < hi):
            raise ValueError(f"variance_in needs lo < hi in rad/s, got ({lo!r}, {hi!r})")
        inside = (self.omega >= lo) & (self.omega <= hi)
        return float(self.density[inside].sum() * self.omega[1])


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
        Samples per segment, 8 to n; the resolution is 2π/(segment dt) rad/s. Left out: n/32, at least 256, at most n.
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
    samples = checked_samples("psd", x, fewest=8)
    if samples.ndim != 1:
        raise ValueError(f"psd needs a signal of one dimension, got shape {samples.shape}")
    length = segment_length(samples.size, segment)
    rate = 1 / number("psd: dt (s)", dt, above=0.0)
    if not 0 <= number("psd: overlap", overlap) < 1:
        raise ValueError(f"psd: overlap must lie in [0, 1), got {overlap!r}")
    from scipy.signal import welch

    shared = min(int(overlap * length), length - 1)
    hz, density = welch(
        samples - samples.mean(), fs=rate, window="hann", nperseg=length, noverlap=shared, detrend=False
    )
    count = (samples.size - shared) // (length - shared)
    return Spectrum(2 * math.pi * hz, density / (2 * math.pi), count)


def segment_length(n: int, segment: int | None) -> int:
    """Samples per segment, chosen or checked."""
    if segment is None:
        return min(n, max(SHORTEST_DEFAULT, n // DEFAULT_SEGMENTS))
    if not is_whole(segment) or not 8 <= segment <= n:
        raise ValueError(f"psd: segment must be a whole number of samples from 8 to {n}, got {segment!r}")
    return int(segment)


class Welch:
    """Welch's sums over samples that arrive in pieces, of a signal cut into stretches.

    The segments are those `psd` takes of each stretch (Hann window, half overlap). The sums are linear in the segments:

        [segments, Σ X_0, Σ Re X_1, Σ Im X_1, Σ |X_0|², Σ |X_1|², …],        X = FFT(w x)

    and the mean, which is known at the end only, is taken out then: it touches X_0 and X_1 alone.
    """

    def __init__(self, segment: int, dt: float) -> None:
        self.segment, self.dt = segment, dt
        self.window = np.sin(np.pi * np.arange(segment) / segment) ** 2
        self.size = 4 + segment // 2 + 1
        self._kept = np.empty(0)

    def cut(self) -> None:
        """The next samples do not follow the last ones."""
        self._kept = np.empty(0)

    def sums(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Sums (size,) over the segments these samples complete."""
        x = np.concatenate((self._kept, x))
        hop = self.segment - self.segment // 2
        total = np.zeros(self.size)
        starts = range(0, x.size - self.segment + 1, hop)
        for i in range(0, len(starts), 64):  # some MB at a time
            parts = np.stack([x[j : j + self.segment] for j in starts[i : i + 64]])
            X = np.fft.rfft(self.window * parts)
            total[:4] += len(parts), X[:, 0].real.sum(), X[:, 1].real.sum(), X[:, 1].imag.sum()
            total[4:] += (X.real**2 + X.imag**2).sum(axis=0)
        self._kept = x[hop * len(starts) :]
        return total

    def density(self, sums: NDArray[np.float64], mean: float) -> NDArray[np.float64]:
        """S(ω) (segment//2 + 1,) from sums, the mean of the signal taken out; NaN without a segment."""
        if sums[0] == 0:
            return np.full(self.size - 4, math.nan)
        power = sums[4:].copy()
        at_0, at_1 = mean * self.window.sum(), -mean * self.window.sum() / 2  # FFT(w) = Σw (1, -1/2, 0, …)
        power[0] += at_0 * (sums[0] * at_0 - 2 * sums[1])
        power[1] += at_1 * (sums[0] * at_1 - 2 * sums[2])
        power[1 : (self.segment + 1) // 2] *= 2  # one-sided: ω = 0 and the Nyquist frequency have no mirror
        return power * self.dt / (2 * math.pi * sums[0] * float(self.window @ self.window))

    @property
    def omega(self) -> NDArray[np.float64]:
        """Frequencies of the density, rad/s."""
        return 2 * math.pi / (self.segment * self.dt) * np.arange(self.size - 4, dtype=np.float64)


FINEST_RESOLUTION = 2.0  # rad/s per line of a spectrum; finer only makes it noisier
FEWEST_OF_SLOW = 64  # samples per segment, however slow the motion: with ten to its period, a period has six lines
