"""Continuation of periodic orbits over a parameter.

`walk` controls the steps along the branch, `point` takes one, `bifurcations` locates folds, flips and tori,
`count_changes` where contacts or phases of stick come and go, `hopping` continues past corners due to laws with memory,
`grazing`, `merging` and `nonsmooth` cross the points where the return map is not smooth, `reshooting` moves the starts
of shots, `subharmonic_end` ends a branch on that of half the period, `ending` says how one ended, `restart` reads one
back, or a single orbit. `folds` follows a fold over a second parameter. Imports: `orbits` and what that may. Begin with
`continuation.branch`.
"""

from solvers.branches.folds import FoldCurve, fold_curve
from solvers.branches.restart import recorded, recorded_orbit, restarted, restarted_orbit
from solvers.branches.walk import BranchStatus

__all__ = ["BranchStatus", "FoldCurve", "fold_curve", "recorded", "recorded_orbit", "restarted", "restarted_orbit"]
