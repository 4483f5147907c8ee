"""Kernels run as plain Python: import this before the packages.

Compiled code reaches laws and arrays by their addresses; here both are found again in a table and in memory.
The packages have no such mode themselves: it is for coverage only. A run of two modes over ten periods takes 1.3 s
instead of 0.1 ms, its tables 23 s.
"""

from __future__ import annotations

import ctypes
import sys
from itertools import count
from pathlib import Path
from types import SimpleNamespace

import numba
import numba.np.unsafe.ndarray as ndarray
import numpy as np

HOME = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(HOME))
KNOWN, NUMBERS = {}, count(1)
ROOM = 4096  # numbers behind a pointer that may be looked at


def cfunc(*_, **__):
    """A Python function with an address of its own."""

    def made(function):
        address = next(NUMBERS)
        KNOWN[address] = function

        def called(n, *arguments):
            return function(n, *(a if isinstance(a, float) else np.ctypeslib.as_array(a, (ROOM,)) for a in arguments))

        return SimpleNamespace(address=address, ctypes=called)

    return made


def njit(*_, **__):
    """A decorator that leaves functions as they are."""
    return lambda function: function


numba.cfunc, numba.njit, numba.config.DISABLE_JIT = cfunc, njit, 0
numba.carray = lambda array, shape: array[: shape[0]]
ndarray.to_fixed_tuple = lambda array, n: tuple(array[:n])

import contacts.kernels as laws  # noqa: E402
import solvers.compiled.kernels as ground  # noqa: E402
import solvers.compiled.packed as handle  # noqa: E402


def opener(kind):
    """The named tuple at an address."""

    def opened(address):
        values, place = [], address
        for expected in kind.types:
            if not hasattr(expected, "ndim"):
                values.append(ctypes.c_double.from_address(place).value)
                place += 8
                continue
            words = (ctypes.c_int64 * (5 + expected.ndim)).from_address(place)
            kind_of_number, shape = np.dtype(str(expected.dtype)), tuple(words[5:])
            if words[2]:
                block = (ctypes.c_char * (words[2] * kind_of_number.itemsize)).from_address(words[4])
                values.append(np.frombuffer(block, dtype=kind_of_number).reshape(shape))
            else:
                values.append(np.zeros(shape, dtype=kind_of_number))
            place += 8 * (5 + 2 * expected.ndim)
        return kind.instance_class._make(values)

    return opened


def force_at(address, point, delta, delta_dot, entry_rate, parameters, offset):
    """A law for one of its points."""
    out = np.zeros(1)
    KNOWN[address](1, delta[point : point + 1], delta_dot[point : point + 1], entry_rate, parameters[offset:], out)
    return tuple(out)


def gradient_at(address, point, delta, delta_dot, entry_rate, parameters, offset):
    """Its derivatives."""
    out = np.zeros((3, 1))
    KNOWN[address](1, delta[point : point + 1], delta_dot[point : point + 1], entry_rate, parameters[offset:], *out)
    return tuple(out[:, 0])


def at_address(address, n, delta, delta_dot, entry_rate, parameters, results):
    """A law for all its points."""
    KNOWN[int(address)](n, delta, delta_dot, entry_rate, parameters, *results)


def remembered(function):
    """Responses of blocks met before, in this system or another: nearly all the time goes there."""
    known = {}

    def respond(k, c, h, rate, power, exponent, nodes, weights, gauss, out, basis):
        key = k, c, h, power, exponent  # the nodes follow from the last two
        if key not in known:
            function(k, c, h, rate, power, exponent, nodes, weights, gauss, out, basis)
            known[key] = out.copy()
        out[:] = known[key]

    return respond


def put(array, first, numbers):
    """Write eight numbers."""
    array.reshape(-1)[first : first + 8] = numbers


handle.opener = opener
laws._force_at, laws._gradient_at = force_at, gradient_at
ground.call_force = ground.call_gradient = at_address

import solvers.compiled.simd as eight  # noqa: E402

eight.eight, eight.put = lambda array, first: array.reshape(-1)[first : first + 8].copy(), put
eight.spread, eight.total = lambda number: np.full(8, number), lambda numbers: float(np.sum(numbers))
eight.root, eight.raised = np.sqrt, lambda numbers: np.maximum(numbers, 0.0)
eight.bits = lambda number: int(np.float64(number).view(np.int64))

import solvers.exponential.tables as tables  # noqa: E402

tables._block_response = remembered(tables._block_response)
