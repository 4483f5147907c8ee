"""Tests run in parallel: one worker per processor, machine code compiled before they start."""

import gc
import os
import subprocess
import sys
from pathlib import Path

import pytest

gc.set_threshold(50_000, 50)  # a worker holds a million objects, which every full search for garbage visits

REALISATION = int(os.environ.get("FEMBEAM_REALISATION", "0"))  # 0 is the test's own

_NAMES = "from solvers.compiled.kernels import *; from solvers.exponential.preparation import *; "
_NAMES += "from solvers.compiled.parts import CIRCLES, PLACES; from solvers.exponential.method import advance_of; "
_STEPPING = """
import solvers, solvers.exponential.linearised
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
KERNELS = [
    _STEPPING.replace("{runs}", "[(ball, constant)]"),
    _STEPPING.replace("{runs}", "[(disc, ())]"),
    f"{_NAMES} load_parts(PLANAR_PROBLEM, range(PLACES)); advance_of(True)",
    f"{_NAMES} load_parts(PROBLEM, range(CIRCLES.start)); advance_of(False)",
]  # each compiled by a process of its own


def pytest_xdist_auto_num_workers(config):
    """None for a single file: they would take longer to start than most files take to run."""
    return 0 if len(config.args) == 1 and Path(config.args[0].split("::")[0]).is_file() else None


def pytest_sessionstart(session):
    """Compile what takes long, each kernel once, where otherwise every worker would compile it."""
    if hasattr(session.config, "workerinput") or not session.config.getoption("numprocesses", None):
        return
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the processors are taken
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # else each of many processes would compile all modules
    running = [subprocess.Popen([sys.executable, "-c", code]) for code in KERNELS]
    if any([process.wait() for process in running]):
        pytest.exit("kernels do not compile", 1)


def pytest_collection_modifyitems(config, items):
    """Examples and pages, a third of all the time, run only when asked for: by a mark, or by a file or folder."""
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
