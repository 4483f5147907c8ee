"""Who may import whom, and what a plain `import fembeam` loads."""

import ast
import importlib.util
import os
import subprocess
import sys
import tomllib
from functools import cache
from pathlib import Path

import pytest

HOME = Path(importlib.util.find_spec("fembeam").origin).parent.parent  # a checkout, or where a wheel went
OURS = {"contacts", "reduction", "solvers", "fembeam"}
BASIC = {"numpy", "scipy"}
COMPILED = BASIC | {"numba", "llvmlite"}  # llvmlite is numba's own back end
MAY = {
    "contacts": COMPILED,
    "reduction": BASIC,
    "solvers": COMPILED,
    "fembeam": BASIC | {"contacts", "reduction", "solvers", "skfem", "meshio", "matplotlib", "tqdm"},
}
FILES = [path for package in sorted(OURS) for path in sorted((HOME / package).rglob("*.py"))]
assert FILES


@cache
def tree_of(path):
    """A file as the syntax tree that several tests walk."""
    return ast.parse(path.read_text(encoding="utf-8"))


def imported(path):
    """Top-level names of everything a file imports, wherever in it."""
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield path.relative_to(HOME).parts[0] if node.level else node.module.split(".")[0]


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(HOME)))
def test_arrows(path):
    package = path.relative_to(HOME).parts[0]
    foreign = set(imported(path)) - set(sys.stdlib_module_names) - {package}
    assert foreign <= MAY[package]


DOORS = {  # methods that open what is above
    ("fembeam.scene", "fembeam.model"),
    ("fembeam.scene", "fembeam.plot"),
    ("fembeam.scene", "fembeam.inspection"),
    ("fembeam.scene", "fembeam.study"),
    ("fembeam.model", "fembeam.scene_file"),
}


def room_of(module):
    """The folder of a module, without the folders within a room."""
    parts = module.split(".")
    room = parts[:2] if (HOME / Path(*parts[:2])).is_dir() else parts[:1]
    return ".".join(room)


def modules_read(path):
    """Full names of our modules that a file imports, wherever in it but for type checking."""
    tree = tree_of(path)
    typing = {
        child
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
        for child in ast.walk(node)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Import) and node not in typing:
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node not in typing:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


@cache
def arrows():
    """Rooms, and those each reads; the four packages' own `__init__` and `__main__` only hand names on."""
    found = {}
    for path in FILES:
        parts = path.relative_to(HOME).with_suffix("").parts
        if len(parts) == 2 and parts[1] in ("__init__", "__main__"):
            continue
        mine = room_of(".".join(parts))
        read = {room_of(name) for name in modules_read(path) if name.split(".")[0] in OURS}
        found.setdefault(mine, set()).update(room for room in read - {mine} if (mine, room) not in DOORS)
    return found


def test_rooms_have_no_circle():
    left = arrows().copy()
    while free := [room for room, read in left.items() if not read & left.keys()]:
        for room in free:
            del left[room]
    assert not left


LONG = {"solvers/stepping/loop.py march"}  # the compiled loop of all methods with steps


def lines_of(function):
    """Lines of a function without its docstring."""
    first = function.body[0]
    said = ast.get_docstring(function) is not None
    return function.end_lineno - function.lineno + 1 - said * (first.end_lineno - first.lineno + 1)


def test_functions_stay_short():
    """At most 60 lines without the docstring; a compiled loop may be longer where it is named."""
    found = set()
    for path in FILES:
        inner = ast.walk(tree_of(path))
        functions = [node for node in inner if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))]
        found |= {f"{path.relative_to(HOME).as_posix()} {one.name}" for one in functions if lines_of(one) > 60}
    assert found == LONG


def python(code, cwd=None, **environment):
    command, variables = [sys.executable, "-c", code], {**os.environ, **environment}
    return subprocess.run(command, cwd=cwd, env=variables, capture_output=True, text=True, check=False)


def test_the_import_is_light():
    heavy = ["matplotlib", "skfem", "numba", "meshio"]
    done = python(f"import sys, fembeam; print([name for name in {heavy} if name in sys.modules])")
    assert done.stdout.strip() == "[]", done.stderr


def test_the_command_line_starts_light():
    # so that Ctrl-C is handled from the first moment on
    done = python("import sys, fembeam.cli; print([n for n in ('numpy', 'scipy', 'argparse') if n in sys.modules])")
    assert done.stdout.strip() == "[]", done.stderr


def test_every_public_name_exists():
    done = python("import fembeam as fb; [getattr(fb, name) for name in fb.__all__]")
    assert done.returncode == 0, done.stderr


def test_no_module_takes_the_place_of_a_name_made_later():
    import solvers

    assert not {path.stem for path in (HOME / "solvers").glob("*.py")} & set(solvers.__all__)


@pytest.mark.parametrize("name", ["contacts", "reduction", "solvers"])
def test_a_shadowed_package_is_named(tmp_path, name):
    (tmp_path / f"{name}.py").write_text("")
    paths = os.pathsep.join([str(tmp_path), str(HOME)])
    done = python("import fembeam", cwd=tmp_path, PYTHONPATH=paths)
    assert done.returncode == 1
    last = done.stderr.strip().splitlines()[-1]
    assert last.startswith(f"ImportError: fembeam needs its own package {name!r}")
    assert f"{name}.py" in last


def test_a_clone_is_installed_as_a_path():
    """Else a finder comes last of all, and to a script beside a clone its folder `fembeam` is an empty package."""
    settings = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))
    assert settings["tool"]["setuptools"]["package-dir"] == {"": "."}
