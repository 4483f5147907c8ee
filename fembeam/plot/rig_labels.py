"""Labels in rows that do not overlap, each tied to its place by a line that crosses no other."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
SIZE = 7.0  # points
LINE = 1.25 * SIZE / 72  # inches from one line of text to the next
TIE = 0.05  # inches kept free for a line between labels
BETWEEN = 0.14  # inches between two labels
MOST_ROWS = 3


@lru_cache(maxsize=4096)
def extent(text: str, size: float = SIZE) -> tuple[float, float]:
    r"""Width and height of a text in inches.

    Examples
    --------
    >>> one, two = extent("valve"), extent("valve\nvalve")
    >>> one[0] == two[0], round(two[1] / one[1], 6)
    (True, 2.0)
    """
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    lines, font = text.split("\n"), FontProperties(size=size)
    widths = [text_to_path.get_text_width_height_descent(line, font, ismath=False)[0] for line in lines]
    return 1.04 * max(widths) / 72, LINE * size / SIZE * len(lines)


def spread(x: Vector, widths: Vector, low: float, high: float, weights: Vector | None = None) -> Vector | None:
    """Places nearest to x (sorted) at which intervals of these widths do not overlap, in [low, high]; None: no room.

    min Σ g_i (x'_i - x_i)² with weights g, x'_{i+1} - x'_i ≥ (w_i + w_{i+1})/2: a monotone regression with
    the widths taken off.

    Examples
    --------
    >>> spread(np.array([1.0, 1.0, 5.0]), np.ones(3), 0.0, 10.0).tolist()
    [0.5, 1.5, 5.0]
    >>> spread(np.array([1.0, 1.0]), np.ones(2), 0.0, 1.5) is None
    True
    """
    if not len(x):
        return x
    taken = np.concatenate([[0.0], np.cumsum((widths[1:] + widths[:-1]) / 2)])
    first, last = low + widths[0] / 2, high - widths[-1] / 2 - taken[-1]
    if last < first - 1e-9:
        return None
    blocks: list[list[float]] = []  # value, weight and count of those that share it
    shares = np.ones(len(x)) if weights is None else weights
    for value, weight in zip((x - taken).tolist(), shares.tolist(), strict=True):
        blocks.append([value, weight, 1.0])
        while len(blocks) > 1 and blocks[-2][0] >= blocks[-1][0]:
            (one, w, n), (other, v, m) = blocks.pop(), blocks.pop()
            blocks.append([(w * one + v * other) / (w + v), w + v, n + m])
    free = np.concatenate([np.full(int(count), value) for value, _, count in blocks])
    return np.clip(free, first, max(first, last)) + taken


@dataclass(frozen=True)
class Placed:
    """Where a label and its line go: `path` (k, 2) in inches, η outwards from the first row; the text at its end."""

    text: str
    path: Vector
    upright: bool = False


def rows_of(x: Vector, texts: list[str], low: float, high: float) -> tuple[list[Placed], float]:
    """Labels at places x (sorted) in as few rows as hold them, else upright in one; and the depth of all rows.

    An empty text takes no place but keeps a way free through all rows. Where nothing fits, later labels are left out.
    """
    for rows in range(1, MOST_ROWS + 1):
        found = _in_rows(x, texts, rows, low, high)
        if found is not None:
            return found
    return _upright(x, texts, low, high)


def _in_rows(x: Vector, texts: list[str], rows: int, low: float, high: float) -> tuple[list[Placed], float] | None:
    """Labels in so many rows by turns; None where they do not fit."""
    speaking = [i for i, text in enumerate(texts) if text]
    row = np.full(len(texts), rows)
    row[speaking] = np.arange(len(speaking)) % rows
    at, paths, depth = np.array(x, dtype=float), [[(place, 0.0)] for place in x], 0.0
    for r in range(rows):
        here = np.flatnonzero(row >= r)
        sizes = [extent(texts[i]) if row[i] == r else (TIE, 0.0) for i in here]
        widths = np.array(
            [width + (BETWEEN if row[i] == r else 0.0) for i, (width, _) in zip(here, sizes, strict=True)]
        )
        places = spread(at[here], widths, low, high)
        if places is None:
            return None
        height = max((h for _, h in sizes), default=0.0)
        start, at[here] = depth + 0.12, places
        for i in here.tolist():
            paths[i].append((at[i], start))
            paths[i] += [(at[i], start + height)] if row[i] > r else []
        depth = start + height
    return [Placed(text, np.array(path)) for text, path in zip(texts, paths, strict=True)], depth


def _upright(x: Vector, texts: list[str], low: float, high: float) -> tuple[list[Placed], float]:
    """First lines of the labels, turned by 90 degrees, in one row; as many as fit."""
    lines = [text.partition("\n")[0] for text in texts]
    kept = list(range(len(lines)))
    most = int((high - low) / LINE)
    if len(kept) > most:
        kept = sorted({round(i) for i in np.linspace(0, len(lines) - 1, most).tolist()})
    places = spread(x[kept], np.full(len(kept), LINE), low, high)
    assert places is not None
    depth = 0.25 + max((extent(lines[i])[0] for i in kept), default=0.0)
    found = [Placed("", np.array([(place, 0.0), (place, depth)])) for place in x]
    for i, place in zip(kept, places.tolist(), strict=True):
        found[i] = Placed(lines[i], np.array([(x[i], 0.0), (place, 0.25)]), upright=True)
    return found, depth
