"""A long run cut into stretches: from where, how long, under which signals."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fembeam.excitation import BandNoise
from fembeam.model import Model
from fembeam.run import Run
from fembeam.signals import signals_of, with_signals
from fembeam.statistics.transient import FEWEST_BATCHES
from fembeam.study.realisation import child, noises, renewed, shifted

Vector = NDArray[np.float64]

LEAD_IN = 10.0  # memory times: what came before has fallen to e^-10
STRETCH = 400.0  # memory times kept of a stretch: the lead-in costs 2.5 %
MOST_SAMPLES = 2_000_000  # of a stretch


def memory(model: Model) -> float:
    """Time constant 1/min(ζω) of the slowest decay of the linear structure, s."""
    system = model.system
    n = len(system.M)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(system.M, np.hstack((system.K, system.C)))]])
    decay = -np.linalg.eigvals(A).real
    if not decay.min() > 1e-9 * np.abs(A).max():
        raise ValueError(
            f"a stationary response needs damping in every mode; the slowest decays at {decay.min():.3g} 1/s"
        )
    return 1.0 / float(decay.min())


@dataclass(frozen=True, eq=False)
class Stretch:
    """One stretch: its run and what of it counts, from `begin` on."""

    run: Run
    begin: float
    end: int  # index of the last sample that counts


@dataclass
class Stretches:
    """Where the long run stands."""

    model: Model
    duration: float
    dt: float
    state: Vector
    solver: Any
    memory: float
    repeats: bool  # more than one stretch is possible
    random: bool
    first_lead: float
    longest: float
    index: int = 0
    dropped: int = 0
    kept: float = 0.0
    discarded: float = 0.0
    time: float = 0.0
    seconds: float = 0.0

    @classmethod
    def of(cls, model: Model, duration: float, dt: float, discard: float | None, start: Any, solver: Any) -> Stretches:
        """The plan for a model."""
        forgets, found = memory(model), list(signals_of(model.scene).values())
        repeats = all(isinstance(s, BandNoise) or hasattr(s, "tones") for s in found)
        longest = min([STRETCH * forgets, MOST_SAMPLES * dt - LEAD_IN * forgets] if repeats else [math.inf])
        if repeats:
            asked = [s.period or math.inf for s in found if isinstance(s, BandNoise) and s.period_was_given]
            longest = min([longest, *(period - LEAD_IN * forgets for period in asked)])
            if not longest > FEWEST_BATCHES * forgets:
                raise ValueError(
                    f"a stretch needs {(LEAD_IN + FEWEST_BATCHES) * forgets:.4g} s of its own noise and at most "
                    f"{MOST_SAMPLES} samples; lengthen the period of the noise, or dt = {dt:g} s"
                )
        lead = LEAD_IN * forgets if discard is None else discard
        least = LEAD_IN * forgets * (not repeats) + FEWEST_BATCHES * forgets
        if discard is None and duration < least:
            raise ValueError(
                f"duration must be at least {least:.4g} s, {least / forgets:.0f} times the memory of the structure, to "
                f"see whether the transient has died out, got {duration:g} s; simulate longer, or give discard="
            )
        state = model.rest() if start is None else np.array(start, dtype=float)
        return cls(model, duration, dt, state, solver, forgets, repeats, bool(noises(model)), lead, longest)

    def pieces(self) -> Iterator[Stretch]:
        """Stretch after stretch until the duration is reached."""
        if not self.repeats:
            run = self._run(self.duration)
            yield Stretch(run, self.first_lead, self._border(run))
            return
        while self.kept < self.duration - 0.5 * self.dt:
            lead = self.first_lead if self.time == 0.0 else LEAD_IN * self.memory * self.random
            wanted = min(self.longest, self.duration - self.kept)
            run = self._run(math.ceil((lead + wanted) / self.dt - 1e-9) * self.dt)
            yield Stretch(run, lead, self._border(run))

    def _run(self, duration: float) -> Run:
        """One stretch from the state reached."""
        i = self.index + self.dropped
        model = renewed(self.model, lambda _, seed: child(seed, i)) if self.repeats else self.model
        scene = with_signals(model.scene, lambda signal: shifted(signal, self.time))
        run = model.under(scene).simulate(duration, self.dt, self.state, self.solver)
        if not run.complete:
            raise KeyboardInterrupt
        self.seconds += run.cost.seconds
        return run

    def _border(self, run: Run) -> int:
        """The last sample that counts: the end under noise, else the last one outside every contact."""
        last, log = len(run.t) - 1, run.contacts
        if self.random:
            return last
        order = np.argsort(log.t_in)
        t_in, t_out = log.t_in[order], np.where(np.isnan(log.t_out), np.inf, log.t_out)[order]
        for i in range(last, last // 2, -1):
            before = t_in < run.t[i]
            if not np.any(t_out[before][-64:] > run.t[i]):
                return i
        return last

    def drop(self, piece: Stretch) -> None:
        """Leave the whole stretch to the transient."""
        self.dropped += 1
        self._go_on(piece)
        self.discarded += self.dt * piece.end

    def keep(self, piece: Stretch, kept: float) -> None:
        """Count what the statistics took."""
        self.index += 1
        self.kept += kept
        self._go_on(piece)
        self.discarded += self.dt * piece.end - kept

    def _go_on(self, piece: Stretch) -> None:
        """Continue from the border of a stretch."""
        self.state = np.concatenate((piece.run.q[piece.end], piece.run.q_dot[piece.end]))
        self.time += self.dt * piece.end
