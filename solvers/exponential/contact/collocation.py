"""Contact: propagate the linear structure exactly, collocate the force alone.

On a step of length h the unknowns are the forces at S nodes of every stop in contact, whatever the number of modes:

    δ(t_i) = free response + Σ_u Σ_j C_ij F_uj,   the same for δ̇,   F_sj ← law_s(δ(t_j), δ̇(t_j))

iterated from the extrapolated polynomial of the step before. The state at the end is E(h) y + Σ kick F. The first
step of a law with broken powers of δ uses t = h σ^κ and F = σ^λ g(σ), which restores full order at the singular start
(see `nodes`); the last one, onto δ = 0, is one Runge–Kutta step in δ^{1/κ} (see `landing`).

Step control: with A₁ >= A₂ the sizes of the last two and the two before of the force's S Jacobi coefficients, the force
beyond the polynomial is taken as A₁ max((A₁/A₂)^{S/2}, A₁/F_max), and what it does to the indentation rate of every
stop, open or closed, is compared with rtol × a reference speed of that stop. Fast modes whose oscillation the nodes
cannot follow are charged for it, and so is the tail of the sampled signals, whose cells may be shorter than the step. A
kink of the law between an end of the step and the nearest node leaves no trace in the coefficients; there law and
polynomial are compared.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.compiled.kernels import contact_forces, contact_gradient, copy, dot, indentation, inlined, inner
from solvers.compiled.simd import eight, total
from solvers.compiled.state import CALLS, PEAK_DELTA, PEAK_FORCE, T, is_open
from solvers.compiled.sums import combine, renew, sweep
from solvers.exponential.contact.blocks import goes_through_blocks, kick, pair, way_of
from solvers.exponential.contact.node_newton import MOST_ITERATIONS, newton
from solvers.exponential.contact.node_response import node_forces, respond, ripple_of
from solvers.exponential.contact.nodes import S
from solvers.exponential.contact.peaks import step_peaks
from solvers.exponential.tables import DAMPING, EXPONENT, FACTOR, STIFFNESS


@inlined
def _alone(tables, state):
    """The stop in contact if there is but one and its law is inlined, else -1."""
    alone, count = -1, 0
    for s in range(state.piece.size):
        if state.piece[s] > 0:
            alone, count = s, count + 1
    return alone if count == 1 and tables.inlined[alone, EXPONENT] > 0.0 else -1


@inlined
def _iterate(problem, tables, state, space, family, level):
    """One iteration for the forces of all stops in contact: squares of their change and size, in units of accuracy."""
    change, largest = 0.0, 0.0
    for s in range(problem.gap.size):
        if state.piece[s] > 0:
            respond(problem, tables, state, space, family, level, s)
    for s in range(problem.gap.size):
        if state.piece[s] > 0:
            node_forces(problem, state, space, s)
            moved, size = renew(space.force[s], space.trial)
            unit = 1.0 / space.accuracy[s] ** 2
            change, largest = change + moved * unit, largest + size * unit
    return change, largest


@inner
def _set_accuracy(problem, tables, state, space, h, rtol):
    """Change of each stop's force, N, that moves no indentation rate by more than a twentieth of its tolerance.

    Returns whether a dashpot is so strong that iterations will diverge, by its slope where Newton used it last.
    """
    stiff = False
    for u in range(problem.gap.size):
        if state.piece[u] > 0:
            most = 1e-300
            for s in range(problem.gap.size):
                most = max(most, abs(tables.mobility[s, u]) / space.scale[s])
            space.accuracy[u] = 0.05 * rtol / (h * most)
            stiff |= h * tables.mobility[u, u] * space.viscous[u] > 1.0
            copy(space.force[u], space.guess[u], S)
    for u in range(problem.gap.size if not stiff else 0):
        space.viscous[u] = 0.0
    return stiff


@inner
def solve_forces(problem, tables, state, space, family, level, rtol):
    """Fixed point of the forces; whether it was found."""
    if _set_accuracy(problem, tables, state, space, tables.step[level], rtol):
        return newton(problem, tables, state, space, family, level)
    before, alone = 0.0, _alone(tables, state)
    law, unit = tables.inlined[max(alone, 0)], 1.0 / space.accuracy[max(alone, 0)] ** 2
    own = pair(problem, tables, space, family, level, max(alone, 0), max(alone, 0))
    stiffness, rooted, damping = law[STIFFNESS], law[EXPONENT] == 1.5, law[DAMPING]
    factor = law[FACTOR] / state.entry_rate[max(alone, 0)]
    for iteration in range(MOST_ITERATIONS):
        if alone >= 0:
            change, largest = sweep(
                *(own, space.free[alone], space.force[alone], space.motion[alone]),
                *(stiffness, rooted, factor, damping),
            )
            change, largest = change * unit, largest * unit
            state.count[CALLS] += S
        else:
            change, largest = _iterate(problem, tables, state, space, family, level)
        if not change < np.inf:
            break
        settled, change = change <= 1e-27 * largest, math.sqrt(change)
        if iteration == 0:
            before = change / 0.3  # as iterations usually go
        # changes that shrink by r = change/before, taken as 1/20 at least, 0.9 at most, add up to change r/(1 - r) more
        if settled or (change <= 20.0 and change * change <= max(before - change, change / 9.0)):
            return True
        if iteration > 2 and change > 0.6 * before:
            break
        before = change
    for u in range(problem.gap.size):
        copy(space.guess[u], space.force[u], S)
    return newton(problem, tables, state, space, family, level)


@inlined
def _top(values):
    """The largest of node values, or 0."""
    best = 0.0
    for i in range(S):
        best = max(best, values[i])
    return best


@inlined
def _size(values):
    """Largest size of node values."""
    best = 0.0
    for i in range(S):
        best = max(best, abs(values[i]))
    return best


@inlined
def _largest(problem, tables, state, space, u):
    """Largest force of a stop on the step, N, and its stiffness there, N/m."""
    if problem.levels[u, 0] == 0.0:
        largest = _top(space.force[u])
        return largest, tables.exponent[u] * largest / max(_top(space.motion[u, 0]), 1e-300)
    copy(space.motion[u, 0], space.clipped, S)
    slope = space.slope[u]
    contact_gradient(problem, u, space.clipped, space.motion[u, 1], state.entry_rate[u], slope[0], slope[1], slope[2])
    return _size(space.force[u]), _size(slope[0])


@inner
def step_error(problem, tables, state, space, family, level, fresh, rtol):
    """Error of the indentation rates by the forces' unresolved part, in units of each stop's tolerance; the largest.

    On an entry step the force of the stop that enters is integrated by Gauss's rule, those of the others are not.
    """
    n, stops, h = problem.k.size, problem.gap.size, tables.step[level]
    for u in range(stops):
        space.beyond[u] = 0.0
        if state.piece[u] == 0:
            continue
        gauss = family == 0 or u == family - 1
        combine(tables.summary[family], space.force[u], S, None, space.summary[u, 0])
        largest, stiffness = _largest(problem, tables, state, space, u)
        if gauss:
            beyond = _beyond(space.summary[u, 0], largest, S // 2)
        else:
            combine(tables.tail[family], space.force[u], S, None, space.trial)
            beyond = _beyond(space.trial, largest, 1)
        if family == 0 and tables.inlined[u, EXPONENT] == 0.0:
            beyond += 0.01 * _hidden_kink(problem, state, space, u, largest, fresh)
        if beyond == 0.0:
            continue
        ripple = ripple_of(tables.sway[u], tables.alias[tables.kind[family], level], state.x, n)
        span = h / max(1.0, h * tables.mobility[u, u] * space.viscous[u])  # a strong dashpot damps such errors
        space.beyond[u] = span * (beyond + 0.1 * stiffness * ripple)
    _sum_errors(problem, tables, space, family, h)
    worst = 0.0
    for s in range(stops):
        error = space.m[s] / (rtol * max(space.scale[s], _size(space.motion[s, 1])))
        if not error <= worst:
            worst = error
            if error != error:
                break
    return worst


@inner
def _sum_errors(problem, tables, space, family, h):
    """Errors of all indentation rates, m/s, by what the forces' and the signals' polynomials leave out."""
    stops, error = problem.gap.size, space.m
    for s in range(stops):
        error[s] = 0.0
    for j in range(problem.table_dt.size):
        beyond = h * _beyond_signal(problem, tables, space, family, j)
        for s in range(stops):
            error[s] += abs(tables.direct[s, problem.table_load[j]]) * beyond
    for u in range(stops):
        if space.beyond[u] != 0.0:
            for s in range(stops):
                error[s] += abs(tables.mobility[s, u]) * space.beyond[u]


@inner
def _hidden_kink(problem, state, space, u, largest, fresh):
    """Force, in N, by which law and polynomial differ at an end of a smooth step, if no coefficient explains it.

    The law then bends between that end and the next node, a fiftieth of the step at most: clamp=True does.
    """
    size, delta, rate = 2 * problem.k.size, space.clipped[0:2], space.trial[0:2]
    delta[0], rate[0] = indentation(problem, u, space.x_new), dot(problem.read_rate[u], space.x_new, size)
    delta[1], rate[1] = indentation(problem, u, state.x), dot(problem.read_rate[u], state.x, size)
    contact_forces(problem, u, delta, rate, state.entry_rate[u], space.trial[2:4])
    c = space.summary[u, 0]
    apart = abs(space.trial[2] - c[5])
    if not fresh:  # one that begins on a knot may begin with a jump
        apart = max(apart, abs(space.trial[3] - c[4]))
    return apart if apart > 2.0 * max(abs(c[2]), abs(c[3])) + 1e-12 * largest else 0.0


@inlined
def _beyond(coefficients, largest, power):
    """Size of what a polynomial leaves out, from its last four coefficients."""
    before = max(abs(coefficients[0]), abs(coefficients[1]))
    last = max(abs(coefficients[2]), abs(coefficients[3]))
    if last <= 1e-14 * largest:
        return 0.0
    decay = min(last / before, 1.0) if before > 0.0 else 1.0
    return last * max(decay**power, min(last / largest, 1.0))


@inner
def _beyond_signal(problem, tables, space, family, j):
    """The same of a sampled signal, which an entry step integrates at half the order."""
    values, largest = space.force[problem.gap.size + problem.table_load[j]], 0.0
    for i in range(S):
        largest = max(largest, abs(values[i]))
    combine(tables.tail[family], values, S, None, space.trial)
    return _beyond(space.trial, largest, S // 2 if family == 0 else 1)


@inner
def arrive(problem, tables, state, space, family, level):
    """State at the end of the step, into ``space.x_new``."""
    x, n = space.x_new, problem.k.size
    if goes_through_blocks(tables):
        for e in range(2 * n):
            x[e] = 0.0
        kick(problem, tables, state, space, space.force, family, level, x)
    first = True
    for u in range(0 if goes_through_blocks(tables) else space.force.shape[0]):
        if u >= problem.gap.size or state.piece[u] > 0:
            rows = tables.kick[way_of(tables, family, u), level, u]
            if first:
                combine(rows, space.force[u], S, None, x)
            else:
                combine(rows, space.force[u], S, x, x)
            first = False
    alpha, beta = tables.step_propagator[level, 0], tables.step_propagator[level, 1]
    for b in range(n):
        p, v = state.x[b], state.x[n + b]
        x[b] += alpha[b] * p + beta[b] * v
        x[n + b] += alpha[b] * v - beta[b] * (problem.k[b] * p + problem.c[b] * v)


@inner
def finish_step(problem, tables, state, space, family, level):
    """Move the state to the end of the step; ledger and peaks of the contacts."""
    stops, size = problem.gap.size, 2 * problem.k.size
    h = tables.step[level]
    for s in range(stops):
        if state.piece[s] > 0:
            weights = tables.weights[family] if family == 0 or s == family - 1 else tables.plain[family]
            impulses = eight(weights, 0) * eight(space.force[s], 0)
            state.x[size + 2 + 2 * s] += h * total(impulses * eight(space.motion[s, 1], 0))
            state.x[size + 3 + 2 * s] += h * total(impulses)
            if is_open(problem, s):
                continue
            if problem.levels[s, 0] == 0.0 or problem.opening[s] >= 0:
                step_peaks(problem, tables, state, space, family, h, s, 1.0)
            else:
                state.open[s, PEAK_DELTA] = max(state.open[s, PEAK_DELTA], _size(space.motion[s, 0]))
                state.open[s, PEAK_FORCE] = max(state.open[s, PEAK_FORCE], _size(space.force[s]))
    copy(space.x_new, state.x, size)
    state.now[T] += h


@inner
def contact_time(problem, tables, space, s, speed):
    """Duration a free impact at this speed would have, from the law's energy: T = 3.2 δ_m/v."""
    speed = max(speed, 1e-12)
    mobility = max(tables.mobility[s, s], 1e-300)
    target = 0.5 * speed * speed / mobility
    p = tables.exponent[s]
    deepest = 1e-3 * speed
    for _ in range(4):  # a law that is no power needs more than one
        space.clipped[0], space.trial[0] = deepest, 0.0
        contact_forces(problem, s, space.clipped[0:1], space.trial[0:1], speed, space.trial[1:2])
        energy = space.trial[1] * deepest / (p + 1.0)
        if not energy > 0.0 or abs(target - energy) < 0.1 * target:
            break
        deepest *= (target / energy) ** (1.0 / (p + 1.0))
    return 3.2 * deepest / speed
