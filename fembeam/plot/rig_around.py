"""Labels around places in a plane, where they cover neither lines and marks nor each other.

Every label has two hundred places to stand: at angles all around, near first. Each takes the one of least cost
in turn, then again knowing where all others are, until none moves. Everything is in inches from a corner of the figure.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
ANGLES, AWAY = 24, (0.07, 0.13, 0.2, 0.3, 0.42, 0.56, 0.72, 0.9)  # inches from a place to its label
FREE = 0.03  # inches kept free around a label
APART = np.array([0.12, FREE])  # inches between two labels: side by side they would read as one
CELL = 0.02  # inches, what points are counted in; lines are sampled twice as fine
ROUNDS = 5
FORBIDDEN, COVERED, CROSSED, FOREIGN = 1e3, 8.0, 4.0, 0.3  # costs; an inch away costs 1
RIGHT_ABOVE = np.array([0.8, 0.6])  # where labels rather stand
TIED = 0.3  # inches, from where on a line ties a label to its place


@dataclass(frozen=True)
class Ink:
    """How much is drawn in any rectangle, by sums over cells."""

    corner: Vector
    sums: NDArray[np.int64]  # (k + 1, m + 1), points below and left of a corner of cells

    @classmethod
    def of(cls, points: Vector, box: Vector) -> Ink:
        """Of points (n, 2) in a box ((x0, y0), (x1, y1))."""
        count = np.maximum(np.ceil((box[1] - box[0]) / CELL).astype(int), 1)
        edges = [low + CELL * np.arange(k + 1) for low, k in zip(box[0], count, strict=True)]
        cells = np.histogram2d(points[:, 0], points[:, 1], bins=edges)[0] > 0
        return cls(box[0], np.pad(cells.astype(np.int64), ((1, 0), (1, 0))).cumsum(0).cumsum(1))

    def inside(self, low: Vector, high: Vector) -> Vector:
        """Cells with something in them, in rectangles (n, 2), (n, 2)."""
        most = np.array(self.sums.shape) - 1
        (i, j), (k, m) = (
            np.clip(np.round((corner - self.corner) / CELL).astype(int), 0, most).T for corner in (low, high)
        )
        found: Vector = (self.sums[k, m] - self.sums[i, m] - self.sums[k, j] + self.sums[i, j]).astype(float)
        return found


def around(places: Vector, sizes: Vector, drawn: Vector, box: Vector) -> tuple[Vector, bool]:
    """Centres (n, 2) of labels of these sizes about their places, and whether all are free of each other and inside.

    Parameters
    ----------
    places, sizes : (n, 2). drawn : (k, 2), points of what is drawn. box : ((x0, y0), (x1, y1)), that holds the labels.

    Examples
    --------
    >>> box = np.array([[0.0, 0.0], [4.0, 3.0]])
    >>> centres, free = around(np.array([[2.0, 1.5], [2.1, 1.5]]), np.full((2, 2), 0.5), np.empty((0, 2)), box)
    >>> free, bool(np.abs(centres[1] - centres[0]).max() >= 0.5)
    (True, True)
    """
    ink = Ink.of(drawn, box)
    offered = [_offered(place, size) for place, size in zip(places, sizes, strict=True)]
    # what others do not change
    alone = [_alone(ink, centres, places, i, sizes[i], box) + cost for i, (centres, cost) in enumerate(offered)]
    centres = np.array([where[np.argmin(cost)] for (where, _), cost in zip(offered, alone, strict=True)]).reshape(-1, 2)
    placed = np.zeros(len(places), dtype=bool)
    largest_first = np.argsort(-sizes.prod(axis=1), kind="stable").tolist()
    for _ in range(ROUNDS):
        before = centres.copy()
        for i in largest_first:
            others = np.flatnonzero(placed & (np.arange(len(places)) != i))
            cost = alone[i] + _beside(offered[i][0], i, places, sizes, centres, others)
            centres[i], placed[i] = offered[i][0][np.argmin(cost)], True
        if np.array_equal(before, centres):
            break
    everyone = np.arange(len(places))
    lie = [_overlaps(centres[[i]], i, sizes, centres, everyone[everyone != i]).any() for i in range(len(places))]
    inside = np.all((centres - sizes / 2 >= box[0] - 1e-9) & (centres + sizes / 2 <= box[1] + 1e-9))
    return centres, bool(inside) and not any(lie)


def _offered(place: Vector, size: Vector) -> tuple[Vector, Vector]:
    """Centres (c, 2) at which a label may stand, and what they cost by themselves."""
    angle = 2 * np.pi * np.arange(ANGLES) / ANGLES
    ways = np.column_stack([np.cos(angle), np.sin(angle)])
    edge = np.clip(np.sqrt(2) * ways, -1.0, 1.0) * size / 2  # the label slides about its place along its own edges
    centres = place + edge + np.array(AWAY)[:, None, None] * ways
    cost = np.array(AWAY)[:, None] + 0.15 * (1.0 - ways @ RIGHT_ABOVE)
    return centres.reshape(-1, 2), cost.ravel()


def _alone(ink: Ink, centres: Vector, places: Vector, i: int, size: Vector, box: Vector) -> Vector:
    """What it costs to cover lines, to leave the box, to stand nearer to another place than to one's own."""
    half = size / 2
    out = np.maximum(0.0, np.maximum(box[0] - (centres - half), centres + half - box[1])).sum(axis=1)
    away = np.linalg.norm(np.maximum(np.abs(centres[:, None] - places) - half, 0.0), axis=2)  # (c, n)
    mine = away[:, i]
    nearest = np.where(np.arange(len(places)) == i, np.inf, away).min(axis=1, initial=np.inf)
    covered = CELL * ink.inside(centres - half - FREE, centres + half + FREE)
    return FORBIDDEN * out + COVERED * covered + FOREIGN * (nearest < mine) + FORBIDDEN * (nearest == 0.0)


def _overlaps(centres: Vector, i: int, sizes: Vector, placed: Vector, others: NDArray[np.int64]) -> Any:
    """(c, o): whether label i at each centre lies on others."""
    apart = np.abs(centres[:, None] - placed[others])
    return (apart < (sizes[i] + sizes[others]) / 2 + APART).all(axis=2)


def _beside(
    centres: Vector, i: int, places: Vector, sizes: Vector, placed: Vector, others: NDArray[np.int64]
) -> Vector:
    """What it costs to lie on other labels, to be crossed by their ties, or to cross them by one's own."""
    share = np.linspace(0.0, 1.0, 8)[:, None]
    theirs = places[others, None] + share * (placed[others] - places[others])[:, None]  # (o, s, 2)
    mine = places[i] + share * (centres - places[i])[:, None]  # (c, s, 2)
    on_me = (np.abs(theirs[None] - centres[:, None, None]) < sizes[i] / 2 + FREE).all(axis=3).any(axis=2)
    on_them = (np.abs(mine[:, None] - placed[others][None, :, None]) < sizes[others][:, None] / 2).all(axis=3)
    lies = _overlaps(centres, i, sizes, placed, others)
    return FORBIDDEN * lies.sum(axis=1) + CROSSED * (on_me.sum(axis=1) + on_them.any(axis=2).sum(axis=1))


def inked(lines: Any, per_inch: float) -> Vector:
    """Points (k, 2) in inches of matplotlib's lines and their marks."""
    found = [np.empty((0, 2))]
    for line in lines:
        points = line.get_transform().transform(line.get_xydata()) / per_inch
        points = points[np.isfinite(points).all(axis=1)]
        if line.get_linestyle() not in ("None", "", " ") and len(points) > 1:
            steps = np.maximum(np.ceil(2 * np.linalg.norm(np.diff(points, axis=0), axis=1) / CELL), 1).astype(int)
            found += [np.linspace(a, b, n + 1) for a, b, n in zip(points[:-1], points[1:], steps, strict=True)]
        if line.get_marker() not in ("None", "", " ", None):
            disk = np.arange(-line.get_markersize() / 144, line.get_markersize() / 144, CELL / 2)
            square = np.stack(np.meshgrid(disk, disk), axis=-1).reshape(-1, 2)
            found += [point + square for point in points]
    return np.vstack(found)
