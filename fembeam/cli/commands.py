"""The command line: `fembeam new`, `check`, `draw`, `modes`, `run`, `compare`, `export`, `schema`, `completion`.

Tables (with --json: JSON) go to stdout, everything else to stderr; exit codes are those of `messages`.
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fembeam import __version__  # nothing slow up here: Ctrl-C before `main` would print a traceback
from fembeam.cli.messages import (
    BAD_INPUT,
    EXIT_CODES,
    FAILED,
    interrupted,
    one_line,
    say,
    show_warning,
    warned,
    write_anywhere,
)

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

    from fembeam.model import Model
    from fembeam.scene_file import SceneFile

MODES_SHOWN = 10
REFUSED = ValueError, TypeError, OSError, ArithmeticError, MemoryError, RuntimeError, ImportError  # said in a line


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit code."""
    try:
        from fembeam.support import interrupts

        warned.clear()
        write_anywhere()
        with interrupts.handling():
            arguments = _parser().parse_args(argv)
            with warnings.catch_warnings():
                warnings.simplefilter("default", UserWarning)
                warnings.showwarning = show_warning
                code = int(arguments.command(arguments))
                sys.stdout.flush()
                return code
    except BrokenPipeError:  # the reader of a table has seen enough
        sys.stdout = None  # type: ignore[assignment]
        return FAILED
    except KeyboardInterrupt:
        say("interrupted; files that were written are whole")
        return interrupted()
    except Exception as error:
        return _failed(error)


def _failed(error: Exception) -> int:
    """Say what is wrong; a traceback is for faults of this library only."""
    from fembeam.support import interrupts

    if interrupts.received():  # a compiler that is stopped in the middle raises what it likes
        say("interrupted; files that were written are whole")
        return interrupted()
    if isinstance(error, OSError) and error.filename is None:  # a full disk behind stdout
        sys.stdout = None  # type: ignore[assignment]
    elif not isinstance(error, REFUSED):
        raise error
    say(f"error: {one_line(error)}")
    return FAILED if isinstance(error, RuntimeError) or sys.stdout is None else BAD_INPUT


def _parser() -> argparse.ArgumentParser:
    """Commands and options."""
    import argparse

    parser = argparse.ArgumentParser(
        prog="fembeam",
        description="Beams that meet stops: simulate a scene file. Tables go to stdout, messages to stderr.",
        epilog=EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"fembeam {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    new = _command(commands, "new", _new, "write an annotated scene file to begin with")
    new.add_argument("path", metavar="SCENE", type=Path)
    _scene_commands(commands)
    _results_commands(commands)
    _command(commands, "schema", _schema, "print the JSON Schema of scene files")
    complete = _command(commands, "completion", _completion, "print what a shell completes commands and options by")
    complete.add_argument("shell", choices=["bash", "zsh", "tcsh"])
    return parser


def _command(commands: Any, name: str, does: Any, about: str) -> argparse.ArgumentParser:
    """A command that takes no scene file."""
    made: argparse.ArgumentParser = commands.add_parser(name, help=about, description=about)
    made.set_defaults(command=does)
    return made


def _scene_commands(commands: Any) -> None:
    """Commands that read a scene file."""
    check = _command(commands, "check", _check,
                     "tell what a scene is: modes, contacts to expect, steps to take, doubtful units")  # fmt: skip
    modes = _command(commands, "modes", _modes, "print natural frequencies, damping, participation")
    draw = _command(
        commands, "draw", _draw, "draw the rig: beams, supports, masses, stops with their gaps, loads, names"
    )
    about = "run the file's studies; write tables, figures, report.html and, for [simulate], run.npz"
    run = _command(commands, "run", _run, about)
    for each in (check, draw, modes, run):
        each.add_argument("scene", metavar="SCENE", type=Path, help="scene file, or a run.npz that came from one")
        each.add_argument("--set", metavar="KEY=VALUE", action="append", default=[], help="change one value, "
                          "such as simulate.duration=10 or stops[valve].gap=1e-3; may be repeated")  # fmt: skip
    draw.add_argument("--out", metavar="FILE", type=Path, help="PNG, SVG or PDF; default: the scene's name with .png, "
                      "in the present folder")  # fmt: skip
    for each in (check, modes, run):
        each.add_argument("--json", action="store_true", help="print JSON instead of tables")
    for each in (check, modes):
        each.add_argument("--modes", metavar="N", type=int, help=f"how many; default: [reduce], else {MODES_SHOWN}")
    run.add_argument("--out", metavar="DIR", type=Path, required=True, help="folder for the results")
    run.add_argument("--resume", action="store_true", help="go on in DIR: keep the studies that are finished for this "
                     "scene, go on with [ensemble] and [branch]; without it all is computed anew")  # fmt: skip
    run.add_argument("--quiet", action="store_true", help="no progress, no log")


def _results_commands(commands: Any) -> None:
    """Commands that read what `run` has written."""
    compare = _command(commands, "compare", _compare, "compare the results in two folders")
    compare.add_argument("folders", metavar="DIR", type=Path, nargs=2)
    compare.add_argument("--out", metavar="DIR", type=Path, help="folder for overlaid figures")
    compare.add_argument("--json", action="store_true", help="print JSON instead of a table")
    export = _command(commands, "export", _export, "write a saved run as CSV: histories and contacts")
    export.add_argument("run", metavar="RUN", type=Path, help="run.npz, or a run saved as HDF5")
    export.add_argument("--out", metavar="DIR", type=Path, required=True)
    export.add_argument("--stride", metavar="N", type=int, default=1, help="keep every N-th sample")
    export.add_argument("--places", metavar="Z", type=_place, nargs="+",
                        help="z in m, or as a scene file has it, '[\"C\", \"x\"]'; default: those in the scene file's "
                        "[simulate], else usual ones")  # fmt: skip
    export.add_argument("--quantities", metavar="NAME", nargs="+", help="such as displacement, stress, reactions, "
                        "'absolute acceleration'; an unknown one lists all; default: as for places")  # fmt: skip


def _place(text: str) -> Any:
    """A place as a scene file writes it; a name needs no quotes."""
    import tomllib

    from fembeam.support import tuples

    try:
        return tuples(tomllib.loads(f"x = {text}")["x"])
    except tomllib.TOMLDecodeError:
        return text


def _new(arguments: argparse.Namespace) -> int:
    """The command `new`."""
    from fembeam.scene_file import template

    if arguments.path.exists():
        raise ValueError(f"{arguments.path} exists: give another name, or delete it")
    if not arguments.path.parent.is_dir():
        raise ValueError(f"there is no folder {arguments.path.parent} for {arguments.path.name}; make it first")
    with arguments.path.open("x", encoding="utf-8") as file:  # x: what exists by now is kept
        file.write(template(arguments.path.name))
    say(f"wrote {arguments.path}; next: fembeam check {arguments.path}")
    return 0


def _schema(_: argparse.Namespace) -> int:
    """The command `schema`."""
    from fembeam.scene_file import json_schema

    _print(json_schema(), True)
    return 0


def _completion(arguments: argparse.Namespace) -> int:
    """The command `completion`, by shtab: it reads the parser once, where argcomplete starts Python at every key."""
    from solvers.problem import optional

    shtab, parser = optional("shtab", "shell completion"), _parser()
    (commands,) = (action.choices for action in parser._actions if action.metavar == "COMMAND")
    for action in (action for one in dict(commands or {}).values() for action in one._actions if action.type is Path):
        action.complete = shtab.DIRECTORY if action.metavar == "DIR" else shtab.FILE
    print(shtab.complete(parser, arguments.shell))
    return 0


def _check(arguments: argparse.Namespace) -> int:
    """The command `check`: what `Scene.check` finds, its sentences on stderr."""
    from dataclasses import replace

    from fembeam.inspection import check

    file = _read(arguments)
    model = _model(file, arguments.modes)
    for name, study in file.studies.items():
        if hasattr(study, "check_run"):
            _refused_in(file, name, study.check_run, model)
    found = check(model, **file.of_run)
    for doubt in found:
        show_warning(doubt)
    _print(found.plain() | {"warnings": warned} if arguments.json else replace(found, warnings=[]), arguments.json)
    return 0


def _refused_in(file: SceneFile, name: str, check_run: Any, model: Model) -> None:
    """What a study refuses before it runs, with its line in the file."""
    try:
        check_run(file, model)
    except ValueError as error:
        raise ValueError(file.placed(f"[{name}]", error)) from error


def _draw(arguments: argparse.Namespace) -> int:
    """The command `draw`."""
    from fembeam.results import files as report

    out = arguments.out or Path(f"{arguments.scene.stem}.png")
    say(f"wrote {report.write_figure(out, _read(arguments).scene.figure())}")
    return 0


def _modes(arguments: argparse.Namespace) -> int:
    """The command `modes`."""
    from fembeam.model.mode_table import mode_rows, mode_table

    file = _read(arguments)
    usual = None if {"modes", "omega_max", "mass_share"} & set(file.reduce) else MODES_SHOWN
    model = file.model(**_counted(usual)) if arguments.modes is None else _model(file, arguments.modes)
    _print(mode_rows(model) if arguments.json else mode_table(model), arguments.json)
    return 0


def _compare(arguments: argparse.Namespace) -> int:
    """The command `compare`."""
    from fembeam.results import compare

    found = compare.compare(*arguments.folders)
    _print(compare.plain(found) if arguments.json else compare.table(found, *arguments.folders), arguments.json)
    if arguments.out:
        written = compare.write_figures(arguments.folders[0], arguments.folders[1], arguments.out)
        say(f"wrote {', '.join(p.name for p in written) or 'no figure: only one folder has a run'} to {arguments.out}")
    return 0


def _export(arguments: argparse.Namespace) -> int:
    """The command `export`."""
    from fembeam.model import load
    from fembeam.results import files as report

    run = load(arguments.run)
    study = None if run.source is None else run.scene_file.studies.get("simulate")
    asked = {name: getattr(arguments, name) for name in ("places", "quantities") if getattr(arguments, name)}
    chosen = {**({} if study is None else study.outputs), **asked}
    written = run.to_csv(report.prepared(arguments.out), arguments.stride, **chosen)
    say(f"wrote {', '.join(path.name for path in written)} to {arguments.out}")
    return 0


def _run(arguments: argparse.Namespace) -> int:
    """The command `run`."""
    from fembeam.cli import run as cli_run
    from fembeam.results import files as report

    file = _read(arguments)
    job = cli_run.Job(file, report.prepared(arguments.out), arguments.resume, arguments.quiet, arguments.json)
    return cli_run.run(job)


def _read(arguments: argparse.Namespace) -> SceneFile:
    """The scene file with its overrides."""
    from fembeam import scene_file

    return scene_file.read(arguments.scene, arguments.set)


def _model(file: SceneFile, modes: int | None) -> Model:
    """The model with the modes that --modes asks for, which is named where that number is refused."""
    try:
        return file.model(**_counted(modes))
    except ValueError as error:
        refused = str(error.__cause__)
        if modes is None or not refused.startswith("modes"):
            raise
        raise ValueError(f"{file.path} with --modes {modes}: {refused}") from error


def _counted(modes: int | None) -> dict[str, Any]:
    """Arguments of [reduce] for a number of modes; none for what the file says."""
    return {} if modes is None else {"modes": modes, "omega_max": None, "mass_share": None}


def _print(found: Any, as_json: bool) -> None:
    """Print an answer, as JSON or as its text."""
    from fembeam.results.files import print_json

    if as_json:
        print_json(found)
    else:
        print(found)


if __name__ == "__main__":
    sys.exit(main())
