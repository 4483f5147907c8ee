"""Where a method of constant step fails: one run per cell of a grid (step × modes, or step × contact stiffness)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

import solvers
from fembeam import plot
from fembeam.model import Model
from fembeam.scene import Scene
from fembeam.study.result import Result
from fembeam.study.speed_accuracy import method_name
from fembeam.support import Part, counting, require, vector
from solvers.problem.whole_runs import whole_runs

Vector = NDArray[np.float64]
SAMPLES = 400  # per run, for the error


class Verdict(IntEnum):
    """What became of a run."""

    ACCURATE = 0
    WRONG = 1
    MISSED = 2
    UNSTABLE = 3

    @property
    def words(self) -> str:
        """For legends and tables."""
        return ["stable and accurate", "stable and wrong", "missed contacts", "unstable"][self]


@dataclass(frozen=True, eq=False)
class StabilityMap(Result):
    """A grid of verdicts.

    Attributes
    ----------
    method : its name. steps : (k,) s. axis : "modes" or "stiffness". rows : (r,) mode counts or N/m^p.
    verdict : (r, k) of `Verdict`. error : (r, k) largest error of δ over the run, relative to its range.
    flight, contact : (r,) s, predicted limits. tolerance : of the error.
    """

    VERDICTS: ClassVar[type[Verdict]] = Verdict
    method: str
    steps: Vector
    axis: str
    rows: Vector
    verdict: NDArray[np.int64]
    error: Vector
    flight: Vector
    contact: Vector
    tolerance: float

    def __repr__(self) -> str:
        return f"<stability of {self.method} over {len(self.steps)} steps and {len(self.rows)} values of {self.axis}>"

    def _parts(self) -> list[Part]:
        head = self.axis, *(f"{dt:.1e}" for dt in self.steps), "predicted"
        limits = np.minimum(self.flight, self.contact)
        rows = [
            (f"{row:g}", *(".wMU"[v] for v in line), f"{limit:.1e}")
            for row, line, limit in zip(self.rows, self.verdict, limits, strict=True)
        ]
        return [(head, rows), ". accurate, w wrong, M missed contacts, U unstable"]

    def table(self) -> list[dict[str, Any]]:
        """One run a row."""
        return [
            {self.axis: row, "step": step, "verdict": Verdict(int(self.verdict[i, j])).words, "error": self.error[i, j]}
            for i, row in enumerate(self.rows)
            for j, step in enumerate(self.steps)
        ]

    def _units(self) -> dict[str, str]:
        return {"step": "s", "stiffness": "N/m^p"}

    figure = plot.stability_map


def stability_map(
    scene: Scene,
    method: Callable[[float], Any],
    steps: ArrayLike,
    modes: int | Sequence[int] = (1, 2, 3, 5, 10),
    stiffness: Sequence[float] | None = None,
    duration: float = 0.1,
    tolerance: float = 0.01,
    start: Callable[[Model], Any] | None = None,
    progress: bool = False,
) -> StabilityMap:
    """Run a method over a grid of steps and mode counts, or steps and contact stiffnesses.

    Every run is forced to start, and compared with ``Exponential(1e-11)`` on the same model.

    Parameters
    ----------
    scene : with at least one stop or element.
    method : step -> method, such as `solvers.RK4` or ``lambda dt: solvers.HenonRK2(dt, dt / 4)``.
    steps : (k,) s.
    modes : mode counts, one row each; with ``stiffness`` a single one.
    stiffness : stiffnesses for the laws of all stops and elements, one row each.
    duration : s; some ten impacts at most, as later trajectories of any two settings differ.
    tolerance : largest error of an accurate run, relative to the range of δ at the first stop.
    start : model -> (2n,); None is rest.
    progress : show a bar (on terminals and in notebooks only).

    Returns
    -------
    StabilityMap. Draw it with ``fb.plot.stability_map``.

    Raises
    ------
    ValueError for bad input, before computing; for a first stop at which nothing moves.

    Examples
    --------
    >>> import fembeam as fb
    >>> import solvers
    >>> from contacts import Hertz
    >>> steel = fb.Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)
    >>> scene = fb.Scene(fb.Beam(0.26, steel), [fb.Clamped(0.0)], stops=[fb.Stop(0.26, Hertz(1e8))],
    ...                  damping=fb.ModalDamping(0.02), base=fb.Harmonic(1e-3, 100.0))
    >>> found = stability_map(scene, solvers.RK4, [1e-5, 1e-2], modes=[1, 2], duration=0.05)
    >>> (found.verdict[:, 1] == Verdict.UNSTABLE).tolist()
    [False, True]
    """
    where = "stability_map"
    steps = vector("steps", steps, where, "e.g. [1e-5, 1e-4]", "must be positive (s)",
                   lambda x: np.isfinite(x) & (x > 0.0))  # fmt: skip
    require(len(scene.acting) > 0, "the scene must have a stop or element", 0, where, "add one")
    require(0.0 < tolerance < 1.0, "tolerance must lie in (0, 1)", tolerance, where, "e.g. 0.01")
    models, axis, rows = _models(scene, modes, stiffness)
    require(bool(models), f"{axis} must hold one", rows, where, "e.g. modes=[1, 2]")
    with counting(progress, total=len(models) * len(steps), unit=" runs") as bar:

        def cell(model: Model, dt: float) -> tuple[Verdict, float]:
            judged = _cell(model, method, dt, duration, tolerance, start)
            bar.update()
            return judged

        cells = [[cell(model, dt) for dt in steps] for model in models]
    limits = [_limits(model, method, steps, duration) for model in models]
    flight, contact = np.array(limits).T
    return StabilityMap(
        method_name(method(float(steps[0]))),
        steps,
        axis,
        np.array(rows, dtype=float),
        np.array([[int(verdict) for verdict, _ in line] for line in cells]),
        np.array([[error for _, error in line] for line in cells]),
        flight,
        contact,
        tolerance,
    )


def _models(scene: Scene, modes: int | Sequence[int], stiffness: Sequence[float] | None) -> tuple[list, str, list]:
    """One model per row."""
    if stiffness is None:
        counts = [int(n) for n in np.atleast_1d(np.asarray(modes))]
        return [scene.reduce(modes=n) for n in counts], "modes", counts
    require(isinstance(modes, (int, np.integer)), "modes must be one count when stiffness is given", modes,
            "stability_map", "e.g. modes=2")  # fmt: skip
    for part in scene.acting:
        require(hasattr(part.law, "stiffness"), "every law must have a stiffness", part.law, "stability_map",
                "vary modes instead")  # fmt: skip
    models = []
    for value in stiffness:
        changed: dict[str, Any] = {
            name: [replace(part, law=replace(part.law, stiffness=float(value))) for part in getattr(scene, name)]
            for name in ("stops", "elements")
        }
        models.append(replace(scene, **changed).reduce(modes=int(modes)))  # type: ignore[arg-type]
    return models, "stiffness", list(stiffness)


def _limits(model: Model, method: Callable[[float], Any], steps: Vector, duration: float) -> tuple[float, float]:
    """Predicted limits as values of the map's step: a method with a second step scales it along."""
    made = method(float(steps[0]))
    limit = made.stable_dt(model.system, duration=duration)
    flight, contact = (float(steps[0]) / step for step in made.steps)
    return limit.flight * flight, limit.contact * contact


@whole_runs()
def _cell(model: Model, method: Any, dt: float, duration: float, tolerance: float, start: Any) -> tuple[Verdict, float]:
    """One run judged."""
    forced = replace(method(float(dt)), force_unstable=True)
    state = None if start is None else start(model)
    best = _truth(model, duration, state)
    try:
        run = model.simulate(duration, duration / SAMPLES, state, forced)
    except solvers.SolverError:
        return Verdict.UNSTABLE, np.inf
    delta, wanted = run.indentation(), best.indentation()
    error = float(np.abs(delta - wanted).max() / np.ptp(wanted))
    if error <= tolerance:
        return Verdict.ACCURATE, error
    return Verdict.MISSED if len(run.contacts) < len(best.contacts) else Verdict.WRONG, error


def _truth(model: Model, duration: float, start: Any) -> Any:
    """The reference, once per model; ValueError where nothing moves, to which errors could be relative."""
    key = "truth of a stability map", duration, None if start is None else tuple(np.asarray(start))
    best = solvers.Exponential(1e-11, ledger=False)
    found = model.system.kept.get(key, lambda: model.simulate(duration, duration / SAMPLES, start, best))
    moved = float(np.ptp(found.indentation()))
    require(moved > 0.0, "δ of the first stop must move", moved, "stability_map", "give the scene loads, or start=")
    return found
