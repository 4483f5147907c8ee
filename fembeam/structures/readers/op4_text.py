"""The text form of op4: lines with a point hold values, all others whole numbers; `op4` has the layout."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from fembeam.structures.readers.given import wrong
from fembeam.structures.readers.op4 import SHORT, Columns
from fembeam.support import real

HEAD = re.compile(r"\s*(-?\d+)\s+(-?\d+)\s+(\d+)\s+(\d)(.{0,8})")
NUMBER = re.compile(r"[+-]?\d*\.\d*(?:[EeDd]?[+-]\d+)?")
VALUES = re.compile(r"[\s\d+\-EeDd]*\.[\s\d.+\-EeDd]*")


def of_lines(path: Path, data: bytes) -> list[Columns]:
    """The matrices of a text file."""
    lines = data.decode("latin-1").splitlines()
    matrices: list[Columns] = []
    current, at = None, 0
    while at < len(lines):
        where, line = f"line {at + 1}", lines[at]
        at += 1
        if current is None:
            if line.strip():
                current = _head(path, where, line)
            continue
        column, row, words = _integers(path, where, line, 3)
        if column > current.columns:
            _, at = _values(path, lines, at)
            matrices.append(current)
            current = None
        elif row > 0:
            numbers, at = _values(path, lines, at)
            _check_count(path, where, len(numbers), words)
            current.add(path, where, column, row, numbers)
        else:
            at = _strings(path, lines, at, column, current)
    if current is not None:
        raise wrong(path, f"line {len(lines)}", f"more columns of {current.name}, and one behind the last", "the end")
    return matrices


def _head(path: Path, where: str, line: str) -> Columns:
    """The head of a matrix: four whole numbers, the last of one digit, and the name right behind it."""
    found = HEAD.match(line)
    if found:
        return Columns.begun(path, where, found.groups()[:4], found[5])
    return Columns.begun(path, where, _integers(path, where, line[:32], 4), line[32:40])


def _strings(path: Path, lines: list[str], at: int, column: int, matrix: Columns) -> int:
    """Read the strings of a column; the line behind them."""
    heads = 2 if matrix.bigmat else 1
    while at < len(lines) and len(lines[at].split()) == heads and "." not in lines[at]:
        where = f"line {at + 1}"
        head = _integers(path, where, lines[at], heads)
        words, first = (head[0], head[1]) if matrix.bigmat else divmod(head[0], SHORT)
        numbers, at = _values(path, lines, at + 1)
        _check_count(path, where, len(numbers), words - 1)
        matrix.add(path, where, column, first, numbers)
    return at


def _check_count(path: Path, where: str, found: int, words: int) -> None:
    """As many values as a head says; of double precision some writers count two words a value."""
    if found < 1 or words not in (found, 2 * found):
        raise wrong(path, where, f"{words} words of values behind this line", f"{found} values")


def _integers(path: Path, where: str, line: str, count: int) -> list[int]:
    """Whole numbers, in words or in fields of eight."""
    words = line.split() if len(line.split()) == count else [line[8 * i : 8 * i + 8] for i in range(count)]
    try:
        return [int(word) for word in words]
    except ValueError:
        kind = "the head of a matrix" if count == 4 else f"{count} whole numbers"
        raise wrong(path, where, kind, repr(line[:60])) from None


def _values(path: Path, lines: list[str], at: int) -> tuple[Any, int]:
    """The values of the lines with a point from here on, and the line behind them."""
    found: list[str] = []
    while at < len(lines) and VALUES.fullmatch(lines[at]):
        if NUMBER.sub("", lines[at]).strip():
            raise wrong(path, f"line {at + 1}", "numbers such as 1.0E+00", repr(lines[at][:60]))
        found += NUMBER.findall(lines[at])
        at += 1
    return np.array([real(text) for text in found]), at
