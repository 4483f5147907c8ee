"""Where machine code is kept between processes: folders named by digests of all that it is compiled from.

numba takes a kernel from its cache as long as the kernel's own file is unchanged; functions it calls from other files
may be new all the same. With a folder for each state of the sources no old machine code can be found. All kernels call
those of `GROUND`, and else of their own room alone: of a folder for each state of the ground, every room has a folder
within for each state of its own. So a change of one method leaves the code of the others as it is.
"""

from __future__ import annotations

import hashlib
import logging
import os
import shutil
import sys
import tempfile
import threading
import time
import warnings
import zlib
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

import llvmlite
import numba
import numpy as np
from numba import config
from numba.core.caching import FunctionCache

HOME = Path(__file__).parent.parent
GROUND = "compiled", "problem"  # rooms that kernels of every room may call
PREFIX = "fembeam-kernels-"
KEPT = 4  # folders of other sources, versions or interpreters that stay, so that changing between them compiles once
DIGITS = 16  # of a digest
UNUSED = 24 * 3600.0  # s without a start after which one beyond these is removed; until then a process may need it
_LOOK, _LOOKS = 0.02, 100  # s between two looks whether another process still compiles, and how many in silence
_PATIENCE = 300.0  # s to wait for it; one kernel takes seconds, so that a process that long at it is stopped or hangs
_LOCKS = 4096  # of functions that are compiled by themselves: so many that hardly two share one
_LOCK = threading.RLock()  # numba's setting belongs to the process


def _room(path: str) -> str:
    """Folder of `HOME` that a source lies in; "." of those in none, and "" of the ground."""
    name, *within = Path(path).relative_to(HOME).parts
    return ("" if name in GROUND else name) if within else "."


def _stamps() -> dict[str, tuple[int, int]]:
    """Time of change and size of every source file; folders of machine code, with thousands of others, are left out."""
    found = []
    for folder, inside, names in os.walk(HOME):
        inside[:] = [name for name in inside if name != "__pycache__"]
        found += [os.path.join(folder, name) for name in names if name.endswith(".py")]
    return {path: _stamp(path) for path in sorted(found)}


def _stamp(path: str) -> tuple[int, int]:
    try:
        found = os.stat(path)
    except FileNotFoundError:  # removed meanwhile: changed
        return 0, 0
    return found.st_mtime_ns, found.st_size


def _digest(paths: list[str]) -> str:
    """Of sources and versions; the processor is numba's own key."""
    versions = (sys.version, numba.__version__, llvmlite.__version__, np.__version__)
    found = hashlib.sha256(repr(versions).encode())
    for path in paths:
        with open(path, "rb") as file:
            content = file.read()
        found.update(f"{os.path.relpath(path, HOME)} {len(content)} ".encode() + content)
    return found.hexdigest()[:DIGITS]


def _permanent_places() -> Iterator[Path]:
    """Places that outlive the process, the best first."""
    if config.CACHE_DIR:
        yield Path(config.CACHE_DIR)
    yield HOME / "__pycache__"
    users = os.environ.get("LOCALAPPDATA" if os.name == "nt" else "XDG_CACHE_HOME")
    with suppress(RuntimeError):  # no home
        yield Path(users) if users else Path.home() / ".cache"


def _opened(place: Path, name: str) -> bool:
    """Make the folder if need be, and see whether it can be written to; a new one takes the place of old ones."""
    folder = place / name
    try:
        place.mkdir(parents=True, exist_ok=True)
        with suppress(FileExistsError):
            folder.mkdir()
            _remove_unused(place, folder)
        tempfile.TemporaryFile(dir=folder).close()
        os.utime(folder)
    except OSError:
        return False
    return True


def _remove_unused(place: Path, folder: Path) -> None:
    """Remove folders unused for a day, but for the last few; no process that uses them is likely to be left."""
    last_used = {}
    for other in place.glob(PREFIX + "[0-9a-f]" * DIGITS):  # nothing but what was made here
        with suppress(OSError):  # removed by another process just now
            last_used[other] = other.stat().st_mtime
    last_used.pop(folder, None)
    for other in sorted(last_used, key=last_used.__getitem__, reverse=True)[KEPT:]:
        if time.time() - last_used[other] > UNUSED:
            shutil.rmtree(other, ignore_errors=True)


def _temporary() -> Path:
    """A folder in the system's temporary one that only this user can write to: what is loaded from it is run."""
    user = getattr(os, "getuid", int)()
    place = Path(tempfile.gettempdir(), f"{PREFIX}of-{user}")
    place.mkdir(mode=0o700, exist_ok=True)
    found = place.lstat()
    if os.name == "posix" and (found.st_uid != user or found.st_mode & 0o022):
        raise PermissionError(f"{place} can be written by others")
    return place


def _warn(what: str) -> None:
    """One line: there is no caller whose line would tell more."""
    warnings.warn_explicit(f"{what}; set NUMBA_CACHE_DIR to a folder that lasts", UserWarning, str(HOME), 0)


def _folder(name: str) -> Path | None:
    """The folder for these sources, or None where nothing can be written; warns where none is permanent."""
    for place in _permanent_places():
        if _opened(place, name):
            return place / name
    with suppress(OSError):
        place = _temporary()
        if _opened(place, name):
            _warn(f"machine code is kept in {place}: neither {HOME / '__pycache__'} nor a user's cache can be written")
            return place / name
    _warn("every start compiles for half a minute: there is no folder that machine code can be written to")
    return None


_STAMPS = _stamps()
_OPENED: set[str] = set()  # rooms whose folder has been made
_ROOMS = {path: _room(path) for path in _STAMPS}
_NAMES = {room: PREFIX + _digest([path for path in _STAMPS if _ROOMS[path] == room]) for room in {*_ROOMS.values()}}
FOLDER = _folder(_NAMES[""])


def is_current(function: Callable[..., Any]) -> bool:
    """Whether a function is one of these sources, as they were when the digest was made.

    It is not where a file was changed since: what is defined from then on may call what is in it.
    """
    global FOLDER
    path = function.__code__.co_filename
    if path in _STAMPS and _STAMPS[path] != _stamp(path):
        FOLDER = None
    return FOLDER is not None and path in _STAMPS


def lock_of(work: str) -> str:
    """Name of the lock of some work; different work may go on at the same time, but for a few that share one."""
    return f"lock{zlib.crc32(work.encode()) % _LOCKS}"


def lock_folder(waiting: Callable[[], None], name: str = "lock") -> IO[bytes] | None:
    """Keep other processes from the folder until the returned file is closed; ``waiting`` is called if one has it long.

    None where there is nothing to keep, or no locks: on Windows, on some network disks. Where another process keeps it
    for minutes nothing is kept from then on, so that the caller may go on.
    """
    global FOLDER
    if FOLDER is None:
        return None
    try:
        import fcntl

        file = open(FOLDER / name, "ab")  # noqa: SIM115  closed by who asked
        began, looks = time.monotonic(), 0
        while time.monotonic() - began < _PATIENCE:
            with suppress(BlockingIOError):
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                return file
            time.sleep(_LOOK)
            looks += 1
            if looks == _LOOKS:
                waiting()
        file.close()
        FOLDER = None
        _warn(f"another process has kept {file.name} for {_PATIENCE:g} s: machine code is compiled and not kept")
        return None
    except (ImportError, OSError):
        return None


def unlock_folder(file: IO[bytes]) -> None:
    """Give the folder back, also where a process that was forked meanwhile still has the file open."""
    with suppress(ImportError, OSError):
        import fcntl

        fcntl.flock(file, fcntl.LOCK_UN)
    file.close()


class _Store(FunctionCache):
    """numba's cache of one function; what cannot be kept or read is compiled, and that nothing is kept is said once."""

    told = False

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """What was kept, or None; a file that is damaged is written anew."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # of whatever a damaged file is taken for
            with suppress(OSError):
                self.flush()

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled.

        numba counts the files of a function's signatures: two processes that keep one each at the same time would give
        both the same number, and every later one would load the wrong code.
        """
        if FOLDER is None:  # sources changed, or others would not give the lock back
            return
        held = lock_folder(lambda: None, "store")
        try:
            super().save_overload(sig, data)
        except OSError as error:
            if not _Store.told:
                _Store.told = True
                logging.getLogger("fembeam.solvers").warning(
                    f"the integrator is compiled but not kept, every start takes half a minute: {error}"
                )
        finally:
            if held is not None:
                unlock_folder(held)


def _folder_of(function: Callable[..., Any]) -> Path:
    """The folder within ours for the sources of a function's room."""
    assert FOLDER is not None
    room = _room(function.__code__.co_filename)
    if not room:
        return FOLDER
    if room not in _OPENED:
        _opened(FOLDER, _NAMES[room])
        _OPENED.add(room)
    return FOLDER / _NAMES[room]


def store(function: Callable[..., Any]) -> FunctionCache | None:
    """The cache of a function in our folder; None where its machine code is not to be kept."""
    with _LOCK:
        before = config.CACHE_DIR
        if not is_current(function):
            return None
        place = _folder_of(function)
        config.CACHE_DIR = str(place)
        try:
            found = _Store(function)
        except RuntimeError:  # numba finds no place to write to
            return None
        finally:
            config.CACHE_DIR = before
        return found if Path(found.cache_path).parent == place else None  # elsewhere old code may lie
