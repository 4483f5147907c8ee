"""Friction of a contact: one slider behind a spring, whose limit is μ times the contact's own force."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from solvers.problem.matrices import Array, number

(MU, STIFFNESS, ARM, SPIN, CODE, SLIDER, PEAK, BEGUN, CUT, ALONG, ACROSS, ANGLE, SCRATCH) = range(13)
"""Places of a contact's friction behind its law's parameters: μ; k_t, N/m; R, m, negative where the place runs around a
post; Ω, rad/s; code of the segment; s, m; largest |F_t| of the contact under way and F_t as the run began, N; place of
the law's switch that cuts N at zero, or -1; a direction in the circle and its angle, rad, near the place."""
SIZE = 19  # the rest is scratch
ACCOUNTS = 3  # numbers in the state behind the energy balance: ∫F_t ξ̇ dt, ∫F_t dt, and the way of the slider
STICK, FREE = 0.0, 2.0  # codes; those of slip are -1 and 1, FREE is that of a contact that is open, or pulls
NEARLY = 0.95  # of half a turn of the spring in a circle, beyond which runs are refused
SLIDES, PRESSES = range(2)  # borders: the slider's own, and N = 0, where slip ends


@dataclass(frozen=True)
class Friction:
    """Dry friction of a contact: a spring and a slider in series, with the limit μN(t) of the contact's force N.

    With ξ the tangential displacement and s the slider's place,

        stick: F_t = k_t (ξ - s) while |F_t| < μN;    slip: F_t = ±μN while the slider moves that way, ±(ξ̇ ∓ μṄ/k_t) > 0

    The loss is ∫F_t ξ̇ dt - F_t²/2k_t. A contact begins in stick where N jumps at entry or where its limit grows faster
    than the spring's force, k_t |ξ̇| <= μṄ; else in slip, as always with laws of exponent above 1. If a run begins in
    contact, the spring is unloaded then. In a circle of radius c the spring must stay within half a turn,
    |F_t| < k_t π c; other runs are refused. Where a law pulls, N < 0, or is cut, N = 0, the slider is free as in an
    open contact: it follows without force, and its path is no slip; where N grows again the contact begins as at an
    entry. Where N jumps up on a knot of the law a slip ends: F_t stays.

    Parameters
    ----------
    mu : μ >= 0, coefficient of friction.
    stiffness : k_t > 0, N/m, tangential, of the contact; k_t/k_n = 2(1 - ν)/(2 - ν) of its normal stiffness for spheres
        (Mindlin).

    Notes
    -----
    R.D. Mindlin, J. Appl. Mech. 16 (1949) 259-268, for k_t, which does not follow N: one that does would make energy.
    Friction without ``stiffness``, of the sign of ξ̇ alone, is not offered: what should roll would slip to and fro.

    Examples
    --------
    >>> Friction(0.3, stiffness=2e6).mu
    0.3
    """

    mu: float
    stiffness: float | None = None

    def __post_init__(self) -> None:
        for name in ("mu", "stiffness"):
            value: Any = getattr(self, name)
            if name == "stiffness" and value is None:
                raise ValueError("Friction needs stiffness > 0, the tangential one of the contact (N/m)")
            found = number(value, f"{name} of Friction")
            least = ">= 0" if name == "mu" else "> 0 (N/m)"
            if not math.isfinite(found) or found < 0.0 or (name == "stiffness" and found == 0.0):
                raise ValueError(f"{name} of Friction must be finite and {least}, got {value!r}")
            object.__setattr__(self, name, found)


class Rubbing:
    """The law of a contact with its friction: the law itself, whose parameters go on with those of the slider.

    To integrators a law with two latched numbers, code and place of the slider, and one border, or a second one where
    N may fall to zero before the contact opens; they are no C functions of δ and δ̇, see `compiled.sliding`.
    """

    events = ("stick", "slip", "free")
    segment_codes = ((-1.0, 0.0, 1.0, 2.0), ())

    def __init__(self, law: Any, friction: Friction, arm: float, spin: float) -> None:
        self.law, self.friction, self.arm, self.spin = law, friction, arm, spin

    def __getattr__(self, name: str) -> Any:
        """What the slider does not change is the law's."""
        if name in ("law", "__setstate__"):  # of a copy that is being made
            raise AttributeError(name)
        return getattr(self.law, name)

    def __repr__(self) -> str:
        return f"{self.law!r} with {self.friction!r}"

    @property
    def borders(self) -> int:
        """One of a law that is known to push while δ > 0, else two."""
        return 2 if may_pull(self.law) else 1

    @property
    def place(self) -> int:
        """Where the numbers of friction begin among the parameters: never at 0."""
        return max(1, len(self.law.parameters))

    @property
    def memory(self) -> tuple[int, ...]:
        """Places of code and slider."""
        return self.place + CODE, self.place + SLIDER

    @property
    def parameters(self) -> Array:
        """Those of the law, then of friction."""
        numbers = np.zeros(self.place + SIZE)
        own = np.asarray(self.law.parameters, dtype=float)
        numbers[: own.size] = own
        known = self.friction.mu, self.friction.stiffness, self.arm, self.spin, FREE
        numbers[self.place : self.place + SLIDER] = known
        numbers[self.place + CUT], numbers[self.place + ALONG] = self._switch(own), 1.0
        return numbers

    def _switch(self, own: Array) -> int:
        """Place of the parameter by which a law that is cut at zero differs from the one that is not, or -1."""
        if getattr(self.law, "bend", None) != "force":
            return -1
        return int(np.flatnonzero(own != np.asarray(self.law.uncut.parameters))[0])

    def stored(self, delta: float, parameters: Array) -> float:
        """Energy of the law alone, J; that of the slider's spring is F_t²/2k_t."""
        return float(self.law.stored(delta, np.asarray(self.law.parameters, dtype=float)))


def most_friction(contact: Any, radius: Any) -> Any:
    """|F_t|, N, in a circle of that radius beyond which ξ - s, known up to whole turns, may be wrong."""
    return NEARLY * contact.law.friction.stiffness * math.pi * radius


def may_pull(law: Any) -> bool:
    """Whether a force, before it is cut at zero, may be negative while δ > 0: not known to push for all δ̇."""
    *_, factor, damping = getattr(law, "inlined", None) or (1.0, 1.0)
    return bool(factor or damping)


def told_rates(contacts: Sequence[Any], now: Sequence[Array]) -> Array:
    """(l,) derivatives of latched numbers, as they are told at the end of a run, by its duration.

    The place of a slider that sticks is told as of a run that begins now, in which a spin has turned by nothing yet.
    """
    rates = [np.zeros(len(one)) for one in now]
    for contact, one, rate in zip(contacts, now, rates, strict=True):
        if contact.friction is not None and one[0] == STICK:
            rate[1] = -contact.surface
    return np.concatenate([np.zeros(0), *rates])


def tell_sliders(
    matrix: Array, contacts: Sequence[Any], begun: Sequence[Array], now: Sequence[Array], turned: Array
) -> None:
    """Make derivatives (2n + l, 2n + l + d) of the end of a run those of what is told of sliders, in place.

    ``begun`` and ``now`` are latched numbers at start and end; ``turned`` (contacts, d) the derivatives, by d
    parameters, of the way that spins have turned, which is not told, see `told_rates`. Nothing follows from the place
    of a slider that did not stick at the start.
    """
    place = len(matrix) - sum(map(len, now)) + 1
    for contact, first, last, way in zip(contacts, begun, now, turned, strict=True):
        if contact.friction is not None and first[0] != STICK:
            matrix[:, place] = 0.0
        if contact.friction is not None and last[0] == STICK:
            matrix[place, matrix.shape[1] - len(way) :] -= way
        place += len(last)


def row_of(name: str, given: ArrayLike, size: int) -> Array:
    """A checked row of coordinates of a contact."""
    row = np.array(given, dtype=float, ndmin=1)
    if row.shape != (size,) or not np.all(np.isfinite(row)) or not row.any():
        raise ValueError(
            f"{name} of a Contact must be a finite row of {size} numbers that are not all 0, got {given!r}"
        )
    row.setflags(write=False)
    return row
