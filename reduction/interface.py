"""Bases that are right for slow loads at chosen places: residual shapes, Craig–Bampton, Guyan.

A direction b (N,) is where a stop or a force acts; its static shape ψ solves K ψ = b, its static compliance is bᵀψ.
Modes alone keep Σ (bᵀφ_i)²/ω_i² of it. What they miss has the shape

    r = ψ - Σ φ_i (bᵀφ_i)/ω_i²,        Φᵀ M r = 0,   Φᵀ K r = 0,

so that adding r restores the compliance and counts nothing twice. On rigid-body modes ψ is the elastic shape of b and
the inertia forces that balance it (inertia relief).
"""

from __future__ import annotations

import numpy as np
from scipy import linalg, sparse
from scipy.sparse import linalg as sparse_linalg

from reduction.basis import AccuracyError, Basis, Vector, checked_basis, oriented, reals
from reduction.modal import ORTHONORMALITY_TOLERANCE, Matrix, cancelling, checked_pair, factored, modal_basis, ritz

STATIC_TOLERANCE = 1e-9  # relative error of static compliance, given a root; 1e-13 but where elements are 1e-4 long
STATIC_WITHOUT_ROOT = 2e-6  # same; rounding of K alone, up to 6e-7 on fine meshes
COUPLING_TOLERANCE = 2e-8  # of φᵀ K r over the two frequencies: rounding, eps (length/h)², of elements of 1e-4
NOTHING_LEFT = 1e-12  # share of the static compliance below which a shape is rounding and adds none
NOTHING_WITHOUT_ROOT = 1e-8  # same
DEPENDENT = 1e-9  # smallest pivot of directions that counts
SINGULAR = (
    "K must not be singular but for the rigid-body modes of the basis, got rigid-body modes that are not in the basis, "
    "or stiffnesses too far apart to tell; keep all rigid-body modes, or use less extreme stiffnesses"
)
BALANCED = 1e-6  # relative: strain energy and work of the loads agree, unless K is singular
REFINEMENTS = 3  # of static solutions; on 5000 elements the third one changes nothing
REFINEMENTS_SOFT = 12  # same under compression: the nearer to buckling, the fewer digits each gains


def with_residual(basis: Basis, M: Matrix, K: Matrix, directions: Matrix, root: Matrix | None = None) -> Basis:
    """Modes with the residual static shape of every direction behind them.

    Parameters
    ----------
    basis : n modes of (M, K), any choice of them, all rigid-body modes included.
    M, K : (N, N) as for `modal_basis`.
    directions : (N, m), dense or sparse, a column for each stop or force.
    root : (k, N) with rootᵀ root = K, optional: full accuracy on fine meshes.

    Returns
    -------
    Basis : the n modes as they were, then up to m pseudo-modes, by frequency. Directions that depend on others or
        that the modes carry wholly (to 1e-12 of the static compliance, 1e-8 without root) add none.

    Raises
    ------
    ValueError : directions that do not fit, or rigid-body modes left out of the basis.
    AccuracyError : not orthonormal, coupled to the modes, or static compliance off by more than 1e-9 (2e-6 without
        root).

    Notes
    -----
    Exact for slow loads; a pseudo-mode's own frequency lies above those left out and means nothing by itself.

    References
    ----------
    R.R. Craig, A.J. Kurdila, Fundamentals of Structural Dynamics, Wiley 2006, ch. 17 (residual attachment modes).

    Examples
    --------
    >>> M, K = np.eye(3), np.diag([1.0, 4.0, 16.0])
    >>> basis = with_residual(modal_basis(M, K, 1), M, K, [[1.0], [1.0], [1.0]])
    >>> float(np.sum(basis.project([1.0, 1.0, 1.0]) ** 2 / basis.omega**2))  # 1 + 1/4 + 1/16
    1.3125
    """
    M, K = checked_pair(M, K, "with_residual")
    B = _directions(directions, K.shape[0], "with_residual")
    still = checked_basis(basis, "with_residual").vectors[:, basis.omega == 0.0]
    shapes = static_shapes(M, K, B, still, root)
    left = _orthogonal(shapes, basis.vectors, M)
    turned = _recombined(B, _strain(K, root, left), np.diag(_strain(K, root, shapes)), root)
    if not turned.size:
        return basis
    left = static_shapes(M, K, turned, still, root)
    for _ in range(2):  # the second time for what rounding left where shapes differ little in mass
        omega, left = ritz(M, K, root, _orthogonal(left, basis.vectors, M))
    extended = Basis(np.hstack((basis.vectors, left)), np.append(basis.omega, omega))
    _check(extended, M, K, root, B, B.T @ shapes, "with_residual")
    return extended


def craig_bampton(M: Matrix, K: Matrix, directions: Matrix, count: int, root: Matrix | None = None) -> Basis:
    """Static shapes of the interface plus the lowest `count` modes with the interface held (Craig–Bampton).

        u = Ψ u_b + Φ_i q,      Ψ: unit displacement of one direction, the others held;   Φ_i: bᵀφ = 0 for all b

    Parameters
    ----------
    M, K : (N, N) as for `modal_basis`.
    directions : (N, m), dense or sparse: bᵀu are the interface displacements (of stops and forces).
    count : modes with the interface held, ≥ 0; 0 is Guyan's condensation.
    root : (k, N) with rootᵀ root = K, optional: full accuracy on fine meshes.

    Returns
    -------
    Basis : m + count vectors with the reduced pencil diagonalised, lowest first. Dependent directions count once.

    Raises
    ------
    ValueError : directions that do not fit; a structure that can still move freely with its interface held.
    AccuracyError : not orthonormal, or static compliance of the interface off by more than 1e-9
        (2e-6 without root).

    Notes
    -----
    Exact for slow loads on the interface of a structure that is held. On one that floats such loads accelerate it,
    and the inertia forces inside are met only by the modes: residual shapes are exact there.

    References
    ----------
    R.R. Craig, M.C.C. Bampton, AIAA Journal 6 (1968) 1313. R.J. Guyan, AIAA Journal 3 (1965) 380.

    Examples
    --------
    >>> K = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    >>> basis = craig_bampton(np.eye(3), K, [[0.0], [0.0], [1.0]], count=1)
    >>> float(np.sum(basis.project([0.0, 0.0, 1.0]) ** 2 / basis.omega**2))  # three springs in series
    3.0
    """
    M, K = checked_pair(M, K, "craig_bampton")
    B = _directions(directions, K.shape[0], "craig_bampton")
    T, m = _interface_coordinates(_apart(M, K, B, root))
    most = K.shape[0] - m
    if isinstance(count, bool) or not isinstance(count, (int, np.integer)) or not 0 <= count <= most:
        raise ValueError(
            f"count must be 0 to {most} (dofs inside), got {count!r} in craig_bampton; ask for fewer modes"
        )
    inside, interface = T[:, :most], T[:, most:]
    vectors = _held(K, root, inside, interface)
    if count:
        R_i = None if root is None else sparse.csr_matrix(root) @ inside
        held = modal_basis(inside.T @ M @ inside, inside.T @ K @ inside, int(count), root=R_i)
        if held.omega[0] == 0.0:
            raise ValueError("the structure must not move freely with its interface held, got a rigid-body mode in "
                             "craig_bampton; use modes with residual shapes")  # fmt: skip
        vectors = np.hstack((vectors, inside @ held.vectors))
    for _ in range(2):  # the second time for what rounding left
        omega, vectors = ritz(M, K, root, vectors)
    basis = oriented(Basis(vectors, omega))
    still = basis.vectors[:, basis.omega == 0.0]
    exact = _compliance(basis, B) if still.size else B.T @ static_shapes(M, K, B, still, root)
    _check(basis, M, K, root, B, exact, "craig_bampton")
    return basis


def dofs_inside(M: Matrix, K: Matrix, directions: Matrix, root: Matrix | None = None) -> int:
    """How many modes `craig_bampton` can find with the interface held: all dofs but one for each independent direction.

    Arguments and errors as for `craig_bampton`.

    Examples
    --------
    >>> dofs_inside(np.eye(3), np.diag([1.0, 4.0, 9.0]), [[1.0, 2.0], [0.0, 0.0], [0.0, 0.0]])
    2
    """
    M, K = checked_pair(M, K, "dofs_inside")
    B = _directions(directions, K.shape[0], "dofs_inside")
    return int(K.shape[0]) - _interface_coordinates(_apart(M, K, B, root))[1]


def guyan(M: Matrix, K: Matrix, directions: Matrix, root: Matrix | None = None) -> Basis:
    """Static shapes of the given directions only: `craig_bampton` without modes.

    R.J. Guyan, AIAA J. 3 (1965) 380; arguments as for `craig_bampton`.

    Examples
    --------
    >>> guyan(np.eye(2), np.diag([1.0, 4.0]), np.array([[1.0], [0.0]])).count
    1
    """
    return craig_bampton(M, K, directions, 0, root)


def static_share(basis: Basis, M: Matrix, K: Matrix, directions: Matrix, root: Matrix | None = None) -> Vector:
    """Share (m,) of the static compliance of each direction that a basis keeps: Σ (bᵀφ_i)²/ω_i² / bᵀK⁻¹b.

    Never above 1; for rigid-body modes (which must be in the basis) the elastic compliance is meant. Arguments and
    errors as for `with_residual`.

    Examples
    --------
    >>> M, K = np.eye(2), np.diag([1.0, 4.0])
    >>> static_share(modal_basis(M, K, 1), M, K, [[1.0], [1.0]])
    array([0.8])
    """
    M, K = checked_pair(M, K, "static_share")
    B = _directions(directions, K.shape[0], "static_share")
    shapes = static_shapes(M, K, B, checked_basis(basis, "static_share").vectors[:, basis.omega == 0.0], root)
    return np.diag(_compliance(basis, B)) / np.sum(B * shapes, axis=0)


def static_shapes(M: Matrix, K: Matrix, B: Vector, rigid: Vector, root: Matrix | None = None) -> Vector:
    """Elastic shapes ψ (N, m) under unit loads B, balanced by inertia on the rigid-body modes (N, r).

    K ψ = B - M R RᵀB,    RᵀM ψ = 0        (solved with its constraint, refined through the root)

    Parameters
    ----------
    M, K : (N, N) as for `modal_basis`.
    B : (N, m) unit loads, a column each.
    rigid : R (N, r), all rigid-body modes, RᵀM R = 1; r = 0 for a structure that is held.
    root : (k, N) with rootᵀ root = K, optional: full accuracy on fine meshes.

    Raises
    ------
    ValueError : a motion that nothing resists is not among the rigid-body modes.

    Examples
    --------
    >>> K = np.array([[2.0, -1.0], [-1.0, 1.0]])
    >>> static_shapes(np.eye(2), K, np.array([[0.0], [1.0]]), np.zeros((2, 0))).round(12).tolist()
    [[1.0], [2.0]]
    """
    r, inertia = rigid.shape[1], M @ rigid
    try:
        if r:
            factors = sparse_linalg.splu(sparse.bmat([[K, inertia], [inertia.T, None]], format="csc"))
        else:
            factors = factored(sparse.csc_matrix(K))
    except RuntimeError:
        raise ValueError(SINGULAR) from None
    load = B - inertia @ (rigid.T @ B)
    shapes = np.zeros_like(B)
    for _ in range(_passes(root)):
        missing = load - _force(K, root, shapes)
        shapes = shapes + factors.solve(np.vstack((missing, np.zeros((r, B.shape[1])))))[: len(B)]
        shapes = _orthogonal(shapes, rigid, M)
    work = np.sum(load * shapes, axis=0)
    if not np.all(np.abs(np.diag(_strain(K, root, shapes)) - work) <= BALANCED * work):
        raise ValueError(SINGULAR)
    return shapes


def _directions(directions: Matrix, size: int, where: str) -> Vector:
    """Checked columns (N, m)."""
    B = reals(directions.toarray() if sparse.issparse(directions) else directions, "directions", where)
    if B.ndim != 2 or B.shape[0] != size or B.shape[1] == 0:
        raise ValueError(f"directions must have shape ({size}, m), m > 0, got {B.shape} in {where}; give columns")
    if not np.all(np.isfinite(B)) or not np.all(np.any(B != 0, axis=0)):
        raise ValueError(f"directions must be finite and not zero in {where}; check where stops and forces act")
    return B


def _orthogonal(v: Vector, basis: Vector, M: Matrix) -> Vector:
    """The part of v that is M-orthogonal to a basis; twice, for what rounding left the first time."""
    for _ in range(2):
        v = v - basis @ (basis.T @ (M @ v))
    return v


def _recombined(B: Vector, compliance: Vector, size: Vector, root: Matrix | None) -> Vector:
    """Combinations of the directions (N, m) whose shapes are far from dependent; those without a share are dropped.

    Two directions side by side become their sum and their difference, a moment. Solved anew, its shape is as accurate
    as any; as the difference of two shapes it would lose the digits that they share.
    """
    unit = 1 / np.sqrt(size)
    share, turn = np.linalg.eigh(unit[:, None] * compliance * unit)
    kept = share > (NOTHING_WITHOUT_ROOT if root is None else NOTHING_LEFT)
    return (B * unit) @ turn[:, kept] / np.sqrt(share[kept])


def _apart(M: Matrix, K: Matrix, B: Vector, root: Matrix | None) -> Vector:
    """Combinations of the directions (N, m) that are far from dependent, by their shapes and their rigid-body parts."""
    rigid = _rigid_modes(M, K, root)
    compliance = _strain(K, root, static_shapes(M, K, B, rigid, root))
    carried = rigid.T @ B
    moved, bent = np.abs(carried).max(initial=0.0), np.sqrt(np.abs(compliance).max())
    both = compliance + carried.T @ carried * ((bent / moved) ** 2 if moved else 0.0)
    return _recombined(B, both, np.diag(both), root)


def _rigid_modes(M: Matrix, K: Matrix, root: Matrix | None) -> Vector:
    """All rigid-body modes (N, r)."""
    count, basis = 1, modal_basis(M, K, 1, root=root)
    while basis.omega[-1] == 0.0 and count < K.shape[0]:
        count = min(2 * count + 1, K.shape[0])
        basis = modal_basis(M, K, count, root=root)
    return basis.vectors[:, basis.omega == 0.0]


def _strain(K: Matrix, root: Matrix | None, u: Vector) -> Vector:
    """Products uᵀKu, through the root if there is one: twice the strain energies, without the cancellation in K."""
    if root is None:
        return u.T @ (K @ u)
    stretched = sparse.csr_matrix(root) @ u
    return (stretched.T @ stretched).real


def _interface_coordinates(B: Vector) -> tuple[sparse.csc_matrix, int]:
    """T (N, N) with u = T [inside dofs, Bᵀu], and the number m of independent directions."""
    N = len(B)
    unit = B / np.linalg.norm(B, axis=0)
    _, triangle, columns = linalg.qr(unit, mode="economic", pivoting=True)
    m = int(np.sum(np.abs(np.diag(triangle)) > DEPENDENT))
    kept = B[:, np.sort(columns[:m])]
    pivots = linalg.qr(kept.T, mode="r", pivoting=True)[1][:m]  # dofs that give way for Bᵀu
    others = np.setdiff1d(np.arange(N), pivots)
    inverse = np.linalg.inv(kept[pivots].T)
    T = sparse.lil_matrix((N, N))
    T[others, np.arange(N - m)] = 1.0
    T[np.ix_(pivots, np.arange(N - m))] = -inverse @ kept[others].T
    T[np.ix_(pivots, np.arange(N - m, N))] = inverse
    return sparse.csc_matrix(T), m


def _held(K: Matrix, root: Matrix | None, inside: sparse.csc_matrix, interface: sparse.csc_matrix) -> Vector:
    """Static shapes (N, m) of unit interface displacements: no force inside, refined through the root."""
    try:
        factors = factored(inside.T @ K @ inside)
    except RuntimeError:
        raise ValueError("the structure must not move freely with its interface held, got a singular stiffness in "
                         "craig_bampton; use modes with residual shapes") from None  # fmt: skip
    shapes = interface.toarray()
    for _ in range(_passes(root)):
        shapes = shapes - inside @ factors.solve(inside.T @ _force(K, root, shapes))
    return shapes


def _passes(root: Matrix | None) -> int:
    """How many solutions, the first and its refinements."""
    return 1 + (REFINEMENTS_SOFT if root is not None and np.iscomplexobj(root) else REFINEMENTS)


def _force(K: Matrix, root: Matrix | None, u: Vector) -> Vector:
    """K u, through the root if there is one."""
    if root is None:
        return np.asarray(K @ u)
    R = sparse.csr_matrix(root)
    return np.asarray((R.T @ (R @ u)).real)


def _compliance(basis: Basis, B: Vector) -> Vector:
    """BᵀΦΩ⁻²ΦᵀB (m, m) of the elastic vectors."""
    elastic = basis.omega > 0
    scaled = basis.project(B)[elastic] / basis.omega[elastic, None]
    return scaled.T @ scaled


def _check(basis: Basis, M: Matrix, K: Matrix, root: Matrix | None, B: Vector, exact: Vector, where: str) -> None:
    """Raise AccuracyError unless orthonormal, decoupled, and statically exact."""
    strain = _strain(K, root, basis.vectors)
    coupling, static = STATIC_WITHOUT_ROOT, STATIC_WITHOUT_ROOT
    if root is not None:
        lost = np.max(cancelling(root, basis.vectors, basis.omega))
        coupling, static = COUPLING_TOLERANCE * lost, STATIC_TOLERANCE * lost
    size, stiff = np.sqrt(np.diag(exact)), np.where(basis.omega > 0, basis.omega, basis.omega.max())
    errors = {
        "orthonormal": (basis.project_matrix(M) - np.eye(basis.count), ORTHONORMALITY_TOLERANCE),
        "free of shared stiffness": ((strain - np.diag(basis.omega**2)) / np.outer(stiff, stiff), coupling),
        "statically exact": ((_compliance(basis, B) - exact) / np.outer(size, size), static),
    }
    for what, (error, tolerance) in errors.items():
        worst = np.abs(error).max()
        if not worst <= tolerance:
            raise AccuracyError(
                f"the basis must be {what} to {tolerance:.3g}, got {worst:.3g} in {where}; "
                "use less extreme stiffnesses, places farther apart, or a coarser mesh"
            )
