"""Parts of the main method that are compiled by themselves and called at an address.

numba links all that a function calls into it, and optimises it there once more, in every caller of a caller: half of
the time of compiling. A part is optimised once; and one that few runs need is compiled when the first of these is
prepared. A call at an address costs some nanoseconds, and nothing of a part is inlined: parts are long, or rare.

The addresses are in ``problem.parts``, 0 for what has not been loaded yet; every type of problem has its own, as its
code is compiled for itself. Machine code that is kept holds the places named here, never an address.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from solvers.compiled.decorators import c_function, inner
from solvers.compiled.packed import PackedType

(BEGIN, CONTACT, SOLVE, NEWTON, LEAVES, ERROR, ACCEPT, LAND, LANDING_STEP, WITHIN_STEP) = range(10)
(ACCOUNT_FLIGHT, ACCOUNT_STEP, ACCOUNT_SERIES, ACCOUNT_CONTACT) = range(10, 14)
(SIDE, FIRST_END, LAND_IN_TIME, GO_BEYOND, PASSED, BEHIND) = range(14, 20)
(PRESSED,) = range(20, 21)
(PAIR, FREE_BLOCKS, PUSHED_BLOCKS, PUSHED_END, STOP_AT_NODES, BOUNDS) = range(21, 27)
TO_KINK, FOLLOWED = range(27, 29)
(CIRCLE_SPAN, CIRCLE_SPAN_AT, CIRCLE_NEAR, CIRCLE_ROOT, CIRCLE_MOTION, CIRCLE_FORCES, CIRCLE_GUESS) = range(29, 36)
(CIRCLE_AWAY, CIRCLE_NEWTON, CIRCLE_WORK, CIRCLE_WITHIN, CIRCLE_LANDED) = range(36, 41)
(RADIAL_MOTION, RADIAL_ACCELERATION, RADIAL_PUSH) = range(41, 44)
(RUB_FORCES, RUB_GUESS, RUB_NEWTON, RUB_WORK, RUB_WITHIN, RUB_MARGINS, RUB_IN, RUB_AROUND, RUB_PEAK) = range(44, 53)
EVERY_RUN, ENERGY = range(10), range(10, 14)
BORDERS, TWO_STOPS, MANY_STOPS = range(14, 20), range(20, 21), range(21, 27)
KINKS, FOLLOWING = range(27, 28), range(28, 29)
CIRCLES, FRICTION = range(29, 44), range(44, 53)
"""What needs them: every run, those with an energy balance, with bends or memory in a law, with two or many stops, with
kinks of sampled loads, with blocks that follow them, with circular clearances, with friction."""
PLACES = 53

_DECLARED: dict[int, tuple[Any, Any, tuple[Any, ...]]] = {}
_LOADED: dict[tuple[type, int], Any] = {}
_ADDRESSES: dict[type, Any] = {}
_LOCK = threading.Lock()


def part(place: int, result: Any, *plain: Any) -> Callable[[Any], Any]:
    """Decorator of the function called at ``problem.parts[place]``.

    Its first argument is the problem, or the named tuple ``run`` that begins with it, then come those of the types
    ``plain``. With a problem that is not packed, as stepping methods have it, the function is called as one of `inner`.
    """

    def declared(function: Any) -> Any:
        _DECLARED[place] = function, result, plain
        return _call_at(place, result, plain, inner(function))

    return declared


def addresses_of(problem: type) -> Any:
    """(parts,) addresses of what has been loaded for a type of problem; one array, which `load` fills."""
    with _LOCK:
        return _ADDRESSES.setdefault(problem, np.zeros(PLACES, dtype=np.int64))


def load(kinds: Mapping[str, types.Type], places: Iterable[int]) -> None:
    """Compile parts, or load their machine code; ``kinds`` are the types of the first argument by its name."""
    problem = kinds["problem"].kind.instance_class
    addresses = addresses_of(problem)
    for place in places:
        if not addresses[place]:
            with _LOCK:  # another thread may have been quicker; what one gave the address of must stay
                if (problem, place) not in _LOADED:
                    _LOADED[problem, place] = _compiled(kinds, *_DECLARED[place])
                addresses[place] = _LOADED[problem, place].address


def _compiled(kinds: Mapping[str, types.Type], function: Any, result: Any, plain: tuple[Any, ...]) -> Any:
    """The C function of a part."""
    return c_function(result(kinds[function.__code__.co_varnames[0]], *plain))(function)


def _call_at(place: int, result: Any, plain: tuple[Any, ...], unpacked: Any) -> Any:
    """An intrinsic that calls a part with its arguments."""

    @intrinsic
    def call(typingctx, first, *others):
        problem = first.types[0] if isinstance(first, types.NamedTuple) else first
        if not isinstance(problem, PackedType):
            return _call_inner(typingctx, unpacked, first, others)
        rest = types.Tuple(plain)

        def codegen(context, builder, signature, arguments):
            find = context.get_getattr(problem, "parts")
            value = arguments[0] if first is problem else builder.extract_value(arguments[0], 0)
            addresses = find(context, builder, problem, value, "parts")
            kind = types.Array(types.int64, 1, "C")
            data = context.make_array(kind)(context, builder, addresses).data
            address = builder.load(builder.gep(data, [ir.IntType(64)(place)]))
            expected = [context.get_value_type(kind) for kind in (first, *plain)]
            function = ir.FunctionType(context.get_value_type(result), expected).as_pointer()
            values = [builder.extract_value(arguments[1], i) for i in range(len(plain))]
            return builder.call(builder.inttoptr(address, function), [arguments[0], *values])

        return result(first, rest), codegen

    return call


def _call_inner(typingctx: Any, function: Any, problem: Any, others: tuple[Any, ...]) -> Any:
    """Signature and code of a call of a compiled function itself."""
    kind = typingctx.resolve_value_type(function)
    own = kind.get_call_type(typingctx, (problem, *others), {})

    def codegen(context, builder, signature, arguments):
        values = [builder.extract_value(arguments[1], i) for i in range(len(others))]
        return context.get_function(kind, own)(builder, [arguments[0], *values])

    return own.return_type(problem, types.Tuple(others)), codegen
