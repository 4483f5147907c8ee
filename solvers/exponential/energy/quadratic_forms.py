"""Quadratic forms yᵀ M y of work and damping, and their transport ΦᵀMΦ over a step y -> Φ y.

Φ has 2 × 2 blocks, one for each coordinate, and columns of the sampled signals; so have the forms, unless damping
couples the coordinates. Above `MOST_DENSE` rows both are sparse, with the forms of all steps as blocks on the diagonal
of one matrix. There are l steps, two forms each, Y rows.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from scipy.sparse import block_diag, csr_array

Forms: TypeAlias = Any  # (l, 2, Y, Y), or sparse (2 l Y, 2 l Y)
MOST_DENSE = 100


def forms_of(both: Any, count: int) -> Forms:
    """The two forms (2, Y, Y), repeated for each of ``count`` steps."""
    if both.shape[-1] <= MOST_DENSE:
        return np.broadcast_to(both, (count, *both.shape))
    return csr_array(block_diag([csr_array(one) for one in both] * count, format="csr"))


def flow_of(rows: Any, columns: Any, values: Any, size: int) -> Forms:
    """Φ of l steps, dense (l, Y, Y) or sparse as the forms, from places and values (l, entries) of its entries."""
    if size <= MOST_DENSE:
        out = np.zeros((len(values), size, size))
        out[:, rows, columns] = values
        return out
    first = size * np.arange(2 * len(values))[:, None]
    places = (first + rows).ravel(), (first + columns).ravel()
    return csr_array((np.repeat(values, 2, axis=0).ravel(), places), shape=(2 * len(values) * size,) * 2)


def carried(forms: Forms, flow: Forms) -> Forms:
    """ΦᵀMΦ.

    Examples
    --------
    >>> carried(np.ones((1, 2, 1, 1)), flow_of([0], [0], np.array([[3.0]]), 1)).ravel().tolist()
    [9.0, 9.0]
    """
    if isinstance(forms, np.ndarray):
        return flow[:, None].transpose(0, 1, 3, 2) @ forms @ flow[:, None]
    return csr_array(flow.T @ forms @ flow)


def rows_of(forms: Forms, size: int, chosen: Any) -> Any:
    """(l, 2, rows, Y) chosen rows of all forms."""
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


def taylor(begin: Forms, generator: Forms) -> Forms:
    """``begin`` × exp(``generator``) by twelve terms of its series."""
    flow = term = begin
    for i in range(1, 12):
        term = (term @ generator) / i
        flow = flow + term
    return flow
