"""A yielding stop: it loads along one line and unloads along a steeper one."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from contacts.law import Law
from contacts.numbers import number
from contacts.restitution import checked_throw


@dataclass(frozen=True)
class WaltonBraun(Law):
    """Yielding stop: first loading F = k₁ δ, unloading and reloading F = k₂ (δ - δ₀) up to the largest force so far.

    From its largest force F_p it unloads to the set δ₀ = F_p (1/k₁ - 1/k₂), where it opens; it never pulls.

    Parameters
    ----------
    loading : k₁ > 0, N/m.
    unloading : k₂ >= k₁, N/m.
    set : "kept": the next contact begins at δ₀ and loads along k₂, a body that stays dented; "forgotten": once δ has
        been below zero it begins at 0 along k₁, a fresh place at every blow.

    Notes
    -----
    O.R. Walton, R.L. Braun, J. Rheology 30 (1986) 949-980. A free mass at first contact leaves with the restitution
    √(k₁/k₂) whatever its speed and mass, and the set δ̇ √(m/k₁) (1 - k₁/k₂). With the set kept, blows that do not
    exceed F_p are elastic. Force continuous.

    Examples
    --------
    >>> stop = WaltonBraun(1e5, 4e5)
    >>> stop.along([1e-3, 8e-4, 0.0, 8e-4, 1e-3, 2e-3]).round(9).tolist()
    [100.0, 20.0, 0.0, 20.0, 100.0, 200.0]
    >>> float(stop.exact_restitution(entry_rate=0.2, mass=0.03))
    0.5
    """

    loading: float
    unloading: float
    set: Literal["kept", "forgotten"] = "kept"

    home: ClassVar[str] = "contacts.memory.walton_braun_kernels"
    compiled: ClassVar[str] = "walton_braun"
    kinds: ClassVar[dict[str, str]] = {"walton_braun": ""}
    equation: ClassVar[str] = "F = loading δ at first, unloading (δ - δ₀) below the largest force so far, never < 0"
    units: ClassVar[dict[str, str]] = {"loading": "N/m", "unloading": "N/m"}
    memory: ClassVar[tuple[int, ...]] = (3, 4)  # type: ignore[misc]
    borders: ClassVar[int] = 2  # type: ignore[misc]
    segment_codes: ClassVar[tuple[tuple[float, ...], ...]] = ((0.0, 1.0, 2.0), ())  # type: ignore[misc]
    opens: ClassVar[bool] = True  # type: ignore[misc]

    def __post_init__(self) -> None:
        number(self, "loading", strict=True)
        number(self, "unloading", self.loading)
        if self.set not in ("kept", "forgotten"):
            raise ValueError(f'set of WaltonBraun must be "kept" or "forgotten", got {self.set!r}')

    @property
    def events(self) -> tuple[str, ...]:  # type: ignore[override]
        """Forgetting only where it does."""
        forgets = ("forget",) if self.set == "forgotten" else ()
        return ("contact", "unload", "reload", "open", *forgets)

    @property
    def parameters(self) -> NDArray[np.float64]:
        """(k₁, k₂, whether the set is kept, code, F_p)."""
        return np.array([self.loading, self.unloading, float(self.set == "kept"), 0.0, 0.0])

    @property
    def remarks(self) -> tuple[str, ...]:  # type: ignore[override]
        """What a user should know."""
        return ("never pulls; force continuous",)

    def stored(self, delta: float, parameters: NDArray[np.float64]) -> float:
        """Energy F²/2k₂ that unloading gives back, J."""
        force = float(self.batch(1.0, parameters)(np.array([delta]), np.zeros(1))[0])
        return 0.5 * force**2 / self.unloading

    def permanent_set(self, entry_rate: float, mass: float) -> float:
        """Set in m that a free mass leaves at its first blow, δ̇ √(m/k₁) (1 - k₁/k₂)."""
        speed, kg = checked_throw(self, entry_rate, mass)
        share = (self.unloading - self.loading) / self.unloading
        return speed * math.sqrt(kg) / math.sqrt(self.loading) * share

    def exact_restitution(self, entry_rate: float, mass: float) -> float:
        """Of the first blow, √(k₁/k₂)."""
        return math.sqrt(self.loading / self.unloading)

    def describe(self, entry_rate: float = 1.0, mass: float = 1.0) -> str:
        """Also the set that this blow leaves."""
        left = f"  set: {self.permanent_set(entry_rate, mass):.6g} m after this blow, the first; then {self.set}"
        return f"{super().describe(entry_rate, mass)}\n{left}"
