"""The peak of a response curve over a second number of the scene: how high it is, where it lies, where it is least.

    a(ω, p) = ½ (max u - min u) over a period,   ∂a/∂ω = 0,   da_peak/dp = ∂a/∂p

For each p a sweep of orbits along ω shows the largest amplitude, in steps that shrink where it rises; where it jumps, a
branch passes the folds by its arc length. From there the peak is searched (Brent), and a secant through exact ∂a/∂ω of
`Orbit.sensitivity` ends it. At the peak the amplitude changes with p alone, so that ∂a/∂p is the slope of the curve of
peaks.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import minimize_scalar

from fembeam import plot
from fembeam.model import Model, Orbit, load_period, observed
from fembeam.model.branch import Family
from fembeam.model.sensitivity import of_amplitude
from fembeam.plot.axis_names import axis_name, parameter_unit
from fembeam.scene import Scene, called, path_of, turns_at, with_value
from fembeam.study.execution.checkpoint import Checkpoint, study_identity
from fembeam.study.measure import require_model
from fembeam.study.response_curve import ResponseCurve, Seen, arrays_of, restored
from fembeam.study.result import Result, column, with_units
from fembeam.support import Part, counting, is_finite, numbers, require

Vector = NDArray[np.float64]
WHERE = "study.peak"
ROUGHLY = 1e-6  # of ω: how near to the peak it is searched by amplitudes
APART = 1e-3  # of the bracket: distance of two slopes through which the secant goes
FAR = 30.0  # times what the search is sure of: a secant that leads further off meets a corner
SURE = 1e-6  # of the least amplitude: by how much another value could lie below it
LOOKS = 12  # values of p at which the least peak is searched


@dataclass(frozen=True)
class Top:
    """One peak: `value` of p, `at` its ω, amplitude (m), slope da/dp (NaN where a contact grazes), `stable`."""

    value: float
    at: float
    amplitude: float
    slope: float
    stable: bool
    orbit: Orbit = field(repr=False, compare=False)


@dataclass(frozen=True, eq=False, repr=False)
class Peak(Result):
    """The peak of a response curve over another number of the scene.

    Attributes
    ----------
    parameter, over : names of ω, along which there is a peak, and of p.
    tops : one for each value of p, each with its `orbit`.
    least : where the peak is least between the values, refined; None where it is so at the first or last value.
    z : where the amplitude is taken.
    titles : of p and ω, for axes. units : of these alone, empty where not known.
    """

    INDEX: ClassVar[str] = "value"

    parameter: str
    over: str
    tops: tuple[Top, ...]
    least: Top | None
    z: Any
    titles: tuple[str, str]
    units: tuple[str, str] = ("", "")

    values = column("tops", "value", "(k,) of p.")
    at = column("tops", "at", "(k,) ω of the peaks.")
    amplitude = column("tops", "amplitude", "(k,) m: half the range of the displacement.")
    slope = column("tops", "slope", "(k,) da/dp of the peaks, exact; NaN where a contact grazes.")
    stable = column("tops", "stable", "(k,) whether the orbits of the peaks are stable.")

    def __repr__(self) -> str:
        low, high = self.tops[0].value, self.tops[-1].value
        return f"<peak along {self.parameter} at {len(self.tops)} values of {self.over}, {low:.6g} to {high:.6g}>"

    def table(self) -> list[dict[str, Any]]:
        """A row for each value of p, in SI units."""
        names = "value", "at", "amplitude", "slope", "stable"
        return [{name: getattr(one, name) for name in names} for one in self.tops]

    def plain(self) -> dict[str, Any]:
        """What was found, as JSON has it, without orbits."""
        least = None if self.least is None else {name: getattr(self.least, name) for name in self.table()[0]}
        return {"parameter": self.parameter, "over": self.over, "peaks": self.table(), "least": least}

    def _units(self) -> dict[str, str]:
        length, (unit, of_place) = "rad" if turns_at(self.z) else "m", self.units
        slope = f"{length}/{unit if unit.isalpha() else f'({unit})'}" if unit else ""
        return {"value": unit, "at": of_place, "amplitude": length, "slope": slope}

    def _parts(self) -> list[Part]:
        names = self.over, f"peak at {self.parameter}", "amplitude", "slope"
        head = *with_units(names, list(self._units().values())), "stable"
        rows = [(*list(row.values())[:-1], "yes" if row["stable"] else "no") for row in self.table()]
        one, least = self.least, "least at the end of the values: widen them"
        if one is not None:
            unit, at = self._units()["amplitude"], f"{self.over} = {one.value:.6g}, {self.parameter} = {one.at:.6g}"
            least = f"least {one.amplitude:.6g} {unit} at {at}"
        return [repr(self), (head, rows), least]

    figure = plot.peak_curve


def peak(
    model: Model,
    parameter: str = "omega",
    over: str = "",
    values: ArrayLike = (),
    span: tuple[float, float] = (0.0, 0.0),
    z: Any = None,
    progress: bool = False,
    checkpoint: str | os.PathLike[str] | None = None,
) -> Peak:
    """The largest amplitude along one number of the scene, over another one: height, place, and where it is least.

        ∂a/∂ω = 0,   a = ½ (max u - min u),   da_peak/dp = ∂a/∂p

    Parameters
    ----------
    parameter : ω, along which there is a peak, such as "omega". over : p, such as "elements[damper].law.limit"; paths
        as for `vary`.
    values : (k,) of p, ascending, two or more.
    span : (lowest, highest) ω, with the peak inside it for every value.
    z : m, or (place, direction), of the displacement u; None: the first stop or element, else the tip.
    progress : show a bar (on terminals and in notebooks only).
    checkpoint : file that keeps each peak; what it holds is not computed again, also of other values.

    Returns
    -------
    Peak : ``values``, ``at``, ``amplitude``, ``slope``, ``stable``, ``least``; print it, `table()`, `figure()`.

    Raises
    ------
    ValueError : unknown paths, values that do not ascend, an empty span, a peak at an end of the span, the checkpoint
        of another study.
    solvers.OrbitError : no periodic motion to begin with.

    Notes
    -----
    Of several peaks within the span the largest counts; where two change places the curve has a corner, and `least` may
    lie at it. ω is right to 1e-6 of itself and better, the amplitude to rounding. Orbits of the load's own period are
    looked at, whether stable or not: see `stable`.

    References
    ----------
    J.P. Den Hartog, Mechanical Vibrations (1985), section 3.3: the damper that keeps the peak least.

    Examples
    --------
    >>> import fembeam as fb
    >>> from contacts import Jenkins
    >>> rod = fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01))
    >>> scene = fb.Scene(rod, [fb.Clamped(0.0)], elements=[fb.Element(0.5, Jenkins(2e3, 1.0), name="damper")],
    ...                  forces=[fb.PointForce(0.5, fb.Harmonic(1.0, 200.0))], damping=fb.ModalDamping(0.01))
    >>> found = peak(scene.reduce(modes=1), "omega", "elements[damper].law.limit", [1.4, 1.5], (200.0, 230.0))
    >>> (found.slope > 0.0).tolist()  # the limit of slip at which the peak is lowest lies between, at 1.44 N
    [False, True]
    """
    require_model(model, "peak")
    p = check_peak(model.scene, parameter, over, values, span)
    search = _Search(model, path_of(model.scene, parameter), path_of(model.scene, over), z, span, checkpoint)
    with search.kept, counting(progress, p, unit=" values") as bar:
        tops = [search.top(float(value)) for value in bar]
        least = _least(search, tops)
    titles = axis_name(search.over, model.scene), axis_name(search.parameter, model.scene)
    names = called(model.scene, parameter), called(model.scene, over)
    units = parameter_unit(search.over, model.scene), parameter_unit(search.parameter, model.scene)
    return Peak(*names, tuple(tops), least, search.z, titles, units)


def check_peak(
    scene: Scene, parameter: str, over: str, values: ArrayLike, span: Any, where: str = WHERE, name: str = "values"
) -> Vector:
    """Values of p; ValueError for what `peak` refuses."""
    p = np.atleast_1d(numbers(name, values, where, "give a row of them"))
    valid = p.ndim == 1 and p.size > 1 and bool(np.isfinite(p).all() and np.all(np.diff(p) > 0.0))
    require(valid, f"{name} must be finite and ascending, two or more", values, where, "e.g. np.geomspace(0.1, 10, 9)")
    paths = [path_of(scene, name) for name in (parameter, over)]
    require(paths[0] != paths[1], "over must be another number than the parameter", over, where, "name both")
    pair = np.shape(span) == (2,) and all(map(is_finite, span)) and span[0] < span[1]
    require(bool(pair), "span must be two values, ascending", span, where, "give (lowest, highest)")
    load_period(with_value(scene, paths[0], float(span[1])))
    for value in p:
        with_value(scene, over, float(value))  # what the part refuses, it refuses here
    return p


class _Search:
    """Where peaks are looked for."""

    def __init__(
        self, model: Model, parameter: str, over: str, z: Any, span: tuple[float, float], checkpoint: Any
    ) -> None:
        self.parameter, self.over, self.span = parameter, over, span
        self.z = observed(model) if z is None else z
        model.phi(self.z)  # a place that does not exist is refused
        self.models = Family(model, over, 1)
        asked = {"parameter": parameter, "over": over, "span": tuple(map(float, span)), "z": self.z}
        self.kept = Checkpoint(checkpoint, lambda: study_identity(model, study="peak", **asked))

    def top(self, value: float) -> Top:
        """The peak at one value of p, computed unless it is kept."""
        along = Family(self.models.at(value), self.parameter, 1)
        if repr(value) in self.kept.values:
            return restored(Top, self.kept.values[repr(value)], along, "at")
        found = self._searched(value, along)
        self.kept.add(repr(value), arrays_of(found))
        return found

    def _searched(self, value: float, along: Family) -> Top:
        """The peak along one response curve."""
        curve = ResponseCurve(along, self.z)
        low, high = curve.around_largest(*self.span)
        if low == high:
            raise ValueError(
                f"no peak along {self.parameter} within {self.span} at {self.over} = {value:.6g}: the amplitude is "
                "largest at an end; widen the span"
            )
        one = _top(curve, low, high)
        return Top(value, one.at, one.amplitude, _slope(one.orbit, self.z, self.over), one.orbit.stable, one.orbit)


def _top(curve: ResponseCurve, low: float, high: float) -> Seen:
    """The peak between two ω."""
    sure = {"xatol": ROUGHLY * max(abs(low), abs(high))}
    minimize_scalar(lambda x: -curve.amplitude(float(x)), bounds=(low, high), method="bounded", options=sure)
    best, parameter = max(curve.seen, key=lambda one: one.amplitude), curve.family.name
    slope = _slope(best.orbit, curve.z, parameter)
    beside = best.at + math.copysign(APART * (high - low), slope)
    if not (np.isfinite(slope) and curve.amplitude(beside) > 0.0):
        return best
    change = (_slope(curve.at(beside).orbit, curve.z, parameter) - slope) / (beside - best.at)
    x = best.at - slope / change
    near = abs(x - best.at) <= FAR * ROUGHLY * abs(best.at) and curve.amplitude(x) > 0.0
    return curve.at(x) if near else best


def _slope(orbit: Orbit, z: Any, parameter: str) -> float:
    """Derivative of the amplitude; NaN where there is none."""
    try:
        return of_amplitude(orbit, z, parameter)
    except ArithmeticError:  # a contact grazes, or a fold
        return math.nan


def _least(search: _Search, tops: list[Top]) -> Top | None:
    """The least peak between the values: by cubics through peaks and slopes, until no other can lie much below."""
    best = int(np.argmin([one.amplitude for one in tops]))
    if best in (0, len(tops) - 1):
        return None
    known = tops[best - 1 : best + 2]
    for _ in range(LOOKS):
        i = int(np.argmin([one.amplitude for one in known]))
        if 0 < i < len(known) - 1:
            side = i - 1 if known[i].slope > 0.0 else i
        else:
            side = max(min(i, len(known) - 2), 0)
        a, b = known[side : side + 2]
        if not min(abs(known[i].slope) * (b.value - a.value), math.inf) > SURE * known[i].amplitude:
            break
        known.insert(side + 1, search.top(_lowest(a, b)))
    return min(known, key=lambda one: one.amplitude)


def _lowest(a: Top, b: Top) -> float:
    """Where a cubic through two peaks with their slopes is least, inside; the middle where slopes are unknown."""
    middle, width = 0.5 * (a.value + b.value), b.value - a.value
    if not (np.isfinite(a.slope) and np.isfinite(b.slope)):
        return middle
    cubic = CubicHermiteSpline([a.value, b.value], [a.amplitude, b.amplitude], [a.slope, b.slope])
    roots = [x for x in cubic.derivative().roots(extrapolate=False) if a.value < x < b.value]
    x = min(roots, key=lambda one: float(cubic(one)), default=middle)
    return float(np.clip(x, a.value + 1e-2 * width, b.value - 1e-2 * width))
