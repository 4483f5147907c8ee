"""Modes of the undamped structure: K φ = ω² M φ, φᵀMφ = 1.

Fine beam meshes are hard on this problem: rounding of K alone moves ω² by about eps ω_max², for n Hermite
elements eps n⁴ of the lowest. Given a factor R with RᵀR = K (curvatures instead of stiffness), the shapes are
corrected until they settle and the frequencies are the singular values of R Φ; there rounding is about eps n² only.
Rows that soften, as compression does, are imaginary: K = BᵀSB with S = diag(±1) has the root R = √S B.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse
from scipy.sparse import linalg as sparse_linalg

from reduction.basis import AccuracyError, Basis, Vector, oriented, reals

Matrix: TypeAlias = Any  # dense or sparse

LARGE = 20_000  # dofs from which factors take seconds: ordered and pivoted as symmetric ones, half of that
TINY_PIVOT = 1e-3  # of the largest number in its column
DENSE_LIMIT = 60  # free dofs; dense stays faster up to 300, by 1 ms
SOFT, CLEARED = 1e-6, 3  # of the largest ω², below which its rounding counts; times this is taken out
ORTHONORMALITY_TOLERANCE = 1e-9
RESIDUAL_TOLERANCE = 1e-9  # of the largest terms in K φ - ω² M φ
SYMMETRY_TOLERANCE = 1e-9
SHIFT = 1e-12  # of the median of K_ii/M_ii: above rounding of K, not far above the lowest elastic ω²
WIDER = (1.0, 1e3, 1e4)  # times that shift, where the modes do not settle
RIGID = 1e-7  # of √(|φ|ᵀ|K||φ|): rounding of K, a few √eps, hides lower frequencies
DECIMALS = 1e-9  # of max K_ii/M_ii: what numbers of few decimals, as of DMIG cards, may make of ω² = 0
RIGID_WITH_ROOT = 1e-12  # of max √(K_ii/M_ii), when R is given: rounding stays below 4e-14 up to 2000 elements
ROUNDED, GAP = 10.0, 1e6  # times that: rounding of superelements reaches 1.2e-12; no elastic mode within the gap behind
GUARDS = 6  # so many more vectors than wanted are corrected: a mode next to the last one wanted settles too slowly
SETTLED = 1e-9  # relative change of the frequencies by the last correction
SHAPED = 1e-11  # same, of the shapes' curvature
STALLED = 0.25  # of the correction before: the shapes' rounding, about eps (length/h)², is reached
MOST_CORRECTIONS = 10
UNSTABLE = "K must be positive semi-definite, got omega² = {:.6g} in modal_basis; the structure is unstable"


def modal_basis(
    M: Matrix, K: Matrix, count: int | None = None, indices: Sequence[int] | None = None, root: Matrix | None = None
) -> Basis:
    """Mass-normalised modes, lowest first: K φ = ω² M φ, φᵀMφ = 1.

    Parameters
    ----------
    M : (N, N)
        Symmetric, positive definite, dense or sparse.
    K : (N, N)
        Symmetric, positive semi-definite, dense or sparse.
    count :
        The lowest `count` modes, 1 ≤ count ≤ N; None with indices None: all N.
    indices :
        Mode numbers instead, from 0, distinct, in any order (the basis is ordered by frequency).
    root : (k, N)
        R with RᵀR = K, optional: low modes of fine meshes to full accuracy. Each row real, or imaginary where it
        takes from K.

    Returns
    -------
    Basis : signs as `oriented(basis)`; use `oriented` with a direction for another rule.

    Raises
    ------
    ValueError : bad counts, indices or matrices; K indefinite.
    AccuracyError : ΦᵀMΦ differs from 1 by more than 1e-9, or the residual is above 1e-9 of its terms.

    Notes
    -----
    Frequencies below 1e-7 √(|φ|ᵀ|K||φ|), with `root` below 1e-12 max √(K_ii/M_ii), are rounding and are returned as
    exactly 0.0: rigid-body modes. A soft part is so found beside any stiff one, but not behind a link 1e13 times as
    stiff, which leaves K no digits for it. Several rigid-body modes are an arbitrary orthonormal set of the rigid
    motions. Above 60 dofs modes come from sparse shift-invert Lanczos, unless more than a quarter is asked for.

    References
    ----------
    B.N. Parlett, The Symmetric Eigenvalue Problem, SIAM 1998, ch. 11 (Rayleigh–Ritz) and 13 (shift-invert).

    Examples
    --------
    >>> modal_basis(np.eye(2), np.diag([4.0, 9.0]), count=1).omega
    array([2.])
    """
    M, K = checked_pair(M, K, "modal_basis")
    wanted = _wanted(M.shape[0], count, indices)
    _check_mass(M)
    highest = int(wanted[-1]) + 1
    basis = _settled(M, K, None if root is None else sparse.csr_matrix(root), highest)
    return oriented(Basis(basis.vectors[:, wanted], basis.omega[wanted]))


def _guarded(size: int, count: int) -> int:
    """`count` and guards behind, as many as leave `_solve` its way."""
    return max(count, min(count + GUARDS, size if size <= DENSE_LIMIT else size // 4))


def _solve(M: sparse.csc_matrix, K: sparse.csc_matrix, count: int, factor: float = 1.0) -> tuple[Vector, Vector]:
    """The lowest `count` pairs (ω², φ), dense when the problem is small or most modes are wanted."""
    size = M.shape[0]
    if size <= DENSE_LIMIT or 4 * count > size:
        values, vectors = _dense(M.toarray(), K.toarray())
        return values[:count], vectors[:, :count]
    start = np.random.default_rng(0).standard_normal(size)  # fixed: the same basis every time
    shift, inverse = factor * _shift(M, K), None
    if size >= LARGE:  # else that of ARPACK
        inverse = sparse_linalg.LinearOperator(K.shape, factored(K + shift * M).solve, dtype=float)
    pairs = sparse_linalg.eigsh(K, count, M, sigma=-shift, which="LM", v0=start, OPinv=inverse)
    order = np.argsort(pairs[0])
    return pairs[0][order], pairs[1][:, order]


def factored(A: Any) -> Any:
    """Factors of a sparse matrix like K; those of a large one keep to its diagonal, unless a pivot there is tiny."""
    if A.shape[0] < LARGE:
        return sparse_linalg.splu(A.tocsc())
    options = {"SymmetricMode": True}
    return sparse_linalg.splu(A.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=TINY_PIVOT, options=options)


def _dense(M: Vector, K: Vector) -> tuple[Vector, Vector]:
    """All pairs; soft ones, in which there is rounding of the stiffest, are cleared of it and found again."""
    k, phi = linalg.eigh(K, M)
    soft = np.abs(k) < SOFT * np.abs(k).max(initial=0.0)
    if not soft.any():
        return k, phi
    cleared, stiff = phi[:, soft], phi[:, ~soft]
    for _ in range(CLEARED):
        cleared = cleared - stiff @ ((stiff.T @ (K @ cleared)) / k[~soft, None])
    stiff = stiff - cleared @ (cleared.T @ M @ stiff)
    own = cleared.T @ K @ cleared
    k[soft], turn = _dense(cleared.T @ M @ cleared, 0.5 * (own + own.T))
    k, phi = np.concatenate((k[soft], k[~soft])), np.hstack((cleared @ turn, stiff))
    order = np.argsort(k, kind="stable")
    return k[order], phi[:, order]


def _shift(M: sparse.csc_matrix, K: sparse.csc_matrix) -> float:
    """σ that makes K + σ M regular, rigid-body modes or not."""
    return float(SHIFT * np.median(K.diagonal() / M.diagonal())) or 1.0


def _scale(M: sparse.csc_matrix, K: sparse.csc_matrix) -> float:
    """A frequency near the highest: max √(K_ii/M_ii)."""
    return float(np.sqrt(np.max(np.abs(K.diagonal()) / M.diagonal())))


def _without_root(M: sparse.csc_matrix, K: sparse.csc_matrix, omega_squared: Vector, vectors: Vector) -> Basis:
    """Frequencies from ω², rigid-body modes set to zero."""
    scale = _scale(M, K) ** 2
    low = omega_squared <= RIGID**2 * scale
    if low.any():
        omega_squared[low] = np.sum(vectors[:, low] * (K @ vectors[:, low]), axis=0)
    hidden = _hidden(K, vectors)
    if np.any(omega_squared < -hidden):
        share = float(-omega_squared.min()) / scale
        rounded = f", or K is rounded, for this is {share:.1g} of the highest: give more digits" * (share < DECIMALS)
        raise ValueError(UNSTABLE.format(omega_squared.min()) + rounded)
    return _ascending(np.sqrt(np.where(omega_squared > hidden, omega_squared, 0.0)), vectors)


def _hidden(K: Any, vectors: Vector) -> Vector:
    """ω² below which that of each shape is rounding of K."""
    return np.asarray(RIGID**2 * np.sum(np.abs(vectors) * (abs(K) @ np.abs(vectors)), axis=0))


def _ascending(omega: Vector, vectors: Vector) -> Basis:
    """Modes in the order of their frequencies."""
    order = np.argsort(omega, kind="stable")
    return Basis(vectors[:, order], omega[order])


def _settled(M: sparse.csc_matrix, K: sparse.csc_matrix, R: sparse.csr_matrix | None, count: int) -> Basis:
    """The verified basis, where need be with a larger shift: rounding may hide several rigid motions in space."""
    failure = None
    for factor in WIDER:
        try:
            if R is None:
                basis = _without_root(M, K, *_solve(M, K, count, factor))
            else:
                vectors = _solve(M, K, _guarded(M.shape[0], count), factor)[1]
                basis = _with_root(M, K, R, vectors, factor * _shift(M, K), count)
            _verify(basis, M, K)
        except AccuracyError as error:
            failure = failure or error
        else:
            return basis
    assert failure is not None
    raise failure


def _with_root(
    M: sparse.csc_matrix, K: sparse.csc_matrix, R: sparse.csr_matrix, vectors: Vector, shift: float, count: int
) -> Basis:
    """Rayleigh–Ritz in R, then corrections by the residual in R until the lowest `count` frequencies settle."""
    mismatch = abs(R.T @ R - K).max() if R.shape[1] == K.shape[0] else np.inf
    if not mismatch <= SYMMETRY_TOLERANCE * abs(K).max():
        raise ValueError(f"root must satisfy rootᵀ root = K, got a difference of {mismatch} in modal_basis; fix it")
    solve: Callable[[Vector], Vector] = factored(K + shift * M).solve
    omega, vectors = _ritz(M, K, R, vectors)
    rigid = _rigid_with_root(omega, _scale(M, K))
    change, turn, before, corrections = np.inf, np.inf, np.inf, 0
    while not (change <= SETTLED and (turn <= SHAPED or turn > STALLED * before)):
        if corrections == MOST_CORRECTIONS:
            raise AccuracyError(
                f"frequencies must settle to {SETTLED}, got a change of {change:.3g} in modal_basis; "
                "use fewer elements or less extreme stiffnesses"
            )
        step, old = solve((R.T @ (R @ vectors)).real - (M @ vectors) * omega**2), omega
        before, turn = turn, _largest(np.linalg.norm(R @ step, axis=0)[:count], omega[:count], rigid)
        omega, vectors = _ritz(M, K, R, vectors - step)
        change = _largest((np.abs(omega - old) / cancelling(R, vectors, omega))[:count], omega[:count], rigid)
        corrections += 1
    return Basis(vectors[:, :count], np.where(omega <= rigid, 0.0, omega)[:count])


def _rigid_with_root(omega: Vector, scale: float) -> float:
    """The frequency up to which modes are rigid-body motions: what rounding of R makes of zero; omega ascends."""
    limit = RIGID_WITH_ROOT * scale
    elastic = omega[omega > ROUNDED * limit]
    return ROUNDED * limit if elastic.size and elastic[0] > GAP * limit else limit


def _largest(part: Vector, omega: Vector, rigid: float) -> float:
    """The largest part of an elastic mode's frequency."""
    return float(np.max(np.divide(part, omega, out=np.zeros_like(omega), where=omega > rigid)))


def ritz(M: Matrix, K: Matrix, root: Matrix | None, vectors: Vector) -> tuple[Vector, Vector]:
    """Frequencies and mass-normalised shapes of the pencil reduced to the span of the vectors, lowest first."""
    unit = vectors / np.sqrt(np.sum(vectors * (M @ vectors), axis=0))
    if root is None:
        squares, rotation = _dense(unit.T @ (M @ unit), unit.T @ (K @ unit))
        vectors = unit @ rotation
        basis = _ascending(np.sqrt(np.where(squares > _hidden(K, vectors), squares, 0.0)), vectors)
        return basis.omega, basis.vectors
    omega, vectors = _ritz(M, K, sparse.csr_matrix(root), unit)
    return np.where(omega <= _rigid_with_root(omega, _scale(M, K)), 0.0, omega), vectors


def _ritz(M: sparse.csc_matrix, K: sparse.csc_matrix, R: sparse.csr_matrix, vectors: Vector) -> tuple[Vector, Vector]:
    """Best frequencies and shapes in the span of the vectors: singular values of R Φ, lowest first."""
    try:
        factor = linalg.cholesky(vectors.T @ (M @ vectors), lower=True)
    except linalg.LinAlgError:
        raise AccuracyError("modes must be independent, got some that rounding made alike in modal_basis; "
                            "use fewer elements or less extreme stiffnesses") from None  # fmt: skip
    vectors = linalg.solve_triangular(factor, vectors.T, lower=True).T
    strain = R @ vectors
    if np.iscomplexobj(strain):
        omega, rotation = _softened(strain, RIGID_WITH_ROOT * _scale(M, K))
        return omega, vectors @ rotation
    missing = max(0, strain.shape[1] - strain.shape[0])  # R of a free body may have fewer rows than modes
    _, omega, rotation = linalg.svd(np.pad(strain, ((0, missing), (0, 0))), full_matrices=False)
    return omega[::-1], vectors @ rotation.T[:, ::-1]


def cancelling(R: Matrix, vectors: Vector, omega: Vector) -> Vector | float:
    """‖R φ‖²/ω² (n,): what rounding of ω² grows by where compression takes much of it, near buckling; 1 of real R."""
    if not np.iscomplexobj(R):
        return 1.0
    energy = np.linalg.norm(sparse.csr_matrix(R) @ vectors, axis=0) ** 2
    return np.asarray(np.divide(energy, omega**2, out=np.ones_like(omega), where=omega > 0.0))


def _softened(strain: Vector, level: float) -> tuple[Vector, Vector]:
    """Frequencies, lowest first, and their combinations (n, n) of shapes with strains real and imaginary by rows.

    strainᵀ strain + level² = AᵀA by Cholesky, which keeps each shape to its own size as strains do; ω² + level² are the
    squares of the singular values of A. Without the level, far below elastic ω, rounding may make ω² = 0 negative.
    """
    square = (strain.T @ strain).real
    try:
        _, found, rotation = linalg.svd(linalg.cholesky(square + level**2 * np.eye(len(square))))
    except linalg.LinAlgError:
        raise ValueError(UNSTABLE.format(np.linalg.eigvalsh(square)[0])) from None
    return np.sqrt(np.maximum(found**2 - level**2, 0.0))[::-1], rotation.T[:, ::-1]


def _verify(basis: Basis, M: sparse.csc_matrix, K: sparse.csc_matrix) -> None:
    """Raise AccuracyError unless ΦᵀMΦ = 1 and K φ = ω² M φ."""
    error = np.abs(basis.project_matrix(M) - np.eye(basis.count)).max()
    if not error <= ORTHONORMALITY_TOLERANCE:
        raise AccuracyError(f"modes must be orthonormal to {ORTHONORMALITY_TOLERANCE}, got {error:.3g} in modal_basis")
    residual = _residual(basis, M, K).max()
    if not residual <= RESIDUAL_TOLERANCE:
        raise AccuracyError(f"K φ - ω² M φ must be below {RESIDUAL_TOLERANCE}, got {residual:.3g} in modal_basis")


def _residual(basis: Basis, M: sparse.csc_matrix, K: sparse.csc_matrix) -> Vector:
    """‖K φ - ω² M φ‖ of each mode over the size of its terms, every dof in units of √M_ii.

    Of rigid motions these are at least the largest K_ii/M_ii, as in a mesh: superelements have but rounding there.
    """
    unit = 1 / np.sqrt(M.diagonal())[:, None]
    phi, lam = basis.vectors, basis.omega**2
    residual = np.linalg.norm(unit * (K @ phi - (M @ phi) * lam), axis=0)
    terms = np.linalg.norm(unit * (abs(K) @ np.abs(phi) + (abs(M) @ np.abs(phi)) * lam), axis=0)
    terms = np.where(lam > 0.0, terms, np.maximum(terms, _scale(M, K) ** 2))
    return residual / np.where(terms > 0, terms, 1.0)


def _wanted(size: int, count: int | None, indices: Sequence[int] | None) -> NDArray[np.int64]:
    """Sorted mode numbers, checked."""
    if count is not None and indices is not None:
        raise ValueError(f"count or indices, not both, got {count} and {indices} in modal_basis; drop one")
    if indices is None:
        number = size if count is None else count
        if isinstance(number, bool) or not isinstance(number, (int, np.integer)) or not 1 <= number <= size:
            raise ValueError(f"count must be 1 to {size} (free dofs), got {count!r} in modal_basis; "
                             "ask for fewer modes or use more elements")  # fmt: skip
        return np.arange(number)
    wanted = np.asarray(indices)
    if wanted.ndim != 1 or wanted.size == 0 or wanted.dtype.kind not in "iu":
        raise ValueError(f"indices must be a list of mode numbers, got {indices!r} in modal_basis; e.g. [0, 2]")
    if wanted.min() < 0 or wanted.max() >= size or len(set(wanted.tolist())) < wanted.size:
        raise ValueError(f"indices must be distinct, 0 to {size - 1}, got {indices!r} in modal_basis; fix the list")
    return np.sort(wanted)


def checked_matrix(A: Matrix, name: str, where: str) -> sparse.csc_matrix:
    """A as sparse float matrix, checked: square, finite, symmetric; ``where`` is the caller, for the message."""
    given = A.tocsc() if sparse.issparse(A) else reals(A, name, where)
    if sparse.issparse(A):
        reals(given.data, name, where)
    matrix = sparse.csc_matrix(given, dtype=float)
    if matrix.shape[0] != matrix.shape[1] or matrix.shape[0] == 0:
        raise ValueError(f"{name} must be square, got shape {matrix.shape} in {where}; give (N, N)")
    if not np.all(np.isfinite(matrix.data)):
        raise ValueError(f"{name} must be finite, got NaN or infinite entries in {where}; check the assembly")
    difference = abs(matrix - matrix.T).max()
    if difference > SYMMETRY_TOLERANCE * abs(matrix).max():
        raise ValueError(f"{name} must be symmetric, got a difference of {difference:.3g} in {where}; "
                         "use (A + Aᵀ)/2 if that is what you mean")  # fmt: skip
    return matrix


def checked_pair(M: Matrix, K: Matrix, where: str) -> tuple[sparse.csc_matrix, sparse.csc_matrix]:
    """Both checked, and of one size."""
    mass, stiffness = checked_matrix(M, "M", where), checked_matrix(K, "K", where)
    if mass.shape != stiffness.shape:
        raise ValueError(
            f"M and K must have the same shape, got {mass.shape} and {stiffness.shape} in {where}; match them"
        )
    return mass, stiffness


def _check_mass(M: sparse.csc_matrix) -> None:
    """Raise ValueError unless M is positive definite (all pivots of its LDLᵀ factors positive)."""
    pivots = M.diagonal()
    if np.all(pivots > 0):
        try:
            options = {"SymmetricMode": True, "Equil": False}
            factors = sparse_linalg.splu(M, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
            pivots = factors.U.diagonal()
        except RuntimeError:  # exactly singular
            pivots = np.zeros(1)
    if not np.all(pivots > 0):
        raise ValueError(f"M must be positive definite, got a pivot of {pivots.min():.3g} in modal_basis; "
                         "give every dof some mass")  # fmt: skip
