"""Studies as tables of a scene file: what to ask, checked when read; `run` answers it.

All are run in one way, ``run(file, folder, progress)``: a long study keeps its checkpoint in the folder and shows
progress, a short one needs neither. ``check(scene)``, where there is one, refuses what the scene cannot answer, and
``check_run(file, model)``, asked by `fembeam check`, what its model cannot.
"""

from __future__ import annotations

import inspect
import os
import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import active_children, parent_process
from multiprocessing.connection import wait
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any

import numpy as np

import solvers
from fembeam import plot
from fembeam import study as studies
from fembeam.beams import on_beam
from fembeam.model import Branch, Orbit, check_mode_count, load_period
from fembeam.model.run_csv import SECTIONS, Output
from fembeam.response.spectra import checked_damping, checked_oscillators
from fembeam.scene import Place, is_directed, path_of, quoted, value_of, with_value
from fembeam.scene_file.keys import Constructors, parameters
from fembeam.structures import direction_of, require_components
from fembeam.study.backbone import check_backbone
from fembeam.study.basins import checked_points
from fembeam.study.campbell import check_modes, check_shaft
from fembeam.study.ensemble import check_noise
from fembeam.study.measure import Plan
from fembeam.study.minimum import box_of, check_search, limits_of
from fembeam.study.mode_count import ModeCount, checked_counts, mode_count
from fembeam.study.peak import check_peak
from fembeam.study.quantities import Quantity, named
from fembeam.study.result import Result, plain
from fembeam.study.smallest_model import MOST, SmallestModel, check_goal, smallest_model
from fembeam.study.stationary import FEWEST_IN_SEGMENT, check_length
from fembeam.study.trial import Trial
from fembeam.study.variation import points_of
from fembeam.support import (
    Part,
    interrupts,
    is_numbered,
    is_pair,
    is_whole,
    require,
    require_non_negative,
    require_positive,
)
from solvers.problem.whole_runs import must_be_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fembeam.model import Model
    from fembeam.scene import Scene
    from fembeam.scene_file.reader import SceneFile

# Python objects, what [reduce] says of the mesh, what the folder of results has, and what the command says
NOT_IN_A_FILE = "scene", "start", "solver", "executor", "elements", "checkpoint", "progress"
MOST_SEEDS = 100_000
MOST_POINTS = 100_000  # of an axis
MOST_WORKERS = 1000  # processes
MOST_PERIOD = 1000  # load periods of an orbit


@dataclass(frozen=True)
class ModeStudy:
    """A study over numbers of modes and what is asked: arguments of its function, `seeds` being a count."""

    study: Callable[..., Any]
    arguments: dict[str, Any]

    @property
    def seeds(self) -> tuple[int, ...]:
        """The seeds 0, 1, ... of that many realisations."""
        return _seeds(self.arguments.get("seeds", 0))

    def check(self, scene: Scene) -> None:
        """Raise ValueError when the scene cannot be run like this."""
        asked = self.arguments
        if "counts" in asked:
            checked_counts(asked["counts"])
            if is_whole(asked.get("reference")):
                checked_counts([asked["reference"]], "reference")
        else:
            check_goal(asked["tolerance"], asked.get("most", MOST))
        runs = {name: asked[name] for name in ("duration", "dt", "discard") if name in asked}
        Plan(**runs, seeds=self.seeds).check(scene, named(asked["quantity"]))
        _check_place_of(named(asked["quantity"]), scene)

    def check_run(self, file: SceneFile, model: Model) -> None:
        """Raise ValueError for more modes than there are."""
        reference = self.arguments.get("reference")
        counts = [*self.arguments.get("counts", ()), *([reference] if is_whole(reference) else [])]
        if counts:
            check_mode_count(file.scene, max(counts), **_mesh_of(file))

    def run(self, file: SceneFile, folder: Path, progress: bool = False) -> ModeCount | SmallestModel:
        """The study, with its checkpoint in the folder; NotMetError when there is no such model."""
        kept = folder / f"{self.study.__name__}.npz"
        given = {**self.arguments, "seeds": self.seeds, **_mesh_of(file), "checkpoint": kept, "progress": progress}
        found: ModeCount | SmallestModel = self.study(file.scene, **given)
        return found


def _seeds(count: int) -> tuple[int, ...]:
    """So many of them, 0, 1, …."""
    require(0 <= count <= MOST_SEEDS, f"seeds must be 0 to {MOST_SEEDS}", count, "study", "e.g. 8")
    return tuple(range(count))


def _mesh_of(file: SceneFile) -> dict[str, Any]:
    """What [reduce] says of the mesh; studies that choose modes themselves take it too."""
    return {name: value for name, value in file.reduce.items() if name == "elements"}


def _table_of(study: Callable[..., Any]) -> Callable[..., ModeStudy]:
    """Maker of a table whose keys are the arguments of a study's function that a file can hold."""

    def table(**arguments: Any) -> ModeStudy:
        return ModeStudy(study, arguments)

    keys = {name: key for name, key in parameters(study).items() if name not in NOT_IN_A_FILE}
    keys["seeds"] = keys["seeds"].replace(annotation=int, default=0)
    table.__signature__ = inspect.Signature(list(keys.values()))  # type: ignore[attr-defined]
    name = study.__name__
    table.__doc__ = f"The table [{name}]; `fb.study.{name}` explains the keys, `seeds` is how many (0, 1, …)."
    return table


@dataclass(frozen=True)
class SpeedAccuracyTable:
    """The table [speed_accuracy] of a scene file: `Exponential`, `DormandPrince` and RK4 on some mode counts.

    Parameters
    ----------
    modes : mode counts. rtols : relative tolerances of the first two, in [1e-11, 1e-2]. steps : of `RK4`, s.
    starts, duration, rounds : see `speed_accuracy`.
    """

    modes: Sequence[int] = (1, 2, 3)
    rtols: Sequence[float] = (1e-4, 1e-6, 1e-8, 1e-10)
    steps: Sequence[float] = (5e-5, 1e-5)
    starts: int = 6
    duration: float | None = None
    rounds: int = 3

    def __post_init__(self) -> None:
        where = "speed_accuracy"
        counts = bool(self.modes) and min(self.modes) >= 1
        require(counts, "modes must be counts of at least 1", list(self.modes), where, "e.g. [1, 2, 5]")
        valid = bool(self.rtols) and 1e-11 <= min(self.rtols) <= max(self.rtols) <= 1e-2
        require(valid, "rtols must lie in [1e-11, 1e-2]", list(self.rtols), where, "e.g. [1e-4, 1e-8]")
        require(self.starts >= 1, "starts must be at least 1", self.starts, where, "e.g. 6")
        require(self.rounds >= 1, "rounds must be at least 1", self.rounds, where, "e.g. 3")
        for step in self.steps:
            require_positive("steps", step, where, "give s")
        if self.duration is not None:
            require_positive("duration", self.duration, where, "give s")

    def run(self, file: SceneFile, folder: Path, progress: bool = False) -> studies.SpeedAccuracy:
        """The study, with its checkpoint ``speed_accuracy.npz`` in the folder."""
        methods: list[Any] = [solvers.Exponential(rtol) for rtol in self.rtols]
        methods += [solvers.DormandPrince(rtol) for rtol in self.rtols] + [solvers.RK4(step) for step in self.steps]
        models = [file.scene.reduce(modes=n, **_mesh_of(file)) for n in sorted(set(self.modes))]
        kept = folder / "speed_accuracy.npz"
        return studies.speed_accuracy(
            models, methods, self.starts, self.duration, rounds=self.rounds, progress=progress, checkpoint=kept
        )


@dataclass(frozen=True)
class EnsembleTable:
    """The table [ensemble]: independent realisations of the noise, `characteristics` of each.

    Parameters
    ----------
    realisations : how many, at least 2; with `until` the most.
    duration : s of each that the statistics use. dt : output sampling in s.
    until : relative standard error of every mean at which to stop; None: compute all.
    discard : s left out of each; None: until the transient has died out.
    segment : samples of a Welch segment; None: 2 rad/s of resolution, at least 64.
    workers : processes to share the work.
    solver : a method of `solvers`; None is the library's best. In a file { kind = "…", … }.
    """

    realisations: int
    duration: float
    dt: float
    until: float | None = None
    discard: float | None = None
    segment: int | None = None
    workers: int = 1
    solver: Any = None

    def __post_init__(self) -> None:
        require_positive("duration", self.duration, "ensemble", "give s")
        require_positive("dt", self.dt, "ensemble", "give the output sampling in s")
        require(self.realisations >= 2, "realisations must be at least 2", self.realisations, "[ensemble]", "e.g. 20")
        _check_workers(self.workers)
        if self.until is not None:
            require(0.0 < self.until < 1.0, "until must lie in (0, 1)", self.until, "[ensemble]", "e.g. 0.05")
        if self.discard is not None:
            require_non_negative("discard", self.discard, "[ensemble]", "give s")
        right = self.segment is None or self.segment >= FEWEST_IN_SEGMENT
        require(right, f"segment must be at least {FEWEST_IN_SEGMENT} samples", self.segment, "[ensemble]",
                "or leave it out")  # fmt: skip

    def check(self, scene: Scene) -> None:
        """Raise ValueError for a scene without noise."""
        check_noise(scene)

    def check_run(self, file: SceneFile, model: Model) -> None:
        """Raise ValueError where every realisation would be refused."""
        check_length(model, self.duration, self.dt, self.discard)

    def run(self, file: SceneFile, folder: Path, progress: bool = False) -> studies.Ensemble:
        """The ensemble, with its checkpoint ``ensemble.npz`` in the folder."""
        options = {"discard": self.discard, "segment": self.segment, "solver": self.solver}
        quantity = partial(studies.characteristics, duration=self.duration, dt=self.dt, **options)
        model, path = file.model(), folder / "ensemble.npz"
        self.check_run(file, model)
        with _pool(self.workers) as pool:
            found = studies.ensemble(
                model, self.realisations, quantity, pool, path, until=self.until, progress=progress
            )
        return replace(found, title=f"{len(found)} realisations of {self.duration:g} s")


@dataclass(frozen=True)
class Simulate:
    """The table [simulate]: integrate from rest.

    Parameters
    ----------
    duration : s, > 0.
    dt : output sampling in s, > 0.
    solver : a method of `solvers`; None is the library's best. In a file { kind = "…", … }.
    discard : s at the beginning that statistics leave out, 0 to below the duration.
    places : z in m of the outputs, or names of parts; None: tip and mid-beam. Of frames and structures places with a
        direction, or without: for section forces, and for motion along all components.
    quantities : outputs at the places, of stops and of supports; None: displacement, velocity, indentation, force.
        With either, means and extremes are tabled and histories written as CSV.
    """

    duration: float
    dt: float
    solver: Any = None
    discard: float = 0.0
    places: Sequence[Place] | None = None
    quantities: Sequence[Output] | None = None

    def __post_init__(self) -> None:
        require_positive("duration", self.duration, "simulate", "give s")
        require_positive("dt", self.dt, "simulate", "give the output sampling in s")
        require_non_negative("discard", self.discard, "simulate", "give s")
        for name in ("dt", "discard"):
            if not getattr(self, name) < self.duration:
                raise ValueError(
                    f"{name} must be below the duration of {self.duration:g} s, got {getattr(self, name):g}"
                )

    def check(self, scene: Scene) -> None:
        """Places lie on the beam, sections know their fibre where stress is asked for."""
        beam = scene.beam
        asked = None if self.places is None else scene.at(list(self.places), "places")
        if scene.named:
            check_named(beam, asked, self.quantities or ())
            return
        require("section forces" not in (self.quantities or ()), "section forces are of a Frame", self.quantities,
                "simulate", "ask for moment and shear")  # fmt: skip
        places = (0.0, beam.length / 2, beam.length) if asked is None else asked
        z = on_beam(np.array(places, dtype=float), beam, "places")
        if "stress" in (self.quantities or ()) and not np.isfinite(beam.profile(z).fibre).all():
            raise ValueError("stress needs the outer fibre of sections; give fibre in m, or a shape that knows it")

    @property
    def outputs(self) -> dict[str, Any]:
        """What is asked for, as `Run.to_csv` takes it; empty where nothing is."""
        chosen = {"places": self.places, "quantities": self.quantities}
        return {name: value for name, value in chosen.items() if value is not None}


def check_named(body: Any, places: Sequence[Any] | None, quantities: Sequence[str]) -> None:
    """Raise ValueError for outputs of a frame or structure that it does not have."""
    for at in places or ():
        if is_pair(at) and not is_numbered(at) and isinstance(at[1], str):
            direction_of(at[1], f"places, {quoted(at[0])}")  # another text is none
    own = [at[0] if is_directed(at) else at for at in places or ()]
    for at in own:
        body.check_place(at, "places")
    for place, way in filter(is_directed, places or ()):
        along = direction_of(way, f"places, {quoted(place)}")
        require_components(along, body.components_at(place), f"the place {quoted(place)}", "places")
    require("slope" not in quantities, "slope is of a Beam", quantities, "simulate",
            "ask for displacement at a place with direction rx, ry or rz")  # fmt: skip
    sections = [name for name in quantities if name in SECTIONS]
    require(not sections or bool(own), "section forces need places", sections, "simulate",
            'write places = [["A-B", 0.4]], a member and a distance in m')  # fmt: skip
    for at in own if sections else ():
        _check_section(body, at, "stress" in sections)


def _check_section(body: Any, at: Any, stress: bool) -> None:
    """Raise ValueError for a place that has no section forces, or with ``stress`` none of these."""
    number, place = body.located(at, "places") if hasattr(body, "located") else (0, at)
    one = body.bodies[number] if hasattr(body, "bodies") else body
    site = one.site(place, "places") if hasattr(one, "site") else None
    require(isinstance(site, tuple), "section forces must be asked for on a member of a frame", at, "places",
            'write ["A-B", 0.4], a member and a distance in m')  # fmt: skip
    assert site is not None
    known = not stress or one.members[site[0]].section.fibre is not None
    require(known, "stress needs the outer fibre of sections", at, "places",
            "give fibre in m, or a shape that knows it")  # fmt: skip


def _check_places(scene: Scene, places: list[Any], name: str) -> None:
    """Raise ValueError for places that do not exist on the scene's own body."""
    asked = scene.at(places, name)
    if scene.named:
        check_named(scene.beam, asked, ())
    else:
        on_beam(np.array(asked, dtype=float), scene.beam, name)


def _check_place(scene: Scene, z: Place | None) -> None:
    """Raise ValueError for a place, if one is given, that does not exist."""
    if z is not None:
        _check_places(scene, [z], "z")


def _check_place_of(quantity: Any, scene: Scene) -> None:
    """Raise ValueError where a quantity asks for a place that does not exist; of joined bodies the run tells."""
    if not scene.joints:
        _check_place(scene, getattr(quantity, "z", None))


@dataclass(frozen=True)
class OrbitTable:
    """The table [orbit]: one periodic motion by shooting; `Model.orbit` explains more.

    Parameters
    ----------
    period : in periods of the load; 2 is a 1/2 subharmonic.
    """

    period: int = 1

    def __post_init__(self) -> None:
        _check_period(self.period, "[orbit]")

    def check(self, scene: Scene) -> None:
        """Raise ValueError for loads without a period."""
        load_period(scene)

    def run(self, file: SceneFile, folder: Path, progress: bool = False) -> FoundOrbit:
        """The orbit."""
        return FoundOrbit(file.model().orbit(self.period, progress=progress))


@dataclass(frozen=True, eq=False)
class FoundOrbit(Result):
    """An orbit as the answer of a study."""

    orbit: Orbit

    @property
    def _extremes(self) -> dict[str, tuple[float, float]]:
        """Lowest and highest displacement, m, at the usual places."""
        return {name: self.orbit.extremes(z) for name, z in plot.places(self.orbit.model.shapes).items()}

    def table(self) -> list[dict[str, Any]]:
        """Extremes of the displacement, a place a row."""
        return [{"displacement": name, "min": low, "max": high} for name, (low, high) in self._extremes.items()]

    def plain(self) -> dict[str, Any]:
        """For JSON: period, stability, multipliers, extremes, contacts, state."""
        one, log = self.orbit, self.orbit.contacts
        return {
            "period": one.period,
            "seconds": one.found.period,
            "stable": bool(one.stable),
            "residual": one.found.residual,
            "multipliers": [{"size": float(abs(m)), "angle": float(np.angle(m))} for m in one.multipliers],
            "extremes": {name: {"min": low, "max": high} for name, (low, high) in self._extremes.items()},
            "contacts": log.table(),
            "phase": one.found.phase,
            "state": one.state.tolist(),
            "units": "SI: m, s, N, J, rad",
        }

    def _parts(self) -> list[Part]:
        """The kind of orbit, its extremes, its contacts."""
        one, log = self.orbit, self.orbit.contacts
        kind, sizes = "stable" if one.stable else "unstable", ", ".join(f"{abs(m):.4g}" for m in one.multipliers)
        head = f"{kind} orbit of period {one.period}, {one.found.period:.6g} s, |μ| = {sizes}"
        extremes = [(f"displacement, {name}", *both) for name, both in self._extremes.items()]
        return [head, "", (("", "min/m", "max/m"), extremes), *([""] if len(log) else []), *log.parts]

    def figure(self) -> Figure:
        """History and phase portrait."""
        return plot.orbit(self.orbit)


@dataclass(frozen=True)
class BranchTable:
    """The table [branch]: periodic motion along one number of the scene; `Model.branch` explains the keys.

    Parameters
    ----------
    span : (lowest, highest) value of the parameter.
    parameter : such as "omega", "amplitude", "stops[0].gap".
    period : in periods of the load.
    at : value of the parameter to start at; None: the scene's, if it lies in the span.
    step : largest step along the branch, in units of the span and the first orbit's size.
    """

    span: tuple[float, float]
    parameter: str = "omega"
    period: int = 1
    at: float | None = None
    step: float = 0.04

    def __post_init__(self) -> None:
        low, high = self.span
        require(
            -np.inf < low < high < np.inf,
            "span must be two values, ascending",
            self.span,
            "[branch]",
            "give [lowest, highest]",
        )
        within = self.at is None or low <= self.at <= high
        require(within, f"at must lie in the span of {low:g} to {high:g}", self.at, "[branch]", "or leave it out")
        require(0.0 < self.step <= 1.0, "step must lie in (0, 1]", self.step, "[branch]", "e.g. 0.04")
        _check_period(self.period, "[branch]")

    def check(self, scene: Scene) -> None:
        """Raise ValueError for a parameter that the scene does not have, or loads without a period."""
        load_period(with_value(scene, path_of(scene, self.parameter), self.span[1]))

    def run(self, file: SceneFile, folder: Path, progress: bool = False) -> FoundBranch:
        """The branch, saved as ``branch.npz`` in the folder; continues where an interrupted one left that."""
        return FoundBranch(self.followed(file.model(), folder / "branch.npz", progress))

    def followed(self, model: Model, kept: Path, progress: bool) -> Branch:
        """The branch, saved in a file; goes on from there if it exists, ValueError if it is another one's."""
        branch = model.branch(self.parameter, self.span, self.period, at=self.at, step=self.step)
        return branch.run(progress, kept)


@dataclass(frozen=True, eq=False)
class FoundBranch(Result):
    """A branch as the answer of a study."""

    branch: Branch

    def table(self) -> list[dict[str, Any]]:
        """One orbit a row."""
        return self.branch.table()

    def _units(self) -> dict[str, str]:
        return self.branch._units()

    def plain(self) -> dict[str, Any]:
        """Orbits and how each direction ended, as JSON has them."""
        return {"orbits": plain(self.table()), "status": self.branch.status}

    def _parts(self) -> list[Part]:
        return self.branch._parts()

    def figure(self) -> Figure:
        """The response diagram."""
        return plot.branch(self.branch)


def _check_period(period: int, where: str) -> None:
    """A whole number of load periods."""
    require(1 <= period <= MOST_PERIOD, f"period must be 1 to {MOST_PERIOD}", period, where, "2 is a 1/2 subharmonic")


@dataclass(frozen=True)
class BasinsTable:
    """The table [basins]: which periodic orbit each start of a plane comes to; `fb.study.basins` explains the keys."""

    x_span: Sequence[float]
    y_span: Sequence[float]
    x: str | int = "displacement"
    y: str | int = "velocity"
    points: int | Sequence[int] = 100
    z: Place | None = None
    start: Sequence[float] | None = None
    settle: int = 200
    longest: int = 8
    threads: int = 1

    def __post_init__(self) -> None:
        for name, span in (("x_span", self.x_span), ("y_span", self.y_span)):
            right = len(span) == 2 and -np.inf < span[0] < span[1] < np.inf
            require(right, f"{name} must be two finite values, ascending", span, "[basins]", "give [lowest, highest]")
        for name, axis in (("x", self.x), ("y", self.y)):
            known = is_whole(axis) or axis in ("displacement", "velocity")
            require(known, f"{name} must be 'displacement', 'velocity' or the number of a state", axis, "[basins]",
                    "q first, then its rates")  # fmt: skip
        for name in ("settle", "longest", "threads"):
            require(getattr(self, name) > 0, f"{name} must be above 0", getattr(self, name), "[basins]", "give a count")

    def check(self, scene: Scene) -> None:
        """Raise ValueError for points that make no grid, a place that the scene does not have, or no period."""
        checked_points(self.points)
        load_period(scene)
        _check_place(scene, self.z)

    def run(self, file: SceneFile, folder: Path, progress: bool = False) -> studies.Basins:
        """The basins, with their checkpoint ``basins.npz`` in the folder."""
        return studies.basins(file.model(), **vars(self), checkpoint=folder / "basins.npz", progress=progress)


@dataclass(frozen=True)
class CampbellTable:
    """The table [campbell]: frequencies of a rotor over its spin, and critical speeds.

    Parameters
    ----------
    spins : lowest and highest spin, rad/s. points : how many spins. modes : frequencies of each.
    """

    spins: tuple[float, float]
    points: int = 41
    modes: int = 4

    def __post_init__(self) -> None:
        low, high = self.spins
        require(low < high, "spins must be two values, ascending", self.spins, "[campbell]", "give [lowest, highest]")
        require(1 < self.points <= MOST_POINTS, f"points must be 2 to {MOST_POINTS}", self.points, "[campbell]",
                "e.g. 41")  # fmt: skip
        check_modes(self.modes)

    def check(self, scene: Scene) -> None:
        """Raise ValueError for a scene that is no shaft."""
        check_shaft(scene)

    def run(self, file: SceneFile, folder: Path, progress: bool = False) -> studies.Campbell:
        """The diagram."""
        spins = np.linspace(*self.spins, self.points)
        return studies.campbell(file.scene, spins, self.modes, **_mesh_of(file), progress=progress)


@dataclass(frozen=True)
class FloorSpectraTable:
    """The table [floor_spectra]: what equipment has to stand, by a run of its own; `fb.study.floor_spectra` says more.

    Parameters
    ----------
    places : z in m or names of parts; of frames and structures with a direction, or without: along x, y and z.
    duration : s. dt : output sampling in s, a tenth of the shortest contact.
    periods : of the oscillators, s; or omega, rad/s. points : how many between the two given ones, evenly in their
        logarithm; None: those given.
    zeta : damping ratio of the oscillators, one or several.
    solver : a method of `solvers`; None is the library's best. In a file { kind = "…", … }.
    """

    places: Sequence[Place]
    duration: float
    dt: float
    periods: Sequence[float] | None = None
    omega: Sequence[float] | None = None
    points: int | None = None
    zeta: float | Sequence[float] = 0.05
    solver: Any = None

    def __post_init__(self) -> None:
        where = "[floor_spectra]"
        require(len(self.places) > 0, "places must be one or more", self.places, where, 'such as [["valve", "x"]]')
        require_positive("duration", self.duration, where, "give s")
        require_positive("dt", self.dt, where, "give the output sampling in s")
        require(self.dt < self.duration, "dt must be below the duration", self.dt, where, "give s")
        checked_oscillators(self.omega, self.periods)
        checked_damping(self.zeta)
        ends = self.periods or self.omega or ()
        between = self.points is None or (1 < self.points <= MOST_POINTS and len(ends) == 2)
        require(between, f"points must be 2 to {MOST_POINTS}, between two periods or frequencies", self.points, where,
                "write periods = [0.02, 1.0] and points = 50, or list all")  # fmt: skip

    def check(self, scene: Scene) -> None:
        """Raise ValueError for places and directions that the scene does not have."""
        _check_places(scene, list(self.places), "places")

    def run(self, file: SceneFile, folder: Path, progress: bool = False) -> studies.FloorSpectra:
        """The spectra."""
        run = file.model().simulate(self.duration, self.dt, solver=self.solver, progress=progress)
        oscillators = {"omega": self._spread(self.omega), "periods": self._spread(self.periods)}
        return studies.floor_spectra(run, self.places, zeta=self.zeta, **oscillators, progress=progress)

    def _spread(self, given: Sequence[float] | None) -> Any:
        """The oscillators, those between the two given ones too."""
        return given if given is None or self.points is None else np.geomspace(given[0], given[1], self.points)


@dataclass(frozen=True)
class PeakTable:
    """The table [peak]: the peak of a response curve over a second number; `fb.study.peak` explains the keys.

    Parameters
    ----------
    over : the second number, such as "elements[damper].law.limit". values : of it, ascending, two or more.
    span : (lowest, highest) value of the parameter.
    z : place of the displacement; None: the first stop or element, else the tip.
    """

    over: str
    values: Sequence[float]
    span: tuple[float, float]
    parameter: str = "omega"
    z: Place | None = None

    def check(self, scene: Scene) -> None:
        """Raise ValueError for numbers that the scene does not have, or values that do not ascend."""
        check_peak(scene, self.parameter, self.over, self.values, self.span)
        _check_place(scene, self.z)

    def run(self, file: SceneFile, folder: Path, progress: bool = False) -> studies.Peak:
        """The study, with its checkpoint ``peak.npz`` in the folder."""
        return studies.peak(file.model(), **vars(self), checkpoint=folder / "peak.npz", progress=progress)


@dataclass(frozen=True)
class FoldTable:
    """The table [fold]: a fold of a branch over a second number; `fb.study.fold` explains the keys.

    Parameters
    ----------
    over : the second number, such as "amplitude". values : its (lowest, highest) value, the scene's among them.
    span : (lowest, highest) value of the parameter, of the branch with the fold.
    period : in periods of the load. number : which of the folds of the branch.
    z : place of the displacement; None: the first stop or element, else the tip.
    """

    over: str
    values: tuple[float, float]
    span: tuple[float, float]
    parameter: str = "omega"
    period: int = 1
    number: int = 0
    z: Place | None = None

    def __post_init__(self) -> None:
        _check_period(self.period, "[fold]")

    def check(self, scene: Scene) -> None:
        """Raise ValueError for numbers that the scene does not have, or values that do not ascend."""
        low, high = check_peak(scene, self.parameter, self.over, self.values, self.span, "[fold]")
        present = value_of(scene, path_of(scene, self.over))
        require(bool(low <= present <= high), f"values must hold the present value {present:.6g} of {self.over}",
                self.values, "[fold]", "give [lowest, highest]")  # fmt: skip
        _check_place(scene, self.z)

    def run(self, file: SceneFile, folder: Path, progress: bool = False) -> studies.Fold:
        """The study, its branch saved as ``fold.npz`` in the folder, its checkpoint is ``fold_curve.npz``."""
        along = BranchTable(self.span, self.parameter, self.period)
        branch = along.followed(file.model(), folder / "fold.npz", progress)
        kept = folder / "fold_curve.npz"
        return studies.fold(branch, self.over, self.values, self.number, self.z, progress, kept)


@dataclass(frozen=True)
class BackboneTable:
    """The table [backbone]: frequency and damping over amplitude by phase resonance; `fb.study.backbone` explains more.

    Parameters
    ----------
    levels : amplitudes of the tone, ascending, two or more. span : (lowest, highest) frequency about one resonance.
    level, parameter : the tone's amplitude and frequency.
    z : place of the displacement; None: the first stop or element, else the tip.
    """

    levels: Sequence[float]
    span: tuple[float, float]
    level: str = "amplitude"
    parameter: str = "omega"
    z: Place | None = None

    def check(self, scene: Scene) -> None:
        """Raise ValueError for numbers that the scene does not have, or levels that do not ascend."""
        check_backbone(scene, self.levels, self.span, self.level, self.parameter)
        _check_place(scene, self.z)

    def run(self, file: SceneFile, folder: Path, progress: bool = False) -> studies.Backbone:
        """The study, with its checkpoint ``backbone.npz`` in the folder."""
        return studies.backbone(file.model(), **vars(self), checkpoint=folder / "backbone.npz", progress=progress)


Draw = Mapping[str, str | float]  # a distribution of `scipy.stats` by its kind, with its numbers


@dataclass(frozen=True)
class VaryTable:
    """The table [vary]: quantities over values of parameters; `fb.study.vary` explains the keys.

    Parameters
    ----------
    parameters : { "stops[0].gap" = [values], … }, or of distributions { kind = "norm", loc = 1e-3, scale = 1e-5 }.
    quantity : one or a list. seeds : how many (0, 1, …). workers : processes to share the work.
    """

    parameters: Mapping[str, Sequence[float] | Draw]
    quantity: Quantity | Sequence[Quantity]
    duration: float | None = None
    dt: float | None = None
    discard: float = 0.0
    seeds: int = 0
    samples: int | None = None
    seed: int = 0
    workers: int = 1
    solver: Any = None

    @property
    def points(self) -> dict[str, Any]:
        """The parameters as `vary` takes them."""
        return {path: _drawn(path, one) if isinstance(one, dict) else one for path, one in self.parameters.items()}

    def check(self, scene: Scene) -> None:
        """Raise ValueError when the scene cannot be varied like this."""
        names, points, _ = points_of(self.points, self.samples, self.seed)
        _check_trials(self, scene, names, self.quantity, points)

    def run(self, file: SceneFile, folder: Path, progress: bool = False) -> studies.Variation:
        """The study, with its checkpoint ``vary.npz`` in the folder."""
        keys = _plan_of(self) | {"samples": self.samples, "seed": self.seed, "checkpoint": folder / "vary.npz"}
        with _pool(self.workers) as pool:
            return studies.vary(
                file.scene, self.points, self.quantity, **keys, **file.reduce, executor=pool, progress=progress
            )


@dataclass(frozen=True)
class MinimiseTable:
    """The table [minimise]: where a quantity is least; `fb.study.minimise` explains the keys.

    Parameters
    ----------
    parameters : { "stops[0].gap" = [low, high], … }. constraints : { peak_force = 20.0, … }, largest values.
    seeds : how many (0, 1, …). workers : processes to share the first points.
    """

    parameters: Mapping[str, tuple[float, float]]
    quantity: Quantity
    constraints: Mapping[str, float] | None = None
    duration: float | None = None
    dt: float | None = None
    discard: float = 0.0
    seeds: int = 0
    tolerance: float = 1e-4
    most: int = 200
    gradients: bool | None = None
    workers: int = 1
    solver: Any = None

    def check(self, scene: Scene) -> None:
        """Raise ValueError when the scene cannot be varied like this."""
        ends = box_of(self.parameters).T
        check_search(self.tolerance, self.most, len(self.parameters))
        limits_of(self.constraints or {})
        _check_trials(self, scene, list(self.parameters), [self.quantity, *(self.constraints or {})], ends)

    def run(self, file: SceneFile, folder: Path, progress: bool = False) -> studies.Minimum:
        """The search, with its checkpoint ``minimise.npz`` in the folder."""
        keys = _plan_of(self) | {
            name: getattr(self, name) for name in ("constraints", "tolerance", "most", "gradients")
        }
        keys |= {"checkpoint": folder / "minimise.npz", "progress": progress, **file.reduce}
        with _pool(self.workers) as pool:
            return studies.minimise(file.scene, self.parameters, self.quantity, executor=pool, **keys)


def _drawn(path: str, table: Mapping[str, Any]) -> Any:
    """A distribution of `scipy.stats` from its kind and numbers."""
    from scipy import stats

    kind: Any = getattr(stats, str(table.get("kind", "")), None)
    known = isinstance(kind, stats.rv_continuous)
    require(known, f"the kind of {path} must be a distribution of scipy.stats", table.get("kind"), "[vary]",
            'e.g. { kind = "norm", loc = 1e-3, scale = 1e-5 }')  # fmt: skip
    given = {key: value for key, value in table.items() if key != "kind"}
    needed = kind.shapes.split(", ") if kind.shapes else []
    right = {*needed} <= {*given} <= {*needed, "loc", "scale"}
    require(right, f"numbers of {table['kind']} must be {', '.join([*needed, 'loc', 'scale'])}", list(given),
            f"{path} of [vary]", "as scipy.stats calls them; loc is 0 and scale 1 if left out")  # fmt: skip
    return kind(**given)


def _plan_of(table: VaryTable | MinimiseTable) -> dict[str, Any]:
    """The arguments of a table that say how points are run."""
    _check_workers(table.workers)
    names = "duration", "dt", "discard", "solver"
    return {name: getattr(table, name) for name in names} | {"seeds": _seeds(table.seeds)}


def _check_trials(table: VaryTable | MinimiseTable, scene: Scene, names: list[str], asked: Any, points: Any) -> None:
    """Raise ValueError unless the scene can be made and run at these points."""
    trial = Trial.of(scene, names, asked, Plan(**_plan_of(table)), {})
    for one in trial.check(points):
        for _, quantity in trial.asked.parts:
            _check_place_of(quantity, one)


def _check_workers(workers: int) -> None:
    """Raise ValueError for a number of processes that no machine has."""
    require(1 <= workers <= MOST_WORKERS, f"workers must be 1 to {MOST_WORKERS}", workers, "study", "e.g. 2")


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor | None]:
    """So many processes, None of one; after Ctrl-C what they compute is not waited for."""
    if workers == 1:
        yield None
        return
    others = {process.pid for process in active_children()}
    with ProcessPoolExecutor(workers, initializer=_end_with_parent) as pool:
        try:
            yield pool
        except KeyboardInterrupt:
            for pid in {process.pid for process in active_children()} - others:
                with suppress(ProcessLookupError):  # it has ended
                    os.kill(pid or 0, signal.SIGINT)
            raise


def _end_with_parent() -> None:
    """A process of the pool ends when what began it was killed; else it waits for work, and holds its output open.

    Ctrl-C stops what it runs, and no wait for work: that would print a traceback and break the pool.
    """

    def watch(sentinel: int) -> None:
        wait([sentinel])
        os._exit(1)

    if (parent := parent_process()) is not None:
        Thread(target=watch, args=(parent.sentinel,), daemon=True).start()
    interrupts.heard_while(must_be_whole)


STUDIES: Constructors = {
    "simulate": Simulate,
    "orbit": OrbitTable,
    "branch": BranchTable,
    "basins": BasinsTable,
    "campbell": CampbellTable,
    "floor_spectra": FloorSpectraTable,
    "peak": PeakTable,
    "fold": FoldTable,
    "backbone": BackboneTable,
    "ensemble": EnsembleTable,
    "mode_count": _table_of(mode_count),
    "smallest_model": _table_of(smallest_model),
    "speed_accuracy": SpeedAccuracyTable,
    "vary": VaryTable,
    "minimise": MinimiseTable,
}
OWN_MODES = ("campbell", "mode_count", "smallest_model", "speed_accuracy")  # choose modes themselves, beside [reduce]
