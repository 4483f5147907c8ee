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
    if model.participation.ndim == 2:
        return [row for row, _ in _rows_of_directions(model)]
    mass = model.moving_mass
    return [
        {"mode": name, "omega": w, "hz": w / (2 * math.pi), "zeta": z, "participation": g, "effective_mass": g * g,
         "share": g * g / mass if mass > 0 else 0.0}
        for name, w, z, g in zip(
            model.names, *(x.tolist() for x in (model.omega, model.zeta, model.participation)), strict=True
        )
    ]  # fmt: skip


def _rows_of_directions(model: Model) -> list[tuple[dict[str, Any], list[float]]]:
    """The same of a body whose frame may move along several directions, and the shares themselves."""
    found = []
    for i, (name, w, z) in enumerate(zip(model.names, model.omega.tolist(), model.zeta.tolist(), strict=True)):
        row = {"mode": name, "omega": w, "hz": w / (2 * math.pi), "zeta": z}
        shares = []
        for direction, g, mass in zip(
            model.moved_along, model.participation[i].tolist(), model.moving_mass, strict=True
        ):
            shares.append(g * g / float(mass) if mass > 0 else 0.0)
            row |= {
                f"participation {direction}": g,
                f"effective_mass {direction}": g * g,
                f"share {direction}": shares[-1],
            }
        found.append((row, shares))
    return found


def _part_of_directions(model: Model) -> tuple[Sequence[str], list[Sequence[str]]]:
    """Head and rows of the table of such a body: shares of the moving mass."""
    found = _rows_of_directions(model)
    head = "mode", "rad/s", "Hz", "zeta", *(f"% of mass along {direction}" for direction in model.moved_along)
    rows: list[Sequence[str]] = [("", "", "", "", *(f"{float(mass):.6g} kg" for mass in model.moving_mass))]
    for row, shares in found:
        numbers = f"{row['omega']:.6f}", f"{row['hz']:.6f}", f"{row['zeta']:.4g}"
        rows.append((row["mode"], *numbers, *(f"{100 * share:.3f}" for share in shares)))
    sums = [f"{100 * sum(share):.3f}" for share in zip(*(shares for _, shares in found), strict=True)]
    return head, [*rows, ("all", "", "", "", *sums)]


def mode_table(model: Model) -> str:
    """The rows as text, with units and the sum."""
    return aligned(*mode_part(model))


def mode_part(model: Model) -> tuple[Sequence[str], list[Sequence[str]]]:
    """Head and rows of the table: units first, the sum last."""
    if model.participation.ndim == 2:
        return _part_of_directions(model)
    mass = model.moving_mass
    head = "mode", "rad/s", "Hz", "zeta", "participation", "effective mass", "% of moving mass"
    formats = "", ".6f", ".6f", ".4g", ".6g", ".6g", ".3f"
    found = mode_rows(model)
    rows: list[Sequence[str]] = [("", "", "", "", "√kg", "kg", f"{mass:.6g} kg")]
    rows += [tuple(map(format, [*list(row.values())[:-1], 100 * row["share"]], formats)) for row in found]
    share = 100 * sum(row["share"] for row in found)
    return head, [*rows, ("all", "", "", "", "", f"{model.effective_mass.sum():.6g}", f"{share:.3f}")]
