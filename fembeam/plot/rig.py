"""The rig drawn: beams to scale along z, supports, masses, springs, stops with their gaps enlarged, loads, names.

Each beam has a lane of the figure; what stands on it is drawn outwards, above or below, symbols side by side where they
would overlap, each tied to its place. `rig_symbols` has the symbols, `rig_labels` places the labels, `rig_words` writes
them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fembeam.plot import rig_symbols as symbols
from fembeam.plot.rig_bodies import rig_of_bodies
from fembeam.plot.rig_labels import SIZE, Placed, extent, rows_of, spread
from fembeam.plot.rig_symbols import COLOURS, Pen
from fembeam.plot.rig_words import gap_words, label, law_words, length, signal_words
from fembeam.plot.style import GREY, round_factor, styled
from fembeam.plot.units import length_for
from fembeam.scene import Guided, Pinned, PointMoment
from fembeam.support import require

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fembeam.beams import Beam
    from fembeam.scene import Scene

Vector = NDArray[np.float64]
WIDTH = 8.0  # inches of the figure
PAD = 0.55  # inches beside the beams
THICK = 0.16  # inches, the highest section
GAP = 0.2  # inches, the largest gap
STEM = 0.4  # inches, of springs and dashpots
HEAD = 0.42  # inches for the base motion and gravity
LIFT = 0.1  # inches, the height of feet
MANY = 12  # symbols on one side: from here on they rather become smaller than stand beside their places
FEW = 3  # parts of one kind and without names that are never summed up
LANE = 0.3  # inches between the lanes of two beams


@dataclass(frozen=True)
class Item:
    """Something that stands on one side of a beam.

    Attributes
    ----------
    z : m. side : +1 above, -1 below. width : inches along the beam that it needs. text : its label, or none.
    draw : draws it with a pen at the beam's surface; None of one that only keeps a way free.
    kind : parts of one kind may share a label. gap : for that, m.
    tall : inches outwards. fixed : whether it must stand at its place.
    link : (body, z), where a line from it leads.
    """

    z: float
    side: int
    width: float
    draw: Callable[[Pen], None] | None
    text: str
    name: str
    kind: tuple[Any, ...] = ()
    gap: float = 0.0
    tall: float = 0.5
    fixed: bool = False
    link: tuple[int, float] | None = None


@dataclass
class Lane:
    """One beam with what stands on it, laid out: symbols and labels of both sides, in inches."""

    body: int
    beam: Beam
    items: list[Item]
    size: float = 1.0
    middle: float = 0.0  # η of the beam's axis
    lifted: dict[int, bool] = field(default_factory=dict)  # whether the symbols of a side stand on feet
    reach: dict[int, float] = field(default_factory=dict)  # inches from the beam to the labels of a side
    places: dict[int, Vector] = field(default_factory=dict)  # x of the symbols of each side
    labels: dict[int, list[Placed]] = field(default_factory=dict)
    depth: dict[int, float] = field(default_factory=dict)  # of the labels of each side
    groups: dict[int, list[list[int]]] = field(default_factory=dict)  # of items that share a label

    def of_side(self, side: int) -> list[Item]:
        """Items of one side from left to right."""
        return sorted((item for item in self.items if item.side == side), key=lambda item: item.z)

    def end(self, side: int) -> float:
        """η where the labels of one side end."""
        return self.foot(side) + side * self.depth[side]

    def foot(self, side: int) -> float:
        """η where the labels of one side begin."""
        return self.middle + side * (THICK / 2 + self.reach[side])


@styled
def rig(scene: Scene, axes: Axes | None = None) -> Figure:
    """The scene as it stands: beams to scale along z, supports, masses, springs, dashpots, stops, loads, names.

    Across the beams nothing is to scale but the gaps, enlarged as the title says. Symbols that would overlap stand side
    by side, tied to their places; of many parts of one kind without names one label tells how many. `axes` to draw
    into; None makes a figure.

    Examples
    --------
    >>> import fembeam as fb
    >>> from contacts import Hertz
    >>> beam = fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01))
    >>> figure = rig(fb.Scene(beam, [fb.Clamped(0.0)], stops=[fb.Stop(0.5, Hertz(1e8), gap=1e-3)]))
    >>> figure.get_suptitle()
    'Rig, to scale along z; gaps × 10 across'
    """
    drawn = axes is None or hasattr(axes, "set_title")
    require(drawn, "axes must be axes of matplotlib", axes, "fembeam.plot", "make them by plt.subplots()")
    if any(part.named for part in (scene, *scene.bodies)):
        return rig_of_bodies(scene, axes)
    view = _View(scene, WIDTH if axes is None else _inches(axes))
    lanes = [view.lane(body) for body in range(1 + len(scene.bodies))]
    top = _stacked(scene, lanes, bool(view.heads))
    low = min(lane.end(-1) for lane in lanes) - 0.1
    if axes is None:
        from fembeam.plot.window import Figure

        height = top - low + 0.95
        figure: Any = Figure(figsize=(WIDTH, height))
        axis = figure.add_axes((0.0, 0.5 / height, 1.0, (top - low) / height))
        figure.suptitle(view.title, x=0.01, y=1.0 - 0.08 / height, ha="left", va="top", fontsize=10, fontweight="bold")
    else:
        figure, axis = axes.figure, axes
        axis.set_title(view.title)
    view.frame(axis, low, top)
    for lane in lanes:
        view.draw(axis, lane)
    view.links(axis, lanes)
    view.head(axis, top)
    return figure  # type: ignore[no-any-return]


def _inches(axis: Axes) -> float:
    """Width of given axes."""
    figure: Any = axis.figure
    return float(axis.get_position().width * figure.get_size_inches()[0])


def _stacked(scene: Scene, lanes: list[Lane], head: bool) -> float:
    """Put the lanes over each other, bodies on the side of the stop they carry; returns the upper end."""
    for side in (1, -1):
        last = lanes[0]
        for lane in lanes[1:]:
            if _over(scene, lane.body) == (side > 0):
                lane.middle = last.end(side) + side * (LANE + abs(lane.end(-side) - lane.middle))
                last = lane
    return max(lane.end(1) for lane in lanes) + 0.1 + HEAD * head


class _View:
    """Scales of a figure, and what is drawn with them."""

    def __init__(self, scene: Scene, width: float) -> None:
        self.scene, self.width = scene, width
        self.beams = [part.beam for part in (scene, *scene.bodies)]
        ahead = [mass.z + mass.offset for part in (scene, *scene.bodies) for mass in part.masses]
        self.low, self.high = min(0.0, *ahead, 0.0), max(*(beam.length for beam in self.beams), *ahead, 0.0)
        self.unit, self.unit_name = length_for(max(self.high, -self.low))
        self.per_inch = (self.high - self.low) / (width - 2 * PAD)  # m
        gaps = [gap for gap in _gaps(scene) if gap > 1e-9 * self.high]
        self.enlarged = bool(gaps)
        self.factor = round_factor(GAP * self.per_inch / max(gaps, default=GAP * self.per_inch))
        self.heights = _heights(self.beams)
        self.heads = [f"base motion: {signal_words(scene.base, 'm')}".replace("\n", " ")] if scene.base else []
        self.heads += [f"gravity {scene.gravity:.4g} m/s²"] if scene.gravity else []
        for body, beam in enumerate(self.beams):
            of = f" of beam {body}" if body else ""
            self.heads += [f"axial force{of} {beam.axial_force:.4g} N"] if beam.axial_force else []
            self.heads += [f"elastic foundation{of} {beam.foundation:.4g} N/m²"] if beam.foundation else []

    @property
    def title(self) -> str:
        """What is to scale."""
        return "Rig, to scale along z" + (f"; gaps × {self.factor:g} across" if self.enlarged else "")

    def gap(self, gap: float) -> float:
        """A gap in inches; a preload touches."""
        return max(gap, 0.0) * self.factor / self.per_inch

    def x(self, z: Any) -> Any:
        """Inches from the left edge."""
        return PAD + (z - self.low) / self.per_inch

    def z(self, x: Any) -> Any:
        """Data: z in the unit of the axis."""
        return self.unit * (self.low + (x - PAD) * self.per_inch)

    def lane(self, body: int) -> Lane:
        """One beam with symbols and labels in their places."""
        part = (self.scene, *self.scene.bodies)[body]
        lane = Lane(body, part.beam, [*_items(self, part, body), *_ends(self.scene, body)])
        lane.size = min(self._size(lane.of_side(side)) for side in (1, -1))
        for side in (1, -1):
            items = lane.of_side(side)
            widths = np.array([item.width * lane.size for item in items])
            true = np.array([self.x(item.z) for item in items])
            weights = np.where([item.fixed for item in items], 1e6, 1.0)
            found = spread(true, widths, 0.05, self.width - 0.05, weights)
            lane.places[side] = x = true if found is None else found
            moved = [
                abs(a - b) > 0.02 and not (item.fixed or item.draw is None)
                for item, a, b in zip(items, x, true, strict=True)
            ]
            lane.lifted[side] = any(moved)
            lane.reach[side] = max((item.tall for item in items), default=0.1) + LIFT * any(moved) + 0.1
            (lane.labels[side], lane.depth[side]), lane.groups[side] = self._labels(items, lane.places[side])
        return lane

    def _size(self, items: list[Item]) -> float:
        """Size of symbols at which those of one side fit in; where they are many, each at its own place."""
        size = (self.width - 0.6) / max(sum(item.width for item in items), 1e-9)
        if len(items) > MANY:
            pairs = [(self.x(b.z) - self.x(a.z), (a.width + b.width) / 2) for a, b in pairwise(items)]
            size = min([size, *(apart / width for apart, width in pairs if apart > 0.04)])
        return float(np.clip(size, 0.3, 1.0))

    def _labels(self, items: list[Item], x: Vector) -> tuple[tuple[list[Placed], float], list[list[int]]]:
        """Labels of one side; where they are too many, one for all parts of a kind without names."""
        found = rows_of(x, texts := [item.text for item in items], 0.05, self.width - 0.05)
        if not any(one.upright for one in found[0]):
            return found, []
        groups = _alike(items)
        for members in groups:
            for i in members:
                texts[i] = ""
            texts[members[len(members) // 2]] = _summed([items[i] for i in members])
        return rows_of(x, texts, 0.05, self.width - 0.05), groups

    def frame(self, axis: Axes, low: float, top: float) -> None:
        """The axis along z, and no other."""
        axis.set(xlim=(self.z(0.0), self.z(self.width)), ylim=(low, top))
        for side in ("left", "right", "top"):
            axis.spines[side].set_visible(False)
        axis.set_yticks([])
        axis.spines["bottom"].set_bounds(self.unit * self.low, self.unit * self.high)
        ticks = [
            tick for tick in axis.get_xticks() if self.unit * self.low <= tick <= self.unit * self.high * (1 + 1e-9)
        ]
        axis.set(xticks=ticks, xlabel=f"z / {self.unit_name}")

    def pen(self, axis: Axes, lane: Lane, x: float, side: int, name: str = "") -> Pen:
        """A pen on the surface of a beam, outwards."""
        at = self.surface(lane, side, self.low + (x - PAD) * self.per_inch)
        return Pen(axis, self.z(x), at, (self.unit * self.per_inch, 1.0), (0.0, float(side)), lane.size, name)

    def surface(self, lane: Lane, side: int, z: float) -> float:
        """η of one side of a beam."""
        return lane.middle + side * float(self.heights[lane.body](np.clip(z, 0.0, lane.beam.length))) / 2

    def draw(self, axis: Axes, lane: Lane) -> None:
        """A beam, its symbols and their labels."""
        self._beam(axis, lane)
        for side in (1, -1):
            for members in lane.groups[side]:
                x, at = lane.places[side][members], lane.foot(side) - side * 0.04
                axis.plot(self.z(np.array([x.min() - 0.05, x.max() + 0.05])), [at, at], color=GREY, linewidth=0.8)
            for item, x, placed in zip(lane.of_side(side), lane.places[side], lane.labels[side], strict=True):
                self._symbol(axis, lane, item, float(x))
                self._label(axis, lane, side, item, placed)

    def _beam(self, axis: Axes, lane: Lane) -> None:
        """The outline, a line between two spans."""
        small = 1e-9 * lane.beam.length
        inside = [np.linspace(a + small, b - small, 20) for a, b in pairwise(lane.beam.borders)]
        z, half = np.concatenate(inside), np.concatenate([self.heights[lane.body](at) for at in inside]) / 2
        outline = np.concatenate([lane.middle + half, (lane.middle - half)[::-1]])
        axis.fill(self.unit * np.concatenate([z, z[::-1]]), outline, facecolor="#c9d8e6", edgecolor=symbols.BLACK,
                  linewidth=0.8, zorder=2, gid=f"beam {lane.body}")  # fmt: skip
        if lane.body:
            axis.text(self.z(0.05), lane.middle + 0.3, f"beam {lane.body}", fontsize=SIZE + 1, fontweight="bold")

    def _symbol(self, axis: Axes, lane: Lane, item: Item, x: float) -> None:
        """One symbol; beside its place it stands on a foot that reaches there."""
        if item.draw is None:
            return
        own = self.x(item.z)
        pen = self.pen(axis, lane, own if item.fixed else x, item.side, item.name)
        if lane.lifted[item.side] and not item.fixed:
            foot = self.pen(axis, lane, own, item.side, item.name)
            shift = (x - own) * item.side
            foot.line([(0.0, 0.0), (0.0, 0.04), (shift, LIFT)], width=0.8)
            foot.line(symbols.circle(0.02), width=1.5)
            pen = pen.moved(0.0, LIFT)
            pen.line([(-0.06 * pen.size, 0.0), (0.06 * pen.size, 0.0)], width=1.5)
        item.draw(pen)

    def _label(self, axis: Axes, lane: Lane, side: int, item: Item, placed: Placed) -> None:
        """The text of an item and the line to it."""
        if not placed.text:
            return
        path = placed.path.copy()
        path[:, 1] = lane.foot(side) + side * path[:, 1]
        tall = item.tall if item.fixed or not lane.lifted[side] else item.tall + LIFT
        line = np.vstack([(path[0, 0], lane.middle + side * (THICK / 2 + tall + 0.03)), path])
        axis.plot(self.z(line[:, 0]), line[:, 1], color=GREY, linewidth=0.5, zorder=1, clip_on=False)
        turn: dict[str, Any] = {"rotation": 90} if placed.upright else {}
        axis.text(self.z(path[-1, 0]), path[-1, 1] + side * 0.02, placed.text, fontsize=SIZE, ha="center",
                  va="bottom" if side > 0 else "top", gid=item.name, zorder=5, parse_math=False, **turn)  # fmt: skip

    def links(self, axis: Axes, lanes: list[Lane]) -> None:
        """Lines from stops and elements to their second places."""
        for lane in lanes:
            for side in (1, -1):
                for i, item in enumerate(lane.of_side(side)):
                    if item.link is not None:
                        path = np.array(self._way(lanes, lane, side, i))
                        colour = COLOURS["stop" if item.kind[0] == "Stop" else "element"]
                        axis.plot(self.z(path[:, 0]), path[:, 1], color=colour, linewidth=1.4, zorder=1.5,
                                  gid=item.name, solid_joinstyle="round")  # fmt: skip

    def _way(self, lanes: list[Lane], lane: Lane, side: int, number: int) -> list[tuple[float, float]]:
        """From the head of a symbol to its second place: over the same beam, or between labels to another one."""
        item, x = lane.of_side(side)[number], float(lane.places[side][number])
        assert item.link is not None
        body, z = item.link
        own = lane.middle + side * (THICK / 2 + LIFT * lane.lifted[side])
        end = self._mate(lanes[body], item, z)
        if body == lane.body:
            high = own + side * (STEM + 0.06)
            return [(x, own + side * STEM), (x, high), (end[-2][0], high), end[-1]]
        return [(x, own + side * STEM), *self._mate(lane, item, item.z)[::-1][1:], *end]

    def _mate(self, lane: Lane, item: Item, z: float) -> list[tuple[float, float]]:
        """The way that the partner of an item, which is not drawn, keeps free, from outside to the beam."""
        for side in (1, -1):
            for i, other in enumerate(lane.of_side(side)):
                if other.draw is None and (other.name, other.z) == (item.name, z):
                    start = lane.foot(side)
                    path = [(float(x), start + side * float(eta)) for x, eta in lane.labels[side][i].path]
                    x = float(lane.places[side][i])
                    return [*path[::-1], (x, start - side * 0.1), (self.x(z), self.surface(lane, side, z))]
        raise AssertionError(item.name)

    def head(self, axis: Axes, top: float) -> None:
        """Base motion and gravity, which move and pull everything; what acts along whole beams."""
        x = 0.25
        for words in self.heads:
            pen = Pen(axis, self.z(x), top - HEAD, (self.unit * self.per_inch, 1.0), name=words.partition(":")[0])
            if words.startswith(("base", "gravity")):
                pen.arrow((0.0, 0.32), (0.0, 0.06), COLOURS["motion"], "<|-|>" if words.startswith("base") else "-|>")
            axis.text(self.z(x + 0.12), top - HEAD + 0.19, words, fontsize=SIZE + 0.5, va="center", gid=pen.name,
                      parse_math=False)  # fmt: skip
            x += 0.45 + extent(words, SIZE + 0.5)[0]


def _gaps(scene: Scene) -> list[float]:
    """Gaps of displacement, of stops and impactors of all beams."""
    found = []
    for part in (scene, *scene.bodies):
        found += [stop.gap for stop in part.stops if not stop.coordinate.rotation]
        found += [impactor.gap for impactor in part.impactors]
    return found


def _heights(beams: list[Beam]) -> list[Callable[[Any], Vector]]:
    """The drawn height of each beam along z in inches: √(I/A) of all sections against the highest."""

    def radius(beam: Beam, z: Any) -> Vector:
        inside = np.clip(np.asarray(z, dtype=float), 1e-9 * beam.length, (1 - 1e-9) * beam.length)
        profile = beam.profile(inside)
        return np.asarray(np.sqrt(profile.I / profile.A) + 0.0 * inside)

    most = max(float(radius(beam, np.linspace(0.0, beam.length, 201)).max()) for beam in beams)
    return [lambda z, beam=beam: THICK * (0.25 + 0.75 * radius(beam, z) / most) for beam in beams]  # type: ignore[misc]


def _alike(items: list[Item]) -> list[list[int]]:
    """Numbers of items of one kind without names of their own, more than a few."""
    kinds: dict[tuple[Any, ...], list[int]] = {}
    for i, item in enumerate(items):
        if item.kind and item.kind[-1] is None and item.text:
            kinds.setdefault(item.kind, []).append(i)
    return [members for members in kinds.values() if len(members) > FEW]


def _summed(items: list[Item]) -> str:
    """One label of many parts."""
    word, side, law = items[0].text.split("\n")[0].split()[0], items[0].kind[1], items[0].kind[2]
    places = f"{len(items)} {word}s at {items[0].z:.4g} to {items[-1].z:.4g} m" + (f", {side}" if side else "")
    gaps = sorted({item.gap for item in items})
    words = gap_words(gaps[0], False) if len(gaps) == 1 else f"gaps {length(gaps[0])} to {length(gaps[-1])}"
    return "\n".join([places, words, law])


def _over(scene: Scene, body: int) -> bool:
    """Whether a further beam lies over the scene's own: its first stop pushes down."""
    links = [stop for stop in scene.stops if (to := stop.coordinate.to) and to[0] == body]
    return bool(links) and links[0].push < 0


def _ends(scene: Scene, body: int) -> Iterator[Item]:
    """Where stops and elements of the scene's own beam meet this one, and where their lines leave that."""
    for part in scene.acting:
        to = part.coordinate.to
        if to is None or body not in (0, to[0]):
            continue
        up = 1 if _over(scene, to[0]) else -1
        free = partial(Item, width=0.1, draw=None, text="", name=part.label, tall=0.2)
        if to[0] == 0:
            yield free(to[1], _side(part))
        else:
            yield free(to[1], -up) if body else free(part.z, up)


def _side(part: Any) -> int:
    """The side of a beam that a stop or element stands on."""
    if part.always:
        return 1 if part.coordinate.to and part.coordinate.to[0] == 0 else -1
    return 1 if part.coordinate.rotation else -int(part.push)


def _items(view: _View, scene: Scene, body: int) -> Iterator[Item]:
    """All that stands on one beam."""
    for support in scene.supports:
        yield from _support(support, scene.beam.length, body)
    yield from _masses(view, scene, body)
    for spring in scene.springs:
        yield _item(spring, body, -1, 0.24, partial(_spring, spring=spring))
    for dashpot in scene.dashpots:
        yield _item(dashpot, body, -1, 0.24, partial(_dashpot, dashpot=dashpot))
    for part in scene.acting:
        rotation = part.coordinate.rotation
        kind = (type(part).__name__, getattr(part, "side", ""), law_words(part.law), rotation, part.name)
        draw = partial(_acting, part=part, gap=view.gap(part.gap))
        width, to = 0.36 if rotation and not part.always else 0.22, part.coordinate.to
        tall = 0.5 if to else 0.3 if rotation else STEM + 0.07 if part.always else view.gap(part.gap) + 0.24
        yield _item(part, body, _side(part), width, draw, kind=kind, gap=part.gap, link=to, tall=tall)
    for force in scene.forces:
        width, tall = (0.4, 0.25) if isinstance(force, PointMoment) else (0.2, 0.52)
        yield _item(force, body, 1, width, partial(_load, force=force), tall=tall)
    for impactor in scene.impactors:
        yield from _impactors(view, impactor, body)


def _masses(view: _View, scene: Scene, body: int) -> Iterator[Item]:
    """Lumped masses; an arm passes over what stands on its way, and over other arms."""
    others = [*scene.masses, *scene.acting, *scene.forces, *scene.impactors]
    over = 0
    for mass in scene.masses:
        arm = mass.offset / view.per_inch
        if not arm:
            yield _item(mass, body, 1, 0.24, symbols.mass, tall=0.2)
            continue
        low, high = sorted((mass.z, mass.z + mass.offset))
        met = any(low - 0.2 * view.per_inch < one.z < high + 0.2 * view.per_inch for one in others if one is not mass)
        foot, over = (0.56 + 0.22 * over, over + 1) if met else (0.12, over)
        yield _item(mass, body, 1, 0.24, partial(symbols.mass, arm=arm, foot=foot), fixed=True, tall=foot + 0.18)
        yield Item(mass.z + mass.offset, 1, 0.24, None, "", mass.label_on(body), tall=foot + 0.18)


def _impactors(view: _View, impactor: Any, body: int) -> Iterator[Item]:
    """An impactor on its side; one on both sides keeps the other free, too."""
    both, gap = len(impactor.pushes) > 1, view.gap(impactor.gap)
    draw = partial(_impactor, impactor=impactor, gap=gap, thick=float(view.heights[body](impactor.z)))
    kind = ("Impactor", "", law_words(impactor.law), impactor.name)
    tall = gap + (0.1 if both else 0.45 if impactor.stiffness else 0.3 if impactor.velocity else 0.2)
    side = 1 if both else -int(impactor.pushes[0])
    yield _item(impactor, body, side, 0.34, draw, kind=kind, fixed=both, tall=tall)
    if both:
        yield Item(impactor.z, -1, 0.34, None, "", impactor.label_on(body), fixed=True, tall=tall)


def _item(part: Any, body: int, side: int, width: float, draw: Callable[[Pen], None], **more: Any) -> Item:
    """A part with its label."""
    return Item(part.z, side, width, draw, label(part), part.label_on(body), **more)


def _support(support: Any, beam: float, body: int) -> Iterator[Item]:
    """A support; of a clamp at an end the wall stands beside the beam."""
    if support.fixed == Pinned.fixed:
        yield _item(support, body, -1, 0.26, symbols.pin, fixed=True, tall=0.23)
        return
    near, far = support.z <= 1e-9 * beam, support.z >= (1 - 1e-9) * beam
    guided = support.fixed == Guided.fixed
    draw = _guided if guided else partial(_clamped, end=far - near)
    width, tall = (0.4, 0.2) if guided else (0.1, 0.14) if near or far else (0.24, 0.08)
    yield _item(support, body, -1, width, draw, fixed=True, tall=tall)
    if guided or not (near or far):
        yield Item(support.z, 1, width, None, "", support.label_on(body), fixed=True, tall=tall)


def _guided(pen: Pen) -> None:
    """A guide about the beam's axis; the pen stands on its lower side."""
    symbols.guide(pen.moved(0.0, -THICK / 2), THICK)


def _clamped(pen: Pen, end: int) -> None:
    """A wall at the left (-1) or right (+1) end of a beam, blocks on both sides within it."""
    middle = pen.moved(0.0, -THICK / 2)
    if end:
        symbols.ground(replace(middle, outward=(float(end), 0.0), size=1.0), 0.4)
    else:
        symbols.clamp(middle, THICK)


def _spring(pen: Pen, spring: Any) -> None:
    """A spring to the frame, or against rotation; its foot may move."""
    if spring.rotational:
        symbols.spiral(pen)
    if spring.stiffness or not spring.rotational:
        symbols.zigzag(pen, STEM)
        foot = pen.moved(0.0, STEM)
        symbols.ground(foot)
        if spring.foot is not None:
            foot.arrow((0.16, -0.1), (0.16, 0.14), COLOURS["motion"], "<|-|>")


def _dashpot(pen: Pen, dashpot: Any) -> None:
    """A dashpot to the frame, or against rotation."""
    if dashpot.rotational:
        symbols.turning_pot(pen)
    if dashpot.damping or not dashpot.rotational:
        symbols.pot(pen, STEM)
        symbols.ground(pen.moved(0.0, STEM))


def _acting(pen: Pen, part: Any, gap: float) -> None:
    """A stop or an element on the frame; where another beam carries it a line goes on from here."""
    if part.coordinate.rotation:
        _turning(pen, part)
        return
    if part.always:
        symbols.nonlinear(pen, STEM)
        head = STEM
    else:
        symbols.bumper(pen, gap)
        head = gap + 0.16 * pen.size
    if part.coordinate.to is None:
        symbols.ground(pen.moved(0.0, head))
    else:
        pen.line([(0.0, head), (0.0, STEM)], COLOURS["element" if part.always else "stop"], 1.4)


def _turning(pen: Pen, part: Any) -> None:
    """A stop or an element of rotation."""
    if part.always:
        symbols.spiral(pen, COLOURS["element"])
    else:
        symbols.turning_stop(pen, 1.0 if part.side == "above" else -1.0)


def _load(pen: Pen, force: Any) -> None:
    """A force, drawn the way it counts positive, or a moment."""
    if isinstance(force, PointMoment):
        symbols.turned(pen)
    else:
        pen.arrow((0.0, 0.02), (0.0, 0.5), COLOURS["load"])


def _impactor(pen: Pen, impactor: Any, gap: float, thick: float) -> None:
    """A mass beside the beam, or about it, with its own spring to the frame."""
    if len(impactor.pushes) == 2:
        symbols.clasp(pen, gap, thick)
        return
    symbols.ball(pen, gap, impactor.velocity * pen.outward[1])
    if impactor.stiffness:
        top = gap + 0.18 * pen.size
        symbols.zigzag(pen.moved(0.0, top), 0.2)
        symbols.ground(pen.moved(0.0, top + 0.2))
