"""Tests run in parallel: one worker per processor, machine code compiled before they start."""

import gc
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

gc.set_threshold(50_000, 50)  # a worker holds a million objects, which every full search for garbage visits

REALISATION = int(os.environ.get("FEMBEAM_REALISATION", "0"))  # 0 is the test's own

_NAMES = "from solvers.compiled.kernels import *; from solvers.exponential.preparation import *; "
_NAMES += "from solvers.compiled.parts import CIRCLES, PLACES; from solvers.exponential.method import advance_of; "
_STEPPING = """
import solvers
from contacts import Hertz
zero, plane, law = [[0.0, 0.0], [0.0, 0.0]], [[1.0, 0.0], [0.0, 1.0]], Hertz(1e6)
ball = solvers.Contact([1.0, 0.0], law)
disc = solvers.Contact(plane, law, 1e-4, map="annulus")
constant = solvers.Newmark(1e-4), solvers.RK4(1e-4), solvers.HenonRK2(1e-4, 1e-4)
for contact, methods in {runs}:
    system = solvers.System(plane, zero, zero, [contact])
    for method in (solvers.DormandPrince(), *methods):
        solvers.integrate(system, [0.0, 0.0], [-0.5, 0.0], 1e-3, method=method)
"""
KERNELS = [  # each compiled by a process of its own, in this order, so that two processors end at the same time
    _STEPPING.replace("{runs}", "[(disc, ())]"),  # 58 s
    f"{_NAMES} load_parts(PLANAR_PROBLEM, range(PLACES)); advance_of(True)",  # 70 s
    "import solvers.exponential.linearised\n" + _STEPPING.replace("{runs}", "[(ball, constant)]"),  # 25 s and 36 s
    f"{_NAMES} load_parts(PROBLEM, range(CIRCLES.start)); advance_of(False)",  # 48 s
]


def pytest_xdist_auto_num_workers(config):
    """None for a single file: they would take longer to start than most files take to run."""
    return 0 if len(config.args) == 1 and Path(config.args[0].split("::")[0]).is_file() else None


def pytest_sessionstart(session):
    """Compile what takes long, each kernel once, where otherwise every worker would compile it."""
    workers = session.config.getoption("numprocesses", None)
    if hasattr(session.config, "workerinput") or not workers:
        return
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the processors are taken
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # else each of many processes would compile all modules
    with ThreadPoolExecutor(workers) as pool:
        ended = [pool.submit(subprocess.call, [sys.executable, "-c", code]) for code in KERNELS]
    if any(one.result() for one in ended):
        pytest.exit("kernels do not compile", 1)


def pytest_collection_modifyitems(config, items):
    """Examples and pages, a third of all the time, run only when asked for: by a mark, or by a file or folder.

    What another rounding or seed changes may warn by chance, of few contacts for instance; nothing else may.
    """
    for item in items:
        if item.get_closest_marker("chaotic") or item.get_closest_marker("drawn"):
            item.add_marker(pytest.mark.filterwarnings("default::UserWarning"), append=False)
    if config.option.markexpr or config.args_source != pytest.Config.ArgsSource.TESTPATHS:
        return
    examples = [item for item in items if item.get_closest_marker("example")]
    config.hook.pytest_deselected(items=examples)
    items[:] = [item for item in items if not item.get_closest_marker("example")]


def pytest_collection_finish(session):
    """What is loaded by now stays: no search for garbage visits it."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session", autouse=True)
def dots():
    """Figures of result folders are saved as dots: to draw takes most of the time of what writes. The plain method."""
    from matplotlib.figure import Figure

    plain = Figure.savefig

    def save(figure, place, **options):  # with metadata: from `write_figure`
        plain(Figure((0.1, 0.1)) if "metadata" in options else figure, place, **options)

    Figure.savefig = save
    yield plain
    Figure.savefig = plain


@pytest.fixture
def file_of(tmp_path):
    """Reads the scene file that has a text; entries such as ``stops[0].gap=1`` may follow, in place of those there."""
    from fembeam import scene_file

    def read(text, *overrides):
        path = tmp_path / "scene.toml"
        path.write_text(text, encoding="utf-8")
        return scene_file.read(path, overrides)

    return read


@pytest.fixture
def whole_figures(dots, monkeypatch):
    """Figures are saved as they are."""
    from matplotlib.figure import Figure

    monkeypatch.setattr(Figure, "savefig", dots)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    """What must hold for any realisation is given another one, if the environment asks for it."""
    if not REALISATION or not (item.get_closest_marker("chaotic") or item.get_closest_marker("drawn")):
        return (yield)
    from realisation import taken

    with taken(REALISATION):
        return (yield)
