"""The rig of frames and structures: their lines, supports, masses, springs, stops and loads along their directions.

A panel for each body, in the plane or in space; of a body that does not know where its nodes are they stand in a row.
"""

from __future__ import annotations

import re
import textwrap
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fembeam.plot.figure import heading
from fembeam.plot.rig_around import TIED, around, inked
from fembeam.plot.rig_labels import SIZE, extent
from fembeam.plot.rig_symbols import BLACK, COLOURS, circle
from fembeam.plot.rig_words import WIDE, friction_words, gap_words, length, motion_words, signal_words
from fembeam.plot.style import BLUE, GREEN, GREY
from fembeam.scene import AnnularStop, Pinned
from fembeam.support import require

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fembeam.scene import Scene

Vector = NDArray[np.float64]
REACH = 0.12  # of the body's size, length of springs and arrows
BESIDE = 0.5  # of REACH, the distance at which what strikes stands
RING = 0.4  # of REACH, radius of a circular clearance
FREE = 0.03  # of the body's size, between a place and a stop or the arrow of a load
MOST_BESIDE = 40  # places with labels beside them
BESIDE_LIST = 0.7  # of the width of a figure, left for the axes beside a list
LISTED = 32  # characters of a line in the list of what stands on a body in space
SLIMMEST = 0.7  # of its longest side, what a box in space is wide at least, so that its axes can be read
TALLEST = 0.56  # height of a box in space, in units of its diagonal, above which it is drawn smaller, for its names
ZIGZAG = np.array([0, 0, 1, -1, 1, -1, 1, 0, 0]) * 0.12  # of the length of a spring
TIP = np.vstack([circle(0.15, (0.15, 0.0), (0.5 * np.pi, 1.5 * np.pi)), [[0.2, -0.15], [0.2, 0.15], [0.15, 0.15]]])
IN_SPACE = 1.5  # times as large there, where bodies are small in their box
VIEWER = 0.433, -0.75, 0.5  # where matplotlib looks from; symbols are turned there
STEM = np.array([[0.2, 0.0], [0.36, 0.0]])  # of a stop, behind its tip
HATCHED = np.array([[x, y - 0.1 * (x > 0.36)] for y in (0.2, 0.1, 0.0, -0.1, -0.2) for x in (0.36, 0.46, 0.36)])
HEAD = np.array([[0.0, 0.0], [1.0, 0.0], [0.7, 0.12], [1.0, 0.0], [0.7, -0.12]])  # an arrow of length 1


def rig_of_bodies(scene: Scene, axes: Axes | None) -> Figure:
    """`rig` of `fembeam.plot` of a scene whose bodies are not all Beams."""
    parts = (scene, *scene.bodies)
    panels = [_Panel(part, number) for number, part in enumerate(parts)]
    if axes is None:
        from fembeam.plot.window import Figure

        figure: Any = Figure(figsize=(8.0, 4.5 * len(parts)), layout="constrained")
        options = [{"projection": "3d"} if panel.space else {} for panel in panels]
        drawn = [figure.add_subplot(len(parts), 1, i, **one) for i, one in enumerate(options, 1)]
    else:
        require(len(parts) == 1, "a rig of several bodies needs a figure of its own", len(parts), "rig", "drop axes")
        space = "of three dimensions" if panels[0].space else "flat"
        require(hasattr(axes, "set_zlabel") == panels[0].space, f"the axes must be {space}", axes, "rig", "drop axes")
        figure, drawn = axes.figure, [axes]
    for panel, axis in zip(panels, drawn, strict=True):
        panel.draw(axis)
    heading(drawn, "Rig, bodies to scale", axes is None)
    for panel, axis in sorted(zip(panels, drawn, strict=True), key=lambda pair: not pair[0].space):
        panel.name(axis)
    whole: Figure = figure
    return whole


@dataclass(frozen=True)
class _Panel:
    """One body with what stands on it."""

    scene: Scene
    number: int
    words: dict[str, list[str]] = field(default_factory=dict)  # what stands at each place, by its `repr`

    @cached_property
    def lines(self) -> list[Vector]:
        """The body's lines, (k, 3); a Beam lies along the first axis."""
        beam: Any = self.scene.beam
        return beam.lines() if self.scene.named else [np.array([[0.0, 0.0, 0.0], [beam.length, 0.0, 0.0]])]

    @cached_property
    def places(self) -> dict[str, Vector]:
        """Where everything stands, by `repr` of the place; in a row if that is not known of all."""
        wanted = {repr(place): place for place in self.scene.places}
        ask: Any = self.scene.beam.position if self.scene.named else (lambda z: np.array([z, 0.0, 0.0]))
        found = {key: ask(place) for key, place in wanted.items()}
        if all(at is not None for at in found.values()):
            return found
        return {key: np.array([float(i), 0.0, 0.0]) for i, key in enumerate(wanted)}

    @cached_property
    def row(self) -> bool:
        """Whether the places stand in a row."""
        return self.scene.named and any(self.scene.beam.position(place) is None for place in self.scene.places)

    @cached_property
    def points(self) -> Vector:
        """All points of the panel (k, 3)."""
        return np.vstack([np.zeros((0, 3)), *([] if self.row else self.lines), *self.places.values()])

    @cached_property
    def space(self) -> bool:
        """Whether the body extends or moves along z; else it is drawn in its plane."""
        if not self.scene.named or self.row:
            return False
        return "z" in self.scene.beam.components or bool(len(self.points) and np.ptp(self.points[:, 2]) > 0)

    @cached_property
    def size(self) -> float:
        """Diagonal of the box around the body, m."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0))) if len(self.points) > 1 else 1.0

    def draw(self, axis: Any) -> None:
        """The body, its parts, their names."""
        for line in () if self.row else self.lines:
            self._plot(axis, line, BLUE, 2.0)
        if self.row:
            axis.plot(*self.points.T[:2], "o", color=BLUE, markersize=3)
        for part, word in self._parts(axis):
            self.words.setdefault(repr(part.z), []).append(word)
        self._finish(axis)

    def name(self, axis: Any) -> None:
        """What stands at each place: beside it in the plane, where there is room; else, and in space, in a list."""
        texts = ["\n".join(line for text in one for line in _wrapped(text, WIDE)) for one in self.words.values()]
        if self.space or len(texts) > MOST_BESIDE or not self._labelled(axis, texts):
            self._listed(axis)

    def _listed(self, axis: Any) -> None:
        """A number at each place of a body where texts would lie on each other, and what stands there."""
        lines = []
        for number, texts in enumerate(self.words.values(), 1):
            wrapped = [line for text in texts for line in _wrapped(text, LISTED)]
            lines += [f"{number if i == 0 else '':<2} {line}" for i, line in enumerate(wrapped)]
        size = min(7.0, 230.0 / max(len(lines), 1))  # points: what the height of a panel takes
        engine = axis.figure.get_layout_engine()
        if not self.space and engine is not None and "rect" in engine.get():  # a figure of our own: room for the list
            engine.set(rect=(0.0, 0.0, BESIDE_LIST, 1.0))
        self._numbered(axis, [str(number) for number in range(1, 1 + len(self.words))])
        write, x = (axis.text2D, 1.08) if self.space else (axis.text, 1.02)
        listed = write(x, 0.95, "\n".join(lines), transform=axis.transAxes, fontsize=size, va="top", parse_math=False,
                       family="monospace")  # fmt: skip
        listed.set_in_layout(self.space)  # of a plane it would press the axes flat

    def _numbered(self, axis: Any, numbers: list[str]) -> None:
        """Numbers at the places, in the plane around them while there is room."""
        from matplotlib.patheffects import withStroke

        if not self.space and len(numbers) <= MOST_BESIDE and self._labelled(axis, numbers, 8.0):
            return
        for text, key in zip(numbers, self.words, strict=True):
            # stops of bodies in space stand above or to the right more often than to the left and below
            words, sides = (f"{text}  ", ("right", "top")) if self.space else (f" {text}", ("left", "bottom"))
            axis.text(*self.places[key][: 3 if self.space else 2], words, fontsize=8, weight="bold", ha=sides[0],
                      va=sides[1], zorder=1e3,
                      path_effects=[withStroke(linewidth=2.0, foreground="white")])  # fmt: skip

    def _labelled(self, axis: Any, texts: list[str], points: float = SIZE) -> bool:
        """One text for each place, around it where it covers nothing; whether all have room."""
        axis.figure.draw_without_rendering()  # now the scales are known
        per_inch = axis.figure.dpi
        at = np.array([self.places[key][:2] for key in self.words]).reshape(-1, 2)
        places = axis.transData.transform(at) / per_inch
        sizes = np.array([extent(text, points) for text in texts]).reshape(-1, 2)
        box = axis.get_window_extent().get_points() / per_inch
        centres, free = around(places, sizes, inked(axis.lines, per_inch), box)
        if not free:
            return False
        for text, z, size, away in zip(texts, at, sizes, centres - places, strict=True):
            tied = np.linalg.norm(np.maximum(np.abs(away) - size / 2, 0.0)) > TIED
            tie: Any = (
                {"arrowstyle": "-", "color": GREY, "linewidth": 0.5, "shrinkA": 0, "shrinkB": 3} if tied else None
            )
            axis.annotate(text, z, 72 * away, textcoords="offset points", fontsize=points, ha="center", va="center",
                          multialignment="right" if away[0] < -size[0] / 2 else "left", arrowprops=tie,
                          parse_math=False)  # fmt: skip
        return True

    def _parts(self, axis: Any) -> Any:
        """Draw every part; yields it with its label."""
        scene = self.scene
        for support in scene.supports:
            self._mark(axis, support, "^" if support.dofs == Pinned.dofs else "s", BLACK)
            yield support, ", ".join([self._label(support), *motion_words(support)])
        for mass in scene.masses:
            self._mark(axis, mass, "o", COLOURS["mass"])
            yield mass, f"{self._label(mass)}, {mass.mass:.4g} kg"
        for spring in scene.springs:
            self._to_frame(axis, spring, GREEN, ZIGZAG)
            yield spring, self._label(spring)
        for dashpot in scene.dashpots:
            self._to_frame(axis, dashpot, GREEN, 0.0 * ZIGZAG)
            yield dashpot, self._label(dashpot)
        for one in scene.acting:
            yield one, self._acting(axis, one)
        for force in scene.forces:
            self._arrow(axis, force, self._way(force), COLOURS["load"])
            yield force, self._label(force)
        for impactor in scene.impactors:
            for push in impactor.pushes:
                self._mark(axis, impactor, "o", COLOURS["impactor"], -push * np.array(impactor.along))
            facts = f"{impactor.mass:.4g} kg, {gap_words(impactor.gap, False)}"
            yield impactor, f"{self._label(impactor)}, {facts}"

    def _acting(self, axis: Any, one: Any) -> str:
        """A stop ahead of its place, the way its gap closes, an element as a spring; a line to the second place."""
        to, colour = one.coordinate.to, COLOURS["element" if one.always else "stop"]
        if to is not None and (to[0] or self.number) == self.number:
            self._plot(axis, np.array([self.places[repr(one.z)], self.places[repr(to[1])]]), colour, 1.0, "--")
        rubs = f", {words}" if (words := friction_words(one)) else ""
        if isinstance(one, AnnularStop):
            self._ring(axis, one, colour)
            return f"{self._label(one)}, clearance {length(one.clearance)}{rubs}"
        if not one.always:
            self._stop(axis, one, -one.push * np.array(one.coordinate.along), colour)
            return f"{self._label(one)}, {gap_words(one.gap, one.coordinate.rotation)}{rubs}"
        if to is None:
            self._to_frame(axis, one, colour, ZIGZAG)
        return self._label(one)

    def _label(self, part: Any) -> str:
        """What a part is called."""
        return str(part.label_on(self.number, self.scene.named))

    def _way(self, part: Any) -> Vector:
        """The direction of a part on the six components."""
        along = part.coordinate.along if hasattr(part, "coordinate") else part.along
        return np.array((0.0, 1.0, 0.0, 0.0, 0.0, 0.0) if along is None else along)

    def _plot(self, axis: Any, points: Vector, colour: str, width: float, style: str = "-") -> None:
        """A line through points (k, 3)."""
        axis.plot(*points.T[: 3 if self.space else 2], color=colour, linewidth=width, linestyle=style)

    def _mark(self, axis: Any, part: Any, marker: str, colour: str, beside: Vector | None = None) -> None:
        """A part as a point, at its place or beside it along a direction."""
        whole = self.places[repr(part.z)] + (0.0 if beside is None else BESIDE * REACH * self.size * beside[:3])
        at = whole[: 3 if self.space else 2, None]
        axis.plot(*at, marker, color=colour, markersize=8, gid=part.label)

    def _shape(
        self, axis: Any, part: Any, way: Vector, shape: Vector, start: float, colour: str, filled: bool = False
    ) -> None:
        """A shape (k, 2), along and across a direction; of a rotation out of the plane a circle, else dashed."""
        turns = bool(np.any(way[3:]))
        along = way[3:] if turns else way[:3]
        flat = along if self.space else along * (1.0, 1.0, 0.0)
        at, length = self.places[repr(part.z)], REACH * self.size
        if np.linalg.norm(flat) < 1e-9:
            ring = np.column_stack([circle(0.4 * length, turn=(0.0, 1.7 * np.pi)), np.zeros(40)])
            return self._plot(axis, at + ring, colour, 1.2)
        along = flat / np.linalg.norm(flat)
        across = np.cross(along, VIEWER if self.space else (0.0, 0.0, 1.0))
        across = across if np.linalg.norm(across) > 1e-3 else np.cross(along, (0.0, 0.0, 1.0))  # seen from the end
        xi, eta = shape.T[:, :, None]
        points = at + length * (start + xi) * along + length * eta * across / np.linalg.norm(across)
        self._plot(axis, points, colour, 1.2, "--" if turns else "-")
        if filled and not self.space:
            axis.fill(*points.T[:2], facecolor=colour)
        return None

    def _stop(self, axis: Any, stop: Any, way: Vector, colour: str) -> None:
        """A tip on a stem as on beams, on the frame unless another place carries it; of rotation an arrow."""
        if stop.coordinate.rotation:
            self._arrow(axis, stop, way, colour)
            return
        size = IN_SPACE if self.space else 1.0
        self._shape(axis, stop, way, size * TIP, FREE / REACH, colour, filled=True)
        behind = STEM if stop.coordinate.to else np.vstack([STEM, HATCHED])
        self._shape(axis, stop, way, size * behind, FREE / REACH, colour)

    def _arrow(self, axis: Any, part: Any, way: Vector, colour: str) -> None:
        """An arrow along a direction, beginning a little away from the place."""
        self._shape(axis, part, way, HEAD, FREE / REACH, colour)

    def _ring(self, axis: Any, stop: AnnularStop, colour: str) -> None:
        """A circle around the place across its directions, enlarged; of an outer one the post beside it."""
        across = np.array([place.along[:3] for place in stop.coordinates])
        size = RING * REACH * self.size
        middle = size * np.array(stop.centre) / np.hypot(*stop.centre) if stop.outer else np.zeros(2)
        points = self.places[repr(stop.z)] + (middle + circle(0.6 * size if stop.outer else size)) @ across
        self._plot(axis, points, colour, 1.5)

    def _to_frame(self, axis: Any, part: Any, colour: str, zigzag: Vector) -> None:
        """A spring or dashpot against its direction, to a bar that is the frame."""
        xi = -np.linspace(0.0, 1.0, len(zigzag))
        bar = np.array([[-1.0, 0.25], [-1.0, -0.25]])
        self._shape(axis, part, self._way(part), np.vstack([np.column_stack([xi, zigzag]), bar]), 0.0, colour)

    def _finish(self, axis: Any) -> None:
        """Equal scales, names of the axes, what moves and pulls the whole."""
        scene, beam = self.scene, not self.scene.named
        words = [f"base motion along {c}: {signal_words(s, 'm')}".replace("\n", " ") for c, s in scene.motions.items()]
        if scene.pulls:
            size = ", ".join(f"{g:.4g}" for g in np.atleast_1d(np.asarray(scene.gravity, dtype=float)))
            words.append(f"gravity ({size}) m/s²" if "," in size else f"gravity {size} m/s²")
        words += ["places are not known: nodes in a row"] if self.row else []
        title = "; ".join([*([f"body {self.number}"] if self.number else []), *words])
        axis.set_title("\n".join(textwrap.wrap(title, 90)), fontsize=8, parse_math=False)
        axis.margins(0.25)
        if self.row:
            axis.set_aspect("equal", adjustable="datalim")
            axis.set_axis_off()
            return
        axis.set(xlabel="z / m" if beam else "x / m", ylabel="y / m")
        axis.locator_params(nbins=5)
        if self.space:
            limits = np.array([axis.get_xlim(), axis.get_ylim(), axis.get_zlim()])
            half = np.maximum(np.ptp(limits, axis=1), SLIMMEST * np.ptp(limits, axis=1).max()) / 2
            axis.set(**{f"{c}lim": (m - h, m + h) for c, m, h in zip("xyz", limits.mean(axis=1), half, strict=True)})
            axis.set_box_aspect(half, zoom=min(1.0, TALLEST * np.linalg.norm(half) / half[2]))
            axis.set_zlabel("z / m")
        else:
            axis.set_aspect("equal", adjustable="datalim")


def _wrapped(text: str, width: int) -> list[str]:
    """Lines of a text, numbers with their units.

    Examples
    --------
    >>> _wrapped("stop at R4, -x, gap 4 mm", 22)
    ['stop at R4, -x, gap', '4 mm']
    """
    joined = re.sub(r"(?<=\d) (?=\w)", "\u00a0", text)
    return [line.replace("\u00a0", " ") for line in textwrap.wrap(joined, width)]
