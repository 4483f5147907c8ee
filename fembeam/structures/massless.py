"""Dofs without mass follow the others statically (Guyan): K₀₀ u₀ = -K₀₁ u₁."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

SINGULAR = 1e-10  # of K₀₀ scaled to a unit diagonal: a pivot below it is a dof that nothing holds


def following(M: Any, K: Any, names: Sequence[Any], where: str, kept: Collection[int] = ()) -> sparse.csr_matrix | None:
    """T (N, n) with u = T u₁ of the dofs u₁ that have mass or are ``kept``; None if these are all.

    Exact for loads on these: without inertia K₀₁ u₁ + K₀₀ u₀ = 0.

    Raises
    ------
    ValueError : massless dofs that nothing holds (names one).

    References
    ----------
    R.J. Guyan, AIAA Journal 3 (1965) 380.

    Examples
    --------
    >>> K = sparse.csr_matrix([[2.0, -1.0], [-1.0, 1.0]])
    >>> following(sparse.diags([0.0, 1.0]), K, "ab", "").toarray().tolist()  # the middle of two equal springs
    [[0.5], [1.0]]
    """
    M, K = sparse.csr_matrix(M), sparse.csr_matrix(K)
    stay = M.diagonal() != 0
    stay[list(kept)] = True
    bare, heavy = np.flatnonzero(~stay), np.flatnonzero(stay)
    if not bare.size:
        return None
    inner = K[bare][:, bare].tocsc()
    unit = np.sqrt(np.where(inner.diagonal() > 0, inner.diagonal(), 1.0))
    scaled = (sparse.diags(1 / unit) @ inner @ sparse.diags(1 / unit)).tocsc()
    try:
        factors = sparse_linalg.splu(scaled, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        pivots = np.abs(factors.U.diagonal())
        loose = int(factors.perm_c.argsort()[int(np.argmin(pivots))]) if pivots.min() < SINGULAR else -1
    except RuntimeError:
        loose = int(np.argmin(inner.diagonal()))
    if loose >= 0:
        raise ValueError(f"a dof without mass must be held by stiffness, got {names[bare[loose]]!r} among {len(bare)} "
                         f"massless ones in {where}; fix it, or give it mass")  # fmt: skip
    down = factors.solve((sparse.diags(1 / unit) @ K[bare][:, heavy]).toarray())
    shape = (len(heavy), len(heavy))
    T = sparse.vstack([sparse.eye(shape[0]), sparse.csr_matrix(-down / unit[:, None])], format="csr")
    return T[np.argsort(np.concatenate([heavy, bare]))]
