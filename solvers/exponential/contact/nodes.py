"""Node sets of contact steps: nodes, weights of the forces, and what is computed from the values at the nodes.

A force is given by its values F_j at S nodes σ_j of (0, 1), t = h σ^κ:

    F(t) = w(σ) Σ_j L_j(σ) F_j / w(σ_j),

*smooth*: κ = 1, w = 1, Gauss–Legendre nodes; *entry*: w = σ^λ, Gauss–Jacobi nodes for the weight σ^{λ+κ-1}. A force is
a sum of terms that begin like δ^p, with one or more powers p. After an entry at t = 0 it is a series in t^{1/κ} if all
κp are whole numbers, and begins with t^{λ/κ}, λ/κ the smallest p: κ = 2, λ = 3 for Hertz's law, κ = 4, λ = 1 for that
of Tsuji.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from solvers.compiled.kernels import kernel

S: Any = np.int64(8)  # nodes of a contact step: 6 is a little faster at 1e-6, 10 and 12 bring nothing
# (numba would compile functions twice, for the literal 8 and for other integers)
_CHECKED = (np.arange(24) + 0.5) / 24  # points of (0, 1) where the interpolant through the nodes is compared
_NODES_FIRST = [*range(S), *range(S + 1, 2 * S + 1), S, 2 * S + 1]  # Hermite data: those at the start last
AT_BEGIN, AT_END, SLOPE_AT_BEGIN, SLOPE_AT_END = range(4, 8)  # places in a row of Scratch.summary, see Tables.summary
PHASES = np.geomspace(1e-2, 1e4, 600)  # ω h at which `NodeSets.alias` is tabulated
LOCAL = -np.cos(np.pi * np.arange(S) / (S - 1))  # Chebyshev points in which a function around a node is interpolated
MONOMIALS = np.ascontiguousarray(np.linalg.inv(np.vander(LOCAL, increasing=True)).T)  # coefficients from values


@kernel
def lagrange(nodes, weights, sigma, out):
    """Lagrange polynomials at σ: Π_{i≠j} (σ - σ_i) × weight j, 1 at their node if that is 1/Π (σ_j - σ_i)."""
    for j in range(nodes.size):
        value = weights[j]
        for i in range(nodes.size):
            if i != j:
                value *= sigma - nodes[i]
        out[j] = value


@lru_cache(maxsize=8)
def gauss(count: int) -> Any:
    """(2, count) Gauss–Legendre points and weights on (0, 1)."""
    x, w = np.polynomial.legendre.leggauss(count)
    return np.array([0.5 * (1.0 + x), 0.5 * w])


def _derivatives(points: Any) -> Any:
    """(i, m) derivative m at 0 of the polynomial that is 1 at point i and 0 at the others."""
    others, factorial = [np.delete(points, i) for i in range(len(points))], np.cumprod([1, *range(1, len(points))])
    found = [np.poly(rest)[::-1] / np.prod(x - rest) for x, rest in zip(points, others, strict=True)]
    return np.array(found) * factorial


DERIVATIVES = _derivatives(gauss(int(S))[0])  # of a force by t/h at the start, from its values at the smooth nodes


def so_far(points: Any) -> Any:
    """(q, r) integral from 0 to point q of (0, 1) of the polynomial that is 1 at point r and 0 at the others."""
    legendre = np.polynomial.legendre
    x, one = 2.0 * points - 1.0, np.eye(len(points))
    integrals = [legendre.legval(x, legendre.legint(row, lbnd=-1.0)) for row in one]
    return np.ascontiguousarray(0.5 * np.array(integrals).T @ np.linalg.inv(legendre.legvander(x, len(x) - 1)))


def gauss_jacobi(beta: float) -> Any:
    """S points on (-1, 1), weights for (1 + x)^β of sum 1/(β + 1), and (S, S) Jacobi coefficients from point values.

    The points are eigenvalues of the matrix of the recurrence (Golub, Welsch, Math. Comp. 23, 1969).
    """
    k = np.arange(S)
    j = 2.0 * k[1:] + beta
    middle = np.append(beta / (beta + 2.0), beta**2 / (j * (j + 2.0)))
    side = np.append(0.0, 2.0 * k[1:] * (k[1:] + beta) / (j * np.sqrt(j**2 - 1.0)))
    x = np.linalg.eigvalsh(np.diag(middle) + np.diag(side[1:], 1) + np.diag(side[1:], -1))
    found = [np.zeros(S), np.full(S, math.sqrt(beta + 1.0))]  # of norm 1
    for i in range(S - 1):
        found.append(((x - middle[i]) * found[-1] - side[i] * found[-2]) / side[i + 1])
    weights = 1.0 / np.sum(np.square(found), axis=0)
    return x, weights, np.array(found[1:]) * weights * np.sqrt(2.0 * k + beta + 1.0)[:, None]


class _NodeSet(NamedTuple):
    """Nodes σ of one kind of contact step, t = h σ^κ, F = σ^λ × polynomial; κ and λ are its exponents.

    ∫F dt = h Σ weights F; ``spectrum`` gives the Jacobi coefficients of the polynomial from the values of F.
    """

    time_exponent: float
    weight_exponent: float
    nodes: Any
    weights: Any
    spectrum: Any


def _node_set(time_exponent: float, weight_exponent: float) -> _NodeSet:
    """Node set of given κ and λ, with Gauss–Jacobi nodes for the weight of ∫F dt."""
    x, w, spectrum = gauss_jacobi(weight_exponent + time_exponent - 1.0)
    sigma = 0.5 * (1.0 + x)
    scale = sigma ** (-weight_exponent)
    return _NodeSet(time_exponent, weight_exponent, sigma, time_exponent * w * scale, spectrum * scale)


class NodeSets(NamedTuple):
    """The node sets of a problem: that of smooth steps, then one per stop, for the step on which it enters contact.

    Many stops have equal nodes. So large tables are indexed by *kind*, the distinct (κ, λ), or by *weighting*: of plain
    forces one for each kind, then one for each kind with a weight σ^λ.
    """

    kind: Any  # (f,) kind of each node set; also the weighting of plain forces on it
    entering: Any  # (f,) weighting of the force of the stop that enters
    kinds: Any  # (kinds,) a node set of each kind
    weightings: Any  # (weightings, 2) a node set of each, then 1 with the weight σ^λ, 0 without
    time_exponent: Any  # (f,)
    weight_exponent: Any
    nodes: Any  # (f, S), as the rest in `Tables`
    times: Any
    weights: Any
    plain: Any
    work: Any
    work_end: Any
    summary: Any
    node_slopes: Any
    tail: Any
    local_interpolation: Any
    local_interval: Any
    extrapolation: Any
    lagrange: Any  # (f, 2, S) weights of the Lagrange polynomials, plain and divided by the force's weight
    alias: Any  # (f, P) largest error between the nodes of the interpolant of e^{iωt}, at `PHASES`


def series_of(law: Any) -> tuple[float, float]:
    """(κ, λ) of a law's force at entry; see the module. κ = 2 if no κ <= 4 makes all κp whole numbers."""
    powers = getattr(law, "powers", None) or ((0.0, law.exponent) if law.jump else (law.exponent,))
    for time_exponent in (1.0, 2.0, 4.0):
        if all(abs(time_exponent * p - round(time_exponent * p)) < 1e-9 for p in powers):
            return time_exponent, time_exponent * min(powers) if time_exponent > 1.0 else 0.0
    return 2.0, 2.0 * min(powers)


@lru_cache(maxsize=64)
def node_sets_of(series: tuple[tuple[float, float], ...]) -> NodeSets:
    """The node sets for the (κ, λ) of all stops."""
    kinds = list(dict.fromkeys(((1.0, 0.0), *series)))
    found = [_node_set(*kind) for kind in kinds]
    kind = np.array([kinds.index(one) for one in ((1.0, 0.0), *series)])
    first = [kind.tolist().index(i) for i in range(len(kinds))]
    weighted = [i for i, node_set in enumerate(found) if node_set.weight_exponent]
    enters = np.array([len(kinds) + weighted.index(i) if i in weighted else i for i in range(len(kinds))])

    def each(of: Callable[[_NodeSet], Any]) -> Any:
        return np.ascontiguousarray(np.array([of(f) for f in found])[kind])

    return NodeSets(
        kind=kind,
        entering=enters[kind],
        kinds=np.array(first),
        weightings=np.array([*((f, 0) for f in first), *((first[i], 1) for i in weighted)]),
        time_exponent=each(lambda f: f.time_exponent),
        weight_exponent=each(lambda f: f.weight_exponent),
        nodes=each(lambda f: f.nodes),
        times=each(lambda f: f.nodes**f.time_exponent),
        weights=each(lambda f: f.weights),
        plain=each(_plain_weights),
        work=each(lambda f: _work_weights(f.nodes)[:, :S]),
        work_end=each(lambda f: _work_weights(f.nodes)[:, S]),
        summary=each(_summary),
        node_slopes=each(_node_slopes),
        tail=each(lambda f: _tail(f.nodes)),
        local_interpolation=each(lambda f: [_interpolate_locally(f, *bracket) for bracket in _brackets(f)]),
        local_interval=each(_brackets),
        extrapolation=each(lambda f: _extensions(f, found[0])),
        lagrange=each(lambda f: lagrange_weights(f.nodes) * [np.ones(S), f.nodes ** (-f.weight_exponent)]),
        alias=each(_alias),
    )


def _summary(node_set: _NodeSet) -> Any:
    """(S, 8) last four coefficients, values and slopes dF/dσ at start and end, from node values of a force."""
    rows = np.zeros((8, S))
    rows[:4] = node_set.spectrum[-4:]
    rows[4:6] = _interpolation(node_set.nodes, np.array([0.0, 1.0]))
    rows[6:8] = rows[4:6] @ _differentiation(node_set.nodes)
    if node_set.weight_exponent:
        rows[4], rows[5] = 0.0, rows[5] * node_set.nodes ** (-node_set.weight_exponent)
    return rows.T


def _node_slopes(node_set: _NodeSet) -> Any:
    """(S, S) slopes h dF/dt at the nodes of the polynomial through values there, taken from that at σ = 0."""
    pace = node_set.time_exponent * node_set.nodes ** (node_set.time_exponent - 1.0)
    return (_differentiation(np.append(node_set.nodes, 0.0))[:S, :S] / pace[:, None]).T


def _plain_weights(node_set: _NodeSet) -> Any:
    """(S,) weights of ∫ F dt/h of a force without the weight σ^λ, from its values at the nodes."""
    points, weights = gauss(12)
    return (weights * node_set.time_exponent * points ** (node_set.time_exponent - 1.0)) @ _interpolation(
        node_set.nodes, points
    )


def _work_weights(nodes: Any) -> Any:
    """(S, S + 1) weights of ∫ F dδ = Σ F_i weight_ij (δ_j - δ₀); nodes interpolate F, nodes and ends δ."""
    points, weights = gauss(S)
    places = np.append(nodes, [1.0, 0.0])
    slopes = _interpolation(places, points) @ _differentiation(places)
    return (weights * _interpolation(nodes, points).T) @ slopes[:, :-1]


def _brackets(node_set: _NodeSet) -> Any:
    """(S, 2) ends in σ of the interval between the neighbours of every node."""
    ends = np.concatenate(([0.0], node_set.nodes, [1.0]))
    return np.column_stack((ends[:-2], ends[2:]))


def _interpolate_locally(node_set: _NodeSet, begin: float, end: float) -> Any:
    """(2S + 2, 2S): δ and h δ̇ at the points `LOCAL` of a bracket [begin, end] of σ, from those at nodes and start.

    δ is Hermite's polynomial in σ. δ̇ of a smooth step is the polynomial through its values; in a short one the slope of
    the former is rounding over h. On an entry step it is that slope over dt/dσ, and where that vanishes, beside
    the start, δ̇(0) + σ^κ × the polynomial through (δ̇ - δ̇(0))/σ^κ at the nodes.
    """
    x, y = np.append(node_set.nodes, 0.0), begin + 0.5 * (LOCAL + 1.0) * (end - begin)
    basis, turn = _interpolation(x, y), _differentiation(x)
    slopes, own = basis @ turn, np.diag(turn)
    apart = y[:, None] - x
    pace_x, pace_y = (node_set.time_exponent * place ** (node_set.time_exponent - 1.0) for place in (x, y))  # dt/(h dσ)
    values = [(1.0 - 2.0 * own * apart) * basis**2, apart * basis**2 * pace_x]
    if node_set.time_exponent == 1.0:
        rates = [np.zeros_like(basis), basis]
    elif begin == 0.0:
        shares = _interpolation(node_set.nodes, y) * np.divide.outer(y, node_set.nodes) ** node_set.time_exponent
        rates = [np.zeros_like(basis), np.column_stack((shares, 1.0 - shares.sum(axis=1)))]
    else:
        rates = [
            (-2.0 * own * basis**2 + 2.0 * (1.0 - 2.0 * own * apart) * basis * slopes) / pace_y[:, None],
            (basis**2 + 2.0 * apart * basis * slopes) * pace_x / pace_y[:, None],
        ]
    return np.block([values, rates]).T[_NODES_FIRST]


def _tail(nodes: Any) -> Any:
    """(S, 8) last four Legendre coefficients of the polynomial through node values, then the first four."""
    return np.roll(np.linalg.inv(np.polynomial.legendre.legvander(2.0 * nodes - 1.0, S - 1)), 4, axis=0).T


def _differentiation(nodes: Any) -> Any:
    """Slopes at the nodes of the polynomial through values there (Trefethen, Spectral Methods in MATLAB, Chapter 6)."""
    apart, weights = nodes[:, None] - nodes + np.eye(len(nodes)), lagrange_weights(nodes)
    out = weights / (weights[:, None] * apart)
    np.fill_diagonal(out, 0.0)
    np.fill_diagonal(out, -out.sum(axis=1))
    return out


def _alias(node_set: _NodeSet) -> Any:
    """(P,) largest error between the nodes of the interpolant of e^{iωt}, at `PHASES`."""
    waves = np.exp(1j * np.outer(node_set.nodes**node_set.time_exponent, PHASES))
    exact = np.exp(1j * np.outer(_CHECKED**node_set.time_exponent, PHASES))
    found = np.einsum("ij,jk", _interpolation(node_set.nodes, _CHECKED), waves)  # BLAS would start its threads for it
    return np.minimum(np.abs(found - exact).max(axis=0), 2.0)


def lagrange_weights(nodes: Any) -> Any:
    """1/Π (σ_j - σ_i) of the Lagrange polynomials."""
    return 1.0 / (nodes[:, None] - nodes + np.eye(len(nodes))).prod(axis=1)


def _interpolation(nodes: Any, points: Any) -> Any:
    """(points, nodes) values at points of the polynomial through node values."""
    out = np.empty((len(points), len(nodes)))
    row, weights = np.empty(len(nodes)), lagrange_weights(nodes)
    for i, x in enumerate(points):
        lagrange(nodes, weights, float(x), row)
        out[i] = row
    return out


def _extensions(node_set: _NodeSet, smooth: _NodeSet) -> Any:
    """(5, S, S) extrapolation of a step's force to the nodes of a smooth next step, 2^{-(i-2)/2} times as long."""
    out = np.empty((5, S, S))
    for i in range(5):
        times = 1.0 + 2.0 ** (-0.5 * (i - 2)) * smooth.nodes
        sigma = times ** (1.0 / node_set.time_exponent)
        out[i] = _interpolation(node_set.nodes, sigma)
        if node_set.weight_exponent:
            out[i] *= np.outer(sigma**node_set.weight_exponent, node_set.nodes ** (-node_set.weight_exponent))
    return out.transpose(0, 2, 1)


LOCAL_SLOPES = np.array([*_differentiation(LOCAL).T, LOCAL])
"""(S + 1, S) slopes at `LOCAL` of the polynomial through values there, one row per value; then these points."""
