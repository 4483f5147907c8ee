r"""The oscillators p'' + c p' + k p = 0 that decide how long a constant step on M q'' + C q' + K q = 0 may be.

A Runge–Kutta method is judged by the eigenvalues of λ² M + λ (C + G) + K: (k, c) = (|λ|², -2 Re λ), (0, -λ) where λ is
real.

Newmark's method on the matrices multiplies a motion x μ^j by μ where

.. math:: \left(\frac{(μ-1)^2}{h^2} M + \frac{(μ-1)(γμ+1-γ)}{h} C
          + (βμ^2 + (\tfrac12-2β+γ) μ + \tfrac12+β-γ) K\right) x = 0.

For γ >= ½ and semidefinite C, K it can only lose its stability at μ = -1, where this is, up to its factor,

.. math:: Q(h) = 4 M + (4γ-2) h C - (2γ-4β) h^2 K,

so that the step is stable as long as Q is positive definite, whatever couples the modes. The vector x that makes Q
singular first gives (k, c) = (xᵀK x, xᵀC x) with xᵀM x = 1. With a skew G beside C the step is stable while Q without
its C is positive definite: multiply the difference of the equations of two steps by Δv; as Δvᵀ G Δv = 0, the energy
aᵀ(M + (β-½γ) h² K) a + vᵀK v does not grow.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from solvers.problem import Array, decouple

_DENSE = 60  # coordinates up to which all eigenvalues are computed, of dense matrices, which is quicker
_EXTREMES = (("LM", 6), ("SR", 3), ("LI", 3))  # eigenvalues computed of sparse matrices: so many of the largest size,
# most damped and fastest; one of these limits an explicit method
_NOTHING = 1e-6  # share of the largest eigenvalue below which one is a rigid-body motion, or rounding


def eigen_oscillators(M: Any, C: Any, K: Any, G: Any) -> tuple[Array, Array]:
    """(k, c) of the eigenvalues of λ² M + λ (C + G) + K; of large sparse matrices only those of the extreme ones."""
    if hasattr(M, "toarray") and M.shape[0] > _DENSE:
        values = _extreme_eigenvalues(M, C if G is None else C + G, K)
    else:
        M, C, K, G = (matrix.toarray() if hasattr(matrix, "toarray") else matrix for matrix in (M, C, K, G))
        try:
            blocks = decouple(M, C, K, G)
            return blocks.k, blocks.c
        except ValueError:  # two damped modes coincide; their eigenvalues alone are enough here
            n, by_rate = M.shape[0], C if G is None else C + G
            A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, by_rate)]])
            values = np.linalg.eigvals(A)
    return _oscillators_of(values)


def _oscillators_of(values: Array) -> tuple[Array, Array]:
    """(k, c) of eigenvalues, without those of rounding's size."""
    size = np.abs(values)
    values = values[size >= _NOTHING * size.max(initial=0.0)]
    real = np.abs(values.imag) <= _NOTHING * np.abs(values)
    damping = -values.real * np.where(real, 1.0, 2.0)
    return np.where(real, 0.0, np.abs(values) ** 2), np.where(np.abs(damping) < 1e-9 * np.abs(values), 0.0, damping)


def _extreme_eigenvalues(M: Any, C: Any, K: Any) -> Array:
    """The largest, most damped and fastest eigenvalues of λ² M + λ C + K, by Arnoldi's iteration on [ω q, q']."""
    from scipy.sparse.linalg import LinearOperator, eigs, splu

    n, solve = M.shape[0], splu(M.tocsc()).solve
    omega = math.sqrt(abs(_fastest(M, K)[0]))

    def rate(z: Array) -> Array:
        q, v = z[:n] / omega, z[n:]
        return np.concatenate((omega * v, -solve(K @ q + C @ v)))

    operator = LinearOperator((2 * n, 2 * n), matvec=rate, dtype=float)
    start = np.ones(2 * n) + np.arange(2 * n) % 3
    options: Any = {"v0": start, "tol": 1e-4, "return_eigenvectors": False}
    return np.concatenate([eigs(operator, count, which=which, **options) for which, count in _EXTREMES])


def _fastest(M: Any, K: Any) -> tuple[float, Array]:
    """Largest eigenvalue of K x = k M x, and its vector."""
    if M.shape[0] < 3 or not hasattr(M, "toarray"):  # too small for an iteration
        from scipy.linalg import eigh

        M, K = (matrix.toarray() if hasattr(matrix, "toarray") else matrix for matrix in (M, K))
        k, phi = eigh(K, M, subset_by_index=[M.shape[0] - 1] * 2)
    else:
        from scipy.sparse.linalg import eigsh

        k, phi = eigsh(K, 1, M, which="LM", v0=np.ones(M.shape[0]) + np.arange(M.shape[0]) % 3)
    return float(k[0]), phi[:, 0]


def newmark_oscillator(beta: float, gamma: float, M: Any, C: Any, K: Any, G: Any) -> tuple[Array, Array]:
    """(k, c) of the vector that makes Q(h) singular first, by iteration on its Rayleigh quotient."""
    a, b, h = 2.0 * gamma - 4.0 * beta, 4.0 * gamma - 2.0, 0.0
    C = C if G is None else 0.0 * C
    k = c = 0.0
    for _ in range(20):
        _, x = _fastest(M + 0.25 * b * h * C, K)
        mass = float(x @ (M @ x))
        k, c = float(x @ (K @ x)) / mass, float(x @ (C @ x)) / mass
        if not (a > 0.0 and k > 0.0):  # stable for every step
            break
        before, h = h, (b * c + math.sqrt((b * c) ** 2 + 16.0 * a * k)) / (2.0 * a * k)
        if abs(h - before) <= 1e-6 * h:
            break
    return np.array([k]), np.array([c])
