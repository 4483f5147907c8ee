"""Section forces along a beam: bending moment M = EI u_zz and shear force V = dM/dz.

Not from second and third derivatives of the shapes, which lose two and three orders, but from equilibrium: the forces
at both ends of every element,

    f_e = K_e u_e - M_e a_e,

balance its stiffness against its inertia a (ω² φ for a mode; in general what solves K v = M a + point loads where
contacts, forces, feet and dashpots act). They are as accurate as the frequencies, and exact for a static shape.
Between them M is the cubic with those values and slopes: right to 3e-6, its slope V to 5e-5 of the highest mode kept.
Positive M stretches the lower fibre.

The sum over n modes converges slowly for a load that no static shape carries. The weight of a cantilever (base motion
likewise) leaves 0.13/n² of the moment and 0.4/n of the shear at the clamp; a point force without ``residual`` 1/n of
the moment and, next to it, all of the shear.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

import reduction
from fembeam.beams import Beam, element_matrices, joining, on_beam
from fembeam.response.body_reactions import balanced, static_solver
from fembeam.scene import BodyMatrices, carried_on, loaded, rigid_shapes
from fembeam.structures import FrameForces, JoinedForces
from fembeam.support import require

if TYPE_CHECKING:
    from fembeam.model.equations import ModalEquations
    from fembeam.response.histories import Histories
    from fembeam.scene import Matrices

Vector = NDArray[np.float64]

BALANCED = 1e-6  # relative: K v = ω² M v holds, the vector is a mode
STILL = 1e-9  # relative: a place does not move


@dataclass(frozen=True, eq=False)
class SectionForces:
    """Moments and shear forces per unit of each coordinate, on one beam.

    Attributes
    ----------
    beam : the beam. nodes : (e + 1,) m.
    moments, shears : (e, 2, n + k) at both ends of every element, N m and N per unit of q, then of each of the k dofs
        of supports that move.
    """

    beam: Beam
    nodes: Vector
    moments: Vector
    shears: Vector

    def __repr__(self) -> str:
        return f"<section forces of {self.moments.shape[2]} coordinates in {len(self.nodes) - 1} elements>"

    def moment(self, z: ArrayLike, behind: bool = False) -> Vector:
        """(k, n) at z (k,); at a point moment that of the element ahead, or ``behind``."""
        a, b, da, db, x, h = self._around(z, behind)
        ends = (1 - x) ** 2 * (1 + 2 * x) * a + x**2 * (3 - 2 * x) * b
        return ends + h * x * (1 - x) * ((1 - x) * da - x * db)

    def shear(self, z: ArrayLike, behind: bool = False) -> Vector:
        """(k, n) at z (k,); at a point load that of the element ahead, or ``behind``."""
        a, b, da, db, x, h = self._around(z, behind)
        return 6 * x * (1 - x) * (b - a) / h + (1 - x) * (1 - 3 * x) * da + x * (3 * x - 2) * db

    def stress(self, z: ArrayLike, behind: bool = False) -> Vector:
        """Bending stress (k, n) at the lower outer fibre, M c/I; NaN where the section has no `fibre`."""
        profile = self.beam.profile(np.atleast_1d(z), behind)
        return self.moment(z, behind) * (profile.fibre / profile.I)[:, None]

    def _around(self, z: ArrayLike, behind: bool) -> tuple[Vector, ...]:
        """Moments and shear forces at both ends of the elements; where in them in [0, 1], and lengths: as columns."""
        z = on_beam(np.atleast_1d(np.asarray(z, dtype=float)), self.beam, "fields")
        element = np.clip(
            np.searchsorted(self.nodes, z, side="left" if behind else "right") - 1, 0, len(self.nodes) - 2
        )
        h = self.nodes[element + 1] - self.nodes[element]
        ends = [kind[element, end] for kind in (self.moments, self.shears) for end in (0, 1)]
        return *ends, ((z - self.nodes[element]) / h)[:, None], h[:, None]


def section_forces(model: ModalEquations, body: int = 0) -> SectionForces | FrameForces | JoinedForces | None:
    """The section forces of every coordinate of a model on one of its beams; None of bodies without sections."""
    beam = model.matrices.beams[body]
    if isinstance(beam, BodyMatrices) and not hasattr(beam.assembled, "section_forces"):
        return None
    first = sum(before.M.shape[0] for before in model.matrices.beams[:body])
    mine = slice(first, first + beam.M.shape[0])
    vectors = model.basis.vectors[mine]
    places = (at.row(beam) for at in loaded(model.scene, body))
    rows = sparse.vstack([sparse.csr_matrix((0, beam.M.shape[0])), *places, *beam.following_loads])
    done = sum(map(sum, model.counts[:body]))
    modes, held = slice(done, done + model.counts[body][0]), model.reduction_options.get("interface", False)
    inertia, load = _inertia(beam, vectors, model.omega, modes, held, rows.toarray().T)
    inertia, carried = beam.spread @ inertia, carried_on(model.scene, beam, body)
    moved = np.hstack([beam.spread @ vectors, carried])
    # less the inertia of the shapes which follow supports: they have none
    inertia = np.hstack([inertia, -inertia @ model.following.T])
    if isinstance(beam, BodyMatrices):
        made: Any = beam.assembled
        stresses = _stresses(beam, vectors, load, carried)
        forces: FrameForces | JoinedForces | None = made.section_forces(moved, inertia, stresses)
        return forces
    return _of_vectors(beam, moved, inertia)


def _inertia(
    beam: Matrices, vectors: Vector, omega: Vector, modes: slice, held: bool, rows: Vector
) -> tuple[Vector, Vector]:
    """The inertia a (N, n) with K v = M a + point loads along rows (N, m), where static shapes are loaded, and K v.

    The a of a static shape is a motion in the `modes`, `held` where the rows are: of all shapes, a coarse mesh has more
    than it tells apart. Loads are fitted to the shapes that they make where K = RᵀR, else to K v, which has the
    rounding of K.
    """
    a = vectors * omega**2
    load = beam.K @ vectors
    left = np.linalg.norm(load - beam.M @ a, axis=0)
    others = (omega > 0.0) & (left > BALANCED * np.linalg.norm(load, axis=0))  # of a rigid motion both are rounding
    if not np.any(others):
        return a, beam.M @ a
    # static shapes, orthogonal to modes or not: point loads beside inertia of the basis
    rooted = isinstance(beam, BodyMatrices) and beam.root is not None
    rigid = rigid_shapes(beam) if rooted else vectors[:, :0]  # type: ignore[arg-type]
    basis = vectors[:, modes]
    if held:
        basis = basis @ _still(rows.T @ basis)
    elif rooted:
        basis = basis[:, omega[modes] > 0.0]
    terms = np.hstack([beam.M @ basis, rows])
    if rooted:
        shapes = reduction.static_shapes(beam.M, beam.K, terms, rigid, beam.root)
        found = _fitted(shapes, vectors[:, others], 1e-14)
    else:
        found = _fitted(terms, load[:, others], 1e-12)
    acting, carried = beam.M @ a, rigid @ (rigid.T @ (terms @ found))  # what loads accelerate the whole by
    a[:, others] = basis @ found[: basis.shape[1]] - carried
    acting[:, others] = terms @ found - beam.M @ carried
    return a, acting


def _still(moved: Vector) -> Vector:
    """Combinations (n, k) of n shapes that do not move the places (m, n)."""
    from scipy.linalg import null_space

    size = np.linalg.norm(moved, axis=1)
    return np.asarray(null_space(moved[size > 0] / size[size > 0, None], rcond=STILL))


def _fitted(terms: Vector, given: Vector, least: float) -> Vector:
    """Least squares (m, n): terms (N, m) that make up the given ones (N, n); what they share to `least` is one."""
    size = np.linalg.norm(terms, axis=0)
    scale = np.where(size > 0, size, 1.0)
    return np.asarray(np.linalg.lstsq(terms / scale, given, rcond=least)[0] / scale[:, None])


def _stresses(beam: BodyMatrices, vectors: Vector, load: Vector, carried: Vector) -> Vector | None:
    """R v (k, n + c) of a body with K = RᵀR, balanced with the load (N, n) on the first n; None where K has no R."""
    own = beam.assembled.root
    if beam.root is None or own is None:
        return None
    solve = static_solver(beam.K, beam.M, rigid_shapes(beam))
    found = balanced(beam.root, solve, load, beam.root @ vectors)
    return np.hstack([found[: own.shape[0]], own @ carried])


def _of_vectors(beam: Matrices, vectors: Vector, inertia: Vector) -> SectionForces:
    """End forces of every element, of vectors and their inertia (2m, n) on all dofs."""
    K, M, dofs = element_matrices(beam.beam, beam.nodes)
    h = np.diff(beam.nodes)
    local, inner = (joining(h, dofs) @ values for values in (vectors, inertia))
    forces = K @ local - M @ inner
    side = np.array([-1.0, 1.0])[None, :, None]
    push, turn, slope = (values.reshape(len(h), 2, -1) for values in (forces[dofs[0]], forces[dofs[1]], local[dofs[1]]))
    stretch = h[:, None, None]
    return SectionForces(
        *(beam.beam, beam.nodes),
        moments=side * stretch * turn,
        shears=-side * push + beam.beam.axial_force * slope / stretch,
    )


@dataclass(frozen=True, eq=False)
class Extremes:
    """Least and greatest values over a run, place by place.

    Attributes
    ----------
    z : (j,) m, or pairs (place, direction). lowest, highest : (j,). t_lowest, t_highest : (j,) s, when.
    """

    z: Any
    lowest: Vector
    highest: Vector
    t_lowest: Vector
    t_highest: Vector

    def __repr__(self) -> str:
        return f"<extremes at {len(self.z)} places, {self.lowest.min():.4g} to {self.highest.max():.4g}>"

    @property
    def largest(self) -> tuple[float, Any, float]:
        """The value largest in size, its place z and its time t."""
        low, high = int(np.nanargmin(self.lowest)), int(np.nanargmax(self.highest))
        if abs(self.lowest[low]) > abs(self.highest[high]):
            return float(self.lowest[low]), _place(self.z[low]), float(self.t_lowest[low])
        return float(self.highest[high]), _place(self.z[high]), float(self.t_highest[high])

    def with_others(self, other: Extremes) -> Extremes:
        """The lesser and the greater ones of two sets of values at the same places."""
        less, more = other.lowest < self.lowest, other.highest > self.highest
        return Extremes(
            self.z,
            lowest=np.where(less, other.lowest, self.lowest),
            highest=np.where(more, other.highest, self.highest),
            t_lowest=np.where(less, other.t_lowest, self.t_lowest),
            t_highest=np.where(more, other.t_highest, self.t_highest),
        )


def _place(z: Any) -> Any:
    """A place as a number, or as it was named."""
    return z if isinstance(z, tuple) else float(z)


def extremes(t: Vector, q: Vector, z: Any, shapes: Vector, offset: Vector) -> Extremes:
    """Extremes at places z (j,) of q (k, n) @ shapes (j, n).T + offset (j,), some places at a time."""
    found = np.empty((4, len(z)))
    step = max(1, 2_000_000 // max(len(t), 1))
    for first in range(0, len(z), step):
        part = slice(first, first + step)
        values = q @ shapes[part].T + offset[part]
        low, high = np.argmin(values, axis=0), np.argmax(values, axis=0)
        columns = np.arange(values.shape[1])
        found[:, part] = values[low, columns], values[high, columns], t[low], t[high]
    return Extremes(z, *found)


def rows_of(run: Histories, quantity: str, z: Any, body: int, behind: bool = False) -> tuple[Vector, Vector]:
    """What turns q into a field: shapes (j, n) and a constant part (j,).

    ``behind``: of section forces those behind places where they jump, else those ahead.
    """
    if isinstance(z, list):  # of a body with places by name
        if quantity != "displacement":
            return _rows_of_frame(run, quantity, z, body, behind)
        return (run.shapes, *run.others)[body].rows_with_supports(z), np.zeros(len(z))
    known = ("displacement", "slope", "moment", "shear", "stress")
    require(quantity in known, f"quantity must be one of {', '.join(known)}", quantity, "Run", "choose one")
    if quantity in known[:2]:
        return (run.shapes, *run.others)[body].rows_with_supports(z, known.index(quantity)), np.zeros(len(z))
    forces = run.readout.section_forces[body]
    rows = getattr(forces, quantity)(z, behind)
    if quantity != "stress":
        return rows, np.zeros(len(z))
    bare = ~np.isfinite(rows).all(axis=1)
    require(not bare.any(), "every section must know its outer fibre", z[bare][:1].tolist(), "Run.stress",
            "give Section(..., fibre=)")  # fmt: skip
    return rows, forces.beam.axial_force / forces.beam.profile(z, behind).A


def _rows_of_frame(run: Histories, quantity: str, places: list[Any], body: int, behind: bool) -> tuple[Vector, Vector]:
    """`rows_of` of section forces and stress along the members of a frame."""
    forces = frame_forces_of(run, body, quantity)
    known = (*forces.names, "stress")
    quantity = {"moment": "M", "shear": "Q"}.get(quantity, quantity)
    require(quantity in known, f"quantity must be displacement or one of {', '.join(known)}", quantity, "Run",
            "choose one")  # fmt: skip
    rows = [
        forces.stress(z, behind=behind) if quantity == "stress" else forces.rows(z, (quantity,), behind)[0]
        for z in places
    ]
    return np.array(rows), np.array([forces.preload(z, quantity) for z in places])


def frame_forces_of(run: Histories, body: int, quantity: str = "a section force") -> FrameForces | JoinedForces:
    """The section forces of a frame; ValueError for bodies without sections, and runs that do not keep them."""
    forces = run.readout.section_forces[body]
    if isinstance(forces, (FrameForces, JoinedForces)):
        return forces
    raise ValueError(f"{quantity} is of a Beam or a Frame, which have sections, got body {body} in Run; ask for "
                     "displacement(place, direction), rotations included, or for reactions")  # fmt: skip
