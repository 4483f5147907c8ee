"""Section forces of frames, alone or joined, as words for JSON and arrays: a saved run answers without its scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fembeam.beams import Section
from fembeam.structures import Frame, FrameForces, FrameMesh, JoinedForces, Member, located_among

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class SavedBodies:
    """The frames among joined bodies, by their numbers: what of them a file keeps."""

    frames: Mapping[int, Frame]

    def located(self, place: Any, where: str) -> tuple[int, Any]:
        """Number of the body that a place is on, and the place there."""
        return located_among(self.frames, place, where)


def frames_packed(forces: FrameForces | JoinedForces, body: int) -> tuple[dict[str, Any], dict[str, Vector]]:
    """Words, and arrays members_<body>_<number> (2, names, elements, 2, n): values and slopes at both ends."""
    each = forces.each if isinstance(forces, JoinedForces) else {0: forces}
    words = {str(number): _words(one) for number, one in each.items()}
    arrays = {
        f"members_{body}_{number}": np.array([[kind[name] for name in one.names] for kind in (one.ends, one.slopes)])
        for number, one in each.items()
    }
    return {"frames": words, "joined": isinstance(forces, JoinedForces)}, arrays


def frames_unpacked(words: Mapping[str, Any], arrays: Mapping[str, Any], body: int) -> FrameForces | JoinedForces:
    """The same of a file; ValueError where words and arrays contradict each other."""
    found = {int(n): _forces(one, arrays[f"members_{body}_{n}"]) for n, one in words["frames"].items()}
    if not words["joined"]:
        return found[0]
    frames = {number: forces.mesh.frame for number, forces in found.items()}
    return JoinedForces(SavedBodies(frames), found)


def _words(forces: FrameForces) -> dict[str, Any]:
    """The frame, the nodes of its mesh along the members, names of its section forces."""
    frame = forces.mesh.frame
    members = [asdict(one) | {"up": None if one.up is None else one.up[:3]} for one in frame.members]
    about = {"nodes": frame.nodes, "members": members, "spin": frame.spin, "bending_only": frame.bending_only}
    return {"frame": about, "borders": [s.tolist() for s in forces.mesh.borders], "names": forces.names}


def _forces(words: Mapping[str, Any], values: Vector) -> FrameForces:
    """Section forces of one frame."""
    about, names = dict(words["frame"]), list(words["names"])
    members = [Member(**{**one, "section": _section(one["section"])}) for one in about.pop("members")]
    mesh = FrameMesh(
        Frame(members=members, **about), tuple(np.array(s, dtype=float) for s in words["borders"]), (), None
    )
    if values.shape[:4] != (2, len(names), int(mesh.first[-1]), 2) or len(mesh.borders) != len(members):
        raise ValueError(f"section forces must be of {int(mesh.first[-1])} elements, they have shape {values.shape}")
    ends, slopes = (dict(zip(names, kind, strict=True)) for kind in values)
    return FrameForces(mesh, ends, slopes)


def _section(words: Mapping[str, Any]) -> Section:
    """A section; JSON has lists for tuples."""
    plain: dict[str, Any] = {n: tuple(value) if isinstance(value, list) else value for n, value in words.items()}
    return Section(**plain)
