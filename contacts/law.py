"""What a contact law is.

A law is a force ``F(delta, delta_dot, entry_rate; parameters)`` for ``delta > 0``. Integrators call it
through the address of one compiled function with a declared C signature,

    void kernel(int64 n, double *delta, double *delta_dot, double entry_rate, double *parameters, double *force)
    void gradient(..., double *parameters, double *by_delta, double *by_rate, double *by_entry_rate)

so a new law never recompiles an integrator, and a batch of ``n`` values costs one call. The main integrator has power
laws of exponent 1 and 3/2 inlined: `Law.inlined` decides.

A law may have a memory: some of its parameters are latched numbers, renewed where a border function of the present
segment falls to zero. Integrators keep a copy of the parameters per contact and per run; four kernels more read and
write it, with B borders and l latched numbers,

    void borders(n, delta, delta_dot, entry_rate, parameters, double *values)             (B, n), > 0 in the segment
    int64 renew(int64 j, double delta, double delta_dot, double entry_rate, parameters)   the index of the event
    void memory_gradient(n, delta, delta_dot, entry_rate, parameters, double *by_memory)  (l, n), dF/dL
    void renew_gradient(j, delta, delta_dot, entry_rate, parameters, double *out)         (l, 2 + l), dL'/d(δ, δ̇, L)

The last takes the parameters before the renewal; its rows and columns of segment codes are zero, and j = -1 asks for
the derivative of no renewal.
"""

from __future__ import annotations

import ctypes
import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contacts.numbers import reals

if TYPE_CHECKING:
    from contacts.sums import Sum

ENTRY_RATE_FLOOR = 1e-3
"""Smallest entry rate a law is given by default, m/s: a/entry_rate is singular at grazing."""
_ARRAY = ctypes.c_void_p
BATCH = ctypes.CFUNCTYPE(None, ctypes.c_int64, _ARRAY, _ARRAY, ctypes.c_double, _ARRAY, _ARRAY)
"""A force or border kernel at its address; arrays as numbers: pointers to doubles take as long as short batches."""
STORED = 1e-11  # of the work of the largest force: error of an energy that is integrated, far above rounding


def _memory_address(name: str, about: str) -> Any:
    """A property: where a compiled function of a law with memory is."""
    doc = f"Address of the compiled function for {about}; 0 without memory."
    return property(lambda law: int(law.memory_kernel(name).address) if law.memory else 0, doc=doc)


class Law(ABC):
    """A contact law: everything an integrator needs to know about a stop's force.

    Laws add: ``law_a + law_b`` acts in parallel.

    Attributes
    ----------
    knots : indentations (m, ascending, > 0) where the force or its slope has a kink.
    jump : whether the force jumps when contact begins, F(0+, v) != 0.
    exponent : leading exponent p of F ~ delta**p at first touch; integrators choose their variable by it.
    powers : exponents of all terms at first touch, 0 for one that jumps.
    bend : where else the force has a kink: "rate" at delta_dot = 0, "force" where it is cut at zero (`uncut` is then
        the law without the cut), None nowhere.
    memory : places in `parameters` of the latched numbers, segment codes included; the values there are those at the
        start of a run.
    borders : number of border functions; one that does not exist in a segment has the value 1.
    events : names of the codes `renew` returns.
    segment_codes : for each latched number the values it may have if it is the code of a segment, () if it is none;
        () of a law that does not tell.
    jumps : whether the force jumps at a border.
    one_sided : whether the law is defined for delta > 0 only.
    reach : δ in m at which all of the memory is at work, 0 without one.
    opens : whether the first latched number is a segment code that is 0 while the contact is open, F = 0.
    entry_rate_floor : entry rates below it (m/s) are raised to it before the law sees them.
    kinds : names by which scene files choose it, each with the constructor it stands for, "" being the class.
    equation, units, remarks : what `describe` says of it: the formula, units of the parameters, where it pulls, where
        it is singular, how it is integrated.
    """

    home: ClassVar[str] = "contacts.kernels"  # the module of its kernels
    compiled: ClassVar[str] = ""  # its force there; the derivatives are <compiled>_gradient, and so on
    kinds: ClassVar[dict[str, str]] = {}
    equation: ClassVar[str] = ""
    units: ClassVar[dict[str, str]] = {}
    remarks: tuple[str, ...] = ()
    nominal: tuple[str, float] | None = None  # constructor and restitution a published formula was asked for
    knots: tuple[float, ...] = ()
    jump: bool = False
    exponent: float = 1.0
    memory: tuple[int, ...] = ()
    borders: int = 0
    events: tuple[str, ...] = ()
    segment_codes: tuple[tuple[float, ...], ...] = ()
    jumps: bool = False
    one_sided: bool = True
    opens: bool = False
    reach: float = 0.0
    entry_rate_floor: float = ENTRY_RATE_FLOOR

    @property
    def powers(self) -> tuple[float, ...]:
        """The leading exponent, and 0 if the force jumps."""
        return (0.0, self.exponent) if self.jump else (self.exponent,)

    @property
    def bend(self) -> str | None:
        """A law with a switch `clamp` is cut at zero."""
        return "force" if getattr(self, "clamp", False) else None

    @property
    def uncut(self) -> Law:
        """The law without its cut at zero."""
        return replace(self, clamp=False) if self.bend == "force" else self  # type: ignore[type-var]

    @property
    @abstractmethod
    def parameters(self) -> NDArray[np.float64]:
        """The numbers handed to the compiled kernel."""

    @property
    def kernel(self) -> Any:
        """The compiled force (a numba ``cfunc``) with the module's C signature."""
        return getattr(import_module(self.home), self.compiled)

    @property
    def gradient(self) -> Any:
        """The compiled derivatives of the force, likewise."""
        return getattr(import_module(self.home), f"{self.compiled}_gradient")

    def memory_kernel(self, name: str) -> Any:
        """The compiled "borders", "renew", "memory_gradient" or "renew_gradient" of a law with memory."""
        return getattr(import_module(self.home), f"{self.compiled}_{name}")

    @property
    def address(self) -> int:
        """Address of the compiled force."""
        return int(self.kernel.address)

    @property
    def gradient_address(self) -> int:
        """Address of the compiled derivatives."""
        return int(self.gradient.address)

    borders_address = _memory_address("borders", "the border functions")
    renew_address = _memory_address("renew", "the renewal of the latched numbers")
    memory_gradient_address = _memory_address("memory_gradient", "the derivatives of the force by the latched numbers")
    renew_gradient_address = _memory_address("renew_gradient", "the derivatives of the renewal")

    @property
    def inlined(self) -> tuple[float, float, float, float] | None:
        """(K, p, a, c) if F = K δ^p (1 + a δ̇/δ̇⁻) + c δ̇ with p 1 or 3/2: integrators then need not call the kernel."""
        if self.compiled != "power":
            return None
        K, p, a, c, r, clamp, approach = self.parameters.tolist()
        plain = p in (1.0, 1.5) and not clamp and not approach and (c == 0.0 or r == 0.0)
        return (K, p, a, c) if plain else None

    def __add__(self, other: Law) -> Sum:
        """Both laws at once."""
        if not isinstance(other, Law):
            return NotImplemented
        from contacts.sums import Sum, parts_of

        return Sum((*parts_of(self), *parts_of(other)))

    def force(self, delta: ArrayLike, delta_dot: ArrayLike = 0.0, entry_rate: ArrayLike = 1.0) -> NDArray[np.float64]:
        """Contact force in N, zero where ``delta <= 0``.

        With memory it is that at the start of a run, at both signs of ``delta`` unless the law is one-sided.

        Parameters
        ----------
        delta, delta_dot, entry_rate : indentation (m), its rate and the rate at entry (m/s); they broadcast.

        Returns
        -------
        Force with the broadcast shape, positive when repulsive. NaN in, NaN out.
        """
        given = {"delta": delta, "delta_dot": delta_dot, "entry_rate": entry_rate}
        d, v, r = np.broadcast_arrays(*(reals(x, f"{name} of a force") for name, x in given.items()))
        out = np.where(np.isnan(d + v + r), math.nan, 0.0)
        everywhere = bool(self.memory) and not self.one_sided
        touching = np.flatnonzero(((d > 0.0) | everywhere) & ~np.isnan(out))
        touching = touching[np.argsort(r.flat[touching], kind="stable")]
        if touching.size:
            out.flat[touching] = self._force_at_rates(d.flat[touching], v.flat[touching], r.flat[touching])
        return out[()]

    def _force_at_rates(self, delta: NDArray, delta_dot: NDArray, entry_rate: NDArray) -> NDArray[np.float64]:
        """Force (k,) at entry rates (k,) that rise, by one call of the kernel for each that is another one."""
        rates, starts = np.unique(np.maximum(entry_rate, self.entry_rate_floor), return_index=True)
        force, parameters = np.empty(delta.size), np.ascontiguousarray(self.parameters, dtype=float)
        d, v, p, f = (x.ctypes.data for x in (delta, delta_dot, parameters, force))
        call, bytes_each, ends = BATCH(self.kernel.address), force.itemsize, [*starts[1:].tolist(), force.size]
        for rate, start, end in zip(rates.tolist(), starts.tolist(), ends, strict=True):
            skip = start * bytes_each
            call(end - start, d + skip, v + skip, rate, p, f + skip)
        return force

    def batch(self, entry_rate: float, parameters: NDArray | None = None) -> Callable[[NDArray, NDArray], NDArray]:
        """The force at one entry rate as a lean function of 1-D arrays ``delta >= 0`` and ``delta_dot``.

        With memory at the start of a run, or with other ``parameters``.
        """
        call, rate = BATCH(self.kernel.address), max(entry_rate, self.entry_rate_floor)
        parameters = self.parameters if parameters is None else parameters

        def evaluate(delta: NDArray, delta_dot: NDArray) -> NDArray:
            force = np.empty(len(delta))
            d, v, p = (np.ascontiguousarray(x, dtype=float) for x in (delta, delta_dot, parameters))
            call(force.size, d.ctypes.data, v.ctypes.data, rate, p.ctypes.data, force.ctypes.data)
            return force

        return evaluate

    def along(self, delta: ArrayLike) -> NDArray[np.float64]:
        """Force in N along a path of δ, passed slowly from the start of a run on: loops of a law with memory.

        Exact whatever the distance of the points: borders between them are found to rounding. Dashpots give nothing.

        Parameters
        ----------
        delta : (k,) m, finite, one after the other.

        Returns
        -------
        (k,) forces. ValueError for a path that is not a row of finite numbers, for a force that is not finite, and for
        a border that falls to zero again and again at one place.
        """
        from contacts.path import along

        return along(self, delta)

    def border_name(self, border: int, parameters: NDArray[np.float64]) -> str:
        """A border in words, for messages."""
        return f"border {border}"

    def stored(self, delta: float, parameters: NDArray[np.float64]) -> float:
        """Energy in J that the element would give back at rest from ``delta`` with these parameters.

        Without memory the integral of the force at rest from 0 to ``delta``.
        """
        return 0.0 if self.one_sided and delta <= 0.0 else self.work_at_rest(delta)

    def work_at_rest(self, delta: float) -> float:
        """∫F dδ from 0 to ``delta`` in J, passed slowly and without memory; below 0 of a contact that always acts."""
        from scipy.integrate import quad

        force = self.batch(1.0)
        size = delta * float(np.abs(force(delta * np.linspace(0.0, 1.0, 9), np.zeros(9))).max())
        ends = [0.0, *(knot for knot in self.knots if knot < delta), delta]
        accuracy = {"epsabs": STORED * abs(size) / (len(ends) - 1), "epsrel": STORED}
        work = [quad(lambda x: force(np.array([x]), np.zeros(1))[0], *ab, **accuracy)[0] for ab in pairwise(ends)]
        return float(sum(work))

    def exact_restitution(self, entry_rate: float, mass: float) -> float | None:
        """Restitution of a free mass where a closed relation gives it, else None; see `contacts.restitution`."""
        return None

    def describe(self, entry_rate: float = 1.0, mass: float = 1.0) -> str:
        """Equation, parameters with units, nominal and achieved restitution, where it pulls and where it is singular.

        Parameters
        ----------
        entry_rate : m/s, > 0, and mass : kg, > 0, of the free mass whose restitution is told.
        """
        from contacts.describe import describe

        return describe(self, entry_rate, mass)
