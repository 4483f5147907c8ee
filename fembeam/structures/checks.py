"""Checks of given matrices: what is refused before computing, and sentences with numbers about what is accepted."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse
from scipy.sparse import linalg as sparse_linalg

from fembeam.structures.assembled import COMPONENTS
from fembeam.structures.directions import nearest
from fembeam.support import LARGEST, has_switches, is_finite, require

if TYPE_CHECKING:
    from fembeam.structures.structure import Structure

Vector = NDArray[np.float64]
Label = tuple[Hashable, str]
KINDS = (*COMPONENTS, "mode")  # the last of a generalised coordinate, such as a mode between fixed interfaces
SYMMETRIC = 1e-8  # of the largest entry: files with nine digits pass
NEGATIVE = -1e-9  # pivot of M over its diagonal, below which M is indefinite
STIFF = 1e-6  # of |K| |r|: below it K r = 0, a rigid motion meets no resistance
FEW = 6  # frequencies shown
LARGE = 1000.0  # m: a longer structure looks like one in millimetres
THIN, DENSE = 1e-5, 1e5  # kg/m³ of mass over the cube of the size: outside, units are mixed
ENTRIES = 8  # names shown of a long list


def matrix(name: str, values: Any, where: str) -> sparse.csr_matrix:
    """A given matrix as sparse CSR, square, finite, symmetric to rounding; ValueError with the number that is wrong."""
    values = real(name, values, where)
    try:
        found = sparse.csr_matrix(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} must be a real matrix, dense or sparse: {error} in {where}") from None
    size = found.shape
    require(size[0] == size[1] and size[0] > 0, f"{name} must be square", size, where, "give (N, N)")
    require(bool(np.isfinite(found.data).all()), f"{name} must be finite", "NaN or infinite entries", where,
            "check the export; held dofs may carry 1e36 or inf on the diagonal")  # fmt: skip
    return found


def real(name: str, values: Any, where: str) -> Any:
    """Numbers without their imaginary parts; ValueError where there are any, or what is no number."""
    values = values.tocsr() if sparse.issparse(values) else values
    given: Any = values.data if sparse.issparse(values) else values
    try:
        kind: str = np.asarray(given).dtype.kind
    except ValueError:  # rows of unequal length
        kind = "O"
    right = kind in "iufc" and not has_switches(given)
    require(right, f"{name} must be numbers", values, where, "give an array of them")
    size = np.abs(np.asarray(given))
    largest = float(size.max(initial=0.0, where=np.isfinite(size)))
    require(largest <= LARGEST, f"{name} must be finite", largest, where, "check units and the export")
    if kind != "c":
        return values
    turned = float(np.abs(np.imag(given)).max(initial=0.0))
    require(turned == 0.0, f"{name} must be real; its largest imaginary part is", turned, where,
            "give damping as C, as ratios of modes or as dashpots: motion in time has no complex K")  # fmt: skip
    return values.real if sparse.issparse(values) else np.real(values)


def symmetric(name: str, given: sparse.csr_matrix, labels: Sequence[Label], where: str) -> sparse.csr_matrix:
    """(A + Aᵀ)/2; ValueError, with the worst entry, unless it differs from A by rounding only."""
    left = abs(given - given.T).tocoo()
    most, largest = float(left.data.max(initial=0.0)), float(abs(given).max())
    if most > SYMMETRIC * largest:
        worst = int(np.argmax(left.data))
        pair = f"{_of(labels[left.row[worst]])} and {_of(labels[left.col[worst]])}"
        raise ValueError(f"{name} must be symmetric, got entries that differ by {most:.3g} of {largest:.3g}"
                         f" between {pair} in {where}; was one triangle exported?")  # fmt: skip
    result = ((given + given.T) / 2).tocsr()
    result.eliminate_zeros()
    result.sum_duplicates()
    return result


def labelled(labels: Any, size: int, where: str) -> tuple[Label, ...]:
    """Checked labels, one a dof: (node, component), none twice."""
    if labels is None:
        return tuple((i, "x") for i in range(size))
    require(isinstance(labels, Iterable), "labels must be a list", labels, where, "give (node, 'x'), (node, 'y'), …")
    listed = [tuple(label) if isinstance(label, (tuple, list, np.ndarray)) else (label,) for label in labels]
    require(len(listed) == size, f"labels must be {size}, one for each dof of K", len(listed), where,
            "give (node, 'x'), (node, 'y'), … in the order of the rows")  # fmt: skip
    found: dict[Label, int] = {}
    for i, label in enumerate(listed):
        right = len(label) == 2 and label[1] in KINDS and isinstance(label[0], (str, int, np.integer))
        require(right, f"labels[{i}] must be a node and one of {', '.join(KINDS)}", listed[i], where,
                "write (20, 'x')")  # fmt: skip
        node = label[0] if isinstance(label[0], str) else int(label[0])
        require((node, label[1]) not in found, f"labels must not repeat: dof {found.get((node, label[1]))} and dof {i}",
                (node, label[1]), where, "name each dof once")  # fmt: skip
        found[node, label[1]] = i
    return tuple(found)


def positive_mass(M: sparse.csr_matrix, labels: Sequence[Label], where: str) -> None:
    """Raise ValueError, with the number, unless M is positive semidefinite."""
    diagonal = M.diagonal()
    low = int(np.argmin(diagonal))
    require(bool(diagonal[low] >= 0), f"M must be positive semidefinite; the mass of {_of(labels[low])} is negative",
            float(diagonal[low]), where, "check signs and the order of the matrices")  # fmt: skip
    bare = np.flatnonzero(diagonal == 0).tolist()
    loose = [i for i in bare if M[i].nnz]
    require(not loose, f"M must be positive semidefinite; {_of(labels[loose[0]]) if loose else ''} has no mass of its "
            "own but coupling to others", float(abs(M[loose[0]]).max()) if loose else 0.0, where,
            "check the export")  # fmt: skip
    heavy = np.flatnonzero(diagonal > 0)
    require(heavy.size > 0, "M must not be zero", 0.0, where, "give the mass matrix")
    least = _least_pivot(M[heavy][:, heavy], diagonal[heavy])
    require(least >= NEGATIVE, "M must be positive semidefinite; its least pivot over the diagonal is negative", least,
            where, "check the export; Lagrange multipliers make matrices indefinite")  # fmt: skip


def _least_pivot(M: sparse.csr_matrix, diagonal: Vector) -> float:
    """The least pivot of M scaled to a unit diagonal, of its LDLᵀ factors."""
    unit = sparse.diags(1 / np.sqrt(diagonal))
    scaled = (unit @ M @ unit + 1e-12 * sparse.eye(len(diagonal))).tocsc()
    if scaled.nnz > 0.2 * len(diagonal) ** 2:
        return float(linalg.eigh(scaled.toarray(), eigvals_only=True, subset_by_index=(0, 0))[0])
    options = {"SymmetricMode": True, "Equil": False}
    try:
        factors = sparse_linalg.splu(scaled, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    except RuntimeError:
        return 0.0
    return float(factors.U.diagonal().min())


def placed(
    nodes: Mapping[Any, Any] | None, points: Mapping[str, Any] | None, labels: Sequence[Label], where: str
) -> tuple[dict[Hashable, Vector], dict[str, Hashable]]:
    """Coordinates (3,) of the nodes, and the node of every point; ValueError for what does not exist."""
    known = list(dict.fromkeys(node for node, _ in labels))
    where_are: dict[Hashable, Vector] = {}
    for name, named_by in (("nodes", nodes), ("points", points)):
        require(named_by is None or isinstance(named_by, Mapping), f"{name} must be a dict by name", named_by, where,
                "write {20: (0.1, 0, 0)} of nodes, {'lever': 20} of points")  # fmt: skip
    for node, given in (nodes or {}).items():
        listed = list(given) if isinstance(given, (Sequence, np.ndarray)) and not isinstance(given, str) else []
        right = len(listed) in (2, 3) and all(is_finite(x) for x in listed)
        require(right, f"nodes[{node!r}] must be three numbers, or two in the plane", given, where, "give m")
        where_are[node] = np.append(np.array(listed, dtype=float), np.zeros(3 - len(listed)))
    named: dict[str, Hashable] = {}
    for name, node in (points or {}).items():
        require(isinstance(name, str) and bool(name), "a point must have a name", name, where, "write {'lever': 88}")
        one = int(node) if isinstance(node, np.integer) else node
        require(one in known, f"point {name!r} must be a node of labels; {nearest(one, known)}", one, where, "use that")
        named[name] = one
    return where_are, named


def sentences(structure: Structure) -> Iterator[str]:
    """What a structure is, in sentences with numbers; see `Structure.check`."""
    yield f"{structure!r}: nodes move along {', '.join(structure.components)}"
    if structure.massless:
        some = ", ".join(_of(label) for label in structure.massless[:ENTRIES])
        more = f" and {len(structure.massless) - ENTRIES} more" if len(structure.massless) > ENTRIES else ""
        have = "dofs have no mass and follow" if len(structure.massless) > 1 else "dof has no mass and follows"
        yield f"{len(structure.massless)} {have} the others statically (Guyan): {some}{more}"
    yield from _rigid(structure)
    yield from _mass(structure)
    yield from _units(structure)
    yield from _frequencies(structure)


def _rigid(structure: Structure) -> Iterator[str]:
    """Whether K r = 0 for the rigid motions."""
    free: list[tuple[str, float]] = []
    held: list[tuple[str, float]] = []
    for name, r in rigid_motions(structure).items():
        force, size = structure.K @ r, abs(structure.K) @ np.abs(r)
        left = float(np.abs(force).max() / size.max()) if size.max() > 0 else 0.0
        (free if left <= STIFF else held).append((name, left))
    if free:
        worst = max(left for _, left in free)
        yield f"K r = 0 to {worst:.1g} of |K||r| for the rigid motions {', '.join(name for name, _ in free)}"
    if held:
        told = ", ".join(f"{name} ({left:.2g} of |K||r|)" for name, left in held)
        yield (f"K resists the rigid motions {told}: the structure is grounded there, or its dofs are in "
               "another order than the labels")  # fmt: skip
    if not structure.nodes and len(structure.components) > 1:
        yield "rotations were not checked: give nodes, {node: (x, y, z)}"


def rigid_motions(structure: Structure) -> dict[str, Vector]:
    """Unit rigid motions (N,) by name: translations, and rotations where all nodes are known."""
    nodes, components = zip(*structure.labels, strict=True)
    found = {c: np.array([float(c == one) for one in components]) for c in COMPONENTS[:3] if c in components}
    if not all(node in structure.nodes for node in nodes):
        return found
    at = np.array([structure.nodes[node] for node in nodes])
    for i, name in enumerate(COMPONENTS[3:]):
        moved = np.cross(np.eye(3)[i], at)  # (N, 3): u = θ × x
        parts = {**dict(zip(COMPONENTS[:3], moved.T, strict=True)), name: np.ones(len(at))}
        r = np.array([parts[c][j] if c in parts else 0.0 for j, c in enumerate(components)])
        if np.any(r):
            found[name] = r
    return found


def _mass(structure: Structure) -> Iterator[str]:
    """rᵀMr along x, y, z, equal for a whole structure."""
    moved = {c: float(r @ structure.M @ r) for c, r in rigid_motions(structure).items() if c in COMPONENTS[:3]}
    if moved:
        yield f"rᵀMr: {', '.join(f'{mass:.6g} kg along {c}' for c, mass in moved.items())}"
    if moved and max(moved.values()) > 1.001 * min(moved.values()):
        yield "the mass is not the same along all axes: dofs are missing, or in another order than the labels"


def _units(structure: Structure) -> Iterator[str]:
    """Size and mass that no structure has in metres and kilograms."""
    motions = rigid_motions(structure)
    mass = max((float(motions[c] @ structure.M @ motions[c]) for c in COMPONENTS[:3] if c in motions), default=0.0)
    places = np.array(list(structure.nodes.values())).reshape(-1, 3)
    size = float(np.linalg.norm(np.ptp(places, axis=0))) if len(places) else 0.0
    advice = "is it in other units? give scale=Scale('mm', 't', 's') or what they are"
    if size > LARGE:
        yield f"the nodes span {size:.6g} m: {advice}"
    if mass > 0.0 and size > 0.0 and not THIN <= mass / size**3 <= DENSE:
        yield f"a mass of {mass:.6g} kg over {size:.6g} m: {advice}"


def _frequencies(structure: Structure) -> Iterator[str]:
    """The lowest frequencies, nothing held."""
    from reduction import modal_basis

    own = structure.condensed()
    count = min(FEW, own.M.shape[0])
    try:
        omega = modal_basis(own.M, own.K, count).omega
    except ValueError as error:
        yield f"no frequencies without supports: {error}"
        return
    listed = ", ".join(f"{w / (2 * np.pi):.6g}" for w in omega)
    yield f"lowest frequencies without supports: {listed} Hz"


def _of(label: Label) -> str:
    """A dof in words."""
    return f"dof {label[1]!r} of node {label[0]!r}"
