"""Files that appear whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
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
