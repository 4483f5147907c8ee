"""Nastran OUTPUT4: ASCII or binary, either byte order, 4 or 8 bytes a word; dense columns or strings (BIGMAT or not).

A matrix is a head (columns, rows, form, type, name) and a record for every column that is not empty,

    column, first row, words, then values     dense
    column, 0, words, then strings            L = words of values + 1, first row       if rows < 0 in the head (BIGMAT)
                                              IS = first row + 65536 (words of values + 1)                    otherwise

up to one for the column behind the last. Types 1 and 2 are real, of single and double precision; complex matrices (3
and 4) are passed over.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

from fembeam.structures.readers.given import Given, wrong

DIAGONAL, SHORT = 3, 65536
MOST = 10**8  # rows and columns: more are those of a damaged head, for which there is no memory
HEADS = {24: 4, 48: 8}  # bytes of the first record by those of a word


@dataclass
class Columns:
    """A matrix while it is read: its head, and where its values are."""

    name: str
    columns: int
    rows: int
    form: int
    kind: int
    at: list[Any] = field(default_factory=list)  # (rows, column, values)

    @classmethod
    def begun(cls, path: Path, where: str, numbers: Any, name: str) -> Columns:
        """A matrix from its head; ValueError where this is none."""
        columns, rows, form, kind = (int(n) for n in numbers)
        name = name.replace("\0", " ").strip()
        if not 1 <= columns <= MOST or not 1 <= abs(rows) <= MOST or kind not in (1, 2, 3, 4):
            expected = "the head of a matrix: columns, rows, form, type 1 to 4, name"
            raise wrong(path, where, expected, f"{columns} {rows} {form} {kind} {name!r}")
        return cls(name, columns, rows, form, kind)

    @property
    def bigmat(self) -> bool:
        """Whether rows of strings are words of their own."""
        return self.rows < 0

    @property
    def is_complex(self) -> bool:
        """Whether a value is two numbers."""
        return self.kind > 2

    def add(self, path: Path, where: str, column: int, first: int, numbers: Any) -> None:
        """Values from a row on."""
        count = len(numbers) // 2 if self.is_complex else len(numbers)
        if not 1 <= column <= self.columns or first < 1 or first + count - 1 > abs(self.rows):
            expected = f"columns 1 to {self.columns} and rows 1 to {abs(self.rows)} of {self.name}"
            raise wrong(path, where, expected, f"column {column}, rows {first} to {first + count - 1}")
        if not self.is_complex:
            self.at.append((np.arange(first - 1, first - 1 + count), np.full(count, column - 1), numbers))

    def finished(self) -> tuple[str, sparse.csr_matrix]:
        """Its name and what it holds; a diagonal given as a column is a square matrix."""
        none: list[Any] = [(np.zeros(0, int), np.zeros(0, int), np.zeros(0))]
        i, j, values = (np.concatenate(part) for part in zip(*(self.at or none), strict=True))
        shape = abs(self.rows), self.columns
        if self.form == DIAGONAL and self.columns == 1:
            j, shape = i, (abs(self.rows),) * 2
        return self.name, sparse.csr_matrix((values, (i, j)), shape=shape)


def read_op4(path: Path) -> Given:
    """All real matrices of an op4 file; it has no labels, its rows are those of the set that was written."""
    from fembeam.structures.readers.op4_text import of_lines

    data = path.read_bytes()
    first = {int.from_bytes(data[:4], "big"): ">", int.from_bytes(data[:4], "little"): "<"}
    order = next((first[size] for size in HEADS if size in first), None)
    found = of_lines(path, data) if order is None else _of_records(path, data, order)
    matrices = tuple(one.finished() for one in found if not one.is_complex)
    if not matrices:
        raise wrong(path, "as a whole", "a real matrix", f"{', '.join(one.name for one in found) or 'none'}")
    return Given(path, matrices)


def _records(path: Path, data: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    """(place, content) of Fortran's records, each between two counts of its bytes."""
    at = 0
    while at < len(data):
        size = int(np.frombuffer(data[at : at + 4].ljust(4, b"\0"), f"{order}i4")[0])
        if size < 0 or data[at + 4 + size : at + 8 + size] != data[at : at + 4]:
            got = f"{len(data) - at} bytes left, or another count behind it"
            raise wrong(path, f"byte {at}", f"a record of {size} bytes between two counts", got)
        yield at, data[at + 4 : at + 4 + size]
        at += 8 + size


def _of_records(path: Path, data: bytes, order: str) -> list[Columns]:
    """The matrices of a binary file."""
    matrices: list[Columns] = []
    current, word = None, 4
    for at, record in _records(path, data, order):
        where = f"byte {at}"
        if current is None:
            if len(record) not in HEADS:
                raise wrong(path, where, "the head of a matrix, 24 or 48 bytes", f"{len(record)} bytes")
            word = HEADS[len(record)]
            name = record[4 * word : 4 * word + 4] + record[5 * word : 5 * word + 4]
            head = np.frombuffer(record[: 4 * word], f"{order}i{word}")
            current = Columns.begun(path, where, head, name.decode("latin-1"))
            continue
        if len(record) < 3 * word:
            raise wrong(path, where, "column, row and words", f"{len(record)} bytes")
        column, row, words = (int(n) for n in np.frombuffer(record[: 3 * word], f"{order}i{word}"))
        body = record[3 * word :]
        if column > current.columns:  # behind the last one
            matrices.append(current)
            current = None
        elif len(body) != words * word:
            raise wrong(path, where, f"{words} words of column {column}", f"{len(body)} bytes")
        else:
            for first, numbers in _strings(path, where, body, row, current, order, word):
                current.add(path, where, column, first, numbers)
    if current is not None:
        raise wrong(path, f"byte {len(data)}", f"more columns of {current.name}, and one behind the last", "the end")
    return matrices


def _strings(path: Path, where: str, body: bytes, row: int, matrix: Columns, order: str, word: int) -> Iterator[Any]:
    """(first row, numbers) of the strings of a column; one of a dense column."""
    size = 8 if matrix.kind in (2, 4) else word
    if row > 0:
        yield row, np.frombuffer(body[: len(body) // size * size], f"{order}f{size}")
        return
    place, heads = 0, 2 if matrix.bigmat else 1
    while place < len(body):
        head = np.frombuffer(body[place : place + heads * word].ljust(heads * word, b"\0"), f"{order}i{word}")
        words, first = (int(head[0]), int(head[1])) if matrix.bigmat else divmod(int(head[0]), SHORT)
        begin = place + heads * word
        end = begin + (words - 1) * word
        if words < 2 or end > len(body) or (end - begin) % size:
            raise wrong(path, where, f"a string of values of {size} bytes", f"{words} words at row {first}")
        yield first, np.frombuffer(body[begin:end], f"{order}f{size}")
        place = end
