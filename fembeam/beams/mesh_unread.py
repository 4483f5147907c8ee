"""What meshio passes over in files of Nastran and Abaqus, without which frames would be wrong: it is refused."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from fembeam.support import require

NASTRAN = (".bdf", ".nas", ".fem")
BARS = ("CBAR", "CBEAM")
MAKERS = ("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM", "RELEASE")


def check_read(path: Path) -> None:
    """Raise ValueError for a file with systems, releases, offsets, moved instances or generators of nodes."""
    suffix = path.suffix.lower()
    if suffix in NASTRAN:
        _check_nastran(path, path.read_text(errors="replace").splitlines())
    elif suffix == ".inp":
        _check_abaqus(path, path.read_text(errors="replace").splitlines())


def _check_nastran(path: Path, lines: list[str]) -> None:
    """Places in the basic system, bars without pins and offsets, all in one file."""
    cards = list(_cards(lines))
    usual = next((words[1] for name, words in cards if name == "GRDSET"), "")
    for name, words in cards:
        require(name != "INCLUDE", "all cards must stand in one file", words[0], f"{path}", "insert what it includes")
        if name == "GRID":
            system = words[1] or usual or "0"
            require(system == "0", f"GRID {words[0]} must be in the basic system", f"system {system}", f"{path}",
                    "turn the places before the export")  # fmt: skip
        elif name in BARS:
            _check_bar(path, name, words)


def _check_bar(path: Path, name: str, words: list[str]) -> None:
    """Pin flags and offsets of a bar must be left out."""
    said = [word for word in words[8:16] if not set(word.upper()) <= set("0.+-ED")]
    require(not said, f"{name} {words[0]} must have no pin flags and no offsets", said, f"{path}",
            "leave them out, and give the member release= or offset=")  # fmt: skip


def _cards(lines: list[str]) -> Iterator[tuple[str, list[str]]]:
    """(name, 16 fields behind it at least) of all cards of bulk data, in free, small or large fields."""
    name, words = "", [""]
    for line in (one.split("$")[0].rstrip() for one in lines):
        head, own = _fields(line)
        if line and (head.startswith(("+", "*")) or not head):
            words += own
            continue
        if name:
            yield name, words + [""] * (16 - len(words))
        name, words = head.upper().rstrip("*"), own
    if name:
        yield name, words + [""] * (16 - len(words))


def _fields(line: str) -> tuple[str, list[str]]:
    """Name of a card, or of a continuation, and its fields."""
    if "," in line:
        head, *words = (word.strip() for word in line.split(","))
        return head, (words + [""] * 8)[: 4 if head.endswith("*") else 8]
    if line.upper().startswith("INCLUDE"):
        return "INCLUDE", [line[7:].strip()]
    width = 16 if "*" in line[:8] else 8
    return line[:8].strip(), [line[i : i + width].strip() for i in range(8, 72, width)]


def _check_abaqus(path: Path, lines: list[str]) -> None:
    """Nodes and elements as they are: none generated, none in a system of its own, no parts that instances move."""
    parts, below = 0, ""
    for line in (one.strip().upper() for one in lines if not one.startswith("**")):
        if line.startswith("*"):
            below, *options = (word.strip() for word in line.strip("*").split(","))
            made = below in MAKERS or (below == "NODE" and any(word.startswith("SYSTEM") for word in options))
            require(not made, "nodes and elements must stand there as they are", f"*{line.strip('*')}", f"{path}",
                    "write them out, in global axes and rigidly joined")  # fmt: skip
            parts += below == "INSTANCE"
            require(parts < 2, "a file must have one instance of a part", "a second *INSTANCE", f"{path}",
                    "write a flat file: all nodes and elements in one")  # fmt: skip
        elif line:
            require(below != "INSTANCE", "an instance must not be moved", line, f"{path}",
                    "write a flat file, its nodes where they are in the assembly")  # fmt: skip
