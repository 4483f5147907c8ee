"""Parameter studies: a quantity over a grid of values, or over samples of their distributions."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam import plot
from fembeam.scene import Scene
from fembeam.statistics import Estimate
from fembeam.study.execution.checkpoint import Checkpoint, digested, scene_identity
from fembeam.study.execution.executors import spread
from fembeam.study.measure import Plan, Start
from fembeam.study.result import Result, with_units
from fembeam.study.trial import Asked, Maker, Refused, Trial
from fembeam.support import Part, is_whole, require, require_seed, titled, warn
from solvers.problem import counted

Vector = NDArray[np.float64]
WHERE = "vary"
LONGEST = 60  # points that are printed one by one


@dataclass(frozen=True, eq=False)
class Variation(Result):
    """Quantities at points of a parameter space.

    Attributes
    ----------
    names : (d,) paths of the parameters. points : (n, d) their values.
    quantities : (q,) names. values : (n, q), NaN where a run failed or the quantity has no value.
    standard_error : (n, q) of the values over seeds, or over groups of periods; NaN of single runs.
    axes : (d,) values along each parameter of a grid, the last one running fastest; empty of samples.
    failures : (number of the point, reason) of runs that failed.
    titles : (d,) names of the parameters for axes, with units. units : (d,) these alone, SI, empty where not known.
    value_units : (q,) of the quantities, empty of functions.
    """

    names: tuple[str, ...]
    points: Vector
    quantities: tuple[str, ...]
    values: Vector
    standard_error: Vector
    axes: tuple[Vector, ...] = ()
    failures: tuple[tuple[int, str], ...] = ()
    titles: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    value_units: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.points)

    def __getitem__(self, name: str) -> Vector:
        """Values of one quantity: (n,), of a grid (values of the first parameter, of the second, …)."""
        column = self.values[:, self._column(name)]
        return column.reshape([len(axis) for axis in self.axes]) if self.axes else column

    def estimate(self, name: str) -> Estimate:
        """Mean of one quantity over samples of distributions, with its standard error; NaN if any has no value."""
        require(not self.axes, "the mean over a grid is none of a distribution", self.names, "Variation.estimate",
                "vary with samples=")  # fmt: skip
        return Estimate.of_mean(self.values[:, self._column(name)])

    def _column(self, name: str) -> int:
        """Number of a quantity."""
        if name not in self.quantities:
            raise KeyError(f"the study has no {name!r}; it has {', '.join(self.quantities)}")
        return self.quantities.index(name)

    def __repr__(self) -> str:
        failed = f", {len(self.failures)} failed" if self.failures else ""
        return f"<{', '.join(self.quantities)} at {counted(len(self), 'point')} of {', '.join(self.names)}{failed}>"

    def _parts(self) -> list[Part]:
        """Every point where they are few, the extremes of each quantity, and of samples their scatter."""
        rows = [(*point, *cells) for point, cells in zip(self.points.tolist(), self._cells(), strict=True)]
        listed: list[Part] = [((*self.heads, *self.value_heads), rows)] if len(rows) <= LONGEST else []
        return [repr(self), *listed, (("", "", "value", *self.heads), self._extremes()), *self._scatter()]

    @property
    def heads(self) -> list[str]:
        """Paths of the parameters with their units, as tables have them."""
        return with_units(self.names, self.units)

    @property
    def value_heads(self) -> list[str]:
        """Names of the quantities with their units, as tables and figures have them."""
        return with_units(self.quantities, self.value_units)

    def _cells(self) -> list[list[Any]]:
        """Values with their standard errors, as printed."""
        pairs = zip(self.values.tolist(), self.standard_error.tolist(), strict=True)
        return [[v if np.isnan(e) else repr(Estimate(v, e, 2)) for v, e in zip(*pair, strict=True)] for pair in pairs]

    def _extremes(self) -> list[tuple[Any, ...]]:
        """Least and largest value of each quantity, and where."""
        found = []
        for name, column in zip(self.value_heads, self.values.T, strict=True):
            if np.isfinite(column).any():
                for word, i in (("least", np.nanargmin(column)), ("largest", np.nanargmax(column))):
                    found.append((name, word, float(column[i]), *self.points[i].tolist()))
        return found

    def _scatter(self) -> list[Part]:
        """Mean, standard deviation and percentiles over samples."""
        if self.axes:
            return []
        head = "over the samples", "mean ± standard error", "standard deviation", "5 %", "median", "95 %"
        rows = []
        for name, column, mean in zip(
            self.value_heads, self.values.T, map(self.estimate, self.quantities), strict=True
        ):
            deviation = float(column.std(ddof=1)) if len(column) > 1 else None
            rows.append((name, repr(mean), deviation, *np.quantile(column, (0.05, 0.5, 0.95)).tolist()))
        return [(head, rows)]

    def table(self) -> list[dict[str, Any]]:
        """One point a row: parameters, quantities, and standard errors where there are any."""
        errors = [f"standard error of {name}" for name in self.quantities]
        shown = [i for i in range(len(errors)) if np.isfinite(self.standard_error[:, i]).any()]
        names = *self.names, *self.quantities, *(errors[i] for i in shown)
        columns = np.hstack((self.points, self.values, self.standard_error[:, shown]))
        return [dict(zip(names, row, strict=True)) for row in columns.tolist()]

    def _units(self) -> dict[str, str]:
        units = dict(zip((*self.names, *self.quantities), (*self.units, *self.value_units), strict=False))
        return units | {f"standard error of {name}": units.get(name, "") for name in self.quantities}

    figure = plot.variation


def vary(
    scene: Scene | Maker,
    parameters: Mapping[str, Any] | Sequence[Mapping[str, float]],
    quantity: Asked,
    duration: float | None = None,
    dt: float | None = None,
    discard: float = 0.0,
    seeds: Sequence[int] = (),
    samples: int | ArrayLike | None = None,
    seed: int = 0,
    start: Start | None = None,
    solver: Any = None,
    executor: Executor | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
    progress: bool = False,
    **reduction: Any,
) -> Variation:
    """Quantities of a scene over values of its parameters.

    Parameters
    ----------
    scene : whose numbers are varied; or a function that makes one from named values, ``make(gap=…, restitution=…)``.
    parameters : {path: values} for a grid of all combinations; {path: distribution} of `scipy.stats` for random
        samples; [{path: value, …}, …] for points one by one. Paths are such as "stops[0].gap", "base.amplitude",
        see `fembeam.scene.parameters`; with a function, names of its arguments.
    quantity : a name of `quantities`, a function of a run that gives a number, a list of them, or {name: one}.
    duration, dt, discard, start, solver : as for `mode_count`; without a duration the settled response to periodic
        loads is measured.
    seeds : of the noise, three or more, the same at all points; values are means over them, with standard errors.
    samples : how many to draw from the distributions, independently; or numbers in [0, 1], (n, parameters), which their
        inverse distribution functions map: ``scipy.stats.qmc.Sobol(2, seed=1).random(64)``.
    seed : of the samples drawn.
    executor : any `concurrent.futures.Executor`; points are spread over it.
    checkpoint : file that keeps each point; what it holds is not computed again, also of a grid with
        other values of the same parameters. It is refused when scene, quantity or anything else differs.
    progress : show a bar (on terminals and in notebooks only).
    reduction : arguments of `Scene.reduce`, such as ``modes=3``. Where only signals, gaps and laws are varied the modes
        are computed once.

    Returns
    -------
    Variation : ``["peak_force"]`` is an array in the grid's shape. The same bits with any executor, and when resumed.

    Raises
    ------
    ValueError : a path that does not exist (with the nearest one), values that are no finite numbers or that the scene
        refuses, an unknown quantity, runs that cannot be made like this: all before computing. What cannot be reduced
        at any point, such as a preload that buckles the structure; at some points it is a failure of these.

    Warns
    -----
    UserWarning : runs failed; the others survive.

    Examples
    --------
    >>> import fembeam as fb
    >>> scene = fb.Scene(fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01)), [fb.Clamped(0.0)],
    ...                  base=fb.Harmonic(1e-3, 100.0), damping=fb.ModalDamping(0.05))
    >>> found = vary(scene, {"base.amplitude": [1e-3, 2e-3]}, "amplitude", duration=0.5, dt=1e-3, modes=1)
    >>> bool(abs(found["amplitude"][1] / found["amplitude"][0] - 2.0) < 1e-9)
    True
    """
    plan = Plan(duration, dt, discard, seeds, start, solver)
    names, points, axes = points_of(parameters, samples, seed)
    trial = Trial.of(scene, names, quantity, plan, reduction).prepared(points)
    kept = Checkpoint(checkpoint, partial(identity_of, trial))
    with kept:
        failures = computed(trial, points, kept, executor, titled(progress, WHERE))
    if failures:
        i, reason = failures[0]
        message = f"{len(failures)} of {len(points)} points failed; {trial.words(points[i])}: {reason}"
        warn(message)
    return collected(trial, points, kept, axes, failures)


def computed(
    trial: Trial, points: Vector, kept: Checkpoint, executor: Executor | None, progress: str | None
) -> tuple[tuple[int, str], ...]:
    """Run the points that a checkpoint does not hold, into it; what failed."""
    missing = [i for i, point in enumerate(points) if _key(point) not in kept.values]
    failed: list[tuple[int, str]] = []

    def seen(index: int, result: Vector | str) -> None:
        i = missing[index]
        if isinstance(result, str):
            failed.append((i, result))
        else:
            kept.add(_key(points[i]), {"values": result})

    spread(trial, [tuple(points[i].tolist()) for i in missing], executor, progress, seen)
    if len(failed) == len(points) and all(isinstance(reason, Refused) for _, reason in failed):
        raise ValueError(f"{failed[0][1]} (at {trial.words(points[failed[0][0]])}, and at all others)")
    return tuple(sorted(failed))


def collected(
    trial: Trial, points: Vector, kept: Checkpoint, axes: tuple[Vector, ...], failures: tuple[tuple[int, str], ...]
) -> Variation:
    """Means and standard errors in the order of the points."""
    q = len(trial.asked.names)
    values, errors = np.full((2, len(points), q), np.nan)
    for i, point in enumerate(points):
        if (one := kept.values.get(_key(point))) is not None:
            estimate = Estimate.of_mean(one["values"])
            values[i], errors[i] = estimate.value, estimate.standard_error
    told = trial.titles, trial.units, trial.value_units
    return Variation(trial.called, points, trial.asked.names, values, errors, axes, failures, *told)


def _key(point: Vector) -> str:
    """A point as text that tells all of its digits."""
    return " ".join(map(repr, point.tolist()))


def identity_of(trial: Trial) -> dict[str, str]:
    """What the values of a point depend on besides the point."""
    study = trial.plan, trial.method, trial.asked, sorted(trial.reduction.items())
    shown = {"quantities": trial.asked.names, "plan": trial.plan, "solver": trial.method, "reduce": trial.reduction}
    told = digested(study, "the study", repr(shown))
    return scene_identity(trial.scene) | {"parameters": ", ".join(trial.names), "study": told}


def points_of(
    parameters: Mapping[str, Any] | Sequence[Mapping[str, float]], samples: Any = None, seed: int = 0
) -> tuple[list[str], Vector, tuple[Vector, ...]]:
    """Names (d,), points (n, d), and the values along each axis if they are a grid."""
    if not isinstance(parameters, Mapping):
        return _listed(parameters, samples)
    names, given = [str(name) for name in parameters], list(parameters.values())
    require(bool(names), "parameters must name at least one", {}, WHERE, "e.g. {'stops[0].gap': [1e-4, 2e-4]}")
    if not any(_is_distribution(one) for one in given):
        _require_no_samples(samples)
        axes = tuple(_numbers(name, one) for name, one in zip(names, given, strict=True))
        return names, np.stack([one.ravel() for one in np.meshgrid(*axes, indexing="ij")], axis=-1), axes
    for name, one in zip(names, given, strict=True):
        require(_is_distribution(one), f"{name} must be a distribution as others are", one, WHERE,
                "e.g. scipy.stats.norm(1e-3, 1e-5)")  # fmt: skip
        require(bool(np.isfinite(one.ppf(0.5))), f"the distribution of {name} must have a median", one.ppf(0.5), WHERE,
                "its scale must be above 0, its shape within what scipy.stats allows")  # fmt: skip
    share = _shares(samples, seed, len(names))
    points = np.stack([np.asarray(one.ppf(share[:, i]), dtype=float) for i, one in enumerate(given)], axis=-1)
    require(bool(np.isfinite(points).all()), "samples must be finite", points[~np.isfinite(points)][:1], WHERE,
            "keep them off 0 and 1")  # fmt: skip
    return names, points, ()


def _is_distribution(value: Any) -> bool:
    """Whether a value is a frozen distribution, with its inverse distribution function."""
    return callable(getattr(value, "ppf", None))


def _listed(parameters: Any, samples: Any) -> tuple[list[str], Vector, tuple[Vector, ...]]:
    """Points given one by one."""
    _require_no_samples(samples)
    points = [] if isinstance(parameters, str) or not hasattr(parameters, "__iter__") else list(parameters)
    valid = bool(points) and all(isinstance(one, Mapping) and one for one in points)
    require(valid, "parameters must be {path: values} or [{path: value, …}, …]", parameters, WHERE,
            "e.g. {'stops[0].gap': [1e-4, 2e-4]}")  # fmt: skip
    names = list(points[0])
    for i, one in enumerate(points):
        require({*one} == {*names}, "every point must name the same parameters", list(one), f"point {i} of {WHERE}",
                f"name {', '.join(names)}")  # fmt: skip
    return names, np.stack([_numbers(name, [one[name] for one in points]) for name in names], axis=-1), ()


def _numbers(name: str, given: Any) -> Vector:
    """Values of one parameter, checked."""
    advice = "give a list of numbers, or a distribution of scipy.stats"
    try:
        raw = np.asarray(given)
    except ValueError:  # rows of several lengths
        raw = np.asarray(None)
    valid = raw.ndim == 1 and raw.size > 0 and raw.dtype.kind in "iuf" and bool(np.isfinite(raw).all())
    require(valid, f"values of {name} must be finite numbers", given, WHERE, advice)
    return raw.astype(float)


def _require_no_samples(samples: Any) -> None:
    """Raise ValueError for samples where values are given."""
    require(samples is None, "samples are drawn from distributions, not from values", samples, WHERE,
            "give e.g. scipy.stats.norm(1e-3, 1e-5)")  # fmt: skip


def _shares(samples: Any, seed: int, parameters: int) -> Vector:
    """(n, d) numbers in [0, 1]: those given, or that many drawn."""
    if is_whole(samples):
        require(samples > 0, "samples must be at least 1", samples, WHERE, "e.g. 64")
        require_seed(seed, WHERE)
        return np.random.default_rng(int(seed)).random((int(samples), parameters))
    given = np.asarray(np.nan if samples is None else samples, dtype=float)
    shape = given.ndim == 2 and given.shape[1] == parameters and len(given) > 0
    require(
        shape, f"samples must be a number of them, or (n, {parameters}) numbers in [0, 1]", samples, WHERE, "e.g. 64"
    )
    require(bool(np.all((given >= 0.0) & (given <= 1.0))), "samples must lie in [0, 1]", samples, WHERE,
            "give those of scipy.stats.qmc, not scaled")  # fmt: skip
    return given
