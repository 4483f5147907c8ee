"""Histories of the stops, elements and impactors of a run: indentation, rate, motion; their names and units."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fembeam.scene import unit_of
from fembeam.support import require

Vector = NDArray[np.float64]


class ContactHistories:
    """Histories of every contact of a `Run`, whose fields these are."""

    q: Vector
    q_dot: Vector
    stops: Vector
    directions: Vector
    impactor_masses: Vector
    kinds: NDArray[np.bool_]

    def impactor_displacement(self, impactor: int = 0) -> Vector:
        """x(t) (k,) of an impactor from its place at the start, relative to the frame, m."""
        return self._of_impactor(self.q, impactor)

    def impactor_velocity(self, impactor: int = 0) -> Vector:
        """ẋ(t) (k,) of an impactor relative to the frame, m/s."""
        return self._of_impactor(self.q_dot, impactor)

    def _of_impactor(self, coordinates: Vector, impactor: int) -> Vector:
        """One of the last columns, without its √m."""
        count = len(self.impactor_masses)
        require(0 <= impactor < count, f"impactor must be below {count}, the number of impactors", impactor, "Run",
                "count from 0")  # fmt: skip
        return coordinates[:, coordinates.shape[1] - count + impactor] / np.sqrt(self.impactor_masses[impactor])

    def unit(self, quantity: str, stop: int | None = None) -> str:
        """Unit of "indentation", "speed", "force" or "impulse" of a stop; None: of a column that all of them share."""
        return unit_of(quantity, self.kinds[:, 0] if stop is None else self.kinds[[self._stop(stop)], 0])

    def name(self, stop: int) -> str:
        """What tables call a stop or element: "stop 0", "element 1", "stop 2 (rotation)"."""
        rotation, always = self.kinds[self._stop(stop)]
        return f"{'element' if always else 'stop'} {stop}" + " (rotation)" * bool(rotation)

    def indentation(self, stop: int = 0) -> Vector:
        """δ(t) (k,) of a stop, m or rad; negative while it is open. Elements, then impactors, count on after the stops.

        Of an element its deformation d(t).
        """
        return -self.q @ self.directions[self._stop(stop)] - self.stops[stop, 2]

    def indentation_rate(self, stop: int = 0) -> Vector:
        """δ̇(t) (k,) of a stop or element, m/s or rad/s: of both bodies where the stop moves."""
        return -self.q_dot @ self.directions[self._stop(stop)]

    def _stop(self, stop: int) -> int:
        """The number of a contact, checked."""
        count = len(self.stops)
        whole = isinstance(stop, (int, np.integer))
        require(whole and -count <= stop < count, f"stop must be below {count}, the number of stops", stop, "Run",
                "count from 0")  # fmt: skip
        return stop
