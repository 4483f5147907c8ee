"""One model measured: independent values of a quantity, and what they cost.

Three kinds of run give them:

* transient: one run of a given duration, one value, no scatter;
* random: one run per seed of the noise, one value each;
* periodic (no duration given): one long run under periodic loads, settled for 240 drive periods or 14 correlation
  times of the structure, whichever is longer, then cut into groups of twelve drive periods: an orbit of period 1, 2, 3,
  4, 6 or 12 gives ten equal values, a chaotic response ten that scatter.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, fields, replace
from functools import partial
from itertools import pairwise
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

import solvers
from fembeam.model import Model, Run, load_period
from fembeam.response import latched_before, mean_force
from fembeam.scene import Scene, signals_of
from fembeam.study.decay import correlation_time
from fembeam.study.execution.checkpoint import Checkpoint, digested, scene_identity
from fembeam.study.execution.executors import spread
from fembeam.study.quantities import Quantity, check_contact, label
from fembeam.study.realisations import child, renewed, seed_key
from fembeam.support import is_whole, require, require_non_negative, require_positive, warn
from solvers.problem.whole_runs import whole_runs

Vector = NDArray[np.float64]
Start = Callable[[Model], Any]

SETTLING, GROUPS, GROUP = 240, 10, 12  # fewest drive periods before, number of groups, periods in each
SETTLED = 14.0  # correlation times before, at least: what the start left has fallen to e^-14, 1e-6
LONGEST = 100_000  # drive periods before, at most
SAMPLES, FEWEST = 128, 16  # at least: per drive period; per period of its fastest tone and of the lowest mode
MOST = 2048  # per drive period for the lowest mode's sake
FEWEST_SEEDS = 3


def require_model(model: Any, where: str) -> None:
    """Raise ValueError unless it is a model."""
    require(isinstance(model, Model), "model must be a Model", model, where, "scene.reduce(modes=…) makes one")


@dataclass(frozen=True)
class Plan:
    """How every model of a study is run; `fb.study.mode_count` explains the fields."""

    duration: float | None = None
    dt: float | None = None
    discard: float = 0.0
    seeds: Sequence[int] = ()
    start: Start | None = None
    solver: Any = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "seeds", _checked_seeds(self.seeds))
        require(self.start is None or callable(self.start), "start must be a function of a model", self.start, "study",
                "e.g. lambda m: m.state(velocity=…)")  # fmt: skip
        require_non_negative("discard", self.discard, "study", "give s")
        if self.duration is not None:
            require_positive("duration", self.duration, "study", "give s, or None for a periodic response")
            require(self.discard < self.duration, f"discard must be below the duration of {self.duration:g} s",
                    self.discard, "study", "run longer")  # fmt: skip
        if self.dt is not None:
            require_positive("dt", self.dt, "study", "give the output sampling in s")
            longest = math.inf if self.duration is None else self.duration
            require(self.dt <= longest, f"dt must be at most the duration of {longest:g} s", self.dt, "study",
                    "sample more often")  # fmt: skip
        few = 0 < len(self.seeds) < FEWEST_SEEDS
        require(not few, f"seeds must be at least {FEWEST_SEEDS}, for an uncertainty", len(self.seeds), "study",
                "e.g. range(8)")  # fmt: skip

    def check(self, scene: Scene, quantity: Quantity) -> None:
        """Raise ValueError when the scene cannot be run like this."""
        require(isinstance(scene, Scene), "scene must be a Scene", scene, "study", "of a model, give model.scene")
        check_contact(quantity, scene)
        rubs = any(getattr(one, "friction", None) is not None for one in scene.acting)
        require(rubs or not getattr(quantity, "rubbing", False), "a stop must have friction", label(quantity), "study",
                "give it a Friction")  # fmt: skip
        if self.duration is None:
            try:
                load_period(scene)
            except ValueError as error:
                raise ValueError(
                    f"a study without duration needs a periodic response: {error}; or give duration"
                ) from None
            require(not self.seeds, "seeds need a duration", None, "study", "give duration in s")
        else:
            sampled = getattr(quantity, "sampled", True)
            own = "" if hasattr(quantity, "sampled") else "; a function of contacts alone: set its sampled = False"
            require(self.dt is not None or not sampled, f"{label(quantity)} needs samples", "dt = None", "study",
                    f"give dt{own}")  # fmt: skip
        if self.seeds:
            signals = signals_of(scene)
            require(any(hasattr(signal, "seed") for signal in signals.values()), "seeds need noise", signals, "study",
                    "use BandNoise as base, force or foot, or leave out seeds")  # fmt: skip


def _checked_seeds(seeds: Any) -> tuple[int, ...]:
    """Seeds of realisations, none twice: equal ones have no scatter."""
    listed = hasattr(seeds, "__iter__") and not isinstance(seeds, (str, bytes, dict))
    require(listed, "seeds must be a list of seeds", seeds, "study", "e.g. range(8)")
    chosen = tuple(seeds)
    right = all(isinstance(one, np.random.SeedSequence) or (is_whole(one) and one >= 0) for one in chosen)
    require(right, "seeds must be whole numbers of at least 0", chosen, "study", "e.g. range(8)")
    require(len({*map(seed_key, chosen)}) == len(chosen), "seeds must differ", chosen, "study", "e.g. range(8)")
    return chosen


@dataclass(frozen=True, eq=False)
class Measured:
    """Values (k, …) of the quantity and what is worth knowing about the model that gave them.

    `seconds`: integration, all values together; `preparation`: mesh and modes; `share`: least static share of a stop
    or force; `periods`: of the highest frequency in the median contact.
    """

    values: Vector
    coordinates: int
    seconds: float
    preparation: float
    share: float
    periods: float

    @classmethod
    def of(cls, arrays: Mapping[str, Any]) -> Measured:
        """The one whose fields a checkpoint kept as arrays."""
        plain = {name: value if name == "values" else value.item() for name, value in arrays.items()}
        return cls(**plain)

    @property
    def mean(self) -> Vector:
        """Over the independent values."""
        return np.asarray(self.values.mean(axis=0))

    @property
    def value(self) -> float:
        """The mean as one number: of an array its norm over the root of its size."""
        mean = self.mean
        return float(np.linalg.norm(mean) / np.sqrt(mean.size)) if mean.size > 1 else float(mean)


@dataclass(frozen=True)
class Case:
    """One model to be measured: arguments of `Scene.reduce`, plan, quantity, and the solvers to run it with."""

    scene: Scene
    reduce: tuple[tuple[str, Any], ...]
    plan: Plan
    quantity: Quantity
    solvers: tuple[Any, ...]

    def __repr__(self) -> str:
        return ", ".join(f"{name}={value}" for name, value in self.reduce)


def measured(
    cases: Sequence[Case], executor: Executor | None, told: str | None, kept: Checkpoint
) -> list[list[Measured]]:
    """`measure` of each case, spread over an executor; what a checkpoint holds is not measured again."""

    def keys(case: Case) -> list[str]:
        return [f"{case!r}, {solver!r}" for solver in case.solvers]

    def seen(index: int, found: list[Measured]) -> None:
        for key, one in zip(keys(missing[index]), found, strict=True):
            kept.add(key, {name: np.asarray(value) for name, value in vars(one).items()})

    missing = [case for case in cases if not {*keys(case)} <= {*kept.values}]
    spread(measure, missing, executor, told, seen)
    return [[Measured.of(kept.values[key]) for key in keys(case)] for case in cases]


def identity_of(scene: Scene, plan: Plan, quantity: Quantity) -> dict[str, str]:
    """What the measures of a model depend on besides how it is reduced and its solver."""
    told = digested((plan, quantity), "the study", repr({"quantity": label(quantity), "plan": plan}))
    return scene_identity(scene) | {"study": told}


def measure(case: Case) -> list[Measured]:
    """Reduce once, run and evaluate with every solver; a module-level function, so that processes can be handed it."""
    started = perf_counter()
    model = case.scene.reduce(**dict(case.reduce))
    model.simulate(1e-3 / max(float(model.omega[0]), 1.0), solver=case.solvers[0])  # load compiled code, make tables
    preparation = perf_counter() - started
    return [_measured(case, model, solver, preparation) for solver in case.solvers]


def _measured(case: Case, model: Model, solver: Any, preparation: float) -> Measured:
    """One model with one solver."""
    parts = runs(model, case.plan, case.quantity, solver)
    values = values_of(case.quantity, parts, repr(case))
    times = np.concatenate([run.contacts.t_out - run.contacts.t_in for run in parts])
    contact = float(np.median(times[np.isfinite(times)])) if np.any(np.isfinite(times)) else float("nan")
    highest, share = float(model.omega.max()), float(model.static_share.min(initial=1.0))
    seconds = sum(run.cost.seconds for run in parts)
    return Measured(values, len(model.omega), seconds, preparation, share, highest * contact / (2 * np.pi))


@whole_runs()
def runs(model: Model, plan: Plan, quantity: Quantity, solver: Any) -> list[Run]:
    """The runs, or parts of a run, that give independent values; times count from the beginning of each."""
    start = None if plan.start is None else plan.start(model)
    if plan.duration is None:
        return periodic(model, plan, start, solver, getattr(quantity, "sampled", True))
    models = [_seeded(model, seed) for seed in plan.seeds] if plan.seeds else [model]
    whole = [each.simulate(plan.duration, plan.dt, start, solver) for each in models]
    return [cut(run, plan.discard, plan.duration) for run in whole]


def periodic(model: Model, plan: Plan, start: Any, solver: Any, sampled: bool) -> list[Run]:
    """Groups of drive periods of the settled response; a simulation rather than shooting, as it may be chaotic."""
    period = load_period(model.scene)
    before = settling_periods(model, period, plan.discard)
    per = samples_per_period(model.scene, model.omega, period, plan.dt)
    times = np.arange(before * per, (before + GROUPS * GROUP) * per + 1) / per * period
    run = model.simulate((before + GROUPS * GROUP) * period, times if sampled else None, start, solver)
    borders = (before + GROUP * np.arange(GROUPS + 1)) * period
    parts = [cut(run, a, b) for a, b in pairwise(borders)]
    share = replace(run.cost, seconds=run.cost.seconds / GROUPS)
    return [replace(part, cost=share) for part in parts]


def settling_periods(model: Model, period: float, discard: float) -> int:
    """Drive periods after which the response counts as settled; warns where that is not known."""
    asked = math.ceil(max(SETTLING, discard / period) - 1e-9)
    try:
        lasts = math.ceil(SETTLED * correlation_time(model) / period)
    except ValueError:  # no damping, or that of friction alone
        if not discard:
            warn(f"a mode decays by friction alone, or not at all: {SETTLING} periods of the load may not "
                 "settle it; give discard=, or duration=")  # fmt: skip
        return asked
    if lasts > LONGEST > asked:
        warn(f"the response takes {lasts} periods of the load to settle, {LONGEST} are run; give discard=, "
             "or duration=")  # fmt: skip
    return max(asked, min(lasts, LONGEST))


def samples_per_period(scene: Scene, omega: Vector, period: float, dt: float | None = None) -> int:
    """Samples of a drive period: as asked for, or enough for its tones and the lowest mode that swings."""
    if dt is not None:
        return max(1, math.ceil(period / dt - 1e-9))
    tones = [float(np.max(signal.tones()[0], initial=0.0)) for signal in signals_of(scene).values()]
    swings = omega[omega > 1e-6 * float(omega.max())]
    slow = min(FEWEST * float(swings.min(initial=math.inf)), MOST * 2.0 * math.pi / period) if len(swings) else 0.0
    return max(SAMPLES, math.ceil(max(FEWEST * max(tones), slow) * period / (2.0 * math.pi) - 1e-9))


def cut(run: Run, start: float, end: float) -> Run:
    """The part of a run from start to end (s), with times counted from start; the last state only if it has no samples.

    A contact belongs to the part in which it began; forces at samples are those of the run all the same.
    """
    half, of_log = 1e-9 * max(float(run.t[-1]), end), partial(_part_of_log, run, start, end)
    if len(run.t) == 1:
        kept, t = slice(0, 1), np.array([end - start])
    else:
        kept = slice(int(np.searchsorted(run.t, start - half)), int(np.searchsorted(run.t, end + half)))
        t = run.t[kept] - start
    part = replace(
        run, t=t, q=run.q[kept], q_dot=run.q_dot[kept],
        contacts=of_log("contacts", "t_in", "t_out"), ledger=partial(_ledger_of, run, kept),
        make_losses=partial(_lost_of, run, kept), make_friction_log=partial(of_log, "friction_log", "t_in", "t_out"),
        make_transitions=partial(of_log, "transitions", "t"), reached=end - start,
        memory_at_start=latched_before(run, start), end=_end_of(run, kept),
        made=run.made if start == 0.0 and end >= run.reached else None,
        kept_readout={"forces": run._forces[:, kept], "means": _MeansOf(run, kept), "t": run.t[kept]},  # the run's t
    )  # fmt: skip
    if run.rubs.any() and run.sampled:
        part.__dict__["friction_loss"] = run.friction_loss[kept] - run.friction_loss[kept][:1]
    return part


@dataclass(frozen=True)
class _MeansOf:
    """Mean forces (k,) by stop over the cells of some of a run's samples, each made when asked for."""

    run: Run
    kept: slice

    def __getitem__(self, stop: int) -> Vector:
        run, kept = self.run, self.kept
        impulses = run.losses.impulses
        lost = replace(run.losses, impulses=impulses if impulses is None else impulses[kept])
        part = replace(run, t=run.t[kept], q=run.q[kept], q_dot=run.q_dot[kept], make_losses=lambda: lost)
        return mean_force(part, stop)


def _end_of(run: Run, kept: slice) -> Any:
    """The state that a part of a run ends with, which without samples is not known but that of the run."""
    if len(run.t) == 1 or kept.stop == len(run.t):
        return run.end
    last = kept.stop - 1
    return np.concatenate((run.q[last], run.q_dot[last], *latched_before(run, run.t[last])))


def _lost_of(run: Run, kept: slice) -> Any:
    """What contacts took in a part of a run; of friction `friction_loss` tells."""
    part = run.losses.part(kept)
    unknown = np.full(len(part), np.nan)
    return replace(part, friction=unknown, spin=unknown) if run.rubs.any() else part


def _part_of_log(run: Run, start: float, end: float, name: str, *times: str) -> Any:
    """What a log of a run has whose first time lies from start to end, its times counted from start."""
    log = getattr(run, name)
    began = getattr(log, times[0])
    columns = {key: column[(began >= start) & (began < end)] for key, column in log.arrays().items()}
    return replace(log, **columns | {key: columns[key] - start for key in times})


def _ledger_of(run: Run, kept: slice) -> solvers.Energy:
    """The energy balance of some of a run's samples."""
    columns = {f.name: getattr(run.energy, f.name) for f in fields(run.energy)}
    return replace(run.energy, **{name: column[kept] for name, column in columns.items() if np.ndim(column)})


def _seeded(model: Model, seed: int) -> Model:
    """The model under another realisation of all its noise; the first one, often the only one, has the seed itself."""
    return renewed(model, lambda j, _: child(seed, j) if j else seed)


def values_of(quantity: Quantity, parts: list[Run], where: str) -> Vector:
    """(k, …) the quantity of every run, of one shape; `where` names them in messages."""
    values = [_value(quantity, run, where) for run in parts]
    shapes = {np.shape(value) for value in values}
    require(len(shapes) == 1, "quantity must return one shape", sorted(shapes), where, "return a fixed number")
    return np.array(values)


def _value(quantity: Quantity, run: Run, where: str) -> Any:
    """The quantity of one run, checked."""
    value = np.asarray(quantity(run), dtype=float)
    require(value.size > 0, "quantity must return a number or an array", value, where, "check the function")
    return value
