"""Mutated scene files: each is refused in one sentence or runs; nothing else may happen.

    python tests/bench/fuzz.py [count] [first seed] [commands]

A file is the example or the annotated template, with every optional table, after one to four mutations: numbers made
extreme, values of other types, keys misspelt, lines lost, doubled, swapped, characters changed, the file cut. What can
be read is reduced and simulated for a short time. A traceback is a failure, and so is taking longer than `PATIENCE`.
With the third argument 1, `fembeam check` and `fembeam run` are given the file instead: slower, but the whole way to
tables, figures and report.
"""

from __future__ import annotations

import re
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from functools import partial
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

import solvers
from fembeam.cli import commands as cli
from fembeam.scene import Source
from fembeam.scene_file import SceneFile, SceneFileError, built, template

HOME = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(HOME / "tests" / "bench"))
ENOUGH, PATIENCE = 3.0, 30.0  # s of processor time, then Ctrl-C; after so many it has hung
PERIODS = 5.0  # of the lowest mode that are simulated
NUMBERS = [
    "0",
    "-1",
    "1",
    "2",
    "0.1",
    "1e-2",
    "1e3",
    "1e-8",
    "1e8",
    "1e300",
    "-1e300",
    "100000000000",
    "7",
    "1e-300",
    "1e5",
    "1e-5",
    "1e12",
    "nan",
    "inf",
    "-inf",
    "1" + 40 * "0",
]
OTHERS = [
    "true",
    '"text"',
    "[]",
    "{}",
    "[1, 2]",
    "[[1]]",
    '""',
    "1979-05-27",
    "[nan, 1]",
    "{ kind = 1 }",
    '["a"]',
    "1_0",
]
STUDIES = """
[mode_count]
counts = [1, 2, 3]
quantity = "peak_force"
duration = 0.2
seeds = 3
[smallest_model]
quantity = { kind = "amplitude", stop = 0 }
tolerance = 0.1
duration = 0.2
dt = 1e-3
seeds = 3
[speed_accuracy]
modes = [1, 2]
[ensemble]
realisations = 3
duration = 16
dt = 2e-3
"""

interrupted: list[bool] = []  # whether the present file was


class HangError(BaseException):
    """A file took too long."""


def seeds() -> list[str]:
    """The files that are mutated."""
    example = (HOME / "examples" / "beam_stop.toml").read_text(encoding="utf-8")
    full = re.sub(r"^# (?=\[\[|(?!solver)\w+ = )", "", template().split("# [mode")[0], flags=re.MULTILINE)
    texts = [example, template(), full, example + STUDIES]
    for text in texts:
        built(Source(Path("scene.toml"), text))
    return texts


def mutated(rng: np.random.Generator, texts: list[str]) -> str:
    """One file."""
    text = texts[rng.integers(len(texts))]
    only_numbers = rng.random() < 0.6  # else few come past the reader
    for _ in range(rng.integers(1, 5)):
        text = mutation(rng, text, 0 if only_numbers else int(rng.integers(8)))
    return text


def mutation(rng: np.random.Generator, text: str, kind: int) -> str:
    """One change."""
    values = list(re.finditer(r"(?<== )(?:\[[^\]\n]*\]|\"[^\"\n]*\"|[-\w.+]+)", text))
    keys = list(re.finditer(r"\b[a-z_]{2,}(?= =|\])", text))
    lines = text.split("\n")
    i, j = rng.integers(len(lines), size=2)
    if kind <= 2 and values:
        pool = NUMBERS if kind < 2 else OTHERS
        return put(text, values[rng.integers(len(values))], pool[rng.integers(len(pool))])
    if kind == 3 and len(values) > 1:
        one, other = rng.integers(len(values), size=2)
        return put(text, values[one], values[other][0])
    if kind == 4 and keys:
        one, other = rng.integers(len(keys), size=2)
        return put(text, keys[one], keys[other][0])
    if kind == 5:
        lines[i], lines[j] = lines[j], lines[i]
        return "\n".join(lines)
    if kind == 6:
        return "\n".join(lines[:i] + lines[i + (rng.random() < 0.5) :] + lines[i : i + 3] * (rng.random() < 0.5))
    place = rng.integers(len(text) + 1)
    if rng.random() < 0.1:
        return text[:place]
    return text[:place] + chr(rng.integers(1, 400)) * (rng.random() < 0.7) + text[place + 1 :]


def put(text: str, found: re.Match[str], new: str) -> str:
    """The text with one match replaced."""
    return text[: found.start()] + new + text[found.end() :]


def verdict(text: str) -> str:
    """What became of a file: "refused", "ran", "stopped" by a `SolverError`; anything else raises."""
    try:
        file = built(Source(Path("scene.toml"), text))
        return ran(file)
    except SceneFileError as error:
        return one_sentence(error, "refused")


def commanded(text: str, alarm: bool = True) -> str:
    """What `fembeam check` and `fembeam run` make of a file: their exit codes; with ``alarm`` each may take so long."""
    from faults import broken

    codes = []
    with tempfile.TemporaryDirectory() as folder:
        scene, out = Path(folder, "scene.toml"), Path(folder, "out")
        scene.write_text(text, encoding="utf-8", newline="")
        for command in (["check", str(scene)], ["run", str(scene), "--out", str(out), "--quiet"]):
            if alarm:
                start_alarm()
            with redirect_stdout(StringIO()), redirect_stderr(StringIO()) as said:
                codes.append(cli.main(command))
            lines = [line for line in said.getvalue().splitlines() if line]
            odd = [line for line in lines if not line.startswith("fembeam: ")]
            if odd or codes[-1] not in (0, 1, 2, 130) or (codes[-1] in (1, 2) and not lines):
                raise AssertionError(f"{command[0]} exits with {codes[-1]} and says {odd or lines}")
        faults = broken(out, killed=False)
        if faults:
            raise AssertionError(f"files are broken: {faults}")
    return f"check {codes[0]}, run {codes[1]}"


def ran(file: SceneFile) -> str:
    """A file that can be read, reduced and run for a short time."""
    try:
        model = file.scene.reduce(**file.reduce)
    except (ValueError, TypeError, RuntimeError) as error:
        return one_sentence(error, "refused by reduction")
    moving = model.omega[model.omega > 1e-6 * model.omega.max()]
    longest = PERIODS * 2 * np.pi / float(moving.min()) if len(moving) else 1.0
    study: Any = file.studies.get("simulate")
    duration = min(longest, study.duration) if study else longest
    try:
        run = model.simulate(duration, solver=study.solver if study else solvers.Exponential(1e-6, ledger=False))
    except (ValueError, ArithmeticError, MemoryError) as error:
        return one_sentence(error, "refused before the run")
    except solvers.SolverError as error:
        return one_sentence(error, "stopped with a reason")
    if not (np.isfinite(run.q).all() and np.isfinite(run.q_dot).all()):
        raise AssertionError("NaN passed for a result")
    return "ran" if run.complete else "long, interrupted"


def one_sentence(error: Exception, kind: str) -> str:
    """The kind; an error that says nothing is a failure."""
    if len(str(error)) < 8:
        raise AssertionError(f"an error must say what is wrong, got {error!r}")
    return kind


def start_alarm() -> None:
    """Ctrl-C after a while, and the end after a long one."""
    signal.signal(signal.SIGPROF, too_long)
    signal.setitimer(signal.ITIMER_PROF, ENOUGH, PATIENCE - ENOUGH)


def too_long(*_: Any) -> None:
    """The first alarm is Ctrl-C, the second one the end."""
    signal.signal(signal.SIGPROF, hung)
    interrupted.append(True)
    signal.raise_signal(signal.SIGINT)


def hung(*_: Any) -> None:
    """Ctrl-C was not heard."""
    raise HangError


def tried(text: str, judge: Callable[[str], str] = verdict) -> tuple[str, str]:
    """(verdict, traceback)."""
    interrupted.clear()
    start_alarm()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return judge(text), ""
    except KeyboardInterrupt:
        return "interrupted before the run", ""
    except HangError:
        return "TOOK TOO LONG", traceback.format_exc()
    except Exception as error:
        if interrupted:  # a compiler that Ctrl-C stops in the middle raises what it likes
            return "interrupted before the run", ""
        return f"FAILED: {type(error).__name__}", traceback.format_exc()
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


def main(count: int = 10_000, first: int = 0, commands: int = 0) -> int:
    """Try that many; exit code 1 when one failed."""
    judge, compiles = (commanded, partial(commanded, alarm=False)) if commands else (verdict, verdict)
    texts, found, slowest = seeds(), Counter(), (0.0, 0)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it
    for text in texts:  # compiles, without an alarm
        compiles(text)
    for seed in range(first, first + count):
        text, started = mutated(np.random.default_rng(seed), texts), time.perf_counter()
        what, trace = tried(text, judge)
        slowest = max(slowest, (time.perf_counter() - started, seed))
        found[what] += 1
        if trace:
            print(f"seed {seed}: {what}\n" + "\n".join(trace.splitlines()[-7:]), flush=True)
    print(f"{count} files: " + ", ".join(f"{n} {what}" for what, n in found.most_common()))
    print(f"slowest: {slowest[0]:.1f} s (seed {slowest[1]})")
    return int(any(what.isupper() or what.startswith("FAILED") for what in found))


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
