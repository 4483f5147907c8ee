r"""Branches of periodic orbits by pseudo-arclength continuation.

From each point a guess a step ahead, on the tangent or on the cubic through the point before too; Newton's method back
to the branch (Keller, Numerical solution of bifurcation and nonlinear eigenvalue problems, 1977); then a step as long
as the guess was good. A branch may fold back, and has kinks where contacts graze. `solvers.point` has a step,
`solvers.special` locates the special points it passed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from solvers.birth import Scaled, birth
from solvers.chain import Chain, Problem, delayed
from solvers.correction import newton
from solvers.periodic import Orbit, OrbitError, at_zero, flown, orbit_of
from solvers.point import Point, corrected, cubic, is_straight, metric_of, moved, point_of
from solvers.quiet import quiet_begins, with_memory
from solvers.shooting import checked, checked_start, start_chain
from solvers.special import between
from solvers.system import Array, System

MOST_ORBITS = 2000
_SMALLEST = 3e-7  # arclength step at which a branch counts as lost
_GOOD = 0.06, 0.1  # distance of a good guess from the branch, in units of the step: on a cubic, on the tangent
_MANY = 6  # Newton iterations that ask for shorter steps
_SHARPEST = 0.8  # cosine of the largest turn between two orbits
_KINK = 3e-6  # arclength step below which a turn counts as a kink of the branch
_NEAR_KINK = 1e-4  # arclength step below which a fold may hide behind a kink
_FARTHEST = 20.0  # distance of an orbit from the one before, in steps, beyond which it belongs to another branch
_MARGIN = 0.1  # of the longest quiet time that must lie on both sides of a shot's begin


class BranchStatus(Enum):
    """How a branch ended, as a sentence."""

    RUNNING = "not finished yet"
    END = "reached the end of the span"
    CLOSED = "closed: came back to its first orbit"
    RETURNED = "came back to an orbit it had passed: it turned round or went over to another branch"
    BORN = "reached its birth at a flip of the branch of half the period"
    LOST = "lost: no orbit was found however small the step"
    LIMIT = f"stopped after {MOST_ORBITS} orbits"


@dataclass(eq=False)
class Arm:
    """One direction of a branch, walked as far as it has been asked for."""

    point: Point
    span: tuple[float, float]
    largest: float
    orbits: list[Orbit] = field(default_factory=list)
    status: BranchStatus = BranchStatus.RUNNING
    step: float = 0.0
    before: tuple[Point, float] | None = None  # the point before and the way from it
    passed: list[Point] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.first, self.step = self.point, self.step or 0.2 * self.largest
        self.orbits = [self.point.orbit]
        self.passed = [self.point]

    def extend(self) -> None:
        """Find the next orbit and the special points before it, or an end of the branch."""
        following = None
        while following is None:
            if self.step < _SMALLEST:
                self.status = BranchStatus.LOST
                return
            following = self._next()
        a = self.point
        way = float(a.tangent @ a.metric @ (following.unknowns - a.unknowns))
        special = between(a, following, way) if way > 0.0 else []  # less only where it turned at a kink
        marks = [orbit.mark for orbit in special]
        if way > _KINK and _jumped(a, following, marks):
            self.status, self.step = BranchStatus.RUNNING, 0.2 * way
            return
        for place, fold in enumerate(special):
            born = birth(a, following, fold) if fold.mark == "fold" else None
            if born is not None:
                self.status = BranchStatus.BORN
                self.orbits += [*special[:place], born]
                return
        self.orbits += [*special, following.orbit]
        self.before = None if way <= 0.0 or "grazing" in marks else (a, way)  # no cubic across a kink
        if self.status is BranchStatus.RUNNING:
            self._finish_or_go_on(following)

    def _next(self) -> Point | None:
        """The point a step ahead, the one at the end of the span if that is nearer, or None after a shorter step."""
        a, h = self.point, self.step
        guess = self._ahead()
        try:
            b = self._near(guess) if self._inside(guess) else self._at_edge(guess)
            b = b if self._inside(b.unknowns) else self._at_edge(b.unknowns)
        except (OrbitError, np.linalg.LinAlgError):
            return self._shorter(0.3)
        off, miss = b.unknowns - a.unknowns, b.unknowns - guess
        way, aligned = float(a.tangent @ a.metric @ off), float(a.tangent @ a.metric @ b.tangent)
        strayed = math.sqrt(max(off @ a.metric @ off - way**2, 0.0))
        sharp = aligned < _SHARPEST or strayed > 0.5 * way
        if (sharp and h > _KINK) or strayed > _FARTHEST * h or _is_cut(b):  # a branch has kinks where contacts graze
            return self._shorter(0.2 if len(a.orbit.contacts) != len(b.orbit.contacts) else 0.5)
        if b.chain.parameter in self.span:
            self.status = BranchStatus.END
            return b
        good = _GOOD[self.before is None] * h / max(math.sqrt(miss @ a.metric @ miss), 1e-9 * h)
        longer = min(good if self.before is None else good ** (1.0 / 3.0), 3.0)
        largest = self.largest * max(1.0, b.size)
        shortest = 0.5 if h > _KINK else 1.0
        self.step = min(h * (max(longer, shortest) if b.orbit.iterations < _MANY else shortest), largest)
        return b

    def _ahead(self) -> Array:
        """Guess of the unknowns a step ahead: along the tangent, or on the cubic through the point before too."""
        a = self.point
        if self.before is None or self.before[0].problem is not a.problem:
            self.before = None
            return a.unknowns + self.step * a.tangent
        last, way = self.before
        return cubic(last, a, way, way + self.step)

    def _near(self, guess: Array) -> Point:
        """The point near a guess, in the cheaper way if that will do."""
        straight = self._is_straight(guess)
        try:
            return moved(self.point, guess, straight)
        except OrbitError:
            if self.step > _NEAR_KINK or not straight:
                raise
            return moved(self.point, guess, False)

    def _is_straight(self, guess: Array) -> bool:
        """Whether to hold the parameter fixed: no fold is near, by the points known and the guess."""
        a = self.point
        if self.before is None:
            return abs(a.share) > 0.2
        last, way = self.before
        ahead = a.share + (a.share - last.share) * self.step / way
        moved_on = (guess[-1] - a.chain.parameter) * a.tangent[-1] > 0.0
        return moved_on and is_straight(last.share, a.share, ahead)

    def _inside(self, unknowns: Array) -> bool:
        """Whether the parameter lies in the span."""
        return bool(self.span[0] <= unknowns[-1] <= self.span[1])

    def _at_edge(self, beyond: Array) -> Point:
        """The point at the end of the span on the way to a place beyond it."""
        a = self.point
        edge = self.span[0] if beyond[-1] < self.span[0] else self.span[1]
        share = (edge - a.chain.parameter) / (beyond[-1] - a.chain.parameter)
        guess = a.unknowns + share * (beyond - a.unknowns)
        guess[-1] = edge
        return moved(a, guess, True)

    def _shorter(self, factor: float) -> None:
        """Try again nearer."""
        self.step = factor * self.step

    def _finish_or_go_on(self, point: Point) -> None:
        """Recognise orbits passed before and the limit."""
        met = self._met(point)
        if met is not None:
            self.status = BranchStatus.CLOSED if met == 0 else BranchStatus.RETURNED
            self.orbits += [self.first.orbit] if met == 0 else []
        elif len(self.orbits) >= MOST_ORBITS:
            self.status = BranchStatus.LIMIT
        else:
            self.point = _with_quiet_begin(point)

    def _met(self, point: Point) -> int | None:
        """Number of an orbit passed before that lies on the way just gone; 0 is the first."""
        a = self.point
        self.passed.append(point)
        if point.problem.fractions != a.problem.fractions:
            return None
        known = [i for i, p in enumerate(self.passed[:-4]) if p.problem.fractions == a.problem.fractions]
        if not known:
            return None
        way = point.unknowns - a.unknowns
        length = float(way @ point.metric @ way)
        off = np.array([self.passed[i].unknowns for i in known]) - a.unknowns
        share = off @ (point.metric @ way) / length
        off -= np.outer(share, way)
        aligned = np.array([self.passed[i].tangent for i in known]) @ (point.metric @ point.tangent)
        distance = np.einsum("ki,ij,kj->k", off, point.metric, off)
        near = (share > 0.0) & (share <= 1.0) & (np.abs(aligned) > 0.5) & (distance < 1e-2 * length)
        return next((known[k] for k in np.flatnonzero(near) if _is_passed(self.passed[known[k]], a, point)), None)


def _jumped(a: Point, b: Point, marks: list[str]) -> bool:
    """Whether b lies on another branch: between them the parameter turns without a fold, or contacts come unseen."""
    turned, changed = a.share * b.share < 0.0, len(a.orbit.contacts) != len(b.orbit.contacts)
    return "grazing" not in marks and (changed or (turned and "fold" not in marks))


def _is_passed(known: Point, a: Point, b: Point) -> bool:
    """Whether an orbit lies on the branch between two points, which others near it do not."""
    way = float(a.tangent @ a.metric @ (b.unknowns - a.unknowns))
    share = (known.chain.parameter - a.chain.parameter) / (b.chain.parameter - a.chain.parameter)
    if not (way > 0.0 and 0.0 <= share <= 1.0):
        return False
    guess = np.append(cubic(a, b, way, share * way)[:-1], known.chain.parameter)
    try:
        chain, *_ = corrected(a, guess, True)
    except (OrbitError, np.linalg.LinAlgError):
        return False
    off = np.append(chain.x.ravel(), chain.parameter) - known.unknowns
    return bool(off @ a.metric @ off < 1e-12)


def _is_cut(point: Point) -> bool:
    """Whether a contact with memory is under way where a shot begins."""
    system, log = point.orbit.system, [solution.contacts for solution in point.chain.solutions]
    return any(
        np.any(np.isin(one.stop, with_memory(system)) & ((one.t_in == 0.0) | np.isnan(one.t_out))) for one in log
    )


def _with_quiet_begin(point: Point) -> Point:
    """The same point, its shots begun later where a contact has come near one of their begins."""
    orbit, m = point.orbit, len(point.problem.fractions)
    log, period = orbit.contacts, orbit.period
    offsets = [(f - point.problem.fractions[0]) * period for f in point.problem.fractions]
    mine = np.isin(log.stop, with_memory(orbit.system))
    times = np.concatenate((log.t_in[mine], log.t_out[mine], log.t_out[mine] - period))
    if min(np.abs(times - t).min(initial=period) for t in offsets) > _MARGIN * period / (1 + len(log)):
        return point
    begins = quiet_begins(orbit.system, log, period, m, False)
    if len(begins) < m:
        return point
    later = delayed(orbit.system, orbit.phase)
    x = np.array([flown(later, orbit.state, t, orbit.method) for t in begins])
    fractions = [(orbit.phase + t) / period for t in begins]
    turns = math.floor(fractions[0])
    problem = replace(point.problem, fractions=tuple(f - turns for f in fractions))
    try:
        chain, error, iterations = newton(problem, x, point.chain.parameter, slope=True)
    except OrbitError:
        return point
    return point_of(problem, chain, error, iterations, point.metric, _carried(point, chain, begins))


def _carried(point: Point, chain: Chain, begins: list[float]) -> Array:
    """The tangent seen from later begins."""
    shift, n2 = begins[0], chain.x.shape[1]
    there = replace(point.problem, fractions=(point.problem.fractions[0],))
    make = there.make

    def shortened(parameter: float) -> tuple[System, float]:
        system, period = make(parameter)
        return delayed(system, there.fractions[0] * period), shift / point.orbit.period * period

    carried = replace(there, make=shortened, fractions=(0.0,)).evaluate(point.chain.x[:1], chain.parameter)
    first = carried.tangents[0] @ point.tangent[:n2] + carried.by_parameter[0] * point.tangent[-1]
    states = [first]
    for tangent, column in zip(chain.tangents[:-1], chain.by_parameter[:-1], strict=True):
        states.append(tangent @ states[-1] + column * point.tangent[-1])
    return np.append(np.concatenate(states), point.tangent[-1])


@dataclass(eq=False)
class Branch:
    """Orbits along a parameter, computed as they are asked for: iterate over it, or call `run`.

    Interrupt an iteration and start another: it gives what is known, then goes on from there.
    """

    arms: list[Arm]
    kept: dict[int, Any] = field(default_factory=dict)  # for the user of the branch

    @property
    def orbits(self) -> list[Orbit]:
        """What is known so far, from one end of the branch to the other; special ones carry a ``mark``."""
        behind = self.arms[1].orbits[:0:-1] if len(self.arms) > 1 else []
        return behind + self.arms[0].orbits

    @property
    def status(self) -> tuple[BranchStatus, ...]:
        """How each direction ended."""
        closed = self.arms[0].status is BranchStatus.CLOSED  # then there is but one direction
        return tuple(arm.status for arm in self.arms[: 1 if closed else None])

    @property
    def special(self) -> list[Orbit]:
        """The marked orbits."""
        return [orbit for orbit in self.orbits if orbit.mark]

    def __iter__(self) -> Iterator[Orbit]:
        """Known orbits, then new ones, one direction after the other."""
        for number, arm in enumerate(self.arms):
            if self.arms[0].status is BranchStatus.CLOSED and number:
                return
            i = min(number, 1)  # both arms begin with the same orbit
            while True:
                while i < len(arm.orbits):
                    yield arm.orbits[i]
                    i += 1
                if arm.status is not BranchStatus.RUNNING:
                    break
                arm.extend()

    def run(self) -> Branch:
        """Compute all of it."""
        for _ in self:
            pass
        return self

    def doubled(self, flip: Orbit) -> Branch:
        """The branch of twice the period that is born at a flip of this one."""
        if flip.mark != "flip":
            raise ValueError(f"a branch doubles at an orbit marked 'flip', got one marked {flip.mark!r}")
        arm = self.arms[0]
        old = arm.first.problem
        fraction = flip.phase / flip.period
        problem = Problem(Scaled(old.make, 2.0), old.method, (0.5 * fraction, 0.5 * fraction + 0.5), old.step)
        values, vectors = np.linalg.eig(flip.monodromy)
        v = vectors[:, np.argmin(np.abs(values + 1.0))].real
        x = np.array([flip.state, flip.state])
        metric = metric_of(problem, flip.parameter, x, arm.span[1] - arm.span[0])
        tangent = np.concatenate((v, -v, [0.0]))
        tangent /= math.sqrt(tangent @ metric @ tangent)
        chain = problem.evaluate(x, flip.parameter)
        orbit = orbit_of(problem, chain, flip.residual, 0, parameter=flip.parameter, mark="flip")
        return Branch([Arm(Point(orbit, problem, chain, tangent, metric), arm.span, arm.largest)])


def branch(
    make_system: Callable[[float], tuple[System, float]],
    span: tuple[float, float],
    start: Orbit | ArrayLike,
    at: float | None = None,
    *,
    step: float = 0.04,
    shots: int = 1,
    method: Any = None,
) -> Branch:
    """Follow a periodic orbit along a parameter, in both directions.

    Parameters
    ----------
    make_system : parameter -> (system, period in s); the systems must agree in size, contacts and loads.
    span : (lowest, highest) value of the parameter.
    start : an orbit, or a state [q, q̇] at t = 0 near one.
    at : the parameter there; None: the orbit's own, else ``span[0]``.
    step : largest step along the branch, in units of the span and the first orbit's size.
    shots : per period.
    method : an `Exponential`; None takes one with rtol 1e-11.

    Returns
    -------
    Branch : nothing but its first orbit is computed before it is iterated over.

    Raises
    ------
    ValueError for bad input; OrbitError when there is no orbit near the start.

    Examples
    --------
    >>> def free(omega):
    ...     return System.modal([1.0], [0.1]), 2.0 * np.pi / omega
    >>> branch(free, (0.5, 2.0), start=[0.0, 0.0], step=0.5).run().status
    (<BranchStatus.END: 'reached the end of the span'>,)
    """
    low, high = (float(value) for value in span)
    if not -math.inf < low < high < math.inf:
        raise ValueError(f"span must be two finite values, ascending, got {span!r}")
    if not 0.0 < step <= 1.0:
        raise ValueError(f"step must lie in (0, 1], got {step!r}")
    own = start.parameter if isinstance(start, Orbit) else math.nan
    if at is None and isinstance(start, Orbit) and math.isnan(own):
        raise ValueError("the orbit to start from knows no parameter; give at=")
    parameter = at if at is not None else low if math.isnan(own) else own
    if not low <= parameter <= high:
        raise ValueError(f"the start must lie in the span {span}, got {parameter!r}; give at=")
    system, period = make_system(parameter)
    method = checked(system, period, method, shots)
    first = at_zero(start) if isinstance(start, Orbit) else checked_start(system, start)
    problem, x = start_chain(system, period, first, method, shots)
    problem = replace(problem, make=make_system, step=1e-6 * (high - low))
    chain, error, iterations = newton(problem, x, parameter, slope=True)
    metric = metric_of(problem, parameter, chain.x, high - low)
    ahead = np.zeros(len(metric))
    ahead[-1] = 1.0
    point = point_of(problem, chain, error, iterations, metric, ahead)
    back = replace(point, tangent=-point.tangent)
    return Branch(
        [Arm(p, (low, high), step) for p, room in ((point, parameter < high), (back, parameter > low)) if room]
    )
