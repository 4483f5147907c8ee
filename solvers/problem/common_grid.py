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
from typing import Any

import numpy as np

from solvers.problem.matrices import Array
from solvers.problem.signals import Forcing, joined

_ROUGH = 1e-2  # jump of derivative p = 1, 2, 3 in units of max|s|/dtᵖ; of a smooth signal at most 1e-3 (rtol <= 1e-6)
_KINKS_FIRST = 1e6  # weight of jumps of slope and curvature: the grid divides the table that has them
_CELLS_A_STEP = 160  # of a rough table whose nodes are not on the grid
_FEWEST_CELLS = 4096  # where two tables are rough and no grid has the nodes of both
_RESOLVED, _MOST_CELLS = 0.3, 500_000  # ω dt of the fastest block there, unless that takes more cells than these


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
    jumps = np.abs(_jumps(rows, dt)[:, :3]).max(axis=0, initial=0.0) * dt ** np.arange(1.0, 4.0)
    return float((jumps * (_KINKS_FIRST, _KINKS_FIRST, 1.0)).max()) / max(float(np.abs(rows[:, 0]).max()), 1e-300)


def _part_of(step: float, most: float) -> float:
    """The longest whole part of a step that is not above ``most``."""
    return step / math.ceil(step / most * (1.0 - 1e-12))


def _divides(dt: float, step: float) -> bool:
    """Whether a step is a whole multiple of dt."""
    return abs(step / dt - round(step / dt)) <= 1e-9


def _cut(rows: Array, own: float, dt: float, cells: int) -> Array:
    """A node table whose cells are cut into equal parts."""
    pieces, parts = _derivatives(rows, own), round(own / dt)
    node = np.arange(cells + 1)
    piece = np.minimum(node // parts, len(pieces) - 1)
    after: Any = (node - piece * parts) * dt
    out = np.tile(_moved(pieces[piece], after)[:, :3], rows.shape[1] // 3)
    kept = node[::parts][: len(rows)]
    out[kept] = rows[: kept.size]
    return out


def _carried_over(rows: Array, own: float, dt: float, cells: int) -> Array:
    """A node table on a grid not coarser than its own."""
    pieces, node = _derivatives(rows, own), np.arange(cells + 1)
    place = np.arange(1.0, len(pieces)) * own / dt
    # A node of the table on one of the grid ends the cell before it, x = 1, and what follows it begins there.
    piece = np.searchsorted(place, node, side="right")
    out = _moved(pieces[piece], node * dt - piece * own)[:, :3]
    place = place[place < cells]
    cell = np.ceil(place).astype(np.int64) - 1
    changes = _moments_kept(place - cell, _jumps(rows, own)[: len(place)] * dt ** np.arange(1.0, 6.0))
    for end in range(2):
        np.add.at(out, cell + end, changes[:, end] / dt ** np.arange(3.0))
    return out


def _derivatives(rows: Array, dt: float) -> Array:
    """(cells, 6) s, s', ..., s⁽⁵⁾ at the start of every cell of a node table."""
    a, b = (part * (1.0, dt, 0.5 * dt**2) for part in (rows[:-1, :3], rows[1:, -3:]))
    e0, e1, e2 = b[:, 0] - a.sum(axis=1), b[:, 1] - a[:, 1] - 2.0 * a[:, 2], b[:, 2] - a[:, 2]
    rest = 10.0 * e0 - 4.0 * e1 + e2, -15.0 * e0 + 7.0 * e1 - 2.0 * e2, 6.0 * e0 - 3.0 * e1 + e2
    derivatives: Array = np.column_stack((a, *rest)) * [math.factorial(k) / dt**k for k in range(6)]
    return derivatives


def _moved(derivatives: Array, span: Array) -> Array:
    """The derivatives of quintics after a time each."""
    out, weight = derivatives.copy(), np.ones((len(derivatives), 1))
    for i in range(1, 6):
        weight = weight * span[:, None] / i
        out[:, :-i] += weight * derivatives[:, i:]
    return out


def _jumps(rows: Array, dt: float) -> Array:
    """(nodes within, 5) jumps of the first to fifth derivative of a node table."""
    pieces = _derivatives(rows, dt)
    return (pieces[1:] - _moved(pieces[:-1], np.full(len(pieces) - 1, dt)))[:, 1:]


def _moments_kept(x: Array, jumps: Array) -> Array:
    """(n, 2, 3) changes of [s, s', s''] at 0 and 1 where s = Σ jump_p (u - x)ᵖ/p! from u = x on, p = 1 ... 5.

    The quintic through the rows at 0 and 1 takes the place of s in between. By the changes, which act from -1 to 2, it
    has the first six moments of s about the middle.
    """
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
    changes: Array = np.linalg.solve(basis.T, (wanted - np.hstack(ends) @ rising @ within).T).T
    return changes.reshape(-1, 2, 3)


def _power(x: Array, p: int) -> Array:
    """xᵖ/p!."""
    return x**p / math.factorial(p)


def _quintics(u: Array) -> Array:
    """(3, len(u)) the quintics whose value, slope or curvature is 1 at u = 1, all else being 0 there and at u = 0."""
    return u**3 * np.stack((10.0 - 15.0 * u + 6.0 * u**2, -4.0 + 7.0 * u - 3.0 * u**2, 0.5 - u + 0.5 * u**2))
