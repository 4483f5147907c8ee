"""A run divided at its events: which elements act in between, with which latched numbers, on which panels."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby, pairwise
from typing import Any

import numpy as np

from solvers.compiled.state import law_parameters
from solvers.problem import Array, Solution, System, counted, dense
from solvers.problem import event_list as at
from solvers.sensitivities import laws
from solvers.sensitivities.elements import Slider, motion_of
from solvers.sensitivities.panels import Clock, Panels
from solvers.sensitivities.sampled import SampledLoads

_RADIANS = 1.5  # of the fastest motion in one panel
_FEWEST = 2  # panels between two events while elements act
_MOST_OF_DECAY = 1000  # panels between two events for damping: where they are too few it has decayed long ago
_MOST_WORK, _BESIDE = 25_000_000, 5  # panels × (blocks + these) above which a run is refused: minutes
_MOST_KEPT = 1 << 22  # numbers of the run's motion that are held at once


@dataclass(frozen=True, eq=False)
class Acting:
    """What acts between two events: the segment of each element's law (0: none), its entry rate, its parameters."""

    segment: tuple[int, ...]
    entry_rate: tuple[float, ...]
    rows: tuple[Array, ...]

    @property
    def elements(self) -> list[int]:
        """The elements that act."""
        return [s for s, segment in enumerate(self.segment) if segment > 0]

    def changed(self, s: int, **new: Any) -> Acting:
        """A copy with other values of one element."""
        return replace(self, **{
            name: tuple(value if i == s else old for i, old in enumerate(getattr(self, name)))
            for name, value in new.items()
        })  # fmt: skip


@dataclass(frozen=True, eq=False)
class Stretch:
    """The time from one event to the next: what acts, and its panels; None in a flight that only the state changes."""

    start: float
    end: float
    acting: Acting
    panels: Panels | None = None

    @property
    def times(self) -> list[Array]:
        """Times at which the motion is needed."""
        ends = np.array([self.start, self.end])
        return [ends] if self.panels is None else [ends, self.panels.times.ravel()]


def acting_at_start(system: System, x: Array, rows: Array, memory: Sequence[Any] | None) -> Acting:
    """What acts at t = 0, before the events at that time."""
    begun = {int(row[at.ELEMENT]): row for row in rows if row[at.GUARD] == at.BEGIN}
    segment, entry_rate, parameters = [], [], list(law_parameters(system))
    for s, contact in enumerate(system.contacts):
        law: Any = contact.law
        motion = motion_of(contact, *np.split(x[:, None], 2))
        begin = begun.get(s)
        known = begin[at.TO] if begin is not None else 0.0
        above = sum(motion.delta[0] > knot for knot in law.knots)
        segment.append(1 + above if contact.always else int(known))
        entry_rate.append(max(abs(motion.rate[0]), law.entry_rate_floor))
        if memory is not None and memory[s] is not None:
            parameters[s][contact.memory] = memory[s]
    return Acting(tuple(segment), tuple(entry_rate), tuple(parameters))


def rises(row: Array) -> bool:
    """Whether a knot or the surface is crossed inwards, by the segments, or if they are equal by δ̇."""
    before, behind = row[at.FROM], row[at.TO]
    return bool(behind > before if behind != before else row[at.RATE] > 0.0)


def after(system: System, acting: Acting, row: Array) -> Acting:
    """What acts after an event."""
    s, guard, rate = int(row[at.ELEMENT]), row[at.GUARD], row[at.RATE]
    law: Any = system.contacts[s].law
    if guard == at.BEGIN:
        return acting
    if row[at.FROM] == 0.0 and row[at.TO] > 0.0:
        acting = acting.changed(s, entry_rate=max(abs(rate), law.entry_rate_floor))
    if guard == at.KNOT:
        return acting.changed(s, segment=acting.segment[s] + (1 if rises(row) else -1))
    slider = Slider.of(system.contacts[s], acting.rows[s])
    if slider is not None:
        return acting.changed(s, rows=slider.renewed(acting.rows[s], row))
    return acting.changed(s, rows=laws.renewed(law, acting.rows[s], int(guard), row[at.DELTA], rate))


def grouped(rows: Array) -> dict[float, list[Array]]:
    """Events by their times."""
    return {float(t): list(group) for t, group in groupby(rows, key=lambda row: row[at.TIME])}


@dataclass(frozen=True)
class Depths:
    """Largest indentations of an element's contacts, the last one that of a contact that has not ended."""

    ends: Array
    depths: Array

    @classmethod
    def of(cls, contact: Any, rows: Array, t: Array, delta: Array, least: float) -> Depths:
        """From the element's events and its δ at times of the run; of an element that always acts one for the run."""
        ends = at.ends_of(rows[:0] if contact.always else rows)
        left = np.abs(delta) if contact.always else delta[t > ends[:, at.TIME].max(initial=-np.inf)]
        found = np.append(ends[:, at.DEEPEST], left.max(initial=0.0))
        return cls(ends[:, at.TIME], np.fmax(found, least))

    def after(self, t: float) -> float:
        """That of the contact under way behind t, m."""
        return float(self.depths[np.searchsorted(self.ends, t, side="right")])


class Division:
    """Divides a run into stretches, with panels fine enough for its modes, its laws and its loads."""

    def __init__(
        self, system: System, forced: bool, depths: Sequence[Depths], bends: Array, sampled: SampledLoads
    ) -> None:
        self.system, self.forced, self.depths, self.bends, self.sampled = system, forced, depths, bends, sampled
        self.k, self.c, self.rows = system.blocks.k, system.blocks.c, law_parameters(system)
        tones = [signal.tones()[0] for _, signal in system.loads if hasattr(signal, "tones")] if forced else []
        speeds = np.sqrt(np.abs(self.k)), np.abs(self.c), *(np.abs(np.asarray(tone, float)) for tone in tones)
        self.fastest = max((float(one.max(initial=0.0)) for one in speeds), default=0.0)
        M = dense(system.M)
        self.mobility = [float(np.linalg.norm(x.rows @ np.linalg.solve(M, x.rows.T), 2)) for x in system.contacts]
        self.panels = 0  # of all stretches so far, before they are refined

    def _speed(self, s: int, start: float, end: float, entry_rate: float) -> float:
        """Estimated frequency of an element alone on the system's mass, rad/s, with its decay as far as it lasts."""
        contact, mobility = self.system.contacts[s], self.mobility[s]
        places = self.depths[s].after(start) * np.linspace(0.05, 1.0, 7)
        places = np.concatenate((-places, places)) if contact.always else places
        found = laws.slopes(contact.law, self.rows[s], (places, 0.0 * places), entry_rate)
        stiffness, damping = (float(np.nanmax(np.abs(one), initial=0.0)) for one in found[:2])
        stiffness = max(stiffness, float(contact.friction.stiffness or 0.0) if contact.friction else 0.0)
        return math.sqrt(stiffness * mobility) + min(damping * mobility, _MOST_OF_DECAY * _RADIANS / (end - start))

    def stretches(self, acting: Acting, rows: Array, duration: float, refinement: int) -> Iterator[Stretch]:
        """All stretches in the order of time; events at one time are applied together."""
        events = grouped(rows)
        marks = [0.0, *(t for t in events if t > 0.0), duration]
        for start, end in pairwise(marks):
            for row in events.get(start, ()):
                acting = after(self.system, acting, row)
            if end > start:
                yield self._stretch(start, end, acting, refinement)

    def _stretch(self, start: float, end: float, acting: Acting, refinement: int) -> Stretch:
        """One stretch with its panels."""
        if not (acting.elements or self.forced):
            return Stretch(start, end, acting)
        clock = Clock(start, end, max([1, *(_power(self.system.contacts[s]) for s in acting.elements)]))
        stiff = (self._speed(s, start, end, acting.entry_rate[s]) for s in acting.elements)
        speed = max([self.fastest, *stiff])
        count = refinement * (_FEWEST + math.ceil((end - start) * speed / _RADIANS))
        bends = self.bends[(self.bends > start) & (self.bends < end)]
        marks = np.concatenate((bends, self.sampled.edges(start, end)))
        count, own = count + marks.size, count
        self.panels += count // refinement
        if self.panels * (len(self.k) + _BESIDE) > _MOST_WORK:
            raise ValueError(
                f"a sensitivity through motion of {speed:.3g} rad/s takes {self.panels} panels up to t = {end:.6g} s, "
                f"too many for {counted(len(self.k), 'mode')}; keep fewer modes, or shorten the run"
            )
        edges = np.linspace(0.0, 1.0, own + 1)
        if marks.size:
            edges = np.unique(np.concatenate((edges, clock.place(marks))))
        return Stretch(start, end, acting, Panels(self.k, self.c, clock, edges))


def _power(contact: Any) -> int:
    """Power of the clock that makes the force smooth at the ends of a contact: 1 if all its exponents are whole."""
    if contact.always:
        return 1
    powers = np.asarray(getattr(contact.law, "powers", (contact.law.exponent,)), dtype=float)
    if np.all(powers == np.round(powers)):
        return 1
    return 2 if np.all(2.0 * powers == np.round(2.0 * powers)) else 6


def pieces_of(times: Array, size: int) -> list[Array]:
    """Times in pieces at which states of ``size`` coordinates are held at once."""
    most = max(_MOST_KEPT // (2 * size), 1)
    return [times[i : i + most] for i in range(0, max(len(times), 1), most)]


class Motion:
    """The run's own q and q̇ at given times: it is replayed, a piece at a time, as later ones are asked for."""

    def __init__(self, replay: Callable[[Array], Solution], times: Array, size: int) -> None:
        self.replay, self.times, self.size = replay, times, size
        self.first, self.both = 0, np.zeros((2, size, 0))  # of the piece that is held

    def at(self, times: Any) -> Array:
        """(2, n) or (2, n, k) q and q̇ at times that were given."""
        places = np.minimum(np.searchsorted(self.times, times), len(self.times) - 1)
        if places.size and not self.first <= places.min() <= places.max() < self.first + self.both.shape[2]:
            self._hold(int(places.min()), int(places.max()))
        return self.both[..., places - self.first]

    def _hold(self, first: int, last: int) -> None:
        """Replay the piece that begins at one time and holds another."""
        most = max(len(pieces_of(self.times[first:], self.size)[0]), last + 1 - first)
        self.first, self.both = first, np.zeros((2, self.size, 0))  # lets go of the last one
        solution = self.replay(self.times[first : first + most])
        self.both = np.array([solution.q.T, solution.q_dot.T])
