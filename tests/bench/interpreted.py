"""Every method on small systems with the kernels run as plain Python, so that coverage sees their lines.

    NUMBA_DISABLE_JIT=1 coverage run -a tests/bench/interpreted.py

Compiled code reaches laws and arrays by their addresses; here both are found again in a table and in memory. The
results are compared with those of the compiled kernels by nobody: that is what the tests are for.
"""

from __future__ import annotations

import ctypes
import sys
from itertools import count
from pathlib import Path
from types import SimpleNamespace

import numba
import numpy as np

HOME = Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(HOME), str(HOME / "tests")]
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


numba.cfunc = cfunc
numba.carray = lambda array, shape: array[: shape[0]]

import contacts.kernels as laws  # noqa: E402
import solvers.handle as handle  # noqa: E402
import solvers.kernels as ground  # noqa: E402


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


def columns(rows, stride, first, weights, total, start, result):
    """The weighted sum of eight columns; tables and results of more dimensions are rows of numbers here."""
    here = slice(first, first + 8)
    sums = weights[:total] @ rows.reshape(-1, stride)[:total, here]
    result.reshape(-1)[here] = sums + (0.0 if start is None else start.reshape(-1)[here])


handle.opener = opener
laws._force_at, laws._gradient_at = force_at, gradient_at
ground._call_force = ground._call_gradient = at_address

import solvers.vector as vector  # noqa: E402

vector._columns = columns

import solvers  # noqa: E402
from contacts import Hertz, Hysteretic, KelvinVoigt, PiecewiseLinear, Tabulated, Viscoelastic  # noqa: E402

METHODS = [
    solvers.Exponential(1e-6),
    solvers.DormandPrince(1e-5),
    solvers.HenonRK2(2e-4, 2e-5, force_unstable=True),
    solvers.RK4(1e-4),
    solvers.RK4(1e-4, locate=False),
    solvers.CentralDifference(1e-4),
    solvers.Newmark(2e-4),
    solvers.GeneralizedAlpha(2e-4),
]
SOFT = Hysteretic.lankarani_nikravesh(2.1e5, restitution=0.5)
LAWS = [
    SOFT,
    Hertz(1e5),
    KelvinVoigt(1e3, 1.0),
    KelvinVoigt(1e3, 1.0, clamp=True),
    PiecewiseLinear([1e3, 5e3], [1e-3]),
    Hertz(1e5) + KelvinVoigt(1e3, 1.0),
    Viscoelastic.tsuji(1e5, 0.5, mass=1.0),
    Tabulated([0.0, 1e-3, 3e-3], [0.0, 1.0, 9.0]),
]


def system(law, n=2, stops=1, gap=0.0, sampled=False):
    """Decoupled modes that meet stops, shaken by a harmonic or a tabulated load."""
    omega = np.array([40.0, 170.0, 500.0])[:n]
    touches = [
        solvers.Contact((-1.0) ** i * np.array([1.0, 0.6, 0.3])[:n], law, gap=gap * (i + 1)) for i in range(stops)
    ]
    from fembeam import BandNoise, Harmonic

    signal = BandNoise(0.5, (0.0, 200.0), seed=1) if sampled else Harmonic(30.0, 60.0)
    return solvers.System.modal(omega, np.full(n, 0.02), contacts=touches, loads=[(np.ones(n), signal)])


def tried(what, *arguments, **options):
    """One run; what goes wrong is told, not raised: interpreted arithmetic is stricter."""
    try:
        return what(*arguments, **options)
    except Exception as error:
        print(f"{getattr(what, '__name__', what)}: {type(error).__name__}: {error}", file=sys.stderr)


def main():
    """All methods, laws, loads; tangents; an orbit."""
    with np.errstate(all="ignore"):
        for method in METHODS:
            for options in ({}, {"n": 3, "stops": 2, "gap": 1e-3}, {"sampled": True}, {"gap": -1e-3}):
                begin = np.zeros(options.get("n", 2))
                one = system(SOFT, **options)
                tried(solvers.integrate, one, begin, begin + 0.1, 0.02, 1e-2, method)
                tried(solvers.integrate, one, begin, begin + 0.1, 0.01, None, method)
        for law in LAWS:
            one, begin = system(law), np.zeros(2)
            for method in METHODS[:2]:
                tried(solvers.integrate, one, begin, begin + 0.1, 0.02, None, method, tangent=method is METHODS[0])
        for options in ({"n": 3, "stops": 2, "gap": 1e-3}, {"gap": -1e-3}, {"sampled": True}):
            begin = np.zeros(options.get("n", 2))
            tried(solvers.integrate, system(SOFT, **options), begin, begin + 0.1, 0.02, None, tangent=True)


if __name__ == "__main__":
    main()
