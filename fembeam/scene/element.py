"""Local elements that act at any deformation, of both signs: nonlinear springs, hinge springs, links of two places.

d = W u - gap,    the element pushes the structure with -Wᵀ F(d, ḋ)
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fembeam.scene.impactor import check_law
from fembeam.scene.local_coordinate import LocalCoordinate, Of, check_turn, local_coordinate
from fembeam.scene.part import ScenePart
from fembeam.scene.places import Second
from fembeam.structures import Direction, direction_of
from fembeam.support import require, require_finite

TRIED = np.array([1e-6, 1e-4, 1e-3])  # deformations, m or rad, of both signs, at which a law is tried out


@dataclass(frozen=True, repr=False)
class Element(ScenePart):
    """A local element that always acts: force F(d, ḋ) against its deformation d = u(z) - gap, or that of u_z.

    Parameters
    ----------
    z : place on the beam, m.
    law : of F(d, ḋ) at both signs of d, such as `contacts.KelvinVoigt`, `contacts.Polynomial` or one's own.
    of : "displacement" (m, N), or "rotation": d of the slope u_z (rad), F a moment (N m).
    to : its other end; None: the frame, a number: that place on the same beam, (body, z): on a beam of
        `Scene.bodies`, 1 the first. d is then the difference, u(z) - u_to - gap.
    gap : d = 0 at u = gap, m or rad: an offset, since the law acts on both sides.
    direction : on other bodies than a `Beam`: along what d is measured, "x", "-y", "rz" or a vector.
    name : keyword, what tables and figures call it, unique in a scene.

    Raises
    ------
    ValueError : a law that is for δ > 0 only (`Stop` takes it) or asks for a rate of entry, an `of` that is neither, a
        gap that is not finite, or of a slope beyond a quarter turn.

    Examples
    --------
    >>> from contacts import KelvinVoigt, Polynomial
    >>> duffing = Element(0.3, Polynomial([0.0, 0.0, 2e9]))
    >>> hinge = Element(0.0, KelvinVoigt(150.0, 0.2), of="rotation")
    >>> hinge.coordinate.rotation
    True
    """

    law: Any
    of: Of = "displacement"
    to: Second | None = None
    gap: float = 0.0
    direction: Direction | None = None
    push = -1.0  # δ = d: direction -W
    always = True
    word = "element"

    def __post_init__(self) -> None:
        super().__post_init__()
        where = self.where
        require_finite("gap", self.gap, where, "give the offset in m, or rad of a rotation")
        _ = self.coordinate
        check_turn(self.of, self.gap, where)
        check_law(self.law, where)
        why = next(one_sided(self.law), "")
        require(not why, f"law must act at both signs of d: {why}", self.law, where,
                "use a Stop, or a law such as KelvinVoigt or Polynomial")  # fmt: skip

    @property
    def coordinate(self) -> LocalCoordinate:
        """What it acts on."""
        found = local_coordinate(self.z, self.of, self.to, self.where, "to", self.direction)
        if self.direction is None:
            return found
        return replace(found, direction=direction_of(self.direction, self.where))

    def _made(self, at: str) -> str:
        of, to = " of rotation" * (self.direction is None and self.coordinate.rotation), self.coordinate.to_words
        return f"{self.word}{of} " + (f"from {at} to {to}" if to else f"at {at}")


def one_sided(law: Any) -> Iterator[str]:
    """Why a law is none that acts at both signs of d; nothing if it is one.

    Examples
    --------
    >>> from contacts import Hertz, KelvinVoigt
    >>> next(one_sided(Hertz(1e9)), ""), next(one_sided(KelvinVoigt(1e4, 1.0)), "")
    ('its force at d < 0 is not a number', '')
    """
    rate = np.tile([-0.1, 0.1], len(TRIED))
    pushed, pulled, later = (
        law.batch(entry_rate)(sign * np.repeat(TRIED, 2), rate) for sign, entry_rate in ((1, 1.0), (-1, 1.0), (-1, 2.0))
    )
    cut = getattr(law, "bend", None) or (getattr(law, "memory", ()) and law.one_sided)
    if not np.isfinite(pulled).all():
        yield "its force at d < 0 is not a number"
    elif any(hasattr(part, "indentation") for part in getattr(law, "parts", (law,))):
        yield "a table of measured forces begins at d = 0"
    elif np.any(pulled != later):
        yield "its force depends on the rate of entry, and nothing enters"
    elif cut or (np.any(pushed) and not np.any(pulled)):
        yield "its force is cut at zero"


def force_both_ways(law: Any, d: Any, rate: Any = 0.0) -> NDArray[np.float64]:
    """F(d, ḋ) of a law that always acts; arrays broadcast."""
    d, rate = np.broadcast_arrays(np.asarray(d, dtype=float), np.asarray(rate, dtype=float))
    return np.asarray(law.batch(1.0)(d.ravel(), rate.ravel())).reshape(d.shape)


def tangent(law: Any, d: float, rate: float = 0.0, entry_rate: float = 1.0) -> tuple[float, float]:
    """∂F/∂d and ∂F/∂ḋ of a law at one deformation, of one with memory at the start of a run."""
    pointer = ctypes.POINTER(ctypes.c_double)
    arrays = [np.array(x, dtype=float, ndmin=1) for x in (d, rate, law.parameters, 0.0, 0.0, 0.0)]
    at = [x.ctypes.data_as(pointer) for x in arrays]
    law.gradient.ctypes(1, *at[:2], entry_rate, *at[2:])
    return float(arrays[3][0]), float(arrays[4][0])
