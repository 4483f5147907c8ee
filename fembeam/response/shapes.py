"""Mode shapes of a beam between its nodes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam.beams import hermite_rows
from fembeam.support import require

Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Shapes:
    """Shape functions φ_i(z): values (2m, n) of (u, u_z) at the nodes (m,), the elements' cubics between."""

    nodes: Vector
    values: Vector

    def __repr__(self) -> str:
        return f"<{self.values.shape[1]} shapes over {self.nodes[0]:g} to {self.nodes[-1]:g} m>"

    def __call__(self, z: ArrayLike, derivative: int = 0) -> Vector:
        """φ(z): (n,) at one z, (k, n) at z (k,); derivative 1 is the slope, 2 the curvature."""
        places = np.asarray(z, dtype=float)
        outside = ~((places >= self.nodes[0]) & (places <= self.nodes[-1]))
        require(not np.any(outside), f"z must lie on the beam, 0 to {self.nodes[-1]} m",
                places[outside].tolist(), "phi", "keep to the beam")  # fmt: skip
        rows = hermite_rows(self.nodes, places.ravel(), derivative) @ self.values
        return rows.reshape(*places.shape, self.values.shape[1])
