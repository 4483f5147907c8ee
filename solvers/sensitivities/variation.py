"""Derivatives along a run: at its samples, and of each contact's times, peak force and impulse."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import zip_longest
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from solvers.compiled.state import LOGGED
from solvers.energy_norm import energy_norm
from solvers.integration import prepared_run
from solvers.problem import Array, ContactLog, Solution, SolverError, Status, System
from solvers.problem import event_list as at
from solvers.problem.friction import tell_sliders
from solvers.problem.matrices import number
from solvers.problem.signals import sampling_tolerance
from solvers.problem.whole_runs import whole_runs
from solvers.sensitivities.elements import motion_of
from solvers.sensitivities.events import GRAZING, NoDerivativeError, called, cross, knot_shift
from solvers.sensitivities.flow import Flow, begun_numbers, latched_columns
from solvers.sensitivities.nearby import Change, Nearby, unchanged
from solvers.sensitivities.panels import Panels, S, coefficients, interpolated, largest, zeros
from solvers.sensitivities.sampled import SampledLoads
from solvers.sensitivities.stretches import (
    Acting,
    Depths,
    Division,
    Motion,
    Stretch,
    acting_at_start,
    grouped,
    pieces_of,
)

SMOOTH = 1e-3  # relative size of the last Legendre coefficients of forces' derivatives, above which panels are halved
_REFINEMENTS, _REPEATS = (1, 2, 4), 2  # of panels, until derivatives are smooth; passes after the first to locate kinks
_MOST_ENTRIES = 400_000  # of the tables of panels held at once, which processors keep at hand
_SAME_BEND = 1e-9  # of the duration: a kink may be found twice, once from each side
_NEAR_PEAK = 0.9  # of the largest force so far: panels whose nodes are all below have no larger one
_SAME = 1e-6  # of the duration: difference of the times of events in two runs up to which they are the same
_NEAR = 1e-3  # of the motion: distance of a stop up to which it is sampled again, finely
_FINE_OFFSETS = np.linspace(-0.02, 0.02, 9)  # times of these samples, in units of the distance of the first ones
_PER_PERIOD, _MOST_SAMPLES = 24, 200_000  # samples per period of the fastest mode, and at most, to see stops come near


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Derivatives by a parameter, or along a direction of the start.

    Attributes
    ----------
    t : (k,) s. states : (k, 2n) of [q, q̇] at fixed times t.
    contacts : log of the run. entries, exits : (c,) of ``t_in`` and ``t_out``, in its order; zero for one under way at
        the start, NaN for one not ended. peak_force, impulse : (c,) likewise.
    end : (2n + l,) of [q, q̇] at the end and of the numbers latched then. rate : (2n,) the motion's own [q̇, q̈] there.
    matrix : (2n + l, 2n + l) the derivative of the end by the start.
    growth : largest factor by which a small change of the start has grown at the end, in the norm of energy.
    roughness : relative size of the last Legendre coefficients of the forces' derivatives, an estimate of the error.
    """

    t: Array
    states: Array
    contacts: ContactLog
    entries: Array
    exits: Array
    peak_force: Array
    impulse: Array
    end: Array
    rate: Array
    matrix: Array
    growth: float
    roughness: float
    solution: Solution


def sensitivity(
    system: System,
    q0: ArrayLike,
    q_dot0: ArrayLike,
    duration: float,
    times: ArrayLike = (),
    nearby: Nearby | None = None,
    start: ArrayLike | None = None,
    method: Any = None,
    memory: Sequence[Any] | None = None,
    progress: Callable[[float], None] | None = None,
) -> Sensitivity:
    """Derivative of a run by a parameter, and by its start, through all its events; `sensitivities` by several.

    The variational equation is solved along the run's own motion: exactly in flight, by collocation of the forces on
    panels of fourteen Gauss nodes where elements act, with jumps at events.

    Parameters
    ----------
    system, q0, q_dot0, duration, method, memory : as for `integrate`; the run is made again with its own steps.
    times : (k,) s, ascending, where derivatives of the state are wanted.
    nearby : systems near the present one in the parameter; None: by the start alone.
    start : (2n,) derivative of [q0, q_dot0] by the parameter, or the direction in which the start moves; None: 0. With
        laws that latch numbers (2n + l,) does, as in `Solution.end`.
    progress : called with the simulated time now and then; it begins anew where panels are halved.

    Raises
    ------
    NoDerivativeError : a contact grazes, to 1e-9 of the motion, or comes as near without being met.
    ValueError : bad input, a law with an infinite slope at its surface, panels beyond count.
    SolverError : the run fails.

    Notes
    -----
    As exact as the motion: errors are some hundred rtol of the run at most, more where small changes grow.

    References
    ----------
    R.I. Leine, H. Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems (2004), chapter 7.

    Examples
    --------
    A ball that flies at 2 m/s meets a stop at 0.5 m: t_in = gap/v, and so dt_in/dgap = 1/v.

    >>> from contacts import PiecewiseLinear
    >>> from solvers import Contact
    >>> ball = lambda gap: System([[1.0]], [[0.0]], [[0.0]], [Contact([-1.0], PiecewiseLinear([1e4]), gap)])
    >>> found = sensitivity(ball(0.5), [0.0], [2.0], 0.5, nearby=Nearby.of(ball, 0.5, 1e-3))
    >>> float(found.entries[0])
    0.500000
    """
    return sensitivities(system, q0, q_dot0, duration, [(nearby, start)], times, method, memory, progress)[0]


def sensitivities(
    system: System,
    q0: ArrayLike,
    q_dot0: ArrayLike,
    duration: float,
    parameters: Sequence[tuple[Nearby | None, ArrayLike | None]],
    times: ArrayLike = (),
    method: Any = None,
    memory: Sequence[Any] | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[Sensitivity]:
    """Derivatives of a run by several parameters, for little more than those by one.

    ``parameters`` are pairs of ``nearby`` and ``start``; all else is as for `sensitivity`.
    """
    from solvers.exponential.method import Exponential
    from solvers.problem.run_arguments import check_slopes, checked_start

    check_slopes(system)
    duration = number(duration, "duration")
    method = Exponential() if method is None else method
    checked_start(system, q0, q_dot0, method)
    asked = _Request(
        system,
        np.concatenate([np.atleast_1d(np.asarray(one, dtype=float)) for one in (q0, q_dot0)]),
        duration,
        _checked_times(times, duration),
        replace(method, ledger=False) if isinstance(method, Exponential) else method,
        memory,
        Change(system, [unchanged(system) if one is None else one for one, _ in parameters], duration),
        _checked_directions(system, [one for _, one in parameters]),
        progress or (lambda t: None),
    )
    rows = asked.measure()
    best, bends = None, np.zeros(0)
    for refinement in _REFINEMENTS:
        walk = _Walk(asked, rows, refinement, bends)
        for _ in range(_REPEATS if walk.bends else 0):  # the second time they are known to rounding
            bends = _without_repeats(walk.bends, _SAME_BEND * duration)
            walk = _Walk(asked, rows, refinement, bends)
        if best is not None and walk.flow.roughness >= best.flow.roughness:
            break
        best = walk
        if not best.flow.roughness > SMOOTH:
            break
    assert best is not None
    return best.results()


def _checked_times(times: ArrayLike, duration: float) -> Array:
    """Times (k,) at which derivatives are wanted."""
    found = np.atleast_1d(np.asarray(times, dtype=float))
    if found.ndim != 1 or not np.isfinite(found).all() or np.any(np.diff(found) < 0.0):
        raise ValueError(f"times must be one ascending row of finite numbers (s), got {times!r}")
    if found.size and not (found[0] >= 0.0 and found[-1] <= duration * (1.0 + 1e-9)):
        raise ValueError(f"times must lie in [0, {duration:g}] s, got {found[0]:g} to {found[-1]:g} s")
    return found.clip(max=duration)  # k dt may round to more


def _checked_directions(system: System, starts: Sequence[ArrayLike | None]) -> Array:
    """(2n + l, d) derivatives of the start, each given as (2n,), with what is latched as (2n + l,), or as None."""
    n2 = 2 * system.size
    whole = n2 + sum(len(one.memory) for one in system.contacts)
    found = np.zeros((whole, len(starts)))
    for i, start in enumerate(starts):
        given = np.zeros(n2) if start is None else np.asarray(start, dtype=float)
        if given.shape not in ((n2,), (whole,)) or not np.isfinite(given).all():
            more = f", or {whole} with what is latched" if whole > n2 else ""
            raise ValueError(f"start must be {n2} finite numbers, those of [q0, q_dot0]{more}, got {start!r}")
        found[: given.size, i] = given
    return found


def _without_repeats(times: list[float], distance: float) -> Array:
    """Times in order, without those nearer to the one before than a distance."""
    ordered = np.sort(np.array(times))
    return ordered[np.diff(ordered, prepend=-np.inf) > distance]


@dataclass(eq=False)
class _Request:
    """System, run and parameters of a sensitivity, and the sizes of its motion."""

    system: System
    x: Array
    duration: float
    times: Array
    method: Any
    memory: Any
    by: Change
    starts: Array  # (2n + l, d) derivatives of the start
    progress: Callable[[float], None]
    span: Array = field(default_factory=lambda: np.zeros(0))  # (E,) size of each element's displacement
    depths: list[Depths] = field(default_factory=list)  # of each element

    @cached_property
    def sampled(self) -> SampledLoads:
        """Loads that are no tones, as the run takes them."""
        return SampledLoads(self.system, self.duration, sampling_tolerance(self.method.rtol))

    def replayed(self, times: Array) -> tuple[Solution, Array]:
        """The run, sampled at times, with its list of events (k, 14), a row an event."""
        q, q_dot = np.split(self.x, 2)
        run = prepared_run(self.system, q, q_dot, self.duration, times, self.method, False, self.memory)
        with whole_runs():
            status = run.to_the_end(None)
        solution = run.solution(status, 0.0)
        rows = run.state.log[: int(run.state.count[LOGGED])]
        rows = rows[rows[:, at.GUARD] != at.FRICTION]
        run.engine.release()
        if solution.status is not Status.DONE:
            raise SolverError(f"the run has no derivative to its end: {solution.status.value}", solution)
        at_start = solution.t == 0.0  # as given: rounding would move what rests on a surface off it
        solution.q[at_start], solution.q_dot[at_start] = q, q_dot
        return solution, rows

    def dense_times(self) -> Array:
        """Times dense enough to see how near each stop comes."""
        fastest = float(np.sqrt(np.abs(self.system.blocks.k)).max(initial=0.0))
        count = 100 + int(min(_PER_PERIOD * fastest * self.duration / (2.0 * np.pi), _MOST_SAMPLES))
        return np.linspace(0.0, self.duration, count)

    def seen(self, times: Array) -> tuple[_Seen, Array]:
        """What the elements see of the run at times, and its list of events."""
        found = []
        for piece in pieces_of(times, self.system.size):
            solution, rows = self.replayed(piece)
            motion = [motion_of(contact, solution.q.T, solution.q_dot.T) for contact in self.system.contacts]
            found.append(np.array([(one.delta, one.rate) for one in motion]).reshape(len(motion), 2, len(piece)))
        return _Seen(times, *np.concatenate(found, axis=2).swapaxes(0, 1)), rows

    def measure(self) -> Array:
        """Set the sizes of the displacements and return the events.

        NoDerivativeError for a stop that is touched but not entered.
        """
        seen, rows = self.seen(self.dense_times())
        self.span, self.depths = np.zeros(len(self.system.contacts)), []
        for s, contact in enumerate(self.system.contacts):
            delta, mine = seen.delta[s], rows[rows[:, at.ELEMENT] == s]
            self.span[s] = np.abs(delta + contact.gap * (-1.0 if contact.outer else 1.0)).max() + 1e-300
            self.depths.append(Depths.of(contact, mine, seen.t, delta, 1e-9 * self.span[s]))
        self._check_touching(seen)
        return rows

    def _check_touching(self, seen: _Seen) -> None:
        """NoDerivativeError if a stop is touched, by fine samples where it comes near."""
        stops = [s for s, contact in enumerate(self.system.contacts) if not contact.always]
        near = [(s, t, h) for s in stops for t, h, top in seen.maxima(s) if abs(top) < _NEAR * self.span[s]]
        if not near:
            return
        times = np.unique(np.concatenate([t + h * _FINE_OFFSETS for _, t, h in near]))
        times = times[(times >= 0.0) & (times <= self.duration)]
        closer, _ = self.seen(times)
        for s in {s for s, _, _ in near}:
            for t, _, top in closer.maxima(s):
                if abs(top) <= GRAZING * self.span[s]:
                    raise NoDerivativeError(
                        f"no derivative: {called(self.system, s)} is touched but not entered at t = {t:.6g} s, "
                        f"to {abs(top):.2g} m; change the parameter a little"
                    )


@dataclass(frozen=True, eq=False)
class _Seen:
    """δ and δ̇ (E, k) of all elements at times t (k,)."""

    t: Array
    delta: Array
    rate: Array

    def maxima(self, s: int) -> list[tuple[float, float, float]]:
        """(time, distance of samples, δ) of the maxima of δ below zero between samples, from cubics."""
        t, delta, rate, found = self.t, self.delta[s], self.rate[s], []
        for i in np.flatnonzero((rate[:-1] > 0.0) & (rate[1:] <= 0.0) & (delta[:-1] < 0.0) & (delta[1:] < 0.0)):
            h, x = t[i + 1] - t[i], rate[i] / (rate[i] - rate[i + 1])
            rest = 1.0 - x
            top = rest**2 * ((1.0 + 2.0 * x) * delta[i] + x * h * rate[i])
            top += x**2 * ((3.0 - 2.0 * x) * delta[i + 1] - rest * h * rate[i + 1])
            found.append((float(t[i] + x * h), float(h), float(top)))
        return found


def _check_same(rows: Array, again: Array, duration: float) -> None:
    """NoDerivativeError if the run, sampled at other times, has other events: then rounding decides on them."""
    own = [at.ELEMENT, at.GUARD, at.FROM, at.TO]
    if rows.shape == again.shape and np.array_equal(rows[:, own], again[:, own]):
        apart = np.abs(rows[:, at.TIME] - again[:, at.TIME]).max(initial=0.0)
        if apart <= _SAME * duration:
            return
    raise NoDerivativeError(
        "no derivative: rounding changes the contacts of the run, so far do small changes grow; shorten the run"
    )


@dataclass(eq=False)
class _Contact:
    """Derivatives (d,) of one contact by the parameters."""

    stop: int
    entry: Array
    before: Array  # impulse when it began
    exit: Array
    impulse: Array
    peak: Array
    top: float = 0.0  # as in the log: of a contact that only pulls the peak is 0

    def offer(self, force: float, change: Array) -> None:
        """Take a force and its derivatives as peak if it is the largest so far."""
        if force > self.top:
            self.top, self.peak = force, change


def _ends_on_knot(row: Array, following: Array | None) -> bool:
    """Whether a border is met on a knot that is logged next, as where N jumps up and a slip ends."""
    if following is None or row[at.GUARD] < 0.0 or following[at.GUARD] != at.KNOT:
        return False
    return bool(row[at.ELEMENT] == following[at.ELEMENT] and min(following[at.FROM], following[at.TO]) > 0.0)


class _Walk:
    """One pass over a run, with the derivatives collected on the way."""

    def __init__(self, asked: _Request, rows: Array, refinement: int, bends: Array) -> None:
        system, by = asked.system, asked.by
        self.asked, self.rows, self.events = asked, rows, grouped(rows)
        self.acting = acting_at_start(system, asked.x, rows, asked.memory)
        division = Division(system, by.forced, asked.depths, bends, asked.sampled)
        self.stretches = list(division.stretches(self.acting, rows, asked.duration, refinement))
        wanted = [np.array([0.0, asked.duration]), asked.times, *(t for one in self.stretches for t in one.times)]
        times = np.unique(np.clip(np.concatenate(wanted), 0.0, asked.duration))
        self.solution = self._replayed(np.union1d(wanted[0], asked.times))  # that is kept
        self.motion = Motion(self._replayed, times, system.size)
        n2, (whole, own) = 2 * system.size, asked.starts.shape
        start = np.eye(n2, whole + own)
        start[:, whole:] = asked.starts[:n2]
        self.flow = Flow(system, self.motion, by, start, latched_columns(system, by, asked.starts, asked.memory))
        self.states = np.zeros((len(asked.times), len(by), n2))
        self.contacts: list[_Contact] = []
        self.bends: list[float] = []  # times at which laws have kinks that are no knots
        self.open: dict[int, _Contact] = {}
        self._pass_all()

    def _replayed(self, times: Array) -> Solution:
        """The run at times; NoDerivativeError if it has other events."""
        solution, again = self.asked.replayed(times)
        _check_same(self.rows, again, self.asked.duration)
        return solution

    def _pass_all(self) -> None:
        """Follow the run and collect the derivatives."""
        self._store_at(0.0)
        for stretch in self.stretches:
            self._pass_events(stretch.start)
            if stretch.start == 0.0:
                self._check_start()
            self._pass_stretch(stretch)
        self._pass_events(self.asked.duration)
        for one in self.open.values():
            force, _, change = self.flow.at_instant(self.asked.duration, one.stop, self.acting)
            one.offer(force, change[self.flow.own])
            one.impulse = (self.flow.impulse[one.stop] - one.before)[self.flow.own]

    def results(self) -> list[Sensitivity]:
        """The collected derivatives, one `Sensitivity` for each parameter."""
        flow, log, times = self.flow, self.solution.contacts, self.asked.times
        end = np.concatenate((flow.state, *flow.latched))
        system, now = self.asked.system, self.solution.memory
        begun = begun_numbers(system, self.asked.memory)
        turned = self.asked.duration * np.array([one.surface for one in self.asked.by.elements])
        tell_sliders(end, system.contacts, begun, now, turned)
        rate = flow.rate(np.array([self.asked.duration]), self.acting)[:, 0]
        of_contacts, matrix = self._of_contacts(log), end[:, : len(end)]
        about: Any = matrix, self._growth(), flow.roughness, self.solution
        return [
            Sensitivity(times, states, log, *by_one, end[:, i], rate, *about)  # type: ignore[call-arg]
            for i, states, by_one in zip(
                range(len(end), end.shape[1]), self.states.swapaxes(0, 1), of_contacts, strict=True
            )
        ]

    def _check_start(self) -> None:
        """NoDerivativeError if a stop begins on its surface and a parameter moves it, so that both sides differ."""
        for s, (span, contact) in enumerate(zip(self.asked.span, self.asked.system.contacts, strict=True)):
            near = abs(self.flow.motion_of(0.0, s).delta[0]) <= GRAZING * span
            bends = not self.acting.segment[s] or (contact.law.jump and not contact.always)
            if near and bends and np.any(self.flow.leaves_at_start(s, 0)):
                raise NoDerivativeError(
                    f"no derivative: {called(self.flow.system, s)} is touched at the start, "
                    "so that it differs on both sides; begin off the surface"
                )

    def _store_at(self, t: float) -> None:
        """Store the derivatives of the state if t is a sample."""
        place = np.searchsorted(self.asked.times, t)
        if place < len(self.states) and self.asked.times[place] == t:
            self.states[place] = self.flow.by_parameters

    def _pass_events(self, t: float) -> None:
        """Apply all events at a time."""
        last, own, rows = None, self.flow.own, self.events.get(t, ())
        for row, following in zip_longest(rows, rows[1:]):
            s = int(row[at.ELEMENT])
            if _ends_on_knot(row, following):
                last = knot_shift(self.flow, t, following, self.acting, float(self.asked.span[s]))
            ends, begins = row[at.FROM] > 0.0 and row[at.TO] == 0.0, row[at.FROM] == 0.0 and row[at.TO] > 0.0
            known = self._at_instant(t)
            before = self.flow.impulse[s].copy()
            self.acting, last = cross(self.flow, t, row, self.acting, float(self.asked.span[s]), last)
            self._offer(known, last)
            if ends and s in self.open:
                one = self.open.pop(s)
                one.exit, one.impulse = last[own], (self.flow.impulse[s] - one.before)[own]
            if begins:
                unknown = np.full(len(self.asked.by), np.nan)
                self.open[s] = _Contact(s, last[own], before, unknown, unknown, np.zeros(len(unknown)))
                self.contacts.append(self.open[s])
            self._offer(self._at_instant(t), last)

    def _at_instant(self, t: float) -> dict[int, tuple[float, float, Array]]:
        """N, dN/dt and dN of all contacts: a peak may be met where another element begins to stick."""
        return {s: self.flow.at_instant(t, s, self.acting) for s in self.open if self.acting.segment[s]}

    def _offer(self, known: dict[int, tuple[float, float, Array]], shift: Array) -> None:
        """Offer forces at an event whose time changes by a shift (m,)."""
        for s, (force, pace, change) in known.items():
            self.open[s].offer(force, (change + pace * shift)[self.flow.own])

    def _pass_stretch(self, stretch: Stretch) -> None:
        """Move over one stretch, by panels or in one flight."""
        flow, times = self.flow, self.asked.times
        begin, (low, high) = stretch.start, np.searchsorted(times, [stretch.start, stretch.end], side="right")
        high -= int(high > low and times[high - 1] == stretch.end)
        if stretch.panels is None:
            self._sampled(low, flow.fly(begin, stretch.end, times[low:high]))
        rows = sum(len(flow.rows[s]) for s in stretch.acting.elements)
        most = max(_MOST_ENTRIES // (S * S * max(len(flow.k), rows * rows)), 1)
        for panels in stretch.panels.parts(most) if stretch.panels else ():
            middle = high if panels.ends[-1] >= stretch.end else low + np.searchsorted(times[low:high], panels.ends[-1])
            if stretch.acting.elements:
                found, changes = flow.pass_panels(panels, self.acting, times[low:middle])
                self._inspect(panels, changes, self.acting)
            else:
                found = flow.pass_flight(panels, stretch.acting, times[low:middle])
            self._sampled(low, found)
            low = middle
            self.asked.progress(float(panels.ends[-1]))
        self._store_at(stretch.end)
        self.asked.progress(stretch.end)

    def _sampled(self, first: int, found: Array) -> None:
        """Store derivatives (q, 2n, d) of the blocks at samples."""
        self.states[first : first + len(found)] = np.moveaxis(self.flow.T @ found, 1, 2)

    def _inspect(self, panels: Panels, changes: dict[int, tuple[Array, Array]], acting: Acting) -> None:
        """Find peaks and kinks within panels, and the roughness of the derivatives there."""
        for s, (change, forces) in changes.items():
            self._find_kinks(panels, s, acting)
            size = np.abs(forces).max(axis=(1, 2))
            tail = np.abs(coefficients(np.moveaxis(forces, 2, 0))[-2:]).max(axis=(0, 2))
            size[0] = np.maximum(size[0], self.flow.largest[s])
            scale = np.maximum.accumulate(size, axis=0)
            self.flow.largest[s] = scale[-1]
            rough = (tail / np.where(scale > 0.0, scale, 1.0)).max(initial=0.0)
            self.flow.roughness = max(self.flow.roughness, float(rough))
            if s in self.open:
                self._find_peak(panels, s, acting, change[..., self.flow.own])

    def _find_peak(self, panels: Panels, s: int, acting: Acting, change: Array) -> None:
        """Offer the largest force within panels; ends of a stretch are offered with their events."""
        values = self.flow.force(panels.times.ravel(), s, acting).reshape(-1, S)
        if values.max() > _NEAR_PEAK * self.open[s].top:
            i, place, top = largest(values, (panels.edges[0] > 0.0, panels.edges[-1] < 1.0))
            self.open[s].offer(top, interpolated(place, change[i]))

    def _find_kinks(self, panels: Panels, s: int, acting: Acting) -> None:
        """Collect times within panels, and a little beyond, at which a law has a kink that is no knot."""
        bent = self.flow.bend(panels.times.ravel(), s, acting)
        if bent is None:
            return
        turns = np.flatnonzero(np.diff(np.sign(bent)))
        ends = np.array([0, bent.size - 1])  # a zero may lie between the outermost node and the end
        for i in np.unique(np.concatenate((turns, turns + 1, ends)) // S):
            places = panels.edges[i] + panels.widths[i] * zeros(bent.reshape(-1, S)[i])
            self.bends += panels.clock.time(np.clip(places, 0.0, 1.0)).tolist()

    def _of_contacts(self, log: ContactLog) -> Array:
        """(d, 4, c) of entries, exits, peak forces and impulses in the order of the log."""
        found = np.full((len(self.asked.by), 4, len(log)), np.nan)
        for s in set(log.stop.tolist()):
            rows = np.flatnonzero(log.stop == s)
            mine = [one for one in self.contacts if one.stop == s]
            for place, one in zip(rows[np.argsort(log.t_in[rows], kind="stable")], mine, strict=True):
                found[:, :, place] = np.transpose([one.entry, one.exit, one.peak, one.impulse])
        return found

    def _growth(self) -> float:
        """Largest factor from start to end in the norm of energy, with an added spring so that rigid motions count."""
        norm = energy_norm(self.asked.system, self.asked.duration)
        by_start = self.flow.state[:, : len(norm)]
        return float(np.linalg.norm(norm @ by_start @ np.linalg.inv(norm), 2))
