"""Meshes of Nastran and Abaqus: places, lines and groups. What is more than these and would be lost is refused."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fembeam.support import Block, Card, abaqus_blocks, check_abaqus, nastran_cards, real, require, warn

Key = tuple[bool, int]  # whether of the assembly itself, and the number

BARS = ("CBAR", "CBEAM", "CROD", "CTUBE")
PINNED = ("CROD", "CTUBE", "T2D", "T3D")
OTHERS = ("CBEND", "CBEAM3", "CONROD", "CTRI", "CTRAX", "CQUAD", "CSHEAR", "CTETRA", "CPENTA", "CHEXA", "CPYRA")
PASSED = ("RBAR", "RBE", "RJOINT", "RROD", "RSPLINE", "RTRPLT", "MPC", "CONM", "CMASS", "CELAS", "CBUSH", "CDAMP",
          "CVISC", "CGAP", "CFAST", "CWELD", "GENEL")  # fmt: skip
TIES = ("RIGID BODY", "MPC", "EQUATION", "COUPLING", "KINEMATIC COUPLING", "DISTRIBUTING COUPLING", "TIE",
        "EMBEDDED ELEMENT", "NONSTRUCTURAL MASS")  # fmt: skip
MAKERS = ("ELGEN", "ELCOPY", "RELEASE")
TABLES = ("NODE", "ELEMENT", "NSET", "ELSET")
TWO_NODES = ("B23", "B23H", "B33", "B33H", "B31R")
BEAMS = dict.fromkeys(TWO_NODES, "line") | {"B32R": "line3"}  # beams that meshio does not know, or B33 wrongly


def nastran_mesh(path: Path) -> Any:
    """A mesh of GRID cards and bars, whose numbers of properties are cell data."""
    import meshio

    cards = list(nastran_cards(path))
    require(bool(cards) and cards[-1].name == "ENDDATA", "the file must end with ENDDATA",
            cards[-1].name if cards else "nothing", f"{path}", "export it again: it is cut")  # fmt: skip
    _check_nastran(cards, path)
    _warn_of_passed([card.name for card in cards if card.name.startswith(PASSED)], path)
    _warn_of_pinned([card.name for card in cards], path)
    grids = [card for card in cards if card.name == "GRID"]
    number = {_whole(card.words[0], card.where): i for i, card in enumerate(grids)}
    bars = [card for card in cards if card.name in BARS]
    ends = [[_known(number, _whole(word, bar.where), "GRID", bar.where) for word in bar.words[2:4]] for bar in bars]
    groups = [_whole(bar.words[1] or bar.words[0], bar.where) for bar in bars]
    places = [_place(card.words[2:5], card.where) for card in grids]
    return meshio.Mesh(np.array(places).reshape(-1, 3), [("line", np.array(ends).reshape(-1, 2))],
                       cell_data={"nastran:ref": [np.array(groups, dtype=np.int64)]})  # fmt: skip


def _check_nastran(cards: list[Card], path: Path) -> None:
    """Places in the basic system, bars without pins and offsets and no other elements, all in one file."""
    usual = next((card.words[1] for card in cards if card.name == "GRDSET"), "")
    others = Counter(card.name for card in cards if card.name.startswith(OTHERS))
    require(not others, f"cells must be lines, of {', '.join(BARS)}", dict(others), f"{path}", "mesh the axes only")
    for card in cards:
        name, words = card.name, card.words
        require(name != "INCLUDE", "all cards must stand in one file", words[0], card.where, "insert what it includes")
        require(name[:1] != "=", "all cards must be written out", name, card.where, "export without replication")
        if name == "GRID":
            system = words[1] or usual or "0"
            require(system == "0", f"GRID {words[0]} must be in the basic system", f"system {system}", card.where,
                    "turn the places before the export")  # fmt: skip
        elif name in BARS[:2]:
            said = [word for word in words[8:16] if not set(word.upper()) <= set("0.+-ED")]
            require(not said, f"{name} {words[0]} must have no pin flags and no offsets", said, card.where,
                    "leave them out, and give the member release= or offset=")  # fmt: skip


def _warn_of_passed(names: list[str], path: Path) -> None:
    """Warn of what joins nodes or has mass, but is no line: how many of each there are."""
    if names:
        said = ", ".join(f"{count} {name}" for name, count in sorted(Counter(names).items()))
        warn(f"{said} in {path} are passed over: what they hold, join or weigh is not in the mesh; say it in "
             "the scene")  # fmt: skip


def _warn_of_pinned(kinds: list[str], path: Path) -> None:
    """Warn of bars that turn freely at their ends, which a mesh joins as rigidly as beams."""
    names = [name for name in kinds if name.startswith(PINNED)]
    if names:
        said = ", ".join(f"{count} {name}" for name, count in sorted(Counter(names).items()))
        warn(f"{said} in {path}, pinned at their ends, are read as rigidly joined beams; a Member has "
             "release= for what an end does not carry")  # fmt: skip


def abaqus_mesh(path: Path) -> Any:
    """A mesh of *NODE and *ELEMENT with their sets; nodes of the assembly have numbers of their own beside a part's."""
    import meshio

    blocks = list(_levels(abaqus_blocks(path)))
    check_abaqus([block for block, _ in blocks], TABLES, MAKERS)
    _warn_of_passed([f"*{block.keyword}" for block, _ in blocks if block.keyword in TIES], path)
    places: dict[Key, list[float]] = {}
    for block, assembly in blocks:
        for where, words in block.data if block.keyword == "NODE" else ():
            key, at = (assembly, _whole(words[0], where)), _place(words[1:4], where)
            require(places.setdefault(key, at) == at, f"node {key[1]} must be given once", tuple(at), where,
                    "write a flat file: all nodes and elements in one")  # fmt: skip
    number = {key: i for i, key in enumerate(places)}
    cells, found, named = _elements(blocks, number)
    kinds = [block.options["TYPE"].upper() for block, _ in blocks if block.keyword == "ELEMENT" and block.data]
    _warn_of_pinned([kind for kind, (_, rows) in zip(kinds, cells, strict=True) for _ in rows], path)
    sets, nodes = _sets(blocks, "ELSET", found, named), _sets(blocks, "NSET", number, [])
    return meshio.Mesh(
        *(np.array(list(places.values())).reshape(-1, 3), [(kind, np.array(rows)) for kind, rows in cells]),
        cell_sets={name: _by_blocks([found[key] for key in keys], len(cells)) for name, keys in sets.items()},
        point_sets={name: np.array([number[key] for key in keys], dtype=np.int64) for name, keys in nodes.items()},
    )


def _levels(blocks: list[Block]) -> Iterator[tuple[Block, bool]]:
    """Blocks, and whether each is of the assembly itself, outside of instances."""
    assembly, inside = False, False
    for block in blocks:
        assembly = block.keyword == "ASSEMBLY" or (assembly and block.keyword != "END ASSEMBLY")
        inside = block.keyword == "INSTANCE" or (inside and block.keyword != "END INSTANCE")
        yield block, assembly and not inside and "INSTANCE" not in block.options


def _elements(blocks: list[tuple[Block, bool]], number: dict[Key, int]) -> Any:
    """Blocks of cells (type, nodes of each), where every element is among them, and the sets that *ELEMENT names."""
    cells: list[tuple[str, list[list[int]]]] = []
    found: dict[Key, tuple[int, int]] = {}
    named: list[tuple[str, list[Key]]] = []
    for block, assembly in blocks:
        if block.keyword == "ELEMENT" and block.data:
            kind, rows = _rows(block)
            keys = [(assembly, own) for own, *_ in rows]
            twice = [own for _, own in keys if (assembly, own) in found]
            require(not twice, "elements must be given once", twice[:1], block.where, "renumber them")
            found |= {key: (len(cells), i) for i, key in enumerate(keys)}
            named.append((block.options.get("ELSET", ""), keys))
            ends = [[_known(number, (assembly, node), "node", block.where) for node in row[1:]] for row in rows]
            cells.append((kind, ends))
    return cells, found, named


def _rows(block: Block) -> tuple[str, list[list[int]]]:
    """Type of cell of the elements of a block, and number and nodes of each, which may take several lines."""
    from meshio._common import num_nodes_per_cell
    from meshio.abaqus._abaqus import abaqus_to_meshio_type

    name = block.options.get("TYPE", "none").upper()
    kind = (abaqus_to_meshio_type | BEAMS).get(name, "")
    require(bool(kind), "elements must be beams or trusses", name, block.where, "leave others out")
    flat = [_whole(word, where) for where, words in block.data for word in words if word]
    width = 1 + num_nodes_per_cell[kind]
    require(len(flat) % width == 0, f"each element of {name} must have a number and {width - 1} nodes",
            f"{len(flat)} numbers", block.where, "is the file cut?")  # fmt: skip
    return kind, [flat[i : i + width] for i in range(0, len(flat), width)]


def _sets(blocks: list[tuple[Block, bool]], keyword: str, known: Any, named: list[Any]) -> dict[str, list[Any]]:
    """{name: keys} of sets, which may be given in parts and of other sets; case does not tell names apart."""
    sets: dict[str, list[Key]] = {}
    spelled: dict[str, str] = {}
    for name, keys in named:
        sets.setdefault(name.upper(), []).extend(keys)
        spelled.setdefault(name.upper(), name)
    for block, assembly in blocks:
        if block.keyword == keyword:
            name = block.options.get(keyword, "")
            sets.setdefault(name.upper(), []).extend(_members(block, assembly, known, sets))
            spelled.setdefault(name.upper(), name)
    return {spelled[name]: list(dict.fromkeys(keys)) for name, keys in sets.items() if name}


def _members(block: Block, assembly: bool, known: Any, sets: dict[str, list[Key]]) -> Iterator[Key]:
    """What a set is said to have: numbers, ranges of them, other sets; a number may have an instance before it."""
    for where, words in block.data:
        if "GENERATE" in block.options:
            first, last, step = [*(_whole(word, where) for word in words if word), 1][:3]
            yield from (key for key in ((assembly, n) for n in range(first, last + 1, step)) if key in known)
            continue
        for word in filter(None, words):
            if word.strip('"').upper() in sets:
                yield from list(sets[word.strip('"').upper()])
                continue
            instance, _, own = word.rpartition(".")
            key = assembly and not instance, _whole(own, where, "a number, or a set above")
            if block.keyword == "ELSET" and key not in known:
                continue  # of an element that is no line, or nowhere: without it the set is as large
            _known(known, key, "node", where)
            yield key


def _by_blocks(places: list[tuple[int, int]], count: int) -> list[Any]:
    """Numbers of the cells in each block."""
    return [np.array([i for block, i in places if block == own], dtype=np.int64) for own in range(count)]


def _known(number: dict[Any, int], key: Any, what: str, where: str) -> int:
    """The place of a node in the list of all; ValueError for one that is nowhere."""
    own = key[1] if isinstance(key, tuple) else key
    require(key in number, f"{what} {own} must be defined", "none", where, "add it; is the file cut?")
    return number[key]


def _whole(word: str, where: str, what: str = "a whole number") -> int:
    """A number of a node or the like."""
    try:
        return int(word)
    except ValueError:
        raise ValueError(f"{what} must stand there, got {word!r} in {where}; is the file cut?") from None


def _place(words: list[str], where: str) -> list[float]:
    """Three coordinates in m; those left out are 0."""
    try:
        return [real(word) if word else 0.0 for word in [*words, "", ""][:3]]
    except ValueError:
        raise ValueError(f"coordinates must stand there, got {', '.join(words)!r} in {where}; correct it") from None
