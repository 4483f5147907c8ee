"""Contact steps of many stops, through the blocks: a force pushes blocks, blocks move, a stop reads blocks.

Up to `block_tables.FEW` stops have tables of what reaches each of them; their size, and what of it a step must fetch,
grow with the square of the number of stops. Beyond, ``space.carried`` holds p and v of all blocks at the nodes, free or
under all forces, from which a stop's indentation is one sum over the blocks. What stops that touch together do to each
other is summed up for them when they first do, and kept in a pool of bounded size.
"""

from __future__ import annotations

from solvers.compiled.kernels import inlined, inner, merged
from solvers.compiled.simd import eight, put, spread, total
from solvers.compiled.sums import combine
from solvers.exponential.contact.nodes import S
from solvers.exponential.responses import fill_pair

SIGNALS, GOING_ON, ENTERING = range(3)  # groups of inputs; a force has the weight σ^λ on the step on which it enters
POOL = 4093  # pairs of stops and step lengths, a kilobyte each; prime, so that few of one step share a place


@inlined
def goes_through_blocks(tables):
    """Whether there are too many stops for tables of each."""
    return tables.ahead.shape[1] > 0


@inlined
def way_of(tables, family, u):
    """Index of the tables of what input u does on a step of a family."""
    return tables.enters[family] if u == family - 1 else tables.kind[family]


@merged
def pair(problem, tables, space, family, level, s, u):
    """(S, 2S): δ and δ̇ of stop s at the nodes from the node values of input u."""
    way = way_of(tables, family, u)
    if goes_through_blocks(tables):
        matrix = space.pairs[_in_pool(problem, tables, space, way, level, s, u)]
    else:
        matrix = tables.forced[way, level, u, s]
    return matrix


@inner
def _in_pool(problem, tables, space, way, level, s, u):
    """Where the same of many stops is in the pool, summed up if another pair has its place."""
    stops, inputs = problem.gap.size, space.force.shape[0]
    key = ((way * tables.step.size + level) * stops + s) * inputs + u + 1
    place = key % space.tags.size
    if space.tags[place] != key:
        push = problem.push[u] if u < stops else problem.load[u - stops]
        rows = tables.response[way, level]
        fill_pair(problem, push, problem.read[s], problem.read_rate[s], rows, space.mixed, space.pairs[place])
        space.tags[place] = key
    return place


@inner
def carry_free(problem, tables, space, family, level, x):
    """All blocks at the nodes from the state at the begin of the step, without forces."""
    n, carried = problem.k.size, space.carried
    ahead = tables.ahead[tables.kind[family], level]
    for b in range(n):
        p, v = spread(x[b]), spread(x[n + b])
        alpha, beta = eight(ahead[0, b], 0), eight(ahead[1, b], 0)
        put(carried[b], 0, alpha * p + beta * v)
        put(carried[n + b], 0, alpha * v - beta * (spread(problem.k[b]) * p + spread(problem.c[b]) * v))


@inner
def _gather(problem, tables, state, space, force, family, group):
    """What the inputs of one group push the blocks by, at the nodes, into ``space.pushed``; whether there are any."""
    stops, size, own, found = problem.gap.size, problem.k.size, tables.response.shape[3] // 2, False
    for u in range(force.shape[0]):
        if (u >= stops) != (group == SIGNALS) or (u < stops and state.piece[u] == 0):
            continue
        if u < stops and (u == family - 1) != (group == ENTERING):
            continue
        push = problem.push[u] if u < stops else problem.load[u - stops]
        values = eight(force[u], 0)
        for e in range(2 * own):
            before = eight(space.pushed[e], 0) if found else spread(0.0)
            put(space.pushed[e], 0, before + spread(push[e if e < own else e - own + size]) * values)
        found = True
    return found


@inner
def carry_forces(problem, tables, state, space, family, level, group):
    """Add to the blocks at the nodes what the present forces of one group, or the signals, do."""
    if not _gather(problem, tables, state, space, space.force, family, group):
        return
    n, own, carried, pushed = problem.k.size, tables.response.shape[3] // 2, space.carried, space.pushed
    way = tables.enters[family] if group == ENTERING else tables.kind[family]
    for j in range(S):
        rows = tables.response[way, level, j]
        for b in range(own):
            p, v = pushed[b, j], pushed[own + b, j]
            alpha, beta = eight(rows[b], 0), eight(rows[own + b], 0)
            turned = spread(problem.k[b] * p + problem.c[b] * v)
            put(carried[b], 0, eight(carried[b], 0) + alpha * spread(p) + beta * spread(v))
            put(carried[n + b], 0, eight(carried[n + b], 0) + alpha * spread(v) - beta * turned)


@inner
def kick(problem, tables, state, space, force, family, level, x):
    """Add to a state what forces and signals do until the end of the step."""
    n, own = problem.k.size, tables.response.shape[3] // 2
    for group in range(0 if problem.table_dt.size else 1, 3):
        if not _gather(problem, tables, state, space, force, family, group):
            continue
        way = tables.enters[family] if group == ENTERING else tables.kind[family]
        ending = tables.ending[way, level]
        for b in range(own):
            p, v = eight(space.pushed[b], 0), eight(space.pushed[own + b], 0)
            alpha, beta = eight(ending[0, b], 0), eight(ending[1, b], 0)
            x[b] += total(alpha * p + beta * v)
            x[n + b] += total(alpha * v - beta * (spread(problem.k[b]) * p + spread(problem.c[b]) * v))


@inlined
def see(problem, space, s, gap, out):
    """δ + gap and δ̇ of stop s at the nodes from the blocks, less ``gap``."""
    size = 2 * problem.k.size
    put(out[0], 0, spread(-gap))
    combine(space.carried, problem.read[s], size, out[0], out[0])
    combine(space.carried, problem.read_rate[s], size, None, out[1])
