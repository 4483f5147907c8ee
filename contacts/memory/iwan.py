"""Many sliders in parallel: partial slip, and any concave first loading."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from contacts.memory.friction import Slider, Sliders
from contacts.numbers import LARGEST_PARAMETER, check_number, finite_row, reals

MOST_PARTS = 10_000


@dataclass(frozen=True)
class Iwan(Sliders):
    """N `Jenkins` elements in parallel, F = Σ F_j: yields little by little, as a bolted joint does.

    Its first loading is concave with a bend at every δ = f_j/k_j. Each branch after a reversal is the first loading,
    twice as large (Masing), and a loop that closes is forgotten (return-point memory).

    Parameters
    ----------
    stiffness : (N,) k_j > 0, N/m.
    limits : (N,) f_j > 0, N; ``inf`` for a spring that never slips.

    Notes
    -----
    W.D. Iwan, J. Appl. Mech. 33 (1966) 893-900; G. Masing, Proc. 2nd Int. Congr. Appl. Mech. (1926) 332-335. A cycle of
    amplitude X loses Σ 4 f_j (X - f_j/k_j) over the elements that slip.

    Examples
    --------
    >>> Iwan([2e4, 1e4], [10.0, 20.0]).along([1e-3, 3e-3, 1e-3]).tolist()
    [20.0, 30.0, -10.0]
    """

    stiffness: Sequence[float]
    limits: Sequence[float]

    kinds: ClassVar[dict[str, str]] = {"iwan": "", "iwan_uniform": "uniform", "iwan_backbone": "from_backbone"}
    equation: ClassVar[str] = (
        "F = Σ F_j, each stiffness[j] (δ - s_j) while |F_j| < limits[j], else ±limits[j] until δ̇ = 0"
    )
    units: ClassVar[dict[str, str]] = {"stiffness": "N/m", "limits": "N"}

    def __post_init__(self) -> None:
        stiffness, limits = (
            np.atleast_1d(reals(getattr(self, name), f"{name} of Iwan")) for name in ("stiffness", "limits")
        )
        if stiffness.ndim != 1 or stiffness.shape != limits.shape or not stiffness.size:
            raise ValueError(
                f"limits of Iwan must be as many as stiffness, in a row, got shapes {limits.shape} and "
                f"{stiffness.shape}; one per element"
            )
        sizes = np.concatenate((stiffness, limits[limits != math.inf]))
        if not np.all((sizes >= 1.0 / LARGEST_PARAMETER) & (sizes <= LARGEST_PARAMETER)):
            raise ValueError(
                f"stiffness and limits of Iwan must be > 0, from {1.0 / LARGEST_PARAMETER:g} to "
                f"{LARGEST_PARAMETER:g}, stiffness finite, got {self.stiffness!r}, {self.limits!r}"
            )
        if np.all(limits == math.inf):
            raise ValueError("limits of Iwan must hold a finite one: without, it is a spring (Polynomial([k]))")
        object.__setattr__(self, "stiffness", tuple(stiffness.tolist()))
        object.__setattr__(self, "limits", tuple(limits.tolist()))

    @classmethod
    def uniform(cls, stiffness: float, limit: float, parts: int) -> Iwan:
        """Elements of equal stiffness whose limits are spread evenly from 0: f_j = (2j - 1) f/N², k_j = k/N.

        Parameters
        ----------
        stiffness : k > 0, N/m, of all elements while they stick.
        limit : f > 0, N, of all together: once all slip, at δ = (2 - 1/N) f/k.
        parts : N, 1 to 10000. As it grows the first loading tends to the parabola F = k δ (1 - k δ/4f), with an error
            of f/4N² at most.
        """
        k = check_number(stiffness, "stiffness of Iwan.uniform", strict=True)
        f = check_number(limit, "limit of Iwan.uniform", strict=True)
        if not isinstance(parts, (int, np.integer)) or isinstance(parts, bool) or not 1 <= parts <= MOST_PARTS:
            raise ValueError(f"parts of Iwan.uniform must be a whole number from 1 to {MOST_PARTS}, got {parts!r}")
        N = int(parts)
        return cls([k / N] * N, [f * (2 * j - 1) / N**2 for j in range(1, N + 1)])

    @classmethod
    def from_backbone(cls, delta: Sequence[float], force: Sequence[float], slope: float = 0.0) -> Iwan:
        """The elements whose first loading passes straight through given points.

        Parameters
        ----------
        delta, force : (m,) m and N, ascending from (0, 0), which need not be given; slopes must not rise. Points on
            the line of their neighbours add nothing.
        slope : N/m, >= 0, beyond the last point.
        """
        d, f = (
            finite_row(value, f"{name} of Iwan.from_backbone", LARGEST_PARAMETER, 1.0 / LARGEST_PARAMETER)
            for name, value in (("delta", delta), ("force", force))
        )
        last = check_number(slope, "slope of Iwan.from_backbone")
        if d.size != f.size:
            raise ValueError(f"force of Iwan.from_backbone must be as many as delta, {d.size}, got {f.size}")
        if not d.size or d[0] != 0.0:
            d, f = np.append(0.0, d), np.append(0.0, f)
        if f[0] != 0.0 or d.size < 2 or np.any(np.diff(d) <= 0.0):
            raise ValueError(
                f"delta and force of Iwan.from_backbone must be finite, delta ascending from (0, 0), got {delta!r}, "
                f"{force!r}"
            )
        slopes = np.append(np.diff(f) / np.diff(d), last)
        steps = -np.diff(slopes)
        steps[np.abs(steps) <= 1e-9 * slopes[0]] = 0.0  # on one line, to rounding
        if np.any(steps < 0.0):
            where = int(np.argmin(steps)) + 1
            raise ValueError(
                f"slope of Iwan.from_backbone must not rise, got {slopes[where - 1]:g} N/m before δ = {d[where]:g} m "
                f"and {slopes[where]:g} N/m after; sliders only soften"
            )
        bends = np.flatnonzero(steps > 0.0)
        stiffness, limits = steps[bends].tolist(), (steps[bends] * d[1:][bends]).tolist()
        return cls([*stiffness, last], [*limits, math.inf]) if last > 0.0 else cls(stiffness, limits)

    @property
    def spring(self) -> float:
        """Stiffness of the elements that never slip."""
        return sum(k for k, f in zip(self.stiffness, self.limits, strict=True) if f == math.inf)

    @property
    def sliders(self) -> tuple[Slider, ...]:
        """The elements that slip."""
        return tuple((k, f, f, 0.0) for k, f in zip(self.stiffness, self.limits, strict=True) if f < math.inf)
