"""Input files of Nastran as cards and of Abaqus as blocks of a keyword and its data."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from fembeam.support.checks import require

NODE_MAKERS = ("NGEN", "NFILL", "NCOPY", "NMAP", "SYSTEM")
INCLUDE = re.compile(r"\s*\*\s*INCLUDE\s*,", re.IGNORECASE)
Line = tuple[str, str]  # where it stands, and its text


@dataclass(frozen=True)
class Card:
    """A card of Nastran: its name, where it begins, its fields behind the name, 16 at least."""

    name: str
    where: str
    words: list[str]


@dataclass(frozen=True)
class Block:
    """A keyword of Abaqus without its star, where it stands, its options, and the data lines below it by words."""

    keyword: str
    where: str
    options: dict[str, str]
    data: list[tuple[str, list[str]]]


def real(text: str) -> float:
    """A number as Fortran writes it: 1.5, 1.5E+3, 1.5D+3, 1.5+3."""
    text = text.strip().upper().replace("D", "E")
    sign = max(text.rfind("+"), text.rfind("-"))
    if sign > 0 and "E" not in text:
        text = f"{text[:sign]}E{text[sign:]}"
    return float(text)


def nastran_cards(path: Path) -> Iterator[Card]:
    """All cards of bulk data, in free, small or large fields, up to ENDDATA, which ends them as a card."""
    card = None
    for where, text in _bulk(_lines(path)):
        line = text.split("$")[0].rstrip().expandtabs(8)
        if not line.strip():
            continue
        head, words = _fields(line)
        if card is not None and (not head or head[0] in "+*"):
            card.words.extend(words)
            continue
        if card is not None:
            yield _filled(card)
        card = Card(head.upper().rstrip("*"), where, words)
        if card.name == "ENDDATA":
            break
    if card is not None:
        yield _filled(card)


def _lines(path: Path) -> list[Line]:
    """Lines and where they stand."""
    text = path.read_text(encoding="utf-8-sig", errors="replace")
    return [(f"{path}, line {number}", line) for number, line in enumerate(text.splitlines(), 1)]


def _bulk(lines: list[Line]) -> list[Line]:
    """The lines behind BEGIN BULK, or all."""
    begin = [i for i, (_, line) in enumerate(lines, 1) if line.upper().split()[:2] == ["BEGIN", "BULK"]]
    return lines[begin[0] :] if begin else lines


def _fields(line: str) -> tuple[str, list[str]]:
    """Name of a card, or of a continuation, and its fields."""
    if line.upper().startswith("INCLUDE"):
        return "INCLUDE", [line[7:].strip()]
    if "," in line:
        head, *words = (word.strip() for word in line.split(","))
        return head, (words + [""] * 8)[: 4 if "*" in head else 8]
    width = 16 if "*" in line[:8] else 8
    return line[:8].strip(), [line[i : i + width].strip() for i in range(8, 72, width)]


def _filled(card: Card) -> Card:
    """A card with empty fields behind its last one."""
    card.words.extend([""] * (16 - len(card.words)))
    return card


def abaqus_blocks(path: Path) -> list[Block]:
    """All keywords and their data, those of included files where these are included."""
    blocks: list[Block] = []
    for where, line in _heads_joined(_included(path, (path,))):
        if line.startswith("*"):
            keyword, *options = (word.strip() for word in line.lstrip("*").split(","))
            pairs = [option.partition("=") for option in options if option]
            values = {key.strip().upper(): value.strip().strip('"') for key, _, value in pairs}
            blocks.append(Block(" ".join(keyword.upper().split()), where, values, []))
        elif blocks:
            blocks[-1].data.append((where, [word.strip() for word in line.split(",")]))
    return blocks


def check_abaqus(blocks: list[Block], tables: tuple[str, ...] = ("NODE",), makers: tuple[str, ...] = ()) -> None:
    """Raise ValueError for nodes that are generated, in a system of their own, or of several or moved instances.

    So for ``makers`` of elements, and for ``tables`` whose data are in other files.
    """
    parts = 0
    for block in blocks:
        elsewhere = [name for name in ("SYSTEM", "INPUT") if name in block.options and block.keyword in tables]
        made = block.keyword in (*NODE_MAKERS, *makers) or bool(elsewhere)
        said = ", ".join([f"*{block.keyword}", *elsewhere])
        require(not made, "nodes and elements must stand there as they are", said, block.where,
                "write them out, in global axes and rigidly joined")  # fmt: skip
        parts += block.keyword == "INSTANCE"
        require(parts < 2, "a file must have one instance of a part", "a second *INSTANCE", block.where,
                "write a flat file: all nodes and elements in one")  # fmt: skip
        moved = block.keyword == "INSTANCE" and bool(block.data)
        require(not moved, "an instance must not be moved", ",".join(block.data[0][1]) if moved else None, block.where,
                "write a flat file, its nodes where they are in the assembly")  # fmt: skip


def _included(path: Path, within: tuple[Path, ...]) -> Iterator[Line]:
    """Lines without comments, those of a file in the place of its *INCLUDE."""
    for where, line in _lines(path):
        text = line.strip()
        if not text or text.startswith("**"):
            continue
        if not INCLUDE.match(text):
            yield where, text
            continue
        other = path.parent / _file_named(text)
        require(other.is_file() and other not in within, "*INCLUDE must name another file", f"{other}", where,
                "put it there, or insert what it includes")  # fmt: skip
        yield from _included(other, (*within, other))


def _file_named(text: str) -> str:
    """The file of an *INCLUDE."""
    return text.partition("=")[2].strip().strip('"')


def included_files(path: Path, within: tuple[Path, ...] = ()) -> Iterator[str]:
    """Files that a file of Abaqus includes, by their names from its folder, and those that they include."""
    for name in [_file_named(line) for _, line in _lines(path) if INCLUDE.match(line)]:
        other = path.parent / name
        if other.is_file() and other not in within:
            yield name
            yield from (f"{Path(name).parent / inner}" for inner in included_files(other, (*within, other)))


def _heads_joined(lines: Iterator[Line]) -> Iterator[Line]:
    """Lines, those of a keyword that ends with a comma with the next one."""
    for where, line in lines:
        while line.startswith("*") and line.endswith(","):
            line += next(lines, ("", " "))[1]
        yield where, line
