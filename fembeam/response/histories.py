"""Histories of a run: motion, section forces, extremes of its beams; stops, elements, impactors, with units."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cached_property
from itertools import compress, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam.response.contact_force import forces
from fembeam.response.contact_log import PlacedLog
from fembeam.response.mean_force import mean_force
from fembeam.response.readout import Readout
from fembeam.response.section_forces import extremes, frame_forces_of, rows_of
from fembeam.scene import loads_of_order, made_key, split, unit_of
from fembeam.structures import COMPONENTS, UP, Six
from fembeam.support import is_whole, numbers, require, require_switch
from solvers.problem import FrictionLog, Losses
from solvers.problem.event_list import NO_EVENTS

if TYPE_CHECKING:
    from fembeam.model import Model
    from fembeam.response.section_forces import Extremes

Vector = NDArray[np.float64]


def directed(z: Any, direction: Any) -> Any:
    """Places with a direction as pairs: of one place a pair, of a list of places or pairs a list."""
    if isinstance(z, list):
        return z if direction is None else [(place, direction) for place in z]
    return z if direction is None else (z, direction)


@dataclass(frozen=True, eq=False)
class Histories:
    """What a run has recorded, and the histories of its beams, contacts and impactors: a `Run` is one."""

    t: Vector
    q: Vector
    q_dot: Vector
    contacts: PlacedLog
    shapes: Any  # Shapes, of a body with places by name PlacedShapes
    stops: Vector  # (m, 3): z (NaN of a place by name), push, gap of every contact
    directions: Vector  # (r, n), rows of contacts: δ = -directions·q - gap; two of a circular clearance: d + centre
    impactor_masses: Vector  # (i,) of the impactors, whose coordinates √m x are the last ones
    make_transitions: Callable[[], Any] = field(repr=False)  # called once, as `transitions` is first read
    make_losses: Callable[[], Losses] = field(repr=False)
    make_friction_log: Callable[[], FrictionLog] | None = field(default=None, repr=False)  # None without friction
    model: Model | None = None
    kept_readout: Mapping[str, Any] = field(default_factory=dict, repr=False)  # of a run read from a file
    others: tuple[Any, ...] = ()  # of the further beams
    memory_at_start: tuple[Vector, ...] = ()  # (m,) what the laws had latched then; () where it was not given
    end: Vector | None = None  # (2n + l,) [q, q̇] and what the laws have latched, at the time reached
    between: NDArray[np.int64] = field(default_factory=lambda: np.zeros((0, 3), dtype=int))  # (m, 3): body, ON, number
    kinds: NDArray[np.bool_] = field(default_factory=lambda: np.zeros((0, 2), dtype=bool))  # of rotation, always acting
    names: tuple[str, ...] = ()  # (m,) what every contact is called
    name_given: tuple[bool, ...] = ()  # (m,) whether the scene gives that name, or it was made
    places: tuple[Any, ...] = ()  # (m,) of each contact z, or (place, direction); both directions of an annular stop
    circles: Vector = field(default_factory=lambda: np.zeros((0, 3)))  # (m, 3): radius, < 0 outer; centre; else zeros
    rubs: Vector = field(default_factory=lambda: np.zeros((0, 4)))  # (m, 4): μ, k_t, R (< 0 outer), Ω; else zeros
    reached: float = 0.0  # s, the time of `end`
    loads_taken: Callable[[Vector], Any] | None = field(default=None, repr=False)  # sampled loads as the run took them
    sampled: bool = True  # else t, q, q_dot are the final state alone, and no history

    @property
    def rotational(self) -> NDArray[np.bool_]:
        """(m,) which contacts are of rotations: rad for m, N m for N."""
        return self.kinds[:, 0]

    @property
    def always_acting(self) -> NDArray[np.bool_]:
        """(m,) which act always, as elements do."""
        return self.kinds[:, 1]

    @cached_property
    def transitions(self) -> Any:
        """Borders that laws with memory passed, see `solvers.problem.Transitions`."""
        return self.make_transitions()

    @cached_property
    def losses(self) -> Losses:
        """Energy that each stop and element dissipated, see `solvers.problem.Losses`."""
        return self.make_losses()

    @cached_property
    def friction_log(self) -> FrictionLog:
        """What friction did in every contact that has it, see `solvers.problem.FrictionLog`.

        Speeds and angles of entry and exit, largest |F_t|, impulse, way of slip, loss; stick and slip between are in
        `transitions`.
        """
        return self.make_friction_log() if self.make_friction_log else FrictionLog.of_events(NO_EVENTS)

    @cached_property
    def friction_loss(self) -> Vector:
        """(k, m) J lost by friction at each stop up to the samples, 0 without; its slope is the work rate of wear.

        Exact at every sample outside of a contact; within one the samples tell how it grows.
        """
        from fembeam.response.friction import losses_by_friction

        return self._at_samples(losses_by_friction(self))

    @cached_property
    def readout(self) -> Readout:
        """Loads, damping, section forces and reactions, from the model or from the file."""
        return Readout(self.model, self.t, self.kept_readout, self.loads_taken)

    def _at_samples(self, values: Vector) -> Vector:
        """Values (k, …) at the samples; ValueError for a run without any, whose q and q̇ are the final state."""
        require(self.sampled, "histories and extremes need output samples", "the final state alone", "Run",
                "give simulate a dt, or dt=[duration] for the end alone")  # fmt: skip
        return values

    def displacement(self, z: Any, direction: Any = None, body: int = 0, absolute: bool = False) -> Vector:
        """u(z, t) of a beam (0 the scene's own), m: (k,) at one z, (k, j) at z (j,).

        Relative to the frame, or ``absolute``: u + y. Of other bodies along a direction, "x", "-y", "rz" or a vector,
        of a place or a list of places: ``displacement("lever", "z")``. The name of a part is the place of that part.
        """
        return self._motion(self.q, z, direction, body, absolute, 0)

    def velocity(self, z: Any, direction: Any = None, body: int = 0, absolute: bool = False) -> Vector:
        """u̇(z, t) relative to the frame, m/s, or ``absolute``: u̇ + ẏ; places and shapes as for `displacement`."""
        return self._motion(self.q_dot, z, direction, body, absolute, 1)

    def acceleration(self, z: Any, direction: Any = None, body: int = 0, absolute: bool = False) -> Vector:
        """ü(z, t) relative to the frame, m/s², or ``absolute``: ü + ÿ; shapes as for `displacement`.

        ü = φ(z)·q'' with q'' of the equations of motion at the samples, the contact forces of the laws included: the
        instant's value, not a mean over the sample. Under a short contact it holds what the kept modes carry of the
        force, Σ φ_i(z) φ_i(z_s) F, and grows with their number.
        """
        return self._motion(modal_accelerations(self), z, direction, body, absolute, 2)

    def motion(self, place: Any, body: int = 0) -> Vector:
        """All components (k, c) of a place, m and rad: those of `shapes.components`; of a beam u and u_z."""
        shapes = self._beam(body)
        place = shapes.place(place)
        if shapes.named:
            return self._q_of(body) @ shapes.motion_with_supports(place).T
        return self._q_of(body) @ np.array([shapes.rows_with_supports(place, i) for i in (0, 1)]).T

    def _motion(self, coordinates: Vector, z: Any, direction: Any, body: int, absolute: bool, order: int) -> Vector:
        """u, u̇ or ü at z (k,) or (k, j) from q, q̇ or q'' (k, n), with that of the frame's motion if absolute."""
        if is_whole(direction):  # (z, body, absolute) by position, as where places are numbers
            direction, body, absolute = None, direction, absolute or body is True
        require_switch("absolute", absolute, "Run")
        shapes = self._beam(body)
        at = shapes.place(z)
        if shapes.named:
            at = directed(at, direction)
            rows = shapes.rows_with_supports(at if isinstance(at, list) else [at])
            rows = rows if isinstance(at, list) else rows[0]
        else:
            require(direction in (None, "y"), "a Beam moves along y", direction, "Run", "leave the direction out")
            rows = shapes.rows_with_supports(at)
        values = self.with_supports(coordinates, shapes.moving, order) @ rows.T
        if not absolute:
            return values
        if not shapes.named:
            return (values.T + frame_motion(self, order)).T
        ways = [split(one, shapes.components)[1] for one in (at if isinstance(at, list) else [at])]
        moved = np.array([frame_motion(self, order, way) for way in ways]).T
        return values + (moved if isinstance(at, list) else moved[:, 0])

    def with_supports(self, coordinates: Vector, moving: int, order: int = 0) -> Vector:
        """q, q̇ or q'' (k, n) by ``order``, then the same derivative of each support dof that moves."""
        values = self._at_samples(coordinates)
        return np.hstack([values, self.readout.loads[loads_of_order(order, moving)].T]) if moving else values

    def slope(self, z: ArrayLike, body: int = 0) -> Vector:
        """u_z(z, t), rad."""
        return self._field("slope", z, body)

    def moment(self, z: ArrayLike, body: int = 0) -> Vector:
        """Bending moment EI u_zz, N m: positive where it stretches the lower fibre. Of a frame M of `section_forces`.

        At a point moment, a mass with inertia or a hinge spring that of the side ahead, as of `stress` where sections
        change; `extremes` looks at both. Of the kept coordinates: exact for slow point loads with ``residual=True``.
        What n modes miss of weight and base motion is about 0.13/n² of the moment and 0.4/n of the shear at a clamp, of
        a point force without residual 1/n of the moment and, next to it, all of the shear. (`reactions` miss nothing of
        slow loads.)
        """
        return self._field("moment", z, body)

    def shear(self, z: ArrayLike, body: int = 0) -> Vector:
        """Shear force dM/dz, N; at a point load that of the side ahead; of a frame Q. Accuracy: see `moment`."""
        return self._field("shear", z, body)

    def stress(self, z: ArrayLike, body: int = 0) -> Vector:
        """Stress at the lower outer fibre, N/m²: M c/I + N/A. ValueError where a section has no `fibre`."""
        return self._field("stress", z, body)

    def section_forces(self, place: Any, body: int = 0) -> dict[str, Vector]:
        """All section forces (k,) at a place on a member of a frame, such as ("A-B", 0.4), by name.

        N in N (tension, the given axial force included); Q in N and M in N m of bending along `up` of the member, M
        positive where it stretches the lower fibre, Q = M' but for rotary inertia; Q2 and M2 of bending across; T in
        N m. In the plane N, Q and M. At a point load those of the side ahead. Accuracy: see `moment`.
        """
        place = self._beam(body).place(place)
        forces = frame_forces_of(self, body)
        values = self._q_of(body) @ forces.rows(place).T
        return {name: values[:, i] + forces.preload(place, name) for i, name in enumerate(forces.names_at(place))}

    def extremes(self, quantity: str = "displacement", z: ArrayLike | None = None, body: int = 0) -> Extremes:
        """Least and greatest values over the samples, place by place, with their times.

        Section forces and stress jump at point loads and moments and where sections change: those of both sides count.

        Parameters
        ----------
        quantity : "displacement", "slope", "moment", "shear" or "stress"; of a frame also those of `section_forces`.
        z : places (j,) in m; None: all nodes of the mesh. Of other bodies a list of (place, direction) for
            displacement, of (member, distance) for section forces.
        """
        if z is None and quantity != "displacement" and self._beam(body).named:
            z = self._sections(body)
        at = self._places(z, body)
        require(len(at) > 0, "z must not be empty", z, "Run.extremes", "leave it out for all of the body")
        q = self._q_of(body)
        found = extremes(self.t, q, at, *rows_of(self, quantity, at, body))
        if quantity in ("displacement", "slope"):
            return found
        return found.with_others(extremes(self.t, q, at, *rows_of(self, quantity, at, body, behind=True)))

    def _q_of(self, body: int) -> Vector:
        """Coordinates at the samples, with the support dofs that move."""
        return self.with_supports(self.q, self._beam(body).moving)

    def _places(self, z: Any, body: int = 0) -> Any:
        """Places (j,) of a beam in m, None all its nodes; of another body a list, None the usual ones."""
        shapes = self._beam(body)
        at = shapes.place(z)
        if shapes.named:
            at = list(shapes.usual.values()) if at is None else at
            return [at] if isinstance(at, tuple) else list(at)
        return shapes.nodes if at is None else np.atleast_1d(numbers("z", at, "Run", "give m along the beam"))

    def _sections(self, body: int) -> list[Any]:
        """All nodes of the mesh of a frame, as (member, distance)."""
        return frame_forces_of(self, body).sections()

    def _beam(self, body: int) -> Any:
        """A beam's shapes; ValueError unless there is one of that number."""
        beams = (self.shapes, *self.others)
        known = is_whole(body) and 0 <= body < len(beams)
        require(known, f"body must be below {len(beams)}, the number of beams", body, "Run", "0 is the scene's own")
        return beams[body]

    def _field(self, quantity: str, z: ArrayLike, body: int) -> Vector:
        """A field over time: (k,) at one z, (k, j) at z (j,)."""
        z = self._beam(body).place(z)
        if self._beam(body).named:
            shapes, offset = rows_of(self, quantity, z if isinstance(z, list) else [z], body)
            along = self._q_of(body) @ shapes.T + offset
            return along if isinstance(z, list) else along[:, 0]
        places = numbers("z", z, "Run", "give m along the beam")
        shapes, offset = rows_of(self, quantity, np.atleast_1d(places), body)
        values = self._q_of(body) @ shapes.T + offset
        return values if places.ndim else values[:, 0]

    def impactor_displacement(self, impactor: int | str = 0) -> Vector:
        """x(t) (k,) of an impactor, by number or name, from its place at the start, relative to the frame, m.

        Positive up, of frames and structures along its direction. ``displacement("ball")`` is that of the place below
        it instead.
        """
        return self._of_impactor(self.q, impactor)

    def impactor_velocity(self, impactor: int | str = 0) -> Vector:
        """ẋ(t) (k,) of an impactor relative to the frame, m/s; as for `impactor_displacement`."""
        return self._of_impactor(self.q_dot, impactor)

    def _of_impactor(self, coordinates: Vector, impactor: int | str) -> Vector:
        """One of the last columns, without its √m."""
        count = len(self.impactor_masses)
        first = coordinates.shape[1] - count
        number = self._impactor_of(impactor, first) if isinstance(impactor, str) else impactor
        right = is_whole(number) and 0 <= number < count
        require(right, f"impactor must be below {count}, the number of impactors, or the name of one", impactor, "Run",
                "count from 0, or see run.names")  # fmt: skip
        return self._at_samples(coordinates)[:, first + number] / np.sqrt(self.impactor_masses[number])

    def _impactor_of(self, name: str, first: int) -> int:
        """The number of the impactor called so, on both sides too, -1 for none; their coordinates begin at `first`."""
        mine = [i for i, own in enumerate(self.names) if own in (name, f"{name}, below")]
        rows = [self.directions[self._rows[i].start, first:] for i in mine]
        return next((int(np.argmax(np.abs(row))) for row in rows if row.any()), -1)

    def unit(self, quantity: str, stop: int | str | None = None) -> str:
        """Unit of "indentation", "speed", "force" or "impulse" of a stop; None: of a column that all of them share."""
        return unit_of(quantity, self.rotational if stop is None else self.rotational[[self._stop(stop)]])

    def name(self, stop: int) -> str:
        """What tables call a stop or element: its given name, else a made one such as "stop at 3 m, below"."""
        return self.names[self._stop(stop)]

    def key(self, stop: int) -> str:
        """What files call a stop or element, which other places and gaps leave as it is.

        The given name, else "stop 0", "element 2 (rotation)", with "(2)" behind it where another one is called so.
        """
        stop = self._stop(stop) % len(self.stops)
        if self.name_given[stop]:
            return self.names[stop]
        made = made_key(stop, bool(self.always_acting[stop]), bool(self.rotational[stop]))
        return made + " (2)" * (made in compress(self.names, self.name_given))

    def number(self, stop: int | str) -> int:
        """The number of a stop or element, from 0, that is given by its name or number; ValueError if there is none."""
        return self._stop(stop) % len(self.stops)

    def indentation(self, stop: int | str = 0) -> Vector:
        """δ(t) (k,) of a stop, m or rad; negative while it is open. Elements, then impactors, count on after the stops.

        Of an element its deformation d(t), of an annular stop r - c, or c - r of an outer one. ``stop`` may be a name:
        ``run.indentation("valve")``.
        """
        return self._at_samples(self._deformation(self._stop(stop)))

    def _deformation(self, stop: int) -> Vector:
        """δ (k,) of a stop, one value without samples: of the last state."""
        if radius := self.circles[stop, 0]:
            return np.asarray(np.sign(radius) * np.linalg.norm(self._in_circle(stop), axis=1) - radius)
        return -self.q @ self.directions[self._rows[stop].start] - self.stops[stop, 2]

    def indentation_rate(self, stop: int | str = 0) -> Vector:
        """δ̇(t) (k,) of a stop or element, m/s or rad/s: of both bodies where the stop moves."""
        return self._at_samples(self._deformation_rate(self._stop(stop)))

    def _deformation_rate(self, stop: int) -> Vector:
        """δ̇ (k,) of a stop, likewise."""
        if self.circles[stop, 0]:
            rates = self.q_dot @ self.directions[self._rows[stop]][:2].T
            return np.asarray(np.sum(self._outward(stop) * rates, axis=1))
        return -self.q_dot @ self.directions[self._rows[stop].start]

    def place_in_clearance(self, stop: int | str = 0) -> Vector:
        """d(t) (k, 2) of an annular stop, m: the place from the centre of its circle, along both directions."""
        number = self._stop(stop)
        require(self.circles[number, 0] != 0.0, "the stop must be an annular one", stop, "Run",
                "ask for its indentation")  # fmt: skip
        return self._at_samples(self._in_circle(number))

    def friction(self, stop: int | str = 0) -> Vector:
        """F_t(t) (k,) of a stop with friction, N: the force on its place against ξ, positive where ξ̇ > 0 in slip.

        ξ goes along the tangent of a stop; in a circular clearance it is c θ + R (φ + Ω t), with the torque -R F_t on
        the place. ValueError for a stop without friction.
        """
        from fembeam.response import read_back

        return self._at_samples(read_back(self, self._rubbing(stop)))

    def sliding_speed(self, stop: int | str = 0) -> Vector:
        """ξ̇(t) (k,) of a stop with friction, m/s, whether it is open or in contact; ValueError for another stop."""
        from fembeam.response import sliding

        return self._at_samples(sliding(self, self._rubbing(stop))[1])

    def _rubbing(self, stop: int | str) -> int:
        """The number of a stop that has friction, checked."""
        number = self._stop(stop) % len(self.stops)
        require(self.rubs[number, 1] > 0.0, "the stop must have friction", stop, "Run", "give it a Friction")
        return number

    @cached_property
    def _rows(self) -> list[slice]:
        """Which rows of `directions` are those of each contact: two of a circular clearance, with friction one more."""
        circle, rubs = self.circles[:, 0] != 0.0, self.rubs[:, 1] != 0.0
        ends = np.cumsum([0, *(1 + circle + (rubs & (~circle | (self.rubs[:, 2] != 0.0))))]).tolist()
        return [slice(a, b) for a, b in pairwise(ends)]

    def _in_circle(self, stop: int) -> Vector:
        """D (k, 2) of a circular clearance."""
        return np.asarray(self.q @ self.directions[self._rows[stop]][:2].T - self.circles[stop, 1:])

    def _outward(self, stop: int) -> Vector:
        """Unit vectors (k, 2) along which δ of a circular clearance grows: ± d/r; zeros at the centre."""
        d = self._in_circle(stop)
        r = np.linalg.norm(d, axis=1)[:, None]
        return np.asarray(np.sign(self.circles[stop, 0]) * d / np.where(r > 0.0, r, 1.0))

    def force(self, stop: int | str = 0, mean: bool = False) -> Vector:
        """Contact force (k,) of a stop, N or N m, from its law and the entry rate latched at the time; of an element F.

        ``stop``: its number, or its name as in ``run.force("valve")``. Of an annular stop (k, 2), its components on the
        place along both directions, of a stop with friction N and the force on the place along its tangent; with
        ``mean`` the size N (k,). `friction` gives F_t.

        ``mean``: over each sample (halfway to its neighbours) instead of at it, so that contacts shorter than a sample
        are seen: the trapezoidal rule over the samples gives impulses as exactly as the run has them, those of the log
        to the last sample and, from sample to sample, of what always acts. Between two samples the law is evaluated on
        a cubic to divide the impulse at their middle. ValueError for a run without samples.
        """
        require_switch("mean", mean, "Run.force")
        if mean:
            return mean_force(self, self._stop(stop))
        number = self._stop(stop)
        forces = self._forces[self._rows[number]][:2]
        return self._at_samples(forces.T if len(forces) > 1 else forces[0])

    @cached_property
    def _forces(self) -> Vector:
        """Forces (r, k) on all rows of contacts."""
        return forces(self) if self.readout.forces is None else self.readout.forces

    def _normal_force(self, stop: int) -> Vector:
        """Contact force (k,) along which δ shrinks: of any stop, N of a circular clearance."""
        forces = self._forces[self._rows[stop]]
        return -np.sum(self._outward(stop).T * forces[:2], axis=0) if self.circles[stop, 0] else forces[0]

    def _stop(self, stop: int | str) -> int:
        """The number of a contact, checked, of one called by its name too."""
        if isinstance(stop, str):
            near = get_close_matches(stop, self.names, 1, 0.0)
            require(stop in self.names, "no contact has this name", stop, "Run", f"the nearest is {near[0]!r}"
                    if near else "there is none at all")  # fmt: skip
            return self.names.index(stop)
        count = len(self.stops)
        right = is_whole(stop) and -count <= stop < count
        require(right, f"stop must be below {count}, the number of stops", stop, "Run",
                "count from 0")  # fmt: skip
        return int(stop)


def modal_accelerations(run: Histories) -> Vector:
    """Modal accelerations q'' (k, n) at the samples, m √kg/s², with the contact forces of the laws there.

    Not from differences of the samples: contacts shorter than a sample would be lost, and digits with them.
    """
    read = run.readout
    driven = run._forces.T @ run.directions + read.loads.T @ read.load_vectors
    return np.asarray(driven - run.q_dot @ read.damping.T - run.q @ read.stiffness.T)


def frame_motion(run: Histories, order: int = 0, along: Six = UP) -> Vector:
    """The frame's displacement y (k,) at the samples, or a derivative up to the second; zeros for a frame at rest.

    ``along`` a direction: Σ n_i y_i.
    """
    base, found = run.readout.base, np.zeros(len(run.t))
    if base is None:
        return found
    for number, direction in enumerate(run.readout.moved):
        part = along[COMPONENTS.index(direction)]
        motion = run.readout.loads[base + number] if order == 2 else run.readout.frame[2 * number + order]
        found = found + part * np.array(motion) if part else found
    return found
