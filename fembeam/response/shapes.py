"""Mode shapes of a beam between its nodes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam.beams import hermite_rows
from fembeam.scene import at_parts, require_number
from fembeam.support import numbers, require

Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Shapes:
    """Shape functions φ_i(z): values (2m, n) of (u, u_z) at the nodes (m,), the elements' cubics between.

    `carried` (2m, k): what supports that move carry by themselves, per unit of each of their k dofs, of all beams.
    """

    nodes: Vector
    values: Vector
    carried: Vector = field(default_factory=lambda: np.zeros((0, 0)), repr=False)
    parts: Mapping[str, float] = field(default_factory=dict, repr=False)  # z of those that have a name
    named = False  # whether places have names and directions, see `PlacedShapes`

    def __repr__(self) -> str:
        return f"<{self.values.shape[1]} shapes over {self.nodes[0]:g} to {self.nodes[-1]:g} m>"

    @property
    def moving(self) -> int:
        """Number k of the dofs of supports that move, of all bodies."""
        return int(self.carried.shape[1])

    @property
    def words(self) -> dict[str, Any] | None:
        """For JSON what supports that move carry, and parts with names; None where there are neither."""
        found = [[int(dof), int(i), float(self.carried[dof, i])] for dof, i in np.argwhere(self.carried)]
        words = {"moving": self.moving, "carried": found, "parts": dict(self.parts)}
        return words if self.moving or self.parts else None

    @classmethod
    def of_words(cls, words: Mapping[str, Any] | None, nodes: Vector, values: Vector) -> Shapes:
        """The same of a file."""
        if words is None:
            return cls(nodes, values)
        carried = np.zeros((2 * len(nodes) if words["moving"] else 0, int(words["moving"])))
        for dof, i, value in words["carried"]:
            carried[dof, i] = value
        return cls(nodes, values, carried, {name: float(z) for name, z in words.get("parts", {}).items()})

    def place(self, z: Any) -> Any:
        """The same place, or places, with z for names of parts."""
        require_number(z, self.parts, "Run")
        return at_parts(z, self.parts)

    def rows_with_supports(self, z: ArrayLike, derivative: int = 0) -> Vector:
        """φ(z) (…, n + k), with what supports that move carry."""
        own = self(z, derivative)
        if not self.moving:
            return own
        places = np.asarray(z, dtype=float)
        carried = hermite_rows(self.nodes, places.ravel(), derivative) @ self.carried
        return np.concatenate([own, carried.reshape(*places.shape, self.moving)], axis=-1)

    def __call__(self, z: ArrayLike, derivative: int = 0) -> Vector:
        """φ(z): (n,) at one z, (k, n) at z (k,); derivative 1 is the slope, 2 the curvature."""
        places = numbers("z", z, "phi", "give m along the beam")
        outside = ~((places >= self.nodes[0]) & (places <= self.nodes[-1]))
        require(not np.any(outside), f"z must lie on the beam, 0 to {self.nodes[-1]} m",
                places[outside].tolist(), "phi", "keep to the beam")  # fmt: skip
        rows = hermite_rows(self.nodes, places.ravel(), derivative) @ self.values
        return rows.reshape(*places.shape, self.values.shape[1])
