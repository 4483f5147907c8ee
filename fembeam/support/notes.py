"""Messages about the work done: `logging` under the name fembeam, at level INFO, silent unless asked for."""

from __future__ import annotations


def note(message: str, *values: object) -> None:
    """Log a message; its values are formatted only if somebody listens."""
    import logging

    logging.getLogger("fembeam").info(message, *values)
