"""Bodies turned about the origin: frames by their nodes, structures by their dofs, u = Bᵀ u_turned."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial.transform import Rotation

from fembeam.structures.assembled import COMPONENTS
from fembeam.support import is_finite, require

if TYPE_CHECKING:
    from fembeam.structures.frame import Frame
    from fembeam.structures.structure import Structure

Vector = NDArray[np.float64]
CLOSE = 1e-14  # entries of a rotation matrix that are 0 or 1 but for rounding
SAME = 1e-12  # an axis that a rotation leaves where it is


def matrix_of(rotation: Any, where: str) -> Vector:
    """(3, 3) of a rotation vector in rad."""
    right = isinstance(rotation, (Sequence, np.ndarray)) and len(rotation) == 3 and all(is_finite(x) for x in rotation)
    require(right, "rotation must be three finite numbers", rotation, where, "write (0, 0, pi / 2), rad about the axes")
    R = np.asarray(Rotation.from_rotvec(np.asarray(rotation, dtype=float)).as_matrix())
    whole = np.round(R)
    return np.where(np.abs(R - whole) < CLOSE, whole, R)


def turned_frame(frame: Frame, rotation: Any) -> Frame:
    """`Frame.turned` explains it."""
    R = matrix_of(rotation, "Frame.turned")
    flat = frame.in_plane or frame.bending_only
    require(not flat or abs(R[2, 2] - 1.0) < SAME, "a plane frame, or one of bending_only, must turn about z", rotation,
            "Frame.turned", "give it in space")  # fmt: skip
    size = 2 if frame.in_plane else 3
    nodes = {name: tuple(float(x) for x in (R @ at)[:size]) for name, at in frame.points.items()}
    members = []
    for one, axes in zip(frame.members, frame.axes, strict=True):
        words = [word for release in one.release for word in release.split()[1:] if word in COMPONENTS]
        moved = [word for word in words if abs(R[i := COMPONENTS.index(word) % 3, i] - 1.0) > SAME]
        require(not moved, f"releases of member {one.name!r} must be about its own axes to be turned", one.release,
                "Frame.turned", "write 'end up', 'end across' or 'end along'")  # fmt: skip
        up = None if one.up is None and frame.in_plane else tuple(float(x) for x in R @ axes[1])
        arms = tuple(tuple(float(x) for x in (R @ np.array(arm))) for arm in one.offset)
        members.append(replace(one, up=up, offset=arms))
    return replace(frame, nodes=nodes, members=members)


def turned_structure(body: Structure, rotation: Any) -> Structure:
    """`Structure.turned` explains it."""
    from fembeam.structures.structure import Structure

    R = matrix_of(rotation, "Structure.turned")
    B = _of_dofs(body, R)
    K, M = B @ body.K @ B.T, B @ body.M @ B.T
    C = None if body.C is None else B @ body.C @ B.T
    nodes = {node: R @ at for node, at in body.nodes.items()}
    found = Structure(K, M, C, body.labels, nodes, body.points, body.edges)
    along = [i for i, name in enumerate(COMPONENTS[:3]) if name in body.components]
    moved = None if body.moved is None else np.asarray(B @ body.moved @ R[np.ix_(along, along)].T)
    return found.knowing(None if body.root is None else body.root @ B.T, moved)


def _of_dofs(body: Structure, R: Vector) -> sparse.csr_matrix:
    """B (N, N), block by block, of all nodes; u_turned = B u."""
    B = sparse.lil_matrix((len(body.labels), len(body.labels)))
    for i, (node, component) in enumerate(body.labels):
        if component not in COMPONENTS:
            B[i, i] = 1.0
            continue
        kind, axis = divmod(COMPONENTS.index(component), 3)
        for other, part in enumerate(R[:, axis]):  # a unit motion along the axis, turned
            name = COMPONENTS[3 * kind + other]
            known = name in body.dofs[node]
            have = ", ".join(body.dofs[node])
            require(known or part == 0.0, f"node {node!r} must have the dofs that its motion turns into; it has {have}",
                    name, "Structure.turned", "turn it about another axis")  # fmt: skip
            if known and part != 0.0:
                B[body.dofs[node][name], i] = part
    return B.tocsr()
