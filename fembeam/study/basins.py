"""Basins of attraction: which periodic orbit each start of a grid comes to.

A start belongs to a stable orbit of period k (in periods T of the load) when its state at a multiple of T is within
`NEAR` of one of the orbit's k states there: |q - q_j| <= NEAR max|q| and the same for q̇, in the maximum norm, sizes
those over the orbit. Runs double their length, from t = 0 anew, until they are there or the longest has been made.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

import solvers
from fembeam import plot
from fembeam.model import Attractor, Model, Orbit, load_period, observed
from fembeam.scene import Place, directed_words
from fembeam.study.execution.checkpoint import Checkpoint, identity
from fembeam.study.execution.executors import spread
from fembeam.study.measure import require_model
from fembeam.study.result import Result
from fembeam.support import Part, is_finite, is_listed, is_whole, numbers, require, titled
from solvers.orbits import delayed
from solvers.orbits import run as run_from

Vector = NDArray[np.float64]
MOST_POINTS = 100_000_000  # starts of a plane
WHERE = "basins"
NEAR = 1e-3
FIRST = 25  # periods of the shortest runs
COARSE = 5  # starts along each axis that are settled to find orbits
TRIES = 12  # starts left over that are settled to find more
UNSETTLED, FAILED = -1, -2  # labels of starts that came to no orbit, and of runs that failed
OTHERS = {"not settled": UNSETTLED, "run failed": FAILED}


@dataclass(frozen=True, eq=False)
class Axis:
    """One direction of a plane: (2n,) change of [q, q̇] per unit, the values (k,) along it, its name."""

    direction: Vector
    values: Vector
    name: str


@dataclass(frozen=True, eq=False)
class Basins(Result):
    """Where the starts of a grid settle.

    Attributes
    ----------
    x, y : `Axis` with direction, values (nx,), (ny,) and name. origin : (2n,) the state at x = y = 0.
    label : (ny, nx) number of the attractor of each start; -1 where none was reached, -2 where the run failed.
    attractors : those reached, the most frequent first, each with its number of starts.
    """

    x: Axis
    y: Axis
    origin: Vector
    label: NDArray[np.int64]
    attractors: tuple[Attractor, ...]

    @property
    def shares(self) -> Vector:
        """(a,) part of the starts that comes to each attractor."""
        return np.array([one.count for one in self.attractors]) / self.label.size

    def __repr__(self) -> str:
        return f"<what {self.label.size} starts come to: {', '.join(one.name for one in self.attractors)}>"

    def _parts(self) -> list[Part]:
        """Attractors with their shares of the starts."""
        size = " x ".join(map(str, self.label.shape[::-1]))
        spans = [f"{axis.name} from {axis.values[0]:g} to {axis.values[-1]:g}" for axis in (self.x, self.y)]
        shares = [(row["name"], row["starts"], f"{row['share']:.2%}") for row in self.table()]
        return [f"{size} starts: {', '.join(spans)}", (("comes to", "starts", "share"), shares)]

    def table(self) -> list[dict[str, Any]]:
        """One attractor a row, then starts that came to none and runs that failed, if any."""
        others = [(name, int(np.sum(self.label == kind))) for name, kind in OTHERS.items()]
        rows = [(one.name, one.period, one.impacts, one.count, one.state.tolist()) for one in self.attractors]
        rows += [(name, None, None, count, None) for name, count in others if count]
        names = "name", "period", "impacts", "starts", "state"
        return [dict(zip(names, row, strict=True)) | {"share": row[3] / self.label.size} for row in rows]

    def plain(self) -> dict[str, Any]:
        """Attractors, axes and the label of every start, as JSON has them."""
        axes = {k: {"name": one.name, "values": one.values.tolist()} for k, one in (("x", self.x), ("y", self.y))}
        found = [row for row in self.table() if row["name"] not in OTHERS]
        return {"attractors": found, **axes, "label": self.label.tolist(), "units": "SI: m, s, N, rad/s"}

    figure = plot.basins


@dataclass(frozen=True, eq=False)
class _Known:
    """A stable orbit with its states (k, 2n) at multiples of the load's period T, and the sizes (2n,) of its motion."""

    orbit: Orbit
    states: Vector
    size: Vector

    @classmethod
    def of(cls, orbit: Orbit, T: float) -> _Known:
        """From an orbit, by one run over its period."""
        found = orbit.found
        times = np.sort((np.arange(orbit.period) * T - found.phase) % found.period)
        later = delayed(found.system, found.phase)
        run = run_from(later, found.whole, found.period, times, found.method)
        sizes = [np.repeat(np.abs(part).max(), len(orbit.model.omega)) for part in (orbit.run.q, orbit.run.q_dot)]
        return cls(orbit, np.hstack((run.q, run.q_dot)), np.concatenate(sizes))

    def holds(self, states: Vector) -> Any:
        """(k,) whether each state is on it."""
        distance = np.abs(states[:, None, :] - self.states) / self.size
        return (distance.max(axis=2) <= NEAR).any(axis=1)


def basins(
    model: Model,
    x: Any = "displacement",
    x_span: tuple[float, float] = (-1e-2, 1e-2),
    y: Any = "velocity",
    y_span: tuple[float, float] = (-1.0, 1.0),
    points: int | tuple[int, int] = 100,
    *,
    z: Place | None = None,
    start: ArrayLike | None = None,
    settle: int = 200,
    longest: int = 8,
    threads: int = 1,
    checkpoint: str | os.PathLike[str] | None = None,
    progress: bool = False,
) -> Basins:
    """Colour a plane of starts by the periodic orbit each comes to.

    Parameters
    ----------
    model : under periodic loads.
    x, y : the plane's axes: "displacement" (m; the beam bent by a force at z), "velocity" (m/s; struck at z), the
        number of a state in [q, q̇], or a direction (2n,).
    x_span, y_span : (lowest, highest) along them.
    points : how many along both, or (along x, along y), at least 2.
    z : place of displacement and velocity, m; None is the first stop, else the tip.
    start : (2n,) state at x = y = 0, to which both are added; None is rest.
    settle : most periods of the load a start is given. Where damping is ζω at least, a disturbance of an orbit
        without contacts falls to `NEAR` in 7/(ζω T).
    longest : orbits of at most so many periods are looked for; longer or chaotic motion counts as not settled.
    threads : how many work at the same time.
    checkpoint : file that keeps each row of the grid; what it holds is not computed again.
    progress : show a bar (only on a terminal).

    Returns
    -------
    Basins. Orbits are found by `Model.attractors` from a coarse grid, and from starts that came to none of these; one
    whose basin no such start hits is missed, and its starts count as not settled.

    Raises
    ------
    ValueError for bad input or the checkpoint of another study; KeyboardInterrupt with finished rows in the checkpoint.

    Examples
    --------
    >>> import fembeam as fb
    >>> beam = fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01))
    >>> scene = fb.Scene(beam, [fb.Clamped(0.0)], base=fb.Harmonic(1e-3, 100.0), damping=fb.ModalDamping(0.05))
    >>> print(basins(scene.reduce(modes=1), points=4))
    4 x 4 starts: displacement at 0.5 m / m from -0.01 to 0.01, velocity at 0.5 m / (m/s) from -1 to 1
    comes to                 starts    share
    period 1 with 0 impacts      16  100.00%
    """
    require_model(model, "basins")
    columns, rows = checked_points(points)
    place = observed(model) if z is None else z
    across, up = axis_of(model, x, x_span, columns, place), axis_of(model, y, y_span, rows, place)
    origin, T = checked_plane(model, start, across, up), load_period(model.scene)
    for name, count in (("settle", settle), ("longest", longest)):
        whole = is_whole(count) and count > 0
        require(whole, f"{name} counts periods of the load and must be above 0", count, WHERE, "give a whole number")
    starts = starts_of(origin, across, up)
    asked = partial(basins, x=across, y=up, start=origin, settle=settle, longest=longest)
    kept = Checkpoint(checkpoint, partial(identity, model, asked))
    known = _found(model, _coarse(starts), longest, T)
    missing = [row for row in range(rows) if str(row) not in kept.values]
    task = partial(_settled, model, starts, known, settle, T, threads)
    with kept:
        spread(task, missing, None, titled(progress, "basins"), lambda i, v: kept.add(str(missing[i]), {"state": v}))
    states = np.array([kept.values[str(row)]["state"] for row in range(rows)])
    label, known = _labelled(model, states.reshape(-1, states.shape[-1]), known, longest, T)
    return _sorted(across, up, origin, label.reshape(rows, columns), known)


def _coarse(starts: Vector) -> Vector:
    """Some starts of the grid, its corners among them."""
    rows, columns = (np.unique(np.linspace(0, size - 1, COARSE).astype(int)) for size in starts.shape[:2])
    return starts[np.ix_(rows, columns)].reshape(-1, starts.shape[2])


def _found(model: Model, starts: Sequence[Vector] | Vector, longest: int, T: float) -> list[_Known]:
    """The stable orbits that starts come to; of one whose run fails none, as of that point of the grid."""
    found: list[_Known] = []
    for start in starts:
        with suppress(solvers.SolverError):
            (one,) = model.attractors(starts=[start], longest=longest)
            known = any(other.holds(one.state[None]).any() for other in found)
            if one.orbit is not None and one.orbit.stable and not known:
                found.append(_Known.of(one.orbit, T))
    return found


def _settled(
    model: Model, starts: Vector, known: list[_Known], settle: int, T: float, threads: int, row: int
) -> Vector:
    """(nx, 2n) states that the starts of a row come to, at multiples of the load's period; NaN where a run failed."""
    n, method = len(model.omega), solvers.Exponential(1e-8, ledger=False)
    states, left = starts[row].copy(), np.arange(starts.shape[1])
    lengths = [FIRST << i for i in range(40) if FIRST << i < settle]
    for periods in [*lengths, settle]:
        present = starts[row, left]
        runs = solvers.integrate_many(model.system, present[:, :n], present[:, n:], periods * T, method, threads,
                                      check=False)  # fmt: skip
        if np.any(runs.status == solvers.Status.INTERRUPTED):
            raise KeyboardInterrupt
        done = runs.status == solvers.Status.DONE
        states[left] = np.where(done[:, None], np.hstack((runs.q, runs.q_dot)), math.nan)
        left = left[(_labels(states[left], known) == UNSETTLED)]
        if not left.size:
            break
    return states


def _labels(states: Vector, known: list[_Known]) -> NDArray[np.int64]:
    """(k,) number of the orbit each state is on."""
    label = np.where(np.isfinite(states).all(axis=1), UNSETTLED, FAILED)
    for i, one in enumerate(known):
        label[(label == UNSETTLED) & one.holds(states)] = i
    return label


def _labelled(
    model: Model, states: Vector, known: list[_Known], longest: int, T: float
) -> tuple[NDArray[np.int64], list[_Known]]:
    """Labels of all states, and the orbits, those found from states that were on none of the first ones included."""
    label = _labels(states, known)
    left = np.flatnonzero(label == UNSETTLED)
    for _ in range(TRIES):
        if not left.size:
            break
        more = _found(model, states[left[:1]], longest, T)
        known = known + [one for one in more if not any(other.holds(one.states).any() for other in known)]
        label = _labels(states, known)
        left = left[1:][label[left[1:]] == UNSETTLED]
    return label, known


def _sorted(x: Axis, y: Axis, origin: Vector, label: NDArray[np.int64], known: list[_Known]) -> Basins:
    """The result, the largest basin first."""
    counts = np.array([np.sum(label == i) for i in range(len(known))], dtype=int)
    order = [i for i in np.argsort(-counts, kind="stable").tolist() if counts[i]]
    renumbered = label.copy()
    for new, old in enumerate(order):
        renumbered[label == old] = new
    attractors = tuple(Attractor(known[i].orbit, int(counts[i]), known[i].states[0]) for i in order)
    return Basins(x, y, origin, renumbered, attractors)


def axis_of(model: Model, kind: Any, span: Any, points: int, z: Any) -> Axis:
    """An axis from what `basins` takes for it, checked."""
    ends = numbers("a span", span, WHERE, "give (lowest, highest)")
    valid = ends.shape == (2,) and bool(np.isfinite(ends).all()) and ends[0] < ends[1]
    require(valid, "a span must be two finite values, ascending", span, WHERE, "give (lowest, highest)")
    direction, name = _direction(model, kind, z)
    return Axis(direction, np.linspace(ends[0], ends[1], points), name)


def _direction(model: Model, kind: Any, z: Any) -> tuple[Vector, str]:
    """The direction an axis goes, and its name."""
    n = len(model.omega)
    if isinstance(kind, str) and kind == "displacement":
        return np.concatenate((_pulled(model, z), np.zeros(n))), f"displacement at {_place_words(z)} / m"
    if isinstance(kind, str) and kind == "velocity":
        return np.concatenate((np.zeros(n), _shape(model, z, np.ones(n)))), f"velocity at {_place_words(z)} / (m/s)"
    if is_whole(kind):
        require(
            bool(0 <= kind < 2 * n), f"the number of a state must lie in [0, {2 * n})", kind, WHERE, "q first, then q̇"
        )
        return np.eye(2 * n)[kind], f"q[{kind}]" if kind < n else f"q_dot[{kind - n}]"
    advice = f'give "displacement", "velocity", the number of a state, or a vector of {2 * n} numbers'
    require(not isinstance(kind, (str, bool)) and kind is not None, "an axis is not known", kind, WHERE, advice)
    vector = np.array(kind, dtype=float)
    fine = vector.shape == (2 * n,) and bool(np.isfinite(vector).all())
    require(fine, f"an axis must be {2 * n} finite numbers", kind, WHERE, advice)
    return vector, "along the given vector"


def _place_words(z: Any) -> str:
    """A place with its direction, of a beam with m, as labels have it."""
    return directed_words(z) if isinstance(z, tuple) else f"{z:g} m"


def _pulled(model: Model, z: Any) -> Vector:
    """Q of the shape a force at z bends the beam to, per metre there."""
    loose = (model.omega <= 0.0) & (model.phi(z) != 0.0)
    require(not loose.any(), "a force at z moves the beam without end", z, WHERE, "use velocity, or numbers of states")
    return _shape(model, z, 1.0 / np.where(model.omega > 0.0, model.omega, np.inf) ** 2)


def _shape(model: Model, z: Any, compliance: Vector) -> Vector:
    """Coordinates that a push at z brings about, per unit of motion there."""
    phi = model.phi(z)
    moved = float(phi @ (compliance * phi))
    require(moved > 0.0, "the modes kept do not move at z", z, WHERE, "choose another place")
    found: Vector = compliance * phi / moved
    return found


def checked_points(points: Any) -> tuple[int, int]:
    """Numbers of values along x and y."""
    both = (points, points) if isinstance(points, (int, np.integer)) else tuple(points if is_listed(points) else ())
    whole = len(both) == 2 and all(is_finite(k) and k == int(k) and k >= 2 for k in both)
    require(whole, "points must be one or two whole numbers of at least 2", points, WHERE, "e.g. (100, 100)")
    require(both[0] * both[1] <= MOST_POINTS, f"points must be at most {MOST_POINTS} in all", points, WHERE,
            "e.g. (100, 100)")  # fmt: skip
    return int(both[0]), int(both[1])


def starts_of(origin: Vector, x: Axis, y: Axis) -> Vector:
    """(ny, nx, 2n) all the starts."""
    along = x.values[:, None] * x.direction
    starts: Vector = origin + (y.values[:, None] * y.direction)[:, None, :] + along
    return starts


def checked_plane(model: Model, start: ArrayLike | None, x: Axis, y: Axis) -> Vector:
    """The state at the plane's origin, after a check that x and y span a plane."""
    size = 2 * len(model.omega)
    origin = model.rest() if start is None else np.array(start, dtype=float)
    fine = origin.shape == (size,) and bool(np.isfinite(origin).all())
    require(fine, f"start must be {size} finite numbers", start, WHERE, "use model.state(displacement, velocity)")
    units = [axis.direction / max(float(np.linalg.norm(axis.direction)), 1e-300) for axis in (x, y)]
    flat = np.linalg.svd(np.array(units), compute_uv=False)[-1] < 1e-9
    require(not flat, "x and y must be two directions", (x.name, y.name), WHERE, "choose another one")
    return origin
