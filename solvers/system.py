r"""The mechanical problem an integrator is handed, and its decoupled form.

.. math:: M \ddot q + C \dot q + K q = \sum_l v_l s_l(t) + \sum_s w_s F_s(δ_s, \dot δ_s),\qquad δ_s = -w_s^T q - g_s

Every method here integrates the same decoupled form: n blocks (p_j, v_j) with

    p_j' = v_j + ...,   v_j' = -k_j p_j - c_j v_j + ...,   z = [p, v],   [q, q'] = T z.

With proportional damping p is the modal coordinate and T = diag(Φ, Φ). Otherwise each complex pair (or pair
of real eigenvalues) of the state matrix gives one block, and loads and contacts push p as well as v.
Runge–Kutta and exact propagation commute with this change of coordinates, so nothing is lost by it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

_ONE_THREAD = 200_000  # multiplications below which BLAS stays on one thread
Array = NDArray[np.float64]


class Law(Protocol):
    """What a contact law must offer.

    The C signature of ``address`` is
    ``void (int64 n, double *delta, double *delta_dot, double entry_rate, double *parameters, double *force)``.
    """

    knots: tuple[float, ...]
    jump: bool
    exponent: float
    entry_rate_floor: float

    @property
    def address(self) -> int:
        """Address of the compiled force."""

    @property
    def gradient_address(self) -> int:
        """Address of its derivatives: the same arguments, then arrays for ∂F/∂δ, ∂F/∂δ̇ and ∂F/∂entry_rate."""

    @property
    def parameters(self) -> Array:
        """Numbers for the compiled force."""

    def force(self, delta: ArrayLike, delta_dot: ArrayLike, entry_rate: ArrayLike) -> Array:
        """Force on arrays."""


Signal = Callable[[Any], Any]
"""A function t -> value that broadcasts; may offer ``tones()`` or ``nodes(duration, rtol)``, see `solvers.forcing`."""


@dataclass(frozen=True, eq=False)
class Contact:
    """One stop: ``delta = -direction @ q - gap``; it pushes with ``+direction * force`` while ``delta > 0``.

    Parameters
    ----------
    direction : (n,), the way the stop pushes.
    law : a contact law, such as those of the package `contacts`.
    gap : clearance in m; negative for a preload.

    Examples
    --------
    >>> from contacts import Hertz
    >>> Contact([0.0, 1.0], Hertz(1e9), gap=1e-3).gap
    0.001
    """

    direction: Array
    law: Law
    gap: float = 0.0

    def __post_init__(self) -> None:
        direction = np.array(self.direction, dtype=float, ndmin=1)
        if direction.ndim != 1 or not np.all(np.isfinite(direction)):
            raise ValueError(f"direction of a Contact must be a finite vector, got {self.direction!r}")
        if not np.isfinite(self.gap):
            raise ValueError(f"gap must be finite, got {self.gap!r}; use no Contact at all for a stop out of reach")
        if not hasattr(self.law, "entry_rate_floor") or isinstance(self.law, type):
            hint = "decorate the function with @law and call it" if callable(self.law) else "use one of contacts"
            raise TypeError(f"law of a Contact must be a contact law, got {self.law!r}; {hint}")
        direction.setflags(write=False)
        object.__setattr__(self, "direction", direction)
        object.__setattr__(self, "gap", float(self.gap))


@dataclass(frozen=True, eq=False)
class System:
    """Matrices, contacts and loads of one problem, M q̈ + C q̇ + K q = Σ v_l s_l(t) + Σ w_s F_s(δ_s, δ̇_s).

    Parameters
    ----------
    M, C, K : (n, n), dense or SciPy sparse; M symmetric positive definite, C and K symmetric. Sparse ones stay sparse
        for methods that step on matrices; other methods, and `blocks`, take n³ operations once.
    contacts : sequence of `Contact`.
    loads : sequence of ``(vector (n,), signal)``.

    Raises
    ------
    ValueError for shapes that do not fit, entries that are not finite, or M not positive definite.

    Examples
    --------
    >>> mass = System(M=[[2.0]], C=[[0.0]], K=[[0.0]])
    >>> mass.size
    1
    """

    M: Any
    C: Any
    K: Any
    contacts: Sequence[Contact] = ()
    loads: Sequence[tuple[ArrayLike, Signal]] = ()
    kept: dict[Any, Any] = field(default_factory=dict, init=False, repr=False)  # what methods prepare once

    def __post_init__(self) -> None:
        for name in "MCK":
            object.__setattr__(self, name, _square(name, getattr(self, name)))
        if not self.M.shape == self.C.shape == self.K.shape:
            raise ValueError(f"M, C, K must have one shape, got {self.M.shape}, {self.C.shape}, {self.K.shape}")
        if not all(hasattr(matrix, "toarray") for matrix in (self.M, self.C, self.K)):
            for name in "MCK":
                object.__setattr__(self, name, dense(getattr(self, name)))
        _check_mass(self.M)
        self._check_contacts_and_loads()

    def _check_contacts_and_loads(self, known: Sequence[Any] = ()) -> None:
        """Contacts and loads fit the matrices; of the loads with known vectors only the signals are looked at."""
        object.__setattr__(self, "contacts", tuple(self.contacts))
        object.__setattr__(self, "loads", tuple(self._load(i, pair, known) for i, pair in enumerate(self.loads)))
        for i, contact in enumerate(self.contacts):
            if contact.direction.size != self.size:
                raise ValueError(f"contact {i} has a direction of {contact.direction.size}, the system {self.size}")

    def like(
        self,
        contacts: Sequence[Contact] | None = None,
        loads: Sequence[tuple[ArrayLike, Signal]] | None = None,
    ) -> System:
        """The same structure with other contacts or loads; its matrices are neither checked nor decoupled again."""
        other = object.__new__(System)
        other.__dict__.update(self.__dict__, blocks=self.blocks, push=self.push, kept={})
        for name, value in (("contacts", contacts), ("loads", loads)):
            if value is not None:
                other.__dict__[name] = value
        other._check_contacts_and_loads([vector for vector, _ in self.loads])
        if len(self.contacts) == len(other.contacts):
            if all(a.law is b.law for a, b in zip(self.contacts, other.contacts, strict=True)):
                other.kept["laws"] = self.about_laws
            if self._vectors_are_those_of(other):
                other.kept["structure"] = self.about_structure
        return other

    def _vectors_are_those_of(self, other: System) -> bool:
        """Whether contacts and loads act along the same vectors."""
        if len(self.loads) != len(other.loads):
            return False
        pairs: list[tuple[Any, Any]] = [
            (a.direction, b.direction) for a, b in zip(self.contacts, other.contacts, strict=True)
        ]
        pairs += [(a, b) for (a, _), (b, _) in zip(self.loads, other.loads, strict=True)]
        return all(a is b or np.array_equal(a, b) for a, b in pairs)

    @property
    def about_structure(self) -> dict[str, Any]:
        """What was found of matrices, directions and loads' vectors; shared like `about_laws`."""
        known: dict[str, Any] = self.kept.setdefault("structure", {})
        return known

    def __getstate__(self) -> dict[str, Any]:
        """What a copy or another process gets: all but what methods have prepared, which holds addresses of memory."""
        return {**self.__dict__, "kept": {}}

    @property
    def about_laws(self) -> dict[str, Any]:
        """What was found of the laws so far; systems made by `like` share it as long as they have the same laws."""
        known: dict[str, Any] = self.kept.setdefault("laws", {})
        return known

    def _load(self, i: int, pair: tuple[ArrayLike, Signal], known: Sequence[Any]) -> tuple[Array, Signal]:
        """One checked load."""
        given, signal = pair
        vector: Any = next((vector for vector in known if vector is given), None)
        if vector is None:
            vector = np.array(given, dtype=float, ndmin=1)
            vector.setflags(write=False)
            if vector.shape != (self.size,) or not np.all(np.isfinite(vector)):
                raise ValueError(f"load {i} needs a finite vector of {self.size}, got {vector!r}")
        if not callable(signal):
            raise TypeError(f"load {i} needs a signal t -> value, got {signal!r}")
        return vector, signal

    @property
    def size(self) -> int:
        """Number of coordinates n."""
        return int(self.M.shape[0])

    @classmethod
    def modal(
        cls,
        omega: ArrayLike,
        zeta: ArrayLike,
        contacts: Sequence[Contact] = (),
        loads: Sequence[tuple[ArrayLike, Signal]] = (),
    ) -> System:
        """Mass-normalised modes: M = I, C = diag(2 ζ ω), K = diag(ω²); one ζ serves all modes.

        Parameters
        ----------
        omega : (n,) rad/s, >= 0; 0 for a rigid-body mode.
        zeta : one number or (n,), >= 0.
        contacts, loads : as for `System`, in modal coordinates.
        """
        omega = np.atleast_1d(np.asarray(omega, dtype=float))
        zeta = np.broadcast_to(np.asarray(zeta, dtype=float), omega.shape)
        if not (np.all(np.isfinite(omega)) and np.all(omega >= 0.0)):
            raise ValueError(f"omega must be finite and >= 0 (rad/s), got {omega}")
        if not (np.all(np.isfinite(zeta)) and np.all(zeta >= 0.0)):
            raise ValueError(f"zeta must be finite and >= 0, got {zeta}")
        return cls(np.eye(omega.size), np.diag(2.0 * zeta * omega), np.diag(omega**2), contacts, loads)

    @cached_property
    def blocks(self) -> Blocks:
        """The decoupled form."""
        return decouple(dense(self.M), dense(self.C), dense(self.K))

    @cached_property
    def push(self) -> Array:
        """(2n, n) rate of the blocks' state per unit force on every coordinate."""
        return self.blocks.inverse[:, self.size :] @ np.linalg.inv(dense(self.M))

    @property
    def sparse(self) -> bool:
        """Whether the matrices were given sparse."""
        return hasattr(self.M, "toarray")

    def energy(self, q: Array, q_dot: Array) -> Array:
        """Stored energy ½ q'ᵀ M q' + ½ qᵀ K q in J, for (..., n) arrays."""
        return stored_energy(self.M, self.K, q, q_dot)


def stored_energy(M: Any, K: Any, q: Array, q_dot: Array) -> Array:
    """½ q'ᵀ M q' + ½ qᵀ K q of (..., n) arrays; inf of a run that diverged."""
    with np.errstate(over="ignore", invalid="ignore"):
        return 0.5 * sum(np.einsum("...i,...i", product(x, matrix), x) for x, matrix in ((q_dot, M), (q, K)))


@dataclass(frozen=True, eq=False)
class Parameter:
    """A scalar of the problem, given by the systems at its value less and plus ``step``.

    The derivative d[q, q̇]/d(parameter) at fixed start and fixed duration. Where the systems differ in loads' tones,
    gaps and laws' parameters only, these data are differenced and the motion's derivative is exact; where anything
    else differs (matrices, directions, knots, sampled signals), it is the central difference of two runs.

    Parameters
    ----------
    behind, ahead : systems of one size, with the same number of contacts and loads.
    step : half the difference of the parameter, > 0.

    Examples
    --------
    >>> soft, stiff = (System.modal(omega=[w], zeta=[0.0]) for w in (1.99, 2.01))
    >>> Parameter(soft, stiff, step=0.01).step
    0.01
    """

    behind: System
    ahead: System
    step: float

    def __post_init__(self) -> None:
        if not 0.0 < self.step < math.inf:
            raise ValueError(f"step of a Parameter must be positive and finite, got {self.step!r}")
        sizes = [(s.size, len(s.contacts), len(s.loads)) for s in (self.behind, self.ahead)]
        if sizes[0] != sizes[1]:
            raise ValueError(f"the systems of a Parameter differ in coordinates, contacts or loads: {sizes}")


def require_step(name: str, value: float) -> None:
    """ValueError for a step that is none."""
    if not 0.0 < value < np.inf:
        raise ValueError(f"{name} must be positive and finite (s), got {value!r}")


def product(rows: Array, matrix: Any) -> Array:
    """Rows (..., n) times a matrix (n, m), many of them in pieces too small for BLAS to spread over threads.

    Threads gain nothing on such thin arrays, and where other work fills the cores one waits for the other.
    """
    piece = max(1, _ONE_THREAD // max(1, math.prod(matrix.shape)))
    if rows.ndim != 2 or len(rows) <= piece:
        return rows @ matrix
    return np.concatenate([rows[i : i + piece] @ matrix for i in range(0, len(rows), piece)])


def dense(matrix: Any) -> Array:
    """A matrix as an array."""
    array = matrix.toarray() if hasattr(matrix, "toarray") else matrix
    array.setflags(write=False)
    return array


def _square(name: str, matrix: Any) -> Any:
    """A finite, symmetric copy of a matrix: sparse by columns if it was sparse, else dense."""
    if hasattr(matrix, "toarray"):
        from scipy.sparse import csc_array

        copied: Any = csc_array(matrix, dtype=float, copy=True)
        values = copied.data
    else:
        copied = values = np.array(matrix, dtype=float, ndmin=2)
    if copied.ndim != 2 or copied.shape[0] != copied.shape[1]:
        raise ValueError(f"{name} must be square, got shape {copied.shape}")
    if not np.all(np.isfinite(values)):
        row, column = np.argwhere(~np.isfinite(dense(copied)))[0]
        raise ValueError(f"{name} must be finite, got {copied[row, column]} at row {row}, column {column}")
    asymmetry = abs(copied - copied.T).max()
    if asymmetry > 1e-9 * abs(copied).max():
        raise ValueError(f"{name} must be symmetric; its largest asymmetry is {asymmetry:g}")
    values.setflags(write=False)
    return copied


def _check_mass(M: Any) -> None:
    """M is positive definite."""
    if hasattr(M, "toarray"):
        if _has_positive_pivots(M):
            return
        lowest = "not positive"
    else:
        try:
            np.linalg.cholesky(M)
            return
        except np.linalg.LinAlgError:
            lowest = f"{np.linalg.eigvalsh(M)[0]:g}"
    raise ValueError(
        f"M must be positive definite, its lowest eigenvalue is {lowest}; "
        "give every coordinate a mass or condense the massless ones"
    )


def _has_positive_pivots(M: Any) -> bool:
    """Whether a symmetric sparse matrix is positive definite: Gaussian elimination along its diagonal."""
    from scipy.sparse.linalg import splu

    try:
        factor = splu(M, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError:  # singular
        return False
    return bool(np.all(factor.perm_r == factor.perm_c) and np.all(factor.U.diagonal() > 0.0))


@dataclass(frozen=True, eq=False)
class Blocks:
    """Decoupled form: stiffness k (n,), damping c (n,), transformation T and its inverse (2n, 2n).

    ``loss`` (2n, 2n) gives the damping power zᵀ loss z where damping couples modes, and is empty otherwise.
    """

    k: Array
    c: Array
    T: Array
    inverse: Array
    loss: Array


def decouple(M: Array, C: Array, K: Array) -> Blocks:
    """Find the decoupled form of (M, C, K)."""
    n = M.shape[0]
    if _is_diagonal(M) and _is_diagonal(K) and np.all(np.diag(M) == 1.0):
        phi, k = np.eye(n), np.diag(K).copy()
    else:
        phi, k = _modes(M, K)
    damping = phi.T @ C @ phi
    spread = damping - np.diag(np.diag(damping))
    if np.abs(spread).max(initial=0.0) <= 1e-12 * np.abs(damping).max(initial=0.0):
        zero = np.zeros((n, n))
        inverse = phi.T @ M
        return Blocks(
            k,
            np.diag(damping).copy(),
            np.block([[phi, zero], [zero, phi]]),
            np.block([[inverse, zero], [zero, inverse]]),
            np.empty((0, 0)),
        )
    return _state_blocks(phi, k, damping)


def _is_diagonal(matrix: Array) -> bool:
    """Whether all entries off the diagonal are zero."""
    return not np.any(matrix - np.diag(np.diag(matrix)))


def _modes(M: Array, K: Array) -> tuple[Array, Array]:
    """Mass-normalised modes and squared frequencies; rounding-size ones become exact zeros."""
    from scipy.linalg import eigh

    k, phi = eigh(K, M)
    k[np.abs(k) < 1e-13 * np.abs(k).max(initial=0.0)] = 0.0
    return phi, k


def _state_blocks(phi: Array, k: Array, damping: Array) -> Blocks:
    """Blocks of the state matrix [[0, I], [-diag(k), -damping]] whose damping couples the modes."""
    phi, damping, free = _floating(phi, k, damping)
    k, n = k[free:], k.size - free
    rigid, damping = phi[:, :free], damping[free:, free:]
    phi = phi[:, free:]
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(k), -damping]])
    values, vectors = np.linalg.eig(A)
    order = np.argsort(np.abs(values))
    values, vectors = values[order], vectors[:, order]
    scale = np.abs(values).max()
    complex_ones = np.flatnonzero(values.imag > 1e-12 * scale)
    real_ones = np.flatnonzero(np.abs(values.imag) <= 1e-12 * scale)
    half = real_ones.size // 2
    pairs = [_complex_pair(values[i], vectors[:, i], n) for i in complex_ones]
    pairs += [
        _real_pair(values[i].real, values[j].real, vectors[:, i].real, vectors[:, j].real)
        for i, j in zip(real_ones[:half], real_ones[half:], strict=True)
    ]
    columns = np.array([p[2] for p in pairs] + [p[3] for p in pairs]).T
    if len(pairs) != n or np.linalg.cond(columns) > 1e12:
        raise ValueError(
            "the damped modes cannot be separated (two coincide, as for a dashpot on a body that can float, or a "
            "critically damped mode); change a dashpot by one part in 10^6"
        )
    zero = np.zeros((phi.shape[0], free))
    T = np.hstack(
        (
            np.vstack((rigid, zero)),
            np.vstack((zero, rigid)),
            *(np.vstack((phi @ c[:n], phi @ c[n:])) for c in (columns[:, :n], columns[:, n:])),
        )
    )
    order = np.concatenate((np.arange(free), 2 * free + np.arange(n)))
    T = T[:, np.concatenate((order, order + np.where(np.arange(free + n) < free, free, n)))]
    loss = np.zeros((2 * (free + n), 2 * (free + n)))
    places = np.concatenate((free + np.arange(n), 2 * free + n + np.arange(n)))
    loss[np.ix_(places, places)] = columns[n:].T @ damping @ columns[n:]
    none = [0.0] * free
    return Blocks(
        np.array(none + [p[0] for p in pairs]), np.array(none + [p[1] for p in pairs]), T, np.linalg.inv(T), loss
    )


def _floating(phi: Array, k: Array, damping: Array) -> tuple[Array, Array, int]:
    """Turn the rigid-body modes so that those no dashpot resists come first; they are blocks of their own."""
    rigid = int(np.sum(k == 0.0))
    values, turn = np.linalg.eigh(damping[:rigid, :rigid])
    values[np.abs(values) < 1e-12 * np.abs(damping).max()] = 0.0
    rotation = np.eye(k.size)
    rotation[:rigid, :rigid] = turn
    return phi @ rotation, rotation.T @ damping @ rotation, int(np.sum(values == 0.0))


def _complex_pair(value: complex, vector: NDArray, n: int) -> tuple[float, float, Array, Array]:
    """k, c and the two columns of a conjugate pair; the phase makes p as near to a displacement as it can be."""
    vector = vector * 1j * np.exp(-0.5j * np.angle(np.sum(vector[:n] ** 2)))
    a, b = vector.real, vector.imag
    return abs(value) ** 2, -2.0 * value.real, b + (value.real / value.imag) * a, -a / value.imag


def _real_pair(first: float, second: float, x: Array, y: Array) -> tuple[float, float, Array, Array]:
    """k, c and the two columns of two real eigenvalues."""
    if first == second:
        return first * second, -(first + second), np.zeros_like(x), np.zeros_like(x)
    difference = first - second
    return first * second, -(first + second), (-second * x - first * y) / difference, (x + y) / difference
