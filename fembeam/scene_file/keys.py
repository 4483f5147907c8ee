"""What a table of a scene file may hold, read from a constructor's signature: keys, types, and their names in messages.

The values of TOML are few (whole numbers, numbers, true and false, text, lists); annotations say which one is meant.
The check itself and its messages are in `tables.TableReader.check_keys`.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin

import numpy as np
from numpy.typing import NDArray

Constructors = Mapping[str, Callable[..., Any]]

ARRAYS = np.ndarray, get_origin(NDArray[np.float64])  # from numpy 2.5 on, Python 3.12, an alias is not its meaning
SIMPLE = {float: "a number", int: "a whole number", bool: "true or false", str: "text", Path: "text"}
UNSEEN = {"Model": Any}  # a name in annotations that exists only for type checkers


def parameters(constructor: Callable[..., Any]) -> dict[str, inspect.Parameter]:
    """Keys of a table: what can be given by position, a name, and the class's own options where **options are taken."""
    signature = inspect.signature(constructor, eval_str=True, locals=UNSEEN).parameters
    plain = [p for p in signature.values() if p.kind is p.POSITIONAL_OR_KEYWORD or p.name in ("name", "direction")]
    if any(p.kind is p.VAR_KEYWORD for p in signature.values()):
        options = inspect.signature(constructor.__self__, eval_str=True).parameters.values()  # type: ignore[attr-defined]
        plain += [p for p in options if p.default is not p.empty]
    return {p.name: p for p in plain if p.name != "self"}


def required(parameters: Mapping[str, inspect.Parameter]) -> list[str]:
    """Keys without a default."""
    return [key for key, parameter in parameters.items() if parameter.default is inspect.Parameter.empty]


def options(hint: Any) -> list[Any]:
    """The types that an annotation allows, None left out: TOML has none."""
    if get_origin(hint) not in (Union, UnionType):
        return [] if hint is NoneType else [hint]
    return [one for option in get_args(hint) for one in options(option)]


def takes_list(parameter: inspect.Parameter) -> bool:
    """Whether a key allows a list beside a single thing."""
    return any(get_origin(option) is Sequence for option in options(parameter.annotation))


def entries_of(hint: Any) -> tuple[Any, int | None]:
    """Type of the entries of an annotated sequence and their number, None for any; None and None for no sequence."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin in ARRAYS:
        return float, None
    if origin not in (list, tuple, Sequence, Iterable) or not inner:
        return None, None
    count = len(inner) if origin is tuple and Ellipsis not in inner else None
    return float if float in inner else inner[0], count  # (number of a body, place) are numbers


def fits(value: Any, hint: Any) -> bool:
    """Whether a TOML value has the annotated type; whole numbers pass as numbers, true and false do not."""
    return any(_fits(value, option) for option in options(hint))


def _fits(value: Any, hint: Any) -> bool:
    """Whether a value has one of the types allowed."""
    if get_origin(hint) is Literal:
        return value in get_args(hint)
    if hint in (float, int):
        too_long = isinstance(value, int) and value.bit_length() > 1000
        return isinstance(value, (int, hint)) and not isinstance(value, bool) and not too_long
    if hint in SIMPLE:
        return isinstance(value, str if hint is Path else hint)
    if get_origin(hint) is Mapping:
        return isinstance(value, dict) and all(fits(one, get_args(hint)[1]) for one in value.values())
    entry, count = entries_of(hint)
    right = entry is not None and isinstance(value, list) and len(value) == (len(value) if count is None else count)
    return right and all(fits(item, entry) for item in value)


def wanted(hint: Any) -> str:
    """The annotated type as text."""
    return " or ".join(dict.fromkeys(word for option in options(hint) for word in _words(option)))


def _words(hint: Any) -> list[str]:
    """The words of one of the types allowed."""
    if get_origin(hint) is Literal:
        return [repr(option) for option in get_args(hint)]
    if hint in SIMPLE:
        return [SIMPLE[hint]]
    if get_origin(hint) is Mapping:
        return [f"a table of names, each with {wanted(get_args(hint)[1])}"]
    entry, count = entries_of(hint)
    number = "" if count is None else f"{count} "
    if get_origin(entry) is Literal:
        return [f"a list of {', '.join(map(repr, get_args(entry)))}"]
    if str in options(entry) and float not in options(entry):
        return [f"a list of {number}names" + (" or vectors" if len(options(entry)) > 1 else "")]
    kind = "lists of " if entries_of(entry)[0] is not None else "whole " if entry is int else ""
    return [] if entry is None else [f"a list of {number}{kind}numbers"]


def converted(value: Any, hint: Any) -> Any:
    """Whole numbers as floats where a number is wanted, lists as tuples where a tuple is."""
    allowed = options(hint)
    if isinstance(value, list) and any(get_origin(option) is tuple for option in allowed):
        return tuple(value)
    whole = isinstance(value, int) and not isinstance(value, bool)
    return float(value) if whole and float in allowed and int not in allowed else value


def angular(key: str, valid: Sequence[str]) -> str:
    """A hint at the key of a frequency in rad/s, for one that seems to be in hertz.

    Examples
    --------
    >>> angular("frequency_hz", ["kind", "amplitude", "omega", "phase"])
    '; frequencies are in rad/s, 2π times hertz: omega'
    """
    asked = re.search(r"freq|hz|hertz|^f\d?$", key.lower())
    names = [name for name in valid if name.startswith("omega") or name == "band"]
    return f"; frequencies are in rad/s, 2π times hertz: {' or '.join(names)}" if asked and names else ""


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
