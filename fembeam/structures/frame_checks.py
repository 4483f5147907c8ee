"""What a frame must be before anything is computed: each check one sentence with names."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse
from scipy.sparse.csgraph import connected_components

from fembeam.beams import SAME_PLACE
from fembeam.structures.assembled import COMPONENTS
from fembeam.structures.directions import nearest
from fembeam.structures.members import ALIGNED, Member, release_axes
from fembeam.support import is_finite, require

if TYPE_CHECKING:
    from fembeam.structures.frame import Frame

Vector = NDArray[np.float64]
ROUND = 1e-9  # relative difference of I and I2 of a round section


def checked_nodes(nodes: Any) -> dict[str, tuple[float, ...]]:
    """Names and coordinates, all of two or all of three finite numbers."""
    require(isinstance(nodes, Mapping) and len(nodes) > 1, "nodes must be two or more by name", nodes, "Frame",
            "write {'A': (0, 0, 0), 'B': (1, 0, 0)}")  # fmt: skip
    found = {}
    for name, at in nodes.items():
        require(isinstance(name, str) and bool(name), "the name of a node must be text", name, "Frame", "write 'A'")
        listed = list(at) if isinstance(at, (Sequence, np.ndarray)) and not isinstance(at, str) else []
        right = len(listed) in (2, 3) and all(is_finite(x) for x in listed)
        require(right, f"node {name!r} must have two or three finite coordinates", at, "Frame", "give m")
        found[name] = tuple(float(x) for x in listed)
    counts = {len(at) for at in found.values()}
    other = next((name for name, at in found.items() if len(at) != len(next(iter(found.values())))), None)
    require(len(counts) == 1, f"nodes must have two coordinates each, or three each; node {other!r} differs",
            found.get(other or ""), "Frame", "add z = 0, or leave it out everywhere")  # fmt: skip
    return found


def check_frame(frame: Frame) -> None:
    """All checks, nodes first."""
    require(len(frame.members) > 0, "members must not be empty", frame.members, "Frame", "join the nodes")
    for one in frame.members:
        if not isinstance(one, Member):
            raise TypeError(f"members must be a list of Member, got {one!r} in Frame; write Member('A', 'B', section)")
    _apart(frame)
    _joined(frame)
    _long(frame)
    _connected(frame)
    _in_space(frame)
    _ = frame.axes  # checks `up`
    for member in range(len(frame.members)):
        _carries(frame, member)
    _spinning(frame)


def _apart(frame: Frame) -> None:
    """No two nodes at one place."""
    from scipy.spatial import cKDTree

    names, points = list(frame.points), np.array(list(frame.points.values()))
    require(frame.size > 0, "nodes must not all be at one place", names, "Frame", "check the coordinates")
    for first, second in sorted(cKDTree(points).query_pairs(SAME_PLACE * frame.size)):
        raise ValueError(f"nodes must be apart, got {names[first]!r} and {names[second]!r} at one place, "
                         f"{tuple(float(x) for x in points[first])} m, in Frame; make them one node")  # fmt: skip


def _joined(frame: Frame) -> None:
    """Members join nodes that exist, under names of their own."""
    seen: set[str] = set()
    for one in frame.members:
        for end in (one.a, one.b):
            close = "" if end in frame.nodes else nearest(end, list(frame.nodes))
            require(end in frame.nodes, f"member {one.name!r} must join nodes of the frame; {close}", end, "Frame",
                    "use that, or add the node")  # fmt: skip
        require(one.name not in seen and one.name not in frame.nodes,
                "names of members must differ from each other and from those of nodes", one.name, "Frame",
                "give Member(..., name=)")  # fmt: skip
        seen.add(one.name)


def _long(frame: Frame) -> None:
    """Every member has a length; in the plane and along z arms do not leave the frame."""
    for one, length in zip(frame.members, frame.lengths, strict=True):
        require(bool(length > SAME_PLACE * frame.size), f"member {one.name!r} must have a length, its ends are at one "
                "place", float(length), "Frame", "check its offsets")  # fmt: skip
        flat = not frame.in_plane or all(arm[2] == 0 for arm in one.offset)
        require(flat, f"offsets of member {one.name!r} must lie in the frame's plane", one.offset, "Frame", "drop z")


def _connected(frame: Frame) -> None:
    """One part; two are two frames."""
    names = list(frame.nodes)
    ends = np.array([[names.index(one.a), names.index(one.b)] for one in frame.members])
    graph = sparse.coo_matrix((np.ones(len(ends)), ends.T), shape=(len(names), len(names)))
    count, part = connected_components(graph, directed=False)
    loose = [name for name, which in zip(names, part, strict=True) if which != part[0]]
    require(count == 1, f"all nodes must be connected by members; {names[0]!r} and {', '.join(map(repr, loose[:3]))} "
            "move apart", f"{count} parts", "Frame", "join them, or make each part a frame of its own")  # fmt: skip


def _in_space(frame: Frame) -> None:
    """Sections know what they need; bending_only is for frames along z."""
    along_z = not np.any(np.abs(frame.spans[:, :2]) > ALIGNED * frame.size)
    require(not frame.bending_only or (along_z and not frame.in_plane), "bending_only is for frames along the z axis",
            list(frame.nodes.items())[:2], "Frame", "leave it out, or turn the frame")  # fmt: skip
    needed = () if frame.in_plane else ("I2",) if frame.bending_only else ("I2", "J")
    for one in frame.members:
        missing = [name for name in needed if getattr(one.section, name) is None]
        require(not missing, f"the section of member {one.name!r} must know {' and '.join(missing)} in space",
                one.section, "Frame", f"give Section(..., {', '.join(f'{name}=' for name in missing)}), or use "
                "Section.rectangle, circle or tube")  # fmt: skip
        foreign = [text for _, text, _ in release_axes(one, np.eye(3)) if not _moves(frame, text)]
        require(not foreign, f"releases of member {one.name!r} must be among {', '.join(frame.components)}", foreign,
                "Frame", "release what the frame carries")  # fmt: skip


def _moves(frame: Frame, text: str) -> bool:
    """Whether a release is of a motion that the frame has: in the plane none about axes of the member."""
    if text.split()[1] in COMPONENTS:
        return text.split()[1] in frame.components
    return not frame.in_plane and not (frame.bending_only and text.endswith("along"))


def arm_matrix(arm: Sequence[float] | Vector) -> Vector:
    """(6, 6): displacement and rotation of the end of a rigid arm, from those of its root: u + θ × a."""
    x, y, z = arm
    T = np.eye(6)
    T[:3, 3:] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
    return T


def _kept(frame: Frame, member: int, end: int) -> Vector:
    """(6, 6) projector on what an end of a member carries to its node."""
    one = frame.members[member]
    free = [motion for which, _, motion in release_axes(one, frame.axes[member]) if which == end]
    return np.eye(6) - (np.linalg.pinv(np.array(free)) @ np.array(free) if free else 0.0)


def _free_motion(frame: Frame, carried: list[Vector]) -> str | None:
    """The first motion that nothing carries, in words; None if everything is."""
    return _unheld(_own_columns(frame, carried), frame.components)


def _own_columns(frame: Frame, rows: list[Vector]) -> Vector:
    """Rows (…, 6) for the components that a frame has alone."""
    return np.vstack(rows)[:, [COMPONENTS.index(name) for name in frame.components]]


def _unheld(rows: Vector, names: Sequence[str]) -> str | None:
    """What moves most in the first motion that all rows leave at zero; None if there is none."""
    _, size, directions = np.linalg.svd(rows)
    return None if size[-1] > ALIGNED else names[int(np.argmax(np.abs(directions[-1])))]


def check_held(frame: Frame, held: Mapping[Any, Collection[Any]], where: str) -> None:
    """Raise ValueError if releases leave a node free: `held` are the components that supports or inertia there hold."""
    at: dict[Any, list[str]] = {}
    for place, components in held.items():
        at.setdefault(frame.site(place, where), []).extend(components)
    for node in dict.fromkeys(end for one in frame.members if one.release for end in (one.a, one.b)):
        free = _free_motion(frame, carried(frame, node, at.get(node, ())))
        require_held(free, node, [frame.members[i].name for i, _ in _ends(frame, node)], where)


def check_joined(ends: Sequence[tuple[Frame, str, Collection[str]]], dofs: Sequence[str], where: str) -> None:
    """Raise ValueError if releases leave two nodes free that a joint makes one; each with what else holds it."""
    own = linalg.block_diag(*(_own_columns(frame, carried(frame, node, held)) for frame, node, held in ends))
    same = np.eye(6)[[COMPONENTS.index(name) for name in dofs]]
    equal = np.hstack(
        [sign * _own_columns(frame, [same]) for sign, (frame, _, _) in zip((1.0, -1.0), ends, strict=True)]
    )
    free = _unheld(np.vstack([own, equal]), [name for frame, _, _ in ends for name in frame.components])
    members = [frame.members[i].name for frame, node, _ in ends for i, _ in _ends(frame, node)]
    require_held(free, ends[0][1], members, where)


def require_held(free: str | None, node: str, members: list[str], where: str) -> None:
    """Raise ValueError where a node is free to move along a component."""
    require(free is None, f"releases must not free a node; {node!r} moves along {free!r}, with no inertia", members,
            where, "leave one of these members unreleased there, or give the node a support or inertia")  # fmt: skip


def _ends(frame: Frame, node: str) -> list[tuple[int, int]]:
    """Number of the member, and 0 or 1, of all ends at a node."""
    return [(i, end) for i, one in enumerate(frame.members) for end in range(2) if node == (one.a, one.b)[end]]


def carried(frame: Frame, node: str, held: Collection[Any]) -> list[Vector]:
    """Rows (…, 6) of the motions of a node that its members carry, and of the components or rows `held` otherwise."""
    members = [_kept(frame, i, end) @ arm_matrix(frame.members[i].offset[end]) for i, end in _ends(frame, node)]
    rows = (np.eye(6)[COMPONENTS.index(one)] if isinstance(one, str) else one for one in held)
    return [*members, *(row[None] for row in rows)]


def _carries(frame: Frame, member: int) -> None:
    """Releases leave no member free between its nodes."""
    one = frame.members[member]
    if one.release:
        ends = [arm_matrix(at) for at in (np.zeros(3), frame.axes[member, 2])]
        free = _free_motion(frame, [_kept(frame, member, end) @ ends[end] for end in range(2)])
        require(free is None, f"releases must not free a member; {one.name!r} moves along {free!r} between its nodes",
                one.release, "Frame", "release one end less")  # fmt: skip


def _spinning(frame: Frame) -> None:
    """Spin is of straight round shafts."""
    if frame.spin == 0:
        return
    require(frame.axis is not None and not frame.in_plane, "spin is for a straight shaft in space", frame.spin,
            "Frame", "use Frame.straight, or nodes on one line with three coordinates")  # fmt: skip
    for one in frame.members:
        own = one.section
        even = own.I2 is not None and abs(own.I - own.I2) <= ROUND * own.I and own.I12 == 0
        require(even, f"the section of member {one.name!r} must be round to spin", own, "Frame",
                "use Section.circle or tube, or equal I and I2")  # fmt: skip
