"""From a scene to M, C, K on the free dofs: the beam and what sits on it, then further bodies beside it.

M = Σ beam + m (1, e)ᵀ(1, e) + J,  K = RᵀR = Σ beam + k + κ,  load of a base motion: -(M_all r) ÿ,
r = 1 on every translation, supported ones included, 0 on slopes. Several bodies are blocks on the diagonal: the beam
of the scene, its `bodies`, then one dof for every impactor.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import linalg, sparse
from scipy.sparse import linalg as sparse_linalg

import reduction
from fembeam.beams import MOST_MODES, Beam, bare_beam, geometric_stiffness, hermite_rows, mesh
from fembeam.scene.moving_loads import PER_DOF, loads_of_order
from fembeam.scene.places import body_words, place_words, quoted
from fembeam.scene.signals import support_motion
from fembeam.structures import COMPONENTS, Six, require_components
from fembeam.support import is_whole, require, require_finite

if TYPE_CHECKING:
    from fembeam.scene.impactor import Impactor
    from fembeam.scene.local_coordinate import LocalCoordinate
    from fembeam.scene.scene import Scene

Vector = NDArray[np.float64]

MOST_DENSE = 2000  # free dofs of which all modes may be asked for, about ten seconds
DENSE = 200  # free dofs, below which the dense solver is quicker
UNIT = 1e-12  # of 1: entries of a row that stands for one dof


@dataclass(frozen=True, eq=False)
class Matrices:
    """Full matrices of a scene on its N free dofs: M ü + C u̇ + K u = -base_load ÿ + ….

    Attributes
    ----------
    M, K : (N, N) sparse CSR, kg and N/m for displacements.
    C : (N, N) sparse CSR, N s/m: structural damping and dashpots, made when first read.
    root : (k, N) sparse R with RᵀR = K, rows of compression imaginary; `reduction.modal_basis(M, K, root=root)` is
        accurate on fine meshes. None where a structure comes by its matrices.
    dashpots : (N, N) sparse, the dashpots' part of C alone.
    base_load : (M_all r) (N,) in kg, columns of the supported dofs included; the load is -base_load ÿ. Of a body with
        directions that along y, else along the first that it has; `base_loads` has all.
    nodes : (m,) coordinates in m.
    dofs : (m, 2) free dof of (u, u_z) at each node, -1 where supported.
    modes : number of modes the mesh was made for, None if the elements were given.
    gyroscopic : (N, N) skew-symmetric G of what spins, or None.
    bodies : where there are several beams or impactors, the matrices of each beam by itself; else empty. `nodes` and
        `dofs` are those of the scene's own beam.
    impactors : of all bodies, one dof each, the last ones.
    carried : (N_all, k) what the k dofs of supports that move carry along by themselves, on all dofs; None: none moves.
    coupling : (3 k, N): for each of these dofs the loads of its displacement, speed and acceleration, see
        `fembeam.scene.moving_loads`.
    limit : {direction: kg}, the mass that a motion of the frame moves in the limit of fine meshes; {}: that of M.
    """

    beam: Any
    M: sparse.csr_matrix
    K: sparse.csr_matrix
    root: sparse.csr_matrix | None
    dashpots: sparse.csr_matrix
    damping: Any
    base_load: Vector
    nodes: Vector
    dofs: NDArray[np.int64]
    modes: int | None = None
    gyroscopic: sparse.csr_matrix | None = None
    bodies: tuple[Matrices, ...] = ()
    impactors: tuple[Impactor, ...] = ()
    carried: sparse.csr_matrix | None = None
    coupling: sparse.csr_matrix | None = None
    limit: dict[str, float] = field(default_factory=dict)
    named = False  # whether its places have names and directions, see `BodyMatrices`

    @cached_property
    def spread(self) -> sparse.csr_matrix:
        """S (N_all, N): the free dofs of the scene's own beam among all, zero at supports."""
        return sparse.eye(self.dofs.size, format="csr")[:, np.flatnonzero(self.dofs.ravel() >= 0)]

    @cached_property
    def influence(self) -> Vector:
        """R (N,): 1 on translations, 0 on slopes; ValueError where a body is no `Beam`."""
        if self.bodies:
            return np.concatenate([*(body.influence for body in self.bodies), np.ones(len(self.impactors))])
        return np.tile([1.0, 0.0], len(self.nodes))[self.dofs.ravel() >= 0]

    @property
    def following_loads(self) -> list[sparse.csr_matrix]:
        """The loads (k, N) of displacements of supports that move, if any does: their static shapes follow it."""
        if self.coupling is None or self.carried is None:
            return []
        return [self.coupling[loads_of_order(0, self.carried.shape[1])]]

    @property
    def base_loads(self) -> dict[str, Vector]:
        """The load (N,) of every direction in which the frame may move: of a beam "y" alone."""
        return {"y": self.base_load}

    @property
    def moved_masses(self) -> dict[str, float]:
        """The mass (kg) that a motion of the frame moves in every direction: the sum of all effective masses."""
        if not self.bodies:
            return {way: self.limit.get(way) or reduction.moved_mass(self.M, b) for way, b in self.base_loads.items()}
        each = [body.moved_masses for body in self.bodies]
        beside = [{way: one.mass * one.along[COMPONENTS.index(way)] ** 2 for way in COMPONENTS[:3]}
                  for one in self.impactors]  # fmt: skip
        return {way: sum(part.get(way, 0.0) for part in (*each, *beside)) for way in self.base_loads}

    @cached_property
    def C(self) -> sparse.csr_matrix:
        """Structural damping + dashpots."""
        if self.bodies:
            dashpots = sparse.diags([impactor.damping for impactor in self.impactors])
            return sparse.block_diag([*(body.C for body in self.bodies), dashpots], format="csr")
        return (self.damping.matrix(self.M, self.K, self.root) + self.dashpots).tocsr()

    def loosened(self, scene: Scene) -> Matrices:
        """The matrices of the scene's own body without its supports, on all dofs of the same mesh."""
        found = self._on_all(scene)
        if self.carried is None:
            return found
        each = found.M, found.K, found.dashpots, found.spread, self.carried, found.gyroscopic
        return replace(found, **moving(*each))

    def _on_all(self, scene: Scene) -> Matrices:
        """Matrices of a scene without supports, on the same mesh."""
        return _on_nodes(scene, self.nodes, self.modes)

    @property
    def elements(self) -> int:
        """Number of elements."""
        return len(self.nodes) - 1

    @property
    def beams(self) -> tuple[Matrices, ...]:
        """The matrices of each beam by itself, this scene's own first."""
        return self.bodies or (self,)

    def interpolation(self, z: ArrayLike, derivative: int = 0, body: int = 0) -> sparse.csr_matrix:
        """Rows (k, N): u, u_z or u_zz (derivative 0, 1, 2) of a body at z (k,) by the elements' cubics.

        Supported dofs count as 0; at a node the curvature is that of the element ahead. ValueError if a z is
        not on the beam.
        """
        own = self.beams[body]
        places = mesh.on_beam(np.atleast_1d(np.asarray(z, dtype=float)), own.beam, "interpolation")
        return self.among_all(hermite_rows(own.nodes, places, derivative) @ own.spread, body)

    def row(self, place: Any, along: Six, body: int = 0) -> sparse.csr_matrix:
        """Row (1, N): the motion of a body's place along a direction, six numbers."""
        return self.among_all(self.beams[body].own_row(place, along), body)

    def own_row(self, place: Any, along: Six) -> sparse.csr_matrix:
        """`row` on the body's own dofs: of a beam u along y and -u_z about x."""
        require_components(along, ("y", "rx"), "a Beam bends in one plane: its places", f"{quoted(place)} of a Beam")
        return along[1] * self.interpolation(place) - along[3] * self.interpolation(place, 1)

    def carried_row(self, place: LocalCoordinate) -> Vector:
        """What each dof of this body's supports that move adds to a coordinate of the body, (k,)."""
        if self.carried is None:
            return np.zeros(0)
        first = self._row_on_all(place.z, place.along) @ self.carried
        second = 0.0 if place.to is None else self._row_on_all(place.to[1], place.along) @ self.carried
        return np.asarray((first - second).todense())[0]

    def _row_on_all(self, place: Any, along: Six) -> sparse.csr_matrix:
        """Row (1, N_all) of a place along a direction, supported dofs included."""
        z = np.array([float(place)])
        return along[1] * hermite_rows(self.nodes, z, 0) - along[3] * hermite_rows(self.nodes, z, 1)

    def among_all(self, rows: sparse.csr_matrix, body: int) -> sparse.csr_matrix:
        """Rows on a body's own dofs as rows on all."""
        before = sum(beam.M.shape[0] for beam in self.beams[:body])
        after = self.M.shape[0] - before - rows.shape[1]
        blank = [sparse.csr_matrix((rows.shape[0], count)) for count in (before, after)]
        return sparse.hstack([blank[0], rows, blank[1]], format="csr") if before or after else rows

    def impactor_row(self, index: int) -> sparse.csr_matrix:
        """Row (1, N): the displacement of an impactor."""
        size = self.M.shape[0]
        place = size - len(self.impactors) + index
        return sparse.csr_matrix(([1.0], ([0], [place])), shape=(1, size))

    def frequency_error(self, omega: ArrayLike) -> Vector:
        """Relative error to expect in frequencies omega: max over elements of (β h)⁴/1440, β⁴ = ρA ω²/EI."""
        steps = np.diff(self.nodes) * mesh.slowness(self.beam, self.nodes)
        return mesh.ERROR_CONSTANT * steps.max() ** 4 * np.asarray(omega, dtype=float) ** 2

    @property
    def accuracy(self) -> str:
        """What the mesh promises, in a sentence."""
        beside = " with those of further bodies" if self.bodies else ""
        size = f"{self.elements} elements, {self.M.shape[0]} free dofs{beside}"
        if self.modes is None:
            return f"{size}: elements as asked, frequency_error(omega) estimates the error"
        return f"{size}: the lowest {self.modes} frequencies are right to {mesh.FREQUENCY_TOLERANCE:g} relative"

    def __repr__(self) -> str:
        return f"<matrices of {self.accuracy}>"

    def __str__(self) -> str:
        return f"Matrices: {self.accuracy}"


def assemble(scene: Scene, elements: int | None, modes: int | None, probes: Sequence[float]) -> Matrices:
    """Matrices of the scene; `Scene.matrices` explains the arguments."""
    check_counts(elements, modes)
    meshed = any(part.beam.meshed for part in (scene, *scene.bodies))
    require(elements is None or meshed, "elements must be left out: a structure has its own matrices", elements,
            "Scene.matrices", "ask for modes, or modes='all'")  # fmt: skip
    listed = isinstance(probes, Iterable) and not isinstance(probes, (str, Mapping))
    require(listed, "probes must be a list", probes, "Scene.matrices", "put it in brackets")
    own = _one_beam(scene, elements, modes, scene.at(list(probes), "probes of Scene.matrices"))
    if not scene.bodies and not scene.impactors:
        _check_sizes(elements, modes, (own,))
        _check_beside(scene, (own,))
        return own
    second: list[tuple[int, Any]] = [part.coordinates[0].to or (0, 0.0) for part in scene.acting]
    met = [[z for number, z in second if number == b + 1] for b in range(len(scene.bodies))]
    others = [_one_beam(body, elements, modes, at) for body, at in zip(scene.bodies, met, strict=True)]
    _check_sizes(elements, modes, (own, *others))
    _check_beside(scene, (own, *others))
    return _joined((own, *others), tuple(i for body in (scene, *scene.bodies) for i in body.impactors))


def _one_beam(scene: Scene, elements: int | None, modes: int | None, probes: Sequence[float]) -> Matrices:
    """Matrices of the scene's own beam."""
    if not isinstance(scene.beam, Beam):
        from fembeam.scene.body_assembly import body_matrices

        return body_matrices(scene, elements, modes, probes)
    _check_buckling(scene)
    borders = borders_of(scene, probes)
    if elements is None:
        modes = mesh.MESHED_MODES if modes is None else int(modes)
        require(modes <= MOST_MODES, f"modes must be at most {MOST_MODES}", modes, "Scene.matrices",
                "keep the modes up to a few times the highest frequency of interest")  # fmt: skip
        return _on_nodes(scene, _resolving(scene, borders, modes), modes)
    return _on_nodes(scene, mesh.spread(scene.beam, borders, elements), None)


def _check_sizes(elements: int | None, modes: int | None, beams: tuple[Matrices, ...]) -> None:
    """Raise ValueError for more modes than the largest of given meshes has; bodies with fewer dofs keep all."""
    sizes = [beam.M.shape[0] for beam in beams]
    if elements is None or modes is None or beams[int(np.argmax(sizes))].named:
        return
    size, of = max(sizes), f" of {body_words(int(np.argmax(sizes)))}" * (len(beams) > 1)
    require(modes <= size, f"modes must be at most {size} (free dofs{of})", modes, "Scene.matrices",
            "ask for fewer modes or more elements")  # fmt: skip
    require(modes <= MOST_MODES or size <= MOST_DENSE, f"modes must be at most {MOST_MODES} of {size} free dofs",
            modes, "Scene.matrices", f"or use a mesh of at most {MOST_DENSE} dofs")  # fmt: skip


def _check_beside(scene: Scene, beams: tuple[Matrices, ...]) -> None:
    """Raise ValueError for contacts on supports that move, or so near that they share an element: δ has no motion."""
    for body, part in enumerate((scene, *scene.bodies)) if any(one.carried is not None for one in beams) else ():
        for name in ("stops", "elements", "impactors"):
            for index, one in enumerate(getattr(part, name)):
                places = [(i, end) for i in range(len(beams)) for at in one.coordinates for end in at.on_body(body, i)]
                met = [end for i, end in places if np.any(np.abs(beams[i].carried_row(end)) > UNIT)]
                where = f"bodies[{body - 1}].{name}[{index}]" if body else f"{name}[{index}]"
                require(not met, "what acts must not sit where a support moves", [place_words(end.z) for end in met],
                        f"{where}{one.quoted} of Scene", "put it at a place beside the support")  # fmt: skip


def _joined(beams: tuple[Matrices, ...], impactors: tuple[Impactor, ...]) -> Matrices:
    """Several bodies as blocks of one problem, impactors last."""
    own = beams[0]
    mass = np.array([impactor.mass for impactor in impactors])
    stiffness = np.array([impactor.stiffness for impactor in impactors])
    damping = np.array([impactor.damping for impactor in impactors])

    def stacked(blocks: Sequence[sparse.csr_matrix], last: Vector) -> sparse.csr_matrix:
        return sparse.block_diag([*blocks, *([sparse.diags(last)] if len(last) else [])], format="csr")

    roots = [beam.root for beam in beams if beam.root is not None]
    turning = [sparse.csr_matrix(beam.M.shape) if beam.gyroscopic is None else beam.gyroscopic for beam in beams]
    spins = any(beam.gyroscopic is not None for beam in beams)
    along = _base_loads(beams, impactors)
    named: dict[str, Any] = {"along": along} if own.named else {}
    return replace(
        own,
        **named,
        M=stacked([beam.M for beam in beams], mass),
        K=stacked([beam.K for beam in beams], stiffness),
        root=stacked(roots, np.sqrt(stiffness)) if len(roots) == len(beams) else None,
        dashpots=stacked([beam.dashpots for beam in beams], damping),
        gyroscopic=stacked(turning, 0.0 * mass) if spins else None,
        base_load=main_load(along, 0),
        bodies=beams,
        impactors=impactors,
    )


def main_load(along: Mapping[str, Vector], size: int) -> Vector:
    """The load of the frame's motion along y, of a body that does not move along y that of its first direction."""
    return along.get("y", next(iter(along.values()), np.zeros(size)))


def _base_loads(beams: tuple[Matrices, ...], impactors: tuple[Impactor, ...]) -> dict[str, Vector]:
    """The load of the frame's motion on all bodies; on impactors its part along their directions."""
    known = list(dict.fromkeys(direction for beam in beams for direction in beam.base_loads))
    found = {}
    for direction in known:
        parts = [beam.base_loads.get(direction, np.zeros(beam.M.shape[0])) for beam in beams]
        axis = COMPONENTS.index(direction)
        found[direction] = np.concatenate([*parts, [one.mass * one.along[axis] for one in impactors]])
    return found


def check_counts(elements: int | None, modes: int | None) -> None:
    """Raise ValueError unless both are counts, and the elements few enough to be right."""
    for name, number in (("elements", elements), ("modes", modes)):
        whole = is_whole(number)
        require(number is None or (whole and number > 0), f"{name} must be a whole number above 0", number,
                "Scene.matrices", "give a count, or None")  # fmt: skip
    few = elements is None or elements <= mesh.MOST_ELEMENTS
    require(few, f"elements must be at most {mesh.MOST_ELEMENTS}, where rounding takes over", elements,
            "Scene.matrices", "leave them out: as few as the modes need are made")  # fmt: skip


def _resolving(scene: Scene, borders: Vector, modes: int) -> Vector:
    """Nodes with as few elements as `mesh.demand` asks for; omega is estimated on a coarse mesh."""
    coarse = _on_nodes(scene, mesh.spread(scene.beam, borders, 2 * modes + 4), None)
    omega = reduction.modal_basis(coarse.M, coarse.K, modes, root=coarse.root).omega[-1]
    needed = mesh.demand(scene.beam, borders, float(omega))
    counts = np.maximum(1, np.ceil(needed[:, -1]))
    require(counts.sum() <= mesh.MOST_ELEMENTS, f"{modes} modes must need at most {mesh.MOST_ELEMENTS} elements",
            counts.sum(), "Scene.matrices", "is a length in mm, or a place next to another one?")  # fmt: skip
    return mesh.placed(borders, needed, counts.astype(int))


def _check_buckling(scene: Scene) -> None:
    """Raise ValueError when the beam has buckled under its axial force."""
    if scene.beam.axial_force < 0:
        spare = buckling_load(scene, 2 * mesh.MESHED_MODES)
        most = f"{spare - scene.beam.axial_force:.6g}"
        require(spare > 0, f"axial_force must stay above -{most} N, where the beam buckles", scene.beam.axial_force,
                "Beam", "press less, or support it more")  # fmt: skip


def buckling_load(scene: Scene, elements: int | None = None) -> float:
    """Lowest P of (K - P G) φ = 0 for the own beam, less its compression; `Scene.buckling_load` explains it."""
    check_counts(elements, None)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        beam = replace(scene.beam, axial_force=0.0)
        relaxed = replace(scene, beam=beam, bodies=(), impactors=(), stops=(), elements=())
    held = relaxed.rigid_body_modes == 0
    require(held, "supports and springs must hold the beam", f"{relaxed.rigid_body_modes} rigid-body modes",
            "buckling_load", "add a support")  # fmt: skip
    matrices = _one_beam(relaxed, elements, None, ())
    free = np.flatnonzero(matrices.dofs.ravel() >= 0)
    G = geometric_stiffness(matrices.nodes)[free][:, free]
    if len(free) < DENSE:
        largest = linalg.eigh(G.toarray(), matrices.K.toarray(), eigvals_only=True)[-1]
    else:
        start = np.ones(len(free))
        largest = sparse_linalg.eigsh(G, 1, matrices.K, which="LA", return_eigenvectors=False, v0=start)[0]
    return float(1 / largest + scene.beam.axial_force)


def _on_nodes(scene: Scene, nodes: Vector, modes: int | None) -> Matrices:
    """Matrices of the own beam with elements between these nodes."""
    fixed = np.zeros((len(nodes), 2), dtype=bool)
    for support in scene.supports:
        fixed[np.argmin(np.abs(nodes - support.z))] |= support.fixed
    free = np.flatnonzero(~fixed.ravel())
    dofs = np.full(fixed.shape, -1)
    dofs.ravel()[free] = np.arange(len(free))

    K, M, root = bare_beam(scene.beam, nodes.tobytes())
    arms = _lumped(nodes, [(m.z, m.mass, m.inertia, m.offset) for m in scene.masses])
    springs = _lumped(nodes, [(s.z, s.stiffness, s.rotational, 0.0) for s in scene.springs])
    dashpots = _lumped(nodes, [(d.z, d.damping, d.rotational, 0.0) for d in scene.dashpots])
    M_all, K_all, C_all = _with(M, arms), _with(K, springs), _with(sparse.csr_matrix(M.shape), dashpots)
    root = (sparse.vstack([root, springs], format="csr") if springs.shape[0] else root)[:, free]

    r = np.tile([1.0, 0.0], len(nodes))
    limit = {} if modes is None else {"y": float(r @ (M @ r)) + moved_by_rows(arms, free, r)}
    M, K, C = (A.tocsr()[free][:, free] for A in (M_all, K_all, C_all))
    found = Matrices(scene.beam, M, K, root, C, scene.damping, (M_all @ r)[free], nodes, dofs, modes,
                     limit=limit)  # fmt: skip
    carried = _carried(scene, nodes)
    if carried is None:
        return found
    return replace(found, **moving(M_all, K_all, C_all, found.spread, carried))


def _carried(scene: Scene, nodes: Vector) -> sparse.csr_matrix | None:
    """(2m, k): 1 on u, -1 on u_z (which is -rx) of each dof of supports that move; None where none does."""
    moved = [(support.z, dof) for support in scene.supports for dof in support_motion(support)]
    rows = [2 * int(np.argmin(np.abs(nodes - z))) + (dof == "rx") for z, dof in moved]
    signs = [-1.0 if dof == "rx" else 1.0 for _, dof in moved]
    shape = 2 * len(nodes), len(moved)
    return sparse.csr_matrix((signs, (rows, range(len(moved)))), shape=shape) if moved else None


def moving(M: Any, K: Any, C: Any, spread: Any, carried: Any, gyroscopic: Any = None) -> dict[str, Any]:
    """What dofs of supports that move carry, and their loads -K e, -(C + G) e, -M e of e, ė and ë.

    M, K, C are symmetric, G is skew: of its rows the sign turns round.
    """
    rates = C if gyroscopic is None else C - gyroscopic
    each = [-(carried.T @ A @ spread).tocsr() for A in (K, rates, M)]
    order = np.arange(PER_DOF * carried.shape[1]).reshape(PER_DOF, -1).T.ravel()
    return {"carried": carried, "coupling": sparse.vstack(each, format="csr")[order]}


def unsupported(scene: Scene, matrices: Matrices) -> Matrices:
    """The same bodies on the same nodes without their supports: M, K and rows on all dofs, to find reactions with."""
    beams = []
    for part, known in zip((scene, *scene.bodies), matrices.beams, strict=True):
        loose = copy(part)  # not a scene to be simulated, hence without its checks
        object.__setattr__(loose, "supports", ())
        beams.append(known.loosened(loose))
    return _joined(tuple(beams), matrices.impactors)


def _with(matrix: sparse.csr_matrix, rows: sparse.csr_matrix) -> sparse.csr_matrix:
    """A matrix and the square of rows on it."""
    return matrix + rows.T @ rows if rows.shape[0] else matrix


def _lumped(nodes: Vector, items: Sequence[tuple[Any, ...]]) -> sparse.csr_matrix:
    """Rows √a (u + e u_z) and √b u_z for items (z, a, b, e): their square is the quadratic form."""
    if not items:
        return sparse.csr_matrix((0, 2 * len(nodes)))
    z, a, b, e = np.array(items, dtype=float).reshape(-1, 4).T
    u, slope = hermite_rows(nodes, z, 0), hermite_rows(nodes, z, 1)
    arm = sparse.diags(np.sqrt(a)) @ (u + sparse.diags(e) @ slope)
    return sparse.vstack([arm, sparse.diags(np.sqrt(b)) @ slope], format="csr")


def moved_by_rows(arms: sparse.csr_matrix, free: Any, r: Vector) -> float:
    """What rigid bodies add to the moved mass in the limit of fine meshes, kg: bᵀ(AᵀA)⁺b, b = AᵀA r on the free dofs.

    There the beam's own mass is ρA l, whatever holds it: what a support keeps at rest is a part of one element.

    Parameters
    ----------
    arms : A (k, N_all), AᵀA their mass matrix. free : numbers of the free dofs. r : (N_all,), 1 on translations.
    """
    columns = arms.tocsc()[:, free]
    touched = columns[:, np.flatnonzero(np.diff(columns.indptr))].toarray()
    sizes = np.linalg.norm(touched, axis=0)
    touched = touched[:, sizes > 0.0] / sizes[sizes > 0.0]  # a mass of 0 kg has rows of zeros
    if not touched.size:
        return 0.0
    moved = touched @ np.linalg.lstsq(touched, arms @ r)[0]
    return float(moved @ moved)


def borders_of(scene: Scene, probes: Sequence[float]) -> Vector:
    """Coordinates that must be nodes, ascending, without repeats."""
    for index, z in enumerate(probes):
        require_finite(f"probes[{index}]", z, "Scene.matrices", "give coordinates in m")
    asked = mesh.on_beam(np.asarray(list(probes), dtype=float), scene.beam, "probes of Scene.matrices")
    shortest = mesh.SHORTEST * scene.beam.length
    needed = np.sort(np.array([*scene.beam.borders, *(support.z for support in scene.supports)], dtype=float))
    nodes = needed[np.diff(needed, prepend=-np.inf) > mesh.SAME_PLACE * scene.beam.length]
    gaps = np.diff(nodes)
    rule = f"supports and span ends must be {shortest:.3g} m apart or at one place"
    require(bool(np.all(gaps >= shortest)), rule, float(gaps.min()), "Scene", "move or merge them")
    for z in [*scene.places, *asked]:
        if np.min(np.abs(nodes - z)) >= shortest:  # nearer ones are interpolated inside their element
            nodes = np.append(nodes, float(z))
    return np.sort(nodes)
