"""The field's symbols for supports, masses, springs, dashpots, stops and loads, drawn outwards from a point of a beam.

Every symbol is drawn in inches in its own frame: the origin where it meets the beam, η outwards, ξ along the beam. A
`Pen` knows where that is in a figure, so that symbols stand alike on a straight beam and on any member.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam.plot.style import BLUE, GREEN, GREY, ORANGE, RED

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Vector = NDArray[np.float64]
BLACK = "#222222"
COLOURS = {"stop": BLACK, "element": BLUE, "load": RED, "mass": GREY, "impactor": ORANGE, "motion": GREEN}


@dataclass(frozen=True)
class Pen:
    """Draws in inches about a point of an axes.

    Attributes
    ----------
    x, y : the point, in data. scale : (2,) data per inch. outward : (2,) unit vector η, in inches of the figure.
    size : of symbols, 1 where there is room. name : the artists' gid.
    """

    axis: Axes
    x: float
    y: float
    scale: tuple[float, float]
    outward: tuple[float, float] = (0.0, 1.0)
    size: float = 1.0
    name: str = ""

    def at(self, points: ArrayLike) -> Vector:
        """Data (2, k) of points (k, 2) in inches."""
        xi, eta = np.atleast_2d(np.asarray(points, dtype=float)).T
        along = self.outward[1], -self.outward[0]
        return np.array([
            self.x + self.scale[0] * (xi * along[0] + eta * self.outward[0]),
            self.y + self.scale[1] * (xi * along[1] + eta * self.outward[1]),
        ])  # fmt: skip

    def moved(self, xi: float, eta: float) -> Pen:
        """A pen about a point further along and outwards."""
        ((x,), (y,)) = self.at([(xi, eta)])
        return replace(self, x=float(x), y=float(y))

    def line(self, points: ArrayLike, colour: str = BLACK, width: float = 1.0, **look: Any) -> None:
        """A line through points."""
        look = {"zorder": 3, "solid_capstyle": "round", **look}
        self.axis.plot(*self.at(points), color=colour, linewidth=width, gid=self.name, clip_on=False, **look)

    def fill(self, points: ArrayLike, colour: str, edge: str = BLACK, **look: Any) -> None:
        """A filled outline."""
        look = {"zorder": 3, "linewidth": 0.8, **look}
        self.axis.fill(*self.at(points), facecolor=colour, edgecolor=edge, gid=self.name, clip_on=False, **look)

    def arrow(self, start: tuple[float, float], end: tuple[float, float], colour: str, style: str = "-|>") -> None:
        """An arrow between two points."""
        from matplotlib.patches import FancyArrowPatch

        (x0, x1), (y0, y1) = self.at([start, end])
        patch = FancyArrowPatch((x0, y0), (x1, y1), arrowstyle=style, color=colour, mutation_scale=9, linewidth=1.2,
                                shrinkA=0, shrinkB=0, zorder=4, gid=self.name, clip_on=False)  # fmt: skip
        self.axis.add_patch(patch)


def circle(
    radius: float, about: tuple[float, float] = (0.0, 0.0), turn: tuple[float, float] = (0.0, 2 * np.pi)
) -> Vector:
    """Points (40, 2) of a circle or an arc of it."""
    angle = np.linspace(*turn, 40)
    return np.asarray(about) + radius * np.column_stack([np.cos(angle), np.sin(angle)])


def ground(pen: Pen, width: float = 0.2) -> None:
    """A hatched line across: the frame."""
    half, depth = width / 2 * pen.size, 0.06 * pen.size
    pen.line([(-half, 0.0), (half, 0.0)])
    for xi in np.linspace(-half + depth / 2, half, max(2, round(width / 0.045))):
        pen.line([(xi, 0.0), (xi - depth, depth)], width=0.6)


def clamp(pen: Pen, thickness: float) -> None:
    """A clamp within a beam: hatched blocks on both sides."""
    for side in (1.0, -1.0):
        ground(replace(pen.moved(0.0, side * thickness / 2), outward=(0.0, side * pen.outward[1])), 0.22)


def pin(pen: Pen) -> None:
    """A support free to turn: a triangle on the frame."""
    s = pen.size
    pen.fill([(0.0, 0.0), (-0.09 * s, 0.15 * s), (0.09 * s, 0.15 * s)], "white")
    pen.fill(circle(0.025 * s), "white")
    ground(pen.moved(0.0, 0.15 * s), 0.26)


def guide(pen: Pen, thickness: float) -> None:
    """A support free to move and not to turn: a plate across the beam, on rollers between two rails."""
    half = thickness / 2 + 0.14
    for side in (1.0, -1.0):
        pen.line([(0.05 * side, -half), (0.05 * side, half)], width=2.0)
        for eta in (-half + 0.05, half - 0.05):
            pen.fill(circle(0.028, (0.083 * side, eta)), "white")
        rail = replace(pen.moved(0.115 * side, 0.0), outward=(side, 0.0), size=1.0)
        ground(rail, 2 * half + 0.1)


def mass(pen: Pen, arm: float = 0.0, foot: float = 0.02) -> None:
    """A rigid body `foot` inches off the beam, `arm` inches ahead of its place on a rigid arm."""
    half, s = 0.085 * pen.size, pen.size
    if arm:
        pen.line([(0.0, 0.0), (0.0, foot + half), (arm, foot + half)], width=2.0)
    left, right, high = arm - half, arm + half, foot + 2 * half
    pen.fill([(left, foot), (right, foot), (right, high), (left, high)], COLOURS["mass"])
    pen.line(circle(0.03 * s, (arm, foot + half)), "white", 0.8)


def zigzag(pen: Pen, length: float, colour: str = BLACK) -> None:
    """A spring along η."""
    lead, half = 0.15 * length, 0.055 * pen.size
    eta = np.linspace(lead, length - lead, 10)
    xi = half * np.array([0, 1, -1, 1, -1, 1, -1, 1, -1, 0])
    pen.line(np.column_stack([[0, *xi, 0], [0, *eta, length]]), colour)


def pot(pen: Pen, length: float) -> None:
    """A dashpot along η."""
    half, low, high = 0.07 * pen.size, 0.35 * length, 0.7 * length
    pen.line([(0.0, 0.0), (0.0, 0.5 * length)])
    pen.line([(-0.7 * half, 0.5 * length), (0.7 * half, 0.5 * length)], width=2.0)
    pen.line([(-half, low), (-half, high), (half, high), (half, low)])
    pen.line([(0.0, high), (0.0, length)])


def nonlinear(pen: Pen, length: float) -> None:
    """An element: a zigzag crossed by an arrow."""
    zigzag(pen, length, COLOURS["element"])
    s = 0.1 * pen.size
    pen.arrow((-s, 0.72 * length), (s, 0.25 * length), COLOURS["element"])


def spiral(pen: Pen, colour: str = BLACK) -> None:
    """A spring against rotation."""
    angle = np.linspace(0.0, 4.5 * np.pi, 80)
    radius = 0.1 * pen.size * angle / angle[-1]
    pen.line(np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]), colour)


def turning_pot(pen: Pen) -> None:
    """A dashpot against rotation: an arc that moves in a wider one."""
    pen.line(circle(0.1 * pen.size, turn=(0.2, 2.6)))
    pen.line(circle(0.14 * pen.size, turn=(0.6, 2.2)), width=2.0)


def bumper(pen: Pen, gap: float) -> None:
    """The tip of a stop, `gap` inches off the beam, on a short stem."""
    s = pen.size
    tip = circle(0.07 * s, (0.0, gap + 0.07 * s), (np.pi, 2 * np.pi))
    pen.fill(np.vstack([tip, [(0.07 * s, gap + 0.1 * s), (-0.07 * s, gap + 0.1 * s)]]), COLOURS["stop"])
    pen.line([(0.0, gap + 0.1 * s), (0.0, gap + 0.16 * s)], COLOURS["stop"], 2.0)


def turning_stop(pen: Pen, way: float) -> None:
    """A stop of rotation: an arm on the beam and the bar it meets when the slope grows the way of +1 or -1."""
    s = 0.24 * pen.size
    pen.line([(0.0, 0.0), (0.0, s)], COLOURS["stop"], 2.0)
    pen.line(circle(s, turn=(np.pi / 2, np.pi / 2 + 0.45 * way)), GREY, 0.8, linestyle=":")
    bar = s * np.array([np.cos(np.pi / 2 + 0.5 * way), np.sin(np.pi / 2 + 0.5 * way)])
    pen.line([0.7 * bar, 1.25 * bar], COLOURS["stop"], 3.0)


def turned(pen: Pen) -> None:
    """A moment: an arrow round the place."""
    r = 0.17 * pen.size
    arc = circle(r, turn=(-0.3, np.pi + 0.1))
    pen.line(arc, COLOURS["load"], 1.2)
    pen.arrow(tuple(arc[-2]), tuple(arc[-1] + 0.4 * (arc[-1] - arc[-2])), COLOURS["load"])


def ball(pen: Pen, gap: float, speed: float) -> None:
    """An impactor `gap` inches off the beam; an arrow if it moves, inwards for a speed below 0."""
    r = 0.09 * pen.size
    pen.fill(circle(r, (0.0, gap + r)), COLOURS["impactor"])
    if speed:
        ends = [(1.6 * r, gap + 0.02), (1.6 * r, gap + 3.2 * r)]
        pen.arrow(ends[speed < 0], ends[speed > 0], COLOURS["impactor"])


def clasp(pen: Pen, gap: float, thickness: float) -> None:
    """An impactor that embraces the beam, `gap` inches off both sides; the pen stands on its upper side."""
    pen.fill(_frame(0.13 * pen.size, -thickness - gap - 0.08, gap + 0.08), COLOURS["impactor"], zorder=1.4)
    pen.fill(_frame(0.08 * pen.size, -thickness - gap, gap), "white", zorder=1.5)


def _frame(half: float, low: float, high: float) -> Vector:
    """The outline of a rectangle."""
    return np.array([(-half, low), (half, low), (half, high), (-half, high), (-half, low)])
