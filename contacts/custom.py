"""How to write one's own law: a plain function under ``@law``."""

from __future__ import annotations

import inspect
import math
import warnings
from dataclasses import dataclass, field, fields, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from contacts.custom_kernels import (
    Function,
    at_place,
    derivative_kernel,
    difference_kernel,
    force_kernel,
    frozen,
    original,
)
from contacts.law import ENTRY_RATE_FLOOR, Law
from contacts.numbers import LARGEST_EXPONENT, check_number, reals

_ARGUMENTS = ("delta", "delta_dot", "entry_rate")
_PROBES = np.array([1e-9, 1e-6, 1e-3])
"""Indentations (m) at which a law is tried out when its parameters are bound."""


@dataclass(frozen=True)
class CustomLaw(Law):
    """A user's force function with its parameters bound; made by calling a function decorated with `law`; see there."""

    name: str
    function: Function = field(repr=False)
    values: tuple[tuple[str, float], ...]
    knots: tuple[float, ...] = ()
    jump: bool = False
    exponent: float = 1.0
    entry_rate_floor: float = ENTRY_RATE_FLOOR
    derivative: Function | None = field(default=None, repr=False)

    one_sided: ClassVar[bool] = False  # type: ignore[misc]
    varied: ClassVar[tuple[str, ...]] = ("entry_rate_floor",)  # beside its parameters

    def rebound(self, **values: float) -> CustomLaw:
        """The same law with other values of some parameters, checked as when it was bound."""
        found = self.exponent == _leading_exponent(self)
        return _checked(replace(self, values=changed_values(self, values)), found)

    @property
    def parameters(self) -> NDArray[np.float64]:
        """Bound values in the order of the function's signature."""
        return np.array([value for _, value in self.values], dtype=float)

    @property
    def kernel(self) -> Any:
        """The compiled function."""
        return force_kernel(self.function, len(self.values))

    @property
    def gradient(self) -> Any:
        """Its derivatives as given, else differences, compiled."""
        if self.derivative is None:
            return difference_kernel(self.function, len(self.values), self.knots)
        return derivative_kernel(self.derivative, len(self.values))

    @property
    def equation(self) -> str:  # type: ignore[override]
        """First line of the function's docstring, or its call."""
        doc = inspect.getdoc(self.function)
        names = ", ".join(inspect.signature(self.function).parameters)
        return doc.splitlines()[0] if doc else f"F = {self.name}({names})"

    def __reduce__(self) -> tuple:
        """Pickle by the function's name, so that laws travel to worker processes; it stands for what was decorated."""
        who = f"law {self.name!r}"
        function = original(self.function, who)
        place = function.__module__, function.__qualname__
        if at_place(*place) is not function:
            return _rebind, (*place, self.values)
        slopes = None if self.derivative is None else original(self.derivative, who)  # ``law(function)``
        made = replace(self, function=function, derivative=slopes)
        return _frozen_law, tuple(getattr(made, one.name) for one in fields(made))


def _rebind(module: str, qualname: str, values: tuple[tuple[str, float], ...]) -> CustomLaw:
    """Find the decorated function again and bind its parameters."""
    return at_place(module, qualname)(**dict(values))  # type: ignore[no-any-return]


def _frozen_law(*parts: Any) -> CustomLaw:
    """A law of functions as they are at present."""
    made = CustomLaw(*parts)
    slopes = None if made.derivative is None else frozen(made.derivative)
    return replace(made, function=frozen(made.function), derivative=slopes)


def law(
    function: Function | None = None,
    *,
    knots: tuple[float, ...] = (),
    jump: bool = False,
    exponent: float | None = None,
    entry_rate_floor: float = ENTRY_RATE_FLOOR,
    derivative: Function | None = None,
) -> Any:
    """Turn a plain function into a contact law.

    The function gives the force for ``delta > 0``. It is compiled by numba, once, and no integrator is
    recompiled for it; later processes load it, unless it uses lists, objects or other modules than math and numpy.

    Parameters
    ----------
    function : ``f(delta, delta_dot, entry_rate, parameter, ...) -> force``; further arguments are the law's
        parameters, bound by keyword; defaults are kept.
    knots : indentations (m) where the force has a kink or jumps; integrators locate them.
    jump : say True when the force is not zero at the instant of entry.
    exponent : leading exponent of the force at first touch; None finds it when parameters are bound.
    entry_rate_floor : smallest entry rate handed to the function, m/s.
    derivative : function of the same arguments that returns (∂F/∂delta, ∂F/∂delta_dot, ∂F/∂entry_rate); None takes
        differences, which end at knots.

    Returns
    -------
    A maker: call it with the parameters to get a `CustomLaw`.

    Raises
    ------
    TypeError for a signature that does not begin with ``delta, delta_dot, entry_rate`` or has other than plain
    arguments, for a function that cannot be compiled (with the line), and on binding for missing or unknown
    parameters. ValueError for knots, an exponent or a floor out of range, and on binding for a force that is NaN or
    negative at rest, that jumps at δ = 0 without ``jump=True``, or whose derivative is not that of the force.

    Examples
    --------
    >>> @law
    ... def cubic(delta, delta_dot, entry_rate, stiffness):
    ...     return stiffness * delta**3
    >>> float(cubic(stiffness=1e9).force(2e-3))
    8.0
    """
    if function is None:
        return lambda f: law(
            f, knots=knots, jump=jump, exponent=exponent, entry_rate_floor=entry_rate_floor, derivative=derivative
        )
    if not inspect.isfunction(function):
        raise TypeError(f"@law decorates a plain function, got {function!r}")
    who = function.__name__
    names = _checked_names(function, f"law {who!r}")
    if not (derivative is None or inspect.isfunction(derivative)):
        raise TypeError(f"derivative of law {who!r} must be a plain function, got {derivative!r}")
    if derivative is not None and _checked_names(derivative, f"derivative of law {who!r}") != names:
        raise TypeError(f"derivative of law {who!r} must take the law's arguments, ({', '.join(names)})")
    if not isinstance(jump, bool):
        raise ValueError(f"jump of law {who!r} must be True or False, got {jump!r}")
    options = _checked_knots(who, knots), jump
    floor = check_number(entry_rate_floor, f"entry_rate_floor of law {who!r}")
    given = 1.0 if exponent is None else exponent
    power = check_number(given, f"exponent of law {who!r}", strict=True, most=LARGEST_EXPONENT)
    probe = inspect.Signature(list(inspect.signature(function).parameters.values())[3:])

    def bind(**values: float) -> CustomLaw:
        pairs = bound_values(who, probe, values)
        return _checked(_frozen_law(who, function, pairs, *options, power, floor, derivative), exponent is None)

    bind.__name__, bind.__qualname__ = function.__name__, function.__qualname__
    bind.__doc__, bind.__module__ = function.__doc__, function.__module__
    bind.decorated = function  # type: ignore[attr-defined]
    bind.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [p.replace(kind=inspect.Parameter.KEYWORD_ONLY) for p in probe.parameters.values()]
    )
    return bind


def _checked_names(function: Function, who: str) -> tuple[str, ...]:
    """Argument names of a law's function, which must be plain and begin with the three of every law."""
    parameters = inspect.signature(function).parameters
    names = tuple(parameters)
    if names[:3] != _ARGUMENTS:
        raise TypeError(f"{who} must take ({', '.join(_ARGUMENTS)}, parameters...), got ({', '.join(names)})")
    odd = [p for p in parameters.values() if p.kind is not p.POSITIONAL_OR_KEYWORD]
    if odd:
        raise TypeError(f"{who} must take plain arguments only, got {str(odd[0])!r}; name every parameter")
    if parameters["entry_rate"].default is not inspect.Parameter.empty:
        raise TypeError(f"{who}: delta, delta_dot and entry_rate are given by the integrator and have no default")
    return names


def bound_values(who: str, probe: inspect.Signature, values: dict[str, Any]) -> tuple[tuple[str, float], ...]:
    """Parameters of a law by name, defaults filled in, as finite numbers."""
    names = list(probe.parameters)
    unknown = [name for name in values if name not in probe.parameters]
    if unknown:
        raise TypeError(f"law {who!r}: unexpected {unknown[0]!r}; its parameters are {names}")
    try:
        bound = probe.bind(**values)
    except TypeError as error:
        raise TypeError(f"law {who!r}: {error}; its parameters are {names}") from None
    bound.apply_defaults()
    checked = {key: check_number(x, f"parameter {key} of law {who!r}", -math.inf) for key, x in bound.arguments.items()}
    return tuple(checked.items())


def changed_values(law: Any, values: dict[str, float]) -> tuple[tuple[str, float], ...]:
    """The bound values of a law, some of them changed, as finite numbers."""
    return tuple(
        (key, check_number(values.get(key, one), f"parameter {key} of law {law.name!r}", -math.inf))
        for key, one in law.values
    )


def _checked(made: CustomLaw, finds_exponent: bool) -> CustomLaw:
    """A law that was tried out, with the exponent that it has if none was given."""
    _check_force(made)
    _check_jump(made)
    _warn_of_sticking(made)
    if made.derivative is not None:
        _check_derivative(made)
    return replace(made, exponent=_leading_exponent(made)) if finds_exponent and not made.jump else made


def _checked_knots(name: str, knots: Any) -> tuple[float, ...]:
    """Knots ascend and are positive."""
    values = reals(knots, f"knots of law {name!r}")
    if values.ndim != 1 or not (np.all(np.isfinite(values)) and np.all(np.diff(values, prepend=0.0) > 0.0)):
        raise ValueError(f"knots of law {name!r} must be positive, finite and ascending, got {knots}")
    return tuple(values.tolist())


def _check_force(made: CustomLaw) -> None:
    """Evaluate the law at rest, so that a NaN or a pull is met before any run."""
    with np.errstate(all="ignore"):
        force = made.force(_PROBES, 0.0, 1.0)
    wrong = ~np.isfinite(force) | (force < 0.0)
    if np.any(wrong):
        where, value = _PROBES[wrong][0], force[wrong][0]
        need = "must not pull at rest" if np.isfinite(value) else "must be finite for delta > 0"
        raise ValueError(
            f"law {made.name!r} gives a force of {value} at delta = {where:g} m, "
            f"delta_dot = 0 with {dict(made.values)}; a law {need}"
        )


def _check_jump(made: CustomLaw) -> None:
    """A force that does not tend to zero with delta must be declared."""
    if made.jump:
        return
    for rate in (0.0, 1.0):
        near, nearer = np.abs(made.force([1e-12, 1e-18], rate, 1.0))
        if nearer > 0.5 * near and nearer > 1e-12 * np.abs(made.force(1e-3, rate, 1.0)):
            raise ValueError(
                f"law {made.name!r} jumps to {nearer:g} N at delta = 0+ with delta_dot = {rate:g} m/s; "
                "declare it with @law(jump=True), so that integrators locate it; a law of an Element, too, is bound "
                "so, and loses nothing by it"
            )


def _warn_of_sticking(made: CustomLaw) -> None:
    """Warn of a force that jumps with the sign of the rate, between whose two values a place comes to rest."""
    ends = np.array([made.force(_PROBES, rate, 1.0) for rate in (1e-12, -1e-12, 1e-15, -1e-15)])
    far, jump = np.abs(ends[::2] - ends[1::2])
    if np.any((jump > 0.5 * far) & (jump > 1e-3 * np.abs(ends).max(axis=0))):
        where = int(np.argmax(jump))
        warnings.warn(
            f"force of law {made.name!r} jumps by {jump[where]:.6g} N with the sign of the rate at delta = "
            f"{_PROBES[where]:g} m: where a place sticks by that a run ends as stalled; write a contacts.memory_law",
            stacklevel=4,
        )


def _leading_exponent(made: CustomLaw) -> float:
    """Local exponent at rest near first touch; one that still changes is rounded to the nearest quarter."""
    force = made.force([1e-12, 2e-12, 1e-8, 2e-8], 0.0, 1.0)
    if not np.all((force > 1e-290) & (force < 1e290)):
        return 1.0
    near, far = np.log2(force[1::2] / force[::2])
    settled = abs(near - far) < 1e-6
    return max(round(float(near), 6) if settled else round(4.0 * float(near)) / 4.0, 0.25)


def _check_derivative(made: CustomLaw) -> None:
    """Compare the given derivative with differences, away from knots."""
    import ctypes

    pointer = ctypes.POINTER(ctypes.c_double)
    delta, delta_dot = np.array([_off_knots(made, place) for place in (1e-4, 3e-4)]), np.array([0.3, -0.2])
    kernels = (made.gradient, difference_kernel(made.function, len(made.values), made.knots))
    found = np.empty((2, 3, 2))
    for kernel, out in zip(kernels, found, strict=True):
        arrays = [x.ctypes.data_as(pointer) for x in (delta, delta_dot, made.parameters)]
        kernel.ctypes(2, *arrays[:2], 0.7, arrays[2], *(row.ctypes.data_as(pointer) for row in out))
    for name, given, expected in zip(_ARGUMENTS, *found, strict=True):
        scale = np.max(np.abs(expected)) + 1e-9 * np.max(np.abs(made.force(delta, delta_dot, 0.7)))
        if not np.all(np.abs(given - expected) <= 1e-3 * scale):
            raise ValueError(
                f"derivative of law {made.name!r} by {name} is {given[0]:g} at delta = {delta[0]:g} m, "
                f"delta_dot = 0.3 m/s, entry_rate = 0.7 m/s, but differences of the force give {expected[0]:g}"
            )


def _off_knots(made: CustomLaw, place: float) -> float:
    """An indentation from a place on at which the law has no kink."""
    while any(abs(knot - place) < 1e-3 * place for knot in made.knots):
        place *= 1.01
    return place
