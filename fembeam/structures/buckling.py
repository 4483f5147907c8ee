"""Whether frames buckle under the axial forces of their members.

(K₀ - K) φ = μ K₀ φ,    K₀ the stiffness without axial forces: all of them times 1/μ make it buckle
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

Vector = NDArray[np.float64]
LEVEL = 1e-12  # of the stiffness, which keeps K₀ regular where the body floats


def check_buckling(body: Any, stiffness: Callable[[Any], Vector]) -> None:
    """Raise ValueError, with the member that loses most, where a frame or joined frames buckle.

    Parameters
    ----------
    body : a `Frame`, `JoinedBodies`, or another body. stiffness : of a body K (N, N), dense, as it is held.
    """
    pressed = [key for key, member in _members(body) if member.axial_force < 0.0]
    if not pressed:
        return
    K, bare = stiffness(body), stiffness(_relaxed(body, [key for key, _ in _members(body)]))
    level = LEVEL * float(np.abs(bare.diagonal()).max()) * np.eye(len(bare))
    top = 2 * (len(bare) - 1,)
    found, shapes = linalg.eigh(bare - K, bare + level, subset_by_index=top)
    if found[0] < 1.0:
        return
    taken = [shapes[:, 0] @ (stiffness(_relaxed(body, [key])) - K) @ shapes[:, 0] for key in pressed]
    worst = dict(_members(body))[pressed[int(np.argmax(taken))]]
    together = ", with all axial forces in proportion" if len(pressed) > 1 else ""
    raise ValueError(
        f"axial_force of member {worst.name!r} must stay above {worst.axial_force / found[0]:.6g} N, where the frame "
        f"buckles as it is held{together}, got {worst.axial_force:.6g} in Scene; press less, or support it more"
    )


def _members(body: Any) -> list[tuple[tuple[int, str], Any]]:
    """Members of all frames by the number of their body and their name."""
    bodies = getattr(body, "bodies", (body,))
    return [((i, one.name), one) for i, frame in enumerate(bodies) for one in getattr(frame, "members", ())]


def _relaxed(body: Any, keys: list[tuple[int, str]]) -> Any:
    """The same body without the axial forces of some members."""
    if hasattr(body, "bodies"):
        each = [_relaxed(one, [(0, name) for number, name in keys if number == i]) for i, one in enumerate(body.bodies)]
        return replace(body, bodies=each)
    if not hasattr(body, "members"):
        return body
    names = {name for _, name in keys}
    return replace(body, members=[replace(m, axial_force=0.0) if m.name in names else m for m in body.members])
