"""Tables as text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any


def aligned(head: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """A table with columns flush right, the first one left."""
    cells = [list(head), *([cell(value) for value in row] for row in rows)]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    lines = [[row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])] for row in cells]
    return "\n".join("  ".join(line).rstrip() for line in lines)


def cell(value: Any, nothing: str = "") -> str:
    """A value of a table."""
    return nothing if value is None else f"{value:.5g}" if isinstance(value, float) else str(value)
