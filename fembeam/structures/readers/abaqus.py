"""Abaqus *MATRIX OUTPUT (.mtx): the layouts MATRIX INPUT and LABELS (node, dof, node, dof, value) and COORDINATE (row,
column, value, numbered from 1), with commas or blanks, whole or each pair of symmetric entries once.

Dofs held by boundary conditions stand with 1e36 on the diagonal. Internal nodes (Lagrange multipliers of hybrid
elements and connectors) have negative labels: they make K indefinite and M singular, and are refused.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from fembeam.structures.readers.given import COMPONENT, Given, assembled, component, numbered, table, wrong

HELD = 1e35  # and above: what Abaqus writes for a held dof is 1e36
WIDTHS = {3: "row, column, value", 5: "node, dof, node, dof, value"}


def read_abaqus(path: Path) -> Given:
    """The one matrix of an Abaqus .mtx, without the held dofs; labelled but in the layout COORDINATE."""
    table, symmetric, first = _table(path)
    ids = table[:, :-1].astype(int)
    if not np.array_equal(ids, table[:, :-1]):
        raise wrong(path, f"line {first} on", f"whole numbers before the value ({WIDTHS[table.shape[1]]})", "fractions")
    nodes = ids[:, 0::2] if ids.shape[1] == 4 else ids
    if nodes.min() < 0:
        count = len(np.unique(nodes[nodes < 0]))
        raise wrong(path, f"line {first + int(np.argmax(nodes.min(axis=1) < 0))}", "positive labels",
                    f"{nodes.min()}: {count} internal nodes, which make K indefinite and M singular; export without "
                    "hybrid elements, connectors and couplings by multipliers")  # fmt: skip
    if ids.shape[1] == 4:
        pairs = {(int(n), int(d)) for n, d in np.unique(ids.reshape(-1, 2), axis=0)}
        order = numbered({(n, component(path, f"line {first} on", d, n)) for n, d in pairs})
        rows, columns = _places(ids[:, :2], order), _places(ids[:, 2:], order)
        names: list[Any] = list(order)
    else:
        if nodes.min() < 1:
            raise wrong(path, f"line {first} on", "rows and columns numbered from 1", int(nodes.min()))
        rows, columns = ids[:, 0] - 1, ids[:, 1] - 1
        names = list(range(int(ids.max())))
    whole = assembled(rows, columns, table[:, -1], len(names), symmetric)
    free = whole.diagonal() < HELD
    held = tuple(name for name, kept in zip(names, free, strict=True) if not kept)
    labels = tuple(name for name, kept in zip(names, free, strict=True) if kept) if ids.shape[1] == 4 else None
    return Given(path, ((path.stem, whole[free][:, free]),), labels, held)


def _places(pairs: Any, order: dict[Any, int]) -> Any:
    """Numbers of the dofs (node, dof) among the labels."""
    unique, back = np.unique(pairs, axis=0, return_inverse=True)
    return np.array([order[int(node), COMPONENT[int(dof)]] for node, dof in unique])[back.ravel()]


def _table(path: Path) -> tuple[Any, bool, int]:
    """(entries, columns), whether one triangle may be left out, the line of the first entry."""
    lines = path.read_text(encoding="latin-1").splitlines()
    data = [(i, line) for i, line in enumerate(lines, 1) if line.strip() and not line.lstrip().startswith("*")]
    heads = " ".join(line.upper() for line in lines[:200] if line.lstrip().startswith("*") and line.strip()[:2] != "**")
    if "USER ELEMENT" in heads or "TYPE=STIFFNESS" in heads.replace(" ", ""):
        raise wrong(path, "line 1", "a matrix of *MATRIX OUTPUT", "one of a substructure or user element")
    if not data:
        raise wrong(path, f"line {len(lines)}", " or ".join(WIDTHS.values()), "no entries")
    width = len(data[0][1].replace(",", " ").split())
    if width not in WIDTHS:
        hint = "; element by element? export the assembled matrix" if width == 6 else ""
        raise wrong(path, f"line {data[0][0]}", " or ".join(WIDTHS.values()), f"{width} words{hint}")
    return table(path, data, width, WIDTHS[width]), "UNSYMMETRIC" not in heads, data[0][0]
