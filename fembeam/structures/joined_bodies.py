"""Several bodies joined to one: its matrices on the unknowns that joints leave, its places by body and name.

q_all = T q̂,    M̂ = Tᵀ M T,    K̂ = Tᵀ K T;    see `joints`.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fembeam.beams import SHORTEST_ROOTLESS
from fembeam.structures.assembled import COMPONENTS, Assembled
from fembeam.structures.directions import nearest
from fembeam.structures.frame import Frame
from fembeam.structures.frame_checks import check_joined
from fembeam.structures.frame_forces import FrameForces
from fembeam.structures.frame_mesh import FrameMatrices, spaced
from fembeam.structures.joints import Joint, joined_fields, joining, shared_dofs, translations_of
from fembeam.support import is_numbered, is_pair, require

Vector = NDArray[np.float64]
APART = 1e-6  # of the size of the bodies: two places that a joint makes one
STILL = 1e-6  # of the motion of all bodies: one that stands still but for rounding


@dataclass(frozen=True)
class JoinedBodies:
    """Bodies made one by joints; a scene with `joints` makes it of its own body and those of its `bodies`.

    A place is one of the first body as it is, of another one (number, place), number 1 the next body; a name that only
    one body has needs no number. Every body lies where its first joint puts it.

    Parameters
    ----------
    bodies : frames, structures. joints : list of `Joint`.

    Raises
    ------
    ValueError : a body that no joint leads to from the first one, bodies and places that do not exist, a motion fixed
        twice by the same places, places of a joint that do not meet.

    Examples
    --------
    >>> from fembeam.structures import Structure
    >>> mass, spring = Structure([[0.0]], [[2.0]]), Structure([[8.0]], [[1.0]], points={"top": 0})
    >>> both = JoinedBodies((mass, spring), (Joint(0, to=(1, "top")),))
    >>> made = both.assembled()
    >>> made.M.toarray(), made.K.toarray(), both.located("top", "")
    (array([[3.]]), array([[8.]]), (1, 'top'))
    """

    bodies: Sequence[Any]
    joints: Sequence[Joint]

    def __post_init__(self) -> None:
        object.__setattr__(self, "bodies", tuple(self.bodies))
        object.__setattr__(self, "joints", tuple(self.joints))
        for index, joint in enumerate(self.joints):
            shared_dofs(self.bodies, joint, f"joints[{index}] of Scene")
        self._check_once()
        _ = self.shifts

    def _check_once(self) -> None:
        """Raise ValueError where two joints make one dof of two places equal."""
        known: dict[Any, int] = {}
        for index, joint in enumerate(self.joints):
            ends = frozenset([(joint.body, _node(self.bodies[joint.body], joint.place)), self._end(joint)])
            for dof in shared_dofs(self.bodies, joint, f"joints[{index}] of Scene"):
                first = known.setdefault((ends, dof), index)
                require(first == index, f"joints must not fix one dof twice ({dof})", (first, index),
                        "joints of Scene", "leave it out of one of them")  # fmt: skip

    def _end(self, joint: Joint) -> tuple[int, Any]:
        """The second place of a joint."""
        return joint.to[0], _node(self.bodies[joint.to[0]], joint.to[1])

    @cached_property
    def shifts(self) -> tuple[Vector, ...]:
        """(3,) for each body, m: what moves it to its first joint."""
        found: dict[int, Vector] = {0: np.zeros(3)}
        waiting = list(enumerate(self.joints))
        while ready := [(i, one) for i, one in waiting if one.body in found or one.to[0] in found]:
            index, joint = ready[0]
            waiting.remove(ready[0])
            self._placed(index, joint, found)
        loose = [number for number in range(len(self.bodies)) if number not in found]
        require(not loose, "every joined body must be joined to the first one, or to one that is", loose,
                "joints of Scene", "add a joint, or leave the body out")  # fmt: skip
        return tuple(found[number] for number in range(len(self.bodies)))

    def _placed(self, index: int, joint: Joint, found: dict[int, Vector]) -> None:
        """Move a body to one that is in its place, or check that both places of a joint meet."""
        ends = [(joint.body, joint.place), joint.to]
        at = [self.bodies[number].position(place) for number, place in ends]
        known = all(one is not None for one in at)
        for (here, there), sign in (((0, 1), 1.0), ((1, 0), -1.0)):
            number = ends[there][0]
            if number not in found and ends[here][0] in found:
                found[number] = found[ends[here][0]] + (sign * (at[0] - at[1]) if known else 0.0)
        if known:
            gap = float(np.linalg.norm(at[0] + found[ends[0][0]] - at[1] - found[ends[1][0]]))
            size = max(float(np.linalg.norm(np.ptp(np.array(points), axis=0))) for points in self._points)
            rule = "the places of a joint must meet where the joints before it put the bodies"
            require(gap <= APART * size, rule, f"{gap:.4g} m between them", f"joints[{index}] of Scene",
                    "correct the coordinates, or turn the body")  # fmt: skip

    @property
    def doubts(self) -> list[str]:
        """Sentences on bodies that joints move though their places neither meet nor are the origin of the body."""
        found = []
        for joint in self.joints:
            number, place = joint.to if np.any(self.shifts[joint.to[0]]) else (joint.body, joint.place)
            at, shift = self.bodies[number].position(place), self.shifts[number]
            if at is not None and np.any(at) and np.linalg.norm(shift) > APART * np.linalg.norm(at):
                way = ", ".join(f"{x:.4g}" for x in shift)
                found.append(f"body {number} is moved by ({way}) m, so that its {place!r} meets what it is joined to: "
                             "right if its coordinates are its own, else correct them")  # fmt: skip
        return list(dict.fromkeys(found))

    @cached_property
    def _points(self) -> list[list[Vector]]:
        """Where the named places of every body are, as far as it is known."""
        each = [[body.position(place) for place in body.places()] for body in self.bodies]
        return [[at for at in points if at is not None] or [np.zeros(3)] for points in each]

    @property
    def meshed(self) -> bool:
        """Whether elements can be chosen in any of them."""
        return any(body.meshed for body in self.bodies)

    @cached_property
    def components(self) -> tuple[str, ...]:
        """Those that any of the bodies has."""
        return tuple(name for name in COMPONENTS if any(name in body.components for body in self.bodies))

    @property
    def base_directions(self) -> tuple[str, ...]:
        """Directions in which the frame may move: those that all bodies have."""
        return tuple(name for name in COMPONENTS[:3] if all(name in translations_of(body) for body in self.bodies))

    def located(self, place: Any, where: str) -> tuple[int, Any]:
        """Number of the body that a place is on, and the place there; ValueError for one that does not exist."""
        return located_among(dict(enumerate(self.bodies)), place, where)

    def check_place(self, place: Any, where: str) -> None:
        """Raise ValueError unless the place exists; the message names the nearest."""
        self.located(place, where)

    def carrier(self, place: Any) -> Any:
        """The body that a place is on."""
        return self.bodies[self.located(place, "carrier")[0]]

    def node(self, place: Any) -> Any:
        """What tells places apart: the body, and the node there."""
        number, own = self.located(place, "node")
        return number, _node(self.bodies[number], own)

    def components_at(self, place: Any) -> tuple[str, ...]:
        """How a place moves."""
        number, own = self.located(place, "components_at")
        return tuple(self.bodies[number].components_at(own))

    def places(self) -> list[Any]:
        """Names of all places: of the first body as they are, of others with the number of the body."""
        return [self._numbered(number, place) for number, body in enumerate(self.bodies) for place in body.places()]

    @property
    def points(self) -> list[Any]:
        """Named points, likewise, without the second places of joints; of a body without any its last place."""
        named = [(n, body.points or body.places()[-1:]) for n, body in enumerate(self.bodies)]
        ends = {self._end(joint) for joint in self.joints}
        each = [(number, place) for number, points in named for place in points]
        return [self._numbered(n, place) for n, place in each if (n, _node(self.bodies[n], place)) not in ends]

    @staticmethod
    def _numbered(number: int, place: Any) -> Any:
        """A place as others name it: with the number of its body, but on the first one."""
        return (number, place) if number else place

    def position(self, place: Any) -> Vector | None:
        """Where a place is (3,), m; None if it is not known."""
        number, own = self.located(place, "position")
        at = self.bodies[number].position(own)
        return None if at is None else at + self.shifts[number]

    def lines(self) -> list[Vector]:
        """All lines, (2, 3) m."""
        return [line + shift for body, shift in zip(self.bodies, self.shifts, strict=True) for line in body.lines()]

    @property
    def edges(self) -> list[tuple[Any, Any]]:
        """Pairs of places that figures join."""
        each = enumerate(self.bodies)
        return [(self._numbered(n, a), self._numbered(n, b)) for n, body in each for a, b in body.edges]

    def check(self) -> list[str]:
        """What the bodies given by matrices say."""
        each = [(number, body.check()) for number, body in enumerate(self.bodies) if hasattr(body, "check")]
        return [f"body {number}: {said}" for number, sentences in each for said in sentences]

    def check_held(self, held: Mapping[Any, Collection[Any]], where: str) -> None:
        """Raise ValueError where releases free a node of a frame that neither supports nor joints hold."""
        at: list[tuple[Any, Collection[str]]] = [(self.located(place, where), dofs) for place, dofs in held.items()]
        joined = [
            ((joint.body, joint.place), joint.to, shared_dofs(self.bodies, joint, where)) for joint in self.joints
        ]
        ends = [[(one, dofs), (other, dofs)] for one, other, dofs in joined]
        for number, body in enumerate(self.bodies):
            if hasattr(body, "check_held"):
                body.check_held(_held_on(number, [*at, *(end for pair in ends for end in pair)]), where)
        for index, (one, other, dofs) in enumerate(joined):
            beside = [end for i, pair in enumerate(ends) for end in pair if i != index]
            self._check_joined((one, other), dofs, [*at, *beside], where)

    def _check_joined(self, ends: Any, dofs: list[str], held: list[tuple[Any, Collection[str]]], where: str) -> None:
        """Raise ValueError where releases on both sides of a joint leave its nodes free together."""
        found = []
        for number, place in ends:
            frame = self.bodies[number]
            node = frame.site(place, where) if isinstance(frame, Frame) else None
            if not isinstance(node, str):
                return
            mine = _held_on(number, held)
            found.append(
                (frame, node, [c for at, names in mine.items() if frame.site(at, where) == node for c in names])
            )
        check_joined(found, dofs, where)

    def assembled(
        self,
        elements: int | None = None,
        modes: int | None = None,
        places: Sequence[Any] = (),
        omega: float | None = None,
    ) -> JoinedMatrices:
        """M, K and the like of all bodies on the unknowns that joints leave; arguments as for each body."""
        made = []
        for body, own in zip(self.bodies, self._places_of_each(places), strict=True):
            count = elements if body.meshed else None
            frequency = {"omega": omega} if hasattr(body, "coarse") else {}
            made.append(body.assembled(count, modes, own, **frequency))
        return self.joined(made)

    def coarse(self, modes: int, places: Sequence[Any] = ()) -> JoinedMatrices:
        """The same of frames on few elements, to find out which frequencies their meshes have to resolve."""
        pairs = zip(self.bodies, self._places_of_each(places), strict=True)
        return self.joined([
            body.coarse(modes, own) if hasattr(body, "coarse") else body.assembled(None, modes, own)
            for body, own in pairs
        ])  # fmt: skip

    def _places_of_each(self, places: Sequence[Any]) -> list[list[Any]]:
        """Places by their bodies, those of joints too."""
        located = [self.located(place, "places") for place in places]
        located += [end for joint in self.joints for end in ((joint.body, joint.place), joint.to)]
        each = [[place for number, place in located if number == own] for own in range(len(self.bodies))]
        if not any(_rootless(body) for body in self.bodies):
            return each
        pairs = zip(self.bodies, each, strict=True)  # K of all bodies has no root then, and short elements lose digits
        return [spaced(one, own, SHORTEST_ROOTLESS) if isinstance(one, Frame) else own for one, own in pairs]

    def joined(self, made: Sequence[Assembled]) -> JoinedMatrices:
        """The matrices of all bodies from those of each; a place is (number of the body, its place)."""
        T, free = joining(self.bodies, made, self.joints)
        first = tuple(int(i) for i in np.cumsum([0, *(one.M.shape[0] for one in made)]))
        return JoinedMatrices(
            **joined_fields(self.bodies, made, T, free), body=self, made=tuple(made), first=first, T=T
        )


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class JoinedMatrices(Assembled):
    """Matrices of joined bodies; `made` those of each, `first` where its dofs begin, T from q̂ to all dofs."""

    rows: Any = field(init=False)
    body: JoinedBodies
    made: tuple[Assembled, ...]
    first: tuple[int, ...]
    T: sparse.csr_matrix

    def __post_init__(self) -> None:
        object.__setattr__(self, "rows", self.rows_at)

    def rows_at(self, place: Any) -> sparse.csr_matrix:
        """A row (c, N) for each of the components that any body has, of zeros for those that this one has not."""
        return self.rows_of([place])

    def rows_of(self, places: Sequence[Any]) -> sparse.csr_matrix:
        """The same of several places, one below the other, each body at once."""
        located, count = [self.body.located(place, "rows") for place in places], len(self.body.components)
        found = sparse.csr_matrix((count * len(places), self.T.shape[1]))
        for number in {number for number, _ in located}:
            mine = [(i, own) for i, (on, own) in enumerate(located) if on == number]
            known = [self.body.components.index(name) for name in self.body.bodies[number].components]
            rows = (self.made[number].rows_of([own for _, own in mine]) @ self.of_body(number)).tocoo()
            below = np.array([count * i + component for i, _ in mine for component in known], dtype=int)
            found = found + sparse.csr_matrix((rows.data, (below[rows.row], rows.col)), shape=found.shape)
        return found.tocsr()

    def of_body(self, number: int) -> sparse.csr_matrix:
        """T of one body's dofs."""
        return self.T[self.first[number] : self.first[number + 1]]

    def check_mechanism(self, loose: Vector, where: str) -> None:
        """Raise ValueError if motions (N, n) without resistance deform a frame; hinges may let bodies move."""
        for number, one in enumerate(self.made):
            mine = np.asarray(self.of_body(number) @ loose)
            moving = np.linalg.norm(mine) > STILL * np.linalg.norm(self.T @ loose)
            if isinstance(one, (FrameMatrices, JoinedMatrices)) and moving:
                one.check_mechanism(mine, where)

    def section_forces(self, vectors: Vector, inertia: Vector, stresses: Vector | None = None) -> JoinedForces | None:
        """Section forces of the frames among the bodies; None if there are none."""
        found: dict[int, Any] = {}
        rows = np.cumsum([0, *(0 if one.root is None else one.root.shape[0] for one in self.made)])
        for number, one in enumerate(self.made):
            if isinstance(one, (FrameMatrices, JoinedMatrices)):
                T = self.of_body(number)
                mine = None if stresses is None else stresses[rows[number] : rows[number + 1]]
                forces = one.section_forces(np.asarray(T @ vectors), np.asarray(T @ inertia), mine)
                found |= {} if forces is None else {number: forces}
        return JoinedForces(self.body, found) if found else None


@dataclass(frozen=True, eq=False)
class JoinedForces:
    """Section forces of the frames among joined bodies; see `FrameForces`."""

    body: Any  # JoinedBodies, or what of them a file keeps
    each: Mapping[int, FrameForces]

    def __repr__(self) -> str:
        return f"<section forces of bodies {', '.join(map(str, self.each))}>"

    @property
    def names(self) -> tuple[str, ...]:
        """Those that any of the frames has."""
        return tuple(dict.fromkeys(name for forces in self.each.values() for name in forces.names))

    def names_at(self, place: Any) -> tuple[str, ...]:
        """Components that a place has."""
        forces, own = self._of(place)
        return forces.names_at(own)

    def rows(self, place: Any, names: tuple[str, ...] | None = None, behind: bool = False) -> Vector:
        """(len(names), n) at a place on a member."""
        forces, own = self._of(place)
        return forces.rows(own, names, behind)

    def stress(self, place: Any, x: float = 0.0, y: float | None = None, behind: bool = False) -> Vector:
        """Normal stress (n,) at a point of the section."""
        forces, own = self._of(place)
        return forces.stress(own, x, y, behind)

    def preload(self, place: Any, quantity: str) -> float:
        """What the given axial force of the member adds."""
        forces, own = self._of(place)
        return forces.preload(own, quantity)

    def sections(self) -> list[Any]:
        """All mesh nodes of the frames, member by member."""
        return [(n, at) if n else at for n, forces in self.each.items() for at in forces.sections()]

    def _of(self, place: Any) -> tuple[FrameForces, Any]:
        """The section forces of the body that a place is on."""
        number, own = self.body.located(place, "section forces")
        require(number in self.each, "a place of section forces must lie on a frame; this one is on a structure", place,
                "section forces", "ask for displacement(place, direction), or for reactions")  # fmt: skip
        return self.each[number], own


def _members(body: Any) -> list[str]:
    """Names of the members of a frame; none of a structure."""
    return [one.name for one in getattr(body, "members", ())]


def _held_on(number: int, held: Sequence[tuple[Any, Collection[str]]]) -> dict[Any, list[str]]:
    """{place: components} of one body, of all that is held as ((number, place), components)."""
    mine: dict[Any, list[str]] = {}
    for (on, place), components in held:
        if on == number:
            mine.setdefault(place, []).extend(components)
    return mine


def located_among(bodies: Mapping[int, Any], place: Any, where: str) -> tuple[int, Any]:
    """Number of the body that a place is on, and the place there: (number, place), or a place of the first that has it.

    ValueError for one that does not exist, or that several bodies have and not number 0.
    """
    if is_numbered(place):
        number, own = int(place[0]), place[1]
        listed = ", ".join(map(str, bodies))
        require(
            number in bodies, f"the number of a body must be one of {listed}", number, where, "0 is the scene's own"
        )
        bodies[number].check_place(own, where)
        return number, own
    having = [number for number, body in bodies.items() if has_place(body, place)]
    if not having:
        of_member = [body for body in bodies.values() if is_pair(place) and place[0] in _members(body)]
        for body in of_member:  # its distance is wrong
            body.check_place(place, where)
        known = list(dict.fromkeys(name for body in bodies.values() for name in body.places()))
        require(False, f"a place must be one of the joined bodies; {nearest(place, known)}", place, where,
                "use that, or (number of the body, place)")  # fmt: skip
    alone = len(having) == 1 or having[0] == 0
    require(alone, f"a place must be of one body; bodies {', '.join(map(str, having))} have it", place, where,
            f"write ({having[0]}, {place!r})")  # fmt: skip
    return having[0], place


def has_place(body: Any, place: Any) -> bool:
    """Whether a place is one of a body; a `Beam` has none by name."""
    if not hasattr(body, "check_place"):
        return False
    try:
        body.check_place(place, "")
    except (ValueError, TypeError):
        return False
    return True


def _rootless(body: Any) -> bool:
    """Whether no R with RᵀR = K comes with a body: with structures by their matrices."""
    return hasattr(body, "root") and body.root is None


def _node(body: Any, place: Any) -> Any:
    """The node of a place, or the place itself."""
    return body.node(place) if hasattr(body, "node") else place
