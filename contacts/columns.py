"""Columns of a text file, found by the names in its first line."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


def read_columns(path: str | Path, names: Sequence[str], optional: Sequence[str] = ()) -> dict[str, Vector]:
    """Columns of a text file by the names in its first line, separated by comma, semicolon, tab or blanks.

    Empty lines and lines that begin with # are skipped; other columns are ignored. Raises ValueError for a missing
    column (with those there) and for an entry that is no number (with its line).
    """
    lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
    rows = [(n, _cells(line)) for n, line in enumerate(lines, 1) if line.strip() and not line.lstrip().startswith("#")]
    header = [cell.lower() for cell in rows[0][1]] if rows else []
    missing = [name for name in names if name not in header]
    if missing:
        raise ValueError(f"{path}: no column {missing[0]!r}; its first line names {', '.join(header) or 'nothing'}")
    wanted = [name for name in (*names, *optional) if name in header]
    places = [header.index(name) for name in wanted]
    values = [[_value(path, n, cells, place) for place in places] for n, cells in rows[1:]]
    table = np.array(values, dtype=float).reshape(len(values), len(wanted))
    return dict(zip(wanted, table.T.copy(), strict=True))


def _cells(line: str) -> list[str]:
    """Cells of a line."""
    parts = re.split(r"[,;\t]", line) if re.search(r"[,;\t]", line) else line.split()
    return [part.strip().strip('"') for part in parts]


def _value(path: str | Path, line: int, cells: list[str], place: int) -> float:
    """One number of the table."""
    try:
        return float(cells[place])
    except (IndexError, ValueError):
        got = repr(cells[place]) if place < len(cells) else "nothing"
        raise ValueError(f"{path}, line {line}: column {place + 1} must be a number, got {got}") from None
