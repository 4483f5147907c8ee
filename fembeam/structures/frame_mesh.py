"""The mesh of a frame: where its members have nodes, which dofs these are, and its matrices.

Along every member nodes stand at the places asked for, and as dense as the shortest wave of the highest mode kept
asks: (γ h)⁴/1440 with the wavenumbers κ of bending, ω √(ρ/E) of stretch and ω √(ρ (I + I2)/GJ) of twist.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

import reduction
from fembeam.beams import (
    FREQUENCY_TOLERANCE,
    MESHED_MODES,
    MOST_ELEMENTS,
    MOST_MODES,
    SAME_PLACE,
    SHORTEST,
    WAVE_STEP,
    Section,
    divided,
    shares,
    wavenumber,
)
from fembeam.structures.assembled import COMPONENTS, Assembled
from fembeam.structures.element_matrices import (
    ACROSS,
    PARABOLAS,
    UP,
    Elements,
    gyroscopic,
    inertia_root,
    properties_of,
    stiffness_root,
)
from fembeam.structures.frame_checks import arm_matrix
from fembeam.structures.frame_forces import FrameForces, frame_forces
from fembeam.structures.members import release_axes
from fembeam.support import is_whole, require

if TYPE_CHECKING:
    from fembeam.structures.frame import Frame

Vector = NDArray[np.float64]

MECHANISM = 1e-4  # of a motion without resistance: what is left of it without the rigid part, where there is any
ALONE = 1e-6  # of a motion: what rounding may leave of it on the members where nodes turn by themselves


@dataclass(frozen=True, eq=False)
class FrameMesh:
    """Elements of a frame and its dofs.

    Attributes
    ----------
    frame : the frame. borders : for every member the distances s (k,) of its mesh nodes from its first end, m.
    labels : (place, component) of every dof: nodes of the frame; then (member, "end rz") for releases; (member, s) for
        mesh nodes within members, and for the parabolas of an element: ((member, s), "along") and PARABOLAS.
    join : (6 p + parabolas, N) from the dofs to displacement and rotation of all p points, ends of members apart.
    """

    frame: Frame
    borders: tuple[Vector, ...]
    labels: tuple[tuple[Any, str], ...]
    join: sparse.csr_matrix

    @cached_property
    def first(self) -> NDArray[np.int64]:
        """Number of the first element of every member; that of its first point is larger by the member's number."""
        return np.concatenate([[0], np.cumsum([len(s) - 1 for s in self.borders])])

    @cached_property
    def h(self) -> Vector:
        """Lengths (e,) of all elements, m."""
        return np.concatenate([np.diff(s) for s in self.borders])

    @cached_property
    def elements(self) -> Elements:
        """All elements."""
        frame, counts = self.frame, np.diff(self.first)
        member = np.repeat(np.arange(len(counts)), counts)
        count = len(member)
        point = np.arange(count) + member
        points = count + len(counts)
        rows = np.hstack([6 * (point[:, None] + end) + np.arange(6) for end in range(2)])
        rows = np.hstack([rows, 6 * points + np.arange(count)[:, None] + count * np.arange(len(PARABOLAS))])
        per_member = properties_of(
            [one.section for one in frame.members],
            np.array([one.axial_force for one in frame.members], dtype=float),
            np.array([one.foundation for one in frame.members], dtype=float),
            frame.spin != 0,
        )
        return Elements(
            h=self.h,
            axes=frame.axes[member],
            properties={name: values[member] for name, values in per_member.items()},
            join=self.join[rows.ravel()],
            planes=(UP,) if frame.in_plane else (UP, ACROSS),
            stretches=not frame.bending_only,
            twists=not (frame.in_plane or frame.bending_only),
        )

    def rows(self, place: Any) -> sparse.csr_matrix:
        """Displacement and rotation (c, N) at a place along the global axes, one row for each of the components."""
        site = self.frame.site(place, "rows")
        return self.at_nodes([site]) if isinstance(site, str) else self.along(site[0], np.array([site[1]]))

    def at_nodes(self, names: Sequence[str]) -> sparse.csr_matrix:
        """The same (c k, N) at nodes of the frame, all components of one after another."""
        count, numbers = len(self.frame.components), {name: i for i, name in enumerate(self.frame.nodes)}
        first = count * np.array([numbers[name] for name in names], dtype=np.int64)  # dofs of nodes come first
        columns = (first[:, None] + np.arange(count)).ravel()
        rows = np.arange(len(columns))
        return sparse.csr_matrix((np.ones(len(rows)), (rows, columns)), shape=(len(rows), len(self.labels)))

    def sections(self) -> list[tuple[str, float]]:
        """All mesh nodes as (member, distance), member by member."""
        pairs = zip(self.frame.members, self.borders, strict=True)
        return [(one.name, float(s)) for one, borders in pairs for s in borders]

    def along(self, member: int, s: Vector) -> sparse.csr_matrix:
        """The same (c k, N) at distances s (k,) along a member."""
        return self.along_members([(member, s)])

    def along_members(self, places: Sequence[tuple[int, Vector]]) -> sparse.csr_matrix:
        """The same at distances along several members, one member after another."""
        parts = [(*self.located(member, s), np.full(len(s), member)) for member, s in places]
        element, x, node, member = (np.concatenate(part) for part in zip(*parts, strict=True))
        columns = [COMPONENTS.index(name) for name in self.frame.components]
        at_nodes = self.join[(6 * (node + member)[node >= 0, None] + columns).ravel()]
        inside = self._inside(element[node < 0], x[node < 0])
        order = np.argsort(np.concatenate([np.flatnonzero(node >= 0), np.flatnonzero(node < 0)]), kind="stable")
        rows = sparse.vstack([at_nodes, inside], format="csr")
        return rows[(order[:, None] * len(columns) + np.arange(len(columns))).ravel()]

    def located(
        self, member: int, s: Vector, behind: bool = False
    ) -> tuple[NDArray[np.int64], Vector, NDArray[np.int64]]:
        """Elements (k,), x in [0, 1] there, and the mesh node (its number less the member's), -1 between two.

        At a mesh node the element ahead, or ``behind``.
        """
        borders = self.borders[member]
        local = np.clip(np.searchsorted(borders, s, side="left" if behind else "right") - 1, 0, len(borders) - 2)
        closest = np.argmin(np.abs(borders[:, None] - s), axis=0)
        meets = np.abs(borders[closest] - s) <= SAME_PLACE * borders[-1]
        x = (s - borders[local]) / (borders[local + 1] - borders[local])
        return self.first[member] + local, x, np.where(meets, self.first[member] + closest, -1)

    def _inside(self, element: NDArray[np.int64], x: Vector) -> sparse.csr_matrix:
        """Rows between mesh nodes by the elements' fields, turned to global axes."""
        known, own = self.frame.components, self.elements.only(element)
        fields = own.motion(np.arange(len(x)), x)
        blank = sparse.csr_matrix((len(x), own.join.shape[0]))
        turned = []
        for name in known:
            kind, c = divmod(COMPONENTS.index(name), 3)
            parts = [sparse.diags(own.axes[:, a, c]) @ f for a, f in enumerate(fields[kind]) if f is not None]
            turned.append(sum(parts, blank))
        stacked = sparse.vstack(turned, format="csr") @ own.join
        order = np.arange(len(x))[:, None] + len(x) * np.arange(len(known))
        return stacked[order.ravel()]


def points_of(borders: Sequence[Vector]) -> int:
    """Displacements and rotations of all points of a mesh, ends of members apart, and parabolas of its elements."""
    return sum(6 * len(s) + len(PARABOLAS) * (len(s) - 1) for s in borders)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class FrameMatrices(Assembled):
    """Matrices of a frame, and the mesh they stand on."""

    mesh: FrameMesh

    def rows_of(self, places: Sequence[Any]) -> sparse.csr_matrix:
        """`rows` of several places, one below the other, all members at once."""
        sites = [self.mesh.frame.site(place, "rows") for place in places]
        count, by_member = len(self.mesh.frame.components), defaultdict[int, list[int]](list)
        nodes = [i for i, site in enumerate(sites) if isinstance(site, str)]
        for i, site in enumerate(sites):
            if not isinstance(site, str):
                by_member[site[0]].append(i)
        along = [(member, np.array([sites[i][1] for i in mine], dtype=float)) for member, mine in by_member.items()]
        pieces = [self.mesh.at_nodes([str(sites[i]) for i in nodes])]
        pieces += [self.mesh.along_members(along)] if along else []
        back = np.argsort(np.array([*nodes, *chain.from_iterable(by_member.values())], dtype=int))
        return sparse.vstack(pieces, format="csr")[(count * back[:, None] + np.arange(count)).ravel()]

    @cached_property
    def rigid_motions(self) -> Vector:
        """Unit translations along and rotations about x, y, z through the origin (N, 6), of what the frame has."""
        frame = self.mesh.frame
        points = np.array([frame.position(place if name in COMPONENTS else frame.members[0].a)
                           for place, name in self.labels])  # fmt: skip
        moved = np.zeros((len(self.labels), 6))
        for dof, ((_, name), at) in enumerate(zip(self.labels, points, strict=True)):
            if name in COMPONENTS:
                moved[dof] = arm_matrix(at)[COMPONENTS.index(name)]
        return moved

    def check_mechanism(self, loose: Vector, where: str) -> None:
        """Raise ValueError, naming the motion, if motions (N, n) without resistance move members against each other.

        A node that all members release, and that has inertia, may turn by itself.
        """
        if loose.shape[1] == 0:
            return
        whole, moved = self.mesh.join @ self.rigid_motions, self.mesh.join @ loose
        most, mix = np.linalg.svd(moved - whole @ np.linalg.lstsq(whole, moved, rcond=None)[0], full_matrices=False)[1:]
        size, given = (np.linalg.norm(one, axis=0).max() for one in (moved, loose))
        rigid = bool(most[0] <= MECHANISM * max(size, ALONE * given))
        motion = np.abs(loose @ mix[0])
        shift = np.array([name in COMPONENTS[:3] for _, name in self.labels])
        moving = motion * shift if np.any(motion[shift] > MECHANISM * motion.max()) else motion
        place, name = self.labels[int(np.argmax(moving > 0.999 * moving.max()))]  # nodes come first
        released = [one.name for one in self.mesh.frame.members if one.release]
        advice = (
            "release less, or support it there"
            if released
            else "nothing is released, so members differ too much in stiffness, as very short ones do: join their ends"
        )
        require(rigid, f"the frame must not be a mechanism; {place!r} moves along {name!r} without resistance",
                released or _shortest(self.mesh.frame), where, advice)  # fmt: skip

    def section_forces(self, vectors: Vector, inertia: Vector, stresses: Vector | None = None) -> FrameForces:
        """Section forces of displacements (N, n) and of the inertia (N, n) that their stiffness balances."""
        return frame_forces(self, vectors, inertia, stresses)


def assemble(
    frame: Frame, elements: int | None, modes: int | None, places: Sequence[Any], omega: float | None
) -> FrameMatrices:
    """`Frame.assembled` explains the arguments."""
    for name, number in (("elements", elements), ("modes", modes)):
        require(number is None or (is_whole(number) and number > 0), f"{name} must be a whole number above 0", number,
                "Frame.assembled", "give a count, or None")  # fmt: skip
    stops = _stops(frame, places)
    if elements is not None:
        return _on(frame, _spread(frame, stops, elements), "elements as asked")
    count = MESHED_MODES if modes is None else int(modes)
    require(count <= MOST_MODES, f"modes must be at most {MOST_MODES}", modes, "Frame.assembled",
            "keep the modes up to a few times the highest frequency of interest, or give elements")  # fmt: skip
    highest = _highest(frame, places, count) if omega is None else float(omega)
    kept = (
        f"frequencies to {highest:.6g} rad/s"
        if modes is None and omega is not None
        else f"the lowest {count} frequencies"
    )
    return _on(frame, _resolving(frame, stops, highest), f"{kept} are right to {FREQUENCY_TOLERANCE:g} relative")


def _stops(frame: Frame, places: Sequence[Any]) -> list[Vector]:
    """For every member the distances that must be nodes, ends included, ascending."""
    wanted: list[list[float]] = [[0.0, float(length)] for length in frame.lengths]
    for place in spaced(frame, places, SHORTEST):
        site = frame.site(place, "places of Frame.assembled")
        if not isinstance(site, str):
            wanted[site[0]].append(site[1])
    return [np.array(sorted(one)) for one in wanted]


def spaced(frame: Frame, places: Sequence[Any], apart: float) -> list[Any]:
    """Those of some places that are so far, in lengths of their members, from the ends and from those before them."""
    known = {index: [0.0, float(length)] for index, length in enumerate(frame.lengths)}
    kept = []
    for place in places:
        site = frame.site(place, "places of Frame.assembled")
        if not isinstance(site, str):
            index, s = site
            if min(abs(s - other) for other in known[index]) <= apart * frame.lengths[index]:
                continue
            known[index].append(s)
        kept.append(place)
    return kept


def _waves(frame: Frame, omega: float) -> Iterator[float]:
    """The largest wavenumber γ (1/m) of every member at omega."""
    for one, length in zip(frame.members, frame.lengths, strict=True):
        own = one.section
        beam = one.beam(float(length), frame.in_plane)
        waves = [
            wavenumber(beam, np.array([0.0, length]), omega)[0],
            _sheared_wave(beam.profile(0.0).I.item(), own, omega),
        ]
        if not frame.bending_only:
            waves.append(omega * np.sqrt(own.rho / own.E))
        if own.I2 is not None and "rz" in frame.components and not frame.in_plane:
            waves.append(omega * np.sqrt(own.rho * (own.I + own.I2) / own.torsion_stiffness))
        yield float(max(waves))


def _sheared_wave(I: float, own: Section, omega: float) -> float:
    """κ in 1/m of bending with shear and rotary inertia, EI κ⁴ - ρI ω² (1 + E/κG) κ² = ρA ω² (1 - ρI ω²/κGA)."""
    if own.shear is None:
        return 0.0
    G = float(np.min(own.shear)) * own.E / (2 * (1 + own.nu))
    mean, apart = (own.rho * omega**2 * (1 / own.E + sign / G) / 2 for sign in (1, -1))
    return float(np.sqrt(mean + np.hypot(apart, omega * np.sqrt(own.line_mass / (own.E * I)))))


def _spread(frame: Frame, stops: list[Vector], elements: int) -> list[Vector]:
    """Mesh nodes of `elements` elements in all, at least one an interval, short where waves are short."""
    require(elements <= MOST_ELEMENTS, f"elements must be at most {MOST_ELEMENTS}", elements, "Frame.assembled",
            "leave them out: as few as the modes need are made")  # fmt: skip
    slow = [(one.section.line_mass / one.section.bending_stiffness) ** 0.25 for one in frame.members]
    counts = shares(np.concatenate([np.diff(s) * wave for s, wave in zip(stops, slow, strict=True)]), elements)
    return _divided(stops, counts)


def _resolving(frame: Frame, stops: list[Vector], omega: float) -> list[Vector]:
    """Mesh nodes so near that γ h stays below WAVE_STEP at omega."""
    waves = np.concatenate([np.diff(s) * wave for s, wave in zip(stops, _waves(frame, omega), strict=True)])
    counts = np.maximum(1, np.ceil(waves / WAVE_STEP))
    require(counts.sum() <= MOST_ELEMENTS, f"the frame must need at most {MOST_ELEMENTS} elements", float(counts.sum()),
            "Frame.assembled", "ask for fewer modes; is a length in mm?")  # fmt: skip
    return _divided(stops, counts.astype(int))


def _divided(stops: list[Vector], counts: NDArray[np.int64]) -> list[Vector]:
    """Each interval of every member in as many equal elements."""
    bounds = np.cumsum([len(s) - 1 for s in stops])[:-1]
    return [divided(s, mine) for s, mine in zip(stops, np.split(counts, bounds), strict=True)]


def coarse(frame: Frame, modes: int, places: Sequence[Any]) -> FrameMatrices:
    """Matrices good enough to know about which frequency number `modes` has, from above."""
    stops = _stops(frame, places)
    intervals = sum(len(s) - 1 for s in stops)
    return _on(frame, _spread(frame, stops, min(2 * modes + 4 + 2 * intervals, MOST_ELEMENTS)), "a first estimate")


def _highest(frame: Frame, places: Sequence[Any], modes: int) -> float:
    """A bound on frequency number `modes`, whatever holds the frame at the places: that with all of them clamped."""
    mesh = coarse(frame, modes, places)
    held = sparse.vstack([sparse.csr_matrix((0, len(mesh.labels))), *(mesh.rows(place) for place in places)]).tocsc()
    free = np.flatnonzero(np.diff(held.indptr) == 0)
    root = None if mesh.root is None else mesh.root[:, free]
    M, K = (A[free][:, free] for A in (mesh.M, mesh.K))
    return float(reduction.modal_basis(M, K, min(modes, len(free)), root=root).omega[-1])


def _on(frame: Frame, borders: list[Vector], promise: str) -> FrameMatrices:
    """Matrices with elements between these borders on every member."""
    labels, join = _numbered(frame, borders)
    mesh = FrameMesh(frame, tuple(borders), tuple(labels), join)
    elements = mesh.elements
    R = (stiffness_root(elements) @ elements.join).tocsr()
    P = inertia_root(elements) @ elements.join
    moved = [name for name in frame.components if name in COMPONENTS[:3]]
    translations = [[float(component == name) for name in moved] for _, component in labels]
    return FrameMatrices(
        *((P.T @ P).tocsr(), (R.T @ R).real.tocsr(), mesh.labels, mesh.rows),
        np.array(translations).reshape(len(labels), len(moved)),
        root=R,
        gyroscopic=_spun(frame, elements) if frame.spin != 0 else None,
        accuracy=f"{elements.count} elements, {len(labels)} dofs: {promise}",
        mesh=mesh,
    )


def _spun(frame: Frame, elements: Elements) -> sparse.csr_matrix:
    """G on the dofs: the spin is about the axis of the first member."""
    sense = np.sign(elements.axes[:, 2] @ frame.axes[0, 2])
    return (elements.join.T @ gyroscopic(elements, frame.spin * sense) @ elements.join).tocsr()


def _numbered(frame: Frame, borders: list[Vector]) -> tuple[list[tuple[Any, str]], sparse.csr_matrix]:
    """Labels of all dofs, and how points and parabolas follow them."""
    known = frame.components
    columns = np.array([COMPONENTS.index(name) for name in known])
    labels: list[tuple[Any, str]] = [(node, name) for node in frame.nodes for name in known]
    at = {node: len(known) * i for i, node in enumerate(frame.nodes)}
    entries: list[tuple[Any, Any, Any]] = []
    point = 0
    for index, (one, s) in enumerate(zip(frame.members, borders, strict=True)):
        last = point + len(s) - 1
        for end, (node, where) in enumerate(((one.a, point), (one.b, last))):
            arm = arm_matrix(one.offset[end])[np.ix_(columns, columns)]
            i, j = np.nonzero(arm)
            entries.append((6 * where + columns[i], at[node] + j, arm[i, j]))
        for end, text, motion in release_axes(one, frame.axes[index]):
            rows = np.flatnonzero(motion)
            entries.append((6 * (point, last)[end] + rows, np.full(len(rows), len(labels)), motion[rows]))
            labels.append((one.name, text))
        inner = np.arange(point + 1, last)
        own = len(labels) + np.arange(len(inner) * len(known))
        entries.append(((6 * inner[:, None] + columns).ravel(), own, np.ones(len(own))))
        labels += [((one.name, float(place)), name) for place in s[1:-1] for name in known]
        point = last + 1
    return _with_parabolas(frame, borders, labels, entries, 6 * point)


def _with_parabolas(
    frame: Frame, borders: list[Vector], labels: list[tuple[Any, str]], entries: list[tuple[Any, Any, Any]], row: int
) -> tuple[list[tuple[Any, str]], sparse.csr_matrix]:
    """The interior numbers of every element, where they are there, after all else."""
    pairs = list(zip(frame.members, borders, strict=True))
    middles = [(one.name, float(middle)) for one, s in pairs for middle in (s[:-1] + s[1:]) / 2]
    sheared = np.array([one.section.shear is not None for one, s in pairs for _ in s[1:]])
    count, twists = len(middles), not (frame.in_plane or frame.bending_only)
    across = sheared & (not frame.in_plane)
    there = (np.full(count, not frame.bending_only), np.full(count, twists), across, sheared, across, sheared)
    for kind, (name, mine) in enumerate(zip(PARABOLAS, map(np.flatnonzero, there), strict=True)):
        entries.append((row + kind * count + mine, len(labels) + np.arange(len(mine)), np.ones(len(mine))))
        labels += [(middles[i], name) for i in mine]
    rows, columns, values = (np.concatenate(one) for one in zip(*entries, strict=True))
    return labels, sparse.csr_matrix((values, (rows, columns)), shape=(row + len(PARABOLAS) * count, len(labels)))


def _shortest(frame: Frame) -> str:
    """The shortest member, for messages."""
    at = int(np.argmin(frame.lengths))
    return f"the shortest member {frame.members[at].name} of {frame.lengths[at]:.3g} m"
