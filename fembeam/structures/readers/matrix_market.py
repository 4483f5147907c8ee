"""Matrix Market: "%%MatrixMarket matrix coordinate real symmetric", comments, sizes, entries (numbered from 1).

Read here line by line: `scipy.io.mmread` (1.17) ends the whole process on a line that is cut.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

from fembeam.structures.readers.given import Given, assembled, table, wrong

HEAD = b"%%MatrixMarket"
ENTRIES = {"coordinate": "row, column, value", "array": "a value"}


def read_matrix_market(path: Path) -> Given:
    """The one matrix of a Matrix Market file; symmetric ones are completed. It has no labels."""
    lines = path.read_text(encoding="latin-1").splitlines()
    words = lines[0].lower().split()
    if len(words) != 5 or words[1] != "matrix" or words[2] not in ENTRIES:
        raise wrong(
            path, "line 1", '"%%MatrixMarket matrix coordinate real symmetric" or the like', repr(lines[0][:60])
        )
    layout, field, symmetry = words[2:]
    if field not in ("real", "double", "integer") or symmetry not in ("general", "symmetric"):
        raise wrong(path, "line 1", "a real matrix, general or symmetric", f"{field} {symmetry}")
    data = [(i, line) for i, line in enumerate(lines, 1) if line.strip() and not line.startswith("%")]
    sizes = _sizes(path, data, layout, symmetry, len(lines))
    values = table(path, data[1:], 3 if layout == "coordinate" else 1, ENTRIES[layout])
    count = sizes[2] if layout == "coordinate" else _kept(sizes[0], sizes[1], symmetry)
    if len(values) != count:
        raise wrong(path, f"line {data[-1][0]}", f"the last of {count} entries", f"the last of {len(values)}")
    if layout == "array":
        return Given(path, ((path.stem, _of_columns(values, sizes, symmetry)),))
    return Given(path, ((path.stem, _of_entries(path, values, sizes, symmetry, data)),))


def _sizes(path: Path, data: list[tuple[int, str]], layout: str, symmetry: str, last: int) -> list[int]:
    """Rows, columns and, of the layout coordinate, entries."""
    number, line = data[0] if data else (last, "the end")
    words = line.split()
    wanted = 3 if layout == "coordinate" else 2
    if len(words) != wanted or not all(word.isdecimal() for word in words) or "0" in words[:2]:
        raise wrong(path, f"line {number}", "rows, columns" + ", entries" * (wanted == 3), repr(line[:60]))
    if symmetry == "symmetric" and int(words[0]) != int(words[1]):
        raise wrong(path, f"line {number}", "as many rows as columns of a symmetric matrix", f"{words[0]} × {words[1]}")
    return [int(word) for word in words]


def _kept(rows: int, columns: int, symmetry: str) -> int:
    """How many values the layout array has: all, or the lower triangle."""
    return rows * columns if symmetry == "general" else columns * (columns + 1) // 2


def _of_entries(path: Path, values: Any, sizes: list[int], symmetry: str, data: list[tuple[int, str]]) -> Any:
    """The matrix of the layout coordinate."""
    inside = (values[:, :2] >= 1) & (values[:, :2] <= sizes[:2]) & (values[:, :2] % 1 == 0)
    if not inside.all():
        number, line = data[1 + int(np.argmin(inside.all(axis=1)))]
        expected = f"a row from 1 to {sizes[0]} and a column from 1 to {sizes[1]}"
        raise wrong(path, f"line {number}", expected, repr(line[:60]))
    rows, columns = (values[:, :2].astype(int) - 1).T
    if symmetry == "symmetric":
        return assembled(rows, columns, values[:, 2], sizes[0])
    return sparse.csr_matrix((values[:, 2], (rows, columns)), shape=sizes[:2])


def _of_columns(values: Any, sizes: list[int], symmetry: str) -> Any:
    """The matrix of the layout array, whose columns follow each other."""
    if symmetry == "general":
        return sparse.csr_matrix(values.reshape(sizes[1], sizes[0]).T)
    columns, rows = np.triu_indices(sizes[1])
    return assembled(rows, columns, values[:, 0], sizes[1])
