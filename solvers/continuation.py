r"""Branches of periodic orbits by pseudo-arclength continuation, with their special points located.

The unknowns y = [states of the shots, parameter] move along the branch's tangent t, then Newton's method returns at
right angles to it (Keller, Numerical solution of bifurcation and nonlinear eigenvalue problems, 1977). Lengths are
measured with states relative to the first orbit's size and the parameter relative to the span, so that a branch may
fold back.

A special point between two orbits is a sign change of its test function along the arclength, found by Brent's method:

    fold             parameter's share of the tangent
    flip             1 + smallest real multiplier                    (period doubling)
    neimark-sacker   largest modulus of a complex multiplier - 1
    branch point     largest real multiplier - 1, where there is no fold
    grazing          number of contacts within the period changes

A multiplier that jumps over the unit circle at a grazing has no flip of its own: only the grazing is reported.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from solvers.shooting import (
    Border,
    Chain,
    Orbit,
    OrbitError,
    Problem,
    at_zero,
    checked,
    checked_start,
    delayed,
    flown,
    latches,
    newton,
    orbit_of,
    quiet_begins,
    start_chain,
    weights,
)
from solvers.system import Array, System

MOST_ORBITS = 2000
_SMALLEST = 3e-7  # arclength step at which a branch counts as lost
_FEW, _MANY = 3, 6  # Newton iterations that ask for longer and shorter steps
_SHARPEST = 0.8  # cosine of the largest turn between two orbits
_KINK = 3e-6  # arclength step below which a turn counts as a kink of the branch
_ROUNDING = 1e-9  # of the test functions: what is at a special point all along is marked nowhere
_MARGIN = 0.1  # of the longest quiet time that must lie on both sides of a shot's begin


class BranchStatus(Enum):
    """How a branch ended, as a sentence."""

    RUNNING = "not finished yet"
    END = "reached the end of the span"
    CLOSED = "closed: came back to its first orbit"
    RETURNED = "came back to an orbit it had passed: it turned round or went over to another branch"
    LOST = "lost: no orbit was found however small the step"
    LIMIT = f"stopped after {MOST_ORBITS} orbits"


@dataclass(frozen=True, eq=False)
class Point:
    """An orbit on the branch with what it takes to go on from it."""

    orbit: Orbit
    problem: Problem
    chain: Chain
    tangent: Array
    metric: Array

    @property
    def unknowns(self) -> Array:
        """[states, parameter]."""
        return np.append(self.chain.x.ravel(), self.chain.parameter)


def indicators(orbit: Orbit, tangent: Array) -> dict[str, float]:
    """Test functions of an orbit; each changes its sign at a special point of its name."""
    mu = orbit.multipliers
    real = np.abs(mu.imag) <= 1e-9 * np.abs(mu)
    return {
        "fold": float(tangent[-1]),
        "flip": 1.0 + float(mu[real].real.min(initial=0.0)),
        "neimark-sacker": float(np.abs(mu[~real]).max(initial=0.0)) - 1.0,
        "branch point": float(mu[real].real.max(initial=0.0)) - 1.0,
    }


def _metric(problem: Problem, parameter: float, x: Array, width: float) -> Array:
    """Matrix of the arclength over [states, parameter]."""
    W = weights(*problem.make(parameter))
    size = float(np.linalg.norm(x @ W.T, axis=1).max()) or 1.0  # an orbit at rest has none
    m, n2 = x.shape
    metric = np.zeros((m * n2 + 1, m * n2 + 1))
    metric[:-1, :-1] = np.kron(np.eye(m), W.T @ W / (m * size**2))
    metric[-1, -1] = 1.0 / width**2
    return metric


def _tangent(chain: Chain, metric: Array, along: Array) -> Array:
    """Unit tangent of the branch that points along a given direction."""
    size = chain.residual.size
    matrix = np.block([[chain.jacobian(), chain.by_parameter.reshape(-1, 1)], [(metric @ along)[None, :]]])
    right = np.zeros(size + 1)
    right[-1] = 1.0
    tangent = np.linalg.solve(matrix, right)
    unit: Array = tangent / math.sqrt(tangent @ metric @ tangent)
    return unit


def _point(problem: Problem, chain: Chain, error: float, iterations: int, metric: Array, along: Array) -> Point:
    """The point of a solved chain."""
    tangent = _tangent(chain, metric, along)
    orbit = orbit_of(problem, chain, error, iterations, parameter=chain.parameter)
    return Point(orbit, problem, chain, tangent, metric)


def _ahead(point: Point, h: float, before: tuple[Point, float] | None) -> Array:
    """Guess of the unknowns an arclength ahead: along the tangent, or on the cubic through the point before too."""
    if before is None or before[0].problem is not point.problem:
        return point.unknowns + h * point.tangent
    last, way = before
    s = 1.0 + h / way
    a, b, c, d = (
        (1.0 + 2.0 * s) * (1.0 - s) ** 2,
        s * (1.0 - s) ** 2 * way,
        s * s * (3.0 - 2.0 * s),
        s * s * (s - 1.0) * way,
    )
    guess: Array = a * last.unknowns + b * last.tangent + c * point.unknowns + d * point.tangent
    return guess


def _moved(point: Point, h: float, before: tuple[Point, float] | None = None) -> Point:
    """The point at an arclength from another one; raises OrbitError."""
    guess = _ahead(point, h, before)
    x = guess[:-1].reshape(point.chain.x.shape)
    chain, error, iterations = newton(point.problem, x, guess[-1], Border(point.metric, point.tangent))
    return _point(point.problem, chain, error, iterations, point.metric, point.tangent)


def _between(a: Point, b: Point, h: float) -> list[Orbit]:
    """Marked orbits at the special points between two points h apart, in their order."""
    before, after = indicators(a.orbit, a.tangent), indicators(b.orbit, b.tangent)
    names = [name for name in before if before[name] * after[name] < 0.0]
    names = [name for name in names if min(abs(before[name]), abs(after[name])) > _ROUNDING]
    if "fold" in names and "branch point" in names:
        names.remove("branch point")
    found = [_root(a, h, name, before[name], after[name]) for name in names]
    if len(a.orbit.contacts) != len(b.orbit.contacts):
        found.append(_grazing(a, b, h))
    return [orbit for _, orbit in sorted((pair for pair in found if pair), key=lambda pair: pair[0])]


def _root(a: Point, h: float, name: str, before: float, after: float) -> tuple[float, Orbit] | None:
    """(arclength, orbit) where a test function is zero; None where it only jumps."""
    from scipy.optimize import brentq

    known = {0.0: before, h: after}
    try:
        place = brentq(lambda s: known[s] if s in known else _indicator(a, s, name), 0.0, h, xtol=1e-11 * h, maxiter=60)
        point = _moved(a, place)
    except OrbitError:
        return None
    if abs(indicators(point.orbit, point.tangent)[name]) > 1e-5:
        return None
    return place, replace(point.orbit, mark=name)


def _indicator(a: Point, s: float, name: str) -> float:
    """A test function at an arclength from a."""
    point = _moved(a, s)
    return indicators(point.orbit, point.tangent)[name]


def _grazing(a: Point, b: Point, h: float) -> tuple[float, Orbit] | None:
    """(arclength, orbit) where the number of contacts changes: where the shallowest one's indentation goes to zero."""
    few, many = sorted((len(a.orbit.contacts), len(b.orbit.contacts)))
    sign = 1.0 if len(b.orbit.contacts) == many else -1.0  # towards more contacts
    bare, touched = (0.0, h) if sign > 0.0 else (h, 0.0)  # the two ends of what is left of the way
    known = [(touched, _shallowest(b.orbit if sign > 0.0 else a.orbit))]
    orbit = b.orbit if sign > 0.0 else a.orbit
    for _ in range(60):
        if abs(touched - bare) <= 1e-9 * h:
            return touched, replace(orbit, mark="grazing")
        place = 0.5 * (bare + touched)
        if len(known) > 1 and known[-1][1] != known[-2][1]:
            (s0, f0), (s1, f1) = known[-2:]
            root = s1 - f1 * (s1 - s0) / (f1 - f0)
            if abs(root - touched) <= 1e-9 * h:
                return touched, replace(orbit, mark="grazing")
            if min(bare, touched) < root < max(bare, touched):
                place = root + 0.01 * (touched - root)
        try:
            trial = _moved(a, place).orbit
        except OrbitError:
            return None
        if len(trial.contacts) <= few:
            bare = place
        else:
            touched, orbit = place, trial
            known.append((place, _shallowest(trial)))
    return touched, replace(orbit, mark="grazing")


def _shallowest(orbit: Orbit) -> float:
    """Smallest peak indentation of an orbit's contacts."""
    return float(orbit.contacts.peak_indentation.min())


@dataclass(eq=False)
class _Arm:
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
        special = _between(a, following, way) if way > 0.0 else []  # less only where it turned at a kink
        self.orbits += [*special, following.orbit]
        self.before = (a, way) if not special and way > 0.0 else None  # no cubic across a kink
        if self.status is BranchStatus.RUNNING:
            self._finish_or_go_on(following)

    def _next(self) -> Point | None:
        """The point a step ahead, the one at the end of the span if that is nearer, or None after a shorter step."""
        a, h = self.point, self.step
        pace = a.tangent[-1]
        ahead = a.chain.parameter + h * pace
        try:
            if self.span[0] <= ahead <= self.span[1]:
                b = _moved(a, h, self.before)
            else:
                edge = self.span[0] if ahead < self.span[0] else self.span[1]
                h = (edge - a.chain.parameter) / pace
                b = _at(a, h, edge)
        except (OrbitError, np.linalg.LinAlgError):
            self.step, self.before = 0.4 * self.step, None
            return None
        off = b.unknowns - a.unknowns - h * a.tangent
        strayed = math.sqrt(off @ a.metric @ off) / h
        sharp = strayed > 0.5 or a.tangent @ a.metric @ b.tangent < _SHARPEST
        if (sharp and h > _KINK) or strayed > 20.0 or _is_cut(b):  # a branch has kinks where contacts graze
            self.step, self.before = 0.5 * self.step, None
            return None
        if h < self.step:
            self.status, self.step = BranchStatus.END, h
        return b

    def _finish_or_go_on(self, point: Point) -> None:
        """Recognise orbits passed before and the limit; else choose the next step."""
        met = self._met(point)
        if met is not None:
            self.status = BranchStatus.CLOSED if met == 0 else BranchStatus.RETURNED
            self.orbits += [self.first.orbit] if met == 0 else []
            return
        if len(self.orbits) >= MOST_ORBITS:
            self.status = BranchStatus.LIMIT
            return
        iterations = point.orbit.iterations
        self.step *= 1.5 if iterations <= _FEW else 0.6 if iterations >= _MANY else 1.0
        self.step = min(self.step, self.largest)
        self.point = _with_quiet_begin(point)

    def _met(self, point: Point) -> int | None:
        """Number of an orbit passed before that lies on the way just gone; 0 is the first.

        On the way back, that is turned round, it must lie very near: the sides of a narrow fold are close too.
        """
        a = self.point
        way = point.unknowns - a.unknowns
        length = float(way @ point.metric @ way)
        self.passed.append(point)
        for number, known in enumerate(self.passed[:-4]):
            if not known.problem.fractions == point.problem.fractions == a.problem.fractions:
                continue
            share = float((known.unknowns - a.unknowns) @ point.metric @ way) / length
            off = known.unknowns - a.unknowns - share * way
            aligned = float(known.tangent @ point.metric @ point.tangent)
            near = 1e-2 * length if aligned > 0.95 else min(1e-4 * length, 1e-8)
            if 0.0 < share <= 1.0 and abs(aligned) > 0.5 and off @ point.metric @ off < near:
                return number
        return None


def _at(a: Point, h: float, parameter: float) -> Point:
    """The point at a given parameter near an arclength from a."""
    guess = a.unknowns + h * a.tangent
    chain, error, iterations = newton(a.problem, guess[:-1].reshape(a.chain.x.shape), parameter)
    return _point(a.problem, chain, error, iterations, a.metric, a.tangent)


def _is_cut(point: Point) -> bool:
    """Whether a contact with memory is under way where a shot begins."""
    system, log = point.orbit.system, [solution.contacts for solution in point.chain.solutions]
    memory = [s for s, contact in enumerate(system.contacts) if latches(contact)]
    return any(np.any(np.isin(one.stop, memory) & ((one.t_in == 0.0) | np.isnan(one.t_out))) for one in log)


def _with_quiet_begin(point: Point) -> Point:
    """The same point, its shots begun later where a contact has come near one of their begins."""
    orbit, m = point.orbit, len(point.problem.fractions)
    log, period = orbit.contacts, orbit.period
    offsets = [(f - point.problem.fractions[0]) * period for f in point.problem.fractions]
    mine = np.isin(log.stop, [s for s, contact in enumerate(orbit.system.contacts) if latches(contact)])
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
        chain, error, iterations = newton(problem, x, point.chain.parameter)
    except OrbitError:
        return point
    return _point(problem, chain, error, iterations, point.metric, _carried(point, chain, begins))


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

    arms: list[_Arm]
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
        problem = Problem(_Twice(old.make), old.method, (0.5 * fraction, 0.5 * fraction + 0.5), old.step)
        values, vectors = np.linalg.eig(flip.monodromy)
        v = vectors[:, np.argmin(np.abs(values + 1.0))].real
        x = np.array([flip.state, flip.state])
        metric = _metric(problem, flip.parameter, x, arm.span[1] - arm.span[0])
        tangent = np.concatenate((v, -v, [0.0]))
        tangent /= math.sqrt(tangent @ metric @ tangent)
        chain = problem.evaluate(x, flip.parameter)
        orbit = orbit_of(problem, chain, flip.residual, 0, parameter=flip.parameter, mark="flip")
        return Branch([_Arm(Point(orbit, problem, chain, tangent, metric), arm.span, arm.largest)])


@dataclass(frozen=True)
class _Twice:
    """A family seen over two of its periods."""

    make: Callable[[float], tuple[System, float]]

    def __call__(self, parameter: float) -> tuple[System, float]:
        system, period = self.make(parameter)
        return system, 2.0 * period


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
    chain, error, iterations = newton(problem, x, parameter)
    metric = _metric(problem, parameter, chain.x, high - low)
    ahead = np.zeros(len(metric))
    ahead[-1] = 1.0
    point = _point(problem, chain, error, iterations, metric, ahead)
    back = replace(point, tangent=-point.tangent)
    return Branch(
        [_Arm(p, (low, high), step) for p, room in ((point, parameter < high), (back, parameter > low)) if room]
    )


def restored(
    make_system: Callable[[float], tuple[System, float]],
    span: tuple[float, float],
    arms: list[list[dict[str, Any]]],
    status: list[str],
    step: float,
    method: Any = None,
) -> Branch:
    """A branch from records (parameter, state, phase, mark, iterations) of its orbits per direction, to go on with."""
    return Branch(
        [
            _restored_arm(make_system, span, records, BranchStatus[name], step, method)
            for records, name in zip(arms, status, strict=True)
        ]
    )


def _restored_arm(
    make: Any, span: tuple[float, float], records: list[dict[str, Any]], status: BranchStatus, step: float, method: Any
) -> _Arm:
    """One direction; orbits are integrated once more, their states are not changed."""
    points: list[Point] = []
    system, period = make(records[0]["parameter"])
    method, width = checked(system, period, method, 1), span[1] - span[0]
    for record in records:
        _, period = make(record["parameter"])
        x = np.array([record["state"]])
        problem = Problem(make, method, (record["phase"] / period,), 1e-6 * width)
        chain, error, _ = newton(problem, x, record["parameter"])
        metric = points[0].metric if points else _metric(problem, record["parameter"], x, width)
        moved = np.append(x.ravel(), record["parameter"])
        if points:
            moved = moved - points[-1].unknowns
            moved[:-1] *= problem.fractions == points[-1].problem.fractions
        point = _point(problem, chain, error, record["iterations"], metric, moved)
        points.append(replace(point, orbit=replace(point.orbit, mark=record["mark"])))
    first = points[0]
    if len(points) > 1:  # the first tangent points to the second orbit
        ahead = first.tangent @ first.metric @ (points[1].unknowns - first.unknowns)
        first = replace(first, tangent=first.tangent * np.sign(ahead))
    arm = _Arm(first, span, step)
    arm.point, arm.orbits, arm.status = points[-1], [point.orbit for point in points], status
    return arm
