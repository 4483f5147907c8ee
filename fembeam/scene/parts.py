"""What stands on a beam: supports, masses, springs, dashpots, stops, forces and moments."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from fembeam.scene.impactor import check_law
from fembeam.scene.local_coordinate import LocalCoordinate, Of, local_coordinate
from fembeam.scene.part import ScenePart
from fembeam.support import require, require_finite, require_non_negative


@dataclass(frozen=True, repr=False)
class Clamped(ScenePart):
    """u = 0 and u_z = 0 at z (m).

    Examples
    --------
    >>> Clamped(0.0).fixed  # displacement, slope
    (True, True)
    """

    word = "clamp"
    fixed = (True, True)


@dataclass(frozen=True, repr=False)
class Pinned(ScenePart):
    """u = 0 at z (m), free to turn.

    Examples
    --------
    >>> Pinned(0.5).fixed  # displacement, slope
    (True, False)
    """

    word = "pin"
    fixed = (True, False)


@dataclass(frozen=True, repr=False)
class Guided(ScenePart):
    """u_z = 0 at z (m), free to move.

    Examples
    --------
    >>> Guided(0.5).fixed  # displacement, slope
    (False, True)
    """

    word = "guide"
    fixed = (False, True)


Support = Clamped | Pinned | Guided


@dataclass(frozen=True, repr=False)
class LumpedMass(ScenePart):
    """A rigid body fixed to the beam at z: T = ½ m (u̇ + e u̇_z)² + ½ J u̇_z².

    `mass` m in kg, `inertia` J about its own centre in kg m², both ≥ 0; `offset` e in m: the centre sits
    ahead of z by e on a rigid arm, which may reach beyond the beam's end. ValueError for a negative mass or inertia.

    Examples
    --------
    >>> cube = LumpedMass(0.5, mass=0.1, inertia=0.1 * 0.02**2 / 6)  # edge 2 cm
    >>> round(cube.inertia, 9)
    6.667e-06
    """

    mass: float
    inertia: float = 0.0
    offset: float = 0.0
    word = "mass"

    def __post_init__(self) -> None:
        super().__post_init__()
        require_non_negative("mass", self.mass, self.where, "give kg")
        require_non_negative("inertia", self.inertia, self.where, "give kg m²")
        require_finite("offset", self.offset, self.where, "give m")


@dataclass(frozen=True, repr=False)
class Spring(ScenePart):
    """A spring to the frame: force -k (u - foot) (`stiffness`, N/m), moment -κ u_z (`rotational`, N m/rad); ≥ 0.

    `foot` is a signal, the motion of its far end relative to the frame in m (a shaken support); None: at rest.
    ValueError for a negative stiffness.

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
    word = "spring"

    def __post_init__(self) -> None:
        super().__post_init__()
        require_non_negative("stiffness", self.stiffness, self.where, "give N/m")
        require_non_negative("rotational", self.rotational, self.where, "give N m/rad")
        require(self.foot is None or callable(self.foot), "foot must be a signal or None", self.foot,
                self.where, "give a motion such as Harmonic(amplitude, omega)")  # fmt: skip


@dataclass(frozen=True, repr=False)
class Dashpot(ScenePart):
    """A dashpot to the frame: force -c u̇ (`damping`, N s/m), moment -γ u̇_z (`rotational`, N m s); ≥ 0.

    ValueError for a negative one.

    Examples
    --------
    >>> Dashpot(0.3, damping=2.0)
    Dashpot(z=0.3, damping=2.0, rotational=0.0)
    """

    damping: float
    rotational: float = 0.0
    word = "dashpot"

    def __post_init__(self) -> None:
        super().__post_init__()
        require_non_negative("damping", self.damping, self.where, "give N s/m")
        require_non_negative("rotational", self.rotational, self.where, "give N m s/rad")


@dataclass(frozen=True, repr=False)
class Stop(ScenePart):
    """A one-sided stop: δ = -u - gap below the beam, δ = u - gap above it; of rotation δ = ∓u_z - gap.

    `law` gives the repulsive force for δ > 0; `gap` in m, negative = preload. It sits on the frame, or `on` another
    beam of the scene: `on=(body, z)`, body 1 the first of `Scene.bodies`; u is then the difference, u - u_body(z). A
    number for `on` is a second place on the same beam. With `of="rotation"` it limits the slope u_z, a hinge with
    freeplay: gap in rad, force a moment in N m, "below" stops u_z < 0, "above" u_z > 0.
    `name` (keyword, as of all parts): what the contact log, tables and figures call it, unique in a scene.
    ValueError for a side that is neither "below" nor "above", an `of` that is neither, a gap that is not finite.

    Examples
    --------
    >>> from contacts import Hertz, KelvinVoigt
    >>> both = [Stop(0.2, Hertz(1e9), gap=1e-3, side=side) for side in ("below", "above")]
    >>> [stop.side for stop in both]
    ['below', 'above']
    >>> Stop(0.0, KelvinVoigt(500.0, 0.1), gap=0.02, side="above", of="rotation").coordinate.rotation
    True
    >>> both[0].label, Stop(0.2, Hertz(1e9), name="valve").label
    ('stop at 0.2 m, below', 'valve')
    """

    law: Any
    gap: float = 0.0
    side: str = "below"
    on: float | tuple[int, float] | None = None
    of: Of = "displacement"
    always = False
    word = "stop"

    def __post_init__(self) -> None:
        super().__post_init__()
        where = self.where
        require_finite("gap", self.gap, where, "give the clearance in m (rad of a rotation), negative for a preload")
        require(self.side in ("below", "above"), "side must be 'below' or 'above'", self.side, where, "choose one")
        local_coordinate(self.z, self.of, self.on, where, "on")
        check_law(self.law, where)
        acts_always = getattr(self.law, "memory", ()) and not getattr(self.law, "one_sided", False)
        require(not acts_always, "law must be one that opens", self.law, where, "make it an Element, which always acts")

    @property
    def push(self) -> float:
        """Direction in which the stop pushes the beam: +1 (up) from below, -1 from above."""
        return 1.0 if self.side == "below" else -1.0

    @property
    def coordinate(self) -> LocalCoordinate:
        """What it acts on."""
        return local_coordinate(self.z, self.of, self.on, self.where, "on")

    def _made(self, at: str) -> str:
        of, on = " of rotation" * self.coordinate.rotation, self.coordinate.to_words
        return f"{self.word}{of} at {at}, {self.side}" + (f", on {on}" if on else "")


@dataclass(frozen=True, repr=False)
class PointForce(ScenePart):
    """A force on the beam at z: signal(t) in N, positive up.

    Examples
    --------
    >>> from fembeam import Pulse
    >>> round(float(PointForce(0.2, Pulse(peak=100.0, length=1e-3)).signal(5e-4)), 9)
    100.0
    """

    signal: Any
    word = "force"

    def __post_init__(self) -> None:
        super().__post_init__()
        require(callable(self.signal), "signal must be a function of t", self.signal, self.where,
                "give a signal such as Harmonic(amplitude, omega); Harmonic(size, 0.0) is a constant")  # fmt: skip


@dataclass(frozen=True, repr=False)
class PointMoment(ScenePart):
    """A moment on the beam at z: signal(t) in N m, positive where it turns u_z up.

    Examples
    --------
    >>> from fembeam import Step
    >>> float(PointMoment(0.2, Step(size=1.5, rise=0.1)).signal(1.0))
    1.5
    """

    signal: Any
    word = "moment"

    def __post_init__(self) -> None:
        super().__post_init__()
        require(callable(self.signal), "signal must be a function of t", self.signal, self.where,
                "give a signal such as Harmonic(amplitude, omega); Harmonic(size, 0.0) is a constant")  # fmt: skip
