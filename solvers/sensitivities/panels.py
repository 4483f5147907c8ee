"""Motion of linear modes over panels of time, driven by forces given at nodes.

Blocks p' = v, v' = -k p - c v are propagated exactly; forces are polynomials through S Gauss–Legendre nodes in σ, where
t = clock(σ) makes forces δ^p with a broken p smooth at both ends of a contact,

    z(t_i) = E(t_i - a) z(a) + Σ_j K_ij r_j,    K_ij = ∫_a^{t_i} E(t_i - s) ℓ_j(s) ds.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.polynomial import Legendre
from scipy.special import beta as beta_function
from scipy.special import betainc, betaincinv

from solvers.problem import Array

S = 14  # nodes
_AS_LARGE = 1e-13  # relative; at the ends of a stretch the clock stands still, so that all slopes vanish there
_BEYOND = 1.02  # half widths from a panel's middle: a zero may lie between the outermost nodes of two panels
_SAME = 1e-12  # relative difference of widths up to which they are equal
_X, _W = np.polynomial.legendre.leggauss(S)
X, W = 0.5 * (_X + 1.0), 0.5 * _W  # on [0, 1]
_LEGENDRE = np.linalg.inv(np.polynomial.legendre.legvander(_X, S - 1))  # values at nodes -> coefficients


def lagrange(at: Array) -> Array:
    """Values (..., S) at points of [0, 1] of the polynomials that are 1 at one node and 0 at the others."""
    return np.polynomial.legendre.legvander(2.0 * at - 1.0, S - 1) @ _LEGENDRE


_WITHIN = lagrange(X[:, None] * X)  # (i, q, j): ℓ_j at node q of the interval before node i
_MANY = 12  # blocks from which on kernels are taken from series
_SHORT, _NEGLIGIBLE = 4.0, 1e-19  # radians up to which their terms cancel little; size of the first that is left out
_FINE, _NEWTON = lagrange(np.linspace(0.0, 1.0, 4 * S + 1)), 4  # where a maximum is looked for, and steps from there


@dataclass(frozen=True)
class Clock:
    """Time as a function of σ in [0, 1] from start to end: dt/dσ ~ (σ (1 - σ))^(m - 1)."""

    start: float
    end: float
    power: int = 1

    def time(self, sigma: Array) -> Array:
        """Times, s."""
        m = self.power
        return self.start + (self.end - self.start) * (sigma if m == 1 else betainc(m, m, sigma))

    def pace(self, sigma: Array) -> Array:
        """dt/dσ, s."""
        m, length = self.power, self.end - self.start
        if m == 1:
            return np.full(np.shape(sigma), length)
        return length * (sigma * (1.0 - sigma)) ** (m - 1) / beta_function(m, m)

    def place(self, t: Array) -> Array:
        """σ of times t."""
        share = np.clip((np.asarray(t) - self.start) / (self.end - self.start), 0.0, 1.0)
        return share if self.power == 1 else betaincinv(self.power, self.power, share)


def propagator(k: Array, c: Array, t: Array) -> tuple[Array, Array]:
    """α and β of all blocks over times t (...,), shapes (n, ...): E = [[α, β], [-k β, α - c β]]."""
    t = np.asarray(t, dtype=float)
    shape = (-1, *[1] * t.ndim)
    half, square = 0.5 * c.reshape(shape), (k - 0.25 * c * c).reshape(shape)
    omega = np.sqrt(np.abs(square))
    turn = omega * t
    with np.errstate(over="ignore", invalid="ignore"):
        decay = np.exp(-half * t)
        alpha = decay * np.cos(turn)
        beta = decay * np.where(omega > 0.0, np.sin(turn) / np.where(omega > 0.0, omega, 1.0), t)
        if np.any(square < 0.0):
            grow, fall = np.exp(turn - half * t), np.exp(-turn - half * t)
            near = decay * t * (1.0 + turn * turn / 6.0 * (1.0 + turn * turn / 20.0))
            far = 0.5 * (grow - fall) * t / np.where(turn > 0.0, turn, 1.0)
            alpha = np.where(square < 0.0, 0.5 * (grow + fall), alpha)
            beta = np.where(square < 0.0, np.where(turn < 1e-3, near, far), beta)
    return alpha + half * beta, beta


def _series(k: Array, c: Array, reach: float) -> tuple[Array, Array] | None:
    """Taylor coefficients (n, terms) of α and β in t / reach, to rounding; None where they would cancel."""
    speed = float((0.5 * (np.abs(c) + np.sqrt(c * c + 4.0 * np.abs(k)))).max()) * reach
    if not speed < _SHORT:
        return None
    terms = [np.array([np.ones_like(k), 0.0 * k]), np.array([0.0 * k, np.full_like(k, reach)])]
    size, m = 1.0, 0
    while size > _NEGLIGIBLE:
        terms.append(-((k * reach**2) / (m + 1) * terms[m] + c * reach * terms[m + 1]) / (m + 2))
        m, size = m + 1, size * speed / (m + 1)
    alpha, beta = np.stack(terms, axis=-1)
    return alpha, beta


def _by_series(alpha: Array, beta: Array, lag: Array, weights: Array) -> tuple[Array, Array]:
    """Kernels (n, P, S, S) from Taylor coefficients (n, terms): integrals of powers serve all blocks."""
    powers = weights * np.vander(lag.ravel(), alpha.shape[1], increasing=True).T.reshape(-1, *lag.shape)
    each = np.matmul(powers.transpose(2, 0, 1, 3).reshape(S, -1, S), _WITHIN)  # (i, terms P, j)
    moments = each.reshape(S, alpha.shape[1], -1, S).transpose(1, 2, 0, 3).reshape(alpha.shape[1], -1)
    a, b = ((one @ moments).reshape(-1, *lag.shape) for one in (alpha, beta))
    return a, b


def moved(k: Array, c: Array, over: tuple[Array, Array], y: Array) -> Array:
    """E y for α, β (n, ...) of a time and y (2n, ..., m), whose middle axes are those of α or have length 1."""
    a, b = (one[..., None] for one in over)
    n = len(k)
    p, v = y[:n], y[n:]
    k, c = (one.reshape(-1, *[1] * (a.ndim - 1)) for one in (k, c))
    return np.concatenate((a * p + b * v, a * v - b * (k * p + c * v)))


def running(k: Array, c: Array, t: Array, kicks: Array) -> Array:
    """Σ_{i<=j} E(t_j - t_i) g_i (2n, P, m) for all j, of impulses g (2n, P, m) at times t (P,), by doubling."""
    total, apart = kicks, 1
    while apart < len(t):
        over = propagator(k, c, t[apart:] - t[:-apart])
        total = np.concatenate((total[:, :apart], total[:, apart:] + moved(k, c, over, total[:, :-apart])), axis=1)
        apart *= 2
    return total


@dataclass(frozen=True, eq=False)
class Panels:
    """Panels between the edges σ (P + 1,), ascending, of a clock, for blocks with stiffness k and damping c."""

    k: Array
    c: Array
    clock: Clock
    edges: Array

    def __len__(self) -> int:
        return len(self.edges) - 1

    def parts(self, most: int) -> Iterator[Panels]:
        """The panels in parts of at most ``most``, one after the other: each keeps its tables."""
        return (replace(self, edges=self.edges[i : i + most + 1]) for i in range(0, len(self), most))

    @cached_property
    def widths(self) -> Array:
        """(P,) in σ."""
        return np.diff(self.edges)

    @cached_property
    def _sigma(self) -> Array:
        """(P, S) of the nodes."""
        return self.edges[:-1, None] + self.widths[:, None] * X

    @cached_property
    def times(self) -> Array:
        """(P, S) of the nodes."""
        return self.clock.time(self._sigma)

    @cached_property
    def weights(self) -> Array:
        """(P, S) Σ w f = ∫ f dt."""
        return self.widths[:, None] * W * self.clock.pace(self._sigma)

    @cached_property
    def ends(self) -> Array:
        """(P + 1,) times of the edges."""
        return self.clock.time(self.edges)

    @cached_property
    def _to_nodes(self) -> tuple[Array, Array]:
        """α and β (n, P, S) from the start of a panel to its nodes."""
        return propagator(self.k, self.c, self.times - self.ends[:-1, None])

    @cached_property
    def _to_end(self) -> tuple[Array, Array]:
        """α and β (n, P, S) from nodes to the end, times weights."""
        alpha, beta = propagator(self.k, self.c, self.ends[1:, None] - self.times)
        return alpha * self.weights, beta * self.weights

    @cached_property
    def kernels(self) -> tuple[Array, Array]:
        """∫ α ℓ_j and ∫ β ℓ_j up to node i, (n, P, S, S) each; (n, 1, S, S) of panels alike."""
        alike = self.clock.power == 1 and np.ptp(self.widths) <= _SAME * self.widths[0]
        own = slice(0, 1) if alike else slice(None)
        sigma = self.edges[:-1, None, None][own] + self.widths[:, None, None][own] * (X[:, None] * X)
        lag = np.maximum(self.times[own, :, None] - self.clock.time(sigma), 0.0)
        weights = self.widths[:, None, None][own] * X[:, None] * W * self.clock.pace(sigma)
        if not alike and len(self.k) > _MANY:
            series = _series(self.k, self.c, float(lag.max()))
            if series is not None:
                return _by_series(*series, lag / lag.max(), weights)
        alpha, beta = (one * weights for one in propagator(self.k, self.c, lag))
        a, b = (np.matmul(one[..., None, :], _WITHIN)[..., 0, :] for one in (alpha, beta))
        return a, b

    def free(self, y: Array) -> Array:
        """States (2n, P, S, m) at the nodes without forces, from those at the starts of panels (2n, P, m)."""
        return moved(self.k, self.c, self._to_nodes, y[:, :, None])

    def across(self) -> tuple[Array, Array]:
        """α and β (n, P) from start to end."""
        return propagator(self.k, self.c, np.diff(self.ends))

    def seen(self, row: Array) -> Array:
        """What a row (2n,) reads at the nodes of a state at the start, (P, S, 2n)."""
        (a, b), (p, v) = self._to_nodes, row.reshape(2, -1, 1, 1)
        k, c = self.k[:, None, None], self.c[:, None, None]
        return np.moveaxis(np.concatenate((p * a - k * b * v, p * b + v * (a - c * b))), 0, -1)

    def at_nodes(self, rates: Array) -> Array:
        """States (2n, P, S, m) at the nodes due to rates (2n, P, S, m) at them."""
        n, (a, b) = len(self.k), self.kernels
        p, v = rates[:n], rates[n:]
        k, c = self.k[:, None, None, None], self.c[:, None, None, None]
        bp, bv = b @ p, b @ v
        return np.concatenate((a @ p + bv, a @ v - k * bp - c * bv))

    def response(self, read: Array, push: Array) -> Array:
        """Of a row read (2n,) at the nodes to a force at the nodes that pushes (2n,), (P, S, S); (1, S, S) if alike."""
        (rp, rv), (bp, bv) = read.reshape(2, -1), push.reshape(2, -1)
        by_alpha, by_beta = rp * bp + rv * bv, rp * bv - rv * (self.k * bp + self.c * bv)
        alpha, beta = self.kernels
        return np.tensordot(by_alpha, alpha, 1) + np.tensordot(by_beta, beta, 1)

    def reach(self, push: Array) -> Array:
        """Of a force at the nodes that pushes (2n,): states at the ends, (P, 2n, S)."""
        return np.moveaxis(moved(self.k, self.c, self._to_end, push[:, None, None, None])[..., 0], 0, 1)

    def at_ends(self, rates: Array) -> Array:
        """States (2n, P, m) at the ends due to rates (2n, P, S, m) at the nodes."""
        return moved(self.k, self.c, self._to_end, rates).sum(axis=2)

    def within(self, states: Array, t: Array) -> Array:
        """States (q, 2n, m) at times t (q,) of the polynomials through states (2n, P, S, m) at the nodes."""
        sigma = self.clock.place(t)
        panel = np.clip(np.searchsorted(self.edges, sigma, side="right") - 1, 0, len(self) - 1)
        values = lagrange((sigma - self.edges[panel]) / self.widths[panel])
        return np.einsum("qs,bqsm->qbm", values, states[:, panel])


def coefficients(values: Array) -> Array:
    """Legendre coefficients (S, ...) of the polynomial through values (S, ...) at the nodes."""
    return np.tensordot(_LEGENDRE, values, axes=1)


def largest(values: Array, ends: tuple[bool, bool]) -> tuple[int, float, float]:
    """Panel, place in [0, 1] and size of the largest value of the polynomials through values (P, S) at the nodes.

    ``ends`` tells whether the first and the last end count; -inf is returned if the largest value is at one that does
    not.
    """
    panel, best = (int(i) for i in np.unravel_index(np.argmax(values @ _FINE.T), (len(values), len(_FINE))))
    x = 2.0 * best / (len(_FINE) - 1) - 1.0
    for _ in range(2):  # near an end the maximum may be in the next panel
        whole = Legendre(coefficients(values[panel]))
        top = _top(whole, x)
        beyond = int(top > 1.0) - int(top < -1.0)
        if not beyond:
            left_out = panel == 0 and not ends[0], panel == len(values) - 1 and not ends[1]
            return panel, 0.5 * (top + 1.0), _above_ends(whole, top, left_out)
        if not 0 <= panel + beyond < len(values):
            return panel, 0.5 * (beyond + 1.0), float(whole(beyond)) if ends[beyond > 0] else -np.inf
        panel, x = panel + beyond, -float(beyond)
    return panel, 0.5 * (x + 1.0), float(Legendre(coefficients(values[panel]))(x))  # a kink between two panels


def _above_ends(whole: Legendre, top: float, left_out: tuple[bool, bool]) -> float:
    """Value of a polynomial at its top; -inf if that is, but for rounding, the value at an end that is left out."""
    value = float(whole(top))
    ends = [float(whole(side)) for side, one in zip((-1.0, 1.0), left_out, strict=True) if one]
    return value if value - max(ends, default=-np.inf) > _AS_LARGE * abs(value) else -np.inf


def _top(whole: Legendre, x: float) -> float:
    """Zero of the slope of a polynomial near x; beyond [-1, 1] if it rises to an end."""
    slope, curvature = whole.deriv(), whole.deriv(2)
    for _ in range(_NEWTON):
        bend = float(curvature(x))
        x = x - float(slope(x)) / bend if bend < 0.0 else math.copysign(math.inf, slope(x))
        if not abs(x) <= 1.0:
            break
    return x


def zeros(values: Array) -> Array:
    """Places of the zeros of the polynomial through values (S,) at the nodes, in [0, 1] and a little beyond."""
    roots = Legendre(coefficients(values)).roots()
    real = roots[np.abs(roots.imag) < 1e-9].real
    return 0.5 * (real[np.abs(real) < _BEYOND] + 1.0)


def interpolated(place: float, values: Array) -> Array:
    """Value of the polynomials through values (S, ...) at a place in [0, 1]."""
    return np.asarray(np.polynomial.legendre.legval(2.0 * place - 1.0, coefficients(values)))
