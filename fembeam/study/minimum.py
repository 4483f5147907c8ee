"""The least value of a quantity within bounds of parameters, and of other quantities.

    minimise f(x)    low <= x <= high,    g(x) <= bound

The box is first looked over at points spread evenly (Halton's sequence), then searched from the best of them: by SLSQP,
sequential quadratic programming, where all that is asked has exact gradients; else, and where that does not end at a
smooth minimum, by COBYQA, a trust-region method with quadratic models that needs no derivatives. From the best point
the way to a lower one beyond a limit is halved. Noise has the same seeds at every point, so that f is a function of x
alone.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import Bounds, NonlinearConstraint, minimize, nnls

from fembeam import plot
from fembeam.scene import Scene
from fembeam.statistics import Estimate
from fembeam.study.execution.checkpoint import Checkpoint
from fembeam.study.gradients import NoGradientError, gradient, has_gradients
from fembeam.study.measure import Plan, Start
from fembeam.study.quantities import Quantity, label, named
from fembeam.study.result import Result
from fembeam.study.trial import Maker, Trial
from fembeam.study.variation import Variation, collected, computed, identity_of
from fembeam.support import Part, is_finite, is_whole, note, number, require, titled
from solvers.problem import counted

Vector = NDArray[np.float64]
WHERE = "minimise"
LOOKS = 8  # points looked at first, for each parameter
NEAR = 10.0  # tolerances: a bound so near to the minimum is active
SMOOTH = 100.0  # tolerances: slope of the Lagrangian that is none, in units of the values' spread over the box


@dataclass(frozen=True)
class Limit:
    """An upper bound of a quantity, its value at the minimum, and whether it keeps the minimum from moving on."""

    name: str
    bound: float
    value: float
    active: bool


@dataclass(frozen=True, eq=False)
class Minimum(Result):
    """The least value found.

    Attributes
    ----------
    at : {path: value} of the parameters. value, standard_error : of the quantity there; NaN error of a single run.
    limits : of other quantities, each with name, bound, value, active.
    active : paths of parameters at an end of their bounds, and names of limits that are active.
    converged : False where `most` evaluations were too few.
    tried : all points, in the order of their evaluation. number : that of the minimum among them.
    gradients : how many exact ones the search used; 0 where it had none.
    """

    at: dict[str, float]
    value: float
    standard_error: float
    limits: tuple[Limit, ...]
    active: tuple[str, ...]
    converged: bool
    tried: Variation
    number: int
    gradients: int = 0

    @property
    def evaluations(self) -> int:
        """How many points were computed."""
        return len(self.tried)

    def __repr__(self) -> str:
        at = ", ".join(f"{name} = {value:.6g}" for name, value in self.at.items())
        return f"<least {self.tried.quantities[0]} {self.value:.6g} at {at}, {self.evaluations} evaluations>"

    def _parts(self) -> list[Part]:
        """What was found, which bounds are active, how many evaluations it took."""
        name, *bounded = self.tried.value_heads
        value = self.value if np.isnan(self.standard_error) else repr(Estimate(self.value, self.standard_error, 2))
        at = zip(self.tried.heads, self.at.items(), strict=True)
        ends = [(head, x, "at its bound" if path in self.active else "") for head, (path, x) in at]
        words = (f"at most {one.bound:g}{', active' * one.active}" for one in self.limits)
        limits = [(head, one.value, said) for head, one, said in zip(bounded, self.limits, words, strict=True)]
        used = f", {counted(self.gradients, 'gradient')}" if self.gradients else ""
        done = "converged" if self.converged else "NOT CONVERGED: allow more evaluations"
        return [
            (("", "least", ""), [(name, value, ""), *ends, *limits]),
            f"{self.evaluations} evaluations{used}, {done}",
        ]

    def table(self) -> list[dict[str, Any]]:
        """All points tried, one a row."""
        return self.tried.table()

    def _units(self) -> dict[str, str]:
        return self.tried._units()

    def plain(self) -> dict[str, Any]:
        """What was found, and all points, as JSON has them."""
        found: dict[str, Any] = super().plain()
        return {**found, "evaluations": self.evaluations, "tried": self.table()}

    figure = plot.minimum


def minimise(
    scene: Scene | Maker,
    parameters: Mapping[str, tuple[float, float]],
    quantity: str | Quantity,
    constraints: Mapping[Any, float] | None = None,
    duration: float | None = None,
    dt: float | None = None,
    discard: float = 0.0,
    seeds: Sequence[int] = (),
    tolerance: float = 1e-4,
    most: int = 200,
    gradients: bool | None = None,
    start: Start | None = None,
    solver: Any = None,
    executor: Executor | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
    progress: bool = False,
    **reduction: Any,
) -> Minimum:
    """Find the parameters within bounds at which a quantity is least.

    Parameters
    ----------
    scene, duration, dt, discard, start, solver, reduction : as for `vary`.
    parameters : {path: (low, high)}.
    quantity : a name of `quantities`, or a function of a run that gives a number.
    constraints : {quantity: largest value allowed}, such as ``{"peak_force": 20.0}``.
    seeds : of the noise, three or more, the same at every point: the minimum is that of these realisations.
    tolerance : of the parameters, relative to high - low, in (0, 0.1).
    most : evaluations allowed.
    gradients : whether to search by exact ones; None: where all that is asked has them, True: else refuse. They are
        those of `Run.sensitivity`, of a settled response of `Orbit.sensitivity`; amplitude, rms, peak_force,
        mean_force, contact_time and energy have them, and quantities of your own with a method
        ``derivative(change)``, see `fembeam.study.gradients`. Noise, functions that make scenes, and other methods
        than `Exponential` have none.
    executor : any `concurrent.futures.Executor`, for the first look over the box; the search is one after the other.
    checkpoint : file that keeps each point; what it holds is not computed again.

    Returns
    -------
    Minimum : the best of all points computed that keep the constraints.

    Raises
    ------
    ValueError : bad bounds, and all that `vary` refuses; a quantity that is NaN somewhere.
    RuntimeError : no point that keeps the constraints was found (with the nearest), or a run failed.

    Notes
    -----
    The search is local: of several valleys it takes the one with the best of the first points. Where contacts begin or
    orbits change, quantities jump, and so may the minimum; look at `vary` over the same bounds.

    A search by gradients ends where no slope is left that bounds and limits do not hold. Where it does not, as at a
    kink, a graze or in chaos, it goes on without them.

    References
    ----------
    T.M. Ragonneau, Model-based derivative-free optimization methods and software, PhD thesis, Hong Kong Polytechnic
    University (2022), chapters 5 to 7: COBYQA. D. Kraft, A software package for sequential quadratic programming,
    DFVLR-FB 88-28 (1988): SLSQP.

    Examples
    --------
    >>> import fembeam as fb
    >>> scene = fb.Scene(fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01)), [fb.Clamped(0.0)],
    ...                  base=fb.Harmonic(1e-3, 100.0), damping=fb.ModalDamping(0.05))
    >>> found = minimise(scene, {"damping.zeta[0]": (0.01, 0.1)}, "amplitude", duration=0.5, dt=1e-3, modes=1)
    >>> found.active
    ('damping.zeta[0]',)
    """
    box, limits = box_of(parameters), limits_of(constraints or {})
    check_search(tolerance, most, len(box))
    looks = LOOKS * len(box)
    plan = Plan(duration, dt, discard, seeds, start, solver)
    asked = [quantity, *(one for one, _ in limits)]
    known = gradients is None or isinstance(gradients, (bool, np.bool_))
    require(known, "gradients must be True, False or None", gradients, WHERE, "leave it out")
    first = _spread(looks, len(box))
    trial = Trial.of(scene, list(parameters), asked, plan, reduction).prepared(_within(box, first))
    if gradients is not False:
        gradients = has_gradients(trial, insist=gradients is True)
    kept = Checkpoint(checkpoint, partial(identity_of, trial))
    search = _Search(trial, box, np.array([bound for _, bound in limits]), kept)
    with kept:
        search.look(first, executor, titled(progress, WHERE))
        converged = search.descend(tolerance, most, gradients)
    return _found(search, tolerance, converged)


def check_search(tolerance: float, most: int, count: int) -> None:
    """Raise ValueError unless so many parameters can be searched by at most so many points, to this tolerance."""
    require(0.0 < number("tolerance", tolerance) < 0.1, "tolerance must lie in (0, 0.1)", tolerance, WHERE, "e.g. 1e-4")
    looks = LOOKS * count
    require(is_whole(most) and most > looks, f"most must be above the {looks} first points", most, WHERE, "e.g. 200")


def box_of(parameters: Mapping[str, Any]) -> Vector:
    """(d, 2) lowest and highest values, checked."""
    require(isinstance(parameters, Mapping) and bool(parameters), "parameters must be {path: (low, high)}", parameters,
            WHERE, "e.g. {'stops[0].gap': (0.0, 1e-3)}")  # fmt: skip
    for name, ends in parameters.items():
        pair = isinstance(ends, (tuple, list, np.ndarray)) and len(ends) == 2 and all(map(is_finite, ends))
        require(pair and bool(ends[0] < ends[1]), f"bounds of {name} must be two finite values, ascending", ends, WHERE,
                "give (low, high)")  # fmt: skip
    return np.array([list(ends) for ends in parameters.values()], dtype=float)


def limits_of(constraints: Mapping[Any, float]) -> list[tuple[Quantity, float]]:
    """Constrained quantities with their bounds, checked."""
    right = isinstance(constraints, Mapping)
    require(right, "constraints must be {quantity: bound}", constraints, WHERE, "e.g. {'peak_force': 100.0}")
    made = [(named(asked), bound) for asked, bound in constraints.items()]
    for one, bound in made:
        require(
            is_finite(bound), f"the bound of {label(one)} must be a finite number", bound, WHERE, "give the largest"
        )
    return made


def _spread(looks: int, numbers: int) -> Vector:
    """Shares (looks, numbers) of the box that Halton's sequence spreads over it; it begins in a corner, left out."""
    from scipy.stats import qmc  # here: it takes longer to load than all else of SciPy

    return np.asarray(qmc.Halton(numbers, scramble=False).random(looks + 1)[1:])


def _within(box: Vector, share: Vector) -> Vector:
    """Values of the parameters from shares of the box in [0, 1]."""
    return np.asarray(box[:, 0] + share * (box[:, 1] - box[:, 0]))


@dataclass
class _Search:
    """The points computed so far, as shares of the box, each once."""

    trial: Trial
    box: Vector
    bounds: Vector  # (c,)
    kept: Checkpoint
    shares: list[Vector] = field(default_factory=list)
    values: list[Vector] = field(default_factory=list)  # (1 + c,) each
    gradients: list[tuple[Vector, Vector]] = field(default_factory=list)  # shares, (1 + c, d)
    pressing: Any = False  # (c,) limits that gradients tell to be active

    def look(self, shares: Vector, executor: Executor | None = None, progress: str | None = None) -> None:
        """Compute these points."""
        points = _within(self.box, shares)
        failures = computed(self.trial, points, self.kept, executor, progress)
        if failures:
            i, reason = failures[0]
            raise RuntimeError(f"a run failed at {self.trial.words(points[i])}: {reason}; narrow the bounds")
        new = collected(self.trial, points, self.kept, (), ()).values
        for point, value in zip(points, new, strict=True):
            missing = [n for n, v in zip(self.trial.asked.names, value, strict=True) if not np.isfinite(v)]
            require(not missing, f"{', '.join(missing)} must have a value at every point", float("nan"),
                    self.trial.words(point), "take one that has, such as peak_force, 0 without contact")  # fmt: skip
        self.shares += list(shares)
        self.values += list(new)

    def value(self, x: Vector) -> Vector:
        """(1 + c,) quantity and constrained quantities at shares x, brought into the box."""
        share = np.clip(x, 0.0, 1.0)
        for known, value in zip(self.shares, self.values, strict=True):
            if np.array_equal(known, share):
                return value
        self.look(share[None])
        return self.values[-1]

    def best(self) -> int:
        """Number of the least value among points that keep the constraints, else of the least excess."""
        values = np.array(self.values)
        excess = ((values[:, 1:] - self.bounds) / self._sizes()[1:]).max(axis=1, initial=0.0)
        return int(np.lexsort((values[:, 0], np.maximum(excess, 0.0)))[0])

    def _sizes(self) -> Vector:
        """(1 + c,) sizes of the values, to make them comparable."""
        values = np.array(self.values)
        spread, size = np.ptp(values, axis=0), np.abs(values).max(axis=0)
        return np.where(spread > 0.0, spread, np.where(size > 0.0, size, 1.0))

    def gradient(self, x: Vector) -> Vector:
        """(1 + c, d) exact derivatives by the shares."""
        share = np.clip(x, 0.0, 1.0)
        for known, value in self.gradients:
            if np.array_equal(known, share):
                return value
        found = gradient(self.trial, _within(self.box, share[None])[0]) * (self.box[:, 1] - self.box[:, 0])
        self.gradients.append((share, found))
        return found

    def descend(self, tolerance: float, most: int, gradients: bool) -> bool:
        """Search from the best point; whether it converged."""
        if gradients:
            try:
                if self._by_gradients(tolerance, most):
                    return True
            except NoGradientError as error:
                note("%s", error)
        return self._by_models(tolerance, most)

    def _by_gradients(self, tolerance: float, most: int) -> bool:
        """SLSQP; whether it ends at a point where the Lagrangian is flat."""
        size, sure, limited = self._sizes(), tolerance**2, list[Any]()
        if len(self.bounds):
            within = self.bounds / size[1:] - 2.0 * sure  # SLSQP keeps limits to its own accuracy only
            limited.append({
                "type": "ineq",
                "fun": lambda x: within - self._counted(x, most)[1:] / size[1:],
                "jac": lambda x: -self.gradient(x)[1:] / size[1:, None],
            })  # fmt: skip
        last = self.shares[self.best()]

        def moved(x: Vector) -> None:
            nonlocal last
            if np.abs(x - last).max() <= tolerance:
                raise StopIteration
            last = x.copy()

        with suppress(StopIteration):
            minimize(
                lambda x: self._counted(x, most)[0] / size[0],
                last,
                jac=lambda x: self.gradient(x)[0] / size[0],
                method="SLSQP",
                bounds=Bounds(np.zeros(len(self.box)), np.ones(len(self.box))),
                constraints=limited,
                callback=moved,
                options={"ftol": sure, "maxiter": most},
            )
        return self._is_flat(tolerance, size)

    def _counted(self, x: Vector, most: int) -> Vector:
        """The values at shares x; NoGradientError beyond `most` evaluations, at which the search ends."""
        if len(self.values) >= most:
            raise NoGradientError(f"{most} evaluations were too few")
        return self.value(x)

    def _is_flat(self, tolerance: float, size: Vector) -> bool:
        """Whether no way leads down from the best point: multipliers, none negative, leave no slope."""
        best = self.best()
        x, values = self.shares[best], self.values[best]
        slopes = self.gradient(x) / size[:, None]
        near = (self.bounds - values[1:]) / size[1:] <= NEAR * tolerance * np.abs(slopes[1:]).max(axis=1, initial=0.0)
        unit = np.eye(len(x))
        held = [*slopes[1:][near], *(-unit[x <= NEAR * tolerance]), *unit[1.0 - x <= NEAR * tolerance]]
        self.pressing = near
        left = nnls(np.array(held).T, -slopes[0])[1] if held else float(np.linalg.norm(slopes[0]))
        return bool(np.all(values[1:] <= self.bounds)) and left <= SMOOTH * tolerance

    def _by_models(self, tolerance: float, most: int) -> bool:
        """COBYQA; whether it converged."""
        size, d, allowed = self._sizes(), len(self.box), list[NonlinearConstraint]()
        if len(self.bounds):
            limits = self.bounds / size[1:]
            allowed.append(NonlinearConstraint(lambda x: self.value(x)[1:] / size[1:], -np.inf, limits))
        radius = max(0.5 * len(self.values) ** (-1.0 / d), 2.0 * tolerance)  # half the distance of the first points
        radii = {"initial_tr_radius": radius, "final_tr_radius": tolerance}
        found = minimize(
            lambda x: self.value(x)[0] / size[0],
            self.shares[self.best()],
            method="COBYQA",
            bounds=Bounds(np.zeros(d), np.ones(d)),
            constraints=allowed,
            options={**radii, "maxfev": max(most - len(self.values), 1)},
        )
        self.pressing = np.zeros(len(self.bounds), dtype=bool)
        self._close_in(tolerance, most)
        return bool(found.success)

    def _keeps(self, x: Vector) -> bool:
        """Whether the limits are kept at shares x."""
        return bool(np.all(self.value(x)[1:] <= self.bounds))

    def _close_in(self, tolerance: float, most: int) -> None:
        """Halve the way from the best point to the nearest with a lower value, which breaks a limit.

        It ends when both are within the tolerance, or the value no longer falls. Where limited quantities jump, as
        statistics of noise do, models end far from a limit, or beyond it.
        """
        inside, least = self.shares[self.best()], self.values[self.best()][0]
        lower = [share for share, value in zip(self.shares, self.values, strict=True) if value[0] < least]
        if not lower or not self._keeps(inside):
            return
        outside = min(lower, key=lambda share: float(np.abs(share - inside).max()))
        while np.abs(outside - inside).max() > tolerance and len(self.values) < most:
            middle = 0.5 * (inside + outside)
            if not self._keeps(middle):
                outside = middle
            elif self.value(middle)[0] < self.value(inside)[0]:
                inside = middle
            else:
                return


def _found(search: _Search, tolerance: float, converged: bool) -> Minimum:
    """The best point, and what holds it there."""
    best, shares, values = search.best(), np.array(search.shares), np.array(search.values)
    tried = collected(search.trial, _within(search.box, shares), search.kept, (), ())
    limited = list(zip(tried.quantities[1:], search.bounds.tolist(), values[best, 1:].tolist(), strict=True))
    if any(value > bound for _, bound, value in limited):
        told = ", ".join(f"{name} = {value:.6g} (at most {bound:g})" for name, bound, value in limited)
        where = search.trial.words(tried.points[best])
        raise RuntimeError(f"no point keeps the constraints; the nearest is {where} with {told}")
    around = np.abs(shares - shares[best]).max(axis=1) <= NEAR * tolerance
    pressing = np.atleast_1d((values[around, 1:] > search.bounds).any(axis=0) | search.pressing)
    limits = tuple(Limit(*one, bool(near)) for one, near in zip(limited, pressing, strict=True))
    ends = np.minimum(shares[best], 1.0 - shares[best]) <= NEAR * tolerance
    active = [name for name, end in zip(tried.names, ends, strict=True) if end]
    active += [one.name for one in limits if one.active]
    at = dict(zip(tried.names, tried.points[best].tolist(), strict=True))
    value, error = float(tried.values[best, 0]), float(tried.standard_error[best, 0])
    return Minimum(at, value, error, limits, tuple(active), converged, tried, best, len(search.gradients))
