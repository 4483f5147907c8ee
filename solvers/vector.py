"""Weighted sums of table rows in vector registers, eight columns at a time.

The compiler cannot know that a result does not overlap the table it is computed from, and therefore neither vectorises
these sums nor keeps them in registers by itself. Rows, start and result hold a multiple of `WIDTH` numbers.
"""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from solvers.kernels import inlined

WIDTH = 8


def padded(size: int) -> int:
    """The next multiple of `WIDTH`."""
    return -(-size // WIDTH) * WIDTH


@intrinsic
def _columns(typingctx, rows, stride, first, weights, count, start, result):
    """result[f:f+8] = start[f:f+8] + Σ_{e < count} weights[e] rows[e, f:f+8] with f = first; start may be None."""

    def codegen(context, builder, signature, arguments):
        vector = ir.VectorType(ir.DoubleType(), WIDTH)
        data = [
            context.make_array(kind)(context, builder, value).data if isinstance(kind, types.Array) else value
            for kind, value in zip(signature.args, arguments, strict=True)
        ]
        rows, stride, first, weights, count, start, result = data

        def place(base, offset):
            return builder.bitcast(builder.gep(base, [offset]), vector.as_pointer())

        def add(total, e):
            weight = builder.insert_element(
                ir.Constant(vector, ir.Undefined), builder.load(builder.gep(weights, [e])), ir.IntType(32)(0)
            )
            zeros = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
            spread = builder.shuffle_vector(weight, ir.Constant(vector, ir.Undefined), zeros)
            row = builder.load(place(rows, builder.add(builder.mul(e, stride), first)), align=8)
            product = builder.fmul(row, spread, flags=("contract",))
            builder.store(builder.fadd(builder.load(total), product, flags=("contract",)), total)

        one = count.type(1)
        zero = ir.Constant(vector, [0.0] * WIDTH)
        nothing = isinstance(signature.args[5], types.NoneType)
        even, odd = (cgutils.alloca_once(builder, vector) for _ in range(2))  # each waits for its own last sum only
        builder.store(zero if nothing else builder.load(place(start, first), align=8), even)
        builder.store(zero, odd)
        with cgutils.for_range(builder, builder.lshr(count, one)) as loop:
            e = builder.shl(loop.index, one)
            add(even, e)
            add(odd, builder.add(e, one))
        with builder.if_then(builder.trunc(count, ir.IntType(1))):
            add(even, builder.sub(count, one))
        total = builder.fadd(builder.load(even), builder.load(odd))
        builder.store(total, place(result, first), align=8)
        return context.get_dummy_value()

    return types.void(rows, types.intp, types.intp, weights, types.intp, start, result), codegen


def _eight(context, builder, kind, value):
    """Where the first eight numbers of an array are, and the numbers."""
    vector = ir.VectorType(ir.DoubleType(), WIDTH)
    place = builder.bitcast(context.make_array(kind)(context, builder, value).data, vector.as_pointer())
    return place, builder.load(place, align=8)


def _sum(builder, vector):
    """Sum of eight numbers, by halves."""
    nothing = ir.Constant(vector.type, ir.Undefined)
    for half in (4, 2, 1):
        kind = ir.VectorType(ir.IntType(32), half)
        low, high = (ir.Constant(kind, [*range(begin, begin + half)]) for begin in (0, half))
        halves = [builder.shuffle_vector(vector, nothing, places) for places in (low, high)]
        vector = builder.fadd(*halves)
        nothing = ir.Constant(vector.type, ir.Undefined)
    return builder.extract_element(vector, ir.IntType(32)(0))


@intrinsic
def renew(typingctx, old, new):
    """Eight numbers take new values: the squares of their change and of their new size, summed."""

    def codegen(context, builder, signature, arguments):
        kinds = zip(signature.args, arguments, strict=True)
        (place, before), (_, after) = (_eight(context, builder, *pair) for pair in kinds)
        builder.store(after, place, align=8)
        change = builder.fsub(after, before)
        sums = [_sum(builder, builder.fmul(vector, vector)) for vector in (change, after)]
        return context.make_tuple(builder, signature.return_type, sums)

    return types.UniTuple(types.float64, 2)(old, new), codegen


@intrinsic
def above_zero(typingctx, source, result):
    """Eight numbers, the negative ones raised to zero; NaN stays."""

    def codegen(context, builder, signature, arguments):
        kinds = zip(signature.args, arguments, strict=True)
        (_, given), (place, _) = (_eight(context, builder, *pair) for pair in kinds)
        zero = ir.Constant(given.type, [0.0] * WIDTH)
        raised = builder.select(builder.fcmp_ordered("<", given, zero), zero, given)
        builder.store(raised, place, align=8)
        return context.get_dummy_value()

    return types.void(source, result), codegen


@inlined
def combine(rows, weights, count, start, result):
    """Sum rows: result = start + Σ_{e < count} weights[e] rows[e]; start may be result, or None for zero."""
    width = rows.shape[-1]
    for first in range(0, width, WIDTH):
        _columns(rows, width, first, weights, count, start, result)
