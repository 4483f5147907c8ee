"""Energy ledger and states inside a step, by quadrature of what the step has found."""

from __future__ import annotations

import math

import numpy as np

from solvers.compiled.kernels import copy, dot, inlined, inner, table_value
from solvers.compiled.state import T, touching
from solvers.exponential.contact.node_response import PLAIN, PRODUCTS, WEIGHTED, WITHIN, sample_signals
from solvers.exponential.contact.nodes import S
from solvers.exponential.flight import add_taylor, energy_norms, taylor
from solvers.exponential.responses import propagate

_SHORT = 0.15  # radians of the fastest block up to which order 6 and three points are right to 1e-10


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
    """Π (σ - σ_i) without i = j, for every j."""
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
    power, lead = tables.power[family], tables.lead[family]  # t = h σ^power
    for b in range(n):
        alpha, beta = propagate(problem.k[b], problem.c[b], span)
        p, v = row[b], row[n + b]
        row[b] = alpha * p + beta * v
        row[n + b] = alpha * v - beta * (problem.k[b] * p + problem.c[b] * v)
    if problem.table_dt.size == 0 and not touching(state):
        return
    nodes, work = tables.nodes[family], space.work
    plain, weighted, products = work[PLAIN], work[WEIGHTED], work[PRODUCTS]
    _scales(nodes, lead, plain, weighted)
    end = (span / h) ** (1.0 / power)
    panels = 1 + int(tables.fastest * span / 4.0)
    for g in range(panels * S):
        sigma = end * (g // S + tables.nodes[0, g % S]) / panels
        time = h * sigma**power
        measure = end * tables.weights[0, g % S] / panels * h * power * sigma ** (power - 1.0)
        _products(nodes, sigma, products)
        for u in range(stops + problem.load.shape[0]):
            if u < stops and state.piece[u] == 0:
                continue
            if lead > 0.0 and u == family - 1:
                impulse = measure * sigma**lead * _between(products, weighted, space.force[u])
            else:
                impulse = measure * _between(products, plain, space.force[u])
            push = problem.push[u] if u < stops else problem.load[u - stops]
            for b in range(n):
                alpha, beta = propagate(problem.k[b], problem.c[b], span - time)
                p, v = push[b] * impulse, push[n + b] * impulse
                row[b] += alpha * p + beta * v
                row[n + b] += alpha * v - beta * (problem.k[b] * p + problem.c[b] * v)
            if u < stops:
                row[2 * n + 2 + 2 * u] += impulse * _between(products, plain, space.motion[u, 1])
                row[2 * n + 3 + 2 * u] += impulse


@inner
def energetic(problem, tables, norms):
    """Fastest block that carries more than 1e-12 of the energy, or tone, rad/s."""
    total, fastest, own = 0.0, 1e-3, int(tables.own)
    for b in range(own):
        total += norms[b] ** 2
    for b in range(problem.k.size):
        if b >= own or norms[b] ** 2 > 1e-12 * total:
            fastest = max(fastest, math.sqrt(problem.k[b]) + problem.c[b])
    return fastest


@inner
def account(problem, tables, state, space, family, h, length, x, row):
    """Add to the ledger of ``row`` what loads and damping do over ``length`` of a step of length h from ``x`` on.

    Gauss's rule in parts of 3 radians of the fastest block that moves at the begin or the end of the step.
    """
    size, inner = 2 * problem.k.size, space.work[WITHIN]
    energy_norms(problem, x, space.norms)
    fastest = energetic(problem, tables, space.norms)
    energy_norms(problem, space.x_new, space.norms)
    parts = 1 + int(max(fastest, energetic(problem, tables, space.norms)) * length / 3.0)
    for i in range(tables.gauss.shape[1] * parts):
        place, weight = tables.gauss[0, i % 8], tables.gauss[1, i % 8]
        span = length * (i // 8 + place) / parts
        copy(x, inner, x.size)
        inside(problem, tables, state, space, family, h, span, inner)
        gain, loss = powers(problem, tables, state.now[T] + span, inner)
        row[size] += length / parts * weight * gain
        row[size + 1] += length / parts * weight * loss


@inner
def account_flight(problem, tables, state, space, h, x):
    """The same for a whole flight step: on its Taylor polynomial where that reaches, else as above."""
    if tables.fastest * h > _SHORT:
        if problem.table_dt.size:
            sample_signals(problem, tables, space, np.int64(0), state.now[T], h)  # literals would compile it twice
        account(problem, tables, state, space, np.int64(0), h, h, x, state.x)
        return
    size, inner = 2 * problem.k.size, space.work[WITHIN]
    taylor(problem, x, state.now[T], space.terms, space.six)
    for i in range(3):
        span = h * (0.5 + 0.3872983346207417 * (i - 1))  # Gauss's three points, sqrt(3/5)/2 apart
        add_taylor(space.terms, inner, span, size, space.values, space.work[PLAIN])
        gain, loss = powers(problem, tables, state.now[T] + span, inner)
        weight = h * (4.0 if i == 1 else 2.5) / 9.0
        state.x[size] += weight * gain
        state.x[size + 1] += weight * loss
