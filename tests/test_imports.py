"""Who may import whom and what of numba, how long a function is, and what a plain `import fembeam` loads."""

import ast
import importlib.util
import os
import re
import subprocess
import sys
import tomllib
from functools import cache
from pathlib import Path

import pytest

HOME = Path(importlib.util.find_spec("fembeam").origin).parent.parent  # a checkout, or where a wheel went
CLONE = Path(__file__).parents[1]
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
def nodes_of(path):
    """All nodes of a file's syntax tree, which several tests walk."""
    return tuple(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))


def imported(path):
    """Top-level names of everything a file imports, wherever in it."""
    for node in nodes_of(path):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield path.relative_to(HOME).parts[0] if node.level else node.module.split(".")[0]


@pytest.mark.parametrize("package", MAY)
def test_arrows(package):
    for path in (HOME / package).rglob("*.py"):
        foreign = set(imported(path)) - set(sys.stdlib_module_names) - {package}
        assert foreign <= MAY[package], path


DOORS = {  # methods that open what is above
    ("fembeam.scene", "fembeam.model"),
    ("fembeam.scene", "fembeam.plot"),
    ("fembeam.scene", "fembeam.inspection"),
    ("fembeam.scene", "fembeam.study"),
    ("fembeam.model", "fembeam.scene_file"),
    ("fembeam.model", "fembeam.plot"),
}


def room_of(module):
    """The folder of a module, without the folders within a room."""
    parts = module.split(".")
    room = parts[:2] if (HOME / Path(*parts[:2])).is_dir() else parts[:1]
    return ".".join(room)


def modules_read(path):
    """Full names of our modules that a file imports, wherever in it but for type checking."""
    nodes = nodes_of(path)
    typing = {
        child
        for node in nodes
        if isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING"
        for child in ast.walk(node)
    }
    for node in nodes:
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


def listed_imports():
    """By folder: those that CONTRIBUTING lets it import, directly or through others."""
    text = (CLONE / "CONTRIBUTING.md").read_text(encoding="utf-8")
    lines = re.findall(r"^((?:contacts|reduction|solvers|fembeam)[.\w]*) .*?(?:<- (.*))?$", text, re.M)
    found = {room: set() for room, _ in lines}
    for room, named in lines:
        for one in re.findall(r"\w+", named):
            beside = f"{room.split('.')[0]}.{one}"
            found[room].add(beside if beside in found else one)
    for _ in lines:
        found = {room: named.union(*(found[one] for one in named)) for room, named in found.items()}
    return found


def test_folders_import_what_is_listed():
    listed = listed_imports()
    for room, read in arrows().items():
        package = room.split(".")[0]
        names = {one if one.startswith(package) else one.split(".")[0] for one in read} - {"fembeam"}
        assert names <= listed[room], f"CONTRIBUTING does not list that {room} imports {names - listed[room]}"


def test_rooms_have_no_circle():
    left = arrows().copy()
    while free := [room for room, read in left.items() if not read & left.keys()]:
        for room in free:
            del left[room]
    assert not left


PRIVATE = "numba.core", "numba.np", "llvmlite"
USERS = {  # the files that stand on what numba does not promise, and why
    "solvers/compiled/decorators.py",  # options of njit, described there; when it compiles
    "solvers/compiled/shortcuts.py",  # what its compiler does more than once
    "solvers/compiled/cache.py",  # llvmlite's version; numba's cache
    "solvers/compiled/packed.py",  # a type of its own, and loads through a pointer
    "solvers/compiled/simd.py",  # a type of its own, and vector instructions
    "solvers/compiled/kernels.py",  # calls of C functions at an address
    "solvers/compiled/parts.py",  # the same
    "contacts/kernels.py",  # the same; numba's cache
    "contacts/sum_kernels.py",  # the same
    "contacts/memory/custom_kernels.py",  # parameters as a tuple
    "contacts/custom_kernels.py",  # parameters as a tuple; the compiler's errors; functions without wrappers
}
OPTION_NAMES = {"_nrt", "forceinline", "no_cpython_wrapper", "no_cfunc_wrapper", "inline"}


def leans_on(path):
    """What a file uses of numba that is not promised: modules imported, options of decorators."""
    for node in nodes_of(path):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        yield from (name for name in names if name.startswith(PRIVATE))
        if isinstance(node, ast.keyword) and node.arg in OPTION_NAMES:
            yield node.arg
        if isinstance(node, ast.Constant) and node.value in OPTION_NAMES - {"inline"}:
            yield node.value


def test_only_named_files_stand_on_what_numba_does_not_promise():
    found = {path.relative_to(HOME).as_posix(): {*leans_on(path)} for path in FILES}
    assert {name for name, used in found.items() if used} == USERS
    options = {name: used & OPTION_NAMES for name, used in found.items() if used & OPTION_NAMES}
    wrappers = {"no_cpython_wrapper", "no_cfunc_wrapper"}
    assert options == {"solvers/compiled/decorators.py": OPTION_NAMES, "contacts/custom_kernels.py": wrappers}


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
        functions = [node for node in nodes_of(path) if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))]
        found |= {f"{path.relative_to(HOME).as_posix()} {one.name}" for one in functions if lines_of(one) > 60}
    assert found == LONG


def python(code, cwd=None, **environment):
    command, variables = [sys.executable, "-c", code], {**os.environ, **environment}
    return subprocess.run(command, cwd=cwd, env=variables, capture_output=True, text=True, check=False)


def test_the_import_is_light():
    heavy = ["matplotlib", "skfem", "numba", "meshio"]
    modules = "fembeam, fembeam.scene.scene"
    done = python(f"import sys, {modules}; print([name for name in {heavy} if name in sys.modules])")
    assert done.stdout.strip() == "[]", done.stderr


def test_a_run_needs_no_optimisation():
    done = python("import sys, fembeam.model; print('scipy.optimize' in sys.modules)")
    assert done.stdout.strip() == "False", done.stderr


def test_the_command_line_starts_light():
    # so that Ctrl-C is handled from the first moment on
    done = python("import sys, fembeam.cli; print([n for n in ('numpy', 'scipy', 'argparse') if n in sys.modules])")
    assert done.stdout.strip() == "[]", done.stderr


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
    settings = tomllib.loads((CLONE / "pyproject.toml").read_text(encoding="utf-8"))
    assert settings["tool"]["setuptools"]["package-dir"] == {"": "."}
