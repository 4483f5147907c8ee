"""Exact gradients of a study's quantities, where they have them: from `Run.sensitivity` or `Orbit.sensitivity`.

A quantity has one if it offers ``derivative(change)``, its derivative by one parameter, from what that changes in a
run. Of the named ones these are `amplitude`, `rms`, `peak_force`, `mean_force`, `contact_time` and `energy`. The
derivative of a settled response is that of the orbit of the loads' period that it has come to.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

import solvers
from fembeam.model import Model, Orbit, Run
from fembeam.model.sensitivity import Sensitivity, by_each, of_orbit_by_each
from fembeam.scene import Place, Scene
from fembeam.study.measure import cut, runs, values_of
from fembeam.study.quantities import mean_in_time, place_of
from fembeam.study.trial import Trial
from fembeam.support import require
from reduction import AccuracyError
from solvers.problem.whole_runs import whole_runs

Vector = NDArray[np.float64]
SAME = 1e-3  # by which the orbit may differ from the settled response, relatively
LOST = 1e6  # growth of small changes, above which a derivative says nothing of a wider neighbourhood


class NoGradientError(ArithmeticError):
    """A quantity has no derivative here, or none that serves a search."""


@dataclass(frozen=True, eq=False)
class Change:
    """What one parameter changes in the part of a run that counts.

    Attributes
    ----------
    run : that part. found : derivatives along the whole run. kept : samples of `found` that belong to the part.
    mine : (c,) which of its contacts do. stretch : relative change of the period of an orbit; 0 of a run.
    """

    run: Run
    found: Sensitivity
    kept: slice
    mine: NDArray[np.bool_]
    stretch: float = 0.0

    def mean(self, values: Vector, changes: Vector) -> float:
        """Derivative of the mean in time of values (k,) at the samples, from those at fixed times.

        Of an orbit, whose period T may change, from those at fixed phases t/T: ∂f/∂p + ḟ t/T dT/dp.
        """
        if self.stretch:
            changes = changes + self.stretch * self.run.t * _periodic_rate(values, float(self.run.t[1]))
        return mean_in_time(self.run, changes)

    @property
    def q(self) -> Vector:
        """(k, n) of the coordinates."""
        return self.found.q[self.kept]

    @property
    def q_dot(self) -> Vector:
        """(k, n) of their rates."""
        return self.found.q_dot[self.kept]

    def signal(self, stop: int | str = 0, z: Place | None = None) -> tuple[Vector, Vector]:
        """Of δ and δ̇ of a stop, or of u and u̇ at z, or at the tip of a scene without stops: as `quantities.signal`."""
        if z is None and len(self.run.stops):
            both = self.found.indentation(stop), self.found.indentation_rate(stop)
        else:
            place = place_of(self.run, z)
            both = self.found.displacement(place), self.found.velocity(place)
        return both[0][self.kept], both[1][self.kept]

    def of_contacts(self, name: str) -> Vector:
        """(c,) of "entries", "exits", "peak_force" or "impulse" of the contacts of the part."""
        return np.asarray(getattr(self.found, name)[self.mine])

    @cached_property
    def omega(self) -> Vector:
        """(n,) of the natural frequencies."""
        models = self.found.models
        size = len(self.found.run.readout.model.omega)
        return np.zeros(size) if models is None else models.derivative(lambda one: one.omega)

    @cached_property
    def stiffness(self) -> Vector:
        """(n, n) of the matrix K on the coordinates."""
        size, systems = len(self.found.run.readout.model.omega), self.found.systems
        return np.zeros((size, size)) if systems is None else systems.derivative(lambda one: one.K)


def _periodic_rate(values: Vector, h: float) -> Vector:
    """Derivative of even samples of a period, both ends included, by central differences of fourth order."""
    a, b, c, d = (np.roll(values[:-1], k) for k in (2, 1, -1, -2))
    rate = (8.0 * (c - b) - (d - a)) / (12.0 * h)
    return np.append(rate, rate[0])


def has_gradients(trial: Trial, insist: bool = False) -> bool:
    """Whether all that is asked has exact derivatives: by paths of a scene, without noise; ValueError if it must."""
    reasons: list[tuple[str, Any]] = [
        (f"{name} has no exact derivative", name) for name, one in trial.asked.parts if not hasattr(one, "derivative")
    ]
    if not isinstance(trial.scene, Scene):
        reasons.append(("a function that makes scenes has no exact derivatives", trial.scene))
    if trial.plan.seeds:
        reasons.append(("means over noise have no exact derivatives here", trial.plan.seeds))
    if not isinstance(trial.method, solvers.Exponential):
        reasons.append(("exact derivatives need the method Exponential", trial.method))
    for reason, value in reasons if insist else ():
        require(False, reason, value, "minimise", "leave out gradients=True")
    return not reasons


@whole_runs()
def gradient(trial: Trial, point: Vector) -> Vector:
    """(q, d) derivatives of the quantities by the parameters at a point.

    Raises
    ------
    NoGradientError : a contact grazes there, motion is chaotic or does not repeat with the load.
    """
    scene = trial.at(point.tolist())
    try:
        model = scene.reduce(**trial.reduction) if trial.model is None else replace(trial.model, scene=scene)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of growth, which is looked at below
            if trial.plan.duration is None:
                return _of_settled(trial, model)
            return _of_run(trial, model)
    except (ArithmeticError, ValueError, solvers.SolverError, solvers.OrbitError, AccuracyError) as error:
        raise NoGradientError(f"no gradient at {trial.words(point.tolist())}: {error}") from error


def _of_run(trial: Trial, model: Model) -> Vector:
    """Of a run, from `discard` on."""
    plan = trial.plan
    assert plan.duration is not None
    start = None if plan.start is None else plan.start(model)
    run = model.simulate(plan.duration, plan.dt, start, trial.method)
    part = cut(run, plan.discard, plan.duration)
    mine = (run.contacts.t_in >= plan.discard) & (run.contacts.t_in < plan.duration)
    kept = slice(len(run.t) - len(part.t), None)
    return np.stack([_column(trial, part, one, kept, mine) for one in by_each(run, trial.names)], axis=1)


def _of_settled(trial: Trial, model: Model) -> Vector:
    """Of the orbit that the settled response has come to."""
    parts = runs(model, trial.plan, trial.asked, trial.method)
    values, last = values_of(trial.asked, parts, "gradient").mean(axis=0), parts[-1]
    orbit: Orbit = model.orbit(1, np.concatenate((last.q[-1], last.q_dot[-1])))
    end = float(orbit.run.t[-1])
    part, mine = cut(orbit.run, 0.0, end), orbit.contacts.t_in < end
    if not np.allclose(trial.asked(part), values, rtol=SAME, atol=0.0):
        raise NoGradientError("the response does not repeat with the load")
    kept = slice(0, len(part.t))
    return np.stack([_column(trial, part, one, kept, mine) for one in of_orbit_by_each(orbit, trial.names)], axis=1)


def _column(trial: Trial, part: Run, found: Sensitivity, kept: slice, mine: NDArray[np.bool_]) -> Vector:
    """(q,) derivatives by one parameter."""
    if found.growth > LOST:
        raise NoGradientError(f"small changes grow by {found.growth:.3g}")
    if len(found.contacts) != len(mine):
        raise NoGradientError(f"rounding changes the number of contacts, {len(mine)}")
    stretch = found.period / found.run.t[-1] if found.period else 0.0
    change = Change(part, found, kept, mine, stretch)
    values = np.array([float(one.derivative(change)) for _, one in trial.asked.parts])  # type: ignore[attr-defined]
    if not np.isfinite(values).all():
        raise NoGradientError("a quantity has no value")
    return values
