"""Compiled laws called from Python: force, its derivatives, margins and renewals of a memory."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from solvers.problem import Array, renew

_REALS = ctypes.c_void_p
_KNOWN = ctypes.c_int64, _REALS, _REALS, ctypes.c_double, _REALS
_ONE, _THREE = ctypes.CFUNCTYPE(None, *_KNOWN, _REALS), ctypes.CFUNCTYPE(None, *_KNOWN, *[_REALS] * 3)
_SHARE, _SMALL = 1e-7, 1e-8  # steps of differences, relative to the number, and at least to its terms; margins bend
_UNKNOWN, _TRIALS = 1e-10, 4  # step from which that of a latched number, of unknown size, is found in so many trials


def _call(function: Any, row: Array, motion: tuple[Array, Array], entry_rate: float, *out: Array) -> None:
    """Call a law at δ and δ̇ (k,)."""
    delta, rate = (np.array(one, dtype=float, ndmin=1) for one in motion)
    d, v, p, *results = (array.ctypes.data for array in (delta, rate, row, *out))
    function(delta.size, d, v, entry_rate, p, *results)


def force(law: Any, row: Array, motion: tuple[Any, Any], entry_rate: float) -> Array:
    """F (k,)."""
    out = np.zeros(np.size(motion[0]))
    _call(_ONE(law.address), row, motion, entry_rate, out)
    return out


def slopes(law: Any, row: Array, motion: tuple[Any, Any], entry_rate: float) -> Array:
    """∂F/∂δ, ∂F/∂δ̇ and ∂F/∂(entry rate), (3, k)."""
    out = np.zeros((3, np.size(motion[0])))
    _call(_THREE(law.gradient_address), row, motion, entry_rate, *out)
    return out


def by_latched(law: Any, row: Array, motion: tuple[Any, Any], entry_rate: float) -> Array:
    """∂F/∂(latched numbers), (l, k)."""
    out = np.zeros((len(law.memory), np.size(motion[0])))
    _call(_ONE(law.memory_gradient_address), row, motion, entry_rate, out)
    return out


def bend(law: Any, motion: tuple[Any, Any], entry_rate: float) -> Array | None:
    """Event function (k,) of a law's kink that is no knot: the force without its cut, or δ̇; None without one.

    Of a sum the product of those of its parts.
    """
    kind = getattr(law, "bend", None)
    if kind == "rate":
        return motion[1]
    if kind == "force":
        return uncut_force(law, motion, entry_rate)
    parts = getattr(law, "parts", ())
    if any(part.memory for part in parts):
        return None
    found = [one for part in parts if (one := bend(part, motion, entry_rate)) is not None]
    return np.prod(found, axis=0) if found else None


def uncut_force(law: Any, motion: tuple[Any, Any], entry_rate: float) -> Array:
    """Force (k,) of a law that is cut at zero without its cut."""
    return force(law.uncut, np.array(law.uncut.parameters, dtype=float), motion, entry_rate)


def margin(law: Any, row: Array, border: int, delta: float, rate: float, entry_rate: float) -> float:
    """Margin of one border."""
    out = np.zeros((law.borders, 1))
    _call(_ONE(law.borders_address), row, (np.array(delta), np.array(rate)), entry_rate, out)
    return float(out[border, 0])


def margin_slopes(
    law: Any, row: Array, border: int, delta: float, rate: float, entry_rate: float, sizes: Array
) -> Array:
    """Derivatives (2 + l,) of a margin by δ, δ̇ and the latched numbers, by differences.

    ``sizes`` (2,) are those of the terms of δ and δ̇. Latched numbers, of unknown units, have steps that change the
    margin as those of the motion.
    """
    places = list(law.memory)
    at = np.array([delta, rate, *row[places]])

    def value(x: Array) -> float:
        other = row.copy()
        other[places] = x[2:]
        return margin(law, other, border, float(x[0]), float(x[1]), entry_rate)

    here, change, found = value(at), 0.0, np.zeros(at.size)
    for i, unit in enumerate(np.eye(at.size)):
        step = _SMALL * sizes[i] if i < 2 and sizes[i] > 0.0 else _UNKNOWN
        for _ in range(_TRIALS if i >= 2 and change > 0.0 else 0):
            by_step = abs(value(at + step * unit) - here)
            if not (by_step > 2.0 * change or 0.0 < by_step < 0.5 * change):
                break
            step *= change / by_step
        step = max(step, _SHARE * abs(at[i]))
        found[i] = (value(at + step * unit) - value(at - step * unit)) / (2.0 * step)
        change = max(change, abs(found[i] * step)) if i < 2 else change
    return found


def renewed(law: Any, row: Array, border: int, delta: float, rate: float) -> Array:
    """Parameters after a renewal."""
    after = row.copy()
    renew(law, after, border, delta, rate)
    return after
