"""Dry friction behind springs: sliders that stick until their limit and slip until the rate returns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from contacts.law import Law
from contacts.numbers import number

Slider = tuple[float, float, float, float]
SLIDER_SIZE = 6  # numbers per slider (k, f, f_s, c, code, s); as in the kernels


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
    def sliders(self) -> tuple[Slider, ...]:
        """Stiffness, kinetic limit, static limit and damping of each."""
        raise NotImplementedError

    @property
    def reach(self) -> float:  # type: ignore[override]
        """Twice the δ at which the last slips."""
        return 2.0 * max(static / k for k, _, static, _ in self.sliders)

    @property
    def remarks(self) -> tuple[str, ...]:  # type: ignore[override]
        """What a user should know."""
        return ("force continuous, its slope jumps where a slider lets go",)

    @property
    def borders(self) -> int:  # type: ignore[override]
        """One per slider."""
        return len(self.sliders)

    @property
    def memory(self) -> tuple[int, ...]:  # type: ignore[override]
        """Code and place of every slider."""
        return tuple(2 + SLIDER_SIZE * j + place for j in range(self.borders) for place in (4, 5))

    @property
    def segment_codes(self) -> tuple[tuple[float, ...], ...]:  # type: ignore[override]
        """Stick 0, slip in either direction."""
        return ((-1.0, 0.0, 1.0), ()) * self.borders

    @property
    def parameters(self) -> NDArray[np.float64]:
        """(N, k_0, then per slider: k, f, f_s, c, code, s), all sticking at 0."""
        return np.array([self.borders, self.spring, *(x for part in self.sliders for x in (*part, 0.0, 0.0))])

    def stored(self, delta: float, parameters: NDArray[np.float64]) -> float:
        """Energy of the springs, F²/2k each, J."""
        k, f, _, _, code, s = parameters[2:].reshape(-1, SLIDER_SIZE).T
        force = np.where(code == 0.0, k * (delta - s), f)
        return float(0.5 * parameters[1] * delta**2 + np.sum(0.5 * force**2 / k))


@dataclass(frozen=True)
class Jenkins(Sliders):
    """Spring and slider in series: elastic up to a limit, F = k (δ - s), then slip at F = ±f.

    A slider that slips sticks again where δ̇ = 0, with s = δ ∓ f/k. Always active, at both signs of δ. At the start
    s = 0: a run that begins beyond |δ| = f/k begins in slip.

    Parameters
    ----------
    stiffness : k > 0, N/m, of the spring.
    limit : f > 0, N, at which the slider slips.

    Notes
    -----
    G.M. Jenkins, Br. J. Appl. Phys. 13 (1962) 30-32: elastic, perfectly plastic. A cycle of amplitude
    X > f/k loses 4 f (X - f/k), a smaller one nothing. Rigid Coulomb friction is the limit k → ∞, see `Coulomb`.

    Examples
    --------
    >>> Jenkins(2e4, 10.0).along([0.0, 1e-3, 4e-4, -1e-3]).tolist()
    [0.0, 10.0, -2.0, -10.0]
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
    def sliders(self) -> tuple[Slider, ...]:
        """The only one."""
        return ((self.stiffness, self.limit, self.limit, 0.0),)


@dataclass(frozen=True)
class Coulomb(Sliders):
    """Dry friction behind the stiffness of the contact: stick until a static limit, then slip at F = ±limit.

    While it sticks F = k (δ - s) + c δ̇; at |F| = f_s it begins to slip, at δ̇ = 0 it sticks again with s = δ ∓ f/k.

    Parameters
    ----------
    limit : f > 0, N, the force of slip: friction coefficient times normal force.
    stiffness : k > 0, N/m, tangential, of the contact.
    static_limit : f_s >= f, N, at which slip begins; None is f. Above f the force jumps to f there.
    damping : c >= 0, N s/m, tangential, acting in stick.

    Notes
    -----
    With tangential stiffness as in J.H. Griffin, J. Eng. Power 102 (1980) 329-333. Rigid Coulomb friction, where stick
    has no motion at all, is approached like k^(-1/2) only, and the closer the shorter the steps. With f_s > f and c = 0
    the mass m rings on k after every stop and may slide for ever. Where a slip ends and a load p is to be held, F goes
    from f to p and passes it by η (f - p), η = exp(-2β acosh β/√(β² - 1)), β = c/(2 √(k m)): by 13.5 % with
    c = 2 √(k m), so that loads down to -f slip once more unless f_s >= 1.27 f; by 7.6 % with 3 √(k m), which holds them
    from f_s = 1.16 f on. With c > 0 slip begins while k holds less than f, and ends with k holding f: a slip shorter
    than (f² - (f_s - c |δ̇|)²)/(2 k f) may give energy.

    Examples
    --------
    >>> Coulomb(10.0, 2e4, static_limit=12.0).along([0.0, 5e-4, 6e-4, 7e-4]).round(9).tolist()
    [0.0, 10.0, 12.0, 10.0]
    """

    limit: float
    stiffness: float
    static_limit: float | None = None
    damping: float = 0.0

    kinds: ClassVar[dict[str, str]] = {"coulomb": ""}
    equation: ClassVar[str] = "F = stiffness (δ - s) + damping δ̇ while |F| < static_limit, else ±limit until δ̇ = 0"
    units: ClassVar[dict[str, str]] = {"limit": "N", "stiffness": "N/m", "static_limit": "N", "damping": "N s/m"}

    def __post_init__(self) -> None:
        number(self, "limit", strict=True)
        number(self, "stiffness", strict=True)
        number(self, "damping")
        if self.static_limit is not None:
            number(self, "static_limit", self.limit)

    @property
    def sliders(self) -> tuple[Slider, ...]:
        """The only one."""
        return ((self.stiffness, self.limit, self.static_limit or self.limit, self.damping),)

    @property
    def jumps(self) -> bool:  # type: ignore[override]
        """From the static limit to the kinetic one."""
        return self.static_limit is not None and self.static_limit > self.limit

    @property
    def remarks(self) -> tuple[str, ...]:  # type: ignore[override]
        """What a user should know."""
        if not self.jumps:
            return ("force continuous",)
        rings = "" if self.damping else "; without damping it rings in stick and may slide for ever"
        return (f"force jumps by {self.static_limit - self.limit:.6g} N where slip begins{rings}",)  # type: ignore[operator]


@dataclass(frozen=True)
class ElastoPlastic(Sliders):
    """Yielding with linear hardening: elastic to the yield force, then a line of smaller slope, unloading parallel.

    A spring h beside a `Jenkins` element of stiffness k - h and limit F_y (1 - h/k). The elastic range stays 2 F_y
    wide and moves (kinematic hardening).

    Parameters
    ----------
    stiffness : k > 0, N/m, elastic.
    yield_force : F_y > 0, N.
    hardening : 0 <= h < k, N/m, slope beyond the yield force.

    Notes
    -----
    W. Prager, J. Appl. Mech. 23 (1956) 493-496, in one dimension. Always active, at both signs of δ; a yielding stop is
    `WaltonBraun`.

    Examples
    --------
    >>> ElastoPlastic(2e4, 10.0, 5e3).along([5e-4, 1e-3, 0.0, -1e-3]).round(9).tolist()
    [10.0, 12.5, -7.5, -12.5]
    """

    stiffness: float
    yield_force: float
    hardening: float = 0.0

    kinds: ClassVar[dict[str, str]] = {"elasto_plastic": ""}
    equation: ClassVar[str] = "dF/dδ = stiffness; from yield_force on hardening, until δ̇ = 0"
    units: ClassVar[dict[str, str]] = {"stiffness": "N/m", "yield_force": "N", "hardening": "N/m"}

    def __post_init__(self) -> None:
        number(self, "stiffness", strict=True)
        number(self, "yield_force", strict=True)
        number(self, "hardening")
        if self.hardening >= self.stiffness:
            raise ValueError(
                f"hardening of ElastoPlastic must be smaller than stiffness {self.stiffness:g} N/m, got "
                f"{self.hardening!r}"
            )

    @property
    def spring(self) -> float:
        """The slope beyond the yield force."""
        return self.hardening

    @property
    def sliders(self) -> tuple[Slider, ...]:
        """The only one."""
        k = self.stiffness - self.hardening
        limit = self.yield_force * (k / self.stiffness)
        return ((k, limit, limit, 0.0),)
