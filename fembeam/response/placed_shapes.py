"""Mode shapes of a body with places by name: all components of a place, or the motion along a direction."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fembeam.scene import BodyMatrices, LocalCoordinate, at_parts, directed_words, quoted, split
from fembeam.scene.places import At
from fembeam.structures import COMPONENTS, FrameMatrices, direction_of, named, nearest, require_components, turns
from fembeam.support import is_numbered, is_pair, require, tuples

Vector = NDArray[np.float64]
USUAL = 6  # places that tables and figures show unasked


@dataclass(frozen=True, eq=False)
class PlacedShapes:
    """Shapes of a body: values (p, c, n) at its places, c components each, n coordinates.

    Attributes
    ----------
    components : what a place has, of x, y, z, rx, ry, rz. known : the places (p,).
    usual : {name: (place, direction)} that tables and figures show unasked.
    positions : (p, 3) m, NaN where unknown. lines : (k, 2) numbers of places that figures join.
    more : what gives (c, n + k) at places that are not among them, None of a run read from a file.
    carried : (p, c, k) what supports that move carry along by themselves, per unit of each of their k dofs.
    parts : {name: place} of the parts that have a name.
    """

    components: tuple[str, ...]
    known: tuple[Any, ...]
    values: Vector
    usual: dict[str, At]
    positions: Vector
    lines: NDArray[np.int64]
    more: Callable[[Any], Vector] | None = field(default=None, repr=False)
    carried: Vector = field(default_factory=lambda: np.zeros((0, 0, 0)), repr=False)
    parts: Mapping[str, Any] = field(default_factory=dict, repr=False)
    named = True

    def __repr__(self) -> str:
        return f"<{self.values.shape[2]} shapes at {len(self.known)} places>"

    @property
    def moving(self) -> int:
        """Number k of the dofs of supports that move, of all bodies."""
        return int(self.carried.shape[2])

    @cached_property
    def whole(self) -> Vector:
        """(p, c, n + k): the values, then what supports carry."""
        return np.concatenate([self.values, self.carried], axis=2) if self.moving else self.values

    @cached_property
    def translations(self) -> Vector:
        """(p, 3, n + k) along x, y and z; 0 along those that places do not have."""
        own = [self.components.index(name) if name in self.components else None for name in COMPONENTS[:3]]
        still = np.zeros_like(self.whole[:, 0])
        return np.stack([still if i is None else self.whole[:, i] for i in own], axis=1)

    @property
    def words(self) -> dict[str, Any]:
        """All but the values, for JSON."""
        positions = [None if np.isnan(at).any() else at.tolist() for at in self.positions]
        carried = [[*map(int, at), float(self.carried[tuple(at)])] for at in np.argwhere(self.carried)]
        words = {"components": self.components, "places": self.known, "usual": list(self.usual.items())}
        return {
            **words,
            "positions": positions,
            "lines": self.lines.tolist(),
            "moving": self.moving,
            "carried": carried,
            "parts": dict(self.parts),
        }

    @classmethod
    def of_words(cls, words: Mapping[str, Any], values: Vector) -> PlacedShapes:
        """The same of a file, with the values (p c, n)."""
        known, components = tuple(tuples(place) for place in words["places"]), tuple(words["components"])
        positions = [3 * [np.nan] if at is None else at for at in words["positions"]]
        lines = np.array(words["lines"], dtype=int).reshape(-1, 2)
        if len(positions) != len(known) or (lines.size and not 0 <= lines.min() <= lines.max() < len(known)):
            raise ValueError("positions and lines must be of its places")
        usual = {str(name): tuples(at) for name, at in words["usual"]}
        whole = values.reshape(len(known), len(components), values.shape[1])
        carried = np.zeros((len(known), len(components), int(words.get("moving", 0))))
        for *at, value in words.get("carried", ()):
            carried[tuple(at)] = value
        placed_at = np.array(positions, dtype=float).reshape(-1, 3)
        parts = {name: tuples(place) for name, place in words.get("parts", {}).items()}
        return cls(components, known, whole, usual, placed_at, lines, carried=carried, parts=parts)

    def place(self, at: Any) -> Any:
        """The same place, or places, with or without directions, with places for names of parts."""
        return at_parts(at, self.parts, self.names)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of places, and of members."""
        own = [one[1] if is_numbered(one) else one for one in self.known]
        first = (one[0] if is_pair(one) else one for one in own)
        return tuple(dict.fromkeys(name for name in first if isinstance(name, str)))

    def motion_with_supports(self, place: Any) -> Vector:
        """All components (c, n + k) of a place, with what supports that move carry; ValueError for no place."""
        place = tuple(place) if isinstance(place, list) else place.item() if isinstance(place, np.generic) else place
        if place in self.known:
            return np.asarray(self.whole[self.known.index(place)])
        alone = not any(map(is_numbered, self.known))
        require(not (alone and is_numbered(place)), "a place must be on one body, without its number", place, "Run",
                f"write {place[1]!r}, and body={place[0]}" if is_numbered(place) else "")  # fmt: skip
        if self.more is not None:
            return self.more(place)
        of_others = [one for one in self.known if is_numbered(one) and one[1] == place]
        if len(of_others) == 1:  # of joined bodies the one that has this name
            return self.motion_with_supports(of_others[0])
        require(
            False, f"a place must be one that the run keeps; {nearest(place, self.known)}", place, "Run", "use that"
        )
        raise AssertionError

    def __call__(self, at: Any, derivative: int = 0) -> Vector:
        """φ at (place, direction): (n,), or (k, n) for a list of such pairs."""
        require(derivative == 0, "slopes are of a Beam", derivative, "phi", "ask for a rotation, (place, 'rz')")
        rows = self.rows_with_supports(at if isinstance(at, list) else [at])[:, : self.values.shape[2]]
        return rows if isinstance(at, list) else rows[0]

    def rows_with_supports(self, at: list[Any]) -> Vector:
        """(j, n + k) of such pairs, with what supports that move carry."""
        return np.array([self._row(one) for one in at]).reshape(len(at), self.whole.shape[2])

    def _row(self, at: Any) -> Vector:
        """(n + k,) of one (place, direction)."""
        place, along = split(at, self.components)
        require_components(along, self.components, f"the place {quoted(place)}", "phi")
        part = np.array([along[COMPONENTS.index(component)] for component in self.components])
        return np.asarray(part @ self.motion_with_supports(place))


def _motion_at(body: BodyMatrices, vectors: Vector, place: Any) -> Vector:
    """All components (c, n + k) of any place of a body, of vectors (N_all, n + k)."""
    body.beam.check_place(place, "phi")
    return np.asarray(body.assembled.rows(place) @ vectors)


def placed_shapes(
    body: BodyMatrices, vectors: Vector, loaded: Sequence[LocalCoordinate], carried: Vector, parts: Mapping[str, Any]
) -> PlacedShapes:
    """The shapes of a body from its part of the basis, (N, n), and what supports that move carry, (N_all, k).

    ``parts``: {name: place} of those that have a name.
    """
    extra = [*parts.values(), *(at.z for at in loaded)]
    extra += [at.to[1] for at in loaded if at.to is not None and at.to[0] == 0]
    joined = list(body.beam.edges)
    drawn = [place for pair in joined for place in pair]
    extra += _mesh_nodes(body.assembled)
    names = list(dict.fromkeys([*body.beam.places(), *(tuple(z) if isinstance(z, list) else z for z in extra), *drawn]))
    number = {name: i for i, name in enumerate(names)}
    n, full = vectors.shape[1], np.hstack([body.spread @ vectors, carried])
    shape = (len(names), len(body.beam.components), full.shape[1])
    values = np.asarray(body.assembled.rows_of(names) @ full).reshape(shape)
    at = [body.beam.position(place) for place in names]
    positions = np.array([3 * [np.nan] if x is None else x for x in at], dtype=float).reshape(-1, 3)
    edges = [(number[a], number[b]) for a, b in joined]
    made = PlacedShapes(
        tuple(body.beam.components),
        tuple(names),
        values[:, :, :n],
        _usual(body, loaded),
        positions,
        np.array(edges, dtype=int).reshape(-1, 2),
        partial(_motion_at, body, full),
        values[:, :, n:],
        parts,
    )
    seen = {name: at for name, at in made.usual.items() if np.any(made(at))}
    return replace(made, usual=dict(list((seen or made.usual).items())[:USUAL]))


def _mesh_nodes(made: Any) -> list[Any]:
    """All nodes of the meshes of frames, between which a run read from a file interpolates."""
    if isinstance(made, FrameMatrices):
        return list(made.mesh.sections())
    each = getattr(made, "made", ())
    return [(number, at) if number else at for number, one in enumerate(each) for at in _mesh_nodes(one)]


def _usual(body: BodyMatrices, loaded: Sequence[LocalCoordinate]) -> dict[str, At]:
    """Where something acts, then displacements of named points, a few."""
    single = [(at, sum(map(bool, at.along)) == 1) for at in loaded]
    found: list[At] = [
        (at.z, named(at.along).removeprefix("-")) if one else (at.z, at.along[:3])
        for at, one in single
        if one or any(at.along[:3])
    ]  # a rotation about a vector has no name
    ask, points = body.beam.components_at, body.beam.points or body.beam.places()[-1:]
    found += [(place, c) for place in points for c in ask(place) if c in COMPONENTS[:3]]
    moved = [at for at in found if not turns(direction_of(at[1], "a place"))]  # figures of them are in m
    return {directed_words(at): at for at in dict.fromkeys(moved or found or [(p, c) for p in points for c in ask(p)])}
