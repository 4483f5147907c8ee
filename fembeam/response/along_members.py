"""Motion along the members of a frame whose run was read from a file, which keeps that of the nodes of the mesh.

Between two nodes it follows the shapes of the element: cubics across, straight lines of the displacement along the
member and of the twist. The parabolas that elements have besides are not in the file: along and about the member they
add (k h)²/8 of the motion, k the wave number of the mode in tension or torsion, h the length of the element.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fembeam.response.placed_shapes import PlacedShapes
from fembeam.structures import COMPONENTS, FrameForces, JoinedForces
from fembeam.support import is_finite, is_numbered, is_pair

Vector = NDArray[np.float64]


def known_along_members(shapes: Any, forces: Any) -> Any:
    """The shapes of a body read from a file, which know all of its members if it is or has a frame."""
    if isinstance(shapes, PlacedShapes) and isinstance(forces, (FrameForces, JoinedForces)):
        return replace(shapes, more=partial(_motion, shapes, forces))
    return shapes


def _motion(shapes: PlacedShapes, forces: FrameForces | JoinedForces, place: Any) -> Vector:
    """All components (c, n + k) of a place that is no node of the mesh; ValueError for one that does not exist."""
    number, own, frame = _on_frame(forces, place)
    if frame is None or frame.mesh.frame.components != shapes.components:
        return shapes.motion_with_supports(place)
    mesh, site = frame.mesh, frame.mesh.frame.site(own, "Run")
    if isinstance(site, str):
        return shapes.motion_with_supports((number, site) if number else site)
    member, s = site
    ahead = int(mesh.located(member, np.array([s]))[0][0]) - int(mesh.first[member])
    rows, first = mesh.along(member, np.array([s])), int(mesh.first[member]) + member
    columns, found = np.array([COMPONENTS.index(name) for name in shapes.components]), 0.0
    for point in (ahead, ahead + 1):
        node = mesh.frame.members[member].name, float(mesh.borders[member][point])
        found = found + rows[:, 6 * (first + point) + columns] @ shapes.motion_with_supports(
            (number, node) if number else node
        )
    return np.asarray(found)


def _on_frame(forces: FrameForces | JoinedForces, place: Any) -> tuple[int, Any, FrameForces | None]:
    """Number of the frame that a place is along, the place there, and the frame; None of what is along none."""
    own = place[1] if is_numbered(place) else place
    if not (is_pair(own) or is_finite(own)):
        return 0, own, None
    if isinstance(forces, FrameForces):
        return 0, own, forces
    if is_numbered(place):
        return int(place[0]), own, forces.each.get(int(place[0]))
    member = own[0] if is_pair(own) else None
    having = [n for n, one in forces.each.items() if member in {each.name for each in one.mesh.frame.members}]
    return (having[0], own, forces.each[having[0]]) if len(having) == 1 or 0 in having else (0, own, None)
