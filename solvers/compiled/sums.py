"""Weighted sums of table rows, and iterations for the forces at eight nodes, in vector registers.

The compiler cannot know that a result does not overlap the table it is computed from, and therefore neither vectorises
these sums nor keeps them in registers by itself. Rows, start and result hold a multiple of `WIDTH` numbers. What is
said of eight numbers is meant for the `families.S` nodes of a contact step.
"""

from __future__ import annotations

from solvers.compiled.kernels import inlined
from solvers.compiled.simd import WIDTH, eight, put, raised, root, spread, total


def padded(size: int) -> int:
    """The next multiple of `WIDTH`."""
    return -(-size // WIDTH) * WIDTH


@inlined
def renew(old, new):
    """Eight numbers take new values: the squares of their change and of their new size, summed."""
    after = eight(new, 0)
    change = after - eight(old, 0)
    put(old, 0, after)
    return total(change * change), total(after * after)


@inlined
def sweep(rows, free, force, motion, stiffness, rooted, damping, viscosity):
    """One iteration for the forces at eight nodes, all in registers: squares of their change and size, summed.

    Indentations and rates at the nodes are free + Σ_e force[e] rows[e], kept in ``motion``; the new forces are
    K d (1 + a d') + c d' with d no less than zero, or with d √d for d if ``rooted``.
    """
    old, delta, rate = eight(force, 0), eight(free[0], 0), eight(free[1], 0)
    more, faster = spread(0.0), spread(0.0)  # each sum waits for its own last term only
    for e in range(0, WIDTH, 2):
        one, two = spread(force[e]), spread(force[e + 1])
        delta += one * eight(rows[e], 0)
        rate += one * eight(rows[e], WIDTH)
        more += two * eight(rows[e + 1], 0)
        faster += two * eight(rows[e + 1], WIDTH)
    delta, rate = delta + more, rate + faster
    put(motion[0], 0, delta)
    put(motion[1], 0, rate)
    deep = raised(delta)
    if rooted:
        deep = deep * root(deep)
    new = spread(stiffness) * deep * (spread(1.0) + spread(damping) * rate) + spread(viscosity) * rate
    put(force, 0, new)
    change = new - old
    return total(change * change), total(new * new)


@inlined
def above(source, least, result):
    """Eight numbers, the negative ones raised to zero if that is the least one allowed; NaN stays."""
    put(result, 0, raised(eight(source, 0)) if least == 0.0 else eight(source, 0))


@inlined
def combine(rows, weights, count, start, result):
    """Sum rows: result = start + Σ_{e < count} weights[e] rows[e]; start may be result, or None for zero."""
    width = rows.shape[-1]
    for first in range(0, width, WIDTH):
        even = spread(0.0) if start is None else eight(start, first)
        odd = spread(0.0)  # each waits for its own last sum only
        for e in range(0, count - 1, 2):
            even += spread(weights[e]) * eight(rows, e * width + first)
            odd += spread(weights[e + 1]) * eight(rows, (e + 1) * width + first)
        if count % 2:
            even += spread(weights[count - 1]) * eight(rows, (count - 1) * width + first)
        put(result, first, even + odd)
