"""Where nodes are: GRID cards of Nastran, *NODE of Abaqus and CalculiX, or lines "node x y z"."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from fembeam.structures.readers.given import real, wrong

Place = tuple[float, float, float]


def read_nodes(path: Path) -> dict[int | str, Place]:
    """{node: (x, y, z)} of a .bdf, .dat, .nas, .pch, .inp or a table of four columns, in the units of the file."""
    lines = path.read_text(encoding="latin-1").splitlines()
    if any(line.upper().startswith("GRID") for line in lines):
        found = _grids(path, lines)
    elif any(line.strip().upper().replace(" ", "").startswith("*NODE") for line in lines):
        found = _below_keyword(path, lines)
    else:
        found = dict(_named(path, i, line) for i, line in enumerate(lines, 1) if line.strip() and line[0] not in "#$*")
    if not found:
        raise wrong(path, "as a whole", "GRID cards, *NODE, or lines of node x y z", "none")
    return found


def _named(path: Path, number: int, line: str) -> tuple[int | str, Place]:
    """Node, by number or name, and three coordinates."""
    words = line.replace(",", " ").replace(";", " ").split()
    try:
        x, y, z = (real(word) for word in words[1:])
        return (int(words[0]) if words[0].lstrip("+-").isdigit() else words[0]), (x, y, z)
    except ValueError:
        raise wrong(path, f"line {number}", "node, x, y, z", repr(line[:60])) from None


def _entry(path: Path, number: int, line: str) -> tuple[int, Place]:
    """Node and coordinates of a line; those left out are 0."""
    words = [word.strip() for word in line.split(",")] if "," in line else line.split()
    try:
        at = [real(word) if word else 0.0 for word in words[1:4]]
        return int(words[0]), (*at, *[0.0] * (3 - len(at)))  # type: ignore[return-value]
    except ValueError:
        raise wrong(path, f"line {number}", "node, x, y, z", repr(line[:60])) from None


def _below_keyword(path: Path, lines: list[str]) -> dict[int | str, Place]:
    """The lines below *NODE, up to the next keyword."""
    found: dict[int | str, Place] = {}
    inside = False
    for number, line in enumerate(lines, 1):
        if line.startswith("**") or not line.strip():
            continue
        if line.startswith("*"):
            word = line.upper().replace(" ", "").split(",")[0].strip()
            inside = word == "*NODE"
        elif inside:
            node, place = _entry(path, number, line)
            found[node] = place
    return found


def _grids(path: Path, lines: list[str]) -> dict[int | str, Place]:
    """GRID cards: id, system of the place, x, y, z, system of the displacements; only the basic system (0) is known.

    A GRDSET card has the systems of those that name none.
    """
    found: dict[int | str, Place] = {}
    usual = next((words for _, words in _cards(lines, "GRDSET")), [""] * 6)
    for number, words in _cards(lines, "GRID"):
        try:
            node, at = int(words[0]), [real(word) if word else 0.0 for word in words[2:5]]
        except ValueError:
            raise wrong(path, f"line {number}", "GRID, id, system, x, y, z", repr(lines[number - 1][:60])) from None
        of_place, of_motion = (words[i] or usual[i] or "0" for i in (1, 5))
        if of_place != "0" or of_motion != "0":
            raise wrong(path, f"line {number}", f"GRID {node} in the basic system for place and displacements",
                        f"systems {of_place} and {of_motion}: turn them before the export")  # fmt: skip
        found[node] = (at[0], at[1], at[2])
    return found


def _cards(lines: list[str], name: str) -> Iterator[tuple[int, list[str]]]:
    """(line, fields behind the name, six at least) of the cards of a name."""
    for number, line in enumerate(lines, 1):
        if line[:8].split(",")[0].strip().upper().rstrip("*") != name:
            continue
        if "," in line:
            words = [word.strip() for word in line.split(",")[1:]]
        elif "*" in line[:8]:
            more = lines[number] if number < len(lines) else ""
            words = [part[i : i + 16].strip() for part in (line, more) for i in range(8, 72, 16)]
        else:
            words = [line[i : i + 8].strip() for i in range(8, 72, 8)]
        yield number, words + [""] * (6 - len(words))
