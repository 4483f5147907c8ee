"""Machine code is that of the sources, wherever it can be kept: a small package, changed on disk."""

import cmath
import math
import os
import pickle
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import every_method
import fresh_process
import numba
import numpy as np
import pytest
from numba import njit

import contacts.custom_kernels as own
import contacts.kernels as laws
import solvers.compiled.cache as cache
import solvers.compiled.decorators as decorators

CALL = "import solvers.outer as o; print(o.outer(1.0), sum(o.outer.stats.cache_hits.values()))"
INNER = "from solvers.compiled.decorators import inner\n@inner\ndef times(x): return {} * x\n"
# Sources that take the place of each other differ in length: Python looks at that, and at the second of their change.
OUTER = INNER.replace("inner", "kernel").replace("def times(x): return {} * x", "def outer(x): return times(x)")
OUTER = "from solvers.inner import times\n" + OUTER


@pytest.fixture
def package(tmp_path):
    """A package with our decorators and two functions in two files, one calling the other."""
    home = tmp_path / "solvers"
    home.mkdir()
    (home / "compiled").mkdir()
    for name in ("cache.py", "decorators.py", "shortcuts.py"):
        shutil.copy(cache.HOME / "compiled" / name, home / "compiled")
    for folder in (home, home / "compiled"):
        (folder / "__init__.py").touch()
    (home / "inner.py").write_text(INNER.format(2.0))
    (home / "outer.py").write_text(OUTER)
    return home


def ran(code, folder, **environment):
    """What a process of its own says, and its warnings."""
    ours = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_CACHE")}
    said, warned = fresh_process.run(code, folder, {**ours, "PYTHONPATH": str(folder), **environment})
    return said.split(), warned


def test_a_changed_inner_function_is_compiled_anew_and_the_old_one_found_again(package):
    assert ran(CALL, package.parent) == (["2.0", "0"], "")
    (package / "inner.py").write_text(INNER.format(30.0))
    assert ran(CALL, package.parent)[0] == ["30.0", "0"]
    (package / "inner.py").write_text(INNER.format(2.0))
    assert ran(CALL, package.parent)[0] == ["2.0", "1"]


def test_a_room_is_compiled_anew_when_it_or_the_ground_changes(package):
    """Not when another room does."""
    for room in ("one", "other"):
        (package / room).mkdir()
        (package / room / "inner.py").write_text(INNER.format(2.0))
    (package / "one" / "outer.py").write_text(OUTER.replace("solvers.inner", "solvers.one.inner"))
    call = CALL.replace("solvers.outer", "solvers.one.outer")
    assert ran(call, package.parent)[0] == ["2.0", "0"]
    (package / "other" / "inner.py").write_text(INNER.format(30.0))
    (package / "inner.py").write_text(INNER.format(30.0))
    assert ran(call, package.parent)[0] == ["2.0", "1"]
    (package / "compiled" / "new.py").touch()
    assert ran(call, package.parent)[0] == ["2.0", "0"]
    (package / "one" / "inner.py").write_text(INNER.format(30.0))
    assert ran(call, package.parent)[0] == ["30.0", "0"]


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
    """Who waited finds the code; other functions are compiled meanwhile."""
    name = f"solvers.one.one {numba.float64(numba.float64)}"
    held = f"import solvers.compiled.cache as c, time\nfile = c.lock_folder(print, c.lock_of({name!r}))\n"
    held += "print(1, flush=True)\ninput()\n"
    entry = "from numba import float64\nfrom solvers.compiled.decorators import entry\n"
    (package / "one.py").write_text(entry + "@entry(float64(float64))\ndef one(x): return 2.0 * x\n")
    tell = "print(time.time(), flush=True)"
    environment = {**os.environ, "PYTHONPATH": str(package.parent), "NUMBA_CACHE_DIR": ""}
    pipes: Any = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    first, second = (
        subprocess.Popen([sys.executable, "-c", code + tell], cwd=package.parent, env=environment, **pipes)
        for code in (held, "import numba, time; input(); import solvers.one; ")
    )
    with first, second:
        assert first.stdout.readline() == "1\n"  # it has the lock
        own = "import solvers.compiled.decorators; from numba import njit; print(njit(lambda x: x)(1.0))"
        assert ran(own, package.parent, NUMBA_CACHE_DIR="")[0] == ["1.0"]  # code of others does not wait
        second.stdin.write("\n")
        second.stdin.flush()
        time.sleep(1.0)
        end = first.communicate("\n")[0]
        assert float(second.communicate()[0]) > float(end)


FORKED = """
import os, signal, solvers.compiled.cache as c, solvers.compiled.decorators as d
with d._ONE_PROCESS.alone('own'):
    child = os.fork()
    if not child:
        os.close(1), os.close(2), signal.alarm(20)
        signal.pause()
    {}
c._PATIENCE = 3.0
print(c.lock_folder(print, c.lock_of('own')) is not None)
os.kill(child, signal.SIGKILL)
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no such processes")
def test_a_forked_process_does_not_keep_the_lock(package):
    """What is forked while code is compiled has the file open too: the lock goes back all the same, also by a death."""
    assert ran(FORKED.format("pass"), package.parent)[0] == ["True"]
    left = ran(FORKED.format("print(child, flush=True); os._exit(0)"), package.parent)[0]
    look = "import solvers.compiled.cache as c; c._PATIENCE = 3.0; "
    look += "print(c.lock_folder(print, c.lock_of('own')) is not None)"
    assert ran(look, package.parent)[0] == ["True"]
    os.kill(int(left[0]), signal.SIGKILL)


def test_waiting_for_the_lock_can_be_stopped(monkeypatch):
    """Ctrl-C then leaves nothing behind by which this process would never give the lock back."""
    one = decorators._OneProcess()

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(decorators, "lock_folder", interrupted)
    with pytest.raises(KeyboardInterrupt), one.alone():
        pass
    assert one._depth == 0


@pytest.mark.skipif(sys.platform == "win32", reason="no such locks")
def test_patience_with_a_process_that_hangs_ends(monkeypatch, tmp_path):
    """Nothing is kept from then on, which is said, and nobody waits again."""
    monkeypatch.setattr(cache, "FOLDER", tmp_path)
    held, told = cache.lock_folder(print), []
    monkeypatch.setattr(cache, "_PATIENCE", 0.1)
    monkeypatch.setattr(cache, "_LOOKS", 2)
    with pytest.warns(UserWarning, match=r"has kept .*lock for 0.1 s: machine code is compiled and not kept"):
        assert cache.lock_folder(lambda: told.append(1)) is None
    assert told == [1]
    assert cache.FOLDER is None
    assert not cache.is_current(cache.store)
    cache.unlock_folder(held)


@pytest.mark.skipif(sys.platform == "win32", reason="no such locks")
def test_processes_killed_while_they_compile(package):
    """Several begin with nothing kept, some are killed: the other ends, with the right code, and so does who comes."""
    entry = (
        "from numba import float64\nfrom solvers.compiled.decorators import entry\nfrom solvers.inner import times\n"
    )
    for name in ("one", "two", "three"):
        (package / f"{name}.py").write_text(entry + f"@entry(float64(float64))\ndef {name}(x): return times(x) + 1.0\n")
    code = "import solvers.compiled.decorators\nprint(0, flush=True)\nimport solvers.one, solvers.two, solvers.three\n"
    code += "print(solvers.one.one(1.0), solvers.two.two(2.0), solvers.three.three(3.0))"
    environment = {**os.environ, "PYTHONPATH": str(package.parent), "NUMBA_CACHE_DIR": ""}
    known = "{} {} {}\n".format(*(2.0 * x + 1.0 for x in (1.0, 2.0, 3.0)))
    pipes: Any = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL, "text": True}
    command = [sys.executable, "-c", code]
    each = [subprocess.Popen(command, cwd=package.parent, env=environment, **pipes) for _ in range(3)]
    for number, one in enumerate(each[:2]):
        one.stdout.readline()
        time.sleep(0.05 * number)
        one.kill()
        one.communicate()
    assert [one.communicate(timeout=120)[0].splitlines()[-1] + "\n" for one in each[2:]] == [known]
    assert " ".join(ran(code, package.parent)[0][1:]) + "\n" == known


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


FULL = """
from numba.core.caching import IndexDataCacheFile
def full(*_):
    raise OSError(28, "No space left on device")
IndexDataCacheFile._open_for_write = full
"""
REMOVED = "import solvers.compiled.decorators, solvers.compiled.cache as c, shutil; shutil.rmtree(c.FOLDER)\n"


def test_a_full_disk_is_told_once_and_code_runs_all_the_same(package):
    said, warned = ran(FULL + CALL, package.parent)
    assert said == ["2.0", "0"]
    assert warned.count("\n") == warned.count("not kept") == warned.count("No space left on device") == 1
    shutil.copy(laws.__file__, package / "laws.py")
    said, warned = ran(FULL + "import solvers.laws as k; print(k.polynomial.address > 0)", package.parent)
    assert said == ["True"]
    assert warned.count("\n") == warned.count("not kept") == warned.count("No space left on device") == 1


def test_a_folder_removed_while_a_process_runs_is_made_again(package):
    assert ran(REMOVED + CALL, package.parent) == (["2.0", "0"], "")
    assert ran(CALL, package.parent) == (["2.0", "1"], "")


def test_a_place_that_is_lost_while_a_process_runs_is_not_replaced_by_one_where_old_code_may_lie(package):
    """numba would take the folder beside the source, where a function is known by its own file alone."""
    assert ran(REMOVED + "open(c.FOLDER, 'w').close()\n" + CALL, package.parent) == (["2.0", "0"], "")
    assert not list(package.rglob("*.nb[ic]"))


def test_damaged_files_are_written_anew(package):
    ran(CALL, package.parent)
    damaged = [*package.rglob("inner*.nbi"), *package.rglob("outer*.nbc")]
    assert len(damaged) == 2
    for path in damaged:
        path.write_bytes(path.read_bytes()[:-7])
    assert ran(CALL, package.parent) == (["2.0", "0"], "")
    assert ran(CALL, package.parent) == (["2.0", "1"], "")


def test_a_later_process_compiles_nothing():
    """Every method on every kind of own law; what no process has kept yet is compiled here first."""
    every_method.run_all()
    code = [sys.executable, "-W", "error", every_method.__file__]
    done = subprocess.run(code, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_no_function_takes_a_function():
    """numba keeps no machine code that holds an address; the processor decides whether one is left out."""
    every_method.run_all()
    taken = []
    for path in (cache.FOLDER or Path()).rglob("*.nbi"):
        with path.open("rb") as file:
            pickle.load(file)  # numba's version
            taken += [str(key[0]) for key in pickle.load(file)[1]]
    assert taken or cache.FOLDER is None
    assert [signature for signature in taken if "Dispatcher" in signature] == []


FACTORY = """
from contacts import law
from numba import njit
def made(stiffness):
    @njit
    def spring(delta):
        return stiffness * delta
    @law
    def linear(delta, delta_dot, entry_rate):
        return spring(delta)
    return linear()
laws = [made(value) for value in {}]
print(*(float(one.force(1.0)) for one in laws), *(one.kernel._cache_hits for one in laws))
"""


def test_own_laws_of_one_name_are_kept_apart(tmp_path):
    """Machine code that two processes made of two functions of one name would be one function to a third."""
    for values, said in (([2.0], "2.0 0"), ([3.0, 2.0], "3.0 2.0 0 1")):
        found = ran(FACTORY.format(values), tmp_path, NUMBA_CACHE_DIR=str(tmp_path))
        assert " ".join(found[0]) == said


GIVEN = np.array([1.0, 2.0])


def digest_of(constant, helper=None):
    """Of a function with this constant and this function within."""

    def force(delta):
        return constant * delta + GIVEN[0] + (helper(delta) if helper else 0.0)

    return own._digest(force)


def test_a_digest_tells_all_that_a_law_is_made_of(monkeypatch):
    def twice(x):
        return 2.0 * x

    def thrice(x):
        return 3.0 * x

    found = [digest_of(2.0), digest_of(2), digest_of(3.0), digest_of(np.float32(2.0)), digest_of((2.0, 3.0))]
    found += [digest_of(math.sqrt), digest_of(cmath.sqrt)]
    found += [digest_of(2.0, njit(f, **options)) for f in (twice, thrice) for options in ({}, {"fastmath": True})]
    monkeypatch.setitem(globals(), "GIVEN", np.array([1.0, 3.0]))
    found.append(digest_of(2.0))
    assert None not in found
    assert len(set(found)) == len(found)
    assert digest_of(2.0) == found[-1]


def test_a_digest_tells_which_name_stands_for_what():
    """A function of the name of a built-in one takes its place."""
    found = []
    for name in ("min", "max"):
        space = {name: njit(lambda a, b: a)}
        exec("def force(delta):\n    return min(delta, 1.0) + max(delta, 2.0)", space)
        found.append(own._digest(space["force"]))
    assert None not in found
    assert found[0] != found[1]


def overloaded(x):
    """Stands for what numba has as its overload, which is not seen."""


@pytest.mark.parametrize("constant", [[2.0], {"K": 2.0}, SimpleNamespace(K=2.0), shutil, np.zeros(200000), overloaded])
def test_what_may_change_unseen_has_no_digest(constant):
    assert digest_of(constant) is None


def test_the_last_used_laws_stay(tmp_path, monkeypatch):
    monkeypatch.setattr(own, "KEPT", 2)
    for i, name in enumerate("abcd"):
        for path in (tmp_path / f"custom_kernels.{name}.nbi", tmp_path / f"custom_kernels.{name}.1.nbc"):
            path.touch()
            os.utime(path, (i, i))
    own._drop_oldest(tmp_path)
    assert sorted({path.name.split(".")[1] for path in tmp_path.iterdir()}) == ["c", "d"]


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
