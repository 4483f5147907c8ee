"""Node tables of several signals on one grid, which the exponential method crosses cell by cell.

The third to fifth derivatives of a table jump at its nodes, of a record joined by straight lines slope and curvature
too. They hardly do where the signal is smooth on its grid, and much where it has kinks or a user's table is coarse. A
quintic of another grid that goes across a node cannot jump there. So the grid divides that of the roughest table, and
those of the others if it can: then nothing changes. Others are carried over such that their moments ∫ s tᵏ dt, k = 0
... 5, stay around each of their nodes. Of the response to a jump of the third derivative, at the frequency ω, a part of
(ω dt)^10/10⁸ is then wrong, and within a cell of the node more. Two coarse tables without a common part are therefore
cut finely: to ω dt <= 0.3 of the fastest block, unless that takes more than 500 000 cells.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from solvers.problem.matrices import Array
from solvers.problem.signals import Forcing, joined

_ROUGH = 1e-2  # jump of derivative p = 1, 2, 3 in units of max|s|/dtᵖ; of a smooth signal at most 1e-3 (rtol <= 1e-6)
_KINKS_FIRST = 1e6  # weight of jumps of slope and curvature: the grid divides the table that has them
_CELLS_A_STEP = 160  # of a rough table whose nodes are not on the grid
_FEWEST_CELLS = 4096  # where two tables are rough and no grid has the nodes of both
_RESOLVED, _MOST_CELLS = 0.3, 500_000  # ω dt of the fastest block there, unless that takes more cells than these
_DEGREE = 11  # of a jump's changes as polynomials of its place in a cell
_BLOCK = 2**13  # nodes at once


def on_one_grid(forcing: Forcing, duration: float, fastest: float) -> Forcing:
    """The same forcing with all node tables on one grid, for a structure whose ``fastest`` rate is in rad/s."""
    if not forcing.table_dt.size or np.ptp(forcing.table_dt) == 0.0:
        return forcing
    given, steps = np.split(forcing.table, forcing.table_start[1:-1]), forcing.table_dt.tolist()
    dt = _common_step(given, steps, duration, fastest)
    cells = math.ceil(duration / dt * (1.0 - 1e-12))
    tables = [
        rows[: cells + 1] if own == dt else (_cut if _divides(dt, own) else _carried_over)(rows, own, dt, cells)
        for rows, own in zip(given, steps, strict=True)
    ]
    return replace(
        forcing,
        table=joined(tables),
        table_dt=np.full(len(tables), dt),
        table_start=(cells + 1) * np.arange(len(tables) + 1, dtype=np.int64),
    )


def _common_step(tables: list[Array], steps: list[float], duration: float, fastest: float) -> float:
    """The finest step, or not above it a part of the step of the roughest table; shorter where others are rough too.

    It divides the steps of all rough tables if a part that is not too small does.
    """
    rough = [_roughness(rows, own) for rows, own in zip(tables, steps, strict=True)]
    worst, most = int(np.argmax(rough)), min(steps)
    if rough[worst] <= _ROUGH:
        return most
    dt = _part_of(steps[worst], most)
    others = [steps[i] for i in np.flatnonzero(np.array(rough) > _ROUGH)]
    fewest = round(steps[worst] / dt)
    for parts in range(fewest, max(fewest, _CELLS_A_STEP) + 1):
        if all(_divides(steps[worst] / parts, step) for step in others):
            return steps[worst] / parts
    resolved = max(_RESOLVED / max(fastest, 1e-300), duration / _MOST_CELLS)
    return _part_of(steps[worst], min(most, duration / _FEWEST_CELLS, resolved, min(others) / _CELLS_A_STEP))


def _roughness(rows: Array, dt: float) -> float:
    """Largest jump of the first three derivatives of a node table, in units of max|s|/dtᵖ; kinks come first."""
    blocks = [np.abs(_jumps(rows[some[0] : some[-1] + 3], dt, 3)).max(axis=1) for some in _blocks(len(rows) - 2)]
    jumps = np.max(blocks, axis=0, initial=0.0) * dt ** np.arange(1.0, 4.0)
    return float((jumps * (_KINKS_FIRST, _KINKS_FIRST, 1.0)).max()) / max(float(np.abs(rows[:, 0]).max()), 1e-300)


def _blocks(size: int) -> list[Any]:
    """Numbers below ``size`` in blocks that fit into a processor's cache."""
    return [np.arange(start, min(start + _BLOCK, size)) for start in range(0, size, _BLOCK)]


def _part_of(step: float, most: float) -> float:
    """The longest whole part of a step that is not above ``most``."""
    return step / math.ceil(step / most * (1.0 - 1e-12))


def _divides(dt: float, step: float) -> bool:
    """Whether a step is a whole multiple of dt."""
    return abs(step / dt - round(step / dt)) <= 1e-9


def _cut(rows: Array, own: float, dt: float, cells: int) -> Array:
    """A node table whose cells are cut into equal parts."""
    parts, out = round(own / dt), np.empty((cells + 1, rows.shape[1]))
    for node in _blocks(cells + 1):
        piece = np.minimum(node // parts, len(rows) - 2)
        out[node] = np.tile(_within(rows, own, piece, (node - piece * parts) * dt), rows.shape[1] // 3)
    kept = np.arange(0, cells + 1, parts)[: len(rows)]
    out[kept] = rows[: kept.size]
    return out


def _carried_over(rows: Array, own: float, dt: float, cells: int) -> Array:
    """A node table on a grid not coarser than its own."""
    out, place = np.empty((cells + 1, 3)), np.arange(1.0, len(rows) - 1) * own / dt
    for node in _blocks(cells + 1):
        # A node of the table on one of the grid ends the cell before it, x = 1, and what follows it begins there.
        piece = np.searchsorted(place, node, side="right")
        out[node] = _within(rows, own, piece, node * dt - piece * own)
    place = place[place < cells]
    for some in _blocks(len(place)):
        jumps = _jumps(rows[some[0] : some[-1] + 3], own)
        jumping = jumps.any(axis=0)  # before and after a pulse nothing does
        at = place[some[jumping]]
        cell = np.ceil(at).astype(np.int64) - 1
        changes = _moments_kept(at - cell, jumps[:, jumping] * dt ** np.arange(1.0, 6.0)[:, None])
        for end in range(2):
            np.add.at(out, cell + end, changes[:, end] / dt ** np.arange(3.0))
    return out


def _within(rows: Array, dt: float, piece: Any, span: Array) -> Array:
    """(k, 3) s, s', s'' of a node table, times ``span`` after the starts of its cells ``piece``, which rise."""
    first = piece[0]
    pieces = _derivatives(rows[first : piece[-1] + 2], dt)
    return _moved(pieces[:, piece - first], span, range(3)).T


def _derivatives(rows: Array, dt: float) -> Array:
    """(6, cells) s, s', ..., s⁽⁵⁾ at the start of every cell of a node table."""
    a, b = (part.T * np.array([[1.0], [dt], [0.5 * dt**2]]) for part in (rows[:-1, :3], rows[1:, -3:]))
    e0, e1, e2 = b[0] - a.sum(axis=0), b[1] - a[1] - 2.0 * a[2], b[2] - a[2]
    rest = 10.0 * e0 - 4.0 * e1 + e2, -15.0 * e0 + 7.0 * e1 - 2.0 * e2, 6.0 * e0 - 3.0 * e1 + e2
    derivatives = np.concatenate((a, rest))
    derivatives *= np.array([[math.factorial(k) / dt**k] for k in range(6)])
    return derivatives


def _moved(derivatives: Array, span: Any, orders: range) -> Array:
    """Some of the derivatives (6, k) of quintics after a time each, or after one for all."""
    out = derivatives[orders.start : orders.stop].copy()
    for order, row in zip(orders, out, strict=True):
        rest: Any = 0.0
        for i in range(5 - order, 0, -1):
            rest = (derivatives[order + i] + rest) * (span / i)
        row += rest
    return out


def _jumps(rows: Array, dt: float, most: int = 5) -> Array:
    """(5, nodes within) jumps of the first to fifth derivative of a node table; of fewer if ``most`` are wanted."""
    pieces = _derivatives(rows, dt)
    return pieces[1 : most + 1, 1:] - _moved(pieces[:, :-1], dt, range(1, most + 1))


def _moments_kept(x: Array, jumps: Array) -> Array:
    """(n, 2, 3) changes of [s, s', s''] at 0 and 1 where s = Σ jump_p (u - x)ᵖ/p! from u = x on, p = 1 ... 5.

    The quintic through the rows at 0 and 1 takes the place of s in between. By the changes, which act from -1 to 2, it
    has the first six moments of s about the middle.
    """
    powers = np.polynomial.chebyshev.chebvander(2.0 * x - 1.0, _DEGREE)
    changes: Array = np.einsum("pn,npc->nc", jumps, (powers @ _unit_changes()).reshape(len(x), 5, 6))
    return changes.reshape(-1, 2, 3)


@cache
def _unit_changes() -> Array:
    """(12, 30) the changes by a jump of 1 of each derivative in turn as Chebyshev series of 2x - 1."""
    x = 0.5 + 0.5 * np.polynomial.chebyshev.chebpts1(_DEGREE + 1)
    by_jump = np.concatenate([_changes(x, np.tile(unit, (len(x), 1))) for unit in np.eye(5)], axis=1)
    return np.linalg.solve(np.polynomial.chebyshev.chebvander(2.0 * x - 1.0, _DEGREE), by_jump)


def _changes(x: Array, jumps: Array) -> Array:
    """(n, 6) the changes that `_moments_kept` looks up, for jumps (n, 5)."""
    points, weights = np.polynomial.legendre.leggauss(6)  # exact up to the power 11
    u, weights, powers = 0.5 * (1.0 + points), 0.5 * weights, np.arange(6)
    rising, falling = _quintics(u), _quintics(1.0 - u) * np.array([[1.0], [-1.0], [1.0]])
    before, within, behind = ((weights * (u - middle) ** powers[:, None]).T for middle in (1.5, 0.5, -0.5))
    basis = np.concatenate((rising @ before + falling @ within, rising @ within + falling @ behind))
    rest = 1.0 - x[:, None]
    later, about = rest * u, ((x[:, None] + rest * u - 0.5)[..., None]) ** powers  # than x; the middle
    values = sum(jump[:, None] * _power(later, p) for p, jump in enumerate(jumps.T, 1))
    wanted = np.einsum("nu,nuk->nk", values * rest * weights, about)
    ends = [sum(jumps[:, [p - 1]] * _power(rest, p - k) for p in range(max(k, 1), 6)) for k in range(3)]
    return np.linalg.solve(basis.T, (wanted - np.hstack(ends) @ rising @ within).T).T


def _power(x: Array, p: int) -> Array:
    """xᵖ/p!."""
    return x**p / math.factorial(p)


def _quintics(u: Array) -> Array:
    """(3, len(u)) the quintics whose value, slope or curvature is 1 at u = 1, all else being 0 there and at u = 0."""
    return u**3 * np.stack((10.0 - 15.0 * u + 6.0 * u**2, -4.0 + 7.0 * u - 3.0 * u**2, 0.5 - u + 0.5 * u**2))
