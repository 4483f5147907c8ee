"""Places on a beam that tables and figures show by default."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fembeam.response import PlacedShapes

if TYPE_CHECKING:
    from fembeam.model.model import Model
    from fembeam.response import Shapes


def places(shapes: Shapes | PlacedShapes) -> dict[str, Any]:
    """Default coordinates, those that move: "tip" (a free end, the far one first) and "mid-beam".

    Of other bodies pairs (place, direction): where something acts, then named points.
    """
    if isinstance(shapes, PlacedShapes):
        return shapes.usual
    start, end = float(shapes.nodes[0]), float(shapes.nodes[-1])
    mid = (start + end) / 2
    size = {z: float(np.abs(shapes(z)).max()) for z in (end, start, mid)}
    moving = [z for z in (end, start) if size[z] > 1e-9 * max(size.values())]
    return {**({"tip": moving[0]} if moving else {}), "mid-beam": mid}


def observed(model: Model) -> Any:
    """The default place: the first stop or element of displacement, else the tip."""
    acting = [part.z for part in model.scene.acting if not part.coordinate.rotation]
    if acting and not model.scene.named:
        return acting[0]
    return next(iter(places(model.shapes).values()))
