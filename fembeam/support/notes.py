"""What is told of the work done: messages by `logging`, warnings of the line that asked for it."""

from __future__ import annotations

import sys
import warnings

OURS = {"fembeam", "contacts", "reduction", "solvers"}
WITHIN = OURS | {"contextlib", "dataclasses", "functools", "scipy"}  # and what calls back: no lines of a user


def note(message: str, *values: object) -> None:
    """Log a message at level INFO, silent unless asked for; its values are formatted only if somebody listens."""
    import logging

    logging.getLogger("fembeam").info(message, *values)


def warn(message: str) -> None:
    """A UserWarning of the nearest line outside of the package, however deep within it arises."""
    depth, frame = 1, sys._getframe()
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] in WITHIN:
        depth, frame = depth + 1, frame.f_back
    warnings.warn(message, UserWarning, stacklevel=depth)
