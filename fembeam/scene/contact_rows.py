"""Who touches whom in a scene: contacts and loads as rows on all dofs, beams, bodies and impactors alike.

δ = -w·u - gap, and the contact pushes with +w F:  w = ±(row of one body - row of the other)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from scipy import sparse

from fembeam.excitation import Harmonic

if TYPE_CHECKING:
    from fembeam.scene.assembly import Matrices
    from fembeam.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class ContactRow:
    """One contact of a scene.

    Attributes
    ----------
    row : w (1, N) sparse, on all free dofs.
    law, gap : as in `Stop`.
    push : +1 when it pushes its beam up, -1 down.
    body, z : the beam it pushes (0 the scene's own) and where.
    on : ("frame", 0), ("body", b) or ("impactor", i): what it pushes from.
    """

    row: sparse.csr_matrix
    law: Any
    gap: float
    push: float
    body: int
    z: float
    on: tuple[str, int]


def contact_rows(scene: Scene, matrices: Matrices) -> list[ContactRow]:
    """All contacts in the order of the log: for each beam its stops, then its impactors."""
    return list(_contact_rows(scene, matrices))


def _contact_rows(scene: Scene, matrices: Matrices) -> Iterator[ContactRow]:
    """The same, one by one."""
    count = 0
    for body, part in enumerate((scene, *scene.bodies)):
        for stop in part.stops:
            row = stop.push * matrices.interpolation(stop.z, body=body)
            on = ("frame", 0)
            if stop.on is not None:
                on = ("body", stop.on[0])
                row = row - stop.push * matrices.interpolation(stop.on[1], body=stop.on[0])
            yield ContactRow(row, stop.law, stop.gap, stop.push, body, stop.z, on)
        for impactor in part.impactors:
            row = matrices.interpolation(impactor.z, body=body) - matrices.striker(count)
            for push in impactor.pushes:
                yield ContactRow(push * row, impactor.law, impactor.gap, push, body, impactor.z, ("impactor", count))
            count += 1


def loads(scene: Scene, matrices: Matrices) -> list[tuple[sparse.csr_matrix, Any]]:
    """(row (1, N), signal) of every point force, moment and moving foot."""
    from fembeam.scene.parts import PointMoment

    rows = []
    for body, part in enumerate((scene, *scene.bodies)):
        for force in part.forces:
            derivative = int(isinstance(force, PointMoment))
            rows.append((matrices.interpolation(force.z, derivative, body), force.signal))
        for spring in part.springs:
            if spring.foot is not None:
                rows.append((spring.stiffness * matrices.interpolation(spring.z, body=body), spring.foot))
    return rows


def weight(scene: Scene) -> Harmonic:
    """The constant signal g, to go with -M r."""
    return Harmonic(scene.gravity, 0.0)


def watched(scene: Scene, body: int) -> float | None:
    """Where the modes of a beam shall be positive: at its first stop or impactor, or where another beam meets it."""
    part = (scene, *scene.bodies)[body]
    places = [stop.z for stop in part.stops] + [impactor.z for impactor in part.impactors]
    places += [stop.on[1] for stop in scene.stops if stop.on is not None and stop.on[0] == body]
    return places[0] if places else None


def loaded(scene: Scene, body: int) -> list[tuple[float, int]]:
    """Where a point load acts on a beam: (z, 0) for forces, (z, 1) for moments, of stops, loads, dashpots, strikers."""
    from fembeam.scene.parts import PointMoment

    part = (scene, *scene.bodies)[body]
    places = [(stop.z, 0) for stop in part.stops]
    places += [(force.z, int(isinstance(force, PointMoment))) for force in part.forces]
    places += [(spring.z, 0) for spring in part.springs if spring.foot is not None]
    places += [(dashpot.z, 0) for dashpot in part.dashpots if dashpot.damping]
    places += [(dashpot.z, 1) for dashpot in part.dashpots if dashpot.rotational]
    places += [(impactor.z, 0) for impactor in part.impactors]
    return places + [(stop.on[1], 0) for stop in scene.stops if stop.on is not None and stop.on[0] == body]


def heights(scene: Scene) -> tuple[list[float], list[float]]:
    """Where the undeflected bodies lie over the scene's own beam, m, so that gaps are seen: beams, impactors."""
    beams = [0.0] * (1 + len(scene.bodies))
    for stop in reversed(scene.stops):
        if stop.on is not None:
            beams[stop.on[0]] = -stop.push * stop.gap
    strikers = [
        beams[body] - (impactor.pushes[0] * impactor.gap if len(impactor.pushes) == 1 else 0.0)
        for body, part in enumerate((scene, *scene.bodies))
        for impactor in part.impactors
    ]
    return beams, strikers
