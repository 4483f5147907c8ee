"""Eight numbers as one value of compiled code (SIMD), with + - * / and √.

The compiler vectorises a loop only where it can prove that arrays do not overlap; then the entries beyond the last
multiple of the vector's length are done one by one.
"""

from __future__ import annotations

import operator
from typing import ClassVar

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

WIDTH = 8
_VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)


class Vector8(types.Type):
    """Type of eight numbers."""

    def __init__(self) -> None:
        super().__init__(name="Eight")


VECTOR8 = Vector8()


@register_model(Vector8)
class _Model(models.PrimitiveModel):
    """One vector register, or as many as the machine needs."""

    def __init__(self, manager, kind):
        super().__init__(manager, kind, _VECTOR)


def _operator(function, instruction):
    """Define an operator between two vectors in compiled code; products may be fused into sums."""

    @infer_global(function)
    class _Typing(ConcreteTemplate):
        cases: ClassVar = [signature(VECTOR8, VECTOR8, VECTOR8)]

    @lower_builtin(function, VECTOR8, VECTOR8)
    def lowered(context, builder, signature, arguments):
        return getattr(builder, instruction)(*arguments, flags=("contract",))


_operator(operator.add, "fadd")
_operator(operator.iadd, "fadd")
_operator(operator.sub, "fsub")
_operator(operator.mul, "fmul")
_operator(operator.truediv, "fdiv")


def _place(context, builder, kind, array, offset=None):
    """Where eight numbers of an array begin, as a vector's address."""
    data = context.make_array(kind)(context, builder, array).data
    return builder.bitcast(data if offset is None else builder.gep(data, [offset]), _VECTOR.as_pointer())


def _places(places):
    """Indices of the numbers a shuffle takes."""
    return ir.Constant(ir.VectorType(ir.IntType(32), len(places)), list(places))


@intrinsic
def bit_pattern(typingctx, number):
    """A number's bits as an integer: 2^52 times its logarithm to base 2, interpolated linearly between powers of 2."""

    def codegen(context, builder, signature, arguments):
        return builder.bitcast(arguments[0], ir.IntType(64))

    return types.int64(types.float64), codegen


@intrinsic
def load8(typingctx, array, first):
    """The eight numbers of an array from ``first`` on; rows of an array with more dimensions follow each other."""

    def codegen(context, builder, signature, arguments):
        return builder.load(_place(context, builder, signature.args[0], *arguments), align=8)

    return VECTOR8(array, types.intp), codegen


@intrinsic
def store8(typingctx, array, first, numbers):
    """Write eight numbers into an array."""

    def codegen(context, builder, signature, arguments):
        array, first, numbers = arguments
        builder.store(numbers, _place(context, builder, signature.args[0], array, first), align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, VECTOR8), codegen


@intrinsic
def splat8(typingctx, number):
    """Eight times the same number."""

    def codegen(context, builder, signature, arguments):
        nothing = ir.Constant(_VECTOR, ir.Undefined)
        first = builder.insert_element(nothing, arguments[0], ir.IntType(32)(0))
        return builder.shuffle_vector(first, nothing, _places([0] * WIDTH))

    return VECTOR8(types.float64), codegen


def _each(name):
    """An intrinsic that applies LLVM's function of a name to each of eight numbers."""

    @intrinsic
    def applied(typingctx, numbers):
        def codegen(context, builder, signature, arguments):
            kind = ir.FunctionType(_VECTOR, [_VECTOR])
            function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{WIDTH}f64")
            return builder.call(function, arguments)

        return VECTOR8(VECTOR8), codegen

    return applied


sqrt8, size8 = _each("sqrt"), _each("fabs")


@intrinsic
def positive8(typingctx, numbers):
    """The negative ones raised to zero; NaN stays."""

    def codegen(context, builder, signature, arguments):
        zero = ir.Constant(_VECTOR, [0.0] * WIDTH)
        return builder.select(builder.fcmp_ordered("<", arguments[0], zero), zero, arguments[0])

    return VECTOR8(VECTOR8), codegen


def _by_halves(pair):
    """An intrinsic that joins eight numbers to one: four and four, two and two, one and one."""

    @intrinsic
    def joined(typingctx, numbers):
        def codegen(context, builder, signature, arguments):
            vector = arguments[0]
            for half in (4, 2, 1):
                nothing = ir.Constant(vector.type, ir.Undefined)
                low, high = (
                    builder.shuffle_vector(vector, nothing, _places(places))
                    for places in (range(half), range(half, 2 * half))
                )
                vector = pair(builder, low, high)
            return builder.extract_element(vector, ir.IntType(32)(0))

        return types.float64(VECTOR8), codegen

    return joined


sum8 = _by_halves(lambda builder, low, high: builder.fadd(low, high))
"""Sum of eight numbers."""
largest8 = _by_halves(lambda builder, low, high: builder.select(builder.fcmp_ordered(">", low, high), low, high))
"""Largest of eight numbers; any of them if one is NaN."""
least8 = _by_halves(lambda builder, low, high: builder.select(builder.fcmp_ordered("<", low, high), low, high))
"""Least of eight numbers; any of them if one is NaN."""
