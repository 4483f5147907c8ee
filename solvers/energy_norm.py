"""The norm of energy of small changes of a state, in which sizes do not depend on the units of time and length."""

from __future__ import annotations

import numpy as np

from solvers.problem import Array, System, dense


def energy_norm(system: System, duration: float) -> Array:
    """N (2n, 2n) with |N [q, q̇]|² = q·(|K| + M/duration²) q + q̇·M q̇; the added spring lets rigid motions count."""
    M, K, n = dense(system.M), dense(system.K), system.size
    norm = np.zeros((2 * n, 2 * n))
    norm[:n, :n], norm[n:, n:] = _root(K + M / duration**2), _root(M)
    return norm


def _root(matrix: Array) -> Array:
    """Square root of a symmetric matrix, with the absolute values of its eigenvalues."""
    values, vectors = np.linalg.eigh(matrix)
    values = np.abs(values)
    return (vectors * np.sqrt(np.maximum(values, 1e-12 * values.max()))) @ vectors.T
