"""Nastran's punched DMIG cards (.pch): matrices by grid and component.

    DMIG    KAAX           0       6       2       0                          name, 0, form, type
    DMIG*   KAAX                          11               3                  a column: grid, component
    *                     11               3 3.528000000D+08                  its entries: grid, component, value

in fields of 8 columns, of 16 on lines marked by a star, or with commas. Form 6 has each pair of symmetric entries
once, in either triangle. Nine decimals are punched: frequencies come out to about 1e-9.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from fembeam.structures.readers.given import SCALAR, Given, Label, assembled, component, numbered, wrong
from fembeam.support import real

SQUARE, SYMMETRIC = 1, 6


@dataclass
class _Card:
    """One matrix while it is read."""

    form: int
    kind: int
    rows: list[Label] = field(default_factory=list)
    columns: list[Label] = field(default_factory=list)
    values: list[float] = field(default_factory=list)


def read_dmig(path: Path) -> Given:
    """The real square matrices of a file of DMIG cards, on the dofs that any of them has, by node and component."""
    cards: dict[str, _Card] = {}
    name, column, where = "", None, "line 1"
    for number, fields in _fields(path):
        where = f"line {number}"
        if fields[0]:  # DMIG: a head, or a column
            name, at = fields[1], fields[2:]
            if at[0] == "0" and len(at) > 2 and at[1] and at[2]:
                form, kind = _whole(path, where, at[1:3])
                cards[name], column = _Card(form, kind), None
                continue
            column = _label(path, where, *at[:2])
            entries = at[3:7]
        else:
            entries = fields[2:] if column else []
        if name not in cards or column is None:
            raise wrong(path, where, "a head DMIG, name, 0, form, type before the columns", f"{name or fields}")
        for i in range(0, len(entries), 4):
            _enter(path, where, cards[name], column, entries[i : i + 4])
    if column is not None and not (cards[name].columns and cards[name].columns[-1] == column):
        raise wrong(path, where, "entries of this column", "the end; is the file truncated?")
    square = {name: card for name, card in cards.items() if card.form in (SQUARE, SYMMETRIC) and card.kind < 3}
    if not square:
        listed = ", ".join(f"{name} (form {card.form}, type {card.kind})" for name, card in cards.items()) or "none"
        raise wrong(path, "as a whole", "DMIG cards of a real matrix of form 1 or 6", listed)
    for name, card in square.items():
        if not card.rows:
            raise wrong(path, "as a whole", f"columns of {name} after its head", "none; is the file truncated?")
    order = numbered({label for card in square.values() for label in (*card.rows, *card.columns)})
    found = []
    for name, card in square.items():
        rows, columns = ([order[label] for label in labels] for labels in (card.rows, card.columns))
        found.append((name, assembled(rows, columns, card.values, len(order), card.form == SYMMETRIC)))
    return Given(path, tuple(found), tuple(order))


def _fields(path: Path) -> Iterator[tuple[int, list[str]]]:
    """(line, fields from the first on) of DMIG cards and of the lines that continue them, whose first field is ''."""
    inside = False
    for number, text in enumerate(path.read_text(encoding="latin-1").splitlines(), 1):
        line = text.split("$")[0].rstrip().expandtabs(8)
        head = line[:8].split(",")[0].strip().upper()
        if not line:
            continue
        inside = head.rstrip("*") == "DMIG" or (inside and head[:1] in ("", "*", "+"))
        if not inside:
            continue
        if "," in line:
            words = [word.strip() for word in line.split(",")]
        else:
            width, most = (16, 72) if "*" in line[:8] else (8, 72)
            words = [line[:8], *(line[i : min(i + width, most)].strip() for i in range(8, min(len(line), most), width))]
        first = "DMIG" if head.startswith("DMIG") else ""
        yield number, [first, *(words[1:] if first else ["", *words[1:]])] + [""] * 4


def _whole(path: Path, where: str, words: list[str]) -> list[int]:
    """Whole numbers."""
    try:
        return [int(word) for word in words]
    except ValueError:
        raise wrong(path, where, "whole numbers", ", ".join(map(repr, words))) from None


def _label(path: Path, where: str, grid: str, number: str) -> Label:
    """A dof; component 0 is that of a scalar point, a generalised coordinate."""
    node, direction = _whole(path, where, [grid, number or "0"])
    return node, SCALAR if direction == 0 else component(path, where, direction, node)


def _enter(path: Path, where: str, card: _Card, column: Label, words: list[str]) -> None:
    """One entry: grid, component, value."""
    if not "".join(words).strip():
        return
    try:
        value = real(words[2])
    except (ValueError, IndexError):
        raise wrong(path, where, "grid, component and value", ", ".join(words)) from None
    card.rows.append(_label(path, where, words[0], words[1]))
    card.columns.append(column)
    card.values.append(value)
