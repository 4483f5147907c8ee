"""NumPy's .npz: one sparse matrix of `scipy.sparse.save_npz`, or several arrays by name.

np.savez("valve.npz", K=K, M=M, labels=labels)                          dense (N, N), labels (N, 2)
np.savez("valve.npz", K_data=K.data, K_row=K.row, K_col=K.col, ...)     entries of K.tocoo(), N × N
"""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

from fembeam.structures.readers.given import COMPONENT, SCALAR, Given, Label, wrong

PARTS = ("data", "row", "col")
# what NumPy and zipfile say of damaged files
BROKEN = (ValueError, TypeError, KeyError, IndexError, OSError, EOFError, NotImplementedError, SyntaxError, MemoryError,
          zipfile.BadZipFile, zlib.error)  # fmt: skip


def read_npz(path: Path) -> Given:
    """The matrices of a .npz; nothing in it is executed: arrays of objects are refused."""
    arrays = _arrays(path)
    if {"format", "shape", "data"} <= set(arrays):
        try:
            whole = sparse.csr_matrix(sparse.load_npz(path))
        except BROKEN as error:
            raise _broken(path, error) from None
        whole.data = _real(path, "array data", whole.data)
        return Given(path, ((path.stem, whole.astype(float)),))
    labels = _labels(path, arrays.pop("labels")) if "labels" in arrays else None
    size = 0 if labels is None else len(labels)
    found: dict[str, Any] = {}
    for name, array in arrays.items():
        stem = name.rpartition("_")[0]
        if name.endswith("_data") and all(f"{stem}_{part}" in arrays for part in PARTS):
            found[stem] = _sparse(path, stem, size, [arrays[f"{stem}_{part}"] for part in PARTS])
        elif array.ndim == 2 and array.shape[0] == array.shape[1] and array.dtype.kind in "fiuc":
            found[name] = sparse.csr_matrix(_real(path, f"array {name}", array), dtype=float)
    if not found:
        raise wrong(
            path, "as a whole", "square arrays, or K_data with K_row and K_col", f"{', '.join(arrays) or 'none'}"
        )
    return Given(path, tuple(found.items()), labels)


def read_modes(path: Path) -> dict[str, Any]:
    """Modes of a .npz, as `Structure.of_modes` takes them.

    Arrays omega (n,) in rad/s and shapes (d, n) in 1/√kg; if there are any, labels (d, 2) and participation_x, _y, _z
    (n,) in √kg.
    """
    arrays = _arrays(path)
    found: dict[str, Any] = {}
    for name in ("omega", "shapes"):
        if name not in arrays:
            raise wrong(path, "as a whole", "arrays omega and shapes", ", ".join(arrays) or "none")
        found[name] = arrays.pop(name)
    if "labels" in arrays:
        found["labels"] = _labels(path, arrays.pop("labels"))
    along = {f"participation_{direction}": direction for direction in "xyz"}
    astray = [name for name in arrays if name not in along]
    if astray:
        raise wrong(path, f"array {astray[0]}", f"omega, shapes, labels, {', '.join(along)}", "another name")
    return found | ({"participation": {along[name]: one for name, one in arrays.items()}} if arrays else {})


def _arrays(path: Path) -> dict[str, Any]:
    """All arrays of a .npz by name."""
    try:
        with np.load(path, allow_pickle=False) as file:
            return {name: file[name] for name in file.files}
    except (*BROKEN, AttributeError) as error:  # a .npy has no files
        raise _broken(path, error) from None


def _broken(path: Path, error: Exception) -> ValueError:
    """The error of a damaged file."""
    found = "something else" if "pickle" in str(error) else error  # NumPy's advice is to trust the file
    return wrong(path, "as a whole", "arrays of numbers in a .npz", found)


def read_npy(path: Path) -> Given:
    """The one matrix of a .npy."""
    try:
        found = np.load(path, allow_pickle=False)
        found = found if np.iscomplexobj(found) else sparse.csr_matrix(found, dtype=float)
    except (ValueError, TypeError, OSError, EOFError) as error:
        raise wrong(path, "as a whole", "a square array of numbers in a .npy", error) from None
    return Given(path, ((path.stem, sparse.csr_matrix(_real(path, "as a whole", found), dtype=float)),))


def _real(path: Path, where: str, values: Any) -> Any:
    """Numbers without their imaginary parts; ValueError where there are any."""
    if np.iscomplexobj(values) and np.any(values.imag):
        raise wrong(path, where, "real numbers, and damping as C, as ratios of modes or as dashpots", "complex ones")
    return values.real if np.iscomplexobj(values) else values


def _sparse(path: Path, name: str, size: int, entries: list[Any]) -> sparse.csr_matrix:
    """A matrix from its values, rows and columns, numbered from 0."""
    data, row, column = entries
    if not data.shape == row.shape == column.shape or row.dtype.kind not in "iu" or column.dtype.kind not in "iu":
        raise wrong(path, f"array {name}_data", "as many values as whole numbers in _row and _col", data.shape)
    if data.size and min(row.min(), column.min()) < 0:
        raise wrong(
            path, f"array {name}_row or {name}_col", "rows and columns from 0", int(min(row.min(), column.min()))
        )
    least = 1 + int(max(row.max(initial=-1), column.max(initial=-1)))
    if size and least > size:
        raise wrong(path, f"array {name}_row or {name}_col", f"at most the {size} dofs of labels", least)
    values = _real(path, f"array {name}_data", data)
    return sparse.csr_matrix((values.astype(float), (row, column)), shape=(size or least,) * 2)


def _labels(path: Path, array: Any) -> tuple[Label, ...]:
    """(node, component) of every row; numbers may be written as text."""
    if array.ndim != 2 or array.shape[1] != 2:
        raise wrong(path, "array labels", "(N, 2): a node and a component of each dof", array.shape)
    return tuple(label_of(path, f"labels[{i}]", *map(str, row)) for i, row in enumerate(array))


def label_of(path: Path, where: str, node: str, name: str) -> Label:
    """A label from two words; the component by its name or number."""
    known = {**{str(i): one for i, one in COMPONENT.items()}, **{one: one for one in COMPONENT.values()}}
    known |= {"0": SCALAR, SCALAR: SCALAR}
    if name.lower() not in known:
        raise wrong(path, where, f"a node and one of {', '.join(COMPONENT.values())} or 1 to 6", f"{node} {name}")
    return (int(node) if node.lstrip("-").isdigit() else node), known[name.lower()]
