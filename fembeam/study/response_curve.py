"""Orbits of the loads' own period along one number of a scene: swept, and where the amplitude jumps, by arc length."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

import solvers
from fembeam.model import Orbit
from fembeam.model.branch import Family
from fembeam.study.execution.checkpoint import Values
from solvers.branches import recorded_orbit, restarted_orbit

STEPS, CHANGE = 16, 0.3  # of a sweep: fewest, and the change of the amplitude in one
Found = TypeVar("Found")
SAME = 0.8  # of the change in a step: as large in half of it, it is a jump
ARC = 0.2  # largest step of a branch, see `Model.branch`


def arrays_of(found: Any) -> Values:
    """A point found on a curve, numbers and its ``orbit``, as a checkpoint keeps it."""
    text = json.dumps(recorded_orbit(found.orbit.found))
    return {name: np.array(text if name == "orbit" else value) for name, value in vars(found).items()}


def restored(kind: type[Found], arrays: Values, family: Family, at: str) -> Found:
    """The point that a checkpoint kept; ``at`` is the name of its place along the family."""
    numbers = {name: value.item() for name, value in arrays.items()}
    system, period = family(numbers[at])
    orbit = Orbit(family.at(numbers[at]), restarted_orbit(system, period, json.loads(numbers["orbit"])), family.period)
    return kind(**numbers | {"orbit": orbit})


@dataclass(frozen=True)
class Seen:
    """An orbit on a response curve: the number, half the range of u, the orbit."""

    at: float
    amplitude: float
    orbit: Orbit


@dataclass
class ResponseCurve:
    """Amplitudes of u at z along a family of models; `seen` is what was computed."""

    family: Family
    z: Any
    seen: list[Seen] = field(default_factory=list)

    def from_near(self, x: float, near: Orbit | None) -> Seen | None:
        """The orbit at x to which one nearby leads, None a run from rest; None where there is none."""
        try:
            orbit = self.family.at(x).orbit(1, near)
        except solvers.OrbitError:
            if near is None:
                raise
            return None
        return self.kept(x, orbit)

    def kept(self, x: float, orbit: Orbit) -> Seen:
        """The orbit at x, remembered."""
        lowest, highest = orbit.extremes(self.z)
        self.seen.append(Seen(x, 0.5 * (highest - lowest), orbit))
        return self.seen[-1]

    def points(self, low: float, high: float) -> list[Seen]:
        """Orbits along the curve, folds included, from one end of the span to the other."""
        points, last = self.sweep(low, high)
        if last is None:
            return points
        branch = last.orbit.model.branch(self.family.name, (low, high), 1, last.orbit, last.at, step=ARC)
        return [self.kept(one.parameter, one) for one in branch.run().orbits]

    def sweep(self, start: float, end: float) -> tuple[list[Seen], Seen | None]:
        """Orbits, each begun from the last; where the amplitude jumps the sweep ends with the orbit before."""
        step = largest = (end - start) / STEPS
        first = self.from_near(start, None)
        assert first is not None  # or it raises
        points, refused = [first], math.inf
        while (last := points[-1]).at < end:
            x = end if end - last.at <= 1.01 * step else last.at + step
            one = self.from_near(x, last.orbit)
            change = math.inf if one is None else abs(one.amplitude - last.amplitude)
            if one is not None and change <= CHANGE * max(one.amplitude, last.amplitude):
                points.append(one)
                step = min(2.0 * step, largest) if change < 0.3 * CHANGE * last.amplitude else step
                refused = math.inf
            elif one is None or change > SAME * refused:
                return points, last
            else:
                step, refused = 0.5 * step, change
        return points, None

    def around_largest(self, low: float, high: float) -> tuple[float, float]:
        """Bounds about the highest point of the curve, the same twice where it is an end of the span."""
        points = self.points(low, high)
        best = int(np.argmax([one.amplitude for one in points]))
        beside = [points[i] for i in (best - 1, best + 1) if 0 <= i < len(points)]
        if len(beside) < 2:
            return points[best].at, points[best].at
        if (beside[0].at > points[best].at) == (beside[1].at > points[best].at):
            beside = sorted(beside, key=lambda one: one.orbit.stable)[1:]  # a fold: the sheet between folds is not it
        self.seen = [points[best], *beside]
        places = [one.at for one in self.seen]
        return min(places), max(places)

    def amplitude(self, x: float) -> float:
        """At x, of the orbit to which the nearest high one leads; 0 where there is none."""
        known = [one.amplitude for one in self.seen if one.at == x]
        if known:
            return max(known)
        half = 0.5 * max(one.amplitude for one in self.seen)
        one = self.from_near(x, self.nearest(x, half).orbit)
        return 0.0 if one is None else one.amplitude

    def nearest(self, x: float, least: float = 0.0) -> Seen:
        """The orbit seen nearest to x, of at least an amplitude."""
        return min((one for one in self.seen if one.amplitude >= least), key=lambda one: abs(one.at - x))

    def at(self, x: float) -> Seen:
        """The highest orbit seen at x."""
        return max((one for one in self.seen if one.at == x), key=lambda one: one.amplitude)
