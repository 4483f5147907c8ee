"""Dry friction behind springs: sliders that stick until their limit and slip until the rate returns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from contacts.law import Law, number

PART = 6  # numbers per slider (k, f, f_s, c, code, s); as in the kernels


class Sliders(Law):
    """What laws of N sliders beside a spring share; see `contacts.memory.friction_kernels`."""

    home: ClassVar[str] = "contacts.memory.friction_kernels"
    compiled: ClassVar[str] = "sliders"
    one_sided: ClassVar[bool] = False  # type: ignore[misc]
    events: ClassVar[tuple[str, ...]] = ("stick", "slip")  # type: ignore[misc]

    @property
    def spring(self) -> float:
        """Stiffness of the spring beside the sliders, N/m."""
        return 0.0

    @property
    def sliders(self) -> tuple[tuple[float, float, float, float], ...]:
        """Stiffness, kinetic limit, static limit and damping of each."""
        raise NotImplementedError

    @property
    def borders(self) -> int:  # type: ignore[override]
        """One per slider."""
        return len(self.sliders)

    @property
    def memory(self) -> tuple[int, ...]:  # type: ignore[override]
        """Code and place of every slider."""
        return tuple(2 + PART * j + place for j in range(self.borders) for place in (4, 5))

    @property
    def parameters(self) -> NDArray[np.float64]:
        """(N, k_0, then per slider: k, f, f_s, c, code, s), all sticking at 0."""
        return np.array([self.borders, self.spring, *(x for part in self.sliders for x in (*part, 0.0, 0.0))])

    def stored(self, delta: float, parameters: NDArray[np.float64]) -> float:
        """Energy of the springs, F²/2k each, J."""
        k, f, _, _, code, s = parameters[2:].reshape(-1, PART).T
        force = np.where(code == 0.0, k * (delta - s), f)
        return float(0.5 * parameters[1] * delta**2 + np.sum(0.5 * force**2 / k))


@dataclass(frozen=True)
class Jenkins(Sliders):
    """Spring and slider in series: elastic up to a limit, F = k (δ - s), then slip at F = ±f.

    A slider that slips sticks again where δ̇ = 0, with s = δ ∓ f/k. Always active, at both signs of δ.

    Parameters
    ----------
    stiffness : k > 0, N/m, of the spring.
    limit : f > 0, N, at which the slider slips.

    Notes
    -----
    The element of G.M. Jenkins, Proc. R. Soc. A 265 (1962) 422-435: elastic, perfectly plastic. A cycle of amplitude
    X > f/k loses 4 f (X - f/k), a smaller one nothing. Rigid Coulomb friction is the limit k → ∞, see `Coulomb`.

    Examples
    --------
    >>> Jenkins(2e4, 10.0).force([-2e-4, 4e-4]).tolist()
    [-4.0, 8.0]
    """

    stiffness: float
    limit: float

    kinds: ClassVar[dict[str, str]] = {"jenkins": ""}
    equation: ClassVar[str] = "F = stiffness (δ - s) while |F| < limit, else ±limit until δ̇ = 0"
    units: ClassVar[dict[str, str]] = {"stiffness": "N/m", "limit": "N"}

    def __post_init__(self) -> None:
        number(self, "stiffness", strict=True)
        number(self, "limit", strict=True)

    @property
    def sliders(self) -> tuple[tuple[float, float, float, float], ...]:
        """The only one."""
        return ((self.stiffness, self.limit, self.limit, 0.0),)
