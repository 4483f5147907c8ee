"""What a contact law is, and how to write one's own.

A law is a force ``F(delta, delta_dot, entry_rate; parameters)`` for ``delta > 0``. Integrators call it
through the address of one compiled function with a declared C signature,

    void kernel(int64 n, double *delta, double *delta_dot, double entry_rate, double *parameters, double *force)
    void gradient(..., double *parameters, double *by_delta, double *by_rate, double *by_entry_rate)

so a new law never recompiles an integrator, and a batch of ``n`` values costs one call.
"""

from __future__ import annotations

import inspect
import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

ENTRY_RATE_FLOOR = 1e-3
"""Smallest entry rate a law is given by default, m/s: a/entry_rate is singular at grazing."""

_ARGUMENTS = ("delta", "delta_dot", "entry_rate")


class Law(ABC):
    """A contact law: everything an integrator needs to know about a stop's force.

    Attributes
    ----------
    knots : indentations (m, ascending, > 0) where the force or its slope has a kink.
    jump : whether the force jumps when contact begins, F(0+, v) != 0.
    exponent : leading exponent p of F ~ delta**p at first touch; integrators choose their variable by it.
    entry_rate_floor : entry rates below it (m/s) are raised to it before the law sees them.
    """

    knots: tuple[float, ...] = ()
    jump: bool = False
    exponent: float = 1.0
    entry_rate_floor: float = ENTRY_RATE_FLOOR

    @property
    @abstractmethod
    def parameters(self) -> NDArray[np.float64]:
        """The numbers handed to the compiled kernel."""

    @property
    @abstractmethod
    def kernel(self) -> Any:
        """The compiled force (a numba ``cfunc``) with the module's C signature."""

    @property
    @abstractmethod
    def gradient(self) -> Any:
        """The compiled derivatives of the force, likewise."""

    @property
    def address(self) -> int:
        """Address of the compiled force."""
        return int(self.kernel.address)

    @property
    def gradient_address(self) -> int:
        """Address of the compiled derivatives."""
        return int(self.gradient.address)

    def force(self, delta: ArrayLike, delta_dot: ArrayLike = 0.0, entry_rate: ArrayLike = 1.0) -> NDArray[np.float64]:
        """Contact force in N, zero where ``delta <= 0``.

        Parameters
        ----------
        delta, delta_dot, entry_rate : indentation (m), its rate and the rate at entry (m/s); they broadcast.

        Returns
        -------
        Force with the broadcast shape, positive when repulsive. NaN in, NaN out.
        """
        d, v, r = np.broadcast_arrays(*(np.asarray(x, dtype=float) for x in (delta, delta_dot, entry_rate)))
        out = np.where(np.isnan(d + v + r), math.nan, 0.0)
        touching = np.flatnonzero((d > 0.0) & ~np.isnan(out))
        touching = touching[np.argsort(r.flat[touching], kind="stable")]
        rates, starts = np.unique(r.flat[touching], return_index=True)
        for rate, start, count in zip(rates, starts, np.diff(starts, append=len(touching)), strict=True):
            chosen = touching[start : start + count]
            out.flat[chosen] = self._batch(d.flat[chosen], v.flat[chosen], float(rate))
        return out[()]

    def _batch(self, delta: NDArray, delta_dot: NDArray, entry_rate: float) -> NDArray:
        """Kernel call on contiguous arrays at one entry rate."""
        import ctypes

        pointer = ctypes.POINTER(ctypes.c_double)
        arrays = [np.ascontiguousarray(x, dtype=float) for x in (delta, delta_dot, self.parameters)]
        force = np.empty(arrays[0].size)
        d, v, p, f = (x.ctypes.data_as(pointer) for x in (*arrays, force))
        self.kernel.ctypes(force.size, d, v, max(entry_rate, self.entry_rate_floor), p, f)
        return force


def number(owner: object, name: str, low: float = 0.0, *, strict: bool = False) -> None:
    """Check one finite parameter of a law against its lower bound."""
    value = getattr(owner, name)
    fine = isinstance(value, (int, float, np.number)) and math.isfinite(value)
    if not fine or value < low or (strict and value == low):
        bound = f"{'>' if strict else '>='} {low:g}"
        raise ValueError(f"{name} of {type(owner).__name__} must be finite and {bound}, got {value!r}")


@dataclass(frozen=True)
class CustomLaw(Law):
    """A user's force function with its parameters bound; made by calling a function decorated with `law`."""

    name: str
    function: Callable[..., float] = field(repr=False)
    values: tuple[tuple[str, float], ...]
    knots: tuple[float, ...] = ()
    jump: bool = False
    exponent: float = 1.0
    entry_rate_floor: float = ENTRY_RATE_FLOOR

    @property
    def parameters(self) -> NDArray[np.float64]:
        """Bound values in the order of the function's signature."""
        return np.array([value for _, value in self.values], dtype=float)

    @property
    def kernel(self) -> Any:
        """The function compiled once per process."""
        return _compiled(self.function, len(self.values))[0]

    @property
    def gradient(self) -> Any:
        """Central differences of the function, compiled."""
        return _compiled(self.function, len(self.values))[1]

    def __reduce__(self) -> tuple:
        """Pickle by the decorated function's name, so that laws travel to worker processes."""
        return _rebind, (self.function.__module__, self.function.__qualname__, self.values)


def _rebind(module: str, qualname: str, values: tuple[tuple[str, float], ...]) -> CustomLaw:
    """Find the decorated function again and bind its parameters."""
    found: Any = import_module(module)
    for part in qualname.split("."):
        found = getattr(found, part)
    return found(**dict(values))


def law(
    function: Callable[..., float] | None = None,
    *,
    knots: tuple[float, ...] = (),
    jump: bool = False,
    exponent: float = 1.0,
    entry_rate_floor: float = ENTRY_RATE_FLOOR,
) -> Any:
    """Turn a plain function into a contact law.

    The function gives the force for ``delta > 0``. It is compiled by numba, once, and no integrator is
    recompiled for it.

    Parameters
    ----------
    function : ``f(delta, delta_dot, entry_rate, parameter, ...) -> force``; further arguments are the law's
        parameters, bound by keyword; defaults are kept.
    knots : indentations (m) where the force has a kink; integrators land on them.
    jump : say True when the force is not zero at the instant of entry.
    exponent : leading exponent of the force at first touch.
    entry_rate_floor : smallest entry rate handed to the function, m/s.

    Returns
    -------
    A maker: call it with the parameters to get a `CustomLaw`.

    Raises
    ------
    TypeError for a signature that does not begin with ``delta, delta_dot, entry_rate``, and on binding for
    missing or unknown parameters; ValueError on binding for a force that is not finite.

    Examples
    --------
    >>> @law
    ... def cubic(delta, delta_dot, entry_rate, stiffness):
    ...     return stiffness * delta**3
    >>> float(cubic(stiffness=1e9).force(2e-3))
    8.0
    """
    if function is None:
        return lambda f: law(f, knots=knots, jump=jump, exponent=exponent, entry_rate_floor=entry_rate_floor)
    signature = inspect.signature(function)
    names = tuple(signature.parameters)
    if names[:3] != _ARGUMENTS:
        raise TypeError(
            f"law {function.__name__!r} must take ({', '.join(_ARGUMENTS)}, parameters...), got ({', '.join(names)})"
        )
    _check_knots(function.__name__, knots)
    probe = inspect.Signature(list(signature.parameters.values())[3:])

    def bind(**values: float) -> CustomLaw:
        unknown = [name for name in values if name not in probe.parameters]
        if unknown:
            raise TypeError(
                f"law {function.__name__!r}: unexpected {unknown[0]!r}; its parameters are {list(names[3:])}"
            )
        try:
            bound = probe.bind(**values)
        except TypeError as error:
            raise TypeError(f"law {function.__name__!r}: {error}; its parameters are {list(names[3:])}") from None
        bound.apply_defaults()
        pairs = tuple((key, float(value)) for key, value in bound.arguments.items())
        made = CustomLaw(function.__name__, function, pairs, tuple(map(float, knots)), jump, exponent, entry_rate_floor)
        _check_force(made)
        return made

    bind.__name__, bind.__qualname__ = function.__name__, function.__qualname__
    bind.__doc__, bind.__module__ = function.__doc__, function.__module__
    return bind


def _check_knots(name: str, knots: tuple[float, ...]) -> None:
    """Knots ascend and are positive."""
    values = np.asarray(knots, dtype=float)
    if not (np.all(np.isfinite(values)) and np.all(np.diff(values, prepend=0.0) > 0.0)):
        raise ValueError(f"knots of law {name!r} must be positive, finite and ascending, got {knots}")


def _check_force(made: CustomLaw) -> None:
    """Evaluate the law at rest, so that a NaN is met before any run."""
    bad = [(key, value) for key, value in made.values if not math.isfinite(value)]
    if bad:
        raise ValueError(f"parameter {bad[0][0]} of law {made.name!r} must be finite, got {bad[0][1]}")
    delta = np.array([1e-9, 1e-6, 1e-3])
    with np.errstate(all="ignore"):
        force = made.force(delta, 0.0, 1.0)
    if not np.all(np.isfinite(force)):
        where = delta[~np.isfinite(force)][0]
        raise ValueError(
            f"law {made.name!r} gives a force of {force[~np.isfinite(force)][0]} at delta = {where:g} m, "
            f"delta_dot = 0 with {dict(made.values)}; a law must be finite for delta > 0"
        )


@lru_cache(maxsize=256)
def _compiled(function: Callable[..., float], count: int) -> tuple[Any, Any]:
    """Compile a scalar force into the batch kernels of the declared signatures."""
    from numba import carray, cfunc, njit
    from numba.core.errors import NumbaError
    from numba.np.unsafe.ndarray import to_fixed_tuple

    from contacts.kernels import GRADIENT, SIGNATURE

    scalar = njit(error_model="numpy")(function)

    def batch(n, delta, delta_dot, entry_rate, parameters, force):
        values = to_fixed_tuple(carray(parameters, (count,)), count)
        for i in range(n):
            force[i] = scalar(delta[i], delta_dot[i], entry_rate, *values)

    def differences(n, delta, delta_dot, entry_rate, parameters, by_delta, by_rate, by_entry):  # type: ignore[no-untyped-def]
        values = to_fixed_tuple(carray(parameters, (count,)), count)
        for i in range(n):
            d, v, r = delta[i], delta_dot[i], entry_rate
            h = 1e-5 * d + 1e-14  # relative to the cube root of rounding; below the surface the law is not asked
            low = max(d - h, 0.0)
            by_delta[i] = (scalar(d + h, v, r, *values) - scalar(low, v, r, *values)) / (d + h - low)
            h = 1e-5 * max(abs(v), r)
            by_rate[i] = (scalar(d, v + h, r, *values) - scalar(d, v - h, r, *values)) / (2.0 * h)
            h = 1e-5 * r
            by_entry[i] = (scalar(d, v, r + h, *values) - scalar(d, v, r - h, *values)) / (2.0 * h)

    try:
        return cfunc(SIGNATURE)(batch), cfunc(GRADIENT)(differences)
    except NumbaError as error:
        source = inspect.getsourcefile(function)
        raise TypeError(
            f"law {function.__name__!r} ({source}, line {function.__code__.co_firstlineno}) cannot be compiled; "
            f"use plain arithmetic and the math module only. The compiler says: {error}"
        ) from error
