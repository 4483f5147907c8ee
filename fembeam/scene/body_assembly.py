"""From a scene whose body is not a `Beam` to M, C, K on its free dofs: what the body gives, and what sits on it.

M = M_body + Σ masses,  K = K_body + Σ k n nᵀ,  C = C_body + Σ c n nᵀ  with n the row of a place and direction,
u_all = S u: zero where supports hold, static (Guyan) where there is no mass.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

import reduction
from fembeam.beams import MESHED_MODES, MOST_MODES
from fembeam.scene.assembly import UNIT, Matrices, Vector, main_load, moved_by_rows, moving
from fembeam.scene.places import place_words, quoted
from fembeam.scene.rigid_motions import MOST_RIGID
from fembeam.scene.rotors import Disk, gyroscopic, shaft_axes
from fembeam.scene.signals import support_motion
from fembeam.structures import (
    Assembled,
    Frame,
    Six,
    arm_matrix,
    check_buckling,
    following,
    named,
    rows_along,
    translations_of,
)
from fembeam.support import require, warn

if TYPE_CHECKING:
    from fembeam.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class BodyMatrices(Matrices):
    """Full matrices of a scene whose body has places by name; see `Matrices` for M, C, K, root, dashpots, damping.

    Attributes
    ----------
    beam : the body. assembled : what it gave, on all its dofs.
    spread : S (N_all, N) sparse: free dofs to all.
    along : {direction: base load (N,)}. massless : labels of dofs that follow the others statically.
    """

    assembled: Assembled = None  # type: ignore[assignment]
    spread: sparse.csr_matrix = None
    along: dict[str, Vector] = field(default_factory=dict)
    massless: tuple[Any, ...] = ()
    named = True

    @property
    def base_loads(self) -> dict[str, Vector]:
        """The load (N,) of every direction in which the frame may move."""
        return self.along

    def own_row(self, place: Any, along: Six) -> sparse.csr_matrix:
        """The motion (1, N) of a place along a direction, on the body's own free dofs."""
        return (rows_along(self.beam, self.assembled, place, along) @ self.spread).tocsr()

    def _row_on_all(self, place: Any, along: Six) -> sparse.csr_matrix:
        """Row (1, N_all) of a place along a direction, supported dofs included."""
        return rows_along(self.beam, self.assembled, place, along)

    def _on_all(self, scene: Scene) -> Matrices:
        """Matrices of a scene without supports, on dofs without mass too."""
        return _of(scene, self.assembled, self.modes, held=np.zeros(0, dtype=int), condense=False)

    def frequency_error(self, omega: ArrayLike) -> Vector:
        """Zeros: the matrices are what the structure is."""
        return 0.0 * np.asarray(omega, dtype=float)

    @cached_property
    def influence(self) -> Vector:
        """ValueError: its dofs move along several directions."""
        raise ValueError("influence is known of a Beam only, got a body with directions in Matrices; use base_loads")

    @property
    def accuracy(self) -> str:
        """What the body says of its matrices, and what became of them."""
        static = f", {len(self.massless)} of them without mass follow statically" if self.massless else ""
        beside = ", with those of further bodies" if self.bodies else ""
        return f"{self.assembled.accuracy}{static}; {self.M.shape[0]} free{beside}"


def respun(matrices: Matrices, before: Scene, after: Scene) -> BodyMatrices | None:
    """The matrices of a scene that differs in the spin of its shaft alone, where only G does; None of any other."""
    spins = [getattr(scene.beam, "spin", 0.0) for scene in (before, after)]
    if not isinstance(matrices, BodyMatrices) or matrices.bodies or matrices.carried is not None or 0.0 in spins:
        return None
    if replace(after, beam=replace(after.beam, spin=spins[0])) != before:
        return None
    own, both = matrices.assembled.gyroscopic, matrices.gyroscopic
    if own is None or both is None:
        return None
    ratio = spins[1] / spins[0]
    body = replace(matrices.assembled, gyroscopic=ratio * own)
    return replace(matrices, beam=after.beam, assembled=body, gyroscopic=ratio * both)


def body_matrices(scene: Scene, elements: int | None, modes: int | None, probes: Sequence[Any]) -> BodyMatrices:
    """The matrices of the scene's own body; of one without a mesh of its own `modes` does not matter."""
    for index, place in enumerate(probes):
        scene.beam.check_place(place, f"probes[{index}] of Scene.matrices")
    if hasattr(scene.beam, "check_held"):
        scene.beam.check_held(_holding(scene), "Scene")
    assembled = _made(scene, elements, modes, (*scene.places, *probes))
    held = _held(scene, assembled)
    require(len(held) < assembled.M.shape[0], "supports must leave dofs free", len(held), "Scene", "remove one")
    found = _of(scene, assembled, modes, held, condense=True)
    if elements is None and all(isinstance(one, Frame) for one in getattr(scene.beam, "bodies", (scene.beam,))):
        found = replace(found, limit=_limit(scene, found))
    moved = [_dof(scene, assembled, support, dof) for support in scene.supports for dof in support_motion(support)]
    if moved:
        require(not found.massless, "a support that moves needs mass on all dofs", found.massless[:3], "Scene",
                "condense the structure first")  # fmt: skip
        M, K, C, _ = _with_parts(scene, assembled)
        carried = sparse.eye(M.shape[0], format="csr")[:, moved]
        found = replace(found, **moving(M, K, C, found.spread, carried, gyroscopic(scene, assembled)))
    _warn_of_massless(scene, found)
    _check_moving(scene, found)
    return found


def _limit(scene: Scene, matrices: BodyMatrices) -> dict[str, float]:
    """The mass that a motion of the frame moves in each direction in the limit of fine meshes, kg."""
    assembled, masses = matrices.assembled, _masses(scene, matrices.assembled)
    free = np.unique(matrices.spread.tocoo().row)
    body = np.diag(assembled.translations.T @ (assembled.M @ assembled.translations))
    return {
        way: float(own) + moved_by_rows(masses, free, r)
        for way, own, r in zip(matrices.along, body, assembled.translations.T, strict=True)
    }


def _dof(scene: Scene, assembled: Assembled, support: Any, component: str) -> int:
    """Number of the dof that a support holds."""
    row = assembled.rows(support.z).tocsr()[scene.beam.components.index(component)]
    return int(row.indices[0])


def _check_moving(scene: Scene, matrices: BodyMatrices) -> None:
    """Raise ValueError where a stop or element acts on nothing that can move against something else."""
    for name in ("stops", "elements"):
        for index, part in enumerate(getattr(scene, name)):
            for place in part.coordinates:
                if place.to is None or place.to[0] == 0:
                    moves = abs(place.row(matrices)).max() > UNIT
                    along = f" along {named(place.along)}" if len(part.coordinates) > 1 else ""
                    rule = f"what stops and elements act on must be free to move{along}"
                    at = place_words(part.z) + (f" on {place.to_words}" if place.to else "")
                    advice = "supports or joints hold it, or both ends are one; move it"
                    require(moves, rule, at, f"{name}[{index}]{part.quoted} of Scene", advice)


def _warn_of_massless(scene: Scene, matrices: BodyMatrices) -> None:
    """Warn where something acts on dofs without mass, whose own compliance no mode has."""
    bare = {matrices.assembled.labels.index(label) for label in matrices.massless}
    for name in ("stops", "elements", "forces") if bare else ():
        for index, part in enumerate(getattr(scene, name)):
            rows = [rows_along(scene.beam, matrices.assembled, part.z, place.along) for place in part.coordinates]
            if hit := bare & {dof for row in rows for dof in row.indices.tolist()}:
                label = matrices.assembled.labels[min(hit)]
                warn(f"{name}[{index}] acts on {label}, a dof without mass that follows the others: its own "
                     "compliance is left out; give the place a mass")  # fmt: skip


def _made(scene: Scene, elements: int | None, modes: int | None, places: tuple[Any, ...]) -> Assembled:
    """The body's matrices, of a frame on a mesh for the frequencies that it has with all that is on it."""
    if not scene.beam.meshed:
        return scene.beam.assembled(None, modes, places)
    count = MESHED_MODES if modes is None or elements is not None else int(modes)
    require(count <= MOST_MODES, f"modes must be at most {MOST_MODES}", modes, "Scene.matrices",
            "keep the modes up to a few times the highest frequency of interest, or give elements")  # fmt: skip
    coarse = scene.beam.coarse(count, places)
    check_buckling(scene.beam, lambda body: _free_stiffness(scene, body.coarse(count, places)))
    own = _of(scene, coarse, count, _held(scene, coarse), condense=True)
    basis = reduction.modal_basis(own.M, own.K, min(count, own.M.shape[0]), root=own.root)
    if not np.any(basis.omega):  # all of them rigid-body modes
        basis = reduction.modal_basis(own.M, own.K, min(MOST_RIGID + count, own.M.shape[0]), root=own.root)
    coarse.check_mechanism(own.spread @ basis.vectors[:, basis.omega == 0.0], "Scene")
    if elements is not None:
        return scene.beam.assembled(elements, modes, places)
    return scene.beam.assembled(None, count, places, float(basis.omega[:count][-1]))


def _free_stiffness(scene: Scene, assembled: Assembled) -> Vector:
    """K (N, N) on the dofs that supports leave, springs among it."""
    free = np.setdiff1d(np.arange(assembled.M.shape[0]), _held(scene, assembled))
    return np.asarray(_with_parts(scene, assembled)[1][free][:, free].toarray())


def _holding(scene: Scene) -> dict[Any, list[Any]]:
    """{place: components that supports hold, and rows (6,) of what has inertia}."""
    found: dict[Any, list[Any]] = {}
    for part in scene.supports:
        found.setdefault(part.z, []).extend(dof for dof in part.dofs if dof in scene.beam.components)
    for mass in scene.masses:
        rows = _moved_by(mass, scene.beam)
        sizes = np.linalg.norm(rows, axis=1)
        found.setdefault(mass.z, []).extend(rows[sizes > 0.0] / sizes[sizes > 0.0, None])
    return found


def _of(scene: Scene, assembled: Assembled, modes: int | None, held: Any, condense: bool) -> BodyMatrices:
    """Matrices of the body once assembled, with the parts that stand on it, supports held."""
    M, K, C, root = _with_parts(scene, assembled)
    free = np.setdiff1d(np.arange(M.shape[0]), held)
    labels = [assembled.labels[i] for i in free]
    bare = [label for label, mass in zip(labels, M.diagonal()[free], strict=True) if mass == 0.0]
    T = following(M[free][:, free], K[free][:, free], labels, "Scene") if condense else None
    S = sparse.eye(M.shape[0], format="csr")[:, free]
    S = S if T is None else (S @ T).tocsr()
    loads = assembled.base_loads + (M - assembled.M) @ assembled.translations
    moved = {c: S.T @ load for c, load in zip(translations_of(scene.beam), loads.T, strict=True)}
    G = gyroscopic(scene, assembled)
    M, K, C = ((S.T @ A @ S).tocsr() for A in (M, K, C))
    return BodyMatrices(
        scene.beam,
        M,
        K,
        None if root is None else (root @ S).tocsr(),
        C,
        scene.damping,
        base_load=main_load(moved, S.shape[1]),
        nodes=np.zeros(0),
        dofs=np.zeros((0, 2), dtype=int),
        modes=modes,
        assembled=assembled,
        spread=S,
        along=moved,
        massless=tuple(bare) if condense else (),
        gyroscopic=None if G is None else (S.T @ G @ S).tocsr(),
    )


def _with_parts(scene: Scene, assembled: Assembled) -> tuple[Any, Any, Any, Any]:
    """M, K, C on all dofs with masses, springs and dashpots, and R with RᵀR = K or None."""
    size = assembled.M.shape[0]
    C = sparse.csr_matrix((size, size)) if assembled.C is None else assembled.C
    springs = _strengthened(scene, assembled, [(s, s.stiffness) for s in scene.springs])
    masses = _masses(scene, assembled)
    root = assembled.root
    root = None if root is None else sparse.vstack([root, springs], format="csr")
    M = (assembled.M + masses.T @ masses).tocsr()
    return M, (assembled.K + springs.T @ springs).tocsr(), (C + _dashpots(scene, assembled)).tocsr(), root


def _masses(scene: Scene, assembled: Assembled) -> sparse.csr_matrix:
    """Rows A of all rigid bodies, AᵀA their mass matrix (N_all, N_all)."""
    none = sparse.csr_matrix((0, assembled.M.shape[0]))
    return sparse.vstack([none, *(_arms(assembled, scene, mass) for mass in scene.masses)], format="csr")


def _dashpots(scene: Scene, assembled: Assembled) -> sparse.csr_matrix:
    """Σ c n nᵀ (N_all, N_all)."""
    rows = _strengthened(scene, assembled, [(d, d.damping) for d in scene.dashpots])
    return (rows.T @ rows).tocsr()


def _strengthened(scene: Scene, assembled: Assembled, parts: list[tuple[Any, float]]) -> sparse.csr_matrix:
    """Rows √k n of springs or dashpots, so that rowsᵀ rows is their matrix."""
    rows = [np.sqrt(size) * rows_along(scene.beam, assembled, part.z, part.along) for part, size in parts]
    return sparse.vstack([sparse.csr_matrix((0, assembled.M.shape[0])), *rows], format="csr")


def _arms(assembled: Assembled, scene: Scene, mass: Any) -> sparse.csr_matrix:
    """Rows A of a rigid body on a place, AᵀA its mass matrix."""
    return rows_along(scene.beam, assembled, mass.z, _moved_by(mass, scene.beam))


def _moved_by(mass: Any, body: Any) -> Vector:
    """(6, 6): of the components of its place the rows of a rigid body, √m (u + θ × e), then √J θ."""
    offset = mass.offset if isinstance(mass.offset, tuple) else (0.0, 0.0, float(mass.offset))
    J = np.array(mass.inertia if isinstance(mass.inertia, tuple) else 3 * (mass.inertia,))
    axes = shaft_axes(mass, body) if isinstance(mass, Disk) else np.eye(6)[3:]
    return np.vstack([np.sqrt(mass.mass) * arm_matrix(offset)[:3], _root_of(J) @ axes])


def _root_of(J: Vector) -> Vector:
    """R (3, 3) with RᵀR = J, of three principal moments or of a tensor."""
    if J.ndim == 1:
        return np.diag(np.sqrt(J))
    moments, axes = np.linalg.eigh(J)
    return np.asarray(np.sqrt(np.maximum(moments, 0.0))[:, None] * axes.T)


def _held(scene: Scene, assembled: Assembled) -> Any:
    """Numbers of the dofs that supports hold."""
    found: set[int] = set()
    for index, support in enumerate(scene.supports):
        rows, components = assembled.rows(support.z).tocsr(), scene.beam.components
        for dof in support.dofs:
            row = rows[components.index(dof)] if dof in components else None
            if row is None or not row.nnz:
                continue
            single = row.nnz == 1 and abs(row.data[0] - 1.0) < UNIT
            require(single, "a support must hold a node of the body", f"{dof} at {quoted(support.z)}",
                    f"supports[{index}] of Scene", "given modes have theirs")  # fmt: skip
            number = int(row.indices[0])
            require(number not in found, f"supports must not hold one dof twice ({dof} at {quoted(support.z)}, which "
                    "another one holds under another name, or by a joint)", index, f"supports[{index}] of Scene",
                    "keep one")  # fmt: skip
            found.add(number)
    return np.array(sorted(found), dtype=int)
