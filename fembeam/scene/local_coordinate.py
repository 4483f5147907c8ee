"""The coordinate a stop or an element acts on: u or u_z at one place, or its difference to a second place.

d = W u - gap,    W = row of u(z) or u_z(z), less that of the second place

On bodies that are not a `Beam` a place has a name and a direction n: W = n · (displacement, rotation).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

from scipy import sparse

from fembeam.scene.places import is_directed, is_place, place_words, unsigned
from fembeam.structures import TURN, UP, Six, direction_of, turns
from fembeam.support import is_numbered, is_one_of, is_pair, require

if TYPE_CHECKING:
    from fembeam.scene.assembly import Matrices

Of = Literal["displacement", "rotation"]
KINDS = ("displacement", "rotation")  # the place in it is the derivative of u
UNITS = {"indentation": ("m", "rad"), "speed": ("m/s", "rad/s"), "force": ("N", "N m"), "impulse": ("N s", "N m s")}


def unit_of(quantity: str, rotations: Iterable[Any]) -> str:
    """Unit of a column shared by several contacts, told by whether each is one of rotation.

    Examples
    --------
    >>> unit_of("force", [False]), unit_of("force", [True]), unit_of("force", [True, False])
    ('N', 'N m', 'N or N m')
    """
    known = isinstance(quantity, str) and quantity in UNITS
    require(known, f"quantity must be one of {', '.join(UNITS)}", quantity, "Run.unit", "choose one")
    kinds = sorted({bool(rotation) for rotation in rotations}) or [False]
    return " or ".join(UNITS[quantity][kind] for kind in kinds)


@dataclass(frozen=True)
class LocalCoordinate:
    """u (derivative 0) or u_z (1) of a beam at z, less that of a second place `to`, (body, z); body 0: the same beam.

    With a direction z is a place of any body, and the coordinate the motion along the direction there.

    Examples
    --------
    >>> LocalCoordinate(0.2, 1).rotation
    True
    """

    z: Any
    derivative: int = 0
    to: tuple[int, Any] | None = None
    direction: Six | None = None

    @property
    def rotation(self) -> bool:
        """Whether it is a rotation: rad and N m, not m and N."""
        return self.derivative == 1 if self.direction is None else turns(self.direction)

    @property
    def along(self) -> Six:
        """Its direction on the six components."""
        return (UP, TURN)[self.derivative] if self.direction is None else self.direction

    @property
    def to_words(self) -> str:
        """The second place: "0.8 m", "0.2 m of beam 1"; empty without one."""
        if self.to is None:
            return ""
        place = (
            self.to[1] if self.direction is None or is_pair(self.to[1]) else str(self.to[1])
        )  # a number names a node
        return place_words(place) + (f" of beam {self.to[0]}" if self.to[0] else "")

    def row(self, matrices: Matrices, body: int = 0) -> sparse.csr_matrix:
        """W (1, N) on the free dofs, for a first place on `body`."""
        row = self._end(matrices, self.z, body)
        if self.to is None:
            return row
        other, z = self.to
        return row - self._end(matrices, z, other or body)

    def _end(self, matrices: Matrices, place: Any, body: int) -> sparse.csr_matrix:
        """The row of one of its places."""
        if self.direction is None and not matrices.beams[body].named:
            return matrices.interpolation(place, self.derivative, body)
        return matrices.row(place, self.along, body)

    def on_body(self, body: int, number: int) -> list[LocalCoordinate]:
        """What of it lies on beam `number`, given that its first place is on `body`: a load on that beam alone."""
        second = None if self.to is None else (self.to[0] or body)
        if body == number:
            return [self if second == body else replace(self, to=None)]
        return [replace(self, z=self.to[1], to=None)] if self.to is not None and second == number else []


def check_turn(of: str, gap: float, where: str) -> None:
    """Raise ValueError for a gap of a beam's slope beyond a quarter turn: it was meant in degrees."""
    right = of == KINDS[0] or abs(gap) <= math.pi / 2
    require(right, "gap of a rotation must be at most a quarter turn, 1.57 rad", gap, where,
            f"is it in degrees? np.radians({gap:g}) are {math.radians(gap):.3g} rad")  # fmt: skip


def local_coordinate(z: Any, of: str, to: Any, where: str, key: str, direction: Any = None) -> LocalCoordinate:
    """The coordinate that `of` or a direction and a second place (or pair, None) name; ValueError for others."""
    require(is_one_of(of, KINDS), "of must be 'displacement' or 'rotation'", of, where, "choose one")
    pair = to if to is None or is_numbered(to) else (0, to)
    planar = direction is None and pair is not None and (is_pair(pair[1]) or is_directed(pair))  # not of a beam
    is_end = pair is None or (is_place(pair[1]) and not planar)
    require(is_end, f"{key} must be a place z, (body, z) or None", to, where,
            "give z on the same beam, or name a beam of bodies, 1 the first, and a place")  # fmt: skip
    second = None if pair is None else (pair[0], pair[1])
    if direction is None:
        return LocalCoordinate(z, KINDS.index(of), second)
    require(of == KINDS[0], "of must be left out where a direction is given", of, where, "write direction='rz' or so")
    return LocalCoordinate(z, 0, second, direction_of(unsigned(direction), where))
