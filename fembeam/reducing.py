"""From a scene to a reduced model: which modes, which static shapes, on which mesh."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse

import reduction
from fembeam.assembly import Matrices
from fembeam.model import Model, Shapes
from fembeam.section import require

if TYPE_CHECKING:
    from fembeam.scene import Scene

DEFAULT_MODES = 2
FIRST_TRY = 8  # modes, doubled until a frequency or share of mass is reached
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
    ways = {"modes": modes, "omega_max": omega_max, "mass_share": mass_share}
    given = [name for name, way in ways.items() if way is not None]
    require(len(given) < 2, "choose modes in one way", given, "Scene.reduce", "keep one of them")
    _check_static(scene, residual, interface)
    if omega_max is not None or mass_share is not None:
        modes = _enough(scene, elements, omega_max, mass_share)
    chosen = _numbers(scene, DEFAULT_MODES if modes is None else modes, elements, interface)
    matrices = scene.matrices(elements, max(chosen, default=0) + 1)
    directions = matrices.interpolation(scene.loaded_places).T
    if interface:
        full = matrices.M, matrices.K, directions, len(chosen), matrices.root
        basis = reduction.craig_bampton(*full)
        way: dict[str, Any] = {"modes": len(chosen), "elements": elements, "interface": True}
        return _model(scene, matrices, basis, tuple(range(basis.count)), 0, way)
    basis = reduction.modal_basis(matrices.M, matrices.K, indices=chosen, root=matrices.root)
    if residual:
        basis = reduction.with_residual(basis, matrices.M, matrices.K, directions, matrices.root)
    static, above = basis.count - len(chosen), chosen[-1] + 1
    way = {"modes": chosen, "elements": elements, "residual": residual}
    return _model(scene, matrices, basis, (*chosen, *range(above, above + static)), static, way)


def _model(
    scene: Scene, matrices: Matrices, basis: reduction.Basis, numbers: tuple[int, ...], static: int, way: dict[str, Any]
) -> Model:
    """The model of a basis, with the library's signs."""
    if scene.stops:
        direction: sparse.csr_matrix = matrices.interpolation(scene.stops[0].z)
    else:
        direction = matrices.interpolation(matrices.nodes)
    basis = reduction.oriented(basis, direction)
    values = np.zeros((matrices.dofs.size, basis.count))
    values[matrices.dofs.ravel() >= 0] = basis.vectors
    return Model(scene, matrices, basis, numbers, Shapes(matrices.nodes, values), static, way)


def _numbers(scene: Scene, modes: Any, elements: int | None, interface: bool) -> tuple[int, ...]:
    """Mode numbers, ascending; the basis checks them."""
    if isinstance(modes, str):
        require(modes == "all" and elements is not None, "modes must be a count, a list, or 'all' with elements given",
                modes, "Scene.reduce", "say how many elements the mesh shall have")  # fmt: skip
        return tuple(range(scene.matrices(elements).M.shape[0]))
    whole = isinstance(modes, (int, np.integer)) and not isinstance(modes, bool)
    listed = list(range(int(modes))) if whole else [int(i) for i in modes]
    enough = len(listed) > 0 or (interface and whole and modes == 0)
    require(enough, "modes must be a count above 0 or a list of mode numbers", modes, "Scene.reduce",
            "ask for modes=2, or modes=[0, 2]")  # fmt: skip
    require(not interface or whole, "modes must be a count with interface=True", modes, "Scene.reduce",
            "ask for modes=2")  # fmt: skip
    return tuple(sorted(listed))


def _check_static(scene: Scene, residual: bool, interface: bool) -> None:
    """Raise ValueError when static shapes are asked for twice, or have no place to be loaded at."""
    require(not (residual and interface), "residual and interface exclude each other", True, "Scene.reduce",
            "keep one: either makes the model exact for slow loads at stops and forces")  # fmt: skip
    require(not (residual or interface) or bool(scene.loaded_places), "static shapes need a stop or a force", 0,
            "Scene.reduce", "leave out residual and interface")  # fmt: skip


def _enough(scene: Scene, elements: int | None, omega_max: float | None, mass_share: float | None) -> int:
    """How many modes reach omega_max, or carry mass_share; meshes grow with the modes tried."""
    tried = FIRST_TRY // 2
    while tried < MOST_TRIED:
        tried = min(2 * tried, MOST_TRIED)
        matrices = scene.matrices(elements, None if elements else tried)
        tried = min(tried, matrices.M.shape[0])
        basis = reduction.modal_basis(matrices.M, matrices.K, tried, root=matrices.root)
        if omega_max is not None:
            enough = reduction.below(omega_max)
        else:
            mass = reduction.moved_mass(matrices.M, matrices.base_load)
            enough = reduction.carrying(float(mass_share or 0.0), matrices.base_load, mass)
        count = enough(basis)
        if count is None and tried == matrices.M.shape[0]:
            count = tried
        if count is not None:
            require(count > 0, f"omega_max must reach the first frequency, {basis.omega[0]:.6g} rad/s", omega_max,
                    "Scene.reduce", "raise it")  # fmt: skip
            return count
    goal = f"omega_max = {omega_max:g}" if omega_max is not None else f"mass_share = {mass_share}"
    raise ValueError(f"{goal} must be reached by {MOST_TRIED} modes in Scene.reduce, got less; lower it, or give modes")
