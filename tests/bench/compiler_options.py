"""What each option of the compiler is worth: run times without it over those with it, by turns.

    nice -n 5 python tests/bench/compiler_options.py merged force nrt alias align parts tuples [--against TREE]

A copy of the packages with one option switched off and this tree each get a process of their own, compile for a
minute, one after the other, and then run the twelve starts of `reference` in turns, with 2, 10 and 30 modes, three
modes under noise, and 2 and 10 modes with 100 samples and their energy balance (``2s``, ``10s``). Printed are medians
over the starts of the ratios of shortest processor times, so that other work on the machine matters little, and whether
all ends are the same bit for bit. ``--against`` compares this tree with another one instead, ``--cases RK4:2 Newmark:10
--rounds 20`` by runs of other methods, name and modes. Without packed arguments (``tuples``) parts cannot be called at
addresses: compare with ``parts``.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

HOME = Path(__file__).resolve().parent.parent.parent
PACKAGES = "fembeam", "contacts", "reduction", "solvers"
CASES = ["2", "10", "30", "noise", "2s", "10s"]
ROUNDS = 200
SETTINGS = {"DormandPrince": {"rtol": 1e-8}, "HenonRK2": {"dt_flight": 2e-6, "dt_contact": 1e-6}}
_NO_PARTS = (
    ("parts.py", "import c_function", "import c_function, inner"),
    ("parts.py", "return _call_at(place, result, plain)", "return inner(function)"),
    ("parts.py", "for place in places:", "for place in ():"),
)
_MOSTLY_NOT_MERGED = """
ARRAYS = "pair_response", "force_of", "motion_of", "push_of", "slider_of", "turned_of"


def merged(function):  # an array can be returned by what is merged only
    return njit(**_INNER, inline="always" if function.__name__ in ARRAYS else "never")(function)
"""
OPTIONS = {  # file, what is there, what is there instead
    "merged": (("decorators.py", 'merged = njit(**_INNER, inline="always")', _MOSTLY_NOT_MERGED),),
    "force": (("decorators.py", "forceinline=True", "forceinline=False"),),
    "nrt": (("decorators.py", ', "_nrt": False', ""),),
    "alias": (("packed.py", '    loaded.set_metadata("tbaa", _constant(builder.module))\n', ""),),
    "align": (("packed.py", "if 1 < np.size(item) < _SLOW", "if False"),),
    "parts": _NO_PARTS,
    "tuples": (
        *_NO_PARTS,
        ("packed.py", "builder.inttoptr(arguments[0], ", "builder.load(builder.inttoptr(arguments[0], "),
        ("packed.py", "value_type(signature.return_type))", "value_type(kind).as_pointer()))"),
        ("packed.py", "return PackedType(kind)(", "return kind("),
    ),
}


def without(option: str, place: str) -> Path:
    """A copy of the packages without an option."""
    for package in PACKAGES:
        shutil.copytree(HOME / package, Path(place, package), ignore=shutil.ignore_patterns("__pycache__"))
    for name, there, instead in OPTIONS[option]:
        path = Path(place, "solvers", "compiled", name)
        text = path.read_text(encoding="utf-8")
        if there not in text:
            raise LookupError(f"{path.name} has no {there!r} any more: change OPTIONS")
        path.write_text(text.replace(there, instead), encoding="utf-8")
    return Path(place)


def runs_of(case: str) -> list[Callable[[], Any]]:
    """The runs of one case; each returns a number of its end."""
    import numpy as np
    import peers
    from reference import DURATION, problem

    import contacts
    import fembeam
    import solvers

    if ":" in case:
        name, modes = case.split(":")
        of = problem(int(modes))
        setting = SETTINGS.get(name, {"dt": 1e-5 if of.n < 10 else 1e-6})
        run = peers.constant_step(of, {"kind": getattr(solvers, name), **setting})
        return [lambda start=start: run(start)[0] for start in of.starts[:4]]
    if case.endswith("s"):
        of, dt = problem(int(case[:-1])), DURATION / 100
        starts = [np.split(z, 2) for z in of.starts[:12]]
        return [lambda start=start: solvers.integrate(of.system, *start, DURATION, dt).q[-1, 0] for start in starts]
    if case != "noise":
        of = problem(int(case))
        run = peers.exponential(of, {"rtol": 1e-8})
        return [lambda start=start: run(start)[0] for start in of.starts[:12]]
    stop = solvers.Contact([1.0, 0.5, 0.3], contacts.Hertz(1e8), 1e-4)
    load = [1.0, 0.7, 0.2], fembeam.BandNoise(50.0, (0.0, 300.0), seed=1)
    one, rest = solvers.System.modal([100.0, 900.0, 2500.0], 0.01, [stop], [load]), np.zeros(3)
    starts = [np.array([-0.3 + 0.01 * i, 0.1, 0.0]) for i in range(12)]
    return [lambda start=start: solvers.integrate(one, rest, start, 0.5).q[-1, 0] for start in starts]


def serve() -> None:
    """Time the runs of every case asked for on a line."""
    known: dict[str, list[Callable[[], Any]]] = {}
    for line in sys.stdin:
        case = line.strip()
        if case not in known:
            known[case] = runs_of(case)
        seconds, ends = [], []
        for run in known[case]:
            started = time.process_time()
            ends.append(float(run()))
            seconds.append(time.process_time() - started)
        print(json.dumps([seconds, ends]), flush=True)


class Worker:
    """A process that runs the code of one tree."""

    def __init__(self, tree: Path) -> None:
        self.tree = tree
        command = [sys.executable, __file__, "--serve"]
        paths = {**os.environ, "PYTHONPATH": str(tree)}
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=tree, env=paths
        )

    def ask(self, case: str) -> list[list[float]]:
        """Times and ends."""
        assert self.process.stdin
        assert self.process.stdout
        print(case, file=self.process.stdin, flush=True)
        answer = self.process.stdout.readline()
        if not answer:
            raise RuntimeError(f"the code of {self.tree} does not run: see the traceback above")
        found: list[list[float]] = json.loads(answer)
        return found


def compare(trees: list[Path], cases: list[str], rounds: int) -> str:
    """One line: of every case the time of the first tree over that of the second."""
    workers, cells = [Worker(tree) for tree in trees], []
    for case in cases:
        best, same = [[float("inf")] * 12 for _ in trees], True
        for turn in range(rounds + 1):
            order = (0, 1) if turn % 2 else (1, 0)
            found = [part for _, part in sorted((i, workers[i].ask(case)) for i in order)]
            if turn:  # the first is not warm
                best = [[*map(min, old, new[0])] for old, new in zip(best, found, strict=True)]
            same &= found[0][1] == found[1][1]
        ratio = statistics.median(a / b for a, b in zip(*best, strict=True))
        cells.append(f"{case}: {ratio:.3f}{'' if same else ' (other ends)'}")
    for worker in workers:
        worker.process.communicate()
    return "   ".join(cells)


def main() -> None:
    """Read the arguments; print a line per option."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("options", nargs="*", choices=[*OPTIONS, []])
    parser.add_argument("--against", type=Path)
    parser.add_argument("--cases", nargs="+", default=CASES)
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.serve:
        serve()
        return
    chosen = arguments.cases, arguments.rounds
    if arguments.against:
        print("this tree over the other  ", compare([HOME, arguments.against.resolve()], *chosen))
    for option in arguments.options:
        with tempfile.TemporaryDirectory() as place:
            print(f"without {option:8s}", compare([without(option, place), HOME], *chosen), flush=True)


if __name__ == "__main__":
    main()
