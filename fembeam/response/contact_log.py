"""The contact log with where every contact is: z and side along a beam, place and direction on other bodies."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import solvers
from fembeam.scene import place_words, unit_of
from fembeam.structures import TURN, UP, direction_of, named
from fembeam.support import Part, Printed, by_rows, is_finite, is_whole
from solvers.problem import counted

MOST_PRINTED = 60  # contacts
UNITS = {"z": "m", "t_in": "s", "t_out": "s", "energy_loss": "J", "angle_in": "rad", "angle_out": "rad"}
QUANTITIES = {"speed_in": "speed", "speed_out": "speed", "peak_indentation": "indentation",
              "peak_force": "force", "impulse": "impulse"}  # fmt: skip
PRINTED = {"t_in": "t_in", "t_out": "t_out", "speed_in": "entry speed", "peak_force": "peak force"}


class Site(NamedTuple):
    """Where a contact is.

    Attributes
    ----------
    z : m along the scene's own beam, NaN elsewhere. place : in words. side : "below" or "above" a beam, else "".
    direction : the way the place moves as the gap closes; of an element the way its deformation counts; of a circular
        clearance both.
    """

    z: float
    place: str
    side: str
    direction: str

    @property
    def rotation(self) -> bool:
        """Whether it acts on a rotation: rad and N m."""
        return self.direction.removeprefix("-").startswith("r")


def site(acting: Any, push: float, body: int, rotation: bool, always: bool, plane: bool) -> Site:
    """The site of one contact.

    Parameters
    ----------
    acting : z, or (place, direction), of a circular clearance (place, both directions). push : +1 from below, -1 from
        above or ahead. body : its number. rotation, always : as of `ContactRow`. plane : whether the body is a `Beam`.

    Examples
    --------
    >>> site(0.3, 1.0, 0, False, False, plane=True)
    Site(z=0.3, place='0.3 m', side='below', direction='-y')
    >>> site(("lever", "-x"), 1.0, 1, False, False, plane=False)
    Site(z=nan, place='lever of body 1', side='', direction='-x')
    """
    place, way = acting if isinstance(acting, tuple) else (acting, None)
    node = is_whole(place) and not plane and not body
    words = str(place) if node else place_words((body, place) if body else place)
    z = float(place) if plane and not body else np.nan
    side = "" if always or not plane else "below" if push > 0 else "above"
    if push == 0.0:
        return Site(z, words, "", ", ".join(_direction_words(one) for one in way))
    own = tuple(-push * part for part in (TURN if rotation else UP))
    return Site(z, words, side, named(own) if way is None else _direction_words(way))


def _direction_words(way: Any) -> str:
    """A direction in words."""
    return named(direction_of(way, "a contact"))


@dataclass(frozen=True, eq=False, repr=False)
class PlacedLog(solvers.ContactLog, Printed):
    """A log of contacts that knows where its stops are; prints as a table.

    Attributes
    ----------
    sites : of all stops and elements. z, place, side, direction : of each contact, arrays, see `Site`. Tables have z
        and side where all stops are on the scene's own beam, else place and direction.
    """

    sites: tuple[Site, ...] = field(default=(), kw_only=True)

    @classmethod
    def of(cls, log: solvers.ContactLog, sites: Iterable[Site]) -> PlacedLog:
        """The log with its sites."""
        return cls(**log.arrays(), names=log.names, sites=tuple(sites))

    @property
    def z(self) -> NDArray[np.float64]:
        """Place along the scene's own beam, m."""
        return self._of_sites("z")

    @property
    def place(self) -> NDArray[Any]:
        """Place in words."""
        return self._of_sites("place")

    @property
    def side(self) -> NDArray[Any]:
        """Side of the beam."""
        return self._of_sites("side")

    @property
    def direction(self) -> NDArray[Any]:
        """The way the place moves as the gap closes."""
        return self._of_sites("direction")

    def _of_sites(self, name: str) -> NDArray[Any]:
        """Something of the site of each contact."""
        column = [getattr(one, name) for one in self.sites]
        return np.array(column, dtype=float if name == "z" else object)[self.stop]

    @property
    def where(self) -> dict[str, Any]:
        """The two columns that say where each contact is."""
        return {head: getattr(self, head) for head in self.heads}

    @property
    def heads(self) -> tuple[str, str]:
        """Names of these columns."""
        return ("z", "side") if all(is_finite(one.z) for one in self.sites) else ("place", "direction")

    def named_arrays(self) -> dict[str, Any]:
        """The columns by name: index and name of the stop, where it is, then numbers."""
        stop, name, *others = super().named_arrays().items()
        return dict([stop, name, *self.where.items(), *others])

    def table(self) -> list[dict[str, Any]]:
        """One contact a row."""
        return by_rows(self.named_arrays())

    def unit(self, column: str) -> str:
        """Unit of a column; "m or rad" where stops of both kinds share it."""
        rotations = (one.rotation for one in self.sites)
        return unit_of(QUANTITIES[column], rotations) if column in QUANTITIES else UNITS.get(column, "")

    def head(self, column: str) -> str:
        """Name and unit of a column, for printed tables."""
        return f"{PRINTED.get(column, column)} / {unit}" if (unit := self.unit(column)) else column

    @property
    def parts(self) -> list[Part]:
        """The first contacts as a table; of none nothing."""
        known = self.named_arrays()
        shown = [*list(known)[1:4], "stop", *PRINTED]
        rows = list(zip(*(known[name][:MOST_PRINTED].tolist() for name in shown), strict=True))
        left = len(self) - len(rows)
        more: list[Part] = [f"and {counted(left, 'contact')} more"] if left else []
        return [([self.head(name) for name in shown], rows), *more] if rows else []

    def _parts(self) -> list[Part]:
        return [repr(self), *self.parts]
