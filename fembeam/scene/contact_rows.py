"""Contacts and loads of a scene as rows on all dofs, of beams, bodies and impactors alike.

δ = -w·u - gap, and the contact pushes with +w F:  w = ±(row of one body - row of the other)

Elements, which always act, are contacts with w = -W. A circular clearance has two rows, the coordinates of its place:

d = W·u - centre, δ = |d| - c, and it pushes with -Wᵀ F d/|d|

With friction there is a further row: along the tangent t of a stop, of the rotation φ in a circular clearance.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fembeam.excitation import Harmonic
from fembeam.scene.annular_stop import AnnularStop
from fembeam.scene.element import force_both_ways
from fembeam.scene.local_coordinate import LocalCoordinate
from fembeam.scene.moving_loads import loads_of_dof
from fembeam.scene.places import opposite
from fembeam.scene.rubbing import Friction, spin_of, turning_row
from fembeam.scene.signals import support_motion

if TYPE_CHECKING:
    from fembeam.scene.assembly import Matrices
    from fembeam.scene.part import ScenePart
    from fembeam.scene.scene import Scene


Vector = NDArray[np.float64]

LINE = (0.0, 0.0, 0.0)  # no circle
ON = ("frame", "body", "impactor")  # what a contact pushes from


@dataclass(frozen=True, eq=False)
class ContactRow:
    """One contact of a scene, or one element.

    Attributes
    ----------
    row : w (1, N) sparse, on all free dofs; of a circular clearance W (2, N); of an oblique stop w and t (2, N); of a
        circular clearance with a radius a third row, of φ, zero where nothing turns.
    law, gap : as in `Stop`.
    push : +1 when it pushes its beam up, -1 down.
    body, z : the beam it pushes (0 the scene's own) and where.
    on : ("frame", 0), ("body", b) or ("impactor", i): what it pushes from.
    rotation : whether it acts on the slope: rad and N m. always : whether it acts at both signs of δ, an element.
    name : of the part, given or made; of an impactor on both sides with its side. given : whether it was given.
    direction : as given, of places by name; of a circular clearance both; of an impactor the way to it.
    circle : (radius, x, y) of a circular clearance, m: the radius negative where the place is outside; else zeros.
    friction : as given, or None. radius : R of the place's own surface, m, 0 without. spin : Ω there, rad/s.
    """

    row: sparse.csr_matrix
    law: Any
    gap: float
    push: float
    body: int
    z: Any
    on: tuple[str, int]
    rotation: bool = False
    always: bool = False
    name: str = ""
    given: bool = False
    direction: Any = None
    circle: tuple[float, float, float] = LINE
    friction: Friction | None = None
    radius: float = 0.0
    spin: float = 0.0

    @property
    def rub(self) -> tuple[float, float, float, float]:
        """μ, k_t in N/m, R in m (negative of an outer circle) and Ω in rad/s; zeros without friction."""
        if self.friction is None:
            return (0.0, 0.0, 0.0, 0.0)
        arm = -self.radius if self.circle[0] < 0.0 else self.radius
        return self.friction.mu, float(self.friction.stiffness or 0.0), arm, self.spin

    @property
    def acting(self) -> Any:
        """Its z, or (place, direction); both directions of a circular clearance."""
        return self.z if self.direction is None else (self.z, self.direction)

    @property
    def is_circle(self) -> bool:
        """Whether it is a circular clearance."""
        return self.circle[0] != 0.0

    @property
    def gaps(self) -> tuple[float, ...]:
        """Of each row: -row·u - gap is δ; of a circular clearance -d; of what friction adds 0."""
        own = (self.gap,) if not self.is_circle else (-self.circle[1], -self.circle[2])
        return (*own, *(self.row.shape[0] - len(own)) * (0.0,))

    @property
    def remembers(self) -> bool:
        """Whether its law has a memory: latched numbers that are renewed on borders."""
        return bool(getattr(self.law, "memory", ()))

    @property
    def latched(self) -> int:
        """How many numbers it latches: those of its law, code and place of the slider of friction."""
        return len(getattr(self.law, "memory", ())) + (0 if self.friction is None else 2)

    def key(self, number: int) -> str:
        """What files call it, which other places and gaps leave as it is: the given name, else one of its number."""
        return self.name if self.given else made_key(number, self.always, self.rotation)

    def force(self, delta: Any, rate: Any = 0.0, entry_rate: Any = 1.0) -> Any:
        """Force on arrays: of an element at both signs of δ, of others zero where δ <= 0."""
        if self.always:
            return force_both_ways(self.law, delta, rate)
        return self.law.force(delta, rate, entry_rate)


def made_key(number: int, always: bool, rotation: bool) -> str:
    """What files call a contact without a name: "stop 0", "element 2 (rotation)"."""
    return f"{'element' if always else 'stop'} {number}" + " (rotation)" * rotation


def keys_of(rows: Sequence[ContactRow]) -> tuple[str, ...]:
    """What files call these contacts, with "(2)" behind a made name that another one was given."""
    given = {row.name for row in rows if row.given}
    made = ((row, row.key(i)) for i, row in enumerate(rows))
    return tuple(key + " (2)" * (not row.given and key in given) for row, key in made)


def contact_rows(scene: Scene, matrices: Matrices) -> list[ContactRow]:
    """All contacts in the order of the log: for each beam its stops, then its elements, then its impactors."""
    rows = list(_contact_rows(scene, matrices))
    return [replace(row, name=name) for row, name in zip(rows, _distinct(rows), strict=True)]


def _contact_rows(scene: Scene, matrices: Matrices) -> Iterator[ContactRow]:
    """All contacts, not yet told apart by name."""
    count = 0
    for body, part in enumerate((scene, *scene.bodies)):
        for one in part.acting:
            place = one.coordinate
            on = ("frame", 0) if place.to is None else ("body", place.to[0] or body)
            if isinstance(one, AnnularStop):
                yield _circle(one, matrices, part.beam, body, on)
                continue
            row, name = one.push * place.row(matrices, body), _name(one, body)
            kind = place.rotation, one.always, *name, one.direction
            rub = getattr(one, "friction", None)
            if rub is not None:
                row = sparse.vstack([row, one.coordinates[1].row(matrices, body)], format="csr")
            yield ContactRow(row, one.law, one.gap, one.push, body, one.z, on, *kind, friction=rub)
        for impactor in part.impactors:
            row = impactor.coordinates[0].row(matrices, body) - matrices.impactor_row(count)
            label, given = _name(impactor, body)
            for push in impactor.pushes:
                side = {1.0: ", below", -1.0: ", above"}[push] if len(impactor.pushes) > 1 else ""
                facing = body, impactor.z, ("impactor", count)
                closes = opposite(impactor.direction) if push > 0.0 else impactor.direction
                said: Any = {"name": label + side, "given": given, "direction": closes}
                yield ContactRow(push * row, impactor.law, impactor.gap, push, *facing, **said)
            count += 1


def _circle(stop: AnnularStop, matrices: Matrices, beam: Any, body: int, on: tuple[str, int]) -> ContactRow:
    """One circular clearance."""
    rows = [place.row(matrices, body) for place in stop.coordinates]
    rub: dict[str, Any] = {"friction": stop.friction}
    if stop.radius is not None:
        turning = turning_row(stop, beam.components_at(stop.z))
        rows.append(0.0 * rows[0] if turning is None else turning.row(matrices, body))
        rub |= {"radius": float(stop.radius), "spin": spin_of(beam, stop)}
    circle = -stop.clearance if stop.outer else stop.clearance, *stop.centre
    numbered = not matrices.beams[body].beam.meshed  # a number is a node, not m
    kind = False, False, stop.label_on(body, numbered), stop.name is not None, stop.directions, circle
    all_rows = sparse.vstack(rows, format="csr")
    return ContactRow(all_rows, stop.law, stop.clearance, stop.push, body, stop.z, on, *kind, **rub)


def _name(part: ScenePart, body: int) -> tuple[str, bool]:
    """What a part of a beam is called, and whether the name was given."""
    return part.label_on(body), part.name is not None


def _distinct(rows: list[ContactRow]) -> list[str]:
    """Names of contacts; made ones that are taken already are numbered: "element at 0.3 m (2)"."""
    found: list[str] = []
    taken = {row.name for row in rows if row.given}
    for row in rows:
        name, number = row.name, 1
        while not row.given and name in taken:
            number += 1
            name = f"{row.name} ({number})"
        taken.add(name)
        found.append(name)
    return found


def loads(scene: Scene, matrices: Matrices) -> list[tuple[sparse.csr_matrix, Any]]:
    """(row (1, N), signal) of supports that move, three for each dof, then every point force, moment, moving foot."""
    rows = [row for row, _ in support_loads(scene, matrices)]
    for body, part in enumerate((scene, *scene.bodies)):
        rows += [force.coordinate.row(matrices, body) for force in part.forces]
        for spring in part.springs:
            if spring.foot is not None:
                at = LocalCoordinate(spring.z, direction=spring.along)
                rows.append(spring.stiffness * at.row(matrices, body))
    return list(zip(rows, load_signals(scene), strict=True))


def load_signals(scene: Scene) -> list[Any]:
    """The signals of `loads`, in their order."""
    parts = scene, *scene.bodies
    motions = [motion for part in parts for support in part.supports for motion in support_motion(support).values()]
    found = [signal for motion in motions for signal in _with_derivatives(motion)]
    for part in parts:
        found += [force.signal for force in part.forces]
        found += [spring.foot for spring in part.springs if spring.foot is not None]
    return found


def support_loads(scene: Scene, matrices: Matrices) -> list[tuple[sparse.csr_matrix, Any]]:
    """(row (1, N), signal) of displacement, speed and acceleration of every dof of supports that move."""
    rows = []
    for body, part in enumerate((scene, *scene.bodies)):
        motions = [motion for support in part.supports for motion in support_motion(support).values()]
        coupling: Any = matrices.beams[body].coupling
        for number, motion in enumerate(motions):
            pairs = zip(loads_of_dof(number), _with_derivatives(motion), strict=True)
            rows += [(matrices.among_all(coupling[i], body), signal) for i, signal in pairs]
    return rows


def _with_derivatives(motion: Any) -> tuple[Any, Any, Any]:
    """The signals of a dof's three loads: its displacement, speed and acceleration."""
    return motion, motion.derivative(1), motion.derivative(2)


def carried_on(scene: Scene, beam: Matrices, body: int) -> Vector:
    """(N_all, k): what each of the k dofs of supports that move, of all bodies, carries on the dofs of one."""
    counts = [sum(len(support_motion(s)) for s in part.supports) for part in (scene, *scene.bodies)]
    first, found = sum(counts[:body]), np.zeros((beam.spread.shape[0], sum(counts)))
    if beam.carried is not None:
        found[:, first : first + counts[body]] = beam.carried.toarray()
    return found


def weight(scene: Scene) -> dict[str, Harmonic]:
    """The constant signals g by direction, each to go with -M r."""
    return {direction: Harmonic(g, 0.0) for direction, g in scene.pulls.items()}


def watched(scene: Scene, body: int) -> LocalCoordinate | None:
    """Where the modes of a beam shall be positive: at its first stop, element, impactor, or where another meets it."""
    part = (scene, *scene.bodies)[body]
    places = [place for one in (*part.acting, *part.impactors) for place in one.coordinates]
    places += _from_the_first(scene, body)
    return replace(places[0], to=None) if places else None


def loaded(scene: Scene, body: int) -> list[LocalCoordinate]:
    """Where a force or moment acts on a beam, or a pair of them: of stops, elements, loads, dashpots, impactors."""
    part = (scene, *scene.bodies)[body]
    places = [own for one in part.acting for place in one.coordinates for own in place.on_body(body, body)]
    round_ones = [one for one in part.stops if isinstance(one, AnnularStop)]
    turning = [turning_row(one, part.beam.components_at(one.z)) for one in round_ones]
    places += [place for place in turning if place is not None]
    places += [force.coordinate for force in part.forces]
    feet = (spring for spring in part.springs if spring.foot is not None)
    places += [LocalCoordinate(spring.z, direction=spring.along) for spring in feet]
    places += [LocalCoordinate(d.z, direction=d.along) for d in part.dashpots if d.damping]
    places += [LocalCoordinate(dashpot.z, 1) for dashpot in part.dashpots if dashpot.rotational]
    places += [impactor.coordinates[0] for impactor in part.impactors]
    return places + _from_the_first(scene, body)


def _from_the_first(scene: Scene, body: int) -> list[LocalCoordinate]:
    """Where stops and elements of the scene's own beam meet another."""
    met = (place.on_body(0, body) for one in scene.acting for place in one.coordinates)
    return [own for places in met for own in places] if body else []


def static_rows(scene: Scene, matrices: Matrices) -> sparse.csr_matrix:
    """Rows (m, N) of the scene's own stops, elements, then forces: where the model may miss static compliance."""
    acting: list[Any] = [*scene.acting, *scene.forces]
    places = [place for one in acting for place in one.coordinates]
    blank = sparse.csr_matrix((0, matrices.M.shape[0]))
    return sparse.vstack([blank, *(place.row(matrices) for place in places)], format="csr")


def heights(scene: Scene) -> tuple[list[float], list[float]]:
    """Where the undeflected bodies lie over the scene's own beam, m, so that gaps are seen: beams, impactors."""
    beams = [0.0] * (1 + len(scene.bodies))
    for stop in reversed(scene.stops):
        place = stop.coordinate
        if place.to is not None and place.to[0] and not place.rotation:
            beams[place.to[0]] = -stop.push * stop.gap
    on_impactors = [
        beams[body] - (impactor.pushes[0] * impactor.gap if len(impactor.pushes) == 1 else 0.0)
        for body, part in enumerate((scene, *scene.bodies))
        for impactor in part.impactors
    ]
    return beams, on_impactors
