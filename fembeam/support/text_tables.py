"""Tables as text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np


def aligned(head: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """A table with columns flush right, the first one left."""
    cells = [list(head), *([cell(value) for value in row] for row in rows)]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    lines = [[row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])] for row in cells]
    return "\n".join("  ".join(line).rstrip() for line in lines)


def by_rows(columns: Mapping[str, Any]) -> list[dict[str, Any]]:
    """A table as columns by name, row by row as plain values.

    Examples
    --------
    >>> by_rows({"n": [1, 2], "x": np.array([0.5, 2.0])})
    [{'n': 1, 'x': 0.5}, {'n': 2, 'x': 2.0}]
    """
    rows = zip(*(np.asarray(column).tolist() for column in columns.values()), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in rows]


def cell(value: Any, nothing: str = "") -> str:
    """A value of a table."""
    return nothing if value is None else f"{value:.5g}" if isinstance(value, float) else str(value)
