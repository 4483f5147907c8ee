"""The command line: `fembeam run SCENE.toml --out DIR`, `fembeam modes SCENE.toml`.

Tables go to stdout, everything else to stderr. Exit codes: 0 done, 1 the integration failed (what was computed is
written), 2 bad input, 130 interrupted (what was computed is written and marked as partial).
"""

from __future__ import annotations

import math
import sys
import time
import warnings
from typing import TYPE_CHECKING, Any

from fembeam import __version__  # nothing slow up here: Ctrl-C before `main` would print a traceback

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence
    from pathlib import Path

    from fembeam.model import Model
    from fembeam.run import Run
    from fembeam.scene_file import SceneFile

FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130
MODES_SHOWN = 10


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit code."""
    try:
        arguments = _parser().parse_args(argv)
        with warnings.catch_warnings():
            warnings.simplefilter("default", UserWarning)
            warnings.showwarning = _show_warning
            return int(arguments.command(arguments))
    except (ValueError, TypeError, OSError, ArithmeticError, MemoryError) as error:
        _say(f"error: {_one_line(error)}")
        return BAD_INPUT
    except KeyboardInterrupt:
        _say("interrupted; files that were written are whole")
        return INTERRUPTED


def _parser() -> argparse.ArgumentParser:
    """Commands and options."""
    import argparse
    from pathlib import Path

    parser = argparse.ArgumentParser(prog="fembeam", description="Beams that meet stops: simulate a scene file.")
    parser.add_argument("--version", action="version", version=f"fembeam {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    run = commands.add_parser("run", help="run the file's studies; write tables, figures and, for [simulate], run.npz")
    run.add_argument("scene", metavar="SCENE.toml", type=Path)
    run.add_argument("--out", metavar="DIR", type=Path, required=True, help="folder for the results")
    run.add_argument("--quiet", action="store_true", help="no progress, no log")
    run.set_defaults(command=_run)

    modes = commands.add_parser("modes", help="print natural frequencies, damping, participation")
    modes.add_argument("scene", metavar="SCENE.toml", type=Path)
    modes.add_argument("--modes", metavar="N", type=int, help=f"how many; default: [reduce], else {MODES_SHOWN}")
    modes.set_defaults(command=_modes)
    return parser


def _run(arguments: argparse.Namespace) -> int:
    """The command `run`."""
    from fembeam import report, scene_file

    begin = time.perf_counter()
    file = scene_file.read(arguments.scene)
    if not file.studies:
        raise ValueError(f"{file.path}: needs a study, such as a table [simulate] with duration and dt")
    folder = report.prepared(arguments.out)
    code = _simulation(file, folder, begin, arguments.quiet) if "simulate" in file.studies else 0
    for name, study in file.studies.items():
        if name != "simulate" and not code:
            todo = _model_study if hasattr(study, "write") else _study
            code = todo(file, name, study, folder, arguments.quiet)
    return code


def _model_study(file: SceneFile, name: str, study: Any, folder: Path, quiet: bool) -> int:
    """A study of the reduced model that writes its own files, and goes on where an interrupted one left them."""
    model = _reduced(file, **file.reduce)
    try:
        result = study.run(model, folder, progress=not quiet)
    except RuntimeError as error:
        _say(f"error: [{name}]: {_one_line(error)}")
        return FAILED
    print(result)
    written = study.write(result, folder)
    if not quiet:
        _say(f"wrote {', '.join(path.name for path in written)} to {folder}")
    return FAILED if getattr(result, "failures", None) else 0


def _simulation(file: SceneFile, folder: Path, begin: float, quiet: bool) -> int:
    """The study [simulate]."""
    from fembeam import report

    model = _reduced(file, **file.reduce)
    if not quiet:
        _say(f"{len(model.omega)} modes: " + ", ".join(f"{w:.6g}" for w in model.omega) + " rad/s")
    run, code = _simulated(model, file.studies["simulate"], not quiet)
    written = report.write(run, folder, file.studies["simulate"].discard, time.perf_counter() - begin)
    if code:
        _say(f"{run.status}; wrote what was computed to {folder}")
    elif not quiet:
        spent = f"{run.cost.seconds:.3g} s of {time.perf_counter() - begin:.3g} s"
        _say(f"{len(run.contacts)} contacts in {run.t[-1]:g} s, integrated in {spent}")
        _say(f"wrote {', '.join(path.name for path in written)} to {folder}")
    return code


def _study(file: SceneFile, name: str, study: Any, folder: Path, quiet: bool) -> int:
    """Any other study: its table on stdout and in a text file, its figure; what is not met is told and written too."""
    import solvers
    from fembeam import report
    from fembeam.study import NotMetError

    code = 0
    try:
        result = study.run(file.scene)
    except NotMetError as error:
        result, code = error.evidence, FAILED
        _say(f"error: {_one_line(error)}")
    except solvers.SolverError as error:
        _say(f"error: [{name}]: {_one_line(error)}")
        return FAILED
    print(result)
    written = report.write_study(result, folder, name)
    if not quiet:
        _say(f"wrote {', '.join(path.name for path in written)} to {folder}")
    return code


def _reduced(file: SceneFile, **arguments: Any) -> Model:
    """The reduced model; what is wrong is said with the file."""
    try:
        return file.scene.reduce(**arguments)
    except (ValueError, TypeError, RuntimeError) as error:  # RuntimeError: modes that cannot be computed
        raise ValueError(f"{file.source.place('[reduce]', str(error))}: {error}") from error


def _simulated(model: Model, study: Any, progress: bool) -> tuple[Run, int]:
    """The run and the exit code: a failed or interrupted one is partial."""
    import solvers
    from fembeam.run import Run

    try:
        run = model.simulate(study.duration, study.dt, solver=study.solver, progress=progress)
    except solvers.SolverError as error:
        _say(f"error: {_one_line(error)}")
        return Run.of(model.lasting(study.duration), error.solution), FAILED
    return run, 0 if run.complete else INTERRUPTED


def _modes(arguments: argparse.Namespace) -> int:
    """The command `modes`."""
    from fembeam import scene_file

    file = scene_file.read(arguments.scene)
    wanted = dict(file.reduce)
    if arguments.modes is not None or not {"modes", "omega_max", "mass_share"} & set(wanted):
        shown = MODES_SHOWN if arguments.modes is None else arguments.modes
        wanted = {**wanted, "modes": shown, "omega_max": None, "mass_share": None}
    print(mode_table(_reduced(file, **wanted)))
    return 0


def mode_table(model: Model) -> str:
    """Modes with frequency, damping, participation Γ, effective mass Γ² and its share of the moving mass."""
    mass = model.moving_mass
    head = "mode", "rad/s", "Hz", "zeta", "participation", "effective mass", "% of moving mass"
    unit = "", "", "", "", "√kg", "kg", f"{mass:.6g} kg"
    rows = [
        (
            name,
            f"{w:.6f}",
            f"{w / (2 * math.pi):.6f}",
            f"{z:.4g}",
            f"{g:.6g}",
            f"{g**2:.6g}",
            f"{100 * g**2 / mass:.3f}",
        )
        for name, w, z, g in zip(model.names, model.omega, model.zeta, model.participation, strict=True)
    ]
    share = 100 * float(model.effective_mass.sum()) / mass
    rows.append(("all", "", "", "", "", f"{model.effective_mass.sum():.6g}", f"{share:.3f}"))
    widths = [max(len(row[i]) for row in (head, unit, *rows)) for i in range(len(head))]
    lines = [
        "  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in (head, unit, *rows)
    ]
    return "\n".join(line.rstrip() for line in lines)


def _say(message: str) -> None:
    """One line on stderr."""
    print(f"fembeam: {message}", file=sys.stderr)


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    """A warning as one line."""
    _say(f"warning: {_one_line(message)}")


def _one_line(message: object) -> str:
    """A message without line breaks."""
    return " ".join(str(message).split())


if __name__ == "__main__":
    sys.exit(main())
