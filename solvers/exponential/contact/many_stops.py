"""Contact steps with many stops: forces move the blocks, and the motion of a stop is a sum over the blocks.

Up to `block_tables.FEW` stops there are tables of the response of each stop to each force. Their size, and what a step
reads of them, grow with the square of the number of stops. With more stops ``scratch.block_motion`` holds p and v of
all blocks at the nodes, without forces or with all of them. The response of one stop to the force of another is summed
up when both are in contact for the first time, and kept in a pool of bounded size; with many in contact at once, sums
over the blocks are cheaper than sums over all pairs.
"""

from __future__ import annotations

from numba import types

from solvers.compiled.kernels import MATRIX, REAL, VECTOR, element_of, inlined, inner, merged, push_of
from solvers.compiled.parts import FREE_BLOCKS, PAIR, PUSHED_BLOCKS, PUSHED_END, STOP_AT_NODES, part
from solvers.compiled.simd import load8, splat8, store8, sum8
from solvers.compiled.state import acts
from solvers.compiled.sums import combine
from solvers.exponential.contact.nodes import S
from solvers.exponential.responses import fill_pair

SIGNALS, CONTINUING, ENTERING = range(3)  # groups of inputs: signals, forces without and with the weight σ^λ
FEW_AT_ONCE = 24  # rows in contact whose pairs, at some step lengths each, all fit into the pool
POOL = 4093  # pairs of rows and step lengths, 1 kB each; a prime, so that few pairs of one step share an index


@inlined
def uses_blocks(tables):
    """Whether there are too many rows for tables of each pair of them."""
    return tables.node_propagator.shape[1] > 0


@inlined
def enters(problem, node_set, u):
    """Whether input u is a force of the element that enters on a step with these nodes."""
    return u < problem.gap.size and element_of(problem, u) == node_set - 1


@inlined
def weighting_of(run, node_set, u):
    """Index of the weighting of input u, a force or signal, on a step with these nodes."""
    return run.tables.entering[node_set] if enters(run.problem, node_set, u) else run.tables.kind[node_set]


@merged
def pair_response(run, node_set, level, r, u):
    """(S, 2S): displacement and rate of row r at the nodes from the node values of input u."""
    weighting = weighting_of(run, node_set, u)
    if uses_blocks(run.tables):
        matrix = run.scratch.pair_pool[_pool_index(run, weighting, level, r, u)]
    else:
        matrix = run.tables.forced[weighting, level, u, r]
    return matrix


@part(PAIR, types.int64, *[types.int64] * 4)
def _pool_index(run, weighting, level, r, u):
    """Index of the same response in ``scratch.pair_pool``; it replaces another pair with the same index if need be."""
    problem, scratch = run.problem, run.scratch
    key = ((weighting * run.tables.contact_step.size + level) * problem.gap.size + r) * scratch.force.shape[0] + u + 1
    place = key % scratch.pool_keys.size
    if scratch.pool_keys[place] != key:
        rows = run.tables.block_response[weighting, level]
        fill_pair(
            *(problem.k, problem.c, push_of(problem, u), problem.read[r], problem.read_rate[r]),
            *(rows, scratch.pair_weights, scratch.pair_pool[place]),
        )
        scratch.pool_keys[place] = key
    return place


@part(FREE_BLOCKS, types.void, types.int64, types.int64, VECTOR)
def free_block_motion(run, node_set, level, x):
    """Write p and v of all blocks at the nodes, from the state x at the start of the step and without forces."""
    problem = run.problem
    n, block_motion = problem.k.size, run.scratch.block_motion
    ahead = run.tables.node_propagator[run.tables.kind[node_set], level]
    for b in range(n):
        p, v = splat8(x[b]), splat8(x[n + b])
        alpha, beta = load8(ahead[0, b], 0), load8(ahead[1, b], 0)
        store8(block_motion[b], 0, alpha * p + beta * v)
        store8(block_motion[n + b], 0, alpha * v - beta * (splat8(problem.k[b]) * p + splat8(problem.c[b]) * v))


@inner
def _sum_pushes(run, force, node_set, group):
    """Rates of the blocks by one group of inputs at the nodes, into ``scratch.block_force``; False if none acts."""
    problem = run.problem
    rows, size, own, found = problem.gap.size, problem.k.size, run.tables.block_response.shape[3] // 2, False
    for u in range(force.shape[0]):
        if (u >= rows) != (group == SIGNALS) or (u < rows and not acts(problem, run.state, u)):
            continue
        if enters(problem, node_set, u) != (group == ENTERING):
            continue
        push = push_of(problem, u)
        values = load8(force[u], 0)
        for e in range(2 * own):
            before = load8(run.scratch.block_force[e], 0) if found else splat8(0.0)
            store8(run.scratch.block_force[e], 0, before + splat8(push[e if e < own else e - own + size]) * values)
        found = True
    return found


@part(PUSHED_BLOCKS, types.void, *[types.int64] * 3, MATRIX)
def add_block_motion(run, node_set, level, group, motion):
    """Add the response to one group of inputs, signals or forces, to the blocks' motion at the nodes."""
    problem, tables = run.problem, run.tables
    if not _sum_pushes(run, run.scratch.force, node_set, group):
        return
    n, own, block_force = problem.k.size, tables.block_response.shape[3] // 2, run.scratch.block_force
    weighting = tables.entering[node_set] if group == ENTERING else tables.kind[node_set]
    for j in range(S):
        rows = tables.block_response[weighting, level, j]
        for b in range(own):
            p, v = block_force[b, j], block_force[own + b, j]
            alpha, beta = load8(rows[b], 0), load8(rows[own + b], 0)
            turned = splat8(problem.k[b] * p + problem.c[b] * v)
            store8(motion[b], 0, load8(motion[b], 0) + alpha * splat8(p) + beta * splat8(v))
            store8(motion[n + b], 0, load8(motion[n + b], 0) + alpha * splat8(v) - beta * turned)


@part(PUSHED_END, types.void, MATRIX, types.int64, types.int64, VECTOR)
def add_end_response(run, force, node_set, level, x):
    """Add the response to all forces and signals, at the end of the step, to the state x."""
    problem, tables = run.problem, run.tables
    n, own = problem.k.size, tables.block_response.shape[3] // 2
    for group in range(0 if problem.table_dt.size else 1, 3):
        if not _sum_pushes(run, force, node_set, group):
            continue
        weighting = tables.entering[node_set] if group == ENTERING else tables.kind[node_set]
        ending = tables.block_end_response[weighting, level]
        for b in range(own):
            p, v = load8(run.scratch.block_force[b], 0), load8(run.scratch.block_force[own + b], 0)
            alpha, beta = load8(ending[0, b], 0), load8(ending[1, b], 0)
            x[b] += sum8(alpha * p + beta * v)
            x[n + b] += sum8(alpha * v - beta * (splat8(problem.k[b]) * p + splat8(problem.c[b]) * v))


@inlined
def prefers_blocks(run):
    """Whether sums over the blocks take less time than sums over all pairs of rows in contact."""
    problem = run.problem
    n, active = problem.k.size, 0
    if not uses_blocks(run.tables):
        return False
    for r in range(problem.gap.size):
        active += 1 if acts(problem, run.state, r) else 0
    return active > FEW_AT_ONCE and S * active * active > 3 * n * (active + S)


@inner
def respond_through_blocks(run, node_set, level):
    """Displacement and rate of all rows in contact at the nodes under the present forces, into ``scratch.motion``."""
    problem, scratch = run.problem, run.scratch
    size, moved = 2 * problem.k.size, scratch.along
    for e in range(size):
        store8(moved[e], 0, splat8(0.0))
    add_block_motion(run, node_set, level, CONTINUING, moved)
    add_block_motion(run, node_set, level, ENTERING, moved)
    for r in range(problem.gap.size):
        if acts(problem, run.state, r):
            combine(moved, problem.read[r], size, scratch.free[r, 0], scratch.motion[r, 0])
            combine(moved, problem.read_rate[r], size, scratch.free[r, 1], scratch.motion[r, 1])


@part(STOP_AT_NODES, types.void, types.int64, REAL, MATRIX)
def motion_at_nodes(run, r, gap, out):
    """Displacement less ``gap``, and rate, of row r at the nodes from the motion of the blocks."""
    problem = run.problem
    size = 2 * problem.k.size
    store8(out[0], 0, splat8(-gap))
    combine(run.scratch.block_motion, problem.read[r], size, out[0], out[0])
    combine(run.scratch.block_motion, problem.read_rate[r], size, None, out[1])
