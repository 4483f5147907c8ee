"""Quadratic forms yᵀ M y of work and damping, and their transport ΦᵀMΦ over a step y -> Φ y.

Φ has 2 × 2 blocks, one a coordinate, and columns of the sampled signals; so have the forms, unless damping couples the
coordinates. Above `MOST_DENSE` rows the zeros of both are left out, the forms of all steps in one sparse matrix, blocks
on its diagonal. l steps, two forms each, Y rows.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from scipy.sparse import block_diag, csr_array

Forms: TypeAlias = Any  # (l, 2, Y, Y), or sparse (2 l Y, 2 l Y)
MOST_DENSE = 100


def forms_of(both: Any, count: int) -> Forms:
    """The two forms (2, Y, Y) of each of ``count`` steps."""
    if both.shape[-1] <= MOST_DENSE:
        return np.broadcast_to(both, (count, *both.shape))
    return csr_array(block_diag([csr_array(one) for one in both] * count, format="csr"))


def carried(forms: Forms, flow: Any) -> Forms:
    """ΦᵀMΦ, with Φ (l, Y, Y).

    Examples
    --------
    >>> carried(np.ones((1, 2, 1, 1)), np.full((1, 1, 1), 3.0)).ravel().tolist()
    [9.0, 9.0]
    """
    if isinstance(forms, np.ndarray):
        return flow[:, None].transpose(0, 1, 3, 2) @ forms @ flow[:, None]
    each = [csr_array(one) for one in flow]
    moves = csr_array(block_diag([one for one in each for _ in range(2)], format="csr"))
    return csr_array(moves.T @ forms @ moves)


def rows_of(forms: Forms, size: int, chosen: Any) -> Any:
    """(l, 2, rows, Y) some rows of all forms."""
    if isinstance(forms, np.ndarray):
        return forms[:, :, chosen]
    blocks = forms.shape[0] // size
    found = forms[(size * np.arange(blocks)[:, None] + chosen).ravel()].tocoo()
    out = np.zeros((blocks * len(chosen), size))
    out[found.coords[0], found.coords[1] % size] = found.data
    return out.reshape(blocks // 2, 2, len(chosen), size)


def entries_of(forms: Forms, size: int, n: int, b: Any) -> Any:
    """(l, 3, b) entries (b, b), (b, n + b) and (n + b, n + b) of the second forms."""
    if isinstance(forms, np.ndarray):
        second = forms[:, 1]
        return np.stack((second[:, b, b], second[:, b, n + b], second[:, n + b, n + b]), axis=1)
    main = forms.diagonal().reshape(-1, 2, size)[:, 1]
    beside = np.append(forms.diagonal(n), np.zeros(n)).reshape(-1, 2, size)[:, 1]
    return np.stack((main[:, b], beside[:, b], main[:, n + b]), axis=1)


def taylor(generator: Any, h: Any, terms: int) -> Any:
    """(l, Y, Y) exp(B h) by its series, of B (Y, Y) and brief steps h (l,)."""
    if len(generator) > MOST_DENSE:
        return np.stack([_sparse_taylor(csr_array(generator), step, terms) for step in h])
    term = np.broadcast_to(np.eye(len(generator)), (len(h), *generator.shape))
    flow = term.copy()
    for i in range(1, terms):
        term = (h / i)[:, None, None] * (term @ generator)
        flow += term
    return flow


def _sparse_taylor(generator: Any, h: float, terms: int) -> Any:
    """(Y, Y) the same of one step, of a sparse B."""
    term = flow = csr_array(np.eye(generator.shape[0]))
    for i in range(1, terms):
        term = (h / i) * (term @ generator)
        flow = flow + term
    return flow.toarray()
