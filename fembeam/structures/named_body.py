"""What all bodies with named dofs share: nodes, points, components, lines of figures, rows of a place."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fembeam.structures.assembled import COMPONENTS, Assembled
from fembeam.structures.checks import Label
from fembeam.structures.directions import nearest
from fembeam.support import require

Vector = NDArray[np.float64]
PAIRS = "write [(20, 40), (40, 88)]"


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
        return self.rows_of([place])

    def rows_of(self, places: Sequence[Any]) -> sparse.csr_matrix:
        """The same of several places, one below the other."""
        pairs, count = [], len(self.components)
        for first, place in zip(range(0, count * len(places), count), places, strict=True):
            self.check_place(place, "rows")
            mine = self.dofs[self.node(place)]
            pairs += [(first + i, mine[name]) for i, name in enumerate(self.components) if name in mine]
        i, j = np.array(pairs, dtype=int).reshape(-1, 2).T
        return sparse.csr_matrix((np.ones(len(pairs)), (i, j)), shape=(count * len(places), len(self.labels)))


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class NamedMatrices(Assembled):
    """Matrices of a body whose dofs are named, and that body."""

    body: NamedBody

    def rows_of(self, places: Sequence[Any]) -> sparse.csr_matrix:
        """`rows` of several places, one below the other, all at once."""
        return self.body.rows_of(places)


def checked_edges(lines: Any, nodes: dict[Hashable, Vector], where: str) -> tuple[Any, ...]:
    """Pairs of nodes; of a chain of several each with the next. ValueError for a node whose place is not known."""
    listed = isinstance(lines, Iterable) and not isinstance(lines, (str, Mapping))
    require(listed, "lines must be a list", lines, where, PAIRS)
    chains = []
    for chain in lines:
        found = tuple(chain) if isinstance(chain, Iterable) and not isinstance(chain, str) else ()
        require(len(found) > 1, "each of lines must be two nodes, or a chain of more", chain, where, PAIRS)
        chains.append(tuple(int(n) if isinstance(n, np.integer) else n for n in found))
    for chain in chains:
        for node in chain:
            require(isinstance(node, Hashable), "lines must join names or numbers of nodes", node, where, PAIRS)
            require(node in nodes, f"lines must join nodes whose coordinates are given; {nearest(node, list(nodes))}",
                    node, where, "add it to nodes")  # fmt: skip
    return tuple(pair for chain in chains for pair in pairwise(chain))
