"""Compiling a user's law: its scalar function into the kernels of `contacts.law`, errors with the line they are on."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

Function = Callable[..., Any]


@lru_cache(maxsize=256)
def compiled(function: Function, derivative: Function | None, count: int) -> tuple[Any, Any]:
    """Compile a scalar force and its derivatives into the batch kernels; what raises gives NaN, which stops a run."""
    from numba import cfunc, njit

    from contacts.kernels import GRADIENT, SIGNATURE

    scalar = njit(error_model="numpy")(function)

    def forces(n, delta, delta_dot, entry_rate, values, force):
        for i in range(n):
            force[i] = scalar(delta[i], delta_dot[i], entry_rate, *values)

    def differences(n, delta, delta_dot, entry_rate, values, by_delta, by_rate, by_entry):  # type: ignore[no-untyped-def]
        for i in range(n):
            d, v, r = delta[i], delta_dot[i], entry_rate
            h = 1e-5 * abs(d) + 1e-14  # relative to the cube root of rounding; a stop is not asked below its surface
            low = d - h if d < 0.0 else max(d - h, 0.0)
            by_delta[i] = (scalar(d + h, v, r, *values) - scalar(low, v, r, *values)) / (d + h - low)
            h = 1e-5 * max(abs(v), r)
            by_rate[i] = (scalar(d, v + h, r, *values) - scalar(d, v - h, r, *values)) / (2.0 * h)
            h = 1e-5 * r
            by_entry[i] = (scalar(d, v, r + h, *values) - scalar(d, v, r - h, *values)) / (2.0 * h)

    slopes, source = differences, function
    if derivative is not None:
        given, source = njit(error_model="numpy")(derivative), derivative

        def slopes(n, delta, delta_dot, entry_rate, values, by_delta, by_rate, by_entry):  # type: ignore[no-untyped-def]
            for i in range(n):
                by_delta[i], by_rate[i], by_entry[i] = given(delta[i], delta_dot[i], entry_rate, *values)

    forces, slopes = njit(error_model="numpy")(forces), njit(error_model="numpy")(slopes)
    forces_kernel = or_say_where(lambda: cfunc(SIGNATURE)(batch_of(forces, count)), function, "law")
    kind = "law" if derivative is None else "derivative"
    return forces_kernel, or_say_where(lambda: cfunc(GRADIENT)(gradient_batch(slopes, count)), source, kind)


def batch_of(forces: Any, count: int) -> Function:
    """The batch kernel of a law; forces from where it raises are NaN."""
    from numba import carray
    from numba.np.unsafe.ndarray import to_fixed_tuple

    def batch(n, delta, delta_dot, entry_rate, parameters, force):
        for i in range(n):
            force[i] = math.nan
        values = to_fixed_tuple(carray(parameters, (count,)), count)
        try:
            forces(n, delta, delta_dot, entry_rate, values, force)
        except Exception:
            return

    return batch


def gradient_batch(slopes: Any, count: int) -> Function:
    """The batch kernel of a law's derivatives, likewise."""
    from numba import carray
    from numba.np.unsafe.ndarray import to_fixed_tuple

    def batch(n, delta, delta_dot, entry_rate, parameters, by_delta, by_rate, by_entry):  # type: ignore[no-untyped-def]
        for i in range(n):
            by_delta[i] = by_rate[i] = by_entry[i] = math.nan
        values = to_fixed_tuple(carray(parameters, (count,)), count)
        try:
            slopes(n, delta, delta_dot, entry_rate, values, by_delta, by_rate, by_entry)
        except Exception:
            return

    return batch


def or_say_where(compile_it: Callable[[], Any], function: Function, kind: str) -> Any:
    """Compile, or say which line of the user's function cannot be."""
    from numba.core.errors import NumbaError

    try:
        return compile_it()
    except NumbaError as error:
        file = inspect.getsourcefile(function)
        line = _line_of(error, function)
        raise TypeError(
            f"{kind} {function.__name__!r} ({file}, line {line}) cannot be compiled; use plain arithmetic and the math "
            f"module only, and return one number from every branch. The compiler says: {error}"
        ) from error


def _line_of(error: Exception, function: Function) -> str:
    """Last line of the user's function that the compiler names, with its text; else the first."""
    import re

    first = function.__code__.co_firstlineno
    try:
        source = inspect.getsource(function).splitlines()
    except OSError:
        return str(first)
    named = [int(n) for n in re.findall(r"line (\d+)", str(error))]
    inside = [n for n in named if first < n < first + len(source)]
    unknown = re.search(r"name '(\w+)' is not defined", str(error))
    if unknown and not inside:  # the compiler names the word, not the line
        inside = [first + i for i, text in enumerate(source) if re.search(rf"\b{unknown[1]}\b", text)][:1]
    return f"{inside[-1]}: {source[inside[-1] - first].strip()!r}" if inside else str(first)
