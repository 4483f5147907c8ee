"""What stands on a beam: supports, masses, springs, dashpots, stops, forces and moments.

A place `z` is a coordinate along a `Beam`; of other bodies the name of a node or point, or (member, distance in m).
There `direction` says along what a part acts: "x", "-y", "rz" (a rotation), or a vector.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from fembeam.scene.impactor import check_law
from fembeam.scene.local_coordinate import LocalCoordinate, Of, check_turn, local_coordinate
from fembeam.scene.part import ScenePart
from fembeam.scene.places import Place, Second, sign_of
from fembeam.scene.rubbing import Friction, check_oblique
from fembeam.scene.signal_checks import require_load, require_motion
from fembeam.structures import COMPONENTS, Direction, direction_of, turns
from fembeam.support import is_finite, is_one_of, require, require_finite, require_non_negative

ROUNDED = 1e-9  # of the largest entry of a tensor


@dataclass(frozen=True, repr=False)
class _Holding(ScenePart):
    """What holds a place, at rest or in a given motion relative to the frame."""

    motion: Any = None
    dofs: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.motion is not None:
            object.__setattr__(self, "motion", _checked_motion(self.motion, self.dofs, self.where))


def _checked_motion(motion: Any, dofs: tuple[str, ...], where: str) -> dict[str, Any]:
    """{dof: signal} of a support; ValueError for others."""
    named = isinstance(motion, Mapping) and bool(motion)
    require(named, "motion must name its dofs", motion, where, "write motion={'y': signal}")
    for dof, signal in motion.items():
        held = ", ".join(dofs) or "none"
        require(dof in dofs, f"motion must be of dofs that the support holds, {held}", dof, where, "hold it too")
        known = callable(signal) and callable(getattr(signal, "derivative", None)) and not isinstance(signal, type)
        require(known, "motion must be signals that know their derivatives", signal, where,
                "use Harmonic, Multisine, BandNoise, Record, Pulse, Step or SineSweep")  # fmt: skip
        require_motion(signal, f"motion along {dof}", where)
        for order in (1, 2):
            require_motion(signal.derivative(order), f"derivative {order} of the motion along {dof}", where)
    return {dof: motion[dof] for dof in COMPONENTS if dof in motion}


@dataclass(frozen=True, repr=False)
class Clamped(_Holding):
    """u = 0 and u_z = 0 at z (m); of other bodies than a `Beam` no component of a place moves.

    `motion` makes components follow signals, in m and rad relative to the frame: {"y": signal}, so that supports move
    apart; of a `Beam` "y" is u and "rx" is -u_z. The structure starts as it follows them statically at t = 0, in place
    and speed, and damping ratios act on the motion beside the one that follows them statically.

    Examples
    --------
    >>> Clamped(0.0).fixed  # displacement, slope
    (True, True)
    >>> from fembeam import Harmonic
    >>> shaken = Clamped(0.0, motion={"y": Harmonic(1e-3, 50.0)})
    """

    word = "clamp"
    fixed = (True, True)
    dofs = COMPONENTS


@dataclass(frozen=True, repr=False)
class Pinned(_Holding):
    """u = 0 at z (m), free to turn; of other bodies than a `Beam` no displacement of a place; `motion` as of `Clamped`.

    Examples
    --------
    >>> Pinned(0.5).fixed  # displacement, slope
    (True, False)
    """

    word = "pin"
    fixed = (True, False)
    dofs = COMPONENTS[:3]


@dataclass(frozen=True, repr=False)
class Guided(ScenePart):
    """u_z = 0 at z (m), free to move; for a `Beam` only, elsewhere `Fixed` names the rotations.

    Examples
    --------
    >>> Guided(0.5).fixed  # displacement, slope
    (False, True)
    """

    word = "guide"
    fixed = (False, True)
    dofs = ()


@dataclass(frozen=True, repr=False, init=False)
class Fixed(_Holding):
    """Chosen components of a place do not move: Fixed(place, "x", "rz"); none named: all that it has.

    `dofs` are of "x", "y", "z", "rx", "ry", "rz"; of a `Beam` "y" is u and "rx" is -u_z; `motion` as of `Clamped`.
    ValueError for another name, or one twice.

    Examples
    --------
    >>> Fixed("flange", "x", "y").dofs, Fixed("flange").dofs == Clamped("flange").dofs
    (('x', 'y'), True)
    """

    dofs: tuple[str, ...] = ()  # type: ignore[misc]
    word = "fixing"

    def __init__(
        self, z: Place, *named: str, dofs: tuple[str, ...] = (), motion: Any = None, name: str | None = None
    ) -> None:
        chosen = tuple(named) + tuple(dofs)
        object.__setattr__(self, "z", z)
        object.__setattr__(self, "name", name)
        object.__setattr__(self, "motion", None)
        super().__post_init__()
        for dof in chosen:
            require(dof in COMPONENTS, f"dofs must be of {', '.join(COMPONENTS)}", dof, self.where,
                    "name each by itself, Fixed(place, 'x', 'rz'), or none to fix all")  # fmt: skip
        require(len(set(chosen)) == len(chosen), "dofs must be named once", chosen, self.where, "keep one")
        object.__setattr__(self, "dofs", chosen or COMPONENTS)
        object.__setattr__(self, "motion", motion)
        super().__post_init__()

    @property
    def fixed(self) -> tuple[bool, bool]:
        """Of a beam: displacement and slope."""
        return "y" in self.dofs, "rx" in self.dofs


Support = Clamped | Pinned | Guided | Fixed


@dataclass(frozen=True, repr=False)
class LumpedMass(ScenePart):
    """A rigid body fixed to the beam at z: T = ½ m (u̇ + e u̇_z)² + ½ J u̇_z².

    `mass` m in kg, `inertia` J about its own centre in kg m², both ≥ 0; `offset` e in m: the centre sits
    ahead of z by e on a rigid arm, which may reach beyond the beam's end. On other bodies than a `Beam` the inertia is
    that about every axis, three numbers, about x, y and z, or the rows of the tensor along these axes,
    [[Jxx, Jxy, Jxz], …] with Jxy = -∫ x y dm; the offset is a vector (one number is its z, two are x and y).
    ValueError for a negative mass or inertia, a tensor that is not symmetric, or negative about some axis.

    Examples
    --------
    >>> cube = LumpedMass(0.5, mass=0.1, inertia=0.1 * 0.02**2 / 6)  # edge 2 cm
    >>> round(cube.inertia, 9)
    6.667e-06
    """

    mass: float
    inertia: float | tuple[float, float, float] | tuple[tuple[float, ...], ...] = 0.0
    offset: float | tuple[float, ...] = 0.0
    word = "mass"

    def __post_init__(self) -> None:
        super().__post_init__()
        where = self.where
        require_non_negative("mass", self.mass, where, "give kg")
        tensor = _tensor(self.inertia, where)
        if tensor is not None:
            object.__setattr__(self, "inertia", tensor)
        checked = (("inertia", require_non_negative), ("offset", require_finite))
        for name, check in checked if tensor is None else checked[1:]:
            value = getattr(self, name)
            value = value.tolist() if isinstance(value, np.ndarray) else value
            if isinstance(value, (list, tuple)):
                value = (*value, 0.0) if name == "offset" and len(value) == 2 else value
                require(len(value) == 3, f"{name} must be one number, or three", value, where, "along x, y and z")
                object.__setattr__(self, name, tuple(value))
            for one in value if isinstance(value, (list, tuple)) else (value,):
                check(name, one, where, "give kg m²" if name == "inertia" else "give m")


def _tensor(inertia: Any, where: str) -> tuple[tuple[float, ...], ...] | None:
    """The checked rows of an inertia tensor; None of what is none."""
    rows = tuple(inertia) if isinstance(inertia, (list, tuple)) or np.ndim(inertia) else ()
    if not any(isinstance(row, (list, tuple, np.ndarray)) for row in rows):
        return None
    right = all(np.shape(row) == (3,) and all(is_finite(one) for one in row) for row in rows) and len(rows) == 3
    require(right, "an inertia tensor must be three rows of three finite numbers", inertia, where, "give kg m²")
    J = np.array(rows, dtype=float)
    symmetric = bool(np.all(np.abs(J - J.T) <= ROUNDED * np.abs(J).max()))
    require(symmetric, "an inertia tensor must be symmetric", inertia, where, "products of inertia stand twice")
    least = float(np.linalg.eigvalsh(J)[0])
    require(least >= -ROUNDED * np.abs(J).max(), "an inertia tensor must not be negative about any axis", least, where,
            "check the products of inertia, in kg m²")  # fmt: skip
    return tuple(tuple(row) for row in ((J + J.T) / 2).tolist())


@dataclass(frozen=True, repr=False)
class Spring(ScenePart):
    """A spring to the frame: force -k (u - foot) (`stiffness`, N/m), moment -κ u_z (`rotational`, N m/rad); ≥ 0.

    `foot` is a signal, the motion of its far end relative to the frame in m (a shaken support); None: at rest. On other
    bodies than a `Beam` it acts along `direction`, in N m/rad if that is a rotation. ValueError for one below 0.

    Examples
    --------
    >>> from fembeam import Harmonic
    >>> shaken = Spring(0.3, stiffness=1e4, foot=Harmonic(amplitude=1e-3, omega=50.0))
    >>> shaken.stiffness * float(shaken.foot(0.0))  # N, on the beam held at u = 0
    10.0
    """

    stiffness: float
    rotational: float = 0.0
    foot: Any = None
    direction: Direction | None = None
    word = "spring"

    def __post_init__(self) -> None:
        super().__post_init__()
        where = self.where
        require_non_negative("stiffness", self.stiffness, where, "give N/m")
        require_non_negative("rotational", self.rotational, where, "give N m/rad")
        require(self.foot is None or callable(self.foot), "foot must be a signal or None", self.foot, where,
                "give a motion such as Harmonic(amplitude, omega)")  # fmt: skip
        if self.foot is not None:
            require_motion(self.foot, "foot", where)
        _check_direction(self, where)


@dataclass(frozen=True, repr=False)
class Dashpot(ScenePart):
    """A dashpot to the frame: force -c u̇ (`damping`, N s/m), moment -γ u̇_z (`rotational`, N m s); ≥ 0.

    On other bodies than a `Beam` it acts along `direction`, in N m s if that is a rotation. ValueError for one below 0.

    Examples
    --------
    >>> Dashpot(0.3, damping=2.0)
    Dashpot(z=0.3, damping=2.0, rotational=0.0)
    """

    damping: float
    rotational: float = 0.0
    direction: Direction | None = None
    word = "dashpot"

    def __post_init__(self) -> None:
        super().__post_init__()
        where = self.where
        require_non_negative("damping", self.damping, where, "give N s/m")
        require_non_negative("rotational", self.rotational, where, "give N m s/rad")
        _check_direction(self, where)


@dataclass(frozen=True, repr=False)
class Stop(ScenePart):
    """A one-sided stop: δ = -u - gap below the beam, δ = u - gap above it; of rotation δ = ∓u_z - gap.

    On any body `direction` n is the way the place moves when the gap closes, δ = n·u - gap: "y" is above a beam, "-y"
    below it, "rz" stops a rotation. `on` is then a place of the same body, (body, place), or None: the frame.
    `law` gives the repulsive force for δ > 0; `gap` in m, negative = preload. It sits on the frame, or `on` another
    beam of the scene: `on=(body, z)`, body 1 the first of `Scene.bodies`; u is then the difference, u - u_body(z). A
    number for `on` is a second place on the same beam. With `of="rotation"` it limits the slope u_z, a hinge with
    freeplay: gap in rad, force a moment in N m, "below" stops u_z < 0, "above" u_z > 0.
    `friction`, a `Friction` under the stop's own force, acts along `tangent` t, at right angles to the direction,
    against ξ = t·u: an oblique contact of a frame or structure; in a plane frame t is the other way in the plane.
    `name` (keyword, as of all parts): what the contact log, tables and figures call it, unique in a scene.
    ValueError for a side that is neither "below" nor "above", a side beside a direction, an `of` that is neither, a gap
    that is not finite, or of a slope beyond a quarter turn; for friction of a rotation, on a `Beam`, without a tangent,
    or with one that is not across.

    Examples
    --------
    >>> from contacts import Hertz, KelvinVoigt
    >>> both = [Stop(0.2, Hertz(1e9), gap=1e-3, side=side) for side in ("below", "above")]
    >>> [stop.side for stop in both]
    ['below', 'above']
    >>> Stop(0.0, KelvinVoigt(500.0, 0.1), gap=0.02, side="above", of="rotation").coordinate.rotation
    True
    >>> Stop("lever", Hertz(1e9), gap=1e-3, direction="-x", name="lift").coordinate.direction
    (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    >>> both[0].label, Stop("lever", Hertz(1e9), direction="-x").label
    ('stop at 0.2 m, below', 'stop at lever, -x')
    >>> Stop("C", Hertz(1e9), direction="-y", friction=Friction(0.3, stiffness=5e5), tangent="x").friction
    Friction(mu=0.3, stiffness=500000.0)
    """

    law: Any
    gap: float = 0.0
    side: str | None = None
    on: Second | None = None
    of: Of = "displacement"
    direction: Direction | None = None
    friction: Friction | None = None
    tangent: Direction | None = None
    always = False
    word = "stop"

    def __post_init__(self) -> None:
        super().__post_init__()
        where = self.where
        require_finite("gap", self.gap, where, "give the clearance in m (rad of a rotation), negative for a preload")
        require(self.direction is None or self.side is None, "side and direction exclude each other",
                (self.side, self.direction), where, "keep the direction: 'y' is above, '-y' below")  # fmt: skip
        if self.side is None and self.direction is None:
            object.__setattr__(self, "side", "below")
        sided = self.side is None or is_one_of(self.side, ("below", "above"))
        require(sided, "side must be 'below' or 'above'", self.side, where,
                "choose one")  # fmt: skip
        _check_direction(self, where)
        local_coordinate(self.z, self.of, self.on, where, "on", self.direction)
        check_turn(self.of, self.gap, where)
        check_law(self.law, where)
        acts_always = getattr(self.law, "memory", ()) and not getattr(self.law, "one_sided", False)
        require(not acts_always, "law must be one that opens", self.law, where, "make it an Element, which always acts")
        check_oblique(self, where)
        remembers = self.friction is not None and bool(getattr(self.law, "memory", ()))
        require(not remembers, "law of a stop with friction must have no memory", self.law, where, "choose another one")

    @property
    def push(self) -> float:
        """Direction in which the stop pushes: +1 (up) from below, -1 from above; against its direction."""
        if self.direction is not None:
            return -sign_of(self.direction)
        return 1.0 if self.side == "below" else -1.0

    @property
    def coordinate(self) -> LocalCoordinate:
        """What it acts on."""
        return local_coordinate(self.z, self.of, self.on, self.where, "on", self.direction)

    @property
    def coordinates(self) -> tuple[LocalCoordinate, ...]:
        """All that it acts on: the one, with friction also that along its tangent."""
        if self.tangent is None:
            return (self.coordinate,)
        return self.coordinate, replace(self.coordinate, direction=direction_of(self.tangent, self.where))

    def _made(self, at: str) -> str:
        of, on = " of rotation" * (self.direction is None and self.coordinate.rotation), self.coordinate.to_words
        side = f", {self.side}" if self.direction is None else ""
        return f"{self.word}{of} at {at}{side}" + (f", on {on}" if on else "")


@dataclass(frozen=True, repr=False)
class _Load(ScenePart):
    """What drives a place: signal(t), on other bodies than a `Beam` along or about `direction`."""

    signal: Any
    direction: Direction | None = None
    derivative: ClassVar[int] = 0  # of u at the place that it works on

    def __post_init__(self) -> None:
        super().__post_init__()
        require(callable(self.signal), "signal must be a function of t", self.signal, self.where,
                "give a signal such as Harmonic(amplitude, omega); Harmonic(size, 0.0) is a constant")  # fmt: skip
        require_load(self.signal, "N m" if self.derivative else "N", self.where)
        _check_direction(self, self.where)

    @property
    def coordinate(self) -> LocalCoordinate:
        """What it acts on."""
        return LocalCoordinate(self.z, self.derivative, None, self.along)


@dataclass(frozen=True, repr=False)
class PointForce(_Load):
    """A force on the beam at z: signal(t) in N, positive up; on other bodies along `direction`.

    Examples
    --------
    >>> from fembeam import Pulse
    >>> round(float(PointForce(0.2, Pulse(peak=100.0, length=1e-3)).signal(5e-4)), 9)
    100.0
    """

    word = "force"

    def __post_init__(self) -> None:
        super().__post_init__()
        pushes = self.along is None or not turns(self.along)
        require(pushes, "direction of a force must be no rotation", self.direction, self.where, "make it a PointMoment")


@dataclass(frozen=True, repr=False)
class PointMoment(_Load):
    """A moment on the beam at z: signal(t) in N m, positive where it turns u_z up; elsewhere about "rx", "ry", "rz".

    Examples
    --------
    >>> from fembeam import Step
    >>> float(PointMoment(0.2, Step(size=1.5, rise=0.1)).signal(1.0))
    1.5
    """

    word = "moment"
    derivative = 1

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.along is None or turns(self.along), "direction of a moment must be a rotation", self.direction,
                self.where, "write 'rx', 'ry' or 'rz'")  # fmt: skip


def _check_direction(part: Any, where: str) -> None:
    """Raise ValueError for a direction that is none."""
    if part.direction is not None:
        direction_of(part.direction, where)
    if getattr(part, "rotational", 0.0):
        require(part.direction is None, "rotational is for parts without a direction", part.rotational, where,
                "add one with direction='rx' or so, whose numbers are those of a rotation")  # fmt: skip
