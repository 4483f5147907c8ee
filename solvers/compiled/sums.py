"""Weighted sums of table rows, and iterations for the forces at eight nodes, in vector registers.

The compiler cannot know that a result does not overlap the table it is computed from, and therefore neither vectorises
these sums nor keeps them in registers by itself. Rows, start and result hold a multiple of `WIDTH` numbers. What is
said of eight numbers is meant for the `node_sets.S` nodes of a contact step.
"""

from __future__ import annotations

from solvers.compiled.kernels import inlined
from solvers.compiled.simd import WIDTH, load8, positive8, splat8, sqrt8, store8, sum8


def padded(size: int) -> int:
    """The next multiple of `WIDTH`."""
    return -(-size // WIDTH) * WIDTH


@inlined
def replace_values(old, new):
    """Eight numbers take new values: the squares of their change and of their new size, summed."""
    after = load8(new, 0)
    change = after - load8(old, 0)
    store8(old, 0, after)
    return sum8(change * change), sum8(after * after)


@inlined
def iterate_power_law(rows, free, force, motion, stiffness, rooted, damping, viscosity):
    """One iteration for the forces at eight nodes, all in registers: squares of their change and size, summed.

    Indentations and rates at the nodes are free + Σ_e force[e] rows[e], kept in ``motion``; the new forces are
    K d (1 + a d') + c d' with d no less than zero, or with d √d for d if ``rooted``.
    """
    old, delta, rate = load8(force, 0), load8(free[0], 0), load8(free[1], 0)
    more, faster = splat8(0.0), splat8(0.0)  # each sum waits for its own last term only
    for e in range(0, WIDTH, 2):
        one, two = splat8(force[e]), splat8(force[e + 1])
        delta += one * load8(rows[e], 0)
        rate += one * load8(rows[e], WIDTH)
        more += two * load8(rows[e + 1], 0)
        faster += two * load8(rows[e + 1], WIDTH)
    delta, rate = delta + more, rate + faster
    store8(motion[0], 0, delta)
    store8(motion[1], 0, rate)
    deep = positive8(delta)
    if rooted:
        deep = deep * sqrt8(deep)
    new = splat8(stiffness) * deep * (splat8(1.0) + splat8(damping) * rate) + splat8(viscosity) * rate
    store8(force, 0, new)
    change = new - old
    return sum8(change * change), sum8(new * new)


@inlined
def clip_negative(source, result):
    """Eight numbers, the negative ones raised to zero; NaN stays."""
    store8(result, 0, positive8(load8(source, 0)))


@inlined
def combine(rows, weights, count, start, result):
    """Sum rows: result = start + Σ_{e < count} weights[e] rows[e]; start may be result, or None for zero."""
    width = rows.shape[-1]
    for first in range(0, width, WIDTH):
        even = splat8(0.0) if start is None else load8(start, first)
        odd = splat8(0.0)  # each waits for its own last sum only
        for e in range(0, count - 1, 2):
            even += splat8(weights[e]) * load8(rows, e * width + first)
            odd += splat8(weights[e + 1]) * load8(rows, (e + 1) * width + first)
        if count % 2:
            even += splat8(weights[count - 1]) * load8(rows, (count - 1) * width + first)
        store8(result, first, even + odd)
