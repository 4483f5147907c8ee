"""A structure given by its matrices: M ü + C u̇ + K u = f, a name for every dof."""

from __future__ import annotations

import os
from collections.abc import Collection, Hashable, Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from fembeam.structures.assembled import COMPONENTS, Assembled
from fembeam.structures.checks import Label, labelled, matrix, placed, positive_mass, sentences, symmetric
from fembeam.structures.massless import following
from fembeam.structures.modes_given import GivenModes
from fembeam.structures.named_body import NamedBody, NamedMatrices, checked_edges
from fembeam.structures.readers import structure_arguments
from fembeam.structures.readers.reading import Source
from fembeam.structures.scale import Scale
from fembeam.support import require

Vector = NDArray[np.float64]
WHERE = "Structure"


@dataclass(frozen=True, eq=False, repr=False, init=False)
class Structure(NamedBody):
    """A body by its matrices, such as another program exports: M ü + C u̇ + K u = f.

    Parameters
    ----------
    K, M : (N, N) stiffness and mass, dense or sparse, symmetric; M positive semidefinite. N/m and kg for displacements.
        Dofs without mass follow the others statically (Guyan).
    C : (N, N) its own viscous damping, N s/m; added to the damping of the scene.
    labels : (node, component) of every dof, in the order of the rows; a node is a number or a name, a component one of
        "x", "y", "z", "rx", "ry", "rz" along global axes. None: dof i is (i, "x").
    nodes : {node: (x, y, z)} in m, of some or all of them: for figures, rigid motions and offsets.
    points : {name: node}: places that a scene speaks of.
    lines : pairs or chains of nodes, drawn in figures.
    scale : `Scale` of the units in which K, M, C and nodes are given; None: SI.

    Raises
    ------
    ValueError : matrices that are not square, finite, symmetric or of one size, M indefinite, labels or points
        that do not fit; the message has the number or the nearest name.

    Notes
    -----
    Supports, masses, springs, stops and loads come with the `Scene`. `check` tells in sentences what was read.

    Examples
    --------
    >>> import numpy as np
    >>> K = 1e4 * np.array([[2.0, -1.0], [-1.0, 1.0]])
    >>> mast = Structure(K, np.eye(2), labels=[(1, "x"), (2, "x")], points={"top": 2})
    >>> mast.components_at("top")
    ('x',)
    """

    K: sparse.csr_matrix
    M: sparse.csr_matrix
    C: sparse.csr_matrix | None
    labels: tuple[Label, ...]
    nodes: dict[Hashable, Vector]
    points: dict[str, Hashable]
    edges: tuple[tuple[Hashable, Hashable], ...]
    root: sparse.csr_matrix | None  # R with RᵀR = K, of a superelement of a frame
    moved: Vector | None  # M r (N, d) of the translations r, of a superelement whose inside is held to the frame

    def __init__(
        self,
        K: Any,
        M: Any,
        C: Any = None,
        labels: Iterable[Any] | None = None,
        nodes: Mapping[Any, ArrayLike] | None = None,
        points: Mapping[str, Any] | None = None,
        lines: Iterable[Sequence[Any]] = (),
        scale: Scale | None = None,
    ) -> None:
        given = {"K": matrix("K", K, WHERE), "M": matrix("M", M, WHERE)}
        given |= {} if C is None else {"C": matrix("C", C, WHERE)}
        for name, one in given.items():
            require(one.shape == given["K"].shape, f"{name} must have the shape of K, {given['K'].shape}", one.shape,
                    WHERE, "match the exports")  # fmt: skip
        names = labelled(labels, given["K"].shape[0], WHERE)
        given = {name: symmetric(name, one, names, WHERE) for name, one in given.items()}
        positive_mass(given["M"], names, WHERE)
        at, named = placed(nodes, points, names, WHERE)
        length = 1.0
        if scale is not None:
            require(isinstance(scale, Scale), "scale must be a Scale of three units", scale, WHERE,
                    "write Scale('mm', 't', 's')")  # fmt: skip
            length, given = float(scale.length), _in_si(given, names, scale)
        values = {
            **{"K": given["K"], "M": given["M"], "C": given.get("C"), "labels": names},
            **{"nodes": {node: length * place for node, place in at.items()}, "points": named},
            **{"edges": checked_edges(lines, at, WHERE), "root": None, "moved": None},
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def knowing(self, root: sparse.csr_matrix | None = None, moved: Vector | None = None) -> Structure:
        """The same with R (k, N), RᵀR = K: low frequencies of stiff bodies to full accuracy; and with M r (N, d)."""
        found = copy(self)
        object.__setattr__(found, "root", root)
        object.__setattr__(found, "moved", moved)
        return found

    @cached_property
    def digest(self) -> str:
        """Twelve characters that tell structures of other numbers or names apart."""
        made = sha256(repr((self.labels, self.points, self.edges)).encode())
        for one in (self.K, self.M, self.C):
            if one is not None:
                made.update(one.indptr.astype(np.int64).tobytes() + one.indices.astype(np.int64).tobytes())
                made.update(one.data.tobytes())
        made.update(b"" if self.moved is None else self.moved.tobytes())
        return made.hexdigest()[:12]

    def __repr__(self) -> str:
        return f"<structure of {len(self.labels)} dofs at {len(self.dofs)} nodes, {self.digest}>"

    @property
    def massless(self) -> list[Label]:
        """The dofs without mass."""
        return [self.labels[i] for i in np.flatnonzero(self.M.diagonal() == 0)]

    def check(self) -> list[str]:
        """What the matrices say, in sentences with numbers: rigid motions, mass, dofs without mass, frequencies."""
        return list(sentences(self))

    def condensed(self, but: Collection[Hashable] = ()) -> Structure:
        """The same without its massless dofs, which follow the others statically, ``but`` those of some nodes."""
        stay = (self.M.diagonal() != 0) | np.array([node in but for node, _ in self.labels])
        T = following(self.M, self.K, self.labels, "Structure.condensed", np.flatnonzero(stay).tolist())
        if T is None:
            return self
        kept = [label for label, stays in zip(self.labels, stay, strict=True) if stays]
        C = None if self.C is None else T.T @ self.C @ T
        points = {name: node for name, node in self.points.items() if node in {one for one, _ in kept}}
        found = Structure(T.T @ self.K @ T, T.T @ self.M @ T, C, kept, self.nodes, points)
        return found if self.moved is None else found.knowing(moved=np.asarray(T.T @ self.moved))

    def turned(self, rotation: Sequence[float]) -> Structure:
        """The same structure turned about the origin: dofs stay along the global axes.

        Parameters
        ----------
        rotation : (3,) rad, a rotation vector: about its direction by its length.

        Raises
        ------
        ValueError : numbers that are none; a node without the dofs that its motion turns into.

        Examples
        --------
        >>> post = Structure([[8.0, 0.0], [0.0, 2.0]], [[1.0, 0.0], [0.0, 1.0]], labels=[("top", "x"), ("top", "y")])
        >>> post.turned((0.0, 0.0, 0.5 * 3.141592653589793)).K.toarray().tolist()
        [[2.0, 0.0], [0.0, 8.0]]
        """
        from fembeam.structures.turning import turned_structure

        return turned_structure(self, rotation)

    def reduced(self, nodes: Sequence[Any], modes: int) -> Structure:
        """The structure as a superelement on some of its nodes, by Craig and Bampton.

        u = Ψ u_b + Φ η: static shapes of the nodes, and modes of the rest with these held.

        Parameters
        ----------
        nodes : nodes or points where joints, supports, loads and stops will be; together they hold the structure.
        modes : of the structure with these held, the lowest; 0 is Guyan's condensation.

        Returns
        -------
        Structure : with all dofs of these nodes, then ("mode 1", "mode"), …; used as often as wanted, turned too. Those
            without mass elsewhere follow statically.

        Raises
        ------
        ValueError : a node that does not exist, modes that are no count or too many, nodes that do not hold it.

        References
        ----------
        R.R. Craig, M.C.C. Bampton, AIAA Journal 6 (1968) 1313.

        Examples
        --------
        >>> import numpy as np
        >>> chain = Structure([[1, -1, 0], [-1, 2, -1], [0, -1, 1]], np.eye(3), labels=[(i, "x") for i in (1, 2, 3)])
        >>> chain.reduced([1, 3], modes=0).K.toarray().tolist()
        [[0.5, -0.5], [-0.5, 0.5]]
        """
        from fembeam.structures.superelement import interface_of, reduced

        listed = [self.node(node) for node in interface_of(nodes, "Structure.reduced")]
        own = self.condensed(listed)
        return reduced(own, own.assembled(), listed, modes, "Structure.reduced")

    @staticmethod
    def read(
        stiffness: Source,
        mass: Source,
        damping: Source | None = None,
        labels: str | os.PathLike[str] | Iterable[Any] | None = None,
        nodes: str | os.PathLike[str] | Mapping[Any, ArrayLike] | None = None,
        points: Mapping[str, Any] | None = None,
        lines: Iterable[Sequence[Any]] = (),
        scale: Scale | None = None,
    ) -> Structure:
        """A structure from files of another program; `readers.read_matrices` lists the formats.

        Parameters
        ----------
        stiffness, mass, damping : a path, or (path, name) where a file has several matrices; of K and KAA, M and MAA in
            one file each takes the one whose name begins with its letter.
        labels : where the format has none (op4, Matrix Market, .npz without them): (node, component) of every row, or
            the path of a .dof, a .mapping or lines "node component". None: six of each of the nodes, ascending, if
            there are so many.
        nodes : {node: (x, y, z)}, or the path of a .bdf, .inp or a table "node x y z".
        points, lines, scale : as for a `Structure`; the scale holds for nodes too.

        Raises
        ------
        ValueError : a truncated or foreign file (what was expected at which line or byte), dofs that do not match.

        Examples
        --------
        >>> import tempfile
        >>> import numpy as np
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     np.savez(folder + "/two.npz", K=np.eye(2) * 4e3, M=np.eye(2), labels=[(7, "x"), (8, "x")])
        ...     body = Structure.read(folder + "/two.npz", folder + "/two.npz", points={"tip": 8})
        >>> body.labels
        ((7, 'x'), (8, 'x'))
        """
        given = structure_arguments(stiffness, mass, damping, labels, nodes)
        return Structure(**given, points=points, lines=lines, scale=scale)

    @staticmethod
    def of_modes(
        omega: ArrayLike,
        shapes: ArrayLike,
        labels: Iterable[Any] | None,
        participation: Mapping[str, ArrayLike] | None = None,
        nodes: Mapping[Any, ArrayLike] | None = None,
        points: Mapping[str, Any] | None = None,
        lines: Iterable[Sequence[Any]] = (),
    ) -> GivenModes:
        """A body by its modes, computed with its supports by another program: q'' + ω² q = φᵀ f - Γ ẍ.

        Parameters
        ----------
        omega : (n,) rad/s, ascending.
        shapes : (d, n) mass-normalised, 1/√kg (rotations rad/(m √kg)), at the dofs of labels.
        labels, nodes, points, lines : as for a `Structure`.
        participation : {"x": Γ (n,)} in √kg for every direction in which the base may move.

        Notes
        -----
        It has no static compliance but that of the given modes: contact forces depend on their number. Supports, masses
        and springs act through the shapes; supports cannot be added.

        Examples
        --------
        >>> body = Structure.of_modes([30.0, 190.0], [[0.5, -0.4]], [("tip", "y")], {"y": [1.2, 0.7]})
        >>> body.components_at("tip")
        ('y',)
        """
        return GivenModes(omega, shapes, labels, participation, nodes, points, lines)

    def assembled(self, elements: int | None = None, modes: int | None = None, places: Sequence[Any] = ()) -> Assembled:
        """The matrices, with rows for places; ValueError for a number of elements, which it does not have."""
        require(elements is None, "elements must be left out: a structure has the matrices it was given", elements,
                "Scene.matrices", "ask for modes, or modes='all'")  # fmt: skip
        along = [c for c in COMPONENTS[:3] if c in self.components]
        moved = np.array([[float(component == c) for c in along] for _, component in self.labels])
        return NamedMatrices(
            *(self.M, self.K, self.labels, self.rows, moved.reshape(len(self.labels), len(along))),
            root=self.root,
            C=self.C,
            moved=self.moved,
            accuracy=f"{len(self.labels)} dofs as they were given",
            body=self,
        )


def _in_si(given: dict[str, sparse.csr_matrix], labels: tuple[Label, ...], scale: Scale) -> dict[str, Any]:
    """M, C, K in SI: mass · timeᵏ, times a length for every rotation of an entry."""
    modes = [label for label in labels if label[1] == "mode"]
    require(not modes, "a scale needs displacements and rotations, no generalised coordinates", modes[:1], WHERE,
            "export in SI")  # fmt: skip
    turning = sparse.diags([float(scale.length) if component[0] == "r" else 1.0 for _, component in labels])
    units = {"M": float(scale.mass), "C": scale.damping, "K": scale.stiffness}
    return {name: (units[name] * (turning @ one @ turning)).tocsr() for name, one in given.items()}
