"""What a file gave: its matrices by name, and the dofs of their rows."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

Label = tuple[Hashable, str]
COMPONENT = {i + 1: name for i, name in enumerate(("x", "y", "z", "rx", "ry", "rz"))}  # by the number of the dof
SCALAR = "mode"  # component of a dof that belongs to no direction: a generalised coordinate


@dataclass(frozen=True, eq=False)
class Given:
    """Matrices of one file, as plain data.

    Attributes
    ----------
    path : the file.
    matrices : (name, sparse CSR) of each, in the order of the file; names may repeat.
    labels : (node, component) of the rows of the square ones, or None where the format has no names.
    held : labels, or numbers of rows where there are none, of the dofs that the file marks as held; they are left out.
    """

    path: Path
    matrices: tuple[tuple[str, sparse.csr_matrix], ...]
    labels: tuple[Label, ...] | None = None
    held: tuple[Any, ...] = ()

    def __repr__(self) -> str:
        listed = ", ".join(f"{name} {one.shape[0]} × {one.shape[1]}" for name, one in self.matrices)
        return f"<{self.path.name}: {listed}>"

    def matrix(self, name: str | None = None) -> sparse.csr_matrix:
        """The matrix of a name, or the only one; ValueError that lists what there is."""
        found = [one for known, one in self.matrices if name is None or known.upper() == name.upper()]
        if len(found) == 1:
            return found[0]
        asked = "one matrix" if name is None else f"a matrix {name!r} that is there once"
        listed = ", ".join(known for known, _ in self.matrices) or "none"
        raise ValueError(f"{self.path}: expected {asked}, found {listed}; give (path, name) with one of these names")


def wrong(path: Path, where: str, expected: str, got: Any) -> ValueError:
    """The error of a file that is not what it should be."""
    return ValueError(f"{path}, {where}: expected {expected}, got {got}")


def component(path: Path, where: str, number: int, node: Any) -> str:
    """The component of a numbered dof; ValueError for what is no displacement and no rotation."""
    if number not in COMPONENT:
        raise wrong(path, where, "a dof from 1 to 6 (x y z rx ry rz)", f"dof {number} of node {node}")
    return COMPONENT[number]


def table(path: Path, lines: Sequence[tuple[int, str]], width: int, expected: str) -> Any:
    """Numbers (k, width) of lines, given with their numbers in the file; ValueError for the first that has others."""
    words = [line.replace(",", " ").upper().replace("D", "E").split() for _, line in lines]
    try:
        if all(len(one) == width for one in words):
            return np.array(words, dtype=float).reshape(-1, width)
    except ValueError:
        pass
    number, line = next(given for given, one in zip(lines, words, strict=True) if not _are_numbers(one, width))
    raise wrong(path, f"line {number}", expected, repr(line[:60]))


def _are_numbers(words: list[str], count: int) -> bool:
    """Whether words are that many numbers."""
    try:
        return len(words) == count and all(float(word) is not None for word in words)
    except ValueError:
        return False


def assembled(rows: Any, columns: Any, values: Any, size: int, symmetric: bool = True) -> sparse.csr_matrix:
    """A square matrix from entries; where each pair of dofs stands once, in either triangle, it is mirrored.

    Which triangle an entry is in depends on the order of the dofs, and a file may have another one than ours.
    """
    rows, columns, values = np.asarray(rows, dtype=int), np.asarray(columns, dtype=int), np.asarray(values, dtype=float)
    one = sparse.csr_matrix((values, (rows, columns)), shape=(size, size))
    off = rows != columns
    apart = sparse.csr_matrix((np.ones(np.count_nonzero(off)), (rows[off], columns[off])), shape=(size, size))
    twice = apart.multiply(apart.T).nnz > 0
    return one if not symmetric or twice else (one + one.T - sparse.diags(one.diagonal())).tocsr()


def numbered(found: Sequence[Label] | set[Label]) -> dict[Label, int]:
    """Labels in the order of their nodes, then of their components."""
    order = {name: i for i, name in enumerate([SCALAR, *COMPONENT.values()])}
    return {label: i for i, label in enumerate(sorted(found, key=lambda one: (one[0], order[one[1]])))}
