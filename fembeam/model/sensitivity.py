"""How a run or an orbit changes with one number of its scene, or with its start: exact derivatives through all events.

    u(z, t; p) = φ(z; p)·q(t; p),    du/dp = φ·dq/dp + dφ/dp·q

The data of the reduced equations (frequencies, damping, shapes, gaps, laws, tones) are differenced by five-point
formulas of the parameter; the motion is not: its derivative solves the variational equation, see
`solvers.sensitivities`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam.model.equations import load_period
from fembeam.model.extremes import of_top, time_of_top
from fembeam.model.reduce import signed_like
from fembeam.model.turned import angle, turned_like
from fembeam.response import PlacedLog, directed
from fembeam.scene import called, changes_structure, loads_of_order, path_of, replaced, value_of
from fembeam.scene.signals import is_of_signal
from fembeam.support import Part, Printed, bar, by_rows, numbers, require, warn
from solvers.orbits import codes, counts, delayed
from solvers.problem import counted, dataframe
from solvers.problem.friction import told_rates
from solvers.sensitivities import Nearby, indentation_change, sensitivities, sensitivity

if TYPE_CHECKING:
    from fembeam.model.model import Model
    from fembeam.model.orbit import Orbit
    from fembeam.model.run import Run

Vector = NDArray[np.float64]
# Steps by which a number is varied, as shares of its value:
STRUCTURE = 1e-3  # of a number that changes modes, which are known less exactly than other data
SIGNAL = 1e-6  # of a number of a signal
OTHER = 1e-5  # of a gap, of a number of a law
KNOT = 1e-7  # of an indentation where a law has a kink: small, since between both places the law has the other slope

UNIT = 1.0  # SI unit: stands for the value where it is zero, unless it changes modes
SMALL = 1e-6  # part of its usual step by which a zero is varied whose usual step the scene refuses
FELT = 1e-4  # relative change of frequencies or shapes that the step of a zero which changes modes shall exceed
UNFELT = 1e-7  # the same, below which rounding is more than 1e-5 of it, as steps of a number below `TINY` may be
TINY = 1e-3  # SI unit
FIRST = 1e-6  # SI unit: the step of such a zero that is tried first
LEAST, MOST = 1e-30, 2e6  # SI unit: the smallest and the largest step of such a zero
ROUGH = 1e-2  # relative difference of the derivatives by one and by two steps, above which modes do not change smoothly
MIXED = 1e-2  # sine of the angle by which close modes turn among themselves, above which they are turned back
SINGLE = 1e-6  # least |1 - μ| of an orbit with a derivative; Φ is known to some 1e-8, also at a fold that was located
CHAOS = 1e6  # growth of small changes above which a derivative says little
LONGEST = 60  # contacts that are printed


@dataclass(frozen=True, eq=False)
class Sensitivity(Printed):
    """Derivatives of a run, or of one period of an orbit, by a parameter p; per unit of p, in SI units.

    Attributes
    ----------
    parameter : path of p; "start" of a direction in which the start moves. value : of p, NaN of a start.
    run : whose derivatives these are. found : `solvers.sensitivities.Sensitivity` with all that is known.
    period : s per unit of p, of an orbit; 0 of a run.
    """

    parameter: str
    value: float
    run: Run
    found: Any
    period: float = 0.0
    models: Nearby | None = field(default=None, repr=False)  # where shapes change
    systems: Nearby | None = field(default=None, repr=False)  # by a parameter

    @property
    def t(self) -> Vector:
        """(k,) s, the samples of the run; without samples its end. Derivatives are taken at these fixed times."""
        return self.found.t  # type: ignore[no-any-return]

    @property
    def q(self) -> Vector:
        """(k, n) of the coordinates."""
        return np.asarray(np.split(self.found.states, 2, axis=1)[0])

    @property
    def q_dot(self) -> Vector:
        """(k, n) of their rates."""
        return np.asarray(np.split(self.found.states, 2, axis=1)[1])

    @property
    def state(self) -> Vector:
        """(2n,) of the state at the start; of an orbit that of `Orbit.state`."""
        return self.found.states[0]  # type: ignore[no-any-return]

    @property
    def contacts(self) -> PlacedLog:
        """The contacts to which the entries of `entries`, `exits`, `peak_force` and `impulse` belong."""
        return PlacedLog.of(self.found.contacts, self.run.contacts.sites)

    @property
    def entries(self) -> Vector:
        """(c,) of the times t_in, s; 0 of a contact under way at the start."""
        return self.found.entries  # type: ignore[no-any-return]

    @property
    def exits(self) -> Vector:
        """(c,) of the times t_out, s; NaN of a contact that has not ended."""
        return self.found.exits  # type: ignore[no-any-return]

    @property
    def peak_force(self) -> Vector:
        """(c,) of the largest forces, N or N m."""
        return self.found.peak_force  # type: ignore[no-any-return]

    @property
    def impulse(self) -> Vector:
        """(c,) of the impulses, N s or N m s."""
        return self.found.impulse  # type: ignore[no-any-return]

    @property
    def growth(self) -> float:
        """Largest factor by which a small change of the start grows to the end, in the norm of energy."""
        return self.found.growth  # type: ignore[no-any-return]

    def displacement(self, z: Any, direction: Any = None, body: int = 0) -> Vector:
        """Of u(z, t), m relative to the frame: (k,) at one z, (k, j) at z (j,); places as for `Run.displacement`."""
        return self._of_motion(0, z, direction, body)

    def velocity(self, z: Any, direction: Any = None, body: int = 0) -> Vector:
        """Of u̇(z, t), m/s, likewise."""
        return self._of_motion(1, z, direction, body)

    def indentation(self, stop: int | str = 0) -> Vector:
        """Of δ(t) of a stop, (k,) m or rad, its gap's own change included; stops as for `Run.indentation`."""
        return self._of_stop(stop)[0]

    def indentation_rate(self, stop: int | str = 0) -> Vector:
        """Of δ̇(t), m/s or rad/s, likewise."""
        return self._of_stop(stop)[1]

    @property
    def _own(self) -> Any:
        """The solution, of which the samples are part."""
        return self.found.solution

    def _of_stop(self, stop: int | str) -> tuple[Vector, Vector]:
        """Of δ and of δ̇ of a stop, at fixed times."""
        number = self.run.number(stop)
        contact = self.run.readout.model.system.contacts[number]
        own = self._at_samples(self._own.q), self._at_samples(self._own.q_dot)
        return indentation_change(contact, number, self.systems, own, (self.q, self.q_dot))

    def _at_samples(self, motion: Vector) -> Vector:
        """Rows of the solution at the samples."""
        return motion[np.searchsorted(self._own.t, self.t).clip(max=len(motion) - 1)]

    def extremes(self, z: Any, direction: Any = None, body: int = 0) -> tuple[float, float]:
        """Of the lowest and of the highest displacement at one z over the samples; sample finely.

        Where a maximum is met inside the run u̇ = 0, so that its derivative is that of u at its fixed time. Of two equal
        maxima it is the derivative of one.
        """
        u, v = (ask(z, direction, body) for ask in (self.run.displacement, self.run.velocity))
        du, dv = (ask(z, direction, body) for ask in (self.displacement, self.velocity))
        return tuple(of_top(self.t, sign * u, sign * v, du, dv) for sign in (-1.0, 1.0))  # type: ignore[return-value]

    def _of_motion(self, order: int, z: Any, direction: Any, body: int) -> Vector:
        """Of φ·x at a place, φ·dx + dφ·x, where x is q or q̇ with the same of supports that move."""
        model = self.run.readout.model
        at = z if direction is None else directed(z, direction)
        moved = _of_supports(self.t, order, model.shapes.moving)
        none = np.zeros((len(self.t), model.shapes.moving))
        changed = none if self.systems is None else self.systems.derivative(moved)
        found = np.hstack([(self.q, self.q_dot)[order], changed]) @ model.rows_with_supports(at, body).T
        if self.models is not None:
            own = self._at_samples((self._own.q, self._own.q_dot)[order])
            found = found + np.hstack([own, moved(model.system)]) @ self._of_shapes(self.models, at, body).T
        return np.asarray(found)

    def _of_shapes(self, models: Nearby, at: Any, body: int) -> Vector:
        """Of φ at a place; ValueError for one that the parameter takes away, such as the tip of a shorter beam."""
        try:
            return models.derivative(lambda one: one.rows_with_supports(at, body))
        except ValueError as error:
            raise ValueError(
                f"no derivative by {self.parameter} of what is at {at}, which is not there at values near "
                f"{self.value:.6g}: {error}"
            ) from None

    def table(self) -> list[dict[str, Any]]:
        """One contact a row: its name and times, and its derivatives."""
        log = self.contacts
        columns = {"stop": log.stop, "name": log.name, **log.where, "t_in": log.t_in, "t_out": log.t_out}
        columns |= {"entry": self.entries, "exit": self.exits, "peak force": self.peak_force, "impulse": self.impulse}
        return by_rows(columns)

    def to_dataframe(self) -> Any:
        """The table as one of pandas; ImportError without pandas."""
        return dataframe(self.table())

    def __repr__(self) -> str:
        at = "" if np.isnan(self.value) else f" = {self.value:.6g}"
        return f"<derivatives by {self.parameter}{at} over {self.run!r}>"

    def _parts(self) -> list[Part]:
        """What by, how far changes grow, and the table."""
        head = f"derivatives by {self.parameter}" + ("" if np.isnan(self.value) else f" = {self.value:.9g}")
        growth = f"small changes of the start grow by {self.growth:.3g} to the end"
        rows = [tuple(row.values()) for row in self.table()[:LONGEST]]
        log, left = self.contacts, len(self.contacts) - len(rows)
        names = ["stop", "name", *map(log.head, (*log.where, "t_in", "t_out"))]
        names += ["d t_in", "d t_out", "d peak force", "d impulse"]
        more: list[Part] = [f"and {counted(left, 'contact')} more"] if left else []
        return [head, growth, *([(names, rows)] if rows else []), *more]


def _of_supports(t: Vector, order: int, moving: int) -> Callable[[Any], Vector]:
    """What reads off a system the displacements or speeds (k, m) of the dofs of supports that move."""

    def read(system: Any) -> Vector:
        loads = system.loads[loads_of_order(order, moving)]
        return np.array([np.broadcast_to(signal(t), t.shape) for _, signal in loads]).reshape(moving, len(t)).T

    return read


@dataclass(frozen=True, eq=False)
class _Varied:
    """A model with one number of its scene varied."""

    model: Model
    name: str

    @cached_property
    def path(self) -> str:
        """Its full path, with numbers of parts."""
        return path_of(self.model.scene, self.name)

    @cached_property
    def called(self) -> str:
        """Its full path, with the names of parts by which it was asked for."""
        return called(self.model.scene, self.name)

    @cached_property
    def value(self) -> float:
        """Its present value."""
        return value_of(self.model.scene, self.path)

    @cached_property
    def models(self) -> Nearby | None:
        """Models near the present one, where modes change."""
        if not changes_structure(self.path):
            return None
        found = self._apart(STRUCTURE * abs(self.value))
        turned = found.map(lambda one: turned_like(one, self.model))
        if max(map(angle, turned.systems)) > MIXED:
            _check_turned(turned, self.called, self.model.omega)
            return turned
        _check_smooth(found, self.called)
        return found

    @cached_property
    def systems(self) -> Nearby:
        """Systems near the present one."""
        if self.models is not None:
            return self.models.map(lambda one: one.system)
        share = SIGNAL if is_of_signal(self.path) else KNOT if _is_knot(self.path) else OTHER
        step = share * (abs(self.value) or UNIT)
        try:
            return self._near(self._system, step)
        except ValueError:
            if self.value:
                raise
        return self._near(self._system, SMALL * step)  # such as the centre of a narrow hole

    def _model(self, value: float) -> Model:
        """At a value near the present one: a mode at rest where the scene's watched place is may have either sign."""
        made = self.model.again(self._scene(value))
        self._check_size(made)
        return signed_like(made, self.model)

    def _system(self, value: float) -> Any:
        return self.model.system_like(self._scene(value))

    @cached_property
    def lengthening(self) -> float:
        """Change of the loads' period, s per unit: by signals, and by a spin, which unbalances follow."""
        if not (is_of_signal(self.path) or self.path.endswith(".spin")):
            return 0.0
        step = SIGNAL * (abs(self.value) or UNIT)
        return float(self._near(lambda value: load_period(self._scene(value)), step).derivative(lambda one: one))

    def _scene(self, value: float) -> Any:
        return replaced(self.model.scene, self.path, value)

    def _apart(self, step: float) -> Nearby:
        """Models by a step of the number, by a larger one where it is zero, or stands for it."""
        found = self._near(self._model, step) if step else None
        if found is not None and not self._stands_for_zero(found, step):
            return found
        with self._rewording_refusals():
            step = self._felt()
        return self._near(self._model, step)

    def _stands_for_zero(self, near: Nearby, step: float) -> bool:
        """Whether a number is so small that models near it tell its step from rounding no longer."""
        return 0.0 < abs(self.value) < TINY and max(self._change(one, step) for one in near.systems) < UNFELT

    def _felt(self) -> float:
        """A step of a number that is zero and changes modes, which they feel about as much as `STRUCTURE`.

        Of one that changes next to nothing, such as the share of a direction along the member that it turns about, a
        tenth of the first step that the scene refuses.
        """
        step = FIRST
        while LEAST < step <= MOST:
            try:
                there = self._model(step)
            except ValueError:
                if step <= FIRST:
                    raise
                break
            change = self._change(there, step)
            if change > STRUCTURE:
                step *= 0.1
            elif step < FIRST or change > FELT:
                return step
            else:
                step *= 10.0
        return 0.1 * step if step > FIRST else step

    def _change(self, there: Model, step: float) -> float:
        """Largest relative change of frequencies, shapes, damping or places of loads by a step from zero."""
        here = self.model
        require(len(there.system.loads) == len(here.system.loads), "it must not bring a load that is not there yet",
                step, self.called, "begin from a small value, such as gravity=1e-6")  # fmt: skip
        turned = turned_like(there, here)
        vectors = [np.array([vector for vector, _ in one.system.loads]) for one in (here, turned)]
        pairs = (here.directions, turned.directions), (here.zeta, there.zeta), vectors
        sizes = [(np.abs(b - a).max(initial=0.0), np.abs(a).max(initial=0.0)) for a, b in pairs]
        own, changed = here.omega**2, np.abs(there.omega**2 - here.omega**2)
        sizes += zip(changed, np.where(own > 0.0, own, own.max()), strict=True)  # each: others may be far stiffer
        return max(0.0 if change == 0.0 else change / size if size > 0.0 else np.inf for change, size in sizes)

    def _check_size(self, there: Model) -> None:
        """ValueError where another value of the number brings coordinates, or takes them away."""
        sizes, options = {len(self.model.omega), len(there.omega)}, self.model.reduction_options
        asked = [f"{name}=True" for name in ("residual", "interface") if options.get(name)]
        advice = f"places share a static shape here alone: leave out {asked[0]}" if asked else "name modes by number"
        require(len(sizes) == 1, "the number of coordinates must not change", sizes, self.called, advice)

    def _near(self, make: Any, step: float) -> Nearby:
        """What is made at five-point formulas' values."""
        with self._rewording_refusals():
            return Nearby.of(make, self.value, step)

    @contextmanager
    def _rewording_refusals(self) -> Iterator[None]:
        """Says of values that a scene refuses that there is no derivative."""
        try:
            yield
        except ValueError as error:
            raise ValueError(
                f"no derivative by {self.called}: values near {self.value:.6g} are refused: {error}"
            ) from None

    def start(self, x: Vector) -> Vector | None:
        """Derivative of the start: of rest that of rest, which follows supports that move, else zero in coordinates."""
        if not np.array_equal(x, self.model.rest()):
            return None
        if self.models is not None:
            return self.models.derivative(lambda one: one.rest())
        if not (is_of_signal(self.path) and len(self.model.following)):
            return None
        step = SIGNAL * (abs(self.value) or UNIT)
        return self._near(lambda value: self.model.under(self._scene(value)).rest(), step).derivative(lambda one: one)


def _is_knot(path: str) -> bool:
    """Whether a full path means an indentation at which a law has a kink."""
    return re.search(r"\.(knots|indentation)\[\d+\]$", path) is not None


def _check_smooth(models: Nearby, path: str) -> None:
    """ValueError where frequencies or shapes jump between the values: the mesh or the order of modes changes."""
    rough = max(models.disagreement(lambda one: one.omega**2), models.disagreement(lambda one: one.directions))
    require(rough <= ROUGH, "modes must change smoothly with the parameter", path, "sensitivity",
            "give elements, or other modes")  # fmt: skip


def _check_turned(models: Nearby, path: str, omega: Vector) -> None:
    """The same of modes that are turned among themselves, by K and C in units of each mode's frequency."""
    size = np.where(omega > 0.0, omega, omega.max() or 1.0)
    scale = np.outer(size, size)
    of_matrices = (lambda one: one.system.K / scale), (lambda one: one.system.C / np.sqrt(scale))
    rough = max(map(models.disagreement, (*of_matrices, lambda one: one.directions)))
    require(rough <= ROUGH, "modes must change smoothly with the parameter", path, "sensitivity",
            "modes change places here: give them one damping ratio, and keep all of one frequency")  # fmt: skip


def of_run(run: Run, parameter: str | None, start: ArrayLike | None, progress: bool = False) -> Sensitivity:
    """See `Run.sensitivity`."""
    require((parameter is None) != (start is None), "give a parameter or a direction of the start", (parameter, start),
            "Run.sensitivity", "e.g. 'stops[0].gap'")  # fmt: skip
    if parameter is not None:
        require(isinstance(parameter, str), "parameter must be the path of one number", parameter, "Run.sensitivity",
                "e.g. 'stops[0].gap'")  # fmt: skip
        return _warned(by_each(run, [parameter], progress)[0])
    model, known, options = _made(run)
    direction = _direction(model, start)
    with bar(known[2], progress) as report:
        found = sensitivity(model.system, *known, options.pop("times"), None, direction, progress=report, **options)
    return _warned(Sensitivity("start", float("nan"), run, found))


def by_each(run: Run, parameters: Sequence[str], progress: bool = False) -> list[Sensitivity]:
    """Derivatives of a run by each of several numbers of its scene, for little more than those by one."""
    model, known, options = _made(run)
    varied = [_Varied(model, one) for one in parameters]
    x = np.concatenate(known[:2])
    pairs = [(one.systems, one.start(x)) for one in varied]
    with bar(known[2], progress) as report:
        found = sensitivities(model.system, *known, pairs, progress=report, **options)
    return [
        Sensitivity(one.called, one.value, run, its, 0.0, one.models, one.systems)
        for one, its in zip(varied, found, strict=True)
    ]


def _made(run: Run) -> tuple[Model, tuple[Vector, Vector, float], dict[str, Any]]:
    """The model of a run, its q, q̇ and duration, and how it was made."""
    made, model = run.made, run.model
    if model is None or made is None:
        raise ValueError(
            "a run read from a file has no model to be derived from, nor has a part of a run, which studies look at "
            "with discard= or without duration=; simulate it again"
        )
    q, q_dot = np.split(made.start[: 2 * len(model.omega)], 2)
    times = run.t if run.sampled else np.array([made.duration])
    options = {"times": times, "method": made.solver, "memory": run.memory_at_start or None}
    return model, (q, q_dot, made.duration), options


def _direction(model: Model, start: Any) -> Vector:
    """A checked direction of the start."""
    direction = numbers("start", start, "Run.sensitivity", "e.g. model.state(displacement=lambda z: z)")
    fits = direction.shape == (2 * len(model.omega),) and bool(np.isfinite(direction).all())
    require(fits, f"start must be a direction of the start, ({2 * len(model.omega)},) finite numbers", start,
            "Run.sensitivity", "e.g. model.state(displacement=lambda z: z)")  # fmt: skip
    return direction


def _warned(found: Sensitivity) -> Sensitivity:
    """With a warning where the motion forgets its start too fast."""
    if found.growth > CHAOS:
        warn(
            f"small changes of the start grow by {found.growth:.3g} to the end of the run: errors grow so too, and the "
            "derivative holds for changes of the parameter so much smaller; shorten the run, or ask for statistics"
        )
    return found


def of_amplitude(orbit: Orbit, z: Any, parameter: str) -> float:
    """Derivative of half the range of an orbit's displacement at z by a number of its scene, in m per unit.

    That of the difference of u at the fixed times of both extremes, where u̇ = 0; far less work than `extremes` of the
    whole period. Errors as for `Orbit.sensitivity`.
    """
    u, v = orbit.run.displacement(z), orbit.run.velocity(z)
    highest, lowest = (time_of_top(orbit.run.t, sign * u, sign * v) for sign in (1.0, -1.0))
    found = of_orbit(orbit, parameter, np.unique([highest, lowest]))
    du = found.displacement(z)
    return 0.5 * float(du[np.searchsorted(found.t, highest)] - du[np.searchsorted(found.t, lowest)])


def of_orbit(orbit: Orbit, parameter: str, times: Vector | None = None) -> Sensitivity:
    """See `Orbit.sensitivity`; at ``times`` (s since ``found.phase``, ascending) instead of those of the run."""
    return of_orbit_by_each(orbit, [parameter], times)[0]


def of_orbit_by_each(orbit: Orbit, parameters: Sequence[str], times: Vector | None = None) -> list[Sensitivity]:
    """Derivatives of an orbit by each of several numbers of its scene.

    First those of the end of one period at a fixed start, from which the derivative of the start follows; then those of
    the whole period.
    """
    model, found = orbit.model, orbit.found
    _check_single(found)
    varied, n = [_Varied(model, one) for one in parameters], len(model.omega)
    later = [one.systems.map(lambda system: delayed(system, found.phase)) for one in varied]
    system = delayed(found.system, found.phase)
    known = found.state[:n], found.state[n:], found.period
    options: dict[str, Any] = {"method": found.method, "memory": found.memory or None}
    starts, lengthening, free = [], [orbit.period * one.lengthening for one in varied], _free(found)
    once = sensitivities(system, *known, [(one, None) for one in later], **options)
    for one, longer in zip(once, lengthening, strict=True):
        change = one.end.copy()
        change += np.concatenate((one.rate, told_rates(system.contacts, one.solution.memory))) * longer
        starts.append(_fixed_point(one.matrix, change, free))
    whole = orbit.run.t if times is None else times
    period = sensitivities(system, *known, list(zip(later, starts, strict=True)), whole, **options)
    return [
        Sensitivity(one.called, one.value, orbit.run, its, longer, one.models, systems)
        for one, its, longer, systems in zip(varied, period, lengthening, later, strict=True)
    ]


def _free(found: Any) -> Any:
    """Which entries of [q, q̇, latched] the orbit determines: no codes, and nothing that is never renewed."""
    own = codes(found.system)
    free = ~np.asarray(own) if found.memory else np.ones(2 * found.system.size, dtype=bool)
    first = 2 * found.system.size + np.concatenate(([0], np.cumsum(counts(found.system)))).astype(int)
    for contact, place in found.family:
        free[int(first[contact]) + place] = False
    return free


def _check_single(found: Any) -> None:
    """ArithmeticError where other orbits are so near that a change of the parameter does not tell which one follows."""
    nearest = float(np.abs(1.0 - found.transverse).min(initial=np.inf))
    if not nearest >= SINGLE:
        raise ArithmeticError(
            "no derivative: the orbit is at a fold or a branch point, where a multiplier is 1: "
            f"|1 - μ| = {nearest:.1g} is less than {SINGLE:g}"
        )


def _fixed_point(matrix: Vector, change: Vector, free: Any) -> Vector:
    """Dx from dx = Φ dx + change: the theorem of implicit functions; in units of the entries that balance Φ."""
    from scipy.linalg import matrix_balance

    dx = np.zeros(len(change))
    with np.errstate(invalid="ignore"):  # scales beyond the range of integers
        balanced, (units, _) = matrix_balance(matrix[np.ix_(free, free)], permute=False, separate=True)
    dx[free] = units * np.linalg.solve(np.eye(len(balanced)) - balanced, change[free] / units)
    return dx
