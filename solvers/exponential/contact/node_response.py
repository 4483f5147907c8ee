"""What the stops see on a step of contact: indentations and rates at the nodes, free and under given forces."""

from __future__ import annotations

from typing import Any, NamedTuple

from solvers.compiled.kernels import inlined, inner, law_forces, table_value
from solvers.compiled.simd import put, spread
from solvers.compiled.state import CALLS, T
from solvers.compiled.sums import above_zero, combine
from solvers.exponential.contact.nodes import S


class Space(NamedTuple):
    """Working arrays of the exponential integrator; stops are the first index of the contact ones."""

    x_new: Any  # (x.size padded,)
    terms: Any  # (14, 2N padded) derivatives of the state
    six: Any  # (tables, 6) derivatives of the signals
    values: Any  # (14,)
    norms: Any  # (N,)
    bounds: Any  # (L,)
    m: Any  # (m,)
    apart: Any  # (2, N padded) p and v of the blocks
    motion: Any  # (m, 2, S) indentations and their rates at the nodes
    clipped: Any  # (S,)
    free: Any  # (m, 2, S)
    force: Any  # (m + L, S) forces of the stops, then values of the signals
    trial: Any  # (S,)
    summary: Any  # (m, 2, 8) of the forces and the indentations, see Tables.summary
    previous: Any  # (m, S) forces of the last accepted step
    slope: Any  # (m, 3, S) derivatives of the laws at the nodes
    jacobian: Any  # (m S, m S)
    residual: Any  # (m S,)
    pivots: Any  # (m S,)
    work: Any  # (18, x.size + 2 padded) of the Runge–Kutta steps
    scale: Any  # (m,) m/s: a step's error in an indentation rate is measured in rtol × scale
    share: Any  # (m,) of the duration of a contact of each stop that its first step may take; 0: not known yet
    accuracy: Any  # (m,) N: change of a force within which it counts as found
    beyond: Any  # (m,) N s: impulse that a step's polynomials leave out
    guess: Any  # (m, S) forces the iterations begin with
    viscous: Any  # (m,) N s/m: slope of a force by its rate, where Newton's method has found it; else 0
    around: Any  # (4, 3S) see `peaks`
    side: Any  # (m,) sign of the side of its bend on which each stop is
    sides: Any  # (S + 2,) see `crossings`
    reach: Any  # (1,) radians of the fastest block that a landing may take
    duration: Any  # (1,) s, that of the contact begun last, if it were free
    book: Any  # (2 + L, numbers) see `books`
    energy: Any  # (3,) see `energy_guard`
    last: Any  # (6,) see `contact_step`


@inner
def sample_signals(problem, tables, space, family, t, h):
    """Values of the sampled signals at the nodes of a step."""
    for j in range(problem.table_dt.size):
        for i in range(S):
            space.force[problem.gap.size + problem.table_load[j], i] = table_value(
                problem, j, t + h * tables.times[family, i]
            )


@inner
def free_response(problem, tables, state, space, family, level):
    """Indentations and rates at the nodes without the contact forces, signals included."""
    stops, size = problem.gap.size, 2 * problem.k.size
    if problem.table_dt.size:
        sample_signals(problem, tables, space, family, state.now[T], tables.step[level])
    for s in range(stops):
        free = space.free[s]
        put(free[0], 0, spread(-problem.gap[s]))
        put(free[1], 0, spread(0.0))
        combine(tables.free[family, level, s], state.x, size, free, free)
        for j in range(problem.table_dt.size):
            u = stops + problem.table_load[j]
            combine(tables.forced[family, level, s, u], space.force[u], S, free, free)


@inlined
def respond(problem, tables, state, space, family, level, s):
    """Indentation and rate of stop s at the nodes under the present forces."""
    motion, start = space.motion[s], space.free[s]
    for u in range(problem.gap.size):
        if state.piece[u] > 0:
            combine(tables.forced[family, level, s, u], space.force[u], S, start, motion)
            start = motion


@inlined
def node_forces(problem, state, space, s):
    """The law of stop s at the nodes, into ``space.trial``."""
    above_zero(space.motion[s, 0], space.clipped)
    law_forces(problem, s, S, space.clipped, space.motion[s, 1], state.entry_rate[s], space.trial)
    state.count[CALLS] += S
