"""The scene: a beam, what holds it, what hangs on it, what it may hit, and what drives it; further bodies beside it.

SI units; z along the beam, u its displacement relative to the frame, positive up. Everything is checked when
it is made, before anything is computed: positions, signs, conflicts.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, is_dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np

from fembeam.beams import Beam, ModalDamping, Rayleigh
from fembeam.scene.annular_stop import AnnularStop, directed_stops
from fembeam.scene.assembly import Matrices, assemble, buckling_load
from fembeam.scene.body_checks import check_conflicts, check_end, check_ends, check_feature, check_plain, is_body
from fembeam.scene.element import Element
from fembeam.scene.impactor import Impactor
from fembeam.scene.joined_scene import merged
from fembeam.scene.local_coordinate import LocalCoordinate
from fembeam.scene.part_places import at_parts, names_of, part_places, placed_parts, require_number
from fembeam.scene.parts import Dashpot, LumpedMass, PointForce, PointMoment, Spring, Stop, Support
from fembeam.scene.rigid_motions import drifting, rigid_body_modes
from fembeam.scene.rotors import Disk, Unbalance, driven
from fembeam.scene.signal_checks import require_motion
from fembeam.scene.signals import support_motion
from fembeam.structures import COMPONENTS, Joint, translations_of
from fembeam.support import (
    in_mm,
    is_finite,
    native,
    require,
    require_finite,
    require_non_negative,
    require_positive,
    warn,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike

    from fembeam.inspection import Check
    from fembeam.model import Model
    from fembeam.study import Campbell


FEATURES: dict[str, tuple[type, ...]] = {
    "supports": get_args(Support),
    "masses": (LumpedMass, Disk),
    "springs": (Spring,),
    "dashpots": (Dashpot,),
    "stops": (Stop, AnnularStop),
    "elements": (Element,),
    "forces": (PointForce, PointMoment, Unbalance),
    "impactors": (Impactor,),
}


@dataclass(frozen=True)
class Scene:
    """A beam with supports, masses, springs, dashpots, stops, damping, base motion and forces.

    M ü + C u̇ + K u = -M r (ÿ + g) + Σ b f(t) + Σ w F(δ, δ̇)

    Parameters
    ----------
    beam : Beam, or another body: a `Structure` by its matrices. Places are then names, and parts have a `direction`.
    supports : of Clamped, Pinned, Guided, Fixed; at most one per place. None at all is allowed (free body).
    masses, springs, dashpots, stops, forces : lists, any length; kept as tuples.
    damping : ModalDamping or Rayleigh, of the structure without dashpots.
    base : frame motion y(t) that knows its derivatives, `derivative(order)`, or None; of other bodies one for each
        direction, {"x": signal, "z": signal}.
    impactors : rigid masses beside the beam. Their contacts are numbered after those of the stops and elements.
    bodies : further beams, each a Scene of its own with its supports, stops, forces, damping; a `Stop` with `on`, or an
        `Element` with `to`, lets the beam of this scene meet them. Their contacts are numbered after those of this
        scene.
    joints : of `Joint`, between frames and structures, this scene's own body being number 0, the first of `bodies`
        number 1. Joined bodies become one, `JoinedBodies`, with one M and K, modes of the whole and all their parts:
        the scene has no `bodies` then but those without joints, and a place of a joined one is (1, "lever"), or
        "lever" where no other has that name.
    gravity : g in m/s², pulls everything down, along -y; for all bodies. Of frames and structures also a vector, the
        acceleration of free fall, (0, 0, -9.81), in the plane (0, -9.81).
    elements : of Element, local elements that always act, numbered on after the stops.

    Every part takes a keyword ``name``, unique among all parts, those of bodies included: logs, tables, figures and
    messages use it. Without one a name is made, such as "stop at 3 m, below".

    Raises
    ------
    ValueError : anything outside the beam, not finite, or in conflict; the message names it.
    TypeError : something of the wrong kind in a list, a base motion without derivatives.

    Warns
    -----
    UserWarning : the supports and springs of a beam leave rigid-body modes (says how many), and loads may carry it
        away: they act, and no stops on both sides, or below it under gravity, hold it. A free beam without loads, a
        hinged one that lies on a stop are meant so. Also what a `Record` as base motion says of itself.

    Examples
    --------
    >>> from fembeam import Clamped, LumpedMass, Section
    >>> steel = Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)
    >>> scene = Scene(Beam(0.2599, steel), [Clamped(0.0)], [LumpedMass(0.24445, 25.4e-3, inertia=3.0e-6)])
    >>> scene.matrices(modes=3).elements
    44
    """

    beam: Any
    supports: Sequence[Support] = ()
    masses: Sequence[LumpedMass | Disk] = ()
    springs: Sequence[Spring] = ()
    dashpots: Sequence[Dashpot] = ()
    stops: Sequence[Stop | AnnularStop] = ()
    damping: ModalDamping | Rayleigh = ModalDamping(0.0)  # noqa: RUF009 (frozen)
    base: Any = None
    forces: Sequence[PointForce | PointMoment | Unbalance] = ()
    impactors: Sequence[Impactor] = ()
    bodies: Sequence[Scene] = ()
    gravity: float | Sequence[float] = 0.0
    elements: Sequence[Element] = ()
    joints: Sequence[Joint] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.beam, Beam) and not is_body(self.beam):
            raise TypeError(f"beam must be a Beam, got {self.beam!r} in Scene; make one: Beam(length, section)")
        for name, kinds in {**FEATURES, "bodies": (Scene,), "joints": (Joint,)}.items():
            object.__setattr__(self, name, _listed(name, getattr(self, name), kinds))
        self._check_bodies()
        for name, parts in placed_parts(self, list(FEATURES)):
            object.__setattr__(self, name, parts)
        if self.joints:  # one body with all parts, in the place of this scene's own
            for name, value in merged(self, [*FEATURES]).items():
                object.__setattr__(self, name, value)
        for name in FEATURES:
            if name == "forces":
                object.__setattr__(self, name, driven(self.beam, tuple(self.forces)))
            if name == "stops" and self.named:
                object.__setattr__(self, name, directed_stops(self.beam, tuple(self.stops)))
            self._check_places(name)
        if not callable(getattr(self.damping, "modal_coefficients", None)):
            raise TypeError(f"damping must be ModalDamping or Rayleigh, got {self.damping!r} in Scene; "
                            "write ModalDamping(0.01)")  # fmt: skip
        if self.named and not self._ways_to_fall and all(part.named for part in self.bodies):
            given = self.gravity
            pulls = any(given) if isinstance(given, (list, tuple)) else is_finite(given) and given != 0.0
            require(not pulls, "gravity needs a body that moves along x, y or z, joined ones all along the same",
                    self.gravity, "Scene", "give the structure more dofs, or leave it out")  # fmt: skip
        object.__setattr__(self, "gravity", _fall(native(self.gravity), self._ways_to_fall))
        self._check_base()
        self._check_gravity()
        self._check_names()
        if self.named:
            check_conflicts(self)
            check_ends(self)
        else:
            self._check_conflicts()
            self._check_places_of_acting()
        for said in self.doubts:
            warn(said)

    def matrices(self, elements: int | None = None, modes: int | None = None, probes: Sequence[float] = ()) -> Matrices:
        """Sparse M, C, K on the free dofs of a Hermite mesh with a node on every feature and probe.

        Parameters
        ----------
        elements :
            Number of elements (more if the features need them); None: as few as make each of the lowest
            `modes` frequencies right to 1e-6 relative, by the local wavelength: (β h)⁴/1440 ≤ 0.65e-6.
        modes :
            How many modes will be kept; None: 10. With `elements` it is only checked against the dofs.
        probes :
            Further coordinates that shall be nodes. (A feature or probe closer than 1e-4 of the length, under
            compression 4e-3, to another one is interpolated inside its element instead, for rounding.)

        Returns
        -------
        Matrices : its `accuracy` says what the mesh promises.

        Raises
        ------
        ValueError : elements or modes not a positive integer, more modes than dofs, more than 300 modes or 10 000
            elements, a probe outside the beam.
        """
        return assemble(self, elements, modes, probes)

    def reduce(
        self,
        modes: int | Sequence[int] | Literal["all"] | None = None,
        elements: int | None = None,
        omega_max: float | None = None,
        mass_share: float | None = None,
        residual: bool = False,
        interface: bool = False,
    ) -> Model:
        """The scene in few coordinates: its lowest modes, with or without static shapes of stops and forces.

        Parameters
        ----------
        modes : a count, mode numbers from 0 such as [0, 2, 5], or "all" of a mesh of given `elements`; None: 2. The
            same of every body, but a body with fewer dofs keeps all its modes, of a list those that it has; impactors
            are kept as they are.
        elements : of the mesh; None: as few as make every kept frequency right to 1e-6.
        omega_max : instead of `modes`: all of them up to this frequency, rad/s.
        mass_share : instead of `modes`: as many as carry this share of the mass that a base motion moves, in (0, 1].
            Of several bodies the one that needs most says how many, of omega_max too.
        residual : add the residual static shape of every stop, element, force, moment, moving foot and dashpot (its
            rotation, too), of friction at a radius the twist, between two places that of opposite loads; the model is
            then exact for slow loads there.
        interface : Craig–Bampton: static shapes of the same places and `modes` modes with them held; with
            modes=0 Guyan's condensation.

        Returns
        -------
        Model : mass-normalised modes, positive at the first stop (else where they move most).

        Raises
        ------
        ValueError : no modes, repeated or negative numbers, more than any body has; more than 300 of a mesh above 2000
            dofs, or more than 128 for omega_max or mass_share; two ways of choosing at once; static shapes
            without a stop, force or dashpot.
        reduction.AccuracyError : stiffnesses too far apart, or a mesh too fine, for double precision.
        """
        from fembeam.model.reduce import reduced

        return reduced(self, modes, elements, omega_max, mass_share, residual, interface)

    def campbell(
        self, spins: ArrayLike, modes: int = 4, elements: int | None = None, progress: bool = False
    ) -> Campbell:
        """Frequencies of a rotor over its spin with the sense of its whirl, and critical speeds; see `study.campbell`.

        Examples
        --------
        >>> import fembeam as fb
        >>> shaft = fb.Frame.straight(0.6, fb.Section.circle(2.1e11, 7850.0, 0.04), bending_only=True)
        >>> fb.Scene(shaft, [fb.Clamped("A")]).campbell([500.0], modes=2).signed.round(2).tolist()
        [[-504.18, 505.47]]
        """
        from fembeam.study import campbell

        return campbell(self, spins, modes, elements, progress)

    def figure(self, axes: Axes | None = None) -> Figure:
        """The rig drawn, `fembeam.plot.rig`: beams to scale along z, all parts with names, gaps enlarged."""
        from fembeam.plot import rig

        return rig(self, axes)

    def check(
        self, duration: float | None = None, dt: float | None = None, discard: float = 0.0, **reduction: Any
    ) -> Check:
        """Look at the scene before it is run: modes, contacts to expect, steps and modes to take, what looks wrong.

        It costs about what a run of twenty periods of the lowest mode does, with hundreds of stops of four. `fembeam
        check` prints the same.

        Parameters
        ----------
        duration, dt, discard : s, of the run that is meant: its length, its output step, the transient that statistics
            leave out; None: not known.
        reduction : arguments of `reduce`, such as ``modes=3``.

        Returns
        -------
        Check : ``print(check)`` shows all of it; iterate over it for what looks wrong, in sentences: numbers in other
            units, per cent for a damping ratio, a coarse mesh, a run too short for the lowest mode, a step too long for
            the highest one, contacts that excite modes left out.

        Raises
        ------
        ValueError : arguments that `reduce` refuses, a duration, dt or discard that is not a positive number.

        Examples
        --------
        >>> from fembeam import Clamped, Section
        >>> scene = Scene(Beam(0.5, Section.circle(2.1e11, 7800.0, 0.01)), [Clamped(0.0)])
        >>> list(scene.check(duration=0.01, modes=1))
        ['duration = 0.01 s is 0.29 periods of the lowest mode, 0.0344 s each: is it long enough?']
        """
        from fembeam.inspection import check

        for name, value in (("duration", duration), ("dt", dt)):
            if value is not None:
                require_positive(name, value, "Scene.check", "give s")
        require_non_negative("discard", discard, "Scene.check", "give s")
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always", UserWarning)
            model = self.reduce(**reduction)
        return check(model, duration, dt, discard, [str(one.message) for one in said])

    @property
    def doubts(self) -> list[str]:
        """What was warned of when the scene was made, as sentences."""
        of_motions = (getattr(one, "doubt", "") for one in self.motions.values())
        return [*drifting(self), *(doubt for doubt in of_motions if doubt)]

    @property
    def named(self) -> bool:
        """Whether its body is no `Beam`: places have names and directions."""
        return not isinstance(self.beam, Beam)

    @property
    def motions(self) -> dict[str, Any]:
        """Motion of the frame by its direction; of a beam along y."""
        if self.base is None:
            return {}
        return self.base if isinstance(self.base, dict) else {"y": self.base}

    @property
    def pulls(self) -> dict[str, float]:
        """Gravity by directions, m/s² against each: the load of everything along y is -M r g."""
        if isinstance(self.gravity, tuple):
            return {name: -g for name, g in zip(COMPONENTS[:3], self.gravity, strict=True) if g}
        return {"y": float(self.gravity)} if self.gravity else {}  # type: ignore[arg-type]

    @property
    def acting(self) -> list[Stop | AnnularStop | Element]:
        """Stops, then elements: what acts on the scene's own beam by a law."""
        return [*self.stops, *self.elements]

    def buckling_load(self, elements: int | None = None) -> float:
        """The compression (N, positive) at which the beam buckles, on top of its own axial force.

        Lowest P of (K - P G) φ = 0 with G = ∫ u_z v_z dz. ValueError when supports and springs do not hold the beam.
        """
        require(
            not self.named, "buckling_load is for a Beam", self.beam, "Scene.buckling_load", "ask a scene of a Beam"
        )
        return buckling_load(self, elements)

    @property
    def part_places(self) -> dict[str, Any]:
        """{name: place} of the parts of the scene's own body that were given a name, which stands for their place."""
        return part_places(self.beam, [part for name in FEATURES for part in getattr(self, name)])

    def at(self, places: Any, where: str = "Scene") -> Any:
        """Places of the scene's own body, with or without directions, with places for names of parts."""
        for place in [] if self.named else places if isinstance(places, list) else [places]:
            require_number(place, self.part_places, where)
        return at_parts(places, self.part_places, names_of(self.beam), where)

    @property
    def named_parts(self) -> dict[str, Any]:
        """The parts that were given a name, those of bodies too, by their paths, such as "bodies[0].stops[1]"."""
        own = ((name, i, part) for name in FEATURES for i, part in enumerate(getattr(self, name)))
        inner = {
            f"bodies[{i}].{path}": part for i, body in enumerate(self.bodies) for path, part in body.named_parts.items()
        }
        return {f"{name}[{i}]": part for name, i, part in own if part.name is not None} | inner

    @property
    def places(self) -> list[float]:
        """Coordinates of all features, second places of stops and elements included, in no order."""
        second = [place.to[1] for place in (one.coordinate for one in self.acting) if place.to and place.to[0] == 0]
        return [feature.z for name in FEATURES for feature in getattr(self, name)] + second

    @property
    def rigid_body_modes(self) -> int:
        """How many of the motions u = a + b z nothing resists, of supports, springs, foundation, tension: 0, 1 or 2."""
        return rigid_body_modes(self)

    def _check_places(self, name: str) -> None:
        """Raise ValueError unless every feature of one list sits on the beam."""
        for index, feature in enumerate(getattr(self, name)):
            where = f"{name}[{index}] ({feature.titled}) of Scene"
            if self.named:
                check_feature(self.beam, feature, name, where)
                continue
            check_plain(feature, name, where)
            require(0 <= feature.z <= self.beam.length, f"z must lie on the beam, 0 to {self.beam.length} m",
                    feature.z, where, "move it, or lengthen the beam" + in_mm(feature.z, self.beam.length))  # fmt: skip

    def _check_base(self) -> None:
        """Raise TypeError for a base motion without derivatives, ValueError where its second one does not exist."""
        if self.base is None:
            return
        if self.named:
            known = translations_of(self.beam)
            write = f"write base={{{known[0]!r}: signal}}" if known else "leave it out"
            require(isinstance(self.base, dict), "base must name its directions", self.base, "Scene", write)
            for direction in self.base:
                require(direction in known, f"base must move along {', '.join(known) or 'nothing'}", direction, "Scene",
                        write)  # fmt: skip
            object.__setattr__(self, "base", dict(self.base))
        require(self.named or not isinstance(self.base, dict), "base of a Beam must be one signal, its motion along y",
                self.base, "Scene", "drop the directions")  # fmt: skip
        for direction, motion in self.motions.items():
            missing = [name for name in ("__call__", "derivative") if not callable(getattr(motion, name, None))]
            if missing or isinstance(motion, type):
                raise TypeError(f"base must be a motion y(t) that knows its derivatives, got {motion!r} without "
                                f"{' and '.join(missing) or 'values'} in Scene; use Harmonic, Multisine, BandNoise, "
                                "Record, Pulse, Step, SineSweep, or an object with __call__(t) and "
                                "derivative(order)")  # fmt: skip
            along = f" along {direction}" * self.named
            require_motion(motion, f"base{along}", "Scene")
            require_motion(motion.derivative(2), f"derivative 2 of base{along}", "Scene")

    def _check_gravity(self) -> None:
        """Raise ValueError for gravity along what the bodies have not."""
        if known := self._ways_to_fall:
            astray = [name for name in self.pulls if name not in known]
            require(not astray, f"gravity must pull along {', '.join(known)}", astray, "Scene", "leave the others 0")

    @property
    def _ways_to_fall(self) -> list[str]:
        """Which of x, y and z frames and structures move along; none where there is but a `Beam`."""
        bodies = [part.beam for part in (self, *self.bodies) if part.named] if self.named else []
        known = {c for one in bodies for c in translations_of(one)}
        return [c for c in COMPONENTS[:3] if c in known]

    def _check_conflicts(self) -> None:
        """Raise ValueError if two supports share one place, or two stops one place, side, carrier and gap."""
        near = 1e-9 * self.beam.length
        ordered = sorted(self.supports, key=lambda support: support.z)
        for first, second in pairwise(ordered):
            apart = second.z - first.z > near
            require(apart, "supports must not share one place", (first, second), "Scene", "keep one")
        ways = [tuple(stop.push * part for part in stop.coordinate.along) for stop in self.stops]
        kinds = [(way, repr(stop.coordinate.to), stop.gap) for way, stop in zip(ways, self.stops, strict=True)]
        for i, j in pairwise(sorted(range(len(kinds)), key=lambda i: (kinds[i], self.stops[i].z, i))):
            stop, other = self.stops[i], self.stops[j]
            assert isinstance(stop, Stop)  # annular ones are not of a Beam
            same = kinds[i] == kinds[j] and other.z - stop.z <= near
            told_side = stop.side or stop.direction
            require(not same, f"stops must not share one place, side and gap (z = {stop.z} m, {told_side})",
                    tuple(sorted((i, j))), "stops of Scene",
                    "make them one stop with one law, such as PiecewiseLinear, or give each its own gap")  # fmt: skip

    def _check_bodies(self) -> None:
        """Raise ValueError for what a body cannot carry, and for stops on bodies or places that do not exist."""
        for index, body in enumerate(self.bodies):
            plain = body.base is None and body.gravity == 0 and not body.bodies
            require(plain, "a body must not have base, gravity or bodies of its own", body,
                    f"bodies[{index}] of Scene", "give them to the outer scene")  # fmt: skip

    def _check_places_of_acting(self) -> None:
        """Raise ValueError unless stops and elements of a beam act on what exists and can move."""
        for name, key in (("stops", "on"), ("elements", "to")):
            for index, one in enumerate(getattr(self, name)):
                self._check_second(one.coordinate, key, f"{name}[{index}]{one.quoted} of Scene")

    def _check_names(self) -> None:
        """Raise ValueError if two parts have one name, those of bodies included, or one that of another place."""
        known: dict[str, str] = {}
        for path, part in self.named_parts.items():
            other = known.setdefault(part.name, path)
            require(other == path, "names must be unique", part.name, f"{other} and {path} of Scene",
                    "give each part its own, or none")  # fmt: skip
        _ = self.part_places  # of joined bodies a part may be called what a place of another one is

    def _check_second(self, place: LocalCoordinate, key: str, where: str) -> None:
        """Raise ValueError unless what a stop or element acts on exists and can move."""
        number = 0 if place.to is None else place.to[0]
        if place.to is not None and 0 < number <= len(self.bodies) and self.bodies[number - 1].named:
            return check_end(self.bodies[number - 1].beam, place.to[1], place.along, key, where)
        if place.to is not None:
            self._check_exists(*place.to, place.z, key, where)
        ends = [(0, place.z), *([] if place.to is None else [place.to])]
        held = [_holding((self, *self.bodies)[body], z, int(place.rotation)) for body, z in ends]
        dof = ("y", "rx")[place.rotation]
        met = [one for end in held for one in end if dof in support_motion(one)]
        require(not met, f"what acts must not sit where a support moves along {dof}", met, where,
                "put it at a place beside the support")  # fmt: skip
        move = "turn" if place.rotation else "move"
        require(not all(held), f"the beam must be free to {move} at z", [one for end in held for one in end], where,
                "support it by Pinned there" if place.rotation else "act away from the support")  # fmt: skip

    def _check_exists(self, number: int, z: Any, first: float, key: str, where: str) -> None:
        """Raise ValueError unless a second place lies on a beam of the scene, and is not the first one."""
        known = 0 <= number <= len(self.bodies)
        among = f"1 to {len(self.bodies)}" if self.bodies else "and there is none"
        require(known, f"{key} must name a body, {among}", number, where, "add the beam to bodies")
        length = self.bodies[number - 1].beam.length if number else self.beam.length
        named = f"body {number}" if number else "the beam"
        inside = is_finite(z) and 0 <= z <= length
        advice = "give m, or name the part there" if isinstance(z, str) else "move it"
        require(inside, f"z of {key} must lie on {named}, 0 to {length} m", z, where, advice)
        apart = number > 0 or abs(z - first) > 1e-9 * length
        require(apart, f"z of {key} must be another place", z, where, "leave it out for an end on the frame")


def _holding(beam: Scene, z: float, derivative: int) -> list[Support]:
    """The supports that hold u (derivative 0) or u_z (1) of a beam at z."""
    near = 1e-9 * beam.beam.length
    return [support for support in beam.supports if abs(support.z - z) <= near and support.fixed[derivative]]


def _fall(gravity: Any, ways: list[str]) -> Any:
    """Checked gravity: a number, or a tuple of three, of which two will do in the plane; of none the number 0."""
    if not isinstance(gravity, (list, tuple)):
        require_finite("gravity", gravity, "Scene", "give m/s², 9.81 on the ground")
        return gravity
    require(bool(ways), "gravity of a Beam must be one number, along -y", gravity, "Scene", "write 9.81")
    plane = "z" not in ways
    right = (len(gravity) == 3 or (plane and len(gravity) == 2)) and all(is_finite(one) for one in gravity)
    wanted, example = ("two along x and y", "(0, -9.81)") if plane else ("three", "(0, 0, -9.81)")
    require(right, f"gravity must be a number, or {wanted}", gravity, "Scene", f"write {example}")
    return (*map(float, gravity), 0.0)[:3] if any(gravity) else 0.0


def _listed(name: str, value: Any, kinds: tuple[type, ...]) -> tuple[Any, ...]:
    """The list as a tuple, each entry of one of the kinds."""
    names = " or ".join(kind.__name__ for kind in kinds)
    if not np.iterable(value) or isinstance(value, (str, dict)):  # arrays (,) are an Iterable
        raise TypeError(f"{name} must be a list of {names}, got {value!r} in Scene; put it in brackets")
    entries = tuple(value)
    for index, entry in enumerate(entries):
        if not isinstance(entry, kinds):
            part = is_dataclass(entry) and not isinstance(entry, type) and Scene not in kinds
            advice = "move it to its own list" if part else f"write {kinds[0].__name__}(…)"
            raise TypeError(f"{name}[{index}] must be a {names}, got {entry!r} in Scene; {advice}")
    return entries
