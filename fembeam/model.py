"""The reduced model: a scene seen through a few modes, ready to be simulated.

q_i'' + 2 ζ_i ω_i q_i' + ω_i² q_i = -Γ_i ÿ + Σ φ_i(z_f) f + Σ_s w_si F_s,    u(z, t) = Σ φ_i(z) q_i(t)
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

import reduction
import solvers
from fembeam.beam import hermite_rows
from fembeam.section import require, require_positive

if TYPE_CHECKING:
    from pathlib import Path

    from fembeam.assembly import Matrices
    from fembeam.branch import Branch
    from fembeam.orbit import Attractor, Orbit
    from fembeam.run import Run
    from fembeam.scene import Scene

Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Shapes:
    """Shape functions φ_i(z): values (2m, n) of (u, u_z) at the nodes (m,), the elements' cubics between."""

    nodes: Vector
    values: Vector

    def __call__(self, z: ArrayLike, derivative: int = 0) -> Vector:
        """φ(z): (n,) at one z, (k, n) at z (k,); derivative 1 is the slope, 2 the curvature."""
        places = np.asarray(z, dtype=float)
        outside = ~((places >= self.nodes[0]) & (places <= self.nodes[-1]))
        require(not np.any(outside), f"z must lie on the beam, 0 to {self.nodes[-1]} m",
                places[outside].tolist(), "phi", "keep to the beam")  # fmt: skip
        rows = hermite_rows(self.nodes, places.ravel(), derivative) @ self.values
        return rows.reshape(*places.shape, self.values.shape[1])


@dataclass(frozen=True, eq=False)
class Model:
    """A scene reduced to n modes; made by `Scene.reduce`.

    Attributes
    ----------
    omega, zeta : (n,) rad/s and damping ratios (the modes' own; dashpots couple modes and come on top). A static
        shape is a pseudo-mode of high frequency, damped as the next higher mode would be (Rayleigh: by its ω).
    participation : Γ (n,) = Φᵀ M r in √kg: the load of a base motion y is -Γ ÿ.
    effective_mass : Γ² (n,) in kg; over all modes it sums to the moving mass.
    modes : (n,) numbers of the kept modes, 0 the lowest; static shapes come last and are numbered on.
    static : how many of the last ones are residual static shapes.
    way : arguments of `Scene.reduce` that make it again, with mode numbers instead of criteria.
    static_share : part of the static compliance that the model keeps at every stop, then at every force; 1 is all.
    shapes : φ(z); call ``model.phi(z)``.
    """

    scene: Scene
    matrices: Matrices
    basis: reduction.Basis
    modes: tuple[int, ...]
    shapes: Shapes
    static: int = 0
    way: dict[str, Any] = field(default_factory=dict)

    @property
    def omega(self) -> Vector:
        """Natural frequencies (n,), rad/s."""
        return self.basis.omega

    @cached_property
    def zeta(self) -> Vector:
        """Damping ratios (n,) of the structure without dashpots."""
        return self.scene.damping.ratios(self.omega, self.modes)

    @cached_property
    def participation(self) -> Vector:
        """Γ (n,) in √kg."""
        return self.basis.participation(self.matrices.base_load)

    @property
    def effective_mass(self) -> Vector:
        """Γ² (n,) in kg."""
        return self.participation**2

    def again(self, scene: Scene) -> Model:
        """Another scene reduced in the same way: the same mode numbers, mesh size and kind of static shapes."""
        return scene.reduce(**self.way)

    @cached_property
    def moving_mass(self) -> float:
        """Sum of the effective masses over all modes, b·M⁻¹ b in kg: what a base motion sets moving."""
        return reduction.moved_mass(self.matrices.M, self.matrices.base_load)

    @cached_property
    def static_share(self) -> Vector:
        """Σ (bᵀφ_i)²/ω_i² / bᵀK⁻¹b at every stop, then every force (m,)."""
        rows, full = self.matrices.interpolation(self.scene.loaded_places), self.matrices
        return reduction.static_share(self.basis, full.M, full.K, rows.T, full.root) if rows.shape[0] else np.zeros(0)

    def strike(self, speed: float, stop: int = 0) -> solvers.ContactLog:
        """Contacts with one stop when the model swings into it in its first mode, nothing else acting.

        Tells what to expect before a study: contact time ``t_out - t_in`` of the first contact and peak force, and so
        how many periods of the highest mode a contact lasts.

        Parameters
        ----------
        speed : m/s at the stop on arrival, > 0.
        stop : its number.
        """
        require_positive("speed", speed, "Model.strike", "give the speed of arrival in m/s")
        require(0 <= stop < len(self.scene.stops), f"stop must be below {len(self.scene.stops)}", stop, "Model.strike",
                "count from 0")  # fmt: skip
        contact = self.system.contacts[stop]
        start = np.zeros((2, len(self.omega)))
        start[:, 0] = np.array([-contact.gap, -speed]) / contact.direction[0]
        system = solvers.System(self.system.M, self.system.C, self.system.K, [contact])
        slowest = max(float(self.omega[0]), 1.0)
        return solvers.integrate(system, *start, np.pi / slowest).contacts

    def phi(self, z: ArrayLike, derivative: int = 0) -> Vector:
        """Mass-normalised mode shapes in 1/√kg: (n,) at one z, (k, n) at z (k,)."""
        return self.shapes(z, derivative)

    @cached_property
    def system(self) -> solvers.System:
        """The matrix-level problem: M = I, C, K = diag(ω²), contacts, loads."""
        return self.system_of(self.scene)

    def system_of(self, scene: Scene) -> solvers.System:
        """The problem of a scene that differs from the model's in loads, gaps and laws only."""
        n = len(self.omega)
        C = np.diag(scene.damping.modal_coefficients(self.omega, self.modes))
        C = C + self.basis.project_matrix(self.matrices.dashpots)
        contacts = [solvers.Contact(stop.push * self.phi(stop.z), stop.law, stop.gap) for stop in scene.stops]
        loads = [(self.phi(force.z), force.signal) for force in scene.forces]
        if scene.base is not None:
            loads.append((-self.participation, scene.base.derivative(2)))
        return solvers.System(np.eye(n), C, np.diag(self.omega**2), contacts, loads)

    def rest(self) -> Vector:
        """The start at rest: (2n,) zeros."""
        return np.zeros(2 * len(self.omega))

    def state(
        self,
        displacement: Callable[[Vector], Any] | None = None,
        velocity: Callable[[Vector], Any] | None = None,
    ) -> Vector:
        """The start [q, q_dot] (2n,) nearest, in the mass norm, to given fields u(z) in m and u̇(z) in m/s.

        Parameters
        ----------
        displacement, velocity : functions of z (k,), relative to the frame; None is zero.
        """
        return np.concatenate([self._coordinates(field) for field in (displacement, velocity)])

    def _coordinates(self, field: Callable[[Vector], Any] | None) -> Vector:
        """Q = Φᵀ M u of a field, its slopes from a cubic spline through the nodes."""
        if field is None:
            return np.zeros(len(self.omega))
        from scipy.interpolate import CubicSpline

        nodes = self.matrices.nodes
        values = np.broadcast_to(np.asarray(field(nodes), dtype=float), nodes.shape)
        bad = values[~np.isfinite(values)]
        require(not bad.size, "the field must be finite on the beam", bad[:1], "Model.state", "check the function")
        both = np.stack([values, CubicSpline(nodes, values)(nodes, 1)], axis=1)
        return self.basis.project(self.matrices.M @ both[self.matrices.dofs >= 0])

    def lasting(self, duration: float) -> Model:
        """The same model with every signal good for ``duration``; noise without a period gets one."""
        from dataclasses import replace

        scene, base = self.scene, self.scene.base
        if hasattr(base, "lasting"):
            base = base.lasting(duration)
        forces = [
            replace(force, signal=force.signal.lasting(duration)) if hasattr(force.signal, "lasting") else force
            for force in scene.forces
        ]
        if base is scene.base and all(a is b for a, b in zip(forces, scene.forces, strict=True)):
            return self
        return replace(self, scene=replace(scene, base=base, forces=forces))

    def simulate(
        self,
        duration: float,
        dt: float | None = None,
        start: ArrayLike | None = None,
        solver: Any = None,
        progress: bool = False,
    ) -> Run:
        """Integrate the model from t = 0.

        Parameters
        ----------
        duration : s.
        dt : output sampling in s; None keeps the final state and the contact log only.
        start : (2n,) as made by `rest` or `state`; None is rest.
        solver : one of the methods in `solvers`; None is the library's best.
        progress : show a bar (only on a terminal).

        Returns
        -------
        Run : after Ctrl-C partial, and its status says so.

        Raises
        ------
        ValueError for bad input before computing; solvers.SolverError when the method fails.
        """
        from fembeam.run import Run, bar

        start = self.rest() if start is None else np.asarray(start, dtype=float)
        n = len(self.omega)
        require(start.shape == (2 * n,), f"start must have shape ({2 * n},), [q, q_dot]", start.shape,
                "Model.simulate", "use model.state(displacement, velocity)")  # fmt: skip
        lasting = self.lasting(duration) if 0.0 < duration < np.inf else self
        with bar(duration, progress) as report:
            solution = solvers.integrate(lasting.system, start[:n], start[n:], duration, dt, solver, progress=report)
        return Run.of(lasting, solution)

    def orbit(self, period: int = 1, start: ArrayLike | Orbit | None = None, shots: int | None = None) -> Orbit:
        """Find a periodic motion by shooting.

        Parameters
        ----------
        period : in periods of the load; 2 is a 1/2 subharmonic.
        start : (2n,) state at t = 0 or an orbit near it; None tries what a run from rest settles to, then other starts.
        shots : per period; None takes as many as it needs.

        Returns
        -------
        Orbit : state, multipliers, stable, contacts, extremes(z), run.

        Raises
        ------
        ValueError for a period below 1 or loads without a period; solvers.OrbitError with what was tried.
        """
        from fembeam.orbit import orbit

        return orbit(self, period, start, shots)

    def attractors(
        self, omega: float | None = None, starts: int | Sequence[ArrayLike] = 12, longest: int = 8, seed: int = 0
    ) -> list[Attractor]:
        """Settle many starts and name what they come to, the most frequent first.

        Parameters
        ----------
        omega : rad/s of the load; None leaves the scene as it is.
        starts : how many (rest and random states of the size of the motion from rest), or a list of states (2n,).
        longest : periods above this many of the load's count as "not periodic".
        seed : of the random states.

        Returns
        -------
        list of Attractor : orbit (None when not periodic), period, impacts, count, state, name.
        """
        from fembeam.orbit import attractors
        from fembeam.parameters import with_value

        model = self if omega is None else dataclasses.replace(self, scene=with_value(self.scene, "omega", omega))
        return attractors(model, starts, longest, seed)

    def branch(
        self,
        parameter: str = "omega",
        span: tuple[float, float] = (0.0, 0.0),
        period: int = 1,
        start: ArrayLike | Orbit | None = None,
        at: float | None = None,
        **options: Any,
    ) -> Branch:
        """Follow an orbit along one number of the scene, in both directions.

        Parameters
        ----------
        parameter : such as "omega", "amplitude", "gap", "stops[0].law.stiffness"; see `fembeam.parameters`.
        span : (lowest, highest) value.
        period : in periods of the load.
        start : as for `orbit`. at : the parameter's value there; None: the scene's, if it lies in the span.
        options : step (largest, in units of the span), shots, method; see `solvers.branch`.

        Returns
        -------
        Branch : computes as it is iterated over; ``run()`` computes all. Orbits carry a ``mark`` where special.

        Raises
        ------
        ValueError : unknown parameter (lists the valid ones), empty span. solvers.OrbitError : no orbit at the start.
        """
        from fembeam.branch import follow

        return follow(self, parameter, span, period, start, at, options)

    def resume(self, path: str | Path) -> Branch:
        """A branch that `Branch.save` wrote, ready to be gone on with; refused if it belongs to another scene."""
        from fembeam.branch import resumed

        return resumed(self, path)
