"""The modes of a model in rows."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from fembeam.support import aligned

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fembeam.model import Model


def mode_rows(model: Model) -> list[dict[str, Any]]:
    """Frequency, damping, participation Γ, effective mass Γ² and its share of the moving mass."""
    mass = model.moving_mass
    return [
        {"mode": name, "omega": w, "hz": w / (2 * math.pi), "zeta": z, "participation": g, "effective_mass": g * g,
         "share": g * g / mass if mass > 0 else 0.0}
        for name, w, z, g in zip(
            model.names, *(x.tolist() for x in (model.omega, model.zeta, model.participation)), strict=True
        )
    ]  # fmt: skip


def mode_table(model: Model) -> str:
    """The rows as text, with units and the sum."""
    return aligned(*mode_part(model))


def mode_part(model: Model) -> tuple[Sequence[str], list[Sequence[str]]]:
    """Head and rows of the table: units first, the sum last."""
    mass = model.moving_mass
    head = "mode", "rad/s", "Hz", "zeta", "participation", "effective mass", "% of moving mass"
    formats = "", ".6f", ".6f", ".4g", ".6g", ".6g", ".3f"
    found = mode_rows(model)
    rows: list[Sequence[str]] = [("", "", "", "", "√kg", "kg", f"{mass:.6g} kg")]
    rows += [tuple(map(format, [*list(row.values())[:-1], 100 * row["share"]], formats)) for row in found]
    share = 100 * sum(row["share"] for row in found)
    return head, [*rows, ("all", "", "", "", "", f"{model.effective_mass.sum():.6g}", f"{share:.3f}")]
