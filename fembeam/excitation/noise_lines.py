"""The lines of a noise signal: from its seed, summed, sampled, differentiated; `BandNoise` makes them."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam.excitation.line_spectrum import LineSpectrum
from fembeam.excitation.psd import Psd, Table, evaluated
from fembeam.support import number


class NoiseLines:
    """What follows from standard deviation or density, band, seed, period, mean and order of a noise signal."""

    std: float | None
    band: tuple[float, float]
    seed: int | np.random.SeedSequence
    period: float | None
    mean: float
    psd: Psd | Table | None
    order: int

    @property
    def _spacing(self) -> float:
        """Δω in rad/s."""
        assert self.period is not None
        return 2 * math.pi / self.period

    @property
    def _span(self) -> tuple[int, int]:
        """Numbers of the first and last line; a line on the edge counts in spite of rounding."""
        lo, hi = self.band
        return max(1, math.ceil(lo / self._spacing - 1e-9)), math.floor(hi / self._spacing + 1e-9)

    def _density(self, omega: NDArray[np.float64]) -> NDArray[np.float64]:
        """S of y itself at frequencies inside the band, checked."""
        if self.psd is None:
            first, last = self._span
            assert self.std is not None
            return np.full(omega.shape, self.std**2 / (self._spacing * (last - first + 1)))
        return evaluated(self.psd, omega)

    @cached_property
    def _lines(self) -> LineSpectrum:
        """The lines of this signal, drawn from the seed."""
        phase = np.random.default_rng(self.seed).uniform(0.0, 2 * math.pi, self.omega.size)
        size, amplitude = np.sqrt(2 * self._spacing * self._density(self.omega)), np.empty(phase.size, np.complex128)
        np.multiply(size, np.cos(phase), out=amplitude.real)  # in half the time of exp(iφ)
        np.multiply(size, np.sin(phase), out=amplitude.imag)
        lines = LineSpectrum(self._spacing, self._span[0], amplitude).derivative(self.order)
        lines.amplitude.flags.writeable = False
        return lines

    @property
    def omega(self) -> NDArray[np.float64]:
        """Angular frequencies of the lines in rad/s, shape (n,)."""
        first, last = self._span
        return self._spacing * np.arange(first, last + 1, dtype=np.float64)

    @property
    def amplitude(self) -> NDArray[np.complex128]:
        """Complex amplitudes of the lines, shape (n,): value(t) = Re Σ amplitude exp(i omega t)."""
        return self._lines.amplitude

    @property
    def offset(self) -> float:
        """Constant part of this signal: the mean of y, none of its derivatives."""
        return 0.0 if self.order else self.mean

    @property
    def rms(self) -> float:
        """Standard deviation over one period of this signal, y or the derivative it stands for."""
        return self._lines.rms

    def psd_at(self, omega: ArrayLike) -> NDArray[np.float64]:
        """One-sided target density per rad/s of this signal at any omega (rad/s), zero outside the band."""
        at = np.atleast_1d(np.asarray(omega, dtype=np.float64))
        inside = (at >= self.band[0]) & (at <= self.band[1])
        result = np.zeros(at.shape)
        result[inside] = self._density(at[inside]) * at[inside] ** (2 * self.order)
        return result.reshape(np.shape(omega))

    def __call__(self, t: ArrayLike) -> Any:
        """Value at the instants t (s), of any shape, by summation; for long uniform grids see `series`."""
        return self._lines.at(t) + self.offset

    def series(self, dt: float | None = None) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """One period (t, y) on a uniform grid by FFT.

        Parameters
        ----------
        dt : float, optional
            Largest step in s; the one taken divides the period. Left out: 4 points per period of the top
            line.
        """
        from scipy.fft import next_fast_len

        lines = self._lines
        widest = lines.period / (4 * lines.top) if dt is None else number("dt (s)", dt, above=0.0)
        n = next_fast_len(max(math.ceil(lines.period / widest - 1e-9), 2 * lines.top + 1), real=True)
        return lines.period / n * np.arange(n), lines.grid(n) + self.offset

    def nodes(self, duration: float, rtol: float) -> tuple[float, NDArray[np.float64]]:
        """Hermite data of the signal on a uniform grid, with a proven interpolation error.

            rms(error) <= dt^6/√13! rms(s^(6)) <= rtol rms(s),        over the period

        Parameters
        ----------
        duration : float
            The grid covers [0, duration], in s; at most the period.
        rtol : float
            Rms error of the quintic Hermite interpolant relative to that of the signal, in [1e-13, 1).

        Returns
        -------
        dt : float
            Step in s.
        values : array, shape (N, 3)
            Rows [s, s', s''] at t = j dt.

        Raises
        ------
        ValueError
            duration beyond the period, or rtol out of range.

        Notes
        -----
        Derivatives come from the lines, the rms of s^(6) too. The grid is therefore the same for every seed of a flat
        density, whatever the phases. A Gaussian signal's largest error is five to ten times the rms.
        """
        self._check_lasts(number("duration (s)", duration, least=0.0))
        dt, values = self._lines.nodes(duration, rtol)
        if self.offset:
            values[:, 0] += self.offset
        return dt, values

    def _check_lasts(self, duration: float) -> None:
        """Refuse to repeat a realisation silently."""
        assert self.period is not None
        if duration > self.period * (1 + 1e-9):
            raise ValueError(
                f"BandNoise would repeat after its period of {self.period:.6g} s, got a duration of "
                f"{duration:.6g} s; set period to at least the duration, or leave it out"
            )
