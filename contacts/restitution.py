"""Restitution that a law achieves on a free mass.

For F = K δ^p (1 + a δ̇/δ̇⁻) a relation gives it. With s = δ̇/δ̇⁻ the motion obeys s ds/(1 + a s) = -K δ^p dδ/(m δ̇⁻²);
the elastic term cancels over a closed loop, so from s = 1 to s = -r

    a (1 + r) = ln[(1 + a)/(1 - a r)],

whatever K, m, p and the entry speed. With 2x = a (1 + r) and Langevin's function L(x) = coth x - 1/x it reads

    a = x (1 + L),    a r = x (1 - L),    r = (1 - L)/(1 + L).
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contacts.law import Law
from contacts.numbers import check_number, check_restitution

LARGEST_THROW = 1e150
"""Largest entry rate (m/s) and mass (kg) of a throw; the smallest are its inverse."""
STOPPED = 1e-14  # of the entry rate: a mass that only a dashpot brakes comes to rest without turning
LONGEST = 1e3  # times of coming to rest in which a mass leaves, or never does
_BLUNT = 40.0  # factor from which on r = 1/a to rounding
_STEPS = 6  # of Newton's method: each doubles the digits of a start that has one or more; no tolerance to be met


def achieved_restitution(damping_factor: float) -> float:
    """Restitution r a free mass achieves with the damping factor a >= 0.

    Solves ``a (1 + r) = ln[(1 + a)/(1 - a r)]`` for r in (0, 1]; r = 1 - 2a/3 + ... for small a, 1/a for large a.
    ValueError for a factor that is negative or not finite.

    Examples
    --------
    >>> round(achieved_restitution(0.5625), 12)
    0.725241114010
    """
    a = check_number(damping_factor, "damping_factor")
    if a > _BLUNT:
        return 1.0 / a
    x = min(a, 0.5 * (a + 1.0))  # x (1 + L) is convex and rises with slopes from 1 to 2: above, and Newton stays there
    for _ in range(_STEPS):
        L = _langevin(x)
        x -= (x * (1.0 + L) - a) / (1.0 - L + x * (1.0 - L**2))
    L = _langevin(x)
    return (1.0 - L) / (1.0 + L)


def damping_factor_for(restitution: float) -> float:
    """Damping factor a >= 0 with which a free mass achieves ``restitution`` r in (0, 1] exactly.

    Solves ``a (1 + r) = ln[(1 + a)/(1 - a r)]`` for a. ValueError for a restitution outside that range or below 1e-100.

    Examples
    --------
    >>> round(damping_factor_for(0.5), 9)
    1.432750533
    """
    r = check_restitution(restitution, "damping_factor_for", True, "the factor is infinite at 0")
    if r < 1.0 / _BLUNT or r == 1.0:
        return 1.0 / r if r < 1.0 else 0.0
    L = (1.0 - r) / (1.0 + r)
    x = L * (3.0 - L**2) / (1.0 - L**2)  # within 5 %
    for _ in range(_STEPS):
        tried = _langevin(x)
        x -= (tried - L) / (1.0 - 2.0 * tried / x - tried**2)
    return x * (1.0 + L)


def _langevin(x: float) -> float:
    """L(x) = coth x - 1/x for x >= 0; by its continued fraction x/(3 + x²/(5 + ...)) where the difference cancels."""
    if x > 2.0:
        return 1.0 / math.tanh(x) - 1.0 / x
    below = 31.0
    for odd in range(29, 1, -2):
        below = odd + x * x / below
    return x / below


@dataclass(frozen=True, eq=False)
class Bounce:
    """A free mass thrown onto a stop: samples from entry to exit, made by `bounce`.

    Attributes
    ----------
    t, delta, delta_dot, force : (k,) s, m, m/s, N.
    left : whether the mass leaves; one that creeps to rest in an overdamped stop does not.
    """

    t: NDArray[np.float64]
    delta: NDArray[np.float64]
    delta_dot: NDArray[np.float64]
    force: NDArray[np.float64]
    left: bool

    def __repr__(self) -> str:
        return f"<bounce of {self.t[-1]:.4g} s at {self.delta_dot[0]:.4g} m/s, restitution {self.restitution:.4g}>"

    @property
    def restitution(self) -> float:
        """Exit over entry speed."""
        return float(-self.delta_dot[-1] / self.delta_dot[0]) if self.left else 0.0


def restitution(law: Law, entry_rate: float = 1.0, mass: float = 1.0) -> float:
    """Restitution a free mass achieves on a stop: exit over entry speed.

    By the law's exact relation where it has one, else by integrating m δ̈ = -F with relative tolerance 1e-12.

    Parameters
    ----------
    law : any contact law.
    entry_rate : m/s, 1e-150 to 1e150.
    mass : kg, 1e-150 to 1e150; for two bodies m₁m₂/(m₁ + m₂).

    Returns
    -------
    0 (it never leaves) to 1 (elastic). Of `Hysteretic` it depends on neither mass, speed, stiffness nor exponent,
    of `KelvinVoigt` and `Viscoelastic` not on the speed. By integration a mass that takes a thousand times as long to
    leave as to stop counts as one that never does: restitutions below 0.001 are then 0.

    Raises
    ------
    ValueError as `bounce`.

    Examples
    --------
    >>> from contacts import Hysteretic
    >>> round(restitution(Hysteretic.lankarani_nikravesh(2.1e8, 0.5)), 12)
    0.725241114010
    """
    entry_rate, mass = checked_throw(law, entry_rate, mass)
    exact = law.exact_restitution(entry_rate, mass)
    return bounce(law, entry_rate, mass).restitution if exact is None else exact


def bounce(law: Law, entry_rate: float = 1.0, mass: float = 1.0) -> Bounce:
    """Throw a free mass onto a stop and integrate m δ̈ = -F from entry to exit.

    Each segment between knots and the turning point is integrated by itself (DOP853, relative tolerance 1e-12), in
    units of the entry rate and of the depth at which the force does work of the order of the mass's energy.

    Parameters
    ----------
    law : any contact law without memory.
    entry_rate : m/s, 1e-150 to 1e150.
    mass : kg, 1e-150 to 1e150.

    Returns
    -------
    Bounce : t, delta, delta_dot, force from entry to exit, and the restitution.

    Raises
    ------
    ValueError for an entry rate or a mass out of range, for a law with memory, for one that never stops the mass, and
    for a force that is not finite on the way.

    Examples
    --------
    >>> from contacts import Hertz
    >>> thrown = bounce(Hertz(2.1e8), entry_rate=0.3, mass=0.03)
    >>> round(thrown.restitution, 9), thrown.left
    (1.0, True)
    """
    throw = _Throw(law, *checked_throw(law, entry_rate, mass))
    t, y = np.zeros(1), np.array([[0.0], [1.0]])
    direction, end = 1, math.inf
    levels, piece = (0.0, *(knot / throw.depth for knot in law.knots), math.inf), 0
    while True:
        low, high = levels[piece], levels[piece + 1]
        times, states, reached = _stretch(throw, t[-1], y[:, -1], direction, high if direction > 0 else low, end)
        t, y = np.append(t, times[1:]), np.hstack((y, states[:, 1:]))
        if not reached and direction < 0:
            break
        if not reached:
            direction, end = -1, LONGEST * t[-1]  # turned
        elif direction > 0:
            piece += 1
        elif piece == 0:
            break
        else:
            piece -= 1
    y[0, -1] = 0.0 if reached else y[0, -1]
    delta, rate = throw.depth * np.maximum(y[0], 0.0), throw.entry_rate * y[1]
    left = bool(reached and y[1, -1] < -STOPPED)
    return Bounce(throw.duration * t, throw.depth * y[0], rate, throw.force(delta, rate), left)


class _Throw:
    """Motion of a free mass in units: of ``depth`` m, of the entry rate, of the ``duration`` s that these make."""

    def __init__(self, law: Law, entry_rate: float, mass: float) -> None:
        if law.memory:
            raise ValueError(
                f"bounce knows laws without memory, got {law!r}; integrate a mass on it (solvers.integrate), or lead "
                "it along a path (Law.along)"
            )
        self.law, self.entry_rate, self.mass, self.force = law, entry_rate, mass, law.batch(entry_rate)
        self.depth = self._depth()
        self.duration = self.depth / entry_rate
        self.strength = mass * entry_rate / self.duration
        if not sys.float_info.min <= self.strength < math.inf or not sys.float_info.min <= self.duration < math.inf:
            raise ValueError(f"forces of {self}, about {self.strength:g} N, are beyond the floats; are these SI units?")

    def __str__(self) -> str:
        return f"a bounce of {self.mass:g} kg at {self.entry_rate:g} m/s on {self.law!r}"

    def _depth(self) -> float:
        """Where force times indentation reaches twice the energy first, else where it is largest."""
        delta = np.geomspace(1e-300, 1e300, 2401)
        with np.errstate(all="ignore"):
            force = np.fmax(*(self.force(delta, np.full(delta.size, rate)) for rate in (self.entry_rate, 0.0)))
            share = force / (self.mass * self.entry_rate) * (delta / self.entry_rate)
        place = int(np.argmax(share >= 1.0) if np.any(share >= 1.0) else np.nanargmax(np.nan_to_num(share, nan=0.0)))
        if not share[place] > 0.0:
            raise ValueError(f"{self}: the law never stops the mass, it has no force against it")
        return float(delta[place])

    def motion(self, t: float, y: NDArray) -> tuple[float, float]:
        """Derivatives by time of indentation and rate, in units."""
        delta, rate = np.array([self.depth * max(y[0], 0.0)]), np.array([self.entry_rate * y[1]])
        return y[1], -self.force(delta, rate)[0] / self.strength


def _stretch(
    throw: _Throw, start: float, state: NDArray, direction: int, level: float, end: float
) -> tuple[NDArray, NDArray, bool]:
    """Integrate until δ reaches the level (True), or the mass turns on its way in or the time is over (False)."""
    from scipy.integrate import solve_ivp

    def at_level(t: float, y: NDArray) -> float:
        return float(y[0] - level)

    def turned(t: float, y: NDArray) -> float:
        return float(y[1] - STOPPED)

    at_level.terminal, at_level.direction = True, direction  # type: ignore[attr-defined]
    turned.terminal, turned.direction = True, -1.0  # type: ignore[attr-defined]
    watched = [turned] if math.isinf(level) else [at_level, *([turned] if direction > 0 else [])]
    first = throw.motion(start, state)[1]
    if not math.isfinite(first):
        raise ValueError(f"{throw}: the force is {-first} where it begins")
    with np.errstate(all="ignore"):  # a trial step may meet forces beyond the floats: then it is repeated, shorter
        done = solve_ivp(
            *(throw.motion, (start, min(end, 1e12)), state, "DOP853"),
            **{"events": watched, "rtol": 1e-12, "atol": 1e-15},
        )
    if done.status == -1 or not np.all(np.isfinite(done.y)):
        force = throw.strength * -throw.motion(done.t[-1], done.y[:, -1])[1]
        until = f"t = {done.t[-1] * throw.duration:g} s, where F = {force:g} N"
        raise ValueError(f"{throw} cannot be followed beyond {until}: steps fall below the rounding of t")
    if direction > 0 and done.status == 0:
        raise ValueError(f"{throw}: the law never stops the mass, at δ = {throw.depth * done.y[0, -1]:g} m it moves on")
    reached = not math.isinf(level) and len(done.t_events[0]) > 0
    if direction > 0 and not reached:
        done.y[1, -1] = 0.0
    return done.t, done.y, reached


def checked_throw(law: Law, entry_rate: float, mass: float) -> tuple[float, float]:
    """Entry rate and mass as floats; a law, both positive and in range."""
    if not isinstance(law, Law):
        raise ValueError(f"law must be a contact law, got {law!r}; use one of contacts, such as Hertz(1e9)")
    given = (("entry_rate", entry_rate), ("mass", mass))
    entry_rate, mass = (check_number(value, name, strict=True, most=LARGEST_THROW) for name, value in given)
    return entry_rate, mass
