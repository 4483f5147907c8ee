"""Periodic orbits by shooting with the exact tangent of a run.

An orbit of period T solves Φ(x) = x, where Φ carries the state over one period. Newton's method on the chain

    r_i = Φ_i(x_i) - x_{i+1},   i = 0 ... m - 1,   x_m = x_0,

of m shots (one, or several where errors grow too fast within a period) converges quadratically, because
`solvers.exponential.tangent` differentiates the shots exactly. Floquet multipliers are the eigenvalues of the monodromy
matrix, the product of the shots' tangents.

A law that depends on the entry rate needs the past while in contact, so a shot may begin only while every such stop is
open: `Orbit.phase` is the time within the period to which `Orbit.state` belongs, zero wherever that is possible.

The numbers that laws with memory latch are part of the state x, so that a shot may begin at any time. A latched number
that is not renewed within the period makes 1 - Φ' singular: it is held constant, and the orbit is one of a family.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from solvers.exponential.method import Exponential
from solvers.orbits.newton import newton, weights
from solvers.orbits.open_times import closed, is_cut, latching_stops, open_starts
from solvers.orbits.periodic_orbit import Orbit, OrbitError, at_zero, orbit_of, with_doubts
from solvers.orbits.shots import Chain, PeriodicProblem, constant
from solvers.orbits.whole_state import counts, run, state_after, with_initial_memory
from solvers.problem import Array, System
from solvers.problem.matrices import reals
from solvers.problem.run_arguments import check_slopes, latched_at_start

_MOST_SHOTS = 6
_MOST_CHOICES = 4  # of the starting times of shots
_SETTLING = 2.0  # periods from a start without latched numbers, in which laws with memory latch them
_FRICTION = 20  # least periods of a run from rest with such laws, which may be the only damping
_LONGEST = 400  # most periods of a run from rest
_MOST_SETTLINGS = 4  # starts tried along a run from rest, a hundred periods apart
MORE_DAMPING = 0.03, 0.1, 0.3, 1.0  # μ, in turn, where none of these finds an orbit
_LEAST_STEP = 2e-3  # change of μ, in units of the first, down to which the orbit is followed


def orbit(
    system: System, period: float, start: ArrayLike | None = None, method: Any = None, shots: int | None = None
) -> Orbit:
    """Find the periodic motion Φ(x) = x of a system near a start; Φ carries the state over one period.

    Parameters
    ----------
    system : its loads must have the ``period``.
    period : s, > 0; a multiple of the loads' period for subharmonics.
    start : (2n,) [q, q̇] at t = 0; None: what a run from rest has settled to, or else an orbit with more damping,
        followed until the damping is the system's. With laws with memory also (2n + l,) with what is latched then, as
        `Orbit.whole` has it; without, they begin anew and latch over two periods.
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
        x = checked_start(system, start, period, method)
        return _near(constant(system, period, method), x, shots)
    try:
        return _from_rest(system, period, method, shots)
    except OrbitError as error:
        if not system.loads:
            raise
        refused = error
    try:
        return orbit_by_damping(system, period, method, shots)
    except OrbitError as error:
        raise OrbitError(f"{refused}; {error}") from None


def _from_rest(system: System, period: float, method: Any, shots: int | None) -> Orbit:
    """The orbit near what a run from rest has settled to, or near a later state of the run; raises OrbitError."""
    problem, x = constant(system, period, method), settled(system, period, method)
    for _ in range(_MOST_SETTLINGS - 1):
        try:
            return _near(problem, x, shots)
        except OrbitError:
            x = state_after(system, x, 100.0 * period, replace(method, rtol=max(method.rtol, 1e-8)))
    return _near(problem, x, shots)


def orbit_by_damping(
    system: System, period: float, method: Any, shots: int | None, tried: Callable[[], Any] = lambda: None
) -> Orbit:
    """An orbit of the system with more damping, C + μ (2π/T) M, followed to μ = 0; raises OrbitError.

    With it motion from rest that is chaotic, or decays slowly, settles within some periods. ``tried`` is called after
    each μ.
    """

    def damped(mu: float) -> System:
        return replace(system, C=system.C + mu * (2.0 * math.pi / period) * system.M)

    for mu in MORE_DAMPING:
        try:
            return _followed(damped, mu, _from_rest(damped(mu), period, method, shots), shots)
        except OrbitError:
            tried()
    raise OrbitError(f"nor with damping of up to {MORE_DAMPING[-1]:g} (2 pi/T) M more that is then taken away")


def _followed(damped: Callable[[float], System], mu: float, found: Orbit, shots: int | None) -> Orbit:
    """The orbit of damped(0) in the vicinity of those in between; raises OrbitError."""
    step, least = 0.5 * mu, _LEAST_STEP * mu
    while mu > 0.0:
        less = mu - step if step < mu else 0.0
        problem = constant(damped(less), found.period, found.method)
        try:
            found, mu, step = _near(problem, at_zero(found), shots), less, 2.0 * step
        except OrbitError:
            step *= 0.3
            if step < least:
                raise
    return found


def _near(problem: PeriodicProblem, x: Array, shots: int | None) -> Orbit:
    """The orbit of a constant family near a state, with as few shots as possible."""
    tried: list[str] = []
    for count in [shots] if shots else range(1, _MOST_SHOTS + 1):
        try:
            found, chain = solved_chain(problem, x, count)
            _check_isolated(found, chain)
            return with_doubts(_from_zero(orbit_of(found, chain)))
        except OrbitError as error:
            tried.append(f"{count} shot(s): {error}")
    hint = _round_and_unforced(problem.make(0.0)[0])
    raise OrbitError("no orbit found near the start; tried " + "; ".join(tried) + hint)


def _round_and_unforced(system: System) -> str:
    """A hint why a search in a circular clearance without any load may fail; else empty."""
    if system.loads or all(contact.map != "annulus" for contact in system.contacts):
        return ""
    return (
        "; without a load what whirls in a circular clearance repeats itself turned by an angle (relative periodic "
        "motion), so that no period brings it back: give it a load, or look at it in the turning frame"
    )


def _from_zero(orbit: Orbit) -> Orbit:
    """The orbit seen from t = 0 if no stop that latches is closed then."""
    x = at_zero(orbit)
    if orbit.phase == 0.0 or closed(orbit.system, x, latching_stops(orbit.system)):
        return orbit
    problem = constant(orbit.system, orbit.period, orbit.method)
    try:
        chain = newton(problem, x[None, :], 0.0)
    except OrbitError:
        return orbit
    return orbit_of(problem, replace(chain, iterations=orbit.iterations + chain.iterations))


def _check_isolated(problem: PeriodicProblem, chain: Chain) -> None:
    """Refuse an orbit whose neighbours are orbits, too, apart from those with other latched numbers."""
    from scipy.linalg import block_diag

    W, matrix = weights(*problem.make(chain.parameter)), chain.monodromy()
    if chain.coordinates < len(matrix):
        size = float(np.linalg.norm(chain.x[0, : chain.coordinates] @ W.T)) or 1.0  # at rest it has none
        W = block_diag(W, np.diag(size / problem.units(chain)))
        kept = np.delete(np.arange(len(matrix)), chain.frozen)
        W, matrix = W[np.ix_(kept, kept)], matrix[np.ix_(kept, kept)]
    away = W @ (matrix - np.eye(len(W))) @ np.linalg.inv(W)
    values = np.linalg.svd(away, compute_uv=False)
    if values[-1] <= 1e-12 * max(values[0], 1.0):
        raise OrbitError("the orbit is not isolated: the linearised return map has the eigenvalue 1 to rounding")


def checked(system: System, period: float, method: Any, shots: int | None) -> Any:
    """The method; the other arguments are checked too."""
    if not 0.0 < period < math.inf:
        raise ValueError(f"period must be positive and finite (s), got {period!r}")
    if shots is not None and not (isinstance(shots, (int, np.integer)) and 1 <= shots <= 100):
        raise ValueError(f"shots must be a whole number from 1 to 100, got {shots!r}")
    method = Exponential(1e-11) if method is None else method
    if not getattr(method, "has_tangent", False):
        raise ValueError(f"method must offer tangents, such as Exponential(), got {method!r}")
    check_slopes(system)
    if trouble := why_not_periodic(system, period):
        raise ValueError(trouble)
    return method


def why_not_periodic(system: System, period: float) -> str:
    """Which load does not have the period, in words; empty if all have it."""
    for load, (_, signal) in enumerate(system.loads):
        trouble = f"load {load} does not have the period {period:g} s"
        if not hasattr(signal, "tones"):
            probe = period * np.linspace(0.0, 1.0, 17)
            first, second = np.asarray(signal(probe)), np.asarray(signal(probe + period))
            if np.abs(first - second).max() > 1e-9 * np.abs(first).max():
                return trouble
            continue
        cycles = np.asarray(signal.tones()[0]) * period / (2.0 * math.pi)
        if np.abs(cycles - np.round(cycles)).max(initial=0.0) > 1e-9 * max(cycles.max(initial=0.0), 1.0):
            return f"{trouble}: it makes {cycles} cycles in it"
    return ""


def checked_start(system: System, start: ArrayLike, period: float, method: Any) -> Array:
    """A start of the right shape with latched numbers, which if not given come from a run of two periods."""
    x = reals(start, "start")
    n2 = 2 * system.size
    whole = n2 + sum(counts(system))
    if x.shape not in ((n2,), (whole,)) or not np.all(np.isfinite(x)):
        more = f", or {whole} with what is latched" if whole > n2 else ""
        raise ValueError(f"start must be {n2} finite numbers [q, q_dot]{more}, got {start!r}")
    if x.shape != (whole,):
        return state_after(system, with_initial_memory(system, x), _SETTLING * period, method)
    latched_at_start(system, np.split(x[n2:], np.cumsum(counts(system))[:-1]) if whole > n2 else None)
    return x


def settled(system: System, period: float, method: Any) -> Array:
    """State, with latched numbers, of a run from rest until the slowest block has decayed, at most 400 periods."""
    least = _FRICTION if any(counts(system)) else 1
    count = min(max(least, periods_of_decay(system, period)), _LONGEST)
    x = with_initial_memory(system, np.zeros(2 * system.size))
    return state_after(system, x, count * period, replace(method, rtol=max(method.rtol, 1e-8)))


def periods_of_decay(system: System, period: float) -> int:
    """Periods until the slowest of the decoupled blocks that are damped has decayed to e⁻⁷; 0 if none is damped."""
    rates = 0.5 * system.blocks.c[system.blocks.c > 0.0]
    return math.ceil(7.0 / (float(rates.min(initial=math.inf)) * period))


def solved_chain(problem: PeriodicProblem, x: Array, count: int) -> tuple[PeriodicProblem, Chain]:
    """The problem of a constant family with so many shots, and their chain for an orbit near a state.

    The orbit's contacts may lie elsewhere than the guess's. A shot that starts in a contact lacks its entry rate; if
    the law depends on it, the shots start anew in open intervals.
    """
    for _ in range(_MOST_CHOICES):
        problem, guess = _start_chain(problem, x, count)
        chain = newton(problem, guess, 0.0)
        if not is_cut(chain, problem.make(0.0)[0]):
            return problem, chain
        x = at_zero(orbit_of(problem, chain))
    raise OrbitError("wherever shots begin, a contact of the orbit whose law latches the entry rate is under way")


def _start_chain(problem: PeriodicProblem, x: Array, count: int) -> tuple[PeriodicProblem, Array]:
    """Shots that begin in open intervals, and a guess of their states from a run over one period."""
    (system, period), method = problem.make(0.0), problem.method
    first = run(system, x, period, method=method)
    passed = first.transitions.t if any(counts(system)) else None
    zero = not closed(system, x, range(len(system.contacts)))
    starts = open_starts(system, first.contacts, period, count, zero, passed)
    if not starts and not closed(system, x, latching_stops(system)):
        starts = [0.0]
    if len(starts) < count:
        raise OrbitError("at no time of the period are all stops open whose law latches the entry rate")
    states = [x if t == 0.0 else state_after(system, x, t, method) for t in starts]
    return replace(problem, fractions=tuple(t / period for t in starts)), np.array(states)
