"""What laws with memory latch on a border, called from Python: the C functions of `Law` that tell."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from solvers.problem.matrices import Array

_AT: Any = ctypes.c_int64, *[ctypes.c_double] * 3, ctypes.c_void_p  # border, δ, δ̇, entry rate, parameters
_RENEW, _SLOPES = ctypes.CFUNCTYPE(ctypes.c_int64, *_AT), ctypes.CFUNCTYPE(None, *_AT, ctypes.c_void_p)


def renew(law: Any, row: Array, border: int, delta: float, rate: float) -> str:
    """Renew what a law has latched in a row of its parameters, as when a border is met; returns the event."""
    return law.events[_RENEW(law.renew_address)(border, delta, rate, 1.0, row.ctypes.data)]


def renewal_slopes(
    law: Any, row: Array, border: int = -1, delta: float = 0.0, rate: float = 0.0, entry_rate: float = 1.0
) -> Array:
    """Derivatives (l, 2 + l) of what is latched on a border by δ, δ̇ and the numbers latched before.

    Border -1 is none: the identity, with zeros for codes.
    """
    count = len(law.memory)
    out = np.zeros((count, 2 + count))
    _SLOPES(law.renew_gradient_address)(border, delta, rate, entry_rate, row.ctypes.data, out.ctypes.data)
    return out
