"""Compiled forces of the built-in laws and their derivatives, cached; see `contacts.law` for the C signature."""

import logging
import math
import os
import threading
from contextlib import suppress
from functools import partial

from numba import carray, cfunc, config, njit, types
from numba.core.caching import FunctionCache
from numba.core.ccallback import CFunc
from numba.core.sigutils import normalize_signature

REALS = types.CPointer(types.float64)
SIGNATURE = types.void(types.int64, REALS, REALS, types.float64, REALS, REALS)
GRADIENT = types.void(types.int64, REALS, REALS, types.float64, REALS, REALS, REALS, REALS)

if config.DISABLE_JIT:
    raise RuntimeError("NUMBA_DISABLE_JIT is set, but contact laws run as machine code only: unset it")


class Kernel:
    """A C function that is compiled, or loaded, when its address or another attribute is asked for."""

    def __init__(self, make):
        self._make, self._lock, self._made = make, threading.Lock(), None

    def __getattr__(self, name):
        with self._lock:
            self._made = self._made or self._make()
        return getattr(self._made, name)


class Store(FunctionCache):
    """numba's cache of one function; what cannot be kept or read is compiled, and that nothing is kept is said once."""

    told = False

    def load_overload(self, sig, target_context):
        """What was kept, or None; a file that is damaged is written anew."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # of whatever a damaged file is taken for
            self._forget()

    def save_overload(self, sig, data):
        """Keep what was compiled."""
        try:
            super().save_overload(sig, data)
        except OSError as error:
            self._forget()  # the index may name a file that was not written, but is there from other sources
            if not Store.told:
                Store.told = True
                logging.getLogger("fembeam.contacts").warning("contact laws are compiled but not kept: %s", error)

    def _forget(self):
        with suppress(OSError):
            os.unlink(self.index)

    @property
    def index(self):
        """The file that tells what is kept."""
        return os.path.join(self.cache_path, f"{self._impl.filename_base}.nbi")


def stored(made, store, function):
    """Have a function of numba's keep its machine code, where there is a folder that can be written to."""
    with suppress(RuntimeError):  # none: then each process compiles for a second
        made._cache = store(function)
    return made


def c_function(signature, function, store=Store):
    """A C function, compiled or loaded; ``store`` is the class of its cache, None for none."""
    made = CFunc(function, normalize_signature(signature), {}, {"error_model": "numpy"})
    if store is not None:
        stored(made, store, function)
    made.compile()
    return made


def compiled(decorator, *signature):
    """The decorator with our options; machine code is kept.

    numba looks whether this file has changed: that is enough, since all that these functions call is in it.
    """
    if decorator is cfunc:
        return lambda function: Kernel(partial(c_function, *signature, function))
    return lambda function: stored(njit(error_model="numpy")(function), Store, function)


_force = compiled(cfunc, SIGNATURE)
_gradient = compiled(cfunc, GRADIENT)


@compiled(njit)
def _raised(x, exponent):
    """x^exponent, of the exponents that most laws have without the power function, which takes ten times as long."""
    if exponent == 0.0:
        return 1.0
    if exponent == 0.25:
        return math.sqrt(math.sqrt(x))
    if exponent == 0.5:
        return math.sqrt(x)
    if exponent == 1.0:
        return x
    if exponent == 1.5:
        return x * math.sqrt(x)
    return x**exponent


@_force
def power(n, delta, delta_dot, entry_rate, parameters, force):
    """F = K d^p (1 + a v/entry_rate) + c d^r v, parameters (K, p, a, c, r, clamp, approach)."""
    K, p, a, c, r, clamp, approach = carray(parameters, (7,))
    rate = a / entry_rate
    if p == 1.5:  # loops without a branch are vectorised
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
            if approach == 0.0 or delta_dot[i] > 0.0:
                force[i] += c * _raised(delta[i], r) * delta_dot[i]
    if clamp != 0.0:
        for i in range(n):
            if force[i] < 0.0:
                force[i] = 0.0


@_gradient
def power_gradient(n, delta, delta_dot, entry_rate, parameters, by_delta, by_rate, by_entry):
    """Derivatives of `power` with respect to d, v and the entry rate."""
    K, p, a, c, r, clamp, approach = carray(parameters, (7,))
    rate = a / entry_rate
    for i in range(n):
        d, v = delta[i], delta_dot[i]
        viscosity = 0.0 if approach != 0.0 and v <= 0.0 else c
        elastic, slope = K * _raised(d, p), K * p * _raised(d, p - 1.0)
        damping = viscosity * _raised(d, r) if viscosity != 0.0 else 0.0
        by_delta[i] = slope * (1.0 + rate * v)
        if viscosity * r != 0.0 and d > 0.0:  # at the surface itself the slope is infinite
            by_delta[i] += viscosity * r * d ** (r - 1.0) * v
        by_rate[i] = elastic * rate + damping
        by_entry[i] = -elastic * rate * v / entry_rate
        if clamp != 0.0 and elastic * (1.0 + rate * v) + damping * v < 0.0:
            by_delta[i], by_rate[i], by_entry[i] = 0.0, 0.0, 0.0


@compiled(njit)
def _horner(coefficients, first, count, x):
    """Value and slope at x of the polynomial with ``count`` coefficients from ``first`` on, the constant first."""
    value, slope = coefficients[first + count - 1], 0.0
    for i in range(count - 2, -1, -1):
        slope = slope * x + value
        value = value * x + coefficients[first + i]
    return value, slope


@compiled(njit)
def _piece(table, m, d, v):
    """Place in the table of the piece that holds d, by bisection."""
    # on a knot, to rounding, the piece it comes from: the dashpot may jump there, and steps end on knots
    seen = d * (1.0 + 1e-11) if v < 0.0 else d * (1.0 - 1e-11)
    low, high = 0, m
    while high - low > 1:
        middle = (low + high) // 2
        if seen < table[1 + 6 * middle]:
            high = middle
        else:
            low = middle
    return 1 + 6 * low


@_force
def piecewise(n, delta, delta_dot, entry_rate, parameters, force):
    """Piecewise cubic with a dashpot per piece: parameters (m, 6 numbers per piece).

    A piece is (knot, c0, c1, c2, c3, viscosity): F = c0 + x (c1 + x (c2 + x c3)) + viscosity v with x = d - knot.
    """
    m = int(parameters[0])
    table = carray(parameters, (1 + 6 * m,))
    for i in range(n):
        d, v = delta[i], delta_dot[i]
        j = _piece(table, m, d, v)
        force[i] = _horner(table, j + 1, 4, d - table[j])[0] + table[j + 5] * v


@_gradient
def piecewise_gradient(n, delta, delta_dot, entry_rate, parameters, by_delta, by_rate, by_entry):
    """Derivatives of `piecewise`."""
    m = int(parameters[0])
    table = carray(parameters, (1 + 6 * m,))
    for i in range(n):
        d = delta[i]
        j = _piece(table, m, d, delta_dot[i])
        by_delta[i] = _horner(table, j + 1, 4, d - table[j])[1]
        by_rate[i], by_entry[i] = table[j + 5], 0.0


@_force
def polynomial(n, delta, delta_dot, entry_rate, parameters, force):
    """F = d (c_1 + c_2 d + ... + c_k d^(k-1)), parameters (k, c_1, ..., c_k)."""
    k = int(parameters[0])
    coefficients = carray(parameters, (1 + k,))
    for i in range(n):
        force[i] = delta[i] * _horner(coefficients, 1, k, delta[i])[0]


@_gradient
def polynomial_gradient(n, delta, delta_dot, entry_rate, parameters, by_delta, by_rate, by_entry):
    """Derivatives of `polynomial`."""
    k = int(parameters[0])
    coefficients = carray(parameters, (1 + k,))
    for i in range(n):
        value, slope = _horner(coefficients, 1, k, delta[i])
        by_delta[i], by_rate[i], by_entry[i] = value + delta[i] * slope, 0.0, 0.0
