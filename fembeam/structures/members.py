"""Members of a frame: straight, of one section, between two nodes.

Each has axes of its own: `along` from its first node to its second, `up` the way of its height, and
across = up × along, so that (across, up, along) lie as (x, y, z) of a straight beam. Bending over the height, with I,
moves along `up`; bending with I2 moves `across`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fembeam.beams import Beam, Section
from fembeam.structures.assembled import COMPONENTS
from fembeam.structures.directions import direction_of
from fembeam.support import is_finite, make_native, require, require_finite, require_non_negative

Vector = NDArray[np.float64]

ENDS = ("start", "end")
OWN = ("across", "up", "along")  # hinges about axes of the member
ALIGNED = 1e-6  # sine of the angle below which two directions are one


@dataclass(frozen=True)
class Member:
    """A straight beam between two nodes of a frame.

    Parameters
    ----------
    a, b : names of its nodes.
    section : Section; in space it must know I2 and J.
    up : way of the section's height, bent with I: a direction ("z", "-y") or a vector, not along the member. None: y,
        and z for a member along y; in the plane a quarter turn from `along` anticlockwise.
    name : "A-B" by default, from the names of its nodes.
    release : what its ends do not carry to the nodes, one text or several: "end rz" is a hinge about the global axis z
        at b, "start x" a slide along x at a; "end up", "end across" and "end along" are hinges about its own axes.
    offset : two vectors in m, from node a and node b to the ends of the member: rigid arms.
    axial_force : N in newton, tension positive: it stiffens bending (its direction is fixed).
    foundation : k in N/m², ≥ 0: elastic foundation, a force -k u per metre against both ways of bending.

    Raises
    ------
    ValueError : names, releases, offsets that are not such; numbers that are not finite. TypeError : not a Section.

    Examples
    --------
    >>> steel = Section.tube(2e11, 7900.0, 0.0603, 0.0525)
    >>> Member("A", "B", steel, release="end rz").name
    'A-B'
    """

    a: str
    b: str
    section: Section
    up: Any = None
    name: str = ""
    release: str | Sequence[str] = ()
    offset: Sequence[Sequence[float]] = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    axial_force: float = 0.0
    foundation: float = 0.0

    def __post_init__(self) -> None:
        make_native(self)
        for end in (self.a, self.b):
            write = "write 'A'" if isinstance(end, str) else f"names are text: write {str(end)!r}"
            require(isinstance(end, str) and bool(end), "a and b must be names of nodes", end, "Member", write)
        require(isinstance(self.name, str), "name must be text", self.name, "Member", "write 'A-B'")
        object.__setattr__(self, "name", self.name or f"{self.a}-{self.b}")
        where = f"Member {self.name!r}"
        if not isinstance(self.section, Section):
            raise TypeError(f"section must be a Section, got {self.section!r} in {where}; make one first; a tapered "
                            "member is several of constant section")  # fmt: skip
        require(self.a != self.b, "a and b must be two nodes", self.a, where, "join it to another node")
        if self.up is not None:
            way = direction_of(self.up, f"up of {where}")
            require(not any(way[3:]), "up must be a direction, not a rotation", self.up, where, "write 'y'")
            object.__setattr__(self, "up", way[:3])
        object.__setattr__(self, "release", _releases(self.release, where))
        object.__setattr__(self, "offset", _offsets(self.offset, where))
        require_finite("axial_force", self.axial_force, where, "give N, tension positive")
        require_non_negative("foundation", self.foundation, where, "give N/m per metre of member")

    def beam(self, length: float, plane: bool) -> Beam:
        """The member as a straight beam, in the plane, or bending where its stiffness is least."""
        own = self.section
        I2 = own.I if own.I2 is None else own.I2
        least = own.I if plane else (own.I + I2) / 2 - np.hypot((own.I - I2) / 2, own.I12)
        return Beam(length, replace(own, I=float(least), I12=0.0, shear=None), (), self.foundation, self.axial_force)


def _releases(given: Any, where: str) -> tuple[str, ...]:
    """Checked releases, sorted and without repeats."""
    listed = tuple(given) if isinstance(given, Iterable) and not isinstance(given, str) else (given,)
    for one in listed:
        words = one.split() if isinstance(one, str) else []
        right = len(words) == 2 and words[0] in ENDS and words[1] in (*COMPONENTS, *OWN)
        require(right, f"release must be 'start' or 'end' and one of {', '.join((*COMPONENTS, *OWN))}", one, where,
                "write 'end rz' for a hinge about z at its second node")  # fmt: skip
    return tuple(sorted({" ".join(one.split()) for one in listed}))


def _offsets(given: Any, where: str) -> tuple[tuple[float, ...], ...]:
    """Two arms of three numbers; those of the plane get a zero."""
    rows = list(given) if isinstance(given, (list, tuple, np.ndarray)) else []
    arms = [list(arm) if isinstance(arm, (list, tuple, np.ndarray)) else [] for arm in rows]
    right = len(arms) == 2 and all(len(arm) in (2, 3) and all(is_finite(x) for x in arm) for arm in arms)
    require(right, "offset must be two vectors of finite numbers", given, where, "write ((0, 0, 0.1), (0, 0, 0))")
    return tuple((*(float(x) for x in arm), *(3 - len(arm)) * [0.0]) for arm in arms)


def axes_of(member: Member, along: Vector, plane: bool) -> Vector:
    """(3, 3): unit vectors across, up, along of a member along a unit vector; ValueError where `up` lies along it."""
    where = f"Member {member.name!r}"
    vertical = np.hypot(along[0], along[2]) <= ALIGNED
    usual = np.array([-along[1], along[0], 0.0]) if plane else np.array([0.0, float(not vertical), float(vertical)])
    wanted = usual if member.up is None else np.array(member.up)
    normal = (wanted @ usual) * usual if plane else wanted - (wanted @ along) * along
    size = float(np.linalg.norm(normal))
    shown = tuple(float(f"{x:.4g}") for x in wanted)
    require(size > ALIGNED, "up must not lie along the member" + plane * ", nor normal to the frame's plane", shown,
            where, "give the way of the section's height")  # fmt: skip
    up = normal / size
    return np.array([np.cross(up, along), up, along])


def release_axes(member: Member, axes: Vector) -> list[tuple[int, str, Vector]]:
    """(end 0 or 1, text, (6,) displacement and rotation of the member's end per unit) of every release."""
    found = []
    for one in member.release:
        end, name = one.split()
        if name in OWN:
            motion = np.concatenate([np.zeros(3), axes[OWN.index(name)]])
        else:
            motion = np.eye(6)[COMPONENTS.index(name)]
        found.append((ENDS.index(end), one, motion))
    return found
