r"""Contact: propagate the linear structure exactly, collocate the force alone.

On a step of length h the unknowns are the forces at S nodes of every stop in contact, whatever the number of modes:

    δ(t_i) = free response + Σ_u Σ_j C_ij F_uj,   the same for δ̇,   F_sj ← law_s(δ(t_j), δ̇(t_j))

iterated from the extrapolated polynomial of the step before. The state at the end is E(h) y + Σ kick F. The first
step of a power law with a broken exponent uses t = h s² and F = s^{2p} g(s), which restores full order at the
singular start; the last one, onto δ = 0, is one Runge–Kutta step in √δ (see `solvers.regular`).

Step control: with A₁ >= A₂ the sizes of the last two and the two before of the force's S Jacobi coefficients, the force
beyond the polynomial is taken as A₁ max((A₁/A₂)^{S/2}, A₁/F_max), and what it does to the indentation rate is
compared with rtol × a reference speed. Fast modes whose oscillation the nodes cannot follow are charged for it.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from solvers.flight import add_taylor, energy_norms, taylor, turn
from solvers.kernels import contact_forces, contact_gradient, copy, dot, indentation, inlined, inner, table_value
from solvers.state import CALLS, PEAK_DELTA, PEAK_FORCE, T, touching
from solvers.tables import S, propagate

_MOST_ITERATIONS = 16
ACCEPTED, TOO_LONG = 0, 1


class Space(NamedTuple):
    """Working arrays of the exponential integrator; stops are the first index of the contact ones."""

    x_new: Any  # (x.size,)
    terms: Any  # (7, 2N) derivatives of the state
    six: Any  # (tables, 6) derivatives of the signals
    values: Any  # (7,)
    norms: Any  # (N,)
    bounds: Any  # (L,)
    m: Any  # (m,)
    delta: Any  # (m, S)
    rate: Any  # (m, S)
    clipped: Any  # (S,)
    free: Any  # (m, 2, S)
    force: Any  # (m + L, S) forces of the stops, then values of the signals
    trial: Any  # (S,)
    previous: Any  # (m, S) forces of the last accepted step
    slope: Any  # (m, 3, S) derivatives of the laws at the nodes
    jacobian: Any  # (m S, m S)
    residual: Any  # (m S,)
    pivots: Any  # (m S,)
    work: Any  # (18, x.size + 2) of the Runge–Kutta steps


@inner
def sample_signals(problem, tables, space, family, t, h):
    """Values of the sampled signals at the nodes of a step."""
    for j in range(problem.table_dt.size):
        for i in range(S):
            space.force[problem.gap.size + problem.table_load[j], i] = table_value(
                problem, j, t + h * tables.times[family, i]
            )


@inlined
def free_response(problem, tables, state, space, family, level):
    """Indentations and rates at the nodes without the contact forces, signals included."""
    stops, size = problem.gap.size, 2 * problem.k.size
    if problem.table_dt.size:
        sample_signals(problem, tables, space, family, state.now[T], tables.step[level])
    for s in range(stops):
        for d in range(2):
            rows = tables.free[family, level, s, d]
            for i in range(S):
                value = dot(rows[i], state.x, size) - (problem.gap[s] if d == 0 else 0.0)
                for j in range(problem.table_dt.size):
                    u = stops + problem.table_load[j]
                    value += dot(tables.forced[family, level, s, u, d, i], space.force[u], S)
                space.free[s, d, i] = value


@inlined
def respond(problem, tables, state, space, family, level, s):
    """Indentation and rate of stop s at the nodes under the present forces."""
    for d in range(2):
        target = space.delta[s] if d == 0 else space.rate[s]
        for i in range(S):
            target[i] = space.free[s, d, i]
        for u in range(problem.gap.size):
            if state.piece[u] > 0:
                matrix = tables.forced[family, level, s, u, d]
                for i in range(S):
                    target[i] += dot(matrix[i], space.force[u], S)


@inner
def linearise(problem, tables, state, space, family, level):
    """J = 1 - ∂law/∂(δ, δ̇) ∂(δ, δ̇)/∂F of all nodes of all stops in contact, row by row; returns its size."""
    stops, row = problem.gap.size, 0
    for s in range(stops):
        if state.piece[s] == 0:
            continue
        copy(space.delta[s], space.clipped, S)
        contact_gradient(
            *(problem, s, space.clipped, space.rate[s], state.entry_rate[s]),
            *(space.slope[s, 0], space.slope[s, 1], space.slope[s, 2]),
        )
        state.count[CALLS] += S
        for i in range(S):
            column = 0
            for u in range(stops):
                if state.piece[u] == 0:
                    continue
                matrix = tables.forced[family, level, s, u]
                for j in range(S):
                    value = space.slope[s, 0, i] * matrix[0, i, j] + space.slope[s, 1, i] * matrix[1, i, j]
                    space.jacobian[row + i, column + j] = (1.0 if s == u and i == j else 0.0) - value
                column += S
        row += S
    return row


@inner
def factorise(matrix, pivots, n):
    """LU factors with partial pivoting, in place (Golub, Van Loan, Matrix Computations, Section 3.4)."""
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        pivots[k] = best
        for j in range(n):
            matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
        for i in range(k + 1, n):
            matrix[i, k] /= matrix[k, k]
            for j in range(k + 1, n):
                matrix[i, j] -= matrix[i, k] * matrix[k, j]


@inner
def substitute(matrix, pivots, n, x):
    """Solve with the factors, in place."""
    for k in range(n):
        best = pivots[k]
        x[k], x[best] = x[best], x[k]
    for i in range(n):
        for j in range(i):
            x[i] -= matrix[i, j] * x[j]
    for i in range(n - 1, -1, -1):
        for j in range(i + 1, n):
            x[i] -= matrix[i, j] * x[j]
        x[i] /= matrix[i, i]


@inner
def newton(problem, tables, state, space, family, level, accuracy):
    """Newton's method for the forces, where a stiff or strongly damped law defeats the plain iteration."""
    stops = problem.gap.size
    for _ in range(_MOST_ITERATIONS):
        row = 0
        for s in range(stops):
            if state.piece[s] == 0:
                continue
            respond(problem, tables, state, space, family, level, s)
            copy(space.delta[s], space.clipped, S)
            contact_forces(problem, s, space.clipped, space.rate[s], state.entry_rate[s], space.trial)
            state.count[CALLS] += S
            for i in range(S):
                space.residual[row + i] = space.trial[i] - space.force[s, i]
            row += S
        n = linearise(problem, tables, state, space, family, level)
        factorise(space.jacobian, space.pivots, n)
        substitute(space.jacobian, space.pivots, n, space.residual)
        change, largest, row = 0.0, 0.0, 0
        for s in range(stops):
            if state.piece[s] > 0:
                for i in range(S):
                    space.force[s, i] += space.residual[row + i]
                    change = max(change, abs(space.residual[row + i]))
                    largest = max(largest, abs(space.force[s, i]))
                row += S
        if not change < np.inf:
            return False
        if change <= accuracy or change <= 1e-14 * largest:
            return True
    return False


@inlined
def solve_forces(problem, tables, state, space, family, level, accuracy):
    """Fixed point of the forces to ``accuracy`` in N; whether it was found."""
    stops = problem.gap.size
    before = np.inf
    ratio = 0.3
    for iteration in range(_MOST_ITERATIONS):
        change, largest = 0.0, 0.0
        for s in range(stops):
            if state.piece[s] > 0:
                respond(problem, tables, state, space, family, level, s)
        for s in range(stops):
            if state.piece[s] == 0:
                continue
            copy(space.delta[s], space.clipped, S)
            contact_forces(problem, s, space.clipped, space.rate[s], state.entry_rate[s], space.trial)
            state.count[CALLS] += S
            for i in range(S):
                change = max(change, abs(space.trial[i] - space.force[s, i]))
                largest = max(largest, abs(space.trial[i]))
                space.force[s, i] = space.trial[i]
        if not change < np.inf:
            return False
        if iteration > 0:
            ratio = min(change / before, 0.9)
        if change * ratio <= (1.0 - ratio) * accuracy or change <= 1e-15 * largest:
            return True
        if iteration > 2 and ratio > 0.6:
            break
        before = change
    return newton(problem, tables, state, space, family, level, accuracy)


@inlined
def step_error(problem, tables, state, space, family, level):
    """Error of the indentation rate, m/s, that the forces' unresolved part makes; the largest over the stops."""
    stops, n = problem.gap.size, problem.k.size
    h = tables.step[level]
    energy_norms(problem, state.x, space.norms)
    worst = 0.0
    for s in range(stops):
        error = 0.0
        for u in range(stops):
            if state.piece[u] == 0:
                continue
            last, before, largest, deepest = 0.0, 0.0, 0.0, 0.0
            for i in range(S):
                largest = max(largest, abs(space.force[u, i]))
                deepest = max(deepest, space.delta[u, i])
            for i in range(4):
                coefficient = abs(dot(tables.spectrum[family, i], space.force[u], S))
                if i < 2:
                    before = max(before, coefficient)
                else:
                    last = max(last, coefficient)
            if last <= 1e-14 * largest:
                continue
            decay = min(last / before, 1.0) if before > 0.0 else 1.0
            beyond = last * max(decay ** (S // 2), min(last / largest, 1.0))
            ripple = 0.0
            for b in range(n):
                if tables.alias[family, level, b] > 1e-13 and problem.k[b] > 0.0:
                    row = abs(problem.read[u, b]) / math.sqrt(problem.k[b]) + abs(problem.read[u, n + b])
                    ripple += tables.alias[family, level, b] * row * space.norms[b]
            stiffness = tables.exponent[u] * largest / max(deepest, 1e-300)
            error += abs(tables.mobility[s, u]) * h * (beyond + 0.1 * stiffness * ripple)
        worst = max(worst, error)
    return worst


@inner
def _legendre(coefficients, x):
    """Legendre sum at x in [-1, 1] by Clenshaw's recurrence."""
    later, latest = 0.0, 0.0
    for k in range(S - 1, 0, -1):
        later, latest = (
            coefficients[k] + (2.0 * k + 1.0) / (k + 1.0) * x * later - (k + 1.0) / (k + 2.0) * latest,
            later,
        )
    return coefficients[0] + x * later - 0.5 * latest


@inner
def _peak(tables, family, values, known, coefficients):
    """Largest value of the polynomial through the node values, if it exceeds the known peak."""
    place = 0
    for i in range(S):
        if values[i] > values[place]:
            place = i
    if values[place] < 0.95 * known or values[place] <= 0.0:
        return known
    best = max(known, values[place])
    if family > 0:
        return best
    for k in range(S):
        coefficients[k] = dot(tables.legendre[k], values, S)
    nodes = tables.nodes[0]
    a = 2.0 * nodes[place - 1] - 1.0 if place > 0 else -1.0
    c = 2.0 * nodes[place + 1] - 1.0 if place < S - 1 else 1.0
    best = max(best, _legendre(coefficients, a), _legendre(coefficients, c))
    b = 2.0 * nodes[place] - 1.0
    fa, fb, fc = _legendre(coefficients, a), values[place], _legendre(coefficients, c)
    for _ in range(5):  # successive parabolas
        denominator = (b - a) * (fb - fc) - (b - c) * (fb - fa)
        if denominator == 0.0:
            break
        x = b - 0.5 * ((b - a) ** 2 * (fb - fc) - (b - c) ** 2 * (fb - fa)) / denominator
        if not a < x < c or x == b:
            break
        f = _legendre(coefficients, x)
        best = max(best, f)
        if x < b:
            if f > fb:
                c, fc, b, fb = b, fb, x, f
            else:
                a, fa = x, f
        elif f > fb:
            a, fa, b, fb = b, fb, x, f
        else:
            c, fc = x, f
    return best


@inlined
def arrive(problem, tables, state, space, family, level):
    """State at the end of the step, into ``space.x_new``."""
    size = 2 * problem.k.size
    copy(state.x, space.x_new, size)
    turn(problem, tables.step_propagator[level, 0], tables.step_propagator[level, 1], space.x_new)
    for u in range(space.force.shape[0]):
        if u >= problem.gap.size or state.piece[u] > 0:
            for j in range(S):
                force = space.force[u, j]
                row = tables.kick[family, level, u, j]
                for e in range(size):
                    space.x_new[e] += row[e] * force


@inlined
def leaves_piece(problem, tables, state, space, family, level):
    """Whether any stop crosses a border of its piece at a node or the end of the step."""
    for s in range(problem.gap.size):
        piece = state.piece[s]
        if piece == 0:
            respond(problem, tables, state, space, family, level, s)
        upper = problem.levels[s, piece]
        lower = problem.levels[s, piece - 1] if piece > 0 else -np.inf
        if not lower <= indentation(problem, s, space.x_new) <= upper:
            return True
        for i in range(S):
            if not lower <= space.delta[s, i] <= upper:
                return True
    return False


@inlined
def finish_step(problem, tables, state, space, family, level):
    """Move the state to the end of the step; ledger and peaks of the contacts."""
    stops, size = problem.gap.size, 2 * problem.k.size
    h = tables.step[level]
    copy(space.x_new, state.x, size)
    for s in range(stops):
        if state.piece[s] > 0:
            for i in range(S):
                state.x[size + 2 + 2 * s] += h * tables.weights[family, i] * space.force[s, i] * space.rate[s, i]
                state.x[size + 3 + 2 * s] += h * tables.weights[family, i] * space.force[s, i]
            state.open[s, PEAK_FORCE] = _peak(tables, family, space.force[s], state.open[s, PEAK_FORCE], space.trial)
            state.open[s, PEAK_DELTA] = _peak(tables, family, space.delta[s], state.open[s, PEAK_DELTA], space.trial)
    state.now[T] += h


@inner
def peaks_so_far(problem, tables, state, space, family, share, x):
    """Peaks of the contacts when the run ends at ``x``, within a step of which the ``share`` lies behind."""
    for s in range(problem.gap.size):
        if state.piece[s] == 0:
            continue
        space.clipped[0] = indentation(problem, s, x)
        space.clipped[1] = dot(problem.read_rate[s], x, 2 * problem.k.size)
        delta = space.clipped[0]
        contact_forces(*(problem, s, space.clipped[0:1], space.clipped[1:2], state.entry_rate[s], space.trial[0:1]))
        force = space.trial[0]
        for i in range(S):
            if tables.times[family, i] <= share:
                delta, force = max(delta, space.delta[s, i]), max(force, space.force[s, i])
        state.open[s, PEAK_DELTA] = max(state.open[s, PEAK_DELTA], delta)
        state.open[s, PEAK_FORCE] = max(state.open[s, PEAK_FORCE], force)


@inlined
def _between(nodes, exponent, values, sigma):
    """Value at σ of σ^exponent × the polynomial through the node values."""
    total = 0.0
    for j in range(S):
        term = values[j] * (sigma / nodes[j]) ** exponent if exponent > 0.0 else values[j]
        for i in range(S):
            if i != j:
                term *= (sigma - nodes[i]) / (nodes[j] - nodes[i])
        total += term
    return total


@inlined
def powers(problem, tables, t, x):
    """Power of the loads and of the damping at time t, W."""
    size, gain, loss = 2 * problem.k.size, 0.0, 0.0
    for load in range(tables.power_rows.shape[0]):
        gain += dot(tables.signal_rows[load], x, size) * dot(tables.power_rows[load], x, size)
    for j in range(problem.table_dt.size):
        gain += table_value(problem, j, t) * dot(tables.power_rows[problem.table_load[j]], x, size)
    for r in range(tables.loss_rows.shape[0]):
        loss += dot(tables.loss_rows[r], x, size) ** 2
    return gain, loss


@inner
def inside(problem, tables, state, space, family, h, span, row):
    """State at ``span`` after the start of a step of length h, by quadrature of its forces; ``row`` holds the start."""
    stops, n = problem.gap.size, problem.k.size
    entry = tables.times[family, 0] < tables.nodes[family, 0]  # t = h σ²
    for b in range(n):
        alpha, beta = propagate(problem.k[b], problem.c[b], span)
        p, v = row[b], row[n + b]
        row[b] = alpha * p + beta * v
        row[n + b] = alpha * v - beta * (problem.k[b] * p + problem.c[b] * v)
    if problem.table_dt.size == 0 and not touching(state):
        return
    end = math.sqrt(span / h) if entry else span / h
    panels = 1 + int(tables.fastest * span / 4.0)
    for g in range(panels * S):
        sigma = end * (g // S + tables.nodes[0, g % S]) / panels
        time = h * sigma * sigma if entry else h * sigma
        measure = end * tables.weights[0, g % S] / panels * h * (2.0 * sigma if entry else 1.0)
        for u in range(stops + problem.load.shape[0]):
            if u < stops and state.piece[u] == 0:
                continue
            exponent = 2.0 * tables.exponent[u] if entry and u == family - 1 else 0.0
            impulse = measure * _between(tables.nodes[family], exponent, space.force[u], sigma)
            push = problem.push[u] if u < stops else problem.load[u - stops]
            for b in range(n):
                alpha, beta = propagate(problem.k[b], problem.c[b], span - time)
                p, v = push[b] * impulse, push[n + b] * impulse
                row[b] += alpha * p + beta * v
                row[n + b] += alpha * v - beta * (problem.k[b] * p + problem.c[b] * v)
            if u < stops:
                row[2 * n + 2 + 2 * u] += impulse * _between(tables.nodes[family], 0.0, space.rate[u], sigma)
                row[2 * n + 3 + 2 * u] += impulse


@inner
def account(problem, tables, state, space, family, h, length, x, row):
    """Add to the ledger of ``row`` what loads and damping do over ``length`` of a step of length h from ``x`` on."""
    size, inner = 2 * problem.k.size, space.work[16]
    for i in range(tables.gauss.shape[1]):
        span = length * tables.gauss[0, i]
        copy(x, inner, x.size)
        inside(problem, tables, state, space, family, h, span, inner)
        gain, loss = powers(problem, tables, state.now[T] + span, inner)
        row[size] += length * tables.gauss[1, i] * gain
        row[size + 1] += length * tables.gauss[1, i] * loss


@inner
def account_flight(problem, tables, state, space, h, x):
    """The same for a whole flight step: on its Taylor polynomial where that reaches, else as above."""
    if tables.fastest * h > 0.6:
        if problem.table_dt.size:
            sample_signals(problem, tables, space, 0, state.now[T], h)
        account(problem, tables, state, space, 0, h, h, x, state.x)
        return
    size, inner = 2 * problem.k.size, space.work[16]
    taylor(problem, x, state.now[T], space.terms, space.six)
    for i in range(3):
        span = h * (0.5 + 0.3872983346207417 * (i - 1))  # Gauss's three points, sqrt(3/5)/2 apart
        add_taylor(space.terms, inner, span, size)
        gain, loss = powers(problem, tables, state.now[T] + span, inner)
        weight = h * (4.0 if i == 1 else 2.5) / 9.0
        state.x[size] += weight * gain
        state.x[size + 1] += weight * loss


@inner
def contact_time(problem, tables, state, space, s, speed):
    """Duration a free impact at this speed would have, from the law's energy: T = 3.2 δ_m/v."""
    speed = max(speed, 1e-12)
    mobility = max(tables.mobility[s, s], 1e-300)
    target = 0.5 * speed * speed / mobility
    p = tables.exponent[s]
    deepest = 1e-3 * speed
    for _ in range(4):
        space.clipped[0], space.trial[0] = deepest, 0.0
        contact_forces(problem, s, space.clipped[0:1], space.trial[0:1], speed, space.trial[1:2])
        energy = space.trial[1] * deepest / (p + 1.0)
        if not energy > 0.0:
            break
        deepest *= (target / energy) ** (1.0 / (p + 1.0))
    return 3.2 * deepest / speed
