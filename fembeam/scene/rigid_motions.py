"""Rigid-body motions u = a + b z of a scene's beams, and which beams their loads may carry away by them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fembeam.scene.places import scene_words
from fembeam.scene.signals import signals_of

if TYPE_CHECKING:
    from fembeam.scene.assembly import Matrices
    from fembeam.scene.scene import Scene

Vector = NDArray[np.float64]

MOST_RIGID = 6  # of one body


def rigid_body_modes(scene: Scene, turning: bool = True) -> int:
    """How many of the motions u = a + b z nothing resists, of supports, springs, foundation, tension: 0, 1 or 2.

    Without `turning` the slope is held as well.
    """
    if scene.named:
        from fembeam.scene.assembly import assemble

        return int(rigid_shapes(assemble(scene, None, None, ())).shape[1])
    rows = [row for s in scene.supports for row, fixed in zip(_rigid_rows(s.z), s.fixed, strict=True) if fixed]
    for spring in scene.springs:
        translation, rotation = _rigid_rows(spring.z)
        rows += [translation] * bool(spring.stiffness > 0) + [rotation] * bool(spring.rotational > 0)
    rows += [(1.0, 0.0), (0.0, 1.0)] * bool(scene.beam.foundation > 0)
    rows += [(0.0, 1.0)] * bool(scene.beam.axial_force != 0)
    rows += [] if turning else [(0.0, 1.0)]
    scaled = np.array([*rows, (0.0, 0.0)]) / (1.0, scene.beam.length)
    return 2 - int(np.linalg.matrix_rank(scaled, tol=1e-9))


def rigid_shapes(matrices: Matrices, most: int = MOST_RIGID) -> Vector:
    """Modes of frequency 0 (N, r) on the free dofs: `most` of one body, more where hinges let several move."""
    import reduction

    count = min(most, matrices.M.shape[0])
    lowest = reduction.modal_basis(matrices.M, matrices.K, count, root=matrices.root)
    if count == most and not np.any(lowest.omega):
        return rigid_shapes(matrices, 2 * most)
    return np.asarray(lowest.vectors[:, lowest.omega == 0.0])


def drifting(scene: Scene) -> list[str]:
    """What to warn of: beams with rigid-body modes that are loaded and that no stops hold."""
    found = []
    for index, beam in enumerate((scene, *scene.bodies)):
        own = [path for path in signals_of(beam) if not path.startswith("bodies")]
        loaded = bool(own) or scene.base is not None or scene.gravity != 0.0
        if beam.named:
            continue  # known when its matrices are: see `fembeam.model.reduce`
        if loaded and not _held(scene, index) and (count := rigid_body_modes(beam)):
            found.append(carried_away(count, index, "beam"))
    return found


def carried_away(modes: int, body: int, kind: str) -> str:
    """The warning of so many rigid-body modes of a beam or structure that is loaded."""
    what = "1 rigid-body mode appears" if modes == 1 else f"{modes} rigid-body modes appear"
    return f"{what} in {scene_words(body)}: supports and springs do not hold the {kind}, its loads may carry it away"


def _held(scene: Scene, index: int) -> bool:
    """Whether stops or elements hold a beam (0 the scene's own) from both sides, or stops against gravity.

    Those of rotation hold one that is supported somewhere.
    """
    beam = scene.bodies[index - 1] if index else scene
    pushes, turns = _sides(beam, rotation=False), _sides(beam, rotation=True)
    if index:
        pushes |= {-side for side in _sides(scene, rotation=False, to=index)}
    lies = scene.gravity != 0.0
    if len(pushes) == 2 or (lies and np.sign(scene.gravity) in pushes):
        return True
    return (len(turns) == 2 or (lies and bool(turns))) and rigid_body_modes(beam, turning=False) == 0


def _sides(scene: Scene, rotation: bool, to: int | None = None) -> set[float]:
    """From which sides stops and elements of a beam hold it, or those that lead `to` another hold that."""
    found: set[float] = set()
    for part in scene.acting:
        place = part.coordinate
        leads = None if place.to is None else place.to[0]
        if part.push and place.rotation == rotation and leads != 0 and to in (None, leads):
            found |= {part.push, -part.push} if part.always else {part.push}
    return found


def _rigid_rows(z: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Rows u and u_z at z of the rigid motions (1, z)."""
    return (1.0, z), (0.0, 1.0)
