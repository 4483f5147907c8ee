"""What looks wrong with duration and output steps, beside the frequencies of a model."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from fembeam.excitation import Record
from fembeam.model import Model
from fembeam.scene import persistent_drive, signals_of

FEWEST_PERIODS = 3.0  # of the lowest mode that swings, in a run
FEWEST_SAMPLES = 8  # of a record, as many as make one


def of_run(model: Model, duration: float | None, dt: float | None, discard: float) -> Iterator[str]:
    """Duration, sampling and transient of a run; None: not known."""
    fastest = float(model.omega.max())
    if dt is not None and dt * fastest > math.pi:
        yield (f"dt = {dt:g} s samples the highest mode kept less than twice a period, spectra are folded: "
               f"take {math.pi / (2 * fastest):.1g} s or less")  # fmt: skip
    if duration is None:
        return
    yield from _of_records(model, duration)
    moving = model.omega[model.omega > 1e-6 * max(fastest, 1e-9)]
    period = 2 * math.pi / float(moving.min()) if len(moving) else 0.0
    if duration < FEWEST_PERIODS * period:
        yield (f"duration = {duration:g} s is {duration / period:.2g} periods of the lowest mode, {period:.3g} s each: "
               "is it long enough?")  # fmt: skip
    decay = model.zeta * model.omega
    slowest = float(decay[decay > 0].min()) if np.any(decay > 0) else math.inf
    if discard < 3 / slowest < 0.5 * duration and persistent_drive(model.scene):
        yield f"discard = {discard:g} s keeps the transient in statistics: it lasts about {3 / slowest:.2g} s"


def _of_records(model: Model, duration: float) -> Iterator[str]:
    """Records of whose samples a run sees too few."""
    for path, signal in signals_of(model.scene).items():
        seen = int(np.sum(signal.t <= duration)) if isinstance(signal, Record) else FEWEST_SAMPLES
        if seen < FEWEST_SAMPLES:
            yield (f"{path}: a run of {duration:g} s sees {seen} of {signal.t.size} samples of the record, which lasts "
                   f"{signal.duration:.4g} s: is its time in ms?")  # fmt: skip
