"""Estimates with standard errors from sums over batches of time.

    θ = g(Σ_i r_i),    s.e.² = (n-1)/n Σ_i (θ_(i) - θ̄)²,    θ_(i) = g(Σ_{j≠i} r_j)        (jackknife)

Whatever is a function of sums (means, variances, spectra, rates, ratios) is estimated by one rule. Batches must be
independent: parts of one record must be much longer than the correlation time of the signal. Parts of one realisation
of a sum of lines are not, however long: over its period the power of every line is fixed, whatever its phase. There
each batch needs a realisation of its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam.statistics.scales import LINEAR, Scale
from fembeam.support import is_finite, numbers, require

MOST = 64  # batches kept; beyond it neighbours are merged, so that memory stays constant


@dataclass(frozen=True, eq=False)
class Estimate:
    """A value with its standard error.

    Attributes
    ----------
    value, standard_error : numbers, or arrays of one shape; the error is NaN with fewer than two batches.
    batches : independent parts behind it.
    without : (batches, ...) values with one part left out each; None when they were not kept.
    scale : on which the estimate scatters like a Gaussian; `interval` is symmetric there.
    parts : names of the parts, such as the seeds of an ensemble; () when they go by their order.

    Examples
    --------
    >>> Estimate.of_mean([1.0, 2.0, 3.0])
    2 ± 0.577
    """

    value: Any
    standard_error: Any
    batches: int
    without: Any = field(default=None, repr=False)
    scale: Scale = field(default=LINEAR, repr=False)
    parts: tuple[str, ...] = field(default=(), repr=False)

    @classmethod
    def of_mean(cls, values: ArrayLike) -> Estimate:
        """The mean of independent values (n, ...) over the first axis; of complex ones s.e.² = Σ|x - x̄|²/((n-1) n)."""
        given = values if np.iscomplexobj(values) else numbers("values", values, "Estimate.of_mean", "give an array")
        samples = np.asarray(given)
        require(samples.ndim > 0, "values must be several", values, "Estimate.of_mean", "give an array (n, …) of them")
        n = len(samples)
        mean = samples.mean(axis=0)
        if n < 2:
            return cls(mean[()], np.full(mean.shape, math.nan)[()], n)
        return cls(mean[()], (samples.std(axis=0, ddof=1) / math.sqrt(n))[()], n, mean + (mean - samples) / (n - 1))

    @classmethod
    def joint(cls, function: Callable[..., Any], *estimates: Estimate) -> Estimate:
        """A function of estimates over the same parts: what these do alike does not count as scatter.

            θ_(i) = g(a_(i), b_(i), …)

        Parameters
        ----------
        function : of the values, such as ``np.divide``.
        estimates : of one response, of responses to the same noise, or of ensembles with the same seeds.

        Raises
        ------
        ValueError : their parts differ, or are below 2: of an ensemble, when values are missing for other seeds.

        Examples
        --------
        >>> a, b = Estimate.of_mean([1.0, 2.0, 4.0]), Estimate.of_mean([2.0, 4.0, 8.1])
        >>> Estimate.joint(np.divide, b, a), round(float(b.value / a.value), 4)  # twice as much, part by part
        (2.01429 ± 0.0124, 2.0143)
        """
        wrong = [one for one in estimates if not isinstance(one, Estimate)]
        require(not wrong, "estimates must be of Estimate", wrong[:1], "Estimate.joint", 'e.g. response["δ"].variance')
        parts = {estimate.batches if estimate.without is not None else 0 for estimate in estimates}
        if len(parts) != 1 or min(parts) < 2:
            raise ValueError(f"estimates must have the same parts, at least 2, got {[e.batches for e in estimates]}")
        named = list({estimate.parts for estimate in estimates if estimate.parts})
        if len(named) > 1:
            odd = sorted(set(named[0]).union(*named) - set(named[0]).intersection(*named))
            lack = f", but some lack {', '.join(odd[:8])}" * bool(odd)
            raise ValueError(f"estimates must have the same parts in one order{lack}; make each of the values that all "
                             "have: Estimate.of_mean(ensemble.values[name][both])")  # fmt: skip
        without = [function(*row) for row in zip(*(estimate.without for estimate in estimates), strict=True)]
        found = _jackknife(function(*(estimate.value for estimate in estimates)), np.array(without))
        return replace(found, parts=next(iter(named), ()))

    @property
    def relative(self) -> float:
        """Largest standard error relative to the value; infinite while there is none."""
        size, error = np.abs(self.value), np.asarray(self.standard_error)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(error == 0.0, 0.0, error / size)
        return float(np.max(np.where(np.isnan(ratio), math.inf, ratio), initial=0.0))

    def interval(self, confidence: float = 0.95) -> tuple[Any, Any]:
        """Bounds of the confidence interval, by Student's t with batches - 1 degrees of freedom.

            g(θ) - b ± t s,    b = (n-1) (mean g(θ_(i)) - g(θ)),    s: jackknife standard error of g(θ)

        Parameters
        ----------
        confidence : in (0, 1).

        Notes
        -----
        g is the `scale` of the estimate and b its bias by the jackknife, so the bounds need not lie alike about the
        value. Where some g(θ_(i)) is not finite, and where they were not kept, g(θ) = θ and b = 0. NaN with fewer than
        two batches.

        References
        ----------
        M.H. Quenouille, Biometrika 43 (1956) 353 (bias).
        """
        if not (is_finite(confidence) and 0.0 < confidence < 1.0):
            raise ValueError(f"confidence must lie between 0 and 1, got {confidence!r}")
        real = not np.iscomplexobj(self.value)
        require(real, "an interval must be of real values", self.value, "Estimate", "take real, imaginary part or size")
        from scipy.special import stdtrit

        reach = float(stdtrit(max(self.batches - 1, 1), 0.5 + confidence / 2))
        plain = self.value - reach * self.standard_error, self.value + reach * self.standard_error
        if self.without is None:
            return plain
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            centre, error = self._scaled()
            bounds = [self.scale.back(centre + sign * reach * error) for sign in (-1.0, 1.0)]
        lo, hi = (np.where(np.isfinite(error), b, p)[()] for b, p in zip(bounds, plain, strict=True))
        return lo, hi

    def if_met(self, met: bool) -> Estimate:
        """Itself where what it counts was met; a run that meets none does not tell how rare it is: then no error."""
        return self if met else replace(self, standard_error=math.nan, without=None)

    def _scaled(self) -> tuple[Any, Any]:
        """The estimate on its scale, its bias taken off, and its standard error there."""
        parts = self.scale.forth(self.without)
        found = _jackknife(self.scale.forth(self.value), parts)
        return self.batches * found.value - (self.batches - 1) * parts.mean(axis=0), found.standard_error

    def __repr__(self) -> str:
        if np.ndim(self.value):
            return f"Estimate(shape {np.shape(self.value)}, {self.batches} batches)"
        return f"{np.asarray(self.value)[()]:.6g} ± {float(self.standard_error):.3g}"


class Batches:
    """Rows of sums, one per batch, at most `MOST`: neighbours are merged when there are more.

    Examples
    --------
    >>> batches = Batches(2)  # of n and Σx
    >>> for x in (1.0, 2.0, 3.0):
    ...     batches.add([1.0, x])
    >>> batches.estimate(lambda sums: sums[1] / sums[0])
    2 ± 0.577
    """

    def __init__(self, size: int) -> None:
        self.rows = np.zeros((MOST, size))
        self.full = 0  # rows that are complete
        self.per_row = 1  # batches summed in a row
        self.open_row = 0  # batches in the row being filled

    def add(self, row: ArrayLike) -> None:
        """Take in the sums of one more batch."""
        self.rows[self.full] += row
        self.open_row += 1
        if self.open_row == self.per_row:
            self.full, self.open_row = self.full + 1, 0
        if self.full == MOST:
            self.rows[: MOST // 2] = self.rows[0::2] + self.rows[1::2]
            self.rows[MOST // 2 :] = 0.0
            self.full, self.per_row = MOST // 2, 2 * self.per_row

    def arrays(self) -> dict[str, NDArray[np.float64]]:
        """All it holds, to be kept in a file."""
        return {"rows": self.rows, "counts": np.array([self.full, self.per_row, self.open_row], dtype=np.float64)}

    def take(self, arrays: Mapping[str, NDArray[np.float64]]) -> None:
        """Go on from `arrays` of another one of the same size."""
        self.rows = np.array(arrays["rows"])
        self.full, self.per_row, self.open_row = (int(count) for count in arrays["counts"])

    @property
    def filled(self) -> NDArray[np.float64]:
        """Rows with something in them, the one under way included."""
        return self.rows[: self.full + (self.open_row > 0)]

    @property
    def total(self) -> NDArray[np.float64]:
        """Sums over everything."""
        return self.filled.sum(axis=0)

    def estimate(self, function: Callable[[NDArray[np.float64]], Any], scale: Scale = LINEAR) -> Estimate:
        """A function of the sums with its jackknife standard error, and the scale its intervals are made on.

        References
        ----------
        B. Efron, C. Stein, Annals of Statistics 9 (1981) 586.
        """
        total, n = self.total, len(self.filled)
        value = function(total)
        if n < 2:
            return Estimate(value, np.full(np.shape(value), math.nan)[()], n)
        return _jackknife(value, np.array([function(total - row) for row in self.filled]), scale)


def _jackknife(value: Any, without: NDArray[np.float64], scale: Scale = LINEAR) -> Estimate:
    """A value with the standard error that follows from those with one part left out."""
    n = len(without)
    spread = np.sqrt((n - 1) / n * (np.abs(without - without.mean(axis=0)) ** 2).sum(axis=0))
    return Estimate(value, spread[()], n, without, scale)
