"""Do tests and examples hold for any realisation? Each under many, with the margin of every statement.

    python tests/bench/realisations.py 100 [TARGET ...] [--any] [--jobs 2] [--below 6] [--out realisations.jsonl]

A target is an example, a file of tests or one test; without any, all examples and all tests marked `chaotic` or `drawn`
(--any: of files of tests all tests). Realisations 1 to 100 have other seeds and starts a rounding away, see
`tests/realisation.py`; each target runs in a process of its own, examples with --quick where they know it. What they do
not change, such as periodic motion, is tried five times: a target is settled where all margins of five realisations are
above 1000 of their deviations. Rows go to the file --out, and what it holds is not computed again.

A statement is a comparison in an assert: a < b has the margin b - a, of arrays the smallest. Printed is how often each
target holds, and the statements whose mean margin is below 6 of its standard deviations. Margins are no Gaussians: one
of 4 deviations, which then fails once in 30 000, asks for a look; 5 in 100 realisations is what is wanted. Where an
interval of 99.99 % holds a known value, the margin is 4 to 5 by itself.
"""

import argparse
import ast
import builtins
import contextlib
import functools
import io
import json
import multiprocessing
import operator
import os
import re
import signal
import sys
import tempfile
import traceback
import types
from collections import defaultdict
from importlib.machinery import FileFinder, SourceFileLoader
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

TESTS = Path(__file__).parents[1]
EXAMPLES = TESTS.parent / "examples"
COMPARED = {"Lt": operator.lt, "LtE": operator.le, "Gt": operator.gt, "GtE": operator.ge, "Eq": operator.eq}
MARK = re.compile(r"pytest\.mark\.(chaotic|drawn)")
LONGEST = 1800  # s, of one target in one realisation
FEW, SETTLED = 5, 1e3  # realisations, and deviations of all margins above which no more are computed

test, statements = "", []  # under way: the test that runs; [test, where, text, margin] of what was asserted


# --- margins ---------------------------------------------------------------------------------------------------------


def margin(kind, left, right):
    """By how much a comparison holds, of arrays the least; None where it is none of numbers."""
    try:
        if kind == "Eq":  # of pytest.approx of a number
            return float(right.tolerance - abs(left - right.expected)) if hasattr(right, "tolerance") else None
        gap = np.asarray(right, dtype=float) - np.asarray(left, dtype=float)
    except (TypeError, ValueError):
        return None
    return float(np.min(gap if kind in ("Lt", "LtE") else -gap)) if gap.size else None


def asked_from(frame):
    """File and line of the test or script that has come to an assert, be it in a function that many call."""
    path, line = frame.f_code.co_filename, frame.f_lineno
    while (frame := frame.f_back) and frame.f_code.co_filename == path:
        line = frame.f_lineno
    return f"{Path(path).name}:{line}"


def statement(text, kinds, *values):
    """The value of a chain of comparisons, its margins noted."""
    where, result = asked_from(sys._getframe(1)), True
    for kind, left, right in zip(kinds, values, values[1:], strict=False):
        found = margin(kind, left, right)
        if found is not None:
            statements.append([test, where, text, found])
        result = result and COMPARED[kind](left, right)
    return result


class Watched(ast.NodeTransformer):
    """Comparisons in asserts become calls of `statement`."""

    inside = False

    def visit_Assert(self, node):
        self.inside = True
        node.test = self.visit(node.test)
        self.inside = False
        return node

    def visit_Compare(self, node):
        kinds = tuple(type(kind).__name__ for kind in node.ops)
        if not self.inside or not all(kind in COMPARED for kind in kinds):
            return node
        known = [ast.Constant(ast.unparse(node)), ast.Constant(kinds)]
        call = ast.Call(ast.Name("__statement__", ast.Load()), [*known, node.left, *node.comparators], [])
        return ast.copy_location(call, node)


def compiled(path):
    """The code of a file, its asserts watched."""
    tree = Watched().visit(ast.parse(Path(path).read_text(encoding="utf-8")))
    return compile(ast.fix_missing_locations(tree), str(path), "exec", dont_inherit=True)


class WatchedFile(SourceFileLoader):
    """Imports a module, its asserts watched."""

    def get_code(self, name):
        return compiled(self.path)


def watch_tests():
    """From now on modules in `tests` are imported that way."""

    def finder(folder):
        if Path(folder) != TESTS:
            raise ImportError("another folder")
        return FileFinder(folder, (WatchedFile, [".py"]))

    builtins.__statement__ = statement
    sys.path_hooks.insert(0, finder)
    sys.path_importer_cache.clear()


# --- one target in one realisation -----------------------------------------------------------------------------------


class Follow:
    """A plugin of pytest: which test runs, which failed."""

    def __init__(self):
        self.ran, self.failed = [], {}

    def pytest_runtest_logstart(self, nodeid):
        global test
        test = nodeid.split("/")[-1]
        self.ran.append(test)

    def pytest_runtest_logreport(self, report):
        if report.failed:
            self.failed[test] = str(report.longrepr)[-1500:]


class MarkAll:
    """A plugin of pytest: every test is shown another realisation."""

    def pytest_collection_modifyitems(self, items):
        for item in items:
            item.add_marker(pytest.mark.drawn)


def run_tests(target, number, everything):
    """Names of the tests that ran, and what those that failed say."""
    os.environ["FEMBEAM_REALISATION"], follow = str(number), Follow()
    chosen = [] if everything else ["-m", "chaotic or drawn"]
    plain = ["-n0", "-q", "--assert=plain", "-p", "no:cacheprovider", f"--rootdir={TESTS.parent}"]
    pytest.main([*plain, *chosen, target], plugins=[follow, *([MarkAll()] if everything else [])])
    return follow.ran, follow.failed


def run_example(path, number):
    """The same of an example, which has no name in itself."""
    from matplotlib.figure import Figure
    from realisation import taken

    main = types.ModuleType("__main__")
    main.__file__, sys.modules["__main__"] = path, main
    sys.argv = [path] + ["--quick"] * ("--quick" in Path(path).read_text(encoding="utf-8"))
    try:
        with taken(number), patch.object(Figure, "savefig"):  # nothing is asserted of what is drawn
            exec(compiled(path), main.__dict__)
    except Exception as error:
        return [""], {"": f"{type(error).__name__}: {error}"}
    return [""], {}


def tried(target, number, everything):
    """A row of the file."""
    multiprocessing.set_start_method("fork")  # so that pools know the realisation
    os.environ.update(MPLBACKEND="Agg", OPENBLAS_NUM_THREADS="1")
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        os.chdir(folder)
        if Path(target).parent == EXAMPLES:
            ran, failed = run_example(target, number)
        else:
            ran, failed = run_tests(target, number, everything)
        os.chdir(TESTS)
    row = {"target": Path(target).name, "number": number, "ran": ran, "failed": failed}
    return row | {"seconds": sum(os.times()[:4]), "statements": statements}


def compute(tasks, options):
    """Every task in a process of its own, some at once."""
    running = 0
    for target, number in tasks:
        if running >= options.jobs:
            os.wait()
            running -= 1
        if number > FEW and is_settled(Path(target).name, options.out):
            continue
        running += 1
        if os.fork() == 0:
            signal.alarm(LONGEST)
            try:
                line = json.dumps(tried(target, number, options.any), ensure_ascii=False) + "\n"
                with open(options.out, "a", encoding="utf-8") as file:
                    file.write(line)
            except BaseException:
                traceback.print_exc()
            os._exit(0)
    with contextlib.suppress(ChildProcessError):
        while True:
            os.wait()


# --- the table -------------------------------------------------------------------------------------------------------


def rows_of(path):
    """What a file holds."""
    if not os.path.exists(path):
        return []
    with open(path, encoding="utf-8") as file:
        return [json.loads(line) for line in file]


def margins_of(rows):
    """Margins in all realisations, and the place, of every statement: by target, test, text, and how often passed."""
    margins, places = defaultdict(list), {}
    for row in rows:
        seen = defaultdict(int)
        for name, where, text, gap in row["statements"]:
            seen[name, text] += 1  # a line may be passed many times, always in this order
            key = row["target"], name, text, seen[name, text]
            margins[key].append(gap)
            places[key] = where
    return margins, places


def ratio_of(margins):
    """The mean margin in standard deviations."""
    deviation = np.std(margins, ddof=1) if len(margins) > 1 else 0.0
    return np.mean(margins) / deviation if deviation else np.inf


@functools.cache
def is_settled(target, path):
    """Whether the first realisations of a target all held, with margins that other realisations do not change."""
    first = [row for row in rows_of(path) if row["target"] == target and row["number"] <= FEW]
    found = margins_of(first)[0].values()
    held = len(first) == FEW and not any(row["failed"] for row in first)
    return held and bool(found) and all(ratio_of(margins) > SETTLED for margins in found)


def print_shares(rows):
    """How often every target held, and the seconds of processor it took."""
    held, seconds = defaultdict(list), defaultdict(list)
    for row in rows:
        seconds[row["target"]].append(row["seconds"])
        for name in row["ran"]:
            held[row["target"], name].append(name not in row["failed"])
    print("share that holds")
    for (target, name), found in sorted(held.items()):
        print(f"  {name or target:80} {sum(found)} of {len(found)}   ({np.median(seconds[target]):.1f} s)")


def print_margins(rows, below):
    """Statements whose margin is small against its scatter, the smallest first."""
    margins, places = margins_of(rows)
    thinnest = {}
    for key, found in margins.items():
        mean, deviation, least = np.mean(found), np.std(found, ddof=1) if len(found) > 1 else 0.0, min(found)
        ratio = ratio_of(found)
        if least < 0 or ratio < below:
            text = f"{places[key]} {key[1].split('::')[-1]} {key[2]}"
            line = ratio, f"{mean:11.3g} {deviation:11.3g} {least:11.3g} {len(found):5}  {text}"
            thinnest[text] = min(line, thinnest.get(text, line))
    print(f"\nmargins below {below:g} of their deviations\n  in these        mean   deviation    smallest    of")
    for ratio, text in sorted(thinnest.values()):
        print(f"  {ratio:8.1f} {text}")


def main():
    """Compute what is missing and print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("count", type=int)
    parser.add_argument("targets", nargs="*")
    parser.add_argument("--any", action="store_true")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--below", type=float, default=6.0)
    parser.add_argument("--out", default="realisations.jsonl")
    options = parser.parse_intermixed_args()
    options.out = os.path.abspath(options.out)
    others = [path for path in TESTS.glob("test_*.py") if path.name != "test_examples.py"]  # which runs the examples
    marked = [path for path in others if MARK.search(path.read_text(encoding="utf-8"))]
    targets = [os.path.abspath(one) for one in options.targets or sorted([*EXAMPLES.glob("*.py"), *marked])]
    sys.path[:0] = [str(TESTS), str(TESTS.parent)]
    import conftest

    for kernels in [*conftest.KERNELS, "import matplotlib.pyplot, scipy.stats, skfem, fembeam.study"]:
        exec(kernels, {})  # once for all processes
    watch_tests()
    known, names = {(row["target"], row["number"]) for row in rows_of(options.out)}, {Path(one).name for one in targets}
    wanted = [(one, number) for number in range(1, options.count + 1) for one in targets]
    compute([(one, number) for one, number in wanted if (Path(one).name, number) not in known], options)
    rows = [row for row in rows_of(options.out) if row["target"] in names and row["number"] <= options.count]
    print_shares(rows)
    print_margins(rows, options.below)


if __name__ == "__main__":
    main()
