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
from solvers.compiled.simd import load8, splat8, store8
from solvers.exponential.contact.nodes import S, gauss, lagrange, lagrange_weights, so_far
from solvers.exponential.responses import propagate

_PANEL, _POINTS = 1.5, 16  # radians of a panel and its points: exact to rounding
_BEGIN, _ROWS = 2 * S, 2 * S + 2  # rows of y: plain forces, those of the stop that enters, then p₀ and v₀
_WIDE = S + _ROWS  # ∫ L_i v dt for all nodes, then ∫ v v_row dt for all rows
BEGAN, ENTERING, SQUARES = S + 2, S + 3, 2 * S + 3  # rows of a table behind those of F and x, see `contact_table`


@lru_cache(maxsize=16)
def contact_table(
    stiffness: bytes, damping: bytes, steps: bytes, time_exponent: float, weight_exponent: float, places: bytes
) -> Any:
    """(j, n, 3S + 5, 2S) of one kind of steps, t = h σ^κ, for blocks (k, c), steps and nodes given as arrays' bytes.

    With F plain forces, G those of the stop that enters, x = (p₀, v₀). Every form is kept once: rows of F and x hold ∫
    L_i v dt and the part of ∫ v² dt to be multiplied by F; then a row of x with x; then rows of G as those of F; then
    rows of G and x to be multiplied by G.
    """
    k, c, h, nodes = (np.frombuffer(part) for part in (stiffness, damping, steps, places))
    apart = lagrange_weights(nodes)
    weights = np.array([apart, apart * nodes ** (-weight_exponent)])
    points = gauss(_POINTS)
    sums = np.zeros((len(h), len(k), _ROWS, _WIDE))
    shapes = (_POINTS, _ROWS), (2, _POINTS, S), (_POINTS, 2, _BEGIN), (2, _ROWS)
    scratch = tuple(np.zeros(shape) for shape in shapes)
    structure = k.copy(), c.copy(), h.copy()
    kind = time_exponent, weight_exponent, nodes.copy(), weights
    _integrate(structure, kind, (points, np.vstack((so_far(points[0]), points[1]))), scratch, sums)
    return _table(sums[..., :S], sums[..., S:])


def _table(moments: Any, products: Any) -> Any:
    """Tables of all blocks from their ∫ L_i v dt and ∫ v_e v_f dt with f <= e, every form once."""
    plain, entering, x = slice(0, S), slice(S, _BEGIN), slice(_BEGIN, _ROWS)
    out = np.zeros((*moments.shape[:2], SQUARES + S + 2, 2 * S))
    forms = (plain, 0, 1.0), (x, S, 2.0), (entering, ENTERING, 2.0)
    for rows, first, factor in forms:
        there = out[:, :, first : first + rows.stop - rows.start]
        there[..., :S], there[..., S:] = moments[:, :, rows], factor * products[:, :, rows, plain]
    out[:, :, SQUARES : SQUARES + S, :S] = products[:, :, entering, entering]
    out[:, :, SQUARES + S :, :S] = 2.0 * products[:, :, x, entering]
    squares = products[:, :, x, x]
    out[:, :, BEGAN, 0], out[:, :, BEGAN, 2] = squares[..., 0, 0], squares[..., 1, 1]
    out[:, :, BEGAN, 1] = 2.0 * squares[..., 1, 0]
    return out


@kernel
def _integrate(structure, kind, rule, scratch, sums):
    """Integrals of all steps and blocks; ``rule`` has the points of a panel and weights of integrals up to these."""
    (k, c, h), (time_exponent, _, _, _), (points, _) = structure, kind, rule
    velocity, basis, pushed, state = scratch
    for level in range(h.size):
        known = 0  # panels for which ``basis`` has been computed; it can be reused if there is one panel
        for b in range(k.size):
            panels = 1 + int(time_exponent * (math.sqrt(k[b]) + c[b]) * h[level] / _PANEL)
            state[:] = 0.0
            state[0, _BEGIN], state[1, _BEGIN + 1] = 1.0, 1.0
            for panel in range(panels):
                begin, width = panel / panels, 1.0 / panels
                if panels > 1 or known != 1:
                    _fill_basis(kind, points, begin, width, basis)
                    known = panels
                block = k[b], c[b], h[level], time_exponent
                _unit_impulses(block, points, begin, width, basis, pushed)
                _move(block, rule, begin, width, pushed, state, velocity)
                for q in range(points.shape[1]):
                    sigma = begin + width * points[0, q]
                    measure = points[1, q] * width * h[level] * time_exponent * sigma ** (time_exponent - 1.0)
                    _add_products(measure, basis[0, q], velocity[q], sums[level, b])


@inner
def _fill_basis(kind, points, begin, width, basis):
    """Polynomials of plain forces at the points of a panel, and those of the stop that enters times its weight."""
    _, weight_exponent, nodes, weights = kind
    for q in range(points.shape[1]):
        sigma = begin + width * points[0, q]
        weight = sigma**weight_exponent if weight_exponent > 0.0 else 0.0
        for i in range(2):
            lagrange(nodes, weights[i], sigma, basis[i, q])
        for j in range(S):
            basis[1, q, j] *= weight


@inner
def _propagator_of(k, c, x):
    """α, β of a time x; for x < 0 by the inverse of α I + β A, whose determinant is e^{-cx}."""
    alpha, beta = propagate(k, c, abs(x))
    if x < 0.0:
        grown = math.exp(-c * x)
        return grown * (alpha - c * beta), -grown * beta
    return alpha, beta


@inner
def _unit_impulses(block, points, begin, width, basis, pushed):
    """Changes of (p, v) by unit forces at the points of a panel, per σ, moved back to the panel's start."""
    k, c, h, time_exponent = block
    start = h * begin**time_exponent
    for q in range(points.shape[1]):
        sigma = begin + width * points[0, q]
        alpha, beta = _propagator_of(k, c, start - h * sigma**time_exponent)
        push = width * h * time_exponent * sigma ** (time_exponent - 1.0)
        p, v = beta * push, alpha * push - beta * (c * push)
        for kind in range(2):
            for j in range(S):
                pushed[q, 0, S * kind + j] = basis[kind, q, j] * p
                pushed[q, 1, S * kind + j] = basis[kind, q, j] * v


@inner
def _move(block, rule, begin, width, pushed, state, velocity):
    """Velocities at the points of a panel by variation of constants; ``state`` is moved to its end."""
    (k, c, h, time_exponent), (points, so_far) = block, rule
    count, start = points.shape[1], h * begin**time_exponent
    for q in range(count + 1):
        end = begin + width * points[0, q] if q < count else begin + width
        alpha, beta = _propagator_of(k, c, h * end**time_exponent - start)
        for first in range(0, _BEGIN, S):
            p, v = load8(state[0], first), load8(state[1], first)
            for r in range(count):
                share = splat8(so_far[q, r])
                p += share * load8(pushed[r, 0], first)
                v += share * load8(pushed[r, 1], first)
            moved = splat8(alpha - beta * c) * v - splat8(beta * k) * p
            if q < count:
                store8(velocity[q], first, moved)
            else:
                store8(state[0], first, splat8(alpha) * p + splat8(beta) * v)
                store8(state[1], first, moved)
        for e in range(_BEGIN, _ROWS):
            p, v = state[0, e], state[1, e]
            if q < count:
                velocity[q, e] = alpha * v - beta * (k * p + c * v)
            else:
                state[0, e], state[1, e] = alpha * p + beta * v, alpha * v - beta * (k * p + c * v)


@inner
def _add_products(measure, basis, velocity, out):
    """Add the share of one point to all integrals; ∫ v_e v_f dt only for f up to the last row of e's group of eight."""
    for e in range(_ROWS):
        value = splat8(measure * velocity[e])
        store8(out[e], 0, load8(out[e], 0) + value * load8(basis, 0))
        for first in range(0, min(S * (e // S + 1), _BEGIN), S):
            store8(out[e], S + first, load8(out[e], S + first) + value * load8(velocity, first))
    for e in range(_BEGIN, _ROWS):
        for f in range(_BEGIN, e + 1):
            out[e, S + f] += measure * velocity[e] * velocity[f]
