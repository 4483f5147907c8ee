"""A line spectrum on a fine grid, values with two derivatives, from one short transform.

    s(t) = Σ_l g_l φ(t/H - l),    g_l = Re Σ_k a_k/φ̂(2π k/n) exp(2π i k l/n),    φ(x) = I_0(β √(1 - (2x/w)²))/e^β

for |x| <= w/2. As Σ_l exp(iθl) φ(x - l) = Σ_m φ̂(θ + 2πm) exp(i(θ + 2πm)x), a line comes out right but for its images
m != 0. At four points or more to the period of the highest line, θ <= π/2, these have a share below e^-β, times 40 in
the second derivative: rounding. Derivatives of s are those of φ. The sums over l are products of matrices: a block of
samples times all that a unit sample gives at the grid's points around it.

Source: J. A. Fessler and B. P. Sutton, IEEE Trans. Signal Process. 51 (2003) 560, section IV (Kaiser–Bessel kernel).
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

_WIDTH = 20  # w, samples that take part in one value
_BETA = 0.75 * math.pi * _WIDTH  # φ̂ ends where the images of the highest line, at θ = 3π/2, begin
_BLOCK = 16  # samples of a block
_ONE_THREAD = 2**18  # multiplications up to which OpenBLAS keeps to one core; the others belong to other realisations
_GROUPS = 16  # of blocks at once, which processors keep at hand
FEWEST_POINTS = 4  # to the period of the highest line


def fine_grid(
    amplitude: NDArray[np.complex128], first: int, n: int, ratio: int, step: float, count: int
) -> NDArray[np.float64]:
    """Rows [s, s', s''] of Re Σ_j amplitude_j exp(2πi (first + j) t/(n H)) at t = 0, step, … (count rows).

    n >= 4 times the highest line is the length of the transform, H = ratio · step the distance of its points.
    """
    from scipy.fft import irfft

    half = np.zeros(n // 2 + 1, dtype=np.complex128)
    np.multiply(amplitude, _line_factors(first, amplitude.size, n), out=half[first : first + amplitude.size])
    samples = irfft(half, n, norm="forward")
    per_unit = _block_rows(ratio) / (ratio * step) ** np.arange(3.0)
    group = max(1, _ONE_THREAD // per_unit.size)
    groups = math.ceil(count / (group * _BLOCK * ratio))
    rows = np.empty((groups, group, per_unit[0].size))
    for i in range(0, groups, _GROUPS):
        part = rows[i : i + _GROUPS]
        np.matmul(_windows(samples, i * group, len(part), group), per_unit.reshape(len(per_unit), -1), out=part)
    return rows.reshape(-1, 3)[:count]


def _windows(samples: NDArray[np.float64], first: int, groups: int, group: int) -> NDArray[np.float64]:
    """(groups, group, _BLOCK + _WIDTH - 1): the samples around each block from a first one on."""
    begin, end = _BLOCK * first, _BLOCK * (first + groups * group)
    around = samples.take(np.arange(begin + 1 - _WIDTH // 2, end + _WIDTH // 2), mode="wrap")
    windows = np.lib.stride_tricks.sliding_window_view(around, _BLOCK + _WIDTH - 1)
    return np.ascontiguousarray(windows[::_BLOCK]).reshape(groups, group, -1)


@lru_cache(maxsize=8)
def _line_factors(first: int, size: int, n: int) -> NDArray[np.float64]:
    """½/φ̂ of the lines, φ̂(θ) = w e^-β sinh(q)/q with q = √(β² - (wθ/2)²)."""
    angle = 2.0 * math.pi / n * np.arange(first, first + size)
    q = np.sqrt(_BETA**2 - (0.5 * _WIDTH * angle) ** 2)
    factors: NDArray[np.float64] = q / (_WIDTH * (np.exp(q - _BETA) - np.exp(-q - _BETA)))
    factors.flags.writeable = False
    return factors


@lru_cache(maxsize=8)
def _block_rows(ratio: int) -> NDArray[np.float64]:
    """(samples, block, ratio, 3): φ, φ', φ'' of a sample at the points of a block."""
    from scipy.special import ive

    points = np.arange(_BLOCK)[:, None] + np.arange(ratio) / ratio
    x = points - np.arange(1 - _WIDTH // 2, _BLOCK + _WIDTH // 2)[:, None, None]
    u = np.clip(2.0 * x / _WIDTH, -1.0, 1.0)
    z = np.maximum(_BETA * np.sqrt(1.0 - u * u), 1e-9)
    scale = np.where(np.abs(x) < 0.5 * _WIDTH, np.exp(z - _BETA), 0.0)  # of I_ν(z)/e^β from `ive`
    turn = 2.0 / _WIDTH * _BETA**2
    slope = -turn * u * ive(1, z) / z
    bend = -turn * 2.0 / _WIDTH * ive(1, z) / z + (turn * u) ** 2 * ive(2, z) / z**2
    rows: NDArray[np.float64] = scale[..., None] * np.stack((ive(0, z), slope, bend), axis=-1)
    return rows
