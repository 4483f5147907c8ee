"""The decoupled form of a system: blocks of one or two states, each on its own but for the contact forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.problem.matrices import Array


@dataclass(frozen=True, eq=False)
class Blocks:
    """Decoupled form: stiffness k (n,), damping c (n,), transformation T and its inverse (2n, 2n).

    ``loss`` (2n, 2n) gives the damping power zᵀ loss z where damping couples modes, and is empty otherwise.
    """

    k: Array
    c: Array
    T: Array
    inverse: Array
    loss: Array


def decouple(M: Array, C: Array, K: Array) -> Blocks:
    """Find the decoupled form of (M, C, K)."""
    n = M.shape[0]
    if _is_diagonal(M) and _is_diagonal(K):
        phi, k = np.diag(1.0 / np.sqrt(np.diag(M))), np.diag(K) / np.diag(M)
    else:
        phi, k = _modes(M, K)
    damping = phi.T @ C @ phi
    spread = damping - np.diag(np.diag(damping))
    if np.abs(spread).max(initial=0.0) <= 1e-12 * np.abs(damping).max(initial=0.0):
        zero = np.zeros((n, n))
        inverse = phi.T @ M
        terms = np.sqrt(np.abs(k)) + np.diag(_terms(phi, C))
        return Blocks(
            k,
            _without_rounding(np.diag(damping), terms),
            np.block([[phi, zero], [zero, phi]]),
            np.block([[inverse, zero], [zero, inverse]]),
            np.empty((0, 0)),
        )
    return _state_blocks(phi, k, damping, C)


def _is_diagonal(matrix: Array) -> bool:
    """Whether all entries off the diagonal are zero."""
    return not np.any(matrix - np.diag(np.diag(matrix)))


def _modes(M: Array, K: Array) -> tuple[Array, Array]:
    """Mass-normalised modes and squared frequencies; rounding-size ones become exact zeros."""
    from scipy.linalg import eigh

    k, phi = eigh(K, M)
    k[np.abs(k) < 1e-13 * np.abs(k).max(initial=0.0)] = 0.0
    return phi, k


def _terms(phi: Array, C: Array) -> Array:
    """Sums of the sizes of all terms of φᵀ C φ: eps times them is its rounding."""
    sizes: Array = np.abs(phi).T @ np.abs(C) @ np.abs(phi)
    return sizes


def _without_rounding(c: Array, terms: Array) -> Array:
    """Dampings, those set to zero that are no more than the rounding of the terms they are sums of.

    A dashpot on a node of a mode leaves such a c, of either sign, instead of none.
    """
    return np.where(np.abs(c) <= 4 * c.size * np.finfo(float).eps * terms, 0.0, c)


def _state_blocks(phi: Array, k: Array, damping: Array, C: Array) -> Blocks:
    """Blocks of the state matrix [[0, I], [-diag(k), -damping]] whose damping couples the modes."""
    order = np.argsort(k != 0.0, kind="stable")  # rigid-body modes first
    phi, k, damping = phi[:, order], k[order], damping[np.ix_(order, order)]
    phi, damping, free = _floating(phi, k, damping)
    k, n = k[free:], k.size - free
    rigid, damping = phi[:, :free], damping[free:, free:]
    phi = phi[:, free:]
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(k), -damping]])
    values, vectors = np.linalg.eig(A)
    order = np.argsort(np.abs(values))
    values, vectors = values[order], vectors[:, order]
    scale = np.abs(values).max()
    complex_ones = np.flatnonzero(values.imag > 1e-12 * scale)
    real_ones = np.flatnonzero(np.abs(values.imag) <= 1e-12 * scale)
    half = real_ones.size // 2
    pairs = [_complex_pair(values[i], vectors[:, i], n) for i in complex_ones]
    pairs += [
        _real_pair(values[i].real, values[j].real, vectors[:, i].real, vectors[:, j].real)
        for i, j in zip(real_ones[:half], real_ones[half:], strict=True)
    ]
    columns = np.array([p[2] for p in pairs] + [p[3] for p in pairs]).T
    if len(pairs) != n or np.linalg.cond(columns) > 1e12:
        raise ValueError(
            "the damped modes cannot be separated (two coincide, as for a dashpot on a body that can float, or a "
            "critically damped mode); change a dashpot by one part in 10^6"
        )
    zero = np.zeros((phi.shape[0], free))
    T = np.hstack(
        (
            np.vstack((rigid, zero)),
            np.vstack((zero, rigid)),
            *(np.vstack((phi @ c[:n], phi @ c[n:])) for c in (columns[:, :n], columns[:, n:])),
        )
    )
    order = np.concatenate((np.arange(free), 2 * free + np.arange(n)))
    T = T[:, np.concatenate((order, order + np.where(np.arange(free + n) < free, free, n)))]
    loss = np.zeros((2 * (free + n), 2 * (free + n)))
    places = np.concatenate((free + np.arange(n), 2 * free + n + np.arange(n)))
    loss[np.ix_(places, places)] = columns[n:].T @ damping @ columns[n:]
    sizes = np.block([[np.zeros((n, n)), np.eye(n)], [np.diag(np.abs(k)), _terms(phi, C)]])
    errors = np.sum(np.abs(np.linalg.inv(vectors)) @ sizes * np.abs(vectors).T, axis=1)  # of λ, in units of eps
    terms = np.concatenate((np.zeros(free), errors[complex_ones], np.zeros(half)))
    none = [0.0] * free
    c = _without_rounding(np.array(none + [p[1] for p in pairs]), terms)
    return Blocks(np.array(none + [p[0] for p in pairs]), c, T, np.linalg.inv(T), loss)


def _floating(phi: Array, k: Array, damping: Array) -> tuple[Array, Array, int]:
    """Turn the rigid-body modes so that those no dashpot resists come first; they are blocks of their own."""
    rigid = int(np.sum(k == 0.0))
    values, turn = np.linalg.eigh(damping[:rigid, :rigid])
    values[np.abs(values) < 1e-12 * np.abs(damping).max()] = 0.0
    rotation = np.eye(k.size)
    rotation[:rigid, :rigid] = turn
    return phi @ rotation, rotation.T @ damping @ rotation, int(np.sum(values == 0.0))


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
