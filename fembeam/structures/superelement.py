"""Superelements: a body in few unknowns, by Craig and Bampton.

u = T q̂,    T = [1 0; Ψ Φ],    Ψ = -K_ii⁻¹ K_ib

q̂ are the motions u_b of the interface nodes, then the modes Φ of the rest with these held. K̂ = TᵀKT has no coupling
between the two. A rigid motion r of a free body is one of the interface alone, and M̂ keeps its mass; of one that its
own K holds it is none of q̂, so that the load TᵀM r of a base motion is kept too.

R.R. Craig, M.C.C. Bampton, AIAA Journal 6 (1968) 1313.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

import reduction
from fembeam.structures.assembled import COMPONENTS, Assembled
from fembeam.structures.joints import translations_of
from fembeam.support import is_whole, require

if TYPE_CHECKING:
    from fembeam.structures.structure import Structure

Vector = NDArray[np.float64]
UNIT = 1e-12  # of 1: entries of a row that stands for one dof
ROUNDED = 1e-12  # of the terms a strain is the sum of: of rigid motions rounding leaves some 1e-14
HIDDEN = 1e-14  # of the terms a stiffness is the sum of, as in `reduction.modal_basis`


def reduced(body: Any, made: Assembled, nodes: Sequence[Any], modes: int, where: str) -> Structure:
    """The superelement of a body's matrices, on some of its nodes; `Structure.reduced` explains the arguments."""
    from fembeam.structures.structure import Structure

    whole = is_whole(modes) and modes >= 0
    require(whole, "modes must be a whole number, at least 0", modes, where, "0 keeps static shapes alone")
    listed = list(dict.fromkeys(nodes))
    require(made.gyroscopic is None, "a body that spins must stay as it is", body, where, "leave its spin out")
    interface = {(node, c): dof for node in listed for c, dof in _dofs(body, made, node, where).items()}
    kept = np.array(list(interface.values()), dtype=int)
    rest = np.setdiff1d(np.arange(made.M.shape[0]), kept)
    require(modes <= len(rest), f"modes must be at most {len(rest)}, the dofs between the nodes", modes, where,
            "ask for fewer")  # fmt: skip
    T = _shapes(made, kept, rest, int(modes), where)
    labels = [*interface, *((f"mode {i + 1}", "mode") for i in range(int(modes)))]
    (K, root), M = _stiffness(made, T, len(kept)), T.T @ (made.M @ T)
    C = None if made.C is None else T.T @ (made.C @ T)
    at = {node: body.position(node) for node in listed}
    known = {node: place for node, place in at.items() if place is not None}
    points = {name: node for name, node in body.points.items() if hasattr(body, "node") and node in at}
    lines = [pair for pair in _lines(body) if set(pair) <= set(known)]
    found = Structure(K, (M + M.T) / 2, C, labels, known, points, lines)
    along = [translations_of(body).index(c) for c in translations_of(found)]
    return found.knowing(root, np.asarray(T.T @ made.base_loads[:, along]))


def interface_of(nodes: Any, where: str) -> list[Any]:
    """Nodes as a list with one at least, or ValueError; a name by itself would be a list of letters."""
    listed = list(nodes) if isinstance(nodes, Iterable) and not isinstance(nodes, str) else []
    require(bool(listed), "nodes must name the places of joints, supports and stops", nodes, where, "write ['A', 'B']")
    return listed


def _dofs(body: Any, made: Assembled, node: Any, where: str) -> dict[str, int]:
    """{component: number of the dof} of a node."""
    body.check_place(node, where)
    rows = made.rows(node).tocsr()
    found = {}
    for component, row in zip(body.components, rows, strict=True):
        if row.nnz:
            single = row.nnz == 1 and abs(row.data[0] - 1.0) < UNIT
            require(single, "an interface must be at nodes of the body", node, where, "make a node of the place")
            found[component] = int(row.indices[0])
    ordered = {component: found[component] for component in COMPONENTS if component in found}
    require(bool(ordered), "an interface must move", node, where, "name another node")
    return ordered


def _shapes(made: Assembled, kept: NDArray[np.int64], rest: NDArray[np.int64], modes: int, where: str) -> Vector:
    """T (N, n): static shapes of the interface, then modes with it held."""
    size, count = made.M.shape[0], len(kept)
    T = np.zeros((size, count + modes))
    T[kept, np.arange(count)] = 1.0
    if not len(rest):
        return T
    M, K = (A[rest][:, rest] for A in (made.M, made.K))
    root = None if made.root is None else made.root[:, rest]
    basis = reduction.modal_basis(M, K, max(modes, 1), root=root)
    loose = int(np.sum(basis.omega == 0.0))
    require(loose == 0, "the nodes together must hold the body", f"{loose} motions without resistance", where,
            "name more of them")  # fmt: skip
    solve = sparse_linalg.splu(K.tocsc()).solve
    T[rest, :count] = -solve(made.K[rest][:, kept].toarray())
    if root is not None:  # forces from strains, in which rigid motions cancel better than in K
        T[rest, :count] -= solve((root.T @ (made.root @ T[:, :count])).real)
    T[rest, count:] = basis.vectors[:, :modes]
    return T


def _stiffness(made: Assembled, T: Vector, count: int) -> tuple[Vector, sparse.csr_matrix | None]:
    """TᵀKT, and R with RᵀR = TᵀKT where one of K is known; interface and modes are not coupled."""
    if made.root is None:
        K = np.asarray(T.T @ (made.K @ T))
        terms = np.sum(np.abs(T[:, :count]) * (abs(made.K) @ np.abs(T[:, :count])), axis=0)
        K[:count, :count] = _stiffnesses(K[:count, :count], np.sqrt(terms))
        K[:count, count:], K[count:, :count] = 0.0, 0.0
        K[count:, count:] = np.diag(np.diag(K)[count:])
        return (K + K.T) / 2, None
    strain = np.asarray(made.root @ T)
    size = np.linalg.norm(abs(made.root) @ np.abs(T[:, :count]), axis=0)
    interface = _strains(strain[:, :count].real, size)
    if np.iscomplexobj(strain):  # rows are real or imaginary
        interface = np.vstack([interface, 1j * _strains(strain[:, :count].imag, size)])
    modes = np.sqrt(np.sum(strain[:, count:] ** 2, axis=0).real)
    root = sparse.block_diag([interface, np.diag(modes)], format="csr")
    return (root.T @ root).real.toarray(), root


def _stiffnesses(K: Vector, size: Vector) -> Vector:
    """K (n, n) free of what rounding, in parts of size² (n,), makes of rigid motions."""
    unit = np.where(size > 0.0, size, 1.0)
    found, shapes = np.linalg.eigh((K + K.T) / (2 * np.outer(unit, unit)))
    shapes = shapes[:, np.abs(found) > HIDDEN] * unit[:, None]
    return np.asarray(shapes * found[np.abs(found) > HIDDEN] @ shapes.T)


def _strains(strain: Vector, size: Vector) -> Vector:
    """R (≤ n, n) with RᵀR = strainᵀ strain, free of what rounding, in parts of `size` (n,), makes of rigid motions.

    Beside the frequencies of the mesh that is nothing, beside the few of a superelement it is not.
    """
    unit = np.where(size > 0.0, size, 1.0)
    triangle = np.linalg.qr(strain / unit, mode="r")
    left, found, _ = np.linalg.svd(triangle)
    return np.asarray(left[:, found > ROUNDED].T @ triangle * unit)


def _lines(body: Any) -> list[tuple[Any, Any]]:
    """Pairs of nodes that figures may join: of a frame the ends of its members."""
    return [(one.a, one.b) for one in body.members] if hasattr(body, "members") else list(body.edges)
