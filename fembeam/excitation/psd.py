"""Target power spectral densities of noise: functions, tables, an actuator's roll-off; one-sided, per rad/s."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam.excitation.line_spectrum import keep_number

Table = tuple[Sequence[float], Sequence[float]]
Psd = Callable[[NDArray[np.float64]], ArrayLike]


@dataclass(frozen=True)
class RollOff:
    """A flat density behind a first-order low-pass filter: S(ω) = level/(1 + (ω/corner)²).

    Parameters
    ----------
    level : density at ω = 0, units² per rad/s, ≥ 0.
    corner : rad/s, > 0, where half of the density is left.

    Raises
    ------
    ValueError : a number that is not finite or out of range.

    Examples
    --------
    >>> float(RollOff(1e-9, corner=300.0)(300.0))
    5e-10
    """

    level: float
    corner: float

    def __post_init__(self) -> None:
        keep_number(self, "level", least=0.0)
        keep_number(self, "corner", "rad/s", above=0.0)

    def __call__(self, omega: NDArray[np.float64]) -> NDArray[np.float64]:
        """S at omega (rad/s)."""
        return self.level / (1 + (omega / self.corner) ** 2)

    def power(self, lo: float, hi: float) -> float:
        """∫ S dω from lo to hi (rad/s): the variance of the band."""
        return self.level * self.corner * float(np.arctan(hi / self.corner) - np.arctan(lo / self.corner))


def evaluated(psd: Psd | Table, omega: NDArray[np.float64]) -> NDArray[np.float64]:
    """The density at frequencies that a table covers, checked."""
    raw = psd(omega) if callable(psd) else np.interp(omega, *psd)
    density = np.asarray(raw, dtype=np.float64)
    if density.shape not in ((), omega.shape):
        raise ValueError(f"psd must return one value per omega, got shape {density.shape} for {omega.shape}")
    return checked_density(omega, np.broadcast_to(density, omega.shape))


def checked_density(omega: NDArray[np.float64], density: NDArray[np.float64]) -> NDArray[np.float64]:
    """The density, or an error that names its first bad value."""
    bad = ~(np.isfinite(density) & (density >= 0))
    if bad.any():
        i = int(np.argmax(bad))
        raise ValueError(f"psd must be finite and at least 0, got {density[i]} at omega = {omega[i]:.6g} rad/s")
    return density


def checked_table(psd: Any, band: tuple[float, float]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """The table as tuples that nobody can change, or a clear error."""
    try:
        omega, density = (np.asarray(column, dtype=np.float64) for column in psd)
    except (TypeError, ValueError):
        raise ValueError(f"psd must be a function of omega or a table (omega, S), got {type(psd).__name__}") from None
    if omega.ndim != 1 or omega.shape != density.shape or omega.size < 2:
        raise ValueError(f"psd table needs two columns of equal length >= 2, got {omega.shape} and {density.shape}")
    if not (np.all(np.isfinite(omega)) and np.all(np.diff(omega) > 0)):
        raise ValueError("psd table must have finite and strictly increasing omega; sort it")
    if not (omega[0] <= band[0] and band[1] <= omega[-1]):
        raise ValueError(f"psd table spans [{omega[0]:g}, {omega[-1]:g}] rad/s and must cover the band {band}")
    checked_density(omega, density)
    return tuple(omega.tolist()), tuple(density.tolist())
