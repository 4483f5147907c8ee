"""What differs between two objects, read from their texts, by the names of their parts."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

LONGEST = 60  # characters of a value in a message
MOST = 4  # changes that a message lists


def changes(there: str, here: str, name: str = "") -> str:
    """The parts of two `repr` that differ, each with its value there and here; "" where none does.

    Examples
    --------
    >>> changes("Stop(z=0.2, law=Hertz(stiffness=1e8))", "Stop(z=0.2, law=Hertz(stiffness=2e8))", "stops[0]")
    'stops[0].law.stiffness is 100000000.0 there and 200000000.0 here'
    >>> changes("(1, 2)", "(1,)", "modes")
    'modes is (1, 2) there and (1,) here'
    """
    try:
        found = list(_changes(_parsed(there), _parsed(here), name))
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        found = [] if there == here else [_said(name, there, here)]
    more = [f"{len(found) - MOST} more"] if len(found) > MOST else []
    return "; ".join([*found[:MOST], *more])


def _parsed(text: str) -> ast.expr:
    """A text as Python reads it; what it cannot read stands in <>, and is taken as a word."""
    return ast.parse(re.sub(r"<[^<>]*>", lambda one: repr(one[0]), text), mode="eval").body


def _changes(there: ast.expr, here: ast.expr, name: str) -> Iterator[str]:
    """The smallest parts that differ."""
    mine, theirs = _parts(here), _parts(there)
    if mine and theirs and _kind(here) == _kind(there) and list(mine) == list(theirs):
        for key, part in mine.items():
            yield from _changes(theirs[key], part, f"{name}{key}".removeprefix("."))
    elif ast.dump(there) != ast.dump(here):
        yield _said(name, ast.unparse(there), ast.unparse(here))


def _kind(node: ast.expr) -> str:
    """What has the parts: the name of its class."""
    return ast.unparse(node.func) if isinstance(node, ast.Call) else type(node).__name__


def _parts(node: ast.expr) -> dict[str, ast.expr]:
    """The parts of an object, list or table, as one writes their names; none of a plain value."""
    if isinstance(node, ast.Call):
        return {f"[{i}]": one for i, one in enumerate(node.args)} | {f".{one.arg}": one.value for one in node.keywords}
    if isinstance(node, ast.Dict):
        keys = (ast.unparse(key).strip("'") for key in node.keys if key)
        return {f".{key}": one for key, one in zip(keys, node.values, strict=True)}
    return {f"[{i}]": one for i, one in enumerate(node.elts)} if isinstance(node, (ast.Tuple, ast.List)) else {}


def _said(name: str, there: str, here: str) -> str:
    """One change as a sentence."""
    return f"{name} is {_short(there)} there and {_short(here)} here".lstrip()


def _short(text: str) -> str:
    """A text shortened in its middle."""
    return text if len(text) <= LONGEST else f"{text[: LONGEST // 2]}…{text[-LONGEST // 2 :]}"
