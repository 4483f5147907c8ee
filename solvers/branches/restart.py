"""A branch restored from records of its orbits, to be continued."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from solvers.branches.continuation import Branch
from solvers.branches.point import Point, metric_of, point_of
from solvers.branches.walk import BranchStatus, Walk
from solvers.orbits import PeriodicProblem, checked, newton
from solvers.problem import System


def restarted(
    make_system: Callable[[float], tuple[System, float]],
    span: tuple[float, float],
    walks: list[list[dict[str, Any]]],
    status: list[str],
    step: float,
) -> Branch:
    """A branch restored from records of its orbits per direction.

    A record has parameter, state (as `Orbit.whole`), phase, mark, iterations.
    """
    upwards = [walks[0][0]["parameter"] < span[1], False]  # of one direction alone only one has room
    return Branch(
        [
            _restarted_walk(make_system, span, records, BranchStatus[name], step, up)
            for records, name, up in zip(walks, status, upwards, strict=False)
        ]
    )


def _restarted_walk(
    make: Any, span: tuple[float, float], records: list[dict[str, Any]], status: BranchStatus, step: float, up: bool
) -> Walk:
    """One direction, up or down from its first orbit; orbits are integrated again, their states are not changed."""
    points: list[Point] = []
    system, period = make(records[0]["parameter"])
    method, width = checked(system, period, None, 1), span[1] - span[0]
    for record in records:
        _, period = make(record["parameter"])
        x = np.array([record["state"]])
        problem = PeriodicProblem(make, method, (record["phase"] / period,), 1e-6 * width)
        chain, error, _ = newton(problem, x, record["parameter"], slope=True)
        metric = points[0].metric if points else metric_of(problem, chain, width)
        moved = np.append(np.zeros(x.size), 1.0 if up else -1.0)
        if points:
            moved = np.append(x.ravel(), record["parameter"]) - points[-1].unknowns
            moved[:-1] *= problem.fractions == points[-1].problem.fractions
        point = point_of(problem, chain, error, record["iterations"], metric, moved)
        points.append(replace(point, orbit=replace(point.orbit, mark=record["mark"])))
    first = points[0]
    if len(points) > 1:  # the first tangent points to the second orbit
        ahead = first.tangent @ first.metric @ (points[1].unknowns - first.unknowns)
        first = replace(first, tangent=first.tangent * np.sign(ahead))
    walk = Walk(first, span, step)
    walk.point, walk.orbits, walk.status = points[-1], [point.orbit for point in points], status
    walk.passed, walk.values = [first, *points[1:]], [point.chain.parameter for point in points]
    return walk
