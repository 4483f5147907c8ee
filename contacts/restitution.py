r"""Damping factor and achieved restitution of ``F = K d^p (1 + a v/entry_rate)`` on a free mass.

With :math:`s = \dot δ/\dot δ^-` the motion obeys :math:`s\,ds/(1 + a s) = -K δ^p dδ/(m (\dot δ^-)^2)`; the elastic term
gives nothing over a closed loop, so from s = 1 to s = -r

    a (1 + r) = ln[(1 + a)/(1 - a r)],

whatever K, m, p and the entry speed.
"""

from __future__ import annotations

import math


def achieved_restitution(damping_factor: float) -> float:
    """Restitution r a free mass achieves with the damping factor a >= 0.

    Solves ``a (1 + r) = ln[(1 + a)/(1 - a r)]`` for r in (0, 1]; r tends to 1/a for large a.

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
    """X - ln(1 + x), by its series where the difference would cancel."""
    if abs(x) > 0.1:
        return x - math.log1p(x)
    return sum((-x) ** k / k for k in range(17, 1, -1))


def damping_factor_for(restitution: float) -> float:
    """Damping factor with which a free mass achieves ``restitution`` in (0, 1] exactly.

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
