"""The command `fembeam run`: every study of a scene file into a result folder, one after the other.

If a study fails the others still run; a signal ends them all. Results are written before they are printed, and the
folder's record says which studies are finished, so that `--resume` continues there.
"""

from __future__ import annotations

import json
import time
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fembeam.cli.messages import BAD_INPUT, FAILED, interrupted, one_line, say, show_warning, warned
from fembeam.results import files as report
from fembeam.results import folder as folders
from fembeam.support import interrupts
from solvers.problem import counted

if TYPE_CHECKING:
    from fembeam.model import Model, Run
    from fembeam.scene_file import SceneFile


@dataclass(frozen=True)
class Job:
    """What to do: the scene, where to, and how."""

    file: SceneFile
    folder: Path
    resume: bool = False
    quiet: bool = False
    json: bool = False

    @cached_property
    def model(self) -> Model:
        """The scene reduced as [reduce] says."""
        return self.file.model()

    @cached_property
    def doubts(self) -> list[str]:
        """What `fembeam check` warns of; none where the scene cannot be reduced, which the study says."""
        from fembeam.inspection import doubts

        try:
            return doubts(self.model, **self.file.of_run)
        except (ValueError, ArithmeticError, MemoryError, RuntimeError):
            interrupts.check()  # a compiler that is stopped in the middle raises what it likes
            return []


@dataclass
class Outcome:
    """What became of a study: exit code, what it found as JSON has it and as text, its files, whether to go on."""

    code: int = 0
    found: Any = None
    text: str = ""
    files: list[Path] = field(default_factory=list)
    last: bool = False


def run(job: Job) -> int:
    """All studies and the report; returns the exit code.

    Raises
    ------
    ValueError : no study in the file, or a checkpoint in the folder that would be overwritten.
    """
    studies = sorted(job.file.studies, key="simulate".__ne__)  # the cheapest one first
    if not studies:
        raise ValueError(f"{job.file.path}: needs a study, such as a table [simulate] with duration and dt")
    if not job.resume:
        _check_checkpoints(job, studies)
    code, found, files = 0, {}, []
    for name in studies:
        outcome = _study_outcome(job, name)
        if outcome.text and not job.json:
            print(outcome.text)
        code, found[name] = code or outcome.code, outcome.found
        files += outcome.files
        if outcome.last:
            break
    if files:
        code = _report(job, files) or code
    if job.json:
        report.print_json(found)
    return code or (interrupted() if interrupts.received() else 0)


def _check_checkpoints(job: Job, studies: list[str]) -> None:
    """Refuse to overwrite checkpoints, which hold hours of work."""
    for name in studies:
        path = job.folder / f"{name}.npz"
        if path.exists():
            said = folders.changed(job.folder, job.file, name)
            of = f" of another scene: {said}; set it back and add" if said else ": add"
            raise ValueError(f"{path} holds results of [{name}]{of} --resume to continue, delete the file to start "
                             "anew, or choose another folder")  # fmt: skip


def _report(job: Job, files: list[Path]) -> int:
    """Draw the rig and write the page."""
    from fembeam.results import html_page as html

    try:
        with interrupts.deferred():
            rig = report.write_figure(job.folder / "rig.png", job.file.scene.figure())
            page = html.write_page(job.folder, job.file.source, _warnings(job), [rig, *files])
            _wrote(job, [rig, page])
    except OSError as error:
        return _unwritten(error).code
    return 0


def _warnings(job: Job) -> list[str]:
    """What this command warned of, and what was when the studies that it kept were computed."""
    done = folders.finished(job.folder)
    kept = [name for name in job.file.studies if folders.kept(job.folder, name, folders.digest(job.file, name))]
    return list(dict.fromkeys([*(said for name in kept for said in done[name]["warnings"]), *warned]))


def _study_outcome(job: Job, name: str) -> Outcome:
    """One study, kept or computed, its end recorded."""
    scene = folders.digest(job.file, name)
    if job.resume and (files := folders.kept(job.folder, name, scene)):
        if not job.quiet:
            say(f"[{name}] is done already; its results are kept")
        return _kept_results(name, files)
    try:
        folders.record(job.folder, job.file, name)
        for doubt in _doubts(job, name):
            show_warning(doubt)
        outcome = _simulation(job) if name == "simulate" else _computed(job, name)
        with interrupts.deferred():
            if not outcome.code:
                folders.record(job.folder, job.file, name, outcome.files, warned)
    except OSError as error:
        return _unwritten(error)
    except KeyboardInterrupt:
        say(f"interrupted in [{name}]; files that were written are whole" + _how_to_resume(job, name))
        return Outcome(interrupted(), last=True)
    if interrupts.received():
        outcome.code, outcome.last = outcome.code or interrupted(), True
    return outcome


def _doubts(job: Job, name: str) -> list[str]:
    """What looks wrong before a study: of one that takes modes of its own, with the numbers of the scene alone."""
    from fembeam.inspection.units import of_bodies
    from fembeam.scene_file.study_tables import OWN_MODES

    return of_bodies(job.file.scene) if name in OWN_MODES else job.doubts


def _how_to_resume(job: Job, name: str) -> str:
    """How to go on."""
    return f"; --resume goes on from {name}.npz" if (job.folder / f"{name}.npz").exists() else ""


def _kept_results(name: str, files: list[Path]) -> Outcome:
    """What a finished study left."""
    known = {path.name: path for path in files}
    found = json.loads(known["summary.json" if name == "simulate" else f"{name}.json"].read_text(encoding="utf-8"))
    text = report.text(found) if name == "simulate" else known[f"{name}.txt"].read_text(encoding="utf-8").rstrip()
    return Outcome(0, found, text, files)


def _computed(job: Job, name: str) -> Outcome:
    """A study other than [simulate]."""
    import solvers
    from fembeam.study import NotMetError

    code = 0
    try:
        result = job.file.studies[name].run(job.file, job.folder, progress=not job.quiet)
        code = FAILED if getattr(result, "failures", None) else 0
    except NotMetError as error:
        result, code = error.evidence, FAILED
        say(f"error: {one_line(error)}")
    except (solvers.SolverError, RuntimeError) as error:
        if interrupts.received():  # a compiler that is stopped in the middle raises what it likes
            raise KeyboardInterrupt from error
        say(f"error: [{name}]: {one_line(error)}")
        return Outcome(FAILED)
    except (ValueError, TypeError, ArithmeticError, MemoryError) as error:
        say(f"error: {job.file.placed(f'[{name}]', error)}")
        return Outcome(BAD_INPUT)
    outcome = Outcome(code, result.plain(), str(result))
    try:
        with interrupts.deferred():
            outcome.files = report.write_study(result, job.folder, name)
    except OSError as error:
        outcome.code, outcome.last = _unwritten(error).code, True
    _wrote(job, outcome.files)
    return outcome


def _frequencies(model: Model) -> str:
    """Frequencies of modes, and those of static shapes, which are none of the structure."""
    named = list(zip(model.names, model.omega.tolist(), strict=True))
    shapes = [w for name, w in named if name.startswith("static")]
    modes = [w for name, w in named if not name.startswith("static")]
    groups = {"mode": modes, "static shape": shapes}
    told = (f"{counted(len(of), word)}: {', '.join(f'{w:.6g}' for w in of)} rad/s" for word, of in groups.items() if of)
    return "; ".join(told)


def _simulation(job: Job) -> Outcome:
    """The study [simulate]."""
    started, study = time.perf_counter(), job.file.studies["simulate"]
    model = job.model
    if not job.quiet:
        say(_frequencies(model))
    with interrupts.deferred():
        try:
            done, code = _simulated(job.file, model, not job.quiet)
        except (ValueError, TypeError, ArithmeticError, MemoryError) as error:
            say(f"error: {job.file.placed('[simulate]', error)}")
            return Outcome(BAD_INPUT)
        found = report.summary(done, study.discard, time.perf_counter() - started, study.outputs)
        found["warnings"] = list(warned)
        outcome = Outcome(code, found, report.text(found))
        try:
            outcome.files = report.write(done, job.folder, study.discard, found, study.outputs)
        except OSError as error:
            outcome.code, outcome.last = _unwritten(error).code, True
            return outcome
    if code:
        say(f"{done.status}; wrote what was computed to {job.folder}")
    elif not job.quiet:
        spent = f"{done.cost.seconds:.3g} s of {time.perf_counter() - started:.3g} s"
        say(f"{counted(len(done.contacts), 'contact')} in {done.t[-1]:g} s, integrated in {spent}")
        _wrote(job, outcome.files)
    return outcome


def _simulated(file: SceneFile, model: Model, progress: bool) -> tuple[Run, int]:
    """The run and the exit code: a failed or interrupted one is partial."""
    from dataclasses import replace

    import solvers
    from fembeam.model import Run

    study = file.studies["simulate"]
    try:
        run = model.simulate(study.duration, study.dt, solver=study.solver, progress=progress)
        code = 0 if run.complete else interrupted()
    except solvers.SolverError as error:
        say(f"error: {one_line(error)}")
        run, code = Run.of(model.for_duration(study.duration), error.solution), FAILED
    return replace(run, source=file.source), code


def _wrote(job: Job, files: list[Path]) -> None:
    """Say which files there are now."""
    if files and not job.quiet:
        say(f"wrote {', '.join(path.name for path in files)} to {job.folder}")


def _unwritten(error: OSError) -> Outcome:
    """Say that results could not be written; there is no use in going on."""
    say(f"error: results cannot be written: {one_line(error)}; files that were written are whole")
    return Outcome(FAILED, last=True)
