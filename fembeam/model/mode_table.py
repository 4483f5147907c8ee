"""The modes of a model in rows."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from fembeam.support import aligned

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fembeam.model import Model


FORMATS = {"mode": "", "omega": ".6f", "hz": ".6f", "zeta": ".4g", "participation": ".6g", "effective_mass": ".6g"}


def mode_rows(model: Model) -> list[dict[str, Any]]:
    """Frequency, damping, participation Γ, effective mass Γ² and its share of the moving mass.

    Where the frame may move along several directions, the last three for each of them: "share x".
    """
    masses = np.atleast_1d(model.moving_mass).tolist()
    each = model.participation.reshape(len(model.omega), len(masses)).tolist()
    rows = []
    for name, w, z, own in zip(model.names, model.omega.tolist(), model.zeta.tolist(), each, strict=True):
        row = {"mode": name, "omega": w, "hz": w / (2 * math.pi), "zeta": z}
        for along, g, mass in zip(_directions(model), own, masses, strict=True):
            row |= {f"participation{along}": g, f"effective_mass{along}": g * g}
            row[f"share{along}"] = g * g / mass if mass > 0 else 0.0
        rows.append(row)
    return rows


def _directions(model: Model) -> list[str]:
    """What names of `mode_rows` end with: directions in which the frame may move, nothing of a beam."""
    return [f" {direction}" for direction in model.moved_along] if model.participation.ndim == 2 else [""]


def mode_table(model: Model) -> str:
    """The rows as text, with units and the sum."""
    return aligned(*mode_part(model))


def mode_part(model: Model) -> tuple[Sequence[str], list[Sequence[str]]]:
    """Head and rows of the table: units first, the sum last; of several directions shares alone."""
    found, along = mode_rows(model), _directions(model)
    head, units, total = [f"% of mass along{one}" for one in along], [], []
    if model.participation.ndim == 1:
        head, units = ["participation", "effective mass", "% of moving mass"], ["√kg", "kg"]
        total = ["", f"{model.effective_mass.sum():.6g}"]
    masses = (f"{mass:.6g} kg" for mass in np.atleast_1d(model.moving_mass))
    rows: list[Sequence[str]] = [("", "", "", "", *units, *masses)]
    for row in found:
        numbers = (format(row[key], code) for key, code in FORMATS.items() if key in row)
        rows.append((*numbers, *(f"{100 * row[f'share{one}']:.3f}" for one in along)))
    sums = (f"{100 * sum(row[f'share{one}'] for row in found):.3f}" for one in along)
    return ["mode", "rad/s", "Hz", "zeta", *head], [*rows, ("all", "", "", "", *total, *sums)]
