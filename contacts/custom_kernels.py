"""Compiling a user's law: its scalar function into the kernels of `contacts.law`, errors with the line they are on.

Machine code is kept under a digest of all that it is made of, so a law that is defined again, wherever, is loaded.
"""

from __future__ import annotations

import functools
import hashlib
import inspect
import math
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from pickle import PicklingError
from types import CellType, CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np

Function = Callable[..., Any]
KEPT = 300  # kernels of users' laws that stay in a folder, the last used; a law has two, one with memory six
OFF_KNOTS = 1e-12  # relative distance from a knot at which a law is on one side of it
LARGEST = 10**6  # bytes of an array that becomes a part of machine code
KNOWN = {"builtins", "cmath", "math", "numba", "numpy"}  # told by their names and versions


@lru_cache(maxsize=256)
def force_kernel(function: Function, count: int) -> Any:
    """Compile a scalar force into the batch kernel; where it raises it gives NaN, which stops a run."""
    from contacts.kernels import SIGNATURE

    scalar = inner(function)

    def forces(n, delta, delta_dot, entry_rate, values, force):
        for i in range(n):
            force[i] = scalar(delta[i], delta_dot[i], entry_rate, *values)

    return or_say_where(lambda: kept(SIGNATURE, batch_of(inner(forces), count)), function, "law")


@lru_cache(maxsize=256)
def difference_kernel(function: Function, count: int, knots: tuple[float, ...] = ()) -> Any:
    """Compile differences of a scalar force, likewise: central ones, in δ between the knots on either side."""
    scalar, ends = inner(function), (*knots, math.inf)

    def slopes(n, delta, delta_dot, entry_rate, values, by_delta, by_rate, by_entry):  # type: ignore[no-untyped-def]
        for i in range(n):
            d, v, r = delta[i], delta_dot[i], entry_rate
            h = 1e-5 * abs(d) + 1e-14  # relative to the cube root of rounding; a stop is not asked below its surface
            low, high = d - h if d < 0.0 else max(d - h, 0.0), d + h
            for knot in ends:
                if knot < d:
                    low = max(low, knot * (1.0 + OFF_KNOTS))
                elif knot < high:
                    high = knot * (1.0 - OFF_KNOTS)
            by_delta[i] = (scalar(high, v, r, *values) - scalar(low, v, r, *values)) / (high - low)
            h = 1e-5 * max(abs(v), r)
            by_rate[i] = (scalar(d, v + h, r, *values) - scalar(d, v - h, r, *values)) / (2.0 * h)
            h = 1e-5 * r
            by_entry[i] = (scalar(d, v, r + h, *values) - scalar(d, v, r - h, *values)) / (2.0 * h)

    return _gradient(slopes, count, function, "law")


@lru_cache(maxsize=256)
def derivative_kernel(derivative: Function, count: int) -> Any:
    """Compile given derivatives of a scalar force, likewise."""
    given = inner(derivative)

    def slopes(n, delta, delta_dot, entry_rate, values, by_delta, by_rate, by_entry):  # type: ignore[no-untyped-def]
        for i in range(n):
            by_delta[i], by_rate[i], by_entry[i] = given(delta[i], delta_dot[i], entry_rate, *values)

    return _gradient(slopes, count, derivative, "derivative")


def _gradient(slopes: Function, count: int, function: Function, kind: str) -> Any:
    """The kernel of slopes, or the line of the user's function that cannot be compiled."""
    from contacts.kernels import GRADIENT

    return or_say_where(lambda: kept(GRADIENT, gradient_batch(inner(slopes), count)), function, kind)


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


def inner(function: Function) -> Any:
    """A function that kernels call, compiled without the wrappers that Python would need; it raises beyond an array."""
    from numba import njit

    options = {"error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return njit(boundscheck=True, **options)(_named(function))


def kept(signature: Any, function: Function) -> Any:
    """A kernel of a user's law: loaded if the same has been compiled before, by any process, else compiled."""
    from contacts.kernels import c_function

    named = _named(function)
    return c_function(signature, named, _store() if named is not function else None)


@lru_cache(maxsize=1)
def _store() -> Any:
    """The cache of machine code of users' laws."""
    from contacts.kernels import Store

    class Laws(Store):
        """Machine code of users' laws, each in files of its own, named after its content; the last used stay."""

        def _index_key(self, sig: Any, codegen: Any) -> Any:
            return sig, codegen.magic_tuple()

        def load_overload(self, sig: Any, target_context: Any) -> Any:
            """What was kept, marked as used just now."""
            with suppress(OSError):
                os.utime(self.index)
            return super().load_overload(sig, target_context)

        def save_overload(self, sig: Any, data: Any) -> None:
            """Keep what was compiled, and drop what was not used for longest."""
            if not data.library.has_dynamic_globals:
                super().save_overload(sig, data)
                _drop_oldest(Path(self.index).parent)

    return Laws


def _drop_oldest(folder: Path) -> None:
    """Remove the kernels beyond the last used."""
    with suppress(OSError):  # another process does so, too
        for index in sorted(folder.glob("custom_kernels.*.nbi"), key=os.path.getmtime)[:-KEPT]:
            for path in folder.glob(f"{index.stem}.*"):
                path.unlink()


def frozen(function: Function) -> Function:
    """The function with what it reads at present: later changes of globals, closures and arrays do not reach it.

    Force and derivatives are compiled at different times, of the same numbers then. Itself where it has no digest.
    """
    digest = _present_digest(function)
    return function if digest is None else _frozen(function, digest)


@lru_cache(maxsize=1024)
def _frozen(function: Function, digest: str) -> Function:
    """A copy; the same one as long as the content is."""
    made = functools.update_wrapper(_copied(function, _held), function)
    del made.__wrapped__
    return made


def _held(value: Any) -> Any:
    """What a function uses, as it is at present."""
    from numba import jit
    from numba.core.dispatcher import Dispatcher

    if isinstance(value, Dispatcher):
        return jit(**value.targetoptions)(frozen(value.py_func))
    return value.copy(order="K") if isinstance(value, np.ndarray) else value


def original(function: Function, who: str) -> Function:
    """What pickle finds in another process under the function's name, or PicklingError if that is not the same."""
    module, name = function.__module__, function.__qualname__
    found = None
    with suppress(ImportError, AttributeError):
        found = at_place(module, name)
        found = getattr(found, "decorated", found)
    if inspect.isfunction(found) and (found is function or _present_digest(found) == _digest(function) is not None):
        return found
    raise PicklingError(
        f"{who} cannot be pickled: its function is found by name, and {module}.{name} is not there, or no longer what "
        "the law was made of; define it at the top of a module, and bind it again after a change"
    )


def at_place(module: str, name: str) -> Any:
    """What a module has under a name."""
    return functools.reduce(getattr, name.split("."), import_module(module))


def _named(function: Function) -> Function:
    """The function under a name that tells its content, with all it calls; itself where that is not known.

    Two functions of one name are taken for each other when machine code from several processes is loaded.
    """
    digest = _digest(function)
    if digest is None:
        return function
    named = _copied(function, _renamed)
    named.__qualname__, named.__module__ = f"{function.__name__.strip('<>')}_{digest}", __name__
    return named


def _copied(function: Function, changed: Callable[[Any], Any]) -> Function:
    """A copy of a function in which what it uses is changed."""
    found, own = function.__globals__, ("__builtins__", "__name__", "__package__", "__file__")
    used = {name: changed(found[name]) for name in _names(function.__code__) if name in found}
    kept = {name: found[name] for name in own if name in found}
    cells = tuple(CellType(changed(cell.cell_contents)) for cell in function.__closure__ or ())
    return FunctionType(function.__code__, {**kept, **used}, function.__name__, function.__defaults__, cells)


def _renamed(value: Any) -> Any:
    """What a function uses, compiled anew under such a name if it is a function that the user has compiled."""
    from numba import jit
    from numba.core.dispatcher import Dispatcher

    if isinstance(value, Dispatcher) and value.py_func.__module__ != __name__:
        options = value.targetoptions
        return jit(**{**options, "boundscheck": options.get("boundscheck") is not False})(_named(value.py_func))
    return value


@lru_cache(maxsize=1024)
def _digest(function: Function) -> str | None:
    """Digest of a function that does not change."""
    return _present_digest(function)


def _present_digest(function: Function) -> str | None:
    """Digest of what a function is made of and of the versions that compile it; None where it is not known."""
    import llvmlite
    import numba

    versions = sys.version, numba.__version__, llvmlite.__version__, np.__version__
    try:
        content = "".join(_content(function, ()))
    except (TypeError, ValueError):  # ValueError: of a variable that has no value yet
        return None
    return hashlib.sha256(f"{versions} {content}".encode()).hexdigest()[:20]


def _content(value: Any, above: tuple[Any, ...]) -> Iterator[str]:
    """All that machine code takes from a function or a value, as text; TypeError where that is not known."""
    from numba.core.dispatcher import Dispatcher

    yield f"({type(value).__name__} "
    if value is None or type(value) in (bool, int, float, complex, str, bytes):
        yield repr(value)
    elif type(value) is tuple:
        for item in value:
            yield from _content(item, above)
    elif isinstance(value, np.generic | np.ndarray) and value.dtype.kind in "biufc" and value.nbytes < LARGEST:
        yield f"{value.dtype.str} {value.shape} {value.tobytes().hex()}"
    elif isinstance(value, CodeType):
        yield f"{value.co_code.hex()} {value.co_exceptiontable.hex()} {value.co_flags} {value.co_argcount} "
        yield f"{value.co_names} {value.co_varnames} {value.co_freevars} {value.co_cellvars} "
        yield from _content(value.co_consts, above)
    elif isinstance(value, Dispatcher) and getattr(value, "_can_compile", False) and not value.locals:
        yield repr(sorted(value.targetoptions.items()))
        yield from _content(value.py_func, above)
    elif _is_known(value):
        yield f"{getattr(value, '__module__', '')} {value.__name__}"
    elif isinstance(value, FunctionType) and value not in above:  # none that calls itself
        cells = tuple(cell.cell_contents for cell in value.__closure__ or ())
        used = [(name, value.__globals__[name]) for name in _names(value.__code__) if name in value.__globals__]
        for part in (*cells, *(part for _, part in used)):
            if isinstance(part, FunctionType) and not _is_known(part):
                raise TypeError(f"{part!r} stands for what numba has as its overload")
        for part in (value.__code__, value.__defaults__, cells, *used):
            yield from _content(part, (*above, value))
    else:
        raise TypeError(f"{value!r} may change")
    yield ")"


def _names(code: CodeType) -> Iterator[str]:
    """Names that a function looks up, those of the functions within it among them."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names(constant)


def _is_known(value: Any) -> bool:
    """Whether a value is a module of those known, or what one of their names stands for."""
    name = value.__name__ if isinstance(value, ModuleType) else getattr(value, "__module__", None)
    if not isinstance(name, str) or name.partition(".")[0] not in KNOWN:
        return False
    if isinstance(value, ModuleType):
        return True
    return getattr(import_module(name), getattr(value, "__name__", ""), None) is value


def or_say_where(compile_it: Callable[[], Any], function: Function, kind: str) -> Any:
    """Compile, or say which line of the user's function cannot be."""
    from numba.core import errors

    refusals = errors.NumbaError, getattr(errors, "UnsupportedBytecodeError", errors.NumbaError)  # not in numba 0.60
    try:
        return compile_it()
    except refusals as error:
        file = inspect.getsourcefile(function)
        line, wanted = _line_of(error, function), "three numbers" if kind == "derivative" else "one number"
        raise TypeError(
            f"{kind} {function.__name__!r} ({file}, line {line}) cannot be compiled; use plain arithmetic and the math "
            f"module only, and return {wanted} from every branch. The compiler says: {error}"
        ) from error


def _line_of(error: Exception, function: Function) -> str:
    """Last line of the user's function that the compiler names, with its text; else the first."""
    import re

    first = function.__code__.co_firstlineno
    try:
        source = inspect.getsource(function).splitlines()
    except OSError:
        return str(first)
    named = [int(n) for n in re.findall(r"(?:line |\.py \()(\d+)", str(error))]
    inside = [n for n in named if first < n < first + len(source)]
    unknown = re.search(r"name '(\w+)' is not defined", str(error))
    if unknown and not inside:  # the compiler names the word, not the line
        inside = [first + i for i, text in enumerate(source) if re.search(rf"\b{unknown[1]}\b", text)][:1]
    return f"{inside[-1]}: {source[inside[-1] - first].strip()!r}" if inside else str(first)
