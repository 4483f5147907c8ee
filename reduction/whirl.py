"""Whirling of rotors: modes of M q'' + G q' + K q = 0 with the sense in which they turn, and critical speeds.

On real modes at standstill, q = Φ r, and e = [ω_i r_i, r_i'] the equation is e' = A e with a skew A, so that -iA is
Hermitian: its positive eigenvalues are the frequencies, all real.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import linalg, sparse

from reduction.basis import Basis, Vector, checked_basis, reals

SKEW_TOLERANCE = 1e-9
ALIKE = 1e-9  # relative: frequencies this near are one, whose motions are taken as circles
STRAIGHT = 1e-6  # sense below which a motion is a line


@dataclass(frozen=True, eq=False)
class Whirl:
    """Modes of a rotor, or its critical speeds; every motion is Re(shape exp(iωt)).

    Attributes
    ----------
    omega : (n,) rad/s, ascending.
    sense : (n,) in [-1, 1]: area that the places run round, relative to that of circles; 1 where all of them turn from
        x to y on circles, -1 from y to x, 0 on a line or where nothing moves in the plane.
    shapes : complex (N, n).
    """

    omega: Vector
    sense: Vector
    shapes: NDArray[np.complex128]

    def __repr__(self) -> str:
        backward, forward = (int(np.sum(self.turning == sign)) for sign in (-1, 1))
        return f"<whirl of {len(self.omega)} modes, {forward} from x to y, {backward} from y to x>"

    @property
    def turning(self) -> NDArray[np.int64]:
        """1 from x to y, -1 from y to x, 0 for motion on a line."""
        return np.where(np.abs(self.sense) < STRAIGHT, 0, np.sign(self.sense)).astype(int)

    @property
    def signed(self) -> Vector:
        """(n,) rad/s, negative for motions from y to x."""
        return np.where(self.turning < 0, -self.omega, self.omega)


def whirl(basis: Basis, G: Any, x: ArrayLike, y: ArrayLike) -> Whirl:
    """Undamped modes of a rotor and the sense in which they turn.

    M q'' + G q' + K q = 0,   q = Φ r,   area = ½ ∮ Σ (u_x du_y - u_y du_x)

    Parameters
    ----------
    basis : modes of (M, K) at standstill; six of each plane give the lowest whirling frequency to about 1e-8.
    G : (N, N) skew, dense or sparse.
    x, y : (N,) or (k, N)
        Rows of the displacement along x and y at the same places. A rotor that spins from x to y whirls forward where
        the sense is positive.

    Returns
    -------
    Whirl : n modes. Of repeated frequencies those are taken that turn most: two circles of opposite sense.

    Raises
    ------
    ValueError : G not skew or of another size, rows that do not match, numbers that are not finite.

    References
    ----------
    H.D. Nelson, J.M. McVaugh, The dynamics of rotor-bearing systems using finite elements, J. Eng. Ind. 98 (1976) 593.
    L. Meirovitch, A new method of solution of the eigenvalue problem for gyroscopic systems, AIAA J. 12 (1974) 1337.

    Examples
    --------
    A disk with I_p Ω = 3 I_d on springs of 2 rad/s; its inclinations are the two coordinates:

    >>> found = whirl(Basis(np.eye(2), np.full(2, 2.0)), np.array([[0.0, 3.0], [-3.0, 0.0]]), [1.0, 0.0], [0.0, 1.0])
    >>> found.signed.round(12).tolist()
    [-1.0, 4.0]
    """
    turning, places = _checked(basis, G, x, y)
    omega = np.diag(basis.omega)
    values, vectors = linalg.eigh(-1j * np.block([[0.0 * omega, omega], [-omega, -turning]]))
    n = basis.count
    rates = vectors[n:, n:]
    return _turned(np.maximum(values[n:], 0.0), rates, basis, places)


def critical_speeds(basis: Basis, G: Any, x: ArrayLike, y: ArrayLike) -> Whirl:
    """Spins Ω > 0 at which a rotor with the matrix Ω G whirls with the frequency Ω: an unbalance excites it there.

    K q = Ω² (M - iG) q,   q'' = -Ω² q,   q' = iΩ q

    Parameters
    ----------
    basis : modes of (M, K) at standstill, none of them a rigid-body mode.
    G : (N, N) skew, per unit of spin.
    x, y : as of `whirl`.

    Returns
    -------
    Whirl : its omega are the speeds. An unbalance of a round rotor excites those with the sense of the spin only. A
        disk with I_p > I_d has no forward one of its inclination.

    Raises
    ------
    ValueError : as `whirl`, and rigid-body modes.

    Examples
    --------
    >>> basis, G = Basis(np.eye(2), np.full(2, 2.0)), np.array([[0.0, 0.75], [-0.75, 0.0]])
    >>> critical_speeds(basis, G, [1.0, 0.0], [0.0, 1.0]).signed.round(4).tolist()
    [-1.5119, 4.0]
    """
    turning, places = _checked(basis, G, x, y)
    if basis.count and not basis.omega.min() > 0.0:
        raise ValueError(
            f"critical_speeds needs a rotor that is held, got {int(np.sum(basis.omega == 0.0))} rigid-body modes; "
            "add bearings, or leave these modes out of the basis"
        )
    scale = np.outer(1.0 / basis.omega, 1.0 / basis.omega)
    values, vectors = linalg.eigh((np.eye(basis.count) - 1j * turning) * scale)
    found = np.flatnonzero(values > 0.0)[::-1]
    return _turned(1.0 / np.sqrt(values[found]), vectors[:, found] / basis.omega[:, None], basis, places)


def _checked(basis: Basis, G: Any, x: ArrayLike, y: ArrayLike) -> tuple[Vector, tuple[Vector, Vector]]:
    """ΦᵀGΦ and the rows on the basis."""
    matrix: Any = G if sparse.issparse(G) else reals(G, "G", "whirl")
    size = len(checked_basis(basis, "whirl").vectors)
    if matrix.shape != (size, size):
        raise ValueError(f"G must be ({size}, {size}), as the basis has {size} dofs, got {matrix.shape}")
    wrong, largest = abs(matrix + matrix.T).max(), abs(matrix).max()
    if not wrong <= SKEW_TOLERANCE * largest:
        raise ValueError(f"G must be skew, G = -Gᵀ; its largest |G + Gᵀ| is {wrong:g}")
    rows = tuple(np.atleast_2d(reals(row, name, "whirl")) for name, row in (("x", x), ("y", y)))
    if rows[0].shape != rows[1].shape or rows[0].shape[1:] != (size,) or not np.isfinite(rows).all():
        raise ValueError(
            f"x and y must be finite rows (k, {size}) of the same places, got {rows[0].shape} and {rows[1].shape}"
        )
    turning = basis.project_matrix(matrix)
    return 0.5 * (turning - turning.T), (rows[0] @ basis.vectors, rows[1] @ basis.vectors)


def _turned(omega: Vector, vectors: Any, basis: Basis, places: tuple[Vector, Vector]) -> Whirl:
    """The modes with their sense; those of one frequency combined to circles."""
    vectors = vectors.copy()
    X, Y = (row @ vectors for row in places)
    first = 0
    for end in range(1, len(omega) + 1):
        if end < len(omega) and omega[end] - omega[first] <= ALIKE * omega[first]:
            continue
        group = slice(first, end)
        if end - first > 1:
            area = 1j * (X[:, group].conj().T @ Y[:, group] - Y[:, group].conj().T @ X[:, group])
            combined = np.linalg.eigh(area)[1]  # of a Hermitian matrix: -2 Im(X* Y)
            for columns in (vectors, X, Y):
                columns[:, group] = columns[:, group] @ combined
        first = end
    area, circle = -2.0 * np.sum((X.conj() * Y).imag, axis=0), np.sum(np.abs(X) ** 2 + np.abs(Y) ** 2, axis=0)
    moved = circle > 1e-20 * circle.max(initial=0.0)
    sense = np.divide(area, circle, out=np.zeros(len(omega)), where=moved)
    return Whirl(omega, sense, basis.vectors @ vectors)
