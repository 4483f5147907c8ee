"""The command line: `fembeam new`, `check`, `modes`, `run`, `compare`, `export`, `schema`.

Tables (with --json: JSON) go to stdout, everything else to stderr. Exit codes: 0 done, 1 a computation failed or its
results could not be written (what was computed is written where possible), 2 bad input, 130 interrupted and 143
terminated (what was computed is written and marked as partial).
"""

from __future__ import annotations

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

FAILED, BAD_INPUT, INTERRUPTED, TERMINATED = 1, 2, 130, 143
MODES_SHOWN = 10
_warned: list[str] = []  # by this command


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit code."""
    try:
        from fembeam import interrupts

        _warned.clear()
        with interrupts.listening():
            arguments = _parser().parse_args(argv)
            with warnings.catch_warnings():
                warnings.simplefilter("default", UserWarning)
                warnings.showwarning = _show_warning
                return int(arguments.command(arguments))
    except BrokenPipeError:  # the reader of a table has seen enough
        sys.stdout = None  # type: ignore[assignment]
        return FAILED
    except (ValueError, TypeError, OSError, ArithmeticError, MemoryError) as error:
        _say(f"error: {_one_line(error)}")
        return BAD_INPUT
    except KeyboardInterrupt:
        _say("interrupted; files that were written are whole")
        return _interrupted()


def _parser() -> argparse.ArgumentParser:
    """Commands and options."""
    import argparse
    from pathlib import Path

    parser = argparse.ArgumentParser(prog="fembeam", description="Beams that meet stops: simulate a scene file.")
    parser.add_argument("--version", action="version", version=f"fembeam {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    def command(name: str, does: Any, about: str, scene: bool = True) -> argparse.ArgumentParser:
        made = commands.add_parser(name, help=about, description=about)
        made.set_defaults(command=does)
        if scene:
            made.add_argument("scene", metavar="SCENE", type=Path, help="scene file, or a run.npz that came from one")
            made.add_argument("--set", metavar="KEY=VALUE", action="append", default=[], help="change one value, "
                              "such as simulate.duration=10 or stops[0].gap=1e-3; may be repeated")  # fmt: skip
            made.add_argument("--json", action="store_true", help="print JSON instead of tables")
        return made

    new = command("new", _new, "write an annotated scene file to begin with", scene=False)
    new.add_argument("path", metavar="SCENE", type=Path)
    look = command("check", _check, "tell what a scene is: modes, contacts to expect, steps to take, doubtful units")
    modes = command("modes", _modes, "print natural frequencies, damping, participation")
    for each in (look, modes):
        each.add_argument("--modes", metavar="N", type=int, help=f"how many; default: [reduce], else {MODES_SHOWN}")
    run = command(
        "run", _run, "run the file's studies; write tables, figures, report.html and, for [simulate], run.npz"
    )
    run.add_argument("--out", metavar="DIR", type=Path, required=True, help="folder for the results")
    run.add_argument("--quiet", action="store_true", help="no progress, no log")
    compare = command("compare", _compare, "compare the results in two folders", scene=False)
    compare.add_argument("folders", metavar="DIR", type=Path, nargs=2)
    compare.add_argument("--out", metavar="DIR", type=Path, help="folder for overlaid figures")
    compare.add_argument("--json", action="store_true", help="print JSON instead of a table")
    export = command("export", _export, "write a saved run as CSV: histories and contacts", scene=False)
    export.add_argument("run", metavar="RUN.npz", type=Path)
    export.add_argument("--out", metavar="DIR", type=Path, required=True)
    export.add_argument("--stride", metavar="N", type=int, default=1, help="keep every N-th sample")
    command("schema", _schema, "print the JSON Schema of scene files", scene=False)
    return parser


def _new(arguments: argparse.Namespace) -> int:
    """The command `new`."""
    from fembeam.template import TEMPLATE

    with arguments.path.open("x", encoding="utf-8") as file:  # x: what exists is kept
        file.write(TEMPLATE.format(name=arguments.path.name))
    _say(f"wrote {arguments.path}; next: fembeam check {arguments.path}")
    return 0


def _schema(_: argparse.Namespace) -> int:
    """The command `schema`."""
    from fembeam.json_schema import json_schema

    _print(json_schema(), True)
    return 0


def _check(arguments: argparse.Namespace) -> int:
    """The command `check`."""
    from fembeam.check import check

    file = _read(arguments)
    found = check(file, _reduced(file, **_wanted(file, arguments.modes)))
    for doubt in found.warnings:
        _show_warning(doubt)
    _print(found.plain() | {"warnings": _warned} if arguments.json else found, arguments.json)
    return 0


def _modes(arguments: argparse.Namespace) -> int:
    """The command `modes`."""
    from fembeam.modes_table import mode_rows, mode_table

    file = _read(arguments)
    wanted = dict(file.reduce)
    if arguments.modes is None and not {"modes", "omega_max", "mass_share"} & set(wanted):
        wanted["modes"] = MODES_SHOWN
    model = _reduced(file, **(wanted if arguments.modes is None else _wanted(file, arguments.modes)))
    _print(mode_rows(model) if arguments.json else mode_table(model), arguments.json)
    return 0


def _compare(arguments: argparse.Namespace) -> int:
    """The command `compare`."""
    from fembeam import compare

    found = compare.compare(*arguments.folders)
    _print(compare.plain(found) if arguments.json else compare.table(found, *arguments.folders), arguments.json)
    if arguments.out:
        written = compare.write_figures(arguments.folders[0], arguments.folders[1], arguments.out)
        _say(f"wrote {', '.join(p.name for p in written) or 'no figure: only one folder has a run'} to {arguments.out}")
    return 0


def _export(arguments: argparse.Namespace) -> int:
    """The command `export`."""
    from fembeam import report
    from fembeam.run import load

    run = load(arguments.run)
    written = run.to_csv(report.prepared(arguments.out), arguments.stride)
    _say(f"wrote {', '.join(path.name for path in written)} to {arguments.out}")
    return 0


def _run(arguments: argparse.Namespace) -> int:
    """The command `run`."""
    from fembeam import html, report

    file = _read(arguments)
    if not file.studies:
        raise ValueError(f"{file.path}: needs a study, such as a table [simulate] with duration and dt")
    folder, code, found = report.prepared(arguments.out), 0, {}
    for name in sorted(file.studies, key="simulate".__ne__):  # the cheapest one first
        if not code:
            code, found[name] = _studied(file, name, folder, arguments)
    try:
        html.write_page(folder, file.source, _warned)
    except OSError as error:
        code = code or _unwritten(error)
    if arguments.json:
        _print(found, True)
    return code


def _studied(file: SceneFile, name: str, folder: Path, arguments: argparse.Namespace) -> tuple[int, Any]:
    """One study: exit code, and what it found as JSON has it."""
    import solvers
    from fembeam import report
    from fembeam.study import NotMetError

    study, quiet = file.studies[name], arguments.quiet
    try:
        if name == "simulate":
            return _simulation(file, folder, arguments)
        if hasattr(study, "write"):  # goes on where an interrupted one left its files
            result = study.run(_reduced(file, **file.reduce), folder, progress=not quiet)
        else:
            result = study.run(file.scene)
        code = FAILED if getattr(result, "failures", None) else 0
    except NotMetError as error:
        result, code = error.evidence, FAILED
        _say(f"error: {_one_line(error)}")
    except (solvers.SolverError, RuntimeError) as error:
        _say(f"error: [{name}]: {_one_line(error)}")
        return FAILED, None
    if not arguments.json:
        print(result)
    try:
        written = study.write(result, folder) if hasattr(study, "write") else report.write_study(result, folder, name)
    except OSError as error:
        return _unwritten(error), report.plain(result)
    if not quiet:
        _say(f"wrote {', '.join(path.name for path in written)} to {folder}")
    return code, report.plain(result)


def _simulation(file: SceneFile, folder: Path, arguments: argparse.Namespace) -> tuple[int, Any]:
    """The study [simulate]."""
    from fembeam import interrupts, report

    begin, study, quiet = time.perf_counter(), file.studies["simulate"], arguments.quiet
    model = _reduced(file, **file.reduce)
    if not quiet:
        _say(f"{len(model.omega)} modes: " + ", ".join(f"{w:.6g}" for w in model.omega) + " rad/s")
    with interrupts.deferred():
        run, code = _simulated(file, model, not quiet)
        found = report.summary(run, study.discard, time.perf_counter() - begin)
        if not arguments.json:
            print(report.text(found))
        try:
            written = report.write(run, folder, study.discard, {**found, "warnings": list(_warned)})
        except OSError as error:
            return _unwritten(error), found
    if code:
        _say(f"{run.status}; wrote what was computed to {folder}")
    elif not quiet:
        spent = f"{run.cost.seconds:.3g} s of {time.perf_counter() - begin:.3g} s"
        _say(f"{len(run.contacts)} contacts in {run.t[-1]:g} s, integrated in {spent}")
        _say(f"wrote {', '.join(path.name for path in written)} to {folder}")
    return code, found


def _simulated(file: SceneFile, model: Model, progress: bool) -> tuple[Run, int]:
    """The run and the exit code: a failed or interrupted one is partial."""
    from dataclasses import replace

    import solvers
    from fembeam.run import Run

    study = file.studies["simulate"]
    try:
        run = model.simulate(study.duration, study.dt, solver=study.solver, progress=progress)
        code = 0 if run.complete else _interrupted()
    except solvers.SolverError as error:
        _say(f"error: {_one_line(error)}")
        run, code = Run.of(model.lasting(study.duration), error.solution), FAILED
    return replace(run, source=file.source), code


def _read(arguments: argparse.Namespace) -> SceneFile:
    """The scene file with its overrides."""
    from fembeam import scene_file

    return scene_file.read(arguments.scene, arguments.set)


def _wanted(file: SceneFile, modes: int | None) -> dict[str, Any]:
    """The arguments of [reduce], with another number of modes if one is given."""
    return (
        dict(file.reduce) if modes is None else {**file.reduce, "modes": modes, "omega_max": None, "mass_share": None}
    )


def _reduced(file: SceneFile, **arguments: Any) -> Model:
    """The reduced model; what is wrong is said with the file."""
    try:
        return file.scene.reduce(**arguments)
    except (ValueError, TypeError, RuntimeError) as error:  # RuntimeError: modes that cannot be computed
        raise ValueError(f"{file.source.place('[reduce]', str(error))}: {error}") from error


def _unwritten(error: OSError) -> int:
    """Say that results could not be written."""
    _say(f"error: results cannot be written: {_one_line(error)}; files that were written are whole")
    return FAILED


def _interrupted() -> int:
    """The exit code shells expect after a signal."""
    import signal

    from fembeam import interrupts

    return TERMINATED if interrupts.heard() == signal.SIGTERM else INTERRUPTED


def _print(found: Any, as_json: bool) -> None:
    """On stdout."""
    from fembeam.report import json_text

    print(json_text(found) if as_json else found)


def _say(message: str) -> None:
    """One line on stderr."""
    print(f"fembeam: {message}", file=sys.stderr)


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    """A warning as one line."""
    _warned.append(_one_line(message))
    _say(f"warning: {_warned[-1]}")


def _one_line(message: object) -> str:
    """A message without line breaks."""
    return " ".join(str(message).split())


if __name__ == "__main__":
    sys.exit(main())
