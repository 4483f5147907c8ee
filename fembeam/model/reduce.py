"""From a scene to a reduced model: which modes, which static shapes, on which mesh; every beam by itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

import reduction
from fembeam.model.model import Model
from fembeam.response import PlacedShapes, Shapes, placed_shapes
from fembeam.scene import (
    MOST_DENSE,
    MOST_MODES,
    BodyMatrices,
    LocalCoordinate,
    Matrices,
    body_words,
    carried_on,
    check_counts,
    loaded,
    watched,
)
from fembeam.scene.rigid_motions import carried_away
from fembeam.structures import COMPONENTS
from fembeam.support import is_finite, is_listed, is_whole, require, require_switch, warn
from solvers.problem import counted

if TYPE_CHECKING:
    from fembeam.scene import Scene

Vector = NDArray[np.float64]

DEFAULT_MODES = 2  # modes of each body that a model keeps where none are asked for
COARSE = 0.01  # estimated relative error of the highest kept frequency, above which elements as asked get a warning
FIRST_TRY = 8  # modes, doubled until a frequency or share of mass is reached
MOST_DOFS = 20_000  # of the finest mesh
EQUAL = 1e-9  # relative distance of frequencies whose shapes are arbitrary among themselves
PAIR = 1e-6  # relative distance of two frequencies that are one
MOST_TRIED = 128  # modes; a few seconds


def reduced(
    scene: Scene,
    modes: int | Sequence[int] | str | None,
    elements: int | None,
    omega_max: float | None,
    mass_share: float | None,
    residual: bool,
    interface: bool,
) -> Model:
    """The model of a scene; `Scene.reduce` explains the arguments."""
    check_reduction(scene, modes, elements, omega_max, mass_share, residual, interface)
    if omega_max is not None or mass_share is not None:
        modes = _enough(scene, elements, omega_max, mass_share)
    matrices, asked, chosen = _chosen(scene, DEFAULT_MODES if modes is None else modes, elements, interface)
    bodies = []
    for number, (body, listed) in enumerate(zip(matrices.beams, chosen, strict=True)):
        of = f" of {body_words(number)}" * bool(scene.bodies)
        basis = _of_beam(body, loaded(scene, number), listed, residual, interface, of)
        bodies.append(_Reduced(body, _oriented(basis, body, watched(scene, number)), None if interface else listed))
    if elements is not None and not isinstance(modes, str):
        highest = max(
            one.basis.omega[min(len(own), one.basis.count) - 1] for one, own in zip(bodies, chosen, strict=True)
        )
        _warn_of_the_mesh(matrices, highest)
    _warn_of_drift(scene, bodies)
    basis = _joined([one.basis for one in bodies], matrices)
    shapes, *others = _shapes_of_each(scene, matrices, basis)
    numbers = (*(number for one in bodies for number in one.numbers), *(0 for _ in matrices.impactors))
    again = "all" if isinstance(modes, str) else len(asked) if interface else asked
    options = {"modes": again, "elements": elements, **({"interface": True} if interface else {"residual": residual})}
    counts = tuple((one.modes, one.static) for one in bodies)
    model = Model(scene, matrices, basis, numbers, shapes, counts, tuple(others), options)
    _warn_of_still_places(model)
    return model


def signed_like(model: Model, near: Model) -> Model:
    """The same model with the signs of shapes that one near it has; as it is where that has another number of them."""
    if len(model.omega) != len(near.omega):
        return model
    own, other = motions(model, near)
    signs = np.where(np.sum(own * other, axis=0) < 0.0, -1.0, 1.0)
    if np.all(signs > 0.0):
        return model
    basis = reduction.Basis(model.basis.vectors * signs, model.omega)
    shapes, *others = _shapes_of_each(model.scene, model.matrices, basis)
    return replace(model, basis=basis, shapes=shapes, others=tuple(others))


def likeness(model: Model, near: Model) -> float:
    """Least |cos| of the angles between the shapes of two models: 1 where all are the same but for signs."""
    if len(model.omega) != len(near.omega):  # which is refused where their states are compared
        return 1.0
    own, other = motions(model, near)
    sizes = np.linalg.norm(own, axis=0) * np.linalg.norm(other, axis=0)
    moving = sizes > 0.0  # those of impactors do not
    return float(np.min(np.abs(np.sum(own * other, axis=0))[moving] / sizes[moving], initial=1.0))


def motions(model: Model, near: Model) -> tuple[Vector, Vector]:
    """Shapes (k, n) of both at the same places: of bodies at all dofs of one mesh, else at places that both have."""
    pairs = list(zip((model.shapes, *model.others), (near.shapes, *near.others), strict=True))
    beams = any(isinstance(one, Shapes) for pair in pairs for one in pair)
    if not beams and model.basis.vectors.shape == near.basis.vectors.shape:
        return model.basis.vectors, near.basis.vectors
    own, other = zip(*(_at_same_places(*pair) for pair in pairs), strict=True)
    return np.vstack(own), np.vstack(other)


def _at_same_places(own: Any, other: Any) -> tuple[Vector, Vector]:
    """Shapes (k, n) of a body on two meshes, of a beam at equal parts of its length."""
    if isinstance(own, Shapes):
        along = np.linspace(0.0, 1.0, 4 * own.values.shape[1] + 9)
        return own(along * own.nodes[-1]), other(along * other.nodes[-1])
    places = [(own.known.index(place), k) for k, place in enumerate(other.known) if place in own.known]
    first, second = np.array(places, dtype=int).reshape(-1, 2).T
    return np.vstack(own.values[first]), np.vstack(other.values[second])


@dataclass(frozen=True, eq=False)
class _Reduced:
    """One body of a scene with the basis that it has by itself."""

    matrices: Matrices
    basis: reduction.Basis
    asked: tuple[int, ...] | None  # numbers of the modes; None with interface=True, where all shapes are modes

    @property
    def modes(self) -> int:
        """How many of its coordinates are modes."""
        return self.basis.count if self.asked is None else len(self.asked)

    @property
    def static(self) -> int:
        """How many are static shapes."""
        return self.basis.count - self.modes

    @property
    def numbers(self) -> tuple[int, ...]:
        """Mode numbers, static shapes numbered on."""
        if self.asked is None:
            return tuple(range(self.basis.count))
        return (*self.asked, *range(self.asked[-1] + 1, self.asked[-1] + 1 + self.static))


def check_reduction(
    scene: Scene,
    modes: int | Sequence[int] | str | None = None,
    elements: int | None = None,
    omega_max: float | None = None,
    mass_share: float | None = None,
    residual: bool = False,
    interface: bool = False,
) -> None:
    """Raise ValueError for arguments of `Scene.reduce` that no matrices are needed to refuse."""
    choices = {"modes": modes, "omega_max": omega_max, "mass_share": mass_share}
    given = [name for name, choice in choices.items() if choice is not None]
    require(len(given) < 2, "choose modes in one way", given, "Scene.reduce", "keep one of them")
    if isinstance(modes, str):
        require(modes == "all", "modes must be a count, a list, or 'all' with elements given", modes, "Scene.reduce",
                "ask for modes=2")  # fmt: skip
    elif modes is not None:
        _numbers(modes, interface)
    if omega_max is not None:
        reduction.below(omega_max)
    if mass_share is not None:
        right = is_finite(mass_share) and 0.0 < mass_share <= 1.0
        require(right, "mass_share must lie in (0, 1]", mass_share, "Scene.reduce", "try 0.95")
    check_counts(elements, None)
    _check_static(scene, residual, interface)


def check_mode_count(scene: Scene, modes: int, elements: int | None = None) -> None:
    """Raise ValueError for more modes than the scene's meshes have, as its matrices tell, or as one may have."""
    if elements is None and all(part.beam.meshed for part in (scene, *scene.bodies)):  # the mesh is as fine as needed
        require(modes <= MOST_MODES, f"modes must be at most {MOST_MODES}", modes, "Scene.reduce",
                "keep the modes up to a few times the highest frequency of interest")  # fmt: skip
    else:
        _chosen(scene, modes, elements, False)


def _of_beam(
    beam: Matrices, places: list[LocalCoordinate], chosen: tuple[int, ...], residual: bool, interface: bool, of: str
) -> reduction.Basis:
    """The basis of one beam by itself, static shapes where it is loaded included; `of`: its name in warnings."""
    if interface:
        return reduction.craig_bampton(beam.M, beam.K, _directions(beam, places), len(chosen), beam.root)
    basis = _modes(beam, chosen, of)
    rows = [*([_rows(beam, places)] if residual and places else []), *beam.following_loads]
    if rows:
        loads = sparse.vstack(rows).tocsr()
        loads = loads[np.flatnonzero(abs(loads).max(axis=1).toarray())]  # what acts on a support moves nothing
        if loads.shape[0]:
            basis = reduction.with_residual(basis, beam.M, beam.K, loads.T, beam.root)
    return basis


def _modes(beam: Matrices, chosen: tuple[int, ...], of: str) -> reduction.Basis:
    """Modes by their numbers; of a body one more is computed, so that of a cut pair always the same one stays."""
    size = beam.M.shape[0]
    if not isinstance(beam, BodyMatrices) or chosen[-1] >= size:
        return reduction.modal_basis(beam.M, beam.K, indices=chosen, root=beam.root)
    wide = _along_axes(reduction.modal_basis(beam.M, beam.K, min(chosen[-1] + 2, size), root=beam.root), beam)
    _warn_of_cut_pairs(beam, wide.omega, chosen, of)
    return reduction.Basis(wide.vectors[:, list(chosen)], wide.omega[list(chosen)])


def _rows(beam: Matrices, places: list[LocalCoordinate]) -> sparse.csr_matrix:
    """Rows of u or u_z, or of their difference between two places: their static shape is that of opposite loads."""
    return sparse.vstack([place.row(beam) for place in places], format="csr")


def _directions(beam: Matrices, places: list[LocalCoordinate]) -> sparse.csc_matrix:
    """Columns (N, m): the places, and what moving supports load."""
    return sparse.vstack([_rows(beam, places), *beam.following_loads]).T


def _oriented(basis: reduction.Basis, beam: Matrices, place: LocalCoordinate | None) -> reduction.Basis:
    """Positive at a place, or where each mode moves most; of equal frequencies the first along x, the next along y."""
    if isinstance(beam, BodyMatrices):
        basis = _along_axes(basis, beam)
    if place is None:
        return reduction.oriented(basis, None if beam.named else beam.interpolation(beam.nodes))
    return reduction.oriented(basis, place.row(beam))


def _along_axes(basis: reduction.Basis, beam: BodyMatrices) -> reduction.Basis:
    """Shapes of equal frequencies, turned: where they move most, the second is at rest along x, the third along y too.

    An arbitrary choice among them, as of the two planes of a round shaft, would be another one on another computer.
    """
    vectors, omega = basis.vectors.copy(), basis.omega.copy()
    components = np.array([component for _, component in beam.assembled.labels])
    kinds = [np.flatnonzero(components == one) for one in COMPONENTS if np.any(components == one)]
    for first in range(len(omega)):
        group = np.flatnonzero(np.abs(omega - omega[first]) <= EQUAL * omega[first])
        if group[0] < first or len(group) < 2 or omega[first] == 0.0 or not kinds:
            continue
        moved = np.asarray(beam.spread @ vectors[:, group])
        rows = [moved[own[np.argmax(np.linalg.norm(moved[own], axis=1))]] for own in kinds]
        size = max(np.linalg.norm(row) for row in rows)
        turn = np.linalg.qr(np.array([row for row in rows if np.linalg.norm(row) > EQUAL * size]).T, mode="complete")[0]
        vectors[:, group], omega[group] = vectors[:, group] @ turn, omega[group].mean()
    return reduction.Basis(vectors, omega)


def _joined(bases: list[reduction.Basis], matrices: Matrices) -> reduction.Basis:
    """The bases of the beams as blocks, with x = q/√m for every impactor."""
    if not matrices.bodies:
        return bases[0]
    from scipy.linalg import block_diag

    mass = np.array([impactor.mass for impactor in matrices.impactors])
    stiffness = np.array([impactor.stiffness for impactor in matrices.impactors])
    vectors = block_diag(*(basis.vectors for basis in bases), np.diag(1 / np.sqrt(mass)))
    return reduction.Basis(vectors, np.concatenate([*(basis.omega for basis in bases), np.sqrt(stiffness / mass)]))


def _shapes_of_each(scene: Scene, matrices: Matrices, basis: reduction.Basis) -> list[Shapes | PlacedShapes]:
    """The shapes of each beam on all coordinates: zero on those of other bodies."""
    shapes: list[Shapes | PlacedShapes] = []
    done = 0
    for number, (beam, own) in enumerate(zip(matrices.beams, (scene, *scene.bodies), strict=True)):
        size, parts, carried = beam.M.shape[0], own.part_places, carried_on(scene, beam, number)
        mine = basis.vectors[done : done + size]
        if isinstance(beam, BodyMatrices):
            shapes.append(placed_shapes(beam, mine, loaded(scene, number), carried, parts))
        else:
            shapes.append(Shapes(beam.nodes, beam.spread @ mine, carried, parts))
        done += size
    return shapes


def _warn_of_drift(scene: Scene, bodies: list[_Reduced]) -> None:
    """Warn when loads may carry a structure away that neither supports nor stops from several sides hold."""
    for number, (part, body) in enumerate(zip((scene, *scene.bodies), bodies, strict=True)):
        count = int(np.sum(body.basis.omega == 0.0))
        loads = bool(part.forces) or bool(scene.motions) or bool(scene.pulls)
        acting = [*part.stops, *(one for one in scene.acting if number and (one.coordinate.to or (0,))[0] == number)]
        free = body.matrices.named and not part.elements and sum(len(one.coordinates) for one in acting) < 2
        if free and count and loads:
            warn(carried_away(count, number, "structure"))


def _warn_of_still_places(model: Model) -> None:
    """Warn when no mode moves the place of a stop or element, such as one across the plane of all of them."""
    still = [one.name for one, own in zip(model.contact_rows, model.rows_of, strict=True)
             if not model.directions[own].any()]  # fmt: skip
    if still:
        named = ", ".join(repr(name) for name in still)
        said = f"no mode kept moves the place of {named}: nothing happens there; keep more modes, or residual=True"
        warn(said)


def _warn_of_cut_pairs(beam: Matrices, omega: Vector, chosen: tuple[int, ...], of: str) -> None:
    """Warn when of two modes of one frequency, such as those of a round section's two planes, one is kept.

    The body is named: Python shows a text once, and that of an equal body would be lost.
    """
    for i in chosen:
        near = np.flatnonzero(np.abs(omega - omega[i]) < PAIR * omega[i])
        if set(near.tolist()) <= set(chosen):
            continue
        what = "which whirl together" if beam.gyroscopic is not None else "that move across each other"
        cut = f"{counted(len(chosen), 'mode')}{of} cut{'s' * (len(chosen) == 1)} a pair of one frequency"
        said = f"{cut}, {omega[i]:.6g} rad/s, {what}; ask for one more"
        warn(said)
        return


def _warn_of_the_mesh(matrices: Matrices, omega: float) -> None:
    """Warn when elements given by number are far too coarse."""
    coarse = max(float(beam.frequency_error(omega)) for beam in matrices.beams)
    if coarse > COARSE:
        warn(f"elements are too coarse for the highest mode: its frequency is off by about {coarse:.1%}; "
             "leave them out: as few as the modes need are made")  # fmt: skip


def _chosen(
    scene: Scene, modes: Any, elements: int | None, interface: bool
) -> tuple[Matrices, tuple[int, ...], list[tuple[int, ...]]]:
    """The mesh, the mode numbers asked for, and those of each body: the same, but for those that it has not; or all."""
    if not isinstance(modes, str):
        asked = _numbers(modes, interface)
        count = max(asked, default=-1) + 1
        matrices = scene.matrices(elements, max(count, 1))
        most = [_most(body, loaded(scene, number), count, interface) for number, body in enumerate(matrices.beams)]
        largest = int(np.argmax(most))
        dofs = ("dofs inside" if interface else "free dofs") + f" of {body_words(largest)}" * bool(scene.bodies)
        require(count <= most[largest], f"modes must be at most {most[largest]} ({dofs})", modes, "Scene.reduce",
                "ask for fewer modes, or 'all'")  # fmt: skip
        chosen = [tuple(i for i in asked if i < size) for size in most]
        for number, own in enumerate(chosen):
            has = f"{body_words(number)} has {counted(most[number], 'mode')} only"
            require(bool(own) or interface, f"modes must name one that every body has ({has})", modes, "Scene.reduce",
                    "add 0")  # fmt: skip
        return matrices, asked, chosen
    meshed = any(part.beam.meshed for part in (scene, *scene.bodies))
    given = elements is not None or not meshed
    require(modes == "all" and given, "modes must be a count, a list, or 'all' with elements given",
            modes, "Scene.reduce", "say how many elements the mesh shall have")  # fmt: skip
    require(not interface, "modes must be a count with interface=True", modes, "Scene.reduce", "ask for modes=2")
    matrices = scene.matrices(elements)
    sizes = [beam.M.shape[0] for beam in matrices.beams]
    require(max(sizes) <= MOST_DENSE, f"modes='all' is for beams of at most {MOST_DENSE} free dofs", sizes,
            "Scene.reduce", "ask for fewer elements, or a count of modes")  # fmt: skip
    return matrices, (), [tuple(range(size)) for size in sizes]


def _most(body: Matrices, places: list[LocalCoordinate], count: int, interface: bool) -> int:
    """How many modes a body has, with its interface held fewer; at least `count` where they are enough."""
    size: int = body.M.shape[0]
    if not interface:
        return size
    directions = _directions(body, places)
    if count + directions.shape[1] <= size:
        return size
    return reduction.dofs_inside(body.M, body.K, directions, body.root)


def _numbers(modes: Any, interface: bool) -> tuple[int, ...]:
    """Mode numbers, ascending; the basis checks them."""
    whole = is_whole(modes)
    require(whole or is_listed(modes), "modes must be a whole number or a list of them", modes, "Scene.reduce",
            "ask for modes=2, or modes=[0, 2]")  # fmt: skip
    require(not whole or modes <= MOST_DOFS, f"modes must be at most {MOST_DOFS}", modes, "Scene.reduce", "take fewer")
    numbers = list(range(int(modes))) if whole else list(modes)
    right = all(is_whole(i) and i >= 0 for i in numbers) and len(set(numbers)) == len(numbers)
    require(right, "mode numbers must be whole, from 0, each once", modes, "Scene.reduce", "ask for modes=[0, 2]")
    listed = [int(i) for i in numbers]
    enough = len(listed) > 0 or (interface and whole and modes == 0)
    require(enough, "modes must be a count above 0 or a list of mode numbers", modes, "Scene.reduce",
            "ask for modes=2, or modes=[0, 2]")  # fmt: skip
    require(not interface or whole, "modes must be a count with interface=True", modes, "Scene.reduce",
            "ask for modes=2")  # fmt: skip
    return tuple(sorted(listed))


def _check_static(scene: Scene, residual: bool, interface: bool) -> None:
    """Raise ValueError when static shapes are asked for twice, or have no place to be loaded at."""
    for name, choice in (("residual", residual), ("interface", interface)):
        require_switch(name, choice, "Scene.reduce")
    require(not (residual and interface), "residual and interface exclude each other", True, "Scene.reduce",
            "keep one: either makes the model exact for slow loads at its places")  # fmt: skip
    places = [bool(loaded(scene, body)) for body in range(1 + len(scene.bodies))]
    met = all(places) if interface else any(places) or not residual
    asked = "interface=True" if interface else "residual=True"
    without = [f"bodies[{number - 1}]" for number, has in enumerate(places) if number and not has]
    rule = "static shapes need a stop, a force or a dashpot, or an element" + ", on every body" * bool(without)
    got = f"none on {', '.join(without)}" if without and places[0] else "none"
    if not met:
        raise ValueError(f"{rule}, got {got} in Scene.reduce; leave out {asked}, or add one")


def _enough(scene: Scene, elements: int | None, omega_max: float | None, mass_share: float | None) -> int:
    """How many modes of every beam reach omega_max, or carry mass_share; meshes grow with the modes tried."""
    tried = FIRST_TRY // 2
    while tried < MOST_TRIED:
        tried = min(2 * tried, MOST_TRIED)
        matrices = scene.matrices(elements, None if elements else tried)
        named = [f", of {body_words(number)}" * bool(scene.bodies) for number in range(len(matrices.beams))]
        pairs = zip(matrices.beams, named, strict=True)
        counts = [_enough_of(beam, tried, omega_max, mass_share, of) for beam, of in pairs]
        if None not in counts:
            return max(count for count in counts if count is not None)
    goal = f"omega_max = {omega_max:g}" if omega_max is not None else f"mass_share = {mass_share}"
    raise ValueError(f"{goal} must be reached by {MOST_TRIED} modes in Scene.reduce, got less; lower it, or give modes")


def _carrying(basis: reduction.Basis, beam: Matrices, way: str, share: float) -> int | None:
    """How many modes carry a share of the mass that a motion of the frame moves; 1 if it moves none."""
    mass, load = beam.moved_masses[way], beam.base_loads[way]
    return reduction.carrying(share, load, mass)(basis) if mass > 0.0 or not beam.named else 1


def _enough_of(
    beam: Matrices, tried: int, omega_max: float | None, mass_share: float | None, of: str = ""
) -> int | None:
    """How many of a beam's modes are enough; None if those tried are not."""
    tried = min(tried, beam.M.shape[0])
    basis = reduction.modal_basis(beam.M, beam.K, tried, root=beam.root)
    if omega_max is not None:
        enough = reduction.below(omega_max)
    else:
        counts = [_carrying(basis, beam, way, float(mass_share or 0.0)) for way in beam.base_loads]
        return None if None in counts and tried < beam.M.shape[0] else max((c or tried for c in counts), default=1)
    count = enough(basis)
    if count is None and tried == beam.M.shape[0]:
        return tried
    require(count is None or count > 0, f"omega_max must reach the first frequency, {basis.omega[0]:.6g} rad/s{of}",
            omega_max, "Scene.reduce", "raise it")  # fmt: skip
    return count
