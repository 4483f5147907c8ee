"""Work and damping over contact steps: tables made for the first run with an energy balance.

The force on a block is a polynomial times its weight, see `contact.nodes`. So the block's velocity v is linear in
y = (plain forces at the nodes, those of the stop that enters, p₀, v₀), and so is ∫ L_i v dt with the nodes' L_i,
while ∫ v² dt is a quadratic form. With signals g at the nodes the input work is Σ_i g_i ∫ L_i v dt; with the steady
motion w that tones give a block, its damping is c (∫ v² dt + 2 Σ_i w_i ∫ L_i v dt + ∫ w² dt).
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np

from solvers.compiled.kernels import inner, kernel
from solvers.exponential.contact.nodes import S, gauss, lagrange
from solvers.exponential.responses import propagate

_PANEL, _POINTS = 1.5, 16  # radians of a panel and its points: exact to rounding
BEGIN, ROWS = 2 * S, 2 * S + 2  # rows of a table: plain forces, those of the stop that enters, from here on p₀ and v₀
WIDE = 2 * S + 16  # of a row: ∫ L_i v dt for all nodes, then ∫ v v_row dt for all rows, and zeros


@lru_cache(maxsize=16)
def contact_table(
    stiffness: bytes, damping: bytes, steps: bytes, time_exponent: float, weight_exponent: float, places: bytes
) -> Any:
    """(j, n, ROWS, WIDE) of one kind of steps, t = h σ^κ, for blocks (k, c) and steps given as the bytes of arrays."""
    k, c, h, nodes = (np.frombuffer(part) for part in (stiffness, damping, steps, places))
    apart = 1.0 / (nodes[:, None] - nodes + np.eye(len(nodes))).prod(axis=1)
    weights = np.array([apart, apart * nodes ** (-weight_exponent)])
    points = gauss(_POINTS)
    out = np.zeros((len(h), len(k), ROWS, WIDE))
    scratch = np.zeros((_POINTS, ROWS)), np.zeros((_POINTS, S)), np.zeros((_POINTS, ROWS, 2)), np.zeros((ROWS, 2))
    _fill(
        k.copy(),
        c.copy(),
        h.copy(),
        time_exponent,
        weight_exponent,
        nodes.copy(),
        weights,
        points,
        _so_far(points[0]),
        *scratch,
        out,
    )
    return out


def _so_far(points: Any) -> Any:
    """(q, r): integral from 0 to point q of the polynomial through values at the points r."""
    legendre = np.polynomial.legendre
    x, one = 2.0 * points - 1.0, np.eye(len(points))
    integrals = [legendre.legval(x, legendre.legint(row, lbnd=-1.0)) for row in one]
    return np.ascontiguousarray(0.5 * np.array(integrals).T @ np.linalg.inv(legendre.legvander(x, len(x) - 1)))


@kernel
def _fill(k, c, h, time_exponent, weight_exponent, nodes, weights, points, so_far, velocity, basis, pushed, state, out):
    """All tables of a kind; the arguments between ``so_far`` and the result are scratch."""
    for level in range(h.size):
        for b in range(k.size):
            panels = 1 + int(time_exponent * (math.sqrt(k[b]) + c[b]) * h[level] / _PANEL)
            for e in range(ROWS):
                state[e, 0] = 1.0 if e == BEGIN else 0.0
                state[e, 1] = 1.0 if e == BEGIN + 1 else 0.0
            for panel in range(panels):
                begin, width = panel / panels, 1.0 / panels
                _push(
                    k[b],
                    c[b],
                    h[level],
                    time_exponent,
                    weight_exponent,
                    nodes,
                    weights,
                    points,
                    begin,
                    width,
                    basis,
                    pushed,
                )
                _move(k[b], c[b], h[level], time_exponent, points, so_far, begin, width, pushed, state, velocity)
                for q in range(points.shape[1]):
                    sigma = begin + width * points[0, q]
                    measure = points[1, q] * width * h[level] * time_exponent * sigma ** (time_exponent - 1.0)
                    _add_products(measure, basis[q], velocity[q], out[level, b])


@inner
def _moved(k, c, x, p, v):
    """State of a block after the time x, or before if x < 0: det exp(A x) = e^{-cx} gives the inverse of α I + β A."""
    alpha, beta = propagate(k, c, abs(x))
    if x < 0.0:
        grown = math.exp(-c * x)
        alpha, beta = grown * (alpha - c * beta), -grown * beta
    return alpha * p + beta * v, alpha * v - beta * (k * p + c * v)


@inner
def _push(k, c, h, time_exponent, weight_exponent, nodes, weights, points, begin, width, basis, pushed):
    """Unit forces at the points of a panel, per σ, as (p, v) moved back to the panel's begin."""
    start = h * begin**time_exponent
    for q in range(points.shape[1]):
        sigma = begin + width * points[0, q]
        p, v = _moved(
            k, c, start - h * sigma**time_exponent, 0.0, width * h * time_exponent * sigma ** (time_exponent - 1.0)
        )
        lagrange(nodes, weights[1], sigma, basis[q])
        weight = sigma**weight_exponent if weight_exponent > 0.0 else 0.0
        for j in range(S):
            force = basis[q, j] * weight
            pushed[q, S + j, 0], pushed[q, S + j, 1] = force * p, force * v
        lagrange(nodes, weights[0], sigma, basis[q])
        for j in range(S):
            pushed[q, j, 0], pushed[q, j, 1] = basis[q, j] * p, basis[q, j] * v


@inner
def _move(k, c, h, time_exponent, points, so_far, begin, width, pushed, state, velocity):
    """Velocities at the points of a panel by the variation of constants; ``state`` is moved to its end."""
    count, start = points.shape[1], h * begin**time_exponent
    for q in range(count + 1):
        end = begin + width * points[0, q] if q < count else begin + width
        span = h * end**time_exponent - start
        for e in range(ROWS):
            p, v = state[e, 0], state[e, 1]
            for r in range(count if e < BEGIN else 0):
                share = so_far[q, r] if q < count else points[1, r]
                p += share * pushed[r, e, 0]
                v += share * pushed[r, e, 1]
            p, v = _moved(k, c, span, p, v)
            if q < count:
                velocity[q, e] = v
            else:
                state[e, 0], state[e, 1] = p, v


@inner
def _add_products(measure, basis, velocity, out):
    """Add the part of one point to all integrals."""
    for e in range(ROWS):
        value = measure * velocity[e]
        for i in range(S):
            out[e, i] += value * basis[i]
        for f in range(ROWS):
            out[e, S + f] += value * velocity[f]
