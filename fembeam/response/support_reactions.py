"""Forces and moments that supports, springs and dashpots exert on the beams, by d'Alembert's principle.

At every sample supports and springs balance statically all that acts on the unreduced finite-element model,

    K u_s = f - M (ü + r (ÿ + g)),    reaction = (K_all u_s + M_all (ü + r (ÿ + g)) - f) on the supported dofs,

f the loads, contact forces, dashpots and the C of a structure, ü the motion of the kept modes. Modes left out follow
statically, so that forces and moments balance whatever the number of modes. Damping by ratios or Rayleigh's is taken as
part of the internal forces.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fembeam.beams import bending_root, hermite_rows
from fembeam.response.body_reactions import BodyHeld, static_solver
from fembeam.response.histories import modal_accelerations
from fembeam.scene import (
    PER_DOF,
    BodyMatrices,
    Spring,
    contact_rows,
    loads,
    loads_of_order,
    quoted,
    rigid_shapes,
    unsupported,
)
from fembeam.structures import COMPONENTS
from fembeam.support import Part, Printed, is_finite, is_whole, require

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fembeam.model import Model
    from fembeam.response.histories import Histories
    from fembeam.scene import Matrices, Scene

Vector = NDArray[np.float64]
REFINED = 4  # times; each gains the digits that rounding of K, eps n⁴ of n elements, leaves: one does to 1000 elements


@dataclass(frozen=True, eq=False)
class Reaction:
    """What one support, spring or dashpot exerts on its beam.

    Attributes
    ----------
    part : the Clamped, Pinned, Guided, Spring or Dashpot. body : the beam it holds, 0 the scene's own.
    t : (k,) s. force : (k,) N, positive up. moment : (k,) N m, positive where it turns u_z up; zeros where the part
        exerts none.
    """

    part: Any
    body: int
    t: Vector
    force: Vector
    moment: Vector

    @property
    def name(self) -> str:
        """The name of the part, else such as "Clamped at z = 0 m"."""
        if self.part.name is not None:
            return str(self.part.name)
        at = f"z = {self.part.z:g} m" if is_finite(self.part.z) else quoted(self.part.z)
        return f"{type(self.part).__name__} at {at}" + (f" of beam {self.body}" if self.body else "")

    def __repr__(self) -> str:
        return f"<reaction of {self.name}, largest force {self.largest()[0]:.5g} N>"

    def __getitem__(self, component: str) -> Vector:
        """One component (k,) along the global axes: "y" the force, "rx" the moment, turned round."""
        zeros = np.zeros_like(self.force)
        return {"y": self.force, "rx": -self.moment}.get(component, zeros)

    def extremes(self, quantity: str = "force") -> tuple[tuple[float, float], tuple[float, float]]:
        """((least, its time), (greatest, its time)) over the samples of the "force" or the "moment"."""
        values = self._history(quantity)
        low, high = int(np.argmin(values)), int(np.argmax(values))
        return (float(values[low]), float(self.t[low])), (float(values[high]), float(self.t[high]))

    def _history(self, quantity: str) -> Vector:
        """What `extremes` are those of, (k,)."""
        require(quantity in ("force", "moment"), "quantity must be 'force' or 'moment'", quantity, "Reaction",
                "choose one")  # fmt: skip
        return np.asarray(getattr(self, quantity))

    def largest(self, quantity: str = "force") -> tuple[float, float]:
        """The value largest in size, and its time."""
        return max(self.extremes(quantity), key=lambda found: abs(found[0]))


@dataclass(frozen=True, eq=False, repr=False)
class BodyReaction(Reaction):
    """What one support, spring or dashpot exerts at a place of a body, by components: ``reaction["x"]`` (k,).

    Attributes
    ----------
    part, body, t : as for a beam. force : (k, 3) N along x, y, z. moment : (k, 3) N m about the axes through the place.
    """

    @property
    def name(self) -> str:
        """The name of the part, else such as "Clamped at 'A'", "Fixed at node 7"."""
        if self.part.name is None and is_whole(self.part.z):
            return f"{type(self.part).__name__} at node {self.part.z}" + (f" of body {self.body}" if self.body else "")
        return super().name

    def __getitem__(self, component: str) -> Vector:
        """One of x, y, z, rx, ry, rz (k,)."""
        require(component in COMPONENTS, f"component must be one of {', '.join(COMPONENTS)}", component, "Reaction",
                "choose one")  # fmt: skip
        number = COMPONENTS.index(component)
        return self.force[:, number] if number < 3 else self.moment[:, number - 3]

    def _history(self, quantity: str) -> Vector:
        """A component (k,), or the size of the "force" or the "moment"."""
        whole = quantity in ("force", "moment")
        return np.asarray(np.linalg.norm(getattr(self, quantity), axis=1) if whole else self[quantity])


@dataclass(frozen=True, eq=False)
class Reactions(Printed):
    """All reactions of a run: of each beam its supports in the scene's order, then springs, then dashpots.

    Index or iterate: ``run.reactions()[0].force``. `print` and notebooks show the extremes.
    """

    each: tuple[Reaction, ...]

    def __len__(self) -> int:
        return len(self.each)

    def __getitem__(self, index: int) -> Reaction:
        return self.each[index]

    def __iter__(self) -> Iterator[Reaction]:
        return iter(self.each)

    def __repr__(self) -> str:
        return f"<{len(self)} reactions: {', '.join(one.name for one in self)}>"

    def _parts(self) -> list[Part]:
        if any(isinstance(one, BodyReaction) for one in self):
            head = ["reaction", "component", "least / N, N m", "greatest / N, N m"]
            each = ((one.name, c, one[c]) for one in self for c in COMPONENTS if one[c].any())
            return [(head, [[name, c, float(x.min()), float(x.max())] for name, c, x in each])]
        head = ["reaction", "least force / N", "greatest / N", "least moment / N m", "greatest / N m"]
        rows = [[one.name, *(found[0] for q in ("force", "moment") for found in one.extremes(q))] for one in self]
        return [(head, rows)]

    @property
    def force(self) -> Vector:
        """Sum of all forces (k,), N; (k, 3) along x, y, z where a body is no `Beam`."""
        if any(isinstance(one, BodyReaction) for one in self):
            return np.asarray(sum(np.array([one[c] for c in COMPONENTS[:3]]).T for one in self))
        return np.asarray(sum(one.force for one in self))


def reactions(run: Histories) -> Reactions:
    """The reactions at the samples; `Run.reactions` explains them."""
    parts, rows = run.readout.reactions
    q_dot = run._at_samples(run.q_dot)
    histories = np.vstack([run._forces, run.readout.loads, modal_accelerations(run).T, q_dot.T])
    pairs = zip(parts, rows, strict=True)
    beams = (run.shapes, *run.others)
    found: list[Reaction] = []
    for (part, body), row in pairs:
        values = row @ histories
        if beams[body].named:
            found.append(BodyReaction(part, body, run.t, values[:3].T, values[3:].T))
        else:
            found.append(Reaction(part, body, run.t, *(values if len(values) == 2 else (values[1], -values[3]))))
    return Reactions(tuple(found))


def reaction_rows(model: Model) -> tuple[list[tuple[Any, int]], Vector]:
    """(part, body) of each reaction, and its force and moment (r, 2, c) per unit of [F; s; q''; q'].

    Of scenes with a body that is no `Beam` all six components (r, 6, c).
    """
    full, columns = unsupported(model.scene, model.matrices), _support_columns(model)
    acting = _acting(model, full)
    found = [*_of_supports(model, full, acting, columns), *_of_dashpots(model, acting.shape[1], columns)]
    components = 6 if any(beam.named for beam in full.beams) else 2
    rows = [row if len(row) == components else _six(row) for _, row in found]
    return [part for part, _ in found], np.array(rows).reshape(len(rows), components, acting.shape[1])


class _SupportColumns(NamedTuple):
    """Columns of [F; s; q''; q'] with the loads that act through supports, springs and dashpots."""

    displacements: slice  # of the dofs of supports that move
    speeds: slice  # of the same dofs
    feet: list[range]  # of each body, one for each spring whose foot moves


def _support_columns(model: Model) -> _SupportColumns:
    """The columns in a model: first F on the rows of contacts, then s in the order of `loads`."""
    first, moving = len(model.directions), model.shapes.moving
    feet, done = [], first + PER_DOF * moving
    for scene in (model.scene, *model.scene.bodies):
        begin = done + len(scene.forces)
        done = begin + sum(spring.foot is not None for spring in scene.springs)
        feet.append(range(begin, done))
    return _SupportColumns(loads_of_order(0, moving, first), loads_of_order(1, moving, first), feet)


def _of_supports(
    model: Model, full: Matrices, acting: Vector, columns: _SupportColumns
) -> Iterator[tuple[tuple[Any, int], Vector]]:
    """(part, body) of each support and spring, and its rows (2, c) or (6, c)."""
    each = np.split(acting, np.cumsum([beam.M.shape[0] for beam in full.beams]))
    for body, scene in enumerate((model.scene, *model.scene.bodies)):
        felt = np.flatnonzero(each[body].any(axis=0))  # the columns that act on this body
        held = _held(scene, model.matrices.beams[body], full.beams[body], each[body][:, felt])
        feet = iter(columns.feet[body])
        for part in (*scene.supports, *scene.springs):
            answer = np.array(held.by(part))
            row = np.zeros((len(answer), acting.shape[1]))
            row[:, felt] = answer
            if isinstance(part, Spring):
                row[:, columns.displacements] -= _with_supports(part, "stiffness", model, body)
            if isinstance(part, Spring) and part.foot is not None:  # a moving foot adds to the force of its spring
                row[:, next(feet)] += part.stiffness * np.array(part.along or (1.0, 0.0))
            yield (part, body), row


def _held(scene: Scene, known: Matrices, loose: Matrices, acting: Vector) -> _Held | BodyHeld:
    """The static answer of one body to all that acts on it, with its supports and without them."""
    if isinstance(known, BodyMatrices) and isinstance(loose, BodyMatrices):
        return BodyHeld(scene, known, loose, acting)
    return _Held(scene, known, acting)


def _of_dashpots(model: Model, width: int, columns: _SupportColumns) -> Iterator[tuple[tuple[Any, int], Vector]]:
    """(part, body) of each dashpot, and its rows (2, c) or (6, c): they feel q', the last columns, and supports."""
    for part, body, rates in _dashpots(model):
        by_rate = np.outer(part.along, rates[0]) if part.along is not None else rates
        row = np.hstack([np.zeros((len(by_rate), width - by_rate.shape[1])), by_rate])
        row[:, columns.speeds] -= _with_supports(part, "damping", model, body)
        yield (part, body), row


def _with_supports(part: Any, name: str, model: Model, body: int) -> Vector:
    """What a unit motion of each moving support dof by itself puts on a spring or dashpot: (2, k), or (6, k)."""
    shapes, n, size = (model.shapes, *model.others)[body], len(model.omega), getattr(part, name)
    if part.along is not None:
        return size * np.outer(part.along, shapes.rows_with_supports([(part.z, part.direction)])[0, n:])
    parts = (size, part.rotational)
    return np.array([one * shapes.rows_with_supports(part.z, i)[n:] for i, one in enumerate(parts)])


def _six(row: Vector) -> Vector:
    """Force and moment (2, c) on a beam as components (6, c)."""
    out = np.zeros((6, row.shape[1]))
    out[1], out[3] = row[0], -row[1]
    return out


def _dashpots(model: Model) -> Iterator[tuple[Any, int, Vector]]:
    """The dashpots with their bodies, and force and moment (2, n) per unit of q': -c φ and -γ φ_z."""
    for body, scene in enumerate((model.scene, *model.scene.bodies)):
        for part in scene.dashpots:
            if part.along is not None:
                yield part, body, -part.damping * model.phi((part.z, part.direction), 0, body)[None]
                continue
            rates = (-part.damping * model.phi(part.z, 0, body), -part.rotational * model.phi(part.z, 1, body))
            yield part, body, np.array(rates)


def _acting(model: Model, full: Matrices) -> Vector:
    """All that acts but supports and springs, on all dofs: columns (N_all, c) per unit of [F; s; q''; q']."""
    scene, size = model.scene, full.M.shape[0]
    rows = [one.row for one in contact_rows(scene, full)] + [row for row, _ in loads(scene, full)]
    pushed = sparse.vstack([sparse.csr_matrix((0, size)), *rows]).toarray().T
    moved = [*scene.motions, *scene.pulls]
    frame = -np.array([full.base_loads[direction] for direction in moved]).reshape(-1, size).T
    spread = [beam.spread for beam in model.matrices.beams]  # of massless dofs to what they follow
    spread.append(sparse.eye(len(full.impactors)))
    vectors = sparse.block_diag(spread, format="csr") @ model.basis.vectors
    damped = np.zeros_like(vectors)
    for part, body, rates in _dashpots(model):
        if part.along is not None:
            damped += full.row(part.z, part.along, body).T @ rates
            continue
        for derivative in (0, 1):
            damped += full.interpolation(part.z, derivative, body).T @ rates[[derivative]]
    if full.gyroscopic is not None:
        damped -= full.gyroscopic @ vectors
    damped -= _own_damping(full) @ vectors
    return np.hstack([pushed, frame, -(full.M @ vectors), damped])


def _own_damping(full: Matrices) -> sparse.csr_matrix:
    """C (N_all, N_all) that bodies came with, whose places are known as those of dashpots are."""
    own = [beam.assembled.C if isinstance(beam, BodyMatrices) else None for beam in full.beams]
    parts = [sparse.csr_matrix(beam.M.shape) if C is None else C for beam, C in zip(full.beams, own, strict=True)]
    return sparse.block_diag([*parts, sparse.csr_matrix(2 * (len(full.impactors),))], format="csr")


class _Held:
    """One beam's static answer to unit loads: stresses y with B_freeᵀ y = load, reactions B_supportedᵀ y - load.

    K = BᵀB, rows of compression imaginary. The stresses are refined, not the displacements: K u loses eps n³ of the
    load, Bᵀ y eps n.
    """

    def __init__(self, scene: Scene, matrices: Matrices, columns: Vector) -> None:
        self.matrices, self.columns = matrices, columns
        self.springs, self.nodes = list(scene.springs), matrices.nodes
        self.B = _factor(scene, matrices.nodes)
        self.free = np.flatnonzero(matrices.dofs.ravel() >= 0)

    @cached_property
    def stresses(self) -> Vector:
        """Y (rows of B, c)."""
        B = self.B[:, self.free]
        solve = static_solver(self.matrices.K, self.matrices.M, rigid_shapes(self.matrices, 2))
        stress = np.zeros((B.shape[0], self.columns.shape[1]), B.dtype)
        for _ in range(REFINED):
            stress += B @ solve(self.columns[self.free] - (B.T @ stress).real)
        return stress

    def by(self, part: Any) -> tuple[Vector, Vector]:
        """Force and moment (c,) of a support or spring per unit of each column."""
        if any(part is spring for spring in self.springs):
            first, count = self.springs.index(part) - 2 * len(self.springs), len(self.springs)
            stiffness = np.sqrt([part.stiffness, part.rotational])
            return tuple(-stiffness[i] * self.stresses[first + i * count].real for i in range(2))  # type: ignore[return-value]
        dof = 2 * int(np.argmin(np.abs(self.nodes - part.z)))
        balance = (self.B[:, dof : dof + 2].T @ self.stresses).real - self.columns[dof : dof + 2]
        return tuple(balance * np.array(part.fixed)[:, None])  # type: ignore[return-value]


def _factor(scene: Scene, nodes: Vector) -> sparse.csr_matrix:
    """B on all dofs; the springs' rows come last, √k u then √κ u_z.

    Springs without stiffness have rows of zeros.
    """
    z = np.array([spring.z for spring in scene.springs], dtype=float)
    springs = [
        sparse.diags(np.sqrt([getattr(spring, name) for spring in scene.springs])) @ hermite_rows(nodes, z, derivative)
        for derivative, name in enumerate(("stiffness", "rotational"))
    ]
    return sparse.vstack([bending_root(scene.beam, nodes), *(springs if len(z) else ())], format="csr")
