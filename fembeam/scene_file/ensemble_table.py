"""The table [ensemble] of a scene file."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fembeam.study.ensemble import Ensemble, ensemble
from fembeam.study.stationary import characteristics
from fembeam.support import require_positive

if TYPE_CHECKING:
    from fembeam.model import Model


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
