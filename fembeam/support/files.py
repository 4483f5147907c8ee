"""Files that appear whole or not at all."""

from __future__ import annotations

import csv
import io
import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from errno import EISDIR, ENOENT
from pathlib import Path
from typing import Any

from fembeam.support.cards import included_files
from fembeam.support.checks import require

DRAFT = ".part"  # end of the name of a file that is not complete
MAPPING = (".mapping", ".MAPPING")  # of Harwell–Boeing files
BESIDE = {
    **{".sti": (".dof",), ".mas": (".dof",), ".xdmf": (".h5",), ".xmf": (".h5",)},
    **dict.fromkeys((".matrix", ".hb", ".rsa", ".rua", ".hbmat"), MAPPING),
}


def read_with(path: Path) -> Iterator[str]:
    """Names, from its folder, of the files there that are read with a file: of dofs, of data, those it includes."""
    for suffix in BESIDE.get(path.suffix.lower(), ()):
        if path.with_suffix(suffix).is_file():
            yield path.with_suffix(suffix).name
    if path.suffix.lower() == ".inp" and path.is_file():
        yield from included_files(path)


def file_path(given: Any, where: str) -> Path:
    """What was given as a path, or ValueError.

    Examples
    --------
    >>> file_path(None, "load")
    Traceback (most recent call last):
    ValueError: path must be text or a pathlib.Path, got None in load; write e.g. 'results/run'
    """
    right = isinstance(given, (str, os.PathLike)) and isinstance(os.fspath(given), str) and os.fspath(given) != ""
    require(right, "path must be text or a pathlib.Path", given, where, "write e.g. 'results/run'")
    return Path(given)


@contextmanager
def written_whole(target: Path) -> Iterator[Any]:
    """A binary file that appears under its name only once complete; OSError without its folder, or for a folder."""
    if not target.parent.is_dir():
        raise FileNotFoundError(ENOENT, f"no such folder to write {target.name} to; make it first", str(target.parent))
    if target.is_dir():
        raise IsADirectoryError(EISDIR, "a folder is there; give the name of a file", str(target))
    with _named(target):
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.", suffix=DRAFT)
        try:
            with os.fdopen(handle, "w+b") as file:
                yield file
                file.flush()
                os.fsync(handle)  # else a loss of power may leave the new name with nothing in it
            mask = os.umask(0)  # mkstemp makes private files; results are for the user's group too
            os.umask(mask)
            os.chmod(name, 0o666 & ~mask)
            os.replace(name, target)
        except BaseException:
            Path(name).unlink(missing_ok=True)  # Ctrl-C comes after the file has its name, too
            raise


@contextmanager
def _named(target: Path) -> Iterator[None]:
    """Errors name the file to be written: a full disk names none, a folder that is read only the draft."""
    try:
        yield
    except OSError as error:
        if error.errno and (error.filename is None or f".{target.name}." in str(error.filename)):
            raise OSError(error.errno, error.strerror, str(target)) from error
        raise


@contextmanager
def one_at_a_time(folder: Path) -> Iterator[None]:
    """Wait until no other process is here for this folder; where there are no such locks, as on Windows, do not."""
    try:
        import fcntl
    except ImportError:
        yield
        return
    with ExitStack() as at_end:
        with suppress(OSError):  # some network disks have none
            handle = os.open(folder, os.O_RDONLY)
            at_end.callback(os.close, handle)
            fcntl.flock(handle, fcntl.LOCK_EX)
            at_end.callback(fcntl.flock, handle, fcntl.LOCK_UN)  # a process forked meanwhile has the handle too
        yield


@contextmanager
def written_beside(target: Path) -> Iterator[str]:
    """Where others' code writes a file, alone or with more: they get their names once complete, the target last."""
    with _named(target), tempfile.TemporaryDirectory(dir=target.parent, prefix=f".{target.name}.") as folder:
        yield os.path.join(folder, target.name)
        for name in sorted(os.listdir(folder), key=target.name.__eq__):
            os.replace(os.path.join(folder, name), target.with_name(name))


def write_rows(target: Path, rows: Sequence[Mapping[str, Any]], units: Mapping[str, str]) -> None:
    """Rows with the same keys as a CSV file that appears whole or not at all, units in the heads of its columns."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writerow({name: _head(name, units.get(name, "")) for name in rows[0]})
    writer.writerows(rows)
    with written_whole(target) as file:
        file.write(text.getvalue().encode())


def _head(name: str, unit: str) -> str:
    """A column's name with its unit, if it has one: "omega [rad/s]"."""
    return f"{name} [{unit.replace(' s⁻¹', '/s')}]" if unit else name
