"""Responses of the blocks to loads that are polynomials of time: φ-functions of their matrices."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np

from solvers.compiled.kernels import Problem
from solvers.exponential.responses import fill_propagators

_LONG = 8.0  # |λ| h of a block's slower rate from which on its responses are recurrences


def signal_responses(problem: Problem, h: Any) -> Any:
    """State change (len(h), L, 6, 2N) by loads t^k/k!, k = 0..5; the latest are kept."""
    if not np.any(problem.load):
        return np.zeros((len(h), len(problem.load), 6, 2 * len(problem.k)))
    return _polynomial_responses(*(array.tobytes() for array in (problem.k, problem.c, problem.load, h)))


def quintic_responses(problem: Problem, h: float) -> Any:
    """State change (L, 6, 2, N) over a time h by the quintic through s, s', s'' at its start and at its end."""
    rows: Any = np.einsum("kd,lke->lde", derivatives_of_ends(h), signal_responses(problem, np.array([h]))[0])
    return rows.reshape(-1, 6, 2, len(problem.k))


def derivatives_of_ends(h: float) -> Any:
    """(6, 6) derivatives of a quintic at its start from s, s', s'' there and after the time h."""
    scale, hermite = h ** np.arange(6.0), np.zeros((6, 6))
    hermite[:3, :3] = np.diag((1.0, 1.0, 0.5))
    hermite[3:] = [
        [-10.0, -6.0, -1.5, 10.0, -4.0, 0.5],
        [15.0, 8.0, 1.5, -15.0, 7.0, -1.0],
        [-6.0, -3.0, -0.5, 6.0, -3.0, 0.5],
    ]
    factorial = np.array([math.factorial(i) for i in range(6)])
    return hermite * np.tile(scale[:3], 2) * (factorial / scale)[:, None]


@lru_cache(maxsize=16)
def _polynomial_responses(stiffnesses: bytes, dampings: bytes, load: bytes, steps: bytes) -> Any:
    """The same from the arrays' bytes: φ-functions by Taylor series and doubling, or those of `_long_responses`."""
    h, stiffness, damping = (np.frombuffer(part) for part in (steps, stiffnesses, dampings))
    size = len(stiffness)
    rows = np.frombuffer(load).reshape(-1, 2, size)
    loads = len(rows)
    out = np.zeros((len(h), loads, 6, 2 * size))
    A = np.zeros((size, 2, 2))
    speed = np.where(stiffness > 0.0, np.sqrt(stiffness), 1.0)  # unit of rates, for fewer halvings, less rounding
    A[:, 0, 1], A[:, 1, 0], A[:, 1, 1] = speed, -stiffness / speed, -damping
    half = 0.5 * damping
    slower = stiffness / np.maximum(speed, half + np.sqrt(np.maximum(half * half - stiffness, 0.0)))
    long = h[:, None] * slower >= _LONG
    vectors = np.stack((rows[:, 0], rows[:, 1] / speed), axis=2)  # (L, N, 2)
    phi = _phi(np.where(long, 0.0, h[:, None])[:, :, None, None] * A)
    for k in range(6):
        change = np.einsum("hnab,lnb->hlan", phi[k + 1], vectors) * (h ** (k + 1))[:, None, None, None]
        out[:, :, k] = change.reshape(len(h), loads, 2 * size)
    out[..., size:] *= speed
    by_block = out.reshape(len(h), loads, 6, 2, size)
    np.copyto(by_block, _long_responses(stiffness, damping, rows, h), where=long[:, None, None, None])
    out.setflags(write=False)
    return out


def _long_responses(k: Any, c: Any, rows: Any, h: Any) -> Any:
    """(len(h), L, 6, 2, N) R_0 = A⁻¹(E - I) g, R_i = A⁻¹(R_{i-1} - g hⁱ/i!), with the tables' E; zero for k = 0.

    A block that follows a signal rests on E times its state and these cancelling: with one E, to rounding of the state.
    """
    E, out = np.empty((len(h), 2, 1, 1, len(k))), np.empty((len(h), len(rows), 6, 2, len(k)))
    fill_propagators(k, c, (0, len(k)), h, E.reshape(len(h), 2, -1))
    response = (E[:, 0] - 1.0) * _solved(k, c, rows) + E[:, 1] * rows
    for i in range(6):
        out[:, :, i] = response
        response = _solved(k, c, response - rows * (h ** (i + 1) / math.factorial(i + 1))[:, None, None, None])
    return out


def _solved(k: Any, c: Any, x: Any) -> Any:
    """A⁻¹ x of places and rates (..., 2, N); 0 where k = 0."""
    stiff = np.where(k > 0.0, k, np.inf)
    return np.stack((-(x[..., 1, :] + c * x[..., 0, :]) / stiff, np.where(k > 0.0, x[..., 0, :], 0.0)), axis=-2)


def _phi(Z: Any) -> list[Any]:
    """φ_0(Z) ... φ_6(Z) of a stack of 2x2 matrices, φ_k(Z) = Σ_i Z^i/(i + k)!.

    Each matrix is halved as often as it needs: every further halving would lose a bit of Z beside I.
    """
    sizes = np.maximum(np.abs(Z).sum(axis=-1).max(axis=-1), 1e-300)
    halvings = np.maximum(np.ceil(np.log2(sizes)) + 1.0, 0.0)
    small = Z * 2.0 ** -halvings[..., None, None]
    phi = []
    for k in range(7):
        term = np.broadcast_to(np.eye(2), Z.shape) / math.factorial(k)
        total = term.copy()
        for i in range(1, 20):
            term = term @ small / (i + k)
            total = total + term
        phi.append(total)
    for i in range(int(halvings.max())):
        some = halvings > i
        halves = [part[some] for part in phi]
        for k in range(7):
            rest = sum(halves[j] / math.factorial(k - j) for j in range(1, k + 1))
            phi[k][some] = (halves[0] @ halves[k] + rest) / 2.0**k
    return phi
