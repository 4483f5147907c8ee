"""Bifurcation diagrams by brute force: simulate, let the motion settle, sample it once per period of the load.

Slow, and without the unstable motions, but independent of shooting and continuation: the check on a branch.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

import solvers
from fembeam import plot
from fembeam.model import Model, Run, extremes_of, load_period, observed
from fembeam.model.branch import Family
from fembeam.plot.axis_names import axis_name, parameter_unit
from fembeam.plot.units import motion_for
from fembeam.scene import Place, path_of, turns_at
from fembeam.study.execution.checkpoint import Checkpoint, Values, study_identity
from fembeam.study.execution.executors import spread
from fembeam.study.measure import require_model, samples_per_period
from fembeam.study.result import Result
from fembeam.support import Part, is_whole, numbers, require
from solvers.problem import counted

Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Bifurcation(Result):
    """What settled motion does at each value of a parameter.

    Attributes
    ----------
    name : path of the parameter. z : place whose displacement is watched. title : name of the parameter for axes.
        unit : of the parameter, empty without one.
    parameter : (k,) values. strobes : (k, p, 2n) states at t = 0 of p successive periods: the Poincaré map.
    peaks : (k, p) largest |u(z)| in each of these periods, m or rad; between samples by cubics.
    """

    name: str
    z: Any
    parameter: Vector
    strobes: Vector
    peaks: Vector
    title: str = ""
    unit: str = ""

    def __repr__(self) -> str:
        at, each = counted(len(self.parameter), "value"), counted(self.peaks.shape[1], "period")
        return f"<settled motion at {at} of {self.name}, {each} each>"

    def _parts(self) -> list[Part]:
        """Smallest and largest peak at each value."""
        scale, unit = motion_for(self.z, self.peaks)
        lowest, highest = scale * self.peaks.min(axis=1), scale * self.peaks.max(axis=1)
        rows = list(zip(self.parameter.tolist(), lowest.tolist(), highest.tolist(), strict=True))
        name = f"{self.name} / {self.unit}" if self.unit else self.name
        return [repr(self), ((name, f"smallest peak / {unit}", f"largest peak / {unit}"), rows)]

    def table(self) -> list[dict[str, Any]]:
        """One period a row, the peak in m or rad."""
        return [{self.name: parameter, "peak": peak} for parameter, peak in zip(*self.cloud(), strict=True)]

    def _units(self) -> dict[str, str]:
        return {self.name: self.unit, "peak": "rad" if turns_at(self.z) else "m"}

    figure = plot.bifurcation

    def cloud(self) -> tuple[Vector, Vector]:
        """(parameter, peak) of every period, flat, as `fembeam.plot.branch` takes it."""
        return np.repeat(self.parameter, self.peaks.shape[1]), self.peaks.ravel()


def bifurcation(
    model: Model,
    parameter: str,
    values: Sequence[float] | Vector,
    z: Place | None = None,
    settle: int = 200,
    keep: int = 24,
    start: ArrayLike | None = None,
    executor: Executor | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
) -> Bifurcation:
    """Simulate a model at each value of a parameter and keep what it settles to.

    Parameters
    ----------
    parameter : such as "omega"; see `fembeam.scene.parameters`. values : (k,) where to simulate.
    z : place whose displacement is watched, m; None is the first stop.
    settle, keep : periods of the load left out and kept.
    start : (2n,) for all of them; None is rest.
    executor : any `concurrent.futures.Executor` to spread the values over.
    checkpoint : file that keeps each value; what it holds is not computed again, also of other values.

    Returns
    -------
    Bifurcation. Raises ValueError for bad input or the checkpoint of another study, solvers.SolverError when a run
    fails.

    Examples
    --------
    >>> import fembeam as fb
    >>> from contacts import Hertz
    >>> steel = fb.Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)
    >>> scene = fb.Scene(fb.Beam(0.26, steel), [fb.Clamped(0.0)], stops=[fb.Stop(0.26, Hertz(1e8))],
    ...                  damping=fb.ModalDamping(0.05), base=fb.Harmonic(1e-3, 150.0))
    >>> bifurcation(scene.reduce(modes=1), "omega", [150.0, 160.0], settle=20, keep=4).peaks.shape
    (2, 4)
    """
    require_model(model, "bifurcation")
    path = path_of(model.scene, parameter)
    values = np.atleast_1d(numbers("values", values, "bifurcation", "give a range such as np.linspace(60, 900, 200)"))
    require(values.size > 0 and bool(np.all(np.isfinite(values))), "values must be finite numbers", values,
            "bifurcation", "give a range such as np.linspace(60, 900, 200)")  # fmt: skip
    for name, count in (("settle", settle), ("keep", keep)):
        require(is_whole(count) and count > 0, f"{name} counts periods and must be above 0", count,
                "bifurcation", "give a whole number")  # fmt: skip
    place = observed(model) if z is None else z
    state = model.rest() if start is None else np.asarray(start, dtype=float)
    require(state.shape == model.rest().shape, f"start must have shape {model.rest().shape}, [q, q_dot]", state.shape,
            "bifurcation", "use model.state(displacement, velocity)")  # fmt: skip
    task = partial(_settled, Family(model, path, 1), place, settle, keep, state)
    asked = {"parameter": path, "z": place, "settle": settle, "keep": keep, "start": state}
    kept = Checkpoint(checkpoint, lambda: study_identity(model, study="bifurcation", **asked))
    missing = [value for value in values.tolist() if repr(value) not in kept.values]
    with kept:
        spread(task, missing, executor, "bifurcation", lambda i, found: kept.add(repr(missing[i]), found))
    strobes, peaks = (np.array([kept.values[repr(v)][name] for v in values.tolist()]) for name in ("states", "peaks"))
    told = axis_name(path, model.scene), parameter_unit(path, model.scene)
    return Bifurcation(path, place, values, strobes, peaks, *told)


def _settled(family: Family, z: Any, settle: int, keep: int, start: Vector, value: float) -> Values:
    """States and peaks of the periods kept."""
    model = family.at(value)
    T, n = load_period(model.scene), len(model.omega)
    method = solvers.Exponential(1e-8, ledger=False)
    # settling needs no samples; but it is one run: a restart would forget the entry rate of a contact under way
    looks = samples_per_period(model.scene, model.omega, T)
    times = np.linspace(settle * T, (settle + keep) * T, keep * looks + 1)
    run = solvers.integrate(model.system, start[:n], start[n:], (settle + keep) * T, times, method)
    states = np.concatenate((run.q, run.q_dot), axis=1)[:-1:looks]
    seen = Run.of(model, run)
    u, v = seen.displacement(z), seen.velocity(z)
    periods = [slice(i, i + looks + 1) for i in range(0, keep * looks, looks)]
    peaks = np.array([np.abs(extremes_of(run.t[one], u[one], v[one])).max() for one in periods])
    return {"states": states, "peaks": peaks}
