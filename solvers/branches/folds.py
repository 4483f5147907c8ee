"""The curve of folds of a periodic motion over two parameters.

    Φ(x; λ, p) - x = 0,    g(x; λ, p) = 0,    [J b; cᵀ 0] [v; g] = [0; 1],    J = ∂Φ/∂x - 1

At a fold J is singular: one multiplier is 1, and the branch along λ turns back. g vanishes with the determinant of J
and is as smooth as J; with w of the transposed system, ∂g = -wᵀ ∂J v = -wᵀ ∂_v [J, Φ_λ, Φ_p], which two tangents of
runs either side of x along v give. The curve is followed by its arc length, so that p may turn: two folds meet there in
a cusp. See Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria, 2000, chapters 3 and 4.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from solvers.branches.point import NO_ORBIT, metric_of
from solvers.orbits import Chain, Orbit, OrbitError, PeriodicProblem, is_cut, orbit_of
from solvers.problem import Array, System

Make = Callable[[float, float], tuple[System, float]]
ALONG = 1e-4  # distance, in units of the motion, of the runs that give the derivative of g
CLOSED, SINGULAR = 1e-10, 1e-8  # largest residual, relative to the motion, and |g| that count as zero
MOST, STRAIGHT = 8, 0.8  # most iterations for a point, and least cosine between two tangents
LONGEST, SHORTEST = 0.2, 1e-4  # steps along the curve, in units of both spans and of the motion
SHARP = 1e-9  # arc length to which a cusp is located
SAME = 1e-6  # distance from its first point at which a curve has come back to it
ROUND = "closed: came back to its first fold"
POINTS = 400  # at most, in one direction
Record = dict[str, Any]


@dataclass(frozen=True, eq=False)
class FoldCurve:
    """Folds over two parameters, from one end of the curve to the other.

    Attributes
    ----------
    orbits : the motions at the folds; `Orbit.parameter` is the first parameter, ``mark`` "fold", or "cusp" where two
        folds meet and the second parameter turns. values : (k,) of the second. endings : of both directions, in words;
        a closed curve begins and ends at the fold it was followed from.
    """

    orbits: list[Orbit]
    values: Array
    endings: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Point:
    """A fold: unknowns [states, λ, p] in units of the motion and of both spans, unit tangent, null vectors of J."""

    y: Array
    chain: Chain
    problem: PeriodicProblem
    tangent: Array
    borders: tuple[Array, Array]


@dataclass(eq=False)
class _Equations:
    """Both equations of a fold and their derivatives."""

    make: Make
    method: Any
    fractions: tuple[float, ...]
    widths: tuple[float, float]
    known: list[Record] = field(default_factory=list)
    keep: Callable[[Record], Any] = lambda record: None
    shape: tuple[int, ...] = ()
    last: tuple[Any, tuple[PeriodicProblem, PeriodicProblem]] | None = None
    lift: Array = field(default_factory=lambda: np.eye(0))  # states -> units of the motion
    back: Array = field(default_factory=lambda: np.eye(0))

    def measured_by(self, x: Array, at: tuple[float, float]) -> Array:
        """Take the motion x (m, N) as the unit of length; returns its unknowns."""
        problem = self._problems(*at)[0]
        metric = metric_of(problem, problem.evaluate(x, at[0], False), self.widths[0])[:-1, :-1]
        self.shape, self.lift = x.shape, np.asarray(np.linalg.cholesky(metric).T, dtype=float)
        self.back = np.asarray(np.linalg.inv(self.lift), dtype=float)
        return np.concatenate((self.lift @ x.ravel(), np.array(at) / self.widths))

    def _problems(self, first: float, second: float) -> tuple[PeriodicProblem, PeriodicProblem]:
        """Periodic problems along each parameter; the last ones are kept, with their systems."""
        if self.last is None or self.last[0] != (first, second):
            options = {"method": self.method, "fractions": self.fractions}
            along = PeriodicProblem(lambda value: self.make(value, second), step=1e-6 * self.widths[0], **options)
            across = PeriodicProblem(lambda value: self.make(first, value), step=1e-6 * self.widths[1], **options)
            self.last = (first, second), (along, across)
        return self.last[1]

    def at(self, y: Array) -> tuple[Chain, PeriodicProblem, Array, Array]:
        """(chain of the period, problem, residual (k,), its derivative (k, k + 2))."""
        first, second = (float(value) for value in y[-2:] * self.widths)
        x = (self.back @ y[:-2]).reshape(self.shape)
        along, across = self._problems(first, second)
        chain = along.evaluate(x, first)
        if is_cut(chain, along.system(first)):
            raise OrbitError("a contact whose law knows its entry rate is under way where a period begins")
        ways = [chain.by_parameter, across.evaluate(x, second).by_parameter]
        columns = [self.lift @ (width * way.ravel()) for width, way in zip(self.widths, ways, strict=True)]
        jacobian = np.column_stack((self.lift @ chain.jacobian() @ self.back, *columns))
        return chain, along, self.lift @ chain.residual.ravel(), jacobian

    def singular(self, y: Array, jacobian: Array, borders: tuple[Array, Array]) -> tuple[float, Array, Any]:
        """g, its derivative (k + 2,), and (w, v) as unit vectors."""
        size = len(jacobian)
        bordered = np.block([[jacobian[:, :size], borders[0][:, None]], [borders[1][None], np.zeros((1, 1))]])
        unit = np.append(np.zeros(size), 1.0)
        v, w = np.linalg.solve(bordered, unit), np.linalg.solve(bordered.T, unit)
        step = ALONG / np.linalg.norm(v[:size]) * np.append(v[:size], (0.0, 0.0))
        ahead, behind = (self.at(y + sign * step)[3] for sign in (1.0, -1.0))
        change = -w[:size] @ (ahead - behind) * np.linalg.norm(v[:size]) / (2.0 * ALONG)
        return float(v[-1]), change, (_unit(w[:size]), _unit(v[:size]))

    def solved(self, guess: Array, row: Array, borders: tuple[Array, Array], along: Array) -> _Point:
        """The fold near a guess, on the plane through it at right angles to ``row``; raises OrbitError.

        The same calls have had the answers that are known, in the same order.
        """
        if self.known:
            return self._again(self.known.pop(0))
        none = {"y": np.nan * guess, "tangent": np.nan * guess, "borders": np.nan * np.array(borders)}
        try:
            one = self._searched(guess, row, borders, along)
        except NO_ORBIT as error:
            self.keep(none | {"refused": np.array(str(error))})
            raise
        self.keep({name: np.array(getattr(one, name)) for name in none} | {"refused": np.array("")})
        return one

    def _again(self, record: Record) -> _Point:
        """An answer that is known: its period is integrated again, which gives the same bits."""
        if refused := str(record["refused"]):
            raise OrbitError(refused)
        chain, problem, *_ = self.at(record["y"])
        return _Point(record["y"], chain, problem, record["tangent"], tuple(record["borders"]))

    def _searched(self, guess: Array, row: Array, borders: tuple[Array, Array], along: Array) -> _Point:
        """By Newton's method."""
        y = guess
        for _ in range(MOST):
            chain, problem, residual, jacobian = self.at(y)
            g, change, borders = self.singular(y, jacobian, borders)
            matrix = np.vstack((jacobian, change, row))
            if np.abs(residual).max() <= CLOSED and abs(g) <= SINGULAR:
                matrix[-1] = along
                tangent = np.linalg.solve(matrix, np.append(np.zeros(len(y) - 1), 1.0))
                return _Point(y, chain, problem, _unit(tangent), borders)
            missed = np.concatenate((residual, [g, float(row @ (y - guess))]))
            y = y - np.linalg.solve(matrix, missed)
        raise OrbitError(f"a fold was not found: residual {np.abs(residual).max():.3g}, |g| = {abs(g):.3g}")


def fold_curve(
    make: Make,
    fold: Orbit,
    second: float,
    span: tuple[float, float],
    width: float,
    step: float = LONGEST,
    seen: Callable[[], Any] = lambda: None,
    known: Sequence[Record] = (),
    keep: Callable[[Record], Any] = lambda record: None,
) -> FoldCurve:
    """Follow a fold of a branch along a second parameter, both ways.

    Parameters
    ----------
    make : (first, second parameter) -> (system, period in s).
    fold : marked "fold", of a branch along the first parameter.
    second : value of the second parameter there, within span, its (lowest, highest) value.
    width : of the first parameter, to measure the curve with, such as the span of the branch.
    step : largest one, in units of both widths and of the motion.
    seen : called after each point.
    keep : called with each answer to an equation on the way, arrays of the same shapes. known : those of an earlier
        call in their order, from which the curve goes on to the same bits.

    Returns
    -------
    FoldCurve : orbits to 1e-10, a multiplier 1 to some 1e-8.

    Raises
    ------
    ValueError : bad input. OrbitError : there is no fold.

    Examples
    --------
    Duffing's oscillator q̈ + 2ζ q̇ + q + q³ = f cos ωt.

    >>> from dataclasses import dataclass
    >>> from contacts import Polynomial
    >>> from solvers import Contact, branch
    >>> @dataclass
    ... class Tone:
    ...     omega: float
    ...     size: float
    ...     def __call__(self, t):
    ...         return self.size * np.cos(self.omega * t)
    ...     def tones(self):
    ...         return np.array([self.omega]), np.array([self.size + 0j])
    >>> spring = Contact([1.0], Polynomial([0.0, 0.0, 1.0]), always=True)
    >>> def make(omega, f):
    ...     return System.modal([1.0], [0.05], [spring], [([1.0], Tone(omega, f))]), 2.0 * np.pi / omega
    >>> folds = branch(lambda omega: make(omega, 0.2), (1.1, 1.6), [0.0, 0.0]).run().special
    >>> curve = fold_curve(make, folds[0], 0.2, (0.15, 0.2), 0.5)
    >>> {one.mark for one in curve.orbits}
    {'fold'}
    """
    low, high = span
    if fold.mark != "fold":
        raise ValueError(f"folds are followed from an orbit marked 'fold', got one marked {fold.mark!r}")
    if not low <= second <= high or not low < high:
        raise ValueError(f"span must be two values, ascending, about the present one, {second!r}, got {span!r}")
    fraction = fold.phase / fold.period
    equations = _Equations(make, fold.method, (fraction,), (width, high - low), list(known), keep)
    y = equations.measured_by(fold.whole[None], (fold.parameter, second))
    u, _, v = np.linalg.svd(equations.at(y)[3][:, :-2])
    up = np.append(np.zeros(len(y) - 1), 1.0)
    first = equations.solved(y, up, (u[:, -1], v[-1]), up)
    ahead, end = _walk(equations, first, span, step, seen)
    back = replace(first, tangent=-first.tangent)
    behind, begin = ([], end) if end == ROUND else _walk(equations, back, span, step, seen)
    found = [*reversed(behind), (first, "fold"), *ahead]
    orbits = [
        orbit_of(one.problem, replace(one.chain, error=float(np.abs(one.chain.residual).max())), mark)
        for one, mark in found
    ]
    return FoldCurve(orbits, np.array([one.y[-1] * (high - low) for one, _ in found]), (begin, end))


def _walk(
    equations: _Equations, point: _Point, span: tuple[float, float], most: float, seen: Callable[[], Any]
) -> tuple[list[tuple[_Point, str]], str]:
    """Points in one direction with their marks, and how the curve ended."""
    points: list[tuple[_Point, str]] = []
    ends, step = np.array(span) / equations.widths[1], 0.2 * most
    if np.any(np.isclose(point.y[-1], ends, rtol=1e-12, atol=0.0) & (np.array([-1.0, 1.0]) * point.tangent[-1] > 0.0)):
        return points, "reached the end of the span"  # it begins there
    first = point
    while len(points) < POINTS:
        longest = _longest(first, point, most)
        try:
            new = _moved(equations, point, min(step, longest), ends)
            back = _is_back(equations, first, point, new)
            new = first if back else new
            turned = float(new.tangent @ point.tangent)
            if turned < STRAIGHT:
                raise OrbitError("the curve turns too fast")
            if new.tangent[-1] * point.tangent[-1] < 0.0:
                points.append((_cusp(equations, point, new), "cusp"))
        except NO_ORBIT as error:
            step = 0.5 * min(step, longest)
            if step < SHORTEST * most:
                return points, f"stopped at {point.y[-1] * equations.widths[1]:.6g}: {error}"
            continue
        points.append((new, "fold"))
        seen()
        if back or new.y[-1] in ends:
            return points, ROUND if back else "reached the end of the span"
        step = 1.5 * min(step, longest) if turned > 0.5 * (1.0 + STRAIGHT) else step
        point = new
    return points, f"{POINTS} points were not enough"


def _longest(first: _Point, point: _Point, most: float) -> float:
    """The longest step: ``most`` in units of the motion and of the way along λ so far, where these are larger."""
    size = max(1.0, float(np.linalg.norm(point.y[:-2])))
    far = max(1.0, abs(float(point.y[-2] - first.y[-2])))
    along = float(np.linalg.norm(point.tangent[:-2]))
    return most / math.hypot(along / size, point.tangent[-2] / far, point.tangent[-1])


def _is_back(equations: _Equations, first: _Point, a: _Point, b: _Point) -> bool:
    """Whether the curve passes its first point between two others: the plane there, at right angles to it."""
    before, behind = (float(first.tangent @ (one.y - first.y)) for one in (a, b))
    if not (before < 0.0 <= behind and np.linalg.norm(b.y - first.y) < 2.0 * np.linalg.norm(b.y - a.y)):
        return False
    guess = a.y + before / (before - behind) * (b.y - a.y)
    met = equations.solved(guess, first.tangent, a.borders, first.tangent)
    return float(np.linalg.norm(met.y - first.y)) < SAME


def _moved(equations: _Equations, point: _Point, step: float, ends: Array) -> _Point:
    """The fold a step further, or at the end of the span of p if that is nearer."""
    guess = point.y + step * point.tangent
    for end, outside in zip(ends, (guess[-1] < ends[0], guess[-1] > ends[1]), strict=True):
        if outside:
            guess = point.y + (end - point.y[-1]) / point.tangent[-1] * point.tangent
            guess[-1] = end
            return equations.solved(guess, np.append(np.zeros(len(guess) - 1), 1.0), point.borders, point.tangent)
    return equations.solved(guess, point.tangent, point.borders, point.tangent)


def _cusp(equations: _Equations, a: _Point, b: _Point) -> _Point:
    """The point between two others at which p turns."""
    from scipy.optimize import brentq  # here: every run would take 0.06 s to load it

    known: dict[float, _Point] = {}

    def pace(s: float) -> float:
        known[s] = equations.solved(a.y + s * a.tangent, a.tangent, a.borders, a.tangent)
        return float(known[s].tangent[-1])

    length = float(a.tangent @ (b.y - a.y))
    return known[brentq(pace, 0.0, length, xtol=SHARP)] if math.isfinite(length) else b


def _unit(vector: Array) -> Array:
    """In the Euclidean norm."""
    return vector / np.linalg.norm(vector)
