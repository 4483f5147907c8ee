"""Matrices, labels and coordinates of a structure from files: Matrix Market, npz, tables of text."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
from scipy import io, sparse

from fembeam.support import require

MARKET = (".mtx", ".mm")


def read_matrix(path: str | Path) -> Any:
    """A matrix of a file: Matrix Market (.mtx), sparse or dense .npz (one array), or .npy.

    Raises
    ------
    ValueError : another kind of file, a damaged one; says what was expected. OSError : it cannot be opened.
    """
    target = Path(path)
    known = {**dict.fromkeys(MARKET, _market), ".npz": _npz, ".npy": lambda p: np.load(p, allow_pickle=False)}
    require(target.suffix in known, f"a matrix must be a file of {', '.join(known)}", target.name, "Structure.read",
            "export Matrix Market, or scipy.sparse.save_npz")  # fmt: skip
    with target.open("rb"):
        pass  # OSError in plain words
    try:
        return known[target.suffix](target)
    except Exception as error:
        raise ValueError(f"{target} is no matrix of kind {target.suffix}, or is damaged: {error}") from error


def _market(path: Path) -> Any:
    """Of a file in Matrix Market format, the symmetric kind with one triangle too."""
    return io.mmread(path)


def _npz(path: Path) -> Any:
    """Of scipy.sparse.save_npz, or of numpy.savez with one array."""
    with np.load(path, allow_pickle=False) as data:
        if "format" not in data:
            if len(data.files) != 1:
                raise ValueError(f"it must hold one array, it holds {', '.join(data.files)}")
            return data[data.files[0]]
    return sparse.load_npz(path)


def read_labels(path: str | Path) -> list[tuple[Any, str]]:
    """(node, component) of every dof: two columns of text, `20, x`, a line each; lines of # are comments."""
    rows = _rows(Path(path), 2, "node, component")
    return [(_node(node), component) for node, component in rows]


def read_nodes(path: str | Path) -> dict[Any, tuple[float, ...]]:
    """{node: (x, y, z)}: four columns of text, `20, 0.1, 0, 0.5`, a line each; lines of # are comments."""
    rows = _rows(Path(path), 4, "node, x, y, z")
    try:
        return {_node(node): tuple(map(float, at)) for node, *at in rows}
    except ValueError as error:
        raise ValueError(f"{path}: coordinates must be numbers: {error}") from None


def _rows(path: Path, columns: int, what: str) -> list[list[str]]:
    """Fields of a table of text; ValueError names the line that has others."""
    found = []
    with path.open(newline="", encoding="utf-8-sig") as file:
        for number, line in enumerate(file, start=1):
            if not line.strip() or line.lstrip().startswith("#"):
                continue
            fields = next(csv.reader([line.replace(";", ",")])) if "," in line or ";" in line else line.split()
            fields = [field.strip() for field in fields]
            if len(fields) != columns:
                raise ValueError(f"{path}:{number}: expected {columns} columns, {what}, got {line.strip()[:60]!r}")
            found.append(fields)
    return found


def _node(text: str) -> Any:
    """A node as a whole number, or its name."""
    return int(text) if text.lstrip("+-").isdecimal() else text
