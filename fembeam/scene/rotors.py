"""What turns with a shaft: disks and unbalances, on a straight `Frame` that spins.

With the axes e₁ × e₂ = n of the shaft, which turns with Ω about n:
I_d θ₁'' + I_p Ω θ₂' = M₁,   I_d θ₂'' - I_p Ω θ₁' = M₂
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fembeam.excitation import Harmonic
from fembeam.scene.local_coordinate import LocalCoordinate
from fembeam.scene.part import ScenePart
from fembeam.structures import Assembled, Direction, rows_along
from fembeam.support import require, require_finite, require_non_negative

SLACK = 1e-9  # of the polar moment of a thin disk


@dataclass(frozen=True, repr=False)
class Disk(ScenePart):
    """A rigid disk across a straight shaft in space; it spins with the shaft, whose `spin` is that of its `Frame`.

    Parameters
    ----------
    z : place on the shaft.
    mass : kg. diametral, polar : I_d across and I_p along the axis, about its centre, kg m²; I_p ≤ 2 I_d of any body.

    Raises
    ------
    ValueError : numbers below 0, I_p > 2 I_d; in a scene, a body that is no straight frame in space.

    Examples
    --------
    >>> rim = Disk("B", mass=12.0, diametral=0.04, polar=0.075)
    >>> rim.inertia  # about two axes across the shaft and along it
    (0.04, 0.04, 0.075)
    """

    mass: float
    diametral: float
    polar: float
    offset = 0.0
    word = "disk"

    def __post_init__(self) -> None:
        super().__post_init__()
        where = self.where
        require_non_negative("mass", self.mass, where, "give kg")
        require_non_negative("diametral", self.diametral, where, "give kg m²")
        require_non_negative("polar", self.polar, where, "give kg m²")
        most = f"polar must be at most 2 × diametral, {2.0 * self.diametral:g} kg m², as of a thin disk"
        require(self.polar <= (2.0 + SLACK) * self.diametral, most, self.polar, where, "are they exchanged?")

    @property
    def inertia(self) -> tuple[float, float, float]:
        """About the axes of the shaft, the last one along it."""
        return self.diametral, self.diametral, self.polar


@dataclass(frozen=True, repr=False)
class Unbalance(ScenePart):
    """An eccentric mass on a shaft that spins with Ω: a force m e Ω² that turns with it.

    f = m e Ω² (e₁ cos(Ωt + phase) + e₂ sin(Ωt + phase))

    Parameters
    ----------
    z : place on the shaft. moment : m e in kg m, ≥ 0. phase : rad, at t = 0 from e₁ to e₂; of a shaft along z x to y.
    direction, signal : left to the scene, which makes two forces of it, along e₁ and e₂, and lets them follow the spin.
    made, across : left to the scene too: of what moment, phase and spin the signal is, and whether it acts along e₂;
        such a one follows the one before it. As parameters both are one, `forces[0].moment` of the first.

    Examples
    --------
    >>> import fembeam as fb
    >>> shaft = fb.Frame.straight(0.5, fb.Section.circle(2.1e11, 7850.0, 0.04), spin=100.0)
    >>> scene = fb.Scene(shaft, [fb.Clamped("A")], forces=[Unbalance("B", 1e-4)])
    >>> [round(float(force.signal(0.0)), 12) for force in scene.forces]
    [1.0, 0.0]
    """

    moment: float
    phase: float = 0.0
    direction: Direction | None = field(default=None, kw_only=True)
    signal: Any = field(default=None, kw_only=True)
    made: tuple[float, float, float] | None = field(default=None, kw_only=True, repr=False, compare=False)
    across: bool = field(default=False, kw_only=True, repr=False, compare=False)
    word = "unbalance"

    def __post_init__(self) -> None:
        super().__post_init__()
        require_non_negative("moment", self.moment, self.where, "give m e in kg m")
        require_finite("phase", self.phase, self.where, "give rad")

    @property
    def coordinate(self) -> LocalCoordinate:
        """What it acts on."""
        return LocalCoordinate(self.z, 0, None, self.along)

    @property
    def varied(self) -> tuple[str, ...]:
        """Fields that are parameters: those of both forces are those of the first, and their signals follow."""
        return () if self.across else ("z", "moment", "phase")

    def pair(self, axes: NDArray[np.float64]) -> tuple[Unbalance, ...]:
        """The forces along both axes across the shaft; itself if it is one of them."""
        if self.direction is not None:
            return (self,)
        first, second = (tuple(float(x) for x in axis) for axis in axes[:2])
        later = self.name if self.name is None else f"{self.name}, across"
        across = replace(self, direction=second, phase=_behind(self.phase), name=later, across=True)
        return replace(self, direction=first), across

    def beside(self, first: Any) -> Unbalance:
        """The second of a pair, where what was changed of the first is changed; itself beside anything else."""
        before = first.made if isinstance(first, Unbalance) and self.across and not first.across else None
        if before is None or self.made != (before[0], _behind(before[1]), before[2]):
            return self
        return replace(self, z=first.z, moment=first.moment, phase=_behind(first.phase))

    def spun(self, spin: float) -> Unbalance:
        """The same with the signal of a spin; what was made of that signal stays."""
        made = self.moment, self.phase, spin
        if self.signal is not None and self.made in (None, made):
            return self if self.made == made else replace(self, made=made)
        signal = Harmonic(self.moment * spin**2, abs(spin), math.copysign(1.0, spin) * self.phase)
        return replace(self, signal=signal, made=made)


def _behind(phase: float) -> float:
    """Phase of the force along e₂, rad."""
    return phase - 0.5 * math.pi


def carrier(body: Any, place: Any) -> Any:
    """The body that a place is on: of joined ones that which has it."""
    return body.carrier(place) if hasattr(body, "carrier") else body


def check_shaft(body: Any, part: Any, where: str) -> None:
    """Raise ValueError unless a body is a shaft: a straight frame in space; for an unbalance, one that spins."""
    name, body = type(part).__name__, carrier(body, part.z)
    straight = getattr(body, "axis", None) is not None and {"rx", "ry"} <= set(getattr(body, "components", ()))
    require(straight, f"{name} needs a shaft: a straight Frame in space", _kind(body), where, "use Frame.straight")
    spins = not isinstance(part, Unbalance) or body.spin != 0.0
    require(spins, f"{name} needs a shaft that spins", 0.0, where, "give the Frame a spin in rad/s")


def _kind(body: Any) -> str:
    """What a body is, for messages: a frame with all its members would fill a page."""
    flat = "in the plane" if getattr(body, "in_plane", False) else "that is not straight"
    return f"a Frame {flat}" if hasattr(body, "members") else f"a {type(body).__name__}"


def driven(body: Any, forces: tuple[Any, ...]) -> tuple[Any, ...]:
    """Forces with each unbalance as two, of the shaft's spin."""
    found: list[Any] = []
    for index, force in enumerate(forces):
        if isinstance(force, Unbalance):
            check_shaft(body, force, f"forces[{index}] (Unbalance) of Scene")
            shaft, pair = carrier(body, force.z), force.beside(forces[index - 1] if index else None)
            found += [one.spun(shaft.spin) for one in pair.pair(shaft.axes[0])]
        else:
            found.append(force)
    return tuple(found)


def shaft_axes(disk: Disk, body: Any) -> NDArray[np.float64]:
    """Rotations (3, 6) about the three axes of the shaft that carries a disk."""
    return np.hstack([np.zeros((3, 3)), carrier(body, disk.z).axes[0]])


def gyroscopic(scene: Any, assembled: Assembled) -> sparse.csr_matrix | None:
    """G (N_all, N_all) of the body and of the disks on it; None where nothing spins."""
    G = assembled.gyroscopic
    for disk in (mass for mass in scene.masses if isinstance(mass, Disk)):
        spin = carrier(scene.beam, disk.z).spin
        if spin == 0.0:
            continue
        first, second, _ = rows_along(scene.beam, assembled, disk.z, shaft_axes(disk, scene.beam))
        half = disk.polar * spin * (first.T @ second)
        G = half - half.T if G is None else G + half - half.T
    return None if G is None else sparse.csr_matrix(G)
