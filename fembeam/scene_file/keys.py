"""What a table of a scene file may hold, read from a constructor's signature: keys, types, and their names in messages.

The values of TOML are few (whole numbers, numbers, true and false, text, lists); annotations say which one is meant.
The check itself and its messages are in `tables.TableReader.check_keys`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin

import numpy as np
from numpy.typing import NDArray

Constructors = Mapping[str, Callable[..., Any]]

ARRAYS = np.ndarray, get_origin(NDArray[np.float64])  # from numpy 2.5 on, Python 3.12, an alias is not its meaning
UNSEEN = {
    "Model": Any,
    "Scene": Any,
    "Executor": Any,
    "Sequence": Sequence,
    "Iterable": Iterable,
}  # names in annotations that exist only for type checkers


def parameters(constructor: Callable[..., Any]) -> dict[str, inspect.Parameter]:
    """Keys of a table: what can be given by position, and the class's own options where **options are taken."""
    signature = inspect.signature(constructor, eval_str=True, locals=UNSEEN).parameters
    plain = [p for p in signature.values() if p.kind is p.POSITIONAL_OR_KEYWORD]
    if any(p.kind is p.VAR_KEYWORD for p in signature.values()):
        options = inspect.signature(constructor.__self__, eval_str=True).parameters.values()  # type: ignore[attr-defined]
        plain += [p for p in options if p.default is not p.empty]
    return {p.name: p for p in plain if p.name != "self"}


def required(parameters: Mapping[str, inspect.Parameter]) -> list[str]:
    """Keys without a default."""
    return [key for key, parameter in parameters.items() if parameter.default is inspect.Parameter.empty]


def fits(value: Any, hint: Any) -> bool:
    """Whether a TOML value has the annotated type; whole numbers pass as numbers, true and false do not."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        return any(fits(value, option) for option in inner)
    if origin is Literal:
        return value in inner
    if hint in (float, int):
        too_long = isinstance(value, int) and value.bit_length() > 1000
        return isinstance(value, (int, hint)) and not isinstance(value, bool) and not too_long
    if hint in (bool, str):
        return isinstance(value, hint)
    if hint is Path:
        return isinstance(value, str)
    entry = entry_type(hint)
    if entry is None or not isinstance(value, list):
        return False
    fixed = origin is tuple and Ellipsis not in inner
    return all(fits(item, entry) for item in value) and (not fixed or len(value) == len(inner))


def entry_type(hint: Any) -> Any:
    """Type of the entries of an annotated sequence; None when it is none."""
    origin = get_origin(hint)
    if origin in ARRAYS:
        return float
    if origin in (list, tuple, Sequence, Iterable) and get_args(hint):
        return float if float in get_args(hint) else get_args(hint)[0]  # (number of a body, place) are numbers
    return None


def wanted(hint: Any) -> str:
    """The annotated type as text."""
    return " or ".join(dict.fromkeys(_words(hint)))


def _words(hint: Any) -> list[str]:
    """The words of each type an annotation allows."""
    words = {float: "a number", int: "a whole number", bool: "true or false", str: "text", Path: "text"}
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        return [word for option in inner if option is not NoneType for word in _words(option)]
    if origin is Literal:
        return [repr(option) for option in inner]
    if hint in words:
        return [words[hint]]
    entry = entry_type(hint)
    if entry is None:
        return []
    if get_origin(entry) is Literal:
        return [f"a list of {', '.join(map(repr, get_args(entry)))}"]
    count = f"{len(inner)} " if origin is tuple and Ellipsis not in inner else ""
    return [f"a list of {count}{'whole ' if entry is int else ''}numbers"]


def converted(value: Any, hint: Any) -> Any:
    """Whole numbers as floats where a number is wanted, lists as tuples where a tuple is."""
    options = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
    if isinstance(value, list):
        pair = any(get_origin(option) is tuple for option in options)
        return tuple(value) if pair else value
    if isinstance(value, int) and not isinstance(value, bool) and float in options and int not in options:
        return float(value)
    return value


def nearest(key: Any, valid: Sequence[str] | Constructors) -> str:
    """A hint at the nearest valid name."""
    close = get_close_matches(str(key).lower(), list(valid), n=1, cutoff=0.5)
    return f"; did you mean {close[0]!r}?" if close else ""


def listed(names: Sequence[str] | Constructors) -> str:
    """Names for a message."""
    return ", ".join(names)


def shown(value: Any) -> str:
    """A value as the file would write it, shortened."""
    text = {True: "true", False: "false"}[value] if isinstance(value, bool) else repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
