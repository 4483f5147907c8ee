"""Periodic motions of a model: found by shooting, or all that a set of starts settles to.

The load's own period T is that of its tones, 2π/ω for one of them; an orbit of period k repeats after k of these, so
k = 2 is a 1/2 subharmonic.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial
from textwrap import shorten
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

import solvers
from fembeam.excitation import Harmonic, Multisine
from fembeam.model.equations import load_period
from fembeam.model.extremes import extremes_of
from fembeam.response import PlacedLog
from fembeam.scene import signals_of, with_signals
from fembeam.support import Part, Printed, counting, is_finite, is_whole, numbers, require, require_seed, warn
from solvers import orbits
from solvers.problem import counted
from solvers.problem.whole_runs import whole_runs

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from fembeam.model.model import Model
    from fembeam.model.run import Run
    from fembeam.model.sensitivity import Sensitivity

Vector = NDArray[np.float64]
SAME = 1e-6  # relative distance below which two states are one
NEAR = 0.01  # relative distance within which a settled start is on an unstable orbit, such as a symmetric one
LONGEST = 8  # periods of the load of an attractor that is looked for
WHERE = "Model.attractors"
STARTS = 12  # settled where shooting from rest finds nothing
LONGEST_REASON = 120  # characters of why shooting failed; the rest is in the error this one came from


@dataclass(frozen=True, eq=False)
class Orbit(Printed):
    """A periodic motion of a model.

    Attributes
    ----------
    model : whose motion it is. found : the `solvers.Orbit` with all that shooting knows.
    period : in periods of the load.
    """

    model: Model
    found: solvers.Orbit
    period: int

    @property
    def state(self) -> Vector:
        """(2n,) [q, q̇] at time ``found.phase``."""
        return self.found.state

    @property
    def multipliers(self) -> Any:
        """Floquet multipliers, largest first: (2n,), more with laws with memory."""
        return self.found.multipliers

    @property
    def transitions(self) -> Any:
        """Borders that laws with memory pass within one period: stick, slip, yielding."""
        return self.found.transitions

    @property
    def stable(self) -> bool:
        """Whether small disturbances die out."""
        return self.found.stable

    @cached_property
    def contacts(self) -> PlacedLog:
        """Contacts of one period."""
        return PlacedLog.of(self.found.contacts, self.model.sites)

    @property
    def parameter(self) -> float:
        """The varied parameter's value on a branch, else NaN."""
        return self.found.parameter

    @property
    def mark(self) -> str:
        """What is special about it on a branch: "fold", "flip", "neimark-sacker", "branch point", "grazing", "stick",
        "floor", "merging"; else "".
        """
        return self.found.mark

    @cached_property
    def run(self) -> Run:
        """One period as a run, finely sampled; its times count from ``found.phase``."""
        from fembeam.model.run import Run

        model = self.model
        tones = [float(np.max(signal.tones()[0], initial=0.0)) for signal in signals_of(model.scene).values()]
        cycles = self.found.period * max(float(model.omega.max()), 1.0 / self.found.period, *tones) / (2.0 * math.pi)
        if self.found.phase:  # what is read off a run takes loads and motions of supports at its own times
            model = model.under(with_signals(model.scene, partial(_later, by=self.found.phase)))
        return Run.of(model, self.found.samples(max(400, math.ceil(24.0 * cycles))))

    def sensitivity(self, parameter: str) -> Sensitivity:
        """Exact derivative of the orbit by a number of its scene: of its state, period, peaks and contacts.

        x(T; x₀, p) = x₀   gives   dx₀/dp = (I - Φ)⁻¹ (∂x/∂p + ẋ dT/dp)

        Parameters
        ----------
        parameter : as for `Run.sensitivity`.

        Returns
        -------
        Sensitivity : of `run`, one period: ``state``, ``period``, ``extremes(z)`` of the lowest and the highest
            displacement, histories at fixed times since ``found.phase``, contacts.

        Raises
        ------
        ValueError : as for `Run.sensitivity`. solvers.NoDerivativeError : a contact grazes. ArithmeticError : at a fold
            or branch point, where |1 - μ| < 1e-6 for one of the multipliers.
        """
        from fembeam.model.sensitivity import of_orbit

        return of_orbit(self, parameter)

    def extremes(self, z: float) -> tuple[float, float]:
        """Lowest and highest displacement (m, relative to the frame) at z over the period."""
        return extremes_of(self.run.t, self.run.displacement(z), self.run.velocity(z))

    def _parts(self) -> list[Part]:
        """What kind of orbit, its multipliers, its contacts."""
        doubt: list[Part] = [f"in doubt: {self.found.doubt}"] if self.found.doubt else []
        doubt += self._of_memory()
        multipliers = [(float(abs(one)), float(np.angle(one))) for one in self.multipliers]
        table: Part = ("multiplier |μ|", "angle / rad"), multipliers
        return [repr(self), *doubt, table, *self.contacts.parts]

    def _of_memory(self) -> list[Part]:
        """What laws with memory do to the orbit: that it is one of a family, how many multipliers are zero."""
        family, found = self.found.family, list[Part]()
        if family:
            which = ", ".join(self.model.contact_rows[contact].name for contact in sorted({one for one, _ in family}))
            count = counted(len(family), "latched number")
            found.append(f"one of a family: {count} of {which} never renewed, each a multiplier 1")
        if self.found.forgotten:
            found.append(f"{counted(self.found.forgotten, 'multiplier')} zero: what is latched forgets its past")
        return found

    def __repr__(self) -> str:
        contacts, kind = counted(len(self.contacts), "contact"), "stable" if self.stable else "unstable"
        if self.transitions:
            contacts += f", {counted(len(self.transitions), 'transition')}"
        kind += ", one of a family" if self.found.family else ""
        return f"<{kind} orbit of period {self.period} with {contacts}, |μ| = {abs(self.found.transverse[0]):.4g}>"


def _later(signal: Any, by: float) -> Any:
    """A signal of tones from a later time on."""
    if isinstance(signal, Harmonic):
        return replace(signal, phase=signal.phase + signal.omega * by)
    omega, amplitude = signal.tones()
    return Multisine(np.abs(amplitude), omega, np.angle(amplitude) + np.asarray(omega) * by)


def orbit(
    model: Model, period: int, start: ArrayLike | Orbit | None, shots: int | None, progress: bool = False
) -> Orbit:
    """See `Model.orbit`."""
    count, T = checked_period(period), load_period(model.scene)
    if start is None:
        most = 1 + STARTS + (len(orbits.MORE_DAMPING) if count == 1 else 0)
        with counting(progress, total=most, unit=" starts", delay=1.0, leave=False) as bar:
            return _from_rest(model, count, T, shots, bar.update)
    if isinstance(start, Orbit):
        start = orbits.at_zero(start.found)
    found = Orbit(model, solvers.orbit(model.system, count * T, start, shots=shots), count)
    _check_not_shorter(found, T)
    return found


def checked_period(period: int) -> int:
    """A whole number of load periods."""
    whole = is_whole(period) and is_finite(period)
    require(whole and period >= 1, "period counts periods of the load and must be a whole number above 0", period,
            "orbit", "period=2 is a 1/2 subharmonic")  # fmt: skip
    return int(period)


def _check_not_shorter(orbit: Orbit, T: float) -> None:
    """An orbit of period k must not repeat sooner."""
    shorter = _periods_to_repeat(orbit, T)
    if shorter < orbit.period:
        raise solvers.OrbitError(
            f"no orbit of period {orbit.period} near the start: Newton's method went to one of period {shorter}"
        )


def _periods_to_repeat(orbit: Orbit, T: float) -> int:
    """Periods of the load after which an orbit repeats."""
    n = len(orbit.model.omega)
    for shorter in range(1, orbit.period):
        if orbit.period % shorter:
            continue
        later = orbits.delayed(orbit.model.system, orbit.found.phase)
        end = orbits.state_after(later, orbit.found.whole, shorter * T, orbit.found.method)[: 2 * n]
        scale = np.repeat([np.abs(orbit.state[:n]).max(), np.abs(orbit.state[n:]).max()], n)
        if np.all(np.abs(end - orbit.state) <= SAME * scale + 1e-300):
            return shorter
    return orbit.period


def _from_rest(model: Model, count: int, T: float, shots: int | None, tried: Callable[[], Any]) -> Orbit:
    """What a run from rest settles to, else the first of many attractors with that period, else one by more damping.

    ``tried`` is called after each start.
    """
    try:
        start = orbits.settled(model.system, count * T, solvers.Exponential(1e-8))
        return orbit(model, count, start, shots)
    except solvers.OrbitError as error:
        refused = error
    tried()
    found, left_out = _settled(model, _drawn(model, STARTS, 0), LONGEST, 1, tried)
    for attractor in found:
        if attractor.orbit is not None and attractor.period == count:
            return attractor.orbit
    if count == 1:
        with suppress(solvers.OrbitError):
            return Orbit(
                model, orbits.orbit_by_damping(model.system, T, solvers.Exponential(1e-11), shots, tried), count
            )
    names = ", ".join(sorted({a.name for a in found}))
    raise solvers.OrbitError(
        f"{STARTS - len(left_out)} starts settled to {names}, none to period {count}; shooting after a run from rest: "
        + shorten(str(refused), LONGEST_REASON, placeholder=" …")
    ) from refused


@dataclass(frozen=True, eq=False)
class Attractor:
    """Where starts settle: an orbit, or None for motion that does not repeat; how many did; the last start that did."""

    orbit: Orbit | None
    count: int
    state: Vector

    @property
    def period(self) -> int | None:
        """In periods of the load; None when the motion does not repeat."""
        return None if self.orbit is None else self.orbit.period

    @property
    def impacts(self) -> int | None:
        """Contacts per period."""
        return None if self.orbit is None else len(self.orbit.contacts)

    @property
    def name(self) -> str:
        """Period and number of impacts as text."""
        if self.orbit is None:
            return "not periodic"
        return f"period {self.period} with {counted(len(self.orbit.contacts), 'impact')}"


def attractors(
    model: Model,
    starts: int | Sequence[ArrayLike] = 12,
    longest: int = LONGEST,
    seed: int = 0,
    progress: bool = False,
) -> list[Attractor]:
    """See `Model.attractors`."""
    require(is_whole(longest) and longest > 0, "longest must be a whole number of periods above 0", longest, WHERE,
            "ask for 8")  # fmt: skip
    states = _drawn(model, starts, seed) if is_whole(starts) else _given(model, starts)
    with counting(progress, total=len(states), unit=" starts") as bar:
        found, refused = _settled(model, states, longest, 1 if is_whole(starts) else len(states), bar.update)
    if refused:
        warn(f"{len(refused)} of {starts} starts are left out, whose runs are refused: {refused[0]}")
    return found


def _settled(
    model: Model, states: Sequence[Vector], longest: int, asked: int, tried: Callable[[], Any]
) -> tuple[list[Attractor], list[str]]:
    """What starts come to, and why the runs of others than the first ``asked`` are refused; those raise.

    ``tried`` is called after each start.
    """
    T, method = load_period(model.scene), solvers.Exponential(1e-8, ledger=False)
    found: list[Attractor] = []
    refused: list[str] = []
    for number, start in enumerate(states):
        try:
            state, orbit = _settle(model, T, start, longest, method)
        except solvers.SolverError as error:
            if number < asked:
                raise
            refused.append(str(error))
        else:
            _add(found, Attractor(orbit, 1, state), T)
        tried()
    return sorted(found, key=lambda a: -a.count), refused


def _add(found: list[Attractor], one: Attractor, T: float) -> None:
    """Count an attractor as one of those known, else know it."""
    for i, known in enumerate(found):
        if _same(known.orbit, one.orbit, T):
            found[i] = replace(known, count=known.count + 1)
            return
    found.append(one)


def _given(model: Model, starts: Any) -> list[Vector]:
    """Given starts, checked."""
    shape, advice = (2 * len(model.omega),), "use model.state(displacement, velocity)"
    require(np.iterable(starts), "starts must be a count above 0 or a list of states", starts, WHERE, "ask for 12")
    states = [numbers("starts", state, WHERE, advice) for state in starts]
    for state in states:
        require(state.shape == shape, f"each start must have shape {shape}", state.shape, WHERE, advice)
    return states


def _drawn(model: Model, count: int, seed: int) -> list[Vector]:
    """Rest, and random states of the size that the motion from rest has."""
    require(count >= 1, "starts must be a count above 0 or a list of states", count, WHERE, "ask for 12")
    require_seed(seed, WHERE)
    n, T = len(model.omega), load_period(model.scene)
    method = solvers.Exponential(1e-6, ledger=False)
    with whole_runs():
        run = solvers.integrate(model.system, np.zeros(n), np.zeros(n), 20.0 * T, T / 16.0, method)
    size = np.concatenate((np.abs(run.q).max(axis=0), np.abs(run.q_dot).max(axis=0)))
    rng = np.random.default_rng(seed)
    return [np.zeros(2 * n), *(2.0 * size * rng.normal(size=2 * n) for _ in range(count - 1))]


def _settle(model: Model, T: float, start: Vector, longest: int, method: Any) -> tuple[Vector, Orbit | None]:
    """Last state of a long run (at a multiple of the load's period), and the orbit it has come to."""
    n = len(model.omega)
    x = orbits.with_initial_memory(model.system, start)
    for _ in range(3):
        count = min(max(orbits.periods_of_decay(model.system, T), 40), 400) + 4 * longest
        run = orbits.run(model.system, x, count * T, T, method)
        strobes = np.concatenate((run.q, run.q_dot), axis=1)[-3 * longest :]
        x = np.concatenate((strobes[-1], *run.memory))
        size = np.abs(strobes).max(axis=0)
        size = np.maximum(size, SAME * np.repeat(size.reshape(2, n).max(axis=1), n))  # what nothing drives dies out
        for k in range(1, longest + 1):
            if np.all(np.abs(strobes[k:] - strobes[:-k]) <= 1e-3 * size):
                try:
                    found = _shortest_orbit(model, x, k, T)
                except solvers.OrbitError:
                    break
                if found.stable or _passes(found, x, T, NEAR):
                    return x[: 2 * n], found
                break  # Newton's method has left what the run comes to
    return x[: 2 * n], None


def _shortest_orbit(model: Model, x: Vector, k: int, T: float) -> Orbit:
    """The orbit near a state that nearly repeats after k periods; a decaying transient may have hidden that it is
    shorter.
    """
    found = Orbit(model, solvers.orbit(model.system, k * T, x), k)
    shorter = _periods_to_repeat(found, T)
    if shorter == k:
        return found
    return Orbit(model, solvers.orbit(model.system, shorter * T, orbits.at_zero(found.found)), shorter)


def _same(a: Orbit | None, b: Orbit | None, T: float) -> bool:
    """Whether two attractors are one: the same orbit, begun in any of its periods."""
    if a is None or b is None:
        return a is b
    if a.period != b.period or len(a.contacts) != len(b.contacts):
        return False
    return _passes(b, orbits.at_zero(a.found), T, 1e-5)


def _passes(orbit: Orbit, x: Vector, T: float, within: float) -> bool:
    """Whether an orbit passes near a state at the beginning of a load's period, of the state's size.

    All from its phase: a state within a contact does not tell the entry rate that some laws latch.
    """
    found, size = orbit.found, within * np.linalg.norm(x[: len(orbit.state)])
    times = np.arange(1, orbit.period + 1) * T - found.phase
    states = orbits.states_at(found, np.where(times > 0.0, times, times + found.period).tolist())
    return any(np.linalg.norm((x - y)[: len(orbit.state)]) <= size for y in states)
