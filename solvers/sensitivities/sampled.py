"""Where panels end so that their nodes see all of a sampled load: short pulses, kinks, noise faster than the modes.

A load's node table declares all that it does. Its cells are joined to panels while the polynomial through a panel's
nodes agrees, between them too, with the quintics of the table and with their slopes.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np

from solvers.problem import Array, System, forcing_of, quintics
from solvers.sensitivities.panels import X, lagrange

_MOST = 64  # cells in a panel, a power of two
_OFF, _SLOPE_OFF = 1e-7, 1e-5  # of the largest value and slope of a load, by which a panel's polynomial may be off


class SampledLoads:
    """The node tables of a system's loads that are no tones."""

    def __init__(self, system: System, duration: float, rtol: float) -> None:
        forcing = forcing_of([signal for _, signal in system.loads], duration, rtol)
        rows = [forcing.table[a:b] for a, b in pairwise(forcing.table_start.tolist())]
        moves = [np.append(0, np.cumsum(_changing(one))) for one in rows]
        self.tables = list(zip(forcing.table_dt.tolist(), rows, moves, strict=True))

    def edges(self, start: float, end: float) -> Array:
        """Times between start and end at which panels must end."""
        found = [table[0] * _divided(*table, start, end) for table in self.tables]
        times = np.concatenate([np.zeros(0), *found])
        return times[(times > start) & (times < end)]


def _changing(rows: Array) -> Array:
    """Whether a load changes within each cell of its table."""
    begin, end = rows[:-1, :3], rows[1:, -3:]
    return np.any(begin != end, axis=1) | np.any(begin[:, 1:] != 0.0, axis=1)


def _divided(dt: float, rows: Array, moves: Array, start: float, end: float) -> Array:
    """Numbers of the nodes of a table that divide it between two times; none where it does not change.

    ``moves`` counts the cells before each node in which it changes.
    """
    last = min(math.ceil(end / dt), len(rows) - 1)
    begins: Any = np.arange(int(start / dt), last, _MOST)
    sizes, width, whole = np.abs(rows).max(axis=0)[:2] * (_OFF, _SLOPE_OFF), _MOST, [begins[:0]]
    while width > 1 and begins.size:
        fits = _resolved(dt, rows, begins, width, sizes)
        whole += [begins[fits], np.minimum(begins[fits] + width, last)]
        width //= 2
        begins = (begins[~fits, None] + (0, width)).ravel()
        begins = begins[begins < last]
    nodes = np.unique(np.concatenate([*whole, begins, begins + 1]))
    idle = np.diff(moves[nodes]) == 0
    return nodes[1:-1][~(idle[:-1] & idle[1:])] if len(nodes) > 2 else nodes[:0]


def _resolved(dt: float, rows: Array, begins: Any, width: int, sizes: Array) -> Any:
    """Whether panels of so many cells hold a load and its slope to these sizes, at the cells' ends and middles."""
    between = np.arange(2 * width + 1) / (2.0 * width)
    to_them = lagrange(between).T
    at_nodes, there = (_of_table(dt, rows, begins, width * places) for places in (X, between))
    pairs = zip(at_nodes, there, sizes, strict=True)
    off = [np.abs(known @ to_them - exact).max(axis=1) <= most for known, exact, most in pairs]
    return off[0] & off[1]


def _of_table(dt: float, rows: Array, begins: Any, places: Array) -> tuple[Array, Array]:
    """Values and slopes (k, j) of a table at places counted in cells from each beginning; it ends as it last was."""
    u = begins[:, None] + places
    cell = np.minimum(u.astype(int), len(rows) - 2)
    return quintics(dt, rows, cell, np.minimum(u - cell, 1.0))
