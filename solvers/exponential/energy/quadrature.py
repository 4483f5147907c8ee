"""Powers of loads and damping; the state and the energy ledger inside a contact step, from the forces at its nodes.

With x = E(t) y a block's equation is y' = E(-t) Σ push F. Gauss's collocation solves it, in panels of at most
`_RADIANS` of the fastest block: y at a panel's points is y₀ + Σ_r a_qr y'_r. Work, damping and impulses are sums over
the same points. Such a method conserves quadratic forms: what contacts and loads do and damping takes adds up to the
energy, however little the velocity of a stop is like a polynomial through its values at the nodes.
"""

from __future__ import annotations

from solvers.compiled.kernels import dot, inlined, inner, reordered, table_value
from solvers.compiled.simd import eight, put, spread, total
from solvers.compiled.sums import combine
from solvers.exponential.contact.nodes import S
from solvers.exponential.responses import propagate

_RADIANS = 3.0  # energies of a damped block are 5e-11 ζ of its own off, the motion less
_SHARES = 2  # first row of `Tables.gauss` with a_qr, one per r
_PACE = S  # row of `Space.between` with dt of the panel's points; polynomials of the nodes before, forces behind


@inner
def powers(problem, tables, t, x):
    """Power of the loads and of the damping at time t, W."""
    size, gain, loss, own = 2 * problem.k.size, 0.0, 0.0, int(tables.own)
    for load in range(tables.power_rows.shape[0] if own < problem.k.size else 0):
        gain += dot(tables.signal_rows[load], x, size) * dot(tables.power_rows[load], x, size)
    for j in range(problem.table_dt.size):
        gain += table_value(problem, j, t) * dot(tables.power_rows[problem.table_load[j]], x, size)
    if tables.loss_rows.shape[0] > own:  # damping that couples the blocks has a row per coordinate
        for r in range(tables.loss_rows.shape[0]):
            loss += dot(tables.loss_rows[r], x, size) ** 2
    else:
        loss = _plain_loss(problem.k.size, own, tables.loss_rows, x)
    return gain, loss


@reordered
def _plain_loss(n, own, rows, x):
    """Power of damping by rows that read a block's own rate and the tones only, W."""
    loss = 0.0
    for b in range(own):
        value = rows[b, n + b] * x[n + b]
        for k in range(own, n):
            value += rows[b, k] * x[k] + rows[b, n + k] * x[n + k]
        loss += value * value
    return loss


@inlined
def _raised(sigma, power):
    """σ^power for a whole number."""
    value = 1.0
    for _ in range(int(power)):
        value *= sigma
    return value


@inner
def _places(tables, space, family, h, begin, width):
    """Points of a panel of σ: σ, times after its begin, dt per unit of the panel, and the nodes' polynomials there."""
    power, between, nodes = tables.power[family], space.between, tables.nodes[family]
    start = h * _raised(begin, power)
    for q in range(S):
        sigma = begin + width * tables.gauss[0, q]
        pace = h * _raised(sigma, power - 1.0)
        space.trial[q], space.clipped[q], between[_PACE, q] = sigma, pace * sigma - start, width * power * pace
    sigma = eight(space.trial, 0)
    for j in range(S):
        product = spread(1.0)
        for i in range(S):
            if i != j:
                product = product * (sigma - spread(nodes[i]))
        put(between[j], 0, product)


@inner
def _forces(problem, tables, state, space, family):
    """Forces and signals at these points, times dt."""
    stops, between = problem.gap.size, space.between
    for u in range(space.force.shape[0]):
        if u < stops and state.piece[u] == 0:
            continue
        enters, row = u == family - 1 and tables.lead[family] > 0.0, between[_PACE + 1 + u]
        scales, value = tables.lagrange[family, 1 if enters else 0], spread(0.0)
        for j in range(S):
            value += spread(scales[j] * space.force[u, j]) * eight(between[j], 0)
        put(row, 0, value * eight(between[_PACE], 0))
        for q in range(S if enters else 0):
            row[q] *= space.trial[q] ** tables.lead[family]


@inner
def _moves(problem, space, length):
    """α, β of every block from the begin of a panel to its points and, by det E = e^{-ct}, back, then to its end."""
    for b in range(problem.k.size):
        k, c, out = problem.k[b], problem.c[b], space.moves[b]
        for q in range(S):
            alpha, beta = propagate(k, c, space.clipped[q])
            grown = 1.0 / (alpha * alpha - c * alpha * beta + k * beta * beta)
            out[0, q], out[1, q] = alpha, beta
            out[2, q], out[3, q] = grown * (alpha - c * beta), -grown * beta
        out[4, 0], out[4, 1] = propagate(k, c, length)


@inlined
def _pushed(problem, state, space, b, moves):
    """What moves a block at the points, p and v as of the panel's begin, into ``space.trial`` and ``space.clipped``."""
    n, stops, p, v = problem.k.size, problem.gap.size, spread(0.0), spread(0.0)
    for u in range(space.force.shape[0]):
        if u >= stops or state.piece[u] > 0:
            push = problem.push[u] if u < stops else problem.load[u - stops]
            force = eight(space.between[_PACE + 1 + u], 0)
            p += spread(push[b]) * force
            v += spread(push[n + b]) * force
    alpha, beta = eight(moves[2], 0), eight(moves[3], 0)
    put(space.trial, 0, alpha * p + beta * v)
    put(space.clipped, 0, alpha * v - beta * (spread(problem.k[b]) * p + spread(problem.c[b]) * v))


@inner
def _move(problem, tables, state, space, row):
    """Blocks at the points of the panel into ``space.along``; ``row`` goes on to its end."""
    n, gauss, weights = problem.k.size, tables.gauss, eight(tables.gauss[1], 0)
    for b in range(n):
        k, c, moves = problem.k[b], problem.c[b], space.moves[b]
        p, v = row[b], row[n + b]
        p_points, v_points = spread(p), spread(v)
        if b < tables.own:
            _pushed(problem, state, space, b, moves)
            for r in range(S):
                share = eight(gauss[_SHARES + r], 0)
                p_points += spread(space.trial[r]) * share
                v_points += spread(space.clipped[r]) * share
            p += total(weights * eight(space.trial, 0))
            v += total(weights * eight(space.clipped, 0))
        alpha, beta = eight(moves[0], 0), eight(moves[1], 0)
        put(space.along[b], 0, alpha * p_points + beta * v_points)
        put(space.along[n + b], 0, alpha * v_points - beta * (spread(k) * p_points + spread(c) * v_points))
        row[b], row[n + b] = moves[4, 0] * p + moves[4, 1] * v, moves[4, 0] * v - moves[4, 1] * (k * p + c * v)


@inner
def _add_works(problem, tables, state, space, row):
    """Works and impulses of the contacts on the panel."""
    size = 2 * problem.k.size
    for s in range(problem.gap.size):
        if state.piece[s] > 0:
            combine(space.along, problem.read_rate[s], size, None, space.trial)
            impulses = eight(tables.gauss[1], 0) * eight(space.between[_PACE + 1 + s], 0)
            row[size + 2 + 2 * s] += total(impulses * eight(space.trial, 0))
            row[size + 3 + 2 * s] += total(impulses)


@inner
def _add_powers(problem, tables, space, row):
    """What loads and damping do on the panel."""
    n, own, rows = problem.k.size, int(tables.own), tables.loss_rows
    weights, pace = eight(tables.gauss[1], 0), eight(space.between[_PACE], 0)
    for load in range(tables.power_rows.shape[0]):
        combine(space.along, tables.power_rows[load], 2 * n, None, space.trial)
        combine(space.along, tables.signal_rows[load], 2 * n, None, space.clipped)
        signal = eight(space.between[_PACE + 1 + problem.gap.size + load], 0) + pace * eight(space.clipped, 0)
        row[2 * n] += total(weights * signal * eight(space.trial, 0))
    for r in range(rows.shape[0]):
        if rows.shape[0] > own:  # damping that couples the blocks
            combine(space.along, rows[r], 2 * n, None, space.trial)
        else:
            value = spread(rows[r, n + r]) * eight(space.along[n + r], 0)
            for k in range(own, n):
                value += spread(rows[r, k]) * eight(space.along[k], 0)
                value += spread(rows[r, n + k]) * eight(space.along[n + k], 0)
            put(space.trial, 0, value)
        value = eight(space.trial, 0)
        row[2 * n + 1] += total(weights * pace * value * value)


@inner
def inside(problem, tables, state, space, family, h, begin, end, row, ledger):
    """Take ``row`` from ``begin`` to ``end``, s after the start of a contact step of length h whose forces are known.

    Works of the contacts go with it, those of loads and damping with ``ledger`` only.
    """
    power = tables.power[family]
    sigma, last = (begin / h) ** (1.0 / power), (end / h) ** (1.0 / power)
    panels = 1 + int(power * tables.fastest * (end - begin) / _RADIANS)
    width = (last - sigma) / panels
    for i in range(panels):
        _places(tables, space, family, h, sigma, width)
        if i == 0 or power > 1.0:
            _moves(problem, space, h * (_raised(sigma + width, power) - _raised(sigma, power)))
        _forces(problem, tables, state, space, family)
        _move(problem, tables, state, space, row)
        _add_works(problem, tables, state, space, row)
        if ledger:
            _add_powers(problem, tables, space, row)
        sigma += width
