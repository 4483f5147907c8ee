"""Where the transient of a signal ends.

The truncation that leaves the mean of the rest best known: over batch means z_j, the d that minimises

    Σ_{j>=d} (z_j - z̄_d)²/(n - d)²

of x and x², the larger of the two; then the first and the last part of what is left must agree.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam.statistics.densities import checked_samples
from fembeam.support import number

FEWEST_BATCHES = 32
AGREEMENT = 4.0  # standard errors between the halves
PARTS = 16


@dataclass(frozen=True)
class Settling:
    """The end of a transient.

    Attributes
    ----------
    time : s from the first sample to leave out.
    drift : difference of the two halves of the rest, in standard errors, the larger of mean and mean square.
    died_out : whether the cut lies in the first half and the halves agree within 4 standard errors.
    """

    time: float
    drift: float
    died_out: bool


def settling(x: ArrayLike, dt: float, memory: float) -> Settling:
    """Find the end of the initial transient of a signal.

    Parameters
    ----------
    x : (k,) samples, spanning at least 32 correlation times.
    dt : sampling step, s.
    memory : correlation time of the linear structure, 1/min(ζω), s; the length of a batch.

    References
    ----------
    K.P. White, Simulation 69 (1997) 323 (the truncation); J. Geweke, in Bayesian Statistics 4 (1992) 169 (the check).

    Examples
    --------
    >>> t = 0.01 * np.arange(60_000)
    >>> noise = np.random.default_rng(1).standard_normal(t.size)
    >>> found = settling(noise + 9.0 * np.exp(-t / 10.0), dt=0.01, memory=1.0)
    >>> found.died_out, 20.0 < found.time < 80.0
    (True, True)
    """
    samples = checked_samples("settling", x, fewest=FEWEST_BATCHES)
    step = number("settling: dt (s)", dt, above=0.0)
    length = max(1, round(number("settling: memory (s)", memory, above=0.0) / step))
    count = samples.size // length
    if count < FEWEST_BATCHES:
        raise ValueError(
            f"settling needs {FEWEST_BATCHES} batches of {memory:g} s, got {samples.size * step:g} s; simulate longer"
        )
    parts = samples[: count * length].reshape(count, length)
    parts = parts - parts[count // 2 :].mean()  # of what is left in any case: a large start would hide the rest
    means = [parts.mean(axis=1), (parts**2).mean(axis=1)]
    cut = max(_truncation(z) for z in means)
    drift = max(_drift(z[cut:]) for z in means)
    return Settling(cut * length * step, drift, cut < count // 2 and drift < AGREEMENT)


def _truncation(z: NDArray[np.float64]) -> int:
    """Batches to leave out, at most half of them."""
    left = len(z) - np.arange(len(z) // 2 + 1)
    centred = z[::-1] - z[len(z) // 2 :].mean()
    first, second = (np.cumsum(centred**k)[::-1][: left.size] / left for k in (1, 2))
    return int(np.argmin((second - first**2) / left))


def _drift(z: NDArray[np.float64]) -> float:
    """Difference of the halves' means in standard errors.

    Those come from the differences of neighbours among sixteen parts, which a trend hardly widens (von Neumann).
    """
    parts = np.array([part.mean() for part in np.array_split(z, PARTS)])
    error = math.sqrt(2.0 / PARTS * float(np.mean(np.diff(parts) ** 2)))
    difference = abs(float(parts[: PARTS // 2].mean() - parts[PARTS // 2 :].mean()))
    return difference / error if error > 0.0 else 0.0
