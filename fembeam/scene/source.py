"""The text of a scene file: parsed with overrides, searched for lines, saved with runs so that they can be repeated."""

from __future__ import annotations

import re
import tempfile
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

from solvers.problem import counted

TABLE = re.compile(r"\[\[?(\w+)(?:\.(\w+))?\]\]?(?: number (\d+))?(.*)")  # what messages call tables
HEADER = re.compile(r"^\s*\[\[?\s*([\w.\"' -]+?)\s*\]")


@dataclass(frozen=True)
class Source:
    r"""A scene file as it was given.

    Parameters
    ----------
    path : of the file; what it names is relative to its folder.
    text : TOML.
    overrides : "table.key=value", applied in turn.
    files : contents of the files that it names, by the name in the text.
    of_run : whether it comes from a saved run, which reads no file outside its folder unless asked for.

    Examples
    --------
    >>> Source(Path("a.toml"), "[simulate]\ndt = 1e-3", ("simulate.dt=1e-4", "simulate.duration=2")).tables()
    {'simulate': {'dt': 0.0001, 'duration': 2}}
    """

    path: Path
    text: str
    overrides: tuple[str, ...] = ()
    files: Mapping[str, bytes] = field(default_factory=dict)
    of_run: bool = False

    def tables(self) -> dict[str, Any]:
        """The parsed file with its overrides; ValueError says what is wrong, and in which line."""
        try:
            tables = tomllib.loads(self.text)
        except (ValueError, RecursionError) as error:
            found = re.search(r"at line (\d+)", str(error))
            raise ValueError(f"{self.path}{':' + found[1] if found else ''}: is not valid TOML: {error}") from None
        for override in self.overrides:
            _override(tables, override)
        return tables

    def place(self, where: str, message: str = "") -> str:
        r"""`path:line: where`, as editors like it; the line is that of the table, or of the key the message names.

        A value that an override gave is in no line: it is named in its place. Overrides of the same table, and all
        where the scene as a whole is wrong, are named beside the line.

        Examples
        --------
        >>> Source(Path("a.toml"), "[[masses]]\nz = 1\nmas = 2").place("[[masses]] number 1", "unknown key 'mas'")
        'a.toml:3: [[masses]] number 1'
        >>> Source(Path("a.toml"), "[[stops]]\nkind = 1\n[base.x]\nkind = 2").place("[base.x]", "kind must be")
        'a.toml:4: [base.x]'
        >>> Source(Path("a.toml"), "[[masses]]\nz = 1", ("masses.0.z=-1",)).place("[[masses]] number 1", "z must lie")
        'a.toml with --set masses.0.z=-1: [[masses]] number 1'
        """
        for override in reversed(self.overrides):
            if _gave(override, where, message):
                return f"{self.path} with --set {override}: {where}"
        table = TABLE.match(where)
        beside = [one for one in self.overrides if table is None or _steps(one.partition("=")[0])[0] == table[1]]
        line = _line(self.text.splitlines(), where, message)
        said = where + "".join(f" with --set {override}" for override in beside)
        return f"{self.path}:{line}: {said}" if line else f"{self.path}: {said}"

    @contextmanager
    def unpacked(self) -> Iterator[dict[str, Path]]:
        """Where the files that it names lie: those it carries, for a while."""
        with tempfile.TemporaryDirectory(prefix="fembeam-") as folder:
            places = {name: Path(folder, *_inside(Path(name))) for name in self.files}
            for name, place in places.items():
                place.parent.mkdir(parents=True, exist_ok=True)
                place.write_bytes(self.files[name])
            yield places


def _inside(path: Path) -> Iterator[str]:
    """The parts of a path that lead nowhere else: files that lie beside each other stay so, within one folder."""
    yield from ("up" if part == ".." else part for part in path.parts if part != path.anchor)


def _steps(key: str) -> list[str]:
    """Names and numbers that lead to a value: `stops[0].gap` is stops, 0, gap."""
    return [inside or part for inside, part in re.findall(r"\[\s*([^\]]+?)\s*\]|([^.\[\]\s]+)", key)]


def _gave(override: str, where: str, message: str) -> bool:
    """Whether an override gave what a message is about: the table is its own, the key among the first words."""
    first, *steps = _steps(override.partition("=")[0])
    table = TABLE.match(where) or re.search(r"(\w+)()\[(\d+)\]()", message)  # the scene says masses[0]
    words = re.findall(r"\w+", message)[:4]
    if table is None:
        return first in words  # of the file: a table that is unknown
    shift = 1 if where.startswith("[[") else 0
    if steps and steps[0].isdecimal() and table[3] and int(steps.pop(0)) + shift != int(table[3]):
        return False
    return first == table[1] and (not steps or steps[-1] in [*words, *re.findall(r"\w+", f"{table[2]} {table[4]}")])


def _override(tables: dict[str, Any], text: str) -> None:
    """Set one value: `stops[0].gap=1e-3`, `stops.0.gap = 1e-3`, `stops[valve].gap=0`; missing tables are made."""
    key, equals, value = text.partition("=")
    path = _steps(key)
    if not (equals and path):
        raise ValueError(f"--set {text}: write table.key=value, such as simulate.duration=10 or stops[0].gap=1e-3")
    try:
        (new,) = tomllib.loads(f"x = {value}").values()  # ValueError of more lines than one
    except (ValueError, RecursionError):
        new = value.strip()  # text needs no quotes here
    item: Any = tables
    for i, (name, after) in enumerate(pairwise([*path, ""])):
        if isinstance(item, list):
            called = [number for number, one in enumerate(item) if isinstance(one, dict) and one.get("name") == name]
            if name.isdecimal() and int(name) < len(item):  # a number, whatever parts are called
                called = [int(name)]
            if not called:
                has = f"{'.'.join(path[:i])} has {counted(len(item), 'item')}"
                raise ValueError(f"--set {text}: {has}, counted from 0, none of the name {name!r}")
            name = called[0]  # type: ignore[assignment]
        elif not isinstance(item, dict):
            raise ValueError(f"--set {text}: {'.'.join(path[:i])} is no table")
        if not after:
            item[name] = new
        elif isinstance(item, list):
            item = item[name]  # type: ignore[call-overload]
        else:
            item = item.setdefault(name, {})


def _line(lines: list[str], where: str, message: str) -> int:
    """Number of the line that is meant, 0 when unknown."""
    named = TABLE.match(where)
    inside = re.search(r"(\w+)\[(\d+)\]", message)
    if not named and inside:  # the scene says masses[0]
        found = _table(lines, inside[1], int(inside[2]) + 1)
    else:
        found = _table(lines, named[1], int(named[3] or 1)) if named else range(len(lines))
        if named and named[2]:  # [base.x]
            found = _table(lines, f"{named[1]}.{named[2]}", int(named[3] or 1)) or found
    if not found:
        return 0
    line = found.start
    for word in re.findall(r"\w+", named[4]) if named else []:
        line = _key(lines, word, range(line, found.stop), line)
    hits = (_key(lines, word, range(line, found.stop), -1) for word in re.findall(r"\w+", message)[:4])
    return 1 + next((hit for hit in hits if hit >= 0), line if named or inside else -1)


def _table(lines: list[str], name: str, number: int) -> range:
    """Lines of the number-th table of a name, its sub-tables included."""
    heads = [(i, m[1].strip("\"'")) for i, line in enumerate(lines) if (m := HEADER.match(line))]
    starts = [i for i, head in heads if head == name] or [i for i, head in heads if head.startswith(f"{name}.")]
    if number > len(starts):
        line = _key(lines, name, range(len(lines)), -1)
        return range(line, line + 1) if line >= 0 else range(0)
    start = starts[number - 1]
    ends = [i for i, head in heads if i > start and not head.startswith(f"{name}.")] + starts[number:]
    return range(start, min(ends, default=len(lines)))


def _key(lines: list[str], word: str, among: range, otherwise: int) -> int:
    """The first of some lines that sets a key or opens the table of that name."""
    sets = re.compile(rf"(?:^|[{{,\s\"'])(?<!\w){re.escape(word)}[\"']?\s*=|^\s*\[+(?:.*\.)?{re.escape(word)}\s*[\].]")
    return next((i for i in among if sets.search(lines[i].split("#")[0])), otherwise)
