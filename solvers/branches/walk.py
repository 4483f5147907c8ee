"""The arclength walk along one direction of a branch: step size, refused orbits, where it ends."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np

from solvers.branches.bifurcations import ROUNDING, between, indicators_at
from solvers.branches.grazing import Grazing, signature, unknowns_at
from solvers.branches.hopping import hopped
from solvers.branches.nonsmooth import ERRORS, NonsmoothPoint, before, behind, marked, met, nonsmooth_near
from solvers.branches.point import Point, corrected, cubic, is_straight, moved
from solvers.branches.reshooting import reshot
from solvers.branches.subharmonic_end import subharmonic_end
from solvers.orbits import Orbit, OrbitError, is_cut
from solvers.problem import Array

MOST_ORBITS = 2000
_CORNER = 1e-5  # arclength step below which, with laws with memory, a corner is looked for
_SMALLEST = 1e-8  # arclength step below which a branch counts as lost
_GOOD = 0.06, 0.1  # distance of a good guess from the branch, in units of the step: on a cubic, on the tangent
_MANY = 6  # Newton iterations from which on steps are halved
_SHARPEST = 0.8  # least cosine between the tangents of two orbits
_COINCIDENT = 3e-6  # arclength up to which a nonsmooth point may lie behind
_NEAR_NONSMOOTH = 1e-4  # arclength step below which a fold may hide behind a nonsmooth point
_NEAR = 1e-4  # arclength from where a branch is lost within which a nonsmooth point may be the reason
_SEARCH = 3.0  # arclength, in units of a failed step, within which a nonsmooth point is looked for
_RETRY = 0.03  # share of a failed step at which nonsmooth points are looked for again
_MOST_NONSMOOTH = 6  # tried at a time
_LAST_STEP = 3e-7  # arclength step below which any turn counts as a nonsmooth point
_FARTHEST = 20.0  # distance of an orbit from the one before, in steps, beyond which it belongs to another branch
_FIRST_STEP = 0.003  # first step behind a nonsmooth point, in units of the largest


class BranchStatus(Enum):
    """How a branch ended, as a sentence."""

    RUNNING = "not finished yet"
    END = "reached the end of the span"
    CLOSED = "closed: came back to its first orbit"
    RETURNED = "came back to an orbit it had passed: it turned round or went over to another branch"
    SUBHARMONIC_END = "reached its subharmonic end: a flip of the branch of half the period"
    JUMP = "ended where two contacts of a stop become one, or one two: no orbits were found that lead over the jump"
    LOST = "lost: no orbit was found however small the step; where multipliers are large, more shots may help"
    LIMIT = f"stopped after {MOST_ORBITS} orbits"


@dataclass(eq=False)
class Walk:
    """One direction of a branch, as far as it has been computed."""

    point: Point
    span: tuple[float, float]
    largest: float
    orbits: list[Orbit] = field(default_factory=list)
    status: BranchStatus = BranchStatus.RUNNING
    step: float = 0.0
    before: tuple[Point, float] | None = None  # the point before and the arclength from it
    hop: float = 0.0  # share of the span of the last hop, 0 after a longer step
    at_jump: bool = False  # whether a jump ahead could not be crossed
    passed: list[Point] = field(default_factory=list)

    def __repr__(self) -> str:
        return f"<one direction of a branch, {len(self.orbits)} orbits: {self.status.value}>"

    def __post_init__(self) -> None:
        self.first, self.step = self.point, self.step or 0.2 * self.largest
        self.orbits, self.passed = [self.point.orbit], [self.point]

    def extend(self) -> None:
        """Find the next orbit and the special points before it, or an end of the branch; all or nothing."""
        lists = {name: value.copy() for name, value in vars(self).items() if isinstance(value, list)}
        before = {**vars(self), **lists}
        try:
            self._extend()
        except BaseException:
            vars(self).update(before)
            raise

    def _extend(self) -> None:
        """The same in place."""
        following, first, tried = None, True, math.inf  # step at whose failure nonsmooth points were last looked for
        while following is None:
            h = self.step
            following = self._next() if h >= _SMALLEST else None
            if following is None and first and self.step < _CORNER:
                first, point = False, hopped(self.point, self.span, self.hop)
                if point is not None:
                    return self._hop(point)
            if following is None and (self.step < _SMALLEST or h < _RETRY * tried):
                nonsmooth, tried = self._nonsmooth_ahead(h), h
                if nonsmooth is not None and (nonsmooth[0] is None or self._taken(nonsmooth[0])):
                    return self._cross(*nonsmooth)
                if self.step < _SMALLEST and self.status is BranchStatus.RUNNING:
                    self.status = BranchStatus.JUMP if self.at_jump else BranchStatus.LOST
                if nonsmooth is not None or self.status is not BranchStatus.RUNNING:
                    return None
        if self._taken(following) and self.status is BranchStatus.RUNNING:
            self._finish_or_go_on(following)
        return None

    def _taken(self, following: Point) -> bool:
        """Whether the next orbit is accepted; it is kept with the special points before it, up to a subharmonic end."""
        a = self.point
        distance = a.along(following.unknowns - a.unknowns)
        special = between(a, following, distance, self.before)
        marks = [orbit.mark for orbit in special]
        if distance > _COINCIDENT and _jumped(a, following, marks):
            self.status, self.step = BranchStatus.RUNNING, 0.2 * distance
            return False
        for place, fold in enumerate(special):
            ending = subharmonic_end(a, following, fold) if fold.mark == "fold" else None
            if ending is not None:
                self.status = BranchStatus.SUBHARMONIC_END
                self.orbits += [*special[:place], ending]
                return False
        self.orbits += [*special, following.orbit]
        nonsmooth = {"grazing", "stick", "floor"} & {*marks}
        self.before = None if nonsmooth else (a, distance)  # no cubic across such a point
        return True

    def _nonsmooth_ahead(self, reach: float) -> tuple[Point | None, Point, list[Orbit]] | None:
        """Last point before a nonsmooth one in reach, None if already there; first one behind it; orbits to keep."""
        a, reach = self.point, max(1.5 * reach, _NEAR if self.step < _SMALLEST else 0.0)
        self.at_jump = False
        for nonsmooth in nonsmooth_near(a.orbit)[:_MOST_NONSMOOTH]:
            try:
                grazing = met(a, nonsmooth, _SEARCH * reach)
                last = self._last_before(nonsmooth, grazing, reach)
                if last is not None:
                    self.at_jump = self.at_jump or nonsmooth.kind == "merging"
                    point = behind(last, nonsmooth, grazing)
                    return (None if last is a else last), point, marked(last, point, nonsmooth, grazing)
            except ERRORS:
                continue
        return None

    def _last_before(self, nonsmooth: NonsmoothPoint, grazing: Grazing, reach: float) -> Point | None:
        """The last point before a nonsmooth point if it lies on the way within reach; raises one of ERRORS."""
        a = self.point
        off = unknowns_at(a, grazing) - a.unknowns
        distance, whole = a.along(off), a.length(off)
        if not -_COINCIDENT < distance < reach or whole > 2.0 * abs(distance) + _COINCIDENT:
            return None
        try:
            last = before(a, nonsmooth, grazing)
        except ERRORS:
            return a if 0.0 < distance <= _LAST_STEP else None  # a itself is near enough
        if not a.along(last.tangent) > 0.0:
            return None
        return last if distance > _SMALLEST else a

    def _cross(self, last: Point | None, point: Point, found: list[Orbit]) -> None:
        """Continue behind a nonsmooth point."""
        a = last or self.point
        inside = self._inside(point.unknowns)  # a jump may lead out of the span
        self.orbits[len(self.orbits) - (last is not None) :] = found if inside else found[:-1]
        self.passed += [a, point]
        self.point, self.before, self.step = reshot(point), None, _FIRST_STEP * self.largest
        if not inside:
            self.status = BranchStatus.END
        elif len(self.orbits) >= MOST_ORBITS:
            self.status = BranchStatus.LIMIT

    def _hop(self, point: Point) -> None:
        """Continue behind a corner due to laws with memory, marked if the number of transitions changes there."""
        same = len(point.orbit.transitions) == len(self.point.orbit.transitions)
        distance = abs(point.chain.parameter - self.point.chain.parameter)
        self._cross(None, point, [point.orbit if same else replace(point.orbit, mark="stick")])
        self.hop = distance / (self.span[1] - self.span[0])
        if point.chain.parameter in self.span:
            self.status = BranchStatus.END

    def _next(self) -> Point | None:
        """The point a step ahead, the one at the end of the span if that is nearer, or None after a shorter step."""
        a, h = self.point, self.step
        guess = self._ahead()
        try:
            b = self._near(guess) if self._inside(guess) else self._at_edge(guess)
            b = b if self._inside(b.unknowns) else self._at_edge(b.unknowns)
        except (OrbitError, np.linalg.LinAlgError):
            self.step *= 0.3
            return None
        off, miss = b.unknowns - a.unknowns, b.unknowns - guess
        distance, aligned = a.along(off), a.along(b.tangent)
        strayed = math.sqrt(max(float(off @ a.metric @ off) - distance**2, 0.0))
        sharp = aligned < _SHARPEST or strayed > 0.5 * distance
        across = signature(a.orbit) != signature(b.orbit) or len(a.orbit.transitions) != len(b.orbit.transitions)
        hops = h < (_COINCIDENT if across else _LAST_STEP) and distance > 0.0 and strayed < _FARTHEST * h
        if (sharp and not hops) or is_cut(b.chain, b.orbit.system):  # one not located is stepped over
            self.step *= 0.2 if len(a.orbit.contacts) != len(b.orbit.contacts) else 0.5
            return None
        if b.chain.parameter in self.span:
            self.status = BranchStatus.END
            return b
        good = _GOOD[self.before is None] * h / max(a.length(miss), 1e-9 * h)
        longer = min(good if self.before is None else good ** (1.0 / 3.0), 3.0)
        largest = self.largest * max(1.0, b.size)
        self.step = min(h * (max(longer, 0.5) if b.orbit.iterations < _MANY else 0.5), largest)
        return b

    def _ahead(self) -> Array:
        """Guess of the unknowns a step ahead: along the tangent, or on the cubic through the point before too."""
        a = self.point
        if self.before is None or self.before[0].problem is not a.problem:
            self.before = None
            return a.unknowns + self.step * a.tangent
        last, distance = self.before
        return cubic(last, a, distance, distance + self.step)

    def _near(self, guess: Array) -> Point:
        """The point near a guess, by the cheaper condition if that suffices."""
        straight = self._is_straight(guess)
        try:
            return moved(self.point, guess, straight)
        except OrbitError:
            if self.step > _NEAR_NONSMOOTH or not straight:
                raise
            return moved(self.point, guess, False)

    def _is_straight(self, guess: Array) -> bool:
        """Whether to hold the parameter fixed: no fold is near, by the points known and the guess."""
        a = self.point
        if self.before is None:
            return abs(a.share) > 0.2
        last, distance = self.before
        ahead = a.share + (a.share - last.share) * self.step / distance
        moved_on = (guess[-1] - a.chain.parameter) * a.tangent[-1] > 0.0
        return moved_on and is_straight(last.share, a.share, ahead)

    def _inside(self, unknowns: Array) -> bool:
        """Whether the parameter lies in the span."""
        return bool(self.span[0] <= unknowns[-1] <= self.span[1])

    def _at_edge(self, beyond: Array) -> Point:
        """The point at the end of the span, on the way to unknowns beyond it."""
        a = self.point
        edge = self.span[0] if beyond[-1] < self.span[0] else self.span[1]
        share = (edge - a.chain.parameter) / (beyond[-1] - a.chain.parameter)
        guess = a.unknowns + share * (beyond - a.unknowns)
        guess[-1] = edge
        return moved(a, guess, True)

    def _finish_or_go_on(self, point: Point) -> None:
        """End at an orbit passed before or at the limit, else move on to the point."""
        met = self._met(point)
        if met is not None:
            self.status = BranchStatus.CLOSED if met == 0 else BranchStatus.RETURNED
            self.orbits += [self.first.orbit] if met == 0 else []
        elif len(self.orbits) >= MOST_ORBITS:
            self.status = BranchStatus.LIMIT
        else:
            if abs(point.chain.parameter - self.point.chain.parameter) > self.hop * (self.span[1] - self.span[0]):
                self.hop = 0.0
            held = len(point.chain.frozen) > len(self.point.chain.frozen)
            if held and self.point.share * point.share < 0.0:  # a family of latched numbers has no direction of its own
                point, self.before = replace(point, tangent=-point.tangent), None
            self.point = reshot(point)

    def _met(self, point: Point) -> int | None:
        """Index of an orbit passed before that lies on the arc just computed; 0 is the first; None if there is none."""
        a = self.point
        self.passed.append(point)
        if point.problem.fractions != a.problem.fractions:
            return None
        low, high = sorted((a.chain.parameter, point.chain.parameter))
        among = [i for i, one in enumerate(self.passed[:-4]) if low <= one.chain.parameter <= high]
        known = [i for i in among if self.passed[i].problem.fractions == a.problem.fractions]
        if not known:
            return None
        chord = point.unknowns - a.unknowns
        length = float(chord @ point.metric @ chord)
        off = np.array([self.passed[i].unknowns for i in known]) - a.unknowns
        share = off @ (point.metric @ chord) / length
        off -= np.outer(share, chord)
        aligned = np.array([self.passed[i].tangent for i in known]) @ (point.metric @ point.tangent)
        distance = np.einsum("ki,ij,kj->k", off, point.metric, off)
        near = (share > 0.0) & (share <= 1.0) & (np.abs(aligned) > 0.5) & (distance < 1e-2 * length)
        return next((known[k] for k in np.flatnonzero(near) if _is_passed(self.passed[known[k]], a, point)), None)


def _jumped(a: Point, b: Point, marks: list[str]) -> bool:
    """Whether b lies on another branch.

    Then the parameter turns, a multiplier passes 1, or contacts change, without a special point.
    """
    turned = a.share * b.share < 0.0 and not {"fold", "floor", "stick"} & {*marks}
    first, second = (indicators_at(point)["branch point"] for point in (a, b))
    passed = first * second < 0.0 and min(abs(first), abs(second)) > ROUNDING
    passed = passed and not {"fold", "floor", "branch point", "stick"} & {*marks}
    return "grazing" not in marks and (turned or passed or not _same_contacts(a.orbit, b.orbit))


def _same_contacts(a: Orbit, b: Orbit) -> bool:
    """Whether every contact of an orbit has one of the other near it, nearer than half the time to the next."""
    if len(a.contacts) != len(b.contacts):
        return False
    for stop in np.unique(a.contacts.stop):
        first, second = (np.sort(o.contacts.t_in[o.contacts.stop == stop]) / o.period for o in (a, b))
        spacing = np.diff(first, append=first[0] + 1.0)
        if len(first) != len(second) or np.any(np.abs(first - second) > 0.5 * np.minimum(spacing, np.roll(spacing, 1))):
            return False
    return True


def _is_passed(known: Point, a: Point, b: Point) -> bool:
    """Whether a known orbit lies on the branch between two points, by correcting a guess at its parameter."""
    distance = a.along(b.unknowns - a.unknowns)
    share = (known.chain.parameter - a.chain.parameter) / (b.chain.parameter - a.chain.parameter)
    alike = _same_contacts(known.orbit, a.orbit) or _same_contacts(known.orbit, b.orbit)
    if not (alike and distance > 0.0 and 0.0 <= share <= 1.0):
        return False
    guess = np.append(cubic(a, b, distance, share * distance)[:-1], known.chain.parameter)
    try:
        chain = corrected(a, guess, True)
    except (OrbitError, np.linalg.LinAlgError):
        return False
    off = chain.unknowns - known.unknowns
    return bool(off @ a.metric @ off < 1e-12)
