"""Powers of loads and damping; states and energy balance inside a contact step, by quadrature of its forces."""

from __future__ import annotations

import math

from solvers.compiled.kernels import copy, dot, inlined, inner, reordered, table_value
from solvers.compiled.state import T, in_contact
from solvers.exponential.contact.node_response import PLAIN, PRODUCTS, WEIGHTED, WITHIN
from solvers.exponential.contact.nodes import S
from solvers.exponential.flight import energy_norms
from solvers.exponential.responses import propagate


@inner
def _scales(nodes, exponent, plain, weighted):
    """1/Π (σ_j - σ_i), and the same over σ_j^exponent."""
    for j in range(S):
        product = 1.0
        for i in range(S):
            if i != j:
                product *= nodes[j] - nodes[i]
        plain[j] = 1.0 / product
        weighted[j] = plain[j] / nodes[j] ** exponent if exponent > 0.0 else plain[j]


@inner
def _products(nodes, sigma, out):
    """Π_{i ≠ j} (σ - σ_i) for every j."""
    for j in range(S):
        product = 1.0
        for i in range(S):
            if i != j:
                product *= sigma - nodes[i]
        out[j] = product


@inlined
def _between(products, scales, values):
    """Value of the polynomial through the node values."""
    total = 0.0
    for j in range(S):
        total += products[j] * scales[j] * values[j]
    return total


@inner
def powers(problem, tables, t, x):
    """Power of the loads and of the damping at time t, W."""
    size, gain, loss, own = 2 * problem.k.size, 0.0, 0.0, int(tables.own_blocks)
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
    """Power of damping, W, by rows with entries for the block's own rate and the tones only."""
    loss = 0.0
    for b in range(own):
        value = rows[b, n + b] * x[n + b]
        for k in range(own, n):
            value += rows[b, k] * x[k] + rows[b, n + k] * x[n + k]
        loss += value * value
    return loss


@inner
def state_within(problem, tables, state, scratch, node_set, h, span, row):
    """Move ``row``, the state at the begin of a step of length h, by ``span``, by quadrature of the step's forces."""
    stops, n = problem.gap.size, problem.k.size
    time_exponent, weight_exponent = tables.time_exponent[node_set], tables.weight_exponent[node_set]  # t = h σ^power
    for b in range(n):
        alpha, beta = propagate(problem.k[b], problem.c[b], span)
        p, v = row[b], row[n + b]
        row[b] = alpha * p + beta * v
        row[n + b] = alpha * v - beta * (problem.k[b] * p + problem.c[b] * v)
    if problem.table_dt.size == 0 and not in_contact(state):
        return
    nodes, work = tables.nodes[node_set], scratch.stages
    plain, weighted, products = work[PLAIN], work[WEIGHTED], work[PRODUCTS]
    _scales(nodes, weight_exponent, plain, weighted)
    end = (span / h) ** (1.0 / time_exponent)
    panels = 1 + int(tables.fastest * span / 4.0)
    for g in range(panels * S):
        sigma = end * (g // S + tables.nodes[0, g % S]) / panels
        time = h * sigma**time_exponent
        measure = end * tables.weights[0, g % S] / panels * h * time_exponent * sigma ** (time_exponent - 1.0)
        _products(nodes, sigma, products)
        for u in range(stops + problem.load.shape[0]):
            if u < stops and state.segment[u] == 0:
                continue
            if weight_exponent > 0.0 and u == node_set - 1:
                impulse = measure * sigma**weight_exponent * _between(products, weighted, scratch.force[u])
            else:
                impulse = measure * _between(products, plain, scratch.force[u])
            push = problem.push[u] if u < stops else problem.load[u - stops]
            for b in range(n):
                alpha, beta = propagate(problem.k[b], problem.c[b], span - time)
                p, v = push[b] * impulse, push[n + b] * impulse
                row[b] += alpha * p + beta * v
                row[n + b] += alpha * v - beta * (problem.k[b] * p + problem.c[b] * v)
            if u < stops:
                row[2 * n + 2 + 2 * u] += impulse * _between(products, plain, scratch.motion[u, 1])
                row[2 * n + 3 + 2 * u] += impulse


@inner
def fastest_moving(problem, tables, norms):
    """Speed, rad/s, of the fastest tone or block with more than 1e-12 of the energy."""
    total, fastest, own = 0.0, 1e-3, int(tables.own_blocks)
    for b in range(own):
        total += norms[b] ** 2
    for b in range(problem.k.size):
        if b >= own or norms[b] ** 2 > 1e-12 * total:
            fastest = max(fastest, math.sqrt(problem.k[b]) + problem.c[b])
    return fastest


@inner
def account_by_quadrature(problem, tables, state, scratch, node_set, h, length, x, row):
    """Add work of loads and damping over ``length`` of a step of length h from ``x`` on to the balance of ``row``.

    Gauss's rule on parts of 3 radians of the fastest block that moves at the begin or the end of the step.
    """
    size, inner = 2 * problem.k.size, scratch.stages[WITHIN]
    energy_norms(problem, x, scratch.norms)
    fastest = fastest_moving(problem, tables, scratch.norms)
    energy_norms(problem, scratch.x_new, scratch.norms)
    parts = 1 + int(max(fastest, fastest_moving(problem, tables, scratch.norms)) * length / 3.0)
    for i in range(tables.gauss.shape[1] * parts):
        place, weight = tables.gauss[0, i % 8], tables.gauss[1, i % 8]
        span = length * (i // 8 + place) / parts
        copy(x, inner, x.size)
        state_within(problem, tables, state, scratch, node_set, h, span, inner)
        gain, loss = powers(problem, tables, state.now[T] + span, inner)
        row[size] += length / parts * weight * gain
        row[size + 1] += length / parts * weight * loss
