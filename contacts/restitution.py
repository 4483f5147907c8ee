"""Restitution that a law achieves on a free mass.

For F = K δ^p (1 + a δ̇/δ̇⁻) a relation gives it. With s = δ̇/δ̇⁻ the motion obeys s ds/(1 + a s) = -K δ^p dδ/(m δ̇⁻²);
the elastic term cancels over a closed loop, so from s = 1 to s = -r

    a (1 + r) = ln[(1 + a)/(1 - a r)],

whatever K, m, p and the entry speed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from contacts.law import Law


def achieved_restitution(damping_factor: float) -> float:
    """Restitution r a free mass achieves with the damping factor a >= 0.

    Solves ``a (1 + r) = ln[(1 + a)/(1 - a r)]`` for r in (0, 1]; r tends to 1/a for large a. ValueError for a factor
    that is negative or not finite.

    Examples
    --------
    >>> round(achieved_restitution(0.5625), 12)
    0.725241114010
    """
    a = damping_factor
    if not (math.isfinite(a) and a >= 0.0):
        raise ValueError(f"damping_factor must be finite and >= 0, got {a!r}")
    if a == 0.0:
        return 1.0
    from scipy.optimize import brentq

    # with x = a r the relation is h(-x) = h(a), h(x) = x - ln(1 + x): both sides positive, nothing cancels
    target, nearly_one = _h(a), 1.0 - 2.0**-53
    if target >= _h(-nearly_one):
        return 1.0 / a
    return float(brentq(lambda x: _h(-x) - target, 0.0, nearly_one, xtol=1e-300, rtol=8.9e-16)) / a


def _h(x: float) -> float:
    """The function h(x) = x - ln(1 + x), by its series where the difference would cancel."""
    if abs(x) > 0.1:
        return x - math.log1p(x)
    return sum((-x) ** k / k for k in range(17, 1, -1))


def damping_factor_for(restitution: float) -> float:
    """Damping factor a >= 0 with which a free mass achieves ``restitution`` r in (0, 1] exactly.

    Solves ``a (1 + r) = ln[(1 + a)/(1 - a r)]`` for a. ValueError for a restitution outside that range.

    Examples
    --------
    >>> round(damping_factor_for(0.5), 9)
    1.432750533
    """
    r = restitution
    if not (isinstance(r, (int, float)) and 0.0 < r <= 1.0):
        raise ValueError(
            f"restitution must lie in (0, 1], got {r!r}; this family reaches 0 only for an infinite damping factor"
        )
    if r == 1.0:
        return 0.0
    from scipy.optimize import brentq

    # the achieved restitution falls monotonically with a and is below 1/a
    return brentq(lambda a: achieved_restitution(a) - r, 0.0, 1.0 / r, xtol=1e-15, rtol=8.9e-16)


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
    entry_rate : m/s, > 0.
    mass : kg, > 0; for two bodies m₁m₂/(m₁ + m₂).

    Returns
    -------
    0 (it never leaves) to 1 (elastic). Of `Hysteretic` it depends on neither mass, speed, stiffness nor exponent,
    of `KelvinVoigt` and `Viscoelastic` not on the speed.

    Raises
    ------
    ValueError for an entry rate or a mass that is not positive; RuntimeError for a law that never stops the mass.

    Examples
    --------
    >>> from contacts import Hysteretic
    >>> round(restitution(Hysteretic.lankarani_nikravesh(2.1e8, 0.5)), 12)
    0.725241114010
    """
    _check_throw(entry_rate, mass)
    exact = law.exact_restitution(entry_rate, mass)
    return bounce(law, entry_rate, mass).restitution if exact is None else exact


def bounce(law: Law, entry_rate: float = 1.0, mass: float = 1.0) -> Bounce:
    """Throw a free mass onto a stop and integrate m δ̈ = -F from entry to exit.

    Each segment between knots and the turning point is integrated by itself (DOP853, relative tolerance 1e-12).

    Parameters
    ----------
    law : any contact law.
    entry_rate : m/s, > 0.
    mass : kg, > 0.

    Returns
    -------
    Bounce : t, delta, delta_dot, force from entry to exit, and the restitution.

    Raises
    ------
    ValueError for an entry rate or a mass that is not positive and for a law with memory; RuntimeError for a law that
    never stops the mass.

    Examples
    --------
    >>> from contacts import Hertz
    >>> thrown = bounce(Hertz(2.1e8), entry_rate=0.3, mass=0.03)
    >>> round(thrown.restitution, 9), thrown.left
    (1.0, True)
    """
    _check_throw(entry_rate, mass)
    if law.memory:
        raise ValueError(
            f"bounce knows laws without memory, got {law!r}; integrate a mass on it (solvers.integrate), or lead it "
            "along a path (Law.along)"
        )
    force = law.batch(entry_rate)
    scale = entry_rate, mass, force
    t, y = np.zeros(1), np.array([[0.0], [entry_rate]])
    direction, end = 1, math.inf
    levels, piece = (0.0, *law.knots, math.inf), 0
    while True:
        low, high = levels[piece], levels[piece + 1]
        times, states, reached = _stretch(scale, t[-1], y[:, -1], direction, high if direction > 0 else low, end)
        t, y = np.append(t, times[1:]), np.hstack((y, states[:, 1:]))
        if not reached and direction < 0:
            break
        if not reached:
            direction, end = (
                -1,
                1e3 * t[-1],
            )  # turned; a mass that needs a thousand times as long to leave never does
        elif direction > 0:
            piece += 1
        elif piece == 0:
            break
        else:
            piece -= 1
    y[0, -1] = 0.0 if reached else y[0, -1]
    values = force(np.maximum(y[0], 0.0), y[1])
    return Bounce(t, y[0], y[1], values, bool(reached))


def _stretch(
    scale: tuple[float, float, Any], start: float, state: NDArray, direction: int, level: float, end: float
) -> tuple[NDArray, NDArray, bool]:
    """Integrate until δ reaches the level (True), or the mass turns on its way in or the time is over (False)."""
    from scipy.integrate import solve_ivp

    entry_rate, mass, force = scale
    delta, rate = np.empty(1), np.empty(1)

    def motion(t: float, y: NDArray) -> tuple[float, float]:
        delta[0], rate[0] = max(y[0], 0.0), y[1]
        return y[1], -force(delta, rate)[0] / mass

    def at_level(t: float, y: NDArray) -> float:
        return float(y[0] - level)

    def turned(t: float, y: NDArray) -> float:
        return float(y[1])

    at_level.terminal, at_level.direction = True, direction  # type: ignore[attr-defined]
    turned.terminal, turned.direction = True, -1.0  # type: ignore[attr-defined]
    watched = [turned] if math.isinf(level) else [at_level, *([turned] if direction > 0 else [])]
    last = min(end, 1e12)
    done = solve_ivp(
        *(motion, (start, last), state, "DOP853"),
        **{"events": watched, "rtol": 1e-12, "atol": np.array([1e-15, 1e-15 * entry_rate])},
    )
    if done.status == -1 or not np.all(np.isfinite(done.y)):
        raise RuntimeError(f"the bounce cannot be integrated beyond t = {done.t[-1]:g} s: {done.message}")
    if direction > 0 and done.status == 0:
        raise RuntimeError(f"the law never stops a mass of {mass:g} kg at {entry_rate:g} m/s")
    reached = not math.isinf(level) and len(done.t_events[0]) > 0
    if direction > 0 and not reached:
        done.y[1, -1] = 0.0
    return done.t, done.y, reached


def _check_throw(entry_rate: float, mass: float) -> None:
    """Both positive."""
    for name, value in (("entry_rate", entry_rate), ("mass", mass)):
        if not (math.isfinite(value) and value > 0.0):
            raise ValueError(f"{name} must be finite and > 0, got {value!r}")
