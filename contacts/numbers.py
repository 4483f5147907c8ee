"""Numbers from outside: arguments, checked, and columns of a text file, found by the names in its first line."""

from __future__ import annotations

import math
from collections.abc import Sequence
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
LARGEST_PARAMETER = 1e50
"""Largest size of a law's parameter; those that must be positive are at least its inverse: works stay floats."""
LARGEST_OF_POWERS = 1e100
"""The same of factors of powers of the indentation, N/m^p, and of a damping factor."""
LARGEST_EXPONENT = 100.0
"""Of a power law: beyond it a stop is rigid, and powers of small indentations vanish."""


def number(
    owner: object, name: str, low: float = 0.0, *, strict: bool = False, most: float = LARGEST_PARAMETER
) -> None:
    """Check one parameter of a law against its bounds and keep it as a float."""
    what = f"{name} of {type(owner).__name__}"
    object.__setattr__(owner, name, check_number(getattr(owner, name), what, low, strict=strict, most=most))


def check_number(value: Any, what: str, low: float = 0.0, *, strict: bool = False, most: float = math.inf) -> float:
    """One finite number as a float, not below its lower bound, or a clear error.

    Its size is ``most`` at most, and at least 1/most if it must be strictly above the bound.
    """
    result = _float(value, what)
    if not math.isfinite(result) or result < low or (strict and result == low):
        bound = f" and {'>' if strict else '>='} {low:g}" if low > -math.inf else ""
        raise ValueError(f"{what} must be finite{bound}, got {value!r}")
    if abs(result) > most or (strict and result < 1.0 / most):
        bound = f"at most {most:g}" if abs(result) > most else f"at least {1.0 / most:g}"
        raise ValueError(f"{what} must be {bound} in size, got {value!r}; give SI units")
    return result


def _has_switch(values: Any) -> bool:
    """Whether True or False stand in a list."""
    if not isinstance(values, (list, tuple)):
        return False
    kinds = set(map(type, values))
    nested = not kinds.isdisjoint((list, tuple))
    return not kinds.isdisjoint((bool, np.bool_)) or (nested and any(map(_has_switch, values)))


def reals(values: Any, what: str) -> NDArray[np.float64]:
    """Numbers of any shape as a new array of floats, nan and inf among them, or a clear error."""
    try:
        given = np.asarray(values)
    except ValueError:
        raise ValueError(f"{what} must be numbers in rows of equal length, got {values!r}") from None
    with np.errstate(over="ignore"):  # beyond the largest float: inf, which is refused where it may not be
        if _has_switch(values):  # NumPy takes True among numbers for 1
            given = np.asarray(values, dtype=object)
        if given.dtype.kind in "iuf":
            return given.astype(float)
        return np.array([_float(value, what) for value in given.ravel().tolist()]).reshape(given.shape)


def finite_row(values: Any, what: str, most: float, least: float = 0.0) -> NDArray[np.float64]:
    """A number or a row of finite ones as a new vector; sizes are at most ``most``, and 0 or at least ``least``."""
    found = np.atleast_1d(reals(values, what))
    if found.ndim != 1:
        raise ValueError(f"{what} must be a number or a row of numbers, got shape {found.shape}")
    size = np.abs(found)
    wrong = ~np.isfinite(found) | (size > most) | ((size < least) & (size > 0.0))
    if np.any(wrong):
        sizes = f"0 or from {least:g} to {most:g} in size" if least else f"at most {most:g} in size"
        raise ValueError(f"{what} must be finite, {sizes}, got {found[wrong][0]}; give SI units")
    return found


def _float(value: Any, what: str) -> float:
    """A real number as a float, inf beyond the largest; truth values, text, None, arrays are none."""
    if not isinstance(value, Real) or isinstance(value, bool):
        raise ValueError(f"{what} must be a number, got {value!r}")
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf  # type: ignore[operator]


def switch(owner: object, name: str) -> None:
    """Check one parameter of a law that is either on or off."""
    value = getattr(owner, name)
    if not isinstance(value, (bool, np.bool_)):
        raise ValueError(f"{name} of {type(owner).__name__} must be True or False, got {value!r}")


def check_restitution(value: Any, who: str, low_open: bool, why: str = "") -> float:
    """Check a nominal restitution against (0, 1] or [0, 1], and say why the range is what it is."""
    result = _float(value, f"restitution of {who}")
    least = 1.0 / LARGEST_PARAMETER if low_open else 0.0
    if not least <= result <= 1.0:
        span = "(0, 1]" if low_open and not 0.0 < result < least else f"[{least:g}, 1]"
        reason = f"; {why}" if why and low_open else ""
        raise ValueError(f"restitution of {who} must lie in {span}, got {value!r}{reason}")
    return result


def read_columns(path: str | Path, names: Sequence[str], optional: Sequence[str] = ()) -> dict[str, Vector]:
    """Columns of a text file by the names in its first line, separated by comma, semicolon, tab or blanks.

    A semicolon or tab wins over a comma, a comma over blanks. Empty lines and lines that begin with # are skipped,
    other columns ignored. Raises ValueError for a missing column (with those there), for an entry that is no number and
    for a line of more entries than names (with its line), and for a file that is no text.
    """
    try:
        lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise ValueError(f"{path} is no text file in UTF-8: {error}") from None
    rows = [(n, _cells(line)) for n, line in enumerate(lines, 1) if line.strip() and not line.lstrip().startswith("#")]
    header = [cell.lower() for cell in rows[0][1]] if rows else []
    missing = [name for name in names if name not in header]
    if missing:
        raise ValueError(f"{path}: no column {missing[0]!r}; its first line names {', '.join(header) or 'nothing'}")
    for n, cells in rows[1:]:
        if any(cells[len(header) :]):
            raise ValueError(f"{path}, line {n}: {len(cells)} entries, but the first line names {len(header)} columns; "
                             "write decimal points, not commas")  # fmt: skip
    wanted = [name for name in (*names, *optional) if name in header]
    places = [header.index(name) for name in wanted]
    values = [[_value(path, n, cells, place) for place in places] for n, cells in rows[1:]]
    table = np.array(values, dtype=float).reshape(len(values), len(wanted))
    return dict(zip(wanted, table.T.copy(), strict=True))


def _cells(line: str) -> list[str]:
    """Cells of a line; a semicolon or tab wins over a comma, so that decimal commas are seen."""
    mark = next((mark for mark in ";\t," if mark in line), None)
    return [part.strip().strip('"') for part in line.split(mark)]


def _value(path: str | Path, line: int, cells: list[str], place: int) -> float:
    """One number of the table."""
    try:
        return float(cells[place])
    except (IndexError, ValueError):
        got = repr(cells[place]) if place < len(cells) else "nothing"
        raise ValueError(f"{path}, line {line}: column {place + 1} must be a number, got {got}") from None
