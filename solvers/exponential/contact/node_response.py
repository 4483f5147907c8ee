"""What the stops see on a step of contact: indentations and rates at the nodes, free and under given forces."""

from __future__ import annotations

from typing import Any, NamedTuple

from solvers.compiled.dop853_tableau import STAGES
from solvers.compiled.kernels import inlined, inner, law_forces, reordered, table_value
from solvers.compiled.simd import splat8, store8
from solvers.compiled.state import CALLS, T
from solvers.compiled.sums import clip_negative, combine
from solvers.exponential.contact.many_stops import (
    SIGNALS,
    add_block_motion,
    free_block_motion,
    motion_at_nodes,
    pair_response,
    uses_blocks,
)
from solvers.exponential.contact.nodes import S

DIFFERENCE, BATCH, LANDED, WITHIN, START = range(STAGES + 1, STAGES + 6)
"""Rows of `Scratch.work` behind the stages of a landing's Runge–Kutta step and the rate at its end: its embedded
difference; numbers for one law call; trial states, at last the one landed on; a state within a step, for the energy
ledger; the state a landing begins with, or the end of a run within a step."""
PLAIN, WEIGHTED, PRODUCTS = range(3)  # the first rows while a force is interpolated between the nodes, see `energy`
DELTAS, RATES, FORCES, KNOWN = range(
    4
)  # rows of `Scratch.around`: m, m/s, N at points around a node; what they are from


class Scratch(NamedTuple):
    """Working arrays of the exponential integrator; stops are the first index of the contact ones.

    Written by kernels only. `previous` and what has one number per stop may last from step to step, what is at the
    nodes is new in each. States are block coordinates, for mass-normalised modes in √kg m and √kg m/s, then the ledger
    in J, and J and N s per stop; indentations are in m, rates in m/s, forces in N, signals in their own units.
    """

    x_new: Any  # (x.size padded,)
    terms: Any  # (14, 2N padded) derivatives of the state
    signal_terms: Any  # (tables, 6) derivatives of the signals
    values: Any  # (14,)
    norms: Any  # (N,)
    signal_bounds: Any  # (L,)
    per_stop: Any  # (m,)
    split_state: Any  # (2, N padded) p and v of the blocks
    motion: Any  # (m, 2, S) indentations and their rates at the nodes
    clipped: Any  # (S,)
    free: Any  # (m, 2, S)
    force: Any  # (m + L, S) forces of the stops, then values of the signals
    trial: Any  # (S,)
    summary: Any  # (m, 2, 8) of the forces and the indentations, see Tables.summary
    previous: Any  # (m, S) forces of the last accepted step
    slope: Any  # (m, 3, S) derivatives of the laws at the nodes
    residual: Any  # (m S,)
    pivots: Any  # (m S,)
    stages: Any  # (START + 1, x.size + 2 padded) states and rates, rows as named above
    reference_speed: Any  # (m,) m/s: a step's error in an indentation rate is measured in rtol × scale
    first_step_share: (
        Any  # (m,) of the duration of a contact of each stop that its first step may take; 0: not known yet
    )
    force_tolerance: Any  # (m,) N: change of a force within which it counts as found
    unresolved: Any  # (m,) N s: impulse that a step's polynomials leave out
    guess: Any  # (m, S) forces the iterations begin with
    viscous: Any  # (m,) N s/m: slope of a force by its rate, where Newton's method has found it; else 0
    local_motion: Any  # (4, 3S) rows as named above, see `peaks`
    side: Any  # (m,) sign of the side of its bend on which each stop is
    side_at_begin: Any  # (m,) the same at the begin of the step that is tried
    bend_values: Any  # (S + 2,) see `crossings`
    landing_reach: Any  # (1,) radians of the fastest block that a landing may take
    duration: Any  # (1,) s, that of the contact begun last, if it were free
    energy_sums: Any  # (2 + L, numbers) see `energy_tables`
    energy: Any  # (3,) see `energy.check`
    control: Any  # (6,) see `step`
    start_motion: Any  # (m, 2) δ and δ̇ at the begin of the step
    block_motion: Any  # (2N, S) of many stops, as the rest but for the matrix, see `blocks`
    block_force: Any  # (2N, S)
    pair_weights: Any  # (2N,)
    jacobian: Any  # (m S, m S) used up to the stops that touch together; from here on runs find what others left
    pair_pool: Any  # (POOL, S, 2S)
    pool_keys: Any  # (POOL,) which pairs these are


@inner
def sample_signals(problem, tables, scratch, node_set, t, h):
    """Values of the sampled signals at the nodes of a step."""
    for j in range(problem.table_dt.size):
        for i in range(S):
            scratch.force[problem.gap.size + problem.table_load[j], i] = table_value(
                problem, j, t + h * tables.times[node_set, i]
            )


@inner
def free_response(problem, tables, state, scratch, node_set, level):
    """Indentations and rates at the nodes without the contact forces, signals included; of many stops the touching."""
    stops, size, through = problem.gap.size, 2 * problem.k.size, uses_blocks(tables)
    if problem.table_dt.size:
        sample_signals(problem, tables, scratch, node_set, state.now[T], tables.contact_step[level])
    if through:
        free_block_motion(problem, tables, scratch, node_set, level, state.x)
        if problem.table_dt.size:
            add_block_motion(problem, tables, state, scratch, node_set, level, SIGNALS)
    for s in range(stops):
        free = scratch.free[s]
        if through:
            if state.segment[s] > 0:
                motion_at_nodes(problem, scratch, s, problem.gap[s], free)
            continue
        store8(free[0], 0, splat8(-problem.gap[s]))
        store8(free[1], 0, splat8(0.0))
        combine(tables.free[tables.kind[node_set], level, s], state.x, size, free, free)
        for j in range(problem.table_dt.size):
            u = stops + problem.table_load[j]
            combine(tables.forced[tables.kind[node_set], level, u, s], scratch.force[u], S, free, free)


@inlined
def respond(problem, tables, state, scratch, node_set, level, s):
    """Indentation and rate of stop s at the nodes under the present forces."""
    motion, start = scratch.motion[s], scratch.free[s]
    for u in range(problem.gap.size):
        if state.segment[u] > 0:
            combine(pair_response(problem, tables, scratch, node_set, level, s, u), scratch.force[u], S, start, motion)
            start = motion


@reordered
def ripple_of(ripple_weight, alias, x, n):
    """Error of a stop's indentation between the nodes of a step from the state x."""
    error = 0.0
    for b in range(n):
        error += ripple_weight[b] * (alias[b] * abs(x[b]) + alias[n + b] * abs(x[n + b]))
    return error


@inlined
def node_forces(problem, state, scratch, s):
    """The law of stop s at the nodes, into ``scratch.trial``."""
    clip_negative(scratch.motion[s, 0], scratch.clipped)
    law_forces(problem, s, S, scratch.clipped, scratch.motion[s, 1], state.entry_rate[s], scratch.trial)
    state.count[CALLS] += S
