"""What a simulation gives: histories at any place, forces, contact log, energy balance; saved whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

import solvers
from fembeam.model.shapes import Shapes
from fembeam.scene import Source, unit_of
from fembeam.support import Part, Printed, require
from solvers.problem import counted

if TYPE_CHECKING:
    from fembeam.model.model import Model
    from fembeam.model.section_forces import Extremes
    from fembeam.response import Reactions
    from fembeam.scene_file import SceneFile

Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Run(Printed):
    """A simulated motion of a reduced model.

    Attributes
    ----------
    t, q, q_dot : (k,) s, (k, n) and (k, n) modal coordinates and rates.
    contacts : log of contacts: stop, t_in, t_out, speed_in, speed_out, peak_indentation, peak_force, impulse,
        energy_loss, entry_rate_clipped (arrays).
    energy : energy balance at t: input, damping, contact, stored, residual in J; made by ``ledger`` when first read.
    status : how it ended, a sentence.
    cost : steps, rejections, law_calls, events, seconds.
    """

    t: Vector
    q: Vector
    q_dot: Vector
    contacts: solvers.ContactLog
    ledger: Callable[[], solvers.Energy] = field(repr=False)
    status: str
    cost: solvers.Cost
    shapes: Shapes
    stops: Vector  # (m, 3): z, push, gap of every contact
    directions: Vector  # (m, n): δ = -directions·q - gap
    strikers: Vector  # (i,): masses of the impactors, whose coordinates √m x are the last ones
    scene: str
    model: Model | None = None
    stored_forces: Vector | None = None  # (m, k) of a run read from a file
    others: tuple[Shapes, ...] = ()  # of the further beams
    source: Source | None = None  # of a run made from a scene file
    versions: dict[str, str] = field(default_factory=dict)  # that made a run read from a file
    borders: Callable[[], Any] | None = field(default=None, repr=False)  # what `transitions` are made by
    kinds: Vector = field(default_factory=lambda: np.zeros((0, 2), dtype=bool))  # (m, 2): of rotation, always acting

    def __repr__(self) -> str:
        reached = f"to t = {self.t[-1]:g} s" if len(self.t) else "without samples"
        return f"<run {reached}, {counted(len(self.contacts), 'contact')}: {self.status}>"

    def _parts(self) -> list[Part]:
        from fembeam.model.run_csv import parts

        return parts(self)

    @cached_property
    def energy(self) -> solvers.Energy:
        """The energy balance."""
        return self.ledger()

    @cached_property
    def transitions(self) -> Any:
        """Borders that laws with memory passed, see `solvers.problem.Transitions`: times of stick, slip and yield.

        ValueError for a run read from a file.
        """
        if self.borders is None:
            raise ValueError("a run read from a file has no transitions; simulate again")
        return self.borders()

    @property
    def scene_file(self) -> SceneFile:
        """The scene, reduction and studies this run was made from; ValueError for a run made in Python."""
        from fembeam.scene_file import built

        if self.source is None:
            raise ValueError("this run was made in Python, not from a scene file; its scene is the text run.scene")
        return built(self.source)

    @classmethod
    def of(cls, model: Model, solution: solvers.Solution) -> Run:
        """A model's solution with what it takes to read it."""
        stops = np.array(
            [(contact.z, contact.push, contact.gap) for contact in model.contact_rows], dtype=float
        ).reshape(-1, 3)
        strikers = np.array([impactor.mass for impactor in model.matrices.impactors], dtype=float)
        status = solution.status.value
        if not solution.status.good:
            status += f" (t = {solution.t[-1]:g} s)" if len(solution.t) else " (before the first sample)"
        return cls(
            *(solution.t, solution.q, solution.q_dot, solution.contacts, solution.ledger, status, solution.cost),
            *(model.shapes, stops, model.directions, strikers, repr(model.scene), model),
            others=model.others,
            borders=solution.borders,
            kinds=np.array([(one.rotation, one.always) for one in model.contact_rows], dtype=bool).reshape(-1, 2),
        )

    @property
    def complete(self) -> bool:
        """Whether the run reached its end."""
        return self.status == solvers.Status.DONE.value

    def displacement(self, z: ArrayLike, body: int = 0, absolute: bool = False) -> Vector:
        """u(z, t) of a beam (0 the scene's own), m: (k,) at one z, (k, j) at z (j,).

        Relative to the frame, or ``absolute``: u + y. That needs the model, which a run read from a file has not.
        """
        return self._motion(self.q, z, body, absolute, 0)

    def velocity(self, z: ArrayLike, body: int = 0, absolute: bool = False) -> Vector:
        """u̇(z, t) relative to the frame, m/s, or ``absolute``: u̇ + ẏ; shapes as for `displacement`."""
        return self._motion(self.q_dot, z, body, absolute, 1)

    def acceleration(self, z: ArrayLike, body: int = 0, absolute: bool = False) -> Vector:
        """ü(z, t) relative to the frame, m/s², or ``absolute``: ü + ÿ; shapes as for `displacement`.

        ü = φ(z)·q'' with q'' of the equations of motion at the samples, the contact forces of the laws included: the
        instant's value, not a mean over the sample. Under a short contact it holds what the kept modes carry of the
        force, Σ φ_i(z) φ_i(z_s) F, and grows with their number. ValueError for a run read from a file.
        """
        from fembeam.response import coordinates

        return self._motion(coordinates(self), z, body, absolute, 2)

    def _motion(self, rates: Vector, z: ArrayLike, body: int, absolute: bool, order: int) -> Vector:
        """A derivative of u at z (k,) or (k, j), with that of the frame's motion if absolute."""
        from fembeam.response import frame_motion

        values = rates @ (self.shapes, *self.others)[body](z).T
        return (values.T + frame_motion(self, order)).T if absolute else values

    def reactions(self) -> Reactions:
        """Forces (N) and moments (N m) of supports, springs and dashpots on the beams, at the samples.

        They balance loads, contact forces and the inertia of the kept modes on the finite-element model; modes left
        out follow statically, structural damping counts as internal. A contact shorter than the period of the highest
        mode kept acts at once: keep more modes until the extremes settle. ValueError for a run read from a file.

        Returns
        -------
        Reactions : of each beam supports, then springs; then dashpots. ``[i].force``, ``[i].moment`` (k,),
            ``[i].extremes("force")``. (Stops: `force`.)

        References
        ----------
        R.R. Craig, A.J. Kurdila, Fundamentals of Structural Dynamics (2006), 11.4: mode-acceleration method.
        """
        from fembeam.response import reactions

        return reactions(self)

    def floor_spectrum(self, z: float, omega: ArrayLike | None = None, zeta: ArrayLike = 0.05, **options: Any) -> Any:
        """`fembeam.response_spectrum` of the absolute acceleration at z: what equipment there has to stand.

        omega or ``periods=``, zeta : as there; ``body=`` another beam. Warns where samples do not resolve contacts.
        """
        from fembeam.response import floor_spectrum

        return floor_spectrum(self, z, omega, zeta, **options)

    def slope(self, z: ArrayLike, body: int = 0) -> Vector:
        """u_z(z, t), rad."""
        return self._field("slope", z, body)

    def moment(self, z: ArrayLike, body: int = 0) -> Vector:
        """Bending moment EI u_zz, N m: positive where it stretches the lower fibre."""
        return self._field("moment", z, body)

    def shear(self, z: ArrayLike, body: int = 0) -> Vector:
        """Shear force dM/dz, N; at a point load that of the side ahead."""
        return self._field("shear", z, body)

    def stress(self, z: ArrayLike, body: int = 0) -> Vector:
        """Stress at the lower outer fibre, N/m²: M c/I + N/A. ValueError where a section has no `fibre`."""
        return self._field("stress", z, body)

    def extremes(self, quantity: str = "displacement", z: ArrayLike | None = None, body: int = 0) -> Extremes:
        """Least and greatest values over the samples, place by place, with their times.

        Parameters
        ----------
        quantity : "displacement", "slope", "moment", "shear" or "stress".
        z : places (j,) in m; None: all nodes of the mesh.
        """
        from fembeam.model.section_forces import extremes, rows_of

        places = (self.shapes, *self.others)[body].nodes if z is None else np.atleast_1d(np.asarray(z, dtype=float))
        return extremes(self.t, self.q, *rows_of(self, quantity, places, body))

    def _field(self, quantity: str, z: ArrayLike, body: int) -> Vector:
        """A field over time: (k,) at one z, (k, j) at z (j,)."""
        from fembeam.model.section_forces import rows_of

        places = np.asarray(z, dtype=float)
        shapes, _, offset = rows_of(self, quantity, np.atleast_1d(places), body)
        values = self.q @ shapes.T + offset
        return values if places.ndim else values[:, 0]

    def to_xdmf(self, path: str | os.PathLike[str], stride: int = 1) -> Path:
        """Write every `stride`-th sample for ParaView: displacement, velocity, slope, moment, shear, stress."""
        from fembeam.model.run_paraview import to_xdmf

        return to_xdmf(self, path, stride)

    def to_vtu(self, path: str | os.PathLike[str], sample: int = -1) -> Path:
        """Write one sample for ParaView."""
        from fembeam.model.run_paraview import to_vtu

        return to_vtu(self, path, sample)

    def to_csv(self, folder: str | os.PathLike[str], stride: int = 1) -> list[Path]:
        """Write every `stride`-th sample at the usual places as `histories.csv`, and the log as `contacts.csv`."""
        from fembeam.model.run_csv import write

        return write(self, Path(folder), stride)

    def to_dataframe(self, stride: int = 1) -> Any:
        """Every `stride`-th sample at the usual places as a table of pandas over t; ImportError without pandas."""
        from fembeam.model.run_csv import to_dataframe

        return to_dataframe(self, stride)

    def to_xarray(self, z: ArrayLike | None = None) -> Any:
        """Displacement and velocity over t and z (m; None: the mesh), stops and coordinates as a Dataset of xarray.

        SI units in the attributes. ImportError without xarray.
        """
        from fembeam.model.run_csv import to_xarray

        return to_xarray(self, z)

    def impactor_displacement(self, impactor: int = 0) -> Vector:
        """x(t) (k,) of an impactor from its place at the start, relative to the frame, m."""
        return self._striker(self.q, impactor)

    def impactor_velocity(self, impactor: int = 0) -> Vector:
        """ẋ(t) (k,) of an impactor relative to the frame, m/s."""
        return self._striker(self.q_dot, impactor)

    def _striker(self, coordinates: Vector, impactor: int) -> Vector:
        """One of the last columns, without its √m."""
        count = len(self.strikers)
        require(0 <= impactor < count, f"impactor must be below {count}, the number of impactors", impactor, "Run",
                "count from 0")  # fmt: skip
        return coordinates[:, coordinates.shape[1] - count + impactor] / np.sqrt(self.strikers[impactor])

    def unit(self, quantity: str, stop: int | None = None) -> str:
        """Unit of "indentation", "speed", "force" or "impulse" of a stop; None: of a column that all of them share."""
        return unit_of(quantity, self.kinds[:, 0] if stop is None else self.kinds[[self._stop(stop)], 0])

    def name(self, stop: int) -> str:
        """What tables call a stop or element: "stop 0", "element 1", "stop 2 (rotation)"."""
        rotation, always = self.kinds[self._stop(stop)]
        return f"{'element' if always else 'stop'} {stop}" + " (rotation)" * bool(rotation)

    def indentation(self, stop: int = 0) -> Vector:
        """δ(t) (k,) of a stop, m or rad; negative while it is open. Elements, then impactors, count on after the stops.

        Of an element its deformation d(t).
        """
        return -self.q @ self.directions[self._stop(stop)] - self.stops[stop, 2]

    def indentation_rate(self, stop: int = 0) -> Vector:
        """δ̇(t) (k,) of a stop or element, m/s or rad/s: of both bodies where the stop moves."""
        return -self.q_dot @ self.directions[self._stop(stop)]

    def force(self, stop: int = 0, mean: bool = False) -> Vector:
        """Contact force (k,) of a stop, N or N m, from its law and the entry rate latched at the time; of an element F.

        ``mean``: over each sample (halfway to its neighbours) instead of at it, so that contacts shorter than a sample
        are seen: the trapezoidal rule over the samples gives the log's impulses exactly.
        """
        if mean:
            from fembeam.response import mean_force

            return mean_force(self, self._stop(stop))
        return self._forces[self._stop(stop)]

    def _stop(self, stop: int) -> int:
        """The number of a contact, checked."""
        count = len(self.stops)
        require(-count <= stop < count, f"stop must be below {count}, the number of stops", stop, "Run",
                "count from 0")  # fmt: skip
        return stop

    @cached_property
    def _forces(self) -> Vector:
        """Forces (m, k)."""
        if self.stored_forces is not None:
            return self.stored_forces
        from fembeam.response import contact_force

        assert self.model is not None
        forces = [contact_force(self, s, contact) for s, contact in enumerate(self.model.contact_rows)]
        return np.array(forces).reshape(len(forces), len(self.t))

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write everything to one ``.npz`` file, whole or not at all; read it with `load`."""
        from fembeam.model.run_file import save

        return save(self, Path(path))
