"""Springs with a dashpot beside them: Kelvin–Voigt, and the Hertzian ones of Tsuji and Jankowski.

All are F = K δ^p + c δ^((p-1)/2) δ̇. With w = δ^((p+1)/2) √(2K/((p+1) m)) a free mass obeys v dv/dw = -w - 2βv, a linear
oscillator of damping ratio

    β = c / √(2 (p+1) K m),

so the restitution depends on the mass but not on the speed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from contacts.law import Law
from contacts.numbers import LARGEST_EXPONENT, LARGEST_OF_POWERS, check_number, check_restitution, number, switch
from contacts.power_laws import power_parameters
from contacts.restitution import LARGEST_THROW

PULLS = "pulls at the end of every rebound, where the dashpot outweighs the spring; clamp=True forbids it"
CLAMPED = "clamp=True: the kink where the force is cut moves with the rate"


def damping_ratio_for(restitution: float) -> float:
    """Damping ratio β of a linear oscillator that leaves after half a period at e = exp(-πβ/√(1-β²))."""
    decay = abs(math.log(restitution))
    return decay / math.hypot(math.pi, decay)


def rebound(ratio: float, *, clamp: bool = False, approach: bool = False) -> float:
    """Restitution of v dv/dw = -w - 2βv: to w = 0, to the end of compression (clamp), or damped on the way in only."""
    if approach or clamp:  # the force vanishes at twice the phase of the turning point
        return math.exp(-_decay_to_turn(ratio) * (1.0 if approach else 2.0))
    return math.exp(-ratio * math.pi / math.sqrt((1.0 - ratio) * (1.0 + ratio))) if ratio < 1.0 else 0.0


def _decay_to_turn(ratio: float) -> float:
    """Phase of the oscillation at the turning point, times β/√|1 - β²|."""
    if ratio == 1.0:
        return 1.0
    if ratio > 1.0:
        return ratio * math.acosh(ratio) / (math.sqrt(ratio - 1.0) * math.sqrt(ratio + 1.0))
    root = math.sqrt((1.0 - ratio) * (1.0 + ratio))
    return ratio * math.atan2(root, ratio) / root


def _root(mass: Any, who: str) -> float:
    """Square root of a mass that is checked; apart from that of a stiffness, whose product may be beyond the floats."""
    return math.sqrt(check_number(mass, f"mass of {who}", strict=True, most=LARGEST_THROW))


@dataclass(frozen=True)
class KelvinVoigt(Law):
    """Spring and dashpot, F = k δ + c δ̇ while δ > 0: jumps at entry and may pull before exit.

    Parameters
    ----------
    stiffness : k > 0, N/m.
    damping : c >= 0, N s/m.
    clamp : cut the force at zero, so that the stop never pulls.

    Examples
    --------
    >>> float(KelvinVoigt(1e6, 100.0).force(1e-3, 0.5))
    1050.0
    """

    stiffness: float
    damping: float
    clamp: bool = False
    nominal: tuple[str, float] | None = field(default=None, init=False, compare=False, repr=False)

    compiled: ClassVar[str] = "power"
    kinds: ClassVar[dict[str, str]] = {"kelvin_voigt": "", "anagnostopoulos": "anagnostopoulos"}
    equation: ClassVar[str] = "F = stiffness δ + damping δ̇"
    units: ClassVar[dict[str, str]] = {"stiffness": "N/m", "damping": "N s/m"}

    def __post_init__(self) -> None:
        number(self, "stiffness", strict=True)
        number(self, "damping")
        switch(self, "clamp")

    @classmethod
    def anagnostopoulos(cls, stiffness: float, restitution: float, mass: float, **options: Any) -> KelvinVoigt:
        """Damping with which ``mass`` (kg; m₁m₂/(m₁+m₂) for two) leaves δ = 0 at ``restitution`` in (0, 1], exactly.

        c = 2β√(k m), β = -ln e/√(π² + ln² e): S.A. Anagnostopoulos, Earthq. Eng. Struct. Dyn. 16 (1988) 443. Valid
        for the pulling law; with ``clamp=True`` the mass leaves faster than asked.
        """
        e = check_restitution(restitution, "anagnostopoulos", True, "an overdamped mass never leaves")
        law = cls(stiffness, 0.0, **options)
        law = replace(
            law, damping=2.0 * damping_ratio_for(e) * math.sqrt(law.stiffness) * _root(mass, "anagnostopoulos")
        )
        object.__setattr__(law, "nominal", ("anagnostopoulos", e))
        return law

    @property
    def one_sided(self) -> bool:  # type: ignore[override]
        """A cut is made for one side."""
        return self.clamp

    @property
    def jump(self) -> bool:  # type: ignore[override]
        """The dashpot's force appears at once."""
        return self.damping > 0.0

    @property
    def parameters(self) -> NDArray[np.float64]:
        """Those of the power family."""
        return power_parameters(self.stiffness, 1.0, c=self.damping, clamp=self.clamp)

    @property
    def remarks(self) -> tuple[str, ...]:  # type: ignore[override]
        """What a user should know."""
        if not self.damping:
            return ("never pulls; smooth",)
        return CLAMPED if self.clamp else PULLS, "jumps by damping × entry rate when contact begins"

    def exact_restitution(self, entry_rate: float, mass: float) -> float:
        """Of the damped half wave, or, with clamp, up to the zero of its force."""
        return rebound(self.damping / (2.0 * math.sqrt(self.stiffness) * math.sqrt(mass)), clamp=self.clamp)


@dataclass(frozen=True)
class Viscoelastic(Law):
    """Power law with a dashpot that stiffens alike, F = K δ^p + c δ^((p-1)/2) δ̇: no jump at entry.

    Parameters
    ----------
    stiffness : K > 0, N/m^p.
    damping : c >= 0, N s/m^((p+1)/2).
    exponent : 1 < p <= 100; 1.5 for spheres (`KelvinVoigt` is p = 1).
    clamp : cut the force at zero, so that the stop never pulls.
    approach_only : damp only while δ̇ > 0.

    Notes
    -----
    The restitution of a free mass is exact, and independent of its speed: in √(2K/((p+1) m)) δ^((p+1)/2) the mass is
    a linear oscillator of damping ratio c/√(2 (p+1) K m).

    Examples
    --------
    >>> tsuji = Viscoelastic.tsuji(2.1e8, restitution=0.6, mass=0.03)
    >>> round(tsuji.exact_restitution(entry_rate=0.2, mass=0.03), 12)
    0.6
    """

    stiffness: float
    damping: float
    exponent: float = 1.5
    clamp: bool = False
    approach_only: bool = False
    nominal: tuple[str, float] | None = field(default=None, init=False, compare=False, repr=False)

    compiled: ClassVar[str] = "power"
    kinds: ClassVar[dict[str, str]] = {"viscoelastic": "", "tsuji": "tsuji", "jankowski": "jankowski"}
    equation: ClassVar[str] = "F = stiffness δ^p + damping δ^((p-1)/2) δ̇, p = exponent"
    units: ClassVar[dict[str, str]] = {"stiffness": "N/m^p", "damping": "N s/m^((p+1)/2)"}

    def __post_init__(self) -> None:
        number(self, "stiffness", strict=True, most=LARGEST_OF_POWERS)
        number(self, "damping", most=LARGEST_OF_POWERS)
        number(self, "exponent", 1.0, strict=True, most=LARGEST_EXPONENT)
        switch(self, "clamp")
        switch(self, "approach_only")

    @classmethod
    def tsuji(cls, stiffness: float, restitution: float, mass: float, **options: Any) -> Viscoelastic:
        """Damping with which ``mass`` (kg) leaves at ``restitution`` in (0, 1], exactly (for the pulling law).

        c = α√(K m), α = √(2(p+1)) β with the damping ratio β = -ln e/√(π² + ln² e); Y. Tsuji, T. Tanaka, T. Ishida,
        Powder Technol. 71 (1992) 239, give α(e) as a curve, D. Antypov, J.A. Elliott, EPL 94 (2011) 50004, as formula.
        """
        e = check_restitution(restitution, "tsuji", True, "an overdamped mass never leaves")
        return cls._damped(stiffness, damping_ratio_for(e), mass, ("tsuji", e), options)

    @classmethod
    def jankowski(cls, stiffness: float, restitution: float, mass: float, **options: Any) -> Viscoelastic:
        """Damping on approach only: c = 2ξ√(K m), ξ = (9√5/2)(1 - e²)/(e (e (9π - 16) + 16)).

        For e in (0, 1]; R. Jankowski, Earthq. Eng. Struct. Dyn. 34 (2005) 595 and 35 (2006) 517. The formula
        approximates: e = 0.5 achieves 0.495.
        """
        e = check_restitution(restitution, "jankowski", True, "the published damping ratio is infinite at 0")
        ratio = 4.5 * math.sqrt(5.0) * (1.0 - e**2) / (e * (e * (9.0 * math.pi - 16.0) + 16.0))
        options = {"approach_only": True, **options}
        return cls._damped(stiffness, 2.0 * ratio / math.sqrt(5.0), mass, ("jankowski", e), options)

    @classmethod
    def _damped(
        cls, stiffness: float, ratio: float, mass: float, nominal: tuple[str, float], options: dict[str, Any]
    ) -> Viscoelastic:
        """The law of a damping ratio β."""
        law = cls(stiffness, 0.0, **options)
        root = math.sqrt(2.0 * (law.exponent + 1.0)) * math.sqrt(law.stiffness) * _root(mass, nominal[0])
        law = replace(law, damping=ratio * root)
        object.__setattr__(law, "nominal", nominal)
        return law

    @property
    def parameters(self) -> NDArray[np.float64]:
        """Those of the power family."""
        r = 0.5 * (self.exponent - 1.0)
        return power_parameters(self.stiffness, self.exponent, 0.0, self.damping, r, self.clamp, self.approach_only)

    @property
    def remarks(self) -> tuple[str, ...]:  # type: ignore[override]
        """What a user should know."""
        if not self.damping:
            return ("never pulls; smooth",)
        singular = "at δ = 0 its slope is infinite: most methods work at lower order at entry and exit"
        if self.approach_only:
            return "never pulls", singular, "has a kink where δ̇ = 0"
        return CLAMPED if self.clamp else PULLS, singular

    @property
    def powers(self) -> tuple[float, ...]:
        """Of the spring, and of the dashpot."""
        p = self.exponent
        return (0.5 * (p - 1.0), p) if self.damping else (p,)

    @property
    def bend(self) -> str | None:
        """Damping on approach only ends where δ̇ = 0; such a law never pulls."""
        return ("rate" if self.damping else None) if self.approach_only else super().bend

    def exact_restitution(self, entry_rate: float, mass: float) -> float:
        """By the equivalent linear oscillator; see the module."""
        root = math.sqrt(2.0 * (self.exponent + 1.0)) * math.sqrt(self.stiffness) * math.sqrt(mass)
        return rebound(self.damping / root, clamp=self.clamp, approach=self.approach_only)
