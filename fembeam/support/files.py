"""Files that appear whole or not at all."""

from __future__ import annotations

import csv
import io
import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from errno import ENOENT
from pathlib import Path
from typing import Any


@contextmanager
def written_whole(target: Path) -> Iterator[Any]:
    """A binary file that appears under its name only once it is complete; FileNotFoundError without its folder."""
    if not target.parent.is_dir():
        raise FileNotFoundError(ENOENT, f"no such folder to write {target.name} to; make it first", str(target.parent))
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    try:
        with os.fdopen(handle, "w+b") as file:
            yield file
        mask = os.umask(0)  # mkstemp makes private files; results are for the user's group too
        os.umask(mask)
        os.chmod(name, 0o666 & ~mask)
        os.replace(name, target)
    except BaseException:
        os.unlink(name)
        raise


@contextmanager
def written_beside(target: Path) -> Iterator[str]:
    """Where others' code writes a file, alone or with more: they get their names once complete, the target last."""
    with tempfile.TemporaryDirectory(dir=target.parent, prefix=f".{target.name}.") as folder:
        yield os.path.join(folder, target.name)
        for name in sorted(os.listdir(folder), key=target.name.__eq__):
            os.replace(os.path.join(folder, name), target.with_name(name))


def write_rows(target: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Rows with the same keys as a CSV file that appears whole or not at all."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    with written_whole(target) as file:
        file.write(text.getvalue().encode())
