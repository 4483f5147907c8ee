"""A long run cut into segments: from where, how long, under which signals."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fembeam.excitation import BandNoise
from fembeam.model import Model, Run
from fembeam.model.initial_states import follow, split_start
from fembeam.scene import signals_of
from fembeam.statistics.initial_transient import FEWEST_BATCHES
from fembeam.study.decay import correlation_time
from fembeam.study.realisations import child, continued, noises, renewed
from fembeam.support import numbers
from solvers.problem.whole_runs import whole_runs

Vector = NDArray[np.float64]

# In correlation times of the structure, after n of which e^-n of what came before is left:
LEAD_IN = 10.0  # left out at the start of a run, where the transient dies out
RENEWAL = 5.0  # left out at the start of a segment whose noise was renewed
SEGMENT = 400.0  # length of a segment at most
SHORTEST = 8.0  # length of a realisation of noise at least
LONGEST = 100.0  # length of a realisation of noise at most, but for long segments of its spectrum: RENEWAL costs 5 %

BATCHES = 8  # parts of a segment, for standard errors: 50 correlation times each; a realisation of noise is one part
REALISATIONS = 16  # of noise that a run holds at least, fewer where they would be shorter than SHORTEST
MOST_SAMPLES = 2_000_000  # samples of a segment with its lead-in at most
FEWEST_SAMPLES = 64  # samples that a run keeps at least
REACHED = "index", "dropped", "taken", "kept", "discarded", "time", "seconds"  # fields that a checkpoint keeps


@dataclass(frozen=True, eq=False)
class Segment:
    """One segment: its run and what of it counts, from `start` on."""

    run: Run
    start: float  # s
    end: int  # index of the last sample that counts
    batches: int


@dataclass
class Segments:
    """State of a long run: time, plan of the segments, sums."""

    model: Model
    duration: float
    dt: float
    state: Vector  # without what follows supports: their motion is another one in a segment of renewed noise
    solver: Any
    correlation_time: float
    repeats: bool  # more than one segment is possible
    random: bool
    first_lead: float
    longest: float
    batches: int  # of a segment
    shortest: float  # s of a realisation
    index: int = 0
    dropped: int = 0
    taken: int = 0  # batches
    kept: float = 0.0
    discarded: float = 0.0
    time: float = 0.0
    seconds: float = 0.0

    @classmethod
    def of(
        cls, model: Model, duration: float, dt: float, discard: float | None, start: Any, solver: Any, segment: int
    ) -> Segments:
        """The plan for a model; a realisation holds two half-overlapping segments (samples) of the spectrum."""
        state = model.rest() if start is None else numbers("start", start, "stationary", "give (2n,) numbers")
        split_start(model, state)  # checks it
        tau = correlation_time(model, lambda seconds: _pilot(model, seconds, dt, state, solver), duration)
        found = list(signals_of(model.scene).values())
        repeats = _repeat(found)
        random = bool(noises(model))
        longest = _longest(found, tau, dt) if repeats else math.inf
        shortest = max(SHORTEST * tau, (1.5 * segment + 2.0) * dt)
        if repeats and random:
            most = max(LONGEST * tau, 8.0 * segment * dt)
            longest = min(longest, _realisation(duration, shortest, most, dt))
        check_duration(found, duration, dt, discard, tau)
        short = max(0.0, FEWEST_BATCHES * tau - longest)  # of what the transient is looked for in
        lead = LEAD_IN * tau + short if discard is None else discard
        batches = 1 if repeats and random else BATCHES
        state = _shifted(state, -follow(model))
        return cls(model, duration, dt, state, solver, tau, repeats, random, lead, longest, batches, shortest)

    def pieces(self) -> Iterator[Segment]:
        """Segment after segment until the duration is reached."""
        if not self.repeats:
            if self.index:  # kept in a checkpoint
                return
            run = self._run(self.duration)
            yield Segment(run, self.first_lead, self._border(run, self.first_lead), self.batches)
            return
        while self.duration - self.kept > (1.0 + 1e-9) * self.dt:  # less may hold no sample
            lead = self.first_lead if self.index == 0 else RENEWAL * self.correlation_time * self.random
            wanted = min(self.longest, self.duration - self.kept)
            batches = max(1, round(self.batches * wanted / min(self.longest, self.duration)))
            run = self._run(math.ceil((lead + wanted) / self.dt - 1e-9) * self.dt)
            yield Segment(run, lead, self._border(run, lead), batches)

    @whole_runs()
    def _run(self, duration: float) -> Run:
        """One segment from the state reached."""
        i = self.index + self.dropped
        model, later = self.model, partial(continued, time=self.time, duration=duration)
        if self.repeats:  # all changes at once: each makes another scene and system
            model = renewed(model, lambda _, seed: child(seed, i), later)
        model = model.for_duration(duration)
        run = model.go_on(duration, self.dt, _shifted(self.state, follow(model)), self.solver)
        self.seconds += run.cost.seconds
        return run

    def _border(self, run: Run, lead: float) -> int:
        """The last sample that counts: the end under noise and with memory, else the last one outside every contact.

        It lies in the second half of what is not lead-in, or is the end.
        """
        last, log = len(run.t) - 1, run.contacts
        half = (last + math.ceil(lead / self.dt - 1e-9)) // 2
        assert run.end is not None
        if self.random or run.end.size > 2 * run.q.shape[1]:  # what laws have latched is known at the end alone
            return last
        order = np.argsort(log.t_in)
        t_in, t_out = log.t_in[order], np.where(np.isnan(log.t_out), np.inf, log.t_out)[order]
        for i in range(last, half, -1):
            before = t_in < run.t[i]
            if not np.any(t_out[before][-64:] > run.t[i]):
                return i
        return last

    def drop(self, piece: Segment) -> None:
        """Count a whole segment as transient."""
        self.dropped += 1
        self._go_on(piece)
        self.discarded += self.dt * piece.end

    def keep(self, piece: Segment, kept: float) -> None:
        """Count a segment that the statistics use."""
        self.index, self.taken = self.index + 1, self.taken + piece.batches
        self.kept += kept
        self._go_on(piece)
        self.discarded += self.dt * piece.end - kept

    def arrays(self) -> dict[str, Vector]:
        """How far it came, to be kept in a file."""
        return {"state": self.state, "reached": np.array([getattr(self, name) for name in REACHED], dtype=np.float64)}

    def take(self, arrays: Mapping[str, Vector]) -> None:
        """Go on from the `arrays` of another one of the same plan."""
        self.state = np.array(arrays["state"])
        for name, value in zip(REACHED, arrays["reached"].tolist(), strict=True):
            setattr(self, name, int(value) if name in REACHED[:3] else value)

    def _go_on(self, piece: Segment) -> None:
        """Continue from the border of a segment."""
        run, whole = piece.run, piece.end == len(piece.run.t) - 1
        assert run.end is not None
        assert run.model is not None
        state = run.end if whole else np.concatenate((run.q[piece.end], run.q_dot[piece.end]))
        t = self.dt * piece.end
        taken = run.loads_taken(np.array([t])) if run.loads_taken else None
        self.state = _shifted(state, -follow(run.model, t, taken))
        self.time += t


def _shifted(state: Vector, motion: Vector) -> Vector:
    """A start with another motion of what follows supports; what laws have latched stays."""
    return np.concatenate((state[: motion.size] + motion, state[motion.size :]))


def check_duration(found: list[Any], duration: float, dt: float, discard: float | None, tau: float) -> None:
    """Raise ValueError for a run that is too short to see the transient die out, or that is discarded whole."""
    repeats = _repeat(found)
    least = LEAD_IN * tau * (not repeats) + FEWEST_BATCHES * tau
    if not repeats and discard is not None and discard > duration - FEWEST_SAMPLES * dt:
        raise ValueError(
            f"discard must leave at least {FEWEST_SAMPLES} samples of the duration of {duration:g} s, got "
            f"{discard:g} s; a record, or what else cannot be continued, is run once, transient included"
        )
    if discard is None and duration < least:
        raise ValueError(
            f"duration must be at least {least:.4g} s, {least / tau:.0f} correlation times of the "
            f"structure, to see whether the transient has died out, got {duration:g} s; simulate longer, or give "
            "discard="
        )


def _repeat(found: list[Any]) -> bool:
    """Whether all signals can be continued."""
    return all(isinstance(s, BandNoise) or hasattr(s, "tones") for s in found)


@whole_runs()
def _pilot(model: Model, duration: float, dt: float, state: Vector, solver: Any) -> Run:
    """A run by which the level of the motion is seen."""
    return model.go_on(math.ceil(duration / dt - 1e-9) * dt, dt, state, solver)


def _longest(found: list[Any], tau: float, dt: float) -> float:
    """Seconds of a segment at most, under signals that can be continued."""
    asked = [s.period or math.inf for s in found if isinstance(s, BandNoise) and s.period_was_given]
    longest = min(SEGMENT * tau, *(s - LEAD_IN * tau for s in (MOST_SAMPLES * dt, *asked)))
    if not longest > FEWEST_BATCHES * tau:
        raise ValueError(
            f"a segment needs {(LEAD_IN + FEWEST_BATCHES) * tau:.4g} s of its own noise and at most "
            f"{MOST_SAMPLES} samples; lengthen the period of the noise, or dt = {dt:g} s"
        )
    return longest


def _realisation(duration: float, shortest: float, most: float, dt: float) -> float:
    """Seconds of a realisation, so that the run holds a whole number of them, sixteen at least where possible."""
    count = max(min(REALISATIONS, int(duration / shortest)), math.ceil(duration / most), 1)
    return math.ceil(duration / count / dt - 1e-9) * dt
