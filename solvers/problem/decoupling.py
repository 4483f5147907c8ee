"""The decoupled form of a system: blocks of one or two states, each on its own but for the contact forces."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solvers.problem.matrices import Array

_SOFT = 1e-6  # of the largest squared frequency, below which rounding of it counts


@dataclass(frozen=True, eq=False)
class Blocks:
    """Decoupled form: stiffness k (n,), damping c (n,), transformation T and its inverse (2n, 2n).

    ``loss`` (2n, 2n) gives the damping power zᵀ loss z where C or G couples modes, and is empty otherwise.
    """

    k: Array
    c: Array
    T: Array
    inverse: Array
    loss: Array


def decouple(M: Array, C: Array, K: Array, G: Array | None) -> Blocks:
    """Find the decoupled form of M q'' + (C + G) q' + K q = 0, where G is skew."""
    n = M.shape[0]
    if _is_diagonal(M) and _is_diagonal(K):
        phi, k = np.diag(1.0 / np.sqrt(np.diag(M))), np.diag(K) / np.diag(M)
    else:
        phi, k = _modes(M, K)
    G = np.zeros((n, n)) if G is None else G
    damping, turning = phi.T @ C @ phi, phi.T @ G @ phi if np.any(G) else G
    spread = damping - np.diag(np.diag(damping))
    sums = _terms(phi, C)
    rounding = np.maximum(1e-12 * np.abs(damping).max(initial=0.0), 4.0 * np.finfo(float).eps * sums)
    if not np.any(G) and np.all(np.abs(spread) <= rounding):
        zero = np.zeros((n, n))
        inverse = phi.T @ M
        terms = np.sqrt(np.abs(k)) + np.diag(sums)
        return Blocks(
            k,
            _without_rounding(np.diag(damping), terms),
            np.block([[phi, zero], [zero, phi]]),
            np.block([[inverse, zero], [zero, inverse]]),
            np.empty((0, 0)),
        )
    return _of_states(phi, k, damping, 0.5 * (turning - turning.T), np.abs(C) + np.abs(G))


def _is_diagonal(matrix: Array) -> bool:
    """Whether all entries off the diagonal are zero."""
    return not np.any(matrix - np.diag(np.diag(matrix)))


def _modes(M: Array, K: Array) -> tuple[Array, Array]:
    """Mass-normalised modes and squared frequencies; those of the size of rounding become exact zeros.

    `eigh` leaves rounding of the stiffest modes in all others: soft ones are cleared of it and found again. What is
    then no more than rounding of the terms it is a sum of, K having no more digits, is zero.
    """
    from scipy.linalg import eigh

    k, phi = eigh(K, M)
    soft = np.abs(k) < _SOFT * np.abs(k).max(initial=0.0)
    if not soft.any():
        return phi, k
    cleared, stiff = _cleared(M, K, phi[:, soft], phi[:, ~soft], k[~soft])
    own = cleared.T @ K @ cleared
    turn, k[soft] = _modes(cleared.T @ M @ cleared, 0.5 * (own + own.T))
    phi = np.hstack((cleared @ turn, stiff))
    k = np.concatenate((k[soft], k[~soft]))
    below = -1e-13 * k.max(initial=0.0)  # what a product such as ΦᵀKΦ leaves of a rigid-body mode
    k[(np.abs(k) < 1e-13 * np.sum(np.abs(phi) * (np.abs(K) @ np.abs(phi)), axis=0)) | ((below < k) & (k < 0.0))] = 0.0
    order = np.argsort(k, kind="stable")
    return phi[:, order], k[order]


def _cleared(M: Array, K: Array, soft: Array, stiff: Array, k: Array) -> tuple[Array, Array]:
    """Soft modes without stiff ones, whose squared frequencies are k, in their forces, then these without soft ones."""
    for _ in range(3):
        soft = soft - stiff @ ((stiff.T @ (K @ soft)) / k[:, None])
    return soft, stiff - soft @ (soft.T @ M @ stiff)


def _terms(phi: Array, C: Array) -> Array:
    """Sums of the sizes of all terms of φᵀ C φ: eps times them is its rounding."""
    return np.abs(phi).T @ np.abs(C) @ np.abs(phi)


def _without_rounding(c: Array, terms: Array) -> Array:
    """Dampings, those set to zero that are no more than the rounding of the terms they are sums of.

    A dashpot on a node of a mode leaves such a c, of either sign, instead of none.
    """
    return np.where(np.abs(c) <= 4 * c.size * np.finfo(float).eps * terms, 0.0, c)


def _of_states(phi: Array, k: Array, damping: Array, turning: Array, size: Array) -> Blocks:
    """`_state_blocks`, found in a unit of time in which the highest frequency is about one.

    In seconds the conditions of T and of its inversion would grow with the square of the frequencies.
    """
    fastest = max(math.sqrt(np.abs(k).max()), np.abs(damping).max(), np.abs(turning).max())
    unit = 2.0 ** round(math.log2(fastest))
    found = _state_blocks(phi, k / unit**2, damping / unit, turning / unit, size / unit)
    rates = np.repeat([1.0, unit], k.size)
    T, inverse = (rates[:, None] * matrix / rates for matrix in (found.T, found.inverse))
    return Blocks(unit**2 * found.k, unit * found.c, T, inverse, unit**3 * found.loss / np.outer(rates, rates))


def _state_blocks(phi: Array, k: Array, damping: Array, turning: Array, size: Array) -> Blocks:
    """Blocks of the state matrix [[0, I], [-diag(k), -damping - turning]], whose last part couples the modes.

    ``turning`` is the skew one, or zero; ``size`` (n, n) are |C| + |G| in the system's own coordinates.
    """
    order = np.argsort(k != 0.0, kind="stable")  # rigid-body modes first
    phi, k, turns = phi[:, order], k[order], bool(np.any(turning))
    damping, turning = (one[np.ix_(order, order)] for one in (damping, turning))
    rotation, free = _floating(k, damping, turning)
    phi, k, n = phi @ rotation, k[free:], k.size - free
    damping, turning = ((rotation.T @ one @ rotation)[free:, free:] for one in (damping, turning))
    rigid, phi = phi[:, :free], phi[:, free:]
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(k), -(damping + turning)]])
    values, vectors = np.linalg.eig(A)
    order = np.argsort(np.abs(values))
    values, vectors = values[order], vectors[:, order]
    scale = np.abs(values).max()
    if turns:  # of rigid-body modes: two zeros are one mode that drifts, and not to be told apart
        values[np.abs(values) <= 10 * values.size * np.finfo(float).eps * scale] = 0.0
    complex_ones = np.flatnonzero(values.imag > 1e-12 * scale)
    pairs = [_complex_pair(values[i], vectors[:, i], n) for i in complex_ones]
    if turns:
        shares = [_dissipation(vectors[:, i], k, damping) for i in complex_ones]
        pairs = [(pair[0], share, *pair[2:]) for pair, share in zip(pairs, shares, strict=True)]
    pairs += _real_pairs(values.real, vectors.real, np.flatnonzero(np.abs(values.imag) <= 1e-12 * scale))
    columns = np.array([p[2] for p in pairs] + [p[3] for p in pairs]).T
    if len(pairs) != n or np.linalg.cond(columns) > 1e12:
        raise ValueError(_INSEPARABLE_TURNING if turns else _INSEPARABLE)
    T: Any = _states_of_blocks(rigid, phi, columns)
    loss = np.zeros((2 * (free + n), 2 * (free + n)))
    places = np.concatenate((free + np.arange(n), 2 * free + n + np.arange(n)))
    loss[np.ix_(places, places)] = columns[n:].T @ damping @ columns[n:]
    terms = np.zeros(free + n)
    terms[free : free + complex_ones.size] = _errors_of_values(k, vectors, _terms(phi, size))[complex_ones]
    none = [0.0] * free
    c = _without_rounding(np.array(none + [p[1] for p in pairs]), terms)
    return Blocks(np.array(none + [p[0] for p in pairs]), c, T, np.linalg.inv(T), loss)


def _real_pairs(values: Array, vectors: Array, real_ones: Any) -> list[tuple[float, float, Array, Array]]:
    """`_real_pair` of each of the slower half of the real eigenvalues with one of the other half."""
    half = real_ones.size // 2
    return [
        _real_pair(values[i], values[j], vectors[:, i], vectors[:, j])
        for i, j in zip(real_ones[:half], real_ones[half:], strict=True)
    ]


def _errors_of_values(k: Array, vectors: Any, terms: Array) -> Array:
    """Bounds of the errors of the eigenvalues of the state matrix, in units of the machine precision.

    They are sums of the sizes of all terms; ``terms`` (n, n) are those of damping and turning.
    """
    n = k.size
    sizes = np.block([[np.zeros((n, n)), np.eye(n)], [np.diag(np.abs(k)), terms]])
    return np.sum(np.abs(np.linalg.inv(vectors)) @ sizes * np.abs(vectors).T, axis=1)


def _states_of_blocks(rigid: Array, phi: Array, columns: Array) -> Array:
    """[q, q̇] of the blocks' states [p, v], rigid-body modes first; ``columns`` are p, then v of the others."""
    n, zero = phi.shape[1], np.zeros_like(rigid)
    p, v = columns[:n], columns[n:]
    return np.block([[rigid, phi @ p[:, :n], zero, phi @ p[:, n:]], [zero, phi @ v[:, :n], rigid, phi @ v[:, n:]]])


_OVERDAMPED = (
    "; where damping by stiffness, Rayleigh's beta, overdamps high modes, slow roots all come near -1/beta: lower "
    "beta, or keep fewer modes"
)
_INSEPARABLE = (
    "the damped modes cannot be separated (two coincide, as for a dashpot on a body that can float, or a critically "
    "damped mode); change a dashpot by one part in 10^6" + _OVERDAMPED
)
_INSEPARABLE_TURNING = (
    "the modes of C + G cannot be separated: a body with gyroscopic terms can float, or two damped modes coincide; "
    "hold it by a spring, however soft, or change a dashpot by one part in 10^6" + _OVERDAMPED
)


def _floating(k: Array, damping: Array, turning: Array) -> tuple[Array, int]:
    """A rotation of the rigid-body modes after which those neither damped nor turned come first, and their number.

    They are blocks of their own.
    """
    rigid, by_rate, rotation = int(np.sum(k == 0.0)), damping + turning, np.eye(k.size)
    if np.any(turning):
        _, values, rows = np.linalg.svd(by_rate[:, :rigid])
        values, turn = values[::-1].copy(), rows[::-1].T
    else:
        values, turn = np.linalg.eigh(damping[:rigid, :rigid])
    values[np.abs(values) < 1e-12 * np.abs(by_rate).max()] = 0.0
    rotation[:rigid, :rigid] = turn
    return rotation, int(np.sum(values == 0.0))


def _dissipation(vector: NDArray, k: Array, damping: Array) -> float:
    """C of a complex pair, from its energy: -2 Re λ = 2 v*Dv / (v*v + x*kx), with the rounding of D, not of λ."""
    x, v = np.split(vector, 2)
    energy = np.vdot(v, v).real + np.vdot(x, k * x).real
    return float(2.0 * np.vdot(v, damping @ v).real / energy)


def _complex_pair(value: complex, vector: NDArray, n: int) -> tuple[float, float, Array, Array]:
    """k, c and the two columns of a conjugate pair; the phase makes p as near to a displacement as it can be."""
    vector = vector * 1j * np.exp(-0.5j * np.angle(np.sum(vector[:n] ** 2)))
    a, b = vector.real, vector.imag
    return abs(value) ** 2, -2.0 * value.real, b + (value.real / value.imag) * a, -a / value.imag


def _real_pair(first: float, second: float, x: Array, y: Array) -> tuple[float, float, Array, Array]:
    """k, c and the two columns of two real eigenvalues."""
    if first == second:
        return first * second, -(first + second), np.zeros_like(x), np.zeros_like(x)
    difference = first - second
    return first * second, -(first + second), (-second * x - first * y) / difference, (x + y) / difference
