"""Bodies joined at places: equal displacements and rotations, B q = 0, which leave q = T q̂.

    M̂ = Tᵀ M T,    K̂ = Tᵀ K T

with M and K of all bodies as blocks. Of every condition one unknown is eliminated, the one with the largest factor; so
equal dofs of two nodes become one.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse

from fembeam.structures.assembled import COMPONENTS, Assembled
from fembeam.support import is_numbered, is_whole, require, require_place, tuples

Vector = NDArray[np.float64]

DEPENDENT = 1e-9  # relative: a condition that others imply


class Body(Protocol):
    """What has places that move along components."""

    components: Any

    def check_place(self, place: Any, where: str) -> None:
        """Raise ValueError unless the place exists."""

    def components_at(self, place: Any) -> tuple[str, ...]:
        """How a place moves."""


@dataclass(frozen=True)
class Joint:
    """A place of the first body joined to a place of another one.

    Parameters
    ----------
    place : on the first body, number 0.
    to : (number of the other body, from 1, its place).
    dofs : components made equal, such as "xyz" for a ball hinge or ("x", "y", "rz"); None: all that both places have.
    body : number of the body that `place` is on.

    Raises
    ------
    ValueError : no numbers of bodies, components that do not exist.

    Examples
    --------
    >>> Joint("D", to=(1, "flange"), dofs="xyz").dofs
    ('x', 'y', 'z')
    """

    place: Any
    to: tuple[int, Any]
    dofs: str | Sequence[str] | None = None
    body: int = 0

    def __post_init__(self) -> None:
        paired = is_numbered(self.to)
        require(paired, "to must be (number of a body, its place)", self.to, "Joint", "write to=(1, 'flange')")
        for number in (self.body, self.to[0]):
            require(is_whole(number) and number >= 0, "bodies must be counted from 0, the first", number, "Joint",
                    "write to=(1, 'flange')")  # fmt: skip
        require(self.body != self.to[0], "a joint must join two bodies", self.to, "Joint", "name another body")
        require_place(self.place, self)
        require_place(self.to[1], self)
        object.__setattr__(self, "to", (int(self.to[0]), tuples(self.to[1])))
        object.__setattr__(self, "place", tuples(self.place))
        if self.dofs is not None:
            listed = tuple(self.dofs) if isinstance(self.dofs, Iterable) else ()
            right = bool(listed) and all(dof in COMPONENTS for dof in listed) and len(set(listed)) == len(listed)
            require(right, f"dofs must be some of {', '.join(COMPONENTS)}, each once", self.dofs, "Joint",
                    "write 'xyz' for a ball hinge, or ('x', 'y', 'rz')")  # fmt: skip
            object.__setattr__(self, "dofs", listed)


def joined_fields(bodies: Sequence[Body], made: Sequence[Assembled], T: sparse.csr_matrix, free: Any) -> dict[str, Any]:
    """Fields of the `Assembled` of all bodies but its rows, by a T that `joining` made."""
    labels = [((number, name), component) for number, one in enumerate(made) for name, component in one.labels]
    roots = [one.root for one in made if one.root is not None]
    root = sparse.block_diag(roots, format="csr") @ T if len(roots) == len(made) else None
    return {
        **{name: _joined(made, name, T) for name in ("M", "K", "C", "gyroscopic")},
        "labels": tuple(labels[i] for i in free),
        "translations": _shared(bodies, made, "translations")[free],
        "root": None if root is None else root.tocsr(),
        "accuracy": "; ".join(one.accuracy for one in made if one.accuracy),
        "moved": None
        if all(one.moved is None for one in made)
        else np.asarray(T.T @ _shared(bodies, made, "base_loads")),
    }


def joining(
    bodies: Sequence[Body], made: Sequence[Assembled], joints: Sequence[Joint]
) -> tuple[sparse.csr_matrix, NDArray[np.int64]]:
    """T (N, N̂) with q = T q̂, and which unknowns of all bodies, in their order, the q̂ are."""
    first = np.cumsum([0, *(one.M.shape[0] for one in made)])
    size = int(first[-1])
    B, names = sparse.csr_matrix((0, size)), []
    for index, joint in enumerate(joints):
        where = f"joints[{index}]"
        B = sparse.vstack([B, _conditions(bodies, made, first, joint, where)], format="csr")
        names += [f"{component!r} of {where}" for component in shared_dofs(bodies, joint, where)]
    if not names:
        return sparse.eye(size, format="csr"), np.arange(size)
    columns = np.flatnonzero(np.diff(B.tocsc().indptr))
    dense = B[:, columns].toarray()
    _independent(dense, names)
    _, _, order = linalg.qr(dense, mode="economic", pivoting=True)
    gone, stay = order[: len(names)], np.sort(order[len(names) :])
    follow = -np.linalg.solve(dense[:, gone], dense[:, stay])
    follow[np.abs(follow) < DEPENDENT] = 0.0
    free = np.setdiff1d(np.arange(size), columns[gone])
    T = sparse.lil_matrix((size, len(free)))
    T[free, np.arange(len(free))] = 1.0
    T[np.ix_(columns[gone], np.searchsorted(free, columns[stay]))] = follow
    return T.tocsr(), free


def _conditions(
    bodies: Sequence[Body], made: Sequence[Assembled], first: Any, joint: Joint, where: str
) -> sparse.csr_matrix:
    """Rows of one joint on the unknowns of all bodies: motion here less motion there."""
    shared = shared_dofs(bodies, joint, where)
    parts = []
    for sign, (number, place) in ((1.0, (joint.body, joint.place)), (-1.0, joint.to)):
        known = list(bodies[number].components)
        rows = made[number].rows(place)[[known.index(name) for name in shared]]
        before, after = int(first[number]), int(first[-1] - first[number + 1])
        blank = [sparse.csr_matrix((len(shared), count)) for count in (before, after)]
        parts.append(sign * sparse.hstack([blank[0], rows, blank[1]], format="csr"))
    return parts[0] + parts[1]


def shared_dofs(bodies: Sequence[Body], joint: Joint, where: str) -> list[str]:
    """The components a joint makes equal; ValueError for bodies, places, components that do not exist."""
    there = []
    for number, place in ((joint.body, joint.place), joint.to):
        require(number < len(bodies), f"a joint must name bodies below {len(bodies)}", number, where, "add the body")
        bodies[number].check_place(place, where)
        there.append(bodies[number].components_at(place))
    common = [name for name in COMPONENTS if all(name in known for known in there)]
    wanted = common if joint.dofs is None else list(joint.dofs)
    missing = [name for name in wanted if name not in common]
    require(not missing and bool(wanted), f"both places of a joint must move along its dofs; they share "
            f"{', '.join(common) or 'none'}", missing or joint.dofs, where, "choose among these")  # fmt: skip
    return wanted


def _independent(B: Vector, names: list[str]) -> None:
    """Raise ValueError, with the names, for the first condition that those before it imply."""
    Q = np.zeros((0, B.shape[1]))
    for row, name in zip(B, names, strict=True):
        left = row - Q.T @ (Q @ row)
        left -= Q.T @ (Q @ left)  # twice is enough
        size = float(np.linalg.norm(left))
        require(size > DEPENDENT * float(np.linalg.norm(row)), "joints must not fix one motion twice", name, "joints",
                "leave it out of one of them")  # fmt: skip
        Q = np.vstack([Q, left / size])


def _shared(bodies: Sequence[Body], made: Sequence[Assembled], name: str) -> Vector:
    """`translations` or `base_loads` (N, d) of all bodies, along the axes that all of them have."""
    axes = [translations_of(one) for one in bodies]
    shared = [axis for axis in COMPONENTS[:3] if all(axis in known for known in axes)]
    pairs = zip(made, axes, strict=True)
    return np.vstack([getattr(one, name)[:, [known.index(axis) for axis in shared]] for one, known in pairs])


def translations_of(body: Any) -> list[str]:
    """Along which of x, y, z a body moves with the frame."""
    return [name for name in COMPONENTS[:3] if name in getattr(body, "base_directions", body.components)]


def _joined(made: Sequence[Assembled], name: str, T: sparse.csr_matrix) -> sparse.csr_matrix | None:
    """TᵀAT of a matrix of all bodies, zero of those without; None where none has it."""
    if all(getattr(one, name) is None for one in made):
        return None
    blocks = [sparse.csr_matrix(one.M.shape) if (own := getattr(one, name)) is None else own for one in made]
    return (T.T @ sparse.block_diag(blocks, format="csr") @ T).tocsr()
