"""A circular clearance: a place in a hole, or beside a post; its force acts along two directions.

d = (W_1 u, W_2 u) - centre,    r = |d|,    δ = r - c,    force on the place -N(δ, δ̇) d/r
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fembeam.scene.impactor import check_law
from fembeam.scene.local_coordinate import LocalCoordinate, local_coordinate
from fembeam.scene.part import ScenePart
from fembeam.scene.places import Second, quoted
from fembeam.scene.rotors import carrier
from fembeam.scene.rubbing import ACROSS, Friction, check_round, check_spin, completed
from fembeam.structures import COMPONENTS, Direction, Frame, direction_of, turns
from fembeam.support import is_finite, require, require_positive, require_switch

USUAL = ("x", "y")


@dataclass(frozen=True, repr=False)
class AnnularStop(ScenePart):
    """A circular clearance: the place moves freely within a circle of radius c, `clearance`.

    With d the two displacements of the place less `centre`, and r = |d|:

        δ = r - c,    δ̇ = d·ḋ/r,    force on the place -N(δ, δ̇) d/r;    outer: δ = c - r, the force +N d/r

    With `friction` a force F_t acts against the sliding of its surface, of radius R; with d at the angle θ from the
    first to the second direction, the place turned by φ about their axis, and the spin Ω of the `Frame` it is on:

        ξ = c θ + R (φ + Ω t),    force on the place -F_t (c/r) e_θ, torque -R F_t on φ;    outer: with -R for R

    Parameters
    ----------
    z : place, of a body that moves in space: a `Frame` of three coordinates a node, a `Structure`.
    law : of the force N for δ > 0, any of `contacts` without memory.
    clearance : c in m, > 0: the hole's radius less that of a round tube or shaft in it.
    centre : of the circle, m along both directions, from the undeflected place.
    outer : the place stays outside of the circle, beside a post. A sleeve around a post moves within its clearance.
    on : what the circle sits on, (body, place) or a place of the same body; None: the frame. d is then the difference.
    directions : two displacements at right angles, names or vectors; None: the two global axes across the member that
        the place is on, where that lies along the third.
    friction : `Friction`, of limit μN; N < 0 of a law that adheres counts as 0. radius : R > 0, m, of the shaft or tube
        itself: what its rotation and its spin rub at. φ is 0 where the body, or the modes kept, have no torsion. None:
        a place that does not turn, ξ = c θ. What the circle sits on does not turn.
    name : keyword, as of all parts.

    Raises
    ------
    ValueError : a clearance that is not positive, a place that begins outside the circle (outer: inside), a law with
        memory, directions that are rotations or not at right angles; in a scene of one plane; friction without a radius
        on a shaft that spins, a radius without friction.

    Examples
    --------
    >>> from contacts import Hertz
    >>> hole = AnnularStop(0.6, Hertz(1e9), clearance=2e-4, directions=("x", "y"))
    >>> hole.label, [one.along.index(1.0) for one in hole.coordinates]
    ('annular stop at 0.6 m', [0, 1])
    """

    law: Any
    clearance: float
    centre: tuple[float, float] = (0.0, 0.0)
    outer: bool = False
    on: Second | None = None
    directions: tuple[Direction, Direction] | None = None
    friction: Friction | None = None
    radius: float | None = None
    always = False
    push = 0.0  # it has no one side
    word = "annular stop"

    def __post_init__(self) -> None:
        super().__post_init__()
        where = self.where
        advice = "give the radius of the circle in m; without play it is a spring along each direction"
        require_positive("clearance", self.clearance, where, advice)
        given = self.centre.tolist() if isinstance(self.centre, np.ndarray) else self.centre
        pair = isinstance(given, (list, tuple)) and len(given) == 2 and all(map(is_finite, given))
        require(pair, "centre must be two finite numbers", self.centre, where, "give m along the two directions")
        object.__setattr__(self, "centre", (float(given[0]), float(given[1])))
        require_switch("outer", self.outer, where, "True is a post beside the place")
        local_coordinate(self.z, "displacement", self.on, where, "on", "x")
        check_law(self.law, where)
        require(not getattr(self.law, "memory", ()), "law must have no memory", self.law, where,
                "choose another one, or put Elements or two Stops there")  # fmt: skip
        check_round(self, where)
        self._check_directions(where)
        self._check_place(where)

    def _check_directions(self, where: str) -> None:
        """Raise ValueError unless the directions are two displacements at right angles; lists become tuples."""
        if self.directions is None:
            return
        given = self.directions.tolist() if isinstance(self.directions, np.ndarray) else self.directions
        two = isinstance(given, (list, tuple)) and len(given) == 2
        require(two, "directions must be two", given, where, "write ('x', 'y'), or two vectors")
        kept = tuple(tuple(one) if isinstance(one, (list, np.ndarray)) else one for one in given)
        object.__setattr__(self, "directions", kept)
        first, second = (direction_of(one, where) for one in kept)
        require(not (turns(first) or turns(second)), "directions must be displacements", given, where,
                "of a rotation there is Stop(…, direction='rz')")  # fmt: skip
        require(abs(np.dot(first, second)) < ACROSS, "directions must be at right angles", given, where,
                "write ('x', 'y'), or two vectors")  # fmt: skip

    def _check_place(self, where: str) -> None:
        """Raise ValueError unless the undeflected place is on its side of the circle."""
        off = float(np.hypot(*self.centre))
        if self.outer:
            require(off >= self.clearance, "the place must begin outside the circle round the centre", self.centre,
                    where, f"it lies {self.clearance - off:.6g} m inside: move the centre")  # fmt: skip
            return
        x, y = (-number / max(off, 1e-300) for number in self.centre)
        require(off <= self.clearance, "the place must begin inside the circle round the centre", self.centre, where,
                f"it lies {off - self.clearance:.6g} m outside, towards ({x:.3g}, {y:.3g}): move the centre, or widen "
                "the clearance")  # fmt: skip

    @property
    def gap(self) -> float:
        """The clearance."""
        return self.clearance

    @property
    def coordinates(self) -> tuple[LocalCoordinate, ...]:
        """The two displacements it acts on."""
        along = USUAL if self.directions is None else self.directions
        found = local_coordinate(self.z, "displacement", self.on, self.where, "on", "x")
        return tuple(replace(found, direction=direction_of(one, self.where)) for one in along)

    @property
    def coordinate(self) -> LocalCoordinate:
        """The first of them."""
        return self.coordinates[0]

    def _made(self, at: str) -> str:
        return f"{self.word} at {at}" + (f", on {to}" if (to := self.coordinate.to_words) else "")


def directed_stops(body: Any, stops: tuple[Any, ...]) -> tuple[Any, ...]:
    """Stops with the directions of annular ones, and tangents of friction; ValueError where the body has none."""
    return tuple(_on_body(body, one, f"stops[{i}] ({one.titled}) of Scene") for i, one in enumerate(stops))


def _on_body(body: Any, stop: Any, where: str) -> Any:
    """One with what the body says of it."""
    if isinstance(stop, AnnularStop):
        found = _directed(body, stop, where)
        check_spin(body, found, where)
        return found
    if stop.friction is None:
        return stop
    body.check_place(stop.z, where)
    tangent = completed(body, stop, where)
    return stop if tangent is stop.tangent else replace(stop, tangent=tangent)


def _directed(body: Any, stop: AnnularStop, where: str) -> AnnularStop:
    """One with its directions, across the member that its place is on."""
    body.check_place(stop.z, where)
    own = carrier(body, stop.z)
    require(not getattr(own, "in_plane", False), "an AnnularStop needs a body in space, this frame lies in one plane",
            stop, where, "use two stops of this gap, direction='y' and direction='-y' or so")  # fmt: skip
    if stop.directions is not None:
        return stop
    axes = _axes_at(own, stop.z)
    lies = axes is not None and bool(np.all(np.abs(np.abs(axes).max(axis=1) - 1.0) < ACROSS))
    one = lies and len({int(np.argmax(axis)) for axis in np.abs(axes)}) == 1
    require(one, f"directions must be given: {quoted(stop.z)} is on no one member along a global axis", None, where,
            "write directions=('x', 'y'), or two vectors")  # fmt: skip
    first, second = (c for c, part in zip(COMPONENTS[:3], np.abs(axes[0]), strict=True) if part < 0.5)
    return replace(stop, directions=(first, second))


def _axes_at(body: Any, place: Any) -> Any:
    """Unit vectors (k, 3) along the members that a place is on; None of bodies without members."""
    if not isinstance(body, Frame):
        return None
    site = body.site(place, "AnnularStop")
    numbers = [site[0]] if not isinstance(site, str) else [
        number for number, one in enumerate(body.members) if site in (one.a, one.b)
    ]  # fmt: skip
    return np.asarray(body.axes)[numbers, 2]
