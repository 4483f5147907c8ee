r"""Periodic orbits by shooting with the exact tangent of a run.

An orbit of period T solves Φ(x) = x, where Φ carries the state over one period. Newton's method on the chain

    r_i = Φ_i(x_i) - x_{i+1},   i = 0 ... m - 1,   x_m = x_0,

of m shots (one, or several where errors grow too fast within a period) converges quadratically, because
`solvers.tangent` differentiates the shots exactly. Floquet multipliers are the eigenvalues of the monodromy matrix, the
product of the shots' tangents.

A law that latches its entry rate remembers the past while in contact, so a shot may begin only while every such stop is
open: `Orbit.phase` is the time within the period to which `Orbit.state` belongs, zero wherever that is possible.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from solvers.exponential import Exponential
from solvers.integration import check_slopes, integrate
from solvers.result import ContactLog, Solution, SolverError
from solvers.system import Array, Contact, Parameter, System

TOLERANCE = 1e-10  # of the residual, in units of the orbit's size
_MOST_ITERATIONS = 25
_MOST_HALVINGS = 6
_MOST_SHOTS = 6
_MOST_SETTLINGS = 4  # starts taken from a run from rest, a hundred periods apart
_NEAR_ONE = 0.01  # | |μ| - 1 | below which a verdict on stability is doubtful


class OrbitError(SolverError):
    """No orbit was found; the message says what was tried, ``solution`` is the last attempt."""


@dataclass(frozen=True, eq=False)
class Orbit:
    """A periodic motion.

    Attributes
    ----------
    state : (2n,) [q, q̇] at time ``phase`` within the period.
    period : s. phase : s, 0 unless a stop whose law latches its entry rate is closed then.
    monodromy : (2n, 2n) derivative of the state one period later. multipliers : its eigenvalues, largest first.
    residual : size of Φ(x) - x relative to the orbit's. iterations : of Newton's method.
    contacts : log of one period, times counted from ``phase``.
    doubt : why the verdict on stability may be wrong; empty when nothing speaks against it.
    parameter : value of the branch's parameter, NaN outside a branch.
    mark : "fold", "flip", "neimark-sacker", "branch point" or "grazing" at special points of a branch, else empty.
    """

    state: Array
    period: float
    phase: float
    monodromy: Array
    residual: float
    iterations: int
    contacts: ContactLog
    system: System
    method: Any
    doubt: str = ""
    parameter: float = math.nan
    mark: str = ""

    @property
    def multipliers(self) -> Any:
        """Floquet multipliers (2n,), largest first."""
        values = np.linalg.eigvals(self.monodromy)
        return values[np.argsort(-np.abs(values), kind="stable")]

    @property
    def stable(self) -> bool:
        """Whether every multiplier lies within the unit circle."""
        return bool(np.abs(self.multipliers[0]) < 1.0)

    def samples(self, count: int = 400) -> Solution:
        """One period from ``phase`` on at ``count`` + 1 times, times counted from ``phase``."""
        n, x = self.system.size, self.state
        later = delayed(self.system, self.phase)
        method = replace(self.method, ledger=False) if isinstance(self.method, Exponential) else self.method
        return integrate(later, x[:n], x[n:], self.period, self.period / count, method)


class _Delayed:
    """A signal seen ``delay`` seconds later."""

    def __init__(self, signal: Any, delay: float) -> None:
        self.signal, self.delay = signal, delay
        if hasattr(signal, "tones"):
            self.tones = self._tones

    def __call__(self, t: Any) -> Any:
        return self.signal(np.asarray(t) + self.delay)

    def _tones(self) -> tuple[Array, Any]:
        omega, amplitude = self.signal.tones()
        return omega, np.asarray(amplitude) * np.exp(1j * np.asarray(omega) * self.delay)


def delayed(system: System, delay: float) -> System:
    """The system as it is ``delay`` seconds later: all its loads move on."""
    if delay == 0.0 or not system.loads:
        return system
    return system.like(loads=[(vector, _Delayed(signal, delay)) for vector, signal in system.loads])


@dataclass(frozen=True, eq=False)
class Problem:
    """A family of periodic problems: the system and its period for each value of a parameter.

    ``fractions`` (m,) are the shots' begins in units of the period, ascending; ``step`` is the parameter's difference.
    """

    make: Callable[[float], tuple[System, float]]
    method: Any
    fractions: tuple[float, ...] = (0.0,)
    step: float = 0.0

    def shots(self, parameter: float) -> list[tuple[System, float]]:
        """(system from the shot's begin on, duration) of every shot."""
        system, period = self.make(parameter)
        ends = (*self.fractions[1:], self.fractions[0] + 1.0)
        return [(delayed(system, a * period), (b - a) * period) for a, b in zip(self.fractions, ends, strict=True)]

    def evaluate(self, x: Array, parameter: float) -> Chain:
        """Fire all shots from x (m, 2n)."""
        here = self.shots(parameter)
        n, h, m = here[0][0].size, self.step, len(here)
        sides = [self.shots(parameter + s * h) for s in (-1.0, 1.0)] if h else []
        residual, tangents, by_parameter, solutions = np.empty((m, 2 * n)), [], np.zeros((m, 2 * n)), []
        for i, (system, duration) in enumerate(here):
            tangent: Any = Parameter(sides[0][i][0], sides[1][i][0], h) if h else True
            solution = integrate(system, x[i, :n], x[i, n:], duration, method=self.method, tangent=tangent)
            assert solution.tangent is not None
            assert solution.rate is not None
            residual[i] = np.concatenate((solution.q[-1], solution.q_dot[-1])) - x[(i + 1) % m]
            tangents.append(solution.tangent[:, : 2 * n])
            if h:
                stretch = (sides[1][i][1] - sides[0][i][1]) / (2.0 * h)
                by_parameter[i] = solution.tangent[:, -1] + solution.rate * stretch
            solutions.append(solution)
        return Chain(x, parameter, residual, np.array(tangents), by_parameter, solutions)


@dataclass(frozen=True, eq=False)
class Chain:
    """What the shots from x (m, 2n) gave: residuals (m, 2n), their derivatives (m, 2n, 2n) and by the parameter."""

    x: Array
    parameter: float
    residual: Array
    tangents: Array
    by_parameter: Array
    solutions: list[Solution]

    def jacobian(self) -> Array:
        """Derivative (m 2n, m 2n) of the residuals by all states."""
        m, size = self.residual.shape
        matrix = np.zeros((m, size, m, size))
        for i in range(m):
            matrix[i, :, i, :] += self.tangents[i]
            matrix[i, :, (i + 1) % m, :] -= np.eye(size)
        return matrix.reshape(m * size, m * size)

    def monodromy(self) -> Array:
        """Product of the shots' tangents."""
        product = np.eye(self.residual.shape[1])
        for tangent in self.tangents:
            product = tangent @ product
        return product


def weights(system: System, period: float) -> Array:
    """(2n, 2n) matrix whose product with a state has the square root of an energy per mode as entries.

    Positions count with √(k + (2π/T)²), so that floating coordinates have a size too.
    """
    blocks = system.blocks
    scale = np.sqrt(blocks.k + (2.0 * math.pi / period) ** 2)
    matrix: Array = np.concatenate((scale, np.ones_like(scale)))[:, None] * blocks.inverse
    return matrix


@dataclass(frozen=True, eq=False)
class Border:
    """The arclength condition: scaled by ``metric``, unknowns move only at right angles to ``tangent`` from the guess.

    Both are over [states (m 2n), parameter].
    """

    metric: Array
    tangent: Array

    def row(self) -> Array:
        """The condition's derivative."""
        return self.metric @ self.tangent


def newton(problem: Problem, x: Array, parameter: float, border: Border | None = None) -> tuple[Chain, float, int]:
    """Solve the chain from a first guess (m, 2n); returns it with its relative residual and the iterations.

    With a border the parameter is an unknown too. Raises OrbitError.
    """
    unknowns = guess = np.append(x.ravel(), parameter)
    measure = _Measure(problem)
    chain, error = _fire(problem, unknowns, measure)
    history = [error]
    for iteration in range(_MOST_ITERATIONS):
        if error <= TOLERANCE:
            return chain, error, iteration
        step = _step(chain, unknowns - guess, border)
        for halving in range(_MOST_HALVINGS):
            trial, trial_error = _fire(problem, unknowns + 0.5**halving * step, measure)
            if trial_error < error:
                break
        else:
            break
        unknowns, chain, error = unknowns + 0.5**halving * step, trial, trial_error
        history.append(error)
    if error <= TOLERANCE:
        return chain, error, len(history) - 1
    raise OrbitError(
        f"{len(history)} iterations of Newton's method reduced the residual from {history[0]:.3g} to {error:.3g} of "
        "the motion's size"
    )


class _Measure:
    """Size of a residual relative to the motion's.

    What counts as the motion's size lies between 1e-4 and 1e3 of the first guess's, so that neither running off to
    infinity nor vanishing passes for convergence or its failure.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem, self.first = problem, 0.0

    def __call__(self, chain: Chain) -> float:
        """Relative residual."""
        W = weights(*self.problem.make(chain.parameter))
        size, ends, residual = (
            float(np.linalg.norm(part @ W.T, axis=1).max())
            for part in (chain.x, chain.x + np.roll(chain.residual, 1, axis=0), chain.residual)
        )
        self.first = self.first or max(size, ends)
        return residual / max(min(size, 1e3 * self.first), 1e-4 * self.first, 1e-300)


def _fire(problem: Problem, unknowns: Array, measure: _Measure) -> tuple[Any, float]:
    """The chain at given unknowns and its relative residual, inf where it cannot be integrated."""
    try:
        chain = problem.evaluate(unknowns[:-1].reshape(len(problem.fractions), -1), float(unknowns[-1]))
        error = measure(chain)
    except (SolverError, ValueError, ArithmeticError):
        return None, math.inf
    return chain, error if math.isfinite(error) else math.inf


def _step(chain: Chain | None, moved: Array, border: Border | None) -> Array:
    """Newton's step of all unknowns."""
    if chain is None:
        raise OrbitError("the motion from the start cannot be integrated over one period")
    matrix: Any = chain.jacobian()
    right = -chain.residual.ravel()
    try:
        if border is None:
            return np.append(np.linalg.solve(matrix, right), 0.0)
        row = border.row()
        matrix = np.block([[matrix, chain.by_parameter.reshape(-1, 1)], [row[None, :]]])
        return np.linalg.solve(matrix, np.append(right, -row @ moved))
    except np.linalg.LinAlgError:
        raise OrbitError("the orbit is not isolated: the linearised return map has the eigenvalue 1") from None


def orbit(
    system: System,
    period: float,
    start: ArrayLike | None = None,
    method: Any = None,
    shots: int | None = None,
) -> Orbit:
    """Find the periodic motion of a system near a start.

    Parameters
    ----------
    system : its loads must have the ``period``.
    period : s, > 0; a multiple of the loads' period for subharmonics.
    start : (2n,) [q, q̇] at t = 0; None: what a run from rest has settled to.
    method : an `Exponential`; None takes one with rtol 1e-11.
    shots : per period; None: one, then more if one fails.

    Returns
    -------
    Orbit, with a verdict on its stability checked at a tighter tolerance.

    Raises
    ------
    ValueError for bad input before computing; OrbitError when no orbit is found near the start, with what was tried.

    Examples
    --------
    >>> found = orbit(System.modal(omega=[2.0], zeta=[0.1]), period=3.0)
    >>> bool(np.all(found.state == 0.0)), found.stable
    (True, True)
    """
    method = checked(system, period, method, shots)
    if start is not None:
        return _near(system, period, checked_start(system, start), method, shots)
    x = settled(system, period, method)
    for _ in range(_MOST_SETTLINGS - 1):
        try:
            return _near(system, period, x, method, shots)
        except OrbitError:
            x = flown(system, x, 100.0 * period, replace(method, rtol=max(method.rtol, 1e-8)))
    return _near(system, period, x, method, shots)


def _near(system: System, period: float, x: Array, method: Any, shots: int | None) -> Orbit:
    """The orbit near a state, with as few shots as will do."""
    tried: list[str] = []
    for count in [shots] if shots else range(1, _MOST_SHOTS + 1):
        try:
            problem, guess = start_chain(system, period, x, method, count)
            chain, residual, iterations = newton(problem, guess, 0.0)
            _check_isolated(chain, weights(system, period))
            return judged(_from_zero(orbit_of(problem, chain, residual, iterations)))
        except OrbitError as error:
            tried.append(f"{count} shot(s): {error}")
    raise OrbitError("no orbit found near the start; tried " + "; ".join(tried))


def _from_zero(orbit: Orbit) -> Orbit:
    """The orbit seen from t = 0 if no stop that latches is closed then."""
    x = at_zero(orbit)
    if orbit.phase == 0.0 or _closed(orbit.system, x, [c for c in orbit.system.contacts if latches(c)]):
        return orbit
    problem = Problem(_Constant(orbit.system, orbit.period), orbit.method)
    try:
        chain, residual, iterations = newton(problem, x[None, :], 0.0)
    except OrbitError:
        return orbit
    return orbit_of(problem, chain, residual, orbit.iterations + iterations)


def _check_isolated(chain: Chain, W: Array) -> None:
    """An orbit whose neighbours are orbits too, or that only rounding holds, is none."""
    away = W @ (chain.monodromy() - np.eye(len(W))) @ np.linalg.inv(W)
    values = np.linalg.svd(away, compute_uv=False)
    if values[-1] <= 1e-12 * max(values[0], 1.0):
        raise OrbitError("the orbit is not isolated: the linearised return map has the eigenvalue 1 to rounding")


def checked(system: System, period: float, method: Any, shots: int | None) -> Any:
    """The method, after a look at everything else."""
    if not 0.0 < period < math.inf:
        raise ValueError(f"period must be positive and finite (s), got {period!r}")
    if shots is not None and not (isinstance(shots, int) and 1 <= shots <= 100):
        raise ValueError(f"shots must be a whole number from 1 to 100, got {shots!r}")
    method = Exponential(1e-11) if method is None else method
    if not getattr(method, "has_tangent", False):
        raise ValueError(f"method must offer tangents, such as Exponential(), got {method!r}")
    check_slopes(system)
    for load, (_, signal) in enumerate(system.loads):
        if not hasattr(signal, "tones"):
            probe = period * np.linspace(0.0, 1.0, 17)
            first, second = np.asarray(signal(probe)), np.asarray(signal(probe + period))
            if np.abs(first - second).max() > 1e-9 * np.abs(first).max():
                raise ValueError(f"load {load} does not have the period {period:g} s")
            continue
        cycles = np.asarray(signal.tones()[0]) * period / (2.0 * math.pi)
        if np.abs(cycles - np.round(cycles)).max(initial=0.0) > 1e-9 * max(cycles.max(initial=0.0), 1.0):
            raise ValueError(f"load {load} does not have the period {period:g} s: it makes {cycles} cycles in it")
    return method


def checked_start(system: System, start: ArrayLike) -> Array:
    """A start of the right shape."""
    x = np.array(start, dtype=float)
    if x.shape != (2 * system.size,) or not np.all(np.isfinite(x)):
        raise ValueError(f"start must be {2 * system.size} finite numbers [q, q_dot], got {start!r}")
    return x


def settled(system: System, period: float, method: Any, longest: int = 400) -> Array:
    """State to which a run from rest has settled: until the slowest block has decayed, at most ``longest`` periods."""
    blocks = system.blocks
    slowest = float((0.5 * blocks.c)[blocks.c > 0.0].min(initial=math.inf))
    count = min(max(1, math.ceil(7.0 / (slowest * period))), longest)
    return flown(system, np.zeros(2 * system.size), count * period, replace(method, rtol=max(method.rtol, 1e-8)))


def latches(contact: Contact) -> bool:
    """Whether a law's force depends on the rate at which the contact was entered."""
    delta, rate = np.array([1e-6, 1e-4, 1e-2]), 0.1
    return bool(np.any(contact.law.force(delta, rate, 0.1) != contact.law.force(delta, rate, 0.2)))


def quiet_intervals(system: System, contacts: ContactLog, period: float) -> list[tuple[float, float]]:
    """Intervals of one period in which every stop is open; if there are none, every one that latches its entry rate."""
    ends = np.where(np.isnan(contacts.t_out), period, contacts.t_out)
    for stops in (range(len(system.contacts)), [s for s, c in enumerate(system.contacts) if latches(c)]):
        mine = np.isin(contacts.stop, list(stops))
        quiet, end = [], 0.0
        for begin, left in [*sorted(zip(contacts.t_in[mine], ends[mine], strict=True)), (period, period)]:
            if begin > end:
                quiet.append((float(end), float(begin)))
            end = max(end, left)
        if quiet:
            return quiet
    return []


def quiet_begins(system: System, contacts: ContactLog, period: float, count: int, zero: bool) -> list[float]:
    """Times for the begins of ``count`` shots: zero if that will do, then the middles of the longest quiet intervals.

    Fewer when there is no quiet time at all.
    """
    quiet = quiet_intervals(system, contacts, period)
    begins = [0.0] if zero else []
    while quiet and len(begins) < count:
        a, b = quiet.pop(max(range(len(quiet)), key=lambda i: quiet[i][1] - quiet[i][0]))
        begins.append(0.5 * (a + b))
        quiet += [(a, begins[-1]), (begins[-1], b)]
    return sorted(begins)


def _closed(system: System, x: Array, contacts: Sequence[Contact]) -> bool:
    """Whether any of these contacts is closed in a state."""
    return any(contact.direction @ x[: system.size] + contact.gap < 0.0 for contact in contacts)


def start_chain(system: System, period: float, x: Array, method: Any, count: int) -> tuple[Problem, Array]:
    """Shots that begin in quiet times, and a guess of their states from a run over one period."""
    n = system.size
    first = integrate(system, x[:n], x[n:], period, method=method)
    begins = quiet_begins(system, first.contacts, period, count, not _closed(system, x, system.contacts))
    if not begins and not _closed(system, x, [c for c in system.contacts if latches(c)]):
        begins = [0.0]
    if len(begins) < count:
        raise OrbitError("at no time of the period are all stops open whose law latches the entry rate")
    states = [x if t == 0.0 else flown(system, x, t, method) for t in begins]
    return Problem(_Constant(system, period), method, tuple(t / period for t in begins)), np.array(states)


def at_zero(orbit: Orbit) -> Array:
    """State of an orbit at t = 0."""
    if orbit.phase == 0.0:
        return orbit.state
    return flown(delayed(orbit.system, orbit.phase), orbit.state, orbit.period - orbit.phase, orbit.method)


def flown(system: System, x: Array, duration: float, method: Any) -> Array:
    """State after a duration."""
    n = system.size
    end = integrate(system, x[:n], x[n:], duration, method=method)
    state: Array = np.concatenate((end.q[-1], end.q_dot[-1]))
    return state


@dataclass(frozen=True)
class _Constant:
    """A family of one member."""

    system: System
    period: float

    def __call__(self, parameter: float) -> tuple[System, float]:
        return self.system, self.period


def orbit_of(problem: Problem, chain: Chain, residual: float, iterations: int, **more: Any) -> Orbit:
    """The orbit a solved chain describes."""
    system, period = problem.make(chain.parameter)
    phase = problem.fractions[0] * period
    logs = [solution.contacts for solution in chain.solutions]
    begins = [fraction * period - phase for fraction in problem.fractions]
    return Orbit(
        *(chain.x[0].copy(), period, phase, chain.monodromy(), residual, iterations),
        *(ContactLog.of_period(logs, begins, period), system, problem.method),
        **more,
    )


def judged(orbit: Orbit) -> Orbit:
    """The orbit with what speaks against its verdict on stability, after a look at a tighter tolerance."""
    n, x = orbit.system.size, orbit.state
    tight = replace(orbit.method, rtol=max(0.03 * orbit.method.rtol, 1e-12))
    later = delayed(orbit.system, orbit.phase)
    again: Any = integrate(later, x[:n], x[n:], orbit.period, method=tight, tangent=True).tangent
    doubts = list(_doubts(orbit))
    largest, second = (np.abs(np.linalg.eigvals(matrix)).max() for matrix in (orbit.monodromy, again))
    if (largest < 1.0) != (second < 1.0):
        doubts.append(f"a tighter tolerance gives |μ| = {second:.6g} instead of {largest:.6g}")
    return replace(orbit, doubt="; ".join(doubts))


def _doubts(orbit: Orbit) -> Iterator[str]:
    """What speaks against the verdict at first sight."""
    largest = abs(orbit.multipliers[0])
    if abs(largest - 1.0) < _NEAR_ONE:
        yield f"|μ| = {largest:.6g} is within {_NEAR_ONE:g} of one"
    log = orbit.contacts
    if len(log) and log.speed_in.min() < 0.01 * log.speed_in.max():
        slowest = log.speed_in.argmin()
        yield f"the contact at {log.t_in[slowest]:.6g} s grazes: it is entered at {log.speed_in[slowest]:.3g} m/s"
    elif np.any(log.floored):
        yield "an entry rate lies below its law's floor"
