"""One point of a parameter study: the scene with these values, reduced, run, and measured.

Every point has the same seeds of noise (common random numbers), so that points differ by their values alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import solvers
from fembeam.model import Model, Run
from fembeam.plot.axis_names import axis_name, parameter_unit
from fembeam.scene import Scene, changes_structure, numbered, path_of, with_value
from fembeam.study.measure import Plan, runs, values_of
from fembeam.study.quantities import Quantity, label, named, unit_of
from fembeam.support import require
from reduction import AccuracyError
from solvers.problem.whole_runs import whole_runs

Vector = NDArray[np.float64]
Maker = Callable[..., Scene]  # of named values
Asked = str | Quantity | Sequence[str | Quantity] | Mapping[str, str | Quantity]


@dataclass(frozen=True)
class Together:
    """Several quantities of one run as one: (q,)."""

    parts: tuple[tuple[str, Quantity], ...]

    @classmethod
    def of(cls, asked: Asked) -> Together:
        """From what a study takes: one, several, or several with names of their own."""
        if isinstance(asked, Mapping):
            parts = [(str(name), named(one)) for name, one in asked.items()]
        else:
            each: list[Any] = list(asked) if isinstance(asked, (list, tuple)) else [asked]
            parts = [(label(one), one) for one in map(named, each)]
        names = [name for name, _ in parts]
        require(bool(names), "quantity must name at least one", asked, "study", "e.g. 'peak_force'")
        require(len({*names}) == len(names), "quantities must have different names", names, "study",
                "give {name: quantity, …}")  # fmt: skip
        return cls(tuple(parts))

    @property
    def names(self) -> tuple[str, ...]:
        """Of the quantities."""
        return tuple(name for name, _ in self.parts)

    @property
    def sampled(self) -> bool:
        """Whether any of them needs output samples."""
        return any(getattr(one, "sampled", True) for _, one in self.parts)

    def __call__(self, run: Run) -> Vector:
        """Values of a run."""
        return np.array([_number(name, one(run)) for name, one in self.parts])


def _number(name: str, value: Any) -> float:
    """A value that is one number, NaN for none."""
    found = np.asarray(value)
    require(found.size == 1 and found.dtype.kind in "biuf", f"{name} must be one number at every point", value, "study",
            "take a part of it: lambda run: …")  # fmt: skip
    return float(found.reshape(()))


class Refused(str):
    """Why a point has no model; that of all points is bad input."""


@dataclass(frozen=True)
class Trial:
    """What is done at every point: `names` of the parameters, what is asked, how the model is reduced and run.

    `model` serves all points where no parameter changes modes; else every point is reduced anew.
    """

    scene: Scene | Maker
    names: tuple[str, ...]
    asked: Together
    plan: Plan
    method: Any
    reduction: dict[str, Any]
    model: Model | None = field(default=None, compare=False)
    value_units: tuple[str, ...] = field(default=(), compare=False)  # of what is asked
    called: tuple[str, ...] = ()  # the parameters as results have them: by the names of parts where these were given

    @classmethod
    def of(
        cls, scene: Scene | Maker, names: Sequence[str], asked: Asked, plan: Plan, reduction: dict[str, Any]
    ) -> Trial:
        """Checked, with full paths of the parameters."""
        made = isinstance(scene, Scene) or callable(scene)
        require(made, "scene must be a Scene or a function that makes one", scene, "study", "of a model, model.scene")
        called = list(names)
        if isinstance(scene, Scene):
            names = [path_of(scene, name) for name in names]
            by_number = (numbered(scene, name) == name for name in called)
            called = [path if plain else name for name, path, plain in zip(called, names, by_number, strict=True)]
        require(len({*names}) == len(names), "parameters must differ", list(names), "study", "name each once")
        method = solvers.Exponential(ledger=False) if plan.solver is None else plan.solver
        return cls(scene, tuple(names), Together.of(asked), plan, method, reduction, called=tuple(called))

    @property
    def titles(self) -> tuple[str, ...]:
        """Names of the parameters for axes."""
        if not isinstance(self.scene, Scene):
            return self.names
        return tuple(axis_name(name, self.scene) for name in self.names)

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the parameters, empty where there is none and of arguments of a function."""
        scene = self.scene
        return tuple(parameter_unit(name, scene) if isinstance(scene, Scene) else "" for name in self.names)

    def words(self, point: Sequence[float]) -> str:
        """A point as text."""
        return ", ".join(f"{name} = {value:.6g}" for name, value in zip(self.called, point, strict=True))

    def at(self, point: Sequence[float]) -> Scene:
        """The scene at a point; ValueError names the point."""
        values = dict(zip(self.names, map(float, point), strict=True))
        with _placed(f"at {self.words(point)}"):
            if not isinstance(self.scene, Scene):
                return self.scene(**values)
            scene = self.scene
            for name, value in values.items():
                scene = with_value(scene, name, value)
            return scene

    def check(self, points: Vector) -> list[Scene]:
        """The scenes at these points; ValueError when one cannot be made, or not run as planned."""
        scenes = [self.at(point) for point in points]
        for _, one in self.asked.parts:
            self.plan.check(scenes[0], one)
        return scenes

    def prepared(self, points: Vector) -> Trial:
        """Ready for these points, after all their scenes have been made and checked."""
        scenes = self.check(points)
        ready = replace(self, value_units=tuple(unit_of(one, scenes[0]) for _, one in self.asked.parts))
        if not isinstance(self.scene, Scene) or any(map(changes_structure, self.names)):
            return ready
        return replace(ready, model=scenes[0].reduce(**self.reduction))

    def __call__(self, point: Sequence[float]) -> Vector | str:
        """(k, q) independent values of every quantity, or why the run failed."""
        scene = self.at(point)
        try:
            model = self._model(scene)
            if isinstance(model, Refused):
                return model
            with whole_runs():
                return values_of(self.asked, runs(model, self.plan, self.asked, self.method), self.words(point))
        except (solvers.SolverError, AccuracyError) as error:
            return f"{type(error).__name__}: {error}"

    def _model(self, scene: Scene) -> Model | Refused:
        """The model at a point, or why there is none, such as a preload that buckles it."""
        try:
            return scene.reduce(**self.reduction) if self.model is None else self.model.under(scene)
        except ValueError as error:
            return Refused(error)


@contextmanager
def _placed(where: str) -> Iterator[None]:
    """Errors of bad values say where."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"{error} ({where})") from None
