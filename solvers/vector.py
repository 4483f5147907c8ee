"""Weighted sums of table rows, and iterations for the forces at eight nodes, in vector registers.

The compiler cannot know that a result does not overlap the table it is computed from, and therefore neither vectorises
these sums nor keeps them in registers by itself. Rows, start and result hold a multiple of `WIDTH` numbers. What is
said of eight numbers is meant for the `tables.S` nodes of a contact step.
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
            weight = _spread(builder, builder.load(builder.gep(weights, [e])), vector)
            row = builder.load(place(rows, builder.add(builder.mul(e, stride), first)), align=8)
            product = builder.fmul(row, weight, flags=("contract",))
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


def _spread(builder, number, kind):
    """A number in all places of a vector."""
    first = builder.insert_element(ir.Constant(kind, ir.Undefined), number, ir.IntType(32)(0))
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(first, ir.Constant(kind, ir.Undefined), zeros)


def _raised(builder, given):
    """Eight numbers, the negative ones raised to zero; NaN stays."""
    zero = ir.Constant(given.type, [0.0] * WIDTH)
    return builder.select(builder.fcmp_ordered("<", given, zero), zero, given)


@intrinsic
def sweep(typingctx, rows, free, force, motion, stiffness, rooted, damping, viscosity):
    """One iteration for the forces at eight nodes, all in registers: squares of their change and size, summed.

    Indentations and rates at the nodes are free + Σ_e force[e] rows[e], kept in ``motion``; the new forces are
    K d (1 + a d') + c d' with d no less than zero, or with d √d for d if ``rooted``.
    """

    def codegen(context, builder, signature, arguments):
        arrays = list(zip(signature.args, arguments, strict=True))[:4]
        (row, _), (start, _), (place, old), (moved, _) = (_eight(context, builder, *pair) for pair in arrays)
        vector = old.type

        def at(base, i):
            return builder.gep(base, [ir.IntType(64)(i)])

        def response(d):
            sums = [builder.load(at(start, d), align=8)] + [ir.Constant(vector, [0.0] * WIDTH)] * 3
            for e in range(WIDTH):
                lane = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [e] * WIDTH)
                weight = builder.shuffle_vector(old, ir.Constant(vector, ir.Undefined), lane)
                product = builder.fmul(builder.load(at(row, 2 * e + d), align=8), weight, flags=("contract",))
                sums[e % 4] = builder.fadd(sums[e % 4], product, flags=("contract",))
            total = builder.fadd(builder.fadd(sums[0], sums[1]), builder.fadd(sums[2], sums[3]))
            builder.store(total, at(moved, d), align=8)
            return total

        delta, rate = response(0), response(1)
        K, a, c = (_spread(builder, arguments[i], vector) for i in (4, 6, 7))
        deep = cgutils.alloca_once_value(builder, _raised(builder, delta))
        with builder.if_then(context.is_true(builder, signature.args[5], arguments[5])):
            d = builder.load(deep)
            root = ir.FunctionType(vector, [vector])
            root = cgutils.get_or_insert_function(builder.module, root, f"llvm.sqrt.v{WIDTH}f64")
            builder.store(builder.fmul(d, builder.call(root, [d])), deep)
        one = ir.Constant(vector, [1.0] * WIDTH)
        elastic = builder.fmul(builder.fmul(K, builder.load(deep)), builder.fadd(one, builder.fmul(a, rate)))
        new = builder.fadd(elastic, builder.fmul(c, rate))
        builder.store(new, place, align=8)
        sums = [_sum(builder, builder.fmul(v, v)) for v in (builder.fsub(new, old), new)]
        return context.make_tuple(builder, signature.return_type, sums)

    number = types.float64
    signature = types.UniTuple(number, 2)(rows, free, force, motion, number, rooted, number, number)
    return signature, codegen


@intrinsic
def above_zero(typingctx, source, result):
    """Eight numbers, the negative ones raised to zero; NaN stays."""

    def codegen(context, builder, signature, arguments):
        kinds = zip(signature.args, arguments, strict=True)
        (_, given), (place, _) = (_eight(context, builder, *pair) for pair in kinds)
        builder.store(_raised(builder, given), place, align=8)
        return context.get_dummy_value()

    return types.void(source, result), codegen


@inlined
def combine(rows, weights, count, start, result):
    """Sum rows: result = start + Σ_{e < count} weights[e] rows[e]; start may be result, or None for zero."""
    width = rows.shape[-1]
    for first in range(0, width, WIDTH):
        _columns(rows, width, first, weights, count, start, result)
