"""Derivatives along a run: at its samples, and of each contact's times, peak force and impulse."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from solvers.problem import Array, ContactLog, Solution, System, dense
from solvers.problem import event_list as at
from solvers.sensitivities.events import GRAZING, NoDerivativeError, cross
from solvers.sensitivities.flow import Flow, latched_columns
from solvers.sensitivities.nearby import Change, Nearby
from solvers.sensitivities.panels import coefficients, interpolated, largest, zeros
from solvers.sensitivities.stretches import (
    Acting,
    Division,
    Motion,
    Stretch,
    acting_at_start,
    grouped,
    motion_at,
    replayed,
)

SMOOTH = 1e-3  # share of the last Legendre coefficients of forces' derivatives, above which panels are halved
_FINEST, _TWICE = 4, 2  # times
_SAME_BEND = 1e-9  # of the duration: a kink found twice, on both of its sides
_NEAR_TOP = 0.9  # of the largest force so far: a panel whose nodes stay below has no larger one
_SAME = 1e-6  # of the duration: events of one run, made twice, may be so far apart
_NEAR = 1e-3  # of the motion: stops that come so near are looked at closely
_CLOSELY = np.linspace(-0.02, 0.02, 9)  # in units of the distance of samples
_PER_PERIOD, _MOST_LOOKS = 24, 200_000  # samples in which contacts that nearly come are looked for


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Derivatives by a parameter, or along a direction of the start.

    Attributes
    ----------
    t : (k,) s. states : (k, 2n) of [q, q̇] at fixed times t.
    contacts : log of the run. entries, exits : (c,) of ``t_in`` and ``t_out``, in its order; zero of one under way at
        the start, NaN of one not ended. peak_force, impulse : (c,) likewise.
    end : (2n + l,) of [q, q̇] at the end and of what is latched then. rate : (2n,) the motion's own [q̇, q̈] there.
    matrix : (2n + l, 2n + l) the derivative of the end by the start.
    growth : largest factor by which a small change of the start has grown at the end, in the norm of energy.
    roughness : share of the last Legendre coefficients in the forces' derivatives: an estimate of the error.
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
) -> Sensitivity:
    """Derivative of a run by a parameter, and by its start, through all its events.

    The variational equation is solved along the run's own motion: exactly in flight, by collocation of the forces on
    panels of fourteen Gauss nodes where elements act, with jumps at events.

    Parameters
    ----------
    system, q0, q_dot0, duration, method, memory : as for `integrate`; the run is made again with its own steps.
    times : (k,) s, ascending, where derivatives of the state are wanted.
    nearby : systems near the present one in the parameter; None: by the start alone.
    start : (2n,) derivative of [q0, q_dot0] by the parameter, or the direction in which the start moves; None: 0. With
        laws that latch numbers (2n + l,) does, as in `Solution.end`.

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
    from solvers.exponential.method import Exponential
    from solvers.problem.run_arguments import check_slopes

    check_slopes(system)
    asked = _Asked(system, _state(q0, q_dot0), duration, np.atleast_1d(np.asarray(times, dtype=float)))
    method = Exponential() if method is None else method
    asked.method = replace(method, ledger=False) if isinstance(method, Exponential) else method
    asked.memory = memory
    asked.by = None if nearby is None else Change(system, nearby, duration)
    asked.start = np.zeros(2 * system.size) if start is None else np.asarray(start, dtype=float)
    log, rows = replayed(system, asked.x, duration, asked.looks(), asked.method, memory)
    asked.measure(log, rows)
    refinement, best, bends = 1, None, np.zeros(0)
    while best is None or (best.roughness > SMOOTH and refinement < _FINEST):
        if best is not None:
            refinement *= 2
        walk = _Walk(asked, rows, refinement, bends)
        found = walk.result()
        for _ in range(_TWICE if walk.bends else 0):  # the second time they are known to rounding
            bends = _apart(walk.bends, _SAME_BEND * duration)
            walk = _Walk(asked, rows, refinement, bends)
            found = walk.result()
        if best is not None and found.roughness >= best.roughness:
            break
        best = found
    return best


def _apart(times: list[float], distance: float) -> Array:
    """Times in order, of those nearer to each other than a distance the first."""
    ordered = np.sort(np.array(times))
    return ordered[np.diff(ordered, prepend=-np.inf) > distance]


def _parts(values: Array, counts: list[int]) -> list[Array]:
    """Values in parts of given lengths; zeros where there are none."""
    values = values if values.size else np.zeros(sum(counts))
    return np.split(values, np.cumsum(counts)[:-1]) if counts else []


def _state(q0: ArrayLike, q_dot0: ArrayLike) -> Array:
    """[q, q̇]."""
    return np.concatenate([np.atleast_1d(np.asarray(one, dtype=float)) for one in (q0, q_dot0)])


@dataclass(eq=False)
class _Asked:
    """What is wanted, and of what."""

    system: System
    x: Array
    duration: float
    times: Array
    method: Any = None
    memory: Any = None
    by: Change | None = None
    start: Array = field(default_factory=lambda: np.zeros(0))
    span: Array = field(default_factory=lambda: np.zeros(0))  # (E,) size of each element's displacement
    depth: Array = field(default_factory=lambda: np.zeros(0))  # (E,) largest indentation, m

    def looks(self) -> Array:
        """Times dense enough to see how near each stop comes."""
        fastest = float(np.sqrt(np.abs(self.system.blocks.k)).max(initial=0.0))
        count = 100 + int(min(_PER_PERIOD * fastest * self.duration / (2.0 * np.pi), _MOST_LOOKS))
        return np.linspace(0.0, self.duration, count)

    def measure(self, solution: Solution, rows: Array) -> None:
        """Sizes of the displacements; NoDerivativeError for a stop that is touched but not entered."""
        self.span, self.depth = (np.zeros(len(self.system.contacts)) for _ in range(2))
        for s, contact in enumerate(self.system.contacts):
            delta = motion_at(contact, solution.q.T, solution.q_dot.T).delta
            mine = rows[rows[:, at.ELEMENT] == s]
            self.span[s] = np.abs(delta + contact.gap * (-1.0 if contact.outer else 1.0)).max() + 1e-300
            deepest = np.nanmax(np.append(mine[:, at.DEEPEST], 0.0))
            deepest = max(deepest, float((np.abs(delta) if contact.always else delta).max()))
            self.depth[s] = max(deepest, 1e-9 * self.span[s])
        self._check_apart(solution)

    def _check_apart(self, solution: Solution) -> None:
        """NoDerivativeError where a stop is touched, as the run shows when it is looked at closely there."""
        near = [
            (s, t, h) for s in self._stops() for t, h, top in self._tops(solution, s) if abs(top) < _NEAR * self.span[s]
        ]
        if not near:
            return
        times = np.unique(np.concatenate([t + h * _CLOSELY for _, t, h in near]))
        times = times[(times >= 0.0) & (times <= self.duration)]
        closer = replayed(self.system, self.x, self.duration, times, self.method, self.memory)[0]
        for s in {s for s, _, _ in near}:
            for t, _, top in self._tops(closer, s):
                if abs(top) <= GRAZING * self.span[s]:
                    raise NoDerivativeError(
                        f"no derivative: contact {s} is touched but not entered at t = {t:.6g} s, to {abs(top):.2g} m; "
                        "change the parameter a little"
                    )

    def _stops(self) -> list[int]:
        """Elements whose contacts begin and end."""
        return [s for s, contact in enumerate(self.system.contacts) if not contact.always]

    def _tops(self, solution: Solution, s: int) -> list[tuple[float, float, float]]:
        """Times of the maxima of δ below zero between samples, the distance of samples there, and δ of cubics."""
        contact, t = self.system.contacts[s], solution.t
        motion, found = motion_at(contact, solution.q.T, solution.q_dot.T), []
        delta, rate = motion.delta, motion.rate
        for i in np.flatnonzero((rate[:-1] > 0.0) & (rate[1:] <= 0.0) & (delta[:-1] < 0.0) & (delta[1:] < 0.0)):
            h, x = t[i + 1] - t[i], rate[i] / (rate[i] - rate[i + 1])
            rest = 1.0 - x
            top = rest**2 * ((1.0 + 2.0 * x) * delta[i] + x * h * rate[i])
            top += x**2 * ((3.0 - 2.0 * x) * delta[i + 1] - rest * h * rate[i + 1])
            found.append((float(t[i] + x * h), float(h), float(top)))
        return found


def _check_same(rows: Array, again: Array, duration: float) -> None:
    """NoDerivativeError where a run that is sampled more finely meets other events: rounding alone decides on them."""
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
    """Derivatives (m,) of one contact."""

    stop: int
    entry: Array
    before: Array  # impulse when it began
    exit: Array | None = None
    impulse: Array | None = None
    top: float = -np.inf
    peak: Array | None = None

    def offer(self, force: float, change: Array) -> None:
        """A candidate for the largest force."""
        if force > self.top:
            self.top, self.peak = force, change


class _Walk:
    """One pass over a run."""

    def __init__(self, asked: _Asked, rows: Array, refinement: int, bends: Array) -> None:
        system = asked.system
        self.asked, self.rows, self.events = asked, rows, dict(grouped(rows))
        forced = asked.by is not None and asked.by.forced
        self.acting = acting_at_start(system, asked.x, rows, asked.memory)
        division = Division(system, forced, asked.times, asked.depth, bends)
        self.stretches = list(division.stretches(self.acting, rows, asked.duration, refinement))
        wanted = [np.array([0.0, asked.duration]), asked.times, *(t for one in self.stretches for t in one.times)]
        times = np.unique(np.clip(np.concatenate(wanted), 0.0, asked.duration))
        self.solution, again = replayed(system, asked.x, asked.duration, times, asked.method, asked.memory)
        _check_same(rows, again, asked.duration)
        self.motion = Motion(self.solution.t, np.hstack((self.solution.q, self.solution.q_dot)))
        n2, own = 2 * system.size, sum(len(getattr(one.law, "memory", ())) for one in system.contacts)
        columns = n2 + own + 1
        start = np.zeros((n2, columns))
        start[:, :n2], start[:, -1] = np.eye(n2), asked.start[:n2]
        latched = latched_columns(system, n2, columns, asked.by, asked.memory)
        for own, given in zip(latched, _parts(asked.start[n2:], [len(one) for one in latched]), strict=True):
            own[:, -1] += given
        self.flow = Flow(system, self.motion, asked.by, start, latched)
        self.states = np.zeros((len(asked.times), n2))
        self.contacts: list[_Contact] = []
        self.bends: list[float] = []  # times at which laws have kinks that are no knots
        self.open: dict[int, _Contact] = {}

    def result(self) -> Sensitivity:
        """Go along the run, and collect."""
        self._keep(0.0)
        for stretch in self.stretches:
            self._pass_events(stretch.start)
            if stretch.start == 0.0:
                self._check_start()
            self._pass(stretch)
        self._pass_events(self.asked.duration)
        flow, log = self.flow, self.solution.contacts
        for one in self.open.values():
            force, _, change = flow.at_instant(self.asked.duration, one.stop, self.acting)
            one.offer(force, change)
            one.impulse = flow.impulse[one.stop] - one.before
        end = np.concatenate((flow.state, *flow.latched))
        rate = flow.rate(np.array([self.asked.duration]), self.acting)[:, 0]
        columns = self._of_contacts(log)
        about = self._growth(), flow.roughness, self.solution
        return Sensitivity(self.asked.times, self.states, log, *columns, end[:, -1], rate, end[:, :-1], *about)

    def _check_start(self) -> None:
        """NoDerivativeError for a stop that begins on its surface without contact, if the parameter moves it."""
        for s, span in enumerate(self.asked.span):
            near = abs(self.flow.motion_of(0.0, s).delta[0]) <= GRAZING * span
            if near and not self.acting.segment[s] and self.flow.change(0.0, s)[0][-1] != 0.0:
                raise NoDerivativeError(
                    f"no derivative: contact {s} is touched at the start, so that it differs on both sides; "
                    "begin off the surface"
                )

    def _keep(self, t: float) -> None:
        """Keep the derivative of the state where a sample is at the time reached."""
        place = np.searchsorted(self.asked.times, t)
        if place < len(self.states) and self.asked.times[place] == t:
            self.states[place] = self.flow.T @ self.flow.y[:, -1]

    def _pass_events(self, t: float) -> None:
        """All events at a time."""
        last = None
        for row in self.events.get(t, ()):
            s = int(row[at.ELEMENT])
            ends, begins = (
                row[at.FROM] > 0.0 and row[at.TO] == 0.0,
                row[at.FROM] == 0.0 and row[at.TO] > 0.0,
            )
            if s in self.open and t > 0.0:
                force, pace, change = self.flow.at_instant(t, s, self.acting)
            else:
                force, pace, change = -np.inf, 0.0, np.zeros(self.flow.columns)
            before = self.flow.impulse[s].copy()
            self.acting, last = cross(self.flow, t, row, self.acting, float(self.asked.span[s]), last)
            if s in self.open:
                self.open[s].offer(force, change + pace * last)
            if ends and s in self.open:
                one = self.open.pop(s)
                one.exit, one.impulse = last, self.flow.impulse[s] - one.before
            if begins:
                self.open[s] = _Contact(s, last, before)
                self.contacts.append(self.open[s])
            if s in self.open and self.acting.segment[s]:
                force, pace, change = self.flow.at_instant(t, s, self.acting)
                self.open[s].offer(force, change + pace * last)

    def _pass(self, stretch: Stretch) -> None:
        """One stretch, by panels or by flights."""
        if not stretch.panels:
            for a, b in zip(stretch.edges, stretch.edges[1:], strict=False):
                self.flow.fly(b - a)
                self._keep(b)
            return
        inside = list(stretch.edges[1:-1])
        places = list(stretch.panels[0].clock.place(stretch.edges[1:-1]))
        for panel in stretch.panels:
            changes = self.flow.pass_panel(panel, self.acting)
            self._look(panel, changes, self.acting)
            while places and places[0] <= panel.high:
                self._keep(inside.pop(0))
                places.pop(0)
        self._keep(stretch.end)

    def _look(self, panel: Any, changes: dict[int, tuple[Array, Array]], acting: Acting) -> None:
        """Peaks within a panel, and how rough the derivatives are there."""
        for s, (change, forces) in changes.items():
            bent = self.flow.bend(panel.times, s, acting)
            if bent is not None:
                places = panel.low + (panel.high - panel.low) * zeros(bent)
                self.bends += panel.clock.time(np.clip(places, 0.0, 1.0)).tolist()
            along = forces.transpose(1, 0, 2)
            size = np.abs(along).max(axis=(0, 1))
            tail = np.abs(coefficients(along)[-2:]).max(axis=(0, 1))
            scale = self._sizes.setdefault(s, np.zeros(len(size)))
            np.maximum(scale, size, out=scale)
            self.flow.roughness = max(self.flow.roughness, float((tail / np.where(scale > 0.0, scale, 1.0)).max()))
            if s in self.open:
                values = self.flow.force(panel.times, s, acting)
                if values.max() > _NEAR_TOP * self.open[s].top:
                    within = [
                        end for end, at_event in ((0.0, panel.low == 0.0), (1.0, panel.high == 1.0)) if not at_event
                    ]
                    place, top = largest(values, within)
                    self.open[s].offer(top, interpolated(place, change))

    @property
    def _sizes(self) -> dict[int, Array]:
        """Largest changes of each force so far."""
        return self.__dict__.setdefault("sizes", {})

    def _of_contacts(self, log: ContactLog) -> tuple[Array, Array, Array, Array]:
        """Entries, exits, peak forces and impulses in the order of the log."""
        found = np.full((4, len(log)), np.nan)
        for s in set(log.stop.tolist()):
            rows = np.flatnonzero(log.stop == s)
            mine = [one for one in self.contacts if one.stop == s]
            for place, one in zip(rows[np.argsort(log.t_in[rows], kind="stable")], mine, strict=True):
                values = one.entry, one.exit, one.peak, one.impulse
                found[:, place] = [np.nan if value is None else value[-1] for value in values]
        entries, exits, peaks, impulses = found
        return entries, exits, peaks, impulses

    def _growth(self) -> float:
        """Largest factor from start to end in the norm of energy, of a spring that makes rigid motion count."""
        system, duration = self.asked.system, self.asked.duration
        M, K = dense(system.M), dense(system.K)
        n, stiff = system.size, K + M / duration**2
        norm = np.block([[_root(stiff), np.zeros((n, n))], [np.zeros((n, n)), _root(M)]])
        by_start = self.flow.state[:, : 2 * n]
        return float(np.linalg.norm(norm @ by_start @ np.linalg.inv(norm), 2))


def _root(matrix: Array) -> Array:
    """Square root of a symmetric matrix, negative eigenvalues by their size."""
    values, vectors = np.linalg.eigh(matrix)
    values = np.abs(values)
    return np.asarray((vectors * np.sqrt(np.maximum(values, 1e-12 * values.max()))) @ vectors.T)
