"""How one direction of a branch ended, in words: where, and what is near if it was lost."""

from __future__ import annotations

import numpy as np

from solvers.branches.nonsmooth import nonsmooth_near
from solvers.branches.walk import BranchStatus, Walk


def ending(walk: Walk) -> str:
    """The status as a sentence, with the parameter unless that is the end of the span."""
    word, values, ahead = walk.status.value, [orbit.parameter for orbit in walk.orbits], walk.first.share > 0.0
    if walk.status in (BranchStatus.LOST, BranchStatus.JUMP):
        return f"{word}; the last orbit, at {values[-1]:.9g}, {_about(walk)}"
    if walk.status is BranchStatus.END and values[-1] != walk.span[ahead]:
        return f"{word}: turned round at {(max if ahead else min)(values):.9g}, came to {values[-1]:.9g}"
    return word


def _about(walk: Walk) -> str:
    """What may be the reason that no orbit was found beyond the last one."""
    orbit, near = walk.point.orbit, nonsmooth_near(walk.point.orbit)
    meets = f" and is near a {near[0].kind} of contact {near[0].first[1]}" if near else ""
    return f"has multipliers up to {np.abs(orbit.multipliers).max():.3g}{meets}"
