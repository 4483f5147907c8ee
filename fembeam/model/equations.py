"""The equations of a reduced model: frequencies, damping, shapes, contacts and loads on its coordinates.

q_i'' + 2 ζ_i ω_i q_i' + ω_i² q_i = -Γ_i (ÿ + g) + Σ φ_i(z_f) f + Σ_s w_si F_s,    u(z, t) = Σ φ_i(z) q_i(t)
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse

import reduction
import solvers
from fembeam.model import initial_states
from fembeam.response import Site, site
from fembeam.response.shapes import Vector
from fembeam.scene import (
    ON,
    contact_rows,
    load_signals,
    loads,
    loads_of_dof,
    loads_of_order,
    signals_of,
    static_rows,
    support_loads,
    support_motion,
    tangent,
    weight,
)
from fembeam.scene.contact_rows import ContactRow
from fembeam.support import is_finite, is_whole, require

if TYPE_CHECKING:
    from fembeam.response import SectionForces
    from fembeam.scene import Matrices, Scene
    from fembeam.structures import FrameForces, JoinedForces

STILL = 1e-14  # of what all modes move a place: rounding of shapes is 1e-16 of it, on 1000 elements 2e-15
VARIED = "law", "gap", "clearance", "signal", "foot", "motion"  # fields of parts without which loads and contacts stay


def _places(scene: Scene) -> list[Any]:
    """What tells along which vectors contacts and loads act: parts but for their laws, gaps and signals."""
    parts = *scene.acting, *scene.supports, *scene.forces, *scene.springs
    kept = [[getattr(part, f.name) for f in fields(part) if f.name not in VARIED] for part in parts]
    moved = [(type(one), [*support_motion(one)]) for one in scene.supports]
    feet = [spring.foot is None for spring in scene.springs]
    return [kept, moved, feet, scene.impactors, scene.bodies, [*scene.motions], [*scene.pulls]]


def _contact(directions: Vector, one: ContactRow) -> solvers.Contact:
    """A contact of a scene on its rows of coordinates; of a place whose modes do not turn it the spin is all."""
    rub: dict[str, Any] = {} if one.friction is None else {"friction": one.friction}
    if not one.is_circle:
        rub |= {"map": "oblique", "tangent": _tangent(directions, one)} if rub else {}
        return solvers.Contact(directions[0], one.law, one.gap, one.always, one.name, **rub)
    radius, *centre = one.circle
    both = np.linalg.matrix_rank(directions[:2]) == 2
    require(both, f"the modes must move the place of {one.name!r} along both directions", len(directions[0]), "Model",
            "keep more modes: of a round section two for each shape")  # fmt: skip
    round_about: Any = {"map": "annulus", "centre": centre, "outer": radius < 0.0, **rub}
    if one.radius:
        turning = directions[2] if directions[2].any() else None
        round_about |= {"radius": one.radius, "spin": one.spin, "rotation": turning}
    return solvers.Contact(directions[:2], one.law, one.gap, one.always, one.name, **round_about)


def _tangent(directions: Vector, one: ContactRow) -> Vector:
    """The tangential row of an oblique stop; ValueError where the modes do not move its place both ways."""
    both = np.linalg.matrix_rank(directions) == 2
    require(both, f"the modes must move the place of {one.name!r} along its direction and its tangent",
            len(directions[0]), "Model", "keep more modes")  # fmt: skip
    return np.asarray(directions[1])


@dataclass(frozen=True, eq=False)
class ModalEquations:
    """A scene on n coordinates, as matrices, contacts and loads; `Model` explains the fields."""

    scene: Scene
    matrices: Matrices
    basis: reduction.Basis
    modes: tuple[int, ...]
    shapes: Any  # Shapes, of a body with places by name PlacedShapes
    counts: tuple[tuple[int, int], ...]
    others: tuple[Any, ...] = ()
    reduction_options: dict[str, Any] = field(default_factory=dict)

    @property
    def omega(self) -> Vector:
        """Natural frequencies (n,), rad/s."""
        return self.basis.omega

    @cached_property
    def zeta(self) -> Vector:
        """Damping ratios (n,) of the structure without dashpots."""
        return self._of_each_beam(lambda damping, omega, modes: damping.ratios(omega, modes), self.scene)

    def _of_each_beam(self, ask: Callable[[Any, Vector, tuple[int, ...]], Vector], scene: Scene) -> Vector:
        """An answer (n,) of each beam's damping for its own modes; 0 for impactors."""
        answers, done = [], 0
        for body, count in zip((scene, *scene.bodies), self.counts, strict=True):
            mine = slice(done, done + sum(count))
            answers.append(ask(body.damping, self.omega[mine], self.modes[mine]))
            done += sum(count)
        return np.concatenate([*answers, np.zeros(len(self.matrices.impactors))])

    @cached_property
    def participation(self) -> Vector:
        """Γ (n,) in √kg; of bodies that are no `Beam` (n, d), a column for each of `moved_along`."""
        if not self.matrices.beams[0].named:
            return self.basis.participation(self.matrices.base_load)
        loads = self.matrices.base_loads.values()
        return np.array([self.basis.participation(load) for load in loads]).reshape(-1, len(self.omega)).T

    @property
    def moved_along(self) -> tuple[str, ...]:
        """Directions in which the frame may move: of a beam "y"."""
        return tuple(self.matrices.base_loads)

    def participation_along(self, direction: str) -> Vector:
        """Γ (n,) of a motion of the frame in one direction."""
        column = self._column(direction)
        return self.participation if self.participation.ndim == 1 else self.participation[:, column]

    def _column(self, direction: str) -> int:
        """Number of a direction among those in which the frame may move."""
        known = self.moved_along
        require(direction in known, f"the frame must move along {', '.join(known) or 'nothing'}", direction, "Model",
                "gravity pulls along -y")  # fmt: skip
        return known.index(direction)

    @property
    def names(self) -> list[str]:
        """What to call each coordinate: "1" for the lowest mode, "static", "1 of beam 1", "impactor 0"."""
        names, done = [], 0
        for body, (count, static) in enumerate(self.counts):
            of = f" of beam {body}" if body else ""
            names += [f"{mode + 1}{of}" for mode in self.modes[done : done + count]] + [f"static{of}"] * static
            done += count + static
        return names + [f"impactor {i}" for i in range(len(self.matrices.impactors))]

    @property
    def effective_mass(self) -> Vector:
        """Γ² (n,) in kg."""
        return self.participation**2

    @cached_property
    def moving_mass(self) -> Any:
        """Sum of the effective masses over all modes, kg: what a base motion sets moving; (d,) likewise.

        b·M⁻¹ b of given matrices and numbers of elements, else its limit on fine meshes.
        """
        found = self.matrices.moved_masses
        return np.array(list(found.values())) if self.matrices.beams[0].named else found["y"]

    @property
    def static(self) -> int:
        """Number of residual static shapes."""
        return sum(static for _, static in self.counts)

    @cached_property
    def static_share(self) -> Vector:
        """Σ (bᵀφ_i)²/ω_i² / bᵀK⁻¹b at every stop, every element, then every force (m,)."""
        rows, full = static_rows(self.scene, self.matrices), self.matrices
        return reduction.static_share(self.basis, full.M, full.K, rows.T, full.root) if rows.shape[0] else np.zeros(0)

    def phi(self, z: Any, derivative: int = 0, body: int = 0) -> Vector:
        """Mass-normalised mode shapes in 1/√kg of a beam (0 the scene's own): (n,) at one z, (k, n) at z (k,).

        Of other bodies at (place, direction), or a list of such pairs.
        """
        shapes = self.body_shapes(body, "phi")
        return shapes(shapes.place(z), derivative)

    def rows_with_supports(self, z: Any, body: int = 0) -> Vector:
        """`phi` (…, n + k), with what the k dofs of supports that move carry of the place."""
        shapes = self.body_shapes(body, "phi")
        at = shapes.place(z)
        if not shapes.named or isinstance(at, list):
            return np.asarray(shapes.rows_with_supports(at))
        return np.asarray(shapes.rows_with_supports([at])[0])

    def body_shapes(self, body: int, where: str) -> Any:
        """Mode shapes of one body; ValueError unless there is one of that number."""
        every: Any = (self.shapes, *self.others)
        known = is_whole(body) and 0 <= body < len(every)
        require(known, f"body must be below {len(every)}, the number of bodies", body, where, "0 is the scene's own")
        return every[body]

    @cached_property
    def section_forces(self) -> tuple[SectionForces | FrameForces | JoinedForces | None, ...]:
        """Bending moment and shear force per unit of each coordinate, on each beam."""
        from fembeam.response import section_forces

        return tuple(section_forces(self, body) for body in range(len(self.matrices.beams)))

    @cached_property
    def contact_rows(self) -> list[ContactRow]:
        """The contacts in the order of the log: of each beam its stops, then its impactors."""
        return contact_rows(self.scene, self.matrices)

    @cached_property
    def sites(self) -> tuple[Site, ...]:
        """Where the contacts are."""
        plane = [not one.named for one in self.matrices.beams]
        rows = self.contact_rows
        return tuple(site(one.acting, one.push, one.body, one.rotation, one.always, plane[one.body]) for one in rows)

    @cached_property
    def directions(self) -> Vector:
        """(r, n): rows of all contacts on the coordinates: w of each, δ = -w·q - gap; of a circular clearance W (2, n).

        With friction one more, see `ContactRow`. `rows_of` says which rows are those of a contact.
        """
        found = [np.zeros((0, len(self.omega)))]
        for one in self.contact_rows:
            rows = self.basis.project(one.row.T).T
            found.append(rows if np.any(self._beyond_rounding(one.row, rows)) else np.zeros_like(rows))
        return np.vstack(found)

    def _beyond_rounding(self, rows: sparse.csr_matrix, projected: Vector) -> Any:
        """(k, n): which coordinates rows (k, N) move by more than rounding, of which come contacts of 1e-18 m."""
        reach = rows.multiply(rows) @ (1.0 / self.matrices.M.diagonal())  # about Σ w² over all modes
        return np.abs(projected) > STILL * np.sqrt(reach)[:, None]

    def _pushed(self, row: sparse.csr_matrix) -> Vector:
        """(n,): what a load (1, N) does to each coordinate; nothing instead of rounding, of which stops would hear."""
        return self._without_rounding(row, self.basis.project(row.T).T)

    def _without_rounding(self, row: sparse.csr_matrix, pushed: Vector) -> Vector:
        """A projected load (1, n) as (n,), zero where it is rounding."""
        return np.asarray(np.where(self._beyond_rounding(row, pushed), pushed, 0.0)[0])

    @cached_property
    def rows_of(self) -> list[slice]:
        """Which of the rows of `directions` are those of each contact."""
        ends = np.cumsum([0, *(one.row.shape[0] for one in self.contact_rows)]).tolist()
        return [slice(a, b) for a, b in pairwise(ends)]

    @cached_property
    def run_fields(self) -> dict[str, Any]:
        """What every run keeps of its scene and contacts, by the name of its attribute; the arrays are read-only."""
        rows = self.contact_rows
        along = [one.z if is_finite(one.z) and one.direction is None else np.nan for one in rows]
        stops = [(z, one.push, one.gap) for z, one in zip(along, rows, strict=True)]
        found: dict[str, Any] = {
            "stops": np.array(stops, dtype=float).reshape(-1, 3),
            "between": np.array([(one.body, ON.index(one.on[0]), one.on[1]) for one in rows], dtype=int).reshape(-1, 3),
            "kinds": np.array([(one.rotation, one.always) for one in rows], dtype=bool).reshape(-1, 2),
            "circles": np.array([one.circle for one in rows], dtype=float).reshape(-1, 3),
            "rubs": np.array([one.rub for one in rows], dtype=float).reshape(-1, 4),
            "impactor_masses": np.array([impactor.mass for impactor in self.matrices.impactors], dtype=float),
        }
        for array in found.values():
            array.flags.writeable = False
        return {
            **found,
            "names": tuple(one.name for one in rows),
            "name_given": tuple(one.given for one in rows),
            "places": tuple(one.acting for one in rows),
            "scene": repr(self.scene),
        }

    @cached_property
    def system(self) -> solvers.System:
        """The matrix-level problem: M = I, C, K = diag(ω²), contacts, loads."""
        return self.system_of(self.scene)

    def system_of(self, scene: Scene) -> solvers.System:
        """The problem of a scene that differs from the model's in loads, gaps and laws only."""
        n = len(self.omega)
        C = np.diag(self._damping_of(scene)) + self.basis.project_matrix(self.matrices.dashpots)
        same = self.contact_rows if scene is self.scene else contact_rows(scene, self.matrices)
        contacts = [_contact(self.directions[own], one) for own, one in zip(self.rows_of, same, strict=True)]
        rows = [(self._pushed(row), signal) for row, signal in loads(scene, self.matrices)]
        for i, q in enumerate(self.following):  # damping acts on what does not follow the supports
            _, of_speed, _ = loads_of_dof(i)
            vector, signal = rows[of_speed]
            rows[of_speed] = vector + self._damping_of(scene) * q, signal
        pushed = [*rows, *self._frame_loads(scene)]
        return solvers.System(np.eye(n), C, np.diag(self.omega**2), contacts, pushed, self.turning)

    def _damping_of(self, scene: Scene) -> Vector:
        """2 ζ ω (n,) of the structure without dashpots."""
        return self._of_each_beam(lambda damping, omega, modes: damping.modal_coefficients(omega, modes), scene)

    @cached_property
    def following(self) -> Vector:
        """(k, n): coordinates of the shapes by which the structure follows a unit motion of each moving support dof."""
        by_displacement = support_loads(self.scene, self.matrices)[loads_of_order(0, self.shapes.moving)]
        rows = [row for row, _ in by_displacement]
        projected = np.array([self.basis.project(row.T)[:, 0] for row in rows]).reshape(len(rows), len(self.omega))
        square = np.where(self.omega > 0.0, self.omega**2, np.inf)
        return np.asarray(projected / square)

    @cached_property
    def turning(self) -> Vector | None:
        """ΦᵀGΦ (n, n) of what spins, skew-symmetric; None where nothing does."""
        if self.matrices.gyroscopic is None:
            return None
        G = self.basis.project_matrix(self.matrices.gyroscopic)
        return 0.5 * (G - G.T)

    def _frame_loads(self, scene: Scene) -> list[tuple[Vector, Any]]:
        """Loads of base motion and gravity."""
        own = self.matrices.base_loads
        signals = [(way, motion.derivative(2)) for way, motion in scene.motions.items()]
        return [
            (-self._without_rounding(sparse.csr_matrix(own[way][None]), self.participation_along(way)[None]), signal)
            for way, signal in (*signals, *weight(scene).items())
        ]

    def system_like(self, scene: Scene) -> solvers.System:
        """What `system_of` returns, quicker where only signals, gaps and laws of its own parts differ."""
        if _places(scene) != _places(self.scene):
            return self.system_of(scene)
        own, parts, known = self.system, scene.acting, self.scene.acting
        contacts = [
            contact if new is old else replace(contact, law=new.law, gap=new.gap)
            for contact, new, old in zip(own.contacts, parts, known, strict=False)
        ]
        signals = [*load_signals(scene), *(signal for _, signal in self._frame_loads(scene))]
        moved = [(vector, signal) for (vector, _), signal in zip(own.loads, signals, strict=True)]
        return own.like([*contacts, *own.contacts[len(known) :]], moved)

    @cached_property
    def linear_elements(self) -> tuple[Vector, Vector]:
        """Stiffness and damping (n, n) of the elements at d = -gap, nothing deflected: Σ w ∂F/∂d wᵀ, Σ w ∂F/∂ḋ wᵀ."""
        return self._elements_with([tangent(one.law, -one.gap) for one in self.contact_rows if one.always])

    @cached_property
    def slipping_elements(self) -> tuple[Vector, Vector]:
        """`linear_elements` with what is left of those that slip or yield once all of their sliders move."""
        always = [one for one in self.contact_rows if one.always]
        return self._elements_with([after_slip(one.law) or tangent(one.law, -one.gap) for one in always])

    def _elements_with(self, slopes: list[tuple[float, float]]) -> tuple[Vector, Vector]:
        """Stiffness and damping (n, n) of the elements from those of each."""
        pairs = zip(self.rows_of, self.contact_rows, strict=True)
        W = np.array([self.directions[own][0] for own, one in pairs if one.always])
        W, each = W.reshape(-1, len(self.omega)), np.array(slopes).reshape(-1, 2)
        return (W.T * each[:, 0]) @ W, (W.T * each[:, 1]) @ W

    def rest(self) -> Vector:
        """The start [q, q_dot] (2n,) of everything undeflected and at rest but the impactors, at their velocity."""
        return initial_states.rest(self)


def after_slip(law: Any) -> tuple[float, float] | None:
    """Stiffness and damping of a law all of whose sliders move; None of one without a memory whose size is known.

    The slope of its first loading far beyond them, that of a sum with its parts without memory at rest.
    """
    parts = getattr(law, "parts", (law,))
    if not any(part.memory and part.reach > 0.0 for part in parts):
        return None
    found = [tangent(part, 0.0) if not (part.memory and part.reach > 0.0) else _far(part) for part in parts]
    stiffness, damping = np.sum(found, axis=0)
    return float(stiffness), float(damping)


def _far(law: Any) -> tuple[float, float]:
    """Slope of the first loading of a law with memory between 50 and 100 times its size."""
    places = law.reach * np.array([50.0, 100.0])
    low, high = law.along(places)
    slope = (high - low) / (places[1] - places[0])
    return float(slope) if abs(slope) > 1e-9 * abs(high) / places[1] else 0.0, 0.0


def load_period(scene: Scene) -> float:
    """Period of all loads together, s; an error where there is none."""
    return common_period(list(signals_of(scene).values()))


def common_period(signals: list[Any]) -> float:
    """Period of some signals together, s."""
    others = [signal for signal in signals if not hasattr(signal, "tones")]
    require(not others, "an orbit needs periodic loads", others, "the scene", "use Harmonic or Multisine")
    omega = np.concatenate([np.asarray(signal.tones()[0], dtype=float) for signal in signals] or [np.zeros(0)])
    omega = omega[omega > 0.0]
    require(omega.size > 0, "an orbit needs a load with a period", signals, "the scene", "add base=Harmonic(...)")
    if omega.size == 1:
        return 2.0 * math.pi / float(omega[0])
    ratios = [Fraction(w / omega.min()).limit_denominator(1000) for w in omega]
    off = max(abs(float(r) * omega.min() / w - 1.0) for r, w in zip(ratios, omega, strict=True))
    require(off < 1e-9, "the tones have no common period", omega.tolist(), "the scene", "make their ratios rational")
    common = Fraction(math.gcd(*(r.numerator for r in ratios)), math.lcm(*(r.denominator for r in ratios)))
    return 2.0 * math.pi / (omega.min() * float(common))
