"""CalculiX, *FREQUENCY, SOLVER=MATRIXSTORAGE: job.sti and job.mas (row, column, value; one triangle) and job.dof, whose
lines "node.dof" name the rows.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fembeam.structures.readers.given import Given, Label, assembled, component, wrong


def read_calculix(path: Path) -> Given:
    """K or M with its labels from the .dof beside it."""
    beside = path.with_suffix(".dof")
    if not beside.exists():
        raise wrong(path, "beside it", f"{beside.name}, which names the rows", "no such file")
    labels = read_dof(beside)
    rows, columns, values = [], [], []
    for number, line in enumerate(path.read_text(encoding="latin-1").splitlines(), 1):
        words = line.split()
        if not words:
            continue
        try:
            i, j, value = int(words[0]), int(words[1]), float(words[2].upper().replace("D", "E"))
        except (ValueError, IndexError):
            raise wrong(path, f"line {number}", "row, column, value", repr(line[:60])) from None
        if len(words) != 3 or not (1 <= i <= len(labels) and 1 <= j <= len(labels)) or not np.isfinite(value):
            raise wrong(path, f"line {number}", f"row and column from 1 to {len(labels)}, value", repr(line[:60]))
        rows.append(i - 1)
        columns.append(j - 1)
        values.append(value)
    if not rows:
        raise wrong(path, "line 1", "row, column, value", "no entries")
    return Given(path, ((path.stem, assembled(rows, columns, values, len(labels))),), labels)


def read_dof(path: Path) -> tuple[Label, ...]:
    """Labels from lines such as 12.3: node 12, component 3."""
    found: list[Label] = []
    for number, line in enumerate(path.read_text(encoding="latin-1").splitlines(), 1):
        if not line.strip():
            continue
        node, _, dof = line.strip().partition(".")
        if not (node.isdigit() and dof.isdigit()):
            raise wrong(path, f"line {number}", "node.dof, such as 12.3", repr(line[:60]))
        found.append((int(node), component(path, f"line {number}", int(dof), node)))
    return tuple(found)
