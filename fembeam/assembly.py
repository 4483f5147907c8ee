"""From a scene to M, C, K on the free dofs: where the nodes go, how many, and what sits on them.

M = Σ beam + m (1, e)ᵀ(1, e) + J,  K = RᵀR = Σ beam + k + κ,  load of a base motion: -(M_all r) ÿ,
r = 1 on every translation, supported ones included, 0 on slopes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

import reduction
from fembeam.beam import Beam, bending_matrices, bending_root, hermite_rows
from fembeam.section import require, require_finite

if TYPE_CHECKING:
    from fembeam.scene import Scene

Vector = NDArray[np.float64]

FREQUENCY_TOLERANCE = 1e-6  # relative, promised for each mode asked for
ERROR_CONSTANT = 1 / 1440  # relative error of omega of a cubic Hermite mesh: (beta h)^4/1440
WAVE_STEP = (0.65 * FREQUENCY_TOLERANCE / ERROR_CONSTANT) ** 0.25  # beta h = 0.175, a third below the promise
DEFAULT_MODES = 10
MOST_MODES = 300  # 5400 elements, about a minute; a slender beam has lost its meaning long before
MOST_DENSE = 2000  # free dofs of which all modes may be asked for, about ten seconds
MOST_ELEMENTS = 10_000  # above it rounding of K hides the lowest frequencies
SAME_PLACE = 1e-9  # of the length: features closer than this share a node
SHORTEST = 1e-4  # of the length: rounding of K grows like (length/h)³, 2e-4 of the first omega² here


@dataclass(frozen=True, eq=False)
class Matrices:
    """Full matrices of a scene on its N free dofs: M ü + C u̇ + K u = -base_load ÿ + ….

    Attributes
    ----------
    M, K : (N, N) sparse CSR, kg and N/m for displacements.
    C : (N, N) sparse CSR, N s/m: structural damping and dashpots, made when first read.
    root : (k, N) sparse R with RᵀR = K; `reduction.modal_basis(M, K, root=root)` is accurate on fine meshes.
    dashpots : (N, N) sparse, the dashpots' part of C alone.
    influence : r (N,), 1 on translations, 0 on slopes.
    base_load : (M_all r) (N,) in kg, columns of the supported dofs included; the load is -base_load ÿ.
    nodes : (m,) coordinates in m.
    dofs : (m, 2) free dof of (u, u_z) at each node, -1 where supported.
    modes : number of modes the mesh was made for, None if the elements were given.
    """

    beam: Beam
    M: sparse.csr_matrix
    K: sparse.csr_matrix
    root: sparse.csr_matrix
    dashpots: sparse.csr_matrix
    damping: Any
    influence: Vector
    base_load: Vector
    nodes: Vector
    dofs: NDArray[np.int64]
    modes: int | None = None

    @cached_property
    def C(self) -> sparse.csr_matrix:
        """Structural damping + dashpots."""
        return (self.damping.matrix(self.M, self.K, self.root) + self.dashpots).tocsr()

    @property
    def elements(self) -> int:
        """Number of elements."""
        return len(self.nodes) - 1

    def interpolation(self, z: ArrayLike, derivative: int = 0) -> sparse.csr_matrix:
        """Rows (k, N): u, u_z or u_zz (derivative 0, 1, 2) at z (k,) by the elements' cubics.

        Supported dofs count as 0; at a node the curvature is that of the element ahead. ValueError if a z is
        not on the beam.
        """
        places = _on_beam(np.atleast_1d(np.asarray(z, dtype=float)), self.beam, "interpolation")
        return hermite_rows(self.nodes, places, derivative)[:, np.flatnonzero(self.dofs.ravel() >= 0)]

    def frequency_error(self, omega: ArrayLike) -> Vector:
        """Relative error to expect in frequencies omega: max over elements of (β h)⁴/1440, β⁴ = ρA ω²/EI."""
        steps = np.diff(self.nodes) * _slowness(self.beam, self.nodes)
        return ERROR_CONSTANT * steps.max() ** 4 * np.asarray(omega, dtype=float) ** 2

    @property
    def accuracy(self) -> str:
        """What the mesh promises, in a sentence."""
        size = f"{self.elements} elements, {self.M.shape[0]} free dofs"
        if self.modes is None:
            return f"{size}: elements as asked, frequency_error(omega) estimates the error"
        return f"{size}: the lowest {self.modes} frequencies are right to {FREQUENCY_TOLERANCE:g} relative"

    def __str__(self) -> str:
        return f"Matrices: {self.accuracy}"


def assemble(scene: Scene, elements: int | None, modes: int | None, probes: Sequence[float]) -> Matrices:
    """Matrices of the scene; `Scene.matrices` explains the arguments."""
    _check_counts(elements, modes)
    borders = _borders(scene, probes)
    if elements is None:
        modes = DEFAULT_MODES if modes is None else int(modes)
        _check_modes(modes)
        return _on_nodes(scene, _resolving(scene, borders, modes), modes)
    matrices = _on_nodes(scene, _spread(scene.beam, borders, elements), None)
    if modes is not None:
        size = matrices.M.shape[0]
        require(modes <= size, f"modes must be at most {size} (free dofs)", modes, "Scene.matrices",
                "ask for fewer modes or more elements")  # fmt: skip
        require(modes <= MOST_MODES or size <= MOST_DENSE, f"modes must be at most {MOST_MODES} of {size} free dofs",
                modes, "Scene.matrices", f"or use a mesh of at most {MOST_DENSE} dofs")  # fmt: skip
    return matrices


def _check_counts(elements: int | None, modes: int | None) -> None:
    """Raise ValueError unless both are counts, and the elements few enough to be right."""
    for name, number in (("elements", elements), ("modes", modes)):
        whole = isinstance(number, (int, np.integer)) and not isinstance(number, bool)
        require(number is None or (whole and number > 0), f"{name} must be a whole number above 0", number,
                "Scene.matrices", "give a count, or None")  # fmt: skip
    few = elements is None or elements <= MOST_ELEMENTS
    require(few, f"elements must be at most {MOST_ELEMENTS}, where rounding takes over", elements, "Scene.matrices",
            "leave them out: as few as the modes need are made")  # fmt: skip


def _check_modes(modes: int) -> None:
    """Raise ValueError for more modes than are computed within a minute or so."""
    require(modes <= MOST_MODES, f"modes must be at most {MOST_MODES}", modes, "Scene.matrices",
            "keep the modes up to a few times the highest frequency of interest")  # fmt: skip


def _borders(scene: Scene, probes: Sequence[float]) -> Vector:
    """Coordinates that must be nodes, ascending, without repeats."""
    for index, z in enumerate(probes):
        require_finite(f"probes[{index}]", z, "Scene.matrices", "give coordinates in m")
    asked = _on_beam(np.asarray(list(probes), dtype=float), scene.beam, "probes of Scene.matrices")
    shortest = SHORTEST * scene.beam.length
    needed = np.sort([*scene.beam.borders, *(support.z for support in scene.supports)])
    nodes = needed[np.diff(needed, prepend=-np.inf) > SAME_PLACE * scene.beam.length]
    gaps = np.diff(nodes)
    rule = f"supports and span ends must be {shortest:.3g} m apart or at one place"
    require(bool(np.all(gaps >= shortest)), rule, float(gaps.min()), "Scene", "move or merge them")
    for z in [*scene.places, *asked]:
        if np.min(np.abs(nodes - z)) >= shortest:  # nearer ones are interpolated inside their element
            nodes = np.append(nodes, z)
    return np.sort(nodes)


def _on_beam(z: Vector, beam: Beam, where: str) -> Vector:
    """The same z, checked."""
    outside = ~((z >= 0) & (z <= beam.length))
    require(not outside.any(), f"z must lie on the beam, 0 to {beam.length} m", z[outside].tolist(), where,
            "keep to the beam")  # fmt: skip
    return z


def _slowness(beam: Beam, nodes: Vector) -> Vector:
    """(ρA/EI)^(1/4) between neighbouring nodes: bending wavenumber over √omega."""
    middle = 0.5 * (nodes[:-1] + nodes[1:])
    return (beam.line_mass(middle) / beam.bending_stiffness(middle)) ** 0.25


def _divided(borders: Vector, counts: NDArray[np.int64]) -> Vector:
    """Nodes with counts[i] equal elements between borders i and i + 1."""
    intervals = zip(borders[:-1], borders[1:], counts, strict=True)
    pieces = [np.linspace(start, end, count, endpoint=False) for start, end, count in intervals]
    return np.append(np.concatenate(pieces), borders[-1])


def _spread(beam: Beam, borders: Vector, elements: int) -> Vector:
    """Nodes with `elements` elements in all (at least one per interval), short where waves are short."""
    waves = np.diff(borders) * _slowness(beam, borders)
    counts = np.ones(len(waves), dtype=int)
    for _ in range(elements - len(waves)):
        counts[np.argmax(waves / counts)] += 1
    return _divided(borders, counts)


def _resolving(scene: Scene, borders: Vector, modes: int) -> Vector:
    """Nodes with as few elements as keep β h below WAVE_STEP; omega is estimated on a coarse mesh."""
    coarse = _on_nodes(scene, _spread(scene.beam, borders, 2 * modes + 4), None)
    omega = reduction.modal_basis(coarse.M, coarse.K, modes, root=coarse.root).omega[-1]
    waves = np.diff(borders) * _slowness(scene.beam, borders) * np.sqrt(omega)
    return _divided(borders, np.maximum(1, np.ceil(waves / WAVE_STEP).astype(int)))


def _on_nodes(scene: Scene, nodes: Vector, modes: int | None) -> Matrices:
    """The assembly itself."""
    fixed = np.zeros((len(nodes), 2), dtype=bool)
    for support in scene.supports:
        fixed[np.argmin(np.abs(nodes - support.z))] |= support.fixed
    free = np.flatnonzero(~fixed.ravel())
    dofs = np.full(fixed.shape, -1)
    dofs.ravel()[free] = np.arange(len(free))

    K, M = bending_matrices(scene.beam, nodes)
    arms = _lumped(nodes, [(m.z, m.mass, m.inertia, m.offset) for m in scene.masses])
    springs = _lumped(nodes, [(s.z, s.stiffness, s.rotational, 0.0) for s in scene.springs])
    dashpots = _lumped(nodes, [(d.z, d.damping, d.rotational, 0.0) for d in scene.dashpots])
    M_all, K_all, C_all = M + arms.T @ arms, K + springs.T @ springs, dashpots.T @ dashpots
    root = sparse.vstack([bending_root(scene.beam, nodes), springs], format="csr")

    r = np.tile([1.0, 0.0], len(nodes))
    M, K, C = (A.tocsr()[free][:, free] for A in (M_all, K_all, C_all))
    return Matrices(scene.beam, M, K, root[:, free], C, scene.damping, r[free], (M_all @ r)[free], nodes, dofs, modes)


def _lumped(nodes: Vector, items: Sequence[tuple[float, float, float, float]]) -> sparse.csr_matrix:
    """Rows √a (u + e u_z) and √b u_z for items (z, a, b, e): their square is the quadratic form."""
    z, a, b, e = np.array(items, dtype=float).reshape(-1, 4).T
    u, slope = hermite_rows(nodes, z, 0), hermite_rows(nodes, z, 1)
    arm = sparse.diags(np.sqrt(a)) @ (u + sparse.diags(e) @ slope)
    return sparse.vstack([arm, sparse.diags(np.sqrt(b)) @ slope], format="csr")
