"""Periodic signals as equally spaced lines, shared by noise and measured records, and the checks signals share.

    s(t) = Re Σ_j a_j exp(i (first + j) Δω t)

The lines are known, hence every derivative is exact: multiply by (i k Δω)^n.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam.excitation.upsampling import FEWEST_POINTS, fine_grid
from fembeam.support import is_whole, number

HERMITE_CONSTANT = 46080.0  # |error| <= h^6/46080 max|s^(6)| for the quintic Hermite interpolant: 6! * 2^6
HERMITE_RMS = math.sqrt(math.factorial(13))  # rms of the error <= h^6/√13! rms of s^(6): see `LineSpectrum.nodes`
HERMITE_MEAN = 100800.0  # mean of (x(1-x))³/720 over a cell is 1/100800: what the interpolant takes off a line
EDGE = 0.25  # a band fades out over this part of lo below it and of hi above it
MANY = 1 << 18  # terms of a sum, above which transforms are quicker
MOST_NODES = 20_000_000
FINEST_RTOL = 1e-13  # finer is below the rounding of the FFT


def checked_band(name: str, band: Any) -> tuple[float, float]:
    """The band as two floats 0 <= lo < hi, or a clear error."""
    try:
        lo, hi = band
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be a pair (lo, hi) in rad/s, got {band!r}") from None
    lo, hi = number(f"{name}[0]", lo, least=0.0), number(f"{name}[1]", hi, least=0.0)
    if not lo < hi:
        raise ValueError(f"{name} must run from lo to hi > lo in rad/s, got ({lo:g}, {hi:g}); swap or widen it")
    return lo, hi


def keep_number(signal: Any, name: str, unit: str = "", **bounds: float) -> None:
    """Check one number of a frozen signal against its bounds and keep it as a float."""
    told = f"{type(signal).__name__} {name}" + (f" ({unit})" if unit else "")
    object.__setattr__(signal, name, number(told, getattr(signal, name), **bounds))


def tabulated(signal: Any, duration: float, cells: int, told: str, advice: str) -> tuple[float, NDArray[np.float64]]:
    """The step in s and rows [s, s', s''] of a signal in so many cells; ValueError if these are too many."""
    if cells > MOST_NODES:
        raise ValueError(f"{told} needs {cells:.3g} nodes over {duration:g} s; {advice}")
    t = np.linspace(0.0, duration, cells + 1)
    return duration / cells, np.stack([signal.derivative(order)(t) for order in range(3)], axis=1)


def checked_order(order: Any) -> int:
    """The number of derivatives as an int >= 0, or a clear error."""
    if not is_whole(order) or order < 0:
        raise ValueError(f"order of the derivative must be an integer of at least 0, got {order!r}")
    return int(order)


@dataclass(frozen=True, eq=False)
class LineSpectrum:
    """A periodic signal s(t) = Re Σ_j amplitude_j exp(i (first + j) spacing t).

    Parameters
    ----------
    spacing : float
        Δω in rad/s; the signal repeats after 2π/Δω.
    first : int
        Number k >= 1 of the first line.
    amplitude : complex array, shape (n,)
        Complex amplitudes of the lines first, first + 1, …
    """

    spacing: float
    first: int
    amplitude: NDArray[np.complex128]

    @property
    def omega(self) -> NDArray[np.float64]:
        """Angular frequencies of the lines in rad/s, shape (n,)."""
        return self.spacing * (self.first + np.arange(self.amplitude.size, dtype=np.float64))

    @property
    def top(self) -> int:
        """Number of the highest line."""
        return self.first + self.amplitude.size - 1

    @property
    def period(self) -> float:
        """Seconds after which the signal repeats."""
        return 2 * math.pi / self.spacing

    @property
    def rms(self) -> float:
        """Root mean square over one period, exact by Parseval."""
        return math.sqrt(0.5 * float(np.sum(self.amplitude.real**2 + self.amplitude.imag**2)))

    def derivative(self, order: int) -> LineSpectrum:
        """d^order s/dt^order; a negative order integrates, without constants."""
        unit = (1, 1j, -1, -1j)[order % 4]  # i^order without rounding
        return replace(self, amplitude=unit * self.omega**order * self.amplitude)

    def grid(self, n: int) -> NDArray[np.float64]:
        """One period at n > 2 top equally spaced instants from t = 0, by FFT."""
        from scipy.fft import irfft

        half = np.zeros(n // 2 + 1, dtype=np.complex128)
        half[self.first : self.top + 1] = self.amplitude / 2
        return irfft(half, n, norm="forward")

    def at(self, t: ArrayLike) -> Any:
        """The sum at any instants; exp(i k Δω t) is split in k = a + b, which leaves a matrix product.

        At many in equal steps by `_in_steps`, which takes n log n.
        """
        times = np.asarray(t, dtype=np.float64)
        if times.size * self.amplitude.size > MANY and _equal_steps(times):
            return self._in_steps(times)
        width = math.ceil(math.sqrt(self.amplitude.size))
        rows = math.ceil(self.amplitude.size / width)
        table = np.zeros(rows * width, dtype=np.complex128)
        table[: self.amplitude.size] = self.amplitude
        low = 1j * self.spacing * np.arange(width)
        high = 1j * self.spacing * (self.first + width * np.arange(rows))
        flat, result = times.ravel(), np.empty(times.size)
        chunk = max(1, 2**19 // width)  # some tens of MB at a time
        for i in range(0, times.size, chunk):
            part = flat[i : i + chunk, None]
            inner = np.exp(low * part) @ table.reshape(rows, width).T
            result[i : i + chunk] = np.einsum("ij,ij->i", np.exp(high * part), inner).real
        return result.reshape(times.shape)[()]

    def _in_steps(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """The sum at t (n,) in equal steps dt: with θ = Δω dt/2 and 2 j k = j² + k² - (j - k)² it is a convolution.

        L.I. Bluestein, A linear filtering approach to the computation of discrete Fourier transform, IEEE Trans. Audio
        Electroacoust. 18 (1970) 451.
        """
        from scipy.fft import fft, ifft, next_fast_len

        n, lines = t.size, self.amplitude.size
        half = self.spacing * (t[-1] - t[0]) / (n - 1) / 2
        chirp = np.exp(1j * half * np.arange(max(n, lines), dtype=np.float64) ** 2)
        turned = self.amplitude * np.exp(1j * self.omega * t[0]) * chirp[:lines]
        kernel = np.concatenate([chirp[lines - 1 : 0 : -1], chirp[:n]]).conj()
        size = next_fast_len(kernel.size)  # what a shorter transform wraps falls on the sums before those read
        sums = ifft(fft(turned, size) * fft(kernel, size))[lines - 1 : lines - 1 + n]
        return np.asarray((np.exp(1j * self.first * self.spacing * (t - t[0])) * chirp[:n] * sums).real)

    def nodes(self, duration: float, rtol: float) -> tuple[float, NDArray[np.float64]]:
        """Rows [s, s', s''] so dense that quintic Hermite interpolation errs by at most rtol in rms over the period.

            rms(error)² = ½ Σ |a_k|² ∫|e_k|² dx,    |e_k(x)| <= (ω_k h)^6 (x(1-x))³/720,    ∫(x(1-x))⁶ dx = 6!²/13!

        Errors of different lines are orthogonal, because no two of them look alike on a grid of n > 2 top points.
        The interpolant reduces a line by (ω_k h)^6/100800; its amplitude is raised by that beforehand. The remaining
        error lies above the grid's own frequency, where structures hardly respond.
        """
        if not FINEST_RTOL <= rtol < 1:
            raise ValueError(f"rtol must lie in [{FINEST_RTOL:g}, 1), got {rtol!r}")
        _keep_freed_memory()
        ratio, n = self._grids(rtol)
        dt = self.period / (ratio * n)
        square = (self.omega * dt) ** 2
        raised = self.amplitude * (1.0 + square * square * square / HERMITE_MEAN)
        return dt, fine_grid(raised, self.first, n, ratio, dt, math.ceil(duration / dt) + 1)

    def _grids(self, rtol: float) -> tuple[int, int]:
        """Nodes per point of the transform, and its length."""
        from scipy.fft import next_fast_len

        square, power = self.omega * self.omega, self.amplitude.real**2 + self.amplitude.imag**2
        sixth = float(np.sum(power * (square * square * square) ** 2))
        widest = (HERMITE_RMS * rtol) ** (1 / 6) * (float(np.sum(power)) / sixth) ** (1 / 12) if sixth > 0 else math.inf
        fewest, needed = FEWEST_POINTS * self.top, self.period / widest
        ratio = max(1, int(needed / fewest))
        return ratio, next_fast_len(max(math.ceil(needed / ratio), fewest), real=True)


def _equal_steps(t: NDArray[np.float64]) -> bool:
    """Whether times (n,) are in equal steps but for their own rounding."""
    if t.ndim != 1 or t.size < 2 or not np.isfinite(t).all():
        return False
    grid = t[0] + (t[-1] - t[0]) / (t.size - 1) * np.arange(t.size)
    return bool(np.abs(t - grid).max() <= 4 * np.finfo(float).eps * np.abs(t).max())


def within(lines: LineSpectrum, band: tuple[float, float]) -> LineSpectrum:
    """The lines in the band, with smooth edges outside it: a sharp edge rings over the whole record."""
    omega, (lo, hi) = lines.omega, band
    if not np.any((omega >= lo) & (omega <= hi)):
        raise ValueError(
            f"Record band {band} rad/s holds no line: the record resolves {lines.spacing:.6g} to "
            f"{omega[-1]:.6g} rad/s; widen the band"
        )
    outside = np.maximum(omega / hi - 1, 0.0)
    if lo > 0:
        outside = np.maximum(outside, 1 - omega / lo)
    weight = np.cos(np.pi / 2 * np.minimum(outside / EDGE, 1.0)) ** 2
    kept = np.flatnonzero(outside < EDGE)
    return LineSpectrum(lines.spacing, int(kept[0]) + 1, (weight * lines.amplitude)[kept])


@cache
def _keep_freed_memory() -> None:
    """Have arrays below 32 MB use again what was freed, where the C library is glibc.

    It hands what is freed back to the system beyond a threshold, twice the largest block freed so far (mallopt(3)). For
    the tables and samples of every realisation fresh pages would come and go, which takes as long as the transforms.
    """
    np.empty(2**22 - 2**12)  # never written to: it takes no memory
