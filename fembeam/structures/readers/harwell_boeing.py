"""Harwell–Boeing, as Ansys writes it (HBMAT, …, MAPPING): columns by pointers, and job.mapping, which names the rows.

title, key
lines: total, pointers, rows, values, right-hand sides
type (RSA symmetric, RUA unsymmetric), rows, columns, entries, elements
Fortran formats of pointers, rows, values
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from fembeam.structures.readers.given import Given, Label, assembled, wrong
from fembeam.support import real

FORMAT = re.compile(r"\(\s*(?:\d+P\s*,?)?\s*(\d*)\s*[IEDFG](\d+)(?:\.\d+)?(?:E\d+)?\s*\)", re.IGNORECASE)
NAMES = {"UX": "x", "UY": "y", "UZ": "z", "ROTX": "rx", "ROTY": "ry", "ROTZ": "rz"}


def read_harwell_boeing(path: Path) -> Given:
    """The matrix of an ASCII Harwell–Boeing file, labelled if its .mapping lies beside it."""
    lines = path.read_text(encoding="latin-1").splitlines()
    if len(lines) < 4:
        raise wrong(path, f"line {len(lines)}", "a head of four lines", "the end")
    counts = _whole(path, lines, 1)
    kind, sizes = lines[2][:3].upper(), _whole(path, lines, 2, 14)
    if kind not in ("RSA", "RUA"):
        raise wrong(path, "line 3", "a real assembled matrix, RSA or RUA", repr(kind))
    if len(sizes) < 3 or min(sizes) < 0:
        raise wrong(path, "line 3", "rows, columns and entries behind the type", repr(lines[2][14:74]))
    size, entries = sizes[0], sizes[2]
    if sizes[0] != sizes[1] or size < 1:
        raise wrong(path, "line 3", "as many rows as columns", f"{sizes[0]} × {sizes[1]}")
    at = 5 if len(counts) > 4 and counts[4] > 0 else 4
    formats = [_format(path, text) for text in (lines[3][:16], lines[3][16:32], lines[3][32:52])]
    pointers, at = _numbers(path, lines, at, size + 1, *formats[0])
    rows, at = _numbers(path, lines, at, entries, *formats[1])
    values, at = _numbers(path, lines, at, entries, *formats[2])
    pointers, rows = pointers.astype(int), rows.astype(int)
    if pointers[0] != 1 or pointers[-1] != entries + 1 or np.any(np.diff(pointers) < 0):
        raise wrong(path, "its pointers", f"ascending from 1 to {entries + 1}", f"{pointers[0]} to {pointers[-1]}")
    if entries and (rows.min() < 1 or rows.max() > size):
        raise wrong(path, "its rows", f"1 to {size}", f"{rows.min()} to {rows.max()}")
    columns = np.repeat(np.arange(size), np.diff(pointers))
    beside = [one for one in (path.with_suffix(".mapping"), path.with_suffix(".MAPPING")) if one.exists()]
    labels = read_mapping(beside[0], size) if beside else None
    return Given(path, ((path.stem, assembled(rows - 1, columns, values, size, kind == "RSA")),), labels)


def read_mapping(path: Path, size: int | None = None) -> tuple[Label, ...]:
    """Labels from lines of equation, node and dof (UX to ROTZ)."""
    found: dict[int, Label] = {}
    for number, line in enumerate(path.read_text(encoding="latin-1").splitlines(), 1):
        words = line.split()
        if len(words) < 3 or not words[0].isdigit():
            continue
        if not words[1].isdigit() or words[2].upper() not in NAMES:
            expected = f"equation, node and one of {', '.join(NAMES)} (no internal nodes, no multipliers)"
            raise wrong(path, f"line {number}", expected, repr(line.strip()[:60]))
        found[int(words[0])] = int(words[1]), NAMES[words[2].upper()]
    if sorted(found) != list(range(1, len(found) + 1)) or (size is not None and len(found) != size):
        expected = f"equations 1 to {size or len(found)}, each once"
        raise wrong(path, "as a whole", expected, f"{len(found)} of them up to {max(found, default=0)}")
    return tuple(found[i] for i in sorted(found))


def _whole(path: Path, lines: list[str], line: int, begin: int = 0) -> list[int]:
    """Whole numbers of a line, in words or in fields of 14."""
    text = lines[line][begin:]
    try:
        return [int(word) for word in text.split()]
    except ValueError:
        raise wrong(path, f"line {line + 1}", "whole numbers", repr(text[:60])) from None


def _format(path: Path, text: str) -> tuple[int, int]:
    """(numbers in a line, width of each) of a Fortran format."""
    found = FORMAT.search(text)
    if not found or found[1] == "0" or found[2] == "0":
        raise wrong(path, "line 4", "formats such as (8I10) and (4E20.12)", repr(text))
    return int(found[1] or 1), int(found[2])


def _numbers(path: Path, lines: list[str], at: int, count: int, each: int, width: int) -> tuple[Any, int]:
    """Numbers in fields, and the line behind them."""
    end = at + -(-count // each)
    found: list[float] = []
    for number in range(at, end):
        if number >= len(lines):
            raise wrong(path, f"line {number + 1}", f"{count - len(found)} more of {count} numbers", "the end")
        line = lines[number].rstrip()
        wanted = min(each, count - len(found))
        fields = line.split()  # not all programs, SciPy for one, keep to the widths they write
        if len(fields) != wanted:
            fields = [line[i : i + width] for i in range(0, min(len(line), each * width), width)]
        try:
            found += [real(field) for field in fields[:wanted]]
        except ValueError:
            fields = []
        if len(fields) < wanted:
            raise wrong(path, f"line {number + 1}", f"{wanted} numbers of {width} columns", repr(line[:60]))
    return np.array(found), end
