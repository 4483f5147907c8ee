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
from solvers.exponential.contact.nodes import S, gauss, lagrange, so_far
from solvers.exponential.responses import propagate

_PANEL, _POINTS = 1.5, 16  # radians of a panel and its points: exact to rounding
_BEGIN, _ROWS = 2 * S, 2 * S + 2  # rows of y: plain forces, those of the stop that enters, from here on p₀ and v₀
_WIDE = S + _ROWS  # ∫ L_i v dt for all nodes, then ∫ v v_row dt for all rows
BEGAN, ENTERING, SQUARES = S + 2, S + 3, 2 * S + 3  # rows of a table behind those of plain forces, p₀ and v₀


@lru_cache(maxsize=16)
def contact_table(
    stiffness: bytes, damping: bytes, steps: bytes, time_exponent: float, weight_exponent: float, places: bytes
) -> Any:
    """(j, n, 3S + 5, 2S) of one kind of steps, t = h σ^power, for blocks (k, c) and steps given as arrays' bytes.

    With F plain forces, G those of the stop that enters, x = (p₀, v₀), each form once: rows of F and x hold ∫ L_i v dt
    and the part of ∫ v² dt to be multiplied by F, then x by itself, then G as F, then G and x to be multiplied by G.
    """
    k, c, h, nodes = (np.frombuffer(part) for part in (stiffness, damping, steps, places))
    apart = 1.0 / (nodes[:, None] - nodes + np.eye(len(nodes))).prod(axis=1)
    weights = np.array([apart, apart * nodes ** (-weight_exponent)])
    points = gauss(_POINTS)
    out = np.zeros((len(h), len(k), _ROWS, _WIDE))
    scratch = np.zeros((_POINTS, _ROWS)), np.zeros((_POINTS, S)), np.zeros((_POINTS, _ROWS, 2)), np.zeros((_ROWS, 2))
    _fill(
        k.copy(),
        c.copy(),
        h.copy(),
        time_exponent,
        weight_exponent,
        nodes.copy(),
        weights,
        points,
        so_far(points[0]),
        *scratch,
        out,
    )
    return _once(out[..., :S], out[..., S:])


def _once(moments: Any, squares: Any) -> Any:
    """The table from ∫ L_i v dt and ∫ v v_row dt of all rows."""
    f, g, x, (p, v) = slice(S), slice(S, _BEGIN), slice(_BEGIN, _ROWS), (_BEGIN, _BEGIN + 1)
    out = np.zeros((*moments.shape[:2], SQUARES + S + 2, 2 * S))
    for rows, of, times in (slice(S), f, 1.0), (slice(S, BEGAN), x, 2.0), (slice(ENTERING, SQUARES), g, 2.0):
        out[..., rows, :S], out[..., rows, S:] = moments[..., of, :], times * squares[..., of, f]
    for i, (row, column, times) in enumerate(((p, p, 1.0), (p, v, 2.0), (v, v, 1.0))):
        out[..., BEGAN, i] = times * squares[..., row, column]
    out[..., SQUARES : SQUARES + S, :S], out[..., SQUARES + S :, :S] = squares[..., g, g], 2.0 * squares[..., x, g]
    return out


@kernel
def _fill(k, c, h, time_exponent, weight_exponent, nodes, weights, points, so_far, velocity, basis, pushed, state, out):
    """All tables of a kind; the arguments between ``so_far`` and the result are scratch."""
    for level in range(h.size):
        for b in range(k.size):
            panels = 1 + int(time_exponent * (math.sqrt(k[b]) + c[b]) * h[level] / _PANEL)
            for e in range(_ROWS):
                state[e, 0] = 1.0 if e == _BEGIN else 0.0
                state[e, 1] = 1.0 if e == _BEGIN + 1 else 0.0
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
    """Unit forces at the points of a panel, per σ, as (p, v) moved back to the panel's start."""
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
        for e in range(_ROWS):
            p, v = state[e, 0], state[e, 1]
            for r in range(count if e < _BEGIN else 0):
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
    """One point's part of all integrals."""
    for e in range(_ROWS):
        value = measure * velocity[e]
        for i in range(S):
            out[e, i] += value * basis[i]
        for f in range(_ROWS):
            out[e, S + f] += value * velocity[f]
