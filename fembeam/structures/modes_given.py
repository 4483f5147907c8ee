"""A structure given by its modes, as every program can write them: ω, shapes at named dofs, participation."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from fembeam.structures.assembled import COMPONENTS, Assembled
from fembeam.structures.checks import Label, labelled, placed, real
from fembeam.structures.named_body import NamedBody, NamedMatrices, checked_edges
from fembeam.support import require

Vector = NDArray[np.float64]
WHERE = "Structure.of_modes"


@dataclass(frozen=True, eq=False, repr=False, init=False)
class GivenModes(NamedBody):
    """A body by modes that another program computed, supports included; made by `Structure.of_modes`.

    Attributes
    ----------
    omega : (n,) rad/s. shapes : (d, n) mass-normalised, 1/√kg, at the d labelled dofs.
    participation : {direction: Γ (n,)} in √kg.
    """

    omega: Vector
    shapes: Vector
    labels: tuple[Label, ...]
    participation: dict[str, Vector]
    nodes: dict[Hashable, Vector]
    points: dict[str, Hashable]
    edges: tuple[tuple[Hashable, Hashable], ...]

    def __init__(
        self,
        omega: ArrayLike,
        shapes: ArrayLike,
        labels: Iterable[Any] | None,
        participation: Mapping[str, ArrayLike] | None = None,
        nodes: Mapping[Any, ArrayLike] | None = None,
        points: Mapping[str, Any] | None = None,
        lines: Iterable[Sequence[Any]] = (),
    ) -> None:
        omega, shapes = real("omega", omega, WHERE), real("shapes", shapes, WHERE)
        w, phi = np.atleast_1d(np.array(omega, dtype=float)), np.array(shapes, dtype=float)
        valid = w.ndim == 1 and w.size > 0 and bool(np.all(np.isfinite(w) & (w >= 0)) and np.all(np.diff(w) >= 0))
        require(valid, "omega must be (n,), finite, at least 0 and ascending", omega, WHERE, "give rad/s")
        right = phi.ndim == 2 and phi.shape[1] == w.size and bool(np.isfinite(phi).all())
        require(right, f"shapes must be finite and have a row for each dof and {w.size} columns, one for each omega",
                phi.shape, WHERE, "transpose them if need be")  # fmt: skip
        names = labelled(labels, len(phi), WHERE)
        require(participation is None or isinstance(participation, Mapping),
                "participation must name its directions", participation, WHERE, "write {'x': ...}")  # fmt: skip
        gamma: dict[str, Vector] = {}
        for direction, given in (participation or {}).items():
            value = np.array(real("participation", given, WHERE), dtype=float)
            require(direction in COMPONENTS[:3], "participation must be named 'x', 'y' or 'z'", direction, WHERE,
                    "write {'x': ...}")  # fmt: skip
            fits = value.shape == w.shape and bool(np.isfinite(value).all())
            require(fits, f"participation along {direction} must be {w.size} finite numbers", value.shape, WHERE,
                    "give Γ of every mode in √kg")  # fmt: skip
            gamma[str(direction)] = value
        at, named = placed(nodes, points, names, WHERE)
        values: dict[str, Any] = {"omega": w, "shapes": phi, "labels": names, "participation": gamma, "nodes": at}
        for name, value in {**values, "points": named, "edges": checked_edges(lines, at, WHERE)}.items():
            object.__setattr__(self, name, value)

    @property
    def base_directions(self) -> tuple[str, ...]:
        """Directions in which the base can move: those whose participation is known."""
        return tuple(c for c in COMPONENTS[:3] if c in self.participation)

    @cached_property
    def digest(self) -> str:
        """Twelve characters that tell bodies of other numbers or names apart."""
        made = sha256(repr((self.labels, self.points, self.edges, sorted(self.participation))).encode())
        for one in (self.omega, self.shapes, *self.participation.values()):
            made.update(one.tobytes())
        return made.hexdigest()[:12]

    def __repr__(self) -> str:
        return f"<structure of {len(self.omega)} given modes at {len(self.dofs)} nodes, {self.digest}>"

    def rows_of(self, places: Sequence[Any]) -> sparse.csr_matrix:
        """A row (c, n) for each of the components of places: the modes' values there."""
        return sparse.csr_matrix(super().rows_of(places) @ self.shapes)

    def check(self) -> list[str]:
        """What the modes say, in sentences with numbers: frequencies, effective masses."""
        listed = ", ".join(f"{w / (2 * np.pi):.6g}" for w in self.omega[:6])
        mass = ", ".join(f"{gamma @ gamma:.6g} kg along {c}" for c, gamma in self.participation.items())
        return [
            f"{self!r}: nodes move along {', '.join(self.components)}",
            f"lowest frequencies: {listed} Hz",
            f"effective masses: {mass}" if mass else "no participation was given: the base cannot move",
        ]

    def assembled(self, elements: int | None = None, modes: int | None = None, places: Sequence[Any] = ()) -> Assembled:
        """M = 1, K = diag(ω²); a base motion along x loads with -Γ_x ẍ."""
        require(elements is None, "elements must be left out: a structure has the modes it was given", elements,
                "Scene.matrices", "ask for modes, or modes='all'")  # fmt: skip
        n, along = len(self.omega), self.base_directions
        return NamedMatrices(
            *(sparse.eye(n, format="csr"), sparse.diags(self.omega**2).tocsr()),
            *(tuple((i, "mode") for i in range(n)), self.rows),
            np.array([self.participation[c] for c in along]).reshape(len(along), n).T,
            root=sparse.diags(self.omega).tocsr(),
            accuracy=f"{n} modes as they were given",
            body=self,
        )
