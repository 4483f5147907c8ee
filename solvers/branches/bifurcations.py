"""Special points of a branch between two of its points.

A special point is a sign change of its test function along the arclength. With the Floquet multipliers μ:

    fold             parameter's share of the tangent
    flip             Π (μ_i + 1) / (1 + |μ_i|)                          (period doubling)
    neimark-sacker   Π_{i<j} (1 - μ_i μ_j) / (1 + |μ_i μ_j|), at a complex pair
    branch point     Π (1 - μ_i) / (1 + |μ_i|), where there is no fold
    grazing          number of contacts within the period changes
    stick            number of borders that laws with memory pass changes: a phase of slip, stick or yielding is born
    floor            a contact's entry rate less its law's floor, below which the law does not depend on it

μ_i are the transverse ones: those of a family of orbits are 1 all along. All but the grazings and sticks are continuous
along the branch, so that Brent's method finds their zeros in a few orbits. A multiplier that jumps over the unit circle
at a grazing or a floor is reported as that, not also as a flip. Points where Newton's method fails because the return
map is not smooth are located before, by `nonsmooth`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np

from solvers.branches.count_changes import nonsmooth_points, zero
from solvers.branches.point import Point, corrected, cubic, is_straight, tangent_of
from solvers.orbits import Chain, Orbit, OrbitError, orbit_of
from solvers.problem import Array

ROUNDING = 1e-9  # of a factor of a test function: one that is zero all along marks nothing
_SHARP = 1e-10  # tolerance of a special point, in units of the arclength between the points
_AT = 1e-4  # distance of a multiplier from its value at a special point up to which it is one
_NUDGES = 0.0, 1e-7, -1e-7, 1e-6, -1e-6  # of the arclength: for some guesses rounding keeps residuals too large


def indicators(orbit: Orbit, tangent: Array) -> dict[str, float]:
    """Test functions of an orbit; each changes its sign at a special point of its name."""
    products = {name: float(factors.prod().real) for name, factors in _factors(orbit).items()}
    return {"fold": float(tangent[-1]), **products}


def _factors(orbit: Orbit) -> dict[str, Any]:
    """The factors of each test function that is a product; real, or in conjugate pairs, none larger than 1."""
    mu = orbit.transverse
    first, second = np.triu_indices(len(mu), 1)  # of all pairs
    values = {"flip": mu, "neimark-sacker": -mu[first] * mu[second], "branch point": -mu}
    return {name: (one + 1.0) / (1.0 + np.abs(one)) for name, one in values.items()}


def indicators_at(point: Point) -> dict[str, float]:
    """Test functions of a point, computed once."""
    if not point.tests:
        point.tests.update(indicators(point.orbit, point.tangent))
    return point.tests


def _is_at(orbit: Orbit, name: str) -> bool:
    """Whether a multiplier has the value of a special point."""
    mu = orbit.transverse
    if name == "neimark-sacker":
        turning = np.abs(mu.imag) > 1e-6 * np.abs(mu)
        return bool(np.any(np.abs(np.abs(mu[turning]) - 1.0) < _AT))
    return bool(np.abs(mu - (-1.0 if name == "flip" else 1.0)).min() < _AT)


@dataclass(eq=False)
class Arc:
    """The part of a branch between two neighbouring points; every orbit found on it improves the next guess.

    Branch minus the cubic through both points and tangents is s² (length - s)² times an interpolated function.
    """

    a: Point
    b: Point
    length: float
    straight: bool = field(init=False)
    known: list[tuple[float, Array]] = field(default_factory=list)  # (arclength, the smooth function there)
    trials: dict[float, tuple[Chain, Orbit]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.straight = is_straight(self.a.share, self.b.share)

    def at(self, s: float) -> tuple[Chain, Orbit]:
        """The branch at an arclength from a; raises OrbitError."""
        if s not in self.trials:
            guess, bend = cubic(self.a, self.b, self.length, s), (s * (self.length - s)) ** 2
            if self.known:
                places, off = [place for place, _ in self.known], np.array([rest for _, rest in self.known])
                guess += bend * np.array([np.interp(s, places, column) for column in off.T])
            chain = corrected(self.a, guess, self.straight, not self.straight)
            rest = chain.unknowns - cubic(self.a, self.b, self.length, s)
            if bend > 0.0:
                self.known = sorted([*self.known, (s, rest / bend)], key=lambda pair: pair[0])
            self.trials[s] = chain, orbit_of(self.a.problem, chain)
        return self.trials[s]

    def orbit(self, s: float) -> Orbit:
        """The orbit at an arclength from a; raises OrbitError."""
        return self.a.orbit if s == 0.0 else self.b.orbit if s == self.length else self.at(s)[1]

    def near(self, s: float, width: float) -> tuple[float, Orbit]:
        """(arclength, orbit) at s, or very near it if none is found there; raises OrbitError."""
        for place in (s + share * width for share in _NUDGES):
            try:
                return place, self.orbit(place)
            except OrbitError:
                continue
        raise OrbitError("no orbit was found near a guess between two orbits")

    def indicators(self, s: float) -> dict[str, float]:
        """Test functions at an arclength from a."""
        for place, point in ((0.0, self.a), (self.length, self.b)):
            if s == place:
                return indicators_at(point)
        chain, orbit = self.at(s)
        a = self.a
        return indicators(orbit, a.tangent if self.straight else tangent_of(chain, a.metric, a.tangent))

    def sharpness(self) -> float:
        """Arclength to which a special point is to be located."""
        return _SHARP * self.length


def between(a: Point, b: Point, length: float, before: tuple[Point, float] | None = None) -> list[Orbit]:
    """Marked orbits at the special points between two points ``length`` apart, in their order.

    ``before`` is the point before a and the arclength from it: all three may reveal two special points between.
    """
    arc = Arc(a, b, length)
    found = list(nonsmooth_points(arc))
    places = [0.0, *sorted(place for place, _ in found or _dips(arc, before)), length]
    for begin, end in pairwise(places):
        found += _roots(arc, begin, end)
    return [orbit for _, orbit in sorted(found, key=lambda pair: pair[0])]


def _roots(arc: Arc, begin: float, end: float) -> Iterator[tuple[float, Orbit]]:
    """(arclength, orbit) of the zeros of all test functions that change their sign from begin to end."""
    before, after = arc.indicators(begin), arc.indicators(end)
    names = [name for name in before if before[name] * after[name] < 0.0]
    if names:
        known = [{**tests, **_factors(arc.orbit(s))} for s, tests in ((begin, before), (end, after))]
        names = [name for name in names if all(np.abs(one[name]).min() > ROUNDING for one in known)]
    if "fold" in names and "branch point" in names:
        names.remove("branch point")
    for name in names:
        pair = _root(arc, begin, end, name)
        if pair is not None:
            yield pair


def _dips(arc: Arc, before: tuple[Point, float] | None) -> Iterator[tuple[float, Orbit]]:
    """(arclength, orbit) where a test function may change its sign twice between two points, by a parabola."""
    if before is None:
        return
    first, begin, end = (indicators_at(point) for point in (before[0], arc.a, arc.b))
    for name in ("flip", "neimark-sacker"):
        f = begin[name]
        back, ahead = (f - first[name]) / before[1], (end[name] - f) / arc.length  # slopes on both sides
        bend = (ahead - back) / (before[1] + arc.length)
        slope = ahead - bend * arc.length
        place = -0.5 * slope / bend if bend else 0.0
        if f * end[name] > 0.0 > f * (f + 0.5 * slope * place) and 0.0 < place < arc.length:
            try:
                yield place, arc.at(place)[1]
            except OrbitError:
                continue


def _root(arc: Arc, begin: float, end: float, name: str) -> tuple[float, Orbit] | None:
    """(arclength, orbit) where a test function is zero; None if it only jumps."""
    pair = zero(arc, begin, end, lambda s: arc.indicators(s)[name])
    return (pair[0], replace(pair[1], mark=name)) if pair is not None and _is_at(pair[1], name) else None
