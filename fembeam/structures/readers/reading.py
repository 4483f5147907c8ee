"""One entry for all formats, chosen by suffix and content; stiffness and mass brought to one order of dofs."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from scipy import sparse

from fembeam.structures.checks import labelled
from fembeam.structures.readers.abaqus import read_abaqus
from fembeam.structures.readers.calculix import read_calculix, read_dof
from fembeam.structures.readers.dmig import read_dmig
from fembeam.structures.readers.given import COMPONENT, Given, Label, wrong
from fembeam.structures.readers.harwell_boeing import read_harwell_boeing, read_mapping
from fembeam.structures.readers.matrix_market import HEAD, read_matrix_market
from fembeam.structures.readers.node_files import read_nodes
from fembeam.structures.readers.npz import label_of, read_npy, read_npz
from fembeam.structures.readers.op4 import HEADS, read_op4
from fembeam.support import file_path

Source: TypeAlias = str | os.PathLike[str] | tuple[str | os.PathLike[str], str]
SUFFIXES: dict[str, Callable[[Path], Given]] = {
    **{".npz": read_npz, ".npy": read_npy, ".op4": read_op4, ".mm": read_matrix_market, ".mtx": read_abaqus},
    **{".pch": read_dmig, ".dmig": read_dmig, ".sti": read_calculix, ".mas": read_calculix},
    **{suffix: read_harwell_boeing for suffix in (".matrix", ".hb", ".rsa", ".rua", ".hbmat")},
}


def read_matrices(path: str | os.PathLike[str]) -> Given:
    """Read the matrices of a file of another program.

    Parameters
    ----------
    path : .npz, .npy, .mtx of Matrix Market or Abaqus, .op4, .pch (DMIG), .sti or .mas with the .dof beside it, .matrix
        (Harwell–Boeing) with its .mapping; a file of another suffix is judged by how it begins.

    Returns
    -------
    Given : matrices (name, sparse CSR) and labels (node, component), as plain data, in the units of the file.

    Raises
    ------
    ValueError : a file that is truncated or foreign: what was expected at which line or byte. FileNotFoundError.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     np.savez(Path(folder, "two.npz"), K=[[2.0, -1.0], [-1.0, 1.0]], labels=[(7, "x"), (8, "x")])
    ...     given = read_matrices(Path(folder, "two.npz"))
    >>> given.labels, given.matrix("K").toarray().tolist()
    (((7, 'x'), (8, 'x')), [[2.0, -1.0], [-1.0, 1.0]])
    """
    path = file_path(path, "read_matrices")
    with path.open("rb") as file:
        head = file.read(4096)
    if not head.strip():
        raise wrong(path, "byte 0", "a matrix", "an empty file")
    return _reader(path, head)(path)


def _reader(path: Path, head: bytes) -> Callable[[Path], Given]:
    """The reader of a file, by what cannot be mistaken, then by its suffix, then by how it begins."""
    if head.startswith(HEAD):
        return read_matrix_market
    if path.suffix.lower() in SUFFIXES:
        return SUFFIXES[path.suffix.lower()]
    lines = head.decode("latin-1").splitlines()
    if head.startswith(b"PK"):
        return read_npz
    if any(int.from_bytes(head[:4], order) in HEADS for order in ("little", "big")):  # type: ignore[arg-type]
        return read_op4
    if any(line.upper().startswith("DMIG") for line in lines):
        return read_dmig
    if len(lines) > 3 and lines[2][:3].upper() in ("RSA", "RUA"):
        return read_harwell_boeing
    got = f"{path.suffix!r}; rows of numbers as text are read by numpy.loadtxt, for Structure(K, M, labels=…)"
    raise wrong(path, "its suffix", f"one of {', '.join(sorted(SUFFIXES))}", got)


def structure_arguments(
    stiffness: Source,
    mass: Source,
    damping: Source | None = None,
    labels: str | os.PathLike[str] | Iterable[Any] | None = None,
    nodes: str | os.PathLike[str] | Mapping[Any, Any] | None = None,
) -> dict[str, Any]:
    """K, M, C, labels and nodes from files, on one order of dofs: what `Structure` takes.

    Dofs that the stiffness marks as held are left out of all; those of it that the mass does not name have none. A mass
    or damping with dofs of its own goes by them, also where the stiffness has its names from `labels`.
    """
    K = _chosen(stiffness, "K")
    places = read_nodes(Path(nodes)) if isinstance(nodes, (str, os.PathLike)) else nodes
    names = _labels(labels, K, places)
    K = _named(K, names)
    M = _chosen(mass, "M")
    if _which(M) == _which(K):
        raise wrong(K[0].path, "as a whole", "a stiffness and a mass", f"{K[0].matrices[_which(K)[1]][0]} for both")
    found = {"K": K[1], "M": _like(K, M)}
    found |= {} if damping is None else {"C": _like(K, _chosen(damping, "C", "B", "D"))}
    known = None if places is None or names is None else {node for node, _ in names}
    kept = places if known is None else {node: at for node, at in (places or {}).items() if node in known}
    return {**found, "labels": names, "nodes": kept}


def _chosen(source: Source, *letters: str) -> tuple[Given, sparse.csr_matrix]:
    """A file and its matrix: the one named, the only one, or the only square one whose name begins so."""
    path, name = source if isinstance(source, tuple) else (source, None)
    given = read_matrices(path)
    square = [known for known, one in given.matrices if one.shape[0] == one.shape[1]]
    if name is None and len(given.matrices) > 1:
        begun = [known for known in square if known[:1].upper() in letters]
        name = begun[0] if len(begun) == 1 else None
    matrix = given.matrix(name)
    if matrix.shape[0] != matrix.shape[1]:
        raise wrong(given.path, "its matrix", "a square one", f"{matrix.shape[0]} × {matrix.shape[1]}")
    return given, matrix


def _which(chosen: tuple[Given, sparse.csr_matrix]) -> tuple[Path, int]:
    """The file and the number of a matrix in it."""
    given, matrix = chosen
    return given.path.resolve(), next(i for i, (_, one) in enumerate(given.matrices) if one is matrix)


def _like(first: tuple[Given, sparse.csr_matrix], second: tuple[Given, sparse.csr_matrix]) -> sparse.csr_matrix:
    """A matrix on the dofs of another one, in its order."""
    (wanted, K), (given, matrix) = first, second
    if wanted.labels is not None and given.labels is not None:
        place = {label: i for i, label in enumerate(wanted.labels)}
        foreign = [label for label in given.labels if label not in place and label not in wanted.held]
        if foreign:
            raise wrong(given.path, "its dofs", f"those of {wanted.path.name}", f"{foreign[0]!r} beside them")
        kept = [i for i, label in enumerate(given.labels) if label in place]
        at = [place[given.labels[i]] for i in kept]
        onto = sparse.csr_matrix((np.ones(len(at)), (at, range(len(at)))), shape=(K.shape[0], len(at)))
        return (onto @ matrix[kept][:, kept] @ onto.T).tocsr()
    rows = [i for i in wanted.held if isinstance(i, int)]
    if rows and matrix.shape[0] == K.shape[0] + len(rows):
        free = np.setdiff1d(np.arange(matrix.shape[0]), rows)
        matrix = matrix[free][:, free]
    if matrix.shape != K.shape:
        expected = f"the size of {wanted.path.name}, {K.shape[0]} dofs"
        raise wrong(given.path, "its matrix", expected, f"{matrix.shape[0]}")
    return matrix


def _labels(given: Any, K: tuple[Given, sparse.csr_matrix], places: Mapping[Any, Any] | None) -> Any:
    """Labels as given, from a file of them, from the matrices, or six of each node in ascending order."""
    if isinstance(given, (str, os.PathLike)):
        return _of_file(Path(given))
    if given is not None:
        return labelled(given, K[1].shape[0], "Structure.read")
    size = K[1].shape[0]
    if K[0].labels is not None or places is None:
        return K[0].labels
    if size != 6 * len(places):
        raise ValueError(
            f"{K[0].path}: expected labels, as the format has no names and its {size} dofs are not six of each of the "
            f"{len(places)} nodes; give labels=[(node, 'x'), …] in the order of the rows"
        )
    return [(node, name) for node in sorted(places) for name in COMPONENT.values()]


def _named(K: tuple[Given, sparse.csr_matrix], names: Any) -> tuple[Given, sparse.csr_matrix]:
    """The stiffness with the names of its rows, by which the others are put in order."""
    given, matrix = K
    if names is None or given.held:
        return K
    if given.labels is None:
        return replace(given, labels=tuple(names)), matrix
    other = next((pair for pair in zip(given.labels, names, strict=False) if pair[0] != pair[1]), None)
    if other and set(given.labels) == set(names):
        expected = f"the order of labels, {other[1]!r}"
        raise wrong(given.path, "its dofs", expected, f"{other[0]!r} there; leave labels out")
    return K


def _of_file(path: Path) -> tuple[Label, ...]:
    """Labels of a .dof or .mapping, or of lines "node component"."""
    if path.suffix.lower() == ".dof":
        return read_dof(path)
    if path.suffix.lower() == ".mapping":
        return read_mapping(path)
    found = []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        words = line.replace(",", " ").replace(";", " ").split()
        if words and words[0][0] != "#":
            if len(words) != 2:
                raise wrong(path, f"line {number}", "a node and a component", repr(line[:60]))
            found.append(label_of(path, f"line {number}", *words))
    return tuple(found)
