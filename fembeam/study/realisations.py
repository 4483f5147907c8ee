"""The same model under another realisation of its noise, or from a later time on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from fembeam.excitation import Multisine
from fembeam.model import Model
from fembeam.scene import for_duration, signals_of, with_signals

Seed = int | np.random.SeedSequence


def noises(model: Model) -> list[Seed]:
    """Seeds of the noise in a model, each once: signals of one seed are one realisation and stay so."""
    found: dict[Any, Seed] = {}
    for signal in signals_of(model.scene).values():
        if hasattr(signal, "seed"):
            found.setdefault(seed_key(signal.seed), signal.seed)
    return list(found.values())


def seed_key(seed: Seed) -> str:
    """A seed as text, to compare seeds by."""
    if isinstance(seed, np.random.SeedSequence):
        return f"{seed.entropy}{''.join(f'/{i}' for i in seed.spawn_key)}"
    return str(int(seed))


def child(seed: Seed, index: int) -> np.random.SeedSequence:
    """Child number `index` of a seed; unlike `SeedSequence.spawn` it remembers nothing."""
    parent = seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(int(seed))
    return np.random.SeedSequence(parent.entropy, spawn_key=(*parent.spawn_key, index))


def renewed(
    model: Model, seed_of: Callable[[int, Seed], Seed], then: Callable[[Any], Any] = lambda signal: signal
) -> Model:
    """The model with the seed of its noise number j replaced by seed_of(j, seed), and every signal by then(signal)."""
    places = {seed_key(seed): j for j, seed in enumerate(noises(model))}

    def change(signal: Any) -> Any:
        if not hasattr(signal, "seed"):
            return then(signal)
        return then(replace(signal, seed=seed_of(places[seed_key(signal.seed)], signal.seed)))

    return model.under(with_signals(model.scene, change))


def realisation(model: Model, seed: Seed) -> Model:
    """The model under the noise of one seed; several noises get children of it."""
    return renewed(model, lambda j, _: child(seed, j))


def continued(signal: Any, time: float, duration: float) -> Any:
    """The signal from a later time on, for sums of tones, for a run of a duration; noise is not moved."""
    if hasattr(signal, "tones") and time > 0.0:
        omega, amplitude = signal.tones()
        signal = Multisine(np.abs(amplitude), omega, np.angle(amplitude) + omega * time)
    return for_duration(signal, duration)
