"""Where nodes are: GRID cards of Nastran, *NODE of Abaqus and CalculiX, or lines "node x y z"."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from fembeam.support import abaqus_blocks, check_abaqus, nastran_cards, real

Place = tuple[float, float, float]
Named = tuple[str, int | str, Place]  # where it stands, the node and its place


def read_nodes(path: Path) -> dict[int | str, Place]:
    """{node: (x, y, z)} of a .bdf, .dat, .nas, .pch, .inp or a table of four columns, in the units of the file."""
    lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    if any(line.upper().startswith("GRID") for line in lines):
        nodes = _grids(path)
    elif any(line.strip().upper().replace(" ", "").startswith("*NODE") for line in lines):
        nodes = _below_keyword(path)
    else:
        told = [(i, line) for i, line in enumerate(lines, 1) if line.strip() and line[0] not in "#$*"]
        nodes = (_named(f"{path}, line {i}", line) for i, line in told)
    found: dict[int | str, Place] = {}
    for where, node, place in nodes:
        if found.setdefault(node, place) != place:
            raise _wrong(where, f"node {node} once", f"it at {found[node]} before and {place} here")
    if not found:
        raise _wrong(f"{path}, as a whole", "GRID cards, *NODE, or lines of node x y z", "none")
    return found


def _wrong(where: str, expected: str, got: str) -> ValueError:
    """The error of a file that is not what it should be."""
    return ValueError(f"{where}: expected {expected}, got {got}")


def _named(where: str, line: str) -> Named:
    """Node, by number or name, and three coordinates."""
    words = line.replace(",", " ").replace(";", " ").split()
    try:
        x, y, z = (real(word) for word in words[1:])
        return where, (int(words[0]) if words[0].lstrip("+-").isdigit() else words[0]), (x, y, z)
    except ValueError:
        raise _wrong(where, "node, x, y, z", repr(line[:60])) from None


def _below_keyword(path: Path) -> Iterator[Named]:
    """The lines below *NODE; coordinates left out are 0."""
    blocks = abaqus_blocks(path)
    check_abaqus(blocks)
    for block in blocks:
        for where, given in block.data if block.keyword == "NODE" else ():
            words = given if len(given) > 1 else given[0].split()
            try:
                x, y, z = (real(word) if word else 0.0 for word in [*words, "", "", ""][1:4])
                yield where, int(words[0]), (x, y, z)
            except ValueError:
                raise _wrong(where, "node, x, y, z", repr(",".join(words)[:60])) from None


def _grids(path: Path) -> Iterator[Named]:
    """GRID cards: id, system of the place, x, y, z, system of the displacements; only the basic system (0) is known.

    A GRDSET card has the systems of those that name none.
    """
    cards = list(nastran_cards(path))
    usual = next((card.words for card in cards if card.name == "GRDSET"), [""] * 6)
    for card in cards:
        if card.name == "INCLUDE":
            raise _wrong(card.where, "all GRID cards in one file", f"INCLUDE {card.words[0]}: insert what it includes")
        if card.name != "GRID":
            continue
        try:
            node = int(card.words[0])
            x, y, z = (real(word) if word else 0.0 for word in card.words[2:5])
        except ValueError:
            raise _wrong(card.where, "GRID, id, system, x, y, z", ", ".join(card.words[:6])) from None
        of_place, of_motion = (card.words[i] or usual[i] or "0" for i in (1, 5))
        if of_place != "0" or of_motion != "0":
            raise _wrong(card.where, f"GRID {node} in the basic system for place and displacements",
                         f"systems {of_place} and {of_motion}: turn them before the export")  # fmt: skip
        yield card.where, node, (x, y, z)
