"""Gaussian noise as a sum of equally spaced lines.

    s(t) = Re Σ_k c_k exp(i k Δω t),        c_k = √(2 S(k Δω) Δω) exp(i φ_k),        period 2π/Δω

S is the one-sided power spectral density per rad/s, so that the variance over one period is Δω Σ S exactly.
The lines are known, hence every derivative is exact: multiply by (i k Δω)^n.
The phases φ_k are drawn from the seed in `noise_lines`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fembeam.excitation.line_spectrum import checked_band, checked_order
from fembeam.excitation.noise_lines import NoiseLines
from fembeam.excitation.psd import Psd, RollOff, Table, checked_table
from fembeam.support import is_finite, is_whole, number

AUTOMATIC_LINES = 4096  # kurtosis 3 - 1.5/4096: itself Gaussian to far below any sampling error
FEWEST_LINES = 8  # below this a sum of cosines is visibly not Gaussian (kurtosis under 2.8)
MOST_LINES = 10**8  # whose amplitudes and phases take 1.6 GB


@dataclass(frozen=True, repr=False)
class BandNoise(NoiseLines):
    """One realisation of Gaussian noise with a flat power spectral density in a band.

        y(t) = √Δω Re Σ_k √(2 S(ω_k)) exp(i φ_k) exp(i ω_k t),    ω_k = k Δω in [lo, hi],    Δω = 2π/period

    Parameters
    ----------
    std : float
        Standard deviation of y, > 0, m of base motion, N of a force; the level S is such that Δω Σ S(ω_k) = std²
        exactly.
    band : (lo, hi)
        Band in rad/s, 0 <= lo < hi; no line lies outside, and none at ω = 0.
    seed : int >= 0 or numpy.random.SeedSequence
        Seed of the phases φ_k, uniform in [0, 2π): the same seed gives the same bits.
    period : float, optional
        Time in s after which the realisation repeats. Left out, it is 4096 * 2π/(hi - lo), that is 4096
        lines, and `for_duration` may take a longer one. The attribute is always a number.
    mean : float
        Constant added to y, 0 unless given; derivatives do not see it.
    psd, order : keyword only
        Density behind `of_psd`, and how many derivatives of y this signal is; use `of_psd` and `derivative`.

    Raises
    ------
    ValueError
        std not positive, band upside down, seed not a whole number, fewer than 8 lines in the band.

    Notes
    -----
    A sum of n lines of equal amplitude has kurtosis 3 - 1.5/n. `std` belongs to y also when this object is
    one of its derivatives; `rms` is that of the signal itself. Another `period` is another realisation.

    Few of the lines drive a mode of little damping. Its response has kurtosis 3 - 1.5/(ζω period), and passes 3 and 4
    standard deviations 2 and 10 % less often than a Gaussian one where ζω period = 100, 10 and 45 % where it is 20: a
    longer period mends it.

    References
    ----------
    van de Wouw et al., Int. J. Non-Linear Mech. 38 (2003) 767, section 4.1, Eqs (9)-(11).

    Examples
    --------
    >>> noise = BandNoise(1e-3, (0.0, 1226.6), seed=1)
    >>> t, y = noise.series()
    >>> bool(abs(y.var() / 1e-6 - 1) < 1e-12)
    True
    """

    std: float | None
    band: tuple[float, float]
    seed: int | np.random.SeedSequence = 0
    period: float | None = None
    mean: float = 0.0
    psd: Psd | Table | None = field(default=None, kw_only=True)
    order: int = field(default=0, kw_only=True)
    # (std, period) where computed and not asked for: dataclasses.replace hands them back as if asked for
    _computed: tuple[float | None, float | None] = field(default=(None, None), kw_only=True, compare=False)

    def __post_init__(self) -> None:
        band = checked_band("BandNoise band", self.band)
        computed_std, computed_period = self._computed
        free = self.period is None or (is_finite(self.period) and self.period == computed_period)
        automatic = AUTOMATIC_LINES * 2 * math.pi / (band[1] - band[0])
        period = automatic if free else number("BandNoise period (s)", self.period, above=0.0)
        self._set(band=band, period=period, seed=_checked_seed(self.seed), order=checked_order(self.order))
        self._set(mean=number("BandNoise mean", self.mean))
        first, last = self._span
        if last - first + 1 < FEWEST_LINES:
            raise ValueError(
                f"BandNoise needs at least {FEWEST_LINES} lines in the band, got {max(0, last - first + 1)} "
                f"in {band} rad/s at a spacing of {self._spacing:.6g} rad/s; make the period longer"
            )
        if last - first > MOST_LINES:
            raise ValueError(f"BandNoise takes at most {MOST_LINES:.0e} lines in the band, got {last - first:.3g} "
                             f"in {band} rad/s; make the period shorter")  # fmt: skip
        if self.psd is None:
            std = number("BandNoise std", self.std, above=0.0)
        elif self.std is None or self.std == computed_std:
            self._set(psd=self.psd if callable(self.psd) else checked_table(self.psd, band))
            std = math.sqrt(self._spacing * float(np.sum(self._density(self.omega))))
            if std == 0:
                raise ValueError(f"psd is zero on every line of the band {band} rad/s; check the units of omega")
        else:
            raise ValueError(f"BandNoise std follows from psd, got std = {self.std!r} as well; scale the psd")
        self._set(std=std, _computed=(None if self.psd is None else std, period if free else None))

    @classmethod
    def of_psd(
        cls,
        psd: Psd | Table,
        band: tuple[float, float],
        seed: int | np.random.SeedSequence = 0,
        period: float | None = None,
        mean: float = 0.0,
    ) -> BandNoise:
        """Gaussian noise of any one-sided power spectral density S(ω) within a band.

            std² = Δω Σ_k S(ω_k)

        Parameters
        ----------
        psd : callable or (omega, S)
            S per rad/s, >= 0: a function of an array of ω in rad/s, or a table of two sequences that
            covers the band, interpolated linearly.
        band, seed, period, mean
            As for `BandNoise`; the automatic period puts 4096 lines in the band.

        Raises
        ------
        ValueError
            S negative, not finite or zero everywhere, a table that is unsorted or does not cover the band.

        Examples
        --------
        >>> coloured = BandNoise.of_psd(lambda w: 1e-9 / (1 + (w / 300) ** 2), (0.0, 1226.6), seed=1)
        >>> float(round(coloured.std**2 / (1e-9 * 300 * np.arctan(1226.6 / 300)), 3))
        1.0
        """
        if psd is None:
            raise ValueError("psd must be a function of omega or a table (omega, S), got None")
        return cls(None, band, seed, period, mean=mean, psd=psd)

    @classmethod
    def rolled_off(
        cls,
        std: float,
        band: tuple[float, float],
        corner: float,
        seed: int | np.random.SeedSequence = 0,
        period: float | None = None,
    ) -> BandNoise:
        """Flat noise in a band as an actuator passes it on that is a first-order low-pass filter.

            S(ω) ∝ 1/(1 + (ω/corner)²) within the band,    ∫ S dω = std²

        Parameters
        ----------
        std, band, seed, period
            As for `BandNoise`; `std` is that of what leaves the filter.
        corner : float
            rad/s, > 0: where half of the power is left.

        References
        ----------
        van de Wouw et al., Int. J. Non-Linear Mech. 38 (2003) 767, section 7: their hydraulic actuator.

        Examples
        --------
        >>> noise = BandNoise.rolled_off(1e-3, (0.0, 1226.6), corner=300.0, seed=1)
        >>> round(float(noise.psd_at(300.0) / noise.psd_at(0.0)), 12)
        0.5
        """
        lo, hi = checked_band("BandNoise band", band)
        shape = RollOff(1.0, number("BandNoise corner (rad/s)", corner, above=0.0))
        level = number("BandNoise std", std, above=0.0) ** 2 / shape.power(lo, hi)
        return cls.of_psd(RollOff(level, shape.corner), (lo, hi), seed, period)

    def __repr__(self) -> str:
        shape = repr(self.psd) if isinstance(self.psd, RollOff) else "…"
        head = f"BandNoise(std={self.std!r}" if self.psd is None else f"BandNoise.of_psd(psd={shape}"
        mean = f", mean={self.mean!r}" if self.mean else ""
        tail = f".derivative({self.order})" if self.order else ""
        return f"{head}, band={self.band!r}, seed={self.seed!r}, period={self.period!r}{mean}){tail}"

    def __getstate__(self) -> dict[str, Any]:
        """The fields without the lines: those come back from the seed, and a pickle stays small."""
        return {name: value for name, value in self.__dict__.items() if name != "_lines"}

    def _set(self, **values: Any) -> None:
        """Set checked fields of the frozen object while it is being made."""
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @property
    def period_was_given(self) -> bool:
        """Whether the period was asked for; otherwise `for_duration` may take a longer one."""
        return self._computed[1] is None

    def derivative(self, order: int) -> BandNoise:
        """The signal d^order s/dt^order: the same lines times (i ω)^order."""
        return replace(self, order=self.order + checked_order(order))

    def for_duration(self, duration: float) -> BandNoise:
        """A signal that does not repeat within `duration` (s).

        It is this one when its period is long enough. When the period was left out it is another realisation,
        with period = duration; a period that was asked for and is too short is an error.
        """
        duration = number("duration (s)", duration, least=0.0)
        if not self.period_was_given and duration > (self.period or 0.0):
            return replace(self, period=duration)
        self._check_lasts(duration)
        return self


def _checked_seed(seed: Any) -> int | np.random.SeedSequence:
    """A seed that gives the same bits every time, or a clear error."""
    if isinstance(seed, np.random.SeedSequence):
        return seed
    if not is_whole(seed) or seed < 0:
        raise ValueError(f"BandNoise seed must be an integer of at least 0 or a SeedSequence, got {seed!r}")
    return int(seed)
