"""Frames: members joined at nodes, in the plane and in space."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fembeam.beams import SAME_PLACE, Section
from fembeam.structures.assembled import COMPONENTS
from fembeam.structures.directions import nearest
from fembeam.structures.members import Member, axes_of
from fembeam.support import (
    in_mm,
    is_finite,
    is_pair,
    is_whole,
    make_native,
    require,
    require_finite,
    require_positive,
    require_switch,
)

if TYPE_CHECKING:
    from fembeam.structures.frame_mesh import FrameMatrices
    from fembeam.structures.structure import Structure

Vector = NDArray[np.float64]
Site = str | tuple[int, float]  # a node, or the number of a member and the distance from its first end

PLANE = ("x", "y", "rz")
BENDING = ("x", "y", "rx", "ry")
DRAWN = 12  # straight pieces of a member in figures
MOST_DRAWN = 600  # of all members, but two each


@dataclass(frozen=True)
class Frame:
    """Straight members between named nodes, rigidly joined: a plane frame of bending and stretch, or one in space.

    Parameters
    ----------
    nodes : {name: coordinates} in m. Two numbers a node make a plane frame, which moves along "x", "y", "rz"; three
        make one in space, with all of "x", "y", "z", "rx", "ry", "rz".
    members : list of `Member`.
    spin : Ω in rad/s, of a straight shaft of round section about its axis, from its first member's first node to the
        second: gyroscopic moments, and rotary inertia.
    bending_only : of a frame along the z axis, keep "x", "y", "rx", "ry" alone: neither stretch nor twist.

    Raises
    ------
    ValueError : nodes at one place, a node that does not exist (the nearest is named), a member of no length or with
        `up` along it, parts that are not connected, releases that free a member, a section that does not
        know I2 or J where they are needed, spin of what is no round straight shaft.

    Notes
    -----
    Shear deformation only with `shear` of the section, rotary inertia of bending with that or with spin; torsion of
    Saint-Venant without warping; centroid and shear centre are one. Loads and stops act between nodes as well: a place
    is the name of a node, (member, distance in m from its first end), or, of a straight frame, the distance z in m from
    its first node.

    Examples
    --------
    >>> steel = Section.rectangle(2.1e11, 7850.0, width=0.05, height=0.1)
    >>> nodes = {"A": (0, 0), "B": (0, 3), "C": (4, 3), "D": (4, 0)}
    >>> portal = Frame(nodes, [Member("A", "B", steel), Member("B", "C", steel), Member("D", "C", steel)])
    >>> portal.components, portal.position(("B-C", 1.0)).tolist()
    (('x', 'y', 'rz'), [1.0, 3.0, 0.0])
    """

    nodes: Mapping[str, Sequence[float]]
    members: Sequence[Member]
    spin: float = 0.0
    bending_only: bool = False
    meshed = True  # elements are chosen, or asked for

    def __post_init__(self) -> None:
        from fembeam.structures.frame_checks import check_frame, checked_nodes

        make_native(self)
        object.__setattr__(self, "nodes", checked_nodes(self.nodes))
        listed = isinstance(self.members, Iterable) and not isinstance(self.members, (str, Mapping))
        require(listed, "members must be a list", self.members, "Frame", "give [Member(a, b, section), …]")
        object.__setattr__(self, "members", tuple(self.members))
        require_finite("spin", self.spin, "Frame", "give rad/s")
        require_switch("bending_only", self.bending_only, "Frame")
        check_frame(self)

    @classmethod
    def polyline(cls, nodes: Mapping[str, Sequence[float]], section: Section, **options: Any) -> Frame:
        """Nodes joined in turn by members of one section; `options` are those of every `Member`, such as `up`.

        >>> Frame.polyline({"A": (0, 0), "B": (1, 0), "C": (1, 2)}, Section.circle(2e11, 7800.0, 0.02)).members[1].name
        'B-C'
        """
        from fembeam.structures.frame_checks import checked_nodes

        return cls(nodes, [Member(a, b, section, **options) for a, b in pairwise(checked_nodes(nodes))])

    @classmethod
    def straight(cls, length: float, section: Section, spin: float = 0.0, bending_only: bool = False) -> Frame:
        """One member along the z axis in space, from "A" at z = 0 to "B"; its height lies along y.

        >>> Frame.straight(0.5, Section.circle(2.1e11, 7850.0, 0.04), bending_only=True).components
        ('x', 'y', 'rx', 'ry')
        """
        require_positive("length", length, "Frame.straight", "give the length in m")
        ends = {"A": (0.0, 0.0, 0.0), "B": (0.0, 0.0, float(length))}
        return cls(ends, [Member("A", "B", section)], spin, bending_only)

    @classmethod
    def from_mesh(
        cls,
        path: str | os.PathLike[str],
        sections: Section | Mapping[Any, Section],
        data: str | None = None,
        up: Any = None,
        plane: bool | None = None,
        **options: Any,
    ) -> Frame:
        """A frame from a file of line elements, by all that meshio reads; groups of lines become members.

        Parameters
        ----------
        path : the file.
        sections : a Section, or one for every name of a group (physical group, element set) or number in the cell
            data.
        data : name of the cell data that number the sections, where a file has several.
        up : that of all members, or {group: direction}; see `Member`.
        plane : whether to make a plane frame of x and y; None: where z is 0 everywhere, but for `bending_only`.
        options : `bending_only` and `spin` of the frame.

        Returns
        -------
        Frame : a straight chain of lines of one group is one member, "group" where it is the only one of its group,
            else "group 1", "group 2", …; nodes go by the names of node sets and groups of points, else "n" and their
            number in the file, from 0. A member runs as the first of its lines. A straight frame runs as its lines do,
            whatever their order, or where they run both ways from its lower end in its longest direction: that way z
            is counted, and the spin turns.

        Raises
        ------
        ValueError : the file cannot be read, has no lines or other elements, a group without section, or lines of both
            ways in a member with I12.
        """
        from fembeam.structures.frame_files import frame_of

        return frame_of(path, sections, data, up, plane, options)

    @property
    def in_plane(self) -> bool:
        """Whether its nodes have two coordinates."""
        return len(next(iter(self.nodes.values()))) == 2

    @property
    def components(self) -> tuple[str, ...]:
        """How every place moves."""
        return PLANE if self.in_plane else BENDING if self.bending_only else COMPONENTS

    def components_at(self, place: Any) -> tuple[str, ...]:
        """How one place moves: the same everywhere."""
        self.check_place(place, "components_at")
        return self.components

    @cached_property
    def points(self) -> dict[str, Vector]:
        """{node: (3,)} in m."""
        return {name: np.array([*at, *(3 - len(at)) * [0.0]], dtype=float) for name, at in self.nodes.items()}

    @cached_property
    def size(self) -> float:
        """Diagonal of the box around the nodes, m."""
        return float(np.linalg.norm(np.ptp(np.array(list(self.points.values())), axis=0)))

    @cached_property
    def starts(self) -> Vector:
        """(m, 3): the first end of every member, m."""
        return np.array([self.points[one.a] + one.offset[0] for one in self.members])

    @cached_property
    def spans(self) -> Vector:
        """(m, 3): from the first end of every member to the second, m."""
        return np.array([self.points[one.b] + one.offset[1] for one in self.members]) - self.starts

    @cached_property
    def lengths(self) -> Vector:
        """(m,) of the members, m."""
        return np.linalg.norm(self.spans, axis=1)

    @cached_property
    def numbers(self) -> dict[str, int]:
        """{name: number} of the members."""
        return {one.name: number for number, one in enumerate(self.members)}

    @cached_property
    def axes(self) -> Vector:
        """(m, 3, 3): unit vectors across, up and along of every member."""
        along = self.spans / self.lengths[:, None]
        return np.array([axes_of(one, t, self.in_plane) for one, t in zip(self.members, along, strict=True)])

    @cached_property
    def axis(self) -> Vector | None:
        """Unit vector (3,) of a straight frame, from its first node on; None for any other."""
        points = np.array(list(self.points.values()))
        away = points - points[0]
        axis = away[np.argmax(np.linalg.norm(away, axis=1))] / np.linalg.norm(away, axis=1).max()
        off = [np.linalg.norm(away - np.outer(away @ axis, axis), axis=1).max()]
        off += [np.linalg.norm(np.cross(start - points[0], axis)) for start in self.starts]
        return axis if max(off) <= SAME_PLACE * self.size else None

    @property
    def edges(self) -> list[tuple[Any, Any]]:
        """Pairs of places along the members, which figures join: enough of them for a smooth curve."""
        steps = max(MOST_DRAWN // len(self.members), 2) if len(self.members) > MOST_DRAWN // DRAWN else DRAWN
        pairs = zip(self.members, self.lengths, strict=True)
        chains = [[(one.name, float(s)) for s in np.linspace(0.0, length, steps + 1)] for one, length in pairs]
        return [pair for chain in chains for pair in pairwise(chain)]

    def places(self) -> list[Any]:
        """Names of the nodes."""
        return list(self.nodes)

    def check_place(self, place: Any, where: str) -> None:
        """Raise ValueError unless the place exists; the message names the nearest."""
        self.site(place, where)

    def site(self, place: Any, where: str) -> Site:
        """The node a place is, or the member and the distance from its first end."""
        if isinstance(place, str):
            inside = place in self.numbers
            advice = f"write ({place!r}, s) for a place s along the member" if inside else "use one of the names"
            _require_name("be a node", place, self.nodes, where, advice)
            return place
        if is_pair(place) and isinstance(place[0], str):
            return self._inside(place[0], place[1], where)
        require(is_finite(place), "a place must be the name of a node, or (member, distance in m)", place, where,
                f"write {next(iter(self.nodes))!r}, or ({self.members[0].name!r}, 0.0)")  # fmt: skip
        return self._on_axis(place, where)

    def _inside(self, name: str, s: Any, where: str) -> Site:
        """A place along a member."""
        _require_name("lie on a member", name, self.numbers, where, "use one of the names")
        index = self.numbers[name]
        length = float(self.lengths[index])
        close = SAME_PLACE * length
        inside = is_finite(s) and -close <= s <= length + close
        require(inside, f"the distance along member {name!r} must lie within 0 to {length:g} m", s, where,
                "move it" + in_mm(s, length))  # fmt: skip
        return index, float(np.clip(s, 0.0, length))

    def _on_axis(self, z: float, where: str) -> Site:
        """A place along a straight frame."""
        first, axis = next(iter(self.nodes)), self.axis
        if axis is None:
            near = f"; {nearest(z, list(self.nodes))}" if is_whole(z) else ""
            rule = f"a place must be a name, or (member, distance), for the frame is not straight{near}"
            raise ValueError(f"{rule}, got {z} in {where}; write {first!r}, or ({self.members[0].name!r}, 0.0)")
        at = {name: float((point - self.points[first]) @ axis) for name, point in self.points.items()}
        for name, other in at.items():
            if abs(z - other) <= SAME_PLACE * self.size:
                return name
        for index, start in enumerate(self.starts):
            s = (z - float((start - self.points[first]) @ axis)) * np.sign(self.spans[index] @ axis)
            if 0 <= s <= self.lengths[index]:
                return index, float(s)
        least, most = min(at.values()), max(at.values())
        named = f", or write {str(z)!r}, the node" if str(z) in self.nodes else in_mm(z, most)
        raise ValueError(f"z must lie on the frame, {least:g} to {most:g} m, got {z} in {where}; move it{named}")

    def check_held(self, held: Mapping[Any, Collection[Any]], where: str) -> None:
        """Raise ValueError where releases free a node: `held` are its components that supports or inertia hold."""
        from fembeam.structures.frame_checks import check_held

        check_held(self, held, where)

    def position(self, place: Any) -> Vector:
        """Where a place is (3,), m."""
        site = self.site(place, "position")
        if isinstance(site, str):
            return self.points[site].copy()
        return self.starts[site[0]] + site[1] * self.axes[site[0], 2]

    def lines(self) -> list[Vector]:
        """The members as (2, 3) arrays, m."""
        return [np.array([start, start + span]) for start, span in zip(self.starts, self.spans, strict=True)]

    def turned(self, rotation: Sequence[float]) -> Frame:
        """The same frame turned about the origin, its sections with it.

        Parameters
        ----------
        rotation : (3,) rad, a rotation vector: about its direction by its length. A plane frame turns about z.

        Raises
        ------
        ValueError : numbers that are none; a plane frame out of its plane; releases about global axes that turn.

        Examples
        --------
        >>> leg = Frame.polyline({"A": (0, 0), "B": (1, 0)}, Section.rectangle(2e11, 7800.0, 0.01, 0.02))
        >>> leg.turned((0, 0, np.pi / 2)).nodes["B"]
        (0.0, 1.0)
        """
        from fembeam.structures.turning import turned_frame

        return turned_frame(self, rotation)

    def reduced(self, nodes: Sequence[str], modes: int, elements: int | None = None) -> Structure:
        """The frame as a superelement on some of its nodes, by Craig and Bampton; see `Structure.reduced`.

        Parameters
        ----------
        nodes : where joints, supports, loads and stops will be. modes : of the frame with these held.
        elements : of its mesh; None: as few as make these modes right to 1e-6.

        Examples
        --------
        >>> beam = Frame.straight(1.0, Section.circle(2e11, 7800.0, 0.02))
        >>> [node for node, component in beam.reduced(["A", "B"], modes=2).labels if component in ("x", "mode")]
        ['A', 'B', 'mode 1', 'mode 2']
        """
        from fembeam.structures.superelement import interface_of, reduced

        listed = interface_of(nodes, "Frame.reduced")
        made = self.assembled(elements, max(int(modes), 1) if is_finite(modes) else None, tuple(listed))
        return reduced(self, made, listed, modes, "Frame.reduced")

    def assembled(
        self,
        elements: int | None = None,
        modes: int | None = None,
        places: Sequence[Any] = (),
        omega: float | None = None,
    ) -> FrameMatrices:
        """M, K and the like, without supports, on a mesh with a node at every place.

        Parameters
        ----------
        elements : how many, at least one between neighbouring places; None: as few as make the lowest frequencies right
            to 1e-6 relative, by the wavelengths of bending, stretch and twist: (γ h)⁴/1440 ≤ 0.65e-6.
        modes : how many frequencies that shall hold for, whatever holds the frame at `places`; None: 10.
        places : that shall be nodes, those of supports first. One closer than 1e-4 of a member's length
            to another is interpolated inside its element instead, for rounding.
        omega : rad/s: the highest frequency kept, where it is known: fewer elements than whatever may hold it needs.

        Returns
        -------
        FrameMatrices : with rows for every place on the frame, and section forces.

        Raises
        ------
        ValueError : a place off the frame, counts that are none, more than 10 000 elements, or 300 modes without them.
        """
        from fembeam.structures.frame_mesh import assemble

        return assemble(self, elements, modes, places, omega)

    def coarse(self, modes: int, places: Sequence[Any] = ()) -> FrameMatrices:
        """The same on few elements, to find out with supports which `omega` the mesh has to resolve."""
        from fembeam.structures.frame_mesh import coarse

        return coarse(self, modes, places)


def _require_name(what: str, name: str, names: Collection[str], where: str, advice: str) -> None:
    """Raise ValueError, with the nearest name, unless a place is one of these."""
    close = "" if name in names else nearest(name, list(names))
    require(name in names, f"a place must {what} of the frame; {close}", name, where, advice)
