"""A branch as plain numbers, all that its next steps need; and restored from them, to be continued.

Shots are integrated again from their states, which gives the same bits: a branch goes on as if it had not been saved.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from solvers.branches.continuation import Branch
from solvers.branches.point import Point
from solvers.branches.walk import BranchStatus, Walk
from solvers.exponential.method import Exponential
from solvers.orbits import Chain, Orbit, PeriodicProblem, constant, orbit_of
from solvers.problem import System

Make = Callable[[float], tuple[System, float]]


def recorded(branch: Branch) -> list[dict[str, Any]]:
    """Every direction as numbers, lists and text: its orbits, the points passed, where it is and its step size.

    ValueError for a branch by another method than `Exponential`.
    """
    method = branch.walks[0].first.problem.method
    if type(method) is not Exponential:
        raise ValueError(f"a branch to be saved must be by Exponential, got {method!r}; run it to its end at once")
    return [_recorded(walk) for walk in branch.walks]


def _recorded(walk: Walk) -> dict[str, Any]:
    """One direction."""
    last = None if walk.before is None else walk.before[0]
    points = list(dict.fromkeys([*walk.passed, walk.first, walk.point, *([] if last is None else [last])]))
    problems = list(dict.fromkeys(point.problem for point in points))
    metrics = {id(point.metric): point.metric for point in points}
    numbers = {id(orbit): number for number, orbit in enumerate(walk.orbits)}
    return {
        **{"span": list(walk.span), "largest": walk.largest, "step": walk.step, "status": walk.status.name},
        **{"hop": walk.hop, "at_jump": walk.at_jump, "method": asdict(walk.first.problem.method)},
        "problems": [{"fractions": list(one.fractions), "step": one.step} for one in problems],
        "metrics": [metric.tolist() for metric in metrics.values()],
        "points": [
            {
                **{"problem": problems.index(point.problem), "metric": list(metrics).index(id(point.metric))},
                **{"tangent": point.tangent.tolist(), "x": point.chain.x.tolist()},
                "listed": numbers.get(id(point.orbit)),
                **_of_orbit(point.orbit),
            }
            for point in points
        ],
        "orbits": [_of_orbit(orbit) | {"shots": _shots_of(orbit)} for orbit in walk.orbits],
        "passed": [points.index(point) for point in walk.passed],
        **{"first": points.index(walk.first), "point": points.index(walk.point)},
        "before": None if walk.before is None else [points.index(walk.before[0]), walk.before[1]],
    }


def _of_orbit(orbit: Orbit) -> dict[str, Any]:
    """What integration does not give again."""
    names = "parameter", "residual", "iterations", "mark"
    return {name: getattr(orbit, name) for name in names}


def _shots_of(orbit: Orbit) -> dict[str, Any]:
    """When its shots began, and their states."""
    assert orbit.shots is not None
    return {"fractions": list(orbit.shots[0]), "x": orbit.shots[1].tolist()}


def recorded_orbit(orbit: Orbit) -> dict[str, Any]:
    """An orbit by `Exponential` as numbers, lists and text."""
    return _of_orbit(orbit) | {"doubt": orbit.doubt, "method": asdict(orbit.method), "shots": _shots_of(orbit)}


def restarted_orbit(system: System, period: float, record: dict[str, Any]) -> Orbit:
    """An orbit of a system restored from what `recorded_orbit` made of it."""
    again = _orbit(record | {"parameter": 0.0}, constant(system, period, Exponential(**record["method"])))
    return replace(again, parameter=record["parameter"], doubt=record["doubt"])


def restarted(make_system: Make, walks: list[dict[str, Any]]) -> Branch:
    """A branch restored from what `recorded` made of it."""
    return Branch([_restarted(make_system, record) for record in walks])


def _restarted(make: Make, record: dict[str, Any]) -> Walk:
    """One direction; its shots are integrated again, their states are not changed."""
    method = Exponential(**record["method"])
    problems = [PeriodicProblem(make, method, tuple(one["fractions"]), one["step"]) for one in record["problems"]]
    metrics = [np.array(metric) for metric in record["metrics"]]
    points = [_point(one, problems[one["problem"]], metrics[one["metric"]]) for one in record["points"]]
    known = {one["listed"]: point.orbit for one, point in zip(record["points"], points, strict=True)}
    orbits = [known.get(i) or _orbit(one, problems[0]) for i, one in enumerate(record["orbits"])]
    walk = Walk(points[record["first"]], tuple(record["span"]), record["largest"])
    walk.point, walk.orbits, walk.status = points[record["point"]], orbits, BranchStatus[record["status"]]
    walk.step, walk.hop, walk.at_jump = record["step"], record["hop"], record["at_jump"]
    walk.passed = [points[i] for i in record["passed"]]
    walk.before = None if record["before"] is None else (points[record["before"][0]], record["before"][1])
    return walk


def _point(record: dict[str, Any], problem: PeriodicProblem, metric: Any) -> Point:
    """A point passed."""
    chain = _chain(record, problem, record["x"], True)
    return Point(orbit_of(problem, chain, record["mark"]), problem, chain, np.array(record["tangent"]), metric)


def _orbit(record: dict[str, Any], problem: PeriodicProblem) -> Orbit:
    """An orbit between two points."""
    problem = replace(problem, fractions=tuple(record["shots"]["fractions"]))
    return orbit_of(problem, _chain(record, problem, record["shots"]["x"], False), record["mark"])


def _chain(record: dict[str, Any], problem: PeriodicProblem, x: Any, slope: bool) -> Chain:
    """The solved chain of an orbit."""
    chain = problem.evaluate(np.array(x), record["parameter"], slope)
    return replace(chain, error=record["residual"], iterations=record["iterations"])
