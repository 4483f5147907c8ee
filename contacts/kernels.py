"""Compiled forces of the built-in laws, cached on disk; see `contacts.law` for the C signature."""

import math

from numba import carray, cfunc, types

_REALS = types.CPointer(types.float64)
SIGNATURE = types.void(types.int64, _REALS, _REALS, types.float64, _REALS, _REALS)


@cfunc(SIGNATURE, cache=True, error_model="numpy")
def power(n, delta, delta_dot, entry_rate, parameters, force):
    """F = K d^p (1 + a v/entry_rate) + c d^r v, parameters (K, p, a, c, r, clamp)."""
    K, p, a, c, r, clamp = carray(parameters, (6,))
    rate = a / entry_rate
    for i in range(n):
        d = delta[i]
        if p == 1.5:  # the square root is several times faster than a general power
            elastic = K * d * math.sqrt(d)
        elif p == 1.0:
            elastic = K * d
        else:
            elastic = K * d**p
        total = elastic * (1.0 + rate * delta_dot[i])
        if c != 0.0:
            total += c * d**r * delta_dot[i]
        if clamp != 0.0 and total < 0.0:
            total = 0.0
        force[i] = total


@cfunc(SIGNATURE, cache=True, error_model="numpy")
def piecewise(n, delta, delta_dot, entry_rate, parameters, force):
    """Polyline force with m slopes: parameters (m, knots[m], force at knots[m], slopes[m]); knots[0] = 0."""
    m = int(parameters[0])
    table = carray(parameters, (1 + 3 * m,))
    for i in range(n):
        j = m - 1
        while j > 0 and delta[i] < table[1 + j]:
            j -= 1
        force[i] = table[1 + m + j] + table[1 + 2 * m + j] * (delta[i] - table[1 + j])
