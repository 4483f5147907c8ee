"""Weighted sums of table rows, and the iteration for the forces at eight nodes, in vector registers.

The compiler cannot know that a result does not overlap the table it is computed from; so it neither vectorises these
sums nor keeps them in registers by itself. Rows, start and result hold a multiple of `WIDTH` numbers; the functions of
eight numbers serve the S = 8 nodes of a contact step, see `contact.nodes`.
"""

from __future__ import annotations

from solvers.compiled.kernels import inlined
from solvers.compiled.simd import WIDTH, load8, positive8, splat8, sqrt8, store8, sum8


def padded(size: int) -> int:
    """The smallest multiple of `WIDTH` that is not below ``size``."""
    return -(-size // WIDTH) * WIDTH


@inlined
def replace_values(old, new):
    """Replace eight numbers by new ones; returns the sums of the squares of the changes and of the new values."""
    after = load8(new, 0)
    change = after - load8(old, 0)
    store8(old, 0, after)
    return sum8(change * change), sum8(after * after)


@inlined
def add_response(rows, force, delta, rate):
    """δ and δ̇ at eight nodes, to which those by eight forces are added: Σ_e force[e] rows[e], ``rows`` (8, 16)."""
    delta_2, rate_2 = splat8(0.0), splat8(0.0)  # two independent chains of sums run in parallel
    for e in range(0, WIDTH, 2):
        one, two = splat8(force[e]), splat8(force[e + 1])
        delta += one * load8(rows[e], 0)
        rate += one * load8(rows[e], WIDTH)
        delta_2 += two * load8(rows[e + 1], 0)
        rate_2 += two * load8(rows[e + 1], WIDTH)
    return delta + delta_2, rate + rate_2


@inlined
def iterate_power_law(rows, free, force, motion, stiffness, rooted, damping, viscosity, cut):
    """One fixed-point iteration for the forces at eight nodes; returns Σ change² and Σ force², N².

    ``rows`` (8, 16) are δ and δ̇ at all nodes per unit force at a node. Motion free + Σ_e force[e] rows[e] is written
    to ``motion`` (2, 8), the new forces K d (1 + a δ̇) + c δ̇ to ``force`` (8,), with d = max(δ, 0), or d^{3/2} if
    ``rooted``, raised to zero if ``cut``.
    """
    old = load8(force, 0)
    delta, rate = add_response(rows, force, load8(free[0], 0), load8(free[1], 0))
    store8(motion[0], 0, delta)
    store8(motion[1], 0, rate)
    deep = positive8(delta)
    if rooted:
        deep = deep * sqrt8(deep)
    new = splat8(stiffness) * deep * (splat8(1.0) + splat8(damping) * rate) + splat8(viscosity) * rate
    if cut:
        new = positive8(new)
    store8(force, 0, new)
    change = new - old
    return sum8(change * change), sum8(new * new)


@inlined
def above(source, least, result):
    """Write eight numbers, negative ones raised to zero if ``least`` is 0, unchanged if it is -inf; NaN stays."""
    store8(result, 0, positive8(load8(source, 0)) if least == 0.0 else load8(source, 0))


@inlined
def combine(rows, weights, count, start, result):
    """Sum rows: result = start + Σ_{e < count} weights[e] rows[e]; ``start`` may be ``result``, or None for zero."""
    width = rows.shape[-1]
    for first in range(0, width, WIDTH):
        even = splat8(0.0) if start is None else load8(start, first)
        odd = splat8(0.0)  # a second chain of sums
        for e in range(0, count - 1, 2):
            even += splat8(weights[e]) * load8(rows, e * width + first)
            odd += splat8(weights[e + 1]) * load8(rows, (e + 1) * width + first)
        if count % 2:
            even += splat8(weights[count - 1]) * load8(rows, (count - 1) * width + first)
        store8(result, first, even + odd)
