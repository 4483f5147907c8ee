"""Compiled forces of the built-in laws, cached on disk; see `contacts.law` for the C signature."""

import math

from numba import carray, cfunc, types

_REALS = types.CPointer(types.float64)
SIGNATURE = types.void(types.int64, _REALS, _REALS, types.float64, _REALS, _REALS)
GRADIENT = types.void(types.int64, _REALS, _REALS, types.float64, _REALS, _REALS, _REALS, _REALS)


@cfunc(SIGNATURE, cache=True, error_model="numpy")
def power(n, delta, delta_dot, entry_rate, parameters, force):
    """F = K d^p (1 + a v/entry_rate) + c d^r v, parameters (K, p, a, c, r, clamp)."""
    K, p, a, c, r, clamp = carray(parameters, (6,))
    rate = a / entry_rate
    if p == 1.5:  # loops without a branch are vectorised; the square root is several times faster than a power
        for i in range(n):
            force[i] = K * delta[i] * math.sqrt(delta[i]) * (1.0 + rate * delta_dot[i])
    elif p == 1.0:
        for i in range(n):
            force[i] = K * delta[i] * (1.0 + rate * delta_dot[i])
    else:
        for i in range(n):
            force[i] = K * delta[i] ** p * (1.0 + rate * delta_dot[i])
    if c != 0.0:
        for i in range(n):
            force[i] += c * delta[i] ** r * delta_dot[i]
    if clamp != 0.0:
        for i in range(n):
            if force[i] < 0.0:
                force[i] = 0.0


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


@cfunc(GRADIENT, cache=True, error_model="numpy")
def power_gradient(n, delta, delta_dot, entry_rate, parameters, by_delta, by_rate, by_entry):
    """Derivatives of `power` with respect to d, v and the entry rate."""
    K, p, a, c, r, clamp = carray(parameters, (6,))
    rate = a / entry_rate
    for i in range(n):
        d, v = delta[i], delta_dot[i]
        elastic, damping = K * d**p, c * d**r
        by_delta[i] = K * p * d ** (p - 1.0) * (1.0 + rate * v)
        if c * r != 0.0:
            by_delta[i] += c * r * d ** (r - 1.0) * v
        by_rate[i] = elastic * rate + damping
        by_entry[i] = -elastic * rate * v / entry_rate
        if clamp != 0.0 and elastic * (1.0 + rate * v) + damping * v < 0.0:
            by_delta[i], by_rate[i], by_entry[i] = 0.0, 0.0, 0.0


@cfunc(GRADIENT, cache=True, error_model="numpy")
def piecewise_gradient(n, delta, delta_dot, entry_rate, parameters, by_delta, by_rate, by_entry):
    """Derivatives of `piecewise`: the slope."""
    m = int(parameters[0])
    table = carray(parameters, (1 + 3 * m,))
    for i in range(n):
        j = m - 1
        while j > 0 and delta[i] < table[1 + j]:
            j -= 1
        by_delta[i], by_rate[i], by_entry[i] = table[1 + 2 * m + j], 0.0, 0.0
