"""Studies as tables of a scene file: what to ask, checked when read, run on the file's scene."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import solvers
from fembeam.beams import on_beam
from fembeam.model.run_csv import Output
from fembeam.scene_file.basins_table import BasinsTable
from fembeam.scene_file.keys import Constructors, parameters
from fembeam.scene_file.orbit_tables import BranchTable, OrbitTable
from fembeam.study.ensemble import Ensemble, ensemble
from fembeam.study.measure import Plan
from fembeam.study.mode_count import ModeCount, checked_counts, mode_count
from fembeam.study.quantities import named
from fembeam.study.smallest_model import MOST, check_goal, smallest_model
from fembeam.study.smallest_model_result import SmallestModel
from fembeam.study.speed_accuracy import speed_accuracy
from fembeam.study.speed_accuracy_result import SpeedAccuracy
from fembeam.study.stationary import characteristics
from fembeam.support import require, require_non_negative, require_positive

if TYPE_CHECKING:
    from fembeam.model import Model
    from fembeam.scene import Scene

NOT_IN_A_FILE = "scene", "start", "solver", "executor"  # arguments of studies that are Python objects
MOST_SEEDS = 100_000


@dataclass(frozen=True)
class ModeStudy:
    """A study over numbers of modes and what is asked: arguments of its function, `seeds` being a count."""

    study: Callable[..., Any]
    arguments: dict[str, Any]

    @property
    def seeds(self) -> tuple[int, ...]:
        """The seeds 0, 1, ... of that many realisations."""
        count = self.arguments.get("seeds", 0)
        require(0 <= count <= MOST_SEEDS, f"seeds must be 0 to {MOST_SEEDS}", count, "study", "e.g. 8")
        return tuple(range(count))

    def check(self, scene: Scene) -> None:
        """Raise ValueError when the scene cannot be run like this."""
        asked = self.arguments
        if "counts" in asked:
            checked_counts(asked["counts"])
        else:
            check_goal(asked["tolerance"], asked.get("most", MOST))
        runs = {name: asked[name] for name in ("duration", "dt", "discard") if name in asked}
        Plan(**runs, seeds=self.seeds).check(scene, named(asked["quantity"]))

    def run(self, scene: Scene) -> ModeCount | SmallestModel:
        """The study; NotMetError when there is no such model."""
        found: ModeCount | SmallestModel = self.study(scene, **{**self.arguments, "seeds": self.seeds})
        return found


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

    def run(self, scene: Scene) -> SpeedAccuracy:
        """The study."""
        methods: list[Any] = [solvers.Exponential(rtol) for rtol in self.rtols]
        methods += [solvers.DormandPrince(rtol) for rtol in self.rtols] + [solvers.RK4(step) for step in self.steps]
        models = [scene.reduce(modes=n) for n in sorted(set(self.modes))]
        return speed_accuracy(models, methods, self.starts, self.duration, rounds=self.rounds, progress=True)


@dataclass(frozen=True)
class EnsembleTable:
    """The table [ensemble]: independent realisations of the noise, `characteristics` of each.

    Parameters
    ----------
    realisations : how many, at least 2; with `until` the most.
    duration : s of each that the statistics use. dt : output sampling in s.
    until : relative standard error of every mean at which to stop; None: compute all.
    discard : s left out of each; None: until the transient has died out.
    segment : samples of a Welch segment; None: 2 rad/s of resolution.
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
        for name, least in (("realisations", 2), ("workers", 1)):
            if getattr(self, name) < least:
                raise ValueError(f"{name} must be at least {least}, got {getattr(self, name)}")

    def run(self, model: Model, folder: Path, progress: bool = False) -> Ensemble:
        """The ensemble, with its checkpoint ``ensemble.npz`` in the folder."""
        options = {"discard": self.discard, "segment": self.segment, "solver": self.solver}
        quantity = partial(characteristics, duration=self.duration, dt=self.dt, **options)
        with ExitStack() as stack:
            pool = stack.enter_context(ProcessPoolExecutor(self.workers)) if self.workers > 1 else None
            path = folder / "ensemble.npz"
            return ensemble(model, self.realisations, quantity, pool, path, until=self.until, progress=progress)

    def write(self, result: Ensemble, folder: Path) -> list[Path]:
        """Write means with standard errors as JSON and the spectra as a figure; returns the files, checkpoint first."""
        from fembeam.plot import random_spectra
        from fembeam.results.files import write_json
        from fembeam.statistics import Spectrum
        from fembeam.support import written_whole

        numbers = {name: result[name] for name, values in result.values.items() if values.ndim == 1}
        content = {
            name: {"mean": float(e.value), "standard_error": float(e.standard_error)} for name, e in numbers.items()
        }
        failures = [{"seed": str(f.seed), "reason": f.reason} for f in result.failures]
        about = {
            "realisations": len(result),
            "enough": result.enough,
            "failures": failures,
            "units": "SI: m, s, N, rad/s",
        }
        written = [folder / "ensemble.npz", write_json(folder / "ensemble.json", {**about, "numbers": content})]
        omega, lines = result.values["omega"][0], [name for name in result.values if name.endswith(" psd")]
        spectra = {n: Spectrum(omega, result[n].value, 0, np.asarray(result[n].standard_error)) for n in lines}
        figure = random_spectra({f"{len(result)} realisations of {self.duration:g} s": spectra}, float(omega[-1]))
        with written_whole(folder / "ensemble.png") as file:
            figure.savefig(file, format="png", dpi=150, metadata={"Software": None})
        return [*written, folder / "ensemble.png"]


@dataclass(frozen=True)
class Simulate:
    """The table [simulate]: integrate from rest.

    Parameters
    ----------
    duration : s, > 0.
    dt : output sampling in s, > 0.
    solver : a method of `solvers`; None is the library's best. In a file { kind = "…", … }.
    discard : s at the beginning that statistics leave out, 0 to below the duration.
    places : z in m of the outputs; None: tip and mid-beam.
    quantities : outputs at the places, of stops and of supports; None: displacement, velocity, indentation, force.
        With either, means and extremes are tabled and histories written as CSV.
    """

    duration: float
    dt: float
    solver: Any = None
    discard: float = 0.0
    places: Sequence[float] | None = None
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
        places = (0.0, beam.length / 2, beam.length) if self.places is None else self.places
        z = on_beam(np.array(places, dtype=float), beam, "places")
        if "stress" in (self.quantities or ()) and not np.isfinite(beam.profile(z).fibre).all():
            raise ValueError("stress needs the outer fibre of sections; give fibre in m, or a shape that knows it")

    @property
    def outputs(self) -> dict[str, Any]:
        """What is asked for, as `Run.to_csv` takes it; empty where nothing is."""
        chosen = {"places": self.places, "quantities": self.quantities}
        return {name: value for name, value in chosen.items() if value is not None}


STUDIES: Constructors = {
    "simulate": Simulate,
    "orbit": OrbitTable,
    "branch": BranchTable,
    "basins": BasinsTable,
    "ensemble": EnsembleTable,
    "mode_count": _table_of(mode_count),
    "smallest_model": _table_of(smallest_model),
    "speed_accuracy": SpeedAccuracyTable,
}
