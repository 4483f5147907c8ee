"""Speed against accuracy: one point per method, setting and model, errors against a reference two methods agree on."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import MISSING, dataclass, field, fields
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

import solvers
from fembeam import plot
from fembeam.model import Model, Run, places
from fembeam.study.execution.checkpoint import Checkpoint, digested, study_identity
from fembeam.study.measure import require_model
from fembeam.study.result import Result
from fembeam.support import Part, counting, require, require_positive
from solvers.problem import counted
from solvers.problem.whole_runs import whole_runs

Vector = NDArray[np.float64]
_INSTANTS = 8  # between two starts, of which the first with all stops open is taken
PATIENCE, MORE_PATIENCE = 20.0, 0.2  # s one setting may take per model for its first round, and for further ones


class NoReferenceError(solvers.SolverError):
    """The reference methods do not agree, so no error can be stated."""


@dataclass(frozen=True, eq=False)
class Point:
    """One method at one setting on one model, over several starts.

    Attributes
    ----------
    method, setting : names. modes : number of coordinates of the model.
    seconds : (s,) fastest of the rounds for each start. errors : (s,) of integration, against the model's own
        reference. totals : (s,) against the reference of the largest model: integration and reduction together.
    law_calls, steps : median over the starts. failure : why there are no numbers, else "".
    """

    method: str
    setting: str
    modes: int
    seconds: Vector
    errors: Vector
    totals: Vector
    law_calls: float
    steps: float
    failure: str = ""

    @property
    def time(self) -> float:
        """Median over the starts, s."""
        return median(self.seconds)

    @property
    def error(self) -> float:
        """Median over the starts."""
        return median(self.errors)

    @property
    def total(self) -> float:
        """Median over the starts."""
        return median(self.totals)

    def spread(self, values: Vector) -> tuple[float, float]:
        """Quartiles of ``seconds``, ``errors`` or ``totals``."""
        return (math.nan, math.nan) if not len(values) else tuple(np.quantile(values, [0.25, 0.75]))  # type: ignore[return-value]


@dataclass(frozen=True, eq=False)
class SpeedAccuracy(Result):
    """The answer of `speed_accuracy`.

    Attributes
    ----------
    points : all of them. unit : what an error of 1 is, in the quantity's unit. floor : {modes: disagreement of the two
        references}; errors below it are not known. reduction : {modes: error of the exact model against the largest}.
    """

    points: list[Point]
    unit: float
    floor: dict[int, float]
    reduction: dict[int, float]
    quantity: str = "displacement at the end"

    def front(self, modes: int) -> list[Point]:
        """Points that no other beats in median time and error, the coarsest first; errors below the floor are equal."""
        best: list[Point] = []
        floor = self.floor.get(modes, 0.0)
        for point in sorted((p for p in self.points if p.modes == modes and p.seconds.size), key=lambda p: p.time):
            if not best or max(point.error, floor) < max(best[-1].error, floor):
                best.append(point)
        return best

    def beaten(self, method: str, better_than: float = 1e-4) -> list[Point]:
        """Points of the fronts, more accurate than a limit, that belong to other methods."""
        return [
            point
            for modes in self.reduction
            for point in self.front(modes)
            if point.error < better_than and point.method != method
        ]

    def claim(self, method: str = "Exponential", better_than: float = 1e-4) -> str:
        """A sentence: whether a method is the front below an error, or which others are; "" without others."""
        methods = {point.method for point in self.points}
        reached = any(point.error < better_than for point in self.points)
        if method not in methods or len(methods) < 2 or not reached:
            return ""
        others = sorted({f"{p.method} with {counted(p.modes, 'mode')}" for p in self.beaten(method, better_than)})
        claim = f"below {better_than:g} {method} is the front"
        return claim + (", but for " + ", ".join(others) if others else " everywhere")

    def table(self) -> list[dict[str, Any]]:
        """The points, medians over their starts with quartiles."""
        fronts = {id(point) for modes in self.reduction for point in self.front(modes)}
        return [
            {"method": p.method, "setting": p.setting, "modes": p.modes, "starts": len(p.errors),
             "seconds": p.time, "seconds_q1": p.spread(p.seconds)[0], "seconds_q3": p.spread(p.seconds)[1],
             "error": p.error, "error_q1": p.spread(p.errors)[0], "error_q3": p.spread(p.errors)[1],
             "total_error": p.total, "law_calls": p.law_calls, "steps": p.steps,
             "front": id(p) in fronts, "failure": p.failure}
            for p in self.points
        ]  # fmt: skip

    def __repr__(self) -> str:
        return f"<speed against accuracy of {counted(len(self.points), 'point')}, {self.quantity}>"

    def _parts(self) -> list[Part]:
        head = "method", "setting", "modes", "µs", "error", "total", "law calls", ""
        known = [f"{counted(n, 'mode')}: reduction error {error:.1e}, reference known to {self.floor[n]:.0e}"
                 for n, error in self.reduction.items()]  # fmt: skip
        return [(head, [_cells(row) for row in self.table()]), *known, *filter(None, [self.claim()])]

    figure = plot.speed_accuracy


def end_displacement(run: Run) -> Vector:
    """The displacement u at the first stop, or at the far end, at the end of the run: the default quantity.

    δ of a first stop of rotation, of an annular one, or at a place by name.
    """
    if len(run.stops) and (run.circles[0, 0] or run.rotational[0] or np.isnan(run.stops[0, 0])):
        return np.asarray(run._deformation(0)[-1])
    if run.shapes.named:
        return np.asarray(run.shapes(next(iter(places(run.shapes).values()))) @ run.q[-1])
    return np.asarray(run.shapes(run.stops[0, 0] if len(run.stops) else run.shapes.nodes[-1]) @ run.q[-1])


def speed_accuracy(
    model: Model | Sequence[Model],
    methods: Sequence[Any],
    starts: int | ArrayLike = 12,
    duration: float | None = None,
    dt: float | None = None,
    quantity: Callable[[Run], Any] = end_displacement,
    agreement: float = 1e-6,
    rounds: int = 5,
    progress: bool = False,
    checkpoint: str | os.PathLike[str] | None = None,
) -> SpeedAccuracy:
    """Error against time for methods and models, all timed by turns in one process.

    The reference of every start is ``Exponential(1e-12)``; ``DormandPrince(1e-12)`` must agree with it.

    Parameters
    ----------
    model : one, or several of the same scene, nested: each with the first modes of the next larger one.
    methods : with their settings, such as ``[solvers.Exponential(1e-6), solvers.RK4(1e-5)]``.
    starts : number of starts, taken along a run of the smallest model from rest, with stops open where they open
        within some periods; or (s, 2n) states of it. A larger model starts with its further modes at rest.
    duration : s; None is about five periods of the lowest mode. Trajectories part after some ten impacts; beyond,
        ask for statistics.
    dt : output sampling, if the quantity needs it.
    quantity : of a run: a trajectory's end (default), an orbit's amplitude, the impact rate, a spectrum.
    agreement : largest difference of the two references, relative to the quantity's size; for statistics on long
        horizons, where runs differ, as much as their scatter.
    rounds : how often each run is timed; the fastest counts. Slow settings run fewer, very slow ones fewer starts.
    progress : show a bar (on terminals and in notebooks only).
    checkpoint : file that keeps each run of a reference; what it holds is not computed again. Times are taken
        anew, as only those of one process can be compared.

    Returns
    -------
    SpeedAccuracy. Draw it with ``fb.plot.speed_accuracy``.

    Raises
    ------
    NoReferenceError when the references differ by more than ``agreement``. ValueError for bad input, before computing,
    and for the checkpoint of another study.

    Examples
    --------
    >>> import fembeam as fb
    >>> from contacts import KelvinVoigt
    >>> steel = fb.Section(E=2.1e11, rho=7800.0, A=1e-4, I=1e-9)
    >>> stop = fb.Stop(0.5, KelvinVoigt(1e5, 5.0), gap=1e-4)
    >>> scene = fb.Scene(fb.Beam(0.5, steel), [fb.Clamped(0.0)], stops=[stop], base=fb.Harmonic(1e-3, 150.0))
    >>> methods = [solvers.Exponential(1e-4), solvers.Exponential(1e-8)]
    >>> found = speed_accuracy(scene.reduce(modes=1), methods, starts=2, duration=0.05, rounds=1)
    >>> loose, tight = found.points
    >>> tight.error < 1e-7 and tight.error < loose.error < 1e-3
    True
    """
    require(hasattr(methods, "__iter__"), "methods must be a list of one or more", methods, "speed_accuracy",
            "put it in brackets")  # fmt: skip
    models = list(model) if isinstance(model, Iterable) else [model]
    for one in models:
        require_model(one, "speed_accuracy")
    models = sorted(models, key=lambda m: len(m.omega))
    _check(models, list(methods), rounds)
    duration = 10 * math.pi / float(models[0].omega[0]) if duration is None else duration
    require_positive("duration", duration, "speed_accuracy", "give s")
    states = _starts(models[0], starts, duration)
    ask = _Question(duration, dt, quantity)
    kept = Checkpoint(checkpoint, lambda: _identity(models, states, ask))
    with kept:
        truths, floor, unit = _references(models, states, ask, agreement, kept)
    trials = [_Trial(each, method) for each in models for method in methods]
    _measure(trials, states, ask, rounds, progress)
    sizes = [len(each.omega) for each in models]
    reduction = {n: median(_distances(truths[n], truths[sizes[-1]], unit)) for n in sizes}
    points = [trial.point(truths[len(trial.model.omega)], truths[sizes[-1]], unit) for trial in trials]
    name = getattr(quantity, "__name__", None) or repr(quantity)
    return SpeedAccuracy(points, unit, floor, reduction, name.replace("_", " ") + ", relative")


@dataclass(frozen=True)
class _Question:
    """What every run is asked for."""

    duration: float
    dt: float | None
    quantity: Callable[[Run], Any]

    @whole_runs()
    def run(self, model: Model, state: Vector, method: Any) -> Run:
        """One run; the state is padded with modes at rest."""
        return model.simulate(self.duration, self.dt, _padded(state, len(model.omega)), method)

    def value(self, run: Run) -> Vector:
        """The quantity as a vector."""
        return np.atleast_1d(np.asarray(self.quantity(run), dtype=float)).ravel()


@dataclass(eq=False)
class _Trial:
    """A method on a model, while it is measured."""

    model: Model
    method: Any
    seconds: dict[int, float] = field(default_factory=dict)
    values: dict[int, Vector] = field(default_factory=dict)
    costs: list[Any] = field(default_factory=list)
    spent: float = 0.0
    failure: str = ""

    def measure(self, start: int, state: Vector, ask: _Question) -> None:
        """One timed run; what fails is kept as the reason."""
        started = time.perf_counter()
        try:
            run = ask.run(self.model, state, self.method)
        except (ValueError, solvers.SolverError) as error:
            self.failure = " ".join(str(error).split())
            return
        took = time.perf_counter() - started
        self.spent += took
        self.seconds[start] = min(took, self.seconds.get(start, math.inf))
        if start not in self.values:
            self.values[start] = ask.value(run)
            self.costs.append(run.cost)

    def point(self, own: list[Vector], largest: list[Vector], unit: float) -> Point:
        """The result."""
        kept = [] if self.failure else sorted(self.values)
        found = [self.values[i] for i in kept]
        law_calls, steps = (
            median(np.array([getattr(cost, name) for cost in self.costs], dtype=float))
            for name in ("law_calls", "steps")
        )
        return Point(
            method_name(self.method),
            _setting(self.method),
            len(self.model.omega),
            np.array([self.seconds[i] for i in kept]),
            _distances(found, [own[i] for i in kept], unit),
            _distances(found, [largest[i] for i in kept], unit),
            law_calls,
            steps,
            self.failure,
        )


def _check(models: list[Model], methods: list[Any], rounds: int) -> None:
    """ValueError for what cannot be compared."""
    where = "speed_accuracy"
    require(len(models) > 0, "model must be a model or several", 0, where, "use scene.reduce(modes=2)")
    require(len(methods) > 0, "methods must hold one", 0, where, "e.g. [solvers.Exponential()]")
    require(rounds >= 1, "rounds must be at least 1", rounds, where, "e.g. 5")
    for method in methods:
        if not hasattr(method, "engine") or isinstance(method, type):
            raise TypeError(f"methods must be given with their settings, such as solvers.RK4(1e-5), got {method!r}")
    for small, large in pairwise(models):
        nested = bool(np.allclose(small.omega, large.omega[: len(small.omega)], rtol=1e-4))
        require(nested, "models must be nested: each with the first modes of the next", [len(m.omega) for m in models],
                where, "reduce one scene to 1, 2, 5, ... modes")  # fmt: skip


@whole_runs()
def _starts(model: Model, starts: Any, duration: float) -> Vector:
    """States (s, 2n) of the smallest model.

    Those of a run are taken with all stops open: from a state alone a contact's law does not know its entry rate.
    """
    if isinstance(starts, (int, np.integer)):
        require(bool(starts >= 1), "starts must be at least 1", starts, "speed_accuracy", "e.g. 12")
        spacing = duration * 0.618  # no multiple of a drive period
        dt, method = spacing / _INSTANTS, solvers.Exponential(1e-8, ledger=False)
        run = model.simulate((starts + 3) * spacing, dt, solver=method)
        closed = np.zeros(len(run.t), dtype=bool)
        for contact in model.system.contacts:
            closed |= (contact.indentation(run.q) > 0.0) & (not contact.always)
        chosen = [i + int(np.argmin(closed[i : i + _INSTANTS])) for i in _INSTANTS * np.arange(3, 3 + starts)]
        return np.hstack((run.q, run.q_dot))[chosen]
    states = np.atleast_2d(np.asarray(starts, dtype=float))
    require(states.shape[1] == 2 * len(model.omega), f"starts must have {2 * len(model.omega)} columns, [q, q_dot]",
            states.shape, "speed_accuracy", "give states of the smallest model")  # fmt: skip
    return states


def _padded(state: Vector, modes: int) -> Vector:
    """A start of a model with more modes."""
    rest = np.zeros(modes - state.size // 2)
    q, q_dot = np.split(state, 2)
    return np.concatenate((q, rest, q_dot, rest))


def _identity(models: list[Model], states: Vector, ask: _Question) -> dict[str, str]:
    """What the references depend on, as texts that can be compared."""
    told = digested([(m.scene, m.modes, m.omega) for m in models], "models", repr([m.modes for m in models]))
    return study_identity(models[-1], study="speed_accuracy", starts=states, **vars(ask)) | {"models": told}


def _references(
    models: list[Model], states: Vector, ask: _Question, agreement: float, kept: Checkpoint
) -> tuple[dict, dict, float]:
    """{modes: values per start}, {modes: disagreement}, and the quantity's size."""

    def value(model: Model, start: int, method: Any) -> Vector:
        key = f"{len(model.omega)} modes, {method!r}, start {start}"
        if key not in kept.values:
            kept.add(key, {"value": ask.value(ask.run(model, states[start], method))})
        return kept.values[key]["value"]

    pairs = {}
    for model in models:
        two = solvers.Exponential(1e-12, ledger=False), solvers.DormandPrince(1e-12)
        pairs[len(model.omega)] = [[value(model, start, m) for start in range(len(states))] for m in two]
    sizes = [np.linalg.norm(value) for value in pairs[len(models[-1].omega)][0]]
    unit = float(np.sqrt(np.mean(np.square(sizes)))) or 1.0
    floor = {n: float(_distances(pair[0], pair[1], unit).max()) for n, pair in pairs.items()}
    for n, distance in floor.items():
        if not distance <= agreement:
            raise NoReferenceError(
                f"with {n} modes Exponential(1e-12) and DormandPrince(1e-12) differ by {distance:.1e} of the quantity, "
                f"more than {agreement:.1e}: the motion forgets its start within {ask.duration:g} s; run shorter, or "
                "ask for a statistic and allow its scatter by agreement"
            )
    return {n: pair[0] for n, pair in pairs.items()}, floor, unit


def _measure(trials: list[_Trial], states: Vector, ask: _Question, rounds: int, progress: bool) -> None:
    """All trials by turns, so that a slow moment of the machine hits all alike."""
    for trial in trials:  # compile, build tables
        trial.measure(0, states[0], ask)
        trial.seconds.clear()
    for turn in counting(progress, range(rounds)):
        for trial in trials:
            for start, state in enumerate(states):
                patient = trial.spent < (MORE_PATIENCE if turn else PATIENCE)
                if not trial.failure and (patient or (not turn and not start)):
                    trial.measure(start, state, ask)


def _distances(found: list[Vector], wanted: list[Vector], unit: float) -> Vector:
    """Errors in units of the quantity's size."""
    return np.array([np.linalg.norm(a - b) / unit for a, b in zip(found, wanted, strict=True)])


def method_name(method: Any) -> str:
    """The class, and whether it ignores events."""
    return type(method).__name__ + ("" if getattr(method, "locate", True) else ", events ignored")


def _setting(method: Any) -> str:
    """What distinguishes a method from its default."""
    shown = []
    for f in fields(method):
        if f.name in ("locate", "force_unstable", "ledger"):
            continue
        value = getattr(method, f.name)
        if f.name in ("dt", "rtol") or f.default is MISSING or value != f.default:
            shown.append(f"{f.name}={value:g}" if isinstance(value, float) else f"{f.name}={value}")
    return ", ".join(shown)


def _cells(row: dict[str, Any]) -> tuple[str, ...]:
    """A line of the printed table; a failure stands in its last column."""
    named = row["method"], row["setting"], str(row["modes"])
    if row["failure"]:
        return *named, "", "", "", "", row["failure"]
    error, total = f"{row['error']:.1e}", f"{row['total_error']:.1e}"
    numbers = f"{1e6 * row['seconds']:.0f}", error, total, f"{row['law_calls']:.0f}"
    return *named, *numbers, "front" if row["front"] else ""


def median(values: Vector) -> float:
    """NaN of nothing."""
    return float(np.median(values)) if len(values) else math.nan
