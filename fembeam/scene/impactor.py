"""Rigid masses beside the beam that strike it: free, or on a spring of their own.

m ẍ = -k x - c ẋ - m (ÿ + g) ± F(δ, δ̇),    δ = u(z) - x - gap from above,  δ = x - u(z) - gap from below
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from fembeam.scene.part import ScenePart
from fembeam.support import require, require_finite, require_non_negative, require_positive

SIDES = {"above": (-1.0,), "below": (1.0,), "both": (1.0, -1.0)}


@dataclass(frozen=True, repr=False)
class Impactor(ScenePart):
    """A rigid mass over or under the beam that moves across it and strikes it at z.

    Parameters
    ----------
    z : place on the beam, m.
    mass : kg, > 0.
    velocity : m/s at the start, relative to the frame, positive up: below 0 strikes from above.
    law : of the contact between mass and beam, such as `contacts.Hertz(stiffness)`.
    gap : distance to the undeflected beam at the start, m, ≥ 0; below 0 (pressed on) only with a spring.
    side : "above", "below", or "both" (it embraces the beam with clearance `gap` on each side; two contacts, the
        one below first); None: above, unless it starts upwards.
    stiffness, damping : of its own spring (N/m) and dashpot (N s/m) to the frame, ≥ 0; 0 and 0: a free mass.
    name : keyword, what the contact log, tables and figures call it, unique in a scene.

    Raises
    ------
    ValueError : a value out of range, a law that is none, a free mass that starts inside the beam.

    Examples
    --------
    >>> from contacts import Hertz
    >>> Impactor(0.5, mass=0.1, velocity=-1.0, law=Hertz(1e9)).pushes
    (-1.0,)
    """

    mass: float
    velocity: float
    law: Any
    gap: float = 0.0
    side: str | None = None
    stiffness: float = 0.0
    damping: float = 0.0
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
    require(not bare, "law must not be a bare function", law, where, "decorate it with @law from contacts")
    valid = callable(getattr(law, "force", None)) and not inspect.isclass(law)
    require(valid, "law must offer force(delta, delta_dot, entry_rate)", law, where,
            "give a law such as contacts.Hertz(stiffness)")  # fmt: skip
