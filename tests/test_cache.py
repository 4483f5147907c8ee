"""Machine code is that of the sources, wherever it can be kept: a small package, changed on disk."""

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import contacts.kernels as laws
import solvers.compiled.cache as cache
import solvers.compiled.decorators as decorators

CALL = "import solvers.outer as o; print(o.outer(1.0), sum(o.outer.stats.cache_hits.values()))"
INNER = "from solvers.compiled.decorators import inner\n@inner\ndef times(x): return {} * x\n"
OUTER = INNER.replace("inner", "kernel").replace("def times(x): return {} * x", "def outer(x): return times(x)")
OUTER = "from solvers.inner import times\n" + OUTER


@pytest.fixture
def package(tmp_path):
    """A package with our decorators and two functions in two files, one calling the other."""
    home = tmp_path / "solvers"
    home.mkdir()
    (home / "compiled").mkdir()
    for name in ("cache.py", "decorators.py"):
        shutil.copy(cache.HOME / "compiled" / name, home / "compiled")
    for folder in (home, home / "compiled"):
        (folder / "__init__.py").touch()
    (home / "inner.py").write_text(INNER.format(2.0))
    (home / "outer.py").write_text(OUTER)
    return home


def ran(code, folder, **environment):
    """What a process of its own says, and its warnings."""
    ours = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_CACHE")}
    variables = {**ours, "PYTHONPATH": str(folder), **environment}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=folder, env=variables, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split(), done.stderr


def test_a_changed_inner_function_is_compiled_anew_and_the_old_one_found_again(package):
    assert ran(CALL, package.parent) == (["2.0", "0"], "")
    (package / "inner.py").write_text(INNER.format(3.0))
    assert ran(CALL, package.parent)[0] == ["3.0", "0"]
    (package / "inner.py").write_text(INNER.format(2.0))
    assert ran(CALL, package.parent)[0] == ["2.0", "1"]


def test_compiling_is_told_in_one_line_and_loading_is_not(package):
    entry = (
        "from numba import float64\nfrom solvers.compiled.decorators import entry\nfrom solvers.inner import times\n"
    )
    for name in ("one", "two"):
        made = f"@entry(float64(float64))\ndef {name}(x): return times(x)\n"
        (package / f"{name}.py").write_text(entry + made)
    said = ran("import solvers.one, solvers.two", package.parent)[1]
    assert said.count("\n") == 1
    assert "compiling" in said
    assert ran("import solvers.one, solvers.two", package.parent)[1] == ""


@pytest.mark.skipif(sys.platform == "win32", reason="no such locks")
def test_processes_compile_one_after_the_other(package):
    """Two at a time may give the files of two signatures one number, and the wrong code would be loaded ever after."""
    held = "import solvers.compiled.cache as c, time\nfile = c.lock_folder(print)\nprint(1, flush=True)\ninput()\n"
    entry = "from numba import float64\nfrom solvers.compiled.decorators import entry\n"
    (package / "one.py").write_text(entry + "@entry(float64(float64))\ndef one(x): return 2.0 * x\n")
    tell = "print(time.time(), flush=True)"
    environment = {**os.environ, "PYTHONPATH": str(package.parent), "NUMBA_CACHE_DIR": ""}
    pipes: Any = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    first, second = (
        subprocess.Popen([sys.executable, "-c", code + tell], cwd=package.parent, env=environment, **pipes)
        for code in (held, "import time; input(); import solvers.one; ")
    )
    with first, second:
        assert first.stdout.readline() == "1\n"  # it has the lock
        own = "import solvers.compiled.decorators; from numba import njit; print(njit(lambda x: x)(1.0))"
        assert ran(own, package.parent, NUMBA_CACHE_DIR="")[0] == ["1.0"]  # code of others does not wait
        second.stdin.write("\n")
        second.stdin.flush()
        time.sleep(2.0)
        end = first.communicate("\n")[0]
        assert float(second.communicate()[0]) > float(end)


def test_a_lock_taken_before_the_import_does_not_keep_other_processes_waiting(monkeypatch, tmp_path):
    """Another thread compiled when this module was imported: its lock is given back unasked."""
    monkeypatch.setattr(cache, "FOLDER", tmp_path)
    one = decorators._OneProcess()
    one.on_end(SimpleNamespace(kind="numba:compiler_lock"))
    with one.alone():
        assert (one._file is None) == (sys.platform == "win32")
    assert one._file is None


def test_what_changes_while_a_process_runs_is_not_kept(package):
    write = f"open({str(package / 'inner.py')!r}, 'w').write({INNER.format(30.0)!r})"
    change = f"import solvers.compiled.decorators; {write}; "
    assert ran(change + CALL, package.parent)[0] == ["30.0", "0"]
    (package / "inner.py").write_text(INNER.format(2.0))
    assert ran(CALL, package.parent)[0] == ["2.0", "0"]


def test_the_users_own_functions_keep_their_folder(package):
    (package.parent / "own.py").write_text("import numba\n@numba.njit(cache=True)\ndef own(x):\n    return x\n")
    ran("import solvers.compiled.decorators, own; own.own(1.0)", package.parent)
    assert list((package.parent / "__pycache__").glob("own.*.nbi"))


def test_a_folder_that_the_user_names_is_taken(package, tmp_path):
    ran(CALL, package.parent, NUMBA_CACHE_DIR=str(tmp_path / "named"))
    assert ran(CALL, package.parent, NUMBA_CACHE_DIR=str(tmp_path / "named")) == (["2.0", "1"], "")
    assert not list((package / "__pycache__").glob("fembeam*"))


def closed(package, tmp_path):
    """An environment without a place to write in but a temporary folder; files where folders should be stop anyone."""
    shutil.rmtree(package / "__pycache__", ignore_errors=True)
    (package / "__pycache__").touch()
    (tmp_path / "file").touch()
    (tmp_path / "temporary").mkdir()
    nowhere = str(tmp_path / "file" / "home")
    names = ("HOME", "XDG_CACHE_HOME", "LOCALAPPDATA")
    return {**dict.fromkeys(names, nowhere), "TMPDIR": str(tmp_path / "temporary")}


def test_a_read_only_installation_without_a_home_keeps_code_in_a_temporary_folder(package, tmp_path):
    environment = closed(package, tmp_path)
    for hits in ("0", "1"):
        said, warned = ran(CALL, package.parent, **environment)
        assert said == ["2.0", hits]
        assert warned.count("\n") == warned.count("set NUMBA_CACHE_DIR") == 1


@pytest.mark.skipif(os.name != "posix", reason="permissions")
def test_a_temporary_folder_that_others_can_write_to_is_not_used(package, tmp_path):
    environment = closed(package, tmp_path)
    others = tmp_path / "temporary" / f"{cache.PREFIX}of-{os.getuid()}"
    others.mkdir()
    others.chmod(0o777)
    said, warned = ran(CALL, package.parent, **environment)
    assert said == ["2.0", "0"]
    assert "every start compiles" in warned
    assert not list(others.iterdir())


def test_laws_are_compiled_where_nothing_can_be_written(package, tmp_path):
    environment = closed(package, tmp_path)
    shutil.copy(laws.__file__, package / "laws.py")
    assert ran("import solvers.laws as k; print(k.power.address > 0)", package.parent, **environment)[0] == ["True"]


@pytest.mark.parametrize("module", ["contacts.kernels", "solvers.compiled.decorators"])
def test_without_machine_code_one_sentence_is_said(module):
    code = f"try:\n    import {module}\nexcept RuntimeError as error:\n    print(error)"
    said, warned = ran(code, cache.HOME.parent, NUMBA_DISABLE_JIT="1")
    assert (said[:2], said[-2:], warned) == (["NUMBA_DISABLE_JIT", "is"], ["unset", "it"], "")


def test_only_old_folders_beyond_the_last_few_are_removed(tmp_path):
    now = time.time()
    folders = [tmp_path / f"{cache.PREFIX}{i:0{cache.DIGITS}x}" for i in range(cache.KEPT + 4)]
    bystander = tmp_path / f"{cache.PREFIX}results"
    for i, folder in enumerate([*folders, bystander]):
        folder.mkdir()
        os.utime(folder, (now, now - i * cache.UNUSED / (cache.KEPT + 2)))
    cache._remove_unused(tmp_path, folders[-1])
    assert sorted(tmp_path.iterdir()) == sorted([*folders[: cache.KEPT + 2], folders[-1], bystander])


def test_a_digest_changes_with_every_source(tmp_path, monkeypatch):
    monkeypatch.setattr(cache, "HOME", tmp_path)
    (tmp_path / "a.py").write_text("1")
    (tmp_path / "b.py").write_text("")
    found = [cache._digest(list(cache._stamps()))]
    (tmp_path / "a.py").write_text("")
    (tmp_path / "b.py").write_text("1")
    found.append(cache._digest(list(cache._stamps())))
    Path(tmp_path / "b.py").rename(tmp_path / "c.py")
    found.append(cache._digest(list(cache._stamps())))
    assert len(set(found)) == 3
