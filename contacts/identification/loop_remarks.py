"""Remarks on the parameters found from loops: why they may be unreliable."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from contacts.identification.loop_models import Loop
from contacts.identification.result import EXACT, Estimate

_TIED = 0.995  # correlation of two errors from which on only a combination is known
_SMALL = 0.01  # share of the displacement's range below which a turn may be noise
_MAY_BE_ZERO = ("spring", "alpha", "gamma")


def remarks_on(
    loops: Sequence[Loop], estimates: dict[str, Estimate], correlations: NDArray[np.float64], lag: float, noise: float
) -> tuple[str, ...]:
    """All remarks, from the estimates, the correlations of their errors and ``lag``, that of neighbouring residuals."""
    return *_correlated(lag, noise), *_untold(estimates), *_tied(estimates, correlations), *_turning(loops)


def _correlated(lag: float, noise: float) -> list[str]:
    """What to say of residuals that go together."""
    if lag < 0.5 or noise < EXACT:
        return []
    return [
        f"neighbouring residuals are correlated ({lag:.2f}): the channel is filtered, or the element does not "
        "follow this law; see the residuals"
    ]


def _untold(estimates: dict[str, Estimate]) -> list[str]:
    """What to say of parameters whose interval is wider than they are; what may well be zero is left out."""
    wide = [name for name, x in estimates.items() if x.high - x.value > abs(x.value) and name not in _MAY_BE_ZERO]
    return [f"the records do not tell {name}: {estimates[name]}; load further, or in both directions" for name in wide]


def _tied(estimates: dict[str, Estimate], correlations: NDArray[np.float64]) -> list[str]:
    """What to say of parameters that can be exchanged for one another."""
    names, rows, columns = list(estimates), *np.nonzero(np.triu(np.abs(correlations) > _TIED, 1))
    return [
        f"{names[i]} and {names[j]} trade off, correlation {correlations[i, j]:.4f}: the records tell a combination of "
        "them far better than each"
        for i, j in zip(rows, columns, strict=True)
    ]


def _turning(loops: Sequence[Loop]) -> list[str]:
    """What to say of many small turns."""
    spans = np.concatenate([np.abs([one.x[b] - one.x[a] for a, b in one.runs]) for one in loops])
    small = int(np.count_nonzero(spans < 2.0 * _SMALL))
    if small < 10 or small < 0.5 * spans.size:
        return []
    return [
        f"delta turns back {small} times by less than {100 * _SMALL:g} % of its range: if that is noise, smooth it: a "
        "law with memory follows every turn"
    ]
