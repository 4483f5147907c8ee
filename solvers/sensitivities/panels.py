"""What linear modes do over a panel of time, driven by forces given at its nodes.

Blocks p' = v, v' = -k p - c v are propagated exactly; forces are polynomials through S Gauss-Legendre nodes in σ, where
t = clock(σ) makes forces δ^p with a broken p smooth at both ends of a contact,

    z(t_i) = E(t_i - a) z(a) + Σ_j K_ij r_j,    K_ij = ∫_a^{t_i} E(t_i - s) ℓ_j(s) ds.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import beta as beta_function
from scipy.special import betainc, betaincinv

from solvers.problem import Array

S = 14  # nodes
_BEYOND = (
    1.02  # half widths of a panel from its middle: the outermost nodes are within, a zero may lie between two panels
)
_X, _W = np.polynomial.legendre.leggauss(S)
X, W = 0.5 * (_X + 1.0), 0.5 * _W  # on [0, 1]


def _lagrange(at: Array) -> Array:
    """Values (..., S) of the polynomials that are 1 at one node and 0 at the others."""
    out = np.ones((*at.shape, S))
    for j in range(S):
        for i in range(S):
            if i != j:
                out[..., j] *= (at - X[i]) / (X[j] - X[i])
    return out


_WITHIN = _lagrange(X[:, None] * X)  # (i, q, j): ℓ_j at node q of the part before node i
_LEGENDRE = np.linalg.inv(np.polynomial.legendre.legvander(_X, S - 1))  # values at nodes -> coefficients


@dataclass(frozen=True)
class Clock:
    """Time over σ in [0, 1] from start to end: dt/dσ ~ (σ (1 - σ))^(m - 1)."""

    start: float
    end: float
    power: int = 1

    def time(self, sigma: Array) -> Array:
        """Times, s."""
        m = self.power
        return np.asarray(self.start + (self.end - self.start) * (sigma if m == 1 else betainc(m, m, sigma)))

    def pace(self, sigma: Array) -> Array:
        """dt/dσ, s."""
        m, length = self.power, self.end - self.start
        if m == 1:
            return np.full(np.shape(sigma), length)
        return np.asarray(length * (sigma * (1.0 - sigma)) ** (m - 1) / beta_function(m, m))

    def place(self, t: Array) -> Array:
        """σ of times."""
        share = np.clip((np.asarray(t) - self.start) / (self.end - self.start), 0.0, 1.0)
        return share if self.power == 1 else np.asarray(betaincinv(self.power, self.power, share))


def propagator(k: Array, c: Array, t: Array) -> tuple[Array, Array]:
    """α and β of all blocks over times t (...,), shapes (n, ...): E = [[α, β], [-k β, α - c β]]."""
    t = np.asarray(t, dtype=float)
    shape = (-1, *[1] * t.ndim)
    half, mu = 0.5 * c.reshape(shape), np.sqrt(0.25 * c * c - k + 0j).reshape(shape)
    turn = mu * t
    with np.errstate(divide="ignore", invalid="ignore"):
        far = (np.exp(turn - half * t) - np.exp(-turn - half * t)) / (2.0 * mu)
    square = turn * turn
    near = np.exp(-half * t) * t * (1.0 + square / 6.0 * (1.0 + square / 20.0))
    beta = np.where(np.abs(turn) < 1e-3, near, far).real
    alpha = (0.5 * (np.exp(turn - half * t) + np.exp(-turn - half * t))).real + half * beta
    return alpha, beta


def moved(k: Array, c: Array, alpha: Array, beta: Array, y: Array) -> Array:
    """E y for α, β (n, ...) and y (2n, m): (2n, ..., m)."""
    n = len(k)
    lift = (n, *[1] * (alpha.ndim - 1), 1)
    p, v = y[:n].reshape(*lift[:-1], -1), y[n:].reshape(*lift[:-1], -1)
    a, b = alpha[..., None], beta[..., None]
    first = a * p + b * v
    return np.concatenate((first, a * v - b * (k.reshape(lift) * p + c.reshape(lift) * v)))


@dataclass(frozen=True, eq=False)
class Panel:
    """One panel of a clock, between two σ; of blocks with stiffness k and damping c."""

    k: Array
    c: Array
    clock: Clock
    low: float
    high: float

    @cached_property
    def times(self) -> Array:
        """(S,) of the nodes."""
        return self.clock.time(self.low + (self.high - self.low) * X)

    @cached_property
    def weights(self) -> Array:
        """(S,) Σ w f = ∫ f dt."""
        return np.asarray((self.high - self.low) * W * self.clock.pace(self.low + (self.high - self.low) * X))

    @cached_property
    def ends(self) -> tuple[float, float]:
        """Its first and last time."""
        first, last = self.clock.time(np.array([self.low, self.high]))
        return float(first), float(last)

    @cached_property
    def kernels(self) -> tuple[Array, Array]:
        """∫ α ℓ_j and ∫ β ℓ_j up to node i, (n, S, S) each."""
        sigma = self.low + (self.high - self.low) * X[:, None] * X
        lag = np.maximum(self.times[:, None] - self.clock.time(sigma), 0.0)
        alpha, beta = propagator(self.k, self.c, lag)
        weights = (self.high - self.low) * X[:, None] * W * self.clock.pace(sigma)
        table = (weights[:, :, None] * _WITHIN).transpose(0, 1, 2)
        a, b = (np.matmul(one[:, :, None, :], table[None])[:, :, 0, :] for one in (alpha, beta))
        return a, b

    def free(self, y: Array) -> Array:
        """States (2n, S, m) at the nodes without forces."""
        return moved(self.k, self.c, *propagator(self.k, self.c, self.times - self.ends[0]), y)

    def at_nodes(self, rates: Array) -> Array:
        """States (2n, S, ...) at the nodes due to rates (2n, S, ...) at them."""
        n, (a, b) = len(self.k), self.kernels
        p, v = rates[:n], rates[n:]
        k, c = (x.reshape(-1, *[1] * (rates.ndim - 1)) for x in (self.k, self.c))
        ap, bp, av, bv = (np.einsum("bij,bj...->bi...", m, r) for m, r in ((a, p), (b, p), (a, v), (b, v)))
        return np.concatenate((ap + bv, av - k * bp - c * bv))

    def response(self, read: Array, push: Array) -> Array:
        """Of a row read (2n,) at the nodes to a force at the nodes that pushes (2n,), (S, S)."""
        n, (a, b) = len(self.k), self.kernels
        (rp, rv), (bp, bv) = np.split(read, 2), np.split(push, 2)
        assert len(rp) == n
        return np.asarray(
            np.einsum("b,bij->ij", rp * bp + rv * bv, a)
            + np.einsum("b,bij->ij", rp * bv - rv * (self.k * bp + self.c * bv), b)
        )

    def end(self, y: Array, rates: Array) -> Array:
        """State (2n, m) at the end, from that at the start and rates (2n, S, m) at the nodes."""
        n, last = len(self.k), self.ends[1]
        at_end = moved(self.k, self.c, *propagator(self.k, self.c, np.array(last - self.ends[0])), y)
        alpha, beta = propagator(self.k, self.c, last - self.times)
        a, b = (alpha * self.weights)[..., None], (beta * self.weights)[..., None]
        p, v = rates[:n], rates[n:]
        k, c = self.k[:, None, None], self.c[:, None, None]
        return np.asarray(at_end + np.concatenate((a * p + b * v, a * v - b * (k * p + c * v))).sum(axis=1))


def coefficients(values: Array) -> Array:
    """Legendre coefficients (S, ...) of the polynomial through values (S, ...) at the nodes."""
    return np.asarray(np.tensordot(_LEGENDRE, values, axes=1))


def largest(values: Array, ends: list[float]) -> tuple[float, float]:
    """Place in [0, 1] of the largest value of the polynomial through values (S,) at the nodes, and that value.

    Maxima within, and those of the ends, 0 and 1, that are given.
    """
    polynomial = np.polynomial.legendre.Legendre(coefficients(values))
    roots = polynomial.deriv().roots()
    real = roots[np.abs(roots.imag) < 1e-9].real
    places = np.concatenate((2.0 * np.array(ends) - 1.0, real[np.abs(real) < 1.0]))
    if not places.size:
        return 0.0, -np.inf
    found = polynomial(places)
    best = int(np.argmax(found))
    return 0.5 * (float(places[best]) + 1.0), float(found[best])


def zeros(values: Array) -> Array:
    """Places of the zeros of the polynomial through values (S,) at the nodes, in [0, 1] and a little beyond."""
    roots = np.polynomial.legendre.Legendre(coefficients(values)).roots()
    real = roots[np.abs(roots.imag) < 1e-9].real
    return 0.5 * (real[np.abs(real) < _BEYOND] + 1.0)


def interpolated(place: float, values: Array) -> Array:
    """Value of the polynomials through values (S, ...) at a place in [0, 1]."""
    return np.asarray(np.polynomial.legendre.legval(2.0 * place - 1.0, coefficients(values)))
