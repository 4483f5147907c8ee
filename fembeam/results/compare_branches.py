"""Two branches side by side at equal values of their parameter: each has orbits where its own steps led."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

Orbits = Sequence[Mapping[str, Any]]
LEFT_OUT = "residual", "its angle"  # of the solver; and what jumps between π and -π


def at_equal_parameters(first: Orbits, second: Orbits) -> tuple[dict[str, Any], dict[str, Any]]:
    """Rows of both by the parameter of the first, the second interpolated linearly; their folds if these differ.

    Branches that fold are compared between one fold and the next. What no orbit of the second has on both sides, or no
    two neighbours alike (a count of impacts), is missing there.

    Examples
    --------
    >>> coarse = [{"omega": 1.0, "peak": 2.0}, {"omega": 3.0, "peak": 6.0}]
    >>> at_equal_parameters([{"omega": 2.0, "peak": 4.5}], coarse)
    ({'at omega = 2': {'peak': 4.5}}, {'at omega = 2': {'peak': 4.0}})
    """
    name = next(iter(first[0]))
    mine, theirs = _stretches(first, name), _stretches(second, name) if name in second[0] else []
    if len(mine) != len(theirs):
        return {f"folds along {name}": len(mine) - 1}, {f"folds along {name}": len(theirs) - 1} if theirs else {}
    found: tuple[dict[str, Any], dict[str, Any]] = {}, {}
    for i, (own, other) in enumerate(zip(mine, theirs, strict=True)):
        after = f", after {i} folds," if i else ""
        for row in own:
            at = f"at {name} = {row[name]:.9g}{after}"
            found[0][at] = {key: value for key, value in row.items() if key not in (name, *LEFT_OUT)}
            found[1][at] = _interpolated(other, name, row[name])
    return found


def _stretches(orbits: Orbits, name: str) -> list[Orbits]:
    """A branch cut at its folds, each stretch with its parameter ascending; it begins at its lower end."""
    rows = list(orbits) if orbits[0][name] <= orbits[-1][name] else list(orbits)[::-1]
    found = [[rows[0]]]
    for before, row in pairwise(rows):
        ways = [after[name] - one[name] for one, after in pairwise(found[-1])]
        if ways and ways[-1] * (row[name] - before[name]) < 0:
            found.append([before])
        found[-1].append(row)
    return [sorted(one, key=lambda row: row[name]) for one in found]


def _interpolated(rows: Orbits, name: str, at: float) -> dict[str, Any]:
    """Numbers of a branch at a parameter between two of its orbits; empty beyond them."""
    for low, high in pairwise(rows) if len(rows) > 1 else [(rows[0], rows[0])]:
        if low[name] <= at <= high[name]:
            width = high[name] - low[name]
            share = (at - low[name]) / width if width else 0.0
            between = {key: _between(low[key], high[key], share) for key in low if key not in (name, *LEFT_OUT)}
            return {key: value for key, value in between.items() if value is not None}
    return {}


def _between(low: Any, high: Any, share: float) -> Any:
    """A number between two; of what is no measure (counts, yes and no, words) the one that both have, else None."""
    if share in (0.0, 1.0) or low == high:
        return high if share == 1.0 else low
    return low + share * (high - low) if isinstance(low, float) and isinstance(high, float) else None
