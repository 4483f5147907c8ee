"""Responses of the blocks to a force given at the nodes of a contact step, for every step length.

A block's response to the j-th node value is (α, β) of ∫_0^{t_i} E(t_i - τ) w(σ) L_j(σ)/w(σ_j) dτ at the nodes t_i and
at the end. The response of stop s to the force of stop u is a sum of these over the blocks, `fill_pair`. For a few
stops it is tabulated for all pairs.

A *kind* is a set of nodes, one per (κ, λ); a *weighting* is a kind with or without the weight σ^λ of the force.
"""

from __future__ import annotations

import math

from solvers.compiled.kernels import inner, kernel
from solvers.compiled.sums import combine
from solvers.exponential.contact.nodes import S, lagrange

_PANEL = 6.0  # radians of the fastest oscillation in a quadrature panel of 12 points


@kernel
def propagate(k, c, x):
    """(α, β) of exp(A x), any damping: e^{-cx/2} [cos θ, sin θ / ω_d], its hyperbolic form, or their limit."""
    half = 0.5 * c
    discriminant = half * half - k
    if discriminant < 0.0:
        omega = math.sqrt(-discriminant)
        decay = math.exp(-half * x)
        beta = decay * math.sin(omega * x) / omega
        return decay * math.cos(omega * x) + half * beta, beta
    root = math.sqrt(discriminant)
    slow = -k / (half + root) if half + root > 0.0 else 0.0
    decay = math.exp(slow * x)
    beta = decay * x if root * x < 1e-12 else -decay * math.expm1(-2.0 * root * x) / (2.0 * root)
    return decay - slow * beta, beta


@kernel
def fill_propagators(k, c, blocks, h, out):
    """(len(h), 2, N) α, β of the blocks from the first to before the last."""
    for i in range(h.size):
        for b in range(blocks[0], blocks[1]):
            out[i, 0, b], out[i, 1, b] = propagate(k[b], c[b], h[i])


@inner
def _fill_basis(weighting, gauss, begin, width, out):
    """Write dτ/h w(σ) L_j(σ)/w(σ_j) of every node at the points of a panel, and behind them τ/h = σ^κ."""
    time_exponent, weight_exponent, nodes, weights = weighting
    for g in range(gauss.shape[1]):
        sigma, measure = begin + width * gauss[0, g], width * gauss[1, g]
        out[g, S] = sigma
        if time_exponent > 1.0:
            pace = sigma ** (time_exponent - 1.0)
            out[g, S] = sigma * pace
            measure *= time_exponent * pace
        if weight_exponent > 0.0:
            measure *= sigma**weight_exponent
        lagrange(nodes, weights, sigma, out[g])
        for j in range(S):
            out[g, j] *= measure


@inner
def _block_response(k, c, h, weighting, gauss, out, basis):
    """out[i, j] = (α, β) of ∫_0^{t_i} E(t_i - τ) w(σ) L_j(σ)/w(σ_j) dτ; i = S is the end of the step.

    ``basis`` holds the polynomials between neighbouring nodes, for blocks that need one panel there, and has room for
    those of another panel.
    """
    time_exponent, _, nodes, _ = weighting
    count, rate = nodes.size, math.sqrt(k) + c
    for i in range(count + 1):
        a = nodes[i - 1] if i > 0 else 0.0
        b = nodes[i] if i < count else 1.0
        ta, tb = h * a**time_exponent, h * b**time_exponent
        ea, eb = propagate(k, c, tb - ta)
        for j in range(count):  # carry the integral so far to the new node
            alpha = out[i - 1, j, 0] if i > 0 else 0.0
            beta = out[i - 1, j, 1] if i > 0 else 0.0
            out[i, j, 0] = ea * alpha - k * eb * beta
            out[i, j, 1] = ea * beta + eb * alpha - c * eb * beta
        panels, known = 1 + int(rate * (tb - ta) / _PANEL), i
        for panel in range(panels):
            if panels > 1:
                known, width = count + 1, (b - a) / panels
                begin = a + (b - a) * panel / panels
                _fill_basis(weighting, gauss, begin, width, basis[known])
            for g in range(gauss.shape[1]):
                alpha, beta = propagate(k, c, tb - h * basis[known, g, S])
                for j in range(count):
                    out[i, j, 0] += alpha * (h * basis[known, g, j])
                    out[i, j, 1] += beta * (h * basis[known, g, j])


@inner
def fill_pair(k, c, push, read, read_rate, response, weights, out):
    """(S, 2S) response of δ and δ̇ at the nodes, by ``read``, to the node values of a force that acts by ``push``.

    With A² = -k - c A the sum over the blocks of r (α + β A) b is Σ α (r·b) + β (r·A b).
    """
    size, own = k.size, response.shape[1] // 2
    for d in range(2):
        row = read if d == 0 else read_rate
        for b in range(own):
            p, v = push[b], push[size + b]
            weights[b] = row[b] * p + row[size + b] * v
            weights[own + b] = row[b] * v - row[size + b] * (k[b] * p + c[b] * v)
        for j in range(S):
            combine(response[j], weights, 2 * own, None, out[j, d * S : (d + 1) * S])


@inner
def _fill_end_response(k, c, push, ending, out):
    """(S, 2N) state change at the end."""
    size = k.size
    for b in range(ending.shape[1]):
        p, v = push[b], push[size + b]
        for j in range(S):
            alpha, beta = ending[0, b, j], ending[1, b, j]
            out[j, b] = alpha * p + beta * v
            out[j, size + b] = alpha * v - beta * (k[b] * p + c[b] * v)


@inner
def _fill_level(k, c, h, weighting, gauss, response, ending, work, basis):
    """Responses of the blocks for one step length, at the nodes and at the end."""
    own = ending.shape[1]
    for b in range(own):
        _block_response(k[b], c[b], h, weighting, gauss, work, basis)
        for j in range(S):
            for i in range(S):
                response[j, b, i], response[j, own + b, i] = work[i, j, 0], work[i, j, 1]
            ending[0, b, j], ending[1, b, j] = work[S, j, 0], work[S, j, 1]


@kernel
def fill_weighting(structure, h, weighting, gauss, inputs, tables, scratch):
    """Responses of one weighting for all step lengths: of the blocks and, for a few stops, of all pairs.

    ``structure`` are k, c, read and read_rate of a problem, ``weighting`` κ, λ, the nodes, and the factors of their
    polynomials, ``inputs`` the pushes of forces and loads, ``tables`` the responses to be filled. For a few stops
    (``forced`` is not empty) those of the blocks are scratch for one length.
    """
    (k, c, read, read_rate), (_, _, nodes, _) = structure, weighting
    (response, ending, forced, end_response), (work, basis, sums) = tables, scratch
    pairs = forced.shape[0] > 0
    for i in range(S + 1):
        begin, end = nodes[i - 1] if i > 0 else 0.0, nodes[i] if i < S else 1.0
        _fill_basis(weighting, gauss, begin, end - begin, basis[i])
    for level in range(h.size):
        rows, ends = response[0 if pairs else level], ending[0 if pairs else level]
        _fill_level(k, c, h[level], weighting, gauss, rows, ends, work, basis)
        for u in range(inputs.shape[0] if pairs else 0):
            _fill_end_response(k, c, inputs[u], ends, end_response[level, u])
            for s in range(read.shape[0]):
                fill_pair(k, c, inputs[u], read[s], read_rate[s], rows, sums, forced[level, u, s])


@kernel
def fill_node_propagators(k, c, blocks, h, time_exponent, nodes, out):
    """(J, 2, N, S) α, β of some of the blocks at the nodes of one kind."""
    for level in range(h.size):
        for b in range(blocks[0], blocks[1]):
            for i in range(S):
                span = h[level] * nodes[i] ** time_exponent
                out[level, 0, b, i], out[level, 1, b, i] = propagate(k[b], c[b], span)


@kernel
def fill_free(k, c, read, read_rate, blocks, h, time_exponent, nodes, out):
    """(J, m, 2N, 2S) δ and δ̇ of all stops at the nodes of one kind from the state of some of the blocks."""
    size = k.size
    for level in range(h.size):
        for b in range(blocks[0], blocks[1]):
            for i in range(S):
                alpha, beta = propagate(k[b], c[b], h[level] * nodes[i] ** time_exponent)
                for s in range(read.shape[0]):
                    for d in range(2):
                        r = read[s] if d == 0 else read_rate[s]
                        out[level, s, b, d * S + i] = r[b] * alpha - r[size + b] * k[b] * beta
                        out[level, s, size + b, d * S + i] = r[b] * beta + r[size + b] * (alpha - c[b] * beta)
