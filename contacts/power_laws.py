"""Power laws: elastic Hertz, and Hertz with hysteresis by any of the published damping factors.

The factor a of F = K δ^p (1 + a δ̇/δ̇⁻) is published as a formula of a nominal restitution e; what a free mass achieves
is another value, the root r of a (1 + r) = ln[(1 + a)/(1 - a r)], whatever K, p, mass and speed:

    nominal e                                         0.1     0.3     0.5     0.7     0.9
    lankarani_nikravesh   3(1 - e²)/4                0.6653  0.6842  0.7252  0.7960  0.9132
    hunt_crossley         3(1 - e)/2                 0.5158  0.5813  0.6630  0.7680  0.9090
    herbert_mcwhannell    6(1 - e)/((2e - 1)² + 3)   0.4907  0.5200  0.5936  0.7227  0.9009
    lee_wang              3(1 - e)/4                 0.6867  0.7390  0.7992  0.8693  0.9524
    gonthier              (1 - e²)/e                 0.1010  0.3042  0.4877  0.6696  0.8764
    zhiying_qishao        3(1 - e²)exp(2(1 - e))/4   0.2175  0.3267  0.4826  0.6796  0.8959
    flores                8(1 - e)/(5e)              0.0694  0.2562  0.4704  0.6832  0.8939
    hu_guo                3(1 - e)/(2e)              0.0741  0.2707  0.4877  0.6973  0.8999
    carvalho_martins      3(1 - e)(11 - e)/(2 + 18e) 0.1289  0.3040  0.5002  0.7000  0.9000
    zhang_sharf           the root itself            0.1000  0.3000  0.5000  0.7000  0.9000
    achieving             the root itself            0.1000  0.3000  0.5000  0.7000  0.9000

Near e = 1 the root is a = 3(1 - e)/2 + ..., near 0 it is 1/e: what misses the first is wrong for hard stops.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from contacts.law import ENTRY_RATE_FLOOR, Law
from contacts.numbers import (
    LARGEST_EXPONENT,
    LARGEST_OF_POWERS,
    LARGEST_PARAMETER,
    check_number,
    check_restitution,
    number,
    switch,
)
from contacts.restitution import achieved_restitution, damping_factor_for

PUBLISHED = (
    *("lankarani_nikravesh", "hunt_crossley", "herbert_mcwhannell", "lee_wang", "gonthier", "zhiying_qishao", "flores"),
    *("hu_guo", "carvalho_martins", "zhang_sharf", "achieving"),
)
"""Constructors of `Hysteretic` from a nominal restitution."""


def power_parameters(
    K: float, p: float, a: float = 0.0, c: float = 0.0, r: float = 0.0, clamp: bool = False, approach: bool = False
) -> NDArray[np.float64]:
    """Parameters of F = K δ^p (1 + a δ̇/δ̇⁻) + c δ^r δ̇, cut at zero (clamp), c only for δ̇ > 0 (approach)."""
    return np.array([K, p, a, c, r, float(clamp), float(approach)])


@dataclass(frozen=True)
class Hysteretic(Law):
    """Power law with hysteresis, F = K δ^p (1 + a δ̇/δ̇⁻).

    Parameters
    ----------
    stiffness : K > 0, N/m^p.
    damping_factor : a >= 0; 0 is elastic. See the constructors for values from a restitution.
    exponent : 1 <= p <= 100; 1.5 for spheres.
    clamp : cut the force at zero, so that the stop never pulls (it would where delta_dot < -entry_rate/a).
    entry_rate_floor : entry rates below it (m/s) count as it; a contact log says where the floor acted.

    Notes
    -----
    On a free mass the achieved restitution r obeys a (1 + r) = ln[(1 + a)/(1 - a r)], whatever K, mass, speed
    and p. The rate at entry must be latched by the integrator. ``python examples/contact_laws.py`` prints what all
    constructors achieve.

    References
    ----------
    Lankarani, Nikravesh, J. Mech. Des. 112 (1990) 369; van de Wouw et al., Int. J. Non-Linear Mech. 38
    (2003) 767, Eq. (3).

    Examples
    --------
    >>> stop = Hysteretic.lankarani_nikravesh(2.1e8, restitution=0.5)
    >>> stop.damping_factor
    0.5625
    """

    stiffness: float
    damping_factor: float
    exponent: float = 1.5
    clamp: bool = False
    entry_rate_floor: float = ENTRY_RATE_FLOOR
    nominal: tuple[str, float] | None = field(default=None, init=False, compare=False, repr=False)

    compiled: ClassVar[str] = "power"
    kinds: ClassVar[dict[str, str]] = {"hysteretic": "", **{name: name for name in PUBLISHED}}
    equation: ClassVar[str] = "F = stiffness δ^p (1 + damping_factor δ̇/entry_rate), p = exponent"
    units: ClassVar[dict[str, str]] = {"stiffness": "N/m^p", "entry_rate_floor": "m/s"}

    def __post_init__(self) -> None:
        number(self, "stiffness", strict=True, most=LARGEST_OF_POWERS)
        number(self, "damping_factor", most=LARGEST_OF_POWERS)
        number(self, "exponent", 1.0, most=LARGEST_EXPONENT)
        number(self, "entry_rate_floor", strict=True)
        switch(self, "clamp")

    @classmethod
    def lankarani_nikravesh(cls, stiffness: float, restitution: float, **options: Any) -> Hysteretic:
        """Factor 3(1 - e²)/4, e in [0, 1], valid near 1: H.M. Lankarani, P.E. Nikravesh, J. Mech. Des. 112 (1990) 369.

        Asked for e = 0.5 a free mass achieves 0.725.
        """
        return cls._of(stiffness, restitution, "lankarani_nikravesh", lambda e: 0.75 * (1.0 - e**2), options)

    @classmethod
    def hunt_crossley(cls, stiffness: float, restitution: float, **options: Any) -> Hysteretic:
        """Factor 3(1 - e)/2, e in [0, 1], valid near 1: K.H. Hunt, F.R.E. Crossley, J. Appl. Mech. 42 (1975) 440."""
        return cls._of(stiffness, restitution, "hunt_crossley", lambda e: 1.5 * (1.0 - e), options)

    @classmethod
    def herbert_mcwhannell(cls, stiffness: float, restitution: float, **options: Any) -> Hysteretic:
        """Factor 6(1 - e)/((2e - 1)² + 3), e in [0, 1], valid near 1: R.G. Herbert, D.C. McWhannell, J. Eng. Ind. 99
        (1977) 513.
        """
        return cls._of(
            *(stiffness, restitution, "herbert_mcwhannell"),
            *(lambda e: 6.0 * (1.0 - e) / ((2.0 * e - 1.0) ** 2 + 3.0), options),
        )

    @classmethod
    def lee_wang(cls, stiffness: float, restitution: float, **options: Any) -> Hysteretic:
        """Factor 3(1 - e)/4, e in [0, 1]: T.W. Lee, A.C. Wang, J. Mech. Transm. Autom. Des. 105 (1983) 534.

        Half of what e near 1 needs: 1 - r is half of 1 - e there.
        """
        return cls._of(stiffness, restitution, "lee_wang", lambda e: 0.75 * (1.0 - e), options)

    @classmethod
    def gonthier(cls, stiffness: float, restitution: float, **options: Any) -> Hysteretic:
        """Factor (1 - e²)/e, e in (0, 1]: Y. Gonthier et al., Multibody Syst. Dyn. 11 (2004) 209.

        Solves the exact relation to leading order at small e; near e = 1 a third too much.
        """
        return cls._of(stiffness, restitution, "gonthier", lambda e: (1.0 - e**2) / e, options, True)

    @classmethod
    def zhiying_qishao(cls, stiffness: float, restitution: float, **options: Any) -> Hysteretic:
        """Factor 3(1 - e²)e^{2(1-e)}/4, e in [0, 1], valid from about 0.3: Q. Zhiying, L. Qishao, J. Dyn. Control 4
        (2006) 294.
        """
        return cls._of(
            *(stiffness, restitution, "zhiying_qishao"),
            *(lambda e: 0.75 * (1.0 - e**2) * math.exp(2.0 * (1.0 - e)), options),
        )

    @classmethod
    def flores(cls, stiffness: float, restitution: float, **options: Any) -> Hysteretic:
        """Factor 8(1 - e)/(5e), e in (0, 1], for all of it: P. Flores et al., Multibody Syst. Dyn. 25 (2011) 357."""
        return cls._of(stiffness, restitution, "flores", lambda e: 1.6 * (1.0 - e) / e, options, True)

    @classmethod
    def hu_guo(cls, stiffness: float, restitution: float, **options: Any) -> Hysteretic:
        """Factor 3(1 - e)/(2e), e in (0, 1], for all of it: S. Hu, X. Guo, Multibody Syst. Dyn. 35 (2015) 131."""
        return cls._of(stiffness, restitution, "hu_guo", lambda e: 1.5 * (1.0 - e) / e, options, True)

    @classmethod
    def carvalho_martins(cls, stiffness: float, restitution: float, **options: Any) -> Hysteretic:
        """Factor 3(1 - e)(11 - e)/(2(1 + 9e)), e in [0, 1], within 0.003 from e = 1/3 on: A.S. Carvalho, J.M. Martins,
        Mech. Mach. Theory 139 (2019) 174.
        """
        return cls._of(
            *(stiffness, restitution, "carvalho_martins"),
            *(lambda e: 1.5 * (1.0 - e) * (11.0 - e) / (1.0 + 9.0 * e), options),
        )

    @classmethod
    def zhang_sharf(cls, stiffness: float, restitution: float, **options: Any) -> Hysteretic:
        """The relation solved for a by iteration, e in (0, 1]: Y. Zhang, I. Sharf, J. Appl. Mech. 76 (2009) 051002.

        The same factor as `achieving`, under the name of those who proposed it.
        """
        return cls._of(stiffness, restitution, "zhang_sharf", damping_factor_for, options, True)

    @classmethod
    def achieving(cls, stiffness: float, restitution: float, **options: Any) -> Hysteretic:
        """The factor with which a free mass leaves at exactly ``restitution`` in (0, 1] times its entry speed."""
        return cls._of(stiffness, restitution, "achieving", damping_factor_for, options, True)

    @classmethod
    def _of(
        cls,
        stiffness: float,
        restitution: float,
        who: str,
        factor: Any,
        options: dict[str, Any],
        low_open: bool = False,
    ) -> Hysteretic:
        """The law of one published factor, remembering what it was asked for."""
        e = check_restitution(restitution, who, low_open, "its factor is infinite at 0")
        law = cls(stiffness, factor(e), **options)
        object.__setattr__(law, "nominal", (who, e))
        return law

    @property
    def parameters(self) -> NDArray[np.float64]:
        """Those of the power family."""
        return power_parameters(self.stiffness, self.exponent, a=self.damping_factor, clamp=self.clamp)

    @property
    def remarks(self) -> tuple[str, ...]:  # type: ignore[override]
        """What a user should know."""
        a = self.damping_factor
        if not a:
            return ("never pulls; smooth",)
        pulls = (
            "clamp=True: force cut at zero where it would pull, at a kink that moves with the rate"
            if self.clamp
            else f"pulls where δ̇ < -entry_rate/damping_factor = -{1.0 / a:.4g} entry_rate: never a free mass, but a "
            "structure that throws the contact open; clamp=True forbids it"
        )
        return (
            pulls,
            f"singular at grazing (entry_rate → 0): entry rates below {self.entry_rate_floor:g} m/s count as that",
        )

    def exact_restitution(self, entry_rate: float, mass: float) -> float:
        """By the relation; an entry below the floor sees the factor reduced by entry_rate/floor."""
        return achieved_restitution(self.damping_factor * min(1.0, entry_rate / self.entry_rate_floor))


@dataclass(frozen=True)
class Hertz(Law):
    """Elastic power law F = K δ^p, Hertz's for p = 1.5.

    Parameters
    ----------
    stiffness : K > 0, N/m^p.
    exponent : 1 <= p <= 100.

    References
    ----------
    Hertz, J. reine angew. Math. 92 (1882) 156; van de Wouw et al. (2003), Eqs (1) and (2).

    Examples
    --------
    >>> float(Hertz(1e9).force(1e-4))
    1000.0
    """

    stiffness: float
    exponent: float = 1.5

    compiled: ClassVar[str] = "power"
    kinds: ClassVar[dict[str, str]] = {"hertz": "", "hertz_of_spheres": "of_spheres"}
    equation: ClassVar[str] = "F = stiffness δ^p, p = exponent"
    units: ClassVar[dict[str, str]] = {"stiffness": "N/m^p"}
    remarks: ClassVar[tuple[str, ...]] = ("never pulls; smooth",)  # type: ignore[misc]

    def __post_init__(self) -> None:
        number(self, "stiffness", strict=True, most=LARGEST_OF_POWERS)
        number(self, "exponent", 1.0, most=LARGEST_EXPONENT)

    @classmethod
    def of_spheres(cls, E1: float, nu1: float, R1: float, E2: float, nu2: float, R2: float) -> Hertz:
        """Two elastic spheres: K = (2/3) E_r √R_r, E_r = 2/[(1-ν₁²)/E₁ + (1-ν₂²)/E₂], R_r = R₁R₂/(R₁+R₂).

        Moduli in Pa, radii in m (``inf`` for a flat), Poisson's ratios in (-1, 0.5].
        """
        compliance = sum(_compliance(*one) for one in (("E1", E1, "nu1", nu1), ("E2", E2, "nu2", nu2)))
        curvature = sum(_curvature(*one) for one in (("R1", R1), ("R2", R2)))
        if curvature == 0.0:
            raise ValueError("R1 and R2 of Hertz.of_spheres are both infinite; two flats are no Hertz contact")
        return cls(4.0 / 3.0 / compliance / math.sqrt(curvature))

    @property
    def parameters(self) -> NDArray[np.float64]:
        """Those of the power family."""
        return power_parameters(self.stiffness, self.exponent)

    def exact_restitution(self, entry_rate: float, mass: float) -> float:
        """Elastic: 1."""
        return 1.0


def _compliance(stiff: str, E: Any, lateral: str, nu: Any) -> float:
    """(1 - ν²)/E of one of two bodies."""
    modulus = check_number(E, f"{stiff} of Hertz.of_spheres", strict=True, most=LARGEST_PARAMETER)
    ratio = check_number(nu, f"{lateral} of Hertz.of_spheres", -math.inf)
    if not -1.0 < ratio <= 0.5:
        raise ValueError(f"{lateral} of Hertz.of_spheres must lie in (-1, 0.5], got {nu!r}")
    return (1.0 - ratio) * (1.0 + ratio) / modulus


def _curvature(name: str, R: Any) -> float:
    """1/R of one of two bodies, 0 of a flat."""
    if isinstance(R, float) and math.isinf(R) and R > 0.0:
        return 0.0
    return 1.0 / check_number(R, f"{name} of Hertz.of_spheres", strict=True, most=LARGEST_PARAMETER)
