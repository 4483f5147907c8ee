"""Many independent realisations of the noise: one value each, their mean and its standard error.

The result depends on the seeds alone: not on the executor, the order of arrival, or interruptions.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from fembeam import plot
from fembeam.model import Model
from fembeam.scene import Scene, signals_of
from fembeam.statistics import Estimate, Spectrum
from fembeam.study.execution.checkpoint import Checkpoint, Values, identity
from fembeam.study.execution.executors import spread
from fembeam.study.measure import require_model
from fembeam.study.realisations import Seed, child, noises, realisation, seed_key
from fembeam.study.result import Result, with_units
from fembeam.study.stationary import characteristics, units_of_characteristics
from fembeam.support import Part, is_whole, note, number, require, titled, warn
from solvers.problem import counted

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIRST_ROUND = 8  # realisations before `until` is asked for the first time


@dataclass(frozen=True)
class Failure:
    """A realisation that failed: its seed and why."""

    seed: Seed
    reason: str


@dataclass(frozen=True, eq=False)
class Ensemble(Result):
    """Values of a quantity over independent realisations.

    Attributes
    ----------
    seeds : of the realisations that succeeded, in the order asked for.
    values : name -> array (n, ...), NaN where a realisation has no such number; a quantity that is one number or array
        has the name "".
    failures : realisations that failed, with seed and reason.
    enough : whether the standard error asked for by `until` was reached; None when none was.
    units : name -> SI unit of the values of `characteristics`, of densities that of their signals; of other quantities
        none are known.
    """

    seeds: tuple[Seed, ...]
    values: dict[str, NDArray[Any]]
    failures: tuple[Failure, ...] = ()
    enough: bool | None = None
    title: str = ""  # of the figure
    units: Mapping[str, str] = field(default_factory=dict)
    INDEX: ClassVar[str] = "seed"

    def __len__(self) -> int:
        return len(self.seeds)

    def __getitem__(self, name: str) -> Estimate:
        """Mean of one named value over the realisations that have it, with its standard error."""
        if name not in self.values:
            raise KeyError(f"the quantity has no {name!r}; it has {', '.join(map(repr, self.values))}")
        values = self.values[name]
        known = ~np.isnan(values) if values.ndim == 1 else np.full(len(values), True)
        known |= not known.any()
        parts = tuple(seed_key(seed) for seed, kept in zip(self.seeds, known, strict=True) if kept)
        return replace(Estimate.of_mean(values[known]), parts=parts)

    def __repr__(self) -> str:
        failed = f", {len(self.failures)} failed" if self.failures else ""
        return f"<ensemble of {counted(len(self), 'realisation')}{failed}>"

    @property
    def _numbers(self) -> list[str]:
        """Names of what is one number in each realisation."""
        return [name for name, values in self.values.items() if values.ndim == 1]

    def _parts(self) -> list[Part]:
        """Means and standard errors of the named numbers, one a line."""
        head = counted(len(self), "realisation") + (f", {len(self.failures)} failed" if self.failures else "")
        names = with_units(self._numbers, [self.units.get(name, "") for name in self._numbers])
        rows = [(shown, repr(self[name])) for shown, name in zip(names, self._numbers, strict=True)]
        return [head, (("", "mean ± standard error"), rows)]

    def _units(self) -> dict[str, str]:
        return dict(self.units)

    def table(self) -> list[dict[str, Any]]:
        """One realisation a row: its seed and the named numbers."""
        rows = zip(self.seeds, *(self.values[name] for name in self._numbers), strict=True)
        columns = "seed", *(name or "value" for name in self._numbers)
        return [dict(zip(columns, (seed_key(seed), *row), strict=True)) for seed, *row in rows]

    def plain(self) -> dict[str, Any]:
        """Means with their standard errors, and what failed, as JSON has it, which has no complex numbers."""
        means = {name: self[name] for name in self._numbers if not np.iscomplexobj(self.values[name])}
        return {
            "realisations": len(self),
            "enough": self.enough,
            "failures": [{"seed": str(one.seed), "reason": one.reason} for one in self.failures],
            "units": "SI: m, s, N, rad/s",
            "numbers": {
                name: {"mean": float(one.value), "standard_error": float(one.standard_error)}
                for name, one in means.items()
            },
        }

    def figure(self) -> Figure:
        """Mean spectra with their confidence, of an ensemble of `characteristics`; ValueError without spectra."""
        lines = [name for name in self.values if name.endswith(" psd")]
        require(bool(lines), "the values must hold spectra", list(self.values), "Ensemble.figure",
                "use characteristics as the quantity")  # fmt: skip
        omega = self.values["omega"][0]
        spectra = {
            n: Spectrum(omega, self[n].value, 0, np.asarray(self[n].standard_error), unit=self.units.get(n, ""))
            for n in lines
        }
        return plot.random_spectra({self.title or counted(len(self), "realisation"): spectra}, float(omega[-1]))

    @property
    def mean(self) -> Estimate:
        """Mean of a quantity that is one number or array, with its standard error."""
        return self[""]


def ensemble(
    model: Model,
    seeds: int | Sequence[Seed],
    quantity: Callable[[Model], Any],
    executor: Executor | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
    *,
    until: float | None = None,
    progress: bool = False,
) -> Ensemble:
    """Evaluate a quantity for independent realisations of a model's noise.

    Parameters
    ----------
    model : with at least one `BandNoise` among base motion, forces and feet; noises of one seed stay one realisation.
    seeds : how many, or the seeds themselves, none twice. A number spawns them from the noise's own seed
        (`numpy.random.SeedSequence`), so that a longer ensemble contains a shorter one. Noise number j of the model
        takes child j of a seed: of ``seeds=[5]`` the first is ``BandNoise(…, seed=SeedSequence(5, spawn_key=(0,)))``.
    quantity : of the model under one realisation: a number, an array, or a mapping of names to these, None for a number
        that a realisation does not have, such as the mean over contacts where there was none. For example
        ``partial(fb.study.characteristics, duration=100.0, dt=1e-3)`` or
        ``lambda model: model.simulate(50.0).contacts.peak_force.max()``.
    executor : any `concurrent.futures.Executor`; processes need a quantity that can be pickled (no lambda).
    checkpoint : file that keeps each realisation; when it exists, what it holds is not computed again. It is
        refused when scene, modes, fembeam's version, or the code of the quantity, of a law or of anything they read
        (functions, closures, globals, arguments) has changed. Files and the environment that these read are not seen.
    until : stop when the relative standard error of every mean that there is lies below it; asked after 8, 16, 32, …
        realisations in the order of the seeds, whatever the executor.
    progress : show a bar (on terminals and in notebooks only).

    Returns
    -------
    Ensemble : what failed is in `failures`, and warned of; the rest survives.

    Raises
    ------
    ValueError : no noise, a seed twice, a checkpoint of another study (with what differs), a quantity that reads
        what cannot be told apart (an open file, a lock) with a checkpoint, values of another shape.
    RuntimeError : every realisation failed, or the executor is gone; finished realisations are in the checkpoint.

    Examples
    --------
    >>> import fembeam as fb
    >>> scene = fb.Scene(fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01)), [fb.Clamped(0.0)],
    ...                  damping=fb.ModalDamping(0.05), base=fb.BandNoise(1e-5, (0.0, 400.0), seed=1))
    >>> tip = lambda model: model.simulate(5.0, 1e-2).displacement(0.5).std()
    >>> found = ensemble(scene.reduce(modes=1), 8, tip)
    >>> len(found), found.mean.relative < 0.2
    (8, True)
    """
    require_model(model, "ensemble")
    require(callable(quantity), "quantity must be a function of a model", quantity, "ensemble",
            "e.g. lambda model: model.simulate(50.0).contacts.peak_force.max()")  # fmt: skip
    chosen = _seeds(model, seeds)
    if until is not None and not 0.0 < number("until", until, above=0.0) < 1.0:
        raise ValueError(f"until must be a relative standard error below 1, got {until!r}")
    kept = Checkpoint(checkpoint, partial(identity, model, quantity))
    failed: dict[str, Failure] = {}
    for count in _rounds(len(chosen), until):
        missing = [seed for seed in chosen[:count] if seed_key(seed) not in {*kept.values, *failed}]
        with kept:
            _compute(partial(_value, model, quantity), missing, kept, failed, executor, progress)
        found = replace(_collected(chosen[:count], kept, failed, until), units=_units_of(quantity, model))
        note("%r, %d of them computed now", found, len(missing))
        if found.enough:
            break
    if found.failures:
        first = found.failures[0]
        message = f"{len(found.failures)} of {count} realisations failed; seed {seed_key(first.seed)}: {first.reason}"
        warn(message)
    return found


def _units_of(quantity: Callable[[Model], Any], model: Model) -> dict[str, str]:
    """Units of the values of a quantity: those of `characteristics` are known."""
    if not (isinstance(quantity, partial) and quantity.func is characteristics):
        return {}
    return units_of_characteristics(model, quantity.keywords.get("watch"))


def _compute(
    task: Callable[[Seed], Values | Failure],
    seeds: list[Seed],
    kept: Checkpoint,
    failed: dict[str, Failure],
    executor: Executor | None,
    progress: bool,
) -> None:
    """Values of these seeds, into the checkpoint as they come."""

    def seen(index: int, result: Values | Failure) -> None:
        key = seed_key(seeds[index])
        if isinstance(result, Failure):
            failed[key] = result
        else:
            _check_alike(result, kept, key)
            kept.add(key, result)

    try:
        spread(task, seeds, executor, titled(progress, "realisations"), seen)
    except (ValueError, OSError):
        raise
    except Exception as error:  # failures of a realisation do not come this way
        where = "" if kept.path is None else f"; finished ones are in {kept.path}, call again to go on"
        raise RuntimeError(
            f"the executor failed with {len(kept.values)} realisations finished: {type(error).__name__}: {error}{where}"
        ) from error


def _value(model: Model, quantity: Callable[[Model], Any], seed: Seed) -> Values | Failure:
    """The quantity of one realisation as arrays; what it raises becomes a `Failure`."""
    try:
        found = quantity(realisation(model, seed))
        named = found if isinstance(found, Mapping) else {"": found}
        values = {str(name): _array(name, value) for name, value in named.items()}
    except Exception as error:
        return Failure(seed, f"{type(error).__name__}: {error}")
    return values


def _array(name: str, value: Any) -> NDArray[Any]:
    """A value as finite floats (complex numbers stay complex), NaN of one that there is not."""
    if value is None:
        return np.array(math.nan)
    raw = np.asarray(value.value if isinstance(value, Estimate) else value)
    label = f" {name!r}" if name else ""
    if raw.dtype.kind not in "biufc":
        raise TypeError(f"the quantity{label} must be a number or an array of numbers, got {type(value).__name__}")
    array = raw.astype(np.complex128 if raw.dtype.kind == "c" else np.float64)
    if not np.isfinite(array).all():
        raise ValueError(f"the quantity{label} is {array[~np.isfinite(array)][0]}")
    return array


def _check_alike(values: Values, kept: Checkpoint, key: str) -> None:
    """All realisations give the same names and shapes."""
    first = next(iter(kept.values.values()), values)
    mine, theirs = ({name: v.shape for name, v in one.items()} for one in (values, first))
    if mine != theirs:
        raise ValueError(f"the quantity must have one form; seed {key} gave {mine}, another one {theirs}")


def _collected(seeds: Sequence[Seed], kept: Checkpoint, failed: dict[str, Failure], until: float | None) -> Ensemble:
    """The ensemble in the order of the seeds."""
    good = [seed for seed in seeds if seed_key(seed) in kept.values]
    failures = tuple(failed[seed_key(seed)] for seed in seeds if seed_key(seed) in failed)
    if not good:
        raise RuntimeError(f"every realisation failed; seed {seed_key(failures[0].seed)}: {failures[0].reason}")
    rows = [kept.values[seed_key(seed)] for seed in good]
    values = {name: np.stack([row[name] for row in rows]) for name in rows[0]}
    found = Ensemble(tuple(good), values, failures)
    if until is None:
        return found
    asked = [name for name, value in values.items() if value.ndim != 1 or not np.isnan(value).all()]
    return replace(found, enough=all(found[name].relative <= until for name in asked))


def _rounds(count: int, until: float | None) -> list[int]:
    """After how many realisations to look: at 8, 16, 32, … with `until`, and at the end."""
    looks = [] if until is None else [FIRST_ROUND << i for i in range(40) if FIRST_ROUND << i < count]
    return [*looks, count]


def check_noise(scene: Scene) -> None:
    """Raise ValueError for a scene without noise."""
    if not any(hasattr(signal, "seed") for signal in signals_of(scene).values()):
        raise ValueError(
            "an ensemble needs a BandNoise as base motion, force or foot; without it all realisations are equal"
        )


def _seeds(model: Model, seeds: int | Sequence[Seed]) -> list[Seed]:
    """The seeds of the realisations, checked."""
    check_noise(model.scene)
    own = noises(model)
    if is_whole(seeds):
        if seeds < 1:
            raise ValueError(f"seeds must be a number of at least 1 or a list of seeds, got {seeds}")
        return [child(own[0], i) for i in range(int(seeds))]
    if isinstance(seeds, (bool, str, np.random.SeedSequence)) or not hasattr(seeds, "__iter__"):
        raise ValueError(f"seeds must be a number of at least 1 or a list of seeds, got {seeds!r}")
    chosen = [_seed(seed) for seed in seeds]
    first: dict[str, int] = {}
    for i, seed in enumerate(chosen):
        if seed_key(seed) in first:
            raise ValueError(f"seeds must differ, got {seed_key(seed)} at {first[seed_key(seed)]} and at {i}")
        first[seed_key(seed)] = i
    if not chosen:
        raise ValueError("seeds must not be empty")
    return chosen


def _seed(seed: Any) -> Seed:
    """One seed, checked."""
    whole = is_whole(seed) and seed >= 0
    if not whole and not isinstance(seed, np.random.SeedSequence):
        raise ValueError(f"a seed must be an integer of at least 0 or a SeedSequence, got {seed!r}")
    return int(seed) if whole else seed
