"""Scales on which estimates scatter alike wherever they lie, so that an interval may be symmetric there.

A transform g is such a scale when g' is proportional to 1/(standard error as a function of the value):

    level S (variance, density)    error ∝ S             g = ln S
    rate r of events               error ∝ √r            g = √r
    skewness s                     error ∝ 1 + s²        g = arctan s
    kurtosis k >= 1                error ∝ (k - 1)⁴      g = -1/(k - 1)³

Without it a low estimate comes with a low error, and the truth lies above the interval several times as often as below.
The first is exact for means of squares, the second for independent events; the others are fits to linear and impacting
responses under noise.

References
----------
M.S. Bartlett, Biometrics 3 (1947) 39 (transforms that stabilise the variance).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Scale:
    """A transform of an estimate and its inverse, both increasing."""

    forth: Callable[[Any], Any]
    back: Callable[[Any], Any]


def _same(value: Any) -> Any:
    """No transform."""
    return value


def _root(rate: Any) -> Any:
    """√r."""
    return np.sqrt(np.maximum(rate, 0.0))


def _square(root: Any) -> Any:
    """Inverse of `_root`; below 0 no rate is possible."""
    return np.maximum(root, 0.0) ** 2


def _tangent(angle: Any) -> Any:
    """Inverse of arctan; beyond ±π/2 every skewness is possible."""
    quarter = np.pi / 2
    return np.where(np.abs(angle) < quarter, np.tan(np.clip(angle, -quarter, quarter)), np.copysign(np.inf, angle))


def _of_kurtosis(kurtosis: Any) -> Any:
    """-1/(k - 1)³."""
    return -1.0 / (np.asarray(kurtosis, dtype=np.float64) - 1.0) ** 3


def _kurtosis(value: Any) -> Any:
    """Inverse of `_of_kurtosis`; from 0 on every large kurtosis is possible."""
    with np.errstate(divide="ignore"):
        return 1.0 + 1.0 / np.cbrt(np.maximum(-np.asarray(value), 0.0))


LINEAR = Scale(_same, _same)
LEVEL = Scale(np.log, np.exp)
RATE = Scale(_root, _square)
SKEWNESS = Scale(np.arctan, _tangent)
KURTOSIS = Scale(_of_kurtosis, _kurtosis)
