"""Rigid masses beside the beam that strike it: free, or on a spring of their own.

m ẍ = -k x - c ẋ - m (ÿ + g) ± F(δ, δ̇),    δ = u(z) - x - gap from above,  δ = x - u(z) - gap from below

On other bodies than a `Beam` along a direction n: u is n·u of the place, ÿ + g its part along n.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from fembeam.scene.local_coordinate import LocalCoordinate
from fembeam.scene.part import ScenePart
from fembeam.structures import UP, Direction, Six, direction_of, turns
from fembeam.support import require, require_finite, require_non_negative, require_positive

SIDES = {"above": (-1.0,), "below": (1.0,), "both": (1.0, -1.0)}


@dataclass(frozen=True, repr=False)
class Impactor(ScenePart):
    """A rigid mass over or under the beam that moves across it and strikes it at z; of other bodies along a direction.

    Parameters
    ----------
    z : place on the beam, m; of other bodies a place by name, or (member, distance).
    mass : kg, > 0.
    velocity : m/s at the start, relative to the frame, positive up: below 0 strikes from above.
    law : of the contact between mass and beam, such as `contacts.Hertz(stiffness)`.
    gap : distance to the undeflected beam at the start, m, ≥ 0; below 0 (pressed on) only with a spring.
    side : "above", "below", or "both" (it embraces the beam with clearance `gap` on each side; two contacts, the
        one below first); None: above, unless it starts upwards.
    stiffness, damping : of its own spring (N/m) and dashpot (N s/m) to the frame, ≥ 0; 0 and 0: a free mass.
    direction : keyword, on other bodies than a `Beam`, "x", "-y" or a vector: what is up for it. Its velocity is
        positive that way, and "above" is ahead of the place.
    name : keyword, what the contact log, tables and figures call it, unique in a scene.

    Raises
    ------
    ValueError : a value out of range, a law that is none, a free mass that starts inside the beam, a direction that is
        a rotation.

    Examples
    --------
    >>> from contacts import Hertz
    >>> Impactor(0.5, mass=0.1, velocity=-1.0, law=Hertz(1e9)).pushes
    (-1.0,)
    >>> Impactor("lever", mass=0.1, velocity=-1.0, law=Hertz(1e9), direction="x").label
    'impactor at lever, x, above'
    """

    mass: float
    velocity: float
    law: Any
    gap: float = 0.0
    side: str | None = None
    stiffness: float = 0.0
    damping: float = 0.0
    direction: Direction | None = field(default=None, kw_only=True)
    word = "impactor"

    def __post_init__(self) -> None:
        super().__post_init__()
        where = self.where
        require_positive("mass", self.mass, where, "give kg")
        require_finite("velocity", self.velocity, where, "give m/s, below 0 for a strike from above")
        require_finite("gap", self.gap, where, "give the distance to the beam in m")
        require_non_negative("stiffness", self.stiffness, where, "give N/m, 0 for a free mass")
        require_non_negative("damping", self.damping, where, "give N s/m")
        sides = (None, *SIDES)
        require(self.side in sides, "side must be 'above', 'below', 'both' or None", self.side, where, "choose one")
        require(self.gap >= 0 or (self.stiffness > 0 and self.side != "both"),
                "gap must not be negative: the mass would start inside the beam", self.gap, where,
                "lift it, or give it a spring that presses it on")  # fmt: skip
        check_law(self.law, where)
        moves = self.direction is None or not turns(direction_of(self.direction, where))
        require(moves, "direction of an impactor must be no rotation", self.direction, where, "write 'x', 'y' or 'z'")

    @property
    def along(self) -> Six:
        """The direction that is up for it, on the six components."""
        return UP if self.direction is None else direction_of(self.direction, self.where)

    @property
    def coordinates(self) -> tuple[LocalCoordinate, ...]:
        """What it strikes: the one."""
        return (LocalCoordinate(self.z, direction=None if self.direction is None else self.along),)

    @property
    def pushes(self) -> tuple[float, ...]:
        """Directions in which its contacts push the beam: +1 up (it sits below), -1 down."""
        return SIDES[self.side or ("below" if self.velocity > 0 else "above")]

    def _made(self, at: str) -> str:
        side = "" if len(self.pushes) > 1 else ", below" if self.pushes[0] > 0 else ", above"
        return f"{super()._made(at)}{side}"


def check_law(law: Any, where: str) -> None:
    """Raise ValueError unless it is a contact law."""
    import inspect

    bare = inspect.isroutine(law) and not hasattr(law, "force")
    require(not bare, "law must not be a bare function", law, where, "decorate it with @law from contacts, and call it")
    valid = callable(getattr(law, "force", None)) and not inspect.isclass(law)
    require(valid, "law must offer force(delta, delta_dot, entry_rate)", law, where,
            "give a law such as contacts.Hertz(stiffness)")  # fmt: skip
