"""What all bodies with named dofs share: nodes, points, components, lines of figures, rows of a place."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import fields
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fembeam.structures.assembled import COMPONENTS
from fembeam.structures.checks import Label
from fembeam.structures.directions import nearest
from fembeam.support import require

Vector = NDArray[np.float64]


class NamedBody:
    """A body whose dofs are named (node, component); `labels`, `nodes`, `points` and `edges` are fields of each kind.

    A place is the name of a point, or a node itself.
    """

    labels: tuple[Label, ...]
    nodes: dict[Hashable, Vector]  # where they are, m
    points: dict[str, Hashable]  # the node of each
    edges: tuple[tuple[Hashable, Hashable], ...]  # lines of figures
    meshed = False  # its matrices are what they are: no elements to choose

    def __getstate__(self) -> dict[str, Any]:
        """The fields alone, for copies and digests: what was made from them when first asked for is made again."""
        return {one.name: getattr(self, one.name) for one in fields(self)}  # type: ignore[arg-type]

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, value in state.items():
            object.__setattr__(self, name, value)

    @cached_property
    def components(self) -> tuple[str, ...]:
        """Those that any of its nodes has."""
        have = {component for _, component in self.labels}
        return tuple(component for component in COMPONENTS if component in have)

    @cached_property
    def dofs(self) -> dict[Hashable, dict[str, int]]:
        """{node: {component: number of the dof}}."""
        found: dict[Hashable, dict[str, int]] = {}
        for number, (node, component) in enumerate(self.labels):
            found.setdefault(node, {})[component] = number
        return found

    def places(self) -> list[Any]:
        """All names: points, then nodes."""
        return [*self.points, *self.dofs]

    def check_place(self, place: Any, where: str) -> None:
        """Raise ValueError unless the place is a point or a node; the message names the nearest."""
        known = isinstance(place, Hashable) and (place in self.points or place in self.dofs)
        near = "" if known else nearest(place, [*self.points, *self.dofs])
        require(known, f"a place must be a point or a node of the structure; {near}", place, where, "use one of these")

    def node(self, place: Any) -> Hashable:
        """The node of a place."""
        return self.points.get(place, place) if isinstance(place, str) else int(place)

    def components_at(self, place: Any) -> tuple[str, ...]:
        """The components a place has."""
        mine = self.dofs[self.node(place)]
        return tuple(component for component in COMPONENTS if component in mine)

    def position(self, place: Any) -> Vector | None:
        """Where a place is (3,), m; None if the nodes are not known."""
        return self.nodes.get(self.node(place))

    def lines(self) -> list[Vector]:
        """(2, 3) arrays, a line each."""
        return [np.array([self.nodes[a], self.nodes[b]]) for a, b in self.edges]

    def rows(self, place: Any) -> sparse.csr_matrix:
        """A row (c, N) for each of the components, of zeros for those the place has not."""
        self.check_place(place, "rows")
        mine, size = self.dofs[self.node(place)], len(self.labels)
        pairs = [(i, mine[component]) for i, component in enumerate(self.components) if component in mine]
        i, j = zip(*pairs, strict=True)
        return sparse.csr_matrix((np.ones(len(pairs)), (i, j)), shape=(len(self.components), size))


def checked_edges(lines: Iterable[Sequence[Any]], nodes: dict[Hashable, Vector], where: str) -> tuple[Any, ...]:
    """Pairs of nodes; of a chain of several each with the next. ValueError for a node whose place is not known."""
    chains = [tuple(int(n) if isinstance(n, np.integer) else n for n in chain) for chain in lines]
    for chain in chains:
        for node in chain:
            require(node in nodes, f"lines must join nodes whose coordinates are given; {nearest(node, list(nodes))}",
                    node, where, "add it to nodes")  # fmt: skip
    return tuple(pair for chain in chains for pair in pairwise(chain))
