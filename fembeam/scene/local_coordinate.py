"""The coordinate a stop or an element acts on: u or u_z at one place, or its difference to a second place.

d = W u - gap,    W = row of u(z) or u_z(z), less that of the second place
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from scipy import sparse

from fembeam.support import is_finite, is_whole, require

if TYPE_CHECKING:
    from fembeam.scene.assembly import Matrices

Of = Literal["displacement", "rotation"]
KINDS = ("displacement", "rotation")  # the place in it is the derivative of u
UNITS = {
    "indentation": ("m", "rad"),
    "speed": ("m/s", "rad/s"),
    "force": ("N", "N m"),
    "impulse": ("N s", "N m s"),
}


def unit_of(quantity: str, rotations: Iterable[Any]) -> str:
    """Unit of a column shared by several contacts, told by whether each is one of rotation.

    Examples
    --------
    >>> unit_of("force", [False]), unit_of("force", [True]), unit_of("force", [True, False])
    ('N', 'N m', 'N or N m')
    """
    kinds = sorted({bool(rotation) for rotation in rotations}) or [False]
    return " or ".join(UNITS[quantity][kind] for kind in kinds)


@dataclass(frozen=True)
class LocalCoordinate:
    """u (derivative 0) or u_z (1) of a beam at z, less that of a second place `to`, (body, z); body 0: the same beam.

    Examples
    --------
    >>> LocalCoordinate(0.2, 1).rotation
    True
    """

    z: float
    derivative: int = 0
    to: tuple[int, float] | None = None

    @property
    def rotation(self) -> bool:
        """Whether it is a rotation: rad and N m, not m and N."""
        return self.derivative == 1

    @property
    def to_words(self) -> str:
        """The second place: "0.8 m", "0.2 m of beam 1"; empty without one."""
        if self.to is None:
            return ""
        return f"{self.to[1]:.6g} m" + (f" of beam {self.to[0]}" if self.to[0] else "")

    def row(self, matrices: Matrices, body: int = 0) -> sparse.csr_matrix:
        """W (1, N) on the free dofs, for a first place on `body`."""
        row = matrices.interpolation(self.z, self.derivative, body)
        if self.to is None:
            return row
        other, z = self.to
        return row - matrices.interpolation(z, self.derivative, other or body)

    def on_body(self, body: int, number: int) -> list[LocalCoordinate]:
        """What of it lies on beam `number`, given that its first place is on `body`: a load on that beam alone."""
        second = None if self.to is None else (self.to[0] or body)
        if body == number:
            return [self if second == body else LocalCoordinate(self.z, self.derivative)]
        return [LocalCoordinate(self.to[1], self.derivative)] if self.to is not None and second == number else []


def local_coordinate(z: float, of: str, to: Any, where: str, key: str) -> LocalCoordinate:
    """The coordinate that `of` and a second place (a number, a pair, None) name; ValueError for others."""
    require(of in KINDS, "of must be 'displacement' or 'rotation'", of, where, "choose one")
    pair = (0, to) if is_finite(to) else to
    two = isinstance(pair, (tuple, list)) and len(pair) == 2 and is_whole(pair[0]) and is_finite(pair[1])
    require(pair is None or two, f"{key} must be a place z, (body, z) or None", to, where,
            "give z on the same beam, or name a beam of bodies, 1 the first, and a place")  # fmt: skip
    return LocalCoordinate(z, KINDS.index(of), None if pair is None else (pair[0], pair[1]))
